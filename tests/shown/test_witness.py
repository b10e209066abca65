"""What refuses says for which input: in the shell, at a reload, in a run, in a log and its replay."""

import re
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest
from click.testing import CliRunner

from rcsc.base.diagnostics.render import with_witness
from rcsc.base.diagnostics.source import Source
from rcsc.front.commands.group import commands as of_rcsc
from rcsc.run.description import Description, LevelSpec, Wire
from rcsc.run.log.recorder import Recorder
from rcsc.run.system import StateTableError, System, assemble
from tests.run.test_log import GAPS, REPO
from tests.support.programs.stages import emitted, program_of, reported
from tests.support.programs.texts import edit_file
from tests.support.shells import alone, do, refused

GRIPPER = "gripper/gripper.rcs"
VALUES = re.compile(r"`([a-z_.]+)` = ([a-z0-9_.-]+)")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the shipped system, to be edited; its description."""
    shutil.copytree(REPO / "tables", tmp_path / "tables", ignore=shutil.ignore_patterns(".rcsc-cache"))
    shutil.copytree(REPO / "generated", tmp_path / "generated")
    return tmp_path / "tables" / "system.toml"


def broken(folder: Path, kind: str) -> System:
    """A level whose table has a gap and an overlap, by force."""
    for name, text in emitted(program_of(GAPS)).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    wires = (Wire("over.order", "lone.command"), Wire("under.report", "lone.reported"))
    about = Description("finding", folder, folder, 40, (LevelSpec("lone", "case", ()),), wires)
    return assemble(about, "c" if kind == "c" else "python", {})


FAULTS = {
    "gap": ((3, 55), 9, {"command.width": "55", "reported": "9"}),
    "overlap": ((3, 7), 2, {"command.width": "7", "reported": "2"}),
}


@pytest.mark.parametrize("name", list(FAULTS))
@pytest.mark.parametrize("kind", ["c", "python"])
def test_a_run_that_a_table_ends_says_what_the_table_saw(name: str, kind: str, tmp_path: Path) -> None:
    order, report, saw = FAULTS[name]
    running = broken(tmp_path, kind)
    with Recorder(running, tmp_path / "run.mcap") as recorder:
        running.watch.append(recorder)
        running.buffers.publish("over.order", order)
        running.buffers.publish("under.report", (report,))
        with pytest.raises(StateTableError) as caught:
            running.step()
    assert witnessed(str(caught.value)) == saw
    for args in (["log"], ["replay", "--generated", str(tmp_path), "--executor", kind, "--at", "1"]):
        said = CliRunner().invoke(of_rcsc, [*args, str(tmp_path / "run.mcap")]).output
        assert witnessed(next(line for line in said.splitlines() if "it saw" in line)) == saw


def witnessed(text: str) -> Mapping[str, str]:
    return dict(VALUES.findall(text.partition("it saw")[2]))


def test_an_input_that_is_refused_is_no_witness_of_the_table(tmp_path: Path) -> None:
    running = broken(tmp_path, "python")
    running.buffers.publish("over.order", (3, 101))
    with pytest.raises(StateTableError, match=r"`command\.width` = 101") as caught:
        running.step()
    assert "it saw" not in str(caught.value)


def test_a_reload_that_does_not_prove_shows_the_witness(project: Path) -> None:
    commands = alone(project)
    edit_file(
        project.parent / GRIPPER,
        ("| 2    | false       | moving    | true   | ", "| 2    | false       | d_state   | true   | "),
    )
    said = str(refused(commands, "reload gripper"))
    assert "error[RCS401]" in said
    assert "error[RCS402]" in said
    witnesses = re.findall(r"witness: (.*)", said)
    assert witnesses
    assert any("cur_state = moving" in witness for witness in witnesses)
    assert any("cur_state = d_state" in witness for witness in witnesses)
    assert "region: " in said


def test_a_part_that_is_refused_shows_the_witness(project: Path) -> None:
    commands = alone(project)
    table = """\
assume low monitored : waited < 150

table counts assuming low {
  | line | waited | new_command || procedures |
  | all  | < 150  |             ||            |
}

level gripper {"""
    edit_file(project.parent / GRIPPER, ("level gripper {", table))
    do(commands, "reload gripper", "level gripper", "waited = 150")
    said = witnessed(str(refused(commands, "counts")))
    assert said["waited"] == "150"


CASES = {
    "gap": ("| a | < 3 || |\n", "witness: width = 3"),
    "overlap": ("| a | < 7 || |\n| b | > 5 || |\n", "witness: width = 6"),
}


@pytest.mark.parametrize("name", list(CASES))
def test_a_line_with_its_witness(name: str) -> None:
    rows, wanted = CASES[name]
    text = f"input width : int 0 .. 9\ntable t {{\n| line | width || procedures |\n{rows}}}\nlevel l {{ period 40 [ms] table t }}\n"
    found = next(one for one in reported(text) if one.witnesses)
    said = with_witness(found, {"case.rcs": Source("case.rcs", text)}).splitlines()
    assert said[0].startswith("case.rcs:")
    assert wanted in said[1]
    assert said[2].startswith("  region: width")
