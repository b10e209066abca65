"""Condition cells to tests; where a test looks at one leaf only, to its set of keys."""

from dataclasses import dataclass, field
from functools import lru_cache

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.intervals import may_be_undefined
from rcsc.lang.expressions.operators import Typed, compared, conversion, kind_word, same_kind, side
from rcsc.lang.expressions.placing import placed
from rcsc.lang.expressions.previous import AT_ONCE, OF_A_VARIABLE, OF_TWO_CYCLES, looks_back
from rcsc.lang.expressions.scope import INMODE, Body, Scope
from rcsc.lang.expressions.typed import (
    among,
    between,
    boolean,
    for_a_time,
    happening,
    masked,
    other_than,
    typed,
    without_before,
)
from rcsc.lang.interpret import fold
from rcsc.lang.interval_sets import compared as keys_compared
from rcsc.lang.interval_sets import complement, joined, meet, scaled
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Box,
    Expr,
    Int,
    Read,
    Real,
    Scalar,
    Test,
    Value,
    Variable,
    VariableName,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import (
    MIRRORED,
    Comparison,
    Logic,
    Op,
    Operator,
    is_comparison,
    is_logic,
    signed,
    truth_function,
)
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import Cell
from rcsc.lang.syntax.spell import spell_condition

_SMALL = 512


