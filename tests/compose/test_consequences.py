"""What follows a finding, up to what the superior takes; its helps in the text; and initial values that runs are searched from."""

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import pytest

import rcsc
from rcsc.compose.contract.beginning import BadStartError, starts
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.applied import Texts
from rcsc.compose.counterexample.consequence import MOST, Consequence, How, consequences, spelled_report, told
from rcsc.compose.counterexample.cycle_run import one_cycle
from rcsc.compose.counterexample.finding import Finding, of_trace
from rcsc.compose.counterexample.frozen import case_breaks, read_case
from rcsc.compose.counterexample.lasso import lassos
from rcsc.compose.counterexample.lasso import obligation_of as obligation_to_end
from rcsc.compose.counterexample.pair import followed_together
from rcsc.compose.counterexample.repair import Repairs, helps, repairs, tried
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.lang.interpret import initial
from rcsc.lang.model import Value, spell, value_of_text
from rcsc.proof.solvers import smt
from rcsc.proof.table.mending import Outcome
from rcsc.proof.table.repair import PartingCell, Partings, left_by, with_cells
from rcsc.proof.table.verdict import Overlap
from tests.applied import campaign
from tests.support.programs.systems import SYSTEM, going, lower_level, small_level, small_text, solo_system
from tests.support.programs.texts import edit_file
from tests.support.proved import obligation_of, ran

REPO = Path(__file__).parents[2]
PUBLISHED = REPO / "tables" / "examples" / "published" / "system.toml"
LAST_ECHO = REPO / "tables" / "examples" / "later" / "last_echo.toml"
LEGAL = TraceSearch(most=4, legal=True)


def finding_of(
    ts: TransitionSystem, sort: Sort, table: str, name: str, search: TraceSearch = LEGAL
) -> Finding:
    """Return the shortest run that breaks an obligation."""
    obligation = obligation_of(ts, sort, table, name)
    [trace] = traces(ts, [obligation], search).values()
    assert isinstance(trace, Trace)
    return of_trace(ts, obligation, trace)


@dataclass(frozen=True)
class Followed:
    """A finding of a level and its consequences."""

    ts: TransitionSystem
    finding: Finding
    every: tuple[Consequence, ...]

    @property
    def ends(self) -> set[tuple[str, str, tuple[str, ...]]]:
        """How each ends: the way, what the superior takes, and the lines that match in the last cycle."""
        return {
            (then.how.value, spelled_report(self.ts, then.report), then.last.matched) for then in self.every
        }


def followed(
    ts: TransitionSystem, finding: Finding, search: TraceSearch = LEGAL, further: int = 4
) -> Followed:
    return Followed(ts, finding, consequences(ts, finding, search, further))


@pytest.fixture(scope="module")
def task() -> TransitionSystem:
    return transition_systems(PUBLISHED)["task"]


@pytest.fixture(scope="module")
def empty(task: TransitionSystem) -> Followed:
    """The published ACQUIRE finds its buffer empty."""
    return followed(task, finding_of(task, Sort.DEFERRED, "", "cur_state"))


# --- what follows ----------------------------------------------------------------------------


def test_an_empty_buffer_ends_in_all_three_ways(empty: Followed) -> None:
    assert {
        ("answered", "`done` with `failure = buf`", ("8",)),
        ("stops", "`executing` with `failure = buf`", ("14", "15")),
        ("answered", "`failed` with `failure = buf`", ("14",)),
    } <= empty.ends
    assert len(empty.every) == MOST
    assert {then.cycle for then in empty.every[:5]} == {3}
    assert all(then.shared for then in empty.every)


