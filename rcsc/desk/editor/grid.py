"""A table as data: columns, rows and cells as they are written, with types and shares where the program is known.

In: a text, and the program that it resolves to, if it does. Out: `Grid`s. Half-written tables have their cells, too.

The share of a line is how many of the inputs in the declared ranges it matches. It is counted where each condition looks at
one variable, or at bits of one; assumptions are left out of the count.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import zip_longest

from rcsc.desk.editor.places import Area, Lines
from rcsc.desk.editor.values import Grid, GridCell, GridColumn, GridRow, Standing
from rcsc.lang.model import Array, Bool, Enum, Int, Program, Record, Single, Table, Type, spell, unit_text
from rcsc.lang.syntax.rows import REQUIREMENTS, Cell, Cells, stub_of
from rcsc.lang.written.tables import RowText, WrittenPart, WrittenTable, joined_cells, pieces, tables_of
from rcsc.proof.table.boxes import TableBoxes
from rcsc.proof.table.regions.word_bits import words_of

_KINDS = {"procedures": "procedures", REQUIREMENTS: "requirements"}
"""Of the columns after `||` by their headings; any other has values of outputs, or orders."""


def grids(
    file: str, lines: Lines, program: Program | None, standing_of: Callable[[WrittenTable], Standing]
) -> Iterator[Grid]:
    """Yield the tables of a text.

    Args:
        file: The path.
        lines: The text.
        program: What it resolves to; None where it does not.
        standing_of: The standing of a table as written.
    """
    resolved = {} if program is None else {str(table.name): table for table in program.tables}
    for written in tables_of(lines.text):
        yield _grid(file, lines, written, program, resolved.get(written.name), standing_of(written))


def _grid(
    file: str,
    lines: Lines,
    written: WrittenTable,
    program: Program | None,
    table: Table | None,
    standing: Standing,
) -> Grid:
    def areas(cell: Cell) -> tuple[Area, ...]:
        return tuple(lines.area(file, *place) for place in pieces(cell))

    parts = written.parts
    heads = [joined_cells(part.heading) for part in parts]
    columns = tuple(_columns(heads, None if written.turned else table, program, areas))
    shares = {} if program is None or table is None else shares_of(program, table)
    every = [part.lines for part in parts]
    rows = [
        _row(file, lines, groups, heads, shares, areas)
        for groups in zip_longest(*every)
        if groups[0] is not None
    ]
    name = lines.area(file, written.named, written.named + len(written.name))
    first = heads[0].conditions[0].text if heads and heads[0].conditions else "line"
    if written.turned and heads:
        rows = [
            _turned(row, parts, at, name, table)
            for at, (row, name) in enumerate(zip(rows, written.line_names, strict=True))
        ]
    return Grid(written.name, name, columns, tuple(rows), standing, first)


def _turned(row: GridRow, parts: Sequence[WrittenPart], at: int, name: str, table: Table | None) -> GridRow:
    """Return a row of a turned table with its name, which may be made of its conditions, and the lines whose cells stand in it."""
    rows = [each for part in parts if at < len(part.lines) for each in part.lines[at]]
    lines = () if table is None else table.every_line
    found = [
        str(line.name) for line in lines if any(each.start <= line.span.start < each.past for each in rows)
    ]
    return replace(row, name=name, lines=tuple(found))


def _columns(
    heads: Sequence[Cells],
    table: Table | None,
    program: Program | None,
    areas: Callable[[Cell], tuple[Area, ...]],
) -> Iterator[GridColumn]:
    """Yield the columns: conditions of all parts, then actions of all parts."""
    types = {} if program is None else {declared.name: declared.type for declared in program.declared}
    leaves = {} if program is None else {str(leaf.name): leaf.type for leaf in program.variables}
    tested = (
        []
        if table is None
        else [None if each.subject is None else each.subject.type for each in table.columns]
    )
    for at, cell in enumerate(cell for head in heads for cell in head.conditions[1:]):
        kind = tested[at] if at < len(tested) else None
        yield GridColumn(cell.text, "condition", *_told(kind), areas(cell))
    for cell in (cell for head in heads for cell in head.actions):
        word = _KINDS.get(cell.text, "output")
        written = leaves.get(cell.text) or types.get(cell.text)
        yield GridColumn(cell.text, word, *_told(written), areas(cell))


def _told(kind: Type | None) -> tuple[str, str]:
    return ("", "") if kind is None else (type_text(kind), unit_text(getattr(kind, "unit", ())))


def type_text(kind: Type) -> str:
    """Return a type as it would be declared, without its unit.

    >>> type_text(Int(0, 100)), type_text(Array(3, Bool()))
    ('int 0 .. 100', 'array[3] of bool')
    """
    match kind:
        case Bool():
            return "bool"
        case Enum(name) | Record(name):
            return name
        case Array(length, element):
            return f"array[{length}] of {type_text(element)}"
        case Int(low, high):
            return f"int {low} .. {high}"
        case _:
            word = "single" if isinstance(kind, Single) else "real"
            return f"{word} {spell(kind, kind.low)} .. {spell(kind, kind.high)}"


def _row(
    file: str,
    lines: Lines,
    groups: Sequence[Sequence[RowText] | None],
    heads: Sequence[Cells],
    shares: Mapping[str, tuple[int, int]],
    areas: Callable[[Cell], tuple[Area, ...]],
) -> GridRow:
    first = groups[0]
    assert first is not None
    stub, conditions, actions = line_cells(groups, heads)
    every = tuple(GridCell(cell.text, areas(cell)) for cell in (*conditions, *actions))
    name = stub_of(stub).name.text
    default = "DEFAULT" in (name, *(cell.text.split(" ")[0] for cell in conditions[:1]))
    return GridRow(
        name,
        every,
        default,
        shares.get(name),
        lines.area(file, first[0].start, first[-1].past),
        GridCell(stub.text, areas(stub)),
        (name,),
    )


def line_cells(
    groups: Sequence[Sequence[RowText] | None], heads: Sequence[Cells]
) -> tuple[Cell, list[Cell], list[Cell]]:
    """Return the name's cell, the conditions and the actions of a line over the parts of its table, as many as the headings have.

    Missing cells are empty, and stand at the end of the row.
    """
    first = next(group for group in groups if group is not None)
    stub = Cell("", "", first[0].start)
    conditions, actions = list[Cell](), list[Cell]()
    for at, (group, head) in enumerate(zip(groups, heads, strict=True)):
        cells = Cells((), ()) if group is None else joined_cells(group)
        end = Cell("", "", (group or first)[0].past)
        conditions += _as_many(cells.conditions[1:], len(head.conditions) - 1, end)
        actions += _as_many(cells.actions, len(head.actions), end)
        if at == 0 and cells.conditions:
            stub = cells.conditions[0]
    return stub, conditions, actions


def _as_many(cells: Sequence[Cell], count: int, end: Cell) -> list[Cell]:
    return [*cells[:count], *[end] * (count - len(cells))]


def shares_of(program: Program, table: Table) -> dict[str, tuple[int, int]]:
    """Return how many inputs each line matches, and of how many, by name; DEFAULT where no two lines overlap; {} where none are counted."""
    words = words_of(program, table)
    if words is None:
        return {}
    decided = TableBoxes.of(program, table, words)
    whole = decided.volume()
    counts = [decided.piece(1, boxes).sizes[0] for boxes in decided.lines]
    shares = {str(line.name): (count, whole) for line, count in zip(table.lines, counts, strict=True)}
    if table.default is not None and next(decided.meeting(), None) is None:
        shares[str(table.default.name)] = (whole - sum(counts), whole)
    return shares
