"""Values of a symbolic run: a graph with bounds on every node; solver terms only when one is asked for.

In: operations of the model. Out: nodes that share what they have in common, folded where the bounds say the
value. Most of what a program owes is settled by the bounds alone, without Z3.

A node of type Real whose bounds are infinite may also be a NaN. Source of the bounds: `lang.expressions.intervals`.
"""

import math
import sys
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from rcsc.lang.expressions import intervals
from rcsc.lang.model import (
    Bool,
    Int,
    Kind,
    Real,
    Scalar,
    Single,
    Value,
    Variable,
    VariableName,
    key_bounds,
    next_value,
    value_of_key,
)
from rcsc.lang.operator_table import (
    DIVISIONS,
    Arithmetic,
    Comparison,
    Conversion,
    Core,
    Logic,
    Op,
    Ordering,
    signed,
    single,
    truth_function,
)
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Solver, Term
from rcsc.proof.symbolic.encode import Frame, least_witness, operation, within

_GREATEST = int(sys.float_info.max)


class Shape(StrEnum):
    """Nodes that are no operators: a choice has a condition and two values, and what is narrowed is known to lie within bounds."""

    CONSTANT = "constant"
    VARIABLE = "variable"
    CHOICE = "choice"
    NARROWED = "narrowed"


CONSTANT, VARIABLE, CHOICE, NARROWED = Shape


@dataclass(eq=False, slots=True)
class Node:
    """One value.

    Attributes:
        op: What it is made by.
        kind: Bool, Enum, Int, Real or Single; its own bounds are those of the declaration, not of the node.
        low: Least value it can have where it is reached; likewise `high`.
        name: Of a variable.
        term: Made on demand.
    """

    op: Shape | Core
    args: "tuple[Node, ...]"
    kind: Scalar
    low: int | float
    high: int | float
    name: str = ""
    term: Term | None = None

    @property
    def known(self) -> bool:
        """Whether it can have one value only."""
        return self.low == self.high

    @property
    def ordered(self) -> bool:
        """Whether it is certainly no NaN."""
        return not isinstance(self.kind, Real) or (math.isfinite(self.low) and math.isfinite(self.high))


def constant(kind: Scalar, value: Value) -> Node:
    """Return a constant."""
    point = float(value) if isinstance(kind, Real) else int(value)
    return Node(CONSTANT, (), kind, point, point)


TRUE, FALSE = constant(Bool(), True), constant(Bool(), False)


def truth(value: bool) -> Node:
    """Return the constant true or false."""
    return TRUE if value else FALSE


def bounds(kind: Scalar) -> tuple[int | float, int | float]:
    """Return the least and the greatest value of the type, booleans and members as integers."""
    return (kind.low, kind.high) if isinstance(kind, Int | Real) else key_bounds(kind)


def variable(name: str, kind: Scalar) -> Node:
    """Return any value of the type."""
    low, high = bounds(kind)
    return Node(VARIABLE, (), kind, low, high, name)


def root(node: Node) -> Node:
    """Return the node without what was learnt of its bounds."""
    while node.op == NARROWED:
        node = node.args[0]
    return node


def narrowed(node: Node, low: int | float, high: int | float) -> Node:
    """Return the same value where it is known to lie within the bounds too."""
    low, high = max(low, node.low), min(high, node.high)
    if (low, high) == (node.low, node.high) or low > high:
        return node
    if low == high:
        return constant(node.kind, low)
    return Node(NARROWED, (root(node),), node.kind, low, high)


# --- truth -----------------------------------------------------------------------------


def negation(node: Node) -> Node:
    """Negate it."""
    if node.known:
        return truth(not node.low)
    return node.args[0] if node.op == Op.NOT else Node(Op.NOT, (node,), Bool(), 0, 1)


def both(left: Node, right: Node) -> Node:
    """Return the conjunction."""
    if left.known:
        return right if left.low else FALSE
    if right.known:
        return left if right.low else FALSE
    return left if left is right else Node(Op.AND, (left, right), Bool(), 0, 1)


def either(left: Node, right: Node) -> Node:
    """Return the disjunction."""
    return negation(both(negation(left), negation(right)))


