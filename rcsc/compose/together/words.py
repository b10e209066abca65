"""What the names of a file of requirements across levels mean: of a system that is proved, and of one whose files are checked.

In: a system's description and the programs of its levels. Out: the program of the file (`run.log.across` reads it, for runs, too).
"""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.host.files.read import MOST_TOML_BYTES, Malformed, NotToml, content, text, toml_of
from rcsc.compose.proof.system import NoProgramError, loaded_program
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded, systems_above
from rcsc.lang.resolve.across import resolve_across
from rcsc.run.description import BadDescription, Description, LevelSpec, description
from rcsc.run.log import across
from rcsc.run.log.across import parties

Read: TypeAlias = Callable[[Path, Description, LevelSpec], tuple[Program, Loaded]]


@dataclass(frozen=True, slots=True)
class LevelsRead:
    """A system as its description and its levels' texts say it.

    Attributes:
        loaded: The files of each level, by its name.
    """

    system: Description
    programs: Mapping[str, Program]
    loaded: Mapping[str, Loaded]

    def means(self, root: str, loaded: Loaded) -> Program | tuple[Diagnostic, ...]:
        """Return what a file of requirements means of them, or every diagnostic of it."""
        return resolve_across(root, loaded, parties(self.system, self.programs), self.system.tick_ms)


def levels_read(path: Path, read: Read = loaded_program) -> LevelsRead:
    """Read a description and its levels.

    Raises:
        BadDescription: The description is not in order.
        NoProgramError: A level is not in order, or missing.
    """
    system = description(path)
    levels = {spec.name: read(path, system, spec) for spec in system.levels}
    programs = {name: program for name, (program, _) in levels.items()}
    return LevelsRead(system, programs, {name: loaded for name, (_, loaded) in levels.items()})


def system_naming(file: str) -> Path | None:
    """Return the description beside a file or above it that names it as its requirements across levels."""
    real = os.path.realpath(file)
    for path in systems_above(file):
        try:
            said = toml_of(content(path, MOST_TOML_BYTES)).get("requirements")
        except (OSError, ValueError, Malformed):
            continue
        if isinstance(said, str) and os.path.realpath(path.parent / said) == real:
            return path
    return None


def stated_across(system: Description, programs: Mapping[str, Program]) -> tuple[Program, Loaded] | None:
    """Return the requirements of a system, and the files that they were read from; None where it names none.

    Raises:
        NoProgramError: The file is missing, or not in order.
    """
    try:
        return across.stated_across(system, programs)
    except BadDescription as error:
        raise NoProgramError(str(error)) from error


def told_across(root: str, loaded: Loaded, otherwise: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return what is wrong with a file that no level's program is: as requirements of a system that names it, else what was found.

    Nothing is told of it where the levels of that system are not in order, which is told of their own files.
    """
    path = system_naming(root)
    if path is None:
        return _unread_naming(root) or tuple(otherwise)
    try:
        found = levels_read(path).means(root, loaded)
    except (BadDescription, NoProgramError):
        return ()
    return () if isinstance(found, Program) else found


def _unread_naming(root: str) -> tuple[Diagnostic, ...]:
    """Return what is wrong with a description that is no TOML and seems to name a file; none where there is no such."""
    for path in systems_above(root):
        with suppress(OSError, Malformed):
            said = text(path, MOST_TOML_BYTES)
            if re.search(rf"(?m)^\s*requirements\s*=.*\b{re.escape(os.path.basename(root))}", said) is None:
                continue
            try:
                toml_of(said)
            except NotToml:
                try:
                    description(Path(os.path.relpath(path)))  # as a path that was given
                except BadDescription as error:
                    return error.diagnostics
    return ()
