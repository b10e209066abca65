"""Repairs worth proposing: what is right of the table as resolved. Whether it is of the text is tried elsewhere (`mending`).

In: a finding of a table. Out: a cell or a line to write, and the sentence that proposes it; or nothing.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import accumulate
from math import gcd

from rcsc.base.diagnostics.diagnostic import Change, ChangeKind
from rcsc.lang.expressions.conditions import box_of
from rcsc.lang.interpret import fold
from rcsc.lang.interval_sets import complement, holds, joined, meet, size
from rcsc.lang.leaves import is_finite
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Box,
    Column,
    Enum,
    Expr,
    Int,
    Literal,
    Printed,
    Program,
    Read,
    Real,
    Scalar,
    Table,
    Test,
    VariableName,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import OPPOSITE, Op, is_comparison
from rcsc.lang.questions import conjunction, disjunction
from rcsc.proof.table import boxes, cells
from rcsc.proof.table.regions.atoms import (
    Atom,
    Clauses,
    Every,
    Formula,
    Universe,
    assumptions_of,
    clauses,
    lines_of,
)
from rcsc.proof.table.regions.atoms import every as every_of
from rcsc.proof.table.regions.least import find, negated, whole
from rcsc.proof.table.regions.partition import BudgetError, Gaps
from rcsc.proof.table.regions.region import NoWitness
from rcsc.proof.table.regions.splitting import Tree
from rcsc.proof.table.regions.word_bits import Part, Words, words_of
from rcsc.proof.table.verdict import Gap, Overlap, Region, Witness

MOST_JOINED = 4
"""Conditions under `when` that one cell of a new line may join."""
MOST_OFFERED = 3
"""Cells of rows and columns of a turned table that are tried for one overlap."""
MOST_ASKED = 4_000
"""Pairs of a cell and a line that are looked at for a row across variables; a table with more gets none."""


@dataclass(frozen=True, slots=True)
class PartingCell:
    """One cell, changed so that two lines no longer both match.

    Attributes:
        line: The line with the cell, by position; `other`, the line that then runs where both matched.
        column: The cell's column, by position; `name`, the variable, or bits of a word, of which it takes fewer keys.
        text: The cell's new text; `box`, the keys that it takes.
        lost: How many keys the cell no longer takes.
        falls: Whether the line loses more than the other has, so that DEFAULT takes the rest.
    """

    line: int
    other: int
    column: int
    name: str
    text: str
    box: Box
    lost: int
    falls: bool

    def told(self, table: Table) -> tuple[str, str]:
        """Say what to write and which line then runs, in two pieces: between them stands whether it is proved."""
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
        runs = f"line `{other.name}` then runs where both match{beside}{rest}"
        return f"{self.write(table)}: ", f" to part the two lines; {runs}"

    def write(self, table: Table) -> str:
        """Say which cell to write, and where."""
        heading = table.columns[self.column].heading
        printed = table.turned
        if printed is None:
            return f"in line `{table.lines[self.line].name}` write `{self.text}` under `{heading}`"
        row, column = printed.places[self.line]
        if self._heads(printed):
            return f"head column `{printed.columns[column]}` with `{self.said(table)}`"
        under = heading if self.column < printed.conditions else printed.said[column]
        return f"in row `{printed.rows[row]}` write `{self.text}` under `{under}`"

    def _heads(self, printed: Printed) -> bool:
        """Return whether it is no cell, but a column's heading."""
        return bool(printed.by) and self.column >= printed.conditions

    def said(self, table: Table) -> str:
        """Return the text, after `when` where that says that a heading is a condition by itself."""
        return f"when {self.text}" if table.columns[self.column].subject is None else self.text

    def change(self, table: Table) -> Change:
        """Return the change of the table's text."""
        printed = table.turned
        if printed is None:
            return Change(ChangeKind.CELL, str(table.lines[self.line].name), self.column, (self.text,))
        row, column = printed.places[self.line]
        if self._heads(printed):
            return with_heading(printed, column, self.said(table))
        own = self.column < printed.conditions
        at = printed.written(self.column if own else column, condition=own)
        return Change(ChangeKind.CELL, printed.rows[row], at, (self.text,))


