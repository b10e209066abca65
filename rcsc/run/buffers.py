"""Common memory: the latest value of every buffer (Haynes et al. 1984, section 9).

A reader may see the same value twice, or miss one; it never sees half of one.
"""

from typing import Protocol

from rcsc.run.signature import Values


class Buffers(Protocol):
    """A carrier of buffers between levels; the one interface of every transport."""

    def publish(self, name: str, values: Values) -> None:
        """Publish this as the latest value."""
        ...

    def latest(self, name: str) -> Values | None:
        """Return the latest value; None before the first."""
        ...


class CommonMemory:
    """Common memory of one process."""

    def __init__(self) -> None:
        self._held: dict[str, Values] = {}

    def publish(self, name: str, values: Values) -> None:
        """Publish this as the latest value."""
        self._held[name] = values

    def latest(self, name: str) -> Values | None:
        """Return the latest value; None before the first."""
        return self._held.get(name)
