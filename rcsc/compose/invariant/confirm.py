"""Confirms with Z3 what a search found: that clauses are an invariant, and that obligations follow from them.

In: predicates, the cycles with which a level begins, a cycle from any state, clauses. Out: questions, each of which has to be
answered *unsatisfiable*; they are also the certificate. Terms (`keyed`) and solver are not those of the search.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle
from rcsc.compose.invariant.pdr import Clause
from rcsc.lang.model import Bool
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.keyed import Keyed
from rcsc.proof.symbolic.values import Node


@dataclass(slots=True)
class Confirmation:
    """The questions of one level.

    Attributes:
        firsts: The first cycle, from the initial values, and the one after a restart.
        cycle: Any later one.
        cases: Conditions on a cycle, of which at least one holds; one query each is quicker than one for all.
        rested_on: Solvers whose refutations other results rest on; part of the certificate.
    """

    predicates: tuple[Predicate, ...]
    firsts: Sequence[Cycle]
    cycle: Cycle
    cases: Sequence[Node]
    keyed: Keyed
    limits: Limits
    rested_on: list[Solver] = field(default_factory=list)
    _literals: dict[tuple[bool, int, int], Term] = field(init=False, default_factory=dict)
    _nodes: dict[tuple[bool, int], Node] = field(init=False, default_factory=dict)
    _kept: dict[tuple[bool, Clause], Term] = field(init=False, default_factory=dict)
    _denied: dict[Clause, Term] = field(init=False, default_factory=dict)
    _ended: dict[tuple[int, int], Term] = field(init=False, default_factory=dict)

    def literal(self, at: int, value: int, *, after: bool) -> Term:
        """Return the term that a predicate has a value before or after the cycle; for `~value`, that it has another."""
        if value < 0:
            return smt.negation(self.literal(at, ~value, after=after))
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
        """Return a predicate before or after the cycle."""
        if (after, at) not in self._nodes:
            leaves = self.cycle.after if after else self.cycle.before
            self._nodes[after, at] = self.predicates[at].node(leaves)
        return self._nodes[after, at]

    def broken(self, clause: Clause, *, after: bool) -> Term:
        """Return the term that the clause is broken."""
        key = after, clause
        if key not in self._kept:
            self._kept[key] = smt.all_of([self.literal(at, value, after=after) for at, value in clause])
        return self._kept[key]

    def _held(self, clause: Clause) -> Term:
        """Return the term that the clause holds before the cycle."""
        if clause not in self._denied:
            self._denied[clause] = smt.negation(self.broken(clause, after=False))
        return self._denied[clause]

    def known(self, clauses: Sequence[Clause]) -> Solver:
        """Return a solver with one cycle that starts where the clauses hold; further questions may need more `ranges`."""
        # a clause about values that a predicate never has before the cycle, such as another command, tells nothing
        telling = (clause for clause in clauses if not any(self._never(at, value) for at, value in clause))
        held = [self._held(clause) for clause in telling]
        contract = self.keyed.term(self.cycle.contract)
        solver = Solver(self.limits, remembers=True, at_once=True)
        solver.add(*self.keyed.ranges, contract, *held)
        return solver

    def _never(self, at: int, value: int) -> bool:
        node = self.node(at, after=False)
        return node.known and (node.low != value if value >= 0 else node.low == ~value)

    def step_question(
        self, clauses: Sequence[Clause], case: Node, fresh: Sequence[Clause] | None = None
    ) -> Solver:
        """Ask whether a cycle in this case breaks a clause, of the fresh ones: unsatisfiable if, with the others, they are an invariant."""
        broken = smt.any_of(
            [self.broken(clause, after=True) for clause in (clauses if fresh is None else fresh)]
        )
        here = self.keyed.term(case)
        solver = self.known(clauses)
        solver.add(here, broken)
        return solver

    def first_question(self, clauses: Sequence[Clause], first: Cycle) -> Solver:
        """Ask whether a first cycle ends where a clause is broken: unsatisfiable if the clauses are an invariant."""
        nodes = [predicate.node(first.after) for predicate in self.predicates]
        equal = [self.keyed.equal(self._end(at), node) for at, node in enumerate(nodes)]
        solver = self.beginning(first)
        solver.add(*self.keyed.ranges, *equal, smt.any_of([self._stands(clause) for clause in clauses]))
        return solver

    def beginning(self, first: Cycle) -> Solver:
        """Return a solver with one first cycle."""
        contract = self.keyed.term(first.contract)
        solver = Solver(self.limits, at_once=True)
        solver.add(*self.keyed.ranges, contract)
        return solver

    def _end(self, at: int) -> Term:
        """Return a constant for a predicate after the cycle, which is quicker to read from a model than its definition."""
        return self.keyed.fresh(f"end!{at}", self.predicates[at].kind)

    def _stands(self, clause: Clause) -> Term:
        """Return the term that the constants have the clause's values."""
        return smt.all_of([self._at(at, value) for at, value in clause])

    def _at(self, at: int, value: int) -> Term:
        if value < 0:
            return smt.negation(self._at(at, ~value))
        key = at, value
        if key not in self._ended:
            self._ended[key] = self.keyed.has(self._end(at), self.predicates[at].kind, value)
        return self._ended[key]


def answer(solver: Solver, *terms: Term) -> Answer:
    """Ask whether the terms can hold with all that the solver knows, without adding them to it."""
    return solver.check(*map(solver.switch, terms))


def may(solver: Solver, *terms: Term) -> bool:
    """Return whether the solver does not refute the terms."""
    return answer(solver, *terms) is not Answer.UNSATISFIABLE
