"""Run the workstation and the plant in a process of their own, when the levels run as processes.

Made by `rcsc.run.processes.serve.Factory`, from arguments that travel: names of files. The workstation's results go to a file, a line a
row, where the process that started all reads them. Buffers without a level at either end stay in this process.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.run.description import description
from rcsc.run.levels import Query
from rcsc.run.signature import Values
from rcsc.run.system import Outside, signatures
from rcsc_cell.workstation.prepared import database_of, script_path
from rcsc_cell.workstation.script import read_script
from rcsc_cell.workstation.station import Workstation, workstation

if TYPE_CHECKING:  # a level's process asks for `queries` alone, and needs no simulator
    from rcsc_cell.cell.ready import Backend


@dataclass(slots=True)
class Told:
    """A workstation that writes down each result."""

    station: Workstation
    results: Path
    _written: int = 0

    @property
    def over(self) -> bool:
        """Whether the script has come to its end, or was stopped and TASK has paused."""
        return self.station.over and self.station.at_rest

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """One tick of the workstation."""
        given = self.station.step(tick, latest)
        for result in self.station.results[self._written :]:
            row = [result.row.number, result.row.text, result.state, result.reason, result.ticks]
            with self.results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            self._written += 1
        return given


@dataclass(slots=True)
class Joined:
    """Several things outside as one; buffers between them are seen by nobody else.

    Attributes:
        shared: Buffers that levels have, too.
    """

    told: Told
    others: tuple[Outside, ...]
    shared: frozenset[str]
    _held: dict[str, Values] = field(default_factory=dict)

    @property
    def over(self) -> bool:
        """Whether the script is."""
        return self.told.over

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """One tick of all: each sees what the tick before left."""

        def seen(name: str) -> Values | None:
            return latest(name) if name in self.shared else self._held.get(name)

        given = [part.step(tick, seen) for part in (self.told, *self.others)]
        outputs = {name: values for published in given for name, values in published.items()}
        self._held |= {name: values for name, values in outputs.items() if name not in self.shared}
        return {name: values for name, values in outputs.items() if name in self.shared}


def outside(
    system: str, script: str, database: str, results: str, first: int = 0, backend: "Backend" = "mujoco"
) -> list[Outside]:
    """Workstation and plant.

    Args:
        system: The description's path.
        script: Its name.
        database: Path of one to be used as it is; empty for the system's own.
        results: Path of the file where results go.
        first: The row to begin at, from 0, as if those before were done.
        backend: Physics, or kinematics alone.
    """
    from rcsc_cell.cell.ready import plant

    path = Path(system)
    described = description(path)
    signs = signatures(described)
    held = database_of(described, signs, Path(database) if database else None)
    station = workstation(read_script(script_path(script, path)), held.locations, signs["task"])
    station.begin_at(first)
    shared = frozenset(wire.source for wire in described.wires)
    return [Joined(Told(station, Path(results)), (plant(held, backend),), shared)]


def queries(system: str, database: str) -> dict[str, Query]:
    """The database's answers."""
    described = description(Path(system))
    return dict(database_of(described, signatures(described), Path(database) if database else None).queries)
