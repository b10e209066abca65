"""Least points, and boxes that hold throughout, by exact linear arithmetic.

In: clauses over a `Universe` whose columns are leaves. Out: the least point in the order of the
columns given, and the widest box around it on which a condition holds. Clauses that speak of terms
that are not linear are for a solver (`smt`).

The least point pins each column, in the order given, to the least value that fits: within bounds by minimising it (`points`), else
by bisection.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from rcsc.lang.interval_sets import complement, holds, meet
from rcsc.proof.solvers.search import furthest, lowest
from rcsc.proof.table.regions import points
from rcsc.proof.table.regions.atoms import Atom, Clauses, Every, Formula, Some, Universe, clauses, every, some
from rcsc.proof.table.regions.region import Bounds, NoWitness, Point
from rcsc.proof.table.regions.splitting import Tree


def find(universe: Universe, parts: Sequence[Formula], budget: int = 2_000) -> Point | NoWitness:
    """Find a point at which all parts hold; `NONE` when there is none, `UNKNOWN` past the budget."""
    return meeting(universe, clauses(parts), budget=budget)


def meeting(
    universe: Universe, wanted: Clauses, near: Mapping[int, int] | None = None, budget: int = 2_000
) -> Point | NoWitness:
    """Find a point of a conjunction, as `find`; look first near another point."""
    if _is_corner(wanted):
        try:
            return points.within(universe, {form: box[0] for form, box in wanted.boxes}, near or {})
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


def _is_corner(wanted: Clauses) -> bool:
    """Return whether the clauses are just one interval a form."""
    return not wanted.rest and not wanted.impossible and all(len(box) == 1 for _, box in wanted.boxes)


def least(universe: Universe, parts: Sequence[Formula], columns: Sequence[int]) -> Point | NoWitness:
    """Find the least point at which all parts hold: least in the first of `columns`, then in the next, and so on."""
    wanted = clauses(parts)
    if _is_corner(wanted):
        try:
            return points.least_within(universe, {form: box[0] for form, box in wanted.boxes}, columns)
        except TimeoutError:
            pass  # bisection asks the tree, too
    best = meeting(universe, wanted)
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
    """Return a region as formulas."""
    return [universe.atom(form, (interval,)) for form, interval in bounds.items()]


def widest(
    universe: Universe,
    point: Mapping[int, int],
    columns: Sequence[int],
    holds: Callable[[Mapping[int, Bounds]], bool],
) -> dict[int, Bounds]:
    """Grow a box around `point`, column by column in the order of `columns`, as far as `holds` is true of it.

    Args:
        universe: Where the columns are from.
        point: Where to begin.
        columns: The columns to grow, in this order; others stay free.
        holds: Tells whether the property wanted is true throughout a box.
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
    """Return whether a formula holds nowhere in a box of columns; None where the ends of its forms do not decide.

    Each end of a form is taken at a corner of the box: `x - y` goes from -3 to 2 for x in 0 .. 2 and y in 0 .. 3.
    """
    match formula:
        case Atom(form=form, box=wanted):
            ends = (low, high) = _ends(universe, box, form)
            if not meet(wanted, (ends,)):
                return True
            at_a_corner = holds(wanted, low) or holds(wanted, high)
            return False if at_a_corner and universe.opaque.isdisjoint(_columns(universe, form)) else None
        case Every(parts):
            return True if any(never(universe, box, part) for part in parts) else None
        case Some(parts):
            told: bool | None = True
            for part in parts:
                of_part = never(universe, box, part)
                if of_part is False:
                    return False
                told = told and of_part
            return told


def _ends(universe: Universe, box: Mapping[int, Bounds], form: int) -> Bounds:
    """Return the least and the greatest value of a form in a box of columns."""
    low = high = 0
    for column, k in universe.forms[form]:
        ends = box.get(column)
        if ends is None:
            ends = universe.columns[column].low, universe.columns[column].high
        low += k * ends[k < 0]
        high += k * ends[k > 0]
    return low, high


def _columns(universe: Universe, form: int) -> list[int]:
    return [column for column, _ in universe.forms[form]]


def negated(universe: Universe, formula: Formula) -> Formula:
    """Return the negation of a formula."""
    match formula:
        case Atom(form=form, box=box):
            return universe.atom(form, complement(box, universe.low[form], universe.high[form]))
        case Every(parts):
            return some(negated(universe, part) for part in parts)
        case Some(parts):
            return every(negated(universe, part) for part in parts)


def whole(line: Clauses) -> Formula:
    """Return clauses as one formula."""
    if line.impossible:
        return Some(())
    return every((*(Atom(form, box) for form, box in line.boxes), *line.rest))
