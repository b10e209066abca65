"""What is proved of every level, as conditions on one cycle from any reachable state.

In: a transition system and a cycle from any state. Out: `Obligation`s, each of which must hold in every cycle. Some concern the level
alone; the others are its guarantees, which its neighbours assume (`compose.__doc__`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import TypeAlias

from rcsc.compose.contract.claims import KEPT, SAFE
from rcsc.compose.contract.environment import Above, Below, leaves_under
from rcsc.compose.contract.properties import invariants, kept_within, owed, properties
from rcsc.compose.contract.transition import Cycle, TableAt, TransitionSystem, successor
from rcsc.compose.contract.watched import can_be_kept
from rcsc.lang.interval_sets import meet
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Bool, Enum, Kind, Line, OneTable, Program, Table, pending
from rcsc.lang.restart import After, Stands
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node
from rcsc.proof.table import boxes

FLAG = "new_command"
"""True until the level's own answer to a new command is echoed (sections 8.3 and 9)."""
ANSWER, SETTLES = "answered", "settling"
"""Where roles are declared: a line has answered the new command; the line of this cycle puts the answer off."""


class Sort(StrEnum):
    """The sort of an obligation; the value is the text shown for it."""

    ASSUMPTION = "assumption"
    SOME_LINE = "some line matches"
    ONE_LINE = "no two lines match"
    NO_DEFAULT = "DEFAULT is not reached"
    ECHOES = "the report echoes the command that it answers"
    NUMBERED = "the order changes only with its number"
    NEXT_NUMBER = "numbers are used one after the other"
    WAITS = "no other command replaces an order before its echo, but for a new command"
    ONCE = "a command number is taken up once"
    ANSWERED = "no new command is passed over"
    SAME_ORDER = "no other order comes under the number that was taken last"
    OF_ITS_ORDER = "what is reported under the number of the last order is about that order"
    PAUSES = "a PAUSE is passed on in the cycle that takes it"
    DEFERRED = "no state is written directly while another is pending"
    DONE_STAYS = (
        "done stays done"  # of a level that writes the protocol by hand; others state it as a property
    )
    FAILED_STAYS = "failed stays failed"
    OWED = "its outputs are as other levels assume"
    INVARIANT = "invariant"
    PROPERTY = "property"
    REQUIREMENT = "requirement"  # over time: a condition on a cycle and the ghosts of its monitor
    KEPT = (
        KEPT  # what is assumed over time of what comes from outside: no cycle leads to where nothing keeps it
    )
    ENDS = "the command ends"  # not a condition on one cycle: `termination`, `lasso`
    PROTOCOL = "orders and reports"  # all of its sorts at once
    SAFE = SAFE[0]


BROKEN = {
    Sort.NO_DEFAULT: "DEFAULT is reached",
    Sort.ECHOES: "the report does not echo the command that it answers",
    Sort.NUMBERED: "`{}` changes, its number does not",
    Sort.NEXT_NUMBER: "the number of `{}` is not the next one",
    Sort.WAITS: "another command replaces an order of `{}` that is not echoed",
    Sort.ONCE: "a command number is taken up again",
    Sort.ANSWERED: "the new command is passed over: seen once more, `{}` is down",
    Sort.DONE_STAYS: "an order that was done is reported otherwise",
    Sort.FAILED_STAYS: "an order that has failed is reported otherwise",
    Sort.DEFERRED: "`{}` is written directly while another value is pending",
    Sort.OWED: "its outputs are not as `{}` says",
    Sort.INVARIANT: "invariant `{}` does not hold",
    Sort.PROPERTY: "property `{}` is broken",
    Sort.REQUIREMENT: "requirement `{}` is broken",
    Sort.KEPT: "no inputs were found that keep assumption `{}` in the cycle after it",
    Sort.SAFE: "within it an invariant does not hold under which its operations are safe",
    Sort.SAME_ORDER: "another order under the number that was taken last: it is not seen as new",
    Sort.OF_ITS_ORDER: "what is reported under the number of the last order is not about it",
}
"""What is printed when a cycle breaks an obligation, `{}` being its name; other sorts print their lines or assumption."""

ObligationKey: TypeAlias = tuple[Sort, str, str]
"""Identifies an obligation of a level: the key of a claim (`claims`)."""


