"""Whole systems, proved, and every claim that is proved held against what can happen to them.

In: a system as text (`drawn`). Out: what disagrees. A claim is compared whatever its sort, with all that it rests on and trusts: of levels
that run together with real buffers (`whole`). What a claim trusts is left out of the runs that it is held against, and nothing else.
"""

import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from random import Random

from rcsc.compose.contract.claims import (
    AGAIN,
    CONTRACT,
    ENDING,
    GIVEN,
    NOT_FOR_EVER,
    RESTING,
    RUNS,
    STANDS,
    UNREACHED,
    Closed,
    Key,
    Need,
    closed,
)
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.assume_guarantee import claims
from rcsc.compose.proof.level import LevelProof, prove_level
from rcsc.compose.proof.system import NoProgramError, transition_systems
from rcsc.lang.leaves import read_by
from rcsc.run.description import BadDescription, Description, description
from tests.small_hierarchies.level import Role
from tests.whole_systems.link import Drawn
from tests.whole_systems.part import Owed, Part
from tests.whole_systems.rounds import goes_on
from tests.whole_systems.whole import Ends, Searched, Whole, Wire, searched

LITTLE = Effort(walks=6, cycles=20)
MOST = 400
"""States of a whole system that are worth listing."""
COMPARED = frozenset(
    {
        Sort.ASSUMPTION, Sort.SOME_LINE, Sort.ONE_LINE, Sort.NO_DEFAULT, Sort.ECHOES, Sort.NUMBERED, Sort.NEXT_NUMBER,
        Sort.WAITS, Sort.ONCE, Sort.ANSWERED, Sort.PAUSES, Sort.DONE_STAYS, Sort.FAILED_STAYS, Sort.DEFERRED, Sort.INVARIANT,
        Sort.PROPERTY, Sort.OWED, Sort.ENDS, Sort.SAFE,
    }
)  # fmt: skip
"""Sorts of claims that are held against every run."""
LEFT_OUT: Mapping[str, str] = {
    Sort.SAME_ORDER: "a level's contract, not its claim: compared as the contract of what it takes",
    Sort.OF_ITS_ORDER: "a level's contract, not its claim: compared as the contract of what it takes",
    Sort.REQUIREMENT: "held against every run of small levels in `over_time`",
    Sort.KEPT: "what is assumed over time: held against every run of small levels in `over_time`",
    Sort.PROTOCOL: "names all sorts of the protocol at once where they cannot be stated",
}
"""Sorts that are no claims of their own, with the reason."""
COMPARED_BESIDES = frozenset({CONTRACT, GIVEN, UNREACHED, STANDS[0]})
LEFT_OUT_BESIDES: Mapping[str, str] = {
    RUNS[0]: "says that lines, safety and the contract are proved; each of these is compared",
    ENDING[0]: "says that the commands of all tables end; each of these is compared",
    RESTING[0]: "says that the first command ends, which is compared",
    AGAIN: "what a line does once more is told, and nothing rests on it",
}
FOR_EVER = (NOT_FOR_EVER, "refused only finitely often")
"""How what is trusted ends of refusals that may be, but not for ever."""
NO_REFUSAL, ANY = 1, 3
"""Ranks of events of which a claim speaks."""


_KNOWN: dict[tuple[str, ...], LevelProof] = {}


def forget() -> None:
    """Drops what is known of levels."""
    _KNOWN.clear()


def held(made: Drawn, seed: int, counts: Counter[str], most: int = MOST) -> list[tuple[str, str, str, str]]:
    """What disagrees: what happened, the level, the claim, and its events' rank."""
    with tempfile.TemporaryDirectory(prefix="rcsc-whole-") as folder:
        for name, text in made.files:
            (Path(folder) / name).write_text(text, encoding="utf-8")
        path = Path(folder) / "system.toml"
        try:
            systems = transition_systems(path)
            system = description(path)
        except (NoProgramError, BadDescription) as error:
            counts["links that differ are refused" if made.differs else "systems that are refused"] += 1
            if made.differs and not _compares(error):
                return [
                    ("two declarations of one link differ, and something else is said", "", str(error), "")
                ]
            return []
    if made.differs:
        return [("two declarations of one link differ, and nothing is said", "", made.differs, "")]
    return list(_compared(made, systems, system, Random(seed), counts, most))  # noqa: S311  # repeatable


def _compared(
    made: Drawn,
    systems: Mapping[str, TransitionSystem],
    system: Description,
    random: Random,
    counts: Counter[str],
    most: int,
) -> Iterator[tuple[str, str, str, str]]:
    proofs = {name: _proof(made, name, ts) for name, ts in systems.items()}
    follows = closed(claims(systems, proofs))
    yield from _unknown(follows)
    yield from run_together(systems, system, follows, proofs, random, counts, most)


