"""The parts of an emitted C matcher that works in windows, read from its text; `matcher_text` reads the others.

In: the emitted C and the name of a `line` function. Out: its parts, verbatim, for a self-test to compile. A text that is not
of this shape is refused: the check claims nothing about it.

The shape: all tables as one object `t`, with the lines of every window in `t.order`; questions `w0`, `w1`, .. and `w` last, each
`ASKED ? THIS : THAT` of one leaf and a constant, which lead to a number or to an earlier question; the mask `m`, which joins with `&` one
word of each group, found by an INDEX and by `w` alone; then a tail that reads nothing but `m`, `w` and `t.order`.
"""

import re
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.code.testing.matchers.matcher_text import (
    Component,
    Lookup,
    ShapeError,
    closing,
    component,
    function_body,
    matching,
    parted,
    without_comments,
)

TABLES = re.compile(
    r"static const struct \{\n(?P<fields>(?: +uint\d+_t \w+(?:\[\d+\])+;\n)+)    \} t = \{.*?\n    \};\n",
    re.DOTALL,
)
FIELD = re.compile(r"uint\d+_t (\w+?)((?:\[\d+\])+);")
QUESTION = re.compile(r"const uint32_t (w\d*) = (.+) \? (w\d+|\d+u) : (w\d+|\d+u)")
INDEX = re.compile(r"\bt\.(?:t\d+|k\d+\[w / \d+u\])\[")
FOUND = (
    re.compile(r"t\.t(?P<table>\d+)\[at\]\[w\]"),
    re.compile(
        r"t\.words\[\(uint32_t\)t\.first\[w\]\[(?P<table>\d+)u\] \+ "
        r"\(uint32_t\)t\.c(?P=table)\[w\]\[t\.k(?P=table)\[w / \d+u\]\[at\]\]\]"
    ),
)


@dataclass(frozen=True, slots=True)
class Question:
    """A question.

    Attributes:
        asked: Of one leaf; its class is 1 where it holds, else 0.
        above: Where it leads if it holds, `below` if not: to a question or to a window.
    """

    asked: Component
    above: "Place"
    below: "Place"


Place: TypeAlias = Question | int


@dataclass(frozen=True, slots=True)
class WindowText:
    """A matcher's parts.

    Attributes:
        declaration: All tables, verbatim.
        statements: The questions, verbatim, in which `w` is found.
        windows: How many there are.
        found: For each look-up its word, verbatim, by `w` and `at` instead of its index.
        tail: What follows the mask, verbatim.
    """

    declaration: str
    statements: str
    first: Place
    windows: int
    lookups: tuple[Lookup, ...]
    found: tuple[str, ...]
    tail: str


def _body(source: str, function: str, struct: str) -> str:
    return function_body(
        source, f"static RCSC_INLINE int32_t {matching(source, function)}(const {struct} *s)"
    )


def has_windows(source: str, function: str, struct: str) -> bool:
    """Whether the matcher called `function` works in windows; a text of no known shape does not."""
    try:
        return "t.order[w]" in _body(without_comments(source), function, struct)
    except ShapeError:
        return False


def window_text(source: str, function: str, struct: str) -> WindowText:
    """The parts of the matcher called `function`.

    Raises:
        ShapeError: The text has another shape.
    """
    source = without_comments(source)
    body = _body(source, function, struct)
    stated = TABLES.search(body)
    if stated is None or body[: stated.start()].strip() not in ("", "RCSC_CONST_SECTION"):
        raise ShapeError("no tables")
    sizes = {
        name: [int(size) for size in re.findall(r"\d+", all_)]
        for name, all_ in FIELD.findall(stated["fields"])
    }
    rest = re.sub(r"(?<=[&|?:+,<>=])\n +", " ", body[stated.end() :])  # a line that was broken
    statements, joined, after = rest.partition("    const uint64_t m = ")
    expression, end, tail = after.partition(";\n")
    if not joined or not end or re.search(r"s->|\bt\.(?!order\[w\])", tail):
        raise ShapeError("the tail reads more than the mask, or there is none")
    windows = sizes["order"][0]
    terms = _terms(expression)
    numbers = [_found(source, stated[0], term, sizes, at) for at, term in enumerate(terms)]
    return WindowText(
        stated[0],
        statements,
        _questions(source, statements, windows),
        windows,
        tuple(lookup for lookup, _ in numbers),
        tuple(found for _, found in numbers),
        tail,
    )


def _questions(source: str, statements: str, windows: int) -> Place:
    """The last question, which every other one is part of, once."""
    known: dict[str, Question] = {}

    def place(text: str) -> Place:
        if text not in known and not text.endswith("u"):
            raise ShapeError(f"`{text}` is no question, or leads to where another does")
        number = known.pop(text, None) or int(text.removesuffix("u"))
        if isinstance(number, int) and number >= windows:
            raise ShapeError(f"no window {number}")
        return number

    for text in filter(None, map(str.strip, statements.split(";\n"))):
        read = QUESTION.fullmatch(text)
        if read is None or read[1] in known:
            raise ShapeError(f"`{text}` is no question")
        asked = component(source, f"{read[2]} ? 1u : 0u", 2)
        if not asked.path:
            raise ShapeError(f"`{text}` asks for more than one leaf")
        known[read[1]] = Question(asked, place(read[3]), place(read[4]))
    if set(known) != {"w"}:
        raise ShapeError("the questions do not lead to one window")
    return known["w"]


def _terms(expression: str) -> list[str]:
    """What is joined with `&`."""
    terms, start, depth = [], 0, 0
    for at, letter in enumerate(expression):
        depth += (letter in "([") - (letter in ")]")
        if letter == "&" and depth == 0:
            terms.append(expression[start:at].strip())
            start = at + 1
    return [*terms, expression[start:].strip()]


def _found(
    source: str, declaration: str, term: str, sizes: dict[str, list[int]], number: int
) -> tuple[Lookup, str]:
    """One look-up, and its word without its index."""
    begin = INDEX.search(term)
    if begin is None:
        raise ShapeError(f"no look-up in `{term}`")
    end = closing(term, begin.end() - 1, "[]")
    index, word = term[begin.end() : end], f"{term[: begin.end()]}at{term[end:]}"
    shapes = [shape.fullmatch(word) for shape in FOUND]
    if not any(shape is not None and int(shape["table"]) == number for shape in shapes):
        raise ShapeError(f"`{term}` is no word of table {number}")
    entries = sizes[f"t{number}"][0] if shapes[0] else sizes[f"k{number}"][1]
    components = tuple(component(source, text, count) for text, count in parted(index))
    return Lookup(declaration, index, entries, 1, components), word
