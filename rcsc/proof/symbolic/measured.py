"""Nodes as terms in which sums of reals are followed: how far something goes, where order alone does not tell.

In: nodes. Out: terms as `keyed` makes them, but that a real is a real number, and every rounded operation lies within a known
distance of the exact one. Exact: order, least, greatest, opposite, absolute value. Sums, differences, and products and quotients
with a constant: within half a unit in the last place of the greatest result that the bounds allow, and with the sign of the exact
one (IEEE 754, section 4.3.1: to nearest, which keeps the order). The rest: any value within its bounds. So, again, the terms
allow all that the executors can do, and more.

Slower than `keyed`, for the solver has to reason in fractions; asked only where that leaves something open.
"""

import math

from rcsc.lang.model import Bool, Enum, Real, Scalar, Single, next_value
from rcsc.lang.operator_table import Arithmetic, Conversion, Op
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.smt import Term
from rcsc.proof.symbolic.keyed import KEY, Keyed
from rcsc.proof.symbolic.values import CONSTANT, VARIABLE, Node

ULP, SINGLE_ULP = 2.0**-52, 2.0**-23
"""Twice the greatest error of a rounded result, as a share of it: of doubles, and of singles."""


class Measured(Keyed):
    """Makes terms with reals that are numbers."""

    def fresh(self, name: str, kind: Scalar) -> Term:
        """Return a constant."""
        return smt.number(name) if isinstance(kind, Real) else super().fresh(name, kind)

    def literal(self, kind: Scalar, value: int | float) -> Term:
        """Return a constant value."""
        return smt.fraction(value) if isinstance(kind, Real) else super().literal(kind, value)

    def of_reals(self, op: Arithmetic | Conversion, node: Node, parts: list[Term]) -> Term:
        """Linear operations, rounded; the others are any value."""
        if op is Op.TO_REAL and isinstance(node.args[0].kind, Real):
            return parts[0]  # a single is a double
        if op is Op.TO_SINGLE and isinstance(node.args[0].kind, Real):
            return self._rounded(node, parts[0])
        if op in (Op.TO_REAL, Op.TO_SINGLE):
            return self._rounded(node, smt.as_number(parts[0]))
        if op in (Op.ADD, Op.SUB) or (op is Op.MUL and any(arg.known for arg in node.args)):
            return self._rounded(node, smt.integer_operation(op.value, parts[0], parts[1]))
        divisor = node.args[-1]
        if op is Op.DIV and divisor.known and divisor.low:
            return self._rounded(node, smt.quotient(parts[0], divisor.low))
        return self.any(node)

    def _rounded(self, node: Node, exact: Term) -> Term:
        """Return a value near the exact one, wherever the operands lie within their bounds."""
        rounded = self.any(node)
        most = max(abs(node.low), abs(node.high), 1.0)
        if math.isfinite(most):
            slack, zero = (
                smt.fraction(most * (SINGLE_ULP if isinstance(node.kind, Single) else ULP)),
                smt.fraction(0.0),
            )
            least = smt.integer_operation("-", exact, slack)
            greatest = smt.integer_operation("+", exact, slack)
            near = [
                smt.at_most(least, rounded, KEY),
                smt.at_most(rounded, greatest, KEY),
                smt.implication(smt.at_most(zero, exact, KEY), smt.at_most(zero, rounded, KEY)),
                smt.implication(smt.at_most(exact, zero, KEY), smt.at_most(rounded, zero, KEY)),
            ]
            self.ranges.append(smt.implication(self._reached(node), smt.all_of(near)))
        return rounded

    def _reached(self, node: Node) -> Term:
        """Return where each operand lies within its bounds; elsewhere the node is not read."""
        parts = [arg for arg in node.args if arg.op not in (CONSTANT, VARIABLE)]
        return smt.all_of([term for arg in parts for term in self._inside(arg)])

    def _inside(self, node: Node) -> list[Term]:
        """Return the terms that each value of the type within the bounds meets: it lies between the nearest values beyond them.

        Not the bounds themselves: `x > 0.1` of a number that is real holds below the next double, too.
        """
        if isinstance(node.kind, Bool | Enum):
            return []
        term = self.term(node)
        low, high = (next_value(node.kind, end, by) for end, by in ((node.low, -1), (node.high, 1)))
        above = [smt.below(self.literal(node.kind, low), term, KEY)] if math.isfinite(low) else []
        return above + ([smt.below(term, self.literal(node.kind, high), KEY)] if math.isfinite(high) else [])
