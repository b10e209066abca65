"""An episode, run: the levels on generated executors with what stands outside, what happens to them, and everything that watches.

In: an episode and the description of a system, compiled. Out: an `EpisodeOutcome`; with a log, every cycle.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeAlias

from rcsc.base.host.files.names import shown
from rcsc.run.episodes.cycle import MOST_MESSAGE, Broken, Cycle
from rcsc.run.episodes.episode import Episode, Reading, harm_told
from rcsc.run.episodes.harm import Explanations, HarmedMemory, Held
from rcsc.run.episodes.operator import WAITING, EpisodeOperator, operator, value_of
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome, Excused
from rcsc.run.episodes.properties import AGREE, ENDS, NO_ERROR, properties, was_refused
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.episodes.proved.watch import ProvedHolds
from rcsc.run.episodes.stand import Field, Stand, stand
from rcsc.run.episodes.subordinates import subordinates
from rcsc.run.executors import refuse_unproved
from rcsc.run.faults import faults_of, switch
from rcsc.run.levels import BadState, RunningLevel, StateTableError, running_level
from rcsc.run.log.across import AcrossWatch
from rcsc.run.orders.numbered import Latest
from rcsc.run.orders.roles import FAILED
from rcsc.run.orders.together import Together
from rcsc.run.plant.bind import PlantFailed
from rcsc.run.plant.staged import Staged
from rcsc.run.plant.staging import StageOrder, staged
from rcsc.run.signature import STOPPED, Value, Values
from rcsc.run.system import Outside, System, check_answered, executors

COOL_TICKS = 30
"""Watched after the last order has ended."""
Around: TypeAlias = tuple[Staged, EpisodeOperator]
"""What stands around the levels of an episode: all that is outside, and who gives the orders."""
RAISES = "the plant raises nothing"
RESTARTS = "starts anew"


def run(
    episode: Episode, system: str | Path, log: Path | None = None, claims: Claims = NOTHING
) -> EpisodeOutcome:
    """Run an episode to its end, with every property watching.

    Args:
        episode: What to run.
        system: The description; its generated executors are used as they are.
        log: Where to keep every cycle (MCAP); none by default.
        claims: What was proved of the system, which is watched, too.

    Raises:
        CodedError: The system or its plant is not in order; nothing has moved.
        ValueError: The episode names what the system has not.
        OSError: The log cannot be written.
    """
    return Loop(episode, stand(Path(system)), claims).finish(log)


def held(its: Stand, readings: tuple[Reading, ...]) -> Iterator[tuple[Field, Held]]:
    """Yield the fields that readings hold, with their places.

    Raises:
        ValueError: There is no such field, or the value is none of its type.
    """
    fields = {known.name: known for known in its.fields}
    for reading in readings:
        its_field = fields.get(reading.field)
        if its_field is None:
            raise ValueError(f"`{reading.field}` is no field from outside that can be held")
        value = value_of(its_field.leaf, reading.value)
        if its_field.refuses(value) != reading.refused:
            said = "is refused" if reading.refused else "can be read"
            raise ValueError(f"`{reading.field}` = {reading.value} is none that {said}")
        yield (
            its_field,
            Held(its_field.buffer, its_field.place, value, reading.first_tick, reading.last_tick),
        )


def check(episode: Episode, system: Path) -> None:
    """Hold an episode against the system that it is to run on.

    Raises:
        CodedError: The system or its plant is not in order.
        ValueError: The episode names a level, buffer, field, fault or command that is not there.
    """
    _checked(episode, stand(system))


def check_names(episode: Episode, its: Stand) -> None:
    """Hold the buffers and levels that an episode names against a system.

    Raises:
        ValueError: One is not there.
    """
    for harm in episode.harms:
        if harm.buffer not in its.buffers:
            raise ValueError(f"there is no buffer {shown(harm.buffer)}")
    for restart in episode.restarts:
        if restart.level not in its.signs:
            raise ValueError(f"there is no level {shown(restart.level)}")


def _checked(
    episode: Episode, its: Stand, around: Around | None = None
) -> tuple[Around, list[tuple[Field, Held]]]:
    if around is None:
        stage = staged(StageOrder(str(its.path), episode.plant, seed=episode.seed), its.system, its.signs)
        around = stage, operator(its.served, episode.orders)
    check_names(episode, its)
    known = faults_of(around[0].outside)
    switched = (one.fault for one in episode.switches)
    for name in (*switched, *(fault for order in episode.orders for fault in order.faults)):
        if name not in known:
            raise ValueError(f"the plant has no fault `{name}`")
    return around, list(held(its, episode.readings))


def _windows(episode: Episode) -> Iterator[tuple[int, int]]:
    """Yield the ticks from which to which each fault is at work."""
    for harm in episode.harms:
        yield harm.first_tick, harm.last_tick + (harm.ticks if harm.kind == "late" else 0)
    yield from ((reading.first_tick, reading.last_tick) for reading in episode.readings)
    yield from ((switched.first_tick, switched.last_tick) for switched in episode.switches)
    for restart in episode.restarts:
        yield restart.tick, restart.tick


@dataclass(slots=True)
class _Seen:
    """What was seen of a run so far."""

    findings: dict[str, EpisodeFinding] = field(default_factory=dict)
    excused: dict[str, Excused] = field(default_factory=dict)
    lines: set[tuple[str, int, int]] = field(default_factory=set)
    staged: set[tuple[str, str, str]] = field(default_factory=set)


@dataclass(frozen=True, slots=True)
class _Ordered:
    """Switches the plant's faults once the orders of a tick are given, and before the plant takes its step."""

    switch: Callable[[int], None]

    def step(self, tick: int, _: Latest) -> Mapping[str, Values]:
        """Run one tick."""
        self.switch(tick)
        return {}


