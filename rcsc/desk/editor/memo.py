"""What was proved of earlier texts, by meaning, so that only what changed is proved again.

In: a program and a table. Out: the verdict on an equal table of an equal rest of the program, and its diagnostics where the table also
stands so in the text. Equality of `rcsc.lang.model` leaves places out, so that a line typed above a table costs nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar, cast

from rcsc.base.diagnostics.diagnostic import Diagnostic, Proposal
from rcsc.driver.proofs import moved
from rcsc.lang.model import Program, Table
from rcsc.proof.solvers import smt
from rcsc.proof.symbolic.remembered import Answers
from rcsc.proof.table.mending import Outcome
from rcsc.proof.table.verdict import TableVerdict

T = TypeVar("T")

MOST_RESTS, MOST_EACH = 8, 8
"""Rests of programs that are kept, and versions of what is known of a table in each: of the last minutes of typing."""
MOST_PROPOSALS = 200
"""Proposals of a table of which it is kept what came of them."""


class OutdatedError(Exception):
    """The text has changed meanwhile: nobody waits for the answer any more."""


@dataclass(slots=True)
class _Versions:
    """What is known in one rest of a program: by kind and table what was asked and what came of it, the last first."""

    rest: Program
    known: dict[tuple[str, str], list[tuple[object, object]]] = field(default_factory=dict)


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
        """Return the verdict on an equal table, else make a new one.

        Raises:
            OutdatedError: Nobody waits for it.
        """

        def made() -> TableVerdict:
            self.made += 1
            return make()

        known = self._known(self._of(program), ("verdict", str(table.name)), table, made)
        return replace(known, table=table)

    def told(
        self, verdict: TableVerdict, unproved: frozenset[str], make: Callable[[], list[Diagnostic]]
    ) -> list[Diagnostic]:
        """Return the diagnostics of an equal verdict on a table of the same shape, moved to where it stands now; else make new ones.

        Raises:
            OutdatedError: Nobody waits for them.
        """
        span = verdict.table.span
        assert self._program is not None  # its verdict was asked for
        start, diagnostics = self._known(
            self._of(self._program),
            ("told", str(verdict.table.name)),
            (_shape(verdict.table), unproved, verdict),
            lambda: (span.start, tuple(make())),
        )
        return [moved(each, span.start - start, span.file) for each in diagnostics]

    def outcome(
        self, program: Program, table: Table, proposal: Proposal, make: Callable[[], Outcome]
    ) -> Outcome:
        """Return the outcome of a proposal for an equal table, else try it now.

        Raises:
            OutdatedError: Nobody waits for it.
        """
        kind = "outcome", str(table.name)
        return self._known(
            self._of(program), kind, (proposal, table, table.turned), make, MOST_PROPOSALS, keeps_all=True
        )

    def _known(
        self, versions: _Versions, kind: tuple[str, str], asked: object, make: Callable[[], T], most: int = MOST_EACH,
        *, keeps_all: bool = False,
    ) -> T:  # fmt: skip
        """What came of an equal question, else what comes of it now: kept first, while the oldest is dropped."""
        self.asked()
        kept = versions.known.setdefault(kind, [])
        for before, result in kept:
            if before == asked:
                return cast("T", result)
        open_before = smt.unanswered()
        made = make()
        self.asked()
        if keeps_all or self.keeps_all or smt.unanswered() == open_before:
            kept.insert(0, (asked, made))
            del kept[most:]
        return made

    def asked(self) -> None:
        """Raise if nobody waits any more: a proof made since then may have open questions, and is not kept.

        Raises:
            OutdatedError: Nobody waits any more.
        """
        if not self.go_on():
            raise OutdatedError

    def _of(self, program: Program) -> _Versions:
        """Return the versions kept for a program that is equal but for its tables."""
        if program is self._program:
            return self._versions[0]
        rest = replace(program, name="", tables=(), own_tables=())
        found = next((known for known in self._versions if known.rest == rest), None) or _Versions(rest)
        self._versions = [found, *(known for known in self._versions if known is not found)][:MOST_RESTS]
        self._program = program
        return found


def _shape(table: Table) -> tuple[object, ...]:
    """Return the places of a table's parts, seen from its name, and what its diagnostics say beside its verdict."""
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
