"""The diagnostic process: it reads the common memory every cycle, and records what every level did (Haynes et al. 1984, section 9).

In: a `Setting`, and the path of a log. Out: the log of a run in one process (`rcsc.run.log`), written tick by tick once all have run it.

The clocks see to it that nothing is overwritten before it was read. A log of processes has beside its cycles, where there is such:
which cycles' buffers a level took, where those are others than in one process; the cycles that a level did not have, or that could not
be read because somebody else wrote in the memory; and what became of processes, as the supervisor tells it. Where levels run in step and
nothing of that happens, it is byte for byte the log of a run in one process.

    cycle      1   2   3           level task, in cycle 3, took of emove what it gave in cycle 1: /taken/task says so
    task       x   x   x
    emove      x       x           gap: it was killed, and the others went on without it
"""

import contextlib
import os
import signal
import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.run.adopt import Restarted
from rcsc.run.description import Description
from rcsc.run.log.recorder import Recorder
from rcsc.run.log.schema import (
    EVENT_FIELDS,
    EVENTS,
    GAP_FIELDS,
    GAPS,
    TAKEN,
    Gap,
    LoggedEvent,
    outside_wires,
    taken_layout,
)
from rcsc.run.processes.clocks import LONGEST_NAP_S, SHORTEST_NAP_S, Clocks
from rcsc.run.processes.memory import (
    CHECKPOINT,
    NO_CYCLE_MS,
    STAMPS,
    STEP,
    Image,
    SharedMemoryBuffers,
    begun,
)
from rcsc.run.processes.serve import BEGINNINGS, REFUSES, Setting, attached, telling
from rcsc.run.signature import Signature, Values

if TYPE_CHECKING:
    from multiprocessing.connection import Connection


@dataclass(slots=True)
class _Region:
    """A region, and what of it was read and is not recorded yet.

    Attributes:
        stamp: Of the last that was read.
        broken: Whether what was written after that cannot be read.
        lost_ms: Times of those before which something was written that could not be read.
    """

    name: str
    waiting: deque[Image] = field(default_factory=deque)
    stamp: int | None = None
    broken: bool = False
    lost_ms: set[int] = field(default_factory=set)

    def read(self, buffers: SharedMemoryBuffers) -> None:
        """Read what is new."""
        for image in buffers.since(self.name, self.stamp):
            if image is None:
                self.broken = self.stamp is not None
                continue
            if image.now_ms != NO_CYCLE_MS and image.mask:
                if self.broken or (self.stamp is not None and image.stamp != (self.stamp + STEP) % STAMPS):
                    self.lost_ms.add(image.now_ms)
                self.waiting.append(image)
            self.stamp, self.broken = image.stamp, False

    @property
    def unseen(self) -> bool:
        """Whether something was written before what waits that could not be read."""
        return self.waiting[0].now_ms in self.lost_ms if self.waiting else self.broken

    def until(self, now_ms: int) -> Iterator[Image]:
        """Yield what was written in cycles until then, and forget it."""
        while self.waiting and self.waiting[0].now_ms <= now_ms:
            yield self.waiting.popleft()


@dataclass(slots=True)
class SeenLevel:
    """A level as it was seen.

    Attributes:
        values: All leaves and the trace, as the last cycle left them that is recorded.
        now_ms: Time of that cycle.
        period_ms: From one to the next.
    """

    name: str
    sign: Signature
    values: Values = ()
    now_ms: int = NO_CYCLE_MS
    period_ms: int = field(init=False)

    def __post_init__(self) -> None:
        """Find the period."""
        self.period_ms = self.sign.level_of(self.name).period_ms


