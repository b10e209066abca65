"""Common memory in which something goes wrong, by ticks, and which fault explains that something does not hold, if one does.

In: what is to happen to buffers and fields. Out: `Buffers`; and for a `Broken` the fault, in words, or nothing. A buffer that loses, delays
or doubles keeps what a buffer promises: a reader sees whole values and none older than one that it has seen, sees one twice or misses one
(Haynes et al. 1984, section 9). So such values explain nothing, nor does a restart: the proofs allow them. One that is *stale* does not
keep it: an order, a report or another value of a level that comes again when it is older misleads the level that takes it, and from then
on whoever exchanges buffers with that level. A field from outside that holds a value of its range explains no more than an assumption about
values that follow from it, and what the plant says of itself.
"""

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.lang.leaves import expressions, read_by, written_by
from rcsc.lang.model import Call, Program
from rcsc.run.buffers import CommonMemory
from rcsc.run.episodes.cycle import Broken
from rcsc.run.episodes.episode import BufferFault
from rcsc.run.episodes.stand import Stand
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


# --- whose fault it is ---


@dataclass(slots=True)
class Explanations:
    """What was misled so far.

    Attributes:
        misled: Levels that saw what no buffer may say, each with the fault.
        forged: By level, its leaves that did not come as the plant said, each with the fault.
        repeated: Levels that were misled by older values that came again, each with the fault.
    """

    stand: Stand
    misled: dict[str, str] = field(default_factory=dict)
    forged: dict[str, dict[str, str]] = field(default_factory=dict)
    repeated: dict[str, str] = field(default_factory=dict)

    def note(self, changed: Mapping[str, str], places: Mapping[str, Collection[int]] | None = None) -> None:
        """A tick is done.

        Args:
            changed: Buffers that did not say what was published in time, each with the fault.
            places: Of such a buffer, the leaves that did not; none where all may not have.
        """
        for level, other in self._neighbours():
            for known in (self.misled, self.repeated):
                if level in known:
                    known.setdefault(other, known[level])
        for wire in self.stand.system.wires:
            because = changed.get(wire.source)
            level, _, variable = wire.target.partition(".")
            if because is None or level not in self.stand.signs:
                continue
            if not (places or {}).get(wire.source):
                self.repeated.setdefault(level, because)
            if wire.source in self.stand.protocol or wire.source.partition(".")[0] in self.stand.signs:
                self.misled.setdefault(level, because)
            else:
                sign = self.stand.signs[level]
                false = (places or {}).get(wire.source) or range(len(sign.record(variable)))
                names = (
                    sign.leaves[at].name for place, at in enumerate(sign.record(variable)) if place in false
                )
                self.forged.setdefault(level, {}).update(dict.fromkeys(names, because))

    def _neighbours(self) -> Iterator[tuple[str, str]]:
        """Yield pairs of levels with a buffer between them, both ways."""
        for wire in self.stand.system.wires:
            source, target = wire.source.partition(".")[0], wire.target.partition(".")[0]
            if source in self.stand.signs and target in self.stand.signs:
                yield source, target
                yield target, source

    def because(self, broken: Broken) -> str:
        """Return the fault that explains it; empty for none."""
        if broken.because:
            return broken.because
        if broken.across:
            return self._across(broken)
        if broken.proved:
            return self.repeated.get(broken.level, "")
        if not broken.level:
            faults = [
                *self.misled.values(),
                *(why for leaves in self.forged.values() for why in leaves.values()),
            ]
            return faults[0] if faults else ""
        if broken.level in self.misled:
            return self.misled[broken.level]
        forged = self.forged.get(broken.level, {}) if broken.leaves else {}
        for leaf, because in forged.items():
            if set(follows(self.stand.programs[broken.level], leaf)) & set(broken.leaves):
                self.misled[broken.level] = because  # it was proved of levels whose assumptions hold
                return because
        return ""

    def _across(self, broken: Broken) -> str:
        """Return the fault that explains what is broken across levels."""
        forged = {f"{level}.{leaf}": why for level, by in self.forged.items() for leaf, why in by.items()}
        of_leaves = [forged[leaf] for leaf in broken.leaves if leaf in forged]
        return next(iter((*(self.repeated if broken.proved else self.misled).values(), *of_leaves)), "")


def follows(program: Program, leaf: str) -> set[str]:
    """Return the leaf, and all leaves that are assigned what was computed from it."""
    flows = list(_flows(program))
    known, size = {leaf}, 0
    while len(known) > size:
        size = len(known)
        for reads, writes in flows:
            if known & reads:
                known |= writes
    return known


def _flows(program: Program) -> Iterator[tuple[set[str], set[str]]]:
    """Yield what is read and what is written from it; of a procedure all that it may read, with all that it may write."""
    writes = {procedure.name: set(map(str, procedure.writes)) for procedure in program.procedures}
    for procedure in program.procedures:
        yield set(map(str, procedure.reads)), writes[procedure.name]
    for table in program.tables:
        for statement in (action.statement for line in table.lines for action in line.actions):
            read = {str(name) for expr in expressions(statement) for name in read_by(expr)}
            called = writes[statement.procedure] if isinstance(statement, Call) else set()
            yield read, called | set(map(str, written_by(statement)))
    for variable in program.variables:
        if variable.deferred_until is not None:
            yield {f"{variable.name}.next"}, {str(variable.name)}
