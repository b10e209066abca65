"""The vectors of a program, and files of them.

In: a proved program's plan and emitted files. Out: vectors that cover the C, what none reaches, and why not.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically
from rcsc.code.emit.plan import Plan
from rcsc.code.testing.coverage.candidates import untrusted
from rcsc.code.testing.coverage.case import expected
from rcsc.code.testing.coverage.choose import Kept, chosen
from rcsc.code.testing.coverage.directed import Director
from rcsc.code.testing.coverage.document import (
    VectorSet,
    as_json,
    sessions_csv,
    sessions_document,
    vectors_csv,
    vectors_document,
)
from rcsc.code.testing.coverage.harness import vectors_c
from rcsc.code.testing.coverage.nearby import nearby
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.code.testing.inputs.snapshot import Missing, search_in
from rcsc.code.testing.inputs.snapshot import Solver as Finder
from rcsc.code.testing.inputs.vectors import vectors_of
from rcsc.lang.model import Real, Value
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.values import Node

SESSIONS = 200
"""Drawn of each step and cycle, at most."""
ALONE = {".csv": "CSV", ".c": "C"}
"""Endings of files that hold one program."""


def vector_set(
    plan: Plan,
    files: Mapping[str, str],
    options: Options,
    solver: Finder | None,
    progress: Callable[[str], None],
    sessions: int = SESSIONS,
) -> VectorSet:
    """Vectors of one program.

    Args:
        plan: Of a proved program.
        files: What was emitted of it.
        options: How much Z3 may do.
        solver: Asked for inputs of the tables.
        progress: Told what is being done.
        sessions: How many are drawn of each step and cycle, at most.
    """
    program, symbols = plan.program, symbols_of(plan.program, files)
    search = search_in(program, solver)
    progress(f"looking for vectors of {program.name}")
    tables = tuple(vectors_of(search, table) for table in program.tables)
    reals = any("_exact(void)" in text for path, text in files.items() if path.endswith(symbols.source))
    choice = chosen(search, plan, symbols, tables, sessions, progress, reals=reals)
    progress(f"solving for vectors of {program.name}")
    unreached = tuple(Director(choice, asking(options)).all())
    progress(f"looking beside vectors of {program.name}")
    choice.look_again()
    nearby(choice).all()
    choice.spare()
    kept, sessions_drawn, left = tuple(choice.kept), tuple(choice.sessions), tuple(choice.matters.left())
    return VectorSet(program, symbols, tables, kept, unreached, sessions_drawn, choice.matters.ways, left)


def defended(document: VectorSet, files: Mapping[str, str]) -> VectorSet:
    """The vectors for C that trusts no state: the same, with what it must give, and states that it must refuse.

    Args:
        document: Vectors of the program's plain C.
        files: What `rcsc compile --defensive` emits of the program.
    """
    program = document.program
    cases = [kept.case for kept in document.kept]
    rights = [expected(program, case, defensive=True) for case in cases]
    refused = [
        case
        for case, right in zip(cases, rights, strict=True)
        if case.entry.kind == "check" and right is not None and right.result >= 0
    ]
    more = list(untrusted(program, refused))
    rights += [expected(program, case, defensive=True) for case in more]
    kept = tuple(
        Kept(case, right, frozenset())
        for case, right in zip((*cases, *more), rights, strict=True)
        if right is not None
    )
    return replace(document, symbols=symbols_of(program, files), kept=kept, sessions=())


def asking(options: Options) -> Callable[[Sequence[Node]], Mapping[str, Value] | Missing]:
    """Z3, asked for values at which conditions hold; where reals make it slow, values are tried first."""

    def asks(conditions: Sequence[Node]) -> Mapping[str, Value] | Missing:
        variables = list(values.variables(conditions).values())
        if any(isinstance(variable.kind, Real) for variable in variables):
            tried = trial.witness(conditions, variables)
            if tried is not None:
                return tried
        try:
            solver = Solver(options.limits)
            solver.add(*values.domain(variables), *map(values.term_of, conditions))
            answer = solver.check()
        except smt.troubles():
            return Missing.UNKNOWN
        if answer is Answer.SATISFIABLE:
            return {each.name: solver.value(values.term_of(each), each.kind) for each in variables}
        return Missing.NONE if answer is Answer.UNSATISFIABLE else Missing.UNKNOWN

    return asks


def write_vectors(
    sets: Sequence[VectorSet], vectors: Path | None, sessions: Path | None
) -> Iterator[Diagnostic]:
    """Write vectors (CSV, C or JSON by the name's ending) and drawn sessions (CSV or JSON); what cannot be written."""
    for file, text_of in ((vectors, _vectors_text), (sessions, _sessions_text)):
        if file is None:
            continue
        if file.suffix in ALONE and len(sets) != 1:
            yield _unwritten(
                file,
                f"a {ALONE[file.suffix]} file holds the vectors of one program, and there are {len(sets)}",
            )
            continue
        try:
            write_atomically(file, text_of(file.suffix, sets).encode())
        except OSError as error:
            yield _unwritten(file, f"cannot be written: {error.strerror}")


def _vectors_text(suffix: str, sets: Sequence[VectorSet]) -> str:
    match suffix:
        case ".csv":
            return vectors_csv(sets[0])
        case ".c":
            return vectors_c(sets[0].program, sets[0].symbols, sets[0].kept)
    return as_json([vectors_document(each) for each in sets])


def _sessions_text(suffix: str, sets: Sequence[VectorSet]) -> str:
    return sessions_csv(sets[0]) if suffix == ".csv" else as_json([sessions_document(each) for each in sets])


def figure(document: VectorSet) -> str:
    """How many vectors there are, and how much no vector reaches."""
    left = document.unreached
    shown = sum(each.shown for each in left)
    rest = f", {len(left) - shown} without a vector or a proof" if shown < len(left) else ""
    vectors = f"program {document.program.name}: {len(document.kept)} vectors of the whole C"
    return f"{vectors}; {shown} conditions shown to be out of reach{rest}"


def further_figures(document: VectorSet) -> Iterator[str]:
    """What the vectors run, kind by kind, and what of all that could stand in the procedures they notice."""
    kinds = Counter(kept.case.entry.kind for kept in document.kept)
    matchers = kinds["line"] + kinds["lines"]
    yield f"{kinds['cycle']} vectors run a whole cycle, {kinds['step']} a step, {matchers} a matcher alone, {kinds['check']} `check`"
    if document.ways:
        noticed, left = document.ways - len(document.unnoticed), len(document.unnoticed)
        rest = f"; of {left} no difference was found" if left else ""
        yield f"of {document.ways} slips in procedures and conditions {noticed} are noticed{rest}"


def _unwritten(file: Path, why: str) -> Diagnostic:
    return Diagnostic(Code.NOT_WRITTEN, f"`{file}`: {why}", Label(Span(str(file), 0, 0)))
