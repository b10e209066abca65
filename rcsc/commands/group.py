"""The commands: each turns arguments into a call of the driver, shows the report, gives the exit status."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rcsc import __version__
from rcsc.commands.campaign import campaign
from rcsc.commands.diff import diff
from rcsc.commands.graph import graph, table
from rcsc.commands.logs import log, replay
from rcsc.commands.prove import prove
from rcsc.commands.script import run
from rcsc.commands.shared.extras import Commands, need
from rcsc.commands.shared.options import PATHS, proving, showing
from rcsc.commands.shared.show import Output, Progress, show
from rcsc.commands.shared.systems import db
from rcsc.commands.shell import shell
from rcsc.diagnostics.report import Report

if TYPE_CHECKING:
    from rcsc.driver.settings import Settings
    from rcsc.solvers.options import Options

_EPILOG = """\b
Examples:
  rcsc check                          check every table below this folder
  rcsc check tables/task/acquire.rcs  check one file and what it uses
  rcsc check --sarif -o rcsc.sarif    for a code-scanning service
  rcsc compile tables --check         is generated/ fresh?
  rcsc explain RCS402                 what a finding means, with an example

\b
Exit status: 0 proved, 1 findings, 2 usage, 3 a bug in rcsc."""


@click.group("rcsc", cls=Commands, epilog=_EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, "-V", "--version", message="rcsc %(version)s")
def commands() -> None:
    """Prove robot-control state tables, and compile the proved ones to Python and C.

    In every cycle exactly one line of a table must match. `rcsc check` proves that it does, whatever comes
    in, or shows an input for which it does not.
    """


def _settings(options: "Options", use_cache: bool, output: Output, paths: tuple[str, ...]) -> "Settings":
    from rcsc.driver.settings import Settings

    progress = Progress(wanted=not output.quiet)
    return Settings(paths or (".",), options, _piped(paths), use_cache=use_cache, progress=progress)


def _piped(paths: tuple[str, ...]) -> bytes | None:
    return sys.stdin.buffer.read() if "-" in paths else None


def _finish(report: Report, command: str, output: Output, closing: str = "") -> int:
    show(report, command, output, closing)
    return 1 if report.failed else 0


@commands.command(
    short_help="Prove that exactly one line of each table matches.",
    epilog="""\b
Examples:
  rcsc check                     everything below this folder
  rcsc check tables/task -j 2    one folder, two tables at once
  rcsc check --solver both       ask Z3 about every table, however large
  cat grip.rcs | rcsc check -    a text from a pipe
  rcsc check --format line       one line a finding, for an editor""",
)
@PATHS
@proving
@showing
def check(paths: tuple[str, ...], options: "Options", use_cache: bool, output: Output) -> int:
    """Prove that exactly one line of each table matches, for every input.

    PATH is a file, a folder (all `*.rcs` below it) or `-`, standard input; without any it is this folder. For
    each finding the least input is shown as a column beside the lines that match it, then the region that it
    stands for, and what would help. What was proved once is not proved again until something changes. An assumption is shown
    as assumed, as monitored, or as proved where `rcsc prove` has shown that the levels of these very files keep it.
    """
    from rcsc import driver

    return _finish(driver.check(_settings(options, use_cache, output, paths)), "check", output)


@commands.command(
    name="compile",
    short_help="Write the executors of proved tables, in Python and C.",
    epilog="""\b
Examples:
  rcsc compile tables                  write generated/python and generated/c
  rcsc compile tables --check          write nothing; 1 if generated/ is not fresh
  rcsc compile grip.rcs --target c     C alone
  rcsc compile grip.rcs --out build    to another folder""",
)
@PATHS
@click.option("--out", type=click.Path(path_type=Path), default=Path("generated"), show_default=True,
              metavar="FOLDER", help="Where the executors go, in FOLDER/python and FOLDER/c.")  # fmt: skip
@click.option("--target", default="python,c", show_default=True, metavar="LIST",
              help="What to write, by commas: python, c.")  # fmt: skip
@click.option("--check", "only_check", is_flag=True, help="Write nothing; say whether the files are fresh.")
@click.option("--defensive", is_flag=True,
              help="Executors that check their whole state, ranges and invariants, in every cycle.")  # fmt: skip
@proving
@showing
def compile_(
    paths: tuple[str, ...], out: Path, target: str, only_check: bool, defensive: bool,
    options: "Options", use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Prove the tables, then write their Python and C executors.

    Nothing is written unless everything is proved. Files are replaced whole: a kill leaves the old ones. The
    same tables give the same bytes on every machine, so the files belong in version control.
    """
    from rcsc import driver

    targets = tuple(one.strip() for one in target.split(",") if one.strip())
    if not targets or not set(targets) <= {"python", "c"}:
        raise click.BadParameter("choose from python and c", param_hint="--target")
    settings = _settings(options, use_cache, output, paths)
    made = driver.compile_(settings, out, targets, only_check=only_check, defensive=defensive)
    return _finish(made.report, "compile", output, made.closing)


