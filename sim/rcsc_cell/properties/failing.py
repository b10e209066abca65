"""Properties of failures: FAIL gives the right reason, and nothing moves after it."""

from collections.abc import Mapping
from math import dist
from typing import ClassVar

from rcsc_cell.cell.mujoco_model import DENSITY_KG_M3
from rcsc_cell.database.ask import Database
from rcsc_cell.properties.cycle import TAKES, Command, CycleState

ROBOT = frozenset({"move", "loc", "robot"})
HAND = frozenset({"move", "loc", "pic", "grip"})
REASONS: Mapping[str, frozenset[str]] = {
    "robot_stuck": ROBOT,
    "joint_stuck": ROBOT,
    "robot_refuses": ROBOT,
    "unreadable": ROBOT,
    "hand_stuck": HAND,
    "hand_weak": HAND,
    "jammed": HAND,
    "slips": frozenset({"pic", "loc", "move"}),  # what slipped sits askew, and is pressed on where it is put
    "drops": frozenset({"pic", "loc", "move"}),
    "blind": frozenset({"loc"}),
    "dark": frozenset({"loc"}),
    "late_ticks": frozenset({"loc"}),
    "noisy": frozenset({"loc", "pic"}),
    "shifted_mm": frozenset({"loc", "pic", "move"}),
    "tilted": frozenset({"loc"}),
    "vise_stuck": frozenset(),
    "vise_weak": frozenset(),
    "vise_mute": frozenset(),
    "pushed": frozenset({"loc", "pic", "move"}),
    "restarted": frozenset({"restart", "move", "loc", "pic", "cmd", "grip"}),
    "lost": frozenset({"move", "loc", "pic", "robot", "grip"}),
    "doubled": frozenset({"move", "loc", "pic", "robot", "grip"}),
    "stale": frozenset({"move", "loc", "pic", "robot", "grip"}),
    "late": frozenset({"move", "loc", "pic", "robot", "grip"}),
}
"""Which reasons TASK may give because of a fault (Fig. 9: cmd, move, loc, pic, state, buf; RELEASE gives the reason of the level below)."""
SETTLE_TICKS = 25
"""After FAIL is reported the robot is stopped within these: a second."""
STILL_RAD = 0.004
STILL_MM = 3.0
STIRS = frozenset({"drops", "slips", "robot_stuck", "joint_stuck"})
"""Faults that move something by themselves, whatever it is told: fingers open, or close on what slips away; a joint that comes free
goes to where it was to be."""
FRICTION = 0.4
SEEN_MM = 220.0
"""A part is seen this near to where the camera looks."""
TAKEN_MM = 15.0
"""A part is taken without looking this near to where the fingers go."""
ROOM_MM = 120.0
"""The fingers have room between parts whose middles are so far apart."""
SIZE_MM = 1.0


