"""Interval arithmetic: bounds that enclose every value an operation can take.

Integers exactly; doubles by the monotonicity of IEEE operations rounded to nearest: the extreme results are
those of the extreme operands, computed in the same arithmetic.
"""

import math
from itertools import product

from rcsc.lang.model import Int, Real, Scalar, Unit
from rcsc.lang.operator_table import Arithmetic, Op, divide

WIDEST = 2**200
"""Integer bounds stop here: a result beyond 64 bits is refused by its own proof obligation."""


def apply(op: Arithmetic, kinds: tuple[Int | Real, ...], unit: Unit) -> Scalar:
    """The type of `op` over operands of these types."""
    if isinstance(kinds[0], Int):
        low, high = _integers(op, [k for k in kinds if isinstance(k, Int)])
        return Int(min(max(low, -WIDEST), WIDEST), min(max(high, -WIDEST), WIDEST), unit)
    bounds = _reals(op, [k for k in kinds if isinstance(k, Real)])
    return Real(*bounds, unit) if bounds else Real(-math.inf, math.inf, unit)


def _integers(op: Arithmetic, kinds: list[Int]) -> tuple[int, int]:
    a = kinds[0]
    if op is Op.NEG:
        return -a.high, -a.low
    if op is Op.ABS:
        low = 0 if a.low <= 0 <= a.high else min(abs(a.low), abs(a.high))
        return low, max(abs(a.low), abs(a.high))
    b = kinds[1]
    match op:
        case Op.ADD:
            return a.low + b.low, a.high + b.high
        case Op.SUB:
            return a.low - b.high, a.high - b.low
        case Op.MUL:
            corners = [x * y for x, y in product((a.low, a.high), (b.low, b.high))]
            return min(corners), max(corners)
        case Op.DIV:
            divisors = [d for d in (b.low, b.high, -1, 1) if d and b.low <= d <= b.high]
            corners = [divide(x, d) for x, d in product((a.low, a.high), divisors)] or [0]
            return min(*corners, corners[0]), max(*corners, corners[0])
        case Op.MOD:
            most = max(abs(b.low), abs(b.high), 1) - 1
            return max(min(a.low, 0), -most), min(max(a.high, 0), most)
        case Op.MIN:
            return min(a.low, b.low), min(a.high, b.high)
        case _:
            return max(a.low, b.low), max(a.high, b.high)


def _reals(op: Arithmetic, kinds: list[Real]) -> tuple[float, float] | None:
    """The bounds; None where an operand may be infinite, or a divisor zero."""
    a = kinds[0]
    if not all(math.isfinite(bound) for k in kinds for bound in (k.low, k.high)):
        return None
    if op is Op.NEG:
        return -a.high, -a.low
    if op is Op.ABS:
        low = 0.0 if a.low <= 0.0 <= a.high else min(abs(a.low), abs(a.high))
        return low, max(abs(a.low), abs(a.high))
    b = kinds[1]
    match op:
        case Op.ADD:
            return a.low + b.low, a.high + b.high
        case Op.SUB:
            return a.low - b.high, a.high - b.low
        case Op.MUL:
            corners = [x * y for x, y in product((a.low, a.high), (b.low, b.high))]
        case Op.DIV:
            if b.low <= 0.0 <= b.high:
                return None
            corners = [x / y for x, y in product((a.low, a.high), (b.low, b.high))]
        case Op.MIN:
            return min(a.low, b.low), min(a.high, b.high)
        case _:
            return max(a.low, b.low), max(a.high, b.high)
    return min(corners) + 0.0, max(corners) + 0.0
