"""Findings: the shortest runs of published and of other rules' hazards, kept as logs and cases, run by the executors."""

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from random import Random

import pytest

import rcsc.compose.counterexample.cycle_run
import rcsc.compose.counterexample.explain
import rcsc.compose.counterexample.trace
import rcsc.lang.interpret
from rcsc.base.host.files.write import UNPROVED
from rcsc.compose.contract.environment import leaves_under
from rcsc.compose.contract.obligations import ObligationKey, Sort, may_meet
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.variants import VARIANTS, defaults_reported, first_match, undeferred
from rcsc.compose.counterexample.cycle_run import broken, seen_by_table
from rcsc.compose.counterexample.finding import Finding, beginnings, of_trace, rows
from rcsc.compose.counterexample.frozen import BadCaseError, case_breaks, frozen, read_case
from rcsc.compose.counterexample.pair import followed_together
from rcsc.compose.counterexample.repair import helps, weakest_condition
from rcsc.compose.counterexample.rerun import ExecutorsDifferError, make, record
from rcsc.compose.counterexample.trace import NotReproducedError, Trace, TraceResult, TraceSearch, traces
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.front.commands.shared.proved import pauses
from rcsc.lang.interpret import Fault, holds, initial, matching_lines
from rcsc.lang.model import LineName, Program, Table, Value, VariableName, key_bounds, spell, value_of_key
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.decide import prove_table
from rcsc.run.description import Description, description
from rcsc.run.executors import UnprovedExecutors, marked
from rcsc.run.log.read import read
from rcsc.run.log.replay import Replay
from rcsc.run.system import assemble
from tests.support.programs.stages import shipped
from tests.support.programs.systems import SYSTEM, alone, small_level, small_system, small_text
from tests.support.programs.texts import edit_file, edited, without_row
from tests.support.proved import every_obligation, obligation_of, shortest, time_line

REPO = Path(__file__).parents[2]
EXAMPLES = REPO / "tables" / "examples"
PUBLISHED = EXAMPLES / "published" / "system.toml"
LAST_ECHO = EXAMPLES / "later" / "last_echo.toml"
FIRST_MATCH = EXAMPLES / "later" / "first_match.toml"
CASES = sorted((REPO / "tests" / "findings").glob("*.json"))
LEGAL = TraceSearch(most=4, legal=True)


@dataclass(frozen=True)
class Looked:
    """A level and the traces of its obligations."""

    ts: TransitionSystem
    found: dict[ObligationKey, TraceResult]

    def trace(self, sort: Sort, table: str = "", name: str = "") -> Trace:
        found = self.found[sort, table, name]
        assert isinstance(found, Trace)
        return found

    def finding(self, key: ObligationKey) -> Finding:
        return of_trace(self.ts, obligation_of(self.ts, *key), self.trace(*key))


def looked(ts: TransitionSystem, search: TraceSearch = LEGAL) -> Looked:
    return Looked(ts, traces(ts, every_obligation(ts), search))


@pytest.fixture(scope="module")
def published() -> Looked:
    return looked(transition_systems(PUBLISHED)["task"])


@pytest.fixture(scope="module")
def made_by_force(published: Looked, tmp_path_factory: pytest.TempPathFactory) -> Description:
    folder = tmp_path_factory.mktemp("published")
    assert make([published.ts.program], folder, altered=False) == ("task",)
    return replace(description(PUBLISHED), generated=folder)


# --- the published table, with its procedures, over a level that keeps to the protocol ------------

HAZARDS = {
    (Sort.ONE_LINE, "acquire", "10 and 14"): 3,
    (Sort.ONE_LINE, "acquire", "11 and 14"): 3,
    (Sort.ONE_LINE, "acquire", "12 and 14"): 4,
    (Sort.ONE_LINE, "acquire", "13 and 14"): 4,
    (Sort.ONE_LINE, "acquire", "14 and 15"): 2,
    (Sort.ANSWERED, "acquire", "new_command"): 1,
    (Sort.DEFERRED, "", "cur_state"): 2,
    (Sort.WAITS, "", "to_emove"): 2,
}


def test_every_hazard_of_the_published_table_is_found_with_its_shortest_run(published: Looked) -> None:
    """All five pairs of lines that overlap do match in some run; a command is lost; a state is written over."""
    aside = {Sort.NUMBERED}  # of fields that nobody compares
    lengths = {
        key: len(published.trace(*key).steps)
        for key in published.found
        if key[0] not in aside and key != (Sort.ONE_LINE, "acquire", "")
    }
    assert lengths == HAZARDS


def test_the_level_around_it_is_the_published_table() -> None:
    """The lines of Fig. 8 and the procedures of Fig. 9 stand in both files, word for word."""

    def listing(path: Path) -> str:
        text = path.read_text(encoding="utf-8")
        start = text.index("procedure set_source")
        return text[start : text.index("\n}\n", text.index("table acquire {")) + 3]

    assert listing(EXAMPLES / "published" / "task.rcs") == listing(EXAMPLES / "acquire_published.rcs")


def test_the_state_written_over_is_the_hazard_that_the_readme_tells(published: Looked) -> None:
    """REMOVE-FROM-BUFFER-DB finds no flag: `f_state` is written while `state_5` is pending, and PICKUP goes down."""
    step = published.trace(Sort.DEFERRED, "", "cur_state").steps[-1]
    kind = published.ts.kinds["cur_state"]
    assert [spell(kind, step.after[name]) for name in ("cur_state", "cur_state.next")] == [
        "f_state",
        "state_5",
    ]
    assert step.line == "5"


