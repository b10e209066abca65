"""Episodes for tests of campaigns: drawn and run without a cell, in a moment, and some of them kill, hang or raise.

They stand in a module because workers begin anew and import what they run. What an episode does hangs on its switches: `slips` ends the
process, `dark` never ends, `jammed` does not end either and cannot be stopped, `blind` raises, `drops` breaks a property.
"""

import ctypes
import hashlib
import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

from rcsc.run.campaign.rig import Rig, known_lines
from rcsc.run.episodes.outcome import EpisodeFinding, EpisodeOutcome, RowEnd
from rcsc_cell.episodes.episode import Episode, PartSpec, SwitchTo
from rcsc_cell.episodes.loop import Loop

KILLS, HANGS, STUCK, RAISES, BREAKS = "slips", "dark", "jammed", "blind", "drops"
HELD, FAST = "what is held stays", "nothing is fast"
ROWS = ("PAUSE,,,,", "MOVE,BOXT (2),BUFFER,FIX-MAC1,", "MOVE,,,FIX-SAFE,")
RUNS = "RCSC_TEST_RUNS"
"""Names a file, in the environment: each run adds its process's number."""


def calm(by: Random, rig: Rig[Episode]) -> Episode:
    """Nothing worse than a broken property, in about one of four."""
    names = [by.choice((BREAKS, "noisy", "tilted", "hand_weak")) for _ in range(by.randrange(3))]
    return Episode(
        backend="mujoco" if rig.plant == "mujoco" else "kinematic",
        parts=tuple(PartSpec("tbox", x_mm=by.randrange(-40, 41)) for _ in range(by.randrange(3))),
        rows=tuple(by.choice(ROWS) for _ in range(by.randrange(1, 6))),
        faults=tuple(SwitchTo(name, at := by.randrange(200), at + by.randrange(50)) for name in names),
    )


def wild(by: Random, rig: Rig[Episode]) -> Episode:
    """As `calm`, but one in ten kills its process and one in twenty raises."""
    episode = calm(by, rig)
    worse = {0: KILLS, 1: KILLS, 2: RAISES}.get(by.randrange(20))
    return replace(episode, faults=(*episode.faults, SwitchTo(worse, 3, 9))) if worse else episode


def endless(by: Random, rig: Rig[Episode]) -> Episode:
    """As `calm`, but one in seven never ends."""
    episode = calm(by, rig)
    return replace(episode, faults=(SwitchTo(HANGS, 0, 9),)) if by.randrange(7) == 0 else episode


def stuck(by: Random, rig: Rig[Episode]) -> Episode:
    """As `calm`, but one in seven cannot be stopped."""
    episode = calm(by, rig)
    return replace(episode, faults=(SwitchTo(STUCK, 0, 9),)) if by.randrange(7) == 0 else episode


@dataclass(frozen=True)
class Play:
    """An episode that does what its switches say."""

    episode: Episode
    rig: Rig[Episode]

    def finish(self, log: Path | None = None) -> EpisodeOutcome:
        """Do so."""
        _note()
        episode = self.episode
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
        lines = known_lines(self.rig.system)[: 3 + len(rows)]
        sum_ = hashlib.sha256(episode.to_json().encode()).hexdigest()
        found = [
            EpisodeFinding(HELD, fault.first_tick, "it fell")
            for fault in episode.faults
            if fault.fault == BREAKS
        ]
        return EpisodeOutcome(
            rows,
            tuple(found),
            "failed:part_lost" if found else "done",
            10 * len(rows),
            frozenset(lines),
            sum_,
        )


class Dawdle(Play):
    """As `Play`, slowly enough to be killed in the middle."""

    def finish(self, log: Path | None = None) -> EpisodeOutcome:
        """Do so."""
        time.sleep(0.01)
        return super().finish(log)


class Dislike(Loop):
    """The cell's own loop, with a property that no cell keeps: no row fails."""

    def __init__(self, episode: Episode, rig: Rig[Episode]) -> None:
        super().__init__(episode, rig.stand(), claims=rig.claims)

    def outcome(self) -> EpisodeOutcome:
        """Return the cell's, with what is disliked."""
        outcome = super().outcome()
        bad = [
            EpisodeFinding("no row fails", row.ticks, row.reason)
            for row in outcome.rows
            if row.state == "failed"
        ]
        return replace(outcome, findings=tuple(bad[:1]))


def _note() -> None:
    place = os.environ.get(RUNS)
    if place:
        with Path(place).open("a", encoding="ascii") as file:
            file.write(f"{os.getpid()}\n")
