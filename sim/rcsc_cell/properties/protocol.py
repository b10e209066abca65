"""Properties of levels that any system could have: every command ends in its time, and every cycle replays exactly."""

from typing import ClassVar

from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Values
from rcsc_cell.properties.cycle import Command, CycleState

BOUND_TICKS = {"pause": 60, "acquire": 900, "move": 1100, "release": 500, "clear": 700, "transfer": 1500}
"""Within which each command ends, in cycles of 40 ms, whatever goes wrong with robot, hand and camera. The longest seen in campaigns are
little more than half of these; what a table waits for has a limit there: ten seconds for the robot, six for the fingers, four for a
picture."""
HARM_COSTS = 12
"""A cycle in which something happens to a buffer counts for so many times less: most of what levels say to each other waits for it."""


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


class ReplaysExactly:
    """A second executor of each level that is given a cycle's inputs and the state before it leaves the same values, bit for bit."""

    name: ClassVar[str] = "replays exactly"
    place: ClassVar[str] = "section 10: a log of the machine state, to be stepped"

    def __init__(self, cycle: CycleState) -> None:
        self._inputs = {
            level.name: [at for at, leaf in enumerate(level.sign.leaves) if leaf.kind == "input"]
            for level in cycle.levels.values()
        }

    def watch(self, cycle: CycleState) -> str | None:
        """The first leaf that differs."""
        for level in cycle.ran:
            twin, count = cycle.twins[level.name], len(level.sign.leaves)
            start = list(cycle.left[level.name][:count])
            values = level.values
            for at in self._inputs[level.name]:
                start[at] = values[at]
            twin.put(0, start)
            twin.cycle()
            now = twin.values()
            if now != values:
                return _difference(level, now)
        return None


def _difference(level: RunningLevel, now: Values) -> str:
    leaves = [*(leaf.name for leaf in level.sign.leaves), *level.sign.trace]
    at = next(at for at, (a, b) in enumerate(zip(level.values, now, strict=True)) if a != b)
    return f"level `{level.name}`: {leaves[at]} was {level.values[at]}, and is {now[at]} the second time"
