"""What an invariant tells of the lines of a level's tables, besides the goals.

In: a stepper, and what was confirmed of it. Out: a `Context`:

- *unreached*: lines that no reachable cycle runs, a DEFAULT line too, but where that is a goal. Dead in this system, though not in
  their table.
- *repeated*: what else a line does that gives an order and then matches again, on the same inputs, before the order is echoed.
  Section 9 asks that there be nothing: each line is to say the same until its command is echoed.
- *restless*: levels that would give order after order on inputs that stay the same.

Each question is answered by Z3 from the invariant; what is not refuted is named, so the lists are never too short.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rcsc.compose.confirm import Confirmation
from rcsc.compose.contract import NUMBER
from rcsc.compose.frames import Clause
from rcsc.compose.transition import Cycle, Stepper
from rcsc.model import Bool, Call, Default, Kind, Statement
from rcsc.prove import smt, values
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.prove.values import Node
from rcsc.resolve.leaves import everything, written_by


@dataclass(frozen=True, slots=True)
class Again:
    """A line that does more when it matches again, and to which leaves."""

    table: str
    line: str
    leaves: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Context:
    """What was found of one level; `unreached` are tables and lines."""

    unreached: tuple[tuple[str, str], ...]
    repeated: tuple[Again, ...]
    restless: bool


def context(stepper: Stepper, asked: Confirmation, clauses: Sequence[Clause]) -> Context:
    """Asks all of it."""
    cycle = asked.cycle
    again = stepper.cycle(cycle.after, " again", taken=cycle.taken)
    sent = gives_an_order(stepper, cycle)
    return Context(
        tuple(_unreached(asked, clauses)),
        tuple(_repeated(stepper, asked, clauses, again, sent)),
        _possible(asked, clauses, (sent, gives_an_order(stepper, again))),
    )


def gives_an_order(stepper: Stepper, cycle: Cycle) -> Node:
    """That the cycle gives an order."""
    numbers = [f"{below.order}.{NUMBER}" for below in stepper.links.below]
    return values.any_of(
        values.negation(values.equal(cycle.before[name], cycle.after[name])) for name in numbers
    )


def _possible(asked: Confirmation, clauses: Sequence[Clause], conditions: Sequence[Node]) -> bool:
    terms = [asked.keyed.term(one) for one in conditions]
    solver = asked.known(clauses)
    asked.rested_on.append(solver)
    solver.add(*asked.keyed.ranges, *terms)
    return solver.check() is not Answer.UNSATISFIABLE


def _unreached(asked: Confirmation, clauses: Sequence[Clause]) -> Iterator[tuple[str, str]]:
    lines = [
        (str(at.table.name), str(line.name), asked.keyed.term(values.both(at.chosen, match)))
        for at in asked.cycle.tables
        for line, match in at.lines
        if not (isinstance(line, Default) and line.unreachable)  # a goal
    ]
    solver = asked.known(clauses)
    asked.rested_on.append(solver)
    for table, line, runs in lines:
        if not may(solver, runs):
            yield table, line


def may(solver: Solver, *terms: Term) -> bool:
    """Whether they are not refuted."""
    solver.push()
    solver.add(*terms)
    answer = solver.check()
    solver.pop()
    return answer is not Answer.UNSATISFIABLE


def _repeated(
    stepper: Stepper, asked: Confirmation, clauses: Sequence[Clause], again: Cycle, sent: Node
) -> Iterator[Again]:
    """Line by line, the leaves that a second match may change."""
    cycle, keyed = asked.cycle, asked.keyed
    changed = {
        leaf: keyed.term(values.negation(values.equal(cycle.after[leaf], again.after[leaf])))
        for leaf in _of_lines(stepper)
    }
    lines = [
        (
            str(one.table.name),
            str(line.name),
            keyed.term(values.all_of((one.chosen, match, two.chosen, more))),
        )
        for one, two in zip(cycle.tables, again.tables, strict=True)
        for line, match, more in zip(one.table.lines, one.matches, two.matches, strict=True)
    ]
    gives = keyed.term(sent)
    solver = asked.known(clauses)
    asked.rested_on.append(solver)
    solver.add(*keyed.ranges, gives)
    for table, line, twice in lines:
        solver.push()
        solver.add(twice)
        leaves = tuple(_shown(solver, changed))
        solver.pop()
        if leaves:
            yield Again(table, line, leaves)


def _shown(solver: Solver, changed: dict[str, Term]) -> Iterator[str]:
    """The leaves of which it is not refuted that they change, a model naming several at once."""
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


def _of_lines(stepper: Stepper) -> list[str]:
    """States and outputs that more than the preprocess writes: a test variable is no effect of a line."""
    before = {str(leaf) for name in stepper.level.preprocess for leaf in stepper.procedures[name].writes}
    later = {str(leaf) for name in stepper.level.postprocess for leaf in stepper.procedures[name].writes}
    lines = of_lines(stepper) | later
    return [
        str(v.name)
        for v in stepper.program.variables
        if v.kind is not Kind.INPUT and (v.name in lines or v.name not in before)
    ]


def of_lines(stepper: Stepper) -> set[str]:
    """What some line of some table writes."""
    found = set()
    for table in stepper.program.tables:
        every = [*(line.actions for line in table.lines), *([table.default.actions] if table.default else [])]
        for actions in every:
            for action in actions:
                found |= _written(stepper, action.statement)
    return found


def _written(stepper: Stepper, statement: Statement) -> set[str]:
    found: set[str] = set()
    for one in everything((statement,)):
        found |= set(map(str, written_by(one)))
        if isinstance(one, Call):
            found |= set(map(str, stepper.procedures[one.procedure].writes))
    return found
