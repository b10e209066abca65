"""Prove a whole program: its invariants, its tables, and all that its procedures owe.

The only place where a `ProvedProgram` is made, and only when nothing is wrong and nothing undecided.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity, sort_key
from rcsc.base.host import children
from rcsc.lang.meaning import relying, with_stops
from rcsc.lang.model import (
    AssumptionName,
    Backing,
    Program,
    ProvedProgram,
    Standing,
    Table,
    TableName,
    seal_of_proof,
)
from rcsc.proof.procedures.discharge import Tally
from rcsc.proof.procedures.invariants import (
    assumed_together,
    assumptions_satisfiable,
    at_first,
    properties_elsewhere,
)
from rcsc.proof.procedures.meetings import Met, met
from rcsc.proof.procedures.obligations import Obligations, defined_alone
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import TOGETHER, Options
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.table.certificate import program_certificate, with_witness
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.diagnose import diagnostics
from rcsc.proof.table.findings.unread import declared_badly
from rcsc.proof.table.verdict import ContradictoryAssumptions, TableFinding, TableVerdict, Undecided

TOO_MANY_STEPS = f"the questions about it take, together, more than {TOGETHER} times the steps of one"


@dataclass(frozen=True, slots=True)
class ProgramVerdict:
    """The verdict on a program.

    Attributes:
        findings: Errors, warnings and notes, by position.
        proved: Set only when there is no error.
        tables: One verdict a table.
        tally: How the obligations of procedures and conditions were settled.
        program: The program proved, with the stopping assumptions of the tables that were looked at.
        unproved: Invariants, and assumptions declared `proved`, that are not proved: what rests on one is not, either.
        unsafe: Tables with a line that has an obligation not shown.
        unmet: Pairs of lines declared to match together, of which it stayed open whether they ever do.
    """

    findings: tuple[Diagnostic, ...]
    proved: ProvedProgram | None
    tables: tuple[TableVerdict, ...]
    tally: Tally
    program: Program
    unproved: frozenset[str] = frozenset()
    unsafe: frozenset[str] = frozenset()
    unmet: frozenset[tuple[str, str]] = frozenset()

    @property
    def certificate(self) -> Mapping[str, object] | None:
        """The certificate of all tables; None where something is not proved. Made on demand, as it digests the whole program."""
        if self.proved is None:
            return None
        tables = [verdict.certificate for verdict in self.tables if verdict.certificate is not None]
        return program_certificate(self.program, tables)


class EarlierProofs(Protocol):
    """Results of an earlier proof in this process, for a caller that proves one text after another."""

    def verdict(self, program: Program, table: Table, make: Callable[[], TableVerdict]) -> TableVerdict:
        """Return the kept verdict of a program that is equal but for its other tables, else a new one."""

    def told(
        self, verdict: TableVerdict, unproved: frozenset[str], make: Callable[[], list[Diagnostic]]
    ) -> list[Diagnostic]:
        """Return the kept diagnostics of that verdict, else new ones."""


class Nothing:
    """A store that knows nothing: everything is made anew."""

    def verdict(self, _program: Program, _table: Table, make: Callable[[], TableVerdict]) -> TableVerdict:
        """Decide anew."""
        return make()

    def told(
        self, _verdict: TableVerdict, _unproved: frozenset[str], make: Callable[[], list[Diagnostic]]
    ) -> list[Diagnostic]:
        """Make the diagnostics anew."""
        return make()


def prove_program(
    program: Program,
    options: Options,
    only: Collection[TableName] | None = None,
    known: EarlierProofs | None = None,
) -> ProgramVerdict:
    """Prove the program's tables (or `only` these) and everything that its procedures owe.

    Tables may rely on the invariants: they are shown in the same step, by induction over cycles.
    """
    before = known or Nothing()
    findings = [*at_first(program), *properties_elsewhere(program), *declared_badly(program)]
    findings += assumed_together(program, options)
    owed = Obligations(program, options)
    wanted = [table for table in program.tables if only is None or table.name in only]
    findings += owed.prove(wanted)
    unproved = _unproved(program, findings)
    program = with_stops(program, owed.stops)
    assuming = relying(program)
    names = {table.name for table in wanted}
    tables = [table for table in assuming.tables if table.name in names]
    decided = _verdicts(assuming, tables, options, owed.undefined, before)
    meetings = {
        verdict.table.name: _met(assuming, verdict, options)
        for verdict in decided
        if verdict.table.meetings and verdict.table.name not in owed.undefined
    }
    relied = {name: each.relied for name, each in meetings.items()}
    verdicts = tuple(
        _with_assumptions(assuming, _with_invariants(program, verdict), relied) for verdict in decided
    )
    for verdict in verdicts:
        if verdict.table.name not in owed.undefined:
            findings += before.told(
                verdict, unproved, partial(diagnostics, assuming, verdict, options, unproved)
            )
    findings += [finding for each in meetings.values() for finding in each.findings]
    reported = tuple(sorted(dict.fromkeys(findings), key=sort_key))
    wrong = any(finding.severity is Severity.ERROR for finding in reported)
    if wrong or only is not None:
        unsafe = frozenset((*owed.unsafe, *(str(name) for name, each in meetings.items() if each.wrong)))
        unmet = frozenset(pair for each in meetings.values() for pair in each.open)
        return ProgramVerdict(reported, None, verdicts, owed.tally, program, unproved, unsafe, unmet)
    proved = ProvedProgram(program, seal_of_proof())
    return ProgramVerdict(reported, proved, verdicts, owed.tally, program)


def _unproved(program: Program, findings: Iterable[Diagnostic]) -> frozenset[str]:
    """Return the invariants, and the assumptions declared `proved`, whose proof these findings break.

    Invariants are shown by one induction in which every run rests on all of them, and on what it owes itself: any
    error breaks it. An assumption that is proved rests on the invariants.
    """
    errors = [diagnostic for diagnostic in findings if diagnostic.severity is Severity.ERROR]
    spans = {error.primary.span for error in errors}
    broken = bool(errors and program.invariants)
    claimed = (assumption for assumption in program.assumptions if assumption.standing is Standing.PROVED)
    return frozenset(
        (
            *(invariant.name for invariant in program.invariants if broken),
            *(str(assumption.name) for assumption in claimed if broken or assumption.span in spans),
        )
    )


def _met(program: Program, verdict: TableVerdict, options: Options) -> Met:
    """Prove the table's declarations about pairs of its lines, within a small budget where something else is wrong with it."""
    soon = options.few if verdict.refuted else options
    with smt.together(soon.steps if verdict.refuted else soon.together, of_all=verdict.refuted):
        return met(program, verdict.table, soon)


