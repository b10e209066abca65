"""Numbered orders to TASK, to the vise and to the machine; the buffers of the last two, which no level has, are named here.

In: what is to be sent, and the buffers. Out: an order with a number that nobody below has seen, and the answer to it. Numbers are 16
bits and wrap; an answer is one only if it repeats the number (Haynes et al. 1984, section 8.3).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rcsc.run.signature import Value, Values

VISE_ORDER = "workstation.vise"
"""number, right_open, left_open: how each jaw is to stand."""
VISE_REPORT = "vise.report"
"""echo, status, right_mm, left_mm: where each jaw stands, from where it touches a part; open is positive."""
MACHINE_ORDER = "workstation.machine"
"""number, operation: from 1 in the order of `rcsc_cell.workstation.script.MACHINE`; 0 is none."""
MACHINE_REPORT = "machine.report"
"""echo, status."""
BETWEEN = (VISE_ORDER, VISE_REPORT, MACHINE_ORDER, MACHINE_REPORT)
"""Buffers that have no level at either end."""

KINDS = {
    VISE_ORDER: tuple[int, bool, bool], VISE_REPORT: tuple[int, int, float, float],
    MACHINE_ORDER: tuple[int, int], MACHINE_REPORT: tuple[int, int],
}  # fmt: skip
"""What each of them holds."""

DONE, EXECUTING, FAILED = 0, 1, 2
"""`level_status` of tables/vocabulary.rcs: how it stands in every report, the robot's too."""
NUMBERS = 65536
OPEN_MM = 19.0
"""An open jaw stands farther out than this."""
CLOSED_MM = 3.0
"""A closed jaw stands nearer than this: it has met the part, or its stop."""

Latest = Callable[[str], Values | None]


@dataclass(slots=True)
class Orders:
    """What stands in an order buffer, and how its answer is told.

    Attributes:
        order: Name of the buffer; `report` of the one that answers.
        echo_at: Where the report repeats the number; `number_at` where the order has it.
        number: Of the last order.
        sent: The last order; empty before the first of this run.
    """

    order: str
    report: str
    echo_at: int = 0
    number_at: int = 0
    number: int = 0
    sent: tuple[Value, ...] = field(default=())

    def catch_up(self, latest: Latest) -> None:
        """Before the first order: numbers go on from the one that stands in the buffer, else from what was echoed."""
        if self.sent:
            return
        standing, report = latest(self.order), latest(self.report)
        if standing is not None:
            self.number = int(standing[self.number_at])
        elif report is not None:
            self.number = int(report[self.echo_at])

    def send(self, values: Sequence[Value]) -> None:
        """Makes this the order, with the next number in its place."""
        self.number = (self.number + 1) % NUMBERS
        self.sent = (*values[: self.number_at], self.number, *values[self.number_at :])

    def answer(self, latest: Latest) -> Values | None:
        """The report, if it is about the last order; None while it is not."""
        report = latest(self.report)
        return report if report is not None and report[self.echo_at] == self.number else None


def ajar(report: Values, *, right_open: bool, left_open: bool) -> str:
    """Which jaw does not stand as it should, and where it stands; empty when both do."""
    for jaw, opened, at_mm in (("right", right_open, report[2]), ("left", left_open, report[3])):
        if not (at_mm > OPEN_MM if opened else at_mm < CLOSED_MM):
            return f"the {jaw} jaw did not {'open' if opened else 'close'}: it stands at {at_mm:.1f} mm"
    return ""
