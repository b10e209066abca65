"""What the checker of certificates computes, exactly: questions, columns, spans, facts, what is owed, and the work that it took."""

import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import combinations_with_replacement, product
from typing import Any

import numpy as np
import pytest

from rcsc.lang.interpret import evaluate
from rcsc.lang.model import Apply, Bool, Box, Int, Program, Real, Single, Snapshot, key_of, real_key
from rcsc.proof.certify import certify
from rcsc.proof.certify import table as checked_table
from rcsc.proof.certify.execution import Run, Start
from rcsc.proof.certify.known import KnownSpans
from rcsc.proof.certify.owed import Debts
from rcsc.proof.certify.settle import CaseAnswer, Fails, Left, Settler, Shown, _edges, script, values_in
from rcsc.proof.certify.shape import WITNESS
from rcsc.proof.certify.table import All, AnyOf, Formula, RejectedError, TableChecker
from rcsc.proof.certify.values import (
    BOOL,
    FREE,
    INT,
    REAL,
    SINGLE,
    TRUTHS,
    Term,
    Terms,
    parts_first,
    spanned,
    truncated,
)
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests.diagnostics.test_told import FAULTY
from tests.support.programs.stages import program_of

TERMS = Terms()
MAKE = TERMS.make
TRUTH = TERMS.variable("b", Bool())
NUMBER, OTHER = TERMS.variable("n", Int(-3, 9)), TERMS.variable("m", Int(0, 5))
DOUBLE = TERMS.variable("x", Real(-1.5, 2.0))


def whole(value: int) -> Term:
    return TERMS.constant(INT, value)


def double(value: float) -> Term:
    return TERMS.constant(REAL, value)


# --- questions ----------------------------------------------------------------------------

ASKED = [
    MAKE("<", MAKE("/", NUMBER, OTHER), MAKE("mod", MAKE("neg", NUMBER), whole(-2))),
    TERMS.some((TRUTH, TERMS.negation(MAKE("=", MAKE("real", NUMBER), MAKE("*", DOUBLE, double(-0.5)))))),
    MAKE(
        "<=",
        MAKE("int", MAKE("abs", TERMS.kept(MAKE("+", DOUBLE, double(1.0)), 0.0, 1.0, 3))),
        TERMS.choice(TRUTH, whole(0), OTHER),
    ),
    TERMS.true,
]
QUESTION = """\
(declare-const v0 Int) ; n
(assert (<= (- 3) v0 9))
(declare-const v1 Int) ; m
(assert (<= 0 v1 5))
(define-fun t2 () Int (over v0 v1))
(define-fun t3 () Int (- v0))
(define-fun t5 () Int (rest t3 (- 2)))
(define-fun t6 () Bool (< t2 t5))
(declare-const v7 Bool) ; b
(define-fun t8 () Float64 ((_ to_fp 11 53) RNE (to_real v0)))
(declare-const v9 Float64) ; x
{ranged}
(define-fun t11 () Float64 (fp.mul RNE v9 (fp #b1 #b01111111110 #b0000000000000000000000000000000000000000000000000000)))
(define-fun t12 () Bool (fp.eq t8 t11))
(define-fun t13 () Bool (not t12))
(define-fun t14 () Bool (or v7 t13))
(define-fun t16 () Float64 (fp.add RNE v9 (fp #b0 #b01111111111 #b0000000000000000000000000000000000000000000000000000)))
(define-fun t18 () Float64 (fp.abs t16))
(define-fun t19 () Int (ite (or (fp.isNaN t18) (fp.isInfinite t18)) 0 (to_int (fp.to_real (fp.roundToIntegral RTZ t18)))))
(define-fun t21 () Int (ite v7 0 v1))
(define-fun t22 () Bool (<= t19 t21))
(assert t6)
(assert t14)
(assert t22)
(assert true)
(check-sat)
"""


RANGED = (
    "(assert (and (fp.leq (fp #b1 #b01111111111 #b1000000000000000000000000000000000000000000000000000) v9) "
    "(fp.leq v9 (fp #b0 #b10000000000 #b0000000000000000000000000000000000000000000000000000)) "
    "(not (and (fp.isNegative v9) (fp.isZero v9)))))"
)
"""That the double lies in its range, and is no zero with a sign."""


def test_a_question_is_written_as_smt_lib_has_it() -> None:
    prelude, asked = script(ASKED).split("(declare-const v0", maxsplit=1)
    assert f"(declare-const v0{asked}" == QUESTION.format(ranged=RANGED)
    assert prelude.splitlines()[0] == "(set-logic ALL)"


def test_singles_are_written_by_their_bits() -> None:
    asked = script([MAKE("<", TERMS.variable("s", Single(-1.5, 2.0)), TERMS.constant(SINGLE, -0.5))])
    assert "(define-fun t2 () Bool (fp.lt v0 (fp #b1 #b01111110 #b00000000000000000000000)))" in asked
    assert "(fp.leq (fp #b1 #b01111111 #b10000000000000000000000) v0)" in asked


# --- columns ------------------------------------------------------------------------------

COLUMNS = {
    TRUTH: np.array([0, 1]),
    NUMBER: np.array([4, -3]),
    OTHER: np.array([1, 2]),
    DOUBLE: np.array([0.5, 1.0]),
}


