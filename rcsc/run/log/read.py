"""A log, read: the whole one, or what a kill left of it.

In: an MCAP file of `rcsc.run.log.recorder`. Out: a `Log`: for each level its signature and what every cycle left. A log may come from
anybody: whatever it names is checked against what it may be, and its records against those of a run: of each level all cycles that its
period has, and no others. The chain tells damage; this tells what a chain that was made anew does not: rows that are missing.
"""

import struct
from bisect import bisect_right
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from mcap.records import Channel, McapRecord, Message, Metadata

from rcsc.base.host.files.names import identifier, shown
from rcsc.run.adopt import Begun
from rcsc.run.description import Description, wire_of
from rcsc.run.log.finding import FINDING, LoggedFinding, finding_of
from rcsc.run.log.records import ChainCheck, Seal, records
from rcsc.run.log.schema import (
    BUFFERS,
    EVENTS,
    GAPS,
    LEVELS,
    PROGRAMS,
    RESTARTS,
    SIGNATURE,
    SYSTEM,
    TAKEN,
    Gap,
    LoggedEvent,
    event_of,
    message_format,
    restart_of,
    signature_from,
    system_of,
    taken_layout,
)
from rcsc.run.signature import LevelSign, Signature, Values

_NOWHERE = Path()
_TICKS_A_MESSAGE, _ALWAYS_TICKS = 64, 1_000_000
"""How far apart the records of a log may lie; ticks without one cost time and hold nothing."""


class UnreadableLog(Exception):  # noqa: N818  # what happened, not an error of ours
    """A file is no log of rcsc's, or nothing of it is left; says why."""


@dataclass(slots=True)
class Track:
    """What one level left, or what one buffer carried, in ticks that ascend.

    Attributes:
        packed: Canonical bytes; the same object where a state comes again, so that waiting costs no memory.
    """

    layout: struct.Struct
    ticks: list[int] = field(default_factory=list)
    packed: list[bytes] = field(default_factory=list)
    known: dict[bytes, bytes] = field(default_factory=dict, repr=False)

    def add(self, tick: int, content: bytes) -> None:
        """Append one record.

        Raises:
            ValueError: It has not the length that the signature says, or is of an earlier tick.
        """
        if len(content) != self.layout.size:
            raise ValueError(f"{len(content)} bytes, not {self.layout.size}")
        if self.ticks and tick <= self.ticks[-1]:
            raise ValueError(f"tick {tick} after tick {self.ticks[-1]}")
        self.ticks.append(tick)
        self.packed.append(self.known.setdefault(content, content))

    def place(self, tick: int) -> int:
        """Where the latest record of then lies; -1 for none."""
        return bisect_right(self.ticks, tick) - 1

    def latest(self, tick: int) -> Values | None:
        """The value as of a tick."""
        at = self.place(tick)
        return None if at < 0 else self.layout.unpack(self.packed[at])

    def __iter__(self) -> Iterator[tuple[int, Values]]:
        held, values = b"", ()
        for tick, content in zip(self.ticks, self.packed, strict=True):
            if content is not held:
                held, values = content, self.layout.unpack(content)
            yield tick, values


@dataclass(frozen=True, slots=True)
class LoggedRestart:
    """A level that was started again, or in which somebody set something.

    Attributes:
        tick: That of the cycle that it came before.
        values: All leaves, from which the level went on.
    """

    tick: int
    begun: Begun
    values: Values

    @property
    def by_hand(self) -> bool:
        """Whether nothing was started again, but set."""
        return self.begun is Begun.HAND


