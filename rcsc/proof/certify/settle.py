"""Whether an obligation holds: by spans, by trying every case, or by a solver that is asked in SMT-LIB.

In: hypotheses and an obligation. Out: shown, false with a case that shows it, or open. What is settled here without a
solver needs none of the prover's arithmetic: spans (`known`), and all values of the few variables it speaks of, where these are few.
Cases are tried with numpy: whole numbers of 64 bits where every span fits, else Python's.
"""

import operator
import random
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from math import isfinite, prod
from typing import Any, TypeAlias

import numpy as np

from rcsc.proof.certify.known import KnownSpans
from rcsc.proof.certify.values import (
    BOOL,
    INT,
    REAL,
    REALS,
    SINGLE,
    Number,
    Term,
    Terms,
    nearest_single,
    parts_first,
)

MOST_WORK = 4_000_000
"""Cases times terms that are tried for one obligation."""
SAMPLES = 200
"""Cases picked from the ends of variables and the constants they meet, where there are too many to try all."""
CASES_A_SPAN = 40
"""Values of terms that are computed with numpy for the work of one span."""
_FIT = 2**62


class CaseAnswer(Enum):
    """A solver's answer to the question: is there a case in which the obligation fails?"""

    NONE = auto()
    SOME = auto()
    UNKNOWN = auto()


Ask: TypeAlias = Callable[[str], CaseAnswer]
"""Puts a question in SMT-LIB to a solver that has no part in the proof."""
Cases: TypeAlias = Mapping[Term, Any]
"""For each variable an array of its values, one a case."""


@dataclass(frozen=True, slots=True)
class Shown:
    """The obligation holds."""


@dataclass(frozen=True, slots=True)
class Fails:
    """The obligation fails in a case: values by variable."""

    case: tuple[tuple[str, Number], ...]


@dataclass(frozen=True, slots=True)
class Left:
    """The obligation is open; this question would settle it."""

    question: str


Outcome: TypeAlias = Shown | Fails | Left


