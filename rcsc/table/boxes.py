"""Tables whose tests are all sets of keys of one leaf: decided exactly by masks and counting.

In: a table without relational tests. Out: every overlapping pair, the dead lines, and the inputs that no
line matches, with least witnesses and maximal regions. No solver.

Masks are Python integers, one bit a line. A variable's keys are cut where some line's box begins or ends;
all keys of a class are alike.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from math import prod

from rcsc.lang.interval_sets import holds, joined, meet, size
from rcsc.lang.model import Box, Program, Table, key_bounds, value_of_key
from rcsc.table.verdict import Gap, Overlap, Region, Witness

MOST_GAPS = 3
MOST_PAIRS = 10_000
"""Overlapping pairs that are told apart; a report shows a few."""
BUDGET = 5_000_000
"""Of a search for gaps: lines, pairs and classes looked at, which is the same on every machine."""
BoxLine = Mapping[str, Box]


def applies(table: Table) -> bool:
    """Whether every test of the table is a box."""
    return all(test is None or test.box is not None for line in table.lines for test in line.tests)


def lines_of(table: Table) -> list[dict[str, Box]]:
    """For each line the keys of each leaf that it tests; several tests of one leaf meet."""
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


class BudgetError(Exception):
    """A search for gaps looked at more than `BUDGET`; whether there is one (or another one) is open."""


@dataclass(slots=True)
class Boxes:
    """One table as boxes.

    Attributes:
        names: The test variables, in declared order.
        extents: Least and greatest key of each.
        lines: The lines; dead ones have an empty box somewhere.
    """

    program: Program
    names: tuple[str, ...]
    extents: dict[str, tuple[int, int]]
    lines: list[dict[str, Box]]
    _classes: dict[str, "Classes"] = field(default_factory=dict)

    @classmethod
    def of(cls, program: Program, table: Table) -> "Boxes":
        """The table's boxes; all its tests must be boxes."""
        wanted = set(table.variables)
        extents = {v.name: key_bounds(v.type) for v in program.variables if v.name in wanted}
        return cls(program, tuple(table.variables), {n: extents[n] for n in table.variables}, lines_of(table))

    def dead(self) -> list[int]:
        """Lines that nothing matches."""
        return [at for at, boxes in enumerate(self.lines) if any(not box for box in boxes.values())]

    # --- overlaps ---

    def overlaps(self) -> Iterator[tuple[int, int]]:
        """Every pair of lines that some input matches both of, first line first."""
        for at, others in self.meeting():
            for other in bits_of(others):
                yield at, other

    def meeting(self) -> Iterator[tuple[int, int]]:
        """Each line that overlaps a later one, with the mask of those later ones."""
        everyone = (1 << len(self.lines)) - 1
        for at in self.dead():
            everyone &= ~(1 << at)
        by_box = self._by_box()
        meets: dict[tuple[str, Box], int] = {}
        for name, stated in by_box.items():
            for box, mask in self._meetings(name, stated):
                meets[name, box] = mask
        for at, boxes in enumerate(self.lines):
            if not everyone >> at & 1:
                continue
            others = everyone >> (at + 1) << (at + 1)
            for name, box in boxes.items():
                if not others:
                    break
                others &= meets[name, box]
            if others:
                yield at, others

    def _by_box(self) -> dict[str, dict[Box, int]]:
        """For each variable its distinct boxes, with the lines that state them as bytes, then integers."""
        width = len(self.lines) // 8 + 1
        stated: dict[str, dict[Box, bytearray]] = {name: {} for name in self.names}
        for at, boxes in enumerate(self.lines):
            for name, box in boxes.items():
                mask = stated[name].get(box)
                if mask is None:
                    mask = stated[name][box] = bytearray(width)
                mask[at >> 3] |= 1 << (at & 7)
        return {
            name: {box: int.from_bytes(mask, "little") for box, mask in by_box.items()}
            for name, by_box in stated.items()
        }

    def _meetings(self, name: str, stated: Mapping[Box, int]) -> Iterator[tuple[Box, int]]:
        """For each box on the variable the lines that it can meet, those that do not test it among them."""
        everyone = (1 << len(self.lines)) - 1
        idle = everyone & ~_any(stated.values())
        if all(len(box) == 1 for box in stated):
            yield from _intervals_meeting(stated, idle)
            return
        classes = self.classes(name)
        inside = [_any(mask for box, mask in stated.items() if holds(box, low)) for low in classes.starts]
        for box in stated:
            yield (
                box,
                idle
                | _any(mask for low, mask in zip(classes.starts, inside, strict=True) if holds(box, low)),
            )

    def both(self, first: int, second: int) -> Overlap:
        """The overlap of two lines: its least witness, and the whole region where both match."""
        region = common(self.lines[first], self.lines[second])
        assert region is not None  # they overlap
        return Overlap(
            first, second, self.witness({n: box[0][0] for n, box in region.items()}), self.narrowed(region)
        )

    def piece(self, sign: int, box: BoxLine) -> "Piece":
        """A box as it is counted."""
        sizes = [1]
        for name in reversed(self.names):
            low, high = self.extents[name]
            sizes.append(sizes[-1] * (size(box[name]) if name in box else high - low + 1))
        sizes.reverse()
        return Piece(sign, box, sizes)

    def witness(self, keys: Mapping[str, int]) -> Witness:
        """The values of these keys; the least of every other variable."""
        kinds = {v.name: v.type for v in self.program.variables}
        return {n: value_of_key(kinds[n], keys.get(n, self.extents[n][0])) for n in self.names}  # type: ignore[index]

    def narrowed(self, region: Mapping[str, Box]) -> Region:
        """Without the variables that may have any key."""
        return {name: box for name, box in region.items() if box != (self.extents[name],)}

    # --- gaps ---

    def volume(self) -> int:
        """How many inputs there are."""
        return prod(high - low + 1 for low, high in self.extents.values())

    def gap(self, disjoint: bool) -> Gap | None:
        """What no line matches: up to three witnesses with regions, and the count where lines are disjoint.

        Raises:
            BudgetError: Whether there is anything was not found out.
        """
        search = Search.of(self, disjoint)
        missing = search.missing()
        if not missing:
            return None
        count = (missing, self.volume()) if search.exact else None
        shown: list[dict[str, Box]] = []
        witnesses = []
        try:
            while len(shown) < MOST_GAPS and (cell := search.least(shown)) is not None:
                shown.append(search.grown(cell, shown))
                witnesses.append(self.witness({name: low for name, (low, _) in cell.items()}))
        except BudgetError:
            if not witnesses:
                raise
        if not witnesses:
            return None
        return Gap(tuple(witnesses), tuple(self.narrowed(region) for region in shown), count)

    def classes(self, name: str) -> "Classes":
        """The keys of a variable, cut where some line's box begins or ends."""
        if name not in self._classes:
            starts = {self.extents[name][0]}
            for boxes in self.lines:
                for low, high in boxes.get(name, ()):
                    starts.update((low, high + 1))
            ordered = sorted(start for start in starts if start <= self.extents[name][1])
            ends = [*(start - 1 for start in ordered[1:]), self.extents[name][1]]
            self._classes[name] = Classes(ordered, ends)
        return self._classes[name]


