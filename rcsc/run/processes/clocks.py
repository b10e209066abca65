"""Keep the processes of a system together: none runs far ahead of another, nor of who records them.

In: a block, and the period of each process. Out: `Clocks`, some words of the block for each process, and `Turn`, with which a
process waits for the others.

In one process each level sees what the others gave in the cycle before, and tables count cycles: of how long an answer may take,
or how old a picture is. Processes that ran by the clock alone would count differently where one of them gets no processor.
Therefore each says from when on, in the system's own time, its next cycle is; it begins that cycle only when no other's next cycle
lies more than that other's period before it. The one that is furthest behind never waits, and so somebody always goes on. With two
levels of 40 ms, of which `a` gets no processor:

    a: at 40                at 40               at 80
    b: at 80, runs it       at 120, waits       runs it

This bounds how far they drift apart, by one period, whatever the machine does; it costs time only. *In step* it is none: all run a
cycle before one begins the next. A process that is replaced goes on where its clock stood, and is waited for meanwhile. One that does
not move for `MOST_WAIT_S` is not waited for until it moves, unless all are in step; then it skips the cycles that the others had meanwhile.

A diagnostic process says of each process up to which time it has read what that committed. A process begins a cycle only when all but
its last have been read. It writes over the last but one, so that whatever the machine does no cycle is lost to the record. A
diagnostic process that ends is waited for no more: the supervisor says so.

Who is attached takes part as well: all stand before the time up to which it lets them go. A level that it *holds* skips its cycles, but
for those that it allows, while its clock and the others go on. When it goes, or dies, everything is let go (`attach`, `supervisor`).
"""

import time
from collections.abc import Mapping, Sized
from dataclasses import dataclass, field

from rcsc.run.processes.block import Block

WORD = 8
HEAD, WORDS = 4, 6
"""Words of all: whether they are recorded, the end, up to when who is attached lets them go, and who that is. Of each process: the
time of its next cycle, its beats, up to when it was read, whether it is held, how many cycles it was allowed meanwhile and has had."""
ABSENT = 0
"""Instead of a time, which is kept one higher: the process has never been started, or there is no such limit."""
MOST_WAIT_S = 60.0
SHORTEST_NAP_S, LONGEST_NAP_S = 20e-6, 5e-3


