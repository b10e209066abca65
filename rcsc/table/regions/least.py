"""Least points, and boxes that hold throughout, by exact linear arithmetic.

In: clauses over a `Universe` whose columns are leaves. Out: the least point in the order of the
columns given, and the widest box around it on which a condition holds. Clauses that speak of terms
that are not linear are for a solver (`smt`).

The least point pins each column, in the order given, to the least value that fits.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeAlias

from rcsc.lang.interval_sets import complement, holds, meet
from rcsc.solvers.search import furthest, lowest
from rcsc.table.regions.atoms import Atom, Clauses, Every, Form, Formula, Some, Universe, clauses, every, some
from rcsc.table.regions.linear import Simplex, integer_point
from rcsc.table.regions.region import Bounds, NoWitness, Point
from rcsc.table.regions.splitting import Tree

_SWEEPS = 12
"""How often a point is projected onto all bounds before a system is solved."""
_BEYOND = 1.3
"""By how much further than to the bound itself a point is moved: so that it ends."""
_ROUNDS = 200
"""Systems looked at for an integer point before the tree of regions looks for it."""


def find(universe: Universe, parts: Sequence[Formula], budget: int = 2_000) -> Point | NoWitness:
    """A point at which all parts hold; `NONE` when there is none, `UNKNOWN` past the budget."""
    return meeting(universe, clauses(parts), budget=budget)


def meeting(
    universe: Universe, wanted: Clauses, near: Mapping[int, int] | None = None, budget: int = 2_000
) -> Point | NoWitness:
    """A point of a conjunction as `find` has it; looked for first near another point."""
    if not wanted.rest and not wanted.impossible and all(len(box) == 1 for _, box in wanted.boxes):
        try:
            return _corner(universe, {form: box[0] for form, box in wanted.boxes}, near or {})
        except TimeoutError:
            pass  # the tree asks itself how long it goes on
    tree = Tree(
        universe,
        (),
        (wanted,),
        lambda _: NoWitness.UNKNOWN,
        default=False,
        budget=budget,
        first_only=True,
    )
    search = tree.run()
    if search.gaps:
        return search.gaps[0][1]
    return NoWitness.UNKNOWN if search.undecided else NoWitness.NONE


def _corner(universe: Universe, bounds: Mapping[int, Bounds], near: Mapping[int, int]) -> Point | NoWitness:
    """A point within the bounds on forms, of leaves only, all put to one system.

    First one near a given point is tried (`projected`). Then each bound on several columns is drawn in by half the
    sum of its coefficients: a point of what is left stays within the bounds when it is rounded to integers. Only
    where nothing is left are fractions bounded one after the other.
    """
    forms, singles = universe.forms, universe.single
    if universe.opaque and not universe.opaque.isdisjoint(c for form in bounds for c, _ in forms[form]):
        return NoWitness.UNKNOWN
    at = projected(universe, bounds, near)
    if at is not None:
        return _completed(universe, bounds, at)
    used = sorted({column for form in bounds if len(forms[form]) > 1 for column, _ in forms[form]})
    system = _system(universe, bounds, used, draw_in=True)
    if system.refute() is None:
        at = {column: round(system.value(singles[column])) for column in used}
        if all(
            low <= sum(k * at[column] for column, k in forms[form]) <= high
            for form, (low, high) in bounds.items()
            if len(forms[form]) > 1
        ):
            return _completed(universe, bounds, at)
    system = _system(universe, bounds, used, draw_in=False)
    solved = integer_point(system, [singles[column] for column in used], _ROUNDS)
    if solved is None:
        return NoWitness.NONE
    return _completed(universe, bounds, {column: int(solved.value(singles[column])) for column in used})


def _system(
    universe: Universe, bounds: Mapping[int, Bounds], used: Sequence[int], *, draw_in: bool
) -> Simplex:
    forms, singles = universe.forms, universe.single
    system = Simplex()
    for column in used:
        form = singles[column]
        system.add_column(form, *bounds.get(form, (universe.low[form], universe.high[form])))
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
    """The columns of a point within the bounds, by projecting a point onto one bound after the other; None where that does not end soon.

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
    """The point near another at which projecting comes to rest or is given up, rounded, within the bounds of columns."""
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
    """The point with the least value of every column that no bound on several columns speaks of."""
    return {
        column: at[column] if column in at else bounds.get(form, (universe.low[form],))[0]
        for column, form in enumerate(universe.single)
    }


