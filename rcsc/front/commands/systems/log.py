"""`rcsc log`: what a recorded run did."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import click

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.files import write_atomically
from rcsc.front.commands.shared.cells import cell_of
from rcsc.front.commands.shared.logs import FILE, SHOWN, refuse, told
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import writing
from rcsc.front.commands.shared.stopped import stopped
from rcsc.front.commands.shared.systems import NoSystem, system_path
from rcsc.run.description import NO_DATA, BadDescription, description
from rcsc.run.log import export
from rcsc.run.log.export import coverage
from rcsc.run.log.export import plot as draw
from rcsc.run.log.read import Log, LoggedLevel, read
from rcsc.run.log.records import Seal
from rcsc.run.log.schema import Gap
from rcsc.run.log.states import begun_in_words, fault_in_words, witness_in_words
from rcsc.views.pages.data import DrawnCell
from rcsc.views.pages.finding_page import trace
from rcsc.views.pages.log_page import drawn_first, story_of
from rcsc.views.pages.report import report as run_page

_TO = click.Path(dir_okay=False, path_type=Path)


@click.command(
    "log",
    epilog="""\b
Examples:
  rcsc log run.mcap                                ticks, levels, and how often each line ran
  rcsc log run.mcap --csv run.csv --json run.json  every cycle, in the tables' words
  rcsc log run.mcap --plot task.cur_state,primitive.travelled_mm -o run.svg
  rcsc log run.mcap --plot primitive.from_robot.plate[1] --against primitive.from_robot.plate[0] -o path.svg
  rcsc log run.mcap --report run.html              orders, values, lines and the cell, as a page
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
              help="Write a page about the run; of a finding of `rcsc prove --log`: its levels and the cell, cycle by cycle.")  # fmt: skip
@click.option("--system", type=There(path_type=Path), default=None, metavar="SYSTEM",
              help="For --report: the system whose cell is drawn; else system.toml here or in tables/, if it is the log's.")  # fmt: skip
@told
def command(  # noqa: PLR0913  # as many as there are options
    *, file: Path, csv: Path | None, json_: Path | None, parquet: Path | None, plot: str | None,
    against: str | None, output: Path | None, report: Path | None, system: Path | None,
) -> int:  # fmt: skip
    """Say what the run recorded in FILE did: its ticks, its levels, and which lines of which tables ran.

    A log that was cut off, by a kill or a full disk, is read as far as it goes; one that has changed, as far as it is what was recorded.
    """
    _check_plot(plot, against, output)
    if system is not None and report is None:
        raise click.UsageError("--system needs --report")
    log = read(file)
    if report is not None and not log.ticks:
        return refuse(
            file, Code.NO_CYCLE, "the log holds no cycle of which a page could be made",
            help_="`rcsc run SCRIPT --report PAGE` makes a log and a page",
        )  # fmt: skip
    exported = _exported(log, csv, json_, parquet)
    if plot is not None and output is not None:
        _written(output, lambda: draw(log, [name.strip() for name in plot.split(",")], output, against))
        exported.append(output)
    if report is not None:
        _report(report, log, system)
        exported.append(report)
    for path in exported:
        click.echo(f"wrote {path}")
    if not exported:
        _summary(log)
    return _changed(file, log)


def _changed(file: Path, log: Log) -> int:
    """Report a log that differs from its recording; one that a kill has cut is read as far as it goes."""
    if log.checked.seal is not Seal.CHANGED:
        return 0
    return refuse(file, Code.LOG_NOT_WHOLE, f"the log is {log.checked.text}")


def _check_plot(plot: str | None, against: str | None, output: Path | None) -> None:
    if (plot is None) != (output is None):
        raise click.UsageError("--plot and -o go together")
    if against is not None and plot is None:
        raise click.UsageError("--against needs --plot")
    if output is not None and output.suffix not in {".svg", ".png", ".pdf"}:
        raise click.BadParameter("choose .svg, .png or .pdf", param_hint="-o")


def _exported(log: Log, csv: Path | None, json_: Path | None, parquet: Path | None) -> list[Path]:
    """Write the files asked for; return the paths."""
    written = []
    for path, text in ((csv, export.csv_text), (json_, export.json_text)):
        if path is not None:
            content = text(log).encode()
            _written(path, partial(write_atomically, path, content))
            written.append(path)
    if parquet is not None:
        _written(parquet, lambda: export.write_parquet(log, parquet))
        written.append(parquet)
    return written


def _written(path: Path, write: Callable[[], object]) -> None:
    with writing(path):
        write()


