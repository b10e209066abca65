"""What became of an episode: orders, findings, what a fault explains, lines of tables, a digest.

In: what `rcsc.run.episodes.loop` saw. Out: values that travel between processes.
"""

from dataclasses import dataclass
from typing import NamedTuple


class RowEnd(NamedTuple):
    """What became of an order: `done`, `failed`, `changed` where another came first, `waiting` where it did not end."""

    number: int
    text: str
    state: str
    reason: str
    ticks: int


@dataclass(frozen=True, slots=True)
class EpisodeFinding:
    """A property that did not hold, first in this tick."""

    property: str
    tick: int
    message: str


@dataclass(frozen=True, slots=True)
class Excused:
    """A property that did not hold, first in this tick, and the injected fault that explains it: no finding."""

    property: str
    tick: int
    message: str
    because: str


@dataclass(frozen=True, slots=True)
class EpisodeOutcome:
    """What became of an episode.

    Attributes:
        rows: The orders that were given, each with how it ended.
        findings: The first of each property.
        end: `done`; `failed:REASON` of the last order; `state-table error`; `plant failed`; `hang`; `running`.
        lines: Level, table and line that ran.
        digest: Of every level's values in every cycle, as canonical bytes: the same with every kind of executor.
        excused: What did not hold because of a fault that breaks what the levels may rely on.
    """

    rows: tuple[RowEnd, ...]
    findings: tuple[EpisodeFinding, ...]
    end: str
    ticks: int
    lines: frozenset[tuple[str, str, str]]
    digest: str
    excused: tuple[Excused, ...] = ()
