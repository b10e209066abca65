"""What may be the name of a thing in C and Python, of a file, and of a place in a folder.

In: texts from descriptions, symbol files, logs and journals. Out: the same texts, or `BadName`. A text that has not passed through here
becomes neither part of a path nor part of a program.
"""

import os
import re
from pathlib import Path

MOST_CHARACTERS = 4096
"""Of a name; those of files may be shorter still."""
MOST_FILE_CHARACTERS = 200
"""File systems allow 255 bytes with an ending."""

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_LINE = re.compile(r"[A-Za-z0-9_]+")
_MEMBER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*|\[[0-9]{1,9}\])*")
_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


class BadName(ValueError):  # noqa: N818  # what happened, not an error of ours
    """A text is not what it must be; the message says what it was to name."""


def identifier(text: object, what: str = "name") -> str:
    """Return the text if C and Python can call a thing so.

    Raises:
        BadName: They cannot.
    """
    return _matched(_IDENTIFIER, text, what, "letters, digits and `_`, no digit first")


def line_name(text: object, what: str = "line") -> str:
    """Return the text if a line of a table can be called so.

    Raises:
        BadName: None can.
    """
    return _matched(_LINE, text, what, "letters, digits and `_`")


def member(text: object, what: str = "leaf") -> str:
    """Return the text if it is a place in a struct: `robot.plate[1]`.

    Raises:
        BadName: It is none.
    """
    return _matched(_MEMBER, text, what, "names joined by `.`, with numbers in `[]`")


def is_member(text: object) -> bool:
    """Return whether `member` lets a text pass."""
    return isinstance(text, str) and len(text) <= MOST_CHARACTERS and _MEMBER.fullmatch(text) is not None


def is_identifier(text: object) -> bool:
    """Return whether `identifier` lets a text pass."""
    return isinstance(text, str) and len(text) <= MOST_CHARACTERS and _IDENTIFIER.fullmatch(text) is not None


def is_file_name(text: object) -> bool:
    """Return whether `file_name` lets a text pass."""
    return isinstance(text, str) and len(text) <= MOST_FILE_CHARACTERS and _FILE.fullmatch(text) is not None


def file_name(text: object, what: str = "name") -> str:
    """Return the text if a file can be called so: one name, which leads nowhere else.

    Raises:
        BadName: None can.
    """
    if isinstance(text, str) and len(text) > MOST_FILE_CHARACTERS:
        raise BadName(f"{shown(text)} is no {what}: it has more than {MOST_FILE_CHARACTERS} characters")
    return _matched(_FILE, text, what, "letters, digits, `_`, `-` and `.`, no `.` or `-` first")


def _matched(pattern: re.Pattern[str], text: object, what: str, allowed: str) -> str:
    if not isinstance(text, str) or len(text) > MOST_CHARACTERS or pattern.fullmatch(text) is None:
        raise BadName(f"{shown(text)} is no {what}: {allowed}")
    return text


def shown(value: object) -> str:
    """Return a value from outside, cut short and without characters that do not print, for a message."""
    from rcsc.base.diagnostics.printable import escape

    text = value if isinstance(value, str) else type(value).__name__
    return f"`{escape(text[:80])}{'...' if len(text) > 80 else ''}`"


def inside(folder: Path, *parts: str) -> Path:
    """Return the place of a file in a trusted folder.

    Args:
        folder: The trusted folder.
        parts: Names of folders in it and, last, of the file.

    Raises:
        BadName: A part is no name of a file, or a link leads out of the folder.
    """
    path = folder.joinpath(*(file_name(part, "file name") for part in parts))
    if not _is_within(path, folder):
        raise BadName(f"`{path}` leads out of `{folder}`")
    return path


def within(root: Path, base: Path, text: object, what: str = "path") -> Path:
    """Return a relative path of a description, resolved: inside its project, or in the folder `generated` beside the project.

    Args:
        root: The project's folder.
        base: What the path is relative to.
        text: The path.
        what: What it is called in the message.

    Raises:
        BadName: It is absolute, or leads elsewhere.
    """
    if not isinstance(text, str) or not text.isprintable() or len(text) > MOST_CHARACTERS:
        raise BadName(f"{shown(text)} is no {what}")
    if os.path.isabs(text):
        raise BadName(f"the {what} {shown(text)} is absolute: write it relative to the description")
    resolved = (base / text).resolve()
    if not _is_within(resolved, root) and resolved != root.resolve().parent / "generated":
        raise BadName(f"the {what} {shown(text)} leads out of the project `{root}`")
    return resolved


def _is_within(path: Path, folder: Path) -> bool:
    return os.path.realpath(path) == os.path.realpath(folder) or Path(os.path.realpath(path)).is_relative_to(
        os.path.realpath(folder)
    )
