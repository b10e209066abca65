"""The records of a log's file, chained: they are read as far as the chain holds.

In: an MCAP file. Out: its records, and what the chain says of them (`Seal`). The chain is a SHA-256 over all bytes of the file from the
first. A metadata record `rcsc.chain` after each chunk holds its value so far. The last one, `rcsc.seal`, holds the digest of the whole
file, its own 64 digits taken as zeros: no byte can change, come or go without being noticed. The chain has no key: it tells damage, not
forgery.

Sizes are bounded before anything is unpacked, by the size of the file: a log holds 16 bytes of index for each message.

Source: MCAP specification, version 0.
"""

import hashlib
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from io import BytesIO
from pathlib import Path
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Metadata
from zstandard import ZstdDecompressor, ZstdError, frame_content_size

from rcsc.base.host.files.read import opened

CHAIN, SEAL, DIGEST = "rcsc.chain", "rcsc.seal", "sha256"
"""Names of the metadata records, and of what they hold."""
OPEN = "0" * 64
"""The digest of a seal that is not closed yet."""

MOST_CHUNK = 64 * 1024 * 1024
"""Most bytes that a chunk unpacks to; those that are written are far smaller."""
_MOST_RECORD = 64 * 1024 * 1024
_INDEXED, _UNPACKED_A_BYTE, _ALWAYS = 16, 1024, 1 << 24
"""Bytes of the file for each message, the most that a byte of it unpacks to, and what any file may unpack to."""
_MOST_UNPACKED = 1 << 32
_MAGIC = b"\x89MCAP0\r\n"
_DAMAGE = (McapError, ZstdError, struct.error, ValueError, EOFError, KeyError, OverflowError, IndexError)


class Seal(Enum):
    """What a log's chain says of it."""

    WHOLE = "whole"
    """Every byte is as it was recorded."""
    CUT = "cut"
    """It ends before its seal; as far as it was read it is as it was recorded."""
    CHANGED = "changed"
    """From some byte on it is not as it was recorded; it was read as far as it is."""
    NONE = "none"
    """It has no chain; whether it is as it was recorded cannot be told."""


@dataclass(slots=True)
class ChainCheck:
    """What was read of a file, and what its chain shows.

    Attributes:
        good: Bytes, from the first, that the chain covers and that are as they were recorded.
        size: Of the file in bytes.
        why: What was wrong where it was read no further; empty where it ended.
    """

    seal: Seal = Seal.NONE
    good: int = 0
    size: int = 0
    why: str = ""

    @property
    def text(self) -> str:
        """Describe it in words."""
        read = f"the first {self.good} of {self.size} bytes are as they were recorded, and were read"
        match self.seal:
            case Seal.WHOLE:
                return f"sealed: all {self.size} bytes are as they were recorded"
            case Seal.CUT:
                return f"cut off: up to the last second is lost; {read}"
            case Seal.CHANGED:
                return f"changed since it was recorded: {self.why}; {read}"
            case Seal.NONE:
                return "not sealed: whether it is as it was recorded cannot be told"


@dataclass(slots=True)
class _Frames:
    """A file as frames: kind and content of each record, and the chain over them.

    Attributes:
        at: Bytes that were taken.
        chain: Over these; `sealed` the same with the seal's digits as zeros.
    """

    file: IO[bytes]
    at: int = 0
    chain: "hashlib._Hash" = field(default_factory=hashlib.sha256)
    sealed: "hashlib._Hash | None" = None

    def take(self, count: int) -> bytes:
        """The next bytes. Raises EOFError: there are not as many."""
        taken = self.file.read(count)
        if len(taken) < count:
            raise EOFError
        return taken

    def frame(self) -> tuple[int, bytes]:
        """The next record, its length and kind before it; not in the chain yet.

        Raises:
            EOFError: There is none, or it is cut.
            ValueError: It is too large.
        """
        head = self.take(9)
        length = int.from_bytes(head[1:], "little")
        if length > _MOST_RECORD:
            raise ValueError(f"a record of {length} bytes")
        return head[0], head + self.take(length)

    def pass_over(self, taken: bytes) -> None:
        """Adds bytes to the chain."""
        self.at += len(taken)
        self.chain.update(taken)
        if self.sealed is not None:
            self.sealed.update(taken)


def records(path: Path, checked: ChainCheck) -> Iterator[McapRecord]:
    """Give every record that the chain covers, or every one of a log without a chain.

    Args:
        path: The file.
        checked: Is filled in; final when the last record was given.

    Raises:
        OSError: It cannot be read.
    """
    with opened(path) as file:
        checked.size = os.fstat(file.fileno()).st_size
        unpacking = _Unpacking(checked.size)
        waiting: list[McapRecord] = []
        for record in _framed(_Frames(file), checked):
            if record is None:  # the chain holds so far
                yield from unpacking.all_of(waiting, checked)
                waiting.clear()
                if unpacking.stopped:
                    return
            else:
                waiting.append(record)
        if checked.seal is not Seal.CHANGED and checked.good == 0:
            checked.seal = Seal.NONE
            yield from unpacking.all_of(waiting, checked)


