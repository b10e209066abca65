"""`rcsc fmt`: tables aligned."""

import sys

import click

from rcsc.driver.reformat import expand, reformat
from rcsc.front.commands.shared.options import PATHS, piped, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.lang.syntax.layout import WIDTH


@click.command(
    "fmt",
    epilog="""\b
Examples:
  rcsc fmt                 align every table below this folder
  rcsc fmt --check         change nothing; 1 if something would change
  rcsc fmt --diff a.rcs    show what would change
  rcsc fmt --width 200     tables in a wider window
  rcsc fmt --upgrade a.rcs older forms, too, where nothing comes to mean something else
  rcsc fmt --expanded a.rcs  what `above` comes to in each line, on standard output
  rcsc fmt - < a.rcs       from standard input to standard output""",
)
@PATHS
@click.option("--check", "only_check", is_flag=True, help="Change nothing; 1 if a file would change.")
@click.option("--diff", is_flag=True, help="Change nothing; show what would change.")
@click.option("--width", type=click.IntRange(min=1), default=WIDTH, show_default=True,
              help="Lay out tables that are wider in more rows and parts.")  # fmt: skip
@click.option(
    "--upgrade",
    is_flag=True,
    help="Rewrite older forms, too, where that changes no program; say what was left.",
)
@click.option(
    "--expanded",
    is_flag=True,
    help="Change nothing; print the files as their tables are resolved, without `above`.",
)
@showing
def command(
    paths: tuple[str, ...],
    only_check: bool,
    diff: bool,
    width: int,
    upgrade: bool,
    expanded: bool,
    output: Output,
) -> int:
    """Align tables and lay out the rest, always in the same way.

    What a file says stays the same, comments included; that is checked before a file is replaced.
    """
    if expanded:
        if only_check or diff or upgrade:
            raise click.UsageError("--expanded prints, and goes with --width alone")
        resolved = expand(paths or (".",), piped(paths), width=width)
        for text in resolved.texts.values():
            click.echo(text, nl=False)
        return finish(resolved.report, "fmt", output, "") if resolved.report.failed else 0
    write = not (only_check or diff)
    formatted = reformat(paths or (".",), piped(paths), write=write, width=width, older=upgrade)
    for words in formatted.upgraded:
        click.echo(words, err=True)
    if diff:
        click.echo(formatted.diff, nl=False)
        return 1 if formatted.report.failed else 0
    if write and "-" in formatted.texts and not formatted.report.failed:
        sys.stdout.buffer.write(formatted.texts["-"].encode())
        return 0
    files = f"{formatted.changed} of {len(formatted.texts)} files"
    return finish(formatted.report, "fmt", output, f"{files} {'changed' if write else 'would change'}")
