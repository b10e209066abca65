"""The interactive shell: from outside as a user drives it, and through its session."""

import io
import os
import pty
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from rcsc.base.diagnostics.codes import Code
from rcsc.desk.shell.commands import HELP, Commands, RunOrder
from rcsc.desk.shell.reload.reload import Origin, kept, laid_out
from rcsc.desk.shell.session import Session
from rcsc.front.commands import run as in_process
from rcsc.front.commands.group import commands as group
from rcsc.run.adopt import Begun
from rcsc.run.description import description
from rcsc.run.log.read import read
from rcsc.run.log.replay import Replay
from rcsc.run.system import Kind, assemble, signatures
from rcsc.views.diff.changes.difference import ProgramDifference
from rcsc.views.diff.compare import compare
from rcsc_cell.cell.ready import plant
from rcsc_cell.workstation.prepared import database_of
from tests.support.programs.examples import WALKER
from tests.support.programs.stages import compile_beside
from tests.support.programs.texts import edit_file, edited, system
from tests.support.shells import alone, do, refused, state

REPO = Path(__file__).parents[2]
SYSTEM = REPO / "tables" / "system.toml"
GRIPPER = "gripper/gripper.rcs"
RCSC = [sys.executable, "-c", "from rcsc.front.commands import main; main()", "shell"]
MOVE = ["workstation.inc_command = 1", "workstation.input_command = move", "workstation.dest_locpt = 3"]
DONE = "run until task.to_workstation.inc_command_echo = 1 and task.to_workstation.status_report = done"


def inhabited(kind: Kind = "c") -> Commands:
    """Levels with the cell's database and plant."""
    said = description(SYSTEM)
    database = database_of(said, signatures(said))
    system = assemble(said, kind, database.queries, (plant(database, "kinematic"),))
    return Commands(Session(system, Origin(SYSTEM, said, kind, database.queries)))


