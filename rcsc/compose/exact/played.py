"""A run of a circuit as what the environment gives to the interpreter, and the shortest runs of a level's obligations.

In: a level and obligations. Out: for each that some run breaks, the leaves with which it begins and the inputs of each cycle. The
interpreter runs them before anybody is shown them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rcsc.compose.contract.obligations import Obligation, ObligationKey
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.exact import explicit
from rcsc.compose.exact.bounded import looked
from rcsc.compose.exact.circuit import Circuit, circuit
from rcsc.compose.exact.explicit import Run
from rcsc.lang.interpret import initial
from rcsc.lang.model import Value, key_of, value_of_key
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.trial import value_at


@dataclass(frozen=True, slots=True)
class Played:
    """A run, for the interpreter.

    Attributes:
        start: Every leaf before its first cycle.
        taken: The inputs of each cycle.
        restarted: Whether it begins where a restart does.
        opened: The operations that the circuit leaves open: if it does not run so, that need not be a bug.
    """

    start: Mapping[str, Value]
    taken: tuple[Mapping[str, Value], ...]
    restarted: bool
    opened: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class EveryRun:
    """What a search of all states tells.

    Attributes:
        runs: The shortest run that breaks each obligation, of those that some run breaks.
        states: How many states there are, if that was all of them.
    """

    runs: Mapping[ObligationKey, Played]
    states: int | None


def every_run(ts: TransitionSystem, firsts: Sequence[Cycle], wanted: Sequence[Obligation]) -> EveryRun | None:
    """Search all states of a level; None where this does not apply.

    Args:
        ts: The level.
        firsts: The first cycle, and the first after a restart.
        wanted: Obligations of any cycle.
    """
    step = ts.cycle(ts.havoc())
    if any(cycle.calls for cycle in (*firsts, step)):
        return None  # what an extern procedure gives is no input
    if not explicit.may_apply(step, wanted):
        return None
    made = circuit(ts, firsts, step, wanted)
    if not explicit.applies(made):
        return None
    found = explicit.explored(made)
    runs = {key: played(ts, made, run) for key, run in found.runs.items()}
    return EveryRun(runs, len(found.states) if found.complete else None)


def further_runs(
    ts: TransitionSystem, firsts: Sequence[Cycle], wanted: Sequence[Obligation], most: int
) -> dict[ObligationKey, Played]:
    """Return the shortest run that breaks each obligation, of those of at most so many cycles that bounded search finds."""
    step = ts.cycle(ts.havoc())
    if any(cycle.calls for cycle in (*firsts, step)):
        return {}
    made = circuit(ts, firsts, step, wanted)
    return {key: played(ts, made, run) for key, run in looked(made, most).runs.items()}


def played(ts: TransitionSystem, made: Circuit, run: Run) -> Played:
    """Return a run of a circuit for the interpreter; what it does not tell stays as it is."""
    first = made.firsts[run.begins].cycle
    start = dict(initial(ts.program))
    start |= _begun(first, run.given[0], start)
    before, taken = {name: start[name] for name in ts.inputs}, list[Mapping[str, Value]]()
    for number, given in enumerate(run.given):
        cycle = made.step.cycle if number else first
        told = {
            name: value_of_key(node.kind, given[node.name])
            for name, node in cycle.taken.items()
            if node.name in given
        }
        before = {**before, **told}
        taken.append(before)
    return Played(start, tuple(taken), first.anew, made.opened)


def _begun(first: Cycle, given: Mapping[str, int], usual: Mapping[str, Value]) -> dict[str, Value]:
    """Return the leaves before the first cycle; of what stood in buffers only what the run tells differs from what is usual."""
    variables = values.variables(first.before.values())
    point = {name: value_of_key(node.kind, given[name]) for name, node in variables.items() if name in given}
    for leaf, node in first.before.items():
        if node.name in variables and node.name not in point:
            point[node.name] = usual.get(leaf, value_of_key(node.kind, 0))
    begun = {}
    for leaf in usual:
        node = first.before[leaf]
        value = value_at(node, point)
        assert value is not None
        begun[leaf] = value_of_key(node.kind, key_of(node.kind, value))
    return begun
