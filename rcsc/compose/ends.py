"""That every command ends, given that what is below answers: no deadlock, and nothing that goes on for ever.

In: a stepper, and what was confirmed of it. Out: an `Ending` for each table. A level is *answered* in a cycle when each
subordinate echoes the last order and says of it *done* or *failed*; of the first command, PAUSE or its like, *done*. The
argument, for a level that keeps one command and reports *executing*:

- Its *phase* is its pending next states, and the flags that its lines write. From phase to phase there is no way round (all
  steps are listed by the solver, from the invariant), so the phase changes at most `changes` times.
- While the phase stays, an answered cycle may run a line again only `MOST` times, or only while a counter of the level rises
  (`counted`), which ends at the end of its range.

So a level that does not end is one that is not answered: it ends if its subordinates, whenever an order stands, answer it.
Lines for which neither is shown are named in `endless`: they wait for what they read. That a robot arrives is arithmetic,
which is left open here (`keyed`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.compose.confirm import Confirmation
from rcsc.compose.context import may, of_lines
from rcsc.compose.contract import COMMAND, ECHO, NUMBER, STATUS
from rcsc.compose.frames import Clause
from rcsc.compose.goals import FLAG
from rcsc.compose.keyed import sort
from rcsc.compose.transition import Cycle, Stepper, TableAt
from rcsc.model import Bool, Enum, Int, Kind, Op, pending
from rcsc.prove import smt, values
from rcsc.prove.smt import Answer, Solver
from rcsc.prove.values import Node

MOST = 3
"""Answered cycles after which a line that runs again and again is looked at."""
MOST_STEPS = 400
DONE, EXECUTING = "done", "executing"

Phase = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Ending:
    """What was found of one table.

    Attributes:
        changes: How often the phase can change while the command lasts; None where it could go round.
        counted: Lines that may run again for as long as a counter rises, with the counter.
        endless: Lines of which it is not shown that they end.
    """

    table: str
    changes: int | None
    counted: tuple[tuple[str, str], ...] = ()
    endless: tuple[str, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether the command ends, given answers."""
        return self.changes is not None and not self.endless


def endings(stepper: Stepper, asked: Confirmation, clauses: Sequence[Clause]) -> tuple[Ending, ...]:
    """One for each table; none where the level has no superior that it reports to."""
    if not reports(stepper):
        return ()
    flow = _Flow(stepper, asked, clauses)
    return tuple(flow.ending(number) for number in range(len(asked.cycle.tables)))


def ways_round(stepper: Stepper, asked: Confirmation, clauses: Sequence[Clause]) -> list[Node]:
    """That steps between phases are not taken, one by one, of which some lead round: what there is to be shown if none does."""
    if not reports(stepper):
        return []
    flow = _Flow(stepper, asked, clauses)
    return [one for number in range(len(asked.cycle.tables)) for one in flow.not_round(number)]


def reports(stepper: Stepper) -> bool:
    """Whether the level has a superior, and all reports say what is done and what is executing."""
    above = stepper.links.above
    if above is None:
        return False
    kinds = [stepper.kinds.get(f"{above.report}.{STATUS}")]
    kinds += [stepper.kinds.get(f"{below.report}.{STATUS}") for below in stepper.links.below]
    return all(isinstance(kind, Enum) and {DONE, EXECUTING} <= set(kind.members) for kind in kinds)


