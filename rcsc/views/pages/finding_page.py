"""A finding as a page: one frame a tick, or for ticks that are alike; in each its levels as boxes, and the cell as far as the log says it.

In: a log that keeps a finding, and the cell where there is one to be drawn. Out: one HTML file that needs nothing else; the same text for
the same log and cell.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.alike import Alike, folded
from rcsc.base.host.files import write_atomically
from rcsc.run.log.finding import LoggedFinding
from rcsc.run.log.read import Log
from rcsc.run.log.ticks import LoggedTick, frames
from rcsc.views.pages.data import Drawing, DrawnCell
from rcsc.views.pages.frame import PAGES


@dataclass(frozen=True, slots=True)
class _Tick:
    """The content of one frame of the page.

    Attributes:
        mark: A remark on it; empty for none.
        broken: Whether it is the one in which the obligation is broken.
        drawn: The cell; None where there is none.
    """

    frame: LoggedTick
    ms: int
    mark: str
    broken: bool
    drawn: Drawing | None

    @property
    def ran(self) -> Hashable | None:
        """What has to be the same of a tick that is folded with this one; None where it is to be shown by itself."""
        boxes = self.frame.boxes
        if self.mark or self.drawn is not None or any(box.inputs or box.wrong for box in boxes):
            return None
        return tuple(
            replace(box, states=tuple(state for state in box.states if state.before == state.now))
            for box in boxes
        )

    @property
    def moved(self) -> dict[str, str]:
        """What its levels changed, by level and variable."""
        return {
            f"{box.level}.{state.name}": state.now
            for box in self.frame.boxes
            for state in box.states
            if state.before != state.now
        }


def trace(path: Path, log: Log, finding: LoggedFinding, cell: DrawnCell | None, why_not: str = "") -> None:
    """Write the page.

    Args:
        path: Where to.
        log: The run.
        finding: The obligation that it breaks.
        cell: To be drawn.
        why_not: Why there is none, a sentence.

    Raises:
        OSError: The file could not be written.
    """
    write_atomically(path, page(log, finding, cell, why_not).encode())


def page(log: Log, finding: LoggedFinding, cell: DrawnCell | None, why_not: str = "") -> str:
    """Return the page; arguments are as in `trace`."""
    return PAGES.get_template("trace.html.jinja").render(
        finding=finding,
        ticks=film_of(log, finding, cell),
        notes=_notes(log, finding),
        cell=about_cell(cell, why_not),
        sign=SIGNS,
    )


def film_of(
    log: Log, finding: LoggedFinding, cell: DrawnCell | None = None, *, asks: bool = False
) -> "list[tuple[bool, _Tick | Alike[_Tick]]]":
    """Return the ticks of a run as the template of a filmstrip takes them: whether it stands for several alike, and the tick.

    Where a run `asks`, it breaks nothing: what is a finding's tick is that in which it asks.
    """
    ticks = [_tick(frame, log, finding, cell, asks=asks) for frame in frames(log)]
    return [(isinstance(tick, Alike), tick) for tick in folded(ticks)]


SIGNS: Mapping[bool, str] = {True: "\N{CHECK MARK}", False: "\N{BALLOT X}"}


def _tick(
    frame: LoggedTick, log: Log, finding: LoggedFinding, cell: DrawnCell | None, *, asks: bool
) -> _Tick:
    there = frame.tick == finding.broken_at
    mark = "what comes of it" if frame.tick > finding.broken_at else ""
    if there:
        mark = "it asks" if asks else "broken here"
    broken = there and not asks
    drawn = None if cell is None else cell.drawn(frame.tick)
    return _Tick(frame, frame.tick * log.tick_ms, mark, broken, drawn)


def _notes(log: Log, finding: LoggedFinding) -> list[str]:
    """Return notes on the whole run, a sentence each."""
    at, many = finding.broken_at, len(log.ticks)
    begun = (
        f"The shortest run that shows it, of system `{log.facts['name']}`: broken in cycle {at} of {many}."
    )
    notes = [f"{begun} The interpreter, the Python and the C executors all did this."]
    if finding.restarted:
        notes.append("It begins where a restart does, not with the initial values.")
    if not finding.legal:
        notes.append("Numbers have gone round, or a neighbour was restarted before it begins.")
    if finding.altered:
        notes.append("The tables were looked at under another rule than the language's: a demonstration.")
    return notes


def about_cell(cell: DrawnCell | None, why_not: str) -> str:
    """Return a sentence about the source of the cell's pictures; arguments are as in `trace`."""
    if cell is None:
        return f"No cell is drawn: {why_not}"
    return (
        f"The log holds what levels said, not where things are: stations, places and parts are drawn where `{cell.data}` has them now, "
        "parts as they lie when a run begins. What a level names is marked."
    )
