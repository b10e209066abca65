"""Conditions as Boolean combinations of atoms `form in intervals`, in one canonical spelling.

In: conditions of the model. Out: `Formula`s over a `Universe` of columns and forms. A *column*
is a leaf, or a term that is not linear (a product of variables, `mod`, a computed element, real
arithmetic), each with the bounds of its key. A *form* is a primitive integer combination of
columns whose first coefficient is positive, so that `2*y <= 2*x + 3` and `x - y >= -1` meet in one
form and one bound. Two doubles compare as their keys do, which is linear as well.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from rcsc.lang.interval_sets import joined, meet, scaled
from rcsc.lang.leaves import conjuncts, parts
from rcsc.lang.meaning import spelled
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Box,
    Expr,
    Int,
    Literal,
    Program,
    Read,
    Real,
    Table,
    Test,
    key_bounds,
    key_of,
)
from rcsc.lang.operator_table import (
    OPPOSITE,
    UNDECIDED,
    Comparison,
    Op,
    Signed,
    is_comparison,
    is_logic,
    truth_function,
)

Form: TypeAlias = tuple[tuple[int, int], ...]
"""Columns and their coefficients: sorted, none zero, the first positive, greatest divisor 1."""


@dataclass(frozen=True, slots=True)
class Atom:
    """The form's value lies in one of the intervals; neither none nor all of its range."""

    form: int
    box: Box


@dataclass(frozen=True, slots=True)
class Every:
    """All parts hold; true when there are none."""

    parts: "tuple[Formula, ...]"


@dataclass(frozen=True, slots=True)
class Some:
    """A part holds; false when there are none."""

    parts: "tuple[Formula, ...]"


Formula: TypeAlias = Atom | Every | Some
TRUE, FALSE = Every(()), Some(())


@dataclass(frozen=True, slots=True)
class FormColumn:
    """What a form is made of: the term, its name in certificates, the bounds of its key."""

    name: str
    term: Expr
    low: int
    high: int

    @property
    def opaque(self) -> bool:
        """Whether more is known of it than its bounds: it depends on other columns."""
        return not isinstance(self.term, Read)


@dataclass(frozen=True, slots=True)
class Clauses:
    """A line or an assumption as a conjunction: one box a form, and what is not an atom."""

    boxes: tuple[tuple[int, Box], ...]
    rest: tuple[Formula, ...]
    impossible: bool = False


