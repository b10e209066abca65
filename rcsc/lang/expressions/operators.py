"""What operators make of typed operands: kinds and units checked, bounds computed, constants folded."""

import math
from dataclasses import dataclass, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions import intervals
from rcsc.lang.expressions.scope import Scope, normal, spell_unit
from rcsc.lang.expressions.units import apart
from rcsc.lang.interpret import fold
from rcsc.lang.model import (
    I64_MAX,
    I64_MIN,
    U64_MAX,
    Apply,
    Bool,
    Enum,
    Expr,
    Int,
    Literal,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Single,
    Unit,
    spell,
)
from rcsc.lang.operator_table import Arithmetic, Comparison, Conversion, Op, single


@dataclass(frozen=True, slots=True)
class Typed:
    """An expression, and whether it is made of numbers written without a unit."""

    expr: Expr
    bare: bool = False

    def unit(self) -> Unit:
        """Return its unit; () for a bare number, a bool or an enumeration."""
        kind = self.expr.type
        return kind.unit if isinstance(kind, Int | Real) else ()

    def literal(self) -> Literal:
        """Return the literal of a folded constant."""
        assert isinstance(self.expr, Literal)
        return self.expr


def kind_word(kind: Scalar) -> str:
    """Return the word for the kind, for messages."""
    match kind:
        case Bool():
            return "bool"
        case Enum(name=name):
            return f"`{name}`"
        case Int():
            return "int"
        case Single():
            return "single"
        case Real():
            return "real"


def width(kind: Scalar) -> str:
    """Return the word for numbers of a kind with a decimal point, for messages."""
    return "single" if isinstance(kind, Single) else "double"


def same_kind(left: Scalar, right: Scalar) -> bool:
    """Return whether values of the two can be compared or assigned, units aside."""
    if isinstance(left, Enum) or isinstance(right, Enum):
        return left == right
    return type(left) is type(right)


def applied(
    scope: Scope, op: Arithmetic, operands: tuple[Typed, ...], unit: Unit, span: Span
) -> Typed | None:
    """Return the operation with its bounds; folded where all operands are constants."""
    kinds = tuple(o.expr.type for o in operands if isinstance(o.expr.type, Int | Real))
    args = tuple(o.expr for o in operands)
    bare = all(o.bare for o in operands)
    operation = Apply(op, args, intervals.apply(op, kinds, unit), span)
    value = fold(operation) if all(isinstance(arg, Literal) for arg in args) else None
    if value is None:
        return Typed(operation, bare)
    if isinstance(operation.type, Real) and not math.isfinite(value):
        scope.report(Code.NOT_FINITE, f"this constant is larger than every {width(operation.type)}", span)
        return None
    if isinstance(operation.type, Int) and not I64_MIN <= value <= U64_MAX:
        scope.report(Code.TOO_WIDE, "no 64-bit integer holds this constant", span)
        return None
    if isinstance(operation.type, Real):
        point: Scalar = replace(operation.type, low=value + 0.0, high=value + 0.0)
    else:
        point = Int(int(value), int(value), unit)
    return Typed(Literal(value + 0.0 if isinstance(value, float) else value, point, span), bare)


def scaled(scope: Scope, op: Arithmetic, left: Typed, right: Typed, span: Span) -> Typed | None:
    """Type a product or quotient; its unit is the product or quotient of the units."""
    if not one_kind(scope, left, right, span):
        return None
    powers = dict(left.unit())
    for name, power in right.unit():
        powers[name] = powers.get(name, 0) + (power if op is Op.MUL else -power)
    return applied(scope, op, (left, right), normal(powers), span)


def alike(scope: Scope, op: Arithmetic, operands: tuple[Typed, ...], span: Span) -> Typed | None:
    """Type a sum, difference, remainder, least or greatest; the units must agree."""
    unit = common_unit(scope, operands, span)
    if unit is None or not one_kind(scope, operands[0], operands[-1], span):
        return None
    return applied(scope, op, operands, unit, span)


def side(operand: Typed) -> str:
    """Return an operand with its kind, for messages: by its name where it has one."""
    match operand.expr:
        case Read(name=name) | ReadLocal(name=name):
            shown = f"`{name}`"
        case Literal(value=value, type=kind):
            shown = f"`{spell(kind, value)}`"
        case _:
            return f"an expression, which is {kind_word(operand.expr.type)}"
    return f"{shown}, which is {kind_word(operand.expr.type)}"


_CONVERSIONS = {
    frozenset({"int", "real"}): ("convert with `real(n)` or `int(x)`",),
    frozenset({"int", "single"}): ("convert with `single(n)` or `int(x)`",),
    frozenset({"real", "single"}): ("convert with `real(x)`, which is exact, or `single(x)`, which rounds",),
}


