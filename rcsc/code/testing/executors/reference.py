"""The tables and procedures in plain C, written from their conditions: what the executor is held against.

In: a program and the symbols of the emitted C. Out: one C text that works on the emitted struct. It is
kept apart from the emitter on purpose: no masks, no plan; a scan over the lines as they are written,
and each statement as C has it. Integers are computed in 64 bits, or in 128 where the bounds of operands or
result need them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import (
    COMPARISONS,
    Admit,
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Literal,
    Local,
    Op,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Single,
    Statement,
    ToElement,
    ToLeaf,
    ToLocal,
    Value,
    Variable,
    key_bounds,
    value_of_key,
)
from rcsc.lang.operator_table import is_logic

INFIX = {
    Op.EQ: "==", Op.NE: "!=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=", Op.XOR: "!=", Op.AND: "&&", Op.OR: "||",
    Op.ADD: "+", Op.SUB: "-", Op.MUL: "*", Op.DIV: "/", Op.MOD: "%",
}  # fmt: skip

WIDTHS = (("int64_t", 63), ("ref_wide", 127))


def c_type(*kinds: Scalar) -> str:
    """The C type in which values of all these kinds are computed."""
    reals = [kind for kind in kinds if isinstance(kind, Real)]
    if reals:
        return "float" if all(isinstance(kind, Single) for kind in reals) else "double"
    ints = [kind for kind in kinds if isinstance(kind, Int)]
    low = min((kind.low for kind in ints), default=0)
    high = max((kind.high for kind in ints), default=0)
    fits = (name for name, bits in WIDTHS if -(1 << bits) < low and high < 1 << bits)
    return next(fits, "ref_wide")


def constant(kind: Scalar, value: Value) -> str:
    """`value` as a C constant of `c_type(kind)`."""
    if isinstance(kind, Real):
        return f"({float(value).hex()}{'f' if isinstance(kind, Single) else ''})"
    number = int(value)
    if abs(number) < 1 << 31:
        return f"({number})"
    if abs(number) < 1 << 63:
        return f"({'-' if number < 0 else ''}INT64_C({abs(number)}))"
    magnitude = f"((ref_wide)UINT64_C({abs(number)}))"
    return f"(-{magnitude})" if number < 0 else magnitude


def bounds(variable: Variable) -> tuple[str, str]:
    """The declared bounds as C constants."""
    low, high = (value_of_key(variable.type, key) for key in key_bounds(variable.type))
    return constant(variable.type, low), constant(variable.type, high)


def outside_tests(variable: Variable, place: str, leaf_type: str) -> tuple[str, str]:
    """Below and above the declared range, compared in a type that holds the leaf and both bounds."""
    low, high = bounds(variable)
    if isinstance(variable.type, Real):
        return f"{place} < {low}", f"{place} > {high}"
    wide = "ref_wide" if leaf_type == "uint64_t" else "int64_t"
    return f"({wide}){place} < ({wide}){low}", f"({wide}){place} > ({wide}){high}"


def refusal(variable: Variable, place: str, leaf_type: str, refused: str) -> Iterator[str]:
    """Gives `refused` back where the value at `place` is not admitted."""
    if isinstance(variable.type, Real):
        yield f"if ({place} != {place}) {{ return {refused}; }}"
    if variable.admit is Admit.REJECT:
        for test in outside_tests(variable, place, leaf_type):
            yield f"if ({test}) {{ return {refused}; }}"


def settling(variable: Variable, place: str, leaf_type: str) -> Iterator[str]:
    """Clamps where declared; reals lose the sign of zero."""
    if variable.admit is Admit.CLAMP:
        (below, above), (low, high) = outside_tests(variable, place, leaf_type), bounds(variable)
        yield f"if ({below}) {{ {place} = ({leaf_type}){low}; }}"
        yield f"else if ({above}) {{ {place} = ({leaf_type}){high}; }}"
    if isinstance(variable.type, Real):
        yield f"{place} = {_without_sign(variable.type, place)};"


def _without_sign(kind: Real, text: str) -> str:
    """The value, without the sign of a zero."""
    return f"ref_zero{'_f' if isinstance(kind, Single) else ''}({text})"


def admission(variable: Variable, place: str, leaf_type: str, refused: str) -> Iterator[str]:
    """Admits the value at `place`, or gives `refused` back."""
    yield from refusal(variable, place, leaf_type, refused)
    yield from settling(variable, place, leaf_type)


@dataclass(slots=True)
class Writer:
    """Spells one program; `selects` collects the element accesses that need a function."""

    program: Program
    symbols: Symbols
    selects: dict[tuple[str, ...], int] = field(default_factory=dict)

    def place(self, name: str) -> str:
        """The leaf as a C lvalue of the struct that `s` points to."""
        return f"s->{self.symbols.path(name)}"

    def expr(self, expr: Expr) -> str:
        """The value of `expr` as a C expression of type `c_type(expr.type)`."""
        match expr:
            case Literal(value=value, type=kind):
                return constant(kind, value)
            case Read(name=name, type=kind):
                return f"(({c_type(kind)}){self.place(name)})"
            case ReadLocal(name=name):
                return f"v_{name}"
            case Select(leaves=leaves, index=index, type=kind):
                which = self.selects.setdefault(tuple(leaves), len(self.selects))
                return f"(({c_type(kind)})ref_get{which}(s, (int64_t){self.expr(index)}))"
            case Among(subject=subject, values=values):
                kind, text = subject.type, self.expr(subject)
                tests = [f"{text} == {constant(kind, value)}" for value in values]
                return f"({' || '.join(tests) or '0'})"
            case Apply(op=op, args=args, type=kind):
                return self.apply(op, args, kind)

    def apply(self, op: Op, args: tuple[Expr, ...], kind: Scalar) -> str:
        """An operator and its operands."""
        if op in COMPARISONS:
            wide = c_type(*(arg.type for arg in args))
        elif op in (Op.TO_INT, Op.TO_REAL, Op.TO_SINGLE):
            return f"(({c_type(kind)}){self.expr(args[0])})"
        elif is_logic(op) or op is Op.NOT:
            wide = "int32_t"
        else:
            wide = c_type(kind, *(arg.type for arg in args))
        operands = [f"({wide}){self.expr(arg)}" for arg in args]
        if op in INFIX:
            return f"(({c_type(kind)})({operands[0]} {INFIX[op]} {operands[1]}))"
        if op is Op.IMPLIES:
            return f"(!{operands[0]} || {operands[1]})"
        if op is Op.NOT:
            return f"(!{operands[0]})"
        if op is Op.NEG:
            return f"(({c_type(kind)})(-{operands[0]}))"
        return f"(({c_type(kind)})ref_{op.value}_{wide}({', '.join(operands)}))"

    def statements(self, body: Iterable[Statement]) -> Iterator[str]:
        """The statements as C, one line each."""
        for statement in body:
            yield from self.statement(statement)

    def statement(self, statement: Statement) -> Iterator[str]:
        """One statement."""
        match statement:
            case Assign(place=place, value=value):
                yield self.assign(place, value)
            case Local(name=name, type=kind, value=value):
                first = (
                    constant(kind, value_of_key(kind, key_bounds(kind)[0]))
                    if value is None
                    else self.expr(value)
                )
                yield f"{c_type(kind)} v_{name} = {self.settled(kind, first)}; (void)v_{name};"
            case If(condition=condition, then=then, orelse=orelse):
                yield f"if ({self.expr(condition)}) {{"
                yield from self.statements(then)
                yield "} else {"
                yield from self.statements(orelse)
                yield "}"
            case Case(subject=subject, arms=arms, orelse=orelse):
                yield f"{{ const {c_type(subject.type)} subject = {self.expr(subject)}; (void)subject;"
                for arm in arms:
                    tests = [f"subject == {constant(subject.type, value)}" for value in arm.values]
                    yield f"if ({' || '.join(tests) or '0'}) {{"
                    yield from self.statements(arm.body)
                    yield "} else"
                yield "{"
                yield from self.statements(orelse)
                yield "} }"
            case For(name=name, low=low, high=high, body=body):
                wide, first = c_type(Int(low, high)), constant(Int(low, high), low)
                yield f"for (int64_t i_{name} = 0; i_{name} < {max(high - low + 1, 0)}; i_{name}++) {{"
                yield f"const {wide} v_{name} = ({wide})({first} + ({wide})i_{name}); (void)v_{name};"
                yield from self.statements(body)
                yield "}"
            case Call(procedure=procedure, args=args):
                kinds = (p.type for p in self.program.procedures[self.number(procedure)].params)
                yield self.call(
                    procedure, [self.settled(k, self.expr(a)) for k, a in zip(kinds, args, strict=True)]
                )

    def call(self, procedure: str, args: list[str]) -> str:
        """A call that stops the caller where an extern's results are refused."""
        number = self.number(procedure)
        return f"{{ const int at = ref_p{number}({', '.join(['s', *args])}); if (at != 0) {{ return at; }} }}"

    def number(self, procedure: str) -> int:
        """Position of the procedure in the program."""
        return next(i for i, p in enumerate(self.program.procedures) if p.name == procedure)

    def settled(self, kind: Scalar, text: str) -> str:
        """A stored value: reals lose the sign of zero."""
        return _without_sign(kind, text) if isinstance(kind, Real) else f"({c_type(kind)}){text}"

    def assign(self, place: ToLeaf | ToElement | ToLocal, value: Expr) -> str:
        """One assignment."""
        text = self.settled(place.type, self.expr(value))
        match place:
            case ToLeaf(name=name):
                return f"{self.place(name)} = ({self.symbols.c_type(name)})({text});"
            case ToLocal(name=name):
                return f"v_{name} = {text};"
            case ToElement(leaves=leaves, index=index):
                which = self.selects.setdefault(tuple(leaves), len(self.selects))
                return f"ref_set{which}(s, (int64_t){self.expr(index)}, {text});"

    def procedure(self, number: int, procedure: Procedure) -> Iterator[str]:
        """One procedure: 0 when it ran to its end, else 1 and the position of the leaf refused."""
        params = "".join(f", {c_type(p.type)} v_{p.name}" for p in procedure.params)
        yield f"static int ref_p{number}({self.symbols.struct} *s{params}) {{"
        yield "".join(f"(void)v_{p.name};" for p in procedure.params) + "(void)s;"
        if procedure.extern is not None:
            yield from self.extern(procedure, procedure.extern.c)
        yield from self.statements(procedure.body)
        yield "return 0; }"

    def extern(self, procedure: Procedure, function: str) -> Iterator[str]:
        """A call of the user's C function, whose results are admitted one by one, in order."""
        given = [self.place(name) for name in procedure.reads] + [f"v_{p.name}" for p in procedure.params]
        for at, name in enumerate(procedure.writes):
            yield f"{self.symbols.c_type(name)} w{at} = {self.place(name)};"
        yield f"{function}({', '.join([*given, *(f'&w{at}' for at, _ in enumerate(procedure.writes))])});"
        for at, name in enumerate(procedure.writes):
            variable, refused = self.program.variable(name), str(1 + self.symbols.fault_at(name))
            yield from admission(variable, f"w{at}", self.symbols.c_type(name), refused)
            yield f"{self.place(name)} = w{at};"

    def accessors(self) -> Iterator[str]:
        """The functions that find an array's element by its number."""
        for leaves, which in self.selects.items():
            kind = self.program.variable(leaves[0]).type
            kind_c = c_type(kind)
            yield f"static {kind_c} ref_get{which}(const {self.symbols.struct} *s, int64_t at) {{"
            yield f"{kind_c} found = 0; switch (at) {{"
            yield from (
                f"case {i}: found = ({kind_c}){self.place(leaf)}; break;" for i, leaf in enumerate(leaves)
            )
            yield "default: break; } return found; }"
            yield f"static void ref_set{which}({self.symbols.struct} *s, int64_t at, {kind_c} to) {{"
            yield "switch (at) {"
            for i, leaf in enumerate(leaves):
                yield f"case {i}: {self.place(leaf)} = ({self.symbols.c_type(leaf)})to; break;"
            yield "default: break; } }"
