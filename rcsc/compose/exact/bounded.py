"""The shortest runs that break obligations, by bounded model checking: one solver, a cycle more at a time.

Source: Biere, Cimatti, Clarke and Zhu, "Symbolic model checking without BDDs", 1999.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from rcsc.compose.contract.obligations import ObligationKey
from rcsc.compose.exact.circuit import Circuit
from rcsc.compose.exact.explicit import Run
from rcsc.compose.exact.unrolled import Unrolled
from rcsc.proof.solvers.sat import GaveUpError, Sat
from rcsc.proof.symbolic.bits import FALSE, TRUE, Literal

MOST_GATES, MOST_CONFLICTS = 500_000, 2_000
"""Gates of all cycles together, and conflicts for each obligation: an effort that is the same on every machine."""


@dataclass(slots=True)
class Looked:
    """What a bounded search has found.

    Attributes:
        runs: The shortest run that breaks each obligation, of those found.
        cycles: No run of so many cycles breaks any other, but those of `until`.
        until: Those that the solver gave up before, each with of how many cycles no run breaks it.
    """

    runs: dict[ObligationKey, Run] = field(default_factory=dict)
    cycles: int = 0
    until: dict[ObligationKey, int] = field(default_factory=dict)


def looked(circuit: Circuit, most: int) -> Looked:
    """Search runs of at most so many cycles, and of at most so many gates in all."""
    return looked_without(circuit, most, ((),))[0]


def looked_without(
    circuit: Circuit, most: int, never: Sequence[Collection[str]], conflicts: int = MOST_CONFLICTS
) -> tuple[Looked, ...]:
    """Search the same, all in one, of runs in which some variables that the environment gives are never true.

    Args:
        circuit: The level.
        most: How many cycles a run has at most.
        never: Names of variables; a result for each. What has no run with the first has none with any other.
        conflicts: For each obligation, after which the solver gives it up.
    """
    search = _Search(circuit, never, conflicts)
    size = len(circuit.needed(circuit.step.outputs)) * len(circuit.firsts)
    try:
        for cycles in range(1, min(most, MOST_GATES // max(1, size)) + 1):
            search.further()
            if search.over:
                break
            for each in search.found:
                each.cycles = cycles
    finally:
        search.close()
    return tuple(search.found)


class _Search:
    """One search, of runs that become longer."""

    def __init__(self, circuit: Circuit, never: Sequence[Collection[str]], conflicts: int) -> None:
        self.circuit, self.never = circuit, never
        self.found = [Looked() for _ in never]
        self.every = [Unrolled(circuit, number, Sat([[TRUE]])) for number in range(len(circuit.firsts))]
        self.left = dict.fromkeys(circuit.wanted, conflicts)

    @property
    def over(self) -> bool:
        """Whether there is nothing left to ask."""
        return all(
            key in each.runs or key in each.until for each in self.found for key in self.circuit.wanted
        )

    def further(self) -> None:
        """Look at runs of a cycle more."""
        for run in self.every:
            run.further()
            for key, broken in zip(self.circuit.wanted, run.broken, strict=True):
                if broken != FALSE:
                    self._ask(key, run, broken)

    def _ask(self, key: ObligationKey, run: Unrolled, broken: Literal) -> None:
        """Note the runs that break an obligation in their last cycle, of those that no shorter one breaks."""
        for each, names in zip(self.found, self.never, strict=True):
            if key in each.runs or key in each.until:
                continue
            before = run.sat.conflicts
            try:
                broken_there = run.sat.holds([broken, *run.never(names)], max(1, self.left[key]))
            except GaveUpError:
                each.until[key] = each.cycles
                continue
            finally:
                self.left[key] -= run.sat.conflicts - before
            if broken_there:
                each.runs[key] = Run(run.begins or 0, tuple(run.given()))
            elif each is self.found[0]:
                return

    def close(self) -> None:
        """Free the solvers."""
        for run in self.every:
            run.sat.close()
