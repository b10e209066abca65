"""Properties of robot and hand: what may touch what, with which force the fingers close, how far and how fast joints go."""

from math import dist
from typing import ClassVar

from rcsc_cell.cell.arm import LIMITS, plate
from rcsc_cell.cell.plant import CYCLE_S
from rcsc_cell.cell.robot import JUMP_RAD
from rcsc_cell.database.ask import Database
from rcsc_cell.properties.cycle import LETS_GO, CycleState

FINGERS = ("pad_", "finger_")
FURNITURE = ("vise_bed", "jaw_", "wall_")
TOP = "_top"
FORCE_SHARE = 1.15
FORCE_N = 20.0
"""Contact forces ripple: fingers that meet a part at their speed press a little more for a cycle."""
LIMIT_RAD = 0.01
"""A position servo under load."""
SPEED_SHARE = 1.15
SPEED_MM_S = 20.0
"""The wrist plate is dragged a little after what it is told, and catches up."""

CATCHES_UP = frozenset({"robot_stuck", "joint_stuck"})
"""A joint that comes free is drawn to where it is told to be: it lags by less than what the robot fails for
(`rcsc_cell.cell.robot.LAG_RAD`), but may go as far in a cycle."""
CATCHES_UP_TICKS = 15
ORDERS = "primitive.to_robot"
"""Poses that are lost or come late leave a gap, and the robot closes it in a cycle, unless a joint would jump: it knows no speed of
its own."""


class OnlyAllowedContact:
    """Fingers touch parts, parts touch what they lie on or are clamped by, and nothing else touches anything."""

    name: ClassVar[str] = "only allowed contact"
    place: ClassVar[str] = "sections 4.3 and 4.4: approach and departure keep clear of what stands about"

    def __init__(self, _: CycleState) -> None:
        self._seen: frozenset[tuple[str, str]] = frozenset()

    def watch(self, cycle: CycleState) -> str | None:
        """Return the two bodies that touched."""
        if cycle.touching == self._seen:
            return None
        self._seen = cycle.touching
        for first, second in sorted(cycle.touching):
            if not _allowed(first, second) and not (_fallen(first, second) and _let_go(cycle)):
                return f"`{first}` touched `{second}`"
        return None


def _fallen(first: str, second: str) -> bool:
    """A part that was let go of in the air lies on the floor, or on another one."""
    return {_kind(first), _kind(second)} in ({"part", "floor"}, {"part"})


def _let_go(cycle: CycleState) -> bool:
    """Whether a fault did, or RELEASE, which lets go wherever the hand is."""
    released = cycle.command is not None and cycle.command.name == "release"
    return released or cycle.was_active(LETS_GO, 0)


def _kind(name: str) -> str:
    if name.startswith("part"):
        return "part"
    if name.startswith(FINGERS):
        return "finger"
    return "fixture" if name.startswith(FURNITURE) or name.endswith(TOP) else name


def _allowed(first: str, second: str) -> bool:
    return {_kind(first), _kind(second)} in ({"finger", "part"}, {"part", "fixture"})


class ForceWithin:
    """The fingers press no harder than the database says of the part."""

    name: ClassVar[str] = "grip force"
    place: ClassVar[str] = "sections 6.5 (100 lb) and 7.2"

    def __init__(self, _: CycleState) -> None:
        self._most_n = 0.0
        self._key = (-1, -1)

    def watch(self, cycle: CycleState) -> str | None:
        """Return the force that they pressed with."""
        primitive = cycle.levels["primitive"]
        key = int(primitive.value("emove.obj_ptr")), int(primitive.value("emove.grasp"))
        if key != self._key:
            self._key = key
            known, *_, force_n, _ = cycle.database.fingers(*key)
            self._most_n = max(self._most_n, float(force_n)) if known else self._most_n
        if "slips" in cycle.last:
            return None  # what slipped sits askew, and is wedged between the pads where it is put down: it is not the motor that presses
        most_n = FORCE_SHARE * self._most_n + FORCE_N
        return f"{cycle.force_n:.0f} N, not {self._most_n:.0f}" if cycle.force_n > most_n else None


class JointsWithin:
    """Joints keep their limits and their speed, and the plate the speed of the database."""

    name: ClassVar[str] = "joints within limits"
    place: ClassVar[str] = "sections 6.1, 6.2 and 7.1"

    def __init__(self, cycle: CycleState) -> None:
        self._before = cycle.joints
        self._at = plate(cycle.joints).at_mm
        self._gap = -CATCHES_UP_TICKS
        self._most_mm = _fastest_mm_s(cycle.database) * SPEED_SHARE * CYCLE_S + SPEED_MM_S * CYCLE_S

    def watch(self, cycle: CycleState) -> str | None:
        """Return the joint or the plate, and how far it went."""
        if ORDERS in cycle.harmed:
            self._gap = cycle.tick
        if cycle.joints == self._before:
            return None
        before, was = self._before, self._at
        self._before, self._at = cycle.joints, plate(cycle.joints).at_mm
        for number, (angle, last, (low, high)) in enumerate(
            zip(cycle.joints, before, LIMITS, strict=True), 1
        ):
            if not low - LIMIT_RAD <= angle <= high + LIMIT_RAD:
                return f"joint {number} is at {angle:.3f} rad"
            if abs(angle - last) > JUMP_RAD:
                return f"joint {number} turned by {abs(angle - last):.2f} rad in a cycle"
        if (
            cycle.was_active(CATCHES_UP, cycle.tick - CATCHES_UP_TICKS)
            or self._gap >= cycle.tick - CATCHES_UP_TICKS
        ):
            return None
        far_mm = dist(was, self._at)
        return f"the plate went {far_mm:.1f} mm in a cycle" if far_mm > self._most_mm else None


def _fastest_mm_s(database: Database) -> float:
    """Return the greatest speed of a point."""
    points = {int(point) for _, _, row in database.routes() for point in (row[1], row[3], *row[5:])}
    return max(float(database.point(point)[10]) for point in points)
