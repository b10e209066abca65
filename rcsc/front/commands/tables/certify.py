"""`rcsc certify`: a certificate, made now or kept in a file, put before the checker, which shares nothing with the prover."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import click
from click.core import ParameterSource

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import Malformed, content, json_of
from rcsc.driver.pipeline import proved, read
from rcsc.driver.settings import Conclusion, Settings
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.options import proving, settings_of, showing
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Output, finish
from rcsc.front.commands.systems.prove import command as prove
from rcsc.lang.model import Program, ProvedProgram
from rcsc.lang.project import Loaded
from rcsc.lang.resolve import resolve
from rcsc.proof import certify as checker
from rcsc.proof.certify import CaseAnswer, Certified
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smtlib import cvc5_says

MOST_PROBLEMS = 10


@click.command(
    "certify",
    epilog="""\b
Examples:
  rcsc certify acquire.rcs                    prove, then re-check the proof
  rcsc certify acquire.rcs --write a.json     and keep the certificate
  rcsc certify acquire.rcs --against a.json   re-check one that was kept; nothing is proved
  rcsc certify acquire.rcs --certify          have cvc5 answer what the checker leaves
  rcsc certify tables/system.toml             the levels together, again by cvc5""",
)
@click.argument("source", metavar="FILE", type=There(dir_okay=False))
@click.option("--write", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="CERTIFICATE",
              help="Keep the certificate in this file.")  # fmt: skip
@click.option("--against", type=There(dir_okay=False, path_type=Path), default=None,
              metavar="CERTIFICATE", help="Check this certificate instead of making one.")  # fmt: skip
@click.option("--certify", "cvc5", is_flag=True,
              help="Put what the checker does not settle by itself to cvc5, which has no part in the proof.")  # fmt: skip
@click.option("--questions", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Write what is left to DIR as SMT-LIB, one file each: each is to be answered `unsat`.")  # fmt: skip
@click.option(
    "--strict", is_flag=True, help="Status 1 where something was not checked; always so with --against."
)
@proving
@showing
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    source: str, write: Path | None, against: Path | None, cvc5: bool, questions: Path | None, strict: bool,
    options: Options, use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Re-check the proof of FILE's tables and procedures with a small checker that shares no code with the prover.

    The checker reads the source anew, derives what is owed, and lists by name what it did not check and what the proof rests on.
    Where FILE describes a system, it is `rcsc prove --certify`: cvc5 answers every question of the levels together.
    """
    if write is not None and against is not None:
        raise click.UsageError("--write and --against do not go together")
    if source.endswith(".toml"):
        if write is not None or against is not None or questions is not None:
            raise click.UsageError("the certificate of a system is written by `rcsc prove --certificate`")
        here = click.get_current_context()
        names = (str(param.name) for param in here.command.params)
        given = {name for name in names if here.get_parameter_source(name) is ParameterSource.COMMANDLINE}
        if more := sorted(given - {"source", "cvc5", "strict", "no_cache"}):
            named = ", ".join(f"--{name.replace('_', '-')}" for name in more)
            raise click.UsageError(f"{named}: not of a system; `rcsc prove --certify` has options of its own")
        status: int = here.invoke(
            prove, system=Path(source), confirms=True, strict=strict, no_cache=not use_cache
        )
        return status
    if cvc5:
        need("certify")
    how = Checking(cvc5=cvc5, strict=strict, questions=questions)
    conclusion = certify(settings_of(options, use_cache, output, (source,)), how, write, against)
    return finish(conclusion.report, "certify", output, conclusion.closing)


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
    # the verdicts on tables are the prover's, not the checker's
    return Conclusion(replace(report, tables=()), reviewed.closing)


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
