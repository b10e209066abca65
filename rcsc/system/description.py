"""The description of a system: its levels, the buffers between them, and what the database fills; one TOML file.

In: `system.toml`. Out: a frozen `Description`. The names of buffers and of their destinations stand here, and the
rest is automatic (Haynes et al. 1984, section 9).
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


class BadDescription(Exception):  # noqa: N818  # what happened, not an error of ours
    """The description says something that cannot be; tells where and what."""


@dataclass(frozen=True, slots=True)
class Feed:
    """Inputs that the database fills before each cycle.

    Attributes:
        into: The record that is filled.
        query: What the database is asked.
        keys: Leaves whose values are asked for.
    """

    into: str
    query: str
    keys: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LevelSpec:
    """One control level."""

    name: str
    program: str
    feeds: tuple[Feed, ...]


@dataclass(frozen=True, slots=True)
class Wire:
    """A buffer: whose output it is, and whose input; `level.variable` at both ends."""

    source: str
    target: str


@dataclass(frozen=True, slots=True)
class Description:
    """A whole system; levels from the top down.

    Attributes:
        displays: Sets of variables to look at, by the name that a level's `display` gives them.
    """

    name: str
    generated: Path
    database: Path
    tick_ms: int
    levels: tuple[LevelSpec, ...]
    wires: tuple[Wire, ...]
    displays: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def description(path: Path) -> Description:
    """Reads a description; its paths are seen from where it stands.

    Raises:
        BadDescription: It cannot be read, or lacks something.
    """
    try:
        said: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
        levels = tuple(
            LevelSpec(
                one["name"],
                one.get("program", one["name"]),
                tuple(Feed(feed["into"], feed["query"], tuple(feed["keys"])) for feed in one.get("feed", ())),
            )
            for one in said["level"]
        )
        wires = tuple(Wire(str(a), str(b)) for a, b in said["buffers"].items())
        here = path.parent
        return Description(
            said["name"],
            (here / said["generated"]).resolve(),
            (here / said["data"]).resolve(),
            int(said["tick_ms"]),
            levels,
            wires,
            {str(name): tuple(map(str, shown)) for name, shown in said.get("displays", {}).items()},
        )
    except OSError as error:
        raise BadDescription(f"{path} cannot be read: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise BadDescription(f"{path} is not TOML: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BadDescription(f"{path} lacks {error}") from error


def places(path: Path, program: str) -> tuple[Path, Path]:
    """Where the program of a level is looked for, beside the description, in order."""
    return path.parent / program / f"{program}.rcs", path.parent / f"{program}.rcs"
