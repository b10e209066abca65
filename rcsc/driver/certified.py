"""`rcsc certify`: a certificate, made now or kept in a file, put before the checker."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import Malformed, content, json_of
from rcsc.driver.pipeline import proved, read
from rcsc.driver.settings import Conclusion, Settings
from rcsc.lang.model import Program, ProvedProgram
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import resolve
from rcsc.proof import certify as checker
from rcsc.proof.certify import CaseAnswer, Certified
from rcsc.proof.solvers.smtlib import cvc5_says

MOST_PROBLEMS = 10


@dataclass(frozen=True, slots=True)
class Checking:
    """Settings of the check of a certificate.

    Attributes:
        cvc5: Whether cvc5 is asked the questions that the checker does not settle by itself.
        strict: Whether it is an error that something was not checked.
        questions: A folder for the questions left, one SMT-LIB file each.
    """

    cvc5: bool = False
    strict: bool = False
    questions: Path | None = None


def certify(settings: Settings, how: Checking, write: Path | None, against: Path | None) -> Conclusion:
    """Check a certificate, made now or kept, by the checker alone.

    Nothing is proved where a kept one is checked: a question that the checker leaves is then an error, as no prover vouches for it.
    """
    if against is not None:
        return _reviewed(read(settings), _kept(against), replace(how, strict=True))
    project = proved(settings)
    report = project.report()
    [proof] = project.proofs or (None,)
    certificate = None if report.failed or proof is None else proof.certificate()
    if proof is None or certificate is None:
        return Conclusion(report, "nothing is certified: not everything is proved")
    unwritten = _keep(certificate, write) if write is not None else ()
    reviewed = _reviewed(project.loaded, certificate, how, proof.proved)
    report = project.report((*unwritten, *reviewed.report.diagnostics))
    return Conclusion(
        replace(report, tables=()), reviewed.closing
    )  # the verdicts are the prover's, not the checker's


def _kept(path: Path) -> Mapping[str, object] | Diagnostic:
    """Read the certificate in a file; anything else there is a diagnostic."""
    try:
        value = json_of(content(path), plain=False)
    except OSError as error:
        return _refused(str(path), f"`{path}` cannot be read: {error.strerror}", Code.UNREADABLE)
    except Malformed as error:
        return _refused(str(path), f"`{path}` is not a certificate: it {error}")
    if not isinstance(value, dict):
        return _refused(str(path), f"`{path}` is not a certificate")
    return value


def _keep(certificate: Mapping[str, object], path: Path) -> tuple[Diagnostic, ...]:
    """Write a certificate; return a diagnostic where it could not be written."""
    text = json.dumps(certificate, separators=(",", ":"), sort_keys=True) + "\n"
    try:
        write_atomically(path, text.encode())
    except OSError as error:
        return (_refused(str(path), f"`{path}` cannot be written: {error.strerror}", Code.NOT_WRITTEN),)
    return ()


def _reviewed(
    loaded: Loaded,
    certificate: Mapping[str, object] | Diagnostic,
    how: Checking,
    proved: ProvedProgram | None = None,
) -> Conclusion:
    """Report on a certificate of the first root: its problems, and the obligations that were checked and that were not.

    The certificate must name the stopping assumptions of what was `proved`, from which executors are made.
    """
    if isinstance(certificate, Diagnostic):
        return Conclusion(Report((certificate,)), "not certified")
    program = resolve(loaded.roots[0], loaded) if loaded.roots else loaded.diagnostics
    if not isinstance(program, Program):
        return Conclusion(Report(program, (), loaded.sources), "not certified")
    stops = None if proved is None else {str(table.name): table.stops for table in proved.program.tables}
    outcome = checker.certify(program, certificate, _cvc5 if how.cvc5 else None, stops)
    diagnostics = [
        _refused(program.file, f"the certificate is refused: {problem}")
        for problem in outcome.problems[:MOST_PROBLEMS]
    ]
    if how.questions is not None:
        diagnostics += _kept_questions(outcome, how.questions)
    severity = Severity.ERROR if how.strict else Severity.NOTE
    diagnostics += [
        Diagnostic(
            Code.NOT_CHECKED, f"not checked: {unchecked.name}", Label(unchecked.written), severity=severity
        )
        for unchecked in outcome.unchecked
    ]
    return Conclusion(Report(tuple(diagnostics), (), loaded.sources), _closing(program, outcome))


def _closing(program: Program, outcome: Certified) -> str:
    """Say how much was checked, and what that rests on."""
    if outcome.problems:
        return "not certified"
    checked, total = len(outcome.checked), len(outcome.checked) + len(outcome.unchecked)
    resting = "".join(f"\n  it rests on {ground}" for ground in outcome.rests_on)
    if outcome.whole:
        return f"certified: checked all {total} obligations of `{program.name}`{resting}"
    lead = f"not wholly certified: checked {checked} of {total} obligations of `{program.name}`"
    return f"{lead}; for the others, named above, there is only the prover's word{resting}"


def _kept_questions(outcome: Certified, folder: Path) -> list[Diagnostic]:
    """Write the questions left, one file each; return a diagnostic where a file could not be written."""
    for number, unchecked in enumerate(outcome.unchecked, start=1):
        path = folder / f"{number:03}.smt2"
        text = f"; {unchecked.name}\n; unsat: it holds\n{unchecked.question}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(path, text.encode())
        except OSError as error:
            return [_refused(str(path), f"`{path}` cannot be written: {error.strerror}", Code.NOT_WRITTEN)]
    return []


def _cvc5(question: str) -> CaseAnswer:
    """Return the answer of cvc5, which has no part in the proof."""
    return {"unsat": CaseAnswer.NONE, "sat": CaseAnswer.SOME}.get(cvc5_says(question), CaseAnswer.UNKNOWN)


def _refused(file: str, message: str, code: Code = Code.CERTIFICATE) -> Diagnostic:
    return Diagnostic(code, message, Label(Span(file, 0, 0)))
