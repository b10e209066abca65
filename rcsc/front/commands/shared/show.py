"""A report in the form that was asked for, on standard output or in a file."""

import json
import os
import re
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby
from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.base.diagnostics.jsonform import report_to_json
from rcsc.base.diagnostics.printable import escape, pad, width
from rcsc.base.diagnostics.render import (
    OF_SEVERITY,
    WIDEST_LINE,
    Row,
    Style,
    TextPiece,
    full,
    one_line,
    paint,
    plain,
    wrapped,
)
from rcsc.base.diagnostics.report import (
    NOT_PROVED,
    InSystem,
    Report,
    TableReport,
    Verdict,
    named,
    trusting,
)
from rcsc.base.diagnostics.services import annotations, sarif
from rcsc.base.host.files import write_atomically


class OutputForm(StrEnum):
    """The form of a report."""

    TEXT = "text"
    LINE = "line"
    JSON = "json"
    SARIF = "sarif"
    GITHUB = "github"


class Color(StrEnum):
    """The cases in which the text is coloured."""

    AUTO = "auto"
    ALWAYS = "always"
    NEVER = "never"


@dataclass(frozen=True, slots=True)
class Output:
    """The place and form of a report.

    Attributes:
        file: Written whole or not at all; None is standard output.
        quiet: Leave out the summary, and the notes that every check repeats.
    """

    form: OutputForm = OutputForm.TEXT
    file: Path | None = None
    color: Color = Color.AUTO
    quiet: bool = False


class UnwritableError(Exception):
    """A report could not be written: where, and why."""


_OF_VERDICT = {
    Verdict.PROVED: Style.HELP,
    Verdict.CONDITIONAL: Style.WARNING,
    Verdict.REFUTED: Style.ERROR,
    Verdict.UNDECIDED: Style.WARNING,
}
_SPACED = re.compile(r" *[^ ]+| +$")
"""A word and the blanks before it."""
_KEPT = "In files that are kept as published:"
"""Before the findings of published files."""
_NARROWEST = 40
"""Columns to which sentences are broken in a narrower terminal, too."""
_REPEATED = {Code.DEFAULT_COVERS, Code.GIVES_WAY, Code.PROPERTY_ELSEWHERE}
"""What is right, and said again by every check."""


def show(report: Report, command: str, output: Output, closing: str = "") -> None:
    """Write the report; `closing` is a last line for people.

    Raises:
        UnwritableError: The file, or standard output, could not be written.
        BrokenPipeError: Whoever read standard output has gone.
    """
    match output.form:
        case OutputForm.TEXT:
            text = _text(report, output, closing)
        case OutputForm.LINE:
            told = _told(report, output)
            text = "".join(f"{one_line(diagnostic, report.sources)}\n" for diagnostic in told)
        case OutputForm.JSON:
            text = json_text(report_to_json(report, command))
        case OutputForm.SARIF:
            text = json_text(sarif(report))
        case OutputForm.GITHUB:
            text = annotations(report)
    put(text, output.file)


def put(text: str, file: Path | None) -> None:
    """Write a text to a file, whole or not at all, or to standard output.

    Raises:
        UnwritableError: Neither could be written.
        BrokenPipeError: Whoever read standard output has gone.
    """
    with writing(file or "standard output"):
        if file is None:
            click.echo(text, nl=False, color=True)
        else:
            write_atomically(file, text.encode())


@contextmanager
def writing(place: Path | str) -> Iterator[None]:
    """Report the place that could not be written, if the code inside fails.

    Raises:
        UnwritableError: What stands inside could not write.
    """
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise UnwritableError(str(place), error.strerror or "no reason given") from error


def finish(report: Report, command: str, output: Output, closing: str = "") -> int:
    """Show the report; return the exit status."""
    show(report, command, output, closing)
    return 1 if report.failed else 0


def json_text(value: object) -> str:
    r"""Write a value as JSON in UTF-8; a byte of a file's name that is not UTF-8 is escaped, as `\udcff`."""
    text = json.dumps(value, indent=2, ensure_ascii=False) + "\n"
    return text.encode(errors="backslashreplace").decode()


