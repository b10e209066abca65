"""Looks for inputs on which the executors disagree; what it finds is the simplest such session.

In: executors, a target, how many examples. Out: a disagreement, or None. Imported only where a search runs,
since it brings Hypothesis.
"""

from hypothesis import HealthCheck, Phase, Verbosity, assume, given, settings
from hypothesis import strategies as st

from rcsc.model import OneTable, Program, Table
from rcsc.testing.agree import (
    Compared,
    Disagreement,
    Executors,
    keeps_invariants,
    run_lines,
    run_session,
    within,
)
from rcsc.testing.sessions import Session
from rcsc.testing.strategies import declarations, sessions, snapshots
from rcsc.testing.targets import Target


class _FoundError(Exception):
    """Tells Hypothesis that an example fails."""


def _settings(examples: int) -> settings:
    return settings(
        max_examples=examples,
        derandomize=True,
        database=None,
        deadline=None,
        phases=(Phase.generate, Phase.shrink),
        suppress_health_check=list(HealthCheck),
        verbosity=Verbosity.quiet,
        print_blob=False,
        report_multiple_bugs=False,
    )


def table_of(program: Program, target: Target) -> Table | None:
    """The table whose lines the inputs should aim at."""
    if target.kind != "cycle":
        return program.tables[target.number]
    tables = program.levels[target.number].tables
    names = [tables.table] if isinstance(tables, OneTable) else [name for _, name in tables.tables]
    return next((table for table in program.tables if table.name == names[0]), None)


def hunt_sessions(
    executors: Executors, target: Target, compared: Compared, examples: int, most_cycles: int = 8
) -> Disagreement | None:
    """Runs drawn sessions of a step or a cycle.

    Args:
        executors: Of the program.
        target: The step or cycle.
        compared: Counts what was compared.
        examples: How many sessions.
        most_cycles: Longest session.
    """
    program = executors.program
    found: list[Disagreement] = []

    @_settings(examples)
    @given(sessions(declarations(program), table_of(program, target), most_cycles))
    def check(session: Session) -> None:
        assume(keeps_invariants(program, session))
        disagreement = run_session(executors, target, within(executors, target, session), compared)
        if disagreement is not None:
            found.append(disagreement)
            raise _FoundError

    return _run(check, found)


def hunt_lines(
    executors: Executors, target: Target, compared: Compared, examples: int
) -> Disagreement | None:
    """Runs drawn snapshots through the matchers, eight at a time."""
    program = executors.program
    found: list[Disagreement] = []
    one = snapshots(declarations(program), table_of(program, target))

    @_settings(max(1, examples // 8))
    @given(st.lists(one, min_size=1, max_size=8))
    def check(drawn: list[dict[str, bool | int | float]]) -> None:
        disagreement = run_lines(executors, target, drawn, compared)
        if disagreement is not None:
            found.append(disagreement)
            raise _FoundError

    return _run(check, found)


def _run(check: object, found: list[Disagreement]) -> Disagreement | None:
    try:
        check()  # type: ignore[operator]  # what @given makes has no type that says so
    except _FoundError:
        return found[-1]
    return None
