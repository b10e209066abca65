"""Where the parts of a folded graph stand, and the words in them: what a page draws.

In: a `Chart`. Out: a `Sheet`: boxes, frames and arrows with places in pixels, and rows of text, wrapped. A label is a box of its own
between the two halves of its arrow, so that the layout leads every arrow round every label (`curves`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.views.graph import labels
from rcsc.views.graph.composites import ArrowLine, Chart, ChartArrow, Composite, inside
from rcsc.views.graph.curves import clear
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge
from rcsc.views.graph.layout import Arrangement, Arrow, Frame, LayoutBox, Point

LETTER_PX, TEXT_PX, BADGE_PX, LEFT_PX = 7.3, 16.0, 24.0, 8.0
"""A letter of 12 px (a monospaced one is 0.602 of its size wide), a line of text, the least badge with a name, and where a row begins."""
_PAD_PX, _LEAST_PX, _MARGIN_PX = LEFT_PX, 56.0, 16.0
MOST_TEXTS = 4
"""Of a row; more is left to `whole`."""
MOST_ALIKE = 6
"""Lines on an arrow that each say what they ask and do, though another says it."""


@dataclass(frozen=True, slots=True)
class SheetRow:
    """A line of the table in a label or a box.

    Attributes:
        line: Its name; empty for text alone.
        texts: Kind and text: `from`, `guard`, `does`, `stays`, `name`, `doing`, `default`.
        whole: All of it.
        top_px: From the upper border of what it is in.
    """

    line: str
    texts: tuple[tuple[str, str], ...]
    whole: str
    top_px: float = 0.0

    @property
    def badge_px(self) -> float:
        """Width of the badge; 0 where there is none."""
        return max(BADGE_PX, len(self.line) * LETTER_PX + 10) if self.line else 0.0

    @property
    def width_px(self) -> float:
        """Width of badge and text."""
        return self.badge_px + max((len(text) for _, text in self.texts), default=0) * LETTER_PX + 6

    @property
    def height_px(self) -> float:
        """Height of all of its texts."""
        return max(1, len(self.texts)) * TEXT_PX + 3


@dataclass(frozen=True, slots=True)
class SheetBox:
    """A state, a shut composite, an open one, the beginning, or a label.

    Attributes:
        kind: `state`, `any`, `shut`, `open`, `begin` or `label`.
        states: Those that it stands for.
        corner: The upper left one, in pixels.
    """

    name: str
    kind: str
    states: tuple[str, ...]
    rows: tuple[SheetRow, ...]
    corner: Point
    width_px: float
    height_px: float


@dataclass(frozen=True, slots=True)
class SheetArrow:
    """An arrow: its curves in drawing order, the last with the tip, and its label.

    Attributes:
        curves: Points of cubic Bezier curves each.
        tip: Where it ends.
        label: None where there is nothing to say.
    """

    source: str
    target: str
    dashed: bool
    curves: tuple[tuple[Point, ...], ...]
    tip: Point
    label: SheetBox | None


@dataclass(frozen=True, slots=True)
class Sheet:
    """A placed chart; x goes right and y down, in pixels.

    Attributes:
        frames: Open composites.
        headings: Of each frame, inside it: what is true of each of its states.
    """

    width_px: float
    height_px: float
    boxes: tuple[SheetBox, ...]
    frames: tuple[SheetBox, ...]
    headings: tuple[SheetBox, ...]
    arrows: tuple[SheetArrow, ...]


def sheet(chart: Chart, shut: Sequence[str] = ()) -> Sheet:
    """Place a chart.

    Args:
        chart: `composites.collapsed`, if some composites are shut.
        shut: Names of those.

    Raises:
        NoLayoutError: There is no layout program.
    """
    opened = [each for each in chart.composites if each.name not in shut]
    boxes = {box.name: box for box in _boxes(chart, shut)}
    parts = [(arrow, _label(arrow)) for arrow in _arrows(chart, boxes)]
    named = {f"={at}": label for at, (_, label) in enumerate(parts) if label is not None}
    named |= {f"#{each.name}": _heading(each) for each in opened}
    sized = [
        LayoutBox(name, box.width_px, box.height_px, round=False) for name, box in (boxes | named).items()
    ]
    placed = clear(sized, [*_halves(parts, opened, boxes)], _frames(opened, boxes, parts, chart))
    return _placed(placed, boxes, named, parts, opened)


# --- words ------------------------------------------------------------------------------


def _boxes(chart: Chart, shut: Sequence[str]) -> Iterator[SheetBox]:
    graph = chart.graph
    hidden = {state for each in chart.composites if each.name in shut for state in each.states}
    ends = {end for arrow in chart.arrows for end in (arrow.source, arrow.target)} | set(chart.stays)
    if graph.initial in graph.states:
        yield SheetBox("", "begin", (), (), (0, 0), 12, 12)
    if ANY in ends:
        word = "any line" if graph.state == LINES else "any state"
        rows = _stacked([_words("name", word), *map(_staying, chart.stays.get(ANY, ()))])
        yield _sized(ANY, "any", graph.states, rows)
    for state in graph.states:
        if state not in hidden:
            told = [_words("name", state)]
            doing = chart.doing.get(state, ())
            if doing:
                texts = tuple(("doing", text) for text in _short(", ".join(doing)))
                told.append(SheetRow("", texts, f"{state}: lines that lead here write {', '.join(doing)}"))
            yield _sized(
                state, "state", (state,), _stacked([*told, *map(_staying, chart.stays.get(state, ()))])
            )
    for each in chart.composites:
        if each.name in shut:
            whole = "\n".join(each.states)
            told = [_words("name", f"{len(each.states)} states", whole)]
            told += [SheetRow("", tuple(("doing", text) for text in _short(", ".join(each.states))), whole)]
            yield _sized(each.name, "shut", each.states, _stacked([*told, *map(_staying, each.stays)]))


def _words(kind: str, text: str, whole: str = "") -> SheetRow:
    """Return a row of text alone."""
    texts = tuple((kind, piece) for piece in _short(text))
    return SheetRow("", texts, f"{text}\n{whole}" if whole else text)


def _staying(row: ArrowLine) -> SheetRow:
    edge = row.edge
    return SheetRow(row.line, (*_guard(edge, "stays"), *_does(edge)), _whole(row))


def _leading(rows: Sequence[ArrowLine]) -> Iterator[SheetRow]:
    """Yield the lines on an arrow; of many with the same guard and actions, those after the first name that one."""
    first: dict[tuple[tuple[str, str], ...], str] = {}
    for row in rows:
        texts = (*_guard(row.edge, ""), *_does(row.edge)) or (("guard", "always"),)
        like = first.setdefault(texts, row.line) if row.sources and len(rows) > MOST_ALIKE else row.line
        said = f"from {', '.join(row.sources)}" if row.sources else ""
        if like != row.line:
            said, texts = f"{said}: as {like}", ()
        yield SheetRow(row.line, (*(("from", text) for text in _short(said)), *texts), _whole(row))


def _guard(edge: Edge, empty: str) -> Iterator[tuple[str, str]]:
    """Yield the condition beside the state, and the procedures that decide."""
    if edge.default:
        yield "default", edge.default
    texts = _short(labels.plain(edge.shown)) or ((empty,) if empty and not edge.default else ())
    yield from (("guard", text) for text in texts)
    if edge.decided and edge.line:
        yield from (("guard", text) for text in _short(f"where {edge.decided} says so"))
    elif edge.decided:
        yield "guard", f"({edge.decided})"


def _does(edge: Edge) -> Iterator[tuple[str, str]]:
    """Yield the actions: the order first, then outputs, computed values last; reports stand at the state."""
    cells = dict(labels.effect_cells(edge.effect))
    cells.pop("status_out", None)
    ordered = cells.pop("command_out", "")
    computed = cells.pop("procedures", "")
    outputs = [f"{heading} = {text}" for heading, text in cells.items() if heading != text]
    said = [f"order {ordered}" if ordered else "", *outputs, computed]
    whole = "; ".join(text for text in said if text)
    for at, text in enumerate(_short(whole)):
        yield "does", f"/ {text}" if at == 0 else f"  {text}"


def _short(text: str) -> tuple[str, ...]:
    """Return a text in a bounded number of lines of bounded length."""
    lines = [piece for line in labels.wrapped(text.replace("; ", ", ")) for piece in _cut(line)]
    return (
        (*lines[: MOST_TEXTS - 1], f"{lines[MOST_TEXTS - 1][: labels.MOST_LETTERS - 1]}…")
        if len(lines) > MOST_TEXTS
        else (*lines,)
    )


def _cut(line: str) -> Iterator[str]:
    """Yield a line without blanks in pieces: cut after `_` or `.` where that leaves no short one."""
    while len(line) > labels.MOST_LETTERS:
        at = max(line.rfind(sign, 0, labels.MOST_LETTERS) for sign in "_.") + 1
        at = at if at > labels.MOST_LETTERS // 2 else labels.MOST_LETTERS
        yield line[:at]
        line = line[at:]
    yield line


def _whole(row: ArrowLine) -> str:
    edge = row.edge
    said = [
        row.line and f"line {row.line}",
        row.sources and f"from {', '.join(row.sources)}",
        edge.default,
        edge.guard and f"when {edge.guard}",
        edge.effect,
        edge.decided and edge.line and f"where {edge.decided} says so",
    ]
    return "\n".join(part for part in said if part)


def _stacked(rows: Sequence[SheetRow], top_px: float = _PAD_PX / 2) -> tuple[SheetRow, ...]:
    """Return the rows with their places, one below the other."""
    found = list[SheetRow]()
    for row in rows:
        found.append(SheetRow(row.line, row.texts, row.whole, top_px))
        top_px += row.height_px
    return tuple(found)


def _sized(name: str, kind: str, states: tuple[str, ...], rows: tuple[SheetRow, ...]) -> SheetBox:
    """Return a box around rows, not yet placed."""
    width = max([_LEAST_PX if kind != "label" else 0.0, *(row.width_px + 2 * _PAD_PX for row in rows)])
    return SheetBox(
        name, kind, states, rows, (0, 0), width, rows[-1].top_px + rows[-1].height_px + _PAD_PX / 2
    )


# --- arrows and frames -------------------------------------------------------------------


def _arrows(chart: Chart, boxes: Mapping[str, SheetBox]) -> Iterator[ChartArrow]:
    if chart.graph.initial in chart.graph.states:
        yield ChartArrow("", _drawn(boxes, chart.graph.initial), ())
    yield from chart.arrows


def _drawn(boxes: Mapping[str, SheetBox], state: str) -> str:
    """Return the box of a state: its own, or the shut composite around it."""
    return next(name for name, box in boxes.items() if state in box.states and box.kind in ("state", "shut"))


def _label(arrow: ChartArrow) -> SheetBox | None:
    rows = [row for row in arrow.rows if row.line or row.edge.shown or row.edge.decided]
    return _sized("", "label", (), _stacked([*_leading(rows)], 2.0)) if rows else None


_Parts = Sequence[tuple[ChartArrow, SheetBox | None]]


def _halves(parts: _Parts, opened: Sequence[Composite], boxes: Mapping[str, SheetBox]) -> Iterator[Arrow]:
    """Yield the arrows for the layout program: one to a label and one on from it, or a single one."""
    states = {each.name: each.states for each in opened}
    for at, (arrow, label) in enumerate(parts):
        leaves = arrow.source if arrow.source in states else ""
        source = _drawn(boxes, states[leaves][-1]) if leaves else arrow.source
        if label is None:
            yield Arrow(source, arrow.target, leaves=leaves)
        else:
            yield Arrow(source, f"={at}", leaves=leaves, tip=False)
            yield Arrow(f"={at}", arrow.target)


def _frames(
    opened: Sequence[Composite], boxes: Mapping[str, SheetBox], parts: _Parts, chart: Chart
) -> list[Frame]:
    """Return the open composites with their content, which includes labels of inner arrows."""
    around = {name: inside(opened, name) for name in boxes if name and name != ANY}
    for name, box in boxes.items():
        if box.kind == "shut":
            around[name] = next(
                (each.name for each in reversed(opened) if set(box.states) < set(each.states)), ""
            )
    for at, (arrow, label) in enumerate(parts):
        if label is not None:
            around[f"={at}"] = _common(opened, boxes, chart, arrow)

    def frame(each: Composite) -> Frame:
        inner = tuple(frame(other) for other in opened if inside(opened, other.name) == each.name)
        own = tuple(name for name, where in around.items() if where == each.name)
        return Frame(each.name, (f"#{each.name}", *own), inner)

    return [frame(each) for each in opened if not inside(opened, each.name)]


def _common(
    opened: Sequence[Composite], boxes: Mapping[str, SheetBox], chart: Chart, arrow: ChartArrow
) -> str:
    """Return the innermost composite that has both ends of an arrow, other than the one it leaves; "" for none."""
    ends = set[str]()
    for end in (arrow.source, arrow.target):
        states = next((each.states for each in chart.composites if each.name == end), None)
        ends |= set(states or (boxes[end].states if end in boxes else ()))
    if not ends or ANY in (arrow.source, arrow.target):
        return ""
    return next((each.name for each in reversed(opened) if ends <= set(each.states)), "")


def _heading(each: Composite) -> SheetBox:
    """Return the text in an open composite beside its states."""
    many = _words("name", f"any of these {len(each.states)}  ", ", ".join(each.states))
    return _sized(each.name, "open", each.states, _stacked([many, *map(_staying, each.stays)]))


def _placed(
    placed: Arrangement,
    boxes: Mapping[str, SheetBox],
    named: dict[str, SheetBox],
    parts: _Parts,
    opened: Sequence[Composite],
) -> Sheet:
    centres = dict(zip((*boxes, *named), placed.centres, strict=True))

    def at(name: str, box: SheetBox) -> SheetBox:
        corner = (
            centres[name][0] - box.width_px / 2 + _MARGIN_PX,
            centres[name][1] - box.height_px / 2 + _MARGIN_PX,
        )
        return SheetBox(name, box.kind, box.states, box.rows, corner, box.width_px, box.height_px)

    def moved(points: Sequence[Point]) -> tuple[Point, ...]:
        return tuple((x + _MARGIN_PX, y + _MARGIN_PX) for x, y in points)

    halves = iter(placed.curves)
    arrows = list[SheetArrow]()
    for number, (arrow, label) in enumerate(parts):
        own = [next(halves) for _ in range(1 if label is None else 2)]
        where = None if label is None else at(f"={number}", label)
        curves = tuple(moved(points) for points, _ in own)
        arrows.append(
            SheetArrow(arrow.source, arrow.target, arrow.dashed, curves, moved([own[-1][1]])[0], where)
        )
    frames = list[SheetBox]()
    for each in opened:
        (left, top), (right, low) = moved(placed.frames[each.name])
        frames.append(SheetBox(each.name, "open", each.states, (), (left, top), right - left, low - top))
    size = (placed.width_px + 2 * _MARGIN_PX, placed.height_px + 2 * _MARGIN_PX)
    headings = tuple(at(f"#{each.name}", named[f"#{each.name}"]) for each in opened)
    return Sheet(*size, tuple(at(*pair) for pair in boxes.items()), tuple(frames), headings, tuple(arrows))
