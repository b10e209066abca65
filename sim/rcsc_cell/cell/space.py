"""A MuJoCo model as it looks in space: its shapes, and where its bodies are; `rcsc.run.plant.space.Space`.

In: a model and its data, or a mechanism without physics, which is shown by a model of its own. Out: shapes of the groups that are drawn,
and poses. Nothing here moves what the levels control.
"""

import copy
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from rcsc.run.plant.space import FIXED, Mesh, Shape, ShapeKind
from rcsc_cell.cell.mujoco_model import Body, mjcf
from rcsc_cell.cell.plant import Mechanism
from rcsc_cell.database.ask import Database

DRAWN_GROUPS = (0, 1, 2)
"""Groups from 3 up are for collisions only."""
_KINDS: dict[int, ShapeKind] = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): "plane",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "ball",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}


class ModelSpace:
    """A model and its data, looked at.

    Args:
        model: An `MjModel`.
        data: Its `MjData`; what it holds when `poses` is asked is shown: after a step, where the step began.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self.model, self.data = model, data
        self._moving = np.flatnonzero(model.body_weldid != 0)
        self._place = {int(body): at for at, body in enumerate(self._moving)}

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that can move."""
        return tuple(self.model.body(int(body)).name for body in self._moving)

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The geoms of the groups that are drawn."""
        return tuple(
            self._shape(geom)
            for geom in range(self.model.ngeom)
            if int(self.model.geom_group[geom]) in DRAWN_GROUPS
            and int(self.model.geom_type[geom]) in _KINDS
            and self.model.geom_rgba[geom][3] > 0
        )

    def poses(self) -> list[float]:
        """Seven numbers a body."""
        both = np.concatenate((self.data.xpos[self._moving], self.data.xquat[self._moving]), axis=1)
        numbers: list[float] = both.ravel().tolist()
        return numbers

    def _shape(self, geom: int) -> Shape:
        model, body = self.model, int(self.model.geom_bodyid[geom])
        at, turn = model.geom_pos[geom], model.geom_quat[geom]
        place = self._place.get(body, FIXED)
        if place == FIXED:  # a body that is welded to the room: where it is now is where it stays
            at, turn = self.data.geom_xpos[geom], np.zeros(4)
            mujoco.mju_mat2Quat(turn, self.data.geom_xmat[geom])
        material = int(model.geom_matid[geom])
        colour = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
        kind = _KINDS[int(model.geom_type[geom])]
        x, y, z = (float(value) for value in at)
        a, b, c = (float(value) for value in model.geom_size[geom])
        qw, qx, qy, qz = (float(value) for value in turn)
        red, green, blue, opacity = (float(value) for value in colour)
        mesh = _mesh(model, int(model.geom_dataid[geom])) if kind == "mesh" else None
        name = str(model.geom(geom).name)
        return Shape(
            name, kind, (a, b, c), (red, green, blue, opacity), place, (x, y, z), (qw, qx, qy, qz), mesh
        )


def _mesh(model: Any, at: int) -> Mesh:
    first, many = int(model.mesh_vertadr[at]), int(model.mesh_vertnum[at])
    face, faces = int(model.mesh_faceadr[at]), int(model.mesh_facenum[at])
    return Mesh(
        tuple(model.mesh_vert[first : first + many].ravel().tolist()),
        tuple(model.mesh_face[face : face + faces].ravel().tolist()),
    )


class MechanismSpace:
    """A mechanism without physics, shown by the model that physics would move, put where the mechanism says that everything is.

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
        """Return the same for a copy of the mechanism; the model is shared."""
        other = copy.copy(self)
        other.mechanism = mechanism
        return other

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that can move."""
        return self._shown.bodies

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """As physics has them."""
        return self._shown.shapes

    def poses(self) -> list[float]:
        """Seven numbers a body."""
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
