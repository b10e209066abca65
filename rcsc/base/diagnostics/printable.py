"""User text made safe and measurable for a terminal, a log or a web page.

A table comes from anywhere: a right-to-left override or an escape sequence in a comment must not
change what a reader sees (CVE-2021-42574). Every character that does not print is spelled out.
"""

import unicodedata

TAB_WIDTH = 4


def escape(text: str) -> str:
    r"""Return `text` on one line with every unprintable character spelled, as `\u{202e}`."""
    if text.isprintable():
        return text
    return "".join(_spelled(char) for char in text)


def _spelled(char: str) -> str:
    if char.isprintable():
        return char
    if char == "\t":
        return " " * TAB_WIDTH
    return f"\\u{{{ord(char):x}}}"


def width(text: str) -> int:
    """Count the terminal cells that `text`, already escaped, takes."""
    if text.isascii():
        return len(text)
    return sum(_cells(char) for char in text)


def _cells(char: str) -> int:
    if unicodedata.combining(char) or unicodedata.category(char) in {"Mn", "Me"}:
        return 0
    return 2 if unicodedata.east_asian_width(char) in {"W", "F"} else 1


def pad(text: str, cells: int) -> str:
    """Return `text` followed by as many spaces as make it `cells` wide."""
    return text + " " * max(0, cells - width(text))


def clip(text: str, start: int, cells: int) -> str:
    """Cut `text` to the `cells` terminal cells from cell `start` on."""
    if text.isascii():
        return text[start : start + cells]
    kept, at = [], 0
    for char in text:
        wide = _cells(char)
        if at >= start and at + wide <= start + cells:
            kept.append(char)
        elif at < start < at + wide:
            kept.append(" ")  # half of a wide character
        at += wide
    return "".join(kept)
