"""Bounds enclose every value, and boxes are exactly the keys for which a condition holds; what a condition tells is so.

Every condition over small ranges, against trying all inputs. Of what it tells, a condition is built twice: as a node of
`symbolic.values`, which folds and learns, and as the set of inputs at which it holds, by Python's own operators. Bounds learnt must hold
at every one of these inputs.
"""

import math
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from random import Random

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from rcsc.lang.interpret import evaluate, holds
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Op,
    Program,
    Real,
    Scalar,
    Snapshot,
    Test,
    key_bounds,
    key_of,
    real_key,
    value_of_key,
)
from rcsc.lang.operator_table import Comparison
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import Evaluation
from rcsc.proof.symbolic.values import Fact, Node
from tests.support.programs.stages import drawn_program, program_of
from tests.support.strategies import EQUAL, INTS, REALS, conditions, integers_over, reals_over, snapshots_of

# --- bounds and boxes ---


def _parts(expr: Expr) -> Iterator[Expr]:
    if isinstance(expr, Apply):
        for arg in expr.args:
            yield from _parts(arg)
    elif isinstance(expr, Among):
        yield from _parts(expr.subject)
    yield expr


def _condition(declared: str, text: str) -> tuple[Program, Expr]:
    found = drawn_program(f"{declared}assume it : {text}", "RCS304", "RCS309", "RCS311")
    return found, found.assumptions[0].condition


def _enclosed(expr: Expr, snapshot: Snapshot) -> None:
    for part in _parts(expr):
        if not isinstance(part.type, Int | Real):
            continue
        try:
            value = evaluate(part, snapshot)
        except (ZeroDivisionError, OverflowError):
            return
        if not math.isfinite(value):
            return  # refused by a proof obligation of its own
        assert part.type.low <= value <= part.type.high, part


@given(st.data())
@settings(max_examples=80)
def test_bounds_of_integers_enclose_every_value(data: st.DataObject) -> None:
    program, condition = _condition(INTS.declared, f"{data.draw(integers_over())} <= 4")
    _enclosed(condition, data.draw(snapshots_of(program)))


@given(st.data())
@settings(max_examples=80)
def test_bounds_of_reals_enclose_every_value(data: st.DataObject) -> None:
    program, condition = _condition(REALS.declared, f"{data.draw(reals_over())} <= 4.5")
    _enclosed(condition, data.draw(snapshots_of(program)))


def test_bounds_of_small_integers_are_met_where_each_operand_is_read_once() -> None:
    for op in ("+", "-", "*", "/"):
        _, condition = _condition("input a : int -7 .. 9\ninput b : int -2 .. 5\n", f"a {op} b = 0")
        assert isinstance(condition, Apply)
        quotient = condition.args[0]
        pairs = [(a, b) for a in range(-7, 10) for b in range(-2, 6) if op != "/" or b]
        values = [int(evaluate(quotient, {"a": a, "b": b})) for a, b in pairs]
        assert quotient.type == Int(min(values), max(values))


def _test(declared: str, text: str) -> tuple[Program, Test]:
    found = drawn_program(f"{declared}table t {{\n| line | when ||\n| x | {text} ||\n}}", "RCS314", "RCS301")
    test = found.tables[0].lines[0].tests[0]
    if test is None or not test.variables:
        reject()
    assert test is not None
    return found, test


def _exact(program: Program, test: Test, keys: Iterator[int] | range) -> None:
    kind = program.variable(test.variables[0]).type
    assert test.box is not None
    low, high = key_bounds(kind)
    for before, after in zip(test.box, test.box[1:], strict=False):
        assert before[1] + 1 < after[0]
    assert all(low <= first <= last <= high for first, last in test.box)
    for key in keys:
        inside = any(first <= key <= last for first, last in test.box)
        assert inside == holds(test, {test.variables[0]: value_of_key(kind, key)}), key


SMALL = st.integers(-12, 12).map(str)
AFFINE = ("n", "n + 1", "2 * n", "3 - n", "-2 * n + 5", "n - 4 * n", "5")


