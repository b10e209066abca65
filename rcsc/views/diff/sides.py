"""What is to be compared: two files, folders or revisions, read and resolved, their programs matched.

In: arguments as the user gave them. Out: `Side`s, and pairs of programs.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.children import scratch
from rcsc.base.host.described import near_path
from rcsc.compose.proof.system import NoProgramError
from rcsc.compose.together.words import levels_read, system_naming
from rcsc.lang.leaves import spoken_of
from rcsc.lang.model import BEFORE, Program
from rcsc.lang.project import PROJECT_FILE, Instance, Loaded, load
from rcsc.lang.resolve import resolve
from rcsc.run.description import BadDescription, description, places
from rcsc.views.diff.revision import NotComparedError, lay_out


@dataclass(frozen=True, slots=True)
class Given:
    """One side as the user gave it.

    Attributes:
        name: To show.
        paths: Files or folders; of a revision from where one stands, or from the top of the repository.
        revision: Empty for the files as they are.
        from_top: Whether paths begin at the top of the repository.
        may_lack: Whether a path that is not there is an empty side: what is new has no earlier version.
    """

    name: str
    paths: tuple[str, ...]
    revision: str = ""
    from_top: bool = False
    may_lack: bool = False


@dataclass(frozen=True, slots=True)
class Side:
    """One version of the tables.

    Attributes:
        programs: By the path of the root file below what was given.
        diagnostics: What keeps a file from being read or resolved.
        sources: Of the files that `diagnostics` point into.
    """

    name: str
    programs: Mapping[str, Program]
    diagnostics: tuple[Diagnostic, ...]
    sources: Mapping[str, Source]


def given(argument: str) -> Given:
    """Return a file, a folder, or `REV:path` as git has it: from the top, or from the present folder with `./`."""
    revision, colon, path = argument.partition(":")
    if os.path.lexists(argument) or not colon or not revision:
        return Given(argument, (argument,))
    return Given(argument, (path or ".",), revision, from_top=not path.startswith(("./", "../")))


def revisions(text: str, paths: Sequence[str]) -> tuple[Given, Given]:
    """`REV1..REV2`, or `REV` against the files as they are; each of the paths."""
    before, dots, after = text.partition("..")
    where = tuple(paths) or (".",)
    after = after or ("HEAD" if dots else "")
    first = Given(before or "HEAD", where, before or "HEAD", may_lack=True)
    return first, Given(after or "the files as they are", where, after, may_lack=True)


def read(asked: Given) -> Side:
    """Return the programs of one side.

    Raises:
        NotComparedError: The revision, or a path in it, cannot be had.
    """
    if not asked.revision:
        return _read(asked, asked.paths, "", "")
    with scratch("diff") as place:
        top = os.path.realpath(place)
        stands = lay_out(asked.revision, Path(top))
        here = "" if asked.from_top else stands
        paths = tuple(os.path.normpath(os.path.join(top, here, path)) for path in asked.paths)
        for path, shown in zip(paths, asked.paths, strict=True):
            if os.path.commonpath([path, top]) != top:
                raise NotComparedError(f"`{shown}` lies outside the repository")
        return _read(asked, paths, top + os.sep, f"{asked.revision}:")


def _read(asked: Given, paths: tuple[str, ...], hidden: str, shown: str) -> Side:
    """Load and resolve; the names of files begin with `shown` in place of `hidden`."""
    there = tuple(path for path in paths if os.path.lexists(path))
    if not there and not asked.may_lack:
        near = () if asked.revision else near_path(Path(asked.name))
        raise NotComparedError("; ".join((f"there is no file or folder `{asked.name}`", *near)))
    levels = _levels(there)
    instances = {root: instance for root, (_, instance) in levels.items() if instance is not None}
    files = tuple(path for path in there if not _is_system(path))
    loaded = load((*files, *levels, *_stated(there)), instances=instances) if there else None
    if loaded is None or (asked.may_lack and not loaded.given):
        return Side(asked.name, {}, (), {})
    programs: dict[str, Program] = {}
    diagnostics = [diagnostic for diagnostic in loaded.diagnostics if diagnostic.severity is Severity.ERROR]
    unread = ""
    for root in loaded.roots:
        try:
            resolved = _resolved(root, loaded)
        except (BadDescription, NoProgramError) as error:
            unread = str(error)
            continue
        if isinstance(resolved, Program):
            programs[levels[root][0] if root in levels else _key(root, there)] = resolved
        else:
            diagnostics += resolved
    if unread and not diagnostics:
        raise NotComparedError(unread)
    named = {_renamed(name, hidden, shown): source for name, source in loaded.sources.items()}
    sources = {name: Source(name, source.text) for name, source in named.items()}
    return Side(
        asked.name,
        programs,
        tuple(_as_given(diagnostic, hidden, shown) for diagnostic in dict.fromkeys(diagnostics)),
        sources,
    )


def _resolved(root: str, loaded: Loaded) -> Program | tuple[Diagnostic, ...]:
    """Resolve a root; one that states requirements across levels as the system that names it has it, with the variables that it speaks of.

    Raises:
        BadDescription, NoProgramError: That system, or a level of it, is not in order.
    """
    system = system_naming(root)
    if system is None:
        return resolve(root, loaded)
    resolved = levels_read(system).means(root, loaded)
    if not isinstance(resolved, Program):
        return resolved
    read = {leaf.removeprefix(BEFORE) for one in resolved.stated for leaf in spoken_of(one)}
    return replace(resolved, variables=tuple(leaf for leaf in resolved.variables if leaf.name in read))


def _stated(paths: Sequence[str]) -> Iterator[str]:
    """Yield the files of requirements across levels of the systems among the paths."""
    for path in map(Path, filter(_is_system, paths)):
        with suppress(BadDescription):  # which is told of its levels
            system = description(path)
            if system.requirements is not None and system.requirements.is_file():
                yield os.path.normpath(system.requirements)


def _is_system(path: str) -> bool:
    return path.endswith(".toml") and os.path.basename(path) != PROJECT_FILE


def _levels(paths: Sequence[str]) -> dict[str, tuple[str, Instance | None]]:
    """Return the programs of the systems among the paths, by root: the first level that has it, and what it is an instance of.

    Raises:
        NotComparedError: A description is not in order.
    """
    found: dict[str, tuple[str, Instance | None]] = {}
    for path in map(Path, filter(_is_system, paths)):
        try:
            system = description(path)
        except BadDescription as error:
            raise NotComparedError(str(error)) from error
        for spec in system.levels:
            file = next((place for place in places(path, spec.source) if place.is_file()), None)
            if file is not None:
                instance = system.instance(spec, str(file))
                found.setdefault(
                    os.path.normpath(file) if instance is None else instance.root, (spec.name, instance)
                )
    return found


def _key(root: str, paths: tuple[str, ...]) -> str:
    """Return the root file below the folder that it was found in; its own name where it was given itself."""
    for path in paths:
        if os.path.isdir(path):
            below = os.path.relpath(root, path)
            if not below.startswith(".."):
                return below.replace(os.sep, "/")
    return os.path.basename(root)


def _renamed(text: str, hidden: str, shown: str) -> str:
    return text.replace(hidden, shown) if hidden else text


def _as_given(diagnostic: Diagnostic, hidden: str, shown: str) -> Diagnostic:
    """Return the diagnostic with the names that the user knows."""

    def label(at: Label) -> Label:
        return replace(at, span=replace(at.span, file=_renamed(at.span.file, hidden, shown)))

    return replace(
        diagnostic,
        message=_renamed(diagnostic.message, hidden, shown),
        primary=label(diagnostic.primary),
        related=tuple(map(label, diagnostic.related)),
        notes=tuple(_renamed(note, hidden, shown) for note in diagnostic.notes),
        help=tuple(_renamed(text, hidden, shown) for text in diagnostic.help),
    )


def pairs(before: Side, after: Side) -> Iterator[tuple[str, Program | None, Program | None]]:
    """Programs that are versions of each other: of one path, else of one name; two single ones always are."""
    old, new = dict(before.programs), dict(after.programs)
    if len(old) == len(new) == 1:
        [(name, first)], [(_, second)] = old.items(), new.items()
        yield name, first, second
        return
    for name, first in before.programs.items():
        other = (
            name
            if name in new
            else next((key for key in new if key not in old and new[key].name == first.name), None)
        )
        yield name, first, new.pop(other) if other is not None else None
    for name, program in new.items():
        yield name, None, program
