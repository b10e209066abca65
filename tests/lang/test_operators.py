"""One meaning of each operator: every pair of edge values, in all that folds, computes, proves or spells it.

What `interpret` says is compared with facts of IEEE 754, then all the others are compared with `interpret`.
"""

import math
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import combinations_with_replacement, product
from pathlib import Path
from typing import Any

import pytest
import z3

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.tools import c_compiler, run_command
from rcsc.code.emit.c.ctext import CText, wide_type
from rcsc.code.emit.c.helpers import helper
from rcsc.code.emit.code_tree import IN_C, IN_PYTHON, Invoke, read
from rcsc.code.emit.identifiers import names_of
from rcsc.code.emit.translate import PyText
from rcsc.code.testing.executors.reference import Writer, c_type
from rcsc.code.testing.executors.reference_file import EXTREMES
from rcsc.code.testing.executors.reference_file import PRELUDE as C_PRELUDE
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.lang.expressions import intervals
from rcsc.lang.interpret import evaluate, fold, matching_lines
from rcsc.lang.model import (
    COMPARISONS,
    I64_MAX,
    I64_MIN,
    U64_MAX,
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Literal,
    Op,
    ReadLocal,
    Real,
    Scalar,
    Single,
    Value,
    key_of,
    single_key,
    single_of_key,
)
from rcsc.lang.operator_table import (
    LOGIC,
    Arithmetic,
    Comparison,
    Core,
    _halfway,
    is_comparison,
    single,
    spell_single,
)
from rcsc.proof.certify.execution import Run, Start
from rcsc.proof.certify.settle import script, values_in
from rcsc.proof.certify.values import Term, Terms, sort_of
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.sat import Sat
from rcsc.proof.solvers.smtlib import cvc5_refutes
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import Bits, key_of_bits
from rcsc.proof.symbolic.encode import Frame, encode
from rcsc.proof.symbolic.evaluation import Evaluation
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.measured import Measured
from rcsc.proof.symbolic.values import Node
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.verdict import Gap, Overlap
from rcsc.views.diff.changes.value_text import in_words
from tests.support.programs.stages import emitted, program_of

NAN, INF, GREATEST = math.nan, math.inf, 1.7976931348623157e308
REAL, SIGNED, UNSIGNED = Real(-INF, INF), Int(I64_MIN, I64_MAX), Int(0, U64_MAX)
SINGLE = Single(-INF, INF)
GREATEST_SINGLE, LEAST_SINGLE, LEAST_NORMAL, STEP = 2.0**128 - 2.0**104, 2.0**-149, 2.0**-126, 2.0**-23
HALFWAY = (("halfway", 1),)
"""The unit of operands that are rounded to a single: ties, and what decides them far behind."""
ROUNDED, SIGNED_ROUNDED = Real(-INF, INF, HALFWAY), Int(I64_MIN, I64_MAX, HALFWAY)
UNSIGNED_ROUNDED = Int(0, U64_MAX, HALFWAY)
FINITE = (
    -GREATEST, -1e308, -(2.0**63), -1.0, -0.1, -5e-324, -0.0, 0.0, 5e-324, 2.2250738585072014e-308, 0.1, 1.0, 1.5,
    2.0**53, 2.0**63, 2.0**64, 1e308, GREATEST,
)  # fmt: skip
FEW = (-GREATEST, -1.0, -5e-324, -0.0, 0.0, 5e-324, 0.1, 1.0, 1e308, GREATEST)
EDGES: dict[Scalar, tuple[Value, ...]] = {
    REAL: (NAN, -INF, *FINITE, INF),
    SIGNED: (I64_MIN, I64_MIN + 1, -(2**53) - 1, -7, -1, 0, 1, 2, 7, 2**53 + 1, I64_MAX - 1, I64_MAX),
    UNSIGNED: (0, 1, 2, 7, 2**53 + 1, I64_MAX, I64_MAX + 1, U64_MAX - 1, U64_MAX),
    Bool(): (False, True),
    SINGLE: (
        NAN,
        -INF,
        -GREATEST_SINGLE,
        -1.0,
        -LEAST_SINGLE,
        -0.0,
        0.0,
        LEAST_SINGLE,
        3.0 * LEAST_SINGLE,
        LEAST_NORMAL - LEAST_SINGLE,
        LEAST_NORMAL,
        STEP / 2,
        0.75 * STEP,
        single(0.1),
        0.5,
        1.0 - STEP / 2,
        1.0,
        1.0 + STEP,
        1.5,
        3.0,
        2.0**24 - 1,
        2.0**63,
        2.0**64,
        single(1e38),
        GREATEST_SINGLE,
        INF,
    ),
    ROUNDED: (
        NAN,
        -INF,
        -1e308,
        -1.0 - STEP / 2,
        -5e-324,
        -0.0,
        0.0,
        LEAST_SINGLE / 2,
        math.nextafter(LEAST_SINGLE / 2, 1.0),
        0.1,
        math.nextafter(1.0 + STEP / 2, 0.0),
        1.0 + STEP / 2,
        math.nextafter(1.0 + STEP / 2, 2.0),
        1.0 + 1.5 * STEP,
        LEAST_NORMAL - LEAST_SINGLE / 2,
        GREATEST_SINGLE,
        math.nextafter(2.0**128 - 2.0**103, 0.0),
        2.0**128 - 2.0**103,
        INF,
    ),
    SIGNED_ROUNDED: (
        I64_MIN,
        -(2**62 + 2**38 + 1),
        -(2**62 + 2**38),
        -(2**24) - 1,
        0,
        1,
        2**24 + 1,
        2**24 + 3,
        2**53 + 1,
        2**62 + 2**38,
        2**62 + 2**38 + 1,
        2**62 + 3 * 2**38 - 1,
        I64_MAX,
    ),
    UNSIGNED_ROUNDED: (0, 2**24 + 1, 2**63 + 2**39, 2**63 + 2**39 + 1, 2**63 + 3 * 2**39 - 1, U64_MAX),
}
ON_REALS: tuple[Comparison | Arithmetic, ...] = (
    *sorted(COMPARISONS), Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.MIN, Op.MAX, Op.NEG, Op.ABS,
)  # fmt: skip
UNARY = {Op.NEG, Op.ABS, Op.TO_INT, Op.TO_REAL, Op.TO_SINGLE, Op.NOT}