def with_heading(printed: Printed, column: int, said: str, marks: str = "") -> Change:
    """Return the change of what the heading of a column says, which keeps the name and the marks that are given to it."""
    heading, old = printed.headings[column], printed.said[column]
    stub = "" if heading == old else heading.removesuffix(old).rstrip(" :") or heading
    if not stub and marks:
        stub = printed.columns[column]
    alone_ = said == stub and said == printed.columns[column]
    text = (
        f"{stub}{marks}"
        if alone_ or (said == old and stub == heading)
        else f"{stub}{marks} : {said}"
        if stub
        else said
    )
    return Change(ChangeKind.HEADING, column=printed.written(column), texts=(text,))


class Partings:
    """The cells of one table that part two of its lines; facts that all overlaps share are computed once."""

    def __init__(self, program: Program, table: Table) -> None:
        self.program, self.table = program, table

    @cached_property
    def _boxes(self) -> boxes.TableBoxes | None:
        words = words_of(self.program, self.table)
        return None if words is None else boxes.TableBoxes.of(self.program, self.table, words)

    @cached_property
    def _across(self) -> tuple[Universe, list[Clauses], list[Clauses]]:
        universe = Universe()
        return universe, lines_of(universe, self.table), assumptions_of(universe, self.program, self.table)

    def best(self, overlap: Overlap) -> PartingCell | None:
        """Return the smallest change of one cell that parts the two lines and loses no input; None of a turned table."""
        return None if self.table.turned else next(iter(self.offered(overlap)), None)

    def offered(self, overlap: Overlap) -> tuple[PartingCell, ...]:
        """Return the changes of one cell that part two lines and lose no input of theirs, the smallest first.

        A turned table's lines share the cells of their row and column: there several are worth trying, elsewhere the first.
        """
        table = self.table
        if self._boxes is None:
            found = sorted(self._sums(overlap), key=lambda cell: cell.lost)
        else:
            found = [cell for cell in self._narrowed(overlap) if not cell.falls]
        if table.turned is not None:
            found = [cell for cell in found if _is_printed(cell, table, table.turned)]
            return (*self._without(overlap), *found[:MOST_OFFERED])
        return tuple(found[:1] or self._without(overlap))

    def cells(self, overlap: Overlap) -> tuple[PartingCell, ...]:
        """Return each change of one cell that parts the two lines, the smallest first, those that leave inputs to DEFAULT last.

        Taking B's keys of variable v out of line A parts the two. B then matches what A loses, if on every other variable B has
        all keys that A has: that is checked exactly. Else it falls to DEFAULT, if there is one that may be reached.
        """
        return () if self.table.turned else self._narrowed(overlap)

    def _narrowed(self, overlap: Overlap) -> tuple[PartingCell, ...]:
        decided, table = self._boxes, self.table
        if decided is None:
            return ()
        kinds: dict[str, Scalar] = self.program.kinds
        default = table.default is not None and not table.default.unreachable
        every = (
            _narrowed(decided, kinds, table, line, other, name)
            for line, other in ((overlap.second, overlap.first), (overlap.first, overlap.second))
            for name in decided.names
        )
        cells_ = (cell for cell in every if cell is not None and (default or not cell.falls))
        return tuple(sorted(cells_, key=lambda cell: (cell.falls, cell.lost)))

    def _without(self, overlap: Overlap) -> Iterator[PartingCell]:
        """Yield a condition under `when` that leaves to the one line what both match: `x > 3 and not (x > y)`.

        Where it is open whether that ever holds, one for each of the two lines.
        """
        table = self.table
        at = next(
            (at for at, each in enumerate(table.columns) if each.subject is None and each.written), None
        )
        if at is None or len(table.columns) * len(table.lines) > MOST_ASKED:
            return
        universe, lines, _ = self._across
        for line, other in ((overlap.second, overlap.first), (overlap.first, overlap.second)):
            own, theirs = table.lines[line], table.lines[other]
            printed = table.turned
            if printed and printed.by and not printed.alone(printed.places[line][1]):
                continue  # its column has no such condition
            pairs = zip(table.columns, own.tests, theirs.tests, strict=True)
            terms = [
                _spoken(column, test) for column, mine, test in pairs if test is not None and test != mine
            ]
            left = [whole(lines[line]), negated(universe, whole(lines[other]))]
            point = NoWitness.NONE if not terms or None in terms else find(universe, left)
            if point is NoWitness.NONE:
                continue  # nothing would be left to it
            mine = own.tests[at]
            but = _none_of([str(term) for term in terms])
            text = but if mine is None else f"{alone(mine.text)} and {but}"
            yield PartingCell(line, other, at, "", text, (), 0, falls=False)
            if not isinstance(point, NoWitness):
                return

    def _sums(self, overlap: Overlap) -> Iterator[PartingCell]:
        """Yield changes of one cell, under a variable or a sum of some, that part two lines and leave every input matched."""
        table = self.table
        if len(table.columns) * len(table.lines) > MOST_ASKED:
            return
        universe, lines, assumed = self._across
        for line, other in ((overlap.second, overlap.first), (overlap.first, overlap.second)):
            for at, column in enumerate(_written(table)):
                test, heading = table.lines[other].tests[at], None
                if test is not None and column.subject is not None:
                    heading = _Sum.of(universe, column.subject)
                theirs = (
                    None if heading is None or test is None else _box_on(heading.form, universe.of_test(test))
                )
                if heading is None or theirs is None:
                    continue
                every = ((universe.low[heading.form], universe.high[heading.form]),)
                own = table.lines[line].tests[at]
                before = every if own is None else _box_on(heading.form, universe.of_test(own))
                left = () if before is None else meet(before, complement(theirs, *every[0]))
                text = heading.cell(universe, left) if left else ""
                lost = [whole(lines[line]), universe.atom(heading.form, theirs), *map(whole, assumed)]
                unmatched = [*lost, negated(universe, whole(lines[other]))]
                if before is not None and text and find(universe, unmatched) is NoWitness.NONE:
                    less = size(before) - size(left)
                    yield PartingCell(line, other, at, "", text, left, less, falls=False)


