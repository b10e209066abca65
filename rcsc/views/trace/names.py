"""The data dictionary: each variable of a system's levels, what it is, where it comes from and who uses it.

In: programs, and the description of the system that they are levels of. Out: a `NamedVariable` each, as text, CSV, JSON and a page.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from itertools import groupby
from typing import Any

from rcsc import __version__
from rcsc.base.host.files import csv_text
from rcsc.lang.expressions.operators import kind_word
from rcsc.lang.leaves import Uses
from rcsc.lang.model import (
    Array,
    Declared,
    Enum,
    Int,
    Kind,
    Program,
    Real,
    Record,
    Variable,
    spell,
    unit_text,
)
from rcsc.lang.restart import Adopted, After, Fixed, SameAs, Stands
from rcsc.run.description import Description
from rcsc.views.pages.documents import framed, listing, row, tabled

FORM = 1
"""Version of the JSON form; it rises when a member changes its meaning or goes away."""
HEADINGS = (
    "level", "name", "kind", "type", "lowest", "highest", "members", "unit", "initial", "restart", "meaning", "from", "to", "written by",
    "read by", "requirements", "place",
)  # fmt: skip
_ABOUT = (
    "Each variable of each level: its kind, type, unit and range, its value at first and after a restart, its meaning, the buffer that "
    "brings it or takes it, and who writes and reads it."
)


@dataclass(frozen=True, slots=True)
class NamedVariable:
    """A variable of a level, in words.

    Attributes:
        level: The level, or the program where it is none.
        kind: `input`, `state` or `output`.
        lowest, highest: Its range; empty for words, whose values are `members`, and for truth values.
        restart: Its value when the level starts anew; its initial one, where nothing else is declared.
        comes_from: Other ends of buffers and queries of the database that fill it; only of inputs.
        goes_to: The other ends of buffers that take it.
        written_by, read_by: Tables with their lines, procedures and claims.
        requirements: Of all that writes or reads it.
        place: File and line of its declaration.
    """

    level: str
    name: str
    kind: str
    type: str
    lowest: str
    highest: str
    members: tuple[str, ...]
    unit: str
    initial: str
    restart: str
    meaning: str
    comes_from: tuple[str, ...]
    goes_to: tuple[str, ...]
    written_by: tuple[str, ...]
    read_by: tuple[str, ...]
    requirements: tuple[str, ...]
    place: str

    @property
    def range(self) -> str:
        """Its type with its range or members, and its unit."""
        within = f" {self.lowest} .. {self.highest}" if self.lowest else ""
        among = f" of {', '.join(self.members)}" if self.members else ""
        return f"{self.type}{within}{among}{f' {self.unit}' if self.unit else ''}"

    def speaks_of(self, word: str) -> bool:
        """Return whether a word stands in its name, meaning, type or members; capitals do not matter."""
        return any(
            word.lower() in text.lower() for text in (self.name, self.meaning, self.type, *self.members)
        )


def named(
    program: Program, places: Mapping[str, str], system: Description | None = None
) -> Iterator[NamedVariable]:
    """Yield the variables of a program as they are declared; not those that the compiler makes for `was`, `for` and the like.

    Args:
        program: A level of the system, or any program.
        places: File and line of each declaration, by the name of the variable.
        system: The system, for its buffers and queries.
    """
    uses, level = Uses(program), _level(program, system)
    declared, adopted = {leaf: one for one in program.declared for leaf in one.leaves}, program.adopted
    for variable in program.variables:
        if not (variable.previous_of or variable.line_of or variable.counts is not None):
            meaning = _meaning(declared.get(variable.name), variable)
            restart = _restart(variable, adopted.get(str(variable.name)))
            yield _named(variable, meaning, restart, uses, level, places, system)


def _level(program: Program, system: Description | None) -> str:
    """Return the name of the level that runs the program; where there is none, the program's."""
    by_program = {spec.program: spec.name for spec in system.levels} if system is not None else {}
    return by_program.get(program.name, program.levels[0].name if program.levels else program.name)


def _named(
    variable: Variable, meaning: str, restart: str, uses: Uses, level: str, places: Mapping[str, str], system: Description | None
) -> NamedVariable:  # fmt: skip
    kind, name = variable.type, variable.name
    low, high = (spell(kind, kind.low), spell(kind, kind.high)) if isinstance(kind, Int | Real) else ("", "")
    comes_from, goes_to = _buffers(system, level, name)
    return NamedVariable(
        level=level, name=str(name), kind=variable.kind.value, type=kind_word(kind).strip("`"), lowest=low, highest=high,
        members=kind.members if isinstance(kind, Enum) else (), unit=unit_text(kind.unit) if isinstance(kind, Int | Real) else "",
        initial=spell(kind, variable.initial), restart=restart, meaning=meaning,
        comes_from=comes_from, goes_to=goes_to, written_by=_listed(uses.written.get(name, {})), read_by=_listed(uses.read.get(name, {})),
        requirements=tuple(uses.requirements.get(name, ())), place=places.get(str(name), ""),
    )  # fmt: skip


