"""Conditions about earlier cycles: `for 2 [s]`, `was`, events; against evaluators that keep every cycle, or whole states.

In cells, headings, assumptions, procedures and properties; and states that the compiler adds for them, in two versions of a program.
"""

import re
from collections.abc import Callable
from functools import cache
from itertools import pairwise, product
from random import Random
from typing import Any

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces, usual_length
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.lang.expressions.previous import AT_ONCE, OF_A_VARIABLE
from rcsc.lang.hidden import fed_with, matched
from rcsc.lang.interpret import Fault, Outcome, cycle, evaluate, initial, run_table
from rcsc.lang.model import Program, Value
from rcsc.lang.restart import Fixed, SameAs
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.spell import spell_expr
from rcsc.proof.relation.same import Same, compare
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.views.diff.compare import compare as versions
from tests.support.programs.examples import LASTING, LOOKING_BACK
from tests.support.programs.stages import BOXES, codes, program_of, refused, reported
from tests.support.programs.systems import LITTLE, alone
from tests.support.programs.texts import edited

# --- `c for 2 [s]`, against an evaluator that keeps every cycle ---

TEXT = LASTING
PROGRAM = program_of(TEXT)
Cycle = dict[str, Value]


def lasted(past: list[Cycle], now: Cycle, cycles: int, holds: str) -> bool:
    """Whether the Python condition holds now, and held after each of the last so many cycles."""
    before = past[len(past) - cycles :] if len(past) >= cycles else None
    return before is not None and all(eval(holds, {}, dict(each)) for each in [*before, now])  # noqa: S307 - of this file


def wanted(past: list[Cycle], now: Cycle) -> tuple[str, list[bool]]:
    """The line, and what `note` writes; `mode` is what the line wrote for it."""
    line = "off"
    if now["b"]:
        line = "long" if lasted(past, now, 6, "b") else "some" if lasted(past, now, 2, "b") else "short"
    then = {**now, "mode": {"long": 3, "some": 2, "short": 1, "off": 0}[line]}
    return line, [
        lasted(past, then, 3, "x > 3"),
        lasted(past, then, 2, "x > 3 or b"),
        not lasted(past, then, 5, "b"),
        lasted(past, then, 1, "not b"),
        lasted(past, then, 2, "x in (1, 2)") and bool(now["b"]),
        lasted(past, then, 2, "2 <= x <= 7"),
        lasted(past, then, 2, "mode == 2"),
    ]


def test_runs_are_as_an_evaluator_that_keeps_every_cycle_says() -> None:
    drawn, lines = Random(5), set[str]()  # noqa: S311 - the same runs each time
    for _ in range(30):
        now, past = initial(PROGRAM), list[Cycle]()
        for _ in range(40):
            sticks = past and drawn.random() < 0.75
            given = {"x": past[-1]["x"], "b": past[-1]["b"]} if sticks else {}
            given = given or {"x": drawn.randrange(10), "b": drawn.random() < 0.6}
            faulty = drawn.random() < 0.05
            done = cycle(PROGRAM, PROGRAM.levels[0], {**now, **given, **({"x": 77} if faulty else {})})
            if faulty:
                assert done.fault is Fault.ADMIT  # neither counted nor broken: it is as if it had not been
            else:
                line, seen = wanted(past, {**done.snapshot, "mode": now["mode"]})
                lines.add(line)
                assert done.line == line
                assert [done.snapshot[f"seen[{at}]"] for at in range(7)] == seen
                assert done.snapshot["early"] == lasted(past, done.snapshot, 2, "b")
                assert bool(done.failed_assumptions) == lasted(past, done.snapshot, 10, "b")
                past.append(dict(done.snapshot))
                now = done.snapshot
    assert lines == {"long", "some", "short", "off"}


def test_a_condition_has_one_counter_that_goes_as_far_as_the_longest_time() -> None:
    counters = {str(v.name): v for v in PROGRAM.variables if v.counts is not None}
    assert {name: v.type.high for name, v in counters.items()} == {  # type: ignore[union-attr]
        "held_b": 10, "held_x": 3, "held_x_2": 2, "held_b_2": 1, "held_x_3": 2, "held_x_4": 2, "held_mode": 2,
    }  # fmt: skip
    assert all(v.initial == 0 for v in counters.values())
    short = program_of(edited(TEXT, ("not (b for 1 [s])", "not (b for 0.1 [s])")))
    assert short.variable("held_b").type.high == 6  # type: ignore[union-attr]


def test_nothing_is_counted_where_nothing_asks() -> None:
    text = "input b : bool\ntable t {\n| line | b ||\n| a | true ||\n| c | false ||\n}\nlevel l { table t }"
    assert not any(v.counts for v in program_of(text).variables)