@pytest.fixture
def shell() -> Commands:
    return alone()


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the project, to be edited; its system's description."""
    shutil.copytree(REPO / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copytree(REPO / "generated", tmp_path / "generated")
    return tmp_path / "tables" / "system.toml"


def script(text: str, *args: str, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    path = tmp_path / "script.txt"
    path.write_text(text, encoding="utf-8")
    return run("--script", str(path), *args)


def run(*args: str, stdin: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run([*RCSC, *args], cwd=REPO, input=stdin, capture_output=True, text=True, check=False)


# --- from outside ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["c", "python"])
def test_a_script_moves_the_robot_and_says_so(tmp_path: Path, kind: str) -> None:
    lines = [
        *MOVE,
        "run to task.move.13  # the answer",
        "expect task.to_workstation.status_report = done and task.current_loc = 3",
        "",
    ]
    done = script("\n".join(lines), "--executor", kind, tmp_path=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1].endswith(": line task.move.13")


def test_a_script_stops_at_the_first_command_that_fails(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "script.txt"
    path.write_text("step 2\nexpect task.emove.resting = false\nstep 3\n", encoding="utf-8")
    status, out, err = within(capfd, "--script", str(path))
    assert status == 1
    assert "cycle 2" in out
    assert "cycle 5" not in out
    said = "`task.emove.resting = false` does not hold: task.emove.resting = true"
    assert err == f"{path}:2: error[RCS736]: {said}\n"


def test_commands_from_a_pipe_end_with_quit() -> None:
    done = run("--alone", "--executor", "python", stdin="step\nquit\nnonsense\n")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("cycle 1: task.pause_task.1")


def test_wrong_usage_is_2_and_a_wrong_system_is_1(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert in_process(["shell", "--script", "no such file"]) == 2
    assert in_process(["shell", "--executor", "fortran"]) == 2
    bad = tmp_path / "system.toml"
    bad.write_text("name = 1", encoding="utf-8")
    assert in_process(["shell", str(bad)]) == 1
    assert "error[RCS721]" in capfd.readouterr().err


def within(capfd: pytest.CaptureFixture[str], *args: str) -> tuple[int, str, str]:
    """The same in this process, with levels in Python and nothing outside."""
    capfd.readouterr()
    status = in_process(["shell", str(SYSTEM), "--alone", "--executor", "python", *args])
    return status, *capfd.readouterr()


def test_a_script_is_a_text_of_bounded_size(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "bytes").write_bytes(b"step\n\xff\n")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1 << 32)
    whys = {
        "fifo": "is not a regular file",
        "zero": "is not a regular file",
        "bytes": "UTF-8 at byte 5",
        "large": "64 MiB",
    }
    for name, why in whys.items():
        status, out, err = within(capfd, "--script", str(tmp_path / name))
        assert (status, out) == (1, "")
        assert "error[RCS723]" in err
        assert why in err


@pytest.mark.parametrize(
    ("said", "why"),
    [(b"\xff\n", "UTF-8 in line 2"), (b"x" * 100_000, "line 2 of more than")],
    ids=["bytes", "long"],
)
def test_bytes_that_are_no_text_end_the_shell_in_order(
    said: bytes, why: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"step\n" + said)))
    status, out, err = within(capfd)
    assert status == 1
    assert out.startswith("cycle 1")
    assert why in err
    assert "error[RCS723]" in err


def test_a_script_is_interrupted_between_cycles(tmp_path: Path) -> None:
    path = tmp_path / "script.txt"
    path.write_text("step\nrun until task.cur_state = state_8\nstep 7\n", encoding="utf-8")
    ran = subprocess.Popen(
        [*RCSC, "--alone", "--script", str(path), "--executor", "python"],
        cwd=REPO, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    assert ran.stdout is not None
    assert ran.stdout.readline().startswith("cycle 1:")
    ran.send_signal(signal.SIGINT)
    out, _ = ran.communicate()
    assert ran.returncode == 130
    assert "cycle" not in out


def test_on_a_terminal_it_asks_completes_and_keeps_its_history(tmp_path: Path) -> None:
    pytest.importorskip("prompt_toolkit")
    here, there = pty.openpty()
    ran = subprocess.Popen(
        [*RCSC, "--alone", "--executor", "python", str(SYSTEM)], cwd=tmp_path, stdin=there, stdout=there, stderr=there,
        env={**os.environ, "XDG_STATE_HOME": str(tmp_path), "TERM": "xterm", "PROMPT_TOOLKIT_NO_CPR": "1"}, start_new_session=True,
    )  # fmt: skip
    os.close(there)
    try:
        _converse(here, ran)
        assert ran.wait() == 0
    finally:
        ran.kill()
        ran.wait()
        os.close(here)
    log = read(tmp_path / "run.mcap")
    assert log.complete
    (told,) = log.level("task").restarts
    assert log.first + 1 < told.tick < log.last  # while it ran
    assert log.level("task").set_by_hand(told) == {"tbuffer_boxt": "7"}
    assert "+inc_command_seen ?" in (tmp_path / "rcsc" / "shell-history").read_text(encoding="utf-8")


def _converse(here: int, ran: subprocess.Popen[bytes]) -> None:
    _until(here, "task>")
    os.write(here, b"INC_COMMAND_S\t")
    _until(here, "inc_command_seen")
    os.write(here, b" ?\r")
    _until(here, "task.inc_command_seen = 0")
    os.write(here, b"nonsense\r")
    _until(here, "RCS731")
    os.write(here, b"break to_workstation.status_report = failed\r")
    _until(here, "breakpoint 1: to_workstation.status_report = failed")
    os.write(here, b"run\r")
    _computes(ran.pid)
    ran.send_signal(signal.SIGINT)
    _until(here, "interrupted")
    os.write(here, b"delete 1\r")
    _until(here, "task>")
    os.write(here, b"log run.mcap\r")
    _until(here, "is written to")
    os.write(here, b"run\r")
    _computes(ran.pid)
    os.write(here, b"TBUFFER-BOXT = 7\n")
    _until(here, "task.tbuffer_boxt = 7")
    os.write(here, b"tbuffer_boxt ?\nundo\n")
    _until(here, "`undo` has to wait: cycles run")
    os.write(here, b"quit\n")


def _until(terminal: int, wanted: str) -> str:
    """Reads until that is shown, however long it takes."""
    shown = ""
    while wanted not in shown:
        shown += os.read(terminal, 65536).decode(errors="replace")
    return shown


def _computes(pid: int) -> None:
    """Returns when a process has computed for a quarter of a second more: what was begun is under way."""

    def used_s() -> float:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
        return int(fields[11]) / os.sysconf("SC_CLK_TCK")

    begun_s = used_s()
    while used_s() < begun_s + 0.25:
        time.sleep(0.01)


# --- variables -------------------------------------------------------------------------


def test_a_variable_is_shown_and_set(shell: Commands) -> None:
    assert do(shell, "cur_state ?") == ["task.cur_state = d_state", "task.cur_state.next = d_state"]
    assert do(shell, "CUR-STATE=STATE-3") == ["task.cur_state = state_3"]
    assert do(shell, "task.cur_state?")[0] == "task.cur_state = state_3"
    assert do(shell, "gripper.primitive.opening_mm = 12.5") == ["gripper.primitive.opening_mm = 12.5 [mm]"]
    assert do(shell, "level gripper", "primitive.opening_mm ?") == [
        "gripper.primitive.opening_mm = 12.5 [mm]"
    ]
    assert do(shell, "new_command = true") == ["gripper.new_command = true"]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("cur_state = state_33", "one of d_state, f_state"),
        ("new_command = 1", "false or true"),
        ("tbuffer_boxt = 100", "int 0 .. 99"),
        ("tbuffer_boxt = 1.5", "int 0 .. 99"),
        ("tbuffer_boxt =", "int 0 .. 99"),
        ("gripper.primitive.opening_mm = nan", "real 0.0 .. 200.0 [mm]"),
        ("gripper.primitive.opening_mm = -0.1", "real 0.0 .. 200.0 [mm]"),
    ],
)
def test_a_value_that_is_none_of_the_variables_is_refused(shell: Commands, line: str, said: str) -> None:
    before = state(shell)
    error = refused(shell, line)
    assert error.code is Code.SHELL_VALUE
    assert said in str(error)
    assert state(shell) == before


def test_an_unknown_name_comes_with_those_near_it(shell: Commands) -> None:
    for line in ("cur_stat ?", "cur_stat = state_2", "task.cur_stat ?", "expect cur_stat = state_2"):
        error = refused(shell, line)
        assert error.code is Code.SHELL_NAME
        assert "cur_state" in error.helps[0], line
    assert "near it: gripper" in refused(shell, "level griper").helps[0]
    assert "near it: remove_from_buffer_db" in refused(shell, "remove-from-buffer").helps[0]
    assert "`cur_state ?`" in refused(shell, "cur_state").helps[0]
    assert "`cur_state ?`" in refused(shell, "cur_state => state_4").helps[0]
    fields = "`to_workstation.failure`, `from_emove.failure`, `emove.failure`"
    assert refused(shell, "FAILURE ?").helps == (f"fields of that name: {fields}",)
    assert str(refused(shell, "pickup")) == "`pickup` takes 1 argument: then"
    assert "its parts: workstation.inc_command" in refused(shell, "workstation = pause").helps[0]


def test_the_names_of_the_level_chosen_come_first(shell: Commands) -> None:
    """At GRIPPER `primitive.speed_mm_s` is of its orders, and a state of PRIMITIVE's, too."""
    do(shell, "level gripper", "PRIMITIVE.SPEED-MM-S = 80", "run until primitive.speed_mm_s = 80")
    assert do(shell, "primitive.speed_mm_s ?") == ["gripper.primitive.speed_mm_s = 80.0 [mm/s]"]
    assert do(shell, "primitive-level.speed_mm_s ?") == ["primitive.speed_mm_s = 0.0 [mm/s]"]
    assert do(shell, "PRIMITIVE-LEVEL.SPEED-MM-S = 7") == ["primitive.speed_mm_s = 7.0 [mm/s]"]
    do(shell, "expect gripper.primitive.speed_mm_s = 80 and primitive-level.speed_mm_s = 7")
    do(shell, "level task", "expect primitive.speed_mm_s = 7 and gripper-level.primitive.speed_mm_s = 80")
    error = refused(shell, "travelled_mm ?")
    assert str(error) == "level `task` has no variable `travelled_mm`"
    assert error.helps == ("of other levels: `primitive.travelled_mm`",)
    assert do(shell, "primitive-level.preprocess")[0].startswith("primitive: preprocess")


TWICE = """input Go : bool
input go : bool
state at : int 0 .. 9
procedure twice { at := 3 }
table t {
  | line | Go    || procedures |
  | yes  | true  || twice      |
  | no   | false ||            |
}
level twice { period 40 [ms] table t }
"""


def test_a_name_that_means_two_things_is_refused_with_both(tmp_path: Path) -> None:
    source = tmp_path / "twice.rcs"
    source.write_text(TWICE, encoding="utf-8")
    (tmp_path / "system.toml").write_text(system(["twice"], {}), encoding="utf-8")
    compile_beside(source)
    commands = alone(tmp_path / "system.toml", "python")
    for line in ("GO ?", "GO = true", "expect GO"):
        assert str(refused(commands, line)) == "`GO` may be `twice-level.Go` or `twice-level.go`", line
    assert do(commands, "go = true") == ["twice.go = true"]
    assert do(commands, "twice-level.Go ?") == ["twice.Go = false"]
    assert str(refused(commands, "twice")) == "`twice` may be `twice-level` or `twice.twice`"
    assert do(commands, "twice-level") == ["twice alone: twice.t.no"]
    assert do(commands, "twice.twice", "at ?") == ["twice.at = 3"]


def test_what_is_set_stands_in_the_buffer_that_carries_it(shell: Commands) -> None:
    do(shell, "gripper.primitive.input_command = position", "gripper.primitive.opening_mm = 50")
    assert "input_command position, opening_mm 50.0" in do(shell, "buffers gripper.primitive")[0]
    do(shell, "step gripper")
    assert do(shell, "gripper.to_hand ?")[1] == "gripper.to_hand.opening_mm = 0.0 [mm]"
    do(shell, "gripper.primitive.inc_command = 1", "step gripper")
    assert do(shell, "gripper.to_hand ?")[:2] == [
        "gripper.to_hand.drive = true", "gripper.to_hand.opening_mm = 50.0 [mm]"
    ]  # fmt: skip
    do(shell, "step 2")  # PRIMITIVE gives its own order again
    assert do(shell, "gripper.primitive.input_command ?") == ["gripper.primitive.input_command = pause"]


def test_what_is_set_in_a_record_of_the_databases_is_its_answer(shell: Commands) -> None:
    do(shell, *MOVE, "dest.known = true")
    do(shell, "step 2", "expect task.dest_spec = true", "undo 2", "step 2", "expect dest_spec = true")
    do(shell, "workstation.dest_locpt = 4", "step", "expect dest_spec = false")
    do(shell, "workstation.dest_locpt = 3", "step", "expect dest_spec = true")


@pytest.mark.parametrize("kind", ["c", "python"])
def test_what_is_set_by_hand_is_in_the_log_and_replay_follows_it(tmp_path: Path, kind: Kind) -> None:
    commands, path = inhabited(kind), tmp_path / "by_hand.mcap"
    do(commands, "tbuffer_boxt = 9")  # the log begins with it
    do(commands, f"log {path}", *MOVE, "run 20", "cur_state = d_state", "tbuffer_boxt = 3", "step 2")
    do(
        commands,
        "restart gripper",
        "gripper.waited = 5",
        "step",
        "gripper",
        "CMD-FAILURE",
        "emove.idle = true",
        "restart emove",
    )
    assert refused(commands, "undo").helps == ("`log off` ends it",)
    assert refused(commands, "reload").helps == ("`log off` ends it",)
    assert refused(commands, f"log {path}").code is Code.SHELL_COMMAND
    assert do(commands, "step 3", "log off") == ["the log ends with cycle 26"]
    do(commands, "step", "undo")  # nothing more is written
    assert refused(commands, "log off").code is Code.SHELL_COMMAND
    assert refused(commands, "log table.rcs").code is Code.SHELL_COMMAND
    log = read(path)
    again = Replay(log, REPO / "generated", kind)
    moments = list(again.moments())
    assert [moment.tick for moment in moments if moment.differs] == []
    begun = {
        (one.level, moment.tick): one.restarted
        for moment in moments
        for one in moment.cycles
        if one.restarted
    }
    assert begun[("task", 21)] is begun[("gripper", 23)] is begun[("gripper", 24)] is Begun.HAND
    assert begun[("emove", 24)] is Begun.CHECKPOINT
    set_ = [log.level("task").set_by_hand(each) for each in log.level("task").restarts]
    assert {"cur_state": "d_state", "tbuffer_boxt": "3"} in set_
    assert {"to_workstation.failure": "cmd"} in set_
    shown = CliRunner().invoke(group, ["log", str(path)], standalone_mode=False).output
    assert "  set by hand before cycle 21: cur_state = d_state, tbuffer_boxt = 3\n" in shown
    assert (
        "  set by hand before cycle 1: workstation.inc_command = 1, workstation.input_command = move" in shown
    )


# --- by name ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["c", "python"])
def test_the_three_parts_of_a_level_are_one_cycle_of_it(kind: Kind) -> None:
    """The interpreter, a part at a time, leaves what the executor leaves; the line, too."""
    commands = inhabited(kind)
    do(commands, *MOVE)
    for at in range(80):
        for level in commands.session.levels if at % 4 == 0 else ():
            level.take(commands.session.memory)
            level.values = level.executor.values()
            do(commands, f"level {level.name}", "PREPROCESS", "STATE-TABLE", "POSTPROCESS")
            by_parts = level.values
            do(commands, "undo 3", f"{level.name}-level")
            assert level.values == by_parts
            do(commands, "undo")
        do(commands, "step")
    do(commands, "expect task.to_workstation.status_report = done and emove.table = pause_emove")


@pytest.mark.parametrize(
    "line", ["run 5", "step 3", "step gripper 2", "reload proved", "diff", "cur_state ?"]
)
def test_a_line_in_the_brackets_of_the_paper_is_that_line(shell: Commands, line: str) -> None:
    """Also for who asks beforehand whether it runs cycles, or proves."""
    for asked in (shell.run_order, shell.proves, shell.proves_together):
        assert asked(f"<{line}>  # as printed") == asked(line)
    assert shell.run_order("<step 3>") == RunOrder(3, steps=True)


def test_a_procedure_a_module_an_owner_and_a_table_run_by_name(shell: Commands) -> None:
    assert do(shell, "CMD-FAILURE")[0] == "task: procedure `cmd_failure`"
    assert do(shell, "to_workstation.failure ?") == ["task.to_workstation.failure = cmd"]
    do(shell, "nextstate(state_2)", "expect cur_state.next = state_2")
    do(shell, "task.nextstate state-4", "expect cur_state.next = state_4")
    do(shell, "workstation.inc_command = 9", "take_orders", "expect inc_command_seen = 9 and new_command")
    do(shell, "workstation.inc_command = 10", "task.TAKE-ORDERS", "expect inc_command_seen = 10")
    said = do(
        shell,
        "level emove",
        "idle = false",
        "primitive.resting = true",
        "vision.resting = true",
        "PREPROCESS-EMOVE",
    )
    assert said[0] == "emove: owner `preprocess_emove`: look_below, measure"
    do(shell, "expect emove.idle", "vision.resting = false", "PREPROCESS-EMOVE", "expect not emove.idle")
    said = do(shell, "level gripper", "new_command = true", "GRASP")
    assert said[0] == "gripper: table `grasp`, line 1: state(moving); drive; executing"
    do(shell, "expect gripper.cur_state = moving and gripper.to_hand.drive")
    assert do(shell, "gripper-level") == ["gripper alone: gripper.pause_gripper.1"]
    assert do(shell, "gripper 2") == ["gripper alone: gripper.pause_gripper.1"]


def test_clear_clears_the_screen_and_in_capitals_runs_the_table(shell: Commands) -> None:
    cleared: list[int] = []
    shell.clear = lambda: cleared.append(1)
    assert do(shell, "clear") == []
    assert cleared == [1]
    said = do(shell, "CLEAR")
    assert said[0].startswith("task: table `clear`")
    assert do(shell, "undo", "task.clear") == said
    assert cleared == [1]
    assert "clear" in shell.completions()


def test_parts_run_only_from_the_sources_that_the_executors_were_made_of(project: Path) -> None:
    edit_file(
        project.parent / GRIPPER,
        ("table position {", "procedure nothing {\n  waited := waited\n}\n\ntable position {"),
    )
    commands = alone(project)
    assert refused(commands, "gripper.nothing").code is Code.SHELL_RELOAD
    do(commands, "reload gripper anyway", "gripper.nothing")
    before = state(commands)
    assert refused(commands, "nextstate").code is Code.SHELL_COMMAND
    assert refused(commands, "nextstate(state_99)").code is Code.SHELL_VALUE
    assert refused(commands, "cmd_failure 1").code is Code.SHELL_COMMAND
    assert state(commands) == before


def test_a_table_by_name_in_a_state_that_it_does_not_expect(shell: Commands) -> None:
    """A line that matches runs; what it relied on is told."""
    said = do(shell, "cur_state = state_2", "ACQUIRE")
    assert said[0].startswith("task: table `acquire`, line 16: state_failure")
    assert said[0].endswith("; assumptions that do not hold: acquire_in_step")


ALONE = """
procedure one_more {
  waited := waited + 1
}

assume low monitored : waited < 150

table counts assuming low {
  | line | waited || procedures |
  | all  | < 150  || one_more   |
}

level gripper {"""


def test_a_part_that_meets_what_the_proof_excludes_is_refused_and_changes_nothing(project: Path) -> None:
    commands = alone(project)
    edit_file(project.parent / GRIPPER, ("level gripper {", ALONE))
    do(commands, "reload gripper", "level gripper", "waited = 149", "COUNTS", "expect waited = 150")
    before = state(commands)
    error = refused(commands, "one-more")
    assert error.code is Code.SHELL_PART
    assert "`gripper.waited` to 151" in str(error)
    error = refused(commands, "counts")
    assert error.code is Code.STATE_TABLE_ERROR
    assert "no line matches; assumptions that do not hold: low" in str(error)
    assert state(commands) == before


# --- cycles ----------------------------------------------------------------------------


def test_one_level_steps_alone(shell: Commands) -> None:
    others = [level.values for level in shell.session.levels[:-1]]
    do(shell, "gripper.primitive.inc_command = 4", "step gripper 3")
    assert [level.values for level in shell.session.levels[:-1]] == others
    assert shell.session.system.tick == 0
    assert shell.session.memory.latest("gripper.to_primitive") is not None
    do(shell, "expect gripper.to_primitive.inc_command_echo = 4")


@pytest.mark.parametrize("kind", ["c", "python"])
def test_undo_goes_back_and_what_follows_is_the_same(kind: Kind) -> None:
    commands = inhabited(kind)
    do(commands, *MOVE)
    states = []
    for _ in range(25):
        states.append(state(commands))
        do(commands, "step")
    end, plate = state(commands), commands.session.system.outside[0].plate  # type: ignore[attr-defined]  # the plant's
    do(commands, "undo 15")
    assert state(commands) == states[10]
    do(commands, "step 15")
    assert state(commands) == end
    assert commands.session.system.outside[0].plate == plate  # type: ignore[attr-defined]  # the plant's
    do(commands, "undo 25")
    assert state(commands) == states[0]
    assert refused(commands, "undo").code is Code.SHELL_COMMAND


def test_run_stops_at_lines_conditions_and_cycles() -> None:
    commands = inhabited()
    do(commands, *MOVE)
    assert do(commands, "run to cycle 2") == ["cycle 2"]
    assert refused(commands, "run to cycle 1").code is Code.SHELL_COMMAND
    assert do(commands, "break task.move.13", "breaks") == ["1: task.move.13"]
    do(commands, "break primitive.to_emove.ref_command_echo = goto")
    assert do(commands, "run 1000")[0].endswith(
        "breakpoint 2, `primitive.to_emove.ref_command_echo = goto` holds"
    )
    do(commands, "delete 2")
    assert do(commands, "run")[0].endswith("breakpoint 1, line task.move.13")
    tick = commands.session.system.tick
    assert do(commands, DONE) == [f"cycle {tick}: `{DONE.removeprefix('run until ')}` holds"]
    assert do(commands, "run 3") == [f"cycle {tick + 3}"]  # it stands at the line, it does not come to it
    do(commands, "delete 1")
    assert refused(commands, "delete 1").code is Code.SHELL_NAME
    assert refused(commands, "run").code is Code.SHELL_COMMAND
    assert refused(commands, "run to task.move.99").code is Code.SHELL_NAME


def test_a_refused_input_is_a_state_table_error_that_can_be_undone(shell: Commands) -> None:
    before = state(shell)
    shell.session.memory.publish("workstation.order", (0, 77, 0, 0, 0, 0, 0, 0))
    error = refused(shell, "step")
    assert error.code is Code.STATE_TABLE_ERROR
    assert "input refused: `workstation.input_command` = 77?" in str(error)
    assert refused(shell, "task-level").code is Code.STATE_TABLE_ERROR
    do(shell, "undo 2")
    assert state(shell)[2:] == before[2:]


def test_show_lines_levels_and_help(shell: Commands) -> None:
    assert do(shell, "lines")[0].split() == ["task", "task.pause_task.-"]
    do(shell, "workstation.inc_command = 5", "step")
    assert do(shell, "lines")[0].split() == ["task", "task.pause_task.1"]
    assert "task.inc_command_seen: 0 -> 5" in do(shell, "show")
    assert len(do(shell, "show gripper")) == 25
    do(shell, "workstation.input_command = acquire")
    assert do(shell, "lines")[0].split() == ["task", "task.acquire.-"]
    assert [line[0] for line in do(shell, "levels")] == ["*", " ", " ", " ", " "]
    assert do(shell, "help") == HELP.splitlines()
    assert {"task.acquire.5", "cur_state", "take_orders", "undo", "task-level"} <= set(shell.completions())


# --- conditions ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "condition",
    [
        "task.cur_state = d_state",
        "cur-state == D-STATE and not (new_command or task.answered)",
        "d_state = cur_state",
        "tbuffer_boxt >= 10 and tbuffer_boxt /= -1.5e3",
        "emove.idle or task.cur_state = state_2",
        "not not emove.idle = true",
        "not task.emove.resting and emove.resting = false",
        "task.table = pause_task",
        "task.fault = none and task.assumptions_failed = ''",
        "gripper.primitive.opening_mm < .5",
        "task.cur_state = task.cur_state.next",
        "1 < tbuffer_boxt <= 10 < 30",
        "not 1 < tbuffer_boxt < 3 and task.cur_state = 'd_state'",
    ],
)
def test_conditions_that_hold(shell: Commands, condition: str) -> None:
    assert do(shell, f"expect {condition}") == []
    assert refused(shell, f"expect not ({condition})").code is Code.SHELL_EXPECTED


