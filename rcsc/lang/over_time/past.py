"""What a condition remembers: states of a monitor for `once`, `since`, `for` and `was` anywhere in it.

In: resolved conditions of a cycle, inner ones first. Out: the condition that stands for each, over states that are stored in every cycle
before what reads them. Before the first cycle nothing has been: there `once`, `since` and `for` are false, and leaves as the level begins.

Source of the meaning: past-time linear temporal logic, as in Havelund and Rosu, *Synthesizing monitors for safety properties*, 2002; but
for `was` in the first cycle, which finds the values with which the level begins.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import reduce

from rcsc.lang.leaves import renamed
from rcsc.lang.model import (
    BEFORE,
    WATCHED,
    Apply,
    Assign,
    Bool,
    Expr,
    Hidden,
    If,
    Int,
    Literal,
    Op,
    Read,
    Scalar,
    Statement,
    ToLeaf,
    Value,
    VariableName,
    earlier,
)

TRUE, FALSE = (Literal(value=value, type=Bool()) for value in (True, False))


# --- conditions ------------------------------------------------------------------------------


def negation(term: Expr) -> Expr:
    """Return the negation; of a constant, a constant."""
    if isinstance(term, Literal):
        return Literal(value=not term.value, type=Bool())
    if isinstance(term, Apply) and term.op is Op.NOT:
        return term.args[0]
    return Apply(Op.NOT, (term,), Bool())


def both(*terms: Expr) -> Expr:
    """Return the conjunction, without constants."""
    return _joined(Op.AND, TRUE, FALSE, terms)


def either(*terms: Expr) -> Expr:
    """Return the disjunction, without constants."""
    return _joined(Op.OR, FALSE, TRUE, terms)


def _joined(op: Op, neutral: Literal, deciding: Literal, terms: Iterable[Expr]) -> Expr:
    left = [term for term in terms if term != neutral]
    if deciding in left:
        return deciding
    return reduce(lambda first, other: Apply(op, (first, other), Bool()), left) if left else neutral


def number(value: int) -> Expr:
    """Return a constant."""
    return Literal(value, Int(value, value))


# --- states ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class State:
    """A state: as the cycle finds it, `was`, and as it leaves it, `now`."""

    name: VariableName
    type: Scalar

    @property
    def now(self) -> Expr:
        """It, as the cycle leaves it."""
        return Read(self.name, self.type)

    @property
    def was(self) -> Expr:
        """It, as the cycle finds it."""
        return Read(earlier(self.name), self.type)

    def was_from(self, low: int, high: int) -> Expr:
        """Return the condition that the cycle finds it between two numbers."""
        assert isinstance(self.type, Int)
        least = TRUE if low <= self.type.low else _compared(Op.GE, self.was, low)
        return both(least, TRUE if high >= self.type.high else _compared(Op.LE, self.was, high))

    def set(self, value: Expr) -> Statement:
        """Return the statement that gives it a value."""
        return Assign(ToLeaf(self.name, self.type), value)

    def counted(self, by: int) -> Statement:
        """Return the statement that counts it up or down, from what the cycle finds."""
        return self.set(self.one_more(by))

    def one_more(self, by: int) -> Expr:
        """Return one more, or less, than what the cycle finds."""
        assert isinstance(self.type, Int)
        op, low, high = (Op.ADD, 1, self.type.high + 1) if by > 0 else (Op.SUB, -1, self.type.high - 1)
        return Apply(op, (self.was, number(1)), Int(low, high))


def _compared(op: Op, left: Expr, right: int) -> Expr:
    return Apply(op, (left, number(right)), Bool())


@dataclass(slots=True)
class Past:
    """The states of a requirement's monitor so far.

    Attributes:
        name: The requirement's.
        truths, statements: As of a `Monitor`.
        found: Leaves that stand for what the cycle finds, which the cycle before left: all of the level's own, of an assumption.
    """

    name: str
    states: list[Hidden] = field(default_factory=list)
    truths: list[tuple[VariableName, Expr]] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    found: frozenset[VariableName] = frozenset()

    def is_of_before(self, names: Iterable[VariableName]) -> bool:
        """Return whether one of the names stands for a value after the cycle before."""
        return any(name.startswith(BEFORE) or name in self.found for name in names)

    def as_found(self, condition: Expr) -> Expr:
        """Return a condition with each leaf that is `found` as the cycle before left it."""
        return renamed(condition, lambda name: earlier(name) if name in self.found else name)

    def state(self, part: str, kind: Scalar, initial: Value) -> State:
        """Add a state; its name is numbered where there is one of that name."""
        taken = {state.name for state in self.states}
        every = (f"{WATCHED}{self.name} {part}{f' {at}' if at else ''}" for at in range(len(taken) + 1))
        name = VariableName(next(one for one in every if one not in taken))
        self.states.append(Hidden(name, kind, initial))
        return State(name, kind)

    def truth(self, part: str, condition: Callable[[State], Expr]) -> State:
        """Add the state that takes the truth of a condition."""
        made = self.state(part, Bool(), initial=False)
        self.truths.append((made.name, condition(made)))
        return made

    def once(self, condition: Expr) -> Expr:
        """Return the condition that it holds, or has held."""
        return self.truth("once", lambda once: either(condition, once.was)).now

    def since(self, kept: Expr, begun: Expr) -> Expr:
        """Return the condition that `begun` holds or has held, and `kept` in each cycle after that."""
        return self.truth("since", lambda since: either(begun, both(kept, since.was))).now

    def lasting(self, condition: Expr, cycles: int) -> Expr:
        """Return the condition that it holds, and held after each of the last `cycles` cycles."""
        holds = self.truth("holds", lambda _: condition).now
        held = self.state("held", Int(0, cycles), 0)
        more = If(held.was_from(0, cycles - 1), (held.counted(1),), (held.set(held.was),))
        self.statements.append(If(holds, (more,), (held.set(number(0)),)))
        return both(holds, held.was_from(cycles, cycles))

    def before(self, condition: Expr) -> Expr:
        """Return the condition that it held after the cycle before, also where it looks back itself."""
        return self.truth("before", lambda _: condition).was
