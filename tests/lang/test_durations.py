"""`c for 2 [s]` in cells, headings, assumptions, procedures and properties, against an evaluator that keeps every cycle."""

from random import Random

import pytest

from rcsc.base.diagnostics.source import Source
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces, usual_length
from rcsc.compose.proof.level import Verdict, prove_level
from rcsc.lang.interpret import Fault, cycle, initial
from rcsc.lang.model import Value
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.parse import parse
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests.support.programs.examples import LASTING
from tests.support.programs.stages import codes, program_of, refused, reported
from tests.support.programs.systems import LITTLE, alone
from tests.support.programs.texts import edited

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
        (after(("level button { period 100 [ms] preprocess guess table watch }", "")), "RCS317",
         "no level says how long a cycle is, so that a time is no number of cycles"),
        (after(("level button", "level other { period 40 [ms] table watch }\nlevel button")), "RCS317",
         "how many cycles a time is depends on the level: they have periods of 40 ms and 100 ms"),
        (TEXT + "table idle {\n| line | b for 1 [s] ||\n| a | true ||\n| c | false ||\n}", "RCS317",
         "no level runs table `idle`, so that a time is no number of cycles"),
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
    ["> 3 for 2 [s]", "4 for 500 [ms]", "in {1, 2} for 2 [s]", "not in 2 .. 5 for 1 [s]", "2 .. 5 for delay"],
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
