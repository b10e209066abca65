"""For how long a requirement waits, over all states or over short runs; and the shortest run on which it waits for ever.

In: a circuit with one obligation, which every cycle breaks in which the requirement waits. Out: `Waits`. On a *lasso* it waits for ever:
from some cycle on it does so in each, and the last one leaves the state that the first of these found; numbers of orders that may be later
may be so (`shifted`).

Over all states: cycles in which it waits are the edges of a graph. States that none of its edges leaves are taken out, again and again.
If all go, the longest way is as many cycles as it may wait; if some stay, each of these has such an edge to another, and a lasso is there.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rcsc.compose.exact.circuit import Circuit
from rcsc.compose.exact.explicit import Pass, Run, Search, State, applies, at_literal
from rcsc.compose.exact.unrolled import Unrolled
from rcsc.proof.solvers.sat import GaveUpError, Sat
from rcsc.proof.symbolic.bits import FALSE, TRUE, Literal

MOST_EDGES = 2_000_000
"""An effort that is the same on every machine: cycles in which it waits, each a way from one state to another."""
MOST_GATES, MOST_CONFLICTS, MOST_CYCLES = 300_000, 2_000, 24
"""Gates of all cycles together, conflicts of a solver, and cycles of a run: an effort that is the same on every machine."""


@dataclass(frozen=True, slots=True)
class Lasso:
    """A run on which it waits for ever: after its last cycle all but `Circuit.numbers` is as before cycle `first`, counted from 1."""

    run: Run
    first: int


@dataclass(frozen=True, slots=True)
class Waits:
    """For how long a requirement waits.

    Attributes:
        most: The most cycles in a row, of those looked at.
        lasso: A run on which it waits for ever; None where none was found.
        complete: Whether that is so of all runs; else of those of `cycles` cycles.
    """

    most: int
    lasso: Lasso | None = None
    complete: bool = True
    cycles: int = 0


# --- over all states -------------------------------------------------------------------------


def of_all_states(circuit: Circuit) -> Waits | None:
    """Search all states; None where this does not apply, or they are too many."""
    if not applies(circuit):
        return None
    search = Search(circuit, Pass(circuit, circuit.step))
    ends = []
    for number in range(len(circuit.firsts)):
        wave = search.begin(number, set())
        while wave:
            if not search.goes_on:
                return None
            wave = search.further(wave, set(), number)
        ends.append(len(search.found.states))
    onward = _waiting_edges(search)
    if onward is None:
        return None
    most, left = _longest(onward)
    if not left:
        return Waits(max([*most, *(1 + most[at] for at in _waiting_at_first(search))], default=0))
    return Waits(0, _lasso(search, onward, left, ends))


def _waiting_edges(search: Search) -> list[list[int]] | None:
    """List for each state, by position, those to which a cycle leads in which it waits; None where they are too many."""
    places = {state: at for at, state in enumerate(search.found.states)}
    onward: list[list[int]] = [[] for _ in places]
    edges = begun = 0
    for part, columns in search.passes(search.found.states):
        for source, end in _waiting_edges_of(search.step, columns, len(part)):
            onward[begun + source].append(places[end])
            edges += 1
        if edges > MOST_EDGES:
            return None
        begun += len(part)
    return onward


def _waiting_at_first(search: Search) -> Iterator[int]:
    """Yield the states after first cycles in which it waits."""
    places = {state: at for at, state in enumerate(search.found.states)}
    for frame in search.circuit.firsts:
        first = Pass(search.circuit, frame)
        yield from (places[end] for _, end in _waiting_edges_of(first, first.columns(), 1))


def _waiting_edges_of(ran: Pass, columns: dict[int, int], states: int) -> Iterator[tuple[int, State]]:
    """Yield for each state of a pass, by position, each state after a cycle in which it waits, once and in order."""
    lanes = ran.many * states
    values = ran.values(columns, (1 << lanes) - 1)
    waits = values[at_literal(ran.frame.valid)] & values[at_literal(ran.frame.goes_on)]
    waits &= values[at_literal(-ran.frame.holds[0])]
    bits = np.frombuffer(waits.to_bytes((lanes + 7) // 8, "little"), np.uint8)
    kept = np.flatnonzero(np.unpackbits(bits, bitorder="little")[:lanes])
    if not len(kept):
        return
    sources = (kept // ran.many).astype(">u4").view(np.uint8).reshape(-1, 4)
    edges = np.ascontiguousarray(np.hstack([sources, ran.ends(values, lanes)[kept]]))
    for edge in np.unique(edges.view(f"V{edges.shape[1]}").ravel()):
        whole = edge.tobytes()
        yield int.from_bytes(whole[:4], "big"), whole[4:]


def _longest(onward: list[list[int]]) -> tuple[list[int], set[int]]:
    """Return how many edges follow one another from each state, and the states from which they need not end."""
    many, most = [len(targets) for targets in onward], [0] * len(onward)
    back: list[list[int]] = [[] for _ in onward]
    for source, targets in enumerate(onward):
        for target in targets:
            back[target].append(source)
    ends = deque(at for at, left in enumerate(many) if not left)
    while ends:
        target = ends.popleft()
        for source in back[target]:
            many[source] -= 1
            most[source] = max(most[source], 1 + most[target])
            if not many[source]:
                ends.append(source)
    return most, {at for at, left in enumerate(many) if left}


def _lasso(search: Search, onward: list[list[int]], left: set[int], ends: list[int]) -> Lasso:
    """Return the lasso whose loop is reached soonest, and of these the shortest."""
    states = search.found.states
    for at in sorted(left):  # in the order in which they were found
        loop = _loop(onward, left, at)
        if loop:
            number = next(number for number, end in enumerate(ends) if at < end)
            way = search.way(states[at])
            wanted = search.circuit.wanted[0]
            breaks = (*(None for _ in way[1:]), *(wanted for _ in loop))
            run = search.run_over((*way, *(states[place] for place in loop)), breaks, number)
            return Lasso(run, len(way))
        left.discard(at)
    raise AssertionError("each state that is left has an edge to another")


def _loop(onward: list[list[int]], left: set[int], start: int) -> list[int]:
    """Return the states after each cycle of the shortest loop from a state back to it; none where there is none."""
    before: dict[int, int] = {}
    wave = deque([start])
    while wave:
        source = wave.popleft()
        for target in onward[source]:
            if target == start:
                loop = [start]
                while source != start:
                    loop.append(source)
                    source = before[source]
                return loop[::-1]
            if target in left and target not in before:
                before[target] = source
                wave.append(target)
    return []


# --- over short runs -------------------------------------------------------------------------


def of_short_runs(circuit: Circuit, cycles: int = MOST_CYCLES) -> Waits:
    """Look at runs of at most so many cycles, and of at most so many gates: how long each waits in a row, and lassos."""
    size = len(circuit.needed(circuit.step.outputs)) * len(circuit.firsts)
    cycles = min(cycles, MOST_GATES // max(1, size))
    most = looked = 0
    every = [_Row(circuit, number) for number in range(len(circuit.firsts))]
    try:
        for looked in range(1, cycles + 1):
            for row in every:
                most = max(most, row.further(most))
                if (first := row.comes_round()) is not None:
                    run = Run(row.run.begins or 0, tuple(row.run.given()))
                    return Waits(most, Lasso(run, first), complete=False, cycles=looked)
    except GaveUpError:
        looked -= 1
    finally:
        for row in every:
            row.run.sat.close()
    return Waits(most, complete=False, cycles=looked)


class _Row:
    """Runs of one beginning, cycle by cycle.

    Attributes:
        run: The cycles.
    """

    def __init__(self, circuit: Circuit, number: int) -> None:
        self.run = Unrolled(circuit, number, Sat([[TRUE]], conflicts=MOST_CONFLICTS))
        self._circuit = circuit
        self._waits: list[int] = []
        self._latches: list[tuple[int, ...]] = []

    def further(self, most: int) -> int:
        """Add a cycle; return in how many in a row it may have waited at the end, if in more than so many."""
        self.run.further()
        self._waits.append(self.run.broken[0])
        self._latches.append(
            self._told_apart(dict(zip(self._circuit.latches, self.run.latches, strict=True)))
        )
        while most < len(self._waits) and self._may(self._waits[-most - 1 :]):
            most += 1
        return most

    def _told_apart(self, latches: Mapping[Literal, Literal]) -> tuple[Literal, ...]:
        """Return the bits after the last cycle by which states differ: of numbers that may all be later, those of their differences."""
        every = zip(self._circuit.leaves, self._circuit.words, strict=True)
        words = {leaf: [latches[abs(bit)] for bit in word if abs(bit) != TRUE] for leaf, word in every}
        first, *others = [words.pop(leaf) for leaf in sorted(self._circuit.numbers)] or [[]]
        apart = [bit for other in others for bit in self.run.difference(other, first)]
        return (*(bit for word in words.values() for bit in word), *apart)

    def comes_round(self) -> int | None:
        """Return the first cycle, from 1, of the shortest loop at the end in which it waits; None where there is none."""
        last = len(self._waits) - 1
        for first in range(last, 0, -1):
            loop = self._waits[first:]
            if not self._may(loop):
                return None
            same = [
                self.run.same(*pair)
                for pair in zip(self._latches[first - 1], self._latches[last], strict=True)
            ]
            if self._may([*loop, *same]):
                return first + 1
        return None

    def _may(self, literals: list[int]) -> bool:
        return FALSE not in literals and self.run.sat.holds([one for one in literals if one != TRUE])
