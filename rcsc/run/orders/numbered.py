"""Numbered orders: what stands in an order buffer, and how the answer to it is told (Haynes et al. 1984, section 8.3).

In: what is to be sent, and the buffers. Out: an order with a number that nobody below has seen, and the report that
repeats it. Numbers wrap; a report is an answer only if it repeats the number.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rcsc.run.signature import Value, Values

NUMBERS = 65536

Latest = Callable[[str], Values | None]


@dataclass(slots=True)
class Orders:
    """What stands in an order buffer, and how its answer is told.

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
        self.number = (self.number + 1) % self.numbers
        self.sent = (*values[: self.number_at], self.number, *values[self.number_at :])

    def answer(self, latest: Latest) -> Values | None:
        """The report, if it is about the last order; None while it is not."""
        report = latest(self.report)
        return report if report is not None and report[self.echo_at] == self.number else None
