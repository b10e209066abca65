"""`rcsc run`: a workstation's script in the simulated cell, on the generated executors."""

import contextlib
import shlex
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from rcsc.commands.shared.extras import need
from rcsc.commands.shared.stopped import Stopped
from rcsc.commands.shared.systems import DATABASE, EXECUTOR, SYSTEM, compiled, system_path
from rcsc.diagnostics.codes import Code
from rcsc.host.cache import open_cache
from rcsc.host.children import scratch
from rcsc.host.files.read import content, json_of
from rcsc.run.description import BadDescription, description
from rcsc.run.log.recorder import Recorder
from rcsc.run.processes.serve import Factory
from rcsc.run.processes.supervisor import Supervisor, run_processes
from rcsc_cell.cell.reach import checked
from rcsc_cell.cell.ready import Backend, plant
from rcsc_cell.episodes.witness import Timed, Witness, names
from rcsc_cell.pictures.report import report
from rcsc_cell.workstation.prepared import ScriptDraft, prepare
from rcsc_cell.workstation.script import BadScript
from rcsc_cell.workstation.stopped import forget, go_on, keep

if TYPE_CHECKING:
    from rcsc_cell.live import Live


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What the user asked for."""

    script: str
    path: Path
    kind: Literal["c", "python"]
    database: Path | None
    backend: Backend
    seed: int
    log: Path | None
    report: Path | None
    live: bool
    rate: float
    quiet: bool
    again: str


@click.command(
    "run",
    epilog="""\b
