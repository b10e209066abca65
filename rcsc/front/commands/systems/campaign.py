"""`rcsc campaign`: many episodes of a system, with whatever can go wrong in them."""

import json
import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar, get_args

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.cache import open_cache
from rcsc.front.commands.shared.extras import need
from rcsc.front.commands.shared.options import cores
from rcsc.front.commands.shared.paths import There
from rcsc.front.commands.shared.show import Progress, put, writing
from rcsc.front.commands.shared.stopped import attach, say_error
from rcsc.front.commands.shared.systems import COMPILES, SYSTEM, made, meant, system_path
from rcsc.front.commands.shared.took import Clock, doing
from rcsc.run.campaign.choose import kind_of, plant_name, plant_of
from rcsc.run.campaign.counterexamples import (
    MOST,
    again,
    choices,
    counterexamples,
    is_saved,
    save,
    saved_episode,
)
from rcsc.run.campaign.journal import EpisodeRecord, Journal, header, journal_path
from rcsc.run.campaign.rig import EpisodeValue, Rig, known_lines
from rcsc.run.campaign.runner import campaign as play
from rcsc.run.campaign.summary import Watched, as_json, as_text, summary, watched, watched_json, watched_text
from rcsc.run.campaign.work import Shrunk
from rcsc.run.campaign.worker_pool import WorkerPool, cluster, processes
from rcsc.run.description import description
from rcsc.run.episodes.outcome import EpisodeFinding
from rcsc.run.episodes.proved.claims import Claims
from rcsc.run.episodes.stand import stand
from rcsc.run.system import Kind

T = TypeVar("T")
_TO = click.Path(dir_okay=False, path_type=Path)
_TERMINAL_S, _PLAIN_S = 1.0, 10.0
"""How often a line of progress is said: on a terminal over the last one, elsewhere below it."""


@click.command(
    "campaign",
    epilog="""\b
Examples:
  rcsc campaign my_robot                         200 episodes of the system in a folder; again: goes on, or adds
  rcsc campaign my_robot --plant mujoco          with another plant
  rcsc campaign my_robot --again campaign/0-12-docked-at-rest  a saved counterexample: does it still fail?
  rcsc campaign --episodes 1000 --seed 7         of the system that is here
  rcsc campaign --scheduler tcp://head:8786      on a dask.distributed cluster (extra `cluster`)

\b
Exit status: 0 every property held, 1 one did not, 2 usage, 3 a bug in rcsc.""",
)
@click.argument("target", metavar="[SYSTEM]", required=False, type=There(path_type=Path))
@SYSTEM
@click.option("--plant", "--backend", "plant", default=None, metavar="PLANT",
              help="What stands outside: a file FILE.py or FILE.py:CLASS, or a plant's name in the description; "
                   "else the one that is `by_hand`, or the first. With --again the episode's own runs.")  # fmt: skip
@click.option("--script", default=None, metavar="SCRIPT",
              help="The orders: a CSV or TOML file, or the name of one beside the system or in its scripts/.")  # fmt: skip
@click.option("--episodes", type=click.IntRange(min=1), default=200, show_default=True, metavar="N",
              help="How many, those of the journal included.")  # fmt: skip
@click.option("--workers", type=click.IntRange(min=1), default=None, metavar="K",
              help="Processes here; one a processor when nobody says. The outcomes are the same with any number.")  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True, metavar="S", help="Which episodes.")
@click.option("--executor", type=click.Choice(get_args(Kind)), default=None,
              help="Which of the generated executors run, both side by side with `both`; c when nobody says, and with --again the "
                   "episode's own.")  # fmt: skip
@click.option("--journal", type=_TO, default=None, metavar="FILE",
              help="Where each episode's outcome is kept; else in .rcsc-cache beside the system, by seed and tables.")  # fmt: skip
@click.option("--save", type=click.Path(file_okay=False, path_type=Path), default=Path("campaign"), show_default=True,
              metavar="DIR", help="Where counterexamples go.")  # fmt: skip
