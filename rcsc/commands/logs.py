"""`rcsc log` and `rcsc replay`: what a recorded run did, and whether it would do it again."""

from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rcsc.commands.shared.show import Output, UnwritableError, show
from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.report import Report
from rcsc.diagnostics.source import Span

if TYPE_CHECKING:
    from rcsc.run.log.read import Log, LoggedLevel
    from rcsc.run.log.replay import Cycle, Moment, Replay

FILE = click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path), metavar="FILE")
_TO = click.Path(dir_okay=False, path_type=Path)
_SHOWN = 12
"""Differences, and restarts, that are shown of one level."""


def _told(command: Callable[..., int]) -> Callable[..., int]:
    """What can go wrong with a log, as coded findings about FILE."""

    @wraps(command)
    def wrapped(file: Path, **kwargs: Any) -> int:
        from rcsc.run.description import BadDescription
        from rcsc.run.executors import NotBuilt
        from rcsc.run.levels import BadState
        from rcsc.run.log.queries import BadExpression
        from rcsc.run.log.read import UnreadableLog

        try:
            return command(file=file, **kwargs)
        except UnreadableLog as error:
            return _refuse(file, Code.LOG_UNREADABLE, str(error))
        except (BadDescription, NotBuilt, BadState) as error:
            return _refuse(file, Code.NOT_REPLAYED, f"the log cannot be replayed: {error}")
        except BadExpression as error:
            raise click.UsageError(str(error)) from error

    return wrapped


def _refuse(file: Path, code: Code, message: str, *, notes: tuple[str, ...] = (), help_: str = "") -> int:
    place = Label(Span(str(file), 0, 0))
    found = Diagnostic(code, message, place, notes=notes, help=(help_,) if help_ else ())
    show(Report((found,)), "log", Output(quiet=True))
    return 1


@click.command(
    short_help="Say what a recorded run did.",
    epilog="""\b
Examples:
  rcsc log run.mcap                                ticks, levels, and how often each line ran
  rcsc log run.mcap --csv run.csv --json run.json  every cycle, in the tables' words
  rcsc log run.mcap --plot task.cur_state,primitive.travelled_mm -o run.svg
  rcsc log run.mcap --plot primitive.robot.plate[1] --against primitive.robot.plate[0] -o path.svg
  rcsc log found/task_waits_to_emove.mcap --report waits.html   what `rcsc prove --log found` found, cycle by cycle""",
)
@FILE
@click.option("--csv", type=_TO, default=None, metavar="OUT", help="Write a row a tick to OUT.")
@click.option(
    "--json", "json_", type=_TO, default=None, metavar="OUT", help="Write every cycle to OUT as JSON."
)
@click.option("--parquet", type=_TO, default=None, metavar="OUT",
              help="Write a row a tick to OUT as Parquet; needs the extra `parquet`.")  # fmt: skip
@click.option("--plot", default=None, metavar="VAR[,VAR...]",
              help="Draw these, `level.leaf`, over time; needs -o and the extra `plot`.")  # fmt: skip
@click.option("--against", default=None, metavar="VAR", help="Draw them over VAR instead.")
@click.option("-o", "--output", type=_TO, default=None, metavar="PICTURE", help="Where: .svg, .png or .pdf.")
@click.option("--report", type=_TO, default=None, metavar="PAGE",
              help="Write a page about a finding of `rcsc prove --log`: its levels and the cell, cycle by cycle.")  # fmt: skip
