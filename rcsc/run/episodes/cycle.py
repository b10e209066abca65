"""What a property sees of a cycle, and what it says where it does not hold.

In: a running system after a tick. Out: a `Cycle`, one for the whole run, which changes with it; `Broken`s.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

from rcsc.run.episodes.operator import EpisodeOperator
from rcsc.run.levels import RunningLevel
from rcsc.run.plant.bind import BoundPlant
from rcsc.run.signature import Values

if TYPE_CHECKING:
    from rcsc.lang.model import Property as Stated  # who plays other episodes knows no language

MOST_MESSAGE = 300


class Broken(NamedTuple):
    """A property that does not hold in this cycle.

    Attributes:
        property: Its name, the same in every run.
        message: With the values that show it.
        level: Where it was seen; empty for what the plant itself says.
        leaves: That it is about, where only readings of these explain it; empty where any level that was misled does.
        proved: Whether it was proved: then only older values that came again explain it.
        outside: Whether it was assumed over time of what comes from outside: no level is at fault, then or later.
        across: Whether it is about several levels: what misled any of them explains it, and of an assumption readings of `leaves`.
        because: The fault that explains it, where that is known already.
    """

    property: str
    message: str
    level: str = ""
    leaves: tuple[str, ...] = ()
    proved: bool = False
    outside: bool = False
    across: bool = False
    because: str = ""


@dataclass(slots=True)
class Cycle:
    """The state after a cycle.

    Attributes:
        tick: Of the cycle that has just been done, from 1.
        before: What each level had after its last cycle that was no fault; at first, and after a restart, what it begins with.
        left: What it had after its last cycle, whatever ended that: what `was` means in a property.
        ran: The levels that ran.
        said: What was last published in each buffer.
        restarted: Levels that started anew before this cycle.
        refused: By level, leaves that now hold what the level must refuse.
        faulty: Whether any fault is at work.
        broken: What is stated across levels and this cycle breaks, with the values that show it.
        unscheduled: The fault by which a buffer between levels did not come as scheduled, in this cycle or before; empty for none.
    """

    levels: Mapping[str, RunningLevel]
    plants: tuple[BoundPlant, ...]
    operator: EpisodeOperator
    said: Mapping[str, Values]
    before: dict[str, Values]
    left: dict[str, Values]
    tick: int = 0
    ran: tuple[RunningLevel, ...] = ()
    restarted: frozenset[str] = frozenset()
    refused: Mapping[str, frozenset[str]] = field(default_factory=dict)
    faulty: bool = False
    broken: "tuple[tuple[Stated, str], ...]" = ()
    unscheduled: str = ""


class Property(Protocol):
    """Something that is to hold in every cycle of a run; made for one run."""

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield each violation of this cycle."""
        ...
