"""Requirements across levels, watched in a run: what their names mean, and all levels a tick at a time.

In: a description, the programs of its levels, their values. Out: the program of the file of requirements; in each tick, what breaks one.

What is read of a level is what its last cycle left; of an input, what it took last: a refused value is none. What a party outside gives is
what stands in its buffer while the tick's cycles take it, and what it takes is what the level gave last. A tick in which a level does not
run leaves it as it was; where it begins anew, it is as it was until its next cycle. That is what `rcsc.compose.together` proves it of.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import BEFORE, Program, Property, Value
from rcsc.lang.over_time import Watch
from rcsc.lang.project import Loaded, load
from rcsc.lang.resolve.across import Named, Parties, named, part_of, resolve_across
from rcsc.run.description import BadDescription, Description
from rcsc.run.log.schema import Gap
from rcsc.run.signature import FAULTS, Leaf, Signature, Values

if TYPE_CHECKING:
    from rcsc.run.log.read import Log, LoggedLevel

REFUSED = FAULTS.index("input refused")
MOST_SEEN = 10_000
"""Ticks that are remembered of a run."""


# --- words -------------------------------------------------------------------------------------


def stated_across(system: Description, programs: Mapping[str, Program]) -> tuple[Program, Loaded] | None:
    """Return the requirements of a system, and the files that they were read from; None where it names none.

    Raises:
        BadDescription: The file is missing, or not in order.
    """
    if system.requirements is None:
        return None
    file = os.path.relpath(system.requirements)
    loaded = load([file])
    program = (
        resolve_across(loaded.roots[0], loaded, parties(system, programs), system.tick_ms)
        if loaded.roots
        else ()
    )
    if isinstance(program, Program):
        return program, loaded
    raise BadDescription(f"the file of requirements across levels is not in order: see `rcsc check {file}`")


def parties(system: Description, programs: Mapping[str, Program]) -> Parties:
    """Return what each level has, and each party outside: what it gives to levels, and what it takes of them."""
    every: dict[str, dict[str, Named]] = {
        level: {declared.name: named(program, declared) for declared in program.declared}
        for level, program in programs.items()
    }
    for party, one in _outside(system, programs):
        every.setdefault(party, {}).setdefault(one.name, one)
    return {party: tuple(variables.values()) for party, variables in every.items()}


def _outside(system: Description, programs: Mapping[str, Program]) -> Iterator[tuple[str, Named]]:
    """Yield each variable of a party outside, of the type that the level at the other end of its buffer has."""
    for wire in system.wires:
        for end, other, given in ((wire.source, wire.target, True), (wire.target, wire.source, False)):
            (party, _, name), (level, _, variable) = end.partition("."), other.partition(".")
            if party in programs or level not in programs or "." in name:
                continue
            declared = part_of(programs[level], variable)
            if declared is not None:
                yield party, named(programs[level], declared, name, given=given)


# --- values ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Place:
    """Where a name of a requirement is found.

    Attributes:
        leaf: As the level at that end has it.
        levels: Of whose values it is one, and where there: of a level's own its own, else of those that take it from the buffer.
        buffer: In which buffer it stands, where it comes from outside; and `at`, where there.
    """

    leaf: Leaf
    levels: tuple[tuple[str, int], ...]
    buffer: str = ""
    at: int = 0


def places_of(stated: Property, system: Description, signs: Mapping[str, Signature]) -> dict[str, Place]:
    """Return where the names that a requirement reads are found, those that the run has."""
    found = {name: _place(name, system, signs) for name in reads(stated)}
    return {name: place for name, place in found.items() if place is not None}


def _place(name: str, system: Description, signs: Mapping[str, Signature]) -> Place | None:
    """Return where a name is found; None where the run has nothing of it."""
    level, _, leaf = name.partition(".")
    if level in signs:
        return _of(signs, level, leaf)
    for wire in system.wires:
        for end, other, given in ((wire.source, wire.target, True), (wire.target, wire.source, False)):
            level, _, variable = other.partition(".")
            if level not in signs or (name != end and not name.startswith(f"{end}.")):
                continue
            found = _of(signs, level, variable + name.removeprefix(end))
            if found is None or not given:
                return found
            at = found.levels[0][1] - signs[level].record(variable).start
            readers = (target.partition(".") for target in system.readers()[end])
            taken = tuple(
                (reader, signs[reader].record(input_).start + at)
                for reader, _, input_ in readers
                if reader in signs
            )
            return Place(found.leaf, taken, end, at)
    return None


def _of(signs: Mapping[str, Signature], level: str, leaf: str) -> Place | None:
    at = signs[level].index.get(leaf)
    return None if at is None else Place(signs[level].leaves[at], ((level, at),))


@dataclass(slots=True)
class AcrossWatch:
    """Requirements across levels that are watched as a run goes on.

    Attributes:
        places: Where each name that they read is found.
        now: What each is now.
    """

    watches: Sequence[Watch]
    signs: Mapping[str, Signature]
    places: Mapping[str, Place]
    now: dict[str, Value] = field(init=False)
    _reads: dict[str, tuple[str, ...]] = field(init=False)
    _seen: dict[tuple[str, Values, Values], tuple[dict[str, Value], bool]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.now = {name: place.leaf.initial for name, place in self.places.items()}
        self._reads = {watch.stated.name: reads(watch.stated) for watch in self.watches}

    @classmethod
    def of(cls, wanted: Iterable[Property], system: Description, signs: Mapping[str, Signature]) -> Self:
        """Watch requirements of a system whose levels have these signatures, but those that read what it lacks."""
        watches, places = list[Watch](), dict[str, Place]()
        for stated in wanted:
            found = places_of(stated, system, signs)
            if len(found) == len(reads(stated)):
                watches.append(Watch(stated))
                places |= found
        return cls(watches, signs, places)

    @property
    def buffers(self) -> tuple[str, ...]:
        """The buffers from outside that they read."""
        return tuple(dict.fromkeys(place.buffer for place in self.places.values() if place.buffer))

    def stand(self, level: str, values: Values) -> None:
        """Note what a level begins with, or was set to by hand."""
        self._take({level: values}, {}, frozenset())

    def begin(self) -> None:
        """Begin anew with the next tick: nobody knows what was before it."""
        for watch in self.watches:
            watch.begin()

    def tick(
        self, ran: Mapping[str, Values], stood: Mapping[str, Values | None]
    ) -> Iterator[tuple[Property, str]]:
        """Take a tick; yield what it breaks, with the values that show it, in words.

        Args:
            ran: The values of each level that ran in it, as it left them.
            stood: What stood in buffers from outside when it began; None where nothing did.
        """
        before = dict(self.now)
        refused = frozenset(
            level for level, values in ran.items() if self.signs[level].fault(values) == REFUSED
        )
        self._take(ran, stood, refused)
        for watch in self.watches:
            if not self._keeps(watch, before):
                yield watch.stated, self._shown(watch.stated)

    def _keeps(self, watch: Watch, before: Mapping[str, Value]) -> bool:
        """Return whether the tick keeps a requirement; most ticks of a run are like one before."""
        names = self._reads[watch.stated.name]
        values = (*(before[name] for name in names), *(self.now[name] for name in names))
        tick = watch.stated.name, tuple(watch.state.values()), values
        if tick not in self._seen:
            kept = watch.keeps(before, self.now)
            if len(self._seen) < MOST_SEEN:
                self._seen[tick] = watch.state, kept
            return kept
        watch.state, kept = self._seen[tick]
        return kept

    def _take(
        self, ran: Mapping[str, Values], stood: Mapping[str, Values | None], refused: frozenset[str]
    ) -> None:
        for name, place in self.places.items():
            if place.buffer:
                taken = [ran[level][at] for level, at in place.levels if level in ran]
                buffer = stood.get(place.buffer)
                given = taken[:1] if taken or buffer is None else [buffer[place.at]]
                self.now[name] = _admitted(place.leaf, given[0], self.now[name]) if given else self.now[name]
                continue
            (level, at), *_ = place.levels
            if level in ran and not (place.leaf.kind == "input" and level in refused):
                self.now[name] = ran[level][at]

    def _shown(self, stated: Property) -> str:
        words = (
            f"`{name}` = {self.places[name].leaf.shown(self.now[name])}" for name in self._reads[stated.name]
        )
        return ", ".join(words) or "at any values"


def reads(stated: Property) -> tuple[str, ...]:
    """Return the names that a requirement reads, each once."""
    return tuple(dict.fromkeys(name.removeprefix(BEFORE) for name in spoken_of(stated)))


def _admitted(leaf: Leaf, given: Value, last: Value) -> Value:
    """Return what was given as a value of its type: moved to the edge where it is clamped; what is refused is none, and leaves the last."""
    low, high = (0, len(leaf.members) - 1) if leaf.members else (leaf.low, leaf.high)
    if low is None or high is None or low <= given <= high:
        return given
    if not leaf.clamp or given != given:  # noqa: PLR0124  # not a number
        return last
    return type(given)(min(max(given, low), high))


# --- logs --------------------------------------------------------------------------------------


@dataclass(slots=True)
class AcrossTrack:
    """Requirements across levels over the ticks of a log, watched as they come.

    Attributes:
        looked_at: The last tick that was.
    """

    watch: AcrossWatch
    looked_at: int = -1
    _at: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, log: "Log", wanted: Iterable[Property]) -> Self:
        """Watch requirements on the levels of a log, but those that read what it lacks."""
        return cls(AcrossWatch.of(wanted, log.system(), {level.name: level.sign for level in log.levels}))

    def further(self, log: "Log") -> Iterator[tuple[int, Property, str]]:
        """Yield each tick that breaks a requirement, with it and the values that show it, of those that were not looked at yet."""
        if not self.watch.watches:
            return
        if not self._at:
            self.looked_at = log.first
            self._at = {level.name: 1 for level in log.levels}
            for level in log.levels:
                self.watch.stand(level.name, level.track.layout.unpack(level.track.packed[0]))
        known = {name: log.buffers[name] for name in self.watch.buffers if name in log.buffers}
        for tick in range(self.looked_at + 1, log.last + 1):
            self.looked_at = tick
            ran, unseen = dict[str, Values](), False
            for level in log.levels:
                self._set(level, tick)
                ran |= self._ran(level, tick)
                unseen = unseen or level.gaps.get(tick) is Gap.UNSEEN
            broken = list(
                self.watch.tick(ran, {name: track.latest(tick - 1) for name, track in known.items()})
            )
            if unseen:
                self.watch.begin()
                continue
            yield from ((tick, stated, shown) for stated, shown in broken)

    def _ran(self, level: "LoggedLevel", tick: int) -> dict[str, Values]:
        """Return what a level left in a tick, if it ran in it."""
        at, track = self._at[level.name], level.track
        if at >= len(track.ticks) or track.ticks[at] != tick:
            return {}
        self._at[level.name] = at + 1
        return {level.name: track.layout.unpack(track.packed[at])}

    def _set(self, level: "LoggedLevel", tick: int) -> None:
        for restart in level.restarts:
            if restart.tick == tick and restart.by_hand:
                self.watch.stand(level.name, restart.values)
