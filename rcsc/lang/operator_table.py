"""The operators of the language: one row each.

In: nothing. Out: `Op`, whose members say how an operator is written, how tightly it binds there, and what it means; groups of
operators that are treated alike, as types, so that mypy names the operator that a `match` over a group forgets; and
`truth_function`, by which stages that know conjunction, disjunction and negation know every operator on truth values.
"""

import math
import operator
import struct
from collections.abc import Callable
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal, Self, TypeAlias, TypeVar, get_args

if TYPE_CHECKING:
    from typing_extensions import TypeIs

IMPLICATION, DISJUNCTION, EXCLUSION, CONJUNCTION, NEGATION, RELATION, SUM, PRODUCT, SIGN, POSTFIX = range(
    1, 11
)
"""How tightly operators bind, loosest first."""


def divide(a: int, b: int) -> int:
    """Return the quotient rounded toward zero, as in C."""
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def part_way(low: float, high: float, part: float) -> float:
    """Return the double at this part of the way between two, never outside: their difference may be beyond all doubles."""
    span = high - low
    value = low + span * part if math.isfinite(span) else low * (1.0 - part) + high * part
    return min(max(value, low), high)


_SINGLE = struct.Struct("<f")


def single(number: float) -> float:
    """Return the nearest IEEE binary32, ties to even, as a float; an infinity beyond all of them.

    Of the binary64 sum, difference, product or quotient of two binary32, it is the exact result's binary32, subnormal or not.

    >>> single(0.1), single(2**24 + 1), single(1e39)
    (0.10000000149011612, 16777216.0, inf)

    Source: Figueroa, When is double rounding innocuous? SIGNUM Newsletter 30(3), 1995; Roux, Innocuous double rounding of basic
    arithmetic operations, Journal of Formalized Reasoning 7(1), 2014, for subnormal results.
    """
    if isinstance(number, int) and abs(number) >> 53:
        # rounded to odd, so that the second rounding is the only one
        dropped = abs(number).bit_length() - 53
        odd = abs(number) >> dropped | bool(abs(number) & (1 << dropped) - 1)
        number = (odd if number > 0 else -odd) << dropped
    try:
        nearest: float = _SINGLE.unpack(_SINGLE.pack(float(number)))[0]
    except OverflowError:
        return math.inf if number > 0 else -math.inf
    return nearest


def spell_single(value: float) -> str:
    """Return the shortest decimal that is read back as this single, whether it is rounded once or by way of a double.

    >>> spell_single(0.10000000149011612), spell_single(16777216.0)
    ('0.1', '16777216.0')
    """
    for digits in range(1, 10):
        text = repr(float(f"{value:.{digits}g}"))
        if single(float(text)) == value and not _halfway(float(text)):
            return text
    return repr(value)  # an infinity, a NaN


def _halfway(value: float) -> bool:
    """Return whether a double lies halfway between two singles, so that its own error may decide."""
    return (
        math.isfinite(value) and struct.unpack("<Q", struct.pack("<d", value))[0] & 0x1FFF_FFFF == 0x1000_0000
    )


class Op(StrEnum):
    """Operators; the value is the spelling in the source, except of the negative.

    The meanings are those of every stage: folding, bounds and interpreter compute with them, and executors, solvers and reference are
    held against them. Reals are IEEE 754 binary64, rounded to nearest even; `interpret.operated` rounds each result of singles once
    more, to binary32. Comparisons with a NaN are false, but `/=`, which is true. `min` and `max` keep their first operand where it
    is a NaN, and drop a second one. `abs` and `-` act on the sign, of zeros too. `int` is undefined of a NaN or an infinity, and 0
    or 1 of a truth value; `/` and `mod` are undefined of a divisor that is zero.

    Attributes:
        strength: How tightly it binds.
        meaning: Its value, of operands of one kind.
        result: How its result is called, for arithmetic.
    """

    strength: int
    meaning: Callable[..., Any]
    result: str

    def __new__(
        cls, word: str, strength: int = POSTFIX, meaning: Callable[..., Any] = abs, result: str = ""
    ) -> Self:
        """Make a member from its row."""
        member = str.__new__(cls, word)
        member._value_, member.strength, member.meaning, member.result = word, strength, meaning, result
        return member

    @property
    def infix(self) -> bool:
        """Whether it is written between two operands."""
        return self.strength not in (NEGATION, SIGN, POSTFIX)

    IMPLIES = "implies", IMPLICATION, lambda a, b: not a or b
    OR = "or", DISJUNCTION, lambda a, b: a or b
    XOR = "xor", EXCLUSION, operator.ne
    AND = "and", CONJUNCTION, lambda a, b: a and b
    NOT = "not", NEGATION, operator.not_
    EQ = "=", RELATION, operator.eq
    NE = "/=", RELATION, operator.ne
    LT = "<", RELATION, operator.lt
    LE = "<=", RELATION, operator.le
    GT = ">", RELATION, operator.gt
    GE = ">=", RELATION, operator.ge
    ADD = "+", SUM, operator.add, "sum"
    SUB = "-", SUM, operator.sub, "difference"
    MUL = "*", PRODUCT, operator.mul, "product"
    DIV = "/", PRODUCT, lambda a, b: a / b if isinstance(a, float) else divide(a, b), "quotient"
    MOD = "mod", PRODUCT, lambda a, b: a - b * divide(a, b), "remainder"
    NEG = "-x", SIGN, operator.neg, "negative"
    ABS = "abs", POSTFIX, abs, "absolute value"
    MIN = "min", POSTFIX, lambda a, b: b if b < a else a, "least"  # noqa: FURB136 - says which where a NaN is one
    MAX = "max", POSTFIX, lambda a, b: b if b > a else a, "greatest"  # noqa: FURB136 - as above
    TO_INT = "int", POSTFIX, int
    TO_REAL = "real", POSTFIX, float
    TO_SINGLE = "single", POSTFIX, single