class _Flow:
    """The questions of one level.

    Attributes:
        cycles: `MOST` cycles in a row, the first from anywhere in the invariant.
    """

    def __init__(self, stepper: Stepper, asked: Confirmation, clauses: Sequence[Clause]) -> None:
        self.stepper, self.asked, self.clauses = stepper, asked, clauses
        self.keyed = asked.keyed
        cycles = [asked.cycle]
        for number in range(2, MOST + 1):
            cycles.append(stepper.cycle(cycles[-1].after, f" {number}"))
        self.cycles = cycles
        self.leaves = self._phase()
        self.before = [cycles[0].before[leaf] for leaf in self.leaves]
        self.after = [cycles[0].after[leaf] for leaf in self.leaves]

    def _phase(self) -> list[str]:
        """Pending states, the flag of a new command, and flags that lines write."""
        variables = self.stepper.program.variables
        found = [
            str(pending(v.name))
            for v in variables
            if v.deferred_until is not None and isinstance(v.type, Bool | Enum)
        ]
        written = of_lines(self.stepper)
        flags = [
            str(v.name)
            for v in variables
            if v.kind is Kind.STATE and isinstance(v.type, Bool) and (v.name == FLAG or v.name in written)
        ]
        return [*found, *flags]

    def ending(self, number: int) -> Ending:
        """Of one table."""
        at = self.cycles[0].tables[number]
        steps = self._steps(at)
        changes = None if steps is None else longest(steps)
        counted, endless = [], []
        for line, counter, ends in self._again(number):
            if counter:
                counted.append((line, counter))
            elif not ends:
                endless.append(line)
        return Ending(str(at.table.name), changes, tuple(counted), tuple(endless))

    def not_round(self, number: int) -> list[Node]:
        """That a step is not taken, for each that is on a way round."""
        at = self.cycles[0].tables[number]
        steps = self._steps(at) or set()
        taken = values.both(at.chosen, self._goes_on(self.cycles[0]))
        return [
            values.negation(values.all_of((taken, *self._are(self.before, one), *self._are(self.after, two))))
            for one, two in sorted(steps)
            if leads(steps, two, one)
        ]

    @staticmethod
    def _are(nodes: Sequence[Node], phase: Phase) -> list[Node]:
        return [
            values.equal(node, values.constant(node.kind, value))
            for node, value in zip(nodes, phase, strict=True)
        ]

    # --- conditions ---

    def _status(self, leaf: str, cycle: Mapping[str, Node], member: str) -> Node:
        kind = self.stepper.kinds[leaf]
        assert isinstance(kind, Enum)
        return values.equal(cycle[leaf], values.constant(kind, kind.members.index(member)))

    def _goes_on(self, cycle: Cycle) -> Node:
        """The command is still the same, and not ended."""
        above = self.stepper.links.above
        assert above is not None
        number = f"{above.order}.{NUMBER}"
        same = values.equal(cycle.before[number], cycle.taken[number])
        return values.both(same, self._status(f"{above.report}.{STATUS}", cycle.after, EXECUTING))

    def _answered(self, cycle: Cycle) -> Node:
        found = []
        for below in self.stepper.links.below:
            command, status = f"{below.order}.{COMMAND}", f"{below.report}.{STATUS}"
            echoed = values.equal(
                cycle.taken[f"{below.report}.{ECHO}"], cycle.before[f"{below.order}.{NUMBER}"]
            )
            rests = values.equal(cycle.before[command], values.constant(self.stepper.kinds[command], 0))
            done = self._status(status, cycle.taken, DONE)
            ended = values.negation(self._status(status, cycle.taken, EXECUTING))
            found += [echoed, ended, values.follows(rests, done)]
        return values.all_of(found)

    def _stays(self, cycle: Cycle) -> Node:
        """The phase stays."""
        return values.all_of(values.equal(cycle.before[leaf], cycle.after[leaf]) for leaf in self.leaves)

    # --- from phase to phase ---

    def _steps(self, at: TableAt) -> set[tuple[Phase, Phase]] | None:
        """Every change of phase in a cycle that runs the table; None where they are too many, or the solver gave up."""
        keyed, cycle = self.keyed, self.cycles[0]
        wanted = values.all_of((at.chosen, self._goes_on(cycle), values.negation(self._stays(cycle))))
        moves = [keyed.term(wanted)]
        ends = [keyed.term(node) for node in (*self.before, *self.after)]
        solver = self.asked.known(self.clauses)
        solver.add(*keyed.ranges, *moves)
        found: set[tuple[Phase, Phase]] = set()
        while len(found) < MOST_STEPS:
            answer = solver.check()
            if answer is Answer.UNSATISFIABLE:
                return found
            if answer is Answer.UNKNOWN:
                return None
            nodes = (*self.before, *self.after)
            point = [int(solver.value(term, sort(node.kind))) for node, term in zip(nodes, ends, strict=True)]
            found.add((tuple(point[: len(self.before)]), tuple(point[len(self.before) :])))
            same = [
                keyed.has(term, node.kind, value)
                for node, term, value in zip(nodes, ends, point, strict=True)
            ]
            solver.add(smt.negation(smt.all_of(same)))
        return None

    # --- while the phase stays ---

    def _again(self, number: int) -> Iterator[tuple[str, str, bool]]:
        """Lines that may run in answered cycles while the phase stays, with what they count, and whether they stop."""
        keyed, first = self.keyed, self.cycles[0]
        loops = [self._loop(cycle, number) for cycle in self.cycles]
        terms = [keyed.term(one) for one in loops]
        table = first.tables[number]
        matches = [[keyed.term(match) for match in cycle.tables[number].matches] for cycle in self.cycles]
        counters = {
            leaf: smt.negation(keyed.term(values.compare(Op.LT, first.before[leaf], first.after[leaf])))
            for leaf in self._counters()
        }
        solver = self.asked.known(self.clauses)
        solver.add(*keyed.ranges, terms[0])
        for line, match in zip(table.table.lines, zip(*matches, strict=True), strict=True):
            solver.push()
            solver.add(match[0])
            if may(solver):
                counter = next((leaf for leaf, falls in counters.items() if not may(solver, falls)), "")
                yield str(line.name), counter, bool(counter) or not self._on(solver, terms[1:], match[1:])
            solver.pop()

    @staticmethod
    def _on(solver: Solver, loops: Sequence[smt.Term], matches: Sequence[smt.Term]) -> bool:
        """Whether the line may run in all the following cycles, too."""
        return may(solver, *loops, *matches)

    def _loop(self, cycle: Cycle, number: int) -> Node:
        at = cycle.tables[number]
        return values.all_of(
            (at.chosen, cycle.contract, self._goes_on(cycle), self._answered(cycle), self._stays(cycle))
        )

    def _counters(self) -> list[str]:
        """Whole numbers that the level keeps, and what is pending of them."""
        owned = [
            v for v in self.stepper.program.variables if v.kind is Kind.STATE and isinstance(v.type, Int)
        ]
        later = [str(pending(v.name)) for v in owned if v.deferred_until is not None]
        return list(dict.fromkeys([*(str(v.name) for v in owned), *later]))


def longest(steps: set[tuple[Phase, Phase]]) -> int | None:
    """Steps on the longest way; None where a way goes round."""
    onward: dict[Phase, list[Phase]] = {}
    for one, two in sorted(steps):
        onward.setdefault(one, []).append(two)
    length: dict[Phase, int] = {}

    def measure(phase: Phase, way: tuple[Phase, ...]) -> bool:
        if phase in length:
            return True
        if phase in way:
            return False
        if not all(measure(one, (*way, phase)) for one in onward.get(phase, ())):
            return False
        length[phase] = max((1 + length[one] for one in onward.get(phase, ())), default=0)
        return True

    if not all(measure(phase, ()) for phase in onward):
        return None
    return max(length.values(), default=0)


def leads(steps: set[tuple[Phase, Phase]], start: Phase, end: Phase) -> bool:
    """Whether a way leads from one to the other."""
    seen, waiting = {start}, [start]
    while waiting:
        here = waiting.pop()
        new = {two for one, two in steps if one == here} - seen
        seen |= new
        waiting += new
    return end in seen
