"""Common memory in which something goes wrong: buffers that lose, delay, double or repeat values, and fields that hold one, by ticks.

In: what is to happen. Out: `Buffers`. A buffer that loses, delays or doubles keeps what a buffer promises: a reader sees whole values and
none older than one that it has seen, sees one twice or misses one (Haynes et al. 1984, section 9). One that is *stale* does not.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rcsc.run.buffers import CommonMemory
from rcsc.run.episodes.episode import BufferFault
from rcsc.run.signature import Value, Values


@dataclass(frozen=True, slots=True)
class Held:
    """A leaf of a buffer that holds a value from a tick to another, that included."""

    buffer: str
    place: int
    value: Value
    first_tick: int
    last_tick: int


class HarmedMemory(CommonMemory):
    """Common memory with a schedule of harm.

    Attributes:
        said: What was last published in each buffer, whatever became of it.
        changed: Buffers that a stale value or a held one has changed in this tick: which places, none where it is the whole.
    """

    def __init__(
        self, harms: Iterable[BufferFault], held: Iterable[Held], first: Mapping[str, Values]
    ) -> None:
        """Nothing is published yet.

        Args:
            harms: What happens to buffers.
            held: What fields hold.
            first: What a buffer from outside is taken to say before anything is published in it.
        """
        super().__init__()
        self.said: dict[str, Values] = {}
        self.changed: dict[str, frozenset[int]] = {}
        self._harms, self._readings, self._first = tuple(harms), tuple(held), first
        self._tick = 0
        self._now: dict[str, BufferFault] = {}
        self._holding: dict[str, dict[int, Value]] = {}
        self._late: dict[str, deque[tuple[int, int, Values]]] = {}  # due, published, values
        self._newest: dict[str, int] = {}  # when what readers see was published
        self._seen: dict[str, Values] = {}  # what readers see, but for fields that hold a value
        size = 1 + max((harm.ticks for harm in self._harms), default=0)
        self._past = {harm.buffer: deque[Values](maxlen=size) for harm in self._harms if harm.kind == "stale"}

    def written(self) -> CommonMemory:
        """Common memory as its writers left it: what is lost or late is so on the way to readers."""
        memory = CommonMemory()
        for name, values in self.said.items():
            memory.publish(name, values)
        return memory

    def begin(self, tick: int) -> None:
        """A tick begins: what is due arrives, and fields take and leave what they hold."""
        self._tick = tick
        self.changed.clear()
        self._now = {harm.buffer: harm for harm in self._harms if harm.first_tick <= tick <= harm.last_tick}
        for name, late in self._late.items():
            while late and late[0][0] <= tick:
                self._arrive(name, *late.popleft()[1:])
        before, self._holding = self._holding, {}
        for held in self._readings:
            if held.first_tick <= tick <= held.last_tick:
                self._holding.setdefault(held.buffer, {})[held.place] = held.value
        for name in before.keys() | self._holding.keys():
            if before.get(name) != self._holding.get(name):
                self._show(name, self._seen.get(name, self._first.get(name)))
        for name, by_place in self._holding.items():
            self._note_forged(name, by_place)

    def _note_forged(self, name: str, held: Mapping[int, Value]) -> None:
        """A field that holds what it would hold anyway is not false."""
        seen = self._seen.get(name, self._first.get(name, ()))
        if places := frozenset(
            place for place, value in held.items() if place < len(seen) and seen[place] != value
        ):
            self.changed[name] = places

    def publish(self, name: str, values: Values) -> None:
        """Make this the latest value, unless something happens to it."""
        self.said[name] = values
        if name in self._past:
            self._past[name].append(values)
        now = self._now.get(name)
        match "" if now is None else now.kind:
            case "lost":
                return
            case "doubled" if now is not None and (self._tick - now.first_tick) % 2 == 0:
                return
            case "late" if now is not None:
                due = self._tick + 1 + now.ticks
                self._late.setdefault(name, deque()).append((due, self._tick, values))
            case "stale" if now is not None:
                self._repeat(name, now.ticks)
            case _:
                self._arrive(name, self._tick, values)

    def _repeat(self, name: str, ticks: int) -> None:
        """Readers see what was published so many values ago."""
        past = self._past[name]
        older = past[max(0, len(past) - 1 - ticks)]
        if older != past[-1]:
            self.changed[name] = frozenset()
        self._show(name, older)

    def _arrive(self, name: str, published: int, values: Values) -> None:
        """Readers see it, unless they have seen a newer one."""
        if self._newest.get(name, -1) <= published:
            self._newest[name] = published
            self._show(name, values)

    def _show(self, name: str, values: Values | None) -> None:
        if values is not None:
            self._seen[name] = values
            if held := self._holding.get(name):
                values = tuple(held.get(place, value) for place, value in enumerate(values))
            super().publish(name, values)
