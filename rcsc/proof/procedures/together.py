"""Tables that run in one cycle of a level: what they assume of the inputs, which are the same for all of them, can hold together.

In: a program. Out: an error for two tables of a level whose assumptions about inputs contradict each other: each is proved under its own,
and in every cycle one of them fails. What a stage before writes may differ from table to table, and is left out; so are tables of which a
level runs one or the other, by its command.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.lang.leaves import read_by
from rcsc.lang.model import AssumptionName, Kind, Level, Program, Table
from rcsc.proof.procedures.invariants import assumptions_satisfiable
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer


def assumed_together(program: Program, options: Options) -> Iterator[Diagnostic]:
    """Yield an error for each two tables of one level whose assumptions about the inputs contradict each other."""
    inputs = {variable.name for variable in program.variables if variable.kind is Kind.INPUT}
    plain = {each.name for each in program.assumptions if inputs.issuperset(read_by(each.condition))}
    tables = {table.name: table for table in program.tables}
    with smt.together(options.few.steps):
        for level in program.levels:
            for one, other in combinations(level.choices, 2):
                for first, second in product(one.names, other.names):
                    if first != second:
                        yield from _of_two(program, level, tables[first], tables[second], plain, options)


def _of_two(
    program: Program, level: Level, first: Table, second: Table, plain: set[AssumptionName], options: Options
) -> Iterator[Diagnostic]:
    """Yield an error where the two tables' assumptions about inputs are impossible together, and possible for each alone."""
    names = [[name for name in table.assumptions if name in plain] for table in (first, second)]
    if not all(names) or not _impossible(program, first, [*names[0], *names[1]], options):
        return
    if any(_impossible(program, first, each, options) for each in names):
        return  # which is told of the table itself
    spans = {each.name: each.span for each in program.assumptions}
    yield Diagnostic(
        Code.CONTRADICTORY_ASSUMPTIONS,
        f"tables `{first.name}` and `{second.name}` of level `{level.name}` run in one cycle, and assume what cannot hold together",
        Label(second.span),
        related=tuple(Label(spans[name], "assumed") for name in dict.fromkeys((*names[0], *names[1]))),
    )


def _impossible(program: Program, table: Table, names: list[AssumptionName], options: Options) -> bool:
    """Return whether no values satisfy these assumptions and the invariants."""
    asked = replace(table, assumptions=tuple(dict.fromkeys(names)))
    try:
        return assumptions_satisfiable(program, asked, options) is Answer.UNSATISFIABLE
    except smt.troubles():
        return False
