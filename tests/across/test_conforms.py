"""The product of levels does what they do under `rcsc.run`, leaf by leaf: with restarts, refusals, late buffers, whatever comes.

The system has the protocol with its numbers and echoes, one switch with three readers, and one file as two levels.
"""

import shutil
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.compose.contract.given import refused
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.rerun import make
from rcsc.compose.proof.system import read_systems
from rcsc.compose.together.product import LATE, Tick, Timing, Together, together
from rcsc.compose.together.words import stated_across
from rcsc.lang.model import Value, VariableName, key_bounds, key_of, value_of_key
from rcsc.proof.symbolic.trial import value_at
from rcsc.proof.symbolic.values import Node
from rcsc.run.description import Description, description
from rcsc.run.levels import RunningLevel, StateTableError, running_level
from rcsc.run.system import System, executors, signatures
from tests.across.judge.systems import LateMemory

_DATA = Path(__file__).parents[1] / "data" / "two_axes"


def _begun(
    tmp_path: Path,
    late: int,
) -> tuple[dict[str, TransitionSystem], Description, Together, System]:
    """Return the levels, their system, the product, and the system as it runs."""
    shutil.copytree(_DATA, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "system.toml"
    path.write_text(path.read_text().replace("script =", 'requirements = "all.rcs"\nscript ='))
    (tmp_path / "all.rcs").write_text("requirement p : always left.speed_mm_s = 0 or base.estop\n")
    systems, _ = read_systems(path)
    programs = {name: ts.program for name, ts in systems.items()}
    system = replace(description(path), late_ticks=late)
    stated = stated_across(system, programs)
    assert stated is not None
    refusing = {name: ts.refusing() for name, ts in systems.items()}
    product = together(
        refusing, tuple(systems), system, stated[0], Timing.LATE if late else Timing.SCHEDULED, "p"
    )
    make(programs.values(), system.generated, altered=False)
    signs = signatures(system)
    by_level = executors(system, signs, "python")
    levels = tuple(
        running_level(spec, system, signs[spec.name], by_level[spec.name], {}) for spec in system.levels
    )
    running = System(system, levels, (), LateMemory(late))
    return systems, system, product, running


@pytest.mark.parametrize(("seed", "most_late"), [(0, 0), (1, 0), (2, 2)])
def test_each_tick_leaves_what_the_executors_leave(  # noqa: PLR0915  # one tick, step by step
    seed: int, most_late: int, tmp_path: Path
) -> None:
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    systems, system, product, running = _begun(tmp_path, most_late)
    levels, programs = running.levels, {name: ts.program for name, ts in systems.items()}
    first, step = product.firsts()["first"], product.cycle(product.havoc())

    def leaves() -> dict[str, Value]:
        return {
            f"{level.name}.{leaf.name}": level.values[at]
            for level in levels
            for at, leaf in enumerate(level.sign.leaves)
        }

    given = {name: value_of_key(kind, max(0, key_bounds(kind)[0])) for name, kind in product.given.items()}
    restarts = refusals = 0
    ghosts = _late({name: node for name, node in product.initial().items() if name.startswith(LATE)}, {})
    memory, by = running.buffers, dict.fromkeys((wire.source for wire in system.wires), 0)
    assert isinstance(memory, LateMemory)
    for number in range(60):
        tick = step if number else first
        assert isinstance(tick, Tick)
        before = leaves()
        for name, kind in product.given.items():
            if random.random() < 0.4:
                low, high = key_bounds(kind)
                given[name] = value_of_key(kind, random.choice((low, high, random.randint(low, high))))
        point = before | ghosts
        suffix = " taken" if number else " at first"
        point |= {f"{name}{suffix}": value for name, value in given.items()}
        wrong = "person.order.far_mm" if not most_late and random.random() < 0.1 else ""
        point |= {
            f"an input is refused: of {name}{suffix}": bool(wrong) and name == "lead" for name in systems
        }
        begun = [name for name in systems if random.random() < 0.1]
        point |= {f"{name} begins anew{suffix}": name in begun for name in systems}
        by = {name: random.randint(0, min(most_late, ticks + 1)) for name, ticks in by.items()}
        point |= {f"{wire.target} is late{suffix}": by[wire.source] for wire in system.wires}
        published = dict(given)
        if wrong:
            published[wrong] = refused(programs["lead"].variable("person.far_mm"))
        for wire in {wire.source: wire for wire in system.wires}.values():
            parts = [name for name in given if name == wire.source or name.startswith(f"{wire.source}.")]
            if parts:
                memory.publish(wire.source, tuple(published[name] for name in parts))
        outside = {wire.source for wire in system.wires if wire.source.partition(".")[0] not in systems}
        memory.holds(outside)
        memory.by = by
        for name in begun:
            running.restart(name, written=memory.written())
        with suppress(StateTableError):
            running.step()
        running.tick = number + 1
        memory.holds(by.keys() - outside)
        ghosts = _late({name: tick.after[name] for name in ghosts}, point)
        restarts, refusals = restarts + len(begun), refusals + bool(wrong)
        after = leaves()
        for level in levels:
            for leaf in level.sign.leaves:
                name = f"{level.name}.{leaf.name}"
                if wrong and level.name == "lead" and leaf.kind == "input":
                    continue  # they stand as they came, and count as not taken
                kind = programs[level.name].variable(VariableName(leaf.name)).type
                expected = value_at(tick.after[name], point)
                assert expected is not None
                assert key_of(kind, expected) == key_of(kind, after[name]), (number, name, begun, wrong)
        if wrong:
            _put_back(running.level("lead"), before, anew="lead" in begun)
    assert restarts > 5
    assert refusals > 2 or most_late  # what is refused would stay in a late buffer


def _late(nodes: Mapping[str, Node], point: Mapping[str, Value]) -> dict[str, Value]:
    """Return what the product remembers of late buffers."""
    every = {name: value_at(node, point) for name, node in nodes.items()}
    return {name: value for name, value in every.items() if value is not None}


def _put_back(level: RunningLevel, before: dict[str, Value], *, anew: bool) -> None:
    """Give a level that was refused an input those again that it took last."""
    values = [
        before[f"{level.name}.{leaf.name}"] if leaf.kind == "input" and not anew else level.values[at]
        for at, leaf in enumerate(level.sign.leaves)
    ]
    level.put_back((*values, *level.values[len(values) :]))
