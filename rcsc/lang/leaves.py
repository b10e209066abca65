"""Walks over expressions and statements: their parts, the same with other parts, and the leaves that they read and write; free names."""

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import replace
from math import isfinite
from typing import assert_never

from rcsc.lang.model import (
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Expr,
    For,
    If,
    Literal,
    Local,
    Op,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    ToLocal,
    VariableName,
    earlier,
)


def parts(expr: Expr) -> Iterator[Expr]:
    """Yield the expression and all below it, wholes before parts."""
    waiting = [expr]
    while waiting:
        part = waiting.pop()
        yield part
        if isinstance(part, Apply):
            waiting += part.args[::-1]
        elif not isinstance(part, Read | Literal):  # most of them
            waiting += operands(part)


def operands(expr: Expr) -> tuple[Expr, ...]:
    """Return the expressions directly below it."""
    match expr:
        case Apply(args=args):
            return args
        case Among(subject=operand) | Select(index=operand):
            return (operand,)
        case Literal() | Read() | ReadLocal():
            return ()
        case _:
            assert_never(expr)


def is_finite(expr: Expr) -> bool:
    """Return whether no NaN or infinity can arise in the expression: then its values are ordered, and a comparison has an opposite."""
    return not isinstance(expr.type, Real) or (isfinite(expr.type.low) and isfinite(expr.type.high))


def conjuncts(condition: Expr) -> Iterator[Expr]:
    """Yield the conditions that `and` joins, left to right."""
    waiting = [condition]
    while waiting:
        part = waiting.pop()
        if isinstance(part, Apply) and part.op is Op.AND:
            waiting += reversed(part.args)
        else:
            yield part


def rebuilt(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """Return the expression with each of its operands changed; one without operands stays."""
    match expr:
        case Apply(args=args):
            return replace(expr, args=tuple(map(change, args)))
        case Among(subject=subject):
            return replace(expr, subject=change(subject))
        case Select(index=index):
            return replace(expr, index=change(index))
        case Literal() | Read() | ReadLocal():
            return expr


def read_by(expr: Expr) -> Iterator[VariableName]:
    """Yield the leaves that the expression reads, with repetition."""
    for part in parts(expr):
        if isinstance(part, Read):
            yield part.name
        elif isinstance(part, Select):
            yield from part.leaves


def one_earlier(expr: Expr) -> Expr:
    """Return the same expression over the values after the cycle before (`model.earlier`)."""
    return renamed(expr, earlier)


def renamed(expr: Expr, name_of: Callable[[VariableName], VariableName]) -> Expr:
    """Return the same expression with other names of leaves."""
    if isinstance(expr, Read):
        return replace(expr, name=name_of(expr.name))
    rest = rebuilt(expr, lambda part: renamed(part, name_of))
    return replace(rest, leaves=tuple(map(name_of, rest.leaves))) if isinstance(rest, Select) else rest


def expressions(statement: Statement) -> Iterator[Expr]:
    """Yield the expressions that the statement itself evaluates, not those of its blocks."""
    match statement:
        case Assign(place=place, value=value):
            yield value
            if isinstance(place, ToElement):
                yield place.index
        case Local(value=value):
            if value is not None:
                yield value
        case If(condition=condition):
            yield condition
        case Case(subject=subject):
            yield subject
        case Call(args=args):
            yield from args
        case For():
            return
        case _:
            assert_never(statement)


def blocks(statement: Statement) -> Iterator[tuple[Statement, ...]]:
    """Yield the blocks inside the statement."""
    match statement:
        case If(then=then, orelse=orelse):
            yield then
            yield orelse
        case Case(arms=arms, orelse=orelse):
            for arm in arms:
                yield arm.body
            yield orelse
        case For(body=body):
            yield body
        case Assign() | Local() | Call():
            return
        case _:
            assert_never(statement)


def everything(body: Iterable[Statement]) -> Iterator[Statement]:
    """Yield all statements, blocks included."""
    for statement in body:
        yield statement
        for block in blocks(statement):
            yield from everything(block)


def every_statement(program: Program) -> Iterator[Statement]:
    """Yield all statements of the procedures and of the tables' lines, blocks included."""
    for procedure in program.procedures:
        yield from everything(procedure.body)
    for table in program.tables:
        for line in table.every_line:
            yield from everything(action.statement for action in line.actions)


def called_by(body: Iterable[Statement]) -> Iterator[str]:
    """Procedures that the statements themselves call, blocks included."""
    return (str(call.procedure) for call in everything(body) if isinstance(call, Call))


def closure(called: Iterable[str], procedures: Mapping[str, Procedure]) -> set[str]:
    """Return the procedures that run when these do."""
    waiting, seen = list(called), set[str]()
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting.extend(called_by(procedures[name].body))
    return seen


def may_write(body: Iterable[Statement], procedures: Mapping[str, Procedure]) -> frozenset[VariableName]:
    """Return the leaves that the statements may write, calls included."""
    leaves: set[VariableName] = set()
    for statement in everything(body):
        leaves.update(written_by(statement))
        if isinstance(statement, Call):
            leaves.update(procedures[statement.procedure].writes)
    return frozenset(leaves)


def written_by(statement: Statement) -> tuple[VariableName, ...]:
    """Return the leaves that the statement itself may write."""
    if not isinstance(statement, Assign):
        return ()
    match statement.place:
        case ToLeaf(name=name):
            return (name,)
        case ToElement(leaves=leaves):
            return leaves
        case ToLocal():
            return ()


def free_name(name: str, taken: Container[str]) -> str:
    """Return the name, or the first of `NAME_2`, `NAME_3` that is not taken; for an array element numbered before the index.

    >>> free_name("go", {"go", "go_2"}), free_name("at[1]", {"at[1]"})
    ('go_3', 'at_2[1]')
    """
    base, bracket, rest = name.partition("[")
    number, free = 2, name
    while free in taken:
        free, number = f"{base}_{number}{bracket}{rest}", number + 1
    return free
