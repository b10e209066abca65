"""Every command on small systems that are nobody's cell: an answer or a coded error, never a bug in rcsc."""

import io
import json
import shutil
import sys
from pathlib import Path

import pytest

from rcsc.front import commands
from rcsc.run.adopt import adopt
from rcsc.run.description import description
from rcsc.run.system import assemble

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
    "shell", "shell --script steps.txt --executor python",
    "run day", "run day --processes", "run day --plant kinematic --report r.html",
    "run day --resume", "run day --from-row 3", "run nothing", "run day --log kept.mcap",
    "db check", "db build -o made.sqlite", "db show", "db show places", "db show --database none",
    "campaign --episodes 1 --workers 1", "prove --level task",
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


# --- fields by the names of the protocol, of other types ---

TYPED = """
enum job {{ rest, drill }}
enum status {{ done, executing }}
record order {{
  inc_command : {number}
  input_command : {command}
}}
record answer {{
  inc_command_echo : {echo}
  ref_command_echo : {echoed}
  status_report : {status}
}}
record robot {{ number : {back} }}
record to_robot {{
  number : {sent}
  input_command : {wanted}
}}
input command : order
input answered : answer
input robot : robot
state inc_command_seen : {seen} = {seen_initial}
state cur_state : bool
state status_report : int 0 .. 3
output report : answer
output ask : order
output to_robot : to_robot
output al : bool
invariant seen_stays : inc_command_seen = {seen_initial}
invariant sent_stays : to_robot.number = {sent_initial}
invariant wanted_stays : to_robot.input_command = {wanted_initial}
table t {{
  | line | command.input_command = command.input_command || al   |
  |------|-----------------------------------------------||------|
  | all  | true                                          || true |
}}
level solo {{ period 40 [ms] table t }}
"""
NUMBERED = "int 0 .. 65535"
USUAL = dict.fromkeys(("number", "echo", "back", "sent", "seen"), NUMBERED) | {
    "command": "job", "echoed": "job", "status": "status", "wanted": "job"
}  # fmt: skip
INITIALS = {
    NUMBERED: "0", "int 5 .. 9": "5", "bool": "false", "job": "rest", "status": "done", "real 5.0 .. 9.0": "5.0",
}  # fmt: skip
TO_ABOVE = '"boss.order" = "solo.command"\n"solo.report" = "boss.report"\n'
TO_BELOW = '"solo.ask" = "hand.order"\n"hand.report" = "solo.answered"\n'


def typed(folder: Path, wires: str, **kinds: str) -> None:
    """A system of one level with fields of such types."""
    types = USUAL | kinds
    initials = {f"{name}_initial": INITIALS[types[name]] for name in ("seen", "sent", "wanted")}
    text = TYPED.format(**types, **initials)
    (folder / "solo.rcs").write_text(text, encoding="utf-8")
    system = HEAD.format(name="typed", data="") + LEVEL.format(level="solo", program="solo")
    (folder / "system.toml").write_text(f"{system}[buffers]\n{wires}", encoding="utf-8")


@pytest.mark.parametrize("wires", [TO_ABOVE, TO_BELOW], ids=["above", "below"])
@pytest.mark.parametrize(
    ("field", "kind", "said"),
    [
        ("number", "bool", "inc_command` counts orders, and is no whole number"),
        ("echo", "real 5.0 .. 9.0", "inc_command_echo` counts orders, and is no whole number"),
        ("command", "bool", "input_command`, and is of another type"),
        ("command", NUMBERED, "input_command`, and is of another type"),
        ("echoed", "status", "input_command`, and is of another type"),
    ],
)
def test_what_cannot_be_an_order_and_its_report_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wires: str, field: str, kind: str, said: str
) -> None:
    typed(tmp_path, wires, **{field: kind})
    assert commands.run(["prove", str(tmp_path / "system.toml"), "--no-cache", "--jobs", "1"]) == 1
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    "kinds",
    [
        {"seen": "bool", "sent": "bool", "wanted": "bool"}, {"seen": "job", "back": "real 5.0 .. 9.0", "wanted": "real 5.0 .. 9.0"},
        {"seen": "real 5.0 .. 9.0", "sent": "job", "back": "job"}, {"seen": "int 5 .. 9"}, {"number": "int 5 .. 9"},
        {"number": "real 5.0 .. 9.0"},
    ],
    ids=str,
)  # fmt: skip
def test_a_restart_adopts_numbers_and_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], kinds: dict[str, str]
) -> None:
    """What `prove` says of a level after a restart is what restarts do: of what a level adopts, nothing is known."""
    typed(tmp_path, "", **kinds)
    assert commands.run(["compile", str(tmp_path), "--out", str(tmp_path / "generated")]) == 0
    capsys.readouterr()
    status = commands.run(["prove", str(tmp_path / "system.toml"), "--no-cache", "--jobs", "1", "--json"])
    assert status in {0, 1}
    proof = json.loads(capsys.readouterr().out)
    proved = {goal["name"]: goal["verdict"] == "proved" for goal in proof["levels"][0]["goals"]}
    system = assemble(description(tmp_path / "system.toml"), "python", {}, ())
    level = system.level("solo")
    before = level.values
    taken = level.sign.index["command.inc_command"]
    adopted = adopt(level.sign, (*before[:taken], 9, *before[taken + 1 :]))
    for name, leaf in (
        ("seen_stays", "inc_command_seen"),
        ("sent_stays", "to_robot.number"),
        ("wanted_stays", "to_robot.input_command"),
    ):
        at = level.sign.index[leaf]
        assert proved[name] == (adopted[at] == before[at]), name
