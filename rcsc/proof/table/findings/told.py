"""Which witness of a finding is shown, and which overlaps are told together.

In: findings of a table, with least witnesses. Out: the same findings; where the program declares facts that the table does not
assume, each with the least input of its own that these facts allow, so that nobody has to ask whether it can happen. Z3 is asked;
what it does not answer leaves the witness as it was. Of overlaps that come of the same cells the first diagnostic names the others in a
note, and these are left out of a text.
"""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
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
    here = [*table.lines[overlap.first].conditions, *table.lines[overlap.second].conditions]
    shown = [v for v in program.variables if v.name in overlap.witness]
    witness = least_where([*here, *facts], program.variables, shown, options)
    if witness is None or not _inside(program, overlap.region, witness):
        return overlap
    return replace(overlap, witness=witness)


def _likely_gap(program: Program, table: Table, gap: Gap, facts: Sequence[Expr], options: Options) -> Gap:
    """Return the gap with an input that the facts allow, and the region of that input first."""
    here = [negation(conjunction(line.conditions)) for line in table.lines if line.conditions]
    shown = [v for v in program.variables if v.name in gap.witnesses[0]]
    witness = least_where([*here, *facts], program.variables, shown, options)
    if witness is None:
        return gap
    at = next((at for at, region in enumerate(gap.regions) if _inside(program, region, witness)), None)
    if at is None:
        return gap
    order = [at, *(other for other in range(len(gap.regions)) if other != at)]
    witnesses = (witness, *(gap.witnesses[other] for other in order[1:]))
    regions, sizes = tuple(gap.regions[other] for other in order), gap.sizes
    return replace(
        gap,
        witnesses=witnesses,
        regions=regions,
        sizes=tuple(sizes[other] for other in order) if sizes else (),
    )


def _inside(program: Program, region: Region | None, witness: Witness) -> bool:
    """Return whether a witness lies in a region of variables; not where it is one of bits."""
    kinds = program.kinds
    return region is not None and all(
        name in witness and holds(box, key_of(kinds[name], witness[name])) for name, box in region.items()
    )


# --- overlaps told together ---


def grouped(table: Table, overlaps: Sequence[Overlap], shown: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Return the overlaps; of those that come of the same cells, to one end, the first tells the others in a note."""
    groups: dict[object, list[int]] = {}
    for at, (overlap, diagnostic) in enumerate(zip(overlaps, shown, strict=False)):
        cells = _apart_in(table, overlap)
        same = diagnostic.effects is not None and diagnostic.effects.same
        groups.setdefault((cells, same) if cells else at, []).append(at)
    told = list(shown)
    for members in groups.values():
        first, *others = sorted(members, key=lambda at: sort_key(shown[at]))
        if others:
            note = _alike_as(table, [overlaps[at] for at in members], overlaps[first])
            told[first] = replace(shown[first], notes=(*shown[first].notes, note))
        for at in others:
            told[at] = replace(shown[at], told_with=True)
    return told


def _apart_in(table: Table, overlap: Overlap) -> frozenset[tuple[str, str]]:
    """Return the cells of two lines in columns where just one of them has a condition: these bring them together."""
    pair = table.lines[overlap.first], table.lines[overlap.second]
    cells = zip(table.columns, *(line.tests for line in pair), strict=True)
    return frozenset(
        (column.heading, test.text)
        for column, one, other in cells
        for test in (one, other)
        if test is not None and (one is None or other is None)
    )


def _alike_as(table: Table, overlaps: Sequence[Overlap], first: Overlap) -> str:
    """Name the other pairs of a group, by the line that most of them share."""
    pairs = [(each.first, each.second) for each in overlaps if each != first]
    often = Counter(line for pair in [(first.first, first.second), *pairs] for line in pair)
    by_line: dict[int, list[str]] = {}
    for pair in pairs:
        most = max(pair, key=lambda line: (often[line], -line))
        other = pair[1] if most == pair[0] else pair[0]
        by_line.setdefault(most, []).append(str(table.lines[other].name))
    named = "; ".join(
        f"`{table.lines[most].name}` with {names_of(others)}" for most, others in by_line.items()
    )
    cells = ", ".join(_said_under(heading, text) for heading, text in sorted(_apart_in(table, first)))
    many = f"{len(pairs)} more pairs overlap" if len(pairs) > 1 else "1 more pair overlaps"
    return f"{many} where {cells}: {named}; --json lists each"


def _said_under(heading: str, text: str) -> str:
    """Return a cell with its heading: `called = abort`, `now in cleared`."""
    if heading == "when":
        return text
    plain = re.match(r"[\w.]+$|-\d", text) is not None
    return f"{heading} = {text}" if plain else f"{heading} {text}"


def names_of(names: Iterable[str]) -> str:
    """Return names for a message: `a`, `b`."""
    return ", ".join(f"`{name}`" for name in names)
