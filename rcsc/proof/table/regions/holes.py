"""What boxes that may overlap leave open, as disjoint boxes.

In: boxes over axes. Out: disjoint boxes that together are all that none of them fills. The space is cut where that parts most boxes
(`ends`), until one box fills what is left, or none reaches into it: a hole. For `a` = 0 .. 6 and `b` = 5 .. 9 of 0 .. 12 the cut 9 leaves
10 .. 12, a hole, and 0 .. 9, which the cut 4 divides into what `a` fills and what `b` fills.

Lines of a table that cross a few others cost next to nothing here, however many pairs overlap, as what one box fills is looked at no
further. That many boxes cross each other in many axes can cost any time; hence the budget.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from itertools import product
from math import prod
from typing import NamedTuple, TypeAlias, TypeVar

from rcsc.lang.interval_sets import complement, meet
from rcsc.lang.model import Box
from rcsc.proof.table.regions.ends import Cut, Ends

MOST_LOOKED_AT = 1_500_000
"""Cuts looked at before it is given up."""

Axis = TypeVar("Axis", bound=Hashable)
Bounds: TypeAlias = tuple[int, int]
Hole: TypeAlias = dict[Axis, Bounds]
"""The bounds of axes on which it is not as wide as they are."""


class _Part(NamedTuple):
    """A part of the space: its bounds by number of axis, the boxes that reach into it, and the cuts where some of these may end."""

    bounds: dict[int, Bounds]
    alive: int
    cuts: Sequence[Cut]


def holes_between(
    extents: Mapping[Axis, Bounds], lines: Sequence[Mapping[Axis, Box]]
) -> list[Hole[Axis]] | None:
    """Return disjoint boxes that make up all that no line fills; None past the budget."""
    names = list(extents)
    number = {name: at for at, name in enumerate(names)}
    if sum(prod(map(len, boxes.values())) for boxes in lines) > 4 * len(lines) + 256:
        return None
    single = (
        [(number[name], interval) for name, interval in zip(boxes, intervals, strict=True)]
        for boxes in lines
        for intervals in product(*boxes.values())
    )
    ends = Ends(dict(enumerate(single)))
    edges = [extents[name] for name in names]
    cuts = [cut for cut in ends.cuts if edges[cut.form][0] <= cut.at < edges[cut.form][1]]
    found = _divided(ends.everyone, cuts, edges)
    return None if found is None else [{names[at]: bounds for at, bounds in hole.items()} for hole in found]


def _divided(alive: int, cuts: Sequence[Cut], edges: Sequence[Bounds]) -> list[dict[int, Bounds]] | None:
    """Return the holes by numbers of axes; None past the budget."""
    holes, waiting, looked_at = list[dict[int, Bounds]](), [_Part({}, alive, cuts)], 0
    while waiting:
        part = waiting.pop()
        if not part.alive:
            holes.append(part.bounds)
            continue
        looked_at += len(part.cuts) + 1
        if looked_at > MOST_LOOKED_AT:
            return None
        best, kept = _best(part)
        if best is not None:
            low, high = part.bounds.get(best.form, edges[best.form])
            waiting.append(_side(part, kept, best.form, (best.at + 1, high), best.below))
            waiting.append(_side(part, kept, best.form, (low, best.at), best.above))
    return holes


def _best(part: _Part) -> tuple[Cut | None, list[Cut]]:
    """Return the cut that parts most boxes (None where one box fills the part), and the cuts at which some box ends."""
    alive, opened, kept = part.alive, 0, list[Cut]()
    best, most = None, (-1, -1)
    for cut in part.cuts:
        here = cut[2] & alive
        if here:
            kept.append(cut)
            opened |= here
            parted = (cut[5] & alive).bit_count()
            if parted >= most[0]:
                lesser = min((cut[3] & alive).bit_count(), (cut[4] & alive).bit_count())
                if (parted, lesser) > most:
                    best, most = cut, (parted, lesser)
    return (None if alive & ~opened else best), kept


def _side(part: _Part, kept: Sequence[Cut], axis: int, bounds: Bounds, apart: int) -> _Part:
    """Return one side of a cut, without the boxes that lie on the other side."""
    cuts = [cut for cut in kept if cut[0] != axis or bounds[0] <= cut[1] < bounds[1]]
    return _Part({**part.bounds, axis: bounds}, part.alive & ~apart, cuts)


def without(
    holes: Sequence[Hole[Axis]], region: Mapping[Axis, Box], extents: Mapping[Axis, Bounds]
) -> Iterator[Hole[Axis]]:
    """Yield disjoint boxes that make up the holes without a region."""
    narrow = {name: box for name, box in region.items() if box != (extents[name],)}
    for hole in holes:
        if all(meet(box, (hole.get(name, extents[name]),)) for name, box in narrow.items()):
            yield from _outside(hole, narrow, extents)
        else:
            yield hole


def _outside(
    hole: Hole[Axis], region: Mapping[Axis, Box], extents: Mapping[Axis, Bounds]
) -> Iterator[Hole[Axis]]:
    """Yield disjoint boxes that make up a hole without a region that meets it."""
    inside = [hole]
    for name, box in region.items():
        before, inside = inside, []
        for cell in before:
            low, high = bounds = cell.get(name, extents[name])
            shared = meet(box, (bounds,))
            yield from ({**cell, name: rest} for rest in complement(shared, low, high))
            inside += ({**cell, name: both} for both in shared)
