"""How many inputs a region has: points of integers within bounds of forms, counted exactly.

In: bounds by form. Out: the number of points, or None where too many slices would be needed. Columns that no form of several joins are
counted apart, and multiplied. Two columns that forms join are counted in the plane: between the lines that bound the one for each value of
the other, piece by piece, by sums of `floor((a * x + b) / m)`. Of three and more the one with the fewest values is sliced.

Source of the sum: Graham, Knuth and Patashnik, *Concrete Mathematics* (2nd ed., 1994), section 3.5, and Euclid's algorithm on `a` and `m`.

>>> floors(4, 3, 2, 1)  # 1 // 3 + 3 // 3 + 5 // 3 + 7 // 3
4
>>> _plane(Column(0, 2), Column(0, 2), [Sum((1, 1), 3, 4)])  # x + y in 3 .. 4
3
"""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from itertools import combinations, pairwise
from math import prod
from typing import NamedTuple

from rcsc.proof.table.regions.atoms import Universe
from rcsc.proof.table.regions.region import Bounds

MOST_SLICES = 4_096
"""Values of further columns for each of which a plane is counted."""
MOST_LINES = 40
"""Lines that bound a plane; each pair may cross."""


class Column(NamedTuple):
    """The values of a column."""

    low: int
    high: int

    @property
    def size(self) -> int:
        """How many there are."""
        return max(0, self.high - self.low + 1)


class Sum(NamedTuple):
    """The bounds of a sum of columns, which have these factors, in the order of the columns."""

    factors: tuple[int, ...]
    low: int
    high: int


def inputs(universe: Universe, bounds: Mapping[int, Bounds], columns: Sequence[int]) -> int | None:
    """Count the values of columns for which each form is within its bounds; None where that takes too long, or others are bounded."""
    ranges = {column: _range(universe, bounds, column) for column in columns}
    sums = [form for form in bounds if len(universe.forms[form]) > 1]
    singles = {universe.forms[form][0][0] for form in bounds if len(universe.forms[form]) == 1}
    if not singles <= ranges.keys() or any(c not in ranges for form in sums for c, _ in universe.forms[form]):
        return None
    total = 1
    for together in _joined([[column for column, _ in universe.forms[form]] for form in sums], columns):
        here = [
            Sum(tuple(dict(universe.forms[form]).get(column, 0) for column in together), *bounds[form])
            for form in sums
            if universe.forms[form][0][0] in together
        ]
        many = _counted([ranges[column] for column in together], here, MOST_SLICES)
        if many is None:
            return None
        total *= many
    return total


def _range(universe: Universe, bounds: Mapping[int, Bounds], column: int) -> Column:
    form = universe.single[column]
    return Column(*bounds.get(form, (universe.low[form], universe.high[form])))


def _joined(groups: Iterable[Sequence[int]], columns: Sequence[int]) -> list[list[int]]:
    """Return the columns in groups that no form joins with another."""
    found = [{column} for column in columns]
    for group in groups:
        met = [each for each in found if not each.isdisjoint(group)]
        found = [each for each in found if each.isdisjoint(group)] + [set().union(*met)]
    return [sorted(each) for each in found]


def _counted(columns: Sequence[Column], sums: Sequence[Sum], slices: int) -> int | None:
    """Count the points of columns within sums; None where it takes more slices."""
    if not sums:
        return prod(column.size for column in columns)
    if len(columns) == 1:
        return _narrowed(columns[0], 0, sums).size
    if len(columns) == 2:  # a plane
        return _plane(columns[0], columns[1], sums)
    at = min(range(len(columns)), key=lambda each: columns[each].size)
    low, high = columns[at]
    slices //= max(1, columns[at].size)
    if not slices:
        return None
    others = [*columns[:at], *columns[at + 1 :]]
    total = 0
    for value in range(low, high + 1):
        left = [
            Sum((*each.factors[:at], *each.factors[at + 1 :]), each.low - shift, each.high - shift)
            for each in sums
            for shift in (each.factors[at] * value,)
        ]
        if any(not any(each.factors) and not each.low <= 0 <= each.high for each in left):
            continue
        many = _counted(others, [each for each in left if any(each.factors)], slices)
        if many is None:
            return None
        total += many
    return total


def _narrowed(column: Column, at: int, sums: Iterable[Sum]) -> Column:
    """Return the values of a column within sums of it alone, of which it is the factor at a position."""
    low, high = column
    for each in sums:
        k = each.factors[at]
        ends = (each.low, each.high) if k > 0 else (-each.high, -each.low)
        low, high = max(low, -(-ends[0] // abs(k))), min(high, ends[1] // abs(k))
    return Column(low, high)


class _Line(NamedTuple):
    """`(slope * x + shift) / by` as a bound of y, by > 0."""

    slope: int
    shift: int
    by: int

    def at(self, x: int) -> Fraction:
        return Fraction(self.slope * x + self.shift, self.by)

    def crosses(self, other: "_Line") -> Fraction | None:
        """Return where two lines cross; None where they are parallel."""
        slopes = self.slope * other.by - other.slope * self.by
        return Fraction(other.shift * self.by - self.shift * other.by, slopes) if slopes else None


def _plane(x: Column, y: Column, sums: Sequence[Sum]) -> int | None:
    """Count the points of two columns within sums of both; None where too many lines bound them."""
    x = _narrowed(x, 0, (each for each in sums if not each.factors[1]))
    y = _narrowed(y, 1, (each for each in sums if not each.factors[0]))
    lower, upper = [_Line(0, y.low, 1)], [_Line(0, y.high, 1)]
    for (a, b), low, high in sums:
        if a and b:
            sign = 1 if b > 0 else -1
            ends = (low, high) if b > 0 else (-high, -low)
            lower.append(_Line(-sign * a, ends[0], abs(b)))
            upper.append(_Line(-sign * a, ends[1], abs(b)))
    if not x.size or not y.size:
        return 0
    if len(lower) > MOST_LINES:
        return None
    starts = {x.low, x.high + 1}
    for one, other in combinations([*lower, *upper], 2):
        crossing = one.crosses(other)
        if crossing is not None:
            whole = crossing.numerator // crossing.denominator
            starts.update((whole + 1, whole + (crossing.denominator != 1)))
    cuts = sorted(start for start in starts if x.low <= start <= x.high + 1)
    return sum(_strip(start, past, lower, upper) for start, past in pairwise(cuts))


def _strip(start: int, past: int, lower: Sequence[_Line], upper: Sequence[_Line]) -> int:
    """Count the points for x from start on, past excluded, between lines of which no two cross there."""
    last = past - 1
    floor = max(lower, key=lambda line: line.at(start) + line.at(last))
    top = min(upper, key=lambda line: line.at(start) + line.at(last))
    if top.at(start) + top.at(last) < floor.at(start) + floor.at(last):
        return 0
    n = past - start
    above = floors(n, top.by, top.slope, top.slope * start + top.shift)
    below = floors(n, floor.by, -floor.slope, -(floor.slope * start + floor.shift))
    return above + below + n


def floors(n: int, m: int, a: int, b: int) -> int:
    """Return the sum of `(a * i + b) // m` for i from 0 to n - 1."""
    total = 0
    while n > 0:
        total += n * (n - 1) // 2 * (a // m) + n * (b // m)
        a, b = a % m, b % m
        most = a * n + b
        if most < m:
            return total
        n, b = divmod(most, m)
        m, a = a, m
    return total
