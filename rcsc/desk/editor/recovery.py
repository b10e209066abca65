"""What can be said of a text that is not in order: what is broken is left out, and the rest is checked.

In: files as read, with what is wrong with them. Out: a program of what is left, and what was left out, made blank where it stands,
so that all places stay true: first what does not parse, then, as long as names do not resolve, what has an error. That is the least
that helps: a cell of a table, its row, its line, a line of a level, and at last the whole declaration, a piece of text from the word
that begins it to the next. So a name that is half typed in a cell takes neither its table's columns nor the level that runs the table:

    | a | m   |   becomes   | a |     |   of the table, which is harmed, nothing is told; all others are checked
    | b | off |             | b | off |

What is found in the rest is true of the rest. So that it is no nuisance either, nothing is told of a declaration that uses a name
which what was left out may declare: of a broken table only its name, of anything else every word in it, and of a file that is
not found any name.
"""

import os
import re
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded, load
from rcsc.lang.resolve import resolve
from rcsc.lang.resolve.program import closure
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.parse import parse
from rcsc.lang.written.tables import RowText, cells_of, tables_of

MOST_ROUNDS = 12
"""Times that something is left out; a text with more layers of errors is not looked at further."""
_BEGINS = re.compile(
    r"^[ \t]*(?P<word>use|unit|const|set|enum|type|record|input|state|output|assume|invariant|property|requirement|procedure|module"
    r"|extern|owner|table|link|serves|commands|adopt|level)\b(?:[ \t]+(?P<name>\w+))?",
    re.MULTILINE | re.ASCII,
)
_AFTER = re.compile(r"(?:\s*^[ \t]*#[^\r\n]*)*\s*\Z", re.MULTILINE)
"""Comments of what comes next, and blank lines."""
_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_COMMENT = re.compile(r"#[^\r\n]*")
_BLANKS = re.compile(r"[ \t]*")
_NOT_END = re.compile(r"[^\r\n]")


Meaning: TypeAlias = Callable[[str, Loaded], Program | tuple[Diagnostic, ...]]
"""What a root file means: a program, or why it means none."""


@dataclass(frozen=True, slots=True)
class Rest:
    """The rest of a program, with its broken parts left out.

    Attributes:
        program: None where nothing that resolves is left.
        left_out: What was left out: cells, rows, lines of a level, or whole declarations.
        harmed: The declarations of which a part was left out; what they say now is not what they say in the text.
        wrong: What was found wrong in the rest on the way, beside what `rcsc check` says.
    """

    program: Program | None
    loaded: Loaded
    left_out: tuple[Span, ...]
    harmed: tuple[Span, ...]
    wrong: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True)
class _Pieces:
    """A text cut into declarations.

    Attributes:
        starts: Where each begins, first 0: what stands before the first.
        lines: The rows of its tables by where they begin, those of headings and dashes left out; each with all rows of its line.
    """

    source: Source
    starts: Sequence[int]
    lines: Mapping[int, tuple[RowText, tuple[RowText, ...]]]

    @classmethod
    def of(cls, source: Source) -> "_Pieces":
        begins = (found.start() for found in _BEGINS.finditer(source.text) if not _within_a_level(found))
        lines = (line for table in tables_of(source.text) for part in table.parts for line in part.lines)
        return cls(source, (0, *begins), {row.start: (row, line) for line in lines for row in line})

    def parts(self, offset: int) -> Iterator[Span]:
        """Yield the spans around an offset that can be left out so that their declaration still stands, the smallest first.

        In a table the text of a cell, then its row, then all rows of its line; not the cell that names the line, for a row without
        a name goes on with the line above. In a level a line of text.
        """
        begin = self.source.text.rfind("\n", 0, offset) + 1
        bar = begin + len(_BLANKS.match(self.source.text, begin)[0])  # type: ignore[index]  # it matches nothing, too
        if bar in self.lines:
            row, line = self.lines[bar]
            for cell in cells_of(row).all[1:]:
                if cell.text and cell.start <= offset <= cell.start + len(cell.text):
                    yield Span(self.source.name, cell.start, cell.start + len(cell.text))
            yield Span(self.source.name, row.start, row.past)
            yield Span(self.source.name, line[0].start, line[-1].past)
        elif self.begins(whole := self.around(offset)) == "level" and begin > whole.start:
            end = self.source.text.find("\n", offset)
            yield Span(self.source.name, begin, len(self.source.text) if end < 0 else end)

    def begins(self, span: Span) -> str:
        """Return the word with which a declaration begins; empty for the text before the first."""
        found = _BEGINS.match(self.source.text, span.start)
        return "" if found is None else found["word"]

    def around(self, offset: int) -> Span:
        """Return the declaration around an offset."""
        at = bisect_right(self.starts, offset) - 1
        past = self.starts[at + 1] if at + 1 < len(self.starts) else len(self.source.text)
        return Span(self.source.name, self.starts[at], past)

    def words(self, span: Span) -> frozenset[str]:
        """Return the words of a declaration without its comments."""
        return frozenset(_WORD.findall(_COMMENT.sub("", self.source.slice(span))))

    def parses(self, span: Span) -> bool:
        """Tell whether a declaration parses by itself."""
        return isinstance(parse(Source(span.file, self.source.slice(span))), tree.File)

    def uses(self, span: Span) -> bool:
        """Tell whether it uses a file, which may declare anything."""
        return self.begins(span) == "use"

    def declares(self, span: Span) -> frozenset[str]:
        """Return the names that the left-out text may declare: none in a part of a table."""
        if span.start in self.lines or (
            not self.begins(span) and self.begins(self.around(span.start)) == "table"
        ):
            return frozenset()
        begins = _BEGINS.match(self.source.text, span.start)
        if begins is not None and begins["word"] == "table" and begins["name"]:
            return frozenset({begins["name"]})
        return self.words(span)