@click.option(
    "--json", "json_", type=_TO, default=None, metavar="FILE", help="Write the summary to FILE, too."
)
@click.option("--limit", "limit_s", type=click.FloatRange(min=0, min_open=True), default=120.0, show_default=True,
              metavar="SECONDS", help="Most seconds of an episode: one that takes longer counts as hung.")  # fmt: skip
@click.option("--scheduler", default=None, metavar="ADDRESS",
              help="Play on the workers of this dask.distributed scheduler; they have the same rcsc and tables.")  # fmt: skip
@click.option("--again", type=There(path_type=Path), default=None, metavar="FILE",
              help="Run a saved episode, and nothing else; 1 if a property does not hold.")  # fmt: skip
@COMPILES
@click.option("--claims/--no-claims", "claims", default=True, show_default=True,
              help="Watch each claim that `rcsc prove` calls proved of the levels; proves them where that was not done.")  # fmt: skip
def command(  # noqa: PLR0913, PLR0917  # as many as there are options
    target: Path | None, system: Path | None, plant: str | None, script: str | None, episodes: int, workers: int | None,
    seed: int, executor: Kind | None, journal: Path | None, save: Path, json_: Path | None, limit_s: float,
    scheduler: str | None, again: Path | None, compiles: bool, claims: bool,
) -> int:  # fmt: skip
    """Run episodes of SYSTEM: orders, lost buffers, restarts and faults of its plant by seed, with every property watching.

    SYSTEM is a description (system.toml) or a folder that has one; without it, the system that is here. Each outcome goes into a
    journal at once, so that a campaign killed at any moment goes on where it was. Where a property does not hold, the episode
    is made as small as it gets and saved with its script and its log. An episode that takes its process with it, or does not end,
    is a finding like any other. Where there is no plant, what comes from outside moves in its declared ranges, and whoever is
    ordered outside obeys. What was proved of the levels is watched, too: a claim that breaks is a mistake of rcsc's.
    """
    if scheduler is not None and workers is not None:
        raise click.UsageError("--workers are processes here; with --scheduler the cluster's are taken")
    if target is not None and system is not None:
        raise click.UsageError(f"`{target}` is a system, and `--system` names another")
    path, named = meant(None, system_path(target or system), script)
    rig = _rig(path, plant, executor, named, limit_s)
    clock = Clock(open_cache(path.resolve().parent), path)
    if not made(path, compiles=compiles, quiet=True, doing=doing(clock, "proving and compiling the tables")):
        return 1
    with doing(clock, "proving what is watched of the levels"):
        rig = replace(rig, claims=_claims(rig, wanted=claims, compiles=compiles))
    shown = ["--system", str(target or system)] if target or system else []
    plays = [*([str(target)] if target else shown), *(["--plant", plant] if plant else []), "--again"]
    asked = CampaignOptions(
        rig, shlex.join(["rcsc", "campaign", *plays]), shlex.join(["rcsc", "replay", *shown]), save, json_
    )
    if again is not None:
        return _again(again, rig, executor)
    pool = processes(workers or cores()) if scheduler is None else cluster(scheduler)
    place = journal or journal_path(rig, seed, path.resolve().parent / ".rcsc-cache")
    with writing(place):
        kept = Journal(place, header(rig, seed))
    return _campaign(asked, seed, episodes, pool, kept)


@dataclass(frozen=True, slots=True)
class CampaignOptions:
    """The user's options.

    Attributes:
        again: What to type to see an episode again; its file is to be added.
        replays: What to type to replay a log; its file is to be added.
        folder: Where counterexamples go.
        json: Where the summary goes, too.
    """

    rig: Rig[Any]
    again: str
    replays: str
    folder: Path
    json: Path | None


