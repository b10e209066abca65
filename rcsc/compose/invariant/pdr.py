"""Property directed reachability: an inductive invariant as clauses over a level's predicates.

In: predicates, the cycles with which a level begins, a cycle from any state, its obligations, and some states known to be
reached. Out: clauses that hold after every first cycle, that every cycle keeps, and from which no cycle breaks an obligation; and the
obligations for which the predicates do not suffice.

How: *frame* i is a set of clauses that hold after every run of at most i cycles. A state of the last frame from which a cycle
breaks an obligation has to be excluded: it is asked whether a first cycle, or a cycle from the frame before, leads to it; if one does,
that state is to be excluded first. If none does, the state is generalised, predicate by predicate, as long as that stays true: a
predicate is left out, or, if it has many values, all but a few of them are excluded together, so that an enumeration of many
members does not need as many clauses. A clause is added. When every clause of a frame holds in the next one, they are an
invariant. This is property directed reachability (Bradley, "SAT-based model checking without unrolling", 2011; Een, Mishchenko
and Brayton, "Efficient implementation of property directed reachability", 2011) on states as the predicates show them, without
making that abstraction (Cimatti, Griggio, Mover and Tonetta, "IC3 modulo theories via implicit predicate abstraction", 2014).

An obligation that is reached so is not proved. It need not be false: states with equal predicates are one state here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush

from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Cycle
from rcsc.compose.invariant.cubes import Cube, Masks, Pair, Reached, Valuation, Way, Ways
from rcsc.lang.model import Bool
from rcsc.proof.solvers.sat import QUESTIONS, Sat
from rcsc.proof.symbolic.bits import Bits, Literal, Word, key_of_bits
from rcsc.proof.symbolic.values import Node

Clause = Cube
"""A cube that never holds."""
MANY = 2
"""For a predicate with more values, a clause may name those allowed, and so forbid all others at once."""
TRIES = 8
"""How often a clause is tried, each time with one more value allowed, before it forbids a single one."""


class Posed:
    """A cycle as clauses, with a literal for every value of every predicate before and after it.

    Attributes:
        sizes: How many values each predicate has.
        before: The literal of each pair before the cycle; likewise `after`.
        holds: The literal of each obligation, by its position.
    """

    def __init__(
        self,
        predicates: Sequence[Predicate],
        cycle: Cycle,
        obligations: Mapping[int, Node],
        questions: int = QUESTIONS,
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
        values = (literal for word in (*self._starts, *self._ends) for literal in word)
        read = (*values, *self.before.values(), *self.after.values(), *self.holds.values())
        self.sat = Sat([*bits.clauses, [contract]], read, questions=questions)
        self._count = bits.count

    @staticmethod
    def _values(bits: Bits, predicates: Sequence[Predicate], words: Sequence[Word]) -> dict[Pair, Literal]:
        literals = {
            (at, value): bits.equals(word, predicate.kind, value)
            for at, (predicate, word) in enumerate(zip(predicates, words, strict=True))
            for value in range(predicate.size)
        }
        return literals | {(at, ~value): -literal for (at, value), literal in literals.items()}

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
        weights: The predicates' weights; a clause leaves out those of small weight first.
        known: Clauses that are an invariant already.
        candidates: Clauses that may be one, and are tried before others are looked for.
    """

    firsts: Sequence[Posed]
    step: Posed
    reached: Reached
    weights: Sequence[int]
    known: Sequence[Clause] = ()
    candidates: Sequence[Clause] = ()
    _frames: list[list[Cube]] = field(default_factory=lambda: [[]])
    _held: list[Literal] = field(default_factory=lambda: [0])
    _open: set[int] = field(default_factory=set)
    _cores: list[list[tuple[int, Cube]]] = field(init=False)
    _masks: Masks = field(init=False)
    _ends: dict[Cube, Literal] = field(default_factory=dict)
    _ways: Ways = field(default_factory=Ways)
    _bad: dict[Valuation, set[int]] = field(default_factory=dict)
    _led: Way = field(init=False)

    def __post_init__(self) -> None:
        self._cores = [[] for _ in self.firsts]
        self._masks = Masks.of(self.step.sizes)

    def search(self, wanted: Iterable[int]) -> tuple[list[Clause], set[int]]:
        """Find an invariant, and the obligations that it does not prove.

        Args:
            wanted: The obligations to prove, by position.

        Raises:
            GaveUpError: The solver did.
        """
        obligations = set(wanted)
        for clause in self.known:
            self.step.sat.add([-self.step.before[pair] for pair in clause])
        self._begin(obligations)
        self._deepen()
        self._try_candidates()
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
        """Leave open the obligations that a first cycle breaks."""
        for at in sorted(obligations):
            if any(first.sat.holds([-first.holds[at]]) for first in self.firsts):
                self._leave(obligations, [at])

    def _try_candidates(self) -> None:
        """Add the candidates that every first cycle keeps to the first frame; they rise from it like other clauses."""
        for cube in self.candidates:
            if not self.reached.shows(cube) and self._not_first(cube) is not None:
                self._add(cube, 1)

    def _leave(self, obligations: set[int], broken: Iterable[int]) -> None:
        for at in broken:
            obligations.discard(at)
            self._open.add(at)

    def _exclude(self, obligations: set[int]) -> None:
        """Exclude every state of the last frame from which a cycle breaks an obligation, or leave the obligation open."""
        last = len(self._frames) - 1
        for point, broken in list(self._bad.items()):  # seen in frames before
            here = broken & obligations
            if here and not self._excluded(tuple(enumerate(point)), last) and not self._block(point, last):
                self._leave(obligations, here)
        while True:
            switch = self.step.fresh()
            self.step.sat.add([-switch, *(-self.step.holds[at] for at in sorted(obligations))])
            if not self.step.sat.holds([*self._held[last:], switch]):
                return
            point = self.step.start()
            broken = {at for at in obligations if not self.step.sat.value(self.step.holds[at])}
            self._bad[point] = broken
            self.step.sat.add([-switch])
            if not self._block(point, last):
                self._leave(obligations, broken)

    def _block(self, point: Valuation, last: int) -> bool:
        """Exclude a state from a frame after all that leads to it; return False if it is reachable."""
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
            inductive = self._inductive(cube, level)
            if inductive is None:
                count -= 1
                heappush(waiting, (level - 1, count, self._led.start))
                continue
            heappop(waiting)
            highest = self._add(self._general(inductive, level), level)
            if highest < len(self._frames) - 1:
                heappush(waiting, (highest + 1, count, now))
        return True

    def _excluded(self, cube: Cube, level: int) -> bool:
        """Return whether a clause of the frame excludes the state."""
        implied = self._masks.implied(cube)
        return any(self._excludes(implied, at) for at in range(level, len(self._frames)))

    # --- generalisation ---

    def _not_first(self, cube: Cube) -> set[Pair] | None:
        """Return pairs of the cube with which no first cycle ends; None if one ends with all of them."""
        kept: set[Pair] = set()
        implied = self._masks.implied(cube)
        for first, cores in zip(self.firsts, self._cores, strict=True):
            excluded = next((core for mask, core in cores if mask & implied == mask), None)
            if excluded is None:
                if first.sat.holds([first.after[pair] for pair in cube]):
                    self.reached.add(first.end())
                    return None
                core = first.sat.core()
                excluded = tuple(pair for pair in cube if first.after[pair] in core)
                cores.append((self._masks.of_cube(excluded), excluded))
            kept |= set(excluded)
        return kept

    def _not_next(self, cube: Cube, level: int) -> set[Pair] | None:
        """Return pairs of the cube to which no cycle leads from the frame outside the cube; None if one leads to all."""
        if level == 0:
            return set()
        known = self._ways.into(self._masks.of_cube(cube), level)
        if known is not None:
            self._led = known
            return None
        step, switch = self.step, self.step.fresh()
        step.sat.add([-switch, *(-step.before[pair] for pair in cube)])
        led = step.sat.holds([*self._held[level:], switch, *(step.after[pair] for pair in cube)])
        core = None if led else step.sat.core()
        if led:
            self._lead(level)
        step.sat.add([-switch])
        if core is None:
            return None
        return {pair for pair in cube if step.after[pair] in core}

    def _lead(self, level: int) -> None:
        """Keep the cycle of the last model, which begins in the frame."""
        start, end = self.step.start(), self.step.end()
        starts, ends = (self._masks.implied(tuple(enumerate(point))) for point in (start, end))
        self._led = Way(start, end, starts, ends)
        outside = (at for at in range(level - 1, 0, -1) if self._excludes(starts, at))
        self._ways.add(self._led, next(outside, 0))

    def _excludes(self, implied: int, level: int) -> bool:
        """Return whether a clause of just this frame excludes a state that implies these pairs."""
        return any((mask := self._masks.of_cube(cube)) & implied == mask for cube in self._frames[level])

    def _inductive(self, cube: Cube, level: int) -> Cube | None:
        """Return pairs of the cube with which no run of at most `level` cycles ends; None if one may end with all."""
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
            less = tuple(other for other in cube if other != pair)
            if pair in cube and less:
                cube = self._inductive(less, level) or cube
        for pair in self._in_order(cube):
            if pair in cube and self.step.sizes[pair[0]] > MANY:
                cube = self._wider(cube, pair, level) or cube
        return cube

    def _wider(self, cube: Cube, pair: Pair, level: int) -> Cube | None:
        """Replace a predicate's value in the cube by all but its allowed ones; None if those are too many."""
        at = pair[0]
        others = tuple(other for other in cube if other != pair)
        allowed: set[int] = set()
        for _ in range(TRIES):
            allowed |= self.reached.values(others, at)
            if 2 * len(allowed) > self.step.sizes[at]:
                return None
            wide = tuple(sorted({*others, *((at, ~value) for value in allowed)}))
            kept = self._not_first(wide)
            if kept is None:
                continue
            core = self._not_next(wide, level - 1)
            if core is None:
                allowed.add(self._led.end[at])
                continue
            return self._less(wide, kept | core)
        return None

    def _less(self, cube: Cube, needed: set[Pair]) -> Cube:
        """Keep the needed pairs of the cube, unless they contain a known state."""
        smaller = tuple(sorted(needed))
        return cube if not smaller or self.reached.shows(smaller) else smaller

    def _in_order(self, cube: Cube) -> list[Pair]:
        return sorted(cube, key=lambda pair: (self.weights[pair[0]], pair))

    # --- frames ---

    def _deepen(self) -> None:
        self._frames.append([])
        self._held.append(self.step.fresh())

    def _add(self, cube: Cube, level: int) -> int:
        """Add a clause to the last frame in which it holds; return that frame."""
        while level < len(self._frames) - 1 and self._not_next(cube, level) is not None:
            level += 1
        mask = self._masks.of_cube(cube)
        for lower in range(1, level + 1):
            self._frames[lower] = [
                other for other in self._frames[lower] if mask & self._masks.implied(other) != mask
            ]
        self._frames[level].append(cube)
        self._ways.exclude(mask, level)
        self.step.sat.add([-self._held[level], *(-self.step.before[pair] for pair in cube)])
        return level

    def _push(self) -> int | None:
        """Move clauses up; return the first frame without clauses of its own, if any."""
        for level in range(1, len(self._frames) - 1):
            for cube in self._kept(level):
                if cube in self._frames[level]:
                    self._frames[level].remove(cube)
                    self._add(cube, level + 1)
            if not self._frames[level]:
                return level
        return None

    def _kept(self, level: int) -> list[Cube]:
        """Return the clauses of the frame that every cycle from it keeps: each model leaves out all that it breaks."""
        step, left = self.step, list(self._frames[level])
        while left := [cube for cube in left if self._ways.into(self._masks.of_cube(cube), level) is None]:
            switch = step.fresh()
            step.sat.add([-switch, *(self._broken_after(cube) for cube in left)])
            broken = step.sat.holds([*self._held[level:], switch])
            if broken:
                self._lead(level)
            step.sat.add([-switch])
            if not broken:
                break
        return left

    def _broken_after(self, cube: Cube) -> Literal:
        """Return a literal that implies that a cycle ends in the cube."""
        if cube not in self._ends:
            self._ends[cube] = end = self.step.fresh()
            for pair in cube:
                self.step.sat.add([-end, self.step.after[pair]])
        return self._ends[cube]
