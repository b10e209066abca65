"""Bright patches of a picture and their moments. Numpy only; pixels, no millimetres.

A pixel on a patch's border counts by how bright it is between what is around the patch and what the patch is: the sensor's
pixels collect light over their area, so that is the share of it that the patch covers.
"""

from dataclasses import dataclass
from math import atan2, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from rcsc_cell.vision.optics import Floats

Mask = NDArray[np.bool_]
Labels = NDArray[np.intp]
LEAST_PX = 12
"""Smaller patches are dirt."""
LEAST_COVER = 0.1
"""A border pixel with less is taken to be noise."""
AROUND_PX = 3
"""How far around a patch its surroundings are looked at."""


@dataclass(frozen=True, slots=True)
class Blob:
    """A patch, by its moments.

    Attributes:
        column_px: Its middle, from the picture's left.
        row_px: Its middle, from the top.
        area_px: Pixels that it covers.
        length_px: Of the rectangle with these second moments.
        width_px: Likewise, the shorter.
        angle_rad: Of the length from the columns' direction, upward, in (-pi/2, pi/2].
    """

    column_px: float
    row_px: float
    area_px: float
    length_px: float
    width_px: float
    angle_rad: float


def blobs(picture: Floats, threshold: float) -> list[Blob]:
    """Find the patches above the threshold that do not touch the picture's border, from the top."""
    labels, count = label(picture > threshold)
    cut = {int(n) for edge in (labels[0], labels[-1], labels[:, 0], labels[:, -1]) for n in np.unique(edge)}
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    whole = [n for n in range(1, count + 1) if n not in cut and sizes[n] >= LEAST_PX]
    return [_blob(picture, labels, n) for n in whole]


def label(mask: Mask) -> tuple[Labels, int]:
    """Label the mask's 4-connected components, numbered from 1 in the order of their first pixels; 0 elsewhere.

    Runs of each row are joined to the runs of the row above that they touch.

    Source: the run-length method of Rosenfeld and Pfaltz, "Sequential operations in digital picture processing", 1966.
    """
    steps = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, starts = np.nonzero(steps == 1)
    ends = np.nonzero(steps == -1)[1]
    first = np.searchsorted(rows, np.arange(mask.shape[0] + 1)).tolist()
    runs = list(zip(starts.tolist(), ends.tolist(), strict=True))
    roots = _joined(runs, first)
    numbers: dict[int, int] = {}
    labels = np.zeros(mask.shape, np.intp)
    for at, (row, (start, end)) in enumerate(zip(rows.tolist(), runs, strict=True)):
        labels[row, start:end] = numbers.setdefault(_root(roots, at), len(numbers) + 1)
    return labels, len(numbers)


def _joined(runs: list[tuple[int, int]], first: list[int]) -> list[int]:
    """Return for each run another of its component, or itself; `first` has each row's first run and the number of all."""
    roots = list(range(len(runs)))
    for above, here, after in zip(first, first[1:], first[2:], strict=False):
        old = above
        for new in range(here, after):
            start, end = runs[new]
            while old < here and runs[old][1] <= start:
                old += 1
            at = old
            while at < here and runs[at][0] < end:
                root, other = sorted((_root(roots, at), _root(roots, new)))
                roots[other] = root
                at += 1
    return roots


def _root(roots: list[int], at: int) -> int:
    while roots[at] != at:
        roots[at] = roots[roots[at]]
        at = roots[at]
    return at


def grown(mask: Mask) -> Mask:
    """Return the mask and every pixel beside it, also at a corner."""
    wide = np.pad(mask, 1)
    tall = wide[:-2] | wide[1:-1] | wide[2:]
    full: Mask = tall[:, :-2] | tall[:, 1:-1] | tall[:, 2:]
    return full


def _blob(picture: Floats, labels: Labels, number: int) -> Blob:
    """Measure one patch, from the part of the picture around it."""
    rows, columns = np.nonzero(labels == number)
    top, left = max(rows.min() - AROUND_PX, 0), max(columns.min() - AROUND_PX, 0)
    window = (slice(top, rows.max() + AROUND_PX + 1), slice(left, columns.max() + AROUND_PX + 1))
    cover = _cover(picture[window], labels[window], number)
    return _moments(cover, float(top), float(left))


def _cover(picture: Floats, labels: Labels, number: int) -> Floats:
    """Return the share of each pixel that the patch covers."""
    body = labels == number
    inner = ~grown(~body)
    outer = grown(body)
    free = labels == 0
    bright = float(np.median(picture[inner if inner.any() else body]))
    around = grown(grown(outer)) & ~grown(outer) & free
    dark = float(np.median(picture[around])) if around.any() else 0.0
    cover = np.clip((picture - dark) / (bright - dark), 0.0, 1.0)
    cover[(cover < LEAST_COVER) | ~outer | ~(free | body)] = 0.0
    cover[inner] = 1.0
    return cover


def _moments(cover: Floats, top: float, left: float) -> Blob:
    """Return area, middle and axes; the middle of the first pixel is at a half."""
    area = float(cover.sum())
    across, down = cover.sum(axis=0), cover.sum(axis=1)
    columns, rows = np.arange(cover.shape[1]) + 0.5, np.arange(cover.shape[0]) + 0.5
    u, v = float(across @ columns) / area, float(down @ rows) / area
    # Each pixel is the mean over a square, which widens the patch by a square's second moment.
    uu = float(across @ (columns - u) ** 2) / area - 1 / 12
    vv = float(down @ (rows - v) ** 2) / area - 1 / 12
    uv = float((rows - v) @ cover @ (columns - u)) / area
    mean, apart = (uu + vv) / 2, hypot((uu - vv) / 2, uv)
    length, width = sqrt(12 * (mean + apart)), sqrt(12 * max(mean - apart, 0.0))
    return Blob(left + u, top + v, area, length, width, half_turn(0.5 * atan2(-2 * uv, uu - vv)))


def half_turn(angle_rad: float) -> float:
    """Return the same line's angle in (-pi/2, pi/2]."""
    turned = np.pi / 2 - (np.pi / 2 - angle_rad) % np.pi
    return float(turned)