MEMBERS: dict[Scalar, tuple[Value, ...]] = {
    SIGNED: (-1, 0, 7), REAL: (-0.0, 0.1, 1e308), SINGLE: (-0.0, single(0.1), single(1e38)),
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """An operator on operands of one kind, and the type of its result."""

    op: Op | None  # none: `in` a set
    kind: Scalar
    made: Scalar

    def of(self, *args: Expr) -> Expr:
        if self.op is None:
            return Among(args[0], MEMBERS[self.kind])
        return Apply(self.op, args, self.made)

    @property
    def many(self) -> int:
        return 1 if self.op is None or self.op in UNARY else 2

    def literals(self, operands: tuple[Value, ...]) -> Expr:
        return self.of(*(Literal(value, self.kind) for value in operands))

    def locals(self) -> Expr:
        return self.of(*(ReadLocal(name, self.kind) for name in ("a", "b")[: self.many]))

    def defined(self, operands: tuple[Value, ...]) -> bool:
        """Whether nothing is owed that these operands do not pay."""
        if self.op is Op.DIV and self.kind in (REAL, SINGLE):
            return operands[1] != 0.0
        run = Evaluation({}, {}, {})
        run.evaluate(self.literals(operands))
        return not run.obligations

    def rows(self) -> Iterator[tuple[tuple[Value, ...], Value]]:
        """All operands for which it is defined, with the value that the interpreter gives."""
        for operands in product(EDGES[self.kind], repeat=self.many):
            if self.defined(operands):
                yield operands, evaluate(self.literals(operands), {})


def cases() -> Iterator[Case]:
    for op in ON_REALS:
        yield Case(op, REAL, Bool() if op in COMPARISONS else REAL)
    yield from (Case(Op.TO_INT, REAL, SIGNED), Case(Op.TO_INT, REAL, UNSIGNED), Case(None, REAL, Bool()))
    for kind, op in product((SIGNED, UNSIGNED), (*ON_REALS, Op.MOD)):
        made = Bool() if is_comparison(op) else intervals.apply(op, (kind,) * (1 if op in UNARY else 2), ())
        yield Case(op, kind, made)
    yield Case(Op.TO_INT, Bool(), Int(0, 1))
    yield from (Case(Op.TO_REAL, kind, REAL) for kind in (SIGNED, UNSIGNED))
    yield Case(None, SIGNED, Bool())
    for op in ON_REALS:
        yield Case(op, SINGLE, Bool() if op in COMPARISONS else SINGLE)
    yield from (
        Case(Op.TO_INT, SINGLE, SIGNED),
        Case(Op.TO_INT, SINGLE, UNSIGNED),
        Case(None, SINGLE, Bool()),
    )
    yield Case(Op.TO_REAL, SINGLE, REAL)
    yield from (Case(Op.TO_SINGLE, kind, SINGLE) for kind in (ROUNDED, SIGNED_ROUNDED, UNSIGNED_ROUNDED))
    yield from (Case(op, Bool(), Bool()) for op in (Op.NOT, *sorted(LOGIC), Op.EQ, Op.NE))


EMPTY = program_of("input a : bool\n")
CASES = tuple(cases())
ids = [f"{case.op or 'in'} {type(case.kind).__name__}{at}" for at, case in enumerate(CASES)]


@cache
def rows_of(case: Case) -> tuple[tuple[tuple[Value, ...], Value], ...]:
    """As `Case.rows`, once; not where the file is only read."""
    return tuple(case.rows())


over_cases = pytest.mark.parametrize("case", CASES, ids=ids)


def same(one: Value, two: Value) -> bool:
    """Whether two values are the same; -0.0 is not 0.0, and every NaN is one value."""
    if isinstance(one, float) and isinstance(two, float):
        return (math.isnan(one) and math.isnan(two)) or struct.pack("<d", one) == struct.pack("<d", two)
    return one == two


def different(case: Case, found: Iterable[Value]) -> list[object]:
    """Rows that the interpreter sees otherwise."""
    rows = zip(rows_of(case), found, strict=True)
    return [(operands, value, other) for (operands, value), other in rows if not same(value, other)]


# --- the interpreter ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("op", "operands", "value"),
    [
        (Op.MIN, (NAN, 1.0), NAN), (Op.MIN, (1.0, NAN), 1.0), (Op.MAX, (NAN, 1.0), NAN), (Op.MAX, (1.0, NAN), 1.0),
        (Op.MIN, (0.0, -0.0), 0.0), (Op.MIN, (-0.0, 0.0), -0.0), (Op.MAX, (0.0, -0.0), 0.0), (Op.MAX, (-0.0, 0.0), -0.0),
        (Op.ABS, (-0.0,), 0.0), (Op.ABS, (-INF,), INF), (Op.NEG, (0.0,), -0.0), (Op.NEG, (-0.0,), 0.0),
        (Op.EQ, (NAN, NAN), False), (Op.NE, (NAN, NAN), True), (Op.LE, (NAN, NAN), False), (Op.GE, (1.0, NAN), False),
        (Op.EQ, (-0.0, 0.0), True), (Op.LT, (-0.0, 0.0), False), (Op.SUB, (INF, INF), NAN), (Op.MUL, (0.0, INF), NAN),
        (Op.ADD, (1e308, 1e308), INF), (Op.MUL, (5e-324, 0.1), 0.0), (Op.DIV, (INF, -INF), NAN), (Op.DIV, (-1.0, INF), -0.0),
        (Op.TO_INT, (-0.1,), 0), (Op.TO_INT, (1.5,), 1), (Op.TO_INT, (-1.5,), -1),
    ],
)  # fmt: skip
def test_facts_of_ieee_754(op: Op, operands: tuple[float, ...], value: Value) -> None:
    made = Apply(op, tuple(Literal(operand, REAL) for operand in operands), REAL)
    assert same(evaluate(made, {}), value)
    assert type(evaluate(made, {})) is type(value)


