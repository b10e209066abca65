"""The workstation as it runs: one command after the other to TASK, the vise and the machine; it stops at a failure.

In: a script, the database's names, the words of TASK's command buffer. Out: one result a row; the order buffers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, cast

from rcsc.base.host.files.plain import plain, read
from rcsc.run.orders.numbered import Latest, Orders
from rcsc.run.orders.operator import RowResult
from rcsc.run.orders.script import BadScript
from rcsc.run.signature import Leaf, Signature, Value, Values
from rcsc_cell.workstation.interlocks import NOTHING, CellState, Progress, after, refusal, rest, stands
from rcsc_cell.workstation.orders import (
    CLOSED_MM,
    DONE,
    FAILED,
    MACHINE_ORDER,
    MACHINE_REPORT,
    VISE_ORDER,
    VISE_REPORT,
    ajar,
)
from rcsc_cell.workstation.script import MACHINE, ROBOT, ScriptRow

ANSWER_TICKS = 75
"""Within which the vise and the machine have repeated an order's number, and the vise has ended: 3 s; it gives up after two."""
MACHINE_TICKS = 500
"""Within which the machine has ended: 20 s."""
PAUSE_TICKS = 200
"""Within which TASK has answered PAUSE: 8 s; far less is enough, whatever was under way."""
NUMBER = "inc_command"
IN_GRIPPER = "status_parameter"
"""What TASK reports beside its status: the part in the gripper."""
State = Literal["running", "done", "failed", "refused"]
Now = tuple[State, str]
"""How a row stands, and why it failed."""
RUNNING: Now = ("running", "")


@dataclass(frozen=True, slots=True)
class _State:
    """The state from which a stopped workstation continues; its orders stand in their buffers."""

    at: int
    cell: CellState
    progress: Progress
    trouble: str


