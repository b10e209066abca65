"""Nodes of a symbolic run, exactly: their bounds, what folds, what a condition tells of them, and points at which conditions hold."""

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations_with_replacement, islice, product
from types import SimpleNamespace

import pytest
import z3
from hypothesis import given
from hypothesis import strategies as st

from rcsc.lang.interpret import evaluate
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Enum,
    Int,
    Kind,
    Literal,
    Read,
    Real,
    Scalar,
    Single,
    Value,
    Variable,
    VariableName,
)
from rcsc.lang.operator_table import Arithmetic, Op, part_way
from rcsc.lang.operator_table import single as to_single
from rcsc.proof.procedures.discharge import MOST_CHOICES, fewest
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.encode import Frame, declared, encode
from rcsc.proof.symbolic.keyed import KEY, ExactIntegers, Keyed
from rcsc.proof.symbolic.measured import Measured
from rcsc.proof.symbolic.values import FALSE, TRUE, Fact, Node

SPANS = list(combinations_with_replacement(range(-2, 4), 2))
TRUTHS = (0, 1)


def number(name: str, low: int, high: int) -> Node:
    return values.variable(name, Int(low, high))


def whole(value: int) -> Node:
    return values.constant(Int(value, value), value)


def double(value: float) -> Node:
    return values.constant(Real(value, value), value)


N, M = number("n", -3, 9), number("m", 0, 5)
X, Y = values.variable("x", Real(-1.5, 2.0)), values.variable("y", Real(0.5, 4.0))
B, C = values.variable("b", Bool()), values.variable("c", Bool())


def ends(node: Node) -> tuple[float, float]:
    return node.low, node.high


# --- truth --------------------------------------------------------------------------------


def test_a_truth_that_nothing_decides_lies_between_false_and_true() -> None:
    open_ = [
        values.negation(B), values.both(B, C), values.either(B, C), values.follows(B, C), values.any_of([B, C]),
        values.compare(Op.LT, N, M), values.compare(Op.EQ, N, M), values.compare(Op.NE, N, M), values.choice(B, C, values.negation(C)),
        values.logic(Op.XOR, B, C), values.compare(Op.GE, X, Y),
    ]  # fmt: skip
    assert [ends(one) for one in open_] == [TRUTHS] * len(open_)
    assert {type(one.kind) for one in open_} == {Bool}


def test_a_truth_that_is_decided_is_a_constant() -> None:
    assert values.negation(values.negation(B)) is B
    assert values.negation(TRUE) is values.both(B, FALSE) is values.both(FALSE, B) is FALSE
    assert values.both(B, TRUE) is values.both(TRUE, B) is values.both(B, B) is B
    assert values.either(B, TRUE) is values.follows(FALSE, B) is values.all_of([]) is TRUE
    assert values.either(B, FALSE) is values.follows(TRUE, B) is B
    assert values.any_of([]) is FALSE


MEANT: dict[Op, Callable[[int, int], bool]] = {
    Op.LT: lambda a, b: a < b,
    Op.LE: lambda a, b: a <= b,
    Op.GT: lambda a, b: a > b,
    Op.GE: lambda a, b: a >= b,
    Op.EQ: lambda a, b: a == b,
    Op.NE: lambda a, b: a != b,
}


def hull(found: Iterable[int]) -> tuple[int, int]:
    every = list(found)
    return min(every), max(every)


@pytest.mark.parametrize("op", MEANT)
def test_a_comparison_is_decided_exactly_where_the_bounds_do(op: Op) -> None:
    for one, two in product(SPANS, SPANS):
        pairs = product(range(one[0], one[1] + 1), range(two[0], two[1] + 1))
        found = values.compare(op, number("n", *one), number("m", *two))  # type: ignore[arg-type]  # a comparison
        assert ends(found) == hull(MEANT[op](a, b) for a, b in pairs)


