"""Text from outside, read within bounds: JSON, TOML, XML and CSV, and their values as what they must be.

In: files, or texts that travelled in one. Out: values, or `Malformed`, which says what is wrong. Sizes are bounded before anything is read,
nesting before anything is parsed, so that no text makes a parser recurse or reserve what it does not hold.
"""

import csv
import io
import json
import os
import re
import stat
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, BinaryIO

from rcsc.base.host.files.names import BadName, identifier, line_name, member, shown

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MIB = 1024 * 1024
MOST_BYTES = 64 * MIB
"""Of a file that is read whole, where nobody says otherwise."""
MOST_TOML_BYTES = 4 * MIB
MOST_OF_OURS = 4096 * MIB
"""Of a file that rcsc, or a program that it started, made just now."""
LONGEST_LINE = 64 * 1024
"""Bytes of a line of what is read line by line."""
DEEPEST = 200
"""Levels of nesting of JSON; Python's own parser gives up at about 900."""
DEEPEST_TOML = 32
DEEPEST_XML = 64

_JSON = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"|[\[{\]}"]', re.DOTALL)
_TOML = re.compile(
    r"""(?P<text>'''.*?'''|\"\"\"(?:[^"\\]++|\\.|"(?!""))*+\"{3,5}|"[^"\\\n]*+(?:\\.[^"\\\n]*+)*+"|'[^'\n]*+'|\#[^\n]*+)"""
    r"""|(?P<mark>[\[{\]}"'])""",
    re.DOTALL,
)
_DOTTED = re.compile(rf"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){{{DEEPEST_TOML},}}")
UNPRINTED = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters but tab and ends of lines, overrides of writing direction, and halves of characters."""


_UNQUOTED = re.compile(r"[A-Za-z_./][^\x00-\x1f\x7f-\x9f,\]}#\"'=]*")
"""What may be meant for a text, or for a truth value, where TOML has a value."""
MOST_ROW = 60
"""Characters of a row of TOML in a message."""


class Malformed(ValueError):  # noqa: N818  # what happened, not an error of ours
    """A text from outside is not what it must be; says why."""


class NotToml(Malformed):
    """A text is not TOML.

    Attributes:
        at: The offset of the place where it goes wrong.
        helps: Help texts.
    """

    def __init__(self, message: str, at: int, *helps: str) -> None:
        super().__init__(message)
        self.at, self.helps = at, helps


class TooLarge(Malformed):
    """It has more bytes than it may have."""


# --- files ---------------------------------------------------------------------------------


def content(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a regular file of bounded size; a pipe or a device might never end.

    Raises:
        OSError: It cannot be read.
        Malformed: It is no regular file, or is too large.
    """
    with opened(path) as file:
        if os.fstat(file.fileno()).st_size > most:
            raise TooLarge(f"has more than {_size(most)}")
        return piped(file, most)


def opened(path: Path) -> BinaryIO:
    """Return a regular file, open for reading; a pipe is not waited for.

    Raises:
        OSError: It cannot be read.
        Malformed: It is no regular file.
    """
    file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))  # noqa: SIM115  # the caller's
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise Malformed("is not a regular file")
    return file


def beginning(path: Path, most: int) -> bytes:
    """Return the first bytes of a regular file, `most` of them at most.

    Raises:
        OSError: It cannot be read.
        Malformed: It is no regular file.
    """
    with opened(path) as file:
        return file.read(most)


def _size(count: int) -> str:
    return f"{count // MIB} MiB" if count >= MIB else f"{count} bytes"


def text(path: Path, most: int = MOST_BYTES) -> str:
    """Return the text of a regular file of bounded size.

    Raises:
        OSError: It cannot be read.
        Malformed: It is no regular file, too large, or not UTF-8.
    """
    return decoded(content(path, most))


def piped(file: IO[bytes], most: int = MOST_BYTES) -> bytes:
    """Return what comes through a pipe, up to a size.

    Raises:
        Malformed: There is more.
    """
    received = file.read(most + 1)
    if len(received) > most:
        raise TooLarge(f"has more than {_size(most)}")
    return received


def standard_input() -> BinaryIO:
    """Return the standard input; one without anything in it where the process was started without."""
    if sys.stdin is None:
        return io.BytesIO()
    if isinstance(sys.stdin, io.StringIO):  # who calls a command within Python gives it a text
        return io.BytesIO(sys.stdin.read().encode())
    return sys.stdin.buffer


