"""Expressions of the model as solver terms, and the least witness.

In: a program's leaves and expressions. Out: terms whose values are exactly `interpret.evaluate`'s wherever
that is defined; that it is defined is proved apart (`obligations`).
"""

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial

from rcsc.lang.expressions.words import bits_alone, mask_of
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Literal,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Single,
    Value,
    Variable,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import (
    Comparison,
    Op,
    Operator,
    is_comparison,
    is_division,
    is_logic,
    signed,
    truth_function,
)
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.search import lowest
from rcsc.proof.solvers.smt import Answer, Solver, Term


@dataclass(slots=True)
class Frame:
    """The term of every leaf and local at one point of a run.

    Attributes:
        named: Terms by which some expressions are known, besides their leaves.
    """

    leaves: dict[str, Term]
    local: dict[str, Term] = field(default_factory=dict)
    named: dict[Expr, Term] = field(default_factory=dict)


def encode(expr: Expr, frame: Frame) -> Term:
    """Return the term of `expr` in the frame."""
    match expr:
        case Literal(value=value, type=kind):
            return smt.literal(kind, value)
        case Read(name=name):
            return frame.leaves[name]
        case ReadLocal(name=name):
            return frame.local[name]
        case Select(leaves=leaves, index=index):
            at = encode(index, frame)
            selected = frame.leaves[leaves[-1]]
            for number in range(len(leaves) - 2, -1, -1):
                here = smt.equal(at, smt.literal(index.type, number), index.type)
                selected = smt.choice(here, frame.leaves[leaves[number]], selected)
            return selected
        case Among(subject=subject, values=values):
            term = encode(subject, frame)
            kind = subject.type
            return smt.any_of([smt.equal(term, smt.literal(kind, value), kind) for value in values])
        case Apply(op=op, args=(number, Literal(value=by))) if (
            is_division(op) and isinstance(number.type, Int) and number.type.low >= 0 and by > 0
        ):
            return smt.part(op.value, encode(number, frame), int(by))
        case Apply(op=Op.AND, args=(_, Apply(op=Op.EQ | Op.NE) as last)) if mask_of(last) is not None:
            mask = mask_of(expr)
            masked = None if mask is None else smt.masked(encode(mask.word, frame), mask.care, mask.value)
            if masked is not None:
                return masked
            return operation(Op.AND, last.type, [encode(arg, frame) for arg in expr.args])
        case Apply(op=op, args=args):
            if frame.named and isinstance(expr.type, Real) and expr in frame.named:
                return frame.named[expr]
            return operation(op, args[0].type, [encode(arg, frame) for arg in args])


def operation(op: Operator, kind: Scalar, terms: list[Term]) -> Term:
    """Return the term of an operator over operands, the first of which is of type `kind`."""
    if is_logic(op):
        left, right = (signed(term, smt.negation) for term in terms)
        return truth_function(op, left, right, smt.all_of, smt.any_of)(True)
    if is_comparison(op):
        return _comparison(op, terms[0], terms[1], kind)
    match op:
        case Op.NOT:
            return smt.negation(terms[0])
        case Op.NEG:
            return smt.minus(terms[0], kind)
        case Op.ABS:
            return smt.absolute(terms[0], kind)
        case Op.MIN:
            return smt.choice(smt.below(terms[1], terms[0], kind), terms[1], terms[0])
        case Op.MAX:
            return smt.choice(smt.below(terms[0], terms[1], kind), terms[1], terms[0])
        case Op.TO_REAL:
            return smt.to_float(terms[0], kind, Real(0.0, 0.0))
        case Op.TO_SINGLE:
            return smt.to_float(terms[0], kind, Single(0.0, 0.0))
        case Op.TO_INT if isinstance(kind, Bool):
            return smt.choice(terms[0], *(smt.literal(Int(0, 1), number) for number in (1, 0)))
        case Op.TO_INT:
            return smt.to_integer(terms[0])
        case Op.ADD | Op.SUB | Op.MUL | Op.DIV | Op.MOD:
            arithmetic = smt.float_operation if isinstance(kind, Real) else smt.integer_operation
            return arithmetic(op.value, terms[0], terms[1])