def _report(path: Path, log: Log, system: Path | None) -> None:
    """Draw the log's finding, or else its run."""
    finding = log.finding
    cell, why_not = _cell_of(log, system)
    if cell is None:
        click.echo(f"no cell is drawn: {why_not}")
    if finding is not None:
        _written(path, lambda: trace(path, log, finding, cell, why_not))
        return
    from rcsc.desk.studio.share.film import with_ticks  # few make a page

    story = with_ticks(story_of(log, cell, why_not), log, drawn_first(log, _displays(log, system)))
    _written(path, lambda: run_page(path, story))


def _displays(log: Log, system: Path | None) -> Mapping[str, Sequence[str]]:
    """Return the displays of the system, where it is here and the log is of it; it may have no cell."""
    with contextlib.suppress(NoSystem, BadDescription):
        described = description(system_path(system))
        if log.is_of(described):
            return described.displays
    return {}


def _summary(log: Log) -> None:
    count = len(log.ticks)
    seconds = count * log.tick_ms / 1000
    click.echo(f"{log.facts['name']}: {count} ticks of {log.tick_ms} ms, {seconds:g} s")
    click.echo(log.checked.text)
    if (shown := log.finding) is not None:
        where = f"level `{shown.level}`" + (f", table `{shown.table}`" if shown.table else "")
        click.echo(f"a finding, broken in cycle {shown.broken_at}: {where}: {shown.obligation}")
    tables = coverage(log)
    for level in log.levels:
        _summed(log, level)
        for table in tables:
            if table.level == level.name:
                ran = len(table.lines) - len(table.never)
                click.echo(f"  table {table.table}: {ran} of {len(table.lines)} lines ran")
                often = ", ".join(f"{line}: {times}" for line, times in table.lines.items() if times)
                click.echo(f"    ran    {often or 'none'}")
                if table.never:
                    click.echo(f"    never  {', '.join(table.never)}")
    named = {level.name for level in log.levels}
    for event in [event for event in log.events if event.process not in named][:SHOWN]:
        who = f"process {event.process}: " if event.process else ""
        click.echo(f"{who}{event.what}, before cycle {event.tick}")


def _summed(log: Log, level: LoggedLevel) -> None:
    """Print how many cycles a level had, the last fault, when it was started again or set by hand, and what fell otherwise."""
    values = level.track.layout.unpack(level.track.packed[-1])
    said = (form(level.sign, level.level, values) for form in (fault_in_words, witness_in_words))
    fault = "; ".join(filter(None, said))
    click.echo(
        f"level {level.name}: {len(level.track.ticks) - 1} cycles{f'; the last: {fault}' if fault else ''}"
    )
    for event in [event for event in log.events if event.process == level.name][:SHOWN]:
        click.echo(f"  {event.what}, before cycle {event.tick}")
    for gap, why in ((Gap.NOT_RUN, "it did not run"), (Gap.UNSEEN, "what it left could not be read")):
        ticks = [tick for tick, each in level.gaps.items() if each is gap]
        if ticks:
            click.echo(
                f"  {_counted(len(ticks))}, the first {ticks[0]}, {'are' if ticks[1:] else 'is'} not here: {why}"
            )
    if level.taken is not None:
        first = level.taken.ticks[0]
        click.echo(
            f"  {_counted(len(level.taken.ticks))}, the first {first}, took buffers of other cycles than in one process"
        )
    for restart in level.restarts[:SHOWN]:
        begun = begun_in_words(restart.begun)
        if restart.by_hand:
            begun = ", ".join(f"{name} = {value}" for name, value in level.set_by_hand(restart).items())
        told = "set by hand" if restart.by_hand else "started again"
        click.echo(f"  {told} before cycle {restart.tick}: {begun}")
    if len(level.restarts) > SHOWN:
        click.echo(f"  and {len(level.restarts) - SHOWN} times more")


def _counted(cycles: int) -> str:
    return f"{cycles} cycle{'s' if cycles > 1 else ''}"


def _cell_of(log: Log, given: Path | None) -> tuple[DrawnCell | None, str]:
    """The cell, or None and a sentence that says why.

    Args:
        log: To be drawn.
        given: The description that was named; what is wrong with it stops the command.
    """
    try:
        path = system_path(given)
        if description(path).database.name == NO_DATA:
            return None, "the system has no data of which the paper's cell is made."
        return cell_of(log, path), ""
    except NoSystem as error:
        return None, f"{error}; `--system` names one."
    except CodedError as error:
        if given is not None:
            raise stopped(error) from error  # of the system that was named, not of the log
        return None, f"{error}; `--system` names another system."