def _meaning(declared: Declared | None, variable: Variable) -> str:
    """Return what is written about a variable: of a record's field its own words, where it has some."""
    meaning, kind = variable.doc, declared.type if declared is not None else variable.type
    for part in re.findall(r"\w+", str(variable.name))[1:]:
        if isinstance(kind, Array):
            kind = kind.element
        elif isinstance(kind, Record):
            field = next((field for field in kind.fields if field.name == part), None)
            if field is None:
                break  # the pending value of a deferred variable
            kind, meaning = field.type, field.doc or meaning
    return " ".join(meaning.split())


def _restart(variable: Variable, adopted: Adopted | None) -> str:
    """Return what a variable has when its level starts anew; an input has what its buffer brings."""
    if variable.kind is Kind.INPUT:
        return ""
    match adopted:
        case Fixed(value):
            return spell(variable.type, value)
        case SameAs(leaf):
            return f"as {leaf}"
        case After():
            return "one after the number in its buffer"
        case Stands():
            return "as its buffer has it"
        case _:
            return spell(variable.type, variable.initial if variable.restart is None else variable.restart)


def _buffers(system: Description | None, level: str, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return who fills a variable from outside, and who takes it; a buffer of a record carries its fields."""
    if system is None:
        return (), ()

    full = f"{level}.{name}"

    def holds(whole: str) -> bool:
        return full == whole or full.startswith((f"{whole}.", f"{whole}["))

    feeds = [(spec.name, feed) for spec in system.levels for feed in spec.feeds]
    brought = [wire.source for wire in system.wires if holds(wire.target)]
    brought += [f"database {feed.query}" for owner, feed in feeds if holds(f"{owner}.{feed.into}")]
    return tuple(brought), tuple(wire.target for wire in system.wires if holds(wire.source))


def _listed(users: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    return tuple(f"{name}: {', '.join(lines)}" if lines else name for name, lines in users.items())


# --- forms -----------------------------------------------------------------------------------


def names_text(variables: Sequence[NamedVariable]) -> str:
    """Return the dictionary for a terminal: of each variable its declaration, then what is known of it, a line each."""
    lines: list[str] = []
    for level, own in groupby(variables, key=lambda one: one.level):
        found = list(own)
        lines += [
            f"level {level}: {len(found)} variables",
            *(text for one in found for text in _paragraph(one)),
            "",
        ]
    return "\n".join(lines)


def _paragraph(one: NamedVariable) -> Iterator[str]:
    again = f", after a restart {one.restart}" if one.restart not in {"", one.initial} else ""
    yield f"  {one.name}   {one.kind} {one.range}, at first {one.initial}{again}"
    for word, told in (
        ("", (one.meaning,) if one.meaning else ()), ("from ", one.comes_from), ("to ", one.goes_to), ("written by ", one.written_by),
        ("read by ", one.read_by), ("for ", one.requirements),
    ):  # fmt: skip
        if told:
            yield f"      {word}{'; '.join(told)}"


def _cells(one: NamedVariable) -> list[str]:
    """Return a variable's cells under `HEADINGS`."""
    return ["; ".join(cell) if isinstance(cell, tuple) else cell for cell in asdict(one).values()]


def names_csv(variables: Iterable[NamedVariable]) -> str:
    """Return a row for each variable."""
    return csv_text([HEADINGS, *map(_cells, variables)])


def names_json(variables: Iterable[NamedVariable]) -> dict[str, Any]:
    """Return the dictionary as a JSON value."""
    return {
        "form": FORM,
        "tool": {"name": "rcsc", "version": __version__},
        "command": "names",
        "variables": [asdict(one) for one in variables],
    }


_WIDTHS = {
    "name": 14, "kind": 5, "type, range, unit": 14, "at first": 6, "after a restart": 7, "meaning": 16, "from, to": 10, "written by": 12,
    "read by": 12, "for": 4,
}  # fmt: skip


def names_page(title: str, variables: Sequence[NamedVariable]) -> str:
    """Return the dictionary as a page that needs no other file."""
    body = [f"<h1>{escape(title)}</h1>", f"<p>{_ABOUT}</p>"]
    for level, own in groupby(variables, key=lambda one: one.level):
        body += [f'<h2 id="{escape(level)}">{escape(level)}</h2>', tabled(_WIDTHS, map(_row, own))]
    return framed(title, body)


def _row(one: NamedVariable) -> str:
    ends = (*(f"from {end}" for end in one.comes_from), *(f"to {end}" for end in one.goes_to))
    plain = (one.kind, one.range, one.initial, one.restart, one.meaning)
    name = f'<code title="{escape(one.place)}">{escape(one.name)}</code>'
    return row(
        name, *map(escape, plain), *map(listing, (ends, one.written_by, one.read_by, one.requirements))
    )
