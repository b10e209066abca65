"""`rcsc run`: a system with its plant, by a script of orders, on the generated executors."""

import contextlib
import shlex
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import content, json_of
from rcsc.code.testing.figures import counted
from rcsc.desk.shell.opening import Opening
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.stopped import Ending, Interrupted, Stopped, attach, say_error
from rcsc.front.commands.shared.systems import COMPILES, DATABASE, EXECUTOR, PLANT, SYSTEM, made, meant
from rcsc.front.commands.systems.studio import serve
from rcsc.run.description import BadDescription, Description, description
from rcsc.run.faults import faults_of, grades_of
from rcsc.run.orders.operator import MOST_TICKS, UNORDERED_TICKS, WATCHED_RATE, Operator, ScriptedRun
from rcsc.run.orders.script import BadScript
from rcsc.run.orders.stopped import NotKept, StoppedRuns
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.processes.serve import Factory
from rcsc.run.processes.supervisor import Course, Supervisor, run_processes
from rcsc.run.processes.switches import Strengths
from rcsc.run.signature import Signature
from rcsc.run.system import assemble, signatures
from rcsc.views.pages.report import Figure, ReportRow, Story, report
from rcsc.views.pages.witness import RunWitness

if TYPE_CHECKING:
    from rcsc.lang.model import Property
    from rcsc.run.log.required import BrokenRequirement
    from rcsc.run.plant.staged import Staged
    from rcsc.run.system import System
    from rcsc.views.pages.video import Filming


@dataclass(frozen=True, slots=True)
class Film:
    """A film of the run.

    Attributes:
        path: The file.
        speed: Times as fast as the clock.
        view: From where it is filmed.
    """

    path: Path
    speed: float
    view: str


@dataclass(frozen=True, slots=True)
class RunOptions:
    """The user's options.

    Attributes:
        title: As the user called it.
        order: System, plant, script and database by name.
        rate: How many times as fast as the clock; None for as fast as it goes.
        most: Cycles at most; None where nobody says.
        in_step: Whether processes run each cycle together, as one process does.
        again: What to type for the same run; how it begins is to be added.
        film: Where the film of it goes; None for none.
    """

    title: str
    path: Path
    order: StageOrder
    kind: Literal["c", "python"]
    log: Path | None
    report: Path | None
    rate: float | None
    most: int | None
    quiet: bool
    again: str
    in_step: bool = False
    film: "Film | None" = None


@click.command(
    "run",
    epilog="""\b
Examples:
  rcsc run my_robot                      the system in a folder, with the script that it names
  rcsc run my_robot --script dock.csv    with other orders
  rcsc run my_robot --plant base.py      with another plant
  rcsc run my_robot --rate 1             in real time
  rcsc run make_boxt                     Fig. 7, corrected, to the end: a script of the system that is here
  rcsc run make_boxt_printed             as printed: refused at row 22
  rcsc run make_boxt --plant kinematic   without physics
  rcsc run make_boxt --log boxt.mcap     keep every cycle
  rcsc run make_boxt --report boxt.html  a page about it
  rcsc run make_boxt --video boxt.mp4 --video-speed 10   a film of it
  rcsc run make_boxt --live              in the studio's page
  rcsc run make_boxt --processes         each level in a process of its own
  rcsc run make_boxt --resume            go on from the row that stopped it""",
)
@click.argument("target", metavar="[SYSTEM|SCRIPT]", required=False)
@SYSTEM
@click.option("--script", default=None, metavar="SCRIPT",
              help="The orders: a CSV or TOML file, or the name of one beside the system or in its scripts/.")  # fmt: skip
@PLANT
@EXECUTOR
@DATABASE
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, metavar="N",
              help="Seed of the plant's random numbers; the same seed gives the same log.")  # fmt: skip
@click.option("--fault", "faults", multiple=True, metavar="NAME",
              help="A fault of the plant that is on from the first cycle (repeatable); NAME=STRENGTH where it has strengths.")  # fmt: skip
