"""Who gives the orders of a script, one after the other, and stops at the first that does not end as it should.

In: rows. Out: what stands in the order buffers, and one result a row. After a failure the level is ordered to do what its
first command says, which rests.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from rcsc.lang.restart import COMMAND, PROTOCOL
from rcsc.run.orders.numbered import Latest, Orders
from rcsc.run.orders.roles import DONE, FAILED, Served, field_of
from rcsc.run.orders.script import OrderRow
from rcsc.run.signature import Value, Values
from rcsc.run.system import System

MOST_TICKS = 100_000
"""Ticks after which a run is given up: more than an hour of control time at 40 ms."""
UNORDERED_TICKS = 1000
"""Of a run that no script ends, where nobody says."""
WATCHED_RATE = 4.0
"""How many times as fast as the clock processes and a system that somebody watches run, where nobody says."""
REST_TICKS = 200
"""Within which a level has answered that it rests."""


class ScriptRow(Protocol):
    """A row of any script."""

    @property
    def number(self) -> int:
        """The row's number in its file, from 1."""
        ...

    @property
    def text(self) -> str:
        """The row's text, as it is shown."""
        ...


Row_co = TypeVar("Row_co", bound=ScriptRow, covariant=True)


@dataclass(frozen=True, slots=True)
class RowResult(Generic[Row_co]):
    """The result of a row of any script.

    Attributes:
        state: `done` where it ended as it was to, `failed`, or another state.
        reason: The reason why the row was not done; empty where it was.
        ticks: Number of cycles that the row took, with the one that saw its end: those of all rows add up to those of the run.
    """

    row: Row_co
    state: str
    reason: str
    first_tick: int
    ticks: int


class Operator(Protocol):
    """The giver of orders: a part outside that works through rows."""

    @property
    def rows(self) -> Sequence[ScriptRow]:
        """All of them."""
        ...

    @property
    def at(self) -> int:
        """The row under way, from 0."""
        ...

    @property
    def results(self) -> Sequence[RowResult[ScriptRow]]:
        """Results of the rows that are over."""
        ...

    @property
    def over(self) -> bool:
        """True once every row is done, or one was not."""
        ...

    @property
    def at_rest(self) -> bool:
        """True once the level rests after a failure, or the wait for that was in vain."""
        ...

    @property
    def stopped(self) -> RowResult[ScriptRow] | None:
        """The result that stopped the script."""
        ...

    @property
    def faults(self) -> frozenset[str]:
        """The plant's faults that the row under way switches on."""
        ...

    def begin_at(self, row: int) -> None:
        """Continue at another row, from 0, as if those between were done."""
        ...

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one tick."""
        ...


@dataclass(slots=True)
class ScriptOperator:
    """Gives the orders of a script.

    Attributes:
        at: The row under way, from 0.
        results: Rows that are over.
    """

    rows: tuple[OrderRow, ...]
    at: int = 0
    results: list[RowResult[OrderRow]] = field(default_factory=list)
    _lines: dict[str, Orders] = field(default_factory=dict)
    _since: int = -1  # the tick at which the row began
    _resting: int = -1  # the tick at which the level was told to rest, while that is not answered
    _holding: OrderRow | None = None  # whose values and faults this tick has

    def __post_init__(self) -> None:
        """Open a line to every level that the script orders."""
        for row in self.rows:
            if row.served is not None and row.served.level not in self._lines:
                self._lines[row.served.level] = line_to(row.served)

    @property
    def over(self) -> bool:
        """True once every row is done, or one was not."""
        return self.at >= len(self.rows) or self.stopped is not None

    @property
    def at_rest(self) -> bool:
        """True once the order to rest after a failure has been answered, or the wait for that was in vain."""
        return self._resting < 0

    @property
    def stopped(self) -> RowResult[OrderRow] | None:
        """The result that stopped the script."""
        last = self.results[-1] if self.results else None
        return last if last is not None and last.state != DONE else None

    @property
    def held(self) -> Mapping[str, Mapping[int, Value]]:
        """The values that the row under way sets in buffers from outside: by the buffer, by the place in it."""
        return {} if self._holding is None else self._holding.set

    @property
    def faults(self) -> frozenset[str]:
        """The plant's faults that the row under way switches on."""
        return frozenset(() if self._holding is None else self._holding.faults)

    def begin_at(self, row: int) -> None:
        """Continue at another row, as if those between were done.

        Args:
            row: From 0.
        """
        self.at, self._since, self._holding = row, -1, None

    def state(self) -> dict[str, Any]:
        """Return the state from which a stopped script continues; its orders stand in their buffers."""
        return {"at": self.at}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state, and try its row again; numbers go on from those in the buffers.

        Raises:
            ValueError: The state is none of this script.
        """
        at = state.get("at")
        if type(at) is not int or not 0 <= at < len(self.rows) or len(state) != 1:
            raise ValueError(f"the script has {len(self.rows)} rows")
        self.at, self._since, self._resting, self._holding = at, -1, -1, None
        self.results.clear()
        for line in self._lines.values():
            line.sent = ()

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one tick: begin a row, wait for its end, or rest."""
        for line in self._lines.values():
            line.catch_up(latest)
        self._holding = None
        if self._resting >= 0:
            self._await_rest(tick, latest)
        elif not self.over:
            self._work(tick, latest)
        return {line.order: line.sent for line in self._lines.values() if line.sent}

    def _work(self, tick: int, latest: Latest) -> None:
        row = self.rows[self.at]
        begins = self._since < 0
        if begins:
            self._since = tick
            if row.served is not None:
                self._lines[row.served.level].send(row.order)
        state, reason = self._now(row, tick - self._since, latest) if row.timed or not begins else ("", "")
        self._holding = row if row.timed or not state else None
        if state:
            self._end(row, tick, state, reason)

    def _now(self, row: OrderRow, ticks: int, latest: Latest) -> tuple[str, str]:
        """Return the state of a row after so many cycles, and the reason of a failure; an empty state while it is under way."""
        if row.cycles is not None:  # nothing is waited for: it ends in its last cycle, not in the one after
            return (DONE, "") if ticks + 1 >= row.cycles else ("", "")
        assert row.served is not None  # a row without a command takes so many cycles
        report = self._lines[row.served.level].answer(latest)
        if report is not None:
            status = row.served.report_leaves[row.served.status].shown(report[row.served.status])
            if status == row.expect:
                said = answer_reason(row.served, report) if status == row.served.failed else ""
                return DONE, f"{status} as expected: {said}" if said else ""
            if status in (row.served.done, row.served.failed):
                wanted = "" if row.expect == row.served.done else f", and was to be {row.expect}"
                said = answer_reason(row.served, report) if status == row.served.failed else ""
                return FAILED, f"{said or status}{wanted}"
        if row.within is not None and ticks >= row.within:
            answered = "did not end" if report is not None else "is not answered"
            return FAILED, f"{answered} in {row.within} cycles"
        return "", ""

    def _end(self, row: OrderRow, tick: int, state: str, reason: str) -> None:
        self.results.append(RowResult(row, state, reason, self._since, tick - self._since + 1))
        self._since = -1
        if state == DONE:
            self.at += 1
        elif row.served is not None:
            resting = {COMMAND: row.served.rest}
            self._lines[row.served.level].send(row.served.order_with(resting))
            self._resting = tick

    def _await_rest(self, tick: int, latest: Latest) -> None:
        level = self.rows[self.at].served
        assert level is not None
        report = self._lines[level.level].answer(latest)
        status = "" if report is None else level.report_leaves[level.status].shown(report[level.status])
        if status in (level.done, level.failed) or tick - self._resting >= REST_TICKS:
            self._resting = -1


