"""The summary of a campaign: outcomes by fault, findings by property, lines reached.

In: records and the tables' lines. Out: a `Summary`, as text and for JSON. It hangs on the records alone, in whatever order they came;
what the clock says is added by who has one.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rcsc_cell.campaign.journal import EpisodeRecord
from rcsc_cell.campaign.rig import LineName

NOMINAL = "nominal"
_FIRST = ("done", "failed", "refused")
_WIDEST_SHOWN = 12
"""Lines of a table that are named where they were never reached."""


@dataclass(frozen=True, slots=True)
class Broken:
    """A property that did not hold: in how many episodes, and in which first."""

    property: str
    episodes: int
    first: int
    said: str


@dataclass(frozen=True, slots=True)
class LinesReached:
    """Which lines of a table ran in some episode."""

    level: str
    table: str
    ran: tuple[str, ...]
    never: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """A campaign in numbers.

    Attributes:
        by_fault: How often each outcome came, by fault class; an episode of two faults counts under both.
        ends: How often each outcome came, with its reason.
        by_level: Lines reached and lines there are, by level.
    """

    episodes: int
    cycles: int
    with_findings: int
    by_fault: Mapping[str, Mapping[str, int]]
    ends: Mapping[str, int]
    broken: tuple[Broken, ...]
    reached: tuple[LinesReached, ...]


def summary(records: Iterable[EpisodeRecord], lines: Sequence[LineName], faults: Sequence[str]) -> Summary:
    """Sums up.

    Args:
        records: In any order.
        lines: Of all tables, as `rcsc_cell.campaign.rig.known_lines` has them.
        faults: Fault classes, in the order in which they are to be shown.
    """
    sorted_ = sorted(records, key=lambda one: one.index)
    counts: dict[str, Counter[str]] = {}
    ran = 0
    for record in sorted_:
        ran |= record.lines
        for fault in record.faults or (NOMINAL,):
            counts.setdefault(fault, Counter())[record.end.partition(":")[0]] += 1
    ordered = [one for one in (NOMINAL, *faults) if one in counts]
    return Summary(
        len(sorted_),
        sum(record.ticks for record in sorted_),
        sum(bool(record.findings) for record in sorted_),
        {fault: dict(sorted(counts[fault].items())) for fault in ordered},
        dict(sorted(Counter(record.end for record in sorted_).items())),
        _broken(sorted_),
        _reached(ran, lines),
    )


def _broken(records: Iterable[EpisodeRecord]) -> tuple[Broken, ...]:
    episodes: Counter[str] = Counter()
    first: dict[str, tuple[int, str]] = {}
    for record in records:
        episodes.update({finding.property for finding in record.findings})
        for finding in record.findings:
            first.setdefault(finding.property, (record.index, finding.said))
    found = (Broken(name, count, *first[name]) for name, count in episodes.items())
    return tuple(sorted(found, key=lambda one: (-one.episodes, one.property)))


def _reached(ran: int, lines: Sequence[LineName]) -> tuple[LinesReached, ...]:
    tables: dict[tuple[str, str], tuple[list[str], list[str]]] = {}
    for at, (level, table, line) in enumerate(lines):
        did, did_not = tables.setdefault((level, table), ([], []))
        (did if ran >> at & 1 else did_not).append(line)
    return tuple(
        LinesReached(level, table, tuple(did), tuple(not_)) for (level, table), (did, not_) in tables.items()
    )


def as_text(found: Summary) -> str:
    """For people, in lines."""
    parts = [_outcomes(found), _coverage(found.reached)]
    if found.broken:
        parts.insert(1, _properties(found.broken))
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def as_json(found: Summary) -> dict[str, Any]:
    """For programs: what JSON keeps."""
    return {
        "episodes": found.episodes,
        "cycles": found.cycles,
        "episodes_with_findings": found.with_findings,
        "outcomes_by_fault": found.by_fault,
        "outcomes": found.ends,
        "findings": [
            {"property": one.property, "episodes": one.episodes, "first": one.first, "said": one.said}
            for one in found.broken
        ],
        "lines": [
            {"level": one.level, "table": one.table, "reached": one.ran, "never": one.never}
            for one in found.reached
        ],
    }


def _outcomes(found: Summary) -> list[str]:
    seen = {end for counts in found.by_fault.values() for end in counts}
    columns = [one for one in _FIRST if one in seen] + sorted(seen - set(_FIRST))
    widths = [max(len(column), 6) for column in columns]
    head = "  ".join(f"{one:>{wide}}" for one, wide in zip(columns, widths, strict=True))
    longest = max([len("fault"), *map(len, found.by_fault)])
    lines = [f"{'fault':{longest}}  {head}".rstrip()]
    for fault, counts in found.by_fault.items():
        cells = (f"{counts.get(one, 0) or '-':>{wide}}" for one, wide in zip(columns, widths, strict=True))
        lines.append(f"{fault:{longest}}  {'  '.join(cells)}")
    return lines


def _properties(broken: Iterable[Broken]) -> list[str]:
    found = list(broken)
    longest = max(len(one.property) for one in found)
    head = f"{'property that did not hold':{longest}}  episodes  first"
    longest = max(longest, len("property that did not hold"))
    return [head, *(f"{one.property:{longest}}  {one.episodes:8}  {one.first}: {one.said}" for one in found)]


def _coverage(reached: Iterable[LinesReached]) -> list[str]:
    lines = []
    by_level: dict[str, list[LinesReached]] = {}
    for one in reached:
        by_level.setdefault(one.level, []).append(one)
    for level, tables in by_level.items():
        ran, all_ = (
            sum(len(table.ran) for table in tables),
            sum(len(table.ran) + len(table.never) for table in tables),
        )
        lines.append(f"level {level}: {ran} of {all_} lines reached")
        lines += [f"  {table.table} never: {_named(table.never)}" for table in tables if table.never]
    return lines


def _named(never: Sequence[str]) -> str:
    more = len(never) - _WIDEST_SHOWN
    return ", ".join(never[:_WIDEST_SHOWN]) + (f" and {more} more" if more > 0 else "")
