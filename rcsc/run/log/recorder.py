"""The recorder: attached to a running system, it writes what happens to an MCAP file.

In: a `System`, after each tick. Out: the file. It depends on the run alone: no time of day, no path, no version, and
not on which executors ran. A kill at any moment costs at most the last chunk, `CHUNK_MS` of the run.
"""

import contextlib
import hashlib
import os
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, Protocol, Self

from mcap.writer import CompressionType, Writer

from rcsc.run.adopt import Begun, Restarted
from rcsc.run.description import Description
from rcsc.run.log.finding import FINDING, LoggedFinding, finding_facts
from rcsc.run.log.records import CHAIN, DIGEST, OPEN, SEAL
from rcsc.run.log.schema import (
    BUFFERS,
    LEVELS,
    PROGRAMS,
    SIGNATURE,
    SYSTEM,
    fingerprints,
    message_definition,
    message_format,
    outside_wires,
    restart_topic,
    signature_text,
    system_facts,
)
from rcsc.run.signature import Leaf, Signature, Values

CHUNK_MS = 1000
"""How much of the run a chunk holds, and so the most that a kill loses."""

_MOST_OPEN = 8 << 20  # bytes after which a chunk ends before its time
_NS_PER_MS = 1_000_000


class RecordedLevel(Protocol):
    """A level as its records need it."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def sign(self) -> Signature:
        """Its program's signature."""
        ...

    @property
    def values(self) -> Values:
        """All leaves and the trace, as its last cycle left them."""
        ...


class RecordedBuffers(Protocol):
    """Buffers as their records need them."""

    def latest(self, name: str) -> Values | None:
        """Return the latest value; None before the first."""
        ...


class Recorded(Protocol):
    """What is recorded: a `System`, or what was seen of one that runs in other processes."""

    @property
    def description(self) -> Description:
        """Its description."""
        ...

    @property
    def levels(self) -> Sequence[RecordedLevel]:
        """Its levels from the top down."""
        ...

    @property
    def buffers(self) -> RecordedBuffers:
        """Its buffers."""
        ...

    @property
    def tick(self) -> int:
        """Ticks done so far."""
        ...

    @property
    def restarts(self) -> Sequence[Restarted]:
        """Levels that were started again before the last tick."""
        ...


class _Chained:
    """A file that keeps the digest of all that was written to it."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self._hashed, self._at, self._seal_at = file, hashlib.sha256(), 0, 0

    @property
    def closed(self) -> bool:
        """Whether nothing can be written any more."""
        return self._file.closed

    def write(self, content: bytes) -> int:
        """Write."""
        self._hashed.update(content)
        self._at += len(content)
        return self._file.write(content)

    def tell(self) -> int:
        """Bytes so far."""
        return self._at

    def flush(self) -> None:
        """Hand all to the system: a kill of this process loses none of it."""
        self._file.flush()

    def digest(self) -> str:
        """Of all so far."""
        return self._hashed.hexdigest()

    def seal_comes(self) -> None:
        """Note that the next record written is the seal."""
        self._seal_at = self._at

    def seal(self) -> None:
        """Put the digest in the seal's place, once everything else has reached the disk."""
        self.flush()
        os.fsync(self._file.fileno())
        self._file.seek(self._seal_at + _SEAL_HEAD)
        self._file.write(self.digest().encode())
        self.flush()

    def close(self) -> None:
        """Close."""
        self._file.close()


_SEAL_HEAD = len(b"K") + 8 + 4 + len(SEAL) + 4 + 4 + len(DIGEST) + 4
"""Bytes of the seal's record before its digits: kind, length, name, length of the table, its one key, length of the value."""


