"""Ranking: shows that lines stop following one another while the phase of a level stays.

In: three cycles in a row, as `Turn`s; the questions are about the middle one. Out: the lines that stop because of a counter, and
those that are not shown to stop. The argument is in `termination`.
Counters are found one after another, each for what the earlier ones leave (Bradley, Manna and Sipma, "Linear ranking with
reachability", 2005): once one that never goes back is found, only cycles that leave it as it is remain to be looked at. The
weights of a sum are guessed from cycles that the solver shows, and then asked about.
"""

import sys
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import product
from operator import attrgetter
from typing import TypeAlias

from rcsc.compose.contract.transition import Leaves, TableAt
from rcsc.compose.invariant.confirm import Confirmation, may
from rcsc.compose.invariant.confirm import answer as answered
from rcsc.compose.invariant.pdr import Clause
from rcsc.lang.model import Bool, Int, Kind, Program, Real, Scalar, pending
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.search import furthest
from rcsc.proof.solvers.smt import Answer, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import KEY, sort
from rcsc.proof.symbolic.measured import Measured
from rcsc.proof.symbolic.values import Node

SMALLEST = 24
"""A real counter rises each time by its range divided by at most two to this power."""
LinePair = tuple[int, int]
"""A line and one that may run in the next cycle."""
Part = frozenset[int]
"""Lines each of which leads to every other one."""


MOST_GUESSES = 24
"""Sums of numbers that are asked about, for one line."""
WEIGHTS = (1, 4)
"""The greatest weight of a number in a sum: small ones first, which read better."""


@dataclass(frozen=True, slots=True)
class RisingLine:
    """A line that stops because a counter goes one way, and never back, in cycles that leave earlier counters of the line unchanged.

    Attributes:
        counter: A number of the level, or a sum of several, as it is read.
        least: By how much a real changes each time.
        falls: Whether it goes down.
    """

    line: str
    counter: str
    least: float | None = None
    falls: bool = False


@dataclass(frozen=True, slots=True)
class Turn:
    """One cycle of a table.

    Attributes:
        before: The leaves before it; `taken`, its inputs; `after`, the leaves after it.
        stays: The condition that the table runs, and the command and the phase stay.
        orders: The condition that an order is given.
        unanswered: The condition that the command is not answered.
        answered: The condition that the last orders are answered.
        ordered: For the report of each subordinate, the condition that an order is given to that one.
    """

    at: TableAt
    before: Leaves
    taken: Leaves
    after: Leaves
    stays: Node
    orders: Node
    unanswered: Node
    answered: Node
    ordered: Mapping[str, Node]

    @property
    def quiet(self) -> Node:
        """The condition that the last orders are answered, and no other is given."""
        return values.both(self.answered, values.negation(self.orders))

    def nodes(self, program: Program) -> list[Node]:
        """List all nodes that questions read."""
        asked = [
            self.stays,
            self.orders,
            self.unanswered,
            self.answered,
            *self.ordered.values(),
            *(when for _, when in self.at.lines),
        ]
        return asked + [leaves[name] for name, _ in owned(program) for leaves in (self.before, self.after)]


@dataclass(frozen=True, slots=True)
class StoppingLines:
    """The lines of one table that stop, and those that may not.

    Attributes:
        counted: Lines that stop because of a counter; where one has several, the first that counts comes first.
        still: Inputs from outside the levels whose values, echoes and statuses apart, are assumed constant meanwhile.
        settled: Reports of levels that are assumed to stand, as these get no order any more and have answered the last.
        endless: Lines that are not shown to stop, even if all such inputs are constant.
    """

    counted: tuple[RisingLine, ...]
    still: tuple[str, ...]
    endless: tuple[str, ...]
    settled: tuple[str, ...] = ()


Turns: TypeAlias = Callable[[tuple[str, ...], tuple[str, ...]], tuple[Turn, Turn, Turn]]
"""Three cycles in a row in which inputs keep their values, echoes and statuses apart: some as they are, others as they are reports of
subordinates that have answered and get no order."""


