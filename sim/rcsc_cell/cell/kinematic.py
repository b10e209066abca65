"""The mechanism as kinematics: no forces, no friction; some twenty times cheaper than physics, for episodes by the thousand.

A part lies where it was put, moves with the hand that closed on it, and stays where the hand lets go of it: in a fixture as it is, in the
air it falls. A test holds this mechanism to the same statuses as physics over the same scripts.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from rcsc.base.host.files.plain import finite, plain, read
from rcsc_cell.cell.arm import Joints, plate
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.mujoco_model import GAIN_N_M, OPEN_MM, Body
from rcsc_cell.cell.plant import CYCLE_S, EMPTY_MM, JAWS_MM, Grip, Noise, noise_of, put_noise
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import Pose, Rotation, Vector, apply, cross, dot, minus, transposed, unit
from rcsc_cell.vision.flood import Features, FoundPart
from rcsc_cell.vision.formulas import Top, perceive, perceive_surface
from rcsc_cell.vision.line import Surface
from rcsc_cell.vision.optics import NOISY, STANDARD, Optics

if TYPE_CHECKING:
    from rcsc_cell.cell.space import MechanismSpace

JAW_MM_S = 100.0
PAD_WIDTH_MM = 24.0
LINE_MM = 60.0
"""How far from the expected range the lines are looked for; the image processing's own limit is in `rcsc_cell.vision.line`."""
REST_MM = 40.0
"""A part whose lowest point is less above a fixture's station lies in the fixture."""
UPRIGHT: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class _State:
    """The state that the next cycle depends on, without faults."""

    joints: Joints
    poses: list[Pose]
    opening_mm: float
    force_n: float
    jaws_mm: tuple[float, float]
    held: int | None
    in_hand: Pose
    noise: Noise


