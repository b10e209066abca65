"""Values of the cycle before and events, in cells, headings, assumptions and procedures."""

import re
from collections.abc import Callable
from itertools import pairwise
from random import Random
from typing import Any

import pytest

from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.lang.interpret import Fault, Outcome, cycle, evaluate, initial, run_table
from rcsc.lang.model import Program, Value
from rcsc.lang.restart import Fixed, SameAs
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from tests.support.programs.examples import LOOKING_BACK
from tests.support.programs.stages import program_of, refused, reported
from tests.support.programs.systems import alone
from tests.support.programs.texts import edited

State = dict[str, Any]
PROGRAM = program_of(LOOKING_BACK)

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
    calm = one_cycle(PROGRAM, initial(PROGRAM), p=4)
    ended = one_cycle(PROGRAM, calm.snapshot, **given)
    assert ended.fault is fault
    after = one_cycle(PROGRAM, ended.snapshot, p=9, g=0)
    assert (after.snapshot["old"], after.snapshot["seen[2]"]) == (4, True)


def test_the_first_cycle_looks_back_at_initial_values() -> None:
    done = one_cycle(PROGRAM, initial(PROGRAM), p=2, on=True)
    assert (done.snapshot["old"], done.snapshot["seen[10]"], done.snapshot["seen[2]"]) == (2, True, False)


def test_after_a_restart_states_were_what_they_adopt_and_inputs_what_they_are_initially() -> None:
    adopted = {str(name): value for name, value in PROGRAM.restart or ()}
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
    kept = {str(v.previous_of) for v in PROGRAM.variables if v.previous_of is not None}
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
