"""Properties of levels and buffers: no STATE-TABLE error, every command ends once and in time, the log replays exactly."""

from typing import ClassVar

from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Signature, Values
from rcsc_cell.cell.robot import REST_RAD
from rcsc_cell.properties.cycle import Command, CycleState

BOUND_TICKS = {"pause": 60, "acquire": 900, "move": 1100, "release": 500, "clear": 700, "transfer": 1500}
"""Within which each command ends, in cycles of 40 ms, whatever goes wrong with robot, hand and camera. The longest seen in campaigns are
little more than half of these; what a table waits for has a limit there: ten seconds for the robot, six for the fingers, four for a
picture."""
HARM_COSTS = 12
"""A cycle in which something happens to a buffer counts for so many times less: most of what levels say to each other waits for it."""

STIRRED_TICKS = 10
"""PAUSE says in every cycle whether everything below rests: for so long after a joint moved, though it is held, or after a fault, it
may cease to be done, and be done again. A vise that closes on a part under the fingers moves the arm."""


class NoStateTableError:
    """Exactly one line of each table matches, and every input lies in its range."""

    name: ClassVar[str] = "no state-table error"
    place: ClassVar[str] = "section 8.1, line 16 of Fig. 8"

    def __init__(self, _: CycleState) -> None:
        pass

    def watch(self, cycle: CycleState) -> str | None:
        """Which level met which fault."""
        for level in cycle.ran:
            if level.fault:
                return f"level `{level.name}`, table `{level.table}`: {level.sign.fault_text(level.values)}"
        return None


class AssumptionsHold:
    """What the proofs take for granted and the executors check is so: a state and the command that it waits for are echoed together."""

    name: ClassVar[str] = "assumptions hold"
    place: ClassVar[str] = "section 9"

    def __init__(self, _: CycleState) -> None:
        pass

    def watch(self, cycle: CycleState) -> str | None:
        """Which assumptions failed, and where."""
        for level in cycle.ran:
            bits = int(level.values[-1])
            if bits:
                names = [name for at, name in enumerate(level.sign.monitored) if bits >> at & 1]
                return f"level `{level.name}`, table `{level.table}`, line `{level.line}`: {', '.join(names)}"
        return None


class EndsInBound:
    """A command that no other replaces ends in DONE or FAIL, in time. Cycles in which something happens to a buffer count for little."""

    name: ClassVar[str] = "ends in DONE or FAIL"
    place: ClassVar[str] = "section 3, Fig. 5: feedback status from the level below"

    def __init__(self, _: CycleState) -> None:
        self._left = 0
        self._command: Command | None = None

    def watch(self, cycle: CycleState) -> str | None:
        """That it did not."""
        if cycle.command is not self._command:
            self._command = cycle.command
            self._left = BOUND_TICKS[cycle.command.name] if cycle.command else 0
        if cycle.command is None or cycle.ended or self._left < 0:
            self._left = -1 if cycle.ended else self._left
            return None
        if cycle.harmed and cycle.tick % HARM_COSTS:
            return None
        self._left -= 1
        late = self._left == 0
        return f"`{cycle.command.name}` has not ended" if late else None


class AnsweredOnce:
    """A command that is answered stays answered as it was, until the next comes: DONE does not become FAIL, nor FAIL anything."""

    name: ClassVar[str] = "answered once"
    place: ClassVar[str] = "sections 8.1 (lines 9 and 14 of Fig. 8) and 9"

    def __init__(self, cycle: CycleState) -> None:
        self._ended: tuple[int, str] | None = None
        self._joints, self._stirred = cycle.joints, -STIRRED_TICKS

    def watch(self, cycle: CycleState) -> str | None:
        """What it was, and what it became."""
        if (
            cycle.active
            or max(abs(a - b) for a, b in zip(self._joints, cycle.joints, strict=True)) > REST_RAD
        ):
            self._stirred = cycle.tick
        self._joints = cycle.joints
        if cycle.command is None:
            return None
        number = cycle.command.number
        if cycle.ended:
            self._ended = number, cycle.ended
            return None
        if self._ended is None or self._ended[0] != number or not cycle.number_answered:
            return None
        if "task" in cycle.restarted:  # it has forgotten, and says `restart`: the workstation must be told
            self._ended = None
            return None
        if cycle.command.name == "pause" and self._stirred >= cycle.tick - STIRRED_TICKS:
            return None
        now = cycle.shown("task", "to_workstation.status_report")
        if now != self._ended[1]:
            return f"`{cycle.command.name}` was {self._ended[1]}, and is {now}"
        return None


class ReplaysExactly:
    """A second executor of each level that is given a cycle's inputs and the state before it leaves the same values, bit for bit."""

    name: ClassVar[str] = "replays exactly"
    place: ClassVar[str] = "section 10: a log of the machine state, to be stepped"

    def __init__(self, cycle: CycleState) -> None:
        self._inputs = {level.name: _input_runs(level.sign) for level in cycle.levels.values()}

    def watch(self, cycle: CycleState) -> str | None:
        """The first leaf that differs."""
        for level in cycle.ran:
            twin, count = cycle.twins[level.name], len(level.sign.leaves)
            start = list(cycle.before[level.name][:count])
            for run in self._inputs[level.name]:
                start[run] = level.values[run]
            twin.put(0, start)
            twin.cycle()
            now = twin.values()
            if now != level.values:
                return _difference(level, now)
        return None


def _input_runs(sign: Signature) -> tuple[slice, ...]:
    """Return the positions of inputs, a slice for each run of them."""
    runs: list[slice] = []
    for at, leaf in enumerate(sign.leaves):
        if leaf.kind == "input":
            if runs and runs[-1].stop == at:
                runs[-1] = slice(runs[-1].start, at + 1)
            else:
                runs.append(slice(at, at + 1))
    return tuple(runs)


def _difference(level: RunningLevel, now: Values) -> str:
    leaves = [
        *(leaf.name for leaf in level.sign.leaves),
        "line",
        "fault",
        "fault_at",
        "assumptions",
    ]
    at = next(at for at, (a, b) in enumerate(zip(level.values, now, strict=True)) if a != b)
    return f"level `{level.name}`: {leaves[at]} was {level.values[at]}, and is {now[at]} the second time"
