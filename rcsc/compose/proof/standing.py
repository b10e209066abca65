"""What kept proofs show of a whole system, without a solver, a search or a cycle.

In: what a system is made of (`SystemOutline`) and a cache. Out: `KnownSystem`. A proof is filed under a digest of all that it depends on
(the program as resolved, the level, its links), so that it is never used for other content. What a level assumes of a neighbour has to be
proved of that neighbour as it is now before anything counts as proved of the levels together.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from rcsc.base.host.cache import Cache
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

ASSUMPTION = "assumption"
SOME_LINE, ONE_LINE = "some line matches", "no two lines match"
"""Sorts of obligations."""


class KnownVerdict(StrEnum):
    """The state of knowledge about an obligation, a level, or the whole system."""

    PROVED = "proved"
    TRUSTED = "assumed"  # the tables declare it, of what comes from outside
    PARTLY = "proved as far as it was looked at"
    CONDITIONAL = "conditional"  # accepted given what it rests on, of which something is not proved
    REFUTED = "refuted"  # of an obligation: a run breaks it
    NOT_PROVED = "not proved"
    UNKNOWN = "unknown"  # this content was never proved, or the solver gave up


@dataclass(frozen=True, slots=True)
class Verdicts:
    """The verdicts on one level, without the invariant.

    Attributes:
        claims: Each claim with its verdict, given what it rests on.
        open: Essential obligations that are not proved, in words.
        unstated: Obligations that could not be stated, in words.
    """

    claims: Mapping[Key, Claim]
    open: tuple[str, ...]
    unstated: tuple[str, ...] = ()

    @property
    def many(self) -> int:
        """The number of accepted claims."""
        return sum(claim.verdict in ACCEPTED for claim in self.claims.values())


@dataclass(frozen=True, slots=True)
class _Filed:
    """Verdicts as they are kept."""

    claims: tuple[tuple[Key, Claim], ...]
    open: tuple[str, ...]
    unstated: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _AnyLevel:
    """A mark in the cache that some level was proved."""


def keep_verdicts(cache: Cache, content: str, verdicts: Verdicts) -> None:
    """Keep the verdicts, unless more claims about the same content were accepted before, with more effort."""
    before = verdicts_of(cache, content)
    if before is None or before.many <= verdicts.many:
        cache.store(_Filed(tuple(verdicts.claims.items()), verdicts.open, verdicts.unstated), content)
    cache.store(_AnyLevel())


def verdicts_of(cache: Cache, content: str) -> Verdicts | None:
    """Return the verdicts on a level of this content, if any are kept."""
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
        default: The name of its DEFAULT line; empty if it has none.
    """

    file: str
    name: str
    default: str


@dataclass(frozen=True, slots=True)
class LevelOutline:
    """A level.

    Attributes:
        content: Digest of all that a proof of it depends on.
        file: Real path of the file that declares it; `start` and `end`, where its name stands there.
        properties: The key of each, and of each requirement over time, with the real path of the file that states it.
    """

    name: str
    content: str
    file: str
    start: int
    end: int
    tables: tuple[TableOutline, ...]
    properties: tuple[tuple[Key, str], ...]


@dataclass(frozen=True, slots=True)
class SystemOutline:
    """A system, as its files have it."""

    levels: tuple[LevelOutline, ...]
    assumed: tuple[Promise, ...]


# --- what was refuted ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Refuted:
    """The claims of the levels of a system that a run breaks, which every executor repeated; each with its level first."""

    needs: tuple[Need, ...]


def keep_refuted(cache: Cache, outline: SystemOutline, needs: frozenset[Need]) -> None:
    """Keep which claims of a system a run breaks, with those that were known before.

    A run is one that the neighbours, as they are, can make: when any level changes, nothing is known to be refuted.
    """
    cache.store(_Refuted(tuple(sorted(needs | refuted_of(cache, outline)))), repr(outline))


def refuted_of(cache: Cache, outline: SystemOutline) -> frozenset[Need]:
    """Return the claims of a system as it is that a run is known to break."""
    kept = cache.load(_Refuted, repr(outline))
    return frozenset(() if kept is None else kept.needs)


