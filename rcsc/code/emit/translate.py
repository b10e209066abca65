"""Expressions and statements as a tree of code: what both languages share, and Python, whose integers are exact."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import assert_never

from rcsc.code.emit.code_tree import (
    Body,
    Branch,
    Cast,
    Code,
    Constant,
    Do,
    Element,
    Infix,
    Invoke,
    Items,
    Loop,
    MemberPath,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
)
from rcsc.code.emit.identifiers import Names
from rcsc.code.emit.scope import SIGNIFICANT, hashed
from rcsc.lang import model
from rcsc.lang.model import Expr, Int, Op, Real, Scalar, Single, Statement, Value
from rcsc.lang.operator_table import ROUNDED, Operator

STATE, FAULT, FAULT_AT, LINE = (
    Name("s"),
    MemberPath(("fault",)),
    MemberPath(("fault_at",)),
    MemberPath(("line",)),
)
FAULTLESS, FAULTED = infix("==", FAULT, Constant(0)), infix("!=", FAULT, Constant(0))


def constant(kind: Scalar, value: Value) -> Constant:
    """Return a constant in the type in which values of the kind are computed."""
    return Constant(value, {model.Bool: "bool", Real: "double", Single: "float"}.get(type(kind), "int64_t"))


def local(name: str) -> Name:
    """Return the name of a parameter, local or loop variable of a procedure."""
    return Name(local_word(name))


def local_word(name: str) -> str:
    """Spell a parameter, local or loop variable, alike in both languages; names of one procedure differ within 31 characters."""
    return f"v_{name}" if len(name) <= SIGNIFICANT - 2 else f"v_{hashed(name, SIGNIFICANT - 2)}"


@dataclass
class Text(ABC):
    """Makes the code of one program.

    Attributes:
        parameters: Types of each procedure's parameters; without them they are those of the arguments.
    """

    names: Names
    parameters: Mapping[str, tuple[Scalar, ...]] = field(default_factory=dict)

    @abstractmethod
    def place(self, leaf: str) -> MemberPath:
        """Return the place of a leaf in the state."""

    @abstractmethod
    def expr(self, expr: Expr) -> Code:
        """Return the code of an expression."""

    @abstractmethod
    def among(self, subject: Code, kind: Scalar, values: Sequence[Value]) -> Code:
        """Return the condition that the subject is one of the values."""

    @abstractmethod
    def stored(self, kind: Scalar, value: Expr, *, leaf: bool = False) -> Code:
        """Return a value for a leaf or a local of this kind, without -0.0."""

    @abstractmethod
    def assigned(self, place: model.Place, value: Expr) -> Stmt:
        """Return the code of an assignment."""

    @abstractmethod
    def case(self, statement: model.Case) -> Body:
        """Return the code that chooses a block by a value."""

    @abstractmethod
    def function(self, procedure: str) -> str:
        """Return the name of a procedure's function."""

    def block(self, body: Sequence[Statement]) -> Body:
        """Return the code of statements."""
        return tuple(stmt for statement in body for stmt in self.statement(statement))

    def statement(self, statement: Statement) -> Iterator[Stmt]:
        """Yield the code of a statement."""
        match statement:
            case model.Assign(place=place, value=value):
                yield self.assigned(place, value)
            case model.Local(name=name, type=kind, value=value):
                if value is not None:
                    yield Set(local(name), self.stored(kind, value))
            case model.If(condition=condition, then=then, orelse=orelse):
                arm = self.expr(condition), self.block(then)
                yield Branch((arm,), self.block(orelse) if orelse else None)
            case model.Case():
                yield from self.case(statement) if statement.arms else self.block(statement.orelse)
            case model.For(name=name, low=low, high=high, body=body):
                yield Loop(local(name).text, low, high, self.block(body), self.guard(statement))
            case model.Call(procedure=name, args=args):
                yield Do(self.call(name, args))
            case _:
                assert_never(statement)

    def guard(self, _loop: model.For) -> tuple[Code, ...]:
        """Return the conditions under which a loop goes on."""
        return ()

    def call(self, name: str, args: Sequence[Expr] = ()) -> Invoke:
        """Return a call of a procedure."""
        kinds = self.parameters.get(name, tuple(arg.type for arg in args))
        given = (self.stored(kind, arg) for kind, arg in zip(kinds, args, strict=True))
        return Invoke(self.function(name), (STATE, *given))


_INFIX = {
    Op.AND: "and", Op.OR: "or", Op.XOR: "!=", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
}  # fmt: skip


