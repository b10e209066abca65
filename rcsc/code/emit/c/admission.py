"""Admission of inputs and of results, and the check of a state that comes from outside."""

import re
from collections.abc import Iterator, Sequence
from itertools import groupby

from rcsc.code.emit.c.cprogram import AT, NONE, CProgram, fault_name, first_of, on_state, run_on_state
from rcsc.code.emit.c.ctext import CALLED, c_type
from rcsc.code.emit.code_tree import (
    Body,
    Branch,
    Cast,
    Code,
    Constant,
    Function,
    Invoke,
    Leave,
    Let,
    Line,
    Loop,
    MemberPath,
    Name,
    Prefix,
    Set,
    Stmt,
    infix,
    type_bounds,
    when,
)
from rcsc.code.emit.identifiers import DIGEST, comment
from rcsc.code.emit.translate import FAULT, FAULT_AT, STATE, constant
from rcsc.lang import model
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Bool, Enum, Int, Real, Variable, key_bounds


def trace(c: CProgram, fault: Code, at: Code) -> Body:
    """Return statements that set the trace of a cycle that has run no line."""
    told = {"line": NONE, "fault": fault, "fault_at": at} | dict.fromkeys(c.names.failed, Constant(0))
    return tuple(Set(MemberPath((name,)), value) for name, value in told.items())


def admit_function(c: CProgram, reals: bool) -> Function:
    """Return the function that admits inputs. It refuses first: a refused cycle changes nothing but its trace."""
    inputs = [v for v in c.program.variables if v.kind is model.Kind.INPUT]
    tests = [(Name(c.names.leaves[v.name]), _refused(c, v)) for v in inputs]
    asked = [(leaf, test) for leaf, test in tests if test is not None]
    taken = (*_all_admitted(c, inputs), run_on_state(c, "settle"))
    told = Set(FAULT, fault_name(c, Fault.ADMIT)), Set(FAULT_AT, AT)
    body: Body = taken
    if asked:
        branch = Branch(((infix(">=", AT, Constant(0)), told),), taken)
        free = [v.name for v, (_, test) in zip(inputs, tests, strict=True) if test is None]
        body = (Let("int32_t", "at", NONE), *_untested(free), *first_of(asked), branch)
    if reals:
        inexact = Prefix("!", Invoke(f"{c.p}_exact"))
        body = (Branch(((inexact, (Set(FAULT, fault_name(c, Fault.ARITHMETIC)),)),), body),)
    return on_state(
        c,
        "Admits every input, then settles; a refused one leaves everything else as it was.",
        "admit",
        *trace(c, fault_name(c, Fault.OK), NONE),
        *body,
    )


def _refused(c: CProgram, variable: Variable) -> Code | None:
    """Return the condition that an input is refused; a truth value can be, too, where it is a byte. None where none can be."""
    place = c.text.place(variable.name)
    if c.plan.defensive and isinstance(variable.type, Bool):
        return infix(">", place, Constant(1, "uint32_t"))
    return refusal(c, variable, place)


def _untested(names: Sequence[str]) -> Iterator[Line]:
    """Yield a comment that names the variables without a test, so that a lost test can be told from one that nothing needs."""
    words = dict.fromkeys(comment(re.sub(r"\[\d+\]", "[..]", name)) for name in names)
    if words:
        yield Line(f"/* Not tested, as no value of their types is refused: {', '.join(words)}. */")


def refusal(c: CProgram, variable: Variable, place: Code) -> Code | None:
    """Return the condition that a value is refused; None where none can be. A NaN satisfies no comparison."""
    kind, clamped = variable.type, variable.admit is model.Admit.CLAMP
    if isinstance(kind, Real):
        if not clamped:
            return _beyond(c, kind, place)
        name = f"number_{CALLED[c_type(kind)]}"
        return Prefix("!", Invoke(f"{c.p}_{name}", (place,), "bool", helper=name))
    if isinstance(kind, Bool) or clamped:
        return None
    outside = [test for test, _ in _outside(c, kind, place)]
    return infix("||", *outside) if outside else None


def admitted(c: CProgram, variable: Variable, place: Code) -> Iterator[Stmt]:
    """Yield the statements that admit a value which is not refused: clamp it, and replace -0.0."""
    kind, clamped = variable.type, variable.admit is model.Admit.CLAMP
    if isinstance(kind, Real):
        if clamped:
            low, high = (c.text.constant(kind, end) for end in (kind.low, kind.high))
            yield when(infix("<", place, low), Set(place, low))
            yield when(infix(">", place, high), Set(place, high))
        if kind.low <= 0 <= kind.high:
            yield Set(place, infix("+", place, constant(kind, 0)))
    elif clamped and not isinstance(kind, Bool):
        yield from (when(test, Set(place, end)) for test, end in _outside(c, kind, place))


