"""The reference meaning: expressions, statements, and what a cycle does in which order."""

import math
import sys
from collections import Counter
from random import Random
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.lang.interpret import (
    Fault,
    Outcome,
    admit,
    call,
    cycle,
    evaluate,
    initial,
    matching_lines,
    run_table,
    unfit,
)
from rcsc.lang.model import Apply, Program, Value
from rcsc.lang.operator_table import divide
from tests import differential
from tests.support.programs.stages import program_of
from tests.support.programs.texts import edited


def value_of(declared: str, text: str, **snapshot: Value) -> Value:
    made = program_of(f"{declared}\nassume it : ({text}) = ({text})")
    condition = made.assumptions[0].condition
    return evaluate(condition.args[0], snapshot)  # type: ignore[union-attr]  # a comparison


# --- expressions ---


WIDE = "int -9223372036854775808 .. 9223372036854775807"
DIVIDED = program_of(f"input a : {WIDE}\ninput b : {WIDE}\nassume d : a / b = 0\nassume m : a mod b = 0")


@given(st.integers(-(2**63), 2**63 - 1), st.integers(-(2**63), 2**63 - 1).filter(bool))
def test_quotients_round_toward_zero_and_remainders_have_the_sign_of_the_dividend(a: int, b: int) -> None:
    sides = [
        assumption.condition.args[0]
        for assumption in DIVIDED.assumptions
        if isinstance(assumption.condition, Apply)
    ]
    quotient, rest = (int(evaluate(side, {"a": a, "b": b})) for side in sides)
    assert quotient == divide(a, b)
    assert quotient * b + rest == a
    assert abs(rest) < abs(b)
    assert rest == 0 or (rest < 0) == (a < 0)


@pytest.mark.parametrize(
    ("a", "b", "quotient"), [(7, 2, 3), (-7, 2, -3), (7, -2, -3), (-7, -2, 3), (-1, 2, 0)]
)
def test_quotients_as_in_c(a: int, b: int, quotient: int) -> None:
    assert divide(a, b) == quotient


def test_reals_are_ieee_doubles() -> None:
    declared = "input x : real -9.0 .. 9.0\ninput y : real -9.0 .. 9.0"
    assert value_of(declared, "x + y", x=0.1, y=0.2) == 0.30000000000000004
    assert value_of(declared, "x / y", x=1.0, y=3.0) == 1 / 3
    assert value_of(declared, "int(x)", x=-2.9) == -2
    assert value_of(declared, "max(x, y) - min(x, y)", x=2.0, y=-1.0) == 3.0


def test_the_right_operand_is_looked_at_only_where_the_left_does_not_decide() -> None:
    made = program_of(
        "input n : int 0 .. 9\nassume a : n /= 0 and 9 / n > 2\nassume o : n = 0 or 9 / n > 2\n"
        "assume i : n /= 0 implies 9 / n > 2"
    )
    values = [[evaluate(a.condition, {"n": n}) for a in made.assumptions] for n in (0, 1, 9)]
    assert values == [[False, True, True], [True, True, True], [False, False, False]]


def test_an_index_outside_the_array_is_no_value() -> None:
    made = program_of("input a : array[2] of bool\ninput n : int 0 .. 9\nassume it : a[n]")
    condition = made.assumptions[0].condition
    assert evaluate(condition, {"a[0]": False, "a[1]": True, "n": 1}) is True
    with pytest.raises(IndexError):
        evaluate(condition, {"a[0]": False, "a[1]": True, "n": 2})


# --- statements ---


def after(text: str, procedure: str = "p", *args: Value, **start: Value) -> dict[str, Value]:
    made = program_of(text)
    snapshot = {**initial(made), **start}
    call(made, procedure, list(args), snapshot)
    return snapshot


