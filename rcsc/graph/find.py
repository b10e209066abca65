"""The tables that somebody names: by name, by file, by both, or all of a folder.

In: `acquire`, `task/acquire.rcs`, `task/acquire.rcs:acquire` or a folder. Out: each table with the program that
runs it, or what is wrong.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label
from rcsc.diagnostics.source import Source, Span
from rcsc.lang.model import Program, Table
from rcsc.lang.project import Loaded, load, project_root
from rcsc.lang.resolve import resolve


@dataclass(frozen=True, slots=True)
class FoundTable:
    """A table and where it stands.

    Attributes:
        root: Root file of the program; of several, one that has the level that runs the table.
    """

    loaded: Loaded
    root: str
    program: Program
    table: Table


@dataclass(frozen=True, slots=True)
class NotFound:
    """Why there is no table.

    Attributes:
        sources: Texts that `found` points into.
    """

    found: tuple[Diagnostic, ...]
    sources: dict[str, Source]


def tables(named: str, *, running: bool = False) -> list[FoundTable] | NotFound:
    """The tables that are meant, in order of file and place; each once.

    Args:
        named: As above.
        running: Whether to look through a file's project for the program that has the level which runs the table.
    """
    file, name = _parted(named)
    if file is None:
        return _by_name(name, load([_here()]))
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
    found = [FoundTable(loaded, loaded.roots[0], program, table) for table in own]
    return [
        _in_level(found_table) if running and not _run_here(found_table) else found_table
        for found_table in found
    ]


def _parted(named: str) -> tuple[str | None, str]:
    """File or folder, and table."""
    if os.path.exists(named) or named.endswith(".rcs"):
        return named, ""
    file, colon, name = named.rpartition(":")
    return (file, name) if colon and file.endswith(".rcs") else (None, named)


def _here() -> str:
    return "tables" if os.path.isdir("tables") else "."


def _programs(loaded: Loaded) -> Iterator[tuple[str, Program]]:
    """Every root that resolves; those with a level first."""
    made = [(root, program) for root in loaded.roots if isinstance(program := resolve(root, loaded), Program)]
    yield from sorted(made, key=lambda one: not one[1].levels)


def _every(loaded: Loaded) -> list[FoundTable] | NotFound:
    made: dict[tuple[str, str], FoundTable] = {}
    for root, program in _programs(loaded):
        for table in program.tables:
            made.setdefault((table.file, table.name), FoundTable(loaded, root, program, table))
    if not made:
        return (
            NotFound(loaded.diagnostics, dict(loaded.sources))
            if loaded.diagnostics
            else _nothing("there is no table", "")
        )
    return [made[key] for key in sorted(made)]


def _by_name(name: str, loaded: Loaded) -> list[FoundTable] | NotFound:
    every = _every(loaded)
    if isinstance(every, NotFound):
        return every
    found = [found_table for found_table in every if found_table.table.name == name]
    found = [
        found_table for found_table in found if _run_here(found_table)
    ] or found  # an example is meant only by its file
    if len(found) == 1:
        return found
    if found:
        names = tuple(f"`{found_table.table.file}:{name}`" for found_table in found)
        return _nothing(f"{len(found)} tables are called `{name}`", "", f"say which: {', '.join(names)}")
    near = get_close_matches(name, sorted({found_table.table.name for found_table in every}), 3, 0.5)
    helps = (f"near it: {', '.join(f'`{one}`' for one in near)}",) if near else ()
    return _nothing(f"there is no table `{name}`", "", *helps)


def _nothing(message: str, file: str, *helps: str) -> NotFound:
    return NotFound((Diagnostic(Code.UNKNOWN_NAME, message, Label(Span(file, 0, 0)), help=helps),), {})


def _run_here(one: FoundTable) -> bool:
    return any(one.table.name in level.tables.names for level in one.program.levels)


def _in_level(one: FoundTable) -> FoundTable:
    """The same table in a program of its project that has the level which runs it; as it was where there is none."""
    root = project_root(one.table.file)
    every = _every(load([root])) if os.path.isfile(os.path.join(root, "rcsc.toml")) else []
    if isinstance(every, NotFound):
        return one
    real = os.path.realpath(one.table.file)
    same = [it for it in every if it.table.name == one.table.name and os.path.realpath(it.table.file) == real]
    return next((it for it in same if _run_here(it)), one)
