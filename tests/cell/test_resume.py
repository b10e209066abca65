"""A script that stops is resumed: in the same process, in another one, by the command that is printed; or it is said why not."""

import contextlib
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.orders.stopped import NotResumed, StoppedRuns
from rcsc.run.plant.staging import StageOrder
from rcsc.run.plant.staging import outside as outside_of_processes
from rcsc.run.signature import Value, Values
from rcsc.run.system import Outside, signatures
from rcsc_cell.cell.plant import Plant
from rcsc_cell.cell.ready import lying, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.episodes.witness import Timed, timed
from rcsc_cell.workstation.interlocks import CellState
from rcsc_cell.workstation.orders import (
    DONE,
    EXECUTING,
    KINDS,
    MACHINE_ORDER,
    MACHINE_REPORT,
    VISE_ORDER,
    VISE_REPORT,
)
from rcsc_cell.workstation.script import ScriptRow
from rcsc_cell.workstation.station import ANSWER_TICKS, PAUSE_TICKS, Workstation, workstation
from tests.support.cells import REPO, SYSTEM, ScriptDraft, prepare

HEAD = "command,part,source,dest,end_at\n"
ROWS = 'MOVE,,,FIX-SAFE,\n"VISE-CLOSE RIGHT, CLOSE LEFT",,,,\nMOVE,,,WS-SAFE,\n"VISE-OPEN RIGHT",,,,\n'
QUICK = ["--no-compile", "--executor", "python", "--plant", "kinematic"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tables, the Python executors, a script of four rows, and the database with what is known of it."""
    folder = tmp_path_factory.mktemp("built")
    leave = shutil.ignore_patterns(".rcsc-cache", "examples")
    shutil.copytree(REPO / "tables", folder / "tables", ignore=leave)
    shutil.copytree(REPO / "generated", folder / "generated")
    (folder / "go.csv").write_text(HEAD + ROWS, encoding="utf-8")
    (folder / "vise.csv").write_text(HEAD + "VISE-CLOSE RIGHT,,,,\n", encoding="utf-8")
    with contextlib.chdir(folder):
        assert run(["run", "vise.csv", *QUICK, "-q"]) == 0
    return folder


@pytest.fixture
def project(built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of one's own."""
    shutil.copytree(built, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outside(database: Database) -> list[Timed]:
    """As `rcsc run` has it."""
    return [timed(plant(database, "kinematic"))]


def plant_of(made: ScriptDraft) -> Plant:
    [world] = [one for one in made.system.outside if isinstance(one, Timed)]
    return world


def begun(rows: tuple[ScriptRow, ...] | str = "go.csv") -> ScriptDraft:
    """A run of the project's script."""
    return prepare(Path("tables/system.toml"), rows, "python", outside)


def stopped_at_vise() -> ScriptDraft:
    """A run whose second row failed because the jaws were stuck."""
    made = begun()
    plant_of(made).faults.vise_stuck = True
    *_, last = made.steps()
    assert (last.row.number, last.state) == (2, "failed")
    return made


def stopped_by_robot() -> ScriptDraft:
    """A run whose third row failed in TASK."""
    made = begun()
    for result in made.steps():
        plant_of(made).faults.robot_refuses = result.row.number == 2
    assert made.station.results[-1].row.number == 3
    return made


def keep(made: ScriptDraft, script: str) -> Path:
    """As `rcsc run` keeps a run of the cell."""
    return _stopped(made).keep(ScriptedRun(made.system, made.station), script)


def go_on(made: ScriptDraft) -> None:
    """As `rcsc run --resume` goes on."""
    _stopped(made).go_on(ScriptedRun(made.system, made.station))


def _stopped(made: ScriptDraft) -> StoppedRuns:
    return StoppedRuns(made.system.description, made.database.locations, KINDS)


def rcsc(*args: str) -> "subprocess.CompletedProcess[str]":
    """A process of its own."""
    command = [sys.executable, "-c", "from rcsc.front.commands import main; main()", *args]
    return subprocess.run(command, capture_output=True, text=True, check=False)


# --- what fails, and why ---


@pytest.mark.usefixtures("project")
def test_a_vise_that_does_not_close_stops_the_script_where_it_is() -> None:
    made = stopped_at_vise()
    assert made.station.results[-1].reason == "the right jaw did not close: it stands at 20.0 mm"
    assert made.station.cell == CellState(robot_at="FIX-SAFE")
    assert made.station.at_rest
    assert made.system.level("task").shown("workstation.input_command") == "pause"
    assert made.system.level("task").shown("to_workstation.status_report") == "done"


@pytest.mark.usefixtures("project")
@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("vise_weak", "the right jaw did not close: it stands at 6.0 mm"),
        ("vise_mute", "the vise does not answer"),
    ],
)
def test_other_ways_not_to_close(fault: str, said: str) -> None:
    made = begun()
    setattr(plant_of(made).faults, fault, True)
    *_, last = made.steps()
    assert (last.row.number, last.state, last.reason) == (2, "failed", said)


