"""Stand-ins for the robot, the hand and the camera, and the parts between them: kinematics only, no physics.

The paper's team "coded subsystems to simulate upper and lower levels" (section 10); these are ours. A part lies where it
was put, moves with the hand that closed on it, and stays where the hand lets go of it. Lengths are millimetres.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, hypot, radians, sin

from rcsc.database.ask import Database
from rcsc.system.signature import Value, Values

CYCLE_S = 0.04
JUMP_MM = 120.0
"""A robot controller refuses a pose farther than this from the one before: 3 m/s."""
REACH_MM = 12.0
"""How far from the middle of the pads a part may be to be taken."""
PICTURE_TICKS = 3
"""From the flash to what the image processing says."""
TOOL_MM = 150.0

DONE, EXECUTING, FAILED = 0, 1, 2
HOLD, FOLLOW = 0, 1
DARK, FLOOD, LINE = 0, 1, 2
ROBOT_REASON = 9  # `robot` of `reason` in tables/vocabulary.rcs

Latest = Callable[[str], Values | None]


@dataclass(slots=True)
class Thing:
    """A part: what it is, where its middle is, how it is turned, and whether the hand has it."""

    object: int
    x_mm: float
    y_mm: float
    z_mm: float
    yaw: float
    held: bool = False


@dataclass(slots=True)
class Faults:
    """What goes wrong; nothing unless a test says so."""

    robot_stuck: bool = False
    robot_refuses: bool = False
    hand_stuck: bool = False
    jammed: bool = False
    slips: bool = False
    blind: bool = False
    dark: bool = False
    tilted: bool = False


@dataclass(slots=True)
class World:
    """Robot, hand, camera and parts.

    Attributes:
        plate: The wrist plate: nine numbers.
        opening_mm: Between the pads.
        force_n: On them.
    """

    database: Database
    plate: list[float]
    things: list[Thing] = field(default_factory=list)
    opening_mm: float = 95.0
    force_n: float = 0.0
    faults: Faults = field(default_factory=Faults)
    _robot: tuple[Value, ...] = (0, HOLD, DONE, 0)
    _picture: tuple[Value, ...] = (0, False, 0.0, 0.0, 1.0, 0.0, 0.0, False)
    _asked: tuple[int, int, int, int] = (0, DARK, 0, 0)
    _offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick of everything."""
        self._move(latest("primitive.to_robot"))
        self._close(latest("gripper.to_hand"))
        self._look(tick, latest("vision.to_camera"))
        return {
            "robot.report": (*self._robot, *self.plate),
            "hand.report": (self.opening_mm, self.force_n),
            "camera.picture": self._picture,
        }

    # --- robot ---

    def _move(self, order: Values | None) -> None:
        if order is None:
            return
        number, command, goal = order[0], order[1], order[2:]
        if command == HOLD or self.faults.robot_stuck:
            stuck = command == FOLLOW and list(goal) != self.plate
            self._robot = (number, command, EXECUTING if stuck else DONE, 0)
            return
        far = max(abs(a - b) for a, b in zip(goal, self.plate, strict=True))
        if far > JUMP_MM or self.faults.robot_refuses:
            self._robot = (number, command, FAILED, ROBOT_REASON)
            return
        self.plate = [float(value) for value in goal]
        self._robot = (number, command, DONE, 0)
        self._carry()

    @property
    def pads(self) -> tuple[float, float, float, float]:
        """The middle of the pads and the turn of the hand."""
        x, y, z = self.plate[:3]
        return x, y, z - TOOL_MM, atan2(self.plate[7] - y, self.plate[6] - x)

    def _carry(self) -> None:
        for thing in self.things:
            if thing.held:
                x, y, z, yaw = self.pads
                dx, dy, dz, turn = self._offset
                thing.x_mm = x + dx * cos(yaw) - dy * sin(yaw)
                thing.y_mm = y + dx * sin(yaw) + dy * cos(yaw)
                thing.z_mm, thing.yaw = z + dz, yaw + turn

    # --- hand ---

    def between(self) -> Thing | None:
        """The part between the pads."""
        x, y, z, _ = self.pads
        near = [
            thing
            for thing in self.things
            if hypot(thing.x_mm - x, thing.y_mm - y) <= REACH_MM
            and abs(thing.z_mm - z) <= self._height(thing)
        ]
        return min(near, key=lambda thing: hypot(thing.x_mm - x, thing.y_mm - y), default=None)

    def _height(self, thing: Thing) -> float:
        return max(REACH_MM, max(self.database.sizes[thing.object]) / 2)

    def _width(self, thing: Thing) -> float:
        """The widest pair of faces that lies between the pads as they are: that is how the part lies."""
        fitting = [size for size in self.database.sizes[thing.object] if size <= self.opening_mm + 1e-9]
        return max(fitting, default=0.0)

    def _close(self, order: Values | None) -> None:
        if order is None or self.faults.hand_stuck:
            return
        drive, opening, force, speed = (float(value) for value in order)
        self._slip()
        if not drive:
            return
        if self.faults.jammed:
            self.force_n = force
            return
        thing = self.between()
        least = self._width(thing) if thing is not None else 0.0
        before, far = self.opening_mm, speed * CYCLE_S
        wanted = max(before - far, min(before + far, opening))
        self.opening_mm = max(wanted, least) if wanted < before else wanted
        touching = self.opening_mm <= least + 1e-9 and opening < least
        self.force_n = force if touching or self.opening_mm <= 0.0 else 0.0
        for one in self.things:
            self._hold(one, touching and one is thing)

    def _hold(self, thing: Thing, held: bool) -> None:
        if held and not thing.held:
            x, y, z, yaw = self.pads
            dx, dy = thing.x_mm - x, thing.y_mm - y
            self._offset = (
                dx * cos(yaw) + dy * sin(yaw),
                dy * cos(yaw) - dx * sin(yaw),
                thing.z_mm - z,
                thing.yaw - yaw,
            )
        thing.held = held

    def _slip(self) -> None:
        if self.faults.slips:
            for thing in self.things:
                thing.held = False

    # --- camera ---

    def _look(self, tick: int, order: Values | None) -> None:
        if order is None:
            return
        number, fire, wanted = (int(value) for value in order)
        if number != self._asked[0]:
            self._asked = (number, fire, wanted, tick)
        if (
            not self.faults.dark
            and self._asked[1] != DARK
            and self._picture[0] != self._asked[0]
            and tick - self._asked[3] >= PICTURE_TICKS
        ):
            self._picture = self._seen(*self._asked[:3])

    def _seen(self, number: int, fire: int, wanted: int) -> tuple[Value, ...]:
        """What the image processing says: the part nearest below the camera with the top that was asked for."""
        x, y, z = self.plate[:3]
        size = self.database.sizes.get(wanted, (0.0, 0.0, 0.0))
        alike = [
            thing
            for thing in self.things
            if self.database.sizes[thing.object][:2] == size[:2]
            and hypot(thing.x_mm - x, thing.y_mm - y) < 250.0
        ]
        thing = min(alike, key=lambda one: hypot(one.x_mm - x, one.y_mm - y), default=None)
        if thing is None or self.faults.blind:
            return (number, False, 0.0, 0.0, 1.0, 0.0, 0.0, False)
        top = thing.z_mm + self.database.sizes[thing.object][2] / 2
        assumed = z - size[2] if fire == FLOOD else z - top
        _, _, _, yaw = self.pads
        turn = thing.yaw - yaw
        return (
            number,
            True,
            thing.x_mm - x,
            thing.y_mm - y,
            cos(turn),
            sin(turn),
            assumed,
            not self.faults.tilted,
        )


def world(database: Database) -> World:
    """The world as a run begins: parts as the database has them, the robot at home."""
    things = [
        Thing(
            part.object,
            part.x_mm,
            part.y_mm,
            part.z_mm + database.sizes[part.object][2] / 2,
            radians(part.yaw_deg),
        )
        for part in database.parts
    ]
    return World(database, [float(value) for value in database.home], things)
