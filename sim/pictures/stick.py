"""The stick figure of the arm: three orthographic projections and a perspective, as SVG.

In: PRIMITIVE's nine numbers of the wrist plate, and what the figure needs besides: how far the hand is open, the joints
that bring the plate there, what stands around. Out: an SVG document. It is drawn from what PRIMITIVE orders, not from
what a robot does, "even when the robot is not available" (Haynes et al. 1984, section 10). Lengths are millimetres.

The views lie as on a drawing in third-angle projection: top above front, the robot's left side to the right of front;
all three have one scale. Lines are drawn in `currentColor`, so that a page may be light or dark.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from math import isfinite

from rcsc.database.ask import Station
from rcsc.database.pose import Pose, Vector, apply, cross, dot, minus, pose_of, unit
from sim.arm import Joints, skeleton

TOOL_MM = 165.0
PALM_MM = 70.0
"""From the plate to where the fingers begin."""
GRID_MM = 200.0
LOW_MM: Vector = (-500.0, -900.0, 0.0)
HIGH_MM: Vector = (1100.0, 900.0, 1400.0)
"""The drawn part of the room."""
SCALE = 0.2
"""Pixels to a millimetre, in the three projections."""
GAP_PX = 26.0
_EYE_MM: Vector = (3200.0, -2200.0, 2300.0)
_LOOK_MM: Vector = (260.0, 0.0, 560.0)
_ZOOM_PX = 930.0
_ARM, _PLATE, _FINGER, _TRAIL = "#2f7fd0", "#d9822b", "#2ca05a", "#a06cc8"
"""Mid tones, to be told apart on white and on black."""

_PEN = 'fill="none" stroke-linecap="round" stroke-linejoin="round" font-family="sans-serif" font-size="11"'

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Outline:
    """Something that stands there: a closed line and its name."""

    name: str
    corners_mm: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """What stands still, or is known from elsewhere.

    Attributes:
        outlines: Stations, and whatever else is to be seen.
        trail_mm: Where the middle of the pads was, oldest first.
        tool_mm: From the wrist plate to the middle of the pads.
    """

    outlines: tuple[Outline, ...] = ()
    trail_mm: tuple[Vector, ...] = ()
    tool_mm: float = TOOL_MM


_NOTHING = Scene()


@dataclass(frozen=True, slots=True)
class View:
    """A flat picture of the room.

    Attributes:
        name: What stands below it.
        right: Towards the right of the picture.
        up: Towards its top.
        left_px: Of the page, where the picture begins.
        top_px: Of the page.
        size_px: Width and height.
        axes: Names of the axes to the right and up, with sign.
    """

    name: str
    right: Vector
    up: Vector
    left_px: float
    top_px: float
    size_px: Point
    axes: tuple[str, str]

    def flat(self, at: Vector) -> Point:
        """The pixel of a point."""
        across = min(dot(self.right, LOW_MM), dot(self.right, HIGH_MM))
        top = max(dot(self.up, LOW_MM), dot(self.up, HIGH_MM))
        return (
            self.left_px + (dot(self.right, at) - across) * SCALE,
            self.top_px + (top - dot(self.up, at)) * SCALE,
        )


_X, _Y, _Z = (high - low for low, high in zip(LOW_MM, HIGH_MM, strict=True))
_WIDE, _DEEP, _HIGH = _Y * SCALE, _X * SCALE, _Z * SCALE
_SECOND_PX, _LOWER_PX = 2 * GAP_PX + _WIDE, 2 * GAP_PX + _DEEP
TOP = View("top: xy", (0, 1, 0), (-1, 0, 0), GAP_PX, GAP_PX, (_WIDE, _DEEP), ("+y", "\N{MINUS SIGN}x"))
FRONT = View("front: yz", (0, 1, 0), (0, 0, 1), GAP_PX, _LOWER_PX, (_WIDE, _HIGH), ("+y", "+z"))
SIDE = View(
    "side: xz", (-1, 0, 0), (0, 0, 1), _SECOND_PX, _LOWER_PX, (_DEEP, _HIGH), ("\N{MINUS SIGN}x", "+z")
)
WIDTH_PX, HEIGHT_PX = round(_SECOND_PX + _DEEP + GAP_PX), round(_LOWER_PX + _HIGH + GAP_PX)


@dataclass(frozen=True, slots=True)
class Perspective:
    """The same as an eye sees it; a picture like a `View`."""

    name: str
    left_px: float
    top_px: float
    size_px: Point
    axes: tuple[str, str] = ("", "")

    def flat(self, at: Vector) -> Point:
        """The pixel of a point."""
        forward = unit(minus(_LOOK_MM, _EYE_MM))
        right = unit(cross(forward, (0.0, 0.0, 1.0)))
        seen = apply((right, cross(right, forward), forward), minus(at, _EYE_MM))
        far = max(seen[2], 1.0)
        middle = (self.left_px + self.size_px[0] / 2, self.top_px + self.size_px[1] / 2)
        return (middle[0] + _ZOOM_PX * seen[0] / far, middle[1] - _ZOOM_PX * seen[1] / far)


PERSPECTIVE = Perspective("perspective", _SECOND_PX, GAP_PX, (_DEEP, _DEEP))
PICTURES: tuple[View | Perspective, ...] = (TOP, PERSPECTIVE, FRONT, SIDE)


@dataclass(frozen=True, slots=True)
class _Figure:
    """Lines of the robot in the room, by what they stand for."""

    arm: tuple[Vector, ...] = ()
    triangle: tuple[Vector, ...] = ()
    fingers: tuple[tuple[Vector, ...], ...] = ()
    notes: list[str] = field(default_factory=list)


def outline(station: Station) -> Outline:
    """The top of a station."""
    long, wide = station.size_mm[0] / 2, station.size_mm[1] / 2
    corners = ((-long, -wide), (long, -wide), (long, wide), (-long, wide))
    return Outline(station.name, tuple(station.frame.point((x, y, 0.0)) for x, y in corners))


def pads(plate: Pose, tool_mm: float = TOOL_MM) -> Vector:
    """The middle of the pads: a point of the trail."""
    return plate.point((0.0, 0.0, tool_mm))


def stick(
    plate_mm: Sequence[float], opening_mm: float, joints: Joints | None, scene: Scene = _NOTHING
) -> str:
    """The figure, as an SVG document.

    Args:
        plate_mm: The nine numbers: the plate's centre, a point along the tool, a point along the plate's x.
        opening_mm: Between the pads.
        joints: In rad, those that bring the plate there; None where none do: then the arm is not drawn, and it says so.
        scene: What stands around.
    """
    figure = _figure(plate_mm, opening_mm, joints, scene.tool_mm)
    size = f'viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" width="{WIDTH_PX}" height="{HEIGHT_PX}"'
    return "\n".join((
        f'<svg xmlns="http://www.w3.org/2000/svg" class="stick" {size} {_PEN}>',
        *(line for picture in PICTURES for line in _picture(picture, figure, scene)),
        *(
            f'<text class="note" x="{GAP_PX:g}" y="{16 + 14 * at}" fill="{_PLATE}">{escape(note)}</text>'
            for at, note in enumerate(figure.notes)
        ),
        "</svg>\n",
    ))  # fmt: skip


def _figure(plate_mm: Sequence[float], opening_mm: float, joints: Joints | None, tool_mm: float) -> _Figure:
    plate = pose_of(plate_mm) if all(isfinite(value) for value in plate_mm) else None
    if plate is None:
        return _Figure(notes=["the nine numbers are no pose"])
    points: list[Vector] = [tuple(plate_mm[at : at + 3]) for at in (0, 3, 6)]  # type: ignore[misc]  # three each
    half = opening_mm / 2
    fingers = tuple(
        tuple(
            plate.point((0.0, y, z))
            for y, z in ((0.0, PALM_MM), (side * half, PALM_MM), (side * half, tool_mm))
        )
        for side in (-1.0, 1.0)
    )
    wrist = (plate.point((0.0, 0.0, 0.0)), plate.point((0.0, 0.0, PALM_MM)))
    if joints is None:
        return _Figure((), tuple(points), (*fingers, wrist), ["the arm cannot be there"])
    return _Figure(skeleton(joints), tuple(points), (*fingers, wrist))


# --- one picture ---


def _picture(picture: View | Perspective, figure: _Figure, scene: Scene) -> Iterator[str]:
    (width, height), left, top = picture.size_px, picture.left_px, picture.top_px
    yield f'<g class="view"><title>{escape(picture.name)}</title>'
    yield (
        f'<svg x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" '
        f'viewBox="{left:g} {top:g} {width:g} {height:g}">'
    )
    yield from _ground(picture)
    for one in scene.outlines:
        yield from _standing(picture, one)
    if isinstance(picture, Perspective) or picture is TOP:
        yield from (_name(picture, one) for one in scene.outlines)
    yield from _robot(picture, figure, scene)
    yield "</svg>"
    yield (
        f'<rect x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" stroke="currentColor" '
        'stroke-opacity=".35"/>'
    )
    yield _text(left, top + height + 13, escape(picture.name))
    if picture.axes != ("", ""):
        yield _text(left + width, top + height + 13, f"{picture.axes[0]} →", "end")
        yield _text(left + 4, top + 12, f"↑ {picture.axes[1]}")
    yield "</g>"


def _robot(picture: View | Perspective, figure: _Figure, scene: Scene) -> Iterator[str]:
    if len(scene.trail_mm) > 1:
        yield _line(
            picture, scene.trail_mm, "trail", f'stroke="{_TRAIL}" stroke-width="1" stroke-opacity=".8"'
        )
    if figure.arm:
        yield _line(picture, figure.arm, "arm", f'stroke="{_ARM}" stroke-width="4"')
        for x, y in map(picture.flat, figure.arm):
            yield f'<circle class="joint" cx="{x:.1f}" cy="{y:.1f}" r="3.4" fill="{_ARM}"/>'
    if figure.triangle:
        look = f'stroke="{_PLATE}" stroke-width="1.6" fill="{_PLATE}" fill-opacity=".35"'
        yield _line(picture, figure.triangle, "plate", look, close=True)
    for finger in figure.fingers:
        yield _line(picture, finger, "finger", f'stroke="{_FINGER}" stroke-width="2.4"')


def _ground(picture: View | Perspective) -> Iterator[str]:
    """The grid of the floor; a line where it is seen from its edge."""
    xs, ys = (_marks(LOW_MM[at], HIGH_MM[at]) for at in (0, 1))
    lines: list[tuple[Vector, Vector]] = [((x, LOW_MM[1], 0.0), (x, HIGH_MM[1], 0.0)) for x in xs]
    lines += [((LOW_MM[0], y, 0.0), (HIGH_MM[0], y, 0.0)) for y in ys]
    path = ""
    for ends in lines:
        (a, b), (c, d) = map(picture.flat, ends)
        path += f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" if abs(a - c) + abs(b - d) > 1.0 else ""
    yield f'<path class="grid" d="{path}" stroke="currentColor" stroke-opacity=".18" stroke-width=".8"/>'


def _standing(picture: View | Perspective, one: Outline) -> Iterator[str]:
    """An outline, and plumb lines from its corners to the floor."""
    yield _line(picture, one.corners_mm, "station", 'stroke="currentColor" stroke-opacity=".65"', close=True)
    if picture is not TOP:
        legs = ""
        for corner in one.corners_mm:
            (a, b), (c, d) = picture.flat(corner), picture.flat((corner[0], corner[1], 0.0))
            legs += f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}"
        yield f'<path class="leg" d="{legs}" stroke="currentColor" stroke-opacity=".28" stroke-dasharray="2 4"/>'


def _marks(low: float, high: float) -> list[float]:
    first, last = int(low // GRID_MM), int(high // GRID_MM)
    return [GRID_MM * at for at in range(first, last + 1) if low <= GRID_MM * at <= high]


def _line(
    picture: View | Perspective, points: Sequence[Vector], kind: str, look: str, *, close: bool = False
) -> str:
    said = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(picture.flat, points))
    return f'<{"polygon" if close else "polyline"} class="{kind}" points="{said}" {look}/>'


def _name(picture: View | Perspective, one: Outline) -> str:
    """The name of what stands there, in its middle."""
    corners = [picture.flat(corner) for corner in one.corners_mm]
    x, y = (sum(corner[at] for corner in corners) / len(corners) for at in (0, 1))
    return _text(x, y + 4, escape(one.name), "middle", "9")


def _text(x: float, y: float, said: str, anchor: str = "start", size: str = "11") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="currentColor" '
        f'fill-opacity=".75">{said}</text>'
    )