@dataclass(slots=True)
class Tests:
    """The tests of one table: one a column and meaning, shared by the lines that state it.

    Attributes:
        subjects: The expression of each column's heading; None under `when`, and after an error.
        texts: The text of each heading.
        pieces: The meaning of each condition that `and` joins to others in a cell, by its identity: one stands in many cells.
        reads: The leaves that each of these meanings reads, by its identity.
    """

    scope: Scope
    headings: tuple[tree.Heading, ...]
    subjects: tuple[Typed | None, ...]
    texts: tuple[str, ...]
    known: dict[tuple[int, int], Test | None] = field(default_factory=dict)
    meant: dict[tuple[int, tree.Condition | str], Test | None] = field(default_factory=dict)
    pieces: dict[int, Expr | None] = field(default_factory=dict)
    reads: dict[int, frozenset[VariableName]] = field(default_factory=dict)
    __test__ = False

    def test(self, column: int, written: tree.Condition, cell: Cell) -> Test | None:
        """Return the test of a cell; None where it is always true, or after an error."""
        told = self.headings[column].subject is None and INMODE not in cell.text
        meaning = (column, cell.text if told else written)
        if meaning not in self.meant:
            self.scope.cell = cell
            self.meant[meaning] = self._test(column, written, cell)
            self.scope.cell = None
        self.known[column, id(written)] = self.meant[meaning]
        return self.meant[meaning]

    def _test(self, column: int, written: tree.Condition, cell: Cell) -> Test | None:
        condition = self._condition(column, written)
        if condition is None:
            return None
        value = fold(condition)
        names = tuple(sorted(self._reads(condition), key=self.scope.order))
        box = box_of(condition, self.scope.leaves[names[0]]) if len(names) == 1 else None
        alone = self.headings[column].subject is None
        text = " ".join(cell.text.split())
        if alone and INMODE in text:  # as it reads in any row
            text = spell_condition(written, True)
        if value is False or box == ():
            kinds = (self.scope.leaves[name].type for name in names)
            if self.scope.unsure(*(kind.unit for kind in kinds if isinstance(kind, Int | Real))):
                return None
            helps = "the line could never match: mend the condition, or take the line out"
            self.scope.report(Code.EMPTY_CONDITION, f"no value satisfies `{text}`", cell.span, helps)
            return None
        return None if value is True else Test(text, placed(condition, cell), names, box)

    def _condition(self, column: int, written: tree.Condition) -> Expr | None:
        if isinstance(written, tree.Happens):
            return self._happens(column, written)
        if not isinstance(written, tree.Lasting):
            return self._untimed(column, written)
        with without_before(self.scope, AT_ONCE):
            condition = self._untimed(column, written.condition)
        if condition is None:
            return None
        text = f"{self.texts[column]} {spell_condition(written.condition, False)}"
        held = for_a_time(self.scope, Body(), condition, text, written.time, written.span)
        return None if held is None else held.expr

    def _happens(self, column: int, written: tree.Happens) -> Expr | None:
        subject = self.subjects[column]
        if subject is None:
            return None
        event = happening(self.scope, Body(), written, lambda: self._operand(column, subject, written))
        if event is None:
            return None
        return Apply(Op.NOT, (event.expr,), Bool(), written.span) if written.negated else event.expr

    def _operand(self, column: int, subject: Typed, written: tree.Happens) -> Typed | None:
        """Resolve what an event in a cell is about: the heading, or a condition on it."""
        word, operand, heading = written.word.text, written.operand, self.texts[column]
        truth = isinstance(subject.expr.type, Bool)
        if looks_back(self.scope, subject.expr):
            self.scope.report(Code.NO_CYCLE_BEFORE, OF_TWO_CYCLES, written.span, OF_A_VARIABLE)
            return None
        if operand is None and not truth and word != "@C":
            message = f"`{word}` alone is of a heading that is true or false, `{heading}` is {kind_word(subject.expr.type)}"
            self.scope.report(
                Code.KIND, message, written.span, f"say what it came to be: `{word}(> 3)`, `{word}(3)`"
            )
            return None
        if operand is not None and (truth or word == "@C"):
            message = f"`{word}` in this cell is of the heading `{heading}`, and stands alone"
            helps = f"write `{word}`; an event of something else stands in a column headed `when`"
            self.scope.report(Code.KIND, message, written.span, helps)
            return None
        if operand is None:
            return subject
        condition = self._untimed(column, operand)
        return None if condition is None else Typed(condition)

    def _untimed(self, column: int, written: tree.Comparison | tree.OneOf | tree.Between) -> Expr | None:
        scope, body = self.scope, Body()
        if self.headings[column].subject is None:
            assert isinstance(written, tree.Comparison)
            cell = scope.cell
            if not written.places or cell is None:
                return boolean(scope, body, written.value)
            return self._joined(written.value, written.places, cell)
        subject = self.subjects[column]
        if subject is None:
            return None
        condition: Typed | None
        match written:
            case tree.Comparison(written_op, value, span):
                if isinstance(value, tree.Mask) and written_op in ("=", "/="):
                    pattern = masked(scope, subject, written_op, value)
                    return None if pattern is None else pattern.expr
                op: Operator = Op(written_op)
                assert is_comparison(op)
                other = typed(scope, body, value, subject.expr.type)
                fits = other is not None and self._fits(column, subject, other, span)
                condition = (
                    compared(scope, op, (subject, other), span) if other is not None and fits else None
                )
            case tree.OneOf(members, span):
                condition = among(scope, body, subject, members, span)
            case tree.Between(low, high, span):
                condition = between(scope, body, subject, low, high, span)
        if condition is not None and not isinstance(written, tree.Comparison) and written.negated:
            condition = other_than(condition)
        return None if condition is None else condition.expr

    def _joined(self, written: tree.Expr, places: tuple[tuple[int, int], ...], cell: Cell) -> Expr | None:
        """Resolve the conditions that `and` joins, at these places of a cell."""
        if len(places) == 1:
            return self._piece(written, cell, places[0])
        assert isinstance(written, tree.Binary)
        left = self._joined(written.left, places[:-1], cell)
        right = self._piece(written.right, cell, places[-1])
        if left is None or right is None:
            return None
        return Apply(Op.AND, (left, right), Bool(), tree.absolute(written.span, cell))

    def _piece(self, written: tree.Expr, whole: Cell, place: tuple[int, int]) -> Expr | None:
        """Resolve one of the joined conditions, once; where it may be undefined, each line gets it with spans of its own."""
        if id(written) not in self.pieces:
            cell = self.scope.cell = whole.part(*place)
            condition = boolean(self.scope, Body(), written)
            if condition is not None:
                condition = condition if may_be_undefined(condition) else placed(condition, cell)
                self.reads[id(condition)] = frozenset(read_by(condition))
            self.pieces[id(written)] = condition
        condition = self.pieces[id(written)]
        if condition is None or condition.span.file:
            return condition
        return placed(condition, whole.part(*place))

    def _reads(self, condition: Expr) -> frozenset[VariableName]:
        if id(condition) in self.reads:
            return self.reads[id(condition)]
        if isinstance(condition, Apply) and condition.op is Op.AND:
            left, right = condition.args
            return self._reads(left) | self._reads(right)
        return frozenset(read_by(condition))

    def _fits(self, column: int, subject: Typed, other: Typed, span: Span) -> bool:
        """Return whether a cell's value is of the kind of its column; report it where it is not."""
        wanted, given = subject.expr.type, other.expr.type
        if same_kind(wanted, given):
            return True
        helps = conversion(wanted, given)
        if isinstance(given, Bool):
            helps = ("a whole condition stands in a column headed `when`",)
        heading = self.texts[column]
        message = f"column `{heading}` is {kind_word(wanted)}, this cell is {side(other)}"
        self.scope.report(Code.KIND, message, span, *helps)
        return False


