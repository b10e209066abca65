"""Exactly-one of a table, by a tree of regions that its certificate gives.

In: a table and its entry in a certificate. Out: nothing, or `RejectedError`. A node of the tree is a region, given by bounds on
forms (integer combinations of leaves). Conditions are read, canonical forms made, boxes counted and multipliers
added up here; of a leaf of the tree the certificate only says why it holds, and that is recomputed. At each leaf the
lines are judged under the region's bounds alone: true, false or open all over it. What such judging cannot settle is handed
on as a question of its own (`Region`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from math import gcd, prod
from typing import Any, TypeAlias

import numpy as np

from rcsc.lang.leaves import read_by
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
    key_bounds,
    key_of,
    real_of_key,
    single_of_key,
)
from rcsc.lang.operator_table import Comparison, Op, is_comparison, is_logic
from rcsc.proof.certify.execution import PAIRS, Owed, Run, Start, true_of
from rcsc.proof.certify.owed import Debt
from rcsc.proof.certify.settle import values_in
from rcsc.proof.certify.values import BOOL, INT, REALS, SINGLE, Term

Form: TypeAlias = tuple[tuple[str, int], ...]
"""Terms by name and their coefficients; sorted by name, the first positive, no common divisor."""
Bounds: TypeAlias = dict[Form, tuple[int, int]]
Atom: TypeAlias = tuple[Form, Box]
Formula: TypeAlias = "Atom | All | AnyOf"

_TURNED: Mapping[Op, Comparison] = {
    Op.LT: Op.GT, Op.GT: Op.LT, Op.LE: Op.GE, Op.GE: Op.LE, Op.EQ: Op.EQ, Op.NE: Op.NE,
}  # fmt: skip
"""The comparison with its sides exchanged."""
SMALL = 512
"""Keys of one leaf up to which a condition that is not linear is tried for each; as in `resolve`."""
MOST_PAIRED = 128
"""Lines of one question: it states every pair of them."""


@dataclass(frozen=True, slots=True)
class All:
    """Every part holds."""

    parts: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """Some part holds."""

    parts: tuple[Formula, ...]


class RejectedError(Exception):
    """The certificate does not prove its claim."""


class _Terms:
    """Conditions of the model as formulas over forms, and the range of every term met."""

    def __init__(self, program: Program) -> None:
        self.range = {str(v.name): key_bounds(v.type) for v in program.variables}
        self.terms: dict[str, Expr] = {str(v.name): Read(v.name, v.type) for v in program.variables}

    def span(self, form: Form) -> tuple[int, int]:
        """Return the least and the greatest value of the form over the declared ranges."""
        ends = [sorted((k * self.range[name][0], k * self.range[name][1])) for name, k in form]
        return sum(low for low, _ in ends), sum(high for _, high in ends)

    def name(self, term: Expr) -> str:
        name = spelled(term)
        self.range.setdefault(name, key_bounds(term.type))
        if self.terms.setdefault(name, term) != term:
            raise RejectedError(f"two terms are called {name}"[:200])
        return name

    def formula(self, expr: Expr, yes: bool = True) -> Formula:
        """Return the formula of `expr = yes`, with negations pushed inward."""
        match expr:
            case Literal(value=value):
                return All(()) if bool(value) == yes else AnyOf(())
            case Apply(op=Op.NOT, args=(part,)):
                return self.formula(part, not yes)
            case Apply(op=op, args=(left, right)) if is_logic(op):
                return self.truth(left, right, [pair for pair in PAIRS if (pair in true_of(op)) == yes])
            case Apply(op=op, args=(left, right)) if is_comparison(op) and _ordered(left) and _ordered(right):
                if isinstance(left.type, Bool) and not (_plain(left) and _plain(right)):
                    same = yes == (op is Op.EQ)
                    return self.truth(left, right, [(True, same), (False, not same)])
                return self.compare(op, left, right, yes)
            case Among(subject=subject, values=values) if _ordered(subject):
                tests = (self.compare(Op.EQ, subject, Literal(v, subject.type), yes) for v in values)
                return AnyOf(tuple(tests)) if yes else All(tuple(tests))
            case _:
                return ((self.name(expr), 1),), ((int(yes), int(yes)),)

    def truth(self, left: Expr, right: Expr, rows: list[tuple[bool, bool]]) -> Formula:
        """Return the formula that the two have one of the pairs of values."""
        if len(rows) == 3:
            [(a, b)] = [pair for pair in PAIRS if pair not in rows]
            return AnyOf((self.formula(left, not a), self.formula(right, not b)))
        parts = tuple(All((self.formula(left, a), self.formula(right, b))) for a, b in rows)
        return parts[0] if len(parts) == 1 else AnyOf(parts)

    def compare(self, op: Comparison, left: Expr, right: Expr, yes: bool) -> Formula:
        total: dict[str, int] = {}
        constant = self.add(total, left, 1) + self.add(total, right, -1)
        terms = sorted((name, k) for name, k in total.items() if k)
        g = gcd(*(k for _, k in terms)) * (-1 if terms and terms[0][1] < 0 else 1)
        form = tuple((name, k // g) for name, k in terms)  # left - right = g * form + constant
        low, high = self.span(form)
        if g < 0:
            op = _TURNED[op]
        if not form:
            low = high = constant
        first, last = (0, 0) if not form else (-(constant // g), -constant // g)  # where it is >= 0, <= 0
        below, above = (low, first - 1), (last + 1, high)
        box = {
            Op.LT: (below,), Op.LE: ((low, last),), Op.EQ: ((first, last),), Op.NE: (below, above),
            Op.GE: ((first, high),), Op.GT: (above,),
        }[op]  # fmt: skip
        inside = _union(iter((((max(a, low), min(b, high)),) for a, b in box if max(a, low) <= min(b, high))))
        if not form:
            return All(()) if bool(inside) == yes else AnyOf(())
        return form, inside if yes else _complement(inside, low, high)

    def add(self, total: dict[str, int], expr: Expr, factor: int) -> int:
        """Add `factor * expr` to the total; return the constant part."""
        match expr:
            case Literal(value=value, type=kind):
                return factor * key_of(kind, value)
            case Apply(op=Op.NEG, args=(part,)):
                return self.add(total, part, -factor)
            case Apply(op=Op.ADD | Op.SUB as op, args=(left, right), type=Int()):
                return self.add(total, left, factor) + self.add(
                    total, right, factor if op is Op.ADD else -factor
                )
            case Apply(op=Op.MUL, args=(left, right), type=Int()):
                for side, other in ((left, right), (right, left)):
                    trial: dict[str, int] = {}
                    constant = self.add(trial, side, 1)
                    if not any(trial.values()):
                        return self.add(total, other, factor * constant)
        name = self.name(expr)
        total[name] = total.get(name, 0) + factor
        return 0


@dataclass(frozen=True, slots=True)
class _Line:
    """A line in a region: the boxes and other formulas that are still open; with none, it holds."""

    index: int
    boxes: dict[Form, Box]
    rest: tuple[Formula, ...]


class TableChecker:
    """Walks one table's tree.

    Attributes:
        names: The assumptions that the tree may use.
        questions: The questions that the tree leaves to be settled.
    """

    def __init__(self, start: Start, table: Table, entry: Mapping[str, Any]) -> None:
        self.start, self.table, self.terms = start, table, _Terms(start.program)
        known: dict[int, Formula] = {}
        lines = []
        for index, line in enumerate(table.lines):
            tests = [test for test in line.tests if test is not None]
            for test in tests:
                if id(test) not in known:
                    known[id(test)] = self.judge(self.condition(test.condition), {})
            lines.append(self.line(index, (known[id(test)] for test in tests)))
        self.lines = [line for line in lines if line is not None]
        self.names = tuple(str(name) for name in entry["assumptions"])
        conditions = {str(a.name): a for a in start.program.assumptions if a.name in table.assumptions}
        self.assumptions = [conditions[name] for name in self.names]
        self.assumed = [self.terms.formula(assumption.condition) for assumption in self.assumptions]
        columns = [str(name) for name in entry["columns"]]
        self.forms = [self.read_form([(columns[c], k) for c, k in form]) for form in entry["forms"]]
        self.tree: list[list[Any]] = list(entry["tree"])
        self.cover = table.default is None or table.default.unreachable
        self.questions: list[Debt] = []

    def condition(self, expr: Expr) -> Formula:
        """Return a condition as a formula; one about a single leaf becomes, if possible, the keys for which it holds."""
        formula = self.terms.formula(expr)
        names = set(map(str, read_by(expr)))
        if len(names) != 1:
            return formula
        [name] = names
        box = _one_form(formula, ((name, 1),), self.terms.range[name]) or self.tried(expr, name)
        return formula if box is None else (((name, 1),), box)

    def tried(self, expr: Expr, name: str) -> Box | None:
        """Try each key of the leaf; return those for which the condition holds. None for many keys, or where it is undefined for one."""
        low, high = self.terms.range[name]
        leaf = self.start.leaves[name]
        if high - low >= SMALL or leaf.sort in REALS:
            return None
        run = Run(self.start, "")
        holds = run.evaluate(expr)
        defined = run.terms.every(run.terms.follows(owed.path, owed.good) for owed in run.owed)
        keys = np.array(range(low, high + 1))
        cases = {leaf: keys}
        if not values_in(defined, cases, len(keys)).all():
            return None
        holding = keys[values_in(holds, cases, len(keys))]
        return _union(iter([((int(key), int(key)),) for key in holding]))

    def read_form(self, terms: list[tuple[str, int]]) -> tuple[Form, int]:
        """Return the canonical form, and -1 where the certificate has it with the opposite sign."""
        terms.sort()
        sign = 1 if terms[0][1] > 0 else -1
        form = tuple((name, sign * k) for name, k in terms)
        if (
            any(type(k) is not int for _, k in form)
            or len(dict(form)) < len(form)
            or gcd(*dict(form).values()) != 1
        ):
            raise RejectedError("a form is not in canonical shape")
        return form, sign

    def range(self, form: Form, bounds: Bounds) -> tuple[int, int]:
        """Return the form's bounds in a region."""
        return bounds.get(form) or self.terms.span(form)

    def judge(self, formula: Formula, bounds: Bounds) -> Formula:
        """Simplify the formula within the bounds; `All(())` and `AnyOf(())` are true and false."""
        if isinstance(formula, tuple):
            form, box = formula
            low, high = self.range(form, bounds)
            inside = _meet(box, ((low, high),))
            return (form, inside) if inside and inside != ((low, high),) else All(()) if inside else AnyOf(())
        kind, other = (All, AnyOf) if isinstance(formula, All) else (AnyOf, All)
        parts: list[Formula] = []
        boxes: dict[Form, Box] = {}
        for part in (self.judge(part, bounds) for part in formula.parts):
            if part == other(()):
                return other(())
            for child in part.parts if isinstance(part, All | AnyOf) and isinstance(part, kind) else (part,):
                if not isinstance(child, tuple):
                    parts.append(child)
                elif child[0] not in boxes:
                    boxes[child[0]] = child[1]
                else:
                    boxes[child[0]] = (_meet if kind is All else _join)(boxes[child[0]], child[1])
        for form, box in boxes.items():  # what speaks of one form is one box of it
            low, high = self.range(form, bounds)
            if box == (((low, high),) if kind is AnyOf else ()):
                return other(())
            parts.append((form, box))
        return parts[0] if len(parts) == 1 else kind(tuple(parts))

    def line(self, index: int, parts: Iterator[Formula]) -> _Line | None:
        """Return the conjunction of judged formulas; None when it is false."""
        boxes: dict[Form, Box] = {}
        rest: list[Formula] = []
        for whole in parts:
            for part in whole.parts if isinstance(whole, All) else (whole,):
                if isinstance(part, tuple):
                    boxes[part[0]] = _meet(boxes[part[0]], part[1]) if part[0] in boxes else part[1]
                else:
                    rest.append(part)
        return None if AnyOf(()) in rest or not all(boxes.values()) else _Line(index, boxes, tuple(rest))

    def within(self, line: _Line, form: Form, bounds: Bounds) -> _Line | None:
        """Return the line in a region whose bounds on `form` have narrowed; None where it cannot hold there."""
        if form not in line.boxes and not line.rest:
            return line
        kept = [(other, box) for other, box in line.boxes.items() if other != form]
        old = [(form, line.boxes[form])] if form in line.boxes else []
        return self.line(
            line.index, iter([*kept, *(self.judge(part, bounds) for part in (*old, *line.rest))])
        )

    def check(self) -> None:
        """Check every node, in preorder.

        Raises:
            RejectedError: A node does not hold, or the tree is not that of all inputs.
        """
        stack: list[tuple[Bounds, list[_Line]]] = [({}, self.lines)]
        for node in self.tree:
            if not stack:
                raise RejectedError("the tree has more nodes than regions")
            bounds, lines = stack.pop()
            if node[0] == "s":
                stack += self.split(bounds, lines, *node[1:])
            elif not self.leaf(bounds, lines, *node):
                raise RejectedError(f"a leaf does not hold: {node}"[:200])
        if stack:
            raise RejectedError("the tree leaves a region out")

    def split(
        self, bounds: Bounds, lines: list[_Line], number: int, cut: int
    ) -> list[tuple[Bounds, list[_Line]]]:
        """Return the two parts of a region, the first on top of the stack."""
        form, sign = self.forms[number]
        low, high = self.range(form, bounds)
        first, second = ((low, cut), (cut + 1, high)) if sign > 0 else ((-cut, high), (low, -cut - 1))
        if type(cut) is not int or number < 0 or first[0] > first[1] or second[0] > second[1]:
            raise RejectedError("a split is out of its region")
        sides = []
        for side in (second, first):
            inner = {**bounds, form: side}
            sides.append(
                (inner, [kept for line in lines if (kept := self.within(line, form, inner)) is not None])
            )
        return sides

    def leaf(self, bounds: Bounds, lines: list[_Line], kind: str, *rest: Any) -> bool:
        """Return whether exactly one line (with DEFAULT: at most one) holds all over the region."""
        if kind == "a":
            return (
                type(rest[0]) is int
                and rest[0] >= 0
                and self.judge(self.assumed[rest[0]], bounds) == AnyOf(())
            )
        if kind == "e":
            return self.is_empty(bounds, *rest)
        if kind == "l" and rest[0] == -1:
            return not self.cover and len(lines) <= 1
        if kind == "l":
            return [(line.index, line.boxes, line.rest) for line in lines] == [(rest[0], {}, ())]
        if kind == "b":
            return self.counts(bounds, lines, *rest)
        return kind == "z" and self.left(bounds, [line.index for line in lines])

    def left(self, bounds: Bounds, candidates: list[int]) -> bool:
        """Leave the question whether exactly one candidate holds in the region to be settled; return whether it could be stated."""
        if len(candidates) > MOST_PAIRED:
            return False
        terms, condition = self.start.terms, self.start.condition
        lines = [
            terms.every(condition(test.condition) for test in self.table.lines[at].tests if test is not None)
            for at in candidates
        ]
        good = [terms.negation(terms.every(pair)) for pair in combinations(lines, 2)]
        if self.cover:
            good.append(terms.some(lines))
        known = [*(condition(assumption.condition) for assumption in self.assumptions)]
        for form, (low, high) in bounds.items():
            known += self.within_bounds(form, low, high)
        name = f"table `{self.table.name}`: exactly one line matches in region {len(self.questions) + 1}"
        owed = Owed(name, self.table.span, terms.true, terms.every(good), 0)
        self.questions.append(Debt(tuple(known), (owed,)))
        return True

    def within_bounds(self, form: Form, low: int, high: int) -> list[Term]:
        """Return `low <= form <= high` as far as terms can state it; for the distance of two doubles, only which is greater."""
        make, terms = self.start.terms.make, self.start.terms
        parts = [(self.start.condition(self.terms.terms[name]), k) for name, k in form]
        sort = parts[0][0].sort
        if sort in REALS:
            if len(parts) == 1:
                of_key = single_of_key if sort == SINGLE else real_of_key
                ends = [
                    of_key(max(low, self.terms.span(form)[0])),
                    of_key(min(high, self.terms.span(form)[1])),
                ]
                least, greatest = (terms.constant(sort, end) for end in ends)
                return [make("<=", least, parts[0][0]), make("<=", parts[0][0], greatest)]
            if [k for _, k in parts] != [1, -1]:
                return []
            (first, _), (second, _) = parts
            comparisons = [
                ("<", first, second, high <= -1),
                ("<=", first, second, high <= 0),
                ("<", second, first, low >= 1),
                ("<=", second, first, low >= 0),
            ]
            return [make(op, left, right) for op, left, right, true in comparisons if true]
        total = terms.constant(INT, 0)
        for term, k in parts:
            number = (
                terms.choice(term, terms.constant(INT, 1), terms.constant(INT, 0))
                if term.sort == BOOL
                else term
            )
            total = make("+", total, make("*", terms.constant(INT, k), number))
        return [make("<=", terms.constant(INT, low), total), make("<=", total, terms.constant(INT, high))]

    def is_empty(self, bounds: Bounds, multipliers: list[list[int]]) -> bool:
        """Return whether the bounds, times the multipliers, add up to 0 <= a negative number."""
        total: dict[str, int] = {}
        bound = 0
        for number, k in multipliers:
            form, sign = self.forms[number]
            if type(k) is not int or number < 0:
                return False
            low, high = self.range(form, bounds)
            bound += sign * k * (high if sign * k > 0 else low)
            for name, factor in form:
                total[name] = total.get(name, 0) + sign * k * factor
        return bound < 0 and not any(total.values())

    def counts(self, bounds: Bounds, lines: list[_Line], count: int | None, parts: list[int] | None) -> bool:
        """Return whether the lines are disjoint boxes and, where they must, fill the region."""
        forms = sorted({form for line in lines for form in line.boxes})
        if any(line.rest for line in lines) or any(len(form) > 1 for form in forms):
            return False
        size = {form: high - low + 1 for form in forms for low, high in [self.range(form, bounds)]}
        if self.cover:
            filled = sum(
                prod(_size(line.boxes[f]) if f in line.boxes else size[f] for f in forms) for line in lines
            )
            if not count == filled == prod(size.values()):
                return False
        boxes = [line.boxes for line in lines]
        if parts is None:
            return (self.cover or count is None) and all(_disjoint(boxes, forms))
        pairs = [(a, b) for i, a in enumerate(boxes) for b in boxes[i + 1 :]]
        named = [self.forms[number][0] for number in parts if number >= 0]
        return len(named) == len(pairs) == len(parts) and not any(
            _meet(a[form], b[form]) for (a, b), form in zip(pairs, named, strict=True)
        )


