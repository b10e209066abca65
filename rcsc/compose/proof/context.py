"""What an invariant shows of the lines of a level's tables, besides the obligations.

In: a transition system, and what was confirmed of it. Out: a `Context`:

- *unreached*: lines, DEFAULT included, that no reachable cycle runs, unless that is an obligation. They are dead in this system, though
  not in their table.
- *repeated*: leaves that a line changes which gives an order and then matches again, on the same inputs, before the order is echoed.
  Section 9 requires that there are none: each line does the same until its command is echoed.
- *restless*: whether the level would give order after order on constant inputs.
- *never*, *traps*: why lines are never reached, and which states nothing leaves (`stuck`).
- *vacuous*: requirements over time whose response no reachable cycle asks for: proved, and say nothing.

Each question is answered by Z3 from the invariant; what is not refuted is named, so the lists are never too short.
"""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.walk import reached_further
from rcsc.compose.contract.watched import asking, monitors
from rcsc.compose.invariant.confirm import Confirmation, may
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.proof.stuck import NeverReached, Trap, traps, why_never
from rcsc.lang.interpret import holds
from rcsc.lang.leaves import may_write
from rcsc.lang.model import Bool, Default, Kind, Value
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.search import halved
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class RepeatedLine:
    """A line that changes more leaves when it matches again."""

    table: str
    line: str
    leaves: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Context:
    """One level's lines in their context.

    Attributes:
        unreached: Tables and lines that no reachable cycle runs; `unsure`, those neither shown to be so nor seen to run.
        orders: Whether the level gives orders; else nothing is repeated.
        never: Why the unreached lines are; `traps`, states that nothing leaves.
        vacuous: Names of requirements that never ask.
    """

    unreached: tuple[tuple[str, str], ...]
    repeated: tuple[RepeatedLine, ...]
    restless: bool
    unsure: tuple[tuple[str, str], ...] = ()
    orders: bool = True
    never: tuple[NeverReached, ...] = ()
    traps: tuple[Trap, ...] = ()
    vacuous: tuple[str, ...] = ()


LineName: TypeAlias = tuple[str, str]
"""A table and a line."""


@dataclass(frozen=True, slots=True)
class _Start:
    """A cycle from the invariant, or one with which the level begins; the same cycle again; and its solver."""

    cycle: Cycle
    again: Cycle
    solver: Solver


def context(
    ts: TransitionSystem,
    asked: Confirmation,
    clauses: Sequence[Clause],
    ran: Mapping[LineName, Mapping[str, Value]] | None = None,
) -> Context:
    """Ask all questions; lines that `ran` on walks, each with a state after it, are known to be reached. Without walks none is sought."""
    walked, ran = ran is not None, ran or {}
    every = list(_starts(ts, asked, clauses))
    asked.rested_on += [start.solver for start in every]
    reached = {line for start in every for line in _reached(asked, start, ran)}
    lines = [line for line, _ in _lines(every[0].cycle)]
    unreached = tuple(line for line in lines if line not in ran and line not in reached)
    unsure = [line for line in lines if line not in unreached and line not in ran]
    further = reached_further(ts, unsure, ran) if walked and unsure else set()
    return Context(
        unreached,
        tuple(_every_repeated(ts, asked, every)),
        any(_restless(ts, asked, start) for start in every),
        tuple(line for line in unsure if line not in further),
        bool(ts.links.below),
        tuple(why_never(ts, asked, clauses, unreached)),
        tuple(traps(ts, asked, clauses, {*ran, *further})),
        tuple(_vacuous(ts, asked, every)),
    )


def never_run(asked: Confirmation, clauses: Sequence[Clause], ran: Container[LineName]) -> list[Node]:
    """List the conditions that a line never runs, for lines that no walk ran and the clauses allow."""
    solver = asked.known(clauses)
    return [
        values.negation(when)
        for line, when in _lines(asked.cycle)
        if line not in ran and may(solver, asked.keyed.term(when))
    ]


def never_asked(
    ts: TransitionSystem,
    asked: Confirmation,
    clauses: Sequence[Clause],
    states: Sequence[Mapping[str, Value]],
) -> list[Node]:
    """List the conditions that a requirement never asks, for those that asked on no walk and that the clauses allow to ask."""
    if not states:
        return []
    solver = asked.known(clauses)
    walked = {
        stated.name
        for stated, monitor in monitors(ts.program)
        if any(holds(monitor.asks, state) for state in states)
    }
    return [
        values.negation(asks)
        for name, asks in asking(ts.program, asked.cycle.after)
        if name not in walked and may(solver, asked.keyed.term(asks))
    ]


def _vacuous(ts: TransitionSystem, asked: Confirmation, every: Sequence[_Start]) -> Iterator[str]:
    """Yield the requirements that are refuted to ask in any cycle."""
    terms = [
        {name: asked.keyed.term(asks) for name, asks in asking(ts.program, start.cycle.after)}
        for start in every
    ]
    for start in every:
        start.solver.add(*asked.keyed.ranges)
    for name in terms[0]:
        if not any(may(start.solver, term[name]) for start, term in zip(every, terms, strict=True)):
            yield name


def _starts(ts: TransitionSystem, asked: Confirmation, clauses: Sequence[Clause]) -> Iterator[_Start]:
    """Yield a later cycle, and each with which the level may begin."""
    for at, cycle in enumerate((asked.cycle, *asked.firsts)):
        again = ts.cycle(cycle.after, f" again {at}", taken=cycle.taken)
        yield _Start(cycle, again, asked.beginning(cycle) if at else asked.known(clauses))


