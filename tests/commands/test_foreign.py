"""Every command on small systems that are nobody's cell: an answer or a coded error, never a bug in rcsc."""

import io
import shutil
import sys
from pathlib import Path

import pytest

from rcsc import commands

SOLO = """
input go : bool
state n : int 0 .. 9
output al : bool
invariant low : n <= 9
property low_now : n <= 9
table t {
  | line | go    || procedures | al    |
  |------|-------||------------|-------|
  | yes  | true  ||            | true  |
  | no   | false ||            | false |
}
level NAME { period 40 [ms] table t }
"""
ORDERS = """
enum job { rest, drill }
enum status { done, executing }
type number = int 0 .. 65535
record order {
  inc_command : number
  input_command : job
}
record answer {
  inc_command_echo : number
  status : status
}
"""
ABOVE = """
input answered : answer
state state_now : job
output ask : order
module down reads answered writes ask {
  ask.inc_command := (answered.inc_command_echo + 1) mod 65536
  ask.input_command := drill
}
table t {
  | line | answered.status || state_now |
  |------|-----------------||-----------|
  | done | done            || rest      |
  | busy | executing       || drill     |
}
level task { period 40 [ms] table t postprocess down }
"""
BELOW = """
input command : order
state seen : number
output report : answer
procedure answer_it {
  report.inc_command_echo := command.inc_command
  report.status := done
  seen := command.inc_command
}
table t {
  | line  | when                          || procedures |
  |-------|-------------------------------||------------|
  | fresh | command.inc_command /= seen   || answer_it  |
  | old   | command.inc_command = seen    || answer_it  |
}
level lower { period 80 [ms] table t }
"""
HEAD = 'name = "{name}"\ngenerated = "generated"\ntick_ms = 40\n{data}\n'
LEVEL = '[[level]]\nname = "{level}"\nprogram = "{program}"\n'
WIRES = '"task.ask" = "lower.command"\n"lower.report" = "task.answered"\n'
# Of each: its programs, its levels with their programs, buffers, what is said of data.
SYSTEMS = {
    "no task, no data": ({"solo": SOLO.replace("NAME", "solo")}, {"solo": "solo"}, "", ""),
    "a task without commands": ({"one": SOLO.replace("NAME", "task")}, {"task": "one"}, "", 'data = "system.toml"'),
    "a task without commands, over a cell": (
        {"one": SOLO.replace("NAME", "task")}, {"task": "one"}, '"line.go" = "task.go"\n', 'data = "cell.toml"'
    ),
    "numbers and no status_report": (
        {"above": ORDERS + ABOVE, "below": ORDERS + BELOW}, {"task": "above", "lower": "below"}, WIRES, 'data = "cell.toml"'
    ),
}  # fmt: skip


@pytest.fixture(scope="module", params=SYSTEMS)
def foreign(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, repo: Path) -> Path:
    """A system's folder: compiled, with the shipped data and a script beside it."""
    programs, levels, wires, data = SYSTEMS[request.param]
    folder = tmp_path_factory.mktemp("foreign")
    for name, text in programs.items():
        (folder / f"{name}.rcs").write_text(text, encoding="utf-8")
    text = HEAD.format(name="foreign", data=data)
    text += "".join(LEVEL.format(level=level, program=program) for level, program in levels.items())
    (folder / "system.toml").write_text(f"{text}[buffers]\n{wires}", encoding="utf-8")
    shutil.copy(repo / "tables/cell.toml", folder)
    (folder / "scripts").mkdir()
    shutil.copy(repo / "tables/scripts/make_boxt.csv", folder / "scripts/day.csv")
    assert commands.run(["compile", str(folder), "--out", str(folder / "generated")]) == 0
    return folder


COMMANDS = [
    "check .", "compile . --check", "fmt --check .", "graph -o drawn .", "diff system.toml system.toml",
    "shell", "shell --executor python", "shell --alone --executor python", "shell --script steps.txt --executor python",
    "run day", "run day --executor python --quiet", "run day --processes", "run day --plant kinematic --report r.html",
    "run day --resume", "run day --from-row 3", "run nothing", "run day --log kept.mcap",
    "db check", "db check --json", "db build", "db build -o made.sqlite", "db show", "db show places", "db show --database none",
    "campaign --episodes 1", "campaign --episodes 1 --workers 1", "prove", "prove --level task",
    "prove --log found", "log none.mcap", "replay none.mcap", "certify .",
]  # fmt: skip
STEPS = """help
step 3
undo
new_command ?
status_report ?
command.input_command = drill
run until al
task.n = 3
reload
diff
"""


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_answers(
    foreign: Path, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(foreign)
    (foreign / "steps.txt").write_text(STEPS, encoding="utf-8")
    monkeypatch.setattr(sys, "stdin", io.StringIO(STEPS))
    status = commands.run(command.split())
    said = capsys.readouterr()
    assert status in {0, 1, 2}, said.err
    assert "Traceback" not in said.out + said.err
    assert "RCS902" not in said.out + said.err
    if status == 1:
        assert "RCS" in said.out + said.err


def test_the_shell_runs_what_is_no_cell(
    foreign: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(foreign)
    monkeypatch.setattr(sys, "stdin", io.StringIO("step 4\n"))
    assert commands.run(["shell", "--executor", "python"]) == 0
    assert "cycle 4" in capsys.readouterr().out


def test_what_runs_a_cell_says_what_it_needs(
    foreign: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(foreign)
    for command in ("run day --executor python", "campaign --episodes 1 --workers 1"):
        assert commands.run(command.split()) == 1
        said = capsys.readouterr().err
        assert "error[RCS721]: the cell needs" in said or "names no `data`" in said