@pytest.mark.parametrize(
    ("op", "operands", "value"),
    [
        (Op.DIV, (-7, 2), -3), (Op.MOD, (-7, 2), -1), (Op.DIV, (7, -2), -3), (Op.MOD, (7, -2), 1),
        (Op.DIV, (I64_MIN, 1), I64_MIN), (Op.TO_REAL, (2**53 + 1,), 2.0**53), (Op.TO_REAL, (I64_MAX,), 2.0**63),
    ],
)  # fmt: skip
def test_facts_of_integers(op: Op, operands: tuple[int, ...], value: Value) -> None:
    assert same(
        evaluate(Apply(op, tuple(Literal(operand, SIGNED) for operand in operands), SIGNED), {}), value
    )


@pytest.mark.parametrize(
    ("op", "operands", "value"),
    [
        (Op.ADD, (1.0, STEP / 2), 1.0), (Op.ADD, (1.0 + STEP, STEP / 2), 1.0 + 2 * STEP), (Op.ADD, (1.0, 0.75 * STEP), 1.0 + STEP),
        (Op.SUB, (1.0, STEP / 8), 1.0), (Op.MUL, (single(0.1), 3.0), 0.30000001192092896), (Op.DIV, (1.0, 3.0), single(1 / 3)),
        (Op.DIV, (LEAST_SINGLE, 2.0), 0.0), (Op.DIV, (3.0 * LEAST_SINGLE, 2.0), 2 * LEAST_SINGLE), (Op.MUL, (-LEAST_SINGLE, 0.5), -0.0),
        (Op.ADD, (GREATEST_SINGLE, GREATEST_SINGLE), INF), (Op.NEG, (LEAST_SINGLE,), -LEAST_SINGLE), (Op.SUB, (INF, INF), NAN),
        (Op.MIN, (NAN, 1.0), NAN), (Op.MAX, (1.0, NAN), 1.0), (Op.TO_REAL, (single(0.1),), 0.10000000149011612), (Op.TO_INT, (-1.5,), -1),
    ],
)  # fmt: skip
def test_facts_of_singles(op: Op, operands: tuple[float, ...], value: Value) -> None:
    made = Apply(op, tuple(Literal(operand, SINGLE) for operand in operands), SINGLE)
    assert same(evaluate(made, {}), value)


def test_two_roundings_of_an_operation_on_singles_are_one() -> None:
    """Against exact fractions, over edges and their neighbours, subnormal results too; a whole number is rounded once."""

    def rounded(exact: Fraction) -> float:
        down = single(float(exact))  # at most one off
        near = [down, single_of_key(single_key(down) - 1), single_of_key(single_key(down) + 1)]
        return min(near, key=lambda one: (abs(Fraction(one) - exact), single_key(one) % 2))

    finite = [value for value in EDGES[SINGLE] if isinstance(value, float) and 0.0 < abs(value) < 2.0**60]
    near = {single_of_key(single_key(value) + by) for value in finite for by in (-1, 0, 1)} - {0.0}
    for op, (a, b) in product((Op.ADD, Op.SUB, Op.MUL, Op.DIV), product(sorted(near), repeat=2)):
        exact = op.meaning(Fraction(a), Fraction(b)) if op is not Op.DIV else Fraction(a) / Fraction(b)
        made = Apply(op, (Literal(a, SINGLE), Literal(b, SINGLE)), SINGLE)
        assert abs(exact) >= 2**127 or evaluate(made, {}) == rounded(exact), (op, a, b)
    for number in (*EDGES[SIGNED_ROUNDED], *EDGES[UNSIGNED_ROUNDED]):
        assert single(number) == rounded(Fraction(number)), number


