"""A recorded run as a report: orders from outside and what became of them, lines that ran, the cell from time to time.

In: a log, and the cell where there is one to be drawn. Out: a `Story`, which `report` makes a page of; the same for the same log and cell.
What only who watched the run knew (script, parts, timing) is not in a log, and not in the page.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rcsc.run.log.export import coverage
from rcsc.run.log.queries import named_columns
from rcsc.run.log.read import Log
from rcsc.run.log.states import LogColumn
from rcsc.run.log.ticks import LoggedTick, Order, Reported, TickValue, frames
from rcsc.views.pages.data import DrawnCell
from rcsc.views.pages.finding_page import about_cell
from rcsc.views.pages.report import CellPicture, Matched, ReportRow, Story
from rcsc.views.pages.witness import FRAMES_APART

MOST_PICTURES = 60
"""Pictures of the cell in a page; a long run has them further apart."""
MOST_SERIES = 8
"""Curves of a report where the description has no displays."""
ENDED = ("done", "failed")
"""Statuses that end an order where its program does not declare whom its level serves."""


@dataclass(slots=True)
class _Ordered:
    """An order from outside, from the tick in which its level took it."""

    level: str
    text: str
    since: int
    number: int | None
    until: int = 0
    state: str = ""
    reason: str = ""

    def row(self, number: int, last: int) -> ReportRow:
        """Return the order as a row of the report; one without an answer at the end of the log is under way."""
        cycles = (self.until or last) - self.since + 1
        return ReportRow(number, f"{self.level}: {self.text}", self.state or "under way", cycles, self.reason)


def story_of(log: Log, cell: DrawnCell | None = None, why_not: str = "") -> Story:
    """Return the story of the log, for a page.

    Args:
        log: The run.
        cell: To be drawn; None for none.
        why_not: Why there is no cell, a sentence.
    """
    ordered = _ordered(log)
    return Story(
        str(log.facts["name"]),
        [order.row(number, log.last) for number, order in enumerate(ordered, 1)],
        _pictures(log, cell, ordered),
        matched(log),
        tick_ms=log.tick_ms,
        ticks=len(log.ticks),
        recorded=log.checked.text,
        about_cell=about_cell(cell, why_not) if cell is not None or why_not else "",
    )


def matched(log: Log) -> list[Matched]:
    """Return how often each line of each table ran."""
    return [
        Matched(table.level, table.table, line, count)
        for table in coverage(log)
        for line, count in table.lines.items()
    ]


# --- orders ---


def _ordered(log: Log) -> list[_Ordered]:
    """Return every order that a level took from outside, in order."""
    levels, every = {level.name: level.sign for level in log.levels}, list[_Ordered]()
    standing: dict[tuple[str, str], _Ordered] = {}
    for frame in frames(log):
        for level, order, report in _taken(frame, levels):
            key, serves = (level, order.buffer), levels[level].serves
            ends = (serves.done, serves.failed) if serves is not None else ENDED
            now = standing.get(key)
            if order.new or order.altered:
                if now is not None and not now.state:
                    now.state, now.until = "changed", frame.tick - 1
                now = standing[key] = _Ordered(
                    level, _text(order.command, order.fields), frame.tick, order.number
                )
                every.append(now)
            if (
                now is not None
                and not now.state
                and report is not None
                and report.matches
                and report.status in ends
            ):
                now.until, now.state = frame.tick, "done" if report.status == ends[0] else "failed"
                now.reason = "" if now.state == "done" else _values(report.fields)
    return every


def _taken(frame: LoggedTick, levels: Mapping[str, object]) -> Iterator[tuple[str, Order, Reported | None]]:
    """Yield the orders that levels get from outside in a tick, with their reports."""
    for box in frame.boxes:
        for order, report in box.above:
            if order is not None and order.other not in levels:
                yield box.level, order, report


def _text(command: str, fields: tuple[TickValue, ...]) -> str:
    values = _values(fields)
    return f"{command}{': ' if values else ''}{values}"


def _values(fields: tuple[TickValue, ...]) -> str:
    return ", ".join(f"{value.name} = {value.value}" for value in fields)


# --- values and pictures ---


def drawn_first(log: Log, displays: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the variables with a curve at first: numbers of the displays, else the first numbers that come from outside or go there."""
    known = {name for name, (_, column) in named_columns(log.levels).items() if _is_number(column)}
    shown = [name for names in displays.values() for name in names if name in known]
    return list(dict.fromkeys(shown or list(_outside(log, known))[:MOST_SERIES]))


def _is_number(column: LogColumn) -> bool:
    return column.at >= 0 and not column.members and column.c_type != "bool"


def _outside(log: Log, known: Collection[str]) -> Iterator[str]:
    """Yield the names of numbers in buffers with one end outside the levels."""
    levels = {level.name for level in log.levels}
    for wire in log.system().wires:
        ends = [end for end in (wire.source, wire.target) if end.partition(".")[0] in levels]
        if len(ends) == 1:
            yield from (
                name for name in known if name == ends[0] or name.startswith((f"{ends[0]}.", f"{ends[0]}["))
            )


def _pictures(log: Log, cell: DrawnCell | None, ordered: Sequence[_Ordered]) -> list[CellPicture]:
    """Return pictures of the cell at even distances, the last tick among them."""
    if cell is None or not log.ticks:
        return []
    apart = max(FRAMES_APART, -(-len(log.ticks) // MOST_PICTURES))
    ticks = dict.fromkeys((*log.ticks[::apart], log.last))
    return [CellPicture(tick, _caption(tick, ordered), cell.drawn(tick).svg) for tick in ticks]


def _caption(tick: int, ordered: Sequence[_Ordered]) -> str:
    begun = [(number, order) for number, order in enumerate(ordered, 1) if order.since <= tick]
    if not begun:
        return f"cycle {tick}"
    number, order = begun[-1]
    return f"cycle {tick}, order {number}: {order.level}: {order.text}"
