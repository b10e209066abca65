"""All levels of a system as one transition system, a tick of which is a cycle of each level that is due.

In: the levels, each with its environment, the buffers between them, and a program of requirements across levels (`resolve_across`). Out:
`Together`, a transition system like any other: so the engines, the confirmation and the counterexamples of a level serve it, too.

Three timings:

- *scheduled*: the ticks that `rcsc run` and the C of the system make. A level that is due takes what the tick before left in its buffers,
  all run, all give. Before the first tick buffers are empty, and inputs stand as they are declared.
- *late*: the same ticks, and what a level takes may be older by some ticks more, at most so many: of each buffer another number in each
  tick, for each of its readers, but never such that it sees something older than it has seen. Where nothing has arrived it is empty.
- *any*: each level runs in a tick or not, as it happens, and takes of the others whatever the contract of its own proof allows: any value
  that they published, late, twice or never (`compose.__doc__`). What holds so holds of every schedule and every network.

Restarts are part of all: any level may begin anew before any tick (`run.adopt`), and is as it was until its next cycle. As scheduled its
inputs are what stands in its buffers in that tick, older where it does not run then, and its orders go on from those that it gave last;
else as its own proof has it. What stands outside gives any values, as
one level's environment does, refused ones too; as scheduled a party's output is one value in a tick, whoever reads it.

What a requirement reads of a level is what the level has after the tick; an input, as the level last took it: a refused value is none.
What a party outside gives is what stands in its buffer in that tick, and what it takes, what the level gave last.

Trusted is this module, as `contract.transition` is; that every cycle goes on, and that what stands outside keeps to its contract, is
proved of each level alone and taken from there.
"""

from collections.abc import Collection, Container, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import lcm

from rcsc.compose.contract.environment import Links, leaves_under
from rcsc.compose.contract.transition import (
    GHOST,
    REFUSED,
    Cycle,
    Leaves,
    TransitionSystem,
    successor,
    unlike_echo,
)
from rcsc.compose.contract.watched import Refusals, first_ghosts, ghosts_after, kept, monitors
from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import (
    BEFORE,
    Bool,
    Int,
    Kind,
    Level,
    OneTable,
    Program,
    Property,
    Real,
    Scalar,
    TableName,
)
from rcsc.lang.operator_table import Op
from rcsc.lang.over_time.past import FALSE as NEVER
from rcsc.lang.restart import SameAs
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.opened import Opened
from rcsc.proof.symbolic.values import FALSE, TRUE, Node
from rcsc.run.description import Description

NOW = f"{GHOST}tick"
"""The ghost that counts ticks, as far as periods differ."""
CALM = f"{GHOST}calm"
"""The ghost that says that in a tick no level began anew, and none was refused an input; where a requirement speaks of it."""
LATE = f"{GHOST}late"
"""Of ghosts: by how many ticks a reader last saw a buffer late, and what it held some ticks ago."""
STOOD = f"{GHOST}as it stood"
"""Of ghosts: an input in the tick before which a level may have begun anew, since it ran last."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What may befall the levels.

    Attributes:
        refuses: Whether inputs may be refused; `restarts`, whether a level may begin anew.
    """

    refuses: bool = True
    restarts: bool = True


EVERY = (
    Surroundings(),
    Surroundings(refuses=False),
    Surroundings(restarts=False),
    Surroundings(refuses=False, restarts=False),
)
"""Surroundings from the hardest on."""


class Timing(StrEnum):
    """When levels run, and how old what they take of each other is."""

    ANY = "any"
    LATE = "late"
    SCHEDULED = "scheduled"