def test_statements_run_in_order() -> None:
    text = """
    enum e { red, green, blue }
    state s : e
    state n : int 0 .. 99
    state a : array[4] of int 0 .. 99
    procedure p(by : int 0 .. 9) {
      local k : int 0 .. 99 := by
      for i in 1 .. 3 { a[i] := k  k := k + i }
      for i in 3 .. 1 { k := 0 }
      case s { red, blue { n := k } else { n := 1 } }
      if n > 10 { s := green } else if n = 1 { s := red } else { s := blue }
      q(n)
    }
    procedure q(by : int 0 .. 99) { n := by + 1 }
    """
    assert after(text, "p", 4) == {"s": 2, "n": 11, "a[0]": 0, "a[1]": 4, "a[2]": 5, "a[3]": 7}
    assert after(text, "p", 9) == {"s": 1, "n": 16, "a[0]": 0, "a[1]": 9, "a[2]": 10, "a[3]": 12}
    assert after(text, "p", 9, s=1) == {"s": 0, "n": 2, "a[0]": 0, "a[1]": 9, "a[2]": 10, "a[3]": 12}


def test_a_case_may_be_about_an_argument() -> None:
    text = "state n : int 0 .. 9\nprocedure p(k : int 0 .. 9) { case k { 1, 2 { n := 3 } else { n := 4 } } }"
    assert [after(text, "p", k)["n"] for k in (1, 2, 5)] == [3, 3, 4]


def test_a_local_begins_without_a_value_each_time_that_it_is_declared() -> None:
    text = (
        "state n : int 0 .. 9\nprocedure p(k : int 0 .. 9) "
        "{ for i in 1 .. 2 { local m : int 0 .. 9  if i <= k { m := i }  n := m } }"
    )
    assert after(text, "p", 2)["n"] == 2
    with pytest.raises(KeyError):
        after(text, "p", 1)


def test_arguments_are_values() -> None:
    text = (
        "state n : int 0 .. 9\nprocedure p { n := 1 q(n) }\nprocedure q(k : int 0 .. 9) { n := 5 n := n - k }"
    )
    assert after(text)["n"] == 4


def test_an_argument_may_be_about_an_argument() -> None:
    text = (
        "state n : int 0 .. 10\nprocedure p(k : int 0 .. 9) { q(k + 1) }\n"
        "procedure q(k : int 0 .. 10) { n := k }"
    )
    assert after(text, "p", 4)["n"] == 5


def test_zero_has_one_sign_where_it_is_kept() -> None:
    text = (
        "state x : real -1.0 .. 1.0 = 0.5\nstate y : real -1.0 .. 1.0\nprocedure p { y := -(x - x) x := -y }"
    )
    kept = after(text)
    assert [math.copysign(1, float(kept[name])) for name in "xy"] == [1, 1]


def test_initial_values_are_as_declared_or_nearest_to_zero() -> None:
    text = (
        "enum e { a, b }\nstate s : e = b\nstate f : bool\ninput n : int -3 .. 3\nstate x : real -2.5 .. -1.0"
    )
    assert initial(program_of(text)) == {"s": 1, "f": False, "n": 0, "x": -1.0}


# --- what comes from outside ---

READINGS = """
input n : int 0 .. 9 clamp
input m : int 0 .. 9
input x : real -1.0 .. 1.0 clamp
input y : real -1.0 .. 1.0 reject
"""
GOOD: dict[str, Value] = {"n": 1, "m": 2, "x": 0.5, "y": 0.5}


@pytest.mark.parametrize(
    ("given_", "admitted"),
    [
        ({}, GOOD),
        ({"n": 10}, {**GOOD, "n": 9}),
        ({"n": -(10**30)}, {**GOOD, "n": 0}),
        ({"m": 10}, "m"),
        ({"m": -1, "y": 9.0}, "m"),
        ({"x": math.inf}, {**GOOD, "x": 1.0}),
        ({"x": math.nan}, "x"),
        ({"y": math.nextafter(1.0, 2.0)}, "y"),
        ({"y": math.nan}, "y"),
        ({"n": 10, "y": -math.inf}, "y"),
    ],
)
def test_inputs_are_admitted(given_: dict[str, Value], admitted: dict[str, Value] | str) -> None:
    assert admit(program_of(READINGS), {**GOOD, **given_}) == admitted


