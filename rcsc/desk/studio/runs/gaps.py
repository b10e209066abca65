"""Which numbers nobody has set, at every tick of a run: live, where it is undone and goes on, or of a log.

In: a system, after each cycle, or a log. Out: by tick and level the names that a curve leaves out (`rcsc.run.unset`). What is kept grows
with how often something is set for the first time, not with the run.
"""

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial

from rcsc.run.adopt import Begun
from rcsc.run.levels import RunningLevel
from rcsc.run.log.export import unset_from_first
from rcsc.run.log.read import Log
from rcsc.run.signature import Signature, Values
from rcsc.run.system import System
from rcsc.run.unset import LevelSeen, Unsets

Names = Mapping[str, frozenset[str]]
"""By level."""
A_PIECE = 400
"""Ticks of a log that are looked at before others have their turn."""


@dataclass(slots=True)
class Gaps:
    """The numbers that nobody has set.

    Attributes:
        ticks: At which something else was unset than at the tick before, in order; `names` what was.
    """

    ticks: list[int] = field(default_factory=list)
    names: list[Names] = field(default_factory=list)
    _stood: list[Unsets] = field(default_factory=list)

    def begin(self, system: System) -> None:
        """Begin a run, or continue with levels of other tables."""
        if self._stood:
            since = self._stood[-1].copy()
            since.adopt(map(_seen, system.levels))
        else:
            specs = {spec.name: spec for spec in system.description.levels}
            since = Unsets(system.description.wires, specs)
            if system.tick == 0:
                since.begin(map(_seen, system.levels), partial(_published, system))
        self._keep(system, since)

    def add(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        """Take a tick."""
        since = self._stood[-1].copy()
        for restart in system.restarts:
            if restart.begun is Begun.ANEW and restart.level in since.now:
                since.restarted(_seen(system.level(restart.level), restart.values))
        since.tick(map(_seen, ran), partial(_published, system))
        if since != self._stood[-1]:
            self._keep(system, since)

    def back_to(self, tick: int) -> None:
        """Forget the gaps after a tick."""
        keep = max(1, bisect_right(self.ticks, tick))
        del self.ticks[keep:], self.names[keep:], self._stood[keep:]

    def spans(self, level: str, name: str) -> Iterator[tuple[int, bool]]:
        """Yield whether nobody has set a variable, from a tick on, wherever that changes."""
        last = False
        for tick, names in zip(self.ticks, self.names, strict=True):
            if (name in names.get(level, ())) != last:
                last = not last
                yield tick, last

    def within(self, level: str, name: str, last: int) -> list[list[int]]:
        """Return the spans of ticks, at most to `last`, in which nobody has set a variable."""
        found: list[list[int]] = []
        for tick, unset in self.spans(level, name):
            if unset and tick <= last:
                found.append([tick, last])
            elif not unset and found:
                found[-1][1] = min(tick - 1, last)
        return found

    def _keep(self, system: System, since: Unsets) -> None:
        self._stood.append(since)
        self.note(system.tick, since.now, {level.name: level.sign for level in system.levels})

    def note(self, tick: int, now: Mapping[str, frozenset[int]], signs: Mapping[str, Signature]) -> None:
        """Note the unset places from a tick on."""
        self.ticks.append(tick)
        self.names.append(
            {name: frozenset(signs[name].leaves[at].name for at in places) for name, places in now.items()}
        )


def gaps_of(log: Log) -> Iterator[Gaps | None]:
    """Yield None after each piece of a log, and at last its gaps.

    Args:
        log: Whole, or a part.
    """
    gaps, last = Gaps(), dict[str, frozenset[int]]()
    signs = {level.name: level.sign for level in log.levels}
    for count, (tick, now) in enumerate(unset_from_first(log), start=1):
        if now != last:
            gaps.note(tick, now, signs)
            last = dict(now)
        if count % A_PIECE == 0:
            yield None
    yield gaps


def _seen(level: RunningLevel, values: Values | None = None) -> LevelSeen:
    trace = level.values[len(level.sign.leaves) :]
    return LevelSeen(
        level.name, level.sign, level.level, level.values if values is None else (*values, *trace)
    )


def _published(system: System, name: str) -> bool:
    return system.buffers.latest(name) is not None
