"""The shortest runs that break obligations, by bounded model checking: one solver, a cycle more at a time.

Source: Biere, Cimatti, Clarke and Zhu, "Symbolic model checking without BDDs", 1999.
"""

from dataclasses import dataclass, field

from rcsc.compose.contract.obligations import ObligationKey
from rcsc.compose.exact.circuit import Circuit
from rcsc.compose.exact.explicit import Run
from rcsc.compose.exact.unrolled import Unrolled
from rcsc.proof.solvers.sat import GaveUpError, Sat
from rcsc.proof.symbolic.bits import FALSE, TRUE

MOST_GATES, MOST_CONFLICTS = 500_000, 2_000
"""Gates of all cycles together, and conflicts of a solver: an effort that is the same on every machine."""


@dataclass(slots=True)
class Looked:
    """What a bounded search has found.

    Attributes:
        runs: The shortest run that breaks each obligation, of those found.
        cycles: No run of so many cycles breaks any other.
    """

    runs: dict[ObligationKey, Run] = field(default_factory=dict)
    cycles: int = 0


def looked(circuit: Circuit, most: int) -> Looked:
    """Search runs of at most so many cycles, and of at most so many gates in all."""
    found = Looked()
    every = [
        Unrolled(circuit, number, Sat([[TRUE]], conflicts=MOST_CONFLICTS))
        for number in range(len(circuit.firsts))
    ]
    size = len(circuit.needed(circuit.step.outputs)) * len(every)
    try:
        for cycles in range(1, min(most, MOST_GATES // max(1, size)) + 1):
            for number, run in enumerate(every):
                run.further()
                for key, broken in zip(circuit.wanted, run.broken, strict=True):
                    if broken != FALSE and key not in found.runs and run.sat.holds([broken]):
                        found.runs[key] = Run(number, tuple(run.given()))
            if len(found.runs) == len(circuit.wanted):
                break
            found.cycles = cycles
    except GaveUpError:
        pass
    finally:
        for run in every:
            run.sat.close()
    return found