def lines_that_stop(
    program: Program,
    asked: Confirmation,
    clauses: Sequence[Clause],
    turns: Turns,
    outside: Container[str],
    answering: Container[str],
) -> StoppingLines:
    """Show that lines stop, with as few constant inputs as possible; follow reals only if something is left without.

    Only inputs from outside the levels are taken to be constant, and reports of subordinates that answer: for good, where no line may
    give them orders for ever. Of what else a level writes nothing is taken for granted.
    """
    free = turns((), ())
    first = ranking = _Ranking(program, asked, clauses, free)
    still: tuple[str, ...] = ()
    settled: tuple[str, ...] = ()
    rested_on = [ranking.solver]
    if ranking.endless and any(isinstance(kind, Real) for _, kind in owned(program)):
        first = ranking = _Ranking(program, replace(asked, keyed=Measured()), clauses, free, first)
        rested_on.append(ranking.solver)
    if ranking.endless:
        read = _read_again(program, free)
        still = tuple(name for name in inputs(program) if name in read and name in outside)
        if still:
            ranking = _Ranking(program, asked, clauses, turns(still, ()), first)
        if ranking.endless and (settled := _settled(ranking, read, answering)):
            rested_on.append(ranking.solver)
            ranking = _Ranking(program, asked, clauses, turns(still, settled), first)
    if not ranking.endless:

        def stop(names: tuple[str, ...]) -> bool:
            nonlocal ranking
            without = _Ranking(program, asked, clauses, turns(names, settled), first)
            ranking = ranking if without.endless else without
            return not without.endless

        still = fewest(still, stop)
    if still or settled:
        rested_on.append(ranking.solver)
    asked.rested_on += rested_on
    endless = tuple(str(first.turn.at.lines[line][0].name) for line in sorted(ranking.endless))
    taken = ((), ()) if endless else (still, settled)
    return StoppingLines(_first_of_each(ranking.counted), taken[0], endless, taken[1])


def _settled(ranking: "_Ranking", read: Container[str], answering: Container[str]) -> tuple[str, ...]:
    """List the reports that are read of subordinates that answer and that no line may give orders for ever."""
    return tuple(
        report
        for report in ranking.turn.ordered
        if report in read and report in answering and not ranking.orders_for_ever(report)
    )


def _first_of_each(counted: Sequence[Sequence[RisingLine]]) -> tuple[RisingLine, ...]:
    """Return the counters with which each line was first shown to stop."""
    first: dict[str, Sequence[RisingLine]] = {}
    for counters in counted:
        first.setdefault(counters[0].line, counters)
    return tuple(rising for counters in first.values() for rising in counters)


def fewest(names: tuple[str, ...], enough: Callable[[tuple[str, ...]], bool]) -> tuple[str, ...]:
    """Leave out names from the first on, as long as the others are enough; all of them are, and no names at all are not.

    The last question answered with "enough" was about the result, or nothing was asked.
    """
    kept: tuple[str, ...] = ()
    while names:
        # what is enough with fewer names is enough with more
        many = furthest(0, len(names), lambda many: bool(others := kept + names[many:]) and enough(others))  # noqa: B023 - asked at once
        kept, names = kept + names[many : many + 1], names[many + 1 :]
    return kept


