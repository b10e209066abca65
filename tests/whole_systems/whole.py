"""A whole system of levels with its real buffers: what can happen to it, whatever the delay, and what breaks then.

In: the roles of all levels, the wires between them, and what is claimed of each level. Out: what breaks (`searched`). No contract stands
between the levels, and nothing is left out that a system of `rcsc.run` may meet (`Event`): a level runs at any moment, takes from outside
whatever is in range or refused, calls what gives any result, ends early, begins anew (`adopt`, as the running system does), publishes after
each cycle whatever its fault; what is published is seen at any moment, or never. Orders are seen at once: one that is seen late is one
that is seen in time by a level that runs late.

Each event has a rank (`Event.rank`). States are listed by the greatest rank on the way to them, the least first, so that a claim that
trusts that nothing is refused is held against the runs in which nothing is. Of most systems only some states are listed: what breaks there
breaks.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from random import Random
from typing import TypeAlias

from rcsc.compose.contract.claims import SAFE
from tests.small_hierarchies.world import NUMBERS
from tests.whole_systems.part import Claimed, Event, Move, Part, State

GAP = 10
"""Between numbers that follow each other, so that none is the successor of another by accident."""


@dataclass(frozen=True, slots=True)
class Wire:
    """A buffer between two levels, by their places: a record at both ends.

    Attributes:
        at_once: Whether what is published is seen at once: an order.
    """

    source: int
    given: tuple[str, ...]
    target: int
    taken: tuple[str, ...]
    at_once: bool


@dataclass(frozen=True, slots=True)
class Now:
    """A state of the system: each level's, what stands in each buffer, None before the first, and what is seen of it."""

    levels: tuple[State, ...]
    stands: tuple[State | None, ...]
    seen: tuple[State, ...]

    @property
    def key(self) -> tuple[object, ...]:
        return self.levels, self.stands, self.seen


Ends: TypeAlias = tuple[frozenset[str], int, int]
"""Inputs that stand still; the greatest rank of events before it is looked, and of those that may come again and again."""


@dataclass
class Whole:
    """A system.

    Attributes:
        claimed: What is claimed of each level, with the greatest rank of the events of which it speaks.
        ends: Tables whose commands are claimed to end, each with the `Ends` that it speaks of.
    """

    parts: Sequence[Part]
    wires: Sequence[Wire]
    claimed: Sequence[Mapping[Claimed, int]]
    ends: Sequence[Mapping[str, Ends]]

    @cached_property
    def into(self) -> list[list[int]]:
        """The wires that lead to each level."""
        return [[at for at, w in enumerate(self.wires) if w.target == to] for to in range(len(self.parts))]

    @cached_property
    def out(self) -> list[list[int]]:
        """The wires that lead from it."""
        return [[at for at, w in enumerate(self.wires) if w.source == of] for of in range(len(self.parts))]

    @cached_property
    def given(self) -> list[tuple[str, ...]]:
        """What other levels give each."""
        return [tuple(leaf for at in into for leaf in self.wires[at].taken) for into in self.into]

    @cached_property
    def _publishes(self) -> list[list[tuple[int, tuple[int, ...]]]]:
        """Of each level the wires from it, with the places of what it gives."""
        return [
            [(at, tuple(part.names.index(leaf) for leaf in self.wires[at].given)) for at in out]
            for part, out in zip(self.parts, self.out, strict=True)
        ]

    @cached_property
    def _first(self) -> list[State]:
        """What a level takes from each wire before anything was published."""
        return [tuple(self.parts[w.target].role.start[leaf] for leaf in w.taken) for w in self.wires]

    def start(self) -> Now:
        """Before the first cycle."""
        nothing = (None,) * len(self.wires)
        return self.named(Now(tuple(part.begins() for part in self.parts), nothing, tuple(self._first)))

    def takes(self, now: Now, level: int) -> State:
        """What a level takes from others."""
        return tuple(value for at in self.into[level] for value in now.seen[at])

    def published(self, now: Now, level: int, after: State) -> Now:
        """A state after a cycle of a level."""
        levels = (*now.levels[:level], after, *now.levels[level + 1 :])
        stands, seen = list(now.stands), list(now.seen)
        for at, places in self._publishes[level]:
            stands[at] = record = tuple(after[place] for place in places)
            if self.wires[at].at_once:
                seen[at] = record
        return Now(levels, tuple(stands), tuple(seen))

    def anew(self, now: Now, level: int) -> Now:
        """A state in which a level begins anew."""
        part = self.parts[level]
        given = dict(zip(self.given[level], self.takes(now, level), strict=True))
        stands = dict[str, bool | int | float]()
        for at in self.out[level]:
            if (held := now.stands[at]) is not None:
                stands |= dict(zip(self.wires[at].given, held, strict=True))
            elif at in self._reports:  # the first number, by the name that it has now
                stands[self.wires[at].given[0]] = now.seen[at][0]
        after = part.anew(now.levels[level], given, stands)
        return replaced(now, level, after)

    # --- the same state under other numbers ---

    @cached_property
    def _outside(self) -> list[tuple[int, tuple[int, ...]]]:
        """Levels that take orders from outside, with the places of the numbers."""
        return [
            (at, tuple(map(part.names.index, part.numbers)))
            for at, part in enumerate(self.parts)
            if part.ordered_from_outside
        ]

    @cached_property
    def _between(self) -> list[tuple[int, tuple[int, ...], int, int, tuple[int, ...], int, int]]:
        """Each pair of levels with orders between them: places of their numbers, of the newest, and of the wires."""
        found = []
        for upper, part in enumerate(self.parts):
            for below in part.role.links.below:
                lower = next(at for at, one in enumerate(self.parts) if one.role.links.level == below.name)
                number, echo = f"{below.order}.inc_command", f"{below.report}.inc_command_echo"
                mine = tuple(map(part.names.index, part.numbers_below(below.name, below.order, below.report)))
                theirs = tuple(map(self.parts[lower].names.index, self.parts[lower].numbers))
                order = next(
                    at for at, wire in enumerate(self.wires) if number in wire.given and wire.source == upper
                )
                report = next(
                    at for at, wire in enumerate(self.wires) if echo in wire.taken and wire.target == upper
                )
                found.append((upper, mine, part.names.index(number), lower, theirs, order, report))
        return found

    @cached_property
    def _reports(self) -> frozenset[int]:
        """The wires whose records begin with an echo."""
        return frozenset(report for *_, report in self._between)

    def named(self, now: Now) -> Now:
        """The same state: numbers from outside by their first names, those between two levels by their age only."""
        levels, stands = list(now.levels), list(now.stands)
        seen: list[State | None] = list(now.seen)
        for level, places in self._outside:
            names = dict[object, int]()
            state = list(levels[level])
            for place in places:
                state[place] = names.setdefault(state[place], len(names))
            levels[level] = tuple(state)
        for upper, mine, newest_at, lower, theirs, order, report in self._between:
            above, below = list(levels[upper]), list(levels[lower])
            newest = int(above[newest_at])
            held = [
                (box, wire, record)
                for box in (stands, seen)
                for wire in (order, report)
                if (record := box[wire])
            ]
            numbers = [
                *(above[at] for at in mine),
                *(below[at] for at in theirs),
                *(one[0] for _, _, one in held),
            ]
            ages = sorted({(newest - int(number)) % NUMBERS for number in numbers})
            name = {age: (-GAP * rank) % NUMBERS for rank, age in enumerate(ages)}
            for at in mine:
                above[at] = name[(newest - int(above[at])) % NUMBERS]
            for at in theirs:
                below[at] = name[(newest - int(below[at])) % NUMBERS]
            for box, wire, record in held:
                box[wire] = (name[(newest - int(record[0])) % NUMBERS], *record[1:])
            levels[upper], levels[lower] = tuple(above), tuple(below)
        return Now(tuple(levels), tuple(stands), tuple(one for one in seen if one is not None))