@pytest.mark.parametrize(
    ("term", "values", "kind"),
    [
        (TRUTH, [False, True], np.bool_),
        (NUMBER, [4, -3], np.int64),
        (DOUBLE, [0.5, 1.0], np.float64),
        (ASKED[0], [False, True], np.bool_),
        (MAKE("+", NUMBER, OTHER), [5, -1], np.int64),
        (MAKE("*", DOUBLE, DOUBLE), [0.25, 1.0], np.float64),
        (MAKE("/", DOUBLE, MAKE("-", DOUBLE, DOUBLE)), [np.inf, np.inf], np.float64),
        (MAKE("/", NUMBER, OTHER), [4, -1], np.int64),
        (MAKE("mod", NUMBER, OTHER), [0, -1], np.int64),
        (MAKE("int", DOUBLE), [0, 1], np.int64),
        (MAKE("int", MAKE("/", DOUBLE, MAKE("-", DOUBLE, DOUBLE))), [0, 0], np.object_),
        (MAKE("real", NUMBER), [4.0, -3.0], np.float64),
        (whole(3), [3, 3], np.int64),
        (TERMS.choice(TRUTH, NUMBER, OTHER), [1, -3], np.int64),
    ],
)
def test_columns_are_of_machine_words_where_all_values_fit(
    term: Term, values: Sequence[float], kind: type
) -> None:
    found = values_in(term, COLUMNS, 2)
    assert found.dtype == kind
    assert found.tolist() == list(values)


def test_columns_are_of_python_s_numbers_where_one_value_does_not_fit() -> None:
    wide = TERMS.variable("w", Int(0, 2**63))
    cases = {wide: np.array([2**63, 1], dtype=object), NUMBER: np.array([1, 2])}
    found = values_in(MAKE("+", wide, NUMBER), cases, 2)
    assert (found.dtype, found.tolist()) == (object, [2**63 + 1, 3])


def test_a_constant_past_the_machine_word_is_one_of_python_s_numbers() -> None:
    wide = TERMS.variable("w", Int(0, 2**63))
    found = values_in(MAKE("-", wide, whole(2**63)), {wide: np.array([1], dtype=object)}, 1)
    assert found.tolist() == [1 - 2**63]
    either = TERMS.choice(TRUTH, whole(2**63 + 1), whole(-1))
    assert values_in(either, COLUMNS, 2).tolist() == [-1, 2**63 + 1]
    large = TERMS.choice(TRUTH, whole(2**61), whole(3))
    assert values_in(MAKE("*", large, large), COLUMNS, 2).tolist() == [9, 2**122]
    far = TERMS.variable("far", Real(0.0, 4.0e18))
    squared = MAKE("*", MAKE("int", far), MAKE("int", far))
    assert values_in(squared, {far: np.array([4.0e18, 3.0])}, 2).tolist() == [16 * 10**36, 9]


# --- terms --------------------------------------------------------------------------------


def test_terms_are_built_as_small_as_they_can_be() -> None:
    assert TERMS.negation(TERMS.negation(TRUTH)) is TRUTH
    assert TERMS.negation(TERMS.true) is TERMS.false
    assert TERMS.every([TRUTH]) is TERMS.every([TERMS.true, TRUTH, TRUTH]) is TERMS.some([TRUTH]) is TRUTH
    assert TERMS.every([]) is TERMS.true
    assert TERMS.every([TRUTH, TERMS.false]) is TERMS.some([]) is TERMS.false
    assert TERMS.choice(TRUTH, NUMBER, NUMBER) is TERMS.choice(TERMS.true, NUMBER, OTHER) is NUMBER
    assert TERMS.choice(TERMS.false, NUMBER, OTHER) is OTHER
    assert MAKE("+", whole(2), whole(3)) is whole(5)
    assert MAKE("<", whole(3), whole(2)) is TERMS.false
    assert MAKE("/", double(1.0), double(4.0)) is double(0.25)
    assert MAKE("+", NUMBER, OTHER) is MAKE("+", NUMBER, OTHER)
    assert double(-0.0) is not double(0.0)
    assert [len(parts_first(term)) for term in ASKED] == [7, 9, 11, 1]


# --- spans --------------------------------------------------------------------------------

SPANS = list(combinations_with_replacement(range(-2, 4), 2))
MEANT: dict[str, Callable[[int, int], int]] = {
    "=": lambda a, b: a == b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": truncated,
}


def hull(values: Iterable[int]) -> tuple[int, int]:
    every = list(values)
    return min(every), max(every)


@pytest.mark.parametrize("op", MEANT)
def test_the_span_of_two_numbers_apart_is_exact(op: str) -> None:
    term = Term(op, (NUMBER, OTHER), BOOL if op in ("=", "<", "<=") else INT)
    for one, two in product(SPANS, SPANS):
        pairs = product(range(one[0], one[1] + 1), range(two[0], two[1] + 1))
        assert spanned(term, [one, two]) == hull(MEANT[op](a, b) for a, b in pairs)


@pytest.mark.parametrize("op", ["=", "<", "<="])
def test_a_number_is_compared_with_itself(op: str) -> None:
    assert spanned(Term(op, (NUMBER, NUMBER), BOOL), [(-3, 9), (-3, 9)]) == ((0, 0) if op == "<" else (1, 1))


def test_the_span_of_a_remainder_has_the_sign_of_what_is_divided_and_is_below_the_divisor() -> None:
    term = Term("mod", (NUMBER, OTHER), INT)
    for one, two in product(SPANS, SPANS):
        found, most = spanned(term, [one, two]), max(abs(two[0]), abs(two[1]), 1) - 1
        pairs = product(range(one[0], one[1] + 1), range(two[0], two[1] + 1))
        assert found is not None
        assert all(found[0] <= a - b * truncated(a, b) <= found[1] for a, b in pairs if b)
        if one[0] == one[1] and two[0] == two[1]:
            rest = one[0] - two[0] * truncated(one[0], two[0]) if two[0] else 0
            assert found == (rest, rest)
        else:
            assert found == (max(min(one[0], 0), -most), min(max(one[1], 0), most))


