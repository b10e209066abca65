"""The requirements over time that every run watches, watched in a run that pages look at.

In: a history that goes on, and the requirements of its levels. Out: each cycle that breaks one, found once: a cycle that was looked at is
not looked at again, unless ticks were taken back.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rcsc.desk.studio.runs.history import History
from rcsc.lang.model import Property
from rcsc.run.log.read import LoggedLevel
from rcsc.run.log.required import BrokenRequirement, WatchedTrack
from rcsc.run.signature import Signature


@dataclass(slots=True)
class Watched:
    """The broken requirements of one run.

    Attributes:
        broken: The cycles that were found.
    """

    broken: list[BrokenRequirement] = field(default_factory=list)
    _era: int = -1
    _tracks: dict[tuple[int, str], tuple[Signature, WatchedTrack]] = field(default_factory=dict)

    def look(self, history: History, wanted: Callable[[LoggedLevel], Sequence[Property]]) -> None:
        """Look at the cycles that came since; `wanted` gives the requirements of a level as it ran."""
        if history.era != self._era:
            self._era = history.era
            self.broken.clear()
            self._tracks.clear()
        for number, log in enumerate(history.logs):
            for level in log.levels:
                sign, track = self._tracks.get((number, level.name), (None, None))
                if track is None or sign is not level.sign:
                    track = WatchedTrack.of(level.sign, wanted(level))
                    self._tracks[number, level.name] = level.sign, track
                self.broken += track.further(level)
