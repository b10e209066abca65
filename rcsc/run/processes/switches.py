"""Switches of the plants' faults in common memory: who is attached throws them, the plants' process heeds them before its tick.

In: a block, and the faults with their strengths. Out: `Switches`, of which every process has its own over the same words; to who throws
them they are a plant as any other (`rcsc.run.faults`). Each is two words: how often it was thrown, with how it stands, and its strength.
Nobody throws one while its reader is in a cycle: all stand for who is attached.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Self

from rcsc.run.processes.block import Block
from rcsc.run.processes.clocks import Clocks
from rcsc.run.processes.memory import SharedMemoryBuffers

WORD, WORDS = 8, 2
OFF, ON, GRADED = range(3)
"""How a switch stands: off, on as usual, on with its strength. The rest of its word counts how often it was thrown."""
THROWS = 4
_REAL, _WORD = struct.Struct("<d"), struct.Struct("<Q")

Strengths = Mapping[str, tuple[float, float] | None]
"""Faults with their lowest and highest strength; None for those that are on or off."""


@dataclass(frozen=True, slots=True)
class Switches:
    """The switches of a system's plants.

    Attributes:
        block: Where they are.
        first: Their first byte, a multiple of eight; they take `size` bytes.
        strengths: Of each fault, the same mapping in every process.
    """

    block: Block
    first: int
    strengths: Strengths

    @classmethod
    def behind(cls, buffers: SharedMemoryBuffers, processes: int, strengths: Strengths) -> Self:
        """Return the switches behind the clocks of so many processes."""
        return cls(buffers.block, buffers.layout.size + Clocks.size(processes), strengths)

    @staticmethod
    def size(faults: int) -> int:
        """Return the number of bytes that the switches of so many faults take."""
        return WORDS * WORD * faults

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of the faults."""
        return tuple(self.strengths)

    @property
    def grades(self) -> Mapping[str, tuple[float, float]]:
        """The lowest and the highest strength of those that have strengths."""
        return {name: ends for name, ends in self.strengths.items() if ends is not None}

    @property
    def on(self) -> frozenset[str]:
        """The faults that somebody switched on."""
        return frozenset(name for name in self.strengths if self.word(name) % THROWS != OFF)

    def switch(self, fault: str, *, on: bool) -> None:
        """Throw a switch."""
        self._throw(fault, ON if on else OFF)

    def grade(self, fault: str, strength: float) -> None:
        """Switch a fault on, with a strength."""
        [bits] = _WORD.unpack(_REAL.pack(strength))
        self.block.set_word(self._place(fault) + WORD, bits)
        self._throw(fault, GRADED)

    def word(self, fault: str) -> int:
        """Return a number that is another one after each throw."""
        return self.block.word(self._place(fault))

    def said(self, fault: str) -> str:
        """Return a fault's name, as `NAME=STRENGTH` where it was given one."""
        if self.word(fault) % THROWS != GRADED:
            return fault
        [strength] = _REAL.unpack(_WORD.pack(self.block.word(self._place(fault) + WORD)))
        return f"{fault}={strength:.17g}"

    def _place(self, fault: str) -> int:
        return self.first + WORDS * WORD * self.faults.index(fault)

    def _throw(self, fault: str, how: int) -> None:
        thrown = self.word(fault) // THROWS + 1
        self.block.set_word(self._place(fault), thrown * THROWS + how)


@dataclass(slots=True)
class Heeded:
    """What a process has heeded of the switches; what stands when it is made has been heeded."""

    switches: Switches
    _words: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        """Look how they stand."""
        self._words = {name: self.switches.word(name) for name in self.switches.strengths}

    def thrown(self) -> Iterator[tuple[str, bool]]:
        """Yield each fault whose switch was thrown since, as `rcsc.run.faults.switch` takes it, and whether it is on."""
        for name, before in self._words.items():
            word = self.switches.word(name)
            if word != before:
                self._words[name] = word
                yield self.switches.said(name), word % THROWS != OFF
