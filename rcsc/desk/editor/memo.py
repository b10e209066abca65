"""What was proved of earlier texts, by meaning, so that only what changed is proved again.

In: a program and a table. Out: the verdict on an equal table of an equal rest of the program, and its diagnostics where the table also
stands so in the text. Equality of `rcsc.lang.model` leaves places out, so that a line typed above a table costs nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from rcsc.base.diagnostics.diagnostic import Diagnostic, Proposal
from rcsc.driver.proofs import moved
from rcsc.lang.model import Program, Table
from rcsc.proof.solvers import smt
from rcsc.proof.symbolic.remembered import Answers
from rcsc.proof.table.mending import Outcome
from rcsc.proof.table.verdict import TableVerdict

T = TypeVar("T")

MOST_PROPOSALS = 200
"""Proposals of which it is kept what came of them."""
MOST_RESTS, MOST_EACH = 8, 8
"""Rests of programs that are kept, and versions of a table in each: of the last minutes of typing."""


class OutdatedError(Exception):
    """The text has changed meanwhile: nobody waits for the answer any more."""


@dataclass(frozen=True, slots=True)
class _Told:
    """The diagnostics of a verdict, and where the parts of its table stood, seen from its name."""

    verdict: TableVerdict
    unproved: frozenset[str]
    shape: tuple[object, ...]
    diagnostics: tuple[Diagnostic, ...]
    start: int


@dataclass(slots=True)
class _Versions:
    """What is known of the tables of one rest of a program, by name, the last version first."""

    rest: Program
    verdicts: dict[str, list[TableVerdict]] = field(default_factory=dict)
    told: dict[str, list[_Told]] = field(default_factory=dict)
    outcomes: dict[Proposal, list[tuple[Table, Outcome]]] = field(default_factory=dict)


@dataclass(slots=True)
class Memo:
    """Verdicts and diagnostics of earlier texts; all of one set of options.

    Attributes:
        go_on: Asked before each table; where it says no the proof ends with `OutdatedError`.
        keeps_all: Whether what was made with questions left open is kept, too: not where a larger budget may answer them.
        made: How many verdicts were made because none was known.
        answers: Of Z3, to questions about lines and procedures: a changed line leaves most as they were.
    """

    go_on: Callable[[], bool] = lambda: True
    made: int = 0
    keeps_all: bool = True
    answers: Answers = field(default_factory=Answers)
    _versions: list[_Versions] = field(default_factory=list)
    _program: Program | None = None

    def verdict(self, program: Program, table: Table, make: Callable[[], TableVerdict]) -> TableVerdict:
        """The verdict on an equal table, else a new one.

        Raises:
            OutdatedError: Nobody waits for it.
        """
        self.asked()
        kept = self._of(program).verdicts.setdefault(str(table.name), [])
        for known in kept:
            if known.table == table:
                return replace(known, table=table)
        before = smt.unanswered()
        verdict = make()
        self.asked()
        self.made += 1
        if self.keeps_all or smt.unanswered() == before:
            _keep(kept, verdict)
        return verdict

    def told(
        self, verdict: TableVerdict, unproved: frozenset[str], make: Callable[[], list[Diagnostic]]
    ) -> list[Diagnostic]:
        """The diagnostics of an equal verdict on a table of the same shape, moved to where it stands now; else new ones.

        Raises:
            OutdatedError: Nobody waits for them.
        """
        self.asked()
        span, shape = verdict.table.span, _shape(verdict.table)
        assert self._program is not None  # its verdict was asked for
        kept = self._of(self._program).told.setdefault(str(verdict.table.name), [])
        for known in kept:
            if (known.shape, known.unproved) == (shape, unproved) and known.verdict == verdict:
                return [moved(each, span.start - known.start, span.file) for each in known.diagnostics]
        before = smt.unanswered()
        diagnostics = make()
        self.asked()
        if self.keeps_all or smt.unanswered() == before:
            _keep(kept, _Told(verdict, unproved, shape, tuple(diagnostics), span.start))
        return diagnostics

    def outcome(
        self, program: Program, table: Table, proposal: Proposal, make: Callable[[], Outcome]
    ) -> Outcome:
        """What came of a proposal for an equal table, else what comes of it now.

        Raises:
            OutdatedError: Nobody waits for it.
        """
        self.asked()
        known = self._of(program).outcomes
        kept = known.setdefault(proposal, [])
        for before, outcome in kept:
            if before == table:
                return outcome
        outcome = make()
        self.asked()
        _keep(kept, (table, outcome))
        while len(known) > MOST_PROPOSALS:
            del known[next(iter(known))]
        return outcome

    def forget(self) -> None:
        """Forget every verdict."""
        self._versions, self._program, self.answers = [], None, Answers()

    def asked(self) -> None:
        """Go on only if somebody waits; what was proved since nobody did may be of questions left open, and is not kept.

        Raises:
            OutdatedError: Nobody does.
        """
        if not self.go_on():
            raise OutdatedError

    def _of(self, program: Program) -> _Versions:
        """What is known in a program that is equal but for its tables."""
        if program is self._program:
            return self._versions[0]
        rest = replace(program, name="", tables=(), own_tables=())
        found = next((known for known in self._versions if known.rest == rest), None) or _Versions(rest)
        self._versions = [found, *(known for known in self._versions if known is not found)][:MOST_RESTS]
        self._program = program
        return found


def _keep(kept: list[T], new: T) -> None:
    """Put first what is new, and drop what was not asked for longest."""
    kept.insert(0, new)
    del kept[MOST_EACH:]


def _shape(table: Table) -> tuple[object, ...]:
    """Where the parts of a table stand, seen from its name, and what its diagnostics say beside its verdict."""
    base = table.span.start
    default = (
        None if table.default is None else (table.default.span.start - base, table.default.span.end - base)
    )
    lines = tuple(
        (
            tuple(at - base for at in line.bounds),
            line.span.start - base,
            line.span.end - base,
            line.below,
            line.same,
        )
        for line in table.lines
    )
    return (table.file, table.span.end - base, lines, default)
