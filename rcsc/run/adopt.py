"""Restart a level from its checkpoint, or anew: then its buffers hold old values, and PAUSE goes down.

In: a level, its buffers, its checkpoint; for a start anew a signature, an initial state with the buffers' present inputs, and its own
orders that stand. Out: values to start from.
What is adopted is the program's (`rcsc.lang.restart`), the same for the proof.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from rcsc.lang.restart import NUMBERS, After, Fixed, SameAs
from rcsc.run.buffers import Buffers
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Signature, Value, Values


class Begun(StrEnum):
    """The state from which a restarted level goes on."""

    CHECKPOINT = "checkpoint"  # that of its last cycle
    ANEW = "anew"  # that is lost, or ended in a fault: the state that `adopt` says


@dataclass(frozen=True, slots=True)
class Restarted:
    """A level that was started again, between two cycles.

    Attributes:
        values: All leaves, from which its next cycle begins once it has taken its inputs.
    """

    level: str
    begun: Begun
    values: Values


def restart(level: RunningLevel, buffers: Buffers, checkpoint: Values | None = None) -> Restarted:
    """Put a level where its process would begin again.

    Args:
        level: Whatever state it is in.
        buffers: What it takes from and gives to.
        checkpoint: All leaves and the trace after its last cycle; None where they are lost: then it starts anew.

    Raises:
        BadState: The checkpoint, or what the level would adopt, lies outside what its tables are proved for.
    """
    if checkpoint is None:
        level.put_back(level.initial)
        level.take(buffers)
        level.restore(adopt(level.sign, level.executor.values(), standing(level, buffers)))
    else:
        level.restore(checkpoint)
    begun = Begun.ANEW if checkpoint is None else Begun.CHECKPOINT
    return Restarted(level.name, begun, level.values[: len(level.sign.leaves)])


def standing(level: RunningLevel, buffers: Buffers) -> dict[int, Value]:
    """Return a level's own orders and reports that still stand in the buffers, by position of the leaf."""
    return {
        give.first + at: value
        for give in level.gives
        for at, value in enumerate(buffers.latest(give.buffer) or ())
    }


def adopt(sign: Signature, values: Values, stands: Mapping[int, Value] | None = None) -> Values:
    """Return the values with which a level starts safely, whatever its buffers hold.

    The order in the command buffer counts as seen, and has failed; each level below gets PAUSE with a number that no order had
    before: the next after the order that stands, which it may not have echoed yet, or else after what it echoed. Variables
    that a program lacks, or has with another type, are left alone.

    Args:
        sign: The level's program.
        values: All leaves and the trace; states and outputs initial.
        stands: What its own buffers hold, of `standing`.
    """
    now = list(values)
    for at, adopted in sign.restart.items():
        match adopted:
            case Fixed(value):
                now[at] = value
            case SameAs(leaf):
                now[at] = values[sign.index[leaf]]
            case After(leaf):
                now[at] = (int((stands or {}).get(at, values[sign.index[leaf]])) + 1) % NUMBERS
    return tuple(now)
