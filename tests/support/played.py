"""Episodes for tests of campaigns: drawn and run without a cell, in a moment, and some of them kill, hang or raise.

They stand in a module because workers begin anew and import what they run. What an episode does hangs on its switches: `slips` ends the
process, `dark` never ends, `jammed` does not end either and cannot be stopped, `blind` raises, `drops` breaks a property.
"""

import ctypes
import hashlib
import os
import signal
import time
from dataclasses import replace
from pathlib import Path
from random import Random

from rcsc.run.campaign.rig import known_lines
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome, RowEnd
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc_cell.episodes.episode import SYSTEM, Episode, PartSpec, SwitchTo
from rcsc_cell.episodes.loop import run as run_in_cell

KILLS, HANGS, STUCK, RAISES, BREAKS = "slips", "dark", "jammed", "blind", "drops"
HELD, FAST = "what is held stays", "nothing is fast"
ROWS = ("PAUSE,,,,", "MOVE,BOXT (2),BUFFER,FIX-MAC1,", "MOVE,,,FIX-SAFE,")
RUNS = "RCSC_TEST_RUNS"
"""Names a file, in the environment: each run adds its process's number."""


def calm(seed: int, system: Path, plant: str, script: str = "") -> Episode:  # noqa: ARG001  # as any kind's is called
    """Nothing worse than a broken property, in about one of four."""
    by = Random(seed)  # noqa: S311  # by seed
    names = [by.choice((BREAKS, "noisy", "tilted", "hand_weak")) for _ in range(by.randrange(3))]
    return Episode(
        backend="mujoco" if plant == "mujoco" else "kinematic",
        seed=seed,
        parts=tuple(PartSpec("tbox", x_mm=by.randrange(-40, 41)) for _ in range(by.randrange(3))),
        rows=tuple(by.choice(ROWS) for _ in range(by.randrange(1, 6))),
        faults=tuple(SwitchTo(name, at := by.randrange(200), at + by.randrange(50)) for name in names),
    )


def wild(seed: int, system: Path, plant: str, script: str = "") -> Episode:
    """As `calm`, but one in ten kills its process and one in twenty raises."""
    episode = calm(seed, system, plant, script)
    worse = {0: KILLS, 1: KILLS, 2: RAISES}.get(seed % 20)
    return replace(episode, faults=(*episode.faults, SwitchTo(worse, 3, 9))) if worse else episode


def endless(seed: int, system: Path, plant: str, script: str = "") -> Episode:
    """As `calm`, but one in eight never ends."""
    episode = calm(seed, system, plant, script)
    return replace(episode, faults=(SwitchTo(HANGS, 0, 9),)) if seed % 8 == 0 else episode


def stuck(seed: int, system: Path, plant: str, script: str = "") -> Episode:
    """As `calm`, but one in eight cannot be stopped."""
    episode = calm(seed, system, plant, script)
    return replace(episode, faults=(SwitchTo(STUCK, 0, 9),)) if seed % 8 == 0 else episode


def play(
    episode: Episode,
    system: Path,
    log: Path | None = None,
    claims: Claims = NOTHING,  # noqa: ARG001  # as any kind's is called
) -> EpisodeOutcome:
    """What the switches say."""
    _note()
    if log is not None:
        log.write_bytes(b"begun")
    names = {fault.fault for fault in episode.faults}
    if KILLS in names:
        os._exit(7)
    if RAISES in names:
        raise ArithmeticError("seen nothing")
    while HANGS in names:
        time.sleep(0.005)
    if STUCK in names:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
        ctypes.PyDLL(None).sleep(
            3600
        )  # and the interpreter's lock is kept: nothing in this process can end it
    rows = tuple(RowEnd(at, row, "done", "", 10) for at, row in enumerate(episode.rows, 1))
    lines = known_lines(system)[: 3 + len(rows)]
    sum_ = hashlib.sha256(episode.to_json().encode()).hexdigest()
    found = [
        EpisodeFinding(HELD, fault.first_tick, "it fell") for fault in episode.faults if fault.fault == BREAKS
    ]
    return EpisodeOutcome(
        rows, tuple(found), "failed:part_lost" if found else "done", 10 * len(rows), frozenset(lines), sum_
    )


def dawdle(
    episode: Episode, system: Path, log: Path | None = None, claims: Claims = NOTHING
) -> EpisodeOutcome:
    """As `play`, slowly enough to be killed in the middle."""
    time.sleep(0.01)
    return play(episode, system, log, claims)


def dislike(
    episode: Episode, system: Path = SYSTEM, log: Path | None = None, claims: Claims = NOTHING
) -> EpisodeOutcome:
    """The cell's own run, with a property that no cell keeps: no row fails."""
    outcome = run_in_cell(episode, system, log, claims)
    bad = [
        EpisodeFinding("no row fails", row.ticks, row.reason) for row in outcome.rows if row.state == "failed"
    ]
    return replace(outcome, findings=tuple(bad[:1]))


def _note() -> None:
    place = os.environ.get(RUNS)
    if place:
        with Path(place).open("a", encoding="ascii") as file:
            file.write(f"{os.getpid()}\n")
