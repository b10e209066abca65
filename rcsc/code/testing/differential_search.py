"""Looks for inputs on which the executors disagree; what it finds is the simplest such session.

In: executors, a target, how many examples. Out: a disagreement, or None. The examples are the same each time.
"""

from collections.abc import Callable, Iterator
from random import Random

from rcsc.code.testing.agree import (
    AgreementCount,
    Disagreement,
    Executors,
    keeps_invariants,
    run_lines,
    run_session,
)
from rcsc.code.testing.executors.sessions import Stimuli
from rcsc.code.testing.executors.targets import ComparedFunction
from rcsc.code.testing.inputs.sampling import declarations, session, snapshot
from rcsc.lang.model import Program, Table

TRIES = 10
"""Sessions that are drawn for each that starts where the invariants hold."""
TOGETHER = 8
"""Snapshots that go through a matcher at once."""


def table_of(program: Program, target: ComparedFunction) -> Table | None:
    """The table whose lines the inputs should aim at."""
    if target.kind != "cycle":
        return program.tables[target.number]
    first = program.levels[target.number].tables.names[0]
    return next((table for table in program.tables if table.name == first), None)


def search_sessions(
    executors: Executors,
    target: ComparedFunction,
    compared: AgreementCount,
    examples: int,
    most_cycles: int = 8,
) -> Disagreement | None:
    """Runs drawn sessions of a step or a cycle.

    Args:
        executors: The program's executors.
        target: The step or cycle.
        compared: Counts what was compared.
        examples: How many sessions.
        most_cycles: Longest session.
    """
    program = executors.program
    known, table = declarations(program), table_of(program, target)
    random = Random(target.function)  # noqa: S311  # repeatable on purpose
    left = examples
    for _ in range(TRIES * examples):
        drawn = session(known, table, most_cycles, random)
        if not keeps_invariants(program, drawn):
            continue
        if disagreement := run_session(executors, target, drawn, compared):
            return simplest(
                program, disagreement, lambda stimuli: _differs(executors, target, stimuli, compared)
            )
        left -= 1
        if not left:
            break
    return None


def _differs(
    executors: Executors, target: ComparedFunction, stimuli: Stimuli, compared: AgreementCount
) -> Disagreement | None:
    if not keeps_invariants(executors.program, stimuli):
        return None
    return run_session(executors, target, stimuli, compared)


def search_lines(
    executors: Executors, target: ComparedFunction, compared: AgreementCount, examples: int
) -> Disagreement | None:
    """Runs drawn snapshots through a matcher, some at a time."""
    program = executors.program
    known, table = declarations(program), table_of(program, target)
    random = Random(target.function)  # noqa: S311  # repeatable on purpose
    for _ in range(max(1, examples // TOGETHER)):
        drawn = [snapshot(known, table, random) for _ in range(TOGETHER)]
        if disagreement := run_lines(executors, target, drawn, compared):
            return simplest(
                program, disagreement, lambda stimuli: run_lines(executors, target, [stimuli.start], compared)
            )
    return None


def simplest(
    program: Program, disagreement: Disagreement, differs: Callable[[Stimuli], Disagreement | None]
) -> Disagreement:
    """The disagreement, shrunk step by step to few cycles and few values that are not initial."""
    for stimuli in _shorter(disagreement):
        disagreement = differs(stimuli) or disagreement
    for variable in program.variables:
        name = str(variable.name)
        start = {**disagreement.session.start, name: variable.initial}
        changed = tuple(
            {**r, name: variable.initial} if name in r else r for r in disagreement.session.readings
        )
        disagreement = differs(Stimuli(start, changed)) or disagreement
    return disagreement


def _shorter(disagreement: Disagreement) -> Iterator[Stimuli]:
    """The session cut after the cycle that differs, then its last cycles alone."""
    start, kept = disagreement.session.start, disagreement.session.readings[: disagreement.cycle]
    yield Stimuli(start, kept)
    for count in (4, 2, 1):
        if count < len(kept):
            yield Stimuli(start, kept[-count:])