@dataclass(frozen=True, slots=True)
class Classes:
    """Intervals of keys that no box of the table parts."""

    starts: Sequence[int]
    ends: Sequence[int]


Cell = dict[str, tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Piece:
    """A box that counts as many inputs as it has, or (with `sign` -1) takes as many away.

    Attributes:
        sizes: For each position in the table's variables, how many inputs it has in those from there on; last 1.
    """

    sign: int
    box: BoxLine
    sizes: Sequence[int]


@dataclass(slots=True)
class Search:
    """Looks for the least input that no line matches.

    A slice that the lines fill has nothing to look for: that is what keeps the search short. How many inputs lines fill together
    is counted by inclusion and exclusion. Lines no two of which overlap are counted as they are; of every other line what it adds
    to them: its size, less what it shares with each of them, less what it and another such line both add, and so on. For
    `a` = 0 .. 6, `b` = 5 .. 9 of 0 .. 9 that is 7 + (5 - 2) = 10, all there are. Where this takes too many terms, lines are left
    out of the count; what is counted is then too little, which only makes the search longer.

    Attributes:
        pieces: The terms of the count.
        exact: Whether every line is in it.
    """

    table: Boxes
    pieces: Sequence[Piece]
    exact: bool
    _without: set[tuple[int, frozenset[int]]] = field(default_factory=set)
    _looked_at: int = 0

    @classmethod
    def of(cls, table: Boxes, disjoint: bool) -> "Search":
        """The search of a table; `disjoint` where no two of its lines overlap."""
        counting = Counting(table, {} if disjoint else dict(table.meeting()))
        return cls(table, counting.pieces, counting.exact)

    def missing(self) -> int:
        """How many inputs no line matches, where the count is exact; else as many or fewer."""
        filled = sum(piece.sign * piece.sizes[0] for piece in self.pieces)
        return self.table.volume() - filled

    def least(self, shown: Sequence[BoxLine]) -> Cell | None:
        """The least cell of classes outside all lines and outside the regions shown; None where there is none.

        Raises:
            BudgetError: It was not found within `BUDGET`.
        """
        lines = [*self.table.lines, *shown]
        self._without = set()
        alive = [at for at, boxes in enumerate(lines) if all(boxes.values())]
        regions = [self.table.piece(1, region) for region in shown]  # they meet no line and not each other
        return self._search(0, alive, lines, [*self.pieces, *regions])

    def _search(
        self, depth: int, alive: list[int], lines: Sequence[BoxLine], pieces: Sequence[Piece]
    ) -> Cell | None:
        names = self.table.names[depth:]
        if not alive:
            return {name: (self.table.extents[name][0],) * 2 for name in names}
        if not names or any(not any(name in lines[at] for name in names) for at in alive):
            return None
        memory = (depth, frozenset(alive))
        if memory in self._without:
            return None
        name = names[0]
        for low, high in self._short(depth, pieces):
            self._looked_at += len(alive) + len(pieces)
            if self._looked_at > BUDGET:
                raise BudgetError
            inside = [at for at in alive if name not in lines[at] or holds(lines[at][name], low)]
            counted = [piece for piece in pieces if name not in piece.box or holds(piece.box[name], low)]
            found = self._search(depth + 1, inside, lines, counted)
            if found is not None:
                return {name: (low, high), **found}
        self._without.add(memory)
        return None

    def _short(self, depth: int, pieces: Sequence[Piece]) -> Iterator[tuple[int, int]]:
        """Classes of the variable at `depth` that the pieces do not fill, counted in one sweep."""
        name = self.table.names[depth]
        extents = [self.table.extents[other] for other in self.table.names[depth + 1 :]]
        whole = prod(high - low + 1 for low, high in extents)
        everywhere, change = 0, dict[int, int]()
        for piece in pieces:
            inside = piece.sign * piece.sizes[depth + 1]
            if name not in piece.box:
                everywhere += inside
            for low, high in piece.box.get(name, ()):
                change[low] = change.get(low, 0) + inside
                change[high + 1] = change.get(high + 1, 0) - inside
        classes = self.table.classes(name)
        self._looked_at += len(classes.starts)
        for low, high in zip(classes.starts, classes.ends, strict=True):
            everywhere += change.get(low, 0)
            if everywhere != whole:
                yield low, high

    def grown(self, cell: Cell, shown: Sequence[Mapping[str, Box]]) -> dict[str, Box]:
        """A maximal region around the cell that no line and no region shown touches, grown in declared order."""
        lines = [*self.table.lines, *shown]
        region: dict[str, Box] = {}
        for name in self.table.names:
            classes = self.table.classes(name)
            at = bisect_right(classes.starts, cell[name][0]) - 1
            region[name] = ((classes.starts[at], classes.ends[at]),)
        for name in self.table.names:
            close = [
                boxes for boxes in lines if all(meet(box, region[n]) for n, box in boxes.items() if n != name)
            ]
            classes = self.table.classes(name)
            region[name] = joined(
                (low, high)
                for low, high in zip(classes.starts, classes.ends, strict=True)
                if not any(name not in boxes or holds(boxes[name], low) for boxes in close)
            )
        return region


class Counting:
    """What lines fill together, by inclusion and exclusion (`Search`).

    Attributes:
        pieces: Boxes with signs, whose sizes add up to it.
        exact: Whether every line is counted.
    """

    def __init__(self, table: Boxes, met: Mapping[int, int]) -> None:
        """Count the lines of a table; `met` has for each the mask of later ones that it overlaps."""
        self.table, self.lines = table, table.lines
        self._most = 4 * len(self.lines) + 256
        self._near, crossing = _crossing(met)
        self._apart = ((1 << len(self.lines)) - 1) & ~sum(1 << at for at in crossing)
        self._added: list[tuple[Piece, int]] = []  # with the lines apart that it may meet
        self.pieces = [table.piece(1, self.lines[at]) for at in bits_of(self._apart)]
        counted = [self._count(at) for at in reversed(crossing)]  # first those that meet few
        self.exact = all(counted)

    def _count(self, at: int) -> bool:
        """Counts a line more, unless that takes too many terms; says whether it did."""
        if at not in self._near:
            return False
        room = self._most - len(self.pieces)
        added = list(islice(self._alone(at), room + 1))
        shared = (
            self.table.piece(-piece.sign, both)
            for piece, near in added
            for other in bits_of(near)
            if (both := common(piece.box, self.lines[other])) is not None
        )
        new = [*(piece for piece, _ in added), *islice(shared, room + 1)]
        if len(new) > room:
            return False
        self.pieces += new
        self._added += added
        return True

    def _alone(self, at: int) -> Iterator[tuple[Piece, int]]:
        """What the line adds to those that were counted beside the lines apart."""
        yield self.table.piece(1, self.lines[at]), self._near[at] & self._apart
        for piece, near in self._added:
            both = common(piece.box, self.lines[at])
            if both is not None:
                yield self.table.piece(-piece.sign, both), near & self._near[at]


def common(one: BoxLine, two: BoxLine) -> dict[str, Box] | None:
    """The inputs of both; None where there are none."""
    found = dict(one)
    for name, box in two.items():
        found[name] = meet(found[name], box) if name in found else box
        if not found[name]:
            return None
    return found


def _crossing(met: Mapping[int, int]) -> tuple[dict[int, int], list[int]]:
    """Which lines each line overlaps, and lines without which no two do: always the one that overlaps most others.

    Where very many pairs overlap these are the later line of each, and the first answer is left empty.
    """
    if sum(others.bit_count() for others in met.values()) > 50 * MOST_PAIRS:
        later = 0
        for others in met.values():
            later |= others
        return {}, list(bits_of(later))
    near: dict[int, int] = {}
    for at, others in met.items():
        near[at] = near.get(at, 0) | others
        for other in bits_of(others):
            near[other] = near.get(other, 0) | 1 << at
    left, found = dict(near), list[int]()
    while left:
        most = max(left, key=lambda at: (left[at].bit_count(), at))
        for other in bits_of(left.pop(most)):
            left[other] &= ~(1 << most)
            if not left[other]:
                del left[other]
        found.append(most)
    return near, found


def bits_of(mask: int) -> Iterator[int]:
    """Positions of the bits that are set, from the lowest."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


def _any(masks: Iterable[int]) -> int:
    """The union."""
    found = 0
    for mask in masks:
        found |= mask
    return found


def _intervals_meeting(stated: Mapping[Box, int], idle: int) -> Iterator[tuple[Box, int]]:
    """For each single interval the lines whose intervals it meets: those that neither end before it nor begin after it."""
    lows = sorted({box[0][0] for box in stated})
    highs = sorted({box[0][1] for box in stated})
    begin, end = dict.fromkeys(lows, 0), dict.fromkeys(highs, 0)
    for (interval,), mask in stated.items():
        begin[interval[0]] |= mask
        end[interval[1]] |= mask
    ended, begun = [0], [0]
    for high in highs:
        ended.append(ended[-1] | end[high])  # entry k: lines whose interval ends at one of the k lowest ends
    for low in lows:
        begun.append(begun[-1] | begin[low])
    for box in stated:
        low, high = box[0]
        yield box, idle | begun[bisect_right(lows, high)] & ~ended[bisect_left(highs, low)]
