"""Cubes, combinations of predicates' values that clauses forbid, and known states in them.

In: predicates and states (`predicates.point`). Out: `Cube`s, and answers about them. For a predicate with many values a cube names its
value, or a few values that it does not have; so one clause can forbid many members of an enumeration.
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
"""A predicate's position and its value; or `~value`, which is negative, for any other value."""
Cube = tuple[Pair, ...]
"""Pairs that hold together, in order."""


def shown(chosen: Sequence[Predicate], clause: Cube) -> str:
    """Spell a combination in the tables' words."""
    by_predicate = groupby(clause, key=lambda pair: pair[0])
    return " and ".join(_spelled(chosen[at], [value for _, value in pairs]) for at, pairs in by_predicate)


def _spelled(predicate: Predicate, values: Sequence[int]) -> str:
    """Spell one predicate's value, or the values that it has not."""
    if values[0] >= 0:
        return f"{predicate.name} = {predicate.shown(values[0])}"
    others = [predicate.shown(~value) for value in reversed(values)]
    return (
        f"{predicate.name} /= {others[0]}"
        if len(others) == 1
        else f"{predicate.name} is none of {', '.join(others)}"
    )


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
    """States known to be reached: a cube that contains one cannot be excluded."""

    _points: npt.NDArray[np.int32]

    @classmethod
    def of(cls, points: Iterable[Valuation], width: int) -> "Reached":
        """Hold these states, of `width` predicates each."""
        every = list(points)
        return cls(np.array(every, dtype=np.int32).reshape(len(every), width))

    @property
    def many(self) -> int:
        """How many states there are."""
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
