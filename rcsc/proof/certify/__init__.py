"""The checker: whether a certificate shows what it claims of a program, from the program's meaning alone.

In: a `Program` (resolved anew from the text) and a certificate (JSON). Out: what is wrong, and by name what was checked, what
was not, and what it rests on. None of the prover's code is used, nor `Test.box`: everything is computed again from conditions and
statements. Trusted besides this folder: Python, numpy, the parser and `resolve` (with the bounds that it gives the types of
expressions), and a solver for what the report says that it answered.

1. `rcsc.lang.meaning.digest` binds the certificate to the whole program, and to which assumptions stop a cycle. The prover's options are
   not bound: nothing that is checked depends on them.
2. What is owed is derived from the program (`owed`, by symbolic runs, `execution`), never read from the certificate. The certificate only
   helps: a tree of regions for each table (`table`), and an input at which its assumptions hold together.
3. Each obligation is settled by the spans of its terms (`values`, `known`), by trying every case (`settle`), or by a solver that is
   given the question in SMT-LIB; else it is listed as not checked.

>>> from rcsc.lang.resolve import compile_text
>>> from rcsc.proof.solvers.options import Options
>>> from rcsc.proof.table.program import prove_program
>>> program = compile_text('''
... input wide : bool
... output order : bool
... table grip {
...   | line | wide  || order |
...   |------|-------||-------|
...   | held | false || true  |
...   | over | true  || false |
... }''')
>>> certificate = prove_program(program, Options()).certificate
>>> certify(program, certificate).checked
('table `grip`: exactly one line matches',)
>>> certify(program, certificate | {"meaning": "of another program"}).problems
('it is of another program',)

What it costs: a walk of each tree, and of the cases that are tried; what is too large to try is listed, never passed over.

Not claimed, and so not checked: that no line is dead, and what `rcsc prove` shows of levels together, properties included.

The modules in the order in which data flows: `shape` passes over nothing that is said; `values`, `execution`, `owed`, `table`, `known`,
`settle`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rcsc.base.diagnostics.source import Span
from rcsc.lang.leaves import read_by
from rcsc.lang.meaning import digest, relying
from rcsc.lang.model import (
    AssumptionName,
    Bool,
    Program,
    Real,
    Scalar,
    Single,
    Standing,
    Table,
    Value,
    key_bounds,
)
from rcsc.proof.certify.execution import Owed, Start
from rcsc.proof.certify.known import KnownSpans
from rcsc.proof.certify.owed import Debt, Debts
from rcsc.proof.certify.settle import (
    Ask,
    CaseAnswer,
    Fails,
    Left,
    Outcome,
    Settler,
    Shown,
    values_in,
    variables,
)
from rcsc.proof.certify.shape import WITNESS, check_shape, check_used
from rcsc.proof.certify.table import RejectedError, TableChecker
from rcsc.proof.certify.values import BOOL, INT, REAL, REALS, SINGLE, Term, nearest_single

__all__ = ["Ask", "CaseAnswer", "Certified", "Unchecked", "certify", "check_certificate"]

MOST_WORK = 50_000_000
"""Spans of terms, and what costs as much, that are computed for one certificate; what is left then is not checked."""


@dataclass(frozen=True, slots=True)
class Unchecked:
    """An obligation that was not checked.

    Attributes:
        question: In SMT-LIB; `unsat` settles it. Empty where it could not be stated.
    """

    name: str
    written: Span
    question: str


@dataclass(frozen=True, slots=True)
class Certified:
    """The outcome of the check.

    Attributes:
        problems: Reasons to refuse it; none where nothing is wrong.
        checked: Names of the obligations that were checked, each once.
        unchecked: Those that were not: for these the certificate has only the prover's word.
        rests_on: Assumptions with their standing, and which of them stop a cycle.
    """

    problems: tuple[str, ...]
    checked: tuple[str, ...] = ()
    unchecked: tuple[Unchecked, ...] = ()
    rests_on: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """Whether everything that is owed was checked and holds."""
        return not self.problems and not self.unchecked


def check_certificate(program: Program, certificate: Mapping[str, object]) -> tuple[str, ...]:
    """Return the problems of the certificate, and the obligations it leaves unchecked; none when it shows all that `program` owes."""
    outcome = certify(program, certificate)
    return (*outcome.problems, *(f"not checked: {unchecked.name}" for unchecked in outcome.unchecked))


def certify(
    program: Program,
    certificate: Mapping[str, Any],
    ask: Ask | None = None,
    stops: Mapping[str, tuple[AssumptionName, ...]] | None = None,
) -> Certified:
    """Check that the certificate shows all that the program owes.

    Args:
        program: As the text says; `Table.stops` is not looked at.
        certificate: As it was read from JSON.
        ask: Called with each question that is left.
        stops: By table, the stopping assumptions of the executors in question; the certificate must name the same. None
            where there are no executors: then those that it names are reported.
    """
    try:
        return _Check(program, certificate, ask, stops).outcome()
    except RejectedError as error:
        return Certified((str(error),))
    except (
        KeyError,
        TypeError,
        ValueError,
        IndexError,
        AttributeError,
        OverflowError,
        RecursionError,
    ) as error:
        return Certified((f"malformed certificate ({type(error).__name__}: {error})"[:200],))


class _Check:
    """One certificate of one program."""

    def __init__(
        self,
        program: Program,
        certificate: Mapping[str, Any],
        ask: Ask | None,
        stops: Mapping[str, tuple[AssumptionName, ...]] | None,
    ) -> None:
        check_shape(certificate, program.name)
        entries: Sequence[Mapping[str, Any]] = certificate["tables"]
        names = [str(entry["table"]) for entry in entries]
        if sorted(names) != sorted(str(table.name) for table in program.tables):
            raise RejectedError("it is not of exactly the program's tables")
        self.entries = dict(zip(names, entries, strict=True))
        self.program = _stopping(program, self.entries)
        for table in self.program.tables if stops is not None else ():
            if table.stops != (stops or {}).get(str(table.name), ()):
                raise RejectedError(f"table `{table.name}` stops elsewhere than the certificate says")
        if certificate["meaning"] != digest(self.program):
            raise RejectedError("it is of another program")
        self.relying = relying(self.program)
        self.start = Start(self.relying)
        first = {str(variable.name): variable.initial for variable in program.variables}
        self.settler = Settler(self.start.terms, ask, first)
        self.problems: list[str] = []
        self.checked: dict[str, None] = {}
        self.unchecked: dict[str, Unchecked] = {}
        self.left: dict[str, set[tuple[str, Span]]] = {}
        self.rests: dict[str, None] = {}

    def outcome(self) -> Certified:
        """Check everything that is owed."""
        for debt in Debts(self.program, self.start).all():
            self.settle(debt)
        for table in self.relying.tables:
            try:
                self.table(table, self.entries[str(table.name)])
            except RejectedError as error:
                self.problems.append(f"table `{table.name}`: {error}")
            except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
                self.problems.append(
                    f"table `{table.name}`: malformed ({type(error).__name__}: {error})"[:200]
                )
        checked = tuple(name for name in self.checked if name not in self.unchecked)
        return Certified(tuple(self.problems), checked, tuple(self.unchecked.values()), tuple(self.rests))

    def table(self, table: Table, entry: Mapping[str, Any]) -> None:
        """Check that exactly one line matches, and that the assumptions do not contradict each other."""
        checker = TableChecker(self.start, table, entry)
        checker.check()
        check_used(entry)
        self.checked[f"table `{table.name}`: exactly one line matches"] = None
        for debt in checker.questions:
            self.settle(debt)
        for assumption in checker.assumptions:
            if assumption.standing is not Standing.PROVED:
                self.rests[f"assumption `{assumption.name}` ({assumption.standing.value})"] = None
        for assumption in self.program.assumptions if any(meeting.same for meeting in table.meetings) else ():
            if assumption.name in table.assumptions and assumption.standing is not Standing.PROVED:
                self.rests[f"assumption `{assumption.name}` ({assumption.standing.value})"] = None
        for name in table.stops:
            self.rests[f"table `{table.name}`: a cycle in which `{name}` fails is stopped"] = None
        if table.assumptions:
            self.consistent(table, entry)
        elif WITNESS in entry:
            raise RejectedError("it has no assumptions, and values are given for them")

    def consistent(self, table: Table, entry: Mapping[str, Any]) -> None:
        """Check that every assumption of the table and every invariant holds at the values that the certificate names."""
        name = f"table `{table.name}`: its assumptions do not contradict each other"
        given = dict(entry[WITNESS])
        for leaf in self.program.variables:
            if leaf.name in given and not _is_value(leaf.type, given[leaf.name]):
                raise RejectedError(f"`{leaf.name}` cannot have the value {given[leaf.name]!r}"[:200])
        conditions = [
            *(one.condition for one in self.relying.assumptions if one.name in table.assumptions),
            *(invariant.condition for invariant in self.program.invariants),
        ]
        if given.keys() != {str(name) for condition in conditions for name in read_by(condition)}:
            raise RejectedError("values of others than its assumptions and invariants read are given")
        whole = self.start.terms.every(map(self.start.condition, conditions))
        values = {
            term: _column(term, given.get(term.name, self.settler.first[term.name]))
            for term in variables(whole)
        }
        if not values_in(whole, values, 1)[0]:
            raise RejectedError("its assumptions do not hold at the values that are to show that they can")
        self.checked[name] = None

    def settle(self, debt: Debt) -> None:
        """Settle the obligations of one run, in the order of the run."""
        if debt.too_long:
            name = f"{debt.too_long}: {debt.why}"
            self.unchecked[name] = Unchecked(name, debt.written or self.program.tables[0].span, "")
        shown: set[int] = set()
        paths: dict[Term, KnownSpans] = {}
        for owed in debt.owed:
            if self.settler.work > MOST_WORK:
                self.unchecked.setdefault(owed.name, Unchecked(owed.name, owed.written, ""))
                continue
            if owed.path not in paths:
                paths[owed.path] = KnownSpans((*debt.hypotheses, owed.path), shown)
                self.settler.work += paths[owed.path].work
            outcome = self.settler.settle(debt.hypotheses, owed.path, owed.good, paths[owed.path])
            if isinstance(outcome, Shown):
                shown.add(owed.number)
            self.note(owed, outcome)

    def note(self, owed: Owed, outcome: Outcome) -> None:
        """Enter the outcome of one obligation."""
        match outcome:
            case Shown():
                self.checked[owed.name] = None
            case Fails(case):
                shown = ", ".join(f"{name} = {value}" for name, value in case) or "a solver says so"
                problem = (
                    f"{owed.name}: does not hold where {shown}"
                    if case
                    else f"{owed.name}: does not hold: {shown}"
                )
                self.problems.append(problem)
            case Left(question):
                self.leave(owed.name, owed.written, question)

    def leave(self, name: str, written: Span, question: str) -> None:
        """Enter an open obligation; those of one name are numbered, so that each question is listed."""
        same = self.left.setdefault(name, set())
        if (question, written) not in same:
            same.add((question, written))
            shown = f"{name} ({len(same)})" if len(same) > 1 else name
            self.unchecked[shown] = Unchecked(shown, written, question)


def _is_value(kind: Scalar, value: object) -> bool:
    """Return whether the value, as JSON gives it, belongs to the type."""
    if isinstance(kind, Bool):
        return isinstance(value, bool)
    if isinstance(kind, Real):
        of_kind = isinstance(value, float) and (
            not isinstance(kind, Single) or nearest_single(value) == value
        )
        return of_kind and kind.low <= value <= kind.high  # type: ignore[operator] # of_kind says it is a number
    return type(value) is int and key_bounds(kind)[0] <= value <= key_bounds(kind)[1]


def _column(leaf: Term, value: Value) -> Any:
    """Return the leaf's value as an array of one case, for `values_in`."""
    kinds = {BOOL: bool, INT: object, REAL: float, SINGLE: np.float32}
    return np.array([float(value) if leaf.sort in REALS else value], dtype=kinds[leaf.sort])


def _stopping(program: Program, entries: Mapping[str, Mapping[str, Any]]) -> Program:
    """Return the program with its tables stopping where the certificate says.

    Raises:
        RejectedError: A table stops at what is no assumption of its.
    """
    tables = []
    for table in program.tables:
        stops = tuple(AssumptionName(str(name)) for name in entries[str(table.name)]["stops"])
        if stops != tuple(
            a.name for a in program.assumptions if a.name in stops and a.name in table.assumptions
        ):
            raise RejectedError(f"table `{table.name}` cannot stop at {', '.join(stops)}"[:200])
        tables.append(replace(table, stops=stops))
    return replace(program, tables=tuple(tables))