def _is_printed(cell: PartingCell, table: Table, printed: Printed) -> bool:
    """Return whether the condition that changes stands in the row, or in the heading of the line's column, and so is written once."""
    _, column = printed.places[cell.line]
    subject = table.columns[cell.column].subject
    return cell.column < printed.conditions or printed.alone(column) == (subject is None)


_JOINED = re.compile(r"\b(or|xor|implies|when|for)\b", re.ASCII)


def alone(text: str) -> str:
    """Return a condition as it stands beside others that `and` joins."""
    return f"({text})" if _JOINED.search(text) else text


def _none_of(terms: Sequence[str]) -> str:
    """Return the condition that not all of some conditions hold: of `not (...)` alone, what stands in it."""
    inner = (
        re.fullmatch(r"not (?:\((?P<whole>.*)\)|(?P<word>\w+))", terms[0], re.ASCII)
        if len(terms) == 1
        else None
    )
    if inner is not None and _balanced(inner["whole"] or ""):
        return alone(inner["whole"] or inner["word"])
    return f"not ({' and '.join(map(alone, terms) if len(terms) > 1 else terms)})"


def _balanced(text: str) -> bool:
    """Return whether no bracket of a text is closed before it is opened."""
    depths = accumulate((character == "(") - (character == ")") for character in text)
    return all(depth >= 0 for depth in depths)


def either(one: str, other: str) -> str:
    """Return the condition that one of two holds."""
    weak = re.compile(r"\b(xor|implies|when|for)\b", re.ASCII)
    return " or ".join(f"({each})" if weak.search(each) else each for each in (one, other))


def _spoken(column: Column, test: Test) -> str | None:
    """Return a cell with its heading, as a condition by itself; None for an event or a time, which are of their heading."""
    text, heading = test.text, column.heading
    if column.subject is None:
        return text
    if "@" in text or _JOINED.search(text):
        return None
    if re.match(r"(/=|<=|>=|=|<|>|in\b|not in\b)", text):
        return f"{heading} {text}"
    return (
        f"{heading} in {text}"
        if ".." in text
        else f"{heading} in {{{text}}}"
        if "," in text
        else f"{heading} = {text}"
    )


