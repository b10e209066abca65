"""`rcsc diff`: what changed between two versions of the tables, and the proof that nothing else did."""

from collections.abc import Callable
from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.render import paint, plain
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.front.commands.shared.options import steps_option
from rcsc.front.commands.shared.show import Color, Output, Progress, json_text, put, show, wants_color
from rcsc.proof.solvers.options import Options
from rcsc.views.diff.changes.difference import Difference
from rcsc.views.diff.compare import difference
from rcsc.views.diff.jsonform import to_json
from rcsc.views.diff.revision import NotComparedError
from rcsc.views.diff.rows import markdown, rows
from rcsc.views.diff.sides import Given, Side, given, read, revisions

SAME, CHANGED, ERROR = 0, 1, 2


@click.command(
    "diff",
    epilog="""\b
Examples:
  rcsc diff old.rcs new.rcs                  two files
  rcsc diff HEAD~1:tables tables             a revision's folder and this one
  rcsc diff --rev main..HEAD tables          two revisions
  rcsc diff --rev HEAD                       what is not committed yet
  rcsc diff --rev main..HEAD --format markdown -o comment.md

\b
As a review comment, in CI:
  rcsc diff --rev "$BASE..$HEAD" --format markdown -o comment.md || test $? -eq 1
As a hook that stops a commit which was to change no meaning:
  - repo: local
    hooks:
      - {id: rcsc-diff, name: rcsc diff, entry: rcsc diff --rev HEAD, language: system,
         files: '\\.rcs$', pass_filenames: false}

\b
Exit status: 0 same meaning, 1 changed, 2 usage, an error, or not decided.""",
)
@click.argument("paths", nargs=-1, metavar="A B | [PATH]...")
@click.option("--rev", "revision", default=None, metavar="REV1[..REV2]",
              help="Compare two revisions, or one with the files as they are; PATH says which (default: this folder).")  # fmt: skip
@click.option("--format", "form", type=click.Choice(["text", "json", "markdown"]), default="text", show_default=True,
              help="text, json, or markdown for a review comment.")  # fmt: skip
@click.option("--json", "form", flag_value="json", help="The same as --format json.")
@click.option("-o", "--output", "file", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write it to FILE instead of standard output.")  # fmt: skip
@click.option("--color", type=click.Choice([color.value for color in Color]), default="auto", show_default=True,
              help="Colour the text; `auto` on a terminal, unless NO_COLOR is set.")  # fmt: skip
@steps_option(6)
@click.option("--memory", type=click.IntRange(min=64), default=4096, show_default=True, metavar="MB",
              help="Memory limit of the solver.")  # fmt: skip
@click.option("--follow", is_flag=True,
              help="For a changed table also: which line can match in the cycle after which, what is new and what is gone.")  # fmt: skip
@click.option("-q", "--quiet", is_flag=True, help="Only what changed, no summary and no progress.")
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    paths: tuple[str, ...], revision: str | None, form: str, file: Path | None, color: str, steps: int,
    memory: int, follow: bool, quiet: bool,
) -> int:  # fmt: skip
    """Show the inputs for which another line, effect or fault follows in B than in A, and prove that there are no others.

    A and B are files, folders, descriptions of systems (TOML), or `REV:path` as git has it.
    Effects are compared by meaning: what procedures, command and
    status leave behind, whatever their text. Lines that are only renamed, split or renumbered are shown apart and change nothing.
    For a level the steps of its state graph are compared: which are new, which are gone.
    """
    asked = _asked(paths, revision)
    options = Options(steps=steps, memory_mb=memory)
    progress = Progress(wanted=not quiet)
    try:
        answer = _compared(asked, options, progress, follow)
    except NotComparedError as error:
        return _refuse(Code.NOT_COMPARED, str(error), *error.helps)
    finally:
        progress("")
    if isinstance(answer, int):
        return answer
    put(_text(answer, form, quiet, wants_color(Color(color), file)), file)
    if answer.undecided:
        left = ", ".join(what for program in answer.programs for what in program.undecided)
        return _refuse(
            Code.UNDECIDED, f"the solver gave up on {left}", "give each query more steps with `--steps`"
        )
    return CHANGED if answer.changed else SAME


def _asked(paths: tuple[str, ...], revision: str | None) -> tuple[Given, Given]:
    if revision is not None:
        return revisions(revision, paths)
    if len(paths) != 2:
        raise click.UsageError("give two files or folders, A and B, or revisions with --rev")
    return given(paths[0]), given(paths[1])


def _compared(
    asked: tuple[Given, Given], options: Options, progress: Callable[[str], None], follow: bool
) -> Difference | int:
    """Return the difference, or the exit status where a side has errors."""
    sides = []
    for given_ in asked:
        progress(f"reading {given_.name}")
        sides.append(read(given_))
    if any(side.diagnostics for side in sides):
        return _wrong(sides)
    return difference(sides[0], sides[1], options, progress, follow=follow)


def _wrong(sides: list[Side]) -> int:
    """Show the errors that keep the sides from being compared."""
    every = dict.fromkeys(diagnostic for side in sides for diagnostic in side.diagnostics)
    sources = {name: source for side in sides for name, source in side.sources.items()}
    show(Report(tuple(every), (), sources), "diff", Output(quiet=True))
    return ERROR


def _refuse(code: Code, message: str, *helps: str) -> int:
    show(Report((Diagnostic(code, message, Label(Span("", 0, 0)), help=helps),)), "diff", Output(quiet=True))
    return ERROR


def _text(compared: Difference, form: str, quiet: bool, color: bool) -> str:
    if form == "json":
        return json_text(to_json(compared))
    if form == "markdown":
        return markdown(compared)
    return (paint if color else plain)(rows(compared, quiet=quiet))