def follows(premise: Node, conclusion: Node) -> Node:
    """Return the implication."""
    return either(negation(premise), conclusion)


def all_of(nodes: Iterable[Node]) -> Node:
    """Conjoin."""
    conjunction = TRUE
    for node in nodes:
        conjunction = both(conjunction, node)
    return conjunction


def any_of(nodes: Iterable[Node]) -> Node:
    """At least one."""
    return negation(all_of(negation(node) for node in nodes))


def several(nodes: Iterable[Node]) -> Node:
    """At least two."""
    before, twice = FALSE, FALSE
    for node in nodes:
        twice = either(twice, both(before, node))
        before = either(before, node)
    return twice


# --- values ----------------------------------------------------------------------------


def choice(condition: Node, then: Node, orelse: Node) -> Node:
    """Choose `then` where the condition holds, else `orelse`."""
    if condition.known:
        return then if condition.low else orelse
    if then is orelse or (then.known and orelse.known and then.low == orelse.low):
        return then
    low, high = min(then.low, orelse.low), max(then.high, orelse.high)
    return Node(CHOICE, (condition, then, orelse), then.kind, low, high)


def among(subject: Node, values: Sequence[Value]) -> Node:
    """State that the subject is one of the constants."""
    return any_of(compare(Op.EQ, subject, constant(subject.kind, value)) for value in values)


def logic(op: Logic, left: Node, right: Node) -> Node:
    """Return a truth function of two conditions."""
    first, second = (signed(node, negation) for node in (left, right))
    return truth_function(op, first, second, all_of, any_of)(True)


def compare(op: Comparison, left: Node, right: Node) -> Node:
    """Return a comparison, decided where the bounds do."""
    match op:
        case Op.NE:
            return negation(_ordering(Op.EQ, left, right))
        case Op.GT:
            return _ordering(Op.LT, right, left)
        case Op.GE:
            return _ordering(Op.LE, right, left)
        case Op.EQ | Op.LT | Op.LE:
            return _ordering(op, left, right)


def _ordering(op: Ordering, left: Node, right: Node) -> Node:
    if left.ordered and right.ordered:
        decided = _decided(op, left, right)
        if decided is not None:
            return truth(decided)
    return Node(op, (left, right), Bool(), 0, 1)


def _decided(op: Ordering, left: Node, right: Node) -> bool | None:
    if op is Op.EQ:
        if left.high < right.low or right.high < left.low:
            return False
        return True if root(left) is root(right) or (left.known and right.known) else None
    if root(left) is root(right):
        return op is Op.LE
    always = left.high < right.low if op is Op.LT else left.high <= right.low
    never = left.low >= right.high if op is Op.LT else left.low > right.high
    return True if always else False if never else None


def arithmetic(op: Arithmetic | Conversion, args: tuple[Node, ...], kind: Scalar) -> Node:
    """Return any operator on numbers but comparisons; `kind` is that of the result."""
    low, high = _bounds(op, args)
    node = Node(op, args, kind, low, high)
    if low != high or not node.ordered or (isinstance(kind, Real) and not all(arg.known for arg in args)):
        return node
    return constant(kind, low)


def _bounds(op: Arithmetic | Conversion, args: tuple[Node, ...]) -> tuple[int | float, int | float]:
    first = args[0]
    if op is Op.TO_REAL:
        return float(first.low), float(first.high)
    if op is Op.TO_SINGLE:
        return single(first.low), single(first.high)
    if op is Op.TO_INT:
        return (int(first.low), int(first.high)) if first.ordered else (-_GREATEST, _GREATEST)
    if isinstance(first.kind, Real):
        real = Single if isinstance(first.kind, Single) else Real
        kinds: tuple[Int | Real, ...] = tuple(real(float(arg.low), float(arg.high)) for arg in args)
    else:
        kinds = tuple(Int(int(arg.low), int(arg.high)) for arg in args)
    if op is Op.MOD and all(arg.known for arg in args) and args[1].low:
        rest = op.meaning(int(first.low), int(args[1].low))
        return rest, rest
    bounds = intervals.apply(op, kinds, ())
    assert isinstance(bounds, Int | Real)
    return bounds.low, bounds.high


