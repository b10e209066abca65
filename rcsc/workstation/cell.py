"""A cell ready to run: system, database, workstation and what else stands outside the levels.

In: the description's path, a script. Out: a `Run` that is stepped to its end.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from rcsc.database.ask import Database, fresh, open_database
from rcsc.database.build import build, digest
from rcsc.system.cell import Kind, Outside, System, assemble, signatures
from rcsc.system.description import Description, description
from rcsc.system.signature import Signature
from rcsc.workstation.script import BadScript, Row, read_script
from rcsc.workstation.station import Result, Workstation, workstation

MOST_TICKS = 100_000
"""Ticks after which a run is given up: more than an hour of control time."""


@dataclass(slots=True)
class Run:
    """A script in the making.

    Attributes:
        station: The first of what stands outside.
    """

    system: System
    station: Workstation
    database: Database

    def steps(self, most: int = MOST_TICKS) -> Iterator[Result]:
        """Runs to the end of the script, or to what stops it and until TASK has paused; each result as it comes.

        Raises:
            StateTableError: A level met a fault that the proofs exclude.
        """
        known = len(self.station.results)
        while not (self.station.over and self.station.at_rest) and self.system.tick < most:
            self.system.step()
            while known < len(self.station.results):
                yield self.station.results[known]
                known += 1


def parts_of(signs: Mapping[str, Signature]) -> tuple[str, ...]:
    """Names of parts as the tables have them."""
    return next(leaf.members for leaf in signs["task"].leaves if leaf.name == "command.obj")


def database_path(system: Description) -> Path:
    """Where the database of the system is kept when nobody says."""
    return system.database.parent / ".rcsc-cache" / f"{system.name}.sqlite"


def database_of(system: Description, signs: Mapping[str, Signature], path: Path | None = None) -> Database:
    """The database, made anew where the data has changed; as it is where `path` says which.

    Raises:
        BadData: The data or the file is not in order.
    """
    if path is not None:
        return open_database(path)
    kept, parts = database_path(system), parts_of(signs)
    if not system.database.is_file() or not fresh(kept, digest(system.database, parts)):
        build(system.database, kept, parts)
    return open_database(kept)


def script_path(name: str, system: Path) -> Path:
    """The script that a name means: a file, or one of those that stand with the system."""
    path = Path(name)
    return path if path.suffix == ".csv" or path.is_file() else system.parent / "scripts" / f"{name}.csv"


def safe_places(database: Database) -> dict[str, str]:
    """The safe location of each location that has one, by name."""
    names = {number: name for name, number in database.locations.items()}
    safe = {name: int(database.place(number)[4]) for name, number in database.locations.items()}
    return {name: names[number] for name, number in safe.items() if number}


def prepare(
    path: Path,
    rows: tuple[Row, ...] | str,
    kind: Kind,
    outside: Callable[[Database], Iterable[Outside]],
    database: Path | None = None,
) -> Run:
    """A cell ready for its first tick.

    Args:
        path: The system's description.
        rows: The script, or its name.
        kind: Which executors run.
        outside: Makes what stands outside, from the database: robot, hand, camera, vise and machine.
        database: A database to be used as it is.

    Raises:
        BadDescription, BadData, BadScript, NotBuilt: Something is not in order; nothing has moved.
    """
    system = description(path)
    signs = signatures(system)
    if "task" not in signs:
        raise BadScript("the system has no level `task` to send commands to")
    held = database_of(system, signs, database)
    script = read_script(script_path(rows, path)) if isinstance(rows, str) else rows
    station = workstation(script, held.locations, signs["task"], safe_places(held))
    return Run(assemble(system, kind, held.queries, [station, *outside(held)]), station, held)
