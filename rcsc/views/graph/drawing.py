"""State graphs as SVG, to be looked at: the same sheet that a page shows (`chart`), whole, in one file that needs nothing else.

In: a graph. Out: one SVG. States are boxes with the lines that stay in them, arrows carry the names of the lines that lead on, with what
must hold beside the state; what procedures decide, and DEFAULT, is dashed. A pointer over a name shows the whole line. Source of the form:
Haynes et al. 1984, Fig. 10, whose lines stand on arrows, too.
"""

from collections.abc import Iterator, Sequence
from html import escape

from rcsc.views.graph.chart import LEFT_PX, LETTER_PX, TEXT_PX, Sheet, SheetArrow, SheetBox, SheetRow, sheet
from rcsc.views.graph.composites import folded
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph

_EDGE_PX, _TITLE_PX, _NOTE_PX = 16.0, 8.6, 18.0

_STYLE = """
  svg { background: #fff; --ink: #1b1f24; --quiet: #59636e; --line: #8c959f; --state: #eef4fb; --edge: #2f6fb0; --badge: #fff; }
  text { font: 12px ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace; fill: #1b1f24; fill: var(--ink); white-space: pre; }
  .title { font-size: 15px; font-weight: 600; } .quiet, .doing, .from { fill: #59636e; fill: var(--quiet); }
  .state { fill: #eef4fb; fill: var(--state); stroke: #2f6fb0; stroke: var(--edge); stroke-width: 1.3; } .any { stroke-width: 3; }
  .frame { fill: none; stroke: #8c959f; stroke: var(--line); stroke-dasharray: 5 4; }
  .name { font-weight: 600; } .does { fill: #2f6fb0; fill: var(--edge); }
  .arrow { fill: none; stroke: #8c959f; stroke: var(--line); stroke-width: 1.3; } .tip { fill: #8c959f; fill: var(--line); }
  .dashed { stroke-dasharray: 5 4; }
  .badge { fill: #fff; fill: var(--badge); stroke: #2f6fb0; stroke: var(--edge); stroke-width: 1.2; } .number { text-anchor: middle; }
  @media (prefers-color-scheme: dark) {
    svg { background: #15191e; --ink: #e6edf3; --quiet: #9aa4af; --line: #6e7781; --state: #1c2b3a; --edge: #6cb0f5; --badge: #15191e; }
  }
"""


def svg(graph: StateGraph, everywhere: str = "") -> str:
    """Return the drawing of a state graph; `everywhere` is noted once for every arrow from a state.

    Raises:
        NoLayoutError: There is no layout program.
    """
    placed, notes = sheet(folded(graph)), _notes(graph, everywhere)
    head_px = 22.0 + _NOTE_PX * len(notes)
    widest = max([_TITLE_PX * len(graph.table), *(LETTER_PX * len(note) for note in notes)])
    width = round(max(placed.width_px, widest + 2 * _EDGE_PX))
    height = round(placed.height_px + head_px + _EDGE_PX)
    body = "\n".join(
        [
            *_head(graph.table, notes),
            f'<g transform="translate(0 {head_px + _EDGE_PX:.0f})">',
            *_sheet(placed),
            "</g>",
        ]
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'role="img" aria-label="{escape(graph.table)}">\n<style>{_STYLE}</style>\n{body}\n</svg>\n'
    )


def _never(edge: Edge) -> bool:
    """Return whether the edge belongs to a DEFAULT line that is never taken: it is noted beside the drawing."""
    return edge.default.endswith("unreachable")


def _notes(graph: StateGraph, everywhere: str) -> tuple[str, ...]:
    if graph.state == LINES:
        notes = ["boxes are lines of the table: an arrow leads to a line that can match in the next cycle"]
    else:
        notes = [
            f"states are the values of {graph.state}; in a state stand the lines that stay there, on an arrow those that lead on"
        ]
    if everywhere:
        notes.append(
            f"on every arrow from a {'line' if graph.state == LINES else 'state'} also: {everywhere}"
        )
    for edge in graph.edges:
        if _never(edge):
            goal = "stay" if edge.target == ANY else f"lead to {edge.target}"
            notes.append(f"line {edge.line} is DEFAULT, never reached; it would {goal}")
    return tuple(notes)


