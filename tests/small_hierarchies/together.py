"""Two levels with their real buffers, in every order of their steps: what was proved of each in its contract is kept.

In: the roles of a superior and of its subordinate, and what is claimed of them. Out: what breaks. This is the argument of `rcsc.compose`
put to the test: here no contract stands between the two, but a buffer each way that holds the latest record. Either level runs at any
moment, and begins anew at any moment (`adopt`); a report comes from its buffer to the wire, where it is read, at any moment or never. An
order that is read late is one that is read in time and answered late, so one wire does. The superior's superior and the subordinate's
subordinate keep to their contracts.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

from rcsc.compose.contract.environment import Below
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Value
from tests.small_hierarchies.explored import TooManyError, adopted, successors
from tests.small_hierarchies.level import EARLY, Key, Ran, Role, State
from tests.small_hierarchies.world import NUMBERS, answered, broken, canonical, given_numbers, ordered

GAP = 10
"""Between numbers that follow each other, so that none is the successor of another by accident."""
Record = tuple[Value, ...]


@dataclass(frozen=True, slots=True)
class Both:
    """A state of two levels: their leaves, the order in its buffer, and the report in its buffer and on the wire."""

    upper: dict[str, Value]
    lower: dict[str, Value]
    order: Record
    report: Record
    report_wire: Record

    @property
    def key(self) -> State:
        """To compare it by."""
        buffers = (*self.order, *self.report, *self.report_wire)
        return (*self.upper.values(), *self.lower.values(), *buffers)


@dataclass(frozen=True, slots=True)
class Pair:
    """A superior and its subordinate, by name in each other's links."""

    upper: Role
    lower: Role
    claimed_upper: frozenset[Key]
    claimed_lower: frozenset[Key]
    restarts: bool = True
    _ways: dict[tuple[str, State], list[tuple[dict[str, Value], Ran]]] = field(
        default_factory=dict, repr=False
    )

    def ways(
        self, role: Role, before: Mapping[str, Value], but: str, given_: Mapping[str, Value]
    ) -> list[tuple[dict[str, Value], Ran]]:
        """What a level can do next; the same state comes up again and again."""
        key = role.links.level, (*before.values(), *given_.values())
        if key not in self._ways:
            self._ways[key] = list(successors(role, before, but, given_))
        return self._ways[key]

    @property
    def order(self) -> str:
        """The superior's output."""
        return self.below.order

    @property
    def report(self) -> str:
        """The superior's input."""
        return self.below.report

    @property
    def below(self) -> Below:
        """The subordinate, as the superior is linked to it."""
        return next(below for below in self.upper.links.below if below.name == self.lower.links.level)

    @property
    def taken(self) -> tuple[str, str]:
        """The subordinate's input and output."""
        above = self.lower.links.above
        assert above is not None
        return above.order, above.report


def record(role: Role, state: Mapping[str, Value], name: str) -> Record:
    """The values of a record's leaves, in declared order."""
    return tuple(state[leaf] for leaf in role.leaves if leaf.startswith(f"{name}."))


def given(role: Role, name: str, values: Record) -> dict[str, Value]:
    """The leaves of a record with these values."""
    leaves = [leaf for leaf in role.leaves if leaf.startswith(f"{name}.")]
    return dict(zip(leaves, values, strict=True))


def broken_together(pair: Pair, most: int = 3000) -> tuple[list[str], int]:
    """What breaks, in words, and the number of states seen; the search ends with the first.

    Raises:
        TooManyError: There are more states than `most`.
    """
    order = record(pair.upper, pair.upper.start, pair.order)
    report = record(pair.upper, pair.upper.start, pair.report)
    start = _canonical(pair, Both(dict(pair.upper.start), dict(pair.lower.start), order, report, report))
    seen, waiting = {start.key}, [start]
    while waiting:
        both = waiting.pop()
        for said, after in _steps(pair, both):
            if said:
                return said, len(seen)
            new = _canonical(pair, after)
            if new.key not in seen:
                seen.add(new.key)
                waiting.append(new)
        if len(seen) > most:
            raise TooManyError
    return [], len(seen)


