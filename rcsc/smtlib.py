"""Conditions as SMT-LIB 2, and a second solver to put them to.

In: expressions of the model over a program's leaves. Out: a script whose answer `unsat` says that no
input satisfies them all. Integers are mathematical, doubles are Float64 rounded to nearest even, enum
members their index. The only importer of cvc5.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rcsc.children import interruptible
from rcsc.model import (
    Among,
    Apply,
    Bool,
    Expr,
    Literal,
    Op,
    Program,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Value,
    key_bounds,
    real_of_key,
)
from rcsc.questions import parts

_COMMON = {Op.NOT: "not", Op.AND: "and", Op.OR: "or", Op.IMPLIES: "=>"}
_ON_INTEGERS = {
    Op.EQ: "=", Op.LT: "<", Op.LE: "<=", Op.GT: ">", Op.GE: ">=", Op.NEG: "-", Op.ADD: "+", Op.SUB: "-",
    Op.MUL: "*", Op.DIV: "tdiv", Op.MOD: "tmod", Op.ABS: "abs", Op.MIN: "imin", Op.MAX: "imax",
}  # fmt: skip
_ON_DOUBLES = {
    Op.EQ: "fp.eq", Op.LT: "fp.lt", Op.LE: "fp.leq", Op.GT: "fp.gt", Op.GE: "fp.geq", Op.NEG: "fp.neg",
    Op.ADD: "fp.add RNE", Op.SUB: "fp.sub RNE", Op.MUL: "fp.mul RNE", Op.DIV: "fp.div RNE", Op.ABS: "fp.abs",
    Op.MIN: "fmin", Op.MAX: "fmax",
}  # fmt: skip
PRELUDE = """(set-logic ALL)
(define-fun tdiv ((a Int) (b Int)) Int (ite (= (>= a 0) (> b 0)) (div (abs a) (abs b)) (- (div (abs a) (abs b)))))
(define-fun tmod ((a Int) (b Int)) Int (- a (* b (tdiv a b))))
(define-fun imin ((a Int) (b Int)) Int (ite (< b a) b a))
(define-fun imax ((a Int) (b Int)) Int (ite (> b a) b a))
(define-fun fmin ((a Float64) (b Float64)) Float64 (ite (fp.lt b a) b a))
(define-fun fmax ((a Float64) (b Float64)) Float64 (ite (fp.gt b a) b a))
"""


def script(program: Program, conditions: Sequence[Expr]) -> str:
    """The conditions, over the declared ranges of the leaves they read."""
    read = {part.name for condition in conditions for part in parts(condition) if isinstance(part, Read)}
    read |= {
        leaf
        for condition in conditions
        for part in parts(condition)
        if isinstance(part, Select)
        for leaf in part.leaves
    }
    names = {str(v.name): f"v{i}" for i, v in enumerate(program.variables)}
    text = [PRELUDE, *(_declared(names[v.name], v.type) for v in program.variables if v.name in read)]
    text += [f"(assert {term(condition, names)})\n" for condition in conditions]
    return "".join([*text, "(check-sat)\n"])


def term(expr: Expr, names: Mapping[str, str]) -> str:
    """One expression; `names` says what each leaf is called."""
    match expr:
        case Literal(value=value, type=kind):
            return constant(kind, value)
        case Read(name=name) | ReadLocal(name=name):
            return names[name]
        case Among(subject=subject, values=values):
            inner = term(subject, names)
            same = "fp.eq" if isinstance(subject.type, Real) else "="
            return (
                "(or false " + " ".join(f"({same} {inner} {constant(subject.type, v)})" for v in values) + ")"
            )
        case Select(leaves=leaves, index=index):
            found, at = names[leaves[-1]], term(index, names)
            for i, leaf in reversed(list(enumerate(leaves[:-1]))):
                found = f"(ite (= {at} {i}) {names[leaf]} {found})"
            return found
        case Apply(op=op, args=args):
            return _applied(op, args, [term(arg, names) for arg in args])


def constant(kind: Scalar, value: Value) -> str:
    """A value as a literal."""
    if isinstance(kind, Bool):
        return "true" if value else "false"
    if isinstance(kind, Real):
        bits = f"{struct.unpack('<Q', struct.pack('<d', float(value)))[0]:064b}"
        return f"(fp #b{bits[0]} #b{bits[1:12]} #b{bits[12:]})"
    return str(int(value)) if value >= 0 else f"(- {-int(value)})"


CVC5_STEPS = 20_000_000
"""Budget of cvc5 a question, in its own resource units, of which it uses about a million a second."""


def cvc5_refutes(text: str, steps: int = CVC5_STEPS) -> bool:
    """Whether cvc5 is there and finds the script unsatisfiable within so many of its resource units."""
    return cvc5_says(text, steps) == "unsat"


def cvc5_says(text: str, steps: int = CVC5_STEPS) -> str:
    """cvc5's last answer to the script; "" where cvc5 is not there, or fails."""
    try:
        import cvc5  # type: ignore[import-untyped, unused-ignore]  # optional, and heavy to load
    except ImportError:
        return ""
    solver: Any = cvc5.Solver()
    solver.setOption("rlimit-per", str(steps))
    solver.setOption("tlimit-per", str(steps // 50))  # ms: a backstop, twenty times what the steps take
    reader: Any = cvc5.InputParser(solver)
    reader.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, text, "question")
    symbols = reader.getSymbolManager()
    answer = ""
    try:
        with interruptible():
            while not (command := reader.nextCommand()).isNull():
                answer = command.invoke(solver, symbols)
    except RuntimeError:
        return ""
    return str(answer).strip()


def _applied(op: Op, args: Sequence[Expr], inner: Iterable[str]) -> str:
    shown = " ".join(inner)
    kind = args[0].type
    if op is Op.NE:
        return f"(not ({'fp.eq' if isinstance(kind, Real) else '='} {shown}))"
    if op is Op.TO_REAL:
        return shown if isinstance(kind, Real) else f"((_ to_fp 11 53) RNE (to_real {shown}))"
    if op is Op.TO_INT:
        return (
            shown if not isinstance(kind, Real) else f"(to_int (fp.to_real (fp.roundToIntegral RTZ {shown})))"
        )
    if op in _COMMON:
        return f"({_COMMON[op]} {shown})"
    return f"({(_ON_DOUBLES if isinstance(kind, Real) else _ON_INTEGERS)[op]} {shown})"


def _declared(name: str, kind: Scalar) -> str:
    if isinstance(kind, Bool):
        return f"(declare-const {name} Bool)\n"
    low, high = key_bounds(kind)
    if not isinstance(kind, Real):
        return f"(declare-const {name} Int)\n(assert (and (<= {constant(kind, low)} {name}) (<= {name} {constant(kind, high)})))\n"
    ends = constant(kind, real_of_key(low)), constant(kind, real_of_key(high))
    minus_zero = f"(fp.isNegative {name}) (fp.isZero {name})"
    return (
        f"(declare-const {name} (_ FloatingPoint 11 53))\n"
        f"(assert (and (fp.leq {ends[0]} {name}) (fp.leq {name} {ends[1]}) (not (and {minus_zero}))))\n"
    )