BITWISE = {"&": PRODUCT, "<<": PRODUCT, ">>": PRODUCT, "|": SUM}
"""Operators on the bits of a word, and how tightly they bind, as in Go; they are resolved to arithmetic."""

Logic: TypeAlias = Literal[Op.AND, Op.OR, Op.XOR, Op.IMPLIES]
"""Truth functions of two operands. The right one is looked at only where the left one does not decide."""
Comparison: TypeAlias = Literal[Op.EQ, Op.NE, Op.LT, Op.LE, Op.GT, Op.GE]
Ordering: TypeAlias = Literal[Op.EQ, Op.LT, Op.LE]
"""Comparisons that express the others, for a NaN too."""
Arithmetic: TypeAlias = Literal[Op.NEG, Op.ABS, Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.MOD, Op.MIN, Op.MAX]
"""From numbers of one kind to a number of it."""
Conversion: TypeAlias = Literal[Op.TO_INT, Op.TO_REAL, Op.TO_SINGLE]
Division: TypeAlias = Literal[Op.DIV, Op.MOD]
"""Undefined of a divisor that is zero."""
Strict: TypeAlias = Literal[Op.NOT] | Comparison | Arithmetic | Conversion
"""Operators that always evaluate all operands."""
Operator: TypeAlias = Logic | Strict
"""Every operator: `Op` member by member, so that mypy knows what is left where a group has been dealt with."""

Core: TypeAlias = Literal[Op.NOT, Op.AND] | Ordering | Arithmetic | Conversion
"""Operators left once the others are expressed by these."""

LOGIC: frozenset[Logic] = frozenset(get_args(Logic))
COMPARISONS: frozenset[Comparison] = frozenset(get_args(Comparison))
DIVISIONS: frozenset[Division] = frozenset(get_args(Division))
CALCULATIONS: frozenset[Arithmetic | Conversion] = frozenset((*get_args(Arithmetic), *get_args(Conversion)))
SCALING = frozenset({Op.MUL, Op.DIV})
"""Their units multiply; the operands and the result of other arithmetic share one unit."""
WHOLE = frozenset({Op.MOD})
"""Arithmetic of integers alone."""
ROUNDED = frozenset({Op.ADD, Op.SUB, Op.MUL, Op.DIV})
"""Arithmetic whose result, of reals, is rounded."""
EXTREMES = frozenset({Op.MIN, Op.MAX})
"""Functions that give one of their two operands; the others called have one operand."""
DIVIDED_FIRST = frozenset({Op.MOD})
"""Operators whose quotient the machine computes first: it must stay in its 64 bits too."""
MIRRORED: dict[Op, Comparison] = {
    Op.LT: Op.GT, Op.GT: Op.LT, Op.LE: Op.GE, Op.GE: Op.LE, Op.EQ: Op.EQ, Op.NE: Op.NE,
}  # fmt: skip
"""The comparison that is the same with its sides exchanged."""
OPPOSITE: dict[Op, Comparison] = {
    Op.LT: Op.GE, Op.GE: Op.LT, Op.LE: Op.GT, Op.GT: Op.LE, Op.EQ: Op.NE, Op.NE: Op.EQ,
}  # fmt: skip
"""The comparison that holds where another does not; of values that are ordered, which a NaN is not."""


def is_logic(op: Operator) -> "TypeIs[Logic]":
    """Return whether it is a truth function of two operands."""
    return op in LOGIC


def is_comparison(op: Operator) -> "TypeIs[Comparison]":
    """Return whether it compares."""
    return op in COMPARISONS


def is_division(op: Operator) -> "TypeIs[Division]":
    """Return whether it is undefined of a divisor that is zero."""
    return op in DIVISIONS


def is_conversion(op: Operator) -> "TypeIs[Conversion]":
    """Return whether it takes a number to a number of another kind."""
    return op in get_args(Conversion)


def is_arithmetic(op: Operator) -> "TypeIs[Arithmetic]":
    """Return whether it takes numbers and gives one of their kind."""
    return op in get_args(Arithmetic)


PAIRS = ((True, True), (True, False), (False, True), (False, False))
T = TypeVar("T")
Signed: TypeAlias = Callable[[bool], T]
"""A condition, or (given false) its negation."""


def signed(value: T, negated: Callable[[T], T]) -> Signed[T]:
    """Return a condition, with how it is negated."""
    return lambda wanted: value if wanted else negated(value)


def truth_function(
    op: Op,
    left: Signed[T],
    right: Signed[T],
    every: Callable[[tuple[T, T]], T],
    some: Callable[[tuple[T, T]], T],
) -> Signed[T]:
    """Express an operator on two truth values in negation normal form.

    True for one pair of operands alone, it is the conjunction that holds there; false for one alone, the disjunction that fails there:
    `a implies b`, false for (true, false), is `not a or b`. Else it is two conjunctions: `a = b` is `a and b or not a and not b`.
    """

    def signed(wanted: bool) -> T:
        rows = [row for row in PAIRS if bool(op.meaning(*row)) is wanted]
        if len(rows) == 3:
            [(a, b)] = set(PAIRS) - set(rows)
            return some((left(not a), right(not b)))
        parts = [every((left(a), right(b))) for a, b in rows]
        return parts[0] if len(parts) == 1 else some((parts[0], parts[1]))

    return signed


UNDECIDED = {
    op: frozenset(a for a in (False, True) if op.meaning(a, False) != op.meaning(a, True)) for op in LOGIC
}
"""The values of the left operand for which the right one is looked at."""
