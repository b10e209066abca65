"""What the proof of a requirement across levels needs of them: the assignments without which it does not go through.

In: a question with its proof. Out: a `Core`, for each level the uses (`coverage.parts`) in it.

An invariant that shows the requirement is found once more, in levels that have a switch for each use. What is switched off writes any
value, so what is left out has a proof without it. The core is what Z3 needed, clause by clause up to a fixed point
(`coverage.questions`); a clause of a level's own invariant needs what it needs in the proof of that level alone. A core is not made
smaller: another proof may do with less. The protocol and what restarts a level are no uses: nobody wrote them.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcsc.compose.contract.obligations import obligations
from rcsc.compose.contract.transition import Cycle
from rcsc.compose.coverage.parts import How, Switched, Use, switched, uses_of
from rcsc.compose.coverage.questions import Frame, Member, Questions, needed, with_program
from rcsc.compose.invariant.cubes import held
from rcsc.compose.together.eventually import may_wait
from rcsc.compose.together.product import Tick, Together
from rcsc.compose.together.proof import Across, Question, Shown
from rcsc.proof.solvers import smt

if TYPE_CHECKING:
    from rcsc.proof.symbolic.values import Node

STEPS = 100_000_000
"""Steps of Z3 for one requirement, some minute; then nothing is known of it."""


@dataclass(frozen=True, slots=True)
class AcrossCore:
    """What a requirement across levels needs.

    Attributes:
        uses: Of each level of its proof; None where that is not known.
    """

    name: str
    uses: Mapping[str, tuple[Use, ...]] | None

    def of(self, level: str) -> tuple[Use, ...] | None:
        """Return what it needs of a level: nothing of one that its proof is not about; None where that is not known."""
        return None if self.uses is None else self.uses.get(level, ())


def core_across(question: Question, found: Across) -> AcrossCore:
    """Return what a requirement needs; nothing is known of one that is not proved, waits without a bound, or rests on what is assumed."""
    unknown = AcrossCore(found.stated.name, None)
    # What lets assumptions be kept is no goal here; nor is the bound within which something comes.
    if not found.proved or found.assumed or may_wait(found.stated):
        return unknown
    with smt.together(STEPS):
        uses = _needed(question, found)
    if uses is None:
        return unknown
    levels = {
        name: uses_of(ts.program, ts.level) for name, ts in question.systems.items() if name in found.levels
    }
    return AcrossCore(
        found.stated.name,
        {level: tuple(use for use in every if (level, use) in uses) for level, every in levels.items()},
    )


def _needed(question: Question, found: Across) -> frozenset[Member] | None:
    again = question.invariant(found)
    if again is None:
        return None
    ts, shown = again
    frames, clauses = _frames(ts, shown), shown.invariant.clauses
    own = frozenset(at for at, clause in enumerate(clauses) if clause not in shown.known)
    core = needed(frames, [next(iter(frames[0].bad))], frames[0].on, range(len(clauses)), own)
    if core is None:
        return None
    members = set(core.members)
    for level, places in _of_levels(shown, core.clauses).items():
        proof = question.proof_of(level, found.around)
        assert proof is not None
        asked = Questions(ts.members[level], proof, How.FREE)
        more = asked.needed(places, asked.members, asked.clauses)
        if more is None:
            return None
        members |= {(level, use) for use in more.members if isinstance(use, Use)}
    return frozenset(members)


def _of_levels(shown: Shown, clauses: Iterable[int]) -> dict[str, list[int]]:
    """Return those of the clauses that are of levels, by where they stand in the invariant of their level."""
    found: dict[str, list[int]] = {}
    for at in sorted(clauses):
        if (known := shown.known.get(shown.invariant.clauses[at])) is not None:
            found.setdefault(known[0], []).append(known[1])
    return found


def _frames(ts: Together, shown: Shown) -> tuple[Frame, ...]:
    """Make the ticks of levels with switches, as terms; a later one comes first."""
    made = {name: switched(member.program, member.level, How.FREE) for name, member in ts.members.items()}
    loose = replace(
        ts,
        members={
            name: with_program(ts.members[name], one.program, ts.members[name]) for name, one in made.items()
        },
    )
    later = _frame(loose, shown, made, loose.cycle(loose.havoc()), later=True)
    firsts = (_frame(loose, shown, made, tick, later=False) for tick in loose.firsts().values())
    return later, *firsts


def _frame(ts: Together, shown: Shown, made: Mapping[str, Switched], tick: Cycle, *, later: bool) -> Frame:
    assert isinstance(tick, Tick)
    predicates, clauses = shown.invariant.predicates, shown.invariant.clauses
    before = held(predicates, clauses, tick.before) if later else []
    after = held(predicates, clauses, tick.after)
    on: dict[Member, Node] = {
        (level, use): tick.takes[level][switch]
        for level, one in made.items()
        for use, switch in one.switches.items()
    }
    return Frame.of(tick.contract, (before, after), obligations(ts, tick), on, exact=shown.exact)
