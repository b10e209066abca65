"""`rcsc prove`: the levels of a system proved together."""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from rcsc.commands.shared.extras import need
from rcsc.commands.shared.options import steps_option
from rcsc.commands.shared.proved import (
    as_json,
    assumptions,
    claim,
    confirmed,
    in_context,
    left_out,
    named,
    not_looked_at,
    pauses,
    reaction,
    standing,
    trusted,
    trusting,
)
from rcsc.commands.shared.show import Progress, UnwritableError
from rcsc.commands.shared.systems import system_path
from rcsc.commands.systems.explained import explanation_as_json, say_explanation
from rcsc.compose.contract.beginning import BadStartError, Starts, starts
from rcsc.compose.contract.claims import CONTRACT
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.variants import VARIANTS
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, explain, file_name
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.frozen import case_breaks, frozen, read_case
from rcsc.compose.counterexample.trace import usual_length
from rcsc.compose.invariant.cubes import shown
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import LevelProof, besides, certificate
from rcsc.compose.proof.system import (
    SystemProof,
    prove_transition_systems,
    transition_systems,
)
from rcsc.diagnostics.codes import Code
from rcsc.host.cache import open_cache
from rcsc.host.files import write_atomically
from rcsc.lang.model import Kind
from rcsc.run.description import Description, description
from rcsc.solvers.options import Limits

_WORTH_PROCESSES = 40
"""Lines of the levels' tables from which several processes are quicker than one: each takes a second to begin."""


@click.command(
    "prove",
    epilog="""\b
Examples:
  rcsc prove                                   the system in system.toml, here or in tables/
  rcsc prove my_robot                          the system in a folder
  rcsc prove tables/system.toml --level task   one level in its environment
  rcsc prove --certificate proof               the invariants as SMT-LIB, for another solver
  rcsc prove --level task --without-deferral   what section 9 warns of: the shortest trace
  rcsc prove --log found                       each trace as a log, for `rcsc replay` and `rcsc log`
  rcsc prove --where "stock = 0"               traces that begin with an empty stock
  rcsc prove --case tests/found/a.json         a frozen finding, again""",
)
@click.argument("system", required=False, type=click.Path(exists=True, path_type=Path), metavar="[SYSTEM]")
@click.option("--level", "only", multiple=True, metavar="NAME", help="Only this level (repeatable).")
@steps_option(80, " All questions about one level get 50 times as many together.")
@click.option("--jobs", "-j", type=click.IntRange(min=1), default=None, show_default="2, or 1 for small levels",
              help="Levels proved at once.")  # fmt: skip
@click.option("--trace", "cycles", type=click.IntRange(min=0, max=1000), default=None, metavar="N",
              show_default="8, or some more than a time takes that a table asks for, at most 100",
              help="For what is not proved, look for a trace of at most N cycles; 0 does not look.")  # fmt: skip
@click.option("--follow", "further", type=click.IntRange(min=0, max=1000), default=4, show_default=True, metavar="N",
              help="Follow each trace on for at most N cycles, up to what the superior takes; 0 does not.")  # fmt: skip
@click.option("--where", "begins", multiple=True, metavar="VALUES",
              help='Search traces from these initial values: "leaf = value, level.leaf = value". No verdict depends on it.')  # fmt: skip
