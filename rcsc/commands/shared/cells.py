"""The paper's cell, where a system has one: made of its data, drawn of a log."""

from pathlib import Path

from rcsc.run.description import NO_DATA, BadDescription, description
from rcsc.run.log.read import Log
from rcsc.run.system import signatures
from rcsc_cell.database.build import BadData
from rcsc_cell.pictures.scene import DrawnCell, DrawnScene, cell, same_system
from rcsc_cell.pictures.views import ALONE, PICTURES
from rcsc_cell.workstation.prepared import database_of


def cell_of(log: Log, path: Path) -> DrawnCell:
    """The cell of a description, to be drawn of a log.

    Raises:
        BadDescription: It is of another system, or of none that is compiled.
        BadData: The system has no cell.
    """
    system = description(path)
    if not same_system(log, system):
        raise BadDescription(f"the log is of system `{log.facts['name']}`, and `{path}` of `{system.name}`")
    try:
        signs = signatures(system)
    except BadDescription as error:
        raise BadDescription(f"the tables of `{path}` are not compiled") from error
    try:
        return cell(log, system, database_of(system, signs))
    except (KeyError, StopIteration) as error:
        raise BadData((f"`{path}` has no level `task` that names parts",)) from error


class Drawn:
    """Draws ticks of logs of a system; what it is made of is read once a log.

    Args:
        path: Of the description.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._cell: DrawnCell | None = None

    @property
    def can(self) -> bool:
        """Whether the system has data of which a cell could be made."""
        try:
            return description(self._path).database.name != NO_DATA
        except BadDescription:
            return False

    def __call__(self, log: Log, tick: int, *, projected: bool) -> DrawnScene:
        """Draw a tick: in perspective alone, or in three projections with it.

        Raises:
            BadDescription, BadData: There is no cell to be drawn of this log.
        """
        if self._cell is None or self._cell.log is not log:
            self._cell = cell_of(log, self._path)
        return self._cell.drawn(tick, PICTURES if projected else ALONE)
