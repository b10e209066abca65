"""Options that several commands share."""

import os
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, get_args

import click

from rcsc.base.host.files.read import standard_input
from rcsc.driver.settings import CodeWanted, Settings
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Color, Output, OutputForm, Progress
from rcsc.lang.project import MOST_BYTES
from rcsc.proof.solvers.options import Options, SolverChoice

Command = Callable[..., int]


PATHS = click.argument("paths", nargs=-1, type=There(readable=False, allow_dash=True), metavar="[PATH]...")
"""Files, folders, or `-`, which are there; the folder one stands in where none is given."""


def cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Millions(click.FloatRange):
    """A number of millions on the command line, single ones in the program."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Return the number; a default is converted as a typed one is."""
        return max(1, round(super().convert(value, param, ctx) * 1_000_000))


def steps_option(default: float, also: str = "") -> Callable[[Command], Command]:
    """Add `--steps`, in millions, with a note on its further bounds; the command gets `steps`, in single ones."""
    return click.option(
        "--steps",
        type=_Millions(min=0, min_open=True),
        default=default,
        show_default=True,
        metavar="MILLIONS",
        help="Budget of each question to the solver, in its own steps, which are the same on every machine: a million takes "
        f"some tenths of a second.{also} Past it the answer is `undecided`, never `proved`.",
    )


def proving(command: Command) -> Command:
    """Add the options for proofs; the command gets them as `options` and `use_cache`."""

    @steps_option(20, " All questions about one table, or one procedure, get 20 times as many together.")
    @click.option(
        "--memory",
        type=click.IntRange(min=64),
        default=4096,
        show_default=True,
        metavar="MB",
        help="Memory limit of the solver.",
    )
    @click.option(
        "--solver",
        type=click.Choice(get_args(SolverChoice)),
        default="auto",
        show_default=True,
        help="Who decides the tables. auto: counting and regions, confirmed by Z3 within a budget of steps. both: confirmed by Z3, "
        "else undecided. boxes: Z3 only for what nothing else decides. z3: Z3 alone.",
    )
    @click.option(
        "-j",
        "--jobs",
        type=click.IntRange(min=0),
        default=0,
        metavar="N",
        help="How many tables to prove at once; 0 (the default) is one a processor.",
    )
    @click.option("--no-cache", is_flag=True, help="Neither read nor keep what earlier runs proved.")
    @wraps(command)
    def wrapped(
        *args: Any,
        steps: int,
        memory: int,
        solver: SolverChoice,
        jobs: int,
        no_cache: bool,
        **kwargs: Any,
    ) -> int:
        options = Options(
            steps=steps,
            memory_mb=memory,
            solver=solver,
            jobs=jobs or cores(),
        )
        return command(*args, options=options, use_cache=not no_cache, **kwargs)

    return wrapped


def looking(command: Command) -> Command:
    """Add the options for the generated code that is looked at; the command gets them as `code`."""

    @click.option(
        "--generated",
        type=There(file_okay=False, path_type=Path),
        default=None,
        metavar="FOLDER",
        help="The folder of the generated C and Python to look at, as `rcsc compile --out` names it; else the one that the system "
        "names, else `generated` in the project, beside it or here, if it holds what was compiled of these tables.",
    )
    @click.option("--anew", is_flag=True, help="Look at what the tables give now, and not at any folder.")
    @wraps(command)
    def wrapped(*args: Any, generated: Path | None, anew: bool, **kwargs: Any) -> int:
        if generated is not None and anew:
            raise click.UsageError("--generated and --anew do not go together")
        return command(*args, code=CodeWanted(generated, anew), **kwargs)

    return wrapped


def showing(command: Command) -> Command:
    """Add the options for the form of the report; the command gets them as `output`."""

    @click.option(
        "--format",
        "form",
        type=click.Choice([form.value for form in OutputForm]),
        default=None,
        help="text (default), line (one line a finding), json, sarif (2.1.0) or github (annotations).",
    )
    @click.option("--json", "form", flag_value="json", help="The same as --format json.")
    @click.option("--sarif", "form", flag_value="sarif", help="The same as --format sarif.")
    @click.option("--github", "form", flag_value="github", help="The same as --format github.")
    @click.option(
        "-o",
        "--output",
        "file",
        type=click.Path(dir_okay=False, path_type=Path),
        default=None,
        metavar="FILE",
        help="Write the report to FILE instead of standard output.",
    )
    @click.option(
        "--color",
        type=click.Choice([color.value for color in Color]),
        default="auto",
        show_default=True,
        help="Colour the text; `auto` on a terminal, unless NO_COLOR is set.",
    )
    @click.option(
        "-q",
        "--quiet",
        is_flag=True,
        help="Only what needs attention: no summary, no progress, no note that every check repeats.",
    )
    @wraps(command)
    def wrapped(
        *args: Any, form: str | None, file: Path | None, color: str, quiet: bool, **kwargs: Any
    ) -> int:
        output = Output(OutputForm(form or "text"), file, Color(color), quiet)
        return command(*args, output=output, **kwargs)

    return wrapped


def settings_of(options: Options, use_cache: bool, output: Output, paths: tuple[str, ...]) -> Settings:
    """Return the driver's settings for these paths, or else for this folder."""
    progress = Progress(wanted=not output.quiet)
    return Settings(paths or (".",), options, piped(paths), use_cache=use_cache, progress=progress)


def piped(paths: tuple[str, ...]) -> bytes | None:
    """Read the text for `-`, if that is one of the paths; of a text that is too large, only enough to show it."""
    return standard_input().read(MOST_BYTES + 1) if "-" in paths else None