def _disjoint(lines: list[dict[Form, Box]], forms: list[Form]) -> Iterator[bool]:
    """Yield for each line whether some form parts every later line from it."""
    owner: dict[Form, Any] = {}  # for each line the number of its box, 0 where it has none
    ends: dict[Form, tuple[Any, Any, Any]] = {}  # low and high rank of every interval; where each box starts
    rank: dict[Form, dict[int, int]] = {}
    for form in forms:
        number = {
            box: i + 1 for i, box in enumerate(dict.fromkeys(line[form] for line in lines if form in line))
        }
        rank[form] = {
            end: i for i, end in enumerate(sorted({end for box in number for pair in box for end in pair}))
        }
        flat = [(rank[form][low], rank[form][high]) for box in number for low, high in box]
        lows, highs = np.array([(-1, len(rank[form])), *flat]).T
        starts = np.cumsum([0, 1, *(len(box) for box in number)])[:-1]
        owner[form], ends[form] = (
            np.array([number[line[form]] if form in line else 0 for line in lines]),
            (lows, highs, starts),
        )
    for i, line in enumerate(lines):
        left = np.arange(i + 1, len(lines))
        for form, box in line.items():
            lows, highs, starts = ends[form]
            meets = np.zeros(len(lows), dtype=bool)
            for low, high in box:
                meets |= (lows <= rank[form][high]) & (highs >= rank[form][low])
            left = left[np.logical_or.reduceat(meets, starts)[owner[form][left]]]
            if not len(left):
                break
        yield not len(left)


