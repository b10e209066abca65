"""Numbered orders: what stands in an order buffer, and how the answer to it is told (Haynes et al. 1984, section 8.3).

In: what is to be sent, and the buffers. Out: an order with a number that nobody below has seen, and the report that
repeats it. Numbers wrap; a report is an answer only if it repeats the number.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rcsc.lang.restart import NUMBERS
from rcsc.run.signature import Value, Values

Latest = Callable[[str], Values | None]


@dataclass(slots=True)
class Orders:
    """The orders sent over one order buffer, and the report that answers them.

    Attributes:
        order: Name of the buffer; `report` of the one that answers.
        echo_at: Where the report repeats the number; `number_at` where the order has it.
        number: Of the last order.
        sent: The last order; empty before the first of this run.
        numbers: How many there are.
    """

    order: str
    report: str
    echo_at: int = 0
    number_at: int = 0
    number: int = 0
    sent: tuple[Value, ...] = field(default=())
    numbers: int = NUMBERS

    def catch_up(self, latest: Latest) -> None:
        """Continue the numbers, before the first order, from the one in the buffer, else from the echoed one."""
        if self.sent:
            return
        standing, report = latest(self.order), latest(self.report)
        if standing is not None:
            self.number = int(standing[self.number_at])
        elif report is not None:
            self.number = int(report[self.echo_at])

    def send(self, values: Sequence[Value]) -> None:
        """Set the order, with the next number in its place."""
        self.number = (self.number + 1) % self.numbers
        self.sent = (*values[: self.number_at], self.number, *values[self.number_at :])

    def answer(self, latest: Latest) -> Values | None:
        """Return the report, if it answers the last order; else None."""
        report = latest(self.report)
        return report if report is not None and report[self.echo_at] == self.number else None
