"""The commands that run the cell: `rcsc run` and `rcsc db`."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import click

if TYPE_CHECKING:
    from rcsc.diagnostics.codes import Code
    from rcsc.workstation.cell import Run

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


def system_path(given: Path | None) -> Path:
    """The description that is meant."""
    from rcsc.diagnostics.codes import Code

    for path in [given] if given else [Path("system.toml"), Path("tables/system.toml")]:
        if path.is_file():
            return path
    raise Stopped(Code.BAD_SYSTEM, "there is no system.toml here nor in tables/", "say which with --system")


def stop(error: Exception) -> NoReturn:
    """The coded error of what the system, the data or the script said."""
    from rcsc.database.build import BadData
    from rcsc.diagnostics.codes import Code
    from rcsc.system.cell import StateTableError
    from rcsc.workstation.script import BadScript

    if isinstance(error, BadData):
        raise Stopped(Code.BAD_DATA, "\n".join(error.problems)) from error
    if isinstance(error, BadScript):
        raise Stopped(Code.BAD_SCRIPT, str(error)) from error
    if isinstance(error, StateTableError):
        raise Stopped(Code.STATE_TABLE_ERROR, str(error)) from error
    raise Stopped(Code.BAD_SYSTEM, str(error)) from error


@click.command(
    short_help="Run a workstation's script on the generated executors.",
    epilog="""\b
