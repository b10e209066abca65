"""Every run of a small system: what is true of its requirements across levels.

In: the programs of the levels, how they are connected, and the requirements. Out: a `Truth` for each, complete: all states of levels,
buffers and monitors are visited. A cycle of a level is run once by the interpreter for each state and input, and then looked up. Nothing
is shared with the product of `together`; `test_judged` holds the ticks here against those of `run.system` on the executors.

Numbers of orders are only compared, copied and counted on: of two states that differ by how far numbers are counted one is kept.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import lcm
from typing import Any, NamedTuple, TypeAlias

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.lang.interpret import Fault, cycle, holds, initial
from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import (
    BEFORE,
    Int,
    Kind,
    Program,
    Property,
    Scalar,
    Value,
    VariableName,
    earlier,
    key_bounds,
    value_of_key,
)
from rcsc.lang.over_time.past import FALSE
from rcsc.lang.over_time.run import begun, stepped
from rcsc.lang.protocol.environment import refusable
from rcsc.lang.restart import NUMBERED, NUMBERS, After, Fixed, SameAs, Stands
from rcsc.run.description import Description
from tests.judge.truth import _longest

Values: TypeAlias = tuple[Value, ...]
MOST_TICKS = 12_000
"""Ticks from different states that are looked at for one requirement, if no other number is said."""


class TooManyError(Exception):
    """A system has more runs than are looked at."""


@dataclass(frozen=True, slots=True)
class Befalls:
    """What may befall levels.

    Attributes:
        refuses: Whether what comes from outside may be refused; `restarts`, whether levels may begin anew.
        late: How many ticks late each reader may see each of its buffers.
    """

    refuses: bool = True
    restarts: bool = True
    late: int = 0


@dataclass(frozen=True, slots=True)
class Truth:
    """What is true of a requirement; no longer runs are looked at than the shortest that breaks it.

    Attributes:
        least: The ticks of that run; 0 where none breaks it.
        asks: Whether a tick of some run asks for the response.
        waits: For how many calm ticks in a row it waits at most; None for ever.
        states: How many states of the levels and the monitor there are.
    """

    least: int = 0
    asks: bool = False
    waits: int | None = 0
    states: int = 0


@dataclass(frozen=True, slots=True)
class End:
    """A reader's end of a buffer.

    Attributes:
        leaves: The inputs that it fills.
        source: The buffer.
        writer: Which level writes it, and `places`, where the values stand among what that keeps; None for a party outside.
    """

    leaves: tuple[str, ...]
    source: str
    writer: int | None = None
    places: tuple[int, ...] = ()


class Stand(NamedTuple):
    """A level as it stands after a tick.

    Attributes:
        own: Its states and outputs.
        taken: The inputs that requirements read, as it last took them.
        begins: From what its next cycle goes on, where it began anew in a tick in which it did not run.
        ages: How late it saw each buffer, where that matters.
    """

    own: Values
    taken: Values
    begins: Values | None = None
    ages: tuple[int, ...] = ()


@dataclass(slots=True)
class Member:
    """A level, whose cycles are looked up.

    Attributes:
        read: Its inputs that requirements read; `kept`, its outputs that requirements or other levels read.
        own: Its states and outputs; drawn levels do not read outputs of their own, but for orders and reports.
        free: Its inputs that may have any value in each tick: no buffer fills them, or one that nobody else looks at.
        numbers: Where numbers of orders stand in `own`.
        cycles: Those that were run, also for other requirements.
    """

    ts: TransitionSystem
    period: int
    read: tuple[str, ...]
    kept: frozenset[str]
    ends: tuple[End, ...]
    refuses: bool
    cycles: dict[tuple[Values, Values], tuple[Values, Values]]
    own: tuple[str, ...] = field(init=False)
    inputs: tuple[str, ...] = field(init=False)
    first: dict[str, Value] = field(init=False)
    free: tuple[str, ...] = field(init=False)
    numbers: tuple[int, ...] = field(init=False)
    safe: dict[int, Value] = field(init=False)
    forgotten: dict[int, Value] = field(init=False)
    ways: dict[Any, tuple[tuple[Stand, bool], ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        program = self.ts.program
        self.inputs = tuple(str(v.name) for v in program.variables if v.kind is Kind.INPUT)
        self.own = tuple(str(v.name) for v in program.variables if v.kind is not Kind.INPUT)
        self.first = {str(name): value for name, value in initial(program).items()}
        self.free = tuple(leaf for leaf in self.inputs if all(leaf not in end.leaves for end in self.ends))
        self.numbers = tuple(at for at, leaf in enumerate(self.own) if numbered(self.ts.kinds[leaf]))
        self.safe = {self.own.index(str(v.name)): v.safe for v in program.variables if v.safe is not None}
        outputs = (str(v.name) for v in program.variables if v.kind is Kind.OUTPUT)
        nobodys = [leaf for leaf in outputs if "." not in leaf and leaf not in self.kept]
        self.forgotten = {self.own.index(leaf): self.first[leaf] for leaf in nobodys}

    def begun(self) -> Stand:
        """Return it before the first tick."""
        return Stand(
            tuple(self.first[leaf] for leaf in self.own), tuple(self.first[leaf] for leaf in self.read)
        )

    def cycle(self, own: Values, taken: Mapping[str, Value]) -> tuple[Values, Values]:
        """Run a cycle that takes these inputs; return what it keeps, and what it took of those that requirements read."""
        key = own, tuple(taken[leaf] for leaf in self.inputs)
        if key not in self.cycles:
            before = dict(zip(self.own, own, strict=True))
            outcome = cycle(self.ts.program, self.ts.level, {**before, **taken})
            assert outcome.fault is Fault.OK, (self.ts.level.name, outcome.fault, before, taken)
            after = outcome.snapshot
            self.cycles[key] = (
                tuple(after[leaf] for leaf in self.own),
                tuple(after[leaf] for leaf in self.inputs),
            )
        left, took = self.cycles[key]
        return self.forget(left), tuple(took[self.inputs.index(leaf)] for leaf in self.read)

    def forget(self, own: Values) -> Values:
        """Return what it keeps, without outputs that nobody looks at."""
        return tuple(self.forgotten.get(at, value) for at, value in enumerate(own)) if self.forgotten else own

    def refused(self, own: Values) -> Values:
        """Return what a cycle keeps that is refused an input."""
        return self.forget(tuple(self.safe.get(at, value) for at, value in enumerate(own)))

    def empty(self, zero: int) -> dict[str, Value]:
        """Return what it takes where nothing has arrived, and begins with, if what was first number 0 is now known by another number."""
        kinds = self.ts.kinds
        return {leaf: zero if numbered(kinds[leaf]) else first for leaf, first in self.first.items()}

    def anew(self, own: Values, taken: Mapping[str, Value], *, stands: bool, zero: int = 0) -> Values:
        """Return from what it begins anew, whose buffers hold what it gave last, if anything `stands` there."""
        start = {**self.empty(zero), **taken}
        for leaf, adopted in self.ts.program.adopted.items():
            place = self.own.index(leaf)
            match adopted:
                case Fixed(value):
                    start[leaf] = value
                case SameAs(other):
                    start[leaf] = start[other]
                case Stands():
                    start[leaf] = own[place] if stands else start[leaf]
                case After(echo):
                    start[leaf] = (int(own[place] if stands else start[echo]) + 1) % NUMBERS
        return self.forget(tuple(start[leaf] for leaf in self.own))


def numbered(kind: Scalar) -> bool:
    """Return whether a leaf is a number of an order."""
    return isinstance(kind, Int) and key_bounds(kind) == NUMBERED


def values_of(kind: Scalar) -> tuple[Value, ...]:
    """List the values of a type."""
    low, high = key_bounds(kind)
    return tuple(value_of_key(kind, key) for key in range(low, high + 1))


class Now(NamedTuple):
    """A system as it stands after a tick.

    Attributes:
        at: The tick, as far as it matters for who is due.
        levels: The levels.
        given: What parties outside gave, of what requirements read.
        past: Of each buffer that may be late what it held before, the newest first; of one of a party outside, what it holds, too.
        zero: As what the number 0 is known, with which all levels began: an empty buffer still says it.
    """

    at: int
    levels: tuple[Stand, ...]
    given: Values
    past: tuple[tuple[Values | None, ...], ...] = ()
    zero: int = 0


Cycles: TypeAlias = dict[str, dict[tuple[Values, Values], tuple[Values, Values]]]
"""The cycles of each level that were run."""


class Runs:
    """A system as it runs tick by tick, with all that may befall it: of its levels those on which a requirement depends.

    Attributes:
        program: The requirement, and the assumptions that these levels and their parties can tell of.
        outside: The buffers of parties outside that several levels, or requirements, look at, each with the type of each leaf.
        remembered: The buffers that are remembered, where they may be late.
        base: Where the number of an order stands from which all are counted; None where there is none.
        names: The levels; those that are given, else all on which the requirement depends.
        waits: Whether it matters in which ticks something befell the levels.
        states: The states that were met, by number.
    """

    def __init__(  # all that it depends on
        self,
        systems: Mapping[str, TransitionSystem],
        system: Description,
        program: Program,
        stated: Property,
        befalls: Befalls,
        cycles: Cycles,
        names: Sequence[str] = (),
    ) -> None:
        self.befalls, self.stated = befalls, stated
        where = {
            name: _where(name, systems, system)
            for one in (stated, *program.environment)
            for name in read_by(one)
        }
        self.names = [*names] or _depended_on([where[name] for name in read_by(stated)], systems, system)
        known = {wire.source for wire in system.wires if wire.target.partition(".")[0] in self.names}
        self.environment = [
            one
            for one in program.environment
            if all(where[name].known(self.names, known) for name in read_by(one))
        ]
        read = {name for one in (stated, *self.environment) for name in read_by(one)}
        self.where = {name: where[name] for name in sorted(read)}
        self.shown = tuple(name for name, at in self.where.items() if not at.party)
        self.first = {str(v.name): v.initial for v in program.variables}
        self.kinds = {str(v.name): v.type for v in program.variables}
        self.members = [
            self._member(name, systems, system, cycles.setdefault(name, {})) for name in self.names
        ]
        self.round = lcm(*(member.period for member in self.members))
        self.outside = dict[str, tuple[Scalar, ...]]()
        for member in self.members:
            for end in member.ends:
                if end.writer is None:
                    self.outside[end.source] = tuple(member.ts.kinds[leaf] for leaf in end.leaves)
        self.buffers = (
            {end.source: end for member in self.members for end in member.ends} if befalls.late else {}
        )
        self.remembered = [*self.buffers]
        orders = ((at, one, m.own[one]) for at, m in enumerate(self.members) for one in m.numbers)
        self.base = next(
            (
                (at, one)
                for at, one, leaf in orders
                if leaf.startswith("to_") and leaf.endswith(".inc_command")
            ),
            None,
        )
        self.places = {name: self._place(name) for name in self.where}
        self.waits = stated.monitor is not None and stated.monitor.waits != FALSE
        self.states, self.numbers = list[Now](), dict[Now, int]()
        self.known = dict[int, tuple[tuple[int, bool], ...]]()

    def _member(
        self, name: str, systems: Mapping[str, TransitionSystem], system: Description, cycles: dict[Any, Any]
    ) -> Member:
        ts = systems[name]
        ends = tuple(_ends(name, self.names, systems, system))
        read = {at.leaf for at in self.where.values() if at.party == name}
        sources = {wire.source for wire in system.wires if wire.target.partition(".")[0] in self.names}
        kept = {source.partition(".")[2] for source in sources if source.partition(".")[0] == name}
        readers = Counter(wire.source for wire in system.wires if wire.target.partition(".")[0] in self.names)
        seen = {at.source for at in self.where.values()}
        alone = [e for e in ends if e.writer is None and readers[e.source] == 1 and e.source not in seen]
        others = {leaf for end in ends if end.source.partition(".")[0] in systems for leaf in end.leaves}
        return Member(
            ts,
            max(1, ts.level.period_ms // system.tick_ms),
            tuple(leaf for leaf in ts.inputs if leaf in read),
            frozenset(read | kept),
            tuple(end for end in ends if end not in alone),
            any(
                refusable(v)
                for v in ts.program.variables
                if v.kind is Kind.INPUT and str(v.name) not in others
            ),
            cycles,
        )

    def _place(self, name: str) -> tuple[int, str, int]:
        """Return where the value of a name stands: of which level, of what it keeps or took, and where."""
        at = self.where[name]
        if not at.party:
            return -1, "given", self.shown.index(name)
        member = self.members[self.names.index(at.party)]
        if at.leaf in member.inputs:
            return self.names.index(at.party), "taken", member.read.index(at.leaf)
        return self.names.index(at.party), "own", member.own.index(at.leaf)

    # --- ticks ---

    def begun(self) -> int:
        """Return the system before the first tick."""
        past = tuple((None,) * self.befalls.late for _ in self.remembered)
        given = tuple(self.first[name] for name in self.shown)
        return self._number(Now(0, tuple(member.begun() for member in self.members), given, past))

    def _number(self, now: Now) -> int:
        number = self.numbers.setdefault(now, len(self.states))
        if number == len(self.states):
            self.states.append(now)
        return number

    def seen(self, state: int, name: str) -> Value:
        """Return the value of a variable of a level or a party."""
        at, what, place = self.places[name]
        now = self.states[state]
        if what == "given":
            return now.given[place]
        return (now.levels[at].taken if what == "taken" else now.levels[at].own)[place]

    def leaves(self, state: int, left: Mapping[str, Mapping[str, Value]]) -> bool:
        """Return whether a state is the one in which levels left this; of numbers of orders, and of what nobody reads, nothing is asked."""
        return all(
            stand.own[at] == left[name][leaf]
            for name, member, stand in zip(self.names, self.members, self.states[state].levels, strict=True)
            for at, leaf in enumerate(member.own)
            if at not in member.numbers and at not in member.forgotten
        )

    def onward(self, state: int) -> tuple[tuple[int, bool], ...]:
        """Return each state after the next tick, and whether nothing befell the levels in it."""
        if state not in self.known:
            now = self.states[state]
            every = dict.fromkeys(after for given in self._given() for after in self.tick(now, given))
            self.known[state] = tuple((self._number(after), calm) for after, calm in every)
        return self.known[state]

    def _given(self) -> Iterator[dict[str, Values]]:
        every = [[*product(*map(values_of, kinds))] for kinds in self.outside.values()]
        for chosen in product(*every):
            yield dict(zip(self.outside, chosen, strict=True))

    def tick(self, now: Now, given: Mapping[str, Values]) -> Iterator[tuple[Now, bool]]:
        """Yield the states after a tick in which parties outside give this."""
        ways = [self.ways(at, now, given) for at in range(len(self.members))]
        later = now.at % self.round + 1
        shown = tuple(given[self.where[name].source][0] for name in self.shown)
        past = self._past(now, given)
        for chosen in product(*ways):
            levels = tuple(stand for stand, _ in chosen)
            yield self._normal(Now(later, levels, shown, past, now.zero)), all(calm for _, calm in chosen)

    def ways(self, at: int, now: Now, given: Mapping[str, Values]) -> tuple[tuple[Stand, bool], ...]:
        """Return how a level may stand after the tick, and whether nothing befell it."""
        member, stand = self.members[at], now.levels[at]
        contents = tuple(self._contents(end, now, given) for end in member.ends)
        due = now.at % member.period == 0
        key = due, stand, contents, now.at > 0, now.zero
        if key not in member.ways:
            every = self._ways(member, stand, contents, now.zero, due=due, stands=now.at > 0)
            member.ways[key] = tuple(dict.fromkeys((after, calm or not self.waits) for after, calm in every))
        return member.ways[key]

    def _contents(self, end: End, now: Now, given: Mapping[str, Values]) -> tuple[Values | None, ...]:
        """Return what a reader finds in a buffer, of which it may find each: the newest first; None where nothing has arrived."""
        past = now.past[self.remembered.index(end.source)] if self.befalls.late else ()
        if end.writer is None:
            return given[end.source], *past
        own = now.levels[end.writer].own
        return tuple(own[place] for place in end.places) if now.at else None, *past

    def _past(self, now: Now, given: Mapping[str, Values]) -> tuple[tuple[Values | None, ...], ...]:
        return tuple(
            self._contents(self.buffers[source], now, given)[: self.befalls.late]
            for source in self.remembered
        )

    def _ways(
        self,
        member: Member,
        stand: Stand,
        contents: tuple[tuple[Values | None, ...], ...],
        zero: int,
        *,
        due: bool,
        stands: bool,
    ) -> Iterator[tuple[Stand, bool]]:
        befalls = self.befalls
        ages = stand.ages or (0,) * len(contents)
        free = [values_of(member.ts.kinds[leaf]) for leaf in member.free]
        first = member.empty(zero)
        for by in product(*(range(min(befalls.late, age + 1) + 1) for age in ages)):
            kept = by if befalls.late > 1 else ()
            taken = {leaf: first[leaf] for leaf in member.inputs}
            for end, age, held in zip(member.ends, by, contents, strict=True):
                if (found := held[age]) is not None:
                    taken |= zip(end.leaves, found, strict=True)
            for others in product(*free):
                taken |= zip(member.free, others, strict=True)
                anew = member.anew(stand.own, taken, stands=stands, zero=zero) if befalls.restarts else None
                if not due:
                    yield Stand(stand.own, stand.taken, stand.begins, kept), True
                    if anew is not None:
                        yield Stand(stand.own, stand.taken, anew, kept), True
                    continue
                starts = [(stand.own if stand.begins is None else stand.begins, stand.begins is None)]
                starts += [] if anew is None else [(anew, False)]
                for start, calm in starts:
                    after, took = member.cycle(start, taken)
                    yield Stand(after, took, None, kept), calm
                    if befalls.refuses and member.refuses:
                        yield Stand(member.refused(start), stand.taken, None, kept), False

    def _numbers(self, source: str) -> tuple[int, ...]:
        """Return where numbers of orders stand among what a buffer holds."""
        end = self.buffers[source]
        numbers = () if end.writer is None else self.members[end.writer].numbers
        return tuple(at for at, place in enumerate(end.places) if place in numbers)

    def _normal(self, now: Now) -> Now:
        """Return the same state with other numbers of orders: the last one that was given is 0, and each older one the next below."""
        if self.base is None:
            return now
        at, place = self.base
        base = int(now.levels[at].own[place])
        every = {now.zero, *(int(value) for value in self._every_number(now))}
        older = sorted(every - {base}, key=lambda number: (base - number) % NUMBERS)
        known = {number: -label % NUMBERS for label, number in enumerate([base, *older])}

        def known_as(values: Values | None, places: tuple[int, ...]) -> Any:
            if values is None or not places:
                return values
            return tuple(known[int(value)] if of in places else value for of, value in enumerate(values))

        levels = tuple(
            Stand(known_as(s.own, m.numbers), s.taken, known_as(s.begins, m.numbers), s.ages)
            for m, s in zip(self.members, now.levels, strict=True)
        )
        past = tuple(
            tuple(known_as(held, self._numbers(source)) for held in kept)
            for source, kept in zip(self.remembered, now.past, strict=True)
        )
        return Now(now.at, levels, now.given, past, known[now.zero])

    def _every_number(self, now: Now) -> Iterator[Value]:
        for member, stand in zip(self.members, now.levels, strict=True):
            yield from (values[at] for values in (stand.own, stand.begins) if values for at in member.numbers)
        for source, kept in zip(self.remembered, now.past, strict=True):
            yield from (held[at] for held in kept if held for at in self._numbers(source))


def _ends(
    name: str, names: Sequence[str], systems: Mapping[str, TransitionSystem], system: Description
) -> Iterator[End]:
    """Yield the ends of buffers that a level reads."""
    for wire in system.wires:
        reader, _, variable = wire.target.partition(".")
        if reader != name:
            continue
        leaves = tuple(leaf for leaf in systems[name].inputs if _of(leaf, variable))
        party, _, output = wire.source.partition(".")
        if party not in names:  # outside, or of a level that is left out: then its values are any
            yield End(leaves, wire.source)
            continue
        own = [str(v.name) for v in systems[party].program.variables if v.kind is not Kind.INPUT]
        places = tuple(own.index(output + leaf[len(variable) :]) for leaf in leaves)
        yield End(leaves, wire.source, names.index(party), places)


@dataclass(frozen=True, slots=True)
class Where:
    """Whose a variable is: a level's, or what a party outside gives in a buffer, of one leaf."""

    party: str
    leaf: str
    source: str = ""

    def known(self, names: Collection[str], sources: Collection[str]) -> bool:
        """Return whether it is of these levels, or in one of these buffers."""
        return self.party in names or self.source in sources


