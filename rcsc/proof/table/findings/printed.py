"""What mends a table that is printed the other way round, in the form in which it is printed.

In: a finding of such a table, whose lines are its cells. Out: proposals that change a cell, a row's condition or a heading, or add
a row or a column; or nothing. A row's condition and a heading are those of several lines: whether the others stay right is tried in
the text (`mending`), as for every proposal.

A gap of the row `low` of a table `giving lamp` with the cells `level < 3` and `level > 5` gets a column `lamp`, which keeps its value, and
in it `level in 3 .. 5`.
"""

import re
from collections.abc import Iterable, Iterator, Sequence

from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Proposal
from rcsc.lang.interpret import UNDEFINED, holds
from rcsc.lang.interval_sets import meet
from rcsc.lang.model import Box, Line, Printed, Program, Read, Scalar, Table, Test, VariableName
from rcsc.proof.table import cells
from rcsc.proof.table.regions.atoms import Formula, Universe, every, lines_of, some
from rcsc.proof.table.regions.least import find, negated, whole
from rcsc.proof.table.regions.region import NoWitness
from rcsc.proof.table.repair import alone, closes, either, with_heading
from rcsc.proof.table.verdict import Gap, Region, Witness


def meets(line: Line, witness: Witness) -> bool:
    """Return whether a line's tests hold at an input, as far as it says what they look at."""
    try:
        return all(holds(test, witness) for test in line.tests if test is not None)
    except (LookupError, *UNDEFINED):
        return False


def same_as(table: Table, second: int, first: int) -> Change | None:
    """Return the change that says that the second line does the same as the first, of its row or its column; None where none can."""
    printed = table.turned
    assert printed is not None
    (row, column), (other_row, other_column) = printed.places[second], printed.places[first]
    if column == other_column and printed.named:
        return Change(ChangeKind.SAME, printed.rows[row], texts=(printed.rows[other_row],))
    if row != other_row or re.search(r"\bsame\b", printed.headings[column]):
        return None
    return with_heading(printed, column, printed.said[column], f" same {printed.columns[other_column]}")


def where(change: Change | None) -> str:
    """Say where a change is written that says that two lines do the same: `in the heading: `."""
    if change is None:
        return ""
    what = change.texts[0] if change.place is ChangeKind.HEADING else f"{change.line} same {change.texts[0]}"
    return f"in {'a heading' if change.place is ChangeKind.HEADING else 'a row'}, `{what}`, "


def emptied(table: Table, line: int) -> Change:
    """Return the change that empties a line's cell."""
    printed = table.turned
    assert printed is not None
    row, column = printed.places[line]
    return Change(
        ChangeKind.CELL, printed.rows[row], printed.written(column), ("" if printed.by else "false",)
    )


def filling(program: Program, table: Table, gap: Gap) -> Proposal | None:
    """Return the proposal that closes a gap, or the part of it around its least input; its result is left as it is."""
    assert table.turned is not None
    if table.turned.giving not in program.kinds:
        return None  # nothing can be written that does nothing
    return _Filling(program, table, table.turned, gap).proposal()


