"""What stands about in the room, drawn as lines: its floor, stations, parts, and places that are pointed at.

In: things, and a picture of the room. Out: lines of SVG.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from rcsc_cell.database.ask import Station
from rcsc_cell.database.pose import Pose, Vector
from rcsc_cell.pictures.views import HIGH_MM, LOW_MM, TOP, Perspective, Point, View, line, text

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
    """Places: a ring each, its plumb line to the floor, its name; names that would lie on another's stand above it."""
    taken: list[Point] = []
    for mark in marks:
        x, y = picture.flat(mark.at_mm)
        if picture is not TOP:
            path = _plumb(picture, mark.at_mm, 0.0)
            yield f'<path class="plumb" d="{path}" stroke="{NAMED}" stroke-opacity=".7" stroke-dasharray="3 3"/>'
        wide_px = _LETTER_PX * len(mark.name)
        left = x + 20 + wide_px > picture.left_px + picture.size_px[0]
        side = -1 if left else 1
        low = y - 26
        while any(abs(low - other) < _LINE_PX and abs(x - at) < 2 * wide_px + 40 for at, other in taken):
            low -= _LINE_PX
        taken.append((x, low))
        yield f'<path class="leader" d="M{x + 4 * side:.1f} {y - 4:.1f}L{x + 18 * side:.1f} {low:.1f}" stroke="{NAMED}"/>'
        yield f'<circle class="mark" cx="{x:.1f}" cy="{y:.1f}" r="5.5" stroke="{NAMED}" stroke-width="2"/>'
        yield text((x + 20 * side, low), escape(mark.name), "end" if left else "start", "12", NAMED)


def name(picture: View | Perspective, outline: Outline) -> str:
    """The name of what stands there, in its middle."""
    corners = [picture.flat(corner) for corner in outline.corners_mm]
    x, y = (sum(corner[at] for corner in corners) / len(corners) for at in (0, 1))
    return text((x, y + 4), escape(outline.name), "middle", "9")


def _plumb(picture: View | Perspective, top: Vector, floor_mm: float) -> str:
    (a, b), (c, d) = picture.flat(top), picture.flat((top[0], top[1], floor_mm))
    return f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}"
