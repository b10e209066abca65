"""Symbolic runs of statements, and what must be shown of them.

In: statements and a frame of terms. Out: the frame behind them, and a list of obligations: at which place, under what
path, what must not happen. What interval arithmetic already excludes is only counted.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from rcsc.diagnostics.codes import Code
from rcsc.model import (
    I64_MAX,
    I64_MIN,
    U64_MAX,
    Among,
    Apply,
    Arm,
    Assign,
    Bool,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Kind,
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
    key_bounds,
)
from rcsc.prove import smt
from rcsc.prove.encode import Frame, encode, within
from rcsc.prove.smt import Term
from rcsc.source import Span

_ARITHMETIC = frozenset({Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.MOD, Op.NEG, Op.ABS, Op.TO_INT})


@dataclass(frozen=True, slots=True)
class Obligation:
    """Something that must not happen.

    Attributes:
        wrong: True of the inputs for which it happens, path included.
    """

    code: Code
    message: str
    span: Span
    wrong: Term


def ghost(leaf: str) -> str:
    """The frame entry that says whether the present action has written the leaf."""
    return f"wrote!{leaf}"


def fits(kind: Scalar, expr: Expr) -> bool:
    """Whether interval arithmetic shows that the value of `expr` is one of `kind`."""
    found = expr.type
    if isinstance(kind, Int) and isinstance(found, Int) or isinstance(kind, Real) and isinstance(found, Real):
        return kind.low <= found.low and found.high <= kind.high
    return isinstance(found, Bool) or key_bounds(found) == key_bounds(kind)


@dataclass(slots=True)
class Run:
    """One symbolic run.

    Attributes:
        obligations: What is owed, in order met.
        discharged: How many obligations intervals settled.
    """

    program: Program
    obligations: list[Obligation] = field(default_factory=list)
    discharged: int = 0
    _fresh: int = 0
    _procedures: dict[str, Procedure] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._procedures = {procedure.name: procedure for procedure in self.program.procedures}

    # --- what expressions owe ---

    def owe(self, expr: Expr, frame: Frame, path: tuple[Term, ...]) -> None:
        """Adds what evaluating `expr` on this path must not do."""
        match expr:
            case Literal() | Read():
                return
            case ReadLocal(name=name):
                self._assigned(expr, name, frame)
            case Select(leaves=leaves, index=index):
                self.owe(index, frame, path)
                self._index(index, len(leaves), frame, path)
            case Among(subject=subject):
                self.owe(subject, frame, path)
            case Apply(op=op, args=args):
                self.owe(args[0], frame, path)
                if len(args) == 2:
                    self.owe(args[1], frame, (*path, *_reached(op, args[0], frame)))
                if op in (Op.DIV, Op.MOD):
                    self._divisor(expr, args[1], frame, path)
                if op in _ARITHMETIC and isinstance(expr.type, Int):
                    self._in_64_bits(expr, op, args, frame, path)

    def _assigned(self, expr: ReadLocal, name: str, frame: Frame) -> None:
        if name not in frame.local:
            message = f"`{name}` may be read before it is assigned"
            self.obligations.append(Obligation(Code.USE_BEFORE_ASSIGNMENT, message, expr.span, smt.truth(True)))
            frame.local[name] = self.fresh(name, expr.type)

    def _index(self, index: Expr, length: int, frame: Frame, path: tuple[Term, ...]) -> None:
        if isinstance(index.type, Int) and 0 <= index.type.low and index.type.high < length:
            self.discharged += 1
            return
        inside = within(encode(index, frame), Int(0, length - 1))
        self._add(Code.INDEX, f"the index may lie outside 0 .. {length - 1}", index.span, inside, path)

    def _divisor(self, whole: Expr, divisor: Expr, frame: Frame, path: tuple[Term, ...]) -> None:
        kind = divisor.type
        assert isinstance(kind, Int | Real)
        if not kind.low <= 0 <= kind.high:
            self.discharged += 1
            return
        zero = smt.equal(encode(divisor, frame), smt.literal(kind, 0.0 if isinstance(kind, Real) else 0), kind)
        self._add(Code.DIVISION_BY_ZERO, "the divisor may be zero", divisor.span, smt.negation(zero), path)

    def _in_64_bits(self, expr: Expr, op: Op, args: tuple[Expr, ...], frame: Frame, path: tuple[Term, ...]) -> None:
        kind = expr.type
        assert isinstance(kind, Int)
        if I64_MIN <= kind.low and kind.high <= (U64_MAX if kind.low >= 0 else I64_MAX):
            self.discharged += 1
            return
        low, high = (0, U64_MAX) if kind.low >= 0 else (I64_MIN, I64_MAX)
        inside = within(encode(expr, frame), Int(low, high))
        if op is Op.TO_INT:
            inside = smt.all_of([smt.is_finite(encode(args[0], frame)), inside])
        self._add(Code.OVERFLOW, "the result may not fit in 64 bits", expr.span, inside, path)

    def _add(self, code: Code, message: str, span: Span, right: Term, path: Iterable[Term]) -> None:
        self.obligations.append(Obligation(code, message, span, smt.all_of([*path, smt.negation(right)])))

    def fresh(self, name: str, kind: Scalar) -> Term:
        """A new constant."""
        self._fresh += 1
        return smt.variable(f"{name}!{self._fresh}", kind)

    # --- statements ---

    def execute(self, body: Iterable[Statement], frame: Frame, path: tuple[Term, ...]) -> None:
        """Runs statements; the frame is changed in place."""
        for statement in body:
            match statement:
                case Assign(place=place, value=value, span=span):
                    self._assign(place, value, frame, path, span)
                case Local(name=name, type=kind, value=value, span=span):
                    frame.local.pop(name, None)
                    if value is not None:
                        frame.local[name] = self._stored(kind, value, frame, path, f"`{name}`")
                case If(condition=condition, then=then, orelse=orelse):
                    self.owe(condition, frame, path)
                    self._branch(encode(condition, frame), then, orelse, frame, path)
                case Case(subject=subject, arms=arms, orelse=orelse):
                    self.owe(subject, frame, path)
                    self._case(subject, arms, orelse, frame, path)
                case For(name=name, low=low, high=high, body=inner):
                    for count in range(low, high + 1):
                        frame.local[name] = smt.literal(Int(low, high), count)
                        self.execute(inner, frame, path)
                case Call(procedure=name, args=args):
                    self.call(self._procedures[name], args, frame, path)

    def _stored(self, kind: Scalar, value: Expr, frame: Frame, path: tuple[Term, ...], what: str) -> Term:
        """The value, which must be one of `kind`; behind a failed check some value of it."""
        self.owe(value, frame, path)
        term = encode(value, frame)
        if fits(kind, value):
            self.discharged += 1
            return term
        low, high = key_bounds(kind) if not isinstance(kind, Int | Real) else (kind.low, kind.high)
        self._add(Code.ASSIGNED_RANGE, f"the value may lie outside {low} .. {high}, the range of {what}", value.span,
                  within(term, kind), path)  # fmt: skip
        return term

    def _assign(self, place: Place, value: Expr, frame: Frame, path: tuple[Term, ...], span: Span) -> None:
        what = place.leaves[0].partition("[")[0] if isinstance(place, ToElement) else place.name
        term = self._stored(place.type, value, frame, path, f"`{what}`")
        if isinstance(place, ToLeaf):
            frame.leaves[place.name] = term
            frame.leaves[ghost(place.name)] = smt.truth(True)
        elif isinstance(place, ToElement):
            self.owe(place.index, frame, path)
            self._index(place.index, len(place.leaves), frame, path)
            at = encode(place.index, frame)
            for number, leaf in enumerate(place.leaves):
                here = smt.equal(at, smt.literal(place.index.type, number), place.index.type)
                frame.leaves[leaf] = smt.choice(here, term, frame.leaves[leaf])
                before = frame.leaves.get(ghost(leaf), smt.truth(False))
                frame.leaves[ghost(leaf)] = smt.any_of([before, here])
        else:
            frame.local[place.name] = term

    def _branch(
        self,
        condition: Term,
        then: tuple[Statement, ...],
        orelse: tuple[Statement, ...],
        frame: Frame,
        path: tuple[Term, ...],
    ) -> None:
        other = frame.copy()
        self.execute(then, frame, (*path, condition))
        self.execute(orelse, other, (*path, smt.negation(condition)))
        false = smt.truth(False)
        for name in frame.leaves.keys() | other.leaves.keys():
            one, two = frame.leaves.get(name, false), other.leaves.get(name, false)
            frame.leaves[name] = smt.choice(condition, one, two)
        frame.local = {
            name: smt.choice(condition, term, other.local[name]) for name, term in frame.local.items() if name in other.local
        }

    def _case(
        self, subject: Expr, arms: tuple[Arm, ...], orelse: tuple[Statement, ...], frame: Frame, path: tuple[Term, ...]
    ) -> None:
        if not arms:
            self.execute(orelse, frame, path)
            return
        first, rest = arms[0], arms[1:]
        chosen = encode(Among(subject, first.values), frame)
        other = Case(subject, rest, orelse) if rest else None
        # the subject is evaluated once, before any arm: later arms see it through their own copy of the frame
        self._branch(chosen, first.body, (other,) if other else orelse, frame, path)

    def call(self, procedure: Procedure, args: tuple[Expr, ...], frame: Frame, path: tuple[Term, ...]) -> None:
        """Runs a procedure inlined; an extern one gives any values in range."""
        given = {
            param.name: self._stored(param.type, arg, frame, path, f"`{param.name}`")
            for param, arg in zip(procedure.params, args, strict=True)
        }
        if procedure.extern is not None:
            self._extern(procedure, frame)
            return
        outer, frame.local = frame.local, given
        self.execute(procedure.body, frame, path)
        frame.local = outer

    def _extern(self, procedure: Procedure, frame: Frame) -> None:
        kinds = {variable.name: variable.type for variable in self.program.variables}
        for name in procedure.writes:
            term = self.fresh(name, kinds[name])
            frame.leaves[name] = smt.admitted(term, within(term, kinds[name]), smt.literal(kinds[name], _some(kinds[name])))
            frame.leaves[ghost(name)] = smt.truth(True)

    def outputs(self) -> list[str]:
        """Leaves of output variables."""
        return [variable.name for variable in self.program.variables if variable.kind is Kind.OUTPUT]


def _some(kind: Scalar) -> bool | int | float:
    if isinstance(kind, Bool):
        return False
    return kind.low if isinstance(kind, Int | Real) else 0


def _reached(op: Op, left: Expr, frame: Frame) -> tuple[Term, ...]:
    """What must hold for the right operand to be looked at."""
    if op in (Op.AND, Op.IMPLIES):
        return (encode(left, frame),)
    return (smt.negation(encode(left, frame)),) if op is Op.OR else ()
