"""The controllers of the vise and the machine, the same for every plant.

In: the workstation's orders (`rcsc_cell.workstation.orders`), and where the jaws are. Out: where the jaws are to go, and reports. A jaw's
position is in mm from where it touches a part: open is positive. The jaws are ours: the paper's vise is only in its script (Haynes et al.
1984, Fig. 7).
"""

from dataclasses import dataclass, field
from math import isfinite

from rcsc.run.signature import Values
from rcsc_cell.workstation.orders import CLOSED_MM, DONE, EXECUTING, FAILED, OPEN_MM

OUT_MM = 20.0
"""Where an open jaw is sent."""
IN_MM = -6.0
"""Where a closed jaw is sent: it presses before it is there, on a part or on its stop."""
REST_MM = 0.1
"""A jaw that moves less in a cycle is at rest."""
REST_TICKS = 3
"""Cycles that it is at rest before that is believed."""
START_TICKS = 10
"""A jaw that has not begun to move by then does not."""
MOST_TICKS = 50
"""Within which a jaw comes to rest where it should: 2 s."""
OPERATION_TICKS = 50
"""What an operation of the machine takes: 2 s."""


@dataclass(slots=True)
class JawController:
    """One jaw.

    Attributes:
        opened: How it is to stand; None before the first order: as it is.
        held_mm: Where it is kept: before the first order, and after it failed, so that it does not start by itself.
    """

    opened: bool | None = None
    held_mm: float | None = None
    _last_mm: float | None = None
    _rest: int = 0

    def look(self, measured_mm: float) -> None:
        """Count cycles at rest."""
        moved = None if self._last_mm is None else abs(measured_mm - self._last_mm)
        self._rest = self._rest + 1 if moved is not None and moved <= REST_MM else 0
        self._last_mm = measured_mm

    def begin(self, opened: bool) -> None:
        """Take an order; rest counts from now."""
        self.opened, self.held_mm, self._rest = opened, None, 0

    @property
    def at_rest(self) -> bool:
        """True once it has stopped moving."""
        return self._rest >= REST_TICKS

    @property
    def ends(self) -> bool:
        """True once it stands as ordered: open as soon as it is out, closed when it has stopped on something."""
        if self.opened is None or self._last_mm is None:
            return False
        return self._last_mm > OPEN_MM if self.opened else self.at_rest and self._last_mm < CLOSED_MM

    def hold(self) -> None:
        """Stay at the present place from now on."""
        if self._last_mm is not None and isfinite(self._last_mm):
            self.held_mm = self._last_mm

    def wait(self) -> None:
        """Stay where it was first seen; no order has come yet."""
        if self.held_mm is None:
            self.hold()

    @property
    def target_mm(self) -> float:
        """The place where it is sent, in mm."""
        if self.held_mm is not None:
            return self.held_mm
        return OUT_MM if self.opened else IN_MM


@dataclass(slots=True)
class ViseController:
    """Take the workstation's orders, and report from the measured jaws alone whether they are carried out.

    An order is taken when its number is another than the last one's, and the first whatever its number. Before it the jaws do not move.

    Attributes:
        number: Of the order that `status` is about.
    """

    number: int = 0
    status: int = DONE
    right: JawController = field(default_factory=JawController)
    left: JawController = field(default_factory=JawController)
    _ticks: int = -1  # since the order; negative before the first

    def step(
        self, order: Values | None, measured_right_mm: float, measured_left_mm: float
    ) -> tuple[float, float, Values]:
        """Run one cycle.

        Args:
            order: number, right_open, left_open; None before the first.
            measured_right_mm: From where the jaw touches a part; open is positive.
            measured_left_mm: Likewise.

        Returns:
            Where the right and the left jaw are to go, in mm, and the report: echo, status, and both as measured.
        """
        jaws = (self.right, self.left)
        for jaw, measured_mm in zip(jaws, (measured_right_mm, measured_left_mm), strict=True):
            jaw.look(measured_mm)
        if order is not None and (self._ticks < 0 or order[0] != self.number):
            self._begin(order)
        elif self._ticks < 0:
            for jaw in jaws:
                jaw.wait()
        elif self.status == EXECUTING:
            self._judge()
        report = (self.number, self.status, measured_right_mm, measured_left_mm)
        return self.right.target_mm, self.left.target_mm, report

    def _begin(self, order: Values) -> None:
        self.number, self.status, self._ticks = int(order[0]), EXECUTING, 0
        self.right.begin(bool(order[1]))
        self.left.begin(bool(order[2]))

    def _judge(self) -> None:
        self._ticks += 1
        wrong = [jaw for jaw in (self.right, self.left) if not jaw.ends]
        if not wrong:
            self.status = DONE
        elif self._ticks >= MOST_TICKS or (self._ticks > START_TICKS and all(jaw.at_rest for jaw in wrong)):
            self.status = FAILED
            for jaw in wrong:
                jaw.hold()


@dataclass(slots=True)
class MachineController:
    """Carries out operations, each for `OPERATION_TICKS`; does none on a part that is not clamped.

    Attributes:
        number: Of the order that `status` is about.
    """

    number: int = 0
    status: int = DONE
    _ticks: int = -1  # since the order; negative before the first

    def step(self, order: Values | None, right_mm: float, left_mm: float) -> Values:
        """Run one cycle; return the report: echo, status.

        Args:
            order: number, operation (0 is none); None before the first.
            right_mm: Where the right jaw is, as measured.
            left_mm: The left one.
        """
        if order is not None and (self._ticks < 0 or order[0] != self.number):
            self.number, self._ticks = int(order[0]), 0
            self.status = EXECUTING if order[1] else DONE
        elif self.status == EXECUTING:
            self._ticks += 1
        if self.status == EXECUTING:
            clamped = right_mm < CLOSED_MM and left_mm < CLOSED_MM
            if not clamped:
                self.status = FAILED
            elif self._ticks >= OPERATION_TICKS:
                self.status = DONE
        return self.number, self.status
