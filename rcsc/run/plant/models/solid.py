"""A MuJoCo model as a solid picture: SVG, drawn with numpy alone, the same text for the same state.

In: a model and its data. Out: an SVG document. Boxes, cylinders, capsules, balls and planes are drawn; groups from 3 up, the shapes
for collisions only, are not. The picture needs no graphics driver, so that it can be had on any machine.

What is near is drawn later, and hides what is far (the painter's algorithm). Shapes are convex solids. Two that a face's plane parts are
ordered by that plane, whatever their distances: the one on the eye's side is drawn later. Solids that reach into each other are ordered
face by face in the same way, and by distance where that says nothing. Lengths are metres.

Source: Newell, Newell and Sancha, "A solution to the hidden surface problem", ACM 1972: the tests by planes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import radians, tan
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.intp]
Bools = NDArray[np.bool_]


# --- convex solids ---

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
    return _solid_of(corners, _BOX_FACES)


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
    return _solid_of(corners, faces)


def _solid_of(corners: Floats, faces: "list[tuple[int, ...]] | tuple[tuple[int, ...], ...]") -> Solid:
    most = max(map(len, faces))
    padded = np.array([(*face, *(face[-1],) * (most - len(face))) for face in faces])
    first, second = (corners[padded[:, at + 1]] - corners[padded[:, at]] for at in (0, 1))
    normals = np.cross(first, second)
    return Solid(corners, padded, normals / np.linalg.norm(normals, axis=1, keepdims=True))


# --- from far to near ---

TOUCH_M = 0.001
"""Solids that rest on each other sink into each other by less."""


@dataclass(frozen=True, slots=True)
class _Scene:
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


def _painted(scene: _Scene, eye: Floats, boxes: Floats, shown: Integers) -> list[int]:
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


def _solids(scene: _Scene, above: Floats, towards: Bools) -> tuple[Bools, Bools]:
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


# --- the picture ---

DRAWN_GROUPS = (0, 1, 2)
NEAR_M = 0.05
"""What is nearer to the eye than that is not drawn."""
FLOOR_M = 1.6
"""A floor without end is drawn so far to each side."""
GRID_M = 0.2
AMBIENT = 0.4
LIGHT = np.array((1.0, -1.4, 2.8)) / np.sqrt(10.8)
"""Where the light comes from, one long."""
_BACKGROUND = "#e9edf0"
_FLOOR, _FLOOR_LINE = "#d3d8dc", "#b9c0c6"


@dataclass(frozen=True, slots=True)
class View:
    """The point of view on the cell.

    Attributes:
        eye_m: Where the eye is.
        look_m: What stands in the middle of the picture.
        width_px: Of the picture.
        height_px: Of the picture.
        field_deg: From the picture's lower edge to its upper.
    """

    eye_m: tuple[float, float, float]
    look_m: tuple[float, float, float]
    width_px: int = 720
    height_px: int = 520
    field_deg: float = 40.0


OVERVIEW = View((1.75, -1.15, 1.5), (0.32, 0.0, 0.52), field_deg=44.0)


@dataclass(frozen=True, slots=True)
class _Camera:
    """Rows: right, up and forward of the eye, seen from the base; and pixels to one at distance one."""

    eye: Floats
    axes: Floats
    scale: float
    middle: tuple[float, float]

    def seen(self, points: Floats) -> Floats:
        """Return points as seen by the eye: right, up, distance."""
        return np.asarray((points - self.eye) @ self.axes.T)

    def flat(self, seen: Floats) -> Floats:
        """Return the pixels of points before the eye; shape (..., 2)."""
        across = seen[..., :2] / seen[..., 2:] * (self.scale, -self.scale)
        return np.asarray(across + self.middle)


def solid(model: Any, data: Any, view: View = OVERVIEW) -> str:
    """Draw the model as an SVG document.

    Args:
        model: An `MjModel`.
        data: Its `MjData`; `geom_xpos` and `geom_xmat` must be fresh (`mj_forward` or `mj_kinematics`).
        view: From where.
    """
    camera = _camera(view)
    size = f'viewBox="0 0 {view.width_px} {view.height_px}" width="{view.width_px}" height="{view.height_px}"'
    return "\n".join((
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>',
        f'<rect class="sky" width="100%" height="100%" fill="{_BACKGROUND}"/>',
        *_floors(model, data, camera),
        *_bodies(model, data, camera),
        "</svg>\n",
    ))  # fmt: skip


def _camera(view: View) -> _Camera:
    eye = np.array(view.eye_m)
    forward = np.array(view.look_m) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    scale = view.height_px / 2 / tan(radians(view.field_deg) / 2)
    axes = np.stack((right, np.cross(right, forward), forward))
    return _Camera(eye, axes, scale, (view.width_px / 2, view.height_px / 2))


# --- bodies ---


def _bodies(model: Any, data: Any, camera: _Camera) -> Iterator[str]:
    shapes, colours, places = [], [], []
    for geom in range(model.ngeom):
        if int(model.geom_group[geom]) not in DRAWN_GROUPS:
            continue
        shape = _shape(int(model.geom_type[geom]), [float(value) for value in model.geom_size[geom]])
        if shape is not None:
            shapes.append(shape)
            colours.append(_colour(model, geom))
            places.append((np.array(data.geom_xmat[geom]).reshape(3, 3), np.array(data.geom_xpos[geom])))
    if shapes:
        yield from _polygons(_scene(shapes, places), np.array(colours), camera)


def _shape(kind: int, size: list[float]) -> Solid | None:
    """Return the solid of a geom; None for one that is not drawn."""
    match mujoco.mjtGeom(kind):
        case mujoco.mjtGeom.mjGEOM_BOX:
            return box(*size)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return cylinder(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return capsule(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return capsule(size[0], 0.0)
        case _:
            return None


def _colour(model: Any, geom: int) -> Floats:
    material = int(model.geom_matid[geom])
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    return np.array(rgba[:3], dtype=np.float64)


def _scene(shapes: Sequence[Solid], places: Sequence[tuple[Floats, Floats]]) -> _Scene:
    corners = [len(shape.corners) for shape in shapes]
    faces = [len(shape.faces) for shape in shapes]
    first_corner = np.cumsum([0, *corners[:-1]])
    most = max(shape.faces.shape[1] for shape in shapes)
    return _Scene(
        np.vstack([shape.corners @ turn.T + at for shape, (turn, at) in zip(shapes, places, strict=True)]),
        np.vstack([
            np.pad(shape.faces + first, ((0, 0), (0, most - shape.faces.shape[1])), mode="edge")
            for shape, first in zip(shapes, first_corner, strict=True)
        ]),
        np.vstack([shape.normals @ turn.T for shape, (turn, _) in zip(shapes, places, strict=True)]),
        np.repeat(np.arange(len(shapes)), faces),
        np.cumsum([0, *faces[:-1]]),
        first_corner,
    )  # fmt: skip


def _polygons(scene: _Scene, colours: Floats, camera: _Camera) -> Iterator[str]:
    shown, flat = _shown(scene, camera)
    boxes = np.concatenate((flat.min(axis=1), flat.max(axis=1)), axis=1)
    # faces in the shade differ, too
    light = AMBIENT + (1 - AMBIENT) * (0.5 + 0.5 * scene.normals @ LIGHT) ** 1.5
    shades = np.clip(colours[scene.solid] * light[:, None] * 255, 0, 255).astype(int)
    where = {int(face): at for at, face in enumerate(shown)}
    for face in _painted(scene, camera.eye, boxes, shown):
        red, green, blue = (int(value) for value in shades[face])
        yield _polygon(flat[where[face]], f"#{red:02x}{green:02x}{blue:02x}")


def _shown(scene: _Scene, camera: _Camera) -> tuple[Integers, Floats]:
    """Return the faces that are turned to the eye, before it and in the picture, and their corners in pixels."""
    seen = camera.seen(scene.corners)
    from_eye = camera.eye - scene.corners[scene.faces[:, 0]]
    towards = np.einsum("ij,ij->i", scene.normals, from_eye) > 0.0
    facing = np.flatnonzero(towards & (seen[scene.faces, 2] > NEAR_M).all(axis=1))
    flat = camera.flat(seen[scene.faces[facing]])
    within = (flat.max(axis=1) > 0.0) & (flat.min(axis=1) < np.array(camera.middle) * 2)
    kept = within.all(axis=1)
    return facing[kept], flat[kept]


def _polygon(points: Floats, colour: str) -> str:
    """Draw a face, its edge in its own colour: else hairlines would show between neighbours."""
    corners: list[str] = []
    for x, y in points.tolist():
        corner = f"{x:.1f},{y:.1f}"
        if not corners or corners[-1] != corner:  # a padded face repeats its last corner
            corners.append(corner)
    return f'<polygon points="{" ".join(corners)}" fill="{colour}" stroke="{colour}" stroke-width=".5"/>'


# --- floors ---


def _floors(model: Any, data: Any, camera: _Camera) -> Iterator[str]:
    for geom in range(model.ngeom):
        kind = mujoco.mjtGeom(int(model.geom_type[geom]))
        if kind == mujoco.mjtGeom.mjGEOM_PLANE and int(model.geom_group[geom]) in DRAWN_GROUPS:
            turn, at = np.array(data.geom_xmat[geom]).reshape(3, 3), np.array(data.geom_xpos[geom])
            half = [min(float(size) or FLOOR_M, FLOOR_M) for size in model.geom_size[geom][:2]]
            yield from _floor(turn, at, (half[0], half[1]), camera)


def _floor(turn: Floats, at: Floats, half: tuple[float, float], camera: _Camera) -> Iterator[str]:
    """Draw a plane of such half sides, and its grid."""

    def flat(points: Sequence[tuple[float, float]]) -> str:
        inside = np.array([(x, y, 0.0) for x, y in points])
        ahead = _ahead(camera.seen(inside @ turn.T + at))
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in camera.flat(ahead).tolist()) if len(ahead) else ""

    long, wide = half
    yield (
        f'<polygon class="floor" points="{flat([(-long, -wide), (long, -wide), (long, wide), (-long, wide)])}" '
        f'fill="{_FLOOR}"/>'
    )
    lines = [[(x, -wide), (x, wide)] for x in _marks(long)] + [[(-long, y), (long, y)] for y in _marks(wide)]
    path = "".join(f"M{ends.replace(' ', 'L')}" for line in lines if (ends := flat(line)))
    yield f'<path class="tiles" d="{path}" fill="none" stroke="{_FLOOR_LINE}" stroke-width=".7"/>'


def _marks(half: float) -> list[float]:
    many = int(half / GRID_M + 1e-9)
    return [GRID_M * at for at in range(-many, many + 1)]


def _ahead(seen: Floats) -> Floats:
    """Clip a polygon or line to what lies before the eye.

    Source: Sutherland and Hodgman, "Reentrant polygon clipping", CACM 1974, for one plane.
    """
    kept: list[Floats] = []
    for a, b in zip(seen, np.roll(seen, -1, axis=0), strict=True):
        if a[2] >= NEAR_M:
            kept.append(a)
        if (a[2] < NEAR_M) != (b[2] < NEAR_M) and (len(seen) > 2 or a is not seen[-1]):
            kept.append(a + (b - a) * ((NEAR_M - a[2]) / (b[2] - a[2])))
    return np.array(kept)
