"""Interval arithmetic: bounds that enclose every value an operation can take.

Integers exactly; doubles by the monotonicity of IEEE operations rounded to nearest: the extreme results are
those of the extreme operands, computed in the same arithmetic. Singles alike, rounded once more.
"""

import math
from collections.abc import Iterable
from itertools import product
from typing import Literal, TypeAlias, TypeVar

from rcsc.lang.leaves import parts
from rcsc.lang.model import I64_MAX, I64_MIN, U64_MAX, Apply, Expr, Int, Real, Scalar, Select, Single, Unit
from rcsc.lang.operator_table import Arithmetic, Op, divide, is_division, single

WIDEST = 2**200
"""Integer bounds stop here: a result beyond 64 bits is refused by its own proof obligation."""

Number = TypeVar("Number", int, float)
AtEnds: TypeAlias = Literal[Op.NEG, Op.ABS, Op.ADD, Op.SUB, Op.MUL, Op.MIN, Op.MAX]
"""Operations whose extreme results are those of the ends of their operands."""


def apply(op: Arithmetic, kinds: tuple[Int | Real, ...], unit: Unit) -> Scalar:
    """Return the type of `op` over operands of these types."""
    if isinstance(kinds[0], Int):
        low, high = _integers(op, *((k.low, k.high) for k in kinds if isinstance(k, Int)))
        return Int(min(max(low, -WIDEST), WIDEST), min(max(high, -WIDEST), WIDEST), unit)
    bounds = _reals(op, *((k.low, k.high) for k in kinds if isinstance(k, Real)))
    least, greatest = bounds or (-math.inf, math.inf)
    if isinstance(kinds[0], Single):
        return Single(single(least), single(greatest), unit)
    return Real(least, greatest, unit)


def word(kinds: Iterable[Int]) -> tuple[int, int]:
    """Return the bounds of the 64-bit type in which an operation on these is done: unsigned where none can be negative."""
    return (0, U64_MAX) if min(kind.low for kind in kinds) >= 0 else (I64_MIN, I64_MAX)


def may_be_undefined(expr: Expr) -> bool:
    """Return whether the types in an expression leave room for an undefined value: an overflow, a zero divisor, a bad index."""
    return any(
        isinstance(part, Select) or (isinstance(part, Apply) and _may_fail(part)) for part in parts(expr)
    )


def _may_fail(applied: Apply) -> bool:
    numbers = [part.type for part in (*applied.args, applied) if isinstance(part.type, Int)]
    if numbers:
        least, greatest = min([kind.low for kind in numbers]), max([kind.high for kind in numbers])
        low, high = word(numbers)
        if least < low or greatest > high:
            return True
    if not is_division(applied.op):
        return False
    divisor = applied.args[1].type
    return not (isinstance(divisor, Int | Real) and divisor.low > 0 and math.isfinite(divisor.high))


def _integers(op: Arithmetic, a: tuple[int, int], b: tuple[int, int] = (0, 0)) -> tuple[int, int]:
    match op:
        case Op.DIV:
            divisors = [d for d in (*b, -1, 1) if d and b[0] <= d <= b[1]]
            corners = [divide(x, d) for x, d in product(a, divisors)] or [0]
            return min(corners), max(corners)
        case Op.MOD:
            most = max(abs(b[0]), abs(b[1]), 1) - 1
            return max(min(a[0], 0), -most), min(max(a[1], 0), most)
        case _:
            return _ends(op, a, b, 0)


def _reals(
    op: Arithmetic, a: tuple[float, float], b: tuple[float, float] = (0.0, 0.0)
) -> tuple[float, float] | None:
    """Return the bounds; None where an operand may be infinite, or a divisor zero."""
    assert op is not Op.MOD
    if not all(map(math.isfinite, (*a, *b))):
        return None
    if op is not Op.DIV:
        return _ends(op, a, b, 0.0)
    if b[0] <= 0.0 <= b[1]:
        return None
    corners = [x / y for x, y in product(a, b)]
    return min(corners) + 0.0, max(corners) + 0.0


def _ends(
    op: AtEnds, a: tuple[Number, Number], b: tuple[Number, Number], zero: Number
) -> tuple[Number, Number]:
    """Return the bounds of an operation that integers and reals share."""
    match op:
        case Op.NEG:
            return -a[1], -a[0]
        case Op.ABS:
            return max(zero, a[0], -a[1]), max(abs(a[0]), abs(a[1]))
        case Op.ADD:
            return a[0] + b[0], a[1] + b[1]
        case Op.SUB:
            return a[0] - b[1], a[1] - b[0]
        case Op.MUL:
            corners = [x * y for x, y in product(a, b)]
            return min(corners) + zero, max(corners) + zero
        case Op.MIN:
            return min(a[0], b[0]), min(a[1], b[1])
        case Op.MAX:
            return max(a[0], b[0]), max(a[1], b[1])
