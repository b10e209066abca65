"""Types, constants, expressions and statements as a tree of C99.

Integers are computed in `int64_t`, or in `uint64_t` where the bounds of operands and result need it and none is negative; that all of
them fit there was proved (`symbolic.execution.word`). Bits of words are masked and shifted without a sign.
Doubles are IEEE binary64 (`FLT_EVAL_METHOD` 0); what is stored has no -0.0.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, assert_never

from rcsc.emit.code_tree import (
    Body,
    Branch,
    Cast,
    Choice,
    Code,
    Constant,
    Frame,
    Infix,
    Invoke,
    Let,
    Line,
    Name,
    Place,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    when,
)
from rcsc.emit.identifiers import Names
from rcsc.emit.translate import FAULTLESS, Text, constant, local
from rcsc.lang import model
from rcsc.lang.expressions.words import bits_of, field_of, mask_of
from rcsc.lang.leaves import everything
from rcsc.lang.model import I64_MAX, I64_MIN, Bool, Enum, Expr, Int, Op, Real, Scalar, Value
from rcsc.lang.operator_table import Arithmetic, Comparison, Operator, is_comparison

_INFIX = {
    Op.AND: "&&", Op.OR: "||", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*", Op.DIV: "/", Op.MOD: "%",
}  # fmt: skip
SHORT = {"f64": "double"} | {f"{s or 'i'}{n}": f"{s}int{n}_t" for s in ("", "u") for n in (8, 16, 32, 64)}
"""How a type is called in the name of a helper."""
_CALLED = {kind: short for short, kind in SHORT.items()}


def c_type(kind: Scalar) -> str:
    """The type of a leaf: the smallest that holds its range."""
    match kind:
        case Bool():
            return "bool"
        case Real():
            return "double"
        case Enum(members=members):
            return "uint8_t" if len(members) <= 256 else "uint16_t"
        case Int(low, high):
            for bits in (8, 16, 32, 64):
                if low >= 0 and high < 1 << bits:
                    return f"uint{bits}_t"
                if low >= -(1 << bits - 1) and high < 1 << bits - 1:
                    return f"int{bits}_t"
    raise ValueError(kind)  # resolve keeps ranges within 64 bits


def declared(names: Names, name: str, kind: model.Type) -> str:
    """A declaration: the type of the innermost elements, the name, the lengths from the outermost in."""
    lengths = ""
    while isinstance(kind, model.Array):
        lengths += f"[{kind.length}]"
        kind = kind.element
    base = names.types[kind.name] if isinstance(kind, model.Record | Enum) else c_type(kind)
    return f"{base} {name}{lengths}"


def wide_type(kind: Scalar) -> str:
    """The type that expressions of the kind are computed in."""
    if isinstance(kind, Int):
        return "uint64_t" if kind.low >= 0 and kind.high > I64_MAX else "int64_t"
    return "int64_t" if isinstance(kind, Enum) else c_type(kind)


def type_bounds(name: str) -> tuple[int, int]:
    """Least and greatest value of an integer type of C, or of `bool`."""
    if name == "bool":
        return 0, 1
    bits = int(name.strip("uint_"))
    return (0, 2**bits - 1) if name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def _c_bounds(expr: Expr) -> tuple[Value, Value]:
    """What the C type of an expression can hold: a constant only itself, a double anything.

    Of a division or a remainder by a constant compilers know more: they compute it in the type of what is divided.
    """
    if isinstance(expr, model.Literal):
        return expr.value, expr.value
    if isinstance(expr.type, Real):
        return -math.inf, math.inf
    match expr:
        case model.Apply(op=Op.DIV | Op.MOD, args=(whole, model.Literal(value=divisor))):
            low, high = _c_bounds(whole)  # the result lies no farther from 0
            far = max(abs(low), abs(high))
            return (min(low, 0), max(high, 0)) if divisor > 0 else (-far, far)
    return type_bounds(
        c_type(expr.type) if isinstance(expr, model.Read | model.Select) else wide_type(expr.type)
    )


def _decided(op: Comparison, args: tuple[Expr, ...]) -> bool | None:
    """What a comparison always gives by the C types of its operands: compilers refuse it as a comparison."""
    first, second = args
    if isinstance(first.type, Real):
        return None
    if first == second:
        return op in (Op.EQ, Op.LE, Op.GE)
    (low, high), (least, most) = _c_bounds(first), _c_bounds(second)
    match op:
        case Op.LT | Op.GE:
            known = True if high < least else False if low >= most else None
        case Op.LE | Op.GT:
            known = True if high <= least else False if low > most else None
        case Op.EQ | Op.NE:
            known = False if high < least or most < low else None
        case _:
            assert_never(op)
    return (not known if op in (Op.GE, Op.GT, Op.NE) else known) if known is not None else None


def _shared(kinds: Sequence[Scalar]) -> str:
    """The type in which an operation on these is done: signed as soon as one of them can be negative."""
    if any(isinstance(kind, Int) and kind.low < 0 for kind in kinds):
        return "int64_t"
    wide = [wide_type(kind) for kind in kinds]
    return "uint64_t" if "uint64_t" in wide else wide[0]


def _plain(code: Code) -> bool:
    """Whether it may be cast as it stands: a variable, or a constant that is one token."""
    match code:
        case Constant(value=value, type=kind):
            return value != I64_MIN and (kind != "double" or value >= 0)
        case Place(steps=steps):
            return all(isinstance(step, str | Name) for step in steps)
        case Cast(type=kind, operand=operand):
            return kind != "double" and isinstance(operand, Name | Place) and _plain(operand)
        case _:
            return isinstance(code, Name)


def _widened(kind: Scalar, code: Code) -> Code:
    return code if isinstance(kind, Bool | Real) else Cast(wide_type(kind), code)


def _unsigned(word: Expr) -> str:
    """The type without a sign in which bits of a word are computed."""
    return "uint32_t" if bits_of(word) <= 32 else "uint64_t"


@dataclass
class CText(Text):
    """C99.

    Attributes:
        failing: Procedures after which a fault may stand.
    """

    failing: frozenset[str] = frozenset()
    _nested: int = 0

    def place(self, leaf: str) -> Place:
        """A leaf."""
        return Place(self.names.paths[leaf])

    def function(self, procedure: str) -> str:
        """The function of a procedure."""
        return f"{self.names.program}_do_{self.names.procedures[procedure]}"

    def expr(self, expr: Expr) -> Code:
        """An expression in the wide type of its kind."""
        match expr:
            case model.Literal(value=value, type=kind):
                return constant(kind, value)
            case model.Read(name=name, type=kind):
                return _widened(kind, self._element((name,), kind))
            case model.ReadLocal(name=name, type=kind):
                return Name(local(name).text, wide_type(kind))
            case model.Select(leaves=leaves, index=index, type=kind):
                return _widened(kind, self._element(leaves, kind, index))
            case model.Among(subject=subject, values=values):
                kind, (low, high) = subject.type, _c_bounds(subject)
                able = [value for value in values if isinstance(kind, Real) or low <= value <= high]
                return Round(self.among(self.expr(subject), kind, able))
            case model.Apply(op=op, args=args, type=kind):
                return self._bits(expr) or self._applied(op, args, kind)
            case _:
                assert_never(expr)

    def _bits(self, expr: model.Apply) -> Code | None:
        """A mask as one comparison, a field as a shift and a mask; None where the expression is neither."""
        mask, part = mask_of(expr), field_of(expr)
        if mask is not None:
            care, value = (Constant(bits, _unsigned(mask.word)) for bits in (mask.care, mask.value))
            return Round(infix("==", Round(infix("&", self._word(mask.word), care)), value))
        if part is None:
            return None
        number, ones = self._word(part.word), (2 << part.high - part.low) - 1
        if part.low:
            number = infix(">>", number, Constant(part.low, "uint32_t"))
        if part.high < bits_of(part.word) - 1:
            number = infix("&", number, Constant(ones, _unsigned(part.word)))
        return self.converted(Round(number), _unsigned(part.word), wide_type(expr.type))

    def _word(self, word: Expr) -> Code:
        """A word in the type in which its bits are computed."""
        code = self.expr(word)
        return Cast(_unsigned(word), code.operand if isinstance(code, Cast) else code)

    def _element(self, leaves: Sequence[str], kind: Scalar, index: Expr | None = None) -> Place:
        """An array element by a computed index, which is left out where it can only be 0."""
        steps: tuple[str | Code, ...] = self.names.paths[leaves[0]]
        if index is not None and len(leaves) > 1:
            pairs = zip(steps, self.names.paths[leaves[1]], strict=True)
            at = next(at for at, (step, other) in enumerate(pairs) if step != other)
            steps = (*steps[:at], self.expr(index), *steps[at + 1 :])
        return Place(steps, c_type(kind))

    def among(self, subject: Code, kind: Scalar, values: Sequence[Value]) -> Code:
        """Whether it is one of the values."""
        equal = tuple(infix("==", subject, constant(kind, value)) for value in values)
        return Infix("||", equal) if equal else constant(Bool(), value=False)

    def _applied(self, op: Operator, args: tuple[Expr, ...], kind: Scalar) -> Code:
        """An operation, in the type that the prover shows operands and result to fit in."""
        if op is Op.XOR:  # of truth values; it is no comparison where the operands are known to be equal
            op = Op.NE
        if is_comparison(op) and (known := _decided(op, args)) is not None:
            return constant(Bool(), known)
        given = [(self.expr(arg), wide_type(arg.type)) for arg in args]
        if op is Op.TO_INT and isinstance(args[0].type, Bool):
            return Round(Choice(given[0][0], constant(kind, 1), constant(kind, 0)))
        if op is Op.TO_INT or op is Op.TO_REAL:
            return self.converted(*given[0], wide_type(kind))
        shared = _shared((*(arg.type for arg in args), kind))
        result = self._operation(op, tuple(self.converted(*operand, shared) for operand in given), shared)
        return result if is_comparison(op) else self.converted(result, shared, wide_type(kind))

    def _operation(
        self,
        op: Literal[Op.NOT, Op.AND, Op.OR, Op.IMPLIES] | Comparison | Arithmetic,
        args: tuple[Code, ...],
        shared: str,
    ) -> Code:
        match op:
            case Op.NOT:
                return Round(Prefix("!", args[0]))
            case Op.NEG:
                return Round(Prefix("-", args[0]))
            case Op.IMPLIES:
                return Round(infix("||", Prefix("!", args[0]), args[1]))
            case Op.ABS | Op.MIN | Op.MAX:
                return self._helper(f"{op.value}_{_CALLED[shared]}", args, shared)
            case (
                Op.AND | Op.OR | Op.EQ | Op.NE | Op.LT | Op.LE | Op.GT | Op.GE
                | Op.ADD | Op.SUB | Op.MUL | Op.DIV | Op.MOD
            ):  # fmt: skip
                return Round(Infix(_INFIX[op], args))
            case _:
                assert_never(op)

    def _helper(self, name: str, args: tuple[Code, ...], kind: str) -> Code:
        return Invoke(f"{self.names.program}_{name}", args, kind, helper=name)

    def converted(self, code: Code, source: str, target: str) -> Code:
        """A value of C type `source` as one of `target`; it was proved to fit.

        The result of an operation is converted by a function of its own: MISRA C 10.8 forbids a cast there.
        """
        if source == target:
            return code
        if _plain(code):
            return Cast(target, code)
        return self._helper(f"{_CALLED[target]}_of_{_CALLED[source]}", (code,), target)

    def stored(self, kind: Scalar, value: Expr, *, leaf: bool = False) -> Code:
        """A value for a leaf, or for a local, in the type that it is kept in."""
        code = self.expr(value)
        if isinstance(kind, Real):
            return infix("+", code, constant(kind, 0))
        return self.converted(code, wide_type(value.type), c_type(kind) if leaf else wide_type(kind))

    # --- statements ---

    def block(self, body: Sequence[model.Statement]) -> Body:
        """Statements; after a call that may fail the rest is guarded."""
        done: list[Stmt] = []
        for at, statement in enumerate(body, 1):
            done += self.statement(statement)
            if at < len(body) and self._may_fail(statement):
                return (*done, when(FAULTLESS, *self.block(body[at:])))
        return tuple(done)

    def _may_fail(self, statement: model.Statement) -> bool:
        calls = (call for call in everything((statement,)) if isinstance(call, model.Call))
        return any(call.procedure in self.failing for call in calls)

    def guard(self, loop: model.For) -> tuple[Code, ...]:
        """What must hold in a loop that it goes on."""
        return (FAULTLESS,) if self._may_fail(loop) else ()

    def statement(self, statement: model.Statement) -> Iterator[Stmt]:
        """A statement; a local begins as zero, and is an integer of 64 bits."""
        match statement:
            case model.Local(name=name, type=kind, value=None):
                yield Set(local(name), constant(kind, 0))
            case model.For(low=low, high=high) if low > high:
                return
            case _:
                yield from super().statement(statement)

    def asked(self, condition: Expr) -> Code:
        """A condition as it stands in the parentheses of an `if`: `(a == b)` in them looks like a mistyped assignment."""
        match self.expr(condition):
            case Round(Infix(op="==", operands=(Name() | Place() | Invoke() as left, right))):
                return infix("==", left, right)
            case Round(Infix(op="==", operands=(Constant(value=value) as left, right))) if value >= 0:
                return infix("==", left, right)
            case code:
                return code

    def assigned(self, place: model.Place, value: Expr) -> Stmt:
        """An assignment."""
        given = self.stored(place.type, value, leaf=not isinstance(place, model.ToLocal))
        target: Code
        match place:
            case model.ToLeaf(name=name, type=kind):
                target = self._element((name,), kind)
            case model.ToElement(leaves=leaves, index=index, type=kind):
                target = self._element(leaves, kind, index)
            case model.ToLocal(name=name, type=kind):
                target = Name(local(name).text, wide_type(kind))
        return Set(target, given) if given != target else Line("/* keeps its value */")

    def case(self, statement: model.Case) -> Body:
        """A block with the value in it, and a chain of `if`."""
        self._nested += 1
        subject = Name("subject" if self._nested == 1 else f"subject_{self._nested}")
        let = Let(f"const {wide_type(statement.subject.type)}", subject.text, self.expr(statement.subject))
        arms = self.arms(subject, statement)
        orelse = self.block(statement.orelse) if statement.orelse else (Line("/* nothing */"),)
        self._nested -= 1
        return (Frame(("{",), (let, Branch(arms, orelse)), "}"),)


def locals_of(procedure: model.Procedure) -> Iterator[tuple[str, Scalar]]:
    """Locals and loop variables, declared at the top of the function."""
    for statement in everything(procedure.body):
        if isinstance(statement, model.Local):
            yield statement.name, statement.type
        elif isinstance(statement, model.For):
            yield statement.name, Int(statement.low, statement.high)