def test_minus_zero_is_admitted_as_zero() -> None:
    admitted = admit(program_of(READINGS), {**GOOD, "y": -0.0})
    assert isinstance(admitted, dict)
    assert math.copysign(1, admitted["y"]) == 1


# --- tables and cycles ---

LEVEL = """
input go : int 0 .. 9 clamp
input k : int 0 .. 2
state a : int 0 .. 9 deferred until go = 9
state b : int 0 .. 9 deferred until a = 0
state seen : int 0 .. 9
state log : int 0 .. 999999
output out : int 0 .. 9
assume calm monitored : seen < 5
assume quiet : seen < 1
procedure before { seen := go  log := log * 10 + 1 }
procedure act { log := log * 10 + 2 }
procedure behind { log := log * 10 + 4 }
procedure defer { next a := 3  next b := 4 }
table t assuming calm, quiet {
  | line | seen | k || procedures                       | out |
  | low  | < 3  | 0 || act; defer; log := log * 10 + 3  | a   |
  | mid  | < 6  | 0 || act                              | 1   |
  | high | > 8  | 0 || act                              |     |
  | rest | DEFAULT | || act                             | 9   |
}
table u {
  | line | k  || out |
  | one  | >= 2 || 7 |
}
level l { preprocess before table t postprocess behind }
level m { preprocess before table by k { 0 : t 1 : t 2 : u } postprocess behind }
"""


def run(level: str = "l", begin: dict[str, Value] | None = None, **start: Value) -> Outcome:
    made = program_of(LEVEL)
    chosen = next(one for one in made.levels if one.name == level)
    return cycle(made, chosen, {**initial(made), **(begin or {}), **start})


def test_a_cycle_senses_decides_and_acts_in_order() -> None:
    done = run(go=3)
    assert (done.fault, done.line, done.line_index) == (Fault.OK, "mid", 1)
    assert (done.snapshot["log"], done.snapshot["seen"], done.snapshot["out"]) == (124, 3, 1)


def test_actions_run_from_left_to_right_and_columns_assign_in_their_place() -> None:
    made = program_of(LEVEL)
    table = made.tables[0]
    done = run_table(made, table, {**initial(made), "seen": 9, "log": 5})
    assert (done.line, done.snapshot["log"]) == ("high", 52)
    assert matching_lines(table, {**initial(made), "seen": 2}) == ["low", "mid"]


def test_no_line_and_several_lines_end_the_cycle_before_any_action() -> None:
    done = run(go=2)
    assert (done.fault, done.line, done.line_index) == (Fault.SEVERAL_LINES, None, -1)
    assert (done.snapshot["log"], done.snapshot["seen"]) == (1, 2)  # preprocess stays, postprocess is not run
    made = program_of(LEVEL)
    done = run_table(made, made.tables[1], initial(made))
    assert (done.fault, done.line) == (Fault.NO_LINE, None)


def test_default_runs_where_no_other_line_matches() -> None:
    done = run(go=7)
    assert (done.fault, done.line, done.line_index, done.snapshot["out"]) == (Fault.OK, "rest", 3, 9)


def test_a_refused_input_leaves_all_as_it_was() -> None:
    start: dict[str, Value] = {"k": 3, "go": 99, "log": 7}
    done = run(go=99, k=3, log=7)
    assert (done.fault, done.fault_at, done.line_index) == (Fault.ADMIT, "k", -1)
    assert done.snapshot == {**initial(program_of(LEVEL)), **start}


def test_clamped_inputs_are_what_the_cycle_sees() -> None:
    assert run(go=99).snapshot["go"] == 9
    assert run(go=99).line == "high"


