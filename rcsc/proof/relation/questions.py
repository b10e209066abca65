"""Questions about values, put to Z3.

In: conditions as values. Out: whether they can hold together, or `UndecidedError`.
"""

from collections.abc import Callable, Collection, Mapping

from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver, UndecidedError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import FALSE, Node


def stated(nodes: Collection[Node], options: Options, spoken_of: Collection[Node] = ()) -> Solver:
    """Return a solver that knows that all nodes hold, and the ranges of their variables and of those that are spoken of later."""
    solver = Solver(options.limits)
    solver.add(*values.domain(values.variables([*nodes, *spoken_of]).values()), *map(values.term_of, nodes))
    return solver


def answer(solver: Solver, *nodes: Node) -> Answer:
    """Return whether the nodes can hold together, and with what the solver knows."""
    if any(node is FALSE for node in nodes):
        return Answer.UNSATISFIABLE
    solver.push()
    try:
        solver.add(*map(values.term_of, nodes))
        return solver.check()
    finally:
        solver.pop()


def possible(solver: Solver, *nodes: Node) -> bool:
    """Return whether the nodes can hold together, and with what the solver knows.

    Raises:
        UndecidedError: Z3 gave no answer.
    """
    told = answer(solver, *nodes)
    if told is Answer.UNKNOWN:
        raise UndecidedError
    return told is Answer.SATISFIABLE


def apart(nodes: Collection[Node], known: Collection[Node]) -> list[list[Node]]:
    """Divide nodes into groups that no variable links, not even by what is known: these hold together just if each group does alone.

    So a question about a state and conditions that do not look at it is one about each, which many other questions share. One
    group or more, even of no node.
    """
    groups: list[tuple[frozenset[str], list[Node]]] = []
    asked = dict.fromkeys(nodes)
    for node in [*asked, *known]:
        names = frozenset(values.variables([node]))
        linked = [group for group in groups if not names.isdisjoint(group[0])]
        groups = [group for group in groups if names.isdisjoint(group[0])]
        groups.append(
            (
                names.union(*(group[0] for group in linked)),
                [*([node] if node in asked else []), *(each for group in linked for each in group[1])],
            )
        )
    return [group for _, group in groups if group] or [[]]


def needed(tests: Mapping[int, Node], can_be: Callable[..., bool]) -> tuple[int, ...]:
    """Return the columns of a line whose tests neither its others nor what is known imply.

    Args:
        tests: By column.
        can_be: Whether nodes can hold together.
    """
    left = dict(tests)
    for at, test in tests.items():
        others = [node for column, node in left.items() if column != at]
        if not can_be(*others, values.negation(test)):
            del left[at]
    return tuple(left)
