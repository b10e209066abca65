"""Types, constants, expressions and statements as a tree of C99.

A leaf, a parameter and a local have the smallest type that holds their range, and are compared as they are. Arithmetic is done in the
smallest of `int32_t`, `uint32_t`, `int64_t` and `uint64_t` that holds the bounds of its operands and of its result; where bounds exceed 64
bits it was proved that the values do not (`symbolic.execution.word`). What may differ is only which operands are cast: all of these
types give the same value. Bits of words are masked and shifted without a sign. Doubles are IEEE binary64 (`FLT_EVAL_METHOD` 0); what is
stored has no -0.0.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal, assert_never

from rcsc.code.emit.code_tree import (
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
    Loop,
    MemberPath,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    type_bounds,
    when,
)
from rcsc.code.emit.identifiers import Names
from rcsc.code.emit.ranges import Ends, Ranges
from rcsc.code.emit.translate import FAULT, Text, constant, local
from rcsc.lang import model
from rcsc.lang.expressions.words import bits_of, field_of, mask_of
from rcsc.lang.leaves import everything
from rcsc.lang.model import I64_MAX, Bool, Enum, Expr, Int, Op, Real, Scalar, Single, Value, next_value
from rcsc.lang.operator_table import Arithmetic, Comparison, Operator, is_arithmetic, is_comparison, is_logic

_INFIX = {
    Op.AND: "&&", Op.OR: "||", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*", Op.DIV: "/", Op.MOD: "%",
}  # fmt: skip
SHORT = {"f64": "double", "f32": "float"} | {
    f"{s or 'i'}{n}": f"{s}int{n}_t" for s in ("", "u") for n in (8, 16, 32, 64)
}
"""How a type is called in the name of a helper."""
WORD_TYPES = ("int32_t", "uint32_t", "int64_t", "uint64_t")
"""Types in which whole numbers are computed."""
FLOATS = ("double", "float")
"""Types of numbers with a fraction."""
LOGIC = frozenset({"&&", "||", "==", "!=", "<", "<=", ">", ">="})
"""Operators whose result is a truth value."""
LEAVES = (model.Read, model.ReadLocal, model.Select)
DIVIDED = {Op.DIV: "quotient", Op.MOD: "remainder"}
"""Functions that divide by what is not 0, but negative or positive."""
CALLED = {kind: short for short, kind in SHORT.items()}
"""The reverse."""


def c_type(kind: Scalar) -> str:
    """Return the C type of a leaf: the smallest that holds its range."""
    match kind:
        case Bool():
            return "bool"
        case Single():
            return "float"
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


def declared(names: Names, name: str, kind: model.Type, *, defensive: bool) -> str:
    """Spell a member's declaration: the type of the innermost elements, the name, the lengths from the outermost in.

    Where any bytes may come, a truth value is a byte: not all bytes are a valid bool.
    """
    lengths = ""
    while isinstance(kind, model.Array):
        lengths += f"[{kind.length}]"
        kind = kind.element
    if isinstance(kind, model.Record | Enum):
        return f"{names.types[kind.name]} {name}{lengths}"
    held = "uint8_t" if defensive and isinstance(kind, Bool) else c_type(kind)
    return f"{held} {name}{lengths}"


def wide_type(kind: Scalar) -> str:
    """Return the type of an extern procedure's parameter: it is wide, so that a user's function need not change with the range."""
    if isinstance(kind, Int):
        return "uint64_t" if kind.low >= 0 and kind.high > I64_MAX else "int64_t"
    return "int64_t" if isinstance(kind, Enum) else c_type(kind)


def word_type(low: int, high: int) -> str:
    """Return the type in which whole numbers between these bounds are computed; never one that C would promote to another."""
    if low >= 0:
        return "uint32_t" if high < 1 << 32 else "uint64_t"
    return "int32_t" if low >= -(1 << 31) and high < 1 << 31 else "int64_t"


def local_type(kind: Scalar) -> str:
    """Return the type of a parameter, a local or a loop variable."""
    return word_type(kind.low, kind.high) if isinstance(kind, Int) else c_type(kind)


def carried(expr: Expr) -> str:
    """Return the C type of an expression's code; for a whole number as a constant, one that it fits in."""
    match expr:
        case model.Literal(value=value, type=Int()):
            return word_type(int(value), int(value))
        case model.ReadLocal(type=kind):
            return local_type(kind)
        case model.Apply(op=Op.TO_INT, args=(arg,)) if isinstance(arg.type, Bool):
            return "uint32_t"
        case model.Apply(type=Int()):
            return word_type(*_bounds((*expr.args, expr)))  # it holds operands and result
        case _:
            return c_type(expr.type)