@pytest.mark.parametrize("op", ["<", "<="])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("greater", [False, True])
def test_the_span_of_the_least_and_of_the_greatest_is_exact(op: str, turned: bool, greater: bool) -> None:
    sides = (OTHER, NUMBER) if turned else (NUMBER, OTHER)
    condition = Term(op, sides, BOOL)
    chosen = sides if not greater else (sides[1], sides[0])
    term = Term("ite", (condition, *chosen), INT)
    for one, two in product(SPANS, SPANS):
        spans = {sides[0]: one, sides[1]: two}
        first = spanned(condition, [one, two])
        pairs = product(range(one[0], one[1] + 1), range(two[0], two[1] + 1))
        found = spanned(term, [first, spans[chosen[0]], spans[chosen[1]]])
        assert found == hull(max(a, b) if greater else min(a, b) for a, b in pairs)


def test_the_span_of_a_choice_is_cut_where_its_condition_cuts_it() -> None:
    four = whole(4)
    for condition, sides, span in [
        (Term("<", (NUMBER, four), BOOL), (NUMBER, four), (-3, 4)),
        (Term("<", (four, NUMBER), BOOL), (four, NUMBER), (-3, 4)),
        (Term("<=", (NUMBER, four), BOOL), (four, NUMBER), (4, 9)),
        (Term("=", (NUMBER, four), BOOL), (NUMBER, four), (-3, 9)),
        (TRUTH, (NUMBER, four), (-3, 9)),
    ]:
        spans = [(term.low, term.high) for term in sides]
        assert spanned(Term("ite", (condition, *sides), INT), [TRUTHS, *spans]) == span
    choice = Term("ite", (TRUTH, NUMBER, OTHER), INT)
    assert spanned(choice, [(1, 1), (2, 3), (5, 7)]) == (2, 3)
    assert spanned(choice, [(0, 0), (2, 3), (5, 7)]) == (5, 7)
    assert spanned(choice, [TRUTHS, None, (5, 7)]) is None


def test_the_span_of_a_truth_is_exact() -> None:
    for one, two in product([(0, 0), (0, 1), (1, 1)], repeat=2):
        assert spanned(Term("not", (TRUTH,), BOOL), [one]) == (1 - one[1], 1 - one[0])
        assert spanned(Term("and", (TRUTH, TRUTH), BOOL), [one, two]) == (one[0] & two[0], one[1] & two[1])
        assert spanned(Term("or", (TRUTH, TRUTH), BOOL), [one, two]) == (one[0] | two[0], one[1] | two[1])
    assert spanned(Term("or", (TRUTH, TRUTH), BOOL), [None, (1, 1)]) == (1, 1)
    assert spanned(Term("<", (NUMBER, OTHER), BOOL), [None, (1, 1)]) == TRUTHS
    assert spanned(Term("+", (NUMBER, OTHER), INT), [None, (1, 1)]) == FREE
    assert spanned(Term("+", (DOUBLE, DOUBLE), REAL), [None, (1.0, 1.0)]) is None


@pytest.mark.parametrize(
    ("op", "spans", "span"),
    [
        ("neg", [(-1.5, 2.0)], (-2.0, 1.5)),
        ("abs", [(-1.5, 2.0)], (0.0, 2.0)),
        ("abs", [(-3.5, 2.0)], (0.0, 3.5)),
        ("abs", [(1.5, 2.0)], (1.5, 2.0)),
        ("abs", [(-2.0, -1.5)], (1.5, 2.0)),
        ("+", [(-1.5, 2.0), (0.5, 4.0)], (-1.0, 6.0)),
        ("-", [(-1.5, 2.0), (0.5, 4.0)], (-5.5, 1.5)),
        ("*", [(-1.5, 2.0), (0.5, 4.0)], (-6.0, 8.0)),
        ("/", [(-1.5, 2.0), (0.5, 4.0)], (-3.0, 4.0)),
        ("/", [(-1.5, 2.0), (-4.0, -0.5)], (-4.0, 3.0)),
        ("/", [(-1.5, 2.0), (0.0, 4.0)], None),
        ("/", [(-1.5, 2.0), (-4.0, 0.0)], None),
        ("+", [(-1.5, float("inf")), (0.5, 4.0)], None),
        ("int", [(-1.5, 2.5)], (-1, 2)),
        ("int", [(-1.5, float("inf"))], FREE),
    ],
)
def test_the_span_of_doubles_is_exact(
    op: str, spans: list[tuple[float, float]], span: tuple[float, float] | None
) -> None:
    term = Term(op, (DOUBLE, DOUBLE)[: len(spans)], INT if op == "int" else REAL)
    assert spanned(term, spans) == span


def test_the_span_of_a_whole_number_that_becomes_a_double_is_exact() -> None:
    term = Term("real", (NUMBER,), REAL)
    assert spanned(term, [(-3, 9)]) == (-3.0, 9.0)
    assert spanned(term, [(0, 2**1000 - 1)]) == (0.0, float(2**1000 - 1))
    assert spanned(term, [(0, 2**1000)]) is None
    assert spanned(term, [FREE]) is None


# --- facts --------------------------------------------------------------------------------