# --- runs that neighbours can do -----------------------------------------------------------


def unlawful(looked: Looked, trace: Trace) -> Iterator[str]:
    """Where the environment does what none can that began with the level: told from the run alone."""
    links = looked.ts.links
    assert links.above is not None
    number = f"{links.above.order}.inc_command"
    for below in links.below:
        given, last = list[tuple[object, object]](), 0
        for step in trace.steps:
            order = tuple(step.before[f"{below.order}.{field}"] for field in ("inc_command", "input_command"))
            given.append(order)  # type: ignore[arg-type]  # two values
            echo = tuple(
                step.taken[f"{below.report}.{field}"] for field in ("inc_command_echo", "ref_command_echo")
            )
            places = [at for at, one in enumerate(given) if one == echo and at >= last]
            if not places:
                yield f"echoes {echo}"
                return
            last = places[0]
    for step in trace.steps:
        if int(step.taken[number]) - int(step.before[number]) not in {0, 1}:
            yield "a number is left out"


def test_what_is_shown_first_is_what_levels_can_do_that_begin_together(published: Looked) -> None:
    found = [trace for trace in published.found.values() if isinstance(trace, Trace)]
    assert len(found) > 8
    assert [list(unlawful(published, trace)) for trace in found] == [[]] * len(found)


def test_the_contract_leaves_room_for_more() -> None:
    """Numbers that have gone round: what no level that began with this one can echo, the contract allows."""
    ts = transition_systems(LAST_ECHO)["upper"]
    key = (Sort.NEXT_NUMBER, "", "to_lower")
    assert traces(ts, [obligation_of(ts, *key)], LEGAL) == {}
    wide = Looked(ts, traces(ts, [obligation_of(ts, *key)], TraceSearch(most=4)))
    assert list(unlawful(wide, wide.trace(*key)))


def test_inputs_change_only_where_they_must(published: Looked) -> None:
    """The time line of a run, whole: the simplest one, whatever model the solver would give."""
    finding = published.finding((Sort.ONE_LINE, "acquire", "14 and 15"))
    assert time_line({"task": published.ts}, finding) == [
        "cycle 1: table `acquire`, line `16`",
        "  takes emove.status_report = failed",
        (
            "  leaves status_in = failed, cur_state.next = f_state, status_report = failed, failure = state, "
            "report.status_report = failed, report.failure = state"
        ),
        "cycle 2: table `acquire`, line `14 and 15`; several lines match",
        "  takes emove.status_report = executing",
        "  leaves status_in = executing, cur_state = f_state",
    ]


def test_a_run_does_not_go_on_behind_a_fault() -> None:
    """Every line stands twice, so that the first order is a fault: nothing that needs it done, or another cycle, is found."""
    ts = transition_systems(LAST_ECHO)["upper"]
    [table] = ts.program.tables
    again = tuple(replace(line, name=LineName(f"{line.name}_again")) for line in table.lines)
    twice = ts.of(replace(ts.program, tables=(replace(table, lines=(*table.lines, *again)),)))
    names = {"start and start_again", "end and end_again", "to_lower", "to_lower.input_command"}
    wanted = [
        obligation
        for obligation in every_obligation(twice)
        if obligation.name in names and obligation.sort is not Sort.WAITS
    ]
    assert {obligation.name for obligation in wanted} == names
    found = traces(twice, wanted, TraceSearch(most=4))
    assert {key[2] for key in found} == {"start and start_again"}


def test_what_a_faulty_cycle_would_have_left_is_not_looked_at() -> None:
    """An order before the echo meets two lines: that it has the number of the one before does not count."""
    ts = transition_systems(LAST_ECHO)["upper"]
    [table] = ts.program.tables
    start, busy = table.lines[:2]
    state = [column.variable for column in table.columns].index(VariableName("cur_state"))
    late = (*start.tests[:state], busy.tests[state], *start.tests[state + 1 :])
    added = replace(start, name=LineName("start_at_work"), tests=late)
    changed = replace(ts.program, tables=(replace(table, lines=(*table.lines, added)),))
    obligations_of = every_obligation(ts.of(changed))
    [wanted] = [
        obligation
        for obligation in obligations_of
        if obligation.key == (Sort.NUMBERED, "", "to_lower.input_command")
    ]
    assert traces(ts, [wanted], TraceSearch(most=3, legal=True))
    assert traces(ts.of(changed), [wanted], TraceSearch(most=3, legal=True)) == {}


def test_a_pair_of_lines_is_not_broken_by_another(published: Looked) -> None:
    step = published.trace(Sort.ONE_LINE, "acquire", "14 and 15").steps[-1]
    assert step.matched == ("14", "15")
    assert broken(published.ts, obligation_of(published.ts, Sort.ONE_LINE, "acquire", "14 and 15"), step)
    assert not broken(published.ts, obligation_of(published.ts, Sort.ONE_LINE, "acquire", "10 and 14"), step)


