"""Folds cycles that are alike, so that a wait of six hundred cycles takes a line.

In: cycles in a row, each with what ran and the values that it changed, as they are spelled. Out: the same, with what is alike as `Alike`.
Cycles are alike where what ran is the same, and all that they change is numbers, each by the same step. A log keeps every cycle.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Generic, Protocol, TypeVar

LEAST = 4
"""Cycles between two that are shown from which it is worth to fold."""


class Foldable(Protocol):
    """A cycle that may be folded."""

    @property
    def ran(self) -> Hashable | None:
        """What has to be the same, without the values; None where it is to be shown whatever stands around it."""

    @property
    def moved(self) -> Mapping[str, str]:
        """The values that it changed, as they are after it."""


Folded = TypeVar("Folded", bound=Foldable)
"""Cycles of one kind."""


@dataclass(frozen=True, slots=True)
class Alike(Generic[Folded]):
    """Cycles that are left out: how many, and the first and the last of them."""

    many: int
    first: Folded
    last: Folded

    @property
    def said(self) -> str:
        """The cycles in words."""
        return f"... {self.many} cycles alike"

    @property
    def moved(self) -> dict[str, str]:
        """What they count, each from its first to its last value."""
        return {name: f"{said} .. {self.last.moved[name]}" for name, said in self.first.moved.items()}


def folded(cycles: Sequence[Folded]) -> Iterator[Folded | Alike[Folded]]:
    """Yield the cycles in order; of those that are alike the first and the last are shown, and the rest are one `Alike`."""
    at = 0
    while at < len(cycles):
        end = _last_alike(cycles, at)
        between = cycles[at + 1 : end]
        if len(between) < LEAST:
            yield from cycles[at : end + 1]
        else:
            yield cycles[at]
            yield Alike(len(between), between[0], between[-1])
            yield cycles[end]
        at = end + 1


def _last_alike(cycles: Sequence[Foldable], at: int) -> int:
    """Return the last of the cycles from this one on that are alike."""
    end, steps = at, None
    while end + 1 < len(cycles):
        here, there = cycles[end], cycles[end + 1]
        step = _steps(here.moved, there.moved)
        if here.ran is None or here.ran != there.ran or step is None or steps not in (None, step):
            break
        end, steps = end + 1, step
    return end


def _steps(here: Mapping[str, str], there: Mapping[str, str]) -> dict[str, Fraction] | None:
    """Return by how much each number rises from one cycle to the next; None where other values change, or other ones."""
    if here.keys() != there.keys():
        return None
    try:
        return {name: Fraction(there[name]) - Fraction(here[name]) for name in here}
    except (ValueError, ZeroDivisionError):
        return None
