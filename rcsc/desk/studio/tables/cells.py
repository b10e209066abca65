"""Changes that a grid makes of a table, as changes of its text.

In: a text, a table's name, what is to be changed. Out: the text with it. After each change the table is read again from the text, cell by
cell; where it does not say what was asked for, nothing is changed. Comments stay where they are, rows that go on with a line are kept, and
a text that parses is laid out as `rcsc fmt` does it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source
from rcsc.desk.editor.grid import line_cells
from rcsc.lang.syntax.rows import Cell, Cells, stub_of
from rcsc.lang.written.changes import Splice, formatted, new_line, over, row_text, spliced
from rcsc.lang.written.tables import (
    WrittenPart,
    WrittenTable,
    cells_of,
    dashes,
    fresh_name,
    joined_cells,
    pieces,
    table_of,
    whole_line,
    written_cell,
)

MOST_CELLS = 20_000
"""Cells that may be written at once."""
LONGEST_CELL = 4_000
STUB = -1
"""The column of the line's name and marks."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A table, cell by cell.

    Attributes:
        stubs: Name and marks of each line.
        conditions: How many of its columns are conditions.
    """

    headings: tuple[str, ...]
    conditions: int
    stubs: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]


def sheet_of(table: WrittenTable) -> Sheet:
    """Return the cells of a table."""
    heads = [joined_cells(part.heading) for part in table.parts]
    conditions = [cell.text for head in heads for cell in head.conditions[1:]]
    actions = [cell.text for head in heads for cell in head.actions]
    lines = [line_cells(groups, heads) for groups in zip_longest(*(part.lines for part in table.parts))]
    stubs = tuple(stub.text for stub, _, _ in lines)
    rows = tuple(tuple(cell.text for cell in (*own, *does)) for _, own, does in lines)
    return Sheet((*conditions, *actions), len(conditions), stubs, rows)


# --- changes ------------------------------------------------------------------------------


def with_cells(text: str, name: str, changes: Mapping[tuple[int, int], str]) -> str:
    """Write cells, headings and stubs; a line's new name is written in every part, and where other lines name it.

    A cell is named by line and column from 0; conditions of all parts are counted first, then actions. Line -1 is the heading.

    Raises:
        Refused: There is no such cell, or the text would not say what was asked for.
    """
    table = _table(text, name)
    before = sheet_of(table)
    if len(changes) > MOST_CELLS:
        raise Refused(Code.STUDIO, f"more than {MOST_CELLS} cells at once")
    wanted = {place: _checked(new) for place, new in changes.items()}
    splices = list[Splice]()
    headings, stubs, cells = list(before.headings), list(before.stubs), [list(row) for row in before.cells]
    for (line, column), new in wanted.items():
        if not (-1 <= line < len(before.stubs) and -1 <= column < len(before.headings)):
            raise Refused(Code.STUDIO, f"table `{name}` has no cell in line {line + 1}, column {column + 1}")
        if column == STUB:
            if line < 0:
                raise Refused(Code.STUDIO, "the heading of the first column is `line`")
            stubs[line] = new
            continue
        if line < 0:
            headings[column] = new
        else:
            cells[line][column] = new
        splices += _cell_splices(text, table, line, column, new)
    names = [(name_of(old), name_of(new)) for old, new in zip(before.stubs, stubs, strict=True)]
    renamed = {old: new for old, new in names if old and old != new}
    splices += _stub_splices(table, before.stubs, stubs, renamed)
    wanted_stubs = (
        _renamed(new, renamed) if new == old else new for old, new in zip(before.stubs, stubs, strict=True)
    )
    after = Sheet(tuple(headings), before.conditions, tuple(wanted_stubs), tuple(map(tuple, cells)))
    return _sure(text, name, spliced(text, splices), after)


def with_line(text: str, name: str, at: int, cells: Sequence[str] = (), stub: str = "") -> str:
    """Insert a line before position `at`.

    Args:
        text: Of the file.
        name: Of the table.
        at: From 0 to the number of lines.
        cells: One a column; empty for none.
        stub: Its name; empty for a new one.

    Raises:
        Refused: There is no such place, or the text would not say what was asked for.
    """
    table = _table(text, name)
    before = sheet_of(table)
    if not 0 <= at <= len(before.stubs):
        raise Refused(Code.STUDIO, f"table `{name}` has no place {at} for a line")
    row = tuple(_checked(cell) for cell in cells) or ("",) * len(before.headings)
    stub = _checked(stub) or fresh(before, at)
    splices = new_line(text, table, at, stub, row)
    after = Sheet(
        before.headings,
        before.conditions,
        (*before.stubs[:at], stub, *before.stubs[at:]),
        (*before.cells[:at], row, *before.cells[at:]),
    )
    return _sure(text, name, spliced(text, splices), after)


def without_lines(text: str, name: str, lines: Sequence[int]) -> str:
    """Delete lines.

    Raises:
        Refused: There is no such line, or the text would not say what was asked for.
    """
    table = _table(text, name)
    before = sheet_of(table)
    gone = set(lines)
    if not gone <= set(range(len(before.stubs))):
        raise Refused(Code.STUDIO, f"table `{name}` has {len(before.stubs)} lines")
    splices = [
        (*whole_line(text, row), "")
        for part in table.parts
        for at in gone
        if at < len(part.lines)
        for row in part.lines[at]
    ]
    kept = [at for at in range(len(before.stubs)) if at not in gone]
    after = Sheet(
        before.headings,
        before.conditions,
        tuple(before.stubs[at] for at in kept),
        tuple(before.cells[at] for at in kept),
    )
    return _sure(text, name, spliced(text, splices), after)


def with_column(text: str, name: str, at: int, heading: str, *, action: bool) -> str:
    """Insert a column of empty cells.

    Args:
        text: Of the file.
        name: Of the table.
        at: Before which column; the number of conditions, or of columns, to come last of its kind.
        heading: Not empty.
        action: Whether it is one of those after `||`.

    Raises:
        Refused: There is no such place, or the text would not say what was asked for.
    """
    table = _table(text, name)
    before = sheet_of(table)
    low, high = (before.conditions, len(before.headings)) if action else (0, before.conditions)
    if not low <= at <= high:
        raise Refused(Code.STUDIO, f"table `{name}` has no place {at} for such a column")
    if not _checked(heading):
        raise Refused(
            Code.STUDIO, "a column needs a heading", "a variable, an expression, `when`, or `procedures`"
        )
    part, side = _part_of(table, at, action=action)

    def insert(cells: tuple[str, ...], new: str, first: int) -> tuple[str, ...]:
        return (*cells[: side + first], new, *cells[side + first :])

    def change(cells: Cells, *, top: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
        left, right = (tuple(cell.text for cell in each) for each in (cells.conditions, cells.actions))
        new = heading if top else ""
        if action and table.once(cells):
            return left, right
        return (left, insert(right, new, 0)) if action else (insert(left, new, 1), right)

    splices = list(_reshaped(table, part, change))
    after = Sheet(
        (*before.headings[:at], heading, *before.headings[at:]),
        before.conditions + (not action),
        before.stubs,
        tuple(
            (*row, "") if action and once else (*row[:at], "", *row[at:])
            for row, once in zip(before.cells, _once(table), strict=True)
        ),
    )
    return _sure(text, name, spliced(text, splices), after)


def without_column(text: str, name: str, at: int) -> str:
    """Delete a column; a part of the table that has no other goes with it.

    Raises:
        Refused: There is no such column, it is the only one, or the text would not say what was asked for.
    """
    table = _table(text, name)
    before = sheet_of(table)
    if not 0 <= at < len(before.headings) or len(before.headings) == 1:
        raise Refused(Code.STUDIO, f"table `{name}` has no column {at + 1} that could be deleted")
    action = at >= before.conditions
    part, side = _part_of(table, at, action=action, inside=True)
    heading = joined_cells(part.heading)
    if len(heading.conditions) - 1 + len(heading.actions) == 1:
        splices = [(*whole_line(text, row), "") for row in table.rows_of(part)]
    else:

        def change(cells: Cells, *, top: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:  # noqa: ARG001  # as for one that is new
            left, right = (tuple(cell.text for cell in each) for each in (cells.conditions, cells.actions))
            if action and table.once(cells):
                return left, right
            if action:
                return left, (*right[:side], *right[side + 1 :])
            return (*left[: side + 1], *left[side + 2 :]), right

        splices = list(_reshaped(table, part, change))
    after = Sheet(
        (*before.headings[:at], *before.headings[at + 1 :]),
        before.conditions - (not action),
        before.stubs,
        tuple(
            row[:-1] if action and once else (*row[:at], *row[at + 1 :])
            for row, once in zip(before.cells, _once(table), strict=True)
        ),
    )
    return _sure(text, name, spliced(text, splices), after)


def _once(table: WrittenTable) -> list[bool]:
    """Return for each line whether what it does stands in one cell for all columns."""
    first = max(table.parts, key=lambda part: len(part.lines))
    return [table.once(joined_cells(rows)) for rows in first.lines]


def fresh(sheet: Sheet, at: int) -> str:
    """Return a name for a line before position `at` that no other has."""
    names = [name_of(stub) for stub in sheet.stubs]
    return fresh_name(names, names[at - 1] if 0 < at <= len(names) else "")


def name_of(stub: str) -> str:
    """Return the name in a stub, without its marks."""
    return stub_of(Cell(stub, "", 0)).name.text


# --- parts --------------------------------------------------------------------------------


def _table(text: str, name: str) -> WrittenTable:
    table = table_of(text, name)
    if table is None or not table.parts:
        raise Refused(Code.STUDIO, f"the text has no table `{name}` with a heading")
    return table


def _checked(text: str) -> str:
    """Return a cell's text in one line.

    Raises:
        Refused: No cell can hold it.
    """
    text = " ".join(text.split())
    if len(text) > LONGEST_CELL:
        raise Refused(Code.STUDIO, f"a cell of more than {LONGEST_CELL} characters")
    if "|" in text:
        raise Refused(
            Code.STUDIO, "a cell holds no `|`: it parts cells", "conditions are joined by `or` under `when`"
        )
    if "#" in text:
        raise Refused(
            Code.STUDIO, "a cell holds no `#`: it begins a comment", "write the comment in the text"
        )
    if not text.isprintable():
        raise Refused(Code.STUDIO, "a cell holds letters, digits and signs only")
    return "" if text == "-" else text


def _sure(before: str, name: str, after: str, wanted: Sheet) -> str:
    """Lay out the text, if its table has the wanted cells.

    Raises:
        Refused: Its table has other cells.
    """
    table = table_of(after, name)
    if table is None or sheet_of(table) != wanted:
        raise Refused(Code.STUDIO, "the table would not say what was typed", "change the text itself")
    return formatted(Source("", after), "\n") or after if before != after else after


def _cell_splices(text: str, table: WrittenTable, line: int, column: int, new: str) -> Sequence[Splice]:
    """Return what writes a cell into the first of its rows, and takes it out of the others."""
    found = written_cell(table, line, column)
    if found is None:
        raise Refused(Code.STUDIO, "this line has other cells than the heading", "mend it in the text")
    return over(text, found[1], new, found[0])


def _stub_splices(
    table: WrittenTable, before: Sequence[str], after: Sequence[str], renamed: Mapping[str, str]
) -> Iterator[Splice]:
    """Yield the splices that write changed stubs in every part, and new names where other lines name a line by its old one."""
    if tuple(before) == tuple(after):
        return
    for number, part in enumerate(table.parts):
        for at, rows in enumerate(part.lines):
            stub = joined_cells(rows).conditions[0]
            if at < len(before) and before[at] != after[at]:
                yield (*pieces(stub)[0], after[at] if number == 0 else name_of(after[at]))
            elif number == 0:
                yield from _mark_splices(stub, renamed)


def _mark_splices(stub: Cell, renamed: Mapping[str, str]) -> Iterator[Splice]:
    """Yield the splices that write new names where a stub names other lines."""
    marked = stub_of(stub)
    for mark in (*marked.above, *marked.same):
        if mark.text in renamed:
            yield mark.start, mark.start + len(mark.text), renamed[mark.text]


def _renamed(stub: str, renamed: Mapping[str, str]) -> str:
    return spliced(stub, list(_mark_splices(Cell(stub, "", 0), renamed)))


def _part_of(table: WrittenTable, at: int, *, action: bool, inside: bool = False) -> tuple[WrittenPart, int]:
    """Find the part that has a column, or takes one before it, and the column's position among its own of this kind."""
    parts = table.parts
    every = [joined_cells(part.heading) for part in parts]
    at -= sum(len(heading.conditions) - 1 for heading in every) if action else 0
    for part, heading in zip(parts, every, strict=True):
        many = len(heading.actions) if action else len(heading.conditions) - 1
        if at < many or (at == many and not inside and (part is parts[-1] or not action)):
            return part, at
        at -= many
    raise AssertionError("a column is in a part")


def _reshaped(
    table: WrittenTable, part: WrittenPart, change: Callable[..., tuple[tuple[str, ...], tuple[str, ...]]]
) -> Iterator[Splice]:
    """Yield the splices that give every row of a part other cells; `change` is told whether a row is the first of the heading."""
    for row in table.rows_of(part):
        body, mark, comment = row.partition("#")
        tail = f" {mark}{comment}" if mark else ""
        if dashes(row):
            left, _, right = body.partition("||")
            cells = Cells((Cell("", "", 0),) * left.count("|"), (Cell("", "", 0),) * right.count("|"))
            conditions, actions = change(cells, top=False)
            yield row.start, row.past, row_text(["---"] * len(conditions), ["---"] * len(actions), "") + tail
        else:
            top = row.start == part.heading[0].start
            yield row.start, row.past, row_text(*change(cells_of(row), top=top)) + tail
