"""What the levels of the cell owe together: the file is in order, and what costs little is proved of them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.product import EVERY, Timing
from rcsc.compose.together.proof import Question
from rcsc.compose.together.words import stated_across
from rcsc.run.description import description

SYSTEM = Path(__file__).parents[2] / "tables" / "system.toml"


@cache
def _question(name: str) -> Question:
    systems, _ = read_systems(SYSTEM)
    system = description(SYSTEM)
    stated = stated_across(system, {level: ts.program for level, ts in systems.items()})
    assert stated is not None
    [wanted] = [one for one in stated[0].properties if one.name == name]
    return Question(systems, system, stated[0], wanted)


def test_each_requirement_of_the_cell_has_words_and_a_number() -> None:
    stated = _question("arm_or_fingers").program.properties
    assert [one.requirements for one in stated] == [(f"R{at}",) for at in range(1, 11)]
    assert all(one.doc for one in stated)


def test_fingers_move_only_at_rest_of_the_arm_and_no_real_is_needed_for_that() -> None:
    assert replace(_question("arm_or_fingers"), opens=True).proves(("primitive", "gripper"))


@pytest.mark.thorough
def test_fingers_move_only_at_rest_of_the_arm_whatever_restarts_or_is_refused() -> None:
    found = _question("arm_or_fingers").verdict(soon=True)
    assert (found.proved, found.timing, found.around) == (True, Timing.SCHEDULED, EVERY[0])
    assert found.levels == ("primitive", "gripper")
