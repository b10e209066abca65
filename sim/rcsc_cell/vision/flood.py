"""FLOOD-FLASH (section 5.1): where the part is, how it is turned, and its range from its size, out of a flash picture.

In: a picture, the features that the database has of the part, the range at which it is expected, and the optics. Assumed: the
surface faces the camera. Nothing of the world's true poses can come in here.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from rcsc_cell.vision.blobs import Blob, blobs, half_turn
from rcsc_cell.vision.optics import STANDARD, Floats, FloodImage, Optics

MOST_MISMATCH = 0.30
"""Patches that differ by more are other things: a top 80 x 60 seen for one of 70 x 50 differs by 0.5."""
ALIKE = 0.15
"""Differences of the mismatch that mean nothing: equal tops 10 mm apart in range differ by 0.09, and LINE-FLASH tells them apart."""


@dataclass(frozen=True, slots=True)
class Features:
    """The features of a part's top in the database: its length and width in mm, in either order."""

    length_mm: float
    width_mm: float


@dataclass(frozen=True, slots=True)
class Patch:
    """A patch in mm, as if it were at the expected range.

    Attributes:
        x_mm: Its middle, to the right of the camera's axis.
        y_mm: Its middle, above the camera's axis.
        length_mm: The longer side.
        width_mm: The shorter side.
        area_mm2: Its area.
        roll_rad: Of the longer side from camera x, in (-pi/2, pi/2].
    """

    x_mm: float
    y_mm: float
    length_mm: float
    width_mm: float
    area_mm2: float
    roll_rad: float


@dataclass(frozen=True, slots=True)
class FoundPart:
    """The answer of FLOOD-FLASH about the part.

    Attributes:
        x_mm: The part's middle, to the right of the camera's axis, at the expected range.
        y_mm: The part's middle, above the camera's axis, at the expected range.
        roll_rad: Of the long side from camera x, in (-pi/2, pi/2]; a square top has none, and this then means nothing.
        range_mm: From its area, if the surface faces the camera.
    """

    x_mm: float
    y_mm: float
    roll_rad: float
    range_mm: float


def find(
    image: FloodImage, wanted: Features, expected_range_mm: float, optics: Optics = STANDARD
) -> FoundPart | None:
    """Find the part that matches best and, of those alike, is nearest to the middle of the picture; None if none matches.

    Raises:
        ValueError: The expected range is not positive, or a side of the wanted top is not.
    """
    bright = (optics.metal + optics.furniture) / 2
    seen = blobs(reflectance(image, expected_range_mm, optics), bright)
    return choose((shape(blob, expected_range_mm, optics) for blob in seen), wanted, expected_range_mm)


def reflectance(image: FloodImage, expected_range_mm: float, optics: Optics) -> Floats:
    """Even out the picture: divide each pixel by that of a white surface at the expected range that faces the camera.

    Such a surface is seen at a cosine c and at a distance of range / c, so the flash falls off with c^3 across the picture.
    """
    x = (np.arange(optics.width_px) + 0.5 - optics.width_px / 2) / optics.focal_px
    y = (np.arange(optics.height_px) + 0.5 - optics.height_px / 2) / optics.focal_px
    longer: Floats = (1.0 + x[None, :] ** 2 + y[:, None] ** 2) ** 1.5
    even: Floats = image.intensity * longer * (expected_range_mm / optics.bright_mm) ** 2
    return even


def shape(blob: Blob, expected_range_mm: float, optics: Optics) -> Patch:
    """Return a patch in mm at the expected range."""
    scale_mm = expected_range_mm / optics.focal_px
    return Patch(
        (blob.column_px - optics.width_px / 2) * scale_mm,
        (optics.height_px / 2 - blob.row_px) * scale_mm,
        blob.length_px * scale_mm,
        blob.width_px * scale_mm,
        blob.area_px * scale_mm**2,
        half_turn(blob.angle_rad),
    )


def choose(shapes: Iterable[Patch], wanted: Features, expected_range_mm: float) -> FoundPart | None:
    """Choose the best match, as in section 5.1.

    Raises:
        ValueError: The expected range is not positive, or a side of the wanted top is not.
    """
    if min(expected_range_mm, wanted.length_mm, wanted.width_mm) <= 0.0:
        raise ValueError(f"nothing looks like {wanted} at {expected_range_mm} mm")
    rated = [(mismatch(shape, wanted), shape) for shape in shapes]
    least = min((score for score, _ in rated), default=MOST_MISMATCH)
    limit = min(MOST_MISMATCH, least + ALIKE)
    alike = [(hypot(shape.x_mm, shape.y_mm), score, shape) for score, shape in rated if score <= limit]
    if not alike:
        return None
    *_, best = min(alike, key=lambda rating: rating[:2])
    size_mm2 = wanted.length_mm * wanted.width_mm
    range_mm = expected_range_mm * sqrt(size_mm2 / best.area_mm2)
    return FoundPart(best.x_mm, best.y_mm, best.roll_rad, range_mm)


def mismatch(seen: Patch, wanted: Features) -> float:
    """Return the sum of the relative differences of area, length and width."""
    length_mm = max(wanted.length_mm, wanted.width_mm)
    width_mm = min(wanted.length_mm, wanted.width_mm)
    return (
        abs(seen.area_mm2 / (length_mm * width_mm) - 1.0)
        + abs(seen.length_mm / length_mm - 1.0)
        + abs(seen.width_mm / width_mm - 1.0)
    )