class _Filling:
    """One gap of one table being closed; the first region around its first input is."""

    def __init__(self, program: Program, table: Table, printed: Printed, gap: Gap) -> None:
        self.program, self.table, self.printed = program, table, printed
        self.kinds: dict[str, Scalar] = program.kinds
        self.region: Region = gap.regions[0] or {}
        self.witness = gap.witnesses[0]
        self.keeps = printed.giving

    def proposal(self) -> Proposal | None:
        """Return a cell for an empty one, else a column for a row, else a row."""
        here = next(((line, place) for line, place in self.unsaid() if meets(line, self.witness)), None)
        if here is None:
            return self.row()
        line, (row, column) = here
        if column >= 0:
            return self.cell(line, row, column)
        return self.column(line, row) if self.printed.by else self.condition(line, row)

    def made(
        self, what: str, changes: Sequence[Change], formulas: Iterable[Sequence[Formula]], universe: Universe
    ) -> Proposal:
        """Return the proposal of these changes, which come to lines with these conditions."""
        closed = closes(self.program, self.table, universe, formulas)
        which = "the gap" if closed else "this part of the gap"
        proved = f"it closes {which} and overlaps no other line"
        told = (f"{what} closes {which} and overlaps no other line: ", "")
        return Proposal(_title(what), str(self.table.name), proved, tuple(changes), told, closed, sure=True)

    def cell(self, line: Line, row: int, column: int) -> Proposal:
        """Write the result as it is in an empty cell."""
        universe = Universe()
        name, heading = self.printed.rows[row], self.printed.said[column]
        change = Change(ChangeKind.CELL, name, self.printed.written(column), (self.keeps,))
        what = f"a result in row `{name}` under `{heading}`, `{self.keeps}` for none new,"
        return self.made(what, [change], [_of(universe, line)], universe)

    def column(self, line: Line, row: int) -> Proposal | None:
        """Add a column for what a matrix has no column for: in all rows where no column is about any of it, else in this one."""
        at, subject = self.printed.conditions, self.table.columns[self.printed.conditions]
        name = str(subject.variable)
        box = None if subject.variable is None else self.region.get(name)
        text = None if box is None else cells.cell(self.kinds[name], box)
        if not text or box is None:
            return None
        tests = (each.tests[at] for each in (*self.table.lines, *self.table.unsaid))
        fresh = not any(test is not None and test.box is not None and meet(test.box, box) for test in tests)
        every_row = [each for each, (_, column) in self.unsaid() if column < 0]
        universe = Universe()
        wanted = universe.atom(self.form(universe, name), box)
        lines = [[*_of(universe, each), wanted] for each in (every_row if fresh else [line])]
        does = [self.keeps if fresh or each == row else "" for each in range(len(self.printed.rows))]
        what = (
            f"a column `{text}` with {'results' if fresh else f'a result in row `{self.printed.rows[row]}`'}"
        )
        return self.made(what, [Change(ChangeKind.COLUMN, texts=(text, *does))], lines, universe)

    def condition(self, line: Line, row: int) -> Proposal | None:
        """Write under the result that stays as it is when no other cell of the row holds; None where that might overlap another row's.

        A cell that says something already is a line: that it overlaps with more inputs than before no finding would show.
        """
        universe = Universe()
        at = self.printed.conditions
        mine = [
            each
            for each, (where, _) in zip(self.table.lines, self.printed.places, strict=True)
            if where == row
        ]
        tests = [test for each in mine if (test := each.tests[at]) is not None]
        outside = negated(universe, some(universe.of_test(test) for test in tests))
        text, formula = self.spoken(line), every(self.bounds(universe))
        if not text or not closes(self.program, self.table, universe, [[*_of(universe, line), formula]]):
            said = " or ".join(alone(test.text) for test in tests)
            text, formula = f"not ({said})" if said else "true", outside
        name = self.printed.rows[row]
        told, change = [*_of(universe, line), formula], self.kept(row, text)
        others = (whole(each) for each in lines_of(universe, self.table))
        longer = change.place is ChangeKind.CELL
        if longer and any(find(universe, [*told, other]) is not NoWitness.NONE for other in others):
            return None
        what = f"`{text}` in row `{name}` under `{self.keeps}`, or another result,"
        return self.made(what, [change], [told], universe)

    def kept(self, row: int, text: str) -> Change:
        """Return the change that has the result stay as it is where a condition holds, in a row that is there."""
        printed = self.printed
        if self.keeps not in printed.said:
            rows = (text if each == row else "" for each in range(len(printed.rows)))
            return Change(ChangeKind.COLUMN, texts=(self.keeps, *rows))
        column = printed.said.index(self.keeps)
        old = next(
            (
                line.tests[printed.conditions]
                for line, place in zip(self.table.lines, printed.places, strict=True)
                if place == (row, column)
            ),
            None,
        )
        both = text if old is None else either(old.text, text)
        return Change(ChangeKind.CELL, printed.rows[row], printed.written(column), (both,))

    def row(self) -> Proposal | None:
        """Add a row for inputs of which no row is."""
        printed = self.printed
        columns = self.table.columns[: printed.conditions]
        told = [cells.cell_under(column, self.kinds, self.region) for column in columns]
        texts = [each[0] for each in told if each is not None]
        if len(texts) < len(told) or (not printed.named and not texts[0]):
            return None
        universe = Universe()
        said = frozenset().union(*(each[1] for each in told if each is not None))
        if not set(self.region) <= said | (
            {str(self.table.columns[printed.conditions].variable)} if printed.by else set()
        ):
            return None
        formulas = list(self.bounds(universe))
        shown = " | ".join(text or " " for text in texts)
        if printed.by:
            tests = self.apart()
            does = [self.keeps if column in tests else "" for column in range(len(printed.columns))]
            lines = [
                [*formulas, *(() if test is None else (universe.of_test(test),))] for test in tests.values()
            ]
            change = Change(ChangeKind.LINE, texts=(*texts, *does))
            return self.made(f"a row `{shown}` with results", [change], lines, universe)
        held = (
            []
            if self.keeps in printed.said
            else [Change(ChangeKind.COLUMN, texts=(self.keeps, *[""] * len(printed.rows), "true"))]
        )
        does = ["true" if said == self.keeps else "" for said in printed.said]
        changes = [Change(ChangeKind.LINE, texts=(*texts, *does)), *held]
        what = f"a row `{shown}` with `true` under `{self.keeps}`, or another result,"
        return self.made(what, changes, [formulas], universe)

    def unsaid(self) -> Iterator[tuple[Line, tuple[int, int]]]:
        """Yield where lines may be missing, each with its row and column."""
        return zip(self.table.unsaid, self.printed.unsaid, strict=True)

    def apart(self) -> dict[int, Test | None]:
        """Return the columns by what a matrix is by, with their tests, without those that overlap an earlier one."""
        found: dict[int, Test | None] = {}
        boxes = list[Box]()
        for column in range(len(self.printed.columns)):
            if self.printed.alone(column):
                continue
            test = self.test(column)
            box = () if test is None else test.box or ()
            if any(meet(box, other) for other in boxes):
                continue
            found[column] = test
            boxes.append(box)
        return found

    def test(self, column: int) -> Test | None:
        """Return the test of a column's heading."""
        places = zip(self.table.lines, self.printed.places, strict=True)
        return next(
            line.tests[self.printed.conditions]
            for line, (_, where) in (*places, *self.unsaid())
            if where == column
        )

    def form(self, universe: Universe, name: str) -> int:
        """Return the form of a variable."""
        return universe.single[universe.column(Read(VariableName(name), self.kinds[name]))]

    def bounds(self, universe: Universe) -> Iterator[Formula]:
        """Yield what the region says of each variable."""
        yield from (
            universe.atom(self.form(universe, name), box)
            for name, box in self.region.items()
            if name in self.kinds
        )

    def spoken(self, line: Line) -> str:
        """Return the region as a condition, without what the row says already; "" where none says it."""
        said = []
        row: dict[str, Box] = {
            str(test.variables[0]): test.box
            for test in line.tests
            if test is not None and test.box is not None
        }
        for name, box in self.region.items():
            kind = self.kinds.get(name)
            text = None if kind is None else cells.cell(kind, box)
            if kind is None or text is None:
                return ""
            if row.get(name) != box and text:
                before = self.program.variable(name).previous_of
                said.append(cells.condition(name if before is None else f"was {before}", kind, box))
        return " and ".join(said)


def _of(universe: Universe, line: Line) -> list[Formula]:
    return [universe.of_test(test) for test in line.stated]


def _title(what: str) -> str:
    return f"write {what.rstrip(',')}"
