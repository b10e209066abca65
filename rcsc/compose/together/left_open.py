"""What the contract leaves open of a level, asked of it together with the levels that write to it.

In: the proofs of all levels alone. Out: the same, with what is proved of several together, and what that trusts.

The contract says nothing of a plain output, which no protocol numbers: alone a level is proved for any value, and of two buffers for values
of any age. *The level above never sets both* is then open, though it never does. As levels are scheduled, or with buffers that are no later
than the system says, the product knows what is taken: what the writer gave, all of it in one cycle.

Why levels that are proved so may be taken together. Each obligation is a condition on one cycle. It is shown of every tick of the product,
whose levels run as their tables say, however they are refused and begin anew. That every level does so in the ticks before is a claim on
which this one rests (`claims.RUNS`), and which may rest on this one in turn. Such a circle is induction over ticks (`compose.__doc__`): a
cycle takes what was given in ticks before it. Nothing here takes for granted that a cycle goes on in the tick that is looked at
(`proof.proved`). The empty buffers before the first tick, and what stands in them where a level begins anew, are the product's.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from rcsc.base.host.cache import Cache
from rcsc.compose.contract.claims import Key, Trust, Verdict, closed
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.invariant.search import LIMITS, Effort
from rcsc.compose.proof.assume_guarantee import admitted, agreements, claims
from rcsc.compose.proof.eventually import waiting
from rcsc.compose.proof.level import LevelProof, NotConfirmedError, ProvedTogether, confirm_owed
from rcsc.compose.proof.system import SystemProof, prove_transition_systems
from rcsc.compose.together.features import features
from rcsc.compose.together.plain import with_what_is_kept
from rcsc.compose.together.product import Tick, Timing, Together, together, writers
from rcsc.compose.together.proof import searched
from rcsc.lang.resolve.across import stating_nothing
from rcsc.proof.solvers.sat import GaveUpError
from rcsc.proof.symbolic import values
from rcsc.run.description import Description
from rcsc.run.log.across import parties

ASKED = frozenset(
    {
        Sort.ASSUMPTION,
        Sort.SOME_LINE,
        Sort.ONE_LINE,
        Sort.NO_DEFAULT,
        Sort.OWED,
        Sort.INVARIANT,
        Sort.PROPERTY,
        Sort.REQUIREMENT,
    }
)
"""Sorts that say the same of a tick in which the level begins anew as of any other."""


@dataclass(frozen=True, slots=True)
class WholeProof:
    """The proof of all levels of a system.

    Attributes:
        systems: The levels with what was found of their plain outputs; `alone`, the proof of these, each alone.
        proof: That, with what levels together show of claims that are open.
    """

    systems: dict[str, TransitionSystem]
    alone: SystemProof
    proof: SystemProof


def whole_proof(
    systems: Mapping[str, TransitionSystem],
    system: Description,
    effort: Effort | None = None,
    jobs: int = 1,
    done: Callable[[LevelProof], None] | None = None,
    cache: Cache | None = None,
) -> WholeProof:
    """Prove all levels, each alone, and then what that leaves open; call `done` with each."""
    alone = prove_transition_systems(systems, effort, jobs, tuple(systems), done, cache)
    more, alone = with_what_is_kept(systems, alone, effort or Effort(), cache)
    return WholeProof(more, alone, with_those_together(more, system, alone))


def with_those_together(
    systems: Mapping[str, TransitionSystem], system: Description, whole: SystemProof
) -> SystemProof:
    """Return the proof of a system with what levels together show of claims that are open."""
    proofs = {proof.level: proof for proof in whole.levels}
    if set(proofs) != set(systems):
        return whole
    for name, proof in proofs.items():
        shown = tuple(_Left(systems, system, proofs, name).shown())
        proved = {one.key for one in shown}
        verdicts = tuple((o, Verdict.PROVED if o.key in proved else verdict) for o, verdict in proof.verdicts)
        proofs[name] = replace(proof, verdicts=verdicts, together=shown)
    if not any(proof.together for proof in proofs.values()):
        return whole
    follows = closed(claims(systems, proofs))
    return replace(
        whole, levels=tuple(proofs.values()), agreements=tuple(agreements(systems, proofs)), closed=follows
    )


@dataclass(frozen=True, slots=True)
class _Left:
    """What is left open of a level."""

    systems: Mapping[str, TransitionSystem]
    system: Description
    proofs: Mapping[str, LevelProof]
    level: str

    def shown(self) -> Iterator[ProvedTogether]:
        """Yield what is proved: of few levels, of late buffers, and with refusals, where that suffices."""
        proof, ts = self.proofs[self.level], self.systems[self.level]
        left: set[Key] = {o.key for o in proof.open if o.sort in ASKED and o.name not in waiting(ts)}
        if not left or not self._takes_plain_values():
            return
        refuses = any(one.refusing().refuses for one in self.systems.values())
        for refusing in (True, False) if refuses else (False,):
            for timing in (Timing.LATE, Timing.SCHEDULED) if self.system.late_ticks else (Timing.SCHEDULED,):
                for names in self._parts():
                    found = self._proved(names, timing, left, refusing=refusing) if left else frozenset()
                    for key in sorted(found):
                        yield ProvedTogether(
                            key, names, tuple(self._trusts(names, timing, refusing or not refuses))
                        )
                    left -= found

    def _takes_plain_values(self) -> bool:
        """Return whether the level takes what another gives, and no protocol speaks of."""
        links = self.systems[self.level].links
        return any(links.written_as(leaf) is not None for leaf in links.free)

    def _parts(self) -> Iterator[tuple[str, ...]]:
        """Yield the level with those that write to it, directly, then from further away."""
        known = frozenset({self.level})
        while (more := known | writers(self.system, self.systems, known)) != known:
            known = more
            yield tuple(name for name in self.systems if name in known)

    def _trusts(self, names: tuple[str, ...], timing: Timing, admits: bool) -> Iterator[str]:
        """Yield what the proof trusts besides what its levels do: when they take what others give, and that nothing is refused."""
        for name in names:
            if writers(self.system, self.systems, {name}) & set(names):
                words = Trust.SCHEDULED if timing is Timing.SCHEDULED else Trust.LATE
                yield words.value.replace("LEVEL", name).replace("NAME", str(self.system.late_ticks))
            yield from () if admits else admitted(self.systems[name])

    def _proved(
        self, names: tuple[str, ...], timing: Timing, left: set[Key], *, refusing: bool
    ) -> frozenset[Key]:
        """Return what is proved of these levels together."""
        systems = {name: ts.refusing() if refusing else ts.admitting() for name, ts in self.systems.items()}
        program = stating_nothing(parties(self.system, {name: ts.program for name, ts in systems.items()}))
        ts = together(systems, names, self.system, program, timing, "")
        step, firsts = ts.cycle(ts.havoc()), tuple(ts.firsts().values())
        owed = [self._owed(ts, cycle, left) for cycle in (*firsts, step)]
        chosen = features(ts, step, [one.holds for one in owed[-1]])
        found, _ = searched((*firsts, step), owed, chosen, ())
        for without in (found.open, frozenset(range(len(owed[-1])))):
            wanted = [[one for at, one in enumerate(each) if at not in without] for each in owed]
            with suppress(NotConfirmedError, GaveUpError):
                if wanted[-1]:
                    confirm_owed(found, firsts, step, wanted, LIMITS)
                return frozenset(one.key for one in wanted[-1])
        return frozenset()

    def _owed(self, ts: Together, cycle: Cycle, left: set[Key]) -> list[Obligation]:
        """List the obligations that are left, of the ticks in which the level runs."""
        assert isinstance(cycle, Tick)
        member, due = ts.members[self.level], cycle.due[self.level]
        every = obligations(member, cycle.cycles[self.level])
        return [
            replace(one, holds=values.follows(due, one.holds), lines=()) for one in every if one.key in left
        ]
