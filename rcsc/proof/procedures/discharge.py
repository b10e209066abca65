"""Obligations put to Z3: one question where all hold, else halves until those that fail are found.

In: obligations and what may be assumed. Out: those that can fail, each with its least witness, and those left
open; gathered by cause, a diagnostic a place and kind. Domains of the variables are asserted here. Z3 is loaded only when something is
asked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import combinations
from typing import TypeVar

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, WitnessColumn
from rcsc.base.diagnostics.source import Span
from rcsc.lang.model import Real, Value, Variable, spell
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.search import halved
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.evaluation import Obligation
from rcsc.proof.symbolic.remembered import answered
from rcsc.proof.symbolic.values import Node

MOST_CHOICES = 64
"""Choices of assumptions that are tried for the fewest; past them, one that has none to spare is taken."""
Candidate = TypeVar("Candidate")
Answered = TypeVar("Answered")

MOST_UNKNOWN = 2
"""After so many questions without an answer, the rest of a run is not asked."""


@dataclass(slots=True)
class Tally:
    """How obligations were settled, for the report and the tests."""

    by_intervals: int = 0
    by_solver: int = 0
    queries: int = 0


class Discharge(Enum):
    """The outcome of an obligation that is not shown."""

    FAILS = auto()
    OPEN = auto()


@dataclass(frozen=True, slots=True)
class Failure:
    """An obligation that is not shown.

    Attributes:
        witness: By variable, in order; empty where it is open.
    """

    obligation: Obligation
    outcome: Discharge
    witness: tuple[tuple[Variable, Value], ...] = ()


_Failed = tuple[int, Discharge, tuple[tuple[Variable, Value], ...]]
"""An obligation that is not shown, by its position; its outcome; its witness."""


@dataclass(slots=True)
class Asker:
    """Asks for one program.

    Attributes:
        order: Position of each leaf; other variables come last.
    """

    options: Options
    order: dict[str, int]
    tally: Tally = field(default_factory=Tally)

    def unshown(
        self,
        obligations: Sequence[Obligation],
        base: Callable[[], Sequence[Node]],
        wanted: Callable[[Obligation], bool],
    ) -> list[Failure]:
        """Return the obligations that do not hold wherever `base` does; those that are `wanted` come with a witness."""
        if not obligations:
            return []
        self.tally.by_solver += len(obligations)
        if smt.gives_up("what may fail"):
            return [Failure(obligation, Discharge.OPEN) for obligation in obligations]
        try:
            failed = self._failed(obligations, base(), [wanted(obligation) for obligation in obligations])
            return [Failure(obligations[at], outcome, witness) for at, outcome, witness in failed]
        except smt.troubles():
            return [Failure(obligation, Discharge.OPEN) for obligation in obligations]

    def _failed(
        self, obligations: Sequence[Obligation], base: Sequence[Node], wanted: Sequence[bool]
    ) -> "tuple[_Failed, ...]":
        """Return what `unshown` returns, each obligation by its position."""
        question = _Question(self, obligations, base, wanted)
        return question.remembered("unshown", question.answer)

    def all_hold(self, obligations: Sequence[Obligation], base: Callable[[], Sequence[Node]]) -> bool:
        """Return whether one question shows that all of them hold wherever `base` does; false where that stays open."""
        if not obligations:
            return True
        if smt.gives_up("whether all holds"):
            return False
        try:
            question = _Question(self, obligations, base(), [False] * len(obligations))
            return question.remembered("all hold", question.all_hold)
        except smt.troubles():
            return False


def fewest(
    candidates: Sequence[Candidate], suffice: Callable[[Sequence[Candidate]], bool]
) -> tuple[Candidate, ...]:
    """Return the fewest candidates that suffice, first in their order; adding one never hurts.

    With many candidates, return a choice of which none can be dropped; later ones are dropped first.
    """
    tried = 0
    for count in range(len(candidates)):
        for chosen in combinations(candidates, count):
            if tried == MOST_CHOICES:
                return _irredundant(candidates, suffice)
            tried += 1
            if suffice(chosen):
                return chosen
    return tuple(candidates)


def _irredundant(
    candidates: Sequence[Candidate], suffice: Callable[[Sequence[Candidate]], bool]
) -> tuple[Candidate, ...]:
    kept = tuple(candidates)
    for at in reversed(range(len(candidates))):
        fewer = (*kept[:at], *kept[at + 1 :])
        if suffice(fewer):
            kept = fewer
    return kept


class _Question:
    """One run's obligations."""

    def __init__(
        self,
        asker: Asker,
        owed: Sequence[Obligation],
        base: Sequence[Node],
        wanted: Sequence[bool],
    ) -> None:
        self.asker, self.owed, self.wanted = asker, owed, wanted
        self.bad = [values.both(obligation.path, values.negation(obligation.good)) for obligation in owed]
        variables = values.variables([*base, *self.bad])
        self.variables = sorted(variables.values(), key=lambda node: self._place(node.name))
        self.reals = any(isinstance(node.kind, Real) for node in self.variables)
        self.known = list(base)
        self.base: list[Term] = []
        self.failures: list[_Failed] = []
        self.unknown = 0
        self.solver: Solver | None = None
        self._last: tuple[Answer, trial.Point | None] = (Answer.UNKNOWN, None)

    def _place(self, name: str) -> tuple[int, str]:
        return self.asker.order.get(name, len(self.asker.order)), name

    def remembered(self, what: str, ask: Callable[[], Answered]) -> Answered:
        """Return the kept answer to the same question, else ask. The order of the variables counts: the least witness depends on it."""
        names = tuple(node.name for node in self.variables)
        key = (what, tuple(self.wanted), names)

        def asked() -> Answered:
            self.base = [*values.domain(self.variables), *map(values.term_of, self.known)]
            return ask()

        return answered(key, [*self.bad, *self.known], asked)

    def answer(self) -> tuple[_Failed, ...]:
        """Return the obligations that are not shown, in the order owed."""
        for at in halved(range(len(self.owed)), self._hold):
            self._fail(at, *self._last)
            self.known.append(values.negation(self.bad[at]))
            self.base.append(values.term_of(self.known[-1]))
            if self.solver is not None:
                self.solver.add(self.base[-1])
        return tuple(self.failures)

    def all_hold(self) -> bool:
        """Return whether none of the obligations can fail."""
        bad = values.any_of(self.bad)
        if self.reals and trial.witness([*self.known, bad], self.variables) is not None:
            return False
        return self._ask(values.term_of(bad)) is Answer.UNSATISFIABLE

    def _hold(self, places: Sequence[int]) -> bool:
        """Return whether these obligations need no further search: they hold, or are given up as open."""
        if self.unknown > MOST_UNKNOWN:
            self.failures += [(at, Discharge.OPEN, ()) for at in places]
            return True
        bad = values.any_of([self.bad[at] for at in places])
        tried = trial.witness([*self.known, bad], self.variables) if self.reals else None
        answer = self._ask(values.term_of(bad)) if tried is None else Answer.SATISFIABLE
        self._last = answer, tried
        return answer is Answer.UNSATISFIABLE

    def _ask(self, bad: Term) -> Answer:
        """Ask whether `bad` is possible; doubles are quicker in a new solver."""
        if self.reals or self.solver is None:
            solver = self._fresh()
            self.solver = None if self.reals else solver
            if self.reals:
                solver.add(bad)
                answer = solver.check()
                self.asker.tally.queries += 1
                return answer
        assert self.solver is not None
        self.solver.push()
        self.solver.add(bad)
        answer = self.solver.check()
        self.solver.pop()
        self.asker.tally.queries += 1
        return answer

    def _fresh(self) -> Solver:
        solver = Solver(self.asker.options.limits)
        solver.add(*self.base)
        return solver

    def _fail(self, at: int, answer: Answer, tried: trial.Point | None) -> None:
        if answer is Answer.UNKNOWN:
            self.unknown += 1
            self.failures.append((at, Discharge.OPEN, ()))
            return
        witness = self._witness(self.bad[at], tried) if self.wanted[at] else ()
        self.failures.append((at, Discharge.FAILS, witness))

    def _witness(self, bad: Node, tried: trial.Point | None) -> tuple[tuple[Variable, Value], ...]:
        point = self._least(bad) if tried is None else tried
        if point is None:
            return ()
        return tuple((values.shown(node), point[node.name]) for node in self.variables)

    def _least(self, bad: Node) -> dict[str, Value] | None:
        solver = self._fresh()
        solver.add(values.term_of(bad))
        least = values.least(solver, self.variables)
        self.asker.tally.queries += solver.queries
        return least


