"""What helps who writes a text in the page: what could stand at a place, what is known of a name, where it is declared, and colours.

In: questions of kind `text.*` about a place in a version of a text. Out: answers, as the language server gives them (`desk.editor.names`).
Nothing is proved for them. They have a lane and a reading of the files of their own: who types does not wait for a proof.
"""

import os
from typing import TYPE_CHECKING, Any

from rcsc.desk.editor.grid import grids
from rcsc.desk.editor.names.about import about
from rcsc.desk.editor.names.complete import offers
from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Occurrence, Space
from rcsc.desk.editor.names.tokens import TYPES, tokens
from rcsc.desk.editor.places import Lines, Place, Units
from rcsc.desk.editor.values import BEING_PROVED
from rcsc.desk.editor.workspace import Workspace
from rcsc.desk.studio.hub import Ask, Concern, Json
from rcsc.desk.studio.tables.desk import Desk, seen
from rcsc.desk.studio.tables.editing import MOST_LINES

if TYPE_CHECKING:
    from rcsc.desk.editor.values import Grid


class Writing(Concern):
    """Answers about names at places of a text."""

    name, lane = "text", "text"

    def __init__(self, desk: Desk) -> None:
        """Args: desk: The open files."""
        self._desk = desk
        self._workspace = Workspace()

    def _names(self, ask: Ask) -> tuple[Names, str]:
        """Return the names of a file as a page has seen it, with all that it uses, and its path.

        Raises:
            Refused: The text has changed.
        """
        path = os.path.normpath(self._desk.at(*seen(ask)).file)
        texts = self._desk.texts()
        for gone in self._workspace.overlay.keys() - texts.keys():
            self._workspace.close(gone)
        for file, text in texts.items():
            self._workspace.open(file, text)
        return self._workspace.reading(path).names, path

    def _at(self, ask: Ask) -> tuple[Names, str, int]:
        """Return the same, and the offset of the place in the question."""
        names, path = self._names(ask)
        place = Place(ask.body.whole("line", 0, MOST_LINES), ask.body.whole("column", 0, MOST_LINES))
        return names, path, Lines(names.sources[path].text).offset(place, Units.UTF_16)

    def _on_offers(self, ask: Ask) -> Json:
        """Return the completions at a place."""
        names, path, offset = self._at(ask)
        made = grids(path, Lines(names.sources[path].text), names.program, lambda _: BEING_PROVED)
        found = offers(names, {each.name: each for each in made}, path, offset)
        return [
            {"label": each.label, "kind": each.kind, "detail": each.detail, "doc": each.doc} for each in found
        ]

    def _on_about(self, ask: Ask) -> Json:
        """Describe the name at a place, in Markdown, with the name's area; null for no name."""
        names, path, offset = self._at(ask)
        name = names.at(path, offset)
        if name is None:
            return None
        answer = self._desk.answered(ask.body.text("file"))
        known: dict[str, Grid] = {} if answer is None else {each.name: each for each in answer.tables}
        return {"text": about(names, name, known), **_area(names, name)}

    def _on_declared(self, ask: Ask) -> Json:
        """Return the declaration of the name at a place; null where there is none."""
        names, path, offset = self._at(ask)
        name = names.at(path, offset)
        if name is None:
            return None
        if name.space is Space.FILE:
            file = names.file_used(name)
            return None if file is None else {"file": self._desk.named(file), "start": [0, 0], "end": [0, 0]}
        found = next(iter(names.declarations(name)), None)
        return None if found is None else {"file": self._desk.named(found.span.file), **_area(names, found)}

    def _on_colours(self, ask: Ask) -> Json:
        """Return the token of each word of a text: line, column, length and type, one after another."""
        names, path = self._names(ask)
        lines, numbers = Lines(names.sources[path].text), list[int]()
        for token in tokens(names, path):
            place = lines.place(token.start, Units.UTF_16)
            length = Units.UTF_16.of(lines.text[token.start : token.start + token.length])
            numbers += [place.line, place.column, length, TYPES.index(token.type)]
        return {"types": list(TYPES), "tokens": numbers}


def _area(names: Names, name: Occurrence) -> dict[str, Any]:
    lines = Lines(names.sources[name.span.file].text)
    places = (lines.place(offset, Units.UTF_16) for offset in (name.span.start, name.span.end))
    start, end = ([place.line, place.column] for place in places)
    return {"start": start, "end": end}
