"""A log for others: CSV, JSON and Parquet, pictures of values over time or over another value; and which lines the run reached.

In: a log. Out: text, bytes or a file, of pictures SVG or PNG: the same bytes for the same log and version of matplotlib. A row is a tick; a
level that did not run in it keeps its values. A number that nobody has set yet (`rcsc.run.unset`) is left empty, and a gap in a curve.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.host.files import csv_text as csv_lines
from rcsc.base.host.files import written_whole
from rcsc.run.adopt import Begun
from rcsc.run.log.queries import BadCondition, named_columns, nearest
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.schema import ROS
from rcsc.run.log.states import LogColumn, columns, plain
from rcsc.run.signature import Value, Values
from rcsc.run.unset import LevelSeen, Unsets

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = Iterator[tuple[int, Mapping[str, Values]]]


@dataclass(frozen=True, slots=True)
class Coverage:
    """How often each line of a table ran, in the table's order."""

    level: str
    table: str
    lines: Mapping[str, int]

    @property
    def never(self) -> tuple[str, ...]:
        """The lines that did not."""
        return tuple(line for line, count in self.lines.items() if count == 0)


def coverage(log: Log) -> tuple[Coverage, ...]:
    """Each table of each level, in order."""
    return tuple(table for level in log.levels for table in _coverage(level))


def _coverage(level: LoggedLevel) -> Iterator[Coverage]:
    counts: Counter[tuple[str, str]] = Counter()
    cycles = iter(level.track)
    next(cycles)  # the state that recording started from
    for _, values in cycles:
        counts.update(level.sign.lines_of(level.level, values))
    for table in level.level.every_table:
        lines = level.sign.tables.get(table, ())
        yield Coverage(level.name, table, {line: counts[table, line] for line in lines})


def rows(log: Log) -> Rows:
    """Every tick with the values of every level as of then."""
    tracks = {level.name: iter(level.track) for level in log.levels}
    coming = {name: next(track) for name, track in tracks.items()}
    held = {name: values for name, (_, values) in coming.items()}
    for tick in log.ticks:
        for name, track in tracks.items():
            if coming[name][0] < tick:
                coming[name] = next(track, (log.last + 1, ()))
            if coming[name][0] == tick:
                held[name] = coming[name][1]
        yield tick, held


def unset(log: Log) -> Iterator[Mapping[str, frozenset[int]]]:
    """Every tick's places of the leaves that nobody has set by then, by level.

    A log that begins within a run does not say what was set before: nothing is unset in it.
    """
    yield from (now for tick, now in unset_from_first(log) if tick > log.first)


def unset_from_first(log: Log) -> Iterator[tuple[int, Mapping[str, frozenset[int]]]]:
    """The same with its tick, from the state on with which the log begins."""
    system = log.system()
    since = Unsets(system.wires, {spec.name: spec for spec in system.levels})
    if log.first == 0 and not (log.finding is not None and log.finding.restarted):
        begun = (_seen(level, level.track.ticks[0]) for level in log.levels)
        since.begin(begun, partial(_published_by, log, log.first))
    yield log.first, dict(since.now)
    for tick in log.ticks:
        ran = [level for level in log.levels if level.track.ticks[max(0, level.track.place(tick))] == tick]
        for level in ran if since.now else ():
            restart = level.restarted(level.track.place(tick))
            if restart is not None and restart.begun is Begun.ANEW:
                since.restarted(_seen(level, tick, restart.values))
        since.tick((_seen(level, tick) for level in ran), partial(_published_by, log, tick))
        yield tick, dict(since.now)


def _seen(level: LoggedLevel, tick: int, values: Values | None = None) -> LevelSeen:
    held = values if values is not None else level.track.latest(tick)
    assert held is not None  # every level has a state from the start
    return LevelSeen(level.name, level.sign, level.level, held)


def _published_by(log: Log, tick: int, name: str) -> bool:
    return name in log.buffers and log.buffers[name].place(tick) >= 0


Known = Mapping[str, tuple[str, LogColumn]]
"""Columns by their whole names, with their levels."""


def valued(log: Log, known: Known) -> Iterator[tuple[int, list[Value | str | None]]]:
    """Every tick with the value of each column; None for a number that nobody has set."""
    for (tick, held), missing in zip(rows(log), unset(log), strict=True):
        yield (
            tick,
            [
                None if column.at in missing.get(level, ()) else column.read(held[level])
                for level, column in known.values()
            ],
        )


def csv_text(log: Log) -> str:
    """A heading, then a row a tick; enumerations in the table's words."""
    known = named_columns(log.levels)
    cells = (
        [tick, tick * log.tick_ms, *("" if value is None else _cell(value) for value in values)]
        for tick, values in valued(log, known)
    )
    return csv_lines(chain([["tick", "time_ms", *known]], cells))


def _cell(value: Value | str) -> Value | str:
    return ("false", "true")[value] if isinstance(value, bool) else value


def json_text(log: Log) -> str:
    """One document: what the log says of itself, then a cycle a line, with the buffers from outside."""
    about = {
        "system": log.facts["name"],
        "tick_ms": log.tick_ms,
        "complete": log.complete,
        "checked": log.checked.text,
        "programs": dict(log.programs),
        "levels": [level.name for level in log.levels],
        "restarts": [
            {"level": level.name, "tick": restart.tick, "from": restart.begun.value}
            | ({"set": dict(level.set_by_hand(restart))} if restart.by_hand else {})
            for level in log.levels
            for restart in level.restarts
        ],
    }
    known = {level.name: columns(level.sign, level.level) for level in log.levels}
    lines = (
        json.dumps(_cycle(log, known, tick, held, missing), ensure_ascii=False)
        for (tick, held), missing in zip(rows(log), unset(log), strict=True)
    )
    head = json.dumps(about, ensure_ascii=False)[:-1]
    return head + ', "cycles": [\n' + ",\n".join(lines) + "\n]}\n"


