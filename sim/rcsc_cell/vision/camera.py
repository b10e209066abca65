"""The sensor model: pictures of the MuJoCo cell by rays, without graphics. The only module here that knows MuJoCo.

In: a model with a camera `wrist` and a site `projector`, both on the wrist plate; parts are geoms of group 1, furniture of group
0, and what is in the other groups is not seen. Out: pictures. Noise comes from the caller's generator, and always as much of it,
so the same seed gives the same pictures whatever is in view.
"""

from math import atan, tan

import mujoco
import numpy as np
from numpy.typing import NDArray

from rcsc_cell.vision.optics import STANDARD, Floats, FloodImage, LineImage, Optics

CAMERA, PROJECTOR = "wrist", "projector"
PART_GROUP = 1
"""Of the geoms that are parts: bare metal."""
FAR_M = 5.0
SUBRAYS = 4
"""A pixel on a part's edge is the mean of so many rays each way; with fewer, an edge along the rows moves in jumps."""
SAME_FACE = 0.999
"""Cosine of the angle between two normals of one face."""
CALIBRATED_MM = 0.01

_SEEN = np.array([1, 1, 0, 0, 0, 0], np.uint8)


class Camera:
    """Takes pictures of a model's state; `mj_forward` must have been called on that state.

    Raises:
        ValueError: The model has no such camera or projector, or they are not where `optics` has them.
    """

    def __init__(self, model: mujoco.MjModel, optics: Optics = STANDARD) -> None:
        self._model, self._optics = model, optics
        self._camera = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, CAMERA)
        self._projector = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, PROJECTOR)
        if min(self._camera, self._projector) < 0:
            raise ValueError(f"the model lacks a camera `{CAMERA}` or a site `{PROJECTOR}`")
        self._check_calibration()
        columns, rows = np.meshgrid(np.arange(optics.width_px) + 0.5, np.arange(optics.height_px) + 0.5)
        self._pixels = self._rays(columns.ravel(), rows.ravel())
        reflectance = np.where(model.geom_group == PART_GROUP, optics.metal, optics.furniture)
        self._reflectance = np.append(reflectance, 0.0)  # a ray that hits nothing has geom -1, the last
        self._is_part = np.append(model.geom_group == PART_GROUP, False)

    def _check_calibration(self) -> None:
        """Check the model's camera against the optics, in the model's first position."""
        model, optics = self._model, self._optics
        fovy_deg = float(model.cam_fovy[self._camera])
        if abs(fovy_deg - optics.fovy_deg) > 1e-6:
            raise ValueError(f"camera `{CAMERA}` sees {fovy_deg} degrees; the optics have {optics.fovy_deg}")
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        at_mm = self._light(data) * 1e3
        if np.abs(at_mm - (0.0, optics.baseline_mm, 0.0)).max() > CALIBRATED_MM:
            wanted = (0.0, optics.baseline_mm, 0.0)
            raise ValueError(f"site `{PROJECTOR}` is at {at_mm.round(2)} mm from the camera, not at {wanted}")

    def flood(self, data: mujoco.MjData, rng: np.random.Generator) -> FloodImage:
        """Take a picture by a flash beside the lens: a face is brighter the nearer it is and the more it faces the camera."""
        optics = self._optics
        geoms, depth_m, normals = self._cast(data, self._pixels)
        flat = self._shade(self._pixels, geoms, depth_m, normals)
        shape = (optics.height_px, optics.width_px)
        edge = _edges(geoms.reshape(shape), normals.reshape(*shape, 3), self._is_part)
        flat[edge.ravel()] = self._averaged(data, *np.nonzero(edge))
        intensity = flat.reshape(shape)
        return FloodImage(intensity + rng.normal(0.0, optics.noise, shape))

    def lines(self, data: mujoco.MjData, rng: np.random.Generator) -> LineImage:
        """Take a picture of the two light planes: they leave the projector along camera x and fall toward the axis."""
        optics = self._optics
        columns = np.arange(optics.width_px, dtype=np.float64) + 0.5
        across = self._rays(columns, np.zeros_like(columns))[:, 0]
        turn = rng.uniform(-optics.aim_rad, optics.aim_rad)
        noise_px = rng.normal(0.0, optics.peak_px, (2, optics.width_px))
        falls = [tan(atan(slope) + turn) for slope in optics.slopes]
        rays = np.concatenate([_fan(across, fall) for fall in falls])
        lit = self._lit(data, rays)
        half = optics.width_px
        first, second = (self._peaks(lit[n * half : (n + 1) * half], noise_px[n]) for n in range(len(falls)))
        return LineImage((first, second))

    def _lit(self, data: mujoco.MjData, rays: Floats) -> Floats:
        """Return where light along the rays ends, in camera axes, shape (n, 3), m; NaN where the camera does not see it."""
        light = self._light(data)
        geoms, depth, _ = self._cast(data, rays, light)
        points = light + rays * depth[:, None]
        points[geoms < 0] = np.nan
        hit = np.flatnonzero(geoms >= 0)
        _, share, _ = self._cast(data, points[hit])
        points[hit[share < SAME_FACE]] = np.nan
        return points

    def _peaks(self, points: Floats, noise_px: Floats) -> Floats:
        """Return columns and rows of points, with the sensor's noise and steps, within the picture."""
        optics = self._optics
        depth = -points[:, 2]
        column = optics.width_px / 2 + optics.focal_px * points[:, 0] / depth
        row = optics.height_px / 2 - optics.focal_px * points[:, 1] / depth + noise_px
        row = np.round(row / optics.step_px) * optics.step_px
        inside = (column > 0) & (column < optics.width_px) & (row > 0) & (row < optics.height_px)
        return np.stack([column, row], axis=1)[inside]

    def _light(self, data: mujoco.MjData) -> Floats:
        """Return the projector in camera axes, in m."""
        turn = data.cam_xmat[self._camera].reshape(3, 3)
        light: Floats = (data.site_xpos[self._projector] - data.cam_xpos[self._camera]) @ turn
        return light

    def _rays(self, columns: Floats, rows: Floats) -> Floats:
        """Return directions in camera axes, shape (n, 3), one long along the axis: a ray's length is then its depth."""
        optics = self._optics
        x = (columns - optics.width_px / 2) / optics.focal_px
        y = (optics.height_px / 2 - rows) / optics.focal_px
        return np.stack([x, y, -np.ones_like(x)], axis=1)

    def _averaged(self, data: mujoco.MjData, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Floats:
        """Return the mean intensity that pixels on edges collect over their area."""
        inside = (np.arange(SUBRAYS) + 0.5) / SUBRAYS
        right, down = (grid.ravel() for grid in np.meshgrid(inside, inside))
        rays = self._rays((columns[:, None] + right).ravel(), (rows[:, None] + down).ravel())
        mean: Floats = self._shade(rays, *self._cast(data, rays)).reshape(-1, SUBRAYS**2).mean(axis=1)
        return mean

    def _cast(
        self, data: mujoco.MjData, rays: Floats, start: Floats | None = None
    ) -> tuple[NDArray[np.int32], Floats, Floats]:
        """Cast rays from a point of the camera's axes; return geoms (-1 none), lengths in rays, normals in camera axes."""
        turn = data.cam_xmat[self._camera].reshape(3, 3)
        origin = data.cam_xpos[self._camera] + (0.0 if start is None else turn @ start)
        count = len(rays)
        geoms = np.full(count, -1, np.int32)
        length, normals = np.zeros(count), np.zeros(3 * count)
        world = np.ascontiguousarray(rays @ turn.T).ravel()
        mujoco.mj_multiRay(
            self._model, data, origin, world, _SEEN, 1, -1, geoms, length, normals, count, FAR_M
        )
        return geoms, length, (normals.reshape(-1, 3) @ turn)

    def _shade(self, rays: Floats, geoms: NDArray[np.int32], depth_m: Floats, normals: Floats) -> Floats:
        """Shade matt surfaces under a lamp at the lens: reflectance * cosine / distance^2.

        Source: Lambert's law and the inverse square law.
        """
        long = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        facing = np.clip(-np.einsum("ij,ij->i", rays, normals) / long, 0.0, 1.0)
        away_m = np.where(geoms < 0, np.inf, depth_m * long)
        shaded: Floats = self._reflectance[geoms] * facing * (self._optics.bright_mm * 1e-3 / away_m) ** 2
        return shaded


def _fan(across: Floats, fall: float) -> Floats:
    """Return a light plane's rays in camera axes, shape (n, 3)."""
    return np.stack([across, np.full_like(across, -fall), -np.ones_like(across)], axis=1)


def _edges(geoms: NDArray[np.int32], normals: Floats, is_part: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Find pixels beside one that shows another face, where one of the two is a part's: nobody measures furniture."""
    edge = np.zeros(geoms.shape, bool)
    for here, there in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        differ = geoms[here] != geoms[there]
        differ |= np.einsum("ijk,ijk->ij", normals[here], normals[there]) < SAME_FACE
        differ &= is_part[geoms[here]] | is_part[geoms[there]]
        edge[here] |= differ
        edge[there] |= differ
    return edge
