"""Common memory of several processes: one block of shared memory for a whole system.

In: a description and signatures, from which every process computes the same layout. Out: `SharedMemoryBuffers`.

A level's region holds its complete state as canonical bytes. The buffers that it gives are part of that state, so one commit
publishes them all together with the checkpoint: a level that is killed at any instant goes on from its last committed
cycle, and nobody has seen anything of a later one. Each buffer from outside the levels has a region of its own.

A region is a word and two slots. The word is the stamp of the committed slot, and says by its parity which one that is. A
writer fills the other slot and then sets the word: killed in between, it leaves the old slot and the old word. A slot
starts with its own stamp, 0 while it is being written, and carries a checksum; a reader that meets a writer finds the
stamp changed, and tries again. What does not agree with its checksum is never believed.

A slot says in which cycle it was written, by the system's own time, and a level's with which cycles' buffers it ran: who reads both
slots before the next but one is written (`clocks`) has missed none. A second region of a level says from what it began, a third what
somebody sets by hand: the level takes it between two cycles, and nobody writes in what is its own.

One process writes a region; a level is not started twice.
"""

import struct
import time
import zlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Self

from rcsc.run.description import BadDescription, Description
from rcsc.run.processes.block import Block
from rcsc.run.signature import FORMATS, Signature, Value, Values

HEAD = struct.Struct("<QQQII")  # stamp, which buffers are there, time of the cycle, checksum, nothing
TICK, BEGUN = "Q", "B"
"""Formats: of a time, which is kept one higher, and of how a level began."""
NO_CYCLE_MS = -1
"""The time of what was written in no cycle."""
LINE = 64  # bytes of a cache line: writers of different regions do not slow each other
CHECKPOINT = 1 << 63
MOST_BUFFERS = 63
TRIES = 10_000
# From one stamp to the next. Odd, so that slots take turns; and no byte of it is 00 or ff, so that the stamps differ in every
# byte, whatever is carried: a damaged word does not name the slot before.
STEP = 0x9E37_79B9_7F4A_7C15
STAMPS = 1 << 64


class NotShared(Enum):
    """The reason why there is no checkpoint."""

    BLANK = auto()  # the level has never run
    LOST = auto()  # it has, or somebody else wrote here: what is there is not believed


@dataclass(frozen=True, slots=True)
class SharedRegion:
    """The region that one process writes in one commit.

    Attributes:
        at: First byte.
        packed: The payload.
        slot: Bytes of a slot.
    """

    at: int
    packed: struct.Struct
    slot: int

    def place(self, stamp: int) -> int:
        """Return the first byte of the slot of a stamp."""
        return self.at + LINE + (stamp & 1) * self.slot


@dataclass(frozen=True, slots=True)
class BufferPlace:
    """A buffer: part of a region's payload.

    Attributes:
        region: Name of the region.
        first: First byte in the payload.
        bit: Says in the slot's head that the buffer is there.
    """

    region: str
    first: int
    packed: struct.Struct
    bit: int


@dataclass(frozen=True, slots=True)
class Layout:
    """The places of all regions and buffers; the same in every process.

    Attributes:
        takes: The buffers that each level takes, in order.
        seed: Of the checksums, from the layout itself: what another layout wrote is not believed.
    """

    regions: Mapping[str, SharedRegion]
    places: Mapping[str, BufferPlace]
    takes: Mapping[str, tuple[str, ...]]
    size: int
    seed: int


@dataclass(frozen=True, slots=True)
class Image:
    """The content of a committed slot.

    Attributes:
        now_ms: Time of the cycle that wrote it; `NO_CYCLE_MS` for none.
    """

    stamp: int
    mask: int
    payload: bytes
    now_ms: int


def layout(system: Description, signs: Mapping[str, Signature]) -> Layout:
    """Lay out the shared memory of a system.

    Args:
        system: Levels and wires.
        signs: By the level's name.

    Raises:
        BadDescription: A buffer joins what does not fit, or nothing that is a level.
    """
    takes = {level.name: system.taken_by(level.name) for level in system.levels}
    payloads = {
        name: struct.Struct(signs[name].packed.format + TICK * len(taken)) for name, taken in takes.items()
    }
    payloads |= {
        mail(name): struct.Struct(f"{signs[name].packed.format}{_marks(signs[name])}s") for name in takes
    }
    payloads |= {begun(name): struct.Struct(f"<{BEGUN}{signs[name].packed.format[1:]}") for name in takes}
    places: dict[str, BufferPlace] = {}
    for wire in system.wires:
        owner, _, variable = wire.source.partition(".")
        taker, _, taken = wire.target.partition(".")
        ends = [
            _record(signs[name], part) for name, part in ((owner, variable), (taker, taken)) if name in signs
        ]
        if not ends or len({text for _, text in ends}) > 1:
            raise BadDescription(f"buffer `{wire.source}` = `{wire.target}` does not fit")
        if wire.source in places:
            continue
        first, text = ends[0]
        packed = struct.Struct(f"<{text}")
        if owner in signs:
            bit = 1 << sum(place.region == owner for place in places.values())
            places[wire.source] = BufferPlace(owner, first, packed, bit)
        else:
            payloads[wire.source] = packed
            places[wire.source] = BufferPlace(wire.source, 0, packed, 1)
    if any(place.bit >= CHECKPOINT for place in places.values()):
        raise BadDescription(f"a level gives more than {MOST_BUFFERS} buffers")
    return _laid(payloads, places, takes)


