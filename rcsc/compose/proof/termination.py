"""Termination: every command is eventually answered, assuming that subordinates answer theirs.

In: a transition system, and what was confirmed of it. Out: an `Ending` for each table. A level is *answered* in a cycle when each
subordinate echoes the last order and reports it *done* or *failed*; the first command, such as PAUSE, *done* only. It is
assumed that each order, unless another replaces it, is eventually answered and stays so. Of a subordinate that is to answer in a
declared time this is assumed of orders to rest alone: any other is late for good once it has been unanswered for so many cycles, in
all, and a late one counts as answered (`rcsc.lang.protocol`). The same is shown of the level itself:
it is *unanswered* while it reports neither; no other status answers. The argument, for a level that keeps one command:

- Its *table* stays; or, if the command does not select it, tables do not follow one another in a loop.
- Its *phase* is its pending next states, and the flags that its lines write. The solver lists all steps between phases from the
  invariant. They form no loop, except those on which the command is answered in every cycle: a level that stays on one has
  answered for good. So after the cycle that takes the command, which may be the first of all, the phase changes at most
  `changes` times.
- While the phase stays, lines follow one another. A line that runs again and again is on a loop of lines. It
  runs finitely often if there is a *counter*, a number of the level, or a sum of several, that rises whenever the line runs and
  never falls on that loop: it ends at the end of its range. Likewise one that falls and never rises; or one that moves in some of
  the line's cycles and never goes back, for in the end it stays, and a next counter, looked for among cycles that leave it, then
  stops the line. A real has to move by a share of its range (`SMALLEST`), found in fractions
  (`measured`). Lines that stop are taken out, and what is left is examined again.
- A line that gives orders must have one, at least for the cycles in which it does so. So orders end.
- A line may give orders as what a subordinate reports changes. The report of a level that answers, and that no line gives orders for ever,
  stands from some time on: that is asked of that level (`stands`). Values from outside may be assumed to stand still, which is printed;
  of what else a level writes, such as a stream of the superior, nothing is.
- Then answers come, and stay. The lines that are left may form no loop in answered cycles that give no order, except loops that
  leave the command unanswered only finitely often.

Lines for which this is not shown are named in `endless`: they wait for what they read.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rcsc.compose.contract.environment import Below, leaves_under
from rcsc.compose.contract.obligations import ANSWER, FLAG, SETTLES, command_stays
from rcsc.compose.contract.transition import Cycle, Leaves, TableAt, TransitionSystem
from rcsc.compose.invariant.confirm import Confirmation, may
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.proof.context import gives_an_order, of_lines, orders_to
from rcsc.compose.proof.ranking import RisingLine, Turn, lines_that_stop, parts
from rcsc.compose.proof.staying import in_a_row, while_it_stays
from rcsc.lang.model import Bool, Enum, Kind, OneTable, Read, pending, spell
from rcsc.lang.restart import ECHO, ECHOED, NUMBER, STATUS
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed, sort
from rcsc.proof.symbolic.values import Node
from rcsc.run.orders.roles import Neighbour

MOST_STEPS = 400

Phase = tuple[int, ...]
Way = tuple[Phase, Phase]


@dataclass(frozen=True, slots=True)
class Ending:
    """The result of asking whether the command of one table ends.

    Attributes:
        changes: How often the phase can change after the cycle that takes the command; None if phases or tables may loop.
        counted: Lines that stop because of a counter; of several of one line each counts while those before it stay.
        still: Inputs from outside the levels whose values, echoes and statuses apart, are assumed constant meanwhile.
        settled: Reports of levels that have to stand once these have answered (`stands`).
        endless: Lines that are not shown to stop.
        loops: For each loop of phases that may leave the command unanswered, its states in words; for one of tables, theirs.
    """

    table: str
    changes: int | None
    counted: tuple[RisingLine, ...] = ()
    still: tuple[str, ...] = ()
    endless: tuple[str, ...] = ()
    settled: tuple[str, ...] = ()
    loops: tuple[str, ...] = ()

    @property
    def rounds(self) -> tuple[str, ...]:
        """The loops and lines that may go on for ever, in words."""
        lines = ", ".join(f"`{line}`" for line in self.endless)
        again = f"{'line' if len(self.endless) == 1 else 'lines'} {lines} may run for ever"
        return (
            *(f"the command may stay in a loop: {loop}" for loop in self.loops),
            *([again] if lines else []),
        )

    @property
    def proved(self) -> bool:
        """Whether the command ends, assuming answers."""
        return self.changes is not None and not self.endless


def reports(ts: TransitionSystem) -> bool:
    """Return whether the level has a superior, and all reports can say that a command is done."""
    above = ts.links.above
    if above is None:
        return False
    return not no_answers(ts)


def no_answers(ts: TransitionSystem) -> tuple[str, ...]:
    """Return the reasons why reports that answer a command are not recognised."""
    above = ts.links.above
    if above is None:
        return ()
    reasons = []
    for end in (above, *ts.links.below):
        kind = ts.kinds.get(end.status)
        if not isinstance(kind, Enum) or end.done not in kind.members:
            reasons.append(f"`{end.report}` has no `{STATUS}` with a member `{end.done}`")
        if not isinstance(ts.kinds[end.command], Enum):
            reasons.append(f"`{end.command}` is no enumeration")
    return tuple(reasons)


def unanswered(ts: TransitionSystem, cycle: Cycle) -> Node:
    """Return the condition that the level's report does not answer its command."""
    assert ts.links.above is not None
    return values.negation(_ended(ts, ts.links.above, cycle.taken, cycle.after))


