"""What FLOOD-FLASH and LINE-FLASH would say, by formulas and without pictures, so that thousands of runs without physics are cheap.

In: tops as they are, in camera axes; the optics; a generator. Out: what `flood.find` and `line.measure` give, with errors of the
same size: those of LINE-FLASH follow from the optics, those of FLOOD-FLASH from numbers measured on pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, pi, sin, sqrt

import numpy as np

from rcsc_cell.vision.blobs import half_turn
from rcsc_cell.vision.flood import Features, FoundPart, Patch, choose
from rcsc_cell.vision.line import LEAST_POINTS, Surface, surface
from rcsc_cell.vision.optics import STANDARD, Floats, Optics

EDGE_PX = 0.04
"""Standard deviation of where a top's edge is seen, in each pixel along it, by a sensor without noise; measured on pictures."""
EDGE_OF_NOISE_PX = 2.0
"""What noise of 1 adds to that at `bright_mm`; it grows as the light falls off. Measured on pictures up to a noise of 0.1."""
INWARD_PX = 0.07
"""How far inside itself a top's edge is seen where the side below it shows: that is darker than the table. Measured on pictures."""
SIDE_MM = 10.0
"""How far from the axis a top's middle is when that side shows in full."""
MARGIN_PX = 1.0
"""A top nearer to the picture's border touches it."""
LEAST_COS = 0.1
"""A surface that leans by more shows no top."""


@dataclass(frozen=True, slots=True)
class Top:
    """A part's top as it is, in camera axes (x right, y up, z toward the camera).

    Attributes:
        x_mm: Its middle, to the right of the axis.
        y_mm: Its middle, above the axis.
        range_mm: Its middle, along the axis.
        length_mm: One side.
        width_mm: The other side.
        roll_rad: Of `length_mm` from camera x.
        normal: Unit, toward the camera.
    """

    x_mm: float
    y_mm: float
    range_mm: float
    length_mm: float
    width_mm: float
    roll_rad: float
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)


def perceive(
    tops: Sequence[Top],
    wanted: Features,
    expected_range_mm: float,
    rng: np.random.Generator,
    optics: Optics = STANDARD,
) -> FoundPart | None:
    """Return the answer of FLOOD-FLASH for these tops, each facing the camera.

    Raises:
        ValueError: The expected range is not positive, or a side of the wanted top is not.
    """
    errors = rng.standard_normal((len(tops), 4)).tolist()
    shapes = [
        _seen(top, expected_range_mm, error, optics)
        for top, error in zip(tops, errors, strict=True)
        if _inside(top, optics)
    ]
    return choose(shapes, wanted, expected_range_mm)


def _inside(top: Top, optics: Optics) -> bool:
    """Tell whether the whole top lies in the picture."""
    scale = optics.focal_px / top.range_mm
    c, s = abs(cos(top.roll_rad)), abs(sin(top.roll_rad))
    right = abs(top.x_mm) + (top.length_mm * c + top.width_mm * s) / 2
    up = abs(top.y_mm) + (top.length_mm * s + top.width_mm * c) / 2
    return right * scale < optics.width_px / 2 - MARGIN_PX and up * scale < optics.height_px / 2 - MARGIN_PX


