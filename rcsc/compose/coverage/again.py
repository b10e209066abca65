"""A level proved again after a small change, from what is left of its invariant: with few walks, and without exact engines.

In: the level as changed, the proof of the one before. Out: whether an invariant was found that shows some claims, and Z3 confirms it.
"""

from collections.abc import Collection, Iterable
from dataclasses import replace

from rcsc.compose.contract.claims import Key
from rcsc.compose.contract.obligations import obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.parts import How
from rcsc.compose.coverage.questions import LIMITS, Questions
from rcsc.compose.invariant.search import Effort, FoundInvariant, begin, search
from rcsc.compose.proof.level import LevelProof
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.sat import GaveUpError

EFFORT = Effort(walks=4, limits=LIMITS)
STEPS = 200_000_000
"""Steps of Z3 within one search."""


def shown_again(
    ts: TransitionSystem, proof: LevelProof, clauses: Iterable[int], keys: Collection[Key]
) -> bool:
    """Return whether a level has an invariant that shows these claims.

    Args:
        ts: The level, in one environment.
        proof: Of another version, in the same one.
        clauses: Those of its clauses to begin with, by position.
        keys: The claims.
    """
    cycle, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
    wanted = obligations(ts, cycle)
    owed = frozenset(at for at, each in enumerate(wanted) if each.key in keys)
    named = FoundInvariant(proof.predicates, tuple(proof.clauses[at] for at in clauses)).named
    try:
        with smt.together(STEPS):
            found = search(
                ts, firsts, cycle, wanted, EFFORT, named, replace(begin(ts, wanted, EFFORT), open=owed)
            )
    except GaveUpError:
        return False
    if found.open:
        return False
    again = Questions(ts, replace(proof, predicates=found.predicates, clauses=found.clauses), How.LEFT_OUT)
    kept = again.kept(again.members, again.clauses)
    return kept is not None and again.follow(keys, again.members, kept)