@dataclass(frozen=True, slots=True)
class Unstated:
    """A sort of obligation that is not stated: part of the level was not recognised, or it does not apply.

    Attributes:
        applies: Whether it might: then the level is not wholly proved.
    """

    sort: Sort
    table: str
    missing: str
    applies: bool = True

    @property
    def shown(self) -> str:
        """Its text in one line."""
        table = f"table `{self.table}`: " if self.table else ""
        return f"{table}{self.sort.value}: {self.missing}"


@dataclass(frozen=True, slots=True)
class Obligation:
    """A condition that every cycle has to fulfil.

    Attributes:
        table: Its table; empty if it is the level's.
        name: The assumption, buffer or leaf; or both lines of a pair.
        holds: The condition.
        lines: The two lines that it is about (`pairs`).
    """

    sort: Sort
    table: str
    name: str
    holds: Node
    lines: tuple[str, ...] = ()

    @property
    def key(self) -> ObligationKey:
        """Its identity, the same in every cycle."""
        return self.sort, self.table, self.name

    @property
    def shown(self) -> str:
        """Its text in one line, without the table."""
        if self.sort in {Sort.ASSUMPTION, Sort.INVARIANT, Sort.PROPERTY, Sort.REQUIREMENT}:
            return f"{self.sort.value} `{self.name}`"
        if self.sort is Sort.KEPT:
            return f"assumption `{self.name}` {self.sort.value}"
        if self.lines:
            return "lines {} do not both match".format(" and ".join(f"`{line}`" for line in self.lines))
        return f"{self.sort.value}: `{self.name}`" if self.name else self.sort.value


def of_requirement(name: str) -> ObligationKey:
    """Return the key of the obligation that a requirement over time is kept."""
    return Sort.REQUIREMENT, "", name


def obligations(ts: TransitionSystem, cycle: Cycle) -> tuple[Obligation, ...]:
    """List all obligations of a level, those of its tables first; or those that are asked about (`TransitionSystem.only`)."""
    if ts.only is not None:
        about = {key for name in ts.only for key in (of_requirement(name), (Sort.PROPERTY, "", name))}
        return tuple(owed for owed in _stated(ts, cycle) if owed.key in about)
    return (
        *_tables(cycle),
        *_upward(ts, cycle),
        *_downward(ts, cycle),
        *_own(ts, cycle),
        *_stated(ts, cycle),
    )


def _tables(cycle: Cycle) -> Iterator[Obligation]:
    for at in cycle.every:
        name = str(at.table.name)
        for assumption, condition in at.assumptions.items():
            yield Obligation(Sort.ASSUMPTION, name, assumption, values.follows(at.chosen, condition))
        some = values.follows(at.runs, values.negation(at.none))
        if at.table.default is None:
            yield Obligation(Sort.SOME_LINE, name, "", some)
        elif at.table.default.unreachable:
            yield Obligation(Sort.NO_DEFAULT, name, "", some)
        yield Obligation(Sort.ONE_LINE, name, "", values.follows(at.runs, values.negation(at.several())))


def pairs(cycle: Cycle) -> tuple[Obligation, ...]:
    """State for each pair of lines that they never both match, to refute one where `ONE_LINE` is not proved."""
    exclusions = []
    for at in cycle.every:
        for earlier, later in may_meet(at.table):
            first, second = (str(at.table.lines[place].name) for place in (earlier, later))
            never = values.negation(values.both(at.matches[earlier], at.matches[later]))
            obligation = values.follows(at.runs, never)
            exclusions.append(
                Obligation(
                    Sort.ONE_LINE, str(at.table.name), f"{first} and {second}", obligation, (first, second)
                )
            )
    return tuple(exclusions)


def may_meet(table: Table) -> list[tuple[int, int]]:
    """List the pairs of lines whose cells do not exclude each other; all pairs if some cell reads several leaves."""
    every = combinations(range(len(table.lines)), 2)
    if not boxes.applies(table):
        return list(every)
    lines = boxes.lines_of(table)
    return [
        (earlier, later)
        for earlier, later in every
        if all(
            meet(lines[earlier][name], lines[later][name])
            for name in lines[earlier].keys() & lines[later].keys()
        )
    ]


