"""Proofs of one program, those that an earlier run made taken from the cache.

In: a program. Out: a `Proof`. A table is kept only from a program in which nothing was wrong, under a key
of its own text and meaning and of all the rest of the program but the other tables: procedures, variables,
assumptions, invariants, levels. So when one table changes, its neighbours are not proved again.
"""

import hashlib
import re
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity, sort_key
from rcsc.base.diagnostics.report import TableReport, Verdict, resting
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.cache import Cache
from rcsc.driver.settings import Proof
from rcsc.lang.meaning import digest
from rcsc.lang.model import Program, Table
from rcsc.lang.project import Loaded
from rcsc.proof.procedures.invariants import properties_elsewhere
from rcsc.proof.procedures.obligations import called_by_lines
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.mending import mended
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.verdict import SolversDisagree, TableVerdict

WORTH_A_PROCESS = 20_000
"""Cells of a program's tables from which several processes are quicker than one."""
_CLOSING = re.compile(r"^[ \t]*\}", re.MULTILINE)


def prove(root: str, program: Program, loaded: Loaded, options: Options, cache: Cache | None) -> Proof:
    """Prove a program's tables, procedures and invariants; with a cache only those that it does not have."""
    cells = sum(len(table.lines) * len(table.columns) for table in program.tables)
    options = options if cells >= WORTH_A_PROCESS else replace(options, jobs=1)
    if cache is None:
        verdict = prove_program(program, options)
        tables = tuple(
            resting(table_report(table_verdict, program), verdict.unproved, verdict.unsafe)
            for table_verdict in verdict.tables
        )
        findings = mended(verdict, root, loaded, options)
        return Proof(root, findings, program, tables, verdict.proved, lambda: verdict.certificate)
    memory = _Memory(program, loaded, options, cache)
    known = {table.name: kept for table in program.tables if (kept := memory.table(table)) is not None}
    missing = [table for table in program.tables if table.name not in known]
    elsewhere = tuple(properties_elsewhere(program))
    if not missing and memory.rest():
        return _proof(root, program, elsewhere, known)
    verdict = prove_program(program, options, only=[table.name for table in missing])
    if not any(finding.severity is Severity.ERROR for finding in verdict.findings):
        memory.keep([finding for finding in verdict.findings if finding not in elsewhere], verdict.tables)
    new = {
        table_verdict.table.name: _Kept(table_report(table_verdict, program), ())
        for table_verdict in verdict.tables
    }
    findings = mended(verdict, root, loaded, options)
    return _proof(root, program, findings, {**known, **new}, verdict.unproved, verdict.unsafe)


@dataclass(frozen=True, slots=True)
class _Kept:
    """A table in the cache: its report and the notes on it."""

    report: TableReport
    notes: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True)
class _Rest:
    """A mark in the cache: nothing is wrong in a program but for its tables."""


def _proof(
    root: str,
    program: Program,
    findings: Sequence[Diagnostic],
    known: dict[Any, _Kept],
    unproved: Collection[str] = (),
    unsafe: Collection[str] = (),
) -> Proof:
    tables = [known[table.name] for table in program.tables]
    every = {*findings, *(note for kept in tables for note in kept.notes)}
    reports = tuple(resting(kept.report, unproved, unsafe) for kept in tables)
    return Proof(root, tuple(sorted(every, key=sort_key)), program, reports)


