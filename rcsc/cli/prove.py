"""`rcsc prove`: the levels of a system proved together."""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rcsc.cli.cell import Stopped, stop, system_path

if TYPE_CHECKING:
    from rcsc.compose.level import LevelProof
    from rcsc.compose.system import SystemProof
    from rcsc.compose.transition import Stepper


@click.command(
    short_help="Prove the levels of a system together, for any delay.",
    epilog="""\b
Examples:
  rcsc prove                                   the system in system.toml, here or in tables/
  rcsc prove tables/system.toml --level task   one level in its environment
  rcsc prove --certificate proof               the invariants as SMT-LIB, for another solver
  rcsc prove --level task --without-deferral   what section 9 warns of: the shortest trace""",
)
@click.argument(
    "system", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="[SYSTEM]"
)
@click.option("--level", "only", multiple=True, metavar="NAME", help="Only this level (repeatable).")
@click.option("--timeout", type=click.FloatRange(min=0, min_open=True), default=20.0, show_default=True,
              metavar="SECONDS", help="Time limit of each question to the solver.")  # fmt: skip
@click.option("--jobs", "-j", type=click.IntRange(min=1), default=min(2, os.cpu_count() or 1), show_default=True,
              help="Levels proved at once.")  # fmt: skip
@click.option("--trace", "cycles", type=click.IntRange(min=0, max=40), default=8, show_default=True, metavar="N",
              help="For what is not proved, look for a trace of at most N cycles; 0 does not look.")  # fmt: skip
@click.option("--without-deferral", is_flag=True,
              help="As if every next state were taken at once, not when its command is echoed: a demonstration.")  # fmt: skip
@click.option("--certificate", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="DIR",
              help="Write each level's questions to DIR as SMT-LIB: each is to be answered `unsat`.")  # fmt: skip
@click.option("--invariants", is_flag=True, help="Print the invariant of each level, too.")
@click.option("--json", "as_json", is_flag=True, help="The result as JSON.")
def prove(  # noqa: PLR0913, PLR0917  # as many as there are options
    system: Path | None, only: tuple[str, ...], timeout: float, jobs: int, cycles: int, without_deferral: bool,
    certificate: Path | None, invariants: bool, as_json: bool,
) -> int:  # fmt: skip
    """Prove that the levels of SYSTEM work together, however late each sees and answers what another says.

    Each level is proved in its environment: every command at any moment, every delay, repetition and loss in the buffers, every
    answer of the database. What it assumes of a neighbour is proved of that neighbour. Printed: each
    assumption with its new standing, what is guaranteed between levels, and for what fails the shortest run that shows it.
    """
    from rcsc.compose.level import Effort
    from rcsc.compose.system import NoProgramError, prove_steppers, steppers
    from rcsc.compose.trace import undeferred
    from rcsc.diagnostics.codes import Code
    from rcsc.system.description import BadDescription

    path = system_path(system)
    try:
        made = steppers(path)
    except NoProgramError as error:
        raise Stopped(Code.BAD_SYSTEM, str(error)) from error
    except BadDescription as error:
        stop(error)
    unknown = [name for name in only if name not in made]
    if unknown:
        raise click.UsageError(f"there is no level `{unknown[0]}`; there are {', '.join(made)}")
    if without_deferral:
        made = {name: one.of(undeferred(one.program)) for name, one in made.items()}
    effort = Effort(timeout_ms=int(timeout * 1000))
    proof = prove_steppers(made, effort, jobs, only or tuple(made), None if as_json else _say_level)
    if certificate is not None:
        _write(certificate, made, proof)
    if as_json:
        click.echo(json.dumps(_as_json(proof), indent=2))
    else:
        if invariants:
            _say_invariants(proof)
        _say_agreements(proof)
    return _findings(made, proof, cycles) if not proof.proved else 0


