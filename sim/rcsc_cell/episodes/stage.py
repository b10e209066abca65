"""The cell as the plant of its system: what `[plant.mujoco]` and `[plant.kinematic]` of `tables/system.toml` name.

In: a system and, for a run, a script. Out: workstation, robot, hand, camera, vise and machine, the database's answers, who
watches the run, and what keeps one that was stopped.
"""

from typing import TYPE_CHECKING

from rcsc.base.host.cache import open_cache
from rcsc.run.orders.script import script_path
from rcsc.run.orders.stopped import StoppedRuns
from rcsc.run.plant.staged import Setup, Staged
from rcsc_cell.workstation.orders import KINDS
from rcsc_cell.workstation.prepared import database_of, needs_cell, safe_places
from rcsc_cell.workstation.script import read_script
from rcsc_cell.workstation.station import workstation

if TYPE_CHECKING:
    from rcsc_cell.cell.ready import Backend


def physical(setup: Setup) -> Staged:
    """Return the cell by contact physics."""
    return _staged(setup, "mujoco")


def kinematic(setup: Setup) -> Staged:
    """Return the cell by kinematics alone."""
    return _staged(setup, "kinematic")


def _staged(setup: Setup, backend: "Backend") -> Staged:
    """Return the cell with its workstation.

    Raises:
        BadDescription, BadData, BadScript: Something is not in order; nothing has moved.
    """
    needs_cell(setup.system, setup.signs)
    database = database_of(setup.system, setup.signs, setup.database)
    if setup.answers_only:
        return Staged(queries=database.queries)
    from rcsc_cell.cell.ready import plant  # a level's process asks for answers alone, and needs no simulator

    if not setup.script:
        return Staged((plant(database, backend, seed=setup.seed),), database.queries)
    from rcsc_cell.cell.faults import Faults
    from rcsc_cell.cell.reach import checked
    from rcsc_cell.episodes.witness import Witness, timed

    folder = setup.spec.folder
    rows = read_script(script_path(setup.script, folder), tuple(Faults()))
    station = workstation(rows, database.locations, setup.signs["task"], safe_places(database))
    checked(database, open_cache(folder))
    world = timed(plant(database, backend, seed=setup.seed))
    return Staged(
        (world,),
        database.queries,
        station,
        witness=lambda run: Witness(run, plant=world, database=database),
        resume=StoppedRuns(setup.system, database.locations, KINDS),
    )
