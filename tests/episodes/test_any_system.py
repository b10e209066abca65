"""Episodes of any system: what is drawn, what each fault does, what is found of seeded defects, and what a fault explains."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.commands import run as rcsc
from rcsc.episodes.episode import (
    BufferFault,
    Episode,
    FieldValue,
    Harm,
    OrderSpec,
    Reading,
    Restart,
    Switch,
)
from rcsc.episodes.loop import check, run
from rcsc.episodes.outcome import EpisodeOutcome
from rcsc.episodes.sampling import draw, fault_classes, fault_names

DOCK, UNDOCK = OrderSpec("supervisor", "dock"), OrderSpec("supervisor", "undock")


@pytest.fixture(scope="module")
def robot(dock_compiled: Path) -> Path:
    """The description of the docking robot; only to be read."""
    return dock_compiled / "system.toml"


def found(outcome: EpisodeOutcome) -> set[str]:
    return {finding.property for finding in outcome.findings}


def changed(dock: Path, file: str, *edits: tuple[str, str]) -> Path:
    """The docking robot with a defect, compiled whether it proves or not."""
    text = (dock / file).read_text()
    for before, after in edits:
        assert before in text
        text = text.replace(before, after)
    (dock / file).write_text(text)
    if file.endswith(".rcs"):
        assert rcsc(["compile", "-q", str(dock), "--out", str(dock / "generated")]) == 0
    return dock / "system.toml"


class TestAnEpisode:
    def test_comes_back_from_json(self, robot: Path) -> None:
        for seed in range(60):
            episode = draw(seed, robot)
            assert Episode.from_json(episode.to_json()) == episode

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("[]", "no table of names"),
            ("{", "not JSON"),
            ('{"order": []}', "has no `order`"),
            ('{"executor": "rust"}', "`rust` is none of"),
            ('{"harms": [{"buffer": "x", "kind": "gone", "first_tick": 0, "last_tick": 1, "ticks": 1}]}', "gone"),
            ('{"ticks": -1}', "`ticks` is -1"),
            ('{"seed": -1}', "the seed"),
        ],
    )  # fmt: skip
    def test_that_is_none_is_refused(self, text: str, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            Episode.from_json(text)

    @pytest.mark.parametrize(
        ("episode", "why"),
        [
            (Episode(orders=(OrderSpec("boss", "dock"),)), "no level `boss` is ordered"),
            (Episode(orders=(OrderSpec("supervisor", "dance"),)), "`dance` is no value of"),
            (Episode(orders=(OrderSpec("supervisor", "dock", (FieldValue("at", 3),)),)), "no field `at`"),
            (Episode(harms=(BufferFault("x.y", "lost", 0, 1),)), "no buffer `x.y`"),
            (Episode(readings=(Reading("base.speed", 1, 0, 1),)), "`base.speed` is no field"),
            (Episode(readings=(Reading("base.bumper", 3, 0, 1),)), "`3` is no value"),
            (Episode(restarts=(Restart(0, "arm"),)), "no level `arm`"),
            (Episode(switches=(Switch("wheels_stuck", 0, 1),)), "no fault `wheels_stuck`"),
        ],
    )
    def test_of_another_system_is_refused(self, robot: Path, episode: Episode, why: str) -> None:
        with pytest.raises(ValueError, match=why):
            check(episode, robot)

    def test_runs_as_a_script_where_nothing_goes_wrong(self, robot: Path, tmp_path: Path) -> None:
        orders = (DOCK, replace(UNDOCK, wait=7), replace(DOCK, wait=12, interrupts=True))
        script = tmp_path / "orders.csv"
        script.write_text(Episode(orders=orders).script())
        assert script.read_text().splitlines() == ["command,cycles", "dock,", ",7", "undock,12", "dock,"]
        options = ["--no-compile", "--log", str(tmp_path / "log.mcap")]
        assert rcsc(["run", str(robot), "--script", str(script), *options]) == 0

    def test_is_the_same_for_the_same_seed(self, robot: Path) -> None:
        drawn = [draw(seed, robot) for seed in range(200)]
        assert drawn == [draw(seed, robot) for seed in range(200)]
        assert len(set(drawn)) == 200

    def test_has_every_class_of_faults_some_time(self, robot: Path) -> None:
        classes = {name for seed in range(300) for name in fault_classes(draw(seed, robot), robot)}
        assert classes == set(fault_names(robot)) - {
            "refused"
        }  # no field of the robot's is refused: bools, and clamped
        nominal = sum(not fault_classes(draw(seed, robot), robot) for seed in range(300))
        assert 20 < nominal < 120


class TestTheDockingRobot:
    def test_keeps_everything_whatever_is_drawn(self, robot: Path) -> None:
        for seed in range(60):
            outcome = run(draw(seed, robot), robot)
            assert not outcome.findings, (seed, outcome.findings)

    def test_does_the_same_in_c_and_in_python(self, robot: Path) -> None:
        for seed in range(30):
            in_c, in_python = (
                run(replace(draw(seed, robot), executor=kind), robot) for kind in ("c", "python")
            )
            assert in_c == in_python

    def test_answers_each_order_in_time(self, robot: Path) -> None:
        outcome = run(Episode(orders=(DOCK, UNDOCK, DOCK)), robot)
        assert [row.state for row in outcome.rows] == ["done"] * 3
        assert outcome.end == "done"
        assert ("drive", "goto", "there") in outcome.lines

    def test_takes_an_order_before_the_end_of_the_one_before(self, robot: Path) -> None:
        outcome = run(Episode(orders=(UNDOCK, replace(DOCK, wait=5, interrupts=True))), robot)
        assert [row.state for row in outcome.rows] == ["changed", "done"]
        assert outcome.rows[0].ticks == 5


Measure = Callable[[EpisodeOutcome], object]


class TestEveryFault:
    """Each kind does what it says: an episode with it differs from the one without in what is named here."""

    @pytest.mark.parametrize(("kind", "later"), [("lost", 20), ("late", 8), ("doubled", 1), ("stale", 0)])
    def test_of_a_buffer(self, robot: Path, kind: Harm, later: int) -> None:
        plain = run(Episode(orders=(DOCK,)), robot)
        harm = BufferFault("fleet.order", kind, 0, 19, ticks=8)
        outcome = run(Episode(orders=(DOCK,), harms=(harm,)), robot)
        assert outcome.rows[0].ticks - plain.rows[0].ticks == later
        assert (
            outcome.digest != plain.digest or kind == "stale"
        )  # before the first order there is nothing older
