"""`rcsc certify`: a proof checked again, without the prover."""

from pathlib import Path

import click

from rcsc.driver.certified import Checking, certify
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.options import proving, settings_of, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.front.commands.systems.prove import command as prove
from rcsc.proof.solvers.options import Options


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
@click.argument("source", metavar="FILE", type=click.Path(exists=True, dir_okay=False))
@click.option("--write", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="CERTIFICATE",
              help="Keep the certificate in this file.")  # fmt: skip
@click.option("--against", type=click.Path(exists=True, dir_okay=False, path_type=Path), default=None,
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
        given = {param.name for param in here.command.params if _is_given(here, str(param.name))}
        if more := sorted(str(name) for name in given - {"source", "cvc5", "strict", "no_cache"}):
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


def _is_given(here: click.Context, name: str) -> bool:
    """Tell whether an option stands on the command line."""
    return here.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