def answered(ts: TransitionSystem, cycle: Cycle, below: Below) -> Node:
    """Return the condition that the last order is echoed, and ended, or that its answer is late where that counts as one."""
    echoed = values.equal(cycle.taken[below.echo], cycle.before[below.number])
    ended = values.both(echoed, _ended(ts, below, cycle.before, cycle.taken))
    if below.late is None or not below.answers_in_time:
        return ended
    rests = values.equal(cycle.before[below.command], values.constant(ts.kinds[below.command], 0))
    return values.either(ended, values.both(cycle.middle[below.late], values.negation(rests)))


def _says_more(ts: TransitionSystem, report: str) -> bool:
    """Return whether a report has fields besides its echoes and its status."""
    made = {f"{report}.{part}" for part in (ECHO, ECHOED, STATUS)}
    return not made.issuperset(leaves_under(ts.program, report))


def stands(ts: TransitionSystem, cycle: Cycle) -> Node:
    """Return the condition that a report which answers a command stays as it is while it is about that command.

    Asked where the report echoes the order that was taken last (`ECHOES`); a cycle that ends early may have left an older one, whose
    number does not come again.
    """
    above = ts.links.above
    assert above is not None
    rests = values.equal(cycle.before[above.echoed], values.constant(ts.kinds[above.command], 0))
    failed = values.both(values.negation(rests), _says(ts, above.status, cycle.before, above.failed))
    ended = values.either(_says(ts, above.status, cycle.before, above.done), failed)
    again = values.all_of(
        values.equal(cycle.before[here], there)
        for here, there in (
            (above.echo, cycle.after[above.echo]),
            (above.echo, cycle.before[above.number]),
            (above.echoed, cycle.before[above.command]),
        )
    )
    leaves = leaves_under(ts.program, above.report)
    same = values.all_of(values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in leaves)
    return values.follows(values.both(ended, again), same)


def _ended(ts: TransitionSystem, end: Neighbour, ordered: Leaves, reported: Leaves) -> Node:
    """Return the condition that the report ends the order: *done* or *failed*; the first command *done* alone."""
    rests = values.equal(ordered[end.command], values.constant(ts.kinds[end.command], 0))
    failed = _says(ts, end.status, reported, end.failed)
    return values.either(
        _says(ts, end.status, reported, end.done), values.both(values.negation(rests), failed)
    )


def _says(ts: TransitionSystem, leaf: str, leaves: Mapping[str, Node], member: str) -> Node:
    kind = ts.kinds[leaf]
    assert isinstance(kind, Enum)
    if member not in kind.members:
        return values.FALSE
    return values.equal(leaves[leaf], values.constant(kind, kind.members.index(member)))


