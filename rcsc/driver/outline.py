"""What a system is made of, as its files have it: read anew only when one of them changes.

In: a system's description and the cache. Out: a `SystemOutline` and what is known of it, or nothing where the system is not in order;
`rcsc prove` says why.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rcsc.base.host.cache import Cache
from rcsc.compose.proof.standing import (
    KnownSystem,
    LevelOutline,
    SystemOutline,
    TableOutline,
    any_kept,
    standing,
)
from rcsc.driver.unchanged import as_before, digest_at, digests
from rcsc.run.description import BadDescription, description, places

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rcsc.compose.contract.transition import TransitionSystem
    from rcsc.lang.model import Program, Table
    from rcsc.lang.project import Loaded


def known(system: Path, cache: Cache) -> KnownSystem | None:
    """Return the kept verdicts on a system as its files stand; None where the cache never had a proved level, or it is not in order."""
    system_outline = outlined(system.parent.resolve() / system.name, cache) if any_kept(cache) else None
    return None if system_outline is None else standing(cache, system_outline)


@dataclass(frozen=True, slots=True)
class _Outlined:
    """An outline, with the digests of all places that were looked at for it."""

    outline: SystemOutline
    looked_at: dict[str, str]


def outlined(system: Path, cache: Cache) -> SystemOutline | None:
    """Return the system's outline; `system` is absolute."""
    kept = cache.load(_Outlined, str(system))
    if kept is not None and as_before(kept.looked_at) is not None:
        return kept.outline
    read = _read(system)
    if read is None:
        return None
    systems, looked_at = read
    system_outline = outline(systems)
    cache.store(_Outlined(system_outline, looked_at), str(system))
    return system_outline


def _read(system: Path) -> "tuple[dict[str, TransitionSystem], dict[str, str]] | None":
    """Return the transition systems of all levels, and the digests of their files; None where one is not in order, or has just changed."""
    from rcsc.compose.proof.system import NoProgramError, loaded_program, transition_systems_of

    looked_at = {str(system): digest_at(str(system))}
    programs: dict[str, Program] = {}
    try:
        described = description(system)
        for spec in described.levels:
            programs[spec.name], loaded = loaded_program(system, described, spec)
            files = digests(loaded)
            if files is None:
                return None
            looked_at |= {str(path): digest_at(str(path)) for path in places(system, spec.source)} | files
        systems = transition_systems_of(described, programs)
    except (BadDescription, NoProgramError):
        return None
    return (systems, looked_at) if looked_at[str(system)] == digest_at(str(system)) else None


@dataclass(frozen=True, slots=True)
class _Said:
    """The lines about a proved system, with the digests of all places that were looked at for them."""

    lines: tuple[str, ...]
    looked_at: dict[str, str]


def recall_lines(cache: Cache, system: Path, key: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return the lines kept under this key, if the system's files are unchanged.

    Raises:
        BadDescription: The description says something that cannot be, by now.
    """
    kept = cache.load(_Said, *key)
    if kept is None or as_before(kept.looked_at) is None:
        return None
    description(system)  # it names files that are no part of the proof, and has to be in order
    return kept.lines


def keep_lines(
    cache: Cache,
    system: Path,
    key: tuple[str, ...],
    lines: tuple[str, ...],
    stood: str,
    loaded: "Mapping[str, Loaded]",
) -> None:
    """Keep the lines about a system, unless one of its files has changed meanwhile.

    `stood` is the description's digest from before it was read; the programs are by name as they were loaded.
    """
    looked_at = {str(system): stood}
    looked_at |= {
        str(path): digest_at(str(path))
        for spec in description(system).levels
        for path in places(system, spec.source)
    }
    for files in loaded.values():
        known = digests(files)
        if known is None:
            return
        looked_at |= known
    if digest_at(str(system)) == stood:
        cache.store(_Said(lines, looked_at), *key)


def outline(systems: "Mapping[str, TransitionSystem]") -> SystemOutline:
    """Make the outline of all levels."""
    from rcsc.compose.proof.assume_guarantee import promises
    from rcsc.compose.proof.candidates import content

    levels = tuple(
        LevelOutline(
            name,
            content(ts),
            os.path.realpath(ts.level.span.file),
            ts.level.span.start,
            ts.level.span.end,
            () if _set(ts) else tuple(map(_table, map(ts.table, ts.level.table_names))),
            tuple(
                ((each.word, "", each.name), os.path.realpath(each.span.file))
                for each in (() if _set(ts) else ts.program.properties)
            ),
        )
        for name, ts in systems.items()
    )
    return SystemOutline(levels, tuple(promises(systems)))


def _set(ts: "TransitionSystem") -> bool:
    """Return whether a level sets constants: nothing that is proved of it is known of the tables as their file declares them."""
    return ts.program.instance is not None and bool(ts.program.instance.parameters)


def _table(table: "Table") -> TableOutline:
    default = "" if table.default is None else str(table.default.name)
    return TableOutline(os.path.realpath(table.file), str(table.name), default)