# --- what is known of it -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class KnownSystem:
    """The kept verdicts on a system of this content.

    Attributes:
        outline: The system.
        known: The kept verdicts by level.
        refuted: The claims that a run is known to break.
        closed: Each claim with all that it rests on.
    """

    outline: SystemOutline
    known: Mapping[str, Verdicts]
    refuted: frozenset[Need] = frozenset()
    closed: Mapping[Need, Closed] = field(init=False)

    def __post_init__(self) -> None:
        """Close the claims."""
        claims = dict(promise.claim for promise in self.outline.assumed)
        claims |= {
            (level, key): claim for level, kept in self.known.items() for key, claim in kept.claims.items()
        }
        object.__setattr__(self, "closed", closed(claims))

    @property
    def broken(self) -> tuple[Promise, ...]:
        """The promises that are not proved of the neighbour, although its proof is kept."""
        return tuple(
            promise for promise in self.outline.assumed if self._kept(promise) is KnownVerdict.NOT_PROVED
        )

    def _kept(self, assumed: Promise) -> KnownVerdict:
        known = [self._obligation(level, key) for level, key in assumed.needs]
        if not assumed.begins or KnownVerdict.NOT_PROVED in known:
            return KnownVerdict.NOT_PROVED
        return KnownVerdict.UNKNOWN if KnownVerdict.UNKNOWN in known else KnownVerdict.PROVED

    def _obligation(self, level: str, key: Key) -> KnownVerdict:
        """Return the state of an obligation in its level's environment alone."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return KnownVerdict.UNKNOWN
        claim = verdicts.claims.get(key)
        return (
            KnownVerdict.PROVED
            if claim is not None and claim.verdict in ACCEPTED
            else KnownVerdict.NOT_PROVED
        )

    def of_obligation(self, level: str, key: Key) -> KnownVerdict:
        """Return the state of an obligation over the whole chain of levels."""
        known = self._obligation(level, key)
        if known is KnownVerdict.NOT_PROVED and (level, key) in self.refuted:
            return KnownVerdict.REFUTED
        if known is not KnownVerdict.PROVED:
            return known
        if not self._proved(level, key):
            return self._given(level, key)
        return (
            KnownVerdict.TRUSTED
            if self._closed(level, key).verdict is Verdict.TRUSTED
            else KnownVerdict.PROVED
        )

    def _given(self, level: str, key: Key) -> KnownVerdict:
        """Return the state of an accepted claim that rests on one that is not accepted: conditional, or unknown."""
        whole = all(owner in self.known for owner, _ in self._closed(level, key).lacks)
        return KnownVerdict.CONDITIONAL if whole else KnownVerdict.UNKNOWN

    def _closed(self, level: str, key: Key) -> Closed:
        return self.closed.get((level, key), UNLOOKED_AT)

    def _proved(self, level: str, key: Key) -> bool:
        return self._closed(level, key).proved

    def lacking(self, level: str, key: Key = RUNS) -> tuple[str, ...]:
        """Spell the claims that a claim rests on and that are not accepted; by default, of the claim on which all of the level rest."""
        return tuple(spelled(need, level, self.closed) for need in self._closed(level, key).lacks)

    def trusting(self, level: str, key: Key) -> tuple[str, ...]:
        """Spell the assumptions of tables that a claim trusts."""
        return declared(self._closed(level, key).trusts)

    def of_level(self, level: str) -> KnownVerdict:
        """Return whether every essential obligation of a level is proved."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return KnownVerdict.UNKNOWN
        if verdicts.open:
            return KnownVerdict.NOT_PROVED
        if not self._proved(level, RUNS):
            return self._given(level, RUNS)
        return KnownVerdict.PARTLY if verdicts.unstated else KnownVerdict.PROVED

    @property
    def whole(self) -> KnownVerdict:
        """The state of knowledge about the whole system."""
        known = {self.of_level(level.name) for level in self.outline.levels}
        if KnownVerdict.NOT_PROVED in known or self.broken:
            return KnownVerdict.NOT_PROVED
        worst = (KnownVerdict.UNKNOWN, KnownVerdict.CONDITIONAL, KnownVerdict.PARTLY)
        return next((grade for grade in worst if grade in known), KnownVerdict.PROVED)

    def missing(self, level: str) -> tuple[str, ...]:
        """Tell why a level without open obligations is not wholly proved: claims it rests on, and obligations not stated."""
        verdicts = self.known.get(level)
        if verdicts is None:
            return ()
        rests = (f"rests on {claim}" for claim in self.lacking(level))
        return (*rests, *(f"not looked at: {obligation}" for obligation in verdicts.unstated))

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
    """Return the cache's verdicts on a system."""
    kept = {level.name: verdicts_of(cache, level.content) for level in outline.levels}
    known = {name: verdicts for name, verdicts in kept.items() if verdicts is not None}
    return KnownSystem(outline, known, refuted_of(cache, outline))
