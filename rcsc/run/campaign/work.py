"""Tasks of workers: play episodes within a limit of time, and report what became of them; shrink one; keep its log.

In: a rig and numbers, which travel. Out: records and episodes, which travel back. An episode that raises, or does not end, is
a finding of its own; one that kills its worker is noticed by the runner.
"""

import contextlib
import ctypes
import faulthandler
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Generic

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.children import scratch
from rcsc.base.host.files.read import MOST_OF_OURS, content
from rcsc.run.campaign.journal import EpisodeRecord
from rcsc.run.campaign.rig import E, Rig, digest, mask
from rcsc.run.campaign.shrink import MOST_TRIES, shrink
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome

CRASH, HANG, ERROR = "crash", "hang", "error"
SURVIVES, ENDS, RAISES = "the process survives", "the run ends in time", "nothing is raised"
ODD = frozenset({SURVIVES, ENDS, RAISES})
"""Properties that only a campaign can look at."""

TRIES = {SURVIVES: 60, ENDS: 12}
"""How often a shrinking may try where each try is dear: it costs a process, or the whole limit."""


class OtherTables(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A worker has other tables, data or programs than the campaign."""

    code = Code.WORKERS_GONE
    helps = ("what is done is kept: the same command goes on from there",)


class NotDrawn(CodedError):  # noqa: N818  # likewise
    """Episodes cannot be drawn: of the plant not even its faults can be had."""

    code = Code.BAD_PLANT
    helps = ("a plant's constructor has to come back: what takes time belongs into `step`",)


class _OutOfTime(BaseException):
    """Goes through every `except Exception` of what is run."""


@dataclass(frozen=True, slots=True)
class Shrunk(Generic[E]):
    """A counterexample.

    Attributes:
        log: Its log, whole; empty where none could be kept.
    """

    episode: E
    finding: EpisodeFinding
    log: bytes


def play(rig: Rig[Any], wanted: str, seed: int, indices: Sequence[int]) -> tuple[EpisodeRecord, ...]:
    """Play episodes of a campaign, one after the other.

    Args:
        rig: On what.
        wanted: The digest that tables, data and programs must have here.
        seed: The campaign's.
        indices: Which of its episodes.

    Raises:
        OtherTables: They have not.
        NotDrawn: No episode can be had.
        CodedError: The system is not in order here.
    """
    _same(rig, wanted)
    return tuple(_record(rig, index, _drawn(rig, seed, index)) for index in indices)


def _same(rig: Rig[Any], wanted: str) -> None:
    if digest(rig) != wanted:
        raise OtherTables("a worker has other tables, data or programs than this campaign")


def _drawn(rig: Rig[E], seed: int, index: int) -> E:
    """Return an episode of a campaign. Raises NotDrawn: a plant that is asked for its faults does not come back."""
    try:
        with within(rig.limit_s):
            return rig.episode(seed, index)
    except _OutOfTime:
        raise NotDrawn(f"no episode could be drawn within {rig.limit_s:g} s") from None


def _record(rig: Rig[E], index: int, episode: E) -> EpisodeRecord:
    outcome = attempt(rig, episode)
    lines = mask(outcome.lines, rig.system)
    faults = rig.kind.fault_classes(episode, rig.system)
    return EpisodeRecord(index, faults, outcome.end, outcome.ticks, outcome.findings, lines, outcome.digest)


def attempt(rig: Rig[E], episode: E, log: Path | None = None) -> EpisodeOutcome:
    """Run an episode; what it raises, and that it does not end, are findings.

    Raises:
        CodedError: The system is not in order; that is no episode's doing.
    """
    try:
        with within(rig.limit_s):
            return rig.run(episode, log)
    except _OutOfTime:
        return odd(HANG, EpisodeFinding(ENDS, 0, no_end(rig)))
    except rig.kind.not_in_order:
        raise
    except Exception as error:  # noqa: BLE001  # whatever it is, it is this episode's finding
        kind = type(error).__name__
        return odd(f"{ERROR}:{kind}", EpisodeFinding(RAISES, 0, f"{kind}: {error}"[:300]))


def no_end(rig: Rig[Any]) -> str:
    """Return the finding of a hang: the same however it was ended."""
    return f"no end within {rig.limit_s:g} s"


def odd(end: str, finding: EpisodeFinding) -> EpisodeOutcome:
    """Return the record of an episode without an outcome of its own."""
    return EpisodeOutcome((), (finding,), end, 0, frozenset(), "")


def shrunk(rig: Rig[E], wanted: str, seed: int, index: int, name: str) -> Shrunk[E]:
    """Shrink an episode of a campaign to a counterexample of a property, with its log.

    Raises:
        OtherTables: As `play`.
    """
    _same(rig, wanted)
    fails = partial(fails_in, rig, name)
    return logged(rig, shrink(rig.episode(seed, index), fails, TRIES.get(name, MOST_TRIES)), name)


def fails_in(rig: Rig[E], name: str, episode: E) -> bool:
    """Whether a property does not hold in an episode."""
    return any(finding.property == name for finding in attempt(rig, episode).findings)


def logged(rig: Rig[E], episode: E, name: str, log: Path | None = None) -> Shrunk[E]:
    """Return the counterexample with its log, which holds the run up to where it ended.

    Args:
        rig: On what.
        episode: Which shows it.
        name: The property's.
        log: Where the log goes, so that it is left if this process is not; None for a place of its own.
    """
    with scratch("campaign") as folder:
        kept = folder / "log.mcap" if log is None or not log.parent.is_dir() else log
        return counterexample(episode, attempt(rig, episode, kept), name, kept)


def counterexample(episode: E, outcome: EpisodeOutcome, name: str, log: Path) -> Shrunk[E]:
    """Return an episode with how it broke a property, and what its log holds."""
    finding = next(
        (finding for finding in outcome.findings if finding.property == name),
        EpisodeFinding(name, 0, outcome.end),
    )
    return Shrunk(episode, dated(finding, log), content(log, MOST_OF_OURS) if log.is_file() else b"")


def dated(finding: EpisodeFinding, log: Path) -> EpisodeFinding:
    """Return the finding in the cycle in which its log ends, where only a campaign saw that the run ended there."""
    if finding.property not in ODD or not log.is_file():
        return finding
    from rcsc.run.log.read import UnreadableLog, read  # of an extra

    try:
        last = read(log).last
    except UnreadableLog:
        return finding
    lost = f", at most a second after cycle {last}" if finding.property == SURVIVES else ""
    return replace(finding, tick=last, message=finding.message + lost)


# --- the limit of time ---

_OWN = threading.Event()
"""Set in a process that is a campaign's worker and nothing else, which may be ended."""

GRACE = 2.0
"""What does not react to being stopped within so many limits is ended with its process."""


def own_process() -> None:
    """Mark this process as a campaign's worker, which may be ended."""
    _OWN.set()


@contextlib.contextmanager
def within(seconds: float) -> Iterator[None]:
    """Stop what runs in it after so long; in a worker's own process also what does not react.

    Raises:
        _OutOfTime: It was stopped.
    """
    stop = (
        _by_alarm(seconds) if threading.current_thread() is threading.main_thread() else _by_thread(seconds)
    )
    with contextlib.ExitStack() as stack:
        if _OWN.is_set():
            faulthandler.dump_traceback_later(
                GRACE * seconds, exit=True, file=stack.enter_context(open(os.devnull, "w"))
            )
            stack.callback(faulthandler.cancel_dump_traceback_later)
        stack.enter_context(stop)
        yield


@contextlib.contextmanager
def _by_alarm(seconds: float) -> Iterator[None]:
    def ring(_: int, __: FrameType | None) -> None:
        raise _OutOfTime

    before = signal.signal(signal.SIGALRM, ring)
    # and again after as long: what is raised in a finalizer goes nowhere
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@contextlib.contextmanager
def _by_thread(seconds: float) -> Iterator[None]:
    """Limit a thread, which gets no signals: another thread raises the exception in it, at its next step of Python."""
    lock, running = threading.Lock(), [True]
    target = ctypes.c_ulong(threading.get_ident())

    def ring() -> None:
        with lock:
            if running[0]:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(target, ctypes.py_object(_OutOfTime))

    timer = threading.Timer(seconds, ring)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        with lock:
            running[0] = False
        timer.cancel()
