"""Who watches a run, for the report: rows, values, lines that ran, pictures where there are any.

In: a run. Out: what has become of its rows, and a `Story`. It looks at the run from outside, and nothing that runs looks at
it. The paper's cell adds what is true of the cell alone.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain

from rcsc.run.adopt import Begun
from rcsc.run.levels import RunningLevel
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.system import System
from rcsc.run.unset.since import LevelSeen, Unsets
from rcsc.views.pages.report import CellPicture, Figure, Matched, ReportRow, Story

FRAMES_APART, LONG_APART = 25, 80
"""Cycles between pictures of the filmstrip: at the least, and in the middle of a long row."""
MOST_SERIES = 8
"""Curves of the report where the description has no displays."""


@dataclass(slots=True)
class RunWitness:
    """Watches every cycle of a run; in `System.watch`.

    Attributes:
        run: System and operator.
        pictures: Functions that draw the world outside as an SVG document, by kind.
        film: Whether pictures for a report are kept.
        seconds: Spent on watching.
        matched: The number of times that each line ran, by level, table and line.
    """

    run: ScriptedRun
    pictures: Mapping[str, Callable[[], str]] = field(default_factory=dict)
    film: bool = False
    seconds: float = 0.0
    frames: list[CellPicture] = field(default_factory=list)
    matched: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    unset: Unsets = field(init=False)
    _row: int = -1
    _drawn: int = -FRAMES_APART

    def __post_init__(self) -> None:
        """Note the variables that nobody has set at the beginning: none, where the run goes on from another."""
        system = self.run.system
        self.unset = Unsets(system.description.wires, {spec.name: spec for spec in system.description.levels})
        if system.tick == 0:
            self.unset.begin(map(_seen, system.levels), partial(_published, system))

    def __call__(self, system: System, due: tuple[RunningLevel, ...]) -> None:
        """Watch a cycle that has just ended."""
        begun = time.perf_counter()
        self._note(system, due)
        for level in due:
            self.matched.update((level.name, table, line) for table, line in level.lines)
        self.look()
        if self.film:
            self._film(system)
        self.seconds += time.perf_counter() - begun

    def look(self) -> None:
        """Look at the world outside, after each cycle; here nothing is known of it."""

    @property
    def drawn(self) -> Sequence[str]:
        """The variables, `level.variable`, that the report draws at first."""
        return drawn_first(self.run.system)

    def _note(self, system: System, due: tuple[RunningLevel, ...]) -> None:
        """Note the variables that were set in the tick."""
        for restart in system.restarts:
            if restart.begun is Begun.ANEW and restart.level in self.unset.now:
                level = system.level(restart.level)
                trace = level.values[len(level.sign.leaves) :]
                self.unset.restarted(
                    LevelSeen(level.name, level.sign, level.level, (*restart.values, *trace))
                )
        self.unset.tick(map(_seen, due), partial(_published, system))

    # --- the report ---

    def _film(self, system: System) -> None:
        at = 0 if self.run.operator is None else self.run.operator.at
        since = system.tick - self._drawn
        drawing = next(reversed(list(self.pictures.values())), None)
        if drawing is not None and (since >= LONG_APART or (at != self._row and since >= FRAMES_APART)):
            self._drawn, self._row = system.tick, at
            self.frames.append(CellPicture(system.tick, self._caption(at), drawing()))

    def _caption(self, at: int) -> str:
        rows = () if self.run.operator is None else self.run.operator.rows
        if not rows:
            return f"cycle {self.run.system.tick}"
        row = rows[min(at, len(rows) - 1)]
        return f"row {row.number}: {row.text}"

    def story(self, title: str, seconds: float) -> Story:
        """Return the story of the run, for the report.

        Args:
            title: Of the page.
            seconds: That the run took.
        """
        system = self.run.system
        cycle_s = 0.001 * system.description.tick_ms
        ticks = system.tick - self.run.first_tick
        results = () if self.run.operator is None else self.run.operator.results
        return Story(
            title,
            [ReportRow(end.row.number, end.row.text, end.state, end.ticks, end.reason) for end in results],
            self.frames,
            [Matched(*line, self.matched[line]) for line in _lines(system, self.matched)],
            [
                Figure("computing", seconds, "s"),
                Figure("times as fast as the clock", ticks * cycle_s / max(seconds, 1e-9), ""),
                Figure("of it pictures and figures", self.seconds, "s"),
            ],
            tick_ms=system.description.tick_ms,
            ticks=ticks,
        )

    def closing(self) -> Iterator[str]:
        """Yield remarks on the plant at the end, a line each."""
        yield from ()


def _seen(level: RunningLevel) -> LevelSeen:
    return LevelSeen(level.name, level.sign, level.level, level.values)


def _published(system: System, name: str) -> bool:
    return system.buffers.latest(name) is not None


def drawn_first(system: System) -> list[str]:
    """Return the variables with a curve at first: numbers of the displays, else numbers that come from outside or go there."""
    shown = [name for names_ in system.description.displays.values() for name in names_]
    numbers = {
        f"{level.name}.{leaf.name}": leaf
        for level in system.levels
        for leaf in level.sign.leaves
        if not leaf.members and leaf.c_type != "bool"
    }
    chosen = [name for name in shown if name in numbers] or list(_outside(system, numbers))[:MOST_SERIES]
    return list(dict.fromkeys(chosen))


def _outside(system: System, known: Iterable[str]) -> Iterator[str]:
    """Yield the names of variables of buffers with one end outside the levels."""
    levels = {level.name for level in system.levels}
    for wire in system.description.wires:
        ends = [end for end in (wire.source, wire.target) if end.partition(".")[0] in levels]
        if len(ends) == 1 and ends[0] in known:
            yield ends[0]


def _lines(system: System, matched: Counter[tuple[str, str, str]]) -> list[tuple[str, str, str]]:
    """Return all lines of all levels' tables, in their order; those that ran are among them."""
    every = [
        (level.name, table, line)
        for level in system.levels
        for table in level.level.every_table
        for line in level.sign.tables.get(table, ())
    ]
    return list(dict.fromkeys(chain(every, matched)))
