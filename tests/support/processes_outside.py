"""What stands outside the levels in `test_processes`: it is imported in processes of its own, and so imports little."""

from collections.abc import Callable, Mapping
from pathlib import Path

from rcsc.run.description import Description, LevelSpec, Wire, description
from rcsc.run.processes.memory import Layout, SharedMemoryBuffers, layout
from rcsc.run.processes.serve import Factory
from rcsc.run.signature import Leaf, LevelSign, Signature, Values
from rcsc_cell.workstation.orders import DONE, EXECUTING

PAUSE, ACQUIRE, MOVE, RELEASE = 0, 1, 2, 3
TBOX = 1
STORE, BENCH = 1, 2
NUMBERS = 65536
# A round: a part from the store to the bench. number, command, object, grasp, source, dest, end, sector
ROUND: tuple[Values, ...] = (
    (ACQUIRE, TBOX, 0, STORE, 0, 0, 0),
    (MOVE, TBOX, 0, 0, BENCH, 0, 0),
    (RELEASE, 0, 0, 0, 0, 0, 0),
)
WIDE = 64
HERE = "tests.support.processes_outside"
QUERIES = Factory(f"{HERE}:queries")


def queries() -> dict[str, Callable[..., Values]]:
    """The store is a buffer table, so that what is taken from it is counted; the bench is not."""
    return {"place": lambda place: (place in {STORE, BENCH}, False, place == STORE, 0, 0)}


class Log:
    """Appends a line where the last one said something else."""

    def __init__(self, path: str) -> None:
        self._path, self._last = Path(path), ""

    def say(self, *words: object) -> None:
        text = " ".join(map(str, words))
        if text != self._last:
            self._last = text
            with self._path.open("a", encoding="ascii") as file:
                file.write(f"{text}\n")


class Sender:
    """Sends TASK numbered commands; the next when the last is done or has failed."""

    def __init__(self, path: str, rounds: int, first: int) -> None:
        self._log, self._script = Log(path), ROUND * rounds
        self._first, self._at, self.over = first, 0, False

    def step(self, _tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        number = (self._first + self._at) % NUMBERS
        report = latest("task.to_workstation")
        if report is not None:
            self._log.say(report[0], report[2], report[4])
            if report[0] == number and report[2] != EXECUTING:
                self._at += 1
                self.over = self._at == len(self._script)
        if self.over:
            return {}
        return {"workstation.order": ((self._first + self._at) % NUMBERS, *self._script[self._at])}


class Below:
    """E-MOVE as TASK sees it: it says `executing` for some ticks, then `done`."""

    def __init__(self, path: str, busy: int, first: int) -> None:
        self._log, self._busy, self._left = Log(path), busy, 0
        self._number, self._command = first, PAUSE

    def step(self, _tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        order = latest("task.to_emove")
        self._left = max(0, self._left - 1)
        if order is not None and int(order[0]) != self._number:
            self._number, self._command, self._left = int(order[0]), int(order[1]), self._busy
            self._log.say(self._number, self._command)
        return {"emove.to_task": (self._number, self._command, EXECUTING if self._left else DONE, 0)}


def sender(*arguments: object) -> tuple[Sender, ...]:
    return (Sender(*arguments),)  # type: ignore[arg-type]  # as the factory was given them


def below(*arguments: object) -> tuple[Below, ...]:
    return (Below(*arguments),)  # type: ignore[arg-type]  # likewise


class Wrong:
    """Publishes what the buffer cannot hold."""

    def step(self, _tick: int, _latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        return {"emove.to_task": (-1, 0.5, 300, 0)}


def wrong() -> tuple[Wrong, ...]:
    return (Wrong(),)


def alone(repo: Path) -> Description:
    """TASK between a sender and a stand-in of E-MOVE."""
    whole = description(repo / "tables/system.toml")
    task = next(level for level in whole.levels if level.name == "task")
    wires = tuple(wire for wire in whole.wires if "task." in wire.source + wire.target)
    return Description("task", whole.generated, whole.database, 40, (task,), wires)


def outside(folder: Path, rounds: int, first: int = 1, below: int = 0) -> dict[str, Factory]:
    return {
        "sender": Factory(f"{HERE}:sender", (str(folder / "sent"), rounds, first)),
        "below": Factory(f"{HERE}:below", (str(folder / "below"), 2, below)),
    }


def wide() -> Layout:
    """One level with one wide output, and its echo from outside."""
    leaves = tuple(
        Leaf(f"{record}.n{at}", "output", "", "", "uint32_t", (), 0, 2**32 - 1, "", 0, "")
        for record in ("out", "back")
        for at in range(WIDE)
    )
    sign = Signature("wide", "", "", leaves, {}, (LevelSign("wide", "", 1, "", "", {}),), ())
    system = Description(
        "wide",
        Path(),
        Path(),
        1,
        (LevelSpec("wide", "wide", ()),),
        (Wire("wide.out", "far.in"), Wire("far.out", "wide.back")),
    )
    return layout(system, {"wide": sign})


def pattern(number: int) -> Values:
    """Values of which each says what the others are."""
    return tuple(number * (at + 1) % 2**32 for at in range(WIDE))


def hammer(block: str, ready: str) -> None:
    """Commits and publishes as fast as it can, on from what is there."""
    buffers = SharedMemoryBuffers.attach(block, wide())
    held = buffers.latest("wide.out")
    number = int(held[0]) if held else 0
    Path(ready).touch()
    trace = (0, 0, 0, 0)
    while True:
        number += 1
        buffers.publish("far.out", pattern(number))
        buffers.commit("wide", (*pattern(number), *pattern(number + 1), *trace))
