"""Values of a symbolic run as terms, and the spans that they stay in.

Terms are built as the program computes; only constants are folded, since loops are unrolled. Every operation is
total here: `a / 0` and `a mod 0` are 0, and the whole number of a NaN or an infinity is 0. That a program meets none of these
is an obligation of its own (`execution`), and no other obligation then depends on what stands there.

A *span* is the least and the greatest value of a term; it is None where the term may be a NaN. Infinite ends
are no NaN. Doubles and singles round to nearest even, which is monotone: the ends of a result are results of ends.
"""

import math
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from rcsc.lang.model import Bool, Real, Scalar, Single, Value, key_bounds

Number: TypeAlias = int | float
Span: TypeAlias = tuple[Number, Number] | None

BOOL, INT, REAL, SINGLE = "Bool", "Int", "Real", "Single"
REALS = REAL, SINGLE
FREE: tuple[Number, Number] = (-math.inf, math.inf)
TRUTHS: tuple[Number, Number] = (0, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """One value; terms built alike are one object.

    Attributes:
        op: `constant`, `variable`, `not`, `and`, `or`, `ite`, `=`, `<`, `<=`, `+`, `-`, `*`, `/`, `mod`, `neg`, `abs`, `int`,
            `real`, `single`, or `kept`: its only part, which obligation number `debt` owes to lie in `low .. high`.
        sort: `Bool`, `Int` (enumeration members too), `Real` or `Single`.
        low, high: Of a constant its value twice, of a variable the ends of its type.
        name: Of a variable.
    """

    op: str
    args: "tuple[Term, ...]"
    sort: str
    low: Number = 0
    high: Number = 0
    name: str = ""
    debt: int = -1


def sort_of(kind: Scalar) -> str:
    """Return the sort of the type's values."""
    if isinstance(kind, Real):
        return SINGLE if isinstance(kind, Single) else REAL
    return BOOL if isinstance(kind, Bool) else INT


def ends_of(kind: Scalar) -> tuple[Number, Number]:
    """Return the least and the greatest value of the type, truths and members as integers."""
    return (kind.low, kind.high) if isinstance(kind, Real) else key_bounds(kind)


def nearest_single(value: Number) -> float:
    """Return the nearest binary32, ties to even: of a double by the machine's rounding, of a whole number by its 24 leading digits."""
    if isinstance(value, float):
        with np.errstate(over="ignore"):  # an infinity
            return float(np.float32(value))
    size = max(abs(value).bit_length() - 24, 0)
    digits, rest = divmod(abs(value), 1 << size)
    digits += 2 * rest + digits % 2 > 1 << size  # past the middle, or there and odd
    magnitude = float(digits << size) if size < 105 and digits << size < 2**128 else math.inf
    return magnitude if value >= 0 else -magnitude


class Terms:
    """Builds terms."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], Term] = {}
        self.true, self.false = self.constant(BOOL, 1), self.constant(BOOL, 0)

    def _interned(self, term: Term) -> Term:
        ends = (repr(term.low), repr(term.high))
        key = (term.op, term.sort, *ends, term.name, term.debt, *map(id, term.args))
        return self._known.setdefault(key, term)

    def constant(self, sort: str, value: Value) -> Term:
        """Return a constant of the sort."""
        point = float(value) if sort in REALS else int(value)
        return self._interned(Term("constant", (), sort, point, point))

    def variable(self, name: str, kind: Scalar) -> Term:
        """Return a variable: any value of the type."""
        return self._interned(Term("variable", (), sort_of(kind), *ends_of(kind), name))

    def kept(self, inner: Term, low: Number, high: Number, debt: int) -> Term:
        """Return the value where obligation `debt` holds: then it lies in `low .. high`."""
        return self._interned(Term("kept", (inner,), inner.sort, low, high, debt=debt))

    def make(self, op: str, *args: Term) -> Term:
        """Return an operation on numbers, or a comparison; one on constants is computed."""
        sort = (
            BOOL
            if op in ("=", "<", "<=")
            else {"int": INT, "real": REAL, "single": SINGLE}.get(op, args[0].sort)
        )
        term = Term(op, args, sort)
        if all(arg.op == "constant" for arg in args):
            span = spanned(term, [spanned(arg, ()) for arg in args])
            if span is not None and span[0] == span[1] and math.isfinite(span[0]):
                return self.constant(sort, span[0])
        return self._interned(term)

    def negation(self, term: Term) -> Term:
        """Return the negation of a term."""
        if term.op == "constant":
            return self.false if term.low else self.true
        return term.args[0] if term.op == "not" else self._interned(Term("not", (term,), BOOL))

    def every(self, parts: Iterable[Term]) -> Term:
        """Return the term that all parts hold."""
        return self._joined("and", parts, self.true, self.false)

    def some(self, parts: Iterable[Term]) -> Term:
        """Return the term that some part holds."""
        return self._joined("or", parts, self.false, self.true)

    def _joined(self, op: str, parts: Iterable[Term], neutral: Term, final: Term) -> Term:
        flat: dict[Term, None] = {}
        for part in parts:
            flat.update(dict.fromkeys(part.args if part.op == op else (part,)))
        if final in flat:
            return final
        kept = tuple(part for part in flat if part is not neutral)
        return kept[0] if len(kept) == 1 else self._interned(Term(op, kept, BOOL)) if kept else neutral

    def follows(self, premise: Term, conclusion: Term) -> Term:
        """Return the term that the premise implies the conclusion."""
        return self.some((self.negation(premise), conclusion))

    def choice(self, condition: Term, then: Term, orelse: Term) -> Term:
        """Return `then` where the condition holds, else `orelse`."""
        if condition.op == "constant":
            return then if condition.low else orelse
        return then if then is orelse else self._interned(Term("ite", (condition, then, orelse), then.sort))


# --- spans -----------------------------------------------------------------------------


def spanned(term: Term, spans: Sequence[Span]) -> Span:
    """Return the span of a term, computed from those of its parts."""
    if term.op in ("constant", "variable"):
        return None if isinstance(term.low, float) and math.isnan(term.low) else (term.low, term.high)
    if term.op in ("not", "and", "or"):
        return _logic(term.op, [TRUTHS if span is None else span for span in spans])
    if term.op == "ite":
        return _chosen(term, spans)
    if any(span is None for span in spans):
        return TRUTHS if term.sort == BOOL else FREE if term.sort == INT else None
    known = [span for span in spans if span is not None]
    if term.op in ("=", "<", "<="):
        return _compared(term.op, term.args, *known)
    if term.op == "single" and term.args[0].sort == INT:
        return nearest_single(known[0][0]), nearest_single(known[0][1])
    span = (_of_doubles if term.args[0].sort in REALS else _of_integers)(term.op, known)
    return (
        (nearest_single(span[0]), nearest_single(span[1]))
        if span is not None and term.sort == SINGLE
        else span
    )


def _logic(op: str, spans: Sequence[tuple[Number, Number]]) -> Span:
    if op == "not":
        return 1 - spans[0][1], 1 - spans[0][0]
    join = min if op == "and" else max
    return join(low for low, _ in spans), join(high for _, high in spans)


def _chosen(term: Term, spans: Sequence[Span]) -> Span:
    """Return the span of both sides, each as the condition narrows it; None only where one may be a NaN."""
    condition = spans[0] or TRUTHS
    if condition[0] == condition[1]:
        return spans[1] if condition[0] else spans[2]
    then, orelse = spans[1], spans[2]
    if then is None or orelse is None:
        return None
    then = _beside(term.args[0], term.args[1], then, term.args, spans, True)
    orelse = _beside(term.args[0], term.args[2], orelse, term.args, spans, False)
    return min(then[0], orelse[0]), max(then[1], orelse[1])


def _beside(
    condition: Term,
    side: Term,
    span: tuple[Number, Number],
    args: Sequence[Term],
    spans: Sequence[Span],
    yes: bool,
) -> tuple[Number, Number]:
    """Narrow the span of a side that the condition compares with the other side, or with a constant."""
    if condition.op not in ("<", "<=") or side not in condition.args:
        return span
    at = condition.args.index(side)
    other = condition.args[1 - at]
    if other.op == "constant":
        limit: Span = (other.low, other.high)
    else:
        limit = spans[1] if other is args[1] else spans[2] if other is args[2] else None
    if limit is None:
        return span
    below = (at == 0) == yes
    met = (span[0], min(span[1], limit[1])) if below else (max(span[0], limit[0]), span[1])
    return met if met[0] <= met[1] else span


def _compared(
    op: str, args: Sequence[Term], left: tuple[Number, Number], right: tuple[Number, Number]
) -> Span:
    same = args[0] is args[1]
    if op == "=":
        always, never = (
            same or left[0] == left[1] == right[0] == right[1],
            left[1] < right[0] or right[1] < left[0],
        )
    elif op == "<":
        always, never = left[1] < right[0], same or left[0] >= right[1]
    else:
        always, never = same or left[1] <= right[0], left[0] > right[1]
    return (1, 1) if always else (0, 0) if never else TRUTHS


def truncated(a: int, b: int) -> int:
    """Return the quotient rounded toward zero; 0 where the divisor is 0."""
    quotient = abs(a) // abs(b) if b else 0
    return quotient if (a < 0) == (b < 0) else -quotient


def _of_integers(op: str, spans: Sequence[tuple[Number, Number]]) -> Span:
    if any(not math.isfinite(end) for span in spans for end in span):
        return FREE if op != "real" else None
    (a, b), *rest = [(int(low), int(high)) for low, high in spans]
    if op == "real":
        return (float(a), float(b)) if max(abs(a), abs(b)) < 2**1000 else None
    if op == "neg":
        return -b, -a
    c, d = rest[0]
    if op == "+":
        return a + c, b + d
    if op == "-":
        return a - d, b - c
    if op == "*":
        results = [a * c, a * d, b * c, b * d]
    elif op == "/":
        results = [truncated(x, y) for x in (a, b) for y in (c, d, -1, 1, 0) if c <= y <= d] or [0]
    elif a == b and c == d:
        results = [a - c * truncated(a, c) if c else 0]
    else:
        most = max(abs(c), abs(d), 1) - 1
        results = [max(min(a, 0), -most), min(max(b, 0), most)]
    return min(results), max(results)


def _of_doubles(op: str, spans: Sequence[tuple[Number, Number]]) -> Span:
    (a, b), *rest = [(float(low), float(high)) for low, high in spans]
    if op in ("real", "single"):
        return a, b
    if op == "int":
        return (int(a), int(b)) if math.isfinite(a) and math.isfinite(b) else FREE
    if op == "neg":
        return -b, -a
    if op == "abs":
        return (0.0 if a <= 0.0 <= b else min(abs(a), abs(b))), max(abs(a), abs(b))
    c, d = rest[0]
    if not all(map(math.isfinite, (a, b, c, d))) or (op == "/" and c <= 0.0 <= d):
        return None  # an infinity less itself, or times zero, is a NaN
    if op in ("+", "-"):
        return (a + c, b + d) if op == "+" else (a - d, b - c)
    results = [x * y if op == "*" else x / y for x in (a, b) for y in (c, d)]
    return min(results), max(results)


# --- walks -----------------------------------------------------------------------------


def parts_first(*terms: Term, but: Container[Term] = ()) -> list[Term]:
    """Return every term once, parts before wholes, without `but` and the terms only below these. It does not recurse, as runs are long."""
    ordered: list[Term] = []
    seen: set[Term] = set()
    stack = [(term, False) for term in reversed(terms)]
    while stack:
        term, ready = stack.pop()
        if ready:
            ordered.append(term)
        elif term not in seen and term not in but:
            seen.add(term)
            stack.append((term, True))
            stack += [(part, False) for part in reversed(term.args)]
    return ordered