def _many_digits(kind: Int) -> bool:
    """Return whether some number of the type does not fit a double exactly."""
    return max(abs(kind.low), abs(kind.high)) > 1 << 53


@dataclass
class PyText(Text):
    """Python; leaves are attributes of `s`, `/` and `mod` go toward zero as in C."""

    cases: int = 0

    def place(self, leaf: str) -> MemberPath:
        """Return the place of a leaf in the state."""
        return MemberPath((self.names.attributes[leaf],))

    def function(self, procedure: str) -> str:
        """Return the name of a procedure's function."""
        return f"_do_{self.names.procedures[procedure]}"

    def expr(self, expr: Expr) -> Code:
        """Return the code of an expression."""
        match expr:
            case model.Literal(value=value, type=kind):
                code = constant(kind, value)
                return Round(code) if math.copysign(1, value) < 0 else code
            case model.Read(name=name):
                return self.place(name)
            case model.ReadLocal(name=name):
                return local(name)
            case model.Select(leaves=leaves, index=index):
                return Element(Items(tuple(map(self.place, leaves))), self.expr(index))
            case model.Among(subject=subject, values=values):
                return Round(self.among(self.expr(subject), subject.type, values))
            case model.Apply(op=op, args=args):
                result = self._applied(op, tuple(map(self.expr, args)), args[0].type)
                rounds = op in ROUNDED if isinstance(args[0].type, Single) else op is Op.TO_SINGLE
                bare = result.inner if isinstance(result, Round) else result
                return Invoke("_single", (bare,)) if rounds else result
            case _:
                assert_never(expr)

    def among(self, subject: Code, kind: Scalar, values: Sequence[Value]) -> Code:
        """Return the condition that the subject is one of the values."""
        return infix("in", subject, Items(tuple(constant(kind, value) for value in values)))

    @staticmethod
    def _applied(op: Operator, args: tuple[Code, ...], kind: Scalar) -> Code:
        match op:
            case Op.NOT:
                return Round(Prefix("not ", args[0]))
            case Op.NEG:
                return Round(Prefix("-", args[0]))
            case Op.IMPLIES:
                return Round(infix("or", Prefix("not ", args[0]), args[1]))
            case Op.TO_INT:
                return Cast("int", args[0])
            case Op.TO_REAL:
                return args[0] if isinstance(kind, Real) else Cast("float", args[0])
            case Op.TO_SINGLE:
                return Invoke("_odd", args) if isinstance(kind, Int) and _many_digits(kind) else args[0]
            case Op.ABS:
                return Invoke("abs", args)
            case Op.MIN | Op.MAX | Op.MOD:
                return Invoke(f"_{op.value}", args)
            case Op.DIV:
                return Invoke("_div", args) if isinstance(kind, Int) else Round(Infix("/", args))
            case Op.AND | Op.OR | Op.XOR | Op.EQ | Op.NE | Op.LT | Op.LE | Op.GT | Op.GE:
                return Round(Infix(_INFIX[op], args))
            case Op.ADD | Op.SUB | Op.MUL:
                return Round(Infix(op.value, args))
            case _:
                assert_never(op)

    def stored(self, kind: Scalar, value: Expr, *, leaf: bool = False) -> Code:  # noqa: ARG002 - all are alike
        """Return a value to keep."""
        code = self.expr(value)
        return infix("+", code, constant(kind, 0)) if isinstance(kind, Real) else code

    def assigned(self, place: model.Place, value: Expr) -> Stmt:
        """Return the code of an assignment."""
        given = self.stored(place.type, value)
        match place:
            case model.ToLeaf(name=name):
                return Set(self.place(name), given)
            case model.ToElement(leaves=leaves, index=index):
                attributes = Items(tuple(Name(repr(self.names.attributes[leaf])) for leaf in leaves))
                return Do(Invoke("setattr", (STATE, Element(attributes, self.expr(index)), given)))
            case model.ToLocal(name=name):
                return Set(local(name), given)

    def case(self, statement: model.Case) -> Body:
        """Return a chain of `if`."""
        self.cases += 1
        subject = Name(f"case_{self.cases}")
        let = Set(subject, self.expr(statement.subject))
        kind = statement.subject.type
        arms = tuple((self.among(subject, kind, arm.values), self.block(arm.body)) for arm in statement.arms)
        return let, Branch(arms, self.block(statement.orelse) if statement.orelse else None)