class Universe:
    """The columns and forms of one table, numbered as they are met.

    Every column is also a form: `single[column]`.
    """

    def __init__(self) -> None:
        self.columns: list[FormColumn] = []
        self.forms: list[Form] = []
        self.low: list[int] = []
        self.high: list[int] = []
        self.single: list[int] = []
        self._column: dict[str, int] = {}
        self._form: dict[Form, int] = {}
        self._known: dict[tuple[int, bool], tuple[Expr, Formula]] = {}

    def column(self, term: Expr) -> int:
        """The number of `term`, entered when new."""
        name = spelled(term)
        known = self._column.get(name)
        if known is None:
            known = self._column[name] = len(self.columns)
            low, high = key_bounds(term.type)
            self.columns.append(FormColumn(name, term, low, high))
            self.single.append(self.form(((known, 1),)))
        return known

    def form(self, form: Form) -> int:
        """The number of `form`, entered when new."""
        known = self._form.get(form)
        if known is None:
            known = self._form[form] = len(self.forms)
            self.forms.append(form)
            ends = [sorted((k * self.columns[c].low, k * self.columns[c].high)) for c, k in form]
            self.low.append(sum(low for low, _ in ends))
            self.high.append(sum(high for _, high in ends))
        return known

    def atom(self, form: int, box: Iterable[tuple[int, int]]) -> Formula:
        """`form in box`, clipped to the form's range; a constant where that decides it."""
        low, high = self.low[form], self.high[form]
        clipped = tuple((max(a, low), min(b, high)) for a, b in box if a <= high and b >= low and a <= b)
        if not clipped:
            return FALSE
        return TRUE if clipped == ((low, high),) else Atom(form, clipped)

    def of_test(self, test: Test) -> Formula:
        """A cell's condition; where `resolve` found it to be a box, that box."""
        if test.box is None:
            return self.of(test.condition)
        reads = _reads(test.condition, test.variables[0])
        return self.atom(self.single[self.column(reads)], test.box)

    def of(self, condition: Expr, wanted: bool = True) -> Formula:
        """`condition = wanted` with negations pushed into the atoms."""
        match condition:
            case Literal(value=value):
                return TRUE if bool(value) == wanted else FALSE
            case Apply(op=Op.NOT, args=(part,)):
                return self.of(part, not wanted)
            case Apply(op=Op.AND) if wanted:
                return every(map(self.of, conjuncts(condition)))
            case Apply(op=op) if is_logic(op) and _written_out(condition) > MOST_WRITTEN_OUT:
                return self._truth(condition, wanted)
            case Apply(op=op, args=(left, right)) if is_logic(op):
                return self._truths(op, left, right)(wanted)
            case Apply(op=op, args=(left, right)) if is_comparison(op):
                known = self._known.get((id(condition), wanted))  # lines share conditions
                if known is None:
                    formula = self._comparison(condition, left, right, op if wanted else OPPOSITE[op], wanted)
                    known = self._known[id(condition), wanted] = condition, formula
                return known[1]
            case Among(subject=subject, values=values):
                keys = [key_of(subject.type, value) for value in values]
                return self._among(condition, subject, keys, wanted)
            case _:
                return self._truth(condition, wanted)

    def _truths(self, op: Op, left: Expr, right: Expr) -> Signed[Formula]:
        return truth_function(op, partial(self.of, left), partial(self.of, right), every, some)

    def _truth(self, condition: Expr, wanted: bool) -> Formula:
        return self.atom(self.single[self.column(condition)], ((int(wanted), int(wanted)),))

    def _comparison(self, whole: Expr, left: Expr, right: Expr, op: Comparison, wanted: bool) -> Formula:
        if isinstance(left.type, Bool) and not (_is_plain(left) and _is_plain(right)):
            if _written_out(whole) > MOST_WRITTEN_OUT:
                return self._truth(whole, wanted)
            return self._truths(op, left, right)(True)
        if not (_is_finite(left) and _is_finite(right)):
            return self._truth(whole, wanted)
        coefficients, constant = self.linear(left)
        others, other = self.linear(right)
        for column, k in others.items():
            coefficients[column] = coefficients.get(column, 0) - k
        return self._against(coefficients, op, other - constant)

    def _among(self, whole: Expr, subject: Expr, keys: list[int], wanted: bool) -> Formula:
        if not _is_finite(subject):
            return self._truth(whole, wanted)
        coefficients, constant = self.linear(subject)
        parts = [
            self._against(dict(coefficients), Op.EQ if wanted else Op.NE, key - constant) for key in keys
        ]
        return some(parts) if wanted else every(parts)

    def _against(self, coefficients: dict[int, int], op: Comparison, bound: int) -> Formula:
        """`sum of coefficients op bound`, divided through and rounded to integers."""
        terms = sorted((column, k) for column, k in coefficients.items() if k)
        if not terms:
            return TRUE if op.meaning(0, bound) else FALSE
        divisor = math.gcd(*(k for _, k in terms))
        divisor = -divisor if terms[0][1] < 0 else divisor
        form = self.form(tuple((column, k // divisor) for column, k in terms))
        return self.atom(form, scaled(op, divisor, bound, self.low[form], self.high[form]))

    def linear(self, expr: Expr) -> tuple[dict[int, int], int]:
        """Coefficients of columns, and a constant, that add up to the key of `expr`."""
        match expr:
            case Literal(value=value, type=kind):
                return {}, key_of(kind, value)
            case Apply(op=Op.NEG, args=(part,)):
                return _scaled(self.linear(part), -1)
            case Apply(op=Op.ADD | Op.SUB as op, args=(left, right), type=Int()):
                sign = 1 if op is Op.ADD else -1
                return _sum(self.linear(left), _scaled(self.linear(right), sign))
            case Apply(op=Op.MUL, args=(left, right), type=Int()):
                for factor, other in ((left, right), (right, left)):
                    coefficients, constant = self.linear(factor)
                    if not any(coefficients.values()):
                        return _scaled(self.linear(other), constant)
        return {self.column(expr): 1}, 0


def every(parts: Iterable[Formula]) -> Formula:
    """The conjunction, flattened."""
    kept: dict[Formula, None] = {}
    for part in parts:
        if part == FALSE:
            return FALSE
        kept.update(dict.fromkeys(part.parts if isinstance(part, Every) else (part,)))
    return next(iter(kept)) if len(kept) == 1 else Every(tuple(kept))


def some(parts: Iterable[Formula]) -> Formula:
    """The disjunction, flattened; atoms of one form become one atom of all their intervals."""
    kept: dict[Formula, None] = {}
    for part in parts:
        if part == TRUE:
            return TRUE
        kept.update(dict.fromkeys(part.parts if isinstance(part, Some) else (part,)))
    atoms = [part for part in kept if isinstance(part, Atom)]
    formulas: list[Formula] = [
        Atom(form, joined(interval for atom in atoms if atom.form == form for interval in atom.box))
        for form in sorted({atom.form for atom in atoms})
    ]
    formulas += [part for part in kept if not isinstance(part, Atom)]
    return formulas[0] if len(formulas) == 1 else Some(tuple(formulas))


def clauses(formulas: Iterable[Formula]) -> Clauses:
    """The conjunction of `formulas`, with at most one box a form."""
    whole = every(formulas)
    boxes: dict[int, Box] = {}
    rest: list[Formula] = []
    for part in whole.parts if isinstance(whole, Every) else (whole,):
        if isinstance(part, Atom):
            boxes[part.form] = meet(boxes[part.form], part.box) if part.form in boxes else part.box
        else:
            rest.append(part)
    impossible = whole == FALSE or any(not box for box in boxes.values())
    return Clauses(tuple(sorted(boxes.items())), tuple(rest), impossible)


def lines_of(universe: Universe, table: Table) -> list[Clauses]:
    """Every line of the table as clauses."""
    known: dict[int, Formula] = {}
    lines = []
    for line in table.lines:
        parts = []
        for test in line.tests:
            if test is not None:
                if id(test) not in known:
                    known[id(test)] = universe.of_test(test)
                parts.append(known[id(test)])
        lines.append(clauses(parts))
    return lines


def assumptions_of(universe: Universe, program: Program, table: Table) -> list[Clauses]:
    """Every assumption that the table may use, in the table's order, as clauses."""
    conditions = {assumption.name: assumption.condition for assumption in program.assumptions}
    return [clauses((universe.of(conditions[name]),)) for name in table.assumptions]


MOST_WRITTEN_OUT = 4096
"""Atoms of a condition; one that would need more stands for itself, and is left to the solver."""


def _written_out(condition: Expr) -> int:
    """Count a condition's atoms in negation normal form: each `xor` and each equality of truths doubles them."""
    match condition:
        case Apply(op=Op.NOT, args=(part,)):
            return _written_out(part)
        case Apply(op=op, args=(left, right)) if is_logic(op):
            return (_written_out(left) + _written_out(right)) * (1 if len(UNDECIDED[op]) == 1 else 2)
        case Apply(op=op, args=(left, right)) if is_comparison(op) and isinstance(left.type, Bool):
            return 2 * (_written_out(left) + _written_out(right))
        case _:
            return 1


def _is_plain(expr: Expr) -> bool:
    return not isinstance(expr, Apply | Among)


def _is_finite(expr: Expr) -> bool:
    """Whether no NaN or infinity can arise in `expr`: then its key orders it."""
    if not isinstance(expr.type, Real):
        return True
    return math.isfinite(expr.type.low) and math.isfinite(expr.type.high)


def _reads(condition: Expr, name: str) -> Read:
    """The read of leaf `name` in `condition`."""
    return next(part for part in parts(condition) if isinstance(part, Read) and part.name == name)


def _scaled(sum_: tuple[dict[int, int], int], factor: int) -> tuple[dict[int, int], int]:
    return {column: k * factor for column, k in sum_[0].items()}, sum_[1] * factor


def _sum(left: tuple[dict[int, int], int], right: tuple[dict[int, int], int]) -> tuple[dict[int, int], int]:
    total = dict(left[0])
    for column, k in right[0].items():
        total[column] = total.get(column, 0) + k
    return total, left[1] + right[1]