def least(universe: Universe, parts: Sequence[Formula], columns: Sequence[int]) -> Point | NoWitness:
    """The least point at which all parts hold: first in the first of `columns`, and so on."""
    best = find(universe, parts)
    pinned, undecided = list(parts), False

    def up_to(column: int, low: int, limit: int) -> int | None:
        nonlocal best, undecided
        trial = find(universe, [*pinned, universe.atom(universe.single[column], ((low, limit),))])
        undecided = trial is NoWitness.UNKNOWN
        best = best if isinstance(trial, NoWitness) else trial
        return None if trial is NoWitness.NONE or isinstance(best, NoWitness) else best[column]

    for column in columns:
        if isinstance(best, NoWitness):
            return best
        form = universe.single[column]
        key = lowest(universe.low[form], best[column], partial(up_to, column))
        if undecided:
            return NoWitness.UNKNOWN
        pinned.append(universe.atom(form, ((key, key),)))
    return best


def inside(universe: Universe, bounds: Mapping[int, Bounds]) -> list[Formula]:
    """A region as formulas."""
    return [universe.atom(form, (interval,)) for form, interval in bounds.items()]


def widest(
    universe: Universe,
    point: Mapping[int, int],
    columns: Sequence[int],
    holds: Callable[[Mapping[int, Bounds]], bool],
) -> dict[int, Bounds]:
    """The box around `point` that is grown in the order of `columns` as far as `holds` is true of it.

    Args:
        universe: Where the columns are from.
        point: Where to begin.
        columns: What to grow, in this order; others stay free.
        holds: Whether what is looked for is true throughout a box.
    """
    box = {column: (point[column], point[column]) for column in columns}

    def fits(column: int, low: int, high: int) -> bool:
        return holds({**box, column: (low, high)})

    for column in columns:
        form = universe.single[column]
        least_, greatest = universe.low[form], universe.high[form]
        at = point[column]
        if fits(column, least_, greatest):
            box[column] = (least_, greatest)
            continue
        top = furthest(at, greatest, lambda end, c=column, a=at: fits(c, a, end))  # type: ignore[misc]  # bound early
        bottom = -furthest(-at, -least_, lambda end, c=column, t=top: fits(c, -end, t))  # type: ignore[misc]  # as above
        box[column] = (bottom, top)
    return box


def never(universe: Universe, box: Mapping[int, Bounds], formula: Formula) -> bool | None:
    """Whether a formula holds nowhere in a box of columns; None where the ends of its forms do not tell.

    Each end of a form is taken at a corner of the box: `x - y` goes from -3 to 2 for x in 0 .. 2 and y in 0 .. 3.
    """
    match formula:
        case Atom(form=form, box=wanted):
            columns = [(universe.columns[column], column, k) for column, k in universe.forms[form]]
            ends = [sorted(k * end for end in box.get(at, (c.low, c.high))) for c, at, k in columns]
            low, high = sum(least_ for least_, _ in ends), sum(greatest for _, greatest in ends)
            if not meet(wanted, ((low, high),)):
                return True
            at_a_corner = holds(wanted, low) or holds(wanted, high)
            return False if at_a_corner and not any(c.opaque for c, _, _ in columns) else None
        case Every(parts):
            return True if any(never(universe, box, part) for part in parts) else None
        case Some(parts):
            told = [never(universe, box, part) for part in parts]
            return False if False in told else None if None in told else True


def negated(universe: Universe, formula: Formula) -> Formula:
    """The opposite of a formula."""
    match formula:
        case Atom(form=form, box=box):
            return universe.atom(form, complement(box, universe.low[form], universe.high[form]))
        case Every(parts):
            return some(negated(universe, part) for part in parts)
        case Some(parts):
            return every(negated(universe, part) for part in parts)


def whole(line: Clauses) -> Formula:
    """Clauses as one formula."""
    if line.impossible:
        return Some(())
    return every((*(Atom(form, box) for form, box in line.boxes), *line.rest))