class Watch:
    """Reads every cycle of every process, and records a tick once all have run it.

    Attributes:
        tick: Ticks that are recorded, as of a `System`.
    """

    def __init__(
        self, description: Description, signs: Mapping[str, Signature], buffers: SharedMemoryBuffers,
        clocks: Clocks, path: Path,
    ) -> None:  # fmt: skip
        self.description, self.tick, self.restarts = description, 0, list[Restarted]()
        self.levels = tuple(SeenLevel(name, sign) for name, sign in signs.items())
        self.buffers = self
        self._memory, self._clocks, self._path = buffers, clocks, path
        self._cycles = {name: _Region(name) for name in signs}
        self._begun = {name: _Region(begun(name)) for name in signs}
        self._outside = {wire.source: _Region(wire.source) for wire in outside_wires(description)}
        self._given: dict[str, tuple[int, Values]] = {}
        self._recorder: Recorder | None = None
        self._events: list[LoggedEvent] = []

    def latest(self, name: str) -> Values | None:
        """Return the latest value of a buffer that no level gives; None before the first."""
        return self._given[name][1] if name in self._given else None

    def note(self, process: str, what: str, now_ms: int) -> None:
        """Record what became of a process, before its next cycle, of then."""
        self._events.append(LoggedEvent(now_ms // self.description.tick_ms + 1, process, what))

    def look(self, end_ms: int | None = None) -> bool:
        """Read what is new, and record the ticks that all have run; tell whether there was one.

        Args:
            end_ms: The time before which all of them lie, where that is known.

        Raises:
            OSError: The log cannot be written.
        """
        clocks = {name: self._clocks.now_ms(name) for name in self._clocks.periods_ms}
        for region in (*self._cycles.values(), *self._begun.values(), *self._outside.values()):
            region.read(self._memory)
        for name, now_ms in clocks.items():
            if now_ms is not None:
                self._clocks.was_read(name, now_ms)
        if self._recorder is None:
            self._recorder = self._opened()
        if self._recorder is None:
            return False
        for event in self._events:
            self._recorder.aside(EVENTS, EVENT_FIELDS, event.tick, event.content)
        self._events.clear()
        running = [now_ms for now_ms in clocks.values() if now_ms is not None]
        until_ms = min(running, default=0 if end_ms is None else end_ms)
        until_ms, before = until_ms if end_ms is None else min(until_ms, end_ms), self.tick
        while self.tick * self.description.tick_ms < until_ms:
            self._record()
        return self.tick > before

    def close(self) -> None:
        """End the log; one without a cycle is there, too."""
        if self._recorder is not None:
            self._recorder.close()

    def _opened(self) -> Recorder | None:
        """Begin the log once every level has said from what it begins."""
        if not all(region.waiting for region in self._begun.values()):
            return None
        for level in self.levels:
            level.values = self._beginning(level.name, self._begun[level.name].waiting.popleft())[1]
        self._path.parent.mkdir(parents=True, exist_ok=True)
        return Recorder(self, self._path)

    def _beginning(self, level: str, image: Image) -> tuple[int, Values]:
        how, *values = self._memory.layout.regions[begun(level)].packed.unpack(image.payload)
        return how, tuple(values)

    def _record(self) -> None:
        """Record the next tick."""
        assert self._recorder is not None
        now_ms = self.tick * self.description.tick_ms
        self.tick += 1
        for name, region in self._begun.items():
            for image in region.until(now_ms):
                how, values = self._beginning(name, image)
                if how == REFUSES:
                    self.note(name, "refused what was set by hand: no cycle may begin with it", now_ms)
                if how in BEGINNINGS:
                    leaves = next(len(level.sign.leaves) for level in self.levels if level.name == name)
                    self.restarts.append(Restarted(name, BEGINNINGS[how], values[:leaves]))
        due = [level for level in self.levels if now_ms % level.period_ms == 0]
        times_ms = {level.name: level.now_ms for level in self.levels}
        ran = [level for level in due if self._ran(level, now_ms, times_ms)]
        for name, region in self._outside.items():
            place = self._memory.layout.places[name]
            for image in region.until(now_ms):
                self._given[name] = image.now_ms, place.packed.unpack(image.payload)
        self._recorder(self, ran)
        self.restarts.clear()

    def _ran(self, level: SeenLevel, now_ms: int, times_ms: Mapping[str, int]) -> bool:
        """Take over what a level's cycle left, and note what is other than in one process; tell whether it had one."""
        assert self._recorder is not None
        region = self._cycles[level.name]
        cycle = next(iter(deque(region.until(now_ms), 1)), None)  # a level has one cycle at a time
        if cycle is None or not cycle.mask & CHECKPOINT:
            why = Gap.UNSEEN if region.unseen else Gap.NOT_RUN
            self._recorder.aside(GAPS + level.name, GAP_FIELDS, self.tick, bytes((why,)))
            return False
        region.lost_ms.discard(cycle.now_ms)
        level.values, taken_ms = self._memory.committed(level.name, cycle)
        level.now_ms = now_ms
        if any(now_ms != self._before_ms(name, times_ms) for name, now_ms in taken_ms.items()):
            fields, packed = taken_layout(tuple(taken_ms))
            ticks = [self._ticks(each) for each in taken_ms.values()]
            self._recorder.aside(TAKEN + level.name, fields, self.tick, packed.pack(*ticks))
        return True

    def _before_ms(self, buffer: str, times_ms: Mapping[str, int]) -> int:
        """Return the time of the latest cycle before this one in which a buffer was given."""
        if buffer in self._outside:
            return self._given[buffer][0] if buffer in self._given else NO_CYCLE_MS
        return times_ms[self._memory.layout.places[buffer].region]

    def _ticks(self, now_ms: int) -> int:
        return 0 if now_ms == NO_CYCLE_MS else now_ms // self.description.tick_ms + 1


def serve_diagnostics(setting: Setting, path: str, told: "Connection", heard: "Connection") -> None:
    """Record the system until it is told that all have ended; send the reason where the log cannot be written."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    with telling(told), attached(setting) as (signs, memory):
        watch = Watch(setting.description, signs, memory, setting.clocks(memory), Path(path))
        nap_s, end_ms = SHORTEST_NAP_S, None
        while end_ms is None and os.getppid() == setting.parent:
            while end_ms is None and heard.poll():
                end_ms = _heard(watch, heard)
            if watch.look(end_ms):
                nap_s = SHORTEST_NAP_S
            elif end_ms is None:
                time.sleep(nap_s)
                nap_s = min(2 * nap_s, LONGEST_NAP_S)
        watch.close()


def _heard(watch: Watch, heard: "Connection") -> int | None:
    """Take what the supervisor says: what became of a process, or the time of the end."""
    with contextlib.suppress(EOFError):
        said = heard.recv()
        if isinstance(said, int):
            return said
        watch.note(*said)
    return None
