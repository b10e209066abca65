r"""What keys do in tables: columns stay aligned, tab goes to the next cell, a line or a column is added by one action.

In: a text and an offset. Out: splices, or a new text with a new offset. Nothing here asks whether the text parses: rows that have
as many cells as their heading are aligned, others are left as they are until they have.

>>> text = "table t {\n| line | a ||\n|--|--||\n| long_name | 1 ||\n}\n"
>>> print(spliced(text, aligned(next(tables_of(text)))), end="")
table t {
| line      | a ||
|-----------|---||
| long_name | 1 ||
}
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.lang.syntax.rows import stub_of
from rcsc.lang.written.changes import Splice, spliced
from rcsc.lang.written.tables import RowText, WrittenTable, dashes, fresh_name, joined_cells, tables_of


@dataclass(frozen=True, slots=True)
class Moved:
    """A text after a key, and where the cursor is then."""

    text: str
    offset: int


Act: TypeAlias = Callable[[str, int], Moved | None]
"""What a key does: the text and the offset after it; None outside tables."""


@dataclass(frozen=True, slots=True)
class Region:
    """The text between two bars of a row: from start to end, trimmed from `first` to `past`.

    Attributes:
        action: Whether it stands after `||`.
        open: Whether no bar closes it.
    """

    start: int
    end: int
    first: int
    past: int
    action: bool
    open: bool

    @property
    def length(self) -> int:
        """Length of the trimmed text."""
        return self.past - self.first


def regions(row: RowText) -> tuple[Region, ...]:
    """Return the regions of a row, without its comment."""
    body = row.partition("#")[0].rstrip()
    found: list[Region] = []
    at, action = 1, False
    while at < len(body):
        bar = body.find("|", at)
        end = len(body) if bar < 0 else bar
        text = body[at:end]
        lead = len(text) - len(text.lstrip())
        first = at + lead if text.strip() else at
        past = first + len(text.strip())
        found.append(
            Region(row.start + at, row.start + end, row.start + first, row.start + past, action, bar < 0)
        )
        doubled = not action and body[end : end + 2] == "||"
        action = action or doubled
        at = end + (2 if doubled else 1)
    return tuple(found)


def aligned(table: WrittenTable) -> list[Splice]:
    """Return the splices that align the columns of a table; none touches the text of a cell."""
    return [splice for part in table.parts for splice in _aligned(table.rows_of(part))]


def _aligned(rows: Sequence[RowText]) -> Iterator[Splice]:
    every = [(row, regions(row)) for row in rows]
    shape = [each.action for each in every[0][1]]
    fitting = [
        (row, cells)
        for row, cells in every
        if [each.action for each in cells] == shape and not any(each.open for each in cells)
    ]
    widths = [
        max((cells[at].length for row, cells in fitting if not dashes(row)), default=1)
        for at in range(len(shape))
    ]
    for row, cells in fitting:
        for cell, width in zip(cells, widths, strict=True):
            if dashes(row):
                yield cell.start, cell.end, "-" * (width + 2)
            elif not cell.length:
                yield cell.start, cell.end, " " * (width + 2)
            else:
                yield cell.start, cell.first, " "
                yield cell.past, cell.end, " " * (width - cell.length + 1)


def align(text: str, offset: int) -> list[Splice]:
    """Return the splices that align the table around an offset, without those that change nothing."""
    table = next((table for table in tables_of(text) if table.start <= offset <= table.end), None)
    found = [] if table is None else aligned(table)
    return [(start, end, new) for start, end, new in found if text[start:end] != new]


def keep_aligned(text: str, offset: int) -> Moved | None:
    """Align the table around an offset, which stays at its letter; None if the table is aligned already."""
    splices = align(text, offset)
    if not splices:
        return None
    moved = offset
    for start, end, new in splices:
        if end <= offset:
            moved += len(new) - (end - start)
        elif start < offset:
            moved -= max(0, offset - start - len(new))
    return Moved(spliced(text, splices), moved)


def next_cell(text: str, offset: int) -> Moved | None:
    """Go to the next cell; from the last of a line to the next line, from the last of the table to a new line. None outside tables."""
    here = _Here.of(text, offset)
    if here is None:
        return None
    text = spliced(text, aligned(here.table))
    table = here.again(text)
    row, cell = here.row, here.cell + 1
    if cell >= len(regions(table.rows[row])):
        row, cell = row + 1, 0
        while row < len(table.rows) and dashes(table.rows[row]):
            row += 1
    if row >= len(table.rows):
        return add_row(text, table.rows[-1].past)
    return Moved(text, _cursor(table.rows[row], cell))


def previous_cell(text: str, offset: int) -> Moved | None:
    """Go to the cell before; the first of a table stays where it is. None outside tables."""
    here = _Here.of(text, offset)
    if here is None:
        return None
    text = spliced(text, aligned(here.table))
    table = here.again(text)
    row, cell = here.row, here.cell - 1
    while cell < 0 and row > 0:
        row -= 1
        cell = -1 if dashes(table.rows[row]) else len(regions(table.rows[row])) - 1
    return Moved(text, _cursor(table.rows[row], max(cell, 0)))


def add_row(text: str, offset: int) -> Moved | None:
    """Add a line after the one around an offset, in each part of its table; None outside tables."""
    here = _Here.of(text, offset)
    if here is None:
        return None
    splices: list[Splice] = []
    parts = here.table.parts
    around = here.table.rows[here.row]
    at = next((at for part in parts for at, line in enumerate(part.lines) if around in line), -1)
    names = [stub_of(joined_cells(line).conditions[0]).name.text for line in parts[0].lines]
    end = "\r\n" if "\r\n" in text else "\n"
    wanted, name = 0, fresh_name(names, names[at] if 0 <= at < len(names) else "")
    for part in parts:
        if at >= 0 and at < len(part.lines):
            after = part.lines[at][-1]
        else:
            rows = here.table.rows
            after = rows[rows.index(part.lines[0][0]) - 1] if part.lines else here.table.rows_of(part)[-1]
        cells = regions(part.heading[0])
        indent = text[text.rfind("\n", 0, after.start) + 1 : after.start]
        left = " | ".join([name, *("" for each in cells[1:] if not each.action)])
        row = f"| {left} ||{''.join('  |' for each in cells if each.action)}"
        splices.append((after.past, after.past, f"{end}{indent}{row}"))
        if any(around in line for line in part.lines) or around in here.table.rows_of(part):
            added = sum(start < after.past for start, _, _ in splices[:-1])
            wanted = here.table.rows.index(after) + 1 + added
    text = spliced(text, splices)
    table = here.again(text)
    text = spliced(text, aligned(table))
    return Moved(text, _cursor(here.again(text).rows[wanted], 0))


def insert_column(text: str, offset: int) -> Moved | None:
    """Insert a column after that of the cell around an offset, on its side of `||`; None outside tables and their parts."""
    here = _Here.of(text, offset)
    if here is None:
        return None
    around = here.table.rows[here.row]
    number = next(
        (at for at, part in enumerate(here.table.parts) if around in here.table.rows_of(part)), None
    )
    if number is None:  # a row above the first heading
        return None
    part = here.table.parts[number]
    shape = [each.action for each in regions(part.heading[0])]
    at = min(here.cell, len(shape) - 1)
    splices: list[Splice] = []
    for row in here.table.rows_of(part):
        cells = regions(row)
        if [each.action for each in cells] == shape:
            fill = "-" if dashes(row) else " "
            splices.append((cells[at].end, cells[at].end, f"|{fill}{fill}{fill}"))
    text = spliced(text, splices)
    text = spliced(text, aligned(here.again(text)))
    table = here.again(text)
    return Moved(text, _cursor(table.rows_of(table.parts[number])[0], at + 1))


@dataclass(frozen=True, slots=True)
class _Here:
    """The cell around an offset: its table, and which row and cell of it."""

    table: WrittenTable
    number: int
    row: int
    cell: int

    @classmethod
    def of(cls, text: str, offset: int) -> "_Here | None":
        """Find the cell around an offset; None where no row has one, or the table has no heading yet."""
        for number, table in enumerate(tables_of(text)):
            for at, row in enumerate(table.rows):
                if row.start <= offset <= row.past and table.parts and table.parts[0].heading:
                    cells = regions(row)
                    cell = next((at for at, each in enumerate(cells) if offset <= each.end), len(cells) - 1)
                    if not cells or not all(regions(part.heading[0]) for part in table.parts):
                        return None
                    return cls(table, number, at, cell)
        return None

    def again(self, text: str) -> WrittenTable:
        """Return the table in a changed text."""
        return list(tables_of(text))[self.number]


def _cursor(row: RowText, cell: int) -> int:
    """Return the offset where the text of a cell begins, or would begin."""
    cells = regions(row)
    if not cells:
        return row.past
    region = cells[min(cell, len(cells) - 1)]
    return region.first if region.length else min(region.start + 1, region.end)