def wraps_once(node: Node) -> bool:
    """Return whether it is a `mod` that subtracts its divisor at most once: the value is from 0 to below twice the divisor."""
    if node.op != Op.MOD:
        return False
    value, divisor = node.args
    return divisor.known and value.low >= 0 and value.high < 2 * divisor.low


def takes_bits(node: Node) -> bool:
    """Return whether it is a division by a power of two, of what is never negative: then it takes some bits of it."""
    if node.op not in DIVISIONS:
        return False
    value, divisor = node.args
    return divisor.known and value.low >= 0 and divisor.low > 0 and int(divisor.low).bit_count() == 1


def equal(left: Node, right: Node) -> Node:
    """State that two values of one type are equal."""
    return compare(Op.EQ, left, right)


def inside(node: Node, low: int | float, high: int | float) -> Node:
    """State that it is in bounds, which a NaN is not."""
    least, greatest = constant(node.kind, low), constant(node.kind, high)
    return both(compare(Op.LE, least, node), compare(Op.LE, node, greatest))


# --- terms -----------------------------------------------------------------------------


def term_of(node: Node) -> Term:
    """Return the solver's term of the node; parts first, without recursion."""
    for part in parts_first(node):
        if part.term is None:
            part.term = _term(part, [arg.term for arg in part.args if arg.term is not None])
    assert node.term is not None
    return node.term


def _term(node: Node, parts: list[Term]) -> Term:
    match node.op:
        case Shape.CONSTANT:
            return smt.literal(node.kind, node.low)
        case Shape.VARIABLE:
            return smt.variable(node.name, node.kind)
        case Shape.CHOICE:
            return smt.choice(*parts)
        case Shape.NARROWED:
            return parts[0]
        case op:
            return operation(op, node.args[0].kind, parts)


def variables(nodes: Iterable[Node]) -> dict[str, Node]:
    """Return the variables below the nodes, by name."""
    return {node.name: node for node in parts_first(*nodes) if node.op == VARIABLE}


def each_reads(nodes: Sequence[Node]) -> list[frozenset[str]]:
    """Return for each node the names of the variables below it; all in one pass, in which a bit stands for each name."""
    bits: dict[str, int] = {}
    read: dict[Node, int] = {}
    for node in parts_first(*nodes):
        mask = 1 << bits.setdefault(node.name, len(bits)) if node.op == VARIABLE else 0
        for part in node.args:
            mask |= read[part]
        read[node] = mask
    return [frozenset(name for name, bit in bits.items() if read[node] >> bit & 1) for node in nodes]


def domain(nodes: Iterable[Node]) -> list[Term]:
    """State that each variable is in range."""
    return [within(term_of(node), node.kind) for node in nodes if not isinstance(node.kind, Bool)]


def shown(node: Node) -> Variable:
    """Return a variable as one that a witness shows."""
    return Variable(VariableName(node.name), Kind.STATE, node.kind, value_of_key(node.kind, 0))


def least(
    solver: Solver,
    nodes: Sequence[Node],
    spare: smt.Budget | None = None,
    known: Mapping[str, Value] | None = None,
) -> dict[str, Value] | None:
    """Return the least values of variables, in this order, for which what is asserted holds (`encode.least_witness`)."""
    frame = Frame({node.name: term_of(node) for node in nodes})
    return least_witness(solver, map(shown, nodes), frame, spare, known)


def model(solver: Solver, nodes: Iterable[Node]) -> dict[str, Value]:
    """Return the values of variables in the model of the last satisfiable answer."""
    return {node.name: solver.value(term_of(node), node.kind) for node in nodes}


def parts_first(
    *nodes: Node, known: Container[Node] = (), whole: Callable[[Node], bool] | None = None
) -> Iterator[Node]:
    """Yield each node once, parts first; leave out known ones and what only they are made of, and parts of what is taken whole."""
    seen: set[Node] = set()
    stack = [(node, False) for node in reversed(nodes)]
    while stack:
        node, ready = stack.pop()
        if ready:
            yield node
        elif node not in seen and node not in known:
            seen.add(node)
            stack.append((node, True))
            if whole is None or not whole(node):
                stack.extend((part, False) for part in node.args if part not in seen)


