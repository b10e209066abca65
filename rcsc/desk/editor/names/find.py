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
    Space.LINK,
    Space.FIELD,
    Space.UNIT,
)
"""Where a word is looked up of which nothing else is known."""


@dataclass(slots=True)
class Names:
    """The names of files that belong together.

    Attributes:
        files: As parsed.
        sources: Their texts.
        program: What they resolve to, as far as they do.
    """

    files: Mapping[str, tree.File]
    sources: Mapping[str, Source]
    program: Program | None
    _of: dict[str, tuple[Occurrence, ...]] = field(default_factory=dict)

    def of(self, file: str) -> tuple[Occurrence, ...]:
        """Return the names of one file."""
        if file not in self._of:
            self._of[file] = tuple(occurrences(self.files[file])) if file in self.files else ()
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
        found = tuple(each for each in self.every() if each.declares and same(each, name))
        if found or name.space is not Space.VALUE or self.program is None:
            return found
        spans = [each.span for each in self.program.declared if each.name == name.text and each.span.file]
        return tuple(Occurrence(Space.PEER, name.text, span, "", True) for span in spans)

    def uses(self, name: Occurrence) -> tuple[Occurrence, ...]:
        """Return every occurrence of a name, its declarations included."""
        return tuple(each for each in self.every() if same(each, name))

    def file_used(self, name: Occurrence) -> str | None:
        """Return the file that a `use` names."""
        folder = os.path.dirname(name.span.file)
        wanted = [file for file in self.sources if file.endswith(f"{name.text}.rcs")]
        beside = os.path.normpath(os.path.join(folder, f"{name.text}.rcs"))
        return beside if beside in wanted else next(iter(wanted), None)


def same(one: Occurrence, other: Occurrence) -> bool:
    """Tell whether two occurrences name the same thing; a value may be a member of an enumeration."""
    if one.text != other.text or one.owner != other.owner:
        return False
    if one.space is Space.LINE or other.space is Space.LINE:
        return one.space is other.space and one.span.file == other.span.file
    return one.space is other.space or (one.space in _VALUES and other.space in _VALUES)