def _narrowed(
    decided: boxes.TableBoxes,
    kinds: Mapping[str, Scalar],
    table: Table,
    line: int,
    other: int,
    name: str,
) -> PartingCell | None:
    mine, theirs = decided.lines[line], decided.lines[other]
    extents = decided.extents
    falls = any(
        another != name and not _within(mine.get(another, (every,)), theirs.get(another, (every,)))
        for another, every in extents.items()
    )
    before = mine.get(name, (extents[name],))
    left = meet(before, complement(theirs.get(name, (extents[name],)), *extents[name]))
    told = [cells.cell_under(column, kinds, {**mine, name: left}) for column in table.columns] if left else []
    said = [(at, cell[0]) for at, cell in enumerate(told) if cell is not None and name in cell[1]]
    if len(said) != 1 or not said[0][1]:
        return None
    at, text = said[0]
    return PartingCell(line, other, at, name, text, left, size(before) - size(left), falls)


def with_cells(program: Program, table: Table, changed: Sequence[PartingCell]) -> Table | None:
    """Return the table with these cells; a cell changed twice takes only keys in both. None if a line would never match."""
    lines = list(table.lines)
    for cell in changed:
        tests = list(lines[cell.line].tests)
        test = _with_cell(program, tests[cell.column], cell)
        if test is None:
            return None
        tests[cell.column] = test
        lines[cell.line] = replace(lines[cell.line], tests=tuple(tests))
    return replace(table, lines=tuple(lines))


def _with_cell(program: Program, old: Test | None, cell: PartingCell) -> Test | None:
    """Return the test that the new cell and the old one's other bits state; None where nothing fits."""
    part = Part.named(cell.name)
    leaf = program.variable(cell.name if part is None else part.leaf)
    if part is not None:
        condition = _says(part.of(leaf), cell.box)
        if old is not None:
            condition = Apply(Op.AND, (old.condition, condition), Bool())
        box = box_of(condition, leaf)
        return None if box == () else Test(cell.text, condition, (leaf.name,), box)
    box = cell.box if old is None or old.box is None else meet(old.box, cell.box)
    if not box:
        return None
    read = Read(leaf.name, leaf.type)
    return Test(cells.cell(leaf.type, box) or cell.text, _says(read, box), (leaf.name,), box)


def left_by(program: Program, table: Table, changed: Sequence[PartingCell]) -> str:
    """Say which lines still overlap, or that one never matches, when all these cells are changed; "" where neither is so."""
    after = with_cells(program, table, changed)
    if after is None:
        return "they contradict each other: a line would never match"
    decided = boxes.TableBoxes.of(program, after, words_of(program, after))
    left = next(iter(decided.overlaps()), None)
    if left is not None:
        first, second = (table.lines[at].name for at in left)
        return f"lines `{first}` and `{second}` still both match some input"
    return ""


def changes_of(program: Program, table: Table, changed: Sequence[PartingCell]) -> tuple[Change, ...]:
    """Return these cells as changes of the text; one changed twice takes only keys in both. Return none where no cell can say that."""
    after = with_cells(program, table, changed)
    if after is None:
        return ()
    often = Counter((cell.line, cell.column) for cell in changed)
    texts = {(cell.line, cell.column): cell.text for cell in changed}
    kinds = program.kinds
    for line, column in (place for place, many in often.items() if many > 1):
        test, name = after.lines[line].tests[column], table.columns[column].variable
        text = (
            None
            if test is None or test.box is None
            else cells.cell(kinds[str(name)], test.box)
            if name
            else None
        )
        if text is None:
            return ()
        texts[line, column] = text
    return tuple(
        Change(ChangeKind.CELL, str(table.lines[line].name), column, (text,))
        for (line, column), text in texts.items()
    )