def test_a_single_is_spelled_as_the_shortest_number_that_is_read_back() -> None:
    assert [spell_single(single(value)) for value in (0.1, 1e38, 16777216.0, -2.5, 1 / 3)] == [
        "0.1", "1e+38", "16777216.0", "-2.5", "0.33333334",
    ]  # fmt: skip
    finite = [float(value) for value in EDGES[SINGLE] if math.isfinite(value)]
    for value in [
        single_of_key(single_key(one) + by) for one in finite for by in (-2, -1, 0, 1, 2) if abs(one) < 1e38
    ]:
        text = spell_single(value)
        exact = abs(Fraction(text) - Fraction(value))
        others = [single_of_key(single_key(value) + by) for by in (-1, 1)]
        assert all(exact < abs(Fraction(text) - Fraction(other)) for other in others), (value, text)


def test_a_double_is_halfway_where_as_far_from_two_singles() -> None:
    found = [_halfway(one) for one in (1.0, 1.0 + 2**-23, 1.0 + 2**-24, -(3.0 + 2**-23), 1e300 * 1e300)]
    assert found == [False, False, True, True, False]


def test_what_no_machine_can_do_is_owed() -> None:
    def defined(op: Op, kind: Scalar, made: Scalar, *operands: Value) -> bool:
        return Case(op, kind, made).defined(operands)

    assert [value for value in EDGES[REAL] if defined(Op.TO_INT, REAL, SIGNED, value)] == [
        value for value in FINITE if -(2.0**63) <= value < 2.0**63
    ]
    assert [value for value in EDGES[REAL] if defined(Op.TO_INT, REAL, UNSIGNED, value)] == [
        value for value in FINITE if -1.0 < value < 2.0**64
    ]
    whole = Int(-(2**127), 2**127)
    assert not defined(Op.DIV, SIGNED, whole, I64_MIN, -1)
    assert not defined(Op.MOD, SIGNED, whole, I64_MIN, -1)
    assert not defined(Op.ABS, SIGNED, whole, I64_MIN)
    assert not defined(Op.NEG, SIGNED, whole, I64_MIN)
    assert not defined(Op.SUB, UNSIGNED, whole, I64_MAX + 1, 1)
    assert not defined(Op.MOD, SIGNED, whole, 1, 0)


# --- folding and bounds ---------------------------------------------------------------------


@over_cases
def test_folding(case: Case) -> None:
    assert different(case, (fold(case.literals(operands)) for operands, _ in rows_of(case))) == []  # type: ignore[misc]  # none is undefined


@over_cases
def test_symbolic_values_fold_to_the_same(case: Case) -> None:
    """Of finite constants; the sign of a zero cannot be seen in any condition, and is not kept."""
    for operands, value in rows_of(case):
        node = Evaluation({}, {}, {}).evaluate(case.literals(operands))
        finite = isinstance(value, float) and not math.isfinite(value)
        if node.known and not finite and all(map(math.isfinite, operands)):
            assert node.low == value, operands
        plain = case.made is Bool() or isinstance(case.kind, Int)
        assert node.known or not plain or not all(map(math.isfinite, operands)), operands


BOUNDED: dict[type[Int | Real], tuple[Value, ...]] = {
    Int: (I64_MIN, -7, -2, -1, 0, 1, 3, 7, I64_MAX),
    Real: (-GREATEST, -1e308, -1.0, -5e-324, -0.0, 0.1, 1.5, 1e308, GREATEST),
    Single: (
        -GREATEST_SINGLE,
        -1.0,
        -LEAST_SINGLE,
        -0.0,
        single(0.1),
        1.0 + STEP,
        single(1e38),
        GREATEST_SINGLE,
    ),
}


@pytest.mark.parametrize("op", [op for op in ON_REALS if op not in COMPARISONS] + [Op.MOD])
@pytest.mark.parametrize("of", BOUNDED)
def test_bounds_enclose_every_result(op: Op, of: type[Int | Real]) -> None:
    if op is Op.MOD and of is not Int:
        return  # not an operator of reals
    found = BOUNDED[of]
    ranges = list(combinations_with_replacement(found, 2))
    for kinds in product(ranges, repeat=1 if op in UNARY else 2):
        made = intervals.apply(op, tuple(of(*one) for one in kinds), ())  # type: ignore[arg-type]  # values of the kind
        assert isinstance(made, Int | Real)
        sides = [[value for value in found if low <= value <= high] for low, high in kinds]
        for operands in product(*sides):
            if op in (Op.DIV, Op.MOD) and operands[1] == 0:
                continue
            kind: Scalar = SIGNED if of is Int else SINGLE if of is Single else REAL
            value = evaluate(Apply(op, tuple(Literal(operand, kind) for operand in operands), kind), {})
            unbounded = not (math.isfinite(made.low) and math.isfinite(made.high))
            assert made.low <= value <= made.high or (unbounded and math.isnan(value)), (kinds, operands)


