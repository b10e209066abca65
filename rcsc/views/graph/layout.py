"""Where things stand in a drawing, by a layout program that reads DOT.

In: boxes and arrows with labels of known size, in pixels. Out: their places and the arrows' curves. The program is the one that the
extra `graph` installs, which gives the same places on every machine, else `dot` where the machine has it.
"""

import shutil
import sysconfig
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rcsc.base.host import children
from rcsc.base.host.files.read import json_of

PACKAGE = "graphviz-pure"
MOST_SECONDS = 120
_POINTS = 72.0  # of an inch; one stands for one pixel

Point = tuple[float, float]


class NoLayoutError(Exception):
    """There is no layout program, or it failed; the text says which."""


@dataclass(frozen=True, slots=True)
class LayoutBox:
    """A circle or a rectangle to be placed, `width_px` by `height_px`."""

    name: str
    width_px: float
    height_px: float
    round: bool = True


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow from a box to a box, perhaps with a label; a label of size 0 is none.

    Attributes:
        leaves: The frame at whose border it begins, around `source`; "" for the box itself.
        tip: Whether it has one.
    """

    source: str
    target: str
    width_px: float = 0.0
    height_px: float = 0.0
    leaves: str = ""
    tip: bool = True


@dataclass(frozen=True, slots=True)
class Frame:
    """A rectangle around boxes and other frames."""

    name: str
    boxes: tuple[str, ...]
    frames: "tuple[Frame, ...]" = ()


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A layout; x goes right and y down, in pixels.

    Attributes:
        centres: Of the boxes, in order.
        curves: Of the arrows, in order: points of cubic Bezier curves, then the arrow's tip.
        labels: Centres of the arrows' labels; None where there is none.
        frames: By name the left upper and the right lower corner.
    """

    width_px: float
    height_px: float
    centres: tuple[Point, ...]
    curves: tuple[tuple[tuple[Point, ...], Point], ...]
    labels: tuple[Point | None, ...]
    frames: Mapping[str, tuple[Point, Point]] = field(default_factory=dict)


def place(
    boxes: Sequence[LayoutBox],
    arrows: Sequence[Arrow],
    frames: Sequence[Frame] = (),
    *,
    straight: bool = False,
) -> Arrangement:
    """Lay out the boxes and arrows, in ranks from top to bottom; a box is in one frame at most.

    Args:
        boxes: The boxes to place.
        arrows: Between them.
        frames: Around them.
        straight: Whether arrows are straight pieces in place of curves.

    Raises:
        NoLayoutError: No layout program is there, or it failed.
    """
    text = _text(boxes, arrows, frames)
    layout = json_of(
        _run(text.replace("compound=true;", "compound=true; splines=polyline;") if straight else text)
    )
    left, bottom, right, top = (float(side) for side in layout["bb"].split(","))

    def point(text: str) -> Point:
        x, y = (float(number) for number in text.split(","))
        return round(x - left, 2), round(top - y, 2)

    by_name = {node["name"]: node for node in layout.get("objects", [])}
    edges = sorted(layout.get("edges", []), key=lambda edge: int(edge["id"][1:]))
    return Arrangement(
        right - left,
        top - bottom,
        tuple(point(by_name[f"n{at}"]["pos"]) for at in range(len(boxes))),
        tuple(_curve(edge["pos"], point) for edge in edges),
        tuple(point(edge["lp"]) if "lp" in edge else None for edge in edges),
        {name: _corners(by_name[word]["bb"], point) for name, word in _words(frames).items()},
    )


def _corners(text: str, point: Callable[[str], Point]) -> tuple[Point, Point]:
    """Read `left,bottom,right,top` as two corners."""
    left, bottom, right, top = text.split(",")
    return point(f"{left},{top}"), point(f"{right},{bottom}")


def _curve(text: str, point: Any) -> tuple[tuple[Point, ...], Point]:
    """Read `e,tip p0 p1 p2 p3 ...`; without an arrow's end the last point is the tip."""
    parts = text.split()
    tips = [part[2:] for part in parts if part.startswith("e,")]
    points = tuple(point(part) for part in parts if part[1:2] != ",")
    return points, point(tips[0]) if tips else points[-1]


def _words(frames: Sequence[Frame]) -> dict[str, str]:
    """Return the names of frames in DOT, by name; a frame's inner frames follow it."""
    waiting, found = list(frames), list[Frame]()
    while waiting:
        found.append(waiting.pop(0))
        waiting = [*found[-1].frames, *waiting]
    return {frame.name: f"cluster_{at}" for at, frame in enumerate(found)}


def _text(boxes: Sequence[LayoutBox], arrows: Sequence[Arrow], frames: Sequence[Frame]) -> str:
    ranks = 0.3 if frames else 0.5
    lines = [
        "digraph g {",
        f"  compound=true; rankdir=TB; nodesep=0.45; ranksep={ranks}; edge [arrowsize=0.9];",
    ]
    number = {box.name: at for at, box in enumerate(boxes)}
    for at, box in enumerate(boxes):
        shape = "ellipse" if box.round else "box"
        width, height = box.width_px / _POINTS, box.height_px / _POINTS
        lines.append(
            f'  n{at} [shape={shape}, fixedsize=true, label="", width={width:.4f}, height={height:.4f}];'
        )
    words = _words(frames)
    for frame in frames:
        lines += _framed(frame, number, words)
    for at, arrow in enumerate(arrows):
        more = f", label={_blank(arrow)}" if arrow.width_px else ""
        more += f", ltail={words[arrow.leaves]}" if arrow.leaves else ""
        more += "" if arrow.tip else ", arrowhead=none"
        lines.append(f'  n{number[arrow.source]} -> n{number[arrow.target]} [id="e{at}"{more}];')
    return "\n".join([*lines, "}", ""])


def _framed(frame: Frame, number: Mapping[str, int], words: Mapping[str, str]) -> Iterator[str]:
    yield f"  subgraph {words[frame.name]} {{ margin=14;"
    yield " ".join(f"n{number[name]};" for name in frame.boxes)
    for inner in frame.frames:
        yield from _framed(inner, number, words)
    yield "  }"


def _blank(arrow: Arrow) -> str:
    """Return a label that takes this much room and no more."""
    size = f'WIDTH="{round(arrow.width_px)}" HEIGHT="{round(arrow.height_px)}"'
    return f'<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0" FIXEDSIZE="TRUE" {size}><TR><TD></TD></TR></TABLE>>'


def _run(text: str) -> str:
    program = _program()
    try:
        done = children.run([program, "-Tjson0"], stdin=text.encode(), timeout_s=MOST_SECONDS)
    except OSError as error:
        raise NoLayoutError(f"the layout program failed: {error}") from error
    if done.status != 0:
        why = "it took too long" if done.status is None else f"it ended with status {done.status}"
        raise NoLayoutError(f"the layout program failed: {why}")
    return done.out


def _program() -> str:
    beside = shutil.which(PACKAGE, path=sysconfig.get_path("scripts")) or shutil.which(PACKAGE)
    program = beside or shutil.which("dot")
    if program is None:
        raise NoLayoutError(f"`{PACKAGE}` is not installed")
    return str(Path(program))