@dataclass(frozen=True, slots=True)
class LoggedLevel:
    """A level of a log; the first record is what it started from, every other one a cycle.

    Attributes:
        restarts: In order, with what was set by hand; logs that were written before there were such records have none.
        gaps: The ticks of its period without a record, and why: of a run in processes.
        taken: The cycles that took other buffers than in one process, with the ticks in which those were given.
    """

    name: str
    sign: Signature
    level: LevelSign
    track: Track
    restarts: tuple[LoggedRestart, ...] = ()
    gaps: Mapping[int, Gap] = field(default_factory=dict)
    taken: Track | None = None

    def follows(self, at: int) -> bool:
        """Tell whether it is known from what state the cycle at this place began."""
        if not self.gaps:
            return True
        after, until = self.track.ticks[at - 1], self.track.ticks[at]
        unseen = [tick for tick in range(after + 1, until) if self.gaps.get(tick) is Gap.UNSEEN]
        restart = self.restarted(at) if unseen else None
        return not unseen or (restart is not None and restart.tick > max(unseen))

    def restarted(self, at: int) -> LoggedRestart | None:
        """Return the restart before the cycle at this place; None where it went on from the record before."""
        after, until = self.track.ticks[at - 1], self.track.ticks[at]
        return next((restart for restart in reversed(self.restarts) if after < restart.tick <= until), None)

    def set_by_hand(self, restart: LoggedRestart) -> Mapping[str, str]:
        """Return what of a restart's values the cycle before it had not left, by name; nothing where it is no hand's."""
        left = self.track.latest(restart.tick - 1) if restart.by_hand else None
        return {
            leaf.name: leaf.shown(now)
            for leaf, was, now in zip(self.sign.leaves, left or (), restart.values, strict=False)
            if leaf.shown(was) != leaf.shown(now)
        }


