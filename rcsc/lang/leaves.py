"""Walks over expressions and statements: their parts, the same with other parts, and who reads and writes which leaf; free names."""

from collections import defaultdict
from collections.abc import Callable, Collection, Container, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import TypeVar, assert_never

from rcsc.base.diagnostics.source import Span
from rcsc.lang.model import (
    BEFORE,
    WATCHED,
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Default,
    Expr,
    For,
    If,
    Line,
    Literal,
    Local,
    Op,
    Procedure,
    Program,
    Property,
    Read,
    ReadLocal,
    Real,
    Select,
    Statement,
    Table,
    ToElement,
    ToLeaf,
    ToLocal,
    VariableName,
    earlier,
    pending,
)

Node = TypeVar("Node", bound=Hashable)


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


def spoken_of(stated: Property) -> tuple[VariableName, ...]:
    """Return the leaves of the level that a property or requirement reads, each once; those of the cycle before as `earlier`."""
    every = (name for condition in stated.about for name in read_by(condition))
    return tuple(dict.fromkeys(name for name in every if not name.removeprefix(BEFORE).startswith(WATCHED)))


def reads_of(expr: Expr) -> Iterator[tuple[tuple[VariableName, ...], Span]]:
    """Yield the leaves that each part of the expression may read, with the part's place."""
    for part in parts(expr):
        if isinstance(part, Read | Select):
            yield (part.name,) if isinstance(part, Read) else part.leaves, part.span


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


def every_expression(program: Program) -> Iterator[Expr]:
    """Yield the expressions that a program tests, states and calculates."""
    for stated in (program.assumptions, program.invariants):
        yield from (each.condition for each in stated)
    yield from (condition for each in program.stated for condition in each.about)
    for table in program.tables:
        yield from (test.condition for test in table.distinct_tests)
    for statement in every_statement(program):
        yield from expressions(statement)


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


def root_of(leaf: str) -> str:
    """Return the variable that a leaf is a part of."""
    return leaf.partition(".")[0].partition("[")[0]


def is_part(leaf: str, whole: str) -> bool:
    """Return whether the leaf is the variable, or a field or element of it."""
    return leaf == whole or leaf.startswith((f"{whole}.", f"{whole}["))


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


class Uses:
    """Who reads and who writes each leaf of a program, as it says itself: calls count where the procedure is, not for what it does.

    Attributes:
        written, read: By leaf, users (`table NAME`, `procedure NAME`, `level NAME`, `deferral NAME`, `assumption NAME` and the like), and
            of tables the lines.
        requirements: By leaf, those of its users.
    """

    def __init__(self, program: Program) -> None:
        self.written: dict[VariableName, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
        self.read: dict[VariableName, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
        self.requirements: dict[VariableName, dict[str, None]] = defaultdict(dict)
        for procedure in program.procedures:
            self._procedure(procedure)
        for table in program.tables:
            for line in table.every_line:
                self._line(table, line)
        for level in program.levels:
            for selector in level.selectors:
                self._reads(f"level {level.name}", "", selector, ())
        for variable in program.variables:
            if variable.deferred_until is not None:
                name, next_ = f"deferral {variable.name}", (pending(variable.name),)
                self._reads(name, "", variable.deferred_until, ())
                self._note(self.read, name, "", next_, ())
                self._note(self.written, name, "", (variable.name,), ())
        for assumed in program.assumptions:
            self._reads(f"assumption {assumed.name}", "", assumed.condition, assumed.requirements)
        for invariant in program.invariants:
            self._reads(f"invariant {invariant.name}", "", invariant.condition, invariant.requirements)
        for stated in program.stated:
            leaves = (VariableName(leaf.removeprefix(BEFORE)) for leaf in spoken_of(stated))
            self._note(self.read, f"{stated.word} {stated.name}", "", leaves, stated.requirements)

    def _procedure(self, procedure: Procedure) -> None:
        """Note what a procedure itself reads and writes; of an `extern` one, what it is declared to."""
        name = f"procedure {procedure.name}"
        if procedure.extern is not None:
            self._note(self.read, name, "", procedure.reads, procedure.requirements)
            self._note(self.written, name, "", procedure.writes, procedure.requirements)
        self._body(name, "", procedure.body, procedure.requirements)

    def _line(self, table: Table, line: Line | Default) -> None:
        name, answers = f"table {table.name}", line.requirements or table.requirements
        for condition in line.conditions if isinstance(line, Line) else ():
            self._reads(name, line.name, condition, answers)
        self._body(name, line.name, [action.statement for action in line.actions], answers)

    def _body(self, name: str, line: str, body: Iterable[Statement], answers: Sequence[str]) -> None:
        for statement in everything(body):
            self._note(self.written, name, line, written_by(statement), answers)
            for expr in expressions(statement):
                self._reads(name, line, expr, answers)

    def _reads(self, name: str, line: str, expr: Expr, answers: Sequence[str]) -> None:
        leaves = (VariableName(leaf.removeprefix(BEFORE)) for leaf in read_by(expr))
        self._note(self.read, name, line, leaves, answers)

    def _note(
        self, into: Mapping[VariableName, dict[str, list[str]]], name: str, line: str, leaves: Iterable[VariableName],
        answers: Sequence[str],
    ) -> None:  # fmt: skip
        for leaf in dict.fromkeys(leaves):
            lines = into[leaf][name]
            if line and line not in lines:
                lines.append(line)
            self.requirements[leaf].update(dict.fromkeys(answers))


def shortest_circle(edges: Mapping[Node, Collection[Node]]) -> list[Node]:
    """Return a shortest way along the edges from a node back to it, with that node at both ends; empty where there is none.

    >>> shortest_circle({"a": ["b"], "b": ["c", "a"], "c": ["a"]})
    ['a', 'b', 'a']
    """
    return min(filter(None, (_way_back(start, edges) for start in edges)), key=len, default=[])


def _way_back(start: Node, edges: Mapping[Node, Collection[Node]]) -> list[Node]:
    ways, waiting = {start: [start]}, [start]
    for at in waiting:
        for following in edges[at]:
            if following == start:
                return [*ways[at], start]
            if following not in ways:
                ways[following] = [*ways[at], following]
                waiting.append(following)
    return []


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