def test_a_value_is_compared_with_itself_whatever_is_known_of_it() -> None:
    cut = values.narrowed(N, 2, 5)
    assert (
        values.compare(Op.LE, N, cut) is values.compare(Op.EQ, cut, N) is values.compare(Op.GE, N, N) is TRUE
    )
    assert (
        values.compare(Op.LT, N, cut) is values.compare(Op.NE, cut, N) is values.compare(Op.GT, N, N) is FALSE
    )


# --- numbers ------------------------------------------------------------------------------


def test_bounds_of_numbers_are_exact() -> None:
    kind = Int(-100, 100)
    assert ends(values.choice(B, N, M)) == (-3, 9)
    assert ends(values.choice(B, M, N)) == (-3, 9)
    assert ends(values.arithmetic(Op.ADD, (N, M), kind)) == (-3, 14)
    assert ends(values.arithmetic(Op.SUB, (N, M), kind)) == (-8, 9)
    assert ends(values.arithmetic(Op.TO_REAL, (N,), Real(-100.0, 100.0))) == (-3.0, 9.0)
    assert ends(values.arithmetic(Op.TO_INT, (X,), kind)) == (-1, 2)
    assert ends(values.arithmetic(Op.MUL, (X, Y), Real(-9.0, 9.0))) == (-6.0, 8.0)
    nan = values.variable("z", Real(-math.inf, math.inf))
    low, high = ends(values.arithmetic(Op.TO_INT, (nan,), kind))
    assert low == -high < -(2**1023)
    assert not nan.ordered
    assert values.compare(Op.EQ, nan, nan).op == Op.EQ


def test_what_can_have_one_value_only_is_folded_and_a_zero_with_a_sign_is_not() -> None:
    assert values.arithmetic(Op.ADD, (whole(2), whole(3)), Int(0, 9)).op == values.CONSTANT
    assert values.arithmetic(Op.MOD, (whole(-7), whole(3)), Int(-9, 9)).low == -1
    assert values.arithmetic(Op.MUL, (N, whole(0)), Int(-9, 9)).op == values.CONSTANT
    assert values.arithmetic(Op.MUL, (double(0.5), double(0.5)), Real(0.0, 9.0)).low == 0.25
    zero = values.arithmetic(Op.MUL, (X, double(0.0)), Real(-9.0, 9.0))
    assert zero.op == Op.MUL
    assert values.choice(TRUE, N, M) is values.choice(B, N, N) is N
    assert values.choice(FALSE, N, M) is M
    assert values.choice(B, whole(3), whole(3)).op == values.CONSTANT


def test_what_is_narrowed_lies_within_both_bounds() -> None:
    cut = values.narrowed(N, 2, 20)
    assert (ends(cut), cut.op, values.root(cut)) == ((2, 9), values.NARROWED, N)
    again = values.narrowed(cut, -5, 4)
    assert (ends(again), again.args) == ((2, 4), (N,))
    assert values.narrowed(N, -9, 20) is values.narrowed(N, 10, 12) is N
    assert (values.narrowed(N, 9, 12).op, values.narrowed(N, 9, 12).low) == (values.CONSTANT, 9)


# --- what a condition tells ---------------------------------------------------------------


def told(condition: Node, *, holds: bool = True) -> dict[str, Fact]:
    facts: dict[Node, Fact] = {}
    values.learn(condition, facts, holds=holds)
    return {node.name: fact for node, fact in facts.items() if node.name}


@pytest.mark.parametrize("op", MEANT)
@pytest.mark.parametrize("holds", [True, False])
def test_a_comparison_tells_exactly_what_both_sides_can_be(op: Op, holds: bool) -> None:
    for one, two in product(SPANS, SPANS):
        condition = values.compare(op, number("n", *one), number("m", *two))  # type: ignore[arg-type]  # a comparison
        if condition.known:
            continue
        pairs = [
            (a, b)
            for a, b in product(range(one[0], one[1] + 1), range(two[0], two[1] + 1))
            if MEANT[op](a, b) == holds
        ]
        facts = {"n": one, "m": two} | told(condition, holds=holds)
        assert facts == {"n": hull(a for a, _ in pairs), "m": hull(b for _, b in pairs)}


