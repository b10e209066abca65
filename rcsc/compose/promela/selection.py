"""Which models a system is checked by: each level alone, and each over all its subordinates.

In: a system's transition systems. Out: `Wanted`s, from the bottom up, so that the small ones come first.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.compose.contract.transition import TransitionSystem


@dataclass(frozen=True, slots=True)
class Wanted:
    """A model.

    Attributes:
        levels: From the top down.
        progress: It asks whether every command ends, not whether a check is broken.
    """

    levels: tuple[str, ...]
    progress: bool = False

    @property
    def shown(self) -> str:
        """Its name."""
        upper, *lower = self.levels
        name = f"{upper} over {' and '.join(lower)}" if lower else upper
        return f"{name}, do commands end?" if self.progress else name


def wanted(system: Mapping[str, TransitionSystem]) -> tuple[Wanted, ...]:
    """Every model of the system; whether commands end is asked of levels that order nobody in the system."""
    alone: list[Wanted] = []
    together: list[Wanted] = []
    for name in reversed(list(system)):
        below = tuple(one.name for one in system[name].links.below if one.name in system)
        alone.append(Wanted((name,)))
        if can_end(system[name]):
            alone.append(Wanted((name,), progress=True))
        if below:
            together.append(Wanted((name, *below)))
    return (*alone, *together)


def can_end(ts: TransitionSystem) -> bool:
    """Whether it can be asked whether its commands end: it has a superior, and its orders are nobody's to echo."""
    return ts.links.above is not None and not ts.links.below