def _seen(top: Top, expected_range_mm: float, error: Sequence[float], optics: Optics) -> Patch:
    """Return a top's patch at the expected range, with errors of place along and across, of turn and of area.

    Each pixel of the border is off by e on its own. For sides l and w in pixels, the border's first moments give a middle
    off by e sqrt(l / 6 + w / 2) / w along l; its product moment a turn off by e sqrt((l + w) / 24) 12 / |l^2 - w^2|; its length an
    area off by e sqrt(2 (l + w)).
    """
    scale, edge_px = optics.focal_px / top.range_mm, _edge_px(top.range_mm, optics)
    long, short = max(top.length_mm, top.width_mm) * scale, min(top.length_mm, top.width_mm) * scale
    roll = top.roll_rad if top.length_mm >= top.width_mm else top.roll_rad + pi / 2
    c, s = cos(roll), sin(roll)
    # with the sign of the side away from the axis
    lost_along = INWARD_PX * _share(top.x_mm * c + top.y_mm * s)
    lost_across = INWARD_PX * _share(top.y_mm * c - top.x_mm * s)
    along = lost_along / 2 + error[0] * edge_px * sqrt(long / 6 + short / 2) / short
    across = lost_across / 2 + error[1] * edge_px * sqrt(short / 6 + long / 2) / long
    turn = edge_px * sqrt((long + short) / 24) * 12 / max(long**2 - short**2, 1.0)
    length, width = long - abs(lost_along), short - abs(lost_across)
    area = length * width + error[3] * edge_px * sqrt(2 * (long + short))
    mm = expected_range_mm / optics.focal_px
    return Patch(
        (top.x_mm * scale + along * c - across * s) * mm,
        (top.y_mm * scale + along * s + across * c) * mm,
        length * mm,
        width * mm,
        area * mm**2,
        half_turn(roll + error[2] * turn),
    )


def _edge_px(range_mm: float, optics: Optics) -> float:
    """Return the standard deviation, in pixels, of the place where an edge is seen, at a range."""
    return hypot(EDGE_PX, EDGE_OF_NOISE_PX * optics.noise * (range_mm / optics.bright_mm) ** 2)


def _share(offset_mm: float) -> float:
    """Return the share of the side facing the axis that shows, signed as the offset is."""
    return max(-1.0, min(1.0, offset_mm / SIDE_MM))


def perceive_surface(top: Top, rng: np.random.Generator, optics: Optics = STANDARD) -> Surface | None:
    """Return the answer of LINE-FLASH for a top under the axis; None where a light plane misses it.

    The fitted plane's numbers have the covariance of least squares, row variance * (X^T X)^-1 over the columns in which the lines cross
    the top. Both planes turned by d put the range off by z^2 / b (1 + slope^2) d: from z = b / (s + slope).
    """
    aim = float(rng.uniform(-optics.aim_rad, optics.aim_rad))
    normals, spread = rng.standard_normal(3), float(rng.standard_normal())
    nx, ny, nz = top.normal
    if nz < LEAST_COS:
        return None
    range_mm = top.range_mm - (nx * top.x_mm + ny * top.y_mm) / nz
    points = [_crossed(top, slope, optics) for slope in optics.slopes]
    if min(map(len, points)) < LEAST_POINTS:
        return None
    x = np.concatenate(points)
    row_mm = optics.row_px * optics.range_of_row_mm(range_mm)
    covariance = np.linalg.inv(x.T @ x) * row_mm**2
    plane = np.array([range_mm, nx / nz, ny / nz]) + np.linalg.cholesky(covariance) @ normals
    steep = optics.baseline_mm / optics.middle_mm
    plane[0] += range_mm**2 / optics.baseline_mm * (1 + steep**2) * aim
    # a mean square of so many has a relative deviation of sqrt(2 / free), its root of half that
    free = len(x) - 3
    return surface(plane, row_mm * sqrt(free / len(x)) * max(0.0, 1 + spread / sqrt(2 * free)), len(x))


def _crossed(top: Top, slope: float, optics: Optics) -> Floats:
    """Return where one light plane crosses the top, column by column: rows of 1, x and y in mm, shape (n, 3)."""
    y = optics.baseline_mm - slope * top.range_mm
    apart = top.range_mm / optics.focal_px
    half = hypot(top.length_mm, top.width_mm) / 2
    x = (np.arange(-half // apart, half // apart + 2) + 0.5) * apart
    c, s = cos(top.roll_rad), sin(top.roll_rad)
    right, up = x - top.x_mm, y - top.y_mm
    on = np.abs(right * c + up * s) <= top.length_mm / 2
    on &= np.abs(up * c - right * s) <= top.width_mm / 2
    crossed: Floats = np.stack([np.ones_like(x), x, np.full_like(x, y)], axis=1)[on]
    return crossed
