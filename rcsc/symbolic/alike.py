"""Whether two lines of one table do the same, wherever both match.

In: a table and two of its lines. Out: `Effects`: that they do, or what they leave different for some such input. Both do the
same where their actions come to their end alike, call the same extern procedures in the same states with the same values, and
leave every variable the same: text plays no part. Z3 is asked under what the table may rely on, and of each variable by itself;
what folds is not asked.

It costs a question a variable that the lines may leave different.
"""

from collections.abc import Iterator, Sequence

from rcsc.diagnostics.diagnostic import Effects
from rcsc.lang.model import Line, Program, Table
from rcsc.solvers import smt
from rcsc.solvers.options import Options
from rcsc.solvers.smt import Answer, Solver
from rcsc.symbolic import values
from rcsc.symbolic.effect import Effect, Meaning, Shared, differences
from rcsc.symbolic.evaluation import TooLongError
from rcsc.symbolic.execution import Run
from rcsc.symbolic.values import Node


def alike(program: Program, table: Table, pair: tuple[int, int], options: Options) -> Effects:
    """Compare two lines, by position, for every input that both match and the table's assumptions admit: there is one.

    Invariants count where they are among these assumptions (`meaning.relying`).
    """
    first, second = (table.lines[at] for at in pair)
    if _spelled(first) == _spelled(second):
        return Effects(same=True)
    try:
        return _compared(program, table, (first, second), options)
    except (TooLongError, RecursionError):
        return Effects(same=None)
    except smt.troubles():
        return Effects(same=None)


def _spelled(line: Line) -> list[object]:
    """The line's statements, which say all that it does."""
    return [action.statement for action in line.actions]


def _compared(program: Program, table: Table, pair: tuple[Line, Line], options: Options) -> Effects:
    kinds = {str(variable.name): variable.type for variable in program.variables}
    shared = Shared()
    for name, kind in kinds.items():
        shared.start[name] = shared.canonical(values.variable(name, kind))
    meaning = Meaning(program, kinds, shared)
    first, second = (meaning.effect(action.statement for action in line.actions) for line in pair)
    changes = list(_changes(first, second, list(kinds), shared))
    if not changes:
        return Effects(same=True)
    here = list(_here(program, table, pair, shared))
    answers = {name: _possible([*here, change], options) for name, change in changes}
    differ = tuple(name for name, answer in answers.items() if answer is Answer.SATISFIABLE)
    open_ = Answer.UNKNOWN in answers.values()
    return Effects(False if differ else None if open_ else True, differ)


def _changes(first: Effect, second: Effect, leaves: list[str], shared: Shared) -> Iterator[tuple[str, Node]]:
    """Yield what can differ afterwards, and where it does."""
    for name, change in differences(first, second, leaves, shared):
        if change is not values.FALSE:
            yield name, change


def _here(program: Program, table: Table, pair: Sequence[Line], shared: Shared) -> Iterator[Node]:
    """Yield what holds where both lines match."""
    run = Run({}, {str(variable.name): variable.type for variable in program.variables}, shared.start)
    for line in pair:
        yield from (run.evaluate(test.condition) for test in line.tests if test is not None)
    for assumption in program.assumptions:
        if assumption.name in table.assumptions:
            yield run.evaluate(assumption.condition)


def _possible(nodes: list[Node], options: Options) -> Answer:
    *_, change = nodes
    if change is values.TRUE:  # wherever both match
        return Answer.SATISFIABLE
    solver = Solver(options.limits)
    solver.add(*values.domain(values.variables(nodes).values()), *map(values.term_of, nodes))
    return solver.check()
