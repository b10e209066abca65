"""What a run publishes, as the page's server finds it: the latest of everything, and what went before, thinned.

In: values, pictures and rows, from the run's thread. Out: the same, from the server's. Nothing here waits for the
page: publishing is a copy of a mapping, and what nobody fetched is overwritten.
"""

import threading
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

Value: TypeAlias = float | str
Moment: TypeAlias = tuple[int, Mapping[str, Value]]
"""A tick, and the values of all variables after it."""

MOST_MOMENTS = 1024
"""So many moments are kept; when there are more, every second one is dropped, and from then on not kept at all."""


@dataclass(slots=True)
class History:
    """Moments of a run in order, at even distances over its whole length; what is kept does not grow with the run.

    Attributes:
        era: How often the run was taken back; what was known before is then void.
    """

    moments: list[Moment] = field(default_factory=list)
    era: int = 0
    _stride: int = 1
    _seen: int = 0

    def add(self, tick: int, values: Mapping[str, Value]) -> None:
        """Add a moment; one that is not after the last takes the run back."""
        if self.moments and tick <= self.moments[-1][0]:
            del self.moments[bisect_right(self.moments, tick - 1, key=lambda moment: moment[0]) :]
            self.era += 1
            self._seen = self._stride * len(self.moments)
        if self._seen % self._stride == 0:
            self.moments.append((tick, values))
        self._seen += 1
        if len(self.moments) > MOST_MOMENTS:
            self.moments = self.moments[::2]
            self._stride *= 2

    def since(self, tick: int) -> list[Moment]:
        """What is kept after a tick."""
        return self.moments[bisect_right(self.moments, tick, key=lambda moment: moment[0]) :]


@dataclass(frozen=True, slots=True)
class Display:
    """The set of variables that a table asks for: by which variable, and which member it has."""

    by: str
    value: str


def display_names(names: Sequence[str]) -> tuple[str, ...]:
    """The variables by which tables choose what is shown: those called `display`."""
    return tuple(name for name in names if name.rpartition(".")[2] == "display")


def problems(names: Sequence[str], displays: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """What is wrong with a set of displays: variables that the run does not have."""
    known = set(names)
    return tuple(
        f"display `{display}`: there is no variable `{name}`"
        for display, variables in displays.items()
        for graph in variables
        for name in graph.split(" over ")
        if name not in known
    )


@dataclass(frozen=True, slots=True)
class Latest:
    """Everything at one moment.

    Attributes:
        tick: -1 before the first.
        frames: Pictures by kind, each with how many came before it.
        rows: (text, state) by the row's number.
        changed: How often a row changed.
    """

    tick: int
    values: Mapping[str, Value]
    display: Display | None
    frames: Mapping[str, tuple[int, str]]
    rows: Mapping[int, tuple[str, str]]
    changed: int
    era: int


class Board:
    """What was published; every method may be called from any thread."""

    def __init__(self, names: Sequence[str], displays: Mapping[str, Sequence[str]]) -> None:
        self._lock = threading.Lock()
        self._history = History()
        self._tick = -1
        self._values: Mapping[str, Value] = {}
        self._frames: dict[str, tuple[int, str]] = {}
        self._rows: dict[int, tuple[str, str]] = {}
        self._changed = 0
        self._displays = frozenset(displays)
        self._choosers = dict.fromkeys(display_names(names), "")

    def publish(self, tick: int, values: Mapping[str, Value]) -> None:
        """The values after a tick; they are copied."""
        kept = dict(values)
        with self._lock:
            self._history.add(tick, kept)
            self._tick, self._values = tick, kept
            for name, before in list(self._choosers.items()):
                text = str(kept.get(name, ""))
                if text != before:  # the one that changed last comes last
                    del self._choosers[name]
                    self._choosers[name] = text

    def frame(self, kind: str, svg: str) -> None:
        """The latest picture of a kind."""
        with self._lock:
            self._frames[kind] = (self._frames.get(kind, (0, ""))[0] + 1, svg)

    def row(self, number: int, text: str, state: str) -> None:
        """What has become of a row of the script."""
        with self._lock:
            self._changed += self._rows.get(number) != (text, state)
            self._rows[number] = (text, state)

    def latest(self) -> Latest:
        """Everything as it is."""
        with self._lock:
            return Latest(
                self._tick, self._values, self._display(), dict(self._frames), dict(self._rows),
                self._changed, self._history.era,
            )  # fmt: skip

    def since(self, tick: int) -> list[Moment]:
        """The moments that are kept after a tick."""
        with self._lock:
            return self._history.since(tick)

    def _display(self) -> Display | None:
        """Choose by the last changed of the variables that name a set."""
        for name, value in reversed(self._choosers.items()):
            if value in self._displays:
                return Display(name, value)
        return None
