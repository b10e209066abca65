"""What a run did, kept while it runs, as the log that a file would be.

In: a system, after each cycle. Out: `Log`s: one for as long as the levels run the same tables. A state that comes again is kept once
(`Track`), so that waiting costs no memory; `undo` takes back what was kept. Beside it, which numbers nobody has set at which tick
(`rcsc.run.unset`): what is kept of that grows with how often something is set for the first time.
"""

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from rcsc.run.adopt import Begun
from rcsc.run.levels import RunningLevel
from rcsc.run.log.export import unset_from_first
from rcsc.run.log.read import Log, LoggedLevel, LoggedRestart, Track
from rcsc.run.log.records import ChainCheck
from rcsc.run.log.schema import system_facts
from rcsc.run.signature import Signature, Values
from rcsc.run.system import System
from rcsc.run.unset import LevelSeen, Unsets

MOST_TICKS = 200_000
"""Ticks that are kept: more than two hours at 40 ms; after them the older half is let go."""
A_PIECE = 400
"""Ticks of a log in which gaps are looked for before others have their turn."""
Names = Mapping[str, frozenset[str]]
"""By level."""


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


@dataclass(slots=True)
class History:
    """The ticks of one run.

    Attributes:
        logs: In order, the last still growing.
        era: How often ticks that were known were taken back or let go.
        gaps: What nobody had set; of a log, once somebody asked.
    """

    logs: list[Log] = field(default_factory=list)
    era: int = 0
    gaps: Gaps | None = None

    def begin(self, system: System) -> None:
        """Continue with levels as they are now, at first or after other tables were taken."""
        levels = tuple(_begun(level, system.tick) for level in system.levels)
        self.gaps = self.gaps or Gaps()
        self.gaps.begin(system)
        self.logs.append(Log(system_facts(system.description), {}, levels, {}, ChainCheck()))

    def add(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        """Keep a tick; called by `System.watch`."""
        log = self._fitting(system)
        assert self.gaps is not None  # a log was begun
        self.gaps.add(system, ran)
        if system.restarts:
            log = self._restarted(log, system)
        for level in ran:
            log.level(level.name).track.add(system.tick, level.sign.packed.pack(*level.values))
        if len(log.levels[0].track.ticks) > MOST_TICKS:
            self._forget(log)

    def settle(self, system: System) -> None:
        """Follow what something else than a cycle did: undo, other tables, values that were set by hand.

        What was set between two cycles is kept as the state from which the later one begins, as a log has it.
        """
        held = [log for log in self.logs if log.first <= system.tick]
        taken_back = len(held) < len(self.logs)
        self.logs[:] = held
        if self.gaps is not None:
            self.gaps.back_to(system.tick)
        log = self._fitting(system)
        levels = []
        for level in system.levels:
            logged = log.level(level.name)
            track = logged.track
            keep = track.place(system.tick) + 1
            taken_back |= keep < len(track.ticks)
            del track.ticks[keep:], track.packed[keep:]
            levels.append(_settled(logged, level, system.tick))
        self.era += taken_back
        self.logs[-1] = replace(log, levels=tuple(levels))

    def find_gaps(self) -> Iterator[None]:
        """Find the gaps in an opened log, and yield after each piece of it; a live run has them."""
        for found in () if self.gaps is not None else gaps_of(self.logs[0]):
            if found is None:
                yield
            self.gaps = found

    def ran_at(self, tick: int) -> Log:
        """Return the log that has the cycles of a tick; of the first tick there are none."""
        return next((log for log in reversed(self.logs) if log.first < tick), self.logs[0])

    def stood_at(self, tick: int) -> Log:
        """Return the log that has the values left by a tick."""
        return next((log for log in reversed(self.logs) if log.first <= tick), self.logs[0])

    def values(self, name: str, tick: int) -> Values:
        """Return a level's leaves and trace after a tick, with values set by hand after it.

        Raises:
            KeyError: There is no such level.
        """
        level = self.stood_at(tick).level(name)
        values = level.track.latest(tick) or level.track.layout.unpack(level.track.packed[0])
        by_hand = next((one for one in reversed(level.restarts) if one.tick == tick + 1), None)
        return values if by_hand is None else (*by_hand.values, *values[len(level.sign.leaves) :])

    @property
    def first(self) -> int:
        """The first kept tick: that before the first cycle."""
        return self.logs[0].first

    @property
    def last(self) -> int:
        """The last tick."""
        return self.logs[-1].last

    def _fitting(self, system: System) -> Log:
        """Return the log that grows; a new one where a level runs other tables than it."""
        if not self.logs or any(
            level.sign is not logged.sign
            for level, logged in zip(system.levels, self.logs[-1].levels, strict=True)
        ):
            self.begin(system)
        return self.logs[-1]

    def _restarted(self, log: Log, system: System) -> Log:
        again = {
            restart.level: LoggedRestart(system.tick, restart.begun, restart.values)
            for restart in system.restarts
            if restart.begun is not Begun.HAND  # which `settle` keeps
        }
        levels = tuple(
            replace(level, restarts=(*level.restarts, again[level.name])) if level.name in again else level
            for level in log.levels
        )
        self.logs[-1] = replace(log, levels=levels)
        return self.logs[-1]

    def _forget(self, log: Log) -> None:
        """Drop the older half."""
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


def _settled(logged: LoggedLevel, level: RunningLevel, tick: int) -> LoggedLevel:
    """Return a level with the values set by hand since its last cycle, and without those taken back."""
    earlier = tuple(one for one in logged.restarts if one.tick <= tick)
    leaves = level.values[: len(level.sign.leaves)]
    record = logged.track.layout.unpack(logged.track.packed[-1])[: len(leaves)]
    before = next((one.values for one in reversed(earlier) if one.tick > logged.track.ticks[-1]), record)
    by_hand = () if leaves == before else (LoggedRestart(tick + 1, Begun.HAND, leaves),)
    return replace(logged, restarts=(*earlier, *by_hand))


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