@dataclass(frozen=True, slots=True)
class _Phases:
    """The phases that a command of one table goes through.

    Attributes:
        leaves: The leaves whose values are a phase.
        steps: Every change from one to another; None if they are too many, or the solver gave up.
        loops: The loops, as sets of phases, and whether the command may be unanswered in a cycle within each.
    """

    leaves: tuple[str, ...]
    steps: set[Way] | None
    loops: tuple[tuple[set[Phase], bool], ...] = ()

    @property
    def waiting(self) -> list[Way]:
        """The steps on loops on which the command may be unanswered."""
        parts_ = [part for part, waits in self.loops if waits]
        return sorted(way for way in self.steps or () if any(part.issuperset(way) for part in parts_))

    @property
    def changes(self) -> int | None:
        """The steps on the longest path, without loops on which the command is answered; None if there are other loops."""
        if self.steps is None or any(waits for _, waits in self.loops):
            return None
        same = {phase: min(part) for part, _ in self.loops for phase in part}
        left = {(same.get(source, source), same.get(target, target)) for source, target in self.steps}
        return longest({(source, target) for source, target in left if source != target})


class Flow:
    """Termination questions of one level, asked from an invariant; none if it reports to no superior.

    Attributes:
        phases: Of each table, by number; `stays`, the questions about cycles in which it stays.
        listed: The changes of phase that were listed; from a stronger invariant some of them are left, and need not be searched again.
    """

    def __init__(
        self,
        ts: TransitionSystem,
        asked: Confirmation,
        clauses: Sequence[Clause],
        weaker: "Flow | None" = None,
    ) -> None:
        self.ts, self.asked, self.clauses = ts, asked, clauses
        self.phases: dict[int, _Phases] = {}
        self.stays: dict[int, Confirmation] = {} if weaker is None else weaker.stays
        self.listed: dict[tuple[int, tuple[str, ...]], _Listed] = {}
        self._weaker = {} if weaker is None else weaker.listed

    @property
    def tables(self) -> tuple[TableAt, ...]:
        """The tables that are asked about."""
        return self.asked.cycle.tables if reports(self.ts) else ()

    def staying(self, number: int) -> Confirmation:
        """Return the questions about cycles that keep the command and run this table."""
        if number not in self.stays:
            name = str(self.tables[number].table.name)
            self.stays[number] = while_it_stays(self.ts, self.asked, name)
        return self.stays[number]

    def endings(self) -> Iterator[Ending]:
        """Yield the ending of each table."""
        looping = self._looping_tables() if self.tables else set()
        for number in range(len(self.tables)):
            yield self._ending(number, loops=number in looping)

    def _ending(self, number: int, *, loops: bool) -> Ending:
        changes = self._phases(number).changes
        stopping = lines_that_stop(
            self.ts.program,
            self.staying(number),
            self.clauses,
            lambda still, settled: self._turns(number, still, settled),
            from_outside(self.ts),
            {each.report for each in self.ts.links.below if not (each.outside or each.answers_in_time)},
        )
        table = str(self.tables[number].table.name)
        known = stopping.counted, stopping.still, stopping.endless, stopping.settled
        together = ", ".join(
            f"`{self.tables[at].table.name}`" for at in sorted(self._looping_tables() if loops else ())
        )
        around = (*([f"tables {together}"] if loops else []), *self._loops_in_words(number))
        return Ending(table, None if loops else changes, *known, around)

    def wanted_to_stand(self) -> list[Node]:
        """List the condition that the report stands, if a level above may go by its fields."""
        above = self.ts.links.above
        if above is None or above.outside or not reports(self.ts) or not _says_more(self.ts, above.report):
            return []
        return [stands(self.ts, self.asked.cycle)]

    def report_stands(self) -> bool:
        """Return whether the level's report stands once it has answered, as termination above may need it."""
        if not reports(self.ts):
            return False
        solver = self.asked.known(self.clauses)
        broken = self.asked.keyed.term(values.negation(stands(self.ts, self.asked.cycle)))
        solver.add(*self.asked.keyed.ranges)
        self.asked.rested_on.append(solver)
        return not may(solver, broken)

    def _loops_in_words(self, number: int) -> Iterator[str]:
        """Spell the states of each loop on which the command may be unanswered: the leaves that are not the same in all."""
        phases = self._phases(number)
        for part, waits in phases.loops:
            if waits:
                moving = [at for at in range(len(phases.leaves)) if len({phase[at] for phase in part}) > 1]
                states = "; ".join(
                    ", ".join(
                        f"`{phases.leaves[at]}` = {spell(self.ts.kinds[phases.leaves[at]], phase[at])}"
                        for at in moving
                    )
                    for phase in sorted(part)
                )
                lines = ", ".join(f"`{line}`" for line in self._lines_in(number, part))
                yield f"{states} (lines {lines})"
        if phases.steps is None:
            told = ", ".join(f"`{leaf}`" for leaf in phases.leaves)
            yield f"more than {MOST_STEPS} steps, or some on which the solver gave up, between the values of {told}"

    def _lines_in(self, number: int, part: set[Phase]) -> Iterator[str]:
        """Yield the lines that may run in a cycle which stays in a loop of phases and leaves the command unanswered."""
        asked, leaves = self.staying(number), self._phases(number).leaves
        cycle, solver = asked.cycle, asked.known(self.clauses)
        inside = (
            values.any_of(values.all_of(_are(nodes, phase)) for phase in sorted(part))
            for nodes in _ends(cycle, leaves)
        )
        waits = command_stays(self.ts, cycle), unanswered(self.ts, cycle)
        stays = asked.keyed.term(values.all_of((cycle.tables[number].chosen, *waits, *inside)))
        runs = [(str(line.name), asked.keyed.term(match)) for line, match in cycle.tables[number].lines]
        solver.add(stays, *asked.keyed.ranges)
        yield from (name for name, match in runs if may(solver, match))

    def no_loop_steps(self) -> list[Node]:
        """List the conditions to be proved: for each step on a loop of phases, that it is not taken."""
        conditions = []
        for number, at in enumerate(self.tables):
            phases = self._phases(number)
            taken = values.both(at.chosen, command_stays(self.ts, self.asked.cycle))
            before, after = _ends(self.asked.cycle, phases.leaves)
            conditions += [
                values.negation(values.all_of((taken, *_are(before, source), *_are(after, target))))
                for source, target in phases.waiting
            ]
        return conditions

    # --- from phase to phase ---

    def _phases(self, number: int) -> _Phases:
        """Return the phases of a table, ignoring flags that toggle while the command is pending."""
        if number not in self.phases:
            phases = self._phases_by(number, self._pending_and_flags())
            turning = {
                leaf
                for place, leaf in enumerate(phases.leaves)
                for source, target in phases.waiting
                if source[place] != target[place] and isinstance(self.ts.kinds[leaf], Bool) and leaf != FLAG
            }
            if turning:
                phases = self._phases_by(number, tuple(leaf for leaf in phases.leaves if leaf not in turning))
            self.phases[number] = phases
        return self.phases[number]

    def _pending_and_flags(self) -> tuple[str, ...]:
        """List pending states, the flag of a new command, and flags that lines write."""
        variables = self.ts.program.variables
        pending_states = [
            str(pending(v.name))
            for v in variables
            if v.deferred_until is not None and isinstance(v.type, Bool | Enum)
        ]
        telling = of_lines(self.ts) | {FLAG}
        if self.ts.program.roles is not None:
            telling = (telling | {ANSWER}) - {SETTLES}
        flags = [
            str(v.name)
            for v in variables
            if v.kind is Kind.STATE and isinstance(v.type, Bool) and v.name in telling
        ]
        return (*pending_states, *flags)

    def _phases_by(self, number: int, leaves: tuple[str, ...]) -> _Phases:
        steps = self._steps(number, leaves)
        return _Phases(leaves, steps, () if steps is None else tuple(self._loops(number, leaves, steps)))

    def _loops(
        self, number: int, leaves: tuple[str, ...], steps: set[Way]
    ) -> Iterator[tuple[set[Phase], bool]]:
        phases = sorted({phase for step in steps for phase in step})
        places = {phase: place for place, phase in enumerate(phases)}
        for part in parts({(places[source], places[target]) for source, target in steps}):
            inside = {phases[place] for place in part}
            asked = self.staying(number)
            cycle, solver = asked.cycle, asked.known(self.clauses)
            ends = [
                values.any_of(values.all_of(_are(nodes, phase)) for phase in sorted(inside))
                for nodes in _ends(cycle, leaves)
            ]
            waits = (command_stays(self.ts, cycle), unanswered(self.ts, cycle))
            term = asked.keyed.term(values.all_of((cycle.tables[number].chosen, *waits, *ends)))
            solver.add(*asked.keyed.ranges)
            asked.rested_on.append(solver)
            yield inside, may(solver, term)

    def _steps(self, number: int, leaves: tuple[str, ...]) -> set[Way] | None:
        """Return every change of phase in a cycle that runs the table; None if they are too many or the solver gave up."""
        asked = self.staying(number)
        keyed, cycle = asked.keyed, asked.cycle
        before, after = _ends(cycle, leaves)
        stays = values.all_of(map(values.equal, before, after))
        chosen = cycle.tables[number].chosen
        moves = keyed.term(values.all_of((chosen, command_stays(self.ts, cycle), values.negation(stays))))
        nodes = (*before, *after)
        terms = {node: keyed.term(node) for node in nodes}
        solver = asked.known(self.clauses)
        solver.add(*keyed.ranges, moves)
        ends = _Ends(solver, keyed, nodes, {node: solver.named(term) for node, term in terms.items()})
        known = self._weaker.get((number, leaves), _Listed(set(), every=False))
        listed = self.listed[number, leaves] = ends.listed(known)
        if not listed.every:
            return None
        asked.rested_on.append(solver)
        return listed.steps

    # --- three cycles in a row ---

    def _turns(
        self, number: int, still: tuple[str, ...], settled: tuple[str, ...]
    ) -> tuple[Turn, Turn, Turn]:
        """Return three cycles of a table in a row, from anywhere in the invariant, in which these inputs keep their values.

        Those who report what is `settled` have answered, and get no order.
        """
        first = self.staying(number).cycle
        kept = {leaf: taken for leaf, taken in first.taken.items() if _stands_still(leaf, (*still, *settled))}
        row = in_a_row(self.ts, first, self._phases(number).leaves, kept)
        one, two, three = (self._turn(cycle, number, settled) for cycle in row)
        return one, two, three

    def _turn(self, cycle: Cycle, number: int, settled: tuple[str, ...]) -> Turn:
        """Return the cycle of a table in which the command and the phase stay."""
        leaves = self._phases(number).leaves
        same = values.all_of(values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in leaves)
        at = cycle.tables[number]
        ordered = {below.report: orders_to(cycle, below) for below in self.ts.links.below}
        has = {below.report: answered(self.ts, cycle, below) for below in self.ts.links.below}
        rest = (values.both(has[report], values.negation(ordered[report])) for report in settled)
        stays = values.all_of((at.chosen, cycle.contract, command_stays(self.ts, cycle), same, *rest))
        orders = gives_an_order(self.ts, cycle)
        return Turn(
            at,
            cycle.before,
            cycle.taken,
            cycle.after,
            stays,
            orders,
            unanswered(self.ts, cycle),
            values.all_of(has.values()),
            ordered,
        )

    # --- from table to table ---

    def _looping_tables(self) -> set[int]:
        """Return the tables that may follow one another in a loop while the command stays."""
        above, chosen = self.ts.links.above, self.ts.level.tables
        assert above is not None
        if isinstance(chosen, OneTable):
            return set()
        if isinstance(chosen.selector, Read) and chosen.selector.name in above.numbered:
            return set()  # the same under the same number: the contract
        first = self.asked.cycle
        second = self.ts.cycle(first.after, " second")
        term = self.asked.keyed.term
        goes_on = [
            term(values.both(cycle.contract, command_stays(self.ts, cycle))) for cycle in (first, second)
        ]
        runs = [[term(at.chosen) for at in cycle.tables] for cycle in (first, second)]
        solver = self.asked.known(self.clauses)
        self.asked.rested_on.append(solver)
        solver.add(*self.asked.keyed.ranges, *goes_on)
        steps = {
            (here, there)
            for here, now in enumerate(runs[0])
            for there, then in enumerate(runs[1])
            if here != there and may(solver, now, then)
        }
        return {table for part in parts(steps) for table in part}


