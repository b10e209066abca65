"""How fast the whole cell runs, and where the time goes: `python -m tests.bench.loop`.

MAKE BOXT from the first row to the last on each plant, by each executor, with a log and with whoever watches a run
(`rcsc_cell.episodes.witness`), as `rcsc run` has them. Times real time is control time by the time that the cycles took, from the first
to the last; what is made before, as the model of the cell, does not count. A log and a witness are timed where they are called; the
executors and the buffers are the rest.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rcsc.run.levels import RunningLevel
from rcsc.run.log.recorder import Recorder
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.system import Kind, System
from rcsc_cell.cell.ready import Backend, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.episodes.witness import Timed, Witness, timed
from tests.support.cells import prepare

SYSTEM = Path(__file__).parents[2] / "tables" / "system.toml"
ROUNDS = 3
PLANTS: tuple[Backend, ...] = ("mujoco", "kinematic")
EXECUTORS: tuple[Kind, ...] = ("c", "python")

Watch = Callable[[System, tuple[RunningLevel, ...]], None]


@dataclass(slots=True)
class Stopwatch:
    """Something that watches a system, and how long it took."""

    inner: Watch
    seconds: float = 0.0

    def __call__(self, system: System, due: tuple[RunningLevel, ...]) -> None:
        begun = time.perf_counter()
        self.inner(system, due)
        self.seconds += time.perf_counter() - begun


@dataclass(frozen=True, slots=True)
class Spent:
    """Where the time of a run went, in seconds; `levels` is executors, buffers and workstation."""

    cycles: int
    control: float
    whole: float
    plant: float
    log: float
    watching: float

    @property
    def levels(self) -> float:
        """What is left of the whole."""
        return self.whole - self.plant - self.log - self.watching


def spent(backend: Backend, kind: Kind, log: Path) -> Spent:
    """One run to its end.

    Raises:
        AssertionError: A row was not done: what was measured is not MAKE BOXT.
    """
    worlds: list[Timed] = []

    def outside(database: Database) -> list[Timed]:
        worlds.append(timed(plant(database, backend)))
        return worlds

    run = prepare(SYSTEM, "make_boxt", kind, outside)
    with Recorder(run.system, log) as recorder:
        watches = [
            Stopwatch(recorder),
            Stopwatch(Witness(ScriptedRun(run.system, run.station), plant=worlds[0], database=run.database)),
        ]
        run.system.watch.extend(watches)
        begun = time.perf_counter()
        assert [result.state for result in run.steps()] == ["done"] * 27
        whole = time.perf_counter() - begun
    ticks = run.system.tick
    control_s = ticks * run.system.description.tick_ms / 1000
    return Spent(ticks, control_s, whole, worlds[0].seconds, *(watch.seconds for watch in watches))


def best(backend: Backend, kind: Kind, log: Path) -> Spent:
    """The quickest of some: the others waited for somebody else."""
    return min((spent(backend, kind, log) for _ in range(ROUNDS)), key=lambda one: one.whole)


def main() -> None:
    """Prints the table: microseconds are of a cycle of 40 ms."""
    parts = ("whole", "plant", "levels", "log", "watching")
    print(
        f"{'plant':11}{'executor':10}{'x real time':>12}{'s a run':>9}  us a cycle:"
        + "".join(f"{name:>10}" for name in parts)
    )
    with tempfile.TemporaryDirectory() as scratch:
        for backend in PLANTS:
            for kind in EXECUTORS:
                one = best(backend, kind, Path(scratch) / "run.mcap")
                costs = "".join(f"{1e6 * getattr(one, name) / one.cycles:10.0f}" for name in parts)
                print(
                    f"{backend:11}{kind:10}{one.control / one.whole:12.0f}{one.whole:9.2f}             {costs}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
