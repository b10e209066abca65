"""What stands outside the levels, drawn of a log, where the system says who can draw it."""

from pathlib import Path

from rcsc.run.description import NO_DATA, BadDescription, description
from rcsc.run.log.read import Log
from rcsc.run.system import signatures
from rcsc.views.pages.data import Drawing, DrawnCell, known


def cell_of(log: Log, path: Path) -> DrawnCell:
    """Return what draws a log with the description's data.

    Raises:
        BadDescription: It is of another system, or of none that is compiled, or nobody knows its data.
        CodedError: The data is not in order.
    """
    system = description(path)
    if not log.is_of(system):
        raise BadDescription(f"the log is of system `{log.facts['name']}`, and `{path}` of `{system.name}`")
    try:
        signs = signatures(system)
    except BadDescription as error:
        raise BadDescription(f"the tables of `{path}` are not compiled") from error
    return known(system).drawn(log, system, signs)


class Drawn:
    """Draws ticks of logs of a system; the cell of a log is made once.

    Args:
        path: Of the description.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._cell: DrawnCell | None = None
        self._log: Log | None = None

    @property
    def can(self) -> bool:
        """True if the system names its drawer."""
        try:
            system = description(self._path)
        except BadDescription:
            return False
        return system.database.name != NO_DATA and bool(system.data_python)

    def __call__(self, log: Log, tick: int, *, projected: bool) -> Drawing:
        """Draw a tick: in perspective alone, or in three projections with it.

        Raises:
            CodedError: There is nothing to be drawn of this log.
        """
        if self._cell is None or self._log is not log:
            self._cell, self._log = cell_of(log, self._path), log
        return self._cell.drawn(tick, projected=projected)
