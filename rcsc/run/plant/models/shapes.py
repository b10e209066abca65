"""Convex solids as corners and flat faces.

In: one of MuJoCo's shapes and its size. Out: a `Solid` about the shape's own origin. Lengths are metres.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]

SIDES = 16
"""Of what is round."""
_RISE = (0.0, 35.0, 70.0)
"""Degrees above the equator of the rings that stand for a half ball."""
_BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, slots=True)
class Solid:
    """A convex solid.

    Attributes:
        corners: Shape (corners, 3), in m.
        faces: Indices of corners, shape (faces, most), counter-clockwise seen from outside; a shorter face repeats
            its last corner.
        normals: Unit vectors outward, shape (faces, 3).
    """

    corners: Floats
    faces: Integers
    normals: Floats


@lru_cache(maxsize=512)
def box(x: float, y: float, z: float) -> Solid:
    """Return a box of these half sides."""
    corners = np.array(list(product((-x, x), (-y, y), (-z, z))))
    return _shape(corners, _BOX_FACES)


@lru_cache(maxsize=512)
def cylinder(radius: float, half: float) -> Solid:
    """Return a cylinder along z, from -half to half."""
    return _rings(((radius, -half), (radius, half)))


@lru_cache(maxsize=512)
def capsule(radius: float, half: float) -> Solid:
    """Return a cylinder along z with half balls at its ends; a ball where `half` is 0."""
    above = [(radius * np.cos(angle), half + radius * np.sin(angle)) for angle in np.radians(_RISE)]
    below = [(wide, -high) for wide, high in reversed(above)]
    return _rings((*below[: None if half > 0.0 else -1], *above))  # a ball has one equator


def _rings(rings: tuple[tuple[float, float], ...]) -> Solid:
    """Return the solid between rings, each of a radius at a height, from the lowest up."""
    turn = np.arange(SIDES) * (2 * np.pi / SIDES)
    circle = np.stack((np.cos(turn), np.sin(turn)), axis=1)
    corners = np.vstack([np.column_stack((radius * circle, np.full(SIDES, z))) for radius, z in rings])
    top = SIDES * (len(rings) - 1)
    faces = [tuple(range(SIDES - 1, -1, -1)), tuple(range(top, top + SIDES))]
    for ring in range(len(rings) - 1):
        for at in range(SIDES):
            a, b = ring * SIDES + at, ring * SIDES + (at + 1) % SIDES
            faces.append((a, b, b + SIDES, a + SIDES))
    return _shape(corners, faces)


def _shape(corners: Floats, faces: "list[tuple[int, ...]] | tuple[tuple[int, ...], ...]") -> Solid:
    most = max(map(len, faces))
    padded = np.array([(*face, *(face[-1],) * (most - len(face))) for face in faces])
    first, second = (corners[padded[:, at + 1]] - corners[padded[:, at]] for at in (0, 1))
    normals = np.cross(first, second)
    return Solid(corners, padded, normals / np.linalg.norm(normals, axis=1, keepdims=True))
