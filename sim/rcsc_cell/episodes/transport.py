"""Common memory that fails: buffers that lose, double, delay or hold values, by a schedule.

In: a schedule by ticks. Out: `Buffers`. Whatever happens, a reader sees whole values and none older than one that it has seen: a
buffer holds the latest value, which a reader may see twice or miss (Haynes et al. 1984, section 9).
"""

from collections import deque
from collections.abc import Iterable
from typing import Protocol

from rcsc.run.buffers import CommonMemory
from rcsc.run.signature import Values


class Spec(Protocol):
    """What happens to a buffer, from its first tick to its last; see `rcsc_cell.episodes.episode.TransportSpec`."""

    @property
    def buffer(self) -> str:
        """Its name."""
        ...

    @property
    def kind(self) -> str:
        """`lost`, `doubled`, `stale` or `delayed`."""
        ...

    @property
    def first_tick(self) -> int:
        """From when."""
        ...

    @property
    def last_tick(self) -> int:
        """Until when, included."""
        ...

    @property
    def ticks(self) -> int:
        """How late a delayed value comes."""
        ...


class Harmed(CommonMemory):
    """Common memory with a schedule of harm.

    Attributes:
        tick: The tick under way; whoever steps the system sets it by `begin`.
    """

    def __init__(self, harms: Iterable[Spec] = ()) -> None:
        super().__init__()
        self.tick = 0
        self.harms: list[Spec] = list(harms)
        self._now: dict[str, Spec] = {}
        self._late: dict[str, deque[tuple[int, int, Values]]] = {}  # due, published, values
        self._kept: dict[str, tuple[int, Values]] = {}
        self._newest: dict[
            str, int
        ] = {}  # when what readers see was published, of buffers that something happened to

    def begin(self, tick: int) -> None:
        """A tick begins: what is due by now arrives, and what was kept back is let go."""
        self.tick = tick
        if not self.harms:
            return
        self._now = {harm.buffer: harm for harm in self.harms if harm.first_tick <= tick <= harm.last_tick}
        for name in [name for name in self._kept if self._kind(name) != "stale"]:
            self._arrive(name, *self._kept.pop(name))
        for name, late in self._late.items():
            while late and late[0][0] <= tick:
                self._arrive(name, *late.popleft()[1:])

    def publish(self, name: str, values: Values) -> None:
        """Makes this the latest value, unless something happens to it."""
        now = self._now.get(name)
        if now is None:
            self._arrive(name, self.tick, values)
            return
        match now.kind:
            case "lost":
                return
            case "stale":
                self._kept[name] = self.tick, values
            case "doubled" if (self.tick - now.first_tick) % 2 == 0:
                return
            case "delayed":
                late = self._late.setdefault(name, deque())
                late.append((self.tick + 1 + now.ticks, self.tick, values))
            case _:
                self._arrive(name, self.tick, values)

    def _arrive(self, name: str, published: int, values: Values) -> None:
        """Readers see it, unless they have seen a newer one."""
        if self.harms:
            if self._newest.get(name, -1) > published:
                return
            self._newest[name] = published
        super().publish(name, values)

    def _kind(self, name: str) -> str:
        now = self._now.get(name)
        return "" if now is None else now.kind