FACTS: list[tuple[list[Term], dict[Term, tuple[int, int]]]] = [
    ([MAKE("<", NUMBER, whole(3))], {NUMBER: (-3, 2)}),
    ([MAKE("<=", NUMBER, whole(3))], {NUMBER: (-3, 3)}),
    ([TERMS.negation(MAKE("<", NUMBER, whole(3)))], {NUMBER: (3, 9)}),
    ([TERMS.negation(MAKE("<=", NUMBER, whole(3)))], {NUMBER: (4, 9)}),
    ([MAKE("=", NUMBER, OTHER)], {NUMBER: (0, 5), OTHER: (0, 5)}),
    ([MAKE("<", OTHER, NUMBER)], {NUMBER: (1, 9), OTHER: (0, 5)}),
    ([MAKE("<", NUMBER, OTHER)], {NUMBER: (-3, 4), OTHER: (0, 5)}),
    ([MAKE("<", NUMBER, OTHER), MAKE("<", OTHER, whole(2))], {NUMBER: (-3, 0), OTHER: (0, 1)}),
    ([TERMS.negation(MAKE("=", NUMBER, whole(-3)))], {NUMBER: (-2, 9)}),
    ([TERMS.negation(MAKE("=", NUMBER, whole(9)))], {NUMBER: (-3, 8)}),
    ([TERMS.negation(MAKE("=", whole(0), OTHER))], {OTHER: (1, 5)}),
    ([TERMS.negation(MAKE("=", NUMBER, whole(4)))], {NUMBER: (-3, 9)}),
    ([TERMS.some((MAKE("=", NUMBER, whole(2)), MAKE("=", NUMBER, whole(4))))], {NUMBER: (2, 4)}),
    ([TERMS.some((MAKE("=", NUMBER, whole(4)), MAKE("=", NUMBER, whole(2))))], {NUMBER: (2, 4)}),
    ([TERMS.some((MAKE("=", NUMBER, whole(2)), TRUTH))], {NUMBER: (-3, 9)}),
    (
        [TERMS.negation(TRUTH), TERMS.some((MAKE("=", NUMBER, whole(2)), TRUTH))],
        {NUMBER: (2, 2), TRUTH: (0, 0)},
    ),
    ([TERMS.every((TRUTH, MAKE("<", NUMBER, whole(0))))], {NUMBER: (-3, -1), TRUTH: (1, 1)}),
    ([TERMS.negation(TERMS.some((TRUTH, MAKE("<", NUMBER, whole(1)))))], {NUMBER: (1, 9), TRUTH: (0, 0)}),
    (
        [TERMS.negation(TERMS.every((MAKE("<", NUMBER, whole(2)), MAKE("<", NUMBER, whole(7)))))],
        {NUMBER: (2, 9)},
    ),
]


@pytest.mark.parametrize(("hypotheses", "spans"), FACTS)
def test_what_hypotheses_tell_is_exact(hypotheses: list[Term], spans: dict[Term, tuple[int, int]]) -> None:
    known = KnownSpans(hypotheses, ())
    assert known.impossible is False
    assert {term: known.span(term) for term in spans} == spans
    assert all(known.span(one) == (1, 1) for one in hypotheses if one.op != "or")


@pytest.mark.parametrize("at", [0, 1, 2])
def test_hypotheses_that_contradict_each_other_are_impossible_wherever_they_stand(at: int) -> None:
    hypotheses = [MAKE("<", NUMBER, whole(0)), MAKE("<", whole(3), NUMBER)]
    hypotheses.insert(at, TRUTH)
    assert KnownSpans(hypotheses, ()).impossible is True
    assert KnownSpans([MAKE("<", NUMBER, whole(-3))], ()).impossible is True


def test_what_is_kept_lies_in_its_place_once_that_is_shown() -> None:
    kept = TERMS.kept(MAKE("+", DOUBLE, double(1.0)), 0.0, 1.0, 3)
    assert KnownSpans((), ()).span(kept) == (-0.5, 3.0)
    assert KnownSpans((), {3}).span(kept) == (0.0, 1.0)


# --- settling -----------------------------------------------------------------------------


def settled(hypotheses: list[Term], good: Term, ask: CaseAnswer | None = None) -> tuple[object, int]:
    """What becomes of an obligation, and the work."""
    asked = None if ask is None else (lambda _: ask)
    settler = Settler(TERMS, asked, {"b": 0, "n": 0, "m": 0, "x": 0.0})
    return settler.settle(hypotheses, TERMS.true, good, KnownSpans(hypotheses, ())), settler.work


FAR = MAKE("<=", MAKE("-", MAKE("*", DOUBLE, DOUBLE), DOUBLE), double(3.9))
"""It holds, and neither spans nor tried values show it."""


def test_obligations_are_settled_as_they_can_be_and_what_it_took_is_counted() -> None:
    less, sum_ = MAKE("<", NUMBER, whole(3)), MAKE("<=", MAKE("+", NUMBER, OTHER), whole(14))
    squares = MAKE("<=", whole(0), MAKE("*", NUMBER, NUMBER))
    assert settled([], sum_) == (Shown(), 5)
    assert settled([less], less) == (Shown(), 3)
    assert settled([], squares) == (Shown(), 9)
    assert settled([less], MAKE("<", NUMBER, whole(2))) == (Fails((("n", 2),)), 10)
    assert settled([], TERMS.false) == (Fails(()), 2)
    assert settled([], MAKE("<", DOUBLE, double(2.0))) == (Fails((("x", 2.0),)), 27)
    assert settled([MAKE("<", OTHER, whole(2))], MAKE("<", NUMBER, whole(2)))[0] == Fails(
        (("m", 0), ("n", 2))
    )
    square = MAKE("*", DOUBLE, DOUBLE)
    assert settled([], MAKE("<", square, double(2.0)))[0] == Fails((("x", -1.5),))
    minus_one = (
        MAKE("=", MAKE("neg", DOUBLE), square),
        TERMS.negation(MAKE("=", DOUBLE, MAKE("abs", DOUBLE))),
    )
    assert settled([], TERMS.negation(TERMS.every(minus_one)))[0] == Fails((("x", -1.0),))
    found, work = settled([], FAR)
    assert (found, work) == (Left(script([TERMS.negation(FAR)])), 41)
    assert settled([], FAR, CaseAnswer.UNKNOWN) == (found, work)
    assert settled([], FAR, CaseAnswer.NONE) == (Shown(), work)
    assert settled([], FAR, CaseAnswer.SOME) == (Fails(()), work)


