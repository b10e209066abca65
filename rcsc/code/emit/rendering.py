"""The templates, and C in lines of at most 110 columns; the only importer of Jinja2."""

import re
import textwrap
from collections.abc import Iterator, Mapping
from functools import cache
from itertools import pairwise

import jinja2

from rcsc.code.emit.code_tree import IN_C, IN_PYTHON

WIDTH = 110
STEP = "    "
COMMENT = re.compile(r"(?P<pad> *)(?P<code>.*?) ?/\* (?P<words>.*) \*/")
BREAK = re.compile(r"(?:&&|\|\||[<>!=]=|[<>?:&|+,]) ")
"""What a line of C may end with."""


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
    templates.filters |= {"c": IN_C.lines, "python": IN_PYTHON.lines}
    return templates


def render(template: str, view: Mapping[str, object]) -> str:
    """Lay out the template with these values."""
    text = environment().get_template(template).render(view)
    if not template.endswith((".c.jinja", ".h.jinja")):
        return text
    first, *others = text.splitlines()  # the first says of which program the file is: it is read again
    return "\n".join([first, *(line for long in others for line in folded(long)), ""])


def folded(line: str) -> Iterator[str]:
    """Fold a line of C into lines of at most `WIDTH` columns, as far as it can be broken.

    A comment that follows code stands before it then. Code breaks after an operator or a comma that is least nested, and after
    the sign of an assignment where nothing else is left.

    >>> list(folded("    x = " + " + ".join(["a_quite_long_name"] * 7) + ";"))[1]
    '            a_quite_long_name;'
    """
    if len(line) <= WIDTH or line.startswith("#"):
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
