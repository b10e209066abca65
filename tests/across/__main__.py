"""Many drawn systems: `python -m tests.across --count 300 --seed 0`.

Seeds are numbers: those from `--seed` on, `--count` of them. Of each the requirements across levels are answered and judged by running
the levels, with buffers that are never late, a tick late, and two, in turn; so is what comes eventually, what is proved of levels
together of what their contracts leave open, and what is found of plain outputs. Prints the verdicts, counted, and each difference with
its seed, also where Ctrl-C ends it.

`--mutants` makes slips in each drawn system instead, each alone: a wire that is cut, two that are swapped, an output that comes back to
nobody, a period twice as long. A requirement that is proved of the system has to be refuted of such a mutant by a run, or proved of it,
too, and kept in its runs. Exit status 1 where something differs.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from rcsc.compose.proof.system import prove_transition_systems, read_systems
from rcsc.compose.together.proof import Across, Question
from tests.across import test_eventually, test_judged, test_left_open, test_plain
from tests.across.systems import Drawn, Running, drawn, written

KINDS: dict[str, Callable[[int, Path], list[str]]] = {
    "required": lambda seed, folder: test_judged.judged(seed, folder, late=seed % 3),
    "comes": test_eventually.judged,
    "left open": lambda seed, folder: test_left_open.judged(seed, folder, late=seed % 3),
    "plain": test_plain.judged,
}


def slips(made: Drawn) -> Iterator[tuple[str, Drawn]]:
    """Yield the mutants of a system, each with what was done to it."""
    head, _, rows = made.files["system.toml"].partition("[buffers]\n")
    wires = rows.splitlines()
    between = [at for at, wire in enumerate(wires) if not wire.startswith('"plant')]

    def with_wires(changed: list[str]) -> Drawn:
        text = f"{head}[buffers]\n" + "\n".join(changed) + "\n"
        return replace(made, files={**made.files, "system.toml": text})

    for at in between:
        yield "wire cut", with_wires([wire for of, wire in enumerate(wires) if of != at])
        source, _, target = wires[at].partition(" = ")
        yield (
            "output to nobody",
            with_wires(
                [*wires[:at], f'{source} = "plant.takes"', f'"plant.gives" = {target}', *wires[at + 1 :]]
            ),
        )
    for first, second in pairwise(between):
        ends = [wires[at].partition(" = ") for at in (first, second)]
        swapped = list(wires)
        swapped[first], swapped[second] = f"{ends[0][0]} = {ends[1][2]}", f"{ends[1][0]} = {ends[0][2]}"
        yield "wires swapped", with_wires(swapped)
    for name in made.levels:
        text = made.files[f"{name}.rcs"]
        period = text.partition("{ period ")[2].partition(" ")[0]
        slow = text.replace(f"{{ period {period} ", f"{{ period {2 * int(period)} ")
        yield "period doubled", replace(made, files={**made.files, f"{name}.rcs": slow})


def answers(path: Path) -> dict[str, Across]:
    """Answer the requirements of a system."""
    systems, _ = read_systems(path)
    whole = prove_transition_systems(systems, None, 1, tuple(systems))
    proofs = {proof.level: proof for proof in whole.levels}
    running = Running(path)
    return {
        stated.name: Question(systems, running.described, running.program, stated, proofs).answer()
        for stated in running.program.properties
    }


def with_slips(seed: int, folder: Path) -> list[str]:
    """Judge the mutants of a drawn system; return what became of each requirement that is proved of the system."""
    made, told = drawn(seed), list[str]()
    (folder / "made").mkdir()
    proved = {name: found for name, found in answers(written(made, folder / "made")).items() if found.proved}
    for number, (what, mutant) in enumerate(slips(made)):
        (folder / str(number)).mkdir()
        path = written(mutant, folder / str(number))
        found = answers(path)
        told += [f"{what}: {_became(before, found[name], path)}" for name, before in proved.items()]
    return told


def _became(before: Across, found: Across, path: Path) -> str:
    """Return what a slip made of a requirement that was proved.

    Raises:
        AssertionError: It is proved of the mutant, and a run of that breaks it.
    """
    if found.run and (found.refuted or found.around != before.around):
        return "refuted"
    if not found.proved:
        return "left open"
    around = found.around
    here = {"refuses": around.refuses, "restarts": around.restarts}
    assert not Running(path).shortest(found.stated, 8, **here), (path, found.stated.text)
    return "kept, and proved"


def main(arguments: list[str] | None = None) -> int:
    """Judge systems; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.across", description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="systems")
    parser.add_argument("--seed", type=int, default=0, help="the first seed")
    parser.add_argument(
        "--kind", choices=KINDS, action="append", help="what is judged (repeatable); else all"
    )
    parser.add_argument("--mutants", action="store_true", help="judge mutants of each system instead")
    given = parser.parse_args(arguments)
    kinds = {"slips": with_slips} if given.mutants else {name: KINDS[name] for name in given.kind or KINDS}
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
    for what, many in sorted(counts.items()):
        print(f"{many:8} {what}")
    print(f"{wrong} differences")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
