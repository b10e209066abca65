"""Show a table of the database to people: members by their names, lengths with their units, columns below each other.

In: the tables of `ask.tables_of`. Out: rows of text. The file itself has every digit, for programs.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from rcsc.base.diagnostics.printable import escape, pad, width
from rcsc.base.host.files.read import json_of
from rcsc_cell.database.ask import Listed

MOST_SHOWN = 100
"""Characters of a value that are shown."""
UNITS = {
    "_mm_s2": "mm/s\N{SUPERSCRIPT TWO}", "_mm_s": "mm/s", "_mm": "mm", "_deg": "\N{DEGREE SIGN}", "_n": "N",
}  # fmt: skip
"""What the end of a column's name says; a longer end goes before a shorter."""
PLATE = tuple(f"{axis}{point}" for point in range(3) for axis in "xyz")
"""Columns with the three points of the wrist plate, in mm."""
FLAGS = ("vision", "buffer")
NUMBERED = {
    "location": "locations", "toward": "locations", "origin": "locations", "vupos": "locations", "safe": "locations",
    "object": "objects",
}  # fmt: skip
"""Columns that hold a member's number, and the table that has its name."""
NOTHING = "-"

_Spell = Callable[[Any], str]


def lines_of(held: Mapping[str, Listed], table: str) -> Iterator[str]:
    """Yield the heading of a table and then its rows, without trailing blanks.

    Args:
        held: Every table.
        table: The one that is shown.

    Raises:
        KeyError: There is no such table.
    """
    listed = held[table]
    names = {which: {row[0]: row[1] for row in held[which].rows} for which in set(NUMBERED.values())}
    spellings = [_spelling(column, names) for column in listed.columns]
    rows = [[_heading(column) for column in listed.columns]]
    rows += [
        [_short(spell(value)) for spell, value in zip(spellings, row, strict=True)] for row in listed.rows
    ]
    numbers = [
        any(isinstance(value, int | float) for value in column) and listed.columns[at] not in _WORDS
        for at, column in enumerate(zip(*listed.rows, strict=True))
    ] or [False] * len(listed.columns)
    wide = [max(map(width, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (
            " " * (cells - width(text)) + text if number else pad(text, cells)
            for text, cells, number in zip(row, wide, numbers, strict=True)
        )
        yield "  ".join(cells).rstrip()


_WORDS = frozenset((*NUMBERED, *FLAGS))


def _heading(column: str) -> str:
    name, unit = _parted(column)
    return f"{name} ({unit})" if unit else name


def _parted(column: str) -> tuple[str, str]:
    """Return a column's name in words, and its unit; empty for none."""
    if column in PLATE:
        return column, "mm"
    end = next((end for end in UNITS if column.endswith(end)), "")
    return column.removesuffix(end).replace("_", " "), UNITS.get(end, "")


def _spelling(column: str, names: Mapping[str, Mapping[int, str]]) -> _Spell:
    if column in NUMBERED:
        known = names[NUMBERED[column]]
        return lambda value: NOTHING if value is None else known.get(value, f"{value}?")
    if column in FLAGS:
        return lambda value: "yes" if value else "no"
    if column in {"vise", "vblock"}:
        return _fixture
    return _value


def _value(value: Any) -> str:
    """Return a value as people read it."""
    if value is None:
        return NOTHING
    return _number(value) if isinstance(value, float) else str(value)


def _number(value: float) -> str:
    """Return a number to a hundredth; one below 10, as of a normal, to four digits behind the point."""
    digits = 2 if abs(value) >= 10 else 4
    rounded = round(value, digits)
    return f"{rounded:.{digits}f}".rstrip("0").rstrip(".") if rounded else "0"


def _fixture(text: str | None) -> str:
    """Describe a fixture by its numbers, `bed 90 x 40 x 60 mm, open 50 mm`; they were checked as the database was read."""
    if text is None:
        return NOTHING
    said = []
    for key, value in json_of(text).items():
        name, unit = _parted(key)
        numbers = value if isinstance(value, list) else [value]
        said.append(f"{name} {' x '.join(_number(float(number)) for number in numbers)} {unit}".rstrip())
    return ", ".join(said)


def _short(text: str) -> str:
    return escape(text[:MOST_SHOWN]) + ("..." if len(text) > MOST_SHOWN else "")
