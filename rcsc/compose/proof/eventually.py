"""What eventually comes: the bounds within which a level may be proved to answer, to be tried in order.

In: a level, and a requirement that may wait (`Monitor.waits`). Out: `Try`s, the likeliest first; none where a run waits for ever. A level
that waits for no more than so many rounds in a row never waits for ever: that is an obligation on one cycle (`over_time.bounded`), which
is proved and confirmed as others are. Where states end there is such a bound, or a run on which it waits for ever.

What is assumed besides the contract, and named in the verdict: that inputs and results of extern procedures are not refused for ever; a
cycle that refuses one counts for nothing. That subordinates answer, as for termination: each order, unless another replaces it. Then a
round is over when each has been given an order, or has answered. Nothing else: an input may stay away for ever. A restart ends what is
waited for, so that restarts need not come to an end.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from random import Random

from rcsc.compose.contract.environment import Below
from rcsc.compose.contract.obligations import Obligation, asks, obligations
from rcsc.compose.contract.predicates import cone
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.walk import Walk
from rcsc.compose.contract.watched import monitors
from rcsc.compose.exact import explicit
from rcsc.compose.exact.circuit import Circuit, circuit, roots_of
from rcsc.compose.exact.eventual import Waits, of_all_states, of_short_runs
from rcsc.compose.exact.shifted import numbers_above
from rcsc.lang.model import (
    Apply,
    Bool,
    Enum,
    Expr,
    Int,
    Kind,
    Literal,
    Op,
    Property,
    Read,
    VariableName,
    earlier,
)
from rcsc.lang.over_time import Rank, bounded
from rcsc.lang.over_time.past import FALSE, both, either, negation

DOUBLED = 3
"""How often a bound that is not proved is doubled."""
ROUNDS = (1, 4)
"""Rounds of orders and answers."""
RANKED = (0, 1, 4)
"""For how many cycles in a row a rank may stand."""
WALKS, WALK = 6, 40
"""Walks on which a rank is looked at, and their cycles."""


@dataclass(frozen=True, slots=True)
class Try:
    """A bound to try.

    Attributes:
        most: The rounds.
        fair: Whether a round is over only when each subordinate has been given an order, or has answered; else it is a cycle.
        exact: Whether all states were searched for it.
        rank: A state that moves one way alone meanwhile; rounds in which it moves do not count. Empty for none.
        rises: Whether it rises, and does not fall.
    """

    most: int
    fair: bool = False
    exact: bool = False
    rank: str = ""
    rises: bool = True

    @property
    def shown(self) -> str:
        """For how long it waits, in words."""
        if not self.most and not self.rank:
            return "never waits"
        s = "s" if self.most > 1 else ""
        round_ = f"round{s} of orders and answers" if self.fair else f"cycle{s}"
        moves = f" in which `{self.rank}` does not {'rise' if self.rises else 'fall'}" if self.rank else ""
        return f"waits for {self.most or 'no'} {round_}{' at most' if self.most else ''}{moves}"


def waiting(ts: TransitionSystem) -> dict[str, Property]:
    """Return the requirements that may wait for ever, by name."""
    return {stated.name: stated for stated, monitor in monitors(ts.program) if monitor.waits != FALSE}


def tries(ts: TransitionSystem, stated: Property) -> Iterator[Try]:
    """Yield the bounds to try; none where a run without refusals is found that waits for ever."""
    made = circuit_of(ts, stated)
    found = None if made is None else waits_of(made)
    if made is not None and found is not None and (found.lasso is None or made.opened):
        if found.complete and found.lasso is None:
            yield Try(found.most, exact=True)
        elif found.most < found.cycles:  # else nothing speaks for any bound
            yield from (Try(found.most << times) for times in range(DOUBLED))
        yield from _ranks(ts, stated)
    elif made is None:
        yield from (Try(1 << times) for times in range(DOUBLED))
    if ts.links.below:
        yield from (Try(most, fair=True) for most in ROUNDS)


def _ranks(ts: TransitionSystem, stated: Property) -> Iterator[Try]:
    """Yield the states that may be a rank: on walks each moves one way alone while the requirement waits, at least now and then."""
    if asks(ts.program):
        return  # a cycle that refuses a result leaves states as far as it came
    never, owed = never_waits(ts, stated)
    inside = cone(never.cycle(never.havoc()), [owed.holds])
    for variable in ts.program.variables:
        name = str(variable.name)
        if variable.kind is Kind.STATE and isinstance(variable.type, Int) and name in inside:
            for rises, most in product((True, False), RANKED):
                within = Try(most, rank=name, rises=rises)
                if _stands_on_walks(bounded_by(ts, stated, within), most):
                    yield within
                    break


def _stands_on_walks(bounded: TransitionSystem, most: int) -> bool:
    """Return whether no walk breaks the bound."""
    rounds = next(
        monitor.still[0]
        for stated, monitor in monitors(bounded.program)
        if stated.name in (bounded.only or ())
    )
    walks = (Walk(bounded, Random(seed)).states(WALK) for seed in range(WALKS))  # noqa: S311  # the same walks each time
    return all(state[rounds] <= most for walk in walks for state in walk)


def waits_of(made: Circuit) -> Waits:
    """Return for how long a requirement waits: of all states, or else of short runs."""
    return of_all_states(made) or of_short_runs(made)


def circuit_of(ts: TransitionSystem, stated: Property) -> Circuit | None:
    """Return the circuit of the obligation that the requirement never waits; None where extern procedures are called."""
    never, owed = never_waits(ts, stated)
    step, firsts = never.cycle(never.havoc()), tuple(never.firsts().values())
    if any(cycle.calls for cycle in (*firsts, step)):
        return None  # what an extern procedure gives is no input
    numbers = numbers_above(never, step, *roots_of(step, [owed]))
    return replace(circuit(never, firsts, step, [owed]), numbers=numbers)


def never_waits(ts: TransitionSystem, stated: Property) -> tuple[TransitionSystem, Obligation]:
    """Return the level with the obligation that a requirement waits in no cycle."""
    assert stated.monitor is not None
    calm = replace(stated, condition=negation(stated.monitor.waits))
    never = _with(ts.admitting(), calm)
    [owed] = obligations(never, never.cycle(never.havoc()))
    return never, owed


def bounded_by(ts: TransitionSystem, stated: Property, bound: Try) -> TransitionSystem:
    """Return the level with the obligation that the requirement is kept within the bound."""
    fair = tuple(ended_or_ordered(ts, below) for below in ts.links.below) if bound.fair else ()
    rank = None if not bound.rank else _rank(ts, bound.rank, rises=bound.rises)
    return _with(ts, bounded(stated, bound.most, fair, rank))


def _rank(ts: TransitionSystem, leaf: str, *, rises: bool) -> Rank:
    more, less = (Apply(op, (_read(ts, leaf), _read(ts, leaf, was=True)), Bool()) for op in (Op.GT, Op.LT))
    return Rank(more, less) if rises else Rank(less, more)


def _with(ts: TransitionSystem, stated: Property) -> TransitionSystem:
    """Return the level that owes nothing but this requirement."""
    properties = tuple(stated if one.name == stated.name else one for one in ts.program.properties)
    return replace(ts.of(replace(ts.program, properties=properties)), only=(stated.name,))


def ended_or_ordered(ts: TransitionSystem, below: Below) -> Expr:
    """Return the condition that a cycle gives the subordinate an order, or takes the answer to the last one (`termination.answered`).

    Of a subordinate that answers in time nothing is assumed: each cycle is such a one.
    """
    if below.answers_in_time:
        return Literal(value=True, type=Bool())
    number, number_was = _read(ts, below.number), _read(ts, below.number, was=True)
    first = _equal(_read(ts, below.command, was=True), Literal(0, ts.kinds[below.command]))
    done, failed = (_says(ts, below.status, said) for said in (below.done, below.failed))
    ended = either(done, both(negation(first), failed))
    return either(
        negation(_equal(number, number_was)), both(_equal(_read(ts, below.echo), number_was), ended)
    )


def _says(ts: TransitionSystem, leaf: str, member: str) -> Expr:
    kind = ts.kinds[leaf]
    if not isinstance(kind, Enum) or member not in kind.members:
        return FALSE
    return _equal(_read(ts, leaf), Literal(kind.members.index(member), kind))


def _equal(left: Expr, right: Expr) -> Expr:
    return Apply(Op.EQ, (left, right), Bool())


def _read(ts: TransitionSystem, leaf: str, *, was: bool = False) -> Expr:
    name = VariableName(leaf)
    return Read(earlier(name) if was else name, ts.kinds[leaf])


def may_be_listed(ts: TransitionSystem) -> bool:
    """Return whether what the environment may give in a cycle of the level can be listed."""
    step = ts.cycle(ts.havoc())
    return not step.calls and explicit.may_apply(step, obligations(ts, step))