def replaced(now: Now, level: int, after: State) -> Now:
    """The state with another of one level."""
    return Now((*now.levels[:level], after, *now.levels[level + 1 :]), now.stands, now.seen)


@dataclass(frozen=True, slots=True)
class Step:
    """A step between two states, by number, in which nobody begins anew.

    Attributes:
        level: That runs; -1 where what was published is seen, and `wire` is which.
    """

    start: int
    end: int
    level: int
    wire: int
    move: Move | None


@dataclass
class Searched:
    """What was found.

    Attributes:
        ranks: Of each state; `steps`, those from some of them, but for beginnings anew.
        broken: Claims that break, each with its level and the greatest rank of the events on the way there.
        whole: Whether every state was listed.
    """

    states: list[Now] = field(default_factory=list)
    ranks: list[int] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    broken: set[tuple[int, Claimed, int]] = field(default_factory=set)
    events: set[Event] = field(default_factory=set)
    whole: bool = True


SHARE = (0.35, 0.6, 0.85, 1.0)
"""How many of the states that are gone on from may be of each rank, or less."""


def searched(whole: Whole, random: Random, most: int) -> Searched:
    """The states of a system, by rank; in no order within one, so that some are far from the start.

    Args:
        whole: The system.
        random: Chooses the states that are gone on from.
        most: How many these are.
    """
    found = Searched()
    number: dict[tuple[object, ...], int] = {}
    waiting: list[list[int]] = [[] for _ in SHARE]

    def state(now: Now, rank: int) -> int:
        named = whole.named(now)
        at = number.get(named.key)
        if at is None:
            at = number[named.key] = len(found.states)
            found.states.append(named)
            found.ranks.append(rank)
            waiting[rank].append(at)
        return at

    state(whole.start(), 0)
    gone = 0
    for rank, share in enumerate(SHARE):
        here = waiting[rank]
        while here and gone < most * share:
            gone += 1
            if random.random() < 0.5:
                at = random.randrange(len(here))
                here[at], here[-1] = here[-1], here[at]
            start = here.pop()
            for event, level, wire, move, after in steps(whole, found.states[start]):
                reached = max(rank, event.rank)
                found.events.add(event)
                if move is not None:
                    _says(found, level, move, reached)
                if after is not None:
                    end = state(after, reached)
                    if event is not Event.ANEW:
                        found.steps.append(Step(start, end, level, wire, move))
        found.whole = found.whole and not here
    return found


def _says(found: Searched, level: int, move: Move, rank: int) -> None:
    if move.undefined:
        found.broken.add((level, SAFE, rank))
    for key in move.breaks:
        found.broken.add((level, key, rank))


def steps(whole: Whole, now: Now) -> Iterator[tuple[Event, int, int, Move | None, Now | None]]:
    for at, wire in enumerate(whole.wires):
        stands = now.stands[at]
        if not wire.at_once and stands is not None and now.seen[at] != stands:
            seen = (*now.seen[:at], stands, *now.seen[at + 1 :])
            yield Event.SEEN, -1, at, None, Now(now.levels, now.stands, seen)
    for level, part in enumerate(whole.parts):
        for move in part.moves(now.levels[level], whole.given[level], whole.takes(now, level)):
            after = None
            if move.goes_on:
                after = whole.published(now, level, tuple(move.after[name] for name in part.names))
            yield move.event, level, -1, move, after
        yield Event.ANEW, level, -1, None, whole.anew(now, level)
