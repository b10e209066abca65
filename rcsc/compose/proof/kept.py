"""Proofs of levels that an earlier run made, taken from the cache.

In: a transition system, an effort, a cache. Out: the same `LevelProof`, or nothing. The key is all that a proof depends on: the program as
resolved, the level, its links, the effort; and rcsc itself with its solvers (`base.host.cache`). A proof with anything undecided is not
kept: another run may decide it. The verdicts are kept once more, without effort and invariant (`standing`).
"""

import hashlib
from dataclasses import dataclass

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import Key
from rcsc.compose.contract.obligations import Obligation, Unstated, obligations
from rcsc.compose.contract.predicates import CLOSELY
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.pdr import Clause
from rcsc.compose.invariant.search import Effort, read
from rcsc.compose.proof.assume_guarantee import of_level
from rcsc.compose.proof.candidates import content
from rcsc.compose.proof.context import Context
from rcsc.compose.proof.level import LevelProof, Verdict, joined
from rcsc.compose.proof.standing import Verdicts, keep_verdicts
from rcsc.compose.proof.termination import Ending


@dataclass(frozen=True, slots=True)
class _Kept:
    """A proof as it is kept: obligations by key, predicates by name; the transition system gives both anew."""

    verdicts: tuple[tuple[Key, Verdict], ...]
    predicates: tuple[str, ...]
    clauses: tuple[Clause, ...]
    walked: int
    learnt: int
    seconds: float
    context: Context | None
    endings: tuple[Ending, ...]
    unstated: tuple[Unstated, ...]
    stands: bool
    parts: "tuple[_Kept, ...]" = ()


def recall(cache: Cache, ts: TransitionSystem, effort: Effort) -> LevelProof | None:
    """Return the proof of the level, if it is kept."""
    kept = cache.load(_Kept, *_key(ts, effort))
    proof = None if kept is None else _whole(ts, kept)
    if proof is not None:
        keep_verdicts(cache, content(ts), _shortened(ts, proof))  # they may have been pruned
    return proof


def _whole(ts: TransitionSystem, kept: _Kept) -> LevelProof | None:
    """Return the proof with its parts: with refusals, where there are any, and without."""
    if not kept.parts:
        return _recalled(ts.refusing(), kept)
    with_refusals, without = (
        _recalled(each, part) for each, part in zip((ts.refusing(), ts), kept.parts, strict=True)
    )
    return None if with_refusals is None or without is None else joined(with_refusals, without)


def _recalled(ts: TransitionSystem, kept: _Kept) -> LevelProof | None:
    """Return the proof of one environment, if it is of the level as it is."""
    cycle = ts.cycle(ts.havoc())
    wanted = obligations(ts, cycle)
    if [obligation.key for obligation in wanted] != [key for key, _ in kept.verdicts]:
        return None
    for closely in range(CLOSELY + 1):
        chosen = every_predicate(ts, cycle, read(cycle, wanted), closely)
        if tuple(predicate.name for predicate in chosen) == kept.predicates:
            verdicts = tuple(
                (goal, verdict) for goal, (_, verdict) in zip(wanted, kept.verdicts, strict=True)
            )
            return LevelProof(
                ts.level.name, verdicts, chosen, kept.clauses, kept.walked, kept.learnt, kept.seconds, cached=True,
                context=kept.context, endings=kept.endings, unstated=kept.unstated, stands=kept.stands,
            )  # fmt: skip
    return None


def keep(cache: Cache, ts: TransitionSystem, effort: Effort, proof: LevelProof) -> None:
    """Keep the proof, unless something was left undecided."""
    if any(verdict is Verdict.UNDECIDED for part in (proof, *proof.parts) for _, verdict in part.verdicts):
        return
    cache.store(_kept(proof), *_key(ts, effort))
    keep_verdicts(cache, content(ts), _shortened(ts, proof))


def _kept(proof: LevelProof) -> _Kept:
    return _Kept(
        tuple((obligation.key, verdict) for obligation, verdict in proof.verdicts),
        tuple(predicate.name for predicate in proof.predicates), proof.clauses, proof.walked, proof.learnt, proof.seconds,
        proof.context, proof.endings, proof.unstated, proof.stands, tuple(map(_kept, proof.parts)),
    )  # fmt: skip


def _shortened(ts: TransitionSystem, proof: LevelProof) -> Verdicts:
    """Shorten the proof to its verdicts, without the invariant."""
    claims = dict(of_level(ts, proof))
    return Verdicts(
        claims,
        tuple(map(_with_table, proof.open)),
        tuple(unstated.shown for unstated in proof.unstated if unstated.applies),
    )


def _with_table(obligation: Obligation) -> str:
    return f"table `{obligation.table}`: {obligation.shown}" if obligation.table else obligation.shown


def _key(ts: TransitionSystem, effort: Effort) -> tuple[str, ...]:
    return content(ts), hashlib.sha256(repr(effort).encode()).hexdigest()
