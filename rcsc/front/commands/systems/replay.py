"""`rcsc replay`: whether a recorded run would do it again."""

import contextlib
from pathlib import Path

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.front.commands.shared.logs import FILE, SHOWN, refuse, told
from rcsc.front.commands.shared.systems import SYSTEM, NoSystem, as_they_lie, fresh, system_path
from rcsc.run.adopt import Begun
from rcsc.run.description import BadDescription, description
from rcsc.run.log.queries import predicate
from rcsc.run.log.read import Log, read
from rcsc.run.log.replay import Replay, ReplayedCycle, ReplayMoment, find
from rcsc.run.log.required import kept_columns, requirements
from rcsc.run.log.states import TRACED, begun_in_words, fault_in_words, witness_in_words, words


@click.command(
    "replay",
    epilog="""\b
Examples:
  rcsc replay run.mcap                          every cycle leaves what it left
  rcsc replay run.mcap --system my_robot        of a system that is not here
  rcsc replay run.mcap --executor python        with the Python executors
  rcsc replay run.mcap --generated edited       what would other tables have done?
  rcsc replay run.mcap --at 120 --show task     one cycle, and a level's whole state
  rcsc replay run.mcap --find "task.cur_state = state_3 and not task.idle"
  rcsc replay run.mcap --find "not task.answered"   the cycle that breaks a requirement""",
)
@FILE
@click.option("--executor", type=click.Choice(["c", "python"]), default="c", show_default=True,
              help="What runs the levels.")  # fmt: skip
@SYSTEM
@click.option("--generated", type=click.Path(file_okay=False, path_type=Path), default=None, metavar="FOLDER",
              help="The executors, run as they lie there; else the system's, where they are what its tables give. Another folder than the "
              "run's own asks what its tables would have done.")  # fmt: skip
@click.option("--at", type=int, default=None, metavar="CYCLE", help="Run this cycle alone, and show it.")
@click.option("--find", "find_", default=None, metavar="EXPR",
              help="Go to the first cycle, from --at on, in which EXPR holds, and show it.")  # fmt: skip
@click.option("--show", "level", default=None, metavar="LEVEL", help="Show this level's whole state, too.")
@told
def command(
    *, file: Path, executor: str, system: Path | None, generated: Path | None, at: int | None, find_: str | None, level: str | None,
) -> int:  # fmt: skip
    """Run the run recorded in FILE again, each cycle from the recorded state with the recorded inputs.

    Every leaf must be what it was, bit for bit; the first that is not is named. A log that is not whole is replayed as far as it goes,
    and the exit status is 1.
    """
    log = read(file)
    tick = _wanted(log, at, find_, _system_of(log, file) if system is None else system_path(system))
    if level is not None and level not in {logged.name for logged in log.levels}:
        raise click.BadParameter(f"there is no level `{level}` in this log", param_hint="--show")
    folder = _executors_of(log, file, system) if generated is None else generated
    if folder is None:
        return 1
    if generated is not None:
        as_they_lie(folder)
    again = Replay(log, folder, "python" if executor == "python" else "c")
    if tick == 0:
        click.echo(f"`{find_}` holds in no cycle")
        return 1
    moment = again.first_difference() if tick is None else again.go(tick)
    if moment is not None and (tick is not None or level is not None):
        _show_moment(again, moment, level)
    if moment is not None and moment.differs:
        return _differs(file, again, moment)
    if tick is None:
        lacking, unlogged = again.lacking, again.unlogged
        of = " that these tables have" if lacking else " that the log has" if unlogged else ""
        other = "" if again.unchanged else ", by other executors than ran then"
        click.echo(f"{len(log.ticks)} ticks replayed{other}: nothing{of} differs; {log.checked.text}")
        for where, names in (("these tables", lacking), ("the log", unlogged)):
            if names:
                more = f", and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
                click.echo(f"not in {where}, and so not compared: {', '.join(names[:SHOWN])}{more}")
    if not log.complete:
        return refuse(file, Code.LOG_NOT_WHOLE, f"the log is {log.checked.text}")
    return 0


def _executors_of(log: Log, file: Path, system: Path | None) -> Path | None:
    """Return the generated folder of the log's system; None where it differs from what its tables give, which is shown."""
    path = _system_of(log, file) if system is None else system_path(system)
    if path is None:
        as_they_lie(Path("generated"))
        return Path("generated")
    return description(path).generated if fresh(path) else None


def _system_of(log: Log, file: Path) -> Path | None:
    """Return the description of the log's system, here or where the log lies; None where there is none."""
    for folder in (Path(), file.parent, file.parent.parent):
        with contextlib.suppress(NoSystem, BadDescription):
            path = system_path(folder)
            if description(path).name == log.facts["name"]:
                return path
    return None


def _wanted(log: Log, at: int | None, find_: str | None, system: Path | None) -> int | None:
    """Return the tick to show; None for all, 0 where no tick fits. What is looked for may name requirements of the system's tables."""
    if at is not None and at not in log.ticks:
        raise click.BadParameter(f"the log holds cycles {log.first + 1} to {log.last}", param_hint="--at")
    if find_ is None:
        return at
    wanted = {} if system is None else requirements(system, description(system), monitored=False)
    columns, values = kept_columns(log, wanted)
    return find(log, predicate(find_, log.levels, columns), at, values) or 0


def _show_moment(again: Replay, moment: ReplayMoment, level: str | None) -> None:
    click.echo(f"cycle {moment.tick}, {moment.tick * again.log.tick_ms} ms")
    for cycle in moment.cycles:
        if cycle.restarted is not None:
            again_ = "goes on" if cycle.restarted is Begun.HAND else "started again,"
            click.echo(f"  {cycle.level}: {again_} {begun_in_words(cycle.restarted)}")
        logged = again.log.level(cycle.level)
        fault = fault_in_words(logged.sign, logged.level, cycle.recorded)
        click.echo(f"  {cycle.level}: {fault or cycle.line_then}")
        if saw := witness_in_words(logged.sign, logged.level, cycle.recorded):
            click.echo(f"    {saw}")
        if cycle.level == level:
            for name, value in words(logged.sign, logged.level, cycle.recorded).items():
                click.echo(f"    {name} = {value}")


def _differs(file: Path, again: Replay, moment: ReplayMoment) -> int:
    first = next(cycle for cycle in moment.cycles if cycle.differences)
    leaf = next((one for one in first.differences if one.name not in TRACED), first.differences[0])
    difference = f"`{leaf.name}` was `{leaf.then}` and is `{leaf.now}`"
    where = f"cycle {moment.tick}, level `{first.level}`"
    notes = tuple(note for cycle in moment.cycles if cycle.differences for note in _notes(cycle))
    if again.unchanged:
        return refuse(file, Code.REPLAY_DIFFERS, f"the replay differs in {where}: {difference}", notes=notes)
    message = f"these tables decide otherwise in {where}: {difference}"
    return refuse(file, Code.TABLES_DECIDE_OTHERWISE, message, notes=notes)


def _notes(cycle: ReplayedCycle) -> tuple[str, ...]:
    lines = f"{cycle.level}: {cycle.line_then} matched then, {cycle.line_now} now"
    shown = [
        f"{cycle.level}.{difference.name}: {difference.then} then, {difference.now} now"
        for difference in cycle.differences[:SHOWN]
    ]
    more = len(cycle.differences) - SHOWN
    return (lines, *shown, *([f"and {more} more of {cycle.level}'s"] if more > 0 else []))