# --- boxes ---------------------------------------------------------------------------


def box_of(condition: Expr, leaf: Variable) -> Box | None:
    """Return the keys of the one leaf that the condition reads for which it holds; None where they are not found as a box."""
    low, high = key_bounds(leaf.type)
    box = _box(condition, leaf.type, low, high)
    if box is None and high - low < _SMALL and not isinstance(leaf.type, Real):
        return _tried(condition, leaf.name, leaf.type)
    return box


@lru_cache(maxsize=1024)  # the cells of a text that is resolved again and again are nearly all the same
def _tried(condition: Expr, name: VariableName, kind: Scalar) -> Box | None:
    """Try every key; None where the condition is undefined for some."""
    holding = []
    low, high = key_bounds(kind)
    for key in range(low, high + 1):
        value = fold(condition, {name: value_of_key(kind, key)})
        if value is None:
            return None
        if value:
            holding.append((key, key))
    return joined(holding)


def _box(condition: Expr, kind: Scalar, low: int, high: int) -> Box | None:
    always = fold(condition)
    if always is not None:
        return ((low, high),) if always else ()
    match condition:
        case Read():
            return ((1, 1),)
        case Among(subject=Read(), values=values):
            keys = [key_of(kind, value) for value in values]
            return joined([(key, key) for key in keys if low <= key <= high])
        case Apply(op=Op.NOT, args=(inner,)):
            box = _box(inner, kind, low, high)
            return None if box is None else complement(box, low, high)
        case Apply(op=op, args=(left, right)) if is_logic(op):
            first, second = _box(left, kind, low, high), _box(right, kind, low, high)
            return None if first is None or second is None else _logic(op, first, second, low, high)
        case Apply(op=op, args=(left, right)) if is_comparison(op):
            return _compared(op, left, right, kind, low, high)
        case _:
            return None


def _logic(op: Logic, left: Box, right: Box, low: int, high: int) -> Box:
    first, second = (signed(box, lambda box: complement(box, low, high)) for box in (left, right))
    whole = truth_function(
        op, first, second, lambda boxes: meet(*boxes), lambda boxes: joined(boxes[0] + boxes[1])
    )
    return whole(True)


def _compared(op: Comparison, left: Expr, right: Expr, kind: Scalar, low: int, high: int) -> Box | None:
    if fold(left) is not None:
        left, right, op = right, left, MIRRORED[op]
    value = fold(right)
    if value is None or isinstance(right.type, Bool) is not isinstance(kind, Bool):
        return None
    if isinstance(left, Read):
        return keys_compared(op, key_of(kind, value), low, high)
    line = _affine(left) if isinstance(kind, Int) else None
    return None if line is None else _affine_box(op, line, int(value), low, high)


def _affine(expr: Expr) -> tuple[int, int] | None:
    """Return `(a, b)` where the expression is a * leaf + b; None where it is not."""
    value: Value | None = fold(expr)
    if value is not None:
        return 0, int(value)
    match expr:
        case Read():
            return 1, 0
        case Apply(op=Op.NEG, args=(inner,)):
            line = _affine(inner)
            return None if line is None else (-line[0], -line[1])
        case Apply(op=Op.ADD | Op.SUB | Op.MUL as op, args=(left, right)):
            first, second = _affine(left), _affine(right)
            return None if first is None or second is None else _combined(op, first, second)
        case _:
            return None


def _combined(op: Op, left: tuple[int, int], right: tuple[int, int]) -> tuple[int, int] | None:
    (a, b), (c, d) = left, right
    if op is Op.MUL:
        return None if a and c else (a * d + c * b, b * d)
    sign = 1 if op is Op.ADD else -1
    return a + sign * c, b + sign * d


def _affine_box(op: Comparison, line: tuple[int, int], value: int, low: int, high: int) -> Box:
    """Return the keys x with a * x + b `op` value."""
    a, rest = line[0], value - line[1]
    if a == 0:
        return ((low, high),) if op.meaning(0, rest) else ()
    return scaled(op, a, rest, low, high)