def _bounds(exprs: Iterable[Expr]) -> tuple[int, int]:
    """Return the bounds of all whole numbers among these together."""
    kinds = [expr.type for expr in exprs if isinstance(expr.type, Int)]
    return min(kind.low for kind in kinds), max(kind.high for kind in kinds)


def _c_bounds(expr: Expr) -> tuple[Value, Value]:
    """Return the values that the C type of an expression can hold: a constant only itself, a double or single any.

    Of a division or a remainder by a constant compilers know more: they compute it in the type of the dividend.
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
    return type_bounds(carried(expr))


def _decided(op: Comparison, args: tuple[Expr, ...]) -> bool | None:
    """Return the constant result of a comparison by its operands' C types, else None: compilers refuse such a comparison."""
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


def _compared_in(args: Sequence[Expr]) -> str | None:
    """Return the type in which whole numbers are compared; None where each may stand as it is.

    C compares two types of one sign by their values, whichever is the wider.
    """
    signed = {not carried(arg).startswith("u") for arg in args if not isinstance(arg, model.Literal)}
    negative = any(isinstance(arg, model.Literal) and arg.value < 0 for arg in args)
    if signed == {True} or (signed == {False} and not negative):
        return None
    return word_type(*_bounds(args))


def _beside(value: int, other: str) -> str:
    """Return the type of a constant beside an operand of type `other`, with the same sign."""
    return word_type(value if other.startswith("u") else min(value, -1), value)


def negated(code: Code) -> Code:
    """Return the negation of a condition."""
    return code.operand if isinstance(code, Prefix) and code.op == "!" else Prefix("!", code)


def _joined(op: str, code: Code) -> tuple[Code, ...]:
    """Return the operands of a chain of one operator."""
    return code.operands if isinstance(code, Infix) and code.op == op else (code,)


def _chain(op: str, args: Iterable[Code]) -> Code:
    """Return a chain of one operator, without constants that are neutral in it: they can never decide."""
    neutral = constant(Bool(), op == "&&")
    parts = [part for arg in args for part in _joined(op, arg)]
    left = tuple(part for part in parts if part != neutral)
    return infix(op, *left) if left else neutral


def _plain(code: Code) -> bool:
    """Return whether the code may be cast as it stands: a variable, or a constant that is one token."""
    match code:
        case Constant(value=value, type=kind):
            return kind not in FLOATS or value >= 0
        case MemberPath(steps=steps):
            return all(isinstance(step, str | Name) for step in steps)
        case Cast(type=kind, operand=operand):
            return kind not in FLOATS and isinstance(operand, Name | MemberPath) and _plain(operand)
        case _:
            return isinstance(code, Name)


def _narrower(source: str, target: str) -> bool:
    """Return whether the result of an operation may be cast to `target`, which is no wider (MISRA C 10.8).

    It is an integer type of the same sign, or a single for a double.
    """
    if not {"bool", *FLOATS}.isdisjoint((source, target)):
        return (source, target) == ("double", "float")
    return (
        source.startswith("u") == target.startswith("u") and type_bounds(target)[1] <= type_bounds(source)[1]
    )


def _ends(number: Expr) -> Ends:
    """Return the bounds of a number by its type."""
    assert isinstance(number.type, Int | Real)
    return number.type.low, number.type.high