def test_a_run_can_begin_with_a_restart(tmp_path: Path) -> None:
    """No line leads to `f_state` any more: only a restart does, which takes what failed as failed."""
    upper = small_text("upper", ("cur_state in {d_state, f_state} and ref", "cur_state = d_state and ref"))
    ts = small_level(tmp_path, "upper", upper=upper.replace("nextstate(f_state)", "nextstate(d_state)"))
    obligation = obligation_of(ts, Sort.ASSUMPTION, "work", "in_step")
    assert traces(ts, [obligation], LEGAL) == {}
    found = traces(ts, [obligation], replace(LEGAL, restarted=True))[obligation.key]
    assert isinstance(found, Trace)
    assert found.restarted
    finding = of_trace(ts, obligation, found)
    first = finding.start("upper")
    assert spell(ts.kinds["cur_state"], first["cur_state"]) == "f_state"
    [begun] = beginnings({"upper": ts}, finding)
    assert (begun.tick, begun.line) == (0, "restart")
    shown = {**begun.takes, **begun.leaves}
    assert {name: shown[name] for name in ("cur_state", "status_report")} == {
        "cur_state": "f_state",
        "status_report": "failed",
    }
    [table] = [one for one in ts.program.tables if one.name == "work"]
    usual = initial(ts.program)
    assert shown.keys() == {name for name in usual if name in table.variables or first[name] != usual[name]}
    assert shown == {name: spell(ts.kinds[name], first[name]) for name in shown}
    [other] = beginnings({"upper": ts}, replace(finding, restarted=False))
    assert other.line == "begins"
    others = {**other.takes, **other.leaves}
    assert others.keys() == {name for name in usual if first[name] != usual[name]}


def test_no_neighbour_that_began_with_it_finds_an_echo_of_more_than_it_ordered(tmp_path: Path) -> None:
    text = small_text(
        "lower",
        ("table go {", "property ahead : was report.inc_command_echo <= was command.inc_command\ntable go {"),
    )
    ts = small_level(tmp_path, "lower", lower=text)
    obligation = obligation_of(ts, Sort.PROPERTY, "", "ahead")
    assert traces(ts, [obligation], TraceSearch(most=2, restarted=True))  # numbers may have gone round
    assert traces(ts, [obligation], replace(LEGAL, most=2, restarted=True)) == {}