def test_the_values_with_which_a_program_begins_are_tried() -> None:
    never = TERMS.negation(MAKE("=", MAKE("*", DOUBLE, double(10.0)), double(3.0)))
    for first, outcome in (({"x": 0.3}, Fails), ({"x": 0.0}, Left)):
        found = Settler(TERMS, None, first).settle([], TERMS.true, never, KnownSpans((), ()))
        assert isinstance(found, outcome)


def test_all_cases_are_tried_that_hypotheses_leave() -> None:
    many = TERMS.variable("v", Int(0, 10**12))
    few = MAKE("<", many, whole(5))
    assert settled([few], TERMS.negation(MAKE("=", MAKE("*", many, many), whole(7))))[0] == Shown()


def test_constants_and_their_neighbours_are_tried() -> None:
    edges = _edges(TERMS.every((MAKE("<", NUMBER, whole(7)), MAKE("<", DOUBLE, double(0.5)), TRUTH)))
    assert edges == {
        BOOL: [0, 1],
        INT: [-1, 0, 1, 6, 7, 8],
        REAL: [-1.0, -0.5, 0.0, 0.5, 1.0, 1.5],
        SINGLE: [-1.0, 0.0, 1.0],
    }


# --- what is owed -------------------------------------------------------------------------

OWED = """\
under 0
    0 at first: invariant `small` holds
    1 at first: invariant `apart` holds
    2 at first: invariant `begins` holds
under 0
    0 after a restart: invariant `small` holds
    1 after a restart: invariant `apart` holds
    2 after a restart: invariant `begins` holds
under 0
    0 invariant `apart`: the result of `+` stays in its 64 bits at `n + late`
    1 invariant `apart`: an operand stays in its 64 bits at `n + late`
under 3
    0 assumption `never`: follows from ranges and invariants at `never`
under 3
    0 taking deferred values: invariant `apart` is kept
under 3
    0 showing safe values after a fault: invariant `small` is kept
under 3
    0 `preprocess` of level `l`: `n` stays in 0 .. 9 at `a`
    1 `preprocess` of level `l`: invariant `small` is kept where `seen` fails at `l`
    2 `preprocess` of level `l`: invariant `apart` is kept where `seen` fails at `l`
    3 `preprocess` of level `l`: invariant `small` is kept where `seen` fails at `l`
    4 `preprocess` of level `l`: invariant `apart` is kept where `seen` fails at `l`
    5 `preprocess` of level `l`: invariant `small` is kept at `l`
    6 `preprocess` of level `l`: invariant `apart` is kept at `l`
under 3
    0 `postprocess` of level `l`: `shown` stays in 0 .. 9 at `a`
    1 `postprocess` of level `l`: the result of `-` stays in its 64 bits at `9 - n`
    2 `postprocess` of level `l`: `shown` stays in 0 .. 9 at `9 - n`
    3 `postprocess` of level `l`: invariant `small` is kept at `l`
under 0
    0 procedure `over`: the result of `+` stays in its 64 bits at `low + 1`
    1 procedure `over`: `s` stays in -9223372036854775808 .. 9223372036854775807 at `low + 1`
under 0
    0 procedure `under`: the divisor is not zero at `b`
    1 procedure `under`: the result of `/` stays in its 64 bits at `low / b`
    2 procedure `under`: `s` stays in -9223372036854775808 .. 9223372036854775807 at `low / b`
under 0
    0 procedure `rest`: the divisor is not zero at `b`
    1 procedure `rest`: the quotient stays in its 64 bits at `low mod b`
    2 procedure `rest`: the result of `mod` stays in its 64 bits at `low mod b`
    3 procedure `rest`: `s` stays in -9223372036854775808 .. 9223372036854775807 at `low mod b`
under 0
    0 procedure `of_wide`: an operand stays in its 64 bits at `wide`
    1 procedure `of_wide`: the result of `-` stays in its 64 bits at `wide - 1`
    2 procedure `of_wide`: an operand stays in its 64 bits at `wide - 1`
under 0
    0 procedure `whole`: the whole number stays in its 64 bits at `int(x * 1.0e18)`
    1 procedure `whole`: `m` stays in -100 .. 100 at `int(x * 1.0e18)`
under 0
    0 procedure `index`: the result of `+` stays in its 64 bits at `a + 1`
    1 procedure `index`: `xs[0]` stays in 0 .. 9 at `a + 1`
    2 procedure `index`: the index lies in 0 .. 3 at `a`
under 0
    0 procedure `read`: the result of `+` stays in its 64 bits at `a + b`
    1 procedure `read`: the index lies in 0 .. 3 at `a + b`
    2 procedure `read`: `m` stays in -100 .. 100 at `xs[a + b]`
under 0
    0 procedure `real_`: `r` stays in 0.0 .. 500.0 at `x * 2.0`
under 0
    0 procedure `use`: `k` is assigned before it is read at `k`
under 0
    0 procedure `unset`: `j` is assigned before it is read at `j`
    1 procedure `unset`: `m` stays in -100 .. 100 at `j`
under 0
    0 procedure `local_`: `k` stays in 0 .. 3 at `a`
under 3
    0 a condition of table `t`: the divisor is not zero at `b`
    1 a condition of table `t`: the result of `/` stays in its 64 bits at `a / b`
    2 a condition of table `t`: an operand stays in its 64 bits at `a / b`
under 5
    0 line `one` of table `t`: `k` stays in 0 .. 9 at `a`
    1 line `one` of table `t`: `out` stays in 0 .. 9 at `k`
    2 line `one` of table `t`: two actions write one value to `out` at `both(a)`
    3 line `one` of table `t`: `k` stays in 0 .. 3 at `a`
    4 line `one` of table `t`: an operand stays in its 64 bits at `k`
    5 line `one` of table `t`: the result of `*` stays in its 64 bits at `k * 4`
    6 line `one` of table `t`: `n` stays in 0 .. 9 at `k * 4`
    7 line `one` of table `t`: invariant `small` is kept at `one`
    8 line `one` of table `t`: invariant `apart` is kept at `one`
under 4
    0 line `two` of table `t`: `n` stays in 0 .. 9 at `a`
    1 line `two` of table `t`: invariant `small` is kept at `two`
    2 line `two` of table `t`: invariant `apart` is kept at `two`
under 5
    0 line `d` of table `t`: `k` stays in 0 .. 9 at `a`
    1 line `d` of table `t`: `out` stays in 0 .. 9 at `k`
    2 line `d` of table `t`: two actions write one value to `out` at `both(a)`
"""