@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("", Code.SHELL_COMMAND),
        ("task.cur_state", Code.SHELL_COMMAND),
        ("cur_state < state_2", Code.SHELL_COMMAND),
        ("cur_state = state_22", Code.SHELL_VALUE),
        ("cur_state = 1", Code.SHELL_VALUE),
        ("cur_state = to_workstation.status_report", Code.SHELL_COMMAND),
        ("new_command = 1", Code.SHELL_COMMAND),
        ("(new_command", Code.SHELL_COMMAND),
        ("new_command)", Code.SHELL_COMMAND),
        ("new_command and", Code.SHELL_COMMAND),
        ("__import__('os')", Code.SHELL_NAME),
        ("1 < tbuffer_boxt < state_3", Code.SHELL_NAME),
        ("1 + tbuffer_boxt < 3", Code.SHELL_COMMAND),
        ("nobody = 3", Code.SHELL_NAME),
        ("nobody", Code.SHELL_NAME),
        ("'nobody'", Code.SHELL_NAME),
        ("not " * 1000 + "emove.idle", Code.SHELL_COMMAND),
        ("(" * 1000, Code.SHELL_COMMAND),
    ],
)
def test_conditions_that_are_none(shell: Commands, condition: str, code: Code) -> None:
    assert refused(shell, f"expect {condition}").code is code


