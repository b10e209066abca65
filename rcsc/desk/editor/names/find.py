"""The name at a place, its declarations and its uses.

In: files that belong together, as they are read. Out: occurrences. In a declaration that does not parse, names are found by
their words alone.
"""

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.base.diagnostics.source import Source, Span
from rcsc.desk.editor.names.index import Occurrence, Space, occurrences
from rcsc.lang.model import Program
from rcsc.lang.syntax import tree

_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_VALUES = (Space.VALUE, Space.MEMBER)
_ORDER = (
    Space.VALUE,
    Space.MEMBER,
    Space.CALL,
    Space.TYPE,
    Space.TABLE,
    Space.CLAIM,
    Space.PEER,
    Space.PARTY,
    Space.LINK,
    Space.FIELD,
    Space.UNIT,
)
"""Where a word is looked up of which nothing else is known."""


@dataclass(frozen=True, slots=True)
class Party:
    """What requirements across levels name before a dot.

    Attributes:
        files: Those of its program, by real path; none of a party outside.
        program: None for a party outside.
    """

    files: frozenset[str] = frozenset()
    program: Program | None = None


@dataclass(slots=True)
class Names:
    """The names of files that belong together.

    Attributes:
        files: As parsed.
        sources: Their texts.
        program: What they resolve to, as far as they do.
        across: The parties of each file that states requirements across levels, by name.
    """

    files: Mapping[str, tree.File]
    sources: Mapping[str, Source]
    program: Program | None
    across: Mapping[str, Mapping[str, Party]] = field(default_factory=dict)
    _of: dict[str, tuple[Occurrence, ...]] = field(default_factory=dict)

    def of(self, file: str) -> tuple[Occurrence, ...]:
        """Return the names of one file."""
        if file not in self._of:
            self._of[file] = (
                tuple(occurrences(self.files[file], self.across.get(file, ()))) if file in self.files else ()
            )
        return self._of[file]

    def every(self) -> Iterator[Occurrence]:
        """Yield the names of all files."""
        for file in self.files:
            yield from self.of(file)

    def at(self, file: str, offset: int) -> Occurrence | None:
        """Return the name at an offset, or that ends there; by its word alone where nothing is parsed."""
        for each in self.of(file):
            if any(span.start <= offset <= span.end for span in (each.span, *each.further)):
                return each
        word = self.word(file, offset)
        if word is None:
            return None
        text = self.sources[file].slice(word)
        declared = {each.space for each in self.every() if each.declares and each.text == text}
        space = next((each for each in _ORDER if each in declared), None)
        return None if space is None else Occurrence(space, text, word)

    def word(self, file: str, offset: int) -> Span | None:
        """Return the word around an offset, outside comments."""
        if file not in self.sources:
            return None
        text = self.sources[file].text
        begin = max(text.rfind("\n", 0, offset), text.rfind("\r", 0, offset)) + 1
        for found in _WORD.finditer(text, begin):
            if found.start() > offset:
                break
            if offset <= found.end() and "#" not in text[begin : found.start()]:
                return Span(file, *found.span())
        return None

    def declarations(self, name: Occurrence) -> tuple[Occurrence, ...]:
        """Return the declarations of a name; for one that the protocol makes, the neighbour that it is made for."""
        if name.space is Space.PARTY:
            return tuple(self._levels(name))
        found = tuple(each for each in self.every() if each.declares and self.same(each, name))
        program = self.party(name).program if name.party else self.program
        if found or name.space is not Space.VALUE or program is None:
            return found
        spans = [each.span for each in program.declared if each.name == name.text and each.span.file]
        return tuple(Occurrence(Space.PEER, name.text, span, "", True) for span in spans)

    def uses(self, name: Occurrence) -> tuple[Occurrence, ...]:
        """Return every occurrence of a name, its declarations included."""
        return tuple(each for each in self.every() if self.same(each, name))

    def party(self, name: Occurrence) -> Party:
        """Return whose a name of `LEVEL.VARIABLE` is, or which party it names."""
        word = name.text if name.space is Space.PARTY else name.party
        return self.across.get(name.span.file, {}).get(word, Party())

    def _levels(self, name: Occurrence) -> Iterator[Occurrence]:
        """Yield the declarations of the level that a party is; of an instance, of the only level of its file."""
        party = self.party(name)
        for file in self.files:
            if party.program is not None and os.path.realpath(file) == os.path.realpath(party.program.file):
                levels = [each for each in self.of(file) if isinstance(each.node, tree.LevelDecl)]
                yield from [each for each in levels if each.text == name.text] or levels[:1]

    def same(self, one: Occurrence, other: Occurrence) -> bool:
        """Tell whether two occurrences name the same thing; a value may be a member of an enumeration."""
        if one.text != other.text or one.owner != other.owner:
            return False
        if one.party and other.party:
            files = self.party(one).files
            return one.span.file == other.span.file and (
                one.party == other.party or (bool(files) and files == self.party(other).files)
            )
        if one.party or other.party:
            whose, written = (one, other) if one.party else (other, one)
            inside = os.path.realpath(written.span.file) in self.party(whose).files
            return inside and written.space in (Space.VALUE, Space.PEER)
        if one.space is Space.LINE or other.space is Space.LINE:
            return one.space is other.space and one.span.file == other.span.file
        return one.space is other.space or (one.space in _VALUES and other.space in _VALUES)

    def file_used(self, name: Occurrence) -> str | None:
        """Return the file that a `use` names."""
        folder = os.path.dirname(name.span.file)
        wanted = [file for file in self.sources if file.endswith(f"{name.text}.rcs")]
        beside = os.path.normpath(os.path.join(folder, f"{name.text}.rcs"))
        return beside if beside in wanted else next(iter(wanted), None)
