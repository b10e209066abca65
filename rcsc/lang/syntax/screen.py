"""What is refused before parsing, and where to go on after an error.

In: a text. Out: diagnostics for a text that no parser should see: too large, too deep, with a NUL, with a character that changes what
a reader sees, or with a name that nobody can read.
"""

import re
import unicodedata

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files.read import UNPRINTED

MOST_CHARACTERS = 16 * 1024 * 1024
DEEPEST = 100
MOST_NAME = 1000

_TOKEN = re.compile(r'#[^\r\n]*|"[^"\\\n]*"|[(\[{)\]}]')
_LONG = re.compile(rf'#[^\r\n]*|"[^"\\\n]*"|(?P<name>(?<![A-Za-z0-9_])[A-Za-z_][A-Za-z0-9_]{{{MOST_NAME},}})')
_DECLARATION = re.compile(
    r"^[ \t]*(?:use|unit|const|enum|type|record|input|state|output|assume|invariant|property|requirement|procedure|module|extern"
    r"|owner|table|link|serves|commands|adopt|level)\b",
    re.MULTILINE,
)


def refuse(source: Source) -> tuple[Diagnostic, ...]:
    """Return a diagnostic where the text must not be parsed."""
    text = source.text
    if len(text) > MOST_CHARACTERS:
        return (_error(Code.TOO_LARGE, f"the file has more than {MOST_CHARACTERS} characters", source, 0, 0),)
    nul = text.find("\0")
    if nul >= 0:
        return (_error(Code.NUL_BYTE, "the text contains a NUL character", source, nul, nul + 1),)
    unprinted = UNPRINTED.search(text)
    if unprinted is not None:
        named = f"U+{ord(unprinted[0]):04X}"
        message = f"the text contains {unicodedata.name(unprinted[0], 'the control character')} ({named}), which a reader does not see"
        return (_error(Code.UNPRINTED, message, source, *unprinted.span()),)
    long = _long_name(text)
    if long is not None:
        message = f"a name has {long[1] - long[0]} characters, more than {MOST_NAME}"
        return (_error(Code.LONG_NAME, message, source, *long),)
    deep = _too_deep(text)
    if deep is not None:
        return (too_deep(source, deep, deep + 1),)
    return ()


def _long_name(text: str) -> tuple[int, int] | None:
    """Return start and end of the first name that is too long; only a line that is too long can have one."""
    if max(map(len, text.split("\n"))) <= MOST_NAME:
        return None
    return next((word.span() for word in _LONG.finditer(text) if word.lastgroup), None)


def _too_deep(text: str) -> int | None:
    """Return the offset at which brackets nest too deep; operators and blocks are counted after parsing."""
    depth = 0
    for match in _TOKEN.finditer(text):
        token = match.group()
        if token in "([{":
            depth += 1
        elif token in ")]}":
            depth = max(0, depth - 1)
        if depth > DEEPEST:
            return match.start()
    return None


def too_deep(source: Source, start: int, end: int) -> Diagnostic:
    """Report that from `start` to `end` expressions, types or blocks nest too deep."""
    return _error(Code.TOO_DEEP, f"expressions and blocks nest more than {DEEPEST} deep", source, start, end)


def blank_before(text: str, offset: int) -> str:
    """Return the text with everything before `offset` made blank, so that offsets stay true."""
    return text if not offset else re.sub(r"[^\n]", " ", text[:offset]) + text[offset:]


def next_declaration(text: str, after: int, begun: int) -> int:
    """Find the next declaration after an error; the length of the text if there is none."""
    match = _DECLARATION.search(text, max(after, begun) + 1)
    return match.start() if match else len(text)


def shortened(word: str) -> str:
    """Return `word`, cut where it is long, with control characters made visible."""
    shown = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in word)
    return shown if len(shown) <= 40 else shown[:37] + "..."


def _error(code: Code, message: str, source: Source, start: int, end: int) -> Diagnostic:
    return Diagnostic(code, message, Label(Span(source.name, start, end)))