LOW, HIGH = values.compare(Op.LE, N, whole(2)), values.compare(Op.GE, N, whole(6))
TOLD: list[tuple[Node, bool, dict[str, Fact]]] = [
    (B, True, {"b": (1, 1)}),
    (B, False, {"b": (0, 0)}),
    (values.negation(B), True, {"b": (0, 0)}),
    (values.both(B, LOW), True, {"b": (1, 1), "n": (-3, 2)}),
    (values.both(LOW, B), False, {}),
    (values.either(LOW, B), True, {}),
    (values.either(LOW, values.compare(Op.EQ, N, whole(4))), True, {"n": (-3, 4)}),
    (values.either(values.compare(Op.EQ, N, whole(4)), LOW), True, {"n": (-3, 4)}),
    (values.either(values.compare(Op.EQ, N, whole(4)), HIGH), True, {"n": (4, 9)}),
    (values.any_of([values.compare(Op.EQ, N, whole(at)) for at in (4, 2, 7)]), True, {"n": (2, 7)}),
    (values.either(LOW, HIGH), False, {"n": (3, 5)}),
    (values.compare(Op.LT, X, double(1.0)), True, {"x": (-1.5, math.nextafter(1.0, -math.inf))}),
    (values.compare(Op.LT, double(1.0), X), True, {"x": (math.nextafter(1.0, math.inf), 2.0)}),
    (values.compare(Op.LE, X, double(1.0)), True, {"x": (-1.5, 1.0)}),
    (values.compare(Op.LE, X, double(1.0)), False, {"x": (math.nextafter(1.0, math.inf), 2.0)}),
    (values.compare(Op.EQ, X, double(2.0)), False, {"x": (-1.5, math.nextafter(2.0, -math.inf))}),
    (values.compare(Op.EQ, X, double(-1.5)), False, {"x": (math.nextafter(-1.5, math.inf), 2.0)}),
]


@pytest.mark.parametrize(("condition", "holds", "facts"), TOLD)
def test_a_condition_tells_exactly_this(condition: Node, holds: bool, facts: dict[str, Fact]) -> None:
    assert told(condition, holds=holds) == facts


def test_a_comparison_with_what_may_be_no_number_tells_nothing_where_it_fails() -> None:
    nan = values.variable("z", Real(-math.inf, math.inf))
    assert told(values.compare(Op.LE, nan, double(1.0)), holds=False) == {}
    assert told(values.compare(Op.LE, nan, double(1.0))) == {"z": (-math.inf, 1.0)}


# --- points -------------------------------------------------------------------------------


def test_a_point_that_is_found_is_as_low_as_each_variable_goes() -> None:
    high = values.compare(Op.GE, values.arithmetic(Op.ADD, (N, M), Int(-9, 20)), whole(11))
    found = trial.witness([high, values.compare(Op.GT, X, double(0.0))], [N, M, X])
    assert found == {"n": 6, "m": 5, "x": 5e-324}
    assert trial.witness([values.compare(Op.LT, N, whole(-2)), values.both(B, C)], [N, B, C]) == {
        "n": -3,
        "b": True,
        "c": True,
    }
    assert trial.witness([values.both(LOW, HIGH)], [N]) is None


