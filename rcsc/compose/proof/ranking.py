"""Lines that follow one another while nothing else of a level changes, and what ends that.

In: three cycles in a row, as `Turn`s: of the middle one the questions are asked. Out: the lines that stop because a counter
rises, and those of which it is not shown that they stop. The argument is in `termination`.
Counters are found one after another, for what the last ones leave (Bradley, Manna and
Sipma, "Linear ranking with reachability", 2005).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.compose.contract.transition import Leaves, TableAt
from rcsc.compose.invariant.confirm import Confirmation, may
from rcsc.compose.invariant.pdr import Clause
from rcsc.lang.model import Bool, Int, Kind, Program, Real, Scalar, pending
from rcsc.solvers import smt
from rcsc.solvers.search import furthest
from rcsc.solvers.smt import Answer, Term
from rcsc.symbolic import values
from rcsc.symbolic.keyed import KEY
from rcsc.symbolic.measured import Measured
from rcsc.symbolic.values import Node

SMALLEST = 24
"""A real counter rises each time by its range divided by at most two to this power."""
LinePair = tuple[int, int]
"""A line and one that may run in the next cycle."""
Part = frozenset[int]
"""Lines each of which leads to every other one."""


@dataclass(frozen=True, slots=True)
class RisingLine:
    """A line that stops because a number of the level rises each time: a real by at least `least`."""

    line: str
    counter: str
    least: float | None = None


@dataclass(frozen=True, slots=True)
class Turn:
    """One cycle of a table.

    Attributes:
        before: The leaves before it; `after`, after it.
        stays: The table runs, the command stays, and so does the phase.
        orders: An order is given.
        unanswered: The command is not answered.
        answered: The orders that stand are answered.
    """

    at: TableAt
    before: Leaves
    after: Leaves
    stays: Node
    orders: Node
    unanswered: Node
    answered: Node

    @property
    def quiet(self) -> Node:
        """Answered, and no order is given."""
        return values.both(self.answered, values.negation(self.orders))


@dataclass(frozen=True, slots=True)
class StoppingLines:
    """What was found of the lines of one table.

    Attributes:
        counted: Lines that stop because a counter rises.
        still: Inputs whose values, echoes and statuses apart, are taken to stand still meanwhile.
        endless: Lines of which it is not shown that they stop, even if all inputs stand still.
    """

    counted: tuple[RisingLine, ...]
    still: tuple[str, ...]
    endless: tuple[str, ...]


Turns: TypeAlias = Callable[[tuple[str, ...]], tuple[Turn, Turn, Turn]]
"""Three cycles in a row in which these inputs keep their values, echoes and statuses apart."""


def lines_that_stop(
    program: Program, asked: Confirmation, clauses: Sequence[Clause], turns: Turns
) -> StoppingLines:
    """Show that lines stop, with as few constant inputs as possible; follow reals only where something is left without."""
    first = found = _Ranking(program, asked, clauses, turns(()))
    still: tuple[str, ...] = ()
    rested_on = [found.solver]
    if found.endless and any(isinstance(kind, Real) for _, kind in owned(program)):
        first = found = _Ranking(program, asked.in_other_terms(Measured()), clauses, turns(()), first)
        rested_on.append(found.solver)
    if found.endless:
        still = inputs(program)
        found = _Ranking(program, asked, clauses, turns(still), first)
    for name in still if not found.endless else ():
        fewer = tuple(other for other in still if other != name)
        without = _Ranking(program, asked, clauses, turns(fewer), first)
        if not without.endless:
            found, still = without, fewer
    if still:
        rested_on.append(found.solver)
    asked.rested_on += rested_on
    endless = tuple(str(first.turn.at.lines[line][0].name) for line in sorted(found.endless))
    one_each = {counted.line: counted for counted in reversed(found.counted)}
    return StoppingLines(tuple(reversed(one_each.values())), () if endless else still, endless)


def inputs(program: Program) -> tuple[str, ...]:
    """List the records that the level reads."""
    return tuple(
        dict.fromkeys(str(v.name).partition(".")[0] for v in program.variables if v.kind is Kind.INPUT)
    )


@dataclass(frozen=True, slots=True)
class KeptNumber:
    """A number that the level keeps, before and after a cycle."""

    name: str
    kind: Scalar
    before: Term
    after: Term


class _Ranking:
    """The questions about the lines of one table, and the answers.

    Attributes:
        open: Lines to be looked at: those that a weaker look left.
        always: Steps that are left when lines that count are taken out, answered or not; `silent`, in quiet cycles.
        restless: Lines that may give order after order; `unanswered`, that may go on so in quiet cycles.
    """

    restless: set[int]
    unanswered: set[int]

    def __init__(
        self,
        program: Program,
        asked: Confirmation,
        clauses: Sequence[Clause],
        turns: tuple[Turn, Turn, Turn],
        weaker: "_Ranking | None" = None,
    ) -> None:
        _, self.turn, _ = turns
        term = asked.keyed.term
        stay = [term(turn.stays) for turn in turns]
        self.orders, self.quiet = term(self.turn.orders), smt.all_of([term(turn.quiet) for turn in turns])
        waits = term(self.turn.unanswered)
        self.last, self.now, self.next = ([term(match) for _, match in turn.at.lines] for turn in turns)
        self.numbers = [
            KeptNumber(name, kind, term(self.turn.before[name]), term(self.turn.after[name]))
            for name, kind in owned(program)
            if isinstance(kind, Int) or isinstance(asked.keyed, Measured)
        ]
        self.solver = asked.known(clauses)
        self.solver.add(*asked.keyed.ranges, *stay)
        self.counted: list[RisingLine] = []
        always, self.always = smt.truth(True), set(_every_step(len(self.now)))
        self.open = set(range(len(self.now))) if weaker is None else weaker.endless
        if weaker is None:
            self.always = self._steps(always, self.always)
        else:
            self.counted, self.always = list(weaker.counted), weaker.always
        self.always = self._uncounted(self.always, always)
        self.restless = self._unstopped(
            self.always, always, self.orders, None if weaker is None else weaker.restless
        )
        silent = self.always if weaker is None else self.always & weaker.silent
        self.silent: set[LinePair] = self._uncounted(self._steps(self.quiet, silent), self.quiet)
        self.unanswered = self._unstopped(
            self.silent, self.quiet, waits, None if weaker is None else weaker.unanswered
        )

    @property
    def endless(self) -> set[int]:
        """The lines that are left."""
        return self.restless | self.unanswered

    def _unstopped(self, steps: set[LinePair], when: Term, then: Term, among: set[int] | None) -> set[int]:
        """Return the lines, of those in `among`, that may do so again and again on a cycle of lines."""
        return {
            line
            for part in parts(steps)
            if may(self.solver, smt.any_of([self.now[line] for line in sorted(part)]), when, then)
            for line in sorted(part)
            if (among is None or line in among) and not self._stops(line, part, when, then)
        }

    def _steps(self, when: Term, among: set[LinePair]) -> set[LinePair]:
        """Return the steps among these that may be taken."""
        found: set[LinePair] = set()
        terms = {step: smt.all_of([self.now[step[0]], self.next[step[1]]]) for step in among}
        while left := [step for step in sorted(among) if step not in found]:
            self.solver.push()
            self.solver.add(when, smt.any_of([terms[step] for step in left]))
            answer = self.solver.check()
            if answer is Answer.SATISFIABLE:
                found |= {step for step in left if self.solver.value(terms[step], Bool())}
            self.solver.pop()
            if answer is Answer.UNKNOWN:
                return among
            if answer is Answer.UNSATISFIABLE:
                return found
        return found

    def _uncounted(self, steps: set[LinePair], when: Term) -> set[LinePair]:
        """Drop the steps of lines that stop because a counter rises."""
        again = True
        while again:
            again = False
            for part in parts(steps):
                stopped = {line for line in sorted(part & self.open) if self._stops(line, part, when, when)}
                if stopped:
                    again = True
                    steps = {step for step in steps if not stopped & set(step)}
        return steps

    def _stops(self, line: int, part: Part, when: Term, then: Term) -> bool:
        """Return whether the line runs only finitely often while the part's lines follow one another; note the counter."""
        self.solver.push()
        for turn in (self.last, self.next):
            self.solver.add(smt.any_of([turn[other] for other in sorted(part)]))
        self.solver.add(when)
        runs = smt.all_of([self.now[line], then])
        rising = self._rising_once(runs)
        counted = next(self._rising(line, part, runs, rising), None) if rising is not None else None
        self.solver.pop()
        if counted is not None and counted not in self.counted:
            self.counted.append(counted)
        return rising is None or counted is not None

    def _rising_once(self, runs: Term) -> list[KeptNumber] | None:
        """Return the numbers that rise in some cycle, to try only these; None where there is no such cycle."""
        self.solver.push()
        self.solver.add(runs)
        answer = self.solver.check()
        seen = [
            number
            for number in self.numbers
            if answer is not Answer.SATISFIABLE
            or self.solver.value(smt.below(number.before, number.after, KEY), Bool())
        ]
        self.solver.pop()
        return None if answer is Answer.UNSATISFIABLE else seen

    def _rising(self, line: int, part: Part, runs: Term, among: list[KeptNumber]) -> Iterator[RisingLine]:
        """Yield the numbers that always rise with the line and never fall within the part."""
        others = smt.any_of([self.now[other] for other in sorted(part)])
        name = str(self.turn.at.lines[line][0].name)
        for number in among:
            if may(self.solver, others, smt.below(number.after, number.before, KEY)):
                continue
            if isinstance(number.kind, Real):
                least = self._least_rise(runs, number, number.kind.high - number.kind.low)
                if least is not None:
                    yield RisingLine(name, number.name, least)
            elif not may(self.solver, runs, smt.at_most(number.after, number.before, KEY)):
                yield RisingLine(name, number.name)

    def _least_rise(self, runs: Term, number: KeptNumber, width: float) -> float | None:
        """Return how much the real rises at least; None where that is not shown to be anything."""

        def rises(power: int) -> bool:
            risen = smt.integer_operation("+", number.before, smt.fraction(width / 2**power))
            return not may(self.solver, runs, smt.below(number.after, risen, KEY))

        power = least_power(rises)
        return None if power is None else width / 2**power


