"""Points within bounds on forms: some point, and the least one.

In: bounds on forms of leaves. Out: integer points, or that there is none. Three ways, each where the one before it fails: projecting a
point that is near onto the bounds, which costs next to nothing and is checked; rounding a vertex of the bounds drawn in by what
rounding may change; and bounding fractions one after the other.
"""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from rcsc.proof.table.regions.atoms import Form, Universe
from rcsc.proof.table.regions.linear import Simplex, integer_point, least_point
from rcsc.proof.table.regions.region import Bounds, NoWitness, Point

_SWEEPS = 12
"""How often a point is projected onto all bounds before a system is solved."""
_BEYOND = 1.3
"""By how much further than to the bound itself a point is moved: so that it ends."""
_ROUNDS = 200
"""Systems looked at for an integer point before somebody else looks for it."""


def within(universe: Universe, bounds: Mapping[int, Bounds], near: Mapping[int, int]) -> Point | NoWitness:
    """Find a point within the bounds on forms, of leaves only, all put to one system.

    First one near a given point is tried (`projected`). Then each bound on several columns is drawn in by half the
    sum of its coefficients: any point of the smaller region stays within the bounds when it is rounded to integers.
    Only where that region is empty are fractions bounded one after the other.
    """
    forms, singles = universe.forms, universe.single
    if _is_opaque(universe, bounds):
        return NoWitness.UNKNOWN
    at = projected(universe, bounds, near)
    if at is not None:
        return _completed(universe, bounds, at)
    used = sorted(_of_planes(universe, bounds))
    system = _system(universe, bounds, used, {}, draw_in=True)
    if system.refute() is None:
        at = {column: round(system.value(singles[column])) for column in used}
        if all(
            low <= sum(k * at[column] for column, k in forms[form]) <= high
            for form, (low, high) in bounds.items()
            if len(forms[form]) > 1
        ):
            return _completed(universe, bounds, at)
    system = _system(universe, bounds, used, {})
    solved = integer_point(system, [singles[column] for column in used], _ROUNDS)
    if solved is None:
        return NoWitness.NONE
    return _completed(universe, bounds, {column: int(solved.value(singles[column])) for column in used})


def least_within(
    universe: Universe, bounds: Mapping[int, Bounds], columns: Sequence[int]
) -> Point | NoWitness:
    """Find the least point within the bounds on forms, of leaves only, in the order of the columns given.

    Raises:
        TimeoutError: It was not found soon enough.
    """
    if _is_opaque(universe, bounds):
        return NoWitness.UNKNOWN
    used = _of_planes(universe, bounds)
    order = [column for column in dict.fromkeys([*columns, *sorted(used)]) if column in used]
    near = projected(universe, bounds, {}) or {}
    system = _system(universe, bounds, order, near)
    keys = least_point(system, [universe.single[column] for column in order], _ROUNDS)
    return (
        NoWitness.NONE if keys is None else _completed(universe, bounds, dict(zip(order, keys, strict=True)))
    )


def _is_opaque(universe: Universe, bounds: Mapping[int, Bounds]) -> bool:
    """Return whether a bound speaks of a term that is not a leaf."""
    opaque = universe.opaque
    return bool(opaque) and not opaque.isdisjoint(c for form in bounds for c, _ in universe.forms[form])


def _of_planes(universe: Universe, bounds: Mapping[int, Bounds]) -> set[int]:
    """Return the columns of all forms that have several."""
    forms = universe.forms
    return {column for form in bounds if len(forms[form]) > 1 for column, _ in forms[form]}


def _system(
    universe: Universe,
    bounds: Mapping[int, Bounds],
    used: Sequence[int],
    near: Mapping[int, int],
    *,
    draw_in: bool = False,
) -> Simplex:
    """Build the system of the bounds over the columns used, at a point near the one given."""
    forms, singles = universe.forms, universe.single
    system = Simplex()
    for column in used:
        form = singles[column]
        ends = bounds.get(form, (universe.low[form], universe.high[form]))
        system.add_column(form, *ends, near.get(column, 0))
    for form, (low, high) in bounds.items():
        if len(forms[form]) > 1:
            margin = (sum(abs(k) for _, k in forms[form]) + 1) // 2 if draw_in else 0
            if low + margin > high - margin:
                margin = 0
            terms = [(singles[column], k) for column, k in forms[form]]
            system.add_form(form, terms, low + margin, high - margin)
    return system


def projected(
    universe: Universe, bounds: Mapping[int, Bounds], near: Mapping[int, int]
) -> dict[int, int] | None:
    """Find the columns of a point within the bounds by projecting onto one bound after the other; None where that does not end soon.

    Source: Agmon, The relaxation method for linear inequalities, 1954. It guesses in floating point; what it returns was checked exactly.
    """
    planes, drawn, ends = [], list[_Plane](), dict[int, Bounds]()
    for form, (low, high) in bounds.items():
        terms = universe.forms[form]
        if len(terms) > 1:
            planes.append((terms, low, high))
            reach, square = universe.norms[form]
            margin = min(reach, (high - low) // 2)
            drawn.append((terms, low + margin, high - margin, square))
            for column, _ in terms:
                if column not in ends:
                    single = universe.single[column]
                    ends[column] = bounds.get(single, (universe.low[single], universe.high[single]))
    try:
        point = _relaxed(drawn, ends, near)
    except (OverflowError, ValueError):  # no double is so large
        return None
    for terms, low, high in planes:
        if not low <= sum([k * point[c] for c, k in terms]) <= high:
            return None
    return point


_Plane: TypeAlias = tuple[Form, int, int, int]
"""A form, its bounds, and the square of its normal."""


def _relaxed(planes: Sequence[_Plane], ends: Mapping[int, Bounds], near: Mapping[int, int]) -> dict[int, int]:
    """Project a point onto the planes until it rests or the sweeps are used up; return it rounded, within the columns' bounds."""
    at = {column: float(min(max(near.get(column, 0), low), high)) for column, (low, high) in ends.items()}
    for _ in range(_SWEEPS):
        moved = False
        for terms, low, high, square in planes:
            value = 0.0
            for column, k in terms:
                value += k * at[column]
            if not low <= value <= high:
                moved = True
                step = ((low if value < low else high) - value) * _BEYOND / square
                for column, k in terms:
                    least_, greatest = ends[column]
                    at[column] = min(max(at[column] + k * step, least_), greatest)
        if not moved:
            break
    return {column: min(max(round(at[column]), low), high) for column, (low, high) in ends.items()}


def _completed(universe: Universe, bounds: Mapping[int, Bounds], at: Mapping[int, int]) -> Point:
    """Complete a point: every column that no bound on several columns mentions gets its least value."""
    return {
        column: at[column] if column in at else bounds.get(form, (universe.low[form],))[0]
        for column, form in enumerate(universe.single)
    }
