"""A text taken through the stages: its program, what is reported of it, its verdict, its generated files."""

from collections.abc import Iterable
from pathlib import Path

from hypothesis import reject

from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.code import emit
from rcsc.code.emit import TARGETS
from rcsc.code.emit.lower import lower
from rcsc.driver.compile import compile_
from rcsc.driver.settings import Settings
from rcsc.lang.model import Program, ProvedProgram, seal_of_proof
from rcsc.lang.project import load
from rcsc.lang.resolve import compile_text, resolve
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.findings.unread import unread
from rcsc.proof.table.mending import mended
from rcsc.proof.table.program import ProgramVerdict, prove_program

BOXES = Options(solver="boxes")
"""Decides tables by boxes where it can: the quickest."""
STRICT = tuple("-std=c99 -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wpedantic -Werror".split())
"""Of a C compiler that is to have nothing to say of generated C."""


def program_of(text: str, file: str = "case.rcs") -> Program:
    """Return the program of a text by itself, which must be without errors."""
    program = compile_text(text, file)
    assert isinstance(program, Program), [(found.code, found.message) for found in program]
    return program


def drawn_program(text: str, *allowed: str) -> Program:
    """Return the program of a drawn text; Hypothesis draws another where it is none.

    `allowed` are the codes that such a text may have; without any, all may stand.
    """
    program = compile_text(text)
    if not isinstance(program, Program):
        assert not allowed or set(codes(program)) <= set(allowed), program
        reject()
    return program


def refused(text: str) -> tuple[Diagnostic, ...]:
    """Return what is reported of a text that must be no program."""
    found = compile_text(text)
    assert not isinstance(found, Program), "nothing was reported"
    return tuple(found)


def shipped(path: str, folder: Path) -> Program:
    """Return the program of a file below the folder, with the files that it uses."""
    loaded = load([str(folder / path)])
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program), program
    return program


def verdict_of(text: str, options: Options = BOXES) -> ProgramVerdict:
    """Prove the program of a text by itself."""
    return prove_program(program_of(text), options)


def reported(text: str, options: Options = BOXES) -> tuple[Diagnostic, ...]:
    """Return what `rcsc check` reports of a text: of reading it, or else of proving it."""
    loaded = load(["-"], stdin=text, stdin_name="case.rcs")
    program = loaded.diagnostics or resolve(loaded.roots[0], loaded)
    if not isinstance(program, Program):
        return tuple(program)
    return mended(prove_program(program, options), loaded.roots[0], loaded, options)


def unread_in(text: str) -> tuple[Diagnostic, ...]:
    """Return what `rcsc check` says besides of what nobody reads in a text."""
    loaded = load(["-"], stdin=text, stdin_name="case.rcs")
    return tuple(unread(program_of(text), loaded.files))


def proved_of(text: str) -> Program:
    """Return the program of a text as its proof leaves it, with the assumptions that stop it."""
    verdict = verdict_of(text)
    assert verdict.proved is not None, verdict.findings
    return verdict.proved.program


def codes(found: Iterable[Diagnostic]) -> list[str]:
    """Return the code of each finding, in order."""
    return [finding.code.value for finding in found]


def errors(found: Iterable[Diagnostic]) -> list[str]:
    """Return the codes of the findings that are errors, in order."""
    return codes(finding for finding in found if finding.severity is Severity.ERROR)


def emitted(program: Program) -> dict[str, str]:
    """Return the generated files by path, the proof taken as given."""
    return emit.emitted(lower(ProvedProgram(program, seal_of_proof())))


def compile_beside(*sources: Path) -> None:
    """Compile sources of one folder, which must be proved, into the folder `generated` beside them."""
    settings = Settings(tuple(map(str, sources)), Options())
    made = compile_(settings, sources[0].parent / "generated", TARGETS, only_check=False)
    assert not made.report.failed, made.report.diagnostics
