"""`rcsc db`: the database that is made of a system's data."""

from pathlib import Path

import click

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.report import Report
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.described import BadFile
from rcsc.front.commands.shared.options import showing
from rcsc.front.commands.shared.show import Output, OutputForm
from rcsc.front.commands.shared.show import show as show_report
from rcsc.front.commands.shared.systems import DATABASE, SYSTEM, system_path
from rcsc.run.description import description
from rcsc.run.system import signatures
from rcsc.views.pages.data import known


@click.group(
    "db",
    epilog="""\b
Examples:
  rcsc db check           every reference resolves, every pose is within reach
  rcsc db show places     a table of it""",
)
def command() -> None:
    """Build, check and show the cell's database.

    Where things are, how parts are gripped and how the robot moves is data: when it changes nothing is compiled again.
    """


@command.command(short_help="Make the database of the data file.")
@SYSTEM
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Where it goes.")  # fmt: skip
def build(system: Path | None, output: Path | None) -> int:
    """Make the database; nothing is written when the data is not in order."""
    click.echo(f"database made of the data: {_built(system, output, writes=True)}")
    return 0


@command.command(short_help="Check the data: every reference resolves, every pose is within reach.")
@SYSTEM
@showing
def check(system: Path | None, output: Output) -> int:
    """Check the description and the data file; every fault is named, with its line."""
    try:
        _built(system, None, writes=False)
        report = Report(())
    except CodedError as error:
        if output.form is OutputForm.TEXT and output.file is None:
            raise
        report = _report(error)
    if output.form is OutputForm.TEXT and output.file is None:
        click.echo("the data is in order")
    else:
        show_report(report, "db check", output)
    return 1 if report.failed else 0


def _report(error: CodedError) -> Report:
    """Return the errors as a report, for a form that a program reads."""
    if isinstance(error, BadFile) and error.diagnostics:
        return Report(error.diagnostics, sources=error.sources)
    diagnostics = (
        Diagnostic(error.code, line, Label(Span("", 0, 0)), help=error.helps)
        for line in error.shown.splitlines()
    )
    return Report(tuple(diagnostics))


def _built(system: Path | None, output: Path | None, *, writes: bool) -> Path:
    """Build the database, or only check it; return its path."""
    described = description(system_path(system))
    signs = signatures(described)
    return known(described).build(described, signs, output, writes=writes)


@command.command(short_help="Show what the database says.")
@SYSTEM
@DATABASE
@click.argument("table", required=False, metavar="[TABLE]")
def show(system: Path | None, database: Path | None, table: str | None) -> int:
    """Show a TABLE of the database with names and units, or how many rows each has; the file has every digit."""
    described = description(system_path(system))
    signs, data = signatures(described), known(described)
    held = data.rows(described, signs, database)
    if table is None:
        for name in sorted(held):
            click.echo(f"{name:14}{held[name]:6} rows")
        return 0
    if table not in held:
        raise click.BadParameter(f"choose from {', '.join(sorted(held))}", param_hint="TABLE")
    for line in data.lines(described, signs, database, table):
        click.echo(line)
    return 0
