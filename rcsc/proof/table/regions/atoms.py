"""Conditions as Boolean combinations of atoms `form in intervals`, in one canonical spelling.

In: conditions of the model. Out: `Formula`s over a `Universe` of columns and forms. A *column*
is a leaf, or a term that is not linear (a product of variables, `mod`, a computed element, real
arithmetic), each with the bounds of its key. A *form* is a primitive integer combination of
columns whose first coefficient is positive, so that `2*y <= 2*x + 3` and `x - y >= -1` meet in one
form and one bound. Two doubles compare as their keys do, which is linear as well.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TypeAlias

from rcsc.lang.interval_sets import joined, meet, scaled
from rcsc.lang.leaves import conjuncts, is_finite, parts
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
    """A column that forms are sums of: its term, its name in certificates, the bounds of its key."""

    name: str
    term: Expr
    low: int
    high: int

    @property
    def opaque(self) -> bool:
        """Whether the term is not a leaf: it depends on other columns, so that more than its bounds is known."""
        return not isinstance(self.term, Read)


@dataclass(frozen=True, slots=True)
class Clauses:
    """A line or an assumption as a conjunction: one box a form, and the parts that are not atoms."""

    boxes: tuple[tuple[int, Box], ...]
    rest: tuple[Formula, ...]
    impossible: bool = False


class Universe:
    """The columns and forms of one table, numbered as they are met.

    Every column is also a form: `single[column]`.

    Attributes:
        low, high: The least and the greatest value of each form.
        norms: Of each form half the sum of its coefficients, by which rounding may change it, and the sum of their squares.
        opaque: Columns that are not leaves.
    """

    def __init__(self) -> None:
        self.columns: list[FormColumn] = []
        self.forms: list[Form] = []
        self.low: list[int] = []
        self.high: list[int] = []
        self.norms: list[tuple[int, int]] = []
        self.opaque: set[int] = set()
        self.single: list[int] = []
        self._column: dict[str, int] = {}
        self._form: dict[Form, int] = {}
        self._known: dict[tuple[int, bool], tuple[Expr, Formula]] = {}

    def column(self, term: Expr) -> int:
        """Return the number of `term`; a new term is entered."""
        name = term.name if isinstance(term, Read) else spelled(term)
        known = self._column.get(name)
        if known is None:
            known = self._column[name] = len(self.columns)
            low, high = key_bounds(term.type)
            self.columns.append(FormColumn(name, term, low, high))
            if self.columns[-1].opaque:
                self.opaque.add(known)
            self.single.append(self.form(((known, 1),)))
        return known

    def form(self, form: Form) -> int:
        """Return the number of `form`; a new form is entered."""
        known = self._form.get(form)
        if known is None:
            known = self._form[form] = len(self.forms)
            self.forms.append(form)
            low = high = total = square = 0
            for column, k in form:
                of = self.columns[column]
                low += k * (of.low if k > 0 else of.high)
                high += k * (of.high if k > 0 else of.low)
                total, square = total + abs(k), square + k * k
            self.low.append(low)
            self.high.append(high)
            self.norms.append(((total + 1) // 2, square))
        return known

    def atom(self, form: int, box: Iterable[tuple[int, int]]) -> Formula:
        """Return the formula `form in box`, clipped to the form's range; a constant where the range decides it."""
        low, high = self.low[form], self.high[form]
        clipped = tuple((max(a, low), min(b, high)) for a, b in box if a <= high and b >= low and a <= b)
        if not clipped:
            return FALSE
        return TRUE if clipped == ((low, high),) else Atom(form, clipped)

    def of_test(self, test: Test) -> Formula:
        """Return a cell's condition as a formula; where `resolve` found it to be a box, that box."""
        return every(self.parts_of_test(test))

    def parts_of_test(self, test: Test) -> Iterator[Formula]:
        """Yield formulas whose conjunction is a cell's condition."""
        if test.box is None:
            atoms = self._known
            for part in conjuncts(test.condition):
                known = atoms.get((id(part), True))
                yield self.of(part) if known is None else known[1]
        else:
            reads = _reads(test.condition, test.variables[0])
            yield self.atom(self.single[self.column(reads)], test.box)

    def of(self, condition: Expr, wanted: bool = True) -> Formula:
        """Return the formula of `condition = wanted`, with negations pushed into the atoms."""
        match condition:
            case Literal(value=value):
                return TRUE if bool(value) == wanted else FALSE
            case Apply(op=Op.NOT, args=(part,)):
                return self.of(part, not wanted)
            case Apply(op=Op.AND) if wanted:
                return every(map(self.of, conjuncts(condition)))
            case Apply(op=op) if is_logic(op) and _written_out(condition) > MOST_WRITTEN_OUT:
                return self._truth(condition, wanted)
            case Apply(op=Op.AND):  # all of a mask at once: it has a conjunct a bit
                return some(self.of(part, False) for part in conjuncts(condition))
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
        if not (is_finite(left) and is_finite(right)):
            return self._truth(whole, wanted)
        total: dict[int, int] = {}
        constant = self._add(total, left, 1) + self._add(total, right, -1)
        return self._against(total, op, -constant)

    def _among(self, whole: Expr, subject: Expr, keys: list[int], wanted: bool) -> Formula:
        if not is_finite(subject):
            return self._truth(whole, wanted)
        coefficients, constant = self.linear(subject)
        parts = [
            self._against(dict(coefficients), Op.EQ if wanted else Op.NE, key - constant) for key in keys
        ]
        return some(parts) if wanted else every(parts)

    def _against(self, coefficients: dict[int, int], op: Comparison, bound: int) -> Formula:
        """Return the atom of `sum of coefficients op bound`, divided through and rounded to integers."""
        terms = sorted([term for term in coefficients.items() if term[1]])
        if not terms:
            return TRUE if op.meaning(0, bound) else FALSE
        divisor = math.gcd(*[k for _, k in terms])
        divisor = -divisor if terms[0][1] < 0 else divisor
        form = self.form(tuple([(column, k // divisor) for column, k in terms]))
        return self.atom(form, scaled(op, divisor, bound, self.low[form], self.high[form]))

    def linear(self, expr: Expr) -> tuple[dict[int, int], int]:
        """Return coefficients of columns, and a constant, that add up to the key of `expr`."""
        total: dict[int, int] = {}
        constant = self._add(total, expr, 1)
        return total, constant

    def _add(self, total: dict[int, int], expr: Expr, factor: int) -> int:
        """Add the factor times the key of `expr` to the total; return its constant part."""
        if isinstance(expr, Read):
            known = self._column.get(expr.name)  # most often, and very often: hence no call
            column = self.column(expr) if known is None else known
            total[column] = total.get(column, 0) + factor
            return 0
        if isinstance(expr, Literal):
            return factor * key_of(expr.type, expr.value)
        if isinstance(expr, Apply):
            op, args = expr.op, expr.args
            if op is Op.NEG:
                return self._add(total, args[0], -factor)
            if isinstance(expr.type, Int) and (op is Op.ADD or op is Op.SUB):
                second = factor if op is Op.ADD else -factor
                return self._add(total, args[0], factor) + self._add(total, args[1], second)
            if isinstance(expr.type, Int) and op is Op.MUL:
                if isinstance(args[0], Literal):
                    return self._add(total, args[1], factor * key_of(args[0].type, args[0].value))
                for part, other in (args, args[::-1]):
                    coefficients, constant = self.linear(part)
                    if not any(coefficients.values()):
                        return self._add(total, other, factor * constant)
        column = self.column(expr)
        total[column] = total.get(column, 0) + factor
        return 0


def every(parts: Iterable[Formula]) -> Formula:
    """Return the conjunction, flattened."""
    kept: dict[Formula, None] = {}
    for part in parts:
        if part == FALSE:
            return FALSE
        kept.update(dict.fromkeys(part.parts if isinstance(part, Every) else (part,)))
    return next(iter(kept)) if len(kept) == 1 else Every(tuple(kept))


def some(parts: Iterable[Formula]) -> Formula:
    """Return the disjunction, flattened; atoms of one form are merged into one."""
    kept: dict[Formula, None] = {}
    for part in parts:
        if part == TRUE:
            return TRUE
        kept.update(dict.fromkeys(part.parts if isinstance(part, Some) else (part,)))
    boxes: dict[int, list[Box]] = {}
    for part in kept:
        if isinstance(part, Atom):
            boxes.setdefault(part.form, []).append(part.box)
    formulas: list[Formula] = [
        Atom(form, of_form[0] if len(of_form) == 1 else joined(chain.from_iterable(of_form)))
        for form, of_form in sorted(boxes.items())
    ]
    formulas += [part for part in kept if not isinstance(part, Atom)]
    return formulas[0] if len(formulas) == 1 else Some(tuple(formulas))


def clauses(formulas: Iterable[Formula]) -> Clauses:
    """Return the conjunction of `formulas` as clauses, with at most one box a form."""
    boxes: dict[int, Box] = {}
    rest: dict[Formula, None] = {}
    impossible = False
    for part in _parts(formulas):
        if isinstance(part, Atom):
            known = boxes.get(part.form)
            box = boxes[part.form] = part.box if known is None else meet(known, part.box)
            impossible = impossible or not box
        elif part == FALSE:
            impossible = True
        else:
            rest[part] = None
    return Clauses(tuple(sorted(boxes.items())), tuple(rest), impossible)


def _parts(formulas: Iterable[Formula]) -> Iterator[Formula]:
    """Yield the parts of a conjunction, with nested conjunctions flattened."""
    for part in formulas:
        if isinstance(part, Every):
            yield from _parts(part.parts)
        else:
            yield part


def lines_of(universe: Universe, table: Table) -> list[Clauses]:
    """Return every line of the table as clauses."""
    known: dict[int, list[Formula]] = {}
    lines = []
    for line in table.lines:
        parts: list[Formula] = []
        for test in line.stated:
            of_test = known.get(id(test))
            if of_test is None:
                of_test = known[id(test)] = list(universe.parts_of_test(test))
            parts += of_test
        lines.append(clauses(parts))
    return lines


def assumptions_of(universe: Universe, program: Program, table: Table) -> list[Clauses]:
    """Return every assumption that the table may use, in the table's order, as clauses."""
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


def _reads(condition: Expr, name: str) -> Read:
    return next(part for part in parts(condition) if isinstance(part, Read) and part.name == name)