def _say_level(proof: "LevelProof") -> None:
    """One level: its assumptions first, then what else is proved of it."""
    from rcsc.compose.goals import Sort
    from rcsc.compose.level import Verdict

    click.echo(click.style(f"level {proof.level}", bold=True) + f"  {proof.seconds:.1f} s")
    for sort in Sort:
        found = [(goal, verdict) for goal, verdict in proof.found if goal.sort is sort]
        if sort is Sort.ASSUMPTION:
            for goal, verdict in found:
                standing = (
                    "proved"
                    if verdict is Verdict.PROVED
                    else f"monitored: {verdict.value} of the levels together"
                )
                click.echo(f"  {goal.table:28} {goal.name:24} {standing}")
        elif found:
            good = sum(1 for _, verdict in found if verdict is Verdict.PROVED)
            click.echo(f"  {sort.value}: {good} of {len(found)} proved")
            for goal, verdict in found:
                if verdict is not Verdict.PROVED:
                    click.echo(f"    {goal.table or goal.name}: {verdict.value}")
    many = len(proof.clauses)
    click.echo(
        f"  invariant: {many} clauses over {len(proof.features)} features; {proof.walked} states walked, {proof.learnt} learnt"
    )


def _say_invariants(proof: "SystemProof") -> None:
    from rcsc.compose.level import shown

    for one in proof.levels:
        click.echo(f"invariant of level {one.level}: never")
        for clause in one.clauses:
            click.echo(f"  {shown(one.features, clause)}")


def _say_agreements(proof: "SystemProof") -> None:
    if proof.agreements:
        click.echo("between the levels")
    for one in proof.agreements:
        standing = "kept by" if one.outside else "proved" if one.holds else "NOT proved"
        click.echo(f"  {one.level} assumes that {one.assumed}")
        click.echo(f"    {standing}: {one.reason}")
    click.echo(f"{proof.seconds:.1f} s in all")


def _findings(made: "dict[str, Stepper]", proof: "SystemProof", cycles: int) -> int:
    """What is not proved, each with its shortest trace where there is one; the exit status."""
    from rcsc.compose.system import essential
    from rcsc.compose.trace import NotReproducedError, shortest, time_line
    from rcsc.diagnostics.codes import Code

    bug = False
    for level in proof.levels:
        for goal in essential(level):
            where = f"level `{level.level}`" + (f", table `{goal.table}`" if goal.table else "")
            click.echo(f"error[{Code.NOT_COMPOSED.value}]: {where}: not proved: {goal.shown}", err=True)
            try:
                trace = shortest(made[level.level], goal, cycles) if cycles else None
            except NotReproducedError:
                click.echo(
                    f"error[{Code.NOT_REPRODUCED.value}]: {where}: the trace found does not run", err=True
                )
                bug = True
                continue
            if trace is None:
                click.echo(f"  = note: no run of {cycles} cycles or fewer shows it", err=True)
                continue
            click.echo(f"  = note: broken in {len(trace.steps)} cycles, run by the interpreter", err=True)
            for line in time_line(made[level.level], trace):
                click.echo(f"  {line}", err=True)
    for one in proof.agreements:
        if not one.holds:
            click.echo(
                f"error[{Code.NOT_AGREED.value}]: level `{one.level}` assumes that {one.assumed}", err=True
            )
    return 3 if bug else 1


def _write(folder: Path, made: "dict[str, Stepper]", proof: "SystemProof") -> None:
    from rcsc.compose.level import certificate
    from rcsc.files import write_atomically

    folder.mkdir(parents=True, exist_ok=True)
    for one in proof.levels:
        for name, text in certificate(made[one.level], one).items():
            write_atomically(folder / f"{one.level} {name}.smt2".replace(" ", "_"), text.encode())


def _as_json(proof: "SystemProof") -> dict[str, Any]:
    return {
        "proved": proof.proved,
        "levels": [
            {
                "level": one.level,
                "goals": [
                    {
                        "what": goal.sort.value,
                        "table": goal.table,
                        "name": goal.name,
                        "verdict": verdict.value,
                    }
                    for goal, verdict in one.found
                ],
                "clauses": len(one.clauses),
            }
            for one in proof.levels
        ],
        "agreements": [
            {
                "level": one.level,
                "assumed": one.assumed,
                "reason": one.reason,
                "holds": one.holds,
                "outside": one.outside,
            }
            for one in proof.agreements
        ],
    }
