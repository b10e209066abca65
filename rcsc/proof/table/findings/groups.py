"""Overlaps that come of the same cells, told together.

In: overlaps of a table, and the diagnostic of each. Out: the diagnostics; of a group the first names the others in a note, and these are
left out of a text.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace

from rcsc.base.diagnostics.diagnostic import Diagnostic, sort_key
from rcsc.lang.model import Table
from rcsc.proof.table.verdict import Overlap


def grouped(table: Table, overlaps: Sequence[Overlap], shown: Sequence[Diagnostic]) -> list[Diagnostic]:
    """Return the overlaps with related ones grouped: the first of each group names the others in a note."""
    groups: dict[object, list[int]] = {}
    for at, (overlap, diagnostic) in enumerate(zip(overlaps, shown, strict=False)):
        cells = _apart_in(table, overlap)
        same = diagnostic.effects is not None and diagnostic.effects.same
        groups.setdefault((cells, same) if cells else at, []).append(at)
    told = list(shown)
    for members in groups.values():
        first, *others = sorted(members, key=lambda at: sort_key(shown[at]))
        if others:
            note = _alike_as(table, [overlaps[at] for at in members], overlaps[first])
            told[first] = replace(shown[first], notes=(*shown[first].notes, note))
        for at in others:
            told[at] = replace(shown[at], told_with=True)
    return told


def _apart_in(table: Table, overlap: Overlap) -> frozenset[tuple[str, str]]:
    """Return the cells of two lines in columns that just one of them fills: the cells that let both match."""
    pair = table.lines[overlap.first], table.lines[overlap.second]
    cells = zip(table.columns, *(line.tests for line in pair), strict=True)
    return frozenset(
        (column.heading, test.text)
        for column, one, other in cells
        for test in (one, other)
        if test is not None and (one is None or other is None)
    )


def _alike_as(table: Table, overlaps: Sequence[Overlap], first: Overlap) -> str:
    """Name the other pairs of a group, by the line that most of them share."""
    pairs = [(each.first, each.second) for each in overlaps if each != first]
    often = Counter(line for pair in [(first.first, first.second), *pairs] for line in pair)
    by_line: dict[int, list[str]] = {}
    for pair in pairs:
        most = max(pair, key=lambda line: (often[line], -line))
        other = pair[1] if most == pair[0] else pair[0]
        by_line.setdefault(most, []).append(str(table.lines[other].name))
    named = "; ".join(
        f"`{table.lines[most].name}` with {names_of(others)}" for most, others in by_line.items()
    )
    cells = ", ".join(_said_under(heading, text) for heading, text in sorted(_apart_in(table, first)))
    many = f"{len(pairs)} more pairs overlap" if len(pairs) > 1 else "1 more pair overlaps"
    return f"{many} where {cells}: {named}; --json lists each"


def _said_under(heading: str, text: str) -> str:
    """Spell a cell with its heading: `called = abort`, `now in cleared`."""
    if heading == "when":
        return text
    plain = re.match(r"[\w.]+$|-\d", text) is not None
    return f"{heading} = {text}" if plain else f"{heading} {text}"


def names_of(names: Iterable[str]) -> str:
    """Spell names for a message: `a`, `b`."""
    return ", ".join(f"`{name}`" for name in names)
