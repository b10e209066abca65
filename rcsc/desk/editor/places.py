"""Lines and columns of a text, as editors count them.

In: a text. Out: places, both numbers from 0, and offsets back. A line ends at a line feed, a carriage return, or both together, and nowhere
else. Columns count characters, or units of UTF-16 or UTF-8 where an editor does.
"""

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

_END = re.compile(r"\r\n|\n|\r")


class Units(StrEnum):
    """The unit of columns; the words are those of the protocol."""

    CHARACTERS = "utf-32"
    UTF_16 = "utf-16"
    UTF_8 = "utf-8"

    def of(self, text: str) -> int:
        r"""Return the length of a text in units.

        >>> [units.of("aé\U0001f916") for units in Units]
        [3, 4, 7]
        """
        if text.isascii() or self is Units.CHARACTERS:
            return len(text)
        if self is Units.UTF_16:
            return len(text) + sum(character > "\uffff" for character in text)
        return len(text.encode("utf-8", "surrogatepass"))


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """A place between two characters.

    Attributes:
        line: From 0.
        column: From 0, in characters unless another unit was asked for.
    """

    line: int
    column: int

    def __str__(self) -> str:
        """Return line and column as people count them: both from 1."""
        return f"{self.line + 1}:{self.column + 1}"


@dataclass(frozen=True, slots=True, order=True)
class Area:
    """The text between two places of a file."""

    file: str
    start: Place
    end: Place


@dataclass(frozen=True, slots=True)
class Edit:
    """A part of a file that becomes another text; edits made together are of one text, and do not overlap."""

    area: Area
    text: str


@dataclass(frozen=True, slots=True)
class Lines:
    """A text by its lines."""

    text: str
    starts: Sequence[int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "starts", (0, *(end.end() for end in _END.finditer(self.text))))

    def line(self, number: int) -> str:
        """Return the text of a line without its end; empty past the last."""
        if not 0 <= number < len(self.starts):
            return ""
        past = self.starts[number + 1] if number + 1 < len(self.starts) else len(self.text)
        return self.text[self.starts[number] : past].rstrip("\r\n")

    def place(self, offset: int, units: Units = Units.CHARACTERS) -> Place:
        """Return the place before the character at an offset; the end of the text for an offset past it."""
        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self.starts, offset) - 1
        return Place(line, units.of(self.text[self.starts[line] : offset]))

    def offset(self, place: Place, units: Units = Units.CHARACTERS) -> int:
        r"""Return the offset of a place; for a place past the end of its line, that end, as editors do.

        >>> lines = Lines("on\r\n\U0001f916x\n")
        >>> [lines.offset(Place(*place), Units.UTF_16) for place in ((0, 9), (1, 2), (1, 3), (7, 0))]
        [2, 5, 6, 7]
        """
        if place.line >= len(self.starts):
            return len(self.text)
        line = self.line(place.line)
        return self.starts[max(0, place.line)] + _characters(line, place.column, units)

    def area(self, file: str, start: int, end: int) -> Area:
        """Return the area between two offsets."""
        return Area(file, self.place(start), self.place(end))

    def shifted(self, place: Place, units: Units) -> Place:
        """Convert a place from characters to other units."""
        return Place(place.line, units.of(self.line(place.line)[: place.column]))

    def applied(self, edits: Sequence[Edit]) -> str:
        """Return the text with these edits made; their areas are those of the present text."""
        text = self.text
        for edit in sorted(edits, key=lambda each: (each.area.start, each.area.end), reverse=True):
            text = text[: self.offset(edit.area.start)] + edit.text + text[self.offset(edit.area.end) :]
        return text


def _characters(line: str, column: int, units: Units) -> int:
    """Count the characters of a line before a column; a column within a character is before it."""
    if units is Units.CHARACTERS or line.isascii():
        return max(0, min(column, len(line)))
    count = 0
    for at, character in enumerate(line):
        count += units.of(character)
        if count > column:
            return at
    return len(line)


def difference(file: str, before: Lines, after: str) -> tuple[Edit, ...]:
    """Return the edits that turn one text into another, and leave equal lines alone.

    Only lines are compared, from both ends first: tables have thousands of them, of which few change.
    """
    from difflib import SequenceMatcher

    old, new = before.text.splitlines(keepends=True), after.splitlines(keepends=True)
    if len(old) != len(before.starts) - (not before.text or before.text[-1] in "\r\n"):
        return () if before.text == after else (Edit(before.area(file, 0, len(before.text)), after),)
    offsets = [0]
    for line in old:
        offsets.append(offsets[-1] + len(line))
    matcher = SequenceMatcher(None, old, new, autojunk=False)
    return tuple(
        Edit(before.area(file, offsets[first], offsets[past]), "".join(new[start:end]))
        for word, first, past, start, end in matcher.get_opcodes()
        if word != "equal"
    )
