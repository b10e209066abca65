"""One cycle of a level as the reference interpreter runs it, and what it breaks.

In: a transition system, the leaves before a cycle, what the environment gives. Out: a `CycleRun`. The interpreter is the meaning of the
language: a solver's cycle counts only if the interpreter does the same. `broken` decides whether a cycle that was run breaks an
obligation: one about matching by the interpreter's fault, any other by its own condition on the values that the interpreter left.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeAlias, assert_never

from rcsc.compose.contract.given import ExternAnswer, scripted
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.properties import invariant_kept, property_kept
from rcsc.compose.contract.transition import EARLY, Cycle, Leaves, TransitionSystem
from rcsc.compose.contract.watched import as_assumed, begin, is_ghost, step
from rcsc.lang.interpret import (
    ExternError,
    Fault,
    Outcome,
    admit,
    call,
    chosen_table,
    cycle,
    execute,
    holds,
    matching_lines,
    run_stage,
    settle,
)
from rcsc.lang.model import Snapshot, Statement, Table, Value
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class StageRun:
    """A table that ran before the last of a cycle; `failed`, its assumptions that did not hold."""

    table: str
    line: str
    failed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class CycleRun:
    """One cycle as the interpreter ran it.

    Attributes:
        taken: The inputs.
        table: The table that ran last, or the one that ended the cycle; `line`, its line, empty if none matched.
        fault: The fault that ended the cycle early.
        failed: Assumptions of the table that did not hold, monitored or not.
        before: Every leaf at its start, inputs as last taken.
        after: Every leaf at its end.
        matched: Every line that matched, DEFAULT left out.
        answers: The results of each call of an extern procedure, in order.
        stages: The tables that ran before it in the cycle.
        anew: Whether it is the first after a restart.
        found: The states of the monitors of requirements at its start, and `left` at its end: no leaves, and nobody's to read.
    """

    taken: Mapping[str, Value]
    table: str
    line: str
    fault: Fault
    failed: tuple[str, ...]
    before: Mapping[str, Value]
    after: Mapping[str, Value]
    matched: tuple[str, ...] = ()
    answers: tuple[ExternAnswer, ...] = ()
    stages: tuple["StageRun", ...] = ()
    anew: bool = False
    found: Mapping[str, Value] = field(default_factory=dict, repr=False)
    left: Mapping[str, Value] = field(default_factory=dict, repr=False)

    @property
    def ends_the_run(self) -> bool:
        """Whether it ended in a fault that the proofs exclude; after any other (`EARLY`) the next cycle runs."""
        return self.fault not in {Fault.OK, *EARLY}


Given: TypeAlias = tuple[Mapping[str, Value], tuple[ExternAnswer, ...]]
"""What the environment gives in a cycle: the inputs, and the results of extern procedures."""


def ran_on(ts: TransitionSystem, start: Mapping[str, Value], given: Sequence[Given]) -> tuple[CycleRun, ...]:
    """Run cycles from `start` on inputs and results of extern procedures, up to the first fault that ends a run.

    Monitors of requirements begin there, or have the states that stand in `start`.
    """
    begun = begin(ts.program)
    found = {name: start.get(name, value) for name, value in begun.items()}
    now = {name: value for name, value in start.items() if name not in begun}
    steps: list[CycleRun] = []
    for taken, answers in given:
        steps.append(one_cycle(ts, now, taken, answers, found))
        now, found = dict(steps[-1].after), dict(steps[-1].left)
        if steps[-1].ends_the_run:
            break
    return tuple(steps)


def one_cycle(
    ts: TransitionSystem,
    before: Mapping[str, Value],
    taken: Mapping[str, Value],
    answers: tuple[ExternAnswer, ...] = (),
    found: Mapping[str, Value] | None = None,
) -> CycleRun:
    """Run one cycle, in which extern procedures give these answers; `found`: the states of monitors, None where they begin."""
    with scripted(ts.program, answers):
        outcome = cycle(ts.program, ts.level, {**before, **taken})
    ran = _step(ts, before, taken, outcome, answers)
    found = begin(ts.program) if found is None else found
    return replace(ran, found=dict(found), left=step(ts.program, found, before, ran.after))


@dataclass(slots=True)
class Halfway:
    """A cycle up to its postprocess.

    Attributes:
        middle: Every leaf as the table saw it: inputs taken, deferred values settled, preprocess run, as far as it came.
        settled: Every leaf before the preprocess; `done`, before the postprocess, as far as it came.
        matched: Whether it came to the last table.
        acted: Whether its line, if one ran, was done.
        seen: The leaves as each table before the last saw them, in order, as far as it came.
        ended: The one of them whose lines, or assumptions, ended the cycle.
    """

    middle: dict[str, Value]
    settled: dict[str, Value]
    done: dict[str, Value]
    matched: bool = False
    acted: bool = False
    seen: list[tuple[Table, dict[str, Value]]] = field(default_factory=list)
    ended: Table | None = None


def halfway(ts: TransitionSystem, step: CycleRun) -> Halfway:
    """Run the first part of a cycle again, up to its postprocess."""
    program = ts.program
    now = admit(program, {**step.before, **step.taken})
    assert not isinstance(now, str)
    settle(program, now)
    half = Halfway(now, dict(now), now)
    try:
        with scripted(program, step.answers):
            for name in ts.level.preprocess:
                call(program, name, [], now)
            if not _stages(ts, half, now):
                return half
            half.matched, half.middle = True, dict(now)
            execute(program, _actions(ts.table(step.table), step.line), now, {})
            half.acted = step.fault is not Fault.ASSUMPTION
    except ExternError:
        pass
    return half


def _stages(ts: TransitionSystem, half: Halfway, now: dict[str, Value]) -> bool:
    """Run the tables before the last; return whether none of them ended the cycle."""
    for choice in ts.level.stages:
        table = chosen_table(ts.program, choice, now)
        half.seen.append((table, dict(now)))
        if run_stage(ts.program, table, now) is not Fault.OK:
            half.ended = table
            return False
    return True


def _failed(ts: TransitionSystem, table: Table, now: Snapshot) -> tuple[str, ...]:
    """Return the table's assumptions that do not hold where it runs."""
    return tuple(
        str(assumption.name)
        for assumption in ts.program.assumptions
        if assumption.name in table.assumptions and not holds(assumption.condition, now)
    )