def _steps(pair: Pair, both: Both) -> Iterator[tuple[list[str], Both]]:
    """Each thing that may happen next, and what it breaks."""
    if both.report_wire != both.report:
        yield [], replace(both, report_wire=both.report)
    yield from _upper(pair, both)
    yield from _lower(pair, both)
    if pair.restarts:
        yield [], replace(both, upper=_upper_again(pair, both))
        yield [], replace(both, lower=_lower_again(pair, both))


def _upper(pair: Pair, both: Both) -> Iterator[tuple[list[str], Both]]:
    role, before = pair.upper, both.upper
    report = given(role, pair.report, both.report_wire)
    for taken, ran in pair.ways(role, before, pair.report, report):
        said = [] if answered(pair.below, before, taken) else ["the contract about the subordinate"]
        said += _words(role, set(broken(role, before, taken, ran)) & pair.claimed_upper)
        if ran.fault in {Fault.OK, *EARLY} or said:
            yield said, replace(both, upper=ran.after, order=record(role, ran.after, pair.order))


def _lower(pair: Pair, both: Both) -> Iterator[tuple[list[str], Both]]:
    role, before = pair.lower, both.lower
    into, out = pair.taken
    for taken, ran in pair.ways(role, before, into, given(role, into, both.order)):
        said = [] if ordered(role, before, taken) else ["the contract about the superior"]
        said += _words(role, set(broken(role, before, taken, ran)) & pair.claimed_lower)
        if ran.fault in {Fault.OK, *EARLY} or said:
            yield said, replace(both, lower=ran.after, report=record(role, ran.after, out))


def _words(role: Role, keys: Collection[Key]) -> list[str]:
    return [f"{role.links.level}: {sort.value} {table} {name}" for sort, table, name in sorted(keys)]


def _upper_again(pair: Pair, both: Both) -> dict[str, Value]:
    """The superior begins anew: its order stands in the buffer, and counts."""
    role = pair.upper
    inputs = {leaf: both.upper[leaf] for leaf in role.inputs} | given(role, pair.report, both.report_wire)
    return adopted(role, role.start | inputs, given(role, pair.order, both.order))


def _lower_again(pair: Pair, both: Both) -> dict[str, Value]:
    """The subordinate begins anew: its report stands in the buffer, and goes on echoing what it echoed."""
    role, (into, out) = pair.lower, pair.taken
    inputs = {leaf: both.lower[leaf] for leaf in role.inputs} | given(role, into, both.order)
    return adopted(role, role.start | inputs, given(role, out, both.report))


def _canonical(pair: Pair, both: Both) -> Both:
    """The same state; the numbers between the two by their age only."""
    upper = canonical(pair.upper, both.upper, pair.lower.links.level)
    lower = canonical(pair.lower, both.lower, pair.upper.links.level)
    places = [(upper, f"{pair.order}.inc_command"), (upper, f"{pair.report}.inc_command_echo")]
    places += [(lower, leaf) for leaf in given_numbers(pair.lower)]
    buffers = [list(one) for one in (both.order, both.report, both.report_wire)]
    newest = int(upper[f"{pair.order}.inc_command"])
    numbers = [int(state[leaf]) for state, leaf in places] + [int(buffer[0]) for buffer in buffers]
    ages = sorted({(newest - number) % NUMBERS for number in numbers})
    name = {age: (-GAP * rank) % NUMBERS for rank, age in enumerate(ages)}
    for state, leaf in places:
        state[leaf] = name[(newest - int(state[leaf])) % NUMBERS]
    for buffer in buffers:
        buffer[0] = name[(newest - int(buffer[0])) % NUMBERS]
    order, report, report_wire = (tuple(buffer) for buffer in buffers)
    return Both(upper, lower, order, report, report_wire)