@dataclass(frozen=True, slots=True)
class Tick(Cycle):
    """One tick as nodes: a cycle of every level that is due.

    Attributes:
        restarts: For each level, that it begins anew before it; `refuses`, that it is refused an input if it runs.
        stops: For each level of a longer period, that it is in this tick that it does, and in no earlier one.
        takes: For each level, what it takes of what no buffer here holds.
        late: For each buffer and reader, by the reader's end, how late it is seen.
        cycles: The cycle of each level, and `due`, that it runs.
    """

    restarts: Mapping[str, Node] = field(default_factory=dict)
    stops: Mapping[str, Node] = field(default_factory=dict)
    refuses: Mapping[str, Node] = field(default_factory=dict)
    takes: Mapping[str, Leaves] = field(default_factory=dict)
    late: Leaves = field(default_factory=dict)
    cycles: Mapping[str, Cycle] = field(default_factory=dict)
    due: Mapping[str, Node] = field(default_factory=dict)

    @property
    def cases(self) -> tuple[Node, ...]:
        """One case for all: the tables of several levels run in a tick."""
        return (TRUE,)


@dataclass(frozen=True, slots=True)
class Source:
    """Where the values of an input come from.

    Attributes:
        party: Who writes them; `leaf`, under which name.
        end: The reader's end of the buffer, which may hold more leaves.
    """

    party: str
    leaf: str
    end: str

    @property
    def name(self) -> str:
        """The leaf under the name of its party."""
        return f"{self.party}.{self.leaf}"