def _upward(ts: TransitionSystem, cycle: Cycle) -> Iterator[Obligation]:
    """State the superior's assumptions about this level."""
    if (above := ts.links.above) is None:
        return
    number = values.equal(cycle.after[above.echo], cycle.taken[above.number])
    command = values.equal(cycle.after[above.echoed], cycle.taken[above.command])
    as_before = values.all_of(  # after a refused result the report may be as late as if the level had not run
        values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in leaves_under(ts.program, above.report)
    )
    # without the echo that a restart keeps in the report, an older report may follow a newer one
    kept = (ts.program.adopted.get(leaf) == Stands() for leaf in (above.echo, above.echoed))
    stood = not cycle.anew or all(kept)
    late = values.all_of((cycle.refused, as_before, values.truth(stood)))
    yield Obligation(Sort.ECHOES, "", above.report, values.either(values.both(number, command), late))
    if ts.program.roles is None:
        yield from _answer_stays(ts, cycle, above)


def _answer_stays(ts: TransitionSystem, cycle: Cycle, above: Above) -> Iterator[Obligation]:
    """State that an answer to the order taken last stays, unless the command rests; after a restart that answer is *failed*.

    Levels that declare whom they serve state it as properties. No proof of a neighbour takes it for granted: the contract says nothing of
    a status. That an answer comes and stays is shown by a level's own termination, on which that of its superior rests.
    """
    kind = ts.kinds[above.status]
    if not isinstance(kind, Enum):
        return
    rests = values.equal(cycle.before[above.command], values.constant(ts.kinds[above.command], 0))
    same = values.equal(cycle.taken[above.command], cycle.before[above.command])
    about, again = (
        values.equal(leaves[above.echo], cycle.before[above.number]) for leaves in (cycle.before, cycle.after)
    )
    for sort, member in ((Sort.DONE_STAYS, above.done), (Sort.FAILED_STAYS, above.failed)):
        if member not in kind.members:
            continue
        said = values.constant(kind, kind.members.index(member))
        answered = values.both(about, values.equal(cycle.before[above.status], said))
        if cycle.anew:
            answered = values.truth(sort is Sort.FAILED_STAYS)
        asked = values.all_of((answered, again, same, values.negation(rests)))
        yield Obligation(
            sort, "", above.report, values.follows(asked, values.equal(cycle.after[above.status], said))
        )


def _downward(ts: TransitionSystem, cycle: Cycle) -> Iterator[Obligation]:
    """State the subordinates' assumptions about this level, and that it waits for them."""
    for below in ts.links.below:
        before, after = cycle.before[below.number], cycle.after[below.number]
        same = values.equal(before, after)
        for leaf in leaves_under(ts.program, below.order):
            if leaf != below.number and leaf not in below.streams:
                kept = values.equal(cycle.before[leaf], cycle.after[leaf])
                yield Obligation(Sort.NUMBERED, "", leaf, values.follows(same, kept))
        counts = values.either(same, values.equal(after, successor(before)))
        if cycle.anew:
            counts = values.both(counts, values.truth(counts_on(ts, below)))
        yield Obligation(Sort.NEXT_NUMBER, "", below.order, counts)
        if ts.links.above is not None:
            kept = values.equal(cycle.before[below.command], cycle.after[below.command])
            yield Obligation(Sort.WAITS, "", below.order, values.follows(_waiting(ts, cycle, below), kept))
            if not list(_no_pause(ts, below)):
                yield Obligation(Sort.PAUSES, "", below.order, _passes_on_a_pause(ts, cycle, below))


def counts_on(ts: TransitionSystem, below: Below) -> bool:
    """Return whether a restart gives the order a number that none had before: the subordinate may have taken any earlier one."""
    return ts.program.adopted.get(below.number) == After(below.echo)


def command_stays(ts: TransitionSystem, cycle: Cycle) -> Node:
    """Return the condition that a level with a superior takes the same order as in the cycle before."""
    above = ts.links.above
    assert above is not None
    return values.equal(cycle.before[above.number], cycle.taken[above.number])


def _waiting(ts: TransitionSystem, cycle: Cycle, below: Below) -> Node:
    """Return the condition that the command stays and the order below is neither echoed nor too late."""
    echoed = values.equal(cycle.taken[below.echo], cycle.before[below.number])
    late = values.FALSE if below.late is None else cycle.middle[below.late]
    return values.both(command_stays(ts, cycle), values.negation(values.either(echoed, late)))


