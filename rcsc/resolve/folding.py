"""The value of an expression that reads nothing; also used to decide conditions on one leaf."""

import operator
from collections.abc import Callable, Mapping
from typing import Any

from rcsc.model import Among, Apply, Expr, Int, Literal, Op, Read, Value
from rcsc.resolve.intervals import truncated

_PLAIN: Mapping[Op, Callable[..., Any]] = {
    Op.NOT: operator.not_,
    Op.NEG: lambda a: 0.0 - a if isinstance(a, float) else -a,
    Op.EQ: operator.eq,
    Op.NE: operator.ne,
    Op.LT: operator.lt,
    Op.LE: operator.le,
    Op.GT: operator.gt,
    Op.GE: operator.ge,
    Op.ADD: operator.add,
    Op.SUB: operator.sub,
    Op.MUL: operator.mul,
    Op.ABS: abs,
    Op.MIN: min,
    Op.MAX: max,
    Op.TO_INT: int,
    Op.TO_REAL: float,
}


def fold(expr: Expr, values: Mapping[str, Value] | None = None) -> Value | None:
    """The value, reading leaves from `values`; None where something is missing or undefined."""
    try:
        return _fold(expr, values or {})
    except (KeyError, ZeroDivisionError, OverflowError, ValueError):
        return None


def _fold(expr: Expr, values: Mapping[str, Value]) -> Value:
    match expr:
        case Literal(value=value):
            return value
        case Read(name=name):
            return values[name]
        case Among(subject=subject, values=members):
            return _fold(subject, values) in members
        case Apply(op=op, args=args):
            return _apply(op, args, values)
        case _:
            raise KeyError(expr)


def _apply(op: Op, args: tuple[Expr, ...], values: Mapping[str, Value]) -> Value:
    first = _fold(args[0], values)
    if op in (Op.AND, Op.OR, Op.IMPLIES):
        decided = bool(first) is (op is Op.OR)
        return (op is not Op.AND) if decided else bool(_fold(args[1], values))
    rest = [_fold(arg, values) for arg in args[1:]]
    if op in (Op.DIV, Op.MOD):
        second = rest[0]
        if not isinstance(args[0].type, Int):
            return float(first) / float(second)
        quotient = truncated(int(first), int(second))
        return quotient if op is Op.DIV else int(first) - quotient * int(second)
    result: Value = _PLAIN[op](first, *rest)
    return result
