"""Symbolic runs: what conditions and statements compute, and what they owe on the way.

In: expressions and statements of the model. Out: terms, the state after the run, and obligations. Ways through `if` and `case`
are followed once each and joined; loops are unrolled, calls run in place. What is owed: no result or operand outside the 64 bits that
its operation works in, no division by zero, no index outside its array, no value outside the range of what keeps it, no local read
before it is assigned.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, assert_never

from rcsc.base.diagnostics.source import Span as Written
from rcsc.lang.model import (
    COMPARISONS,
    I64_MAX,
    I64_MIN,
    NOWHERE,
    U64_MAX,
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Expr,
    For,
    If,
    Int,
    Literal,
    Local,
    Place,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Statement,
    ToElement,
    ToLeaf,
    ToLocal,
)
from rcsc.lang.operator_table import Logic, Op, Strict, is_logic
from rcsc.proof.certify.values import BOOL, INT, Number, Term, Terms, ends_of, sort_of

MOST_STEPS = 100_000
"""Statements and elements that one run follows."""

PAIRS = ((True, True), (True, False), (False, True), (False, False))
Pairs: TypeAlias = tuple[tuple[bool, bool], ...]


def true_of(op: Logic) -> Pairs:
    """Return the pairs of operands for which a logic operator is true."""
    match op:
        case Op.AND:
            return ((True, True),)
        case Op.OR:
            return ((True, True), (True, False), (False, True))
        case Op.XOR:
            return ((True, False), (False, True))
        case Op.IMPLIES:
            return ((True, True), (False, True), (False, False))


class TooLongError(Exception):
    """A run has more steps than are followed."""


@dataclass(frozen=True, slots=True, eq=False)
class Owed:
    """An obligation: wherever the path is taken, `good` holds."""

    name: str
    written: Written
    path: Term
    good: Term
    number: int


@dataclass(slots=True)
class State:
    """Values at a point of a run.

    Attributes:
        leaves: Of leaves written so far.
        assigned: For a local that was declared without a value, when it has one.
        wrote: When the present action has written each leaf.
    """

    leaves: dict[str, Term] = field(default_factory=dict)
    local: dict[str, Term] = field(default_factory=dict)
    assigned: dict[str, Term] = field(default_factory=dict)
    wrote: dict[str, Term] = field(default_factory=dict)

    def copy(self) -> "State":
        """Return an independent copy."""
        return State(dict(self.leaves), dict(self.local), dict(self.assigned), dict(self.wrote))


class Start:
    """The values and terms with which all runs of a program begin."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.terms = Terms()
        self.types = {str(v.name): v.type for v in program.variables}
        self.leaves = {name: self.terms.variable(name, kind) for name, kind in self.types.items()}
        self.procedures = {str(procedure.name): procedure for procedure in program.procedures}
        # by identity; the expression is kept, so that its identity is not used again
        self._conditions: dict[int, tuple[Expr, Term]] = {}

    def condition(self, expr: Expr) -> Term:
        """Return a condition evaluated before a run; its own obligations are owed elsewhere."""
        known = self._conditions.get(id(expr))
        if known is None:
            known = self._conditions[id(expr)] = expr, Run(self, "").evaluate(expr)
        return known[1]


