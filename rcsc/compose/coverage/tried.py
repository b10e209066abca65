"""Levels in which some uses are off: runs that break what is owed of them, each repeated by the interpreter.

In: a level in one environment. Out: the obligations that some run breaks, and whether all runs were looked at; of a program with switches
short runs for many slips at once, by one solver, in which a switch is the same in all cycles.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.compose.contract.claims import Key
from rcsc.compose.contract.obligations import Obligation, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import broken, ran_on
from rcsc.compose.coverage.parts import Switched, Use
from rcsc.compose.exact.circuit import Circuit, Frame, circuit
from rcsc.compose.exact.explicit import Run
from rcsc.compose.exact.played import Played, every_run, further_runs, played
from rcsc.compose.exact.unrolled import Unrolled
from rcsc.proof.solvers.sat import GaveUpError, Sat
from rcsc.proof.symbolic.bits import FALSE, TRUE, Literal

CYCLES = 8
"""Cycles of the runs that are looked for where states cannot be listed."""
MOST_GATES = 2_000_000
"""Gates of all cycles together of a run that a solver looks for."""
CONFLICTS = 100_000
"""Conflicts of a solver: some seconds, the same on every machine."""


@dataclass(frozen=True, slots=True)
class Tried:
    """What runs have shown.

    Attributes:
        broken: The obligations that a run breaks.
        complete: Whether all runs were looked at.
    """

    broken: frozenset[Key]
    complete: bool


def tried(ts: TransitionSystem, wanted: Collection[Key], cycles: int = CYCLES) -> Tried:
    """Look at all runs where the states of a level can be listed; else at those of at most so many cycles."""
    owed = [one for one in obligations(ts, ts.cycle(ts.havoc())) if one.key in wanted]
    firsts = tuple(ts.firsts().values())
    every = every_run(ts, firsts, owed)
    runs = every.runs if every is not None else further_runs(ts, firsts, owed, cycles) if cycles else {}
    found = frozenset(one.key for one in owed if one.key in runs and _breaks(ts, one, runs[one.key]))
    listed = every is not None and every.states is not None
    return Tried(found, complete=listed and found == runs.keys())


def _breaks(ts: TransitionSystem, owed: Obligation, run: Played) -> bool:
    """Return whether the interpreter breaks an obligation in the last cycle of a run."""
    steps = ran_on(ts, run.start, [(taken, ()) for taken in run.taken])
    return len(steps) == len(run.taken) and broken(ts, owed, steps[-1])


# --- many slips at once ----------------------------------------------------------------------


def short_runs(
    ts: TransitionSystem,
    made: Switched,
    slips: Sequence[Collection[Use]],
    wanted: Collection[Key],
    cycles: int,
) -> Mapping[int, Key]:
    """Return for each slip, by position, an obligation that a short run breaks.

    Args:
        ts: The level with switches.
        made: What they switch.
        slips: The uses that each leaves out.
        wanted: The obligations that hold where nothing is left out.
        cycles: Of the longest run.
    """
    step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    if any(cycle.calls for cycle in (*firsts, step)):
        return {}
    owed = [one for one in obligations(ts, step) if one.key in wanted]
    gates = circuit(ts, firsts, step, owed)
    found: dict[int, Key] = {}
    for number in range(len(firsts)):
        try:
            for slip, key, given in _found(gates, number, made, slips, found, cycles):
                run = played(ts, gates, Run(number, given))
                if _breaks(ts, next(one for one in owed if one.key == key), run):
                    found[slip] = key
        except GaveUpError:
            continue
    return found


def _found(
    gates: Circuit,
    number: int,
    made: Switched,
    slips: Sequence[Collection[Use]],
    known: Mapping[int, Key],
    cycles: int,
) -> Iterator[tuple[int, Key, tuple[Mapping[str, int], ...]]]:
    """Yield runs from one beginning, a cycle longer each time, for slips that are not known to break anything."""
    run = _Switching(gates, number, Sat([[TRUE]], conflicts=CONFLICTS))
    size = len(gates.needed(gates.step.outputs))
    for _ in range(min(cycles, MOST_GATES // max(1, size))):
        run.further()
        any_ = run.any_broken()
        for at, slip in enumerate(slips):
            if at in known:
                continue
            off = {made.switches[use] for use in slip}
            on = [-bit if name in off else bit for name, bit in run.switches.items()]
            if run.sat.holds([any_, *on]):
                key = next(
                    key
                    for key, bit in zip(gates.wanted, run.broken, strict=True)
                    if bit == TRUE or (bit != FALSE and run.sat.value(bit))
                )
                yield at, key, tuple(run.given())
    run.sat.close()


@dataclass(slots=True)
class _Switching(Unrolled):
    """A run in which each switch is the same in all cycles.

    Attributes:
        switches: The literal of each.
    """

    switches: dict[str, Literal] = field(default_factory=dict)

    def any_broken(self) -> Literal:
        """Return a literal under which the last cycle breaks some obligation."""
        some = self.fresh()
        self.sat.add([-some, *(bit for bit in self.broken if bit != FALSE)])
        return some

    def _copied(self, frame: Frame) -> dict[Literal, Literal]:
        of = super(_Switching, self)._copied(frame)
        for name, given in self.circuit.given.items():
            switch = frame.cycle.taken  # what a cycle takes is named after it
            leaf = next((leaf for leaf, node in switch.items() if node.name == name), "")
            if leaf.startswith("switch ") and abs(given.word[0]) in of:
                one = of[abs(given.word[0])]
                shared = self.switches.setdefault(leaf, one)
                if shared != one:
                    self.sat.add([-shared, one])
                    self.sat.add([shared, -one])
        return of