# --- reload ----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["c", "python"])
def test_reload_takes_proved_tables_in_the_present_state(project: Path, kind: Kind) -> None:
    commands = alone(project, kind)
    do(commands, "gripper.primitive.inc_command = 3", "gripper.primitive.input_command = grasp")
    do(commands, "gripper.primitive.force_n = 10", "step gripper")
    do(commands, "break gripper.waited = 140", "break gripper.grasp.4")
    edit_file(project.parent / GRIPPER, ("const most_waited = 150", "const most_waited = 200"))
    edit_file(
        project.parent / GRIPPER,
        ("state forced : bool", "state forced : bool\nstate tries : int 3 .. 9 = 3"),
    )
    said = do(commands, "reload gripper")
    assert (
        said[-1]
        == "level `gripper` runs its new tables from cycle 1 on: 25 variables keep their values; new: tries"
    )
    assert "2 tables changed; 1 as before, proved; 1 other part changed; 2 declarations changed" in said
    assert "out of reach of the present state: whatever the inputs, the next cycle does as before" in said
    do(commands, "expect gripper.tries = 3 and gripper.cur_state = moving", "step gripper 180")
    do(commands, "expect gripper.waited = 180 and gripper.line = 3")
    do(commands, "gripper.waited = 200", "level gripper", "STATE-TABLE")
    assert [stop.text for stop in commands.session.stops.every] == ["gripper.waited = 140", "gripper.grasp.4"]
    do(commands, "undo 182")  # the part and the cycles, then the reload itself
    assert refused(commands, "gripper.tries ?").code is Code.SHELL_NAME


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (
            "| 2    | false       | moving    | true   | ",
            "| 2    | false       | d_state   | true   | ",
            "RCS40",
        ),
        ("state waited : int 0 .. most_waited", "state waited : bool", "RCS3"),
        ("state waited : int 0 .. most_waited", "state waited : int 0 .. most_waited [mm]", "RCS3"),
        ("state at_opening : bool", "state at_opening : bool = true\nstate other : bool", ""),
        ("enum gripper_state { d_state, ", "enum gripper_state { ", "RCS2"),
        ("state at_opening : bool", "state at_opening : intt", "RCS2"),
        (
            "  drive : bool safe false\n",
            "  drive : bool safe false\n  twice : bool\n",
            "buffer `gripper.to_hand` has another form",
        ),
        (
            "## Within half",
            "invariant counted : waited = 0 implies inc_command_seen = inc_command_seen\n## Within half",
            "",
        ),
        ("state forced : bool", "state forced : int 0 .. 1", "RCS3"),
    ],
)
def test_reload_refuses_and_the_old_tables_run_on(project: Path, old: str, new: str, why: str) -> None:
    commands = alone(project)
    do(commands, "step 2")
    before = state(commands)
    edit_file(project.parent / GRIPPER, (old, new))
    if not why:
        said = do(commands, "reload gripper")
        assert (
            "level `gripper` runs its new tables from cycle 3 on: 25 variables keep their values" in said[-1]
        )
        return
    error = refused(commands, "reload gripper")
    assert error.code is Code.SHELL_RELOAD
    assert why in str(error)
    assert state(commands) == before
    do(commands, "step", "expect gripper.line = 1")


