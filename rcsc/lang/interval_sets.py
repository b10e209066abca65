"""Sets of keys as intervals: what meets, what joins, how many keys, and how far one can be grown."""

from collections.abc import Callable, Iterable

from rcsc.lang.model import Box


def meet(one: Box, two: Box) -> Box:
    """The keys in both."""
    parts = ((max(a, c), min(b, d)) for a, b in one for c, d in two)
    return tuple(sorted(part for part in parts if part[0] <= part[1]))


def size(box: Box) -> int:
    """How many keys it has."""
    return sum(high - low + 1 for low, high in box)


def joined(intervals: Iterable[tuple[int, int]]) -> Box:
    """Intervals in their order, neighbours made one."""
    found: list[tuple[int, int]] = []
    for low, high in intervals:
        if found and found[-1][1] + 1 == low:
            found[-1] = (found[-1][0], high)
        else:
            found.append((low, high))
    return tuple(found)


def furthest(start: int, end: int, fits: Callable[[int], bool]) -> int:
    """The greatest value up to `end` to which it fits; at `start` it does, and up to somewhere.

    The end is tried first: what is grown often goes as far as its variable does, and that takes one question.
    """
    if start == end or fits(end):
        return end
    low, high = start, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if fits(middle):
            low = middle
        else:
            high = middle - 1
    return low