def test_a_time_may_be_said_in_cycles() -> None:
    times = (("for delay", "for 3 cycles"), ("0.6 [s] ", "6 cycles"), ("for 0.2 [s]", "for 1 + 1 cycles"))
    said = program_of(after(*times))
    assert said.procedures == PROGRAM.procedures
    old, new = (
        [test.condition for line in one.tables[0].lines for test in line.tests if test is not None]
        for one in (PROGRAM, said)
    )
    assert old == new
    two = re.sub(r"for (delay|[0-9.]+ \[m?s\])", "for 3 cycles", TEXT)
    two = two.replace("level button", "level other { period 40 [ms] table watch }\nlevel button")
    assert len(program_of(two).levels) == 2


def test_a_place_may_be_called_cycles() -> None:
    text = after(
        ("x > 3 for delay", "x > 3 for delay\n  cycles := x > 3 for 3 cycles"),
        ("state early", "state cycles : bool\nstate early"),
    )
    [note] = (one for one in program_of(text).procedures if one.name == "note")
    assert len(note.body) == 8


def test_times_of_one_condition_part_lines() -> None:
    assert prove_program(PROGRAM, Options()).proved is not None
    wrong = edited(
        TEXT, ("b for 200 [ms] and not (b for 600 [ms])", "b for 200 [ms] and not (b for 500 [ms])")
    )
    assert "RCS401" in codes(reported(wrong))


PROPERTIES = """
property soon : (b for 600 [ms]) implies mode = 3
property late : mode = 3 implies b for 600 [ms]
property passes_two : mode = 3 implies was mode in {2, 3}
property never_two : mode /= 2
"""


def test_a_list_has_held_as_a_whole() -> None:
    text = "input x : int 0 .. 9\ntable t {{\n| line | x ||\n| a | {} ||\n| d | DEFAULT ||\n}}\nlevel l {{ table t }}"
    one, other = map(program_of, map(text.format, ("1, 2 for 400 [ms]", "in {1, 2} for 400 [ms]")))
    assert [line.tests[0].condition for line in one.tables[0].lines if line.tests[0]] == [
        line.tests[0].condition for line in other.tables[0].lines if line.tests[0]
    ]


def test_properties_over_times_are_proved() -> None:
    text = edited(TEXT, ("assume brief monitored : not (b for 1 [s])\n", ""), (" assuming brief", ""))
    proof = prove_level(alone(text + PROPERTIES), LITTLE)
    verdicts = {obligation.name: verdict for obligation, verdict in proof.verdicts}
    assert all(verdicts[name] is Verdict.PROVED for name in ("soon", "late", "passes_two"))
    assert verdicts["never_two"] is Verdict.NOT_PROVED


def test_a_property_names_the_counter_and_nothing_else_does() -> None:
    """As witnesses and logs name it."""
    text = edited(TEXT, ("assume brief monitored : not (b for 1 [s])\n", ""), (" assuming brief", ""))
    counter = "held_b"
    proof = prove_level(
        alone(
            text + f"property all_of_it : mode = 3 implies {counter} >= 6\nproperty some : {counter} < 6\n"
        ),
        LITTLE,
    )
    verdicts = {obligation.name: verdict for obligation, verdict in proof.verdicts}
    assert (verdicts["all_of_it"], verdicts["some"]) == (Verdict.PROVED, Verdict.NOT_PROVED)
    assert "RCS201" in codes(reported(text + f"invariant kept : {counter} >= 0\n"))


def test_a_run_that_takes_the_time_is_found_without_a_word() -> None:
    text = edited(TEXT, ("assume brief monitored : not (b for 1 [s])\n", ""), (" assuming brief", ""))
    ts = alone(text + "property never_three : mode /= 3\n")
    assert usual_length([ts]) == 10
    proof = prove_level(ts, LITTLE)
    [broken] = [obligation for obligation, verdict in proof.verdicts if obligation.name == "never_three"]
    [trace] = traces(ts, [broken], TraceSearch(usual_length([ts]))).values()
    assert isinstance(trace, Trace)
    assert [step.line for step in trace.steps] == ["short"] * 2 + ["some"] * 4 + ["long"]


