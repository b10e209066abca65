"""The room as pictures see it, and what stands about in it, drawn as lines: floor, stations, parts, places that are pointed at.

There are three projections of one scale, as on a drawing in third-angle projection, and a perspective. In: points of the base's axes, in
mm, and things. Out: pixels, and lines and words of SVG there. Words are in `currentColor`, so that a page may be light or dark.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from rcsc_cell.database.ask import Station
from rcsc_cell.database.pose import Pose, Vector, apply, cross, dot, minus, unit

LOW_MM: Vector = (-500.0, -900.0, 0.0)
HIGH_MM: Vector = (1100.0, 900.0, 1400.0)
"""The drawn part of the room."""
SCALE = 0.2
"""Pixels to a millimetre, in the three projections."""
GAP_PX = 26.0

Point = tuple[float, float]


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


BAR_MM = 500
"""The length that is drawn beside its name, in each projection."""
_STEP_MM, _NUMBERED_MM = 200, 400

_X, _Y, _Z = (high - low for low, high in zip(LOW_MM, HIGH_MM, strict=True))
_WIDE, _DEEP, _HIGH = _Y * SCALE, _X * SCALE, _Z * SCALE
_SECOND_PX, _LOWER_PX = 2 * GAP_PX + _WIDE, 2 * GAP_PX + _DEEP
TOP = View("top: xy", (0, 1, 0), (-1, 0, 0), GAP_PX, GAP_PX, (_WIDE, _DEEP), ("+y", "\N{MINUS SIGN}x"))
FRONT = View("front: yz", (0, 1, 0), (0, 0, 1), GAP_PX, _LOWER_PX, (_WIDE, _HIGH), ("+y", "+z"))
SIDE = View(
    "side: xz", (-1, 0, 0), (0, 0, 1), _SECOND_PX, _LOWER_PX, (_DEEP, _HIGH), ("\N{MINUS SIGN}x", "+z")
)


@dataclass(frozen=True, slots=True)
class Perspective:
    """The same as an eye sees it; a picture like a `View`."""

    name: str
    left_px: float
    top_px: float
    size_px: Point
    axes: tuple[str, str] = ("", "")
    eye_mm: Vector = (3200.0, -2200.0, 2300.0)
    look_mm: Vector = (260.0, 0.0, 560.0)
    zoom_px: float = 930.0

    def flat(self, at: Vector) -> Point:
        """The pixel of a point."""
        forward = unit(minus(self.look_mm, self.eye_mm))
        right = unit(cross(forward, (0.0, 0.0, 1.0)))
        seen = apply((right, cross(right, forward), forward), minus(at, self.eye_mm))
        far = max(seen[2], 1.0)
        middle = (self.left_px + self.size_px[0] / 2, self.top_px + self.size_px[1] / 2)
        return (middle[0] + self.zoom_px * seen[0] / far, middle[1] - self.zoom_px * seen[1] / far)


PERSPECTIVE = Perspective("perspective", _SECOND_PX, GAP_PX, (_DEEP, _DEEP))
PICTURES: tuple[View | Perspective, ...] = (TOP, PERSPECTIVE, FRONT, SIDE)
ALONE: tuple[View | Perspective, ...] = (
    Perspective(
        "perspective",
        0.0,
        0.0,
        (460.0, 350.0),
        eye_mm=(2700.0, -1500.0, 3300.0),
        look_mm=(150.0, 0.0, 430.0),
        zoom_px=1150.0,
    ),
)
"""One picture where there is room for no more: from higher up, so that less stands behind the arm."""


def page_px(pictures: Sequence[View | Perspective]) -> tuple[int, int]:
    """Width and height of a page that holds these pictures, with a rim where they have one."""
    wide = max(picture.left_px + picture.size_px[0] for picture in pictures)
    high = max(picture.top_px + picture.size_px[1] for picture in pictures)
    rim = min(picture.left_px for picture in pictures)
    return round(wide + rim), round(high + rim)


def line(
    picture: View | Perspective, points: Sequence[Vector], kind: str, look: str, *, close: bool = False
) -> str:
    """Return points joined by lines, by one more where closed; `look` are attributes."""
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(picture.flat, points))
    return f'<{"polygon" if close else "polyline"} class="{kind}" points="{corners}" {look}/>'


def scale(picture: View) -> Iterator[str]:
    """Draw what lengths are: marks along two sides, with the coordinates of the base, and a bar with its length."""
    (width, height), left, top = picture.size_px, picture.left_px, picture.top_px
    for along, upward in ((picture.right, False), (picture.up, True)):
        axis = next(at for at in range(3) if along[at])
        first = -int(-LOW_MM[axis] // _STEP_MM) * _STEP_MM
        for mm in range(first, int(HIGH_MM[axis]), _STEP_MM):
            point = tuple(float(mm) if at == axis else LOW_MM[at] for at in range(3))
            x, y = picture.flat((point[0], point[1], point[2]))
            numbered = mm % _NUMBERED_MM == 0
            long = 6 if numbered else 3
            mark = f"M{left:.1f} {y:.1f}h{long}" if upward else f"M{x:.1f} {top + height:.1f}v{-long}"
            yield f'<path class="scale" d="{mark}" stroke="currentColor" stroke-opacity=".5"/>'
            if numbered and upward and top + 20 < y < top + height - 12:
                yield text((left + 8, y + 3), _signed(mm), size="10")
            if numbered and not upward and left + 24 < x < left + width - 12:
                yield text((x, top + height - 8), _signed(mm), "middle", size="10")
    end = left + width - 10
    bar = f"M{end - BAR_MM * SCALE:.1f} {top + 18:.1f}v-5m0 2.5h{BAR_MM * SCALE:.1f}m0 -2.5v5"
    yield f'<path class="bar" d="{bar}" stroke="currentColor" stroke-opacity=".75"/>'
    yield text((end - BAR_MM * SCALE / 2, top + 12), f"{BAR_MM} mm", "middle", size="10")


def _signed(number: int) -> str:
    return str(number).replace("-", "\N{MINUS SIGN}")


def text(at: Point, words: str, anchor: str = "start", size: str = "11", colour: str = "") -> str:
    """Return words of markup at a pixel; in the page's colour by default."""
    ink = f'fill="{colour}"' if colour else 'fill="currentColor" fill-opacity=".75"'
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" text-anchor="{anchor}" font-size="{size}" {ink}>{words}</text>'


