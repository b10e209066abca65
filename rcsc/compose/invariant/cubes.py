"""Combinations of values of predicates: what a clause of an invariant forbids, and which of them known states show.

In: predicates and states (`predicates.point`). Out: `Cube`s, and answers about them. Of a predicate with many values a cube says which
value it has, or, of all but a few, which values it has not: one clause then speaks of as many members as an enumeration may have.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
import numpy.typing as npt

from rcsc.compose.contract.predicates import Predicate

Valuation = tuple[int, ...]
"""A value for each predicate."""
Pair = tuple[int, int]
"""A predicate, by position, and its value; or `~value`, which is negative: that it has another."""
Cube = tuple[Pair, ...]
"""What stands together, in order."""


def shown(chosen: Sequence[Predicate], clause: Cube) -> str:
    """Spell a combination in the tables' words."""
    by_predicate = groupby(clause, key=lambda pair: pair[0])
    return " and ".join(_said(chosen[at], [value for _, value in pairs]) for at, pairs in by_predicate)


def _said(one: Predicate, found: Sequence[int]) -> str:
    """Spell one predicate's value, or the values that it has not."""
    if found[0] >= 0:
        return f"{one.name} = {one.shown(found[0])}"
    others = [one.shown(~value) for value in reversed(found)]
    return f"{one.name} /= {others[0]}" if len(others) == 1 else f"{one.name} is none of {', '.join(others)}"


@dataclass(slots=True)
class Masks:
    """Cubes as sets of bits, a bit for each pair."""

    _own: dict[Pair, int] = field(default_factory=dict)
    _implied: dict[Pair, int] = field(default_factory=dict)

    @classmethod
    def of(cls, sizes: Iterable[int]) -> "Masks":
        """Of predicates with so many values each."""
        made, count = cls(), 0
        for at, size in enumerate(sizes):
            for value in range(size):
                made._own[at, value] = 1 << (count + value)
                made._own[at, ~value] = 1 << (count + size + value)
            others = sum(made._own[at, ~value] for value in range(size))
            for value in range(size):
                made._implied[at, value] = made._own[at, value] | others & ~made._own[at, ~value]
                made._implied[at, ~value] = made._own[at, ~value]
            count += 2 * size
        return made

    def of_cube(self, cube: Cube) -> int:
        """Return the bits of the cube's pairs."""
        return sum(self._own[pair] for pair in cube)

    def implied(self, cube: Cube) -> int:
        """Return the bits of all pairs that follow from the cube: one value excludes the others."""
        found = 0
        for pair in cube:
            found |= self._implied[pair]
        return found


@dataclass(slots=True)
class Reached:
    """States known to be reached, to answer at once that one of them cannot be excluded."""

    _points: npt.NDArray[np.int32]

    @classmethod
    def of(cls, points: Iterable[Valuation], width: int) -> "Reached":
        """Of these; `width` predicates each."""
        every = list(points)
        return cls(np.array(every, dtype=np.int32).reshape(len(every), width))

    @property
    def many(self) -> int:
        """How many there are."""
        return len(self._points)

    def add(self, point: Valuation) -> None:
        """Add a state."""
        self._points = np.vstack([self._points, np.array([point], dtype=np.int32)])

    def shows(self, cube: Cube) -> bool:
        """Return whether a known state lies in the cube."""
        return bool(self._inside(cube).any())

    def values(self, cube: Cube, at: int) -> set[int]:
        """Return the values of a predicate in the known states of the cube."""
        return set(map(int, self._points[self._inside(cube), at]))

    def _inside(self, cube: Cube) -> npt.NDArray[np.bool_]:
        inside = np.ones(len(self._points), dtype=bool)
        for at, value in cube:
            inside &= self._points[:, at] == value if value >= 0 else self._points[:, at] != ~value
        return inside
