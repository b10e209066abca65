"""What eventually comes across levels: bounds within which it may be proved to come, and runs on which it waits for ever.

In: a requirement that may wait (`Monitor.waits`), levels together. Out: the same requirement with a bound, which each tick keeps or
breaks, so that it is proved as others are; the bounds to try; the shortest lasso.

Levels that never begin anew and are never refused an input would be too kind, and such as are for ever let nothing come. So a tick in
which a level begins anew, or is refused an input, is not *calm*, and what is asked is for how many calm ticks in a row the requirement
waits. If that has a bound, it comes in each run in which restarts and refusals end at some time: after the last of them all ticks are
calm, whatever state that left. If it waits in each tick of a lasso, all of them calm, it need not come in such a run. That is *liveness
to safety* (Biere, Artho and Schuppan, "Liveness checking as safety checking", 2002) with a counter (`over_time.bounded`).

A party outside that takes orders may never answer by its contract. Where bounds need it, rounds are counted in which each such party has
been given another order, or has answered, as for a level alone (`proof.eventually`); that it does is then trusted, and named. A lasso on
which one never does refutes nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rcsc.code.testing.figures import counted
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.exact.circuit import Circuit
from rcsc.compose.exact.eventual import Waits, of_all_states, of_short_runs
from rcsc.compose.proof.eventually import DOUBLED, ended_or_ordered
from rcsc.compose.together.product import CALM
from rcsc.lang.leaves import renamed
from rcsc.lang.model import BEFORE, Bool, Expr, Property, Read, VariableName
from rcsc.lang.over_time import bounded
from rcsc.lang.over_time.past import FALSE, both, negation

COMES_TO_AN_END = "restarts and refusals come to an end"
"""What is trusted of a requirement that something comes."""
ANSWERS = "`{}` answers every order that is not replaced, and stays so"
ROUNDS = (1, 4)
"""Rounds of orders and answers of parties outside."""


def may_wait(stated: Property) -> bool:
    """Return whether a requirement asks for what comes at no time that is said."""
    return stated.monitor is not None and stated.monitor.waits != FALSE


def calmly(stated: Property) -> Property:
    """Return the requirement that waits in calm ticks only."""
    assert stated.monitor is not None
    calm = both(stated.monitor.waits, Read(VariableName(CALM), Bool()))
    return replace(stated, monitor=replace(stated.monitor, waits=calm))


def never_waits(stated: Property) -> Property:
    """Return the requirement that it waits in no calm tick."""
    monitor = calmly(stated).monitor
    assert monitor is not None
    return replace(stated, condition=negation(monitor.waits))


def within(stated: Property, most: int, fair: tuple[Expr, ...] = ()) -> Property:
    """Return the requirement that it waits for no more than so many calm ticks, or rounds, in a row."""
    return bounded(calmly(stated), most, fair)


def waits_of(made: Circuit) -> Waits:
    """Return for how long it waits, of a circuit that it breaks where it does: of all states, or else of short runs."""
    return of_all_states(made) or of_short_runs(made)


def bounds(found: Waits) -> tuple[int, ...]:
    """Return the bounds to try; none where nothing speaks for any."""
    if found.complete:
        return (found.most,)
    return tuple(found.most << times for times in range(DOUBLED)) if found.most < found.cycles else ()


def waits_for(most: int, *, fair: bool) -> str:
    """Return for how long it waits, in words."""
    what = counted(most, "round" if fair else "calm tick")
    return f"waits for at most {what}{' of orders and answers' if fair else ''}" if most else "never waits"


def fairness(systems: Mapping[str, TransitionSystem]) -> Iterator[tuple[str, Expr]]:
    """Yield what is trusted of each party outside that takes orders; and that a tick gives it another one, or finds it answered."""
    for name, ts in systems.items():
        for below in ts.links.below:
            if below.outside and not below.answers_in_time:
                yield ANSWERS.format(below.name), _of_level(ended_or_ordered(ts, below), name)


def _of_level(condition: Expr, level: str) -> Expr:
    """Return a condition on a level's leaves as one on those of all levels."""

    def own(name: VariableName) -> VariableName:
        back = BEFORE if name.startswith(BEFORE) else ""
        return VariableName(f"{back}{level}.{name.removeprefix(BEFORE)}")

    return renamed(condition, own)