@pytest.mark.usefixtures("project")
def test_no_vise_at_all_is_a_failure_and_no_waiting_for_ever() -> None:
    made = prepare(Path("tables/system.toml"), "vise.csv", "python", lambda _: ())
    [last] = made.steps()
    assert (last.row.number, last.reason) == (1, "the vise does not answer")
    assert last.ticks == ANSWER_TICKS + 1  # in the cycle after, that is seen


def machining() -> ScriptDraft:
    """The vise closes and the machine works; a part is taken to be there."""
    rows = (
        ScriptRow(1, "", vise={"right": False, "left": False}),
        ScriptRow(2, "", machine="MACHINE DOVETAIL"),
    )
    made = begun(rows)
    made.station.cell = CellState(fixture="tbox", robot_at="FIX-SAFE")
    return made


@pytest.mark.usefixtures("project")
def test_the_machine_works_on_a_clamped_part_only() -> None:
    assert [result.state for result in machining().steps()] == ["done", "done"]
    made = machining()
    steps = made.steps()
    assert next(steps).state == "done"
    for _ in range(20):
        made.system.step()
    plant_of(made).vise.left.opened = True
    [last] = steps
    assert (last.state, last.reason) == ("failed", "the machine stopped: the vise is not closed")


# --- the workstation by itself ---


class Below:
    """Buffers as the levels below leave them; a test says what they answer."""

    def __init__(self, rows: tuple[ScriptRow, ...]) -> None:
        self.station = self.made(rows)
        self.held: dict[str, Values] = {}
        self.tick = 0

    @staticmethod
    def made(rows: tuple[ScriptRow, ...]) -> Workstation:
        places = {"BUFFER": 3, "FIX-MAC1": 5, "WS-SAFE": 7}
        safe = {"FIX-MAC1": "WS-SAFE"}
        return workstation(rows, places, signatures(description(SYSTEM))["task"], safe)

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.held |= self.station.step(self.tick, self.held.get)
            self.tick += 1

    @property
    def order(self) -> dict[str, Value | str]:
        """What stands in TASK's command buffer, in its words."""
        sent = self.held["workstation.order"]
        return {
            leaf.name.rpartition(".")[2]: leaf.shown(value) if leaf.members else value
            for leaf, value in zip(self.station.order, sent, strict=True)
        }

    def answer(self, status: str, failure: str = "none", held: str = "null_obj") -> None:
        """TASK's report about the order that stands there."""
        said: dict[str, Value | str] = {
            "inc_command_echo": self.order["inc_command"],
            "status_report": status,
            "failure": failure,
            "status_parameter": held,
        }
        self.held["task.to_workstation"] = tuple(
            leaf.members.index(one) if isinstance(one, str) else one
            for leaf in self.station.report
            for one in [said.get(leaf.name.rpartition(".")[2], leaf.initial)]
        )


GO = ScriptRow(1, "MOVE", "move", dest="WS-SAFE")


