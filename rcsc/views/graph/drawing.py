"""State graphs as SVG, to be looked at.

In: a graph. Out: one SVG that needs nothing else. States are circles, arrows carry the circled numbers of the lines with what must hold
beside the state; what procedures decide, and DEFAULT, is dashed. A pointer over a number shows the whole line. Source of the form: Haynes
et al. 1984, Fig. 10.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from html import escape

from rcsc.lang.operator_table import LOGIC, Op
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph
from rcsc.views.graph.labels import split
from rcsc.views.graph.layout import Arrangement, Arrow, LayoutBox, Point, place

_FONT_PX, _ROW_PX, _LETTER_PX = 11, 14, 6.62  # a letter of a monospaced font is 0.602 of its size wide
_BADGE_PX, _GAP_PX, _EDGE_PX = 9.5, 5.0, 24.0
MOST_LETTERS = 34
"""Letters of a label's line."""

_STYLE = """
  svg { background: #fff; --ink: #1b1f24; --quiet: #59636e; --line: #8c959f; --state: #eef4fb; --edge: #2f6fb0; --badge: #fff; }
  text { font: 11px ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; fill: #1b1f24; fill: var(--ink); }
  .title { font-size: 15px; font-weight: 600; } .quiet { fill: #59636e; fill: var(--quiet); }
  .state { fill: #eef4fb; fill: var(--state); stroke: #2f6fb0; stroke: var(--edge); stroke-width: 1.4; }
  .name { text-anchor: middle; font-weight: 600; }
  .arrow { fill: none; stroke: #8c959f; stroke: var(--line); stroke-width: 1.3; } .tip { fill: #8c959f; fill: var(--line); }
  .dashed { stroke-dasharray: 5 4; }
  .badge { fill: #fff; fill: var(--badge); stroke: #2f6fb0; stroke: var(--edge); stroke-width: 1.2; }
  .number { text-anchor: middle; font-size: 10px; }
  .paper { fill: #fff; fill-opacity: .82; }
  @media (prefers-color-scheme: dark) {
    svg { background: #15191e; --ink: #e6edf3; --quiet: #9aa4af; --line: #6e7781; --state: #1c2b3a; --edge: #6cb0f5; --badge: #15191e; }
    .paper { fill: #15191e; }
  }
"""


@dataclass(frozen=True, slots=True)
class ArrowLine:
    """One line of the table on an arrow; without a name it has no badge."""

    line: str
    text: tuple[str, ...]
    whole: str

    @property
    def width_px(self) -> float:
        """Width of the badge and the text."""
        letters = max((len(piece) for piece in self.text), default=0)
        return self.before_px + letters * _LETTER_PX

    @property
    def before_px(self) -> float:
        """Distance from the left end to the text."""
        return 2 * self.badge_px + (_GAP_PX if self.text else 0.0) if self.line else 0.0

    @property
    def badge_px(self) -> float:
        """Half the width of the badge: a circle, longer where the name is."""
        return max(_BADGE_PX, len(self.line) * 3.3 + 4.0)

    @property
    def height_px(self) -> float:
        """Height of the row."""
        return max(2 * _BADGE_PX, len(self.text) * _ROW_PX) + 3


@dataclass(frozen=True, slots=True)
class Sheaf:
    """The lines that lead from one node to another."""

    source: str
    target: str
    rows: tuple[ArrowLine, ...]
    dashed: bool


@dataclass(frozen=True, slots=True)
class Picture:
    """The content of a drawing.

    Attributes:
        notes: Below the title.
        nodes: Each name and the text in its circle.
    """

    title: str
    notes: tuple[str, ...]
    nodes: Mapping[str, str]
    sheaves: tuple[Sheaf, ...]


def svg(graph: StateGraph, everywhere: str = "") -> str:
    """Return the drawing of a state graph; `everywhere` is noted once for every arrow from a state.

    Raises:
        NoLayoutError: There is no layout program.
    """
    own = [edge for edge in map(partial(settled, graph), graph.edges) if not _never(edge)]
    nodes = {name: name for name in graph.states}
    if any(ANY in (edge.source, edge.target) for edge in own):
        nodes = {ANY: "any line" if graph.state == LINES else "any state", **nodes}
    sheaves = _sheaves(own)
    if graph.initial in graph.states:
        nodes = {"": "", **nodes}
        sheaves.insert(0, Sheaf("", graph.initial, (), dashed=False))
    return drawn(Picture(graph.table, _notes(graph, everywhere), nodes, tuple(sheaves)))


