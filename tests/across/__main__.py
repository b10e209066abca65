"""Many drawn systems: `python -m tests.across --count 300 --seed 0`.

Seeds are numbers: those from `--seed` on, `--count` of them. Of each the requirements across levels are answered and held against all runs
of the system (`held`), with buffers that are never late, a tick late, or two. So is what is proved of levels together of what their
contracts leave open, and, on walks, what is found of plain outputs; `--kind` chooses. Levels of one system of `--proofs` are proved alone,
too, which takes longer. Prints the verdicts, counted, and each difference with its seed, also where Ctrl-C ends it.

`--mutants` makes slips in each drawn system instead (`slips`), and prints what became of them: `ENOUGH` of them have to be told by a
requirement that was proved, or shown to change none. Exit status 1 where something differs, or fewer are.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

from tests.across import test_left_open, test_plain
from tests.across.judge import held, slips

ENOUGH = 0.98
KINDS: dict[str, Callable[[int, Path], list[str]]] = {
    "required": held.judged,
    "left open": lambda seed, folder: test_left_open.judged(seed, folder, late=seed % 3),
    "plain": test_plain.judged,
}


def shares(counts: Counter[str]) -> float:
    """Print what became of mutants, by what was done; return the share that is told or equivalent."""
    every = {name.partition(": ")[2]: many for name, many in counts.items() if name.startswith("slips: ")}
    became = slips.TOLD, slips.EQUIVALENT, slips.MISSED, slips.TOO_MANY
    print("".join(f"{one:>14}" for one in became))
    for what in sorted({name.partition(": ")[0] for name in every}):
        print("".join(f"{every.get(f'{what}: {one}', 0):14}" for one in became), what)
    known = sum(many for name, many in every.items() if name.endswith((slips.TOLD, slips.EQUIVALENT)))
    share = known / max(1, sum(every.values()))
    print(f"{sum(every.values())} mutants, {share:.1%} told or equivalent")
    return share


def main(arguments: list[str] | None = None) -> int:
    """Judge systems; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.across", description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="systems")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument(
        "--kind", choices=KINDS, action="append", help="what is judged (repeatable); else all"
    )
    parser.add_argument(
        "--proofs", type=int, default=8, metavar="K", help="prove the levels of one system of so many"
    )
    parser.add_argument("--mutants", action="store_true", help="judge mutants of each system instead")
    given = parser.parse_args(arguments)
    kinds = {"slips": slips.judged} if given.mutants else {name: KINDS[name] for name in given.kind or KINDS}
    if "required" in kinds:
        kinds["required"] = partial(held.judged, proofs=given.proofs)
    counts, wrong, begun = Counter[str](), 0, time.perf_counter()
    with suppress(KeyboardInterrupt):  # what was done until then is told
        for seed in range(given.seed, given.seed + given.count):
            for kind, judge in kinds.items():
                with tempfile.TemporaryDirectory() as folder:
                    try:
                        counts.update(f"{kind}: {verdict}" for verdict in judge(seed, Path(folder)))
                    except AssertionError as error:
                        wrong += 1
                        print(f"seed {seed}, {kind}: {error}", flush=True)
            counts["systems"] += 1
            if counts["systems"] % 10 == 0:
                print(
                    f"up to seed {seed}: {wrong} differences, {time.perf_counter() - begun:.0f} s", flush=True
                )
    share = 1.0
    if given.mutants:
        share = shares(counts)
    else:
        for what, many in sorted(counts.items()):
            print(f"{many:8} {what}")
    print(f"{wrong} differences in {counts['systems']} systems, {time.perf_counter() - begun:.0f} s")
    return int(wrong > 0 or share < ENOUGH)


if __name__ == "__main__":
    sys.exit(main())