def _where(name: str, systems: Mapping[str, TransitionSystem], system: Description) -> Where:
    party, _, leaf = name.partition(".")
    if party in systems:
        return Where(party, leaf)
    for wire in system.wires:
        if name == wire.source:
            return Where("", leaf, name)
        if name == wire.target:
            party, _, leaf = wire.source.partition(".")
            return Where(party, leaf)
    raise KeyError(name)


def _depended_on(
    variables: Sequence[Where], systems: Mapping[str, TransitionSystem], system: Description
) -> list[str]:
    """List the levels of these variables, or that take them, and all that write to these, directly or not."""
    sources = {variable.source for variable in variables}
    known = {variable.party for variable in variables if variable.party}
    known |= {wire.target.partition(".")[0] for wire in system.wires if wire.source in sources}
    for _ in systems:
        known |= {w.source.partition(".")[0] for w in system.wires if w.target.partition(".")[0] in known} & {
            *systems
        }
    return [name for name in systems if name in known]


def _of(leaf: str, variable: str) -> bool:
    return leaf == variable or leaf.startswith(f"{variable}.")


def read_by(stated: Property) -> set[str]:
    """Return the variables of levels and parties that a requirement reads."""
    return {str(name).removeprefix(BEFORE) for name in spoken_of(stated)}


