"""Programs as if the language had other rules: what a rule is good for is seen where it is off.

In: a program. Out: one of the same leaves, whose meaning is the language's own again. Executors of a variant are not what the
tables say, so that they are marked like those of tables that do not prove (`findings`).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from rcsc.compose.contract.obligations import may_meet
from rcsc.lang.model import Apply, Bool, Column, Expr, Literal, Op, Program, Table, Test

TRUE = Literal(value=True, type=Bool())


def undeferred(program: Program) -> Program:
    """Take every deferred state at once, not when its command is echoed: what section 9 of Haynes et al. warns of."""
    at_once = tuple(
        replace(v, deferred_until=TRUE) if v.deferred_until is not None else v for v in program.variables
    )
    return replace(program, variables=at_once)


def first_match(program: Program) -> Program:
    """Run the first of several matching lines: each line also asks that none before it matches."""
    return replace(program, tables=tuple(map(_first_match, program.tables)))


def defaults_reported(program: Program) -> Program:
    """Declare every DEFAULT line unreachable, to find what falls to it."""
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
    """Add a column in which a line that can meet an earlier one asks that it does not match."""
    meeting = may_meet(table)
    if not meeting:
        return table
    earlier = {at: [one for one, two in meeting if two == at] for at in range(len(table.lines))}
    conditions = [
        _all_of([test.condition for test in line.tests if test is not None]) for line in table.lines
    ]
    lines = []
    for at, line in enumerate(table.lines):
        test = _none_of(table, [conditions[other] for other in earlier[at]]) if earlier[at] else None
        lines.append(replace(line, tests=(*line.tests, test)))
    return replace(table, columns=(*table.columns, Column("first", None, None)), lines=tuple(lines))


def _none_of(table: Table, conditions: list[Expr]) -> Test:
    found = conditions[0]
    for condition in conditions[1:]:
        found = Apply(Op.OR, (found, condition), Bool())
    return Test("no line before", Apply(Op.NOT, (found,), Bool()), table.variables, None)


def _all_of(conditions: list[Expr]) -> Expr:
    found: Expr = TRUE
    for condition in conditions:
        found = condition if found is TRUE else Apply(Op.AND, (found, condition), Bool())
    return found


VARIANTS: Mapping[str, Callable[[Program], Program]] = {
    "without-deferral": undeferred,
    "first-match": first_match,
    "without-default": defaults_reported,
}
"""Each by the name of its option."""
