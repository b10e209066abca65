"""Decisions: a tree of cuts through the classes of leaves, which parts the lines of a table.

In: for each probe of a table the masks of its classes. Out: a tree whose inner nodes ask whether the class of one
probe is at least some number, and whose ends keep the lines that match there.

>>> wide, full = (0b001, 0b110), (0b011, 0b101)
>>> decided = decision((wide, full), 0b111, most=4)
>>> [end.lines for end in ends(decided)]
[1, 2, 4]

Nothing is taken from a proof: a line is left out only where its own masks exclude it. At an end each line that is left
holds throughout, so that it knows its answer: none, that line, or several.

The cut is the one after which the squares of how many lines are left on both sides sum up to least: it halves the lines
where it can, and does not keep many on both sides.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate
from operator import or_
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class End:
    """An end of the tree, where nothing more is asked.

    Attributes:
        lines: The lines that are left, a bit each; every one of them holds for all that comes here.
    """

    lines: int


@dataclass(frozen=True, slots=True)
class Cut:
    """A question: is the class of the probe at this position at least `first`?"""

    probe: int
    first: int
    below: "Decision"
    above: "Decision"


Decision: TypeAlias = Cut | End
Masks: TypeAlias = Sequence[int]
Spans: TypeAlias = tuple[tuple[int, int], ...]
"""For each probe the classes that come somewhere: from the first to before the second."""


DEEPEST = 60
"""Questions after one another, at most: Python takes no more than a hundred ifs inside each other, and no reader as many."""


class _TooManyError(Exception):
    """The tree would have too many ends, or be too deep."""


def decision(probes: Sequence[Masks], everyone: int, most: int) -> Decision | None:
    """Return a tree of cuts; None where it would have too many ends, or be deeper than `DEEPEST`.

    Args:
        probes: For each the masks of its classes.
        everyone: A mask with every line.
        most: Ends that it may have.
    """
    grower = _Grower(probes, most)
    try:
        return grower.grown(everyone, tuple((0, len(masks)) for masks in probes), DEEPEST)
    except _TooManyError:
        return None


def ends(decided: Decision) -> Iterator[End]:
    """Yield the ends, those below a cut before those above."""
    if isinstance(decided, End):
        yield decided
    else:
        yield from ends(decided.below)
        yield from ends(decided.above)


def depth(decided: Decision) -> int:
    """Return the greatest number of questions asked."""
    return 0 if isinstance(decided, End) else 1 + max(depth(decided.below), depth(decided.above))


@dataclass(slots=True)
class _Grower:
    probes: Sequence[Masks]
    left: int

    def grown(self, lines: int, spans: Spans, deep: int) -> Decision:
        """Return the tree for the lines that may match within these classes."""
        for every, (low, high) in zip(self.probes, spans, strict=True):
            lines &= reduce(or_, every[low:high], 0)  # one that matches nowhere here is not waited for
        cut = self._best(lines, spans)
        if cut is None:
            self.left -= 1
            if self.left < 0:
                raise _TooManyError
            return End(lines)
        if deep == 0:
            raise _TooManyError
        at, first, below, above = cut
        low, high = spans[at]
        under, over = (
            (*spans[:at], (low, first), *spans[at + 1 :]),
            (*spans[:at], (first, high), *spans[at + 1 :]),
        )
        return Cut(at, first, self.grown(below, under, deep - 1), self.grown(above, over, deep - 1))

    def _open(self, lines: int, spans: Spans) -> Iterator[tuple[int, int, list[int]]]:
        """Yield each probe that still tells lines apart, with its first class and the lines left in each class."""
        for at, (every, (low, high)) in enumerate(zip(self.probes, spans, strict=True)):
            masks = [mask & lines for mask in every[low:high]]
            if any(mask != lines for mask in masks):
                yield at, low, masks

    def _best(self, lines: int, spans: Spans) -> tuple[int, int, int, int] | None:
        """Return the probe and class of the best cut, and the lines left below and above; None where no probe tells lines apart."""
        best: tuple[tuple[int, int, int], tuple[int, int, int, int]] | None = None
        for at, low, masks in self._open(lines, spans):
            below = list(accumulate(masks, or_))
            above = list(accumulate(reversed(masks), or_))[::-1]
            for place in range(1, len(masks)):
                if masks[place] == masks[place - 1]:
                    continue
                one, two = below[place - 1], above[place]
                rank = (one.bit_count() ** 2 + two.bit_count() ** 2, at, low + place)
                if best is None or rank < best[0]:
                    best = rank, (at, low + place, one, two)
        return None if best is None else best[1]
