"""Replay: every level runs again from the recorded state with the recorded inputs, and must leave what it left then.

A restarted level runs from the state that was recorded of its restart, which must be one that a restart leaves; a level in which
somebody set something, from what was set.

In: a log and a folder of generated executors. Out: moments, and differences in the words of the tables. With another
folder than that of the log it is a what-if: the first difference is where the other tables leave other values; another
line that leaves the same values is none.
"""

import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rcsc.run.adopt import Begun, unlike
from rcsc.run.answers import Answers, told
from rcsc.run.description import BadDescription
from rcsc.run.executors import Executor
from rcsc.run.levels import cycled, put_checked
from rcsc.run.log.queries import Predicate
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.schema import fingerprints
from rcsc.run.log.states import words
from rcsc.run.signature import Leaf, LevelSign, Signature, Value, Values
from rcsc.run.system import Kind, executors, signatures

_ASIDE = frozenset({"table", "line", "assumptions_failed"})


@dataclass(frozen=True, slots=True)
class ReplayDifference:
    """A leaf, or what else a cycle leaves, that is not what it was; in the tables' words."""

    name: str
    then: str
    now: str


@dataclass(frozen=True, slots=True)
class ReplayedCycle:
    """One level's cycle, then and now.

    Attributes:
        line_then: `table line`, as recorded; `line_now` as it matched now.
        restarted: From what state the level had been started again before it; None where it had not.
    """

    level: str
    line_then: str
    line_now: str
    differences: tuple[ReplayDifference, ...]
    recorded: Values
    now: Values
    restarted: Begun | None = None


@dataclass(frozen=True, slots=True)
class ReplayMoment:
    """All levels that ran in a tick."""

    tick: int
    cycles: tuple[ReplayedCycle, ...]

    @property
    def differs(self) -> bool:
        """Whether anything is not what it was."""
        return any(cycle.differences for cycle in self.cycles)


@dataclass(slots=True)
class _Again:
    """A level that runs again.

    Attributes:
        same: Whether the signature is the recorded one, so that bytes can be compared.
        aside: What is shown but makes no difference alone: in a what-if, which line it was.
        lacking: What the log has and these tables have not: leaves, and values that were put as the initial one.
        unlogged: Leaves that these tables have and the log has not.
    """

    logged: LoggedLevel
    sign: Signature
    level: LevelSign
    executor: Executor
    same: bool
    packed: struct.Struct
    aside: frozenset[str]
    inputs: frozenset[int] = frozenset()
    carried: tuple[tuple[int, int], ...] = ()
    lacking: dict[str, None] = field(default_factory=dict)
    unlogged: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        then = self.logged.sign
        self.inputs = frozenset(at for at, leaf in enumerate(then.leaves) if leaf.kind == "input")
        self.carried = tuple(
            (then.index[leaf.name], at) for at, leaf in enumerate(self.sign.leaves) if leaf.name in then.index
        )
        gone = (leaf.name for leaf in then.leaves if leaf.name not in self.sign.index)
        self.lacking = dict.fromkeys(f"{self.logged.name}.{name}" for name in gone)
        self.unlogged = tuple(
            f"{self.logged.name}.{leaf.name}" for leaf in self.sign.leaves if leaf.name not in then.index
        )

    def cycle(self, at: int, answers: Answers) -> ReplayedCycle | None:
        """Run the cycle whose record has this place; None where it is not known from what it began, as for the first record.

        Raises:
            StateTableError: The tables are not proved for the recorded state, or an extern procedure failed.
        """
        if at < 1 or not self.logged.follows(at):
            return None
        track = self.logged.track
        recorded = track.layout.unpack(track.packed[at])
        restart = self.logged.restarted(at)
        self._put(track.layout.unpack(track.packed[at - 1]) if restart is None else restart.values, recorded)
        told(self.executor, answers)
        cycled(self.logged.name, self.executor)
        now = self.executor.values()
        equal = self.same and self.packed.pack(*now) == track.packed[at]
        return ReplayedCycle(
            self.logged.name,
            _line(self.logged.sign, self.logged.level, recorded),
            _line(self.sign, self.level, now),
            (*self._begun(at), *(() if equal else self._differences(recorded, now))),
            recorded,
            now,
            None if restart is None else restart.begun,
        )

    def _begun(self, at: int) -> Iterator[ReplayDifference]:
        """Yield what the restart before a cycle is said to have left and does not leave."""
        restart, track = self.logged.restarted(at), self.logged.track
        if restart is None or not self.same:
            return
        given, leaves = track.layout.unpack(track.packed[at - 1]), self.sign.leaves
        wrong: Mapping[int, Value] = {}  # by hand anything may be set that the tables are proved for
        if restart.begun is Begun.ANEW:
            wrong = unlike(self.sign, restart.values, given)
        elif restart.begun is Begun.CHECKPOINT:
            state = struct.pack(self.sign.form(range(len(leaves))), *restart.values)
            by_hand = restart.values in (one.values for one in self.logged.restarts if one.by_hand)
            known = by_hand or any(content.startswith(state) for content in track.packed[:at])  # of any cycle
            wrong = {} if known else dict(enumerate(given[: len(leaves)]))
        for place, value in wrong.items():
            then, now = (leaves[place].shown(each) for each in (restart.values[place], value))
            if then != now:
                yield ReplayDifference(leaves[place].name, then, now)

    def _put(self, before: Values, recorded: Values) -> None:
        """Put the state before the cycle, and its inputs; keep what the log does not hold.

        Raises:
            BadState: The tables are not proved for it.
        """
        start = [
            recorded[at] if at in self.inputs else before[at] for at in range(len(self.logged.sign.leaves))
        ]
        if self.same:
            put_checked(self.logged.name, self.sign, self.executor, tuple(start))
            return
        values = list(self.executor.values()[: len(self.sign.leaves)])
        for source, target in self.carried:
            then, now = self.logged.sign.leaves[source], self.sign.leaves[target]
            values[target] = _translated(then, now, start[source])
            if then.members != now.members and then.shown(start[source]) not in now.members:
                self.lacking[f"{self.logged.name}.{then.name} = {then.shown(start[source])}"] = None
        put_checked(self.logged.name, self.sign, self.executor, tuple(values))

    def _differences(self, recorded: Values, now: Values) -> tuple[ReplayDifference, ...]:
        then_words = words(self.logged.sign, self.logged.level, recorded)
        now_words = words(self.sign, self.level, now)
        differences = tuple(
            ReplayDifference(name, then, now_words[name])
            for name, then in then_words.items()
            if name in now_words and now_words[name] != then
        )
        if any(difference.name not in self.aside for difference in differences):
            return differences
        return tuple(self._unspoken(recorded, now)) if self.same and not self.aside else ()

    def _unspoken(self, recorded: Values, now: Values) -> Iterator[ReplayDifference]:
        """Yield what differs where both have the same words, as a bit of no assumption."""
        names = (*(leaf.name for leaf in self.sign.leaves), "line", "fault", "fault_at", *self.sign.failed)
        for name, form, *both in zip(names, self.packed.format[1:], recorded, now, strict=True):
            then, here = (struct.pack(f"<{form}", value).hex() for value in both)
            if then != here:
                yield ReplayDifference(name, f"0x{then}", f"0x{here}")


