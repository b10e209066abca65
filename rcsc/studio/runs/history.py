"""What a run did, kept while it runs, as the log that a file would be.

In: a system, after each cycle. Out: `Log`s: one for as long as the levels run the same tables. A state that comes again is kept once
(`Track`), so that waiting costs no memory; `undo` takes back what was kept.
"""

from dataclasses import dataclass, field, replace

from rcsc.run.levels import RunningLevel
from rcsc.run.log.read import Log, LoggedLevel, LoggedRestart, Track
from rcsc.run.log.records import ChainCheck
from rcsc.run.log.schema import system_facts
from rcsc.run.system import System

MOST_TICKS = 200_000
"""Ticks that are kept: more than two hours at 40 ms; after them the older half is let go."""


@dataclass(slots=True)
class History:
    """The ticks of one run.

    Attributes:
        logs: In order, the last still growing.
        era: How often ticks that were known were taken back or let go.
    """

    logs: list[Log] = field(default_factory=list)
    era: int = 0

    def begin(self, system: System) -> None:
        """Go on with levels as they are now, at first or after other tables were taken."""
        levels = tuple(_begun(level, system.tick) for level in system.levels)
        self.logs.append(Log(system_facts(system.description), {}, levels, {}, ChainCheck()))

    def add(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        """Keep a tick; what `System.watch` calls."""
        log = self._fitting(system)
        if system.restarts:
            log = self._restarted(log, system)
        for level in ran:
            log.level(level.name).track.add(system.tick, level.sign.packed.pack(*level.values))
        if len(log.levels[0].track.ticks) > MOST_TICKS:
            self._forget(log)

    def settle(self, system: System) -> None:
        """Make the last tick what the system is now, after something else than a cycle changed it."""
        held = [log for log in self.logs if log.first <= system.tick]
        if len(held) < len(self.logs):
            self.era += 1
        self.logs[:] = held
        log = self._fitting(system)
        for level in system.levels:
            track = log.level(level.name).track
            if track.ticks[-1] > system.tick:
                self.era += 1
                del track.packed[track.place(system.tick) + 1 :]
                del track.ticks[track.place(system.tick) + 1 :]
            content = level.sign.packed.pack(*level.values)
            if track.packed[-1] != content and len(track.ticks) > 1 and track.ticks[-1] == system.tick:
                track.packed[-1] = content
                self.era += 1
            elif track.packed[-1] != content and track.ticks[-1] < system.tick:
                track.add(system.tick, content)
            elif track.packed[-1] != content:
                track.packed[0] = content

    def at(self, tick: int) -> Log:
        """Return the log that has a tick."""
        return next((log for log in reversed(self.logs) if log.first <= tick), self.logs[0])

    @property
    def first(self) -> int:
        """The first tick that is kept: that before the first cycle."""
        return self.logs[0].first

    @property
    def last(self) -> int:
        """The last tick."""
        return self.logs[-1].last

    def _fitting(self, system: System) -> Log:
        """Return the log that grows; a new one where a level runs other tables than it."""
        alike = self.logs and all(
            level.sign is logged.sign
            for level, logged in zip(system.levels, self.logs[-1].levels, strict=True)
        )
        if not alike:
            self.begin(system)
        return self.logs[-1]

    def _restarted(self, log: Log, system: System) -> Log:
        again = {
            restart.level: LoggedRestart(system.tick, restart.begun, restart.values)
            for restart in system.restarts
        }
        levels = tuple(
            replace(level, restarts=(*level.restarts, again[level.name])) if level.name in again else level
            for level in log.levels
        )
        self.logs[-1] = replace(log, levels=levels)
        return self.logs[-1]

    def _forget(self, log: Log) -> None:
        """Let the older half go."""
        self.logs[:] = [log]
        self.era += 1
        for level in log.levels:
            half = level.track.place(log.last - MOST_TICKS // 2)
            del level.track.ticks[:half], level.track.packed[:half]
            kept = set(map(id, level.track.packed))
            level.track.known = {key: value for key, value in level.track.known.items() if id(value) in kept}


def _begun(level: RunningLevel, tick: int) -> LoggedLevel:
    logged = LoggedLevel(level.name, level.sign, level.level, Track(level.sign.packed))
    logged.track.add(tick, level.sign.packed.pack(*level.values))
    return logged
