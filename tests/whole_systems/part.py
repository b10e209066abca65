"""A level in its system: each thing that its next cycle can do, whatever comes from outside, is refused or answered.

In: a role, what other levels give it, its state. Out: its `Move`s, each with the event that it is and what it breaks.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum as Choice
from functools import cached_property
from itertools import product
from operator import itemgetter

from rcsc.compose.contract.claims import CONTRACT, GIVEN, STANDS, UNREACHED
from rcsc.compose.contract.obligations import Sort
from rcsc.lang.interpret import Fault, cycle, holds
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Admit, Bool, Enum, Expr, Int, Program, Standing, Value, key_bounds
from tests.small_hierarchies.explored import adopted
from tests.small_hierarchies.level import EARLY, UNDEFINED, Ran, Role
from tests.small_hierarchies.world import NUMBERS, answered, broken, ordered

LAST, TOLD, FRESH, ANEW = "#last", "#told", "#fresh", "#anew"
"""What is remembered of a level besides its leaves: number and command of the order taken last; that it began anew and no cycle ended
well, and that none took anything."""
NUMBER = Int(0, NUMBERS - 1)
Claimed = tuple[str, str, str]
"""A claim about a level: sort, table and name."""
State = tuple[Value, ...]


class Event(Choice):
    """What may happen next, each with its rank: how much less of a claim is left that does not speak of it."""

    RUNS = ("a level runs a cycle to its end, or to a stopping assumption", 0)
    SEEN = ("what was published is seen", 0)
    ANEW = ("a level begins anew", 1)
    EXTERN = ("what an extern procedure gives is refused", 2)
    REFUSED = ("an input is refused", 2)
    EARLY_ANEW = ("the first cycle of a level that begins anew ends early", 3)

    @property
    def rank(self) -> int:
        return int(self.value[1])


LEFT_OUT = {
    "a level goes on from its checkpoint": "it is as it was after its last cycle: nothing has happened",
    "a value is clamped": "a table sees a value of its range, which it may see anyway; of a restart see `test_refusals`",
}
"""Events that no run here has, with the reason."""
NEVER = {
    Fault.STATE: "proofs begin with states in range; executors alone meet others",
    Fault.ARITHMETIC: "a machine's, not a level's",
}
"""Faults that no run here has, likewise."""


@dataclass(frozen=True, slots=True)
class Move:
    """What a level does in one cycle.

    Attributes:
        breaks: The claims that it breaks, of whatever is claimed.
        same: Whether the order is the one that was taken last; `unanswered`, that its report does not end it.
        outside: What it took from outside.
    """

    event: Event
    table: str
    line: str
    goes_on: bool
    after: dict[str, Value]
    breaks: tuple[Claimed, ...]
    undefined: bool
    same: bool = False
    unanswered: bool = False
    outside: tuple[tuple[str, Value], ...] = ()


@dataclass(frozen=True, slots=True)
class Owed:
    """A fact that another level states of what this one writes.

    Attributes:
        name: `READER.ASSUMPTION`.
        written: Of each leaf that the fact speaks of, which leaf here it is.
    """

    name: str
    condition: Expr
    written: Mapping[str, str]


@dataclass
class Part:
    """A level in its system.

    Attributes:
        fed: Inputs that other levels give.
        owes: What other levels state of what it writes.
        varied: Inputs from outside that are varied though a cycle does not read them: those that may stand still.
    """

    role: Role
    fed: frozenset[str]
    varied: frozenset[str] = frozenset()
    owes: list[Owed] = field(default_factory=list)
    _moves: dict[tuple[State, State], list[Move]] = field(default_factory=dict, repr=False)

    @cached_property
    def program(self) -> Program:
        return self.role.program

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What a state of it holds."""
        return (*self.role.leaves, LAST, TOLD, FRESH, ANEW)

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Inputs from outside, of no order."""
        above = self.role.links.above
        order = f"{above.order}." if above is not None else " "
        return tuple(leaf for leaf in self.role.inputs if leaf not in self.fed and not leaf.startswith(order))

    @cached_property
    def ordered_from_outside(self) -> tuple[str, ...]:
        """The leaves of an order that comes from outside."""
        above = self.role.links.above
        if above is None:
            return ()
        order = tuple(leaf for leaf in self.role.inputs if leaf.startswith(f"{above.order}."))
        return () if set(order) & self.fed else order

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Where numbers are kept that its superior gave."""
        below = tuple(
            f"{name}."
            for one in self.role.links.below
            for name in (one.order, one.report, f"last_{one.name}")
        )
        leaves = [v for v in map(str, self.role.leaves) if self.program.variable(v).type == NUMBER]
        above = self.role.links.above
        return (*(leaf for leaf in leaves if not leaf.startswith(below)), *([] if above is None else [LAST]))

    def numbers_below(self, name: str, order: str, report: str) -> tuple[str, ...]:
        """Where numbers are kept that it gave a subordinate."""
        starts = (f"{order}.", f"{report}.", f"last_{name}.")
        return tuple(
            leaf
            for leaf in self.role.leaves
            if leaf.startswith(starts) and self.program.variable(leaf).type == NUMBER
        )

    @cached_property
    def believed(self) -> frozenset[str]:
        """Facts about what comes from outside, by its own word: where one fails there is no such cycle.

        A fact about what another level writes is no such fact: that level may break it.
        """
        strange = frozenset(self.free) | set(self.ordered_from_outside)
        for procedure in self.program.procedures:
            if procedure.extern is not None:
                strange |= set(map(str, procedure.writes))
        return frozenset(
            str(assumption.name)
            for assumption in self.program.assumptions
            if assumption.standing is Standing.ASSUMED and strange & self._read(assumption.condition)
        )

    @staticmethod
    def _read(condition: Expr) -> frozenset[str]:
        return frozenset(map(str, read_by(condition)))

    @cached_property
    def facts(self) -> dict[str, Expr]:
        """Facts about what other levels write, and nothing else."""
        return {
            str(assumption.name): assumption.condition
            for assumption in self.program.assumptions
            if assumption.standing is Standing.ASSUMED
            and (read := self._read(assumption.condition))
            and read <= self.fed
        }

    def begins(self) -> State:
        """Its state before the first cycle."""
        return (*self.role.start.values(), *self._order_in(self.role.start), False, False)

    def _order_in(self, leaves: Mapping[str, Value]) -> State:
        """Number and command of its order."""
        above = self.role.links.above
        return (
            (0, 0)
            if above is None
            else (leaves[f"{above.order}.inc_command"], leaves[f"{above.order}.input_command"])
        )

    def anew(self, before: State, given: Mapping[str, Value], stands: Mapping[str, Value]) -> State:
        """Its state when it begins anew: what comes from outside is as it was taken last."""
        now = dict(zip(self.names, before, strict=True))
        outside = {leaf: now[leaf] for leaf in self.role.inputs if leaf not in self.fed}
        after = adopted(self.role, {**self.role.start, **outside, **given}, stands)
        return (*(after[leaf] for leaf in self.role.leaves), *self._order_in(after), True, True)

    def moves(self, before: State, given: tuple[str, ...], values: State) -> list[Move]:
        """Each different thing that its next cycle can do, given what it takes from other levels."""
        key = before, values
        if key not in self._moves:
            now = dict(zip(self.names, before, strict=True))
            fed = dict(zip(given, values, strict=True))
            self._moves[key] = [*self._runs(now, fed), *self._refused(now, fed)]
        return self._moves[key]

    def _runs(self, now: dict[str, Value], fed: dict[str, Value]) -> Iterator[Move]:
        names, left = self._offers(now)
        left = [one for one in left if self._admitted(names, one)]
        watched = self.role.watched | self.varied
        while left:
            taken = {**fed, **dict(zip(names, left[0], strict=True))}
            read: set[str] = set()
            for ran in self.role.ways({**now, **taken}, read):
                if not ran.failed & self.believed:
                    yield self._move(now, taken, ran)
            used = read | watched
            places = [at for at, leaf in enumerate(names) if leaf in used]
            if not places:
                return
            look = itemgetter(*places)
            same = look(left[0])
            left = [one for one in left if look(one) != same]

    def _offers(self, now: Mapping[str, Value]) -> tuple[tuple[str, ...], list[State]]:
        """Every value from outside: an order is the one that was given last, or has another number."""
        orders = self._orders(now)
        free = [self._domain(leaf) for leaf in self.free]
        return (*self.ordered_from_outside, *self.free), [
            (*order, *rest) for order in orders for rest in product(*free)
        ]

    def _orders(self, now: Mapping[str, Value]) -> list[State]:
        leaves = self.ordered_from_outside
        above = self.role.links.above
        if not leaves or above is None:
            return [()]
        number = f"{above.order}.inc_command"
        known = {int(now[leaf]) for leaf in self.numbers}
        fresh = next(one for one in range(NUMBERS) if one not in known)
        same = [
            (now[leaf],) if leaf == number or leaf in above.numbered else self._domain(leaf)
            for leaf in leaves
        ]
        new = [(fresh,) if leaf == number else self._domain(leaf) for leaf in leaves]
        return [*product(*same), *product(*new)]

    def _domain(self, leaf: str) -> tuple[Value, ...]:
        return self._domains[leaf]

    @cached_property
    def _domains(self) -> dict[str, tuple[Value, ...]]:
        number = {leaf for leaf in self.role.inputs if self.program.variable(leaf).type == NUMBER}
        return {leaf: (0, 1) if leaf in number else self.role.domain(leaf) for leaf in self.role.inputs}

    def _admitted(self, names: tuple[str, ...], values: State) -> bool:
        """Whether nothing of it is refused: an order that was is so for as long as it stands."""
        return all(
            value in self._domains[leaf]
            for leaf, value in zip(names, values, strict=True)
            if leaf not in self._given_numbers
        )

    @cached_property
    def _given_numbers(self) -> frozenset[str]:
        above = self.role.links.above
        return frozenset() if above is None else frozenset({f"{above.order}.inc_command"})

    def _refused(self, now: dict[str, Value], fed: dict[str, Value]) -> Iterator[Move]:
        """Cycles in which one value from outside is refused: the others may be anything, and stay as given."""
        names, left = self._offers(now)
        looked = [at for at, leaf in enumerate(names) if leaf in self.role.remembered | self.role.watched]
        above = self.role.links.above
        for leaf, value in self._strange:
            seen: set[State] = set()
            mine = [one for one in left if self._admitted(names, one)]
            if (
                above is not None and leaf in self.ordered_from_outside
            ):  # an order that was taken is not refused
                number = f"{above.order}.inc_command"
                mine = [
                    one
                    for one in left
                    if one[names.index(leaf)] == value
                    or (one[names.index(number)] != now[number] and self._admitted(names, one))
                ]
            for one in mine:
                key = tuple(one[at] for at in looked if names[at] != leaf)
                if key in seen:
                    continue
                seen.add(key)
                taken = {**fed, **dict(zip(names, one, strict=True)), leaf: value}
                outcome = cycle(self.program, self.role.level, {**now, **taken})
                assert outcome.fault is Fault.ADMIT
                after = dict(outcome.snapshot)
                ran = Ran("", "", Fault.ADMIT, frozenset(), now, after)
                yield self._move(now, taken, ran)

    @cached_property
    def _strange(self) -> list[tuple[str, Value]]:
        """Values from outside that are refused."""
        found: list[tuple[str, Value]] = []
        for leaf in (*self.free, *self.ordered_from_outside):
            variable = self.program.variable(leaf)
            if variable.type == NUMBER or isinstance(variable.type, Bool) or variable.admit is Admit.CLAMP:
                continue
            found.append((leaf, key_bounds(variable.type)[1] + 1))
        return found

    def _move(self, now: dict[str, Value], taken: dict[str, Value], ran: Ran) -> Move:
        fresh = bool(now[FRESH])
        event = Event.RUNS
        if ran.fault is Fault.ADMIT:
            event = Event.REFUSED
        elif ran.fault is Fault.EXTERN:
            event = Event.EXTERN
        if fresh and (ran.fault is Fault.ADMIT or ran.fault in EARLY):
            event = Event.EARLY_ANEW
        if ran.fault is UNDEFINED:
            return Move(event, "", "", goes_on=False, after={}, breaks=(), undefined=True)
        above = self.role.links.above
        number = None if above is None else f"{above.order}.inc_command"
        same = number is not None and taken.get(number, now[number]) == now[LAST]
        before = dict(now)
        if above is not None:
            before |= {f"{above.order}.inc_command": now[LAST], f"{above.order}.input_command": now[TOLD]}
        breaks = tuple(self._broken(now, before, taken, ran))
        after = dict(ran.after)
        if ran.fault is not Fault.ADMIT:
            after[FRESH], after[ANEW] = fresh and ran.fault in EARLY, False
            after[LAST], after[TOLD] = self._order_in(after)
        after.update(self._forgotten)
        goes_on = ran.fault in {Fault.OK, Fault.ADMIT, *EARLY}
        outside = tuple((leaf, taken[leaf]) for leaf in self.free)
        return Move(
            event, ran.table, ran.line, goes_on, after, breaks,
            undefined=False, same=same, unanswered=self._unanswered(after), outside=outside,
        )  # fmt: skip

    @cached_property
    def _forgotten(self) -> dict[str, Value]:
        return self.role.forgotten

    def _unanswered(self, after: Mapping[str, Value]) -> bool:
        above = self.role.links.above
        if above is None:
            return False
        rests = after[f"{above.order}.input_command"] == 0
        kind = self.program.variable(f"{above.report}.status_report").type
        assert isinstance(kind, Enum)
        said = kind.members[int(after[f"{above.report}.status_report"])]
        return not (said == above.done or (said == above.failed and not rests))

    def _stands(self, before: Mapping[str, Value], after: Mapping[str, Value]) -> bool:
        """Whether a report that has answered the order taken last is as it was, while it is about that order."""
        above = self.role.links.above
        assert above is not None
        echo, number = f"{above.report}.inc_command_echo", f"{above.order}.inc_command"
        about = before[echo] == before[number] == after[echo]
        about = about and before[f"{above.report}.ref_command_echo"] == before[f"{above.order}.input_command"]
        if not about or self._unanswered(before):
            return True
        return all(before[leaf] == after[leaf] for leaf in self.role.report)

    def _broken(
        self, now: Mapping[str, Value], before: Mapping[str, Value], taken: Mapping[str, Value], ran: Ran
    ) -> Iterator[Claimed]:
        """What the cycle breaks; of a subordinate too what it is taken to keep to."""
        yield from broken(self.role, before, taken, ran, anew=bool(now[ANEW]))
        for below in self.role.links.below:
            if f"{below.report}.inc_command_echo" in self.fed and not answered(below, now, taken):
                yield CONTRACT, "", below.report
        above = self.role.links.above
        if above is not None and not self.ordered_from_outside and not ordered(self.role, now, taken):
            yield CONTRACT, "", above.order
        if ran.line:
            yield UNREACHED, ran.table, ran.line
        if above is not None and not self._stands(before, ran.after):
            yield STANDS
        for fact, condition in self.facts.items():
            if not holds(condition, taken):
                yield GIVEN, "", fact
        for owed in self.owes:
            if not holds(owed.condition, {leaf: ran.after[here] for leaf, here in owed.written.items()}):
                yield Sort.OWED, "", owed.name
