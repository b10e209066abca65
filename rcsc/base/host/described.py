"""TOML files that describe something: read whole, checked against what may stand there, every fault with its line.

In: a file, and a `Kind` that says what it may hold. Out: a `Document`, whose `faults` are all that is wrong; `BadFile` carries them on
as diagnostics. `tomllib` says what the file means but not where; a second scan finds the places, and takes for
granted that the text is TOML. Source: TOML 1.0.0 (toml.io), of which only the structure is scanned.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any, TypeAlias, assert_never

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.base.host.files import read
from rcsc.base.host.files.names import MOST_FILE_CHARACTERS, is_file_name, is_identifier, is_member

KeyPath: TypeAlias = tuple[str | int, ...]

_MOST_NAMES = 1000
"""Names of a folder that are looked at for one that is near."""
MOST_FAULTS = 100
"""Faults shown of one file; the last says how many more there are."""


class BadFile(CodedError):  # noqa: N818  # what happened, not an error of ours
    """A description with faults.

    Attributes:
        diagnostics: Everything that is wrong, in order of place; where it is empty, the text says what is.
        sources: The texts that these point into.
    """

    def __init__(
        self,
        text: str = "",
        diagnostics: Sequence[Diagnostic] = (),
        sources: Mapping[str, Source] | None = None,
    ) -> None:
        self.diagnostics, self.sources = tuple(diagnostics), dict(sources or {})
        if self.diagnostics:
            self.code = self.diagnostics[0].code
        super().__init__(text or "; ".join(self._line(diagnostic) for diagnostic in diagnostics))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pass it as it is from one process to another: classes below take other arguments."""
        return type(self).__new__, (type(self), *self.args), self.__dict__

    def _line(self, diagnostic: Diagnostic) -> str:
        span = diagnostic.primary.span
        source = self.sources.get(span.file)
        where = f"{span.file}:{source.position(span.start).line}" if source else span.file
        return f"{where}: {diagnostic.message}"


# --- what may stand where ---


@dataclass(frozen=True, slots=True)
class Number:
    """A finite number, `low` and `high` included."""

    low: float = -1e6
    high: float = 1e6
    whole: bool = False

    @property
    def shown(self) -> str:
        """What it must be."""
        return f"a {'whole ' if self.whole else ''}number from {self.low:.12g} to {self.high:.12g}"


@dataclass(frozen=True, slots=True)
class Text:
    """A text that is not empty."""

    shown = "a text in quotes, not empty"


@dataclass(frozen=True, slots=True)
class FileName:
    """A name that may stand in the name of a file: it leads to no other folder."""

    shown = f"a name of at most {MOST_FILE_CHARACTERS} letters, digits, `_`, `-` and `.`, not beginning with `.` or `-`"


@dataclass(frozen=True, slots=True)
class Word:
    """A name of a level, a program or a variable: what C and Python can call a thing."""

    shown = "a name of letters, digits and `_`, not beginning with a digit"


@dataclass(frozen=True, slots=True)
class Member:
    """A place in a level or in a record: `robot.plate[1]`."""

    shown = "names joined by `.`, with numbers in `[]`"


@dataclass(frozen=True, slots=True)
class Flag:
    """True or false."""

    shown = "`true` or `false`"


@dataclass(frozen=True, slots=True)
class Listing:
    """An array whose elements are alike."""

    of: "Kind"
    least: int = 0
    most: int = 10_000

    @property
    def shown(self) -> str:
        """What it must be."""
        many = f"{self.least}" if self.least == self.most else f"at least {self.least}" if self.least else "any number of"  # fmt: skip
        return f"a list of {many} elements"


@dataclass(frozen=True, slots=True)
class Entries:
    """A table with names of the user's; each holds the same kind."""

    of: "Kind"
    least: int = 0

    @property
    def shown(self) -> str:
        """What it must be."""
        return "a table" + (f" of at least {self.least}" if self.least else "")


