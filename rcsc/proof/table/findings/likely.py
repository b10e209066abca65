"""Which witness of a finding is shown: one that all declared facts allow, where there is one.

In: findings of a table, with least witnesses. Out: the same findings; where the program declares facts that the table does not
assume, each with the least input of its own that these facts allow, so that nobody has to ask whether it can happen. Z3 is asked;
what it does not answer leaves the witness as it was.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rcsc.lang.interval_sets import holds
from rcsc.lang.model import Expr, Program, Table, key_of
from rcsc.lang.questions import conjunction, negation
from rcsc.proof.solvers.options import Options
from rcsc.proof.symbolic.encode import least_where
from rcsc.proof.table.verdict import Gap, Overlap, Region, TableFinding, Witness

MOST_LOOKED_AT = 20
"""Findings of one table whose witness is looked for anew: as many as a text shows."""


def likely(
    program: Program, table: Table, findings: Iterable[TableFinding], options: Options
) -> Iterator[TableFinding]:
    """Yield the findings, with witnesses that all declared facts allow where such exist.

    These include the facts that the table does not assume. A fact about two cycles allows what may follow some cycle.
    """
    if all(assumption.name in table.assumptions for assumption in program.assumptions):
        yield from findings
        return
    facts = [assumption.condition for assumption in program.assumptions]
    looked_at = 0
    for finding in findings:
        told = isinstance(finding, Overlap) or (
            isinstance(finding, Gap) and (table.default is None or table.default.unreachable)
        )
        looked_at += told
        if not told or looked_at > MOST_LOOKED_AT:
            yield finding
        elif isinstance(finding, Overlap):
            yield _likely_overlap(program, table, finding, facts, options)
        else:
            assert isinstance(finding, Gap)
            yield _likely_gap(program, table, finding, facts, options)


def _likely_overlap(
    program: Program, table: Table, overlap: Overlap, facts: Sequence[Expr], options: Options
) -> Overlap:
    tests = (test for at in (overlap.first, overlap.second) for test in table.lines[at].tests)
    here = [test.condition for test in tests if test is not None]
    shown = [v for v in program.variables if v.name in overlap.witness]
    witness = least_where([*here, *facts], program.variables, shown, options)
    if witness is None or not _inside(program, overlap.region, witness):
        return overlap
    return replace(overlap, witness=witness)


def _likely_gap(program: Program, table: Table, gap: Gap, facts: Sequence[Expr], options: Options) -> Gap:
    """Return the gap with an input that the facts allow, and the region of that input first."""
    here = [
        negation(conjunction(test.condition for test in line.tests if test is not None))
        for line in table.lines
        if any(line.tests)
    ]
    shown = [v for v in program.variables if v.name in gap.witnesses[0]]
    witness = least_where([*here, *facts], program.variables, shown, options)
    if witness is None:
        return gap
    at = next((at for at, region in enumerate(gap.regions) if _inside(program, region, witness)), None)
    if at is None:
        return gap
    order = [at, *(other for other in range(len(gap.regions)) if other != at)]
    witnesses = (witness, *(gap.witnesses[other] for other in order[1:]))
    return replace(gap, witnesses=witnesses, regions=tuple(gap.regions[other] for other in order))


def _inside(program: Program, region: Region | None, witness: Witness) -> bool:
    """Whether a witness lies in a region of variables; not where it is one of bits."""
    kinds = program.kinds
    return region is not None and all(
        name in witness and holds(box, key_of(kinds[name], witness[name])) for name, box in region.items()
    )
