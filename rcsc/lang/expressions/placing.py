"""Spans of what was resolved inside a table cell, moved into the file.

Each distinct cell text is parsed and resolved once, with spans that count from the start of the cell; every
line that has the text gets it with spans of its own, so that a finding points into the right row.
"""

from dataclasses import replace

from rcsc.lang.leaves import rebuilt
from rcsc.lang.model import (
    Apply,
    Assign,
    Call,
    Expr,
    Literal,
    Place,
    Read,
    Statement,
    ToElement,
)
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import Cell


def placed(expr: Expr, cell: Cell) -> Expr:
    """Return the expression with spans in the file; leave parts alone that have them already."""
    if expr.span.file:
        return expr
    span = tree.absolute(expr.span, cell)
    if isinstance(expr, Apply):  # most of them
        return Apply(expr.op, tuple([placed(part, cell) for part in expr.args]), expr.type, span)
    if isinstance(expr, Read):
        return Read(expr.name, expr.type, span)
    if isinstance(expr, Literal):
        return Literal(expr.value, expr.type, span)
    return replace(rebuilt(expr, lambda part: placed(part, cell)), span=span)


def placed_statement(statement: Statement, cell: Cell) -> Statement:
    """Return the statement of an action cell, a call or an assignment, with spans in the file."""
    span = statement.span
    if not span.file:
        span = tree.absolute(span, cell)
    match statement:
        case Call(procedure=procedure, args=args):
            return Call(procedure, tuple(placed(arg, cell) for arg in args), span)
        case Assign(place=place, value=value):
            return Assign(_place(place, cell), placed(value, cell), span)
        case _:
            return replace(statement, span=span)


def _place(place: Place, cell: Cell) -> Place:
    if isinstance(place, ToElement):
        return ToElement(place.leaves, placed(place.index, cell), place.type)
    return place
