"""Looks for inputs on which the executors disagree; what it finds is the simplest such session.

In: executors, a target, how many examples. Out: a disagreement, or None. Imported only where a search runs,
since it brings Hypothesis.
"""

from collections.abc import Callable, Iterator

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
        phases=(Phase.generate,),
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

    def differs(session: Session) -> Disagreement | None:
        if not keeps_invariants(program, session):
            return None
        return run_session(executors, target, session, compared)

    @_settings(examples)
    @given(sessions(declarations(program), table_of(program, target), most_cycles))
    def check(session: Session) -> None:
        assume(keeps_invariants(program, session))
        if (disagreement := differs(session)) is not None:
            found.append(disagreement)
            raise _FoundError

    first = _run(check, found)
    return None if first is None else simplest(program, first, differs)


def hunt_lines(
    executors: Executors, target: Target, compared: Compared, examples: int
) -> Disagreement | None:
    """Runs drawn snapshots through the matchers, eight at a time."""
    program = executors.program
    found: list[Disagreement] = []
    one = snapshots(declarations(program), table_of(program, target))

    def differs(session: Session) -> Disagreement | None:
        return run_lines(executors, target, [session.start], compared)

    @_settings(max(1, examples // 8))
    @given(st.lists(one, min_size=1, max_size=8))
    def check(drawn: list[dict[str, bool | int | float]]) -> None:
        disagreement = run_lines(executors, target, drawn, compared)
        if disagreement is not None:
            found.append(disagreement)
            raise _FoundError

    first = _run(check, found)
    return None if first is None else simplest(program, first, differs)


def simplest(
    program: Program, found: Disagreement, differs: Callable[[Session], Disagreement | None]
) -> Disagreement:
    """A disagreement with as few cycles, and as few values that are not initial, as can be had one by one."""
    for session in _shorter(found):
        found = differs(session) or found
    for variable in program.variables:
        name = str(variable.name)
        start = {**found.session.start, name: variable.initial}
        changed = tuple({**r, name: variable.initial} if name in r else r for r in found.session.readings)
        found = differs(Session(start, changed)) or found
    return found


def _shorter(found: Disagreement) -> Iterator[Session]:
    """The session cut after the cycle that differs, then its last cycles alone."""
    session = found.session
    kept = session.readings[: found.cycle]
    yield Session(session.start, kept)
    for count in (4, 2, 1):
        if count < len(kept):
            yield Session(session.start, kept[-count:])


def _run(check: object, found: list[Disagreement]) -> Disagreement | None:
    try:
        check()  # type: ignore[operator]  # what @given makes has no type that says so
    except _FoundError:
        return found[-1]
    return None
