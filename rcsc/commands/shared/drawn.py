"""Which cell a log is drawn in: that of the system that it is of, where that is here and has one."""

from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.commands.shared.systems import Stopped, stop, system_path

if TYPE_CHECKING:
    from rcsc.run.log.read import Log
    from rcsc_cell.pictures.scene import Cell


def cell_of(log: "Log", given: Path | None) -> "tuple[Cell | None, str]":
    """The cell, or none and why, a sentence.

    Args:
        log: To be drawn.
        given: The description that was named; what is wrong with it stops the command.
    """
    from rcsc.run.description import BadDescription
    from rcsc_cell.database.build import BadData

    try:
        path = system_path(given)
    except Stopped as error:
        return None, f"{error.message}; `--system` names one."
    try:
        return _made(log, path), ""
    except (BadData, BadDescription) as error:
        if given is not None:
            stop(error)
        return None, f"{error}; `--system` names another system."


def _made(log: "Log", path: Path) -> "Cell":
    """The cell of a description.

    Raises:
        BadDescription: It is of another system, or of none that is compiled.
        BadData: The system has no cell.
    """
    from rcsc.run.description import BadDescription, description
    from rcsc.run.system import signatures
    from rcsc_cell.database.build import BadData
    from rcsc_cell.pictures.scene import cell, same_system
    from rcsc_cell.workstation.prepared import database_of

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
