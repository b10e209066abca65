"""Results of extern procedures while a level is proved; the user's code is neither imported nor called.

In: a program, and a script or a random source. Out: contexts in which the interpreter takes results from it. A result is any value
of its type or, if it is refused, a value outside the type. A refused result ends the cycle at that call.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from random import Random
from typing import TypeAlias

from rcsc.lang.interpret import answering
from rcsc.lang.model import (
    Admit,
    Enum,
    Procedure,
    Program,
    Real,
    Scalar,
    Value,
    Variable,
    key_bounds,
    value_of_key,
)

ExternAnswer: TypeAlias = tuple[str, tuple[Value, ...]]
"""An extern procedure, and the results of one call of it, in the order in which it writes them."""
REFUSED_NOW_AND_THEN = 0.04


def refused(variable: Variable) -> Value:
    """Return a value that is refused: the one after the greatest, or NaN."""
    if isinstance(variable.type, Real):
        return math.nan
    return key_bounds(variable.type)[1] + 1


def least(kind: Scalar) -> Value:
    """Return the least value of a type."""
    return value_of_key(kind, key_bounds(kind)[0])


@contextmanager
def scripted(program: Program, answers: Sequence[ExternAnswer]) -> Iterator[None]:
    """Answer each call of an extern procedure with its next scripted answer, with least values when none is left."""
    left = list(answers)

    def answer(procedure: Procedure, _args: list[Value]) -> tuple[Value, ...]:
        at = next((at for at, (name, _) in enumerate(left) if name == procedure.name), None)
        if at is None:
            return tuple(least(program.variable(name).type) for name in procedure.writes)
        return left.pop(at)[1]

    with answering(answer):
        yield


@contextmanager
def at_random(program: Program, random: Random) -> Iterator[None]:
    """Answer each call of an extern procedure with random values of its types, and now and then a refused one."""

    def result(variable: Variable) -> Value:
        # a NaN is not clamped
        refusable = variable.admit is not Admit.CLAMP or isinstance(variable.type, Real)
        if refusable and random.random() < REFUSED_NOW_AND_THEN:
            return refused(variable)
        low, high = key_bounds(variable.type)
        if isinstance(variable.type, Enum) or high - low < 64:
            return value_of_key(variable.type, random.randint(low, high))
        return value_of_key(variable.type, random.choice((low, random.randint(low, high), high)))

    def answer(procedure: Procedure, _args: list[Value]) -> tuple[Value, ...]:
        return tuple(result(program.variable(name)) for name in procedure.writes)

    with answering(answer):
        yield
