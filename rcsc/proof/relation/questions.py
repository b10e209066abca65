"""Questions about values, put to Z3.

In: conditions as values. Out: whether they can hold together, or `UndecidedError`.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

from rcsc.lang.model import Value
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
    """Return whether the nodes can hold together, and with what the solver knows, ranges of their variables too."""
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


class Independent:
    """Questions about what can hold together with what is known, divided where no variable links their conditions.

    These hold together just if those of each part do. So a question about a state and conditions that do not look at it is one about
    each, which many other questions share, and none is asked with what it does not depend on.

    Args:
        known: What holds.
        options: Limits of a question.
    """

    def __init__(self, known: Collection[Node], options: Options) -> None:
        self._known = dict.fromkeys(each for condition in known for each in values.conjuncts(condition))
        self._options = options
        self._variables: dict[Node, dict[str, Node]] = {}
        self._answers: dict[tuple[Node, ...], bool] = {}
        self._solvers: dict[tuple[Node, ...], Solver] = {}

    def possible(self, *nodes: Node) -> bool:
        """Return whether the nodes can hold together.

        Raises:
            UndecidedError: Z3 gave no answer.
        """
        return all(self._alone(tuple(part)) for part in self._parts(nodes))

    def pairs(self, nodes: Iterable[Node], one: Node, other: Node) -> Iterator[tuple[Value, Value]]:
        """Yield each pair that two values can be together where the nodes hold.

        Raises:
            UndecidedError: Z3 gave no answer.
        """
        ends = {*self._named(one), *self._named(other)}
        linked, lone = list[Node](), list[list[Node]]()
        for part in self._parts(nodes):
            met = not ends.isdisjoint(name for node in part for name in self._named(node))
            linked += part if met else []
            lone += [] if met else [part]
        if not all(self._alone(tuple(part)) for part in lone):
            return
        solver = stated(linked, self._options, (one, other))
        while solver.possible():
            found = [solver.value(values.term_of(node), node.kind) for node in (one, other)]
            yield found[0], found[1]
            solver.add(values.term_of(values.negation(pair_is((one, other), found))))

    def _alone(self, part: tuple[Node, ...]) -> bool:
        if part not in self._answers:
            self._answers[part] = FALSE not in part and self._asked(part)
        return self._answers[part]

    def _asked(self, part: tuple[Node, ...]) -> bool:
        """Ask about a part in the solver that knows what is known of it."""
        known = tuple(node for node in part if node in self._known)
        if known not in self._solvers:
            self._solvers[known] = stated(known, self._options)
        solver = self._solvers[known]
        asked = [node for node in part if node not in self._known]
        solver.push()
        try:
            solver.add(*values.domain(values.variables(asked).values()), *map(values.term_of, asked))
            return solver.possible()
        finally:
            solver.pop()

    def _parts(self, nodes: Iterable[Node]) -> list[list[Node]]:
        """Divide nodes, and what is known, into parts that no variable links."""
        asked = dict.fromkeys(each for condition in nodes for each in values.conjuncts(condition))
        parts: list[tuple[set[str], list[Node]]] = []
        for node in {**self._known, **asked}:
            names, part = set(self._named(node)), [node]
            for other in [each for each in parts if not names.isdisjoint(each[0])]:
                parts.remove(other)
                names |= other[0]
                part = other[1] + part
            parts.append((names, part))
        return [part for _, part in parts]

    def _named(self, node: Node) -> dict[str, Node]:
        if node not in self._variables:
            self._variables[node] = values.variables([node])
        return self._variables[node]


def pair_is(nodes: Sequence[Node], ends: Sequence[Value]) -> Node:
    """Return the condition that nodes have these values."""
    return values.all_of(
        values.equal(node, values.constant(node.kind, end)) for node, end in zip(nodes, ends, strict=True)
    )


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
