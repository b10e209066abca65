"""The cell as the plant of its system: what `[plant.mujoco]` and `[plant.kinematic]` of `tables/system.toml` name.

In: a system and, for a run, a script. Out: workstation, robot, hand, camera, vise and machine, the database's answers, who
watches the run, and what keeps one that was stopped.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.host.cache import open_cache
from rcsc.run.description import Description
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.plant.load import Setup, Staged
from rcsc_cell.database.ask import Database
from rcsc_cell.workstation import stopped
from rcsc_cell.workstation.prepared import ScriptDraft, database_of, needs_cell, safe_places, script_path
from rcsc_cell.workstation.script import read_script
from rcsc_cell.workstation.station import Workstation, workstation

if TYPE_CHECKING:
    from rcsc_cell.cell.ready import Backend


def physical(setup: Setup) -> Staged:
    """The cell by contact physics."""
    return _staged(setup, "mujoco")


def kinematic(setup: Setup) -> Staged:
    """The cell by kinematics alone."""
    return _staged(setup, "kinematic")


def _staged(setup: Setup, backend: "Backend") -> Staged:
    """What stands outside.

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
    from rcsc_cell.cell.reach import checked
    from rcsc_cell.episodes.witness import Timed, Witness

    folder = setup.spec.folder
    rows = read_script(script_path(setup.script, folder / "system.toml"))
    station = workstation(rows, database.locations, setup.signs["task"], safe_places(database))
    checked(database, open_cache(folder))
    timed = Timed(plant(database, backend, seed=setup.seed))
    return Staged(
        (timed,),
        database.queries,
        station,
        witness=lambda run: Witness(run, timed=timed, database=database),
        resume=StoppedCell(setup.system, station, database),
    )


@dataclass(frozen=True, slots=True)
class StoppedCell:
    """Keeps a stopped run of the cell beside its data."""

    system: Description
    station: Workstation
    database: Database

    def keep(self, run: ScriptedRun, script: str) -> Path:
        """Writes where the run stands."""
        return stopped.keep(self._draft(run), script)

    def go_on(self, run: ScriptedRun) -> None:
        """Puts a run that has not begun where the stopped one stood."""
        stopped.go_on(self._draft(run))

    def forget(self) -> None:
        """Removes what was kept."""
        stopped.forget(self.system)

    def _draft(self, run: ScriptedRun) -> ScriptDraft:
        return ScriptDraft(run.system, self.station, self.database)
