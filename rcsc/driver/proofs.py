"""Proofs of one program, those that an earlier run made taken from the cache.

In: a program. Out: a `Proof`. What the cache holds of a table counts only while everything its proof depends
on is the same, and while the files that its findings point into are.
"""

from rcsc.cache import Cache
from rcsc.diagnostics.report import TableReport, Verdict
from rcsc.driver.work import Proof
from rcsc.model import Program
from rcsc.project import Loaded
from rcsc.prove.certificate import must_cover
from rcsc.prove.options import Options
from rcsc.prove.verdict import Gap, SolversDisagree, TableVerdict, Undecided


def prove(root: str, program: Program, loaded: Loaded, options: Options, cache: Cache | None) -> Proof:
    """Prove a program's tables, procedures and invariants."""
    from rcsc.prove.program import prove_program

    verdict = prove_program(program, options)
    tables = tuple(table_report(one) for one in verdict.tables)
    return Proof(root, verdict.findings, program, tables, verdict.proved, verdict.certificate)


def table_report(verdict: TableVerdict) -> TableReport:
    """A verdict as the report shows it."""
    backing = verdict.backing
    return TableReport(
        verdict.table.name,
        verdict.table.file,
        _said(verdict),
        len(verdict.table.lines),
        backing.method,
        backing.confirmed_by_z3,
        tuple((str(name), standing.value) for name, standing in backing.assumptions),
        verdict.seconds * 1000,
    )


def _said(verdict: TableVerdict) -> Verdict:
    if any(isinstance(one, Undecided | SolversDisagree) for one in verdict.found):
        return Verdict.UNDECIDED
    falls = not must_cover(verdict.table)
    wrong = any(not (isinstance(one, Gap) and falls) for one in verdict.found)
    return Verdict.REFUTED if wrong else Verdict.PROVED
