"""Where a rigid body is: a rotation and a point; and the nine numbers in which the robot is told of it (section 7.1).

Plain floats, no arrays: a pose is used a few times a cycle, and a three by three product in numpy costs more than its sums.
Lengths are millimetres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, radians, sin, sqrt

Vector = tuple[float, float, float]
Rotation = tuple[Vector, Vector, Vector]
"""Rows; its columns are the body's axes seen from the base."""

ARM_MM = 100.0
"""From the wrist plate's centre to its two other points (section 7.1), as the database has them."""
DOWN: Rotation = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""The tool points down, the plate's x axis lies along the base's."""


@dataclass(frozen=True, slots=True)
class Pose:
    """A body's axes and its origin.

    Attributes:
        turn: Three rows; its columns are unit vectors along the body's x, y and z.
        at_mm: The origin, in mm.
    """

    turn: Rotation
    at_mm: Vector

    def point(self, inside_mm: Vector) -> Vector:
        """Return a point of the body, seen from the base."""
        x, y, z = apply(self.turn, inside_mm)
        return (self.at_mm[0] + x, self.at_mm[1] + y, self.at_mm[2] + z)

    def inside(self, point_mm: Vector) -> Vector:
        """Return a point of the base, seen from the body."""
        return apply(transposed(self.turn), minus(point_mm, self.at_mm))

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return the pose, seen from the base, of a body whose pose is known in this body's axes."""
        return Pose(product(self.turn, other.turn), self.point(other.at_mm))

    def inverse(self) -> "Pose":
        """Return the pose of the base, seen from the body."""
        back = transposed(self.turn)
        x, y, z = apply(back, self.at_mm)
        return Pose(back, (-x, -y, -z))

    def axis(self, number: int) -> Vector:
        """Return the unit vector along the body's x (0), y (1) or z (2)."""
        return (self.turn[0][number], self.turn[1][number], self.turn[2][number])


def apply(turn: Rotation, v: Vector) -> Vector:
    """Return the turned vector."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    x, y, z = v
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def transposed(turn: Rotation) -> Rotation:
    """Return the inverse of a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = turn
    return ((a, d, g), (b, e, h), (c, f, i))


def product(first: Rotation, second: Rotation) -> Rotation:
    """Return the rotation that applies the second, then the first."""
    (a, b, c), (d, e, f), (g, h, i) = first
    (j, k, m), (n, p, q), (r, s, t) = second
    return (
        (a * j + b * n + c * r, a * k + b * p + c * s, a * m + b * q + c * t),
        (d * j + e * n + f * r, d * k + e * p + f * s, d * m + e * q + f * t),
        (g * j + h * n + i * r, g * k + h * p + i * s, g * m + h * q + i * t),
    )


def minus(a: Vector, b: Vector) -> Vector:
    """Return the vector from b to a."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(v: Vector) -> Vector:
    """Return the vector scaled to length one.

    Raises:
        ZeroDivisionError: Its length is zero.
    """
    length = sqrt(dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length)


def about_y(angle_deg: float) -> Rotation:
    """Return a turn about y."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return ((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))


def about_z(angle_deg: float) -> Rotation:
    """Return a turn about z."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


def nine(plate: Pose) -> tuple[float, ...]:
    """Return the wrist plate's three points: its centre, one along the tool, one along the plate's x."""
    return (*plate.at_mm, *plate.point((0.0, 0.0, ARM_MM)), *plate.point((ARM_MM, 0.0, 0.0)))


def pose_of(numbers: Sequence[float]) -> Pose | None:
    """Return the wrist plate that three points define; None where they lie on a line or far too close together.

    The tool axis goes from the first point to the second; the third says where x is, as well as it can be square to that.

    Args:
        numbers: Nine, in mm.
    """
    centre: Vector = (float(numbers[0]), float(numbers[1]), float(numbers[2]))
    along = minus((float(numbers[3]), float(numbers[4]), float(numbers[5])), centre)
    aside = minus((float(numbers[6]), float(numbers[7]), float(numbers[8])), centre)
    if hypot(*along) < 1.0 or hypot(*aside) < 1.0:
        return None
    z = unit(along)
    lean = dot(aside, z)
    square: Vector = (aside[0] - lean * z[0], aside[1] - lean * z[1], aside[2] - lean * z[2])
    if hypot(*square) < 1.0:
        return None
    x = unit(square)
    y = cross(z, x)
    return Pose(transposed((x, y, z)), centre)
