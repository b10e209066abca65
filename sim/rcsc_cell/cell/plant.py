"""The plant below the levels: controllers of robot, hand, camera and vise, over a mechanism that is physics or kinematics.

The controllers are the same for both: only the mechanisms differ. Buffers in: orders of PRIMITIVE, the
gripper's level, vision and the workstation. Buffers out: what robot, hand, camera and vise report.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, nan, pi, sin
from typing import Any, Literal, Protocol, get_type_hints

import numpy as np

from rcsc.base.host.files.plain import alike, plain, read
from rcsc.run.plant.space import Space
from rcsc.run.signature import Value, Values
from rcsc_cell.cell.arm import Joints, plate
from rcsc_cell.cell.faults import GRADES, USUAL, Faults
from rcsc_cell.cell.fixture import MachineController, ViseController
from rcsc_cell.cell.robot import FOLLOW, Robot
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import Pose, nine
from rcsc_cell.vision.flood import Features, FoundPart
from rcsc_cell.vision.line import Surface
from rcsc_cell.workstation.orders import MACHINE_ORDER, MACHINE_REPORT, VISE_ORDER, VISE_REPORT

CYCLE_S = 0.04
EMPTY_MM = 95.0
"""Between the pads at first."""
JAWS_MM = 20.0
"""How far the jaws are open at first."""
PICTURE_TICKS = 3
"""From the flash to what the image processing says."""
DARK, FLOOD, LINE = 0, 1, 2
WIDE_MM = 120.0
TILT_RAD = 20.0 * pi / 180.0
"""By how much a surface that is tilted by a fault leans."""
RANGE_MM, ASIDE_MM = 2000.0, 500.0
"""The declared ranges of what vision says, in tables/vocabulary.rcs."""
WEAK_MM = 6.0
"""How far from what it closes on a weak jaw stops."""
NO_NORMAL = (0.0, 0.0, 0.0)
NO_PICTURE: tuple[Value, ...] = (False, 0.0, 0.0, 1.0, 0.0, 0.0, *NO_NORMAL)

CONTROLLERS = ("robot", "vise", "machine", "_grip", "_asked", "_picture", "_developing")
"""What a plant remembers from one cycle to the next, beside its mechanism."""

Latest = Callable[[str], Values | None]


@dataclass(frozen=True, slots=True)
class _Words:
    state: int
    inc: int


@dataclass(frozen=True, slots=True)
class Noise:
    """The state of a generator of noise, as numpy has it."""

    bit_generator: Literal["PCG64"]
    state: _Words
    has_uint32: Literal[0, 1]
    uinteger: int


def noise_of(rng: np.random.Generator) -> Noise:
    """Return the generator's state."""
    noise: Noise = read(Noise, dict(rng.bit_generator.state))
    return noise


def put_noise(rng: np.random.Generator, noise: Noise) -> None:
    """Put a generator into a state.

    Raises:
        ValueError: The generator has no such state.
    """
    try:
        rng.bit_generator.state = plain(noise)
    except OverflowError as error:
        raise ValueError("the state is of no noise") from error


@dataclass(frozen=True, slots=True)
class Grip:
    """The order to the fingers: toward an opening, with at most a force; `drive` is false where they are to stay."""

    drive: bool
    opening_mm: float
    force_n: float
    speed_mm_s: float


REST = Grip(False, 0.0, 0.0, 0.0)
DROP = Grip(True, WIDE_MM, 400.0, 300.0)