@commands.command(
    short_help="Align tables.",
    epilog="""\b
Examples:
  rcsc fmt                 align every table below this folder
  rcsc fmt --check         change nothing; 1 if something would change
  rcsc fmt --diff a.rcs    show what would change
  rcsc fmt - < a.rcs       from standard input to standard output""",
)
@PATHS
@click.option("--check", "only_check", is_flag=True, help="Change nothing; 1 if a file would change.")
@click.option("--diff", is_flag=True, help="Change nothing; show what would change.")
@showing
def fmt(paths: tuple[str, ...], only_check: bool, diff: bool, output: Output) -> int:
    """Align tables and lay out the rest, always in the same way.

    What a file says stays the same, comments included; that is checked before a file is replaced.
    """
    from rcsc.driver.reformat import reformat

    write = not (only_check or diff)
    made = reformat(paths or (".",), _piped(paths), write=write)
    if diff:
        click.echo(made.diff, nl=False)
        return 1 if made.report.failed else 0
    if write and "-" in made.texts and not made.report.failed:
        sys.stdout.buffer.write(made.texts["-"].encode())
        return 0
    files = f"{made.changed} of {len(made.texts)} files"
    return _finish(made.report, "fmt", output, f"{files} {'changed' if write else 'would change'}")


@commands.command(
    short_help="Test the generated executors against the tables.",
    epilog="""\b
Examples:
  rcsc test tables/task             interpreter = Python = C, every line reached
  rcsc test --deep acquire.rcs      also prove the C, and mutate it; minutes
  rcsc test --vectors v.json a.rcs  also write test vectors for each condition""",
)
@PATHS
@click.option("--examples", type=click.IntRange(min=1), default=200, show_default=True, metavar="N",
              help="How many inputs and how many sequences of cycles are tried a table.")  # fmt: skip
@click.option("--mutants", type=click.IntRange(min=-1), default=24, show_default=True, metavar="N",
              help="How many mutants of each table (with --deep, of the C too) are tried; -1 for all.")  # fmt: skip
@click.option("--deep", is_flag=True,
              help="Also prove the C functions with the model checker ESBMC, and try mutants of the C.")  # fmt: skip
@click.option("--esbmc", type=click.FloatRange(min=0), default=None, metavar="SECONDS",
              help="Time limit of ESBMC for one C function, by the clock, as it counts no steps: what it did not decide another run may. "
              "0 leaves it out.  [default: 60 with --deep, else 0]")  # fmt: skip
@click.option("--cortex/--no-cortex", default=True, show_default=True,
              help="Run the C on an emulated Cortex-M3, too.")  # fmt: skip
