"""Order faces for the painter's algorithm: what is near is drawn later, and hides what is far.

In: the faces of convex solids, and where the eye is. Out: an order of the faces. Two solids that a face's plane parts
are ordered by that plane, whatever their distances: the one on the eye's side is drawn later. Solids that reach
into each other are ordered face by face in the same way, and by distance where that says nothing.

Source: Newell, Newell and Sancha, "A solution to the hidden surface problem", ACM 1972: the tests by planes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rcsc.run.plant.models.shapes import Floats, Integers

Bools = NDArray[np.bool_]

TOUCH_M = 0.001
"""Solids that rest on each other sink into each other by less."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Every face of a scene, and its solid; faces and corners of a solid stand together.

    Attributes:
        corners: Shape (corners, 3), in m.
        faces: Indices of corners, shape (faces, most).
        normals: Outward, shape (faces, 3).
        solid: Which solid a face belongs to, shape (faces,).
        first_face: Of each solid.
        first_corner: Of each solid.
    """

    corners: Floats
    faces: Integers
    normals: Floats
    solid: Integers
    first_face: Integers
    first_corner: Integers


def painted(scene: Faces, eye: Floats, boxes: Floats, shown: Integers) -> list[int]:
    """Return the faces to draw, the farthest first.

    Args:
        scene: All faces.
        eye: Shape (3,), in m.
        boxes: Where each shown face is on the picture: least x and y, greatest x and y; shape (shown, 4).
        shown: The faces that are turned to the eye.
    """
    offsets = np.einsum("ij,ij->i", scene.normals, scene.corners[scene.faces[:, 0]])
    above = scene.corners @ scene.normals.T - offsets  # of each corner over each face's plane
    towards = scene.normals @ eye - offsets > 0.0
    behind, mixed = _solids(scene, above, towards)
    owner = scene.solid[shown]
    first = behind[np.ix_(owner, owner)]
    tangled = mixed[np.ix_(owner, owner)]
    if tangled.any():
        first |= tangled & _faces(above[:, shown], scene.faces[shown])
    middle = scene.corners[scene.faces[shown]].mean(axis=1)
    return [int(shown[at]) for at in _sorted(first & _meet(boxes), np.linalg.norm(middle - eye, axis=1))]


def _solids(scene: Faces, above: Floats, towards: Bools) -> tuple[Bools, Bools]:
    """Return whether one solid is behind another, and whether no plane of a face parts the two; shape (solids, solids)."""
    outside = np.minimum.reduceat(above, scene.first_corner, axis=0) >= -TOUCH_M
    covers = np.logical_or.reduceat(outside & towards, scene.first_face, axis=1)
    covered = np.logical_or.reduceat(outside & ~towards, scene.first_face, axis=1)
    behind, before = covers.T | covered, covered.T | covers
    mixed = ~(behind | before)
    np.fill_diagonal(mixed, val=False)
    return behind & ~before, mixed


def _faces(above: Floats, faces: Integers) -> Bools:
    """Return whether one face can only be behind another; `above` has the faces' own planes only."""
    heights = above[faces]
    over = heights.min(axis=1) >= -TOUCH_M
    under = heights.max(axis=1) <= TOUCH_M
    behind = over.T | under
    return np.asarray(behind & ~behind.T)


def _meet(boxes: Floats) -> Bools:
    """Return whether the rectangles around two faces overlap."""
    low, high = boxes[:, None, :2], boxes[None, :, 2:]
    apart = (low >= high).any(axis=2)
    return np.asarray(~(apart | apart.T))


def _sorted(first: Bools, far: Floats) -> list[int]:
    """Return an order that keeps every ordered pair: the farthest of those that may come next; a ring is cut at its farthest."""
    waits = first.sum(axis=0, dtype=np.int64)
    rank = np.where(waits == 0, far, -np.inf)
    left = np.ones(len(far), dtype=np.bool_)
    order: list[int] = []
    for _ in range(len(far)):
        at = int(rank.argmax())
        if rank[at] == -np.inf:
            at = int(np.where(left, far, -np.inf).argmax())
        order.append(at)
        left[at], rank[at] = False, -np.inf
        freed = np.flatnonzero(first[at])
        waits[freed] -= 1
        freed = freed[(waits[freed] == 0) & left[freed]]
        rank[freed] = far[freed]
    return order
