"""Photographs what stands outside the levels: any `Space`, built again as a model without physics and drawn by MuJoCo's renderer.

In: a space, a size, a view. Out: pictures of poses, as red, green and blue. It needs an OpenGL that draws without a screen (EGL, OSMesa).
"""

import importlib
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from rcsc.run.plant.space import FIXED, Space

VIEWS = {"corner": (140.0, -27.0), "front": (180.0, -7.0), "left": (90.0, -7.0), "above": (90.0, -89.0)}
"""Where the eye looks to, by the name of the view: azimuth and elevation in degrees, as MuJoCo has them."""
NO_OPENGL = "nothing here draws without a screen: install libegl1 and libgl1-mesa-dri, or libosmesa6"
_KINDS = {
    "plane": mujoco.mjtGeom.mjGEOM_PLANE,
    "ball": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "mesh": mujoco.mjtGeom.mjGEOM_MESH,
}
IN_PICTURE, LEAST_M, PLACINGS = 0.92, 0.4, 8
"""The share of the picture that is filled; how near the eye comes; how often it is placed anew by what it saw."""
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_SKY = (0.93, 0.95, 0.97)


class NoPictureError(Exception):
    """A picture cannot be made here; the message says why."""


class Camera:
    """Photographs poses of a space.

    Args:
        space: What is photographed; its shapes are read once.
        width_px: Of a picture.
        height_px: Likewise.
        view: A name of `VIEWS`.
        within: Poses at which all is to be in the picture; at least one.

    Raises:
        NoPictureError: No OpenGL draws here without a screen.
    """

    def __init__(
        self, space: Space, width_px: int, height_px: int, view: str, within: Sequence[Sequence[float]]
    ) -> None:
        self._model = _spec(space, width_px, height_px).compile()
        self._data = mujoco.MjData(self._model)
        self._opengl = _opengl(width_px, height_px)
        self._drawer = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawer)
        self._scene = mujoco.MjvScene(self._model, maxgeom=2 * self._model.ngeom + 100)
        self._option, self._size = mujoco.MjvOption(), mujoco.MjrRect(0, 0, width_px, height_px)
        self._eye = self._placed(view, within)

    def picture(self, poses: Sequence[float]) -> npt.NDArray[np.uint8]:
        """Return the picture of these poses, seven numbers a body: rows from the top, columns, red green blue."""
        self._pose(poses)
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, self._option, None, self._eye, every, self._scene)
        picture = np.empty((self._size.height, self._size.width, 3), dtype=np.uint8)
        mujoco.mjr_render(self._size, self._scene, self._drawer)
        mujoco.mjr_readPixels(picture, None, self._size, self._drawer)
        return np.flipud(picture)

    def close(self) -> None:
        """Let the renderer go."""
        self._drawer.free()
        self._opengl.free()

    def _pose(self, poses: Sequence[float]) -> None:
        both = np.asarray(poses, dtype=float).reshape(-1, 7)
        self._data.mocap_pos[:], self._data.mocap_quat[:] = both[:, :3], both[:, 3:]
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)

    def _placed(self, view: str, within: Sequence[Sequence[float]]) -> Any:
        """The eye, as near as it sees at all these poses whatever has an end."""
        corners = np.concatenate([self._corners(poses) for poses in within])
        eye = mujoco.MjvCamera()
        eye.azimuth, eye.elevation = VIEWS[view]
        turn, rise = np.radians(eye.azimuth), np.radians(eye.elevation)
        ahead = np.array((np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)))
        right = np.array((np.sin(turn), -np.cos(turn), 0.0))
        over = np.tan(np.radians(self._model.vis.global_.fovy) / 2) * IN_PICTURE
        reach = np.array((over * self._size.width / self._size.height, over))
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        for _ in range(PLACINGS):
            beside = (corners - middle) @ np.stack((right, np.cross(right, ahead)), axis=1)
            depth = (corners - middle) @ ahead
            eye.distance = max(LEAST_M, float((np.abs(beside) / reach - depth[:, None]).max()))
            seen = beside / (eye.distance + depth)[:, None]
            off = (seen.min(axis=0) + seen.max(axis=0)) / 2 * eye.distance
            middle = middle + off[0] * right + off[1] * np.cross(right, ahead)
        eye.lookat[:] = middle
        return eye

    def _corners(self, poses: Sequence[float]) -> npt.NDArray[np.float64]:
        """The corners of the boxes round all that has an end, in the room."""
        self._pose(poses)
        ended = np.flatnonzero(self._model.geom_rbound > 0)
        boxes = self._model.geom_aabb[ended]
        at = boxes[:, None, :3] + _CORNERS * boxes[:, None, 3:]
        turns = self._data.geom_xmat[ended].reshape(-1, 3, 3)
        room = np.einsum("gij,gcj->gci", turns, at) + self._data.geom_xpos[ended][:, None]
        return np.asarray(room.reshape(-1, 3))


def _opengl(width_px: int, height_px: int) -> Any:
    """What draws without a screen, ready to draw.

    Raises:
        NoPictureError: Nothing does here.
    """
    for kind in ("egl", "osmesa"):
        try:
            found = importlib.import_module(f"mujoco.{kind}").GLContext(width_px, height_px)
            found.make_current()
        except Exception:  # noqa: BLE001, S112  # libraries that are not there fail in many ways
            continue
        return found
    raise NoPictureError(NO_OPENGL)


def _spec(space: Space, width_px: int, height_px: int) -> Any:
    """A model of the shapes, whose bodies go where they are put."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width_px, height_px
    spec.visual.quality.shadowsize = 2048
    spec.visual.map.shadowclip = 3.0  # the floor lies inside, else its edge is speckled
    spec.visual.headlight.ambient[:] = (0.47, 0.47, 0.47)
    spec.visual.headlight.diffuse[:] = (0.15, 0.15, 0.15)
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=_SKY, rgb2=_SKY, width=8, height=48,
    )  # fmt: skip
    room = spec.worldbody
    room.add_light(pos=(1.5, -2, 4), dir=(-1.5, 2, -4), type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=True,
                   diffuse=(0.48, 0.47, 0.44), specular=(0.1, 0.1, 0.1))  # fmt: skip
    bodies = [room.add_body(mocap=True) for _ in space.bodies]
    for number, shape in enumerate(space.shapes):
        size = list(shape.size_m)
        if shape.kind == "plane":
            size = [size[0], size[1], 1.0]
        more = {}
        if shape.mesh is not None:
            more = {"meshname": f"mesh{number}"}
            spec.add_mesh(name=f"mesh{number}", uservert=shape.mesh.corners_m, userface=shape.mesh.faces)
        (room if shape.body == FIXED else bodies[shape.body]).add_geom(
            type=_KINDS[shape.kind], size=size, pos=shape.at_m, quat=shape.turn, rgba=shape.colour,
            contype=0, conaffinity=0, **more,
        )  # fmt: skip
    return spec
