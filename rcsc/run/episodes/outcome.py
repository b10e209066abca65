"""What became of an episode, of any system.

In: nothing. Out: the values that campaigns keep and compare; they travel between processes.
"""

from dataclasses import dataclass
from typing import NamedTuple


class RowEnd(NamedTuple):
    """What became of a row: `state` is done, failed, refused, or changed where another command came first."""

    number: int
    text: str
    state: str
    reason: str
    ticks: int


@dataclass(frozen=True, slots=True)
class EpisodeFinding:
    """A property that did not hold, first in this tick.

    Attributes:
        property: In words that are the same for every episode that breaks it.
        message: How it was broken, with the values that show it.
    """

    property: str
    tick: int
    message: str


@dataclass(frozen=True, slots=True)
class EpisodeOutcome:
    """What became of an episode.

    Attributes:
        end: `done`; `failed:REASON`; `refused`, by an interlock or because the script cannot be read; `state-table error`; `hang`.
        lines: Level, table and line that ran.
        digest: Of every level's values in every cycle, as canonical bytes.
    """

    rows: tuple[RowEnd, ...]
    findings: tuple[EpisodeFinding, ...]
    end: str
    ticks: int
    lines: frozenset[tuple[str, str, str]]
    digest: str