class Mechanism(Protocol):
    """The moving things of the cell."""

    faults: Faults

    def joints(self) -> Joints:
        """Return the joints as they are, in radians."""
        ...

    def hand(self) -> tuple[float, float]:
        """Return the distance between the pads, in mm, and the force on them, in N."""
        ...

    def jaws(self) -> tuple[float, float]:
        """Return the vise's right and left jaw, in mm from where they touch a part."""
        ...

    def advance(self, goal: Joints, grip: Grip, jaws_mm: tuple[float, float]) -> None:
        """Run one cycle: the joints go to the goal in equal steps, fingers and jaws to their own."""
        ...

    def flood(self, wanted: Features, expected_mm: float) -> FoundPart | None:
        """Take a flood picture, and find a part in it; None where none matches."""
        ...

    def lines(self, expected_mm: float) -> Surface | None:
        """Take a picture with two lines, and measure a surface; None where the lines do not fall on one."""
        ...

    def parts(self) -> tuple[Pose, ...]:
        """Return the true poses of the parts: for those who judge a run, never for those who control it."""
        ...

    def state(self) -> dict[str, Any]:
        """Return all that the next cycle depends on, in plain values."""
        ...

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state of the same cell; raise ValueError where it is of another."""
        ...

    def touching(self) -> frozenset[tuple[str, str]]:
        """Return the pairs that touched in the last cycle, by the names of the things, in order: for those who judge."""
        ...

    def space(self) -> Space:
        """Return the scene: for those who watch."""
        ...


@dataclass(slots=True)
class Plant:
    """Controllers over a mechanism; stands outside the levels.

    Attributes:
        objects: What each part is, by its number in the tables.
    """

    database: Database
    mechanism: Mechanism
    robot: Robot
    objects: tuple[int, ...]
    vise: ViseController = field(default_factory=ViseController)
    machine: MachineController = field(default_factory=MachineController)
    _grip: Grip = REST
    _asked: tuple[int, int] = (0, 0)
    _picture: tuple[Value, ...] = (0, *NO_PICTURE)
    _developing: tuple[Value, ...] = (0, *NO_PICTURE)

    @property
    def faults(self) -> Faults:
        """The faults of the mechanism."""
        return self.mechanism.faults

    @property
    def grades(self) -> Mapping[str, tuple[float, float]]:
        """The strengths of those faults that are no yes or no."""
        return GRADES

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on, with its usual strength, or off."""
        self.faults.set(fault, USUAL.get(fault, 1.0) if on else 0.0)

    def grade(self, fault: str, strength: float) -> None:
        """Switch a fault on, with a strength."""
        self.faults.set(fault, strength)

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one cycle of everything."""
        self._command(latest("primitive.to_robot"))
        right, left = self.mechanism.jaws()
        to_right, to_left, vise = self.vise.step(latest(VISE_ORDER), right, left)
        if self.faults.vise_weak:  # it closes no farther than that, and is not pushed out by it
            to_right = max(to_right, min(right, WEAK_MM))
        machine = self.machine.step(latest(MACHINE_ORDER), right, left)
        grip = self._grasp(latest("gripper.to_hand"))
        self.mechanism.advance(self.robot.joints, grip, (to_right, to_left))
        self._look(tick, latest("vision.to_camera"))
        opening_mm, force_n = self.mechanism.hand()
        fixture = {} if self.faults.vise_mute else {VISE_REPORT: vise, MACHINE_REPORT: machine}
        return {
            "robot.report": self.robot.report(self._measured()),
            "hand.report": (opening_mm, self._grip.force_n if self.faults.jammed else force_n),
            "camera.picture": self._picture,
        } | fixture

    @property
    def plate(self) -> tuple[float, ...]:
        """The nine numbers of the wrist plate's true pose."""
        return nine(plate(self.mechanism.joints()))

    def space(self) -> Space:
        """Return the scene of the cell."""
        return self.mechanism.space()

    # --- put back after a stop ---

    def state(self) -> dict[str, Any]:
        """Return controllers and mechanism in plain values, without faults."""
        return {name: plain(getattr(self, name)) for name in CONTROLLERS} | {
            "mechanism": self.mechanism.state()
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state of the same cell.

        Raises:
            ValueError: The state is of another cell, or of none.
        """
        if set(state) != {*CONTROLLERS, "mechanism"}:
            raise ValueError("not the state of a plant")
        hints = get_type_hints(Plant)
        held = {name: read(hints[name], state[name]) for name in CONTROLLERS}
        strange = [name for name, value in held.items() if not alike(getattr(self, name), value)]
        if strange:
            raise ValueError(f"not the state of the plant's `{strange[0]}`")
        self.mechanism.restore(state["mechanism"])
        for name, value in held.items():
            setattr(self, name, value)

    # --- robot and hand ---

    def _measured(self) -> Joints:
        joints = self.mechanism.joints()
        return (nan, *joints[1:]) if self.faults.unreadable else joints

    def _command(self, order: Values | None) -> None:
        if order is not None and self.faults.robot_refuses and int(order[1]) == FOLLOW:
            self.robot.refuse(int(order[0]), FOLLOW, self.mechanism.joints())
        else:
            self.robot.order(order, self._measured())

    def _grasp(self, order: Values | None) -> Grip:
        if order is not None:
            drive, opening, force, speed = order
            self._grip = Grip(bool(drive), float(opening), float(force), float(speed))
        return DROP if self.faults.drops else self._grip

    # --- camera ---

    def _look(self, tick: int, order: Values | None) -> None:
        """Take a flash at once; report what it shows some cycles later."""
        if order is not None and int(order[0]) != self._asked[0]:
            self._asked = (int(order[0]), tick)
            self._developing = (int(order[0]), *self._shot(int(order[1]), int(order[2])))
        ready = tick - self._asked[1] >= PICTURE_TICKS + self.faults.late_ticks
        if ready and not self.faults.dark:
            self._picture = self._developing

    def _shot(self, fire: int, wanted: int) -> tuple[Value, ...]:
        """Return the picture: matched, x, y, cosine and sine of the turn, range, the surface's normal in camera axes."""
        expected_mm = float(self.database.part(wanted)[1])
        if self.faults.blind or fire == DARK or expected_mm <= 0.0:
            return NO_PICTURE
        if fire == FLOOD:
            part = self._find(wanted, expected_mm)
            return NO_PICTURE if part is None else (True, *self._in_hand(part), *NO_NORMAL)
        surface = self.mechanism.lines(expected_mm)
        if surface is None:
            return NO_PICTURE
        x, y, z = surface.normal
        if self.faults.tilted:
            x, z = x * cos(TILT_RAD) + z * sin(TILT_RAD), z * cos(TILT_RAD) - x * sin(TILT_RAD)
        return (
            True,
            0.0,
            0.0,
            1.0,
            0.0,
            min(RANGE_MM, surface.range_mm),
            *(max(-1.0, min(1.0, n)) for n in (x, y, z)),
        )

    def _find(self, wanted: int, expected_mm: float) -> FoundPart | None:
        """Return the part as the camera sees it; None where it sees none, or cannot look."""
        size = self.database.sizes.get(wanted)
        if size is None or min(size) <= 0.0:
            return None
        return self.mechanism.flood(Features(size[0], size[1]), expected_mm)

    def _in_hand(self, part: FoundPart) -> tuple[float, float, float, float, float]:
        """Convert camera coordinates to the hand's: along the plate's x, to its left, and a turn about the vertical.

        By that turn the plate's x comes to lie along the part's long side. The camera's picture has the plate's y to the right and
        its x up, and the hand looks down: its left is the picture's left.
        """
        camera_x, camera_y, _ = self.database.hand.camera_mm
        x = camera_x + part.y_mm + self.faults.shifted_mm
        y = -(camera_y + part.x_mm)
        turn = atan2(-cos(part.roll_rad), sin(part.roll_rad))
        turn -= pi * round(turn / pi)
        far = max(-ASIDE_MM, min(ASIDE_MM, x)), max(-ASIDE_MM, min(ASIDE_MM, y))
        return (*far, cos(turn), sin(turn), min(RANGE_MM, part.range_mm))