def test_deferred_variables_take_their_next_values_at_once() -> None:
    done = run(begin={"go": 9, "a": 0, "b": 1, "a.next": 5, "b.next": 6})
    assert (done.snapshot["a"], done.snapshot["b"]) == (5, 6)  # `a = 0` is asked before a changes
    done = run(begin={"go": 9, "a": 1, "b": 1, "a.next": 0, "b.next": 6})
    assert (done.snapshot["a"], done.snapshot["b"]) == (0, 1)
    done = run(begin={"go": 99, "a": 1, "a.next": 8})
    assert done.snapshot["a"] == 8  # asked of what was admitted


def test_next_is_kept_for_a_later_cycle() -> None:
    text = (
        "input ack : bool\nstate a : int 0 .. 9 deferred until ack\nprocedure p { next a := a + 1 }\n"
        "table t {\n| line | ack || procedures |\n| x | false || p |\n| y | true || p |\n}"
    )
    made = program_of(text)
    first = run_table(made, made.tables[0], initial(made)).snapshot
    assert (first["a"], first["a.next"]) == (0, 1)
    second = run_table(made, made.tables[0], {**first, "ack": True}).snapshot
    assert (second["a"], second["a.next"]) == (1, 2)


def test_monitored_assumptions_are_told_and_stop_nothing() -> None:
    assert run(go=7).failed_assumptions == ("calm",)
    assert run(go=3).failed_assumptions == ()
    assert run("m", go=7, k=2).failed_assumptions == ()  # table u does not rely on it


def test_the_selector_chooses_the_table() -> None:
    done = run("m", go=3, k=2)
    assert (done.line, done.snapshot["out"]) == ("one", 7)
    assert run("m", go=3, k=1).line == "rest"


EXTERN = """
input a : int 0 .. 9
state b : int 0 .. 9
state c : int 0 .. 9
output done : bool
extern procedure look(k : int 0 .. 9) reads b, a writes c, b python "rcsc_case_extern:look" c "look"
table t {
  | line | a    || procedures | done |
  | x    | >= 0 || look(2)    | true |
}
"""


