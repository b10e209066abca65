"""A mechanism without physics as it looks in space: by the MuJoCo model that physics would move; `rcsc.run.plant.space.Space`."""

import copy
from collections.abc import Sequence

import mujoco
import numpy as np

from rcsc.run.plant.models.space import ModelSpace
from rcsc.run.plant.space import Shape
from rcsc_cell.cell.mujoco_model import Body, mjcf
from rcsc_cell.cell.plant import Mechanism
from rcsc_cell.database.ask import Database


class MechanismSpace:
    """The scene of a mechanism without physics: the model that physics would move, posed as the mechanism says.

    Args:
        mechanism: What says it.
        database: Of the cell.
        bodies: The parts.
    """

    def __init__(self, mechanism: Mechanism, database: Database, bodies: Sequence[Body]) -> None:
        self.mechanism = mechanism
        model = mujoco.MjModel.from_xml_string(mjcf(database, bodies))
        self._shown = ModelSpace(model, mujoco.MjData(model))
        self._put()

    def of(self, mechanism: Mechanism) -> "MechanismSpace":
        """Return the scene of a copy of the mechanism; the model is shared."""
        other = copy.copy(self)
        other.mechanism = mechanism
        return other

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that can move."""
        return self._shown.bodies

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes of the model."""
        return self._shown.shapes

    def poses(self) -> list[float]:
        """Return the poses, seven numbers a body."""
        self._put()
        return self._shown.poses()

    def _put(self) -> None:
        model, data = self._shown.model, self._shown.data
        data.qpos[:6] = self.mechanism.joints()
        opening_mm, _ = self.mechanism.hand()
        for side in ("left", "right"):
            data.qpos[model.joint(f"finger_{side}").qposadr[0]] = opening_mm / 2000
        for side, gap_mm in zip(("right", "left"), self.mechanism.jaws(), strict=True):
            joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"jaw_{side}")
            if joint >= 0:
                data.qpos[model.jnt_qposadr[joint]] = gap_mm / 1000
        for at, pose in enumerate(self.mechanism.parts()):
            first = model.joint(f"part{at}").qposadr[0]
            data.qpos[first : first + 3] = np.array(pose.at_mm) / 1000
            mujoco.mju_mat2Quat(data.qpos[first + 3 : first + 7], np.array(pose.turn).ravel())
        mujoco.mj_kinematics(model, data)
