"""Random small hierarchies: the composed proof against exhaustive enumeration, obligation by obligation.

`python -m tests.hierarchies --count 10000 --jobs 2` prints what agreed and every disagreement with its seed; `--show SEED` prints one
hierarchy, without the slips that its disagreement does not need. Exit status 1 where something disagrees.

What is compared, of every level of every hierarchy: the obligations themselves; each obligation that is *proved* with every reachable
state; each trace that is shown with the contract, with what the interpreter does on its inputs, and with the length of the shortest. That
an obligation is *not proved* although it holds is counted (`incomplete`), and is no disagreement. A command that is shown to end may not
go on for ever in any run. All levels run together with real buffers (`whole_systems`), and nothing that was
proved of any may break. Every odd seed draws a whole system instead (`tests.whole_systems`): levels that declare their protocol or
write it, links, streams, plain buffers, facts, with refused inputs and results, and beginnings anew; each claim that is proved,
whatever its sort, is held against what can happen to the levels together.
"""

import argparse
import gc
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from multiprocessing import get_context
from pathlib import Path
from random import Random

from rcsc.compose.contract.claims import ACCEPTED, SAFE, STANDS, Closed, Need, closed
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.trace import NotReproducedError, Trace
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import claims
from rcsc.compose.proof.level import LevelProof, prove_level
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.lang.interpret import Fault
from rcsc.proof.symbolic.values import TRUE
from rcsc.run.description import description
from tests.small_hierarchies.endless import edges, endless
from tests.small_hierarchies.explored import Explored, TooManyError, explored
from tests.small_hierarchies.level import EARLY, Again, Key, Reading, Role, State
from tests.small_hierarchies.made import ODD, Hierarchy
from tests.small_hierarchies.more import SLIPS, furnished
from tests.small_hierarchies.text import files, written
from tests.small_hierarchies.world import allowed, broken, wanted
from tests.support.proved import shortest
from tests.whole_systems.drawn import drawn
from tests.whole_systems.held import held, run_together

LITTLE = Effort(walks=6, cycles=20)
MOST_CYCLES = 7
"""Of a trace that is looked for; longer ones are rare and cost much."""
MOST_TOGETHER = 150
"""States of all levels together that are gone on from."""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Where the proof and the enumeration part; `what` is one of a few words."""

    what: str
    level: str
    obligation: str
    more: str = ""


@dataclass(frozen=True, slots=True)
class Judged:
    """What was found of one hierarchy.

    Attributes:
        counts: Levels, obligations and traces, and how they agreed.
    """

    seed: int
    counts: Counter[str] = field(default_factory=Counter)
    disagreements: tuple[Disagreement, ...] = ()
    incomplete: tuple[Disagreement, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Known:
    """A level with its proof and its states, None where they are too many; and how each table's command may go on for ever."""

    ts: TransitionSystem
    role: Role
    proof: LevelProof
    truth: Explored | None
    forever: Mapping[str, str] = field(default_factory=dict)


def key_of(obligation: Obligation) -> Key:
    """What names an obligation."""
    return obligation.sort, obligation.table, obligation.name


def judged(made: Hierarchy, seed: int = 0, traces: int = 1) -> Judged:
    """Proves and enumerates every level of a hierarchy, and compares.

    Args:
        made: The hierarchy.
        seed: Chooses the obligations that are to be shown.
        traces: How many of the obligations that break are to be shown by a trace, of each level.
    """
    begun = time.perf_counter()
    try:
        found = _compared(made, seed, traces)
    except Exception as error:  # noqa: BLE001  # a long run is not to end with it
        raised = Disagreement("something raises", "", "", f"{type(error).__name__}: {error}")
        found = Judged(seed, Counter({"hierarchies": 1}), (raised,))
    return replace(found, seconds=time.perf_counter() - begun)


