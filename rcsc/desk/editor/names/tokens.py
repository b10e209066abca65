"""What each word of a text is, for colours: from the index of names, and from the language's own words.

In: a text and its names. Out: tokens in order, none over the end of a line.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Occurrence, Space
from rcsc.lang.operator_table import LOGIC
from rcsc.lang.syntax import tree

KEYWORDS = LOGIC | frozenset(
    """
    use unit const set enum type record input state output assume assumed monitored proved invariant property procedure module
    extern owner table assuming giving link serves commands adopt level period preprocess postprocess by if else case for in local next
    not mod was when then until upon true false bool int real single array of clamp reject deferred safe restart
    reads writes python c command rest status done failed executing order report stream reason within answered cycles without after
    again above same all line DEFAULT unreachable procedures command_out status_out req abs min max count
    """.split()
)
"""Words that mean something where no name stands."""
_TOKEN = re.compile(
    r"(?P<comment>#[^\r\n]*)|(?P<string>\"[^\"\\\r\n]*\")|(?P<number>0[xX][0-9a-fA-F_]+|0[bB][01xX_]+|\d[\d_]*(?:\.\d[\d_]*)?(?:[eE][+-]?\d+)?)"
    r"|(?P<event>@[A-Za-z]+)|(?P<word>[A-Za-z_]\w*)|(?P<operator>:=|/=|<=|>=|<<|>>|\.\.|[=<>+\-*/&])",
    re.ASCII,
)
TYPES = (
    "namespace", "type", "enum", "enumMember", "variable", "parameter", "property", "function", "class", "interface", "decorator", "label",
    "keyword", "comment", "string", "number", "operator",
)  # fmt: skip
"""Types of tokens, in the order in which the protocol counts them."""
MODIFIERS = ("declaration", "readonly")
_OF_SPACE = {
    Space.VALUE: "variable", Space.MEMBER: "enumMember", Space.TYPE: "type", Space.CALL: "function", Space.TABLE: "class",
    Space.CLAIM: "decorator", Space.UNIT: "type", Space.LINK: "interface", Space.PEER: "namespace", Space.PARTY: "namespace",
    Space.FIELD: "property", Space.LOCAL: "parameter", Space.LINE: "label", Space.FILE: "namespace",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Token:
    """A token: where, what, and its modifiers."""

    start: int
    length: int
    type: str
    modifiers: tuple[str, ...] = ()


def tokens(names: Names, file: str) -> Iterator[Token]:
    """Yield the tokens of a file."""
    text = names.sources[file].text if file in names.sources else ""
    known = {span.start: (each, span) for each in names.of(file) for span in (each.span, *each.further)}
    members = {each.text for each in names.every() if each.declares and each.space is Space.MEMBER}
    past = 0
    for found in _TOKEN.finditer(text):
        start, length, kind = found.start(), len(found[0]), str(found.lastgroup)
        if start < past:
            continue  # the rest of a line's name, which may begin with digits
        name, span = known.get(start, (None, None))
        if name is not None and span is not None and name.space is not Space.FILE:
            past = span.end
            yield _named(name, start, span.end - span.start, members)
        elif kind == "word":
            if found[0] in KEYWORDS:
                yield Token(start, length, "keyword")
        else:
            yield Token(start, length, "keyword" if kind == "event" else kind)


def _named(name: Occurrence, start: int, length: int, members: set[str]) -> Token:
    kind = _OF_SPACE[name.space]
    if name.space is Space.VALUE and not name.declares and name.text in members:
        kind = "enumMember"
    if name.space is Space.TYPE and isinstance(name.node, tree.EnumDecl):
        kind = "enum"
    constant = isinstance(name.node, tree.ConstDecl | tree.SetDecl)
    said = (("declaration", name.declares), ("readonly", constant))
    return Token(start, length, kind, tuple(word for word, is_so in said if is_so))
