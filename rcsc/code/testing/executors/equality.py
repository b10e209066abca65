"""Equality of values as the executors have it: the same number with the same sign; any NaN equals any NaN."""

from math import copysign, isnan

from rcsc.lang.model import Value


def same_value(value: Value, other: Value) -> bool:
    """Whether two values of one leaf are the same."""
    if isinstance(value, float) or isinstance(other, float):
        a, b = float(value), float(other)
        return (isnan(a) and isnan(b)) or (a == b and copysign(1.0, a) == copysign(1.0, b))
    return int(value) == int(other)