@click.option("--vectors", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write MC/DC vectors to FILE, as JSON or CSV by its ending.")  # fmt: skip
@proving
@showing
def test(
    paths: tuple[str, ...], examples: int, mutants: int, deep: bool, esbmc: float | None, cortex: bool,
    vectors: Path | None, options: "Options", use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Test what is generated: interpreter = Python = C on the same inputs and over cycles.

    Inputs lean on the edges of the declarations. Every line is reached, and the C matcher's masks are checked
    against the table for every value of every variable. That takes seconds; --deep takes minutes. What a tool
    could not decide is a figure and no failure. Extern procedures are stand-ins, and nothing of the user's is
    imported or linked. Needs a C compiler.
    """
    from rcsc import driver
    from rcsc.driver.settings import Effort

    esbmc_s = (60.0 if deep else 0.0) if esbmc is None else esbmc
    effort = Effort(examples, deep=deep, esbmc_s=esbmc_s, cortex=cortex, mutants=mutants, vectors=vectors)
    made = driver.test(_settings(options, use_cache, output, paths), effort)
    return _finish(made.report, "test", output, made.closing)


def _is_given(here: click.Context, name: str) -> bool:
    """Whether an option stands on the command line."""
    return here.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


@commands.command(
    short_help="Re-check a proof without the prover.",
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
def certify(
    source: str, write: Path | None, against: Path | None, cvc5: bool, questions: Path | None, strict: bool,
    options: "Options", use_cache: bool, output: Output,
) -> int:  # fmt: skip
    """Re-check the proof of FILE's tables and procedures with a small checker that shares no code with the prover.

    The checker reads the source anew, derives what is owed, and lists by name what it did not check and what the proof rests on.
    Where FILE describes a system, it is `rcsc prove --certify`: cvc5 answers every question of the levels together.
    """
    from rcsc import driver
    from rcsc.driver.certified import Checking

    if write is not None and against is not None:
        raise click.UsageError("--write and --against do not go together")
    if source.endswith(".toml"):
        from rcsc.commands.prove import prove

        if write is not None or against is not None or questions is not None:
            raise click.UsageError("the certificate of a system is written by `rcsc prove --certificate`")
        here = click.get_current_context()
        given = {one.name for one in here.command.params if _is_given(here, str(one.name))}
        if more := sorted(str(name) for name in given - {"source", "cvc5", "strict", "no_cache"}):
            named = ", ".join(f"--{name.replace('_', '-')}" for name in more)
            raise click.UsageError(f"{named}: not of a system; `rcsc prove --certify` has options of its own")
        found: int = here.invoke(
            prove, system=Path(source), confirms=True, strict=strict, no_cache=not use_cache
        )
        return found
    if cvc5:
        need("certify")
    how = Checking(cvc5=cvc5, strict=strict, questions=questions)
    made = driver.certify(_settings(options, use_cache, output, (source,)), how, write, against)
    return _finish(made.report, "certify", output, made.closing)


@commands.command(
    short_help="Say what a code means.",
    epilog="\b\nExamples:\n  rcsc explain           list the codes\n  rcsc explain RCS402",
)
@click.argument("code", required=False)
def explain(code: str | None) -> int:
    """Say what a finding's CODE means, with an example; without CODE list them all."""
    from rcsc.commands.shared.pages import explanation, listing
    from rcsc.diagnostics.codes import Code

    if code is None:
        click.echo(listing(), nl=False)
        return 0
    wanted = code.upper() if code.upper().startswith("RCS") else f"RCS{code}"
    if wanted not in {one.value for one in Code}:
        raise click.BadParameter(f"there is no {wanted}; `rcsc explain` lists the codes", param_hint="CODE")
    click.echo(explanation(Code(wanted)), nl=False)
    return 0


@commands.command(
    short_help="Make a small project.", epilog="\b\nExample:\n  rcsc new gripper && cd gripper && rcsc check"
)
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@showing
def new(folder: Path, output: Output) -> int:
    """Make a small project in DIR, new or empty, that checks, compiles and passes its tests."""
    from rcsc.commands.scaffold import scaffold

    made = scaffold(folder)
    if not isinstance(made, tuple):
        return _finish(Report((made,)), "new", output)
    place = shlex.quote(f"./{folder}" if str(folder).startswith("-") else str(folder))
    closing = f"made {len(made)} files in {folder}; now: cd {place} && rcsc check"
    return _finish(Report(()), "new", output, closing)


@commands.command(
    short_help="Print a shell's completion script.",
    epilog="""\b
Examples:
  bash: eval "$(rcsc completion bash)"     in ~/.bashrc
  zsh:  eval "$(rcsc completion zsh)"      in ~/.zshrc
  fish: rcsc completion fish > ~/.config/fish/completions/rcsc.fish""",
)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> int:
    """Print the script that lets SHELL complete rcsc's commands and options."""
    from click.shell_completion import get_completion_class

    kind = get_completion_class(shell)
    if kind is None:  # pragma: no cover  # click has all three
        raise click.UsageError(f"no completion for {shell}")
    click.echo(kind(commands, {}, "rcsc", "_RCSC_COMPLETE").source())
    return 0


for _command in (campaign, db, diff, graph, log, prove, replay, run, shell, table):
    commands.add_command(_command)
