"""A region as conditions of the model, and conditions joined.

In: bounds on forms. Out: expressions whose conjunction holds in the region. The checker of certificates states the same by itself
(`certify.table`).

A bound that no condition can say (a distance between two doubles, in ranks) is left out: what is asked then covers more than the
region, so that a refutation still stands.
"""

from collections.abc import Iterable
from functools import reduce

from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Enum,
    Expr,
    Int,
    Literal,
    Op,
    Real,
    key_bounds,
    value_of_key,
)

_TRUE = Literal(True, Bool())


def located(bounds: Iterable[tuple[list[tuple[Expr, int]], int, int]]) -> list[Expr]:
    """Return conditions that hold in a region, as far as conditions express it."""
    return [condition for terms, low, high in bounds for condition in _within(terms, low, high)]


def conjunction(conditions: Iterable[Expr]) -> Expr:
    """Return the conjunction of the conditions; true for none."""
    kept = [condition for condition in conditions if condition != _TRUE]
    return reduce(lambda a, b: Apply(Op.AND, (a, b), Bool()), kept) if kept else _TRUE


def disjunction(conditions: Iterable[Expr]) -> Expr:
    """Return the disjunction of the conditions; false for none."""
    kept = list(conditions)
    return reduce(lambda a, b: Apply(Op.OR, (a, b), Bool()), kept) if kept else Literal(False, Bool())


def negation(condition: Expr) -> Expr:
    """Return the negated condition."""
    return Apply(Op.NOT, (condition,), Bool())


def _within(terms: list[tuple[Expr, int]], low: int, high: int) -> list[Expr]:
    """Return `low <= sum <= high` in keys, as far as conditions express it."""
    first = terms[0][0]
    if len(terms) == 1:
        return _bounded(first, low, high)
    if all(isinstance(term.type, Int) for term, _ in terms):
        total = reduce(lambda a, b: _arithmetic(Op.ADD, a, b), (_times(term, k) for term, k in terms))
        return [_compare(Op.GE, total, _integer(low)), _compare(Op.LE, total, _integer(high))]
    if [k for _, k in terms] != [1, -1]:
        return []
    second = terms[1][0]
    if isinstance(first.type, Real):
        comparisons = {Op.LT: high == -1, Op.LE: high == 0, Op.GE: low == 0, Op.GT: low == 1}
    else:
        comparisons = {Op.EQ: low == high == 0, Op.NE: high < 0 or low > 0}
    return [_compare(op, first, second) for op, whether in comparisons.items() if whether]


def _bounded(term: Expr, low: int, high: int) -> list[Expr]:
    match term.type:
        case Bool():
            return [negation(term)] if high == 0 else [term] if low == 1 else []
        case Enum():
            return [Among(term, tuple(range(low, high + 1)))]
        case Int():
            return [_compare(Op.GE, term, _integer(low)), _compare(Op.LE, term, _integer(high))]
        case Real():
            ends = (Op.GE, max(low, key_bounds(term.type)[0])), (Op.LE, min(high, key_bounds(term.type)[1]))
            return [_compare(op, term, Literal(value_of_key(term.type, end), term.type)) for op, end in ends]


def _compare(op: Op, left: Expr, right: Expr) -> Expr:
    return Apply(op, (left, right), Bool())


def _integer(value: int) -> Expr:
    return Literal(value, Int(value, value))


def _times(term: Expr, factor: int) -> Expr:
    return term if factor == 1 else _arithmetic(Op.MUL, _integer(factor), term)


def _arithmetic(op: Op, left: Expr, right: Expr) -> Expr:
    """Return a sum or product; its bounds are those of interval arithmetic."""
    (a, b), (c, d) = key_bounds(left.type), key_bounds(right.type)
    ends = (a * c, a * d, b * c, b * d) if op is Op.MUL else (a + c, b + d)
    return Apply(op, (left, right), Int(min(ends), max(ends)))
