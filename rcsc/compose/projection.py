"""Inductive invariants found from the tables: which values of two features never stand together, part by part.

In: features, a cycle, and some states that can be reached. Out: the strongest invariant of the form "in this *part*
no state has feature *a* at *v* and *b* at *w*" that the first states satisfy and that each cycle keeps. A part is one
value of every feature that `parts` them: of the command that selects the table, and of the level's own flags (a new
command is there; it is answered; something is in the gripper).

How: every combination that no known state shows is a *clause*. The solver is asked for a state that satisfies all
clauses and a cycle from it to one that does not; what the cycle shows is then known to be possible, and its clauses
go. When there is none, the clauses are an invariant. This is the greatest inductive subset of the candidates
(Flanagan and Leino, "Houdini, an annotation assistant", 2001): each state that is found is the successor of one that
satisfies more than the result does, so whatever it shows no inductive set of clauses forbids.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product

from rcsc.compose.features import Feature
from rcsc.compose.keyed import Keyed, sort
from rcsc.compose.transition import Cycle
from rcsc.model import Bool
from rcsc.prove import smt, values
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.prove.values import Node

Point = tuple[int, ...]
"""A value for each feature."""
Clause = tuple[tuple[int, int], ...]
"""Features, by position, and values that never stand together."""


class NotInferredError(Exception):
    """The solver gave up: no invariant, and nothing may rest on one."""


@dataclass(slots=True)
class Shown:
    """Which combinations known states show; the others are the clauses.

    A feature that has had one value only is spoken of once, for all parts; most equalities are such.
    """

    features: tuple[Feature, ...]
    _points: dict[Point, None] = field(default_factory=dict)
    _constant: dict[int, int] = field(default_factory=dict)
    _seen: dict[Point, list[set[tuple[int, int]]]] = field(default_factory=dict)

    @property
    def many(self) -> int:
        """How many different states."""
        return len(self._points)

    @property
    def _parting(self) -> tuple[int, ...]:
        return tuple(at for at, one in enumerate(self.features) if one.parts)

    @property
    def _pairs(self) -> list[tuple[int, int]]:
        others = [at for at, one in enumerate(self.features) if not one.parts and at not in self._constant]
        return list(combinations(others, 2))

    def add(self, *points: Point) -> None:
        """Other states that are possible."""
        if not self._points and points:
            self._constant = dict(enumerate(points[0]))
        new = [point for point in dict.fromkeys(points) if point not in self._points]
        self._points.update(dict.fromkeys(new))
        moved = {at for at, value in self._constant.items() if any(point[at] != value for point in new)}
        for at in moved:
            del self._constant[at]
        if moved:
            self._seen = {}
        parting, pairs = self._parting, self._pairs
        for point in self._points if moved else new:
            part = tuple(point[at] for at in parting)
            if part not in self._seen:
                self._seen[part] = [set() for _ in pairs]
            for (a, b), shown in zip(pairs, self._seen[part], strict=True):
                shown.add((point[a], point[b]))

    def clauses(self) -> list[Clause]:
        """The combinations that are not shown, without those that a smaller one implies."""
        found: list[Clause] = [
            ((at, value),)
            for at, only in sorted(self._constant.items())
            for value in range(self.features[at].size)
            if value != only
        ]
        parting = self._parting
        ranges = [
            (self._constant[at],) if at in self._constant else range(self.features[at].size) for at in parting
        ]
        for part in product(*ranges):
            here = tuple(zip(parting, part, strict=True))
            if part in self._seen:
                found += [here + clause for clause in self._unseen(part)]
            else:
                found.append(here)
        return found

    def _unseen(self, part: Point) -> Iterator[Clause]:
        """Values, and pairs of values each of which is shown, that the part does not show."""
        pairs = self._pairs
        ones: dict[int, set[int]] = {}
        for (a, b), shown in zip(pairs, self._seen[part], strict=True):
            ones.setdefault(a, set()).update(v for v, _ in shown)
            ones.setdefault(b, set()).update(w for _, w in shown)
        for at, shown_values in sorted(ones.items()):
            yield from (((at, v),) for v in range(self.features[at].size) if v not in shown_values)
        for (a, b), shown in zip(pairs, self._seen[part], strict=True):
            if len(shown) < len(ones[a]) * len(ones[b]):
                for v, w in product(sorted(ones[a]), sorted(ones[b])):
                    if (v, w) not in shown:
                        yield (a, v), (b, w)


@dataclass(slots=True)
class Inference:
    """Finds the invariant of one level.

    Attributes:
        firsts: The first cycle, from the initial values; and that after a restart.
        cycle: Any later one.
        cases: Conditions on a cycle, of which at least one holds; each is asked apart, which is quicker.
        rounds: How often the clauses were weakened.
        found: How many states the solver added to those that were known.
    """

    features: tuple[Feature, ...]
    firsts: Sequence[Cycle]
    cycle: Cycle
    cases: Sequence[Node]
    keyed: Keyed
    timeout_ms: int
    rounds: int = 0
    found: int = 0
    _literals: dict[tuple[bool, int, int], Term] = field(default_factory=dict)
    _nodes: dict[tuple[bool, int], Node] = field(default_factory=dict)
    _kept: dict[tuple[bool, Clause], Term] = field(default_factory=dict)
    _ended: dict[tuple[int, int], Term] = field(default_factory=dict)

    def literal(self, at: int, value: int, *, after: bool) -> Term:
        """That a feature has a value before, or behind, the cycle."""
        key = after, at, value
        if key not in self._literals:
            node = self.node(at, after=after)
            if isinstance(node.kind, Bool):
                wanted = node if value else values.negation(node)
            else:
                wanted = values.equal(node, values.constant(node.kind, value))
            self._literals[key] = self.keyed.term(wanted)
        return self._literals[key]

    def node(self, at: int, *, after: bool) -> Node:
        """A feature before, or behind, the cycle."""
        if (after, at) not in self._nodes:
            leaves = self.cycle.after if after else self.cycle.before
            self._nodes[after, at] = self.features[at].node(leaves)
        return self._nodes[after, at]

    def broken(self, clause: Clause, *, after: bool) -> Term:
        """That the combination stands."""
        key = after, clause
        if key not in self._kept:
            self._kept[key] = smt.all_of([self.literal(at, value, after=after) for at, value in clause])
        return self._kept[key]

    def known(self, clauses: Sequence[Clause]) -> Solver:
        """A solver in which one cycle starts where the clauses hold."""
        held = [smt.negation(self.broken(clause, after=False)) for clause in clauses]
        for at in range(len(self.features)):
            self.keyed.term(self.node(at, after=True))
        contract = self.keyed.term(self.cycle.contract)
        for case in self.cases:
            self.keyed.term(case)
        solver = Solver(self.timeout_ms)
        solver.add(*self.keyed.ranges, contract, *held)
        return solver

    def step_question(self, clauses: Sequence[Clause], case: Node) -> Solver:
        """That a cycle in this case breaks a clause: unsatisfiable, when they are an invariant."""
        broken = smt.any_of([self.broken(clause, after=True) for clause in clauses])
        solver = self.known(clauses)
        solver.add(self.keyed.term(case), broken)
        return solver

    def first_question(self, clauses: Sequence[Clause], first: Cycle) -> Solver:
        """That a first cycle leads to where a clause is broken: unsatisfiable, when they are an invariant."""
        nodes = [one.node(first.after) for one in self.features]
        equal = [self.keyed.equal(self._end(at), node) for at, node in enumerate(nodes)]
        solver = self.beginning(first)
        solver.add(*self.keyed.ranges, *equal, smt.any_of([self._stands(clause) for clause in clauses]))
        return solver

    def invariant(self, first: Iterable[Point]) -> list[Clause]:
        """The clauses that hold behind the first cycle and are kept.

        Args:
            first: States that are reached, none of them the one before the first cycle.

        Raises:
            NotInferredError: The solver gave up.
        """
        shown = Shown(self.features)
        shown.add(*first)
        for one in self.firsts:
            while self._spread(shown, self.beginning(one), one):
                pass  # a part that is shown for the first time has clauses of its own
        while True:
            self.rounds += 1
            clauses = shown.clauses()
            new = [self._round(shown, clauses, case) for case in self.cases]
            if not any(new):
                return clauses

    def beginning(self, first: Cycle) -> Solver:
        """A solver in which a first cycle runs."""
        contract = self.keyed.term(first.contract)
        solver = Solver(self.timeout_ms)
        solver.add(*self.keyed.ranges, contract)
        return solver

    def _round(self, shown: Shown, clauses: list[Clause], case: Node) -> bool:
        """Adds every state that a cycle reaches from where the clauses hold and that shows something new."""
        solver = self.known(clauses)
        solver.add(self.keyed.term(case))
        return self._spread(shown, solver, self.cycle)

    def _spread(self, shown: Shown, solver: Solver, cycle: Cycle) -> bool:
        """Adds every state behind the cycle that the solver finds and that shows something new."""
        nodes = [one.node(cycle.after) for one in self.features]
        equal = [self.keyed.equal(self._end(at), node) for at, node in enumerate(nodes)]
        solver.add(*self.keyed.ranges, *equal)
        left = dict(enumerate(shown.clauses()))
        switches = {at: smt.variable(f"broken!{at}", Bool()) for at in left}
        solver.add(smt.any_of(list(switches.values())))
        solver.add(*(smt.implication(switches[at], self._stands(clause)) for at, clause in left.items()))
        new = False
        while left:
            answer = solver.check()
            if answer is Answer.UNKNOWN:
                raise NotInferredError
            if answer is Answer.UNSATISFIABLE:
                break
            point = tuple(int(solver.value(self._end(at), sort(node.kind))) for at, node in enumerate(nodes))
            shown.add(point)
            self.found += 1
            new = True
            gone = [
                at for at, clause in left.items() if all(point[place] == value for place, value in clause)
            ]
            solver.add(*(smt.negation(switches[at]) for at in gone))
            for at in gone:
                del left[at]
        return new

    def _end(self, at: int) -> Term:
        """A constant for a feature behind the cycle: quicker to read from a model than what it is equal to."""
        return self.keyed.fresh(f"end!{at}", self.features[at].kind)

    def _stands(self, clause: Clause) -> Term:
        """That the constants have the clause's values."""
        return smt.all_of([self._at(at, value) for at, value in clause])

    def _at(self, at: int, value: int) -> Term:
        key = at, value
        if key not in self._ended:
            self._ended[key] = self.keyed.has(self._end(at), self.features[at].kind, value)
        return self._ended[key]