# --- requirements ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Watched:
    """A tick as a monitor sees it: its states after it, and whether it keeps what is said, waits, and asks."""

    states: Values
    kept: bool
    waits: bool
    asks: bool


class _Monitor:
    """A requirement, or an assumption, stepped once for each state and all that it sees."""

    def __init__(self, runs: Runs, stated: Property) -> None:
        self.runs, self.stated, self.monitor = runs, stated, stated.monitor
        self.reads = sorted(read_by(stated))
        self.first: dict[str, Value] = {} if self.monitor is None else begun(self.monitor)
        self.known = dict[tuple[Values, Values, Values], _Watched]()
        self.seen = dict[int, Values]()

    def sees(self, state: int) -> Values:
        """Return what it reads of a state."""
        if state not in self.seen:
            self.seen[state] = tuple(self.runs.seen(state, name) for name in self.reads)
        return self.seen[state]

    def step(self, states: Values, before: int, after: int) -> _Watched:
        """Take a tick, of which these are the states before and after."""
        key = states, self.sees(before), self.sees(after)
        if key not in self.known:
            looked = [dict(zip(self.reads, of, strict=True)) for of in key[1:]]
            self.known[key] = self._step(states, *looked)
        return self.known[key]

    def _step(self, states: Values, before: dict[str, Value], after: dict[str, Value]) -> _Watched:
        if self.monitor is None:
            back = {str(earlier(VariableName(name))): value for name, value in before.items()}
            return _Watched((), holds(self.stated.condition, {**after, **back}), waits=False, asks=True)
        own = dict(zip(self.first, states, strict=True))
        now, kept = stepped(self.monitor, self.stated.condition, own, before, after)
        _, asks = stepped(self.monitor, self.monitor.asks, own, before, after)
        waits = (
            self.monitor.waits != FALSE and stepped(self.monitor, self.monitor.waits, own, before, after)[1]
        )
        return _Watched(tuple(now[name] for name in self.first), kept, waits, asks)