@click.option("--log", "logs", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Keep each trace in DIR as a log that `rcsc replay` steps and `rcsc log` draws, with its executors.")  # fmt: skip
@click.option("--freeze", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Keep each trace in DIR as a case for --case: a test that fails until the tables are mended.")  # fmt: skip
@click.option("--case", "cases", multiple=True, type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="FILE",
              help="Run a frozen case on the tables as they are, and nothing else (repeatable).")  # fmt: skip
@click.option("--without-deferral", is_flag=True,
              help="As if every next state were taken at once, not when its command is echoed: a demonstration.")  # fmt: skip
@click.option("--first-match", is_flag=True,
              help="As if of several lines that match the first ran: a demonstration.")  # fmt: skip
@click.option("--without-default", is_flag=True,
              help="As if every DEFAULT line were declared unreachable: shows what falls to them.")  # fmt: skip
@click.option("--certificate", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Write each level's questions to DIR as SMT-LIB: each is to be answered `unsat`.")  # fmt: skip
@click.option("--certify", "confirms", is_flag=True,
              help="Put the same questions to cvc5, which has no part in the proof.")  # fmt: skip
@click.option("--no-cache", is_flag=True, help="Prove everything anew.")
@click.option("--progress", is_flag=True,
              help="Say each level on standard error as it is done, which is so on a terminal anyway.")  # fmt: skip
@click.option("--strict", is_flag=True,
              help="Exit status 1 also where something was not looked at, or rests on what is not proved.")  # fmt: skip
@click.option("--invariants", is_flag=True, help="Print the invariant of each level, too.")
@click.option("--json", "as_json", is_flag=True, help="The result as JSON.")
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    system: Path | None, only: tuple[str, ...], steps: int, jobs: int | None, cycles: int | None,
    further: int, begins: tuple[str, ...], logs: Path | None,
    freeze: Path | None, cases: tuple[Path, ...], without_deferral: bool, first_match: bool, without_default: bool,
    certificate: Path | None, confirms: bool, no_cache: bool, progress: bool, strict: bool, invariants: bool, as_json: bool,
) -> int:  # fmt: skip
    """Prove that the levels of SYSTEM work together, however late each sees and answers what another says.

    Each level is proved in its environment: every command at any moment, every delay, repetition and loss in the buffers, every
    answer of the database. What it assumes of a neighbour is proved of that neighbour. Printed: each
    assumption with its new standing, what is guaranteed between levels, and for what fails the shortest run that shows it.
    """
    for extra in (*(["certify"] if confirms else []), *(["log"] if logs else [])):
        need(extra)
    if cases:
        return _again(cases)
    path = system_path(system)
    systems = transition_systems(path)
    unknown = [name for name in only if name not in systems]
    if unknown:
        raise click.UsageError(f"there is no level `{unknown[0]}`; there are {', '.join(systems)}")
    search = _Search(
        usual_length(systems.values()) if cycles is None else cycles, further, _starts(systems, begins)
    )
    asked = {
        "without-deferral": without_deferral,
        "first-match": first_match,
        "without-default": without_default,
    }
    variants = tuple(name for name, wanted in asked.items() if wanted)
    for name in variants:
        systems = {level: ts.of(VARIANTS[name](ts.program)) for level, ts in systems.items()}
    effort = Effort(limits=Limits.of(steps))
    cache = None if no_cache or variants else open_cache(path.parent)  # a variant is nobody's tables
    names = only or tuple(systems)
    with _LevelProgress(names, wanted=progress) as done:
        proof = prove_transition_systems(
            systems, effort, jobs or _jobs([systems[name] for name in names]), names, done, cache
        )
    if certificate is not None:
        _write(certificate, systems, proof)
    if not as_json:
        for level_proof in proof.levels:
            _say_level(systems[level_proof.level], proof, level_proof)
        if invariants:
            _say_invariants(proof)
        _say_agreements(proof)
        _say_whole(systems, proof)
        for line in _unconnected(systems, description(path)):
            click.echo(line)
    keep = _Keep(path, logs, freeze, variants)
    explanations = _explanations(systems, proof, search, keep, quiet=as_json)
    if as_json:
        click.echo(json.dumps(_as_json(proof, systems, explanations), indent=2))
    _say_not_agreed(proof)
    refused = _refused(systems, proof, quiet=as_json) if confirms else []
    if refused or any(explanation.bug for explanation in explanations):
        return 3
    return 0 if proof.whole or (proof.proved and not strict) else 1


def _jobs(levels: Iterable[TransitionSystem]) -> int:
    """How many levels to prove at once where nobody says."""
    lines = sum(len(table.lines) for level in levels for table in level.program.tables)
    return min(2, os.cpu_count() or 1) if lines >= _WORTH_PROCESSES else 1


class _LevelProgress:
    """Name each level on standard error as it is done, and on a terminal those that are still to come."""

    def __init__(self, names: Sequence[str], *, wanted: bool) -> None:
        self._left = list(names)
        self._line = Progress()
        self._wanted = wanted or self._line.shown

    def __enter__(self) -> Callable[[LevelProof], None]:
        self._doing()
        return self._done

    def __exit__(self, *_: object) -> None:
        self._line("")

    def _doing(self) -> None:
        self._line(f"proving {', '.join(self._left)}" if self._left else "")

    def _done(self, proof: LevelProof) -> None:
        self._line("")
        count = f"{len(proof.verdicts) - len(proof.open)} of {len(proof.verdicts)} found proved"
        if self._wanted:
            click.echo(f"level {proof.level}: {count}, {proof.seconds:.1f} s", err=True)
        self._left.remove(proof.level)
        self._doing()


def _refused(systems: dict[str, TransitionSystem], proof: SystemProof, *, quiet: bool) -> list[str]:
    """List the questions that cvc5 does not answer as Z3 did, and say how many there were."""
    refused = []
    for level in proof.levels:
        answers = confirmed(systems[level.level], level)
        wrong = [name for name, same in answers.items() if not same]
        refused += wrong
        good = len(answers) - len(wrong)
        click.echo(
            f"level {level.level}: cvc5 says the same of {good} of {len(answers)} questions", err=quiet
        )
        for name in wrong:
            click.echo(
                f"error[{Code.SOLVERS_DISAGREE.value}]: level `{level.level}`: cvc5 does not confirm `{name}`",
                err=True,
            )
    return refused


def _say_level(ts: TransitionSystem, whole: SystemProof, proof: LevelProof) -> None:
    """One level: its assumptions first, then what else is proved of it, each with what it rests on that is not."""
    declared = {str(assumption.name): assumption.standing.value for assumption in ts.program.assumptions}
    found_before = ", by an earlier run" if proof.cached else ""
    click.echo(click.style(f"level {proof.level}", bold=True) + f"  {proof.seconds:.1f} s{found_before}")
    for sort in Sort:
        obligations = [obligation for obligation, _ in proof.verdicts if obligation.sort is sort]
        if sort is Sort.ASSUMPTION:
            for obligation in obligations:
                verdict = standing(whole, proof.level, obligation.key)
                proved = whole.of(proof.level, obligation.key).proved
                as_declared = "" if proved else f"{declared[obligation.name]}: "
                together = " of the levels together" if verdict in {"not proved", "undecided"} else ""
                click.echo(f"  {obligation.table:28} {obligation.name:24} {as_declared}{verdict}{together}")
        elif sort in {Sort.INVARIANT, Sort.PROPERTY}:
            for obligation in obligations:
                click.echo(
                    f"  {sort.value:28} {obligation.name:24} {standing(whole, proof.level, obligation.key)}"
                )
        elif obligations:
            beside = [obligation.name for obligation in besides(proof) if obligation.sort is sort]
            good = [obligation for obligation in obligations if whole.of(proof.level, obligation.key).proved]
            trusts = trusting(whole, proof.level, [obligation.key for obligation in good])
            click.echo(f"  {sort.value}: {len(good)} of {len(obligations) - len(beside)} proved{trusts}")
            for obligation in obligations:
                if obligation not in good and obligation.name not in beside:
                    click.echo(
                        f"    {obligation.table or obligation.name or 'within a cycle'}: {standing(whole, proof.level, obligation.key)}"
                    )
            if beside:
                click.echo(f"    beside the number, so that nobody relies on it: {', '.join(beside)}")
    for line in not_looked_at(proof):
        click.echo(f"  {line}")
    many = len(proof.clauses)
    click.echo(
        f"  invariant: {many} clauses over {len(proof.predicates)} features; {proof.walked} states walked, {proof.learnt} learnt"
    )
    for line in in_context(ts, whole, proof):
        click.echo(f"  {line}")


def _say_invariants(proof: SystemProof) -> None:

    for level in proof.levels:
        click.echo(f"invariant of level {level.level}: never")
        for clause in level.clauses:
            click.echo(f"  {shown(level.predicates, clause)}")


def _say_whole(systems: dict[str, TransitionSystem], proof: SystemProof) -> None:

    for line in (
        *reaction(systems, proof),
        *pauses(systems),
        assumptions(proof),
        *trusted(proof),
        *left_out(proof),
    ):
        click.echo(line)
    click.echo(f"{proof.seconds:.1f} s in all")


def _unconnected(systems: Mapping[str, TransitionSystem], system: Description) -> Iterator[str]:
    """Which inputs nothing fills, and which outputs nothing takes: perhaps a buffer was forgotten."""
    named = {
        kind: [
            f"{name}.{declared.name}"
            for name, ts in systems.items()
            for declared in ts.program.declared
            if declared.kind is kind
        ]
        for kind in (Kind.INPUT, Kind.OUTPUT)
    }
    if missing := system.unfilled(named[Kind.INPUT]):
        yield f"no buffer fills {', '.join(f'`{name}`' for name in missing)}: proved for any value"
    if idle := system.untaken(named[Kind.OUTPUT]):
        yield f"no buffer takes {', '.join(f'`{name}`' for name in idle)}"


def _say_agreements(proof: SystemProof) -> None:

    if proof.agreements:
        click.echo("between the levels")
    for agreement in proof.agreements:
        lacks = named(
            proof, agreement.level, proof.of(agreement.level, (CONTRACT, "", agreement.record)).lacks
        )
        standing = "kept by: " if agreement.outside else "NOT " if not agreement.holds else ""
        standing += f"only if {lacks}: " if agreement.holds and lacks else ""
        click.echo(f"  {agreement.level} assumes that {agreement.assumed}")
        click.echo(f"    {standing}{agreement.reason}")


@dataclass(frozen=True, slots=True)
class _Keep:
    """Where findings are kept: the system's description, folders of logs and of cases, and the rules that are off."""

    system: Path
    logs: Path | None
    cases: Path | None
    variants: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Search:
    """Runs that are searched: of how many cycles, followed on for how many, and with which initial values."""

    cycles: int
    further: int
    starts: Starts


def _starts(systems: dict[str, TransitionSystem], begins: Sequence[str]) -> Starts:
    """Read the initial values that runs are searched from."""
    try:
        return starts(systems, ", ".join(begins))
    except BadStartError as error:
        raise click.UsageError("; ".join((f"--where: {error}", *error.helps))) from error


def _explanations(
    systems: dict[str, TransitionSystem],
    proof: SystemProof,
    search: _Search,
    keep: _Keep,
    *,
    quiet: bool,
) -> list[Explanation]:
    """What is not proved, each with its shortest trace where there is one."""
    settings = TraceSettings(
        description(keep.system),
        search.cycles,
        altered=bool(keep.variants),
        log=keep.logs,
        further=search.further,
        starts=search.starts,
    )
    explanations = []
    try:
        for explanation in explain(systems, proof, settings):
            explanations.append(explanation)
            if keep.cases is not None and explanation.finding is not None and not explanation.beside:
                _freeze(systems, explanation.finding, keep.cases, keep)
            if not quiet:
                say_explanation(systems, explanation, search.cycles, search.further)
    except OSError as error:
        raise UnwritableError(
            str(error.filename or keep.logs), error.strerror or "no reason given"
        ) from error
    return explanations


def _freeze(systems: dict[str, TransitionSystem], finding: Finding, folder: Path, keep: _Keep) -> None:

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{description(keep.system).name}_{file_name(finding)}.json"
    write_atomically(path, frozen(finding, systems, keep.system, path, keep.variants).encode())


def _again(cases: tuple[Path, ...]) -> int:
    """Run frozen cases."""
    wrong = 0
    for path in cases:
        case = read_case(path)
        breaks = case_breaks(case)
        outcome = f"level `{case.level}`: {case.obligation.shown}: {'broken' if breaks else 'kept'}"
        if breaks is case.expects_broken:
            click.echo(f"{path}: {outcome}")
        else:
            wrong += 1
            click.echo(f"error[{Code.FOUND_AGAIN.value}]: {path}: {outcome}", err=True)
    return 1 if wrong else 0


def _say_not_agreed(proof: SystemProof) -> None:

    for agreement in proof.agreements:
        if not agreement.holds:
            click.echo(
                f"error[{Code.NOT_AGREED.value}]: level `{agreement.level}` assumes that {agreement.assumed}",
                err=True,
            )


def _write(folder: Path, systems: dict[str, TransitionSystem], proof: SystemProof) -> None:

    folder.mkdir(parents=True, exist_ok=True)
    for level in proof.levels:
        for name, text in certificate(systems[level.level], level).items():
            write_atomically(folder / f"{level.level} {name}.smt2".replace(" ", "_"), text.encode())


def _as_json(
    proof: SystemProof, systems: dict[str, TransitionSystem], explanations: list[Explanation]
) -> dict[str, Any]:

    return {
        "proved": proof.proved,
        "whole": proof.whole,
        "findings": [explanation_as_json(systems, explanation) for explanation in explanations],
        "levels": [
            {
                "level": level.level,
                "goals": [
                    {
                        "what": obligation.sort.value,
                        "table": obligation.table,
                        "name": obligation.name,
                        **claim(proof, level.level, obligation.key),
                    }
                    for obligation, _ in level.verdicts
                ],
                "not_looked_at": [
                    {"what": each.sort.value, "table": each.table, "missing": each.missing}
                    for each in level.unstated
                ],
                "clauses": len(level.clauses),
                **as_json(proof, level),
            }
            for level in proof.levels
        ],
        "agreements": [
            {
                "level": agreement.level,
                "assumed": agreement.assumed,
                "reason": agreement.reason,
                "holds": agreement.holds,
                "outside": agreement.outside,
            }
            for agreement in proof.agreements
        ],
    }
