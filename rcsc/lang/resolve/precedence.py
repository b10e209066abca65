"""Which line runs where two match, where the table says it: `above` and `same`, resolved into conditions.

In: a table as written, and its lines. Out: the lines, each with one test more where others go before it: that none of these matches.
So every later stage sees a table in which order plays no part. `above` is an order: what stands above a line stands above all that this
line stands above, and nothing above itself. A line *comes through* where it matches and none above it does; there is one wherever any
matches, so nothing falls into a gap by it. Lines that do the `same` are so in pairs, and through others: where several come through
the first of the table runs, and what is said of each pair (`Meeting`) is proved later.

The test says no more than it has to: of the upper line's conditions those that the lower one's do not imply, and nothing
where the two never meet. Where `stop` (called = stop) stands above `ended` (now = starting, done = true), `ended` gets `called /= stop`.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.expressions.conditions import box_of
from rcsc.lang.expressions.scope import Scope
from rcsc.lang.expressions.words import Mask, mask_of
from rcsc.lang.interval_sets import boxes_of, meet
from rcsc.lang.leaves import is_finite, read_by, shortest_circle
from rcsc.lang.model import (
    Apply,
    Box,
    Column,
    Expr,
    Line,
    LineName,
    Meeting,
    Table,
    Test,
    key_bounds,
)
from rcsc.lang.operator_table import NEGATION, OPPOSITE, is_comparison
from rcsc.lang.questions import conjunction, negation
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.parse import parse
from rcsc.lang.syntax.rows import Cell
from rcsc.lang.syntax.spell import spell_expr

ALL = "all"
"""The word for every other line, except those that stand above this one or, like it, above all."""
_OPPOSITE = {str(op.value): str(other.value) for op, other in OPPOSITE.items()}


Resolved: TypeAlias = tuple[tuple[Column, ...], tuple[Line, ...], tuple[Meeting, ...]]
"""Columns, lines, and what is said of pairs of lines."""


def with_precedence(
    scope: Scope, written: tree.TableDecl, columns: tuple[Column, ...], lines: tuple[Line, ...]
) -> Resolved:
    """Return the columns and lines, with a column for the conditions that lines going before a line add to it; report errors."""
    unchanged: Resolved = columns, lines, ()
    if not any(row.above or row.same for row in written.rows):
        return unchanged
    order = _Order.of(scope, written)
    if scope.diagnostics:
        return unchanged
    known = _Lines(scope, written, lines, order)
    if known.reports_endless():
        return unchanged
    added = [known.added(at) for at in range(len(lines))]
    leaves = sorted(
        {leaf for tests in added for leaf in tests}, key=lambda leaf: (not leaf, leaf and scope.order(leaf))
    )
    more = (Column("when", None, None, written.name.span, written=False),) * len(leaves)
    resolved = tuple(known.given(at, [tests.get(leaf) for leaf in leaves]) for at, tests in enumerate(added))
    return (*columns, *more), resolved, tuple(known.meetings())


def expanded(written: tree.TableDecl, table: Table, *, apart: bool = False) -> tree.TableDecl:
    """Return the table as it is resolved: without `above` and `same`, with a column for the conditions that they add.

    `apart` gives it the columns of the model, of which each looks at another variable.
    """
    rows = tuple(replace(row, above=(), same=()) for row in written.rows)
    written = replace(written, turned=None)
    many = sum(not column.written for column in table.columns)
    if not many:
        return replace(written, rows=rows)
    texts = {
        line.name: [test.text if test is not None else "" for test in line.tests[-many:]]
        if apart
        else [table.added(line)]
        for line in table.lines
    }
    blank = [""] * (many if apart else 1)
    split = 1 + len(written.conditions)
    return replace(
        written,
        conditions=(*written.conditions, *(tree.Heading(None, "when", Cell("when", "", 0)) for _ in blank)),
        rows=tuple(
            replace(
                row,
                conditions=(*row.conditions, *map(_condition, texts.get(LineName(row.name), blank))),
                cells=(*row.cells[:split], *(Cell("", "", 0) for _ in blank), *row.cells[split:]),
            )
            for row in rows
        ),
    )


def _condition(text: str) -> tree.Condition | None:
    """Parse a condition as a cell under `when`; None for an empty one."""
    if not text:
        return None
    parsed = parse(Source("", f"assume it : {text}"))
    assert isinstance(parsed, tree.File)
    [claim] = parsed.declarations
    assert isinstance(claim, tree.AssumeDecl)
    return tree.Comparison("=", claim.condition)


# --- the order ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Order:
    """The order of a table's lines, by name.

    Attributes:
        below: For each line those that stand above it.
        same: For each line those that do the same, itself too.
    """

    below: Mapping[str, frozenset[str]]
    same: Mapping[str, frozenset[str]]

    @classmethod
    def of(cls, scope: Scope, written: tree.TableDecl) -> "_Order":
        """Return the order as written; report names without a line, and circles."""
        same = _same(scope, written)
        above = _above(scope, written, same)
        order = cls(
            {name: frozenset(upper for upper, lower in above.items() if name in lower) for name in above},
            same,
        )
        for row in written.rows:
            for other in (*row.above, *row.same):
                if other.text in order.same[row.name] and other.text in (
                    *above[row.name],
                    *order.below[row.name],
                ):
                    what = f"one of `{row.name}` and `{other.text}` stands above the other, and both are said to do the same"
                    scope.report(Code.LINE_ORDER, what, other.span)
        return order


def _same(scope: Scope, written: tree.TableDecl) -> dict[str, frozenset[str]]:
    """Return for each line those that do the same, directly or through others, itself included."""
    named = {row.name: {other.text for other in _others(scope, written, row)} for row in written.rows}
    both = {
        name: {*others, *(other for other in named if name in named[other])} for name, others in named.items()
    }
    return {name: frozenset({name, *_reached(name, both)}) for name in both}


def _above(scope: Scope, written: tree.TableDecl, same: Mapping[str, frozenset[str]]) -> dict[str, set[str]]:
    """Return for each line those above which it stands, directly or through others."""
    named = {row.name: {lower.text for lower in _named(scope, written, row)} for row in written.rows}
    above = {name: _reached(name, named) for name in named}
    whole = {row.name for row in written.rows if any(lower.text == ALL for lower in row.above)}
    for name in whole:
        above[name] |= {
            other
            for other in named
            if other not in whole and other not in same[name] and name not in above[other]
        }
    circle = _circle(named) or _circle(above)
    if circle:
        _report_circle(scope, written, circle)
    return {name: _reached(name, above) for name in above}


def _others(scope: Scope, written: tree.TableDecl, row: tree.Row) -> Iterator[tree.Name]:
    """Yield the lines that a row names after `same`."""
    rows = {other.name: other for other in written.rows}
    for name in row.same:
        other = rows.get(name.text)
        if other is None:
            scope.unknown(_kind(written), name, [each for each in rows if each != row.name])
        elif other is row:
            scope.report(Code.LINE_ORDER, f"line `{row.name}` is said to do the same as itself", name.span)
        elif row.default or other.default:
            default = row.name if row.default else other.name
            what = f"the DEFAULT line `{default}` runs where no other matches: it does the same as none"
            scope.report(Code.LINE_ORDER, what, name.span)
        else:
            yield name


def _kind(written: tree.TableDecl) -> str:
    return f"line of table `{written.name.text}`"


def _named(scope: Scope, written: tree.TableDecl, row: tree.Row) -> Iterator[tree.Name]:
    """Yield the lines that a row names after `above`, without `all`."""
    rows = {other.name: other for other in written.rows}
    for lower in row.above:
        other = rows.get(lower.text)
        if row.default:
            what = f"the DEFAULT line `{row.name}` runs where no other matches: it stands above none"
            scope.report(Code.LINE_ORDER, what, lower.span)
        elif lower.text == ALL and other is None:
            continue
        elif lower.text == ALL:
            what = f"`{ALL}` means every other line, and there is a line of that name"
            scope.report(Code.LINE_ORDER, what, lower.span, "call the line something else")
        elif other is None:
            scope.unknown(_kind(written), lower, [name for name in rows if name != row.name])
        elif other is row:
            scope.report(Code.LINE_ORDER, f"line `{row.name}` stands above itself", lower.span)
        elif other.default:
            what = f"`{other.name}` is the DEFAULT line: every line stands above it"
            scope.report(Code.LINE_ORDER, what, lower.span, f"leave `{other.name}` out")
        else:
            yield lower


def _reached(name: str, edges: Mapping[str, Collection[str]]) -> set[str]:
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        for lower in edges[waiting.pop()]:
            if lower not in reached:
                reached.add(lower)
                waiting.append(lower)
    return reached


def _circle(edges: Mapping[str, Collection[str]]) -> list[str]:
    return shortest_circle({name: sorted(lower) for name, lower in edges.items()})


def _report_circle(scope: Scope, written: tree.TableDecl, circle: list[str]) -> None:
    rows = {row.name: row for row in written.rows}
    first, *others = (rows[name] for name in circle[:-1])
    what = f"lines stand above each other in a circle: {' above '.join(f'`{name}`' for name in circle)}"
    related = tuple(Label(_marks(row), "and here") for row in others)
    scope.report(Code.LINE_ORDER, what, _marks(first), "take one of these out", related=related)


def _marks(row: tree.Row) -> Span:
    """Return the span of the names after `above` in a row."""
    return Span(row.above[0].span.file, row.above[0].span.start, row.above[-1].span.end)


# --- conditions --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Before:
    """A line that goes before another where it comes through.

    Attributes:
        columns: Those of its conditions that count.
        unless: Lines that go before it, and not before the other.
    """

    line: int
    columns: tuple[int, ...]
    unless: tuple[int, ...] = ()


@dataclass(slots=True)
class _Lines:
    """The lines of a table, to find the conditions that lines above add to a line.

    Attributes:
        boxes: For each line the keys that it may have, by leaf.
        masks: For each line the masks of its words.
        shared: Each test that was made, by its condition: lines that say the same share it.
    """

    scope: Scope
    written: tree.TableDecl
    lines: tuple[Line, ...]
    order: _Order
    boxes: list[dict[str, Box]] = field(init=False)
    masks: list[list[Mask]] = field(init=False)
    rows: dict[str, tree.Row] = field(init=False)
    shared: dict[Expr, Test] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.boxes = [boxes_of(line.tests) for line in self.lines]
        self.masks = [
            [mask for condition in line.conditions if (mask := mask_of(condition)) is not None]
            for line in self.lines
        ]
        self.rows = {row.name: row for row in self.written.rows}

    def reports_endless(self) -> bool:
        """Report a line without conditions that goes before others; return whether there is one."""
        first = {line.name: at for at, line in enumerate(self.lines)}
        for at, line in enumerate(self.lines):
            if any(line.tests) or not any(
                line.name in below or (line.name in self.order.same[name] and at < first[LineName(name)])
                for name, below in self.order.below.items()
                if name in first
            ):
                continue
            what = f"line `{line.name}` matches every input: none that gives way to it could ever match"
            self.scope.report(Code.LINE_ORDER, what, line.cell_span(-1))
            return True
        return False

    def added(self, at: int) -> dict[str, Test]:
        """Return the tests that no line going before this one comes through: one a leaf, so that boxes stay boxes, and "" for the rest."""
        above = self._uppers(at)
        before = [self._before(at, upper) for upper in self._above(at)]
        before += [
            self._before(at, earlier, [upper for upper in self._uppers(earlier) if upper not in above])
            for earlier in self._earlier(at)
        ]
        by_leaf: dict[str, list[_Before]] = {}
        for each in before:
            leaf = str(self._tests(each)[0].variables[0]) if self._of_one_leaf(each) else ""
            by_leaf.setdefault(leaf, []).append(each)
        return {leaf: self._none_of(each) for leaf, each in by_leaf.items()}

    def given(self, at: int, tests: Sequence[Test | None]) -> Line:
        """Return the line with these tests added; their place is that of the line's name."""
        line = self.lines[at]
        split, bounds = 2 * (1 + len(line.tests)), tuple(line.bounds)
        return replace(
            line,
            tests=(*line.tests, *tests),
            bounds=(*bounds[:split], *(bounds[:2] * len(tests)), *bounds[split:]),
            below=tuple(self.lines[upper].name for upper in self._above(at)),
            same=tuple(self.lines[earlier].name for earlier in self._earlier(at)),
        )

    def _above(self, at: int) -> list[int]:
        """Return the lines above a line that can match together with it."""
        return [upper for upper in self._uppers(at) if not self._apart(at, upper)]

    def _earlier(self, at: int) -> list[int]:
        """Return the earlier lines that do the same and can match together with it."""
        return [earlier for earlier in self._same(at) if earlier < at]

    def meetings(self) -> Iterator[Meeting]:
        """Yield the declarations about pairs of lines: those named, and those that do the same through others."""
        places = {line.name: at for at, line in enumerate(self.lines)}
        for row in self.written.rows:
            for lower in (lower for lower in row.above if lower.text in places):
                pair = places[LineName(row.name)], places[LineName(lower.text)]
                yield self._meeting(*pair, (), same=False, span=lower.span)
        spans = {
            frozenset((row.name, other.text)): other.span for row in self.written.rows for other in row.same
        }
        for second, line in enumerate(self.lines):
            for first, other in enumerate(self.lines[:second]):
                span = spans.get(frozenset((line.name, other.name)))
                if span is None and (
                    other.name not in self.order.same[line.name] or self._apart(first, second)
                ):
                    continue
                uppers = dict.fromkeys((*self._uppers(first), *self._uppers(second)))
                yield self._meeting(first, second, tuple(uppers), same=True, span=span or line.cell_span(-1))

    def _meeting(
        self, first: int, second: int, uppers: tuple[int, ...], *, same: bool, span: Span
    ) -> Meeting:
        both = (*self.lines[first].conditions, *self.lines[second].conditions)
        none = [
            negation(conjunction(self.lines[upper].conditions))
            for upper in uppers
            if not self._apart(first, upper) and not self._apart(second, upper)
        ]
        where = conjunction([*both, *none])
        return Meeting(self.lines[first].name, self.lines[second].name, where, same, span)

    def _uppers(self, at: int) -> list[int]:
        above = self.order.below[self.lines[at].name]
        return [upper for upper, line in enumerate(self.lines) if line.name in above]

    def _same(self, at: int) -> list[int]:
        """Return the other lines that do the same and can match together with it."""
        name = self.lines[at].name
        return [
            other
            for other, line in enumerate(self.lines)
            if other != at and line.name in self.order.same[name] and not self._apart(at, other)
        ]

    def _before(self, at: int, upper: int, unless: Sequence[int] = ()) -> _Before:
        """Return a line that goes before another, with the columns of its tests that the other does not imply."""
        tests = self.lines[upper].tests
        stated = [column for column, test in enumerate(tests) if test is not None]
        columns = tuple(column for column in stated if not self._implied(at, tests[column]))
        less = (other for other in unless if not self._apart(at, other) and not self._apart(upper, other))
        return _Before(upper, columns or tuple(stated), tuple(less))

    def _apart(self, at: int, upper: int) -> bool:
        """Return whether the cells show that two lines never match together."""
        boxes, masks = self.boxes[at], self.masks[at]
        return any(
            not meet(box, boxes[leaf]) for leaf, box in self.boxes[upper].items() if leaf in boxes
        ) or any(
            (mask.value ^ mine.value) & mask.care & mine.care
            for mask in self.masks[upper]
            for mine in masks
            if mine.word == mask.word
        )

    def _implied(self, at: int, test: Test | None) -> bool:
        """Return whether the cells show that a test holds wherever the line matches."""
        if test is None or test in self.lines[at].tests:
            return True
        if test.box is None:
            mask = mask_of(test.condition)
            return mask is not None and any(
                mine.word == mask.word
                and mine.care & mask.care == mask.care
                and mine.value & mask.care == mask.value
                for mine in self.masks[at]
            )
        leaf = test.variables[0]
        mine = self.boxes[at].get(leaf, (key_bounds(self.scope.leaves[leaf].type),))
        return meet(mine, test.box) == mine

    def _none_of(self, before: Sequence[_Before]) -> Test:
        """Return the test that none of these lines comes through."""
        condition = conjunction(map(self._not, before))
        if condition not in self.shared:
            words = _merged([(self._words(each), self._of_one_leaf(each)) for each in before])
            text = " and ".join(dict.fromkeys(spell_expr(word, NEGATION) for word in words))
            names = tuple(sorted(set(read_by(condition)), key=self.scope.order))
            box = box_of(condition, self.scope.leaves[names[0]]) if len(names) == 1 else None
            self.shared[condition] = Test(text, condition, names, box)
        return self.shared[condition]

    def _not(self, before: _Before) -> Expr:
        """Return the condition that a line does not match, in these columns, or that one which goes before it does."""
        less = [
            self._not(_Before(other, tuple(range(len(self.lines[other].tests))))) for other in before.unless
        ]
        return negation(conjunction([*(test.condition for test in self._tests(before)), *less]))

    def _tests(self, before: _Before) -> list[Test]:
        tests = self.lines[before.line].tests
        return [test for column in before.columns if (test := tests[column]) is not None]

    def _of_one_leaf(self, before: _Before) -> bool:
        """Return whether these columns compare one leaf with constants."""
        one = len(before.columns) == 1 and not before.unless
        return one and all(test.box is not None for test in self._tests(before))

    def _words(self, before: _Before) -> tree.Expr:
        """Return, as syntax, the condition that the cells of these columns do not hold."""
        row = self.rows[self.lines[before.line].name]
        terms = [
            tree.term(self.written.conditions[column], cell)
            for column in before.columns
            if (cell := row.conditions[column]) is not None
        ]
        terms += [
            self._words(_Before(other, tuple(range(len(self.lines[other].tests))))) for other in before.unless
        ]
        if len(terms) == 1:
            [test] = self._tests(before)
            return _other(terms[0], ordered=_has_opposite(test.condition))
        return tree.Unary("not", reduce(lambda left, right: tree.Binary("and", left, right), terms))


