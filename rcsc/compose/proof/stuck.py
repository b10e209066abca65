"""Why lines are never reached, and which states nothing leaves.

In: a transition system, what was confirmed of it, its lines that no reachable cycle runs. Out: a `NeverReached` for each of these, and
`Trap`s.

- A line is never reached because some of its cells never hold together where its table runs: the fewest are named, and for a single one
  about a value of the level's own the lines that would bring it about.
- A trap is a set of values of an enumeration that the level keeps and its lines test: it can be entered, and no cycle leaves it, whatever
  the environment gives, but for a restart. Of a deferred state the next value is looked at, which the state takes sooner or later.

Both are claimed only where Z3 refutes the contrary from the invariant. A set that nothing leaves is found from its members: each is asked
for a cycle that leaves it, what that shows is added, and members that lead to each other are one set (`ranking.parts`). A set that the
level begins in, or that is all that it ever has, is no trap.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem
from rcsc.compose.invariant.confirm import Confirmation, may
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.proof.ranking import parts
from rcsc.lang.interpret import initial
from rcsc.lang.leaves import may_write, read_by
from rcsc.lang.model import Enum, Kind, Line, Test, earlier, key_of, pending
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.keyed import Keyed, sort
from rcsc.proof.symbolic.values import Node

LineName = tuple[str, str]
"""A table and a line."""
MOST_MEMBERS = 64
"""Members of an enumeration that is looked at for traps."""


@dataclass(frozen=True, slots=True)
class NeverReached:
    """Why no reachable cycle runs a line.

    Attributes:
        idle: Whether its table never runs.
        columns: Those of its conditions that never hold together where its table runs, the fewest that were found; none of DEFAULT.
        leaf: The value of the level's own that a single one is about; "" for none.
        sets: The lines that would make that condition true, which are never reached either; none if no line does.
    """

    table: str
    line: str
    idle: bool = False
    columns: tuple[int, ...] = ()
    leaf: str = ""
    sets: tuple[LineName, ...] = ()


@dataclass(frozen=True, slots=True)
class Trap:
    """Values that a level, once it has one of them, has for ever.

    Attributes:
        leaf: The enumeration; `members`, its values there, in declared order.
        enters: The lines that lead there from elsewhere, and `seen`, whether one of them ran on a walk.
        leaves: The lines that would lead out of it, none of which is reached there.
        stated: The property that says that it is to be so; "" for none.
    """

    leaf: str
    members: tuple[str, ...]
    enters: tuple[LineName, ...]
    seen: bool
    leaves: tuple[LineName, ...] = ()
    stated: str = ""


# --- lines -----------------------------------------------------------------------------------


def why_never(
    ts: TransitionSystem, asked: Confirmation, clauses: Sequence[Clause], unreached: Sequence[LineName]
) -> Iterator[NeverReached]:
    """Yield the reason of each line that is never reached."""
    if not unreached:
        return
    places = [
        _Place(ts, asked, cycle, asked.beginning(cycle) if at else asked.known(clauses))
        for at, cycle in enumerate((asked.cycle, *asked.firsts))
    ]
    lines = {
        (str(table.name), str(line.name)): line for table in ts.program.tables for line in table.every_line
    }
    for table, name in unreached:
        if all(place.never(table, ()) for place in places):
            yield NeverReached(table, name, idle=True)
            continue
        line = lines[table, name]
        if not isinstance(line, Line):
            yield NeverReached(table, name)
            continue
        cells = [(column, test) for column, test in enumerate(line.tests) if test is not None]
        few = _fewest(cells, places, table)
        leaf = _own(ts, few[0][1]) if len(few) == 1 else ""
        sets = _making(ts, asked, few[0][1], leaf) if leaf else ()
        yield NeverReached(table, name, columns=tuple(column for column, _ in few), leaf=leaf, sets=sets)


class _Place:
    """A cycle in which lines may run, and its solver."""

    def __init__(self, ts: TransitionSystem, asked: Confirmation, cycle: Cycle, solver: Solver) -> None:
        self._ts, self._asked, self._cycle, self._solver = ts, asked, cycle, solver

    def never(self, table: str, tests: Collection[Test]) -> bool:
        """Return whether these conditions are refuted to hold together where the table runs."""
        at = next(each for each in self._cycle.every if each.table.name == table)
        run = Run(self._ts.procedures, self._ts.kinds, dict(_seen_by(self._ts, self._cycle, table)))
        term = self._asked.keyed.term(
            values.all_of((at.runs, *(run.evaluate(test.condition) for test in tests)))
        )
        self._solver.add(*self._asked.keyed.ranges)
        return not may(self._solver, term)


def _seen_by(ts: TransitionSystem, cycle: Cycle, table: str) -> Leaves:
    """Return the leaves as a table sees them."""
    stages = (at for at, stage in enumerate(ts.level.stages) if table in stage.names)
    place = next(stages, None)
    return cycle.middle if place is None else cycle.seen[place]


def _fewest(
    cells: Sequence[tuple[int, Test]], places: Sequence[_Place], table: str
) -> list[tuple[int, Test]]:
    """Return cells that never hold together, a single one if there is one, and of several as few as leaving out one by one finds."""

    def never(some: Sequence[tuple[int, Test]]) -> bool:
        return all(place.never(table, [test for _, test in some]) for place in places)

    for cell in cells:
        if never([cell]):
            return [cell]
    few = list(cells)
    for cell in cells:
        rest = [other for other in few if other is not cell]
        if never(rest):
            few = rest
    return few


def _own(ts: TransitionSystem, test: Test) -> str:
    """Return the state or output that the condition alone is about, if lines can write it; else ""."""
    leaves = set(map(str, read_by(test.condition)))
    kinds = {str(v.name): v.kind for v in ts.program.variables}
    leaf = leaves.pop() if len(leaves) == 1 else ""
    return leaf if leaf and kinds.get(leaf) not in {None, Kind.INPUT} else ""


def _making(ts: TransitionSystem, asked: Confirmation, test: Test, leaf: str) -> tuple[LineName, ...]:
    """Return the lines that could make the condition true, from any state whatever."""
    cycle, target = asked.cycle, _target(ts, leaf)
    before, after = (
        Run({}, {}, {leaf: leaves[target]}).evaluate(test.condition) for leaves in (cycle.before, cycle.after)
    )
    makes = values.both(values.negation(before), after)
    return tuple(_lines_that(asked, (), makes, _writing(ts, target)))


def _target(ts: TransitionSystem, leaf: str) -> str:
    """Return the leaf that lines write of a state: of a deferred one its next value."""
    deferred = any(v.name == leaf and v.deferred_until is not None for v in ts.program.variables)
    return str(pending(leaf)) if deferred else leaf


def _writing(ts: TransitionSystem, target: str) -> set[LineName]:
    """Return the lines that may write the leaf."""
    return {
        (str(table.name), str(line.name))
        for table in ts.program.tables
        for line in table.every_line
        if target in set(map(str, may_write((action.statement for action in line.actions), ts.procedures)))
    }


def _lines_that(
    asked: Confirmation, clauses: Sequence[Clause], does: Node, among: Collection[LineName]
) -> Iterator[LineName]:
    """Yield those of these lines that may run in a cycle of which this holds, and before which the clauses hold."""
    solver = asked.known(clauses)
    runs = {
        (str(at.table.name), str(line.name)): asked.keyed.term(values.both(at.runs, match))
        for at in asked.cycle.every
        for line, match in at.lines
    }
    solver.add(asked.keyed.term(does), *asked.keyed.ranges)
    for line, when in runs.items():
        if line in among and may(solver, when):
            yield line


# --- states ----------------------------------------------------------------------------------


def traps(
    ts: TransitionSystem,
    asked: Confirmation,
    clauses: Sequence[Clause],
    ran: Collection[LineName],
) -> Iterator[Trap]:
    """Yield the sets of values that can be entered and that nothing leaves."""
    for leaf, kind in _tested(ts):
        for members in _closed(ts, asked, clauses, leaf, kind):
            target = _target(ts, leaf)
            goes_in, goes_out = _moves(asked.cycle, target, members)
            among = _writing(ts, target)
            enters = tuple(_lines_that(asked, clauses, goes_in, among))
            if enters:
                yield Trap(
                    leaf,
                    tuple(kind.members[at] for at in sorted(members)),
                    enters,
                    not set(ran).isdisjoint(enters),
                    tuple(_lines_that(asked, (), goes_out, among)),
                    _stated(ts, leaf, kind, members),
                )


def _tested(ts: TransitionSystem) -> Iterator[tuple[str, Enum]]:
    """Yield the enumerations that the level keeps and lines of its tables test."""
    read = {
        str(name)
        for table in ts.program.tables
        for line in table.lines
        for test in line.stated
        for name in read_by(test.condition)
    }
    for v in ts.program.variables:
        kept = v.kind is not Kind.INPUT and v.previous_of is None and v.name in read
        if kept and isinstance(v.type, Enum) and len(v.type.members) <= MOST_MEMBERS:
            yield str(v.name), v.type


def _closed(
    ts: TransitionSystem, asked: Confirmation, clauses: Sequence[Clause], leaf: str, kind: Enum
) -> Iterator[frozenset[int]]:
    """Yield the sets of members that nothing leaves and that the level does not begin in."""
    target = _target(ts, leaf)
    before, after = asked.cycle.before[target], asked.cycle.after[target]
    ends = asked.keyed.term(before), asked.keyed.term(after)
    solver = asked.known(clauses)
    solver.add(*asked.keyed.ranges)
    ends = solver.named(ends[0]), solver.named(ends[1])
    asked.rested_on.append(solver)
    begins = {key_of(kind, initial(ts.program)[target])}
    every = range(len(kind.members))
    known = {at: smt.any_of([asked.keyed.has(ends[0], kind, at)]) for at in every}
    possible = [at for at in every if may(solver, known[at])]
    steps = {(at, at) for at in possible}
    shut: set[frozenset[int]] = set()
    given_up: set[frozenset[int]] = set()
    while True:
        sets = [part for part in parts(steps) if not any(a in part and b not in part for a, b in steps)]
        left = [part for part in sets if part not in shut | given_up]
        if not left:
            break
        inside = sorted(left[0])
        here = smt.any_of([known[at] for at in inside])
        there = smt.negation(smt.any_of([asked.keyed.has(ends[1], kind, at) for at in inside]))
        answer = solver.check(solver.switch(here), solver.switch(there))
        if answer is Answer.UNSATISFIABLE:
            shut.add(left[0])
        elif answer is Answer.UNKNOWN:
            given_up.add(left[0])
        else:
            step = tuple(int(solver.value(end, sort(kind))) for end in ends)
            steps |= {(step[0], step[1]), (step[1], step[1])}
    yield from sorted(
        (part for part in shut if begins.isdisjoint(part) and len(part) < len(possible)), key=min
    )


def _moves(cycle: Cycle, target: str, members: Iterable[int]) -> tuple[Node, Node]:
    """Return the conditions that a cycle leads into the set, and that it leads out of it."""
    here, there = (_among(leaves[target], members) for leaves in (cycle.before, cycle.after))
    return values.both(values.negation(here), there), values.both(here, values.negation(there))


def _among(node: Node, members: Iterable[int]) -> Node:
    return values.any_of(values.equal(node, values.constant(node.kind, at)) for at in sorted(members))


def _stated(ts: TransitionSystem, leaf: str, kind: Enum, members: Collection[int]) -> str:
    """Return the first property that says, by itself, that a cycle which begins with such a value ends with one; "" for none."""
    for stated in ts.program.properties:
        read = set(map(str, read_by(stated.condition)))
        if not read <= {leaf, str(earlier(leaf))}:
            continue
        keyed, ends = Keyed(), {name: values.variable(name, kind) for name in (leaf, str(earlier(leaf)))}
        says = Run({}, {}, dict(ends)).evaluate(stated.condition)
        leaves_it = values.both(
            _among(ends[str(earlier(leaf))], members), values.negation(_among(ends[leaf], members))
        )
        term = keyed.term(values.both(says, leaves_it))
        solver = Solver()
        solver.add(*keyed.ranges, term)
        if solver.check() is Answer.UNSATISFIABLE:
            return stated.name
    return ""
