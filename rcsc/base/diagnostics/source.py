"""Named source texts and spans in them.

In: the text of a file. Out: spans (character offsets) and, here alone, lines and columns.
"""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """A half-open range of characters of one file.

    Attributes:
        file: Name of the file as the user gave it.
        start: Offset of the first character.
        end: Offset past the last character.
    """

    file: str
    start: int
    end: int

    def to(self, other: "Span") -> "Span":
        """Return the span from the start of this one to the end of `other`."""
        return Span(self.file, self.start, max(self.end, other.end))


@dataclass(frozen=True, slots=True)
class Position:
    """A place for people: both numbers start at 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class Source:
    """One text and its name."""

    name: str
    text: str
    _starts: tuple[int, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        *ended, _ = self.text.split("\n")
        starts = accumulate((len(line) + 1 for line in ended), initial=0)
        object.__setattr__(self, "_starts", tuple(starts))

    def position(self, offset: int) -> Position:
        """Return the line and column of the character at `offset`."""
        line = bisect_right(self._starts, offset) - 1
        return Position(line + 1, offset - self._starts[line] + 1)

    def line(self, number: int) -> str:
        """Return the text of line `number` (from 1) without its end; "" past the last line."""
        if not 1 <= number <= len(self._starts):
            return ""
        start = self._starts[number - 1]
        end = self._starts[number] - 1 if number < len(self._starts) else len(self.text)
        return self.text[start:end].rstrip("\r")

    def slice(self, span: Span) -> str:
        """Return the text that `span` covers."""
        return self.text[span.start : span.end]


Sources = Mapping[str, Source]
"""Every text that a diagnostic may point into, by name."""