def test_after_a_failure_nothing_is_sent_before_task_has_paused() -> None:
    cell = Below((GO,))
    cell.step()
    cell.answer("failed", "grip")
    cell.step()
    assert cell.station.stopped is not None
    assert (cell.order["input_command"], cell.order["inc_command"]) == ("pause", 2)
    cell.station.resume()
    cell.step(5)
    cell.answer("executing")
    cell.step(5)
    assert cell.order["input_command"] == "pause"
    cell.answer("done")
    cell.step(2)
    assert (cell.order["input_command"], cell.order["inc_command"], cell.order["dest_locpt"]) == (
        "move",
        3,
        7,
    )
    cell.answer("done")
    cell.step()
    assert [result.state for result in cell.station.results] == ["done"]


def test_a_pause_that_is_not_answered_is_the_reason_until_one_is() -> None:
    cell = Below((GO,))
    cell.step()
    cell.answer("failed", "grip")
    rested = []
    for _ in range(PAUSE_TICKS + 2):
        cell.step()
        rested.append(cell.station.at_rest)
    assert rested == [False] * PAUSE_TICKS + [True] * 2
    cell.station.resume()
    cell.step()
    assert cell.station.results[-1].reason == "TASK does not answer PAUSE"
    assert cell.order["inc_command"] == 3, "PAUSE goes down again"
    cell.answer("done")
    cell.step()
    cell.station.resume()
    cell.step()
    assert cell.order["input_command"] == "move"


TAKES = {"part": "tbox", "grasp": 2, "source": "BUFFER"}
LEFT = {
    "nothing is taken": ("transfer", TAKES, "BUFFER", [("null_obj", "loc")], ("transfer", 3, 5)),
    "it was not there": (
        "transfer",
        TAKES,
        "BUFFER",
        [("tbox", ""), ("null_obj", "pic")],
        ("transfer", 3, 5),
    ),
    "it is in the gripper": ("transfer", TAKES, "BUFFER", [("tbox", "move")], ("transfer", 0, 5)),
    "it lies there": ("transfer", TAKES, "BUFFER", [("tbox", ""), ("null_obj", "move")], ("move", 0, 7)),
    "a move that takes": ("move", TAKES, "BUFFER", [("tbox", "move")], ("move", 0, 5)),
    "a move lets nothing go": ("move", TAKES, "BUFFER", [("tbox", ""), ("null_obj", "move")], ("move", 3, 5)),
    "released": ("clear", {}, "", [("tbox", ""), ("null_obj", "move")], ("move", 0, 7)),
    "not yet": ("clear", {}, "", [("tbox", "grip")], ("clear", 0, 5)),
}


@pytest.mark.parametrize("name", list(LEFT))
def test_a_row_that_failed_on_its_way_goes_on_with_what_is_left(name: str) -> None:
    """By another workstation, which knows only what the first has said of its state."""
    robot, said, source, tries, (command, from_, to) = LEFT[name]
    row = ScriptRow(1, "", robot, dest="FIX-MAC1", **said)  # type: ignore[arg-type]  # by name
    cell = Below((row,))
    cell.station.cell = CellState(held="" if source else "tbox")
    cell.step()
    for held, failure in tries:
        cell.answer("failed" if failure else "executing", failure or "none", held)
        cell.step()
    cell.answer("done", held=tries[-1][0])
    cell.step()
    other = Below((row,))
    other.station.restore(json.loads(json.dumps(cell.station.state())))
    other.held = dict(cell.held)
    other.step()
    order = other.order
    assert (order["input_command"], order["source_locpt"], order["dest_locpt"]) == (command, from_, to)
    other.answer("done")
    other.step()
    held_at_end = row.part if robot == "move" else ""
    assert other.station.cell.held == held_at_end, "the row as the script has it is done"


