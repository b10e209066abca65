"""`rcsc run SYSTEM`: the docking robot with a plant of its own, by both executors, in one process and in several, by scripts of orders."""

import csv
import importlib.util
import json
import marshal
import os
import re
import shutil
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.orders.operator import ScriptedRun, ScriptOperator
from rcsc.run.orders.roles import served
from rcsc.run.orders.script import BadScript, OrderRow, read_script, script_path
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.processes.supervisor import Course, Supervisor
from rcsc.run.system import System, assemble, signatures
from rcsc.views.pages.report import page
from rcsc.views.pages.witness import RunWitness
from tests.support.films import film_of
from tests.support.programs.texts import edit_file, edited

Said = Callable[[], str]


@pytest.fixture
def here(dock: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The docking robot's folder, seen from beside it."""
    monkeypatch.chdir(dock.parent)
    return dock


def stopped(capsys: pytest.CaptureFixture[str]) -> str:
    """What ended a command, without the lines that say how rows went."""
    return capsys.readouterr().err


def scripted(folder: Path, text: str, *, end: str = ".csv") -> ScriptedRun:
    """The docking robot with a script, ready to run."""
    (folder / f"mine{end}").write_text(text, encoding="utf-8")
    system = description(folder / "system.toml")
    signs = signatures(system)
    stage = staged(StageOrder(str(folder / "system.toml"), script="mine"), system, signs)
    running = assemble(system, "python", stage.queries, standing(stage, system, signs))
    return ScriptedRun(running, stage.operator)


def played(folder: Path, text: str, *, end: str = ".csv", most: int = 1000) -> list[tuple[str, str, int]]:
    """What became of each row: state, reason, cycles."""
    return [
        (result.state, result.reason, result.ticks) for result in scripted(folder, text, end=end).steps(most)
    ]


# --- the command ---


def test_the_docking_robot_docks_with_both_executors_and_leaves_equal_logs(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for kind in ("c", "python"):
        assert run(["run", "dock", "--no-compile", "--executor", kind, "--log", f"{kind}.mcap"]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [line.split()[1:3] for line in lines[:3]] == [
            ["dock", "done"],
            ["stop", "done"],
            ["undock", "done"],
        ]
    assert Path("c.mcap").read_bytes() == Path("python.mcap").read_bytes()
    assert run(["replay", "c.mcap", "--system", "dock", "--executor", "python"]) == 0
    assert (
        run(
            [
                "replay",
                "c.mcap",
                "--generated",
                str(here / "generated"),
                "--find",
                "supervisor.now == charging",
            ]
        )
        == 0
    )
    assert "nothing differs" in capsys.readouterr().out


def test_a_log_beside_its_system_is_replayed_without_a_word(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(["run", "dock/system.toml", "--no-compile", "-q", "--executor", "python"]) == 0
    log = here / ".rcsc-cache" / "dock.mcap"
    assert run(["replay", str(log), "--executor", "python"]) == 0
    monkeypatch.chdir(here)
    assert run(["run", "dock.csv", "--no-compile", "-q", "--executor", "python"]) == 0
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python"]) == 0
    assert run(["run", "--no-compile", "-q", "--executor", "python", "--rate", "20"]) == 0


TAMPERED = '#include <stdio.h>\n__attribute__((constructor)) static void tampered(void) { puts("TAMPERED"); fflush(stdout); }\n'


def test_executors_that_the_tables_do_not_give_are_made_anew_or_said(
    here: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """By what runs them; a header and a compiled module that lie beside them are nothing of theirs."""
    assert run(["run", "dock", "-q", "--log", "run.mcap"]) == 0
    python, c = here / "generated" / "python" / "drive.py", here / "generated" / "c" / "drive.c"
    before = c.read_text(encoding="utf-8")
    Path("other").mkdir()
    shutil.copytree(here / "generated", "other/generated")
    tampered = before.replace('#include "drive.h"\n', f'#include "drive.h"\n{TAMPERED}')
    for path in (c, Path("other/generated/c/drive.c")):
        path.write_text(tampered, encoding="utf-8")
    (c.parent / "stdint.h").write_text("#error planted\n", encoding="utf-8")
    planted_beside(python)
    assert run(["replay", "run.mcap", "--system", "dock"]) == 1
    assert "error[RCS501]" in capfd.readouterr().out
    assert run(["replay", "run.mcap", "--generated", "other/generated"]) == 0
    said = capfd.readouterr()
    assert said.err.startswith("note: the executors in `other/generated` run as they lie there")
    assert "ticks replayed, by other executors than ran then: nothing differs" in said.out
    Path("script").write_text("step 3\n", encoding="utf-8")
    for kind in ("c", "python"):
        assert run(["shell", "dock", "--script", "script", "--executor", kind]) == 0
    assert c.read_text(encoding="utf-8") == before
    said = capfd.readouterr()
    assert "cycle 3" in said.out
    assert "TAMPERED" not in said.out


def planted_beside(module: Path) -> None:
    """Plant a compiled module that Python itself would take for that text."""
    about = module.stat()
    code = marshal.dumps(compile("import os; os._exit(9)", str(module), "exec"))
    head = importlib.util.MAGIC_NUMBER + struct.pack(
        "<III", 0, int(about.st_mtime), about.st_size & 0xFFFFFFFF
    )
    place = Path(importlib.util.cache_from_source(str(module)))
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(head + code)


@pytest.mark.usefixtures("here")
def test_each_level_in_a_process_does_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    """In step their log is that of one process, byte for byte; else it says what fell otherwise, and is replayed all the same."""
    quick = ["run", "dock", "--no-compile", "--executor", "python", "--report", "run.html", "--log"]
    assert run([*quick, "one.mcap"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if " done " in line]
    assert run([*quick, "step.mcap", "--processes", "--in-step", "--rate", "20"]) == 0
    first, second, *lines, last = capsys.readouterr().out.splitlines()
    assert first == "each level in a process of its own, 20 times as fast as the clock"
    assert "rcsc studio --attach dock" in second
    assert (lines, last) == (rows, "log: step.mcap; report: run.html")
    assert Path("step.mcap").read_bytes() == Path("one.mcap").read_bytes()
    assert "undock" in Path("run.html").read_text(encoding="utf-8")
    assert run([*quick[:-3], "--processes", "--rate", "20", "--log", "free.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()[2:-1]
    assert [line.split()[1:3] for line in lines] == [["dock", "done"], ["stop", "done"], ["undock", "done"]]
    assert run(["replay", "free.mcap", "--system", "dock", "--executor", "python"]) == 0
    assert "nothing differs" in capsys.readouterr().out
    assert run(["log", "free.mcap"]) == 0
    assert "level supervisor: " in capsys.readouterr().out


def test_processes_run_for_so_many_cycles(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With a script that is not over by then, and without one."""
    quick = ["run", "dock", "--no-compile", "--executor", "python", "--cycles", "7", "--log"]
    assert run([*quick, "one.mcap"]) == 1
    assert run([*quick, "step.mcap", "--processes", "--in-step", "--rate", "20"]) == 1
    assert stopped(capsys).splitlines()[-1] == "error[RCS724]: row 1 did not end in 7 cycles"
    assert Path("step.mcap").read_bytes() == Path("one.mcap").read_bytes()
    system = (here / "system.toml").read_text(encoding="utf-8")
    (here / "system.toml").write_text(edited(system, ('script = "dock.csv"\n', "")), encoding="utf-8")
    assert run([*quick, "step.mcap", "--processes", "--in-step", "--rate", "20"]) == 0
    assert run([*quick, "one.mcap"]) == 0
    assert Path("step.mcap").read_bytes() == Path("one.mcap").read_bytes()


@pytest.mark.usefixtures("here")
def test_who_attaches_learns_which_faults_the_plant_has(monkeypatch: pytest.MonkeyPatch) -> None:
    courses: list[Course] = []
    kept = "rcsc.front.commands.systems.run.run_processes"
    monkeypatch.setattr(kept, lambda *_, course, **__: courses.append(course))
    quick = ["run", "dock", "--no-compile", "-q", "--processes", "--fault", "wheel_slips"]
    assert run([*quick, "--cycles", "7"]) == 1  # no row ended
    [course] = courses
    assert (course.faults, course.on) == ({"wheel_slips": None}, ("wheel_slips",))
    system = Supervisor(description(Path("dock/system.toml")), "python", {}, course=course)
    try:
        assert system._heeded.switches.on == {"wheel_slips"}
    finally:
        system.close()


def test_what_is_wrong_is_told_before_a_process_is_begun(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (here / "base.py").read_text(encoding="utf-8")
    (here / "base.py").write_text(edited(text, ("bumper: bool", "bumper: int")), encoding="utf-8")
    for more in ([], ["--processes"]):
        assert run(["run", "dock", "--no-compile", "-q", *more]) == 1
        assert "error[RCS729]: `bumper` of `Base` (base.py:49) is `int`" in stopped(capsys)
    system = (here / "system.toml").read_text(encoding="utf-8")
    (here / "system.toml").write_text(edited(system, ('script = "dock.csv"\n', "")), encoding="utf-8")
    (here / "base.py").write_text(text, encoding="utf-8")
    assert run(["run", "dock", "--no-compile", "-q", "--processes"]) == 1
    assert "processes run until a script ends" in stopped(capsys)


def test_without_a_script_it_runs_for_so_many_cycles(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = (here / "system.toml").read_text(encoding="utf-8")
    (here / "system.toml").write_text(edited(system, ('script = "dock.csv"\n', "")), encoding="utf-8")
    assert run(["run", "dock", "--no-compile", "--executor", "python"]) == 0
    first, second, *_ = capsys.readouterr().out.splitlines()
    assert first == "nobody filled `supervisor.command`: these inputs stayed as at first"
    assert second.startswith("1000 cycles, 40.0 s of control time")
    assert run(["run", "dock", "--no-compile", "--executor", "python", "--cycles", "7"]) == 0
    assert "\n7 cycles" in capsys.readouterr().out
    base = (here / "base.py").read_text(encoding="utf-8")
    (here / "base.py").write_text(base + "        self.over = True\n", encoding="utf-8")
    assert run(["run", "dock", "--no-compile", "--executor", "python"]) == 0
    assert "\n1 cycles" in capsys.readouterr().out


def test_a_buffer_that_was_forgotten_is_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By what is proved without it, too: any value of an input that nothing fills."""
    assert run(["run", "dock", "--no-compile", "--executor", "python"]) == 0
    assert run(["prove", "dock", "--level", "drive", "--trace", "0"]) == 0
    said = capsys.readouterr().out
    assert "nobody filled" not in said
    assert "no buffer" not in said
    edit_file(
        here / "system.toml",
        ('"base.bumper" = "drive.bumper"\n', ""),
        ('"drive.speed_mm_s" = "base.speed"\n', ""),
        ('"base.bumper" = { value = false }\n', ""),
        ("[plant.mujoco.actuators]\n", "[plant.mujoco.actuators]\n#"),
    )
    assert run(["run", "dock", "--no-compile", "--executor", "python", "--cycles", "5"]) == 1, (
        "it stands still"
    )
    said = capsys.readouterr().out
    assert "nobody filled `drive.bumper`: these inputs stayed as at first" in said
    assert "no buffer takes `drive.speed_mm_s`" in said
    assert run(["prove", "dock", "--level", "drive", "--trace", "0"]) == 0
    said = capsys.readouterr().out
    assert "no buffer fills `drive.bumper`: proved for any value" in said
    assert "no buffer takes `drive.speed_mm_s`" in said


def test_without_a_plant_nothing_moves_but_what_the_script_sets(here: Path) -> None:
    system = (here / "system.toml").read_text(encoding="utf-8")
    (here / "system.toml").write_text(edited(system, ('[plant]\npython = "base.py"\n', "")), encoding="utf-8")
    text = "command,base.beacon,base.contact,base.travelled,base.lateral,cycles\ndock,true,false,640,100,5\n,,true,640,0,6\n"
    run_ = scripted(here, text)
    assert [result.state for result in run_.steps(100)] == ["done", "done"]
    assert run_.system.level("supervisor").shown("report.status_report") == "done"


PICTURE = """
    def picture(self) -> str:
        return f'<svg xmlns="http://www.w3.org/2000/svg"><title>at {self.travelled:.2f} m</title></svg>'
"""


def test_a_report_is_written_and_nothing_is_left_to_resume(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = (here / "base.py").read_text(encoding="utf-8")
    (here / "base.py").write_text(base + PICTURE, encoding="utf-8")
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python", "--report", "dock.html"]) == 0
    page = Path("dock.html").read_text(encoding="utf-8")
    for said in (
        "every row done",
        "supervisor · dock",
        "times as fast as the clock",
    ):
        assert said in page
    assert film_of(page)["shown"] == ["drive.travelled_mm", "drive.lateral_mm", "drive.speed_mm_s"]
    assert run(["run", "dock", "--no-compile", "-q", "--resume"]) == 1
    assert "error[RCS726]: there is nothing to resume" in stopped(capsys)


def test_a_row_that_fails_stops_the_script_and_says_why(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = (here / "base.py").read_text(encoding="utf-8")
    (here / "base.py").write_text(
        edited(base, ("beacon: bool = True", "beacon: bool = False")), encoding="utf-8"
    )
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python"]) == 1
    error = stopped(capsys)
    assert "error[RCS724]: row 1, dock: failed: reason no_beacon" in error
    assert "rcsc run dock --executor python --resume" in error
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python", "--from-row", "3"]) == 0
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python", "--from-row", "4"]) == 1
    assert "error[RCS723]: the script has 3 rows, and none is 4" in stopped(capsys)


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (["nowhere/system.toml"], 2, "there is no file `nowhere/system.toml`"),
        (["empty/"], 2, "the folder `empty` has no system.toml"),
        (["dock", "--system", "dock"], 2, "`dock` is a system, and `--system` names another"),
        (["dock.csv", "--system", "dock", "--script", "x.csv"], 2, "`dock.csv` is a script, and `--script` names another"),
        (["dock.csv"], 2, "there is no system `dock.csv`, and no system.toml here"),
        (["dok", "--system", "dock"], 2, "there is no script `dok`; did you mean `dock`?"),
        (["dock", "--script", "zzz.csv"], 2, "there is no script `zzz.csv`; those of `dock/system.toml` are dock, in"),
        (["dock", "--plant", "none.py"], 1, "error[RCS729]: there is no file `none.py`"),
        (["dock", "--live", "--processes"], 2, "--resume and --live are of one process"),
        (["dock", "--in-step"], 2, "--in-step is of --processes"),
        (["dock", "--log", "dock/rcsc.toml/x.mcap", "--processes"], 1, "the log dock/rcsc.toml/x.mcap cannot be written: "),
    ],
)  # fmt: skip
def test_what_is_meant_is_told_where_it_is_not_there(
    words: list[str], status: int, message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here.parent / "empty").mkdir()
    assert run(["run", "--no-compile", "-q", *words]) == status
    assert message in " ".join(stopped(capsys).split())


def test_the_shell_steps_the_plant_and_takes_it_back(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    commands = (
        "step", "command.inc_command = 1", "command.input_command = dock", "run until now = aligning", "undo 3",
        "expect drive.travelled_mm < 528", "run 3", "expect drive.travelled_mm = 528",
    )  # fmt: skip
    (here / "steps.txt").write_text("\n".join(commands), encoding="utf-8")
    assert run(["shell", "dock", "--executor", "python", "--script", str(here / "steps.txt")]) == 0, (
        capsys.readouterr()
    )
    assert run(["shell", "dock", "--executor", "python", "--plant", "none.py", "--script", os.devnull]) == 1


@pytest.mark.parametrize(
    ("plant", "fault"),
    [([], "wheel_slips"), (["--plant", "mujoco"], "wheels_stuck")],
    ids=["python", "model"],
)
def test_a_fault_is_on_for_a_row_or_for_a_run(
    plant: list[str], fault: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "mine.csv").write_text(f"command,fault,cycles\ndock,{fault},20\ndock,,\n", encoding="utf-8")
    quick = ["--no-compile", "--executor", "python"]
    assert run(["run", "dock", *quick, *plant, "--script", "mine", "--log", "stuck.mcap"]) == 0
    moved = [tick["drive"]["travelled_mm"] for tick in _ticks(Path("stuck.mcap"), capsys)]
    assert moved[19] <= 5 < moved[60]
    capsys.readouterr()
    assert (
        run(["run", "dock", *quick, *plant, "--fault", fault, "--cycles", "60", "--log", "whole.mcap"]) == 1
    )
    moved = [tick["drive"]["travelled_mm"] for tick in _ticks(Path("whole.mcap"), capsys)]
    assert moved[-1] <= 5
    capsys.readouterr()
    assert run(["run", "dock", *quick, *plant, "--fault", fault[:-1]]) == 1
    assert f"no plant has a fault `{fault[:-1]}`\n  = help: did you mean `{fault}`?" in stopped(capsys)


def _ticks(log: Path, capsys: pytest.CaptureFixture[str]) -> list[dict[str, dict[str, int]]]:
    assert run(["log", str(log), "--csv", "out.csv"]) == 0
    capsys.readouterr()
    rows = list(csv.DictReader(Path("out.csv").read_text(encoding="utf-8").splitlines()))
    return [{"drive": {"travelled_mm": int(row["drive.travelled_mm"] or 0)}} for row in rows]


def test_the_shell_gives_orders_with_the_next_number(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    commands = (
        "step", "order dock", "expect command.inc_command = 1 and command.input_command = dock", "run until now = aligning",
        "order supervisor undock", "expect command.inc_command = 2", "run 100", "expect report.status_report = done",
    )  # fmt: skip
    asked = ["shell", "dock", "--executor", "python", "--script", str(here / "steps.txt")]
    (here / "steps.txt").write_text("\n".join(commands), encoding="utf-8")
    assert run(asked) == 0, capsys.readouterr()
    assert "supervisor is ordered dock: number 1" in capsys.readouterr().out
    for command, message in {
        "order dok": "near it: dock",
        "order": "write `order COMMAND`",
        "order dock now": "write `order COMMAND`",
        "order dock target=5": "an order of `supervisor` has no field `target`",
        "order dock inc_command=5": "an order of `supervisor` has no field `inc_command`",
    }.items():
        (here / "steps.txt").write_text(command, encoding="utf-8")
        assert run(asked) == 1
        assert message in " ".join(stopped(capsys).split())


def test_the_shell_switches_faults(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    commands = (
        "faults", "fault wheel_slips", "step", "command.inc_command = 1", "command.input_command = dock", "run 20",
        "expect drive.travelled_mm = 0", "fault wheel_slips off", "run 20", "expect drive.travelled_mm > 5",
    )  # fmt: skip
    (here / "steps.txt").write_text("\n".join(commands), encoding="utf-8")
    asked = ["shell", "dock", "--executor", "python", "--script"]
    assert run([*asked, str(here / "steps.txt")]) == 0, capsys.readouterr()
    said = capsys.readouterr().out.splitlines()
    assert said[:2] == ["wheel_slips", "wheel_slips is on"]
    (here / "steps.txt").write_text("fault wheel_slip", encoding="utf-8")
    assert run([*asked, str(here / "steps.txt")]) == 1
    assert "did you mean `wheel_slips`?" in stopped(capsys)


# --- scripts ---


def test_rows_wait_set_expect_and_go_on(here: Path) -> None:
    text = """\
[[row]]
command = "dock"
"base.beacon" = false
expect = "failed"

[[row]]
cycles = 4

[[row]]
command = "dock"
cycles = 40

[[row]]
command = "undock"
within = 200
"""
    assert played(here, text, end=".toml") == [
        ("done", "failed as expected: reason no_beacon", 3),
        ("done", "", 4),
        ("done", "", 40),
        ("done", "", 63),
    ]


MANY_ROWS = {
    "answered": "command,cycles,within\ndock,,\nundock,,200\nstop,,\n",
    "timed": "command,cycles,fault\n,4,\n,1,wheel_slips\nstop,7,wheel_slips\n,2,\n",
    "both": "command,cycles,base.bumper\ndock,,\n,5,true\nundock,,\n,1,\n",
    "failed": "command,within\nstop,\nundock,\ndock,2\n",
}


@pytest.mark.parametrize("name", list(MANY_ROWS))
def test_the_cycles_of_all_rows_are_those_of_the_run(name: str, here: Path) -> None:
    run_ = scripted(here, MANY_ROWS[name])
    ends = list(run_.steps(2000))
    at = 0
    for end in ends:
        assert isinstance(end.row, OrderRow)
        assert end.first_tick == at
        assert end.row.cycles in (None, end.ticks)
        at += end.ticks
    aside = run_.system.tick - at
    assert (aside > 0) == (name == "failed"), "the level comes to rest"
    said = page(RunWitness(run_).story("rows", 1.0))
    assert f"{run_.system.tick} cycles" in said
    assert (f"({aside} of them after the last row)" in said) == (name == "failed")
    assert sum(map(int, re.findall(r'<td class="n">(\d+)</td><td></td></tr>', said))) == at - (
        ends[-1].ticks if name == "failed" else 0
    )
    assert len(re.findall(r"[0-9.]+ (?:s</b>control|</b>cycles)", said)) == 0, "said once"


def test_a_row_has_its_fault_in_each_of_its_cycles_and_in_no_other(here: Path) -> None:
    run_ = scripted(here, "command,cycles,fault\n,3,\n,4,wheel_slips\n,1,\n,2,wheel_slips\n,2,\n")
    on: list[bool] = []
    assert isinstance(run_.operator, ScriptOperator)
    operator = run_.operator
    run_.system.watch.append(lambda _, __: on.append(bool(operator.faults)))
    assert [end.ticks for end in run_.steps(100)] == [3, 4, 1, 2, 2]
    assert "".join(".X"[one] for one in on) == "...XXXX.XX.."


def test_a_value_that_a_row_sets_is_gone_with_the_row(here: Path) -> None:
    run_ = scripted(here, "command,base.bumper,expect\ndock,true,failed\ndock,,done\n")
    assert [result.state for result in run_.steps(500)] == ["done", "done"]
    assert run_.system.buffers.latest("base.bumper") == (False,)


def test_numbers_go_on_and_wrap(here: Path) -> None:
    run_ = scripted(here, "command\nstop\nstop\nstop\n")
    run_.system.buffers.publish("fleet.order", (65_534, 0))
    numbers: list[object] = []

    def watch(system: System, _due: object) -> None:
        numbers.append((system.buffers.latest("fleet.order") or (None,))[0])

    run_.system.watch.append(watch)
    assert len(list(run_.steps(100))) == 3
    assert list(dict.fromkeys(numbers)) == [65_535, 0, 1]


@pytest.mark.parametrize(
    ("text", "state", "reason"),
    [
        ("command,base.beacon\ndock,false\n", "failed", "reason no_beacon"),
        ("command,within\ndock,20\n", "failed", "did not end in 20 cycles"),
        ("command,within\ndock,1\n", "failed", "is not answered in 1 cycles"),
        ("command,expect\nstop,failed\n", "failed", "done, and was to be failed"),
        ("command,expect\ndock,executing\n", "done", ""),
    ],
)
def test_a_row_ends_as_it_is_reported(text: str, state: str, reason: str, here: Path) -> None:
    run_ = scripted(here, text)
    [result] = run_.steps(500)
    assert (result.state, result.reason) == (state, reason)
    if state == "failed":
        assert run_.system.level("supervisor").shown("command.input_command") == "stop"


WRONG = {
    "comand\ndock\n": "no order has a field `comand`, and no buffer from outside is called so; did you mean `command`?",
    "command\ndok\n": "row 1: `dok` under `command` is no value of `command.input_command`; did you mean `dock`?",
    "command,base.bumper\ndock,yes\n": "`yes` under `base.bumper` is no value of `bumper`; known are false, true",
    "command,base.lateral\ndock,900\n": "`900` under `base.lateral` is no value of `lateral_mm`, which holds -500 .. 500",
    "command,cycles\ndock,0\n": "row 1: `0` under `cycles` is no number of cycles",
    "command,expect\ndock,finished\n": "`finished` under `expect` is no value of `report.status_report`",
    "command,level\ndock,drive\n": "no level `drive` is ordered from outside",
    "command,drive.speed_mm_s\ndock,5\n": "no buffer from outside is called so",
    "command,inc_command\ndock,5\n": "no order has a field `inc_command`",
    "": "has no heading",
    "command,command\ndock,stop\n": "has two columns `command`",
    "command\ndock,stop\n": "row 1 has 2 cells, and the heading 1",
    'command\n"dock\n': "is no CSV file",
}


@pytest.mark.parametrize("text", list(WRONG))
def test_a_script_is_checked_whole_before_anything_moves(text: str, here: Path) -> None:
    with pytest.raises(BadScript) as caught:
        scripted(here, text)
    assert WRONG[text] in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("row = 3\n", "write each row under `[[row]]`"),
        ('[[row]]\ncommand = ["dock"]\n', "`command` is no text, number or bool"),
        ("[[row]]\nbase.bumper = true\n", "a name with a dot is written in quotes"),
        ("[[row]\n", "is not TOML"),
    ],
)
def test_a_script_in_toml_is_checked_likewise(text: str, message: str, here: Path) -> None:
    with pytest.raises(BadScript) as caught:
        scripted(here, text, end=".toml")
    assert message in str(caught.value)


def test_all_rows_that_are_wrong_are_told(here: Path) -> None:
    with pytest.raises(BadScript) as caught:
        scripted(here, "command\ndok\ndock\nundok\n")
    assert [line.rpartition("csv, ")[2][:5] for line in caught.value.shown.splitlines()] == ["row 1", "row 3"]


def test_a_system_that_nobody_outside_orders_has_no_orders(here: Path) -> None:
    sign = json.loads((here / "generated/c/supervisor.json").read_text(encoding="utf-8"))
    for leaf in sign["leaves"]:
        if leaf["name"] == "report.inc_command_echo":
            leaf["name"] = "report.echo"
    sign["restart"] = [each for each in sign.get("restart", []) if each["leaf"] != "report.inc_command_echo"]
    (here / "generated/c/supervisor.json").write_text(json.dumps(sign), encoding="utf-8")
    (here / "mine.csv").write_text("command\ndock\n", encoding="utf-8")
    system = description(here / "system.toml")
    with pytest.raises(BadScript, match="no level is ordered from outside"):
        read_script(script_path("mine", here), system, signatures(system, fitting=False))


@pytest.fixture(scope="module")
def declared(repo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A docking robot that declares its roles, and says `finished` and `broken` where others say done and failed; compiled."""
    folder = tmp_path_factory.mktemp("declared") / "dock"
    shutil.copytree(repo / "tests/data/protocol", folder, ignore=shutil.ignore_patterns(".rcsc-cache"))
    for path in folder.glob("*.rcs"):
        text = re.sub(
            r"\bfailed\b", "broken", re.sub(r"\bdone\b", "finished", path.read_text(encoding="utf-8"))
        )
        text = text.replace("finished finished", "done finished").replace("broken broken", "failed broken")
        path.write_text(text, encoding="utf-8")
    (folder / "base.py").write_text(SMALL_BASE, encoding="utf-8")
    assert run(["compile", "-q", str(folder), "--out", str(folder / "generated")]) == 0
    return folder


SMALL_BASE = """\
class Base:
    speed: int = 0
    travelled: float = 0.0
    bumper: bool = False
    beacon: bool = True

    def step(self, seconds: float) -> None:
        self.travelled += self.speed * seconds
"""


def test_what_a_program_declares_of_its_roles_is_what_a_script_goes_by(
    declared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    system = description(declared / "system.toml")
    signs = signatures(system)
    [level] = served(system, signs)
    assert (level.order, level.report, level.done, level.failed) == (
        "fleet.order",
        "supervisor.to_fleet",
        "finished",
        "broken",
    )
    serves = signs["supervisor"].serves
    assert serves is not None
    other = replace(signs["supervisor"], serves=replace(serves, order="from_drive"))
    assert served(system, {**signs, "supervisor": other}) == ()
    script = tmp_path / "day.csv"
    script.write_text("command,base.beacon,expect\ndock,,\nstop,,\ndock,false,broken\n", encoding="utf-8")
    log = tmp_path / "day.mcap"
    asked = [
        "run", str(declared), "--plant", "base.py", "--script", str(script), "--no-compile", "--executor",
        "python", "--log", str(log),
    ]  # fmt: skip
    assert run(asked) == 0, capsys.readouterr()
    assert run(["replay", str(log), "--system", str(declared), "--executor", "python"]) == 0
    script.write_text("command,base.beacon\ndock,false\n", encoding="utf-8")
    assert run([*asked, "-q"]) == 1
    assert "row 1, dock base.beacon=false: failed: why no_beacon" in stopped(capsys)


FEED = 'name = "drive"\nfeed = [{ into = "lateral_mm", query = "aside", keys = ["travelled_mm"] }]'


def test_a_plant_answers_what_a_feed_asks(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = (here / "system.toml").read_text(encoding="utf-8")
    aside = '"base.lateral" = { sensor = "beacon", element = 1 }\n'
    text = edited(
        system, ('name = "drive"', FEED), ('"base.lateral" = "drive.lateral_mm"\n', ""), (aside, "")
    )
    (here / "system.toml").write_text(text, encoding="utf-8")
    assert run(["run", "dock", "--no-compile", "-q", "--executor", "python"]) == 1
    assert "error[RCS721]: nobody answers `aside`, which fills `drive.lateral_mm`" in stopped(capsys)
    base = (here / "base.py").read_text(encoding="utf-8")
    answer = "\n    def aside(self, travelled_mm: int) -> tuple[int]:\n        return (max(0, 120 - travelled_mm // 5),)\n"
    (here / "base.py").write_text(base + answer, encoding="utf-8")
    (here / "go.csv").write_text("command,base.contact\ndock,true\n", encoding="utf-8")
    for more in ([], ["--processes", "--rate", "5"]):
        assert (
            run(["run", "dock", "--no-compile", "-q", "--executor", "python", "--script", "go.csv", *more])
            == 0
        )


def test_several_levels_are_ordered_by_one_script(here: Path) -> None:
    system = (here / "system.toml").read_text(encoding="utf-8")
    apart = (
        ('"supervisor.to_drive" = "drive.command"', '"pilot.order" = "drive.command"'),
        ('"drive.report" = "supervisor.drive"', '"drive.report" = "pilot.report"'),
    )
    (here / "system.toml").write_text(edited(system, *apart), encoding="utf-8")
    text = "level,command,target_mm,within\ndrive,goto,300,100\nsupervisor,stop,,20\ndrive,goto,600,100\n"
    run_ = scripted(here, text)
    assert [result.state for result in run_.steps(500)] == ["done"] * 3
    assert 600 <= int(run_.system.level("drive").value("travelled_mm")) < 640
    for rows, message in (
        ("command\ngoto\n", "several levels can be ordered: name one under `level`: supervisor, drive"),
        ("level,command,target_mm\nsupervisor,stop,5\n", "`target_mm` is no field of `fleet.order`"),
        ("level,target_mm\ndrive,5\n", "`target_mm` is no field of an order, for there is no `command`"),
        ("level,command\ndriv,goto\n", "no level `driv` is ordered from outside; did you mean `drive`?"),
    ):
        with pytest.raises(BadScript) as caught:
            scripted(here, rows)
        assert message in str(caught.value)
