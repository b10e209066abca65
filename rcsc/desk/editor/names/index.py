"""Every name that a file declares or uses, with its space and its place.

In: a parsed file. Out: occurrences, in the order of the tree.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import pairwise

from rcsc.base.diagnostics.source import Span
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import Cell


class Space(StrEnum):
    """The kind of thing that a name stands for; names of two spaces never clash."""

    VALUE = "value"  # variables, constants and sets; a use may be of a member or a local, too
    MEMBER = "member"
    TYPE = "type"
    CALL = "call"  # procedures, modules and owners
    TABLE = "table"  # and levels
    CLAIM = "claim"  # assumptions, invariants and properties
    UNIT = "unit"
    LINK = "link"
    PEER = "peer"
    PARTY = "party"  # a level, or who stands outside, in requirements across levels
    FIELD = "field"
    LOCAL = "local"
    LINE = "line"
    FILE = "file"


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An occurrence of a name.

    Attributes:
        owner: The procedure of a local, the table of a line; else empty.
        declares: Whether it is declared here; `node` is then its declaration.
        further: Where it goes on in rows below, where a heading is broken in it.
        party: Of `LEVEL.VARIABLE`, in requirements across levels: whose variable it is.
    """

    space: Space
    text: str
    span: Span
    owner: str = ""
    declares: bool = False
    node: object = field(default=None, compare=False, repr=False)
    further: tuple[Span, ...] = field(default=(), repr=False)
    party: str = ""


def occurrences(file: tree.File, parties: Collection[str] = ()) -> Iterator[Occurrence]:
    """Yield every name of a file.

    Args:
        file: As parsed.
        parties: What it calls the parties of a system, where it states requirements across levels.
    """
    for declaration in file.declarations:
        yield from _Walk(parties).declaration(declaration)


