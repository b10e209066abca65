"""What `undo` goes back to: the whole system as it was before each of the last cycles.

In: a system. Out: `KeptMoment`s. Values and buffers are tuples, kept as they are; what stands outside is copied.
"""

import copy
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass

from rcsc.run.adopt import Restarted
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Values
from rcsc.run.system import Outside, System

MOST = 10_000


class Memory:
    """Common memory whose contents can be kept and put back.

    Attributes:
        frozen: Buffers to which nothing more is written: what is published there is lost.
    """

    def __init__(self, held: Mapping[str, Values]) -> None:
        self.held = dict(held)
        self.frozen: frozenset[str] = frozenset()

    def publish(self, name: str, values: Values) -> None:
        """Make this the latest value, where it is not lost."""
        if name not in self.frozen:
            self.held[name] = values

    def latest(self, name: str) -> Values | None:
        """The latest value; None before the first."""
        return self.held.get(name)


@dataclass(frozen=True, slots=True)
class KeptMoment:
    """The whole system at one time.

    Attributes:
        levels: With the tables that they had then.
        values: Of each level, the trace too.
        answers: What the database was set by hand to say.
        frozen: Buffers that nothing is written to.
        restarts: Levels that were started again before the next cycle.
        faults: Of the plants, that are on by hand.
    """

    tick: int
    levels: tuple[RunningLevel, ...]
    values: tuple[Values, ...]
    buffers: Mapping[str, Values]
    outside: tuple[Outside, ...]
    answers: Mapping[tuple[object, ...], Values]
    frozen: frozenset[str]
    restarts: tuple[Restarted, ...]
    faults: frozenset[str]

    def of(self, name: str) -> tuple[RunningLevel, Values]:
        """A level of then, and its values."""
        return next(
            (level, values)
            for level, values in zip(self.levels, self.values, strict=True)
            if level.name == name
        )


def kept(
    system: System, memory: Memory, answers: Mapping[tuple[object, ...], Values], faults: frozenset[str]
) -> KeptMoment:
    """The system as it is now."""
    return KeptMoment(
        system.tick,
        system.levels,
        tuple(level.values for level in system.levels),
        dict(memory.held),
        _copied(system.outside),
        dict(answers),
        memory.frozen,
        tuple(system.restarts),
        faults,
    )


def put_back(moment: KeptMoment, system: System, memory: Memory) -> None:
    """Makes the system what it was."""
    system.tick, system.levels, system.outside = moment.tick, moment.levels, moment.outside
    memory.held, memory.frozen = dict(moment.buffers), moment.frozen
    system.restarts[:] = moment.restarts
    for level, values in zip(moment.levels, moment.values, strict=True):
        level.put_back(values)
        level.values = values  # the trace too, which the executor does not take back


def _copied(outside: tuple[Outside, ...]) -> tuple[Outside, ...]:
    """Copies that share what never changes, as the database; what two of them had in common, their copies have, too."""
    frozen = {id(part): part for one in outside for part in _parts(one) if _is_frozen(part)}
    return copy.deepcopy(outside, frozen)


def _parts(whole: object) -> list[object]:
    return [getattr(whole, field.name, None) for field in fields(whole)] if is_dataclass(whole) else []


def _is_frozen(value: object) -> bool:
    return is_dataclass(value) and bool(getattr(type(value), "__dataclass_params__").frozen)  # noqa: B009  # unknown to mypy
