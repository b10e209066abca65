"""What tests of the loop share: which lines ran in which cycle."""

from functools import cache
from typing import ClassVar

from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc_cell.episodes.episode import SYSTEM, Episode, PartSpec
from rcsc_cell.episodes.loop import Loop
from rcsc_cell.properties import PROPERTIES
from rcsc_cell.properties.cycle import CycleState

TBOX = (PartSpec("tbox", "buffer", 20.0, -30.0, 10.0),)
ACQUIRE = Episode(parts=TBOX, rows=("ACQUIRE,BOXT (2),BUFFER,,",))


class Trace:
    """Not a property: what ran in each cycle."""

    name: ClassVar[str] = "trace"
    place: ClassVar[str] = "section 10"

    def __init__(self, _: CycleState) -> None:
        self.ran: list[tuple[str, ...]] = []

    def watch(self, cycle: CycleState) -> str | None:
        self.ran.append(tuple(f"{level.name} {level.table} {level.line}" for level in cycle.ran))
        return None


@cache
def played(episode: Episode) -> tuple[list[tuple[str, ...]], EpisodeOutcome]:
    """The lines of every cycle, level by level, and what became of the episode."""
    loop = Loop(episode, SYSTEM, properties=(*PROPERTIES, Trace))
    outcome = loop.finish()
    made = loop.properties[-1]
    assert isinstance(made, Trace)
    return made.ran, outcome
