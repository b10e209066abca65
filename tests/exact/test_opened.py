"""Nodes that tell nothing of reals: what they may be includes all that the real ones are; short runs in which something never comes."""

from itertools import product

from rcsc.compose.contract.obligations import obligations
from rcsc.compose.exact.bounded import looked, looked_without
from rcsc.compose.exact.circuit import circuit
from rcsc.lang.model import Bool, Int, Real
from rcsc.lang.operator_table import Op
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.opened import Opened, decided_by_reals
from rcsc.proof.symbolic.trial import value_at
from rcsc.proof.symbolic.values import Node, Shape, parts_first
from tests.support.programs.systems import alone

SPEED, COUNT, ON = (
    values.variable(*one) for one in (("speed", Real(0.0, 9.0)), ("count", Int(0, 3)), ("on", Bool()))
)


def _fast() -> Node:
    return values.compare(Op.LT, values.constant(SPEED.kind, 5.0), SPEED)


def _condition() -> Node:
    """Fast and on, or counted to the end: with a comparison of reals that stands there twice, built anew."""
    full = values.equal(COUNT, values.constant(COUNT.kind, 3))
    again = values.both(values.negation(_fast()), full)
    return values.either(values.both(_fast(), ON), again)


def test_what_reals_decide_is_open_and_alike_where_it_is_built_alike() -> None:
    opened = Opened(" taken").node(_condition())
    assert not any(decided_by_reals(part) or isinstance(part.kind, Real) for part in parts_first(opened))
    read = values.variables([opened])
    assert len(read) == 3
    assert {"count", "on"} < read.keys()


def test_nothing_that_may_be_is_left_out() -> None:
    condition = _condition()
    opened = Opened().node(condition)
    [name] = values.variables([opened]).keys() - {"count", "on"}
    for speed, count, on in product((0.0, 5.0, 5.5), range(4), (False, True)):
        point = {"count": count, "on": on}
        is_so = value_at(condition, {**point, "speed": speed})
        assert value_at(opened, {**point, name: speed > 5.0}) == is_so


def test_an_integer_made_of_a_real_is_open_within_its_bounds() -> None:
    whole = values.arithmetic(Op.TO_INT, (SPEED,), Int(0, 9))
    opened = Opened().node(values.equal(whole, values.constant(whole.kind, 4)))
    [variable] = values.variables([opened]).values()
    assert (variable.op, variable.kind, variable.low, variable.high) == (Shape.VARIABLE, whole.kind, 0, 9)


KICKED = """\
input kicked : bool
input pushed : bool
state moved : int 0 .. 3
property still : moved < 3
table t {
| line | kicked | pushed || moved |
|---|---|---||---|
| kick | true | || 3 |
| push | false | true || min(moved + 1, 3) |
| rest | false | false || |
}
level solo { period 40 [ms] table t }
"""


def test_runs_in_which_something_never_comes_are_found_in_the_same_search() -> None:
    ts = alone(KICKED)
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    wanted = [one for one in obligations(ts, step) if one.name == "still"]
    made = circuit(ts, firsts, step, wanted)
    kicks = [name for name in made.given if name.startswith("kicked")]
    pushes = [name for name in made.given if name.startswith("pushed")]
    found = looked_without(made, 8, ((), kicks, [*kicks, *pushes]))
    key = wanted[0].key
    assert found[0].runs.keys() == found[1].runs.keys() == {key}
    assert [len(each.runs[key].given) for each in found[:2]] == [1, 3]
    assert not any(one.get("kicked taken") for one in found[1].runs[key].given)
    assert (found[2].runs, found[2].cycles) == ({}, 8)
    assert looked(made, 8).runs[key] == found[0].runs[key]