def test_a_goal_is_met_only_where_all_conditions_hold() -> None:
    low, seven = values.compare(Op.LT, N, whole(0)), values.compare(Op.EQ, N, whole(7))
    goals = [low, seven, values.both(low, B), values.negation(low)]
    found = trial.met([], goals, {"n": 7, "b": False})  # first near, then anywhere
    assert found.keys() == set(goals)
    assert all(trial.holds_at(goal, point) for goal, point in found.items())
    assert found[seven] == {"n": 7, "b": False}
    assert trial.met([values.negation(low)], goals, {"n": -1}).keys() == {seven, goals[3]}
    assert not trial.met([low, seven], goals, {})
    divided = values.arithmetic(Op.DIV, (M, N), Int(-100, 100))
    none = values.compare(Op.EQ, divided, whole(0))  # is not defined there, nor is its negation
    assert trial.met([values.compare(Op.EQ, N, whole(0))], [none, values.negation(none)], {}) == {}
    assert trial.met([values.compare(Op.EQ, N, whole(1))], [none, values.negation(none)], {}) != {}


@pytest.mark.parametrize(
    "kind",
    [
        Real(-1e308, 1e308),
        Real(-1.7e308, 5e-324),
        Real(0.1, 0.1),
        Single(-to_single(3e38), to_single(3e38)),
        Real(1.0, 1.0000000000000004),
    ],
)
def test_no_input_is_tried_that_lies_outside_its_range(kind: Real) -> None:
    """The difference of two ends may be beyond all doubles."""
    tried = [point["x"] for point in trial.points([Variable(VariableName("x"), Kind.INPUT, kind, kind.low)])]
    assert len(tried) > 100
    assert all(kind.low <= float(value) <= kind.high for value in tried)


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(allow_nan=False, allow_infinity=False),
    st.floats(0.0, 1.0),
)
def test_a_part_of_the_way_lies_between(one: float, other: float, part: float) -> None:
    low, high = sorted((one, other))
    assert low <= part_way(low, high, part) <= high


def test_a_part_of_the_way_is_that_part_also_where_the_difference_is_beyond_all_doubles() -> None:
    assert [part_way(-1.5e308, 1.5e308, part) for part in (0.0, 0.25, 0.5, 1.0)] == [
        -1.5e308,
        -7.5e307,
        0.0,
        1.5e308,
    ]


def test_the_points_that_are_tried_are_always_the_same() -> None:
    kinds: dict[str, Scalar] = {"i": Int(-1, 9), "r": Real(-1.0, 8.0), "p": Bool()}
    variables = [Variable(VariableName(name), Kind.INPUT, kind, 0) for name, kind in kinds.items()]
    assert [tuple(point.values()) for point in islice(trial.points(variables), 14)] == [
        (-1, -1.0, False), (9, 8.0, True), (5, -5e-324, True), (6, -4.764695354403358e-270, True), (0, 3.433094301431438e-234, False),
        (6, -5e-324, True), (7, 1.9342033348625816e-295, False), (0, 5e-324, True), (4, 8.0, False), (7, -6.830223911462031e-100, True),
        (-1, -1.3240943950134792e-154, False), (6, 5e-324, True), (3, 0.7045219569892054, False), (6, -1.0, False),
    ]  # fmt: skip


def test_a_point_is_found_where_a_choice_hangs_on_it() -> None:
    chosen = values.choice(values.compare(Op.GE, M, whole(3)), N, whole(20))
    conditions = [values.compare(Op.LE, chosen, whole(4)), values.compare(Op.GT, N, whole(-2))]
    assert trial.witness(conditions, [N, M]) == {"n": -1, "m": 3}


def test_a_question_as_large_as_may_be_is_tried_and_a_larger_one_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    conditions = [values.compare(Op.GE, N, whole(2))]
    size = len(list(values.parts_first(*conditions)))
    monkeypatch.setattr(trial, "MOST_NODES", size)
    assert trial.witness(conditions, [N]) == {"n": 2}
    monkeypatch.setattr(trial, "MOST_NODES", size - 1)
    assert trial.witness(conditions, [N]) is None


