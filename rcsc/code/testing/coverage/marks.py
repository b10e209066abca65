"""A program whose decisions tell how they went: the C has each of them as the language has it.

In: a program. Out: the same program with marks in its expressions, and its decisions in the order of the C. A mark
stands where an operator stands, gives on what it is given, and notes it; so the interpreter runs a marked program as
it runs any other. A *decision* is a truth made of conditions, as a compiler sees it; one with a single condition
counts where it chooses what is done.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import TypeAlias, TypeVar, cast

from rcsc.code.emit.c.ctext import carried
from rcsc.code.testing.inputs.condition_text import words
from rcsc.lang.expressions.words import mask_of
from rcsc.lang.model import (
    Among,
    Apply,
    Assign,
    Assumption,
    Bool,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Invariant,
    Literal,
    Local,
    Op,
    Program,
    Real,
    Scalar,
    Select,
    Statement,
    Table,
    Test,
    ToElement,
    Value,
    Variable,
)
from rcsc.lang.operator_table import EXTREMES, Arithmetic, Comparison, Operator, is_division

Side = TypeVar("Side")
MOST_WAYS = 5000
"""Ways of a decision that are listed."""

Outcomes: TypeAlias = tuple[bool | None, ...]
"""The truth of each condition of a decision, None for one that is not looked at."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where decisions stand: one function of the C has those of one place, in their order.

    Attributes:
        kind: `procedure`, `line`, `assumption`, `deferred`, `test`, `invariant`, or `operator` for one of the small functions.
        name: Of the procedure, the assumption, the leaf, the invariant, the operator; or of the table.
        part: The line of the table, or the test in words.
    """

    kind: str
    name: str
    part: str = ""

    def __str__(self) -> str:
        """As a report has it: `procedure wait`, `table goto line 3`."""
        if self.kind in ("line", "test"):
            return f"table {self.name} {self.kind} {self.part}"
        return f"{self.kind} {self.name}"


@dataclass(eq=False, slots=True)
class Decision:
    """A truth that the program makes.

    Attributes:
        conditions: What it is made of, in words, in the order in which they are looked at.
        form: The whole of it, without marks; None for the comparison of a small function.
        constant: Numbers of the conditions that are constants: a compiler knows them, and does not count them.
        negated: Numbers of the conditions of which the C tests the opposite.
        seen: How it went, each way once, with its own truth.
    """

    place: Place
    number: int
    conditions: tuple[str, ...] = ()
    form: Expr | None = None
    constant: frozenset[int] = frozenset()
    negated: frozenset[int] = frozenset()
    now: dict[int, bool] = field(default_factory=dict)
    seen: dict[tuple[Outcomes, bool], None] = field(default_factory=dict)

    def end(self, truth: bool) -> None:
        """Note how it went."""
        self.seen[(tuple(self.now.get(at) for at in range(len(self.conditions))), truth)] = None
        self.now = {}


@dataclass(eq=False, frozen=True, slots=True)
class Condition:
    """A mark around a condition; an operator of one truth."""

    decision: Decision
    at: int

    def meaning(self, truth: bool) -> bool:
        """Note the truth and give it."""
        self.decision.now[self.at] = bool(truth)
        return truth


@dataclass(eq=False, frozen=True, slots=True)
class End:
    """A mark around a whole decision; an operator of one truth."""

    decision: Decision

    def meaning(self, truth: bool) -> bool:
        """Note how it went, and give its truth."""
        self.decision.end(bool(truth))
        return truth


@dataclass(eq=False, frozen=True, slots=True)
class Compares:
    """A mark in place of `abs`, `min`, `max` or a division: the small function of the C compares."""

    decision: Decision
    op: Arithmetic
    test: Op

    def meaning(self, *operands: float) -> Value:
        """Note the comparison, and give the value."""
        truth = bool(self.test.meaning(*self.sides(operands, 0)))
        self.decision.now[0] = truth
        self.decision.end(truth)
        value: Value = self.op.meaning(*operands)
        return value

    def sides(self, operands: Sequence[Side], zero: Side) -> tuple[Side, Side]:
        """Return what is compared: the last operand, with the first or with 0."""
        return operands[-1], operands[0] if self.op in EXTREMES else zero


@dataclass(eq=False, frozen=True, slots=True)
class Meets:
    """A mark in place of a comparison of numbers: notes where the two are equal, and of whole numbers where they are one apart."""

    op: Comparison
    seen: dict[int, None] = field(default_factory=dict)

    def meaning(self, left: float, right: float) -> bool:
        """Note how far they are apart, and compare."""
        if left == right or (isinstance(left, int) and abs(left - right) == 1):
            self.seen[int(left - right)] = None
        return bool(self.op.meaning(left, right))


@dataclass(frozen=True, slots=True)
class Marked:
    """A marked program, its decisions in order, and its comparisons of numbers."""

    program: Program
    decisions: tuple[Decision, ...]
    meets: tuple[Meets, ...] = ()

    def forget(self) -> None:
        """Forget how decisions went, and what was compared."""
        for meets in self.meets:
            meets.seen.clear()
        for decision in self.decisions:
            decision.seen = {}
            decision.now = {}


@dataclass(slots=True)
class Marker:
    """Puts marks into one program."""

    decisions: list[Decision] = field(default_factory=list)
    operators: dict[str, Decision] = field(default_factory=dict)
    meets: list[Meets] = field(default_factory=list)
    place: Place = Place("", "")

    def decision(self) -> Decision:
        """A new decision at the present place."""
        self.decisions.append(Decision(self.place, sum(d.place == self.place for d in self.decisions)))
        return self.decisions[-1]

    # --- expressions ---

    def expr(self, expr: Expr, *, chooses: bool = False) -> Expr:
        """An expression with its marks; a truth that `chooses` is a decision whatever it is made of."""
        conditions = list(conditions_of(expr)) if isinstance(expr.type, Bool) else []
        if isinstance(expr, Literal) or (len(conditions) < 2 and not chooses):
            return self.inside(expr)
        decision = self.decision()
        decision.conditions, decision.form = tuple(map(words, conditions)), expr
        decision.constant = frozenset(at for at, each in enumerate(conditions) if isinstance(each, Literal))
        signs = enumerate(_negations(expr, opposite=False))
        decision.negated = frozenset(at for at, negated in signs if negated)
        marked = self.truth(expr, decision, iter(range(len(conditions))))
        return Apply(cast(Operator, End(decision)), (marked,), Bool())

    def truth(self, expr: Expr, decision: Decision, numbers: Iterator[int]) -> Expr:
        """A part of a decision, with a mark around each condition."""
        if isinstance(expr, Among):
            return any_of([self.condition(equal, decision, numbers) for equal in equals_of(expr)])
        if isinstance(expr, Apply) and _is_joint(expr):
            args = tuple(self.truth(arg, decision, numbers) for arg in expr.args)
            return replace(expr, args=args)
        return self.condition(expr, decision, numbers)

    def condition(self, expr: Expr, decision: Decision, numbers: Iterator[int]) -> Expr:
        """A condition with its mark."""
        mark = Condition(decision, next(numbers))
        return Apply(cast(Operator, mark), (self.inside(expr),), Bool())

    def inside(self, expr: Expr) -> Expr:
        """The operands of what is no decision itself."""
        match expr:
            case Select(index=index):
                return replace(expr, index=self.expr(index))
            case Among(subject=subject):
                return replace(expr, subject=self.expr(subject))
            case Apply(op=Op.ABS | Op.MIN | Op.MAX as op, args=args):
                mark = self.operator(op, expr)
                given = tuple(map(self.expr, args))
                return expr if mark is None else replace(expr, op=cast(Operator, mark), args=given)
            case Apply(op=op, args=(whole, divisor)) if is_division(op) and _either_sign(divisor):
                mark, given = self.operator(op, expr), (self.expr(whole), self.expr(divisor))
                return replace(expr, op=cast(Operator, mark), args=given)
            case Apply(op=Op.TO_INT, args=(arg,)) if isinstance(arg.type, Bool):
                return replace(expr, args=(self.expr(arg, chooses=True),))
            case Apply(op=Op.EQ | Op.NE | Op.LT | Op.LE | Op.GT | Op.GE as op, args=args) if _of_numbers(
                expr
            ):
                compared = Meets(op)
                self.meets.append(compared)
                return replace(expr, op=cast(Operator, compared), args=tuple(map(self.expr, args)))
            case Apply(args=args) if mask_of(expr) is None:
                return replace(expr, args=tuple(map(self.expr, args)))
            case _:
                return expr

    def operator(self, op: Arithmetic, expr: Apply) -> Compares | None:
        """The mark of an operator that is a small function in C; None where that has no branch."""
        held = carried(expr)
        if op is Op.ABS and held.startswith("u"):
            return None
        test = {Op.ABS: Op.LE if held in ("double", "float") else Op.LT, Op.MIN: Op.LT}.get(op, Op.GT)
        name = f"{op.value} of {held}"
        if name not in self.operators:
            left = "operand" if op is Op.ABS else "second"
            right = "first" if op in EXTREMES else "0"
            own = Decision(Place("operator", name), 0, (f"{left} {test.value} {right}",))
            self.operators[name] = own
        return Compares(self.operators[name], op, test)

    # --- statements ---

    def block(self, body: Iterable[Statement]) -> tuple[Statement, ...]:
        """Statements with marks."""
        return tuple(map(self.statement, body))

    def statement(self, statement: Statement) -> Statement:
        """A statement with marks, in the order in which the C has its parts."""
        match statement:
            case Assign(place=ToElement(index=index) as place, value=value):
                marked = replace(place, index=self.expr(index))
                return replace(statement, place=marked, value=self.expr(value))
            case Assign(value=value):
                return replace(statement, value=self.expr(value))
            case Local(value=value):
                return statement if value is None else replace(statement, value=self.expr(value))
            case If(condition=condition, then=then, orelse=orelse):
                first = self.expr(condition, chooses=True)
                return replace(statement, condition=first, then=self.block(then), orelse=self.block(orelse))
            case Case():
                return self.case(statement)
            case For(body=body):
                return replace(statement, body=self.block(body))
            case Call(args=args):
                return replace(statement, args=tuple(map(self.expr, args)))

    def case(self, statement: Case) -> Statement:
        """A case as the chain of `if` that it is in C; the subject changes nothing, so that it may be looked at again."""
        if not statement.arms:
            return replace(statement, orelse=self.block(statement.orelse))
        arms = [
            (self.expr(Among(statement.subject, arm.values), chooses=True), self.block(arm.body))
            for arm in statement.arms
        ]
        rest = self.block(statement.orelse)
        for condition, body in reversed(arms):
            rest = (If(condition, body, rest),)
        return rest[0]

    # --- programs ---

    def program(self, program: Program) -> Marked:
        """The whole program."""
        procedures = []
        for procedure in program.procedures:
            self.place = Place("procedure", procedure.name)
            procedures.append(replace(procedure, body=self.block(procedure.body)))
        marked = replace(
            program,
            procedures=tuple(procedures),
            variables=tuple(map(self.deferred, program.variables)),
            assumptions=tuple(map(self.assumption, program.assumptions)),
            invariants=tuple(map(self.invariant, program.invariants)),
            tables=tuple(map(self.table, program.tables)),
        )
        return Marked(marked, (*self.decisions, *self.operators.values()), tuple(self.meets))

    def deferred(self, variable: Variable) -> Variable:
        """A deferred variable."""
        if variable.deferred_until is None:
            return variable
        self.place = Place("deferred", variable.name)
        return replace(variable, deferred_until=self.expr(variable.deferred_until, chooses=True))

    def assumption(self, assumption: Assumption) -> Assumption:
        """An assumption."""
        self.place = Place("assumption", assumption.name)
        return replace(assumption, condition=self.expr(assumption.condition))

    def invariant(self, invariant: Invariant) -> Invariant:
        """An invariant, which `check` chooses by."""
        self.place = Place("invariant", invariant.name)
        return replace(invariant, condition=self.expr(invariant.condition, chooses=True))

    def table(self, table: Table) -> Table:
        """A table: its relational tests, each once, and what its lines do."""
        tests: dict[int, Test] = {}
        for line in table.lines:
            for test in line.tests:
                if test is not None and test.box is None and id(test) not in tests:
                    self.place = Place("test", table.name, test.text)
                    tests[id(test)] = replace(test, condition=self.expr(test.condition, chooses=True))
        lines = []
        for line in table.lines:
            self.place = Place("line", table.name, line.name)
            own = tuple(None if test is None else tests.get(id(test), test) for test in line.tests)
            actions = tuple(replace(a, statement=self.statement(a.statement)) for a in line.actions)
            lines.append(replace(line, tests=own, actions=actions))
        default = table.default
        if default is not None:
            self.place = Place("line", table.name, default.name)
            actions = tuple(replace(a, statement=self.statement(a.statement)) for a in default.actions)
            default = replace(default, actions=actions)
        return replace(table, lines=tuple(lines), default=default)


def conditions_of(expr: Expr) -> Iterator[Expr]:
    """The conditions of a decision, in the order of the C."""
    if isinstance(expr, Among):
        yield from equals_of(expr)
    elif isinstance(expr, Apply) and _is_joint(expr):
        for arg in expr.args:
            yield from conditions_of(arg)
    else:
        yield expr


def ways_of(expr: Expr) -> list[tuple[Outcomes, bool]]:
    """Every way in which a decision can go, as far as its form allows."""
    count = len(list(conditions_of(expr)))
    ways = islice(_ways(expr, count_from=iter(range(count))), MOST_WAYS)
    return [(tuple(known.get(at) for at in range(count)), truth) for known, truth in ways]


def _ways(expr: Expr, count_from: Iterator[int]) -> list[tuple[dict[int, bool], bool]]:
    if isinstance(expr, Among):
        parts = [_ways(equal, count_from) for equal in equals_of(expr)] if equals_of(expr) != [expr] else []
        return _joined_ways(Op.OR, parts) if parts else _leaf(next(count_from))
    if isinstance(expr, Apply) and _is_joint(expr):
        parts = [_ways(arg, count_from) for arg in expr.args]
        if expr.op is Op.NOT:
            return [(known, not truth) for known, truth in parts[0]]
        return _joined_ways(cast(Op, expr.op), parts)
    return _leaf(next(count_from))


def _leaf(at: int) -> list[tuple[dict[int, bool], bool]]:
    return [({at: True}, True), ({at: False}, False)]


def _joined_ways(
    op: Op, parts: list[list[tuple[dict[int, bool], bool]]]
) -> list[tuple[dict[int, bool], bool]]:
    """The second operand is looked at only where the first one does not decide."""
    whole = parts[0]
    for part in parts[1:]:
        goes_on = op is not Op.OR
        whole = [
            joined
            for known, truth in whole
            for joined in (
                [({**known, **more}, last) for more, last in part]
                if truth is goes_on
                else [(known, truth if op is not Op.IMPLIES else True)]
            )
        ][: MOST_WAYS + 1]
    return whole


def _negations(expr: Expr, *, opposite: bool) -> Iterator[bool]:
    """Of each condition, whether it stands in the C with a `!` of its own, which belongs to it."""
    if isinstance(expr, Apply) and _is_joint(expr):
        if expr.op is Op.NOT:
            yield from _negations(expr.args[0], opposite=not opposite)
            return
        yield from _negations(expr.args[0], opposite=expr.op is Op.IMPLIES)
        yield from _negations(expr.args[1], opposite=False)
    elif isinstance(expr, Among) and len(equals_of(expr)) != 1:
        yield from (False for _ in equals_of(expr))
    else:
        yield opposite


def _either_sign(divisor: Expr) -> bool:
    """Whether a divisor may be negative or positive by its type: then a small function of the C divides."""
    return isinstance(divisor.type, Int) and divisor.type.low < 0 < divisor.type.high


def _of_numbers(expr: Apply) -> bool:
    """Whether it compares numbers; a mask is one comparison."""
    return isinstance(expr.args[0].type, Int | Real) and mask_of(expr) is None


def _is_joint(expr: Apply) -> bool:
    """Whether it joins conditions; a mask is one comparison."""
    return expr.op in (Op.AND, Op.OR, Op.IMPLIES, Op.NOT) and mask_of(expr) is None


def equals_of(expr: Among) -> list[Expr]:
    """Membership as the comparisons that it is in C."""
    kind: Scalar = expr.subject.type
    if isinstance(expr.subject, Literal):
        return [expr]
    return [Apply(Op.EQ, (expr.subject, Literal(value, kind)), Bool()) for value in expr.values]


def any_of(exprs: Sequence[Expr]) -> Expr:
    """That one of them holds."""
    if not exprs:
        return Literal(value=False, type=Bool())
    whole = exprs[0]
    for expr in exprs[1:]:
        whole = Apply(Op.OR, (whole, expr), Bool())
    return whole


def marked(program: Program) -> Marked:
    """The program with its marks."""
    return Marker().program(program)
