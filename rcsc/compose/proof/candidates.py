"""Clauses of the last proof of a level, to be tried first in the next one.

In: a level, as its tables now are, and the cache. Out: the clauses that the search of an earlier version found. They are kept as soon as
they are found, so that a proof that was ended half-way goes on. Nothing is believed of them: the search tries them as it tries what it
finds itself, and Z3 confirms the invariant anew.
"""

import os
from dataclasses import dataclass

from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import FoundInvariant, NamedClause
from rcsc.host.cache import Cache


@dataclass(frozen=True, slots=True)
class _Candidates:
    """The clauses of one level."""

    clauses: tuple[NamedClause, ...]


def candidates(cache: Cache | None, ts: TransitionSystem) -> tuple[NamedClause, ...]:
    """Return the clauses that the last search for an invariant of the level found; none without a cache."""
    kept = None if cache is None else cache.load(_Candidates, *_key(ts))
    return () if kept is None else kept.clauses


def keep_candidates(cache: Cache | None, ts: TransitionSystem, invariant: FoundInvariant) -> None:
    """Keep the clauses of an invariant that a search found, whether or not it is ever confirmed."""
    if cache is not None and invariant.clauses:
        cache.store(_Candidates(invariant.named), *_key(ts))


def _key(ts: TransitionSystem) -> tuple[str, ...]:
    return os.path.realpath(ts.level.span.file), ts.level.name
