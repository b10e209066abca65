"""Minimal cores: which uses and assumptions the proof of a requirement needs.

In: the questions of a level in one environment, in which a use that is off writes any value (`How.FREE`). Out: a `Core` of a requirement.

What is left out of a core has a proof without it: whatever it wrote, the requirement would hold. What is in it was needed by this proof;
another might do without. So each member is left out in turn: what is left of the clauses may still show the requirement (cheap); if
not, a short run may break it; where all states can be listed, a longer run does, or another proof is found. A core is said to be *minimal*
only if for each member there is such a run, with just the other members on. More switched off allows more runs, so a run stays one when
other members go.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from rcsc.compose.contract.claims import ACCEPTED, Key
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.coverage.parts import Use, switched
from rcsc.compose.coverage.questions import Member, Needed, Questions, with_program
from rcsc.compose.coverage.tried import short_runs, tried
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.level import prove_again
from rcsc.proof.solvers import smt

FINDING = 100_000_000
"""Steps of Z3 to find one, some minute; then nothing is known of it."""
STEPS = 15_000_000
"""Steps of Z3 to make it smaller, some ten seconds; then it is left as it is."""
MOST_TRIED, CYCLES = 60, 6
"""Members of a core that are looked at one by one, and cycles of the runs that are looked for first."""


@dataclass(frozen=True, slots=True)
class Core:
    """What a requirement needs.

    Attributes:
        key: The obligation.
        uses: In the order of the program; with them the `assumptions`, by name.
        minimal: Whether a run breaks the requirement without any one of them.
    """

    key: Key
    uses: tuple[Use, ...]
    assumptions: tuple[str, ...]
    minimal: bool


def core(asked: Questions, key: Key) -> Core | None:
    """Return the core of a requirement that is proved; None where Z3 does not show it once more from the invariant."""
    with smt.together(FINDING):
        found = asked.needed([key], asked.members, asked.clauses)
    if found is None:
        return None
    with smt.together(STEPS):
        found = _fewer(asked, key, found)
    members, minimal = each_needed(asked, key, found.members)
    every = [one for one in asked.members if one in members]
    uses = tuple(one for one in every if isinstance(one, Use))
    return Core(key, uses, tuple(one for one in every if isinstance(one, str)), minimal)


def joined(found: Core, lasts: Sequence[Core]) -> Core:
    """Return the core of what has to come within a bound with what keeps the level going, where something is assumed over time."""
    uses = {use: None for one in (found, *lasts) for use in one.uses}
    names = {name: None for one in (found, *lasts) for name in one.assumptions}
    same = len(uses) == len(found.uses) and len(names) == len(found.assumptions)
    return Core(found.key, tuple(uses), tuple(names), found.minimal and same)


def _fewer(asked: Questions, key: Key, found: Needed) -> Needed:
    """Leave out members that the clauses of a proof can do without."""
    for member in asked.members:
        if member not in found.members or smt.spent():
            continue
        left = found.members - {member}
        clauses = asked.kept(left, sorted(found.clauses))
        if clauses is not None and asked.follow([key], left, clauses):
            found = asked.needed([key], left, clauses) or found
    return found


def each_needed(asked: Questions, key: Key, members: frozenset[Member]) -> tuple[frozenset[Member], bool]:
    """Leave out members without which another proof is found; return whether each of the others is needed."""
    if len(members) > MOST_TRIED:
        return members, False
    broken = _broken_without(asked, key, members)
    for member in [one for one in asked.members if one in members and one not in broken]:
        left = members - {member}
        ts = with_just(asked, left)
        runs = tried(ts, [key])
        if runs.broken:
            continue
        if not runs.complete:
            return members, False
        proof = prove_again(ts, asked.proof, Effort(looks=False))
        if not any(owed.key == key and verdict in ACCEPTED for owed, verdict in proof.verdicts):
            return members, False
        members = left
    return members, True


def _broken_without(asked: Questions, key: Key, members: frozenset[Member]) -> set[Member]:
    """Return those of the members without which a short run breaks a requirement, with just the others on."""
    uses = [one for one in asked.members if isinstance(one, Use)]
    left_out = [one for one in uses if one in members]
    off = [[use for use in uses if use not in members or use == one] for one in left_out]
    ts = with_program(asked.ts, asked.made.program, asked.ts)
    ts.trusted = frozenset(name for name in ts.trusted if name in members)
    found = short_runs(ts, asked.made, off, [key], CYCLES)
    return {left_out[at] for at in found}


def with_just(asked: Questions, on: Collection[Member]) -> TransitionSystem:
    """Return the level in which just these members are on."""
    program = switched(asked.ts.program, asked.ts.level, asked.how, lambda use: use in on).program
    given = tuple(fact for fact in asked.ts.links.given if fact.name in on)
    made = with_program(replace(asked.ts, links=replace(asked.ts.links, given=given)), program, asked.ts)
    made.trusted = frozenset(name for name in made.trusted if name in on)
    return made