def _actions(table: Table, name: str) -> list[Statement]:
    return [action.statement for line in table.every_line if line.name == name for action in line.actions]


def seen_by_table(ts: TransitionSystem, step: CycleRun) -> Snapshot | None:
    """Return the leaves as the table saw them; None if the cycle ended before."""
    half = halfway(ts, step)
    if half.ended is not None:
        return half.seen[-1][1]
    return half.middle if half.matched else None


def _step(
    ts: TransitionSystem,
    before: Mapping[str, Value],
    taken: Mapping[str, Value],
    outcome: Outcome,
    answers: tuple[ExternAnswer, ...],
) -> CycleRun:
    after = outcome.snapshot
    chosen = _chosen(ts, after, before)
    line = "" if outcome.line is None else str(outcome.line)
    matched: tuple[str, ...] = () if outcome.line is None else (line,)
    if outcome.fault is Fault.SEVERAL_LINES:
        matched = tuple(map(str, matching_lines(ts.table(chosen), after)))
    step = CycleRun(
        dict(taken),
        chosen,
        line,
        outcome.fault,
        outcome.failed_assumptions,
        dict(before),
        after,
        matched,
        answers,
    )
    return (
        _staged(ts, step)
        if ts.level.stages
        else replace(step, failed=(*step.failed, *_also_failed(ts, step)))
    )


def _chosen(ts: TransitionSystem, *states: Snapshot) -> str:
    """Return the table of the first of these states that selects one: a refused input may select none."""
    for state in states:
        with suppress(KeyError):
            return ts.table_of(state)
    return str(ts.level.table_names[-1])


def _staged(ts: TransitionSystem, step: CycleRun) -> CycleRun:
    """Split a cycle into its tables, each with the assumptions that failed where it ran."""
    if step.fault is Fault.ADMIT:
        return replace(step, failed=())
    half = halfway(ts, step)
    ran = dict(ts.lines_before(step.after))
    stages = tuple(
        StageRun(name, ran[name], _failed(ts, table, seen))
        for table, seen in half.seen
        if (name := str(table.name)) in ran
    )
    if half.ended is None:
        failed = _failed(ts, ts.table(step.table), half.middle) if half.matched else ()
        return replace(step, failed=failed, stages=stages)
    seen = half.seen[-1][1]
    matched = tuple(map(str, matching_lines(half.ended, seen)))
    return replace(
        step,
        table=str(half.ended.name),
        line="",
        failed=_failed(ts, half.ended, seen),
        matched=matched if step.fault is Fault.SEVERAL_LINES else (),
        stages=stages,
    )


def _also_failed(ts: TransitionSystem, step: CycleRun) -> tuple[str, ...]:
    """List the table's assumptions that failed and that no executor monitors."""
    table = ts.table(step.table)
    others = [
        assumption
        for assumption in ts.program.assumptions
        if assumption.name in table.assumptions
        and not assumption.standing.checked
        and assumption.name not in step.failed
    ]
    seen = seen_by_table(ts, step) if others else None
    return (
        () if seen is None else tuple(str(other.name) for other in others if not holds(other.condition, seen))
    )


def as_declared(ts: TransitionSystem, step: CycleRun) -> bool:
    """Return whether all trusted assumptions held, where the tables ran or over time: the search may have left that open."""
    failed = {*step.failed, *(name for stage in step.stages for name in stage.failed)}
    return not failed & ts.trusted and as_assumed(ts.program, step.found, step.left)