@pytest.mark.parametrize(("many", "asked"), [(3, 7), (6, 63), (7, MOST_CHOICES + 7), (9, MOST_CHOICES + 9)])
def test_as_many_choices_are_tried_as_may_be_and_then_one_after_the_other_is_spared(
    many: int, asked: int
) -> None:
    """All are needed: every smaller choice is tried, as long as those are not too many."""
    tried: list[Sequence[int]] = []

    def suffice(chosen: Sequence[int]) -> bool:
        tried.append(chosen)
        return len(chosen) == many

    assert fewest(range(many), suffice) == tuple(range(many))
    assert len(tried) == asked


# --- solvers ------------------------------------------------------------------------------


def test_questions_are_counted_and_remembered_where_it_is_asked_for() -> None:
    for remembers in (False, True):
        solver = Solver(remembers=remembers) if remembers else Solver()
        one = smt.variable("p", Bool())
        solver.add(one)
        assert solver.check() is Answer.SATISFIABLE
        assert solver.check(smt.negation(one)) is Answer.UNSATISFIABLE
        assert solver.queries == 2
        assert bool(solver.refuted) == remembers


def test_members_are_compared_as_their_places() -> None:
    kind = Enum("colour", ("red", "green", "blue"))
    colour = values.variable("k", kind)
    assert ends(colour) == (0, 2)
    assert told(values.among(colour, [1, 2])) == {"k": (1, 2)}
    assert told(values.negation(values.among(colour, [0]))) == {"k": (1, 2)}


