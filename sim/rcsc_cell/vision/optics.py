"""What is known of the camera, its flash and its projector, and what a picture holds. No MuJoCo."""

from dataclasses import dataclass, replace
from math import radians, tan

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Optics:
    """The sensor: its geometry, which image processing may know, and its faults, of which it may know the size.

    Accuracy is set here, on purpose. The paper has "ranges could be resolved to 0.2 %", about 1 mm, and "surface orientation
    to approximately 2 %". Read here: the range's error is 0.2 % rms or a little less (0.18 to 0.19 %), and the angle between
    measured and true normal is about 2 % of a right angle, 1.8 degrees, rms (1.6 on a top of 80 x 60, 2.4 on one of 60 x 40,
    which the lines cross on a shorter way). `tests/cell/test_vision.py` holds both.

    One row is worth z^2 / (focal_px * baseline_mm) in range, 9.7 mm at 460 mm: the two lines' rows are independent, so they
    bound the normal (`peak_px`), and an error that both lines share is in the range alone (`aim_rad`). That one is uniform,
    so the sum has no long tails: a right part fails against a tolerance of two such errors less often than a Gaussian would.

    Attributes:
        width_px: Columns.
        height_px: Rows.
        fovy_deg: The angle that the rows see.
        noise: Standard deviation of a pixel; a white surface at `bright_mm` that faces the camera is 1.
        bright_mm: Range at which the flash makes white 1; it falls off with the square of the distance.
        metal: Reflectance of parts.
        furniture: Reflectance of everything else.
        baseline_mm: From the camera to the projector, along camera y.
        middle_mm: The range at which the two lines lie `apart_mm` above and below the axis, the middle of what is looked at.
        apart_mm: Half the lines' distance there; both must lie on a top 40 mm wide from 450 to 490 mm.
        peak_px: Standard deviation of a line's row in one column.
        step_px: Rows are told in such steps.
        aim_rad: Play of the projector's seat: from picture to picture both light planes turn together by up to this.

    Source: Haynes et al. 1984, section 5.2, for the accuracy.
    """

    width_px: int = 160
    height_px: int = 120
    fovy_deg: float = 45.0
    noise: float = 0.02
    bright_mm: float = 400.0
    metal: float = 0.85
    furniture: float = 0.30
    baseline_mm: float = 150.0
    middle_mm: float = 470.0
    apart_mm: float = 11.0
    peak_px: float = 0.17
    step_px: float = 0.125
    aim_rad: float = 0.00085

    @property
    def focal_px(self) -> float:
        """The focal length, of square pixels."""
        return self.height_px / 2 / tan(radians(self.fovy_deg) / 2)

    @property
    def slopes(self) -> tuple[float, float]:
        """The fall of each light plane toward the camera's axis, in mm a mm of range: the tangents of their angles."""
        high, low = self.baseline_mm - self.apart_mm, self.baseline_mm + self.apart_mm
        return high / self.middle_mm, low / self.middle_mm

    @property
    def row_px(self) -> float:
        """The standard deviation of a measured row: the peak's noise and the step's."""
        return float(np.hypot(self.peak_px, self.step_px / np.sqrt(12.0)))

    def range_of_row_mm(self, range_mm: float) -> float:
        """Return the range that one row is worth, in mm: z = b / (s + t), s = y / z, so dz = z^2 / (f b) dv."""
        return range_mm**2 / (self.focal_px * self.baseline_mm)


STANDARD = Optics()
"""The sensor of the cell."""


NOISY = replace(
    STANDARD, noise=5 * STANDARD.noise, peak_px=5 * STANDARD.peak_px, aim_rad=5 * STANDARD.aim_rad
)
"""The same where the fault `noisy` is injected."""


@dataclass(frozen=True, slots=True)
class FloodImage:
    """A picture by flash light.

    Attributes:
        intensity: Shape (height_px, width_px), rows from the top.
    """

    intensity: Floats


@dataclass(frozen=True, slots=True)
class LineImage:
    """The peaks of the two light planes in a picture.

    Attributes:
        peaks_px: For each plane, shape (n, 2): column and row of the line's middle, at most one a column; the picture's upper
            left corner is 0, 0.
    """

    peaks_px: tuple[Floats, Floats]
