"""What the commands about a system share, and `rcsc db`."""

from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from rcsc.commands.shared.options import showing

if TYPE_CHECKING:
    from rcsc.commands.shared.show import Output
    from rcsc.diagnostics.codes import Code
    from rcsc.diagnostics.report import Report
    from rcsc.host.described import BadFile

SYSTEM = click.option(
    "--system", "system", type=click.Path(exists=True, dir_okay=False, path_type=Path), default=None, metavar="FILE",
    help="The system's description; else system.toml here or in tables/.",
)  # fmt: skip
EXECUTOR = click.option(
    "--executor", type=click.Choice(["c", "python"]), default="c", show_default=True,
    help="Which of the generated executors run; both do the same.",
)  # fmt: skip
DATABASE = click.option(
    "--database", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
    help="A database made by `rcsc db build`, used as it is; else it is made of the data when that changes.",
)  # fmt: skip


class Stopped(click.ClickException):  # what happened
    """A coded error of a run; exit status 1."""

    status = 1

    def __init__(self, code: "Code", message: str, *helps: str) -> None:
        super().__init__(message)
        self.code, self.helps = code, helps

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """The error, as every other is shown."""
        for line in self.message.splitlines():
            click.echo(f"error[{self.code.value}]: {line}", err=True)
        for one in self.helps:
            click.echo(f"  = help: {one}", err=True)


class StoppedByFile(Stopped):
    """The faults of a description or a data file, each with its place."""

    def __init__(self, code: "Code", error: "BadFile") -> None:
        super().__init__(code, str(error))
        self.found, self.sources = error.found, error.sources

    def show(self, file: object = None) -> None:  # noqa: ARG002  # click's signature
        """Each fault, with the line it stands in."""
        from rcsc.diagnostics.render import full, plain

        for one in self.found:
            click.echo(plain(full(one, self.sources)), err=True)


def system_path(given: Path | None) -> Path:
    """The description that is meant."""
    from rcsc.diagnostics.codes import Code

    for path in [given] if given else [Path("system.toml"), Path("tables/system.toml")]:
        if path.is_file():
            return path
    raise Stopped(Code.BAD_SYSTEM, "there is no system.toml here nor in tables/", "say which with --system")


def stop(error: Exception) -> NoReturn:
    """The coded error of what the system, the data or the script said."""
    from rcsc.diagnostics.codes import Code
    from rcsc.host.described import BadFile
    from rcsc.run.system import StateTableError
    from rcsc.run.unproved import UnprovedExecutors
    from rcsc_cell.database.build import BadData
    from rcsc_cell.workstation.script import BadScript
    from rcsc_cell.workstation.stopped import NotResumed

    if isinstance(error, UnprovedExecutors):
        raise Stopped(
            Code.EXECUTORS_NOT_PROVED, str(error), "mend the tables, then `rcsc compile`"
        ) from error
    if isinstance(error, NotResumed):
        raise Stopped(error.code, str(error), "`--from-row N` begins anew at row N") from error
    if isinstance(error, BadFile) and error.found:
        raise StoppedByFile(error.found[0].code, error) from error
    if isinstance(error, BadData):
        raise Stopped(Code.BAD_DATA, "\n".join(error.problems)) from error
    if isinstance(error, BadScript):
        raise Stopped(Code.BAD_SCRIPT, str(error)) from error
    if isinstance(error, StateTableError):
        raise Stopped(Code.STATE_TABLE_ERROR, str(error)) from error
    raise Stopped(Code.BAD_SYSTEM, str(error)) from error


def compiled(path: Path, quiet: bool) -> bool:
    """Proves and compiles what changed; findings are shown."""
    from rcsc import driver
    from rcsc.commands.shared.show import Output, show
    from rcsc.driver.settings import Settings
    from rcsc.run.description import BadDescription, description
    from rcsc.solvers.options import Options

    try:
        system = description(path)
    except BadDescription as error:
        stop(error)
    files = tuple(
        str(one)
        for spec in system.levels
        for one in (path.parent / spec.program / f"{spec.program}.rcs", path.parent / f"{spec.program}.rcs")
        if one.is_file()
    )
    made = driver.compile_(Settings(files, Options()), system.generated, ("python", "c"), only_check=False)
    if made.report.failed:
        show(made.report, "compile", Output())
    elif not quiet:
        click.echo(f"{len(made.report.tables)} tables proved and compiled")
    return not made.report.failed


