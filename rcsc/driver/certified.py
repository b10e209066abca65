"""`rcsc certify`: a certificate, made now or kept in a file, put before the checker."""

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.report import Report
from rcsc.driver.work import Made
from rcsc.files import write_atomically
from rcsc.project import Loaded
from rcsc.source import Span

if TYPE_CHECKING:
    from rcsc.certify import Form
    from rcsc.model import Program, Table

MOST_PROBLEMS = 10


def kept(path: Path) -> Mapping[str, object] | Diagnostic:
    """The certificate in a file; anything else there is a diagnostic."""
    try:
        value = json.loads(path.read_bytes())
    except OSError as error:
        return _refused(str(path), f"`{path}` cannot be read: {error.strerror}", Code.UNREADABLE)
    except (ValueError, RecursionError):
        return _refused(str(path), f"`{path}` is not a certificate: it is not JSON")
    if not isinstance(value, dict):
        return _refused(str(path), f"`{path}` is not a certificate")
    return value


def keep(certificate: Mapping[str, object], path: Path) -> tuple[Diagnostic, ...]:
    """Write a certificate; why it could not be written."""
    text = json.dumps(certificate, separators=(",", ":"), sort_keys=True) + "\n"
    try:
        write_atomically(path, text.encode())
    except OSError as error:
        return (_refused(str(path), f"`{path}` cannot be written: {error.strerror}", Code.NOT_WRITTEN),)
    return ()


def reviewed(loaded: Loaded, certificate: Mapping[str, object] | Diagnostic) -> Made:
    """The report on a certificate of the first root: what is wrong with it, and what the proof rests on."""
    from rcsc.model import Program
    from rcsc.resolve import resolve

    if isinstance(certificate, Diagnostic):
        return Made(Report((certificate,)), "not certified")
    program = resolve(loaded.roots[0], loaded) if loaded.roots else loaded.found
    if not isinstance(program, Program):
        return Made(Report(program, (), loaded.sources), "not certified")
    found, rests_on = _checked(program, certificate)
    report = Report(found, (), loaded.sources)
    if found:
        return Made(report, "not certified")
    resting = "".join(f"\n  it rests on {one}" for one in rests_on)
    count = f"{len(program.tables)} table{'' if len(program.tables) == 1 else 's'}"
    return Made(report, f"certified: {count} of `{program.name}`{resting}")


def _checked(
    program: "Program", certificate: Mapping[str, object]
) -> tuple[tuple[Diagnostic, ...], tuple[str, ...]]:
    from rcsc.certify import certify

    outcome = certify(program, certificate, refuter)
    found = tuple(
        _refused(program.file, f"the certificate is refused: {problem}")
        for problem in outcome.problems[:MOST_PROBLEMS]
    )
    return found, outcome.rests_on


def refuter(
    program: "Program",
    table: "Table",
    assumptions: tuple[str, ...],
    bounds: Mapping["Form", tuple[int, int]],
    lines: tuple[int, ...],
) -> str:
    """The solver that finds no fault in the region; "" where none does.

    cvc5 is asked first, which has no part in the proof; Z3, which has, only where cvc5 is not installed.
    """
    from rcsc.questions import question
    from rcsc.smtlib import cvc5_refutes, script

    asked = question(program, table, assumptions, bounds, lines)
    if find_spec("cvc5") is not None:
        return "cvc5" if cvc5_refutes(script(program, asked)) else ""
    from rcsc.prove.encode import declared, encode
    from rcsc.prove.smt import Answer, Solver

    frame, ranges = declared(program.variables)
    solver = Solver()
    solver.add(*ranges, *(encode(condition, frame) for condition in asked))
    return "z3 alone (cvc5 is not installed)" if solver.check() is Answer.UNSATISFIABLE else ""


def _refused(file: str, message: str, code: Code = Code.CERTIFICATE) -> Diagnostic:
    return Diagnostic(code, message, Label(Span(file, 0, 0)))
