"""Types, constants, expressions and statements in C99.

Integers are computed in `int64_t`, or in `uint64_t` where the bounds of operands and result need it and none is negative; that all of
them fit there was proved (`symbolic.execution.word`). Doubles are IEEE binary64 (`FLT_EVAL_METHOD` 0); what is stored has no -0.0.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.emit.identifiers import Names
from rcsc.lang.model import (
    I64_MAX,
    I64_MIN,
    U64_MAX,
    Among,
    Apply,
    Assign,
    Bool,
    Call,
    Case,
    Enum,
    Expr,
    For,
    If,
    Int,
    Literal,
    Local,
    Op,
    Procedure,
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
    Op.AND: "&&", Op.OR: "||", Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*", Op.DIV: "/", Op.MOD: "%",
}  # fmt: skip
_HELPER = {"int64_t": "i64", "uint64_t": "u64", "double": "f64"}
_SHORT = _HELPER | {
    f"{sign}int{bits}_t": f"{sign or 'i'}{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}
"""How a type is called in the name of a conversion."""
_PLAIN = re.compile(r"(?:\(u?int\d+_t\))?(?:s->[\w.\[\]]+|v_\w+)|\(?-?U?INT64_C\(\d+\)\)?|[\d.e+-]+")
"""What may be cast as it stands: a variable, or a constant."""
_COMPARE = frozenset({Op.EQ, Op.NE, Op.LT, Op.LE, Op.GT, Op.GE})


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


def wide_type(kind: Scalar) -> str:
    """The type that expressions of the kind are computed in."""
    if isinstance(kind, Int):
        return "uint64_t" if kind.low >= 0 and kind.high > I64_MAX else "int64_t"
    return "int64_t" if isinstance(kind, Enum) else c_type(kind)


def constant(kind: Scalar, value: Value) -> str:
    """A constant in the wide type of its kind."""
    match kind:
        case Bool():
            return "true" if value else "false"
        case Real():
            text = repr(abs(float(value)))
            text = text if any(c in text for c in ".e") else f"{text}.0"
            return f"(-{text})" if float(value) < 0 else text
        case Enum():
            return f"INT64_C({int(value)})"
        case Int():
            return integer(int(value))


def integer(value: int) -> str:
    """An integer constant of 64 bits."""
    if value > I64_MAX:
        return f"UINT64_C({value})"
    if value == I64_MIN:
        return f"(-INT64_C({I64_MAX}) - INT64_C(1))"
    return f"INT64_C({value})" if value >= 0 else f"(-INT64_C({-value}))"


def element_path(paths: list[str], index: str) -> str:
    """The place of an array element by a computed index, from the places of all its elements, at least two."""
    first, second = paths[0], paths[1]
    at = next(i for i, (a, b) in enumerate(zip(first, second, strict=False)) if a != b)
    head = first[: first.rindex("[", 0, at + 1)]
    return head + f"[{index}]" + re.sub(r"^\[\d+\]", "", first[len(head) :])


def type_bounds(name: str) -> tuple[int, int]:
    """Least and greatest value of an integer type of C, or of `bool`."""
    if name == "bool":
        return 0, 1
    bits = int(name.strip("uint_"))
    return (0, 2**bits - 1) if name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def _c_bounds(expr: Expr) -> tuple[Value, Value]:
    """What the C type of an expression can hold: a constant only itself, a double anything."""
    if isinstance(expr, Literal):
        return expr.value, expr.value
    if isinstance(expr.type, Real):
        return -math.inf, math.inf
    return type_bounds(c_type(expr.type) if isinstance(expr, Read | Select) else wide_type(expr.type))


def _decided(op: Op, args: tuple[Expr, ...]) -> bool | None:
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
        case _:
            known = False if high < least or most < low else None
    return (not known if op in (Op.GE, Op.GT, Op.NE) else known) if known is not None else None


def _one(kind: str) -> str:
    """The 1 that a counter of this type goes up by."""
    return "UINT64_C(1)" if kind == "uint64_t" else "INT64_C(1)"


def _shared(kinds: tuple[Scalar, ...]) -> str:
    """The type in which an operation on these is done: signed as soon as one of them can be negative."""
    if any(isinstance(kind, Int) and kind.low < 0 for kind in kinds):
        return "int64_t"
    wide = [wide_type(kind) for kind in kinds]
    return "uint64_t" if "uint64_t" in wide else wide[0]


@dataclass(slots=True)
class CText:
    """Spells for one program.

    Attributes:
        state: How the struct is reached: `s->`.
        failing: Procedures after which a fault may stand.
        parameters: Types of each procedure's parameters.
        helpers: Helper functions that were used.
        reals: Whether an expression was a real.
    """

    names: Names
    failing: frozenset[str] = frozenset()
    parameters: Mapping[str, tuple[Scalar, ...]] = field(default_factory=dict)
    state: str = "s->"
    helpers: set[str] = field(default_factory=set)
    reals: bool = False
    _nested: int = 0

    def place(self, leaf: str) -> str:
        """A leaf."""
        return self.state + self.names.paths[leaf]

    def element(self, leaves: Sequence[str], index: Expr) -> str:
        """An array element by a computed index, which is not spelled where it can only be 0."""
        paths = [self.names.paths[leaf] for leaf in leaves]
        return self.state + (paths[0] if len(paths) == 1 else element_path(paths, self.expr(index)))

    def expr(self, expr: Expr) -> str:
        """An expression in the wide type of its kind, parenthesised where needed."""
        self.reals = self.reals or isinstance(expr.type, Real)
        match expr:
            case Literal(value=value, type=kind):
                return constant(kind, value)
            case Read(name=name, type=kind):
                return self._widened(kind, self.place(name))
            case ReadLocal(name=name):
                return f"v_{name}"
            case Select(leaves=leaves, index=index, type=kind):
                return self._widened(kind, self.element(leaves, index))
            case Among(subject=subject, values=values):
                kind, (low, high) = subject.type, _c_bounds(subject)
                able = [constant(kind, v) for v in values if isinstance(kind, Real) or low <= v <= high]
                text = self.expr(subject) if able else ""
                return "(" + (" || ".join(f"({text} == {value})" for value in able) or "false") + ")"
            case Apply(op=op, args=args, type=kind):
                return self._applied(op, args, kind)

    @staticmethod
    def _widened(kind: Scalar, text: str) -> str:
        return text if isinstance(kind, Bool | Real) else f"({wide_type(kind)}){text}"

    def _applied(self, op: Op, args: tuple[Expr, ...], kind: Scalar) -> str:
        if (
            op is Op.XOR
        ):  # of truth values; an operand that is known to equal the other is no comparison, either
            op = Op.NE
        if op in _COMPARE and (known := _decided(op, args)) is not None:
            return constant(Bool(), known)
        texts = [self.expr(arg) for arg in args]
        if op is Op.NOT:
            return f"(!{texts[0]})"
        if op is Op.IMPLIES:
            return f"((!{texts[0]}) || {texts[1]})"
        if op in (Op.TO_INT, Op.TO_REAL):
            return self.converted(texts[0], wide_type(args[0].type), wide_type(kind))
        if op in (Op.ABS, Op.MIN, Op.MAX):
            return self._helper(op, args, texts, kind)
        if isinstance(args[0].type, Int) and (op in _COMPARE or isinstance(kind, Int)):
            return self._integers(op, args, texts, kind)
        if op is Op.NEG:
            return f"(-{texts[0]})"
        if op in _COMPARE and isinstance(args[0].type, Bool):
            return f"({texts[0]} {_INFIX[op]} {texts[1]})"
        return f"({texts[0]} {_INFIX[op]} {texts[1]})"

    def _integers(self, op: Op, args: tuple[Expr, ...], texts: list[str], kind: Scalar) -> str:
        """In the one 64-bit type that the prover shows operands and result to fit in."""
        shared = _shared((*(arg.type for arg in args), kind))
        cast = self._cast(args, texts, shared)
        if op is Op.NEG:
            return f"(-{cast[0]})"
        found = f"({cast[0]} {_INFIX[op]} {cast[1]})"
        return found if op in _COMPARE else self.converted(found, shared, wide_type(kind))

    def _helper(self, op: Op, args: tuple[Expr, ...], texts: list[str], kind: Scalar) -> str:
        shared = _shared((*(arg.type for arg in args), kind))
        name = f"{op.value}_{_HELPER[shared]}"
        self.helpers.add(name)
        found = f"{self.names.program}_{name}({', '.join(self._cast(args, texts, shared))})"
        return self.converted(found, shared, wide_type(kind))

    def _cast(self, args: tuple[Expr, ...], texts: list[str], shared: str) -> list[str]:
        pairs = zip(args, texts, strict=True)
        return [self.converted(text, wide_type(arg.type), shared) for arg, text in pairs]

    def converted(self, text: str, source: str, target: str) -> str:
        """A value of C type `source` as one of `target`; it was proved to fit.

        What an operation made is converted by a function of its own: MISRA C 10.8 forbids a cast there.
        """
        if source == target:
            return text
        if _PLAIN.fullmatch(text):
            return f"({target}){text}"
        name = f"{_SHORT[target]}_of_{_SHORT[source]}"
        self.helpers.add(name)
        return f"{self.names.program}_{name}({text})"

    def stored(self, kind: Scalar, value: Expr, target: str) -> str:
        """A value for a place of C type `target`."""
        text = self.expr(value)
        if isinstance(kind, Real):
            return f"{text} + 0.0"
        return text if isinstance(kind, Bool) else self.converted(text, wide_type(value.type), target)

    # --- statements ---

    def block(self, body: tuple[Statement, ...], indent: int) -> Iterator[str]:
        """Lines of C; after a call that may fail the rest is guarded."""
        pad = "    " * indent
        for at, statement in enumerate(body):
            yield from self._statement(statement, indent)
            if self._may_fail(statement) and at + 1 < len(body):
                yield f"{pad}if (s->fault == 0) {{"
                yield from self.block(body[at + 1 :], indent + 1)
                yield f"{pad}}}"
                return

    def _may_fail(self, statement: Statement) -> bool:
        match statement:
            case Call(procedure=name):
                return name in self.failing
            case If(then=then, orelse=orelse):
                return any(self._may_fail(one) for one in (*then, *orelse))
            case Case(arms=arms, orelse=orelse):
                inner = [one for arm in arms for one in arm.body]
                return any(self._may_fail(one) for one in (*inner, *orelse))
            case For(body=body):
                return any(self._may_fail(one) for one in body)
            case _:
                return False

    def _statement(self, statement: Statement, indent: int) -> Iterator[str]:
        pad = "    " * indent
        match statement:
            case Assign():
                yield pad + self._assign(statement)
            case Local(name=name, type=kind, value=value):
                start = constant(kind, 0) if value is None else self.stored(kind, value, wide_type(kind))
                yield f"{pad}v_{name} = {start};"
            case If(condition=condition, then=then, orelse=orelse):
                yield f"{pad}if ({self._asked(condition)}) {{"
                yield from self.block(then, indent + 1)
                if orelse:
                    yield f"{pad}}} else {{"
                    yield from self.block(orelse, indent + 1)
                yield f"{pad}}}"
            case Case():
                yield from self._case(statement, indent)
            case For():
                yield from self._for(statement, indent)
            case Call(procedure=name, args=args):
                yield pad + self.call(name, args)

    def _asked(self, condition: Expr) -> str:
        """A condition as it stands in the parentheses of an `if`: `(a == b)` in them looks like a mistyped assignment."""
        text = self.expr(condition)
        equal = isinstance(condition, Apply) and condition.op is Op.EQ
        return text[1:-1] if equal and text.startswith("(") and text[1] not in "(!" else text

    def _for(self, loop: For, indent: int) -> Iterator[str]:
        """A loop; one to the last value of its type ends without counting past it."""
        if loop.low > loop.high:
            return
        pad, v = "    " * indent, f"v_{loop.name}"
        begin = f"{v} = {integer(loop.low)}"
        guard = " && (s->fault == 0)" if self._may_fail(loop) else ""
        kind = wide_type(Int(loop.low, loop.high))
        step = f"{v} = {v} + {_one(kind)}"
        if loop.high < (U64_MAX if kind == "uint64_t" else I64_MAX):
            yield f"{pad}for ({begin}; ({v} <= {integer(loop.high)}){guard}; {step}) {{"
            yield from self.block(loop.body, indent + 1)
            yield f"{pad}}}"
            return
        inner, more = pad + "    ", f"more_{loop.name}"
        yield f"{pad}{{"
        yield f"{inner}bool {more} = true;"
        yield f"{inner}{begin};"
        yield f"{inner}while ({more}{guard}) {{"
        yield from self.block(loop.body, indent + 2)
        yield f"{inner}    {more} = {v} < {integer(loop.high)};"
        yield f"{inner}    if ({more}) {{"
        yield f"{inner}        {step};"
        yield f"{inner}    }}"
        yield f"{inner}}}"
        yield f"{pad}}}"

    def call(self, name: str, args: tuple[Expr, ...] = ()) -> str:
        """A call of a procedure."""
        kinds = self.parameters.get(name, tuple(arg.type for arg in args))
        pairs = zip(kinds, args, strict=True)
        given = ["s", *(self.stored(kind, arg, wide_type(kind)) for kind, arg in pairs)]
        return f"{self.names.program}_do_{self.names.procedures[name]}({', '.join(given)});"

    def _assign(self, statement: Assign) -> str:
        place, value = statement.place, statement.value
        if isinstance(place, ToLeaf):
            target, kind = self.place(place.name), c_type(place.type)
        elif isinstance(place, ToElement):
            target, kind = self.element(place.leaves, place.index), c_type(place.type)
        else:
            target, kind = f"v_{place.name}", wide_type(place.type)
        given = self.stored(place.type, value, kind)
        return f"{target} = {given};" if given != target else "/* keeps its value */"

    def _case(self, statement: Case, indent: int) -> Iterator[str]:
        pad, subject = "    " * indent, statement.subject
        if not statement.arms:
            yield from self.block(statement.orelse, indent)
            return
        self._nested += 1
        name = "subject" if self._nested == 1 else f"subject_{self._nested}"
        word = "if"
        yield f"{pad}{{"
        inner = pad + "    "
        yield f"{inner}const {wide_type(subject.type)} {name} = {self.expr(subject)};"
        for arm in statement.arms:
            tests = " || ".join(f"({name} == {constant(subject.type, v)})" for v in arm.values) or "false"
            yield f"{inner}{word} ({tests}) {{"
            yield from self.block(arm.body, indent + 2)
            word = "} else if"
        yield f"{inner}}} else {{"
        yield from self.block(statement.orelse, indent + 2)
        if not statement.orelse:
            yield f"{inner}    /* nothing */"
        yield f"{inner}}}"
        yield f"{pad}}}"
        self._nested -= 1


def locals_of(procedure: Procedure) -> Iterator[tuple[str, Scalar]]:
    """Locals and loop variables, declared at the top of the function."""
    from rcsc.lang.leaves import everything

    for statement in everything(procedure.body):
        if isinstance(statement, Local):
            yield statement.name, statement.type
        elif isinstance(statement, For):
            yield statement.name, Int(statement.low, statement.high)
