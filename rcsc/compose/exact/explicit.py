"""Search of all states of a level, breadth first: runs of thousands of cycles where a counter has to run out, and proofs where states end.

In: a circuit. Out: `Explored`: for each obligation that some run breaks the shortest such run; whether there are no other states; and the
states. No compiler is needed: a frame is evaluated gate by gate on words with a bit for each pair of a state and of what the environment
may give, so that thousands of cycles take one pass.

Exact: of each variable that the environment gives only some values are tried, such that every other does the same (`circuit.Given.points`);
the search does not apply where those are too many.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
import numpy.typing as npt

from rcsc.compose.contract.obligations import Obligation, ObligationKey
from rcsc.compose.contract.transition import Cycle
from rcsc.compose.exact.circuit import EARLY, Circuit, Frame, points_of, roots_of
from rcsc.proof.symbolic.bits import TRUE, Literal

MOST_GIVEN = 1 << 12
"""What the environment may give in a cycle, at most."""
MOST_STATES, MOST_CYCLES = 100_000, 1 << 23
"""An effort that is the same on every machine: states gone on from, and cycles evaluated."""
AT_ONCE = 1 << 15
"""Cycles in one pass."""
State = bytes
"""The values of all latches, a bit each, lowest first."""


@dataclass(frozen=True, slots=True)
class Run:
    """A run that breaks an obligation in its last cycle.

    Attributes:
        begins: Which of the first frames it begins with.
        given: For each cycle the key of each variable that the environment gives in it.
    """

    begins: int
    given: tuple[Mapping[str, int], ...]


@dataclass(slots=True)
class Explored:
    """What a search has found.

    Attributes:
        runs: The shortest run that breaks each obligation, of those found.
        states: All states found.
        cycles: Every run of so many cycles was looked at.
        complete: Whether there are no other states.
    """

    runs: dict[ObligationKey, Run] = field(default_factory=dict)
    states: list[State] = field(default_factory=list)
    cycles: int = 0
    complete: bool = False


class Pass:
    """A frame that is evaluated for many states at once."""

    def __init__(self, circuit: Circuit, frame: Frame) -> None:
        needed = circuit.needed(frame.outputs)
        self.frame = frame
        self._gates = [
            (2 * gate, at_literal(a), at_literal(b))
            for gate, (a, b) in circuit.ands.items()
            if gate in needed
        ]
        self._latches = circuit.latches
        self._size = 2 * circuit.count + 2
        free = frozenset(circuit.inputs(needed))
        named = {
            name: given for name, given in circuit.given.items() if free.intersection(map(abs, given.word))
        }
        alone = sorted(free.difference(*(map(abs, given.word) for given in named.values())))
        self.names = tuple(named)
        self._choices = [given.points for given in named.values()] + [(0, 1) for _ in alone]
        self._words = [given.word for given in named.values()] + [(one,) for one in alone]
        self.many = 1
        for points in self._choices:
            self.many *= len(points)

    def columns(self) -> dict[Literal, int]:
        """Return for each input the word of what it may be, all choices combined."""
        columns = dict.fromkeys((abs(bit) for word in self._words for bit in word if abs(bit) != TRUE), 0)
        for lane, chosen in enumerate(product(*self._choices)):
            for word, key in zip(self._words, chosen, strict=True):
                for place, bit in enumerate(word):
                    if abs(bit) != TRUE and (key >> place & 1) == (bit > 0):
                        columns[abs(bit)] |= 1 << lane
        return columns

    def given(self, lane: int) -> dict[str, int]:
        """Return what the environment gives in a lane."""
        keys = []
        for points in reversed(self._choices):
            lane, at = divmod(lane, len(points))
            keys.append(points[at])
        return dict(zip(self.names, reversed(keys), strict=False))

    def values(self, columns: Mapping[Literal, int], ones: int) -> list[int]:
        """Evaluate every literal, at twice its variable; its opposite stands one higher."""
        values = [0] * self._size
        values[at_literal(TRUE)] = ones
        for variable, column in columns.items():
            values[2 * variable], values[2 * variable + 1] = column, column ^ ones
        for gate, a, b in self._gates:
            values[gate] = both = values[a] & values[b]
            values[gate + 1] = both ^ ones
        return values

    def latched(self, states: Sequence[State]) -> Iterator[tuple[Literal, int]]:
        """Yield each latch with the word of its values in these states, each repeated for all that the environment may give."""
        rows = np.frombuffer(b"".join(states), np.uint8).reshape(len(states), -1)
        bits = np.unpackbits(rows, axis=1, bitorder="little")[:, : len(self._latches)]
        wide = np.packbits(np.repeat(bits, self.many, axis=0), axis=0, bitorder="little")
        for at, latch in enumerate(self._latches):
            yield latch, int.from_bytes(wide[:, at].tobytes(), "little")

    def ends(self, values: Sequence[int], lanes: int) -> npt.NDArray[np.uint8]:
        """Return the states after, a row for each lane."""
        if not self.frame.after:
            return np.zeros((lanes, 1), np.uint8)
        width = (lanes + 7) // 8
        columns = b"".join(values[at_literal(bit)].to_bytes(width, "little") for bit in self.frame.after)
        rows = np.frombuffer(columns, np.uint8).reshape(len(self.frame.after), width)
        bits = np.unpackbits(rows, axis=1, bitorder="little")[:, :lanes]
        return np.ascontiguousarray(np.packbits(bits, axis=0, bitorder="little").T)


def at_literal(literal: Literal) -> int:
    """Return where the values of a literal stand."""
    return 2 * literal if literal > 0 else 1 - 2 * literal


def may_apply(step: Cycle, wanted: Sequence[Obligation]) -> bool:
    """Return whether what the environment may give in a later cycle can be listed, without making a circuit."""
    leaves, read = roots_of(step, wanted)
    many = 1
    for name, points in points_of(read).items():
        many *= 1 if name in leaves else len(points)
    return 0 < many <= MOST_GIVEN


def applies(circuit: Circuit) -> bool:
    """Return whether what the environment may give in a cycle can be listed."""
    return all(0 < Pass(circuit, frame).many <= MOST_GIVEN for frame in (*circuit.firsts, circuit.step))


@dataclass(slots=True)
class Search:
    """One search.

    Attributes:
        step: A later cycle.
        found: What it has found so far.
    """

    circuit: Circuit
    step: Pass
    found: Explored = field(default_factory=Explored)
    _from: dict[State, State | None] = field(default_factory=dict)
    _done: int = 0

    @property
    def goes_on(self) -> bool:
        """Whether the effort is not spent."""
        return len(self._from) <= MOST_STATES and self._done <= MOST_CYCLES

    def begin(self, number: int, left: set[ObligationKey]) -> list[State]:
        """Run the first cycles of one kind; return the new states after them."""
        first = Pass(self.circuit, self.circuit.firsts[number])
        return self._ran(first, first.columns(), [None], left, number)

    def further(self, states: Sequence[State], left: set[ObligationKey], number: int) -> list[State]:
        """Run one more cycle from these states; return the new ones."""
        following = list[State]()
        for part, columns in self.passes(states):
            following += self._ran(self.step, columns, list(part), left, number)
        return following

    def passes(self, states: Sequence[State]) -> Iterator[tuple[Sequence[State], dict[Literal, int]]]:
        """Yield states that go in one pass, and its words of inputs and latches: a lane for each state and all that may be given."""
        size, columns = max(1, AT_ONCE // self.step.many), self.step.columns()
        for at in range(0, len(states), size):
            part = states[at : at + size]
            whole = sum(1 << self.step.many * place for place in range(len(part)))
            repeated = {variable: column * whole for variable, column in columns.items()}
            repeated.update(self.step.latched(part))
            yield part, repeated

    def _ran(
        self,
        ran: Pass,
        columns: Mapping[Literal, int],
        starts: Sequence[State | None],
        left: set[ObligationKey],
        number: int,
    ) -> list[State]:
        lanes = ran.many * len(starts)
        self._done += lanes
        values = ran.values(columns, (1 << lanes) - 1)
        valid = values[at_literal(ran.frame.valid)]
        on = valid & values[at_literal(ran.frame.goes_on)]
        for key, holds in zip(self.circuit.wanted, ran.frame.holds, strict=True):
            wrong = (valid if key[0] in EARLY else on) & values[at_literal(-holds)]
            if wrong and key in left:
                lane = (wrong & -wrong).bit_length() - 1
                left.discard(key)
                self.found.runs[key] = self._run(starts[lane // ran.many], number, key)
        return self._new(ran, ran.ends(values, lanes), on, starts)

    def _new(
        self, ran: Pass, rows: npt.NDArray[np.uint8], on: int, starts: Sequence[State | None]
    ) -> list[State]:
        lanes = len(rows)
        kept = np.unpackbits(
            np.frombuffer(on.to_bytes((lanes + 7) // 8, "little"), np.uint8), bitorder="little"
        )
        places = np.flatnonzero(kept[:lanes])
        if not len(places):
            return []
        _, first = np.unique(rows[places].view(f"V{rows.shape[1]}").ravel(), return_index=True)
        new = []
        for lane in sorted(int(places[at]) for at in first):
            state = rows[lane].tobytes()
            if state not in self._from:
                self._from[state] = starts[lane // ran.many]
                new.append(state)
        self.found.states += new
        return new

    # --- runs ---

    def _run(self, state: State | None, number: int, wrong: ObligationKey) -> Run:
        """Return the run that leads over the states found to this cycle."""
        way = self.way(state)
        return self.run_over((*way, None), (*(None for _ in way[1:]), wrong), number)

    def way(self, state: State | None) -> tuple[State | None, ...]:
        """Return the states on the shortest way to a state, from None, before the first cycle."""
        states: list[State | None] = [state]
        while (last := states[-1]) is not None:
            states.append(self._from[last])
        return tuple(reversed(states))

    def run_over(
        self, states: Sequence[State | None], breaks: Sequence[ObligationKey | None], number: int
    ) -> Run:
        """Return a run from state to state, in which what the environment gives stays as it was where it can.

        Args:
            states: None before the first cycle; any state after the last where that is None.
            breaks: For each cycle the obligation that it breaks, if it is to.
            number: Which of the first frames it begins with.
        """
        first = Pass(self.circuit, self.circuit.firsts[number])
        given: list[Mapping[str, int]] = []
        before: Mapping[str, int] = {}
        for at, wrong in enumerate(breaks):
            ran = self.step if at else first
            lanes = self._lanes(ran, states[at], states[at + 1], wrong)
            chosen = max(map(ran.given, lanes), key=lambda one: _alike(ran.frame, one, before))
            given.append(chosen)
            before = by_leaf(ran.frame, chosen)
        return Run(number, tuple(given))

    def _lanes(
        self, ran: Pass, start: State | None, end: State | None, wrong: ObligationKey | None
    ) -> list[int]:
        """List what the environment may give so that the cycle leads there, if anywhere, and breaks the obligation, if any."""
        columns = ran.columns()
        if start is not None:
            columns |= ran.latched([start])
        values = ran.values(columns, (1 << ran.many) - 1)
        right = values[at_literal(ran.frame.valid)]
        if wrong is not None:
            right &= values[at_literal(-ran.frame.holds[self.circuit.wanted.index(wrong)])]
        if wrong is None or wrong[0] not in EARLY:
            right &= values[at_literal(ran.frame.goes_on)]
        rows = ran.ends(values, ran.many)
        return [
            lane
            for lane in range(ran.many)
            if right >> lane & 1 and (end is None or rows[lane].tobytes() == end)
        ]


def by_leaf(frame: Frame, given: Mapping[str, int]) -> dict[str, int]:
    """Return what the environment gives, inputs by their leaves."""
    leaves = {node.name: leaf for leaf, node in frame.cycle.taken.items()}
    return {leaves.get(name, name): key for name, key in given.items()}


def _alike(frame: Frame, given: Mapping[str, int], before: Mapping[str, int]) -> int:
    return sum(before.get(name) == key for name, key in by_leaf(frame, given).items())


def explored(circuit: Circuit) -> Explored:
    """Search all states of a circuit to which this applies, up to an effort that is the same on every machine."""
    search = Search(circuit, Pass(circuit, circuit.step))
    left = set(circuit.wanted)
    for number in range(len(circuit.firsts)):
        wave, cycles = search.begin(number, left), 1
        while wave and left:
            if not search.goes_on:
                search.found.cycles = cycles if number == 0 else search.found.cycles
                return search.found
            wave = search.further(wave, left, number)
            cycles += 1
        search.found.cycles = max(search.found.cycles, cycles)
    search.found.complete = not wave
    return search.found


def keys_of(circuit: Circuit, states: Sequence[State]) -> list[tuple[int, ...]]:
    """Return for each state the key of each leaf."""
    found = []
    for state in states:
        bits = int.from_bytes(state, "little")
        read = {latch: bool(bits >> at & 1) for at, latch in enumerate(circuit.latches)}
        found.append(tuple(circuit.key(at, read) for at in range(len(circuit.leaves))))
    return found