def broken(ts: TransitionSystem, obligation: Obligation, step: CycleRun) -> bool:
    """Return whether the cycle, as it ran, breaks the obligation.

    Raises:
        StopIteration: The level has no such obligation.
    """
    if obligation.table and obligation.table != step.table:
        return _broken_before(ts, obligation, step)
    match obligation.sort:
        case Sort.ASSUMPTION:
            return obligation.name in step.failed
        case Sort.ONE_LINE:
            return step.fault is Fault.SEVERAL_LINES and set(obligation.lines) <= set(step.matched)
        case Sort.SOME_LINE:
            return step.fault is Fault.NO_LINE
        case Sort.NO_DEFAULT:
            default = ts.table(obligation.table).default
            return default is not None and step.line == default.name
        case Sort.INVARIANT:
            kept = invariant_kept(ts, obligation.name, step.before, step.after)
            return not step.ends_the_run and not kept
        case Sort.PROPERTY | Sort.REQUIREMENT:
            ends = {**step.before, **step.found}, {**step.after, **step.left}
            kept = property_kept(ts, obligation.name, *ends)
            return not step.ends_the_run and not kept
        case Sort.SAFE:
            return ts.safety.within and not step.ends_the_run and _broken_between(ts, obligation, step)
        case Sort.SAME_ORDER:
            return _taken_again(ts, step)
        case Sort.OF_ITS_ORDER:
            return _misreported(ts, obligation.name, step)
        case (
            Sort.ECHOES
            | Sort.NUMBERED
            | Sort.NEXT_NUMBER
            | Sort.WAITS
            | Sort.ONCE
            | Sort.ANSWERED
            | Sort.PAUSES
            | Sort.DEFERRED
            | Sort.KEPT
            | Sort.OWED
            | Sort.ENDS
            | Sort.DONE_STAYS
            | Sort.FAILED_STAYS
            | Sort.PROTOCOL
        ):
            return _broken_between(ts, obligation, step)
        case _:
            assert_never(obligation.sort)


def _broken_before(ts: TransitionSystem, obligation: Obligation, step: CycleRun) -> bool:
    """Return whether a table that ran before the last breaks an obligation of its own: it ran one line, and the cycle went on."""
    ran = next((stage for stage in step.stages if stage.table == obligation.table), None)
    if ran is None:
        return False
    default = ts.table(ran.table).default
    at_default = default is not None and ran.line == default.name
    return (obligation.sort is Sort.ASSUMPTION and obligation.name in ran.failed) or (
        obligation.sort is Sort.NO_DEFAULT and at_default
    )


def _broken_between(ts: TransitionSystem, obligation: Obligation, step: CycleRun) -> bool:
    """Return whether the leaves before and after the cycle break the obligation's condition."""
    every = obligations(ts, as_cycle(ts, step))
    return _is_false(next(stated for stated in every if stated.key == obligation.key).holds)


def _taken_again(lower: TransitionSystem, step: CycleRun) -> bool:
    """Return whether another order is taken under the number that was taken last."""
    if (above := lower.links.above) is None:
        raise StopIteration
    fields = (above.command, *above.numbered)
    same = step.before[above.number] == step.taken[above.number]
    return same and any(step.before[leaf] != step.taken[leaf] for leaf in fields)


def _misreported(upper: TransitionSystem, report: str, step: CycleRun) -> bool:
    """Return whether this report misstates the level's last order."""
    below = next(neighbour for neighbour in upper.links.below if neighbour.report == report)
    before, taken = (
        {name: values.constant(upper.kinds[name], value) for name, value in of.items()}
        for of in (step.before, step.taken)
    )
    return _is_false(TransitionSystem.echo(below, before, taken))


def _is_false(node: Node) -> bool:
    return node.known and not node.low


def as_cycle(ts: TransitionSystem, step: CycleRun) -> Cycle:
    """Turn a cycle that ran into one of constant nodes."""
    before = _constants(ts, {**step.before, **step.found})
    after = _constants(ts, {**step.after, **step.left})
    taken = {name: after[name] for name in step.taken}
    half = halfway(ts, step)
    middle = _constants(ts, half.middle)
    seen = tuple(_constants(ts, leaves) for _, leaves in half.seen)
    return Cycle(
        before,
        taken,
        values.TRUE,
        {**middle, **taken},
        ts.tables(ts.level.tables, middle, matched=half.matched),
        after,
        values.truth(step.fault in EARLY),
        values.truth(not half.matched),
        values.truth(not half.acted),
        settled=_constants(ts, half.settled),
        acted=_constants(ts, half.done),
        stages=tuple(
            at
            for place, choice in enumerate(ts.level.stages)
            for at in ts.tables(
                choice, seen[place] if place < len(seen) else middle, matched=place < len(seen)
            )
        ),
        seen=seen,
        anew=step.anew,
    )


def _constants(ts: TransitionSystem, state: Mapping[str, Value]) -> Leaves:
    """Return a state as constant nodes; ghosts that nobody steps are 0, or false."""
    return {
        name: values.constant(kind, state.get(name, 0) if is_ghost(name) else state[name])
        for name, kind in ts.kinds.items()
    }
