"""The room as pictures see it: three projections of one scale, as on a drawing in third-angle projection, and a perspective.

In: points of the base's axes, in mm. Out: pixels, and lines and words of SVG there. Words are in `currentColor`, so that a page may be
light or dark.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rcsc_cell.database.pose import Vector, apply, cross, dot, minus, unit

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
