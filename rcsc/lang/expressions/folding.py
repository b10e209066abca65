"""The value of an expression that reads nothing; also used to decide conditions on one leaf."""

from collections.abc import Mapping

from rcsc.lang.interpret import evaluate
from rcsc.lang.model import Expr, Value


def fold(expr: Expr, values: Mapping[str, Value] | None = None) -> Value | None:
    """Return the interpreter's value, reading leaves from `values`; None where one is missing or the value is undefined."""
    try:
        return evaluate(expr, values or {})
    except (LookupError, ArithmeticError, ValueError):
        return None
