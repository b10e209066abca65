"""Graphs as Mermaid state diagrams (`stateDiagram-v2`): written, and read back.

A transition's text is `LINE [guard] effect`, with ` by PROCEDURES` after where procedures decide it and the word DEFAULT in place
of a guard; what is said of the graph as a whole stands in comments, `%% table: acquire`. A person may leave out all but the arrows
and the name of the table. Composite states and notes are not read.
"""

import re
from dataclasses import dataclass, field

from rcsc.views.graph.formats.reading import ReadArrow, UnreadableError, finished
from rcsc.views.graph.formats.state_graph import ANY, HEADER, Edge, StateGraph, free, header

_ANY_NAME = "any state"
_HEADER = re.compile(r"%%\s*(\w+)\s*:\s*(.*)$")
_ARROW = re.compile(r"(\[\*\]|\w+)\s*-->\s*(\[\*\]|\w+)\s*(?::\s*(.*))?$")
_ALIAS = re.compile(r'state\s+"([^"]*)"\s+as\s+(\w+)$')
_NAMED = re.compile(r"(\w+)\s*:\s*(.*)$")
_PASSED = re.compile(r"(direction|classDef|class|style|accTitle|accDescr|title)\b|---$|state\s+\w+$|\w+$")
_LINE = re.compile(r"(?:\(?(\w+)\)?(?=\s|\[|$))?\s*(DEFAULT(?: unreachable)?(?=\s|$))?\s*")


def write(graph: StateGraph) -> str:
    """Write the graph as a Mermaid state diagram."""
    lines = ["stateDiagram-v2", *(f"  %% {word}: {text}" for word, text in header(graph).items())]
    any_id = free("any_state", graph.states)
    if any(ANY in (edge.source, edge.target) for edge in graph.edges):
        lines.append(f'  state "{_ANY_NAME}" as {any_id}')
    if graph.initial in graph.states:
        lines.append(f"  [*] --> {graph.initial}")
    for edge in graph.edges:
        source, target = (any_id if end == ANY else end for end in (edge.source, edge.target))
        lines.append(f"  {source} --> {target} : {_text(edge)}")
    return "\n".join([*lines, ""])


def _text(edge: Edge) -> str:
    guard = edge.default or (f"[{edge.guard}]" if edge.guard else "")
    by = f"by {edge.decided}" if edge.decided else ""
    return " ".join(part for part in (edge.line, guard, edge.effect, by) if part)


# --- reading -----------------------------------------------------------------------------


def read(text: str) -> StateGraph:
    """Read the graph that the text draws; raise UnreadableError where it is none."""
    read_ = _Read()
    at = 0
    for raw in text.splitlines(keepends=True):
        read_.line(raw.strip(), at + len(raw) - len(raw.lstrip()))
        at += len(raw)
    if not read_.begun:
        raise UnreadableError("the text has no `stateDiagram-v2`")
    ends = {name: ANY for name, shown in read_.names.items() if shown == _ANY_NAME}
    return finished(
        read_.attributes,
        [
            ReadArrow(ends.get(d.source, d.source), ends.get(d.target, d.target), d.attributes, d.offset)
            for d in read_.drawn
        ],
    )


@dataclass(slots=True)
class _Read:
    """The content of the lines so far: attributes of the graph, its arrows, and the shown names of states by their own."""

    attributes: dict[str, str] = field(default_factory=dict)
    drawn: list[ReadArrow] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)
    begun: bool = False

    def line(self, line: str, offset: int) -> None:
        """Take the next line, without the space around it; `offset` is where in the text it begins."""
        if match := _HEADER.match(line):
            if match[1] in HEADER:
                self.attributes[match[1]] = match[2].strip()
        elif line in ("stateDiagram-v2", "stateDiagram"):
            self.begun = True
        elif not line or line.startswith("%%"):
            return
        elif self.begun or _PASSED.match(line) or line.startswith("title:"):
            self._statement(line.removesuffix(";"), offset)
        else:
            raise UnreadableError("the text does not begin with `stateDiagram-v2`", offset)

    def _statement(self, line: str, offset: int) -> None:
        if match := _ARROW.match(line):
            self._arrow(match[1], match[2], match[3] or "", offset)
        elif match := _ALIAS.match(line):
            self.names[match[2]] = match[1]
        elif match := _NAMED.match(line):
            self.names[match[1]] = match[2]
        elif not _PASSED.match(line):
            raise UnreadableError(f"`{line}` is not read: only arrows between plain states are", offset)

    def _arrow(self, source: str, target: str, text: str, offset: int) -> None:
        if source == "[*]":
            self.attributes["initial"] = target
        elif target == "[*]":
            raise UnreadableError("a table has no end: a level runs its table in every cycle", offset)
        else:
            self.drawn.append(ReadArrow(source, target, _transition(text, offset), offset))


def _transition(text: str, offset: int) -> dict[str, str]:
    """Return the attributes that a transition's text states."""
    match = _LINE.match(text)
    assert match is not None  # everything in it may be left out
    attributes = {"line": match[1] or "", "default": match[2] or ""}
    rest = text[match.end() :]
    if rest.startswith("["):
        end = _closing(rest)
        if end < 0:
            raise UnreadableError("the guard's bracket is not closed", offset)
        attributes["when"] = rest[1:end]
        rest = rest[end + 1 :]
    attributes["does"], _, attributes["decided"] = (
        rest.partition("by ") if rest.strip().startswith("by ") else rest.partition(" by ")
    )
    return attributes


def _closing(text: str) -> int:
    """Return the position where the bracket that opens the text is closed; -1 where it is not."""
    depth = 0
    for at, letter in enumerate(text):
        depth += (letter == "[") - (letter == "]")
        if depth == 0:
            return at
    return -1
