"""The robot controller below PRIMITIVE (section 7.1): nine numbers of the wrist plate in, joints out; the same for every plant.

It follows a pose only if the arm can be there, and get there without a joint that jumps. Otherwise, or when the joints are
not where they were told to be, it reports `failed` and stays. The one reason that it knows is `robot`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite

from rcsc.run.signature import Value, Values
from rcsc_cell.cell.arm import Joints, plate, solve
from rcsc_cell.database.pose import nine, pose_of
from rcsc_cell.workstation.orders import DONE, EXECUTING, FAILED

HOLD, FOLLOW = 0, 1
ROBOT_REASON = 9
"""`robot` of `reason` in tables/vocabulary.rcs."""
JUMP_RAD = 0.35
"""The farthest that a joint turns in a cycle: 500 degrees a second; more is an arm that turns over."""
LAG_RAD = 0.15
"""A joint that is farther from where it should be is stuck."""
ARRIVED_RAD = 0.002
"""Every joint this near is there: 1 mm at half a metre."""
REST_RAD = 0.0004
"""A joint that turns less in a cycle is at rest: 5 mm a second at half a metre."""
COORDINATE_MM = 4000.0
"""The declared range of a coordinate in tables/vocabulary.rcs."""


@dataclass(slots=True)
class Robot:
    """The controller.

    Attributes:
        joints: Where the joints are told to be, in radians.
        refused: Number of the order that it failed; None while there is none.
    """

    joints: Joints
    number: int = 0
    command: int = HOLD
    refused: int | None = None
    _before: Joints = field(init=False)

    def __post_init__(self) -> None:
        """Start at rest."""
        self._before = self.joints

    def order(self, order: Values | None, measured: Sequence[float]) -> None:
        """Take the order of a cycle, and set `joints` to their goal in it.

        Args:
            order: Number, command, nine numbers; None before the first.
            measured: The joints as they are.
        """
        if order is None:
            return
        self.number, self.command = int(order[0]), int(order[1])
        if self.number != self.refused:
            self.refused = None
        if self.refused is not None:
            return
        if max(abs(a - b) for a, b in zip(self.joints, measured, strict=True)) > LAG_RAD:
            if self.command == FOLLOW:
                self.refuse(self.number, self.command, measured)
            else:
                self.joints = tuple(measured)  # something has pushed the arm: it holds where it is now
        elif self.command == FOLLOW:
            self._follow([float(value) for value in order[2:]], measured)

    def _follow(self, numbers: Sequence[float], measured: Sequence[float]) -> None:
        wanted = pose_of(numbers)
        joints = None if wanted is None else solve(wanted, self.joints)
        if joints is None or max(abs(a - b) for a, b in zip(joints, self.joints, strict=True)) > JUMP_RAD:
            self.refuse(self.number, self.command, measured)
        else:
            self.joints = joints

    def refuse(self, number: int, command: int, measured: Sequence[float]) -> None:
        """Fail an order, and stay: a pose that was not reached must not pull the arm later."""
        self.number, self.command, self.refused = number, command, number
        if all(map(isfinite, measured)):
            self.joints = tuple(measured)

    def report(self, measured: Sequence[float]) -> tuple[Value, ...]:
        """Return number, command, status, reason, and the nine numbers of the plate's pose.

        A reading outside its declared range is a failure of the robot's, and comes as the end of the range that it passed. To hold
        needs no reading: the brakes are set.
        """
        if not all(map(isfinite, measured)):
            status = DONE if self.command == HOLD else FAILED
            return (self.number, self.command, status, ROBOT_REASON, *nine(plate(self.joints)))
        numbers = nine(plate(measured))
        admitted = tuple(max(-COORDINATE_MM, min(COORDINATE_MM, value)) for value in numbers)
        if self.refused is not None or admitted != numbers:
            return (self.number, self.command, FAILED, ROBOT_REASON, *admitted)
        return (self.number, self.command, DONE if self._done(measured) else EXECUTING, 0, *admitted)

    def _done(self, measured: Sequence[float]) -> bool:
        """Tell whether the order is done: a pose when the joints are there; a hold when they rest, though a vise may have pushed them."""
        before, self._before = self._before, tuple(measured)
        if self.command == HOLD:
            return max(abs(a - b) for a, b in zip(before, measured, strict=True)) <= REST_RAD
        return max(abs(a - b) for a, b in zip(self.joints, measured, strict=True)) <= ARRIVED_RAD