@pytest.mark.parametrize("put", [("transfer", TAKES, ""), ("clear", {}, "tbox")], ids=["transfer", "clear"])
def test_a_part_put_into_the_fixture_by_a_row_that_failed_is_there(
    put: tuple[str, dict[str, str | int], str],
) -> None:
    """Before the row is tried again, and after: the interlocks look at it."""
    robot, said, held = put
    cell = Below((ScriptRow(1, "", robot, dest="FIX-MAC1", **said),))  # type: ignore[arg-type]  # by name
    cell.station.cell = CellState(held=held, robot_at="WS-SAFE")
    cell.step()
    cell.answer("executing", held="tbox")
    cell.step()
    cell.answer("failed", "move")
    cell.step()
    assert (cell.station.cell.held, cell.station.cell.fixture) == ("", "tbox")
    cell.answer("done")
    cell.step()
    cell.station.resume()
    cell.step()
    assert cell.order["input_command"] == "move"
    cell.answer("done")
    cell.step()
    assert (cell.station.cell.held, cell.station.cell.fixture) == ("", "tbox")


def test_a_row_is_not_tried_again_with_something_else_in_the_gripper() -> None:
    """TASK would refuse it with `cmd`; the workstation says what is there, and it may be let go of."""
    cell = Below((ScriptRow(1, "", "transfer", dest="FIX-MAC1", **TAKES), ScriptRow(2, "", "release")))  # type: ignore[arg-type]  # by name
    cell.step()
    cell.answer("failed", "pic", "unknown_object")
    cell.step()
    cell.answer("done", held="unknown_object")
    cell.step()
    cell.station.resume()
    cell.step()
    assert cell.station.results[-1].state == "refused"
    assert cell.station.results[-1].reason == "the gripper holds a part already: unknown_object"
    cell.station.resume()
    cell.station.rows = cell.station.rows[1:]
    cell.step()
    assert cell.order["input_command"] == "release"


def test_a_row_that_was_not_tried_is_sent_as_it_is() -> None:
    """Whatever TASK holds: that it holds something is for TASK to refuse."""
    cell = Below((GO, ScriptRow(2, "", "move", dest="FIX-MAC1", **TAKES)))  # type: ignore[arg-type]  # by name
    cell.step()
    cell.answer("done", held="tbox")
    cell.step(2)
    assert (cell.order["input_command"], cell.order["source_locpt"]) == ("move", 3)


def test_what_is_left_may_fail_again() -> None:
    cell = Below((ScriptRow(1, "", "transfer", dest="FIX-MAC1", end_at="WS-SAFE", **TAKES),))  # type: ignore[arg-type]  # by name
    cell.step()
    for _ in range(3):
        cell.answer("executing", held="tbox")
        cell.step()
        cell.answer("failed", "move")
        cell.step()
        cell.answer("done")
        cell.step()
        cell.station.resume()
        cell.step()
        assert (cell.order["input_command"], cell.order["dest_locpt"], cell.order["end_at_locpt"]) == (
            "move",
            7,
            0,
        )


def test_numbers_go_on_from_what_stands_in_the_buffers_and_wrap() -> None:
    vise = ScriptRow(1, "", vise={"right": True})
    for standing, echo, expected in ((None, 65535, 0), ((12, True, True), 11, 13), (None, 41, 42)):
        cell = Below((vise,))
        cell.held[VISE_REPORT] = (echo, DONE, 20.0, 20.0)
        if standing is not None:
            cell.held[VISE_ORDER] = standing
        cell.step(3)
        assert not cell.station.results, "an old report is no answer"
        assert cell.held[VISE_ORDER] == (expected, True, True)
        cell.held[VISE_REPORT] = (expected, DONE, 20.0, 20.0)
        cell.step()
        assert [result.state for result in cell.station.results] == ["done"]


def test_a_machine_that_goes_on_for_ever_is_given_up() -> None:
    cell = Below((ScriptRow(1, "", machine="ENGRAVE PART"),))
    cell.station.cell = CellState(False, False, "tbox", robot_at="FIX-SAFE")
    cell.step(ANSWER_TICKS + 1)
    assert cell.held[MACHINE_ORDER] == (1, 1)
    assert cell.station.results[-1].reason == "the machine does not answer"
    cell.answer("done")
    cell.station.resume()
    cell.step(2)
    cell.held[MACHINE_REPORT] = (2, EXECUTING)
    cell.step(400)
    assert not cell.station.results
    cell.step(200)
    assert cell.station.results[-1].reason == "the machine did not end in 500 cycles"