def _framed(frames: _Frames, checked: ChainCheck) -> Iterator[McapRecord | None]:
    """Yield the records of the file itself; None where the chain was checked and holds."""
    checked.seal = Seal.CUT
    try:
        magic = frames.take(len(_MAGIC))
        if magic != _MAGIC:
            raise ValueError("it does not begin as a log does")
        frames.pass_over(magic)
        while True:
            kind, frame = frames.frame()
            record = _record(kind, frame[9:])
            if isinstance(record, Metadata) and record.name == CHAIN:
                if record.metadata != {DIGEST: frames.chain.hexdigest()}:
                    raise ValueError(f"the chain does not hold before byte {frames.at}")
                checked.good = frames.at + len(frame)
                yield None
            if isinstance(record, Metadata) and record.name == SEAL:
                yield from _sealed(frames, frame, record, checked)
                return
            frames.pass_over(frame)
            if record is not None:
                yield record
            if isinstance(record, Footer):
                checked.seal = Seal.CHANGED if checked.good else Seal.NONE  # a chain ends in a seal
                return
    except EOFError:
        checked.why = f"it ends at byte {checked.size}, before its end was written"
    except _DAMAGE as error:
        checked.seal, checked.why = Seal.CHANGED, str(error)


def _sealed(
    frames: _Frames, frame: bytes, record: Metadata, checked: ChainCheck
) -> Iterator[McapRecord | None]:
    """Read what comes after the seal; yield None if it seals the whole file."""
    digest = record.metadata.get(DIGEST, "")
    if record.metadata != {DIGEST: digest} or frame.count(digest.encode()) != 1 or len(digest) != len(OPEN):
        raise ValueError(f"the seal at byte {frames.at} is none")
    frames.sealed = frames.chain.copy()
    frames.pass_over(frame.replace(digest.encode(), OPEN.encode()))
    last = b""
    while rest := frames.file.read(1 << 20):
        frames.pass_over(rest)
        last = (last + rest)[-len(_MAGIC) :]
    if digest == OPEN or last != _MAGIC:
        raise EOFError
    if frames.chain.hexdigest() != digest:
        checked.seal, checked.why = Seal.CHANGED, f"something changed after byte {checked.good}, or the seal"
        return
    checked.seal, checked.good = Seal.WHOLE, checked.size
    yield None


def _record(kind: int, content: bytes) -> McapRecord | None:
    """A record of the kinds that matter here; None for another."""
    stream = ReadDataStream(BytesIO(content))
    record: McapRecord | None = None
    match kind:
        case Opcode.METADATA:
            record = Metadata.read(stream)
        case Opcode.CHANNEL:
            record = Channel.read(stream)
        case Opcode.CHUNK:
            record = Chunk.read(stream)
        case Opcode.MESSAGE:
            record = Message.read(stream, len(content))
        case Opcode.FOOTER:
            record = Footer.read(stream)
        case _:
            pass
    return record


@dataclass(slots=True)
class _Unpacking:
    """What chunks hold, within what a file of this size can hold."""

    size: int
    unpacked: int = 0
    taken: int = 0
    stopped: bool = False

    def all_of(self, several: list[McapRecord], checked: ChainCheck) -> Iterator[McapRecord]:
        """Yield the records, for each chunk those in it."""
        try:
            for mcap_record in several:
                inside = (
                    _inside(self._unpack(mcap_record))
                    if isinstance(mcap_record, Chunk)
                    else iter((mcap_record,))
                )
                for record in inside:
                    self._count()
                    if record is not None:
                        yield record
        except _DAMAGE as error:
            self.stopped, checked.seal, checked.why = True, Seal.CHANGED, str(error)

    def _unpack(self, chunk: Chunk) -> bytes:
        self.unpacked += chunk.uncompressed_size
        most = min(_ALWAYS + _UNPACKED_A_BYTE * self.size, _MOST_UNPACKED)
        if chunk.uncompressed_size > MOST_CHUNK or self.unpacked > most:
            raise ValueError(f"it unpacks to {self.unpacked} bytes and more, which no log of its size does")
        data: bytes = chunk.data
        if chunk.compression == "zstd":
            if frame_content_size(data) != chunk.uncompressed_size:
                raise ValueError("a chunk does not unpack to what it says")
            data = ZstdDecompressor(max_window_size=1 << 27).decompress(data)
        elif chunk.compression:
            raise ValueError("a chunk is packed in another way than logs are")
        if len(data) != chunk.uncompressed_size or zlib.crc32(data) != (
            chunk.uncompressed_crc or zlib.crc32(data)
        ):
            raise ValueError("a chunk does not unpack to what it was")
        return data

    def _count(self) -> None:
        self.taken += 1
        if self.taken * _INDEXED > _ALWAYS // 1024 + self.size:
            raise ValueError(f"it holds {self.taken} records and more, which no log of its size does")


def _inside(data: bytes) -> Iterator[McapRecord | None]:
    """The records of a chunk; None for those that do not matter here. Raises ValueError: one is cut."""
    at = 0
    while at < len(data):
        length = int.from_bytes(data[at + 1 : at + 9], "little")
        if at + 9 + length > len(data):
            raise ValueError("a record is longer than its chunk")
        record = _record(data[at], data[at + 9 : at + 9 + length])
        yield record if isinstance(record, Channel | Message) else None
        at += 9 + length
