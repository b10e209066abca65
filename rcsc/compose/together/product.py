"""All levels of a system as one transition system, a tick of which is a cycle of each level that is due.

In: the levels, each with its environment, the buffers between them, and a program of requirements across levels (`resolve_across`). Out:
`Together`, a transition system like any other: so the engines, the confirmation and the counterexamples of a level serve it, too.

Two timings:

- *scheduled*: the ticks that `rcsc run` and the C of the system make. A level that is due takes what the tick before left in its buffers,
  all run, all give. Before the first tick buffers are empty, and inputs stand as they are declared.
- *any*: each level runs in a tick or not, as it happens, and takes of the others whatever the contract of its own proof allows: any value
  that they published, late, twice or never (`compose.__doc__`). What holds so holds of every schedule and every network.

Restarts are part of both: any level may begin anew before any cycle of it (`run.adopt`). As scheduled its inputs are what stands in its
buffers, and its orders go on from those that it gave last; else as its own proof has it. What stands outside gives any values, as
one level's environment does, refused ones too; as scheduled a party's output is one value in a tick, whoever reads it.

What a requirement reads of a level is what the level has after the tick; an input, as the level last took it: a refused value is none.
What a party outside gives is what stands in its buffer in that tick, and what it takes, what the level gave last.

Trusted is this module, as `contract.transition` is; that every cycle goes on, and that what stands outside keeps to its contract, is
proved of each level alone and taken from there.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
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
from rcsc.lang.model import BEFORE, Bool, Int, Kind, Level, OneTable, Program, Property, Scalar, TableName
from rcsc.lang.operator_table import Op
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, TRUE, Node
from rcsc.run.description import Description

NOW = f"{GHOST}tick"
"""The ghost that counts ticks, as far as periods differ."""


class Timing(StrEnum):
    """When levels run, and how old what they take of each other is."""

    ANY = "any"
    SCHEDULED = "scheduled"


@dataclass(frozen=True, slots=True)
class Tick(Cycle):
    """One tick as nodes: a cycle of every level that is due.

    Attributes:
        restarts: For each level, that it begins anew before it; `refuses`, that it is refused an input if it runs.
        takes: For each level, what it takes of what no level in it writes.
    """

    restarts: Mapping[str, Node] = field(default_factory=dict)
    refuses: Mapping[str, Node] = field(default_factory=dict)
    takes: Mapping[str, Leaves] = field(default_factory=dict)

    @property
    def cases(self) -> tuple[Node, ...]:
        """One case for all: the tables of several levels run in a tick."""
        return (TRUE,)


@dataclass(frozen=True, slots=True)
class Source:
    """Where the values of an input come from.

    Attributes:
        party: Who writes them; `leaf`, under which name.
    """

    party: str
    leaf: str


@dataclass(slots=True)
class Together(TransitionSystem):
    """Levels that run together, as one transition system.

    Attributes:
        members: The levels, by name.
        sources: For each input of a level, as `LEVEL.leaf`, who writes it, where a buffer says so.
        systems: The names of all levels, those that do not run here, too.
        periods: The period of each level, in ticks.
        restarting: Whether levels may begin anew.
    """

    members: Mapping[str, TransitionSystem] = field(default_factory=dict)
    sources: Mapping[str, Source] = field(default_factory=dict)
    systems: frozenset[str] = frozenset()
    periods: Mapping[str, int] = field(default_factory=dict)
    timing: Timing = Timing.SCHEDULED
    restarting: bool = True

    def __post_init__(self) -> None:
        """Derive the leaves: those of all levels, of what stands outside, and of the monitors."""
        self.procedures = {}
        self.inputs = ()
        self.kinds = {
            f"{name}.{leaf}": kind for name, ts in self.members.items() for leaf, kind in ts.kinds.items()
        }
        for variable in self.program.variables:
            self.kinds.setdefault(str(variable.name), variable.type)
        for _, monitor in monitors(self.program):
            self.kinds |= {str(state.name): state.type for state in monitor.states}
        if self._round > 1 and self.timing is Timing.SCHEDULED:
            self.kinds[NOW] = Int(0, self._round - 1)

    @property
    def wired(self) -> dict[str, str]:
        """Each input that takes what a level here gave in the tick before, with that output."""
        if self.timing is Timing.ANY:
            return {}
        return {
            end: f"{source.party}.{source.leaf}"
            for end, source in self.sources.items()
            if source.party in self.members and end.partition(".")[0] in self.members
        }

    @property
    def _round(self) -> int:
        """After how many ticks the same levels are due again."""
        return lcm(*(self.periods[name] for name in self.members))

    @property
    def given(self) -> dict[str, Scalar]:
        """What parties outside give to these levels, with its type."""
        read = {
            f"{source.party}.{source.leaf}"
            for end, source in self.sources.items()
            if end.partition(".")[0] in self.members
        }
        return {
            str(v.name): v.type for v in self.program.variables if v.kind is Kind.INPUT and v.name in read
        }

    @property
    def shown(self) -> dict[str, str]:
        """What parties outside take of these levels, with the leaf that it is."""
        return {
            end: f"{source.party}.{source.leaf}"
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
        cycles = dict[str, Cycle]()
        due, restarts, takes = dict[str, Node](), dict[str, Node](), dict[str, Leaves]()
        after = dict(before)
        for name, ts in self.members.items():
            due[name] = self._due(name, before, suffix)
            restarts[name] = FALSE
            if self.restarting:  # before a cycle of it: what it gave last stands until then
                restarts[name] = values.variable(f"{name} begins anew{suffix}", Bool())
            taken = self._taken(name, before, suffix, first=first)
            takes[name] = {leaf: node for leaf, node in taken.items() if f"{name}.{leaf}" not in self.wired}
            stood = {leaf: before[f"{name}.{leaf}"] for leaf in ts.kinds}
            start = _or(restarts[name], self._anew(name, stood, taken, suffix, first=first), stood)
            cycles[name] = ts.cycle(start, f" of {name}{suffix}", taken)
            ended = _or(due[name], cycles[name].after, stood)
            nothing = values.both(restarts[name], cycles[name].untaken)  # taken, since it began anew
            ended |= {leaf: values.choice(nothing, stood[leaf], ended[leaf]) for leaf in ts.inputs}
            after |= {f"{name}.{leaf}": node for leaf, node in ended.items()}
        after |= {name: after[same] for name, same in self.shown.items()}
        after |= {name: values.variable(f"{name}{suffix}", kind) for name, kind in self.given.items()}
        if NOW in self.kinds:
            after[NOW] = self._counted(before[NOW])
        after |= ghosts_after(self.program, before, after, Refusals())
        contract = values.all_of(values.follows(due[name], each.contract) for name, each in cycles.items())
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
            takes=takes,
            refuses={name: each.untaken for name, each in cycles.items()},
        )  # fmt: skip

    def _anew(self, name: str, stood: Leaves, taken: Leaves, suffix: str, *, first: bool) -> Leaves:
        """Return the state in which a level begins anew (`run.adopt.restart`).

        As scheduled its buffers hold what it gave last, and what it takes; at first they are empty. Else they hold something, as far as the
        contract goes.
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
        period = self.periods[name]
        if NOW not in self.kinds:
            return TRUE
        at = range(0, self._round, period)
        return values.any_of(values.equal(before[NOW], values.constant(self.kinds[NOW], tick)) for tick in at)

    def _counted(self, now: Node) -> Node:
        following, many = Int(0, self._round), self._round
        later = values.arithmetic(Op.ADD, (now, values.constant(Int(1, 1), 1)), following)
        return values.arithmetic(Op.MOD, (later, values.constant(Int(many, many), many)), now.kind)

    def _taken(self, name: str, before: Leaves, suffix: str, *, first: bool) -> Leaves:
        """Return the inputs that a level takes: of other levels what they gave last, of parties outside what stands in their buffers.

        Where that may be late, or its type is another one for this level, it is any value.
        """
        ts, taken, wired, given = self.members[name], {}, self.wired, self.given
        for leaf in ts.inputs:
            own = f"{name}.{leaf}"
            if own in wired:
                taken[leaf] = before[own if first else wired[own]]
                continue
            source, kind = self.sources.get(own), ts.kinds[leaf]
            stands = "" if source is None else f"{source.party}.{source.leaf}"
            same = self.timing is Timing.SCHEDULED and given.get(stands) == kind
            taken[leaf] = values.variable(f"{stands if same else own}{suffix}", kind)
        return taken


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
    only: str,
) -> Together:
    """Make one transition system of some levels; what the others write is as their contract has it.

    Args:
        systems: All levels, with their environments.
        names: Those that run here.
        system: The description.
        program: The requirements.
        timing: When the levels run.
        only: The requirement that is asked about.
    """
    chosen = [name for name in systems if name in set(names)]
    sources = dict(_sources(system, systems))
    members = {
        name: _linked(systems[name], chosen) if timing is Timing.SCHEDULED else systems[name]
        for name in chosen
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
    )


def _known(chosen: Collection[str], sources: Mapping[str, Source]) -> Iterator[str]:
    """Yield the parties of which some variable is one of these levels'."""
    yield from chosen
    for end, source in sources.items():
        reader = end.partition(".")[0]
        if reader in chosen:
            yield f"{source.party}.{source.leaf}"
        if source.party in chosen:
            yield end


def _about(program: Program, only: str, known: Collection[str]) -> Program:
    """Return the program with the one requirement, and with the assumptions that these levels and their parties can tell of."""
    properties = tuple(stated for stated in program.properties if stated.name == only)
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
                yield f"{reader}.{leaf}", Source(party, output + leaf[len(record) :])
        elif party in systems:
            for leaf in leaves_under(systems[party].program, output):
                yield f"{reader}.{record}{leaf[len(output) :]}", Source(party, leaf)