@pytest.fixture
def _extern(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("rcsc_case_extern")
    module.look = lambda a, b, k: (a + b + k, 10 * a)  # type: ignore[attr-defined]  # made here
    monkeypatch.setitem(sys.modules, "rcsc_case_extern", module)


@pytest.mark.usefixtures("_extern")
def test_extern_procedures_take_reads_and_arguments_and_give_writes_in_declared_order() -> None:
    made = program_of(EXTERN)
    done = run_table(made, made.tables[0], {**initial(made), "a": 0, "b": 3})
    assert (done.fault, done.snapshot) == (Fault.OK, {"a": 0, "b": 5, "c": 0, "done": True})


@pytest.mark.usefixtures("_extern")
def test_what_an_extern_procedure_gives_is_admitted() -> None:
    made = program_of(EXTERN)
    done = run_table(made, made.tables[0], {**initial(made), "a": 1, "b": 3})
    assert (done.fault, done.fault_at, done.line) == (Fault.EXTERN, "c", "x")
    assert done.snapshot["done"] is False


@pytest.mark.usefixtures("_extern")
def test_of_several_tables_only_the_last_one_s_line_is_told_though_what_an_earlier_one_asks_is_refused() -> (
    None
):
    more = "table u {\n  | line | a    ||\n  | y    | >= 0 ||\n}\nlevel l {\n  period 40 [ms]\n  table t\n  table u\n}\n"
    made = program_of(EXTERN + more)
    done = cycle(made, made.levels[0], {**initial(made), "a": 1, "b": 3})
    assert (done.fault, done.fault_at, done.line, done.line_index) == (Fault.EXTERN, "c", None, -1)


def test_cycles_of_drawn_programs_are_those_of_an_evaluator_of_its_own() -> None:
    ended: Counter[int] = Counter()
    for number in range(60):
        rng = Random(f"interpreted {number}")  # noqa: S311  # programs to try
        drawn = differential.Maker(rng).draw()
        made = differential.modelled(drawn, f"p{number}")
        if not isinstance(made, Program):
            continue
        held = {leaf.name: (int(leaf.kind.low) - 1, int(leaf.kind.high) + 1) for leaf in drawn.leaves()}
        state, model = differential.begun(drawn), dict(initial(made))
        for _ in range(8):
            inputs = differential.readings(drawn, held, rng)
            right, state = differential.evaluated(drawn, {**state, **inputs})
            found, model = differential.interpreted(drawn, made, {**model, **inputs})
            assert found == right, (inputs, "\n".join(drawn.text))
            ended[right.fault] += 1
    assert all(ended[fault] > 10 for fault in (0, 1, 2, 3, 5)), ended


REFUSED = edited(
    EXTERN,
    ("table t {", "assume early monitored : a < 5\nprocedure ask { look(1) }\ntable t assuming early {"),
)


@pytest.mark.usefixtures("_extern")
@pytest.mark.parametrize(
    ("before", "does", "after", "line", "failed"),
    [
        ("preprocess ask", "", "", -1, ()),
        ("", "look(2)", "", 0, ("early",)),
        ("", "", "postprocess ask", 0, ("early",)),
    ],
)
def test_a_cycle_that_an_extern_stops_tells_how_far_it_came(
    before: str, does: str, after: str, line: int, failed: tuple[str, ...]
) -> None:
    text = edited(REFUSED, ("|| look(2) ", f"|| {does} "))
    made = program_of(f"{text}level l {{ period 10 [ms] {before} table t {after} }}")
    out = cycle(made, made.levels[0], dict(initial(made)) | {"a": 9, "b": 9})  # which sum is no value of b
    assert (out.fault, out.fault_at, out.line_index, out.failed_assumptions) == (
        Fault.EXTERN,
        "b",
        line,
        failed,
    )
    assert (out.line is None) == (line < 0)


UNFIT = program_of(
    "input i : int 0 .. 3\nstate s : int 1 .. 3\nstate r : real 0.0 .. 1.0\noutput b : bool\n"
    "invariant low : s <= 2\ninvariant both : s = 1 or b\n"
)


@pytest.mark.parametrize(
    ("given", "first"),
    [
        ({}, ""), ({"i": 9}, ""), ({"s": 0}, "s"), ({"s": 4}, "s"), ({"s": 1.0}, "s"), ({"s": 3, "b": True}, "low"),
        ({"s": 3}, "low"), ({"s": 2}, "both"), ({"s": 2, "b": True}, ""), ({"r": 1}, ""), ({"r": 1.0}, ""), ({"r": 1.5}, "r"),
        ({"r": -0.5}, "r"), ({"r": math.nan}, "r"), ({"r": -0.5, "s": 0}, "s"), ({"b": 2}, "b"), ({"b": 2, "s": 3}, "b"),
    ],
)  # fmt: skip
def test_a_state_that_no_cycle_may_begin_with_tells_what_is_wrong_first(
    given: dict[str, Value], first: str
) -> None:
    assert unfit(UNFIT, {**initial(UNFIT), **given}) == first


STAGES = """input a : int 0 .. 2
state seen : int 0 .. 2
output o : bool
table first {
  | line | a   || seen |
  |------|-----||------|
  | low  | < 1 || 0    |
  | high | > 1 || 2    |
}
table second {
  | line | seen || o     |
  |------|------||-------|
  | none | 0    || false |
  | some | > 1  || true  |
}
level both {
  table first
  table second
}
"""


@pytest.mark.parametrize(("a", "seen", "where"), [(1, 0, "first"), (0, 0, ""), (2, 0, "")])
def test_a_fault_of_an_earlier_table_names_it(a: int, seen: int, where: str) -> None:
    program = program_of(STAGES)
    out = cycle(program, program.levels[0], {**initial(program), "seen": seen, "a": a})
    assert (out.fault, out.fault_at) == (Fault.NO_LINE if where else Fault.OK, where)


def test_a_fault_of_the_last_table_names_none() -> None:
    program = program_of(STAGES.replace("| some | > 1  |", "| some | 1    |"))
    out = cycle(program, program.levels[0], {**initial(program), "a": 2})
    assert (out.fault, out.fault_at) == (Fault.NO_LINE, "")
