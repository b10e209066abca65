"""The mechanism as physics: MuJoCo moves arm, fingers, jaws and parts, and parts by contact forces only.

What would be cheating is not here: no weld, no pose of a part written after the first cycle, no adhesion, no gravity switched off for
a part; and the image processing is given pictures, never a pose. tests/cell/test_honest.py looks.
"""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import mujoco
import numpy as np

from rcsc.base.host.files.plain import finite, plain, read
from rcsc.run.plant.models.space import ModelSpace
from rcsc_cell.cell.arm import Joints
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.mujoco_model import GAIN_N_M, STEP_S, Body, mjcf
from rcsc_cell.cell.plant import CYCLE_S, EMPTY_MM, JAWS_MM, Grip, Noise, noise_of, put_noise
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import Pose, Rotation, Vector
from rcsc_cell.vision.camera import Camera
from rcsc_cell.vision.flood import Features, FoundPart, find
from rcsc_cell.vision.line import Surface, measure
from rcsc_cell.vision.optics import NOISY, STANDARD, Optics

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
SLIPPERY = 0.002
"""Half a kilogram between pads that push 445 N each slips below 0.006."""
CLOSED_MM = 0.5
"""Fingers that are closer touch each other: what their motor pushes is what they push on each other."""


@dataclass(frozen=True, slots=True)
class _State:
    """The state that the next cycle depends on, without faults."""

    physics: list[float]
    goal: Joints
    setpoint_m: float
    jaws_mm: tuple[float, float]
    noise: Noise