@given(conditions(AFFINE, SMALL))
@settings(max_examples=60)
def test_box_of_a_small_integer_is_the_condition(text: str) -> None:
    program, test = _test("input n : int -9 .. 11\n", text)
    _exact(program, test, range(-9, 12))


@given(conditions(AFFINE, SMALL, sets=False))
@settings(max_examples=60)
def test_box_of_a_wide_integer_is_the_condition(text: str) -> None:
    program, test = _test("input n : int -9000000000 .. 11000000000\n", text)
    _exact(program, test, [-9000000000, *range(-60, 60), 11000000000])  # type: ignore[arg-type]  # any iterable


@given(conditions(("e",), st.sampled_from("pqrs"), operators=EQUAL))
def test_box_of_an_enumeration_is_the_condition(text: str) -> None:
    program, test = _test("enum f { p, q, r, s }\ninput e : f\n", text)
    _exact(program, test, range(4))


@given(conditions(("f", "(not f)"), st.sampled_from(("true", "false")), operators=EQUAL))
def test_box_of_a_bool_is_the_condition(text: str) -> None:
    program, test = _test("input f : bool\n", text)
    _exact(program, test, range(2))


@given(conditions(("x",), st.sampled_from(("0.0", "-0.0", "0.1", "-1.5", "2.5", "2.0", "5e-324", "9.0"))))
@settings(max_examples=60)
def test_box_of_a_real_is_the_condition(text: str) -> None:
    program, test = _test("input x : real -1.5 .. 2.5\n", text)
    ends = [real_key(one) for one in (-1.5, 0.0, 0.1, 2.0, 2.5)]
    low, high = key_bounds(program.variable("x").type)
    near = [key + d for key in ends for d in (-2, -1, 0, 1, 2)]
    _exact(program, test, iter([key for key in near if low <= key <= high]))


@pytest.mark.parametrize(
    "text", ["10 / n = 2", "n /= 0 and 10 / n > 2", "n mod 3 = 1", "n * n < 50", "real(n) < 2.5"]
)
def test_a_condition_of_another_form_is_tried_on_a_small_leaf(text: str) -> None:
    program, test = _test("input n : int -9 .. 11\n", text)
    if text == "10 / n = 2":
        assert test.box is None  # undefined at 0, which is for the prover
    else:
        _exact(program, test, range(-9, 12))


def test_a_large_enumeration_has_boxes() -> None:
    members = ", ".join(f"m{n}" for n in range(700))
    _, test = _test(f"enum f {{ {members} }}\ninput e : f\n", "e = m3 or e = m699")
    assert test.box == ((3, 3), (699, 699))


def test_a_cell_gives_the_same_box_as_the_condition_under_when() -> None:
    cells = {"> 3": "n > 3", "2 .. 5": "n in 2 .. 5", "in {1, 4, 5}": "n in {1, 4, 5}", "/= 7": "n /= 7"}
    for cell, condition in cells.items():
        found = program_of(
            f"input n : int 0 .. 99\ntable t {{\n| line | n | when ||\n| x | {cell} | {condition} ||\n}}"
        )
        assert isinstance(found, Program)
        one, two = found.tables[0].lines[0].tests
        assert one is not None
        assert two is not None
        assert one.box == two.box


def test_keys_of_reals_are_ranks() -> None:
    assert [real_key(one) for one in (-5e-324, -0.0, 0.0, 5e-324)] == [-1, 0, 0, 1]
    assert key_of(Real(0.0, 1.0), 1.0) == real_key(1.0)


# --- what a condition tells of the values in it ---

NAN, INF = math.nan, math.inf
COMPARE: dict[Comparison, Callable[[float, float], bool]] = {
    Op.EQ: operator.eq, Op.NE: operator.ne, Op.LT: operator.lt, Op.LE: operator.le, Op.GT: operator.gt, Op.GE: operator.ge,
}  # fmt: skip