def settled(graph: StateGraph, edge: Edge) -> Edge:
    """Return the edge, without deciding procedures where its line can lead nowhere else from there."""
    elsewhere = any(
        (other.line, other.source) == (edge.line, edge.source) and other.target != edge.target
        for other in graph.edges
    )
    return edge if elsewhere or not edge.line else replace(edge, decided="")


def _sheaves(edges: Iterable[Edge]) -> list[Sheaf]:
    """Group the edges between the same two nodes; dashed ones apart."""
    pairs: dict[tuple[str, str, bool], list[Edge]] = {}
    for edge in edges:
        dashed = bool(edge.default or (edge.decided and edge.line))
        pairs.setdefault((edge.source, edge.target, dashed), []).append(edge)
    return [
        Sheaf(
            source,
            target,
            tuple(_row(edge) for edge in own if edge.line or edge.shown or edge.decided),
            dashed,
        )
        for (source, target, dashed), own in pairs.items()
    ]


def _never(edge: Edge) -> bool:
    """Return whether the edge belongs to a DEFAULT line that is never taken: it is noted beside the drawing."""
    return edge.default.endswith("unreachable")


def _notes(graph: StateGraph, everywhere: str) -> tuple[str, ...]:
    if graph.state == LINES:
        notes = ["circles are lines of the table: an arrow leads to a line that can match in the next cycle"]
    else:
        notes = [f"states are the values of {graph.state}; circled: the lines of the table"]
    if everywhere:
        notes.append(
            f"on every arrow from a {'line' if graph.state == LINES else 'state'} also: {everywhere}"
        )
    for edge in graph.edges:
        if _never(edge):
            goal = "stay" if edge.target == ANY else f"lead to {edge.target}"
            notes.append(f"line {edge.line} is DEFAULT, never reached; it would {goal}")
    return tuple(notes)


def _row(edge: Edge) -> ArrowLine:
    text = edge.default or plain(edge.shown)
    decided = f"where {edge.decided} says so" if edge.line else f"({edge.decided})"
    shown = (*folded(text), *(folded(decided) if edge.decided else ()))
    whole = [
        edge.line and f"line {edge.line}",
        edge.guard and f"when {edge.guard}",
        edge.effect,
        edge.default,
    ]
    return ArrowLine(edge.line, shown, "\n".join(part for part in whole if part))


def plain(guard: str) -> str:
    """Return a guard for reading: `not a` for `a = false`, and commas."""
    short = re.sub(r"(?<![\w.\]])([\w.\[\]]+) = true(?![\w.])", r"\1", guard)
    short = re.sub(r"(?<![\w.\]])([\w.\[\]]+) = false(?![\w.])", r"not \1", short)
    return short if any(f" {op} " in short for op in LOGIC - {Op.AND}) else ", ".join(split(short, " and "))


def folded(text: str) -> Iterator[str]:
    """Yield the text in lines, broken after commas and before `and` or `or`."""
    line = ""
    for piece in re.split(r"(?<=, )|(?= (?:and|or) )", text):
        if line and len(line) + len(piece.rstrip()) > MOST_LETTERS:
            yield line.strip()
            line = ""
        line += piece
    if line.strip():
        yield line.strip()


# --- the sheet -------------------------------------------------------------------------


def drawn(picture: Picture) -> str:
    """Return the picture as SVG."""
    boxes = [_box(name, shown) for name, shown in picture.nodes.items()]
    placed = place(boxes, [_arrow(sheave) for sheave in picture.sheaves])
    head_px = 22.0 + 16.0 * len(picture.notes)
    widest = max([8.6 * len(picture.title), *(_LETTER_PX * len(note) for note in picture.notes)])
    width = round(max(placed.width_px, widest) + 2 * _EDGE_PX)
    height = round(placed.height_px + head_px + 2 * _EDGE_PX)
    body = "\n".join([*_head(picture), *_sheet(picture, placed, boxes, (_EDGE_PX, _EDGE_PX + head_px))])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'role="img" aria-label="{escape(picture.title)}">\n<style>{_STYLE}</style>\n{body}\n</svg>\n'
    )


def _head(picture: Picture) -> Iterator[str]:
    yield f'<text class="title" x="{_EDGE_PX}" y="{_EDGE_PX + 8}">{escape(picture.title)}</text>'
    for at, note in enumerate(picture.notes):
        yield f'<text class="quiet" x="{_EDGE_PX}" y="{_EDGE_PX + 26 + 16 * at}">{escape(note)}</text>'


