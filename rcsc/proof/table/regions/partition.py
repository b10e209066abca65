"""Whether boxes part each other and fill their space: masks and counting, no solver.

In: for each line the keys that it may have on each axis, a variable of a table or a form of a region, and the extent of
each axis. Out: every pair of lines that meet, and the least place that no line fills.

Masks are Python integers, one bit a line. An axis is cut where some line's box begins or ends; all keys of a slice
are alike.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from math import prod
from typing import Generic, TypeAlias, TypeVar

from rcsc.lang.interval_sets import holds, joined, meet, size
from rcsc.lang.model import Box
from rcsc.proof.table.regions.holes import Hole, holes_between, without

MOST_PAIRS = 10_000
"""Overlapping pairs that are told apart; a report shows a few."""
BUDGET = 5_000_000
"""Budget of a search for gaps: lines, pairs and slices looked at, the same on every machine."""
MOST_CUT = 20_000
"""Holes looked at, together, as the regions shown are cut out of them one by one: some tenths of a second."""
MANY = 64
"""Above so many lines a certificate leaves the parting axis of each pair to the checker."""

Axis = TypeVar("Axis", bound=Hashable)
Bounds: TypeAlias = tuple[int, int]
BoxLine: TypeAlias = Mapping[Axis, Box]
Cell: TypeAlias = dict[Axis, Bounds]


class BudgetError(Exception):
    """A search for gaps looked at more than `BUDGET`; whether there is a gap (or another one) is open."""


@dataclass(slots=True)
class Boxes(Generic[Axis]):
    """Lines as boxes.

    Attributes:
        extents: Least and greatest key of each axis, in the order in which places are compared.
        lines: The lines; dead ones have an empty box somewhere.
    """

    extents: dict[Axis, Bounds]
    lines: list[BoxLine[Axis]]

    @property
    def names(self) -> tuple[Axis, ...]:
        """The axes."""
        return tuple(self.extents)

    def dead(self) -> list[int]:
        """Return the lines that no input matches."""
        return [at for at, boxes in enumerate(self.lines) if any(not box for box in boxes.values())]

    def overlaps(self) -> Iterator[tuple[int, int]]:
        """Yield every pair of lines that both match some input, first line first."""
        for at, others in self.meeting():
            for other in bits_of(others):
                yield at, other

    def meeting(self) -> Iterator[tuple[int, int]]:
        """Yield each line that overlaps a later one, with the mask of those later ones."""
        everyone = (1 << len(self.lines)) - 1
        for at in self.dead():
            everyone &= ~(1 << at)
        by_box = self._by_box()
        meets: dict[tuple[Axis, Box], int] = {}
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

    def _by_box(self) -> dict[Axis, dict[Box, int]]:
        """Map each axis to its distinct boxes, each with the mask of lines that state it."""
        width = len(self.lines) // 8 + 1
        stated: dict[Axis, dict[Box, bytearray]] = {name: {} for name in self.extents}
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

    def _meetings(self, name: Axis, stated: Mapping[Box, int]) -> Iterator[tuple[Box, int]]:
        """Yield each box on the axis with the mask of lines that it can meet, or that do not test it."""
        everyone = (1 << len(self.lines)) - 1
        idle = everyone & ~_any(stated.values())
        if all(len(box) == 1 for box in stated):
            yield from _intervals_meeting(stated, idle)
            return
        axis = Sliced.of(self.extents[name], stated, idle)
        for box in stated:
            yield box, idle | axis.meeting(box)

    def sliced(self) -> dict[Axis, "Sliced"]:
        """Return each axis in slices, with the lines that hold in each."""
        everyone = (1 << len(self.lines)) - 1
        return {
            name: Sliced.of(self.extents[name], stated, everyone & ~_any(stated.values()))
            for name, stated in self._by_box().items()
        }

    def piece(self, sign: int, box: BoxLine[Axis]) -> "Piece[Axis]":
        """Return a box as a piece that adds its inputs to the count, or (`sign` -1) takes them away."""
        sizes = [1]
        for name in reversed(self.names):
            low, high = self.extents[name]
            sizes.append(sizes[-1] * (size(box[name]) if name in box else high - low + 1))
        sizes.reverse()
        return Piece(sign, box, sizes)

    def volume(self) -> int:
        """Return the number of all inputs."""
        return prod(high - low + 1 for low, high in self.extents.values())


@dataclass(frozen=True, slots=True)
class Sliced:
    """An axis that is cut wherever a box begins or ends.

    For boxes 0 .. 4 of line 0 and 3 .. 9 of line 1 the slices are 0 .. 2, 3 .. 4 and 5 .. 9, with masks 1, 3 and 2.

    Attributes:
        lows: Where each slice begins.
        cuts: The slices.
        masks: For each slice the lines that hold all over it.
        idle: The lines that state no box here.
    """

    lows: Sequence[int]
    cuts: Sequence[Bounds]
    masks: Sequence[int]
    idle: int

    @classmethod
    def of(cls, extent: Bounds, stated: Mapping[Box, int], idle: int) -> "Sliced":
        """Slice an axis by the boxes that lines state on it; `idle` are the lines that state none."""
        changes: dict[int, int] = {}
        for box, mask in stated.items():
            for low, high in joined(box):  # intervals that met would undo each other
                changes[low] = changes.get(low, 0) ^ mask
                changes[high + 1] = changes.get(high + 1, 0) ^ mask
        cuts, masks, holding = slices(extent, stated), list[int](), idle
        for low, _ in cuts:
            holding ^= changes.get(low, 0)
            masks.append(holding)
        return cls([low for low, _ in cuts], cuts, masks, idle)

    def among(self, box: Box) -> Iterator[int]:
        """Yield the number of each slice that meets the box."""
        for low, high in box:
            yield from range(max(bisect_right(self.lows, low) - 1, 0), bisect_right(self.lows, high))

    def meeting(self, box: Box) -> int:
        """Return the lines that hold somewhere in the box."""
        return _any(self.masks[at] for at in self.among(box))

    def also(self, bit: int, box: Box | None) -> "Sliced":
        """Return the axis with one more line, given by its bit; without a box it holds everywhere."""
        masks = list(self.masks)
        for at in range(len(masks)) if box is None else self.among(box):
            masks[at] |= bit
        return Sliced(self.lows, self.cuts, masks, self.idle | bit if box is None else self.idle)

    def runs(self, alive: int) -> Iterator[tuple[Bounds, int]]:
        """Yield slices joined where the same of these lines hold, with those lines."""
        begun, before = self.lows[0], self.masks[0] & alive
        for (low, _), mask in zip(self.cuts, self.masks, strict=True):
            holding = mask & alive
            if holding != before:
                yield (begun, low - 1), before
                begun, before = low, holding
        yield (begun, self.cuts[-1][1]), before


@dataclass(frozen=True, slots=True)
class Piece(Generic[Axis]):
    """A box that counts as many inputs as it has, or (with `sign` -1) takes as many away.

    Attributes:
        sizes: For each position in the order of axes, how many inputs it has in those from there on; last 1.
    """

    sign: int
    box: BoxLine[Axis]
    sizes: Sequence[int]


@dataclass(slots=True)
class Gaps(Generic[Axis]):
    """Looks for the least input that no line matches.

    It goes down the axes in order, each time into the first slice that the lines do not fill. Counting says which that is, so that
    nothing is bisected (`rcsc.proof.solvers.search.lowest`): each question of a bisection would be such a search of its own.

    How many inputs lines fill together is counted by inclusion and exclusion. Lines no two of which overlap are counted as they are;
    every other line adds its size, less what it shares with each of them, less what it and another such line both
    add, and so on. For `a` = 0 .. 6, `b` = 5 .. 9 of 0 .. 9 that is 7 + (5 - 2) = 10, all there are. Where this takes too many
    terms, lines are left out of the count; the count is then too small, which only makes the search longer.

    Nothing is counted where lines overlap and the gaps are known as boxes (`holes`): the least place is then that of a hole.

    Attributes:
        pieces: The terms of the count; none where the holes are known.
        exact: Whether every line is in it, or the holes are known.
        holes: The gaps as boxes, if known, without the regions that were last shown.
    """

    table: Boxes[Axis]
    pieces: Sequence[Piece[Axis]]
    exact: bool
    holes: list[Hole[Axis]] | None = None
    _shown: list[BoxLine[Axis]] = field(default_factory=list)
    _without: set[tuple[int, int]] = field(default_factory=set)
    _sliced: "dict[Axis, Sliced] | None" = None
    _regions: "list[Piece[Axis]]" = field(default_factory=list)
    _looked_at: int = 0

    @classmethod
    def of(cls, table: Boxes[Axis], *, disjoint: bool) -> "Gaps[Axis]":
        """Prepare the search of a table; `disjoint` says that no two of its lines overlap."""
        holes = None if disjoint else holes_between(table.extents, table.lines)
        if holes is not None:
            return cls(table, (), exact=True, holes=holes)
        counting = Counting(table, {} if disjoint else dict(table.meeting()))
        return cls(table, counting.pieces, counting.exact)

    def missing(self) -> int:
        """Count the inputs that no line matches, but for the regions last shown; an upper bound where the count is not exact."""
        if self.holes is not None:
            extents = self.table.extents
            every = ({**extents, **hole} for hole in self.holes)
            return sum(prod(high - low + 1 for low, high in hole.values()) for hole in every)
        filled = sum(piece.sign * piece.sizes[0] for piece in self.pieces)
        return self.table.volume() - filled

    def least(self, shown: Sequence[BoxLine[Axis]]) -> Cell[Axis] | None:
        """Return the least cell outside all lines and outside the regions shown; None where there is none.

        Its least place is the least of all.

        Raises:
            BudgetError: It was not found within `BUDGET`, where the count is not exact; or to cut the regions shown out of the holes takes
                more than `MOST_CUT`. Where nothing is shown, and the count is exact, this never happens.
        """
        if self.holes is not None:
            return self._least_hole(self.holes, shown)
        axes = self._axes(shown)
        self._without = set()
        alive = _any(1 << at for at, boxes in enumerate([*self.table.lines, *shown]) if all(boxes.values()))
        below, idle = list[tuple[Sliced, int]](), -1
        for axis in reversed(axes.values()):
            idle &= axis.idle
            below.append((axis, idle))
        pieces = [*self.pieces, *self._regions]  # regions meet no line and not each other
        return self._search(0, alive, below[::-1], pieces)

    def _least_hole(self, holes: list[Hole[Axis]], shown: Sequence[BoxLine[Axis]]) -> Cell[Axis] | None:
        """Return the hole with the least place, after cutting out the regions shown: those of earlier calls, and more."""
        extents = self.table.extents
        for region in shown[len(self._shown) :]:
            self._looked_at += len(holes)
            if self._looked_at > MOST_CUT:
                raise BudgetError
            holes = list(islice(without(holes, region, extents), MOST_PAIRS + 1))
            if len(holes) > MOST_PAIRS:
                raise BudgetError
            self._shown.append(region)
            self.holes = holes
        cells: Iterator[Cell[Axis]] = (
            {name: hole.get(name, extents[name]) for name in extents} for hole in holes
        )
        return min(cells, key=lambda cell: [low for low, _ in cell.values()], default=None)

    def _axes(self, shown: Sequence[BoxLine[Axis]]) -> dict[Axis, "Sliced"]:
        """Return the axes in slices, with the lines and, after them, the regions shown: those of earlier calls, and more."""
        axes = self.table.sliced() if self._sliced is None else self._sliced
        for region in shown[len(self._regions) :]:
            bit = 1 << len(self.table.lines) + len(self._regions)
            axes = {name: axis.also(bit, region.get(name)) for name, axis in axes.items()}
            self._regions.append(self.table.piece(1, region))
        self._sliced = axes
        return axes

    def _search(
        self,
        depth: int,
        alive: int,
        axes: Sequence[tuple["Sliced", int]],
        pieces: Sequence[Piece[Axis]],
    ) -> Cell[Axis] | None:
        """Return the least cell from an axis on. Each axis comes with the lines that look at no axis from there on."""
        names = self.table.names[depth:]
        if not alive:
            return {name: self.table.extents[name] for name in names}
        if not names or alive & axes[depth][1] or (depth, alive) in self._without:
            return None
        name = names[0]
        for (low, high), inside in self._short(depth, alive, axes[depth][0], pieces):
            self._looked_at += alive.bit_count() + len(pieces)
            if self._looked_at > BUDGET and not self.exact:
                raise BudgetError
            counted = [piece for piece in pieces if name not in piece.box or holds(piece.box[name], low)]
            rest = self._search(depth + 1, inside, axes, counted)
            if rest is not None:
                return {name: (low, high), **rest}
        self._without.add((depth, alive))
        return None

    def _short(
        self, depth: int, alive: int, axis: "Sliced", pieces: Sequence[Piece[Axis]]
    ) -> Iterator[tuple[Bounds, int]]:
        """Yield the parts of the axis at `depth` that the pieces do not fill, with the lines that hold in each; one sweep counts them."""
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
        for bounds, holding in axis.runs(alive):  # where the same lines hold, so do the same pieces
            self._looked_at += 1
            everywhere += change.get(bounds[0], 0)
            if everywhere != whole:
                yield bounds, holding

    def grown(self, cell: Cell[Axis], shown: Sequence[BoxLine[Axis]]) -> dict[Axis, Box]:
        """Grow the cell, in the order of axes, to a maximal region that no line and no region shown touches."""
        axes = self._axes(shown)
        near = {name: axis.meeting(((cell[name][0],) * 2,)) for name, axis in axes.items()}
        region: dict[Axis, Box] = {}
        for name, axis in axes.items():
            close = -1
            for other, mask in near.items():
                close &= -1 if other == name else mask
            free = [at for at, mask in enumerate(axis.masks) if not mask & close]
            region[name] = joined(axis.cuts[at] for at in free)
            near[name] = _any(axis.masks[at] for at in free)
        return region


class Counting(Generic[Axis]):
    """The number of inputs that lines fill together, by inclusion and exclusion (`Gaps`).

    Attributes:
        pieces: Boxes with signs, whose sizes add up to it.
        exact: Whether every line is counted.
    """

    def __init__(self, table: Boxes[Axis], met: Mapping[int, int]) -> None:
        """Count the lines of a table; `met` has for each the mask of later ones that it overlaps."""
        self.table, self.lines = table, table.lines
        self._most = 4 * len(self.lines) + 256
        self._near, crossing = _crossing(met)
        self._apart = ((1 << len(self.lines)) - 1) & ~sum(1 << at for at in crossing)
        self._added: list[tuple[Piece[Axis], int]] = []  # with the lines apart that it may meet
        self.pieces = [table.piece(1, self.lines[at]) for at in bits_of(self._apart)]
        counted = [self._count(at) for at in reversed(crossing)]  # first those that meet few
        self.exact = all(counted)

    def _count(self, at: int) -> bool:
        """Count one more line unless that takes too many terms; return whether it did."""
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

    def _alone(self, at: int) -> Iterator[tuple[Piece[Axis], int]]:
        """Yield the terms that the line adds to those counted."""
        yield self.table.piece(1, self.lines[at]), self._near[at] & self._apart
        for piece, near in self._added:
            both = common(piece.box, self.lines[at])
            if both is not None:
                yield self.table.piece(-piece.sign, both), near & self._near[at]


def parting(lines: Sequence[BoxLine[Axis]]) -> tuple[Axis, ...] | None:
    """Return, for each pair of disjoint lines in order, an axis that parts them.

    None where there are more than `MANY` lines: then a checker looks for it.
    """
    if len(lines) > MANY:
        return None
    stated: dict[Axis, dict[Box, int]] = {}
    for at, line in enumerate(lines):
        for name, box in line.items():
            of_axis = stated.setdefault(name, {})
            of_axis[box] = of_axis.get(box, 0) | 1 << at
    apart = {name: _apart(of_axis) for name, of_axis in stated.items()}
    parts: list[Axis] = []
    for at, line in enumerate(lines):
        left = (1 << len(lines)) - (2 << at)
        by_line: dict[int, Axis] = {}
        for name, box in line.items():
            new = left & apart[name][box]
            left ^= new
            by_line.update(dict.fromkeys(bits_of(new), name))
        parts += [by_line[other] for other in range(at + 1, len(lines))]
    return tuple(parts)


def _apart(stated: Mapping[Box, int]) -> dict[Box, int]:
    """Return, for each box that lines state on an axis, the lines whose box does not meet it."""
    everyone = _any(stated.values())
    if all(len(box) == 1 for box in stated):
        return {box: everyone & ~meeting for box, meeting in _intervals_meeting(stated, 0)}
    return {box: _any(mask for other, mask in stated.items() if not meet(box, other)) for box in stated}


def common(first: BoxLine[Axis], second: BoxLine[Axis]) -> dict[Axis, Box] | None:
    """Return the inputs of both boxes; None where there are none."""
    shared = dict(first)
    for name, box in second.items():
        known = shared.get(name)
        if known is not None:
            box = meet(known, box)  # noqa: PLW2901  # what is shared of it
        if not box:
            return None
        shared[name] = box
    return shared


def _crossing(met: Mapping[int, int]) -> tuple[dict[int, int], list[int]]:
    """Return which lines each line overlaps, and a greedy choice of lines without which no two overlap.

    Where very many pairs overlap, the choice is the later line of each, and the first answer is empty.
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
    left, removed = dict(near), list[int]()
    while left:
        most = max(left, key=lambda at: (left[at].bit_count(), at))
        for other in bits_of(left.pop(most)):
            left[other] &= ~(1 << most)
            if not left[other]:
                del left[other]
        removed.append(most)
    return near, removed


def slices(extent: Bounds, boxes: Iterable[Box]) -> list[Bounds]:
    """Cut the extent wherever a box begins or ends."""
    starts = {extent[0]}
    for box in boxes:
        for low, high in box:
            starts.update((low, high + 1))
    ordered = sorted(start for start in starts if start <= extent[1])
    return list(zip(ordered, [*(start - 1 for start in ordered[1:]), extent[1]], strict=True))


def bits_of(mask: int) -> Iterator[int]:
    """Yield the positions of the bits that are set, from the lowest."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


def _any(masks: Iterable[int]) -> int:
    """Unite the masks."""
    union = 0
    for mask in masks:
        union |= mask
    return union


def _intervals_meeting(stated: Mapping[Box, int], idle: int) -> Iterator[tuple[Box, int]]:
    """Yield each interval with the lines whose intervals meet it: that neither end before it nor begin after it."""
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
