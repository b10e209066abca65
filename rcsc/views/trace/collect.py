"""`rcsc trace`: every program proved, compiled and traced; the matrices as files, and what does not fit as findings.

In: settings. Out: matrices, and a conclusion.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.report import TableReport
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.cache import Cache, cache_of, open_cache
from rcsc.base.host.files.read import json_of
from rcsc.code.emit import TARGETS
from rcsc.code.emit.plan import Plan
from rcsc.code.testing.figures import counted
from rcsc.compose.proof.standing import KnownSystem, KnownVerdict
from rcsc.driver.compile import (
    Generated,
    code_of,
    files_of,
    files_of_system,
    planned,
    systems_in,
    with_programs,
)
from rcsc.driver.outline import known as known_of
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.requirements import Read, known_requirements, read
from rcsc.driver.settings import CodeWanted, Conclusion, Settings
from rcsc.driver.trials import whole_vectors
from rcsc.lang.model import Program, ProvedProgram
from rcsc.lang.project import project_root, systems_above
from rcsc.run.description import description
from rcsc.views.pages.documents import TEXTS, texts_page
from rcsc.views.trace.across import declared_across, of_lines
from rcsc.views.trace.kept import against, kept, names_of
from rcsc.views.trace.matrix import OPEN, REFUTED, Matrix, ProgramFacts, TableProof, matrix, of_system
from rcsc.views.trace.page import page
from rcsc.views.trace.requirements import covered, findings, listed, of_scripts, refuted, standings
from rcsc.views.trace.tables_of import code_csv, lines_csv, requirements_csv, to_json

if TYPE_CHECKING:
    from rcsc.compose.coverage.covered import Coverage

MOST_SHOWN = 10
"""Lines of generated code that come from nothing, named in one finding."""
_SAID = {
    KnownVerdict.PROVED: "proved of the levels together",
    KnownVerdict.TRUSTED: "proved of the levels together, trusting assumptions that are declared",
    KnownVerdict.CONDITIONAL: "conditional: rests on what is not proved",
    KnownVerdict.REFUTED: REFUTED,
    KnownVerdict.NOT_PROVED: OPEN,
}
SURVIVES = "survives"
"""What becomes of a slip that nothing notices (`compose.coverage.slips`)."""
ANY_CODE = CodeWanted()
"""What lies beside the project, if it does."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is asked for.

    Attributes:
        vectors: Whether test vectors are made; where a kept matrix is held against this one, as it was made.
        requirements: A file with the names of all requirements, one in each line.
        against: A matrix that was kept, which must be the one of this version.
        code: Generated files that lie there, which must be those that are traced.
    """

    vectors: bool = True
    requirements: Path | None = None
    against: Path | None = None
    code: CodeWanted = ANY_CODE


@dataclass(frozen=True, slots=True)
class Traced:
    """What was traced.

    Attributes:
        matrices: Of each program and system; none where something is not proved.
        listed: The requirements of the list.
        vectors: Whether vectors were made.
    """

    conclusion: Conclusion
    matrices: tuple[Matrix, ...] = ()
    listed: tuple[str, ...] = ()
    vectors: bool = False

    def files(self) -> dict[str, str]:
        """Give what is to be kept, by name."""
        document = to_json(self.matrices, self.listed, vectors=self.vectors)
        return {
            "trace.json": json.dumps(document, indent=1) + "\n",
            "lines.csv": lines_csv(self.matrices),
            "code.csv": code_csv(self.matrices),
            "requirements.csv": requirements_csv(self.matrices, self.listed),
            "trace.html": page(self.matrices, self.listed),
            TEXTS: texts_page({path: text for one in self.matrices for path, text in one.texts.items()}),
        }


def trace(settings: Settings, wanted: Wanted) -> Traced:
    """Prove and compile every program, and trace its lines to code, tests, proofs and requirements, and back.

    Raises:
        BadDescription: A system is not in order.
        OSError: The list of requirements, or the kept matrix, cannot be read.
        Malformed: It is not what it should be.
    """
    was = None if wanted.against is None else kept(wanted.against)
    names = names_of(was) if wanted.requirements is None else listed(wanted.requirements)
    if was is not None:
        wanted = replace(wanted, vectors=was.get("vectors") is not False)
    systems = tuple(systems_in(settings.paths))
    project = proved(with_programs(settings, systems))
    report = project.report()
    if report.failed:
        return Traced(Conclusion(report, "nothing was traced: not everything is proved"))
    cache = open_cache(Path(project_root(str(project.executable[0][0])))) if project.executable else None
    plans = [(root, planned(program), program) for root, program in project.executable]
    whole = {path: read(path, cache) for path in systems if description(path).requirements is not None}
    matrices = [
        _matrix(project, plan, program, settings, wanted, cache, tuple(whole.values()))
        for _, plan, program in plans
    ]
    by_root = {os.path.realpath(root): plan for root, plan, _ in plans}
    matrices += [_of_system(by_root, path, whole.get(path), cache) for path in systems]
    settings.progress("")
    found = [*_untraced(matrices), *refuted(matrices), *_lying(project, systems, wanted.code)]
    if wanted.requirements is not None:
        found += findings(matrices, names, wanted.requirements)
    if was is not None and wanted.against is not None:
        document = json_of(json.dumps(to_json(matrices, names, vectors=wanted.vectors)), plain=False)
        found += against(was, document, wanted.against)
    conclusion = Conclusion(project.report(tuple(found)), _closing(matrices, names))
    return Traced(conclusion, tuple(matrices), names, wanted.vectors)


def _lying(project: Proved, systems: tuple[Path, ...], code: CodeWanted) -> Iterator[Diagnostic]:
    """Report generated files that lie there and are not those that are traced."""
    for root, program in project.executable:
        yield from code_of(root, partial(files_of, program, TARGETS), code, systems).stale
    for path in systems:
        yield from code_of(str(path), partial(files_of_system, path, project, ("c",)), code, (path,)).stale


def _matrix(
    project: Proved,
    plan: Plan,
    program: ProvedProgram,
    settings: Settings,
    wanted: Wanted,
    cache: Cache | None,
    systems: Sequence[Read],
) -> Matrix:
    settings.progress(f"tracing {program.program.file}")
    [proof] = [proof for proof in project.proofs if proof.proved is program]
    told = [(found.primary.span, f"{found.code.value}: {found.message}") for found in proof.diagnostics]
    properties = {} if cache is None else dict(property_proofs(program.program, cache))
    coverage = None if cache is None else covered_of(program.program, cache)
    if coverage is not None:
        told += _unspoken_of(program.program, coverage)
        for name, needs in _needs(coverage):
            properties[name] = f"{properties[name]}; {needs}" if name in properties else needs
    known = ProgramFacts(
        _table_proofs(proof.tables),
        tuple(told),
        whole_vectors(program, settings) if wanted.vectors else None,
        properties,
        project.loaded.sources,
        {at: told for its in systems for at, told in of_lines(its, program.program.name).items()},
    )
    return matrix(plan, known)


# --- what is proved, as far as it is known without beginning a search ---


def _table_proofs(reports: Iterable[TableReport]) -> dict[str, TableProof]:
    """Return the verdict of each table, by its name."""
    return {
        one.table: TableProof(
            one.verdict.value, f"exactly one of {one.lines} lines matches, {one.backed}", one.assumptions
        )
        for one in reports
    }


def property_proofs(program: Program, cache: Cache) -> Mapping[str, str]:
    """Return the verdicts of earlier proofs of the levels together on each property; those that nobody proved are left out."""
    return dict(_known(program, cache)) if program.properties else {}


def covered_of(program: Program, cache: Cache) -> "Coverage | None":
    """Return what an earlier `rcsc prove --coverage` found of the level of a program, as it is; None where nobody asked."""
    levels = {one.name: os.path.realpath(one.span.file) for one in program.levels}
    known = _standing(program, cache) if levels and program.properties else None
    if known is None:
        return None
    from rcsc.compose.coverage.kept import recalled  # it takes a while, and most are asked without

    system, standing = known
    there = cache_of(system.parent, cache)
    here = (one for one in standing.outline.levels if levels.get(one.name) == one.file)
    return next((found for one in here if (found := recalled(there, one.content)) is not None), None)


def _standing(program: Program, cache: Cache) -> tuple[Path, KnownSystem] | None:
    """Return the nearest system above a program whose levels were proved together, with what is known of them."""
    for system in systems_above(program.file):
        standing = known_of(system, cache_of(system.parent, cache))
        if standing is not None:
            return system, standing
    return None


def _needs(coverage: "Coverage") -> Iterator[tuple[str, str]]:
    """Yield what each requirement needs, by name."""
    for core in coverage.cores:
        few = ", no fewer" if core.minimal else ""
        yield core.key[2], f"needs {counted(len({use.part for use in core.uses}), 'assignment')}{few}"


def _unspoken_of(program: Program, coverage: "Coverage") -> Iterator[tuple[Span, str]]:
    """Yield lines of which no requirement needs all that they write, each with its place."""
    silent = {
        (one.slip.uses[0].table, one.slip.uses[0].line)
        for one in coverage.slips
        if one.slip.whole_line and one.fate == SURVIVES
    }
    left = dict[tuple[str, str], list[str]]()
    for use in coverage.unneeded if coverage.cores else ():
        left.setdefault((use.table, use.line), []).extend(use.part.leaves)
    for table in program.tables:
        for line in table.every_line:
            at = str(table.name), str(line.name)
            if leaves := dict.fromkeys(left.get(at, ())):
                yield (
                    line.span,
                    f"no requirement of the level speaks of what it writes to {', '.join(leaves)}",
                )
            if at in silent:
                yield (
                    line.span,
                    "without all that it does, everything that is proved of the level still holds",
                )


def _known(program: Program, cache: Cache) -> Iterator[tuple[str, str]]:
    own = {one.name: os.path.realpath(one.span.file) for one in program.properties}
    known = _standing(program, cache)
    if known is None:
        return
    system, standing = known
    for level in standing.outline.levels:
        for key, file in level.properties:
            if own.get(key[2]) == file:
                state = standing.of_obligation(level.name, key)
                if state in _SAID:
                    yield key[2], f"{_SAID[state]}, {os.path.relpath(system)}"


def _of_system(plans: dict[str, Plan], path: Path, its: Read | None, cache: Cache | None) -> Matrix:
    """Build the matrix of a whole system: its C, which is made of its description, what its scripts test, what its levels keep together."""
    generated = Generated(("c",), defensive=False, plans=plans)
    generated.add_system(path)
    across = () if its is None else tuple(declared_across(its, known_requirements(its, cache)))
    return replace(of_system(generated.systems[path], str(path)), declared=(*across, *of_scripts(path)))


# --- what is told ---


def _untraced(matrices: Sequence[Matrix]) -> Iterator[Diagnostic]:
    for one in matrices:
        if one.untraced:
            count = len(one.untraced)
            more = [f"and {count - MOST_SHOWN} more"] if count > MOST_SHOWN else []
            message = f"{count} {'line' if count == 1 else 'lines'} of generated code come from nothing in the tables"
            notes = (*one.untraced[:MOST_SHOWN], *more)
            yield Diagnostic(Code.NOT_TRACED, message, Label(Span(one.source, 0, 0)), notes=notes)


def _closing(matrices: Sequence[Matrix], names: Sequence[str]) -> str:
    lines = [f"{one.program}: {_figures(one)}" for one in matrices]
    if names:
        lines.append(covered(standings(matrices), names))
    return "\n".join(lines)


def _figures(one: Matrix) -> str:
    pieces = f"{len(one.pieces)} pieces of {len({piece.file for piece in one.pieces})} files"
    named = sum(bool(line.answers or line.properties) for line in one.lines)
    lines = f"{len(one.lines)} lines, {named} with a requirement, " if one.lines else ""
    return f"{lines}{pieces}, {len(one.untraced) or 'none'} from nothing"