@dataclass(frozen=True, slots=True)
class Log:
    """A log.

    Attributes:
        facts: The description of the system as it was written.
        programs: The digest of each program that ran.
        levels: From the top down.
        buffers: Those that no level fills, by name.
        checked: What its chain says of it.
        finding: What the run breaks; None where it is not kept for that.
        events: What became of its processes, in order; none of a run in one process.
    """

    facts: Mapping[str, str]
    programs: Mapping[str, str]
    levels: tuple[LoggedLevel, ...]
    buffers: Mapping[str, Track]
    checked: ChainCheck
    finding: LoggedFinding | None = None
    events: tuple[LoggedEvent, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether the log is whole, and every byte as it was recorded."""
        return self.checked.seal is Seal.WHOLE

    def is_of(self, system: Description) -> bool:
        """Whether it is a log of this system, or of some of its levels."""
        here = {(spec.name, spec.program) for spec in system.levels}
        there = {(spec.name, spec.program) for spec in self.system().levels}
        return self.facts["name"] == system.name and there <= here

    def system(self, generated: Path = _NOWHERE, database: Path = _NOWHERE) -> Description:
        """The description, with paths of here."""
        return system_of(self.facts, generated, database)

    @property
    def tick_ms(self) -> int:
        """Length of a tick in ms."""
        return int(self.facts["tick_ms"])

    @property
    def first(self) -> int:
        """The tick that recording started from, before the first cycle."""
        return min(level.track.ticks[0] for level in self.levels)

    @property
    def last(self) -> int:
        """The last tick."""
        return max(level.track.ticks[-1] for level in self.levels)

    @property
    def ticks(self) -> range:
        """Every tick in which cycles were recorded."""
        return range(self.first + 1, self.last + 1)

    def level(self, name: str) -> LoggedLevel:
        """A level by its name.

        Raises:
            KeyError: There is none.
        """
        for level in self.levels:
            if level.name == name:
                return level
        raise KeyError(name)


def read(path: Path) -> Log:
    """Read a log; one that was cut off or changed, up to the first damaged record.

    Raises:
        UnreadableLog: It cannot be read, or is none.
    """
    checked = ChainCheck()
    reading = _Reading(checked)
    try:
        for record in records(path, checked):
            reading.take(record)
        return reading.log()
    except OSError as error:
        raise UnreadableLog(f"`{path}` cannot be read: {error.strerror}") from error
    except (KeyError, TypeError, ValueError, AttributeError, StopIteration, struct.error) as error:
        why = checked.why or (str(error) if isinstance(error, ValueError) else "")
        raise UnreadableLog(f"`{path}` holds no run that rcsc recorded{why and f': {why}'}") from error


def finding_at_the_head(path: Path) -> LoggedFinding | None:
    """What a log is kept for, as its beginning says; its runs are not read, nor looked at.

    Raises:
        UnreadableLog: It cannot be read.
    """
    record: McapRecord
    try:
        for record in records(path, ChainCheck()):
            if isinstance(record, Metadata) and record.name == FINDING:
                return finding_of(record.metadata)
            if isinstance(record, Message):
                return None
    except OSError as error:
        raise UnreadableLog(f"`{path}` cannot be read: {error.strerror}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise UnreadableLog(f"`{path}` holds no finding that rcsc recorded") from error
    return None


@dataclass(slots=True)
class _Reading:
    """What was read so far."""

    checked: ChainCheck
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    signs: dict[str, Signature] = field(default_factory=dict)
    tracks: dict[int, Track] = field(default_factory=dict)
    topics: dict[str, int] = field(default_factory=dict)
    begun: dict[int, tuple[Begun, str, struct.Struct]] = field(default_factory=dict)
    restarts: dict[str, list[LoggedRestart]] = field(default_factory=dict)
    events: list[LoggedEvent] = field(default_factory=list)

    def take(self, record: McapRecord) -> None:
        """Notes one record."""
        match record:
            case Metadata(name=name, metadata=facts):
                self.metadata[name] = facts
            case Channel():
                self._channel(record)
            case Message(channel_id=channel, sequence=tick, data=content) if channel in self.tracks:
                self.tracks[channel].add(tick, content)
            case Message(channel_id=channel, sequence=tick, data=content) if channel in self.begun:
                self._restart(*self.begun[channel], tick, content)
            case Message(channel_id=channel, sequence=tick, data=content) if channel == self.topics.get(
                EVENTS
            ):
                self.events.append(event_of(tick, content))
            case _:
                pass

    def _restart(self, begun: Begun, level: str, layout: struct.Struct, tick: int, content: bytes) -> None:
        if len(content) != layout.size:
            raise ValueError(f"{len(content)} bytes, not {layout.size}")
        self.restarts.setdefault(level, []).append(LoggedRestart(tick, begun, layout.unpack(content)))

    def _channel(self, channel: Channel) -> None:
        if channel.id in self.tracks or channel.id in self.begun:  # said again at the end
            return
        if channel.topic in self.topics:
            raise ValueError(f"two channels are called {shown(channel.topic)}")
        if channel.topic.startswith(LEVELS):
            sign = signature_from(channel.metadata[SIGNATURE])
            self.signs[identifier(channel.topic.removeprefix(LEVELS), "level")] = sign
            self.tracks[channel.id] = Track(sign.packed)
        elif channel.topic.startswith(BUFFERS):
            source, target = channel.topic.removeprefix(BUFFERS), channel.metadata["target"]
            wire = wire_of(source, target)
            leaves = self.signs[target.partition(".")[0]].leaves_of(wire.target.partition(".")[2])
            self.tracks[channel.id] = Track(struct.Struct(message_format(leaves)))
        elif channel.topic.startswith(RESTARTS):
            begun, level = restart_of(channel.topic)
            self.begun[channel.id] = begun, level, struct.Struct(message_format(self.signs[level].leaves))
            return
        elif channel.topic.startswith(GAPS):
            self.tracks[channel.id] = Track(struct.Struct("<B"))
        elif channel.topic.startswith(TAKEN):
            system = system_of(self.metadata[SYSTEM], _NOWHERE, _NOWHERE)
            taken = system.taken_by(channel.topic.removeprefix(TAKEN))
            self.tracks[channel.id] = Track(taken_layout(taken)[1])
        elif channel.topic != EVENTS:
            return
        self.topics[channel.topic] = channel.id

    def log(self) -> Log:
        """The log. Raises KeyError, TypeError, ValueError, AttributeError, StopIteration: it is none."""
        facts = self.metadata[SYSTEM]
        levels = tuple(self._level(spec.name) for spec in system_of(facts, _NOWHERE, _NOWHERE).levels)
        if not levels or not all(level.track.ticks for level in levels):
            raise ValueError("no state")
        buffers = {
            topic.removeprefix(BUFFERS): self.tracks[channel]
            for topic, channel in self.topics.items()
            if topic.startswith(BUFFERS)
        }
        finding = finding_of(self.metadata[FINDING]) if FINDING in self.metadata else None
        log = Log(
            facts, self.metadata.get(PROGRAMS, {}), levels, buffers, self.checked, finding, tuple(self.events)
        )
        held = sum(len(track.ticks) for track in self.tracks.values())
        if log.last - log.first > _ALWAYS_TICKS + _TICKS_A_MESSAGE * held:
            raise ValueError(f"{log.last - log.first} ticks and {held} records")
        self._check(log)
        return log

    def _check(self, log: Log) -> None:
        """Raises: ValueError: The records are not those of one run."""
        cycles = {level.name: (level.track.ticks, level.level.period_ms) for level in log.levels}
        if sorted(level.name for level in log.levels) != sorted(self.signs):
            raise ValueError("the levels that it describes are not those that it records")
        if len({ticks[0] for ticks, _ in cycles.values()}) > 1:
            raise ValueError("its levels do not begin in one tick")
        if log.finding is None:  # in which levels run when they like
            gaps = {level.name: level.gaps for level in log.levels}
            _check_cycles(cycles, log.tick_ms, whole=log.complete, gaps=gaps)
        for level in log.levels:
            restarts = [each.tick for each in level.restarts]
            if any(tick not in log.ticks for tick in restarts) or restarts != sorted(restarts):
                raise ValueError(
                    f"level `{level.name}` was started again in other ticks than those of the run"
                )

    def _level(self, name: str) -> LoggedLevel:
        sign = self.signs[name]
        level = next(level for level in sign.levels if level.name == name)
        restarts = tuple(self.restarts.get(name, ()))
        gaps, taken = (self.tracks.get(self.topics.get(topic + name, -1)) for topic in (GAPS, TAKEN))
        return LoggedLevel(
            name, sign, level, self.tracks[self.topics[LEVELS + name]], restarts,
            {tick: Gap(int(why)) for tick, (why,) in gaps or ()}, taken,
        )  # fmt: skip


def _check_cycles(
    cycles: Mapping[str, tuple[Sequence[int], int]],
    tick_ms: int,
    *,
    whole: bool,
    gaps: Mapping[str, Collection[int]],
) -> None:
    """See that each level has its cycles.

    Args:
        cycles: For each level the ticks of its records, the first that of the state it started from, and its period in ms.
        tick_ms: Length of a tick.
        whole: Whether the log has its end; else each may end anywhere.
        gaps: Of each level the ticks in which the log says that it has no cycle of it.

    Raises:
        ValueError: One lacks a cycle, or has one that its period has not.
    """
    last = max(ticks[-1] for ticks, _ in cycles.values())
    for name, (ticks, period_ms) in cycles.items():
        if period_ms % tick_ms:
            raise ValueError(f"level `{name}` has a period of {period_ms} ms, in ticks of {tick_ms} ms")
        step, begun = period_ms // tick_ms, ticks[0]
        every = range(begun + 1 + -begun % step, (last if whole else ticks[-1]) + 1, step)
        due = [tick for tick in every if tick not in gaps[name]] if gaps[name] else every
        if len(due) != len(ticks) - 1 or any(map(int.__ne__, due, ticks[1:])):
            had = set(ticks[1:])
            at = next((tick for tick in due if tick not in had), None)
            wrong = (
                f"has no cycle in tick {at}" if at is not None else "has a cycle between those of its period"
            )
            raise ValueError(f"level `{name}` {wrong}")
