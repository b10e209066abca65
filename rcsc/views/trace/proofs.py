"""What is proved of a program's tables and properties, as far as it is known without beginning a search."""

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from rcsc.base.diagnostics.report import TableReport
from rcsc.base.host.cache import Cache, cache_of
from rcsc.compose.proof.standing import PROPERTY, KnownVerdict
from rcsc.driver.outline import known
from rcsc.lang.model import Program
from rcsc.lang.project import systems_above
from rcsc.views.trace.matrix import REFUTED, TableProof

_SAID = {
    KnownVerdict.PROVED: "proved of the levels together",
    KnownVerdict.TRUSTED: "proved of the levels together, trusting assumptions that are declared",
    KnownVerdict.CONDITIONAL: "conditional: rests on what is not proved",
    KnownVerdict.NOT_PROVED: REFUTED,
}


def table_proofs(reports: Iterable[TableReport]) -> dict[str, TableProof]:
    """Return the verdict of each table, by its name."""
    return {one.table: TableProof(one.verdict.value, _method(one), one.assumptions) for one in reports}


def _method(table: TableReport) -> str:
    return f"exactly one of {table.lines} lines matches, {table.backed}"


def property_proofs(program: Program, cache: Cache) -> Mapping[str, str]:
    """Return the verdicts of earlier proofs of the levels together on each property; those that nobody proved are left out."""
    if not program.properties:
        return {}
    return dict(_known(program, cache))


def _known(program: Program, cache: Cache) -> Iterator[tuple[str, str]]:
    own = {one.name: os.path.realpath(one.span.file) for one in program.properties}
    for system in systems_above(program.file):
        standing = known(system, cache_of(Path(system).parent, cache))
        if standing is None:
            continue
        for level in standing.outline.levels:
            for name, file in level.properties:
                if own.get(name) == file:
                    state = standing.of_obligation(level.name, (PROPERTY, "", name))
                    if state in _SAID:
                        yield name, f"{_SAID[state]}, {os.path.relpath(system)}"
        return
