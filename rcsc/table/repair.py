"""Repairs worth proposing: each is proved before it is shown, or not shown.

In: a finding of a table. Out: a sentence, or nothing. What parts two lines is known of box tables only.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

from rcsc.lang.expressions.folding import fold
from rcsc.lang.interval_sets import complement, holds, meet, size
from rcsc.lang.model import (
    Apply,
    Bool,
    Box,
    Column,
    Enum,
    Expr,
    Literal,
    Program,
    Read,
    Scalar,
    Table,
    Test,
    VariableName,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import OPPOSITE, Op, is_comparison
from rcsc.table import boxes, cells
from rcsc.table.regions.atoms import Clauses, Formula, Universe, assumptions_of, clauses, lines_of
from rcsc.table.regions.least import find, negated, whole
from rcsc.table.regions.partition import BudgetError, Gaps
from rcsc.table.regions.region import NoWitness
from rcsc.table.regions.splitting import Tree
from rcsc.table.verdict import Gap, Overlap, Region, Witness

MOST_ASKED = 4_000
"""Pairs of a cell and a line that are looked at for a row across variables; a table with more gets none."""


@dataclass(frozen=True, slots=True)
class PartingCell:
    """One cell, changed so that two lines no longer both match.

    Attributes:
        line: The line with the cell, by position; `other`, the line that then runs where both matched.
        name: The column's variable; `text`, the cell as it would be; `box`, the keys that it takes.
        lost: How many keys the cell no longer takes.
        falls: Whether the line loses more than the other has, so that DEFAULT takes the rest.
    """

    line: int
    other: int
    name: VariableName
    text: str
    box: Box
    lost: int
    falls: bool

    def shown(self, table: Table) -> str:
        """Say what to write, which line then runs, and what it does otherwise than the line that does not."""
        line, other = table.lines[self.line], table.lines[self.other]
        does, did = ({action.heading: action.text for action in of.actions} for of in (other, line))
        headings = [heading for heading in dict.fromkeys((*did, *does)) if heading != "procedures"]
        instead = [
            f"{heading} {does.get(heading, 'blank')}, not {did.get(heading, 'blank')}"
            for heading in headings
            if does.get(heading) != did.get(heading)
        ]
        beside = f" ({'; '.join(instead)})" if instead else ""
        rest = "; DEFAULT takes what else it loses" if self.falls else ""
        write = f"in line `{line.name}` write `{self.text}` under `{self.name}`: proved to part the two lines"
        return f"{write}; line `{other.name}` then runs where both match{beside}{rest}"


def parting_cell(program: Program, table: Table, overlap: Overlap) -> str | None:
    """Return the smallest change of one cell that parts the two lines and leaves every input matched, in words."""
    cell = next(iter(parting_cells(program, table, overlap)), None)
    return None if cell is None or cell.falls else cell.shown(table)


def parting_cells(program: Program, table: Table, overlap: Overlap) -> tuple[PartingCell, ...]:
    """Return each change of one cell that parts the two lines, the smallest first, those that leave inputs to DEFAULT last.

    Narrowing line A on variable v by what line B has there parts the two. What A loses is then matched by B, if on
    every other variable B has all that A has: that is checked exactly. Else it falls to DEFAULT, if there is one that may be reached.
    """
    if not boxes.applies(table):
        return ()
    lines = boxes.lines_of(table)
    kinds: dict[str, Scalar] = {v.name: v.type for v in program.variables}
    default = table.default is not None and not table.default.unreachable
    every = (
        _narrowed(lines, kinds, table, line, other, name)
        for line, other in ((overlap.second, overlap.first), (overlap.first, overlap.second))
        for name in table.variables
    )
    cells_ = (cell for cell in every if cell is not None and (default or not cell.falls))
    return tuple(sorted(cells_, key=lambda cell: (cell.falls, cell.lost)))


def _narrowed(
    lines: list[dict[str, Box]],
    kinds: dict[str, Scalar],
    table: Table,
    line: int,
    other: int,
    name: VariableName,
) -> PartingCell | None:
    column = [c for c in table.columns if c.variable == name]
    if len(column) != 1:
        return None
    mine, theirs = lines[line], lines[other]
    whole = (key_bounds(kinds[name]),)
    everything = {another: (key_bounds(kinds[another]),) for another in table.variables}
    falls = any(
        another != name and not _within(mine.get(another, every), theirs.get(another, every))
        for another, every in everything.items()
    )
    before = mine.get(name, whole)
    left = meet(before, complement(theirs.get(name, whole), *whole[0]))
    text = cells.cell(kinds[name], left) if left else None
    if not text or meet(left, theirs.get(name, whole)):
        return None
    return PartingCell(line, other, name, text, left, size(before) - size(left), falls)


def with_cells(program: Program, table: Table, changed: Sequence[PartingCell]) -> Table | None:
    """Return the table with these cells; of one cell changed twice, what both take. None if a line would never match."""
    lines = list(table.lines)
    for cell in changed:
        at = next(at for at, column in enumerate(table.columns) if column.variable == cell.name)
        kind, tests = program.variable(cell.name).type, list(lines[cell.line].tests)
        old = tests[at]
        box = cell.box if old is None or old.box is None else meet(old.box, cell.box)
        if not box:
            return None
        tests[at] = Test(cells.cell(kind, box) or cell.text, _says(cell.name, kind, box), (cell.name,), box)
        lines[cell.line] = replace(lines[cell.line], tests=tuple(tests))
    return replace(table, lines=tuple(lines))


def left_by(program: Program, table: Table, changed: Sequence[PartingCell]) -> str:
    """Say whether lines still overlap, or never match, when all these cells are changed."""
    after = with_cells(program, table, changed)
    if after is None:
        return "they contradict each other: a line would never match"
    decided = boxes.TableBoxes.of(program, after)
    left = next(iter(decided.overlaps()), None)
    if left is not None:
        first, second = (table.lines[at].name for at in left)
        return f"lines `{first}` and `{second}` still both match some input"
    return "proved that no two lines match any more"


def _says(name: VariableName, kind: Scalar, box: Box) -> Expr:
    """Return the condition that a leaf has one of the keys."""
    read = Read(name, kind)

    def compared(op: Op, key: int) -> Expr:
        return Apply(op, (read, Literal(value_of_key(kind, key), kind)), Bool())

    listed = isinstance(kind, Bool | Enum)
    parts = (
        [compared(Op.EQ, key) for low, high in box for key in range(low, high + 1)]
        if listed
        else [Apply(Op.AND, (compared(Op.GE, low), compared(Op.LE, high)), Bool()) for low, high in box]
    )
    return reduce(lambda either, part: Apply(Op.OR, (either, part), Bool()), parts)


def _within(inner: Box, outer: Box) -> bool:
    return meet(inner, outer) == inner


def closing_line(program: Program, table: Table, gap: Gap) -> str | None:
    """Propose a line for the gap's first region; it overlaps none, and whether it closes the gap is counted, or proved."""
    region, witness = gap.regions[0], gap.witnesses[0]
    row = None
    if region is not None and boxes.applies(table) and not table.assumptions:
        row = _line_of_boxes(program, table, region)
    return row or _line_across(program, table, witness, region or {})