@dataclass(slots=True)
class Workstation:
    """Runs a script.

    Attributes:
        words: TASK's command and report buffers, leaf by leaf, to speak in its words.
        cell: What it knows of the cell.
        at: The row under way, from 0.
        results: Rows that are over.
        trouble: Why TASK did not pause after a failure; empty when it did.
        progress: How far the row under way has come, over all its tries.
        safe: The safe location of each that has one.
        task: The order that stands in TASK's buffer.
    """

    rows: tuple[ScriptRow, ...]
    locations: Mapping[str, int]
    order: tuple[Leaf, ...]
    report: tuple[Leaf, ...]
    cell: CellState = field(default_factory=CellState)
    at: int = 0
    results: list[RowResult[ScriptRow]] = field(default_factory=list)
    trouble: str = ""
    progress: Progress = field(default_factory=Progress)
    safe: Mapping[str, str] = field(default_factory=dict)
    task: Orders = field(init=False)
    _vise: Orders = field(default_factory=lambda: Orders(VISE_ORDER, VISE_REPORT))
    _machine: Orders = field(default_factory=lambda: Orders(MACHINE_ORDER, MACHINE_REPORT))
    _since: int = -1  # the tick at which the row began
    _paused: int = -1  # the tick at which PAUSE went down that is not answered yet

    def __post_init__(self) -> None:
        """Finds the numbers in TASK's buffers."""
        self.task = Orders(
            "workstation.order",
            "task.to_workstation",
            _place(self.report, "inc_command_echo"),
            _place(self.order, NUMBER),
        )

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick: begin a row, wait for it, or rest."""
        lines = (self.task, self._vise, self._machine)
        for line in lines:
            line.catch_up(latest)
        if self._paused >= 0:
            self._await_pause(tick, latest)
        elif not self.over:
            self._work(tick, latest)
        return {line.order: line.sent for line in lines if line.sent}

    @property
    def over(self) -> bool:
        """True once every row is done, or one was not."""
        return self.at >= len(self.rows) or self.stopped is not None

    @property
    def at_rest(self) -> bool:
        """True once the PAUSE that follows a failure has been answered, or the wait for that was in vain."""
        return self._paused < 0

    @property
    def faults(self) -> frozenset[str]:
        """The cell's faults that the row under way switches on."""
        return frozenset() if self.over else frozenset(self.rows[self.at].faults)

    @property
    def stopped(self) -> RowResult[ScriptRow] | None:
        """The result that stopped the script."""
        last = self.results[-1] if self.results else None
        return last if last is not None and last.state != "done" and last.row is self.rows[self.at] else None

    def resume(self) -> None:
        """Try the rest of the row that stopped the script, once TASK has paused."""
        if self.stopped is not None:
            self.results.pop()
            self._since = -1

    def begin_at(self, row: int) -> None:
        """Continue at another row, as if those between were done.

        Args:
            row: From 0; an earlier row leaves the cell as it is.
        """
        if row > self.at:
            self.cell = self._before
        for passed in self.rows[self.at : row]:
            self.cell = after(self.cell, passed)
        if row != self.at:
            self.at, self.progress = row, Progress()

    def state(self) -> dict[str, Any]:
        """Return the state from which a stopped workstation continues, in plain values; its orders stand in their buffers."""
        trouble = self.trouble if self.at_rest else "TASK has not paused"
        return cast(dict[str, Any], plain(_State(self.at, self.cell, self.progress, trouble)))

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a workstation's state, and try its row again; numbers go on from those in the buffers.

        Raises:
            ValueError: It is no workstation's state.
        """
        held: _State = read(_State, state)
        if not 0 <= held.at <= len(self.rows):
            raise ValueError(f"the script has {len(self.rows)} rows, and was stopped in row {held.at + 1}")
        self.at, self.cell, self.trouble, self.progress = held.at, held.cell, held.trouble, held.progress
        self.results.clear()
        self._since = self._paused = -1

    # --- the row under way ---

    @property
    def _before(self) -> CellState:
        """The cell before the first try of the row under way: `after` takes whole rows only."""
        return self.progress.before if self.progress.tried else self.cell

    def _work(self, tick: int, latest: Latest) -> None:
        row = self.rows[self.at]
        if self._since < 0:
            self._begin(row, tick, latest)
            return
        state, why = self._now(row, tick - self._since, latest)
        if state != "running":
            self._end(row, tick, state, why)

    def _begin(self, row: ScriptRow, tick: int, latest: Latest) -> None:
        self._since = tick
        if self.trouble:
            self._end(row, tick, "failed", self.trouble)
            return
        left = self._left(row, latest) if row.robot else row
        why = refusal(self.cell, left)
        if why:
            self._end(row, tick, "refused", why)
        elif row.vise:
            self._vise.send(self._jaws(row))
        elif row.machine:
            self._machine.send((MACHINE.index(row.machine) + 1,))
        else:
            self.progress.begin(self.cell)
            self._tell(left.robot, left)

    def _left(self, row: ScriptRow, latest: Latest) -> ScriptRow:
        """What is to be done of a row for TASK: all of it, or the rest."""
        report = latest(self.task.report)
        held = NOTHING if report is None else self.word(report, IN_GRIPPER)
        return rest(row, self.progress, held, self.safe)

    def _end(self, row: ScriptRow, tick: int, state: State, reason: str) -> None:
        self.results.append(RowResult(row, state, reason, self._since, tick - self._since + 1))
        if state == "done":
            self.cell = after(self._before, row)
            self.at += 1
            self._since, self.progress = -1, Progress()
        elif state == "failed":
            self._tell("pause", ScriptRow(row.number, "PAUSE", "pause"))
            self._paused = tick

    def _await_pause(self, tick: int, latest: Latest) -> None:
        """Wait until TASK has paused: an order could disturb one that it still carries out."""
        report = self.task.answer(latest)
        status = "" if report is None else self.word(report, "status_report")
        if report is not None and status == "failed":
            self._paused, self.trouble = -1, f"TASK does not pause: {self.word(report, 'failure')}"
        elif status == "done":
            self._paused, self.trouble = -1, ""
        elif tick - self._paused >= PAUSE_TICKS:
            self._paused, self.trouble = -1, "TASK does not answer PAUSE"

    # --- how it stands ---

    def _now(self, row: ScriptRow, ticks: int, latest: Latest) -> Now:
        if row.vise:
            return self._vise_now(row, ticks, latest)
        if row.machine:
            return self._machine_now(ticks, latest)
        return self._task_now(row, latest)

    def _task_now(self, row: ScriptRow, latest: Latest) -> Now:
        report = self.task.answer(latest)
        if report is None:
            return RUNNING
        self.progress.seen(self.word(report, IN_GRIPPER))
        match self.word(report, "status_report"):
            case "done":
                return "done", ""
            case "failed":
                failure = self.word(report, "failure")
                held = self.word(report, IN_GRIPPER)
                self.progress.failed(row, held, failure)
                self.cell = stands(row, self.progress, held, self.cell)
                return "failed", _reason(failure, self.word(report, "cause"))
            case _:
                return RUNNING

    def _vise_now(self, row: ScriptRow, ticks: int, latest: Latest) -> Now:
        right_open, left_open = self._jaws(row)
        report = self._vise.answer(latest)
        if report is not None and report[1] == FAILED:
            wrong = ajar(report, right_open=right_open, left_open=left_open)
            return "failed", wrong or "the vise does not come to rest"
        return _answered("vise", report, ticks, ANSWER_TICKS)

    def _machine_now(self, ticks: int, latest: Latest) -> Now:
        report, vise = self._machine.answer(latest), latest(VISE_REPORT)
        if report is not None and report[1] == FAILED:
            loose = vise is not None and max(vise[2], vise[3]) >= CLOSED_MM
            return "failed", f"the machine stopped{': the vise is not closed' if loose else ''}"
        return _answered("machine", report, ticks, MACHINE_TICKS)

    # --- what is sent ---

    def _jaws(self, row: ScriptRow) -> tuple[bool, bool]:
        """Return how the right and the left jaw are to stand; one that the row does not name stays as it is."""
        return row.vise.get("right", self.cell.right_open), row.vise.get("left", self.cell.left_open)

    def _tell(self, command: str, row: ScriptRow) -> None:
        self.task.send(self.order_of(command, row))

    def order_of(self, command: str, row: ScriptRow) -> tuple[Value, ...]:
        """A command of TASK's with what a row says of it, as an order without its number."""
        values: dict[str, Value | str] = {
            "input_command": command,
            "obj": row.part or "null_obj",
            "grasp": row.grasp,
            "source_locpt": self.locations.get(row.source, 0),
            "dest_locpt": self.locations.get(row.dest, 0),
            "end_at_locpt": self.locations.get(row.end_at, 0),
            "sector": row.sector,
        }
        return tuple(_value(leaf, values[_last(leaf)]) for leaf in self.order if _last(leaf) != NUMBER)

    def word(self, report: Values, name: str) -> str:
        """A field of TASK's report in the words of the tables."""
        at = _place(self.report, name)
        return self.report[at].shown(report[at])