def _rig(path: Path, plant: str | None, executor: Kind | None, script: str, limit_s: float) -> Rig[Any]:
    """Return the rig on which episodes are played.

    Raises:
        BadDescription, BadPlant: The system is not in order, or has no such plant.
        Stopped: Its episodes need an extra that is not installed.
        click.UsageError: Its episodes take no script.
    """
    system = description(path)
    spec = plant_of(system, plant)
    kind = kind_of(system, spec)
    need("cell" if spec is not None and spec.model is not None else kind.extra)
    if script and not kind.takes_script:
        raise click.UsageError("the episodes of this plant have scripts of their own, and take none")
    return Rig(kind, path.resolve(), plant_name(spec), executor or "c", script, limit_s)


def _claims(rig: Rig[Any], *, wanted: bool, compiles: bool) -> Claims:
    """Return the proved claims about the levels."""
    if not wanted:
        return Claims(why="--no-claims leaves them out")
    if not compiles:
        return Claims(why="--no-compile leaves executors that need not be those of what was proved")
    from rcsc.driver.watched import claims_of  # proves

    return claims_of(rig.system, open_cache(rig.system.parent))


def _campaign(  # as many as there are options
    asked: CampaignOptions,
    seed: int,
    episodes: int,
    hired: AbstractContextManager[WorkerPool],
    journal: Journal,
) -> int:
    """Play, sum up, and save counterexamples."""
    with journal, hired as pool:
        progress = _EpisodeProgress(
            episodes, [episode_record for at, episode_record in journal.records.items() if at < episodes]
        )
        try:
            for new in play(asked.rig, seed, episodes, pool, journal):
                progress(new)
        except KeyboardInterrupt:
            progress.end()
            click.echo(
                f"{len(journal.records)} episodes are kept in {journal.path}: the same command goes on",
                err=True,
            )
            raise
        progress.end()
        records = [record for index, record in sorted(journal.records.items()) if index < episodes]
        _sum_up(asked, records, progress)
        click.echo(f"journal: {journal.path}")
        _save(asked, seed, records, pool)
    return 1 if any(record.findings for record in records) else 0


class _EpisodeProgress:
    """Shows progress, now and then, on standard error."""

    def __init__(self, wanted: int, known: list[EpisodeRecord]) -> None:
        self._wanted, self._known, self._done = wanted, len(known), len(known)
        self._findings = sum(bool(episode_record.findings) for episode_record in known)
        self._progress = Progress()
        self._terminal = sys.stderr.isatty()
        self._begun = self._last = time.monotonic()
        self.cycles = 0

    @property
    def here(self) -> int:
        """Episodes played by this command."""
        return self._done - self._known

    @property
    def seconds(self) -> float:
        """Seconds since the campaign began or went on."""
        return time.monotonic() - self._begun

    def __call__(self, records: tuple[EpisodeRecord, ...]) -> None:
        """Count the records that came in."""
        self._done += len(records)
        self._findings += sum(bool(record.findings) for record in records)
        self.cycles += sum(record.ticks for record in records)
        now = time.monotonic()
        if now - self._last >= (_TERMINAL_S if self._terminal else _PLAIN_S):
            self._last = now
            if self._terminal:
                self._progress(self._line())
            else:
                click.echo(self._line(), err=True)

    def _line(self) -> str:
        rate = self.here / max(self.seconds, 1e-9)
        left = f", {_clock((self._wanted - self._done) / rate)} left" if rate else ""
        return f"{self._done} of {self._wanted} episodes, {rate:.1f} a second{left}, {self._findings} with findings"

    def end(self) -> None:
        """Clear the line of a terminal."""
        self._progress("")


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def _sum_up(asked: CampaignOptions, records: list[EpisodeRecord], progress: _EpisodeProgress) -> None:
    rig = asked.rig
    figures = summary(records, known_lines(rig.system), rig.kind.faults(rig.system, rig.plant))
    seconds = max(progress.seconds, 1e-9)
    of = watched(rig.claims, stand(rig.system)) if rig.claims.levels else Watched({}, (), {}, rig.claims.why)
    click.echo(as_text(figures))
    click.echo("\n".join((*watched_text(of), "")))
    click.echo(
        f"{figures.episodes} episodes, {figures.cycles} cycles, {figures.with_findings} with findings; "
        f"{progress.here} played now in {_clock(seconds)}: {progress.here / seconds:.1f} a second, {progress.cycles / seconds:.0f} cycles"
    )
    if asked.json is None:
        return
    clock = {
        "played_now": progress.here,
        "seconds": round(seconds, 3),
        "episodes_a_second": progress.here / seconds,
    }
    put(json.dumps(as_json(figures) | {"claims": watched_json(of)} | clock, indent=1) + "\n", asked.json)
    click.echo(f"wrote {asked.json}")


