"""The templates, C in lines of at most 110 columns, and where each of them comes from; the only importer of Jinja2.

A template, or code in it, says by marks where lines come from: a line with `mark` before them, and `END` after. Marks are no lines of
the file.
"""

import json
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Any

import jinja2

from rcsc.code.emit.code_tree import IN_C, IN_PYTHON, Function
from rcsc.code.emit.plan import Origin, Sort, infrastructure

WIDTH = 110
STEP = "    "
COMMENT = re.compile(r"(?P<pad> *)(?P<code>.*?) ?/\* (?P<words>.*) \*/")
BREAK = re.compile(r"(?:&&|\|\||[<>!=]=|[<>?:&|+,]) ")
"""What a line of C may end with."""
END = "\x01"
"""A line that ends what the last mark begins; it is no line of the file."""
DIRECTIVES = (
    ("#include", "declares what the file uses"),
    ("#pragma", "has reals rounded one operation at a time, as they were proved"),
    ("#", "chooses by the compiler, or guards against including twice"),
    ('extern "C" {', "lets C++ call it"),
    ("}", "lets C++ call it"),
)
"""What lines of C outside of marks are for, by how they begin."""
SAID, LIBRARY = "says what the file is", "the standard library"
STATEMENTS = (("import ", LIBRARY), ("from ", LIBRARY), ('"""', SAID))
"""What lines of Python outside of marks are for."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Lines of a generated file that have one origin.

    Attributes:
        file: Below the generated folder.
        first, last: Numbers of its lines, from 1, both included.
        name: What it is called there: a function, a constant, a member; empty for what has no name.
    """

    file: str
    first: int
    last: int
    name: str
    origin: Origin


@dataclass(frozen=True, slots=True)
class Rendered:
    """A file, and where its lines come from; only of C and Python."""

    text: str
    pieces: tuple[Piece, ...] = ()


def mark(name: str, origin: Origin, *, around: bool = False) -> str:
    """A line before those that come from somewhere.

    Args:
        name: What they are called there.
        origin: Where they come from.
        around: Whether what is marked inside is left out; else it is told once more.
    """
    return END + json.dumps([name, origin.sort, origin.name, origin.line, around])


def _mark_of(function: Function) -> str:
    return mark(function.name, function.origin or infrastructure(function.doc))


@cache
def environment() -> jinja2.Environment:
    """Return a strict environment: a template that misspells an attribute fails."""
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("rcsc.code.emit"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701 - the output is C and Python, not HTML
    )
    templates.filters |= {"c": IN_C.lines, "python": IN_PYTHON.lines, "begins": _mark_of}
    templates.globals |= {"begins": mark, "ends": END, "infrastructure": infrastructure}
    return templates


def render(template: str, view: Mapping[str, object], file: str = "") -> Rendered:
    """The template laid out with these values.

    Args:
        template: Its name.
        view: The values.
        file: What it makes, below the generated folder.
    """
    text = environment().get_template(template).render(view)
    if not template.endswith((".c.jinja", ".h.jinja", ".py.jinja")):
        return Rendered(text)
    if template.endswith(".py.jinja"):
        reading, lines = _Reading(file, STATEMENTS, gapless=True, begun=1), text.split("\n")[:-1]
    else:
        first, *others = text.splitlines()  # the first says of which program the file is: it is read again
        lines = [first, *(line for long in others for line in folded(long))]
        reading = _Reading(file, DIRECTIVES)
    for line in lines:
        reading.take(line)
    return Rendered("\n".join([*reading.lines, ""]), tuple(reading.pieces))


@dataclass(slots=True)
class _Open:
    """A mark that did not end yet: its line, what is said of it, the pieces inside."""

    first: int
    said: Sequence[Any]
    inside: list[Piece] = field(default_factory=list)


