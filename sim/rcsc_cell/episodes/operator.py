"""The workstation, and an operator who gives TASK another command in mid-motion, which no interlock stops.

In: a workstation, and rows with the ticks from which they are to be sent. Out: one order buffer, and what became of each row. A command
that is changed is not taken up again: the script goes on with the next row when the other is done, and ends when it fails.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rcsc.run.episodes.operator import CHANGED, EpisodeOperator, OrderLine
from rcsc.run.episodes.outcome import RowEnd
from rcsc.run.orders.numbered import NUMBERS, Latest
from rcsc.run.signature import Leaf, Value, Values
from rcsc_cell.workstation.interlocks import CellState, after
from rcsc_cell.workstation.script import ScriptRow
from rcsc_cell.workstation.station import Workstation

ORDER, REPORT = "workstation.order", "task.to_workstation"


@dataclass(slots=True)
class Operator(EpisodeOperator):
    """Stands outside the levels.

    Attributes:
        changes: What is to be sent yet: ticks, and rows, in order.
        sent: The order that stands in TASK's buffer; empty before the first.
        given: How many orders were sent.
    """

    lines: tuple[OrderLine, ...] = ()
    station: Workstation = field(kw_only=True)
    changes: list[tuple[int, ScriptRow]] = field(default_factory=list)
    sent: Values = ()
    given: int = 0
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
        """One tick."""
        if self.changes and self.changes[0][0] <= tick:
            self._change(tick, self.changes.pop(0)[1], latest)
            return {ORDER: self.sent}
        if self._row is not None:
            self._wait(tick, self._row, latest)
            return {ORDER: self.sent}  # again: a buffer may have been lost
        return {} if self._alone else self._go_on(tick, latest)

    # --- the script ---

    def _go_on(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        if self._first < 0:
            self._first = tick
        given = self.station.step(
            tick, lambda name: self.sent or latest(name) if name == ORDER else latest(name)
        )
        order = given.get(ORDER, ())
        if order and order != self.sent:
            self.sent, self.given = order, self.given + 1
        for result in self.station.results[self._known :]:
            self.ends.append(
                RowEnd(result.row.number, result.row.text, result.state, result.reason, result.ticks)
            )
            self._first = tick
        self._known = len(self.station.results)
        return given

    # --- the other command ---

    def _change(self, tick: int, row: ScriptRow, latest: Latest) -> None:
        self._leave(tick)
        number = int(self.sent[_number_at(self.station.order)]) if self.sent else _echoed(latest)
        self.sent = order(self.station, row, (number + 1) % NUMBERS)
        self.given += 1
        self._row, self._since = row, tick

    def _leave(self, tick: int) -> None:
        """Drop what was under way, which will not be answered."""
        if self._row is not None:
            self.ends.append(RowEnd(self._row.number, self._row.text, CHANGED, "", tick - self._since))
        elif not self.station.over and not self._alone and self._first >= 0:
            row, self._cut = self.station.rows[self.station.at], True
            self.ends.append(RowEnd(row.number, row.text, CHANGED, "", tick - self._first))

    def _wait(self, tick: int, row: ScriptRow, latest: Latest) -> None:
        report = latest(REPORT)
        words = {_last(leaf): leaf for leaf in self.station.report}
        places = {_last(leaf): at for at, leaf in enumerate(self.station.report)}
        number = self.sent[_number_at(self.station.order)]
        if report is None or report[places["inc_command_echo"]] != number:
            return
        status = words["status_report"].shown(report[places["status_report"]])
        if status == "executing":
            return
        reason = words["failure"].shown(report[places["failure"]]) if status == "failed" else ""
        self.ends.append(RowEnd(row.number, row.text, status, reason, tick - self._since))
        self._row = None
        holds = words["status_parameter"].shown(report[places["status_parameter"]])
        self._resume(tick, row, status, "" if holds == "null_obj" else holds)

    def _resume(self, tick: int, row: ScriptRow, status: str, holds: str) -> None:
        """Continue the script after the row that was changed, with what TASK reports of the hand."""
        if self._alone or self.station.over or status != "done":
            self._alone = True
            return
        at = self.station.at
        under_way = self.station.rows[at]
        cell = after(self.station.cell, under_way) if under_way.vise and self._cut else self.station.cell
        where = row.end_at or row.dest or row.source or cell.robot_at
        rest = self.station.rows[at + self._cut :]
        # A new one: it takes up the numbers of the orders where they are, and the rows where they are left.
        self.station = replace_rows(self.station, rest, replace(cell, held=holds, robot_at=where))
        self._known, self._first, self._cut = 0, tick, False


def replace_rows(station: Workstation, rows: tuple[ScriptRow, ...], cell: CellState) -> Workstation:
    """A workstation that has sent nothing yet, and believes this of the cell."""
    return Workstation(rows, station.locations, station.order, station.report, cell)


def order(station: Workstation, row: ScriptRow, number: int) -> Values:
    """A row as TASK's order.

    Raises:
        ValueError: It is none of TASK's.
    """
    if not row.robot:
        raise ValueError(f"`{row.text}` is no command of TASK's")
    values: dict[str, Value | str] = {
        "inc_command": number,
        "input_command": row.robot,
        "obj": row.part or "null_obj",
        "grasp": row.grasp,
        "source_locpt": station.locations.get(row.source, 0),
        "dest_locpt": station.locations.get(row.dest, 0),
        "end_at_locpt": station.locations.get(row.end_at, 0),
        "sector": row.sector,
    }
    return tuple(_value(leaf, values[_last(leaf)]) for leaf in station.order)


def _value(leaf: Leaf, value: Value | str) -> Value:
    return leaf.members.index(value) if isinstance(value, str) else value


def _last(leaf: Leaf) -> str:
    return leaf.name.rpartition(".")[2]


def _number_at(leaves: tuple[Leaf, ...]) -> int:
    return next(at for at, leaf in enumerate(leaves) if _last(leaf) == "inc_command")


def _echoed(latest: Latest) -> int:
    report = latest(REPORT)
    return 0 if report is None else int(report[0])