def _told(report: Report, output: Output) -> Iterator[Diagnostic]:
    """Yield the diagnostics for a person."""
    for diagnostic in report.diagnostics:
        if not (output.quiet and diagnostic.severity is Severity.NOTE and diagnostic.code in _REPEATED):
            yield diagnostic


def _text(report: Report, output: Output, closing: str) -> str:
    coloured = wants_color(output.color, output.file)
    columns = terminal_columns() if output.file is None else None
    broken, columns = columns is not None, columns or WIDEST_LINE
    rows: list[Row] = []
    shown = [each for each in _told(report, output) if not each.told_with]
    for published in (False, True):
        these = [each for each in shown if report.is_published(each) is published]
        if published and these and not output.quiet:
            rows += ((TextPiece(_KEPT, Style.STRONG),), ())
        for diagnostic in these:
            rows += (*full(diagnostic, report.sources, columns, broken=broken), ())
    if not output.quiet:
        ending = [*summary(report), *([(TextPiece(closing, Style.STRONG),)] if closing else [])]
        rows += [part for row in ending for part in wrapped(row, columns, 4)] if broken else ending
    return paint(rows) if coloured else plain(rows)


def terminal_columns(handle: int = 1) -> int | None:
    """Return the width of the terminal that standard output is, or another handle, which `COLUMNS` overrides; None where it is none."""
    if not _is_terminal(handle):
        return None
    told = os.environ.get("COLUMNS", "")
    columns = int(told) if told.isdecimal() and len(told) < 6 else 0
    return max(_NARROWEST, columns or os.get_terminal_size(handle).columns or WIDEST_LINE)


def say(line: str, *, err: bool = False) -> None:
    """Print a line of a report; on a terminal it is broken between words, and goes on further to the right. JSON stays as it is."""
    columns = terminal_columns(2 if err else 1)
    whole = columns is None or line.startswith("{")
    click.echo(line if whole or columns is None else in_columns(line, columns), err=err)