class Recorder:
    """Writes every cycle of a system: `system.watch.append(Recorder(system, path))`.

    The first message of a level is the state that it starts from, at the tick where recording starts. A level that is started
    again has a channel for that: each message is the state from which it goes on, at the tick of the cycle that it comes before.
    """

    def __init__(self, system: Recorded, path: Path, finding: LoggedFinding | None = None) -> None:
        """Writes everything but the cycles, under another name first: a log that is there can be opened.

        Args:
            system: Whose cycles they will be.
            path: Where to.
            finding: What the run breaks, where it is kept for that.

        Raises:
            OSError: The file cannot be written.
        """
        self._tick_ns = system.description.tick_ms * _NS_PER_MS
        self._ticks_a_chunk = max(1, CHUNK_MS // system.description.tick_ms)
        # a device or a pipe is not replaced
        beside = path if path.exists() and not path.is_file() else path.with_name(f".{path.name}.part")
        self._path, self._tick, self._kept = path, system.tick, system.tick
        self._file = _Chained(beside.open("wb", buffering=1 << 20))
        self._writer = Writer(self._file, chunk_size=_MOST_OPEN, compression=CompressionType.ZSTD)  # type: ignore[arg-type]  # all that it calls
        try:
            self._begin(system, finding)
            if beside != path:
                beside.replace(path)
        except OSError:
            self._file.close()
            if beside != path:
                beside.unlink(missing_ok=True)
            raise

    def _begin(self, system: Recorded, finding: LoggedFinding | None) -> None:
        self._writer.start(profile="rcsc", library="rcsc")
        self._writer.add_metadata(SYSTEM, system_facts(system.description))
        self._writer.add_metadata(PROGRAMS, fingerprints(system.description))
        if finding is not None:
            self._writer.add_metadata(FINDING, finding_facts(finding))
        self._levels = {
            level.name: (self._level_channel(level), level.sign.packed) for level in system.levels
        }
        self._restarts: dict[tuple[str, Begun], tuple[int, struct.Struct]] = {}
        self._aside: dict[str, int] = {}
        signs = self._signs = {level.name: level.sign for level in system.levels}
        self._buffers = {
            wire.source: self._buffer_channel(wire.source, signs[taker].leaves_of(variable), wire.target)
            for wire in outside_wires(system.description)
            for taker, _, variable in [wire.target.partition(".")]
            if taker in signs
        }
        for level in system.levels:
            self._write_level(level, system.tick)
        self._write_buffers(system)
        self._end_chunk()

    def _level_channel(self, level: RecordedLevel) -> int:
        definition = message_definition(level.sign.leaves, level.sign.failed)
        schema = self._writer.register_schema(f"rcsc/{level.name}", "ros1msg", definition.encode())
        metadata = {SIGNATURE: signature_text(level.sign)}
        return self._writer.register_channel(LEVELS + level.name, "ros1", schema, metadata)

    def _buffer_channel(
        self, source: str, leaves: tuple[Leaf, ...], target: str
    ) -> tuple[int, struct.Struct]:
        definition = message_definition(leaves)
        name = f"rcsc/{source.replace('.', '_')}"
        schema = self._writer.register_schema(name, "ros1msg", definition.encode())
        channel = self._writer.register_channel(BUFFERS + source, "ros1", schema, {"target": target})
        return channel, struct.Struct(message_format(leaves))

    def __call__(self, system: Recorded, ran: Sequence[RecordedLevel]) -> None:
        """Write which levels were started again, what those that ran in this tick were left with, and what came from outside.

        Raises:
            OSError: The disk is full, or cannot be written; says up to which cycle the log is kept.
        """
        with self._reporting():
            self._tick = system.tick
            for restart in system.restarts:
                self._write_restart(restart, system.tick)
            for level in ran:
                self._write_level(level, system.tick)
            self._write_buffers(system)
            if system.tick % self._ticks_a_chunk == 0:
                self._end_chunk()

    def aside(self, topic: str, fields: str, tick: int, content: bytes) -> None:
        """Write what a tick has beside its cycles, before those of that tick; a log without any has no such channel.

        Raises:
            OSError: As of a tick.
        """
        with self._reporting():
            if topic not in self._aside:
                name = f"rcsc{topic.replace('/', '_')}"
                schema = self._writer.register_schema(name, "ros1msg", fields.encode())
                self._aside[topic] = self._writer.register_channel(topic, "ros1", schema)
            self._write(self._aside[topic], tick, content)

    @contextlib.contextmanager
    def _reporting(self) -> Iterator[None]:
        """Report what is kept where no more can be written, and write nothing more."""
        try:
            yield
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.close()
            why = f"{error.strerror}; the log is kept up to cycle {self._kept}"
            raise OSError(error.errno, why, str(self._path)) from error

    def _end_chunk(self) -> None:
        """Write what there is, and the chain over it."""
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
        self._writer.add_metadata(CHAIN, {DIGEST: self._file.digest()})
        self._file.flush()
        self._kept = self._tick

    def _write_level(self, level: RecordedLevel, tick: int) -> None:
        channel, packed = self._levels[level.name]
        self._write(channel, tick, packed.pack(*level.values))

    def _write_restart(self, restarted: Restarted, tick: int) -> None:
        key = restarted.level, restarted.begun
        if key not in self._restarts:  # a log without one has no such channel
            self._restarts[key] = self._restart_channel(*key)
        channel, packed = self._restarts[key]
        self._write(channel, tick, packed.pack(*restarted.values))

    def _restart_channel(self, level: str, begun: Begun) -> tuple[int, struct.Struct]:
        leaves = self._signs[level].leaves
        definition = message_definition(leaves)
        schema = self._writer.register_schema(f"rcsc/{level}_restart", "ros1msg", definition.encode())
        channel = self._writer.register_channel(restart_topic(begun, level), "ros1", schema)
        return channel, struct.Struct(message_format(leaves))

    def _write_buffers(self, system: Recorded) -> None:
        for source, (channel, packed) in self._buffers.items():
            latest = system.buffers.latest(source)
            if latest is not None:
                self._write(channel, system.tick, packed.pack(*latest))

    def _write(self, channel: int, tick: int, content: bytes) -> None:
        time = tick * self._tick_ns
        self._writer.add_message(channel, time, content, time, tick)

    def close(self) -> None:
        """Write the last chunk, the index and the seal; once is enough.

        Raises:
            OSError: They cannot be written; the log then ends with the last chunk that could.
        """
        if self._file.closed:
            return
        with self._reporting():
            self._end_chunk()
            self._file.seal_comes()
            self._writer.add_metadata(SEAL, {DIGEST: OPEN})
            self._writer.finish()  # type: ignore[no-untyped-call]  # likewise
            self._file.seal()
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
