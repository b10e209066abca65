"""What kept proofs say of the levels together, read without a solver, a search or a cycle.

In: what a system is made of (`SystemOutline`) and a cache. Out: `KnownSystem`. A proof is filed under a digest of all that it is about (the
program as resolved, the level, its links), so that it is never taken for one of other content. What a level assumes of a neighbour has
to be proved of that neighbour, as it is now, before anything is called proved of the levels together.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from rcsc.compose.contract.claims import (
    ACCEPTED,
    RUNS,
    UNREACHED,
    Claim,
    Closed,
    Key,
    Need,
    Promise,
    Verdict,
    closed,
    declared,
    spelled,
)
from rcsc.compose.contract.claims import UNKNOWN as UNLOOKED_AT
from rcsc.host.cache import Cache

ASSUMPTION, PROPERTY = "assumption", "property"
"""Sorts of obligations: of an assumption of a table, of a property."""


class Known(StrEnum):
    """What is known of something that the levels together are to keep."""

    PROVED = "proved"
    TRUSTED = "assumed"  # the tables say so, of what comes from outside
    PARTLY = "proved as far as it was looked at"
    CONDITIONAL = "conditional"  # found so given what it rests on, of which something is not proved
    NOT_PROVED = "not proved"
    UNKNOWN = "unknown"  # nobody has looked at this content, or the solver gave up


@dataclass(frozen=True, slots=True)
class Verdicts:
    """What was found of one level, without what shows it.

    Attributes:
        claims: What was found of each, given what it rests on.
        open: What is not proved and should be, in words.
        unlooked: What was not looked at, in words.
    """

    claims: Mapping[Key, Claim]
    open: tuple[str, ...]
    unstated: tuple[str, ...] = ()

    @property
    def many(self) -> int:
        """How many claims are found so."""
        return sum(claim.verdict in ACCEPTED for claim in self.claims.values())


@dataclass(frozen=True, slots=True)
class _Filed:
    """Verdicts as they are kept."""

    claims: tuple[tuple[Key, Claim], ...]
    open: tuple[str, ...]
    unstated: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _AnyLevel:
    """That levels were proved at all."""


def keep_verdicts(cache: Cache, content: str, verdicts: Verdicts) -> None:
    """Keep what was found, unless more was proved of the same content before, with more effort."""
    before = verdicts_of(cache, content)
    if before is None or before.many <= verdicts.many:
        cache.store(_Filed(tuple(verdicts.claims.items()), verdicts.open, verdicts.unstated), content)
    cache.store(_AnyLevel())


def verdicts_of(cache: Cache, content: str) -> Verdicts | None:
    """Return what was found of a level of this content."""
    kept = cache.load(_Filed, content)
    return None if kept is None else Verdicts(dict(kept.claims), kept.open, kept.unstated)


def any_kept(cache: Cache) -> bool:
    """Return whether levels were ever proved into this cache."""
    return cache.load(_AnyLevel) is not None


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
class SystemOutline:
    """A system, as its files have it."""

    levels: tuple[LevelOutline, ...]
    assumed: tuple[Promise, ...]


# --- what is known of it -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class KnownSystem:
    """What is known of a system of this content.

    Attributes:
        outline: The system.
        known: By level, what a kept proof says.
        closed: What follows of each claim over the whole chain.
    """

    outline: SystemOutline
    known: Mapping[str, Verdicts]
    closed: Mapping[Need, Closed] = field(init=False)

    def __post_init__(self) -> None:
        """Closes the claims."""
        claims = dict(promise.claim for promise in self.outline.assumed)
        claims |= {
            (level, key): claim for level, kept in self.known.items() for key, claim in kept.claims.items()
        }
        object.__setattr__(self, "closed", closed(claims))

    @property
    def broken(self) -> tuple[Promise, ...]:
        """What a level assumes although it is not proved of the neighbour, which was looked at."""
        return tuple(one for one in self.outline.assumed if self._kept(one) is Known.NOT_PROVED)

    def _kept(self, assumed: Promise) -> Known:
        found = [self._obligation(level, key) for level, key in assumed.needs]
        if not assumed.begins or Known.NOT_PROVED in found:
            return Known.NOT_PROVED
        return Known.UNKNOWN if Known.UNKNOWN in found else Known.PROVED

    def _obligation(self, level: str, key: Key) -> Known:
        """Return what was found of an obligation in its level's environment."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return Known.UNKNOWN
        claim = verdicts.claims.get(key)
        return Known.PROVED if claim is not None and claim.verdict in ACCEPTED else Known.NOT_PROVED

    def of_obligation(self, level: str, key: Key) -> Known:
        """Return what is known of an obligation over the whole chain of levels."""
        found = self._obligation(level, key)
        if found is not Known.PROVED:
            return found
        if not self._proved(level, key):
            return self._given(level, key)
        return Known.TRUSTED if self._closed(level, key).verdict is Verdict.TRUSTED else Known.PROVED

    def _given(self, level: str, key: Key) -> Known:
        """Return what is known of a claim that is found so while something it rests on is not: conditional, or unknown."""
        whole = all(owner in self.known for owner, _ in self._closed(level, key).lacks)
        return Known.CONDITIONAL if whole else Known.UNKNOWN

    def _closed(self, level: str, key: Key) -> Closed:
        return self.closed.get((level, key), UNLOOKED_AT)

    def _proved(self, level: str, key: Key) -> bool:
        return self._closed(level, key).proved

    def lacking(self, level: str, key: Key = RUNS) -> tuple[str, ...]:
        """Spell what is not found of all that a claim rests on; by default, what all of the level's claims rest on."""
        return tuple(spelled(need, level, self.closed) for need in self._closed(level, key).lacks)

    def trusting(self, level: str, key: Key) -> tuple[str, ...]:
        """Spell the assumptions of tables that a claim takes for granted."""
        return declared(self._closed(level, key).trusts)

    def of_level(self, level: str) -> Known:
        """Return whether all that should be is proved of a level."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return Known.UNKNOWN
        if verdicts.open:
            return Known.NOT_PROVED
        if not self._proved(level, RUNS):
            return self._given(level, RUNS)
        return Known.PARTLY if verdicts.unstated else Known.PROVED

    @property
    def whole(self) -> Known:
        """Whether all of it is proved."""
        found = {self.of_level(level.name) for level in self.outline.levels}
        if Known.NOT_PROVED in found or self.broken:
            return Known.NOT_PROVED
        worst = (Known.UNKNOWN, Known.CONDITIONAL, Known.PARTLY)
        return next((one for one in worst if one in found), Known.PROVED)

    def missing(self, level: str) -> tuple[str, ...]:
        """Say why a level without anything wrong is not wholly proved: what it rests on, and what was not looked at."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return ()
        rests = (f"rests on {one}" for one in self.lacking(level))
        return (*rests, *(f"not looked at: {one}" for one in verdicts.unstated))

    def unreached(self, level: str, table: str) -> tuple[str, ...]:
        """List the lines of a table that no reachable cycle of this system runs."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return ()
        return tuple(
            line
            for sort, at, line in verdicts.claims
            if (sort, at) == (UNREACHED, table) and self._proved(level, (sort, at, line))
        )


def standing(cache: Cache, outline: SystemOutline) -> KnownSystem:
    """Return what the cache knows of a system."""
    found = {level.name: verdicts_of(cache, level.content) for level in outline.levels}
    return KnownSystem(outline, {name: verdicts for name, verdicts in found.items() if verdicts is not None})