def _box(name: str, shown: str) -> LayoutBox:
    if name == "":
        return LayoutBox(name, 9, 9)
    size = max(34.0, len(shown) * _LETTER_PX + 20)
    return LayoutBox(name, size, size)


def _arrow(sheaf: Sheaf) -> Arrow:
    if not sheaf.rows:
        return Arrow(sheaf.source, sheaf.target)
    return Arrow(
        sheaf.source,
        sheaf.target,
        max(row.width_px for row in sheaf.rows) + 8,
        sum(row.height_px for row in sheaf.rows) + 4,
    )


def _sheet(picture: Picture, placed: Arrangement, boxes: list[LayoutBox], origin: Point) -> Iterator[str]:
    yield f'<g transform="translate({origin[0]:.0f} {origin[1]:.0f})">'
    for sheaf, (points, tip) in zip(picture.sheaves, placed.curves, strict=True):
        yield from _curve(points, tip, dashed=sheaf.dashed)
    for box, centre, shown in zip(boxes, placed.centres, picture.nodes.values(), strict=True):
        yield from _node(box, centre, shown)
    for sheaf, label in zip(picture.sheaves, placed.labels, strict=True):
        if label is not None:
            yield from _label(sheaf, label)
    yield "</g>"


def _curve(points: tuple[Point, ...], tip: Point, *, dashed: bool) -> Iterator[str]:
    start, *rest = (f"{x:g} {y:g}" for x, y in points)
    curves = " ".join(f"C {', '.join(rest[at : at + 3])}" for at in range(0, len(rest), 3))
    yield f'<path class="arrow{" dashed" if dashed else ""}" d="M {start} {curves}"/>'
    (x, y), (a, b) = points[-1], tip
    length = max(((a - x) ** 2 + (b - y) ** 2) ** 0.5, 1e-9)
    across = (-(b - y) / length * 3.4, (a - x) / length * 3.4)
    corners = [(x + across[0], y + across[1]), (x - across[0], y - across[1]), tip]
    yield f'<path class="tip" d="M {" L ".join(f"{p:.1f} {q:.1f}" for p, q in corners)} Z"/>'


def _node(box: LayoutBox, centre: Point, shown: str) -> Iterator[str]:
    x, y = centre
    if not shown:
        yield f'<circle class="tip" cx="{x:g}" cy="{y:g}" r="{box.width_px / 2:g}"/>'
        return
    half = (box.width_px / 2, box.height_px / 2)
    yield f'<ellipse class="state" cx="{x:g}" cy="{y:g}" rx="{half[0]:g}" ry="{half[1]:g}"/>'
    if box.name == ANY:
        yield f'<ellipse class="state" style="fill: none" cx="{x:g}" cy="{y:g}" rx="{half[0] - 4:g}" ry="{half[1] - 4:g}"/>'
    yield f'<text class="name" x="{x:g}" y="{y + 4:g}">{escape(shown)}</text>'


def _label(sheaf: Sheaf, centre: Point) -> Iterator[str]:
    """Yield the rows, one below the other, on a sheet that dims the arrows below."""
    room = _arrow(sheaf)
    left, top = centre[0] - room.width_px / 2 + 4, centre[1] - room.height_px / 2 + 2
    for row in sheaf.rows:
        middle = top + (row.height_px - 3) / 2
        high = row.height_px - 2
        yield f"<g><title>{escape(row.whole)}</title>"
        yield f'<rect class="paper" x="{left - 1:.1f}" y="{top:.1f}" width="{row.width_px + 2:.1f}" height="{high:.1f}"/>'
        if row.line:
            yield (
                f'<rect class="badge" x="{left:.1f}" y="{middle - _BADGE_PX:.1f}" width="{2 * row.badge_px:.1f}" '
                f'height="{2 * _BADGE_PX:.1f}" rx="{_BADGE_PX}"/>'
                f'<text class="number" x="{left + row.badge_px:.1f}" y="{middle + 3.5:.1f}">{escape(row.line)}</text>'
            )
        first = middle - (len(row.text) - 1) * _ROW_PX / 2 + 4
        for at, text in enumerate(row.text):
            yield f'<text x="{left + row.before_px:.1f}" y="{first + at * _ROW_PX:.1f}">{escape(text)}</text>'
        yield "</g>"
        top += row.height_px