@click.group(
    short_help="Build, check and show the cell's database.",
    epilog="""\b
Examples:
  rcsc db check           every reference resolves, every pose is within reach
  rcsc db show places     a table of it""",
)
def db() -> None:
    """Build, check and show the cell's database.

    Where things are, how parts are gripped and how the robot moves is data: when it changes nothing is compiled again.
    """


@db.command(short_help="Make the database of the data file.")
@SYSTEM
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Where it goes.")  # fmt: skip
def build(system: Path | None, output: Path | None) -> int:
    """Make the database; nothing is written when the data is not in order."""
    click.echo(f"database made of the data: {_built(system, output, writes=True)}")
    return 0


@db.command(short_help="Check the data: every reference resolves, every pose is within reach.")
@SYSTEM
@showing
def check(system: Path | None, output: "Output") -> int:
    """Check the description and the data file; every fault is named, with its line."""
    from rcsc.commands.shared.show import Form, show

    try:
        _built(system, None, writes=False)
        report = _report(None)
    except Stopped as error:
        if output.form is Form.TEXT and output.file is None:
            raise
        report = _report(error)
    if output.form is Form.TEXT and output.file is None:
        click.echo("the data is in order")
    else:
        show(report, "db check", output)
    return 1 if report.failed else 0


def _report(error: Stopped | None) -> "Report":
    """What is wrong, for a form that a program reads."""
    from rcsc.diagnostics.diagnostic import Diagnostic, Label
    from rcsc.diagnostics.report import Report
    from rcsc.diagnostics.source import Span

    if error is None:
        return Report(())
    if isinstance(error, StoppedByFile):
        return Report(error.found, sources=error.sources)
    lines = error.message.splitlines()
    return Report(
        tuple(Diagnostic(error.code, line, Label(Span("", 0, 0)), help=error.helps) for line in lines)
    )


def _built(system: Path | None, output: Path | None, *, writes: bool) -> Path:
    """Makes the database where it harms nobody, has the arm go everywhere in it, and only then writes it; where to."""
    from rcsc.host.cache import open_cache
    from rcsc.host.children import scratch
    from rcsc.run.description import BadDescription, description
    from rcsc.run.system import signatures
    from rcsc_cell.cell.reach import checked
    from rcsc_cell.database.ask import open_database
    from rcsc_cell.database.build import BadData
    from rcsc_cell.database.build import build as build_database
    from rcsc_cell.workstation.prepared import database_path, limits_of, needs_data, parts_of

    try:
        path = system_path(system)
        said = description(path)
        signs = signatures(said)
        needs_data(said)
        parts, limits = parts_of(signs), limits_of(said, signs)
        target = output or database_path(said)
        with scratch("db") as folder:
            tried = folder / "cell.sqlite"
            build_database(said.database, tried, parts, limits)
            checked(open_database(tried), open_cache(path.parent) if writes else None)
        if writes:
            build_database(said.database, target, parts, limits)
    except (BadData, BadDescription) as error:
        stop(error)
    return target


@db.command(short_help="Show what the database says.")
@SYSTEM
@DATABASE
@click.argument("table", required=False, metavar="[TABLE]")
def show(system: Path | None, database: Path | None, table: str | None) -> int:
    """Show a TABLE of the database, or how many rows each has."""
    from rcsc.run.description import BadDescription, description
    from rcsc.run.system import signatures
    from rcsc_cell.database.ask import tables_of
    from rcsc_cell.database.build import BadData
    from rcsc_cell.workstation.prepared import database_of, database_path

    try:
        said = description(system_path(system))
        database_of(said, signatures(said), database)
        held = tables_of(database or database_path(said))
    except (BadData, BadDescription) as error:
        stop(error)
    if table is None:
        for name in sorted(held):
            click.echo(f"{name:14}{len(held[name].rows):6} rows")
        return 0
    if table not in held:
        raise click.BadParameter(f"choose from {', '.join(sorted(held))}", param_hint="TABLE")
    click.echo("\t".join(held[table].columns))
    for row in held[table].rows:
        click.echo("\t".join(_shown(value) for value in row))
    return 0


MOST_SHOWN = 400
"""Characters of a value that `db show` prints."""


def _shown(value: object) -> str:
    from rcsc.diagnostics.printable import escape

    text = "" if value is None else str(value)
    return escape(text[:MOST_SHOWN]) + ("..." if len(text) > MOST_SHOWN else "")