class Physical:
    """Arm, hand, vise and parts in MuJoCo.

    Args:
        database: The cell.
        bodies: The parts.
        start: The joints at first, in radians.
        seed: Of the sensor's noise.
        step_s: One step of physics.
    """

    def __init__(
        self,
        database: Database,
        bodies: Sequence[Body],
        start: Joints,
        seed: int = 0,
        step_s: float = STEP_S,
    ) -> None:
        self.database, self.bodies = database, tuple(bodies)
        self.model = mujoco.MjModel.from_xml_string(mjcf(database, bodies, step_s))
        self.data = mujoco.MjData(self.model)
        self.faults = Faults()
        self._cameras: dict[Optics, Camera] = {}
        self._steps = round(CYCLE_S / step_s)
        self._pads = [self.model.geom(f"pad_{side}").id for side in ("left", "right")]
        self._friction = float(self.model.geom_friction[self._pads[0], 0])
        self._fingers = [self.model.joint(f"finger_{side}").qposadr[0] for side in ("left", "right")]
        self._jaws = [self.model.joint(f"jaw_{side}").qposadr[0] for side in ("right", "left")]
        self._felt = [self.model.sensor(f"pad_{side}").adr[0] for side in ("left", "right")]
        self._motor = self.model.sensor("hand").adr[0]
        self._named = [self.model.geom(at).name or "look" for at in range(self.model.ngeom)]
        self._goal, self._setpoint_m = start, EMPTY_MM / 1000
        self._rng = np.random.default_rng(seed)
        self.data.qpos[:6] = start
        self.data.qpos[self._fingers] = EMPTY_MM / 2000
        self.data.qpos[self._jaws] = JAWS_MM / 1000
        self._jaw_goal = (JAWS_MM, JAWS_MM)
        mujoco.mj_forward(self.model, self.data)

    def __deepcopy__(self, memo: dict[int, object]) -> "Physical":
        """Copy it; the copy goes on by itself with the same database."""
        other = copy.copy(self)
        other.model, other.data = copy.copy(self.model), copy.copy(self.data)
        other.faults, other._cameras = replace(self.faults), {}  # noqa: SLF001  # its own class
        other._rng = copy.deepcopy(self._rng, memo)  # noqa: SLF001  # likewise
        return other

    # --- readings ---

    def joints(self) -> Joints:
        """Return the joints as they are, in radians."""
        return tuple(self.data.qpos[:6].tolist())

    def hand(self) -> tuple[float, float]:
        """Return the distance between the pads, in mm, and the lesser of the forces on them, in N."""
        opening_mm = 1000.0 * float(self.data.qpos[self._fingers].sum())
        felt = self.data.sensordata
        force_n = min(float(np.linalg.norm(felt[at + 1 : at + 4])) for at in self._felt)
        if opening_mm < CLOSED_MM:
            force_n = max(force_n, abs(float(felt[self._motor])))
        return opening_mm, force_n

    def jaws(self) -> tuple[float, float]:
        """Return the right and the left jaw, in mm from where they touch a part."""
        right, left = self.data.qpos[self._jaws]
        return 1000.0 * float(right), 1000.0 * float(left)

    def parts(self) -> tuple[Pose, ...]:
        """Return the true poses of the parts: for those who judge a run."""
        return tuple(self._pose(f"part{at}") for at in range(len(self.bodies)))

    def _pose(self, name: str) -> Pose:
        body = self.data.body(name)
        rows = body.xmat.reshape(3, 3).tolist()
        turn: Rotation = (tuple(rows[0]), tuple(rows[1]), tuple(rows[2]))
        at: Vector = tuple((1000.0 * body.xpos).tolist())
        return Pose(turn, at)

    def touching(self) -> frozenset[tuple[str, str]]:
        """Return the pairs in contact, by the names of the geoms, in order."""
        pairs = self.data.contact.geom[self.data.contact.dist <= 0.0] if self.data.ncon else []
        return frozenset(
            (first, second) if first <= second else (second, first)
            for first, second in ((self._named[a], self._named[b]) for a, b in pairs)
        )

    def space(self) -> ModelSpace:
        """Return the scene."""
        return ModelSpace(self.model, self.data)

    # --- put back after a stop ---

    def state(self) -> dict[str, Any]:
        """Return all that the next cycle depends on but faults, in plain values."""
        held = np.empty(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, held, STATE)
        state = _State(held.tolist(), self._goal, self._setpoint_m, self._jaw_goal, noise_of(self._rng))
        return cast(dict[str, Any], plain(state))

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state of the same cell.

        Raises:
            ValueError: The state is of another cell.
        """
        held: _State = read(_State, state)
        if len(held.physics) != mujoco.mj_stateSize(self.model, STATE):
            raise ValueError("the state is of a cell with other parts")
        if len(held.goal) != len(self._goal) or not finite(state):
            raise ValueError("the state is of another arm")
        put_noise(self._rng, held.noise)
        mujoco.mj_setState(self.model, self.data, np.array(held.physics), STATE)
        mujoco.mj_forward(self.model, self.data)
        self._goal, self._setpoint_m, self._jaw_goal = held.goal, held.setpoint_m, held.jaws_mm

    # --- one cycle ---

    def advance(self, goal: Joints, grip: Grip, jaws_mm: tuple[float, float]) -> None:
        """Run one cycle: the joints go to the goal in equal steps, fingers and jaws to their own."""
        self._apply_faults()
        before, self._goal = self._goal, self.faults.reachable(self._goal, goal)
        a, b = np.array(before), np.array(self._goal)
        first, self._setpoint_m = self._setpoint_m, self._squeezed(grip)
        if not self.faults.vise_stuck:
            self._jaw_goal = jaws_mm
        ctrl = self.data.ctrl
        ctrl[1:12:2] = (b - a) / CYCLE_S
        ctrl[14], ctrl[13] = self._jaw_goal[0] / 1000, self._jaw_goal[1] / 1000
        for at in range(1, self._steps + 1):
            share = at / self._steps
            ctrl[0:12:2] = a + share * (b - a)
            ctrl[12] = first + share * (self._setpoint_m - first)
            mujoco.mj_step(self.model, self.data)
        # what is read belongs to the end of the cycle, not to the step before it
        mujoco.mj_forward(self.model, self.data)

    def _squeezed(self, grip: Grip) -> float:
        """Return the fingers' set point, in m: toward the opening at the speed, and no farther from where they are than the force.

        An opening of none is a grasp, and goes on until the force is met, though by fingers that meet each other. The motor is a
        spring of `GAIN_N_M`: the model stays as it is, whatever the force.
        """
        width_m = float(self.data.qpos[self._fingers].sum())
        if self.faults.hand_stuck or not grip.drive:
            # Fingers that are stuck on something go on pressing it.
            return width_m if self.faults.hand_stuck and self.hand()[1] <= 0.0 else self._setpoint_m
        give_m = grip.force_n * self.faults.motor / GAIN_N_M
        far_m = grip.speed_mm_s * CYCLE_S / 1000
        wanted_m = grip.opening_mm / 1000 if grip.opening_mm > 0 else width_m - give_m
        after = max(self._setpoint_m - far_m, min(self._setpoint_m + far_m, wanted_m))
        return max(width_m - give_m, min(width_m + give_m, after))

    def _apply_faults(self) -> None:
        self.model.geom_friction[self._pads, 0] = SLIPPERY if self.faults.slips else self._friction

    # --- camera ---

    def flood(self, wanted: Features, expected_mm: float) -> FoundPart | None:
        """Take a flood picture, and find a part in it."""
        camera, optics = self._camera()
        return find(camera.flood(self.data, self._rng), wanted, expected_mm, optics)

    def lines(self, expected_mm: float) -> Surface | None:
        """Take a picture with two lines, and measure the part's surface."""
        camera, optics = self._camera()
        return measure(camera.lines(self.data, self._rng), expected_mm, optics)

    def _camera(self) -> tuple[Camera, Optics]:
        optics = NOISY if self.faults.noisy else STANDARD
        if optics not in self._cameras:
            self._cameras[optics] = Camera(self.model, optics)
        return self._cameras[optics], STANDARD