def _says(number: Expr, box: Box) -> Expr:
    """Return the condition that a leaf, or bits of one, have one of the keys: one term for each interval, however many keys it has."""
    kind = number.type

    def compared(op: Op, key: int) -> Expr:
        return Apply(op, (number, Literal(value_of_key(kind, key), kind)), Bool())

    if isinstance(kind, Enum):
        return Among(number, tuple(key for low, high in box for key in range(low, high + 1)))
    if isinstance(kind, Bool):
        return disjunction(compared(Op.EQ, key) for key in (0, 1) if holds(box, key))
    return disjunction(
        compared(Op.EQ, low) if low == high else conjunction((compared(Op.GE, low), compared(Op.LE, high)))
        for low, high in box
    )


def _within(inner: Box, outer: Box) -> bool:
    return meet(inner, outer) == inner


@dataclass(frozen=True, slots=True)
class NewLine:
    """A line that matches inputs which no line matches, and none that another does.

    Attributes:
        cells: The texts of its conditions, one for each column that is written.
        closes: Whether it is proved that no input is left.
    """

    cells: tuple[str, ...]
    closes: bool

    @property
    def told(self) -> str:
        """Describe the line and whether it closes the gap."""
        what = "closes the gap" if self.closes else "closes this part of the gap"
        return f"a line `| {' | '.join(('new', *self.cells))} || ... |` {what} and overlaps no other"


def new_line(program: Program, table: Table, gap: Gap) -> NewLine | None:
    """Return a line for the gap's first region; it overlaps none, and whether it closes the gap is counted, or proved.

    None for a turned table, which has no row for it.
    """
    if table.turned:
        return None
    region, witness = gap.regions[0], gap.witnesses[0]
    row = None
    words = words_of(program, table)
    if region is not None and words is not None and not table.assumptions:
        row = _line_of_boxes(program, table, region, words)
    return row or _line_across(program, table, witness, region or {})


def _line_of_boxes(program: Program, table: Table, region: Region, words: Words) -> NewLine | None:
    """Return the line of a table of boxes whose cells state the region."""
    kinds: dict[str, Scalar] = program.kinds
    told = [cells.cell_under(column, kinds, region) for column in _written(table)]
    said = [cell for cell in told if cell is not None]
    decided = boxes.TableBoxes.of(program, table, words)
    if len(said) < len(told) or set(region) - frozenset().union(*(names for _, names in said)):
        return None
    if not set(region) <= set(decided.names):
        return None  # bounds of what only an assumption reads
    texts = [text for text, _ in said]
    decided.lines.append(dict(region.items()))
    pairs = list(decided.overlaps())
    if any(len(decided.lines) - 1 in pair for pair in pairs):
        return None
    try:
        closes = not Gaps.of(decided, disjoint=not pairs).missing()
    except BudgetError:
        closes = False
    return NewLine(tuple(texts), closes)


# --- across variables ------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Sum:
    """A heading that is a variable, or a whole-numbered sum of some: `sign * form + constant`."""

    kind: Scalar
    form: int
    sign: int
    constant: int

    @classmethod
    def of(cls, universe: Universe, subject: Expr) -> "_Sum | None":
        """Return a heading as a sum, or as a number that stands for itself; None for anything else."""
        if isinstance(subject, Read) or (isinstance(subject.type, Real) and is_finite(subject)):
            return cls(subject.type, universe.single[universe.column(subject)], 1, 0)
        if not isinstance(subject.type, Int):
            return None
        coefficients, constant = universe.linear(subject)
        terms = sorted((column, k) for column, k in coefficients.items() if k)
        if not terms or gcd(*(k for _, k in terms)) != 1:
            return None
        sign = 1 if terms[0][1] > 0 else -1
        return cls(
            subject.type, universe.form(tuple((column, sign * k) for column, k in terms)), sign, constant
        )

    def cell(self, universe: Universe, box: Box) -> str:
        """Spell the cell under the heading for these values of the form; "" for all, and where no cell says it."""
        if not isinstance(self.kind, Int):
            return cells.cell(self.kind, box) or ""
        ends = ((universe.low[self.form], universe.high[self.form]),)
        pairs = [(self.sign * a + self.constant, self.sign * b + self.constant) for a, b in (*box, *ends)]
        *shown, (least, most) = ((min(pair), max(pair)) for pair in pairs)
        return cells.cell(replace(self.kind, low=least, high=most), joined(shown)) or ""


