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
