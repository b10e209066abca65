"""A SAT solver behind a small typed face; the only importer of `pysat`, and only when a question is asked.

In: clauses of literals. Out: whether they hold together, a model, or which assumptions cannot hold together. Only the search
rests on it: what it finds is asked anew of Z3, from other terms (`level`).
"""

from collections.abc import Iterable
from functools import cache
from typing import Any

BUDGET = 400_000
"""Conflicts after which a question is given up: an effort that is the same on every machine."""
QUESTIONS, CONFLICTS = 200_000, 4_000_000
"""Limits of one solver in all, after which a search is given up; TASK's has some 4,000 questions and 30,000 conflicts."""

_REFUTED = 20
"""The status of clauses that cannot hold together."""


class GaveUpError(Exception):
    """The solver did not decide; nothing may rest on the question."""


def _simplified(clauses: Iterable[list[int]], read: Iterable[int]) -> list[list[int]]:
    """Return clauses that are equivalent for the variables read; others are eliminated where that takes no more clauses.

    Source: Een and Biere, "Effective preprocessing in SAT through variable and clause elimination", 2005.
    """
    from pysat.solvers import Cadical153

    with Cadical153(bootstrap_with=clauses) as processor:
        status, simpler = processor.process(freeze=sorted(set(map(abs, read))))
    return [[1], [-1]] if status == _REFUTED else simpler


@cache
def _interrupted() -> type[Exception]:
    """Return the error that a search raises only when Ctrl-C stops it."""
    import pysolvers

    error: type[Exception] = pysolvers.error
    return error


class Sat:
    """One incremental solver.

    Attributes:
        queries: How often it was asked.
    """

    def __init__(
        self,
        clauses: Iterable[list[int]],
        read: Iterable[int] = (),
        conflicts: int = CONFLICTS,
        questions: int = QUESTIONS,
    ) -> None:
        """Assert the clauses.

        Args:
            clauses: Each a list of literals, one of which holds.
            read: All literals that are added, assumed or read later, but new variables; by default any may be.
            conflicts: The limit of all questions together; `questions`, of how often it may be asked.
            questions: See there.
        """
        from pysat.solvers import Minisat22

        kept = list(read)
        self._solver: Any = Minisat22(bootstrap_with=_simplified(clauses, kept) if kept else clauses)
        self._model: list[int] = []
        self.queries = 0
        self._conflicts, self._questions = conflicts, questions

    def add(self, clause: list[int]) -> None:
        """Assert that one of the literals holds."""
        self._solver.add_clause(clause)

    def holds(self, assuming: Iterable[int], most: int = BUDGET) -> bool:
        """Return whether all that is asserted can hold together with these literals.

        Raises:
            GaveUpError: After `most` conflicts; after so many questions, or conflicts in all, as it may have.
        """
        self.queries += 1
        left = self._conflicts - self.conflicts
        if self.queries > self._questions or left <= 0:
            raise GaveUpError
        self._solver.conf_budget(min(most, left))
        try:
            # each once: solvers give each a decision level, and may write beyond their memory where they are more than the variables
            answer = self._solver.solve_limited(assumptions=list(dict.fromkeys(assuming)))
        except _interrupted() as error:  # it takes Ctrl-C for itself
            raise KeyboardInterrupt from error
        if answer is None:
            raise GaveUpError
        if answer:
            self._model = self._solver.get_model()
        return bool(answer)

    def value(self, literal: int) -> bool:
        """Return the value of a literal in the last model; a variable in no clause is false."""
        at = abs(literal) - 1
        return (at < len(self._model) and self._model[at] > 0) == (literal > 0)

    def core(self) -> frozenset[int]:
        """Return the unsatisfiable core of the assumptions of the last question."""
        return frozenset(self._solver.get_core() or ())

    @property
    def conflicts(self) -> int:
        """How many conflicts the answers so far took."""
        return int(self._solver.accum_stats()["conflicts"])

    @property
    def effort(self) -> int:
        """What the answers so far took: literals that followed from others, the same number on every machine."""
        return int(self._solver.accum_stats()["propagations"])

    def close(self) -> None:
        """Free the solver's memory, which Python does not see."""
        self._solver.delete()
