"""Every line of the 24 tables is reached by a run of the whole system, or has a written reason why none reaches it."""

from dataclasses import Field, fields
from pathlib import Path

import pytest

from rcsc_cell.cell.faults import Faults
from tests.support.cells import COMMAND_ENDS, Cell, through_script

Line = tuple[str, str]
SWITCHED: dict[str, float] = {"joint_stuck": 2, "late_ticks": COMMAND_ENDS, "shifted_mm": 60.0}
"""What is set for faults that are numbers; the others are switches."""
TOLD = [
    ("clear", {}),
    ("clear", {"dest": 200}),
    ("clear", {"dest": "STATION"}),
    ("move", {}),
    ("move", {"source": 200, "dest": "WS-SAFE"}),
    ("move", {"obj": "tbox", "grasp": 2, "source": "BUFFER", "dest": "WS-SAFE"}),
    ("move", {"obj": "close_grip", "dest": "WS-SAFE"}),
    ("move", {"dest": "STATION", "sector": 50}),
    ("transfer", {"dest": 200}),
    ("transfer", {}),
    ("transfer", {"obj": "tbox", "grasp": 2, "source": "BUFFER", "dest": "V-BLK1"}),
    ("transfer", {"obj": "hous", "grasp": 2, "source": "BUFFER", "dest": "V-BLK1"}),
    ("transfer", {"dest": "V-BLK1"}),
    ("release", {"end_at": 200}),
    ("release", {}),
    ("acquire", {}),
    ("acquire", {"obj": "tbox", "grasp": 9, "source": "FIX-MAC5"}),
    ("acquire", {"obj": "tbox", "grasp": 2, "source": "STATION", "sector": 50}),
    ("acquire", {"obj": "hous", "grasp": 2, "source": "BUFFER"}),
    ("acquire", {"obj": "bbox", "grasp": 2, "source": "BUFFER"}),
    ("acquire", {"obj": "tbox", "grasp": 2, "source": "FIX-MAC5"}),
]


def told() -> set[Line]:
    """Each command alone, and again with a part in the gripper."""
    lines: set[Line] = set()
    for held in (False, True):
        for command, said in TOLD:
            cell = Cell()
            if held:
                assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
            assert cell.do(command, **said) in ("done", "failed")  # type: ignore[arg-type]  # of the table above
            rest(cell)
            assert cell.failed == []
            lines |= cell.lines
    cell = Cell()
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
    cell.world.faults.drops = True
    for _ in range(20):
        cell.system.step()
    cell.world.faults.drops = False
    assert cell.do("release") == "failed"
    assert cell.reason() == "nothing_gripped"
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
    lines |= cell.lines
    cell = Cell()
    cell.world.faults.robot_refuses = True
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "failed"
    lines |= cell.lines
    cell = Cell()
    assert cell.do("move", dest="FIX-MAC3") == "done"  # from here the path to another place has three points
    assert cell.do("acquire", obj="tbox", grasp=2, source="FIX-MAC5") == "failed"
    lines |= cell.lines
    for case in CAUGHT:
        lines |= caught(*case)
    return lines


Told = tuple[str, dict[str, str | int]]
CAUGHT: list[tuple[str, bool, Told, str]] = [
    ("hand_stuck", True, ("release", {}), "release_part"),
    ("dark", False, ("acquire", {"obj": "tbox", "grasp": 2, "source": "BUFFER"}), "line_flash"),
    ("dark", False, ("acquire", {"obj": "tbox", "grasp": 2, "source": "BUFFER"}), "flood_flash"),
]
"""Faults that come when a level has just begun a table; at a regular beat they may miss it."""


def caught(fault: str, held: bool, told: Told, table: str) -> set[Line]:
    """The lines of a command that fails by a fault from the moment when a level is at the table."""
    cell = Cell()
    if held:
        assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
    cell.tell(told[0], **told[1])
    for _ in range(COMMAND_ENDS):
        cell.system.step()
        if table in (level.table for level in cell.system.levels):
            break
    setattr(cell.world.faults, fault, True)
    assert cell.until_over(COMMAND_ENDS) == "failed"
    assert cell.failed == []
    return cell.lines


def rest(cell: Cell) -> None:
    """Some cycles more: done stays done, and failed stays failed."""
    before = cell.answer
    for _ in range(8):
        cell.system.step()
        assert cell.answer == before


def switched(fault: "Field[object]") -> float | bool:
    """What a fault is set to; a fault that is a number and has none here is a mistake in this test."""
    return True if fault.type in (bool, "bool") else SWITCHED[fault.name]


def with_faults(every: int) -> set[Line]:
    """A fault at every so-many-th cycle of every command: each ends, and the system goes on when the fault is over."""
    main, probe = Cell(), Cell()
    for _ in through_script(main):
        if main.system.tick % every == 0:
            for fault in fields(Faults):
                probe.take_over(main)
                setattr(probe.world.faults, fault.name, switched(fault))
                ended = probe.until_over(COMMAND_ENDS) or probe.until_over(COMMAND_ENDS)
                assert ended in ("done", "failed"), (fault.name, main.system.tick)
                rest(probe)
                setattr(probe.world.faults, fault.name, fault.default)
                probe.tell("pause")
                assert probe.until_over(COMMAND_ENDS) == "done"
                if (
                    probe.do("move", dest="WS-SAFE") == "failed"
                ):  # the first to find that the part was lost says so
                    assert probe.reason() == "nothing_gripped", (fault.name, main.system.tick)
                    probe.tell("move", dest="WS-SAFE")
                    probe.until_over(COMMAND_ENDS)
                assert probe.answer == "done", (
                    fault.name,
                    main.system.tick,
                    probe.reason(),
                )
                assert probe.failed == []
    return main.lines | probe.lines


def unreached(path: Path) -> dict[Line, str]:
    """The written reasons: `table line line ...: reason`."""
    found: dict[Line, str] = {}
    for row in path.read_text(encoding="utf-8").splitlines():
        if row and not row.startswith("#"):
            names, _, reason = row.partition(": ")
            table, *lines = names.split()
            found |= {(table, line): reason for line in lines}
    return found


@pytest.fixture(scope="module")
def reached() -> set[Line]:
    """Every line that the runs of this module reach."""
    return told() | with_faults(97)


def test_every_line_is_reached_or_has_a_reason(reached: set[Line], repo: Path) -> None:
    signs = [level.sign for level in Cell().system.levels]
    every = {(table, line) for sign in signs for table, lines in sign.tables.items() for line in lines}
    reasons = unreached(repo / "tests" / "data" / "unreached.txt")
    assert every - reached - reasons.keys() == set(), "reached by no run, and nobody says why"
    assert reasons.keys() & reached == set(), "said to be unreached, and reached"
    assert reasons.keys() <= every
    assert len(every) > 200
