"""A level's cycle as one list of statements: calls inlined, loops unrolled, elements named.

In: a program. Out: statements over *qualified* names (`level:leaf`). This is a translation of its own: nothing here is shared with
`compose.contract.transition` or `symbolic.execution`, so that an error there is not made here again. Sources: `interpret`, which is the
meaning.

A variable of `lazy` has no value until it is read; then it gets any of its domain, and keeps it until it is forgotten.
Reals are not computed: what an arithmetic expression gives is such a variable, one an expression of the source, so that the nine
coordinates of one loop share one. `a - b > 0.0` stands for `a > b` where one of them is computed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from rcsc.lang.interpret import evaluate
from rcsc.lang.leaves import everything
from rcsc.lang.model import (
    COMPARISONS,
    Among,
    Apply,
    Assign,
    Bool,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Literal,
    Local,
    Op,
    Place,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    ToLocal,
    VariableName,
)

FAR = 1e9
"""Bounds of what arithmetic on reals may give, as far as a small instance needs any."""
BOOL = Bool()
YES, NO = Literal(value=True, type=BOOL), Literal(value=False, type=BOOL)


@dataclass(frozen=True, slots=True)
class Put:
    """`name` gets the value."""

    name: str
    value: Expr


@dataclass(frozen=True, slots=True)
class Fork:
    """The first arm whose condition holds, else `otherwise`."""

    arms: "tuple[tuple[Expr, Block], ...]"
    otherwise: "Block" = ()


@dataclass(frozen=True, slots=True)
class Check:
    """Obligation number `obligation` is broken where the condition does not hold.

    Attributes:
        apart: The names that it compares are to have values to differ by, where they would have only one.
    """

    obligation: int
    holds: Expr
    apart: bool = False


@dataclass(frozen=True, slots=True)
class Forget:
    """These have no value any more."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Match:
    """`many` becomes how many of the conditions hold, `line` the number of the first that does, from 1; 0 where none does."""

    conditions: tuple[Expr, ...]
    line: str
    many: str


@dataclass(frozen=True, slots=True)
class Tell:
    """The end of a cycle, for a trail: the names say which table and line ran."""

    table: str
    line: str


Flat: TypeAlias = Put | Fork | Check | Forget | Match | Tell
Block: TypeAlias = tuple[Flat, ...]
Known: TypeAlias = Mapping[str, Expr]
"""What the parameters and loop variables of a procedure stand for, where that is constant."""


def read(name: str, kind: Scalar) -> Read:
    """A qualified name as an expression."""
    return Read(VariableName(name), kind)


def both(*terms: Expr) -> Expr:
    """All of them hold."""
    found: Expr = YES
    for term in terms:
        if term != YES:
            found = term if found == YES else Apply(Op.AND, (found, term), BOOL)
    return found


def either(one: Expr, other: Expr) -> Expr:
    """At least one holds."""
    return Apply(Op.OR, (one, other), BOOL)


def negation(one: Expr) -> Expr:
    """It does not hold."""
    return Apply(Op.NOT, (one,), BOOL)


def same(one: Expr, other: Expr) -> Expr:
    """They are equal."""
    return Apply(Op.EQ, (one, other), BOOL)


