"""Drawn systems: what is proved of them no run breaks, what is refuted one does, and the shortest is shown."""

from pathlib import Path

import pytest

from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import Question
from tests.across.systems import Running, drawn, written

FEW, MOST, WALKS, TICKS = 4, 60, 3, 150


def judged(seed: int, folder: Path, late: int = 0) -> list[str]:
    """Judge the requirements of a drawn system, whose buffers may be so late; return the verdicts."""
    path = written(drawn(seed, late), folder)
    systems, _ = read_systems(path)
    whole = prove_transition_systems(systems, None, 1, tuple(systems))
    proofs = {proof.level: proof for proof in whole.levels}
    running, verdicts = Running(path), []
    for stated in running.program.properties:
        for known in ({}, proofs):  # without what is known of each level, and with it
            found = Question(systems, running.described, running.program, stated, known).answer()
            if found.proved:
                around, lates = found.around, late > 0 and found.timing is not Timing.SCHEDULED
                here = {"refuses": around.refuses, "restarts": around.restarts, "late": lates}
                shortest = running.shortest(stated, 12, **here)
                assert not shortest, (seed, stated.text, found.timing, around, shortest)
                for walk in range(WALKS):
                    broken = running.walk(stated, walk, TICKS, **here)
                    assert not broken, (seed, stated.text, found.timing, around, walk, broken)
                verdicts.append(f"proved {found.timing.value}")
            if found.run:
                assert found.broken_in is not None
                around = found.broken_in
                shortest = running.shortest(
                    stated, len(found.run), refuses=around.refuses, restarts=around.restarts, late=late > 0
                )
                assert shortest in (len(found.run), None), (seed, stated.text, len(found.run), shortest)
                verdicts.append("refuted")
            if not found.proved and not found.run:
                verdicts.append("open")
    return verdicts


@pytest.mark.parametrize("seed", range(FEW))
def test_drawn_systems_are_judged_as_they_run(seed: int, tmp_path: Path) -> None:
    assert judged(seed, tmp_path)


@pytest.mark.parametrize("seed", [50, 54])
def test_drawn_systems_with_late_buffers_are_judged_as_they_run(seed: int, tmp_path: Path) -> None:
    assert judged(seed, tmp_path, late=1)


@pytest.mark.thorough
def test_many_drawn_systems_are_judged_as_they_run(tmp_path: Path) -> None:
    verdicts = []
    for seed in range(1000, 1000 + MOST):
        folder = tmp_path / str(seed)
        folder.mkdir()
        verdicts += judged(seed, folder, late=seed % 3)
    assert {"proved any", "proved late", "proved scheduled", "refuted"} <= set(verdicts)
    assert verdicts.count("open") * 10 < len(verdicts)
