"""The shape of the executors, in no language: what `lower` makes and `emit` spells.

A matcher is a conjunction of look-ups: each *probe* finds the class of one leaf (or the truth of one test, or both of
several leaves together), and the class's mask has a bit for each line that it does not exclude.
"""

from bisect import bisect_left
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import prod
from typing import TypeAlias

from rcsc.base.host.files.write import UNPROVED
from rcsc.lang.model import Action, Expr, LineName, Procedure, Program, Scalar, Table, TableName, VariableName

WORD = 64


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


def infrastructure(reason: str) -> Origin:
    """Give the origin of what serves no line, with the reason why it is there."""
    return Origin(Sort.INFRASTRUCTURE, reason)


@dataclass(frozen=True, slots=True)
class Direct:
    """The class of a leaf is its key less `low`; one class a key."""

    leaf: VariableName
    type: Scalar
    low: int
    count: int


@dataclass(frozen=True, slots=True)
class Cuts:
    """The class of a leaf is how many of `cuts` (values, ascending) are at most its value."""

    leaf: VariableName
    type: Scalar
    cuts: tuple[int | float, ...]

    @property
    def count(self) -> int:
        """The number of classes."""
        return len(self.cuts) + 1


@dataclass(frozen=True, slots=True)
class Coded:
    """The class of a leaf is looked up by its key less `low`."""

    leaf: VariableName
    type: Scalar
    low: int
    classes: tuple[int, ...]

    @property
    def count(self) -> int:
        """The number of classes."""
        return max(self.classes) + 1


@dataclass(frozen=True, slots=True)
class Truth:
    """The class is 1 where the condition holds, else 0."""

    condition: Expr
    text: str
    count: int = 2


Index: TypeAlias = Direct | Coded | Cuts | Truth


def first_value(index: Direct | Coded | Cuts, number: int) -> int | float:
    """Return the least value of a leaf whose class is at least `number`, which is not 0; the least key, where it is no real."""
    match index:
        case Cuts(cuts=cuts):
            return cuts[number - 1]
        case Coded(low=low, classes=classes):
            return low + bisect_left(classes, number)
        case Direct(low=low):
            return low + number


@dataclass(frozen=True, slots=True)
class Probe:
    """A class, and the lines that it leaves.

    Attributes:
        masks: For each class a mask: bit k is set where line k does not exclude it.
    """

    index: Index
    masks: tuple[int, ...]


Group: TypeAlias = tuple[Probe, ...]
"""Probes that share a table: their classes are taken together, in mixed radix, the last one fastest."""


@dataclass(frozen=True, slots=True)
class Matcher:
    """The matcher of one table.

    Attributes:
        lines: How many lines, DEFAULT left out.
        default: Whether there is a DEFAULT line: it is taken where no other matches.
    """

    lines: int
    default: bool
    groups: tuple[Group, ...]

    @property
    def words(self) -> int:
        """Machine words of 64 lines in a mask."""
        return (self.lines + WORD - 1) // WORD


def joined(group: Group) -> tuple[int, ...]:
    """Return the masks of a group: one for each combination of classes."""
    masks = group[0].masks
    for probe in group[1:]:
        masks = tuple(mask & two for mask in masks for two in probe.masks)
    return masks


def grouped(probes: Iterable[Probe], most: int, *, shifted: bool = False) -> tuple[Group, ...]:
    """Join probes while their classes together are at most `most`: fewer masks to load, larger tables.

    Args:
        probes: One for each leaf or test.
        most: Combinations of classes in a group; a probe with more stands alone.
        shifted: Whether the classes of all but the first of a group must be a power of two, so that an index is shifted, never
            multiplied.
    """
    bins: list[list[Probe]] = []
    for probe in sorted(probes, key=lambda probe: -len(probe.masks)):
        joins = not shifted or len(probe.masks).bit_count() == 1
        for group in bins if joins else ():
            if prod(len(other.masks) for other in group) * len(probe.masks) <= most:
                group.append(probe)
                break
        else:
            bins.append([probe])
    return tuple(tuple(group) for group in bins)


