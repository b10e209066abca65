"""The verdict on one table: findings as data, and what they rest on.

Keys are those of `rcsc.lang.model`: order-preserving integers for every kind of value.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.lang.model import AssumptionName, Backing, Box, Snapshot, Table

Witness: TypeAlias = Snapshot
"""A value for every test variable of the table."""

Region: TypeAlias = Mapping[str, Box]
"""Keys that some variables, or parts of words (`regions.word_bits`), may have; the others are free."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two lines (by position) that match the same input; `region` is where both do, all over it."""

    first: int
    second: int
    witness: Witness
    region: Region | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """Inputs that no line matches.

    Attributes:
        witnesses: The least one, and the least outside the regions already shown.
        regions: Around each a region that no line matches.
        count: How many inputs there are, and of how many that the assumptions allow; None where they were not counted.
        patterns: The same of the bits that some line looks at, where there are others.
        sizes: How many inputs each region has, where assumptions allow not all of its values.
    """

    witnesses: tuple[Witness, ...]
    regions: tuple[Region | None, ...]
    count: tuple[int, int] | None = None
    patterns: tuple[int, int] | None = None
    sizes: tuple[int | None, ...] = ()


@dataclass(frozen=True, slots=True)
class DeadLine:
    """A line that no input matches.

    Attributes:
        assuming: Whether that rests on an assumption: where it fails the line may match, so that it is no mistake to write it.
    """

    line: int
    assuming: bool = False


@dataclass(frozen=True, slots=True)
class ContradictoryAssumptions:
    """No input satisfies the assumptions, so that anything could be proved of the table."""


@dataclass(frozen=True, slots=True)
class Undecided:
    """The question stayed open: a time-out, exhausted memory, or a question beyond the solver."""

    what: str


@dataclass(frozen=True, slots=True)
class SolversDisagree:
    """Z3 disagrees with the verdict: a bug in rcsc."""

    what: str


TableFinding: TypeAlias = Overlap | Gap | DeadLine | ContradictoryAssumptions | Undecided | SolversDisagree


@dataclass(frozen=True, slots=True)
class Decided:
    """What one way of deciding says of a table.

    Attributes:
        used: The assumptions that the proof needs; all of them where there is none.
        certificate: Of a table in order, where this way makes one.
        by_solver: Whether Z3 answered a part of it.
    """

    findings: tuple[TableFinding, ...]
    used: tuple[AssumptionName, ...]
    certificate: Mapping[str, object] | None = None
    by_solver: bool = False


@dataclass(frozen=True, slots=True)
class TableVerdict:
    """The verdict on one table.

    Attributes:
        findings: The findings; a gap too where a DEFAULT line takes it (the report tells them apart).
        backing: The method and the assumptions that it rests on.
        certificate: For `rcsc certify`; None where there is nothing to certify.
        seconds: How long it took.
    """

    table: Table
    findings: tuple[TableFinding, ...]
    backing: Backing
    certificate: Mapping[str, object] | None
    seconds: float

    @property
    def undecided(self) -> bool:
        """Whether something was left open."""
        return any(isinstance(finding, Undecided) for finding in self.findings)

    @property
    def refuted(self) -> bool:
        """Whether something is wrong, whatever was left open."""
        return refutes(self.table, self.findings)


def refutes(table: Table, findings: Iterable[TableFinding]) -> bool:
    """Return whether something is wrong. A gap that DEFAULT takes, a line that an assumption excludes and an open question do not count."""
    falls = table.default is not None and not table.default.unreachable
    return any(
        not (isinstance(finding, Gap) and falls)
        and not (isinstance(finding, DeadLine) and finding.assuming)
        and not isinstance(finding, Undecided | SolversDisagree)
        for finding in findings
    )


def settles(table: Table, findings: Collection[TableFinding]) -> bool:
    """Return whether more steps could not change the verdict: nothing is left open, or something is wrong."""
    return not any(isinstance(each, Undecided) for each in findings) or refutes(table, findings)
