"""A whole program: its invariants, its tables, and all that its procedures owe.

The only place where a `ProvedProgram` is made, and only when nothing is wrong and nothing undecided.
"""

from collections.abc import Collection, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

from rcsc.diagnostics.diagnostic import Diagnostic, Severity, sort_key
from rcsc.model import Assumption, AssumptionName, Program, ProvedProgram, Standing, Table, TableName, seal_of_proof
from rcsc.prove.certificate import program_certificate
from rcsc.prove.invariants import assumptions_at_first, prove_assumptions, prove_invariants
from rcsc.prove.obligations import Obligations, Tally
from rcsc.prove.options import Options
from rcsc.prove.report import diagnostics
from rcsc.prove.table import prove_table
from rcsc.prove.verdict import TableVerdict


@dataclass(frozen=True, slots=True)
class ProgramVerdict:
    """What was found of a program.

    Attributes:
        findings: Errors, warnings and notes, by position.
        proved: Set only when there is no error.
        tables: One verdict a table.
        certificate: Of all tables; None where something is not proved.
        tally: How the obligations of procedures and conditions were settled.
    """

    findings: tuple[Diagnostic, ...]
    proved: ProvedProgram | None
    tables: tuple[TableVerdict, ...]
    certificate: Mapping[str, object] | None
    tally: Tally


def prove_program(
    program: Program, options: Options, only: Collection[TableName] | None = None
) -> ProgramVerdict:
    """Prove the program's tables (or `only` these) and everything that its procedures owe."""
    found = prove_invariants(program, options)
    if not any(one.severity is Severity.ERROR for one in found):
        found += prove_assumptions(program, options)
    sound = not found
    found += assumptions_at_first(program)
    invariants = [one.condition for one in program.invariants] if sound else []
    relying = _with_invariants(program) if sound else program
    wanted = [table for table in relying.tables if only is None or table.name in only]
    verdicts = _tables(relying, wanted, options)
    for verdict in verdicts:
        found += diagnostics(relying, verdict)
    owed = Obligations(program, options, invariants)
    found += owed.prove([table for table in program.tables if only is None or table.name in only])
    findings = tuple(sorted(dict.fromkeys(found), key=sort_key))
    right = only is None and not any(one.severity is Severity.ERROR for one in findings)
    proved = None
    certificate = None
    if right:
        backings = tuple((verdict.table.name, verdict.backing) for verdict in verdicts)
        proved = ProvedProgram(program, backings, seal_of_proof())
        certificate = _certificate(relying, verdicts, owed.tally)
    return ProgramVerdict(findings, proved, tuple(verdicts), certificate, owed.tally)


def _with_invariants(program: Program) -> Program:
    """Proved invariants as assumptions that tables reading their variables may rely on."""
    from rcsc.resolve.leaves import read_by

    if not program.invariants:
        return program
    made = [Assumption(AssumptionName(i.name), Standing.PROVED, i.condition, i.doc, i.span) for i in program.invariants]
    reads = {one.name: set(read_by(one.condition)) for one in made}
    tables = tuple(
        replace(
            table,
            assumptions=(
                *table.assumptions,
                *(one.name for one in made if reads[one.name] & set(table.variables)),
            ),
        )
        for table in program.tables
    )
    return replace(program, assumptions=(*program.assumptions, *made), tables=tables)


def _tables(program: Program, tables: list[Table], options: Options) -> list[TableVerdict]:
    """Each table's verdict, in order; in processes where there are several tables and jobs."""
    if options.jobs <= 1 or len(tables) <= 1:
        return [prove_table(program, table, options) for table in tables]
    with ProcessPoolExecutor(min(options.jobs, len(tables)), mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(prove_table, program, table, options) for table in tables]
        return [one.result() for one in waiting]


def _certificate(program: Program, verdicts: list[TableVerdict], tally: Tally) -> Mapping[str, object]:
    tables = [verdict.certificate for verdict in verdicts if verdict.certificate is not None]
    owed = [{"name": f"{tally.by_intervals} obligations", "method": "intervals"}] if tally.by_intervals else []
    if tally.by_solver:
        owed.append({"name": f"{tally.by_solver} obligations of procedures and conditions", "method": "z3"})
    if program.invariants:
        owed.append({"name": f"{len(program.invariants)} invariants", "method": "z3"})
    return program_certificate(program, tables, owed)
