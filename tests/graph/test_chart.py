"""Graphs folded and placed: they say the same edges, and no arrow goes through a label, a state, or what is no end of its own."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.proof.solvers.options import Options
from rcsc.views.graph.chart import MOST_TEXTS, Sheet, SheetBox, sheet
from rcsc.views.graph.composites import Chart, collapsed, folded, settled
from rcsc.views.graph.derive import Derived, derive
from rcsc.views.graph.find import NotFound, tables
from rcsc.views.graph.formats.state_graph import ANY, Edge, StateGraph
from rcsc.views.graph.labels import MOST_LETTERS
from rcsc.views.graph.layout import Point

REPO = Path(__file__).parents[2]
SHIPPED = [
    "task/acquire", "task/move", "task/transfer", "emove/locate", "examples/acquire_published", "gallery/packml/unit",
    "gallery/linuxcnc_homing/homing", "gallery/cia402/drive", "gallery/rfc9293/tcp", "gallery/plcopen_safety/guard",
    "gallery/ros2_lifecycle/published",
]  # fmt: skip


@cache
def graphs(name: str) -> tuple[StateGraph, ...]:
    entries = tables(str(REPO / "tables" / f"{name}.rcs"))
    assert not isinstance(entries, NotFound)
    found = [derive(e.program, e.table, e.loaded.files[e.table.file], Options()) for e in entries]
    return tuple(each.graph for each in found if isinstance(each, Derived))


def said(graph: StateGraph) -> set[Edge]:
    return {settled(graph, edge) for edge in graph.edges if not edge.default.endswith("unreachable")}


STEPS = np.linspace(0.0, 1.0, 101)[:, np.newaxis]
SHARES = np.hstack([math.comb(3, at) * (1 - STEPS) ** (3 - at) * STEPS**at for at in range(4)])


def points(curve: tuple[Point, ...]) -> npt.NDArray[np.float64]:
    """Points of Bezier curves, so dense that no letter lies between two; shape (n, 2), in px."""
    return np.vstack([SHARES @ np.array(curve[at : at + 4]) for at in range(0, len(curve) - 3, 3)])


def crossed(placed: Sheet) -> list[tuple[str, str, str]]:
    """Arrows that go through a label or a box, by more than 1 px."""
    boxes = [*placed.boxes, *placed.headings, *(arrow.label for arrow in placed.arrows if arrow.label)]
    low = np.array([box.corner for box in boxes]) + 1.0
    high = low + np.array([(box.width_px, box.height_px) for box in boxes]) - 2.0
    found = []
    for arrow in placed.arrows:
        at = np.vstack([points(curve) for curve in arrow.curves])[:, np.newaxis]
        inside = ((low <= at) & (at <= high)).all(axis=2).any(axis=0)
        found += [(arrow.source, arrow.target, str(boxes[box])) for box in np.flatnonzero(inside)]
    return found


def overlapping(one: SheetBox, other: SheetBox) -> bool:
    return all(
        one.corner[axis] < other.corner[axis] + size and other.corner[axis] < one.corner[axis] + own
        for axis, own, size in ((0, one.width_px, other.width_px), (1, one.height_px, other.height_px))
    )


def check(placed: Sheet) -> None:
    """What makes a drawing legible."""
    assert crossed(placed) == []
    boxes = [*placed.boxes, *placed.headings, *(arrow.label for arrow in placed.arrows if arrow.label)]
    for at, box in enumerate(boxes):
        assert not any(overlapping(box, other) for other in boxes[:at]), box
        assert box.corner[0] >= 0
        assert box.corner[1] >= 0
        assert box.corner[0] + box.width_px <= placed.width_px
        assert box.corner[1] + box.height_px <= placed.height_px
        for row in box.rows:
            assert row.width_px <= box.width_px
            assert row.top_px + row.height_px <= box.height_px
            assert all(len(text) <= MOST_LETTERS + 4 for _, text in row.texts)
            assert len(row.texts) <= 3 * MOST_TEXTS
    for frame in placed.frames:
        for box in (*placed.boxes, *placed.headings):
            low = box.corner[0] + box.width_px, box.corner[1] + box.height_px
            assert (holds(frame, box.corner) and holds(frame, low)) == (
                box.kind in ("state", "shut", "open") and set(box.states) <= set(frame.states)
            ), (
                frame.name,
                box.name,
            )


def holds(box: SheetBox, point: Point, inset_px: float = 0.0) -> bool:
    """Whether a point lies in a box, at least so far from its border."""
    x, y = point[0] - box.corner[0], point[1] - box.corner[1]
    return inset_px <= x <= box.width_px - inset_px and inset_px <= y <= box.height_px - inset_px


def unfolded(chart: Chart) -> frozenset[Edge]:
    """The edges of a chart, each as its graph has it, settled."""
    rows = [row for arrow in chart.arrows for row in arrow.rows]
    rows += [row for each in chart.composites for row in each.stays]
    rows += [row for each in chart.stays.values() for row in each]
    return frozenset(edge for row in rows for edge in row.edges)


def shown(placed: Sheet) -> set[str]:
    """The lines that the drawing names."""
    boxes = [*placed.boxes, *placed.headings, *(arrow.label for arrow in placed.arrows if arrow.label)]
    return {row.line for box in boxes for row in box.rows if row.line}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_table_is_drawn_whole_and_legible(name: str) -> None:
    for graph in graphs(name):
        chart = folded(graph)
        assert unfolded(chart) == said(graph)
        placed = sheet(chart)
        check(placed)
        assert shown(placed) == {edge.line for edge in said(graph)}
        for each in chart.composites:
            check(sheet(collapsed(chart, [each.name]), [each.name]))
        every = [each.name for each in chart.composites]
        check(sheet(collapsed(chart, every), every))


def test_the_orders_of_acquire_are_on_its_arrows() -> None:
    [graph] = graphs("task/acquire")
    chart = folded(graph)
    arrows = {(arrow.source, arrow.target): arrow for arrow in sheet(chart).arrows if not arrow.dashed}
    locate = arrows["state_2", "state_3"].label
    assert locate is not None
    assert ("does", "/ order locate") in locate.rows[0].texts
    [group] = chart.composites
    assert (group.states, [row.line for row in group.stays]) == (
        ("state_2", "state_3", "state_4", "state_5"),
        ["15"],
    )
    fan = arrows[group.name, "f_state"].label
    assert fan is not None
    assert [row.line for row in fan.rows] == ["10", "11", "12", "13"]
    assert chart.doing["state_3"] == ("locate", "executing")
    shut = collapsed(chart, [group.name])
    assert {"state_2", "state_3"}.isdisjoint(box.name for box in sheet(shut, [group.name]).boxes)
    assert ("d_state", ("state_5",)) in {(a.target, row.sources) for a in shut.arrows for row in a.rows}


def test_the_failure_fan_of_cia_402_is_one_arrow() -> None:
    """One line leaves six states: that folds more than as many lines that lead to one state."""
    [graph] = graphs("gallery/cia402/drive")
    chart = folded(graph)
    [fan] = [arrow for arrow in chart.arrows if arrow.target == "fault_reaction_active"]
    [group] = [each for each in chart.composites if each.name == fan.source]
    assert set(graph.states) - set(group.states) == {"fault", "fault_reaction_active"}
    assert [(row.line, row.sources) for row in fan.rows] == [("T13", ())]


def test_a_fan_of_many_lines_is_legible() -> None:
    """Its label is higher than the states beside it: the arrow to it ends at its border; lines that ask and do the same say it once."""
    states = [f"s{at}" for at in range(30)]
    goes = [
        Edge(f"g{at}", state, states[(at + 1) % 30], "go", "speed(1)", shown="go")
        for at, state in enumerate(states)
    ]
    fails = [
        Edge(f"f{at}", state, "failed", "bad", "speed(0)", shown="bad") for at, state in enumerate(states)
    ]
    chart = folded(StateGraph("t", "now", (*goes, *fails), initial="s7", states=(*states, "failed")))
    placed = sheet(chart)
    check(placed)
    [label] = [arrow.label for arrow in placed.arrows if arrow.target == "failed"]
    assert label is not None
    assert [row.texts for row in label.rows] == [
        (("from", "from s0"), ("guard", "bad"), ("does", "/ speed = 0")),
        *(((("from", f"from {state}: as f0"),)) for state in states[1:]),
    ]
    assert all("when bad" in row.whole for row in label.rows)


@pytest.mark.parametrize("letters", [34, 35, 60, 100])
def test_a_long_name_is_shown_whole(letters: int) -> None:
    name = "the_valve_of_the_left_clamp_in_the_cell_" * 3
    name = name[:letters]
    box = next(
        box for box in sheet(folded(StateGraph("t", "now", (), states=(name, "b")))).boxes if box.name == name
    )
    texts = [text for _, text in box.rows[0].texts]
    assert "".join(texts) == name
    assert all(text.endswith("_") for text in texts[:-1]), "broken within a word"


NAMES = st.sampled_from(
    ["a", "b", "c", "d", "e", "f", "a_state_with_a_name_that_is_longer_than_any_label_may_be_wide"]
)
GUARDS = st.sampled_from(
    [
        "",
        "x",
        "x = 1 and y /= 2",
        "not_a_word_that_could_be_broken_anywhere_however_long_it_is = 17",
        "(x or y) and " * 9 + "z",
    ]
)
EFFECTS = st.sampled_from(
    ["", "command_out(go)", "procedures(begin, end) command_out(stop) status_out(done)", "x(1) y(2) z(3)"]
)
EDGES = st.builds(
    Edge,
    st.sampled_from("123456789"),
    NAMES | st.just(ANY),
    NAMES | st.just(ANY),
    GUARDS,
    EFFECTS,
    st.sampled_from(["", "p"]),
    shown=GUARDS,
)


@settings(max_examples=60, deadline=None)
@given(st.lists(EDGES, min_size=1, max_size=24, unique_by=lambda e: (e.line, e.source, e.target)), st.data())
def test_any_graph_is_drawn_whole_and_legible(edges: list[Edge], data: st.DataObject) -> None:
    states = sorted({end for edge in edges for end in (edge.source, edge.target)} - {ANY})
    graph = StateGraph(
        "t", "now", tuple(edges), initial=data.draw(st.sampled_from([*states, ""])), states=tuple(states)
    )
    chart = folded(graph)
    assert unfolded(chart) == said(graph)
    check(sheet(chart))
    names = [each.name for each in chart.composites]
    if names:
        shut = data.draw(st.lists(st.sampled_from(names), unique=True))
        check(sheet(collapsed(chart, shut), shut))
        for_sources(chart)


def for_sources(chart: Chart) -> None:
    """A row that names no sources leaves every state of its composite."""
    states = {each.name: set(each.states) for each in chart.composites}
    for arrow in chart.arrows:
        for row in arrow.rows:
            wanted = states.get(arrow.source, {arrow.source})
            assert {edge.source for edge in row.edges} == set(row.sources or wanted)