class _Memory:
    """The cache as seen by one program."""

    def __init__(self, program: Program, loaded: Loaded, options: Options, cache: Cache) -> None:
        self.program, self.loaded, self.cache = program, loaded, cache
        limits = {name: value for name, value in asdict(options).items() if name != "jobs"}
        parts = (
            program.variables, program.procedures, program.assumptions, program.invariants, program.owners,
            program.levels, sorted(called_by_lines(program)), sorted(limits.items()),
        )  # fmt: skip
        # (a procedure that no line calls is proved by itself, so which are called is part of it)
        self.common = hashlib.sha256("\n".join(map(repr, parts)).encode()).hexdigest()
        self.keys = {table.name: (self.common, digest(table), self._text(table)) for table in program.tables}

    def rest(self) -> bool:
        """Return whether all but the tables is known to be right."""
        return self.cache.load(_Rest, self.common) is not None

    def table(self, table: Table) -> _Kept | None:
        """Return the kept report and notes of the table."""
        kept = self.cache.load(_Kept, *self.keys[table.name])
        if kept is None:
            return None
        place = self._place(table)
        notes = tuple(moved(note, place.start, place.file) for note in kept.notes)
        return _Kept(replace(kept.report, file=table.file, cached=True), notes)

    def keep(self, findings: Sequence[Diagnostic], verdicts: Sequence[TableVerdict]) -> None:
        """Keep the tables just proved, and that the rest is right if no finding is about it."""
        rest = set(findings)
        for verdict in verdicts:
            place = self._place(verdict.table)
            notes = [
                diagnostic
                for diagnostic in findings
                if all(_inside(span, place) for span in _spans(diagnostic))
            ]
            touching = [
                diagnostic
                for diagnostic in findings
                if any(_inside(span, place) for span in _spans(diagnostic))
            ]
            rest -= set(notes)
            report = table_report(verdict, self.program)
            if report.verdict is Verdict.PROVED and touching == notes:
                placed = tuple(moved(note, -place.start, "") for note in notes)
                self.cache.store(_Kept(report, placed), *self.keys[verdict.table.name])
        if not rest:
            self.cache.store(_Rest(), self.common)

    def _place(self, table: Table) -> Span:
        return _extent(table, self.loaded.sources[table.span.file].text)

    def _text(self, table: Table) -> str:
        return self.loaded.sources[table.span.file].slice(self._place(table))


def _extent(table: Table, text: str) -> Span:
    """Return the span from the table's name to its closing brace, which begins a line: rows begin with a bar."""
    closing = _CLOSING.search(text, table.span.end)
    return Span(table.span.file, table.span.start, closing.end() if closing else len(text))


def _inside(span: Span, place: Span) -> bool:
    return span.file == place.file and place.start <= span.start and span.end <= place.end


def _spans(diagnostic: Diagnostic) -> list[Span]:
    labels = [diagnostic.primary, *diagnostic.related]
    shown = [line.span for witness in diagnostic.witnesses for line in witness.lines if line.span is not None]
    return [label.span for label in labels] + shown


def moved(diagnostic: Diagnostic, by: int, file: str) -> Diagnostic:
    """Return the diagnostic for a text that starts elsewhere."""

    def span(old: Span) -> Span:
        return Span(file, old.start + by, old.end + by)

    def label(old: Label) -> Label:
        return Label(span(old.span), old.message)

    witnesses = tuple(
        replace(
            witness,
            lines=tuple(replace(line, span=span(line.span) if line.span else None) for line in witness.lines),
        )
        for witness in diagnostic.witnesses
    )
    related = tuple(map(label, diagnostic.related))
    return replace(diagnostic, primary=label(diagnostic.primary), related=related, witnesses=witnesses)


def table_report(verdict: TableVerdict, program: Program) -> TableReport:
    """Turn a verdict into the table's part of the report."""
    backing, stops = verdict.backing, verdict.table.stops
    checked = [assumption.name for assumption in program.assumptions if assumption.standing.checked]
    tells = [name for name in checked if name in verdict.table.assumptions and name not in stops]
    return TableReport(
        verdict.table.name,
        verdict.table.file,
        _verdict(verdict),
        len(verdict.table.lines),
        backing.method,
        backing.confirmed_by_z3,
        tuple((str(name), standing.value) for name, standing in backing.assumptions),
        verdict.seconds * 1000,
        stops=tuple(map(str, stops)),
        tells=tuple(map(str, tells)),
    )


def _verdict(verdict: TableVerdict) -> Verdict:
    """Return the verdict in one word: refuted where anything is wrong, though something else was left open."""
    if any(isinstance(finding, SolversDisagree) for finding in verdict.findings):
        return Verdict.UNDECIDED
    if verdict.refuted:
        return Verdict.REFUTED
    return Verdict.UNDECIDED if verdict.undecided else Verdict.PROVED