def typed() -> bool:
    """Return whether a person types and reads: standard input and output are a terminal."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stdout))


def lines_of(file: IO[bytes], longest: int = LONGEST_LINE) -> Iterator[str]:
    """Give each line of a text when it is there, without its end; a line is bounded, the text is not.

    Raises:
        Malformed: A line is longer, or not UTF-8; the message names it.
    """
    number = 0
    while line := file.readline(longest + 1):
        number += 1
        if len(line) > longest:
            raise TooLarge(f"has a line {number} of more than {_size(longest)}")
        try:
            yield line.decode("utf-8-sig" if number == 1 else "utf-8").rstrip("\r\n")
        except UnicodeDecodeError as error:
            raise Malformed(f"is not UTF-8 in line {number}, at byte {error.start}") from error


def plain(text: str) -> str:
    """Return a text without characters that a terminal would obey.

    Raises:
        Malformed: It has one.
    """
    _check_texts(text)
    return text


def decoded(encoded: bytes) -> str:
    """Return bytes as text.

    Raises:
        Malformed: They are not UTF-8.
    """
    try:
        return encoded.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise Malformed(f"is not UTF-8 at byte {error.start}") from error


# --- forms ---------------------------------------------------------------------------------


def json_of(document: str | bytes, deepest: int = DEEPEST, *, plain: bool = True) -> Any:
    """Return the value of a JSON text.

    Args:
        document: The text.
        deepest: Levels of nesting that it may have.
        plain: Whether its texts may hold no control characters: what is shown on a terminal later.

    Raises:
        Malformed: It is no JSON, or nested too deep.
    """
    text = document if isinstance(document, str) else decoded(document)
    _check_depth(_JSON.finditer(text), deepest)
    try:
        value = json.loads(text, object_pairs_hook=_once)
    except Malformed:
        raise
    except ValueError as error:
        raise Malformed(f"is not JSON: {error}") from error
    if plain:
        _check_texts(value)
    return value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object whose names are there once: of two values, others may believe the other."""
    table = dict(pairs)
    if len(table) != len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for at, name in enumerate(names) if name in names[:at])
        raise Malformed(f"has two values for {shown(twice)}")
    return table


def toml_of(document: str | bytes) -> dict[str, Any]:
    """Return the table of a TOML text.

    Raises:
        Malformed: It is nested too deep or too large; `NotToml`: it is no TOML.
    """
    import tomllib

    text = document if isinstance(document, str) else decoded(document)
    if len(text) > MOST_TOML_BYTES:
        raise Malformed(f"has more than {_size(MOST_TOML_BYTES)}")
    bare = _TOML.sub(_bare, text)
    _check_depth(re.finditer(r"[\[{\]}]", bare), DEEPEST_TOML)
    if _DOTTED.search(bare):
        raise Malformed(f"is nested more than {DEEPEST_TOML} deep")
    try:
        value = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        at = _toml_place(str(error), text)
        raise NotToml(f"is not TOML: {error}", at, *_unquoted(text, at)) from error
    _check_texts(value)
    return value


def _toml_place(message: str, text: str) -> int:
    """Return the offset of an error of `tomllib`'s, which names line and column only in its text."""
    place = re.search(r"\(at line (\d+), column (\d+)\)", message)
    if place is None:
        return len(text) if "end of document" in message else 0
    before = text.split("\n")[: int(place[1]) - 1]
    return min(len(text), sum(len(row) + 1 for row in before) + int(place[2]) - 1)


def _unquoted(text: str, at: int) -> tuple[str, ...]:
    """Return a help where a value at a place looks like a text without quotes."""
    word = _UNQUOTED.match(text, at)
    if word is None or text[:at].rstrip(" \t")[-1:] not in {"=", ",", "["}:
        return ()
    said = word[0].rstrip()
    value = said.lower() if said.lower() in {"true", "false"} else f'"{said}"'
    row = text[text.rfind("\n", 0, at) + 1 : at].lstrip()
    shown = f"{row}{value}" if len(row) + len(value) <= MOST_ROW and row.isprintable() else value
    return (f"write `{shown}`" if value == said.lower() else f"a text stands in quotes: `{shown}`",)


def _bare(match: re.Match[str]) -> str:
    """Brackets as they are, a text or a comment as a letter."""
    if match[0] in {'"', "'"}:
        raise Malformed("has a text without an end")
    return match["mark"] or "q"