# --- another process goes on ---


@pytest.mark.usefixtures("project")
@pytest.mark.parametrize("stop", [stopped_at_vise, stopped_by_robot])
def test_another_process_goes_on_to_the_end(stop: Callable[[], ScriptDraft]) -> None:
    made = stop()
    at = made.station.at + 1
    keep(made, "go.csv")
    ended = rcsc("run", "go.csv", *QUICK, "--resume")
    assert (ended.returncode, ended.stderr.count("\n")) == (0, 1), (
        "it says that executors run as they lie, and no more"
    )
    rows = re.findall(r"^ +(\d+)  .* (done|failed) ", ended.stdout, re.MULTILINE)
    assert rows == [(str(row), "done") for row in range(at, 5)]
    again = rcsc("run", "go.csv", *QUICK, "--resume")
    assert again.returncode == 1
    assert "error[RCS726]: there is nothing to resume" in again.stderr


def test_the_command_that_is_printed_is_the_one_to_type(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (project / "my script.csv").write_text(f"{HEAD}MOVE,,,FIX-SAFE,\nENGRAVE PART,,,,\n", encoding="utf-8")
    said = []
    typed = ["run", "my script.csv", *QUICK, "--system", "tables/system.toml"]
    for _ in range(3):
        assert run(typed) == 1
        shown = capfd.readouterr()
        assert "row 2, ENGRAVE PART: refused: there is no part in the fixture" in shown.err
        command = re.search(r"then: (rcsc .*--resume)$", shown.err, re.MULTILINE)
        assert command is not None
        said.append((command[1], shown.out.count("done")))
        typed = [*shlex.split(command[1])[1:], "--no-compile"]
    assert [done for _, done in said] == [1, 0, 0], "only the first run did the first row"
    assert {text for text, _ in said} == {
        "rcsc run 'my script.csv' --system tables/system.toml --executor python --plant kinematic --resume"
    }


# --- what is not resumed ---


def _fewer_locations(project: Path) -> None:
    path = project / "tables/cell.toml"
    text = path.read_text(encoding="utf-8")
    extra = "\n[location.ELSEWHERE]\nat = { x = 560.0, y = 0.0, z = 540.0, yaw = 180.0 }\n"
    path.write_text(text + extra, encoding="utf-8")


def test_a_run_is_not_resumed_where_locations_have_come_or_gone(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    keep(stopped_at_vise(), "go.csv")
    _fewer_locations(project)
    assert run(["run", "go.csv", *QUICK, "--resume"]) == 1
    shown = capfd.readouterr()
    assert "error[RCS722]: " in shown.err
    assert "locations have come or gone" in shown.err
    assert shown.out == ""


def other_parts(database: Database) -> list[Timed]:
    """One part fewer."""
    return [timed(plant(database, "kinematic", lying(database)[1:]))]


@pytest.mark.usefixtures("project")
@pytest.mark.parametrize(
    ("others", "said"),
    [
        (lambda _: (), "nothing outside is a `Timed`"),
        (other_parts, "the state is of a cell with other parts"),
        (lambda database: [timed(plant(database))], "the stopped run is of another plant"),
    ],
    ids=["nothing", "parts", "physics"],
)
def test_a_run_of_another_cell_is_not_resumed(
    others: Callable[[Database], Iterable[Outside]], said: str
) -> None:
    keep(stopped_at_vise(), "go.csv")
    made = prepare(Path("tables/system.toml"), "go.csv", "python", others)
    with pytest.raises(NotResumed, match=said) as caught:
        go_on(made)
    assert caught.value.code is Code.BAD_SYSTEM


@pytest.mark.usefixtures("project")
def test_a_script_that_is_spelled_otherwise_is_the_same(capfd: pytest.CaptureFixture[str]) -> None:
    keep(stopped_at_vise(), "go.csv")
    Path("other.csv").write_text(
        HEAD + ROWS.replace('"VISE-OPEN RIGHT"', "VISE-OPEN RIGHT"), encoding="utf-8"
    )
    assert run(["run", "other.csv", *QUICK, "--resume"]) == 0
    assert capfd.readouterr().out.count("done") == 3


@pytest.mark.usefixtures("project")
def test_a_new_run_forgets_where_the_last_one_stopped() -> None:
    keep(stopped_at_vise(), "go.csv")
    assert run(["run", "go.csv", *QUICK, "-q"]) == 0
    assert run(["run", "go.csv", *QUICK, "--resume"]) == 1


@pytest.mark.usefixtures("project")
def test_a_stop_that_cannot_be_kept_says_how_to_begin_anew(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    Path("bad.csv").write_text(HEAD + "MOVE,,,FIX-SAFE,\nENGRAVE PART,,,,\n", encoding="utf-8")
    kept = keep(stopped_at_vise(), "go.csv")
    monkeypatch.setattr("rcsc.run.orders.stopped.write_atomically", full)
    assert run(["run", "bad.csv", *QUICK]) == 1
    said = capfd.readouterr().err
    assert "No space left on device" in said
    assert "rcsc run bad.csv --executor python --plant kinematic --from-row 2" in said
    assert not kept.exists(), "an older stop would be taken for this one"


# --- from a row ---


def test_from_a_row_the_interlocks_know_the_rows_before(
    project: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    takes = '"VISE-CLOSE RIGHT, CLOSE LEFT",,,,\nMOVE,BOXT (2),BUFFER,FIX-MAC1,\n'
    (project / "takes.csv").write_text(HEAD + takes, encoding="utf-8")
    assert run(["run", "takes.csv", *QUICK, "--from-row", "2"]) == 1
    shown = capfd.readouterr()
    assert "row 2, MOVE BOXT (2) BUFFER FIX-MAC1: refused: the vise is closed" in shown.err
    assert "VISE" not in shown.out
    assert run(["run", "go.csv", *QUICK, "--from-row", "3"]) == 0
    assert re.findall(r"^ +(\d+) ", capfd.readouterr().out, re.MULTILINE) == ["3", "4"]
    assert run(["run", "go.csv", *QUICK, "--from-row", "5"]) == 1
    assert "error[RCS723]: the script has 4 rows" in capfd.readouterr().err
    assert run(["run", "go.csv", *QUICK, "--from-row", "0"]) == 2


@pytest.mark.usefixtures("project")
def test_a_resumed_script_may_go_on_behind_the_row_that_stopped_it(capfd: pytest.CaptureFixture[str]) -> None:
    """Somebody closed the vise by hand: the row counts as done."""
    keep(stopped_at_vise(), "go.csv")
    made = begun()
    go_on(made)
    made.station.begin_at(2)
    assert made.station.cell == CellState(False, False, robot_at="FIX-SAFE")
    assert run(["run", "go.csv", *QUICK, "--resume", "--from-row", "3"]) == 0
    assert re.findall(r"^ +(\d+) ", capfd.readouterr().out, re.MULTILINE) == ["3", "4"]


# --- as processes ---


@pytest.mark.usefixtures("project")
def test_processes_are_not_resumed(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["run", "go.csv", *QUICK, "--resume", "--processes"]) == 2
    assert "--from-row" in capfd.readouterr().err


def test_as_a_process_what_no_level_hears_stays_inside(project: Path) -> None:
    results = project / "results"
    system = "tables/system.toml"
    shared = {wire.source for wire in description(Path(system)).wires}
    [joined] = outside_of_processes(StageOrder(system, "kinematic", "go.csv"), str(results), 1)
    held: dict[str, Values] = {}

    def latest(name: str) -> Values | None:
        assert name in shared, f"`{name}` is in no shared memory"
        return held.get(name)

    for tick in range(40):
        held |= joined.step(tick, latest)
    assert set(held) <= shared
    first = json.loads(results.read_text(encoding="utf-8").splitlines()[0])
    assert (first[0], first[2]) == (2, "done"), "the vise was heard, and row 1 was left out"
