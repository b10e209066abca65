"""Whether bounds on linear forms admit a rational point: exact simplex with a reason.

In: forms (integer combinations of columns) and a lower and an upper bound for each. Out: a vertex,
or Farkas multipliers that show that there is no point: integers, one a form, under
which the forms add up to nothing and their bounds to less than nothing. A positive multiplier
stands for the form's upper bound, a negative one for its lower bound.

Source: Dutertre and de Moura, A Fast Linear-Arithmetic Solver for DPLL(T), CAV 2006, section 3
(general form, Bland's rule); rows are kept as integers over a common denominator.
"""

import math
import operator
from collections.abc import Sequence
from fractions import Fraction
from typing import TypeAlias

Multipliers: TypeAlias = tuple[tuple[int, int], ...]
"""Forms with their multipliers, sorted by form, none zero."""


class Simplex:
    """Bounds on forms; copied for each region, so that regions share what they share.

    Attributes:
        low, high: Bounds by form.
    """

    __slots__ = ("_columns", "_rows", "_values", "high", "low")

    def __init__(self) -> None:
        self.low: dict[int, int] = {}
        self.high: dict[int, int] = {}
        self._columns: list[int] = []  # forms that are nonbasic
        self._values: list[int] = []  # their values, within their bounds
        self._rows: dict[int, tuple[int, list[int]]] = {}  # d, a: d * form = sum a * nonbasic

    def copy(self) -> "Simplex":
        """An independent copy; rows are never changed in place."""
        new = Simplex()
        new.low, new.high = self.low.copy(), self.high.copy()
        new._columns, new._values, new._rows = self._columns.copy(), self._values.copy(), self._rows.copy()
        return new

    def knows(self, form: int) -> bool:
        """Whether the form is part of this system."""
        return form in self.low

    def add_column(self, form: int, low: int, high: int, near: int = 0) -> None:
        """Add a form of one column, with the value of its range that is nearest to one given."""
        self.low[form], self.high[form] = low, high
        self._columns.append(form)
        self._values.append(min(max(near, low), high))
        for basic, (d, row) in self._rows.items():
            self._rows[basic] = (d, [*row, 0])

    def add_form(self, form: int, terms: list[tuple[int, int]], low: int, high: int) -> None:
        """Add a form given by known forms and coefficients."""
        self.low[form], self.high[form] = low, high
        scale = math.lcm(*(self._rows[part][0] for part, _ in terms if part in self._rows))
        row = [0] * len(self._columns)
        for part, k in terms:
            if part in self._rows:
                d, old = self._rows[part]
                for j, a in enumerate(old):
                    row[j] += k * a * (scale // d)
            else:
                row[self._columns.index(part)] += k * scale
        self._rows[form] = _reduced(scale, row)

    def restrict(self, form: int, low: int, high: int) -> None:
        """Set the bounds of a known form."""
        self.low[form], self.high[form] = low, high
        if form not in self._rows:
            j = self._columns.index(form)
            self._values[j] = min(max(self._values[j], low), high)

    def value(self, form: int) -> Fraction:
        """The form's value at the present vertex."""
        if form not in self._rows:
            return Fraction(self._values[self._columns.index(form)])
        d, row = self._rows[form]
        return Fraction(sum(a * v for a, v in zip(row, self._values, strict=True)), d)

    def refute(self) -> Multipliers | None:
        """Multipliers that no point survives, or None: then the vertex is within all bounds."""
        while True:
            violated = self._violated()
            if violated is None:
                return None
            basic, up = violated
            d, row = self._rows[basic]
            entering = self._entering(row, up)
            if entering is None:
                return self._farkas(basic, d, row, up)
            self._pivot(basic, entering, self.low[basic] if up else self.high[basic])

    def minimise(self, form: int) -> Fraction:
        """The least value of a form, where the vertex goes; it must be within all bounds (`refute`)."""
        while True:
            if form not in self._rows:
                j, up = self._columns.index(form), False
                moves = self._values[j] > self.low[form]
            else:
                row = self._rows[form][1]
                entering = self._entering(row, up=False)
                moves = entering is not None
                j, up = (0, False) if entering is None else (entering, row[entering] < 0)
            if not moves:
                return self.value(form)
            self._advance(j, up)

    def _advance(self, j: int, up: bool) -> None:
        """Move the nonbasic form at position `j` as far as all bounds let it go."""
        form, values = self._columns[j], self._values
        room, per = (self.high[form] - values[j] if up else values[j] - self.low[form]), 1
        leaving: tuple[int, int] | None = None
        for basic, (d, row) in self._rows.items():
            if row[j]:
                grows = (row[j] > 0) == up
                at = sum(map(operator.mul, row, values))
                left = d * self.high[basic] - at if grows else at - d * self.low[basic]
                less = left * per - room * abs(row[j])
                if less < 0 or (less == 0 and leaving is not None and basic < leaving[0]):
                    room, per = left, abs(row[j])
                    leaving = basic, self.high[basic] if grows else self.low[basic]
        if leaving is None:
            values[j] += room if up else -room
        else:
            self._pivot(leaving[0], j, leaving[1])

    def _violated(self) -> tuple[int, bool] | None:
        """The first form out of its bounds, and whether it must grow."""
        values = self._values
        violated: tuple[int, bool] | None = None
        for basic, (d, row) in self._rows.items():
            if violated is None or basic < violated[0]:
                at = sum(map(operator.mul, row, values))
                if at < d * self.low[basic]:
                    violated = (basic, True)
                elif at > d * self.high[basic]:
                    violated = (basic, False)
        return violated

    def _entering(self, row: list[int], up: bool) -> int | None:
        """Position of the first nonbasic form that can move the row's form the right way."""
        entering: int | None = None
        for j, a in enumerate(row):
            if a:
                form = self._columns[j]
                free = (
                    self._values[j] < self.high[form] if (a > 0) == up else self._values[j] > self.low[form]
                )
                if free and (entering is None or form < self._columns[entering]):
                    entering = j
        return entering

    def _farkas(self, basic: int, d: int, row: list[int], up: bool) -> Multipliers:
        sign = 1 if up else -1
        parts = [(self._columns[j], sign * a) for j, a in enumerate(row) if a]
        return tuple(sorted([(basic, -sign * d), *parts]))

    def _pivot(self, basic: int, j: int, value: int) -> None:
        """Exchange `basic`, which goes to its bound `value`, for nonbasic position `j`."""
        d, row = self._rows.pop(basic)
        entering, a = self._columns[j], row[j]
        sign = 1 if a > 0 else -1
        solved = [-sign * c for c in row]  # |a| * entering = sum of solved
        solved[j] = sign * d
        a = abs(a)
        for other, (e, old) in self._rows.items():
            c = old[j]
            if c:
                new = [x * a + c * y for x, y in zip(old, solved, strict=True)]
                new[j] = c * solved[j]
                self._rows[other] = _reduced(e * a, new)
        self._rows[entering] = _reduced(a, solved)
        self._columns[j], self._values[j] = basic, value


def integer_point(simplex: Simplex, columns: Sequence[int], patience: int) -> Simplex | None:
    """A system at a vertex where `columns` are integers, by bounding one fraction after the other.

    Args:
        simplex: The system; it is changed.
        columns: Forms of it that must be integers.
        patience: How many systems are looked at.

    Returns:
        None when there is none.

    Raises:
        TimeoutError: When the patience is at its end.
    """
    waiting = [simplex]
    while waiting:
        if patience == 0:
            raise TimeoutError
        patience -= 1
        here = waiting.pop()
        if here.refute() is not None:
            continue
        broken = next((form for form in columns if here.value(form).denominator != 1), None)
        if broken is None:
            return here
        below, above, cut = here.copy(), here, here.value(broken).__floor__()
        below.restrict(broken, below.low[broken], cut)
        above.restrict(broken, cut + 1, above.high[broken])
        waiting += [below, above]
    return None


def least_point(simplex: Simplex, columns: Sequence[int], patience: int) -> list[int] | None:
    """The least integers that `columns` can be together, the first compared first.

    Each is put to the least integer that it can be, given those before; where a later one finds no integer, to the next. What a
    column can be is an interval, so that past the first integer outside there is none.

    Args:
        simplex: The system; it is changed.
        columns: Forms of it, which together fix all others.
        patience: How many systems are looked at.

    Returns:
        None when there are none.

    Raises:
        TimeoutError: When the patience is at its end.
    """
    if simplex.refute() is not None:
        return None
    chosen: list[tuple[Simplex, int]] = []
    here, key = simplex, None
    while len(chosen) < len(columns):
        if patience == 0:
            raise TimeoutError
        patience -= 1
        form = columns[len(chosen)]
        key = math.ceil(here.minimise(form)) if key is None else key
        pinned = here.copy()
        pinned.restrict(form, key, key)
        if key <= here.high[form] and pinned.refute() is None:
            chosen.append((here, key))
            here, key = pinned, None
        elif chosen:
            here, key = chosen.pop()
            key += 1
        else:
            return None
    return [key for _, key in chosen]


def _reduced(d: int, row: list[int]) -> tuple[int, list[int]]:
    divisor = math.gcd(d, *row)
    return (d, row) if divisor == 1 else (d // divisor, [a // divisor for a in row])