def xml_of(text: str) -> "Element":
    """Return the outermost element of an XML text without a document type, so that there is no entity to expand.

    Raises:
        Malformed: It is no such text; the arguments are what is wrong, and the row and column where.
    """
    from xml.etree import ElementTree as ET

    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise Malformed("a document type is not read", text[: text.find("<!")].count("\n") + 1, 0)
    parser = ET.XMLParser(target=_shallow())  # noqa: S314  # without a document type there is no entity to expand
    try:
        parser.feed(text)
        root: Element = parser.close()
    except ET.ParseError as error:
        raise Malformed(f"not XML: {error.msg.split(':')[0]}", *error.position) from error
    return root


def _shallow() -> Any:
    """Return a builder of the elements of an XML text, up to a depth."""
    from xml.etree import ElementTree as ET

    class Shallow(ET.TreeBuilder):
        depth = 0

        def start(self, tag: str, attrs: dict[str, str], /) -> Any:
            self.depth += 1
            if self.depth > DEEPEST_XML:
                raise Malformed(f"nested more than {DEEPEST_XML} deep", 1, 0)
            return super().start(tag, attrs)

        def end(self, tag: str, /) -> Any:
            self.depth -= 1
            return super().end(tag)

    return Shallow()


def rows_of(text: str, columns: Sequence[str], maybe: Sequence[str] = ()) -> list[dict[str, str]]:
    """Return the rows of a CSV text with a heading: these columns, and after them those that may be there, or none of them.

    Raises:
        Malformed: It is no CSV, or has other columns.
    """
    table = csv.DictReader(io.StringIO(text, newline=""))
    try:
        if tuple(table.fieldnames or ()) not in {tuple(columns), (*columns, *maybe)}:
            or_more = f", and {', '.join(maybe)} where it is needed" if maybe else ""
            raise Malformed(f"the columns are {', '.join(columns)}{or_more}")
        return [{key: value or "" for key, value in row.items() if key} for row in table]
    except csv.Error as error:
        raise Malformed(f"is no CSV file: {error}") from error


def table_of(content: str) -> list[dict[str, str]]:
    """Return the rows of a CSV text with any heading, by column, without cells that are empty.

    Raises:
        Malformed: It is no CSV, has no heading, or a row is longer than that.
    """
    try:
        table = csv.reader(io.StringIO(content, newline=""), strict=True)
        lines = [[cell.strip() for cell in line] for line in table if any(cell.strip() for cell in line)]
    except csv.Error as error:
        raise Malformed(f"is no CSV file: {error}") from error
    if not lines:
        raise Malformed("has no heading: the first line names the columns")
    heading = lines[0]
    if twice := next((name for name in heading if heading.count(name) > 1), None):
        raise Malformed(f"has two columns `{twice}`")
    for number, line in enumerate(lines[1:], 1):
        if len(line) > len(heading):
            raise Malformed(f"row {number} has {len(line)} cells, and the heading {len(heading)}")
    return [{name: cell for name, cell in zip(heading, line, strict=False) if cell} for line in lines[1:]]


def _check_depth(marks: Iterator[re.Match[str]], deepest: int) -> None:
    depth = 0
    for match in marks:
        mark = match[0]
        if mark == '"':
            raise Malformed("has a text without an end")
        if mark in "[{":
            depth += 1
            if depth > deepest:
                raise Malformed(f"is nested more than {deepest} deep")
        elif mark in "]}":
            depth -= 1


def _check_texts(value: object) -> None:
    """Refuse what a terminal would obey."""
    waiting = [value]
    while waiting:
        item = waiting.pop()
        if isinstance(item, str):
            bad = UNPRINTED.search(item)
            if bad is not None:
                raise Malformed(
                    f"has a character that does not print, in {shown(item[max(0, bad.start() - 20) :])}"
                )
        elif isinstance(item, dict):
            waiting += item.keys()
            waiting += item.values()
        elif isinstance(item, list):
            waiting += item


# --- values --------------------------------------------------------------------------------

_REQUIRED: Any = object()


