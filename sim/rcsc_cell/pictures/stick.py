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

from rcsc_cell.cell.arm import Joints, skeleton
from rcsc_cell.database.pose import Pose, Vector, pose_of
from rcsc_cell.pictures.room import (
    GAP_PX,
    PICTURES,
    TOP,
    Block,
    Mark,
    Outline,
    Perspective,
    View,
    ground,
    line,
    lying,
    name,
    page_px,
    pointed_at,
    scale,
    standing,
    text,
)

TOOL_MM = 165.0
PALM_MM = 70.0
"""From the plate to where the fingers begin."""
_ARM, _PLATE, _FINGER, _TRAIL = "#2f7fd0", "#d9822b", "#2ca05a", "#a06cc8"
"""Mid tones, to be told apart on white and on black."""

_PEN = 'fill="none" stroke-linecap="round" stroke-linejoin="round" font-family="sans-serif" font-size="11"'


@dataclass(frozen=True, slots=True)
class Scene:
    """What stands still, or is known from elsewhere.

    Attributes:
        outlines: Stations, and whatever else is to be seen.
        trail_mm: Where the middle of the pads was, oldest first.
        tool_mm: From the wrist plate to the middle of the pads.
        parts: What lies about.
        marks: Places that are spoken of.
    """

    outlines: tuple[Outline, ...] = ()
    trail_mm: tuple[Vector, ...] = ()
    tool_mm: float = TOOL_MM
    parts: tuple[Block, ...] = ()
    marks: tuple[Mark, ...] = ()


_NOTHING = Scene()


@dataclass(frozen=True, slots=True)
class _Figure:
    """Lines of the robot in the room, by what they stand for."""

    arm: tuple[Vector, ...] = ()
    triangle: tuple[Vector, ...] = ()
    fingers: tuple[tuple[Vector, ...], ...] = ()
    notes: list[str] = field(default_factory=list)


def pads(plate: Pose, tool_mm: float = TOOL_MM) -> Vector:
    """The middle of the pads: a point of the trail."""
    return plate.point((0.0, 0.0, tool_mm))


def stick(
    plate_mm: Sequence[float],
    opening_mm: float,
    joints: Joints | None,
    scene: Scene = _NOTHING,
    pictures: Sequence[View | Perspective] = PICTURES,
) -> str:
    """The figure, as an SVG document.

    Args:
        plate_mm: The nine numbers: the plate's centre, a point along the tool, a point along the plate's x.
        opening_mm: Between the pads.
        joints: In rad, those that bring the plate there; None where none do: then the arm is not drawn, and it says so.
        scene: What stands around.
        pictures: Which to draw.
    """
    figure = _figure(plate_mm, opening_mm, joints, scene.tool_mm)
    width, height = page_px(pictures)
    size = f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"'
    return "\n".join((
        f'<svg xmlns="http://www.w3.org/2000/svg" class="stick" {size} {_PEN}>',
        *(drawn for picture in pictures for drawn in _picture(picture, figure, scene)),
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
    yield from ground(picture)
    for outline in scene.outlines:
        yield from standing(picture, outline)
    for part in scene.parts:
        yield from lying(picture, part)
    if isinstance(picture, Perspective) or picture is TOP:
        yield from (name(picture, outline) for outline in scene.outlines)
    yield from _robot(picture, figure, scene)
    yield from pointed_at(picture, scene.marks)
    yield "</svg>"
    if left:  # a picture that fills the page has no frame, nor room for words beneath it
        yield (
            f'<rect x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" stroke="currentColor" '
            'stroke-opacity=".35"/>'
        )
        yield text((left, top + height + 13), escape(picture.name))
    if isinstance(picture, View):
        yield from scale(picture)
    if picture.axes != ("", ""):
        yield text((left + width, top + height + 13), f"{picture.axes[0]} →", "end")
        yield text((left + 4, top + 12), f"↑ {picture.axes[1]}")
    yield "</g>"


def _robot(picture: View | Perspective, figure: _Figure, scene: Scene) -> Iterator[str]:
    if len(scene.trail_mm) > 1:
        yield line(
            picture, scene.trail_mm, "trail", f'stroke="{_TRAIL}" stroke-width="1" stroke-opacity=".8"'
        )
    if figure.arm:
        yield line(picture, figure.arm, "arm", f'stroke="{_ARM}" stroke-width="4"')
        for x, y in map(picture.flat, figure.arm):
            yield f'<circle class="joint" cx="{x:.1f}" cy="{y:.1f}" r="3.4" fill="{_ARM}"/>'
    if figure.triangle:
        look = f'stroke="{_PLATE}" stroke-width="1.6" fill="{_PLATE}" fill-opacity=".35"'
        yield line(picture, figure.triangle, "plate", look, close=True)
    for finger in figure.fingers:
        yield line(picture, finger, "finger", f'stroke="{_FINGER}" stroke-width="2.4"')
