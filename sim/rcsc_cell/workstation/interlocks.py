"""Refuse rows that would machine a loose part, or crush one, before they are done; find what is left of a row that failed.

In: the cell as the workstation knows it, and a row. Out: why the row must not be done; empty when it may. Of a row that failed also what
TASK said while it was under way, and what is in the gripper now: then what to send when the row is tried again, and how the cell stands
meanwhile. A part taken is not taken again, one that lies where it should stays: TASK refuses a command that takes a part while the
gripper holds one, and one that lets go of nothing (tables/task).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rcsc_cell.workstation.script import ScriptRow

FIXTURE = ("FIX-MAC1", "FIX-MAC5")
"""Locations at which a part lies in the fixture."""
PRESSED = ("FIX-MAC3", "FIX-MAC4")
"""Locations at which the closed fingers press the part down."""
CLEAR_OF_MACHINE = ("FIX-SAFE", "WS-SAFE", "BUFFER-SAFE", "V-BLK2")


@dataclass(frozen=True, slots=True)
class CellState:
    """The cell as the workstation knows it: the jaws, the parts in fixture and hand, and the place where the robot ended."""

    right_open: bool = True
    left_open: bool = True
    fixture: str = ""
    held: str = ""
    robot_at: str = ""


def refusal(cell: CellState, row: ScriptRow) -> str:
    """Return the reason why the row must not be done now; empty when it may."""
    if row.machine:
        return _machine(cell)
    if row.vise:
        return _vise(cell, row)
    return _robot(cell, row)


def _machine(cell: CellState) -> str:
    if not cell.fixture:
        return "there is no part in the fixture"
    if cell.right_open or cell.left_open:
        return f"the vise is open: its {'right' if cell.right_open else 'left'} jaw"
    if cell.robot_at not in CLEAR_OF_MACHINE:
        return "the robot is not clear of the machine"
    return ""


def _vise(cell: CellState, row: ScriptRow) -> str:
    opens = [jaw for jaw, opened in row.vise.items() if opened]
    loose = cell.fixture and not (cell.robot_at in FIXTURE and cell.held) and cell.robot_at not in PRESSED
    if opens and loose:
        return f"opening the {opens[0]} jaw would let go of the part in the fixture"
    return ""


def taken_from(cell: CellState, row: ScriptRow) -> str:
    """Return the place where the row takes a part; an ACQUIRE without a source takes it where the robot is (section 3.1)."""
    return row.source or (cell.robot_at if row.robot == "acquire" else "")


def _robot(cell: CellState, row: ScriptRow) -> str:
    source = taken_from(cell, row)
    brings = row.dest in FIXTURE and bool(cell.held or row.source)
    if brings and cell.fixture:
        return "the fixture is full"
    if brings and not cell.right_open:
        return "the vise is closed"
    if row.robot in ("release", "clear") and not cell.held:
        return "nothing is in the gripper"
    if row.robot == "transfer" and not cell.held and not row.source:
        return "nothing is in the gripper and no source is given"
    if row.robot == "acquire" and not source:
        return "no source is given, and nobody knows where the robot is"
    if source and cell.held:
        return f"the gripper holds a part already: {cell.held}"
    if source in FIXTURE and not cell.fixture:
        return "there is no part in the fixture"
    return ""


def after(cell: CellState, row: ScriptRow) -> CellState:
    """Return the cell when the row is done."""
    if row.vise:
        return replace(
            cell,
            right_open=row.vise.get("right", cell.right_open),
            left_open=row.vise.get("left", cell.left_open),
        )
    if not row.robot or row.robot == "pause":
        return cell
    source = taken_from(cell, row)
    held = row.part if source else cell.held
    takes_away = (source in FIXTURE and row.robot != "acquire") or (
        bool(cell.held) and cell.robot_at in FIXTURE and bool(row.dest)
    )
    fixture = "" if takes_away else cell.fixture
    ends = source if row.robot == "acquire" else row.dest or row.end_at or cell.robot_at
    if row.robot in ("release", "transfer", "clear"):
        put = row.dest or cell.robot_at
        fixture = held if put in FIXTURE else fixture
        held, ends = "", row.end_at or ends
    return replace(cell, held=held, fixture=fixture, robot_at=ends)


# --- what is left of a row ---

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
