"""A log as a table for other programs: CSV, JSON and Parquet; and which lines the run reached.

In: a log. Out: text, bytes or a file. A row is a tick; a level that did not run in it keeps its values. A number that nobody has
set yet (`rcsc.run.unset`) is left empty.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

from rcsc.base.host.files import csv_text as csv_lines
from rcsc.base.host.files import written_whole
from rcsc.run.adopt import Begun
from rcsc.run.log.queries import named_columns
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.schema import ROS
from rcsc.run.log.states import LogColumn, columns, plain
from rcsc.run.signature import Value, Values
from rcsc.run.unset import LevelSeen, Unsets

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
