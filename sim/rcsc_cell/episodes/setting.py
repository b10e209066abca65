"""What a loop is made of: the system read once in a process, the script's rows, the operator, and parts where they lie.

In: an episode and the path of a system. Out: what `rcsc_cell.episodes.loop` puts together.
"""

from functools import lru_cache
from pathlib import Path

from rcsc.base.host.files.read import Malformed
from rcsc.run.episodes.stand import Stand, stand
from rcsc.run.orders.script import BadScript
from rcsc.run.signature import Signature
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.ready import Lying
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import BadData
from rcsc_cell.database.pose import about_z
from rcsc_cell.episodes.episode import Episode, PartSpec, script
from rcsc_cell.episodes.operator import Operator, commanded
from rcsc_cell.workstation.prepared import database_of, needs_cell
from rcsc_cell.workstation.script import ScriptRow, script_rows
from rcsc_cell.workstation.station import workstation


def ready(system: Path) -> tuple[Stand, Database]:
    """Return the system with its database, read once while their files do not change.

    Raises:
        BadDescription, BadData: They are not in order.
    """
    its = stand(system)
    data = its.system.database
    return its, _database(system, its.files, data.stat().st_mtime_ns if data.is_file() else 0)


@lru_cache(maxsize=64)
def _database(system: Path, _files: tuple[tuple[str, int], ...], _time_ns: int) -> Database:
    its = stand(system)
    needs_cell(its.system, its.signs)
    return database_of(its.system, its.signs)


@lru_cache(maxsize=1024)
def rows_of(rows: tuple[str, ...]) -> tuple[ScriptRow, ...]:
    """Return rows of a script.

    Raises:
        BadScript: One says nothing that a workstation can do.
    """
    try:
        return script_rows(script(rows), "the episode")
    except Malformed as error:
        raise BadScript(f"the episode: {error}") from error


def operator_of(episode: Episode, database: Database, task: Signature) -> Operator:
    """Return the workstation with the episode's script, and whoever interrupts it.

    Raises:
        BadScript: A row says nothing, or names something unknown.
        ValueError: An interruption is none of TASK's commands, or several.
    """
    changes = sorted(episode.interruptions, key=lambda change: change.tick)
    rows = workstation(
        [row for change in changes for row in rows_of((change.row,))], database.locations, task
    ).rows
    station = workstation(rows_of(episode.rows), database.locations, task)
    for row in rows:
        commanded(station, row)
    return Operator(
        station=station, changes=[(change.tick, row) for change, row in zip(changes, rows, strict=True)]
    )


def lying(database: Database, part: PartSpec) -> Lying:
    """Return a part where the episode has it.

    Raises:
        BadData: No part or no station is called so.
    """
    if part.object not in database.objects or part.station not in database.stations:
        raise BadData((f"no part is called `{part.object}`, or no station `{part.station}`",))
    number = database.objects[part.object]
    length, width, height = part.size_mm or database.sizes[number]
    station = database.stations[part.station]
    at_mm = station.frame.point((part.x_mm, part.y_mm, height / 2))
    turn = about_z(station.yaw_deg + part.yaw_deg)
    return Lying(number, Body((length, width, height), at_mm, turn, part.density_kg_m3, part.friction))