@dataclass(slots=True)
class Flattener:
    """Flattens one level's program.

    Attributes:
        kinds: Type of each qualified name, grown as names are made.
        starts: Value before the first cycle.
        lazy: Names that get any value when they are read.
    """

    level: str
    program: Program
    kinds: dict[str, Scalar] = field(default_factory=dict)
    starts: dict[str, int | float | bool] = field(default_factory=dict)
    lazy: set[str] = field(default_factory=set)
    _procedures: dict[str, Procedure] = field(init=False)
    _unknown: dict[tuple[str, Expr], str] = field(default_factory=dict)
    _chosen: int = 0

    def __post_init__(self) -> None:
        self._procedures = {str(one.name): one for one in self.program.procedures}
        for variable in self.program.variables:
            self.kinds[self.name(variable.name)] = variable.type
            self.starts[self.name(variable.name)] = variable.initial

    def name(self, leaf: str) -> str:
        """The qualified name."""
        return f"{self.level}:{leaf}"

    def new(self, name: str, kind: Scalar, start: float = 0, *, lazy: bool = False) -> Read:
        """A name that is no leaf of the program."""
        qualified = self.name(name)
        self.kinds[qualified] = kind
        self.starts.setdefault(qualified, start)
        if lazy:
            self.lazy.add(qualified)
        return read(qualified, kind)

    def old(self, leaf: str) -> Read:
        """A leaf as it was before the cycle."""
        return self.new(f"{leaf} before", self.leaf(leaf).type)

    def leaf(self, name: str) -> Read:
        """A leaf as an expression."""
        return read(self.name(name), self.kinds[self.name(name)])

    def condition(self, expr: Expr, phase: str) -> tuple[Block, Expr]:
        """A condition of a table, an assumption or a deferral, and what is to run before it."""
        before: list[Flat] = []
        when = self._expr(expr, {}, phase, before)
        return tuple(before), when

    def run(self, procedure: str) -> Block:
        """A call without arguments."""
        return self.action(Call(self._procedures[procedure].name))

    def action(self, statement: Statement) -> Block:
        """A statement that stands outside every procedure."""
        return tuple(self._block((statement,), {}, "table"))

    @property
    def guessed(self) -> frozenset[str]:
        """The names of what arithmetic on reals gives."""
        return frozenset(map(self.name, self._unknown.values()))

    # --- statements ---

    def _block(self, body: Iterable[Statement], known: Known, phase: str) -> list[Flat]:
        found: list[Flat] = []
        for statement in body:
            found += self._statement(statement, known, phase)
        return found

    def _statement(self, statement: Statement, known: Known, phase: str) -> list[Flat]:
        before: list[Flat] = []
        match statement:
            case Assign(place=place, value=value):
                given = self._expr(value, known, phase, before)
                return before + self._assign(place, given, known, phase)
            case Local(name=name, type=kind, value=value):
                if value is None:
                    return []
                given = self._expr(value, known, phase, before)
                return [*before, Put(self._local(phase, name, kind), given)]
            case If(condition=condition, then=then, orelse=orelse):
                when = self._expr(condition, known, phase, before)
                arms = [(when, then)]
                return before + self._fork(arms, orelse, known, phase)
            case Case(subject=subject, arms=ways, orelse=orelse):
                given = self._expr(subject, known, phase, before)
                arms = [(Among(given, arm.values), arm.body) for arm in ways]
                return before + self._fork(arms, orelse, known, phase)
            case For(name=name, low=low, high=high, body=body):
                for count in range(low, high + 1):
                    stands = {**known, name: Literal(count, Int(low, high))}
                    before += self._block(body, stands, phase)
                return before
            case Call(procedure=name, args=args):
                given_args = [self._expr(arg, known, phase, before) for arg in args]
                return before + self._call(self._procedures[name], given_args)

    def _fork(
        self,
        arms: Iterable[tuple[Expr, Iterable[Statement]]],
        orelse: Iterable[Statement],
        known: Known,
        phase: str,
    ) -> list[Flat]:
        left = []
        for when, body in arms:
            constant = folded(when)
            if isinstance(constant, Literal):
                if constant.value:
                    orelse = body
                    break
            else:
                left.append((constant, tuple(self._block(body, known, phase))))
        otherwise = self._block(orelse, known, phase)
        return [Fork(tuple(left), tuple(otherwise))] if left else otherwise

    def _assign(self, place: Place, value: Expr, known: Known, phase: str) -> list[Flat]:
        match place:
            case ToLeaf(name=name):
                return [Put(self.name(name), value)]
            case ToLocal(name=name, type=kind):
                return [Put(self._local(phase, name, kind), value)]
            case ToElement(leaves=leaves, index=index, type=kind):
                before: list[Flat] = []
                at = self._expr(index, known, phase, before)
                if isinstance(at, Literal):
                    return [*before, Put(self.name(leaves[int(at.value)]), value)]
                given = self._temporary(kind)
                arms = tuple(
                    (same(at, Literal(i, at.type)), (Put(self.name(leaf), given),))
                    for i, leaf in enumerate(leaves)
                )
                return [*before, Put(str(given.name), value), Fork(arms)]

    def _call(self, procedure: Procedure, args: list[Expr]) -> list[Flat]:
        if procedure.extern is not None:
            written = tuple(self.name(one) for one in procedure.writes)
            self.lazy.update(written)
            return [Forget(written)]
        phase = str(procedure.name)
        assigned = {
            one.place.name
            for one in everything(procedure.body)
            if isinstance(one, Assign) and isinstance(one.place, ToLocal)
        }
        known: dict[str, Expr] = {}
        before: list[Flat] = []
        for param, arg in zip(procedure.params, args, strict=True):
            if isinstance(arg, Literal) and param.name not in assigned:
                known[param.name] = Literal(arg.value, param.type)
            else:
                before.append(Put(self._local(phase, param.name, param.type), arg))
        return before + self._block(procedure.body, known, phase)

    def _local(self, phase: str, name: str, kind: Scalar) -> str:
        return str(self.new(f"{phase}/{name}", kind).name)

    def _temporary(self, kind: Scalar) -> Read:
        self._chosen += 1
        return self.new(f"chosen {self._chosen}", kind)

    # --- expressions ---

    def _expr(self, expr: Expr, known: Known, phase: str, before: list[Flat]) -> Expr:
        match expr:
            case Literal():
                return expr
            case Read(name=name, type=kind):
                return read(self.name(name), kind)
            case ReadLocal(name=name, type=kind):
                return known[name] if name in known else read(self._local(phase, name, kind), kind)
            case Select():
                return self._select(expr, known, phase, before)
            case Among(subject=subject, values=values):
                if _computed(subject):
                    return Among(self._guess(subject, phase, subject.type), values)
                return folded(Among(self._expr(subject, known, phase, before), values))
            case Apply(op=op, args=args) if op in COMPARISONS and isinstance(args[0].type, Real):
                return self._real(expr, known, phase, before)
            case Apply():
                if isinstance(constant := folded(expr), Literal):
                    return constant
                if _computed(expr):
                    return self._guess(expr, phase, expr.type)
                args = tuple(self._expr(arg, known, phase, before) for arg in expr.args)
                return folded(Apply(expr.op, args, expr.type))

    def _select(self, expr: Select, known: Known, phase: str, before: list[Flat]) -> Expr:
        at = self._expr(expr.index, known, phase, before)
        if isinstance(at, Literal):
            return read(self.name(expr.leaves[int(at.value)]), expr.type)
        given = self._temporary(expr.type)
        arms = tuple(
            (same(at, Literal(i, at.type)), (Put(str(given.name), read(self.name(leaf), expr.type)),))
            for i, leaf in enumerate(expr.leaves)
        )
        before.append(Fork(arms))
        return given

    def _real(self, expr: Apply, known: Known, phase: str, before: list[Flat]) -> Expr:
        """A comparison of reals: as it is where both sides are kept, else of what is guessed."""
        one, other = expr.args
        if not _computed(one) and not _computed(other):
            args = tuple(self._expr(arg, known, phase, before) for arg in expr.args)
            return Apply(expr.op, args, BOOL)
        if isinstance(other, Literal):
            return Apply(expr.op, (self._guess(one, phase, one.type), other), BOOL)
        if isinstance(one, Literal):
            return Apply(expr.op, (one, self._guess(other, phase, other.type)), BOOL)
        wide = Real(-FAR, FAR)
        apart = self._guess(Apply(Op.SUB, (one, other), wide), phase, wide)
        return Apply(expr.op, (apart, Literal(0.0, wide)), BOOL)

    def _guess(self, expr: Expr, phase: str, kind: Scalar) -> Read:
        key = phase, expr
        if key not in self._unknown:
            self._unknown[key] = f"computed {len(self._unknown) + 1} in {phase}"
        return self.new(self._unknown[key], kind, lazy=True)


def _computed(expr: Expr) -> bool:
    """Whether it computes with reals."""
    match expr:
        case Apply(op=Op.TO_INT):
            return True
        case Apply(op=op, args=args, type=kind):
            return isinstance(kind, Real) or (op not in COMPARISONS and any(map(_computed, args)))
        case _:
            return False


def folded(expr: Expr) -> Expr:
    """The constant that it is, if it is one; `and` and `or` without constants."""
    match expr:
        case Apply(op=Op.AND | Op.OR as op, args=(one, other)):
            for this, that in ((one, other), (other, one)):
                if isinstance(this, Literal):
                    return that if bool(this.value) == (op is Op.AND) else this
            return expr
        case Apply(args=args, type=kind) if all(isinstance(arg, Literal) for arg in args):
            return Literal(evaluate(expr, {}), kind)
        case Among(subject=Literal(value=value), values=values):
            return Literal(value in values, BOOL)
        case _:
            return expr