@dataclass(frozen=True, slots=True)
class _Cell:
    """A cell that the witness satisfies: its column, its text, its formula, and the lines that it excludes."""

    column: int
    text: str
    formula: Formula
    excludes: frozenset[int]


@dataclass(slots=True)
class _Row:
    """A row for an input that no line matches, made from the table's own cells and their opposites.

    Attributes:
        cells: The cells chosen, by column.
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
        self.kinds = self.program.kinds
        self.lines = lines_of(self.universe, self.table)
        self.assumed = assumptions_of(self.universe, self.program, self.table)

    def apart(self, formulas: Sequence[Formula], line: int) -> bool:
        """Return whether the formulas exclude a line, under the assumptions."""
        wanted = [*formulas, whole(self.lines[line]), *map(whole, self.assumed)]
        return find(self.universe, wanted) is NoWitness.NONE

    def choose(self) -> bool:
        """Choose one cell a column, first the one that excludes most, until all lines are excluded; return whether they are."""
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
        """Yield every cell that could stand in the row, each text of a column once."""
        known: set[tuple[int, str]] = set()
        for at, text, formula in self._possible():
            if (at, text) in known or not text:
                continue
            known.add((at, text))
            excluded = (line for line in range(len(self.lines)) if self.apart([formula], line))
            yield _Cell(at, text, formula, frozenset(excluded))

    def _possible(self) -> Iterator[tuple[int, str, Formula]]:
        """Yield, for each column, the cells of lines, or their opposites, that the witness satisfies; and the region's cell."""
        for at, column in enumerate(_written(self.table)):
            name = column.variable
            every = dict.fromkeys(test for line in self.table.lines if (test := line.tests[at]) is not None)
            if name is not None and name in self.witness:
                boxes_ = [self._turned(name, test.box) for test in every if test.box is not None]
                yield from ((at, *self._of_box(name, box)) for box in self._boxes(name, boxes_))
            several = list[tuple[str, Formula]]()
            for test in every:
                if name is None or name not in self.witness or test.box is None:
                    said = list(self._of_condition(column, test))
                    several += said
                    yield from ((at, *each) for each in said)
            if column.subject is None and 1 < len(several) <= MOST_JOINED:
                text = " and ".join(alone(each) for each, _ in several)
                yield at, text, every_of(formula for _, formula in several)
            if name is None and column.subject is not None:
                yield from ((at, *said) for said in self._of_sum(column.subject, every))

    def _of_sum(self, subject: Expr, tests: Iterable[Test]) -> Iterator[tuple[str, Formula]]:
        """Yield the cell that intersects, for a sum of variables, the sides of all compared constants on which the witness lies."""
        value = fold(subject, self.witness)
        heading = _Sum.of(self.universe, subject)
        if heading is None or value is None:
            return
        low, high = self.universe.low[heading.form], self.universe.high[heading.form]
        said = (_box_on(heading.form, self.universe.of(test.condition)) for test in tests)
        at = heading.sign * (key_of(subject.type, value) - heading.constant)
        sides = [
            each if holds(each, at) else complement(each, low, high) for each in said if each is not None
        ]
        box: Box = ((low, high),)
        for side in sides:
            box = meet(box, side)
        yield heading.cell(self.universe, box), self.universe.atom(heading.form, box)

    def _boxes(self, name: str, boxes_: Sequence[Box]) -> Iterator[Box]:
        """Yield the boxes that a cell under a variable may state: the region, each line's side, and the intersection of all sides."""
        if name in self.region:
            yield self.region[name]
        yield from boxes_
        yield reduce(meet, boxes_, (key_bounds(self.kinds[name]),))

    def _turned(self, name: str, box: Box) -> Box:
        """Return the keys that a cell takes, or the other keys, whichever has the witness's."""
        kind = self.kinds[name]
        return box if holds(box, key_of(kind, self.witness[name])) else complement(box, *key_bounds(kind))

    def _of_box(self, name: str, box: Box) -> tuple[str, Formula]:
        kind = self.kinds[name]
        form = self.universe.single[self.universe.column(Read(VariableName(name), kind))]
        return cells.cell(kind, box) or "", self.universe.atom(form, box)

    def _of_condition(self, column: Column, test: Test) -> Iterator[tuple[str, Formula]]:
        """Yield a condition across variables as written, or its opposite, as the witness satisfies it."""
        formula = self.universe.of(test.condition)
        truth = fold(test.condition, self.witness)
        if truth is True:
            yield test.text, formula
        elif truth is False and column.subject is None:
            yield _denied(test.text, test.condition), negated(self.universe, formula)
        elif truth is False and (text := _opposite(test.text, test.condition)):
            yield text, negated(self.universe, formula)

    def texts(self) -> tuple[str, ...]:
        """Return the cells of the row, up to the `||`."""
        found: Mapping[int, str] = {at: cell.text for at, cell in self.cells.items()}
        return tuple(found.get(at, "") for at in range(len(_written(self.table))))


