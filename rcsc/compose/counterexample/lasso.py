"""Finds the shortest fair lasso on which a command never completes, or a requirement waits for ever.

In: a transition system; tables whose commands are not shown to end, or a requirement that is not shown not to wait for ever. Out: `Lasso`s.
A lasso is a row of cycles after which every leaf but the numbers of orders is as before: of one command, unanswered in some of them; or
such that the requirement waits in each, and then leaves are enough that it depends on; numbers of the superior may go on, too, where the
level does nothing with them that tells one from another (`exact.shifted`). It is *fair*: each subordinate gets an order in it,
or has answered in all of its cycles, and nothing is refused. The interpreter runs what the solver finds, and then the lasso once more: the
second time has to be like the first, with numbers that are as much later.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from rcsc.compose.contract.obligations import Obligation, Sort, command_stays, obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.watched import begin
from rcsc.compose.counterexample.cycle_run import CycleRun, Given, as_cycle, as_declared, ran_on
from rcsc.compose.counterexample.trace import USUAL, NotReproducedError, Trace, TraceSearch, Unrolled
from rcsc.compose.exact.circuit import roots_of
from rcsc.compose.exact.played import played
from rcsc.compose.exact.shifted import later_by, numbers_above
from rcsc.compose.proof.eventually import circuit_of, never_waits, waiting, waits_of
from rcsc.compose.proof.termination import answered, unanswered
from rcsc.lang.interpret import UNDEFINED, Fault, holds
from rcsc.lang.model import Expr, Int, Value
from rcsc.lang.restart import NUMBERED, NUMBERS
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class Lasso:
    """A run that ends as it was before cycle `first`, counted from 1."""

    trace: Trace
    first: int


MOST_EFFORT = 30_000_000
"""No longer lassos are looked for after so much (`Sat.effort`): each cycle more may begin a lasso anywhere before it."""


def obligation_of(table: str) -> Obligation:
    """Return the obligation that the table's command ends, which is not about one cycle."""
    return Obligation(Sort.ENDS, table, "", values.TRUE)


def lassos(
    ts: TransitionSystem, tables: Sequence[str], search: TraceSearch
) -> dict[str, Lasso | NotReproducedError]:
    """Find the shortest fair lasso of each table on which its command never completes; the first cycle of a run is in none."""
    run = Unrolled(ts, search)
    by_table: dict[str, Lasso | NotReproducedError] = {}
    parts: dict[str, list[_Part]] = {table: [] for table in tables}
    for _ in range(search.most):
        waiting = [table for table in tables if table not in by_table]
        if not waiting or run.effort > MOST_EFFORT:
            break
        run.further()
        for table in waiting:
            parts[table] += (_Part.of(ts, table, cycle) for cycle in run.cycles[len(parts[table]) :])
            starts = range(1, len(run.cycles))
            every = [_comes_round(ts, run.cycles[start:], parts[table][start:]) for start in starts]
            try:
                if run.reaches(wrong := values.any_of(every)):
                    by_table[table] = _reproduced(ts, table, run, wrong)
            except GaveUpError:
                continue
    return by_table


@dataclass(frozen=True, slots=True)
class _Part:
    """What a cycle owes as a part of a lasso of a command, whichever cycles the lasso has besides.

    Attributes:
        goes: The condition that the cycle goes on with the command; `waits`, that it does not answer it.
        answered: For each subordinate the condition that it has answered.
    """

    goes: Node
    waits: Node
    answered: tuple[Node, ...]

    @classmethod
    def of(cls, ts: TransitionSystem, table: str, cycle: Cycle) -> "_Part":
        """Return that of a cycle in which the command's table is to run."""
        chosen = next(at.chosen for at in cycle.tables if at.table.name == table)
        refused = values.negation(cycle.refused)
        goes = values.all_of((cycle.contract, cycle.goes_on, refused, chosen, command_stays(ts, cycle)))
        return cls(goes, unanswered(ts, cycle), _answered(ts, cycle))


def comes_round(ts: TransitionSystem, table: str, cycles: Sequence[Cycle]) -> Node:
    """Return the condition that the cycles are a lasso of the table's command."""
    return _comes_round(ts, cycles, [_Part.of(ts, table, cycle) for cycle in cycles])


def _comes_round(ts: TransitionSystem, cycles: Sequence[Cycle], parts: Sequence[_Part]) -> Node:
    first, last = cycles[0], cycles[-1]
    moving = _moving(ts)
    same = [values.equal(first.before[leaf], last.after[leaf]) for leaf in first.before if leaf not in moving]
    waits = values.any_of(part.waits for part in parts)
    due = _due(ts, first, last, [part.answered for part in parts])
    return values.all_of((*(part.goes for part in parts), waits, *same, *due))


def _answered(ts: TransitionSystem, cycle: Cycle) -> tuple[Node, ...]:
    return tuple(answered(ts, cycle, below) for below in ts.links.below)


