"""The runner: gives chunks of episodes to a worker pool, keeps what comes back in the journal, and survives workers that do not.

In: how many episodes, a worker pool, a journal. Out: records as they come. When a worker dies, whatever was under way is suspected, and is
played again alone: whole chunks first, then, one by one, the episodes of a chunk that kills again. An episode
that kills a worker by itself is recorded as `crash`, or as `hang` if it was ended for that.
"""

import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from typing import Any, TypeAlias

from rcsc.run.campaign.journal import EpisodeRecord, Journal
from rcsc.run.campaign.rig import Rig, digest
from rcsc.run.campaign.work import CRASH, ENDS, GRACE, HANG, SURVIVES, no_end, odd, play
from rcsc.run.campaign.worker_pool import WorkerPool, WorkersGone
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome

Chunk: TypeAlias = tuple[int, ...]
Records: TypeAlias = tuple[EpisodeRecord, ...]

_AHEAD = 2
"""Chunks that wait for each worker, so that none waits for a chunk."""


def campaign(
    rig: Rig[Any], seed: int, episodes: int, pool: WorkerPool, journal: Journal, poll_s: float = 0.5
) -> Iterator[Records]:
    """Play the episodes below `episodes` that the journal lacks; yield, at least every `poll_s`, what came in.

    Raises:
        WorkersGone: Nobody is left to play.
        OtherTables: A worker is of another checkout.
        CodedError: The system is not in order.
        OSError: The journal cannot be written.
    """
    todo = [index for index in range(episodes) if index not in journal.records]
    size = min(rig.kind.chunk(rig.system, rig.plant), max(1, len(todo) // (4 * pool.workers)))
    chunks = deque(tuple(todo[at : at + size]) for at in range(0, len(todo), size))
    round_ = _Round(rig, seed, pool, chunks)
    try:
        while round_.busy:
            records = round_.step(poll_s)
            journal.add(records)
            yield records
    except CancelledError as error:
        raise WorkersGone("the workers were lost") from error
    finally:
        for future in round_.flying:
            future.cancel()


class _Round:
    """Chunks that wait, that are suspected, and that fly."""

    def __init__(self, rig: Rig[Any], seed: int, pool: WorkerPool, waiting: deque[Chunk]) -> None:
        self._rig, self._seed, self._pool = rig, seed, pool
        self._digest = digest(rig)
        self._waiting = waiting
        self._suspects: deque[Chunk] = deque()
        self._alone = False
        self._since_s = 0.0
        self.flying: dict[Future[Records], tuple[Chunk, Executor]] = {}  # chunks under way, and with whom

    @property
    def busy(self) -> bool:
        """Whether anything is left."""
        return bool(self._waiting or self._suspects or self.flying)

    def step(self, poll_s: float) -> Records:
        """Hand tasks out, wait for at most so long, and take the finished ones."""
        self._submit()
        done, _ = wait(self.flying, timeout=poll_s, return_when=FIRST_COMPLETED)
        return tuple(record for future in done for record in self._taken(future))

    def _submit(self) -> None:
        """Run suspects alone, others together."""
        if self.flying and (self._alone or self._suspects):
            return
        self._alone = bool(self._suspects)
        if self._alone:
            self._since_s = time.monotonic()
            self._fly(self._suspects.popleft())
        while not self._alone and self._waiting and len(self.flying) < _AHEAD * self._pool.workers:
            self._fly(self._waiting.popleft())

    def _fly(self, chunk: Chunk) -> None:
        future = self._pool.submit(play, self._rig, self._digest, self._seed, chunk)
        self.flying[future] = chunk, self._pool.executor

    def _taken(self, future: Future[Records]) -> Records:
        chunk, executor = self.flying.pop(future)
        try:
            return future.result()
        except self._pool.deaths as death:
            self._pool.survive(death, executor)
        if not self._alone:
            self._suspects.append(chunk)
        elif len(chunk) > 1:
            self._suspects.extendleft((index,) for index in reversed(chunk))
        else:
            return (self._guilty(chunk[0]),)
        return ()

    def _guilty(self, index: int) -> EpisodeRecord:
        """Return the record of an episode that a worker died of."""
        outcome = death(self._rig, time.monotonic() - self._since_s)
        rig = self._rig
        faults = rig.kind.fault_classes(rig.episode(self._seed, index), rig.system)
        return EpisodeRecord(index, faults, outcome.end, 0, outcome.findings, 0, "")


def death(rig: Rig[Any], took_s: float) -> EpisodeOutcome:
    """Return the end of an episode that killed its worker after so long: a hang if the worker was ended for that."""
    if took_s > GRACE * rig.limit_s:
        return odd(HANG, EpisodeFinding(ENDS, 0, no_end(rig)))
    return odd(CRASH, EpisodeFinding(SURVIVES, 0, "the process that ran it died"))
