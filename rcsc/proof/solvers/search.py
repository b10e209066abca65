"""Searches that ask little, by bisection: how far something can be grown, the least value there is, the items that stand out.

Each is given the question to ask. Who answers it, a solver, an exact simplex or a trial, is the caller's choice.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Item = TypeVar("Item")


def furthest(start: int, end: int, fits: Callable[[int], bool]) -> int:
    """Return the greatest value up to `end` that fits; `start` fits, and so does every value between.

    The end is tried first: a region often grows as far as its variable's range, and then one question is enough.
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


def lowest(low: int, known: int, up_to: Callable[[int, int], int | None]) -> int:
    """Find the least value by bisection.

    Args:
        low: A lower bound.
        known: A value that exists.
        up_to: Finds a value between two limits, or None where there is none; returns `known` where that stays open.
    """
    limit = low  # where most are
    while low < known:
        value = up_to(low, limit)
        if value is None:
            low = limit + 1
        elif value < known:
            known = value
        else:
            break
        limit = (low + known) // 2
    return known


def halved(items: Sequence[Item], settled: Callable[[Sequence[Item]], bool]) -> Iterator[Item]:
    """Yield, in order, each item that is not settled even alone: ask about all together, then about the halves of what is not settled.

    For 8 items of which one is not settled that takes 7 questions. Later items are asked about only when the next one is wanted.
    """
    if not items or settled(items):
        return
    middle = len(items) // 2
    if not middle:
        yield items[0]
        return
    yield from halved(items[:middle], settled)
    yield from halved(items[middle:], settled)