def _said(row: str, closes: bool) -> str:
    what = "closes the gap" if closes else "closes this part of the gap"
    return f"a line `| {row} || ... |` {what} and overlaps no other: proved"


def _line_of_boxes(program: Program, table: Table, region: Region) -> str | None:
    """The line of a table of boxes whose cells say the region."""
    kinds: dict[str, Scalar] = {v.name: v.type for v in program.variables}
    texts = []
    for column in table.columns:
        name = column.variable
        box = region.get(name) if name is not None else None
        cell = "" if box is None or name is None else cells.cell(kinds[name], box)
        if cell is None:
            return None
        texts.append(cell)
    if not set(region) <= {str(c.variable) for c in table.columns} & set(map(str, table.variables)):
        return None  # bounds of what only an assumption reads
    decided = boxes.TableBoxes.of(program, table)
    decided.lines.append(dict(region.items()))
    pairs = list(decided.overlaps())
    if any(len(decided.lines) - 1 in pair for pair in pairs):
        return None
    row = " | ".join(["new", *texts])
    try:
        closes = not Gaps.of(decided, disjoint=not pairs).missing()
    except BudgetError:
        closes = False
    return _said(row, closes)


# --- across variables ------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell that the witness satisfies: its column, its text, what it says, and the lines that it excludes."""

    column: int
    text: str
    formula: Formula
    excludes: frozenset[int]


