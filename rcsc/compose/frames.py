"""Inductive invariants found backwards from what is to be proved: clauses over the features of a level.

In: features, the cycles with which a level begins, a cycle from anywhere, its goals, and some states that are known to be
reached. Out: clauses that hold behind every first cycle, that every cycle keeps, and from which no cycle breaks a goal; and the
goals for which the features do not suffice.

How: *frame* i is a set of clauses that hold behind every run of at most i cycles. A state of the last frame from which a cycle
breaks a goal has to be excluded: it is asked whether a first cycle, or a cycle from the frame before, leads to it; if one does,
that state is to be excluded first. If none does, the state is generalised, feature by feature, as long as that stays true, and
a clause is added. When every clause of a frame holds in the next one, they are an invariant. This is property directed
reachability (Bradley, "SAT-based model checking without unrolling", 2011; Een, Mishchenko and Brayton, "Efficient
implementation of property directed reachability", 2011) on states as the features show them, without making that abstraction
(Cimatti, Griggio, Mover and Tonetta, "IC3 modulo theories via implicit predicate abstraction", 2014).

A goal that is reached so is not proved; it need not be false, since two states that the features do not tell apart are one here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush

import numpy as np
import numpy.typing as npt

from rcsc.compose.bits import Bits, Literal, Word, key_of_bits
from rcsc.compose.features import Feature
from rcsc.compose.sat import Sat
from rcsc.compose.transition import Cycle
from rcsc.model import Bool
from rcsc.prove.values import Node

Point = tuple[int, ...]
"""A value for each feature."""
Clause = tuple[tuple[int, int], ...]
"""Features, by position, and values that never stand together."""
Cube = dict[int, int]
"""Values of some features: what a clause forbids."""
WIDE = 64
"""More than the values of any feature."""


class Posed:
    """A cycle as clauses, with a literal for every value of every feature before and behind it.

    Attributes:
        before: By feature and value; likewise `after`.
        holds: The literal of each goal, by its position.
    """

    def __init__(self, features: Sequence[Feature], cycle: Cycle, goals: Mapping[int, Node]) -> None:
        starts = [one.node(cycle.before) for one in features]
        ends = [one.node(cycle.after) for one in features]
        bits = Bits.of((*starts, *ends, cycle.contract, *goals.values()))
        self._kinds = [one.kind for one in features]
        self._starts = [bits.word(node) for node in starts]
        self._ends = [bits.word(node) for node in ends]
        self.before = self._values(bits, features, self._starts)
        self.after = self._values(bits, features, self._ends)
        self.holds = {at: bits.literal(node) for at, node in goals.items()}
        contract = bits.literal(cycle.contract)
        self.sat = Sat([*bits.clauses, [contract]])
        self._count = bits.count

    @staticmethod
    def _values(
        bits: Bits, features: Sequence[Feature], words: Sequence[Word]
    ) -> dict[tuple[int, int], Literal]:
        return {
            (at, value): bits.equals(word, one.kind, value)
            for at, (one, word) in enumerate(zip(features, words, strict=True))
            for value in range(one.size)
        }

    def fresh(self) -> Literal:
        """A literal that nothing is said of yet."""
        self._count += 1
        return self._count

    def start(self) -> Point:
        """The features before the cycle in the last model."""
        return self._point(self._starts)

    def end(self) -> Point:
        """The features behind the cycle in the last model."""
        return self._point(self._ends)

    def _point(self, words: Sequence[Word]) -> Point:
        read = [[self.sat.value(literal) for literal in word] for word in words]
        return tuple(
            int(bits[0]) if isinstance(kind, Bool) else key_of_bits(bits)
            for kind, bits in zip(self._kinds, read, strict=True)
        )


@dataclass(slots=True)
class Reached:
    """States known to be reached, to answer at once that one of them cannot be excluded."""

    _points: npt.NDArray[np.int16]

    @classmethod
    def of(cls, points: Iterable[Point], width: int) -> "Reached":
        """Of these; `width` features each."""
        every = list(points)
        return cls(np.array(every, dtype=np.int16).reshape(len(every), width))

    @property
    def many(self) -> int:
        """How many there are."""
        return len(self._points)

    def add(self, point: Point) -> None:
        """One more."""
        self._points = np.vstack([self._points, np.array([point], dtype=np.int16)])

    def shows(self, cube: Mapping[int, int]) -> bool:
        """Whether one of them has these values."""
        shown = np.ones(len(self._points), dtype=bool)
        for at, value in cube.items():
            shown &= self._points[:, at] == value
        return bool(shown.any())


@dataclass(slots=True)
class Frames:
    """The search, for one level.

    Attributes:
        firsts: The cycles with which it begins.
        step: Any later one.
        weights: Of the features; those of small weight are left out of a clause first.
        known: Clauses that are an invariant already.
    """

    firsts: Sequence[Posed]
    step: Posed
    reached: Reached
    weights: Sequence[int]
    known: Sequence[Clause] = ()
    _frames: list[list[Cube]] = field(default_factory=lambda: [[]])
    _held: list[Literal] = field(default_factory=lambda: [0])
    _open: set[int] = field(default_factory=set)
    _cores: list[list[tuple[int, Cube]]] = field(init=False)

    def __post_init__(self) -> None:
        self._cores = [[] for _ in self.firsts]

    def search(self, wanted: Iterable[int]) -> tuple[list[Clause], set[int]]:
        """An invariant, and which goals it does not prove.

        Args:
            wanted: The goals looked at, by position.

        Raises:
            GaveUpError: The solver did.
        """
        goals = set(wanted)
        for clause in self.known:
            self.step.sat.add([-self.step.before[value] for value in clause])
        self._begin(goals)
        self._deepen()
        while True:
            self._exclude(goals)
            self._deepen()
            done = self._push()
            if done is not None:
                found = [cube for frame in self._frames[done + 1 :] for cube in frame]
                return [*self.known, *(tuple(sorted(cube.items())) for cube in found)], self._open

    # --- goals ---

    def _begin(self, goals: set[int]) -> None:
        """Goals that a first cycle breaks are open."""
        for at in sorted(goals):
            if any(first.sat.holds([-first.holds[at]]) for first in self.firsts):
                self._leave(goals, [at])

    def _leave(self, goals: set[int], broken: Iterable[int]) -> None:
        for at in broken:
            goals.discard(at)
            self._open.add(at)

    def _exclude(self, goals: set[int]) -> None:
        """Excludes every state of the last frame from which a cycle breaks a goal, or leaves the goal open."""
        last = len(self._frames) - 1
        while True:
            switch = self.step.fresh()
            self.step.sat.add([-switch, *(-self.step.holds[at] for at in sorted(goals))])
            if not self.step.sat.holds([*self._held[last:], switch]):
                return
            point = self.step.start()
            broken = [at for at in goals if not self.step.sat.value(self.step.holds[at])]
            self.step.sat.add([-switch])
            if not self._block(point, last):
                self._leave(goals, broken)

    def _block(self, point: Point, last: int) -> bool:
        """Excludes a state from a frame, and first what leads to it; False where it is reached after all."""
        waiting = [(last, 0, point)]
        count = 0
        while waiting:
            level, _, now = waiting[0]
            cube = dict(enumerate(now))
            if self.reached.shows(cube):
                return False
            if self._excluded(cube, level):
                heappop(waiting)
                continue
            if self._not_first(cube) is None:
                return False
            found = self._inductive(cube, level)
            if found is None:
                count -= 1
                heappush(waiting, (level - 1, count, self.step.start()))
                continue
            heappop(waiting)
            highest = self._add(self._general(found, level), level)
            if highest < len(self._frames) - 1:
                heappush(waiting, (highest + 1, count, now))
        return True

    def _excluded(self, cube: Cube, level: int) -> bool:
        return not self.step.sat.holds(
            [*self._held[level:], *(self.step.before[value] for value in cube.items())]
        )

    # --- generalisation ---

    def _not_first(self, cube: Cube) -> Cube | None:
        """Values of the cube with which no first cycle ends; None where one ends with all of them."""
        kept: Cube = {}
        bits = _mask(cube)
        for first, cores in zip(self.firsts, self._cores, strict=True):
            found = next((core for mask, core in cores if mask & bits == mask), None)
            if found is None:
                if first.sat.holds([first.after[value] for value in cube.items()]):
                    self.reached.add(first.end())
                    return None
                core = first.sat.core()
                found = {at: value for at, value in cube.items() if first.after[at, value] in core}
                cores.append((_mask(found), found))
            kept |= found
        return kept

    def _not_next(self, cube: Cube, level: int) -> Cube | None:
        """Values of the cube to which no cycle leads from the frame outside the cube; None where one leads to all."""
        if level == 0:
            return {}
        step, switch = self.step, self.step.fresh()
        step.sat.add([-switch, *(-step.before[value] for value in cube.items())])
        led = step.sat.holds([*self._held[level:], switch, *(step.after[value] for value in cube.items())])
        core = None if led else step.sat.core()
        step.sat.add([-switch])
        if core is None:
            return None
        return {at: value for at, value in cube.items() if step.after[at, value] in core}

    def _inductive(self, cube: Cube, level: int) -> Cube | None:
        """Values of the cube that no run of at most `level` cycles ends with; None where one may end with all of them."""
        if self.reached.shows(cube):
            return None
        kept = self._not_first(cube)
        core = None if kept is None else self._not_next(cube, level - 1)
        if kept is None or core is None:
            return None
        found = kept | core
        return cube if not found or self.reached.shows(found) else found

    def _general(self, cube: Cube, level: int) -> Cube:
        """As few values of the cube as are excluded like it."""
        for at in self._in_order(cube):
            less = {one: value for one, value in cube.items() if one != at}
            if at in cube and less:
                cube = self._inductive(less, level) or cube
        return cube

    def _in_order(self, cube: Cube) -> list[int]:
        return sorted(cube, key=lambda at: (self.weights[at], at))

    # --- frames ---

    def _deepen(self) -> None:
        self._frames.append([])
        self._held.append(self.step.fresh())

    def _add(self, cube: Cube, level: int) -> int:
        """Adds a clause to the last frame in which it can stand; says which."""
        while level < len(self._frames) - 1 and self._not_next(cube, level) is not None:
            level += 1
        for lower in range(1, level + 1):
            self._frames[lower] = [one for one in self._frames[lower] if not cube.items() <= one.items()]
        self._frames[level].append(cube)
        self.step.sat.add([-self._held[level], *(-self.step.before[value] for value in cube.items())])
        return level

    def _push(self) -> int | None:
        """Moves clauses up; the frame that has none of its own left, if one has."""
        for level in range(1, len(self._frames) - 1):
            for cube in list(self._frames[level]):
                if cube in self._frames[level] and self._kept(cube, level):
                    self._frames[level].remove(cube)
                    self._add(cube, level + 1)
            if not self._frames[level]:
                return level
        return None

    def _kept(self, cube: Cube, level: int) -> bool:
        """Whether a cycle from the frame keeps the clause."""
        step = self.step
        return not step.sat.holds([*self._held[level:], *(step.after[value] for value in cube.items())])


def _mask(cube: Cube) -> int:
    """A cube as a set of bits: one is part of another where its bits are."""
    return sum(1 << (at * WIDE + value) for at, value in cube.items())
