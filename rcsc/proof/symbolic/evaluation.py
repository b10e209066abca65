"""Symbolic values of expressions, and what evaluating them owes.

In: expressions and a state. Out: values, and obligations: at which place, on which path, what must hold
there. Once owed, an obligation is assumed to hold: later values rest on it, and only the
first that fails is reported.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions import intervals
from rcsc.lang.model import (
    NOWHERE,
    Among,
    Apply,
    Bool,
    Expr,
    Int,
    Literal,
    Procedure,
    Read,
    ReadLocal,
    Scalar,
    Select,
)
from rcsc.lang.operator_table import (
    DIVIDED_FIRST,
    UNDECIDED,
    Arithmetic,
    Logic,
    Op,
    is_comparison,
    is_division,
    is_logic,
)
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, TRUE, Fact, Node

MOST_STEPS = 2_000_000
"""Statements and array elements that one run follows."""

_LEAVES = "can leave 64 bits"


class TooLongError(Exception):
    """A run has more steps than are followed."""


@dataclass(frozen=True, slots=True, eq=False)
class Obligation:
    """Something that must hold at a place.

    Attributes:
        path: When the place is reached.
        good: What must hold there.
    """

    code: Code
    message: str
    span: Span
    path: Node
    good: Node


@dataclass(frozen=True, slots=True, eq=False)
class ExternResults:
    """A call of an extern procedure.

    Attributes:
        path: When it is made.
        results: What it gives, in the order in which it writes.
        refusals: Whether each is refused, if it comes to that; FALSE where it cannot be.
    """

    procedure: str
    path: Node
    results: tuple[Node, ...]
    refusals: tuple[Node, ...]


@dataclass(slots=True)
class State:
    """Values at one point of a run.

    Attributes:
        leaves: Of the leaves written so far; the others are as they were.
        local: Of parameters, locals and loop variables.
        assigned: For a local declared without a value, when it has one.
        wrote: For each leaf that the present action may have written, when it has.
    """

    leaves: dict[str, Node] = field(default_factory=dict)
    local: dict[str, Node] = field(default_factory=dict)
    assigned: dict[str, Node] = field(default_factory=dict)
    wrote: dict[str, Node] = field(default_factory=dict)

    def copy(self) -> "State":
        """Return a state that can go its own way."""
        return State(dict(self.leaves), dict(self.local), dict(self.assigned), dict(self.wrote))


def _word_of(expr: Apply) -> tuple[int, int]:
    """Return the 64-bit type in which integer operands and result of an operation stand."""
    return intervals.word(
        kind for kind in (*(arg.type for arg in expr.args), expr.type) if isinstance(kind, Int)
    )


@dataclass(slots=True)
class Evaluation:
    """One symbolic run, as far as expressions go.

    Attributes:
        procedures: All of the program's, by name.
        kinds: The type of every leaf.
        start: The leaves before the run, made as they are met; runs may share it.
        obligations: What is owed and bounds do not settle, in the order met.
        settled: How many obligations bounds settled.
        stops: Called where a cycle may end early (an extern procedure's result is refused).
        cell: Where the present action or condition is written.
        fresh: Values that the run has made up: results of extern procedures, locals without a value.
        suffix: After their names, where one question follows several runs; each run has its own.
        refusals: Whether results of extern procedures may be refused; else a run goes on as if none were.
        ended: Where one was refused: later writes have no effect.
        answered: What extern procedures give, in the order in which they can be called.
    """

    procedures: Mapping[str, Procedure]
    kinds: Mapping[str, Scalar]
    start: dict[str, Node]
    state: State = field(default_factory=State)
    path: Node = TRUE
    facts: dict[Node, Fact] = field(default_factory=dict)
    obligations: list[Obligation] = field(default_factory=list)
    settled: int = 0
    stops: Callable[["Evaluation", str], None] | None = None
    cell: Span = NOWHERE
    fresh: list[Node] = field(default_factory=list)
    suffix: str = ""
    steps: int = 0
    refusals: bool = False
    ended: Node = FALSE
    answered: list[ExternResults] = field(default_factory=list)

    # --- owing ---

    def owe(self, code: Code, message: str, span: Span, good: Node) -> None:
        """Adds an obligation, unless the bounds settle it."""
        if self.path is FALSE or (good.known and good.low):
            self.settled += 1
        else:
            there = span if span.file else self.cell  # an expression in a table's cell is found by the cell
            self.obligations.append(Obligation(code, message, there, self.path, good))

    def owe_inside(
        self, code: Code, node: Node, ends: tuple[int | float, int | float], message: str, span: Span
    ) -> Node:
        """Owes that the node lies within the ends; from then on it does."""
        low, high = ends
        if node.ordered and low <= node.low and node.high <= high:
            self.settled += 1
            return node
        self.owe(code, message, span, values.inside(node, low, high))
        return values.narrowed(node, low, high)

    def assume(self, condition: Node) -> None:
        """Use the bounds of what is known from the start; the asker asserts it."""
        values.learn(condition, self.facts)

    @contextmanager
    def where(self, condition: Node, *, holds: bool = True) -> Iterator[None]:
        """Inside, the path is the one on which the condition holds (or does not)."""
        path, facts = self.path, self.facts
        self.path = values.both(path, condition if holds else values.negation(condition))
        self.facts = dict(facts)
        values.learn(condition, self.facts, holds=holds)
        yield
        self.path, self.facts = path, facts

    def step(self, many: int = 1) -> None:
        """Counts what is followed."""
        self.steps += many
        if self.steps > MOST_STEPS:
            raise TooLongError

    # --- expressions ---

    def evaluate(self, expr: Expr) -> Node:
        """Return the value of an expression; what it owes is added."""
        match expr:
            case Literal(value=value, type=kind):
                return values.constant(kind, value)
            case Read(name=name):
                return self.leaf(name)
            case ReadLocal(name=name, type=kind, span=span):
                return self._local(name, kind, span)
            case Select(leaves=leaves, index=index):
                return self._selected(leaves, self.index(index, len(leaves)))
            case Among(subject=subject, values=members):
                return values.among(self.evaluate(subject), members)
            case Apply():
                return self._applied(expr)

    def leaf(self, name: str) -> Node:
        """Return the value of a leaf, within what is known of it here."""
        node = self.state.leaves.get(name)
        if node is None:
            if name not in self.start:
                self.start[name] = values.variable(name, self.kinds[name])
            node = self.start[name]
        return self._sharpened(node)

    def _sharpened(self, node: Node) -> Node:
        fact = self.facts.get(values.root(node))
        return node if fact is None else values.narrowed(node, *fact)

    def _local(self, name: str, kind: Scalar, span: Span) -> Node:
        good = self.state.assigned.get(name, TRUE)
        message = f"`{name}` can be read before it is assigned"
        self.owe(Code.USE_BEFORE_ASSIGNMENT, message, span, good)
        if name not in self.state.local:
            self.state.local[name] = self.any_value(name, kind)
        return self._sharpened(self.state.local[name])

    def any_value(self, name: str, kind: Scalar) -> Node:
        """Return a value of the type of which nothing else is known."""
        self.fresh.append(values.variable(f"{name}!{len(self.fresh) + 1}{self.suffix}", kind))
        return self.fresh[-1]

    def index(self, expr: Expr, length: int) -> Node:
        """Return an index of an array of this length."""
        message = f"the index can lie outside 0 .. {length - 1}"
        return self.owe_inside(Code.INDEX, self.evaluate(expr), (0, length - 1), message, expr.span)

    def _selected(self, leaves: tuple[str, ...], index: Node) -> Node:
        low, high = max(int(index.low), 0), min(int(index.high), len(leaves) - 1)
        low = min(low, high)
        self.step(high - low)
        selected = self.leaf(leaves[high])
        for at in range(high - 1, low - 1, -1):
            here = values.equal(index, values.constant(index.kind, at))
            selected = values.choice(here, self.leaf(leaves[at]), selected)
        return selected

    def _logic(self, op: Logic, first: Expr, second: Expr) -> Node:
        """Evaluate a truth function; the right operand is looked at only where the left one does not decide."""
        left = self.evaluate(first)
        if len(UNDECIDED[op]) == 2:
            return values.logic(op, left, self.evaluate(second))
        with self.where(left, holds=True in UNDECIDED[op]):
            right = self.evaluate(second)
        return values.logic(op, left, right)

    def _applied(self, expr: Apply) -> Node:
        op = expr.op
        if is_logic(op):
            return self._logic(op, *expr.args)
        args = tuple(self.evaluate(arg) for arg in expr.args)
        if is_comparison(op):
            return values.compare(op, *self._in_words(expr, args))
        match op:
            case Op.NOT:
                return values.negation(args[0])
            case Op.TO_INT if isinstance(args[0].kind, Bool):
                return values.choice(args[0], values.constant(expr.type, 1), values.constant(expr.type, 0))
            case Op.TO_INT:
                assert isinstance(expr.type, Int)
                return self._truncated(expr, args[0], expr.type)
            case Op.TO_REAL | Op.TO_SINGLE:
                return values.arithmetic(op, args, expr.type)
            case _:
                return self._number(op, expr, args)

    def _divisor(self, expr: Apply, args: tuple[Node, ...]) -> tuple[Node, ...]:
        divisor = args[1]
        nonzero = values.negation(values.equal(divisor, values.constant(divisor.kind, 0)))
        self.owe(Code.DIVISION_BY_ZERO, "the divisor can be zero", expr.args[1].span, nonzero)
        facts: dict[Node, Fact] = {}
        values.learn(nonzero, facts)
        fact = facts.get(values.root(divisor))
        return args[0], divisor if fact is None else values.narrowed(divisor, *fact)

    def _number(self, op: Arithmetic, expr: Apply, args: tuple[Node, ...]) -> Node:
        if is_division(op):
            args = self._divisor(expr, args)
        if not isinstance(expr.type, Int):
            return values.arithmetic(op, args, expr.type)
        args, ends = self._in_words(expr, args), _word_of(expr)
        if op in DIVIDED_FIRST:
            quotient = values.arithmetic(Op.DIV, args, expr.type)
            self.owe_inside(Code.OVERFLOW, quotient, ends, f"the {Op.DIV.result} {_LEAVES}", expr.span)
        result = values.arithmetic(op, args, expr.type)
        return self.owe_inside(Code.OVERFLOW, result, ends, f"the {op.result} {_LEAVES}", expr.span)

    def _in_words(self, expr: Apply, args: tuple[Node, ...]) -> tuple[Node, ...]:
        """Operands that are integers within the 64 bits that they share with each other and the result."""
        if not isinstance(expr.args[0].type, Int):
            return args
        message = "this value can lie outside the 64 bits in which it is used"
        return tuple(
            self.owe_inside(Code.OVERFLOW, arg, _word_of(expr), message, written.span)
            for arg, written in zip(args, expr.args, strict=True)
        )

    def _truncated(self, expr: Apply, arg: Node, kind: Int) -> Node:
        """Return a double without its fraction, where that is in 64 bits; never so of a NaN."""
        low, high = intervals.word([kind])
        least = values.constant(arg.kind, -1.0 if low == 0 else float(low))
        above = values.compare(Op.LT if low == 0 else Op.LE, least, arg)
        below = values.compare(Op.LT, arg, values.constant(arg.kind, float(high)))
        self.owe(Code.OVERFLOW, f"the whole number {_LEAVES}", expr.span, values.both(above, below))
        return values.narrowed(values.arithmetic(Op.TO_INT, (arg,), kind), low, high)