Examples:
  rcsc run make_boxt                     Fig. 7, corrected, to the end
  rcsc run make_boxt_printed             as printed: refused at row 22
  rcsc run make_boxt --executor python   the same, by the Python executors
  rcsc run make_boxt --log boxt.mcap     keep every cycle
  rcsc run make_boxt --processes         each level in a process of its own""",
)
@click.argument("script", metavar="SCRIPT")
@SYSTEM
@EXECUTOR
@DATABASE
@click.option("--log", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Keep the complete state of every cycle in FILE (MCAP).")  # fmt: skip
@click.option("--compile/--no-compile", "compiles", default=True, show_default=True,
              help="Prove and compile what changed before anything moves.")  # fmt: skip
@click.option("--processes", is_flag=True,
              help="Each level in a process of its own, over shared memory, nothing else changed.")  # fmt: skip
@click.option("--rate", type=click.FloatRange(min=0.1, max=20), default=4.0, show_default=True, metavar="N",
              help="With --processes: how many times as fast as the clock.")  # fmt: skip
@click.option("-q", "--quiet", is_flag=True, help="Only what stops the script.")
def run(  # noqa: PLR0913, PLR0917  # as many as there are options
    script: str, system: Path | None, executor: str, database: Path | None, log: Path | None, compiles: bool,
    processes: bool, rate: float, quiet: bool,
) -> int:  # fmt: skip
    """Run SCRIPT, a name in the system's scripts or a CSV file, one row a command.

    What changed is proved and compiled, then the script runs on the generated executors, with stand-ins for robot, hand
    and camera, and what each command did is printed. Interlocks refuse a row that would machine a loose part.
    """
    from rcsc.database.build import BadData
    from rcsc.system.cell import StateTableError
    from rcsc.system.description import BadDescription
    from rcsc.system.executors import NotBuilt
    from rcsc.workstation.cell import prepare
    from rcsc.workstation.script import BadScript
    from sim.standin import world

    path = system_path(system)
    if compiles and not _compiled(path, quiet):
        return 1
    try:
        made = prepare(path, script, "c" if executor == "c" else "python", world, database)
        if processes:
            return _apart(path, script, executor, database, rate, quiet)
        _record(made, log)
        return _watch(made, quiet)
    except (BadDescription, BadData, BadScript, NotBuilt, StateTableError) as error:
        stop(error)


def _compiled(path: Path, quiet: bool) -> bool:
    """Proves and compiles what changed; findings are shown."""
    from rcsc import driver
    from rcsc.cli.show import Output, show
    from rcsc.driver.work import Settings
    from rcsc.prove.options import Options
    from rcsc.system.description import BadDescription, description

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


def _record(made: "Run", log: Path | None) -> None:
    if log is not None:
        from rcsc.log.write import Recorder

        made.system.watch.append(Recorder(made.system, log))


def _watch(made: "Run", quiet: bool) -> int:
    begun = time.perf_counter()
    for result in made.steps():
        if not quiet:
            _say(result.row.number, result.row.text, result.state, result.ticks)
    seconds = time.perf_counter() - begun
    for watch in made.system.watch:
        close = getattr(watch, "close", None)
        if close is not None:
            close()
    return _closing(made, seconds, quiet)


def _apart(path: Path, script: str, executor: str, database: Path | None, rate: float, quiet: bool) -> int:
    """The same with a process for each level."""
    import json
    import tempfile

    from rcsc.diagnostics.codes import Code
    from rcsc.system.description import description
    from rcsc.system.processes import Supervisor, run_processes
    from rcsc.system.serve import Factory

    held = str(database.resolve()) if database else ""
    place = str(path.resolve())
    with tempfile.TemporaryDirectory(prefix="rcsc-run-") as scratch:
        results = Path(scratch) / "results"
        results.touch()
        outside = Factory("sim.processes:outside", (place, script, held, str(results)))
        queries = Factory("sim.processes:queries", (place, held))
        kind: Literal["c", "python"] = "c" if executor == "c" else "python"
        rows: list[list[Any]] = []

        def watch(_: Supervisor) -> None:
            said = [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]
            for number, text, state, _reason, ticks in [] if quiet else said[len(rows) :]:
                _say(number, text, state, ticks)
            rows.extend(said[len(rows) :])

        run_processes(description(path), kind, {"outside": outside}, queries=queries, rate=rate, watch=watch)
        rows += [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()[len(rows) :]]
    if not quiet:
        click.echo(f"each level in a process of its own, {rate:g} times as fast as the clock")
    if rows and rows[-1][2] != "done":
        number, text, state, reason, _ = rows[-1]
        raise Stopped(Code.SCRIPT_STOPPED, f"row {number}, {text}: {state}: {reason}")
    return 0


def _say(number: int, text: str, state: str, ticks: int) -> None:
    shown = state if state != "done" else click.style("done", fg="green")
    click.echo(f"{number:3}  {text:42} {shown}  {ticks:5} cycles")
    sys.stdout.flush()


def _closing(made: "Run", seconds: float, quiet: bool) -> int:
    from rcsc.diagnostics.codes import Code

    station, ticks = made.station, made.system.tick
    stopped = station.stopped
    failed = sum(1 for level in made.system.levels if level.values[-1])
    if not quiet:
        minutes = ticks * made.system.description.tick_ms / 60_000
        click.echo(
            f"{ticks} cycles ({minutes:.1f} min of control time) in {seconds:.2f} s; {failed} assumptions failed"
        )
    if stopped is not None:
        word = "refused" if stopped.state == "refused" else "failed"
        raise Stopped(
            Code.SCRIPT_STOPPED,
            f"row {stopped.row.number}, {stopped.row.text}: {word}: {stopped.reason}",
            "the robot is paused; mend the cause and run the script from this row",
        )
    if not station.over:
        raise Stopped(Code.SCRIPT_STOPPED, f"row {station.at + 1} did not end in {ticks} cycles")
    return 0


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
    made, problems, target = _built(system, output)
    if problems:
        from rcsc.diagnostics.codes import Code

        raise Stopped(Code.BAD_DATA, "\n".join(problems))
    click.echo(f"{made} made of the data: {target}" if made else f"{target}")
    return 0


@db.command(short_help="Check the data: every reference resolves, every pose is within reach.")
@SYSTEM
def check(system: Path | None) -> int:
    """Check the data file; every problem is named."""
    import tempfile

    with tempfile.TemporaryDirectory() as scratch:
        _, problems, _ = _built(system, Path(scratch) / "cell.sqlite")
    if problems:
        from rcsc.diagnostics.codes import Code

        raise Stopped(Code.BAD_DATA, "\n".join(problems))
    click.echo("the data is in order")
    return 0


def _built(system: Path | None, output: Path | None) -> tuple[str, tuple[str, ...], Path]:
    from rcsc.database.build import BadData
    from rcsc.database.build import build as build_database
    from rcsc.system.cell import signatures
    from rcsc.system.description import BadDescription, description
    from rcsc.workstation.cell import database_path, parts_of

    try:
        said = description(system_path(system))
        target = output or database_path(said)
        build_database(said.database, target, parts_of(signatures(said)))
    except BadData as error:
        return "", error.problems, Path()
    except BadDescription as error:
        stop(error)
    return "database", (), target


@db.command(short_help="Show what the database says.")
@SYSTEM
@DATABASE
@click.argument("table", required=False, metavar="[TABLE]")
def show(system: Path | None, database: Path | None, table: str | None) -> int:
    """Show a TABLE of the database, or how many rows each has."""
    import sqlite3

    from rcsc.database.build import BadData
    from rcsc.system.cell import signatures
    from rcsc.system.description import BadDescription, description
    from rcsc.workstation.cell import database_of, database_path

    try:
        said = description(system_path(system))
        database_of(said, signatures(said), database)
    except (BadData, BadDescription) as error:
        stop(error)
    held = sqlite3.connect(f"file:{database or database_path(said)}?mode=ro", uri=True)
    names = [
        name for (name,) in held.execute("select name from sqlite_master where type = 'table' order by name")
    ]
    if table is None:
        for name in names:
            [(count,)] = held.execute(f"select count(*) from {name}")  # noqa: S608  # names of our own schema
            click.echo(f"{name:14}{count:6} rows")
        return 0
    if table not in names:
        raise click.BadParameter(f"choose from {', '.join(names)}", param_hint="TABLE")
    found = held.execute(f"select * from {table}")  # noqa: S608  # one of the names above
    click.echo("\t".join(column[0] for column in found.description))
    for row in found:
        click.echo("\t".join("" if value is None else str(value) for value in row))
    return 0