def _passes_on_a_pause(ts: TransitionSystem, cycle: Cycle, below: Below) -> Node:
    """Return the condition that a new PAUSE (the first command) is ordered below by the end of the cycle that takes it."""
    above = ts.links.above
    assert above is not None
    paused = values.equal(cycle.taken[above.command], values.constant(ts.kinds[above.command], 0))
    passes = values.equal(cycle.after[below.command], values.constant(ts.kinds[below.command], 0))
    new = values.negation(values.either(cycle.untaken, command_stays(ts, cycle)))
    return values.follows(values.both(new, paused), passes)


def _own(ts: TransitionSystem, cycle: Cycle) -> Iterator[Obligation]:
    above = ts.links.above
    if above is not None and has_flag(ts):
        rises = values.both(cycle.after[FLAG], values.negation(cycle.before[FLAG]))
        once = values.follows(command_stays(ts, cycle), values.negation(rises))
        yield Obligation(Sort.ONCE, "", FLAG, once)
        again = ts.middle(cycle.after, " again", cycle.taken)[FLAG]
        for at in cycle.tables:
            overlooking = _overlooking(ts, cycle, at)
            ends = bool(at.table.stops) or asks(ts.program) or ts.program.roles is not None
            if overlooking or (overlooking is not None and ends):
                yield _answered(cycle, at, overlooking, again)
    for variable in ts.program.variables:
        if variable.deferred_until is not None:
            untouched = values.equal(cycle.after[variable.name], cycle.prepared[variable.name])
            agreed = values.equal(cycle.after[variable.name], cycle.after[pending(variable.name)])
            holds = values.any_of((cycle.untaken, untouched, agreed))
            yield Obligation(Sort.DEFERRED, "", str(variable.name), holds)


def has_flag(ts: TransitionSystem) -> bool:
    """Return whether the level keeps the flag of a new command."""
    return any(
        v.name == FLAG and v.kind is Kind.STATE and isinstance(v.type, Bool) for v in ts.program.variables
    )


def unstated(ts: TransitionSystem) -> tuple[Unstated, ...]:
    """List the obligations that cannot be stated, each with the reason."""
    return tuple(_unstated(ts))


def _unstated(ts: TransitionSystem) -> Iterator[Unstated]:
    links = ts.links
    for missing in links.unread:
        yield Unstated(Sort.PROTOCOL, "", missing)
    if links.above is not None and ts.level.stages and not _by_its_orders(ts):
        last = ", ".join(f"`{name}`" for name in ts.level.tables.names)
        missing = (
            f"the level takes orders, and what runs last in its cycle, {last}, is not chosen by their command"
        )
        yield Unstated(Sort.PROTOCOL, "", missing)
    if links.above is None:
        if links.below:
            for sort in (Sort.WAITS, Sort.PAUSES, Sort.ENDS):
                yield Unstated(sort, "", "the level takes no orders", ts.program.roles is None)
        return
    for below in links.below:
        for missing in _no_pause(ts, below):
            yield Unstated(Sort.PAUSES, "", missing)
    if not has_flag(ts):
        for sort in (Sort.ONCE, Sort.ANSWERED):
            yield Unstated(sort, "", f"there is no state `{FLAG} : bool`")
        return
    for table in run_by(ts):
        if any(looks_for(FLAG, line) for line in table.lines):
            continue
        if ts.program.roles is None and not _rests(ts, table):
            yield Unstated(Sort.ANSWERED, str(table.name), f"no line looks at `{FLAG}`")
        elif ts.program.roles is not None and not _keeps(ts, table):
            why = f"its lines look neither at `{FLAG}` nor at anything that the level keeps"
            yield Unstated(Sort.ANSWERED, str(table.name), why, applies=False)


def _by_its_orders(ts: TransitionSystem) -> bool:
    """Return whether the table that runs last is chosen by the superior's command: those before it are then like a preprocess."""
    last, above = ts.level.tables, ts.links.above
    assert above is not None
    return not isinstance(last, OneTable) and list(read_by(last.selector)) == [above.command]


def _keeps(ts: TransitionSystem, table: Table) -> bool:
    """Return whether a table of a command reads a state that the level itself keeps: it may stem from the command before."""
    roles = ts.program.roles
    assert roles is not None
    kept = {
        str(v.name) for v in ts.program.variables if v.kind is not Kind.INPUT and not roles.makes(str(v.name))
    }
    return not _rests(ts, table) and any(looks_for(leaf, line) for leaf in kept for line in table.lines)


