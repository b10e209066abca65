"""The workstation, and an operator who gives TASK another command in mid-motion, which no interlock stops.

In: a workstation, and rows with the ticks from which they are to be sent. Out: one order buffer, and what became of each row. A command
that is changed is not taken up again: the script goes on with the next row when the other is done, and ends when it fails.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rcsc.run.episodes.operator import CHANGED, EpisodeOperator, OrderLine
from rcsc.run.episodes.outcome import RowEnd
from rcsc.run.orders.numbered import Latest
from rcsc.run.signature import Value, Values
from rcsc_cell.workstation.interlocks import after
from rcsc_cell.workstation.script import ScriptRow
from rcsc_cell.workstation.station import IN_GRIPPER, Workstation


@dataclass(slots=True)
class Operator(EpisodeOperator):
    """Stands outside the levels.

    Attributes:
        changes: What is to be sent yet: ticks, and rows, in order.
    """

    lines: tuple[OrderLine, ...] = ()
    station: Workstation = field(kw_only=True)
    changes: list[tuple[int, ScriptRow]] = field(default_factory=list)
    _row: ScriptRow | None = None
    _since: int = 0
    _known: int = 0
    _alone: bool = False  # the station has ended or was given up
    _first: int = -1  # when the row of the script began
    _cut: bool = False  # a row of the script was under way when another command came

    @property
    def over(self) -> bool:
        """Whether nothing is left to be sent, and everything has been answered."""
        at_rest = self._alone or (self.station.over and self.station.at_rest)
        return at_rest and self._row is None and not self.changes

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """Run one tick."""
        if self.changes and self.changes[0][0] <= tick:
            self._change(tick, self.changes.pop(0)[1], latest)
        elif self._row is not None:
            self._wait(tick, self._row, latest)
        else:
            return {} if self._alone else self._go_on(tick, latest)
        return {self.station.task.order: self.station.task.sent}  # again: a buffer may have been lost

    # --- the script ---

    def _go_on(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        if self._first < 0:
            self._first = tick
        given = self.station.step(tick, latest)
        for result in self.station.results[self._known :]:
            row = result.row
            self.ends.append(RowEnd(row.number, row.text, result.state, result.reason, result.ticks))
            self._first = tick
        self._known = len(self.station.results)
        return given

    # --- the other command ---

    def _change(self, tick: int, row: ScriptRow, latest: Latest) -> None:
        self._leave(tick)
        self.station.task.catch_up(latest)
        self.station.task.send(commanded(self.station, row))
        self._row, self._since = row, tick

    def _leave(self, tick: int) -> None:
        """Drop what was under way, which will not be answered."""
        if self._row is not None:
            self.ends.append(RowEnd(self._row.number, self._row.text, CHANGED, "", tick - self._since))
        elif not self.station.over and not self._alone and self._first >= 0:
            row, self._cut = self.station.rows[self.station.at], True
            self.ends.append(RowEnd(row.number, row.text, CHANGED, "", tick - self._first))

    def _wait(self, tick: int, row: ScriptRow, latest: Latest) -> None:
        report = self.station.task.answer(latest)
        status = "" if report is None else self.station.word(report, "status_report")
        if report is None or status == "executing":
            return
        reason = self.station.word(report, "failure") if status == "failed" else ""
        self.ends.append(RowEnd(row.number, row.text, status, reason, tick - self._since))
        self._row = None
        holds = self.station.word(report, IN_GRIPPER)
        self._resume(tick, row, status, "" if holds == "null_obj" else holds)

    def _resume(self, tick: int, row: ScriptRow, status: str, holds: str) -> None:
        """Continue the script after the row that was changed, with what TASK reports of the hand."""
        before = self.station
        if self._alone or before.over or status != "done":
            self._alone = True
            return
        under_way = before.rows[before.at]
        cell = after(before.cell, under_way) if under_way.vise and self._cut else before.cell
        cell = replace(cell, held=holds, robot_at=row.end_at or row.dest or row.source or cell.robot_at)
        rest = before.rows[before.at + self._cut :]
        # A new one takes up the rows where they are left, and of the orders those to TASK.
        self.station = Workstation(rest, before.locations, before.order, before.report, cell)
        self.station.task = before.task
        self._known, self._first, self._cut = 0, tick, False


def commanded(station: Workstation, row: ScriptRow) -> tuple[Value, ...]:
    """Return a row as TASK's order, without its number.

    Raises:
        ValueError: It is none of TASK's.
    """
    if not row.robot:
        raise ValueError(f"`{row.text}` is no command of TASK's")
    return station.order_of(row.robot, row)