def least_power(holds: Callable[[int], bool]) -> int | None:
    """Return the least of 0 .. SMALLEST of which it holds, given that it holds of all greater ones; None where of none."""
    if not holds(SMALLEST):
        return None
    return -furthest(-SMALLEST, 0, lambda power: holds(-power))


def owned(program: Program) -> list[tuple[str, Scalar]]:
    """List the numbers that the level keeps, and their pending values."""
    numbers = [v for v in program.variables if v.kind is Kind.STATE and isinstance(v.type, Int | Real)]
    later = [(str(pending(v.name)), v.type) for v in numbers if v.deferred_until is not None]
    return [*((str(v.name), v.type) for v in numbers), *later]


def _every_step(lines: int) -> list[LinePair]:
    return [(one, two) for one in range(lines) for two in range(lines)]


def parts(steps: set[LinePair]) -> list[Part]:
    """Return the strongly connected sets of lines (Warshall's closure: the lines are few)."""
    reach = set(steps)
    lines = sorted({line for step in steps for line in step})
    for middle in lines:
        reach |= {(a, c) for a in lines if (a, middle) in reach for c in lines if (middle, c) in reach}
    rounds = {frozenset(b for b in lines if (a, b) in reach and (b, a) in reach) for a in lines}
    return sorted((part for part in rounds if part), key=min)
