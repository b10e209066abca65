"""Numbers of the superior's orders that may all be later by as much: what a level does with them tells none from another.

In: one cycle of a level, and what is asked of it. Out: the leaves that hold such numbers. A superior may give new orders for ever, each
under the next number, so that no state comes again before 65536 of them. But orders are numbered to be told from the one before alone: a
level copies a number, counts on from it, and compares it with another, whether they are equal. Where it does nothing else, a cycle from
one state to another goes likewise with all numbers later by as much, round 65536, the same on both sides (`_moved`, by induction over the
nodes of the cycle). So after a lap that leaves all of them later by as much, and everything else as it was, the same lap can follow.
"""

from collections.abc import Container, Iterator, Mapping, Sequence

from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.lang.model import Int, Op
from rcsc.lang.restart import NUMBERED, NUMBERS
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node, Shape, parts_first


def numbers_above(
    ts: TransitionSystem, step: Cycle, leaves: Sequence[str], nodes: Sequence[Node]
) -> frozenset[str]:
    """Return the leaves that hold numbers of the superior's orders; none where the level tells one number from another.

    Args:
        ts: The level.
        step: A later cycle of it.
        leaves: The leaves that matter.
        nodes: All that matters of the cycle: these leaves after it, and conditions.
    """
    above = ts.links.above
    if above is None or above.number not in leaves:
        return frozenset()
    numbers, grown = {above.number}, True
    while grown:
        known = _variables(step, numbers)
        kept = (leaf for leaf in leaves if ts.kinds[leaf] == Int(*NUMBERED))
        copies = {leaf for leaf in kept if not known.isdisjoint(_copied(step.after[leaf]))}
        grown, numbers = not copies <= numbers, numbers | copies
    told = _moved(nodes, _variables(step, numbers))
    roots = (node for node in nodes if not any(node is step.after[leaf] for leaf in leaves))
    same = all(told[step.after[leaf]] is (leaf in numbers) for leaf in leaves)
    return frozenset(numbers) if same and all(told[node] is False for node in roots) else frozenset()


def _variables(step: Cycle, numbers: Container[str]) -> frozenset[str]:
    """Return the variables of a cycle that stand for these leaves, before it or as it takes them."""
    every = (*step.before.items(), *step.taken.items())
    return frozenset(node.name for leaf, node in every if leaf in numbers)


def _copied(node: Node) -> Iterator[str]:
    """Yield the variables that a value may be copied or counted on from."""
    seen, left = set[Node](), [node]
    while left:
        node = left.pop()
        if node in seen:
            continue
        seen.add(node)
        if node.op is Shape.VARIABLE:
            yield node.name
        elif node.op is Shape.CHOICE:
            left += node.args[1:]
        elif node.op in {Shape.NARROWED, Op.MOD, Op.ADD}:
            left.append(node.args[0])


def _moved(nodes: Sequence[Node], numbers: Container[str]) -> dict[Node, bool | None]:
    """Tell of each node what becomes of it where each of these variables is later by as much, round 65536.

    True: it is later by as much; False: it is the same; None: it may be anything.
    """
    told: dict[Node, bool | None] = {}
    for node in parts_first(*nodes):
        parts = [told[part] for part in node.args]
        if node.op is Shape.VARIABLE:
            told[node] = node.name in numbers
        elif not any(part is not False for part in parts):
            told[node] = False
        elif node.op is Shape.NARROWED or (node.op is Shape.CHOICE and parts == [False, True, True]):
            told[node] = parts[-1]
        elif node.op == Op.EQ and parts == [True, True]:
            told[node] = False
        else:
            told[node] = True if _counts_on(node, told) else None
    return told


def _counts_on(node: Node, told: Mapping[Node, bool | None]) -> bool:
    """Return whether it is a number of which a constant is added, round 65536."""
    if node.op != Op.MOD or node.args[0].op != Op.ADD:
        return False
    (number, more), round_ = node.args[0].args, node.args[1]
    return told[number] is True and more.known and more.low >= 0 and round_.known and round_.low == NUMBERS


def later_by(number: Node, by: Node) -> Node:
    """Return a number that is later, round 65536."""
    more = values.arithmetic(Op.ADD, (number, by), Int(0, 2 * NUMBERS - 2))
    return values.arithmetic(Op.MOD, (more, values.constant(Int(0, NUMBERS), NUMBERS)), Int(*NUMBERED))
