"""Finds the shortest fair lasso on which a command never completes.

In: a transition system, tables whose commands are not shown to end. Out: `Lasso`s. A lasso is a row of cycles of one command, unanswered in
some of them, after which every leaf but the numbers of orders is as before. It is *fair*: each subordinate gets an order in it,
or has answered in all of its cycles. The interpreter runs what the solver finds, and then the lasso once more: the
second time has to be like the first, with numbers that are as much later.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rcsc.compose.contract.obligations import Obligation, Sort, command_stays
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.watched import begin
from rcsc.compose.counterexample.cycle_run import CycleRun, as_cycle, as_declared, ran_on
from rcsc.compose.counterexample.trace import NotReproducedError, Trace, TraceSearch, Unrolled
from rcsc.compose.proof.termination import answered, unanswered
from rcsc.lang.interpret import UNDEFINED, Fault
from rcsc.lang.restart import NUMBERS
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
    for _ in range(search.most):
        waiting = [table for table in tables if table not in by_table]
        if not waiting or run.effort > MOST_EFFORT:
            break
        run.further()
        for table in waiting:
            starts = range(1, len(run.cycles))
            every = [comes_round(ts, table, run.cycles[start:]) for start in starts]
            try:
                if run.reaches(wrong := values.any_of(every)):
                    by_table[table] = _reproduced(ts, table, run, wrong)
            except GaveUpError:
                continue
    return by_table


def comes_round(ts: TransitionSystem, table: str, cycles: Sequence[Cycle]) -> Node:
    """Return the condition that the cycles are a lasso of the table's command."""
    first, last = cycles[0], cycles[-1]
    number = next(at for at, table_at in enumerate(first.tables) if table_at.table.name == table)
    goes = [
        values.all_of(
            (
                cycle.contract,
                cycle.goes_on,
                values.negation(cycle.refused),
                cycle.tables[number].chosen,
                command_stays(ts, cycle),
            )
        )
        for cycle in cycles
    ]
    moving = _moving(ts)
    same = [values.equal(first.before[leaf], last.after[leaf]) for leaf in first.before if leaf not in moving]
    due = []
    for below in ts.links.below:
        ordered = values.negation(values.equal(first.before[below.number], last.after[below.number]))
        due.append(values.either(ordered, values.all_of(answered(ts, cycle, below) for cycle in cycles)))
        before, after = (
            values.equal(leaves[below.echo], leaves[below.number]) for leaves in (first.before, last.after)
        )
        due.append(values.equal(before, after))
    waits = values.any_of(unanswered(ts, cycle) for cycle in cycles)
    return values.all_of((*goes, waits, *same, *due))


def _moving(ts: TransitionSystem) -> set[str]:
    """Return the leaves that go on: numbers of orders, and their echoes; and monitors, which no level reads."""
    return {leaf for below in ts.links.below for leaf in (below.number, below.echo)} | set(begin(ts.program))


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
    for first in range(len(steps) - 1, 0, -1):
        lasso = steps[first:]
        if _is_lasso(ts, table, lasso):
            again = _again(ts, lasso)
            same = [(cycle_run.table, cycle_run.line) for cycle_run in lasso] == [
                (cycle_run.table, cycle_run.line) for cycle_run in again
            ]
            if same and _is_lasso(ts, table, again):
                return first + 1
    return None


def _is_lasso(ts: TransitionSystem, table: str, lasso: Sequence[CycleRun]) -> bool:
    if any(step.fault is not Fault.OK or step.table != table for step in lasso):
        return False
    round_ = comes_round(ts, table, [as_cycle(ts, step) for step in lasso])
    return round_.known and bool(round_.low)


def _again(ts: TransitionSystem, lasso: Sequence[CycleRun]) -> tuple[CycleRun, ...]:
    """Run the lasso again on the same inputs, with echoes as much later as the orders."""
    before, after = lasso[0].before, lasso[-1].after
    later = {below.echo: int(after[below.number]) - int(before[below.number]) for below in ts.links.below}
    given = [
        (
            {
                leaf: (int(value) + later[leaf]) % NUMBERS if leaf in later else value
                for leaf, value in step.taken.items()
            },
            step.answers,
        )
        for step in lasso
    ]
    return ran_on(ts, after, given)
