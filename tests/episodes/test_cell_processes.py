"""The whole system, each level in a process of its own: a script ends, though levels are killed while it runs and the others wait."""

import json
import signal
from pathlib import Path

from rcsc.run.description import description
from rcsc.run.plant.staging import StageOrder
from rcsc.run.processes.serve import Factory
from rcsc.run.processes.supervisor import Supervisor, run_processes
from tests.support.cells import SYSTEM

RATE = 4.0
"""Times as fast as the clock: a cycle in ten milliseconds."""
ROWS = 9
KILLED = ("task", "primitive", "emove", "gripper", "vision")


def test_a_script_ends_though_every_level_is_killed_once(tmp_path: Path) -> None:
    results = tmp_path / "results"
    results.touch()
    script = tmp_path / "begun.csv"
    rows = (SYSTEM.parent / "scripts" / "make_boxt.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    script.write_text("".join(rows[: 1 + ROWS]), encoding="utf-8")
    order = StageOrder(str(SYSTEM), "kinematic", str(script))
    outside = Factory("rcsc.run.plant.staging:outside", (order, str(results)))
    queries = Factory("rcsc.run.plant.staging:queries", (order,))
    killed: list[str] = []

    def watch(system: Supervisor) -> None:
        """Kills the next level whenever a row more is done."""
        done = len(results.read_text(encoding="utf-8").splitlines())
        if len(killed) < len(KILLED) and done >= 2 + len(killed) and system.runs(KILLED[len(killed)]):
            system.stop(KILLED[len(killed)], signal.SIGKILL)
            system.start(KILLED[len(killed)])
            killed.append(KILLED[len(killed)])

    run_processes(
        description(SYSTEM), "python", {"outside": outside}, queries=queries, rate=RATE, watch=watch
    )
    rows = [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]
    assert killed == list(KILLED)
    assert [row[2] for row in rows] == ["done"] * ROWS, rows[-1]