def run_together(
    systems: Mapping[str, TransitionSystem],
    system: Description,
    follows: Mapping[Need, Closed],
    proofs: Mapping[str, LevelProof],
    random: Random,
    counts: Counter[str],
    most: int,
) -> Iterator[tuple[str, str, str, str]]:
    """What is proved of a system and breaks in its runs: as `held` says it."""
    whole = assembled(systems, system, follows, proofs)
    found = searched(whole, random, most)
    names = list(systems)
    counts["whole systems"] += 1
    counts["whole systems listed to the end"] += found.whole
    counts["states of whole systems"] += len(found.states)
    counts["claims proved"] += sum(map(len, whole.claimed))
    counts["claims not proved"] += sum(not one.proved for one in follows.values())
    for event in found.events:
        counts[f"event: {event.value[0]}"] += 1
    broken: dict[tuple[int, Key], int] = {}
    for level, key, rank in found.broken:
        broken[level, key] = min(rank, broken.get((level, key), ANY))
    counts["claims broken by some run"] += sum(key[0] != UNREACHED for _, key in broken)
    for (level, key), rank in sorted(broken.items()):
        if rank <= whole.claimed[level].get(key, -1):
            yield "proved, but breaks in a run of the whole", names[level], " ".join(key), str(rank)
    for level, ends in enumerate(whole.ends):
        for table, (still, *ranks) in ends.items():
            counts["endings of whole systems"] += 1
            if goes_on(whole, found, level, table, still, *ranks):
                yield "shown to end, but goes on in the whole", names[level], table, ", ".join(sorted(still))


def everything(files: Mapping[str, str], folder: Path, most: int = 300) -> Searched:
    """What happens to a system, whatever is claimed of it."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    path = folder / "system.toml"
    whole = assembled(transition_systems(path), description(path), {}, {})
    return searched(whole, Random(0), most)  # noqa: S311  # repeatable


def _compares(error: Exception) -> bool:
    return "link" in str(error)


def _unknown(follows: Mapping[Need, Closed]) -> Iterator[tuple[str, str, str, str]]:
    known = {*map(str, COMPARED), *map(str, LEFT_OUT), *COMPARED_BESIDES, *LEFT_OUT_BESIDES}
    for sort in sorted({str(key[0]) for _, key in follows} - known):
        yield "a claim that nobody compares", "", sort, ""


def _proof(made: Drawn, name: str, ts: TransitionSystem) -> LevelProof:
    text = dict(made.files)
    words = (text[f"{name}.rcs"], text.get("words.rcs", ""), repr(ts.links))
    if words not in _KNOWN:
        _KNOWN[words] = prove_level(ts, LITTLE)
    return _KNOWN[words]


# --- what is claimed ------------------------------------------------------------------------------


def assembled(
    systems: Mapping[str, TransitionSystem],
    system: Description,
    follows: Mapping[Need, Closed],
    proofs: Mapping[str, LevelProof],
) -> Whole:
    """The system as it runs, with what is claimed of it."""
    names = list(systems)
    wires = []
    for wire in system.wires:
        (source, given), (target, taken) = (end.split(".", 1) for end in (wire.source, wire.target))
        if source in systems and target in systems:
            orders = {below.order for below in systems[source].links.below}
            out, into = _leaves(systems[source], given), _leaves(systems[target], taken)
            wires.append(Wire(names.index(source), out, names.index(target), into, given in orders))
    parts = []
    for at, (name, ts) in enumerate(systems.items()):
        fed = frozenset(leaf for wire in wires if wire.target == at for leaf in wire.taken)
        still = {one for ending in (proofs[name].endings if name in proofs else ()) for one in ending.still}
        varied = frozenset(leaf for leaf in ts.inputs if leaf.partition(".")[0] in still and leaf not in fed)
        parts.append(Part(Role(ts.program, ts.level, ts.links), fed, varied))
    for at, part in enumerate(parts):
        out_of = {
            leaf: (wire.source, other)
            for wire in wires
            if wire.target == at
            for leaf, other in zip(wire.taken, wire.given, strict=True)
        }
        for fact, condition in part.facts.items():
            ends_ = {str(leaf): out_of[str(leaf)] for leaf in read_by(condition)}
            if len(writers := {source for source, _ in ends_.values()}) == 1:
                owed = Owed(
                    f"{names[at]}.{fact}", condition, {leaf: other for leaf, (_, other) in ends_.items()}
                )
                parts[writers.pop()].owes.append(owed)
    claimed = [_claimed(follows, name) for name in names]
    ends = [_ends(follows, proofs[name], parts[at].fed) for at, name in enumerate(names) if name in proofs]
    return Whole(parts, wires, claimed, ends)


def _leaves(ts: TransitionSystem, record: str) -> tuple[str, ...]:
    return tuple(
        str(v.name) for v in ts.program.variables if v.name == record or v.name.startswith(f"{record}.")
    )


def _claimed(follows: Mapping[Need, Closed], level: str) -> dict[Key, int]:
    return {
        key: speaks_of(one.trusts) for (name, key), one in follows.items() if name == level and one.proved
    }


def speaks_of(trusts: Sequence[str]) -> int:
    """The greatest rank of the events of which a claim speaks that trusts this."""
    refused = [one for one in trusts if "refused" in one and not one.endswith(FOR_EVER)]
    return NO_REFUSAL if refused else ANY


def _ends(follows: Mapping[Need, Closed], proof: LevelProof, fed: frozenset[str]) -> dict[str, Ends]:
    """Tables whose commands end; values that another level gives do not stand still because somebody says so."""
    found = {}
    for ending in proof.endings:
        one = follows[proof.level, (Sort.ENDS, ending.table, "")]
        if one.proved:
            outside = frozenset(
                still for still in ending.still if not any(leaf.partition(".")[0] == still for leaf in fed)
            )
            rank = speaks_of(one.trusts)
            finitely = any(trust.endswith(FOR_EVER) for trust in one.trusts)
            found[ending.table] = outside, rank, NO_REFUSAL if finitely else rank
    return found
