"""What was proved of a system, for whoever plays episodes of it: the claims that `rcsc prove` calls proved, as values.

In: a system's description and the cache. Out: `Claims`. The proof is the kept one where the levels were proved before, else it is
made now with the effort that `rcsc prove` takes, and kept. So are answers to requirements across levels.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from rcsc.base.diagnostics.coded import CodedError
from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import (
    AGAIN,
    CONTRACT,
    DECLARED,
    ENDING,
    GIVEN,
    RESTING,
    RUNS,
    SAFE,
    STANDS,
    UNREACHED,
    Key,
    spelled,
    trust_of,
)
from rcsc.compose.contract.environment import Above, Below
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.proof.candidates import content
from rcsc.compose.proof.context import lines_write
from rcsc.compose.proof.level import LevelProof
from rcsc.compose.proof.system import SystemProof, read_systems
from rcsc.compose.together.kept import answered
from rcsc.compose.together.left_open import whole_proof
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import NO_RESTART, questions
from rcsc.compose.together.said import timing_of
from rcsc.compose.together.words import stated_across
from rcsc.run.description import Description, description
from rcsc.run.episodes.proved.claims import (
    ASSUMED,
    RESTARTS,
    AcrossClaim,
    Claim,
    Claims,
    ProvedLevel,
    Trusted,
    WatchedNeighbour,
)

_TOGETHER = frozenset({RUNS, ENDING, RESTING})
"""Claims that are all of several others, which are watched one by one."""
_NAMES = {
    CONTRACT: "CONTRACT",
    GIVEN: "GIVEN",
    STANDS[0]: "STANDS",
    UNREACHED: "UNREACHED",
    AGAIN: "AGAIN",
    SAFE[0]: "SAFE",
}
"""What sorts are called that are no obligation's."""


def claims_of(path: Path, cache: Cache | None, jobs: int = 1) -> Claims:
    """Return the proved claims of a system; none, and the reason, where its levels cannot be read."""
    try:
        systems = read_systems(path)[0]
    except CodedError as error:
        return Claims(why=str(error))
    whole = whole_proof(systems, description(path), jobs=jobs, cache=cache)
    claims = proved_claims(path, whole.systems, whole.proof)
    return replace(claims, across=tuple(_across(description(path), whole.systems, whole.proof, cache)))


def _across(
    system: Description, systems: dict[str, TransitionSystem], proof: SystemProof, cache: Cache | None
) -> Iterator[AcrossClaim]:
    """Yield what is proved across levels, with all that it rests on."""
    stated = stated_across(system, {name: ts.program for name, ts in systems.items()})
    if stated is None:
        return
    for question in questions(systems, system, stated[0], proof):
        found = answered(question, cache)
        closed = found.closed(systems, proof.closed)
        if not closed.proved:
            continue
        across = {f"assumption `{name}` across levels{DECLARED}": name for name in found.assumed}
        trusts = tuple(
            Trusted(RESTARTS, "", "", words)
            if words == NO_RESTART
            else Trusted(ASSUMED, "", across[words], words)
            if words in across
            else Trusted(*trust_of(words), words)
            for words in closed.trusts
        )
        yield AcrossClaim(found.stated.name, found.timing is not Timing.ANY, timing_of(found), trusts)


def proved_claims(path: Path, systems: dict[str, TransitionSystem], proof: SystemProof) -> Claims:
    """Return the claims of a proof that are proved with all that they rest on."""
    owners = {wire.target: wire.source.partition(".")[0] for wire in description(path).wires}
    proofs = {level.level: level for level in proof.levels}
    levels = []
    for name, ts in systems.items():
        filled = tuple(
            target.partition(".")[2]
            for target, owner in owners.items()
            if owner in systems and target.startswith(f"{name}.")
        )
        claims = tuple(_claims(name, ts, proofs[name], proof))
        above = None if ts.links.above is None else _above(ts.links.above)
        below = tuple(map(_below, ts.links.below))
        levels.append(ProvedLevel(name, content(ts), above, below, claims, filled))
    return Claims(
        tuple(levels), "" if any(level.claims for level in levels) else "nothing is proved of its levels"
    )


def _claims(name: str, ts: TransitionSystem, level: LevelProof, proof: SystemProof) -> Iterator[Claim]:
    owed = {one.name: one.condition for one in ts.links.owes}
    endings = {ending.table: ending for ending in level.endings}
    for (owner, key), closed in proof.closed.items():
        if owner != name or key in _TOGETHER or not closed.proved or closed.verdict.value != "proved":
            continue
        if key[0] == AGAIN and not ts.links.below:
            continue  # it is about levels that give orders
        trusts = tuple(Trusted(*trust_of(words), words) for words in closed.trusts)
        about: tuple[str, ...] = ()
        stands: tuple[str, ...] = ()
        if key[0] == Sort.ENDS:
            about, stands = endings[key[1]].still, endings[key[1]].settled
        elif key[0] == AGAIN:
            about = tuple(lines_write(ts))
        words = spelled((owner, key), name)
        yield Claim(name, _kind(key), key[1], key[2], words, trusts, about, stands, owed.get(key[2]))


def _kind(key: Key) -> str:
    """Return the name of a claim's sort; "" for an unknown sort, which is told to be watched by nobody."""
    known = {sort.value: sort.name for sort in Sort} | _NAMES
    return known.get(key[0], "")


def _above(end: Above) -> WatchedNeighbour:
    return WatchedNeighbour(
        end.name, end.order, end.report, end.outside, done=end.done, failed=end.failed, numbered=end.numbered
    )


def _below(end: Below) -> WatchedNeighbour:
    return WatchedNeighbour(
        end.name,
        end.order,
        end.report,
        end.outside,
        done=end.done,
        failed=end.failed,
        late=end.late or "",
        in_time=end.answers_in_time,
    )
