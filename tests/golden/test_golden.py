"""What is kept is what commands say now, of the smallest subjects; and a difference is told."""

import pytest

from tests.golden.__main__ import KEPT, differences, of
from tests.golden.subjects import COMMANDS, Subject, subjects

EVERY = {subject.name: subject for subject in subjects()}


@pytest.mark.parametrize("name", ["new-level"])
def test_commands_say_what_is_kept(name: str) -> None:
    """`python -m tests.golden` runs them all."""
    assert differences(of(EVERY[name]), EVERY[name]) == []


def test_a_difference_is_told() -> None:
    subject = EVERY["new-level"]
    now = {
        f"{subject.name}/{path.name}": path.read_text(encoding="utf-8")
        for path in (KEPT / subject.name).glob("*")
    }
    now[f"{subject.name}/check.txt"] = now[f"{subject.name}/check.txt"].replace("7 lines", "8 lines")
    [told] = differences(now, subject)
    assert "-  grip  proved     7 lines" in told
    del now[f"{subject.name}/check.txt"]
    assert len(differences(now, subject)) == 1


def test_every_subject_is_kept_with_each_command() -> None:
    def names(subject: Subject) -> set[str]:
        return {step.name for step in subject.steps}

    assert {path.name for path in KEPT.iterdir()} == EVERY.keys()
    assert {name: {path.stem for path in (KEPT / name).iterdir()} for name in EVERY} == {
        name: names(subject) for name, subject in EVERY.items()
    }


def test_every_command_is_tried() -> None:
    tried = {
        step.args[0] for subject in EVERY.values() for step in subject.steps if "--help" not in step.args
    }
    assert tried | {"evidence", "lsp", "studio"} == set(COMMANDS)  # these run tools, or wait for somebody
