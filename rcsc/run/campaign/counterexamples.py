"""Counterexamples: chosen from a campaign's findings, shrunk by its workers, saved as files, and run again.

In: records. Out: for each a folder with `episode.json`, `script.csv`, `log.mcap` and `finding.json`.
"""

import json
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.children import scratch
from rcsc.base.host.files import write_atomically
from rcsc.base.host.files.read import json_of, text
from rcsc.run.campaign.journal import EpisodeRecord
from rcsc.run.campaign.rig import E, Rig, digest
from rcsc.run.campaign.runner import death
from rcsc.run.campaign.shrink import MOST_TRIES, shrink
from rcsc.run.campaign.work import SURVIVES, TRIES, Shrunk, attempt, counterexample, dated, logged, shrunk
from rcsc.run.campaign.worker_pool import Crashed, WorkerPool
from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc.run.system import Kind

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

MOST = 20
"""Counterexamples that are made of one campaign; the others stay in its journal."""


MOST_CHARACTERS = 120
"""Of a property, in the name of a folder."""


class BadEpisode(CodedError):  # noqa: N818  # what happened, not an error of ours
    """The file holds no episode; says why."""

    code = Code.BAD_EPISODE


@dataclass(frozen=True, slots=True)
class Choice:
    """A finding to make a counterexample of: an episode's number, its faults, and the property."""

    index: int
    faults: tuple[str, ...]
    property: str

    def name(self, seed: int) -> str:
        """Of its folder."""
        return f"{seed}-{self.index}-{folder_word(self.property)}"


def folder_word(property_: str) -> str:
    """Return a property as a part of a folder's name."""
    return re.sub("[^a-z0-9]+", "-", property_.lower()).strip("-")[:MOST_CHARACTERS]


def choices(records: Iterable[EpisodeRecord]) -> tuple[Choice, ...]:
    """Choose the first episode for each property and set of faults: others would likely shrink to the same.

    All episodes of several faults count as one set. Fewer faults come first, as they say more.
    """
    chosen: dict[tuple[str, tuple[str, ...]], Choice] = {}
    for record in sorted(records, key=lambda record: record.index):
        for finding in record.findings:
            kind = record.faults if len(record.faults) < 2 else ("several",)
            choice = Choice(record.index, record.faults, finding.property)
            chosen.setdefault((finding.property, kind), choice)
    return tuple(
        sorted(
            chosen.values(), key=lambda choice: (min(len(choice.faults), 2), choice.index, choice.property)
        )
    )


def counterexamples(
    rig: Rig[E], seed: int, wanted: Sequence[Choice], pool: WorkerPool
) -> Iterator[tuple[Choice, Shrunk[E]]]:
    """Shrink all at once, each in a worker; what kills its worker, one try a task.

    Raises:
        WorkersGone: No workers remain.
        OtherTables: A worker is of another checkout.
    """
    careful = [choice for choice in wanted if choice.property == SURVIVES]
    flying: dict[Choice, tuple[Future[Shrunk[E]], Executor]] = {}
    for choice in wanted:
        if choice.property != SURVIVES:
            future = pool.submit(shrunk, rig, digest(rig), seed, choice.index, choice.property)
            flying[choice] = future, pool.executor
    for choice, (future, executor) in flying.items():
        try:
            yield choice, future.result()
        except pool.deaths as died:
            pool.survive(died, executor)
            careful.append(choice)
    for choice in careful:
        yield choice, _carefully(rig, seed, choice, pool)


def _carefully(rig: Rig[E], seed: int, choice: Choice, pool: WorkerPool) -> Shrunk[E]:
    """Shrink from this process: a worker may die of each try."""

    def fails(episode: E) -> bool:
        return any(finding.property == choice.property for finding in _survived(rig, episode, pool).findings)

    tries = TRIES.get(choice.property, MOST_TRIES)
    least = shrink(rig.episode(seed, choice.index), fails, tries)
    with scratch("campaign") as folder:
        log = folder / "log.mcap"
        try:
            return pool.call(logged, rig, least, choice.property, log)
        except Crashed:
            return counterexample(least, _survived(rig, least, pool), choice.property, log)


def _survived(rig: Rig[E], episode: E, pool: WorkerPool, log: Path | None = None) -> EpisodeOutcome:
    begun_s = time.monotonic()
    try:
        return pool.call(attempt, rig, episode, log)
    except Crashed:
        return death(rig, time.monotonic() - begun_s)


# --- as files ---


def save(folder: Path, rig: Rig[E], seed: int, choice: Choice, shrunk: Shrunk[E]) -> Path:
    """Write a counterexample and return its folder.

    Raises:
        OSError: It cannot be written.
    """
    place = folder / choice.name(seed)
    place.mkdir(parents=True, exist_ok=True)
    facts = _origin(rig, seed, choice) | {
        "tick": shrunk.finding.tick,
        "said": shrunk.finding.message,
        "faults": list(choice.faults),
    }
    if told := rig.kind.told(shrunk.episode):
        facts["happens"] = list(told)
    write_atomically(place / "episode.json", shrunk.episode.to_json().encode())
    write_atomically(place / "script.csv", shrunk.episode.script().encode())
    if shrunk.log:
        write_atomically(place / "log.mcap", shrunk.log)
    else:
        (place / "log.mcap").unlink(missing_ok=True)  # of another time
    write_atomically(place / "finding.json", (json.dumps(facts, indent=1) + "\n").encode())
    return place


def is_saved(folder: Path, rig: Rig[Any], seed: int, choice: Choice) -> bool:
    """Return whether the folder has this counterexample of these tables; `finding.json` is written last."""
    try:
        facts = json_of(text(folder / choice.name(seed) / "finding.json"))
        return bool(facts | _origin(rig, seed, choice) == facts)
    except (OSError, ValueError, TypeError):
        return False


def _origin(rig: Rig[Any], seed: int, choice: Choice) -> dict[str, Any]:
    return {
        "property": choice.property,
        "seed": seed,
        "index": choice.index,
        "plant": rig.plant,
        "executor": rig.executor,
        "digest": digest(rig),
    }


def saved_episode(path: Path, rig: Rig[E]) -> E:
    """Return the episode in a file, or in a counterexample's folder, if it is one of this system.

    Raises:
        BadEpisode: There is none.
    """
    file = path / "episode.json" if path.is_dir() else path
    try:
        return rig.kind.admit(rig.kind.read(text(file)), rig.system, rig.plant)
    except OSError as error:
        raise BadEpisode(f"{file} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise BadEpisode(f"{file}: {error}") from error


def again(
    path: Path, rig: Rig[E], executor: Kind | None = None, pool: WorkerPool | None = None
) -> EpisodeOutcome:
    """Run a saved episode; what it raises is a finding, too. A regression case has none.

    Args:
        path: Its file or folder.
        rig: System, limit and what runs; the plant is the episode's own.
        executor: Instead of the episode's.
        pool: Where to run it, so that its death is a finding; None for this process.

    Raises:
        BadEpisode: The file holds none.
        CodedError: The system is not in order.
    """
    episode = saved_episode(path, rig)
    if executor is not None:
        episode = replace(episode, executor=executor)
    if pool is None:
        return attempt(rig, episode)
    with scratch("campaign") as folder:
        log = folder / "log.mcap"
        outcome = _survived(rig, episode, pool, log)
        return replace(outcome, findings=tuple(dated(finding, log) for finding in outcome.findings))
