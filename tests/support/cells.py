"""Cells for tests: runs that can be forked at any tick, and a workstation that says what it is told."""

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

from rcsc.run.buffers import CommonMemory
from rcsc.run.description import description
from rcsc.run.levels import RunningLevel
from rcsc.run.orders.operator import MOST_TICKS, RowResult, ScriptedRun
from rcsc.run.orders.script import script_path
from rcsc.run.signature import Value, Values
from rcsc.run.system import Kind, Outside, System, assemble, signatures
from rcsc_cell.cell.ready import Lying, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.workstation.prepared import database_of, needs_cell, safe_places
from rcsc_cell.workstation.script import ScriptRow, read_script
from rcsc_cell.workstation.station import Workstation, workstation

REPO = Path(__file__).parents[2]
SYSTEM = REPO / "tables" / "system.toml"
PAUSE_ENDS = 40
"""Cycles within which TASK has answered PAUSE, whatever was under way."""
COMMAND_ENDS = 700
"""Cycles within which TASK has answered any command with done or failed."""


def database() -> Database:
    """The cell's database, made anew where the data has changed."""
    said = description(SYSTEM)
    return database_of(said, signatures(said))


@dataclass(slots=True)
class ScriptDraft:
    """A system in the cell, before the first tick of its script."""

    system: System
    station: Workstation
    database: Database

    def steps(self, most: int = MOST_TICKS) -> Iterator[RowResult[ScriptRow]]:
        """Run to the end of the script, or until TASK has paused after a failure."""
        for result in ScriptedRun(self.system, self.station).steps(most):
            yield cast(RowResult[ScriptRow], result)


def prepare(
    path: Path,
    rows: tuple[ScriptRow, ...] | str,
    kind: Kind,
    outside: Callable[[Database], Iterable[Outside]],
) -> ScriptDraft:
    """A system with a script, or its name; `outside` makes robot, hand, camera, vise and machine."""
    system = description(path)
    signs = signatures(system)
    needs_cell(system, signs)
    held = database_of(system, signs)
    script = read_script(script_path(rows, path.parent)) if isinstance(rows, str) else rows
    station = workstation(script, held.locations, signs["task"], safe_places(held))
    return ScriptDraft(assemble(system, kind, held.queries, [station, *outside(held)]), station, held)


@dataclass(slots=True)
class Teller:
    """A workstation that sends what it is told, and nothing else."""

    order: dict[str, Value] = field(default_factory=dict)
    names: tuple[str, ...] = ()

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:  # noqa: ARG002  # what all outside have
        """The order of now."""
        return {"workstation.order": tuple(self.order[name] for name in self.names)} if self.order else {}


class Cell:
    """The whole system on the kinematic plant, told what to do by a test."""

    def __init__(self, kind: Kind = "c", parts: Sequence[Lying] | None = None) -> None:
        said = description(SYSTEM)
        signs = signatures(said)
        self.database = database_of(said, signs)
        self.world = plant(self.database, "kinematic", parts)
        self.teller = Teller(
            names=tuple(
                signs["task"].leaves[at].name.rpartition(".")[2] for at in signs["task"].record("workstation")
            )
        )
        self.system: System = assemble(said, kind, self.database.queries, [self.teller, self.world])
        self.number = 0
        self.failed: list[tuple[int, str, str, str]] = []
        self.lines: set[tuple[str, str]] = set()
        self.system.watch.append(self._watch)

    def _watch(self, system: System, due: tuple[RunningLevel, ...]) -> None:
        for level in due:
            self.lines.add((level.table, level.line))
            if level.values[-1]:
                self.failed.append((system.tick, level.name, level.table, level.line))

    def tell(self, command: str, **said: str | int) -> None:
        """A new command to TASK; names of places and parts as the database has them."""
        task = self.system.level("task")
        leaf = {
            one.name.rpartition(".")[2]: one
            for at in task.sign.record("workstation")
            for one in [task.sign.leaves[at]]
        }
        self.number = (self.number + 1) % 65536
        order: dict[str, Value] = dict.fromkeys(leaf, 0)
        order |= {"inc_command": self.number, "input_command": leaf["input_command"].members.index(command)}
        for name, value in said.items():
            key = f"{name}_locpt" if name in ("source", "dest", "end_at") else name
            if key == "obj":
                order[key] = leaf["obj"].members.index(str(value))
            else:
                order[key] = self.database.locations[value] if isinstance(value, str) else value
        self.teller.order = order

    @property
    def answer(self) -> str:
        """What TASK reports of the command: done, executing or failed; nothing before it is echoed."""
        report = self.system.buffers.latest("task.to_workstation")
        if report is None or report[0] != self.number:
            return ""
        return self.system.level("task").shown("to_workstation.status_report")

    def until_over(self, most: int) -> str:
        """Steps until TASK reports done or failed; what it said, empty when it did not in `most` ticks."""
        for _ in range(most):
            self.system.step()
            if self.answer in ("done", "failed"):
                return self.answer
        return ""

    def do(self, command: str, **said: str | int) -> str:
        """Tells, and waits for the end."""
        self.tell(command, **said)
        return self.until_over(COMMAND_ENDS)

    def take_over(self, other: "Cell") -> None:
        """Goes on from where the other cell is now; the other is not touched."""
        for mine, its in zip(self.system.levels, other.system.levels, strict=True):
            mine.restore(its.values)
        held = other.system.buffers
        assert isinstance(held, CommonMemory)
        self.system.buffers = copy.deepcopy(held)
        state = copy.deepcopy(other.world, {id(other.database): self.database})
        self.world = state
        self.system.outside = (self.teller, state)
        self.teller.order = dict(other.teller.order)
        self.number, self.system.tick = other.number, other.system.tick
        self.failed = []

    def reason(self) -> str:
        """Why TASK says that it failed."""
        return self.system.level("task").shown("to_workstation.failure")

    def cause(self) -> str:
        """What E-MOVE said of it, as TASK passes it on."""
        return self.system.level("task").shown("to_workstation.cause")


SCRIPT: tuple[tuple[str, dict[str, str | int]], ...] = (
    ("move", {"obj": "tbox", "grasp": 2, "source": "BUFFER", "dest": "FIX-MAC1"}),
    ("release", {"end_at": "FIX-MAC2"}),
    ("move", {"obj": "close_grip", "dest": "FIX-MAC3"}),
    ("move", {"dest": "FIX-SAFE"}),
    ("acquire", {"obj": "tbox", "grasp": 2, "source": "FIX-MAC5"}),
    ("transfer", {"obj": "tbox", "grasp": 2, "dest": "V-BLK1", "end_at": "V-BLK2"}),
    ("transfer", {"obj": "tbox", "grasp": 3, "source": "V-BLK3", "dest": "V-BLK4"}),
    ("move", {"obj": "tbox", "grasp": 2, "source": "V-BLK5", "dest": "FIX-MAC1"}),
    ("clear", {"dest": "STATION", "sector": 3, "end_at": "WS-SAFE"}),
    ("pause", {}),
)
"""Every command of TASK, as MAKE BOXT gives them, and CLEAR."""


def through_script(cell: Cell) -> Iterator[int]:
    """Runs the script; a pause after every tick, with the number of the command."""
    for at, (command, said) in enumerate(SCRIPT):
        cell.tell(command, **said)
        for _ in range(COMMAND_ENDS):
            cell.system.step()
            yield at
            if cell.answer in ("done", "failed"):
                assert cell.answer == "done", (command, said, cell.reason())
                break
        else:
            raise AssertionError(f"{command} did not end")
