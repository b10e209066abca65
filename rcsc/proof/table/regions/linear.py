"""Whether bounds on linear forms admit a rational point: exact simplex with a reason.

In: forms (integer combinations of columns) and a lower and an upper bound for each. Out: a vertex,
or Farkas multipliers that show that there is no point: integers, one a form, under
which the forms add up to nothing and their bounds to less than nothing. A positive multiplier
stands for the form's upper bound, a negative one for its lower bound.

Source: Dutertre and de Moura, A Fast Linear-Arithmetic Solver for DPLL(T), CAV 2006, section 3
(general form, Bland's rule); integers over a common denominator.
"""

import math
import operator
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import TypeAlias

Multipliers: TypeAlias = tuple[tuple[int, int], ...]
"""Forms with their multipliers, sorted by form, none zero."""


class Simplex:
    """Bounds on forms, and a vertex; copied for each region, so that regions share all that did not change.

    Columns alone are kept as sums of nonbasic forms, over one denominator: a form is a sum of a few of them, so that a pivot costs no
    more where there are many forms. Of `x + y` and `x - y`, both nonbasic, 2 x is their sum and 2 y their difference.

    Attributes:
        low, high: Bounds by form.
    """

    __slots__ = ("_at", "_basis", "_d", "_rows", "_terms", "_unsure", "_values", "high", "low")

    def __init__(self) -> None:
        self.low: dict[int, int] = {}
        self.high: dict[int, int] = {}
        self._terms: dict[int, Sequence[tuple[int, int]]] = {}  # of each form; shared by copies
        self._basis: list[int] = []  # forms that are nonbasic
        self._values: list[int] = []  # their values, within their bounds
        self._d = 1  # d * column = sum of row * nonbasic; positive
        self._rows: dict[int, list[int]] = {}  # of each column, never changed in place
        self._at: dict[int, int] = {}  # d * the value of each column
        self._unsure: list[int] | None = []  # forms that may be out of their bounds; None: any

    def copy(self) -> "Simplex":
        """Return an independent copy."""
        new = Simplex()
        new.low, new.high = self.low.copy(), self.high.copy()
        new._terms, new._d = self._terms, self._d
        new._basis, new._values = self._basis.copy(), self._values.copy()
        new._rows, new._at = self._rows.copy(), self._at.copy()
        new._unsure = None if self._unsure is None else self._unsure.copy()
        return new

    def knows(self, form: int) -> bool:
        """Return whether the form is part of this system."""
        return form in self.low

    def add_column(self, form: int, low: int, high: int, near: int = 0) -> None:
        """Add a form of one column, with the value of its range that is nearest to one given."""
        self.low[form], self.high[form] = low, high
        self._terms[form] = ((form, 1),)
        for column, row in self._rows.items():
            self._rows[column] = [*row, 0]
        self._rows[form] = [0] * len(self._basis) + [self._d]
        self._basis.append(form)
        self._values.append(min(max(near, low), high))
        self._at[form] = self._values[-1] * self._d

    def add_form(self, form: int, terms: Sequence[tuple[int, int]], low: int, high: int) -> None:
        """Add a form given by columns and coefficients."""
        self.low[form], self.high[form] = low, high
        self._terms[form] = terms
        if self._unsure is not None:
            self._unsure.append(form)

    def restrict(self, form: int, low: int, high: int) -> None:
        """Set the bounds of a known form."""
        self.low[form], self.high[form] = low, high
        if form not in self._basis:
            if self._unsure is not None:
                self._unsure.append(form)
            return
        j = self._basis.index(form)
        before, self._values[j] = self._values[j], min(max(self._values[j], low), high)
        if before != self._values[j]:
            self._valued()
            self._unsure = None

    def value(self, form: int) -> Fraction:
        """Return the form's value at the present vertex."""
        return Fraction(self._scaled(form), self._d)

    def _scaled(self, form: int) -> int:
        """Return the form's value times the denominator."""
        at = self._at
        return sum([k * at[column] for column, k in self._terms[form]])

    def _valued(self) -> None:
        """Add up the values of columns."""
        values = self._values
        self._at = {column: sum(map(operator.mul, row, values)) for column, row in self._rows.items()}

    def _row(self, form: int) -> list[int]:
        """Return the form as a sum of nonbasic forms, times the denominator."""
        row = [0] * len(self._basis)
        for column, k in self._terms[form]:
            row = [a + k * b for a, b in zip(row, self._rows[column], strict=True)]
        return row

    def refute(self) -> Multipliers | None:
        """Return multipliers that prove that no point exists; or None, with the vertex within all bounds."""
        if self._unsure is not None and self._violated(self._unsure) is None:
            self._unsure = []
            return None
        self._unsure = None
        while (violated := self._violated(self.low)) is not None:
            basic, up = violated
            row = self._row(basic)
            entering = self._entering(row, up)
            if entering is None:
                return self._farkas(basic, row, up)
            self._pivot(basic, row, entering, self.low[basic] if up else self.high[basic])
        self._unsure = []
        return None

    def _violated(self, forms: Iterable[int]) -> tuple[int, bool] | None:
        """Return the first of the forms that is out of its bounds, and whether it must grow."""
        d, at, terms, low, high = self._d, self._at, self._terms, self.low, self.high
        violated: tuple[int, bool] | None = None
        for form in forms:
            if violated is None or form < violated[0]:
                value = 0
                for column, k in terms[form]:
                    value += k * at[column]
                if value < d * low[form]:
                    violated = (form, True)
                elif value > d * high[form]:
                    violated = (form, False)
        return violated

    def minimise(self, form: int) -> Fraction:
        """Move the vertex to where a form is least, and return that value; it must be within all bounds (`refute`)."""
        while True:
            if form in self._basis:
                j, up = self._basis.index(form), False
                moves = self._values[j] > self.low[form]
            else:
                row = self._row(form)
                entering = self._entering(row, up=False)
                moves = entering is not None
                j, up = (0, False) if entering is None else (entering, row[entering] < 0)
            if not moves:
                return self.value(form)
            self._advance(j, up)

    def _advance(self, j: int, up: bool) -> None:
        """Move the nonbasic form at position `j` as far as all bounds let it go."""
        form, values, d = self._basis[j], self._values, self._d
        room, per = (self.high[form] - values[j] if up else values[j] - self.low[form]), 1
        leaving: tuple[int, int] | None = None
        steps = {column: row[j] for column, row in self._rows.items()}
        for basic, terms in self._terms.items():
            if basic not in self.low or basic in self._basis:
                continue
            step = sum([k * steps[column] for column, k in terms])
            if step:
                grows = (step > 0) == up
                at = self._scaled(basic)
                left = d * self.high[basic] - at if grows else at - d * self.low[basic]
                less = left * per - room * abs(step)
                if less < 0 or (less == 0 and leaving is not None and basic < leaving[0]):
                    room, per = left, abs(step)
                    leaving = basic, self.high[basic] if grows else self.low[basic]
        if leaving is None:
            values[j] += room if up else -room
            self._valued()
        else:
            self._pivot(leaving[0], self._row(leaving[0]), j, leaving[1])

    def _entering(self, row: list[int], up: bool) -> int | None:
        """Return the position of the first nonbasic form that can move the row's form the right way."""
        entering: int | None = None
        for j, a in enumerate(row):
            if a:
                form = self._basis[j]
                free = (
                    self._values[j] < self.high[form] if (a > 0) == up else self._values[j] > self.low[form]
                )
                if free and (entering is None or form < self._basis[entering]):
                    entering = j
        return entering

    def _farkas(self, basic: int, row: list[int], up: bool) -> Multipliers:
        sign = 1 if up else -1
        divisor = math.gcd(self._d, *row)
        parts = [(self._basis[j], sign * a // divisor) for j, a in enumerate(row) if a]
        return tuple(sorted([(basic, -sign * self._d // divisor), *parts]))

    def _pivot(self, basic: int, row: list[int], j: int, value: int) -> None:
        """Exchange `basic`, a row that goes to its bound `value`, for nonbasic position `j`.

        Every entry is a determinant of coefficients, so that the divisions are exact (Bareiss, Sylvester's Identity, 1968).
        """
        d, a = self._d, row[j]
        sign = 1 if a > 0 else -1
        for column, old in self._rows.items():
            c = old[j]
            new = [sign * (x * a - c * y) // d for x, y in zip(old, row, strict=True)]
            new[j] = sign * c
            self._rows[column] = new
        self._d = abs(a)
        self._basis[j], self._values[j] = basic, value
        self._valued()


def integer_point(simplex: Simplex, columns: Sequence[int], patience: int) -> Simplex | None:
    """Find a vertex at which `columns` are integers, by bounding one fraction after the other; return its system.

    Args:
        simplex: The system; it is changed.
        columns: Forms of it that must be integers.
        patience: How many systems are looked at.

    Returns:
        None when there is none.

    Raises:
        TimeoutError: The patience is at its end.
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
    """Find the least integers that `columns` can be together, the first compared first.

    Each gets the least integer possible with those before; where a later one then finds none, it gets the next. The values that a
    column can have are an interval, so that past the first integer outside there is none.

    Args:
        simplex: The system; it is changed.
        columns: Forms of it, which together fix all others.
        patience: How many systems are looked at.

    Returns:
        None when there are none.

    Raises:
        TimeoutError: The patience is at its end.
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