@dataclass(frozen=True, slots=True)
class Clocks:
    """The clocks of all processes of a system.

    Attributes:
        block: Where they are.
        first: Their first byte, a multiple of eight; they take `size` bytes.
        periods_ms: Of each process, by its name; the same mapping in every process.
        in_step: Whether none begins a cycle before all have run the one before.
    """

    block: Block
    first: int
    periods_ms: Mapping[str, int]
    in_step: bool = False
    _places: dict[str, int] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Give each process its place."""
        places = {name: self.first + (HEAD + WORDS * at) * WORD for at, name in enumerate(self.periods_ms)}
        self._places.update(places)

    @staticmethod
    def size(processes: int) -> int:
        """Return the number of bytes that the clocks of so many processes take."""
        return (HEAD + WORDS * processes) * WORD

    def start(self, name: str) -> None:
        """Make the others wait for a process from now on; one that ran before goes on where it stood."""
        if self.block.word(self._places[name]) == ABSENT:
            self.set(name, 0)

    def leave(self, name: str) -> None:
        """Have nobody wait for a process any more: it has ended for good."""
        self.block.set_word(self._places[name], ABSENT)

    def now_ms(self, name: str) -> int | None:
        """Return the time of a process's next cycle, by the system's own time; None where it was never started."""
        return self._time(self._places[name])

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

    # --- who records them ---

    def record(self, *, on: bool) -> None:
        """Have all wait for a diagnostic process, or no more."""
        self.block.set_word(self.first, int(on))

    def was_read(self, name: str, now_ms: int) -> None:
        """Say that all was read that a process committed in cycles before a time."""
        self.block.set_word(self._places[name] + 2 * WORD, now_ms)

    def read_ms(self, name: str) -> int:
        """Return the time before which all was read that a process committed."""
        return self.block.word(self._places[name] + 2 * WORD)

    def unread(self, name: str, now_ms: int) -> bool:
        """Tell whether a cycle of then would overwrite what the diagnostic process has not read."""
        return bool(self.block.word(self.first)) and self.read_ms(name) < now_ms - self.periods_ms[name]

    # --- who is attached ---

    @property
    def attached(self) -> int:
        """The number of the process that is attached; 0 for none."""
        return self.block.word(self.first + 3 * WORD)

    def attach(self, process: int) -> None:
        """Say who is attached."""
        self.block.set_word(self.first + 3 * WORD, process)

    def let_until(self, now_ms: int) -> None:
        """Let all run their cycles before a time, and none of then or later."""
        self.block.set_word(self.first + 2 * WORD, now_ms + 1)

    def hold(self, name: str, *, on: bool) -> None:
        """Have a process skip its cycles, or no more."""
        self.block.set_word(self._places[name] + 3 * WORD, int(on))

    def held(self, name: str) -> bool:
        """Tell whether a process skips its cycles."""
        return bool(self.block.word(self._places[name] + 3 * WORD))

    def allow(self, name: str, cycles: int) -> None:
        """Allow a process that is held some cycles more."""
        at = self._places[name] + 4 * WORD
        self.block.set_word(at, self.block.word(at) + cycles)

    def skips(self, name: str) -> bool:
        """Tell whether a process skips the cycle whose turn it is; one that it is allowed it has had by that."""
        allowed, had = (self.block.word(self._places[name] + word * WORD) for word in (4, 5))
        if not self.held(name):
            self.block.set_word(self._places[name] + 5 * WORD, allowed)
            return False
        self.block.set_word(self._places[name] + 5 * WORD, min(had + 1, allowed))
        return had >= allowed

    def let_go(self) -> None:
        """Let all go on: nobody is attached any more."""
        for name in self.periods_ms:
            self.hold(name, on=False)
        self.block.set_word(self.first + 2 * WORD, ABSENT)
        self.attach(0)

    # --- the end ---

    @property
    def limit_ms(self) -> int | None:
        """The time before which the last cycles begin; None for none."""
        return self._time(self.first + WORD)

    @property
    def limits_ms(self) -> tuple[int | None, ...]:
        """The times before which cycles may begin: of all, and while somebody is attached."""
        return self.limit_ms, self._time(self.first + 2 * WORD) if self.attached else None

    def stop_at(self, limit_ms: int) -> None:
        """Have all run their cycles before a time, and none of then or later."""
        self.block.set_word(self.first + WORD, limit_ms + 1)

    def all_at(self, limit_ms: int) -> bool:
        """Tell whether no process has a cycle left before a time."""
        clocks = (self.now_ms(name) for name in self.periods_ms)
        return all(now_ms is None or now_ms >= limit_ms for now_ms in clocks)

    def common_end_ms(self) -> int:
        """Return the earliest time before which all cycles lie that may have begun."""
        clocks = {name: now_ms for name in self.periods_ms if (now_ms := self.now_ms(name)) is not None}
        left = {name for name in clocks if self.left(name)}
        begun = [now_ms for name, now_ms in clocks.items() if not self.behind(name, now_ms).keys() - left]
        return max(begun, default=-1) + 1

    def left(self, name: str) -> bool:
        """Tell whether the others have gone on without a process."""
        now_ms = self.now_ms(name)
        return now_ms is None or self.latest_ms(name) > now_ms + self.periods_ms[name]

    def behind(self, name: str, now_ms: int) -> dict[str, int]:
        """Return the clocks of the processes that one has to wait for before its cycle of then."""
        behind = {}
        for other, period_ms in self.periods_ms.items():
            other_ms = self.now_ms(other)
            apart_ms = 0 if self.in_step else period_ms
            if other != name and other_ms is not None and other_ms + apart_ms < now_ms:
                behind[other] = other_ms
        return behind

    def latest_ms(self, name: str) -> int:
        """Return the time of the latest cycle that a process but this one has run."""
        clocks = ((other, self.now_ms(other)) for other in self.periods_ms if other != name)
        return max(
            (now_ms - self.periods_ms[other] for other, now_ms in clocks if now_ms is not None), default=0
        )

    def _time(self, at: int) -> int | None:
        word = self.block.word(at)
        return None if word == ABSENT else word - 1


@dataclass(slots=True)
class Turn:
    """A process's place among the others."""

    clocks: Clocks
    name: str
    _left: dict[str, int] = field(default_factory=dict)
    """Who is not waited for, and where their clocks stood."""

    @property
    def now_ms(self) -> int:
        """The time of its next cycle."""
        return self.clocks.now_ms(self.name) or 0

    def done(self) -> None:
        """End a cycle; the next is a period later, or where the others are if they went on without it."""
        period_ms = self.clocks.periods_ms[self.name]
        late_ms = self.clocks.latest_ms(self.name) - self.now_ms
        self.clocks.set(self.name, self.now_ms + max(1, -(-late_ms // period_ms)) * period_ms)

    def wait(self, told: Sized = ()) -> None:
        """Wait until no other is more than its period behind and what was committed is read, or until something is `told`."""
        nap_s, since_s, before = SHORTEST_NAP_S, time.monotonic(), self._behind()
        self.clocks.beat(self.name)
        while (before or self._halted()) and not told:
            if before and not self.clocks.in_step and time.monotonic() - since_s > MOST_WAIT_S:
                self._left.update(before)
            time.sleep(nap_s)
            nap_s = min(2 * nap_s, LONGEST_NAP_S)
            self.clocks.beat(self.name)
            behind = self._behind()
            if behind != before:
                nap_s, since_s, before = SHORTEST_NAP_S, time.monotonic(), behind

    def _halted(self) -> bool:
        """Whether a cycle now would be one too many, or overwrite what is still to be recorded."""
        now_ms = self.now_ms
        return any(
            limit_ms is not None and now_ms >= limit_ms for limit_ms in self.clocks.limits_ms
        ) or self.clocks.unread(self.name, self.now_ms)

    def _behind(self) -> dict[str, int]:
        """Return the clocks of the processes that this one has to wait for."""
        behind = self.clocks.behind(self.name, self.now_ms)
        return {name: other_ms for name, other_ms in behind.items() if self._left.get(name) != other_ms}