def _merged(words: Sequence[tuple[tree.Expr, bool]]) -> list[tree.Expr]:
    """Return the conditions, those that exclude constants of one subject as one: `a not in {x, y}` for `a /= x`, `a /= y`.

    Each comes with a flag: it compares with constants. Only these join, as a set has constants alone.
    """
    merged: list[tuple[tree.Expr, bool]] = []
    for word, constant in words:
        for at, (other, also) in enumerate(merged):
            whole = _excluded(other, word) if constant and also else None
            if whole is not None:
                merged[at] = whole, True
                break
        else:
            merged.append((word, constant))
    return [word for word, _ in merged]


def _excluded(first: tree.Expr, second: tree.Expr) -> tree.Expr | None:
    """Return the condition that excludes the constants of both; None where one does something else, or the subjects differ."""
    match _excluding(first), _excluding(second):
        case (subject, members), (other, more) if subject == other:
            every = tuple(dict.fromkeys((*members, *more)))
            return first if every == members else tree.InSet(subject, every, negated=True)
    return None


def _excluding(word: tree.Expr) -> tuple[tree.Expr, tuple[tree.Member, ...]] | None:
    """Return the subject of a condition that excludes constants, and the constants; None for any other condition."""
    match word:
        case tree.Binary("/=", subject, tree.Reference() | tree.IntLiteral() | tree.Mask() as value):
            return subject, (value,)
        case tree.InSet(subject, members, negated=True):
            return subject, members
    return None


def _has_opposite(condition: Expr) -> bool:
    """Return whether a condition compares values that can be no NaN: with one, `a < b` and `a >= b` are both false."""
    match condition:
        case Apply(op=op, args=(left, right)):
            return is_comparison(op) and is_finite(left) and is_finite(right)
    return False


def _other(expr: tree.Expr, *, ordered: bool) -> tree.Expr:
    """Return the opposite of a condition; comparisons turn where neither side can be a NaN."""
    match expr:
        case tree.Unary("not", operand):
            return operand
        case tree.Binary("=", left, tree.BoolLiteral(value)):
            return tree.Binary("=", left, tree.BoolLiteral(not value))
        case tree.Binary("=" | "/=" as op, left, right):
            return tree.Binary(_OPPOSITE[op], left, right)
        case tree.Binary(op, left, right) if ordered and op in _OPPOSITE:
            return tree.Binary(_OPPOSITE[op], left, right)
        case tree.InSet() | tree.InRange():
            return replace(expr, negated=not expr.negated)
        case _:
            return tree.Unary("not", expr)
