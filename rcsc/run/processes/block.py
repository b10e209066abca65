"""A block of shared memory that outlives any process but its maker, and is not left behind.

In: a size or a name. Out: a `Block`: bytes and words. The resource tracker of `multiprocessing` is kept out of it: it removes
a block when the first process that used it ends, which a killed level would. A block is locked by its maker for as long as
that lives, so that one left behind by a maker that was killed can be told from one in use.
"""

import contextlib
import os
import secrets
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Self

from rcsc.base.host import children

PREFIX = "rcsc-"
FOLDER = Path("/dev/shm")  # noqa: S108  # where Linux keeps them
TRACKING = ("register", "unregister")
_untracking = threading.Lock()


@contextlib.contextmanager
def _untracked() -> Iterator[None]:
    """Keep the resource tracker out: Python 3.13 has an argument for that, but not for `unlink`."""
    with _untracking:
        held = [getattr(resource_tracker, name) for name in TRACKING]
        try:
            for name in TRACKING:
                setattr(resource_tracker, name, _nothing)
            yield
        finally:
            for name, function in zip(TRACKING, held, strict=True):
                setattr(resource_tracker, name, function)


def _nothing(_name: object, _kind: str) -> None:
    """Track nothing."""


@dataclass(slots=True)
class Block:
    """Shared memory.

    Attributes:
        name: By which other processes attach.
    """

    name: str
    _memory: SharedMemory
    _bytes: memoryview = field(init=False)
    _words: memoryview = field(init=False)
    _lock: int = -1

    def __post_init__(self) -> None:
        """Map the memory as bytes and as words."""
        assert self._memory.buf is not None  # it is open
        self._bytes = self._memory.buf
        # A whole multiple of eight bytes; a word of a cast view is stored by one instruction.
        self._words = self._bytes[: len(self._bytes) // 8 * 8].cast("Q")

    @classmethod
    def create(cls, size: int) -> Self:
        """Make a new block of zeros; its maker removes it."""
        children.sweep(FOLDER, PREFIX)
        while True:
            name = f"{PREFIX}{os.getpid()}-{secrets.token_hex(6)}"
            children.hold(FOLDER / name)
            with _untracked():
                block = cls(name, SharedMemory(name, create=True, size=size))
            lock = children.lock(FOLDER / name)
            if lock is not None:
                block._lock = lock
                return block
            block.close()
            children.let_go(FOLDER / name)

    @classmethod
    def attach(cls, name: str) -> Self:
        """Attach to the block of that name.

        Raises:
            FileNotFoundError: There is no block of that name.
        """
        with _untracked():
            return cls(name, SharedMemory(name))

    def word(self, at: int) -> int:
        """Read eight bytes from `at`, a multiple of eight, at once."""
        value: int = self._words[at >> 3]
        return value

    def set_word(self, at: int, value: int) -> None:
        """Write eight bytes from `at`, a multiple of eight, at once."""
        self._words[at >> 3] = value

    def read(self, at: int, size: int) -> bytes:
        """Return `size` bytes from `at` on."""
        return bytes(self._bytes[at : at + size])

    def write(self, at: int, image: bytes) -> None:
        """Write bytes from `at` on."""
        self._bytes[at : at + len(image)] = image

    def close(self) -> None:
        """Detach from the block."""
        self._words.release()
        self._bytes.release()
        self._memory.close()
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def unlink(self) -> None:
        """Remove the block; whoever has it attached still sees it. Do nothing where another process removed it."""
        with _untracked(), contextlib.suppress(FileNotFoundError):
            self._memory.unlink()
        children.let_go(FOLDER / self.name)
