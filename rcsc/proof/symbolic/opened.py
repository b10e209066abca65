"""Nodes that tell nothing of reals: whatever is compared with one, or made of one, may be anything.

In: nodes. Out: nodes in which each truth value, member or integer that a real decides is a variable of its own, the same for what is
built alike. So whatever holds of all values of the new nodes holds of the old ones, which have some of them; not the other way round.
Doubles take most of the clauses of a level that moves something, and few of its requirements rest on what they are.
"""

from dataclasses import dataclass, field

from rcsc.lang.model import Real
from rcsc.proof.symbolic.values import Alike, Node, Shape, parts_first


@dataclass(slots=True)
class Opened:
    """Leaves open what reals decide; one of these for all nodes of a cycle.

    Attributes:
        suffix: Of the names of its variables.
    """

    suffix: str = ""
    _made: dict[Node, Node] = field(default_factory=dict)
    _alike: Alike = field(default_factory=Alike)

    def node(self, node: Node) -> Node:
        """Return the node with what reals decide left open; a real stays as it is."""
        for part in parts_first(node, known=self._made, whole=_is_whole):
            self._made[part] = self._of(part)
        return self._made[node]

    def _of(self, node: Node) -> Node:
        if decided_by_reals(node):
            name = f"open {self._alike.number(node)}{self.suffix}"
            return Node(Shape.VARIABLE, (), node.kind, node.low, node.high, name)
        if isinstance(node.kind, Real) or not node.args:
            return node
        args = tuple(self._made[part] for part in node.args)
        if all(new is old for new, old in zip(args, node.args, strict=True)):
            return node
        return Node(node.op, args, node.kind, node.low, node.high, node.name)


def _is_whole(node: Node) -> bool:
    """Return whether it is a real, which stays as it is, or left open: nothing asks for its parts."""
    return isinstance(node.kind, Real) or decided_by_reals(node)


def decided_by_reals(node: Node) -> bool:
    """Return whether it is no real, and is made of one."""
    return not isinstance(node.kind, Real) and any(isinstance(part.kind, Real) for part in node.args)