def _compared(made: Hierarchy, seed: int, traces: int) -> Judged:
    counts: Counter[str] = Counter()
    random = Random(seed)  # noqa: S311  # repeatable on purpose
    with tempfile.TemporaryDirectory(prefix="rcsc-hierarchy-") as folder:
        path = written(made, Path(folder))
        try:
            made_systems = transition_systems(path)
        except NoProgramError as error:
            if "can lie outside" not in str(error) and "can be zero" not in str(error):
                raise
            return Judged(seed, Counter({"hierarchies": 1, "hierarchies that are refused": 1}))
        system = description(path)
    known = {level.name: _known(made, level.name, made_systems) for level in made.levels}
    proofs = {name: one.proof for name, one in known.items()}
    follows = closed(claims(made_systems, proofs))
    apart: list[Disagreement] = []
    incomplete: list[Disagreement] = []
    for one in known.values():
        if one.truth is None:
            counts["levels with too many states"] += 1
            continue
        counts["levels"] += 1
        counts["states"] += one.truth.states
        apart += _verdicts(one, one.truth, follows, counts, incomplete)
        apart += _endings(one, one.truth, follows, counts, incomplete)
        if one.truth.undefined:
            counts["levels that compute what is not defined"] += 1
            continue
        apart += _traces(one, one.truth, counts, random, traces)
    counts["hierarchies with a fault"] = int(
        any(k.truth and (k.truth.least or k.truth.restarted) for k in known.values())
    )
    if all(_comparable_together(one, known) for one in known.values()):
        together = run_together(made_systems, system, follows, proofs, random, counts, MOST_TOGETHER)
        # the report with which a level begins, which here may say *done*, answers nothing
        apart += (Disagreement(*one) for one in together if one[2] != " ".join(STANDS))
    counts["hierarchies"] = 1
    return Judged(seed, counts, tuple(apart), tuple(incomplete))


def _comparable_together(one: Known, known: Mapping[str, Known]) -> bool:
    """Whether its numbers may have other names, which a level that computes with them would notice, and all that it orders is here."""
    return not one.role.odd and all(below.name in known for below in one.role.links.below)


def forget() -> None:
    """Drops what is known of levels: for tests that change what judges them."""
    _KNOWN.clear()


_KNOWN: dict[tuple[str, ...], tuple[LevelProof, Explored | None, Mapping[str, str]]] = {}


def _known(made: Hierarchy, name: str, made_systems: dict[str, TransitionSystem]) -> Known:
    """A level's proof and its states; many hierarchies have a level in common."""
    ts = made_systems[name]
    level = next(one for one in made.levels if one.name == name)
    role = Role(ts.program, ts.level, ts.links, dict(level.said).get("next") in ODD, ts.trusted)
    text = files(made)
    words = (text[f"{name}.rcs"], text["words.rcs"], repr(ts.links))
    if words not in _KNOWN:
        seen: set[State] = set()
        try:
            truth: Explored | None = explored(role, seen=seen)
        except TooManyError:
            truth = None
        proof = prove_level(ts, LITTLE)
        every = edges(role, seen) if truth is not None and proof.endings else []
        forever = {ending.table: endless(every, ending.table, ending.still) for ending in proof.endings}
        found = tuple(
            (replace(obligation, holds=TRUE), verdict) for obligation, verdict in proof.verdicts
        )  # without their many nodes
        _KNOWN[words] = replace(proof, verdicts=found), truth, forever
    return Known(ts, role, *_KNOWN[words])


def _verdicts(
    one: Known,
    truth: Explored,
    follows: Mapping[Need, Closed],
    counts: Counter[str],
    incomplete: list[Disagreement],
) -> Iterator[Disagreement]:
    """Each verdict with what is true.

    What is proved given what it rests on holds in every cycle up to a fault that is to be excluded; what is proved over the whole chain,
    in a level in which no cycle computes what is not defined.
    """
    name = one.proof.level
    keys = {key_of(obligation) for obligation, _ in one.proof.verdicts} - {SAFE}
    if (every := wanted(one.role)) != keys:
        yield Disagreement("other goals", name, str(sorted(every ^ keys)))
    if truth.undefined and follows[name, SAFE].proved:
        yield Disagreement("shown to be safe, but is not", name, "")
    seen = one.proof.context
    for line in sorted(truth.lines & set(() if seen is None else seen.unreached)):
        yield Disagreement("never reached, but runs", name, str(line))
    for obligation, verdict in one.proof.verdicts:
        if obligation.key == SAFE:
            continue
        proved = follows[name, obligation.key].proved
        breaks = truth.breaks(key_of(obligation))
        said = "rests on what is not proved" if verdict in ACCEPTED and not proved else verdict.value
        truly = "not defined" if truth.undefined else "breaks" if breaks else "holds"
        counts[f"{said}, {truly}"] += 1
        if truth.undefined:
            if proved:
                yield Disagreement("proved, but not defined", name, _shown(obligation))
        elif breaks and verdict in ACCEPTED:
            yield Disagreement(
                "proved, but breaks",
                name,
                _shown(obligation),
                f"in {truth.least.get(key_of(obligation))} cycles",
            )
        elif not breaks and verdict not in ACCEPTED:
            incomplete.append(
                Disagreement(f"{verdict.value}, but holds", name, _shown(obligation), obligation.sort.value)
            )


