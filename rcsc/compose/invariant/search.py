"""Looks for the invariant of a level: first with the features that most levels need, then, for what is left, with more.

In: a stepper, its cycles and goals. Out: `Found`. What is found is not to be trusted before it is confirmed (`confirm`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from random import Random

from rcsc.compose.contract.environment import COMMAND
from rcsc.compose.contract.obligations import Goal, Sort, goals
from rcsc.compose.contract.predicates import CLOSELY, Feature, compared, point
from rcsc.compose.contract.properties import every_feature
from rcsc.compose.contract.transition import Cycle, Stepper
from rcsc.compose.contract.walk import Walk
from rcsc.compose.invariant.cubes import Reached
from rcsc.compose.invariant.pdr import Clause, Frames, Posed
from rcsc.lang.model import Value
from rcsc.solvers.smt import Limits
from rcsc.symbolic.values import TRUE, Node

LIMITS = Limits.of(80_000_000)
"""A question about a cycle is larger than one about a table."""
A_TABLE = 4
"""Walks for each table, at least, so that there are some of every command: what walks show need not be asked."""
BURST, ANEW = 20, 5
"""Cycles between two states from which walks go on; one walk in so many begins anew."""
LONGER = 4
"""Walks are at most so many times longer than was asked where they still come to new lines."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is spent.

    Attributes:
        walks: Random walks before the search, each of `cycles` cycles; more of them where there are many tables (`A_TABLE`).
        limits: For each question to Z3; past them the answer is *undecided*, never *proved*.
        looks: Whether the lines are looked at in their context, too (`context`, `ends`).
    """

    walks: int = 24
    cycles: int = 100
    limits: Limits = LIMITS
    looks: bool = True


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found.

    Attributes:
        features: What the clauses speak of.
        clauses: The invariant: combinations that never stand.
        open: Goals that were searched for, by position, for which the features do not suffice.
        walked: States seen on walks; `learnt`, those that the solver added.
        ran: Tables and lines that ran on walks; `states`, what stood behind their cycles.
    """

    features: tuple[Feature, ...] = ()
    clauses: tuple[Clause, ...] = ()
    open: frozenset[int] = frozenset()
    walked: int = 0
    learnt: int = 0
    ran: frozenset[tuple[str, str]] = frozenset()
    states: tuple[Mapping[str, Value], ...] = field(default=(), repr=False)


def search(
    stepper: Stepper, firsts: Sequence[Cycle], cycle: Cycle, wanted: Sequence[Goal], effort: Effort
) -> Found:
    """An invariant from which as many goals follow as can be.

    Raises:
        GaveUpError: The solver did.
    """
    matter = [at for at, goal in enumerate(wanted) if _matters(stepper, goal)]
    reads = read(stepper, cycle, wanted)
    states, ran = _walked(stepper, effort)
    found = Found(open=frozenset(matter), states=states, ran=ran)
    for closely in range(CLOSELY + 1):
        chosen = every_feature(stepper, cycle, reads, closely)
        if closely and len(chosen) == len(found.features):
            break
        left = sorted(found.open)
        found = _with(chosen, stepper, firsts, cycle, found, left)
        if not any(wanted[at].sort is not Sort.NUMBERED for at in found.open):
            break
    return found


def strengthened(
    stepper: Stepper,
    firsts: Sequence[Cycle],
    cycle: Cycle,
    found: Found,
    wanted: Sequence[Node],
) -> Found:
    """What was found, with clauses added from which as many as can be of these conditions on a later cycle follow.

    Raises:
        GaveUpError: The solver did.
    """
    chosen, every = found.features, range(len(wanted))
    posed = [Posed(chosen, one, dict.fromkeys(every, TRUE)) for one in firsts]
    posed.append(Posed(chosen, cycle, dict(enumerate(wanted))))
    made, _ = _searched(stepper, chosen, posed, found, every)
    return replace(made, open=found.open, walked=found.walked)


def _with(  # what a search is of
    chosen: tuple[Feature, ...],
    stepper: Stepper,
    firsts: Sequence[Cycle],
    cycle: Cycle,
    before: Found,
    left: Sequence[int],
) -> Found:
    """One search, from the invariant that is known already, for the goals that are left."""
    posed = [Posed(chosen, one, _conditions(stepper, one, left)) for one in (*firsts, cycle)]
    made, left_open = _searched(stepper, chosen, posed, before, left)
    return replace(made, open=frozenset(left_open))


def _searched(
    stepper: Stepper, chosen: tuple[Feature, ...], posed: Sequence[Posed], before: Found, left: Iterable[int]
) -> tuple[Found, set[int]]:
    walked = dict.fromkeys(point(stepper, chosen, state) for state in before.states)
    reached = Reached.of(walked, len(chosen))
    weights = [2 if one.parts else int(one.size > 2) for one in chosen]
    clauses, left_open = Frames(posed[:-1], posed[-1], reached, weights, before.clauses).search(left)
    for one in posed:
        one.sat.close()
    learnt = before.learnt + reached.many - len(walked)
    found = replace(before, features=chosen, clauses=tuple(clauses), walked=len(walked), learnt=learnt)
    return found, left_open


def read(stepper: Stepper, cycle: Cycle, wanted: Sequence[Goal]) -> list[Node]:
    """What is searched for, and what may be relied on: features are chosen from their cone."""
    return [*(goal.holds for goal in wanted if _matters(stepper, goal)), cycle.contract]


def _conditions(stepper: Stepper, cycle: Cycle, left: Iterable[int]) -> dict[int, Node]:
    """Of these goals, in this cycle."""
    every = goals(stepper, cycle)
    return {at: every[at].holds for at in left}


def _matters(stepper: Stepper, goal: Goal) -> bool:
    """Whether it is searched for: not a field that the level does not compare with the last one, which nobody may rely on."""
    if goal.sort is not Sort.NUMBERED:
        return True
    return goal.name.endswith(f".{COMMAND}") or any(goal.name in pair for pair in compared(stepper.program))


def _walked(
    stepper: Stepper, effort: Effort
) -> tuple[tuple[Mapping[str, Value], ...], frozenset[tuple[str, str]]]:
    """States that walks reach, and the lines that ran; where assumptions are trusted no walk keeps to them.

    Most walks go on from where one came to a line for the first time, as coverage guides a fuzzer (Zalewski, "american fuzzy lop",
    2013): lines that only a long run of answers leads to are come to so.
    """
    if stepper.trusted:
        return (), frozenset()
    random = Random(0)  # noqa: S311  # repeatable on purpose
    found: dict[tuple[Value, ...], Mapping[str, Value]] = {}
    new: list[Mapping[str, Value]] = []
    ran: set[tuple[str, str]] = set()
    many = max(1, effort.walks, A_TABLE * len(stepper.program.tables)) * effort.cycles // BURST
    least = most = many
    at = 0
    while at < most:
        walk = Walk(stepper.program, stepper.level, stepper.links, Random(at))  # noqa: S311  # as above
        if new and at % ANEW:
            walk.begin_at(new[max(random.randrange(len(new)), random.randrange(len(new)))])
        for state in walk.states(BURST):
            found.setdefault(tuple(state.values()), state)
            if walk.ran - ran:
                ran |= walk.ran
                new.append(state)
                most = min(LONGER * least, at + many)
        at += 1
    return tuple(found.values()), frozenset(ran)