def _due(
    ts: TransitionSystem, first: Cycle, last: Cycle, answers: Iterable[tuple[Node, ...]]
) -> Iterator[Node]:
    """Yield that each subordinate gets an order from the first cycle to the last, or has answered in all, and that its echo goes on alike.

    Of each cycle there is given for each subordinate the condition that it has answered.
    """
    for below, all_answered in zip(ts.links.below, zip(*answers, strict=True), strict=True):
        ordered = values.negation(values.equal(first.before[below.number], last.after[below.number]))
        yield values.either(ordered, values.all_of(all_answered))
        before, after = (
            values.equal(leaves[below.echo], leaves[below.number]) for leaves in (first.before, last.after)
        )
        yield values.equal(before, after)


def _moving(ts: TransitionSystem) -> set[str]:
    """Return the leaves that go on: numbers of orders, and their echoes; and monitors, but of what the environment has to keep."""
    claimed = begin(replace(ts.program, environment=()))
    return {leaf for below in ts.links.below for leaf in (below.number, below.echo)} | set(claimed)


def _reproduced(ts: TransitionSystem, table: str, run: Unrolled, wrong: Node) -> Lasso | NotReproducedError:
    start, given = run.inputs(wrong)
    shown = obligation_of(table).shown
    try:
        steps = ran_on(ts, start, given)
        first = lasso_of(ts, table, steps)
    except UNDEFINED:
        return NotReproducedError(shown, undefined=True)
    if first is None or not all(as_declared(ts, step) for step in steps):
        return NotReproducedError(shown, guessed=run.guessed)
    return Lasso(Trace(shown, steps, run.search.restarted, run.search.legal), first)


def lasso_of(ts: TransitionSystem, table: str, steps: Sequence[CycleRun]) -> int | None:
    """Return the first cycle, from 1, of the shortest lasso with which the run ends; None if it ends with none."""
    return _first_of(ts, steps, partial(_is_lasso, ts, table), _echoes(ts))


def _echoes(ts: TransitionSystem) -> dict[str, str]:
    """Return the echoes of subordinates, each with the number as much later than which it comes in the next lap."""
    return {below.echo: below.number for below in ts.links.below}


def _first_of(
    ts: TransitionSystem,
    steps: Sequence[CycleRun],
    is_lasso: Callable[[Sequence[CycleRun]], bool],
    later: Mapping[str, str],
) -> int | None:
    for first in range(len(steps) - 1, 0, -1):
        lasso = steps[first:]
        if is_lasso(lasso):
            again = _again(ts, lasso, later)
            same = [(cycle_run.table, cycle_run.line) for cycle_run in lasso] == [
                (cycle_run.table, cycle_run.line) for cycle_run in again
            ]
            if same and is_lasso(again):
                return first + 1
    return None


def _is_lasso(ts: TransitionSystem, table: str, lasso: Sequence[CycleRun]) -> bool:
    if any(step.fault is not Fault.OK or step.table != table for step in lasso):
        return False
    return _is_true(comes_round(ts, table, [as_cycle(ts, step) for step in lasso]))


def _is_true(condition: Node) -> bool:
    return condition.known and bool(condition.low)


def _again(ts: TransitionSystem, lasso: Sequence[CycleRun], later: Mapping[str, str]) -> tuple[CycleRun, ...]:
    """Run the lasso again on the same inputs, but those that go on: each as much later as the leaf that it goes on with."""
    before, after = lasso[0].before, lasso[-1].after
    by = {leaf: int(after[number]) - int(before[number]) for leaf, number in later.items()}
    given = [
        (
            {
                leaf: (int(value) + by[leaf]) % NUMBERS if leaf in by else value
                for leaf, value in step.taken.items()
            },
            step.answers,
        )
        for step in lasso
    ]
    return ran_on(ts, {**after, **lasso[-1].left}, given)


