"""Renaming: every use in every file of the project, refused where it would come to mean something else.

In: a name, another word, and the files of the project. Out: the new texts, or why not. Nothing is captured: the new word must stand
nowhere in the files that see the name. Nothing is forgotten: each program that was in order is resolved anew with the new texts,
and has to be in order again.
"""

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rcsc.base.diagnostics.source import Source, Span
from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Occurrence, Space
from rcsc.lang.written.changes import laid_out, spliced

_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_LINE = re.compile(r"\w+", re.ASCII)
_EMPTY_ROW = re.compile(r"^[ \t]*\|[ \t|]*(?:\r?\n|$)", re.MULTILINE)


class RefusedError(Exception):
    """The reason why a name is not renamed, in words."""


@dataclass(frozen=True, slots=True)
class Renamed:
    """The result of renaming.

    Attributes:
        texts: The new text of each file that changes.
        count: How many places change.
    """

    texts: Mapping[str, str]
    count: int


def renamable(names: Names, name: Occurrence) -> Occurrence:
    """Find the one declaration of a name.

    Raises:
        RefusedError: It has none in these files, or several.
    """
    if name.space is Space.FILE:
        raise RefusedError("a file is renamed on disk, and its `use`s by hand")
    if name.space is Space.PARTY:
        raise RefusedError(
            f"`{name.text}` is what the system's description calls a level, or who stands outside"
        )
    found = [each for each in names.uses(name) if each.declares]
    if not found:
        raise RefusedError(
            f"`{name.text}` is not declared in the project's files: the language or the protocol makes it"
        )
    if len(found) > 1:
        places = ", ".join(_place(names, each.span) for each in found)
        raise RefusedError(
            f"`{name.text}` is declared in {len(found)} places, and which is meant is not known: {places}"
        )
    return found[0]


def renamed(
    names: Names, name: Occurrence, new: str, resolves: Callable[[Mapping[str, str]], str]
) -> Renamed:
    """Rename a name in all files.

    Args:
        names: Every file that sees it.
        name: An occurrence of it.
        new: The other word.
        resolves: Says what is wrong with the programs of these files in new texts; empty for nothing.

    Raises:
        RefusedError: It is not done.
    """
    declared = renamable(names, name)
    shape = _LINE if declared.space is Space.LINE else _NAME
    if not shape.fullmatch(new):
        raise RefusedError(f"`{new}` is no name: letters, digits and `_`, a letter first")
    uses = names.uses(declared)
    taken = next((each for each in names.every() if each.text == new and _clashes(each, declared)), None)
    if taken is not None:
        raise RefusedError(
            f"`{new}` stands at {_place(names, taken.span)} already, and the two would become one"
        )
    by_file: dict[str, list[tuple[int, int, str]]] = {}
    for use in uses:
        splices = by_file.setdefault(use.span.file, [])
        splices.append((use.span.start, use.span.end, new))
        splices += [(span.start, span.end, "") for span in use.further]
    texts = {file: _text(names.sources[file], splices) for file, splices in by_file.items()}
    wrong = resolves(texts)
    if wrong:
        raise RefusedError(f"with `{new}` the program would not be the same: {wrong}")
    return Renamed(texts, len(uses))


def _clashes(other: Occurrence, declared: Occurrence) -> bool:
    """Tell whether another name could be taken for the new one: lines only in their table."""
    if declared.space is Space.LINE or other.space is Space.LINE:
        return (
            other.space is declared.space
            and other.owner == declared.owner
            and other.span.file == declared.span.file
        )
    return True


def _text(source: Source, splices: list[tuple[int, int, str]]) -> str:
    text = spliced(source.text, sorted(set(splices)))
    if any(not new for _, _, new in splices):  # a heading that was broken in the name
        text = _EMPTY_ROW.sub("", text)
    return laid_out(source, text)


def _place(names: Names, span: Span) -> str:
    position = names.sources[span.file].position(span.start)
    return f"{os.path.basename(span.file)}:{position.line}:{position.column}"
