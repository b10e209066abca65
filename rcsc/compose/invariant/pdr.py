"""Inductive invariants found backwards from what is to be proved: clauses over the predicates of a level.

In: predicates, the cycles with which a level begins, a cycle from any state, its obligations, and some states that are known to be
reached. Out: clauses that hold after every first cycle, that every cycle keeps, and from which no cycle breaks an obligation; and the
obligations for which the predicates do not suffice.

How: *frame* i is a set of clauses that hold after every run of at most i cycles. A state of the last frame from which a cycle
breaks an obligation has to be excluded: it is asked whether a first cycle, or a cycle from the frame before, leads to it; if one does,
that state is to be excluded first. If none does, the state is generalised, predicate by predicate, as long as that stays true: a
predicate is left out, or, if it has many values, all but a few of them are excluded with the one, so that clauses do not grow in
number with the members of an enumeration. A clause is added. When every clause of a frame holds in the next one, they are an
invariant. This is property directed reachability (Bradley, "SAT-based model checking without unrolling", 2011; Een, Mishchenko
and Brayton, "Efficient implementation of property directed reachability", 2011) on states as the predicates show them, without
making that abstraction (Cimatti, Griggio, Mover and Tonetta, "IC3 modulo theories via implicit predicate abstraction", 2014).

An obligation that is reached so is not proved; it need not be false, since two states that the predicates do not tell apart are one here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush

from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle
from rcsc.compose.invariant.cubes import Cube, Masks, Pair, Reached, Valuation
from rcsc.lang.model import Bool
from rcsc.solvers.sat import Sat
from rcsc.symbolic.bits import Bits, Literal, Word, key_of_bits
from rcsc.symbolic.values import Node

Clause = Cube
"""What never stands together."""
MANY = 2
"""Of a predicate with more values a clause may name those that are allowed, and so forbid all others at once."""
TRIES = 8
"""How often it is asked, each time with one more value allowed, before a clause forbids a single one after all."""


class Posed:
    """A cycle as clauses, with a literal for every value of every predicate before and after it.

    Attributes:
        sizes: How many values each predicate has.
        before: By predicate and value, had or not; likewise `after`.
        holds: The literal of each obligation, by its position.
    """

    def __init__(
        self, predicates: Sequence[Predicate], cycle: Cycle, obligations: Mapping[int, Node]
    ) -> None:
        starts = [predicate.node(cycle.before) for predicate in predicates]
        ends = [predicate.node(cycle.after) for predicate in predicates]
        bits = Bits.of((*starts, *ends, cycle.contract, *obligations.values()))
        self._kinds = [predicate.kind for predicate in predicates]
        self.sizes = [predicate.size for predicate in predicates]
        self._starts = [bits.word(node) for node in starts]
        self._ends = [bits.word(node) for node in ends]
        self.before = self._values(bits, predicates, self._starts)
        self.after = self._values(bits, predicates, self._ends)
        self.holds = {at: bits.literal(node) for at, node in obligations.items()}
        contract = bits.literal(cycle.contract)
        self.sat = Sat([*bits.clauses, [contract]])
        self._count = bits.count

    @staticmethod
    def _values(bits: Bits, predicates: Sequence[Predicate], words: Sequence[Word]) -> dict[Pair, Literal]:
        found = {
            (at, value): bits.equals(word, one.kind, value)
            for at, (one, word) in enumerate(zip(predicates, words, strict=True))
            for value in range(one.size)
        }
        return found | {(at, ~value): -literal for (at, value), literal in found.items()}

    def fresh(self) -> Literal:
        """Return an unused literal."""
        self._count += 1
        return self._count

    def start(self) -> Valuation:
        """Return the predicates before the cycle in the last model."""
        return self._point(self._starts)

    def end(self) -> Valuation:
        """Return the predicates after the cycle in the last model."""
        return self._point(self._ends)

    def _point(self, words: Sequence[Word]) -> Valuation:
        read = [[self.sat.value(literal) for literal in word] for word in words]
        return tuple(
            int(bits[0]) if isinstance(kind, Bool) else key_of_bits(bits)
            for kind, bits in zip(self._kinds, read, strict=True)
        )


@dataclass(slots=True)
class PDR:
    """Property directed reachability for one level.

    Attributes:
        firsts: The cycles with which it begins.
        step: Any later one.
        weights: Of the predicates; those of small weight are left out of a clause first.
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
    _masks: Masks = field(init=False)

    def __post_init__(self) -> None:
        self._cores = [[] for _ in self.firsts]
        self._masks = Masks.of(self.step.sizes)

    def search(self, wanted: Iterable[int]) -> tuple[list[Clause], set[int]]:
        """Find an invariant, and the obligations that it does not prove.

        Args:
            wanted: The obligations looked at, by position.

        Raises:
            GaveUpError: The solver did.
        """
        obligations = set(wanted)
        for clause in self.known:
            self.step.sat.add([-self.step.before[pair] for pair in clause])
        self._begin(obligations)
        self._deepen()
        while True:
            self._exclude(obligations)
            self._deepen()
            done = self._push()
            if done is not None:
                return [
                    *self.known,
                    *(cube for frame in self._frames[done + 1 :] for cube in frame),
                ], self._open

    # --- obligations ---

    def _begin(self, obligations: set[int]) -> None:
        """Leave the obligations open that a first cycle breaks."""
        for at in sorted(obligations):
            if any(first.sat.holds([-first.holds[at]]) for first in self.firsts):
                self._leave(obligations, [at])

    def _leave(self, obligations: set[int], broken: Iterable[int]) -> None:
        for at in broken:
            obligations.discard(at)
            self._open.add(at)

    def _exclude(self, obligations: set[int]) -> None:
        """Exclude every state of the last frame from which a cycle breaks an obligation, or leave the obligation open."""
        last = len(self._frames) - 1
        while True:
            switch = self.step.fresh()
            self.step.sat.add([-switch, *(-self.step.holds[at] for at in sorted(obligations))])
            if not self.step.sat.holds([*self._held[last:], switch]):
                return
            point = self.step.start()
            broken = [at for at in obligations if not self.step.sat.value(self.step.holds[at])]
            self.step.sat.add([-switch])
            if not self._block(point, last):
                self._leave(obligations, broken)

    def _block(self, point: Valuation, last: int) -> bool:
        """Exclude a state from a frame after all that leads to it; return False where it is reachable."""
        waiting = [(last, 0, point)]
        count = 0
        while waiting:
            level, _, now = waiting[0]
            cube = tuple(enumerate(now))
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
        return not self.step.sat.holds([*self._held[level:], *(self.step.before[pair] for pair in cube)])

    # --- generalisation ---

    def _not_first(self, cube: Cube) -> set[Pair] | None:
        """Return pairs of the cube with which no first cycle ends; None where one ends with all of them."""
        kept: set[Pair] = set()
        implied = self._masks.implied(cube)
        for first, cores in zip(self.firsts, self._cores, strict=True):
            found = next((core for mask, core in cores if mask & implied == mask), None)
            if found is None:
                if first.sat.holds([first.after[pair] for pair in cube]):
                    self.reached.add(first.end())
                    return None
                core = first.sat.core()
                found = tuple(pair for pair in cube if first.after[pair] in core)
                cores.append((self._masks.of_cube(found), found))
            kept |= set(found)
        return kept

    def _not_next(self, cube: Cube, level: int) -> set[Pair] | None:
        """Return pairs of the cube to which no cycle leads from outside the cube in the frame; None where one leads to all."""
        if level == 0:
            return set()
        step, switch = self.step, self.step.fresh()
        step.sat.add([-switch, *(-step.before[pair] for pair in cube)])
        led = step.sat.holds([*self._held[level:], switch, *(step.after[pair] for pair in cube)])
        core = None if led else step.sat.core()
        step.sat.add([-switch])
        if core is None:
            return None
        return {pair for pair in cube if step.after[pair] in core}

    def _inductive(self, cube: Cube, level: int) -> Cube | None:
        """Return pairs of the cube that no run of at most `level` cycles ends with; None where one may end with all."""
        if self.reached.shows(cube):
            return None
        kept = self._not_first(cube)
        core = None if kept is None else self._not_next(cube, level - 1)
        if kept is None or core is None:
            return None
        return self._less(cube, kept | core)

    def _general(self, cube: Cube, level: int) -> Cube:
        """Generalise the cube: drop pairs, then widen those that are left."""
        for pair in self._in_order(cube):
            less = tuple(one for one in cube if one != pair)
            if pair in cube and less:
                cube = self._inductive(less, level) or cube
        for pair in self._in_order(cube):
            if pair in cube and self.step.sizes[pair[0]] > MANY:
                cube = self._wider(cube, pair, level) or cube
        return cube

    def _wider(self, cube: Cube, pair: Pair, level: int) -> Cube | None:
        """Replace a predicate's value in the cube by all but its allowed ones; None where those are too many."""
        at = pair[0]
        others = tuple(one for one in cube if one != pair)
        allowed: set[int] = set()
        for _ in range(TRIES):
            allowed |= self.reached.values(others, at)
            if 2 * len(allowed) > self.step.sizes[at]:
                return None
            wide = tuple(sorted((*others, *((at, ~value) for value in allowed))))
            kept = self._not_first(wide)
            if kept is None:
                continue
            core = self._not_next(wide, level - 1)
            if core is None:
                allowed.add(self.step.end()[at])
                continue
            return self._less(wide, kept | core)
        return None

    def _less(self, cube: Cube, needed: set[Pair]) -> Cube:
        """Keep the needed pairs of the cube, unless they contain a known state."""
        found = tuple(sorted(needed))
        return cube if not found or self.reached.shows(found) else found

    def _in_order(self, cube: Cube) -> list[Pair]:
        return sorted(cube, key=lambda pair: (self.weights[pair[0]], pair))

    # --- frames ---

    def _deepen(self) -> None:
        self._frames.append([])
        self._held.append(self.step.fresh())

    def _add(self, cube: Cube, level: int) -> int:
        """Add a clause to the last frame in which it can stand; return which."""
        while level < len(self._frames) - 1 and self._not_next(cube, level) is not None:
            level += 1
        mask = self._masks.of_cube(cube)
        for lower in range(1, level + 1):
            self._frames[lower] = [
                one for one in self._frames[lower] if mask & self._masks.implied(one) != mask
            ]
        self._frames[level].append(cube)
        self.step.sat.add([-self._held[level], *(-self.step.before[pair] for pair in cube)])
        return level

    def _push(self) -> int | None:
        """Move clauses up; return the frame that has none of its own left, if one has."""
        for level in range(1, len(self._frames) - 1):
            for cube in list(self._frames[level]):
                if cube in self._frames[level] and self._kept(cube, level):
                    self._frames[level].remove(cube)
                    self._add(cube, level + 1)
            if not self._frames[level]:
                return level
        return None

    def _kept(self, cube: Cube, level: int) -> bool:
        """Return whether a cycle from the frame keeps the clause."""
        step = self.step
        return not step.sat.holds([*self._held[level:], *(step.after[pair] for pair in cube)])