@click.option("--system", type=click.Path(exists=True, dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="For --report: the system whose cell is drawn; else system.toml here or in tables/, if it is the log's.")  # fmt: skip
@_told
def log(  # noqa: PLR0913  # as many as there are options
    *, file: Path, csv: Path | None, json_: Path | None, parquet: Path | None, plot: str | None,
    against: str | None, output: Path | None, report: Path | None, system: Path | None,
) -> int:  # fmt: skip
    """Say what the run recorded in FILE did: its ticks, its levels, and which lines of which tables ran.

    A log that was cut off, by a kill or a full disk, is read as far as it goes; one that has changed, as far as it is what was recorded.
    """
    from rcsc.run.log.read import read

    _check_plot(plot, against, output)
    if system is not None and report is None:
        raise click.UsageError("--system needs --report")
    found = read(file)
    if report is not None and found.finding is None:
        return _refuse(
            file, Code.NO_FINDING, "the log keeps no finding of `rcsc prove`, of which a page could be made",
            help_="`rcsc run SCRIPT --report PAGE` makes one of a run in the cell; `--plot` draws values of its log",
        )  # fmt: skip
    exported = _exported(found, csv, json_, parquet)
    if plot is not None and output is not None:
        from rcsc.run.log.plot import plot as draw

        _written(output, lambda: draw(found, [one.strip() for one in plot.split(",")], output, against))
        exported.append(output)
    if report is not None:
        _report(report, found, system)
        exported.append(report)
    for path in exported:
        click.echo(f"wrote {path}")
    if not exported:
        _summary(found)
    return _changed(file, found)


def _changed(file: Path, found: "Log") -> int:
    """What is no longer as it was recorded; a log that a kill has cut is read as far as it goes."""
    from rcsc.run.log.records import Seal

    if found.checked.seal is not Seal.CHANGED:
        return 0
    return _refuse(file, Code.LOG_NOT_WHOLE, f"the log is {found.checked.said}")


def _check_plot(plot: str | None, against: str | None, output: Path | None) -> None:
    if (plot is None) != (output is None):
        raise click.UsageError("--plot and -o go together")
    if against is not None and plot is None:
        raise click.UsageError("--against needs --plot")
    if output is not None and output.suffix not in {".svg", ".png", ".pdf"}:
        raise click.BadParameter("choose .svg, .png or .pdf", param_hint="-o")


def _exported(found: "Log", csv: Path | None, json_: Path | None, parquet: Path | None) -> list[Path]:
    """Writes what was asked for; where."""
    from rcsc.host.files import write_atomically
    from rcsc.run.log import export

    written = []
    for path, text in ((csv, export.csv_text), (json_, export.json_text)):
        if path is not None:
            content = text(found).encode()
            _written(path, partial(write_atomically, path, content))
            written.append(path)
    if parquet is not None:
        _written(parquet, lambda: export.write_parquet(found, parquet))
        written.append(parquet)
    return written


def _written(path: Path, write: Callable[[], object]) -> None:
    try:
        write()
    except OSError as error:
        raise UnwritableError(str(path), error.strerror or "no reason given") from error


def _report(path: Path, found: "Log", system: Path | None) -> None:
    """Draws a finding."""
    from rcsc.commands.shared.drawn import cell_of
    from rcsc_cell.pictures.finding_page import trace

    finding = found.finding
    assert finding is not None
    cell, why_not = cell_of(found, system)
    if cell is None:
        click.echo(f"no cell is drawn: {why_not}")
    _written(path, lambda: trace(path, found, finding, cell, why_not))


def _summary(found: "Log") -> None:
    from rcsc.run.log.export import coverage

    count = len(found.ticks)
    seconds = count * found.tick_ms / 1000
    click.echo(f"{found.facts['name']}: {count} ticks of {found.tick_ms} ms, {seconds:g} s")
    click.echo(found.checked.said)
    if (shown := found.finding) is not None:
        where = f"level `{shown.level}`" + (f", table `{shown.table}`" if shown.table else "")
        click.echo(f"a finding, broken in cycle {shown.broken_at}: {where}: {shown.obligation}")
    for level in found.levels:
        _summed(level)
        for table in coverage(found):
            if table.level == level.name:
                ran = len(table.lines) - len(table.never)
                click.echo(f"  table {table.table}: {ran} of {len(table.lines)} lines ran")
                often = ", ".join(f"{line}: {times}" for line, times in table.lines.items() if times)
                click.echo(f"    ran    {often or 'none'}")
                if table.never:
                    click.echo(f"    never  {', '.join(table.never)}")


def _summed(level: "LoggedLevel") -> None:
    """How many cycles, how they ended, and how often the level was started again."""
    from rcsc.run.log.states import begun_in_words, fault_in_words

    values = level.track.layout.unpack(level.track.packed[-1])
    fault = fault_in_words(level.sign, level.level, values)
    click.echo(
        f"level {level.name}: {len(level.track.ticks) - 1} cycles{f'; the last: {fault}' if fault else ''}"
    )
    for one in level.restarts[:_SHOWN]:
        click.echo(f"  started again before cycle {one.tick}: {begun_in_words(one.begun)}")
    if len(level.restarts) > _SHOWN:
        click.echo(f"  and {len(level.restarts) - _SHOWN} times more")


@click.command(
    short_help="Run a recorded run again and compare.",
    epilog="""\b
Examples:
  rcsc replay run.mcap                          every cycle leaves what it left
  rcsc replay run.mcap --executor python        with the Python executors
  rcsc replay run.mcap --generated edited       what would other tables have done?
  rcsc replay run.mcap --at 120 --show task     one cycle, and a level's whole state
  rcsc replay run.mcap --find "task.cur_state == state_3 and not task.idle" """,
)
@FILE
@click.option("--executor", type=click.Choice(["c", "python"]), default="c", show_default=True,
              help="What runs the levels.")  # fmt: skip
@click.option("--generated", type=click.Path(file_okay=False, path_type=Path), default=Path("generated"),
              show_default=True, metavar="FOLDER",
              help="The executors; another folder than the run's own asks what its tables would have done.")  # fmt: skip
@click.option("--at", type=int, default=None, metavar="CYCLE", help="Run this cycle alone, and show it.")
@click.option("--find", "find_", default=None, metavar="EXPR",
              help="Go to the first cycle, from --at on, in which EXPR holds, and show it.")  # fmt: skip
@click.option("--show", "level", default=None, metavar="LEVEL", help="Show this level's whole state, too.")
@_told
def replay(
    *, file: Path, executor: str, generated: Path, at: int | None, find_: str | None, level: str | None
) -> int:
    """Run the run recorded in FILE again, each cycle from the recorded state with the recorded inputs.

    Every leaf must be what it was, bit for bit; the first that is not is named. A log that is not whole is replayed as far as it goes,
    and the exit status is 1.
    """
    from rcsc.run.log.read import read
    from rcsc.run.log.replay import Replay

    found = read(file)
    tick = _wanted(found, at, find_)
    if level is not None and level not in {one.name for one in found.levels}:
        raise click.BadParameter(f"there is no level `{level}` in this log", param_hint="--show")
    again = Replay(found, generated, "python" if executor == "python" else "c")
    if tick == 0:
        click.echo(f"`{find_}` holds in no cycle")
        return 1
    moment = again.first_difference() if tick is None else again.go(tick)
    if moment is not None and (tick is not None or level is not None):
        _show_moment(again, moment, level)
    if moment is not None and moment.differs:
        return _differs(file, again, moment)
    if tick is None:
        lacking = again.lacking
        differs = "nothing that these tables have differs" if lacking else "nothing differs"
        click.echo(f"{len(found.ticks)} ticks replayed: {differs}; {found.checked.said}")
        if lacking:
            more = f", and {len(lacking) - _SHOWN} more" if len(lacking) > _SHOWN else ""
            click.echo(f"not in these tables, and so not compared: {', '.join(lacking[:_SHOWN])}{more}")
    if not found.complete:
        return _refuse(file, Code.LOG_NOT_WHOLE, f"the log is {found.checked.said}")
    return 0


def _wanted(found: "Log", at: int | None, find_: str | None) -> int | None:
    """The tick that is asked for; None for all, 0 for one that there is not."""
    from rcsc.run.log.queries import predicate
    from rcsc.run.log.replay import find

    if at is not None and at not in found.ticks:
        raise click.BadParameter(f"the log holds cycles {found.first + 1} to {found.last}", param_hint="--at")
    return at if find_ is None else find(found, predicate(find_, found), at) or 0


def _show_moment(again: "Replay", moment: "Moment", level: str | None) -> None:
    from rcsc.run.log.states import begun_in_words, fault_in_words, words

    click.echo(f"cycle {moment.tick}, {moment.tick * again.log.tick_ms} ms")
    for cycle in moment.cycles:
        if cycle.restarted is not None:
            click.echo(f"  {cycle.level}: started again, {begun_in_words(cycle.restarted)}")
        logged = again.log.level(cycle.level)
        fault = fault_in_words(logged.sign, logged.level, cycle.recorded)
        click.echo(f"  {cycle.level}: {fault or cycle.line_then}")
        if cycle.level == level:
            for name, said in words(logged.sign, logged.level, cycle.recorded).items():
                click.echo(f"    {name} = {said}")


def _differs(file: Path, again: "Replay", moment: "Moment") -> int:
    first = next(cycle for cycle in moment.cycles if cycle.differences)
    leaf = _leading(first)
    said = f"`{leaf.name}` was `{leaf.then}` and is `{leaf.now}`"
    where = f"cycle {moment.tick}, level `{first.level}`"
    notes = tuple(note for cycle in moment.cycles if cycle.differences for note in _notes(cycle))
    if again.unchanged:
        return _refuse(file, Code.REPLAY_DIFFERS, f"the replay differs in {where}: {said}", notes=notes)
    return _refuse(
        file, Code.TABLES_DECIDE_OTHERWISE, f"these tables decide otherwise in {where}: {said}", notes=notes
    )


def _leading(cycle: "Cycle") -> Any:
    """The difference that is named: a leaf's, where there is one."""
    from rcsc.run.log.states import TRACED

    return next((one for one in cycle.differences if one.name not in TRACED), cycle.differences[0])


def _notes(cycle: "Cycle") -> tuple[str, ...]:
    lines = f"{cycle.level}: {cycle.line_then} matched then, {cycle.line_now} now"
    shown = [
        f"{cycle.level}.{one.name}: {one.then} then, {one.now} now" for one in cycle.differences[:_SHOWN]
    ]
    more = len(cycle.differences) - _SHOWN
    return (lines, *shown, *([f"and {more} more of {cycle.level}'s"] if more > 0 else []))
