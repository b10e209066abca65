"""What eventually comes across levels: within a bound that is proved, or never, on a run that goes round."""

import json
from pathlib import Path

import pytest

from rcsc.compose.counterexample.explain import TraceSettings
from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.eventually import COMES_TO_AN_END
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import NEVER_LATE
from rcsc.compose.together.repeated import repeated
from rcsc.front.commands import run
from rcsc.run.description import description
from tests.across.test_across import _answers, _late, _written

_COMES = "requirement comes : when boss.go_left, eventually left.runs\n"
_WISHED = "requirement wished : when boss.wish = l, eventually left.runs\n"


def test_what_comes_of_two_levels_is_proved_within_a_bound(tmp_path: Path) -> None:
    found = _answers(_written(tmp_path, _COMES))["comes"]
    assert (found.proved, found.timing, found.levels) == (True, Timing.SCHEDULED, ("boss", "left"))
    assert found.by == "waits for at most 1 calm tick"
    assert found.trusts({}) == (COMES_TO_AN_END,)
    assert not found.vacuous


def test_a_longer_period_makes_the_bound_longer(tmp_path: Path) -> None:
    assert _answers(_written(tmp_path, _COMES, period=30))["comes"].lasso  # it may be over before it is seen
    heeded = _COMES.replace("left.runs", "(left.runs or not boss.go_left)")
    assert _answers(_written(tmp_path, heeded, period=30))["comes"].by == "waits for at most 3 calm ticks"


def test_what_may_never_come_is_refuted_by_a_loop_that_the_executors_repeat(tmp_path: Path) -> None:
    path = _written(tmp_path, _WISHED)
    found = _answers(path)["wished"]
    assert found.refuted
    assert 0 < found.lasso <= len(found.run)
    loop = found.run[found.lasso - 1 :]
    assert not any(step.anew or step.fault for tick in loop for step in tick.values())
    systems, _ = read_systems(path)
    shown = repeated(found, systems, TraceSettings(description(path), 8))
    assert not shown.beside
    assert shown.in_c


def test_a_wire_that_is_crossed_makes_it_wait_for_ever(tmp_path: Path) -> None:
    assert _answers(_written(tmp_path, _COMES, crossed=True))["comes"].lasso


def test_an_interval_that_ends_while_it_waits_breaks_it(tmp_path: Path) -> None:
    ends = "requirement ends : while boss.go_left, eventually left.runs\n"
    found = _answers(_written(tmp_path, ends))["ends"]
    assert found.refuted
    assert not found.lasso


def test_what_nothing_asks_for_is_vacuous(tmp_path: Path) -> None:
    never = "requirement never : when boss.go_left and boss.go_right, eventually left.runs\n"
    assert _answers(_written(tmp_path, never))["never"].vacuous


def test_an_assumption_may_say_what_comes(tmp_path: Path) -> None:
    wishes = "requirement runs : eventually left.runs\n"
    assert _answers(_written(tmp_path, wishes))["runs"].lasso
    assumed = "assume steady assumed : never (panel.wish = r or panel.wish = nobody)\n"
    assert _answers(_written(tmp_path, assumed + wishes))["runs"].proved


def test_of_late_buffers_nothing_is_said(tmp_path: Path) -> None:
    assert NEVER_LATE in _answers(_late(tmp_path, _COMES, 1))["comes"].trusts({})


def test_prove_names_what_it_trusts_and_tells_the_loop(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = str(_written(tmp_path, _COMES + _WISHED))
    for cache in ("--no-cache", "--no-progress", "--no-progress"):
        capfd.readouterr()
        assert run(["prove", path, *([cache] if cache == "--no-cache" else [])]) == 1
        out, err = capfd.readouterr()
        assert f"waits for at most 1 calm tick, trusting {COMES_TO_AN_END}" in out
        assert "wished                   refuted, as scheduled, by a run of" in out
        assert "again and again" in err
    run(["prove", path, "--no-cache", "--json"])
    every = {one["name"]: one for one in json.loads(capfd.readouterr().out)["requirements"]}
    assert (every["comes"]["lap"], every["wished"]["lap"] > 0) == (0, True)