class Kinematic:
    """Arm, hand, vise and parts by geometry alone.

    Args:
        database: The cell.
        bodies: The parts.
        start: The joints at first, in radians.
        seed: Of the sensor's noise.
    """

    def __init__(self, database: Database, bodies: Sequence[Body], start: Joints, seed: int = 0) -> None:
        self.database, self.bodies = database, tuple(bodies)
        self._vise = next((station for station in database.stations.values() if station.vise), None)
        self._space: MechanismSpace | None = None
        self.faults = Faults()
        self._joints = start
        self._poses = [Pose(body.turn, body.at_mm) for body in self.bodies]
        self._opening_mm, self._force_n = EMPTY_MM, 0.0
        self._jaws_mm = (JAWS_MM, JAWS_MM)
        self._held: int | None = None
        self._in_hand = Pose(UPRIGHT, (0.0, 0.0, 0.0))
        self._touching: frozenset[tuple[str, str]] = frozenset()
        self._rng = np.random.default_rng(seed)

    def __deepcopy__(self, memo: dict[int, object]) -> "Kinematic":
        """Copy it; the copy goes on by itself with the same database."""
        other = copy.copy(self)
        other.faults, other._poses = replace(self.faults), list(self._poses)  # noqa: SLF001  # its own class
        other._space = None if self._space is None else self._space.of(other)  # noqa: SLF001  # likewise
        other._rng = copy.deepcopy(self._rng, memo)  # noqa: SLF001  # likewise
        return other

    # --- readings ---

    def joints(self) -> Joints:
        """Return the joints as they are, in radians."""
        return self._joints

    def hand(self) -> tuple[float, float]:
        """Return the distance between the pads, in mm, and the force on them, in N."""
        return self._opening_mm, self._force_n

    def jaws(self) -> tuple[float, float]:
        """Return the right and the left jaw, in mm from where they touch a part."""
        return self._jaws_mm

    def parts(self) -> tuple[Pose, ...]:
        """Return the true poses of the parts: for those who judge a run."""
        return tuple(self._poses)

    def touching(self) -> frozenset[tuple[str, str]]:
        """Return the contact of the hand with the part that it holds, the only one of kinematics."""
        return self._touching

    def space(self) -> "MechanismSpace":
        """Return the scene: the model that physics would move, with everything where it is now."""
        from rcsc_cell.cell.space import MechanismSpace  # MuJoCo is loaded only where somebody looks

        if self._space is None:
            self._space = MechanismSpace(self, self.database, self.bodies)
        return self._space

    # --- put back after a stop ---

    def state(self) -> dict[str, Any]:
        """Return all that the next cycle depends on but faults, in plain values."""
        state: dict[str, Any] = plain(_State(
            self._joints, self._poses, self._opening_mm, self._force_n, self._jaws_mm, self._held,
            self._in_hand, noise_of(self._rng),
        ))  # fmt: skip
        return state

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state of the same cell.

        Raises:
            ValueError: The state is of another cell.
        """
        held: _State = read(_State, state)
        if len(held.poses) != len(self.bodies) or not 0 <= (held.held or 0) < max(1, len(self.bodies)):
            raise ValueError("the state is of a cell with other parts")
        if len(held.joints) != len(self._joints) or not finite(state):
            raise ValueError("the state is of another arm")
        put_noise(self._rng, held.noise)
        self._joints, self._poses, self._in_hand = held.joints, held.poses, held.in_hand
        self._opening_mm, self._force_n = held.opening_mm, held.force_n
        self._jaws_mm, self._held = held.jaws_mm, held.held

    # --- one cycle ---

    def advance(self, goal: Joints, grip: Grip, jaws_mm: tuple[float, float]) -> None:
        """Run one cycle: the joints go to the goal, a held part goes with them; then the fingers and the jaws move."""
        self._move(goal)
        self._close(grip)
        if not self.faults.vise_stuck:
            self._clamp(jaws_mm)
        held = self._held
        pads = () if held is None else ("pad_left", "pad_right")
        self._touching = frozenset((pad, f"part{held}") for pad in pads)

    def _move(self, goal: Joints) -> None:
        was, self._joints = self._joints, self.faults.reachable(self._joints, goal)
        self._pads = plate(self._joints) @ Pose(UPRIGHT, (0.0, 0.0, self.database.hand.tool_mm))
        if self._held is not None:
            if self.faults.slips and self._joints != was:
                # as far as the motor springs
                self._opening_mm = max(0.0, self._opening_mm - 1000 * self._force_n / GAIN_N_M)
                self._let_go()
            else:
                self._poses[self._held] = self._pads @ self._in_hand

    # --- hand ---

    def between(self) -> int | None:
        """Return the part between the pads; None where there is none, or the fingers stand on it."""
        for at, (body, pose) in enumerate(zip(self.bodies, self._poses, strict=True)):
            across, along, deep = (_extent(body, pose, self._pads.axis(axis)) for axis in (1, 0, 2))
            x, y, z = self._pads.inside(pose.at_mm)
            reaches = abs(x) < along / 2 + PAD_WIDTH_MM / 2 and abs(z) < deep / 2 + self.database.hand.pad_mm
            if reaches and abs(y) <= max(0.0, self._opening_mm - across) / 2 + 1.0:
                return at
        return None

    def _close(self, grip: Grip) -> None:
        if self.faults.hand_stuck or not grip.drive:
            return
        part = self.between()
        least = 0.0 if part is None else _extent(self.bodies[part], self._poses[part], self._pads.axis(1))
        far, before = grip.speed_mm_s * CYCLE_S, self._opening_mm
        wanted = max(before - far, min(before + far, grip.opening_mm))
        self._opening_mm = min(OPEN_MM, max(wanted, least) if wanted < before else wanted)
        met = (grip.opening_mm < least and self._opening_mm <= least) or self._opening_mm <= 0.0
        self._force_n = grip.force_n * self.faults.motor if met else 0.0
        if part is not None and met:
            self._hold(part)
        elif self._held is not None and self._opening_mm > least:
            self._let_go()

    def _hold(self, part: int) -> None:
        """Hold a part: the fingers turn it square to them and bring it to their middle."""
        if self._held == part:
            return
        self._held = part
        pose = self._poses[part]
        square = _square(pose.turn, self._pads.axis(1))
        x, _, z = self._pads.inside(pose.at_mm)
        held = Pose(square, self._pads.point((x, 0.0, z)))
        self._poses[part] = held
        self._in_hand = self._pads.inverse() @ held

    def push(self, part: int, x_mm: float, y_mm: float) -> None:
        """Push a part that nobody holds."""
        if part != self._held:
            x, y, z = self._poses[part].at_mm
            self._poses[part] = replace(self._poses[part], at_mm=(x + x_mm, y + y_mm, z))

    def _let_go(self) -> None:
        part, self._held, self._force_n = self._held, None, 0.0
        if part is None:
            return
        body, pose = self.bodies[part], self._poses[part]
        station = self.database.station_below(pose.at_mm)
        floor = 0.0 if station is None else station.frame.at_mm[2]
        low = body.lowest_mm(pose)
        in_fixture = station is not None and (station.vise or station.vblock) and low - floor < REST_MM
        if not in_fixture:
            x, y, _ = pose.at_mm
            height = _extent(body, pose, (0.0, 0.0, 1.0))
            self._poses[part] = Pose(_square(pose.turn, (0.0, 0.0, 1.0)), (x, y, floor + height / 2))

    # --- vise ---

    def _clamp(self, wanted_mm: tuple[float, float]) -> None:
        """Move the jaws to their goals, as far as a part between them lets them."""
        part = self._in_vise()
        stops = (0.0 if part is not None else -6.0, 0.0)
        far = JAW_MM_S * CYCLE_S
        right, left = (
            max(stop, before + max(-far, min(far, wanted - before)))
            for before, wanted, stop in zip(self._jaws_mm, wanted_mm, stops, strict=True)
        )
        self._jaws_mm = (right, left)
        if part is not None and right == left == 0.0 and self._vise is not None:
            pose = self._poses[part]
            _, y, z = self._vise.frame.inside(pose.at_mm)
            self._poses[part] = replace(pose, at_mm=self._vise.frame.point((0.0, y, z)))

    def _in_vise(self) -> int | None:
        if self._vise is None:
            return None
        half, bed = float(self._vise.vise["between_mm"]) / 2, float(self._vise.vise["bed_mm"][2])
        for at, pose in enumerate(self._poses):
            x, y, z = self._vise.frame.inside(pose.at_mm)
            if abs(x) < half / 2 and abs(y) < half and bed < z < bed + half:
                return at
        return None

    # --- camera ---

    def flood(self, wanted: Features, expected_mm: float) -> FoundPart | None:
        """Find the part as image processing would in a flood picture."""
        return perceive(self._tops(), wanted, expected_mm, self._rng, self._optics())

    def lines(self, expected_mm: float) -> Surface | None:
        """Measure the top below from a picture with two lines, if the lines fall on it where they are looked for."""
        tops = [top for top in self._tops() if abs(top.range_mm - expected_mm) < LINE_MM]
        below = min(tops, key=lambda top: hypot(top.x_mm, top.y_mm), default=None)
        return None if below is None else perceive_surface(below, self._rng, self._optics())

    def _optics(self) -> Optics:
        return NOISY if self.faults.noisy else STANDARD

    def _tops(self) -> tuple[Top, ...]:
        """Return the upper faces of all parts in camera axes: x to the right is the plate's y, y up its x, and z back along the tool."""
        here = plate(self._joints)
        camera = Pose(
            transposed((here.axis(1), here.axis(0), _back(here.axis(2)))),
            here.point(self.database.hand.camera_mm),
        )
        return tuple(_top(body, pose, camera) for body, pose in zip(self.bodies, self._poses, strict=True))


