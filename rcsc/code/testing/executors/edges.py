"""The values of each leaf at which something can change: constants, their neighbours, bounds.

In: a program. Out: keys (see `rcsc.lang.model`) and readings outside the declared range.
"""

from collections.abc import Iterable, Iterator, Mapping
from math import inf, nan

from rcsc.code.emit.c.ctext import c_type
from rcsc.code.emit.code_tree import type_bounds
from rcsc.lang.interpret import holds
from rcsc.lang.leaves import everything, expressions, parts, read_by
from rcsc.lang.model import (
    Among,
    Bool,
    Case,
    Enum,
    Expr,
    Int,
    Literal,
    Program,
    Real,
    Scalar,
    Snapshot,
    Statement,
    Table,
    Test,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)

MOST_COMPANIONS = 8


def reads(expr: Expr) -> set[str]:
    """Return every leaf that `expr` may read."""
    return set(read_by(expr))


def _evaluated(body: Iterable[Statement]) -> Iterator[Expr]:
    """Yield every expression of the statements, inner statements included."""
    for statement in everything(body):
        if isinstance(statement, Case):
            yield from (Among(statement.subject, arm.values) for arm in statement.arms)
        else:
            yield from expressions(statement)


def relational_tests(table: Table) -> tuple[Test, ...]:
    """Return the tests that are no box, in order of their first line."""
    return tuple(test for test in table.distinct_tests if test.box is None)


def all_expressions(program: Program) -> Iterator[Expr]:
    """Yield every expression that the executors evaluate."""
    for table in program.tables:
        yield from (test.condition for test in table.distinct_tests)
        for line in table.lines:
            yield from _evaluated(action.statement for action in line.actions)
    for procedure in program.procedures:
        yield from _evaluated(procedure.body)
    yield from (assumption.condition for assumption in program.assumptions)
    yield from (invariant.condition for invariant in program.invariants)
    yield from (v.deferred_until for v in program.variables if v.deferred_until is not None)
    for level in program.levels:
        yield from level.selectors


def _constants(expr: Expr) -> Iterator[tuple[Scalar, Value]]:
    for part in parts(expr):
        if isinstance(part, Literal):
            yield part.type, part.value
        elif isinstance(part, Among):
            yield from ((part.subject.type, value) for value in part.values)


def _same_kind(left: Scalar, right: Scalar) -> bool:
    if isinstance(left, Enum) and isinstance(right, Enum):
        return left.name == right.name
    return type(left) is type(right)


def leaf_edges(program: Program) -> dict[str, tuple[int, ...]]:
    """Return for every leaf the keys at which a test, guard or bound may turn, with their neighbours."""
    kinds = {variable.name: variable.type for variable in program.variables}
    near: dict[str, set[int]] = {name: set() for name in kinds}
    for expr in all_expressions(program):
        constants = list(_constants(expr))
        for name in reads(expr) if constants else ():
            kind = kinds[name]  # type: ignore[index]  # every name read is a leaf
            for other, value in constants:
                if _same_kind(kind, other):
                    key = key_of(kind, value)
                    near[name].update((key - 1, key, key + 1))
    for table in program.tables:
        for test in table.distinct_tests:
            if test.box is not None:
                near[test.variables[0]].update(k + d for ends in test.box for k in ends for d in (-1, 0, 1))
    return {variable.name: _inside(variable, near[variable.name]) for variable in program.variables}


def _inside(variable: Variable, near: set[int]) -> tuple[int, ...]:
    low, high = key_bounds(variable.type)
    own = {low, high, key_of(variable.type, variable.initial), low + 1, high - 1}
    if isinstance(variable.type, Int | Real):
        own |= {0, 1, -1}
    return tuple(sorted(key for key in near | own if low <= key <= high))


def companions(program: Program) -> dict[str, tuple[str, ...]]:
    """Return for every leaf the leaves of its kind that it is compared with in an expression."""
    kinds: Mapping[str, Scalar] = {variable.name: variable.type for variable in program.variables}
    compared: dict[str, set[str]] = {}
    for expr in all_expressions(program):
        names = reads(expr)
        if 1 < len(names) <= MOST_COMPANIONS:
            for name in names:
                compared.setdefault(name, set()).update(
                    other for other in names if other != name and _same_kind(kinds[name], kinds[other])
                )
    return {name: tuple(sorted(others)) for name, others in compared.items() if others}


def outside(kind: Scalar) -> tuple[Value, ...]:
    """Return readings that a C variable of this kind can hold and that lie outside the range."""
    if isinstance(kind, Real):
        low, high = key_bounds(kind)
        beyond = [float(value_of_key(kind, key)) for key in (low - 1, high + 1)]
        return (nan, inf, -inf, *(value for value in beyond if abs(value) != inf))
    if isinstance(kind, Bool):
        return ()
    low, high = key_bounds(kind)
    least, greatest = type_bounds(c_type(kind))
    strange = {k for k in (least, low - 1, high + 1, greatest) if not low <= k <= high}
    return tuple(sorted(k for k in strange if least <= k <= greatest))


def may_be_matched(program: Program, table: Table, snapshot: Snapshot) -> bool:
    """Return whether the table's conditions are defined: the invariants hold, and no stopping assumption fails."""
    rests = [invariant.condition for invariant in program.invariants]
    rests += [assumption.condition for assumption in program.assumptions if assumption.name in table.stops]
    return all(holds(condition, snapshot) for condition in rests)
