"""Spans of what was resolved inside a table cell, moved into the file.

Each distinct cell text is parsed and resolved once, with spans that count from the start of the cell; every
line that has the text gets it with spans of its own, so that a finding points into the right row.
"""

from dataclasses import replace

from rcsc.diagnostics.source import Span
from rcsc.lang.model import (
    Among,
    Apply,
    Assign,
    Call,
    Expr,
    Literal,
    Place,
    Read,
    ReadLocal,
    Select,
    Statement,
    ToElement,
)
from rcsc.lang.syntax import tree


def placed(expr: Expr, cell: Span) -> Expr:
    """The expression with spans in the file; parts that have them already are left alone."""
    if expr.span.file:
        return expr
    span = tree.absolute(expr.span, cell.file, cell.start)
    match expr:
        case Literal(value=value, type=kind):
            return Literal(value, kind, span)
        case Read(name=name, type=kind):
            return Read(name, kind, span)
        case ReadLocal(name=local, type=kind):
            return ReadLocal(local, kind, span)
        case Select(leaves=leaves, index=index, type=kind):
            return Select(leaves, placed(index, cell), kind, span)
        case Apply(op=op, args=args, type=kind):
            return Apply(op, tuple(placed(arg, cell) for arg in args), kind, span)
        case Among(subject=subject, values=values, type=kind):
            return Among(placed(subject, cell), values, kind, span)


def placed_statement(statement: Statement, cell: Span) -> Statement:
    """The statement of an action cell, a call or an assignment, with spans in the file."""
    span = statement.span
    if not span.file:
        span = tree.absolute(span, cell.file, cell.start)
    match statement:
        case Call(procedure=procedure, args=args):
            return Call(procedure, tuple(placed(arg, cell) for arg in args), span)
        case Assign(place=place, value=value):
            return Assign(_place(place, cell), placed(value, cell), span)
        case _:
            return replace(statement, span=span)


def _place(place: Place, cell: Span) -> Place:
    if isinstance(place, ToElement):
        return ToElement(place.leaves, placed(place.index, cell), place.type)
    return place
