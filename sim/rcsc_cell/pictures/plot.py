"""Draw a value over time as SVG: one line and its axes, with nothing to install.

In: points. Out: an SVG element for a page. Lines are drawn in `currentColor`, so that the page may be light or dark.
(`rcsc log --plot` draws logs with matplotlib, with words and in other formats; a page needs neither.)
"""

from collections.abc import Iterator, Sequence
from html import escape
from itertools import groupby
from math import ceil, floor, isfinite, log10

Points = Sequence[tuple[float, float]]

WIDTH_PX, HEIGHT_PX = 640, 130
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 10, 8, 20
_ACROSS, _HIGH = WIDTH_PX - _LEFT - _RIGHT, HEIGHT_PX - _TOP - _BOTTOM


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers within a range, at most so many and at least one: multiples of 1, 2 or 5 times a power of ten."""
    rough = (high - low) / most
    power = 10.0 ** floor(log10(rough))
    step = next(step for step in (power, 2 * power, 5 * power, 10 * power) if step >= rough * (1 - 1e-9))
    return [at * step for at in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)] or [low]


def plot(points: Points) -> str:
    """Values that hold until the next one; seconds to the right.

    Args:
        points: (seconds, value) in order of time; a value that is not finite leaves a gap.
    """
    size = f'viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" width="{WIDTH_PX}" height="{HEIGHT_PX}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" class="plot" {size} fill="none" font-size="10" font-family="sans-serif">'
    values = [value for _, value in points if isfinite(value)]
    if not values:
        return f'{head}<text x="{_LEFT}" y="{HEIGHT_PX / 2:g}" fill="currentColor">no values</text></svg>'
    span, room = _room(points[0][0], points[-1][0], 0.0), _room(min(values), max(values), 0.05)
    return "\n".join((head, *_axes(span, room), _curve(points, span, room), "</svg>"))


def _room(low: float, high: float, beside: float) -> tuple[float, float]:
    """The range that is drawn: never empty, and with a little beside it."""
    if high - low <= 1e-9 * max(1.0, abs(low), abs(high)):
        return low - 0.5 - abs(low) * 1e-3, high + 0.5 + abs(high) * 1e-3
    return low - beside * (high - low), high + beside * (high - low)


def _x(at: float, span: tuple[float, float]) -> float:
    return _LEFT + (at - span[0]) / (span[1] - span[0]) * _ACROSS


def _y(value: float, room: tuple[float, float]) -> float:
    return _TOP + (room[1] - value) / (room[1] - room[0]) * _HIGH


def _axes(span: tuple[float, float], room: tuple[float, float]) -> Iterator[str]:
    grid = 'stroke="currentColor" stroke-opacity=".2" stroke-width=".7"'
    ink = 'fill="currentColor" fill-opacity=".75"'
    for value in ticks(*room, 5):
        y = _y(value, room)
        yield f'<path d="M{_LEFT} {y:.1f}h{_ACROSS}" {grid}/>'
        yield f'<text x="{_LEFT - 6}" y="{y + 3:.1f}" text-anchor="end" {ink}>{escape(f"{value:.6g}")}</text>'
    for at in ticks(*span, 10):
        x = _x(at, span)
        yield f'<path d="M{x:.1f} {_TOP}v{_HIGH}" {grid}/>'
        yield f'<text x="{x:.1f}" y="{HEIGHT_PX - 6}" text-anchor="middle" {ink}>{escape(f"{at:.6g}")} s</text>'


def _curve(points: Points, span: tuple[float, float], room: tuple[float, float]) -> str:
    path = ""
    for finite, run in groupby(_thinned(points, span), lambda point: isfinite(point[1])):
        if finite:
            (at, value), *more = run
            path += f"M{_x(at, span):.1f} {_y(value, room):.1f}"
            path += "".join(f"H{_x(at, span):.1f}V{_y(value, room):.1f}" for at, value in more)
            path += "h.1" if not more else ""  # a point alone is to be seen, too
    return f'<path class="curve" d="{path}" stroke="#2f7fd0" stroke-width="1.4" stroke-linecap="round"/>'


def _thinned(points: Points, span: tuple[float, float]) -> list[tuple[float, float]]:
    """No more than the first, least, greatest and last of each column of pixels: nothing that could be seen is lost."""
    kept: list[tuple[float, float]] = []
    for _, column in groupby(points, lambda point: int(_x(point[0], span))):
        here = list(column)
        if len(here) > 4 and all(isfinite(value) for _, value in here):
            least = min(range(len(here)), key=lambda at: here[at][1])
            greatest = max(range(len(here)), key=lambda at: here[at][1])
            here = [here[at] for at in sorted({0, least, greatest, len(here) - 1})]
        kept += [
            point
            for at, point in enumerate(here)
            if at in {0, len(here) - 1} or not (here[at - 1][1] == point[1] == here[at + 1][1])
        ]
    return kept
