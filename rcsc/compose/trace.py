"""The shortest way from the first cycle to where a goal is broken, run before it is shown.

In: a stepper and a goal. Out: a `Trace`: what the environment gave in each cycle, and what the reference interpreter, which is the
meaning of the language, made of it. The solver finds the inputs; the interpreter is run on them from the initial values, and only what it
does is shown. Where it does not break the goal, the trace is not believed: `NotReproducedError`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rcsc.compose.goals import Goal, Sort, goals
from rcsc.compose.keyed import Keyed, value_in
from rcsc.compose.transition import GHOST, Cycle, Leaves, Stepper
from rcsc.interpret import Fault, Outcome, cycle, initial
from rcsc.model import Bool, Kind, Literal, Program, Value, spell
from rcsc.prove import values
from rcsc.prove.smt import Answer, Solver


class NotReproducedError(Exception):
    """The interpreter does not do what the solver said: a bug in rcsc, or an operation that was left open (`guessed`)."""


@dataclass(frozen=True, slots=True)
class Step:
    """One cycle.

    Attributes:
        taken: The inputs.
        table: That ran; `line`, empty where none matched.
        fault: What ended the cycle early.
        failed: Monitored assumptions that did not hold.
        before: Every leaf at its start, inputs taken.
        after: Every leaf at its end.
    """

    taken: Mapping[str, Value]
    table: str
    line: str
    fault: Fault
    failed: tuple[str, ...]
    before: Mapping[str, Value]
    after: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Trace:
    """A run that breaks a goal in its last cycle; no shorter one does."""

    goal: str
    steps: tuple[Step, ...]


def shortest(stepper: Stepper, goal: Goal, most: int = 10, timeout_ms: int = 20_000) -> Trace | None:
    """The shortest trace of at most `most` cycles; None where there is none, or the solver gave up.

    Raises:
        NotReproducedError: The interpreter does not break the goal there.
    """
    keyed, leaves = Keyed(), stepper.first()
    solver = Solver(timeout_ms)
    cycles: list[Cycle] = []
    asserted = 0
    for number in range(1, most + 1):
        one = stepper.cycle(leaves, f" {number}")
        cycles.append(one)
        leaves = one.after
        wrong = keyed.term(values.negation(_same(goals(stepper, one), goal).holds))
        solver.add(keyed.term(one.contract))
        solver.add(*keyed.ranges[asserted:])
        asserted = len(keyed.ranges)
        answer = solver.check(wrong)
        if answer is Answer.SATISFIABLE:
            inputs = [_taken(stepper.program, cycle_, keyed, solver) for cycle_ in cycles]
            return replayed(stepper, goal, inputs)
        if answer is Answer.UNKNOWN:
            return None
    return None


def _same(every: tuple[Goal, ...], goal: Goal) -> Goal:
    return next(one for one in every if (one.sort, one.table, one.name) == (goal.sort, goal.table, goal.name))


def _taken(program: Program, one: Cycle, keyed: Keyed, solver: Solver) -> dict[str, Value]:
    """The inputs of a cycle in the model; what no condition reads is as it was at first."""
    found = {}
    for variable in program.variables:
        if variable.kind is Kind.INPUT:
            node = one.taken[variable.name]
            found[str(variable.name)] = (
                value_in(solver, keyed.term(node), variable.type) if keyed.met(node) else variable.initial
            )
    return found


def replayed(stepper: Stepper, goal: Goal, inputs: list[dict[str, Value]]) -> Trace:
    """The run on these inputs, from the initial values.

    Raises:
        NotReproducedError: It does not break the goal in its last cycle.
    """
    now = dict(initial(stepper.program))
    steps: list[Step] = []
    for taken in inputs:
        before = {**now, **taken}
        outcome = cycle(stepper.program, stepper.level, before)
        steps.append(_step(stepper, now, taken, outcome))
        now = outcome.snapshot
        if outcome.fault is not Fault.OK:
            break
    if len(steps) < len(inputs) or not broken(stepper, goal, steps[-1]):
        raise NotReproducedError(goal.shown)
    return Trace(goal.shown, tuple(steps))


def _step(stepper: Stepper, before: Mapping[str, Value], taken: dict[str, Value], outcome: Outcome) -> Step:
    after = outcome.snapshot
    chosen = stepper.table_of(after)
    line = "" if outcome.line is None else str(outcome.line)
    return Step(taken, chosen, line, outcome.fault, outcome.failed_assumptions, dict(before), after)


def broken(stepper: Stepper, goal: Goal, step: Step) -> bool:
    """Whether the cycle, as it ran, breaks the goal."""
    if goal.table and goal.table != step.table:
        return False
    match goal.sort:
        case Sort.ASSUMPTION:
            return goal.name in step.failed
        case Sort.ONE_LINE:
            return step.fault is Fault.SEVERAL_LINES
        case Sort.SOME_LINE:
            return step.fault is Fault.NO_LINE
        case Sort.NO_DEFAULT:
            table = next(one for one in stepper.program.tables if one.name == goal.table)
            return table.default is not None and step.line == table.default.name
        case _:
            return _broken_between(stepper, goal, step)


def _broken_between(stepper: Stepper, goal: Goal, step: Step) -> bool:
    """A goal about what stands before and behind a cycle."""
    before, after = _constants(stepper, step.before), _constants(stepper, step.after)
    taken = {name: after[name] for name in step.taken}
    middle = stepper.cycle(_constants(stepper, {**step.before, **step.taken})).middle
    ran = Cycle(before, taken, values.TRUE, {**middle, **taken}, (), after)
    holds = _same(goals(stepper, ran), goal).holds
    return holds.known and not holds.low


def _constants(stepper: Stepper, state: Mapping[str, Value]) -> Leaves:
    return {
        name: values.constant(kind, state[name])
        for name, kind in stepper.kinds.items()
        if not name.startswith(GHOST)
    } | {name: values.constant(kind, 0) for name, kind in stepper.kinds.items() if name.startswith(GHOST)}


def undeferred(program: Program) -> Program:
    """The program with every deferred state taken at once: what section 9 warns of."""
    at_once = tuple(
        replace(v, deferred_until=Literal(value=True, type=Bool())) if v.deferred_until is not None else v
        for v in program.variables
    )
    return replace(program, variables=at_once)


def time_line(stepper: Stepper, trace: Trace) -> list[str]:
    """The trace as text, a paragraph a cycle: the line that ran, then every leaf that is other than before, in declared order."""
    kinds = stepper.kinds
    lines = []
    for number, step in enumerate(trace.steps, 1):
        what = f"line `{step.line}`" if step.line else step.fault.name.lower().replace("_", " ")
        failed = "".join(f"; assumption `{name}` fails" for name in step.failed)
        lines.append(f"cycle {number}: table `{step.table}`, {what}{failed}")
        for words, leaves, old in (
            ("takes", step.taken, step.before),
            ("leaves", {k: v for k, v in step.after.items() if k not in step.taken}, step.before),
        ):
            changed = [
                f"{name} = {spell(kinds[name], value)}"
                for name, value in leaves.items()
                if old[name] != value
            ]
            if changed:
                lines.append(f"  {words} {', '.join(changed)}")
    return lines
