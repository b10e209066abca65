"""The mobile robot of the examples: its requirements across levels hold, and a fault in its wires or its tables breaks one of them."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.proof import Across, Question
from rcsc.compose.together.words import stated_across
from rcsc.front.commands import run
from rcsc.run.description import description
from tests.bench.growth import across

Edited = Callable[[Path, str, str, str], Path]
VERDICTS = ("p1", "p2", "p3", "p6", "p6_anew", "p7", "p7_mission", "p8")
EXAMPLES = Path(__file__).parents[2] / "tables" / "examples"
AMR = EXAMPLES / "amr"
NODES = EXAMPLES / "two_nodes"


def _question(folder: Path, name: str) -> Question:
    path = folder / "system.toml"
    systems, _ = read_systems(path)
    system = description(path)
    stated = stated_across(system, {level: ts.program for level, ts in systems.items()})
    assert stated is not None
    [wanted] = [one for one in stated[0].properties if one.name == name]
    return Question(systems, system, stated[0], wanted)


def _answer(folder: Path, name: str) -> Across:
    """Answer a requirement by short runs and predicates alone; the levels' own proofs take longer than this."""
    return _question(folder, name).verdict(soon=True)


@pytest.fixture
def edited(tmp_path: Path) -> Edited:
    """Return how a copy of an example is made in which one text stands for another, in every place."""

    def copy(example: Path, file: str, old: str, new: str) -> Path:
        folder = tmp_path / example.name
        shutil.copytree(example, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
        text = (folder / file).read_text(encoding="utf-8")
        assert old in text
        (folder / file).write_text(text.replace(old, new), encoding="utf-8")
        return folder

    return copy


def test_the_emergency_stop_holds_drive_and_lift_whatever_restarts_or_is_refused() -> None:
    found = _answer(AMR, "p2")
    assert (found.proved, found.levels) == (True, ("drive", "lift"))
    assert found.around.refuses
    assert found.around.restarts


def test_a_cut_wire_of_the_emergency_stop_is_shown(edited: Edited) -> None:
    cut = edited(AMR, "system.toml", '["drive.estop", "lift.estop"]', '"drive.estop"')
    found = _answer(cut, "p2")
    assert found.refuted
    assert len(found.run) == 4


def test_two_equal_nodes_never_disagree_for_good() -> None:
    found = _answer(NODES, "agree")
    assert (found.proved, found.levels) == (True, ("manager", "left", "right"))
    assert not found.around.restarts


def test_how_long_they_may_disagree_is_shown(edited: Edited) -> None:
    sooner = edited(NODES, "requirements.rcs", "for 7 cycles", "for 6 cycles")
    found = _answer(sooner, "agree")
    assert found.refuted
    assert len(found.run) == 8


def test_a_requirement_of_two_levels_is_proved_of_them_alone_whatever_stands_above() -> None:
    found = {name: answer for name, answer, _ in across(3)}
    assert all(answer.proved for answer in found.values())
    assert found["end_to_end"].levels == ("l0", "l1", "l2")
    assert found["lowest_two"].levels == ("l1", "l2")


@pytest.mark.thorough
def test_what_was_wanted_of_the_robot_is_proved(capfd: pytest.CaptureFixture[str]) -> None:
    capfd.readouterr()
    assert run(["prove", "--no-cache", "--json", str(AMR)]) == 0
    told = json.loads(capfd.readouterr().out)["requirements"]
    assert {one["name"]: one["verdict"] for one in told} == dict.fromkeys(VERDICTS, "proved")