def reports_of_emove(finding: Finding) -> Iterator[dict[str, Value]]:
    """Every report of E-MOVE that can come after the finding: of an order given so far, none older than the last echo."""
    steps = [tick["task"] for tick in finding.ticks]
    orders = [(step.after["to_emove.inc_command"], step.after["to_emove.input_command"]) for step in steps]
    echoed = steps[-1].after["emove.inc_command_echo"]
    for (number, command), status in product(orders, range(3)):
        if int(number) >= int(echoed):
            yield {
                "emove.inc_command_echo": number,
                "emove.ref_command_echo": command,
                "emove.status_report": status,
            }


def test_every_way_in_the_next_cycle_is_told_and_no_other(empty: Followed) -> None:
    """By trying each report of E-MOVE: what is told is what the interpreter does, the superior's view for view."""
    last = empty.finding.broken
    ends = set()
    for report in reports_of_emove(empty.finding):
        step = one_cycle(empty.ts, last.after, {**last.taken, **report})
        status, reason = (
            spell(empty.ts.kinds[leaf], step.after[leaf])
            for leaf in ("report.status_report", "report.failure")
        )
        how = "stops" if step.ends_the_run else "answered" if status != "executing" else ""
        ends |= {(how, f"`{status}` with `failure = {reason}`", step.matched)} if how else set()
    assert len(ends) == 5
    nearest = Followed(empty.ts, empty.finding, tuple(then for then in empty.every if then.cycle == 3))
    assert nearest.ends == ends


def test_a_run_is_followed_for_no_longer_than_asked(task: TransitionSystem, empty: Followed) -> None:
    assert followed(task, empty.finding, further=0).every == ()
    assert {then.cycle for then in followed(task, empty.finding, further=1).every} == {3}


def test_the_superior_keeps_its_command_meanwhile(task: TransitionSystem) -> None:
    for key in ((Sort.ANSWERED, "acquire", "new_command"), (Sort.WAITS, "", "to_emove")):
        now = followed(task, finding_of(task, *key))
        for then in now.every:
            cycles = [tick["task"] for tick in then.run.ticks]
            at = then.run.broken_at - 1
            assert len({step.taken["command.inc_command"] for step in cycles[at:]}) == 1
            assert then.shared == (cycles[: at + 1] == [tick["task"] for tick in now.finding.ticks][: at + 1])
        assert {then.how for then in now.every} == {How.ANSWERED, How.STOPS, How.CHANGED}


def test_a_command_that_is_passed_over_is_told_to_be_done(task: TransitionSystem) -> None:
    """Nothing was ordered of E-MOVE."""
    first, *others = followed(task, finding_of(task, Sort.ANSWERED, "acquire", "new_command")).every
    assert told(task, first) == "in cycle 2 `workstation` takes `done` as the answer to `acquire` (number 1)"
    assert {tick["task"].after["to_emove.inc_command"] for tick in first.run.ticks} == {0}
    assert (
        "in cycle 3 the answer to `acquire` (number 1) changes: `workstation` took `done`, and now takes `executing`"
        in [told(task, other) for other in others]
    )


def test_where_a_cycle_stops_the_system_the_last_report_is_told(task: TransitionSystem) -> None:
    finding = finding_of(task, Sort.ONE_LINE, "acquire", "12 and 14")
    [then] = followed(task, finding).every
    assert then.run is finding
    assert told(task, then) == (
        "in cycle 4 lines `12` and `14` both match and the system stops; "
        "the last report to `workstation` is `executing` with `failure = buf`, of `acquire` (number 1)"
    )


def test_what_never_ends_is_told_as_the_superior_sees_it(tmp_path: Path) -> None:
    """A lasso is its own consequence; a run after another finding may come to one, too."""
    waits = lower_level(going("2", there="false"), going("3", there="true"))
    ts = small_level(tmp_path, "lower", lower=waits)
    found = lassos(ts, ("go",), TraceSearch(8, legal=True))["go"]
    assert not isinstance(found, Exception)
    finding = of_trace(ts, obligation_to_end("go"), found.trace)
    [then] = followed(ts, replace(finding, lasso=found.first)).every
    assert told(ts, then) == (
        "cycles 3 to 3 can repeat for ever: `upper` takes `executing`, and `go` (number 1) is not answered"
    )