def _endings(
    one: Known,
    truth: Explored,
    follows: Mapping[Need, Closed],
    counts: Counter[str],
    incomplete: list[Disagreement],
) -> Iterator[Disagreement]:
    """Whether commands end, with what is true: of tables of which something else is not proved, too."""
    for ending in one.proof.endings:
        if truth.undefined:
            if follows[one.proof.level, (Sort.ENDS, ending.table, "")].proved:
                yield Disagreement("shown to end, but not defined", one.proof.level, ending.table)
            continue
        goes_on = one.forever[ending.table]
        said = "shown to end" if ending.proved else "not shown to end"
        counts[f"{said}, {'goes on' if goes_on else 'ends'}"] += 1
        if goes_on and ending.proved:
            yield Disagreement("shown to end, but goes on", one.proof.level, ending.table, goes_on)
        elif not goes_on and not ending.proved:
            incomplete.append(
                Disagreement("not shown to end, but ends", one.proof.level, ending.table, "a command")
            )


def _shown(obligation: Obligation) -> str:
    return f"{obligation.table}: {obligation.shown}" if obligation.table else obligation.shown


def _traces(
    one: Known, truth: Explored, counts: Counter[str], random: Random, many: int
) -> Iterator[Disagreement]:
    """Traces for some obligations that break; and for one that is open and does not, that there is none."""
    obligations = [obligation for obligation, _ in one.proof.verdicts]
    breaking = [
        obligation
        for obligation in obligations
        if truth.least.get(key_of(obligation), MOST_CYCLES + 1) <= MOST_CYCLES
    ]
    for obligation in random.sample(breaking, min(many, len(breaking))):
        counts["traces"] += 1
        yield from _trace(one, obligation, truth.least[key_of(obligation)])
    sound = [
        obligation
        for obligation, verdict in one.proof.verdicts
        if verdict not in ACCEPTED and obligation.key != SAFE and key_of(obligation) not in truth.least
        # a fact that is declared is not proved where no first cycle can keep to it; no run of the contract breaks it
        if not (obligation.sort is Sort.ASSUMPTION and obligation.name in one.ts.trusted)
    ]
    for obligation in sound[:1]:
        counts["traces that there are not"] += 1
        yield from _trace(one, obligation, None)


def _trace(one: Known, obligation: Obligation, least: int | None) -> Iterator[Disagreement]:
    """The trace of an obligation that breaks in `least` cycles, never if None, is one, and no longer."""
    name, shown = one.proof.level, _shown(obligation)
    try:
        trace = shortest(one.ts, obligation, least or 4)
    except NotReproducedError as error:
        if not error.guessed:  # a sum of reals is open to the search, and says so
            yield Disagreement("trace does not run", name, shown, f"least {least}")
        return
    if trace is None:
        if least is not None:
            yield Disagreement("no trace found", name, shown, f"least {least}")
        return
    if least is None or len(trace.steps) != least:
        yield Disagreement("trace of another length", name, shown, f"{len(trace.steps)}, least {least}")
    if (why := _wrong(one.role, obligation, trace)) is not None:
        yield Disagreement("trace is none", name, shown, why)


def _wrong(role: Role, obligation: Obligation, trace: Trace) -> str | None:
    """Why a trace is none: run again, with the contract looked at."""
    now = dict(role.start)
    for number, step in enumerate(trace.steps, 1):
        if not allowed(role, now, step.taken):
            return f"cycle {number} is against the contract"
        taken = dict(step.taken)
        ran = role.run(Reading({**now, **taken}), Again(role.program, list(step.answers)))
        if ran.failed & role.trusted:
            return f"cycle {number} is against what is declared"
        if ran.fault is not Fault.OK and ran.fault not in EARLY and number < len(trace.steps):
            return f"cycle {number} ends the run"
        broke = key_of(obligation) in set(broken(role, now, taken, ran))
        if broke != (number == len(trace.steps)):
            return f"cycle {number} {'breaks' if broke else 'does not break'} it"
        now = ran.after
    return None


