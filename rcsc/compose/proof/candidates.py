"""Clauses of the last proof of a level, to be tried first in the next one.

In: a level, as its tables now are, and the cache. Out: the clauses that the search of an earlier version found. They are kept as soon as
they are found, so that a proof that was ended half-way goes on. Nothing is believed of them: the search tries them as it tries what it
finds itself, and Z3 confirms the invariant anew.
"""

import hashlib
import os
from dataclasses import dataclass, replace

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import FoundInvariant, NamedClause


@dataclass(frozen=True, slots=True)
class Candidates:
    """The clauses of one level.

    Attributes:
        found_of: The digest of the level that they were found of (`content`).
        lacking: The lines and endings that were not shown there.
    """

    clauses: tuple[NamedClause, ...] = ()
    found_of: str = ""
    lacking: tuple[str, ...] = ()


def candidates(cache: Cache | None, ts: TransitionSystem) -> Candidates:
    """Return the clauses that the last search for an invariant of the level found; none without a cache."""
    kept = None if cache is None else cache.load(Candidates, *_key(ts))
    return Candidates(found_of=content(ts)) if kept is None else kept


def keep_candidates(
    cache: Cache | None, ts: TransitionSystem, invariant: FoundInvariant, begun: Candidates
) -> None:
    """Keep the clauses that a search found that began with others, whether or not they are ever confirmed."""
    if cache is not None and invariant.clauses:
        cache.store(replace(begun, clauses=invariant.named), *_key(ts))


def _key(ts: TransitionSystem) -> tuple[str, ...]:
    return os.path.realpath(ts.level.span.file), ts.level.name, *(["refusing"] if ts.refuses else [])


def content(ts: TransitionSystem) -> str:
    """Return the digest of all that a proof of the level depends on, wherever the files are."""
    tables = tuple(replace(table, file="", stops=()) for table in ts.program.tables)  # they follow from it
    program = replace(ts.program, file="", tables=tables)
    return hashlib.sha256(repr((program, ts.level.name, ts.links, ts.refuses)).encode()).hexdigest()