def truth(runs: Runs, most: int = MOST_TICKS) -> Truth:
    """Look at every run.

    Raises:
        TooManyError: There are more than are looked at.
    """
    monitors = [_Monitor(runs, one) for one in (runs.stated, *runs.environment)]
    start = runs.begun(), tuple(tuple(one.first.values()) for one in monitors)
    places, wave, depth, ran = {start: 0}, [start], 0, 0
    least, asks, calmly = 0, False, list[tuple[int, int]]()
    while wave:
        depth, following = depth + 1, list[tuple[int, tuple[Values, ...]]]()
        for at in wave:
            before, states = at
            for after, calm in runs.onward(before):
                steps = [one.step(of, before, after) for one, of in zip(monitors, states, strict=True)]
                if not all(step.kept for step in steps[1:]):
                    continue
                asks = asks or steps[0].asks
                least = least or (0 if steps[0].kept else depth)
                key = after, tuple(step.states for step in steps)
                if key not in places:
                    places[key] = len(places)
                    following.append(key)
                if calm and steps[0].waits:
                    calmly.append((places[at], places[key]))
            ran += len(runs.onward(before))
            if ran > most:
                raise TooManyError
        wave = [] if least else following
    return Truth(least, asks, _longest(calmly) if calmly else 0, len(places))