# --- what stands about ---

GRID_MM = 200.0
_LETTER_PX, _LINE_PX = 7.0, 14.0
"""Of a mark's name: about how wide a letter is, and how far apart names stand."""
NAMED = "#c9308e"
"""What is named: a mid tone, to be told apart on white and on black."""


@dataclass(frozen=True, slots=True)
class Outline:
    """Something that stands there: a closed line and its name."""

    name: str
    corners_mm: tuple[Vector, ...]


@dataclass(frozen=True, slots=True)
class Block:
    """A part: its top, and how high it is; `named` where it is spoken of."""

    name: str
    top_mm: tuple[Vector, ...]
    height_mm: float
    named: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """A place that is spoken of."""

    name: str
    at_mm: Vector


def outline(station: Station) -> Outline:
    """The top of a station."""
    long, wide = station.size_mm[0] / 2, station.size_mm[1] / 2
    return Outline(station.name, _corners(station.frame, long, wide, 0.0))


def block(name: str, middle: Pose, size_mm: Vector, *, named: bool) -> Block:
    """A part by its middle and size."""
    long, wide, high = size_mm
    return Block(name, _corners(middle, long / 2, wide / 2, high / 2), high, named)


def _corners(frame: Pose, long: float, wide: float, z: float) -> tuple[Vector, ...]:
    corners = ((-long, -wide), (long, -wide), (long, wide), (-long, wide))
    return tuple(frame.point((x, y, z)) for x, y in corners)


# --- drawn ---