@click.option("--cycles", type=click.IntRange(min=1), default=None, metavar="N",
              help=f"How many cycles at most; without a script {UNORDERED_TICKS}, if nobody says.")  # fmt: skip
@click.option("--log", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Where the complete state of every cycle is kept (MCAP); else in .rcsc-cache beside the system.")  # fmt: skip
@click.option("--report", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Write a page about the run: its ticks, pictures, curves, lines, timing; one file that needs nothing else.")  # fmt: skip
@click.option("--video", type=click.Path(dir_okay=False, path_type=Path), default=None, metavar="FILE",
              help="Film what stands outside: FILE.mp4, FILE.gif or FILE.webp.")  # fmt: skip
@click.option("--video-speed", type=click.FloatRange(min=0.1, max=100), default=1.0, show_default=True, metavar="N",
              help="Times as fast as the clock the film goes.")  # fmt: skip
@click.option("--video-view", type=click.Choice(["corner", "front", "left", "above"]), default="corner", show_default=True,
              help="From where it is filmed.")  # fmt: skip
@click.option("--live", is_flag=True,
              help="Run it in the studio: a page for a browser on this machine, at --rate, until Ctrl-C.")  # fmt: skip
@COMPILES
@click.option("--processes", is_flag=True,
              help="Each level in a process of its own, over shared memory, nothing else changed.")  # fmt: skip
@click.option("--in-step", is_flag=True,
              help="With --processes: none begins a cycle before all have run the last; the log is that of one process.")  # fmt: skip
@click.option("--rate", type=click.FloatRange(min=0.1, max=20), default=None, metavar="N",
              help=f"Times as fast as the clock; else as fast as it goes, with --processes or --live {WATCHED_RATE:g}.")  # fmt: skip
@click.option("--from-row", type=click.IntRange(min=1), default=None, metavar="N",
              help="Begin at row N, as if the rows before were done; with --resume, those from the row that stopped.")  # fmt: skip
@click.option("--resume", "resumes", is_flag=True,
              help="Go on from the row that stopped the last run, where the plant can be put back as it stood.")  # fmt: skip
@click.option("-q", "--quiet", is_flag=True, help="Only what stops the script.")
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    target: str | None, system: Path | None, script: str | None, plant: str | None, executor: str,
    database: Path | None, seed: int, faults: tuple[str, ...], cycles: int | None, log: Path | None, report: Path | None,
    video: Path | None, video_speed: float, video_view: str, live: bool,
    compiles: bool, processes: bool, in_step: bool, rate: float | None, from_row: int | None, resumes: bool, quiet: bool,
) -> int:  # fmt: skip
    """Run SYSTEM with its plant and its script, or SCRIPT in the system that is here.

    SYSTEM is a description (system.toml) or a folder that has one. What changed is proved and compiled, then the generated
    executors run with what stands outside: a class in Python, a model for MuJoCo, or nothing. The script's rows are ordered one
    after the other, and what became of each is printed. A row that fails stops the script with its reason; the level is told
    to rest.
    """
    if processes and (resumes or live):
        raise click.UsageError("--resume and --live are of one process; with --processes, use --from-row")
    if in_step and not processes:
        raise click.UsageError("--in-step is of --processes: one process does nothing else")
    if live and (resumes or from_row or report or cycles or log or video):
        raise click.UsageError(
            "--resume, --from-row, --report, --video, --log and --cycles are of a run that no page leads; leave --live out"
        )
    filmed = _film(video, video_speed, video_view, processes=processes)
    if live:
        need("studio")
    path, named = meant(target, system, script)
    if not made(path, compiles=compiles, quiet=quiet):
        return 1
    described = description(path)
    order = StageOrder(
        str(path),
        plant or "",
        named or (str(described.script) if described.script else ""),
        str(database or ""),
        seed,
        faults,
    )
    kind: Literal["c", "python"] = "c" if executor == "c" else "python"
    if live:
        opening = Opening(
            path, kind, order.plant, order.script, seed=seed, database=order.database, faults=faults
        )
        from rcsc.desk.studio.start import Next  # of an extra

        serve(Next(opening, agreed=True), runs_at=rate or WATCHED_RATE)
        return 0
    paced = rate or (WATCHED_RATE if processes else None)
    again = _command(target, system, script, database, executor, plant)
    title = named or described.name
    asked = RunOptions(title, path, order, kind, log, report, paced, cycles, quiet, again, in_step, filmed)
    try:
        return _apart(asked, from_row) if processes else _run(asked, from_row, resumes)
    except ChildProcessError as error:
        raise Stopped(Code.PROCESS_LOST, str(error), "what levels say as they end stands above") from error


def _command(
    target: str | None,
    system: Path | None,
    script: str | None,
    database: Path | None,
    executor: str,
    plant: str | None,
) -> str:
    """Return the command for the same run; its first row is to be added."""
    words = ["rcsc", "run", *([target] if target else [])]
    words += ["--system", str(system)] if system else []
    words += ["--script", script] if script else []
    words += ["--database", str(database)] if database else []
    words += ["--executor", executor] if executor != "c" else []
    words += ["--plant", plant] if plant else []
    return shlex.join(words)


def _run(asked: RunOptions, from_row: int | None, resumes: bool) -> int:
    """Run the system in this process.

    Raises:
        CodedError: Something is not in order, and nothing has moved; or a row was not done.
        StateTableError: A level met a fault that the proofs exclude.
        Interrupted: The user, or the system, ended it.
    """
    system = description(asked.path)
    wanted = _wanted(asked)
    signs = signatures(system)
    stage = staged(asked.order, system, signs)
    running = assemble(system, asked.kind, stage.queries, standing(stage, system, signs))
    run = ScriptedRun(running, stage.operator)
    filming = _filming(running, asked.film)
    _place(run, stage.resume, from_row, resumes)
    witness = stage.witness(run) if stage.witness else RunWitness(run, stage.pictures)
    witness.film = asked.report is not None
    ending = Ending()
    with _recorded(run, asked, ending) as log:
        if asked.rate is not None:
            running.watch.append(_Pace(system.tick_ms / 1000 / asked.rate))
        running.watch.append(witness)
        try:
            with ending.inside():
                seconds = _watch(run, asked)
        except KeyboardInterrupt as error:
            raise _interrupted(run, log) from error
    if asked.report is not None:
        _write_report(asked.report, witness, log, asked, seconds)
    if filming is not None and asked.film is not None:
        _write_film(running, filming, asked.film)
    broken = _watched(wanted, log, quiet=asked.quiet)
    return _closing(witness, stage.resume, asked, seconds, log) or int(broken)


def _wanted(asked: RunOptions) -> dict[str, "tuple[Property, ...]"]:
    """Return what every run watches of this system: what is wrong there is told before anything moves."""
    from rcsc.run.log.required import requirements

    return requirements(asked.path, description(asked.path), monitored=True)


def _watched(
    wanted: Mapping[str, "tuple[Property, ...]"], log: Path, *, quiet: bool, free: bool = False
) -> bool:
    """Say how many requirements and assumptions were watched, and of each the first cycle that breaks it; return whether there is one.

    Args:
        wanted: What is watched.
        log: Of the run.
        quiet: Whether nothing is said of what is kept.
        free: Whether levels ran when they liked.
    """
    from rcsc.run.log.read import read
    from rcsc.run.log.required import BrokenRequirement, broken_in

    first: dict[tuple[str, str], BrokenRequirement] = {}
    for one in broken_in(read(log), wanted) if wanted else ():
        first.setdefault((one.level, one.name), one)
    for one in sorted(first.values(), key=lambda one: one.tick):
        say_error(Code.PROPERTY_BROKEN, _broken(one))
        attach("note", f"it says: {one.text}")
        if one.assumed:
            attach("note", "what is proved trusting it says nothing of this cycle, nor of any later one")
        elif free and not one.level:
            attach(
                "note",
                "each level ran when it liked: what is proved under any timing holds of this run, what is proved as scheduled need not",
            )
        attach("help", f'rcsc replay {shlex.quote(str(log))} --find "not {one.asked}"')
    every = Counter(
        "assumption" if one.assumed else "requirement" for stated in wanted.values() for one in stated
    )
    if every and not quiet:
        what = " and ".join(counted(many, kind) for kind, many in sorted(every.items(), reverse=True))
        click.echo(f"watched: {what}, {len(first) or 'none'} broken")
    return bool(first)


def _broken(one: "BrokenRequirement") -> str:
    if one.level:
        what = one.word if not one.assumed else "by what comes from outside, assumption"
        return f"level `{one.level}`, cycle {one.tick}: {what} `{one.name}` is broken: {one.shown}"
    by = " by what stands outside" if one.assumed else ""
    return f"cycle {one.tick}: {one.word} `{one.name}` across levels is broken{by}: {one.shown}"


def _place(run: ScriptedRun, resume: StoppedRuns | None, from_row: int | None, resumes: bool) -> None:
    """Put the run where it is to begin.

    Raises:
        BadScript: There is no such row.
        CodedError: There is nothing to go on from.
    """
    _check_row(run.operator, from_row)
    if resumes and resume is None:
        why = (
            "this plant cannot be put back as it stood"
            if run.operator
            else "no script is named to go on with"
        )
        raise Stopped(Code.NOT_RESUMED, why, "`--from-row N` begins anew at row N")
    if resume is not None and resumes:
        resume.go_on(run)
    elif resume is not None:
        resume.forget()  # what stood somewhere else begins anew
    if from_row is not None and run.operator is not None:
        run.operator.begin_at(from_row - 1)


def _check_row(operator: Operator | None, from_row: int | None) -> int:
    """Return the number of rows of the script.

    Raises:
        BadScript: It has no such row.
    """
    rows = 0 if operator is None else len(operator.rows)
    if from_row is not None and from_row > rows:
        raise BadScript(f"the script has {rows} rows, and none is {from_row}")
    return rows


# --- while it runs ---


@contextlib.contextmanager
def _recorded(run: ScriptedRun, asked: RunOptions, ending: Ending) -> Iterator[Path]:
    """Write the log, cycle by whole cycle; yield its path."""
    from rcsc.run.log.recorder import (
        Recorder,  # of an extra; a plant that needs a larger one has said so by now
    )

    path = _log_path(asked, run.system.description)
    with _writable(path):
        recorder = Recorder(run.system, path)
    run.system.watch.append(ending.whole(recorder))
    try:
        yield path
    finally:
        recorder.close()


def _log_path(asked: RunOptions, system: Description) -> Path:
    return asked.log or system.database.parent / ".rcsc-cache" / f"{system.name}.mcap"


@contextlib.contextmanager
def _writable(log: Path) -> Iterator[None]:
    """Begin a log inside, in a folder that is there then.

    Raises:
        BadDescription: It cannot be written.
    """
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise BadDescription(f"the log {log} cannot be written: {error.strerror}") from error


class _Pace:
    """Waits after each cycle until the clock has come as far."""

    def __init__(self, cycle_s: float) -> None:
        self._cycle_s, self._next = cycle_s, time.monotonic()

    def __call__(self, system: object, due: object) -> None:  # noqa: ARG002  # what all who watch are given
        self._next = max(self._next + self._cycle_s, time.monotonic() - 1.0)
        time.sleep(max(0.0, self._next - time.monotonic()))


def _watch(run: ScriptedRun, asked: RunOptions) -> float:
    """Run to the end, and print the result of each row; return the seconds taken."""
    begun = time.perf_counter()
    for result in run.steps(asked.most or (UNORDERED_TICKS if run.operator is None else MOST_TICKS)):
        if not asked.quiet:
            _say(result.row.number, result.row.text, result.state, result.reason, result.ticks)
    return time.perf_counter() - begun


def _interrupted(run: ScriptedRun, log: Path) -> Interrupted:
    """Return the end of a run that the user interrupted, as its plant, extern procedure or script took too long, or it was enough."""
    done = run.system.tick
    message = f"interrupted in cycle {done + 1}; the log holds the {done - run.first_tick} before it"
    return Interrupted(Code.SCRIPT_STOPPED, message, f"`rcsc log {shlex.quote(str(log))}` shows them")


def _say(number: int, text: str, state: str, reason: str, ticks: int) -> None:
    shown, why = (state, "") if state != "done" else (click.style("done", fg="green"), reason)
    click.echo(f"{number:3}  {text:42} {shown}  {ticks:5} cycles{f'  ({why})' if why else ''}")
    sys.stdout.flush()


# --- with processes ---


def _apart(asked: RunOptions, from_row: int | None) -> int:
    """Run the system with a process for each level."""
    from rcsc.run.log.recorder import Recorder  # noqa: F401  # of an extra: told before a process is begun

    system = description(asked.path)
    wanted = _wanted(asked)
    rows, faults = _checked_apart(asked, system, from_row)
    log = _log_path(asked, system)
    with _writable(log):
        if log.is_file() or not log.exists():
            log.touch()
    begun = time.perf_counter()
    with scratch("run") as folder:
        course = Course(asked.in_step, log, asked.most, asked.path, faults, asked.order.faults)
        ends = _rows_apart(asked, system, course, (from_row or 1) - 1, folder / "results")
    _recorded_apart(asked, system, ends, log, time.perf_counter() - begun)
    broken = _watched(wanted, log, quiet=asked.quiet, free=not asked.in_step)
    if ends and ends[-1][2] != "done":
        number, text, state, reason, _ = ends[-1]
        raise Stopped(
            Code.SCRIPT_STOPPED,
            f"row {number}, {text}: {state}: {reason}",
            f"mend the cause, then begin anew: {asked.again} --processes --from-row {number}",
        )
    if rows > len(ends) + (from_row or 1) - 1:
        row = len(ends) + (from_row or 1)
        why = f"the plant ended the run in row {row}"
        if asked.most is not None:
            why = f"row {row} did not end in {asked.most} cycles"
        raise Stopped(Code.SCRIPT_STOPPED, why)
    return int(broken)


def _recorded_apart(
    asked: RunOptions, system: Description, ends: list[list[Any]], log: Path, seconds: float
) -> None:
    """Make the report of a run in processes from its log, and say where they are."""
    if asked.report is not None:
        from rcsc.desk.studio.share.film import with_ticks
        from rcsc.run.log.read import read
        from rcsc.views.pages.log_page import drawn_first, matched

        whole = read(log)
        rows = [ReportRow(number, text, state, ticks, reason) for number, text, state, reason, ticks in ends]
        timing = [Figure("by the clock", seconds, "s")]
        story = Story(
            asked.title, rows, matched=matched(whole), timing=timing, tick_ms=system.tick_ms,
            ticks=len(whole.ticks),
        )  # fmt: skip
        _report(asked.report, with_ticks(story, whole, drawn_first(whole, system.displays)))
    if not asked.quiet:
        click.echo(_files(asked, log))


def _checked_apart(asked: RunOptions, system: Description, from_row: int | None) -> tuple[int, Strengths]:
    """Return the number of rows, and the plant's faults; report errors of plant and script before a process is begun."""
    stage: Staged = staged(asked.order, system, signatures(system))
    grades = grades_of(stage.outside)
    faults = {name: grades.get(name) for name in faults_of(stage.outside)}
    if stage.operator is None and asked.most is not None:
        return 0, faults
    if stage.operator is None:
        raise Stopped(
            Code.BAD_SCRIPT,
            "processes run until a script ends, and none is named",
            "`--script FILE` names one, `--cycles N` ends them after so many cycles",
        )
    return _check_row(stage.operator, from_row), faults


def _rows_apart(
    asked: RunOptions, system: Description, course: Course, first: int, results: Path
) -> list[list[Any]]:
    """Run the processes to the end; return each row's number, text, state, reason and ticks, which travel through `results`."""
    outside = Factory("rcsc.run.plant.staging:outside", (asked.order, str(results), first))
    queries = Factory("rcsc.run.plant.staging:queries", (asked.order,))
    rows: list[list[Any]] = []
    rate = asked.rate or WATCHED_RATE
    if not asked.quiet:
        click.echo(f"each level in a process of its own, {rate:g} times as fast as the clock")
        click.echo(
            f"`rcsc studio --attach {system.name}` shows them as they run, `rcsc shell --attach {system.name}` too"
        )

    def show(*_: Supervisor) -> None:
        new = [json_of(line) for line in content(results).decode().splitlines()[len(rows) :]]
        for number, text, state, reason, ticks in [] if asked.quiet else new:
            _say(number, text, state, reason, ticks)
        rows.extend(new)

    results.touch()
    run_processes(
        system, asked.kind, {"outside": outside}, queries=queries, rate=rate,
        course=course, watch=show,
    )  # fmt: skip
    show()
    return rows


# --- when it is over ---


def _write_report(path: Path, witness: RunWitness, log: Path, asked: RunOptions, seconds: float) -> None:
    from rcsc.desk.studio.share.film import with_ticks
    from rcsc.run.log.read import read  # of an extra, which the recorder had
    from rcsc.views.pages.log_page import drawn_first, matched

    whole = read(log)
    story = replace(witness.story(asked.title, seconds), matched=matched(whole))
    drawn = witness.drawn or drawn_first(whole, witness.run.system.description.displays)
    _report(path, with_ticks(story, whole, drawn))


def _film(path: Path | None, speed: float, view: str, *, processes: bool) -> Film | None:
    """Return what film is asked for, where one is.

    Raises:
        UsageError: Nobody writes such a file, or the run is one that is not filmed.
        Stopped: A package is not installed.
    """
    if path is None:
        return None
    if path.suffix not in (forms := (".mp4", ".gif", ".webp")):
        raise click.UsageError(f"--video writes {', '.join(forms)}, and not `{path.name}`")
    if processes:
        raise click.UsageError("--video films a run in one process; leave --processes out")
    need("video")
    return Film(path, speed, view)


def _filming(system: "System", film: Film | None) -> "Filming | None":
    """Begin to keep what a film needs.

    Raises:
        Stopped: Nothing stands outside that can be seen.
    """
    if film is None:
        return None
    from rcsc.run.plant.space import space_of
    from rcsc.views.pages.video import Filming

    if space_of(system.outside) is None:
        raise Stopped(
            Code.NO_FILM,
            "nothing that stands outside says how it looks in space",
            "a plant has a method `space`, or is a model for MuJoCo",
        )
    filming = Filming(film.speed)
    system.watch.append(filming)
    return filming


def _write_film(system: "System", filming: "Filming", film: Film) -> None:
    """Photograph what was kept.

    Raises:
        Stopped: Nothing draws here, or the file cannot be written.
    """
    from rcsc.run.plant.models.camera import NoPictureError
    from rcsc.run.plant.space import space_of
    from rcsc.views.pages.video import write

    space = space_of(system.outside)
    if space is None or not filming.frames:
        return
    try:
        write(film.path, filming.frames, space, film.view)
    except NoPictureError as error:
        raise Stopped(Code.NO_FILM, f"no film: {error}") from error
    except OSError as error:
        raise BadDescription(f"the film {film.path} cannot be written: {error.strerror}") from error


def _report(path: Path, story: Story) -> None:
    try:
        report(path, story)
    except OSError as error:
        raise BadDescription(f"the report {path} cannot be written: {error.strerror}") from error


def _files(asked: RunOptions, log: Path) -> str:
    here = log.relative_to(Path.cwd()) if log.is_relative_to(Path.cwd()) else log
    return (
        f"log: {here}"
        + (f"; report: {asked.report}" if asked.report else "")
        + (f"; film: {asked.film.path}" if asked.film else "")
    )


def _closing(
    witness: RunWitness, resume: StoppedRuns | None, asked: RunOptions, seconds: float, log: Path
) -> int:
    run = witness.run
    again = _kept(run, resume, asked)
    if not asked.quiet:
        for line in (*witness.closing(), *_unconnected(run), _figures(run, seconds)):
            click.echo(line)
        click.echo(_files(asked, log))
    operator = run.operator
    if operator is None:
        return 0
    end = operator.stopped
    if end is not None:
        word = "refused" if end.state == "refused" else "failed"
        raise Stopped(
            Code.SCRIPT_STOPPED, f"row {end.row.number}, {end.row.text}: {word}: {end.reason}", again
        )
    if not operator.over:
        raise Stopped(
            Code.SCRIPT_STOPPED,
            f"row {operator.at + 1} did not end in {run.system.tick - run.first_tick} cycles",
        )
    return 0


def _unconnected(run: ScriptedRun) -> Iterator[str]:
    """Yield the inputs that nobody filled and the outputs that nobody takes: a newcomer may have forgotten a buffer, plant or script."""
    system = run.system.description
    levels = {level.name: level.sign for level in run.system.levels}
    silent = [
        wire.target
        for wire in system.wires
        if wire.source.partition(".")[0] not in levels and run.system.buffers.latest(wire.source) is None
    ]
    missing = [*silent, *system.unfilled(_named(levels, "input"))]
    if missing:
        yield f"nobody filled {', '.join(f'`{name}`' for name in missing)}: these inputs stayed as at first"
    idle = system.untaken(_named(levels, "output"))
    if idle:
        yield f"no buffer takes {', '.join(f'`{name}`' for name in idle)}"


def _named(levels: Mapping[str, Signature], kind: str) -> list[str]:
    return [f"{name}.{variable}" for name, sign in levels.items() for variable in sign.variables(kind)]


def _figures(run: ScriptedRun, seconds: float) -> str:
    """Return the figures of a run: cycles, times, failed assumptions."""
    system = run.system
    ticks = system.tick - run.first_tick
    control_s = ticks * system.description.tick_ms / 1000
    failed = sum(1 for level in system.levels if level.values[-1])
    return (
        f"{ticks} cycles, {control_s:.1f} s of control time in {seconds:.2f} s: {control_s / max(seconds, 1e-9):.0f} times "
        f"as fast as the clock; {failed} assumptions failed"
    )


def _kept(run: ScriptedRun, resume: StoppedRuns | None, asked: RunOptions) -> str:
    """Keep a run that stopped, or forget one that ended; return the advice about it."""
    operator = run.operator
    if operator is None:
        return ""
    if operator.stopped is None:
        if operator.over and resume is not None:
            resume.forget()
        return ""
    row = f"{asked.again} --from-row {operator.at + 1}"
    if resume is None:
        return f"mend the cause, then begin anew: {row}"
    try:
        resume.keep(run, asked.title)
    except (OSError, NotKept) as error:
        why = error.strerror if isinstance(error, OSError) else error
        return f"where it stopped could not be kept: {why}; mend the cause, then begin anew: {row}"
    return f"its level rests; mend the cause, then: {asked.again} --resume"