def _read_again(program: Program, turns: tuple[Turn, Turn, Turn]) -> set[str]:
    """Collect the records whose values in a later cycle a question reads; whether any other stays changes no question."""
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
    """A number that the level keeps, or a sum of several, before and after a cycle."""

    name: str
    kind: Scalar
    before: Term
    after: Term

    def back(self, *, falls: bool) -> Term:
        """Return the term that it goes the other way."""
        return smt.below(self.before, self.after, KEY) if falls else smt.below(self.after, self.before, KEY)


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
        self.ordered = {report: term(node) for report, node in self.turn.ordered.items()}
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
        self.moves = [
            (each, falls, self.solver.named(each.back(falls=not falls)))
            for each in self.numbers
            for falls in (False, True)
        ]
        self.counted: list[tuple[RisingLine, ...]] = []
        lines = range(len(self.now))
        always, self.always = smt.truth(True), set(product(lines, lines))
        self.open = set(lines) if weaker is None else weaker.endless
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

    def orders_for_ever(self, report: str) -> bool:
        """Return whether some lines may give the subordinate that reports so orders for ever."""
        return bool(self._unstopped(self.always, smt.truth(True), self.ordered[report], None))

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
        """Drop the steps of lines that stop because of a counter; sums are tried where nothing else is left."""
        again = True
        while again:
            again = False
            for sums in (False, True):
                for part in parts(steps):
                    open_lines = sorted(part & self.open)
                    stopped = {line for line in open_lines if self._stops(line, part, when, when, sums=sums)}
                    if stopped:
                        again = True
                        steps = {step for step in steps if not stopped & set(step)}
                if again:
                    break
        return steps

    def _stops(self, line: int, part: Part, when: Term, then: Term, *, sums: bool = True) -> bool:
        """Return whether the line runs only finitely often while the part's lines follow one another; note the counters.

        A counter that goes one way in each cycle, or stays, comes to an end of its range: from some cycle on it stays. So the next
        one is looked for among cycles that leave the counters before it as they are, until the line runs in none of those.
        """
        asked = [*(self._one_of(turn, part) for turn in (self.last, self.next)), self.solver.switch(when)]
        runs = [*asked, self.now[line], self.solver.switch(then)]
        others = [*asked, self._one_of(self.now, part)]
        counted: list[RisingLine] = []
        while (moving := self._moving(runs)) is not None:
            found = self._counter(line, runs, others, moving)
            if found is None and sums:
                found = self._sum(line, runs, others)
            if found is None:
                return False
            rising, number = found
            counted.append(rising)
            if rising.least is not None:
                break
            stays = self.solver.switch(
                smt.negation(smt.any_of([number.back(falls=True), number.back(falls=False)]))
            )
            runs, others = [*runs, stays], [*others, stays]
        if counted and tuple(counted) not in self.counted:
            self.counted.append(tuple(counted))
        return True

    def _one_of(self, turn: list[Term], part: Part) -> Term:
        """Return a switch for one of the part's lines to run in this turn."""
        return self.solver.switch(smt.any_of([turn[other] for other in sorted(part)]))

    def _moving(self, runs: list[Term]) -> list[tuple[KeptNumber, bool]] | None:
        """Return the numbers that rise, or fall, in one such cycle, to try only these; None if there is no such cycle."""
        answer = self.solver.check(*runs)
        if answer is Answer.UNSATISFIABLE:
            return None
        return [
            (number, falls)
            for number, falls, moves in self.moves
            if answer is not Answer.SATISFIABLE or self.solver.value(moves, Bool())
        ]

    def _counter(
        self, line: int, runs: list[Term], others: list[Term], among: list[tuple[KeptNumber, bool]]
    ) -> tuple[RisingLine, KeptNumber] | None:
        """Find a number that moves one way in a cycle of the line and in no cycle of its part goes back."""
        for number, falls in among:
            if may(self.solver, *others, number.back(falls=falls)):
                continue
            if not isinstance(number.kind, Real):
                return RisingLine(self._name(line), number.name, falls=falls), number
            least = self._least_move(runs, number, falls=falls)
            if least is not None:
                return RisingLine(self._name(line), number.name, least, falls), number
        return None

    def _sum(self, line: int, runs: list[Term], others: list[Term]) -> tuple[RisingLine, KeptNumber] | None:
        """Find a sum of whole numbers with small weights that rises in a cycle of the line and falls in none of its part."""
        whole = [number for number in self.numbers if not isinstance(number.kind, Real)]
        if len(whole) < 2 or self.solver.check(*runs) is not Answer.SATISFIABLE:
            return None
        rise = self._differences(whole)
        for most in WEIGHTS:
            guesses = _Guesses(len(whole), most, rise)
            for weights in guesses:
                falls = next(filter(None, weights), 0) < 0  # as it is read: `a + b` falls
                number = _weighed(whole, [-weight for weight in weights] if falls else weights)
                answer = answered(self.solver, *others, number.back(falls=falls))
                if answer is Answer.UNSATISFIABLE:
                    return RisingLine(self._name(line), number.name, falls=falls), number
                if answer is Answer.UNKNOWN:
                    return None
                guesses.at_least(self._differences(whole), 0)
        return None

    def _name(self, line: int) -> str:
        return str(self.turn.at.lines[line][0].name)

    def _differences(self, whole: Sequence[KeptNumber]) -> list[int]:
        """Return by how much each number rises in the cycle that the solver shows."""
        return [
            int(self.solver.value(each.after, sort(each.kind)))
            - int(self.solver.value(each.before, sort(each.kind)))
            for each in whole
        ]

    def _least_move(self, runs: list[Term], number: KeptNumber, *, falls: bool) -> float | None:
        """Return by how much the real changes at least; None if that is not shown."""
        assert isinstance(number.kind, Real)
        # The difference of two ends may be beyond all doubles.
        width = min(number.kind.high - number.kind.low, sys.float_info.max)
        low, high = (number.after, number.before) if falls else (number.before, number.after)

        def moves(power: int) -> bool:
            moved = smt.integer_operation("+", low, smt.fraction(width / 2**power))
            return not may(self.solver, *runs, smt.below(high, moved, KEY))

        power = least_power(moves)
        return None if power is None else width / 2**power