class Loop:
    """A running episode.

    Args:
        episode: What to run.
        its: The system.
        claims: What was proved of it.
        around: A plant and an operator of one's own; None for those that the description and the episode name.

    Attributes:
        system: The running system.
        cycle: What the properties saw last.
        watching: The properties, in order.

    Raises:
        CodedError, ValueError: As `check`.
    """

    def __init__(
        self, episode: Episode, its: Stand, claims: Claims = NOTHING, around: Around | None = None
    ) -> None:
        self.episode, self._its = episode, its
        around, fields = _checked(episode, its, around)
        self._stage, self.operator = around
        refuse_unproved(its.system)
        check_answered(its.system, self._stage.queries)
        first: dict[str, tuple[Value, ...]] = {
            buffer.name: tuple(leaf.initial for leaf in buffer.leaves) for buffer in its.outside
        }
        self._memory = HarmedMemory(episode.harms, (one for _, one in fields), first)
        self._held = fields
        by_level = executors(its.system, its.signs, episode.executor)
        levels = tuple(
            running_level(spec, its.system, its.signs[spec.name], by_level[spec.name], self._stage.queries)
            for spec in its.system.levels
        )
        others = self._stage.outside or subordinates(its, episode.seed)
        parts: tuple[Outside, ...] = (self.operator, _Ordered(self._switch), *others)
        outside = Together(None, parts, first, frozenset(its.buffers))
        self.system = System(its.system, levels, (outside,), self._memory, watch=[self._after])
        self.cycle = Cycle(
            {level.name: level for level in levels}, self._stage.plants, self.operator, self._memory.said,
            {level.name: level.initial for level in levels}, {level.name: level.initial for level in levels},
        )  # fmt: skip
        self.watching = properties(its, its.system.within, claims)
        self._across = AcrossWatch.of(its.across, its.system, its.signs)
        self._stood: dict[str, Values | None] = {}
        self._explained, self._seen = Explanations(its), _Seen()
        self._on = frozenset[str]()
        self._digest, self._end, self._cool = hashlib.blake2b(digest_size=16), "", COOL_TICKS
        # where no plant is given, a reading is what comes from outside, and no fault
        real = episode if self._stage.outside else replace(episode, readings=())
        self._windows = tuple(_windows(real))
        self._packed = {level.name: level.sign.packed for level in levels}
        self._by = {level.name: level.sign.index.get(level.level.by, -1) for level in levels}

    @property
    def over(self) -> bool:
        """Whether everything was ordered and has ended, and was watched for a while."""
        waited = self.system.tick >= self.episode.ticks
        at_end = bool(self._end) or any(getattr(part, "over", False) for part in self._stage.outside)
        return at_end or (self.operator.over and self._cool <= 0 and waited)

    @property
    def findings(self) -> tuple[EpisodeFinding, ...]:
        """The first of each property that did not hold so far, but what a fault explains."""
        return tuple(self._seen.findings.values())

    def finish(self, log: Path | None = None) -> EpisodeOutcome:
        """Run to the end, and keep every cycle where `log` says where.

        Raises:
            OSError: The log cannot be written.
        """
        if log is not None:
            from rcsc.run.log.recorder import Recorder  # of an extra

            with Recorder(self.system, log) as recorder:
                self.system.watch.insert(0, recorder)
                return self.finish()
        while not self.over:
            self.step()
        return self.outcome()

    def step(self) -> None:
        """Run one tick."""
        tick = self.system.tick
        self._memory.begin(tick)
        self._stood = {name: self._memory.latest(name) for name in self._across.buffers}
        self.cycle.unscheduled = self.cycle.unscheduled or self._unscheduled(tick)
        self._switch(tick)
        restarted = sorted(one.level for one in self.episode.restarts if one.tick == tick)
        self.cycle.restarted = frozenset(restarted)
        for name in restarted:
            self._restart(name)
        self.cycle.faulty = bool(self._on) or any(first <= tick <= last for first, last in self._windows)
        self.cycle.refused = self._to_refuse(tick)
        self._cool = self._cool - 1 if self.operator.over else COOL_TICKS
        try:
            self.system.step()
        except PlantFailed as error:
            self._find(Broken(RAISES, str(error)), tick + 1)
            self._end = "plant failed"
        except StateTableError as error:
            if not self._expected(tick):
                self._find(Broken(NO_ERROR, str(error)), tick + 1)
                self._end = "state-table error"

    def _expected(self, tick: int) -> bool:
        """Whether the tick was done, and every level that faulted was misled or given what it must refuse."""
        faulted = [level for level in self.cycle.ran if level.fault]
        return self.system.tick == tick + 1 and all(
            was_refused(self.cycle, level) or level.name in self._explained.misled for level in faulted
        )

    def outcome(self) -> EpisodeOutcome:
        """Return the outcome so far."""
        lines = set(self._seen.staged)
        for name, by, at in self._seen.lines:
            sign = self._its.signs[name]
            level = next(level for level in sign.levels if level.name == name)
            table = level.table or level.tables.get(by, "?")
            lines.add((name, table, sign.tables[table][at] if table in sign.tables and at >= 0 else ""))
        ends = [*self.operator.ends]
        ends += [
            line.end(WAITING, "", self.system.tick - 1)
            for line in self.operator.lines
            if line.given is not None and line.ended is None
        ]
        return EpisodeOutcome(
            tuple(ends), self.findings, self._end or self._ended(), self.system.tick,
            frozenset(lines), self._digest.hexdigest(), tuple(self._seen.excused.values()),
        )  # fmt: skip

    def _ended(self) -> str:
        last = self.operator.ends[-1] if self.operator.ends else None
        if not self.over:
            return "running"
        return f"failed:{last.reason}" if last is not None and last.state == FAILED else "done"

    # --- what goes wrong ---

    def _switch(self, tick: int) -> None:
        """Have on, of the plant's faults, those of this tick and of the orders under way."""
        switches = self.episode.switches
        wanted = self.operator.faults.union(
            one.fault for one in switches if one.first_tick <= tick <= one.last_tick
        )
        for name in sorted(self._on ^ wanted):
            switch(self._stage.outside, name, on=name in wanted)
        self._on = wanted

    def _restart(self, name: str) -> None:
        try:
            self.system.restart(name, written=self._memory.written())
        except BadState as error:
            self._find(Broken(f"{name}: {RESTARTS}", str(error), name), self.system.tick + 1)
        level = self.system.level(name)
        self.cycle.before[name] = self.cycle.left[name] = level.values

    def _to_refuse(self, tick: int) -> Mapping[str, frozenset[str]]:
        """Return leaves that hold what their level must refuse, by level; of several readings of a field the last holds."""
        held = {
            (one.buffer, one.place): (its_field, one)
            for its_field, one in self._held
            if one.first_tick <= tick <= one.last_tick
        }
        leaves: dict[str, set[str]] = {}
        for its_field, one in held.values():
            if its_field.refuses(one.value) and self._memory.latest(one.buffer) is not None:
                leaves.setdefault(its_field.level, set()).add(its_field.leaf.name)
        return {level: frozenset(names) for level, names in leaves.items()}

    # --- what is seen ---

    def _after(self, system: System, ran: tuple[RunningLevel, ...]) -> None:
        cycle = self.cycle
        for level in ran:
            values = level.values
            self._digest.update(self._packed[level.name].pack(*values))
            by = self._by[level.name]
            self._seen.lines.add(
                (level.name, -1 if by < 0 else int(values[by]), int(values[len(level.sign.leaves)]))
            )
            if level.level.stages:
                before = level.sign.lines_before(level.level, values)
                self._seen.staged.update((level.name, table, line) for table, line in before)
        cycle.tick, cycle.ran = system.tick, ran
        cycle.broken = tuple(self._across.tick({level.name: level.values for level in ran}, self._stood))
        self._explained.note({name: self._why(name) for name in self._memory.changed}, self._memory.changed)
        # all watch before any finding is made: a finding names the trusted facts that this cycle broke, too
        for broken in [broken for watcher in self.watching for broken in watcher.watch(cycle)]:
            self._find(broken, system.tick)
        for level in ran:
            cycle.left[level.name] = level.values
            if level.fault in (0, STOPPED):
                cycle.before[level.name] = level.values

    def _unscheduled(self, tick: int) -> str:
        """Return the fault that is at work in a buffer between levels from this tick on, in words; empty for none."""
        signs, readers = self._its.signs, self._its.system.readers()
        for harm in self.episode.harms:
            ends = (harm.buffer, *readers.get(harm.buffer, ()))
            among = [end.partition(".")[0] in signs for end in ends]
            if harm.first_tick == tick and among[0] and any(among[1:]):
                return harm_told(harm)
        return ""

    def _why(self, buffer: str) -> str:
        """Return the fault that changed a buffer, in words."""
        tick = self.system.tick - 1
        for harm in self.episode.harms:
            if (harm.buffer, harm.kind) == (buffer, "stale") and harm.first_tick <= tick <= harm.last_tick:
                return f"buffer `{buffer}` is stale in ticks {harm.first_tick} .. {harm.last_tick}"
        for reading, (at, one) in zip(self.episode.readings, self._held, strict=True):
            forged = at.buffer == buffer and at.place in self._memory.changed[buffer]
            if forged and one.first_tick <= tick <= one.last_tick:
                return f"`{reading.field}` is {reading.value}"
        return f"buffer `{buffer}`"

    def _untrusted(self, level: str) -> str:
        """Return what the episode has broken of what was taken for granted where a level was proved; "" for nothing."""
        proved = (watcher for watcher in self.watching if isinstance(watcher, ProvedHolds))
        return next((fact for watcher in proved for fact in watcher.untrusted(level)), "")

    def _find(self, broken: Broken, tick: int) -> None:
        name, message = broken.property, broken.message
        if name == NO_ERROR and (fact := self._untrusted(broken.level)):
            message = f"{message}; the episode has broken what its proof takes for granted: {fact}"
        message = message[:MOST_MESSAGE]
        if broken.property.endswith(ENDS):
            self._end = "hang"
            if not self._stage.outside:
                return  # nothing outside moves, for which a command may wait
        if name == AGREE:
            self._end = "executors differ"  # no input explains that
        because = "" if name == AGREE else self._explained.because(broken)
        if broken.outside:
            if not because and not self._stage.outside:
                because = "the episode gives what no plant says"
            if not broken.across:
                self._explained.misled.setdefault(broken.level, f"{name} was broken in cycle {tick}")
        if because:
            self._seen.excused.setdefault(name, Excused(name, tick, message, because))
        else:
            self._seen.findings.setdefault(name, EpisodeFinding(name, tick, message))
