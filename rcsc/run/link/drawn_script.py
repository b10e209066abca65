"""Scripts of what happens to a system: outside values at the edges of their ranges and beyond, restarts, checkpoints, spoilt checkpoints.

In: a description, the signatures of its levels, what draws. Out: `Tick`s, the same for every executor of the system.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from random import Random
from typing import TypeAlias

from rcsc.lang.restart import ECHO, NUMBER
from rcsc.run.description import Description
from rcsc.run.signature import REALS, Leaf, Signature, Value, Values, c_range

Published: TypeAlias = dict[str, Values]
Begin: TypeAlias = tuple[str, int | None, tuple[int, Value] | None]
"""A level that starts again: anew (None), from what it was after an earlier tick, or from that with another value at a position."""


@dataclass(frozen=True, slots=True)
class Tick:
    """The events of one tick.

    Attributes:
        begins: Before it.
        publishes: What stands outside gives at its end, for the next.
    """

    begins: tuple[Begin, ...]
    publishes: Published


def drawing(seed: int | str) -> Random:
    """Return a generator that draws the same numbers every time."""
    return Random(seed)  # noqa: S311  # repeatable on purpose


def edges(leaf: Leaf) -> list[Value]:
    """Return values at the edges of a leaf's range, and just beyond where its C type holds such."""
    if leaf.c_type == "bool":
        return [False, True]
    low, high = (0.0, len(leaf.members) - 1.0) if leaf.members else (leaf.low or 0, leaf.high or 0)
    if leaf.c_type in REALS:
        return [*map(leaf.held, (low, high, (low + high) / 2, low - 0.5, high + 0.5)), math.nan]
    least, most = c_range(leaf.c_type)
    near = [int(end) + by for end in (low, high) for by in (-1, 0, 1)]
    return [value for value in near if least <= value <= most]


def drawn(random: Random, leaf: Leaf, before: Value, wild: float) -> Value:
    """Draw a value for a leaf: mostly in its range, a number mostly the one before or the next."""
    low, high = (0.0, len(leaf.members) - 1.0) if leaf.members else (leaf.low or 0, leaf.high or 0)
    inside = [value for value in edges(leaf) if leaf.c_type == "bool" or low <= value <= high]
    way = random.random()
    if leaf.name.endswith((NUMBER, ECHO)) and way < 0.8:
        return before if way < 0.3 or before >= high else int(before) + 1
    if way < wild:
        return random.choice(edges(leaf))
    if way < 0.5 or leaf.c_type == "bool":
        return random.choice(inside)
    return leaf.anywhere(random, low, high)


def script(
    system: Description, signs: Mapping[str, Signature], random: Random, ticks: int, wild: float = 0.03
) -> list[Tick]:
    """Draw a script for a system; buffers keep their values for some ticks, and some are missing at the beginning.

    Args:
        system: The description.
        signs: The signature of each level's program.
        random: Draws.
        ticks: How many.
        wild: How often a value is drawn from the edges of its range and beyond.
    """
    last: Published = {}
    ticks_ = []
    for tick in range(ticks):
        publishes: Published = {}
        for wire in system.wires:
            level, _, variable = wire.target.partition(".")
            if wire.source.partition(".")[0] in signs or wire.source in publishes or random.random() < 0.6:
                continue
            leaves = signs[level].leaves_of(variable)
            before = last.get(wire.source, tuple(leaf.initial for leaf in leaves))
            publishes[wire.source] = last[wire.source] = tuple(
                drawn(random, leaf, value, wild) for leaf, value in zip(leaves, before, strict=True)
            )
        ticks_.append(Tick(tuple(begins(system, signs, random, tick, often=wild > 0.1)), publishes))
    return ticks_


def begins(
    system: Description, signs: Mapping[str, Signature], random: Random, tick: int, *, often: bool
) -> Iterator[Begin]:
    """Yield the levels that start again before a tick."""
    many = len(system.levels) if tick == 0 else random.choice([0] * (2 if often else 12) + [1, 1, 2])
    for _ in range(many):
        name = random.choice(system.levels).name
        if tick == 0 or random.random() < 0.6:
            yield name, None, None
            continue
        sign = signs[name]
        wrong = [
            (at, value)
            for at, leaf in enumerate(sign.leaves)
            if leaf.kind != "input" and leaf.c_type not in REALS
            for value in edges(leaf)[-1:]
            if leaf.c_type != "bool" and value > (len(leaf.members) - 1 if leaf.members else leaf.high or 0)
        ]
        spoilt = random.choice([None, *([random.choice([wrong[0], *wrong])] if wrong else [])])
        yield name, random.randrange(tick), spoilt