def test_reload_refuses_a_state_that_a_range_or_an_assumption_excludes(project: Path) -> None:
    commands = alone(project)
    do(commands, "step", "gripper.waited = 7")
    edit_file(project.parent / GRIPPER, ("const most_waited = 150", "const most_waited = 400"))
    do(commands, "reload gripper", "gripper.waited = 300")
    edit_file(project.parent / GRIPPER, ("const most_waited = 400", "const most_waited = 150"))
    assert "`waited` = 300 lies outside its new range 0 .. 150" in str(refused(commands, "reload gripper"))
    do(commands, "gripper.waited = 7", "reload gripper")
    edit_file(
        project.parent / GRIPPER,
        ("table position {", "assume calm monitored : waited /= 7\ntable position assuming calm {"),
    )
    do(commands, "reload gripper", "undo")  # it is PAUSE's table that runs next
    do(commands, "gripper.primitive.input_command = position")
    error = refused(commands, "reload gripper")
    assert error.code is Code.SHELL_RELOAD
    assert "assumption `calm` of table `position` does not hold of the present state: waited = 7" in str(
        error
    )
    assert refused(commands, "reload gripper anyway").code is Code.SHELL_RELOAD
    do(commands, "gripper.waited = 4", "reload gripper")


# --- reload is gated: what changed, and whether it is met at once ---

