"""The leaves that expressions and statements read and write."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rcsc.lang.model import (
    Among,
    Apply,
    Arm,
    Assign,
    Call,
    Case,
    Expr,
    For,
    If,
    Literal,
    Local,
    Read,
    ReadLocal,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    VariableName,
    earlier,
)


def read_by(expr: Expr) -> Iterator[VariableName]:
    """Leaves that the expression reads, with repetition."""
    match expr:
        case Read(name=name):
            yield name
        case Select(leaves=leaves, index=index):
            yield from leaves
            yield from read_by(index)
        case Apply(args=args):
            for arg in args:
                yield from read_by(arg)
        case Among(subject=subject):
            yield from read_by(subject)
        case Literal() | ReadLocal():
            return


def one_earlier(expr: Expr) -> Expr:
    """The same expression of the values after the cycle before (`model.earlier`)."""
    match expr:
        case Read(name=name):
            return replace(expr, name=earlier(name))
        case Select(leaves=leaves, index=index):
            return replace(expr, leaves=tuple(map(earlier, leaves)), index=one_earlier(index))
        case Apply(args=args):
            return replace(expr, args=tuple(map(one_earlier, args)))
        case Among(subject=subject):
            return replace(expr, subject=one_earlier(subject))
        case Literal() | ReadLocal():
            return expr


def expressions(statement: Statement) -> Iterator[Expr]:
    """Expressions that the statement itself evaluates, not those of its blocks."""
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


def blocks(statement: Statement) -> Iterator[tuple[Statement, ...]]:
    """The blocks inside the statement."""
    match statement:
        case If(then=then, orelse=orelse):
            yield then
            yield orelse
        case Case(arms=arms, orelse=orelse):
            for arm in arms:
                yield _body(arm)
            yield orelse
        case For(body=body):
            yield body
        case _:
            return


def _body(arm: Arm) -> tuple[Statement, ...]:
    return arm.body


def everything(body: Iterable[Statement]) -> Iterator[Statement]:
    """All statements, blocks included."""
    for statement in body:
        yield statement
        for block in blocks(statement):
            yield from everything(block)


def written_by(statement: Statement) -> tuple[VariableName, ...]:
    """Leaves that the statement itself may write."""
    if not isinstance(statement, Assign):
        return ()
    if isinstance(statement.place, ToLeaf):
        return (statement.place.name,)
    return statement.place.leaves if isinstance(statement.place, ToElement) else ()
