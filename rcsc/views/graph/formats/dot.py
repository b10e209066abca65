"""Graphs in the DOT language: written so that any of its programs draws them, and read back.

Source: the DOT grammar of Graphviz. What the table says stands in attributes of its own: `line`, `when` and `does` of an edge,
and of the graph the words of `model.HEADER`. Subgraphs are read as if their braces were not there, ports are passed over.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

from rcsc.views.graph.formats.reading import ReadArrow, UnreadableError, finished
from rcsc.views.graph.formats.state_graph import ANY, LINES, Edge, StateGraph, header

MOST_WIDE = 44
"""Characters of a label's line."""
DEEPEST = 64
"""Subgraphs in each other."""
_TOKEN = re.compile(
    r"""(?P<blank>\s++|//[^\n]*+|/\*.*?\*/|^\#[^\n]*+)
      |(?P<arrow>->|--)|(?P<mark>[{}\[\]=;,:+])
      |(?P<text>"[^"\\]*+(?:\\.[^"\\]*+)*+")
      |(?P<name>[A-Za-z_\u0080-\U0010ffff][A-Za-z0-9_\u0080-\U0010ffff]*|-?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?))""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)


def write(graph: StateGraph) -> str:
    """Write the graph in DOT."""
    lines = [f"digraph {_quoted(graph.table)} {{"]
    lines += [f"  {word}={_quoted(text)};" for word, text in header(graph).items()]
    lines += ["  node [shape=circle];", "  edge [fontsize=10];"]
    lines += [f"  {_quoted(name)};" for name in graph.states]
    if any(ANY in (edge.source, edge.target) for edge in graph.edges):
        lines.append(
            f'  "{ANY}" [label="any\\n{"line" if graph.state == LINES else "state"}", shape=doublecircle];'
        )
    if graph.initial in graph.states:
        lines += ['  "" [shape=point, label=""];', f'  "" -> {_quoted(graph.initial)};']
    lines += [f"  {_quoted(e.source)} -> {_quoted(e.target)} [{_attributes(e)}];" for e in graph.edges]
    return "\n".join([*lines, "}", ""])


def _attributes(edge: Edge) -> str:
    attributes = {
        "label": wrapped(
            " ".join(part for part in (edge.line and f"({edge.line})", edge.shown or edge.default) if part)
        ),
        "line": edge.line,
        "when": edge.guard,
        "does": edge.effect,
        "decided": edge.decided,
        "default": edge.default,
    }
    style = ", style=dashed" if edge.decided or edge.default else ""
    return ", ".join(f"{word}={_quoted(text)}" for word, text in attributes.items() if text) + style


def wrapped(text: str) -> str:
    """Break the text before ` and ` where a line gets too wide."""
    lines = [""]
    for piece in re.split(r"(?= and )", text):
        if lines[-1] and len(lines[-1]) + len(piece) > MOST_WIDE:
            lines.append(piece.strip())
        else:
            lines[-1] += piece
    return "\n".join(lines)


def _quoted(text: str) -> str:
    inside = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{inside}"'


# --- reading -----------------------------------------------------------------------------


def read(text: str) -> StateGraph:
    """Read the graph that the text draws; raise UnreadableError where it is none."""
    reader = _Reader(list(_tokens(text)))
    reader.graph()
    return finished(reader.attributes, reader.drawn)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    offset: int


def _tokens(text: str) -> Iterator[_Token]:
    at = 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise UnreadableError(f"`{text[at]}` is not DOT", at)
        if match.lastgroup == "text":
            inside = match.group()[1:-1].replace("\\\n", "")
            plain = re.sub(
                r"\\(.)", lambda m: {"n": "\n", "l": "\n", "r": "\n"}.get(m[1], m[1]), inside, flags=re.DOTALL
            )
            yield _Token("name", plain, at)
        elif match.lastgroup != "blank":
            yield _Token(match.lastgroup or "", match.group(), at)
        at = match.end()
    yield _Token("end", "the end of the text", len(text))


@dataclass(slots=True)
class _Reader:
    """Reads one graph; ignores `edge` attributes set for all."""

    tokens: list[_Token]
    at: int = 0
    depth: int = 0
    attributes: dict[str, str] = field(default_factory=dict)
    drawn: list[ReadArrow] = field(default_factory=list)

    def graph(self) -> None:
        """Read the whole text."""
        self.at += self._now().kind == "name" and self._now().text.lower() == "strict"
        begun = self._take("name")
        if begun.text.lower() != "digraph":
            raise UnreadableError("a state graph is a `digraph`", begun.offset)
        if self._now().kind == "name":
            self.attributes["table"] = self._take("name").text
        self._take("mark", "{")
        self._statements()
        if self._now().kind != "end":
            raise UnreadableError(f"`{self._now().text}` after the graph", self._now().offset)

    def _statements(self) -> None:
        """Read the statements up to the closing brace."""
        self.depth += 1
        if self.depth > DEEPEST:
            raise UnreadableError(f"subgraphs are nested more than {DEEPEST} deep", self._now().offset)
        while not self._is("}"):
            if self._is("{"):
                self.at += 1
                self._statements()
            elif not self._skip(";"):
                self._statement()
        self.at += 1
        self.depth -= 1

    def _statement(self) -> None:
        first = self._take("name")
        if first.text.lower() == "subgraph":
            if self._now().kind == "name":
                self.at += 1
            self._take("mark", "{")
            self._statements()
            return
        if first.text.lower() in ("node", "edge", "graph") and self._is("["):
            attributes = self._attributes()
            self.attributes |= attributes if first.text.lower() == "graph" else {}
            return
        if self._skip("="):
            self.attributes[first.text] = self._take("name").text
            return
        self._port()
        ends = [first]
        while self._now().kind == "arrow":
            self.at += 1
            ends.append(self._take("name"))
            self._port()
        attributes = self._attributes()
        self.drawn += [
            ReadArrow(source.text, target.text, attributes, source.offset)
            for source, target in pairwise(ends)
            if source.text  # the nameless point before the initial state
        ]
        if not first.text and len(ends) == 2:
            self.attributes.setdefault("initial", ends[1].text)

    def _port(self) -> None:
        while self._skip(":"):
            self._take("name")

    def _attributes(self) -> dict[str, str]:
        attributes: dict[str, str] = {}
        while self._skip("["):
            while not self._skip("]"):
                name = self._take("name").text
                attributes[name] = self._value() if self._skip("=") else "true"
                if not self._skip(","):
                    self._skip(";")
        return attributes

    def _value(self) -> str:
        text = self._take("name").text
        while self._skip("+"):
            text += self._take("name").text
        return text

    # --- tokens ---

    def _now(self) -> _Token:
        return self.tokens[self.at]

    def _is(self, mark: str) -> bool:
        if self._now().kind == "end":
            raise UnreadableError(f"the text ends where `{mark}` or more was expected", self._now().offset)
        return self._now() == _Token("mark", mark, self._now().offset)

    def _skip(self, mark: str) -> bool:
        present = self._now() == _Token("mark", mark, self._now().offset)
        self.at += present
        return present

    def _take(self, kind: str, text: str = "") -> _Token:
        token = self._now()
        if token.kind != kind or (text and token.text != text):
            wanted = f"`{text}`" if text else "a name"
            raise UnreadableError(f"expected {wanted}, found `{token.text}`", token.offset)
        self.at += 1
        return token
