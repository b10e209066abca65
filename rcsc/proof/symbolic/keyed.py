"""Nodes of a symbolic run as solver terms over bounded integers.

In: nodes (`symbolic.values`). Out: terms, and the ranges of the variables they read. What is exact and what is not:

- Booleans, enumerations (by index) and integers are exact; `mod` of a value below twice its divisor is a choice.
- A real is its *key* (`model.key_of`): an integer that orders as the doubles do, of a single as the singles do. Equality and order, least,
  greatest, opposite and absolute value of reals are therefore exact.
- Any other operation (arithmetic of reals, products and quotients of variables) gives *any* value within the bounds of the
  node, the same one for the same operation on the same operands, where as much is known of them; a comparison with what may be a
  NaN gives any truth value. So the terms allow whatever the executors can do, and more: what is proved of them holds, and a trace found in
  them is run before it is believed.
"""

import math
from dataclasses import dataclass, field

from rcsc.lang.model import Bool, Enum, Int, Real, Scalar, key_of
from rcsc.lang.operator_table import Arithmetic, Conversion, Op
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Alike, Node, Shape, parts_first, takes_bits, wraps_once

KEY = Int(-(2**63), 2**63)
"""The type in which every number stands."""


def sort(kind: Scalar) -> Scalar:
    """Bool or `KEY`: what a value of the type is to the solver (members of enumerations have a sort of their own)."""
    return kind if isinstance(kind, Bool) else KEY