def _translated(then: Leaf, now: Leaf, value: Value) -> Value:
    """Return a recorded value in the other program's numbers; the initial value for a member it lacks."""
    if then.members == now.members:
        return value
    member = then.shown(value)
    return now.members.index(member) if member in now.members else now.initial


def _line(sign: Signature, level: LevelSign, values: Values) -> str:
    return ", ".join(f"{table} line {line or 'none'}" for table, line in sign.lines_of(level, values))


@dataclass(slots=True)
class Replay:
    """A log that runs again, at any tick, forwards and backwards.

    Attributes:
        tick: Where it is now.
        unchanged: Whether the executors are generated from the tables that the log was recorded with.
    """

    log: Log
    generated: Path
    kind: Kind = "c"
    tick: int = 0
    unchanged: bool = True
    _levels: tuple[_Again, ...] = field(default=())

    def __post_init__(self) -> None:
        """Builds the executors.

        Raises:
            BadDescription: The generated programs do not fit the log, or are not as a log says that bears their digest.
            NotBuilt: The C could not be built.
        """
        system = self.log.system(self.generated)
        signs = signatures(system, fitting=False)  # each level runs alone
        by_level = executors(system, signs, self.kind)
        self.unchanged = fingerprints(system) == dict(self.log.programs)
        for level in self.log.levels:
            if self.unchanged and signs[level.name] != level.sign:
                raise BadDescription(
                    f"the log says of level `{level.name}` what these tables are not, and bears their digest"
                )
        self._levels = tuple(
            _again(level, signs[level.name], by_level[level.name], self.unchanged)
            for level in self.log.levels
        )
        self.tick = self.log.first

    def go(self, tick: int) -> ReplayMoment:
        """Run the cycles of a tick again.

        Raises:
            IndexError: The log does not hold it.
        """
        if tick not in self.log.ticks:
            raise IndexError(tick)
        self.tick = tick
        cycles = (
            level.cycle(at, self._answers(tick, level.logged.name))
            for level in self._levels
            if (at := level.logged.track.place(tick)) >= 0 and level.logged.track.ticks[at] == tick
        )
        return ReplayMoment(tick, tuple(cycle for cycle in cycles if cycle is not None))

    def _answers(self, tick: int, level: str) -> Answers:
        """What extern procedures gave in a cycle of a finding; where the log keeps none, they are called."""
        told = None if self.log.finding is None else self.log.finding.cycles.get((tick, level))
        return () if told is None else told.answers

    def moments(self) -> Iterator[ReplayMoment]:
        """Every tick from the first."""
        return (self.go(tick) for tick in self.log.ticks)

    @property
    def lacking(self) -> tuple[str, ...]:
        """Return what the log has and these tables lack, as far as it ran: it was not compared, or put as initial."""
        return tuple(name for level in self._levels for name in level.lacking)

    @property
    def unlogged(self) -> tuple[str, ...]:
        """Return what these tables have and the log lacks: it was not compared."""
        return tuple(name for level in self._levels for name in level.unlogged)

    def first_difference(self) -> ReplayMoment | None:
        """The first tick in which a level leaves something else than was recorded; None for none."""
        return next((moment for moment in self.moments() if moment.differs), None)


def _again(logged: LoggedLevel, sign: Signature, executor: Executor, unchanged: bool) -> _Again:
    level = sign.level_of(logged.name)
    aside = frozenset() if unchanged else _ASIDE - logged.sign.index.keys()
    return _Again(logged, sign, level, executor, sign == logged.sign, sign.packed, aside)


def find(
    log: Log,
    wanted: Predicate,
    start: int | None = None,
    more: Callable[[int], Mapping[str, Values]] = lambda _: {},
) -> int | None:
    """The first tick from `start` on in which the recorded values are as wanted; None for none. `more` gives values beside them."""
    for tick in log.ticks if start is None else range(max(start, log.first + 1), log.last + 1):
        moment = {
            level.name: values for level in log.levels if (values := level.track.latest(tick)) is not None
        }
        if wanted({**moment, **more(tick)}):
            return tick
    return None
