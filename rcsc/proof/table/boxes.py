"""Tables whose tests are all sets of keys of one leaf: decided exactly by masks and counting.

In: a table without relational tests; of words that are taken apart bits are the axes (`regions.word_bits`). Out: every
overlapping pair, the dead lines, and the inputs that no line matches, with least witnesses and maximal regions. No solver.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import prod

from rcsc.lang.interval_sets import meet
from rcsc.lang.model import Box, Int, Program, Scalar, Table, Test, key_bounds, value_of_key
from rcsc.proof.table.regions.partition import Boxes, BudgetError, Gaps, common
from rcsc.proof.table.regions.word_bits import Part, Words, boxes_of
from rcsc.proof.table.verdict import Gap, Overlap, Region, Witness

MOST_GAPS, MOST_FALLS = 64, 3
"""Regions of what no line matches: as many are told, and as many of what falls to DEFAULT, which is no mistake."""

MOST_PATTERNS = 1 << 20
"""Patterns of bits up to which it is told how many of them a gap has."""


def applies(table: Table) -> bool:
    """Return whether every test of the table is a box."""
    return all(test is None or test.box is not None for line in table.lines for test in line.tests)


def lines_of(table: Table, words: Words | None = None) -> list[dict[str, Box]]:
    """Return each line's keys by leaf, or by part of a word; several tests of one leaf intersect."""
    known: dict[int, Mapping[str, Box]] = {}
    lines = []
    for line in table.lines:
        boxes: dict[str, Box] = {}
        for test in line.stated:
            if id(test) not in known:
                known[id(test)] = _of_test(test, words or {})
            for name, box in known[id(test)].items():
                boxes[name] = meet(boxes[name], box) if name in boxes else box
        lines.append(boxes)
    return lines


def _of_test(test: Test, words: Words) -> Mapping[str, Box]:
    leaf = test.variables[0]
    if leaf in words:
        boxes = boxes_of(test, words[leaf])
        assert boxes is not None
        return boxes
    assert test.box is not None
    return {leaf: test.box}


@dataclass(slots=True)
class TableBoxes(Boxes[str]):
    """One table as boxes of its test variables' keys, in declared order; a split word has a box for each of its parts.

    Attributes:
        kinds: Of every variable of the program.
        least: The least input, in declared order.
        words: The words that are split into parts.
    """

    kinds: Mapping[str, Scalar] = field(kw_only=True)
    least: Witness = field(kw_only=True)
    words: Words = field(default_factory=dict, kw_only=True)

    @classmethod
    def of(cls, program: Program, table: Table, words: Words | None = None) -> "TableBoxes":
        """Build the table's boxes. All its tests must be boxes, and those of split words boxes of their parts."""
        split = words or {}
        kinds: dict[str, Scalar] = program.kinds
        extents: dict[str, tuple[int, int]] = {}
        for leaf in table.variables:
            parts = {part.name: key_bounds(part.kind) for part in split.get(leaf, ())}
            extents |= parts or {leaf: key_bounds(kinds[leaf])}
        least = {
            leaf: 0 if leaf in split else value_of_key(kind, extents[leaf][0])
            for leaf, kind in kinds.items()
            if leaf in split or leaf in extents
        }
        return cls(extents, list(lines_of(table, split)), kinds=kinds, least=least, words=split)

    def both(self, first: int, second: int) -> Overlap:
        """Return the overlap of two lines: its least witness, and the whole region where both match."""
        region = common(self.lines[first], self.lines[second])
        assert region is not None  # they overlap
        return Overlap(
            first, second, self.witness({n: box[0][0] for n, box in region.items()}), self.narrowed(region)
        )

    def witness(self, keys: Mapping[str, int]) -> Witness:
        """Return the witness with these keys; every other variable has its least value."""
        values = dict(self.least)
        for name, key in keys.items():
            if name in values:
                kind = self.kinds[name]
                values[name] = (
                    key if type(kind) is Int else value_of_key(kind, key)
                )  # most often, and very often
        for leaf, parts in self.words.items():
            values[leaf] = self._word(parts, keys)
        return values

    @staticmethod
    def _word(parts: Sequence[Part], keys: Mapping[str, int]) -> int:
        return sum(keys.get(part.name, 0) << part.low for part in parts)

    def narrowed(self, region: Mapping[str, Box]) -> Region:
        """Return the region without the variables that may have any key."""
        extents = self.extents
        return {name: box for name, box in region.items() if len(box) != 1 or box[0] != extents[name]}

    def gap(self, disjoint: bool, most: int = MOST_GAPS) -> Gap | None:
        """Find the gap: up to `most` witnesses with regions, and the count of inputs where it is exact.

        Raises:
            BudgetError: The search ended before it was known whether there is a gap.
        """
        search = Gaps.of(self, disjoint=disjoint)
        missing = search.missing()
        if not missing:
            return None
        count = (missing, self.volume()) if search.exact else None
        idle = self._idle() if self.words else 1
        every = self.volume() // idle
        told = search.exact and idle > 1 and every <= MOST_PATTERNS
        patterns = (missing // idle, every) if told else None
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
        return Gap(tuple(witnesses), tuple(self.narrowed(region) for region in shown), count, patterns)

    def _idle(self) -> int:
        """Count the inputs that no line tells from a given one: they differ only in bits that no line reads."""
        looked_at = {name for line in self.lines for name in line}
        apart = {part.name for parts in self.words.values() for part in parts}
        return prod(high + 1 for name, (_, high) in self.extents.items() if name in apart - looked_at)