def after(*edits: tuple[str, str]) -> str:
    return edited(TEXT, *edits)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (after(("for delay", "for 0.25 [s]")), "RCS317", "`0.25 [s]` is no whole number of cycles of 100 ms, 1 or more"),
        (after(("for delay", "for 900000000 [s]")), "RCS317", "`900000000 [s]` is more than 4294967295 cycles of 100 ms"),
        (after(("for delay", "for 0 [s]")), "RCS317", "`0 [s]` is no whole number of cycles of 100 ms, 1 or more"),
        (after(("for delay", "for 3")), "RCS302", "what has to hold does so for a time in `ms` or `s`"),
        (after(("for delay", "for x")), "RCS305", "a time is a constant"),
        (after(("for delay", "for x cycles")), "RCS305", "a time is a constant"),
        (after(("for delay", "for 0 cycles")), "RCS317", "`0 cycles` is no number of cycles from 1 to 4294967295"),
        (after(("for delay", "for delay cycles")), "RCS317", "`delay cycles` is no number of cycles from 1 to 4294967295"),
        (after(("for delay", "for 2.0 cycles")), "RCS317", "`2.0 cycles` is no number of cycles from 1 to 4294967295"),
        (after(("for delay", "for true cycles")), "RCS317", "`true cycles` is no number of cycles from 1 to 4294967295"),
        (after(("level button { period 100 [ms] preprocess guess table watch }", "")), "RCS317",
         "no level says how long a cycle is, so that a time is no number of cycles"),
        (after(("level button", "level other { period 40 [ms] table watch }\nlevel button")), "RCS317",
         "how many cycles a time is depends on the level: they have periods of 40 ms and 100 ms"),
        (TEXT + "table idle {\n| line | b for 1 [s] ||\n| a | true ||\n| c | false ||\n}", "RCS317",
         "no level runs table `idle`, so that nothing counts its cycles"),
        (after(("x > 3 for delay", "was (x > 3 for delay)")), "RCS315", "`for` goes back one cycle, not two"),
        (after(("x > 3 for delay", "@T(b) for delay")), "RCS315",
         "what has to hold for a time is a condition of one cycle, without an event, events and another `for`"),
        (after(("x > 3 for delay", "true for delay")), "RCS315",
         "`for` is about a variable; a constant, a local or a parameter has not held for a time"),
        (TEXT + "invariant i : mode = 3 for 1 [s]", "RCS315", "`for` is of two cycles, an invariant of one: write it as a property"),
        (TEXT + "property i : mode = 3 for 1 [s]", "RCS315",
         "a property generates nothing, and no table counts so far how long this has held"),
        (after(("not (b for 500 [ms])", "not b for 500 [ms]")), "RCS101",
         "expected a statement, an operator, `;` or `}`, found `for`"),
        (TEXT + "state d : int 0 .. 3 deferred until b for 1 [s]", "RCS317",
         "`for` stands in tables, assumptions, procedures and properties"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_time_is_said(text: str, code: str, message: str) -> None:
    assert any(found.code.value == code and found.message.startswith(message) for found in refused(text)), [
        (found.code, found.message, found.help) for found in refused(text)
    ]


@pytest.mark.parametrize(
    "heading", ["x - was x", "was x", "@C(x)", "@T(b) and b", "b for 200 [ms]", "b and not (was b)"]
)
def test_what_a_heading_looks_back_at_has_no_time(heading: str) -> None:
    """A counter counts where the cycle ends, one after the other: of a heading that counts it would count what is new already."""
    cell = "> 1" if heading.endswith("was x") else "true"
    told = f"output told : bool\ntable tell {{\n| line | {heading} || told |\n| a | {cell} TIME || true |\n| c | DEFAULT || false |\n}}\n"
    text = after(("table watch }", "table watch table tell }")) + told
    program_of(text.replace("TIME", ""))
    [found] = refused(text.replace("TIME", "for 300 [ms]"))
    assert (found.code, found.message) == (Code.NO_CYCLE_BEFORE, AT_ONCE)


WAYS = (
    "procedure q(n : int 0 .. 9) { a := x > n FOR }",
    "procedure q(n : bool) { a := n FOR }",
    "procedure q(n : bool) { a := (n and b) FOR }",
    "procedure q { local n : int 0 .. 9 := x  a := x > n FOR }",
    "procedure q { for n in 0 .. 2 { a := arr[n] FOR } }",
    "procedure q { for n in 0 .. 2 { if arr[n] FOR { a := true } } }",
    "procedure q { for n in 0 .. 2 { a := x in {1, 2} and n = 1 xor (arr[0] or arr[n]) FOR } }",
    "procedure q(n : int 0 .. 2) { if b { if x > 1 { a := (x mod 3 = n or b) FOR } } }",
    "procedure q(n : int 0 .. 2) { case n { 0 { a := count(b, arr[n]) > 1 FOR } else { a := b } } }",
    "procedure q(n : int 0 .. 2) { r(x in n .. 9 FOR) } procedure r(n : bool) { a := n }",
    "module q reads x writes a { local n : int 0 .. 9 := x  a := min(x, n) > 1 FOR }",
)


@pytest.mark.parametrize("way", WAYS)
def test_what_is_counted_where_a_cycle_ends_speaks_of_no_local(way: str) -> None:
    head = "input x : int 0 .. 9\ninput b : bool\ninput arr : array[3] of bool\nstate a : bool\n"
    rest = "\nlevel l { period 100 [ms] table t }\ntable t {\n| line | when ||\n| only | true ||\n}"
    assert set(codes(refused(head + way.replace("FOR", "for 200 [ms]") + rest))) == {"RCS315"}
    assert not program_of(head + way.replace("FOR", "") + rest).levels[0].postprocess


def test_a_constant_of_the_name_of_a_local_elsewhere_may_be_counted() -> None:
    text = (
        TEXT
        + "const n = 4\nprocedure other(n : int 0 .. 9) { if x = n { early := b } }\nassume seen monitored : x > n for delay"
    )
    program = program_of(text)
    assert any("x > n" in v.doc for v in program.variables if v.counts is not None)


def test_the_nearest_times_are_offered() -> None:
    [found] = refused(after(("for delay", "for 1.95 [s]")))
    assert found.help == ("write `1900 [ms]` or `2 [s]`",)


@pytest.mark.parametrize(
    "cell",
    [
        "> 3 for 2 [s]",
        "4 for 500 [ms]",
        "in {1, 2} for 2 [s]",
        "not in 2 .. 5 for 1 [s]",
        "2 .. 5 for delay",
        "> 3 for 2 cycles",
        "in {1, 2} for n + 1 cycles",
    ],
)
def test_cells_are_laid_out_as_they_were_meant(cell: str) -> None:
    text = f"table t {{\n  | line | x | when ||\n  | a | {cell} | (x > 3 or b) for 1 [s] and not (b for 1 [s]) ||\n}}\n"
    parsed = parse(Source("case.rcs", text))
    assert isinstance(parsed, tree.File)
    laid = format_file(parsed)
    assert cell in laid
    again = parse(Source("case.rcs", laid))
    assert isinstance(again, tree.File)
    assert format_file(again) == laid
    [old], [new] = (
        [d for d in each.declarations if isinstance(d, tree.TableDecl)] for each in (parsed, again)
    )
    assert [row.conditions for row in old.rows] == [row.conditions for row in new.rows]


PANEL = """
input pressed : bool
state stable : bool
output lamp : bool
output siren : bool
property shown : siren implies lamp
table alarm {
  | line | lamp              || siren |
  |------|-------------------||-------|
  | on   | true for 400 [ms] || true  |
  | off  | DEFAULT           || false |
}
table show {
  | line | stable || lamp  |
  |------|--------||-------|
  | on   | true   || true  |
  | off  | false  || false |
}
table debounce {
  | line | pressed            || stable |
  |------|--------------------||--------|
  | on   | true for 200 [ms]  || true   |
  | off  | false for 200 [ms] || false  |
  | keep | DEFAULT            ||        |
}
level panel { period 100 [ms] table alarm table show table debounce }
"""


def test_tables_of_one_cycle_count_what_earlier_ones_set() -> None:
    program = program_of(PANEL)
    now = initial(program)
    shown = []
    for pressed in [*[True] * 8, *[False] * 4]:
        now = cycle(program, program.levels[0], {**now, "pressed": pressed}).snapshot
        shown.append("".join("x" if now[name] else "." for name in ("stable", "lamp", "siren")))
    assert shown == ["...", "...", *["xx."] * 4, "xxx", "xxx", "xxx", "xxx", "...", "..."]
    proof = prove_level(alone(PANEL), LITTLE)
    assert {obligation.name: verdict for obligation, verdict in proof.verdicts}["shown"] is Verdict.PROVED


# --- values of the cycle before, and events ---

State = dict[str, Any]
EVENTFUL = program_of(LOOKING_BACK)

# --- against an evaluator that keeps whole states ----------------------------------------------


def rises(old: State, new: State, condition: Callable[[State], bool]) -> bool:
    return condition(new) and not condition(old)


def at(state: State) -> int:
    return int(state[f"list[{state['count'] // 4}]"])


def seen(old: State, new: State) -> list[bool]:
    """The first eleven, from whole states: that after the last cycle without a fault, and that of the line."""

    def low(s: State) -> bool:
        return bool(s["p"] < 5)

    def on(s: State) -> bool:
        return bool(s["on"])

    return [
        rises(old, new, lambda s: not low(s)) and old["on"],
        rises(old, new, low),
        old["p"] != new["p"] and not old["on"] and old["p"] > 3,
        old["count"] != new["count"],
        old["p"] + old["count"] > 8,
        rises(old, new, lambda s: at(s) > 4),
        old["both.clamp_at"] != new["both.clamp_at"],
        (not (rises(old, new, on) and low(old))) != rises(old, new, lambda s: not on(s)),
        old["m"] != new["m"],
        old["r"] != new["r"],
        old["on"] != new["on"],
    ]


def line(old: State, new: State) -> str | None:
    """The line that matches; `m` is still as it was."""
    if new["g"] == 2:
        return None
    if new["g"] == 1:
        return "on_" if new["on"] and not old["on"] else "off"
    if new["p"] > old["p"]:
        return "rise"
    event = rises(old, new, lambda s: s["p"] < 3) and (old["m"] == 2 or old["on"])
    return "fall" if event else "stay"


def one_cycle(program: Program, state: State, **given: Value) -> Outcome:
    return cycle(program, program.levels[0], {**state, **given})


def test_runs_are_as_an_evaluator_that_keeps_whole_states_says() -> None:
    text = edited(LOOKING_BACK, ("when m = high or on   |", "when (m = high or on) |"))
    text = edited(text, ("not (@T(p < 3) when m = high or on) |", "not (@T(p < 3) when (m = high or on)) |"))
    program, drawn, lines = program_of(text), Random(4), set[str | None]()  # noqa: S311 - the same runs each time
    for _ in range(40):
        now: State = initial(program)
        old = dict(now)  # in the first cycle, the initial values
        for _ in range(25):
            given = {"p": drawn.choice((*range(10), 77)), "g": drawn.choice((0, 0, 0, 1, 1, 2))}
            done = one_cycle(program, now, on=drawn.random() < 0.5, r=drawn.choice((0.0, 0.5)), **given)
            new = {**done.snapshot, "m": now["m"]}
            refused_ = given["p"] == 77
            wanted = None if refused_ else line(old, new)
            lines.add(wanted)
            assert done.line == wanted
            assert refused_ or bool(done.failed_assumptions) == (new["p"] - old["p"] > 5)
            if wanted is not None:
                got = [done.snapshot[f"seen[{number}]"] for number in range(11)]
                assert got == seen(old, done.snapshot)
                assert done.snapshot["old"] == old["p"]
                old = dict(done.snapshot)
            now = done.snapshot
    assert lines == {"rise", "fall", "stay", "on_", "off", None}


@pytest.mark.parametrize(("fault", "given"), [(Fault.ADMIT, {"p": 77}), (Fault.NO_LINE, {"p": 9, "g": 2})])
def test_what_came_with_a_fault_is_seen_by_the_next_cycle(fault: Fault, given: dict[str, Value]) -> None:
    calm = one_cycle(EVENTFUL, initial(EVENTFUL), p=4)
    ended = one_cycle(EVENTFUL, calm.snapshot, **given)
    assert ended.fault is fault
    after = one_cycle(EVENTFUL, ended.snapshot, p=9, g=0)
    assert (after.snapshot["old"], after.snapshot["seen[2]"]) == (4, True)


def test_the_first_cycle_looks_back_at_initial_values() -> None:
    done = one_cycle(EVENTFUL, initial(EVENTFUL), p=2, on=True)
    assert (done.snapshot["old"], done.snapshot["seen[10]"], done.snapshot["seen[2]"]) == (2, True, False)


def test_after_a_restart_states_were_what_they_adopt_and_inputs_what_they_are_initially() -> None:
    adopted = {str(name): value for name, value in EVENTFUL.restart or ()}
    assert (adopted["was_count"], adopted["was_m"]) == (Fixed(4), Fixed(1))
    assert not {"was_p", "was_on", "was_list[0]"} & adopted.keys()
    by_hand = (
        "record c { inc_command : int 0 .. 65535 }\ninput command : c\nstate inc_command_seen : int 0 .. 65535\n"
        "output new : bool\nprocedure look { new := @C(inc_command_seen) }"
    )
    restart = dict(program_of(by_hand).restart or ())
    assert {str(name) for name in restart} == {"inc_command_seen", "was_inc_command_seen"}
    assert set(restart.values()) == {SameAs("command.inc_command")}


def test_a_table_outside_any_level_keeps_what_it_saw() -> None:
    text = "input a : bool\noutput up : bool\ntable t {\n| line | @T(a) || up |\n| x | true || true |\n| y | DEFAULT || false |\n}"
    program = program_of(text)
    now, ups = initial(program), []
    for a in (True, True, False, True):
        now = run_table(program, program.tables[0], {**now, "a": a}).snapshot
        ups.append(now["up"])
    assert ups == [True, False, False, True]


def test_what_the_postprocess_writes_is_kept() -> None:
    text = (
        "input a : bool\nstate n : int 0 .. 9\noutput old : int 0 .. 9\n"
        "module add reads n writes n { if n < 9 { n := n + 1 } }\n"
        "table t {\n| line | a || old |\n| x | DEFAULT || was n |\n}\nlevel l { table t postprocess add }"
    )
    program = program_of(text)
    now, olds = initial(program), []
    for _ in range(3):
        now = cycle(program, program.levels[0], now).snapshot
        olds.append(now["old"])
    assert olds == [0, 1, 2]


def test_only_what_is_looked_back_at_is_kept() -> None:
    kept = {str(v.previous_of) for v in EVENTFUL.variables if v.previous_of is not None}
    elements = {f"list[{number}]" for number in range(3)}
    assert kept == {"p", "on", "count", "m", "both.clamp_at", "r", *elements}
    plain = program_of("input a : bool\nproperty q : @T(a) implies a")
    assert ([str(v.name) for v in plain.variables], plain.procedures) == (["a"], ())


def test_names_that_are_taken_are_left_alone() -> None:
    text = "input a : bool\nstate was_a : bool\nprocedure keep_previous { was_a := was a }\nlevel l { table t }\n"
    program = program_of(
        f"{text}table t {{\n| line | a || procedures |\n| x | DEFAULT || keep_previous |\n}}"
    )
    assert [str(v.name) for v in program.variables] == ["a", "was_a", "was_a_2"]
    assert program.levels[0].postprocess == ("keep_previous_2",)
    first = cycle(program, program.levels[0], {**initial(program), "a": True}).snapshot
    assert (first["was_a"], first["was_a_2"]) == (False, True)


def test_a_text_cannot_name_what_is_kept() -> None:
    [finding] = refused("input a : bool\nassume i : was a\nassume j : was_a\n")
    assert finding.code.value == "RCS201"


def test_properties_and_tables_speak_of_the_same_event_but_after_a_restart() -> None:
    ts = alone(
        "input p : int 0 .. 9\nstate m : bool\nproperty up : @T(p > 5) implies m\nproperty only : @T(m) implies @T(p > 5)\n"
        "table t {\n| line | @T(p > 5) || m |\n| x | true || true |\n| y | false || false |\n}\nlevel l { table t }"
    )
    proof = prove_level(ts, Effort(walks=6, cycles=40))
    stated = {o.name: verdict for o, verdict in proof.verdicts if o.sort is Sort.PROPERTY}
    # `only` fails where a level starts anew: its table looks back at the initial p, a property at the p that stands
    assert stated == {"up": Verdict.PROVED, "only": Verdict.NOT_PROVED}


def test_of_one_table_the_cycle_before_may_be_any() -> None:
    text = "input a : bool\noutput o : bool\ntable t {\n| line | a | was a || o |\n| x | true | || true |\n| y | | true || false |\n}"
    assert [finding.code.value for finding in reported(text)] == ["RCS401", "RCS402"]


# --- as text -----------------------------------------------------------------------------------

EVENTS = [
    "@T(a)",
    "@F(a) when b",
    "@C(n) when b and n > 3",
    "not (@T(a) when b)",
    "@T(a) when b or @F(a) when c",
    "(@T(a) when b) and c",
    "@T(a) when b xor c",
    "@T(a or b) when not c",
    "@T(a) when (b or c)",
    "was (a and b) implies @T(c) when b",
    "when implies @T(a) when when",
]


@pytest.mark.parametrize("text", EVENTS)
def test_events_are_laid_out_as_they_are_meant(text: str) -> None:
    declared = "".join(f"input {name} : bool\n" for name in ("a", "b", "c", "when"))
    source = f"{declared}input n : int 0 .. 9\n\nassume it : {text}\n"
    parsed = parse(Source("case.rcs", source))
    assert isinstance(parsed, tree.File)
    laid_out = format_file(parsed)
    assert f"assume it : {text}\n" in laid_out
    spaced = re.sub(r"@(.)\(", r"@\1 ( ", source)
    again = parse(Source("case.rcs", spaced))
    assert isinstance(again, tree.File)
    assert format_file(again) == laid_out


@pytest.mark.parametrize("guard", ["b or c", "(b or c)"])
def test_or_ends_a_guard(guard: str) -> None:
    program = program_of(f"input a : bool\ninput b : bool\ninput c : bool\nassume it : @T(a) when {guard}\n")
    condition = program.assumptions[0].condition
    quiet = dict.fromkeys(("a", "b", "was_a", "was_b", "was_c"), False) | {"c": True}
    assert evaluate(condition, quiet) == (guard == "b or c")  # then c alone holds


WRONG = {
    "was was a": ("RCS101", "a"),
    "was (@T(a))": ("RCS315", "@T(a)"),
    "@T(was a)": ("RCS315", "was a"),
    "@T(a) when @F(a)": ("RCS315", "@F(a)"),
    "was 3 < 4": ("RCS315", "was 3"),
    "@T(n)": ("RCS301", "n"),
    "@T(a) when n": ("RCS301", "n"),
    "@t(a)": ("RCS201", "@t"),
    "@X(a)": ("RCS201", "@X"),
    "@T(zz)": ("RCS201", "zz"),
    "@T a": ("RCS101", "a"),
    "a when a": ("RCS101", "when"),
    "@T(true)": ("RCS315", "@T(true)"),
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_said_where_it_stands(text: str) -> None:
    for where, before in (("", "assume it : "), (" |\n| y | ", "table t {\n| line | when ||\n| x | ")):
        whole = (
            f"input a : bool\ninput n : int 0 .. 9\n{before}{text}{' ||' + chr(10) + '}' if where else ''}\n"
        )
        [finding] = refused(whole)
        span = finding.primary.span
        assert (finding.code.value, whole[span.start : span.end].strip()) == WRONG[text]


@pytest.mark.parametrize(
    ("declared", "place"),
    [
        ("invariant i : @T(s)", "@T(s)"),
        ("const k = was 3", "was 3"),
        ("state z : bool = was s", "was s"),
    ],
)
def test_what_is_of_one_moment_cannot_look_back(declared: str, place: str) -> None:
    whole = f"state s : bool\n{declared}\n"
    codes = [(f.code.value, whole[f.primary.span.start : f.primary.span.end]) for f in refused(whole)]
    assert ("RCS315", place) in codes


CELLS = {
    ("a", "@T"): "@T(a)",
    ("a", "not @F"): "not @F(a)",
    ("a", "@C"): "@C(a)",
    ("a", "@T when n > 3 and b"): "@T(a) when n > 3 and b",
    ("a or b", "@F"): "@F(a or b)",
    ("n", "@C when b"): "@C(n) when b",
    ("n", "@T(3)"): "@T(n = 3)",
    ("n", "@F(> 3)"): "@F(n > 3)",
    ("n", "not @T(/= 3)"): "not @T(n /= 3)",
    ("n", "@T(2 .. 5) when b"): "@T(n in 2 .. 5) when b",
    ("n", "@T(not in 2 .. 5)"): "@T(n not in 2 .. 5)",
    ("n", "@F(in {1, 3 .. 5})"): "@F(n in {1, 3 .. 5})",
    ("n", "@T(not in odd)"): "@T(n not in odd)",
    ("n + 1", "@T(4)"): "@T(n + 1 = 4)",
    ("m", "@T(on)"): "@T(m = on)",
    ("w", "@T(x0xx 1010)"): "@T(w = 0bx0xx_1010)",
    ("w", "@F(x0xx 1010, 1xxx xxxx)"): "@F(w in {0bx0xx_1010, 0b1xxx_xxxx})",
    ("a", "= @T(b)"): "a = @T(b)",
    ("a", "= (not @T(b))"): "a = (not @T(b))",
}
"""A heading, a cell under it, and what it means."""


def cells_of(heading: str, cell: str, whole: str) -> str:
    return (
        "enum mode { off, on }\nset odd : int 0 .. 9 = {1, 3, 5, 7, 9}\n"
        "input a : bool\ninput b : bool\ninput m : mode\ninput n : int 0 .. 9\ninput w : int 0 .. 255\n"
        f"table t {{\n| line | {heading} | when ||\n| x | {cell} | {whole} ||\n}}\n"
    )


@pytest.mark.parametrize(("heading", "cell"), CELLS)
def test_an_event_in_a_cell_is_of_its_heading(heading: str, cell: str) -> None:
    source = cells_of(heading, cell, CELLS[heading, cell])
    of_heading, whole = program_of(source).tables[0].lines[0].tests
    assert of_heading is not None
    assert whole is not None
    assert of_heading.condition == whole.condition
    parsed = parse(Source("case.rcs", source))
    assert isinstance(parsed, tree.File)
    laid_out = format_file(parsed)
    assert f"| {cell} " in laid_out
    [declared] = [one for one in parsed.declarations if isinstance(one, tree.TableDecl)]
    written = declared.rows[0].conditions[0]
    assert written is not None
    assert spell_expr(tree.term(declared.conditions[0], written)) == CELLS[heading, cell]


def test_a_list_in_an_event_is_a_set() -> None:
    listed, braced = (
        program_of(cells_of("n", f"@T({text})", "a")).tables[0].lines[0].tests[0]
        for text in ("1, 3 .. 5", "in {1, 3 .. 5}")
    )
    assert listed is not None
    assert braced is not None
    assert listed.condition == braced.condition


ALONE = "write `@{}`; an event of something else stands in a column headed `when`"


@pytest.mark.parametrize(
    ("heading", "cell", "code", "place", "helps"),
    [
        ("a", "@T(b)", "RCS301", "@T(b)", ALONE.format("T")),
        ("a", "not @F(true)", "RCS301", "not @F(true)", ALONE.format("F")),
        ("n", "@C(3)", "RCS301", "@C(3)", ALONE.format("C")),
        ("n", "@T", "RCS301", "@T", "say what it came to be: `@T(> 3)`, `@T(3)`"),
        ("n", "@T(a)", "RCS301", "a", "a whole condition stands in a column headed `when`"),
        ("n", "@X", "RCS201", "@X", None),
        ("a", "@T when n", "RCS301", "n", None),
        ("a", "@T when was b", "RCS315", "was b", None),
        ("n", "@T(was n)", "RCS315", "was n", None),
        ("n", "@T(> 3 for 2 [s])", "RCS101", "for", None),
        ("was a", "@T", "RCS315", "@T", OF_A_VARIABLE),
        ("@T(a)", "@F", "RCS315", "@F", OF_A_VARIABLE),
    ],
)
def test_an_event_in_a_cell_that_is_none_of_its_heading(
    heading: str, cell: str, code: str, place: str, helps: str | None
) -> None:
    source = cells_of(heading, cell, "b")
    finding = refused(source)[0]
    span = finding.primary.span
    assert (finding.code.value, source[span.start : span.end]) == (code, place)
    assert helps is None or finding.help == (helps,)


def test_help_names_the_events() -> None:
    [small] = refused("input a : bool\nassume i : @t(a)\n")
    [other] = refused("input a : bool\nassume i : @X(a)\n")
    assert small.help == ("write `@T(c)`: the condition c comes to hold",)
    assert all(word in other.help[0] for word in ("@T(c)", "@F(c)", "@C(x)"))


def test_a_module_names_what_it_looks_back_at() -> None:
    text = "input a : bool\nstate up : bool\nmodule m reads {} writes up {{ up := @T(a) }}\n"
    assert program_of(text.format("a")).procedures[0].reads == ("a", "was_a")
    findings = refused(text.format("up"))
    assert {(f.code.value, f.help) for f in findings} == {("RCS208", ("add `a` to its `reads`",))}


def test_one_input_at_a_time_may_be_assumed() -> None:
    columns = "table t {} {{\n| line | when || o |\n| x | @C(a) || 1 |\n| y | @C(b) || 2 |\n| z | DEFAULT || 0 |\n}}"
    text = f"input a : bool\ninput b : bool\noutput o : int 0 .. 2\nassume one : not (@C(a) and @C(b))\n{columns}\n"
    assert [f.code.value for f in reported(text.format(""))] == ["RCS402", "RCS407"]
    assert [f.code.value for f in reported(text.format("assuming one"))] == ["RCS407"]


def test_every_pair_of_bits_of_an_event() -> None:
    program = program_of(
        "input a : bool\nassume t : @T(a)\nassume f : @F(a)\nassume c : @C(a)\nassume w : was a"
    )
    conditions = [assumption.condition for assumption in program.assumptions]
    for old, new in pairwise((False, False, True, True, False)):
        told = [evaluate(condition, {"a": new, "was_a": old}) for condition in conditions]
        assert told == [new and not old, old and not new, old != new, old]


# --- states that the compiler adds: the same where they are fed with the same, whatever they are called ---

FED = """\
enum mode { off, on }
record report { b : bool }
input a : report
input a_b : bool
input x : int 0 .. 9
state m : mode
state s : bool
FIRST
table t {
  | line | when       || s     |
  | yes  | CONDITION  || true  |
  | no   | not (CONDITION) || false |
}
level l { period 100 [ms] table t }
"""
ASKED = (
    "was a.b",
    "was a_b",
    "was a_b and was a.b",
    "a.b for 200 [ms]",
    "a.b = true for 200 [ms]",
    "a.b for 300 [ms]",
    "(a.b or a_b) for 200 [ms]",
    "x > 3 for 200 [ms]",
    "x >= 4 for 200 [ms]",
    "x > 3",
    "@T(a.b)",
    "not was a.b and a.b",
    "(m = on and a.b) for 200 [ms] or was a_b",
)
SAME = {("a.b for 200 [ms]", "a.b = true for 200 [ms]"), ("@T(a.b)", "not was a.b and a.b")}


@cache
def version(condition: str, before: str = "") -> Program:
    first = f"assume before monitored : {before} or true" if before else ""
    return program_of(FED.replace("CONDITION", condition).replace("FIRST", first))


@pytest.mark.parametrize("one", ASKED)
def test_tables_that_look_back_at_something_else_are_not_the_same(one: str) -> None:
    """`x > 3` for a time and `x >= 4` for it are, too; as their counters are fed with other words, nobody says so."""
    for other in ASKED[ASKED.index(one) :]:
        first, second = version(one), version(other, before="was a_b and (a_b or a.b) for 200 [ms]")
        told = compare((first, first.tables[0]), (second, second.tables[0]), Options())
        alike = one == other or (one, other) in SAME or (other, one) in SAME
        assert isinstance(told, Same) is alike, (one, other)
        parts = versions("t", version(one), second, Options()).parts
        assert any(part.changed for part in parts if part.what == "table") is not alike, (one, other)


def test_an_order_of_asking_changes_nothing() -> None:
    for one, other in product(("was a.b and was a_b", "a_b for 1 [s] and a.b for 1 [s]"), repeat=2):
        turned = " and ".join(reversed(other.split(" and ")))
        assert versions("t", version(one), version(turned), Options()).changed is (one != other)


def test_members_count_by_their_names() -> None:
    """An enumeration is numbered otherwise, and the condition that has to hold says the same."""
    before = version("m = on for 200 [ms]")
    after = program_of(
        FED.replace("off, on", "on, off").replace("CONDITION", "m = on for 200 [ms]").replace("FIRST", "")
    )
    whole = versions("t", before, after, Options())
    assert not any(part.changed for part in whole.parts if part.what == "table")


def test_a_name_that_a_user_gave_is_never_taken() -> None:
    asked = "was a.b and a.b for 200 [ms]"
    texts = [
        FED.replace("CONDITION", asked).replace("FIRST", first)
        for first in ("", "state was_a_b : bool\nstate held_a_b : bool\nstate was_a_b_2 : bool")
    ]
    one, other = matched(program_of(texts[0]), program_of(texts[1]))
    names = [{fed_with(v): str(v.name) for v in each.variables if fed_with(v)} for each in (one, other)]
    assert names[0] == names[1]
    assert len(names[0]) == 2
    for program in (one, other):
        assert len({v.name for v in program.variables}) == len(program.variables)
        assert prove_program(program, BOXES).proved is not None, "it is a program still"
    assert isinstance(compare((one, one.tables[0]), (other, other.tables[0]), Options()), Same)
