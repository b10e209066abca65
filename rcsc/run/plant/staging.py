"""Everything outside a system, of words: plant, script and database by their names; in one process, or in one of its own.

In: a `StageOrder`. Out: what stands outside, with the operator of the script. `outside` and `queries` are what
`rcsc.run.processes.serve.Factory` makes from arguments that travel; results go to a file, a line a row, where the process
that started all reads them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.run.description import Description, description
from rcsc.run.faults import faults_of, switch
from rcsc.run.levels import Query
from rcsc.run.orders.operator import Operator, ScriptOperator
from rcsc.run.orders.script import outside_buffers, read_script, script_path
from rcsc.run.orders.stopped import Restorable, StoppedRuns
from rcsc.run.orders.together import RowFaults, Together
from rcsc.run.plant.load import load
from rcsc.run.plant.staged import Staged
from rcsc.run.signature import Signature
from rcsc.run.system import Outside, signatures


@dataclass(frozen=True, slots=True)
class StageOrder:
    """A system, a plant and a script, named in words that travel to a process.

    Attributes:
        system: The description's path.
        plant: As `load` has it; empty for the description's first.
        script: Its name; empty for none.
        database: Path of one to be used as it is; empty for the system's own.
        faults: Of the plant, that are on from the first tick.
    """

    system: str
    plant: str = ""
    script: str = ""
    database: str = ""
    seed: int = 0
    faults: tuple[str, ...] = ()


def staged(
    order: StageOrder, system: Description, signs: Mapping[str, Signature], *, answers_only: bool = False
) -> Staged:
    """Stage the parts outside; for a plant that reads no scripts itself, add an operator of this script.

    Raises:
        CodedError: Plant or script is not in order.
    """
    stage = load(
        system, signs, order.plant or None, seed=order.seed, script=order.script,
        database=Path(order.database) if order.database else None, answers_only=answers_only,
    )  # fmt: skip
    if answers_only:
        return stage
    for fault in order.faults:
        switch(stage.outside, fault, on=True)
    if stage.operator is not None or not order.script:
        return stage
    path = script_path(order.script, Path(order.system).parent)
    rows = read_script(path, system, signs, faults_of(stage.outside))
    operator: Operator = ScriptOperator(rows)
    keeps = all(isinstance(part, Restorable) for part in stage.outside)
    return replace(stage, operator=operator, resume=StoppedRuns(system) if keeps else None)


def together(
    stage: Staged, system: Description, signs: Mapping[str, Signature], results: Path | None = None
) -> Together:
    """Join all parts outside into one."""
    first = {
        buffer.name: tuple(leaf.initial for leaf in buffer.leaves)
        for buffer in outside_buffers(system, signs)
    }
    shared = frozenset(wire.source for wire in system.wires)
    faults = () if stage.operator is None else (RowFaults(stage.operator, stage.outside),)
    return Together(stage.operator, (*faults, *stage.outside), first, shared, results)


def standing(stage: Staged, system: Description, signs: Mapping[str, Signature]) -> tuple[Outside, ...]:
    """Return the parts outside in one process; a plant that reads its own scripts knows what its parts say to each other."""
    if stage.operator is None or isinstance(stage.operator, ScriptOperator):
        return (together(stage, system, signs),)
    return (stage.operator, RowFaults(stage.operator, stage.outside), *stage.outside)


def outside(order: StageOrder, results: str, first: int = 0) -> list[Outside]:
    """Make the operator and the plants, for a process.

    Args:
        order: Which.
        results: Path of the file where results go.
        first: The row to begin at, from 0, as if those before were done.
    """
    system = description(Path(order.system))
    signs = signatures(system)
    stage = staged(order, system, signs)
    if stage.operator is not None:
        stage.operator.begin_at(first)
    return [together(stage, system, signs, Path(results))]


def queries(order: StageOrder) -> dict[str, Query]:
    """Return the answers to the queries of feeds, for a level's process."""
    system = description(Path(order.system))
    return dict(staged(order, system, signatures(system), answers_only=True).queries)
