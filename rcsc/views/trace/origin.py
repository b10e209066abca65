"""What a piece of generated code is made of: a line of a table, a procedure, a declaration, or nothing of the user's."""

from dataclasses import dataclass
from enum import StrEnum


class Sort(StrEnum):
    """What an origin is."""

    LINE = "line"
    TABLE = "table"
    PROCEDURE = "procedure"
    ASSUMPTION = "assumption"
    INVARIANT = "invariant"
    VARIABLE = "variable"
    TYPE = "type"
    LEVEL = "level"
    SYSTEM = "system"
    PROGRAM = "program"  # all variables of a program: their initial values, their ranges
    INFRASTRUCTURE = "infrastructure"


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a piece of generated code comes from.

    Attributes:
        name: Of a line or a table the table; of infrastructure its reason; else the declaration.
        line: The line's name; empty for all else.
    """

    sort: Sort
    name: str
    line: str = ""

    @property
    def words(self) -> str:
        """The origin as a person says it.

        >>> Origin(Sort.LINE, "acquire", "3").words, Origin(Sort.PROCEDURE, "look").words
        ('acquire line 3', 'procedure look')
        """
        if self.sort is Sort.LINE:
            return f"{self.name} line {self.line}"
        return f"{self.sort} {self.name}" if self.sort is not Sort.INFRASTRUCTURE else self.name


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


def infrastructure(reason: str) -> Origin:
    """Give the origin of what serves no line, with the reason why it is there."""
    return Origin(Sort.INFRASTRUCTURE, reason)