def table_position(program: Program, table: str) -> int:
    """Return the position of a table, by which a fault names one before the last of a cycle."""
    return [candidate.name for candidate in program.tables].index(TableName(table))


@dataclass(frozen=True, slots=True)
class PlanLine:
    """A line and its actions, for DEFAULT too.

    Attributes:
        source: The file, and the line's name; its table's, too, where the file has several.
        conditions: Its conditions, heading by heading.
        requirements: Names of those that it answers.
    """

    name: LineName
    actions: tuple[Action, ...]
    source: str
    conditions: tuple[str, ...] = ()
    requirements: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """Its file, its name and its requirements: `task/release.rcs line 4 [SR-12]`."""
        return f"{self.source}{answering(self.requirements)}"

    @property
    def told(self) -> str:
        """Its place and its conditions, in words."""
        return f"{self.place}: {'; '.join(self.conditions)}" if self.conditions else self.place


def answering(requirements: Iterable[str]) -> str:
    """Spell names of requirements, in brackets after a blank; "" for none."""
    names = ", ".join(requirements)
    return f" [{names}]" if names else ""


def stated(procedure: Procedure, files: Mapping[str, str]) -> str:
    """Describe a procedure: its file, name, requirements and doc; the protocol's own have no file.

    Args:
        procedure: The procedure.
        files: `Plan.files`.
    """
    words = f"{files.get(procedure.span.file, '')} procedure {procedure.name}{answering(procedure.requirements)}".lstrip()
    return f"{words}: {procedure.doc}" if procedure.doc else words


@dataclass(frozen=True, slots=True)
class PlanTable:
    """A table to be emitted.

    Attributes:
        source: Its file, relative, and its name where the file has several.
        monitored: Positions in `Plan.monitored` of the assumptions that it checks.
        stops: Those of them that end the cycle where they fail.
    """

    table: Table
    source: str
    matcher: Matcher
    lines: tuple[PlanLine, ...]
    monitored: tuple[int, ...]
    stops: tuple[int, ...] = ()

    @property
    def origin(self) -> Origin:
        """Where code of the whole table comes from."""
        return Origin(Sort.TABLE, self.table.name)

    @property
    def where(self) -> str:
        """The assumptions that must hold where the table is matched by itself, in words; empty for none."""
        names = " and ".join(self.table.stops)
        return f" where {names} {'holds' if len(self.stops) == 1 else 'hold'}" if names else ""


@dataclass(frozen=True, slots=True)
class Plan:
    """A program, ready to be spelled.

    Attributes:
        source: The root file, relative, with `/`.
        monitored: Positions in `program.assumptions` of those that the executors check: monitored ones, and those that stop some table.
        places: For each file that declares a type, its place in the project, relative, with `/` and without its ending.
        files: For each file that declares a procedure or an assumption, its name, relative, with `/`.
        prefix: The prefix of file names and C names.
        proved: Whether it is proved; otherwise every file is marked (`UNPROVED`).
        defensive: Whether every cycle begins with a check of the state.
    """

    program: Program
    source: str
    tables: tuple[PlanTable, ...]
    monitored: tuple[int, ...]
    proved: bool = True
    defensive: bool = False
    places: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    prefix: str = ""

    @property
    def checked(self) -> tuple[str, ...]:
        """The effect of each checked assumption where it fails, in words: `seen: ends the cycle in tally; told in count`."""
        return tuple(self._checked(place, at) for place, at in enumerate(self.monitored))

    def _checked(self, place: int, at: int) -> str:
        stops = [table.table.name for table in self.tables if place in table.stops]
        told = [
            table.table.name for table in self.tables if place in table.monitored and place not in table.stops
        ]
        parts = [(f"ends the cycle in {', '.join(stops)}", stops), (f"only told in {', '.join(told)}", told)]
        does = "; ".join(words for words, tables in parts if tables) or "no table relies on it"
        return f"{self.program.assumptions[at].name}: {does}"

    @property
    def mark(self) -> str:
        """The mark of code that is not proved; empty for proved code."""
        return "" if self.proved else UNPROVED
