"""Numbers of the text: within 64 bits, finite, and no two different ones for one double."""

import math
from fractions import Fraction

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.operators import Typed
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.model import U64_MAX, Int, Literal, Real, Scalar, Single
from rcsc.lang.operator_table import single, spell_single
from rcsc.lang.syntax import tree

LONGEST = 1_000


def number_of(text: str) -> int:
    """Return the whole number that a text spells; one of more than 80 digits by its first 80, which is past 64 bits all the same.

    >>> number_of("05"), number_of("0x1_0"), number_of("0b101")
    (5, 16, 5)
    """
    text = text.replace("_", "")
    base = {"0x": 16, "0b": 2}.get(text[:2].lower(), 10)
    digits = text if base == 10 else text[2:]
    return int(digits.lstrip("0")[:80] or "0", base)


def integer(scope: Scope, written: tree.IntLiteral) -> Typed | None:
    """Return the literal of a whole number; None (reported) where it does not fit in 64 bits."""
    value = number_of(written.text)
    if value > U64_MAX:
        message = "no 64-bit integer holds this number"
        scope.report(Code.TOO_WIDE, message, written.span, f"the greatest is {U64_MAX}")
        return None
    kind = Int(value, value, scope.unit(written.unit, value))
    return Typed(Literal(value, kind, written.span), written.unit is None)


def real(scope: Scope, written: tree.RealLiteral) -> Typed | None:
    """Return the double nearest to the number written.

    Source: IEEE 754-2019, 5.12 (correctly rounded conversion from decimal).
    """
    text = written.text.replace("_", "")
    value = float(text)
    if not math.isfinite(value):
        scope.report(Code.NOT_FINITE, f"`{written.text}` is larger than every double", written.span)
        return None
    if len(text) > LONGEST or len(text.lower().partition("e")[2]) > 5:
        message = f"a number is written with at most {LONGEST} characters, its exponent with at most 5"
        scope.report(Code.NOT_FINITE, message, written.span)
        return None
    _one_spelling(scope, value, text, written.span)
    return Typed(
        Literal(value, Real(value, value, scope.unit(written.unit)), written.span), written.unit is None
    )


def as_single(scope: Scope, want: Scalar | None, given: Typed | None, written: tree.Expr) -> Typed | None:
    """Return a constant double as the nearest single, where one is wanted; anything else as it is; None where too large (reported).

    Two different numbers of the text that are one single are reported, as those are that are one double.
    """
    if not isinstance(want, Single) or given is None or not isinstance(given.expr, Literal):
        return given
    kind = given.expr.type
    if not isinstance(kind, Real) or isinstance(kind, Single):
        return given
    double = float(given.expr.value)
    value = single(double) + 0.0
    if not math.isfinite(value):
        scope.report(Code.NOT_FINITE, f"`{double!r}` is larger than every single", written.span)
        return None
    while isinstance(written, tree.Unary):
        written = written.operand
    if isinstance(written, tree.RealLiteral):
        _one_single(scope, abs(value), written)
    return Typed(Literal(value, Single(value, value, kind.unit), given.expr.span), given.bare)


def _one_single(scope: Scope, value: float, written: tree.RealLiteral) -> None:
    """Report two different numbers of the text that are the same single."""
    text = written.text.replace("_", "")
    first = scope.singles.setdefault(value, (text, scope.at(written.span)))
    if Fraction(first[0]) != Fraction(text):
        message = (
            f"`{text}` and `{first[0]}` are different numbers but the same single, {spell_single(value)}"
        )
        label = Label(first[1], "the other")
        help_text = f"write {spell_single(value)} for both"
        scope.report(Code.SAME_DOUBLE, message, written.span, help_text, related=(label,))


def _one_spelling(scope: Scope, value: float, text: str, span: Span) -> None:
    """Report two different numbers of the text that are the same double."""
    first = scope.doubles.setdefault(value, (text, scope.at(span)))
    if first[0] != text and Fraction(first[0]) != Fraction(text):
        shown = [spelling if len(spelling) <= 40 else spelling[:37] + "..." for spelling in (text, first[0])]
        message = f"`{shown[0]}` and `{shown[1]}` are different numbers but the same double, {value!r}"
        label = Label(first[1], "the other")
        scope.report(Code.SAME_DOUBLE, message, span, f"write {value!r} for both", related=(label,))
