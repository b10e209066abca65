"""What a program is made of, as far as it does something: its written assignments, each of which can be left out, or write anything.

In: a program and its level. Out: its `Use`s, and the program with switches: an input of its own decides in each cycle whether a use does
what is written. Where it does not, it writes any value of the type, another one each time (`How.FREE`: whoever proves something then has
not used what it writes), or nothing (`How.LEFT_OUT`: a slip of the hand).

A *part* is an assignment in a procedure, or a cell of a line; a *use* is a part in one line, or in one procedure that every cycle runs:
two lines that call one procedure use its assignments apart. What the protocol makes is no part: nobody wrote it.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto

from rcsc.base.diagnostics.source import Span
from rcsc.lang.leaves import closure, everything, may_write, rebuilt, written_by
from rcsc.lang.leaves import parts as parts_of
from rcsc.lang.model import (
    Action,
    Admit,
    Among,
    Apply,
    Assign,
    Bool,
    Call,
    Case,
    Default,
    Expr,
    For,
    If,
    Kind,
    Level,
    Line,
    Literal,
    Op,
    Procedure,
    ProcedureName,
    Program,
    Read,
    ReadLocal,
    Scalar,
    Statement,
    Table,
    ToLeaf,
    Value,
    Variable,
    VariableName,
    key_bounds,
    value_of_key,
)


@dataclass(frozen=True, slots=True)
class Part:
    """A written assignment.

    Attributes:
        leaves: What it may write, sorted; more than one where an index decides, or a cell calls what the protocol has.
        procedure: Where it stands; empty for a cell of a line.
        span: Its place; of an order with several fields the same for each of them.
        stays: Whether it assigns a variable what it holds, so that to leave it out is no other program.
    """

    leaves: tuple[str, ...]
    procedure: str
    span: Span
    stays: bool = False


@dataclass(frozen=True, slots=True)
class Use:
    """A part where it is run.

    Attributes:
        table: The table, and `line` its line; without a table, `line` is a procedure that every cycle runs.
    """

    part: Part
    table: str
    line: str


class How(Enum):
    """What a use does that is switched off."""

    FREE = auto()
    LEFT_OUT = auto()


@dataclass(frozen=True, slots=True)
class Switched:
    """A program with switches.

    Attributes:
        switches: The input that decides of each use, true where it does what is written.
        written: What each use writes, by leaf, where that can be said of leaves alone; `under`, the conditions under which it does.
    """

    program: Program
    switches: dict[Use, str]
    written: dict[Use, dict[str, Expr]]
    under: dict[Use, tuple[Expr, ...]]


def uses_of(program: Program, level: Level) -> tuple[Use, ...]:
    """List the uses of all parts that a level runs, in the order in which they run."""
    return tuple(switched(program, level, How.LEFT_OUT).switches)


def switched(
    program: Program, level: Level, how: How, fixed: Callable[[Use], bool | None] = lambda _: None
) -> Switched:
    """Return the program with a switch for each use, but for those of which it is `fixed` whether they do what is written."""
    made = _Switching(program, how, fixed)
    tables = tuple(
        made.table(table) if table.name in level.table_names else table for table in program.tables
    )
    alone = Counter((*level.preprocess, *level.postprocess))
    bodies = {name: made.module(name) for name, times in alone.items() if times == 1}
    kept = (replace(one, body=bodies.get(one.name, one.body)) for one in program.procedures)
    procedures = (*kept, *made.copies)
    variables = (*program.variables, *made.variables)
    return Switched(
        replace(program, tables=tables, procedures=procedures, variables=variables),
        made.switches,
        made.written,
        made.under,
    )


def of_program(program: Program, level: Level, how: How, off: Iterable[Use]) -> Program:
    """Return the program in which these uses do not do what is written."""
    wrong = frozenset(off)
    return switched(program, level, how, lambda use: use not in wrong).program


@dataclass(slots=True)
class _Switching:
    """Puts switches into a program; each call of a procedure runs a copy of its own.

    Attributes:
        shared: Inputs that stand for what lines of the present table write, by type and number; None outside tables.
        taken: How many of them the present line has.
    """

    program: Program
    how: How
    fixed: Callable[[Use], bool | None]
    switches: dict[Use, str] = field(default_factory=dict)
    written: dict[Use, dict[str, Expr]] = field(default_factory=dict)
    under: dict[Use, tuple[Expr, ...]] = field(default_factory=dict)
    variables: list[Variable] = field(default_factory=list)
    copies: list[Procedure] = field(default_factory=list)
    shared: dict[tuple[Scalar, int], str] | None = None
    taken: Counter[Scalar] = field(default_factory=Counter)
    procedures: dict[str, Procedure] = field(init=False)
    kinds: dict[str, Scalar] = field(init=False)

    def __post_init__(self) -> None:
        """Look up procedures and types."""
        self.procedures = {str(one.name): one for one in self.program.procedures}
        self.kinds = self.program.kinds

    # --- where parts stand ---

    def table(self, table: Table) -> Table:
        """Put switches into each line."""
        self.shared = {}
        lines = tuple(replace(line, actions=self._actions(table, line)) for line in table.lines)
        default = table.default
        if default is not None:
            default = replace(default, actions=self._actions(table, default))
        self.shared = None
        return replace(table, lines=lines, default=default)

    def _actions(self, table: Table, line: Line | Default) -> tuple[Action, ...]:
        self.taken.clear()
        where = str(table.name), str(line.name)
        return tuple(replace(one, statement=self._cell(one.statement, where)) for one in line.actions)

    def _cell(self, statement: Statement, where: tuple[str, str]) -> Statement:
        here = _Here(where)
        if isinstance(statement, Call) and self._has_parts(str(statement.procedure)):
            return self._of_call(statement, here)
        if isinstance(statement, Call) and self.procedures[statement.procedure].extern is not None:
            return statement
        return self._part(statement, "", here)

    def _has_parts(self, name: str) -> bool:
        return any(
            isinstance(statement, Assign) and statement.span != procedure.span
            for called in closure([name], self.procedures)
            for procedure in [self.procedures[called]]
            for statement in everything(procedure.body)
        )

    def module(self, name: str) -> tuple[Statement, ...]:
        """Put switches into a procedure that every cycle runs."""
        return self._body(self.procedures[name], _Here(("", name)))

    # --- statements ---

    def _body(self, procedure: Procedure, here: "_Here") -> tuple[Statement, ...]:
        return tuple(self._statements(procedure.body, procedure, here))

    def _statements(self, body: Iterable[Statement], inside: Procedure, here: "_Here") -> Iterator[Statement]:
        for statement in body:
            match statement:
                case Assign() if statement.span != inside.span and written_by(statement):
                    yield self._part(statement, str(inside.name), here)
                case If(condition=condition, then=then, orelse=orelse):
                    yield replace(
                        statement,
                        then=tuple(self._statements(then, inside, here.where(condition))),
                        orelse=tuple(self._statements(orelse, inside, here.where(condition, holds=False))),
                    )
                case Case(subject=subject, arms=arms, orelse=orelse):
                    yield replace(
                        statement,
                        arms=tuple(
                            replace(
                                arm,
                                body=tuple(
                                    self._statements(arm.body, inside, here.where(Among(subject, arm.values)))
                                ),
                            )
                            for arm in arms
                        ),
                        orelse=tuple(self._statements(orelse, inside, here)),
                    )
                case For(low=low, high=high, body=inner):
                    for at in range(low, high + 1):  # what is free is so anew each time
                        again = tuple(self._statements(inner, inside, here))
                        yield replace(statement, low=at, high=at, body=again)
                case Call() if self.procedures[statement.procedure].extern is None:
                    yield self._of_call(statement, here)
                case _:
                    yield statement

    def _of_call(self, call: Call, here: "_Here") -> Call:
        """Call a copy: what is free in it is so anew each time."""
        procedure = self.procedures[call.procedure]
        given = zip((param.name for param in procedure.params), call.args, strict=True)
        body = self._body(procedure, here.called({name: here.said(arg) for name, arg in given}))
        if body == procedure.body:
            return call
        name = ProcedureName(f"{procedure.name} {len(self.copies)}")
        self.copies.append(replace(procedure, name=name, body=body))
        return replace(call, procedure=name)

    def _part(self, statement: Statement, procedure: str, here: "_Here") -> Statement:
        leaves = tuple(sorted(map(str, may_write([statement], self.procedures))))
        if not leaves:
            return statement
        use = Use(Part(leaves, procedure, statement.span, _stays(statement)), *here.place)
        decided = self.fixed(use)
        if decided:
            return statement
        instead = self._any(leaves) if self.how is How.FREE else ()
        if decided is False:
            return If(Literal(value=True, type=Bool()), instead, (), statement.span)
        if use not in self.switches:
            self.switches[use] = self._variable("switch", Bool())
            self.written[use] = dict(self._written(statement, here))
            self.under[use] = tuple(here.under)
        return If(Read(VariableName(self.switches[use]), Bool()), (statement,), instead, statement.span)

    def _written(self, statement: Statement, here: "_Here") -> Iterator[tuple[str, Expr]]:
        """Yield what a statement writes, as far as that can be said of leaves alone."""
        match statement:
            case Assign(place=ToLeaf(name=name), value=value) if (said := here.said(value)) is not None:
                yield str(name), said
            case Call(procedure=name, args=()) if self.procedures[name].extern is None:
                for inner in self.procedures[name].body:
                    yield from self._written(inner, _Here(here.place))

    def _any(self, leaves: Iterable[str]) -> tuple[Statement, ...]:
        kinds = [(VariableName(leaf), self.kinds[leaf]) for leaf in leaves]
        return tuple(
            Assign(ToLeaf(name, kind), Read(VariableName(self._anything(kind)), kind)) for name, kind in kinds
        )

    def _anything(self, kind: Scalar) -> str:
        """Return an input that has any value: of a table's lines, of which one runs, each has the same ones."""
        if self.shared is None:
            return self._variable("anything", kind)
        self.taken[kind] += 1
        key = kind, self.taken[kind]
        if key not in self.shared:
            self.shared[key] = self._variable("anything", kind)
        return self.shared[key]

    def _variable(self, word: str, kind: Scalar) -> str:
        name = f"{word} {len(self.variables)}"
        least: Value = value_of_key(kind, key_bounds(kind)[0])
        self.variables.append(Variable(VariableName(name), Kind.INPUT, kind, least, Admit.CLAMP))
        return name