def followed(
    runs: Runs, left: Iterable[Mapping[str, Mapping[str, Value]]]
) -> dict[tuple[int, tuple[Values, ...]], bool]:
    """Return how a system may stand after ticks that leave this of the levels that ran, and whether the last may break the requirement."""
    monitors = [_Monitor(runs, one) for one in (runs.stated, *runs.environment)]
    here = {(runs.begun(), tuple(tuple(one.first.values()) for one in monitors)): False}
    stood = dict[str, Mapping[str, Value]]()
    for tick in left:
        stood |= tick
        following = dict[tuple[int, tuple[Values, ...]], bool]()
        for before, states in here:
            for after, _ in runs.onward(before):
                if not runs.leaves(after, stood):
                    continue
                steps = [one.step(of, before, after) for one, of in zip(monitors, states, strict=True)]
                if all(step.kept for step in steps[1:]):
                    key = after, tuple(step.states for step in steps)
                    following[key] = following.get(key, False) or not steps[0].kept
        here = following
    return here


# --- any timing -----------------------------------------------------------------------------


class AnyTime(Runs):
    """Levels of which each runs or not, and takes any values: no less than what others may give it, however late, twice or never."""

    def onward(self, state: int) -> tuple[tuple[int, bool], ...]:
        """Return each state after the next tick."""
        if state not in self.known:
            now = self.states[state]
            given = [values_of(self.kinds[name]) for name in self.shown]
            ways = [
                self._anyhow(member, stand) for member, stand in zip(self.members, now.levels, strict=True)
            ]
            every = product(product(*ways), product(*given))
            self.known[state] = tuple((self._number(Now(1, levels, shown)), True) for levels, shown in every)
        return self.known[state]

    def _anyhow(self, member: Member, stand: Stand) -> tuple[Stand, ...]:
        if stand not in member.ways:
            every = dict.fromkeys([(stand, True)])
            for chosen in product(*(values_of(member.ts.kinds[leaf]) for leaf in member.inputs)):
                taken = dict(zip(member.inputs, chosen, strict=True))
                starts = [stand.own]
                starts += [member.anew(stand.own, taken, stands=True)] if self.befalls.restarts else []
                for start in starts:
                    every[Stand(*member.cycle(start, taken)), True] = None
                    if self.befalls.refuses and member.refuses:
                        every[Stand(member.refused(start), stand.taken), True] = None
            member.ways[stand] = tuple(every)
        return tuple(after for after, _ in member.ways[stand])
