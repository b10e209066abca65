"""What a state graph is, in whatever form it is drawn.

Attributes of an edge are in the table's own words: a guard is an expression, an effect is action cells under their headings.
"""

from collections.abc import Container
from dataclasses import dataclass

ANY = "*"
"""In place of a source: every state. In place of a target: the state in which the line matched."""

LINES = "(line)"
"""In place of the state variable: the nodes are lines, and an edge says which can match next (`lines`)."""


@dataclass(frozen=True, slots=True)
class Edge:
    """A line of the table, from a state to a state.

    Attributes:
        line: Name of the line; "" where whoever drew it gave none.
        source: A state, or ANY.
        target: A state, or ANY. An edge to another state says that the line writes it; a loop writes nothing.
        guard: The condition beside the state, terms joined by `and`; "" for none.
        effect: The line's other actions, as `heading(action, action) heading(...)`.
        decided: Procedures that decide the target; then the edge only shows where they can lead. "" where the edge says it.
        default: "", `DEFAULT` or `DEFAULT unreachable`.
        shown: The guard without what the state implies; for the eye alone.
        offset: Where the edge was read, in characters from the start of the text.
    """

    line: str
    source: str
    target: str
    guard: str = ""
    effect: str = ""
    decided: str = ""
    default: str = ""
    shown: str = ""
    offset: int = 0


@dataclass(frozen=True, slots=True)
class StateGraph:
    """A table as a graph.

    Attributes:
        table: Its name.
        state: The variable whose values are the states.
        edges: In the order of the table's lines.
        deferred: Whether the next state waits for an echo: `next cur_state := s`.
        initial: The state before the first cycle; "" where it is not said.
        assuming: Names of the assumptions.
        uses: The files that the table's file uses.
        columns: The table's heading row without the line's name, `a | b || procedures | command_out`; "" where it is not said.
        lines: The lines' names in the table's order; those not named come last.
        states: Every state that is drawn, in declared order.
    """

    table: str
    state: str
    edges: tuple[Edge, ...]
    deferred: bool = True
    initial: str = ""
    assuming: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    columns: str = ""
    lines: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


HEADER = ("table", "state", "next", "initial", "assuming", "uses", "columns", "lines")
"""Attributes of the graph as a whole, in every form."""


def header(graph: StateGraph) -> dict[str, str]:
    """Return the attributes of the graph as a whole, without empty ones."""
    attributes = {
        "table": graph.table,
        "state": graph.state,
        "next": "deferred" if graph.deferred else "at once",
        "initial": graph.initial,
        "assuming": ", ".join(graph.assuming),
        "uses": ", ".join(graph.uses),
        "columns": graph.columns,
        "lines": " ".join(graph.lines),
    }
    return {word: text for word, text in attributes.items() if text}


def with_header(attributes: dict[str, str], edges: tuple[Edge, ...], states: tuple[str, ...]) -> StateGraph:
    """Return the graph with these attributes; one that is missing is as in `StateGraph`."""
    return StateGraph(
        attributes.get("table", ""),
        attributes.get("state", "cur_state"),
        edges,
        attributes.get("next", "deferred") == "deferred",
        attributes.get("initial", ""),
        tuple(name.strip() for name in attributes.get("assuming", "").split(",") if name.strip()),
        tuple(name.strip() for name in attributes.get("uses", "").split(",") if name.strip()),
        attributes.get("columns", ""),
        tuple(attributes.get("lines", "").split()),
        states,
    )


def free(name: str, taken: Container[str]) -> str:
    """Return the name, with as many `_` after it as make it one that is not taken."""
    while name in taken:
        name += "_"
    return name