@dataclass(frozen=True, slots=True)
class Record:
    """A table with these keys: the first must be there, the others may."""

    needed: Mapping[str, "Kind"]
    others: Mapping[str, "Kind"] = field(default_factory=dict)

    shown = "a table"


@dataclass(frozen=True, slots=True)
class Anything:
    """Whatever stands there; somebody else looks at it."""

    shown = "a value"


@dataclass(frozen=True, slots=True)
class Either:
    """One of several kinds, told apart by what is written."""

    kinds: tuple["Kind", ...]

    @property
    def shown(self) -> str:
        """What it must be."""
        return ", or ".join(kind.shown for kind in self.kinds)


Kind: TypeAlias = (
    Number | Text | FileName | Word | Member | Flag | Anything | Listing | Entries | Record | Either
)


_DOTTED_KEY = re.compile(r"[\w-]+(?:\.[\w-]+)+(?=\s*=)")
"""A key of several parts before a value."""


def shown_path(path: KeyPath) -> str:
    """Return a key path as a user would write it; elements of lists count from 1."""
    text = ""
    for part in path:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def nearest(name: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return a help that names the nearest of `names`; none where nothing is near."""
    near = get_close_matches(name, names, n=1, cutoff=0.6)
    return tuple(f"did you mean `{word}`?" for word in near)


def near_path(path: Path) -> tuple[str, ...]:
    """Return a help that names what stands in the folder of a path that is not there, and is called much like it; none where nothing is."""
    try:
        names = sorted(os.listdir(path.parent))
    except (OSError, ValueError):
        return ()
    known = [name for name in names[:_MOST_NAMES] if name.isprintable() and name != path.name]
    before = "" if path.parent == Path() else f"{path.parent}{os.sep}"
    return tuple(said.replace("`", f"`{before}", 1) for said in nearest(path.name, known))


# --- the document ---


@dataclass(slots=True)
class Document:
    """A file that has been read.

    Attributes:
        name: As the user gave it.
        value: What it says.
        code: The code of its faults.
        faults: What is wrong with it, so far.
    """

    name: str
    source: Source
    value: dict[str, Any]
    code: Code
    faults: list[Diagnostic] = field(default_factory=list)
    _places: dict[KeyPath, tuple[int, int]] | None = None

    def wrong(self, path: KeyPath, message: str, *helps: str) -> None:
        """Note a fault of what stands at `path`, or would stand there."""
        self.faults.append(Diagnostic(self.code, message, Label(self.span(path)), help=helps))

    def span(self, path: KeyPath) -> Span:
        """Return the place of `path`; where it is not there, that of the value that would hold it."""
        if self._places is None:
            self._places = _Scan(self.source.text).places
        for end in range(len(path), 0, -1):
            place = self._places.get(path[:end])
            if place is not None:
                return Span(self.name, *place)
        return Span(self.name, 0, 0)

    def check(self, kind: Kind) -> None:
        """Note everything in the file that is not as `kind` says."""
        self.check_part(kind, self.value, ())

    def check_part(self, kind: Kind, value: object, path: KeyPath) -> None:
        """Note everything that is not as `kind` says in a value that stands at `path`."""
        if not fits(kind, value):
            what = f"`{shown_path(path)}` must be {kind.shown}" if path else f"the file must be {kind.shown}"
            self.wrong(path, f"{what}, not {_short(value)}", *self._dotted(path, value))
            return
        for key, inner, of in self._parts(kind, value, path):
            self.check_part(of, inner, (*path, key))

    def _dotted(self, path: KeyPath, value: object) -> tuple[str, ...]:
        """Return a help where a key without quotes is taken apart at its dots."""
        said = self.source.slice(self.span(path)) if isinstance(value, dict) and path else ""
        key = _DOTTED_KEY.match(said)
        return () if key is None else (f'a key with a dot stands in quotes: `"{key[0]}" = ...`',)

    def holds(self, kind: Record) -> bool:
        """Return whether the keys of a record are there as it declares, whatever else is."""
        keys = {**kind.needed, **kind.others}
        page = replace(
            self, faults=[], value={key: value for key, value in self.value.items() if key in keys}
        )
        page.check(kind)
        return not page.faults

    def bad(self, error: type[BadFile]) -> BadFile:
        """Return the faults as an exception."""
        faults = sorted(dict.fromkeys(self.faults), key=lambda fault: fault.primary.span.start)
        more = len(faults) - MOST_FAULTS
        if more > 0:
            last = Diagnostic(self.code, f"and {more} faults more", Label(faults[MOST_FAULTS].primary.span))
            faults = [*faults[:MOST_FAULTS], last]
        return error(diagnostics=faults, sources={self.name: self.source})

    def _parts(self, kind: Kind, value: Any, path: KeyPath) -> Iterator[tuple[str | int, object, Kind]]:
        """Yield each part of a value that fits, by key or position, and the kind it must be."""
        match kind:
            case Listing(of):
                yield from ((at, item, of) for at, item in enumerate(value))
            case Entries(of):
                yield from ((name, item, of) for name, item in value.items())
            case Record(needed, others):
                every = {**needed, **others}
                for key in value.keys() - every.keys():
                    self.wrong((*path, key), f"`{shown_path((*path, key))}` means nothing here", *nearest(key, sorted(every)))  # fmt: skip
                for key in needed.keys() - value.keys():
                    where = f"`{shown_path(path)}`" if path else "the file"
                    self.wrong(path, f"{where} lacks `{key}`: {needed[key].shown}")
                yield from ((key, value[key], every[key]) for key in value.keys() & every.keys())
            case Either(kinds):
                yield from self._parts(next(option for option in kinds if fits(option, value)), value, path)
            case Number() | Text() | FileName() | Word() | Member() | Flag() | Anything():
                return
            case _:
                assert_never(kind)


def fits(kind: Kind, value: Any) -> bool:
    """Return whether a value, without its parts, is of a kind."""
    match kind:
        case Number(low, high, whole):
            number = isinstance(value, int if whole else int | float) and not isinstance(value, bool)
            return number and (isinstance(value, int) or isfinite(value)) and low <= value <= high
        case Text():
            return isinstance(value, str) and bool(value.strip())
        case FileName():
            return is_file_name(value)
        case Word():
            return is_identifier(value)
        case Member():
            return is_member(value)
        case Flag():
            return isinstance(value, bool)
        case Anything():
            return True
        case Listing(_, least, most):
            return isinstance(value, list) and least <= len(value) <= most
        case Entries(_, least):
            return isinstance(value, dict) and least <= len(value)
        case Record():
            return isinstance(value, dict)
        case Either(kinds):
            return any(fits(option, value) for option in kinds)
        case _:
            assert_never(kind)


def _short(value: object) -> str:
    """Return the value as a message shows it."""
    match value:
        case bool():
            return f"`{str(value).lower()}`"
        case dict():
            return "a table"
        case list():
            return f"a list of {len(value)}"
        case str():
            return f'"{value[:40]}"' if len(value) <= 40 else f'"{value[:40]}..."'
        case int() if abs(value) >= 10**18:
            return "a number of more than 18 digits"
        case _:
            return f"`{value}`"


def read_document(path: Path, code: Code, error: type[BadFile]) -> Document:
    """Read a TOML file.

    Args:
        path: Where it is.
        code: The code of its faults.
        error: The exception that it raises.

    Raises:
        BadFile: It cannot be read, is too large or is not TOML; its class is `error`.
    """
    name = str(path)
    try:
        text = read.text(path, read.MOST_TOML_BYTES)
    except (OSError, read.Malformed) as problem:
        why = f"cannot be read: {problem.strerror}" if isinstance(problem, OSError) else problem
        fault = Diagnostic(code, f"the file {why}", Label(Span(name, 0, 0)))
        raise error(diagnostics=(fault,)) from problem
    source = Source(name, text)
    try:
        return Document(name, source, read.toml_of(text), code)
    except read.Malformed as problem:
        at, helps = (problem.at, problem.helps) if isinstance(problem, read.NotToml) else (0, ())
        fault = Diagnostic(code, f"the file {problem}", Label(Span(name, at, at)), help=helps)
        raise error(diagnostics=(fault,), sources={name: source}) from problem


class _Scan:
    """Places of keys and elements in a text that is TOML.

    Attributes:
        places: First and last offset of each key, or of each element of a list, by its path.
    """

    def __init__(self, text: str) -> None:
        self.places: dict[KeyPath, tuple[int, int]] = {}
        self._text, self._at = text, 0
        self._counts: dict[KeyPath, int] = {}
        table: KeyPath = ()
        while self._skip("\n\r"):
            if self._text.startswith("[", self._at):
                table = self._header()
            else:
                self._pair(table)

    def _skip(self, also: str = "") -> bool:
        """Go past blanks and comments; whether anything comes."""
        while self._at < len(self._text):
            char = self._text[self._at]
            if char == "#":
                end = self._text.find("\n", self._at)
                self._at = len(self._text) if end < 0 else end
            elif char in " \t" or char in also:
                self._at += 1
            else:
                return True
        return False

    def _header(self) -> KeyPath:
        """`[a.b]` or `[[a.b]]`: the path of the table that begins."""
        begin, twice = self._at, self._text.startswith("[[", self._at)
        self._at += 1 + twice
        parts = self._key()
        self._at = self._text.index("]", self._at) + 1 + twice
        path: KeyPath = ()
        for at, part in enumerate(parts):
            path = (*path, part)
            self.places.setdefault(path, (begin, self._at))
            if twice and at == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
            if path in self._counts:
                path = (*path, self._counts[path])
                self.places.setdefault(path, (begin, self._at))
        self.places.setdefault(path, (begin, self._at))
        return path

    def _key(self) -> tuple[str, ...]:
        """Return a key, dotted or not, up to the sign after it."""
        parts: list[str] = []
        while True:
            self._skip()
            begin = self._at
            if self._text[begin] in "'\"":
                self._string()
                parts.append(str(read.toml_of(f"x = {self._text[begin : self._at]}")["x"]))
            else:
                while self._text[self._at].isalnum() or self._text[self._at] in "_-":
                    self._at += 1
                parts.append(self._text[begin : self._at])
            self._skip()
            if self._text[self._at] != ".":
                return tuple(parts)
            self._at += 1

    def _pair(self, table: KeyPath) -> None:
        """`key = value`, in a table."""
        begin = self._at
        key = self._key()
        self._at += 1  # the equals sign
        path = (*table, *key)
        self._skip()
        self._value(path)
        for end in range(len(table) + 1, len(path) + 1):
            self.places.setdefault(path[:end], (begin, self._at))

    def _value(self, path: KeyPath) -> None:
        char = self._text[self._at]
        if char == "[":
            self._listing(path)
        elif char == "{":
            self._at += 1
            while self._skip("\n\r,") and self._text[self._at] != "}":
                self._pair(path)
            self._at += 1
        elif char in "'\"":
            self._string()
        else:
            while self._at < len(self._text) and self._text[self._at] not in ",]}#\n\r":
                self._at += 1
            while self._text[self._at - 1] in " \t":
                self._at -= 1

    def _listing(self, path: KeyPath) -> None:
        self._at += 1
        count = 0
        while self._skip("\n\r,") and self._text[self._at] != "]":
            begin = self._at
            self._value((*path, count))
            self.places[(*path, count)] = (begin, self._at)
            count += 1
        self._at += 1

    def _string(self) -> None:
        """Go past a string of any of the four sorts."""
        quote = self._text[self._at]
        many = 3 if self._text.startswith(quote * 3, self._at) else 1
        self._at += many
        while not self._text.startswith(quote * many, self._at):
            self._at += 2 if quote == '"' and self._text[self._at] == "\\" else 1
        self._at += many
        while many == 3 and self._text.startswith(quote, self._at):  # quotes that the string ends with
            self._at += 1
