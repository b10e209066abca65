"""The workstation as it runs: it sends TASK one command after the other, works vise and machine, and stops at a failure.

In: a script, the database's names, the words of TASK's command buffer. Out: one result a row; the order buffer.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from rcsc.system.signature import Leaf, Signature, Value, Values
from rcsc.workstation.interlocks import Cell, after, refusal
from rcsc.workstation.script import ROBOT, BadScript, Row

VISE_TICKS = 15
MACHINE_TICKS = 50
State = Literal["running", "done", "failed", "refused"]


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a row."""

    row: Row
    state: State
    reason: str
    first_tick: int
    ticks: int


@dataclass(slots=True)
class Workstation:
    """Runs a script.

    Attributes:
        words: TASK's command and report buffers, leaf by leaf, to speak in its words.
        results: Rows that are over.
        at: The row under way.
    """

    rows: tuple[Row, ...]
    locations: Mapping[str, int]
    order: tuple[Leaf, ...]
    report: tuple[Leaf, ...]
    cell: Cell = field(default_factory=Cell)
    at: int = 0
    results: list[Result] = field(default_factory=list)
    paused: bool = False
    _number: int = 0
    _sent: tuple[Value, ...] = ()
    _since: int = -1

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """One tick: begin a row, wait for it, or rest."""
        report = latest("task.report")
        if not self._sent and report is not None:
            self._number = int(report[self._place("inc_command_echo")])  # goes on from what TASK has seen
        if not self.over:
            self._work(tick, report)
        return {"workstation.order": self._sent} if self._sent else {}

    @property
    def over(self) -> bool:
        """Whether every row is done, or one was not."""
        return self.at >= len(self.rows) or self.stopped is not None

    @property
    def stopped(self) -> Result | None:
        """The result that stopped the script."""
        last = self.results[-1] if self.results else None
        return last if last is not None and last.state != "done" and last.row is self.rows[self.at] else None

    def resume(self) -> None:
        """Tries the row that stopped the script again."""
        if self.stopped is not None:
            self.results.pop()
            self._since = -1

    def _work(self, tick: int, report: Values | None) -> None:
        row = self.rows[self.at]
        if self._since < 0:
            self._begin(row, tick)
            return
        if row.vise or row.machine:
            if tick - self._since >= (VISE_TICKS if row.vise else MACHINE_TICKS):
                self._end(row, tick, "done", "")
            return
        if report is None or report[self._place("inc_command_echo")] != self._number:
            return
        status = self._word(report, "status_report")
        if status == "done":
            self._end(row, tick, "done", "")
        elif status == "failed":
            self._end(row, tick, "failed", self._word(report, "failure"))
            self._send("pause", Row(row.number, "PAUSE", "pause"))

    def _begin(self, row: Row, tick: int) -> None:
        why = refusal(self.cell, row)
        self._since = tick
        if why:
            self._end(row, tick, "refused", why)
        elif row.robot:
            self._send(row.robot, row)

    def _end(self, row: Row, tick: int, state: State, reason: str) -> None:
        self.results.append(Result(row, state, reason, self._since, tick - self._since))
        if state == "done":
            self.cell = after(self.cell, row)
            self.at += 1
            self._since = -1

    def _send(self, command: str, row: Row) -> None:
        self._number = (self._number + 1) % 65536
        said: dict[str, Value | str] = {
            "inc_command": self._number,
            "input_command": command,
            "obj": row.part or "null_obj",
            "grasp": row.grasp,
            "source_locpt": self.locations.get(row.source, 0),
            "dest_locpt": self.locations.get(row.dest, 0),
            "end_at_locpt": self.locations.get(row.end_at, 0),
            "sector": row.sector,
        }
        self._sent = tuple(_value(leaf, said[_last(leaf)]) for leaf in self.order)

    def _place(self, name: str) -> int:
        return next(at for at, leaf in enumerate(self.report) if _last(leaf) == name)

    def _word(self, report: Values, name: str) -> str:
        at = self._place(name)
        return self.report[at].shown(report[at])


def workstation(rows: Sequence[Row], locations: Mapping[str, int], task: Signature) -> Workstation:
    """A workstation that runs the rows from the first.

    Raises:
        BadScript: A row names a place or a part that nobody knows.
    """
    order = tuple(task.leaves[at] for at in task.record("command"))
    report = tuple(task.leaves[at] for at in task.record("report"))
    parts = next(leaf.members for leaf in order if _last(leaf) == "obj")
    wrong = [
        f"row {row.number}: no location is called `{name}`"
        for row in rows
        for name in (row.source, row.dest, row.end_at)
        if name and name not in locations
    ]
    wrong += [
        f"row {row.number}: no part is called `{row.part}`"
        for row in rows
        if row.part and row.part not in parts
    ]
    wrong += [
        f"row {row.number}: `{row.robot}` is no command"
        for row in rows
        if row.robot and row.robot not in ROBOT
    ]
    if wrong:
        raise BadScript("\n".join(wrong))
    return Workstation(tuple(rows), locations, order, report)


def _last(leaf: Leaf) -> str:
    return leaf.name.rpartition(".")[2]


def _value(leaf: Leaf, said: Value | str) -> Value:
    return leaf.members.index(said) if isinstance(said, str) else said