class RightReason:
    """FAIL has a reason, and there is one for it: the command was not legal, the part was not there or not right, or a fault was at work.

    A command that is not legal fails with `cmd`.
    """

    name: ClassVar[str] = "right reason"
    place: ClassVar[str] = "section 8.1, lines 2, 3 and 10 to 13 of Fig. 8, and Fig. 9"

    def __init__(self, cycle: CycleState) -> None:
        self._objects = cycle.objects()
        self._restarted = self._odd = False
        self._begun: Command | None = None

    def watch(self, cycle: CycleState) -> str | None:
        """Return the reason that nothing explains, or the command that should have failed."""
        self._restarted = self._restarted or bool(cycle.restarted)
        command = cycle.command
        if command is not self._begun:
            self._begun, self._odd = command, command is not None and self._part_is_odd(cycle, command)
        if command is None or not cycle.ended:
            return None
        wrong = illegal(cycle.database, command)
        if cycle.ended == "done":
            return f"`{command.name}` is not legal ({wrong}), and was done" if wrong else None
        reason = cycle.shown("task", "to_workstation.failure")
        if wrong and reason != "cmd" and not self._explained(cycle, command, reason):
            return f"`{command.name}` is not legal ({wrong}), and failed with `{reason}`"
        explained = bool(wrong) or self._explained(cycle, command, reason)
        return None if explained else f"`{command.name}` failed with `{reason}`"

    def _explained(self, cycle: CycleState, command: Command, reason: str) -> bool:
        if reason == "buf":
            return command.obj in cycle.counts and cycle.counts[command.obj] == 0
        if reason == "nothing_gripped":
            # what was in the hand is lost, whatever took it; or a level below has forgotten how far apart the fingers are
            return not cycle.held or self._restarted
        if reason == "move" and not command.here:
            return True  # stopped on its way: no straight line may lead from there, and no place has a safe position
        since = command.tick if not self._restarted else 0
        named = (name for name, at in cycle.last.items() if at >= since or name == "restarted")
        if any(reason in REASONS[name] for name in named):
            return True
        return reason in ("loc", "pic") and command.name in TAKES and self._odd

    def _part_is_odd(self, cycle: CycleState, command: Command) -> bool:
        """Return whether the source has not exactly one part of the kind, of the right size, with room for the fingers."""
        if not command.source or command.obj not in self._objects:
            return True
        database = cycle.database
        target = database.pads(command.source, command.sector)
        if target is None:
            return True
        looks = bool(database.place(command.source)[1])
        near_mm = SEEN_MM if looks else TAKEN_MM
        top = database.sizes[database.objects[command.obj]][:2]
        at = [pose.at_mm for pose in cycle.parts]
        here = [
            index
            for index, kind in enumerate(self._objects)
            if (kind == command.obj or (looks and database.sizes[database.objects[kind]][:2] == top))
            and dist(at[index][:2], target[:2]) < near_mm
            and dist(at[index], target) < SEEN_MM
        ]
        if len(here) != 1:
            return True
        [index] = here
        body = cycle.bodies[index]
        # a finger that meets it first may push it aside
        slides = (body.density_kg_m3, body.friction) != (DENSITY_KG_M3, FRICTION)
        sizes = zip(body.size_mm, database.sizes[database.objects[command.obj]], strict=True)
        crowded = slides or any(
            dist(at[index], other) < ROOM_MM for which, other in enumerate(at) if which != index
        )
        return crowded or any(abs(a - b) > SIZE_MM for a, b in sizes)


def illegal(database: Database, command: Command) -> str:
    """Return why a command is not legal (sections 3.1 to 3.5; 8.1, lines 2 and 3 of Fig. 8); empty where it is."""
    holds = command.held != "null_obj"
    takes = bool(database.place(command.source)[0]) and bool(command.source)
    dest = bool(database.place(command.dest)[0]) and bool(command.dest)
    match command.name:
        case "acquire":
            takes = takes or (not command.source and bool(database.place(command.here)[0]))
            return "it holds an object" if holds else "" if takes else "no source"
        case "move" | "transfer" if not dest:
            return "no destination"
        case "move" | "transfer" if takes and holds:
            return "it holds an object"
        case "move":
            fingers = not takes and command.obj == "close_grip"
            return "the fingers are to close on an object" if fingers and holds else ""
        case "transfer":
            return "" if takes or holds else "no object"
        case "clear" if not dest:
            return "no destination"
        case "release" | "clear":
            return "" if holds else "no object"
        case _:
            return ""


class StillAfterFail:
    """After FAIL the robot stops, and the fingers stay as they are, until a command other than PAUSE."""

    name: ClassVar[str] = "still after FAIL"
    place: ClassVar[str] = "section 8.1, line 14 of Fig. 8: the lower level is commanded to PAUSE"

    def __init__(self, cycle: CycleState) -> None:
        self._since: int | None = None
        self._command: Command | None = None
        self._joints, self._opening_mm = cycle.joints, cycle.opening_mm

    def watch(self, cycle: CycleState) -> str | None:
        """Return the joint, finger or part that moved."""
        command = cycle.command
        if command is not self._command:
            self._command = command
            self._since = self._since if command is not None and command.name == "pause" else None
        if cycle.ended == "failed" and self._since is None:
            self._since = cycle.tick
        if self._since is None or cycle.tick < self._since + SETTLE_TICKS:
            return None
        if cycle.tick == self._since + SETTLE_TICKS or cycle.was_active(STIRS, cycle.tick - SETTLE_TICKS):
            self._joints, self._opening_mm = cycle.joints, cycle.opening_mm
            return None
        return self._moved(cycle)

    def _moved(self, cycle: CycleState) -> str | None:
        turned_rad = max(abs(a - b) for a, b in zip(self._joints, cycle.joints, strict=True))
        if turned_rad > STILL_RAD:
            return f"a joint has turned by {turned_rad:.3f} rad"
        moved_mm = abs(cycle.opening_mm - self._opening_mm)
        return f"the fingers have moved by {moved_mm:.1f} mm" if moved_mm > STILL_MM else None