def begun(level: str) -> str:
    """Return the name of the region in which a level says from what it began."""
    return f"{level}/begun"


def mail(level: str) -> str:
    """Return the name of the region in which somebody sets variables of a level."""
    return f"{level}/mail"


def _marks(sign: Signature) -> int:
    """Return the bytes with a bit for each leaf."""
    return -(-len(sign.leaves) // 8)


def _record(sign: Signature, variable: str) -> tuple[int, str]:
    """Return the place of a record in the canonical bytes, and its format."""
    try:
        run = sign.record(variable)
    except KeyError as error:
        raise BadDescription(f"program `{sign.program}` has no variable `{variable}`") from error
    formats = [FORMATS[leaf.c_type] for leaf in sign.leaves]
    return struct.calcsize("<" + "".join(formats[: run.start])), "".join(formats[run.start : run.stop])


def _laid(
    payloads: Mapping[str, struct.Struct],
    places: Mapping[str, BufferPlace],
    takes: Mapping[str, tuple[str, ...]],
) -> Layout:
    regions, at = {}, 0
    for name, packed in payloads.items():
        slot = -(-(HEAD.size + packed.size) // LINE) * LINE
        regions[name] = SharedRegion(at, packed, slot)
        at += LINE + 2 * slot
    entries = [(name, region.at, region.packed.format) for name, region in regions.items()]
    entries += [(name, place.first, place.packed.format) for name, place in places.items()]
    return Layout(regions, places, takes, at, zlib.crc32(repr(entries).encode()))


@dataclass(slots=True)
class SharedMemoryBuffers:
    """The buffers of a system in a block of shared memory; a transport between processes.

    Attributes:
        block: Where the regions are; whoever made it removes it.
        now_ms: Time of the cycle that this process runs, for what it writes.
        in_step: Whether it reads what was written in cycles before this one, and nothing newer.
    """

    block: Block
    layout: Layout
    now_ms: int = NO_CYCLE_MS
    in_step: bool = False
    _taken_ms: dict[str, int] = field(default_factory=dict)
    _images: dict[str, Image] = field(default_factory=dict)
    _read: dict[str, tuple[bytes, Values]] = field(default_factory=dict)

    @classmethod
    def create(cls, layout: Layout, more: int = 0) -> Self:
        """Make a new block of empty buffers, with so many bytes more after the layout's."""
        buffers = cls(Block.create(layout.size + more), layout)
        for name, region in layout.regions.items():
            buffers._commit(name, 0, bytes(region.packed.size))
        return buffers

    @classmethod
    def attach(cls, name: str, layout: Layout) -> Self:
        """Attach to the block of that name.

        Raises:
            FileNotFoundError: There is no block of that name.
        """
        return cls(Block.attach(name), layout)

    def publish(self, name: str, values: Values) -> None:
        """Publish this as the latest value."""
        place = self.layout.places[name]
        held = self._image(place.region)
        mask, payload = (
            (held.mask, held.payload) if held else (0, bytes(self.layout.regions[place.region].packed.size))
        )
        new = place.packed.pack(*values)
        rest = payload[place.first + len(new) :]
        # A checkpoint says what the outputs were after a cycle, and this is none.
        self._commit(place.region, (mask | place.bit) & ~CHECKPOINT, payload[: place.first] + new + rest)

    def latest(self, name: str) -> Values | None:
        """Return the latest value; None before the first. The same tuple, for as long as the value is the same."""
        place = self.layout.places[name]
        held = self._before(place.region) if self.in_step else self._image(place.region)
        known = self._read.get(name)
        if held is None or not held.mask & place.bit:
            return known[1] if known else None
        self._taken_ms[name] = held.now_ms
        now = held.payload[place.first : place.first + place.packed.size]
        if known is not None and known[0] == now:
            return known[1]
        values: Values = place.packed.unpack(now)
        self._read[name] = now, values
        return values

    def commit(self, level: str, values: Values) -> None:
        """Make this the level's checkpoint, and publish every buffer that it gives, in one step.

        Args:
            level: Its name.
            values: All leaves and the trace after a cycle.
        """
        taken = (self._taken_ms.get(name, NO_CYCLE_MS) + 1 for name in self.layout.takes[level])
        packed = self.layout.regions[level].packed
        self._commit(level, CHECKPOINT | (CHECKPOINT - 1), packed.pack(*values, *taken))

    def committed(self, level: str, image: Image) -> tuple[Values, dict[str, int]]:
        """Return the values of a level's committed slot, and for each buffer that it takes of which time that was."""
        taken = self.layout.takes[level]
        values: Values = self.layout.regions[level].packed.unpack(image.payload)
        count = len(values) - len(taken)
        return values[:count], {
            name: int(now_ms) - 1 for name, now_ms in zip(taken, values[count:], strict=True)
        }

    def begin(self, level: str, how: int, values: Values) -> None:
        """Say from which values a level goes on, and what they are."""
        name = begun(level)
        self._commit(name, 1, self.layout.regions[name].packed.pack(how, *values))

    def send(self, level: str, values: Values, places: Collection[int]) -> None:
        """Ask a level to go on with these values of some of its leaves, by their places."""
        bits = sum(1 << at for at in places)
        marks = bits.to_bytes(-(-bits.bit_length() // 8), "little")
        self._commit(mail(level), 1, self.layout.regions[mail(level)].packed.pack(*values, marks))

    def sent(self, level: str, image: Image) -> dict[int, Value]:
        """Return what somebody sets, by the places of leaves."""
        *values, marks = self.layout.regions[mail(level)].packed.unpack(image.payload)
        bits = int.from_bytes(marks, "little")
        return {at: value for at, value in enumerate(values) if bits >> at & 1}

    def stamp(self, region: str) -> int:
        """Return the stamp of what was committed to a region last."""
        return self.block.word(self.layout.regions[region].at)

    def since(self, region: str, stamp: int | None) -> list[Image | None]:
        """Return what was committed to a region after that of a stamp, in order, None for what cannot be read: at most the last two."""
        place = self.layout.regions[region]
        for _ in range(TRIES):
            now = self.block.word(place.at)
            if now == stamp:
                return []
            before = (now - STEP) % STAMPS
            found = [self._slot(place, each) for each in (before, now) if each != stamp]
            if self.block.word(place.at) == now:
                return found
        return []

    def checkpoint(self, level: str) -> Values | NotShared:
        """Return all leaves and the trace after the level's last cycle; else why there is no checkpoint."""
        self._images.pop(level, None)
        held = self._image(level)
        if held is not None and held.mask & CHECKPOINT:
            return self.committed(level, held)[0]
        return NotShared.BLANK if held is not None and held.mask == 0 else NotShared.LOST

    def checkpoint_ms(self, level: str) -> int:
        """Return the time of the cycle that left the level's checkpoint; `NO_CYCLE_MS` for none."""
        held = self._image(level)
        return held.now_ms if held is not None and held.mask & CHECKPOINT else NO_CYCLE_MS

    def close(self) -> None:
        """Detach from the block."""
        self.block.close()

    def _commit(self, name: str, mask: int, payload: bytes) -> None:
        region = self.layout.regions[name]
        held = self._image(name)
        # After garbage, a stamp that no reader has met: it would take the new value for one that it knows.
        stamp = ((held.stamp if held else time.time_ns()) + STEP) % STAMPS
        when = self.now_ms + 1
        image = HEAD.pack(stamp, mask, when, self._checksum(stamp, mask, when, payload), 0) + payload
        at = region.place(stamp)
        self.block.set_word(at, 0)
        self.block.write(at + 8, image[8:])
        self.block.set_word(at, stamp)
        self.block.set_word(region.at, stamp)
        self._images[name] = Image(stamp, mask, payload, self.now_ms)

    def _before(self, name: str) -> Image | None:
        """Return the latest slot of a cycle before this one: processes in step are at most one cycle ahead."""
        newest = self._image(name)
        if newest is None or newest.now_ms < self.now_ms:
            return newest
        return self._slot(self.layout.regions[name], (newest.stamp - STEP) % STAMPS)

    def _image(self, name: str) -> Image | None:
        """Return the committed slot; None where it cannot be trusted."""
        region, known = self.layout.regions[name], self._images.get(name)
        for _ in range(TRIES):
            stamp = self.block.word(region.at)
            if known is not None and known.stamp == stamp:
                return known
            image = self._slot(region, stamp)
            if image is not None:
                self._images[name] = image
                return image
            if self.block.word(region.at) == stamp:  # no writer has been here: the slot is bad
                return None
        return known

    def _slot(self, region: SharedRegion, stamp: int) -> Image | None:
        at = region.place(stamp)
        image = self.block.read(at, HEAD.size + region.packed.size)
        # The stamp before and after says that no writer was here; the checksum, that one had been, in whatever order
        # this machine shows one processor's stores to another.
        written, mask, when, checksum, _ = HEAD.unpack_from(image)
        payload = image[HEAD.size :]
        right = checksum == self._checksum(stamp, mask, when, payload)
        if not right or not written == stamp == self.block.word(at):
            return None
        return Image(stamp, mask, payload, when - 1)

    def _checksum(self, stamp: int, mask: int, when: int, payload: bytes) -> int:
        head = struct.pack("<QQQ", stamp, mask, when)
        return zlib.crc32(payload, zlib.crc32(head, self.layout.seed))
