"""Spin looks through models that another translation makes of the same tables, and finds what `rcsc prove` finds."""

import shutil
import subprocess
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import pytest

from rcsc.commands import run
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.variants import first_match, undeferred
from rcsc.compose.counterexample.trace import shortest
from rcsc.compose.promela.assemble import BROKEN, RESTARTED, TAKEN, TOLD, Model, emit
from rcsc.compose.promela.cycle.aims import CONTRACT_BELOW
from rcsc.compose.promela.cycle.statements import Check, Forget, Fork, Put, read, same
from rcsc.compose.promela.instance import Breadth
from rcsc.compose.promela.lazy_copy import LazyCopy, lazy_copies
from rcsc.compose.promela.liveness import needed
from rcsc.compose.promela.selection import wanted
from rcsc.compose.promela.spell import RESERVED, identifiers
from rcsc.compose.promela.spin import Checked, Search, SpinError, check, tools
from rcsc.compose.promela.trail import rerun, run_of, told
from rcsc.compose.proof.system import transition_systems
from rcsc.lang.model import Bool, Enum

REPO = Path(__file__).parents[2]
SMALL = REPO / "tests" / "data" / "composed"
SHIPPED = REPO / "tables" / "system.toml"
WINDOW = Breadth(numbers=4)
Edit = Callable[[str], str]


@cache
def _levels(path: Path) -> Mapping[str, TransitionSystem]:
    return transition_systems(path)


def levels_of(path: Path) -> dict[str, TransitionSystem]:
    """The levels of a description; read once."""
    return dict(_levels(path))


def changed(folder: Path, origin: Path = SMALL, **edits: Edit) -> dict[str, TransitionSystem]:
    """The small system, or another, with some files edited."""
    shutil.copytree(origin, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".rcsc-cache"))
    for name, edit in edits.items():
        path = next(folder.rglob(f"{name}.rcs"))
        before = path.read_text(encoding="utf-8")
        assert edit(before) != before, f"the edit of {name} does nothing"
        path.write_text(edit(before), encoding="utf-8")
    return transition_systems(folder / "system.toml")


def swap(old: str, new: str) -> Edit:
    return lambda text: text.replace(old, new)


def added(text: str) -> Edit:
    return lambda before: f"{before}\n{text}\n"


def without_line(start: str) -> Edit:
    return lambda text: "\n".join(line for line in text.split("\n") if not line.strip().startswith(start))


def checked(model: Model, search: Search | None = None) -> Checked:
    """What Spin finds; it and a compiler are needed here."""
    assert isinstance(tools(), tuple), "Spin (Debian package spin) and a C compiler are needed"
    found = check(model, search)
    assert isinstance(found, Checked)
    return found


# --- what is right, and what is not ---------------------------------------------------------


@pytest.mark.needs("spin")
@pytest.mark.parametrize(
    ("path", "levels"),
    [
        (SMALL / "system.toml", ("upper",)),
        (SMALL / "system.toml", ("upper", "lower")),
        (SHIPPED, ("gripper",)),
        (SHIPPED, ("vision",)),
    ],
)
def test_in_what_is_proved_spin_finds_nothing_in_any_state(path: Path, levels: tuple[str, ...]) -> None:
    found = checked(emit(levels_of(path), levels, WINDOW))
    assert found.exhaustive
    assert not found.failed
    assert found.states > 10  # and the machine did run


