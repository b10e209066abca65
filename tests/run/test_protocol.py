"""The protocol under Hypothesis: buffers late, repeated and skipped, levels restarted, commands changed, numbers wrapping.

Properties, with their place in the paper: no STATE-TABLE error (8.1); the assumptions that the proofs rest on hold; every command ends
in DONE or FAIL within a bound; the answer is the one to the last number (9); a part is taken from the buffer's count once (8.1, 5).
"""

from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.run.buffers import CommonMemory
from rcsc.run.signature import Values
from tests.support.cells import SCRIPT, Cell

LATE_ENDS = 3000
"""Cycles within which a command ends though every buffer is late."""


class Late(CommonMemory):
    """Common memory whose readers see a value up to `most` ticks late: some twice, some never, none out of order."""

    def __init__(self, random: Random, most: int, share: float) -> None:
        super().__init__()
        self._random, self._most, self._share = random, most, share
        self._waiting: dict[str, list[Values]] = {}
        self._seen: dict[str, Values] = {}

    def publish(self, name: str, values: Values) -> None:
        """Puts it at the end of what waits; a reader may then find something newer."""
        waiting = self._waiting.setdefault(name, [])
        waiting.append(values)
        while len(waiting) > self._most or (waiting and self._random.random() > self._share):
            skipped = self._random.randrange(len(waiting))
            self._seen[name] = waiting[skipped]
            del waiting[: skipped + 1]

    def latest(self, name: str) -> Values | None:
        """What has arrived."""
        return self._seen.get(name)


def late_cell(seed: int, most: int, share: float) -> Cell:
    """A cell whose buffers are late."""
    cell = Cell()
    cell.system.buffers = Late(Random(seed), most, share)  # noqa: S311  # repeatable on purpose
    return cell


@settings(max_examples=6)
@given(st.integers(0, 10**6), st.integers(1, 2), st.floats(0.2, 0.9))
def test_everything_ends_though_every_buffer_is_late(seed: int, most: int, share: float) -> None:
    """Up to two cycles: a robot that is shown but one pose in four would have to jump, and refuses (the test below)."""
    cell = late_cell(seed, most, share)
    for command, said in SCRIPT:
        cell.tell(command, **said)
        assert cell.until_over(LATE_ENDS) == "done", (command, cell.reason())
    assert cell.failed == []
    assert cell.system.level("task").value("tbuffer_boxt") == 9


@settings(max_examples=10)
@given(
    st.integers(0, 10**6),
    st.integers(0, 3),
    st.lists(st.tuples(st.integers(0, len(SCRIPT) - 1), st.integers(1, 120)), min_size=2, max_size=6),
)
def test_commands_that_change_in_mid_motion_are_each_answered_or_replaced(
    seed: int, most: int, orders: list[tuple[int, int]]
) -> None:
    cell = late_cell(seed, most, 0.6)
    for which, cycles in orders:
        command, said = SCRIPT[which]
        cell.tell(command, **said)
        for _ in range(cycles):
            cell.system.step()
            report = cell.system.buffers.latest("task.to_workstation")
            assert report is None or int(report[0]) <= cell.number
    assert cell.until_over(LATE_ENDS) in ("done", "failed")
    cell.tell("pause")
    assert cell.until_over(LATE_ENDS) == "done"
    cell.tell("move", dest="WS-SAFE")
    assert cell.until_over(LATE_ENDS) == "done"
    assert cell.failed == []
    assert int(cell.system.level("task").value("tbuffer_boxt")) <= 10


@settings(max_examples=10)
@given(
    st.integers(0, 10**6), st.integers(65_500, 65_535), st.lists(st.integers(0, 4), min_size=5, max_size=5)
)
def test_numbers_wrap_at_every_level(seed: int, number: int, ahead: list[int]) -> None:
    """All numbers of a system that has run for long, echoes included, near their end."""
    cell = late_cell(seed, 2, 0.5)
    cell.number = number
    task = cell.system.level("task")
    task.executor.put(task.sign.index["inc_command_seen"], (number,))
    for level, more in zip(cell.system.levels, ahead, strict=True):
        near = (65_531 + more) % 65_536
        level.take(cell.system.buffers)
        for at, leaf in enumerate(level.sign.leaves):
            if leaf.name.startswith("to_") and leaf.name.endswith(".inc_command"):
                level.executor.put(at, (near,))
        level.values = level.executor.values()
    for command, said in SCRIPT[:3]:
        cell.tell(command, **said)
        assert cell.until_over(LATE_ENDS) == "done", (command, cell.reason())
    assert cell.failed == []


@settings(max_examples=8)
@given(
    st.integers(0, 10**6), st.lists(st.tuples(st.integers(1, 60), st.integers(0, 4)), min_size=1, max_size=12)
)
def test_a_level_that_stops_for_a_while_loses_nothing(seed: int, stops: list[tuple[int, int]]) -> None:
    """A level that does not run for some cycles and then goes on from its last state."""
    cell = late_cell(seed, 1, 0.5)
    everyone = cell.system.levels
    for command, said in SCRIPT[:2]:
        cell.tell(command, **said)
        for cycles, which in stops:
            stopped = everyone[which]
            cell.system.levels = tuple(level for level in everyone if level is not stopped)
            for _ in range(cycles):
                cell.system.step()
            values = stopped.values
            stopped.restore(values)
            cell.system.levels = everyone
            for _ in range(5):
                cell.system.step()
        assert cell.answer or cell.until_over(LATE_ENDS)
        assert cell.answer in ("done", "failed") or cell.until_over(LATE_ENDS) in ("done", "failed")
        assert cell.answer == "done", cell.reason()
    assert cell.failed == []
    assert cell.system.level("task").value("tbuffer_boxt") == 9
