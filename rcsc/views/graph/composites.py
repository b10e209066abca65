"""A state graph folded: states that fail alike, or wait alike, become one composite state with one arrow.

In: a `StateGraph`. Out: a `Chart` whose arrows say the same edges. An arrow that leaves a composite state leaves each of
its states; where a line does so from some of them only, its row names them. What stays in its state is a row of the state, not an arrow.

>>> from rcsc.views.graph.formats.state_graph import Edge, StateGraph
>>> fails = [Edge(line, line, "failed", "broken") for line in "abc"]
>>> waits = [Edge("w", state, state, "busy") for state in "abc"]
>>> chart = folded(StateGraph("t", "now", (*fails, *waits), states=("a", "b", "c", "failed")))
>>> [(composite.states, [row.line for row in composite.stays]) for composite in chart.composites]
[(('a', 'b', 'c'), ['w'])]
>>> [(arrow.source, arrow.target, [(row.line, row.sources) for row in arrow.rows]) for arrow in chart.arrows]
[('+a', 'failed', [('a', ('a',)), ('b', ('b',)), ('c', ('c',))])]

Source of composite states: Harel, *Statecharts: a visual formalism for complex systems*, 1987.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from rcsc.views.graph import labels
from rcsc.views.graph.formats.state_graph import ANY, Edge, StateGraph

LEAST_FAN = 3
"""Arrows to one state that are worth a composite state."""
FEWEST = 2 / 3
"""A fan is drawn from a composite state if it leaves at least this share of its states."""
_WORTH = 6
"""Doings of a state that are still told; more say nothing."""


@dataclass(frozen=True, slots=True)
class ArrowLine:
    """A line on an arrow, or in a state where it stays.

    Attributes:
        sources: The states that it leaves, where they are not all that the arrow leaves; else empty.
        edges: The edges that it stands for.
    """

    line: str
    sources: tuple[str, ...]
    edges: tuple[Edge, ...]

    @property
    def edge(self) -> Edge:
        """The edge with the longest condition, to stand for all."""
        return max(self.edges, key=lambda edge: len(edge.shown))


@dataclass(frozen=True, slots=True)
class ChartArrow:
    """Lines that lead from a state, or a composite state, to a state.

    Attributes:
        dashed: Whether procedures decide if it is taken, or its line is DEFAULT.
    """

    source: str
    target: str
    rows: tuple[ArrowLine, ...]
    dashed: bool = False


@dataclass(frozen=True, slots=True)
class Composite:
    """States that are drawn as one.

    Attributes:
        name: `+` and the name of its first state, and a `'` more for each composite inside that begins with it.
        states: In declared order.
        stays: Lines on which each of them stays.
    """

    name: str
    states: tuple[str, ...]
    stays: tuple[ArrowLine, ...] = ()


@dataclass(frozen=True, slots=True)
class Chart:
    """A folded graph.

    Attributes:
        composites: Of two that share states one is inside the other, and comes later.
        stays: By state the lines on which it stays, but for those of a composite.
        doing: By state the orders and reports of lines that lead there, as text; nothing where they do not agree.
    """

    graph: StateGraph
    composites: tuple[Composite, ...]
    arrows: tuple[ChartArrow, ...]
    stays: Mapping[str, tuple[ArrowLine, ...]]
    doing: Mapping[str, tuple[str, ...]]


def folded(graph: StateGraph) -> Chart:
    """Return the graph with composite states for fans and for loops of one line."""
    edges = [settled(graph, edge) for edge in graph.edges if not edge.default.endswith("unreachable")]
    loops, arrows = _parted(edges)
    fans = _fans(arrows, graph)
    waiting = _waiting(loops, graph)
    composites = _composites(
        graph, [*_saved(fans, arrows), *((states, len(states) - 1) for states in waiting.values())]
    )
    stays: dict[str, list[ArrowLine]] = {}
    for (line, _), states in waiting.items():
        rows = [edge for edge in loops if edge.line == line and edge.source in states]
        group = next((each for each in composites if set(each.states) == set(states)), None)
        if group is not None:
            stays.setdefault(group.name, []).append(ArrowLine(line, (), tuple(rows)))
            loops = [edge for edge in loops if edge not in rows]
    for edge in loops:
        stays.setdefault(edge.source, []).append(ArrowLine(edge.line, (), (edge,)))
    return Chart(
        graph,
        tuple(replace(each, stays=tuple(stays.pop(each.name, ()))) for each in composites),
        tuple(_arrows(arrows, fans, composites)),
        {state: tuple(rows) for state, rows in stays.items()},
        {state: _doing(state, edges) for state in graph.states},
    )


def settled(graph: StateGraph, edge: Edge) -> Edge:
    """Return the edge, without deciding procedures where its line can lead nowhere else from there."""
    elsewhere = any(
        (other.line, other.source) == (edge.line, edge.source) and other.target != edge.target
        for other in graph.edges
    )
    return edge if elsewhere or not edge.line else replace(edge, decided="")


def inside(composites: Sequence[Composite], state: str) -> str:
    """Return the innermost composite around a state, or around a composite; "" for none."""
    states = next((set(each.states) for each in composites if each.name == state), {state})
    around = [each for each in composites if states < set(each.states) or {state} <= set(each.states)]
    return around[-1].name if around else ""


def collapsed(chart: Chart, hidden: Collection[str]) -> Chart:
    """Return the chart with some composites shut: arrows inside are left out, others begin or end at their border."""
    shut = [each for each in chart.composites if each.name in hidden]
    outer = [each for each in shut if not any(set(each.states) < set(more.states) for more in shut)]
    stand_in = {state: each.name for each in outer for state in each.states}
    names = {each.name for each in chart.composites}
    gone = {
        each.name for each in chart.composites if any(set(each.states) < set(more.states) for more in outer)
    }
    stand_in |= {name: stand_in[_states(chart, name)[0]] for name in gone}
    moved: dict[tuple[str, str, bool], list[ArrowLine]] = {}
    for arrow in chart.arrows:
        source, target = (stand_in.get(end, end) for end in (arrow.source, arrow.target))
        if source == target and source in names:
            continue
        rows = [
            row
            if source == arrow.source
            else replace(row, sources=row.sources or _states(chart, arrow.source))
            for row in arrow.rows
        ]
        moved.setdefault((source, target, arrow.dashed), []).extend(rows)
    return Chart(
        chart.graph,
        tuple(each for each in chart.composites if each.name not in gone),
        tuple(
            ChartArrow(source, target, tuple(rows), dashed)
            for (source, target, dashed), rows in moved.items()
        ),
        {state: rows for state, rows in chart.stays.items() if state not in stand_in},
        chart.doing,
    )


# --- what is folded -----------------------------------------------------------------------


def _parted(edges: Iterable[Edge]) -> tuple[list[Edge], list[Edge]]:
    """Return the loops and the arrows between states."""
    loops, arrows = list[Edge](), list[Edge]()
    for edge in edges:
        (loops if edge.target in (edge.source, ANY) else arrows).append(edge)
    return loops, arrows


def _fans(arrows: Sequence[Edge], graph: StateGraph) -> dict[str, tuple[str, ...]]:
    """Return, by state, the states from which edges lead there, where they are many."""
    fans = {
        state: _ordered(graph, {edge.source for edge in arrows if edge.target == state} - {ANY})
        for state in graph.states
    }
    return {state: sources for state, sources in fans.items() if len(sources) >= LEAST_FAN}


def _waiting(loops: Sequence[Edge], graph: StateGraph) -> dict[tuple[str, str], tuple[str, ...]]:
    """Return, by line and its procedures that decide, the states in which it stays, where they are several."""
    found: dict[tuple[str, str], set[str]] = {}
    for edge in loops:
        if edge.source != ANY and edge.line:
            found.setdefault((edge.line, edge.decided), set()).add(edge.source)
    return {key: _ordered(graph, states) for key, states in found.items() if len(states) > 1}


def _ordered(graph: StateGraph, states: Collection[str]) -> tuple[str, ...]:
    return tuple(state for state in graph.states if state in states)


def _saved(
    fans: Mapping[str, tuple[str, ...]], arrows: Sequence[Edge]
) -> Iterator[tuple[tuple[str, ...], int]]:
    """Yield the states of each fan, and the number of arrows and of rows of one line that it folds."""
    for target, states in fans.items():
        own = [edge for edge in arrows if edge.target == target and edge.source in states]
        yield states, len(states) - 1 + len(own) - len({(edge.line, edge.decided) for edge in own})


def _composites(graph: StateGraph, wanted: Iterable[tuple[tuple[str, ...], int]]) -> list[Composite]:
    """Choose sets of states, none of all states and no two crossing; those that fold most are taken first."""
    worth: dict[tuple[str, ...], int] = {}
    for states, saved in wanted:
        worth[states] = worth.get(states, 0) + saved
    taken: list[tuple[str, ...]] = []
    for states in sorted(worth, key=lambda each: (-worth[each], -len(each), graph.states.index(each[0]))):
        if len(states) < len(graph.states) and not any(_cross(set(states), set(other)) for other in taken):
            taken.append(states)
    taken.sort(key=lambda each: (-len(each), graph.states.index(each[0])))
    named = list[Composite]()
    for states in taken:
        same = sum(each.states[0] == states[0] for each in named)
        named.append(Composite(f"+{states[0]}{chr(39) * same}", states))
    return named


def _cross(one: set[str], other: set[str]) -> bool:
    return bool(one & other) and not one <= other and not other <= one


# --- arrows -----------------------------------------------------------------------------


def _arrows(
    edges: Sequence[Edge], fans: Mapping[str, tuple[str, ...]], composites: Sequence[Composite]
) -> Iterator[ChartArrow]:
    """Yield the arrows; edges of a fan leave the smallest composite that has all of its states."""
    found: dict[tuple[str, str, bool], list[Edge]] = {}
    for edge in edges:
        fan = fans.get(edge.target, ())
        around = [
            each for each in composites if set(fan) <= set(each.states) and edge.target not in each.states
        ]
        folds = edge.source in fan and around and len(fan) >= FEWEST * len(around[-1].states)
        source = around[-1].name if folds else edge.source
        dashed = bool(edge.default or (edge.decided and edge.line))
        found.setdefault((source, edge.target, dashed), []).append(edge)
    states = {each.name: each.states for each in composites}
    for (source, target, dashed), own in found.items():
        yield ChartArrow(source, target, tuple(_rows(own, states.get(source, (source,)))), dashed)


def _rows(edges: Sequence[Edge], every: tuple[str, ...]) -> Iterator[ArrowLine]:
    """Yield one row for each line; two where some of its edges are decided by procedures, and others are not."""
    for (line, _), group in groupby(edges, key=lambda edge: (edge.line, edge.decided)):
        own = tuple(group)
        sources = tuple(edge.source for edge in own)
        yield ArrowLine(line, () if set(sources) == set(every) else sources, own)


def _states(chart: Chart, name: str) -> tuple[str, ...]:
    return next((each.states for each in chart.composites if each.name == name), (name,))


# --- what a state does -------------------------------------------------------------------


def _doing(state: str, edges: Sequence[Edge]) -> tuple[str, ...]:
    """Return the orders and reports of lines that lead to a state or stay in it, where these lines agree; procedures are left out.

    >>> entering = [Edge("1", "a", "b", effect="command_out(locate) status_out(executing)")]
    >>> _doing("b", [*entering, Edge("2", "b", "b", effect="status_out(executing)"), Edge("3", "c", "b", effect="command_out(grip)")])
    ('locate or grip', 'executing')
    """
    said: dict[str, dict[str, None]] = {heading: {} for heading in _ALONE}
    for edge in edges:
        if edge.target == state and not edge.decided:
            for heading, text in labels.effect_cells(edge.effect):
                if heading not in ("procedures", text):  # `x` under x leaves it as it is
                    said.setdefault(heading, {})[text if heading in _ALONE else f"{heading} = {text}"] = None
    return tuple(" or ".join(texts) for texts in said.values() if 0 < len(texts) <= 2)[:_WORTH]


_ALONE = ("command_out", "status_out")
"""Columns whose values say themselves what they are: the order first, then the report."""