def test_two_levels_are_followed_on_to_the_answer_of_the_upper_one() -> None:
    """Both orders get one number: the drill is told to be done, and the lower level never took it for new."""
    systems = transition_systems(LAST_ECHO)
    upper, lower = systems["upper"], systems["lower"]
    finding, [then] = followed_together(upper, lower, upper.links.below[0], TraceSearch(8), further=4)
    assert isinstance(finding, Finding)
    assert (finding.level, then.level, then.shared) == ("lower", "upper", True)
    assert told(upper, then) == "in cycle 3 `station` takes `done` as the answer to `drill` (number 2)"
    assert not any(tick["lower"].line == "start" for tick in then.run.ticks if "lower" in tick)
    assert followed_together(upper, lower, upper.links.below[0], TraceSearch(8)) == (finding, ())


def test_a_level_that_nobody_commands_has_no_superior_to_tell(
    task: TransitionSystem, empty: Followed
) -> None:
    alone = replace(task, links=replace(task.links, above=None))
    assert consequences(alone, empty.finding, LEGAL, 4) == ()


# --- what repairs break ------------------------------------------------------------------------

LATER = ("10", "11", "12", "13")
EXECUTING = "in line `14` write `/= executing` under `status_in`: proved to part the two lines"


@pytest.fixture(scope="module")
def mended(task: TransitionSystem) -> Repairs:
    """What would part each pair of lines of the published table, tried."""
    pairs = [f"{line} and 14" for line in LATER] + ["14 and 15"]
    findings = [finding_of(task, Sort.ONE_LINE, "acquire", pair) for pair in pairs]
    return repairs(task, findings, [], 4)


def cells_of(ts: TransitionSystem, *wanted: tuple[str, str]) -> tuple[PartingCell, ...]:
    """The smallest cell in a line that parts it from another."""
    [table] = ts.program.tables
    names = [str(line.name) for line in table.lines]
    found = []
    for line, other in wanted:
        first, second = sorted((names.index(line), names.index(other)))
        every = Partings(ts.program, table).cells(Overlap(first, second, {}))
        found.append(next(cell for cell in every if table.lines[cell.line].name == line))
    return tuple(found)


def test_a_repair_that_breaks_nothing_more_stands_alone(mended: Repairs) -> None:
    for line, helps_ in zip(LATER, mended.helps, strict=False):
        [help_] = helps_
        assert help_ == (
            f"in line `{line}` write `/= f_state` under `cur_state`: proved to part the two lines; "
            "line `14` then runs where both match; no run of 4 cycles shows that it breaks more"
        )


def test_a_repair_that_revokes_an_answer_comes_after_one_that_does_not(mended: Repairs) -> None:
    """What is smallest lets line 15 report *executing* after *failed*; the other only loses the reason, and says where."""
    first, second, third = mended.helps[-1]
    assert first.startswith("in line `15` write `/= f_state` under `cur_state`: proved to part")
    assert "DEFAULT takes what else it loses" in first
    assert (
        "in cycle 2 DEFAULT runs, where new_command = true, status_in = executing, cur_state = f_state"
        in first
    )
    assert "from `failed` with `failure = cmd` to `failed` with `failure = state`" in first
    assert second.startswith(EXECUTING)
    assert second.endswith(
        "but in cycle 2 line `15` changes the answer to a command "
        "from `failed` with `failure = state` to `executing` with `failure = state`"
    )
    assert "from `done` to `failed`" in third


def test_the_best_repairs_are_tried_together(mended: Repairs) -> None:
    begins = "the first help of each of these 5 findings, all together: proved that no two lines match any more; but "
    assert mended.together.startswith(begins)
    assert "to `executing`" not in mended.together


