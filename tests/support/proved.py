"""What tests ask of the proof of a system: one obligation's shortest trace, cycles on inputs alone, a whole system."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from rcsc.compose.contract.obligations import Obligation, Sort, obligations, pairs
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun, ran_on
from rcsc.compose.counterexample.finding import Finding, rows
from rcsc.compose.counterexample.trace import NotReproducedError, Trace, TraceSearch, traces
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.system import SystemProof, prove_transition_systems, transition_systems
from rcsc.lang.model import Value


def every_obligation(ts: TransitionSystem) -> tuple[Obligation, ...]:
    """Return all that is owed of a level, and what would be wrong of two of its lines together."""
    cycle = ts.cycle(ts.havoc())
    return (*obligations(ts, cycle), *pairs(cycle))


def obligation_of(ts: TransitionSystem, sort: Sort, table: str = "", name: str = "") -> Obligation:
    """Return the obligation of this key."""
    return next(owed for owed in every_obligation(ts) if owed.key == (sort, table, name))


def shortest(
    ts: TransitionSystem, obligation: Obligation, most: int = 10, *, legal: bool = False
) -> Trace | None:
    """Find the shortest trace of at most `most` cycles; None where there is none or the solver gave up.

    Raises:
        NotReproducedError: The interpreter does not break the obligation there.
    """
    found = traces(ts, (obligation,), TraceSearch(most, legal=legal)).get(obligation.key)
    if isinstance(found, NotReproducedError):
        raise found
    return found


def ran(
    ts: TransitionSystem, start: Mapping[str, Value], inputs: Sequence[Mapping[str, Value]]
) -> tuple[CycleRun, ...]:
    """Run cycles from `start` on these inputs, up to the first fault that ends a run."""
    return ran_on(ts, start, [(taken, ()) for taken in inputs])


def prove_system(path: Path, effort: Effort) -> SystemProof:
    """Prove every level of the system that the file describes.

    Raises:
        BadDescription: The description says something that cannot be.
        NoProgramError: The tables of a level cannot be read.
    """
    made = transition_systems(path)
    return prove_transition_systems(made, effort, 1, tuple(made))


def time_line(made: Mapping[str, TransitionSystem], finding: Finding) -> list[str]:
    """Spell the time line: for each cycle the line that matched, what was taken, and what changed."""
    lines = []
    for row in rows(made, finding):
        who = f"level `{row.level}`, " if len(finding.levels) > 1 else ""
        wrong = f"; {row.wrong}" if row.wrong else ""
        lines.append(f"cycle {row.tick}: {who}table `{row.table}`, line `{row.line}`{wrong}")
        for word, changed in (("takes", row.takes), ("leaves", row.leaves)):
            if changed:
                lines.append(f"  {word} {', '.join(f'{name} = {said}' for name, said in changed.items())}")
    return lines
