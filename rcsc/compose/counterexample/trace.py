"""Finds the shortest run from the first cycle that breaks an obligation, as the interpreter does it.

In: a transition system and obligations. Out: `Trace`s: what the environment gave in each cycle, and what the reference interpreter, which
is the meaning of the language, made of it. The solver finds the inputs; the interpreter is run on them from the initial values, and only
what it does is shown. If it does not break the obligation, the trace is not believed: `NotReproducedError`.

Of the shortest runs the same simple one is always returned: an input stays as in the cycle before if it can, else it has the least
value that fits.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.obligations import Obligation, ObligationKey, Sort, obligations, pairs
from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle, Leaves, TransitionSystem, successor
from rcsc.compose.contract.watched import begin
from rcsc.compose.counterexample.cycle_run import CycleRun, Given, as_declared, broken, ran_on
from rcsc.compose.counterexample.simplest import Bounded, Simplest, constant_of
from rcsc.compose.exact.played import Played
from rcsc.compose.invariant.cubes import held
from rcsc.compose.invariant.pdr import Clause
from rcsc.lang.interpret import (
    UNDEFINED,
    initial,
)
from rcsc.lang.model import (
    Int,
    Op,
    Value,
    spell,
    value_of_key,
)
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node


class NotReproducedError(Exception):
    """The interpreter does not do as the solver: a bug in rcsc, or an operation that was left open.

    Attributes:
        guessed: Whether an operation was left open (`keyed`), so that it need not be a bug.
        undefined: Whether the run meets an operation that is not defined.
        beside: Where solver and interpreter differ, a line each.
    """

    def __init__(
        self, obligation: str, *, guessed: bool = False, beside: tuple[str, ...] = (), undefined: bool = False
    ) -> None:
        super().__init__(obligation)
        self.guessed, self.beside, self.undefined = guessed or undefined, beside, undefined


@dataclass(frozen=True, slots=True)
class Trace:
    """A run that breaks an obligation in its last cycle; no shorter one does.

    Attributes:
        obligation: The obligation that it breaks, in words.
        restarted: Whether it begins where a restart does, and not with the initial values.
        legal: Whether its environment did only what a neighbour that began with it can do (`TraceSearch.legal`).
    """

    obligation: str
    steps: tuple[CycleRun, ...]
    restarted: bool = False
    legal: bool = False


@dataclass(frozen=True, slots=True)
class TraceSearch:
    """Settings of a search for traces.

    Attributes:
        most: The most cycles of a run.
        restarted: Begin as after a restart.
        legal: The superior's numbers come one after the other, and each report is of an order of this run, none older than the one
            before: narrower than the contract, which leaves room for numbers that have gone round and for what stood in the buffers
            before a restart. Such a trace can happen to two levels that begin together. After a restart no report echoes more than the
            order that stands.
        start: Leaves that begin with other values than the initial ones.
        invariant: Begin in any state in which these clauses over these predicates hold, which need not be reached.
    """

    most: int = 10
    restarted: bool = False
    legal: bool = False
    start: Mapping[str, Value] = field(default_factory=dict)
    invariant: tuple[Sequence[Predicate], Sequence[Clause]] | None = None


TraceResult: TypeAlias = Trace | NotReproducedError


USUAL, LONGEST = 8, 100
"""Cycles of a run that are searched where nothing else is asked for; and where levels wait for a time."""


def usual_length(systems: Iterable[TransitionSystem]) -> int:
    """Return how many cycles a run is searched for: as many as the longest time that a table asks for needs, and some before and after."""
    counters = (v.type for ts in systems for v in ts.program.variables if v.counts is not None)
    times = (kind.high for kind in counters if isinstance(kind, Int))
    return max((USUAL, *(min(time + USUAL // 2, LONGEST) for time in times)))


def traces(
    ts: TransitionSystem,
    wanted: Sequence[Obligation],
    search: TraceSearch,
    gave_up: set[ObligationKey] | None = None,
) -> dict[ObligationKey, TraceResult]:
    """Find the shortest trace of each obligation that has one, all in one search; note those on which the solver gave up."""
    run = Unrolled(ts, search)
    waiting = {obligation.key: obligation for obligation in wanted}
    results: dict[ObligationKey, TraceResult] = {}
    for _ in range(search.most):
        if not waiting:
            break
        cycle = run.further()
        here = {
            obligation.key: wrong_in(obligation, cycle)
            for obligation in (*obligations(ts, cycle), *pairs(cycle))
        }
        for key, obligation in list(waiting.items()):
            try:
                if run.reaches(here[key]):
                    results[key] = run.reproduced(obligation, here[key])
                    del waiting[key]
            except GaveUpError:
                del waiting[key]
                if gave_up is not None:
                    gave_up.add(key)
    return results


def trace_of(ts: TransitionSystem, obligation: Obligation, run: Played) -> TraceResult:
    """Run what a search of all states has found on the interpreter; return it, or an error if it does not break the obligation."""
    neighbours = bool(ts.links.below) or ts.links.above is not None  # whose numbers may have gone round
    search = TraceSearch(len(run.taken), restarted=run.restarted, legal=not neighbours)
    try:
        trace = _ran(ts, obligation, [(taken, ()) for taken in run.taken], run.start, search)
    except UNDEFINED:  # `SAFE` says so
        return NotReproducedError(obligation.shown, undefined=True)
    if _breaks(ts, obligation, trace, len(run.taken)):
        return trace
    return NotReproducedError(obligation.shown, guessed=bool(run.opened))


def stopping(
    ts: TransitionSystem, obligation: Obligation, predicates: Sequence[Predicate], clauses: Sequence[Clause]
) -> Trace | None:
    """Find a cycle that breaks an obligation, and one before it that does not, from a state that the invariant leaves open.

    None if there is no such cycle, if the solver did not decide, or if the interpreter does otherwise. Without a cycle before it that
    keeps the obligation the one that breaks it stands alone.
    """
    for cycles in (2, 1):
        run = Unrolled(ts, TraceSearch(cycles, invariant=(predicates, clauses)))
        every = [{each.key: each for each in obligations(ts, run.further())} for _ in range(cycles)]
        *kept, wrong = (each[obligation.key] for each in every)
        for before in kept:
            run.require(before.holds)
        try:
            broken_last = wrong_in(wrong, run.cycles[-1])
            if run.reaches(broken_last):
                trace = run.reproduced(obligation, broken_last)
                return trace if isinstance(trace, Trace) else None
        except GaveUpError:
            return None
    return None


def wrong_in(obligation: Obligation, cycle: Cycle) -> Node:
    """Return the condition that the cycle breaks the obligation; its end state counts only if it does not end early."""
    wrong = values.negation(obligation.holds)
    early = obligation.sort in {Sort.ASSUMPTION, Sort.ONE_LINE, Sort.SOME_LINE, Sort.NO_DEFAULT}
    return wrong if early else values.both(wrong, cycle.goes_on)


@dataclass(slots=True)
class Unrolled:
    """Cycles one after the other, from the first of a run."""

    ts: TransitionSystem
    search: TraceSearch
    cycles: list[Cycle] = field(default_factory=list)
    _run: Bounded = field(default_factory=Bounded)
    _now: Leaves = field(init=False)
    _start: Leaves = field(init=False)
    _orders: dict[str, list[tuple[Node, Node]]] = field(default_factory=dict)
    _echoed: dict[str, Node] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._start = self.ts.restarted() if self.search.restarted else self.ts.initial()
        if self.search.invariant is not None:
            self._start = self.ts.havoc()
            for kept in held(*self.search.invariant, self._start):
                self._run.add(kept)
        self._start |= {
            leaf: values.constant(self.ts.kinds[leaf], value) for leaf, value in self.search.start.items()
        }
        self._now = self._start

    def require(self, condition: Node) -> None:
        """Search only runs in which the condition holds."""
        self._run.add(condition)

    def further(self) -> Cycle:
        """Add one cycle."""
        at = len(self.cycles) + 1
        if self.cycles:  # a fault would have ended the run
            self._run.add(self.cycles[-1].goes_on)
        cycle = self.ts.cycle(self._now, f" {at}", anew=self.search.restarted and at == 1)
        self.cycles.append(cycle)
        self._now = cycle.after
        self._run.add(cycle.contract)
        if self.search.legal:
            self._run.add(values.all_of(self._legal(cycle, at)))
        return cycle

    def _legal(self, cycle: Cycle, at: int) -> Iterator[Node]:
        yield in_order(self.ts, cycle.before, cycle.taken)
        if cycle.anew and (above := self.ts.links.above) is not None:
            yield values.compare(Op.LE, cycle.before[above.echo], cycle.before[above.number])
        for below in self.ts.links.below:
            yield from self._answers(below, cycle, at)

    def _answers(self, below: Below, cycle: Cycle, at: int) -> Iterator[Node]:
        """Return the conditions that the report is of an order published so far, none older than the one before."""
        orders = self._orders.setdefault(below.order, [])
        orders.append((cycle.before[below.number], cycle.before[below.command]))
        kind = Int(0, self.search.most)
        which = values.variable(f"{below.report} echoes {at}", kind)
        yield values.compare(Op.LE, self._echoed.get(below.report, values.constant(kind, 0)), which)
        yield values.compare(Op.LT, which, values.constant(kind, len(orders)))
        self._echoed[below.report] = which
        echo, echoed = cycle.taken[below.echo], cycle.taken[below.echoed]
        for place, (number, command) in enumerate(orders):
            it = values.both(values.equal(echo, number), values.equal(echoed, command))
            yield values.follows(values.equal(which, values.constant(kind, place)), it)

    def reaches(self, wrong: Node) -> bool:
        """Return whether the condition on the last cycle can hold.

        Raises:
            GaveUpError: The solver did not decide.
        """
        return self._run.holds([self._run.literal(wrong)])

    @property
    def effort(self) -> int:
        """What the answers so far took (`Sat.effort`)."""
        return self._run.effort

    def reproduced(self, obligation: Obligation, wrong: Node) -> TraceResult:
        """Run the simplest run that ends so; return it, or an error if it does not break the obligation.

        Raises:
            GaveUpError: The solver did not decide.
        """
        settled = Simplest(self._run, [self._run.literal(wrong)])
        start, given = self._settled(settled)
        try:
            trace = _ran(self.ts, obligation, given, start, self.search)
        except UNDEFINED:  # `SAFE` says so
            return NotReproducedError(obligation.shown, undefined=True)
        if _breaks(self.ts, obligation, trace, len(given)):
            return trace
        beside = self._beside(trace) if self._run.holds(settled.given) else ()
        # it may be about the results of extern procedures in the cycle after the last
        asks = any(cycle.calls for cycle in self.cycles)
        return NotReproducedError(obligation.shown, guessed=self.guessed or asks, beside=beside)

    def inputs(self, wrong: Node) -> tuple[dict[str, Value], list[Given]]:
        """Return every leaf before the simplest run that ends so, and the inputs and extern results of each cycle.

        Raises:
            GaveUpError: The solver did not decide.
        """
        return self._settled(Simplest(self._run, [self._run.literal(wrong)]))

    @property
    def guessed(self) -> bool:
        """Whether an operation was left open."""
        return self._run.guessed

    def _settled(self, settled: Simplest) -> tuple[dict[str, Value], list[Given]]:
        start = self._begins(settled)
        return start, self._simplest(settled, start)

    def _simplest(self, settled: Simplest, start: Mapping[str, Value]) -> list[Given]:
        """Fix the inputs and extern results of each cycle: an input keeps its value if it can."""
        given: list[Given] = []
        program = self.ts.program
        inputs = self.ts.inputs
        before = [start[name] for name in inputs]
        for cycle in self.cycles:
            before = settled.settle([cycle.taken[name] for name in inputs], before)
            given.append((dict(zip(inputs, before, strict=True)), settled.answers(program, cycle)))
        return given

    def _begins(self, settled: Simplest) -> dict[str, Value]:
        """Fix every leaf before the first cycle."""
        begun = {**initial(self.ts.program), **begin(self.ts.program), **self.search.start}
        if self.search.restarted or self.search.invariant is not None:
            # A state adopted from an input has its value.
            of_input = {self._start[name]: begun[name] for name in self.ts.inputs}
            begun = {
                name: constant_of(self._start[name], of_input.get(self._start[name], value))
                for name, value in begun.items()
            }
            unmet = [name for name in begun if not self._run.met(self._start[name])]
            for names in ([name for name in begun if name not in unmet], unmet):
                nodes = [self._start[name] for name in names]
                for node in nodes:
                    self._run.meet(node)  # a leaf that nothing asked about is initial, if it can be
                given = settled.settle(nodes, [begun[name] for name in names])
                begun |= dict(zip(names, given, strict=True))
        return begun

    def _beside(self, trace: Trace) -> tuple[str, ...]:
        """Describe the first cycle in which the solver's run and the interpreter's differ."""
        for number, (cycle, step) in enumerate(zip(self.cycles, trace.steps, strict=False), 1):
            solved = {
                name: value_of_key(kind, self._run.key(cycle.after[name]))
                for name, kind in self.ts.kinds.items()
                if name in step.after and self._run.met(cycle.after[name])
            }
            other = [
                f"cycle {number}: `{name}` = {spell(kind, solved[name])} by the solver, {spell(kind, step.after[name])} as it ran"
                for name, kind in self.ts.kinds.items()
                if name in solved and solved[name] != step.after[name]
            ]
            if other:
                return tuple(other)
        return ("every leaf that the solver spoke of is the same in both",)


def in_order(ts: TransitionSystem, before: Leaves, taken: Leaves) -> Node:
    """Return the condition that the superior's numbers come one after the other."""
    if (above := ts.links.above) is None:
        return values.TRUE
    last, now = before[above.number], taken[above.number]
    return values.either(values.equal(now, last), values.equal(now, successor(last)))


# --- the run -------------------------------------------------------------------------------


def _ran(
    ts: TransitionSystem,
    obligation: Obligation,
    given: Sequence[Given],
    start: Mapping[str, Value],
    search: TraceSearch,
) -> Trace:
    first, *later = ran_on(ts, start, given)
    steps = replace(first, anew=search.restarted), *later
    return Trace(obligation.shown, steps, search.restarted, search.legal)


def _breaks(ts: TransitionSystem, obligation: Obligation, trace: Trace, cycles: int) -> bool:
    ran = len(trace.steps) == cycles and all(as_declared(ts, step) for step in trace.steps)
    return ran and broken(ts, obligation, trace.steps[-1])