Examples:
  rcsc run make_boxt                     Fig. 7, corrected, to the end
  rcsc run make_boxt_printed             as printed: refused at row 22
  rcsc run make_boxt --executor python   the same, by the Python executors
  rcsc run make_boxt --plant kinematic   without physics
  rcsc run make_boxt --log boxt.mcap     keep every cycle
  rcsc run make_boxt --report boxt.html  a page about it
  rcsc run make_boxt --live              a page that follows it
  rcsc run make_boxt --processes         each level in a process of its own
  rcsc run make_boxt --resume            go on from the row that stopped it""",
)
@click.argument("script", metavar="SCRIPT")
@SYSTEM
@EXECUTOR
@DATABASE
@click.option("--plant", "backend", type=click.Choice(["mujoco", "kinematic"]), default="mujoco", show_default=True,
              help="The cell by contact physics, or by kinematics alone.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, metavar="N",
              help="Of the sensor's noise; the same seed gives the same log.")  # fmt: skip
@click.option("--log", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Where the complete state of every cycle is kept (MCAP); else in .rcsc-cache beside the data.")  # fmt: skip
@click.option("--report", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write a page about the run: pictures, plots, lines, timing; one file that needs nothing else.")  # fmt: skip
@click.option("--live", is_flag=True,
              help="Show the cell in a browser's page while it runs, at --rate; to this machine only.")  # fmt: skip
@click.option("--compile/--no-compile", "compiles", default=True, show_default=True,
              help="Prove and compile what changed before anything moves.")  # fmt: skip
@click.option("--processes", is_flag=True,
              help="Each level in a process of its own, over shared memory, nothing else changed.")  # fmt: skip
@click.option("--rate", type=click.FloatRange(min=0.1, max=20), default=4.0, show_default=True, metavar="N",
              help="With --processes or --live: how many times as fast as the clock.")  # fmt: skip
@click.option("--from-row", type=click.IntRange(min=1), default=None, metavar="N",
              help="Begin at row N, as if the rows before were done; with --resume, those from the row that stopped.")  # fmt: skip
@click.option("--resume", "resumes", is_flag=True,
              help="Go on from the row that stopped the last run, with everything as it stood then.")  # fmt: skip
@click.option("-q", "--quiet", is_flag=True, help="Only what stops the script.")
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    script: str, system: Path | None, executor: str, database: Path | None, backend: Backend, seed: int,
    log: Path | None, report: Path | None, live: bool, compiles: bool, processes: bool, rate: float,
    from_row: int | None, resumes: bool, quiet: bool,
) -> int:  # fmt: skip
    """Run SCRIPT, a name in the system's scripts or a CSV file, one row a command.

    What changed is proved and compiled, then the script runs on the generated executors in a simulated cell whose parts
    move by contact forces, and what each command did is printed. Interlocks refuse a row that would machine a loose part.
    A row that fails stops the script with its reason; TASK pauses, and where everything stands is kept, so that the script
    can be resumed.
    """
    if processes and (resumes or live or report):
        raise click.UsageError(
            "--resume, --live and --report are of one process; with --processes, use --from-row"
        )
    if live:
        need("live")
    path = system_path(system)
    if compiles and not compiled(path, quiet):
        return 1
    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    again = _command(script, system, database, executor, backend)
    asked = RunOptions(script, path, kind, database, backend, seed, log, report, live, rate, quiet, again)

    try:
        return _run(asked, processes, from_row, resumes)
    except ChildProcessError as error:
        raise Stopped(Code.PROCESS_LOST, str(error), "what levels say as they end stands above") from error


def _run(asked: RunOptions, processes: bool, from_row: int | None, resumes: bool) -> int:
    """The run itself.

    Raises:
        BadDescription, BadData, BadScript, NotBuilt, NotResumed: Something is not in order; nothing has moved.
        StateTableError: A level met a fault that the proofs exclude.
    """
    timed: list[Timed] = []

    def outside(database: Any) -> list[Timed]:
        checked(database, open_cache(asked.path.parent))
        timed.append(Timed(plant(database, asked.backend, seed=asked.seed)))
        return timed

    prepared = prepare(asked.path, asked.script, asked.kind, outside, asked.database)
    _place(prepared, from_row, resumes)
    if processes:
        return _apart(prepared, asked)
    witness = Witness(prepared, timed[0], film=asked.report is not None)
    with _recorded(prepared, asked) as log, _followed(witness, asked):
        prepared.system.watch.append(witness)
        seconds = _watch(prepared, asked)
    if asked.report is not None:
        _write_report(asked.report, witness, asked, seconds)
    return _closing(witness, asked, seconds, log)


def _place(prepared: ScriptDraft, from_row: int | None, resumes: bool) -> None:
    """Put the run where it is to begin.

    Raises:
        BadScript: There is no such row.
        NotResumed: There is nothing to go on from.
    """
    rows = len(prepared.station.rows)
    if from_row is not None and from_row > rows:
        raise BadScript(f"the script has {rows} rows, and none is {from_row}")
    if resumes:
        go_on(prepared)
    else:
        forget(prepared.system.description)  # what stood somewhere else begins anew
    if from_row is not None:
        prepared.station.begin_at(from_row - 1)


def _command(script: str, system: Path | None, database: Path | None, executor: str, backend: str) -> str:
    """What to type for the same run; how it begins is to be added."""
    words = ["rcsc", "run", script]
    words += ["--system", str(system)] if system else []
    words += ["--database", str(database)] if database else []
    words += ["--executor", executor] if executor != "c" else []
    words += ["--plant", backend] if backend != "mujoco" else []
    return shlex.join(words)


# --- while it runs ---


@contextlib.contextmanager
def _recorded(prepared: ScriptDraft, asked: RunOptions) -> Iterator[Path]:
    """Write the log; yield its path."""
    path = (
        asked.log
        or prepared.system.description.database.parent
        / ".rcsc-cache"
        / f"{prepared.system.description.name}.mcap"
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        recorder = Recorder(prepared.system, path)
    except OSError as error:
        raise BadDescription(f"the log {path} cannot be written: {error.strerror}") from error
    prepared.system.watch.append(recorder)
    try:
        yield path
    finally:
        recorder.close()


@contextlib.contextmanager
def _followed(witness: Witness, asked: RunOptions) -> Iterator[None]:
    """Open the page, where one was asked for, and keep the clock's pace for whoever looks."""
    if not asked.live:
        yield
        return
    live = _page(witness, asked)
    witness.live = live
    click.echo(f"the cell is at {live.start()}")
    sys.stdout.flush()
    pace = _Pace(witness.run.system.description.tick_ms / 1000 / asked.rate)
    witness.run.system.watch.append(pace)
    try:
        yield
    finally:
        witness.finish()
        live.stop()


def _page(witness: Witness, asked: RunOptions) -> "Live":
    from rcsc_cell.live import Live  # of an extra

    system = witness.run.system
    try:
        return Live(
            names(system), system.description.displays, tick_ms=system.description.tick_ms, title=asked.script
        )
    except ValueError as error:
        raise BadDescription(f"{asked.path}, displays: {error}") from error


class _Pace:
    """Waits after each cycle until the clock has come as far."""

    def __init__(self, cycle_s: float) -> None:
        self._cycle_s, self._next = cycle_s, time.monotonic()

    def __call__(self, system: object, due: object) -> None:  # noqa: ARG002  # what all who watch are given
        self._next = max(self._next + self._cycle_s, time.monotonic() - 1.0)
        time.sleep(max(0.0, self._next - time.monotonic()))


def _watch(prepared: ScriptDraft, asked: RunOptions) -> float:
    """Run to the end and say what becomes of each row; return the seconds that it took."""
    begun = time.perf_counter()
    for result in prepared.steps():
        if not asked.quiet:
            _say(result.row.number, result.row.text, result.state, result.ticks)
    return time.perf_counter() - begun


