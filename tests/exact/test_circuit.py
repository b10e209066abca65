"""Parts of the circuit by themselves: keys of words, the points of what the environment gives, pairs of lines, what is left open."""

from itertools import product

import pytest

from rcsc.compose.contract.obligations import obligations, pairs
from rcsc.compose.exact import explicit
from rcsc.compose.exact.circuit import circuit, key_of_word, points_of
from rcsc.compose.exact.unrolled import Unrolled
from rcsc.lang.model import Bool, Enum, Int, Real, Scalar, key_bounds, key_of
from rcsc.lang.operator_table import Comparison, Op
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import FALSE, TRUE
from tests.support.programs.systems import alone


def test_a_word_has_the_key_of_twos_complement() -> None:
    word = (2, 3, 4)
    for bits in product((False, True), repeat=3):
        key = key_of_word(Int(-4, 3), word, dict(zip(word, bits, strict=True)))
        assert key == bits[0] + 2 * bits[1] - 4 * bits[2]
    assert key_of_word(Int(0, 3), (TRUE, -3, FALSE), {3: False}) == 3
    assert key_of_word(Int(0, 3), (2, 3, FALSE), {}) == 0
    assert [key_of_word(Bool(), (-2,), {2: value}) for value in (False, True)] == [1, 0]


def points(kind: Scalar, *compared: tuple[Comparison, float], added: bool = False) -> tuple[int, ...]:
    """The points of a variable that is compared with constants, and added to another or not."""
    read = values.variable("x", kind)
    nodes = [values.compare(op, read, values.constant(kind, value)) for op, value in compared]
    if added:
        other = values.variable("y", Int(0, 9))
        total = values.arithmetic(Op.ADD, (read, other), Int(-1000, 1000))
        nodes.append(values.compare(Op.LT, total, values.constant(Int(-1000, 1000), 5)))
    return points_of(nodes)["x"]


def test_between_constants_one_value_stands_for_all() -> None:
    assert points(Int(0, 100), (Op.LT, 5), (Op.EQ, 7)) == (0, 5, 6, 7, 8)
    assert points(Int(0, 100), (Op.EQ, 100)) == (0, 100)
    assert points(Bool(), (Op.EQ, True)) == (0, 1)
    colour = Enum("colour", ("red", "green", "blue"))
    assert points(colour, (Op.EQ, 1)) == (0, 1, 2)
    real = Real(-1.0, 1.0)
    half = key_of(real, 0.5)
    assert points(real, (Op.LE, 0.5)) == (key_bounds(real)[0], half, half + 1)


@pytest.mark.parametrize(
    ("low", "high", "listed"), [(0, 63, True), (0, 64, False), (-40, 40, False), (-3, 3, True)]
)
def test_what_is_added_has_every_value_or_none(low: int, high: int, listed: bool) -> None:
    assert points(Int(low, high), (Op.LT, 2), added=True) == (tuple(range(low, high + 1)) if listed else ())


OVERLAP = """\
input a : bool
input b : bool
output o : bool
table t {
| line | a | b || o |
|---|---|---||---|
| first | true | || true |
| second | | true || false |
| rest | false | false || false |
}
level solo { period 40 [ms] table t }
"""


def test_pairs_of_lines_are_obligations_of_first_cycles_too() -> None:
    ts = alone(OVERLAP)
    step = ts.cycle(ts.havoc())
    [overlap] = pairs(step)  # the others exclude each other by their cells
    assert overlap.lines == ("first", "second")
    broken = explicit.explored(circuit(ts, tuple(ts.firsts().values()), step, [overlap])).runs
    assert {key: len(run.given) for key, run in broken.items()} == {overlap.key: 1}


REALS = """\
input speed : real 0.0 .. 10.0
state way : real 0.0 .. 100.0
module run reads speed, way writes way { way := min(way + speed * speed, 100.0) }
table t {
| line | way ||
|---|---||
| any | ||
}
property short : way <= 50.0
level solo { period 40 [ms] preprocess run table t }
"""


def test_arithmetic_of_reals_is_open_and_named() -> None:
    ts = alone(REALS)
    step = ts.cycle(ts.havoc())
    made = circuit(ts, tuple(ts.firsts().values()), step, obligations(ts, step))
    assert any("`*` of real" in one for one in made.opened), made.opened
    assert all(" of real" in one for one in made.opened)


def test_the_difference_of_two_numbers_is_taken_round() -> None:
    ts = alone(OVERLAP)
    step = ts.cycle(ts.havoc())
    run = Unrolled(circuit(ts, (), step, pairs(step)), None)
    for one, other in product(range(8), repeat=2):
        a, b = ([TRUE if number >> at & 1 else FALSE for at in range(3)] for number in (one, other))
        difference = [TRUE if (one - other) >> at & 1 else FALSE for at in range(3)]
        assert run.difference(a, b) == tuple(difference)


def test_what_is_narrowed_is_told_apart_by_the_same_constants() -> None:
    """Where a cycle knows that a value lies between two others it still looks at the same variable."""
    kind = Int(0, 100)
    read = values.variable("x", kind)
    nodes = [values.compare(Op.LT, values.narrowed(read, 2, 90), values.constant(kind, 5))]
    assert points_of(nodes)["x"] == points(kind, (Op.LT, 5))


COUNTS = """\
input a : bool
state n : int 0 .. 3
module count reads a, n writes n { n := min(n + int(a), 3) }
table t {
| line | n ||
|---|---||
| any | ||
}
property few : n < 3
level solo { period 40 [ms] preprocess count table t }
"""


def test_a_truth_is_a_number_of_one_bit() -> None:
    ts = alone(COUNTS)
    step = ts.cycle(ts.havoc())
    made = circuit(
        ts, tuple(ts.firsts().values()), step, [one for one in obligations(ts, step) if one.name == "few"]
    )
    assert made.opened == ()
    [run] = explicit.explored(made).runs.values()
    assert len(run.given) == 3
