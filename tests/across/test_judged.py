"""Drawn systems: what is proved of them no run breaks, what is refuted one does, and the shortest is shown; and slips, which are told."""

from collections import Counter
from contextlib import suppress
from pathlib import Path
from random import Random
from unittest.mock import patch

import pytest

from rcsc.compose.counterexample.rerun import make
from rcsc.compose.together.product import Together
from rcsc.lang.model import Scalar, Value, key_bounds
from rcsc.proof.symbolic import values
from rcsc.run.levels import StateTableError, running_level
from rcsc.run.system import System as Running
from rcsc.run.system import executors, signatures
from tests.across.__main__ import main, shares
from tests.across.judge import slips
from tests.across.judge.drawn import drawn, written
from tests.across.judge.held import System, judged
from tests.across.judge.systems import LateMemory
from tests.across.judge.truth import Befalls, Runs, followed

QUICK = (4, 5, 14, 53, 98, 114, 250, 724, 900, 916)
"""Systems that are quickly answered: with what comes, orders, longer periods, refusals, late buffers."""
MOST, TICKS = 400, 20


@pytest.mark.parametrize("seed", QUICK)
def test_drawn_systems_are_judged_as_they_run(seed: int, tmp_path: Path) -> None:
    assert judged(seed, tmp_path, proofs=250)  # of one the levels, too


@pytest.mark.thorough
def test_many_drawn_systems_are_judged_as_they_run(tmp_path: Path) -> None:
    verdicts = Counter[str]()
    for seed in range(1000, 1000 + MOST):
        (tmp_path / str(seed)).mkdir()
        verdicts.update(judged(seed, tmp_path / str(seed), proofs=8))
    assert {"proved any", "proved late", "proved scheduled", "refuted", "waits for ever", "vacuous"} <= {
        *verdicts
    }
    assert verdicts["open"] * 20 < verdicts.total()
    assert not verdicts["open, and a run breaks it"]


def test_every_part_is_drawn() -> None:
    parts = Counter(part for seed in range(200) for part in drawn(seed).parts)
    assert set(parts) == {
        "a level twice", "a longer period", "assumed", "clamped", "late buffers", "one output outside to several readers",
        "one output to several readers", "orders", "refused", "restart", "safe",
    }  # fmt: skip
    assert min(parts.values()) > 5


# --- the judge itself --------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [4, 14, 17, 21])
def test_the_runs_of_the_judge_are_those_of_the_executors(seed: int, tmp_path: Path) -> None:
    """With restarts in any tick, refused inputs, and late buffers."""
    it, random = System.of(written(drawn(seed), tmp_path)), Random(seed)  # noqa: S311  # repeatable on purpose
    late = it.description.late_ticks
    runs = Runs(
        it.systems,
        it.description,
        it.program,
        it.program.properties[0],
        Befalls(late=late),
        it.cycles,
        [*it.systems],
    )
    running = _running(it)
    memory = running.buffers
    assert isinstance(memory, LateMemory)
    sources = {wire.source for wire in it.description.wires}
    outside = {source for source in sources if source.partition(".")[0] not in it.systems}
    ages, left = dict.fromkeys(sources, 0), list[dict[str, dict[str, Value]]]()
    for tick in range(TICKS):
        for source in sorted(outside):
            memory.publish(source, tuple(_any(random, kind) for kind in _kinds(it, source)))
        memory.holds(outside)
        memory.by = ages = {one: random.randint(0, min(late, ages[one] + 1)) for one in sorted(sources)}
        for name in it.systems:
            if random.random() < 0.15:
                running.restart(name, written=memory.written())
        due = [tick % member.period == 0 for member in runs.members]
        with suppress(StateTableError):
            running.step()
        running.tick = tick + 1
        memory.holds(sources - outside)
        left.append(
            {
                level.name: dict(zip((leaf.name for leaf in level.sign.leaves), level.values, strict=False))
                for level, ran in zip(running.levels, due, strict=True)
                if ran
            }
        )
    assert followed(runs, left)
    left[-1] = {name: dict.fromkeys(of, -1) for name, of in left[0].items()}
    assert not followed(runs, left)


def _running(it: System) -> Running:
    make((ts.program for ts in it.systems.values()), it.description.generated, altered=False)
    signs = signatures(it.description)
    by_level = executors(it.description, signs, "python")
    levels = tuple(
        running_level(spec, it.description, signs[spec.name], by_level[spec.name], {})
        for spec in it.description.levels
    )
    return Running(it.description, levels, (), LateMemory(it.description.late_ticks))


def _kinds(it: System, source: str) -> list[Scalar]:
    wire = next(wire for wire in it.description.wires if wire.source == source)
    reader, _, variable = wire.target.partition(".")
    return [it.systems[reader].kinds[variable]]


def _any(random: Random, kind: Scalar) -> Value:
    low, high = key_bounds(kind)
    if high == 1:
        return random.random() < 0.5
    value: Value = random.randint(low, high + 1)  # the last is refused
    return value


def never(*_: object) -> values.Node:
    return values.FALSE


@pytest.mark.parametrize(("place", "seed"), [("_due", 1), ("_never_back", 21)])
def test_faults_are_noticed(place: str, seed: int) -> None:
    with patch.object(Together, place, never):
        assert main(["--count", "1", "--seed", str(seed), "--kind", "required"]) == 1


# --- slips -------------------------------------------------------------------------------------


def test_a_slip_is_told_or_changes_nothing(tmp_path: Path) -> None:
    few = list(slips.slips(drawn(12)))[:2]
    with patch.object(slips, "slips", lambda _: few):
        became = {one.partition(": ")[2] for one in slips.judged(12, tmp_path)}
    assert slips.TOLD in became
    assert became <= {slips.TOLD, slips.EQUIVALENT}


def test_each_kind_of_slip_is_made() -> None:
    assert {what for seed in range(30) for what, _ in slips.slips(drawn(seed))} == {
        "wire cut", "output to nobody", "two wires swapped", "two levels swapped", "period doubled", "a requirement's levels exchanged",
    }  # fmt: skip


def test_a_slip_that_is_missed_counts_against_those_that_are_told() -> None:
    found = Counter(
        {"slips: wire cut: told": 2, "slips: wire cut: equivalent": 1, "slips: wire cut: missed": 1}
    )
    assert shares(found) == 0.75
    assert shares(Counter({"slips: wire cut: too many runs": 3})) == 0