def line_to(level: Served) -> Orders:
    """Return the orders to a level, with its range of numbers."""
    high = level.order_leaves[level.number].high
    numbers = int(high) + 1 if high is not None else 2
    return Orders(level.order, level.report, level.echo, level.number, numbers=numbers)


def answer_reason(level: Served, report: Values) -> str:
    """Return the fields of a report beside the protocol's: the reason of a failure."""
    fields = [
        f"{field_of(leaf)} {leaf.shown(value)}"
        for leaf, value in zip(level.report_leaves, report, strict=True)
        if field_of(leaf) not in PROTOCOL
    ]
    return ", ".join(fields)


@dataclass(slots=True)
class ScriptedRun:
    """A system with an operator, or with none, to be stepped to the end.

    Attributes:
        first_tick: With which it began; not 0 where it goes on from a run that stopped.
    """

    system: System
    operator: Operator | None
    first_tick: int = field(init=False, default=0)

    @property
    def ended(self) -> bool:
        """True once the script has ended and its level rests, or a part outside says that the run is over."""
        operator = self.operator
        if operator is not None and operator.over and operator.at_rest:
            return True
        return any(getattr(part, "over", False) for part in self.system.outside if part is not operator)

    def steps(self, most: int = MOST_TICKS) -> Iterator[RowResult[ScriptRow]]:
        """Run to the end, or until the level rests after a failure; yield each result as it comes.

        Args:
            most: Ticks after which the run is given up.

        Raises:
            StateTableError: A level met a fault that the proofs exclude.
        """
        results = () if self.operator is None else self.operator.results
        known = len(results)
        self.first_tick = self.system.tick
        while not self.ended and self.system.tick < self.first_tick + most:
            self.system.step()
            while known < len(results):
                yield results[known]
                known += 1
