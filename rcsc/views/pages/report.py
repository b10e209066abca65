"""The report of a run in the cell: one HTML page that needs nothing else.

In: a `Story`, filled from a finished run. Out: a file with the run tick by tick, the filmstrip, what became of each row of the script,
where the parts ended, which lines of the tables ran, how near the joints came to their limits, and timing. Time line, levels and curves are
the studio's, of what `Played` holds; without it the page has no script. It fetches nothing, and says so to the browser.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from markupsafe import Markup

from rcsc.base.host.files import write_atomically
from rcsc.views.pages.frame import PAGES


@dataclass(frozen=True, slots=True)
class ReportRow:
    """A row of the script: `state` is `done`, `failed`, `refused` or what else became of it; `reason` may be empty."""

    number: int
    text: str
    state: str
    cycles: int
    reason: str = ""


@dataclass(frozen=True, slots=True)
class CellPicture:
    """A picture of the cell at a tick; `svg` is a document."""

    tick: int
    caption: str
    svg: str


@dataclass(frozen=True, slots=True)
class Matched:
    """The number of times that a line of a table ran."""

    level: str
    table: str
    line: str
    count: int


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured number."""

    name: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Placement:
    """The wanted and the actual place of a part: lengths in mm, angles in degrees, as text for the reader."""

    part: str
    wanted: str
    actual: str
    error_mm: float


class Played(Protocol):
    """A run to be drawn tick by tick: `rcsc.desk.studio.share.document.Played`."""

    @property
    def data(self) -> Markup:
        """The data of the run."""
        ...

    @property
    def script(self) -> Markup:
        """The script that draws it."""
        ...

    @property
    def hash(self) -> str:
        """The script's name in a policy."""
        ...

    @property
    def style(self) -> Markup:
        """The style sheet."""
        ...


@dataclass(frozen=True, slots=True)
class Story:
    """A finished run.

    Attributes:
        title: Of the page.
        rows: Of the script.
        frames: The filmstrip.
        matched: Lines of tables, also those that never ran, in the order of the tables.
        timing: Durations.
        placements: Of the parts.
        margins_deg: The least distance of each joint from its limits.
        tick_ms: Of the system.
        ticks: The number of ticks: those of all rows, and those after the last order.
        recorded: A sentence about the story's log, whose rows are orders and may overlap; empty for a run that was watched.
        about_cell: The source of the pictures, where it is not the plant.
        played: The run tick by tick, as the studio shows it.
        left_out: Cycles of the run that are not in `played`, the first of it.
    """

    title: str
    rows: Sequence[ReportRow] = ()
    frames: Sequence[CellPicture] = ()
    matched: Sequence[Matched] = ()
    timing: Sequence[Figure] = ()
    placements: Sequence[Placement] = ()
    margins_deg: Sequence[float] = ()
    tick_ms: int = 40
    ticks: int = 0
    recorded: str = ""
    about_cell: str = ""
    played: Played | None = None
    left_out: int = 0

    @property
    def counted(self) -> str:
        """The number of rows of a script, or of orders in a log, as text; "" for none."""
        word = "order" if self.recorded else "row"
        return f"{len(self.rows)} {word}{'s' if len(self.rows) != 1 else ''}, " if self.rows else ""

    @property
    def outcome(self) -> str:
        """The outcome: of a script the row that stopped it, of a log the number of orders by state; "" where all are done."""
        bad = [row for row in self.rows if row.state != "done"]
        if not bad:
            return ""
        if self.recorded:
            states = Counter(row.state for row in self.rows)
            return ", ".join(f"{count} {state}" for state, count in states.items())
        first = bad[0]
        return f"stopped in row {first.number}: {first.state}" + (f": {first.reason}" if first.reason else "")

    @property
    def aside(self) -> int:
        """The number of cycles of no row: those in which a level came to rest after the last."""
        within = self.rows and not self.recorded  # orders of a log overlap
        return max(0, self.ticks - sum(row.cycles for row in self.rows)) if within else 0


@dataclass(frozen=True, slots=True)
class _Table:
    """The lines of one table, and how many of them ran."""

    name: str
    lines: tuple[Matched, ...]
    ran: int
    most: int


def report(path: Path, story: Story) -> None:
    """Write the page.

    Raises:
        OSError: The file could not be written.
    """
    write_atomically(path, page(story).encode())


def page(story: Story) -> str:
    """Return the page; equal stories give equal text."""
    return PAGES.get_template("report.html.jinja").render(
        story=story, seconds=lambda tick: tick * story.tick_ms / 1000, tables=_tables(story.matched)
    )


def _tables(matched: Sequence[Matched]) -> list[_Table]:
    """Group the lines by table; tables and lines stay in their order."""
    lines: dict[tuple[str, str], list[Matched]] = {}
    for line in matched:
        lines.setdefault((line.level, line.table), []).append(line)
    return [
        _Table(
            level if table == level else f"{level} · {table}",
            tuple(table_lines),
            sum(line.count > 0 for line in table_lines),
            max(line.count for line in table_lines),
        )
        for (level, table), table_lines in lines.items()
    ]
