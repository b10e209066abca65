"""Questions to a log: `task.cur_state = state_3 and primitive.travelled_mm > 40`.

In: a text, and the levels that it may name. Out: a predicate over the levels' values. `=` and `/=` are read as in tables, `==`
and `!=` too. The text is parsed as Python is, and only comparisons, `and`, `or`, `not`, leaves, numbers, texts and members of
enumerations are let through; nothing is ever evaluated but these.
"""

import ast
import difflib
import keyword
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rcsc.run.log.read import Log
from rcsc.run.log.states import LogColumn, columns
from rcsc.run.signature import Value, Values

Moment = Mapping[str, Values]
"""The values of each level at a tick."""
Predicate = Callable[[Moment], bool]
Term = Callable[[Moment], Value | str]

_COMPARE: Mapping[type[ast.cmpop], Callable[[Value | str, Value | str], bool]] = {
    ast.Eq: operator.eq, ast.NotEq: operator.ne, ast.Lt: operator.lt,
    ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip
_EQUALITY = (ast.Eq, ast.NotEq)
_BOOLS = {"true": True, "false": False, "True": True, "False": False}
_KEYWORD, _MARK = re.compile(r"(?<=\.)[A-Za-z_]\w*"), "__keyword"
_AS_IN_TABLES = re.compile(r"""(?P<text>"[^"]*"|'[^']*')|(?P<equal>(?<![=!<>/])=(?!=))|(?P<other>/=)""")


class BadExpression(Exception):  # noqa: N818  # what happened, not an error of ours
    """A question that cannot be asked of this log; says why."""


@dataclass(frozen=True, slots=True)
class _Operand:
    """One side of a comparison: a column, a constant, or a name that the other side must know.

    Attributes:
        kind: `text`, `number` or `bool`.
    """

    term: Term
    kind: str
    text: str
    members: tuple[str, ...] = ()
    bare: bool = False


def predicate(text: str, log: Log) -> Predicate:
    """Return what the text asks.

    Raises:
        BadExpression: It is no question, or names what the log does not have.
    """
    spelled = _AS_IN_TABLES.sub(
        lambda match: match[0] if match["text"] else "==" if match["equal"] else "!=", text
    )
    marked = _KEYWORD.sub(lambda match: match[0] + _MARK * keyword.iskeyword(match[0]), spelled)
    try:
        parsed = ast.parse(marked.strip(), mode="eval").body
        return _Building(named_columns(log)).predicate(parsed)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise BadExpression(
            f"`{text[:200]}` cannot be read: write such as `level.leaf = value and ...`"
        ) from error


def named_columns(log: Log) -> dict[str, tuple[str, LogColumn]]:
    """Every column of a log by `level.name`, with its level."""
    return {
        f"{level.name}.{column.name}": (level.name, column)
        for level in log.levels
        for column in columns(level.sign, level.level)
    }


def nearest(name: str, known: Mapping[str, object]) -> str:
    """`there is no ...`, with the names that are like it."""
    near = difflib.get_close_matches(name, known, 3)
    return f"there is no `{name}` in this log" + (f"; near it: {', '.join(near)}" if near else "")


class _Building:
    """Predicates from syntax."""

    def __init__(self, known: Mapping[str, tuple[str, LogColumn]]) -> None:
        self._known = known

    def predicate(self, node: ast.expr) -> Predicate:
        """What a node asks.

        Raises:
            BadExpression: It asks more than may be asked.
        """
        match node:
            case ast.BoolOp(op=ast.And(), values=parts):
                every = [self.predicate(part) for part in parts]
                return lambda moment: all(part(moment) for part in every)
            case ast.BoolOp(values=parts):
                some = [self.predicate(part) for part in parts]
                return lambda moment: any(part(moment) for part in some)
            case ast.UnaryOp(op=ast.Not(), operand=inner):
                negated = self.predicate(inner)
                return lambda moment: not negated(moment)
            case ast.Compare(left=left, ops=ops, comparators=rest):
                return self._comparison([left, *rest], ops)
        operand = self._operand(node)
        if operand.kind != "bool":
            raise BadExpression(f"`{operand.text}` is neither true nor false: compare it with something")
        return lambda moment: bool(operand.term(moment))

    def _comparison(self, nodes: list[ast.expr], ops: list[ast.cmpop]) -> Predicate:
        sides = [self._operand(node) for node in nodes]
        parts = [_compared(a, op, b) for a, op, b in zip(sides, ops, sides[1:], strict=False)]
        return lambda moment: all(part(moment) for part in parts)

    def _operand(self, node: ast.expr) -> _Operand:
        match node:
            case ast.Constant(value=bool() as value):
                return _Operand(lambda _: value, "bool", str(value))
            case ast.Constant(value=int() | float() as number):
                return _Operand(lambda _: number, "number", str(number))
            case ast.Constant(value=str() as text):
                return _Operand(lambda _: text, "text", text, bare=True)
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
                return _Operand(lambda _: -number, "number", f"-{number}")
            case ast.Name(id=name) if name in _BOOLS:
                return _Operand(lambda _: _BOOLS[name], "bool", name)
            case ast.Name(id=name):
                return _Operand(lambda _: name, "text", name, bare=True)
            case ast.Attribute() | ast.Subscript():
                return self._leaf(_dotted(node))
        raise BadExpression(f"`{ast.unparse(node)}` is more than a question may hold")

    def _leaf(self, name: str) -> _Operand:
        if name not in self._known:
            raise BadExpression(nearest(name, self._known))
        level, column = self._known[name]
        kind = "bool" if column.c_type == "bool" else "number" if column.c_type else "text"
        return _Operand(lambda moment: column.read(moment[level]), kind, name, column.members)


def _compared(left: _Operand, op: ast.cmpop, right: _Operand) -> Predicate:
    if type(op) not in _COMPARE:
        raise BadExpression("only =, /=, <, <=, > and >= compare")
    if left.kind != right.kind:
        raise BadExpression(
            f"`{left.text}` and `{right.text}` cannot be compared: {left.kind} and {right.kind}"
        )
    if left.kind != "number" and not isinstance(op, _EQUALITY):
        raise BadExpression(f"`{left.text}` and `{right.text}` have no order: use = or /=")
    for operand, other in ((left, right), (right, left)):
        if operand.bare and other.members and operand.text not in other.members:
            raise BadExpression(
                f"`{other.text}` is never `{operand.text}`: it is one of {', '.join(filter(None, other.members))}"
            )
        if operand.bare and other.bare:
            raise BadExpression(f"`{operand.text}` is no leaf: write `level.leaf`")
    compare = _COMPARE[type(op)]
    return lambda moment: compare(left.term(moment), right.term(moment))


def _dotted(node: ast.expr) -> str:
    """`level.a.b[0]` as it was written."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=inner, attr=name):
            return f"{_dotted(inner)}.{name.removesuffix(_MARK)}"
        case ast.Subscript(value=inner, slice=ast.Constant(value=int() as at)):
            return f"{_dotted(inner)}[{at}]"
    raise BadExpression(f"`{ast.unparse(node)}` is no leaf: write `level.leaf`")