ON = "|| to(end)    |", "|| to(start)  |"
OUT_OF_REACH = "out of reach of the present state: whatever the inputs, the next cycle does as before"
WITHIN_REACH = "within reach of the present state, with some inputs: table `walk`, line `on`"


@pytest.fixture
def walker(tmp_path: Path) -> Path:
    """A level with a deferred state; its source."""
    source = tmp_path / "walker.rcs"
    source.write_text(WALKER, encoding="utf-8")
    buffers = {"outside.go": "walker.go", "outside.echo": "walker.echo", "walker.sent": "outside.order"}
    (tmp_path / "system.toml").write_text(system(["walker"], buffers), encoding="utf-8")
    compile_beside(source)
    return source


def write(source: Path, *edits: tuple[str, str], text: str = WALKER) -> None:
    """Write the walker's program, with these edits."""
    source.write_text(edited(text, *edits), encoding="utf-8")


def walking(source: Path) -> Commands:
    return alone(source.parent / "system.toml", "python")


def test_a_reload_that_changes_nothing_says_so_and_one_that_changes_no_meaning_too(walker: Path) -> None:
    commands = walking(walker)
    same = ["level `walker` runs these very tables: nothing changed"]
    assert do(commands, "reload") == same
    assert do(commands, "diff") == same
    assert refused(commands, "undo").code is Code.SHELL_COMMAND  # nothing was taken
    write(walker, ("table walk {", "# a walk\ntable walk {"))
    assert do(commands, "reload")[0] == "same meaning; 1 as before, proved"
    assert do(commands, "reload") == same
    write(walker, ("| back |", "| home |"))
    said = do(commands, "reload")
    assert "same meaning; 1 as before, proved; 1 region with another line to the same effect" in said
    assert OUT_OF_REACH not in said  # it is not worth saying where nothing changed
    do(commands, "at = end", "at.next = end", "step", "expect walker.line = home")


LOOKING_BACK = """input a : bool
input b : bool
state s : bool
table t {
  | line | when              || s     |
  | long | (a or b) for 80 [ms] || true  |
  | else | DEFAULT           ||       |
}
level back { period 40 [ms] table t }
"""


def test_a_history_is_carried_on_only_where_it_is_of_the_same_thing(tmp_path: Path) -> None:
    """`held_a` counts what the text first asks of `a`: another condition begins anew, and a time alone changes nothing."""
    source = tmp_path / "back.rcs"
    source.write_text(LOOKING_BACK, encoding="utf-8")
    buffers = {"outside.a": "back.a", "outside.b": "back.b"}
    (tmp_path / "system.toml").write_text(system(["back"], buffers), encoding="utf-8")
    compile_beside(source)
    commands = alone(tmp_path / "system.toml", "python")
    do(commands, "b = true", "a = false", "step", "expect held_a = 1")
    source.write_text(LOOKING_BACK.replace("80 [ms]", "120 [ms]"), encoding="utf-8")
    do(commands, "reload anyway", "expect held_a = 1", "step 2", "expect held_a = 3", "expect s = false")
    source.write_text(LOOKING_BACK.replace("80 [ms]", "40 [ms]"), encoding="utf-8")
    do(commands, "reload anyway", "expect held_a = 1", "undo")
    source.write_text(LOOKING_BACK.replace("(a or b)", "(a or not b)"), encoding="utf-8")
    said = do(commands, "reload anyway")
    assert "new: held_a; gone: held_a" in said[-1]
    do(commands, "expect held_a = 0", "b = false", "step", "expect s = false", "step 2", "expect s = true")


def test_a_change_that_the_present_state_does_not_meet_is_taken_with_what_it_changes(walker: Path) -> None:
    commands = walking(walker)
    write(walker, ON)
    before = state(commands)
    shown = do(commands, "diff")
    assert state(commands) == before
    assert shown[-1] == "`reload walker` takes it: 6 variables keep their values"
    said = do(commands, "reload walker")
    assert said[:-1] == shown[:-1]
    assert OUT_OF_REACH in said
    assert "    line `on`: another effect  (1 of 6 inputs)" in said
    assert "      where  at = middle, seen = true" in said
    assert "      at.next: end -> start  [procedures]" in said
    assert "    proved: nothing else changed" in "\n".join(said)
    at = said.index("  level `walker`, table `walk`: 1 step from line to line newly possible")
    assert said[at + 1] == "    on -> off"
    do(commands, "go = true", "step", "echo = 1", "step", "echo = 2", "step", "expect at = start")