@dataclass(slots=True)
class _Walk:
    """Walks a declaration.

    Attributes:
        cell: The table cell that is being walked: what is in it counts from its start.
        owner: The procedure that is being walked, and its locals.
    """

    parties: Collection[str] = ()
    cell: Cell | None = None
    shift: int = 0
    owner: str = ""
    locals: frozenset[str] = frozenset()

    def at(self, span: Span) -> list[Span]:
        """Return the places in the file: a name broken in a heading has one a row."""
        if span.file or self.cell is None:
            return [span]
        start, end = span.start + self.shift, span.end + self.shift
        cuts = [start, *(offset for offset, _ in self.cell.further if start < offset < end), end]
        return [self.cell.at(*cut) for cut in pairwise(cuts)]

    def name(self, space: Space, name: tree.Name, node: object = None, owner: str = "") -> Occurrence:
        """Return one occurrence; a declaration if it has a node."""
        span, *further = self.at(name.span)
        return Occurrence(space, name.text, span, owner, node is not None, node, tuple(further))

    # --- declarations ---

    def declaration(self, node: tree.Declaration) -> Iterator[Occurrence]:
        """Yield the names of a declaration."""
        match node:
            case tree.Use(path):
                yield Occurrence(Space.FILE, path, node.span)
            case tree.VariableDecl():
                yield self.name(Space.VALUE, node.name, node)
                yield from self.type(node.type)
                yield from self.exprs((node.initial, node.safe, node.restart, node.deferred_until))
            case tree.AssumeDecl(name, condition) | tree.InvariantDecl(name, condition):
                yield self.name(Space.CLAIM, name, node)
                yield from self.expr(condition)
            case tree.PropertyDecl(name, condition):
                yield self.name(Space.CLAIM, name, node)
                yield from self.exprs((condition, node.other))
            case tree.RequirementDecl(name):
                yield self.name(Space.CLAIM, name, node)
                yield from self.exprs(
                    (node.mode, node.end, node.condition, node.stop, node.times, node.response)
                )
                yield from self.exprs(() if node.time is None else (node.time.value,))
            case tree.ProcedureDecl():
                yield from self.procedure(node)
            case tree.OwnerDecl(name, members):
                yield self.name(Space.CALL, name, node)
                yield from (self.name(Space.CALL, member) for member in members)
            case tree.TableDecl():
                yield from self.table(node)
            case tree.LevelDecl():
                yield from self.level(node)
            case tree.LinkDecl() | tree.ServesDecl() | tree.CommandsDecl() | tree.AdoptDecl():
                yield from self.protocol(node)
            case _:
                yield from self.types(node)

    def types(
        self,
        node: tree.UnitDecl | tree.ConstDecl | tree.SetDecl | tree.EnumDecl | tree.TypeDecl | tree.RecordDecl,
    ) -> Iterator[Occurrence]:
        """Yield the names of type declarations, and of values that are fixed when they are written."""
        match node:
            case tree.UnitDecl(name):
                yield self.name(Space.UNIT, name, node)
            case tree.ConstDecl(name, value):
                yield self.name(Space.VALUE, name, node)
                yield from self.expr(value)
            case tree.SetDecl(name, kind, members):
                yield self.name(Space.VALUE, name, node)
                yield from self.type(kind)
                yield from self.members(members)
            case tree.EnumDecl(name, words):
                yield self.name(Space.TYPE, name, node)
                yield from (self.name(Space.MEMBER, word, node) for word in words)
            case tree.TypeDecl(name, kind):
                yield self.name(Space.TYPE, name, node)
                yield from self.type(kind)
            case tree.RecordDecl(name, fields):
                yield self.name(Space.TYPE, name, node)
                yield from self.fields(fields)

    def fields(self, fields: Iterable[tree.FieldDecl]) -> Iterator[Occurrence]:
        """Yield the names in the fields of a record, or of a link."""
        for part in fields:
            yield self.name(Space.FIELD, part.name, part)
            yield from self.type(part.type)
            yield from self.exprs((part.initial, part.safe))
            if isinstance(part, tree.LinkField):
                yield from self.exprs((part.restart,))

    def protocol(
        self, node: tree.LinkDecl | tree.ServesDecl | tree.CommandsDecl | tree.AdoptDecl
    ) -> Iterator[Occurrence]:
        """Yield the names in declarations of the protocol with neighbours."""
        match node:
            case tree.LinkDecl():
                yield self.name(Space.LINK, node.name, node)
                yield from (self.name(Space.TYPE, name) for name in (node.command, node.status))
                words = (node.rest, node.done, node.failed, node.executing)
                yield from (self.name(Space.MEMBER, name) for name in words)
                yield from self.fields((*node.order, *node.report))
            case tree.ServesDecl(peer, link, without):
                yield self.name(Space.PEER, peer, node)
                yield self.name(Space.LINK, link)
                yield from (self.name(Space.CLAIM, name) for name in without)
            case tree.CommandsDecl(peer, link):
                yield self.name(Space.PEER, peer, node)
                yield self.name(Space.LINK, link)
                yield from self.exprs((node.within, node.answered))
                reasons = (node.late, node.unanswered)
                yield from (self.name(Space.MEMBER, name) for name in reasons if name is not None)
            case tree.AdoptDecl(place, value):
                yield from self.exprs((place, value))

    def procedure(self, node: tree.ProcedureDecl) -> Iterator[Occurrence]:
        """Yield the names of a procedure, its locals as its own."""
        yield self.name(Space.CALL, node.name, node)
        self.owner = node.name.text
        self.locals = frozenset((*(each.name.text for each in node.params), *_locals(node.body)))
        for parameter in node.params:
            yield self.name(Space.LOCAL, parameter.name, parameter, self.owner)
            yield from self.type(parameter.type)
        yield from self.exprs((*node.reads, *node.writes))
        yield from self.body(node.body)

    def level(self, node: tree.LevelDecl) -> Iterator[Occurrence]:
        """Yield the names of a level."""
        yield self.name(Space.TABLE, node.name, node)
        yield from self.exprs((node.period,))
        yield from (self.name(Space.CALL, name) for name in (*node.preprocess, *node.postprocess))
        for clause in node.tables:
            if clause.table is not None:
                yield self.name(Space.TABLE, clause.table)
            yield from self.exprs((clause.selector,))
            for dispatch in clause.dispatch:
                yield from self.expr(dispatch.value)
                yield self.name(Space.TABLE, dispatch.table)

    # --- tables ---

    def table(self, node: tree.TableDecl) -> Iterator[Occurrence]:
        """Yield the names of a table: its headings, its lines, their cells."""
        yield self.name(Space.TABLE, node.name, node)
        yield from (self.name(Space.CLAIM, name) for name in node.assuming)
        if node.turned is not None:
            yield from self.turned(node.name.text, node.turned)
            return
        for heading in (*node.conditions, *node.actions):
            yield from self.inside(heading.cell, self.exprs((heading.subject,)))
        for row in node.rows:
            yield from self.row(node.name.text, row, [heading.word for heading in node.actions])

    def turned(self, owner: str, turned: tree.Turned) -> Iterator[Occurrence]:
        """Yield the names of a table as it is printed, each where it stands; of rows and columns those that are given."""
        for heading in (*turned.conditions, turned.giving, *(() if turned.by is None else (turned.by,))):
            yield from self.inside(heading.cell, self.exprs((heading.subject,)))
        word = turned.giving.word
        for across in turned.across:
            own = across.given and across.cell.start != across.place.start  # else its name is what it says
            yield from self.marked(across, owner, across.place if own else None)
            if isinstance(across.said, tuple):
                yield from self.action(across.said, across.cell, word)
            else:
                yield from self.inside(across.cell, self.condition(across.said))
        for row in turned.rows:
            words = ("procedures" if turned.by is None and not row.default else word,) * len(row.actions)
            yield from self.row(owner, row, words, named=turned.named)

    def marked(self, line: tree.Row | tree.Across, owner: str, place: Cell | None) -> Iterator[Occurrence]:
        """Yield a line's name, where it has a place, and those of others that its marks name."""
        if place is not None:
            span = place.at(0, len(line.name))
            yield Occurrence(Space.LINE, line.name, span, owner, True, line)
        yield from (self.name(Space.LINE, name, None, owner) for name in (*line.above, *line.same))

    def row(
        self, owner: str, row: tree.Row, words: Sequence[str], *, named: bool = True
    ) -> Iterator[Occurrence]:
        """Yield the names of a line."""
        yield from self.marked(row, owner, row.cells[0] if named else None)
        tests = zip(row.conditions, row.cells[1:], strict=False)
        for test, cell in tests:
            if test is not None:
                yield from self.inside(cell, self.condition(test))
        does = zip(row.actions, row.cells[1 + len(row.conditions) :], words, strict=False)
        for action, cell, word in does:
            yield from self.action(action, cell, word)

    def action(
        self, action: tuple[tree.Statement, ...] | tree.Comparison, cell: Cell, word: str
    ) -> Iterator[Occurrence]:
        """Yield the names of a cell of values, or of actions below a word."""
        if isinstance(action, tree.Comparison):
            yield from self.inside(cell, self.joined(action.value, list(action.places)))
        else:
            yield from self.inside(cell, self.body(action, orders=word != "procedures"))

    def inside(self, cell: Cell, found: Iterator[Occurrence]) -> Iterator[Occurrence]:
        """Yield names found in a cell, at their place in the file."""
        self.cell = cell
        yield from found
        self.cell = None

    def condition(self, test: tree.Condition) -> Iterator[Occurrence]:
        """Yield the names of a cell of conditions."""
        match test:
            case tree.Comparison(_, value):
                yield from self.joined(value, list(test.places))
            case tree.OneOf(members):
                yield from self.members(members)
            case tree.Between(low, high):
                yield from self.exprs((low, high))
            case tree.Lasting(condition, time):
                yield from self.condition(condition)
                yield from self.expr(time.value)
            case tree.Happens(_, operand, guard):
                yield from () if operand is None else self.condition(operand)
                yield from () if guard is None else self.expr(guard)

    def joined(self, value: tree.Expr, places: list[tuple[int, int]]) -> Iterator[Occurrence]:
        """Yield the names of conditions joined by `and`: each was parsed by itself where there are places."""
        if len(places) < 2 or not isinstance(value, tree.Binary):
            self.shift = places[0][0] if places else 0
            yield from self.expr(value)
            self.shift = 0
            return
        yield from self.joined(value.left, places[:-1])
        yield from self.joined(value.right, places[-1:])

    # --- statements ---

    def body(self, body: Sequence[tree.Statement], *, orders: bool = False) -> Iterator[Occurrence]:
        """Yield the names of statements; in orders, an apparent call is a command."""
        for statement in body:
            match statement:
                case tree.Assign(place, value):
                    yield from self.exprs((place, value))
                case tree.Local(name, kind, value):
                    yield self.name(Space.LOCAL, name, statement, self.owner)
                    yield from self.type(kind)
                    yield from self.exprs((value,))
                case tree.If(condition, then, orelse):
                    yield from self.expr(condition)
                    yield from self.body((*then, *orelse))
                case tree.Case(subject, arms, orelse):
                    yield from self.expr(subject)
                    for arm in arms:
                        yield from self.exprs(arm.values)
                        yield from self.body(arm.body)
                    yield from self.body(orelse or ())
                case tree.For(name, low, high, inner):
                    yield self.name(Space.LOCAL, name, statement, self.owner)
                    yield from self.exprs((low, high))
                    yield from self.body(inner)
                case tree.Call(name, args):
                    yield self.name(Space.MEMBER if orders else Space.CALL, name)
                    yield from self.exprs(args)

    # --- expressions and types ---

    def exprs(self, exprs: Iterable[tree.Expr | None]) -> Iterator[Occurrence]:
        """Yield the names of several expressions."""
        for expr in exprs:
            if expr is not None:
                yield from self.expr(expr)

    def members(self, members: Iterable[tree.Member]) -> Iterator[Occurrence]:
        """Yield the names of the members of a set."""
        for member in members:
            match member:
                case tree.Range(low, high):
                    yield from self.exprs((low, high))
                case tree.NamedSet(name):
                    yield self.name(Space.VALUE, name)
                case _:
                    yield from self.expr(member)

    def expr(self, expr: tree.Expr) -> Iterator[Occurrence]:
        """Yield the names of an expression."""
        match expr:
            case tree.Reference(name) if name.text in self.parties:
                yield self.name(Space.PARTY, name)
            case tree.FieldOf(tree.Reference(party), name) if party.text in self.parties:
                yield self.name(Space.PARTY, party)
                yield replace(self.name(Space.VALUE, name), party=party.text)
            case tree.Reference(name):
                own = name.text in self.locals
                yield self.name(Space.LOCAL if own else Space.VALUE, name, None, self.owner if own else "")
            case tree.FieldOf(base, name):
                yield from self.expr(base)
                yield self.name(Space.FIELD, name)
            case tree.Order(command, fields):
                yield self.name(Space.MEMBER, command)
                for part in fields:
                    yield self.name(Space.FIELD, part.name)
                    yield from self.expr(part.value)
            case tree.InSet(subject, members):
                yield from self.expr(subject)
                yield from self.members(members)
            case tree.IntLiteral(unit=unit) | tree.RealLiteral(unit=unit):
                yield from self.unit(unit)
            case _:
                yield from self.exprs(_operands(expr))

    def unit(self, unit: tree.Unit | None) -> Iterator[Occurrence]:
        """Yield the names of a unit."""
        if unit is not None:
            yield from (self.name(Space.UNIT, factor.name) for factor in unit.factors)

    def type(self, kind: tree.TypeExpr) -> Iterator[Occurrence]:
        """Yield the names of a type."""
        match kind:
            case tree.NamedType(name):
                yield self.name(Space.TYPE, name)
            case tree.ArrayType(length, element):
                yield from self.expr(length)
                yield from self.type(element)
            case (
                tree.IntType(low, high, unit)
                | tree.RealType(low, high, unit)
                | tree.SingleType(low, high, unit)
            ):
                yield from self.exprs((low, high))
                yield from self.unit(unit)
            case tree.BoolType():
                pass


def _operands(expr: tree.Expr) -> tuple[tree.Expr | None, ...]:
    """Return the operands of an expression that has no names of its own."""
    match expr:
        case tree.IndexOf(first, second) | tree.Binary(_, first, second):
            return first, second
        case tree.Since(first, second) | tree.Lasts(first, tree.Time(second)):
            return first, second
        case tree.BitsOf(first, second, third) | tree.InRange(first, second, third):
            return first, second, third
        case tree.Unary(_, operand) | tree.Was(operand) | tree.Once(operand):
            return (operand,)
        case tree.Event(_, operand, guard):
            return operand, guard
        case tree.Apply(_, args):
            return args
        case _:
            return ()


def _locals(body: Iterable[tree.Statement]) -> Iterator[str]:
    """Yield the names that statements declare."""
    for statement in tree.inside(body):
        if isinstance(statement, tree.Local | tree.For):
            yield statement.name.text