class Run:
    """One run.

    Attributes:
        where: The name of the run, for the names of obligations.
        cell: The place in the text of the part that runs.
    """

    def __init__(self, start: Start, where: str, cell: Written = NOWHERE) -> None:
        self.start, self.terms, self.where, self.cell = start, start.terms, where, cell
        self.state, self.path, self.owed = State(), start.terms.true, list[Owed]()
        self._steps = self._fresh = 0

    def owe(self, what: str, good: Term, written: Written = NOWHERE) -> int:
        """Add an obligation; return its number."""
        number = len(self.owed)
        place = written if written.file else self.cell
        self.owed.append(Owed(f"{self.where}: {what}", place, self.path, good, number))
        return number

    def _inside(self, value: Term, low: Number, high: Number) -> Term:
        least, greatest = self.terms.constant(value.sort, low), self.terms.constant(value.sort, high)
        return self.terms.every((self.terms.make("<=", least, value), self.terms.make("<=", value, greatest)))

    def _step(self, many: int = 1) -> None:
        self._steps += many
        if self._steps > MOST_STEPS:
            raise TooLongError

    # --- expressions ---

    def leaf(self, name: str) -> Term:
        """Return the present value of a leaf."""
        return self.state.leaves.get(name) or self.start.leaves[name]

    def any_value(self, name: str, kind: Scalar) -> Term:
        """Return a fresh value of which only the type is known."""
        self._fresh += 1
        return self.terms.variable(f"{name} ({self._fresh})", kind)

    def evaluate(self, expr: Expr) -> Term:
        """Return the value of an expression."""
        terms = self.terms
        match expr:
            case Literal(value=value, type=kind):
                return terms.constant(sort_of(kind), value)
            case Read(name=name):
                return self.leaf(name)
            case ReadLocal(name=name, type=kind, span=written):
                if name in self.state.assigned:
                    self.owe(f"`{name}` is assigned before it is read", self.state.assigned[name], written)
                if name not in self.state.local:
                    self.state.local[name] = self.any_value(name, kind)
                return self.state.local[name]
            case Select(leaves=leaves, index=index):
                return self._element(leaves, self.index(index, len(leaves)))
            case Among(subject=subject, values=values):
                return self._among(self.evaluate(subject), values)
            case Apply(args=args):
                op = expr.op
                if is_logic(op):
                    return self._truth(true_of(op), *args)
                return self._applied(expr, op, [self.evaluate(arg) for arg in args])

    def _among(self, subject: Term, values: Iterable[object]) -> Term:
        constants = (
            self.terms.constant(subject.sort, value) for value in values if isinstance(value, int | float)
        )
        return self.terms.some(self.terms.make("=", subject, term) for term in constants)

    def _truth(self, true: Pairs, first: Expr, second: Expr) -> Term:
        """Evaluate a logic operator; its right side counts only where the left does not decide."""
        left, path = self.evaluate(first), self.path
        open_for = [a for a in (True, False) if ((a, True) in true) != ((a, False) in true)]
        if len(open_for) == 1:
            self.path = self.terms.every((path, self._either_way(left, open_for[0])))
        right = self.evaluate(second)
        self.path = path
        false_of = [pair for pair in PAIRS if pair not in true]
        if len(false_of) == 1:
            [(a, b)] = false_of
            return self.terms.some((self._either_way(left, not a), self._either_way(right, not b)))
        return self.terms.some(
            self.terms.every((self._either_way(left, a), self._either_way(right, b))) for a, b in true
        )

    def _either_way(self, condition: Term, yes: bool) -> Term:
        return condition if yes else self.terms.negation(condition)

    def index(self, expr: Expr, length: int) -> Term:
        """Evaluate an index of an array of this length; owe that it lies inside."""
        at = self.evaluate(expr)
        self.owe(f"the index lies in 0 .. {length - 1}", self._inside(at, 0, length - 1), expr.span)
        return at

    def _element(self, leaves: Sequence[str], at: Term) -> Term:
        if at.op == "constant":
            return self.leaf(leaves[min(max(int(at.low), 0), len(leaves) - 1)])
        self._step(len(leaves))
        element = self.leaf(leaves[-1])
        for number, name in reversed(list(enumerate(leaves[:-1]))):
            here = self.terms.make("=", at, self.terms.constant(INT, number))
            element = self.terms.choice(here, self.leaf(name), element)
        return element

    def _applied(self, expr: Apply, op: Strict, args: list[Term]) -> Term:
        kinds = [kind for kind in (*(arg.type for arg in expr.args), expr.type) if isinstance(kind, Int)]
        whole = isinstance(expr.args[0].type, Int) and op not in (Op.TO_REAL, Op.TO_SINGLE)
        if op in (Op.DIV, Op.MOD):
            zero = self.terms.constant(args[1].sort, 0)
            nonzero = self.terms.negation(self.terms.make("=", args[1], zero))
            self.owe("the divisor is not zero", nonzero, expr.args[1].span)
        if not whole:
            if op is Op.TO_INT and args[0].sort == BOOL:
                return self.terms.choice(args[0], *(self.terms.constant(INT, number) for number in (1, 0)))
            if op is Op.TO_INT:
                return self._truncated(args[0], kinds, expr.span)
            return self._operation(op, args)
        ends = _word(kinds)
        for arg, written in zip(args, expr.args, strict=True):
            self._owe_word(arg, ends, "an operand", written.span)
        if op in COMPARISONS:
            return self._operation(op, args)
        if op is Op.MOD:  # the machine divides first
            self._owe_word(self._operation(Op.DIV, args), ends, "the quotient", expr.span)
        result = self._operation(op, args)
        self._owe_word(result, ends, f"the result of `{op.value}`", expr.span)
        return result

    def _owe_word(self, value: Term, ends: tuple[int, int], what: str, written: Written) -> None:
        if value.op == "constant" and ends[0] <= value.low <= ends[1]:
            return
        if value.op == "variable" and ends[0] <= value.low and value.high <= ends[1]:
            return
        self.owe(f"{what} stays in its 64 bits", self._inside(value, *ends), written)

    def _truncated(self, value: Term, kinds: list[Int], written: Written) -> Term:
        """Return the whole number of a double; owe that it fits its 64 bits, which a NaN never does."""
        low, high = _word(kinds)
        make, real = self.terms.make, self.terms.constant
        sort = value.sort
        above = make("<", real(sort, -1.0), value) if low == 0 else make("<=", real(sort, float(low)), value)
        fits = self.terms.every((above, make("<", value, real(sort, float(high)))))
        self.owe("the whole number stays in its 64 bits", fits, written)
        return make("int", value)

    def _operation(self, op: Strict, args: list[Term]) -> Term:
        """Return the result of one operator; `a min b` is b where b < a, else a, and `a max b` is b where b > a."""
        make, terms = self.terms.make, self.terms
        match op:
            case Op.NOT:
                return terms.negation(args[0])
            case Op.EQ | Op.LT | Op.LE | Op.ADD | Op.SUB | Op.MUL | Op.DIV | Op.MOD:
                return make(op.value, *args)
            case Op.NE:
                return terms.negation(make("=", *args))
            case Op.GT:
                return make("<", args[1], args[0])
            case Op.GE:
                return make("<=", args[1], args[0])
            case Op.MIN:
                return terms.choice(make("<", args[1], args[0]), args[1], args[0])
            case Op.MAX:
                return terms.choice(make("<", args[0], args[1]), args[1], args[0])
            case Op.ABS if args[0].sort == INT:
                return terms.choice(make("<", args[0], terms.constant(INT, 0)), make("neg", args[0]), args[0])
            case Op.ABS:
                return make("abs", *args)
            case Op.NEG:
                return make("neg", *args)
            case Op.TO_INT | Op.TO_REAL | Op.TO_SINGLE:
                return make(op.value, *args)

    # --- statements ---

    def execute(self, body: Iterable[Statement]) -> None:
        """Run the statements."""
        for statement in body:
            self._step()
            match statement:
                case Assign(place=place, value=value):
                    self._assign(place, value)
                case Local(name=name, type=kind, value=value):
                    self.state.local.pop(name, None)
                    self.state.assigned[name] = self.terms.false
                    if value is not None:
                        self._set_local(name, self._stored(kind, self.evaluate(value), name, value.span))
                case If(condition=condition, then=then, orelse=orelse):
                    self._branch(self.evaluate(condition), then, orelse)
                case Case(subject=subject, arms=arms, orelse=orelse):
                    given = self.evaluate(subject)
                    self._arms([(self._among(given, arm.values), arm.body) for arm in arms], orelse)
                case For(name=name, low=low, high=high, body=inner):
                    for count in range(low, high + 1):
                        self.state.local[name] = self.terms.constant(INT, count)
                        self.execute(inner)
                case Call(procedure=name, args=args):
                    given_ = [(self.evaluate(arg), arg.span) for arg in args]
                    self.call(self.start.procedures[name], given_)
                case _:
                    assert_never(statement)

    def _stored(self, kind: Scalar, value: Term, what: str, written: Written) -> Term:
        """Return the value as stored in a place of this type; owe that it fits the range."""
        low, high = ends_of(kind)
        if not isinstance(kind, Int | Real) or (value.op == "constant" and low <= value.low <= high):
            return value
        number = self.owe(f"`{what}` stays in {low} .. {high}", self._inside(value, low, high), written)
        return self.terms.kept(value, low, high, number)

    def _set_local(self, name: str, value: Term) -> None:
        self.state.local[name] = value
        self.state.assigned.pop(name, None)

    def _assign(self, place: Place, value: Expr) -> None:
        term = self.evaluate(value)
        match place:
            case ToLeaf(name=name, type=kind):
                self.write(name, self._stored(kind, term, name, value.span), self.terms.true)
            case ToLocal(name=name, type=kind):
                self._set_local(name, self._stored(kind, term, name, value.span))
            case ToElement(leaves=leaves, index=index, type=kind):
                stored = self._stored(kind, term, leaves[0], value.span)
                at = self.index(index, len(leaves))
                self._step(len(leaves))
                for number, leaf in enumerate(leaves):
                    self.write(leaf, stored, self.terms.make("=", at, self.terms.constant(INT, number)))
            case _:
                assert_never(place)

    def write(self, leaf: str, value: Term, when: Term) -> None:
        """Write a leaf where `when` holds."""
        if when is self.terms.false:
            return
        self.state.leaves[leaf] = self.terms.choice(when, value, self.leaf(leaf))
        self.state.wrote[leaf] = self.terms.some((self.state.wrote.get(leaf, self.terms.false), when))

    def _branch(self, condition: Term, then: Sequence[Statement], orelse: Sequence[Statement]) -> None:
        if condition.op == "constant":
            self.execute(then if condition.low else orelse)
        else:
            self._arms([(condition, then)], orelse)

    def _arms(self, arms: list[tuple[Term, Sequence[Statement]]], orelse: Sequence[Statement]) -> None:
        """Run the first arm whose condition holds, else `orelse`."""
        if not arms:
            self.execute(orelse)
            return
        (condition, body), *others = arms
        before, path = self.state, self.path
        self.state, self.path = before.copy(), self.terms.every((path, condition))
        self.execute(body)
        after = self.state
        self.state, self.path = before, self.terms.every((path, self.terms.negation(condition)))
        self._arms(others, orelse)
        self.path = path
        self.state = self._merged(condition, after, self.state)

    def _merged(self, condition: Term, then: State, orelse: State) -> State:
        self._step(len(then.leaves) + len(orelse.leaves))
        choice, start = self.terms.choice, self.start.leaves

        def joined(a: dict[str, Term], b: dict[str, Term], otherwise: Term) -> dict[str, Term]:
            return {
                name: choice(condition, a.get(name, otherwise), b.get(name, otherwise)) for name in {**a, **b}
            }

        leaves = {
            name: choice(
                condition, then.leaves.get(name) or start[name], orelse.leaves.get(name) or start[name]
            )
            for name in {**then.leaves, **orelse.leaves}
        }
        local = {
            name: choice(
                condition,
                then.local.get(name) or orelse.local[name],
                orelse.local.get(name) or then.local[name],
            )
            for name in {**then.local, **orelse.local}
        }  # a local of one side only was never assigned on the other: reading it there is owed not to happen
        assigned = joined(then.assigned, orelse.assigned, self.terms.true)
        return State(leaves, local, assigned, joined(then.wrote, orelse.wrote, self.terms.false))

    # --- calls ---

    def call(self, procedure: Procedure, args: Iterable[tuple[Term, Written]]) -> None:
        """Run a procedure; an extern one gives any value in range, or ends the cycle at any of its results."""
        given = {
            param.name: self._stored(param.type, value, param.name, written)
            for param, (value, written) in zip(procedure.params, args, strict=True)
        }
        if procedure.extern is not None:
            for name in procedure.writes:
                self.stops(procedure)
                self.write(
                    name,
                    self.any_value(f"{name} from {procedure.name}", self.start.types[name]),
                    self.terms.true,
                )
            return
        outer = self.state.local, self.state.assigned
        self.state.local, self.state.assigned = given, {}
        self.execute(procedure.body)
        self.state.local, self.state.assigned = outer

    def stops(self, procedure: Procedure) -> None:
        """Owe the invariants of a cycle that ends as a result of the procedure is refused; here none."""

    def keeps(self, invariants: Iterable[tuple[str, Expr, frozenset[str]]], when: str = "") -> None:
        """Owe every invariant that reads a written leaf."""
        for name, condition, reads in invariants:
            if not reads.isdisjoint(self.state.leaves):
                after = Run(self.start, "")
                after.state = State(self.state.leaves)
                self.owe(f"invariant `{name}` is kept{when}", after.evaluate(condition))


def _word(kinds: Iterable[Int]) -> tuple[int, int]:
    """Return the bounds of the 64 bits in which an operation on these works: unsigned where none can be negative."""
    return (0, U64_MAX) if min(kind.low for kind in kinds) >= 0 else (I64_MIN, I64_MAX)
