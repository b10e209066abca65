"""The forms of a graph that can be read back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rcsc.views.graph.formats import dot, mermaid, scxml
from rcsc.views.graph.formats.state_graph import StateGraph


@dataclass(frozen=True, slots=True)
class GraphForm:
    """One form.

    Attributes:
        endings: Endings of its files.
        read: Raises UnreadableError.
    """

    write: Callable[[StateGraph], str]
    read: Callable[[str], StateGraph]
    endings: tuple[str, ...]


FORMS: Mapping[str, GraphForm] = {
    "dot": GraphForm(dot.write, dot.read, (".dot", ".gv")),
    "mermaid": GraphForm(mermaid.write, mermaid.read, (".mmd", ".mermaid")),
    "scxml": GraphForm(scxml.write, scxml.read, (".scxml", ".xml")),
}


def form_of(text: str) -> str:
    """Return the form of the text, by its beginning; Mermaid where nothing else fits."""
    begun = text.lstrip("\ufeff \t\r\n")
    if begun.startswith("<"):
        return "scxml"
    return "dot" if "digraph" in begun.partition("{")[0] else "mermaid"
