"""What a whole cycle costs: `python -m tests.bench.system`.

MAKE BOXT on the kinematic plant, all 27 rows: microseconds a control tick and a level's cycle, by executor, with and without a log, and
bytes of log a tick; the plant's own time is left out (`tests.bench.loop` has it). Then each level by itself, from the smallest to the
largest: the cost grows with the leaves of its state.
"""

import statistics
import tempfile
import time
from pathlib import Path

from rcsc.run.log.recorder import Recorder
from rcsc.run.system import Kind
from rcsc_cell.cell.ready import plant
from rcsc_cell.database.ask import Database
from rcsc_cell.episodes.witness import Timed
from rcsc_cell.workstation.prepared import ScriptDraft, prepare

SYSTEM = Path(__file__).parents[2] / "tables" / "system.toml"
ROUNDS = 5


def kinematic(database: Database) -> list[Timed]:
    """What stands outside, and how long it takes."""
    return [Timed(plant(database, "kinematic"))]


def finished(kind: Kind, log: Path | None) -> tuple[float, ScriptDraft]:
    """Seconds of the steps without the plant's, and the run."""
    run = prepare(SYSTEM, "make_boxt", kind, kinematic)
    if log is None:
        return stepped(run), run
    with Recorder(run.system, log) as recorder:
        run.system.watch.append(recorder)
        return stepped(run), run


def stepped(run: ScriptDraft) -> float:
    """Runs to the end; seconds, but for the plant's."""
    begun = time.perf_counter()
    assert [result.state for result in run.steps()] == ["done"] * 27
    plants = [timed.seconds for timed in run.system.outside if isinstance(timed, Timed)]
    return time.perf_counter() - begun - sum(plants)


def levels_alone(kind: Kind) -> dict[str, float]:
    """Microseconds a cycle of each level with its buffers, nothing outside."""
    run = prepare(SYSTEM, "make_boxt", kind, kinematic)
    costs = {}
    for level in run.system.levels:
        times = []
        for _ in range(2000):
            begun = time.perf_counter_ns()
            level.take(run.system.buffers)
            level.run()
            level.give(run.system.buffers)
            times.append(time.perf_counter_ns() - begun)
        costs[level.name] = statistics.median(times) / 1000
    return costs


def main() -> None:
    """Prints the tables."""
    print(f"{'executor':10}{'log':6}{'ms a run':>10}{'us a tick':>11}{'us a level':>12}{'bytes a tick':>14}")
    with tempfile.TemporaryDirectory() as scratch:
        for kind in ("c", "python"):
            for log in (None, Path(scratch) / "run.mcap"):
                best = min(
                    (finished("c" if kind == "c" else "python", log) for _ in range(ROUNDS)),
                    key=lambda one: one[0],
                )
                seconds, run = best
                ticks, levels = run.system.tick, len(run.system.levels)
                size = f"{log.stat().st_size / ticks:.0f}" if log else "-"
                row = f"{seconds * 1e3:10.1f}{seconds * 1e6 / ticks:11.1f}{seconds * 1e6 / ticks / levels:12.2f}{size:>14}"
                print(f"{kind:10}{'yes' if log else 'no':6}{row}", flush=True)
    print(
        f"\n{'level':12}{'leaves':>8}{'lines':>7}{'C us':>8}{'Python us':>11}   one cycle at rest, buffers included"
    )
    in_c, in_python = levels_alone("c"), levels_alone("python")
    run = prepare(SYSTEM, "make_boxt", "python", kinematic)
    for level in run.system.levels:
        lines = sum(len(names) for names in level.sign.tables.values())
        costs = f"{in_c[level.name]:8.1f}{in_python[level.name]:11.1f}"
        print(f"{level.name:12}{len(level.sign.leaves):8}{lines:7}{costs}")


if __name__ == "__main__":
    main()
