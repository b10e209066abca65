"""Sets of keys as intervals: what meets, joins, and is left; how many keys."""

from collections.abc import Iterable

from rcsc.lang.model import Box, Test
from rcsc.lang.operator_table import MIRRORED, Comparison, Op


def meet(left: Box, right: Box) -> Box:
    """Return the keys in both."""
    if len(left) == len(right) == 1:  # nearly always, and very often: hence no call
        (a, b), (c, d) = left[0], right[0]
        low, high = (a if a > c else c), (b if b < d else d)  # noqa: FURB136  # as above
        return ((low, high),) if low <= high else ()
    parts, at, other = list[tuple[int, int]](), 0, 0
    # Both are in order, and no two intervals of one have a key in common.
    while at < len(left) and other < len(right):
        low, high = max(left[at][0], right[other][0]), min(left[at][1], right[other][1])
        if low <= high:
            parts.append((low, high))
        if left[at][1] < right[other][1]:
            at += 1
        else:
            other += 1
    return tuple(parts)


def joined(intervals: Iterable[tuple[int, int]]) -> Box:
    """Return the keys in any of the intervals."""
    merged: list[tuple[int, int]] = []
    for low, high in sorted(interval for interval in intervals if interval[0] <= interval[1]):
        if merged and low <= merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return tuple(merged)


def complement(box: Box, low: int, high: int) -> Box:
    """Return the keys from `low` to `high` that are not in the box."""
    edges, at = list[tuple[int, int]](), low
    for first, last in box:
        edges.append((at, first - 1))
        at = last + 1
    return joined([*edges, (at, high)])


def compared(op: Comparison, key: int, low: int, high: int) -> Box:
    """Return the keys from `low` to `high` that stand in this relation to a key."""
    below, at, above = (low, min(key - 1, high)), (max(key, low), min(key, high)), (max(key + 1, low), high)
    match op:
        case Op.EQ:
            return joined([at])
        case Op.NE:
            return joined([below, above])
        case Op.LT:
            return joined([below])
        case Op.LE:
            return joined([below, at])
        case Op.GT:
            return joined([above])
        case Op.GE:
            return joined([at, above])


def scaled(op: Comparison, factor: int, bound: int, low: int, high: int) -> Box:
    """Return the keys x from `low` to `high` for which factor * x stands in this relation to the bound; the factor is not 0.

    For 2 * x < 5, where 5 / 2 is no key, that is x <= 2.
    """
    op = MIRRORED[op] if factor < 0 else op
    floor, inexact = bound // factor, bound % factor != 0
    if inexact and op in (Op.EQ, Op.NE):
        return () if op is Op.EQ else ((low, high),)
    if inexact and op in (Op.LT, Op.GE):
        op = Op.LE if op is Op.LT else Op.GT
    return compared(op, floor, low, high)


def holds(box: Box, key: int) -> bool:
    """Return whether the key is in the box."""
    return any(low <= key <= high for low, high in box)


def size(box: Box) -> int:
    """Return the number of keys in the box."""
    return sum(high - low + 1 for low, high in box)


def boxes_of(tests: Iterable[Test | None]) -> dict[str, Box]:
    """Return for each leaf of which cells of a line speak alone the keys that all of them admit."""
    boxes: dict[str, Box] = {}
    for test in tests:
        if test is not None and test.box is not None:
            name = str(test.variables[0])
            boxes[name] = meet(boxes[name], test.box) if name in boxes else test.box
    return boxes