def test_a_change_within_reach_is_taken_and_one_that_is_met_at_once_only_if_that_is_said(
    walker: Path,
) -> None:
    commands = walking(walker)
    do(commands, "go = true", "step", "expect at.next = middle")
    write(walker, ON)
    said = do(commands, "diff")  # the echo may come, but has not
    assert WITHIN_REACH in said
    assert said[-1].startswith("`reload walker` takes it")
    do(commands, "echo = 1")
    before = state(commands)
    said = do(commands, "diff")
    assert said[-1].startswith("`reload walker anyway` takes it")
    error = refused(commands, "reload walker")
    assert error.code is Code.SHELL_OTHERWISE
    first, *rest = str(error).splitlines()
    assert first == (
        "level `walker` keeps its tables: in the present state the next cycle would do otherwise: "
        "table `walk`, line `on` before, table `walk`, line `on` now"
    )
    assert rest[0] == "  at.next: end -> start"
    assert WITHIN_REACH in rest
    assert error.helps == ("`reload walker anyway` takes them",)
    assert state(commands) == before
    do(commands, "step", "expect at.next = end", "undo")
    said = do(commands, "reload ANYWAY")
    assert (
        "in the present state the next cycle would do otherwise: table `walk`, line `on` before, table `walk`, line `on` now"
        in said
    )
    do(commands, "step", "expect at.next = start")
    do(commands, "undo 2", "step", "expect at.next = end")  # the cycle, then the reload


def test_members_that_are_numbered_anew_are_the_same_states(walker: Path) -> None:
    commands = walking(walker)
    write(walker, ON, ("{ start, middle, end }", "{ end, start, middle }"))
    assert OUT_OF_REACH in do(commands, "diff")
    do(commands, "at = middle", "at.next = middle")
    assert WITHIN_REACH in do(commands, "diff")
    do(commands, "go = true")
    assert refused(commands, "reload").code is Code.SHELL_OTHERWISE
    do(commands, "go = false", "reload", "expect at = middle", "go = true", "step", "expect at.next = start")


def test_a_state_that_the_new_table_does_not_know_is_refused_whatever_is_said(walker: Path) -> None:
    commands = walking(walker)
    on = "  | on   | middle | true  || to(end)    |\n"
    lost = (
        (on, ""),
        (
            "| rest | /= end | false ||            |",
            "| rest | start  | false ||            |\n  | lost | DEFAULT | || |",
        ),
    )
    write(walker, *lost)
    do(commands, "reload", "undo")  # nothing is on its way there
    do(commands, "go = true", "step", "go = false")
    for line in ("reload", "reload anyway", "diff"):
        error = refused(commands, line)
        assert error.code is Code.SHELL_RELOAD
        assert "`at` is to be middle, for which table `walk` has no line" in str(error)
        assert "add a line for middle" in error.helps[0]
    do(commands, "echo = 1", "step", "expect at = middle")
    assert "`at` is middle, for which table `walk` has no line" in str(refused(commands, "reload anyway"))
    write(
        walker, (on, ""), ("place { start, middle, end }", "place { start, end }"), ("to(middle)", "to(end)")
    )
    assert "`at` = middle, which its new type does not have" in str(refused(commands, "reload anyway"))
    do(commands, "undo")
    assert "`at.next` = middle, which its new type does not have" in str(refused(commands, "reload anyway"))


def test_a_pending_state_that_an_assumption_excludes_is_refused(walker: Path) -> None:
    commands = walking(walker)
    write(walker, ("table walk {", "assume early assumed : at /= middle\ntable walk assuming early {"))
    do(commands, "go = true", "step")
    assert "`at` is to be middle, for which table `walk` has no line" in str(refused(commands, "reload"))
    do(commands, "echo = 1")
    error = refused(commands, "reload")
    assert "assumption `early` of table `walk` does not hold of the present state: at = middle" in str(error)
    do(commands, "at = start", "at.next = start", "reload")


def test_an_invariant_that_does_not_hold_of_the_present_state_is_refused(walker: Path) -> None:
    text = edited(WALKER, ("state seen : bool", "state seen : bool\nstate count : int 0 .. 5"))
    commands = walking(walker)
    write(walker, text=text)
    do(commands, "reload", "count = 4")
    write(walker, ("table walk {", "invariant few : count <= 3 or seen\ntable walk {"), text=text)
    assert "RCS4" in str(refused(commands, "reload anyway"))  # `sense` does not keep it
    write(walker, ("table walk {", "invariant few : count <= 3\ntable walk {"), text=text)
    error = refused(commands, "reload anyway")
    assert error.code is Code.SHELL_RELOAD
    assert "invariant `few` does not hold of the present state: count = 4" in str(error)
    do(commands, "count = 3", "reload")