def workstation(
    rows: Sequence[ScriptRow],
    locations: Mapping[str, int],
    task: Signature,
    safe: Mapping[str, str] | None = None,
) -> Workstation:
    """Make a workstation that runs the rows from the first.

    Args:
        rows: The script.
        locations: Numbers of locations by name.
        task: TASK's program.
        safe: The safe location of each that has one.

    Raises:
        BadScript: A row names an unknown place or part.
    """
    order, report = task.leaves_of("workstation"), task.leaves_of("to_workstation")
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
    return Workstation(tuple(rows), locations, order, report, safe=safe or {})


def _answered(who: str, report: Values | None, ticks: int, most: int) -> Now:
    """Return the state of an order that has not failed: status is the report's second value."""
    if report is not None and report[1] == DONE:
        return "done", ""
    if report is None:
        return RUNNING if ticks < ANSWER_TICKS else ("failed", f"the {who} does not answer")
    return RUNNING if ticks < most else ("failed", f"the {who} did not end in {most} cycles")


def _reason(failure: str, cause: str) -> str:
    """Return TASK's word for the failure, and after a colon E-MOVE's word, where that is another."""
    return failure if cause in ("none", failure) else f"{failure}: {cause}"


def _place(leaves: Sequence[Leaf], name: str) -> int:
    return next(at for at, leaf in enumerate(leaves) if _last(leaf) == name)


def _last(leaf: Leaf) -> str:
    return leaf.name.rpartition(".")[2]


def _value(leaf: Leaf, value: Value | str) -> Value:
    return leaf.members.index(value) if isinstance(value, str) else value
