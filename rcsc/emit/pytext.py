"""Expressions and statements in Python; integers are exact, `/` and `mod` go toward zero as in C."""

from collections.abc import Iterator
from dataclasses import dataclass, field

from rcsc.emit.identifiers import Names
from rcsc.lang.model import (
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
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    Value,
)

_INFIX = {
    Op.AND: "and", Op.OR: "or", Op.XOR: "!=", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*",
}  # fmt: skip


def constant(kind: Scalar, value: Value) -> str:
    """A constant."""
    if isinstance(kind, Bool):
        return "True" if value else "False"
    return repr(float(value)) if isinstance(kind, Real) else str(int(value))


@dataclass(slots=True)
class PyText:
    """Spells for one program; leaves are attributes of `s`."""

    names: Names
    _cases: list[int] = field(default_factory=lambda: [0])

    def place(self, leaf: str) -> str:
        """A leaf."""
        return f"s.{self.names.attributes[leaf]}"

    def expr(self, expr: Expr) -> str:
        """An expression, parenthesised where needed."""
        match expr:
            case Literal(value=value, type=kind):
                text = constant(kind, value)
                return f"({text})" if text.startswith("-") else text
            case Read(name=name):
                return self.place(name)
            case ReadLocal(name=name):
                return f"v_{name}"
            case Select(leaves=leaves, index=index):
                return f"({', '.join(self.place(leaf) for leaf in leaves)},)[{self.expr(index)}]"
            case Among(subject=subject, values=values):
                members = ", ".join(constant(subject.type, v) for v in values)
                return f"({self.expr(subject)} in ({members},))"
            case Apply(op=op, args=args):
                return self._applied(op, args)

    def _applied(self, op: Op, args: tuple[Expr, ...]) -> str:
        texts = [self.expr(arg) for arg in args]
        match op:
            case Op.NOT:
                return f"(not {texts[0]})"
            case Op.IMPLIES:
                return f"(not {texts[0]} or {texts[1]})"
            case Op.NEG:
                return f"(-{texts[0]})"
            case Op.TO_INT | Op.ABS:
                return f"{'int' if op is Op.TO_INT else 'abs'}({texts[0]})"
            case Op.TO_REAL:
                return f"float({texts[0]})"
            case Op.MIN | Op.MAX:
                return f"_{op.value}({texts[0]}, {texts[1]})"
            case Op.DIV:
                return (
                    f"_div({texts[0]}, {texts[1]})"
                    if isinstance(args[0].type, Int)
                    else f"({texts[0]} / {texts[1]})"
                )
            case Op.MOD:
                return f"_mod({texts[0]}, {texts[1]})"
            case _:
                return f"({texts[0]} {_INFIX[op]} {texts[1]})"

    def stored(self, kind: Scalar, value: Expr) -> str:
        """A value to keep: no -0.0."""
        return f"{self.expr(value)} + 0.0" if isinstance(kind, Real) else self.expr(value)

    def block(self, body: tuple[Statement, ...], indent: int) -> Iterator[str]:
        """Lines of Python; `pass` for nothing."""
        lines = [line for statement in body for line in self._statement(statement, indent)]
        yield from lines or ["    " * indent + "pass"]

    def _statement(self, statement: Statement, indent: int) -> Iterator[str]:
        pad = "    " * indent
        match statement:
            case Assign():
                yield from self._assign(statement, pad)
            case Local(name=name, type=kind, value=value):
                if value is not None:
                    yield f"{pad}v_{name} = {self.stored(kind, value)}"
            case If(condition=condition, then=then, orelse=orelse):
                yield f"{pad}if {self.expr(condition)}:"
                yield from self.block(then, indent + 1)
                if orelse:
                    yield f"{pad}else:"
                    yield from self.block(orelse, indent + 1)
            case Case():
                yield from self._case(statement, indent)
            case For(name=name, low=low, high=high, body=body):
                yield f"{pad}for v_{name} in range({low}, {high + 1}):"
                yield from self.block(body, indent + 1)
            case Call(procedure=name, args=args):
                yield pad + self.call(name, args)

    def call(self, name: str, args: tuple[Expr, ...] = ()) -> str:
        """A call of a procedure."""
        return (
            f"_do_{self.names.procedures[name]}({', '.join(['s', *(self.stored(a.type, a) for a in args)])})"
        )

    def _assign(self, statement: Assign, pad: str) -> Iterator[str]:
        place, text = statement.place, self.stored(statement.place.type, statement.value)
        if isinstance(place, ToLeaf):
            yield f"{pad}{self.place(place.name)} = {text}"
        elif isinstance(place, ToElement):
            attributes = ", ".join(repr(self.names.attributes[leaf]) for leaf in place.leaves)
            yield f"{pad}setattr(s, ({attributes},)[{self.expr(place.index)}], {text})"
        else:
            yield f"{pad}v_{place.name} = {text}"

    def _case(self, statement: Case, indent: int) -> Iterator[str]:
        pad, kind = "    " * indent, statement.subject.type
        if not statement.arms:
            yield from self.block(statement.orelse, indent)
            return
        self._cases[0] += 1
        subject = f"case_{self._cases[0]}"
        yield f"{pad}{subject} = {self.expr(statement.subject)}"
        word = "if"
        for arm in statement.arms:
            yield f"{pad}{word} {subject} in ({', '.join(constant(kind, v) for v in arm.values)},):"
            yield from self.block(arm.body, indent + 1)
            word = "elif"
        if statement.orelse:
            yield f"{pad}else:"
            yield from self.block(statement.orelse, indent + 1)
