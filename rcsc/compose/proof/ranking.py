"""Ranking: shows that lines stop following one another while the phase of a level stays.

In: three cycles in a row, as `Turn`s; the questions are about the middle one. Out: the lines that stop because a counter
rises, and those that are not shown to stop. The argument is in `termination`.
Counters are found one after another, each for what the earlier ones leave (Bradley, Manna and
Sipma, "Linear ranking with reachability", 2005).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
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
        before: The leaves before it; `taken`, its inputs; `after`, the leaves after it.
        stays: The condition that the table runs, and the command and the phase stay.
        orders: That an order is given.
        unanswered: That the command is not answered.
        answered: That the last orders are answered.
    """

    at: TableAt
    before: Leaves
    taken: Leaves
    after: Leaves
    stays: Node
    orders: Node
    unanswered: Node
    answered: Node

    @property
    def quiet(self) -> Node:
        """The condition that the last orders are answered, and no other is given."""
        return values.both(self.answered, values.negation(self.orders))

    def nodes(self, program: Program) -> list[Node]:
        """List all that is asked about."""
        asked = [
            self.stays,
            self.orders,
            self.unanswered,
            self.answered,
            *(when for _, when in self.at.lines),
        ]
        return asked + [leaves[name] for name, _ in owned(program) for leaves in (self.before, self.after)]


@dataclass(frozen=True, slots=True)
class StoppingLines:
    """Which lines of one table stop.

    Attributes:
        counted: Lines that stop because a counter rises.
        still: Inputs whose values, echoes and statuses apart, are assumed constant meanwhile.
        endless: Lines that are not shown to stop, even if all inputs are constant.
    """

    counted: tuple[RisingLine, ...]
    still: tuple[str, ...]
    endless: tuple[str, ...]


Turns: TypeAlias = Callable[[tuple[str, ...]], tuple[Turn, Turn, Turn]]
"""Three cycles in a row in which these inputs keep their values, echoes and statuses apart."""


def lines_that_stop(
    program: Program, asked: Confirmation, clauses: Sequence[Clause], turns: Turns
) -> StoppingLines:
    """Show that lines stop, with as few constant inputs as possible; follow reals only if something is left without."""
    free = turns(())
    first = ranking = _Ranking(program, asked, clauses, free)
    still: tuple[str, ...] = ()
    rested_on = [ranking.solver]
    if ranking.endless and any(isinstance(kind, Real) for _, kind in owned(program)):
        first = ranking = _Ranking(program, asked.in_other_terms(Measured()), clauses, free, first)
        rested_on.append(ranking.solver)
    if ranking.endless:
        read = _read_again(program, free)
        still = tuple(name for name in inputs(program) if name in read)
        ranking = _Ranking(program, asked, clauses, turns(still), first)
    if not ranking.endless:

        def stop(names: tuple[str, ...]) -> bool:
            nonlocal ranking
            without = _Ranking(program, asked, clauses, turns(names), first)
            ranking = ranking if without.endless else without
            return not without.endless

        still = fewest(still, stop)
    if still:
        rested_on.append(ranking.solver)
    asked.rested_on += rested_on
    endless = tuple(str(first.turn.at.lines[line][0].name) for line in sorted(ranking.endless))
    one_each = {counted.line: counted for counted in reversed(ranking.counted)}
    return StoppingLines(tuple(reversed(one_each.values())), () if endless else still, endless)


def fewest(names: tuple[str, ...], enough: Callable[[tuple[str, ...]], bool]) -> tuple[str, ...]:
    """Leave out names from the first on, as long as the others are enough; all are, and none are not.

    What is asked last of those that are enough is the result, or nothing was.
    """
    kept: tuple[str, ...] = ()
    while names:
        # what is enough with fewer names is enough with more
        many = furthest(0, len(names), lambda many: bool(others := kept + names[many:]) and enough(others))  # noqa: B023 - asked at once
        kept, names = kept + names[many : many + 1], names[many + 1 :]
    return kept


