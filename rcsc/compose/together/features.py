"""What invariants of levels together may speak of: the predicates of each level, what requirements compare, and what stands in buffers.

In: levels that run together, a tick from any state, conditions to be proved. Out: `Predicate`s in their cone.

The predicates of a level are those of its own proof, about its leaves in the product. Besides: whether an output is what its reader
compares the input with, as an order's number with the one that the level below took last; and whether an output is what the input was.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rcsc.compose.contract.predicates import CLOSELY, Predicate, compared, cone, listed
from rcsc.compose.contract.properties import counters, every_predicate, side_by_side
from rcsc.compose.contract.transition import Cycle, Leaves
from rcsc.compose.together.product import LATE, Together, ago
from rcsc.lang.meaning import spelled
from rcsc.lang.model import Apply, Bool, Int, Op, Read, VariableName
from rcsc.lang.over_time.past import number
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class OfMember(Predicate):
    """A predicate of a level, about its leaves among those of all levels."""

    member: str = ""

    @property
    def name(self) -> str:
        """Its name in the tables' words, after the level's."""
        return f"{self.member}: {Predicate.name.fget(self)}"  # type: ignore[attr-defined]

    def node(self, leaves: Leaves) -> Node:
        """Return its value in a state of all levels."""
        prefix = f"{self.member}."
        own = {name.removeprefix(prefix): node for name, node in leaves.items() if name.startswith(prefix)}
        return Predicate.node(self, own)


def features(ts: Together, cycle: Cycle, wanted: Iterable[Node]) -> tuple[Predicate, ...]:
    """Choose the predicates in the cone of the conditions."""
    reads = [*wanted, cycle.contract]
    inside = cone(cycle, reads)
    own = every_predicate(ts, cycle, reads, CLOSELY)
    counted = side_by_side(ts.program, tuple(_counters(ts, inside)), inside)
    late = _of_late_buffers(ts, inside)
    return unlike((*own, *_of_members(ts, inside), *_of_buffers(ts, inside), *late, *counted))


def unlike(every: Iterable[Predicate]) -> tuple[Predicate, ...]:
    """Return predicates without those of a name that came before."""
    by_name: dict[str, Predicate] = {}
    for one in every:
        by_name.setdefault(one.name, one)
    return tuple(by_name.values())


def _of_members(ts: Together, inside: frozenset[str]) -> Iterator[Predicate]:
    for name, member in ts.members.items():
        alone = member.cycle(member.havoc())
        read = [node for leaf, node in alone.before.items() if f"{name}.{leaf}" in inside]
        yield from (of_member(one, name) for one in every_predicate(member, alone, read, CLOSELY))


def of_member(one: Predicate, name: str) -> OfMember:
    """Return a predicate of a level, as one of all levels."""
    return OfMember(one.leaf, one.kind, one.other, one.module, one.condition, one.parts, one.procedures, name)


def _counters(ts: Together, inside: frozenset[str]) -> Iterator[tuple[VariableName, Int]]:
    for name, member in ts.members.items():
        numbers = {below.number for below in member.links.below}
        for leaf, kind in counters(member.program):
            if leaf not in numbers and f"{name}.{leaf}" in inside:
                yield VariableName(f"{name}.{leaf}"), kind


def _of_buffers(ts: Together, inside: frozenset[str]) -> Iterator[Predicate]:
    for name, member in ts.members.items():
        pairs = set(compared(member.program))
        for leaf in member.inputs:
            source = ts.sources.get(f"{name}.{leaf}")
            if source is None or source.party not in ts.members:
                continue
            given = source.name
            others = {b if a == leaf else a for a, b in pairs if leaf in (a, b)}
            for other in sorted(f"{name}.{one}" for one in (leaf, *others)):
                if {given, other} <= inside and ts.kinds[given] == ts.kinds[other]:
                    yield Predicate(given, Bool(), other)
            if listed(ts.kinds[given]) and given in inside:
                yield Predicate(given, ts.kinds[given])


def _of_late_buffers(ts: Together, inside: frozenset[str]) -> Iterator[Predicate]:
    """Yield by how many ticks a buffer was seen late, what stood in it, and whether that is what its reader has or what was given then."""
    for end in dict.fromkeys(source.end for source in ts.held.values()):
        name, kind = f"{LATE} {end}", Int(0, ts.most_late)
        if name in inside:
            for ticks in range(1, ts.most_late + 1):
                late = Apply(Op.GE, (Read(VariableName(name), kind), number(ticks)), Bool())
                yield Predicate(spelled(late), Bool(), condition=late)
    for own, source in ts.held.items():
        stood = [name for ticks in range(1, ts.most_late + 1) if (name := ago(own, ticks)) in inside]
        yield from (Predicate(name, ts.kinds[name]) for name in stood if listed(ts.kinds[name]))
        reader, _, leaf = own.partition(".")
        others = {b if a == leaf else a for a, b in compared(ts.members[reader].program) if leaf in (a, b)}
        near = [source.name, own, *sorted(f"{reader}.{one}" for one in others)]
        for at, name in enumerate(stood):
            for other in (*near, *stood[:at]):
                if other in inside and ts.kinds[name] == ts.kinds[other]:
                    yield Predicate(name, Bool(), other)
