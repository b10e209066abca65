"""Searches the invariant of a level: first with the predicates that most levels need, then with more for what is left.

In: a transition system, its cycles and obligations. Out: a `FoundInvariant`, to be trusted only once confirmed (`confirm`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from random import Random

from rcsc.compose.contract.obligations import Obligation, Sort, obligations
from rcsc.compose.contract.predicates import CLOSELY, Predicate, point
from rcsc.compose.contract.properties import every_predicate
from rcsc.compose.contract.transition import Cycle, TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.invariant.cubes import Reached, Valuation
from rcsc.compose.invariant.pdr import PDR, Clause, Posed
from rcsc.lang.model import Value
from rcsc.proof.solvers.options import Limits
from rcsc.proof.symbolic.values import TRUE, Node

LIMITS = Limits.of(80_000_000)
"""Larger than for a table: a question about a cycle is harder."""
A_TABLE = 4
"""The least number of walks for each table, so that some run each command; states seen on walks need no query."""
BURST, ANEW = 20, 5
"""The cycles of one walk; one walk in so many begins with the initial values."""
LONGER = 4
"""There are at most so many times more walks than asked, while they still reach new lines."""


NamedClause = tuple[tuple[str, int], ...]
"""A clause that names its predicates: it may be about another version of the level."""


@dataclass(frozen=True, slots=True)
class Effort:
    """The effort of a search.

    Attributes:
        walks: Random walks before the search, each of `cycles` cycles; more if there are many tables (`A_TABLE`).
        limits: For each question to Z3; past them the answer is *undecided*, never *proved*.
        looks: Whether to analyse lines in context and termination, too.
    """

    walks: int = 24
    cycles: int = 100
    limits: Limits = LIMITS
    looks: bool = True


@dataclass(frozen=True, slots=True)
class FoundInvariant:
    """The invariant that a search found, and the obligations that it does not prove.

    Attributes:
        predicates: The predicates in the clauses.
        clauses: The invariant: cubes that never hold.
        open: Obligations searched for, by position, for which the predicates do not suffice.
        walked: States seen on walks; `learnt`, those that the solver added.
        ran: Tables and lines that ran on walks, each with a state after it; `states`, the states after all cycles.
        columns: The values of predicates in these states, of those asked about so far: a later round asks about most of them again.
    """

    predicates: tuple[Predicate, ...] = ()
    clauses: tuple[Clause, ...] = ()
    open: frozenset[int] = frozenset()
    walked: int = 0
    learnt: int = 0
    ran: Mapping[tuple[str, str], Mapping[str, Value]] = field(default_factory=dict, repr=False)
    states: tuple[Mapping[str, Value], ...] = field(default=(), repr=False)
    columns: dict[Predicate, tuple[int, ...]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def named(self) -> tuple[NamedClause, ...]:
        """The clauses with the names of their predicates."""
        return tuple(
            tuple((self.predicates[at].name, value) for at, value in clause) for clause in self.clauses
        )


def search(
    ts: TransitionSystem,
    firsts: Sequence[Cycle],
    cycle: Cycle,
    wanted: Sequence[Obligation],
    effort: Effort,
    candidates: Sequence[NamedClause] = (),
    begun: FoundInvariant | None = None,
) -> FoundInvariant:
    """Find an invariant from which as many obligations follow as possible.

    What was begun is gone on from: an invariant that is known, and states that walks reached. Only what it leaves open is searched for.

    Candidates, from wherever they come, are clauses to begin with. What is proved does not depend on them: the search decides which
    obligations follow from some invariant over its predicates.

    Raises:
        GaveUpError: The solver did.
    """
    reads = read(cycle, wanted)
    if begun is None:
        begun = begin(ts, wanted, effort)
    if not begun.open:
        return begun
    invariant = begun
    owed = [*(obligations(ts, first) for first in firsts), wanted]
    by_size = {
        len(chosen): chosen for chosen in (every_predicate(ts, cycle, reads, at) for at in range(CLOSELY + 1))
    }
    rounds = list(by_size.values())
    tried = [placed(candidates, chosen) for chosen in rounds]
    needed = max(map(len, tried))  # what the candidates were found with is there from the start
    for chosen, clauses in zip(rounds, tried, strict=True):
        if len(clauses) < needed or len(chosen) < len(invariant.predicates):
            continue
        left = sorted(invariant.open)
        posed = [
            Posed(chosen, each, {at: every[at].holds for at in left})
            for each, every in zip((*firsts, cycle), owed, strict=True)
        ]
        invariant, still_open = _searched(ts, chosen, posed, invariant, left, clauses)
        invariant = replace(invariant, open=frozenset(still_open))
        if not any(wanted[at].sort is not Sort.NUMBERED for at in invariant.open):
            break
    return invariant


def begin(ts: TransitionSystem, wanted: Sequence[Obligation], effort: Effort) -> FoundInvariant:
    """Return what is known before a search: the states that walks reach."""
    states, ran = _walked(ts, effort)
    return FoundInvariant(open=frozenset(range(len(wanted))), states=states, ran=ran)


def strengthened(
    ts: TransitionSystem,
    firsts: Sequence[Cycle],
    cycle: Cycle,
    invariant: FoundInvariant,
    wanted: Sequence[Node],
) -> FoundInvariant:
    """Add clauses from which as many as possible of these conditions on a later cycle follow.

    Raises:
        GaveUpError: The solver did.
    """
    chosen, every = invariant.predicates, range(len(wanted))
    posed = [Posed(chosen, first, dict.fromkeys(every, TRUE)) for first in firsts]
    posed.append(Posed(chosen, cycle, dict(enumerate(wanted))))
    stronger, _ = _searched(ts, chosen, posed, invariant, every)
    return replace(stronger, open=invariant.open, walked=invariant.walked)


def placed(candidates: Iterable[NamedClause], chosen: Sequence[Predicate]) -> list[Clause]:
    """Return the candidates whose predicates are all chosen, and have such values."""
    places = {predicate.name: (at, predicate.size) for at, predicate in enumerate(chosen)}
    clauses = []
    for candidate in candidates:
        found = [(*places.get(name, (0, 0)), value) for name, value in candidate]
        if found and all(-size <= value < size for _, size, value in found):
            clauses.append(tuple(sorted((at, value) for at, _, value in found)))
    return clauses


def _searched(
    ts: TransitionSystem,
    chosen: tuple[Predicate, ...],
    posed: Sequence[Posed],
    before: FoundInvariant,
    left: Iterable[int],
    candidates: Sequence[Clause] = (),
) -> tuple[FoundInvariant, set[int]]:
    walked = dict.fromkeys(_points(ts, chosen, before))
    reached = Reached.of(walked)
    weights = [2 if predicate.parts else int(predicate.size > 2) for predicate in chosen]
    tried = [clause for clause in candidates if clause not in before.clauses]
    clauses, left_open = PDR(posed[:-1], posed[-1], reached, weights, before.clauses, tried).search(left)
    for cycle in posed:
        cycle.sat.close()
    learnt = before.learnt + reached.many - len(walked)
    invariant = replace(before, predicates=chosen, clauses=tuple(clauses), walked=len(walked), learnt=learnt)
    return invariant, left_open


def _points(ts: TransitionSystem, chosen: Sequence[Predicate], found: FoundInvariant) -> Iterable[Valuation]:
    """Return the predicates in each state that walks reached."""
    new = tuple(predicate for predicate in chosen if predicate not in found.columns)
    asked = zip(*(point(ts, new, state) for state in found.states), strict=True)
    found.columns.update(zip(new, asked, strict=False))
    return zip(*(found.columns[predicate] for predicate in chosen), strict=True) if found.states else ()


def read(cycle: Cycle, wanted: Sequence[Obligation]) -> list[Node]:
    """Collect the obligations and the contract; predicates are chosen from their cone."""
    return [*(obligation.holds for obligation in wanted), cycle.contract]


def _walked(
    ts: TransitionSystem, effort: Effort
) -> tuple[tuple[Mapping[str, Value], ...], dict[tuple[str, str], Mapping[str, Value]]]:
    """Collect states that walks reach, and the lines that ran, each with a state after it.

    Most walks continue from where one reached a line for the first time, as coverage guides a fuzzer (Zalewski, "american fuzzy
    lop", 2013). So they reach lines that need a long run of answers.
    """
    random = Random(0)  # noqa: S311  # repeatable on purpose
    states: dict[tuple[Value, ...], Mapping[str, Value]] = {}
    new: list[Mapping[str, Value]] = []
    ran: dict[tuple[str, str], Mapping[str, Value]] = {}
    many = max(1, effort.walks, A_TABLE * len(ts.program.tables)) * effort.cycles // BURST
    least = most = many
    at = 0
    while at < most:
        walk = Walk(ts, Random(at))  # noqa: S311  # as above
        if new and at % ANEW:
            walk.begin_at(new[max(random.randrange(len(new)), random.randrange(len(new)))])
        for state in walk.states(BURST):
            states.setdefault(tuple(state.values()), state)
            if found := walk.ran - ran.keys():
                ran |= dict.fromkeys(found, state)
                new.append(state)
                most = min(LONGER * least, at + many)
        at += 1
    return tuple(states.values()), ran
