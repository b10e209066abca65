"""One face for every engine of this room: what the search over predicates leaves open is decided by exact means, cheapest first.

In: a level, its cycles, its obligations, and an invariant that proves some of them. Out: a stronger invariant that proves more, for each
more how; and obligations that some run breaks. Nothing is to be believed of it before it is confirmed (`invariant.confirm`): every engine
says what it has found as conditions on leaves. Budgets are in steps.

1. Search of all states, where what the environment may give can be listed and states end (`explicit`).
2. Bounded search: what a short run breaks needs no proof (`bounded`).
3. Spacer, with all that is known already, in rounds of growing budgets (`spacer`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from rcsc.compose.contract.obligations import Obligation, ObligationKey, Sort
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.exact import explicit
from rcsc.compose.exact.bounded import looked
from rcsc.compose.exact.circuit import Circuit, circuit
from rcsc.compose.exact.said import Found, of_states, predicate
from rcsc.compose.exact.spacer import Lemmas, related
from rcsc.compose.invariant.cubes import held
from rcsc.compose.invariant.search import FoundInvariant
from rcsc.proof.solvers.horn import UnreadableError
from rcsc.proof.solvers.smt import Answer

STATED = frozenset({Sort.INVARIANT, Sort.PROPERTY, Sort.REQUIREMENT})
"""Obligations that people state to help a proof."""
CYCLES = 8
"""Cycles of the runs that are looked at before anything is proved."""
ROUNDS = ((1_000_000, True), (4_000_000, True), (20_000_000, False), (60_000_000, True))
"""Steps that Spacer gets for an obligation, round after round, and whether it is told what else is proved: that may help or lead astray.
The first takes less than a second."""
TOGETHER = 110_000_000
"""Steps that it gets for all obligations of a level together."""


@dataclass(slots=True)
class Helped:
    """What the engines have found.

    Attributes:
        invariant: The invariant, and what it leaves open.
        by: For each obligation proved beyond that, how, in words.
        conditions: The conditions that were found, of which the last predicates of the invariant are made.
        broken: Obligations that a run of the circuit breaks.
    """

    invariant: FoundInvariant
    by: dict[ObligationKey, str] = field(default_factory=dict)
    conditions: list[Found] = field(default_factory=list)
    broken: set[ObligationKey] = field(default_factory=set)


@dataclass(slots=True)
class _Open:
    """The obligations that are left, and what is known."""

    ts: TransitionSystem
    firsts: Sequence[Cycle]
    step: Cycle
    wanted: Sequence[Obligation]
    found: Helped
    most: int

    @property
    def left(self) -> list[int]:
        """The obligations that are neither proved nor broken, by position."""
        return [
            at for at in sorted(self.found.invariant.open) if self.wanted[at].key not in self.found.broken
        ]

    def circuit(self, places: Sequence[int]) -> Circuit:
        """Make the circuit of these obligations."""
        return circuit(self.ts, self.firsts, self.step, [self.wanted[at] for at in places])

    def proved(self, places: Sequence[int], conditions: Sequence[Found], by: str) -> None:
        """Take conditions that hold after every cycle, and show these obligations; none that has no words."""
        try:
            said = [predicate(one, self.ts.kinds) for one in conditions]
        except UnreadableError:
            return
        invariant, at = self.found.invariant, len(self.found.invariant.predicates)
        self.found.invariant = replace(
            invariant,
            predicates=(*invariant.predicates, *said),
            clauses=(*invariant.clauses, *(((at + number, 0),) for number in range(len(said)))),
            open=invariant.open.difference(places),
        )
        self.found.conditions += conditions
        self.found.by.update({self.wanted[place].key: by for place in places})

    # --- the engines ---

    def list_states(self) -> None:
        """Search all states: for all obligations at once, else for each by itself, which may depend on less."""
        alone = [[at] for at in self.left]
        for places in [self.left] if self._may_be_listed(self.left) else alone:
            if self._may_be_listed(places):
                made = self.circuit(places)
                if explicit.applies(made):
                    self._listed(made, places)

    def _may_be_listed(self, places: Sequence[int]) -> bool:
        return explicit.may_apply(self.step, [self.wanted[at] for at in places])

    def _listed(self, made: Circuit, places: Sequence[int]) -> None:
        found = explicit.explored(made)
        self.found.broken.update(found.runs)
        kept = [at for at in places if self.wanted[at].key not in found.runs]
        if not found.complete or not kept:
            return
        keys = explicit.keys_of(made, found.states)
        condition = Found(made.leaves, of_states(keys, made.kinds))
        self.proved(kept, [condition], f"by search of all {len(found.states)} states")

    def look_at_short_runs(self) -> None:
        """Leave out what a short run breaks."""
        if left := self.left:
            self.found.broken.update(looked(self.circuit(left), CYCLES).runs)

    def relate(self) -> None:
        """Ask Spacer for each obligation, until a round proves nothing more."""
        spent = 0
        for steps, told in ROUNDS:
            before = None
            while self.left and self.left != before:
                before = self.left
                for at in before:
                    if spent + steps > self.most:
                        return
                    spent += steps
                    answer, conditions = related(
                        self.ts, self.firsts, self.step, self.wanted[at], self._lemmas(told=told), steps
                    )
                    if answer is Answer.UNSATISFIABLE:
                        self.proved([at], conditions, "by Spacer")
                    elif answer is Answer.SATISFIABLE:
                        self.found.broken.add(self.wanted[at].key)

    def _lemmas(self, *, told: bool) -> Lemmas:
        """Return the invariant; with the obligations that are proved and that people have stated, if that is to be `told`."""
        invariant = self.found.invariant
        return Lemmas(
            tuple(held(invariant.predicates, invariant.clauses, self.step.before)),
            tuple(
                owed.holds
                for at, owed in enumerate(self.wanted)
                if told and owed.sort in STATED and at not in invariant.open
            ),
        )


def helped(
    ts: TransitionSystem,
    firsts: Sequence[Cycle],
    step: Cycle,
    wanted: Sequence[Obligation],
    invariant: FoundInvariant,
    most: int = TOGETHER,
) -> Helped:
    """Prove more obligations than an invariant does; `most` is what Spacer gets for all of them, in steps."""
    every = _Open(ts, firsts, step, wanted, Helped(invariant), most)
    if every.left:
        every.list_states()
        if not ts.refuses:  # else what is left is tried once more without refusals
            every.look_at_short_runs()
            every.relate()
    return every.found
