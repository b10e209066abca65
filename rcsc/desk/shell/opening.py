"""A system opened for somebody's hands: its levels, its plant, and the script that orders it where one is named.

In: a description's path, and which plant, script and executors. Out: the shell's commands on a session of it, before the first tick.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.desk.shell.commands import Commands
from rcsc.desk.shell.reload.reload import Origin
from rcsc.desk.shell.session import Session, silent_queries
from rcsc.run.description import NO_DATA, BadDescription, Description, description
from rcsc.run.plant.load import by_hand
from rcsc.run.plant.staged import Staged
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.processes.attach import RunningSystem, attach
from rcsc.run.signature import Signature
from rcsc.run.system import Kind, assemble, signatures


@dataclass(frozen=True, slots=True)
class Opening:
    """What is to be opened.

    Attributes:
        path: Of the description.
        kind: Which of the generated executors run.
        plant: As `rcsc run --plant` has it; empty for the one that is taken by hand.
        script: Its name; empty where orders are given by hand.
        alone: Whether nothing stands outside the levels, and no database.
        seed: Of what is random in the plant.
        database: A database to be used as it is; empty for the system's own.
        faults: Of the plant, on from the first cycle.
        ordered: Whether the script that the description names gives the orders where `script` names none, as in `rcsc run`.
        attached: What runs already, in processes of its own; None where it is put together here.
    """

    path: Path
    kind: Kind = "python"
    plant: str = ""
    script: str = ""
    alone: bool = False
    seed: int = 0
    database: str = ""
    faults: tuple[str, ...] = ()
    ordered: bool = False
    attached: RunningSystem | None = None


def opened(wanted: Opening) -> Commands:
    """Open a system.

    Raises:
        CodedError: It cannot be put together, or plant or script are not in order.
    """
    system = description(wanted.path)
    signs = signatures(system)
    if wanted.attached is not None:
        queries = silent_queries(system, signs)
        elsewhere = attach(wanted.attached, wanted.kind, queries)
        return Commands(Session(elsewhere, Origin(wanted.path, system, wanted.kind, queries)))
    wanted = replace(wanted, script=_script(system, wanted))
    stage = Staged() if wanted.alone else _stage(system, signs, wanted)
    queries = silent_queries(system, signs) | dict(stage.queries)
    outside = standing(stage, system, signs) if wanted.script else stage.outside
    running = assemble(system, wanted.kind, queries, outside)
    session = Session(running, Origin(wanted.path, system, wanted.kind, queries))
    session.faults = frozenset(fault.partition("=")[0] for fault in wanted.faults)
    return Commands(session)


def _script(system: Description, wanted: Opening) -> str:
    """Who gives the orders; empty for nobody."""
    own = wanted.ordered and not wanted.alone and system.script is not None
    return wanted.script or (str(system.script) if own else "")


def _stage(system: Description, signs: Mapping[str, Signature], wanted: Opening) -> Staged:
    """Return what stands outside; a declared plant is left out where the data is not there of which it would be made.

    Raises:
        CodedError: The plant or the script that was named is not in order.
    """
    plant = wanted.plant or by_hand(system) or ""
    try:
        order = StageOrder(
            str(wanted.path), plant, wanted.script, wanted.database, wanted.seed, wanted.faults
        )
        return staged(order, system, signs)
    except BadDescription:
        named = wanted.plant or wanted.script or wanted.database
        if not named and system.database.name != NO_DATA and not system.database.is_file():
            return Staged()
        raise
