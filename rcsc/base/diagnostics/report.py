"""What a command found and what backs it: the one value that every output form shows."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.base.diagnostics.source import Source


class Verdict(StrEnum):
    """The verdict on a table, best first; anything but `proved` makes `rcsc` exit with 1."""

    PROVED = "proved"
    CONDITIONAL = "conditional"  # proved from something that is not proved itself
    UNDECIDED = "undecided"
    REFUTED = "refuted"


NOT_PROVED = "not proved"
"""The standing of an invariant, or of an assumption declared `proved`, that this run does not prove."""


@dataclass(frozen=True, slots=True)
class InSystem:
    """The results about a table from the proof of the levels together.

    Attributes:
        system: The system's description.
        proved: Assumptions that the levels keep, all of this content; `trusts`, what that and `unreached` take for granted,
            as tables declare it.
        conditional: Assumptions that they keep if what that rests on is so; `rests`, what of it is not proved, in words.
        not_proved: Assumptions that an earlier run could not show to be kept.
        unreached: Lines that no reachable cycle of this system runs, DEFAULT too.
    """

    system: str
    proved: tuple[str, ...] = ()
    not_proved: tuple[str, ...] = ()
    unreached: tuple[str, ...] = ()
    conditional: tuple[str, ...] = ()
    rests: tuple[str, ...] = ()
    trusts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SystemReport:
    """The standing of a system that checked tables belong to.

    Attributes:
        system: Its description.
        standing: `proved`, `proved as far as it was looked at`, `conditional`, `not proved` or `unknown`.
        wanted: Whether `rcsc prove` would say something of these tables that is not known.
        missing: Why it is not wholly proved though nothing is found wrong, level by level.
    """

    system: str
    standing: str
    wanted: bool = False
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class TableReport:
    """One table's verdict and its backing.

    Attributes:
        table: Its name.
        file: Where it stands.
        lines: The number of its lines, DEFAULT not counted.
        method: The way it was decided, as in `DECIDERS`; empty or `none` where nothing was decided.
        confirmed_by_z3: Whether Z3 was asked the same as a whole, and agreed.
        assumptions: Each assumption and invariant that the proof used, and its standing.
        proof_ms: The duration of the proof when it was made.
        cached: Whether it was made by an earlier run.
        together: The results from the proof of the levels together; None where there are none.
        stops: Assumptions on which safety rests: the executors end the cycle where one fails.
        tells: Monitored assumptions whose failure is only reported.
    """

    table: str
    file: str
    verdict: Verdict
    lines: int
    method: str = ""
    confirmed_by_z3: bool = False
    assumptions: tuple[tuple[str, str], ...] = ()
    proof_ms: float = 0.0
    cached: bool = False
    together: InSystem | None = None
    stops: tuple[str, ...] = ()
    tells: tuple[str, ...] = ()

    @property
    def decided_by(self) -> str:
        """Who decided it, in words; "" where it is undecided."""
        return "" if self.verdict is Verdict.UNDECIDED else DECIDERS.get(self.method, "")

    @property
    def confirmed_by(self) -> str:
        """Who was asked the same as a whole, and agreed; "" where nobody was."""
        return "Z3" if self.confirmed_by_z3 else ""

    @property
    def backed(self) -> str:
        """Who decided it and who confirmed it: `decided by counting, confirmed by Z3`."""
        if self.verdict is Verdict.UNDECIDED:
            return (
                f"left open by {DECIDERS[self.method]}" if self.method in DECIDERS else "decided by nothing"
            )
        confirmed = f", confirmed by {self.confirmed_by}" if self.confirmed_by else ""
        return f"decided by {self.decided_by}{confirmed}"


DECIDERS = {
    "boxes": "counting",
    "tree": "a tree of regions",
    "tree+z3": "a tree of regions and Z3",
    "z3": "Z3",
}
"""Ways of deciding a table, each by its deciders."""
MOST_NAMED = 3
"""Claims named of those that a verdict rests on; the others are counted."""


def named(words: Collection[str]) -> str:
    """Return the claims on which a verdict rests as text, up to a limit; the others are counted."""
    more = f" and {len(words) - MOST_NAMED} more" if len(words) > MOST_NAMED else ""
    return "; ".join(list(words)[:MOST_NAMED]) + more


def trusting(words: Collection[str]) -> str:
    """Return text, put after a verdict, about its unproved assumptions; "" where there are none."""
    return f", trusting {', '.join(words)}" if words else ""


def resting(table: TableReport, unproved: Collection[str], unsafe: Collection[str] = ()) -> TableReport:
    """Return the report after these invariants and assumptions are known not to be proved, and lines of these tables can go wrong.

    A proved verdict that rests on one of them becomes conditional: exactly one line matches, as long as all goes well.
    """
    assumptions = tuple((name, NOT_PROVED if name in unproved else was) for name, was in table.assumptions)
    shaken = table.table in unsafe or any(standing == NOT_PROVED for _, standing in assumptions)
    if table.verdict is Verdict.PROVED and shaken:
        return replace(table, verdict=Verdict.CONDITIONAL, assumptions=assumptions)
    return replace(table, assumptions=assumptions)


def merged(tables: Iterable[TableReport]) -> tuple[TableReport, ...]:
    """Return one report for each table, in order of first occurrence: the worst that any program makes of it.

    A table is part of every program that uses its file, and may rely on other invariants in each. Where all prove it, the grounds of all
    are listed.
    """
    worst: dict[tuple[str, str], TableReport] = {}
    for table in tables:
        key = (table.file, table.table)
        worst[key] = _worse(worst[key], table) if key in worst else table
    return tuple(worst.values())


def _worse(first: TableReport, second: TableReport) -> TableReport:
    order = list(Verdict)
    kept = second if order.index(second.verdict) > order.index(first.verdict) else first
    other = first if kept is second else second
    if other.verdict is not kept.verdict:
        return kept
    known = dict(kept.assumptions)
    more = tuple((name, standing) for name, standing in other.assumptions if name not in known)
    stops = tuple(dict.fromkeys((*kept.stops, *other.stops)))
    tells = tuple(name for name in dict.fromkeys((*kept.tells, *other.tells)) if name not in stops)
    return replace(kept, assumptions=(*kept.assumptions, *more), stops=stops, tells=tells)


@dataclass(frozen=True, slots=True)
class Report:
    """The outcome of a command.

    Attributes:
        diagnostics: Sorted, each once.
        tables: In order of file and place.
        sources: Every text that a diagnostic points into.
        systems: Those that the tables belong to, as far as they were looked at.
        published: Files with a finding that their project keeps as somebody published them; their findings are told apart.
    """

    diagnostics: tuple[Diagnostic, ...]
    tables: tuple[TableReport, ...] = ()
    sources: Mapping[str, Source] = field(default_factory=dict)
    systems: tuple[SystemReport, ...] = ()
    published: tuple[str, ...] = ()

    def count(self, severity: Severity, *, published: bool | None = None) -> int:
        """Count the diagnostics of this severity: all, or those in published files, or those elsewhere."""
        return sum(
            each.severity is severity and published in (None, self.is_published(each))
            for each in self.diagnostics
        )

    def is_published(self, diagnostic: Diagnostic) -> bool:
        """Return whether a diagnostic is of a published file."""
        return diagnostic.primary.span.file in self.published

    @property
    def failed(self) -> bool:
        """True where there is an error, or a table that is not proved."""
        return self.count(Severity.ERROR) > 0 or any(
            table.verdict is not Verdict.PROVED for table in self.tables
        )
