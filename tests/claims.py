"""Proved claims of drawn systems, held against runs: proves each, plays episodes on its executors, and reports every claim that one breaks.

`python -m tests.claims --count 1000 --jobs 2` prints a table at the end and every claim that broke, with its seed; `--show SEED` prints
one system with what breaks it, made small. Exit status 1 where a claim breaks.

Systems are those that `tests.hierarchies` judges by enumeration, small ones and whole ones; those that the compiler refuses are counted,
and others taken in their place. Episodes have what any system's have (`rcsc.run.episodes.sampling`): values from outside that move and are
refused, orders at any moment, buffers that lose, delay and double, levels that start anew; restarts oftener than there.
"""

import argparse
import gc
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from random import Random
from types import ModuleType

from rcsc.base.diagnostics.coded import CodedError
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.driver.compile import compile_system
from rcsc.driver.watched import proved_claims
from rcsc.run.campaign.shrink import shrink
from rcsc.run.episodes.episode import Episode, Restart
from rcsc.run.episodes.loop import Loop
from rcsc.run.episodes.outcome import EpisodeFinding
from rcsc.run.episodes.proved.claims import Claims
from rcsc.run.episodes.proved.cycles import EXTERN
from rcsc.run.episodes.proved.watch import PROVED, ProvedHolds
from rcsc.run.episodes.sampling import draw_on
from rcsc.run.episodes.stand import Stand, stand
from tests.small_hierarchies.more import furnished
from tests.small_hierarchies.text import files
from tests.whole_systems.drawn import drawn

LITTLE = Effort(walks=6, cycles=20)
WITHIN = "[campaign]\nwithin = 60\n"
"""A command that does not end holds no episode up."""
EPISODES = 4
ATTEMPTS = 12
"""Seeds that are tried for one system: the compiler refuses many."""
SOON = 90
"""Ticks in which most of an episode happens."""


@dataclass(frozen=True, slots=True)
class Played:
    """What became of one system.

    Attributes:
        broken: Claims that an episode broke: the episode's number, the claim, what was seen.
    """

    seed: int
    counts: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    broken: tuple[tuple[int, str, str], ...] = ()
    cpu_s: float = 0.0


class _Nowhere(ModuleType):
    """The module of drawn extern procedures: what they give is drawn, and now and then refused."""

    random = Random(0)  # noqa: S311  # repeatable on purpose

    def ask(self, *_: object) -> int:
        """A number of 0 .. 2, or one that is refused."""
        return 9 if self.random.random() < 0.05 else self.random.randint(0, 2)

    def tell(self, *_: object) -> int:
        """A truth value, or what is refused."""
        return 9 if self.random.random() < 0.05 else self.random.randint(0, 1)


NOWHERE = _Nowhere("nowhere")


def texts(seed: int) -> dict[str, str]:
    """The files of the system of a seed, by name: of the small hierarchies, and every other time of whole systems."""
    made = dict(drawn(seed).files) if seed % 2 else files(furnished(seed))
    return {**made, "system.toml": f"{made['system.toml']}{WITHIN}"}


def proved(folder: Path, seed: int) -> "tuple[Stand, Claims] | None":
    """The system of a seed, compiled into a folder, and what is proved of it; None where the compiler refuses it."""
    for name, text in texts(seed).items():
        (folder / name).write_text(text, encoding="utf-8")
    path = folder / "system.toml"
    try:
        if compile_system(path).report.failed:
            return None
        return stand(path), proved_claims_of(path)
    except CodedError:  # two ends of a link that differ, a program that is not in order
        return None


def proved_claims_of(path: Path) -> Claims:
    """What is proved of a system, with little effort.

    Raises:
        CodedError: It is not in order.
    """
    systems = read_systems(path)[0]
    return proved_claims(path, systems, prove_transition_systems(systems, LITTLE, 1, tuple(systems)))


def drawn_episode(its: Stand, seed: int, number: int) -> Episode:
    """An episode, with more restarts, and those soon."""
    random = Random(f"{seed} {number}")  # noqa: S311  # likewise
    episode = draw_on(its, random.getrandbits(60))
    more = tuple(
        Restart(random.randint(0, SOON), random.choice(list(its.signs)))
        for _ in range(random.choice((0, 0, 1, 2)))
    )
    return replace(episode, executor="python", restarts=(*episode.restarts, *more))


class _GoesOn(Loop):
    """An episode that a refused result does not end: what is proved is proved of the cycles after it, too."""

    def _expected(self, tick: int) -> bool:
        faulted = [level for level in self.cycle.ran if level.fault and level.fault != EXTERN]
        return self.system.tick == tick + 1 and (not faulted or super()._expected(tick))


def broken_in(episode: Episode, its: Stand, claims: Claims) -> tuple[Loop, list[EpisodeFinding]]:
    """An episode that was run, and the claims that it breaks."""
    NOWHERE.random = Random(episode.seed)  # noqa: S311  # likewise
    sys.modules["nowhere"] = NOWHERE
    loop = _GoesOn(episode, its, claims)
    outcome = loop.finish()
    return loop, [found for found in outcome.findings if f": {PROVED}: " in found.property]


