"""Decides whether a bounded run can fulfil conditions, and chooses the simplest that does, always the same.

In: conditions as nodes. Out: whether they can hold together; values, which the nodes have from then on. A solver may return any model,
and another one after an upgrade; what is settled here depends on the question alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rcsc.compose.contract.given import ExternAnswer, least, refused
from rcsc.compose.contract.transition import Cycle
from rcsc.lang.model import Bool, Op, Program, Scalar, Value, key_bounds, key_of, value_of_key
from rcsc.proof.solvers.sat import Sat
from rcsc.proof.solvers.search import halved, lowest
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.bits import Bits, Literal, key_of_bits
from rcsc.proof.symbolic.evaluation import ExternResults
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.values import Node


@dataclass(slots=True)
class Bounded:
    """Conditions on a run of so many cycles, as clauses; none is ever taken back."""

    _bits: Bits = field(default_factory=Bits)
    _sat: Sat = field(default_factory=lambda: Sat([]))
    _asked: list[Node] = field(default_factory=list)

    def add(self, node: Node) -> None:
        """State that the node holds."""
        self._sat.add([self.literal(node)])

    def literal(self, node: Node) -> Literal:
        """Return the literal of a truth value."""
        literal = self._bits.literal(node)
        self._asked.append(node)
        self._hand_on()
        return literal

    def has(self, node: Node, value: Value) -> Literal:
        """Return the literal that the node has this value."""
        literal = self._bits.equals(self._bits.word(node), node.kind, key_of(node.kind, value))
        self._hand_on()
        return literal

    def _hand_on(self) -> None:
        for clause in self._bits.clauses:
            self._sat.add(clause)
        self._bits.clauses.clear()

    def holds(self, assuming: Sequence[Literal]) -> bool:
        """Return whether all that is stated can hold together with these literals.

        Raises:
            GaveUpError: The solver did not decide.
        """
        return self._sat.holds(assuming)

    @property
    def effort(self) -> int:
        """What the answers so far took (`Sat.effort`)."""
        return self._sat.effort

    def met(self, node: Node) -> bool:
        """Return whether anything stated or asked contains the node."""
        return self._bits.met(node)

    def meet(self, node: Node) -> None:
        """Add the node to what is stated or asked, so that a model gives it a possible value."""
        self._bits.word(node)
        self._hand_on()

    def key(self, node: Node) -> int:
        """Return the key of the node's value in the last model."""
        bits = [self._sat.value(literal) for literal in self._bits.word(node)]
        return int(bits[0]) if isinstance(node.kind, Bool) else key_of_bits(bits)

    @property
    def guessed(self) -> bool:
        """Whether anything stated or asked has an operation that is left open, as in `keyed`."""
        keyed = Keyed()
        for node in self._asked:
            keyed.term(node)
        return keyed.guessed > 0


@dataclass(slots=True)
class Simplest:
    """Fixes values of nodes one after the other, so that there is always a run with all of them.

    Attributes:
        given: Literals that hold of the run besides what is stated; those of fixed values are added.
    """

    run: Bounded
    given: list[Literal]

    def settle(self, nodes: Sequence[Node], wanted: Sequence[Value]) -> list[Value]:
        """Fix the nodes' values: as many as possible as wanted, the least possible for the others."""
        every = zip(nodes, wanted, strict=True)
        met = [(node, value) for node, value in every if self.run.met(node) and not node.known]
        free = {node for node, _ in halved(met, self._keep)}
        return [
            self._least(node) if node in free else value for node, value in zip(nodes, wanted, strict=True)
        ]

    def answers(self, program: Program, cycle: Cycle) -> tuple[ExternAnswer, ...]:
        """Fix the results of extern procedures in the cycle: least values, refused ones only if necessary."""
        for call in cycle.calls:
            self.run.literal(call.path)
        return tuple(self._answer(program, call) for call in cycle.calls if self._made(call.path))

    def _made(self, path: Node) -> bool:
        return bool(path.low) if path.known else bool(self.settle([path], [False])[0])

    def _answer(self, program: Program, call: ExternResults) -> ExternAnswer:
        writes = next(
            procedure.writes for procedure in program.procedures if procedure.name == call.procedure
        )
        given = self.settle(call.results, [least(node.kind) for node in call.results])
        wrong = self.settle(call.refusals, [False] * len(call.refusals))
        results = [
            refused(program.variable(name)) if broken else value
            for name, value, broken in zip(writes, given, wrong, strict=True)
        ]
        return call.procedure, tuple(results)

    def _keep(self, wanted: Sequence[tuple[Node, Value]]) -> bool:
        """Fix the nodes to their wanted values, if all of them can have theirs; return whether."""
        together = [self.run.has(node, value) for node, value in wanted]
        can = self.run.holds([*self.given, *together])
        self.given += together if can else []
        return can

    def _least(self, node: Node) -> Value:
        can = self.run.holds(self.given)
        assert can

        def up_to(_low: int, limit: int) -> int | None:
            there_is = self.run.holds([*self.given, self._at_most(node, limit)])
            return self.run.key(node) if there_is else None

        key = lowest(key_bounds(node.kind)[0], self.run.key(node), up_to)
        value = value_of_key(node.kind, key)
        self.given.append(self.run.has(node, value))
        return value

    def _at_most(self, node: Node, key: int) -> Literal:
        kind: Scalar = node.kind
        if isinstance(kind, Bool):
            return -self.run.literal(node)
        limit = values.constant(kind, value_of_key(kind, key))
        return self.run.literal(values.compare(Op.LE, node, limit))


def constant_of(node: Node, otherwise: Value) -> Value:
    """Return the value of a constant node, or `otherwise`."""
    return value_of_key(node.kind, key_of(node.kind, node.low)) if node.known else otherwise
