"""The requirements over time that every run watches, watched in a run that pages look at.

In: a history that goes on, and the requirements of its levels. Out: each cycle that breaks one, found once: a cycle that was looked at is
not looked at again, unless ticks were taken back.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.desk.studio.runs.history import History
from rcsc.lang.model import Property
from rcsc.run.log.across import AcrossTrack
from rcsc.run.log.read import Log
from rcsc.run.log.required import ACROSS, BrokenRequirement, WatchedTrack, broken_across


@dataclass(slots=True)
class Watched:
    """The broken requirements of one run.

    Attributes:
        broken: The cycles that were found.
    """

    broken: list[BrokenRequirement] = field(default_factory=list)
    _era: int = -1
    _tracks: list[tuple[list[WatchedTrack], AcrossTrack]] = field(default_factory=list)

    def look(self, history: History, wanted: Callable[[Log], Mapping[str, Sequence[Property]]]) -> None:
        """Look at the cycles that came since; `wanted` gives the requirements of a log's levels, and is asked once."""
        if history.era != self._era:
            self._era = history.era
            self.broken.clear()
            self._tracks.clear()
        for number, log in enumerate(history.logs):
            if number == len(self._tracks):
                stated = wanted(log)
                own = [WatchedTrack.of(level.sign, stated.get(level.name, ())) for level in log.levels]
                self._tracks.append((own, AcrossTrack.of(log, stated.get(ACROSS, ()))))
            own, across = self._tracks[number]
            for level, track in zip(log.levels, own, strict=True):
                self.broken += track.further(level)
            self.broken += broken_across(across, log)