@dataclass(frozen=True)
class World:
    """Two variables, every input, and what is compared: nodes, each with its value at every input."""

    inputs: tuple[tuple[float, float], ...]
    sides: tuple[tuple[Node, tuple[float, ...]], ...]
    constants: tuple[tuple[Node, tuple[float, ...]], ...]

    @property
    def everywhere(self) -> int:
        """All inputs."""
        return (1 << len(self.inputs)) - 1

    @property
    def ordered(self) -> bool:
        """Whether nothing in it may be no number."""
        return all(math.isfinite(value) for point in self.inputs for value in point)


def world(
    kinds: tuple[Scalar, Scalar], tried: tuple[Sequence[float], Sequence[float]], constants: Sequence[float]
) -> World:
    one, two = values.variable("x", kinds[0]), values.variable("y", kinds[1])
    inputs = tuple(product(*tried))
    sides = [(one, tuple(x for x, _ in inputs)), (two, tuple(y for _, y in inputs))]
    if isinstance(kinds[0], Int):
        total = values.arithmetic(Op.ADD, (one, two), Int(0, 100))
        sides.append((total, tuple(x + y for x, y in inputs)))
    fixed = tuple((values.constant(kinds[0], value), (value,) * len(inputs)) for value in constants)
    return World(inputs, tuple(sides), fixed)


def whole(low: int, high: int) -> tuple[Int, Sequence[int]]:
    return Int(low, high), range(low, high + 1)


def integers(one: tuple[int, int], two: tuple[int, int]) -> World:
    (first, xs), (second, ys) = whole(*one), whole(*two)
    return world((first, second), (xs, ys), (0, 2, 4))


NARROW, ANY, BIG = Real(-1.0, 1.0), Real(-INF, INF), 1.7976931348623157e308
UNIT, ALL = (-1.0, -0.0, 5e-324, 1.0), (-INF, -1.0, 0.0, 1.0, INF, NAN)
WORLDS = {
    "integers": integers((0, 4), (0, 4)),
    "integers that meet": integers((0, 2), (2, 4)),
    "integers apart": integers((0, 1), (3, 4)),
    "integers apart, the greater first": integers((3, 4), (0, 1)),
    "integers that meet, the greater first": integers((2, 4), (1, 2)),
    "one value": integers((2, 2), (0, 4)),
    "the same value": integers((2, 2), (2, 2)),
    "doubles": world((NARROW, NARROW), (UNIT, UNIT), (-1.0, 0.0, 5e-324, 1.0)),
    "doubles that may be no number": world((ANY, ANY), (ALL, ALL), (-1.0, 0.0, BIG)),
    "one that may be no number": world((NARROW, ANY), (UNIT, ALL), (-1.0, 0.0, BIG)),
    "one with an end": world((Real(2.0, INF), NARROW), ((2.0, BIG, INF, NAN), UNIT), (1.0, 2.0, 3.0)),
    "the other with an end": world(
        (NARROW, Real(-INF, -2.0)), (UNIT, (-INF, -BIG, -2.0, NAN)), (-1.0, -2.0, -3.0)
    ),
}
over_worlds = pytest.mark.parametrize("name", WORLDS)

Condition = tuple[Node, int]
"""A node, and the inputs at which it holds, one bit each."""


def compared(
    op: Comparison, left: tuple[Node, tuple[float, ...]], right: tuple[Node, tuple[float, ...]]
) -> Condition:
    holds = sum(COMPARE[op](a, b) << at for at, (a, b) in enumerate(zip(left[1], right[1], strict=True)))
    return values.compare(op, left[0], right[0]), holds


def atoms(here: World) -> list[Condition]:
    """Every comparison of a value with a constant, or with another value, or with itself."""
    pairs = [
        *product(here.sides, here.constants),
        *product(here.constants, here.sides),
        *product(here.sides[:2], here.sides),
    ]
    return [compared(op, left, right) for op in COMPARE for left, right in pairs]


def inverse(here: World, one: Condition) -> Condition:
    return values.negation(one[0]), ~one[1] & here.everywhere


