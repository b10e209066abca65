"""Type expressions to types, and constants to values."""

import math
from dataclasses import replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.literals import as_single
from rcsc.lang.expressions.operators import Typed, conversion, kind_word, same_kind
from rcsc.lang.expressions.scope import MOST_LEAVES, Body, Scope
from rcsc.lang.expressions.typed import typed, without_before
from rcsc.lang.interpret import fold
from rcsc.lang.model import (
    I64_MAX,
    I64_MIN,
    U64_MAX,
    Array,
    Bool,
    Enum,
    Int,
    Literal,
    Real,
    Record,
    Scalar,
    Single,
    Type,
    Unit,
    Value,
)
from rcsc.lang.syntax import tree

MOST_ELEMENTS = 4096


def type_of(scope: Scope, written: tree.TypeExpr, body: Body | None = None) -> Type:
    """Return the type written; after an error some type, so that resolving goes on. `body` is as in `constant`."""
    match written:
        case tree.BoolType():
            return Bool()
        case tree.NamedType(name):
            if not scope.demand("type", name):
                return Bool()
            if name.text not in scope.types:
                scope.unknown("type", name, [*scope.types, "bool"])
                return Bool()
            return scope.types[name.text]
        case tree.ArrayType(length, element, span):
            return _small(scope, Array(_length(scope, length), type_of(scope, element, body)), span)
        case tree.IntType():
            return _int(scope, written, body)
        case tree.RealType():
            return _real(scope, written, Real(0.0, 0.0), body)
        case tree.SingleType():
            return _real(scope, written, Single(0.0, 0.0), body)


def size(kind: Type) -> int:
    """Return the number of scalars in a value of the type."""
    match kind:
        case Array(length, element):
            return length * size(element)
        case Record(fields=fields):
            return sum(size(part.type) for part in fields)
        case _:
            return 1


def _small(scope: Scope, kind: Array, span: Span) -> Type:
    if size(kind) <= MOST_LEAVES:
        return kind
    scope.report(Code.TOO_MANY_LEAVES, f"a type has at most {MOST_LEAVES} scalar parts", span)
    return Bool()


def scalar_of(scope: Scope, written: tree.TypeExpr, body: Body) -> Scalar:
    """Return the type of a local or parameter, which is a scalar."""
    kind = type_of(scope, written, body)
    if isinstance(kind, Bool | Enum | Int | Real):
        return kind
    scope.report(Code.KIND, "a local or parameter is a bool, an enumeration or a number", written.span)
    return Bool()


def constant(
    scope: Scope, written: tree.Expr, want: Scalar | None = None, body: Body | None = None
) -> Typed | None:
    """Return the folded value of a constant expression; None (reported) where it is not one.

    Args:
        scope: Everything declared.
        written: The expression.
        want: The type that it should have, where one is known.
        body: Parameters and locals where it stands, which hide constants of their names.
    """
    with without_before(scope, "a constant has no cycle before: `was` is about a variable"):
        value = typed(scope, body or Body(), written, want)
    if value is None:
        return None
    folded = fold(value.expr)
    if folded is None:
        scope.report(Code.NOT_CONSTANT, "this must be a constant", written.span)
        return None
    return Typed(Literal(folded, point(value.expr.type, folded), written.span), value.bare)


def point(kind: Scalar, value: Value) -> Scalar:
    """Return the type that has this value alone; a bool or an enumeration stays as it is."""
    if isinstance(kind, Int):
        return Int(int(value), int(value), kind.unit)
    return replace(kind, low=float(value), high=float(value)) if isinstance(kind, Real) else kind


def _length(scope: Scope, written: tree.Expr) -> int:
    value = constant(scope, written)
    if value is None:
        return 1
    length = value.literal().value
    if not isinstance(value.expr.type, Int) or not 1 <= length <= MOST_ELEMENTS:
        scope.report(Code.BAD_LENGTH, f"an array has 1 to {MOST_ELEMENTS} elements", written.span)
        return 1
    return int(length)


def _bounds(
    scope: Scope, written: tree.IntType | tree.RealType | tree.SingleType, body: Body | None
) -> tuple[Typed, Typed, Unit] | None:
    low, high = (constant(scope, end, body=body) for end in (written.low, written.high))
    if low is None or high is None:
        return None
    unit = scope.unit(written.unit)
    for bound, place in ((low, written.low), (high, written.high)):
        other = bound.unit()
        if other and unit and other != unit and not scope.unsure(other, unit):
            scope.report(Code.UNIT, "the bounds of a range have one unit", place.span)
        unit = unit or other
    return low, high, unit


def _int(scope: Scope, written: tree.IntType, body: Body | None) -> Int:
    bounds = _bounds(scope, written, body)
    if bounds is None:
        return Int(0, 0)
    low, high, unit = bounds
    if not (isinstance(low.expr.type, Int) and isinstance(high.expr.type, Int)):
        scope.report(Code.KIND, "the bounds of an `int` are whole numbers", written.span)
        return Int(0, 0)
    least, most = int(low.literal().value), int(high.literal().value)
    if least > most:
        scope.report(
            Code.EMPTY_RANGE,
            f"the range {least} .. {most} is empty",
            written.span,
            "write the smaller bound first",
        )
        return Int(most, most, unit)
    if least < I64_MIN or most > U64_MAX or (least < 0 and most > I64_MAX):
        scope.report(Code.TOO_WIDE, f"no 64-bit integer holds {least} .. {most}", written.span)
        return Int(0, 0, unit)
    return Int(least, most, unit)


def _real(scope: Scope, written: tree.RealType | tree.SingleType, kind: Real, body: Body | None) -> Real:
    """Resolve a type of numbers with a decimal point; `kind` is one of that sort."""
    bounds = _bounds(scope, written, body)
    if bounds is None:
        return kind
    low, high, unit = bounds
    least, most = (
        _end(scope, kind, bound, place) for bound, place in ((low, written.low), (high, written.high))
    )
    if least > most:
        scope.report(
            Code.EMPTY_RANGE,
            f"the range {least!r} .. {most!r} is empty",
            written.span,
            "write the smaller bound first",
        )
        return replace(kind, low=most, high=most, unit=unit)
    return replace(kind, low=least, high=most, unit=unit)


def _end(scope: Scope, kind: Real, bound: Typed, written: tree.Expr) -> float:
    fitting = as_single(scope, kind, bound, written)
    if fitting is None:
        return 0.0
    value = fitting.literal().value
    if not same_kind(fitting.expr.type, kind):
        message = f"the bounds of a `{kind_word(kind)}` have a decimal point"
        helps = (
            (f"write `{value}.0`",)
            if isinstance(bound.expr.type, Int)
            else conversion(fitting.expr.type, kind)
        )
        scope.report(Code.KIND, message, written.span, *helps)
        return 0.0
    return float(value) + 0.0 if math.isfinite(value) else 0.0
