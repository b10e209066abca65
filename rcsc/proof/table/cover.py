"""Where a condition holds: the least input, and boxes that make up the region exactly.

In: conditions as values over leaves. Out: disjoint boxes of keys, each as wide as possible, and whether they fill the
region. Z3 proves that each box lies inside and that nothing is left outside; *unknown* raises.

The least input pins each variable, in declared order, to the least value that fits; boxes grow in that order, too
(`partition.Gaps.grown`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import prod

from rcsc.lang.interval_sets import holds, joined, meet, size
from rcsc.lang.model import (
    COMPARISONS,
    Bool,
    Box,
    Enum,
    Kind,
    Op,
    Real,
    Value,
    Variable,
    VariableName,
    key_bounds,
    key_of,
    value_of_key,
)
from rcsc.lang.operator_table import EXTREMES
from rcsc.proof.procedures.discharge import Tally
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.search import furthest, halved
from rcsc.proof.solvers.smt import Answer, Solver, Term, UndecidedError
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.encode import Frame, at_most_key, least_witness
from rcsc.proof.symbolic.values import CHOICE, CONSTANT, NARROWED, VARIABLE, Node
from rcsc.proof.table.verdict import Region

_MOST_CLASSES = 64
"""Classes of one variable that are tried one by one when a box is grown."""


@dataclass(frozen=True, slots=True)
class Cover:
    """Boxes that lie inside a region.

    Attributes:
        boxes: Disjoint, each maximal in declared order; a variable left out is free.
        exact: Whether together they are the whole region.
        inputs: How many inputs the boxes hold, over all variables of the space; None where a variable is real.
    """

    boxes: tuple[Region, ...]
    exact: bool
    inputs: int | None


class Space:
    """Questions about inputs: all values of the variables.

    Attributes:
        variables: In declared order.
        tally: Counts how often the solver is asked.
    """

    def __init__(self, variables: Iterable[Node], options: Options, tally: Tally) -> None:
        self.nodes = {node.name: node for node in variables}
        self.variables = [
            Variable(VariableName(name), Kind.INPUT, node.kind, 0) for name, node in self.nodes.items()
        ]
        self.frame = Frame({name: values.term_of(node) for name, node in self.nodes.items()})
        self.options = options
        self.tally = tally
        self._plain: Solver | None = None
        self._bounds: dict[tuple[str, int, int], Term] = {}

    # --- single questions ---

    def solver(self, *nodes: Node) -> Solver:
        """Return a solver that knows the domain, and that these hold."""
        solver = Solver(self.options.limits, counted_alone=True)
        solver.add(*values.domain(self.nodes.values()), *map(values.term_of, nodes))
        return solver

    def possible(self, *nodes: Node) -> bool:
        """Return whether all nodes can hold together.

        Raises:
            UndecidedError: The solver gave up.
        """
        if any(node.known and not node.low for node in nodes):
            return False
        if self._plain is None:
            self._plain = self.solver()
        return self.answered(self._plain, *map(values.term_of, nodes))

    def answered(self, solver: Solver, *terms: Term) -> bool:
        """Return whether the terms can hold together with all that the solver has asserted.

        Raises:
            UndecidedError: The solver gave up.
        """
        self.tally.queries += 1
        return solver.possible(*terms)

    def witness(self, *nodes: Node) -> dict[str, Value]:
        """Return the least input at which the nodes hold; there is one.

        Raises:
            UndecidedError: The solver gave up.
        """
        return self._least(self.solver(*nodes))

    def _least(self, solver: Solver, spare: smt.Budget | None = None) -> dict[str, Value]:
        """Return the least input, or any input once `spare` is spent."""
        before = solver.queries
        least = least_witness(solver, self.variables, self.frame, spare)
        self.tally.queries += solver.queries - before
        if least is None:
            raise UndecidedError
        return least

    def volume(self, names: Iterable[str]) -> int | None:
        """Count the joint values of the variables; None where one is real."""
        kinds = [self.nodes[name].kind for name in names]
        if any(isinstance(kind, Real) for kind in kinds):
            return None
        return prod(high - low + 1 for low, high in map(key_bounds, kinds))

    # --- boxes ---

    def cover(self, wanted: Node, allowed: Node, most: int, spare: smt.Budget) -> Cover:
        """Cover `wanted` with at most `most` boxes within `allowed`; once `spare` is spent, with one box that need not be maximal.

        Raises:
            UndecidedError: The solver gave up.
        """
        bad = self.solver(values.negation(allowed))
        cuts = _cuts(allowed, self.nodes)
        hull, _ = self._hull(allowed, cuts)
        if all(hull.values()) and not self.answered(bad, *self._inside(hull)):
            return self._covered([hull], exact=True)
        seeds = self.solver(wanted)
        boxes: list[dict[str, Box]] = []
        while self.answered(seeds):
            if len(boxes) == most or (boxes and spare.spent):
                return self._covered(boxes, exact=False)
            seeds.push()
            seed = self._least(seeds, spare)
            seeds.pop()
            boxes.append(self._grown(seed, bad, (cuts, hull), boxes, spare))
            seeds.add(smt.negation(smt.all_of(self._inside(boxes[-1]))))
        return self._covered(boxes, exact=True)

    def around(self, condition: Node) -> tuple[Region, tuple[Node, ...]]:
        """Split a condition into a box around it and further conditions: together they are equivalent."""
        hull, rest = self._hull(condition, _cuts(condition, self.nodes))
        return self._covered([hull], exact=True).boxes[0], tuple(rest)

    def _hull(self, allowed: Node, cuts: Mapping[str, list[int]]) -> tuple[dict[str, Box], list[Node]]:
        """Return the box that conditions on single variables allow, and the other conditions."""
        rest: list[Node] = []
        hull: dict[str, Box] = {name: (key_bounds(node.kind),) for name, node in self.nodes.items()}
        for part in values.conjuncts(allowed):
            variables = values.variables([part])
            if len(variables) != 1 or any(node.op not in _PLAIN for node in values.parts_first(part)):
                rest.append(part)
                continue
            [(name, node)] = variables.items()
            kind = node.kind
            classes = _classes(cuts[name], key_bounds(kind)[1])
            inside = [
                interval
                for interval in classes
                if trial.holds_at(part, {name: value_of_key(kind, interval[0])})
            ]
            hull[name] = meet(hull[name], joined(inside))
        return hull, rest

    def _covered(self, boxes: list[dict[str, Box]], *, exact: bool) -> Cover:
        whole = {name: (key_bounds(node.kind),) for name, node in self.nodes.items()}
        real = any(isinstance(node.kind, Real) for node in self.nodes.values())
        inputs = None if real else sum(prod(map(size, box.values())) for box in boxes)
        narrowed = tuple({name: part for name, part in box.items() if part != whole[name]} for box in boxes)
        return Cover(narrowed, exact, inputs)

    def _grown(
        self,
        seed: Mapping[str, Value],
        bad: Solver,
        limits: tuple[Mapping[str, list[int]], Mapping[str, Box]],
        others: list[dict[str, Box]],
        spare: smt.Budget,
    ) -> dict[str, Box]:
        """Grow a box around the seed within the hull, several variables at once where that fits."""
        cuts, hull = limits
        point = {name: key_of(node.kind, seed[name]) for name, node in self.nodes.items()}
        box: dict[str, Box] = {name: ((at, at),) for name, at in point.items()}

        def fits(parts: Mapping[str, Box]) -> bool:
            trial_ = {**box, **parts}
            if spare.spent or any(_meet(trial_, other) for other in others):
                return False
            if smt.gives_up("how wide a region is"):
                raise UndecidedError
            with smt.within(spare):
                self.tally.queries += 1
                return bad.check(*self._inside(trial_)) is Answer.UNSATISFIABLE

        def fills(names: Sequence[str]) -> bool:
            whole = {name: hull[name] for name in names}
            fit = fits(whole)
            if fit:
                box.update(whole)
            return fit

        for name in halved([name for name, part in hull.items() if part != box[name]], fills):
            classes = _within(cuts[name], hull[name])
            box[name] = _widest(point[name], classes, lambda part, name=name: fits({name: part}))  # type: ignore[misc]  # bound early
        return box

    def _inside(self, box: Mapping[str, Box]) -> list[Term]:
        """State that each variable lies in its part of the box."""
        terms = []
        for name, part in box.items():
            if part != (key_bounds(self.nodes[name].kind),):
                terms.append(smt.any_of([self._between(name, low, high) for low, high in part]))
        return terms

    def _between(self, name: str, low: int, high: int) -> Term:
        known = self._bounds.get((name, low, high))
        if known is None:
            kind, term = self.nodes[name].kind, self.frame.leaves[name]
            least, greatest = key_bounds(kind)
            parts = []
            if low == high:
                parts.append(smt.equal(term, smt.literal(kind, value_of_key(kind, low)), kind))
            else:
                parts += [smt.negation(at_most_key(term, kind, low - 1))] if low > least else []
                parts += [at_most_key(term, kind, high)] if high < greatest else []
            known = self._bounds[name, low, high] = smt.all_of(parts)
        return known


def _meet(left: Mapping[str, Box], right: Mapping[str, Box]) -> bool:
    """Return whether two boxes over the same variables have an input in common."""
    return all(meet(part, right[name]) for name, part in left.items())


def _classes(starts: list[int], last: int) -> list[tuple[int, int]]:
    return [(low, high - 1) for low, high in pairwise([*starts, last + 1])]


def _within(starts: list[int], part: Box) -> list[tuple[int, int]]:
    """Return the classes in a part of the variable's values; the part's ends cut no class."""
    edges = sorted({*(start for start in starts), *(low for low, _ in part), *(high + 1 for _, high in part)})
    pairs = [(low, high - 1) for low, high in pairwise(edges)]
    return [pair for pair in pairs if holds(part, pair[0])]


def _widest(at: int, classes: list[tuple[int, int]], fits: Callable[[Box], bool]) -> Box:
    """Join the class of `at` with others that fit; where that class itself does not fit, stretch `at` within it."""
    home = next(interval for interval in classes if interval[0] <= at <= interval[1])
    if not fits((home,)):
        return (_stretched(at, home, fits),)
    near = sorted(classes, key=lambda interval: abs(interval[0] - home[0]))[:_MOST_CLASSES]
    return joined(interval for interval in sorted(near) if interval == home or fits((interval,)))


def _stretched(at: int, ends: tuple[int, int], fits: Callable[[Box], bool]) -> tuple[int, int]:
    """Stretch `at` up, then down, while it fits."""
    top = furthest(at, ends[1], lambda end: fits(((at, end),)))
    bottom = -furthest(-at, -ends[0], lambda end: fits(((-end, top),)))
    return bottom, top


_PLAIN = {*COMPARISONS, Op.NOT, Op.AND, CONSTANT, VARIABLE, NARROWED}
"""Operators of conditions that have one value all over a class."""


def _cuts(condition: Node, nodes: Mapping[str, Node]) -> dict[str, list[int]]:
    """Return the keys at which a class of equivalent values begins, by variable, found from the constants compared."""
    starts = {name: {key_bounds(node.kind)[0]} for name, node in nodes.items()}
    for node in values.parts_first(condition):
        if node.op in COMPARISONS:
            sides = [list(_ends(side)) for side in node.args]
            for left, right in (*product(*sides), *product(*reversed(sides))):
                if left.op == VARIABLE and left.name in starts and right.op == CONSTANT:
                    key = key_of(left.kind, right.low)
                    starts[left.name].update((key, key + 1))
    cuts = {}
    for name, node in nodes.items():
        low, high = key_bounds(node.kind)
        if isinstance(node.kind, Bool | Enum):
            starts[name].update(range(low, high + 1))
        cuts[name] = sorted(start for start in starts[name] if low <= start <= high)
    return cuts


def _ends(node: Node) -> Iterator[Node]:
    """Yield the values that choices select from."""
    waiting, seen = [node], set[Node]()
    while waiting and len(seen) < _MOST_CLASSES:
        root = values.root(waiting.pop())
        if root not in seen:
            seen.add(root)
            if root.op == CHOICE:
                waiting.extend(root.args[1:])
            elif root.op in EXTREMES:
                waiting.extend(root.args)
            else:
                yield root
