"""Tables whose tests are all sets of keys of one leaf: decided exactly by masks and counting.

In: a table without relational tests. Out: every overlapping pair, the dead lines, and the inputs that no
line matches, with least witnesses and maximal regions. No solver.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from rcsc.lang.interval_sets import meet
from rcsc.lang.model import Box, Program, Table, key_bounds, value_of_key
from rcsc.table.regions.partition import Boxes, BudgetError, Gaps, common
from rcsc.table.verdict import Gap, Overlap, Region, Witness

MOST_GAPS, MOST_FALLS = 64, 3
"""Regions of what no line matches: as many are told, and as many of what falls to DEFAULT, which is no mistake."""


def applies(table: Table) -> bool:
    """Whether every test of the table is a box."""
    return all(test is None or test.box is not None for line in table.lines for test in line.tests)


def lines_of(table: Table) -> list[dict[str, Box]]:
    """Return each line's keys by leaf; several tests of one leaf intersect."""
    lines = []
    for line in table.lines:
        boxes: dict[str, Box] = {}
        for test in line.tests:
            if test is not None:
                assert test.box is not None
                name = test.variables[0]
                boxes[name] = meet(boxes[name], test.box) if name in boxes else test.box
        lines.append(boxes)
    return lines


@dataclass(slots=True)
class TableBoxes(Boxes[str]):
    """One table as boxes of its test variables' keys, in declared order."""

    program: Program = field(kw_only=True)

    @classmethod
    def of(cls, program: Program, table: Table) -> "TableBoxes":
        """The table's boxes; all its tests must be boxes."""
        wanted = set(table.variables)
        extents = {v.name: key_bounds(v.type) for v in program.variables if v.name in wanted}
        return cls({n: extents[n] for n in table.variables}, list(lines_of(table)), program=program)

    def both(self, first: int, second: int) -> Overlap:
        """The overlap of two lines: its least witness, and the whole region where both match."""
        region = common(self.lines[first], self.lines[second])
        assert region is not None  # they overlap
        return Overlap(
            first, second, self.witness({n: box[0][0] for n, box in region.items()}), self.narrowed(region)
        )

    def witness(self, keys: Mapping[str, int]) -> Witness:
        """The values of these keys; the least of every other variable."""
        kinds = {v.name: v.type for v in self.program.variables}
        return {n: value_of_key(kinds[n], keys.get(n, self.extents[n][0])) for n in self.names}  # type: ignore[index]

    def narrowed(self, region: Mapping[str, Box]) -> Region:
        """Leave out variables that may have any key."""
        return {name: box for name, box in region.items() if box != (self.extents[name],)}

    def gap(self, disjoint: bool, most: int = MOST_GAPS) -> Gap | None:
        """Find what no line matches: up to `most` witnesses with regions, and the count if lines are disjoint.

        Raises:
            BudgetError: Whether there is anything was not found out.
        """
        search = Gaps.of(self, disjoint=disjoint)
        missing = search.missing()
        if not missing:
            return None
        count = (missing, self.volume()) if search.exact else None
        shown: list[dict[str, Box]] = []
        witnesses = []
        try:
            while len(shown) < most and (cell := search.least(shown)) is not None:
                shown.append(search.grown(cell, shown))
                witnesses.append(self.witness({name: low for name, (low, _) in cell.items()}))
        except BudgetError:
            if not witnesses:
                raise
        if not witnesses:
            return None
        return Gap(tuple(witnesses), tuple(self.narrowed(region) for region in shown), count)
