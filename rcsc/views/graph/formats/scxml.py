"""Graphs as State Chart XML: written, and read back.

Source: W3C recommendation State Chart XML, 1 September 2015. States stand in one compound state, whose own transitions are those
from every state (without a target where the state is kept); each happens at the event `cycle`. Guards are in the table's words and
not in a data model that an SCXML processor knows; what it has no word for stands in attributes of the name space below.
"""

import re
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from rcsc.base.host.files.read import Malformed, xml_of
from rcsc.views.graph.formats.reading import ReadArrow, UnreadableError, finished
from rcsc.views.graph.formats.state_graph import ANY, Edge, StateGraph, free, header

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

SCXML = "http://www.w3.org/2005/07/scxml"
OWN = "urn:rcsc:graph"
_STATE = f"{{{SCXML}}}state"
_WORDS = ("line", "does", "decided", "default")


def write(graph: StateGraph) -> str:
    """Return the graph as SCXML."""
    whole = free("any", graph.states)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    about = "".join(f"\n    rcsc:{word}={quoteattr(text)}" for word, text in header(graph).items())
    lines.append(
        f'<scxml xmlns="{SCXML}" xmlns:rcsc="{OWN}" version="1.0" name={quoteattr(graph.table)}{about}>'
    )
    initial = f" initial={quoteattr(graph.initial)}" if graph.initial in graph.states else ""
    lines.append(f"  <state id={quoteattr(whole)}{initial}>")
    lines += [f"    {_transition(edge)}" for edge in graph.edges if edge.source == ANY]
    for state in graph.states:
        lines.append(f"    <state id={quoteattr(state)}>")
        lines += [f"      {_transition(edge)}" for edge in graph.edges if edge.source == state]
        lines.append("    </state>")
    return "\n".join([*lines, "  </state>", "</scxml>", ""])


def _transition(edge: Edge) -> str:
    target = "" if edge.target == ANY else edge.target
    own = zip(_WORDS, (edge.line, edge.effect, edge.decided, edge.default), strict=True)
    attributes = {"event": "cycle", "cond": edge.guard, "target": target} | {
        f"rcsc:{word}": text for word, text in own
    }
    return (
        f"<transition {' '.join(f'{word}={quoteattr(text)}' for word, text in attributes.items() if text)}/>"
    )


# --- reading -----------------------------------------------------------------------------


def read(text: str) -> StateGraph:
    """Read the graph that the text draws; raise UnreadableError where it is none."""
    try:
        root = xml_of(text)
    except Malformed as error:
        what, row, column = error.args
        before = text.splitlines(keepends=True)[: row - 1]
        raise UnreadableError(what, sum(map(len, before)) + column) from error
    if root.tag != f"{{{SCXML}}}scxml":
        raise UnreadableError("the outermost element is not `scxml`")
    attributes = {
        name.removeprefix(f"{{{OWN}}}"): value
        for name, value in root.attrib.items()
        if name.startswith(f"{{{OWN}}}")
    }
    attributes.setdefault("table", root.get("name", ""))
    states = [element for element in root if element.tag == _STATE]
    whole = len(states) == 1 and any(element.tag == _STATE for element in states[0])
    attributes.setdefault("initial", (states[0] if whole else root).get("initial", ""))
    reader = _Reader(text)
    for state in states:
        reader.state(state, ANY if whole else state.get("id", ""))
    return finished({word: value for word, value in attributes.items() if value}, reader.drawn)


class _Reader:
    """Reads the transitions; counts them in the text to find their places, for the parser does not tell."""

    def __init__(self, text: str) -> None:
        self.places = [
            match.start()
            for match in re.finditer(r"<transition\b", re.sub(r"<!--.*?-->", _blank, text, flags=re.DOTALL))
        ]
        self.drawn: list[ReadArrow] = []

    def state(self, state: "Element", name: str) -> None:
        """Read the transitions of a state and of those within it, in the order of the text."""
        for element in state:
            if element.tag == _STATE and name != ANY:
                raise UnreadableError(f"state `{name}` has states of its own; only the outermost may")
            if element.tag == _STATE:
                self.state(element, element.get("id", ""))
            if element.tag != f"{{{SCXML}}}transition":
                continue
            at = len(self.drawn)
            attributes = {word: element.get(f"{{{OWN}}}{word}", "") for word in _WORDS} | {
                "when": element.get("cond", "")
            }
            offset = self.places[at] if at < len(self.places) else 0
            self.drawn.append(ReadArrow(name, element.get("target") or name, attributes, offset))


def _blank(match: re.Match[str]) -> str:
    return " " * len(match.group())