def test_a_question_is_asked_again_with_four_times_the_patience_until_the_processor_was_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Other processes take the time: it passes, and this one has used little of it."""
    clock, used, given = [0.0], [0.0], list[float]()
    solver = Solver(Limits(steps=1000, cpu_s=2.0))

    class Asked:
        """Z3 as it is while it has no time: it never answers."""

        def check(self, *_: object) -> object:
            clock[0] += 2.0 * 4 ** len(given)
            used[0] += 1.9 if len(given) == 3 else 0.1
            return z3.unknown

        def reason_unknown(self) -> str:
            return "timeout"

        def set(self, name: str, value: float) -> None:
            if name == "timeout":
                given.append(value)

        def add(self, *_: object) -> None:
            """What was asserted is stated again."""

    monkeypatch.setattr(solver, "_solver", Asked())
    monkeypatch.setattr(z3, "Solver", Asked)
    monkeypatch.setattr(smt, "time", SimpleNamespace(monotonic=lambda: clock[0], thread_time=lambda: used[0]))
    before = smt.cut_short()
    assert solver.check() is Answer.UNKNOWN
    assert given == [8_000, 32_000, 128_000]
    assert smt.cut_short() == before + 1


@pytest.mark.parametrize(("value", "there"), [(1.5, True), (2.0, True), (1.0, False), (-0.0, True)])
def test_members_of_a_set_of_doubles_are_these(value: float, there: bool) -> None:
    kind = Real(-9.0, 9.0)
    variable = Variable(VariableName("x"), Kind.INPUT, kind, 0.0)
    frame, _ = declared([variable])
    solver = Solver()
    solver.add(encode(Among(Read(variable.name, kind), (0.0, 1.5, 2.0), Bool()), frame))
    solver.add(smt.equal(frame.leaves[variable.name], smt.literal(kind, value), kind))
    assert solver.check() is (Answer.SATISFIABLE if there else Answer.UNSATISFIABLE)


def test_a_double_that_is_divided_is_followed_as_far_as_it_is_rounded() -> None:
    measured = Measured()
    quarter = measured.term(values.arithmetic(Op.DIV, (X, double(4.0)), Real(-9.0, 9.0)))
    solver = Solver()
    solver.add(*measured.ranges, smt.equal(measured.term(X), smt.fraction(1.0), KEY))
    near = [smt.at_most(smt.fraction(end), quarter, KEY) for end in (0.2499, 0.2501)]
    assert solver.check(near[0], smt.negation(near[1])) is Answer.SATISFIABLE
    assert solver.check(smt.negation(near[0])) is solver.check(near[1]) is Answer.UNSATISFIABLE


@pytest.mark.parametrize(
    ("op", "kind", "operands", "made"),
    [
        (Op.ABS, Int(-9, 9), (-4,), Int(0, 9)),
        (Op.TO_INT, Bool(), (True,), Int(0, 1)),
        (Op.TO_INT, Bool(), (False,), Int(0, 1)),
        (Op.TO_REAL, Int(-9, 9), (-4,), Real(-9.0, 9.0)),
        (Op.TO_REAL, Single(-9.0, 9.0), (to_single(0.1),), Real(-9.0, 9.0)),
        (Op.TO_SINGLE, Real(-9.0, 9.0), (0.1,), Single(-9.0, 9.0)),
        (Op.SUB, Real(-9.0, 9.0), (0.3, 0.1), Real(-18.0, 18.0)),
    ],
)
def test_z3_computes_what_the_interpreter_does(
    op: Op, kind: Scalar, operands: tuple[Value, ...], made: Scalar
) -> None:
    """Of each operator one value, and which it is; all edges are tried in `test_operators`."""
    expr = Apply(op, tuple(Literal(value, kind) for value in operands), made)
    solver = Solver()
    same = smt.equal(encode(expr, Frame({})), smt.literal(made, evaluate(expr, {})), made)
    assert solver.check(smt.negation(same)) is Answer.UNSATISFIABLE


NUMBERS = {
    Op.NEG: ((-2, 3),), Op.ABS: ((-2, 3),), Op.MIN: ((-2, 1), (-1, 2)), Op.MAX: ((-2, 1), (-1, 2)),
    Op.ADD: ((-2, 1), (-1, 2)), Op.SUB: ((-2, 1), (-1, 2)), Op.MUL: ((-2, 2), (3, 3)),
    Op.DIV: ((0, 9), (4, 4)), Op.MOD: ((0, 9), (5, 5)),
}  # fmt: skip
"""Operations that are exact for whole numbers of these spans: `mod` takes its divisor away at most once."""


@pytest.mark.parametrize("made", [Keyed, ExactIntegers])
@pytest.mark.parametrize("op", NUMBERS)
def test_whole_numbers_are_exact_where_they_are_linear_or_wrap_once(
    made: Callable[[], Keyed], op: Arithmetic
) -> None:
    """At each value; all others of any spans lie beside the exact ones (`test_what_is_not_linear_may_be_right`)."""
    spans = NUMBERS[op]
    for point in product(*(range(low, high + 1) for low, high in spans)):
        assert _said_of(made(), op, spans, point) == (True, False)


@pytest.mark.parametrize("op", [Op.MUL, Op.DIV, Op.MOD])
def test_what_is_not_linear_may_be_right(op: Arithmetic) -> None:
    """A product of two numbers that vary may be any of its bounds; asked exactly, it is what it is."""
    spans = ((-5, 5), (1, 3))
    for point in product(*(range(low, high + 1) for low, high in spans)):
        assert _said_of(Keyed(), op, spans, point) == (True, True)
        assert _said_of(ExactIntegers(), op, spans, point) == (True, False)


def _said_of(
    keyed: Keyed, op: Arithmetic, spans: Sequence[tuple[int, int]], point: Sequence[int]
) -> tuple[bool, bool]:
    """Whether the result may be what the interpreter computes at these operands, and whether it may be anything else."""
    operands = tuple(number(f"n{at}", low, high) for at, (low, high) in enumerate(spans))
    node = values.arithmetic(op, operands, Int(-99, 99))
    expr = Apply(op, tuple(Literal(value, Int(-9, 9)) for value in point), Int(-99, 99))
    right = keyed.equal(keyed.literal(Int(-99, 99), evaluate(expr, {})), node)
    at = [
        keyed.equal(keyed.literal(Int(-9, 9), value), each)
        for value, each in zip(point, operands, strict=True)
    ]
    solver = Solver()
    solver.add(*keyed.ranges, *at)
    may = (solver.check(right), solver.check(smt.negation(right)))
    return may[0] is Answer.SATISFIABLE, may[1] is Answer.SATISFIABLE


def test_the_value_at_a_point_is_what_the_operations_make_of_it() -> None:
    total = values.arithmetic(
        Op.ADD, (N, values.arithmetic(Op.MUL, (M, whole(3)), Int(-99, 99))), Int(-99, 99)
    )
    chosen = values.choice(values.compare(Op.LT, total, whole(4)), total, M)
    for n, m in product(range(-3, 10), range(6)):
        made = n + 3 * m
        assert trial.value_at(chosen, {"n": n, "m": m}) == (made if made < 4 else m)
    part = values.arithmetic(Op.DIV, (N, M), Int(-9, 9))
    assert [trial.value_at(part, {"n": 9, "m": m}) for m in (0, 2)] == [None, 4]


def test_z3_has_no_more_memory_than_it_is_given() -> None:
    given_mb = Limits().memory_mb
    for memory_mb in (given_mb + 1, given_mb):
        Solver(Limits(memory_mb=memory_mb))
        assert z3.get_param("memory_max_size") == str(memory_mb)


def test_a_constant_that_nothing_bounds_has_some_value_in_a_model() -> None:
    solver = Solver()
    assert solver.check() is Answer.SATISFIABLE
    assert isinstance(solver.value(smt.variable("n", KEY), KEY), int)


def test_what_z3_has_of_a_question_that_was_broken_off_is_not_asked_again() -> None:
    """It may end the process, or take for ever to be rid of it."""
    solver = Solver(Limits(steps=1))
    one, other = smt.variable("p", KEY), smt.variable("q", KEY)
    product_ = smt.integer_operation("*", one, other)
    solver.add(smt.equal(product_, smt.literal(KEY, 391), KEY), smt.below(one, other, KEY))
    before = solver._solver
    assert solver.check() is Answer.UNKNOWN
    solver.begins_anew(1_000_000, 0)
    solver.check()
    assert solver._solver is not before


def test_a_question_gets_the_steps_that_are_left_when_it_is_asked() -> None:
    """Also where the solver was asked before, with all of them."""
    solver = Solver()
    assert solver.check() is Answer.SATISFIABLE
    one, other = smt.variable("p", KEY), smt.variable("q", KEY)
    factors = smt.equal(smt.integer_operation("*", one, other), smt.literal(KEY, 391), KEY)
    solver.add(factors, smt.below(smt.literal(KEY, 1), one, KEY), smt.below(one, other, KEY))
    with smt.together(1):
        assert solver.check() is Answer.UNKNOWN
    assert solver.check() is Answer.SATISFIABLE


def test_a_single_of_a_double_is_followed_as_far_as_it_is_rounded() -> None:
    measured = Measured()
    rounded = measured.term(values.arithmetic(Op.TO_SINGLE, (Y,), Single(0.5, 4.0)))
    solver = Solver()
    solver.add(*measured.ranges, smt.equal(measured.term(Y), smt.fraction(1.1), KEY))
    near = [smt.at_most(smt.fraction(end), rounded, KEY) for end in (1.0999, 1.1001)]
    assert solver.check(near[0], smt.negation(near[1])) is Answer.SATISFIABLE
    assert solver.check(smt.negation(near[0])) is solver.check(near[1]) is Answer.UNSATISFIABLE


def test_nodes_that_are_built_alike_have_one_number_and_those_of_other_parts_another() -> None:
    """What nobody computes is any value: one for two products would make them equal."""
    alike, wide = values.Alike(), Int(-99, 99)
    one, again, other = (
        values.arithmetic(Op.MUL, parts, wide) for parts in ((N, M), (N, M), (N, number("k", 0, 5)))
    )
    assert alike.number(one) == alike.number(again) != alike.number(other)