def declarations(source: Source) -> Iterator[tuple[str, str, Span, Span]]:
    """Yield the word, the name, the whole span and the span of the name of each declaration in a text, whether it parses or not."""
    pieces = _Pieces.of(source)
    for found in _BEGINS.finditer(source.text):
        name = _named(source.text, found)
        if name is not None and not _within_a_level(found) and found["word"] != "use":
            whole = pieces.around(found.start("word"))
            end = found.start("word") + len(_AFTER.sub("", source.text[found.start("word") : whole.end]))
            yield (
                found["word"],
                name[0],
                Span(source.name, found.start("word"), end),
                Span(source.name, *name[1]),
            )


def _within_a_level(found: re.Match[str]) -> bool:
    """Tell whether a word `table` belongs to a level, which names its tables with it, and declares none."""
    return found["word"] == "table" and found["name"] in {None, "by"}


def _named(text: str, found: re.Match[str]) -> tuple[str, tuple[int, int]] | None:
    """Return the name of a declaration and its place: the third word of `extern procedure name`."""
    if found["name"] is None:
        return None
    if found["word"] == "extern":
        third = _WORD.search(text, found.end())
        return None if third is None else (third[0], third.span())
    return found["name"], found.span("name")


def rest_of(
    root: str,
    loaded: Loaded,
    wrong: Sequence[Diagnostic],
    overlay: Mapping[str, str],
    means: Meaning = resolve,
) -> Rest:
    """Return the rest of a file's program, with the broken parts left out.

    Args:
        root: The file.
        loaded: As it was read.
        wrong: Why it is not in order.
        overlay: Texts that stand for what is on disk, by real path.
        means: What the file means.
    """
    pieces: dict[str, _Pieces] = {}
    out: dict[Span, None] = {}
    found: dict[Diagnostic, None] = {}
    current, told = (
        loaded,
        tuple(each for each in wrong if each.primary.span.file in set(closure(root, loaded))),
    )
    for _ in range(MOST_ROUNDS):
        pieces |= {name: _Pieces.of(source) for name, source in current.sources.items() if name not in pieces}
        found.update(dict.fromkeys(_of_the_rest(told, pieces, out)))
        new = [span for each in told if (span := _least(each, pieces, out)) is not None and span not in out]
        if not new:
            break
        out.update(dict.fromkeys(new))
        current = load([root], overlay={**overlay, **_blanked(pieces, out)})
        program = _resolved(root, current, means)
        if isinstance(program, Program):
            return Rest(program, current, tuple(out), _harmed(pieces, out), tuple(found))
        told = program
    return Rest(None, current, tuple(out), (), tuple(found))


def _harmed(pieces: Mapping[str, _Pieces], out: Iterable[Span]) -> tuple[Span, ...]:
    """Return the declarations of which a part is left out."""
    return tuple(
        dict.fromkeys(whole for span in out if (whole := pieces[span.file].around(span.start)) != span)
    )


def _resolved(root: str, loaded: Loaded, means: Meaning) -> Program | tuple[Diagnostic, ...]:
    """Return the program, or its errors."""
    if root in loaded.files:
        return means(root, loaded)
    files = set(closure(root, loaded))
    return tuple(each for each in loaded.diagnostics if each.primary.span.file in files)


def _piece(diagnostic: Diagnostic, pieces: Mapping[str, _Pieces], out: Collection[Span] = ()) -> Span | None:
    """Return the declaration that an error is in: the one before, if the error's own parses by itself and only shows the error."""
    span = diagnostic.primary.span
    if span.file not in pieces:
        return None
    cut = pieces[span.file]
    found = cut.around(span.start)
    harmed = any(each.file == span.file and found.start <= each.start < found.end for each in out)
    if harmed or not (found.start and diagnostic.code.value.startswith("RCS1") and cut.parses(found)):
        return found
    before = cut.around(found.start - 1)
    return found if before in out else before


def _least(diagnostic: Diagnostic, pieces: Mapping[str, _Pieces], out: Collection[Span]) -> Span | None:
    """Return the span to leave out for an error: a part of its declaration, or all of it if no part helped."""
    whole, span = _piece(diagnostic, pieces, out), diagnostic.primary.span
    if whole is None or whole in out or not whole.start <= span.start < whole.end:
        return whole
    return next((part for part in pieces[span.file].parts(span.start) if part not in out), whole)


def _of_the_rest(
    told: Iterable[Diagnostic], pieces: Mapping[str, _Pieces], out: Mapping[Span, None]
) -> Iterator[Diagnostic]:
    """Yield the errors that do not come from text left out. Yield none before any was: `rcsc check` reports those."""
    if not out or any(pieces[span.file].uses(span) for span in out):
        return
    missing = frozenset[str]().union(*(pieces[span.file].declares(span) for span in out))
    untrue = {*out, *_harmed(pieces, out)}
    for each in told:
        piece = _piece(each, pieces, out)
        if piece is not None and piece not in untrue and not pieces[piece.file].words(piece) & missing:
            yield each


def _blanked(pieces: Mapping[str, _Pieces], out: Iterable[Span]) -> dict[str, str]:
    """Return the texts with these declarations made blank, by real path."""
    texts: dict[str, str] = {}
    for span in out:
        text = texts.get(span.file, pieces[span.file].source.text)
        blank = _NOT_END.sub(" ", text[span.start : span.end])
        texts[span.file] = text[: span.start] + blank + text[span.end :]
    return {os.path.realpath(name): text for name, text in texts.items()}
