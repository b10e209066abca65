"""What stands outside the levels when they run as processes: the workstation and the stand-ins, in a process of their own.

Made by `rcsc.system.serve.Factory`, from arguments that travel: names of files. The workstation's results go to a file, a line a
row, where the process that started all reads them.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rcsc.system.cell import Outside, signatures
from rcsc.system.description import description
from rcsc.system.levels import Query
from rcsc.system.signature import Values
from rcsc.workstation.cell import database_of, script_path
from rcsc.workstation.script import read_script
from rcsc.workstation.station import Workstation, workstation
from sim.standin import world


@dataclass(slots=True)
class Told:
    """A workstation that writes down each result."""

    station: Workstation
    results: Path
    _written: int = 0

    @property
    def over(self) -> bool:
        """Whether the script has come to its end, or was stopped."""
        return self.station.over

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """One tick of the workstation."""
        given = self.station.step(tick, latest)
        for result in self.station.results[self._written :]:
            row = [result.row.number, result.row.text, result.state, result.reason, result.ticks]
            with self.results.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            self._written += 1
        return given


def outside(system: str, script: str, database: str, results: str) -> list[Outside]:
    """Workstation and stand-ins."""
    path = Path(system)
    said = description(path)
    signs = signatures(said)
    held = database_of(said, signs, Path(database) if database else None)
    station = workstation(read_script(script_path(script, path)), held.locations, signs["task"])
    return [Told(station, Path(results)), world(held)]


def queries(system: str, database: str) -> dict[str, Query]:
    """The database's answers."""
    said = description(Path(system))
    return dict(database_of(said, signatures(said), Path(database) if database else None).queries)
