"""`rcsc fmt`: files laid out anew, each replaced whole, none that would come to say something else."""

import difflib
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.base.diagnostics.printable import escape
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files import write_atomically
from rcsc.front.commands.shared.options import PATHS, piped, showing
from rcsc.front.commands.shared.show import Output, finish
from rcsc.lang.model import Program
from rcsc.lang.project import load, project_root
from rcsc.lang.resolve import resolve
from rcsc.lang.resolve.precedence import expanded
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.format import format_file
from rcsc.lang.syntax.layout import WIDTH
from rcsc.lang.syntax.parse import parse
from rcsc.lang.written.upgrade import Upgraded, upgrade


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
@click.option("--upgrade", "older", is_flag=True,
              help="Rewrite older forms, too, where that changes no program; say what was left.")  # fmt: skip
@click.option("--expanded", "expands", is_flag=True,
              help="Change nothing; print the files as their tables are resolved, without `above`.")  # fmt: skip
@showing
def command(
    paths: tuple[str, ...],
    only_check: bool,
    diff: bool,
    width: int,
    older: bool,
    expands: bool,
    output: Output,
) -> int:
    """Align tables and lay out the rest, always in the same way.

    What a file says stays the same, comments included; that is checked before a file is replaced.
    """
    if expands:
        if only_check or diff or older:
            raise click.UsageError("--expanded prints, and goes with --width alone")
        resolved = expand(paths or (".",), piped(paths), width=width)
        for text in resolved.texts.values():
            click.echo(text, nl=False)
        return finish(resolved.report, "fmt", output, "") if resolved.report.failed else 0
    write = not (only_check or diff)
    formatted = reformat(paths or (".",), piped(paths), write=write, width=width, older=older)
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


@dataclass(frozen=True, slots=True)
class Formatted:
    """The result for the files.

    Attributes:
        report: Files that are not formatted, where nothing was to be written; files that could not be read or written.
        texts: Each file's new text.
        diff: How the files differ from it.
        changed: How many differ.
        upgraded: Forms that were upgraded and those that were left, in words.
    """

    report: Report
    texts: dict[str, str]
    diff: str
    changed: int
    upgraded: tuple[str, ...] = ()


def reformat(
    paths: tuple[str, ...], stdin: bytes | None, *, write: bool, width: int = WIDTH, older: bool = False
) -> Formatted:
    """Format every file that the paths mean; used files that they do not mean are left alone.

    Tables become at most `width` characters wide, where that can be. Where `older` is set, older forms are rewritten first.
    """
    loaded = load(paths, stdin)
    roots = [name for name in loaded.given if name in loaded.files]
    mine = tuple(
        diagnostic
        for diagnostic in loaded.diagnostics
        if diagnostic.code.value < "RCS2" and _of(diagnostic, loaded.given, paths)
    )
    upgraded = _upgraded(paths, stdin, roots) if older else Upgraded({})
    texts = {name: _text(name, upgraded.files.get(name, loaded.files[name]), width) for name in roots}
    changed = {name: text for name, text in texts.items() if text != loaded.sources[name].text}
    diagnostics = [*mine, *upgraded.diagnostics]
    for name, text in changed.items():
        if not write:
            diagnostics.append(_unformatted(loaded.sources[name], text, name in upgraded.files))
        elif stdin is None or name != "-":
            diagnostics += _replace(name, text)
    diff = "".join(line for name in changed for line in _diff(loaded.sources[name], texts[name]))
    report = Report(tuple(sorted(diagnostics, key=sort_key)), (), loaded.sources)
    return Formatted(report, texts, diff, len(changed), (*upgraded.done, *upgraded.left))


def expand(paths: tuple[str, ...], stdin: bytes | None, *, width: int = WIDTH) -> Formatted:
    """Return the files with their tables as resolved: the tests that `above` adds to a line stand in a column of their own.

    Nothing is written. A file whose program has errors is left out, and they are reported.
    """
    loaded = load(paths, stdin)
    diagnostics = list(loaded.diagnostics)
    texts: dict[str, str] = {}
    for name in (name for name in loaded.given if name in loaded.files):
        program = resolve(name, loaded)
        if isinstance(program, Program):
            texts[name] = format_file(_expanded(loaded.files[name], program), width)
        else:
            diagnostics += [diagnostic for diagnostic in program if diagnostic not in diagnostics]
    report = Report(tuple(sorted(diagnostics, key=sort_key)), (), loaded.sources)
    return Formatted(report, texts, "", 0)


def _expanded(file: tree.File, program: Program) -> tree.File:
    tables = {str(table.name): table for table in program.tables}
    return replace(
        file,
        declarations=tuple(
            expanded(declaration, tables[declaration.name.text])
            if isinstance(declaration, tree.TableDecl)
            else declaration
            for declaration in file.declarations
        ),
    )


def _upgraded(paths: tuple[str, ...], stdin: bytes | None, names: list[str]) -> Upgraded:
    """Upgrade the files, as far as no program of their projects changes its meaning."""
    folders = dict.fromkeys(project_root(name) for name in names if name != "-")
    whole = load((*paths, *folders), stdin)
    return upgrade(whole, [name for name in names if name in whole.files])


def _of(diagnostic: Diagnostic, roots: tuple[str, ...], paths: tuple[str, ...]) -> bool:
    file = diagnostic.primary.span.file
    return file in roots or file in paths or not file.endswith(".rcs")


def _text(name: str, before: tree.File, width: int) -> str:
    """Format the file; its new text must parse to the same tree.

    Raises:
        RuntimeError: It does not; that is a bug.
    """
    text = format_file(before, width)
    if parse(Source(name, text)) != before:
        raise RuntimeError(f"formatting would change what {name} says")
    return text


def _unformatted(source: Source, text: str, older: bool) -> Diagnostic:
    """Return a diagnostic at the first place that would change."""
    start = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(source.text, text, strict=False)))
    place = Span(source.name, min(start, len(source.text)), min(start + 1, len(source.text)))
    return Diagnostic(
        Code.NOT_FORMATTED,
        f"`{source.name}` is not formatted",
        Label(place),
        help=(f"run `rcsc fmt{' --upgrade' if older else ''}` on it",),
    )


def _replace(name: str, text: str) -> Iterator[Diagnostic]:
    try:
        write_atomically(Path(name), text.encode())
    except OSError as error:
        message = f"`{name}` cannot be written: {error.strerror}"
        yield Diagnostic(Code.NOT_WRITTEN, message, Label(Span(name, 0, 0)))


def _diff(source: Source, text: str) -> Iterator[str]:
    before, after = source.text.splitlines(), text.splitlines()
    for line in difflib.unified_diff(before, after, source.name, source.name, lineterm=""):
        yield f"{escape(line)}\n"