# --- the sheet -------------------------------------------------------------------------


def _head(title: str, notes: Sequence[str]) -> Iterator[str]:
    yield f'<text class="title" x="{_EDGE_PX}" y="{_EDGE_PX + 8}">{escape(title)}</text>'
    for at, note in enumerate(notes):
        yield f'<text class="quiet" x="{_EDGE_PX}" y="{_EDGE_PX + 28 + _NOTE_PX * at}">{escape(note)}</text>'


def _sheet(placed: Sheet) -> Iterator[str]:
    for frame in placed.frames:
        yield _rectangle("frame", frame, 10)
    for arrow in placed.arrows:
        yield from _arrow(arrow)
    for box in placed.boxes:
        yield from _box(box)
    for heading in placed.headings:
        yield from _rows(heading)
    for arrow in placed.arrows:
        if arrow.label is not None:
            yield from _rows(arrow.label)


def _rectangle(kind: str, box: SheetBox, round_px: int) -> str:
    (x, y), size = box.corner, f'width="{box.width_px:.1f}" height="{box.height_px:.1f}" rx="{round_px}"'
    return f'<rect class="{kind}" x="{x:.1f}" y="{y:.1f}" {size}/>'


def _arrow(arrow: SheetArrow) -> Iterator[str]:
    """Yield the curves and the tip, which ends the last of them."""
    for points in arrow.curves:
        start, *rest = (f"{x:g} {y:g}" for x, y in points)
        curves = " ".join(f"C {', '.join(rest[at : at + 3])}" for at in range(0, len(rest), 3))
        yield f'<path class="arrow{" dashed" if arrow.dashed else ""}" d="M {start} {curves}"/>'
    (x, y), (a, b) = arrow.curves[-1][-1], arrow.tip
    length = max(((a - x) ** 2 + (b - y) ** 2) ** 0.5, 1e-9)
    across = (-(b - y) / length * 4, (a - x) / length * 4)
    corners = [(x + across[0], y + across[1]), (x - across[0], y - across[1]), arrow.tip]
    yield f'<path class="tip" d="M {" L ".join(f"{p:.1f} {q:.1f}" for p, q in corners)} Z"/>'


def _box(box: SheetBox) -> Iterator[str]:
    if box.kind == "begin":
        (x, y), radius = box.corner, box.width_px / 2
        yield f'<circle class="tip" cx="{x + radius:g}" cy="{y + radius:g}" r="{radius:g}"/>'
        return
    yield _rectangle("state any" if box.kind == "any" else "state", box, 7)
    yield from _rows(box)


def _rows(box: SheetBox) -> Iterator[str]:
    """Yield the lines of the table in a box, each with the whole of it for a pointer."""
    for row in box.rows:
        left, top = box.corner[0] + LEFT_PX, box.corner[1] + row.top_px
        yield f"<g><title>{escape(row.whole)}</title>"
        yield from _badge(row, left, top)
        for at, (kind, text) in enumerate(row.texts):
            y = top + 12 + at * TEXT_PX
            yield f'<text class="{kind}" x="{left + row.badge_px:.1f}" y="{y:.1f}">{escape(text)}</text>'
        yield "</g>"


def _badge(row: SheetRow, left: float, top: float) -> Iterator[str]:
    if row.line:
        wide = row.badge_px - 4
        yield f'<rect class="badge" x="{left:.1f}" y="{top:.1f}" width="{wide:.1f}" height="16" rx="8"/>'
        yield f'<text class="number" x="{left + wide / 2:.1f}" y="{top + 12:.1f}">{escape(row.line)}</text>'