def test_what_cannot_be_compared_is_taken_only_if_that_is_said(
    walker: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(walker, ON)
    commands = walking(walker)  # its executors are of the text before
    error = refused(commands, "reload")
    assert error.code is Code.SHELL_OTHERWISE
    assert "the sources of what runs are not known" in str(error)
    assert "nothing changed" not in do(commands, "reload anyway")[-1]
    write(walker)
    monkeypatch.setattr(
        "rcsc.desk.shell.reload.gate.compare",
        lambda *args, **more: replace(compare(*args, **more), undecided=("table `walk`",)),
    )
    error = refused(commands, "reload")
    assert (error.code, "the solver gave up on table `walk`" in str(error)) == (Code.SHELL_OTHERWISE, True)
    monkeypatch.setattr("rcsc.desk.shell.reload.gate.compare", lambda name, *_, **__: ProgramDifference(name))
    do(commands, "at = middle", "at.next = middle", "go = true")
    with pytest.raises(RuntimeError, match="nothing is said to differ"):
        do(commands, "reload")


CALLED: list[bool] = []


def outside_world(seen: bool) -> bool:
    """An extern procedure: what it does cannot be taken back."""
    CALLED.append(seen)
    return seen


def test_what_is_admitted_of_an_input_is_met_in_any_state(walker: Path) -> None:
    commands = walking(walker)
    write(walker, ("input echo : int 0 .. 2", "input echo : int 0 .. 2 clamp"))
    said = do(commands, "diff")
    assert OUT_OF_REACH not in said
    assert any(
        line.startswith("within reach of the present state, with some inputs: declaration of variable `echo`")
        for line in said
    )
    do(commands, "reload")
    commands.session.memory.publish("outside.echo", (7,))
    write(walker)
    error = refused(commands, "reload")
    assert error.code is Code.SHELL_OTHERWISE
    assert "table `walk`, line `rest` before, table `walk`, input refused now" in str(error)


def test_extern_procedures_are_not_tried_out(walker: Path) -> None:
    extern = 'state told : bool\nextern procedure tell reads seen writes told python "tests.run.test_shell:outside_world" c "tell"\n'
    asks = (
        ("procedure sense {", f"{extern}procedure sense {{"),
        ("preprocess sense", "preprocess sense, tell"),
    )
    text = edited(WALKER, *asks)
    write(walker, text=text)
    compile_beside(walker)
    commands = walking(walker)
    CALLED.clear()
    write(walker, ON, text=text)
    error = refused(commands, "reload")
    assert error.code is Code.SHELL_OTHERWISE
    assert "the next cycle was not tried out, and assumptions not looked at" in str(error)
    do(commands, "reload anyway")
    assert CALLED == []
    do(commands, "step")
    assert len(CALLED) == 1


def test_a_file_that_is_used_is_kept_too(walker: Path) -> None:
    enum, rest = WALKER.split("\n", 1)
    (walker.parent / "words").mkdir()
    (walker.parent / "words" / "places.rcs").write_text(enum, encoding="utf-8")
    write(walker, text=f"use words/places\n{rest}")
    compile_beside(walker)
    commands = walking(walker)
    edit_file(walker.parent / "words/places.rcs", ("end }", "end, gone }"))
    error = refused(commands, "reload")
    assert (error.code, "RCS401" in str(error)) == (Code.SHELL_RELOAD, True)  # a gap, in what was edited
    do(commands, "sense")  # what runs is known by what it was made of
    edit_file(walker.parent / "words/places.rcs", ("{ start, middle, end, gone }", "{ middle, start, end }"))
    assert "  enumeration `place`: start, middle, end -> middle, start, end" in do(commands, "reload")


@pytest.mark.parametrize("kind", ["python", "c"])
def test_what_runs_is_not_tried_out_of_a_state_in_which_its_proof_does_not_hold(
    walker: Path, kind: Kind
) -> None:
    held = "state seen : bool\nstate kept : array[3] of bool\nstate i : int 0 .. 2000000000\n"
    text = edited(
        WALKER,
        ("state seen : bool\n", f"{held}invariant inside : i <= 2\n"),
        ("{ seen := go }", "{ seen := go  kept[i] := go }"),
    )
    write(walker, text=text)
    compile_beside(walker)
    commands = alone(walker.parent / "system.toml", kind)
    do(commands, "i = 2000000000")
    guarded = ("kept[i] := go }", "if i <= 2 { kept[i] := go } }"), ("invariant inside : i <= 2\n", "")
    write(walker, *guarded, ON, text=text)
    before = state(commands)
    error = refused(commands, "reload")
    assert error.code is Code.SHELL_OTHERWISE
    assert "cannot go on from this state: invariant `inside` does not hold" in str(error)
    assert state(commands) == before
    do(commands, "reload anyway", "step")


def test_a_part_that_has_no_whole_number_is_refused(walker: Path) -> None:
    held = "state x : real 0.0 .. 1.0e308\nstate whole : int 0 .. 9\ninvariant small : x <= 1.0\n"
    text = edited(
        WALKER,
        ("procedure sense {", f"{held}procedure sense {{"),
        ("{ seen := go }", "{ seen := go  whole := int(min(abs(x * 10.0 - x * 10.0), 9.0)) }"),
    )
    write(walker, text=text)
    compile_beside(walker)
    commands = walking(walker)
    do(commands, "sense", "x = 1e308")
    before = state(commands)
    assert refused(commands, "sense").code is Code.SHELL_PART
    assert state(commands) == before


USES = ("use words\n", "const one = 1 use words\n", "use\n  words\n", "use # what is said\n words\n")


@pytest.mark.parametrize("use", USES)
def test_a_used_file_is_kept_however_its_use_is_written(use: str, tmp_path: Path) -> None:
    (tmp_path / "words.rcs").write_text("enum word { one, two }\n")
    (tmp_path / "t.rcs").write_text(f"{use}input w : word\n")
    before = kept(tmp_path / "t.rcs")
    assert before.texts["words.rcs"] == b"enum word { one, two }\n"
    (tmp_path / "words.rcs").write_text("enum word { two, one }\n")
    assert kept(tmp_path / "t.rcs") != before


def test_sources_are_laid_out_in_their_folder_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("project/tables", "outside", "user"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "project" / "rcsc.toml").touch()
    (tmp_path / "project" / "tables" / "t.rcs").write_text("use near use lib/far\ninput n : bool\n")
    (tmp_path / "project" / "tables" / "near.rcs").write_text("const one = 1\n")
    (tmp_path / "outside" / "far.rcs").write_text("const two = 2\n")
    (tmp_path / "project" / "tables" / "lib").symlink_to(tmp_path / "outside")
    (tmp_path / "user" / "link").symlink_to(tmp_path / "project" / "tables")
    monkeypatch.chdir(tmp_path / "user")
    for source in (Path("link/t.rcs"), tmp_path / "project" / "tables" / "t.rcs"):
        held = kept(source)
        assert "tables/near.rcs" in held.texts
        with laid_out(held) as there:
            place = there.parents[1]
            written = {
                str(path.relative_to(place)): path.read_bytes() for path in place.rglob("*") if path.is_file()
            }
            assert there.read_text() == "use near use lib/far\ninput n : bool\n"
        assert written == {name: text for name, text in held.texts.items() if not os.path.isabs(name)}


def test_a_pipe_that_is_used_is_not_waited_for(tmp_path: Path) -> None:
    (tmp_path / "t.rcs").write_text("use words\n")
    os.mkfifo(tmp_path / "words.rcs")
    assert "words.rcs" not in kept(tmp_path / "t.rcs").texts


def test_names_are_what_the_command_tells_of_the_level_chosen(shell: Commands) -> None:
    told = CliRunner().invoke(group, ["names", str(SYSTEM), "--find", "force"]).output
    of_gripper = told[told.index("level gripper") :].split("\nlevel ")[0].splitlines()
    do(shell, "level gripper")
    assert [line for line in do(shell, "names force") if line] == [line for line in of_gripper if line]
    assert do(shell, "names task")[0].startswith("level task: ")
    assert len(do(shell, "names")) > len(do(shell, "names force"))
    assert "no variable of level `gripper` has `forcee`" in str(refused(shell, "names forcee"))
