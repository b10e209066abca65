"""Least points, and boxes that hold throughout, by exact linear arithmetic.

In: clauses over a `Universe` whose columns are leaves. Out: the least point in the order of the
columns given, and the widest box around it on which a condition holds. Clauses that speak of terms
that are not linear are for a solver (`smt`).

Source: house style, example 6 (pin each variable, in declared order, to the least value that fits).
"""

from collections.abc import Callable, Mapping, Sequence

from rcsc.model import Box
from rcsc.prove.atoms import Atom, Clauses, Every, Formula, Some, Universe, clauses, every, some
from rcsc.prove.regions import Answer, Bounds, Point
from rcsc.prove.search import Tree


def find(universe: Universe, parts: Sequence[Formula], budget: int = 2_000) -> Point | Answer:
    """A point at which all parts hold; `NONE` when there is none, `UNKNOWN` past the budget."""
    tree = Tree(
        universe,
        (),
        (clauses(parts),),
        lambda _: Answer.UNKNOWN,
        default=False,
        budget=budget,
        first_only=True,
    )
    found = tree.run()
    if found.gaps:
        return found.gaps[0][1]
    return Answer.UNKNOWN if found.undecided else Answer.NONE


def least(universe: Universe, parts: Sequence[Formula], columns: Sequence[int]) -> Point | Answer:
    """The least point at which all parts hold: first in the first of `columns`, and so on."""
    best = find(universe, parts)
    pinned = list(parts)
    for column in columns:
        if isinstance(best, Answer):
            return best
        form = universe.single[column]
        low, high = universe.low[form], best[column]
        while low < high:
            middle = low if high == best[column] and low == universe.low[form] else (low + high) // 2
            trial = find(universe, [*pinned, universe.atom(form, ((low, middle),))])
            if trial is Answer.UNKNOWN:
                return trial
            if isinstance(trial, Answer):
                low = middle + 1
            else:
                best, high = trial, trial[column]
        pinned.append(universe.atom(form, ((low, low),)))
    return best


def widest(
    universe: Universe,
    point: Mapping[int, int],
    columns: Sequence[int],
    holds: Callable[[list[Formula]], bool],
) -> dict[int, Bounds]:
    """The box around `point` that is grown in the order of `columns` as far as `holds` is true of it.

    Args:
        universe: Where the columns are from.
        point: Where to begin.
        columns: What to grow, in this order; others stay free.
        holds: Whether what is looked for is true throughout a box (given as atoms).
    """
    box = {column: (point[column], point[column]) for column in columns}

    def fits(column: int, low: int, high: int) -> bool:
        trial = {**box, column: (low, high)}
        return holds([universe.atom(universe.single[c], (bounds,)) for c, bounds in trial.items()])

    for column in columns:
        form = universe.single[column]
        least_, greatest = universe.low[form], universe.high[form]
        at = point[column]
        if fits(column, least_, greatest):
            box[column] = (least_, greatest)
            continue
        top = _furthest(at, greatest, lambda end, c=column, a=at: fits(c, a, end))  # type: ignore[misc]  # bound early
        bottom = -_furthest(-at, -least_, lambda end, c=column, t=top: fits(c, -end, t))  # type: ignore[misc]  # as above
        box[column] = (bottom, top)
    return box


def _furthest(start: int, end: int, fits: Callable[[int], bool]) -> int:
    """The greatest value from `start` on to which it fits (it does at `start`)."""
    if fits(end):
        return end
    low, high = start, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if fits(middle):
            low = middle
        else:
            high = middle - 1
    return low


def negated(universe: Universe, formula: Formula) -> Formula:
    """The opposite of a formula."""
    match formula:
        case Atom(form=form, box=box):
            return universe.atom(form, complement(box, universe.low[form], universe.high[form]))
        case Every(parts):
            return some(negated(universe, part) for part in parts)
        case Some(parts):
            return every(negated(universe, part) for part in parts)


def complement(box: Box, low: int, high: int) -> Box:
    """What of `low .. high` is not in the box."""
    edges = [low - 1, *(end for interval in box for end in interval), high + 1]
    return tuple((a + 1, b - 1) for a, b in zip(edges[::2], edges[1::2], strict=True) if a + 1 <= b - 1)


def whole(line: Clauses) -> Formula:
    """Clauses as one formula."""
    if line.impossible:
        return Some(())
    return every((*(Atom(form, box) for form, box in line.boxes), *line.rest))