def conjuncts(condition: Node) -> Iterator[Node]:
    """Yield the conditions that this one joins by `and`."""
    waiting = [condition]
    while waiting:
        node = waiting.pop()
        if node.op == Op.AND:
            waiting.extend(node.args)
        else:
            yield node


@dataclass(slots=True)
class Alike:
    """Numbers nodes; those built alike and with the same bounds get the same number.

    Bounds hold only where the node is reached: one value for two places would carry them over.
    """

    _numbers: dict[tuple[object, ...], int] = field(default_factory=dict)
    _number_of: dict[Node, int] = field(default_factory=dict)

    def number(self, node: Node) -> int:
        """Return the number of a node."""
        for part in parts_first(node, known=self._number_of):
            parts = tuple(self._number_of[arg] for arg in part.args)
            key = part.op, part.kind, part.name, part.low, part.high, parts
            self._number_of[part] = self._numbers.setdefault(key, len(self._numbers))
        return self._number_of[node]


# --- what a condition tells --------------------------------------------------------------

Fact = tuple[int | float, int | float]


def learn(condition: Node, facts: dict[Node, Fact], *, holds: bool = True) -> None:
    """Adds to `facts` the bounds that roots have where the condition holds (or does not)."""
    waiting = [(condition, holds)]
    while waiting:
        node, yes = waiting.pop()
        op = node.op
        match op:
            case Shape():
                if isinstance(node.kind, Bool):
                    _meet(facts, node, int(yes), int(yes))
            case Op.NOT:
                waiting.append((node.args[0], not yes))
            case Op.AND if yes:
                waiting += [(part, True) for part in node.args]
            case Op.AND:
                _learn_either(node, facts)
            case Op.EQ | Op.LT | Op.LE:
                _learn_compared(op, (node.args[0], node.args[1]), facts, yes)
            case _:
                pass  # a number


def _learn_either(node: Node, facts: dict[Node, Fact]) -> None:
    """Learn from `not (a and b)`: a root that both negations bound is in the hull of the two."""
    sides: list[dict[Node, Fact]] = []
    for part in node.args:
        side: dict[Node, Fact] = {}
        if part.op == Op.AND:
            _learn_either(part, side)
        else:
            learn(part, side, holds=False)
        sides.append(side)
    for key in sides[0].keys() & sides[1].keys():
        (a, b), (c, d) = sides[0][key], sides[1][key]
        _meet(facts, key, min(a, c), max(b, d))


def _learn_compared(op: Ordering, sides: tuple[Node, Node], facts: dict[Node, Fact], yes: bool) -> None:
    left, right = sides
    if not yes and not (left.ordered and right.ordered):
        return
    if op is Op.EQ:
        (_learn_equal if yes else _learn_unequal)(left, right, facts)
        return
    if not yes:
        op, left, right = (Op.LE if op is Op.LT else Op.LT), right, left
    strict = op is Op.LT
    _meet(facts, left, left.low, next_value(left.kind, right.high, -1) if strict else right.high)
    _meet(facts, right, next_value(right.kind, left.low, 1) if strict else left.low, right.high)


def _learn_equal(left: Node, right: Node, facts: dict[Node, Fact]) -> None:
    low, high = max(left.low, right.low), min(left.high, right.high)
    _meet(facts, left, low, high)
    _meet(facts, right, low, high)


def _learn_unequal(left: Node, right: Node, facts: dict[Node, Fact]) -> None:
    for node, other in ((left, right), (right, left)):
        if other.known and node.low == other.low:
            _meet(facts, node, next_value(node.kind, node.low, 1), node.high)
        elif other.known and node.high == other.low:
            _meet(facts, node, node.low, next_value(node.kind, node.high, -1))


def _meet(facts: dict[Node, Fact], node: Node, low: int | float, high: int | float) -> None:
    key = root(node)
    before = facts.get(key, (key.low, key.high))
    facts[key] = max(before[0], low), min(before[1], high)