def test_the_smallest_repairs_together_report_executing_after_failed(task: TransitionSystem) -> None:
    [table] = task.program.tables
    smallest = cells_of(task, *((line, "14") for line in LATER), ("14", "15"))
    assert left_by(task.program, table, smallest) == ""
    after = Texts().of(task, "acquire").together(smallest)
    assert after is not None
    assert after.ts is not None
    trial = tried(after.ts, table, smallest, [], 4)
    assert trial.rank[:2] == (1, 0)
    [breaks] = trial.breaks
    assert re.search(r"line `15` changes .* from `failed` .* to `executing`", breaks)


def test_a_repair_does_in_the_text_what_is_said_of_it(task: TransitionSystem, tmp_path: Path) -> None:
    """The cells are those of the edited text; and the run that is told of runs there."""
    folder = tmp_path / "examples"
    shutil.copytree(REPO / "tables" / "examples", folder, ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copy(REPO / "tables" / "rcsc.toml", tmp_path)
    row = "| 14   | false       |                |           | f_state   |"
    edit_file(
        folder / "published" / "task.rcs",
        (row, row.replace("|           | f_state", "| /= executing | f_state")),
    )
    edited = transition_systems(folder / "published" / "system.toml")["task"]
    [table], [now] = task.program.tables, edited.program.tables
    after = with_cells(task.program, table, cells_of(task, ("14", "15")))
    assert after is not None
    assert [lines.tests[2] and lines.tests[2].box for lines in after.lines] == [
        lines.tests[2] and lines.tests[2].box for lines in now.lines
    ]
    inputs = {name: initial(edited.program)[name] for name in edited.inputs}
    kind = edited.kinds["emove.status_report"]
    given = [
        inputs | {"emove.status_report": value_of_text(kind, word) or 0} for word in ("failed", "executing")
    ]
    steps = ran(edited, initial(edited.program), given)
    assert [step.line for step in steps] == ["16", "15"]
    told_ = [spell(kind, step.after["report.status_report"]) for step in steps]
    assert told_ == ["failed", "executing"]


def test_what_was_proved_and_is_broken_by_a_repair_is_told_first(task: TransitionSystem) -> None:
    """As if it had been proved that no order is replaced before its echo."""
    [table] = task.program.tables
    kept = [obligation_of(task, Sort.WAITS, "", "to_emove")]
    [cell] = cells_of(task, ("10", "14"))
    after = Texts().of(task, "acquire").parted(cell)
    assert after.ts is not None
    trial = tried(after.ts, table, (cell,), kept, 4)
    assert trial.rank[0] == 1
    assert trial.breaks[0] == f"in cycle 2 this is no longer so: {kept[0].shown}"


def test_repairs_that_contradict_each_other_say_so(tmp_path: Path) -> None:
    """Each alone parts two lines; together they leave the middle line nothing."""
    rows = "\n".join(
        f"| {name} | {cell} || {name} |" for name, cell in (("low", "<= 4"), ("all", ""), ("high", ">= 5"))
    )
    path = tmp_path / "a.rcs"
    path.write_text(
        "enum word { low, all, high }\ninput x : int 0 .. 9\noutput o : word\n"
        f"table t {{\n| line | x || o |\n|------|---||---|\n{rows}\n}}\n"
    )
    *_, last = [found for found in rcsc.check(path, cache=False).diagnostics if found.code.value == "RCS402"]
    assert "line `high` then runs where both match (o high, not all)" in last.help[0]
    *_, note = last.notes
    assert (
        note == "the helps of these 2 overlaps together: they contradict each other: a line would never match"
    )


# --- other initial values ----------------------------------------------------------------------


def test_initial_values_are_read_by_level(task: TransitionSystem) -> None:
    systems = {"task": task}
    assert starts(systems, "") == {}
    assert starts(systems, "tbuffer_boxt = 3, task.obj_acquired=true,") == {
        "task": {"tbuffer_boxt": 3, "obj_acquired": True}
    }
    kind = task.kinds["cur_state"]
    [begun] = starts(systems, "cur_state = state_5").values()
    assert {leaf: spell(kind, value) for leaf, value in begun.items()} == {
        "cur_state": "state_5",
        "cur_state.next": "state_5",
    }
    [begun] = starts(systems, "cur_state.next = f_state, cur_state = state_5").values()
    assert spell(kind, begun["cur_state.next"]) == "f_state"


@pytest.mark.parametrize(
    ("text", "message", "help_"),
    [
        ("tbufer_boxt = 0", "no level has a variable `tbufer_boxt`", "did you mean `tbuffer_boxt`?"),
        ("task.tbuffer = 0", "no level has a variable `task.tbuffer`", "did you mean `task.tbuffer_boxt`?"),
        (
            "command = acquire",
            "no level has a variable `command`",
            "it is a record or an array; name a part: ",
        ),
        ("cur_state = f_stat", "`cur_state` cannot be `f_stat`", "did you mean `f_state`?"),
        ("tbuffer_boxt = 1000000", "`tbuffer_boxt` cannot be `1000000`", "it is a number from 0 to "),
        ("obj_acquired = 1", "`obj_acquired` cannot be `1`", "it is true or false"),
        (
            "tbuffer_boxt",
            "`tbuffer_boxt` does not say which value a variable has",
            "write `variable = value`",
        ),
        ("tbuffer_boxt = 1, task.tbuffer_boxt = 1", "`task.tbuffer_boxt` is given twice", ""),
    ],
)
def test_what_runs_cannot_begin_with_is_told(
    task: TransitionSystem, text: str, message: str, help_: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(BadStartError) as refused:
        starts({"task": task}, text)
    assert str(refused.value) == message
    assert not help_ or refused.value.helps[0].startswith(help_)
    assert run(["prove", str(PUBLISHED), "--where", text]) == 2
    assert message in capsys.readouterr().err.replace("\n", " ")
    with pytest.raises(rcsc.CodedError, match=re.escape(message)):
        rcsc.prove(PUBLISHED, where=text)


def test_a_variable_of_several_levels_needs_its_level() -> None:
    with pytest.raises(BadStartError, match="`cur_state` is a variable of several levels") as refused:
        starts(transition_systems(SYSTEM), "cur_state = d_state")
    assert refused.value.helps == ("write `lower.cur_state` or `upper.cur_state`",)


def test_values_that_an_invariant_excludes_are_refused(tmp_path: Path) -> None:
    text = small_text("lower", ("\nlevel lower", "\ninvariant few : inc_command_seen < 9\n\nlevel lower"))
    ts = small_level(tmp_path, "lower", lower=text)
    with pytest.raises(BadStartError, match="invariant `few` does not hold"):
        starts({"lower": ts}, "inc_command_seen = 9")
    assert starts({"lower": ts}, "inc_command_seen = 8") == {"lower": {"inc_command_seen": 8}}


# --- the command line --------------------------------------------------------------------------


def demonstration() -> str:
    """The command of the guide that shows what an empty buffer leads to."""
    guide = (REPO / "tables" / "guide" / "README.md").read_text(encoding="utf-8")
    [command] = re.findall(r"^(rcsc prove \S*published/system.toml --where [^#\n]*)", guide, re.MULTILINE)
    return str(command)


def test_the_demonstration_shows_each_way_with_its_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From ten flags and no box top: the run is that of a box top, and is kept as a case and as logs that replay."""
    monkeypatch.chdir(REPO)
    words = shlex.split(demonstration())[1:]
    kept = ["--log", str(tmp_path / "logs"), "--freeze", str(tmp_path)]
    assert run([*words, *kept]) == 1
    err = capsys.readouterr().err
    [section] = [part for part in err.split("error[RCS751]") if "no state is written directly" in part]
    assert "fbuffer_flag = 10" in section
    for sentence, line in (
        (
            "`workstation` takes `done` with `failure = buf` as the answer to `acquire` (number 1)",
            "| acquire: 8 ",
        ),
        ("lines `14` and `15` both match and the system stops", "| acquire: 14 and 15 "),
        (
            "`workstation` takes `failed` with `failure = buf` as the answer to `acquire` (number 1)",
            "| acquire: 14 ",
        ),
    ):
        _, _, after = section.partition(sentence)
        assert line in after.partition("= then")[0], sentence
    logs = tmp_path / "logs"
    assert f"N from 1 to {MOST}: {logs / 'task_deferred_cur_state_then_N.mcap'}" in section
    for number in range(1, MOST + 1):
        log = logs / f"task_deferred_cur_state_then_{number}.mcap"
        assert run(["replay", str(log), "--generated", str(logs / "generated")]) == 0
    case = tmp_path / "published_task_deferred_cur_state.json"
    assert json.loads(case.read_text(encoding="utf-8"))["start"] == {
        "task": {"tbuffer_boxt": "0", "fbuffer_flag": "10"}
    }
    assert case_breaks(read_case(case))


def test_no_verdict_depends_on_where_runs_begin(capsys: pytest.CaptureFixture[str]) -> None:
    """Nor is a restart looked for: it would begin elsewhere."""
    forms = []
    for options in ([], ["--where", "to_lower.inc_command = 5", "--follow", "0"]):
        assert run(["prove", str(LAST_ECHO), "--level", "upper", "--json", "--no-cache", *options]) == 1
        forms.append(json.loads(capsys.readouterr().out))
    assert [form["levels"][0]["goals"] for form in forms[:1]] == [
        form["levels"][0]["goals"] for form in forms[1:]
    ]
    usual, other = (form["findings"] for form in forms)
    assert [finding["time_line"][0]["line"] for finding in other if finding["time_line"]] == ["begins"] * len(
        other
    )
    assert [finding["follows"] for finding in other] == [[]] * len(other)
    assert any(finding["follows"] for finding in usual)


# --- helps in the text ---------------------------------------------------------------------------

HEAD = "input a : int 0 .. 3\noutput o : int 0 .. 9\n"
LEVEL = "level solo { period 40 [ms] table t }\n"
ABOVE = f"""{HEAD}table t {{
  | line | a || o |
  |------|---||---|
  | p above q | <= 2 || 1 |
  | q | >= 2 || 2 |
  | r | = 2 || 3 |
}}
{LEVEL}"""
"""Less of p is more of q, which then meets r; less of r leaves it nothing."""

PLAIN = ABOVE.replace(">= 2", ">= 3")
"""No line has what p loses but r."""


def finding(ts: TransitionSystem, sort: Sort, name: str = "") -> Finding:
    obligation = obligation_of(ts, sort, "t", name)
    [trace] = traces(ts, [obligation], TraceSearch(most=4, legal=True)).values()
    assert isinstance(trace, Trace)
    return of_trace(ts, obligation, trace)


def level(folder: Path, text: str) -> TransitionSystem:
    return transition_systems(solo_system(folder, text))["solo"]


def test_a_cell_that_meets_another_line_once_written_is_not_offered(tmp_path: Path) -> None:
    """Of the table as resolved, `<= 1` in p parts it from r; as written, q has 2, too."""
    ts = level(tmp_path, ABOVE)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    assert repairs(ts, [found], [], 4).helps == (helps(ts, found),)
    assert helps(ts, found) == ("lines `p` and `r` both match while a = 2",)


def test_a_cell_that_is_proved_is_proved_of_its_text(tmp_path: Path) -> None:
    """Without q what p loses is r's alone; and so says `rcsc check` of the text with the cell."""
    ts = level(tmp_path, PLAIN)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    said = "in line `p` write `<= 1` under `a`: proved to part the two lines; line `r` then runs where both match (o 3, not 1)"
    assert helps(ts, found) == (said,)
    assert repairs(ts, [found], [], 4).helps == ((f"{said}; no run of 4 cycles shows that it breaks more",),)
    edit_file(tmp_path / "solo.rcs", ("| p above q | <= 2 |", "| p above q | <= 1 |"))
    assert run(["check", str(tmp_path / "solo.rcs")]) == 0


def test_what_was_saved_since_is_not_proved(tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    edit_file(tmp_path / "solo.rcs", ("| q | >= 3 ||", "| q | >= 2 ||"))
    (help_,) = helps(ts, found)
    assert ": not proved to part the two lines; " in help_
    [(tried,)] = repairs(ts, [found], [], 4).helps
    assert tried == help_, "and no run of a text that is not known is told of"


def test_a_cell_past_the_budget_is_not_proved(tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN)
    (help_,) = helps(ts, finding(ts, Sort.ONE_LINE, "p and r"), Texts(smt.Budget(100, of_all=True)))
    assert ": not proved to part the two lines; " in help_


@pytest.mark.parametrize("saved", [False, True])
def test_a_line_is_proved_of_the_text_that_has_it(saved: bool, tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN.replace("<= 2", "< 1"))
    found = finding(ts, Sort.SOME_LINE)
    if saved:
        edit_file(tmp_path / "solo.rcs", ("| q | >= 3 ||", "| q | >= 2 ||"))
    *_, row = helps(ts, found)
    standing = "not proved" if saved else "proved"
    assert row == f"a line `| new | 1 || ... |` closes the gap and overlaps no other: {standing}"


WEAKEST = """state n : int 0 .. 3
{stated}
table t assuming few {{
  | line | n    || n     |
  |------|------||-------|
  | up   | <= 1 || n + 1 |
  | top  | 2    || 3     |
}}
level solo {{ period 40 [ms] table t }}
"""


@pytest.mark.parametrize("saved", [False, True])
def test_the_weakest_condition_is_proved_of_the_text_that_assumes_it(saved: bool, tmp_path: Path) -> None:
    ts = level(tmp_path, WEAKEST.format(stated="assume few monitored : n <= 2"))
    obligation = obligation_of(ts, Sort.ASSUMPTION, "t", "few")
    [trace] = traces(ts, [obligation], TraceSearch(most=4, legal=True)).values()
    assert isinstance(trace, Trace)
    if saved:
        edit_file(tmp_path / "solo.rcs", ("| <= 1 |", "| <= 2 |"))
    *_, said = helps(ts, of_trace(ts, obligation, trace))
    standing = "not proved" if saved else "proved"
    assert said == f"exactly one line matches under no more than this: not (n = 3): {standing}"


@pytest.mark.parametrize(
    ("condition", "outcome"),
    [
        ("n /= 3", Outcome.HOLDS),
        ("n <= 1", Outcome.FAILS),  # and n = 2
        ("n < 9", Outcome.FAILS),  # and not n = 3
        ("m <= 2", Outcome.FAILS),
    ],
)
def test_a_condition_that_is_not_the_weakest_is_not_proved(
    condition: str, outcome: Outcome, tmp_path: Path
) -> None:
    ts = level(tmp_path, WEAKEST.format(stated="assume few monitored : n <= 2"))
    assert Texts().of(ts, "t").under(condition) is outcome


def test_a_cell_of_a_used_file_is_written_there(tmp_path: Path) -> None:
    """The level stands in one file, and its table in another that it uses."""
    (tmp_path / "part.rcs").write_text(PLAIN.replace(LEVEL, ""), encoding="utf-8")
    ts = level(tmp_path, f"use part\n{LEVEL}")
    (help_,) = helps(ts, finding(ts, Sort.ONE_LINE, "p and r"))
    assert help_.startswith("in line `p` write `<= 1` under `a`: proved to part")


def test_what_is_proved_of_drawn_tables_holds_of_their_texts() -> None:
    came, _ = campaign(9, "short")
    assert came[Outcome.HOLDS] >= 9