def test_the_state_in_which_a_restart_begins_is_the_first_row(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    upper = small_text("upper", ("cur_state in {d_state, f_state} and ref", "cur_state = d_state and ref"))
    system = small_system(tmp_path, upper=upper.replace("nextstate(f_state)", "nextstate(d_state)"))
    assert run(["prove", "--no-cache", "--level", "upper", str(system)]) == 1
    told = capsys.readouterr()
    [begun, *_] = [line for line in told.err.splitlines() if "restart  " in line]
    assert re.match(r"\s*\|\s*\| restart ", begun)
    assert "cur_state = f_state" in told.err
    every = "PAUSE is the first command: `rest` of `upper`, `pause` of `lower`; a restart orders it, and an empty buffer holds it"
    assert every in told.out.splitlines()


def test_it_is_said_where_a_restart_or_an_empty_buffer_orders_another_command(tmp_path: Path) -> None:
    words = small_text("words", ("input_command : lower_command", "input_command : lower_command = go"))
    named, whole = (
        "adopt to_lower.input_command := go\n",
        transition_systems(small_system(tmp_path, words=words)),
    )
    [said] = pauses(whole)
    assert said.endswith("; a restart orders it, and an empty buffer holds it but for `to_lower` of `upper`")
    ts = small_level(tmp_path, "upper", upper=small_text("upper") + named)
    [said] = pauses({"upper": ts})
    assert said.endswith("; a restart orders it but for `to_lower` of `upper`, and an empty buffer holds it")


def test_where_a_pause_is_not_passed_on_it_is_said_what_is_taken_for_one(tmp_path: Path) -> None:
    words = small_text("words", ("enum lower_command { pause, go }", "enum lower_command { go, pause }"))
    ts = small_level(tmp_path, "upper", words=words)
    obligation = obligation_of(ts, Sort.PAUSES, "", "to_lower")
    found = traces(ts, [obligation], LEGAL)[obligation.key]
    assert isinstance(found, Trace)
    [said] = helps(ts, of_trace(ts, obligation, found))
    assert said == (
        "PAUSE is the first member of a command: `rest` of what `upper` takes, `go` of `to_lower`; "
        "if another command rests, declare it first"
    )


def test_a_table_across_variables_that_no_line_matches_gets_a_line(tmp_path: Path) -> None:
    """`cur_state = going` beside a column that no set of values can say."""
    upper = without_row(small_text("upper"), "6").replace(
        "| 7    | DEFAULT unreachable |", "| 7    | false |"
    )
    upper = upper.replace("| line | new_command         | idle  |", "| line | when | idle  |", 1)
    upper = upper.replace("| 0    | true                |", "| 0    | new_command |", 1)
    upper = upper.replace("| 1    | true                |", "| 1    | new_command and (begun or idle) |", 1)
    for name in "2345":
        upper = upper.replace(f"| {name}    | false               |", f"| {name}    | not new_command |", 1)
    upper = without_row(upper, "7")
    ts = small_level(tmp_path, "upper", upper=upper)
    obligation = obligation_of(ts, Sort.SOME_LINE, "work", "")
    found = traces(ts, [obligation], LEGAL)[obligation.key]
    assert isinstance(found, Trace)
    [said] = helps(ts, of_trace(ts, obligation, found))
    assert re.fullmatch(
        r"a line `\| new \| .*going \|\| \.\.\. \|` closes .* and overlaps no other: proved", said
    )


# --- what does not reproduce ---------------------------------------------------------------


def test_a_run_that_the_interpreter_does_not_do_is_a_bug(monkeypatch: pytest.MonkeyPatch) -> None:
    ts = transition_systems(LAST_ECHO)["upper"]
    obligation = obligation_of(ts, Sort.NUMBERED, "", "to_lower.input_command")
    monkeypatch.setattr(rcsc.compose.counterexample.trace, "broken", lambda *_: False)
    with pytest.raises(NotReproducedError) as raised:
        shortest(ts, obligation)
    assert not raised.value.guessed
    assert raised.value.beside == ("every leaf that the solver spoke of is the same in both",)


def test_where_the_interpreter_parts_from_the_solver_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    ts = transition_systems(LAST_ECHO)["upper"]
    obligation = obligation_of(ts, Sort.NUMBERED, "", "to_lower.input_command")
    true_cycle = rcsc.lang.interpret.cycle

    def other(*args: object) -> object:
        outcome = true_cycle(*args)  # type: ignore[arg-type]  # as it is called
        outcome.snapshot["to_lower.input_command"] = 0
        return outcome

    monkeypatch.setattr(rcsc.compose.counterexample.cycle_run, "cycle", other)
    with pytest.raises(NotReproducedError) as raised:
        shortest(ts, obligation)
    assert raised.value.beside == ("cycle 2: `to_lower.input_command` = drill by the solver, rest as it ran",)


FAR = """
input go : bool
input y : real 0.0 .. 2.0
state way : real 0.0 .. 2.0
state far : bool
output on : bool
assume believed assumed : far or not go
property never : not on
module notice reads way writes far { far := way * 0.5 >= 0.75 }
table t assuming believed {
  | line | go    || on    | way             |
  |------|-------||-------|-----------------|
  | on   | true  || true  | way             |
  | off  | false || false | min(2.0, y * y) |
}
level l { preprocess notice table t }
"""


def test_a_run_against_what_is_declared_is_not_shown() -> None:
    """The square of `y` may be anything to the solver, which takes the fact for so: as it runs, the fact fails where the property does."""
    ts = alone(FAR)
    assert ts.trusted == {"believed"}
    with pytest.raises(NotReproducedError) as raised:
        shortest(ts, obligation_of(ts, Sort.PROPERTY, "", "never"))
    assert raised.value.guessed


def test_arithmetic_that_was_left_open_is_no_bug(tmp_path: Path) -> None:
    """`x * x` of a real may be anything in its bounds to the solver: its run is not believed, and no bug of rcsc's."""
    squares = "assume square monitored : x * x = x * x * 1.0 or x < 0.5\n\ntable go assuming square {"
    lower = small_text(
        "lower",
        ("input there : bool", "input there : bool\ninput x : real 0.0 .. 2.0"),
        ("table go {", squares),
    )
    ts = small_level(tmp_path, "lower", lower=lower)
    with pytest.raises(NotReproducedError) as raised:
        shortest(ts, obligation_of(ts, Sort.ASSUMPTION, "go", "square"))
    assert raised.value.guessed


# --- a finding is a log --------------------------------------------------------------------


ONE_OF_EACH = {key[0]: key for key in HAZARDS}.values()


@pytest.mark.parametrize("key", ONE_OF_EACH, ids=lambda key: key[0].name)
def test_a_finding_is_run_by_both_executors_and_its_log_replays(
    published: Looked, made_by_force: Description, key: ObligationKey, tmp_path: Path
) -> None:
    finding = published.finding(key)
    path = tmp_path / "finding.mcap"
    record(finding, {"task": published.ts}, made_by_force, path)
    log = read(path)
    assert log.complete
    assert len(log.ticks) == len(finding.ticks)
    for kind in ("python", "c"):
        replay = Replay(log, made_by_force.generated, kind)
        assert replay.unchanged
        assert replay.first_difference() is None
    sign = log.level("task").sign
    fault = log.level("task").track.latest(log.last)[len(sign.leaves) + 1]  # type: ignore[index]
    assert fault == (Fault.SEVERAL_LINES if key[0] is Sort.ONE_LINE else Fault.OK)


def test_a_log_of_a_finding_holds_what_the_environment_gave(
    published: Looked, made_by_force: Description, tmp_path: Path
) -> None:
    finding = published.finding((Sort.ONE_LINE, "acquire", "13 and 14"))
    path = tmp_path / "finding.mcap"
    record(finding, {"task": published.ts}, made_by_force, path)
    log = read(path)
    assert set(log.buffers) == {
        "workstation.order", "emove.report", "database.task.vision_needed", "database.task.source_known",
    }  # fmt: skip
    reports = leaves_under(published.ts.program, "emove")
    for tick, steps in enumerate(finding.ticks, 1):
        given = log.buffers["emove.report"].latest(tick)
        assert given == tuple(steps["task"].taken[leaf] for leaf in reports)


def test_an_executor_that_does_something_else_is_a_bug(published: Looked, tmp_path: Path) -> None:
    make([published.ts.program], tmp_path, altered=False)
    module = tmp_path / "python" / "task.py"
    text = module.read_text(encoding="utf-8")
    assert "s.report_failure = s.failure" in text
    module.write_text(
        edited(text, ("s.report_failure = s.failure", "s.report_failure = 0")), encoding="utf-8"
    )
    finding = published.finding((Sort.ONE_LINE, "acquire", "14 and 15"))
    system = replace(description(PUBLISHED), generated=tmp_path)
    with pytest.raises(ExecutorsDifferError) as raised:
        record(finding, {"task": published.ts}, system, tmp_path / "a.mcap")
    assert raised.value.beside == (
        "tick 1, level `task`: `report.failure` = state by the interpreter, none by the Python executor",
    )


def test_a_level_that_ends_in_another_line_is_a_bug(published: Looked, tmp_path: Path) -> None:
    """The trace is compared, too: here the C takes line 14 where two match."""
    make([published.ts.program], tmp_path, altered=False)
    source = tmp_path / "c" / "task.c"
    text = source.read_text(encoding="utf-8")
    assert "line = several ? (-2) : line;" in text
    source.write_text(edited(text, ("line = several ? (-2) : line;", "")), encoding="utf-8")
    finding = published.finding((Sort.ONE_LINE, "acquire", "14 and 15"))
    system = replace(description(PUBLISHED), generated=tmp_path)
    with pytest.raises(
        ExecutorsDifferError, match=r"several_lines, failed: none by the interpreter, .* by the C executor"
    ):
        record(finding, {"task": published.ts}, system, tmp_path / "a.mcap")


# --- made by force -------------------------------------------------------------------------


def test_everything_made_by_force_says_so(made_by_force: Description) -> None:
    files = [path for path in made_by_force.generated.rglob("*") if path.is_file()]
    assert {path.suffix for path in files} >= {".c", ".h", ".json", ".py"}
    assert [path.name for path in files if UNPROVED not in path.read_text(encoding="utf-8")] == []
    assert {path.suffix for path in marked(made_by_force)} == {".c", ".h", ".json", ".py"}


def test_what_is_proved_is_made_as_ever(repo: Path, tmp_path: Path) -> None:
    program = shipped("tables/gripper/gripper.rcs", repo)
    assert make([program], tmp_path, altered=False) == ()
    for path in (path for path in tmp_path.rglob("*") if path.is_file()):
        assert path.read_bytes() == (repo / "generated" / path.relative_to(tmp_path)).read_bytes()


def test_what_is_proved_under_another_rule_is_made_by_force(repo: Path, tmp_path: Path) -> None:
    program = shipped("tables/gripper/gripper.rcs", repo)
    assert make([program], tmp_path, altered=True) == ("gripper",)
    assert UNPROVED in (tmp_path / "c" / "gripper.h").read_text(encoding="utf-8")


@pytest.fixture
def shipped_cell(repo: Path, tmp_path: Path) -> Description:
    """The shipped system with its executors, to be tampered with."""
    shutil.copytree(repo / "generated", tmp_path / "generated")
    return replace(description(repo / "tables" / "system.toml"), generated=tmp_path / "generated")


@pytest.mark.parametrize("file", ["c/vision.c", "c/vision.h", "c/vision.json", "python/vision.py"])
def test_one_file_of_one_level_is_enough_to_be_refused(shipped_cell: Description, file: str) -> None:
    _mark(shipped_cell.generated / file)
    with pytest.raises(UnprovedExecutors, match=Path(file).name):
        assemble(shipped_cell, "python", {})


def test_rcsc_run_refuses_what_bears_the_mark(
    repo: Path, shipped_cell: Description, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before anything moves."""
    shutil.copytree(repo / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    _mark(shipped_cell.generated / "python" / "vision.py")
    asked = ["run", "make_boxt", "--no-compile", "--system", str(tmp_path / "tables" / "system.toml")]
    assert run([*asked, "--log", str(tmp_path / "a")]) == 1
    said = capsys.readouterr()
    assert "error[RCS727]" in said.err
    assert "vision.py" in said.err
    assert not (tmp_path / "a").exists()


def _mark(path: Path) -> None:
    before = path.read_text(encoding="utf-8")
    text = f'{{"unproved": "{UNPROVED}",{before[1:]}' if path.suffix == ".json" else _commented(path, before)
    path.write_text(text, encoding="utf-8")


def _commented(path: Path, text: str) -> str:
    return text + (f"# {UNPROVED}\n" if path.suffix == ".py" else f"/* {UNPROVED} */\n")


def test_no_process_runs_what_bears_the_mark(made_by_force: Description) -> None:
    from rcsc.run.processes.supervisor import run_processes

    with pytest.raises(UnprovedExecutors):
        run_processes(made_by_force, "python", {})


# --- other rules ---------------------------------------------------------------------------


def test_first_match_runs_the_first_of_the_lines_that_match() -> None:
    """On inputs at random, aimed at overlaps: of each table the first line that matched, and nothing else changed."""
    changed = 0
    random = Random(5)  # noqa: S311  # repeatable on purpose
    for path, level in ((FIRST_MATCH, "upper"), (PUBLISHED, "task")):
        program = transition_systems(path)[level].program
        table, other = program.tables[0], first_match(program).tables[0]
        kinds = {str(v.name): v.type for v in program.variables}
        for _ in range(3000):
            seen = {
                str(name): value_of_key(kinds[name], random.randint(*key_bounds(kinds[name])))
                for name in table.variables
            }
            before = matching_lines(table, seen)
            assert matching_lines(other, seen) == before[:1]
            changed += len(before) > 1
    assert changed > 100


def test_first_match_leaves_tables_alone_whose_lines_part() -> None:
    program = transition_systems(LAST_ECHO)["upper"].program
    assert first_match(program) == program
    assert may_meet(program.tables[0]) == []


def test_of_two_lines_that_match_the_first_loses_the_command() -> None:
    """`busy` comes first: the new command is seen in that one cycle, and never answered; in the next nobody knows of it."""
    plain = transition_systems(FIRST_MATCH)["upper"]
    key = (Sort.ANSWERED, "pass_down", "new_command")
    assert key not in looked(plain).found  # the cell stops there: two lines match
    found = looked(plain.of(first_match(plain.program)))
    assert [step.line for step in found.trace(*key).steps] == ["start", "busy"]
    shown = rows({"upper": found.ts}, found.finding(key))
    assert [row.wrong for row in shown] == [
        "",
        "the new command is passed over: seen once more, `new_command` is down",
        "",
    ]
    assert shown[-1].leaves == {"new_command": "false"}


def test_numbers_taken_from_the_last_echo_lose_a_command() -> None:
    """Two orders before an echo have one number: the level below never sees the second, and says that it is done."""
    made = transition_systems(LAST_ECHO)
    upper, lower = made["upper"], made["lower"]
    found, _ = followed_together(upper, lower, upper.links.below[0], LEGAL)
    assert isinstance(found, Finding)
    assert found.obligation.sort is Sort.SAME_ORDER
    ran = [(row.level, row.line) for row in rows(made, found)]
    assert ran == [
        ("upper", "start"), ("lower", "rest"), ("upper", "start"), ("lower", "rest"), ("upper", "end"), ("lower", "ended"),
    ]  # fmt: skip
    last = found.ticks[-1]
    job = lower.kinds["command.input_command"]
    assert spell(job, last["lower"].after["command.input_command"]) == "drill"  # taken, never begun
    assert last["upper"].after["report.status_report"] == 0  # `done`, says the level above


def test_the_same_numbers_in_order_lose_none() -> None:
    """The other example numbers its orders one after the other, and so does the small system."""
    for path, level in ((FIRST_MATCH, "upper"), (SYSTEM, "upper")):
        made = transition_systems(path)
        upper = made[level].of(first_match(made[level].program))
        assert followed_together(upper, made["lower"], upper.links.below[0], replace(LEGAL, most=4)) == (
            None,
            (),
        )


def test_a_report_about_another_order_is_found_together(tmp_path: Path) -> None:
    other = small_text("lower", ("ref_command_echo := command.input_command", "ref_command_echo := go"))
    made = transition_systems(small_system(tmp_path, lower=other))
    upper, lower = made["upper"], made["lower"]
    found, _ = followed_together(upper, lower, upper.links.below[0], LEGAL)
    assert isinstance(found, Finding)
    assert (found.level, found.obligation.sort, len(found.ticks)) == ("upper", Sort.OF_ITS_ORDER, 2)


def test_what_falls_to_default_is_found_where_it_is_asked_for(published: Looked) -> None:
    key = (Sort.NO_DEFAULT, "acquire", "")
    assert key not in published.found
    ts = published.ts.of(defaults_reported(published.ts.program))
    found = traces(ts, [obligation_of(ts, *key)], LEGAL)[key]
    assert isinstance(found, Trace)
    assert found.steps[-1].line == "16"


def test_a_two_level_finding_is_a_log_of_both(tmp_path: Path) -> None:
    made = transition_systems(LAST_ECHO)
    found, _ = followed_together(made["upper"], made["lower"], made["upper"].links.below[0], LEGAL)
    assert isinstance(found, Finding)
    assert (
        make([ts.program for ts in made.values()], tmp_path, altered=False) == ()
    )  # each table alone is proved
    system = replace(description(LAST_ECHO), generated=tmp_path)
    record(found, made, system, tmp_path / "a.mcap")
    log = read(tmp_path / "a.mcap")
    assert [level.name for level in log.levels] == ["upper", "lower"]
    assert Replay(log, tmp_path).first_difference() is None


# --- frozen --------------------------------------------------------------------------------


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_frozen_finding_does_what_it_did(path: Path) -> None:
    case = read_case(path)
    assert case_breaks(case) is case.expects_broken


def test_there_are_frozen_findings() -> None:
    assert len(CASES) >= 12


def test_a_case_does_not_say_what_its_own_levels_give_each_other() -> None:
    """So that what the mended level gives is seen."""
    text = (REPO / "tests" / "findings" / "last_echo_lower_same_order_command.json").read_text(
        encoding="utf-8"
    )
    assert [sorted(tick) for tick in json.loads(text)["ticks"]] == [["lower", "upper"]] * 3
    assert [tick["lower"] for tick in json.loads(text)["ticks"]] == [{}, {}, {}]
    made = transition_systems(LAST_ECHO)
    found, _ = followed_together(made["upper"], made["lower"], made["upper"].links.below[0], LEGAL)
    assert isinstance(found, Finding)
    case = REPO / "tests" / "findings" / "any.json"
    assert json.loads(frozen(found, made, LAST_ECHO, case))["ticks"] == json.loads(text)["ticks"]


def test_a_finding_thaws_as_it_was_frozen(published: Looked, tmp_path: Path) -> None:
    for key in ONE_OF_EACH:
        path = tmp_path / "case.json"
        path.write_text(
            frozen(published.finding(key), {"task": published.ts}, PUBLISHED, path), encoding="utf-8"
        )
        case = read_case(path)
        assert not case.expects_broken
        assert case_breaks(case)


def test_a_case_is_kept_once_the_table_is_mended(tmp_path: Path) -> None:
    """The cell that `helps` proposes, and numbers that are not the last echo's."""
    for source, case, edit in (
        (FIRST_MATCH, "first_match_upper_pass_down_one_line_busy_and_start",
         ("| busy  |             |", "| busy  | false       |")),
        (LAST_ECHO, "last_echo_lower_same_order_command",
         ("(lower.inc_command_echo + 1)", "(to_lower.inc_command + 1)")),
    ):  # fmt: skip
        folder = tmp_path / source.stem / "examples" / "later"
        folder.parent.mkdir(parents=True)
        shutil.copy(REPO / "tables" / "rcsc.toml", tmp_path / source.stem / "rcsc.toml")
        mended = shutil.copytree(source.parent, folder) / source.name
        edit_file(mended.with_suffix(".rcs"), edit)
        kept = read_case(REPO / "tests" / "findings" / f"{case}.json")
        assert case_breaks(kept)
        assert not case_breaks(replace(kept, system=mended))


def test_a_case_under_another_rule_is_to_stay_broken(tmp_path: Path) -> None:
    plain = transition_systems(SYSTEM)["upper"]
    found = looked(plain.of(undeferred(plain.program)), replace(LEGAL, most=3))
    finding = found.finding((Sort.ASSUMPTION, "work", "in_step"))
    path = tmp_path / "case.json"
    made = {"upper": found.ts}
    path.write_text(frozen(finding, made, SYSTEM, path, ("without-deferral",)), encoding="utf-8")
    case = read_case(path)
    assert case.expects_broken
    assert case_breaks(case)
    assert not case_breaks(replace(case, variants=()))


WRONG_CASES: dict[str, tuple[Callable[[dict[str, object]], object], str]] = {
    "another format": (lambda said: said.update(format=2), "format 2"),
    "no such system": (lambda said: said.update(system="gone.toml"), "cannot be read"),
    "no such rule": (lambda said: said.update(variants=["last-match"]), "last-match"),
    "no such level": (lambda said: said.update(ticks=[{"arm": {}}]), "no level `arm`"),
    "no such input": (lambda said: said.update(ticks=[{"task": {"cur_state": "f_state"}}]), "no input `cur_state`"),
    "no such member": (lambda said: said.update(ticks=[{"task": {"command.obj": "spoon"}}]), "cannot be `spoon`"),
    "out of range": (lambda said: said.update(ticks=[{"task": {"command.sector": "100"}}]), "cannot be `100`"),
    "no goal": (lambda said: said.pop("goal"), "no frozen finding"),
    "a goal that the level does not have": (
        lambda said: said.update(goal={"level": "task", "what": "waits", "table": "", "name": "x", "lines": []}), "no goal",
    ),
    "an expectation of its own": (lambda said: said.update(expect="perhaps"), "no frozen finding"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG_CASES)
def test_a_case_that_cannot_be_run_says_why(
    wrong: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, why = WRONG_CASES[wrong]
    said = json.loads(
        (REPO / "tests" / "findings" / "published_task_waits_to_emove.json").read_text(encoding="utf-8")
    )
    said["system"] = os.path.relpath(PUBLISHED, tmp_path)
    change(said)
    path = tmp_path / "case.json"
    path.write_text(json.dumps(said), encoding="utf-8")
    with pytest.raises(BadCaseError, match=why):
        case_breaks(read_case(path))
    assert run(["prove", "--case", str(path)]) == 1
    assert "error[RCS754]" in capsys.readouterr().err


# --- what would mend it --------------------------------------------------------------------


def test_the_cell_that_parts_two_lines_is_shown(published: Looked) -> None:
    said = {key[2]: helps(published.ts, published.finding(key)) for key in HAZARDS if key[0] is Sort.ONE_LINE}
    assert said["14 and 15"] == (
        (
            "in line `14` write `/= executing` under `status_in`: proved to part the two lines; line `15` then runs where both match "
            "(command_out blank, not pause; status_out executing, not fail)"
        ),
    )
    assert said["13 and 14"] == (
        "in line `13` write `/= f_state` under `cur_state`: proved to part the two lines; line `14` then runs where both match",
    )


def test_the_weakest_condition_holds_of_just_the_inputs_that_one_line_matches(tmp_path: Path) -> None:
    """In the place of `in_step`, read by the language itself, on every input of the table."""
    program = transition_systems(SYSTEM)["upper"].program
    weakest = weakest_condition(program, table_of(program, "work"))
    [stated] = [row for row in small_text("upper").splitlines() if row.startswith("assume in_step")]
    upper = small_text("upper", (stated, f"assume in_step monitored : {weakest}"))
    changed = small_level(tmp_path, "upper", upper=upper).program
    table, [condition] = (
        table_of(changed, "work"),
        [assumption.condition for assumption in changed.assumptions],
    )
    held = [
        holds(condition, seen) is (len(matching_lines(table, seen)) == 1)
        for seen in inputs_of(changed, table)
    ]
    assert all(held)
    assert len(held) == 2 * 2 * 2 * 3 * 3
    assert not prove_table(changed, table, Options()).findings


def test_a_condition_that_would_be_long_is_not_shown() -> None:
    program = transition_systems(REPO / "tables" / "system.toml")["task"].program
    assert weakest_condition(program, table_of(program, "acquire")) == ""


def table_of(program: Program, name: str) -> Table:
    return next(table for table in program.tables if table.name == name)


def inputs_of(program: Program, table: Table) -> Iterator[dict[str, Value]]:
    """Every input of a table of few."""
    kinds = {str(v.name): v.type for v in program.variables}
    ranges = [
        [
            value_of_key(kinds[name], key)
            for key in range(key_bounds(kinds[name])[0], key_bounds(kinds[name])[1] + 1)
        ]
        for name in table.variables
    ]
    for values in product(*ranges):
        yield dict(zip(map(str, table.variables), values, strict=True))


def test_a_line_that_no_table_has_is_proposed_where_none_matches() -> None:
    """What section 9 says: additional lines would do, but would nearly double the table."""
    shipped_task = transition_systems(REPO / "tables" / "system.toml")["task"]
    ts = shipped_task.of(undeferred(shipped_task.program))
    obligation = obligation_of(ts, Sort.NO_DEFAULT, "acquire", "")
    trace = shortest(ts, obligation, most=3, legal=True)
    assert trace is not None
    finding = of_trace(ts, obligation, trace)
    seen = seen_by_table(ts, finding.broken)
    assert seen is not None
    assert matching_lines(table_of(ts.program, "acquire"), seen) == []
    [why, row] = helps(ts, finding)
    assert why.startswith("no line matches while new_command = false")
    assert "closes this part of the gap and overlaps no other: proved" in row


# --- the command line ----------------------------------------------------------------------


def test_rcsc_prove_keeps_logs_and_cases(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs, cases = tmp_path / "logs", tmp_path / "cases"
    asked = [
        "prove", str(FIRST_MATCH), "--level", "upper", "--first-match", "--log", str(logs), "--freeze",
        str(cases),
    ]  # fmt: skip
    assert run(asked) == 1
    said = capsys.readouterr()
    assert "not proved: no new command is passed over: `new_command`" in said.err
    assert "broken in cycle 2, as the interpreter, the Python and the C executors run it" in said.err
    log = logs / "upper_pass_down_answered_new_command.mcap"
    assert f"rcsc replay {log} --generated {logs / 'generated'}" in said.err
    assert run(["replay", str(log), "--generated", str(logs / "generated")]) == 0
    assert run(["log", str(log)]) == 0
    [case] = cases.iterdir()
    assert run(["prove", "--case", str(case)]) == 0
    assert "broken" in capsys.readouterr().out


def test_rcsc_prove_gives_findings_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prove", str(FIRST_MATCH), "--level", "upper", "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert not said["proved"]
    [one] = said["findings"]
    assert (one["level"], one["table"], one["lines"]) == ("upper", "pass_down", ["busy", "start"])
    assert one["reproduces"]
    assert [row["line"] for row in one["time_line"]] == ["start", "busy and start"]
    assert one["time_line"][-1]["wrong"] == "several lines match"
    assert one["helps"] == [
        (
            "in line `busy` write `false` under `new_command`: proved to part the two lines; "
            "line `start` then runs where both match; no run of 4 cycles shows that it breaks more"
        )
    ]


def test_an_executor_that_differs_is_reported_side_by_side(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    true_make = make

    def tampered(programs: object, folder: Path, *, altered: bool) -> object:
        made = true_make(programs, folder, altered=altered)  # type: ignore[arg-type]  # as it is called
        module = folder / "python" / "first_match.py"
        text = module.read_text(encoding="utf-8")
        module.write_text(edited(text, ("s.cur_state = v_value", "s.cur_state = 0")), encoding="utf-8")
        return made

    monkeypatch.setattr(rcsc.compose.counterexample.explain, "make", tampered)
    assert run(["prove", str(FIRST_MATCH), "--level", "upper"]) == 3
    said = capsys.readouterr().err
    assert "error[RCS903]" in said
    assert "`cur_state` = working by the interpreter, ready by the Python executor" in said


def test_a_case_that_breaks_again_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = json.loads(
        (REPO / "tests" / "findings" / "published_task_waits_to_emove.json").read_text(encoding="utf-8")
    )
    said |= {"system": os.path.relpath(PUBLISHED, tmp_path), "expect": "kept"}
    path = tmp_path / "case.json"
    path.write_text(json.dumps(said), encoding="utf-8")
    assert run(["prove", "--case", str(path)]) == 1
    assert "error[RCS753]" in capsys.readouterr().err


def test_every_rule_that_can_be_off_has_an_option() -> None:
    from rcsc.front.commands.group import imported

    options = {name for param in imported("prove").params for name in param.opts}
    assert {f"--{name}" for name in VARIANTS} <= options