def _read_again(program: Program, turns: tuple[Turn, Turn, Turn]) -> set[str]:
    """Collect the records of which a question reads what a later cycle takes: that another one stays changes no question."""
    nodes = [node for turn in turns for node in turn.nodes(program)]
    read = values.variables(nodes).keys()
    return {
        leaf.partition(".")[0]
        for turn in turns[1:]
        for leaf, node in turn.taken.items()
        if not read.isdisjoint(values.variables([node]))
    }


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
        open: Lines to be shown to stop: those that a weaker ranking left.
        always: Steps that are left without lines that have a counter; `silent`, in quiet cycles.
        restless: Lines that may give orders for ever; `unanswered`, that may stay unanswered in quiet cycles for ever.
    """

    silent: set[LinePair]
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
        matches = [[term(match) for _, match in turn.at.lines] for turn in turns]
        self.numbers = [
            KeptNumber(name, kind, term(self.turn.before[name]), term(self.turn.after[name]))
            for name, kind in owned(program)
            if isinstance(kind, Int) or isinstance(asked.keyed, Measured)
        ]
        self.solver = asked.known(clauses)
        self.solver.add(*asked.keyed.ranges, *stay)
        self.last, self.now, self.next = (list(map(self.solver.named, each)) for each in matches)
        self.rises = [self.solver.named(smt.below(each.before, each.after, KEY)) for each in self.numbers]
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
        among = None if weaker is None else weaker.unanswered
        if weaker is not None:  # which of these steps may be taken matters only if they are too many
            self.silent = self._uncounted(silent, self.quiet)
            self.unanswered = self._unstopped(self.silent, self.quiet, waits, among)
            if not self.unanswered:
                return
        self.silent = self._uncounted(self._steps(self.quiet, silent), self.quiet)
        self.unanswered = self._unstopped(self.silent, self.quiet, waits, among)

    @property
    def endless(self) -> set[int]:
        """The lines that are not shown to stop."""
        return self.restless | self.unanswered

    def _unstopped(self, steps: set[LinePair], when: Term, then: Term, among: set[int] | None) -> set[int]:
        """Return the lines, of those in `among`, that may do `then` again and again on a loop of lines."""
        return {
            line
            for part in parts(steps)
            if may(self.solver, smt.any_of([self.now[line] for line in sorted(part)]), when, then)
            for line in sorted(part)
            if (among is None or line in among) and not self._stops(line, part, when, then)
        }

    def _steps(self, when: Term, among: set[LinePair]) -> set[LinePair]:
        """Return the steps among these that may be taken."""
        if not among:
            return among
        lines, possible = range(len(self.now)), set[LinePair]()
        new = self.solver.switch(smt.any_of([self._step(step) for step in sorted(among)]))
        asked = [self.solver.switch(when), new]
        while (answer := self.solver.check(*asked)) is Answer.SATISFIABLE:
            here, there = (
                [line for line in lines if self.solver.value(runs[line], Bool())]
                for runs in (self.now, self.next)
            )
            seen = sorted((among & set(product(here, there))) - possible)
            possible.update(seen)
            self.solver.add(*(smt.implication(new, smt.negation(self._step(step))) for step in seen))
        return among if answer is Answer.UNKNOWN else possible

    def _step(self, step: LinePair) -> Term:
        return smt.all_of([self.now[step[0]], self.next[step[1]]])

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
        asked = [*(self._one_of(turn, part) for turn in (self.last, self.next)), self.solver.switch(when)]
        runs = [*asked, self.now[line], self.solver.switch(then)]
        rising = self._rising_once(runs)
        if rising is None:
            return True
        counted = next(self._rising(line, part, asked, runs, rising), None)
        if counted is not None and counted not in self.counted:
            self.counted.append(counted)
        return counted is not None

    def _one_of(self, turn: list[Term], part: Part) -> Term:
        """Return a switch for one of the part's lines to run in this turn."""
        return self.solver.switch(smt.any_of([turn[other] for other in sorted(part)]))

    def _rising_once(self, runs: list[Term]) -> list[KeptNumber] | None:
        """Return the numbers that rise in one such cycle, to try only these; None if there is no such cycle."""
        answer = self.solver.check(*runs)
        if answer is Answer.UNSATISFIABLE:
            return None
        return [
            number
            for number, rises in zip(self.numbers, self.rises, strict=True)
            if answer is not Answer.SATISFIABLE or self.solver.value(rises, Bool())
        ]

    def _rising(
        self, line: int, part: Part, asked: list[Term], runs: list[Term], among: list[KeptNumber]
    ) -> Iterator[RisingLine]:
        """Yield the numbers that always rise with the line and never fall within the part."""
        others = [*asked, self._one_of(self.now, part)] if among else asked
        name = str(self.turn.at.lines[line][0].name)
        for number in among:
            if may(self.solver, *others, smt.below(number.after, number.before, KEY)):
                continue
            if isinstance(number.kind, Real):
                least = self._least_rise(runs, number, number.kind.high - number.kind.low)
                if least is not None:
                    yield RisingLine(name, number.name, least)
            elif not may(self.solver, *runs, smt.at_most(number.after, number.before, KEY)):
                yield RisingLine(name, number.name)

    def _least_rise(self, runs: list[Term], number: KeptNumber, width: float) -> float | None:
        """Return the least rise of the real; None if no rise is shown."""

        def rises(power: int) -> bool:
            risen = smt.integer_operation("+", number.before, smt.fraction(width / 2**power))
            return not may(self.solver, *runs, smt.below(number.after, risen, KEY))

        power = least_power(rises)
        return None if power is None else width / 2**power


def least_power(holds: Callable[[int], bool]) -> int | None:
    """Return the least of 0 .. SMALLEST for which it holds, if it then holds for all greater ones; None if for none."""
    if not holds(SMALLEST):
        return None
    return -furthest(-SMALLEST, 0, lambda power: holds(-power))


def owned(program: Program) -> list[tuple[str, Scalar]]:
    """List the numbers that the level keeps, and their pending values."""
    numbers = [v for v in program.variables if v.kind is Kind.STATE and isinstance(v.type, Int | Real)]
    later = [(str(pending(v.name)), v.type) for v in numbers if v.deferred_until is not None]
    return [*((str(v.name), v.type) for v in numbers), *later]


def _every_step(lines: int) -> list[LinePair]:
    return [(line, following) for line in range(lines) for following in range(lines)]


def parts(steps: set[LinePair]) -> list[Part]:
    """Return the strongly connected sets of lines (Warshall's closure: the lines are few)."""
    reach = set(steps)
    lines = sorted({line for step in steps for line in step})
    for middle in lines:
        reach |= {(a, c) for a in lines if (a, middle) in reach for c in lines if (middle, c) in reach}
    loops = {frozenset(b for b in lines if (a, b) in reach and (b, a) in reach) for a in lines}
    return sorted((part for part in loops if part), key=min)
