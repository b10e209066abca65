"""Variants of a program under other language rules, to show what each rule prevents.

In: a program. Out: a program with the same leaves, in the language as it is. Executors of a variant do not follow the tables as
written, and are marked like those of unproved tables (`findings`).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from rcsc.compose.contract.obligations import may_meet
from rcsc.lang.model import Bool, Column, Expr, Literal, Program, Table, Test
from rcsc.lang.questions import conjunction, disjunction, negation

TRUE = Literal(value=True, type=Bool())


def undeferred(program: Program) -> Program:
    """Write every deferred state at once instead of when its command is echoed; section 9 of Haynes et al. warns of it."""
    at_once = tuple(
        replace(v, deferred_until=TRUE) if v.deferred_until is not None else v for v in program.variables
    )
    return replace(program, variables=at_once)


def first_match(program: Program) -> Program:
    """Run the first of several matching lines: each line also requires that no earlier one matches."""
    return replace(program, tables=tuple(map(_first_match, program.tables)))


def defaults_reported(program: Program) -> Program:
    """Declare every DEFAULT line unreachable, to find the inputs that reach it."""
    return replace(
        program,
        tables=tuple(
            table
            if table.default is None
            else replace(table, default=replace(table.default, unreachable=True))
            for table in program.tables
        ),
    )


def _first_match(table: Table) -> Table:
    """Add a column in which a line that overlaps earlier ones requires that none of them matches."""
    meeting = may_meet(table)
    if not meeting:
        return table
    earlier = {at: [before for before, after in meeting if after == at] for at in range(len(table.lines))}
    conditions = [conjunction(line.conditions) for line in table.lines]
    lines = []
    for at, line in enumerate(table.lines):
        test = _none_of(table, [conditions[other] for other in earlier[at]]) if earlier[at] else None
        lines.append(replace(line, tests=(*line.tests, test)))
    return replace(table, columns=(*table.columns, Column("first", None, None)), lines=tuple(lines))


def _none_of(table: Table, conditions: list[Expr]) -> Test:
    return Test("no line before", negation(disjunction(conditions)), table.variables, None)


VARIANTS: Mapping[str, Callable[[Program], Program]] = {
    "without-deferral": undeferred,
    "first-match": first_match,
    "without-default": defaults_reported,
}
"""The variants by the names of their options."""