# --- solvers --------------------------------------------------------------------------------


def z3_value(found: Any, kind: Scalar) -> Value:
    if isinstance(kind, Real):
        if z3.is_true(z3.simplify(z3.fpIsNaN(found))):
            return NAN
        bits = z3.simplify(z3.fpToIEEEBV(found)).as_long()
        sizes = ("<f", "<I") if isinstance(kind, Single) else ("<d", "<Q")
        value: float = struct.unpack(sizes[0], struct.pack(sizes[1], bits))[0]
        return value
    simple = z3.simplify(found)
    return z3.is_true(simple) if isinstance(kind, Bool) else int(simple.as_long())


@over_cases
def test_z3(case: Case) -> None:
    found = (z3_value(encode(case.literals(operands), Frame({})), case.made) for operands, _ in rows_of(case))
    assert different(case, found) == []


class Unfolded(Terms):
    """Terms of the checker of certificates, whose operations on constants are kept."""

    def make(self, op: str, *args: Term) -> Term:
        made = super().make(op, *args)
        return self._interned(Term(op, args, made.sort)) if made.op == "constant" else made


def in_checker(start: Start, case: Case, operands: tuple[Value, ...]) -> Term:
    """The case on constants."""
    run = Run(start, "")
    for name, value in zip(("a", "b"), operands, strict=False):
        run.state.local[name] = start.terms.constant(sort_of(case.kind), value)
    return run.evaluate(case.locals())


@pytest.mark.parametrize("terms", [Terms, Unfolded])
@over_cases
def test_the_checker_of_certificates(case: Case, terms: type[Terms]) -> None:
    """Folded by spans, or computed; the sign of a zero is not kept where it is folded."""
    start = Start(EMPTY)
    start.terms = terms()
    for operands, value in rows_of(case):
        [found] = values_in(in_checker(start, case, operands), {}, 1).tolist()
        assert same(found, value) or (terms is Terms and found == value == 0), operands


def test_cvc5() -> None:
    """That no row differs is one question, in the checker's words; with one row changed it is refuted no more."""
    start = Start(EMPTY)
    start.terms = terms = Unfolded()
    asked = []
    for case in CASES:
        for operands, value in rows_of(case):
            found = in_checker(start, case, operands)
            nothing = isinstance(value, float) and math.isnan(value)
            expected = found if nothing else terms.constant(sort_of(case.made), value)
            equal = terms.make("=", found, expected)
            asked.append(terms.negation(equal) if nothing else equal)
    assert cvc5_refutes(script([terms.negation(terms.every(asked))]))
    assert not cvc5_refutes(script([terms.negation(terms.every((asked[0], terms.negation(asked[-1]))))]))


ORDERED = (Op.LT, Op.LE, Op.EQ, Op.MIN, Op.MAX, Op.NEG, Op.ABS)
"""What the terms of composed levels say exactly of reals; of integers also sums, differences, and `mod` by constants."""


def composed(op: Core, of: str) -> Iterator[tuple[Node, tuple[Value, ...], Value]]:
    """Operations on variables of which nothing is known, with values for them, and the result."""
    whole = of == "int"
    kind, edges = COMPOSED[of]
    known: dict[str, Node] = {}
    for operands in product(edges, repeat=1 if op in UNARY else 2):
        args = tuple(known.setdefault(one, values.variable(f"{one!r}", kind)) for one in map(repr, operands))
        made: Scalar = Bool() if op in COMPARISONS else Int(-(2**41), 2**41) if whole else kind
        node = Node(op, args, made, *((0, 1) if op in COMPARISONS else values.bounds(made)))
        yield (
            node,
            operands,
            evaluate(Apply(op, tuple(Literal(operand, kind) for operand in operands), made), {}),
        )


COMPOSED: dict[str, tuple[Scalar, tuple[Value, ...]]] = {
    "int": (Int(-(2**40), 2**40), (-(2**40), -7, -1, 0, 1, 2, 7, 2**40)),
    "real": (Real(-GREATEST, GREATEST), FEW),
    "single": (
        Single(-GREATEST_SINGLE, GREATEST_SINGLE),
        (-GREATEST_SINGLE, -1.0, -LEAST_SINGLE, -0.0, 0.0, LEAST_SINGLE, single(0.1), 1.0, GREATEST_SINGLE),
    ),
}
composed_cases = pytest.mark.parametrize(
    ("op", "of"),
    [*product(ORDERED, COMPOSED), (Op.ADD, "int"), (Op.SUB, "int")],
)


@composed_cases
@pytest.mark.parametrize("maker", [Keyed, Measured])
def test_terms_of_composed_levels(maker: type[Keyed], op: Core, of: str) -> None:
    terms, solver, wrong = maker(), smt.Solver(), []
    for node, operands, value in composed(op, of):
        for arg, worth in zip(node.args, operands, strict=True):
            solver.add(terms.equal(terms.term(arg), values.constant(arg.kind, worth)))
        wrong.append(smt.negation(terms.equal(terms.term(node), values.constant(node.kind, value))))
    assert terms.guessed == 0
    solver.add(*terms.ranges, smt.any_of(wrong))
    assert solver.check() is smt.Answer.UNSATISFIABLE


