"""Who gives the orders of a script, one after the other, and stops at the first that does not end as it should.

In: rows. Out: what stands in the order buffers, and one result a row. After a failure the level is ordered to do what its
first command says, which rests.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from rcsc.run.orders.numbered import Latest, Orders
from rcsc.run.orders.roles import COMMAND, DONE, FAILED, PROTOCOL, Served, field_of
from rcsc.run.orders.script import OrderRow
from rcsc.run.signature import Value, Values
from rcsc.run.system import System

MOST_TICKS = 100_000
"""Ticks after which a run is given up: more than an hour of control time at 40 ms."""
REST_TICKS = 200
"""Within which a level has answered that it rests."""


class ScriptRow(Protocol):
    """A row of any script."""

    @property
    def number(self) -> int:
        """As its file counts, from 1."""
        ...

    @property
    def text(self) -> str:
        """As it is shown."""
        ...


class Result(Protocol):
    """What became of a row of any script."""

    @property
    def row(self) -> ScriptRow:
        """The row."""
        ...

    @property
    def state(self) -> str:
        """`done`, `failed`, or what else became of it."""
        ...

    @property
    def reason(self) -> str:
        """Why it was not done; empty where it was."""
        ...

    @property
    def ticks(self) -> int:
        """How many cycles it took, the one in which its end was seen included: those of all rows are those of the run."""
        ...


class Operator(Protocol):
    """Who gives orders: something outside that works through rows."""

    @property
    def rows(self) -> Sequence[ScriptRow]:
        """All of them."""
        ...

    @property
    def at(self) -> int:
        """The row under way, from 0."""
        ...

    @property
    def results(self) -> Sequence[Result]:
        """Rows that are over."""
        ...

    @property
    def over(self) -> bool:
        """Whether every row is done, or one was not."""
        ...

    @property
    def at_rest(self) -> bool:
        """Whether a failure has been answered by rest, or was waited for in vain."""
        ...

    @property
    def stopped(self) -> Result | None:
        """The result that stopped the script."""
        ...

    def begin_at(self, row: int) -> None:
        """Goes on at another row, from 0, as if those between were done."""
        ...

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick."""
        ...


@dataclass(frozen=True, slots=True)
class RowResult:
    """What became of a row: `state` is `done` where it ended as it was to, else `failed`; `ticks` as of `Result`."""

    row: OrderRow
    state: str
    reason: str
    first_tick: int
    ticks: int


@dataclass(slots=True)
class ScriptOperator:
    """Gives the orders of a script.

    Attributes:
        at: The row under way, from 0.
        results: Rows that are over.
    """

    rows: tuple[OrderRow, ...]
    at: int = 0
    results: list[RowResult] = field(default_factory=list)
    _lines: dict[str, Orders] = field(default_factory=dict)
    _since: int = -1  # the tick at which the row began
    _resting: int = -1  # the tick at which the level was told to rest, while that is not answered
    _holding: OrderRow | None = None  # whose values and faults this tick has

    def __post_init__(self) -> None:
        """Opens a line to every level that the script orders."""
        for row in self.rows:
            if row.served is not None and row.served.level not in self._lines:
                self._lines[row.served.level] = line_to(row.served)

    @property
    def over(self) -> bool:
        """Whether every row is done, or one was not."""
        return self.at >= len(self.rows) or self.stopped is not None

    @property
    def at_rest(self) -> bool:
        """Whether the order to rest after a failure has been answered, or was waited for in vain."""
        return self._resting < 0

    @property
    def stopped(self) -> RowResult | None:
        """The result that stopped the script."""
        last = self.results[-1] if self.results else None
        return last if last is not None and last.state != DONE else None

    @property
    def held(self) -> Mapping[str, Mapping[int, Value]]:
        """What buffers from outside hold because of the row under way."""
        return {} if self._holding is None else self._holding.set

    @property
    def faults(self) -> frozenset[str]:
        """The plant's faults that are on because of the row under way."""
        return frozenset(() if self._holding is None else self._holding.faults)

    def begin_at(self, row: int) -> None:
        """Goes on at another row, as if those between were done.

        Args:
            row: From 0.
        """
        self.at, self._since, self._holding = row, -1, None

    def state(self) -> dict[str, Any]:
        """What a stopped one goes on from; its orders stand in their buffers."""
        return {"at": self.at}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Puts back a state, and tries its row again; numbers go on from those in the buffers.

        Raises:
            ValueError: It is none.
        """
        at = state.get("at")
        if type(at) is not int or not 0 <= at < len(self.rows) or len(state) != 1:
            raise ValueError(f"the script has {len(self.rows)} rows")
        self.at, self._since, self._resting, self._holding = at, -1, -1, None
        self.results.clear()
        for line in self._lines.values():
            line.sent = ()

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick: begin a row, wait for its end, or rest."""
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
        """How a row stands after so many cycles, and why it failed; the first is empty while it is under way."""
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
    """Return what carries orders to a level, with its range of numbers."""
    high = level.order_leaves[level.number].high
    numbers = int(high) + 1 if high is not None else 2
    return Orders(level.order, level.report, level.echo, level.number, numbers=numbers)


def answer_reason(level: Served, report: Values) -> str:
    """What a report says beside the protocol: why it failed."""
    fields = [
        f"{field_of(leaf)} {leaf.shown(value)}"
        for leaf, value in zip(level.report_leaves, report, strict=True)
        if field_of(leaf) not in PROTOCOL
    ]
    return ", ".join(fields)


@dataclass(slots=True)
class ScriptedRun:
    """A system with somebody who orders it, or nobody, to be stepped to the end.

    Attributes:
        first_tick: With which it began; not 0 where it goes on from a run that stopped.
    """

    system: System
    operator: Operator | None
    first_tick: int = field(init=False, default=0)

    @property
    def ended(self) -> bool:
        """Whether the script is at its end and its level rests, or something outside says that it is over."""
        operator = self.operator
        if operator is not None and operator.over and operator.at_rest:
            return True
        return any(getattr(part, "over", False) for part in self.system.outside if part is not operator)

    def steps(self, most: int = MOST_TICKS) -> Iterator[Result]:
        """Runs to the end, or to what stops the script and until the level rests; each result as it comes.

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
