"""Refuse rows that would machine a loose part, or crush one, before they are done.

In: the cell as the workstation knows it, and a row. Out: why the row must not be done; empty when it may.
"""

from dataclasses import dataclass, replace

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