def ground(picture: View | Perspective) -> Iterator[str]:
    """The grid of the floor; a line where it is seen from its edge."""
    xs, ys = (_lines(LOW_MM[at], HIGH_MM[at]) for at in (0, 1))
    lines: list[tuple[Vector, Vector]] = [((x, LOW_MM[1], 0.0), (x, HIGH_MM[1], 0.0)) for x in xs]
    lines += [((LOW_MM[0], y, 0.0), (HIGH_MM[0], y, 0.0)) for y in ys]
    path = ""
    for ends in lines:
        (a, b), (c, d) = map(picture.flat, ends)
        path += f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" if abs(a - c) + abs(b - d) > 1.0 else ""
    yield f'<path class="grid" d="{path}" stroke="currentColor" stroke-opacity=".18" stroke-width=".8"/>'


def _lines(low: float, high: float) -> list[float]:
    first, last = int(low // GRID_MM), int(high // GRID_MM)
    return [GRID_MM * at for at in range(first, last + 1) if low <= GRID_MM * at <= high]


def standing(picture: View | Perspective, outline: Outline) -> Iterator[str]:
    """An outline, and plumb lines from its corners to the floor."""
    yield line(
        picture, outline.corners_mm, "station", 'stroke="currentColor" stroke-opacity=".65"', close=True
    )
    if picture is not TOP:
        legs = "".join(_plumb(picture, corner, 0.0) for corner in outline.corners_mm)
        yield f'<path class="leg" d="{legs}" stroke="currentColor" stroke-opacity=".28" stroke-dasharray="2 4"/>'


def lying(picture: View | Perspective, block: Block) -> Iterator[str]:
    """A part: its bottom, its sides and its top."""
    ink = NAMED if block.named else "currentColor"
    thin = f'stroke="{ink}" stroke-opacity=".75" stroke-width="1"'
    bottom = tuple((x, y, z - block.height_mm) for x, y, z in block.top_mm)
    yield line(picture, bottom, "bottom", thin, close=True)
    if picture is not TOP:
        sides = "".join(_plumb(picture, corner, corner[2] - block.height_mm) for corner in block.top_mm)
        yield f'<path class="side" d="{sides}" {thin}/>'
    kind = "part named" if block.named else "part"
    yield line(picture, block.top_mm, kind, f'{thin} fill="{ink}" fill-opacity=".3"', close=True)


def pointed_at(picture: View | Perspective, marks: Sequence[Mark]) -> Iterator[str]:
    """Places: a ring each, its plumb line to the floor, its name if it has one; names that would lie on another's stand above it."""
    taken: list[Point] = []
    for mark in marks:
        x, y = picture.flat(mark.at_mm)
        if picture is not TOP:
            path = _plumb(picture, mark.at_mm, 0.0)
            yield f'<path class="plumb" d="{path}" stroke="{NAMED}" stroke-opacity=".7" stroke-dasharray="3 3"/>'
        yield f'<circle class="mark" cx="{x:.1f}" cy="{y:.1f}" r="5.5" stroke="{NAMED}" stroke-width="2"/>'
        if not mark.name:
            continue
        wide_px = _LETTER_PX * len(mark.name)
        left = x + 20 + wide_px > picture.left_px + picture.size_px[0]
        side = -1 if left else 1
        low = y - 26
        while any(abs(low - other) < _LINE_PX and abs(x - at) < 2 * wide_px + 40 for at, other in taken):
            low -= _LINE_PX
        taken.append((x, low))
        yield f'<path class="leader" d="M{x + 4 * side:.1f} {y - 4:.1f}L{x + 18 * side:.1f} {low:.1f}" stroke="{NAMED}"/>'
        yield text((x + 20 * side, low), escape(mark.name), "end" if left else "start", "12", NAMED)


def name(picture: View | Perspective, outline: Outline) -> str:
    """The name of what stands there, in its middle."""
    corners = [picture.flat(corner) for corner in outline.corners_mm]
    x, y = (sum(corner[at] for corner in corners) / len(corners) for at in (0, 1))
    return text((x, y + 4), escape(outline.name), "middle", "9")


def _plumb(picture: View | Perspective, top: Vector, floor_mm: float) -> str:
    (a, b), (c, d) = picture.flat(top), picture.flat((top[0], top[1], floor_mm))
    return f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}"