@dataclass(slots=True)
class _Reading:
    """Takes lines one by one, and keeps where they come from.

    Attributes:
        reasons: What lines outside of marks are for, by how they begin.
        gapless: Whether each piece begins where the one before ended, as comments and blank lines belong to what follows.
        begun: The first line of what is still to be told; 0 where none is.
        comment: Whether a comment outside of marks did not end yet.
    """

    file: str
    reasons: Sequence[tuple[str, str]]
    gapless: bool = False
    lines: list[str] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    marks: list[_Open] = field(default_factory=list)
    begun: int = 0
    comment: bool = False

    def take(self, line: str) -> None:
        """A line of the file, or a mark."""
        word = line.lstrip()
        if word == END:
            self._end()
        elif word.startswith(END):
            self.marks.append(_Open(self.begun or len(self.lines) + 1, json.loads(word.removeprefix(END))))
        else:
            self.lines.append(line)
            if not self.marks:
                self._outside(line, len(self.lines))

    def _end(self) -> None:
        """The pieces of the last mark, those inside after it; they belong to the mark around it, where there is one."""
        mark, last = self.marks.pop(), len(self.lines)
        name, sort, of, line, around = mark.said
        spans = [(mark.first, last)]
        if around and mark.inside:
            spans = [(mark.first, mark.inside[0].first - 1), (mark.inside[-1].last + 1, last)]
        origin = Origin(Sort(sort), of, line)
        own = [Piece(self.file, first, end, name, origin) for first, end in spans]
        (self.marks[-1].inside if self.marks else self.pieces).extend((*own, *mark.inside))
        self.begun = last + 1 if self.gapless else 0

    def _outside(self, line: str, at: int) -> None:
        """A line that no mark is around: a comment, a directive, a frame for C++; nobody knows what another is for."""
        told = self.comment or line.startswith("/*")
        reason = next((reason for begin, reason in self.reasons if line.startswith(begin)), "")
        if told:
            self.begun, self.comment = self.begun or at, not line.endswith("*/")
        elif reason:
            self._told(at, reason)
        elif self.gapless:
            self.begun = self.begun if line.startswith("#") or not line else at + 1
        elif not line and self.begun:
            self._told(at - 1, SAID)

    def _told(self, last: int, reason: str) -> None:
        self.pieces.append(Piece(self.file, self.begun or last, last, "", infrastructure(reason)))
        self.begun = last + 1 if self.gapless else 0


def folded(line: str) -> Iterator[str]:
    """Fold a line of C into lines of at most `WIDTH` columns, as far as it can be broken.

    A comment that follows code stands before it then. Code breaks after an operator or a comma that is least nested, and after
    the sign of an assignment where nothing else is left.

    >>> list(folded("    x = " + " + ".join(["a_quite_long_name"] * 7) + ";"))[1]
    '            a_quite_long_name + a_quite_long_name;'
    """
    if len(line) <= WIDTH or line.startswith("#") or END in line:
        yield line
    elif (parts := COMMENT.fullmatch(line)) is not None:
        yield from _comment(parts["words"], parts["pad"])
        if parts["code"]:
            yield from folded(parts["pad"] + parts["code"])
    else:
        code = line.lstrip()
        yield from _code(code, line.removesuffix(code), STEP * 2)


def _comment(words: str, pad: str) -> Iterator[str]:
    lines = textwrap.wrap(words, WIDTH - len(pad) - 6, break_long_words=False, break_on_hyphens=False)
    for at, text in enumerate(lines):
        end = " */" if at == len(lines) - 1 else ""
        yield f"{pad}{'   ' if at else '/* '}{text}{end}"


def _code(code: str, pad: str, step: str) -> Iterator[str]:
    """Fill lines with the pieces of code; a piece that is too long by itself is broken in turn."""
    pieces = _pieces(code)
    if len(pad) + len(code) > WIDTH and len(pieces) == 1:
        pieces = code.replace(" = ", " =\n", 1).split("\n")
    if len(pad) + len(code) <= WIDTH or len(pieces) == 1:
        yield pad + code
        return
    text, *rest = pieces
    further = pad + step
    for piece in rest:
        if len(pad) + len(text) + 1 + len(piece) <= WIDTH:
            text = f"{text} {piece}"
            continue
        yield from _code(text, pad, STEP)
        pad, text = further, piece
    yield from _code(text, pad, STEP)


def _pieces(code: str) -> list[str]:
    """Break the code wherever it is nested least."""
    depth, ends = 0, dict[int, list[int]]()
    for at, character in enumerate(code):
        depth += (character in "([{") - (character in ")]}")
        if (found := BREAK.match(code, at)) is not None and not (at and BREAK.match(code, at - 1)):
            ends.setdefault(depth, []).append(found.end())
    if not ends:
        return [code]
    cuts = [0, *ends[min(ends)], len(code)]
    return [code[begin:end].strip() for begin, end in pairwise(cuts)]
