"""What kept proofs say of the levels together, read without a solver, a search or a cycle.

In: what a system is made of (`Outline`) and a cache. Out: `Standing`. A proof is filed under a digest of all that it is about (the
program as resolved, the level, its links), so that it is never taken for one of other content. What a level assumes of a neighbour has
to be proved of that neighbour, as it is now, before anything is called proved of the levels together.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

from rcsc.cache import Cache

Key: TypeAlias = tuple[str, str, str]
"""Of a goal: sort, table and name, as `goals.Goal` has them."""

ASSUMPTION, PROPERTY = "assumption", "property"
"""Sorts of goals: of an assumption of a table, of a property."""


class Known(StrEnum):
    """What is known of something that the levels together are to keep."""

    PROVED = "proved"
    NOT_PROVED = "not proved"
    UNKNOWN = "unknown"  # nobody has looked at this content, or the solver gave up


@dataclass(frozen=True, slots=True)
class Verdicts:
    """What was found of one level, shortened.

    Attributes:
        proved: Goals that are.
        open: What is not proved and should be, in words.
        unreached: Tables and lines that no reachable cycle runs, DEFAULT too; none where something is open.
    """

    proved: frozenset[Key]
    open: tuple[str, ...]
    unreached: tuple[tuple[str, str], ...] = ()


def keep_verdicts(cache: Cache, content: str, verdicts: Verdicts) -> None:
    """Keeps what was found, unless more was proved of the same content before, with more effort."""
    before = verdicts_of(cache, content)
    if before is None or len(before.proved) <= len(verdicts.proved):
        value = {
            "proved": sorted(verdicts.proved),
            "open": list(verdicts.open),
            "unreached": list(verdicts.unreached),
        }
        cache.store(value, "composed verdicts", content)
    cache.store({}, "composed verdicts")


def verdicts_of(cache: Cache, content: str) -> Verdicts | None:
    """What was found of a level of this content."""
    kept = cache.load("composed verdicts", content)
    if kept is None:
        return None
    proved = frozenset((sort, table, name) for sort, table, name in kept["proved"])
    unreached = tuple((table, line) for table, line in kept["unreached"])
    return Verdicts(proved, tuple(kept["open"]), unreached)


def any_kept(cache: Cache) -> bool:
    """Whether levels were ever proved into this cache."""
    return cache.load("composed verdicts") is not None


# --- what a system is made of ----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TableOutline:
    """A table that a level runs.

    Attributes:
        file: Its real path.
        default: The name of its DEFAULT line; empty where there is none.
    """

    file: str
    name: str
    default: str


@dataclass(frozen=True, slots=True)
class LevelOutline:
    """A level.

    Attributes:
        content: Digest of all that a proof of it is about.
        file: Real path of the file that declares it; `start` and `end`, where its name stands there.
        properties: Each with the real path of the file that states it.
    """

    name: str
    content: str
    file: str
    start: int
    end: int
    tables: tuple[TableOutline, ...]
    properties: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Assumed:
    """What a level assumes of a neighbour; `agreed.Promise`, shortened.

    Attributes:
        needs: Levels with their goals; `begins`, whether the two begin in agreement.
    """

    level: str
    words: str
    needs: tuple[tuple[str, Key], ...]
    begins: bool


@dataclass(frozen=True, slots=True)
class Outline:
    """A system, as its files have it."""

    levels: tuple[LevelOutline, ...]
    assumed: tuple[Assumed, ...]


def outline_of(form: Mapping[str, Any]) -> Outline:
    """The inverse of `dataclasses.asdict`, by way of JSON."""
    levels = tuple(
        LevelOutline(
            **one
            | {
                "tables": tuple(TableOutline(**table) for table in one["tables"]),
                "properties": tuple((name, file) for name, file in one["properties"]),
            }
        )
        for one in form["levels"]
    )
    assumed = tuple(
        Assumed(
            one["level"],
            one["words"],
            tuple((level, (sort, table, name)) for level, (sort, table, name) in one["needs"]),
            one["begins"],
        )
        for one in form["assumed"]
    )
    return Outline(levels, assumed)


# --- what is known of it -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Standing:
    """What is known of a system of this content.

    Attributes:
        outline: The system.
        known: By level, what a kept proof says.
    """

    outline: Outline
    known: Mapping[str, Verdicts]

    @property
    def broken(self) -> tuple[Assumed, ...]:
        """What a level assumes although it is not proved of the neighbour, which was looked at."""
        return tuple(one for one in self.outline.assumed if self._kept(one) is Known.NOT_PROVED)

    @property
    def sound(self) -> bool:
        """Whether all that levels assume of each other is proved."""
        return all(self._kept(one) is Known.PROVED for one in self.outline.assumed)

    def _kept(self, assumed: Assumed) -> Known:
        found = [self._goal(level, key) for level, key in assumed.needs]
        if not assumed.begins or Known.NOT_PROVED in found:
            return Known.NOT_PROVED
        return Known.UNKNOWN if Known.UNKNOWN in found else Known.PROVED

    def _goal(self, level: str, key: Key) -> Known:
        """What was found of a goal, in its level's environment."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return Known.UNKNOWN
        return Known.PROVED if key in verdicts.proved else Known.NOT_PROVED

    def of_goal(self, level: str, key: Key) -> Known:
        """Whether a goal of a level is proved of the levels together."""
        found = self._goal(level, key)
        return Known.UNKNOWN if found is Known.PROVED and not self.sound else found

    def of_level(self, level: str) -> Known:
        """Whether all that should be is proved of a level."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return Known.UNKNOWN
        if verdicts.open:
            return Known.NOT_PROVED
        return Known.PROVED if self.sound else Known.UNKNOWN

    @property
    def whole(self) -> Known:
        """Whether all of it is proved."""
        found = {self.of_level(one.name) for one in self.outline.levels}
        if Known.NOT_PROVED in found or self.broken:
            return Known.NOT_PROVED
        return Known.UNKNOWN if Known.UNKNOWN in found else Known.PROVED

    def unreached(self, level: str, table: str) -> tuple[str, ...]:
        """Lines of a table that no reachable cycle of this system runs."""
        verdicts = self.known.get(level)
        if verdicts is None or not self.sound:
            return ()
        return tuple(line for at, line in verdicts.unreached if at == table)


def standing(cache: Cache, outline: Outline) -> Standing:
    """What the cache knows of a system."""
    found = {one.name: verdicts_of(cache, one.content) for one in outline.levels}
    return Standing(outline, {name: one for name, one in found.items() if one is not None})
