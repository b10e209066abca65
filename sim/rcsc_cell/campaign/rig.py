"""What a campaign plays on: which system, plant and executors; which lines its tables have; a digest of all that outcomes depend on."""

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TypeAlias

from rcsc.run.description import description
from rcsc.run.episodes.outcome import EpisodeOutcome
from rcsc.run.log.schema import fingerprints
from rcsc.run.system import Kind, signatures
from rcsc_cell.cell.ready import Backend
from rcsc_cell.episodes.episode import SYSTEM, Episode
from rcsc_cell.episodes.loop import run
from rcsc_cell.episodes.sampling import draw

LineName: TypeAlias = tuple[str, str, str]
"""Level, table, line."""

_SOURCES = ("rcsc/run", "sim/rcsc_cell")
_LOOKERS = ("rcsc/run/log", *(f"sim/rcsc_cell/{room}" for room in ("campaign", "live", "pictures")))
"""What only looks on: it changes no outcome."""


@dataclass(frozen=True, slots=True)
class Rig:
    """What episodes are played on; it travels to workers, so its functions stand in modules.

    Attributes:
        system: The description; workers elsewhere have it at the same place.
        limit_s: Seconds of the clock after which an episode hangs; generous, so that a busy machine changes nothing.
        draw: Makes the episode of a seed.
        run: Runs an episode of a system; the third is where the log goes.
    """

    backend: Backend = "kinematic"
    executor: Kind = "c"
    system: Path = SYSTEM
    limit_s: float = 120.0
    draw: Callable[[int, Backend], Episode] = draw
    run: Callable[[Episode, Path, Path | None], EpisodeOutcome] = run

    def episode(self, seed: int, index: int) -> Episode:
        """Episode `index` of the campaign of `seed`."""
        return replace(self.draw(episode_seed(seed, index), self.backend), executor=self.executor)


def episode_seed(seed: int, index: int) -> int:
    """The seed of an episode, of 63 bits: campaigns of neighbouring seeds have no episodes in common."""
    return int.from_bytes(hashlib.sha256(f"{seed} {index}".encode()).digest()[:8]) >> 1


@cache
def known_lines(system: Path) -> tuple[LineName, ...]:
    """Every line of every table that a level of the system may run, in the tables' order.

    Raises:
        BadDescription: The system is not in order.
    """
    described = description(system)
    lines = []
    for name, sign in signatures(described).items():
        level = next(level for level in sign.levels if level.name == name)
        tables = [level.table] if level.table else list(dict.fromkeys(level.tables.values()))
        lines += [(name, table, line) for table in tables for line in sign.tables.get(table, ())]
    return tuple(lines)


@cache
def _places(system: Path) -> dict[LineName, int]:
    return {name: at for at, name in enumerate(known_lines(system))}


def mask(lines: Iterable[LineName], system: Path) -> int:
    """Lines as bits, the first of `known_lines` the lowest; a cycle that ran no line, being refused, has no bit."""
    places = _places(system)
    return sum({1 << places[line] for line in lines if line in places})


@cache
def digest(system: Path) -> str:
    """Return the digest of executors, data, scripts and the programs around them: equal digests, equal outcomes.

    By content, so that it is the same in every checkout; taken once a process.

    Raises:
        BadDescription: The system is not in order.
    """
    described = description(system)
    hashed = hashlib.sha256(
        "".join(f"{name} {fingerprint}\n" for name, fingerprint in fingerprints(described).items()).encode()
    )
    for name, path in _files(system, described.database):
        content = path.read_bytes() if path.is_file() else b""
        hashed.update(f"{name} {len(content)}\n".encode() + content)
    return hashed.hexdigest()


def _files(system: Path, data: Path) -> list[tuple[str, Path]]:
    """Yield what is hashed, under names that are the same in every checkout."""
    root = Path(__file__).parents[3]
    sources = sorted(path for folder in _SOURCES for path in (root / folder).rglob("*.py"))
    named = [(path.relative_to(root).as_posix(), path) for path in sources]
    acting = [(name, path) for name, path in named if not name.startswith(_LOOKERS)]
    scripts = [(f"scripts/{path.name}", path) for path in sorted(system.parent.glob("scripts/*.csv"))]
    return [("system", system), ("data", data), *scripts, *acting]
