"""What can happen to a level in one cycle or between two, and what each event leaves: stated once, for all rooms.

In: nothing. Out: `ENVIRONMENT`, one `Left` for each `Event`. The interpreter and both executors do it, the proof's cycles
(`compose.contract.transition`) allow it, episodes of campaigns make it happen, the manual says it ("What can happen to a level"). Tests
hold each of them against this table, and fail where one knows an event that another does not.

A *refused* cycle is one that an input ends: its value lies outside its declared range and is not clamped, or is a NaN. Nothing is taken: no
table runs, no deferred value is settled, nothing that the level keeps changes. The inputs themselves stand in its state as they came,
unadmitted, so that a log shows what was refused; the next cycle admits all of them anew.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from rcsc.lang.interpret import Fault
from rcsc.lang.model import Admit, Bool, Enum, Int, Real, Variable, key_bounds


class Event(StrEnum):
    """One thing that the environment can do to a level."""

    RUNS = "the cycle runs"
    INPUT_REFUSED = "an input is refused"
    EXTERN_REFUSED = "a result of an extern procedure is refused"
    ASSUMPTION_FAILS = "an assumption fails that stops the cycle"
    RESUMED = "the level goes on from its checkpoint"
    BEGUN_ANEW = "the level begins anew"


class Kept(StrEnum):
    """The fate of a part of a level's state."""

    TAKEN = "taken"
    AS_THEY_CAME = "as they came"
    AS_BEFORE = "as before"
    WRITTEN = "as the cycle wrote them"
    SO_FAR = "as far as the cycle came"
    SAFE = "the safe value, or as far as the cycle came"
    SAFE_OR_BEFORE = "the safe value, or as before"
    INITIAL = "initial, or as declared"
    STANDING = "as it stands in the buffer"


@dataclass(frozen=True, slots=True)
class Left:
    """The state that an event leaves.

    Attributes:
        inputs: Of the inputs.
        state: Of states, hidden ones included.
        pending: Of deferred values that wait.
        outputs: Of outputs.
        echo: Of the number and the command that the level's report echoes; it never goes back.
        fault: The executors' name for it; OK for no fault.
    """

    inputs: Kept
    state: Kept
    pending: Kept
    outputs: Kept
    echo: Kept
    fault: Fault = Fault.OK


ENVIRONMENT: Mapping[Event, Left] = {
    Event.RUNS: Left(Kept.TAKEN, Kept.WRITTEN, Kept.WRITTEN, Kept.WRITTEN, Kept.WRITTEN),
    Event.INPUT_REFUSED: Left(
        Kept.AS_THEY_CAME, Kept.AS_BEFORE, Kept.AS_BEFORE, Kept.SAFE_OR_BEFORE, Kept.AS_BEFORE, Fault.ADMIT
    ),
    Event.EXTERN_REFUSED: Left(Kept.TAKEN, Kept.SO_FAR, Kept.SO_FAR, Kept.SAFE, Kept.SO_FAR, Fault.EXTERN),
    Event.ASSUMPTION_FAILS: Left(
        Kept.TAKEN, Kept.SO_FAR, Kept.SO_FAR, Kept.SAFE, Kept.SO_FAR, Fault.ASSUMPTION
    ),
    Event.RESUMED: Left(Kept.AS_BEFORE, Kept.AS_BEFORE, Kept.AS_BEFORE, Kept.AS_BEFORE, Kept.AS_BEFORE),
    Event.BEGUN_ANEW: Left(Kept.AS_THEY_CAME, Kept.INITIAL, Kept.INITIAL, Kept.INITIAL, Kept.STANDING),
}

EARLY = frozenset(left.fault for left in ENVIRONMENT.values()) - {Fault.OK}
"""Faults that no proof excludes: the cycle ends there, and the next one runs."""


def refusable(variable: Variable) -> bool:
    """Return whether an input can hold a value that is refused: a NaN in a real, in others a value of the C type outside the range.

    What cannot be refused in C cannot come through a buffer either: a buffer holds that type.
    """
    return unadmitted(variable) and (isinstance(variable.type, Real) or variable.admit is not Admit.CLAMP)


def unadmitted(variable: Variable) -> bool:
    """Return whether an input may stand outside its range until a cycle refuses or clamps it.

    So it stands after a cycle that was refused, and where the level begins anew.
    """
    match variable.type:
        case Real():
            return True
        case Bool():
            return False
        case Enum(members=members):
            return len(members) not in {1 << 8, 1 << 16}
        case Int():
            return key_bounds(variable.type) not in _WHOLE


_WHOLE = frozenset(
    ends for bits in (8, 16, 32, 64) for ends in ((0, 2**bits - 1), (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
)
"""Ranges that their types in C hold, and nothing more."""