UPPER_FAULTS: dict[str, tuple[Edit, Sort, str, str]] = {
    "any echo will do": (
        swap("cur_state : stage = d_state deferred until lower.inc_command_echo = to_lower.inc_command",
             "cur_state : stage = d_state deferred until lower.inc_command_echo > 0"),
        Sort.ASSUMPTION, "work", "in_step",
    ),
    "a line is missing": (without_line("| 4 "), Sort.NO_DEFAULT, "work", ""),
    "a line is wider": (
        swap("| 3    | false               |       |                |           | d_state   ||",
             "| 3    | false               |       |                |           |           ||"),
        Sort.ONE_LINE, "work", "",
    ),
    "a state is written directly": (
        swap("next cur_state := value", "cur_state := value"), Sort.DEFERRED, "", "cur_state",
    ),
    "numbers are skipped": (
        swap("(to_lower.inc_command + 1) mod", "(to_lower.inc_command + 2) mod"), Sort.NEXT_NUMBER, "", "to_lower",
    ),
    "a PAUSE is not passed on": (
        swap("| nextstate(d_state)        | pause       | executing  |", "| nextstate(d_state)        |             | executing  |"),
        Sort.PAUSES, "", "to_lower",
    ),
    "an invariant does not hold after a restart": (
        added("invariant fine : cur_state /= f_state or status_report /= failed or old_command /= pause"), Sort.INVARIANT, "", "fine",
    ),
    "an invariant does not hold behind a cycle": (
        added("invariant never_goes : to_lower.input_command = pause"), Sort.INVARIANT, "", "never_goes",
    ),
    "a property does not hold": (
        added("property never_fails : status_report /= failed"), Sort.PROPERTY, "", "never_fails",
    ),
    "a property of two cycles does not hold": (
        added("property at_once : command.input_command = work then status_report = executing"), Sort.PROPERTY, "", "at_once",
    ),
    "what a property says lasts does not": (
        added("property busy : status_report = executing until status_report = done"), Sort.PROPERTY, "", "busy",
    ),
    "the number goes further than a property says": (
        added("property one_order : to_lower.inc_command = was to_lower.inc_command"), Sort.PROPERTY, "", "one_order",
    ),
}  # fmt: skip


@pytest.mark.needs("spin")
@pytest.mark.parametrize("fault", UPPER_FAULTS)
def test_a_fault_is_found_by_spin_as_by_the_prover_and_runs(fault: str, tmp_path: Path) -> None:
    edit, sort, table, name = UPPER_FAULTS[fault]
    system = changed(tmp_path, upper=edit)
    model = emit(system, ("upper",), WINDOW)
    found = checked(model)
    assert found.failed
    said = run_of(model, system, found.trail)
    assert (said.aim.what, said.aim.table, said.aim.name) == (sort.value, table, name)
    assert said.ran, said.reason
    every = obligations(system["upper"], system["upper"].cycle(system["upper"].havoc()))
    obligation = next(one for one in every if (one.sort, one.table, one.name) == (sort, table, name))
    trace = shortest(system["upper"], obligation)
    assert trace is not None
    restarted = said.lines[0].endswith("begins anew")
    assert (
        restarted or len(trace.steps) <= said.cycles
    )  # of the runs from the first cycle the prover's is the shortest


@pytest.mark.needs("spin")
def test_a_command_that_is_passed_over_is_found() -> None:
    system = levels_of(REPO / "tables" / "examples" / "later" / "first_match.toml")
    assert not [one for one in emit(system, ("lower",), WINDOW).aims if one.what == Sort.ANSWERED.value]
    system["upper"] = system["upper"].of(first_match(system["upper"].program))
    model = emit(system, ("upper",), WINDOW)
    said = run_of(model, system, checked(model).trail)
    assert (said.aim.what, said.aim.table) == (Sort.ANSWERED.value, "pass_down")
    assert said.ran, said.reason
    assert "line `busy`" in said.lines[-2]


@pytest.mark.needs("spin")
def test_a_forgotten_deferral_is_found_with_both_levels_and_told_in_table_words() -> None:
    system = levels_of(SMALL / "system.toml")
    system["upper"] = system["upper"].of(undeferred(system["upper"].program))
    model = emit(system, ("upper", "lower"), Breadth(numbers=4, split=True))
    said = run_of(model, system, checked(model).trail)
    assert said.aim.shown == "level `upper`, table `work`: assumption: `in_step`"
    assert said.ran, said.reason
    assert any("level `lower`, table `go`, line `1`" in line for line in said.lines)
    assert any("command.input_command = work" in line for line in said.lines)
    assert said.lines[-2].endswith("table `work`, and no further") or "no further" in said.lines[-1]


@pytest.mark.needs("spin")
def test_the_contract_is_checked_where_both_levels_stand_in_the_model(tmp_path: Path) -> None:
    edit = swap("ref_command_echo := command.input_command", "ref_command_echo := go")
    system = changed(tmp_path, lower=edit)
    aims = emit(system, ("upper", "lower"), WINDOW).aims
    own = frozenset(one for one in aims if one.what == Sort.ECHOES.value)
    model = emit(system, ("upper", "lower"), WINDOW, skipped=own)
    said = run_of(model, system, checked(model).trail)
    assert (said.aim.what, said.aim.name) == (CONTRACT_BELOW, "lower")
    assert not checked(emit(system, ("upper",), WINDOW)).failed  # of the level above alone it is assumed


