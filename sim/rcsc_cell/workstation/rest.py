"""Find what is left of a row that failed: a part taken is not taken again, one that lies where it should stays.

In: a row, what TASK said while it was under way, and what is in the gripper now. Out: what to send when the row is tried again, and how
the cell stands meanwhile, which the interlocks look at. TASK refuses a command that takes a part while the gripper holds one, and one
that lets go of nothing (tables/task).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rcsc_cell.workstation.interlocks import FIXTURE, CellState
from rcsc_cell.workstation.script import ScriptRow

PUTS = ("release", "transfer", "clear")
NOTHING = "null_obj"
MOVE_FAILED = "move"
"""The reason after which a part that was held and is not has been let go of where it should be: TASK had only to leave."""


@dataclass(slots=True)
class Progress:
    """The progress of a row, over all its tries.

    Attributes:
        tried: It has been begun before.
        taken: A part was in the gripper.
        put: And was let go of where it should be.
        before: The cell before the first try.
    """

    tried: bool = False
    taken: bool = False
    put: bool = False
    before: CellState = field(default_factory=CellState)

    def begin(self, cell: CellState) -> None:
        """Note that the row is tried, for the first time or again."""
        if not self.tried:
            self.tried, self.before = True, cell

    def seen(self, in_gripper: str) -> None:
        """Note a report by TASK of the part in the gripper."""
        self.taken = self.taken or in_gripper != NOTHING

    def failed(self, row: ScriptRow, in_gripper: str, failure: str) -> None:
        """Note a failure of TASK."""
        lets_go = row.robot in PUTS and in_gripper == NOTHING
        self.put = self.put or (self.taken and lets_go and failure == MOVE_FAILED)


def stands(row: ScriptRow, progress: Progress, in_gripper: str, cell: CellState) -> CellState:
    """Return the cell after a failed try: the gripper holds what TASK reports, and a part that was put into the fixture is there."""
    held = "" if in_gripper == NOTHING else in_gripper
    fixture = cell.fixture
    if progress.put and _put_at(row, progress) in FIXTURE:
        fixture = row.part if row.source else progress.before.held
    return replace(cell, held=held, fixture=fixture)


def _put_at(row: ScriptRow, progress: Progress) -> str:
    """Return the place where the row lets go of a part: its destination, or the place of the robot when it began."""
    return row.dest or progress.before.robot_at


def rest(row: ScriptRow, progress: Progress, in_gripper: str, safe: Mapping[str, str]) -> ScriptRow:
    """Return the rest of a row, which is to be sent.

    Args:
        row: As the script has it.
        progress: Of its tries.
        in_gripper: As TASK says.
        safe: The safe location of each that has one.
    """
    if not progress.tried:
        return row
    if progress.put:
        put_at = _put_at(row, progress)
        return ScriptRow(row.number, row.text, "move", dest=row.end_at or safe.get(put_at, put_at))
    if row.source and row.dest and in_gripper == row.part:
        return replace(row, source="")
    return row
