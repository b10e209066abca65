"""The shortest run after which a command may go on for ever: it ends where it was before, and every order has its due.

In: a stepper, tables whose commands are not shown to end. Out: `Lap`s. A lap is some cycles of one command, in some of which
it is unanswered, behind which every leaf is as before them, but for the numbers of orders; of each subordinate it gets an
order in the lap, or all cycles of the lap are answered. What the solver finds is run by the interpreter, the lap once more than it
was found: its second time has to be like the first, with numbers that are as much later.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from rcsc.compose.contract.environment import ECHO, NUMBER
from rcsc.compose.contract.obligations import Goal, Sort
from rcsc.compose.contract.transition import NUMBERS, Cycle, Stepper
from rcsc.compose.counterexample.trace import (
    NotReproducedError,
    Search,
    Step,
    Trace,
    Unrolled,
    as_cycle,
    ran_on,
)
from rcsc.compose.proof.termination import answered, command_stays, unanswered
from rcsc.lang.interpret import Fault
from rcsc.solvers.sat import GaveUpError
from rcsc.symbolic import values
from rcsc.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class Lap:
    """A run that ends as it was before cycle `first`, counted from 1."""

    trace: Trace
    first: int


def goal_of(table: str) -> Goal:
    """That the table's command ends: no goal of one cycle."""
    return Goal(Sort.ENDS, table, "", values.TRUE)


def laps(stepper: Stepper, tables: Sequence[str], search: Search) -> dict[str, Lap | NotReproducedError]:
    """For each table for which there is one a lap, the first cycle of a run being in none."""
    run = Unrolled(stepper, search)
    found: dict[str, Lap | NotReproducedError] = {}
    for _ in range(search.most):
        waiting = [table for table in tables if table not in found]
        if not waiting:
            break
        run.further()
        for table in waiting:
            starts = range(1, len(run.cycles))
            every = [_comes_round(stepper, table, run.cycles[start:]) for start in starts]
            try:
                if run.reaches(wrong := values.any_of(every)):
                    found[table] = _told(stepper, table, run, wrong)
            except GaveUpError:
                continue
    return found


def _comes_round(stepper: Stepper, table: str, cycles: Sequence[Cycle]) -> Node:
    """That the cycles are a lap of the table's command."""
    first, last = cycles[0], cycles[-1]
    number = next(at for at, one in enumerate(first.tables) if one.table.name == table)
    goes = [
        values.all_of(
            (
                one.contract,
                one.goes_on,
                values.negation(one.refused),
                one.tables[number].chosen,
                command_stays(stepper, one),
            )
        )
        for one in cycles
    ]
    moving = _moving(stepper)
    same = [values.equal(first.before[leaf], last.after[leaf]) for leaf in first.before if leaf not in moving]
    due = []
    for below in stepper.links.below:
        sent, echo = f"{below.order}.{NUMBER}", f"{below.report}.{ECHO}"
        ordered = values.negation(values.equal(first.before[sent], last.after[sent]))
        due.append(values.either(ordered, values.all_of(answered(stepper, one, below) for one in cycles)))
        before, after = (values.equal(leaves[echo], leaves[sent]) for leaves in (first.before, last.after))
        due.append(values.equal(before, after))
    waits = values.any_of(unanswered(stepper, one) for one in cycles)
    return values.all_of((*goes, waits, *same, *due))


def _moving(stepper: Stepper) -> set[str]:
    """The numbers that go on: of orders, and their echoes."""
    ends = ((f"{below.order}.{NUMBER}", f"{below.report}.{ECHO}") for below in stepper.links.below)
    return {leaf for pair in ends for leaf in pair}


def _told(stepper: Stepper, table: str, run: Unrolled, wrong: Node) -> Lap | NotReproducedError:
    start, given = run.inputs(wrong)
    shown = goal_of(table).shown
    try:
        steps = ran_on(stepper, start, given)
        first = lap_of(stepper, table, steps)
    except (ArithmeticError, IndexError, ValueError):  # an operation that is not defined
        return NotReproducedError(shown, guessed=True)
    if first is None:
        return NotReproducedError(shown, guessed=run.guessed)
    return Lap(Trace(shown, steps, run.search.restarted, run.search.legal), first)


def lap_of(stepper: Stepper, table: str, steps: Sequence[Step]) -> int | None:
    """The first cycle, from 1, of the shortest lap with which the run ends; None where it ends with none."""
    for first in range(len(steps) - 1, 0, -1):
        lap = steps[first:]
        if _is_lap(stepper, table, lap):
            again = _again(stepper, lap)
            same = [(one.table, one.line) for one in lap] == [(one.table, one.line) for one in again]
            if same and _is_lap(stepper, table, again):
                return first + 1
    return None


def _is_lap(stepper: Stepper, table: str, lap: Sequence[Step]) -> bool:
    if any(step.fault is not Fault.OK or step.table != table for step in lap):
        return False
    round_ = _comes_round(stepper, table, [as_cycle(stepper, step) for step in lap])
    return round_.known and bool(round_.low)


def _again(stepper: Stepper, lap: Sequence[Step]) -> tuple[Step, ...]:
    """The lap once more, on the same inputs; what echoes an order echoes the one as much later."""
    before, after = lap[0].before, lap[-1].after
    later = {
        f"{below.report}.{ECHO}": int(after[f"{below.order}.{NUMBER}"])
        - int(before[f"{below.order}.{NUMBER}"])
        for below in stepper.links.below
    }
    given = [
        (
            {
                leaf: (int(value) + later[leaf]) % NUMBERS if leaf in later else value
                for leaf, value in step.taken.items()
            },
            step.answers,
        )
        for step in lap
    ]
    return ran_on(stepper, after, given)