# --- requirements that wait for ever -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A requirement that may wait for ever.

    Attributes:
        ts: The level, which owes that it never waits.
        waits: The condition that it waits, on the states of its monitor.
        leaves: The leaves that this depends on.
        ordered: Of these the numbers of the superior, which may go on all by as much.
    """

    ts: TransitionSystem
    owed: Obligation
    waits: Expr
    leaves: tuple[str, ...]
    ordered: frozenset[str] = frozenset()

    @classmethod
    def of(cls, ts: TransitionSystem, name: str) -> "_Waiting":
        """Return it of a level. Raises KeyError: no requirement of this name may wait for ever."""
        stated = waiting(ts)[name]
        assert stated.monitor is not None
        never, owed = never_waits(ts, stated)
        step = never.cycle(never.havoc())
        leaves, nodes = roots_of(step, [owed])
        return cls(never, owed, stated.monitor.waits, leaves, numbers_above(never, step, leaves, nodes))

    @property
    def numbers(self) -> frozenset[str]:
        """The numbers of orders, and their echoes, which go on."""
        below = {leaf for below in self.ts.links.below for leaf in (below.number, below.echo)}
        return self.ordered | below

    @property
    def later(self) -> dict[str, str]:
        """The inputs that go on, each with the leaf that it goes on with."""
        above = self.ts.links.above
        more = {above.number: above.number} if above is not None and self.ordered else {}
        return {**_echoes(self.ts), **more}

    def goes(self, cycle: Cycle) -> Node:
        """Return the condition that it waits in a cycle, in which nothing is refused."""
        waits = (values.negation(each.holds) for each in obligations(self.ts, cycle))
        return values.all_of((cycle.contract, cycle.goes_on, values.negation(cycle.refused), *waits))

    def same(self, cycles: Sequence[Cycle]) -> Node:
        """Return the condition that all is as before after the cycles, and that each subordinate got an order, or has answered."""
        first, last = cycles[0], cycles[-1]
        same = (
            values.equal(first.before[leaf], last.after[leaf])
            for leaf in self.leaves
            if leaf not in self.numbers
        )
        by = values.variable("numbers go on by", Int(*NUMBERED))
        on = (
            values.equal(later_by(first.before[leaf], by), last.after[leaf]) for leaf in sorted(self.ordered)
        )
        return values.all_of((*same, *on, *self._due(cycles)))

    def is_lasso(self, lasso: Sequence[CycleRun]) -> bool:
        """Return whether cycles that were run are a lasso on which it waits: on values, which is quick where it is long."""
        begins, ends = ({**lasso[0].before, **lasso[0].found}, {**lasso[-1].after, **lasso[-1].left})
        if any(begins.get(leaf) != ends.get(leaf) for leaf in self.leaves if leaf not in self.numbers):
            return False
        if len({(int(ends[leaf]) - int(begins[leaf])) % NUMBERS for leaf in self.ordered}) > 1:
            return False
        if not all(step.fault is Fault.OK and holds(self.waits, step.left) for step in lasso):
            return False
        below = self.ts.links.below
        return not below or _is_true(values.all_of(self._due([as_cycle(self.ts, step) for step in lasso])))

    def _due(self, cycles: Sequence[Cycle]) -> Iterator[Node]:
        return _due(self.ts, cycles[0], cycles[-1], (_answered(self.ts, cycle) for cycle in cycles))


def waiting_lasso(
    ts: TransitionSystem, name: str, searches: Sequence[TraceSearch]
) -> Lasso | NotReproducedError | None:
    """Find the shortest lasso on which a requirement waits for ever.

    Where all states can be searched it may be as long as it has to be, however many cycles are asked for; a short one is shown as simple as
    it can be.

    Raises:
        GaveUpError: The solver did not decide.
    """
    waits = _Waiting.of(ts, name)
    begun = any(search.start for search in searches)
    made = (
        None if begun or ts.links.below else circuit_of(ts, waiting(ts)[name])
    )  # it knows nothing of answers
    found = None if made is None else waits_of(made)
    if found is not None and found.complete and found.lasso is None:
        return None
    run = None if found is None or found.lasso is None else found.lasso.run
    for search in searches if run is None or len(run.given) <= USUAL else ():
        if (lasso := _simplest(waits, search)) is not None:
            return lasso
    if made is None or run is None:
        return None
    there = played(waits.ts, made, run)
    search = TraceSearch(len(there.taken), restarted=there.restarted, legal=ts.links.above is None)
    given = [(taken, ()) for taken in there.taken]
    return _ran_round(waits, there.start, given, search, guessed=bool(there.opened))


def _simplest(waits: _Waiting, search: TraceSearch) -> Lasso | NotReproducedError | None:
    run, goes = Unrolled(waits.ts, search), list[Node]()
    for _ in range(search.most):
        if run.effort > MOST_EFFORT:
            raise GaveUpError
        goes.append(waits.goes(run.further()))
        on, every = values.TRUE, list[Node]()
        for first in range(len(goes) - 1, 0, -1):
            on = values.both(goes[first], on)
            every.append(values.both(on, waits.same(run.cycles[first:])))
        if run.reaches(wrong := values.any_of(every)):
            start, given = run.inputs(wrong)
            return _ran_round(waits, start, given, search, guessed=run.guessed)
    return None


def _ran_round(
    waits: _Waiting, start: Mapping[str, Value], given: Sequence[Given], search: TraceSearch, *, guessed: bool
) -> Lasso | NotReproducedError:
    """Run what was found on the interpreter, and its loop once more."""
    shown = waits.owed.shown
    try:
        begun, *later = ran_on(waits.ts, start, given)
        steps = replace(begun, anew=search.restarted), *later
        first = _first_of(waits.ts, steps, waits.is_lasso, waits.later) if len(steps) == len(given) else None
    except UNDEFINED:
        return NotReproducedError(shown, undefined=True)
    if first is None or not all(as_declared(waits.ts, step) for step in steps):
        return NotReproducedError(shown, guessed=guessed)
    return Lasso(Trace(shown, steps, search.restarted, search.legal), first)


def waiting_lasso_of(ts: TransitionSystem, name: str, steps: Sequence[CycleRun]) -> int | None:
    """Return the first cycle, from 1, of the shortest lasso on which a requirement waits, with which the run ends; None if with none.

    Raises:
        KeyError: No requirement of this name may wait for ever.
    """
    waits = _Waiting.of(ts, name)
    return _first_of(waits.ts, steps, waits.is_lasso, waits.later)
