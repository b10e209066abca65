"""LINE-FLASH (section 5.2): range and orientation of the surface on the camera's axis, by triangulating two light planes.

In: the rows at which the sensor sees each plane, the range at which the part is expected, and the optics. Assumed: the part is
under the camera's axis. Nothing of the world's true poses can come in here.
"""

from dataclasses import dataclass
from math import acos

import numpy as np

from rcsc_cell.vision.optics import STANDARD, Floats, LineImage, Optics

WINDOW_MM = 60.0
"""Surfaces farther than this from the expected range are not looked at."""
REACH_MM = 60.0
"""How far to each side of the axis a line is looked at: past the corners of the largest part."""
BREAK = 24.0
"""A line is broken where that takes more than so many variances off its squared residuals; two free numbers alone take off 2."""
LEAN = 0.05
"""Where a line is cut, the usual slope of a top against the camera, and of what lies beside it: else a step of a few points would
pass for a lean. The surface is then fitted without it."""
LEAST_POINTS = 4
"""Of each line."""


@dataclass(frozen=True, slots=True)
class Surface:
    """The answer of LINE-FLASH.

    Attributes:
        range_mm: From the camera along its axis to the surface.
        normal: The surface's unit normal in camera axes (x right, y up, z toward the camera).
        spread_mm: Root mean square of the points' distances in range from the fitted plane.
        points: How many were fitted.
    """

    range_mm: float
    normal: tuple[float, float, float]
    spread_mm: float
    points: int

    def angle_rad(self, expected: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> float:
        """Return the angle between the measured and an expected unit normal, in radians."""
        cosine = sum(a * b for a, b in zip(self.normal, expected, strict=True))
        return acos(min(1.0, max(-1.0, cosine)))


def measure(image: LineImage, expected_range_mm: float, optics: Optics = STANDARD) -> Surface | None:
    """Measure the surface on the camera's axis, at or near the expected range; return None where there is none.

    Raises:
        ValueError: The expected range is not positive.
    """
    if expected_range_mm <= 0.0:
        raise ValueError(f"nothing is at {expected_range_mm} mm")
    spread_mm = optics.row_px * optics.range_of_row_mm(expected_range_mm)
    pieces = []
    for peaks, slope in zip(image.peaks_px, optics.slopes, strict=True):
        points = _near(triangulate(peaks, slope, optics), expected_range_mm)
        pieces.append(_middle_piece(points, spread_mm))
    if min(map(len, pieces)) < LEAST_POINTS:
        return None
    points = np.concatenate(pieces)
    plane = _fit(points)
    off_mm = points[:, 2] - plane[0] - points[:, :2] @ plane[1:]
    return surface(plane, float(np.sqrt(np.mean(off_mm**2))), len(points))


def triangulate(peaks_px: Floats, slope: float, optics: Optics) -> Floats:
    """Return points of one light plane, shape (n, 3): camera x, camera y and range, in mm.

    The plane has y = b - slope * z, the sensor's ray has y = s * z, so z = b / (s + slope).
    """
    x = (peaks_px[:, 0] - optics.width_px / 2) / optics.focal_px
    s = (optics.height_px / 2 - peaks_px[:, 1]) / optics.focal_px
    crossing = s + slope > 1e-6  # else the ray meets the plane behind the camera or never
    z = optics.baseline_mm / (s + slope)[crossing]
    return np.stack([x[crossing] * z, s[crossing] * z, z], axis=1)


def _near(points: Floats, expected_range_mm: float) -> Floats:
    """Return the points beside the axis and near the expected range, from the left."""
    near = np.abs(points[:, 2] - expected_range_mm) <= WINDOW_MM
    near &= np.abs(points[:, 0]) <= REACH_MM
    kept: Floats = points[near]
    return kept[np.argsort(kept[:, 0], kind="stable")]


def _middle_piece(points: Floats, spread_mm: float) -> Floats:
    """Return the straight piece of a line that crosses the axis: the part's top, without whatever the line meets beside it.

    Of all ways to cut the line into straight pieces, the one with the least sum of squared residuals, in variances, and of `BREAK` a piece.

    Args:
        points: Of one light plane, from the left, shape (n, 3).
        spread_mm: Standard deviation of a point's range.

    Source: dynamic programming over the last cut; Jackson et al., "An algorithm for optimal partitioning of data on an interval",
    IEEE Signal Processing Letters 12 (2005).
    """
    if len(points) < LEAST_POINTS:
        return points
    cost = _squares(points[:, 0], points[:, 2], spread_mm) / spread_mm**2 + BREAK
    best, cuts = np.zeros(len(points) + 1), [0]
    for after in range(1, len(points) + 1):
        sums = best[:after] + cost[:after, after]
        cuts.append(int(np.argmin(sums)))
        best[after] = sums[cuts[after]]
    middle = int(np.argmin(np.abs(points[:, 0])))
    after = len(points)
    while cuts[after] > middle:
        after = cuts[after]
    piece: Floats = points[cuts[after] : after]
    return piece


def _squares(x: Floats, z: Floats, spread_mm: float) -> Floats:
    """Return sums of squared residuals of z from a straight line in x, for each run [first, after), shape (n + 1, n + 1).

    From running sums about the run's means: Szz - Sxz^2 / (Sxx + (spread / lean)^2), the least of the squared residuals and of the
    squared slope, each in its own variance.
    """
    z = z - z.mean()  # else the sums' differences would lose digits
    n = np.maximum(_runs(np.ones_like(x)), 1.0)
    sx, sz, xx, xz, zz = (_runs(ndarray) for ndarray in (x, z, x * x, x * z, z * z))
    about_xx, about_xz, about_zz = xx - sx * sx / n, xz - sx * sz / n, zz - sz * sz / n
    squares: Floats = about_zz - about_xz**2 / (about_xx + (spread_mm / LEAN) ** 2)
    return np.maximum(squares, 0.0)


def _runs(values: Floats) -> Floats:
    """Return the sum over each run [first, after)."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    runs: Floats = total[None, :] - total[:, None]
    return runs


def _fit(points: Floats) -> Floats:
    """Fit range = p0 + p1 x + p2 y by least squares."""
    columns = np.column_stack([np.ones(len(points)), points[:, :2]])
    return np.asarray(np.linalg.lstsq(columns, points[:, 2], rcond=None)[0], np.float64)


def surface(plane: Floats, spread_mm: float, points: int) -> Surface:
    """Return a plane's range and normal: its points have -z = p0 + p1 x + p2 y in camera axes, where z points back."""
    x, y, z = (np.append(plane[1:], 1.0) / np.sqrt(1.0 + plane[1:] @ plane[1:])).tolist()
    return Surface(float(plane[0]), (x, y, z), spread_mm, points)
