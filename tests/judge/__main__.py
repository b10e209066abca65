"""Many drawn levels: `python -m tests.judge --count 10000 --seed 0 --jobs 1`.

Seeds are numbers: those from `--seed` on, `--count` of them, so that a run goes on where another one ended. Prints what was compared, by
kind, and each difference with its seed, also where Ctrl-C ends it; `--show SEED` prints a level. A proof takes several times as long as
the engines that search states: `--proofs K` proves one level of K, and holds those alone against all runs of the others. Exit status 1
where something differs.

Never drawn: neighbours and protocols (`tests.hierarchies` does), extern procedures, several tables of a level, DEFAULT lines, doubles,
records, masks, invariants, assumptions that stop a cycle, long times.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing import get_context

from tests.judge.drawn import drawn
from tests.judge.held import Judged, judged

PART, TOLD = 50, 1_000
"""Levels that a process judges in one go, and after how many of them it is told how far it is."""


def main(arguments: list[str] | None = None) -> int:
    """Judge levels; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.judge", description=__doc__)
    parser.add_argument("--count", type=int, default=1_000, help="levels")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument("--proofs", type=int, default=1, metavar="K", help="prove one level of so many")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--show", type=int, help="print the level of a seed, and what differs")
    given = parser.parse_args(arguments)
    if given.show is not None:
        print(drawn(given.show), judged(given.show), sep="\n")
        return 0
    begun, counts, wrong, left_open = time.perf_counter(), Counter[str](), 0, list[int]()
    with suppress(KeyboardInterrupt):  # what was done until then is told
        for part in _judged(given.seed, given.count, given.jobs, given.proofs):
            for one in part:
                counts += one.counts
                counts["levels with a claim left open"] += bool(one.open)
                left_open += [one.seed] if one.open else []
                for difference in one.differences:
                    wrong += 1
                    print(f"seed {one.seed}: {difference}", flush=True)
            if (part[-1].seed + 1 - given.seed) % TOLD == 0:
                levels, seconds = counts["levels"], time.perf_counter() - begun
                print(
                    f"up to seed {part[-1].seed}: {wrong} differences in {levels:,} levels, {seconds:.0f} s",
                    flush=True,
                )
    _report(counts, left_open, wrong, time.perf_counter() - begun)
    return int(wrong > 0)


def _judged(first: int, count: int, jobs: int, proofs: int) -> Iterator[list[Judged]]:
    parts = [range(at, min(at + PART, first + count)) for at in range(first, first + count, PART)]
    part = partial(_part, proofs)
    if jobs == 1:
        yield from map(part, parts)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(part, parts)


def _part(proofs: int, seeds: range) -> list[Judged]:
    return [_safely(seed, proofs) for seed in seeds]


def _safely(seed: int, proofs: int) -> Judged:
    try:
        return judged(seed, proofs=proofs)
    except Exception as error:  # noqa: BLE001  # a long run is not to end with it
        return Judged(seed, Counter({"levels": 1}), (f"raises {type(error).__name__}: {error}",))


def _report(counts: Counter[str], left_open: list[int], wrong: int, seconds: float) -> None:
    for name, number in sorted(counts.items()):
        print(f"{number:10,}  {name}")
    if left_open:
        print("open, the first seeds:", ", ".join(map(str, left_open[:12])))
    levels = max(1, counts["levels"])
    print(f"{wrong} differences in {counts['levels']:,} levels, {1000 * seconds / levels:.0f} ms each")


if __name__ == "__main__":
    sys.exit(main())