class _Guesses:
    """Weights of a sum that rises in one cycle and falls in none that was shown; each is a guess."""

    def __init__(self, count: int, most: int, rise: Sequence[int]) -> None:
        self._kind = kind = Int(-most, most)
        self._solver = smt.Solver()
        self._weights = [smt.variable(f"weight {at}", kind) for at in range(count)]
        for weight in self._weights:
            self._solver.add(smt.at_most(smt.literal(kind, kind.low), weight, kind))
            self._solver.add(smt.at_most(weight, smt.literal(kind, kind.high), kind))
        self.at_least(rise, 1)

    def __iter__(self) -> Iterator[list[int]]:
        for _ in range(MOST_GUESSES):
            if self._solver.check() is not Answer.SATISFIABLE:
                return
            yield [int(self._solver.value(weight, self._kind)) for weight in self._weights]

    def at_least(self, change: Sequence[int], least: int) -> None:
        """Leave out weights whose sum changes by less where the numbers change so."""
        changed = _sum_of(
            [(smt.literal(self._kind, by), weight) for by, weight in zip(change, self._weights, strict=True)]
        )
        self._solver.add(smt.at_most(smt.literal(self._kind, least), changed, self._kind))


def _sum_of(products: Sequence[tuple[Term, Term]]) -> Term:
    terms = [smt.integer_operation("*", left, right) for left, right in products]
    return reduce(lambda total, term: smt.integer_operation("+", total, term), terms)


def _weighed(whole: Sequence[KeptNumber], weights: Sequence[int]) -> KeptNumber:
    """Return the sum of the numbers with these weights, named as it is read."""
    some = [(weight, number) for weight, number in zip(weights, whole, strict=True) if weight]
    before, after = (
        _sum_of([(smt.literal(number.kind, weight), end(number)) for weight, number in some])
        for end in (attrgetter("before"), attrgetter("after"))
    )
    text = " ".join(
        f"{'-' if weight < 0 else '+'} {'' if abs(weight) == 1 else f'{abs(weight)} * '}{number.name}"
        for weight, number in some
    )
    return KeptNumber(text.removeprefix("+ "), some[0][1].kind, before, after)


def least_power(holds: Callable[[int], bool]) -> int | None:
    """Return the least of 0 .. SMALLEST for which it holds, if it then holds for all greater ones; None if for none."""
    if not holds(SMALLEST):
        return None
    return -furthest(-SMALLEST, 0, lambda power: holds(-power))


def owned(program: Program) -> list[tuple[str, Scalar]]:
    """List the numbers that the level keeps, and their pending values; and how long what is assumed over time has been waited for."""
    numbers = [v for v in program.variables if v.kind is Kind.STATE and isinstance(v.type, Int | Real)]
    later = [(str(pending(v.name)), v.type) for v in numbers if v.deferred_until is not None]
    kept = (
        state
        for stated in program.environment
        if stated.monitor is not None
        for state in stated.monitor.states
    )
    times = [(str(state.name), state.type) for state in kept if isinstance(state.type, Int)]
    return [*((str(v.name), v.type) for v in numbers), *later, *times]


def parts(steps: set[LinePair]) -> list[Part]:
    """Return the strongly connected sets of lines (Warshall's closure: the lines are few)."""
    reach = set(steps)
    lines = sorted({line for step in steps for line in step})
    for middle in lines:
        reach |= {(a, c) for a in lines if (a, middle) in reach for c in lines if (middle, c) in reach}
    loops = {frozenset(b for b in lines if (a, b) in reach and (b, a) in reach) for a in lines}
    return sorted((part for part in loops if part), key=min)