def conversion(one: Scalar, two: Scalar) -> tuple[str, ...]:
    """Return the help texts for a place where numbers of two kinds meet."""
    return _CONVERSIONS.get(frozenset({kind_word(one), kind_word(two)}), ())


def one_kind(scope: Scope, left: Typed, right: Typed, span: Span) -> bool:
    """Return whether both sides are of one kind and fit one 64-bit integer type; report it where not."""
    if not same_kind(left.expr.type, right.expr.type):
        message = f"the left side is {side(left)}; the right side is {side(right)}"
        scope.report(Code.KIND, message, span, *conversion(left.expr.type, right.expr.type))
        return False
    kinds = [k for k in (left.expr.type, right.expr.type) if isinstance(k, Int)]
    unsigned = any(k.low >= 0 and k.high > I64_MAX for k in kinds)
    if unsigned and min(k.low for k in kinds) < 0:
        scope.report(
            Code.MIXED_SIGN, "no 64-bit integer type holds both sides", span, "narrow one of the ranges"
        )
        return False
    return True


def common_unit(scope: Scope, operands: tuple[Typed, ...], span: Span) -> Unit | None:
    """Return the unit of all operands that have one; None (reported) where they differ."""
    units = [operand.unit() for operand in operands if not operand.bare]
    if not units:
        return ()
    for unit in units:
        if unit != units[0]:
            if not scope.unsure(units[0], unit):
                helps = apart(units[0], unit)
                message = f"the units differ: {spell_unit(units[0])} and {spell_unit(unit)}"
                scope.report(Code.UNIT, message, span, *([helps] if helps else []))
            return None
    return units[0]


def compared(scope: Scope, op: Comparison, pair: tuple[Typed, Typed], span: Span) -> Typed | None:
    """Type a comparison of the two; None after an error."""
    left, right = pair
    if not one_kind(scope, left, right, span) or common_unit(scope, pair, span) is None:
        return None
    if op not in (Op.EQ, Op.NE) and not isinstance(left.expr.type, Int | Real):
        scope.report(Code.KIND, f"{kind_word(left.expr.type)} has no order", span, "use `=`, `/=` or a set")
        return None
    return Typed(Apply(op, (left.expr, right.expr), Bool(), span))


def _nearest(bound: float) -> float:
    """Return the double nearest to a bound; an infinity beyond all doubles, where a bound may lie."""
    try:
        return float(bound)
    except OverflowError:
        return math.inf if bound > 0 else -math.inf


_CONVERTED: dict[Conversion, str] = {
    Op.TO_INT: "a real number, a single or a bool",
    Op.TO_REAL: "a whole number or a single",
    Op.TO_SINGLE: "a whole number or a real number",
}


def converted(scope: Scope, op: Conversion, operand: Typed, span: Span) -> Typed | None:
    """Type `int(x)` toward zero, `real(n)` to the nearest double, or `single(n)` to the nearest single; the unit stays."""
    kind = operand.expr.type
    if not isinstance(kind, Int | Real) or kind_word(kind) == op.value:
        scope.report(Code.KIND, f"`{op.value}` converts {_CONVERTED[op]}", span)
        return None
    converted: Scalar
    if op is Op.TO_REAL:
        converted = Real(_nearest(kind.low), _nearest(kind.high), kind.unit)
    elif op is Op.TO_SINGLE:
        converted = Single(single(kind.low), single(kind.high), kind.unit)
    else:
        assert isinstance(kind, Real)
        wide = not (math.isfinite(kind.low) and math.isfinite(kind.high))
        converted = Int(*((-(2**1024), 2**1024) if wide else (int(kind.low), int(kind.high))), kind.unit)
    conversion = Apply(op, (operand.expr,), converted, span)
    value = fold(conversion) if isinstance(operand.expr, Literal) else None
    if value is not None and op is Op.TO_INT and not I64_MIN <= value <= U64_MAX:
        scope.report(Code.TOO_WIDE, "no 64-bit integer holds this constant", span)
        return None
    if value is not None and op is Op.TO_SINGLE and not math.isfinite(value):
        scope.report(Code.NOT_FINITE, "this constant is larger than every single", span)
        return None
    return Typed(conversion if value is None else Literal(value, converted, span), operand.bare)


def counted(condition: Expr, span: Span) -> Typed:
    """Type `int(b)` of a truth value: 1 where it holds, else 0; like a written number it takes the unit of the other side."""
    conversion = Apply(Op.TO_INT, (condition,), Int(0, 1), span)
    value = fold(conversion)
    return Typed(
        conversion if value is None else Literal(value, Int(int(value), int(value)), span), bare=True
    )