def gives_an_order(ts: TransitionSystem, cycle: Cycle) -> Node:
    """Return the condition that the cycle gives an order."""
    return values.any_of(orders_to(cycle, below) for below in ts.links.below)


def orders_to(cycle: Cycle, below: Below) -> Node:
    """Return the condition that the cycle gives this subordinate an order."""
    return values.negation(values.equal(cycle.before[below.number], cycle.after[below.number]))


def _lines(cycle: Cycle) -> Iterator[tuple[LineName, Node]]:
    """Yield each line with the condition that it runs; an unreachable DEFAULT is an obligation instead."""
    for at in cycle.every:
        for line, match in at.lines:
            if not (isinstance(line, Default) and line.unreachable):
                yield (str(at.table.name), str(line.name)), values.both(at.runs, match)


def _reached(asked: Confirmation, start: _Start, ran: Container[LineName]) -> Iterator[LineName]:
    """Yield the lines that are not refuted to run; not those that `ran`."""
    runs = [(line, asked.keyed.term(when)) for line, when in _lines(start.cycle) if line not in ran]
    start.solver.add(*asked.keyed.ranges)
    for line, term in runs:
        if may(start.solver, term):
            yield line


def _restless(ts: TransitionSystem, asked: Confirmation, start: _Start) -> bool:
    """Return whether an order may be given in both of two cycles on the same inputs."""
    sent = [asked.keyed.term(gives_an_order(ts, cycle)) for cycle in (start.cycle, start.again)]
    start.solver.add(*asked.keyed.ranges)
    return may(start.solver, *sent)


def _every_repeated(
    ts: TransitionSystem, asked: Confirmation, every: Sequence[_Start]
) -> Iterator[RepeatedLine]:
    """Merge, line by line, the leaves that a second match may change after any start, in declared order.

    Models name them in any order, another one each time that it is asked.
    """
    by_line: dict[LineName, set[str]] = {}
    for start in every:
        for line, leaves in _repeated(ts, asked, start):
            by_line.setdefault(line, set()).update(leaves)
    for where, changed in by_line.items():
        yield RepeatedLine(*where, tuple(leaf for leaf in lines_write(ts) if leaf in changed))


def _repeated(
    ts: TransitionSystem, asked: Confirmation, start: _Start
) -> Iterator[tuple[LineName, tuple[str, ...]]]:
    cycle, again, keyed = start.cycle, start.again, asked.keyed
    changed = {
        leaf: keyed.term(values.negation(values.equal(cycle.after[leaf], again.after[leaf])))
        for leaf in lines_write(ts)
    }
    lines = [
        (
            (str(table_at.table.name), str(line.name)),
            keyed.term(values.all_of((table_at.chosen, match, two.chosen, more))),
        )
        for table_at, two in zip(cycle.every, again.every, strict=True)
        for (line, match), (_, more) in zip(table_at.lines, two.lines, strict=True)
    ]
    gives = keyed.term(gives_an_order(ts, cycle))
    solver = start.solver
    solver.add(*keyed.ranges)
    changed = {leaf: solver.named(term) for leaf, term in changed.items()}
    twices = {line: solver.named(twice) for line, twice in lines}
    changes = smt.any_of(list(changed.values()))
    solver.push()
    solver.add(gives, changes)

    def never(several: Sequence[LineName]) -> bool:
        return not may(solver, smt.any_of([twices[line] for line in several]))

    for line in halved(list(twices), never):
        solver.push()
        solver.add(twices[line])
        leaves = tuple(_shown(solver, changed))
        solver.pop()
        if leaves:
            yield line, leaves
    solver.pop()


def _shown(solver: Solver, changed: dict[str, Term]) -> Iterator[str]:
    """Yield the leaves that are not refuted to change; one model names several."""
    left = dict(changed)
    while left:
        solver.push()
        solver.add(smt.any_of(list(left.values())))
        answer = solver.check()
        seen = (
            [leaf for leaf, term in left.items() if solver.value(term, Bool())]
            if answer is Answer.SATISFIABLE
            else []
        )
        solver.pop()
        if answer is Answer.UNKNOWN:
            yield from left
            return
        if not seen:
            return
        yield from seen
        left = {leaf: term for leaf, term in left.items() if leaf not in seen}


def lines_write(ts: TransitionSystem) -> list[str]:
    """List states and outputs, except those that only the preprocess writes: a test variable is no effect of a line.

    Nor is it one of a line that time goes on while an order is not echoed.
    """
    clocks = ts.program.roles.clocks if ts.program.roles is not None else frozenset()
    before = {str(leaf) for name in ts.level.preprocess for leaf in ts.procedures[name].writes}
    later = {str(leaf) for name in ts.level.postprocess for leaf in ts.procedures[name].writes}
    lines = of_lines(ts) | later
    return [
        str(v.name)
        for v in ts.program.variables
        if v.kind is not Kind.INPUT and (v.name in lines or v.name not in before) and v.name not in clocks
    ]


def of_lines(ts: TransitionSystem) -> set[str]:
    """Collect the leaves that the lines of all tables write."""
    lines = (line for table in ts.program.tables for line in table.every_line)
    return set(
        map(str, may_write((action.statement for line in lines for action in line.actions), ts.procedures))
    )
