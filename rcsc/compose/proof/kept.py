"""Proofs of levels that an earlier run made, taken from the cache.

In: a transition system, an effort, a cache. Out: the same `LevelProof`, or nothing. The key is all that a proof depends on: the program as
resolved, the level, its links, the effort; and rcsc itself with its solvers (`rcsc.host.cache`). Where anything was left undecided nothing
is kept: another run may decide it. What was found is kept once more without the effort and without what shows it (`standing`).
"""

import hashlib
from dataclasses import asdict, replace
from typing import Any

from rcsc.compose.contract.obligations import Obligation, Sort, Unstated, obligations
from rcsc.compose.contract.predicates import CLOSELY, Predicate
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import Effort, read
from rcsc.compose.proof.assume_guarantee import of_level
from rcsc.compose.proof.context import Context, RepeatedLine
from rcsc.compose.proof.level import LevelProof, Verdict, essential
from rcsc.compose.proof.ranking import Counted
from rcsc.compose.proof.standing import Verdicts, keep_verdicts
from rcsc.compose.proof.termination import Ending
from rcsc.host.cache import Cache


def recall(cache: Cache, ts: TransitionSystem, effort: Effort) -> LevelProof | None:
    """Return the proof of the level, if it is kept."""
    kept = cache.load(*_key(ts, effort))
    if kept is None:
        return None
    cycle = ts.cycle(ts.havoc())
    wanted = obligations(ts, cycle)
    if [list(obligation.key) for obligation in wanted] != [one["goal"] for one in kept["found"]]:
        return None
    for closely in range(CLOSELY + 1):
        chosen = every_predicate(ts, cycle, read(ts, cycle, wanted), closely)
        if [one.name for one in chosen] == kept["features"]:
            verdicts = (Verdict(one["verdict"]) for one in kept["found"])
            proof = _proof(kept, tuple(zip(wanted, verdicts, strict=True)), chosen, ts)
            keep_verdicts(cache, content(ts), _shortened(ts, proof))  # they may have been pruned
            return proof
    return None


def _proof(
    kept: dict[str, Any], found: tuple[Any, ...], chosen: tuple[Predicate, ...], ts: TransitionSystem
) -> LevelProof:
    clauses = tuple(tuple((at, value) for at, value in clause) for clause in kept["clauses"])
    return LevelProof(
        ts.level.name, found, chosen, clauses, kept["walked"], kept["learnt"], kept["seconds"], cached=True,
        context=_context(kept["context"]), endings=tuple(_ending(one) for one in kept["endings"]),
        unstated=tuple(Unstated(Sort(sort), table, missing) for sort, table, missing in kept["unlooked"]),
    )  # fmt: skip


def _context(kept: dict[str, Any] | None) -> Context | None:
    if kept is None:
        return None
    unreached = tuple((table, line) for table, line in kept["unreached"])
    repeated = tuple(
        RepeatedLine(one["table"], one["line"], tuple(one["leaves"])) for one in kept["repeated"]
    )
    unsure = tuple((table, line) for table, line in kept["unsure"])
    return Context(unreached, repeated, kept["restless"], unsure, kept["orders"])


def _ending(kept: dict[str, Any]) -> Ending:
    counted = tuple(Counted(**one) for one in kept["counted"])
    return Ending(kept["table"], kept["changes"], counted, tuple(kept["still"]), tuple(kept["endless"]))


def keep(cache: Cache, ts: TransitionSystem, effort: Effort, proof: LevelProof) -> None:
    """Keep the proof, unless something was left undecided."""
    if any(verdict is Verdict.UNDECIDED for _, verdict in proof.found):
        return
    value = {
        "found": [
            {"goal": list(obligation.key), "verdict": verdict.value} for obligation, verdict in proof.found
        ],
        "features": [one.name for one in proof.predicates],
        "clauses": proof.clauses,
        "walked": proof.walked,
        "learnt": proof.learnt,
        "seconds": proof.seconds,
        "context": None if proof.context is None else asdict(proof.context),
        "endings": [asdict(one) for one in proof.endings],
        "unlooked": [[one.sort, one.table, one.missing] for one in proof.unstated],
    }
    cache.store(value, *_key(ts, effort))
    keep_verdicts(cache, content(ts), _shortened(ts, proof))


def _shortened(ts: TransitionSystem, proof: LevelProof) -> Verdicts:
    """Shorten the proof to what was found, without what shows it."""
    claims = dict(of_level(ts, proof))
    return Verdicts(claims, tuple(map(_said, essential(proof))), tuple(one.shown for one in proof.unstated))


def _said(obligation: Obligation) -> str:
    return f"table `{obligation.table}`: {obligation.shown}" if obligation.table else obligation.shown


def _key(ts: TransitionSystem, effort: Effort) -> tuple[str, ...]:
    return "composed", content(ts), hashlib.sha256(repr(effort).encode()).hexdigest()


def content(ts: TransitionSystem) -> str:
    """Return the digest of all that a proof of the level is about, wherever the files stand."""
    tables = tuple(replace(one, file="", stops=()) for one in ts.program.tables)  # they follow from it
    program = replace(ts.program, file="", tables=tables)
    return hashlib.sha256(repr((program, ts.level.name, ts.links)).encode()).hexdigest()