def test_what_a_program_owes_is_named_and_placed() -> None:
    program = program_of(FAULTY)
    found = []
    for debt in Debts(program, Start(program)).all():
        found += [f"under {len(debt.hypotheses)}"] if debt.owed else []
        for owed in debt.owed:
            place = FAULTY[owed.written.start : owed.written.end] if owed.written.file else ""
            place = place.split("|")[1].strip() if "||" in place else place
            found.append(f"    {owed.number} {owed.name}" + f" at `{place}`" * bool(place))
    assert found == OWED.splitlines()


def test_no_invariant_that_reads_an_input_holds_at_first() -> None:
    """Nothing says what the input is then, and what it is declared to begin with would satisfy it."""
    program = program_of(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\nassume low monitored : a < 5\ninvariant few : n < 5\n"
        "table t {\n| line | a ||\n| d | DEFAULT ||\n}\n"
    )
    for condition, good in (
        (program.invariants[0].condition, True),
        (program.assumptions[0].condition, False),
    ):
        stated = replace(program, invariants=(replace(program.invariants[0], condition=condition),))
        start = Start(stated)
        [owed] = next(iter(Debts(stated, start).all())).owed
        assert (owed.name, owed.good) == (
            "at first: invariant `few` holds",
            start.terms.true if good else start.terms.false,
        )


def test_what_an_action_writes_twice_it_has_written_wherever_it_did_once() -> None:
    start = Start(
        program_of("input p : bool\nstate n : int 0 .. 9\ntable t {\n| line | p ||\n| d | DEFAULT ||\n}\n")
    )
    run, terms, p = Run(start, ""), start.terms, start.leaves["p"]
    one, two = terms.constant(INT, 1), terms.constant(INT, 2)
    run.write("n", one, terms.true)
    run.write("n", two, p)
    assert run.state.wrote["n"] is terms.true
    assert run.state.leaves["n"] is terms.choice(p, two, one)


def test_a_condition_that_several_lines_state_is_owed_once() -> None:
    program = program_of(
        "input a : int 0 .. 9\ninput p : bool\ntable t {\n| line | 9 / a | p ||\n| one | > 2 | true ||\n"
        "| two | > 2 | false ||\n| three | <= 2 | ||\n}\n"
    )
    names = [owed.name for debt in Debts(program, Start(program)).all() for owed in debt.owed]
    assert names.count("a condition of table `t`: the divisor is not zero") == 2


LONG = """
input a : int 0 .. 9
state n : int 0 .. 9
invariant low : n <= 9
procedure begin { n := 1 n := 2 n := 3 }
procedure alone { n := 1 n := 2 n := 3 }
table t {
  | line | a    || procedures |
  | one  | < 5  || begin      |
  | two  | >= 5 ||            |
}
level l {
  period 40 [ms]
  preprocess begin
  table t
}
"""


def test_what_is_too_long_to_follow_is_named_and_placed(monkeypatch: pytest.MonkeyPatch) -> None:
    program = program_of(LONG)
    verdict = prove_program(program, Options())
    assert verdict.certificate is not None
    monkeypatch.setattr("rcsc.proof.certify.execution.MOST_STEPS", 2)
    found = certify(program, json.loads(json.dumps(verdict.certificate)))
    assert found.problems == ()
    written = [(one.name, LONG[one.written.start : one.written.end], one.question) for one in found.unchecked]
    many = ": what it owes has too many steps to be followed"
    assert [
        (name, place.split("|")[0 if "|" not in place[:2] else 1].strip(), asked)
        for name, place, asked in written
    ] == [
        (f"`preprocess` of level `l`{many}", "l", ""),
        (f"procedure `alone`{many}", "alone", ""),
        (f"line `one` of table `t`{many}", "one", ""),
    ]


SPELLED = {
    "a literal": ["true"],
    "a comparison and a literal": ["(x + y < 4) = true", "(x + y < 4) /= true"],
    "what never holds": ["x - x < 0 and y < 3 or y > 2", "y <= 2"],
    "nothing between": ["x + y < 3 and x + y > 5 or y < 2", "y >= 2"],
    "what is not apart": ["not (x + y /= 3)", "x + y /= 3"],
    "a truth and a comparison": ["p = (x < 4)", "p /= (x < 4)"],
    "a comparison and a truth": ["(x + y < 4) = p", "(x + y < 4) /= p"],
    "no member": ["not (x in {2, 3, 9})", "x in {2, 3, 9}"],
}


def entry_of(lines: list[str]) -> tuple[Program, dict[str, Any]]:
    rows = "".join(f"| l{at} | {line} ||\n" for at, line in enumerate(lines))
    text = f"input x : int 0 .. 20\ninput y : int 0 .. 20\ninput p : bool\ntable t {{\n| line | when ||\n{rows}}}\n"
    program = program_of(text)
    made: dict[str, Any] = json.loads(json.dumps(prove_program(program, Options()).certificate))
    return program, made