@dataclass(slots=True)
class Keyed:
    """Makes terms; one of these for all the nodes of one question.

    Attributes:
        ranges: What is to be asserted of the variables met so far.
        guessed: How many operations were left open.
    """

    ranges: list[Term] = field(default_factory=list)
    guessed: int = 0
    _terms: dict[Node, Term] = field(default_factory=dict)
    _variables: dict[str, Term] = field(default_factory=dict)
    _open: dict[tuple[str, Scalar, tuple[int, ...]], Term] = field(default_factory=dict)
    _alike: Alike = field(default_factory=Alike)

    def term(self, node: Node) -> Term:
        """Return the term of a node; parts first, without recursion."""
        for part in parts_first(node, known=self._terms):
            self._terms[part] = self._term_of(part)
        return self._terms[node]

    def variable(self, name: str, kind: Scalar) -> Term:
        """Return the term of a variable, in its declared range."""
        if name not in self._variables:
            term = self.fresh(name, kind)
            if not isinstance(kind, Bool):
                self.within(term, *values.bounds(kind), kind)
            self._variables[name] = term
        return self._variables[name]

    def fresh(self, name: str, kind: Scalar) -> Term:
        """Return a constant of the sort that values of the type have here; its range is not asserted."""
        return smt.member(name) if isinstance(kind, Enum) else smt.variable(name, sort(kind))

    def literal(self, kind: Scalar, value: int | float) -> Term:
        """Return a constant."""
        if isinstance(kind, Bool):
            return smt.truth(bool(value))
        return _key(kind, key_of(kind, value))

    def equal(self, term: Term, node: Node) -> Term:
        """State that the term is the node's value."""
        return smt.equal(term, self.term(node), sort(node.kind))

    def has(self, term: Term, kind: Scalar, key: int) -> Term:
        """State that the term, of this type, has this key."""
        if isinstance(kind, Bool):
            return term if key else smt.negation(term)
        return smt.equal(term, _key(kind, key), KEY)

    def within(self, term: Term, low: int | float, high: int | float, kind: Scalar) -> None:
        """Asserts that a number or member lies within finite bounds."""
        least, greatest = self.literal(kind, low), self.literal(kind, high)
        self.ranges.append(smt.all_of([smt.at_most(least, term, KEY), smt.at_most(term, greatest, KEY)]))

    def _term_of(self, node: Node) -> Term:
        parts = [self._terms[part] for part in node.args]
        match node.op:
            case Shape.CONSTANT:
                return self.literal(node.kind, node.low)
            case Shape.VARIABLE:
                return self.variable(node.name, node.kind)
            case Shape.CHOICE:
                return smt.choice(*parts)
            case Shape.NARROWED:
                return parts[0]
            case Op.NOT:
                return smt.negation(parts[0])
            case Op.AND:
                return smt.all_of(parts)
            case _ if not all(arg.ordered for arg in node.args):
                return self.any(node)
            case Op.EQ:
                return smt.equal(parts[0], parts[1], sort(node.args[0].kind))
            case Op.LT:
                return smt.below(parts[0], parts[1], sort(node.args[0].kind))
            case Op.LE:
                return smt.at_most(parts[0], parts[1], sort(node.args[0].kind))
            case op:
                return self._number(op, node, parts)

    def _number(self, op: Arithmetic | Conversion, node: Node, parts: list[Term]) -> Term:
        """Return the term of arithmetic: exact where it is linear, or only orders."""
        left, right = node.args[0], node.args[-1]
        match op:
            case Op.NEG:
                return smt.minus(parts[0], KEY)
            case Op.ABS:
                return smt.choice(
                    smt.below(parts[0], smt.literal(KEY, 0), KEY), smt.minus(parts[0], KEY), parts[0]
                )
            case Op.MIN:
                return smt.choice(smt.at_most(parts[0], parts[1], KEY), parts[0], parts[1])
            case Op.MAX:
                return smt.choice(smt.at_most(parts[0], parts[1], KEY), parts[1], parts[0])
            case _ if isinstance(left.kind, Real) or isinstance(node.kind, Real):
                return self.of_reals(op, node, parts)
            case Op.ADD | Op.SUB:
                return smt.integer_operation(op.value, parts[0], parts[1])
            case Op.MUL if left.known or right.known:
                return smt.integer_operation(op.value, parts[0], parts[1])
            case _ if wraps_once(node):
                wrapped = smt.integer_operation("-", parts[0], parts[1])
                return smt.choice(smt.below(parts[0], parts[1], KEY), parts[0], wrapped)
            case _ if takes_bits(node):
                return smt.integer_operation(op.value, parts[0], parts[1])
            case _:
                return self.of_integers(op, node, parts)

    def of_reals(self, op: Arithmetic | Conversion, node: Node, parts: list[Term]) -> Term:  # noqa: ARG002 - for those who know more
        """Return an operation with a real in it."""
        return self.any(node)

    def of_integers(self, op: Arithmetic | Conversion, node: Node, parts: list[Term]) -> Term:  # noqa: ARG002 - as above
        """Return an operation of integers that is not linear: products, quotients, remainders."""
        return self.any(node)

    def any(self, node: Node) -> Term:
        """Return any value within the bounds of the node."""
        key = node.op, node.kind, tuple(map(self._alike.number, node.args))
        term = self._open.get(key)
        if term is None:
            self.guessed += 1
            term = self._open[key] = self.fresh(f"any!{self.guessed}", node.kind)
        if not isinstance(node.kind, Bool) and math.isfinite(node.low) and math.isfinite(node.high):
            self.within(term, node.low, node.high, node.kind)
        return term


class ExactIntegers(Keyed):
    """Makes terms in which products, quotients and remainders of integers are what they are: slower, and asked only where it matters."""

    def of_integers(self, op: Arithmetic | Conversion, node: Node, parts: list[Term]) -> Term:
        """Return a product, a quotient or a remainder; a division by zero, which no cycle does, gives any value."""
        if op in (Op.MUL, Op.DIV, Op.MOD):
            return smt.integer_operation(op.value, parts[0], parts[1])
        return super().of_integers(op, node, parts)


def _key(kind: Scalar, key: int) -> Term:
    return smt.member_literal(key) if isinstance(kind, Enum) else smt.literal(KEY, key)