@dataclass(frozen=True, slots=True)
class CheckedFields:
    """A table of outside data; each method returns a field, checked to be what its name says.

    Attributes:
        value: The table.
        where: How messages call it.
    """

    value: Any
    where: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.value, dict):
            raise Malformed(f"{self.where or 'it'} is no table of names and values")

    def text(self, key: str, default: str = _REQUIRED) -> str:
        """Return a text.

        Raises:
            Malformed: It is none, or missing.
        """
        value = self._get(key, default)
        if not isinstance(value, str):
            raise Malformed(f"{self._at(key)} is no text")
        return value

    def name(self, key: str, default: str = _REQUIRED) -> str:
        """Return an identifier; the default may be another text.

        Raises:
            Malformed: It is none, or missing.
        """
        return self._checked(key, identifier, default)

    def member(self, key: str) -> str:
        """Return a place in a struct.

        Raises:
            Malformed: It is none, or missing.
        """
        return self._checked(key, member, _REQUIRED)

    def one_of(self, key: str, allowed: Sequence[str]) -> str:
        """Return one of the texts that are allowed.

        Raises:
            Malformed: It is another, or missing.
        """
        text = self.text(key)
        if text not in allowed:
            raise Malformed(f"{self._at(key)}: {shown(text)} is none of {', '.join(allowed)}")
        return text

    def whole(self, key: str, low: int, high: int) -> int:
        """Return a whole number in a range.

        Raises:
            Malformed: It is none, or missing.
        """
        value = self._get(key, _REQUIRED)
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise Malformed(f"{self._at(key)} is no whole number from {low} to {high}")
        return value

    def number(self, key: str, default: float | None = _REQUIRED) -> float | None:
        """Return a number or a bool.

        Raises:
            Malformed: It is none, or missing.
        """
        value = self._get(key, default)
        if value is None or isinstance(value, int | float):
            return value
        raise Malformed(f"{self._at(key)} is no number")

    def flag(self, key: str) -> bool:
        """Return a bool; false where it is missing.

        Raises:
            Malformed: It is none.
        """
        value = self._get(key, default=False)
        if not isinstance(value, bool):
            raise Malformed(f"{self._at(key)} is no bool")
        return value

    def names(self, key: str, default: Sequence[str] = _REQUIRED) -> tuple[str, ...]:
        """Return a list of identifiers.

        Raises:
            Malformed: It is none, or missing.
        """
        return self._each(key, identifier, default)

    def lines(self, key: str) -> tuple[str, ...]:
        """Return a list of names of lines.

        Raises:
            Malformed: It is none, or missing.
        """
        return self._each(key, line_name, _REQUIRED)

    def members(self, key: str) -> tuple[str, ...]:
        """Return a list of places in structs.

        Raises:
            Malformed: It is none, or missing.
        """
        return self._each(key, member, _REQUIRED)

    def each(self, key: str, most: int, default: Sequence[object] = _REQUIRED) -> "Iterator[CheckedFields]":
        """Give each table of a list.

        Raises:
            Malformed: It is no list of tables, has more than `most`, or is missing.
        """
        for at, item in enumerate(self._list(key, most, default)):
            yield CheckedFields(item, f"{self._at(key)}[{at}]")

    def table(self, key: str) -> "CheckedFields":
        """Return a table in it.

        Raises:
            Malformed: It is none, or missing.
        """
        return CheckedFields(self._get(key, _REQUIRED), self._at(key))

    def _each(self, key: str, check: Any, default: Sequence[str]) -> tuple[str, ...]:
        items = self._list(key, 1_000_000, default)
        return tuple(self._named(key, check, item) for item in items)

    def _list(self, key: str, most: int, default: Sequence[object]) -> Sequence[Any]:
        items = self._get(key, default)
        if not isinstance(items, list | tuple):
            raise Malformed(f"{self._at(key)} is no list")
        if len(items) > most:
            raise Malformed(f"{self._at(key)} has {len(items)} entries, more than {most}")
        return items

    def _checked(self, key: str, check: Any, default: str) -> str:
        value = self._get(key, default)
        return self._named(key, check, value) if key in self.value else default

    def _named(self, key: str, check: Any, value: object) -> str:
        try:
            named: str = check(value)
        except BadName as error:
            raise Malformed(f"{self._at(key)}: {error}") from error
        return named

    def _get(self, key: str, default: Any) -> Any:
        value = self.value.get(key, default)
        if value is _REQUIRED:
            raise Malformed(f"{self.where or 'it'} lacks `{key}`")
        return value

    def _at(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else f"`{key}`"
