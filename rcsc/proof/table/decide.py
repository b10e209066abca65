"""Decide one table by the method that suits it, confirm and certify it."""

import time
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

from rcsc.base.host.memory import uncollected
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Backing, Program, Table
from rcsc.proof.solvers.options import Options
from rcsc.proof.table import boxes
from rcsc.proof.table.certificate import box_certificate, must_cover, tree_certificate
from rcsc.proof.table.regions import partition
from rcsc.proof.table.regions.atoms import Universe
from rcsc.proof.table.regions.region import Rests
from rcsc.proof.table.regions.word_bits import Words, words_of
from rcsc.proof.table.verdict import (
    DeadLine,
    Decided,
    Gap,
    Overlap,
    SolversDisagree,
    TableFinding,
    TableVerdict,
    Undecided,
)

if TYPE_CHECKING:
    from collections.abc import Mapping


@uncollected()
def prove_table(program: Program, table: Table, options: Options) -> TableVerdict:
    """Decide whether exactly one line matches every input in the declared ranges, under the assumptions."""
    begun = time.perf_counter()
    confirmed = False
    if options.solver == "z3":
        method, decided = "z3", _by_z3(program, table, options)
    else:
        method, decided = _decided(program, table, options)
    findings = decided.findings
    if options.solver != "boxes":
        confirmed, findings = _confirmed(program, table, findings, options)
    standing = {a.name: a.standing for a in program.assumptions}
    backing = Backing(method, confirmed, tuple((name, standing[name]) for name in decided.used))
    return TableVerdict(table, findings, backing, decided.certificate, time.perf_counter() - begun)


def _decided(program: Program, table: Table, options: Options) -> tuple[str, Decided]:
    """Decide the table by boxes, or else by a tree of regions; return which of them, and what it says."""
    words = words_of(program, table)
    settled = None if words is None else _by_boxes(program, table, words, options)
    if settled is None or (table.assumptions and _wrong(table, settled)):
        from rcsc.proof.table.relational import decide

        decided = decide(program, table, options)
        return "tree+z3" if decided.by_solver else "tree", decided
    if _wrong(table, settled):
        return "boxes", Decided(settled, ())
    certificate, findings = _certificate(program, table, options), settled
    if _narrows(program, table):
        from rcsc.proof.table.relational import under_assumptions

        findings = under_assumptions(program, table, options, settled)
    return "boxes", Decided(findings, (), certificate)


def _by_z3(program: Program, table: Table, options: Options) -> Decided:
    """Decide the table by Z3 alone, and give the checker what it can check: boxes to count, else the question that was asked."""
    from rcsc.proof.table.confirm import decide

    decided = decide(program, table, options)
    wrong = (DeadLine, Gap) if not must_cover(table) else DeadLine
    if not all(isinstance(finding, wrong) for finding in decided.findings):
        return decided
    if not decided.used and words_of(program, table) is not None:
        certificate = _certificate(program, table, options)
    else:
        from rcsc.proof.table import relational

        if len(table.lines) > relational.MOST_CANDIDATES:
            certificate = relational.decide(program, table, options).certificate
        else:
            certificate = tree_certificate(table, Universe(), (Rests(),), decided.used)
    return replace(decided, certificate=certificate)


def _certificate(program: Program, table: Table, options: Options) -> "Mapping[str, object] | None":
    """Make the certificate of a proved table of boxes; one that splits words gets a tree of regions, for the checker."""
    if boxes.applies(table):
        return box_certificate(program, table)
    from rcsc.proof.table.relational import certificate_alone

    return certificate_alone(program, table, options)


def _by_boxes(program: Program, table: Table, words: Words, options: Options) -> tuple[TableFinding, ...]:
    decided = boxes.TableBoxes.of(program, table, words)
    pairs = list(islice(decided.overlaps(), partition.MOST_PAIRS))
    findings: list[TableFinding] = [DeadLine(at) for at in decided.dead()]
    findings.extend(decided.both(first, second) for first, second in pairs)
    most = boxes.MOST_GAPS if must_cover(table) else boxes.MOST_FALLS
    try:
        gap = decided.gap(not pairs, 1 if options.bare else most)
    except partition.BudgetError:
        return (*findings, Undecided("whether every input is matched by some line; first mend the overlaps"))
    if gap is not None:
        findings.append(gap)
    return tuple(findings)


def _narrows(program: Program, table: Table) -> bool:
    """Return whether an assumption reads a variable of the table's conditions."""
    return any(
        not set(read_by(assumption.condition)).isdisjoint(table.variables)
        for assumption in program.assumed(table)
    )


def _wrong(table: Table, findings: tuple[TableFinding, ...]) -> bool:
    """Return whether there is any finding besides gaps that a DEFAULT line takes."""
    return any(not isinstance(finding, Gap) or must_cover(table) for finding in findings)


def _confirmed(
    program: Program, table: Table, findings: tuple[TableFinding, ...], options: Options
) -> tuple[bool, tuple[TableFinding, ...]]:
    """Ask Z3 whether it agrees, and add a finding where it does not."""
    from rcsc.proof.table.confirm import Agreement, confirm

    match confirm(program, table, findings, options):
        case Agreement.AGREES:
            return True, findings
        case Agreement.DISAGREES:
            pairs = sum(isinstance(finding, Overlap) for finding in findings)
            return False, (*findings, SolversDisagree(f"{pairs} overlapping pairs were found"))
        case Agreement.UNKNOWN:
            left = Undecided("Z3 gave no answer within its limits")
            return False, (*findings, left) if options.solver == "both" else findings
        case Agreement.NOT_ASKED:
            return False, findings