def _say(number: int, text: str, state: str, ticks: int) -> None:
    shown = state if state != "done" else click.style("done", fg="green")
    click.echo(f"{number:3}  {text:42} {shown}  {ticks:5} cycles")
    sys.stdout.flush()


def _apart(prepared: ScriptDraft, asked: RunOptions) -> int:
    """Run with a process for each level."""
    with scratch("run") as folder:
        rows = _rows_apart(asked, prepared.station.at, folder / "results")
    if not asked.quiet:
        click.echo(f"each level in a process of its own, {asked.rate:g} times as fast as the clock")
    if rows and rows[-1][2] != "done":
        number, text, state, reason, _ = rows[-1]
        raise Stopped(
            Code.SCRIPT_STOPPED,
            f"row {number}, {text}: {state}: {reason}",
            f"mend the cause, then begin anew: {asked.again} --processes --from-row {number}",
        )
    return 0


def _rows_apart(asked: RunOptions, first: int, results: Path) -> list[list[Any]]:
    """Run the processes to the end; return each row's number, text, state, reason and ticks, which travel in `results`."""
    held = str(asked.database.resolve()) if asked.database else ""
    place = str(asked.path.resolve())
    outside = Factory(
        "rcsc_cell.episodes.processes:outside",
        (place, asked.script, held, str(results), first, asked.backend),
    )
    queries = Factory("rcsc_cell.episodes.processes:queries", (place, held))
    rows: list[list[Any]] = []

    def more() -> list[list[Any]]:
        return [json_of(line) for line in content(results).decode().splitlines()[len(rows) :]]

    def watch(_: Supervisor) -> None:
        new = more()
        for number, text, state, _reason, ticks in [] if asked.quiet else new:
            _say(number, text, state, ticks)
        rows.extend(new)

    results.touch()
    run_processes(
        description(asked.path),
        asked.kind,
        {"outside": outside},
        queries=queries,
        rate=asked.rate,
        watch=watch,
    )
    return rows + more()


# --- when it is over ---


def _write_report(path: Path, witness: Witness, asked: RunOptions, seconds: float) -> None:

    try:
        report(path, witness.story(asked.script, seconds))
    except OSError as error:
        raise BadDescription(f"the report {path} cannot be written: {error.strerror}") from error


def _closing(witness: Witness, asked: RunOptions, seconds: float, log: Path) -> int:

    ended = witness.run
    again = _kept(ended, asked)
    if not asked.quiet:
        for line in _figures(witness, seconds):
            click.echo(line)
        here = log.relative_to(Path.cwd()) if log.is_relative_to(Path.cwd()) else log
        click.echo(f"log: {here}" + (f"; report: {asked.report}" if asked.report else ""))
    station, stopped = ended.station, ended.station.stopped
    if stopped is not None:
        word = "refused" if stopped.state == "refused" else "failed"
        raise Stopped(
            Code.SCRIPT_STOPPED,
            f"row {stopped.row.number}, {stopped.row.text}: {word}: {stopped.reason}",
            again,
        )
    if not station.over:
        raise Stopped(Code.SCRIPT_STOPPED, f"row {station.at + 1} did not end in {ended.system.tick} cycles")
    return 0


def _figures(witness: Witness, seconds: float) -> Iterator[str]:
    """Where parts lie, how near the joints came to their limits, and how long it took."""
    system = witness.run.system
    for placed in witness.placed():
        yield f"{placed.part} at {placed.place}: {placed.error_mm:.2f} mm from where it should lie"
    margins = ", ".join(f"{margin:.0f}" for margin in witness.margins_deg)
    yield f"joints kept {margins} degrees from their limits"
    control_s = system.tick * system.description.tick_ms / 1000
    failed = sum(1 for level in system.levels if level.values[-1])
    yield (
        f"{system.tick} cycles, {control_s:.1f} s of control time in {seconds:.2f} s: {control_s / seconds:.0f} times "
        f"as fast as the clock; {failed} assumptions failed"
    )


def _kept(ended: ScriptDraft, asked: RunOptions) -> str:
    """Keep a run that stopped, forget one that ended; return what to do about it."""
    if ended.station.stopped is None:
        if ended.station.over:
            forget(ended.system.description)
        return ""
    try:
        keep(ended, asked.script)
    except OSError as error:
        row = f"{asked.again} --from-row {ended.station.at + 1}"
        return f"where it stopped could not be kept: {error.strerror}; mend the cause, then begin anew: {row}"
    return f"the robot is paused; mend the cause, then: {asked.again} --resume"