# --- told by cause ---

MOST_WITNESSES = 3

_PATIENCE = ("give each query more steps with `--steps`, or narrow the declared ranges",)
_HELP: dict[Code, tuple[str, ...]] = {
    Code.OVERFLOW: ("narrow the declared ranges, or guard the operation with `if`",),
    Code.DIVISION_BY_ZERO: ("guard the division with `if`, or exclude zero from the divisor's range",),
    Code.INDEX: ("guard the access with `if`, or narrow the index's range",),
    Code.ASSIGNED_RANGE: (
        "guard the assignment with `if`, use `min` or `max`, or widen the variable's range",
    ),
    Code.USE_BEFORE_ASSIGNMENT: ("give the local a first value where it is declared",),
    Code.TWO_WRITERS: (
        "let one action of the line write it: a procedure that does both in the order that is meant",
    ),
    Code.ASSUMPTION_NOT_PROVED: ("declare it `assumed` or `monitored`",),
    Code.INVARIANT_BROKEN: ("mend what runs there, or strengthen the invariant if that state cannot occur",),
}


@dataclass(slots=True)
class Cause:
    """One place and what can go wrong there, in every context where it can; told `there` where that is another place."""

    failures: list[Failure] = field(default_factory=list)
    where: list[tuple[str, str]] = field(default_factory=list)  # note, table
    there: Span | None = None


def diagnostic(code: Code, span: Span, message: str, cause: Cause) -> Diagnostic:
    """Return one cause as it is reported."""
    span = cause.there or span
    failing = [
        (failure, place)
        for failure, place in zip(cause.failures, cause.where, strict=True)
        if failure.outcome is Discharge.FAILS
    ]
    if not failing:
        undecided = f"could not be decided whether this holds: {message}"
        return Diagnostic(Code.UNDECIDED, undecided, Label(span), help=_PATIENCE)
    columns = tuple(
        WitnessColumn(
            table,
            tuple(variable.name for variable, _ in failure.witness),
            tuple(spell(variable.type, value) for variable, value in failure.witness),
        )
        for failure, (_, table) in failing[:MOST_WITNESSES]
        if failure.witness
    )
    notes = tuple(dict.fromkeys(where for _, (where, _) in failing if where))[:MOST_WITNESSES]
    more = max(0, len(failing) - MOST_WITNESSES)
    return Diagnostic(code, message, Label(span), (), notes, _HELP.get(code, ()), columns, more)