@composed_cases
def test_bits_of_composed_levels(op: Core, of: str) -> None:
    rows = list(composed(op, of))
    bits = Bits()
    words = [bits.word(node) for node, _, _ in rows]
    given = [
        bits.equals(bits.word(arg), arg.kind, key_of(arg.kind, value))
        for node, operands, _ in rows
        for arg, value in zip(node.args, operands, strict=True)
    ]
    solver = Sat(bits.clauses)
    assert solver.holds(given)
    for (node, operands, value), word in zip(rows, words, strict=True):
        found = [solver.value(one) for one in word]
        assert (found[0] if isinstance(node.kind, Bool) else key_of_bits(found)) == key_of(
            node.kind, value
        ), operands


@pytest.mark.parametrize("divisor", [1, 2, 3, 7, 8])
def test_remainders_of_composed_levels(divisor: int) -> None:
    """By choice where the value is below twice its divisor, bits where that is a power of two, and any remainder elsewhere."""
    for high in range(3 * divisor):
        kind = Int(0, high)
        number, constant_ = values.variable("x", kind), values.constant(Int(divisor, divisor), divisor)
        node = values.arithmetic(Op.MOD, (number, constant_), Int(0, divisor))
        terms, bits = Keyed(), Bits()
        term_, word = terms.term(node), bits.word(node)
        exact = high < 2 * divisor or divisor in (1, 2, 8)
        assert (terms.guessed == 0) == (exact or node.known)
        for value in range(high + 1):
            solver = smt.Solver()
            solver.add(*terms.ranges, terms.equal(terms.term(number), values.constant(kind, value)))
            rest = values.constant(node.kind, value % divisor)
            assert solver.check(terms.equal(term_, rest)) is smt.Answer.SATISFIABLE, (high, value)
            other = solver.check(smt.negation(terms.equal(term_, rest)))
            assert other is smt.Answer.UNSATISFIABLE or not exact, (high, value)
            given, right = (
                bits.equals(bits.word(number), kind, value),
                bits.equals(word, node.kind, value % divisor),
            )
            clauses = Sat(bits.clauses)
            assert clauses.holds([given, right]), (high, value)
            assert not (exact and clauses.holds([given, -right])), (high, value)


