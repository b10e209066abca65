"""Restart a level from its checkpoint, or anew: then its buffers hold old values, and PAUSE goes down.

In: a level, its buffers, its checkpoint; for a start anew a signature, an initial state with the buffers' present inputs, and its own
orders that stand. Out: values to start from.
What is adopted is the program's (`rcsc.lang.restart`), the same for the proof.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import assert_never

from rcsc.lang.restart import NUMBERS, After, Fixed, SameAs, Stands
from rcsc.run.buffers import Buffers
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Signature, Value, Values


class Begun(StrEnum):
    """The state from which a restarted level continues."""

    CHECKPOINT = "checkpoint"  # that of its last cycle
    ANEW = "anew"  # that is lost, or ended in a fault: the state that `adopt` says
    HAND = "hand"  # no restart: that of its last cycle, with what somebody set since


@dataclass(frozen=True, slots=True)
class Restarted:
    """A level that was restarted between two cycles, or in which somebody set something.

    Attributes:
        values: All leaves, from which its next cycle begins once it has taken its inputs.
    """

    level: str
    begun: Begun
    values: Values


def restart(
    level: RunningLevel, buffers: Buffers, checkpoint: Values | None = None, written: Buffers | None = None
) -> Restarted:
    """Put a level into the state in which its process would begin again.

    Args:
        level: Whatever state it is in.
        buffers: What it takes from and gives to.
        checkpoint: All leaves and the trace after its last cycle; None where they are lost: then it starts anew.
        written: What it gives to, as it wrote it, where readers may not see that yet; None where they do.

    Raises:
        BadState: The checkpoint, or what the level would adopt, lies outside what its tables are proved for.
    """
    if checkpoint is None:
        level.put_back(level.initial)
        level.take(buffers)
        level.restore(adopt(level.sign, level.executor.values(), standing(level, written or buffers)))
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
    before: the next after the order that stands, which it may not have echoed yet, or else after what it echoed. Its report echoes what
    it echoed. Variables that a program lacks, or has with another type, are left alone.

    Args:
        sign: The level's program.
        values: All leaves and the trace; states and outputs initial.
        stands: What its own buffers hold, of `standing`.
    """
    now, stood = list(values), stands or {}
    for at, adopts in sign.restart.items():
        match adopts:
            case Fixed(value):
                now[at] = value
            case SameAs(leaf):
                now[at] = now[sign.index[leaf]]
            case After(leaf):
                now[at] = (int(stood.get(at, now[sign.index[leaf]])) + 1) % NUMBERS
            case Stands():
                now[at] = stood.get(at, now[at])
            case _:
                assert_never(adopts)
    return tuple(now)


def unlike(sign: Signature, values: Values, given: Values) -> dict[int, Value]:
    """Return the leaves whose value in `values` no start anew leaves, each with the value that one leaves.

    Args:
        sign: The level's program.
        values: All leaves, from which it is said to have gone on.
        given: Those that its last cycle left; its buffers hold their outputs, or nothing of it yet.
    """
    leaves = sign.leaves
    first = [values[at] if leaf.kind == "input" else leaf.initial for at, leaf in enumerate(leaves)]
    outputs = {at: given[at] for at, leaf in enumerate(leaves) if leaf.kind == "output"}
    ways = [adopt(sign, tuple(first), stands) for stands in (outputs, {})]
    return {
        at: ways[0][at] for at in range(len(leaves)) if all(repr(way[at]) != repr(values[at]) for way in ways)
    }
