"""Bounds of terms that are not linear, inside a box of leaves: by intervals, so that they hold of every input in it.

In: a universe, bounds of its leaves. Out: bounds of its other columns too. They need not be the narrowest: `x * x - x` reads x twice.
"""

from collections.abc import Mapping
from dataclasses import replace

from rcsc.lang.expressions.intervals import apply
from rcsc.lang.model import Apply, Expr, Int, Literal, Read, Real, Scalar, key_bounds, value_of_key
from rcsc.lang.operator_table import is_arithmetic
from rcsc.proof.table.regions.atoms import Universe
from rcsc.proof.table.regions.region import Bounds


def enclosed(universe: Universe, box: Mapping[int, Bounds]) -> dict[int, Bounds]:
    """Return a box with bounds of every column that is not a leaf."""
    kinds = {
        universe.columns[column].name: _within(universe.columns[column].term.type, box[column])
        for column in box
    }
    more = {column: key_bounds(kind_of(universe.columns[column].term, kinds)) for column in universe.opaque}
    return {**box, **{column: bounds for column, bounds in more.items() if bounds[0] <= bounds[1]}}


def kind_of(term: Expr, kinds: Mapping[str, Scalar]) -> Scalar:
    """Return the type of a number, with bounds for leaves within theirs."""
    whole = term.type
    match term:
        case Read(name=name):
            return kinds.get(name, whole)
        case Literal(value=value) if isinstance(whole, Int):
            return replace(whole, low=int(value), high=int(value))
        case Literal(value=value) if isinstance(whole, Real):
            return replace(whole, low=float(value), high=float(value))
        case Apply(op=op, args=args) if is_arithmetic(op):
            of = tuple(
                kind for kind in (kind_of(each, kinds) for each in args) if isinstance(kind, Int | Real)
            )
            bounds = apply(op, of, ())
            if isinstance(whole, Int) and isinstance(bounds, Int):
                return replace(whole, low=max(whole.low, bounds.low), high=min(whole.high, bounds.high))
            if isinstance(whole, Real) and isinstance(bounds, Real):
                return replace(whole, low=max(whole.low, bounds.low), high=min(whole.high, bounds.high))
    return whole


def _within(kind: Scalar, bounds: Bounds) -> Scalar:
    low, high = (value_of_key(kind, key) for key in bounds)
    if isinstance(kind, Int):
        return replace(kind, low=int(low), high=int(high))
    return replace(kind, low=float(low), high=float(high)) if isinstance(kind, Real) else kind