class _Listed(NamedTuple):
    """Changes of phase; `every`, unless they are too many or the solver gave up."""

    steps: set[Way]
    every: bool


@dataclass(frozen=True, slots=True)
class _Ends:
    """The phases before and after the cycles that a solver allows.

    Attributes:
        nodes: Those of a phase before the cycle, and of the one after it; of a leaf that nothing writes these are one node.
        terms: A constant for each.
    """

    solver: Solver
    keyed: Keyed
    nodes: tuple[Node, ...]
    terms: Mapping[Node, Term]

    def listed(self, known: _Listed) -> _Listed:
        """List the changes of phase, those first that were `known` of a weaker invariant and are still possible."""
        steps = {step for step in sorted(known.steps) if may(self.solver, self._are(step))}
        if known.every:
            return _Listed(steps, every=True)
        for step in sorted(steps):
            self.solver.add(smt.negation(self._are(step)))
        while len(steps) < MOST_STEPS:
            answer = self.solver.check()
            if answer is not Answer.SATISFIABLE:
                return _Listed(steps, every=answer is Answer.UNSATISFIABLE)
            seen = {node: int(self.solver.value(term, sort(node.kind))) for node, term in self.terms.items()}
            point, half = tuple(seen[node] for node in self.nodes), len(self.nodes) // 2
            step = point[:half], point[half:]
            steps.add(step)
            self.solver.add(smt.negation(self._are(step)))
        return _Listed(steps, every=False)

    def _are(self, step: Way) -> Term:
        """Return the term that the cycle makes this change."""
        point = zip(self.nodes, (*step[0], *step[1]), strict=True)
        return smt.all_of([self.keyed.has(self.terms[node], node.kind, value) for node, value in point])


