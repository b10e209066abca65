"""Where things stand in a drawing, by a layout program that reads DOT.

In: boxes and arrows with labels of known size, in pixels. Out: their places and the arrows' curves. The program is the one that the
extra `graph` installs, which gives the same places on every machine, else `dot` where the machine has it.
"""

import shutil
import sysconfig
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcsc.host import children
from rcsc.host.files.read import json_of

PACKAGE = "graphviz-pure"
MOST_SECONDS = 120
_POINTS = 72.0  # of an inch; one stands for one pixel

Point = tuple[float, float]


class NoLayoutError(Exception):
    """There is no layout program, or it failed; the text says which."""


@dataclass(frozen=True, slots=True)
class LayoutBox:
    """Something to be placed: a circle or a rectangle, `width_px` by `height_px`."""

    name: str
    width_px: float
    height_px: float
    round: bool = True


@dataclass(frozen=True, slots=True)
class Arrow:
    """From a box to a box; a label of size 0 is none."""

    source: str
    target: str
    width_px: float = 0.0
    height_px: float = 0.0


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A layout; x goes right and y down, in pixels.

    Attributes:
        centres: Of the boxes, in order.
        curves: Of the arrows, in order: points of cubic Bezier curves, then the arrow's tip.
        labels: Centres of the arrows' labels; None where there is none.
    """

    width_px: float
    height_px: float
    centres: tuple[Point, ...]
    curves: tuple[tuple[tuple[Point, ...], Point], ...]
    labels: tuple[Point | None, ...]


def place(boxes: Sequence[LayoutBox], arrows: Sequence[Arrow]) -> Arrangement:
    """The layout of the boxes and arrows, in ranks from top to bottom.

    Raises:
        NoLayoutError: No layout program is there, or it failed.
    """
    layout = json_of(_run(_text(boxes, arrows)))
    left, bottom, right, top = (float(side) for side in layout["bb"].split(","))

    def point(text: str) -> Point:
        x, y = (float(number) for number in text.split(","))
        return round(x - left, 2), round(top - y, 2)

    by_name = {node["name"]: node for node in layout["objects"]}
    edges = sorted(layout.get("edges", []), key=lambda edge: int(edge["id"][1:]))
    return Arrangement(
        right - left,
        top - bottom,
        tuple(point(by_name[f"n{at}"]["pos"]) for at in range(len(boxes))),
        tuple(_curve(edge["pos"], point) for edge in edges),
        tuple(point(edge["lp"]) if "lp" in edge else None for edge in edges),
    )


def _curve(text: str, point: Any) -> tuple[tuple[Point, ...], Point]:
    """`e,tip p0 p1 p2 p3 ...`; without an arrow's end the last point is the tip."""
    parts = text.split()
    tips = [part[2:] for part in parts if part.startswith("e,")]
    points = tuple(point(part) for part in parts if part[1:2] != ",")
    return points, point(tips[0]) if tips else points[-1]


def _text(boxes: Sequence[LayoutBox], arrows: Sequence[Arrow]) -> str:
    lines = ["digraph g {", "  rankdir=TB; nodesep=0.45; ranksep=0.5; edge [arrowsize=0.9];"]
    number = {box.name: at for at, box in enumerate(boxes)}
    for at, box in enumerate(boxes):
        shape = "ellipse" if box.round else "box"
        width, height = box.width_px / _POINTS, box.height_px / _POINTS
        lines.append(
            f'  n{at} [shape={shape}, fixedsize=true, label="", width={width:.4f}, height={height:.4f}];'
        )
    for at, arrow in enumerate(arrows):
        label = f", label={_blank(arrow)}" if arrow.width_px else ""
        lines.append(f'  n{number[arrow.source]} -> n{number[arrow.target]} [id="e{at}"{label}];')
    return "\n".join([*lines, "}", ""])


def _blank(arrow: Arrow) -> str:
    """A label that takes this much room and no more."""
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
