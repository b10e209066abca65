"""Expressions of the model as solver terms, and the least witness.

In: a program's leaves and expressions. Out: terms whose values are exactly `interpret.evaluate`'s wherever
that is defined; that it is defined is proved apart (`obligations`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.model import (
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Literal,
    Op,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.prove import smt
from rcsc.prove.smt import Answer, Solver, Term

_ORDER: Mapping[Op, Callable[[Term, Term, Scalar], Term]] = {
    Op.EQ: smt.equal,
    Op.NE: lambda a, b, kind: smt.negation(smt.equal(a, b, kind)),
    Op.LT: smt.below,
    Op.LE: smt.at_most,
    Op.GT: lambda a, b, kind: smt.below(b, a, kind),
    Op.GE: lambda a, b, kind: smt.at_most(b, a, kind),
}


@dataclass(slots=True)
class Frame:
    """The term of every leaf and local at one point of a run."""

    leaves: dict[str, Term]
    local: dict[str, Term] = field(default_factory=dict)

    def copy(self) -> "Frame":
        """A frame that can go its own way."""
        return Frame(dict(self.leaves), dict(self.local))


def encode(expr: Expr, frame: Frame) -> Term:
    """The term of `expr` in the frame."""
    match expr:
        case Literal(value=value, type=kind):
            return smt.literal(kind, value)
        case Read(name=name):
            return frame.leaves[name]
        case ReadLocal(name=name):
            return frame.local[name]
        case Select(leaves=leaves, index=index):
            at = encode(index, frame)
            found = frame.leaves[leaves[-1]]
            for number in range(len(leaves) - 2, -1, -1):
                here = smt.equal(at, smt.literal(index.type, number), index.type)
                found = smt.choice(here, frame.leaves[leaves[number]], found)
            return found
        case Among(subject=subject, values=values):
            term = encode(subject, frame)
            kind = subject.type
            return smt.any_of([smt.equal(term, smt.literal(kind, value), kind) for value in values])
        case Apply(op=op, args=args):
            return _applied(op, args, [encode(arg, frame) for arg in args])


def _applied(op: Op, args: tuple[Expr, ...], terms: list[Term]) -> Term:
    kind = args[0].type
    match op:
        case Op.NOT:
            return smt.negation(terms[0])
        case Op.AND:
            return smt.all_of(terms)
        case Op.OR:
            return smt.any_of(terms)
        case Op.IMPLIES:
            return smt.implication(terms[0], terms[1])
        case Op.NEG:
            return smt.minus(terms[0], kind)
        case Op.ABS:
            negative = smt.below(terms[0], _zero(kind), kind)
            return smt.choice(negative, smt.minus(terms[0], kind), terms[0])
        case Op.MIN | Op.MAX:
            low = smt.at_most(terms[0], terms[1], kind)
            return smt.choice(low, *(terms if op is Op.MIN else reversed(terms)))
        case Op.TO_REAL:
            return smt.to_double(terms[0])
        case Op.TO_INT:
            return smt.to_integer(terms[0])
        case Op.ADD | Op.SUB | Op.MUL | Op.DIV | Op.MOD:
            operation = smt.double_operation if isinstance(kind, Real) else smt.integer_operation
            return operation(op.value, terms[0], terms[1])
        case _:
            return _ORDER[op](terms[0], terms[1], kind)


def _zero(kind: Scalar) -> Term:
    return smt.literal(kind, 0.0 if isinstance(kind, Real) else 0)


def within(term: Term, kind: Scalar) -> Term:
    """That the term is a value of the kind: in range, and finite."""
    if isinstance(kind, Bool):
        return smt.truth(True)
    low, high = (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)
    bounds = [smt.at_most(smt.literal(kind, low), term, kind), smt.at_most(term, smt.literal(kind, high), kind)]
    return smt.all_of(bounds)


def declared(variables: Iterable[Variable]) -> tuple[Frame, list[Term]]:
    """A frame of fresh constants, one a leaf, and that each is in its range."""
    frame = Frame({})
    domain = []
    for variable in variables:
        frame.leaves[variable.name] = smt.variable(variable.name, variable.type)
        if not isinstance(variable.type, Bool):
            domain.append(within(frame.leaves[variable.name], variable.type))
    return frame, domain


def least_witness(solver: Solver, variables: Iterable[Variable], frame: Frame) -> dict[str, Value] | None:
    """The least values, in declared order, for which what is asserted holds; None where the solver gives up.

    Any model of Z3's may change with its version; the least one depends on the question alone. The solver is
    left with the witness asserted.
    """
    if solver.check() is not Answer.SATISFIABLE:
        return None
    witness: dict[str, Value] = {}
    for variable in variables:
        term, kind = frame.leaves[variable.name], variable.type
        low, high = key_bounds(kind)[0], key_of(kind, solver.value(term, kind))
        while low < high:
            middle = (low + high) // 2
            answer = solver.check(at_most_key(term, kind, middle))
            if answer is Answer.UNKNOWN:
                return None
            if answer is Answer.SATISFIABLE:
                high = min(middle, key_of(kind, solver.value(term, kind)))
            else:
                low = middle + 1
        witness[variable.name] = value_of_key(kind, low)
        solver.add(smt.equal(term, smt.literal(kind, witness[variable.name]), kind))
        if solver.check() is not Answer.SATISFIABLE:
            return None
    return witness


def at_most_key(term: Term, kind: Scalar, key: int) -> Term:
    """That the term's key is at most `key`."""
    if isinstance(kind, Bool):
        return smt.negation(term) if key < 1 else smt.truth(True)
    return smt.at_most(term, smt.literal(kind, value_of_key(kind, key)), kind)