# --- the command --------------------------------------------------------------------------------


def judged_seed(seed: int) -> Judged:
    """The hierarchy of a seed, judged, or of an odd one the whole system; for a process of a pool."""
    return judged_whole(seed) if seed % 2 else judged(furnished(seed), seed)


def judged_whole(seed: int) -> Judged:
    """The whole system of a seed, judged."""
    begun, counts = time.perf_counter(), Counter[str]()
    try:
        apart = tuple(Disagreement(*one) for one in held(drawn(seed), seed, counts))
    except Exception as error:  # noqa: BLE001  # a long run is not to end with it
        apart = (Disagreement("something raises", "", "", f"{type(error).__name__}: {error}"),)
    return Judged(seed, counts, apart, seconds=time.perf_counter() - begun)


def smaller(seed: int) -> tuple[Hierarchy, Judged]:
    """The hierarchy of a seed with only those slips without which it would not disagree."""
    made, found = furnished(seed), judged(furnished(seed), seed, traces=99)
    sought = {(disagreement.what, disagreement.level) for disagreement in found.disagreements}
    skipped: frozenset[int] = frozenset()
    for number in range(SLIPS):
        other = furnished(seed, skipped | {number})
        again = judged(other, seed, traces=99)
        if sought & {(disagreement.what, disagreement.level) for disagreement in again.disagreements}:
            made, found, skipped = other, again, skipped | {number}
    return made, found


def main(arguments: list[str] | None = None) -> int:
    """The command; 1 where something disagrees."""
    parser = argparse.ArgumentParser(prog="python -m tests.hierarchies", description=__doc__)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=None, help="a file for the figures, as JSON")
    parser.add_argument("--show", type=int, default=None, metavar="SEED")
    asked = parser.parse_args(arguments)
    if asked.show is not None:
        return _show(asked.show)
    return _run(range(asked.first, asked.first + asked.count), asked.jobs, asked.out)


def _show(seed: int) -> int:
    if seed % 2:
        whole, found = drawn(seed), judged_whole(seed)
        texts, slips = dict(whole.files), whole.slips
    else:
        made, found = smaller(seed)
        texts, slips = files(made), made.slips
    for name, text in texts.items():
        sys.stdout.write(f"--- {name}\n{text}")
    sys.stdout.write(f"slips: {slips}\n{dict(found.counts)}\n")
    for one in (*found.disagreements, *found.incomplete):
        sys.stdout.write(f"{one}\n")
    return int(bool(found.disagreements))


def _run(seeds: range, jobs: int, out: Path | None) -> int:
    begun = time.perf_counter()
    counts: Counter[str] = Counter()
    apart: list[tuple[int, Disagreement]] = []
    open_: Counter[str] = Counter()
    for at, one in enumerate(_each(seeds, jobs), 1):
        counts += one.counts
        apart += [(one.seed, found) for found in one.disagreements]
        open_.update(f"{found.what}: {found.more}" for found in one.incomplete)
        for found in one.disagreements:
            sys.stdout.write(f"seed {one.seed}: {found}\n")
        if at % 200 == 0:
            sys.stdout.write(
                f"{at} of {len(seeds)}, {time.perf_counter() - begun:.0f} s, {len(apart)} disagreements; {dict(sorted(counts.items()))}\n"
            )
            sys.stdout.flush()
    seconds = time.perf_counter() - begun
    said = {
        "seeds": [seeds.start, seeds.stop],
        "seconds": round(seconds, 1),
        "counts": dict(sorted(counts.items())),
        "disagreements": [
            [seed, found.what, found.level, found.obligation, found.more] for seed, found in apart
        ],
        "incomplete": dict(open_.most_common()),
    }
    sys.stdout.write(json.dumps(said, indent=2) + "\n")
    if out is not None:
        out.write_text(json.dumps(said, indent=2) + "\n", encoding="utf-8")
    return int(bool(apart))


def _each(seeds: range, jobs: int) -> Iterator[Judged]:
    if jobs == 1:
        yield from map(judged_seed, seeds)
        return
    with ProcessPoolExecutor(jobs, get_context("spawn"), gc.set_threshold, (200_000,)) as pool:
        yield from pool.map(judged_seed, seeds, chunksize=10)


if __name__ == "__main__":
    sys.exit(main())