def closes(program: Program, table: Table, universe: Universe, more: Iterable[Iterable[Formula]]) -> bool:
    """Return whether, with lines of these conditions more, some line matches every input; exact arithmetic alone proves it."""
    lines = [*lines_of(universe, table), *map(clauses, more)]
    tree = Tree(
        universe, lines, assumptions_of(universe, program, table), lambda _: NoWitness.UNKNOWN,
        default=False, budget=MOST_ASKED,
    )  # fmt: skip
    search = tree.run()
    return not (search.gaps or search.witnesses or search.undecided)


def _box_on(form: int, formula: Formula) -> Box | None:
    """Return the values of one form for which a formula holds; None where it speaks of others, too."""
    if isinstance(formula, Atom):
        return formula.box if formula.form == form else None
    boxes_ = [box for part in formula.parts if (box := _box_on(form, part)) is not None]
    if not boxes_ or len(boxes_) < len(formula.parts):
        return None
    return (
        reduce(meet, boxes_)
        if isinstance(formula, Every)
        else joined([part for box in boxes_ for part in box])
    )


def _written(table: Table) -> list[Column]:
    """Return the columns in which cells can be written; they stand before those that `above` adds."""
    return [column for column in table.columns if column.written]


def _line_across(program: Program, table: Table, witness: Witness, region: Region) -> NewLine | None:
    """Return a line for a table with conditions across variables or under assumptions; exact arithmetic alone proves it."""
    tests = sum(len({line.tests[at] for line in table.lines}) for at in range(len(table.columns)))
    if tests * len(table.lines) > MOST_ASKED:
        return None
    row = _Row(program, table, witness, region)
    if not row.choose():
        return None
    formulas = [cell.formula for cell in row.cells.values()]
    return NewLine(row.texts(), closes(program, table, row.universe, [formulas]))


_COMPARED = re.compile(r"(?P<left>[^<>=/@]+?)\s*(?P<op>/=|<=|>=|=|<|>)\s*(?P<right>[^<>=/@]+)", re.ASCII)


def _denied(text: str, condition: Expr) -> str:
    """Spell the opposite of a condition under `when`: of a comparison that compares."""
    said = _COMPARED.fullmatch(text)
    if said is None or re.search(r"\b(and|or|xor|implies|not|in|for|was)\b", text, re.ASCII):
        return f"not ({text})"
    other = _opposite(f"{said['op']} {said['right']}", condition)
    other = other if re.match(r"(/=|<=|>=|<|>)", other) else f"= {other}" if other else ""
    return f"{said['left']} {other}" if other else f"not ({text})"


def _opposite(text: str, condition: Expr) -> str:
    """Spell the opposite of a comparison's cell; "" for any other cell, and where a side may be a NaN."""
    if not (
        isinstance(condition, Apply) and is_comparison(condition.op) and all(map(is_finite, condition.args))
    ):
        return ""
    value = re.sub(r"^(/=|<=|>=|=|<|>)\s*", "", text)
    other = OPPOSITE[condition.op]
    return value if other is Op.EQ else f"{other.value} {value}"