def _save(asked: CampaignOptions, seed: int, records: list[EpisodeRecord], pool: WorkerPool) -> None:
    """Shrink and save what is not saved already, and print the commands to see it again."""
    rig, folder = asked.rig, asked.folder
    chosen = choices(records)
    wanted = [choice for choice in chosen[:MOST] if not is_saved(folder, rig, seed, choice)]
    for choice in chosen[:MOST]:
        if choice not in wanted:
            place = folder / choice.name(seed)
            click.echo(f"saved before: {place}: {asked.again} {shlex.quote(str(place))}")
    shown: dict[tuple[str, EpisodeValue | tuple[str, ...]], Path] = {}
    for choice, counterexample in _named(counterexamples(rig, seed, wanted, pool), len(wanted)):
        with writing(folder / choice.name(seed)):
            place = save(folder, rig, seed, choice, counterexample)
        what = rig.kind.told(counterexample.episode) or counterexample.episode
        first = shown.setdefault((choice.property, what), place)
        if first != place:
            click.echo(
                f"episode {choice.index} comes to the same: {asked.again} {shlex.quote(str(first))}", err=True
            )
            continue
        _show(asked, choice.index, counterexample, place)
    if len(chosen) > MOST:
        click.echo(f"and {len(chosen) - MOST} more kinds of findings, in the journal")


def _named(found: Iterator[T], many: int) -> Iterator[T]:
    """Yield findings, and name on a terminal which of so many is being made small."""
    line = Progress()
    for at in range(1, many + 1):
        line(f"making finding {at} of {many} as small as it gets")
        one = next(found, None)
        line("")
        if one is None:
            return
        yield one


def _show(asked: CampaignOptions, index: int, counterexample: Shrunk[Any], place: Path) -> None:
    """Print a counterexample's finding, and the command to see it again."""
    finding, happens = counterexample.finding, asked.rig.kind.told(counterexample.episode)
    _tell(f"episode {index}", finding, happens)
    if counterexample.log:
        attach("help", f"{asked.replays} {shlex.quote(str(place / 'log.mcap'))}")
    attach("help", f"{asked.again} {shlex.quote(str(place))}")


def _tell(where: str, finding: EpisodeFinding, happens: Sequence[str]) -> None:
    """Print what does not hold, and the events of the episode that shows it."""
    say_error(
        Code.PROPERTY_BROKEN,
        f"{where}, cycle {finding.tick}: `{finding.property}` does not hold: {finding.message}",
    )
    for line in happens:
        attach("note", line)


def _again(path: Path, rig: Rig[Any], executor: Kind | None) -> int:
    """Run a saved episode, in a process of its own: it may take that with it."""
    with processes(1) as pool:
        outcome = again(path, rig, executor, pool)
    happens = rig.kind.told(saved_episode(path, rig)) if outcome.findings else ()
    for number, text, state, reason, ticks in outcome.rows:
        click.echo(f"{number:3}  {text:44} {state:8} {ticks:4} cycles{f'  {reason}' if reason else ''}")
    click.echo(f"{outcome.end} after {outcome.ticks} cycles")
    for excused in outcome.excused:
        click.echo(
            f"cycle {excused.tick}: `{excused.property}` does not hold: {excused.message}: {excused.because}"
        )
    for finding in outcome.findings:
        _tell(str(path), finding, happens)
    return 1 if outcome.findings else 0
