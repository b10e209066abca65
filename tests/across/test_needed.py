"""What requirements across levels need of each level: what is left out may write anything, and they hold all the same."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import pytest

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.parts import How, Use, of_program, uses_of
from rcsc.compose.coverage.questions import with_program
from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.compose.together.needed import core_across
from rcsc.compose.together.proof import Question
from rcsc.compose.together.words import stated_across
from rcsc.front.commands import run
from rcsc.run.description import description
from tests.across.test_across import _written

HANDS = """\
requirement never_both : always not (left.runs and right.runs)
requirement one_order : always not (boss.go_left and boss.go_right)
requirement obeys : when boss.go_left, within 1 cycles, left.runs or not boss.go_left
"""


@pytest.fixture
def hands(tmp_path: Path) -> Path:
    """A boss that lets one of two hands run."""
    return _written(tmp_path, HANDS)


def questions(
    path: Path,
    change: Callable[[Mapping[str, TransitionSystem]], Mapping[str, TransitionSystem]] | None = None,
) -> list[Question]:
    """The questions of a system, with the proofs of its levels; of changed levels nothing is known."""
    systems, _ = read_systems(path)
    proofs = {}
    if change is None:
        proofs = {one.level: one for one in prove_transition_systems(systems, None, 1, tuple(systems)).levels}
    system = description(path)
    stated = stated_across(system, {name: ts.program for name, ts in systems.items()})
    assert stated is not None
    there = dict(systems) if change is None else dict(change(systems))
    return [Question(there, system, stated[0], one, proofs) for one in stated[0].properties]


def without(
    off: Mapping[str, Iterable[Use]],
) -> Callable[[Mapping[str, TransitionSystem]], dict[str, TransitionSystem]]:
    """Levels in which these uses write any value."""

    def changed(systems: Mapping[str, TransitionSystem]) -> dict[str, TransitionSystem]:
        return {
            name: with_program(ts, of_program(ts.program, ts.level, How.FREE, off.get(name, ())), ts)
            for name, ts in systems.items()
        }

    return changed


def test_what_no_proof_needs_may_write_anything(hands: Path) -> None:
    """Found with the levels' own invariants, judged without them."""
    for question in questions(hands):
        core = core_across(question, question.answer())
        assert core.uses is not None
        off = {
            name: [use for use in uses_of(ts.program, ts.level) if use not in core.uses.get(name, ())]
            for name, ts in question.systems.items()
        }
        [again] = [each for each in questions(hands, without(off)) if each.stated == question.stated]
        assert again.answer().proved, question.stated.name


def test_what_a_proof_needs_is_told_by_level_and_its_loss_breaks_it(hands: Path) -> None:
    [question] = [each for each in questions(hands) if each.stated.name == "obeys"]
    core = core_across(question, question.answer())
    assert core.of("boss") == core.of("right") == ()
    [on] = core.of("left") or ()
    assert (on.table, on.line, on.part.leaves) == ("move_left", "on", ("runs",))
    [broken] = [each for each in questions(hands, without({"left": [on]})) if each.stated == question.stated]
    assert broken.answer().refuted


def test_nothing_is_known_of_what_rests_on_an_assumption_or_is_refuted(tmp_path: Path) -> None:
    path = _written(tmp_path, f"{HANDS}assume calm assumed : never panel.wish = r\n")
    assert [core_across(each, each.answer()).uses for each in questions(path)] == [None] * 3
    path = _written(
        tmp_path, "requirement some_time : when left.runs, eventually not left.runs or boss.go_left\n"
    )
    assert [(each.answer().proved, core_across(each, each.answer()).uses) for each in questions(path)] == [
        (True, None)
    ]
    path = _written(tmp_path, "requirement at_once : whenever boss.go_left, at once left.runs\n")
    assert [core_across(each, each.answer()).uses for each in questions(path)] == [None]


def test_the_command_tells_it_of_each_level(hands: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["prove", str(hands), "--coverage"]) == 0
    printed = capsys.readouterr().out
    assert "coverage of level right  0 requirements, and 3 across levels" in printed
    assert "requirement `obeys` across levels needs no assignment of it\n" in printed
    assert "requirement `obeys` across levels needs 1 assignment of it" in printed
    assert run(["prove", str(hands), "--coverage", "--json"]) == 0
    levels = {one["level"]: one["coverage"] for one in json.loads(capsys.readouterr().out)["levels"]}
    for level in levels.values():
        needed = [use for one in level["across_levels"] for use in one["assignments"]]
        assert not [use for use in level["no_requirement_speaks_of"] if use in needed]
    [silent] = levels["right"]["no_requirement_speaks_of"]
    assert (silent["line"], silent["text"]) == ("on", "true")
    assert run(["prove", str(hands), "--coverage", "--level", "right"]) == 0
    assert "those across levels were not looked at" in capsys.readouterr().out
