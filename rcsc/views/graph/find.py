"""The tables that somebody names: by name, by file, by both, or all of a folder.

In: `acquire`, `task/acquire.rcs`, `task/acquire.rcs:acquire` or a folder. Out: each table with the program that
runs it, or what is wrong.
"""

import os
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Source, Span
from rcsc.lang.model import Program, Table
from rcsc.lang.project import Loaded, load, project_root
from rcsc.lang.resolve import resolve


@dataclass(frozen=True, slots=True)
class FoundTable:
    """A table and where it stands.

    Attributes:
        root: Root file of the program; where there are several, one with the level that runs the table.
        others: Where other tables of its name stand, which are not meant.
    """

    loaded: Loaded
    root: str
    program: Program
    table: Table
    others: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """The name of the table that no other has: its file and its own name."""
        return f"{self.table.file}:{self.table.name}"


@dataclass(frozen=True, slots=True)
class NotFound:
    """The reasons why there is no table.

    Attributes:
        sources: Texts that `diagnostics` point into.
    """

    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, Source]


def tables(
    named: str, *, running: bool = False, preferred: Collection[str] = ()
) -> list[FoundTable] | NotFound:
    """Return the tables that a name means, each once, in order of file and place.

    Args:
        named: A table, a file, a file and its table, or a folder.
        running: Whether to look through a file's project for the program that has the level which runs the table.
        preferred: Root files whose table is meant where several programs have one of that name.
    """
    file, name = _parted(named)
    if file is None:
        return _by_name(
            name,
            load(["tables" if os.path.isdir("tables") else "."]),
            {os.path.realpath(root) for root in preferred},
        )
    if os.path.isdir(file):
        return _every(load([file]))
    loaded = load([file])
    if loaded.diagnostics:
        return NotFound(loaded.diagnostics, dict(loaded.sources))
    program = resolve(loaded.roots[0], loaded)
    if not isinstance(program, Program):
        return NotFound(program, dict(loaded.sources))
    own = [table for table in program.tables if table.name in program.own_tables]
    if name or not own:
        own = [table for table in program.tables if not name or table.name == name]
    if not own:
        return _nothing(f"`{file}` has no table{f' `{name}`' if name else ''}", file)
    entries = [FoundTable(loaded, loaded.roots[0], program, table) for table in own]
    return [_in_level(entry) if running and not _run_here(entry) else entry for entry in entries]


def _parted(named: str) -> tuple[str | None, str]:
    """Divide a name into the file or folder, if any, and the table."""
    if os.path.exists(named) or named.endswith(".rcs"):
        return named, ""
    file, colon, name = named.rpartition(":")
    return (file, name) if colon and file.endswith(".rcs") else (None, named)


def _programs(loaded: Loaded) -> Iterator[tuple[str, Program]]:
    """Yield every root that resolves, with its program; those with a level first."""
    programs = [
        (root, program) for root in loaded.roots if isinstance(program := resolve(root, loaded), Program)
    ]
    yield from sorted(programs, key=lambda pair: not pair[1].levels)


def _every(loaded: Loaded) -> list[FoundTable] | NotFound:
    by_name: dict[tuple[str, str], FoundTable] = {}
    for root, program in _programs(loaded):
        for table in program.tables:
            by_name.setdefault((table.file, table.name), FoundTable(loaded, root, program, table))
    if not by_name:
        return (
            NotFound(loaded.diagnostics, dict(loaded.sources))
            if loaded.diagnostics
            else _nothing("there is no table", "")
        )
    return [by_name[key] for key in sorted(by_name)]


def _by_name(name: str, loaded: Loaded, preferred: Collection[str]) -> list[FoundTable] | NotFound:
    every = _every(loaded)
    if isinstance(every, NotFound):
        return every
    called = [entry for entry in every if entry.table.name == name]
    named = [entry for entry in called if _run_here(entry)] or called  # an example is meant only by its file
    if len(named) > 1:
        named = [entry for entry in named if os.path.realpath(entry.root) in preferred] or named
    if len(named) == 1:
        return [replace(named[0], others=tuple(entry.place for entry in called if entry is not named[0]))]
    if named:
        names = tuple(f"`{entry.place}`" for entry in named)
        return _nothing(f"{len(named)} tables are called `{name}`", "", f"say which: {', '.join(names)}")
    near = get_close_matches(name, sorted({entry.table.name for entry in every}), 3, 0.5)
    helps = (f"near it: {', '.join(f'`{candidate}`' for candidate in near)}",) if near else ()
    return _nothing(f"there is no table `{name}`", "", *helps)


def _nothing(message: str, file: str, *helps: str) -> NotFound:
    return NotFound((Diagnostic(Code.UNKNOWN_NAME, message, Label(Span(file, 0, 0)), help=helps),), {})


def _run_here(entry: FoundTable) -> bool:
    return any(entry.table.name in level.table_names for level in entry.program.levels)


def _in_level(entry: FoundTable) -> FoundTable:
    """Return the table in a program of its project whose level runs it; unchanged where there is none."""
    root = project_root(entry.table.file)
    every = _every(load([root])) if os.path.isfile(os.path.join(root, "rcsc.toml")) else []
    if isinstance(every, NotFound):
        return entry
    real = os.path.realpath(entry.table.file)
    same = [
        it for it in every if it.table.name == entry.table.name and os.path.realpath(it.table.file) == real
    ]
    return next((it for it in same if _run_here(it)), entry)
