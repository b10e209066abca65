"""A MuJoCo model as it looks in space: its shapes, and where its bodies are; `rcsc.run.plant.space.Space`.

In: a model and its data. Out: shapes of the groups that are drawn, and poses. Nothing here moves what the levels control.
"""

from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from rcsc.run.plant.space import FIXED, Mesh, Shape, ShapeKind

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
    """A view of a model and its data.

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
        """Return the poses, seven numbers a body."""
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
