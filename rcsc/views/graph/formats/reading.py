"""What goes wrong when a graph is read, and the steps that reading has in common whatever the form."""

from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.views.graph.formats.state_graph import ANY, HEADER, Edge, StateGraph, with_header


class UnreadableError(Exception):
    """The text is not in its form.

    Attributes:
        what: What is wrong, in words.
        offset: Where, in characters from the start.
    """

    def __init__(self, what: str, offset: int = 0) -> None:
        super().__init__(what)
        self.what, self.offset = what, offset


MOST_BYTES = 16 * 1024 * 1024
"""Largest text of a graph."""
MOST_ARROWS = 4096
"""Most arrows of a graph; more make no table that anyone reads."""


@dataclass(frozen=True, slots=True)
class ReadArrow:
    """An arrow as a form has it: its ends, and attributes (`line`, `when`, `does`, `decided`, `default`)."""

    source: str
    target: str
    attributes: Mapping[str, str]
    offset: int = 0

    def edge(self) -> Edge:
        """Return the arrow as an edge of a state graph."""
        words = ("line", "when", "does", "decided", "default")
        line, guard, effect, decided, default = (self.attributes.get(word, "").strip() for word in words)
        return Edge(line, self.source, self.target, guard, effect, decided, default, offset=self.offset)


def finished(attributes: Mapping[str, str], drawn: list[ReadArrow]) -> StateGraph:
    """Return the graph of the arrows read; raise UnreadableError where it is no graph of a table."""
    if not drawn:
        raise UnreadableError("the graph has no edge")
    if len(drawn) > MOST_ARROWS:
        raise UnreadableError(
            f"the graph has {len(drawn)} arrows, more than {MOST_ARROWS}", drawn[MOST_ARROWS].offset
        )
    attributes = {word: text for word, text in attributes.items() if word in HEADER}
    if not attributes.get("table"):
        raise UnreadableError("the graph does not say which `table` it is")
    states = dict.fromkeys(name for arrow in drawn for name in (arrow.source, arrow.target) if name != ANY)
    for arrow in drawn:
        if arrow.target == ANY and arrow.source != ANY:
            raise UnreadableError(
                "an edge can lead to every state only from every state: draw a loop", arrow.offset
            )
    return with_header(dict(attributes), tuple(arrow.edge() for arrow in drawn), tuple(states))


def diagnosed(error: UnreadableError, source: Source) -> Diagnostic:
    """Return the error as a diagnostic at its place in the text."""
    start = min(max(error.offset, 0), len(source.text))
    end = source.text.find("\n", start)
    span = Span(source.name, start, len(source.text) if end < 0 else end)
    return Diagnostic(Code.GRAPH_UNREADABLE, error.what, Label(span))