def _one_form(formula: Formula, form: Form, ends: tuple[int, int]) -> Box | None:
    """Return the keys for which a formula about one form holds; None where it speaks of another."""
    if isinstance(formula, tuple):
        return formula[1] if formula[0] == form else None
    box: Box = (ends,) if isinstance(formula, All) else ()
    for part in formula.parts:
        inner = _one_form(part, form, ends)
        if inner is None:
            return None
        box = _meet(box, inner) if isinstance(formula, All) else _join(box, inner)
    return box


def _plain(expr: Expr) -> bool:
    return not isinstance(expr, Apply | Among)


def _ordered(expr: Expr) -> bool:
    """Return whether keys order the values: no infinity or NaN can be among them."""
    return not isinstance(expr.type, Real) or abs(expr.type.low) + abs(expr.type.high) < float("inf")


def _meet(left: Box, right: Box) -> Box:
    return tuple((max(a, c), min(b, d)) for a, b in left for c, d in right if max(a, c) <= min(b, d))


def _join(left: Box, right: Box) -> Box:
    return _union(iter((left, right)))


def _size(box: Box) -> int:
    return sum(high - low + 1 for low, high in box)


def _complement(box: Box, low: int, high: int) -> Box:
    """Return the part of `low .. high` outside the box (sorted, disjoint)."""
    edges = [low - 1, *(end for pair in box for end in pair), high + 1]
    return tuple((a + 1, b - 1) for a, b in zip(edges[::2], edges[1::2], strict=True) if a + 1 <= b - 1)


def _union(boxes: Iterator[Box]) -> Box:
    """Return the intervals of all boxes, sorted; those that overlap or touch are joined."""
    intervals: list[tuple[int, int]] = []
    for low, high in sorted(pair for box in boxes for pair in box):
        if intervals and low <= intervals[-1][1] + 1:
            intervals[-1] = (intervals[-1][0], max(high, intervals[-1][1]))
        else:
            intervals.append((low, high))
    return tuple(intervals)
