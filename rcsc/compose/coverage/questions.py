"""What still follows from an invariant where members are switched off: questions about one cycle, each member and each clause a literal.

In: a level in one environment, its proof there, what a use does that is off. Out: for an obligation and the members that are on whether the
clauses show it, and with which of them and which members: what an unsatisfiable answer of Z3 needed.

Source: Ghassabani, Gacek and Whalen, *Efficient generation of inductive validity cores for safety properties*, 2016: what shows each clause
that is needed is needed, too, up to a fixed point.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.compose.contract.claims import Key
from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.coverage.parts import How, Switched, Use, switched
from rcsc.compose.invariant.cubes import held
from rcsc.compose.proof.level import LevelProof
from rcsc.lang.model import Bool, Program
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Limits
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.keyed import ExactIntegers, Keyed
from rcsc.proof.symbolic.values import Node

LIMITS = Limits.of(4_000_000)
"""Of one question: those that an invariant answers take far less."""

Member: TypeAlias = Use | str | tuple[str, Use]
"""What a proof may need: a use (of several levels with its level), or an assumption that is trusted, or owed by another level, by name."""
Goal: TypeAlias = Key | int
"""An obligation, or a clause by position."""


@dataclass(frozen=True, slots=True)
class Needed:
    """What a proof needs.

    Attributes:
        clauses: Clauses of the invariant, by position: with each other they are one.
    """

    clauses: frozenset[int]
    members: frozenset[Member]


@dataclass(slots=True)
class Frame:
    """A cycle with its solver.

    Attributes:
        held: A literal for each clause before it; none of a first cycle.
        broken: For each clause one that it does not hold after it; `bad`, for each obligation one that it is broken.
        on: The literal of each member.
        differs: One that the cycle leaves anything else than if all uses were on; of no use where that is not asked.
    """

    solver: Solver
    held: list[Term]
    broken: list[Term]
    bad: dict[Key, Term]
    on: dict[Member, Term]
    differs: Term

    @classmethod
    def of(
        cls,
        contract: Node,
        clauses: tuple[Sequence[Node], Sequence[Node]],
        owed: Iterable[Obligation],
        on: Mapping[Member, Node],
        *,
        exact: bool,
        differs: Node = values.FALSE,
    ) -> "Frame":
        """Make the terms of a cycle.

        Args:
            contract: What the environment keeps to in it.
            clauses: That each clause holds before it, none of a first cycle, and after it.
            owed: What it owes.
            on: That each member is on.
            exact: Whether all arithmetic of integers is.
            differs: That it leaves anything else than with all on.
        """
        keyed = ExactIntegers() if exact else Keyed()
        before, after = clauses
        broken = map(values.negation, after)
        bad = {each.key: values.negation(each.holds) for each in owed}
        allowed, *terms = map(keyed.term, [contract, *before, *broken, *bad.values(), *on.values(), differs])
        solver = Solver(LIMITS)
        solver.add(*keyed.ranges, allowed)
        literals = iter(map(solver.switch, terms))
        return cls(
            solver,
            [next(literals) for _ in before],
            [next(literals) for _ in after],
            {key: next(literals) for key in bad},
            {member: next(literals) for member in on},
            next(literals),
        )

    def refuted(self, assuming: Sequence[Term], bad: Term) -> tuple[Term, ...] | None:
        """Return those of the literals that exclude what is bad; None where they do not, or Z3 gives up."""
        if self.solver.check(*assuming, bad) is not Answer.UNSATISFIABLE:
            return None
        return self.solver.core(*assuming)

    def before(self, clauses: Iterable[int]) -> list[Term]:
        """State that these clauses hold before the cycle."""
        return [self.held[at] for at in clauses] if self.held else []

    def just(self, on: Collection[Member]) -> list[Term]:
        """Switch on just these members: another use does not do what is written, another assumption may fail."""
        kept = [term for member, term in self.on.items() if member in on]
        wrong = [term for member, term in self.on.items() if member not in on and not isinstance(member, str)]
        return [*kept, *map(smt.negation, wrong)]


@dataclass(slots=True)
class Questions:
    """The questions of one level in one environment.

    Args:
        ts: The level, refusing inputs or not.
        proof: Its proof in this environment.
        how: What a use does that is off.

    Attributes:
        members: All uses, then all assumptions.
        made: The program with its switches.
    """

    ts: TransitionSystem
    proof: LevelProof
    how: How
    made: Switched = field(init=False)
    members: tuple[Member, ...] = field(init=False)
    _frames: list[Frame] = field(init=False)

    def __post_init__(self) -> None:
        """Make the cycles, as terms."""
        self.made = switched(self.ts.program, self.ts.level, self.how)
        without_given = replace(self.ts, links=replace(self.ts.links, given=()))
        loose = with_program(without_given, self.made.program, self.ts)
        every = [
            (" taken", loose.cycle(loose.havoc())),
            (" at first", loose.cycle(loose.initial(), " at first")),
            (" at restart", loose.cycle(loose.restarted(), " at restart", anew=True)),
        ]
        self._frames = [self._frame(loose, suffix, cycle) for suffix, cycle in every]
        self.members = tuple(self._frames[0].on)

    @property
    def _kept(self) -> list[Key]:
        """What every claim rests on: that what is assumed over time can always be kept; else no cycle follows, and nothing is broken."""
        return [owed.key for owed, _ in self.proof.verdicts if owed.sort is Sort.KEPT]

    @property
    def clauses(self) -> range:
        """All clauses of the invariant."""
        return range(len(self.proof.clauses))

    def _frame(self, loose: TransitionSystem, suffix: str, cycle: Cycle) -> Frame:
        predicates, clauses = self.proof.predicates, self.proof.clauses
        before = held(predicates, clauses, cycle.before) if suffix == " taken" else []
        on: dict[Member, Node] = {use: cycle.taken[name] for use, name in self.made.switches.items()}
        on |= _assumptions(self.ts, cycle)
        as_written = dict.fromkeys(self.made.switches.values(), values.TRUE)
        other = loose.cycle(cycle.before, suffix, {**cycle.taken, **as_written}, anew=cycle.anew)
        differ = values.any_of(
            values.negation(values.equal(cycle.after[name], other.after[name]))
            for name in self.ts.kinds
            if name not in self.ts.inputs
        )
        after = held(predicates, clauses, cycle.after)
        return Frame.of(
            cycle.undeclared, (before, after), obligations(loose, cycle), on,
            exact=self.proof.exact, differs=differ,
        )  # fmt: skip

    # --- what a proof needs ---

    def needed(self, goals: Iterable[Goal], on: Collection[Member], clauses: Iterable[int]) -> Needed | None:
        """Return what shows these goals with these members on, from clauses that are an invariant then; None where nothing does."""
        return needed(self._frames, [*goals, *self._kept], on, clauses)

    # --- what is left of an invariant ---

    def kept(self, on: Collection[Member], clauses: Iterable[int]) -> tuple[int, ...] | None:
        """Return the most of these clauses that are an invariant while just these members are on; None where Z3 gives up.

        Clauses that a cycle breaks are left out until none does.

        Source: Flanagan and Leino, *Houdini, an annotation assistant for ESC/Java*, 2001.
        """
        left = list(clauses)
        for frame in (*self._frames[1:], self._frames[0]):
            just = frame.just(on)
            while left:
                broken = frame.solver.switch(smt.any_of([frame.broken[at] for at in left]))
                answer = frame.solver.check(*just, *frame.before(left), broken)
                if answer is Answer.UNKNOWN:
                    return None
                if answer is Answer.UNSATISFIABLE:
                    break
                left = [at for at in left if not frame.solver.value(frame.broken[at], Bool())]
        return tuple(left)

    def follow(self, keys: Collection[Key], on: Collection[Member], clauses: Sequence[int]) -> bool:
        """Return whether obligations are shown by these clauses, which are an invariant while just these members are on."""
        return all(
            self._refutes(frame, on, clauses, smt.any_of([frame.bad[key] for key in (*keys, *self._kept)]))
            for frame in self._frames
        )

    def changes_nothing(self, on: Collection[Member]) -> bool:
        """Return whether every cycle leaves what it would leave if all members were on."""
        return all(self._refutes(frame, on, self.clauses, frame.differs) for frame in self._frames)

    def _refutes(self, frame: Frame, on: Collection[Member], clauses: Sequence[int], bad: Term) -> bool:
        asked = frame.solver.switch(bad)
        return frame.solver.check(*frame.just(on), *frame.before(clauses), asked) is Answer.UNSATISFIABLE


def needed(
    frames: Sequence[Frame],
    goals: Iterable[Goal],
    on: Collection[Member],
    clauses: Iterable[int],
    shown_here: Collection[int] | None = None,
) -> Needed | None:
    """Return what shows these goals with these members on, from clauses that are an invariant then; None where nothing does.

    Clauses that are not `shown_here` are taken as they are; of None all are.
    """
    every, waiting = list(clauses), list(goals)
    found, members = set[int](), set[Member]()
    while waiting:
        core = _core(frames, waiting.pop(), on, every, found)
        if core is None:
            return None
        new = core.clauses - found
        waiting += sorted(new if shown_here is None else new & frozenset(shown_here), reverse=True)
        found |= core.clauses
        members |= core.members
    return Needed(frozenset(found), frozenset(members))


def _core(
    frames: Sequence[Frame], goal: Goal, on: Collection[Member], every: Sequence[int], known: Collection[int]
) -> Needed | None:
    """Return what shows that a cycle fulfils an obligation, or keeps a clause; as few clauses as possible besides the known ones."""
    clauses, members = set[int](), set[Member]()
    for frame in frames:
        held_ = dict(zip(frame.before(every), every, strict=False))
        switches = {term: member for member, term in frame.on.items() if member in on}
        bad = frame.broken[goal] if isinstance(goal, int) else frame.bad[goal]
        left = frame.refuted((*held_, *switches), bad)
        if left is None:
            return None
        for term in [term for term in left if term in held_ and held_[term] not in known]:
            if term in left:
                left = frame.refuted([other for other in left if other is not term], bad) or left
        clauses |= {held_[term] for term in left if term in held_}
        members |= {switches[term] for term in left if term in switches}
    return Needed(frozenset(clauses), frozenset(members))


def with_program(ts: TransitionSystem, program: Program, like: TransitionSystem) -> TransitionSystem:
    """Return a level with another program in the environment of the level as it is: inputs that switch are none to refuse."""
    made = ts.of(program)
    made.refusable, made.clamped, made.trusted = like.refusable, like.clamped, like.trusted
    return made


def _assumptions(ts: TransitionSystem, cycle: Cycle) -> Iterator[tuple[str, Node]]:
    """Yield the name of each assumption that is taken for granted, and what it says of a cycle."""
    for name in sorted(ts.trusted):
        said = [
            values.follows(at.chosen, at.assumptions[name]) for at in cycle.every if name in at.assumptions
        ]
        yield name, values.either(cycle.untaken, values.all_of(said))
    for fact in ts.links.given:
        leaves = (cycle.taken, cycle.before) if cycle.anew else (cycle.taken,)
        yield fact.name, values.all_of(Run({}, {}, dict(each)).evaluate(fact.condition) for each in leaves)