@pytest.mark.parametrize("case", SPELLED)
def test_a_tree_is_checked_however_its_conditions_are_spelled(case: str) -> None:
    program, certificate = entry_of(SPELLED[case])
    found = certify(program, certificate)
    assert (found.problems, found.unchecked) == ((), ())
    assert found.checked[-1] == "table `t`: exactly one line matches"


def test_what_is_wrong_with_a_tree_is_told_word_for_word() -> None:
    program, certificate = entry_of(SPELLED["what is not apart"])
    [entry] = certificate["tables"]
    for tree, words in [
        (entry["tree"][:-1], "the tree leaves a region out"),
        ([["s", 0, 10**9]], "a split is out of its region"),
        ([*entry["tree"], ["l", 0]], "the tree has more nodes than regions"),
        ([["l", 0]], "a leaf does not hold: ['l', 0]"),
    ]:
        cut = certificate | {"tables": [entry | {"tree": tree}]}
        assert certify(program, cut).problems == (f"table `t`: {words}",)


@pytest.mark.parametrize(
    ("default", "right"),
    [("", False), ("| d | DEFAULT unreachable ||\n", False), ("| d | DEFAULT ||\n", True)],
)
def test_only_what_falls_to_default_may_be_left_without_a_line(default: str, right: bool) -> None:
    program = program_of(
        f"input x : int 0 .. 20\ntable t {{\n| line | x ||\n| one | < 5 ||\n| two | in {{7, 9}} ||\n{default}}}\n"
    )
    [table] = program.tables
    tree = [["s", 0, 4], ["l", 0], ["s", 0, 8], ["l", -1], ["l", -1]]
    entry: dict[str, Any] = {"assumptions": [], "columns": ["x"], "forms": [[[0, 1]]], "tree": tree}
    with nullcontext() if right else pytest.raises(RejectedError, match=r"a leaf does not hold: \['l', -1\]"):
        TableChecker(Start(program), table, entry).check()


def test_values_of_others_than_are_read_are_refused_word_for_word() -> None:
    program = program_of(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\nassume near monitored : x < 5\n"
        "table t assuming near {\n| line | x ||\n| one | < 3 ||\n| two | 3 .. 4 ||\n}\n"
    )
    certificate = json.loads(json.dumps(prove_program(program, Options()).certificate))
    assert certify(program, certificate).whole
    certificate["tables"][0][WITNESS]["y"] = 1
    words = "table `t`: values of others than its assumptions and invariants read are given"
    assert certify(program, certificate).problems == (words,)


def test_bounds_of_the_first_form_may_show_that_a_region_is_empty() -> None:
    """Of `x - y`, which is negative, `x`, which is positive, and `y`, which is not."""
    program = program_of(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ntable t {\n| line | when ||\n| one | x < y ||\n| two | x >= y ||\n}\n"
    )
    tree = [
        ["s", 0, -1],
        ["s", 1, 4],
        ["l", 0],
        ["s", 2, 4],
        ["e", [[0, 1], [1, -1], [2, 1]]],
        ["l", 0],
        ["l", 1],
    ]
    forms = [[[0, 1], [1, -1]], [[0, 1]], [[1, 1]]]
    entry: dict[str, Any] = {"assumptions": [], "columns": ["x", "y"], "forms": forms, "tree": tree}
    TableChecker(Start(program), program.tables[0], entry).check()


def test_several_cells_may_be_about_one_form() -> None:
    program = program_of(
        "input x : int 0 .. 20\ntable t {\n| line | x | x + 1 | when ||\n| one | < 9 | > 3 | x < 30 ||\n"
        "| two | < 9 | <= 3 | ||\n| three | >= 9 | | x >= 7 ||\n}\n"
    )
    found = certify(program, json.loads(json.dumps(prove_program(program, Options()).certificate)))
    assert (found.problems, found.unchecked) == ((), ())


# --- conditions ---------------------------------------------------------------------------

READ = [
    *(f"p or x - x {op} {constant}" for op in ("<", "<=", "=", "/=", ">=", ">") for constant in (-1, 0, 1)),
    *(f"2 * x - 3 * y {op} {constant}" for op in ("<", "<=", "=", "/=", ">=", ">") for constant in (-2, 1)),
    *(f"y - x {op} 2 * y - 1" for op in ("<", "=", ">=")),
    *("-2 * x = 3 - 2 * y", "x * y < 3", "x * 2 + y * (1 + 1) /= 7", "x in {0, 3}", "p", "p = q", "p /= q"),
    *(
        "p and q",
        "p or x < y",
        "p xor q",
        "p implies x = y",
        "p = (x < y)",
        "(x < y) /= (y < 3)",
        "false = q",
    ),
    "not (p and x + y > 4) or x = 2 and y in {1, 4}",
    "(x < 2 or x > 3) and x + y /= 4",
    *("r < s", "not (r = s)", "-r <= s", "r >= 0.5 or s /= 0.0", "p and r > s", "r * s < 0.5 and x < 2"),
]
"""Conditions over two whole numbers, two truths and two doubles."""
RANGES = {
    "x": range(5),
    "y": range(5),
    "p": (False, True),
    "q": (False, True),
    "r": (-1.0, 0.0, 0.5),
    "s": (-0.5, 0.0),
}
NAMED = (
    "input x : int 0 .. 4\ninput y : int 0 .. 4\ninput p : bool\ninput q : bool\n"
    "input r : real -1.0 .. 0.5\ninput s : real -0.5 .. 0.0\n"
)
AT = [dict(zip(RANGES, values, strict=True)) for values in product(*RANGES.values())]


