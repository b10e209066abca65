"""Cuts table rows into cells; which cells there are and where, not what they say.

In: the text of one row and its offset. Out: `Cells`, or what is wrong with it.
"""

import re
from dataclasses import dataclass

ACTION_WORDS = frozenset({"procedures", "command_out", "status_out"})
SEPARATOR = re.compile(r"\|[\s|:-]*-[\s|:-]*$")
NAME = re.compile(r"[A-Za-z0-9_]+$")
CALL = re.compile(r"(?!(?:abs|min|max|int|real|not)\b)[A-Za-z_][A-Za-z0-9_]*\s*\(|[^=]*:=")
"""What looks like a call or an assignment, and stands perhaps where a value should."""
CALL_UNDER = "a call or an assignment stands under `procedures`, `command_out` or `status_out`"
EMPTY_CELL = "an empty cell is `| |`, with a blank; `||` stands once in a row, between conditions and actions"
"""What helps where cells of a row are missing, or stand on the wrong side."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The trimmed text of a cell and the offset of its first character in the file."""

    text: str
    start: int

    @property
    def end(self) -> int:
        """The offset past its last character."""
        return self.start + len(self.text)


@dataclass(frozen=True, slots=True)
class Cells:
    """A row: conditions before the `||` (the line's name first), actions after it."""

    conditions: tuple[Cell, ...]
    actions: tuple[Cell, ...]


def is_separator(row: str) -> bool:
    """Whether the row is only `|---|---|`."""
    return SEPARATOR.match(row) is not None


def cut(row: str, start: int) -> Cells | str:
    """The cells of `row`, which begins at `start`; a message where `||` does not divide it once."""
    row = row.partition("#")[0].rstrip()
    left, bar, right = row.partition("||")
    if not bar:
        return "a row needs `||` between its conditions and its actions"
    if "||" in right:
        return f"a row has exactly one `||`, this one has {row.count('||')}"
    return Cells(_cells(left, start, 1), _cells(right, start + len(left) + 2, 0))


def _cells(part: str, start: int, skip: int) -> tuple[Cell, ...]:
    """The cells of one side; `skip` leading bars; a bar at the end closes the last cell."""
    offset = start + skip
    body = part[skip:]
    if body.endswith("|"):
        body = body[:-1]
    elif not body.strip() and not skip:
        return ()
    cells = []
    for piece in body.split("|"):
        text = piece.strip()
        lead = len(piece) - len(piece.lstrip()) if text else 0
        cells.append(Cell(text, offset + lead))
        offset += len(piece) + 1
    return tuple(cells)
