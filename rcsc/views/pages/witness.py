"""Watch a run for its report: rows, timing, pictures where there are any.

In: a run. Out: a `Story` of what its log does not hold. It looks at the run from outside, and nothing that runs looks at it. A plant
adds what is true of it alone.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.run.levels import RunningLevel
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.system import System
from rcsc.views.pages.report import CellPicture, Figure, ReportRow, Story

FRAMES_APART, LONG_APART = 25, 80
"""Cycles between pictures of the filmstrip: at the least, and in the middle of a long row."""


@dataclass(slots=True)
class RunWitness:
    """Watches every cycle of a run; in `System.watch`.

    Attributes:
        run: System and operator.
        pictures: Functions that draw the world outside as an SVG document, by kind.
        film: Whether pictures for a report are kept.
        seconds: Spent on watching.
        drawn: Variables, `level.variable`, that the report draws at first; empty where the log decides.
    """

    run: ScriptedRun
    pictures: Mapping[str, Callable[[], str]] = field(default_factory=dict)
    film: bool = False
    seconds: float = 0.0
    frames: list[CellPicture] = field(default_factory=list)
    drawn: Sequence[str] = ()
    _row: int = -1
    _filmed: int = -FRAMES_APART

    def __call__(self, system: System, due: tuple[RunningLevel, ...]) -> None:  # noqa: ARG002  # as all who watch
        """Watch a cycle that has just ended."""
        begun = time.perf_counter()
        self.look()
        if self.film:
            self._film(system)
        self.seconds += time.perf_counter() - begun

    def look(self) -> None:
        """Look at the world outside, after each cycle; here nothing is known of it."""

    # --- the report ---

    def _film(self, system: System) -> None:
        at = 0 if self.run.operator is None else self.run.operator.at
        since = system.tick - self._filmed
        drawing = next(reversed(list(self.pictures.values())), None)
        if drawing is not None and (since >= LONG_APART or (at != self._row and since >= FRAMES_APART)):
            self._filmed, self._row = system.tick, at
            self.frames.append(CellPicture(system.tick, self._caption(at), drawing()))

    def _caption(self, at: int) -> str:
        rows = () if self.run.operator is None else self.run.operator.rows
        if not rows:
            return f"cycle {self.run.system.tick}"
        row = rows[min(at, len(rows) - 1)]
        return f"row {row.number}: {row.text}"

    def story(self, title: str, seconds: float) -> Story:
        """Return the story of the run, without what its log tells.

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
            timing=[
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