@pytest.mark.parametrize("divisor", [1, 2, 8, 64])
def test_quotients_of_composed_levels_by_powers_of_two(divisor: int) -> None:
    """Exactly, in words and in bits; of what may be negative, and by anything else, any quotient."""
    for high in range(0, 40, 3):
        kind = Int(0, high)
        number, by = values.variable("x", kind), values.constant(Int(divisor, divisor), divisor)
        node = values.arithmetic(Op.DIV, (number, by), Int(0, high))
        terms, bits = Keyed(), Bits()
        quotient, word, given = terms.term(node), bits.word(node), bits.word(number)
        assert terms.guessed == 0
        for value in range(high + 1):
            solver = smt.Solver()
            solver.add(*terms.ranges, terms.equal(terms.term(number), values.constant(kind, value)))
            right = values.constant(node.kind, value // divisor)
            assert solver.check(terms.equal(quotient, right)) is smt.Answer.SATISFIABLE
            assert solver.check(smt.negation(terms.equal(quotient, right))) is smt.Answer.UNSATISFIABLE
            same_number = bits.equals(given, kind, value)
            clauses = Sat(bits.clauses)
            assert clauses.holds([same_number])
            assert key_of_bits([clauses.value(bit) for bit in word]) == value // divisor, (high, value)
    for low, other in ((-1, 8), (0, 6)):
        terms = Keyed()
        number, by = values.variable("x", Int(low, 99)), values.constant(Int(other, other), other)
        terms.term(values.arithmetic(Op.DIV, (number, by), Int(low, 99)))
        assert terms.guessed == 1


# --- executors ------------------------------------------------------------------------------

SMALL = """
input a : real -1.0 .. 1.0
input f : single -1.0 .. 1.0
output n : int 0 .. 9
output r : real -9.0 .. 9.0
table t {
  | line | a     || n            | r                |
  | l    | < 0.0 || 7 / 2 mod 2  | min(a, max(a, a)) |
  | h    | >= 0.0 ||             | abs(a)           |
}
"""


@cache
def python_names() -> dict[str, Any]:
    """The names of an emitted module: its operators among them."""
    names: dict[str, Any] = {}
    module = next(text for path, text in emitted(program_of(SMALL)).items() if path.endswith(".py"))
    exec(compile(module, "emitted", "exec"), names)  # noqa: S102 - our own text
    return names


@over_cases
def test_python(case: Case) -> None:
    spelled = compile(
        IN_PYTHON.code(PyText(names_of(program_of(SMALL))).expr(case.locals())), "expression", "eval"
    )
    given = (dict(zip(("v_a", "v_b"), operands, strict=False)) for operands, _ in rows_of(case))
    found = (eval(spelled, python_names(), one) for one in given)  # noqa: S307 - our own text
    assert different(case, found) == []


def c_program() -> str:
    """A program that writes a line for each row: what the executor's C makes of it, and the reference's."""
    program = program_of(SMALL)
    texts = emitted(program)
    text, writer = CText(names_of(program)), Writer(program, symbols_of(program, texts))
    functions, calls, used = [], [], set[str]()
    for at, case in enumerate(CASES):
        spelled, reference = text.expr(case.locals()), writer.expr(case.locals())
        used |= {invoked.helper for invoked in read(spelled) if isinstance(invoked, Invoke)} - {""}
        for who, body, types in (("c", IN_C.code(spelled), wide_type), ("r", reference, c_type)):
            params = ", ".join(f"{types(case.kind)} v_{name}" for name in ("a", "b")[: case.many])
            functions.append(f"static {c_word(case.made)} {who}_{at}({params}) {{ return {body}; }}")
        rows = ", ".join(
            "{" + ", ".join(c_bits(case.kind, v) for v in operands) + "}" for operands, _ in rows_of(case)
        )
        size = f"[{len(rows_of(case))}][{case.many}]"
        given = ", ".join(c_value(case.kind, f"rows_{at}[i][{one}]") for one in range(case.many))
        functions.append(f"static const uint64_t rows_{at}{size} = {{{rows}}};")
        calls.append(
            f"for (int i = 0; i < {len(rows_of(case))}; i++) {{ show_{c_word(case.made)}(c_{at}({given}), r_{at}({given})); }}"
        )
    helpers = [
        f"static {function.head} {{\n" + "\n".join(IN_C.lines(function.body)) + "\n}"
        for function in (helper(text.names.program, name) for name in sorted(used))
    ]
    extremes = [EXTREMES.format(T=name) for name in ("int32_t", "int64_t", "ref_wide", "double", "float")]
    head = ["#include <stdio.h>\n#include <stdint.h>\n#include <stdbool.h>\n#include <string.h>", SHOW]
    main = "int main(void) {\n" + "\n".join(calls) + "\nreturn 0; }"
    prelude = ["#define REF_ASSUMPTIONS 1", C_PRELUDE]
    return "\n".join([*head, *prelude, *extremes, *helpers, *functions, main])


SHOW = """
static double of_bits(uint64_t u) { double d; memcpy(&d, &u, 8); return d; }
static uint64_t bits_of(double d) { uint64_t u; if (d != d) { return 1; } memcpy(&u, &d, 8); return u; }
static void show_int64_t(int64_t a, int64_t b) { printf("%lld %lld\\n", (long long)a, (long long)b); }
static void show_uint64_t(uint64_t a, uint64_t b) { printf("%llu %llu\\n", (unsigned long long)a, (unsigned long long)b); }
static void show_bool(bool a, bool b) { printf("%d %d\\n", a, b); }
static void show_float(float a, float b) { printf("d%llu d%llu\\n", (unsigned long long)bits_of(a), (unsigned long long)bits_of(b)); }
static void show_double(double a, double b) { printf("d%llu d%llu\\n", (unsigned long long)bits_of(a), (unsigned long long)bits_of(b)); }
"""


def c_word(kind: Scalar) -> str:
    """The 64-bit type of a result."""
    return wide_type(kind)


def c_bits(kind: Scalar, value: Value) -> str:
    if isinstance(kind, Real):
        return f"{struct.unpack('<Q', struct.pack('<d', value))[0]}u"
    return f"{int(value) % 2**64}u"


def c_value(kind: Scalar, bits: str) -> str:
    return f"({wide_type(kind)})of_bits({bits})" if isinstance(kind, Real) else f"({wide_type(kind)}){bits}"


def shown(value: Value, kind: Scalar) -> str:
    if not isinstance(kind, Real):
        return str(int(value))
    number = float(value)
    return f"d{1 if math.isnan(number) else struct.unpack('<Q', struct.pack('<d', number))[0]}"


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
def test_c_and_its_reference(tmp_path: Path) -> None:
    """Under the sanitizer: what is defined by what is owed is defined in C."""
    source, binary = tmp_path / "operators.c", tmp_path / "operators"
    source.write_text(c_program())
    compiler = c_compiler()
    assert isinstance(compiler, str)
    flags = [
        "-std=gnu99",
        "-O0",
        "-w",
        "-ffp-contract=off",
        "-fsanitize=undefined,float-cast-overflow",
        "-fno-sanitize-recover=all",
    ]
    built = run_command([compiler, *flags, "-o", str(binary), str(source)], tmp_path, 120.0)
    assert built.status == 0, built.err[:3000]
    ran = run_command([str(binary)], tmp_path, 60.0)
    assert ran.status == 0, ran.err
    rows = [(case, *row) for case in CASES for row in rows_of(case)]
    found = ran.out.splitlines()
    assert len(found) == len(rows) > 3_000
    wrong = [
        (case.op, operands, value, line)
        for (case, operands, value), line in zip(rows, found, strict=True)
        if line.split() != [shown(value, case.made)] * 2
    ]
    assert wrong == []


# --- tables of conditions that meet infinities and NaN ---------------------------------------

OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "=": "/=", "/=": "="}
NUMBER, NONE = "(x + x)", "((x + x) - (x + x))"  # infinite, and no number, where x is large