def _all_admitted(c: CProgram, inputs: Sequence[Variable]) -> Iterator[Stmt]:
    """Yield the statements that admit the inputs; for reals of an array as a loop, so that a compiler keeps no copies on the stack."""
    for (array, kind, _), group in groupby(inputs, lambda v: (_array_of(c, v), v.type, v.admit)):
        leaves = tuple(group)
        if array and isinstance(kind, Real) and len(leaves) > 1 and leaves[0].admit is not model.Admit.CLAMP:
            body = tuple(admitted(c, leaves[0], MemberPath((*array, Name("k")))))
            if body:
                yield Loop("k", 0, len(leaves) - 1, body, type="uint32_t")
        else:
            yield from (stmt for leaf in leaves for stmt in admitted(c, leaf, c.text.place(leaf.name)))


def _array_of(c: CProgram, variable: Variable) -> tuple[str, ...]:
    """Return the path of the array of which the leaf is an element; empty for any other leaf."""
    *array, last = c.names.paths[variable.name]
    return tuple(array) if last.startswith("[") else ()


def _beyond(c: CProgram, kind: Real, place: Code) -> Code:
    """Return the condition that a real is outside its range, or no number."""
    low, high = (c.text.constant(kind, end) for end in (kind.low, kind.high))
    return Prefix("!", infix("&&", infix(">=", place, low), infix("<=", place, high)))


def _outside(c: CProgram, kind: Int | Enum, place: Code) -> list[tuple[Code, Code]]:
    """Return, for each end of the range that the C type exceeds, the test that a value is beyond it, and the end."""
    low, high = key_bounds(kind)
    least, greatest = type_bounds(c_type(kind))
    ends = ((least < low, "<", low), (greatest > high, ">", high))
    shown = ((op, c.text.constant(kind, end)) for passed, op, end in ends if passed)
    return [(infix(op, place, end), end) for op, end in shown]


def check_function(c: CProgram) -> Function:
    """Return the function that checks states and outputs, and the representation of every bool; then the invariants over them."""
    tests = [(Name(c.names.leaves[v.name]), _unfit(c, v)) for v in c.program.variables]
    tests += [
        (Name(name), Prefix("!", c.text.expr(invariant.condition)))
        for name, invariant in zip(c.names.invariants, c.program.invariants, strict=True)
    ]
    own = [
        (v, test)
        for v, test in zip(c.program.variables, tests, strict=False)
        if v.kind is not model.Kind.INPUT
    ]
    foreign = infix("!=", MemberPath((DIGEST,)), Name(c.names.digest))
    asked = [(Name(c.names.checks[1]), foreign), *((at, test) for at, test in tests if test is not None)]
    doc = (
        f"Whether the state may be gone on from: {c.names.checks[0]}; {c.names.checks[1]} where other tables made it; else the position "
        "of the first variable outside its range or, counted after the variables, of the first invariant that does not hold. Call it on "
        "every state that comes from outside."
    )
    body = (
        Let("int32_t", "at", Name(c.names.checks[0])),
        *_untested([v.name for v, (_, test) in own if test is None]),
        *first_of(asked),
        Leave(AT),
    )
    return Function(doc, f"int32_t {c.p}_check(const {c.p}_t *s)", body, origin=c.origin)


def _unfit(c: CProgram, variable: Variable) -> Code | None:
    """Return the condition that the place holds no value of its type; None where its C type or admission rules that out."""
    kind, place = variable.type, c.text.place(variable.name)
    if isinstance(kind, Bool):
        if c.plan.defensive:
            return None if variable.kind is model.Kind.INPUT else infix(">", place, Constant(1, "uint32_t"))
        # read as a byte: as a bool, another than 0 and 1 means nothing
        byte = Prefix("*", Cast("const uint8_t *", Prefix("&", place)))
        return infix(">", byte, Constant(1, "uint32_t"))
    if variable.kind is model.Kind.INPUT:
        return None
    if isinstance(kind, Real):
        return _beyond(c, kind, place)
    outside = [test for test, _ in _outside(c, kind, place)]
    return infix("||", *outside) if outside else None


def begin_functions(c: CProgram) -> Iterator[Function]:
    """Yield the function that begins a cycle of a program that trusts no state: check, then admit."""
    if c.plan.defensive:
        yield on_state(
            c,
            "Checks the state, then admits every input.",
            "begin",
            Let("const int32_t", "at", Invoke(f"{c.p}_check", (STATE,))),
            Branch(
                ((infix("<", AT, Constant(0)), (run_on_state(c, "admit"),)),),
                trace(c, fault_name(c, Fault.STATE), AT),
            ),
        )