def in_columns(line: str, columns: int) -> str:
    r"""Return a line broken between words so that none is wider than `columns`, but for longer words; colours take no room.

    >>> in_columns("  given that nothing is refused for ever", 24)
    '  given that nothing is\n      refused for ever'
    """
    words = _SPACED.findall(line)
    indent = " " * min(len(line) - len(line.lstrip(" ")) + 4, columns // 2)
    told, room = "", columns
    for word in words:
        wide = width(click.unstyle(word))
        if told and wide > room:
            told, room, word = f"{told.rstrip(' ')}\n{indent}", columns - len(indent), word.lstrip(" ")  # noqa: PLW2901
            wide = width(click.unstyle(word))
        told, room = told + word, room - wide
    return told


def _is_terminal(handle: int) -> bool:
    try:
        return os.isatty(handle)
    except OSError:
        return False


def wants_color(color: Color, file: Path | None) -> bool:
    """Tell whether a text for standard output, or for a file, is coloured.

    Source: no-color.org for `NO_COLOR`; `--color` wins over it.
    """
    if color is not Color.AUTO:
        return color is Color.ALWAYS
    plain_terminal = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return not plain_terminal and file is None and _is_terminal(1)


def summary(report: Report) -> Iterator[Row]:
    """Yield the backing of each table's verdict, then the counts."""
    names = max((width(escape(table.table)) for table in report.tables), default=0)
    words = max((9, *(len(table.verdict.value) for table in report.tables)))
    for file, tables in groupby(report.tables, key=lambda table: table.file):
        kept = (TextPiece("  kept as published"),) if file in report.published else ()
        yield (TextPiece(escape(file), Style.STRONG), *kept)
        for table in tables:
            yield (
                TextPiece(f"  {pad(escape(table.table), names)}  "),
                TextPiece(pad(table.verdict.value, words), _OF_VERDICT[table.verdict]),
                TextPiece(f"  {backing(table)}"),
            )
    for system in report.systems:
        name = escape(system.system)
        if system.wanted:
            told = f"the assumptions of these tables are not proved of the levels together: `rcsc prove {name}` decides them"
            yield (TextPiece(told, Style.NOTE),)
        elif system.missing:
            told = f"{name} is {system.standing}: {escape(named(system.missing))}"
            yield (TextPiece(told, Style.NOTE),)
    if report.tables or report.diagnostics:
        yield tuple(_counts(report))


def backing(table: TableReport) -> str:
    """Return the backing in words: `15 lines, decided by counting, confirmed by Z3, assuming f_means_paused (monitored), 3.1 ms`."""
    parts = [f"{table.lines} line{'' if table.lines == 1 else 's'}", table.backed]
    if table.assumptions:
        parts.append(f"assuming {', '.join(_assumed(table))}")
    if table.together is not None:
        parts += _together(table.together)
    parts += [
        f"{word} where {' or '.join(f'`{escape(name)}`' for name in names)} fails"
        for word, names in (("stops", table.stops), ("only tells", table.tells))
        if names
    ]
    doubtful = [f"`{escape(name)}`" for name, standing in table.assumptions if standing == NOT_PROVED]
    if doubtful and table.verdict is Verdict.CONDITIONAL:
        parts.append(
            f"rests on {' and '.join(doubtful)}, which {'is' if len(doubtful) == 1 else 'are'} not proved"
        )
    parts.append(f"{table.proof_ms:.1f} ms{' (earlier run)' if table.cached else ''}")
    return ", ".join(parts)


def _assumed(table: TableReport) -> Iterator[str]:
    """Yield each assumption with its state."""
    remarks: dict[str, str] = {}
    if (together := table.together) is not None:
        remarks |= dict.fromkeys(together.not_proved, ", not proved of the levels together")
        remarks |= dict.fromkeys(together.conditional, ", conditional of the levels together")
    for name, standing in table.assumptions:
        yield f"{escape(name)} ({standing}{remarks.get(name, '')})"


def _together(known: InSystem) -> Iterator[str]:
    """Yield the verdicts of the levels together on a table."""
    system = escape(known.system)
    if known.proved:
        yield f"kept by the levels together, {system}{escape(trusting(known.trusts))}"
    if known.conditional:
        yield f"conditional in {system}: rests on {escape(named(known.rests))}"
    if known.unreached:
        noun = "line" if len(known.unreached) == 1 else "lines"
        lines = ", ".join(map(escape, known.unreached))
        yield f"{noun} {lines} never reached in {system}{'' if known.proved else escape(trusting(known.trusts))}"


def _counts(report: Report) -> Iterator[TextPiece]:
    if report.tables:
        yield from _verdicts(report)
    yield from _by_severity(report, published=False)
    if report.published:
        many = len(report.published)
        yield TextPiece(f"; in {many} published file{'' if many == 1 else 's'} ")
        yield from _by_severity(report, published=True)


def _by_severity(report: Report, *, published: bool) -> Iterator[TextPiece]:
    for number, severity in enumerate(Severity):
        count = report.count(severity, published=published)
        noun = severity.value if count == 1 else f"{severity.value}s"
        yield TextPiece(", " if number else "")
        yield TextPiece(f"{count} {noun}", OF_SEVERITY[severity] if count else Style.PLAIN)


def _verdicts(report: Report) -> Iterator[TextPiece]:
    always = (Verdict.PROVED, Verdict.REFUTED, Verdict.UNDECIDED)
    of = dict.fromkeys(always, 0) | dict(Counter(table.verdict for table in report.tables))
    noun = "table" if len(report.tables) == 1 else "tables"
    yield TextPiece(f"{len(report.tables)} {noun}: ")
    for number, (verdict, count) in enumerate(of.items()):
        style = _OF_VERDICT[verdict] if count else Style.PLAIN
        yield TextPiece(f"{', ' if number else ''}")
        yield TextPiece(f"{count} {verdict.value}", style)
    yield TextPiece("; ")


class Progress:
    """One line on a terminal's standard error that says what is being worked at.

    Attributes:
        shown: Whether there is a terminal, and it is wanted.
    """

    def __init__(self, *, wanted: bool = True) -> None:
        self.shown = wanted and _is_terminal(2)
        self._width = 0

    def __call__(self, doing: str) -> None:
        """Show the work under way; an empty text clears the line."""
        if not self.shown:
            return
        text = escape(doing)[:100]
        sys.stderr.write(f"\r{pad(text, self._width)}" + ("" if text else "\r"))
        sys.stderr.flush()
        self._width = width(text)