def _with_invariants(program: Program, verdict: TableVerdict) -> TableVerdict:
    """Make the verdict rest on every invariant, unless ranges alone show its conditions to be defined."""
    if not program.invariants or defined_alone(program, verdict.table):
        return verdict
    named = dict(verdict.backing.assumptions)
    more = {AssumptionName(invariant.name): Standing.PROVED for invariant in program.invariants}
    backing = replace(verdict.backing, assumptions=tuple((named | more).items()))
    return replace(verdict, backing=backing)


def _with_assumptions(
    program: Program, verdict: TableVerdict, relied: Mapping[TableName, Collection[AssumptionName]]
) -> TableVerdict:
    """Make the verdict rest also on the assumptions needed to show that lines do the same."""
    needed = relied.get(verdict.table.name, ())
    if not needed:
        return verdict
    named = dict(verdict.backing.assumptions)
    more = {each.name: each.standing for each in program.assumptions if each.name in needed}
    return replace(verdict, backing=replace(verdict.backing, assumptions=tuple((named | more).items())))


def _verdicts(
    program: Program, tables: list[Table], options: Options, undefined: Collection[str], known: EarlierProofs
) -> tuple[TableVerdict, ...]:
    """Return each table's verdict, in order; several tables are decided in processes where the options allow several jobs."""
    defined = [table for table in tables if table.name not in undefined]
    if options.jobs > 1 and len(defined) > 1:
        verdicts = _in_processes(program, defined, options)
    else:
        verdicts = [
            known.verdict(program, table, partial(_verdict, program, table, options)) for table in defined
        ]
    by_name = {table_verdict.table.name: table_verdict for table_verdict in verdicts}
    why = Undecided("a condition is not defined for every input")
    return tuple(by_name.get(table.name) or _left_open(table, why) for table in tables)


def _verdict(program: Program, table: Table, options: Options) -> TableVerdict:
    """Decide one table; leave it open where the clock, which differs by machine, ended a question."""
    before = smt.cut_short()
    with smt.together(options.together) as budget:
        verdict = _uncut_verdict(program, table, options)
    if budget.spent and verdict.undecided:
        verdict = replace(verdict, findings=(*_decided(verdict), Undecided(TOO_MANY_STEPS)), certificate=None)
    if smt.cut_short() > before:
        left = Undecided("a question to the solver took more processor time than it may")
        verdict = replace(verdict, findings=(*verdict.findings, left), certificate=None)
    return verdict


def _decided(verdict: TableVerdict) -> tuple[TableFinding, ...]:
    return tuple(finding for finding in verdict.findings if not isinstance(finding, Undecided))


def _uncut_verdict(program: Program, table: Table, options: Options) -> TableVerdict:
    """Decide one table and whether its assumptions are consistent; open where memory ends, or nobody waits."""
    if smt.gives_up("the table"):
        return _left_open(table, Undecided("nobody waits for the answer"))
    try:
        verdict = prove_table(program, table, options)
        if not table.assumptions or any(
            isinstance(finding, ContradictoryAssumptions) for finding in verdict.findings
        ):
            return verdict
        possible = assumptions_satisfiable(program, table, options.few if verdict.refuted else options)
    except smt.troubles() as trouble:
        return _left_open(table, Undecided(f"{type(trouble).__name__}: {trouble}"))
    if not isinstance(possible, Answer):
        certificate = verdict.certificate
        return replace(
            verdict, certificate=certificate and with_witness(certificate, program, table, possible)
        )
    wrong = ContradictoryAssumptions() if possible is Answer.UNSATISFIABLE else Undecided("its assumptions")
    return replace(verdict, findings=(wrong,), certificate=None)


def _left_open(table: Table, why: Undecided) -> TableVerdict:
    return TableVerdict(table, (why,), Backing("none", confirmed_by_z3=False), None, 0.0)


def _in_processes(program: Program, tables: list[Table], options: Options) -> list[TableVerdict]:
    """Decide the tables in a pool of processes; none outlives this call, even interrupted."""
    one_each = replace(options, jobs=1)
    with children.pool(min(options.jobs, len(tables))) as pool:
        waiting = [pool.submit(_verdict, program, table, one_each) for table in tables]
        return [
            replace(children.answer(future), table=table)
            for future, table in zip(waiting, tables, strict=True)
        ]
