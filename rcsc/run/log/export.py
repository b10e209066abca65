"""A log as a table for other programs: CSV, JSON and Parquet; and which lines the run reached.

In: a log. Out: text, bytes or a file. A row is a tick; a level that did not run in it keeps its values.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from rcsc.host.files import csv_text as csv_lines
from rcsc.host.files import written_whole
from rcsc.run.log.queries import named_columns
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.log.states import LogColumn, columns, line_of, plain
from rcsc.run.signature import Value, Values

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
        counts[level.sign.table_of(level.level, values), line_of(level.sign, level.level, values)] += 1
        counts.update(level.sign.lines_before(level.level, values))
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


def csv_text(log: Log) -> str:
    """A heading, then a row a tick; enumerations in the table's words."""
    known = named_columns(log)
    cells = (
        [tick, tick * log.tick_ms, *(_cell(column.read(held[level])) for level, column in known.values())]
        for tick, held in rows(log)
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
            for level in log.levels
            for restart in level.restarts
        ],
    }
    known = {level.name: columns(level.sign, level.level) for level in log.levels}
    lines = (json.dumps(_cycle(log, known, tick, held), ensure_ascii=False) for tick, held in rows(log))
    head = json.dumps(about, ensure_ascii=False)[:-1]
    return head + ', "cycles": [\n' + ",\n".join(lines) + "\n]}\n"


def _cycle(
    log: Log, known: Mapping[str, tuple[LogColumn, ...]], tick: int, held: Mapping[str, Values]
) -> dict[str, object]:
    return {
        "tick": tick,
        "time_ms": tick * log.tick_ms,
        "levels": {
            name: {column.name: _json(column.read(held[name])) for column in several}
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

    known = named_columns(log)
    cells: dict[str, list[Value | str]] = {name: [] for name in known}
    ticks = []
    for tick, held in rows(log):
        ticks.append(tick)
        for name, (level, column) in known.items():
            cells[name].append(column.read(held[level]))
    arrays = {"tick": pa.array(ticks, pa.int64())}
    arrays["time_ms"] = pa.array([tick * log.tick_ms for tick in ticks], pa.int64())
    for name, (_, column) in known.items():
        array = pa.array(cells[name], getattr(pa, _ARROW.get(column.c_type, "string"))())
        arrays[name] = array if column.c_type else array.dictionary_encode()
    with written_whole(path) as beside:
        parquet.write_table(pa.table(arrays), beside)


_ARROW = {
    "bool": "bool_", "uint8_t": "uint8", "int8_t": "int8", "uint16_t": "uint16", "int16_t": "int16",
    "uint32_t": "uint32", "int32_t": "int32", "uint64_t": "uint64", "int64_t": "int64", "double": "float64", "float": "float32",
}  # fmt: skip
