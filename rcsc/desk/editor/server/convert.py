"""Values of `rcsc.desk.editor` in the protocol's types.

In: areas, findings and edits. Out: the same for a client, columns in its units.
"""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from lsprotocol import types
from pygls import uris
from pygls.protocol import default_converter

from rcsc.desk.editor.places import Area, Edit, Lines, Place, Units
from rcsc.desk.editor.values import Finding, Witness

SOURCE = "rcsc"
_SEVERITIES = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
    "note": types.DiagnosticSeverity.Information,
}
_UNUSED = {"RCS403"}
"""Codes of what never runs: editors show it faded."""


NO_VERSION = -1
"""Stands for the version of a document that a client does not count, as the protocol once allowed."""


def reads_messages() -> Any:
    """Return a converter of messages, as pygls makes it, except that a document may come without a version."""
    made: Any = default_converter()  # type: ignore[no-untyped-call]  # of pygls
    for kind in (types.TextDocumentItem, types.VersionedTextDocumentIdentifier):
        made.register_structure_hook(kind, partial(_versioned, made.get_structure_hook(kind)))
    return made


def _versioned(make: Callable[[Any, Any], Any], value: Mapping[str, object], kind: type[object]) -> object:
    return make(value if value.get("version") is not None else {**value, "version": NO_VERSION}, kind)


def path_of(uri: str, folder: str = "/") -> str:
    """Return the path of a document; for one that is in no file, a path in `folder` that no file has."""
    path = uris.to_fs_path(uri) if uri.startswith("file:") else None
    if path is None:
        scheme, _, name = uri.partition(":")
        path = os.path.join(folder, f"{scheme}-{name.replace('/', '-')}")
    return os.path.normpath(os.path.abspath(path))


@dataclass(slots=True)
class Converter:
    """Places of some texts, in a client's units.

    Attributes:
        lines: The texts by path; those that are missing are read when they are needed.
        uris: How documents that are open are called.
    """

    lines: Mapping[str, Lines]
    units: Units
    uris: Mapping[str, str] = field(default_factory=dict)

    def uri(self, path: str) -> str:
        """Return a client's name for a file."""
        return self.uris.get(path) or uris.from_fs_path(path) or path

    def position(self, file: str, place: Place) -> types.Position:
        """Convert a place."""
        lines = self.lines.get(file)
        shifted = place if lines is None else lines.shifted(place, self.units)
        return types.Position(shifted.line, shifted.column)

    def range(self, area: Area) -> types.Range:
        """Convert an area."""
        return types.Range(self.position(area.file, area.start), self.position(area.file, area.end))

    def between(self, file: str, start: int, end: int) -> types.Range:
        """Return the area between two offsets."""
        lines = self.lines[file]
        first, last = lines.place(start, self.units), lines.place(end, self.units)
        return types.Range(types.Position(first.line, first.column), types.Position(last.line, last.column))

    def offset(self, file: str, position: types.Position) -> int:
        """Return the offset of a client's position."""
        return self.lines[file].offset(Place(position.line, position.character), self.units)

    def location(self, area: Area) -> types.Location:
        """Convert an area with its file."""
        return types.Location(self.uri(area.file), self.range(area))

    # --- findings ---

    def diagnostic(self, finding: Finding) -> types.Diagnostic:
        """Convert a finding; its witnesses stand in the message, for people, and in `data`."""
        lines = [(line.area, f"line {line.name}") for each in finding.witnesses[:3] for line in each.lines]
        related = [(area, text) for area, text in (*finding.related, *lines) if area is not None]
        return types.Diagnostic(
            self.range(finding.area),
            message(finding),
            _SEVERITIES[finding.severity],
            finding.code,
            source=SOURCE,
            tags=[types.DiagnosticTag.Unnecessary] if finding.code in _UNUSED else None,
            related_information=[
                types.DiagnosticRelatedInformation(self.location(area), text or finding.message)
                for area, text in dict.fromkeys(related)
            ],
            data={
                "table": finding.table,
                "meanwhile": finding.meanwhile,
                "mendable": finding.mendable,
                "more": finding.more,
                "witnesses": [_witness(each) for each in finding.witnesses[:3]],
            },
        )

    def edits(self, edits: Iterable[Edit]) -> types.WorkspaceEdit:
        """Convert edits of several files."""
        by_file: dict[str, list[types.TextEdit]] = {}
        for edit in edits:
            by_file.setdefault(self.uri(edit.area.file), []).append(self.edit(edit))
        return types.WorkspaceEdit(changes={uri: list(each) for uri, each in by_file.items()})

    def edit(self, edit: Edit) -> types.TextEdit:
        """Convert one edit."""
        return types.TextEdit(self.range(edit.area), edit.text)


def message(finding: Finding) -> str:
    """Write the message of a finding: the least input, the region, notes and helps."""
    lines = [finding.message]
    for each in finding.witnesses[:1]:
        lines.append("input: " + ", ".join(f"{name} = {value}" for name, value in each.values))
        if each.region:
            lines.append(f"so wherever {' and '.join(each.region)}")
    lines += [f"note: {note}" for note in finding.notes]
    lines += [f"help: {text}" for text in finding.help]
    if finding.meanwhile:
        lines.append("note: found with what is not in order left out")
    return "\n".join(lines)


def _witness(witness: Witness) -> dict[str, object]:
    return {
        "input": [{"variable": name, "value": value} for name, value in witness.values],
        "lines": [line.name for line in witness.lines],
        "region": list(witness.region),
        "inputs": None
        if witness.inputs is None
        else str(witness.inputs),  # may be more than a number of JSON holds
    }
