"""How long each part of a proof took last time, for who waits for the next; kept with the proofs, for the machine that they ran on."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import click

from rcsc.base.host.cache import Cache
from rcsc.front.commands.shared.show import Progress

LEAST_S = 0.3
"""What takes less was looked up, or is not worth to be told."""


@dataclass(frozen=True, slots=True)
class Took:
    """Seconds by name of a part, in the same order."""

    names: tuple[str, ...] = ()
    seconds: tuple[float, ...] = ()


class Clock:
    """Knows how long parts took, and is told how long they take.

    Args:
        cache: Where it is kept; None for nowhere.
        path: Of the system.
    """

    def __init__(self, cache: Cache | None, path: Path) -> None:
        self._cache, self._parts = cache, ("took", str(path.resolve()))
        known = None if cache is None else cache.load(Took, *self._parts)
        self._known: dict[str, float] = (
            {} if known is None else dict(zip(known.names, known.seconds, strict=True))
        )
        self._now: dict[str, float] = {}

    def said(self, name: str) -> str:
        """The name, with what it took last time where that is known."""
        return f"{name} ({self._known[name]:.0f} s last time)" if name in self._known else name

    def took(self, name: str, seconds: float) -> None:
        """Note what a part took."""
        if seconds >= LEAST_S:
            self._now[name] = seconds

    def keep(self) -> None:
        """Keep what was noted, beside what was known of other parts."""
        if self._cache is not None and self._now:
            whole = self._known | self._now
            self._cache.store(Took(tuple(whole), tuple(whole.values())), *self._parts)


@contextmanager
def doing(clock: Clock, name: str) -> Iterator[None]:
    """Name something on a terminal's standard error while it is done, with what it took last time."""
    line, begun = Progress(), time.perf_counter()
    line(clock.said(name))
    try:
        yield
    finally:
        line("")
        clock.took(name, time.perf_counter() - begun)
        clock.keep()


class Answering:
    """Names each requirement on a terminal's standard error while it is answered, and, where that is wanted, each that is done.

    Args:
        clock: What knows how long each took.
        wanted: Whether those that are done are named elsewhere than on a terminal, too.
    """

    def __init__(self, clock: Clock, *, wanted: bool) -> None:
        self._clock, self._wanted = clock, wanted
        self._line = Progress()
        self._of, self._begun = "", 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._line("")
        self._clock.keep()

    def __call__(self, name: str, at: int, many: int) -> None:
        """Begin with a requirement, the `at`-th of so many."""
        self._end()
        self._of, self._begun = name, time.perf_counter()
        self._line(f"answering {self._clock.said(f'requirement {name}')}, {at} of {many}")

    def _end(self) -> None:
        if not self._of:
            return
        seconds = time.perf_counter() - self._begun
        self._clock.took(f"requirement {self._of}", seconds)
        self._line("")
        if self._wanted:
            click.echo(f"requirement {self._of}: answered, {seconds:.1f} s", err=True)
        self._of = ""
