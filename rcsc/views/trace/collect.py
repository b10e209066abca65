"""`rcsc trace`: every program proved, compiled and traced; the matrices as files, and what does not fit as findings.

In: settings. Out: matrices, and a conclusion.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.cache import Cache, open_cache
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import Malformed, json_of, text
from rcsc.code.emit.plan import Plan
from rcsc.driver.compile import Generated, planned, systems_in, tables_in
from rcsc.driver.pipeline import Proved, proved
from rcsc.driver.settings import Conclusion, Settings
from rcsc.driver.trials import whole_vectors
from rcsc.lang.model import ProvedProgram
from rcsc.lang.project import project_root
from rcsc.views.trace.matrix import Matrix, ProgramFacts, matrix, of_system
from rcsc.views.trace.page import page
from rcsc.views.trace.proofs import property_proofs, table_proofs
from rcsc.views.trace.requirements import covered, findings, listed, places
from rcsc.views.trace.tables_of import code_csv, lines_csv, requirements_csv, to_json

MOST_SHOWN = 10
"""Lines of generated code that come from nothing, named in one finding."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is asked for.

    Attributes:
        vectors: Whether test vectors are made.
        requirements: A file with the names of all requirements, one in each line.
        against: A matrix that was kept, which must be of this version.
    """

    vectors: bool = True
    requirements: Path | None = None
    against: Path | None = None


@dataclass(frozen=True, slots=True)
class Traced:
    """What was traced.

    Attributes:
        matrices: Of each program and system; none where something is not proved.
        listed: The requirements of the list.
    """

    conclusion: Conclusion
    matrices: tuple[Matrix, ...] = ()
    listed: tuple[str, ...] = ()

    def files(self) -> dict[str, str]:
        """Give what is to be kept, by name."""
        document = to_json(self.matrices, self.listed)
        return {
            "trace.json": json.dumps(document, indent=1) + "\n",
            "lines.csv": lines_csv(self.matrices),
            "code.csv": code_csv(self.matrices),
            "requirements.csv": requirements_csv(self.matrices, self.listed),
            "trace.html": page(self.matrices, self.listed),
        }


def trace(settings: Settings, wanted: Wanted) -> Traced:
    """Prove and compile every program, and trace its lines to code, tests, proofs and requirements, and back.

    Raises:
        BadDescription: A system is not in order.
        OSError: The list of requirements, or the kept matrix, cannot be read.
        Malformed: It is not what it should be.
    """
    names = () if wanted.requirements is None else listed(wanted.requirements)
    systems = tuple(systems_in(settings.paths))
    project = proved(replace(settings, paths=tables_in(settings.paths, systems)))
    report = project.report()
    if report.failed:
        return Traced(Conclusion(report, "nothing was traced: not everything is proved"))
    cache = open_cache(Path(project_root(str(project.executable[0][0])))) if project.executable else None
    plans = [(root, planned(program), program) for root, program in project.executable]
    matrices = [_matrix(project, plan, program, settings, wanted, cache) for _, plan, program in plans]
    by_root = {os.path.realpath(root): plan for root, plan, _ in plans}
    matrices += [_of_system(by_root, path) for path in systems]
    settings.progress("")
    found = [*_untraced(matrices)]
    if wanted.requirements is not None:
        found += findings(matrices, names, wanted.requirements)
    if wanted.against is not None:
        found += _against(matrices, wanted.against)
    return Traced(Conclusion(project.report(tuple(found)), _closing(matrices, names)), tuple(matrices), names)


def _matrix(
    project: Proved,
    plan: Plan,
    program: ProvedProgram,
    settings: Settings,
    wanted: Wanted,
    cache: Cache | None,
) -> Matrix:
    settings.progress(f"tracing {program.program.file}")
    [proof] = [proof for proof in project.proofs if proof.proved is program]
    known = ProgramFacts(
        table_proofs(proof.tables),
        tuple((found.primary.span, f"{found.code.value}: {found.message}") for found in proof.diagnostics),
        whole_vectors(program, settings) if wanted.vectors else None,
        {} if cache is None else property_proofs(program.program, cache),
        project.loaded.sources,
    )
    return matrix(plan, known)


def _of_system(plans: dict[str, Plan], path: Path) -> Matrix:
    """Build the matrix of the C of a whole system, which is made of its description."""
    generated = Generated(("c",), defensive=False, plans=plans)
    generated.add_system(path)
    return of_system(generated.systems[path], str(path))


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
        lines.append(covered(places(matrices), names))
    return "\n".join(lines)


def _figures(one: Matrix) -> str:
    pieces = f"{len(one.pieces)} pieces of {len({piece.file for piece in one.pieces})} files"
    named = sum(bool(line.answers) for line in one.lines)
    lines = f"{len(one.lines)} lines, {named} with a requirement, " if one.lines else ""
    return f"{lines}{pieces}, {len(one.untraced) or 'none'} from nothing"


# --- a matrix that was kept -------------------------------------------------------------------


def _against(matrices: Sequence[Matrix], path: Path) -> Iterator[Diagnostic]:
    """Yield the parts of a kept matrix that belong to another version."""
    kept = _kept(path)
    for one in matrices:
        was = kept.get(one.program)
        if was is None:
            yield _old(path, f"has no program `{one.program}`")
        elif was.get("digest") != one.digest:
            yield _old(path, f"is of a program `{one.program}` with another meaning")
        elif other := sorted(_changed(was.get("files"), one.files)):
            yield _old(path, f"is of other code of `{one.program}`", *other)


def _changed(was: Any, now: Mapping[str, str]) -> Iterator[str]:
    before = was if isinstance(was, dict) else {}
    yield from (name for name in {*before, *now} if before.get(name) != now.get(name))


def _kept(path: Path) -> dict[str, dict[str, Any]]:
    document = json_of(text(path))
    programs = document.get("programs") if isinstance(document, dict) else None
    if not isinstance(programs, list) or not all(isinstance(one, dict) for one in programs):
        raise Malformed("it is no matrix of `rcsc trace`")
    return {str(one.get("program")): one for one in programs}


def _old(path: Path, what: str, *notes: str) -> Diagnostic:
    helps = ("`rcsc trace` makes it anew",)
    return Diagnostic(
        Code.MATRIX_OLD, f"`{path}` {what}", Label(Span(str(path), 0, 0)), notes=notes, help=helps
    )


def written(files: Mapping[str, str], folder: Path) -> Iterator[Diagnostic]:
    """Write the files; what the operating system refuses."""
    for name, content in files.items():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(folder / name, content.encode())
        except OSError as error:
            message = f"`{folder / name}`: cannot be written: {error.strerror}"
            yield Diagnostic(Code.NOT_WRITTEN, message, Label(Span(str(folder), 0, 0)))