@dataclass(slots=True)
class _Row:
    """A row being made for an input that no line matches, of what the table's own cells say and do not say.

    Attributes:
        cells: What was chosen, by column.
    """

    program: Program
    table: Table
    witness: Witness
    region: Region
    universe: Universe = field(default_factory=Universe)
    lines: list[Clauses] = field(init=False)
    assumed: list[Clauses] = field(init=False)
    kinds: dict[str, Scalar] = field(init=False)
    cells: dict[int, _Cell] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """States lines and assumptions."""
        self.kinds = {str(v.name): v.type for v in self.program.variables}
        self.lines = lines_of(self.universe, self.table)
        self.assumed = assumptions_of(self.universe, self.program, self.table)

    def apart(self, formulas: Sequence[Formula], line: int) -> bool:
        """Whether what the formulas say excludes a line, under the assumptions."""
        wanted = [*formulas, whole(self.lines[line]), *map(whole, self.assumed)]
        return find(self.universe, wanted) is NoWitness.NONE

    def choose(self) -> bool:
        """Choose one cell a column, that which excludes most first, until every line is excluded; whether they are."""
        offered = list(self.offered())
        waiting = set(range(len(self.lines)))
        while waiting:
            free = [cell for cell in offered if cell.column not in self.cells]
            best = max(free, key=lambda cell: len(cell.excludes & waiting), default=None)
            if best is None or not best.excludes & waiting:
                break
            self.cells[best.column] = best
            waiting -= best.excludes
        formulas = [cell.formula for cell in self.cells.values()]
        return all(self.apart(formulas, line) for line in waiting)

    def offered(self) -> Iterator[_Cell]:
        """Every cell that could stand in the row, each text of a column once."""
        known: set[tuple[int, str]] = set()
        for at, text, formula in self._possible():
            if (at, text) in known or not text:
                continue
            known.add((at, text))
            excluded = (line for line in range(len(self.lines)) if self.apart([formula], line))
            yield _Cell(at, text, formula, frozenset(excluded))

    def _possible(self) -> Iterator[tuple[int, str, Formula]]:
        """For each column what a line says there, or its opposite, as the witness has it; and what the region says."""
        for at, column in enumerate(self.table.columns):
            name = column.variable
            every = dict.fromkeys(test for line in self.table.lines if (test := line.tests[at]) is not None)
            if name is not None and name in self.witness:
                boxes_ = [self._turned(name, test.box) for test in every if test.box is not None]
                yield from ((at, *self._of_box(name, box)) for box in self._boxes(name, boxes_))
            for test in every:
                if name is None or name not in self.witness or test.box is None:
                    yield from ((at, *said) for said in self._of_condition(column, test))

    def _boxes(self, name: str, boxes_: Sequence[Box]) -> Iterator[Box]:
        """What a cell under a variable may say: the region, each line's side, and what all of these have in common."""
        if name in self.region:
            yield self.region[name]
        yield from boxes_
        yield reduce(meet, boxes_, (key_bounds(self.kinds[name]),))

    def _turned(self, name: str, box: Box) -> Box:
        """The keys that a cell takes, or the others, whichever has the witness's."""
        kind = self.kinds[name]
        return box if holds(box, key_of(kind, self.witness[name])) else complement(box, *key_bounds(kind))

    def _of_box(self, name: str, box: Box) -> tuple[str, Formula]:
        kind = self.kinds[name]
        form = self.universe.single[self.universe.column(Read(VariableName(name), kind))]
        return cells.cell(kind, box) or "", self.universe.atom(form, box)

    def _of_condition(self, column: Column, test: Test) -> Iterator[tuple[str, Formula]]:
        """A condition across variables as it is written, or its opposite."""
        formula = self.universe.of(test.condition)
        truth = fold(test.condition, self.witness)
        if truth is True:
            yield test.text, formula
        elif truth is False and column.subject is None:
            yield f"not ({test.text})", negated(self.universe, formula)
        elif truth is False and (text := _opposite(test.text, test.condition)):
            yield text, negated(self.universe, formula)

    def closes(self) -> bool:
        """Whether exactly one line matches every input, with this row."""
        row = clauses(cell.formula for cell in self.cells.values())
        tree = Tree(
            self.universe, [*self.lines, row], self.assumed, lambda _: NoWitness.UNKNOWN,
            default=False, budget=MOST_ASKED, first_only=True,
        )  # fmt: skip
        return tree.run().proved

    def text(self) -> str:
        """The row, up to the `||`."""
        found: Mapping[int, str] = {at: cell.text for at, cell in self.cells.items()}
        return " | ".join(["new", *(found.get(at, "") for at in range(len(self.table.columns)))])


def _line_across(program: Program, table: Table, witness: Witness, region: Region) -> str | None:
    """The line of a table with conditions across variables, or under assumptions; proved by exact arithmetic alone."""
    tests = sum(len({line.tests[at] for line in table.lines}) for at in range(len(table.columns)))
    if tests * len(table.lines) > MOST_ASKED:
        return None
    row = _Row(program, table, witness, region)
    return _said(row.text(), row.closes()) if row.choose() else None


def _opposite(text: str, condition: Expr) -> str:
    """The cell that says the opposite of a comparison's; empty for any other."""
    if not (isinstance(condition, Apply) and is_comparison(condition.op)):
        return ""
    value = re.sub(r"^(/=|<=|>=|=|<|>)\s*", "", text)
    other = OPPOSITE[condition.op]
    return value if other is Op.EQ else f"{other.value} {value}"