def _comparison(op: Comparison, left: Term, right: Term, kind: Scalar) -> Term:
    match op:
        case Op.EQ:
            return smt.equal(left, right, kind)
        case Op.NE:
            return smt.negation(smt.equal(left, right, kind))
        case Op.LT:
            return smt.below(left, right, kind)
        case Op.LE:
            return smt.at_most(left, right, kind)
        case Op.GT:
            return smt.below(right, left, kind)
        case Op.GE:
            return smt.at_most(right, left, kind)


def within(term: Term, kind: Scalar) -> Term:
    """State that the term is a value of the kind: in range, and finite."""
    if isinstance(kind, Bool):
        return smt.truth(True)
    low, high = (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)
    least, greatest = smt.literal(kind, low), smt.literal(kind, high)
    return smt.all_of([smt.at_most(least, term, kind), smt.at_most(term, greatest, kind)])


def declared(variables: Iterable[Variable], conditions: Iterable[Expr] = ()) -> tuple[Frame, list[Term]]:
    """Return a frame of fresh constants, one a leaf, and that each is in its range.

    Args:
        variables: One constant each.
        conditions: What is to be encoded, where all of it is known: words of which it looks at bits alone are bits.
    """
    frame = Frame({})
    domain = []
    every = list(variables)
    words = bits_alone(conditions, {str(variable.name): variable.type for variable in every})
    for variable in every:
        name, kind = variable.name, variable.type
        frame.leaves[name] = smt.word(name, words[name]) if name in words else smt.variable(name, kind)
        if not isinstance(variable.type, Bool):
            domain.append(within(frame.leaves[variable.name], variable.type))
    return frame, domain


def least_where(
    conditions: Iterable[Expr], variables: Iterable[Variable], shown: Iterable[Variable], options: Options
) -> dict[str, Value] | None:
    """Return the least values of the variables shown for which the conditions hold; None where there are none, or none is found."""
    if smt.gives_up("the least input"):
        return None
    every = list(conditions)
    frame, domain = declared(variables, every)
    solver = Solver(options.limits)
    try:
        solver.add(*domain, *(encode(condition, frame) for condition in every))
        return least_witness(solver, shown, frame)
    except smt.troubles():
        return None


def least_witness(
    solver: Solver,
    variables: Iterable[Variable],
    frame: Frame,
    spare: smt.Budget | None = None,
    known: Mapping[str, Value] | None = None,
) -> dict[str, Value] | None:
    """Return the least values, in declared order, for which what is asserted holds; None where none is found.

    Any model of Z3's may change with its version; the least one depends on the question alone. Where the
    solver gives up on the way, the values found last stand: a witness still, but not the least. The solver is
    left with the witness asserted. `spare`: what may be spent once some is known. `known`: such values, where some are; Z3 is not
    asked for others then.
    """
    shown = list(variables)
    if known is not None:
        last: dict[str, int] = {
            variable.name: key_of(variable.type, known[variable.name]) for variable in shown
        }
    elif solver.check() is Answer.SATISFIABLE:
        last = _model(solver, shown, frame)
    else:
        return None

    def up_to(variable: Variable, _low: int, limit: int) -> int | None:
        nonlocal last
        answer = solver.check(at_most_key(frame.leaves[variable.name], variable.type, limit))
        if answer is Answer.SATISFIABLE:
            last = _model(solver, shown, frame)
        return None if answer is Answer.UNSATISFIABLE else last[variable.name]

    for variable in shown:
        term, kind = frame.leaves[variable.name], variable.type
        with nullcontext() if spare is None else smt.within(spare):
            key = lowest(key_bounds(kind)[0], last[variable.name], partial(up_to, variable))
        solver.add(smt.equal(term, smt.literal(kind, value_of_key(kind, key)), kind))
    return {variable.name: value_of_key(variable.type, last[variable.name]) for variable in shown}


def _model(solver: Solver, variables: Iterable[Variable], frame: Frame) -> dict[str, int]:
    return {v.name: key_of(v.type, solver.value(frame.leaves[v.name], v.type)) for v in variables}


def at_most_key(term: Term, kind: Scalar, key: int) -> Term:
    """State that the term's key is at most `key`."""
    if isinstance(kind, Bool):
        return smt.negation(term) if key < 1 else smt.truth(True)
    return smt.at_most(term, smt.literal(kind, value_of_key(kind, key)), kind)