@pytest.mark.parametrize("sign", ["<", ">=", "="])
@pytest.mark.parametrize(
    ("one", "two"),
    [(NONE, "1.0"), (NUMBER, NUMBER), (f"-{NONE}", f"-{NONE}")],
)
def test_no_table_is_proved_that_an_edge_refutes(one: str, two: str, sign: str) -> None:
    """Two lines, the second with the opposite sign, or with `not`: only the second way covers a NaN."""
    for other in (
        f"{one} {OPPOSITE[sign]} {two}",
        f"not ({one} {sign} {two})",
    ):
        program = program_of(
            "input x : real -1.7e308 .. 1.7e308\ninput y : real -1.7e308 .. 1.7e308\n"
            f"table t {{\n  | line | when ||\n  | a | {one} {sign} {two} ||\n  | b | {other} ||\n}}\n"
        )
        [table] = program.tables
        edges = (-1.7e308, -1e308, -1.0, 0.0, 1.0, 1e308, 1.7e308)
        matching = [matching_lines(table, {"x": x, "y": y}) for x, y in product(edges, edges)]
        verdict = prove_program(program, Options(steps=20_000, solver="boxes"))
        found = {finding.code for finding in verdict.findings}
        if any(len(one) != 1 for one in matching):
            assert not verdict.proved
        elif other.startswith("not") and Code.DEAD_LINE in found:
            assert found == {Code.DEAD_LINE}
            assert len({line for one in matching for line in one}) == 1
        elif other.startswith("not"):
            assert verdict.proved or verdict.tables[0].undecided


def test_a_line_that_a_nan_does_not_match_leaves_it_to_default() -> None:
    text = (
        "input x : real 8.988465674311579e307 .. 8.98846567431158e307 = 8.988465674311579e307\ntable t {\n  | line | when ||\n"
        "  | a | min((x + x) - (x + x), 1.0) <= 1.0 ||\n  | d | DEFAULT unreachable ||\n}\n"
    )
    program = program_of(text)
    found = prove_program(program, Options()).findings
    assert [finding.code for finding in found] == [Code.DEFAULT_REACHED]
    assert matching_lines(program.tables[0], {"x": 1.7e308}) == []


def test_words_turn_no_comparison_of_what_may_be_no_number() -> None:
    for kind, words in ((Real(-1.0, 1.0), "a >= b"), (REAL, "not (a < b)")):
        one, two = values.variable("a", kind), values.variable("b", kind)
        assert in_words(values.negation(values.compare(Op.LT, one, two))) == words
        assert in_words(values.negation(values.compare(Op.EQ, one, two))) == "a /= b"


FAR = "x * 1e308 * 10.0 - y * 1e308 * 10.0"
NO_NUMBER = {  # two lines, of which none matches what is no number, or both do
    "a difference": (f"{FAR} > 2.0", f"{FAR} <= 2.0", Gap),
    "a whole number beside it": (f"{FAR} > 2.0 or n > 3", f"{FAR} <= 2.0 and n <= 3", Gap),
    "a product": ("x * 1e308 * 10.0 * (y - y) < 0.0", "x * 1e308 * 10.0 * (y - y) >= 0.0", Gap),
    "negations": (f"not ({FAR} > 2.0)", f"not ({FAR} <= 2.0)", Overlap),
}


@pytest.mark.parametrize("kind", NO_NUMBER)
def test_where_no_line_matches_what_is_no_number_an_input_is_tried(kind: str) -> None:
    """Whatever Z3 can tell within so few steps: doubles are slow for it."""
    first, second, wanted = NO_NUMBER[kind]
    program = program_of(
        "input n : int 0 .. 3\ninput x : real -10.0 .. 10.0\ninput y : real -10.0 .. 10.0\nassume low monitored : x <= y + 20.0\n"
        f"table t assuming low {{\n| line | when ||\n| a | {first} ||\n| b | {second} ||\n}}\n"
    )
    found = prove_table(program, program.tables[0], Options(steps=20_000)).findings
    [witness] = [
        wrong.witnesses[0] if isinstance(wrong, Gap) else wrong.witness
        for wrong in found
        if isinstance(wrong, Gap | Overlap) and isinstance(wrong, wanted)
    ]
    assert len(matching_lines(program.tables[0], {"n": 0, **witness})) == (0 if wanted is Gap else 2)


@pytest.mark.parametrize("word", sorted(LOGIC))
def test_a_word_means_the_same_in_a_cell_as_in_a_declaration(word: str) -> None:
    condition = f"a and b {word} c"
    program = program_of(
        f"""\
state a : bool state b : bool state c : bool
invariant said : {condition}
table t {{
  | line  | when        || procedures |
  | holds | {condition} ||            |
  | rest  | DEFAULT     ||            |
}}
level l {{ period 40 [ms] table t }}
"""
    )
    [said] = program.invariants
    for a, b, c in product((False, True), repeat=3):
        given = {"a": a, "b": b, "c": c}
        matched = matching_lines(program.tables[0], given)
        assert (matched == ["holds"]) == evaluate(said.condition, given), given