def played(seed: int, episodes: int = EPISODES) -> Played:
    """The system of a seed, or the next one that compiles, proved and played with."""
    begun, counts, kinds = time.process_time(), Counter[str](), Counter[str]()
    broken: list[tuple[int, str, str]] = []
    for attempt in range(ATTEMPTS):
        one = seed * ATTEMPTS + attempt
        with tempfile.TemporaryDirectory(prefix="rcsc-claims-") as folder:
            made = proved(Path(folder), one)
            if made is None:
                counts["systems that the compiler refuses"] += 1
                continue
            its, claims = made
            counts["systems"] += 1
            counts["levels"] += len(claims.levels)
            holds = ProvedHolds(claims, its)
            kinds.update(claim.kind for claim in holds.watched)
            counts["claims watched"] += len(holds.watched)
            counts["claims not watched"] += len(holds.unwatched)
            kinds.update(f"not watched: {re.sub('`[^`]*`', '...', why)}" for _, why in holds.unwatched)
            for number in range(episodes):
                episode = drawn_episode(its, one, number)
                loop, found = broken_in(episode, its, claims)
                broken += [(number, each.property, each.message) for each in found]
                _count(counts, episode, loop)
        break
    return Played(one, counts, kinds, tuple(broken), time.process_time() - begun)


def _count(counts: Counter[str], episode: Episode, loop: Loop) -> None:
    counts["episodes"] += 1
    counts["ticks"] += loop.system.tick
    counts["restarts"] += len(episode.restarts)
    counts["values from outside"] += len(episode.readings)
    counts["of them refused"] += sum(reading.refused for reading in episode.readings)
    counts["harmed buffers"] += len(episode.harms)


# --- the command ----------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    """The command; 1 where a claim breaks."""
    parser = argparse.ArgumentParser(prog="python -m tests.claims", description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0, help="the first")
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of each system")
    parser.add_argument("--show", type=int, default=None, metavar="SEED", help="a seed that was printed")
    asked = parser.parse_args(arguments)
    if asked.show is not None:
        return _show(asked.show, asked.episodes)
    return _run(range(asked.seed, asked.seed + asked.count), asked.jobs, asked.episodes)


def _run(seeds: range, jobs: int, episodes: int) -> int:
    begun, counts, kinds, cpu_s, wrong = time.perf_counter(), Counter[str](), Counter[str](), 0.0, 0
    for at, one in enumerate(_each(seeds, jobs, episodes), 1):
        counts += one.counts
        kinds += one.kinds
        cpu_s += one.cpu_s
        wrong += bool(one.broken)
        for number, claim, seen in one.broken:
            sys.stdout.write(f"seed {one.seed}, episode {number}: {claim}: {seen}\n")
        if at % 100 == 0:
            sys.stdout.write(f"{at} of {len(seeds)}, {time.perf_counter() - begun:.0f} s, {wrong} broken\n")
            sys.stdout.flush()
    rows = [
        *sorted(counts.items()),
        *((f"claims: {kind.lower()}", many) for kind, many in sorted(kinds.items())),
    ]
    rows.append(("systems in which a claim breaks", wrong))
    for name, many in rows:
        sys.stdout.write(f"| {name:36} | {many:9} |\n")
    each = cpu_s / max(counts["systems"], 1)
    sys.stdout.write(f"{time.perf_counter() - begun:.0f} s; {each:.2f} s of CPU a system\n")
    return int(bool(wrong))


def _each(seeds: range, jobs: int, episodes: int) -> Iterator[Played]:
    wanted = [episodes] * len(seeds)
    if jobs == 1:
        yield from map(played, seeds, wanted)
        return
    with ProcessPoolExecutor(jobs, get_context("spawn"), gc.set_threshold, (200_000,)) as pool:
        yield from pool.map(played, seeds, wanted, chunksize=5)


def _show(seed: int, episodes: int) -> int:
    """Print a system and, for each claim that an episode breaks, a small one that does."""
    for name, text in texts(seed).items():
        sys.stdout.write(f"--- {name}\n{text}")
    with tempfile.TemporaryDirectory(prefix="rcsc-claims-") as folder:
        made = proved(Path(folder), seed)
        if made is None:
            sys.stdout.write("the compiler refuses it\n")
            return 0
        shown = dict[str, Episode]()
        for number in range(episodes):
            episode = drawn_episode(made[0], seed, number)
            for found in broken_in(episode, *made)[1]:
                shown.setdefault(found.property, episode)
        for name, episode in shown.items():
            small = shrink(episode, lambda one: _breaks(one, name, *made))  # noqa: B023  # called here
            loop, found_again = broken_in(small, *made)
            sys.stdout.write(f"=== {name}\n" + "".join(f"  {line}\n" for line in small.told()))
            sys.stdout.write("".join(f"  {found}\n" for found in found_again))
            sys.stdout.write(f"  {loop.system.tick} ticks\n")
    return int(bool(shown))


def _breaks(episode: Episode, name: str, its: Stand, claims: Claims) -> bool:
    try:
        return any(found.property == name for found in broken_in(episode, its, claims)[1])
    except ValueError:
        return False  # it names what the system has not


if __name__ == "__main__":
    sys.exit(main())
