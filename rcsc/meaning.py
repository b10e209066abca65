"""Names for terms, what tables may rely on, and a digest of what a table's proof depends on.

In: the model. Out: text. Shared by the prover, its certificates and the checker, so that all three
speak of the same thing; no proof rests on it.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import replace

from rcsc.model import (
    Among,
    Apply,
    Assumption,
    AssumptionName,
    Expr,
    Literal,
    Program,
    Read,
    Standing,
    Table,
    Test,
)
from rcsc.resolve.leaves import read_by


def spelled(term: Expr) -> str:
    """A name for `term` that says all of what it is: two terms of one name are one term."""
    match term:
        case Literal(value=value, type=kind):
            return f"{type(kind).__name__.lower()}:{value!r}"
        case Read(name=name):
            return name
        case Apply(op=op, args=args):
            return f"({op.value} {' '.join(map(spelled, args))})"
        case Among(subject=subject, values=values):
            return f"(in {spelled(subject)} {' '.join(map(repr, values))})"
        case _:
            return f"({type(term).__name__} {term!r})"


def relying(program: Program) -> Program:
    """The program with its invariants as assumptions of the tables that read what they speak of."""
    if not program.invariants:
        return program
    made = [
        Assumption(AssumptionName(one.name), Standing.PROVED, one.condition, one.doc, one.span)
        for one in program.invariants
    ]
    reads = {one.name: set(read_by(one.condition)) for one in made}

    def of(table: Table) -> Table:
        names = tuple(one.name for one in made if not reads[one.name].isdisjoint(table.variables))
        return replace(table, assumptions=(*table.assumptions, *names)) if names else table

    tables = tuple(of(table) for table in program.tables)
    return replace(program, assumptions=(*program.assumptions, *made), tables=tables)


def with_stops(program: Program, stops: Mapping[str, tuple[AssumptionName, ...]]) -> Program:
    """The program, each table with its stopping assumptions (`Table.stops`); none where it is not named."""
    tables = tuple(replace(table, stops=stops.get(table.name, ())) for table in program.tables)
    return replace(program, tables=tables)


def checked(program: Program) -> tuple[int, ...]:
    """Positions of the assumptions that the executors check: monitored ones, and those that stop some table."""
    stopping = {name for table in program.tables for name in table.stops}
    return tuple(
        at
        for at, one in enumerate(program.assumptions)
        if one.standing is Standing.MONITORED or one.name in stopping
    )


def digest(program: Program, table: Table) -> str:
    """SHA-256 (hex) of the table's lines, its DEFAULT, its variables and its assumptions."""
    hashed = hashlib.sha256(b"rcsc table 1\n")
    wanted = set(table.variables)
    assumed = [a for a in program.assumptions if a.name in table.assumptions]
    for assumption in assumed:
        hashed.update(f"assume {assumption.name} {spelled(assumption.condition)}\n".encode())
    for variable in program.variables:
        if variable.name in wanted or assumed:
            hashed.update(f"variable {variable.name} {variable.type!r}\n".encode())
    numbers: dict[int, int] = {}
    for line in table.lines:
        for test in line.tests:
            if test is not None and id(test) not in numbers:
                numbers[id(test)] = len(numbers)
                hashed.update(_shown(test).encode())
        cells = [-1 if test is None else numbers[id(test)] for test in line.tests]
        hashed.update(f"line {line.name} {cells}\n".encode())
    default = table.default
    hashed.update(b"none" if default is None else b"unreachable" if default.unreachable else b"default")
    return hashed.hexdigest()


def _shown(test: Test) -> str:
    if test.box is not None:
        return f"test {test.variables[0]} {test.box}\n"
    return f"test {spelled(test.condition)}\n"