@dataclass(frozen=True, slots=True)
class _Here:
    """Where a statement stands.

    Attributes:
        place: The table and the line that run it; without a table a procedure.
        bound: The arguments of the procedure around it, in terms of leaves; None for one that cannot be said so.
        under: The conditions under which it runs, as far as they can.
    """

    place: tuple[str, str]
    bound: Mapping[str, Expr | None] = field(default_factory=dict)
    under: tuple[Expr, ...] = ()

    def said(self, expr: Expr) -> Expr | None:
        """Return an expression in terms of leaves; None where it reads a local that is no argument."""
        locals_ = {part.name for part in parts_of(expr) if isinstance(part, ReadLocal)}
        if any(self.bound.get(name) is None for name in locals_):
            return None
        return self._put_in(expr)

    def _put_in(self, expr: Expr) -> Expr:
        if isinstance(expr, ReadLocal):
            put = self.bound[expr.name]
            assert put is not None
            return put
        return rebuilt(expr, self._put_in)

    def where(self, condition: Expr, *, holds: bool = True) -> "_Here":
        """Return the place inside, where the condition holds, or does not."""
        said = self.said(condition)
        if said is None:
            return self
        return replace(self, under=(*self.under, said if holds else Apply(Op.NOT, (said,), Bool())))

    def called(self, bound: Mapping[str, Expr | None]) -> "_Here":
        """Return the place inside a procedure that is called with these arguments."""
        return replace(self, bound=bound)


def _stays(statement: Statement) -> bool:
    """Return whether an assignment writes what it reads."""
    return (
        isinstance(statement, Assign)
        and isinstance(statement.place, ToLeaf)
        and isinstance(statement.value, Read)
        and statement.value.name == statement.place.name
    )