@dataclass(slots=True)
class Together(TransitionSystem):
    """Levels that run together, as one transition system.

    Attributes:
        members: The levels, by name.
        sources: For each input of a level, as `LEVEL.leaf`, who writes it, where a buffer says so.
        systems: The names of all levels, those that do not run here, too.
        periods: The period of each level, in ticks.
        wired: Each input that takes what a level here gave in the tick before, with that output.
        given: What parties outside give to these levels, with its type.
        held: Each input whose buffer may be seen late, with who writes it: a level here, or a party outside.
        kept: For each level, the inputs that matter as they stood in the tick in which it begins anew, where it need not run then.
        restarting: Whether levels may begin anew.
        most_late: How many ticks late buffers are seen at most, where timing is *late*.
        opens: Whether reals may be anything after every tick, and all that they decide: what holds so holds where they are what they are.
    """

    members: Mapping[str, TransitionSystem] = field(default_factory=dict)
    sources: Mapping[str, Source] = field(default_factory=dict)
    systems: frozenset[str] = frozenset()
    periods: Mapping[str, int] = field(default_factory=dict)
    timing: Timing = Timing.SCHEDULED
    restarting: bool = True
    most_late: int = 0
    opens: bool = False
    wired: dict[str, str] = field(init=False)
    given: dict[str, Scalar] = field(init=False)
    held: dict[str, Source] = field(init=False)
    kept: dict[str, tuple[str, ...]] = field(init=False)

    def __post_init__(self) -> None:
        """Derive the leaves: those of all levels, of what stands outside, of buffers that are seen late, and of the monitors."""
        self.wired, self.given = self._wired(), self._given_outside()
        self.held = self._held()
        self.kept = {} if self.timing is Timing.ANY or not self.restarting else dict(self._kept())
        self.procedures = {}
        self.inputs = ()
        self.kinds = {
            f"{name}.{leaf}": kind for name, ts in self.members.items() for leaf, kind in ts.kinds.items()
        }
        for variable in self.program.variables:
            self.kinds.setdefault(str(variable.name), variable.type)
        for _, monitor in monitors(self.program):
            self.kinds |= {str(state.name): state.type for state in monitor.states}
        if self._round > 1 and self.timing is not Timing.ANY:
            self.kinds[NOW] = Int(0, self._round - 1)
        if any(monitor.waits != NEVER for _, monitor in monitors(self.program)):
            self.kinds[CALM] = Bool()
        self.kinds |= {ghost: self.members[name].kinds[leaf] for ghost, name, leaf in self._stood()}
        for own, source in self.held.items():
            self.kinds[f"{LATE} {source.end}"] = Int(0, self.most_late)
            level, _, leaf = own.partition(".")
            for ticks in range(1, self.most_late + 1):
                self.kinds[ago(own, ticks)] = self.members[level].kinds[leaf]

    def _wired(self) -> dict[str, str]:
        if self.timing is Timing.ANY:
            return {}
        return {
            end: source.name
            for end, source in self.sources.items()
            if source.party in self.members and end.partition(".")[0] in self.members
        }

    def _kept(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        for name, ts in self.members.items():
            if self.periods[name] > 1:
                adopted = {one.leaf for one in ts.program.adopted.values() if isinstance(one, SameAs)}
                back = {leaf for stated in ts.program.environment for leaf in map(str, spoken_of(stated))}
                adopted |= {leaf.removeprefix(BEFORE) for leaf in back if leaf.startswith(BEFORE)}
                yield name, tuple(leaf for leaf in ts.inputs if leaf in adopted)

    def _stood(self) -> Iterator[tuple[str, str, str]]:
        """Yield each ghost of an input as it stood, with its level and leaf."""
        for name, leaves in self.kept.items():
            yield from ((f"{STOOD} {name}.{leaf}", name, leaf) for leaf in leaves)

    def _held(self) -> dict[str, Source]:
        if self.timing is not Timing.LATE:
            return {}
        inputs = {f"{name}.{leaf}": ts.kinds[leaf] for name, ts in self.members.items() for leaf in ts.inputs}
        return {
            own: self.sources[own]
            for own, kind in inputs.items()
            if own in self.wired or (own in self.sources and self.given.get(self.sources[own].name) == kind)
        }

    @property
    def _round(self) -> int:
        """After how many ticks the same levels are due again."""
        return lcm(*(self.periods[name] for name in self.members))

    def _given_outside(self) -> dict[str, Scalar]:
        read = {source.name for end, source in self.sources.items() if end.partition(".")[0] in self.members}
        return {
            str(v.name): v.type for v in self.program.variables if v.kind is Kind.INPUT and v.name in read
        }

    @property
    def shown(self) -> dict[str, str]:
        """What parties outside take of these levels, with the leaf that it is."""
        return {
            end: source.name
            for end, source in self.sources.items()
            if source.party in self.members and end.partition(".")[0] not in self.systems
        }

    def initial(self) -> Leaves:
        """Return the state before the first tick."""
        start = {
            f"{name}.{leaf}": node for name, ts in self.members.items() for leaf, node in ts.initial().items()
        }
        start |= {name: start[same] for name, same in self.shown.items()}
        first = {str(v.name): v.initial for v in self.program.variables}
        start |= {name: values.constant(kind, first[name]) for name, kind in self.given.items()}
        if NOW in self.kinds:
            start[NOW] = values.constant(self.kinds[NOW], 0)
        if CALM in self.kinds:
            start[CALM] = TRUE
        start |= {ghost: start[f"{name}.{leaf}"] for ghost, name, leaf in self._stood()}
        for own, source in self.held.items():
            start[f"{LATE} {source.end}"] = values.constant(Int(0, self.most_late), 0)
            start |= {ago(own, ticks): start[own] for ticks in range(1, self.most_late + 1)}
        return {**start, **first_ghosts(self.program)}

    def firsts(self) -> dict[str, Cycle]:
        """Return the first tick: a system that begins anew as a whole begins so, too."""
        return {"first": self._tick(self.initial(), " at first", first=True)}

    def cycle(
        self, before: Leaves, suffix: str = " taken", taken: Leaves | None = None, *, anew: bool = False
    ) -> Cycle:
        """Run one later tick symbolically from `before`; what comes from outside is fresh, named with the suffix."""
        assert taken is None
        assert not anew
        return self._tick(before, suffix, first=False)

    def _tick(self, before: Leaves, suffix: str, *, first: bool) -> Tick:
        tick = self._ticked(before, suffix, first=first)
        return self._opened(tick, suffix) if self.opens else tick

    def _opened(self, tick: Tick, suffix: str) -> Tick:
        """Return the tick in which reals tell nothing; nor is it known that each level goes on."""
        opened = Opened(suffix)
        after = {
            leaf: values.variable(f"{leaf} is open{suffix}", self.kinds[leaf])
            if isinstance(node.kind, Real)
            else opened.node(node)
            for leaf, node in tick.after.items()
        }
        return replace(tick, contract=opened.node(tick.contract), after=after, tables=())

    def _ticked(self, before: Leaves, suffix: str, *, first: bool) -> Tick:
        cycles, late = dict[str, Cycle](), self._late(suffix)
        due, restarts, takes = dict[str, Node](), dict[str, Node](), dict[str, Leaves]()
        stops = {name: values.variable(f"{name} is stopped{suffix}", Bool()) for name in self.kept}
        after, held = dict(before), {*self.wired, *self.held}
        for name, ts in self.members.items():
            due[name] = self._due(name, before, suffix)
            restarts[name] = FALSE
            if self.restarting:  # before a cycle of it: what it gave last stands until then
                restarts[name] = values.variable(f"{name} begins anew{suffix}", Bool())
            taken = self._taken(name, before, suffix, late, first=first)
            takes[name] = {leaf: node for leaf, node in taken.items() if f"{name}.{leaf}" not in held}
            stood = {leaf: before[f"{name}.{leaf}"] for leaf in ts.kinds}
            found = dict(taken)
            for leaf in () if first else self.kept.get(name, ()):
                found[leaf] = values.choice(stops[name], taken[leaf], before[f"{STOOD} {name}.{leaf}"])
            start = _or(restarts[name], self._anew(name, stood, found, suffix, first=first), stood)
            for leaf in self.kept.get(name, ()):
                new = values.either(due[name], self._at(name, before, 1))
                after[f"{STOOD} {name}.{leaf}"] = values.choice(new, taken[leaf], found[leaf])
            cycles[name] = ts.cycle(start, f" of {name}{suffix}", taken)
            ended = _or(due[name], cycles[name].after, stood)
            nothing = values.both(restarts[name], cycles[name].untaken)  # taken, since it began anew
            ended |= {leaf: values.choice(nothing, stood[leaf], ended[leaf]) for leaf in ts.inputs}
            after |= {f"{name}.{leaf}": node for leaf, node in ended.items()}
        after |= {name: after[same] for name, same in self.shown.items()}
        after |= {name: values.variable(f"{name}{suffix}", kind) for name, kind in self.given.items()}
        if NOW in self.kinds:
            after[NOW] = self._counted(before[NOW])
        after |= self._ages(before, suffix, late, first=first)
        if CALM in self.kinds:
            befalls = (values.either(restarts[name], cycles[name].untaken) for name in cycles)
            after[CALM] = values.negation(values.any_of(map(values.both, due.values(), befalls)))
        after |= ghosts_after(self.program, before, after, Refusals())
        contract = values.all_of(values.follows(due[name], each.contract) for name, each in cycles.items())
        contract = values.both(contract, self._never_back(before, late))
        if self.program.environment:
            contract = values.both(contract, kept(self.program, before, after))
        tables = tuple(
            replace(at, chosen=values.both(due[name], at.chosen))
            for name, each in cycles.items()
            for at in each.every
        )
        return Tick(
            before, {}, contract, after, tables, after,
            calls=tuple(call for each in cycles.values() for call in each.calls),
            restarts=restarts,
            stops=stops,
            takes=takes,
            late=late,
            cycles=cycles,
            due=due,
            refuses={name: each.untaken for name, each in cycles.items()},
        )  # fmt: skip

    def _anew(self, name: str, stood: Leaves, taken: Leaves, suffix: str, *, first: bool) -> Leaves:
        """Return the state in which a level begins anew (`run.adopt.restart`).

        As scheduled its buffers hold what it gave last, and what it finds in them; at first they are empty. Else they hold something, as
        far as the contract goes.
        """
        ts = self.members[name]

        def any_value(leaf: str) -> Node:
            return values.variable(f"{name}.{leaf} as it stood{suffix}", ts.kinds[leaf])

        if self.timing is Timing.ANY:
            return ts.begun_anew({leaf: any_value(leaf) for leaf in ts.inputs}, any_value, unlike_echo)
        return ts.begun_anew(
            taken,
            lambda leaf: any_value(leaf) if leaf == REFUSED else stood[leaf],
            lambda late, echo: successor(echo if first else late),
        )

    def _due(self, name: str, before: Leaves, suffix: str) -> Node:
        if self.timing is Timing.ANY:
            return values.variable(f"{name} runs{suffix}", Bool())
        return self._at(name, before, 0)

    def _at(self, name: str, before: Leaves, ticks: int) -> Node:
        """Return the condition that a level was due so many ticks ago."""
        if NOW not in self.kinds:
            return TRUE
        at = range(ticks, self._round, self.periods[name])
        return values.any_of(values.equal(before[NOW], values.constant(self.kinds[NOW], tick)) for tick in at)

    def _counted(self, now: Node) -> Node:
        following, many = Int(0, self._round), self._round
        later = values.arithmetic(Op.ADD, (now, values.constant(Int(1, 1), 1)), following)
        return values.arithmetic(Op.MOD, (later, values.constant(Int(many, many), many)), now.kind)

    def _taken(self, name: str, before: Leaves, suffix: str, late: Leaves, *, first: bool) -> Leaves:
        """Return the inputs that a level takes: of other levels what they gave last, of parties outside what stands in their buffers.

        Of a buffer that it sees late it takes what stood there then. Where that may be of any age, or its type is another one for this
        level, it is any value.
        """
        held, taken = self.held, {}
        for leaf in self.members[name].inputs:
            own = f"{name}.{leaf}"
            taken[leaf] = self._newest(name, leaf, before, suffix, first=first)
            for ticks in range(1, self.most_late + 1) if own in held else ():
                by = late[held[own].end]
                then = values.equal(by, values.constant(by.kind, ticks))
                taken[leaf] = values.choice(then, before[ago(own, ticks)], taken[leaf])
        return taken

    def _newest(self, name: str, leaf: str, before: Leaves, suffix: str, *, first: bool) -> Node:
        """Return what stands in the buffer of an input as a tick begins; of a party outside, what it gives then."""
        own = f"{name}.{leaf}"
        if own in self.wired:
            return before[own if first else self.wired[own]]  # at first it is empty
        source, kind = self.sources.get(own), self.members[name].kinds[leaf]
        same = source is not None and self.timing is not Timing.ANY and self.given.get(source.name) == kind
        return values.variable(f"{source.name if source is not None and same else own}{suffix}", kind)

    def _late(self, suffix: str) -> Leaves:
        """Return by how many ticks each buffer is seen late, at the end of each reader."""
        ends = dict.fromkeys(source.end for source in self.held.values())
        return {end: values.variable(f"{end} is late{suffix}", Int(0, self.most_late)) for end in ends}

    def _never_back(self, before: Leaves, late: Leaves) -> Node:
        """Return the condition that no reader sees something older than in the tick before."""
        kept = TRUE
        for end, now in late.items():
            then = before[f"{LATE} {end}"]
            for ticks in range(2, self.most_late + 1):
                old = range(ticks - 1, self.most_late + 1)
                so_late = values.any_of(values.equal(then, values.constant(then.kind, of)) for of in old)
                kept = values.both(
                    kept, values.follows(values.equal(now, values.constant(now.kind, ticks)), so_late)
                )
        return kept

    def _ages(self, before: Leaves, suffix: str, late: Leaves, *, first: bool) -> Leaves:
        """Return what the next tick finds of late buffers: how late they were seen, and what stood in them."""
        after = {f"{LATE} {end}": node for end, node in late.items()}
        for own in self.held:
            name, _, leaf = own.partition(".")
            stood = self._newest(name, leaf, before, suffix, first=first)
            for ticks in range(1, self.most_late + 1):
                after[ago(own, ticks)] = stood
                stood = before[ago(own, ticks)]
        return after


def ago(own: str, ticks: int) -> str:
    """Return the ghost of what stood so many ticks ago in the buffer of an input."""
    return f"{LATE} {ticks} {own}"


def _or(when: Node, these: Leaves, others: Leaves) -> Leaves:
    """Return the leaves that these are where the condition holds, and the others elsewhere."""
    if when is FALSE:
        return others
    if when is TRUE:
        return these
    return {
        leaf: node if these[leaf] is node else values.choice(when, these[leaf], node)
        for leaf, node in others.items()
    }


def together(
    systems: Mapping[str, TransitionSystem],
    names: Iterable[str],
    system: Description,
    program: Program,
    timing: Timing,
    *only: str,
) -> Together:
    """Make one transition system of some levels; what the others write is as their contract has it.

    Args:
        systems: All levels, with their environments.
        names: Those that run here.
        system: The description.
        program: The requirements.
        timing: When the levels run.
        only: The requirements that are asked about.
    """
    chosen = [name for name in systems if name in set(names)]
    sources = dict(_sources(system, systems))
    members = {
        name: systems[name] if timing is Timing.ANY else _linked(systems[name], chosen) for name in chosen
    }
    level = Level(system.name, system.tick_ms, (), OneTable(TableName("")), ())
    return Together(
        _about(program, only, frozenset(_known(chosen, sources))),
        level,
        Links(system.name, None, (), (), ()),
        refuses=False,
        only=only,
        members=members,
        sources=sources,
        systems=frozenset(systems),
        periods={name: max(1, systems[name].level.period_ms // system.tick_ms) for name in chosen},
        timing=timing,
        most_late=system.late_ticks,
    )


def writers(system: Description, levels: Container[str], readers: Collection[str]) -> frozenset[str]:
    """Return the levels that write to one of these."""
    ends = ((w.source.partition(".")[0], w.target.partition(".")[0]) for w in system.wires)
    return frozenset(party for party, reader in ends if reader in readers and party in levels)


def _known(chosen: Collection[str], sources: Mapping[str, Source]) -> Iterator[str]:
    """Yield the parties of which some variable is one of these levels'."""
    yield from chosen
    for end, source in sources.items():
        reader = end.partition(".")[0]
        if reader in chosen:
            yield source.name
        if source.party in chosen:
            yield end


def _about(program: Program, only: Collection[str], known: Collection[str]) -> Program:
    """Return the program with some requirements, and with the assumptions that these levels and their parties can tell of."""
    properties = tuple(stated for stated in program.properties if stated.name in only)
    environment = tuple(
        stated
        for stated in program.environment
        if all(name in known or name.partition(".")[0] in known for name in read_by_all(stated))
    )
    return replace(program, properties=properties, environment=environment)


def read_by_all(stated: Property) -> set[str]:
    """Return the names of the variables that a requirement or an assumption reads, of this cycle or the one before."""
    return {str(name).removeprefix(BEFORE) for name in spoken_of(stated)}


def _linked(ts: TransitionSystem, chosen: Iterable[str]) -> TransitionSystem:
    """Return a level without the contract of neighbours that run here themselves."""
    here, links = set(chosen), ts.links
    below = tuple(each for each in links.below if each.name not in here)
    above = None if links.above is not None and links.above.name in here else links.above
    return replace(ts, links=replace(links, below=below, above=above))


def _sources(system: Description, systems: Mapping[str, TransitionSystem]) -> Iterator[tuple[str, Source]]:
    """Yield each input of a level or a party with who writes it."""
    for wire in system.wires:
        (reader, _, record), (party, _, output) = wire.target.partition("."), wire.source.partition(".")
        if reader in systems:
            for leaf in leaves_under(systems[reader].program, record):
                yield f"{reader}.{leaf}", Source(party, output + leaf[len(record) :], wire.target)
        elif party in systems:
            for leaf in leaves_under(systems[party].program, output):
                yield f"{reader}.{record}{leaf[len(output) :]}", Source(party, leaf, wire.target)