def both(one: Condition, two: Condition) -> Condition:
    return values.both(one[0], two[0]), one[1] & two[1]


def either(one: Condition, two: Condition) -> Condition:
    return values.either(one[0], two[0]), one[1] | two[1]


def pairs(here: World) -> Iterator[Condition]:
    """Any two of the comparisons, joined either way."""
    known = atoms(here)
    for one, two in product(known[::2], known[1::3]):
        yield both(one, two)
        yield either(one, two)


def deeper(here: World, count: int) -> Iterator[Condition]:
    """A sample of conditions of several comparisons."""
    random, known = Random(7), atoms(here)  # noqa: S311 - a sample, not a secret
    for _ in range(count):
        made = random.choice(known)
        for _ in range(random.randint(2, 4)):
            other = random.choice(known)
            if random.random() < 0.3:
                other = both(other, random.choice(known))
            made = random.choice((both, either))(made, other)
            if random.random() < 0.4:
                made = inverse(here, made)
        yield made


def within(fact: Fact, value: float) -> bool:
    """Whether the bounds allow the value; where one is infinite, it may be no number."""
    return fact[0] <= value <= fact[1] or (math.isnan(value) and math.inf in map(abs, fact))


def check(here: World, condition: Condition) -> None:
    """Folding is right, and so is what is learnt of the condition and of its opposite."""
    node, holding = condition
    if node.known:
        assert holding == (here.everywhere if node.low else 0), node
        return
    assert (node.low, node.high) == (0, 1)
    for yes, inputs in ((True, holding), (False, ~holding & here.everywhere)):
        facts: dict[Node, Fact] = {}
        values.learn(node, facts, holds=yes)
        for side, found in here.sides:
            fact = facts.get(side)
            wrong = (
                []
                if fact is None
                else [v for at, v in enumerate(found) if inputs >> at & 1 and not within(fact, v)]
            )
            assert not wrong, (node, yes, fact)


@over_worlds
def test_a_comparison_tells_nothing_false(name: str) -> None:
    here = WORLDS[name]
    for condition in atoms(here):
        check(here, condition)
        check(here, inverse(here, condition))


@over_worlds
def test_a_comparison_that_bounds_decide_is_decided(name: str) -> None:
    here = WORLDS[name]
    (one, two), constants = here.sides[:2], here.constants
    for op, left, right in [
        (op, *pair) for op in COMPARE for pair in ((one, two), *product((one, two), constants))
    ]:
        node, holding = compared(op, left, right)
        if here.ordered:
            assert node.known == (holding in {0, here.everywhere})
    itself = values.compare(Op.EQ, one[0], one[0])
    assert itself.known == one[0].ordered


@over_worlds
def test_two_conditions_tell_nothing_false(name: str) -> None:
    for condition in pairs(WORLDS[name]):
        check(WORLDS[name], condition)


@over_worlds
def test_several_conditions_tell_nothing_false(name: str) -> None:
    for condition in deeper(WORLDS[name], 500):
        check(WORLDS[name], condition)


def test_something_is_told() -> None:
    """So that a test of what is learnt cannot pass where nothing is."""
    [x, _, total] = [side for side, _ in WORLDS["integers"].sides]
    two, four = (values.constant(x.kind, value) for value in (2, 4))
    told = [
        (values.compare(Op.LT, x, two), (0, 1)), (values.compare(Op.GE, x, two), (2, 4)), (values.compare(Op.EQ, x, two), (2, 2)),
        (values.compare(Op.NE, x, four), (0, 3)),
        (values.either(values.compare(Op.EQ, x, two), values.compare(Op.GT, x, two)), (2, 4)),
        (values.either(values.compare(Op.LT, x, two), values.compare(Op.EQ, x, two)), (0, 2)),
    ]  # fmt: skip
    for condition, fact in told:
        facts: dict[Node, Fact] = {}
        values.learn(condition, facts)
        assert facts[x] == fact
    facts = {}
    values.learn(values.compare(Op.LE, total, two), facts)
    assert facts[total] == (0, 2)