class Settler:
    """Settles obligations of one program.

    Attributes:
        first: A value for each variable, of the first cycle.
        work: Done so far, in spans of terms.
    """

    def __init__(self, terms: Terms, ask: Ask | None, first: Mapping[str, Number]) -> None:
        self.terms, self.ask, self.first, self.work = terms, ask, first, 0

    def settle(self, hypotheses: Sequence[Term], path: Term, good: Term, known: KnownSpans) -> Outcome:
        """Settle whether `good` holds wherever the path is taken; `known` are the spans on the path."""
        before = known.work
        by_spans = known.impossible or known.span(good) == (1, 1)
        self.work += known.work - before
        if by_spans:
            return Shown()
        bad = self.terms.every((path, self.terms.negation(good)))
        if bad is self.terms.false:
            return Shown()
        tried = self._every_case(hypotheses, bad, known) or self._some_cases(hypotheses, bad)
        if tried is not None:
            return tried
        question = script([*hypotheses, bad])
        answer = CaseAnswer.UNKNOWN if self.ask is None else self.ask(question)
        if answer is CaseAnswer.NONE:
            return Shown()
        return Fails(()) if answer is CaseAnswer.SOME else Left(question)

    def _every_case(self, hypotheses: Sequence[Term], bad: Term, known: KnownSpans) -> Outcome | None:
        """Try all values of the obligation's variables, and of those that hypotheses tie to them; None where these are too many.

        Hypotheses about other variables are tried afterwards, part by part: a failing case counts only where they can hold.
        """
        rest, case = list(hypotheses), dict[str, Number]()
        wanted = bad
        while True:
            together = _tied(wanted, rest, known)
            if together is None:
                return None
            rows = self._where(
                self.terms.every((wanted, *together)), cases := _crossed(variables(wanted, *together), known)
            )
            if rows is None:
                return None
            if not len(rows):
                return Shown()  # the obligation cannot fail, or the hypotheses cannot hold
            case |= dict(_row(cases, int(rows[0])))
            rest = [term for term in rest if term not in together]
            if not rest:
                return Fails(tuple(sorted(case.items())))
            if any(name in case for term in rest for name in (leaf.name for leaf in variables(term))):
                return None  # a hypothesis that ties too much together was left out
            wanted = rest[0]

    def _some_cases(self, hypotheses: Sequence[Term], bad: Term) -> Outcome | None:
        """Try some cases; return one in which the obligation fails, None where none of these does."""
        wrong = self.terms.every((*hypotheses, bad))
        wanted = variables(wrong)
        picked = random.Random(len(wanted))  # noqa: S311 - the same cases in every run
        edges = _edges(wrong)
        columns = {}
        for term in wanted:
            ends = [
                term.low,
                term.high,
                *(edge for edge in edges[term.sort] if term.low <= edge <= term.high),
            ]
            start = self.first.get(term.name, term.low)
            columns[term] = _array(
                term.sort, [start, term.low, term.high, *picked.choices(ends, k=SAMPLES)], wide=True
            )
        failing = self._where(wrong, columns)
        return (
            Fails(tuple(sorted(_row(columns, int(failing[0])))))
            if failing is not None and len(failing)
            else None
        )

    def _where(self, condition: Term, cases: Cases) -> Any:
        """Return the numbers of the cases in which the condition is true; None where numpy's doubles cannot say."""
        count = max((len(column) for column in cases.values()), default=1)
        self.work += (1 + count // CASES_A_SPAN) * len(parts_first(condition))
        try:
            return np.flatnonzero(values_in(condition, cases, count))
        except OverflowError:
            return None


# --- cases -----------------------------------------------------------------------------


def _tied(wanted: Term, hypotheses: Sequence[Term], known: KnownSpans) -> list[Term] | None:
    """Return the hypotheses tied to the term while all cases are few enough to try; None where the term alone has too many."""
    used: list[Term] = []
    leaves = set(variables(wanted))
    if not _few(leaves, known, len(parts_first(wanted))):
        return None
    growing = True
    while growing:
        growing = False
        for hypothesis in hypotheses:
            spoken = set(variables(hypothesis))
            if hypothesis in used or (spoken and spoken.isdisjoint(leaves)):
                continue
            if _few(leaves | spoken, known, len(parts_first(wanted, *used, hypothesis))):
                leaves |= spoken
                used.append(hypothesis)
                growing = True
    return used


def variables(*terms: Term) -> list[Term]:
    """Return the variables in the terms."""
    return [term for term in parts_first(*terms) if term.op == "variable"]


def _extent(term: Term, known: KnownSpans) -> tuple[Number, Number]:
    return known.span(term) or (term.low, term.high)


def _few(wanted: Iterable[Term], known: KnownSpans, size: int) -> bool:
    """Return whether all cases of the variables can be tried."""
    total = size
    for term in wanted:
        low, high = _extent(term, known)
        if term.sort in REALS and low != high:
            return False
        total *= 1 if term.sort in REALS else max(0, int(high) - int(low) + 1)
        if total > MOST_WORK:
            return False
    return True


def _crossed(wanted: Sequence[Term], known: KnownSpans) -> dict[Term, Any]:
    """Return every combination of the variables' values, as one array a variable."""
    axes = []
    for term in wanted:
        low, high = _extent(term, known)
        values = [low] if term.sort in REALS else range(int(low), int(high) + 1)
        axes.append(_array(term.sort, values))
    total = prod(len(axis) for axis in axes)
    if not total:  # a variable that cannot have a value
        return {term: axis[:0] for term, axis in zip(wanted, axes, strict=True)}
    crossed, before = {}, 1
    for term, axis in zip(wanted, axes, strict=True):
        crossed[term] = np.tile(np.repeat(axis, total // (before * len(axis))), before)
        before *= len(axis)
    return crossed


_FLOATS: Mapping[str, Any] = {REAL: np.float64, SINGLE: np.float32}


def _array(sort: str, values: Iterable[Number], *, wide: bool = False) -> Any:
    listed = list(values)
    if sort == BOOL:
        return np.array(listed, dtype=bool)
    if sort in REALS:
        return np.array(listed, dtype=_FLOATS[sort])
    narrow = not wide and all(abs(value) < _FIT for value in listed)
    return np.array(listed, dtype=np.int64 if narrow else object)


def _row(cases: Cases, at: int) -> Iterator[tuple[str, Number]]:
    """Return one case: values by the names of variables."""
    return ((term.name, column[at : at + 1].tolist()[0]) for term, column in cases.items())


def _edges(term: Term) -> Mapping[str, list[Number]]:
    """Return constants in the term and their neighbours, by sort."""
    edges: dict[str, list[Number]] = {
        BOOL: [0, 1],
        INT: [0, 1, -1],
        REAL: [0.0, 1.0, -1.0],
        SINGLE: [0.0, 1.0, -1.0],
    }
    for part in parts_first(term):
        if part.op == "constant" and part.sort != BOOL:
            edges[part.sort] += [part.low, part.low - 1, part.low + 1]
    return {sort: sorted(set(values)) for sort, values in edges.items()}


def values_in(wanted: Term, cases: Cases, count: int) -> Any:
    """Return the term's value in each case, as an array.

    Raises:
        OverflowError: A whole number is too large to become a double.
    """
    # whole numbers stay in 64 bits where the spans of all of them do
    known = KnownSpans((), ())
    parts = parts_first(wanted)
    spans = [known.span(part) for part in parts if part.sort == INT]
    wide = any(span is None or not all(isfinite(end) and abs(end) < _FIT for end in span) for span in spans)
    columns: dict[Term, Any] = {}
    for part in parts:
        if part.op == "constant":
            column = np.repeat(_array(part.sort, [part.low], wide=wide), count)
        elif part.op == "variable":
            column = cases[part].astype(object) if wide and part.sort == INT else cases[part]
            column = column.astype(np.int64) if not wide and part.sort == INT else column
        else:
            with np.errstate(all="ignore"):  # infinities and NaN are values
                column = _computed(part, [columns[arg] for arg in part.args], wide)
        columns[part] = column
    return columns[wanted].astype(bool) if wanted.sort == BOOL else columns[wanted]


def _computed(term: Term, args: Sequence[Any], wide: bool) -> Any:
    first, last = args[0], args[-1]
    match term.op:
        case "kept":
            return first
        case "not":
            return ~first.astype(bool)
        case "and" | "or":
            join = np.logical_and if term.op == "and" else np.logical_or
            return join.reduce([arg.astype(bool) for arg in args])
        case "ite":
            return np.where(first.astype(bool), args[1], args[2])
        case "=" | "<" | "<=":
            compare = {"=": operator.eq, "<": operator.lt, "<=": operator.le}[term.op]
            return compare(first, last).astype(bool)
        case "real" | "single" if first.dtype.kind == "f":
            return first.astype(_FLOATS[term.sort])
        case "real":
            return np.array([float(value) for value in first.tolist()], dtype=np.float64)
        case "single":
            return np.array([nearest_single(int(value)) for value in first.tolist()], dtype=np.float32)
        case "int":
            whole = [int(value) if isfinite(value) else 0 for value in first.tolist()]
            return np.array(whole, dtype=object if wide else np.int64)
        case "/" | "mod" if term.sort == INT:
            return _divided(term.op, first, last)
        case _:
            return _NUMBERS[term.op](*args)


_NUMBERS: Mapping[str, Callable[..., Any]] = {
    "neg": operator.neg, "abs": abs, "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
}  # fmt: skip


def _divided(op: str, dividend: Any, divisor: Any) -> Any:
    """Return the quotient toward zero, or the remainder; 0 where the divisor is 0."""
    nonzero = np.where(divisor == 0, 1, divisor)
    quotient = abs(dividend) // abs(nonzero)
    quotient = np.where((dividend < 0) == (nonzero < 0), quotient, -quotient)
    return np.where(divisor == 0, 0, quotient if op == "/" else dividend - nonzero * quotient)


# --- SMT-LIB ---------------------------------------------------------------------------

_PRELUDE = """(set-logic ALL)
(define-fun over ((a Int) (b Int)) Int (ite (= b 0) 0 (ite (= (< a 0) (< b 0)) (div (abs a) (abs b)) (- (div (abs a) (abs b))))))
(define-fun rest ((a Int) (b Int)) Int (ite (= b 0) 0 (- a (* b (over a b)))))
"""
_DOUBLES = {
    "=": "fp.eq", "<": "fp.lt", "<=": "fp.leq", "+": "fp.add RNE", "-": "fp.sub RNE", "*": "fp.mul RNE",
    "/": "fp.div RNE", "neg": "fp.neg", "abs": "fp.abs", "ite": "ite",
}  # fmt: skip
_WHOLE = {"/": "over", "mod": "rest", "neg": "-"}
_SORTS = {BOOL: "Bool", INT: "Int", REAL: "Float64", SINGLE: "Float32"}


def script(conditions: Collection[Term]) -> str:
    """Spell the conditions over the ranges of their variables in SMT-LIB; `unsat` says that no case satisfies them all."""
    lines, names = [_PRELUDE], dict[Term, str]()
    for number, term in enumerate(parts_first(*conditions)):
        sort = _SORTS[term.sort]
        if term.op == "constant":
            names[term] = _constant(term.sort, term.low)
        elif term.op == "variable":
            names[term] = f"v{number}"
            lines.append(f"(declare-const v{number} {sort}) ; {term.name}\n{_ranged(f'v{number}', term)}")
        elif term.op == "kept":
            names[term] = names[term.args[0]]
        else:
            names[term] = f"t{number}"
            lines.append(
                f"(define-fun t{number} () {sort} {_spelled(term, [names[part] for part in term.args])})\n"
            )
    lines += [f"(assert {names[term]})\n" for term in conditions]
    return "".join([*lines, "(check-sat)\n"])


def _constant(sort: str, value: Number) -> str:
    if sort == BOOL:
        return "true" if value else "false"
    if sort == SINGLE:
        bits = f"{struct.unpack('<I', struct.pack('<f', value))[0]:032b}"
        return f"(fp #b{bits[0]} #b{bits[1:9]} #b{bits[9:]})"
    if sort == REAL:
        bits = f"{struct.unpack('<Q', struct.pack('<d', value))[0]:064b}"
        return f"(fp #b{bits[0]} #b{bits[1:12]} #b{bits[12:]})"
    return str(value) if value >= 0 else f"(- {-value})"


def _ranged(name: str, term: Term) -> str:
    if term.sort == BOOL:
        return ""
    low, high = _constant(term.sort, term.low), _constant(term.sort, term.high)
    if term.sort == INT:
        return f"(assert (<= {low} {name} {high}))\n"
    plus = f"(not (and (fp.isNegative {name}) (fp.isZero {name})))"
    return f"(assert (and (fp.leq {low} {name}) (fp.leq {name} {high}) {plus}))\n"


def _spelled(term: Term, args: Sequence[str]) -> str:
    shown = " ".join(args)
    if term.op in ("real", "single"):
        given = shown if term.args[0].sort in REALS else f"(to_real {shown})"
        return f"((_ to_fp {'11 53' if term.op == 'real' else '8 24'}) RNE {given})"
    if term.op == "int":
        nothing = f"(or (fp.isNaN {shown}) (fp.isInfinite {shown}))"
        return f"(ite {nothing} 0 (to_int (fp.to_real (fp.roundToIntegral RTZ {shown}))))"
    of = _DOUBLES if term.args[0].sort in REALS else _WHOLE
    return f"({of.get(term.op, term.op)} {shown})"