def _ends(cycle: Cycle, leaves: Sequence[str]) -> tuple[list[Node], list[Node]]:
    """Return the nodes of a phase, before the cycle and after it."""
    return [cycle.before[leaf] for leaf in leaves], [cycle.after[leaf] for leaf in leaves]


def _are(nodes: Sequence[Node], phase: Phase) -> list[Node]:
    return [
        values.equal(node, values.constant(node.kind, value))
        for node, value in zip(nodes, phase, strict=True)
    ]


def from_outside(ts: TransitionSystem) -> set[str]:
    """Return the inputs, as records, that no level writes: of these alone it is taken for granted that they stand still."""
    written = {leaf.partition(".")[0] for leaf in ts.inputs if ts.links.written_as(leaf) is not None}
    return {leaf.partition(".")[0] for leaf in ts.inputs} - written


def _stands_still(leaf: str, still: tuple[str, ...]) -> bool:
    """Return whether the leaf is a value, no echo or status, in one of these inputs."""
    record, _, part = leaf.partition(".")
    return record in still and part not in (NUMBER, ECHO, ECHOED, STATUS)


def longest(steps: set[Way]) -> int | None:
    """Return the number of steps on the longest path; None if there is a loop."""
    onward: dict[Phase, list[Phase]] = {}
    for source, target in sorted(steps):
        onward.setdefault(source, []).append(target)
    length: dict[Phase, int] = {}

    def measure(phase: Phase, way: tuple[Phase, ...]) -> bool:
        if phase in length:
            return True
        if phase in way:
            return False
        if not all(measure(following, (*way, phase)) for following in onward.get(phase, ())):
            return False
        length[phase] = max((1 + length[following] for following in onward.get(phase, ())), default=0)
        return True

    if not all(measure(phase, ()) for phase in onward):
        return None
    return max(length.values(), default=0)