@pytest.mark.parametrize("seed", range(4))
def test_a_path_narrows_only_to_values_that_come_that_far(seed: int) -> None:
    """Conditions nested as on a path: each leaf's bounds there hold at every input that takes it."""
    here, random = WORLDS["integers"], Random(seed)  # noqa: S311 - a sample, not a secret
    known = list(deeper(here, 60))
    for _ in range(150):
        taken = [(random.choice(known), random.random() < 0.6) for _ in range(random.randint(1, 3))]
        one, two = here.sides[0][0], here.sides[1][0]
        run = Evaluation({}, {"x": one.kind, "y": two.kind}, {"x": one, "y": two})
        inputs, steps = here.everywhere, []
        for (node, holding), yes in taken:
            inputs &= holding if yes else ~holding
            steps.append(run.where(node, holds=yes))
            steps[-1].__enter__()
        for name, (_, found) in zip(("x", "y"), here.sides, strict=False):
            leaf = run.leaf(name)
            assert all(leaf.low <= v <= leaf.high for at, v in enumerate(found) if inputs >> at & 1)
        if run.path.known:
            assert run.path.low or not inputs


@over_worlds
def test_choices_and_ranges_enclose_what_they_can_be(name: str) -> None:
    here = WORLDS[name]
    for condition in list(deeper(here, 100)):
        (one, first), (two, second) = here.sides[:2]
        chosen = values.choice(condition[0], one, two)
        for at, (a, b) in enumerate(zip(first, second, strict=True)):
            assert within((chosen.low, chosen.high), a if condition[1] >> at & 1 else b)
        if not condition[0].known and one.kind == two.kind:
            assert (chosen.low, chosen.high) == (one.low, one.high)
        left, right = here.constants[0][0], here.constants[1][0]
        fixed = values.choice(condition[0], left, right)
        if condition[0].known:
            assert fixed is (left if condition[0].low else right)
        else:
            assert (fixed.low, fixed.high) == tuple(sorted((left.low, right.low)))
        assert values.choice(condition[0], left, left) is left
        assert values.choice(condition[0], one, one) is one
    members = [node.low for node, _ in here.constants]
    for side, found in here.sides[:2]:
        low, high = sorted(members[:2])
        inside, among = values.inside(side, low, high), values.among(side, members[:2])
        check(here, (inside, sum((low <= v <= high) << at for at, v in enumerate(found))))
        check(here, (among, sum((v in members[:2]) << at for at, v in enumerate(found))))


def test_booleans_tell_what_they_are() -> None:
    one, two = values.variable("p", Bool()), values.variable("q", Bool())
    for held, (node, fact) in product((True, False), ((one, 1), (values.negation(one), 0))):
        facts: dict[Node, Fact] = {}
        values.learn(node, facts, holds=held)
        assert facts == {one: (fact, fact) if held else (1 - fact, 1 - fact)}
    facts = {}
    values.learn(values.either(one, two), facts)
    assert facts == {}


@pytest.mark.parametrize(
    ("bounds", "left"),
    [((2, 9), (2, 4)), ((-1, 3), (0, 3)), ((1, 3), (1, 3)), ((-1, 9), (0, 4)), ((3, 3), (3, 3)), ((5, 9), (0, 4)), ((4, 9), (4, 4))],
)  # fmt: skip
def test_narrowing_meets_bounds(bounds: tuple[int, int], left: tuple[int, int]) -> None:
    """What cannot be leaves the node as it was: nothing comes there."""
    node = values.variable("x", Int(0, 4))
    narrowed = values.narrowed(node, *bounds)
    assert (narrowed.low, narrowed.high) == left
    assert (narrowed is node) == (left == (0, 4))
    again = values.narrowed(narrowed, left[0], max(left[0], left[1] - 1))
    assert (again.low, again.high) == (left[0], max(left[0], left[1] - 1))
    assert again.known or values.root(again) is node