def _no_pause(ts: TransitionSystem, below: Below) -> Iterator[str]:
    """Yield reasons why PAUSE is not recognised: it is the first command, with a table of its own."""
    assert ts.links.above is not None
    if isinstance(ts.level.tables, OneTable) and ts.program.roles is None:
        yield "the level has one table for all commands"
    for leaf in (ts.links.above.command, below.command):
        if not isinstance(ts.kinds[leaf], Enum):
            yield f"`{leaf}` is no enumeration"


def pause_of(ts: TransitionSystem) -> str:
    """Return the first command that the level takes, PAUSE or its like, which a restart of its superior orders; empty for none."""
    kind = None if ts.links.above is None else ts.kinds[ts.links.above.command]
    return kind.members[0] if isinstance(kind, Enum) else ""


def resting_table(ts: TransitionSystem) -> str:
    """Return the table of the first command; empty for none."""
    chosen = ts.level.tables
    return str(chosen.table if isinstance(chosen, OneTable) else dict(chosen.tables).get(0, ""))


def run_by(ts: TransitionSystem) -> list[Table]:
    """List the tables that the level runs last: where it has a superior, those of its commands."""
    return [table for table in ts.program.tables if table.name in ts.level.tables.names]


def _rests(ts: TransitionSystem, table: Table) -> bool:
    """Return whether the table serves only the first command (such as PAUSE): new or not, it does the same."""
    chosen = ts.level.tables
    return not isinstance(chosen, OneTable) and [
        value for value, name in chosen.tables if name == table.name
    ] == [0]


def _stated(ts: TransitionSystem, cycle: Cycle) -> Iterator[Obligation]:
    """State the invariants and properties of the program, that its assumptions can be kept, and the facts that it owes other levels."""
    for name, holds in invariants(ts.program, cycle):
        yield Obligation(Sort.INVARIANT, "", name, holds)
    for stated, holds in properties(ts.program, cycle):
        yield Obligation(Sort(stated.word), "", stated.name, holds)
    for name, holds in can_be_kept(ts.program, cycle.after):
        yield Obligation(Sort.KEPT, "", name, holds)
    for name, holds in owed(ts.links, cycle):
        yield Obligation(Sort.OWED, "", name, holds)
    if ts.safety.within:
        yield Obligation(Sort.SAFE, "", "", kept_within(ts.program, cycle, ts.safety.invariants))


def asks(program: Program) -> bool:
    """Return whether a cycle can end early because an extern procedure is refused."""
    return any(procedure.extern is not None for procedure in program.procedures)


def _overlooking(ts: TransitionSystem, cycle: Cycle, at: TableAt) -> tuple[Node, ...] | None:
    """List conditions under which a line ignores the flag: it matches with the flag up and down, all else equal.

    None if no line reads the flag, and nothing shows that one should. DEFAULT never reads it.
    """
    if not any(looks_for(FLAG, line) for line in at.table.lines) and (
        ts.program.roles is None or not _keeps(ts, at.table)
    ):
        return None
    up, down = (ts.matches(cycle, at.table, {FLAG: flag}) for flag in (values.TRUE, values.FALSE))
    blind = [
        values.both(*alike)
        for line, *alike in zip(at.table.lines, up, down, strict=True)
        if not _asks_for(FLAG, line)
    ]
    default = at.table.default
    return (*blind, *([] if default is None or default.unreachable else [at.none]))


def _asks_for(flag: str, line: Line) -> bool:
    """Return whether a cell of the line tests only the flag, for one value."""
    whole = ((0, 1),)
    return any(
        test.box not in (None, whole) and [*map(str, test.variables)] == [flag] for test in line.stated
    )


def looks_for(leaf: str, line: Line) -> bool:
    """Return whether a cell of the line reads the leaf."""
    return any(leaf in map(str, read_by(condition)) for condition in line.conditions)


def _answered(cycle: Cycle, at: TableAt, overlooking: tuple[Node, ...], again: Node) -> Obligation:
    """State that a new command's flag stays up over each line that ignores it, and over each cycle that ends early.

    If it is down when the level sees the same inputs `again`, no line will answer the command, and the report of this
    line is taken for the answer.
    """
    missed = values.any_of(overlooking)
    passed = values.all_of((at.chosen, values.negation(at.several()), missed))
    passed = values.either(passed, values.both(at.selected, cycle.interrupted))
    flagged = values.both(cycle.middle[FLAG], passed)
    return Obligation(Sort.ANSWERED, str(at.table.name), FLAG, values.follows(flagged, again))
