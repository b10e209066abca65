"""Cubes, combinations of predicates' values that clauses forbid, and known states in them.

In: predicates and states (`predicates.point`). Out: `Cube`s, and answers about them. For a predicate with many values a cube names its
value, or a few values that it does not have; so one clause can forbid many members of an enumeration.
"""

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from rcsc.compose.contract.predicates import Predicate
from rcsc.compose.contract.transition import Leaves
from rcsc.lang.model import Bool
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.values import Node

Valuation = tuple[int, ...]
"""A value for each predicate."""
Pair = tuple[int, int]
"""A predicate's position and its value; or `~value`, which is negative, for any other value."""
Cube = tuple[Pair, ...]
"""Pairs that hold together, in order."""


def shown(chosen: Sequence[Predicate], clause: Cube) -> str:
    """Spell a combination in the tables' words."""
    return _joined(chosen, clause, "{} is none of {}")


def as_condition(chosen: Sequence[Predicate], clauses: Iterable[Cube], nameable: Container[str]) -> str:
    """Return the condition in the language that the clauses say, as far as it speaks of these leaves; empty if of none."""
    said = [clause for clause in clauses if all(chosen[at].of(nameable) for at, _ in clause)]
    return " and ".join(f"not ({_joined(chosen, clause, 'not ({} in {{{}}})')})" for clause in said)


def _joined(chosen: Sequence[Predicate], clause: Cube, none_of: str) -> str:
    by_predicate = groupby(clause, key=lambda pair: pair[0])
    return " and ".join(
        _spelled(chosen[at], [value for _, value in pairs], none_of) for at, pairs in by_predicate
    )


def _spelled(predicate: Predicate, values: Sequence[int], none_of: str) -> str:
    """Spell one predicate's value, or the values that it has not."""
    if values[0] >= 0:
        return predicate.says(values[0])
    others = [predicate.shown(~value) for value in reversed(values)]
    return (
        f"{predicate.name} /= {others[0]}"
        if len(others) == 1
        else none_of.format(predicate.name, ", ".join(others))
    )


def held(predicates: Sequence[Predicate], clauses: Iterable[Cube], state: Leaves) -> list[Node]:
    """Return for each clause the condition that it holds in the state: of its pairs something does not."""
    nodes = [predicate.node(state) for predicate in predicates]

    def has(at: int, value: int) -> Node:
        if value < 0:
            return values.negation(has(at, ~value))
        node = nodes[at]
        if isinstance(node.kind, Bool):
            return node if value else values.negation(node)
        return values.equal(node, values.constant(node.kind, value))

    return [values.negation(values.all_of(has(at, value) for at, value in clause)) for clause in clauses]


@dataclass(slots=True)
class Masks:
    """Cubes as sets of bits, a bit for each pair."""

    _own: dict[Pair, int] = field(default_factory=dict)
    _implied: dict[Pair, int] = field(default_factory=dict)

    @classmethod
    def of(cls, sizes: Iterable[int]) -> "Masks":
        """Return the masks of predicates of these sizes."""
        masks, count = cls(), 0
        for at, size in enumerate(sizes):
            for value in range(size):
                masks._own[at, value] = 1 << (count + value)
                masks._own[at, ~value] = 1 << (count + size + value)
            others = sum(masks._own[at, ~value] for value in range(size))
            for value in range(size):
                masks._implied[at, value] = masks._own[at, value] | others & ~masks._own[at, ~value]
                masks._implied[at, ~value] = masks._own[at, ~value]
            count += 2 * size
        return masks

    def of_cube(self, cube: Cube) -> int:
        """Return the bits of the cube's pairs."""
        return sum(self._own[pair] for pair in cube)

    def implied(self, cube: Cube) -> int:
        """Return the bits of all pairs that follow from the cube: one value excludes the others."""
        bits = 0
        for pair in cube:
            bits |= self._implied[pair]
        return bits


@dataclass(slots=True)
class Reached:
    """States known to be reached: a cube that contains one cannot be excluded.

    Attributes:
        many: How many states there are.
    """

    many: int = 0
    _with: dict[Pair, int] = field(
        default_factory=dict
    )  # for each pair the states that have it, a bit for each

    @classmethod
    def of(cls, points: Iterable[Valuation]) -> "Reached":
        """Return the set of these states."""
        reached, rows = cls(), list(points)
        reached.many = len(rows)
        for at, column in enumerate(zip(*rows, strict=True)):
            for value in set(column):
                digits = "".join("1" if other == value else "0" for other in reversed(column))
                reached._with[at, value] = int(digits, 2)
        return reached

    def add(self, point: Valuation) -> None:
        """Add a state."""
        for pair in enumerate(point):
            self._with[pair] = self._with.get(pair, 0) | 1 << self.many
        self.many += 1

    def shows(self, cube: Cube) -> bool:
        """Return whether a known state lies in the cube."""
        return self._inside(cube) != 0

    def values(self, cube: Cube, at: int) -> set[int]:
        """Return the values of a predicate in the known states of the cube."""
        inside = self._inside(cube)
        return {value for (other, value), states in self._with.items() if other == at and inside & states}

    def _inside(self, cube: Cube) -> int:
        inside = (1 << self.many) - 1
        for at, value in cube:
            inside &= self._with.get((at, value), 0) if value >= 0 else ~self._with.get((at, ~value), 0)
            if not inside:
                break
        return inside


@dataclass(frozen=True, slots=True)
class Way:
    """A cycle that the solver showed: the states before it and after it, also as bits of all that they imply."""

    start: Valuation
    end: Valuation
    starts: int
    ends: int


@dataclass(slots=True)
class Ways:
    """Cycles that the solver showed, and in which frames they begin: a clause that one of them breaks need not be asked about.

    A state is in a frame if no clause of that frame or a later one excludes it.
    """

    _ways: list[Way] = field(default_factory=list)
    _outside: list[int] = field(default_factory=list)  # the last frame that excludes the beginning of each

    def add(self, way: Way, outside: int) -> None:
        """Add a cycle whose beginning clauses exclude from this frame at most."""
        self._ways.append(way)
        self._outside.append(outside)

    def exclude(self, mask: int, frame: int) -> None:
        """Take note of a clause of this frame."""
        for at, way in enumerate(self._ways):
            if self._outside[at] < frame and mask & way.starts == mask:
                self._outside[at] = frame

    def into(self, mask: int, frame: int) -> Way | None:
        """Return a cycle that leads from the frame outside the cube into the cube, if one is known."""
        for outside, way in zip(self._outside, self._ways, strict=True):
            if mask & way.ends == mask and outside < frame and mask & way.starts != mask:
                return way
        return None
