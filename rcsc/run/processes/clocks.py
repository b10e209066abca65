"""Keep the processes of a system together: none runs far ahead of another.

In: a block, and the period of each process. Out: `Clocks`, two words of the block for each process, and `Turn`, with which a
process waits for the others.

In one process each level sees what the others gave in the cycle before, and tables count cycles: of how long an answer may take,
or how old a picture is. Processes that ran by the clock alone would count differently where one of them gets no processor.
Therefore each says from when on, in the system's own time, its next cycle is; it begins that cycle only when no other's next cycle
lies more than that other's period before it. The one that is furthest behind never waits, and so somebody always goes on. With two
levels of 40 ms, of which `a` gets no processor:

    a: at 40                at 40               at 80
    b: at 80, runs it       at 120, waits       runs it

This bounds how far they drift apart, by one period, whatever the machine does; it costs time only. A process that is replaced goes
on where its clock stood, and is waited for meanwhile. One that does not move for `MOST_WAIT_S` is not waited for until it moves.
"""

import time
from collections.abc import Mapping, Sized
from dataclasses import dataclass, field

from rcsc.run.processes.block import Block

WORD = 8
ABSENT = 0
"""Instead of a time, which is kept one higher: the process has never been started."""
MOST_WAIT_S = 60.0
SHORTEST_NAP_S, LONGEST_NAP_S = 20e-6, 5e-3


@dataclass(frozen=True, slots=True)
class Clocks:
    """The clocks of all processes of a system.

    Attributes:
        block: Where they are.
        first: Their first byte, a multiple of eight; they take `size` bytes.
        periods_ms: Of each process, by its name; the same mapping in every process.
    """

    block: Block
    first: int
    periods_ms: Mapping[str, int]
    _places: dict[str, int] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Give each process its place."""
        places = {name: self.first + 2 * WORD * at for at, name in enumerate(self.periods_ms)}
        self._places.update(places)

    @staticmethod
    def size(processes: int) -> int:
        """Return the number of bytes that the clocks of so many processes take."""
        return 2 * WORD * processes

    def start(self, name: str) -> None:
        """Make the others wait for a process from now on; one that ran before goes on where it stood."""
        if self.block.word(self._places[name]) == ABSENT:
            self.set(name, 0)

    def now_ms(self, name: str) -> int | None:
        """Return the time of a process's next cycle, by the system's own time; None where it was never started."""
        word = self.block.word(self._places[name])
        return None if word == ABSENT else word - 1

    def set(self, name: str, now_ms: int) -> None:
        """Set the time of a process's next cycle."""
        self.block.set_word(self._places[name], now_ms + 1)

    def beat(self, name: str) -> None:
        """Show that a process is alive, though it may commit nothing."""
        at = self._places[name] + WORD
        self.block.set_word(at, (self.block.word(at) + 1) % (1 << 64))

    def beats(self, name: str) -> int:
        """Return a number that changes for as long as a process is alive and in no cycle."""
        return self.block.word(self._places[name] + WORD)


@dataclass(slots=True)
class Turn:
    """A process's place among the others."""

    clocks: Clocks
    name: str
    _left: dict[str, int] = field(default_factory=dict)
    """Who is not waited for, and where their clocks stood."""

    def done(self) -> None:
        """End a cycle; the next is a period later."""
        self.clocks.set(self.name, self._now_ms + self.clocks.periods_ms[self.name])

    def wait(self, told: Sized = ()) -> None:
        """Wait until no other is more than its period behind, or until something is `told`."""
        nap_s, since_s, before = SHORTEST_NAP_S, time.monotonic(), self._behind()
        self.clocks.beat(self.name)
        while before and not told:
            if time.monotonic() - since_s > MOST_WAIT_S:
                self._go_on_without(before)
                return
            time.sleep(nap_s)
            nap_s = min(2 * nap_s, LONGEST_NAP_S)
            self.clocks.beat(self.name)
            behind = self._behind()
            if behind != before:
                nap_s, since_s, before = SHORTEST_NAP_S, time.monotonic(), behind

    @property
    def _now_ms(self) -> int:
        return self.clocks.now_ms(self.name) or 0

    def _behind(self) -> dict[str, int]:
        """Return the clocks of the processes that this one has to wait for."""
        now_ms, behind = self._now_ms, {}
        for name, period_ms in self.clocks.periods_ms.items():
            other_ms = self.clocks.now_ms(name)
            if other_ms is not None and other_ms + period_ms < now_ms and self._left.get(name) != other_ms:
                behind[name] = other_ms
        return behind

    def _go_on_without(self, behind: Mapping[str, int]) -> None:
        """Stop waiting for those that do not move; the time that they have lost is not made up for when they do."""
        self._left.update(behind)
        earliest_ms = min(other_ms + self.clocks.periods_ms[name] for name, other_ms in behind.items())
        self.clocks.set(self.name, earliest_ms)
