"""What tests of the loop share: which lines ran in which cycle, and counterexamples that are kept."""

from functools import cache
from pathlib import Path
from typing import ClassVar

from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc_cell.episodes.episode import SYSTEM, Episode, PartSpec, script
from rcsc_cell.episodes.loop import Loop, run
from rcsc_cell.properties import PROPERTIES
from rcsc_cell.properties.cycle import CycleState

KEPT = Path(__file__).parents[2] / ".rcsc-cache" / "loop"
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


def keep(episode: Episode, outcome: EpisodeOutcome) -> str:
    """Keeps what does not hold, as an episode, a script and a log; what to say of it."""
    folder = KEPT / f"{outcome.digest[:12]}"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "episode.json").write_text(episode.to_json(), encoding="utf-8")
    (folder / "script.csv").write_text(script(episode.rows), encoding="utf-8")
    run(episode, log=folder / "log.mcap")
    said = "; ".join(
        f"{finding.property}, cycle {finding.tick}: {finding.message}" for finding in outcome.findings
    )
    return f"{said}\nkept in {folder}; rcsc replay {folder / 'log.mcap'}\n{episode.to_json()}"