def _may_be_zero(ranges: Ranges, number: Expr) -> bool:
    """Return whether ranges alone leave it open that a number is 0."""
    return all(low <= 0 <= high for low, high in (_ends(number), ranges.of(number)))


def _within(ends: Ends, held: str) -> bool:
    """Return whether all numbers between these ends fit the type."""
    if held in FLOATS:
        return all(map(math.isfinite, ends))
    low, high = type_bounds(held)
    return low <= ends[0] and ends[1] <= high


def _whole_ends(kind: Scalar, target: str) -> Ends:
    """Return the least and the greatest real of a kind whose whole part fits an integer type."""
    low, high = type_bounds(target)
    greatest = float(high)
    return float(low), greatest if greatest <= high else next_value(kind, greatest, -1)


def _unsigned(word: Expr) -> str:
    """Return the unsigned type in which bits of a word are computed."""
    return "uint32_t" if bits_of(word) <= 32 else "uint64_t"


def _pattern(bits: int, word: Expr) -> Name:
    """Spell bits as a constant of the type in which the word's bits are computed."""
    return Name(f"{bits:#x}u" if _unsigned(word) == "uint32_t" else f"UINT64_C({bits:#x})", _unsigned(word))


@dataclass
class CText(Text):
    """Makes the code of one program in C99.

    Attributes:
        failing: Procedures after which a fault may stand.
    """

    failing: frozenset[str] = frozenset()
    _nested: int = 0
    _ranges: Ranges = field(default_factory=Ranges)
    _stated: Ranges = field(default_factory=Ranges)

    @property
    def faultless(self) -> Code:
        """The condition that no fault stands."""
        return infix("==", FAULT, Name(self.names.faults[0]))

    @property
    def faulted(self) -> Code:
        """The condition that a fault stands."""
        return infix("!=", FAULT, Name(self.names.faults[0]))

    def place(self, leaf: str) -> MemberPath:
        """Return the place of a leaf in the state."""
        return MemberPath(self.names.paths[leaf])

    def function(self, procedure: str) -> str:
        """Return the name of a procedure's function."""
        return f"{self.names.program}_do_{self.names.procedures[procedure]}"

    def constant(self, kind: Scalar, value: Value, held: str = "") -> Code:
        """Return a constant: the enumerator of a member; a number as one of type `held`, else of the kind's own type."""
        if isinstance(kind, Enum):
            return Name(self.names.constants[kind.name][int(value)], c_type(kind))
        return Constant(value, held or c_type(kind))

    def expr(self, expr: Expr) -> Code:
        """Return the code of an expression, in its type `carried`."""
        match expr:
            case model.Literal(value=value, type=kind):
                return self.constant(kind, value, carried(expr))
            case model.Read(name=name, type=kind):
                return self._element((name,), kind)
            case model.ReadLocal(name=name, type=kind):
                return Name(local(name).text, local_type(kind))
            case model.Select(leaves=leaves, index=index, type=kind):
                return self._element(leaves, kind, index)
            case model.Among(subject=subject, values=values):
                if isinstance(subject, model.Literal):  # a comparison of constants looks like a mistake
                    return constant(Bool(), subject.value in values)
                kind, (low, high) = subject.type, _c_bounds(subject)
                able = [value for value in values if isinstance(kind, Real) or low <= value <= high]
                return self.among(self.whole(subject), kind, able)
            case model.Apply(op=op, args=args):
                return self._bits(expr) or self._applied(op, args, expr)
            case _:
                assert_never(expr)

    def _bits(self, expr: model.Apply) -> Code | None:
        """Return a mask as one comparison, or a field as a shift and a mask; None where the expression is neither."""
        mask, part = mask_of(expr), field_of(expr)
        if mask is not None:
            care, value = (_pattern(bits, mask.word) for bits in (mask.care, mask.value))
            return infix("==", infix("&", self._word(mask.word), care), value)
        if part is None:
            return None
        number, ones = self._word(part.word), (2 << part.high - part.low) - 1
        if part.low:
            number = infix(">>", number, Constant(part.low, "uint32_t"))
        if part.high < bits_of(part.word) - 1:
            number = infix("&", number, _pattern(ones, part.word))
        return self.converted(number, _unsigned(part.word), carried(expr))

    def _word(self, word: Expr) -> Code:
        """Return a word in an unsigned type."""
        if isinstance(word, LEAVES) and carried(word).startswith("u"):
            return self.expr(word)
        return self.in_type(word, _unsigned(word))

    def whole(self, expr: Expr) -> Code:
        """Return an expression in a type that is signed only where its values can be negative."""
        kind, held = expr.type, carried(expr)
        if isinstance(kind, Int) and kind.low >= 0 and not held.startswith("u"):
            return self.in_type(expr, local_type(kind))
        return self.expr(expr)

    def in_type(self, expr: Expr, target: str, ends: Ends | None = None) -> Code:
        """Return the value of an expression in C type `target`, in which it was proved to fit.

        Its parts are computed in that type, too, where all of them fit: nothing is cast twice.

        Args:
            expr: The expression.
            target: An integer type.
            ends: Bounds between which it was proved to lie; by default those of the type.
        """
        if self._unseen(expr, ends or type_bounds(target)) is not None:
            held = word_type(*_bounds((expr,)))
            return self.converted(self._held(expr, held, ends or type_bounds(target)), held, target)
        if isinstance(expr, model.Literal):
            return self.constant(expr.type, expr.value, target)
        if (
            isinstance(expr, model.Apply)
            and is_arithmetic(expr.op)
            and target in WORD_TYPES
            and isinstance(expr.type, Int)
            and not field_of(expr)
        ):
            low, high = type_bounds(target)
            least, most = _bounds((*expr.args, expr))
            if low <= least and most <= high:
                return self._computed(expr, target)
        return self.converted(self.expr(expr), carried(expr), target)

    def _unseen(self, expr: Expr, ends: Ends) -> Ends | None:
        """Return a number's ends by ranges alone, where these do not show it to lie between the given ends; else None.

        Return None also where the ranges leave no value: the number is never computed.
        """
        kind, (low, high) = expr.type, ends
        if not isinstance(kind, Int | Real) or (low <= kind.low and kind.high <= high):
            return None
        least, most = self._ranges.of(expr)
        if isinstance(kind, Int):
            first, last = type_bounds(word_type(kind.low, kind.high))
            least, most = max(least, first), min(most, last)
        return None if (low <= least and most <= high) or most < low or high < least else (least, most)

    def _held(self, expr: Expr, held: str, ends: Ends) -> Code:
        """Return a number in type `held`, kept between the ends by a call that changes nothing, as it was proved to lie there."""
        code, unseen = self._given(expr, held), self._unseen(expr, ends)
        if unseen is None:
            return code
        below, above = unseen[0] < ends[0], unseen[1] > ends[1]
        name = "within" if below and above else "atleast" if below else "atmost"
        inside = [Constant(end, held) for end, passed in zip(ends, (below, above), strict=True) if passed]
        return self._helper(f"{name}_{CALLED[held]}", (code, *inside), held)

    def _computed(self, expr: model.Apply, held: str) -> Code:
        """Return an operation on numbers, in type `held`; a divisor that can be 0 is excluded."""
        op, args = expr.op, self._arguments(expr, held)
        assert is_arithmetic(op)
        if op in DIVIDED and isinstance(expr.type, Int):
            low, high = self._proved.of(expr.args[1])
            if low < 0 < high:
                return self._helper(f"{DIVIDED[op]}_{CALLED[held]}", args, held)
        return self._operation(op, args, held)

    def _arguments(self, expr: model.Apply, held: str) -> tuple[Code, ...]:
        """Return the operands of an operation on numbers.

        Ranges that the lines state are enforced where, without them, the result might not fit the type, or the divisor be 0.
        """
        ends: list[Ends | None] = [None for _ in expr.args]
        proved, within = self._proved, partial(_within, held=held)
        if not within(_ends(expr)) and not within(self._ranges.of(expr)) and within(proved.of(expr)):
            ends = [proved.of(arg) for arg in expr.args]
        if (
            expr.op in (Op.DIV, Op.MOD)
            and isinstance(expr.type, Int)
            and _may_be_zero(self._ranges, expr.args[1])
        ):
            low, high = proved.of(expr.args[1])
            ends[1] = low + (low == 0), high - (high == 0)
        sides = zip(expr.args, ends, strict=True)
        return tuple(
            self._given(arg, held) if side is None else self._held(arg, held, side) for arg, side in sides
        )

    def _given(self, expr: Expr, held: str) -> Code:
        return self.expr(expr) if held in FLOATS else self.in_type(expr, held)

    @property
    def _proved(self) -> Ranges:
        """The ranges here, met with those that the lines state of variables not written since."""
        return self._ranges.met(self._stated)

    def _element(self, leaves: Sequence[str], kind: Scalar, index: Expr | None = None) -> MemberPath:
        """Return an array element by a computed index, which is left out where it can only be 0."""
        steps: tuple[str | Code, ...] = self.names.paths[leaves[0]]
        if index is not None and len(leaves) > 1:
            pairs = zip(steps, self.names.paths[leaves[1]], strict=True)
            at = next(at for at, (step, other) in enumerate(pairs) if step != other)
            steps = (*steps[:at], self._index(index, len(leaves)), *steps[at + 1 :])
        return MemberPath(steps, c_type(kind))

    def _index(self, index: Expr, length: int) -> Code:
        """Return an index of an array of this length."""
        ends = 0, length - 1
        if self._unseen(index, ends) is None:
            return self.expr(index)
        return self._held(index, word_type(*_bounds((index,))), ends)

    def among(self, subject: Code, kind: Scalar, values: Sequence[Value]) -> Code:
        """Return the condition that the subject is one of the values."""
        equal = tuple(infix("==", subject, self.constant(kind, value)) for value in values)
        return infix("||", *equal) if equal else constant(Bool(), value=False)

    def _applied(self, op: Operator, args: tuple[Expr, ...], expr: model.Apply) -> Code:
        """Return an operation, in the type that the prover shows operands and result to fit in."""
        if op is Op.XOR:  # of truth values; it is no comparison where the operands are known to be equal
            op = Op.NE
        if is_comparison(op):
            known, sides = _decided(op, args), self._operands(args)
            if known is None and sides[0] == sides[1] and not isinstance(args[0].type, Real):
                known = op in (Op.EQ, Op.LE, Op.GE)  # two ways to write one variable
            return self._operation(op, sides, "") if known is None else constant(Bool(), known)
        if op is Op.TO_INT or op is Op.TO_REAL or op is Op.TO_SINGLE:
            given = self.expr(args[0])
            if isinstance(args[0].type, Bool):
                return Choice(given, Constant(1, "uint32_t"), Constant(0, "uint32_t"))
            source, target = carried(args[0]), carried(expr)
            if op is Op.TO_INT and not _within(_ends(expr), target):
                given = self._held(args[0], source, _whole_ends(args[0].type, target))
            return self.converted(given, source, target)
        if is_arithmetic(op):
            return self._computed(expr, carried(expr))
        operands = self._in_turn(expr) if is_logic(op) else tuple(map(self.expr, args))
        return self._operation(op, operands, "")

    def _in_turn(self, expr: model.Apply) -> tuple[Code, ...]:
        """Return the operands of a truth function; the second one's ranges are those where the first does not decide."""
        (first, second), before = expr.args, self._ranges
        given = self.expr(first)
        self._ranges = before.where(first, holds=expr.op is not Op.OR)
        codes = given, self.expr(second)
        self._ranges = before
        return codes

    def _operands(self, args: tuple[Expr, ...]) -> tuple[Code, ...]:
        """Return the two sides of a comparison, unchanged where C compares them by their values."""
        if not isinstance(args[0].type, Int):
            return tuple(map(self.expr, args))
        shared = _compared_in(args)
        if shared is not None:
            return tuple(self.in_type(arg, shared) for arg in args)
        other = next(carried(arg) for arg in args if not isinstance(arg, model.Literal))
        return tuple(
            self.in_type(arg, _beside(int(arg.value), other))
            if isinstance(arg, model.Literal)
            else self.expr(arg)
            for arg in args
        )

    def _operation(
        self,
        op: Literal[Op.NOT, Op.AND, Op.OR, Op.IMPLIES] | Comparison | Arithmetic,
        args: tuple[Code, ...],
        shared: str,
    ) -> Code:
        match op:
            case Op.NOT:
                return negated(args[0])
            case Op.NEG:
                return Prefix("-", args[0])
            case Op.IMPLIES:
                return _chain("||", (negated(args[0]), args[1]))
            case Op.ABS | Op.MIN | Op.MAX:
                return self._helper(f"{op.value}_{CALLED[shared]}", args, shared)
            case Op.AND | Op.OR:
                return _chain(_INFIX[op], args)
            case (
                Op.EQ | Op.NE | Op.LT | Op.LE | Op.GT | Op.GE
                | Op.ADD | Op.SUB | Op.MUL | Op.DIV | Op.MOD
            ):  # fmt: skip
                return Infix(_INFIX[op], args)
            case _:
                assert_never(op)

    def _helper(self, name: str, args: tuple[Code, ...], kind: str) -> Code:
        bare = tuple(arg.inner if isinstance(arg, Round) else arg for arg in args)
        return Invoke(f"{self.names.program}_{name}", bare, kind, helper=name)

    def converted(self, code: Code, source: str, target: str) -> Code:
        """Convert a value of C type `source` to `target`; it was proved to fit.

        The result of an operation is cast only to a type of its sign that is no wider; else a function of its own converts it
        (MISRA C 10.8).
        """
        if source == target:
            return code
        if isinstance(code, Constant) and target not in FLOATS:
            return Constant(code.value, target)
        if _plain(code) or _narrower(source, target):
            return Cast(target, code)
        return self._helper(f"{CALLED[target]}_of_{CALLED[source]}", (code,), target)

    def stored(self, kind: Scalar, value: Expr, *, leaf: bool = False) -> Code:
        """Return a value for a leaf, or for a local, in the type that it is kept in."""
        if isinstance(kind, Real):
            return infix("+", self._held(value, carried(value), (kind.low, kind.high)), constant(kind, 0))
        target, source = c_type(kind) if leaf else local_type(kind), carried(value)
        if isinstance(kind, Int) and self._unseen(value, (kind.low, kind.high)) is not None:
            return self.in_type(value, target, (kind.low, kind.high))
        if isinstance(kind, Bool) or (isinstance(value, LEAVES) and _narrower(target, source)):
            return self.expr(value)  # C widens a variable by itself
        return self.in_type(value, target)

    # --- statements ---

    def body(self, body: Sequence[model.Statement], stated: Ranges) -> Body:
        """Return the statements of a procedure or a line.

        Args:
            body: The statements.
            stated: The ranges that lines state before it.
        """
        self._ranges, self._stated = Ranges(), stated
        done = self.block(body)
        self._ranges = self._stated = Ranges()
        return done

    def block(self, body: Sequence[model.Statement]) -> Body:
        """Return statements; after a call that may fail the rest is guarded."""
        done: list[Stmt] = []
        for at, statement in enumerate(body, 1):
            done += self.statement(statement)
            self._stated = self._stated.without((statement,))
            if at < len(body) and self._may_fail(statement):
                skipped = self._ranges
                done.append(when(self.faultless, *self.block(body[at:])))
                self._ranges = skipped.joined(self._ranges)
                break
        return tuple(done)

    def _may_fail(self, statement: model.Statement) -> bool:
        calls = (call for call in everything((statement,)) if isinstance(call, model.Call))
        return any(call.procedure in self.failing for call in calls)

    def guard(self, loop: model.For) -> tuple[Code, ...]:
        """Return the conditions under which a loop goes on."""
        return (self.faultless,) if self._may_fail(loop) else ()

    def beginning(self, kind: Scalar) -> Code:
        """Return the first value of a local, which nothing reads: zero, or the number of its type that is nearest to it."""
        nearest = min(max(0, kind.low), kind.high) if isinstance(kind, Int | Real) else 0
        return self.constant(kind, nearest, local_type(kind))

    def statement(self, statement: model.Statement) -> Iterator[Stmt]:
        """Yield the code of a statement; a local whole number has at least 32 bits."""
        match statement:
            case model.Local(name=name, type=kind, value=None):
                yield Set(local(name), self.beginning(kind))
                self._ranges = self._ranges.without((statement,))
            case model.For(low=low, high=high) if low > high:
                return
            case model.For(name=name, low=low, high=high, body=body):
                counted, before = word_type(low, high), self._ranges.without(body)
                self._ranges, self._stated = before, self._stated.without(body)
                yield Loop(local(name).text, low, high, self.block(body), self.guard(statement), counted)
                self._ranges = before
            case model.If(condition=condition, then=then, orelse=orelse):
                given, before = self.expr(condition), self._ranges
                taken, after = self._inside(then, before.where(condition))
                other, beside = self._inside(orelse, before.where(condition, holds=False))
                yield Branch(((given, taken),), other if orelse else None)
                self._ranges = after.joined(beside)
            case _:
                yield from super().statement(statement)
                self._ranges = self._ranges.after(statement)

    def _inside(self, body: Sequence[model.Statement], ranges: Ranges) -> tuple[Body, Ranges]:
        """Return the code of statements before which these ranges are known, and the ranges after them."""
        self._ranges, stated = ranges, self._stated
        done = self.block(body)
        self._stated = stated
        return done, self._ranges

    def assigned(self, place: model.Place, value: Expr) -> Stmt:
        """Return the code of an assignment."""
        given = self.stored(place.type, value, leaf=not isinstance(place, model.ToLocal))
        target: Code
        match place:
            case model.ToLeaf(name=name, type=kind):
                target = self._element((name,), kind)
            case model.ToElement(leaves=leaves, index=index, type=kind):
                target = self._element(leaves, kind, index)
            case model.ToLocal(name=name, type=kind):
                target = Name(local(name).text, local_type(kind))
        given = Round(given) if isinstance(given, Infix) and given.op in LOGIC else given
        return Set(target, given) if given != target else Line("/* keeps its value */")

    def case(self, statement: model.Case) -> Body:
        """Return a block with the value in it, and a chain of `if`."""
        self._nested += 1
        kind, given = statement.subject.type, self.whole(statement.subject)
        held = c_type(kind) if isinstance(given, MemberPath) else local_type(kind)
        subject = Name("subject" if self._nested == 1 else f"subject_{self._nested}", held)
        let = Let(f"const {held}", subject.text, given)
        before = self._ranges
        arms = tuple(
            (self.among(subject, kind, arm.values), self._inside(arm.body, before)[0])
            for arm in statement.arms
        )
        orelse = self._inside(statement.orelse, before)[0] or (Line("/* nothing */"),)
        self._nested -= 1
        self._ranges = before
        return (Frame(("{",), (let, Branch(arms, orelse)), "}"),)


def locals_of(procedure: model.Procedure) -> Iterator[tuple[str, Scalar]]:
    """Yield the locals, declared at the top of the function; a loop declares its variable itself."""
    for statement in everything(procedure.body):
        if isinstance(statement, model.Local):
            yield statement.name, statement.type
