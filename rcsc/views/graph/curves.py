"""Arrows that go through nothing: a layout whose curves are cut at the boxes where they end, and led anew where they cross one.

In: boxes and arrows with a layout. Out: the layout, its curves changed. The layout program takes the whole of the box in which an arrow
ends for free ground, and at times leads a curve across another box; straight pieces, which it leads in another way, go round that.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from rcsc.views.graph.layout import Arrangement, Arrow, Frame, LayoutBox, Point, place

_Curve = tuple[Point, ...]
_STEPS = 100
"""Points of a curve that are tested: so dense that no letter lies between two."""
_INSET_PX, _TIP_PX = 1.0, 9.0


def clear(boxes: Sequence[LayoutBox], arrows: Sequence[Arrow], frames: Sequence[Frame] = ()) -> Arrangement:
    """Place rectangles and arrows so that no arrow goes through a rectangle, if the layout program finds a way.

    Raises:
        NoLayoutError: No layout program is there, or it failed.
    """
    placed = _cut(place(boxes, arrows, frames), boxes, arrows)
    crossing = [at for at, (curve, _) in enumerate(placed.curves) if _crosses(curve, placed, boxes)]
    if not crossing:
        return placed
    straight = _cut(place(boxes, arrows, frames, straight=True), boxes, arrows)
    if straight.centres != placed.centres:
        return placed
    better = {at for at in crossing if not _crosses(straight.curves[at][0], placed, boxes)}
    curves = [straight.curves[at] if at in better else curve for at, curve in enumerate(placed.curves)]
    return replace(placed, curves=tuple(curves))


def _crosses(curve: _Curve, placed: Arrangement, boxes: Sequence[LayoutBox]) -> bool:
    return any(
        _inside(point, box, centre)
        for point in _points(curve)
        for box, centre in zip(boxes, placed.centres, strict=True)
    )


def _inside(point: Point, box: LayoutBox, centre: Point) -> bool:
    half = box.width_px / 2 - _INSET_PX, box.height_px / 2 - _INSET_PX
    return abs(point[0] - centre[0]) <= half[0] and abs(point[1] - centre[1]) <= half[1]


def _points(curve: _Curve) -> Iterator[Point]:
    for at in range(0, len(curve) - 3, 3):
        for step in range(_STEPS + 1):
            yield _halves(curve[at : at + 4], step / _STEPS)[0][-1]


def _halves(piece: _Curve, t: float) -> tuple[_Curve, _Curve]:
    """Divide a piece of a Bezier curve in two (de Casteljau)."""
    rows = [list(piece)]
    while len(rows[-1]) > 1:
        rows.append(
            [
                (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]))
                for a, b in zip(rows[-1], rows[-1][1:], strict=False)
            ]
        )
    return tuple(row[0] for row in rows), tuple(row[-1] for row in reversed(rows))


# --- cut where an arrow ends --------------------------------------------------------------


def _cut(placed: Arrangement, boxes: Sequence[LayoutBox], arrows: Sequence[Arrow]) -> Arrangement:
    """Return the layout with each curve cut: from its last exit from the source's box to its first entry into the target's."""
    rooms = {box.name: (box, centre) for box, centre in zip(boxes, placed.centres, strict=True)}
    curves = [_between(*curve, rooms, arrow) for curve, arrow in zip(placed.curves, arrows, strict=True)]
    return replace(placed, curves=tuple(curves))


def _between(
    curve: _Curve, tip: Point, rooms: Mapping[str, tuple[LayoutBox, Point]], arrow: Arrow
) -> tuple[_Curve, Point]:
    goal, begin = rooms[arrow.target], rooms[arrow.source]
    until = _first(curve, lambda point: _inside(point, *goal))
    if until:
        tip = _halves(curve[until[0] : until[0] + 4], until[1])[0][-1]
        curve = _before(curve, *until)
        if arrow.tip:  # its tip is drawn from where the curve ends
            back = _first(curve, lambda point: _far(point, tip) < _TIP_PX)
            curve = _before(curve, *back) if back else curve
    since = _first(turned := curve[::-1], lambda point: _inside(point, *begin))
    if since:
        curve = _before(turned, *since)[::-1]
    return curve, tip


def _far(one: Point, other: Point) -> float:
    return float(((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2) ** 0.5)


def _first(curve: _Curve, holds: Callable[[Point], bool]) -> tuple[int, float] | None:
    """Find the piece, and the way along it, just before a condition first holds; None where it never does, or holds from the beginning."""
    for number, point in enumerate(_points(curve)):
        if holds(point):
            at, step = number // (_STEPS + 1) * 3, number % (_STEPS + 1)
            before, after = max(0, step - 1) / _STEPS, step / _STEPS
            for _ in range(10):
                middle = (before + after) / 2
                if holds(_halves(curve[at : at + 4], middle)[0][-1]):
                    after = middle
                else:
                    before = middle
            return (at, before) if number else None
    return None


def _before(curve: _Curve, at: int, t: float) -> _Curve:
    """Return the part of a curve before a place."""
    return (*curve[:at], *_halves(curve[at : at + 4], t)[0])