@pytest.mark.needs("spin")
def test_whether_commands_end_is_asked_of_those_that_nobody_else_must_answer() -> None:
    shipped, small = levels_of(SHIPPED), levels_of(SMALL / "system.toml")
    assert [one.levels for one in wanted(shipped) if one.progress] == [("gripper",), ("vision",)]
    patient = checked(emit(shipped, ("vision",), WINDOW, progress=True))
    assert patient.exhaustive
    assert not patient.failed
    waits_for_ever = checked(emit(small, ("lower",), WINDOW, progress=True))
    assert waits_for_ever.failed  # as long as what it waits for does not come


# --- the translation ------------------------------------------------------------------------


@pytest.mark.needs("spin")
@pytest.mark.parametrize(
    ("path", "levels"),
    [
        (SMALL / "system.toml", ("upper", "lower")),
        (SHIPPED, ("task",)),
        (SHIPPED, ("emove",)),
        (SHIPPED, ("task", "emove")),
    ],
)
def test_any_run_of_the_model_is_a_run_of_the_interpreter(
    path: Path, levels: tuple[str, ...], tmp_path: Path
) -> None:
    """Spin's simulator takes its own way through the model; the interpreter, given the same inputs, takes the same lines."""
    system = levels_of(path)
    model = emit(system, levels, Breadth(numbers=4, values=2, most=8, gap=1000, split=len(levels) > 1))
    (tmp_path / "model.pml").write_text(model.text, encoding="utf-8")
    seen = set()
    for seed in range(1, 4):
        ran = subprocess.run(
            ["spin", f"-n{seed}", "-u60000", "model.pml"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        words = (TOLD, BROKEN, RESTARTED, TAKEN)
        lines = [
            line.strip() for line in ran.stdout.splitlines() if line.split()[:1] and line.split()[0] in words
        ]
        events = told(model, lines)
        assert sum(one.word == TOLD for one in events) > 100
        assert rerun(model, system, events) == ""
        seen |= {(one.table, one.line) for one in events}
    assert len(seen) >= 7


@pytest.mark.needs("spin")
def test_the_outside_echoes_the_last_order_or_an_older_one_and_never_the_next(tmp_path: Path) -> None:
    """Numbers are told from the last order on, so that 0 is its number, and 1 would be one that was not sent."""
    model = emit(levels_of(SMALL / "system.toml"), ("upper",), WINDOW)
    (tmp_path / "model.pml").write_text(model.text, encoding="utf-8")
    ran = subprocess.run(
        ["spin", "-n1", "-u20000", "model.pml"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    lines = [line.strip() for line in ran.stdout.splitlines() if line.strip().startswith(TOLD)]
    echoes = {dict(one.values)["upper:lower.inc_command_echo"] for one in told(model, lines)}
    assert echoes == {0, 3}


def test_what_is_read_twice_is_drawn_where_it_is_read_first() -> None:
    seen, copy, other = (read(name, Enum("status", ("done", "failed"))) for name in ("seen", "copy", "other"))
    once = (Forget(("seen",)), Put("copy", seen), Check(0, same(copy, copy)))
    assert lazy_copies([once], frozenset({"seen"}), frozenset())[1] == (LazyCopy("copy", seen),)
    twice = (*once, Put("other", seen), Check(1, same(other, copy)))
    assert lazy_copies([twice], frozenset({"seen"}), frozenset())[1] == ()
    kept = lazy_copies([once], frozenset({"seen"}), frozenset({"seen"}))
    assert kept == ((once,), ())
    written = (Put("seen", copy), *once)
    assert lazy_copies([written], frozenset({"seen"}), frozenset())[1] == ()


def test_what_no_check_asks_for_is_left_out_but_not_what_it_depends_on() -> None:
    one, two, three = (read(name, Bool()) for name in ("one", "two", "three"))
    step = (Put("one", two), Put("three", one), Check(0, one))
    (left,), between = needed([step])
    assert left == (Put("one", two), Check(0, one))
    assert between == {"two"}
    (left,), between = needed([(Check(0, one), Fork(((two, (Put("one", two),)),)), Put("two", three))])
    assert between == {"one", "two", "three"}
    assert len(left) == 3


def test_a_model_that_does_otherwise_than_the_interpreter_is_told_from_one_that_does_not() -> None:
    """The comparison above can fail: the trail of one program is no run of another."""
    system = levels_of(SMALL / "system.toml")
    model = emit(system, ("lower",), WINDOW)
    trail = ("cycle lower 1 1 0 0 -1 0", "cycle lower 0 1 1 1 -1 1", "cycle lower 0 3 0 1 0 0")
    assert len(model.told["lower"]) == 4
    assert "goes another way in cycle 3" in rerun(model, system, told(model, trail))
    right = (*trail[:2], "cycle lower 0 3 0 1 1 0")
    assert rerun(model, system, told(model, right)) == ""


def test_the_same_tables_give_the_same_model_and_its_header_says_what_is_left_out() -> None:
    system = levels_of(SHIPPED)
    first = emit(system, ("gripper",), WINDOW)
    assert first == emit(transition_systems(SHIPPED), ("gripper",), WINDOW)  # read anew
    assert "gripper:waited: 0 .. 150 stands for itself with the gaps closed: 0 .. 1" in first.text
    assert "gripper:inc_command_seen: numbers go round after 4" in first.text
    assert "to_hand_opening_mm" not in first.text.partition("*/")[2]  # nothing asks for it


def test_counters_keep_their_order_and_what_they_are_compared_with() -> None:
    domain = emit(levels_of(SHIPPED), ("task",), Breadth(gap=3)).domains["task:tbuffer_boxt"]
    assert [domain.encoded(value) for value in (0, 10, 99)] == [0, 3, 3]
    wide = emit(levels_of(SHIPPED), ("task",), Breadth(gap=1000)).domains["task:tbuffer_boxt"]
    assert [wide.encoded(value) for value in (0, 10, 99)] == [0, 10, 99]


def test_names_of_promela_s_own_are_not_used() -> None:
    names = identifiers(["init", "a.b", "a:b", "a b", "9", "_", "active"])
    assert len(set(names.values())) == 7
    assert not RESERVED.intersection(names.values())


# --- what stops it --------------------------------------------------------------------------


@pytest.mark.needs("spin")
def test_what_was_not_looked_through_is_not_called_exhaustive() -> None:
    model = emit(levels_of(SMALL / "system.toml"), ("upper",), WINDOW)
    assert not checked(model, Search(depth=100)).exhaustive
    bitstate = checked(model, Search(bitstate=True))
    assert (bitstate.exhaustive, bitstate.bitstate, bitstate.failed) == (False, True, False)


@pytest.mark.needs("spin")
def test_what_spin_refuses_is_a_bug_of_ours() -> None:
    model = emit(levels_of(SMALL / "system.toml"), ("lower",), WINDOW)
    broken = Model(model.levels, model.text + "proctype {", model.aims, model.told, model.domains, {}, ())
    with pytest.raises(SpinError, match="syntax"):
        checked(broken)


# --- the command line -----------------------------------------------------------------------


@pytest.mark.needs("spin")
def test_rcsc_promela_says_what_was_looked_through(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["promela", str(SMALL / "system.toml"), "--levels", "lower"]) == 0
    said = capsys.readouterr().out
    assert "a small instance, no proof" in said
    assert "lower  every state, " in said
    assert "do commands end?  no" in said


@pytest.mark.needs("spin")
def test_rcsc_promela_shows_the_run(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--levels", "upper", "--without-deferral"]
    assert run(["promela", str(SMALL / "system.toml"), *arguments]) == 1
    said = capsys.readouterr().err
    assert "error[RCS751]: level `upper`, table `work`: assumption: `in_step`: broken, as Spin finds" in said
    assert "cycles, run by the interpreter, which breaks it too" in said


def test_rcsc_promela_writes_models_without_spin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shutil, "which", lambda *_, **__: None)
    assert run(["promela", str(SMALL / "system.toml"), "--write", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "lower.pml",
        "lower_progress.pml",
        "upper.pml",
        "upper_lower.pml",
    ]
    assert run(["promela", str(SMALL / "system.toml")]) == 1
    assert "error[RCS755]: Spin is not installed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("levels", "words"),
    [("middle", "there is no level `middle`"), ("lower,upper", "`upper` stands below none of the others")],
)
def test_rcsc_promela_refuses_levels_that_are_not_there(
    levels: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["promela", str(SMALL / "system.toml"), "--levels", levels]) == 2
    assert words in capsys.readouterr().err