def _back(v: Vector) -> Vector:
    return (-v[0], -v[1], -v[2])


def _top(body: Body, pose: Pose, camera: Pose) -> Top:
    """Return the uppermost face of a part."""
    ups = [pose.axis(axis)[2] for axis in range(3)]
    up = max(range(3), key=lambda at: abs(ups[at]))
    sign = 1.0 if ups[up] > 0 else -1.0
    along, across = (up + 1) % 3, (up + 2) % 3
    offset: list[float] = [0.0, 0.0, 0.0]
    offset[up] = sign * body.size_mm[up] / 2
    x, y, z = camera.inside(pose.point((offset[0], offset[1], offset[2])))
    to_camera = transposed(camera.turn)
    side, facing = apply(to_camera, pose.axis(along)), apply(to_camera, pose.axis(up))
    normal = (sign * facing[0], sign * facing[1], sign * facing[2])
    return Top(x, y, -z, body.size_mm[along], body.size_mm[across], atan2(side[1], side[0]), normal)


def _extent(body: Body, pose: Pose, along: Vector) -> float:
    """Return a part's width between fingers that close along a direction: they turn it square first."""
    sides = [abs(dot(pose.axis(axis), along)) for axis in range(3)]
    return body.size_mm[sides.index(max(sides))]


def _square(turn: Rotation, along: Vector) -> Rotation:
    """Return the nearest turn with an axis along the direction."""
    axes = list(transposed(turn))
    leans = [dot(axis, along) for axis in axes]
    first = max(range(3), key=lambda at: abs(leans[at]))
    aligned = along if leans[first] > 0 else (-along[0], -along[1], -along[2])
    second = axes[(first + 1) % 3]
    lean = dot(second, aligned)
    across = unit(minus(second, (lean * aligned[0], lean * aligned[1], lean * aligned[2])))
    normal = cross(aligned, across)
    rows: list[Vector] = [aligned, aligned, aligned]
    rows[first], rows[(first + 1) % 3], rows[(first + 2) % 3] = aligned, across, normal
    return transposed((rows[0], rows[1], rows[2]))