def checker_of(*conditions: str) -> TableChecker:
    """A checker of a table with these lines, and a DEFAULT."""
    rows = "".join(f"| l{at} | {condition} ||\n" for at, condition in enumerate(conditions))
    program = program_of(f"{NAMED}table t {{\n| line | when ||\n{rows}| d | DEFAULT ||\n}}\n")
    entry: dict[str, Any] = {"assumptions": [], "columns": [], "forms": [], "tree": []}
    return TableChecker(Start(program), program.tables[0], entry)


def true_at(formula: Formula, checker: TableChecker, point: Snapshot) -> bool:
    """Whether a formula of the checker is true at a point, each of its terms as the interpreter has it."""
    if isinstance(formula, All | AnyOf):
        parts = [true_at(part, checker, point) for part in formula.parts]
        return all(parts) if isinstance(formula, All) else any(parts)
    form, box = formula
    terms = checker.terms.terms
    value = sum(k * key_of(terms[name].type, evaluate(terms[name], point)) for name, k in form)
    return any(low <= value <= high for low, high in box)


@pytest.mark.parametrize("condition", READ)
def test_a_condition_is_read_and_judged_as_the_interpreter_has_it(condition: str) -> None:
    """At every input, also where it is negated; in a narrower region at each input there."""
    checker = checker_of(condition)
    [test] = [test for test in checker.table.lines[0].tests if test is not None]
    bounds = {(("x", 1),): (1, 2), (("x", 2), ("y", -3)): (0, 4), (("q", 1),): (1, 1)}
    for yes in (True, False):
        read = checker.terms.formula(test.condition, yes)
        inside = checker.judge(read, bounds)
        for point in AT:
            true = evaluate(test.condition, point) is yes
            assert true_at(read, checker, point) is true, point
            if point["x"] in (1, 2) and 0 <= 2 * int(point["x"]) - 3 * int(point["y"]) <= 4 and point["q"]:
                assert true_at(inside, checker, point) is true, point


def test_a_condition_of_one_leaf_is_a_box_also_where_its_values_are_many() -> None:
    program = program_of(
        "input w : int 0 .. 1000000\ntable t {\n| line | when ||\n"
        "| one | (w < 100 or w > 5000) and w /= 7 ||\n| d | DEFAULT ||\n}\n"
    )
    entry: dict[str, Any] = {"assumptions": [], "columns": [], "forms": [], "tree": []}
    checker = TableChecker(Start(program), program.tables[0], entry)
    [test] = [test for test in program.tables[0].lines[0].tests if test is not None]
    assert checker.condition(test.condition) == ((("w", 1),), ((0, 6), (8, 99), (5001, 10**6)))


@pytest.mark.parametrize(
    ("condition", "box"),
    [
        ("x * x > 3", ((2, 4),)),
        ("12 / (5 - x) > 3", ((2, 4),)),
        ("x mod 2 = 0", ((0, 0), (2, 2), (4, 4))),
        ("12 / (x - 2) > 3", None),
    ],
)
def test_a_condition_of_one_leaf_is_tried_at_all_its_values_and_no_others(
    condition: str, box: Box | None
) -> None:
    """One more would be undefined of the second; the last one is."""
    checker = checker_of(f"{condition} or p")
    [test] = [test for test in checker.table.lines[0].tests if test is not None]
    assert isinstance(test.condition, Apply)
    assert checker.tried(test.condition.args[0], "x") == box


def test_as_many_lines_as_may_be_are_left_to_be_settled_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checked_table, "MOST_PAIRED", 2)
    checker = checker_of("x < y", "p", "x >= y")
    assert [checker.left({}, list(range(many))) for many in (1, 2, 3)] == [True, True, False]
    assert len(checker.questions) == 2


HALF, ONE, GREAT = real_key(0.5), real_key(1.0), 2**64
REGIONS: list[tuple[dict[str, int], int, int]] = [
    ({"x": 1}, 1, 2), ({"p": 1}, 0, 0), ({"x": 2, "y": -3}, -1, 4), ({"p": 1, "x": 1}, 1, 3), ({"r": 1}, 0, HALF),
    ({"r": 1}, -ONE, 0), ({"r": 1}, -GREAT, GREAT), ({"r": 1, "s": -1}, 1, GREAT), ({"r": 1, "s": -1}, 0, GREAT),
    ({"r": 1, "s": -1}, -GREAT, 0), ({"r": 1, "s": -1}, -GREAT, -1), ({"q": 1}, 1, 1), ({"q": 1, "x": -1}, -2, 0),
]  # fmt: skip


@pytest.mark.parametrize(("form", "low", "high"), REGIONS)
def test_what_is_left_of_a_region_is_asked_of_all_its_inputs_and_no_others(
    form: dict[str, int], low: int, high: int
) -> None:
    checker = checker_of("x < y or r < 0.0", "p or s = 0.0", "x >= y")
    for name in form:
        checker.terms.name(checker.terms.terms[name])
    assert checker.left({tuple(form.items()): (low, high)}, [0, 2])
    [debt] = checker.questions
    [owed] = debt.owed
    cases = {checker.start.leaves[name]: np.array([point[name] for point in AT]) for name in RANGES}
    known, good = (
        np.broadcast_to(values_in(term, cases, len(AT)), len(AT))
        for term in (checker.start.terms.every(debt.hypotheses), owed.good)
    )
    kinds = {name: checker.start.types[name] for name in form}
    for number, point in enumerate(AT):
        value = sum(k * key_of(kinds[name], point[name]) for name, k in form.items())
        assert known[number] == (low <= value <= high), point
        assert good[number] == (
            not ((point["x"] < point["y"] or point["r"] < 0.0) and point["x"] >= point["y"])
        )