def _cycle(
    log: Log,
    known: Mapping[str, tuple[LogColumn, ...]],
    tick: int,
    held: Mapping[str, Values],
    missing: Mapping[str, frozenset[int]],
) -> dict[str, object]:
    return {
        "tick": tick,
        "time_ms": tick * log.tick_ms,
        "levels": {
            name: {
                column.name: None if column.at in missing.get(name, ()) else _json(column.read(held[name]))
                for column in several
            }
            for name, several in known.items()
        },
        "buffers": {
            name: None if (values := track.latest(tick)) is None else [plain(value) for value in values]
            for name, track in log.buffers.items()
        },
    }


def _json(value: Value | str) -> Value | str:
    return value if isinstance(value, str) else plain(value)


def write_parquet(log: Log, path: Path) -> None:
    """A column a leaf, of its own type; enumerations as dictionaries of their words.

    Raises:
        ModuleNotFoundError: pyarrow is not installed.
        OSError: The file could not be written.
    """
    import pyarrow as pa
    from pyarrow import parquet

    known = named_columns(log.levels)
    cells: dict[str, list[Value | str | None]] = {name: [] for name in known}
    ticks = []
    for tick, values in valued(log, known):
        ticks.append(tick)
        for name, value in zip(known, values, strict=True):
            cells[name].append(value)
    arrays = {"tick": pa.array(ticks, pa.int64())}
    arrays["time_ms"] = pa.array([tick * log.tick_ms for tick in ticks], pa.int64())
    for name, (_, column) in known.items():
        array = pa.array(cells[name], pa.type_for_alias(ROS.get(column.c_type, "string")))
        arrays[name] = array if column.c_type else array.dictionary_encode()
    with written_whole(path) as beside:
        parquet.write_table(pa.table(arrays), beside)


# --- pictures ---

_WIDTH_IN, _ROW_IN = 9.0, 1.6


@dataclass(frozen=True, slots=True)
class _Series:
    """One column over all ticks; members as their numbers, what is not set as NaN."""

    name: str
    column: LogColumn
    values: list[float]

    @property
    def label(self) -> str:
        """Name and unit, and whether there is nothing to be seen."""
        said = f"{self.name} ({self.column.unit})" if self.column.unit else self.name
        return f"{said}: never set" if all(map(isnan, self.values)) else said


def plot(log: Log, names: Sequence[str], path: Path, against: str | None = None) -> None:
    """Draws columns, one below the other, over time or over `against`.

    Raises:
        BadCondition: There is no such column, or it is text.
        ModuleNotFoundError: matplotlib is not installed.
        OSError: The file could not be written.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    wanted = _series(log, [*names, *([against] if against else [])])
    drawn, over = wanted[: len(names)], wanted[len(names) :]
    with mpl.rc_context({"svg.hashsalt": "rcsc", "font.size": 8.0}):
        figure = Figure(figsize=(_WIDTH_IN, _ROW_IN * len(drawn) + 0.6), layout="constrained")
        places = figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0]
        for axes, series in zip(places, drawn, strict=True):
            _draw(axes, log, series, over[0] if over else None)
        places[-1].set_xlabel(over[0].label if over else "time (s)")
        metadata = {"Date": None} if path.suffix == ".svg" else None
        with written_whole(path) as beside:
            figure.savefig(beside, metadata=metadata)


def _draw(axes: "Axes", log: Log, series: _Series, over: _Series | None) -> None:
    if over is None:
        axes.step(
            [tick * log.tick_ms / 1000 for tick in log.ticks], series.values, where="post", linewidth=1.0
        )
    else:
        axes.plot(over.values, series.values, linewidth=1.0, marker=".", markersize=3.0)
        if over.column.members:
            axes.set_xticks(range(len(over.column.members)), over.column.members, rotation=45)
    axes.set_title(series.label, loc="left")
    axes.grid(visible=True, linewidth=0.3)
    members = ("false", "true") if series.column.c_type == "bool" else series.column.members
    if members:
        seen = sorted({int(value) for value in series.values if value >= 0})
        axes.set_yticks(seen, [members[at] for at in seen])


def _series(log: Log, names: Sequence[str]) -> list[_Series]:
    known = named_columns(log.levels)
    for name in names:
        if name not in known:
            raise BadCondition(nearest(name, known))
        if not (known[name][1].members or known[name][1].c_type):
            raise BadCondition(f"`{name}` is text, which has no place on an axis")
    curves = [_Series(name, known[name][1], []) for name in names]
    for _, values in valued(log, {name: known[name] for name in dict.fromkeys(names)}):
        by_name = dict(zip(dict.fromkeys(names), values, strict=True))
        for series in curves:
            series.values.append(_number(series.column, by_name[series.name]))
    return curves


def _number(column: LogColumn, value: Value | str | None) -> float:
    if value is None:
        return nan
    if isinstance(value, str):
        return float(column.members.index(value)) if value in column.members else -1.0
    return float(value)
