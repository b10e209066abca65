"""A requirement as a deterministic monitor, in the language's own statements.

In: a requirement. Out: its `Monitor`, and the condition that a cycle keeps it; for a proof, both with a bound. Three parts follow each
other in each cycle: whether the cycle is in the scope, whether it asks for the response, and what the timing makes of both. An interval
ends in the cycle before the one that is not in the scope: so what is wrong with its last cycle is told a cycle later, and by `owes` at the
end of a run. An interval without end has no last cycle: of a run without end it is `waits` that tells what never comes.

Outside its scope an `only` requirement is the dual timing of the negated response: not (P for T) is (not P) within T, and so on. Only
*exactly after* has no dual among the timings.

Source of the meaning: the interval semantics of FRET, as its manual and its formulas have it
(https://github.com/NASA-SW-VnV/fret, release 3.1, `fret-electron/app/parser/semantics.json`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from rcsc.lang.leaves import one_earlier
from rcsc.lang.model import Apply, Bool, Expr, If, Int, Monitor, Op, Property, Statement
from rcsc.lang.over_time.past import FALSE, TRUE, Past, State, both, either, negation, number
from rcsc.lang.over_time.requirement import STOPPED, Requirement, Scope, Timing, Trigger

MOST_CYCLES = 2**32 - 1
"""The longest time."""
MOST_TIMES = 16
"""How often something may be allowed in a time: each needs a counter of its own."""
MOST_REMEMBERED = 64
"""The most cycles of *exactly after* in an `only` scope under a trigger: each needs a state of its own."""

_DUAL = {
    Timing.AT_ONCE: Timing.AT_ONCE,
    Timing.NEXT: Timing.NEXT,
    Timing.ALWAYS: Timing.EVENTUALLY,
    Timing.EVENTUALLY: Timing.ALWAYS,
    Timing.AT_LAST: Timing.AT_LAST,
    Timing.WITHIN: Timing.FOR,
    Timing.FOR: Timing.WITHIN,
    Timing.UNTIL: Timing.BEFORE,
    Timing.BEFORE: Timing.UNTIL,
}


def monitored(past: Past, required: Requirement) -> tuple[Monitor, Expr]:
    """Return the monitor of a requirement, and the condition that a cycle keeps it.

    The condition reads the monitor's states alone: as the cycle leaves them, and as it finds them (`earlier`). `past` has the states
    that the requirement's own conditions need.
    """
    made = _Made(past.name, list(past.states), list(past.truths), list(past.statements))
    defined = made.state("defined", Bool(), initial=True)
    in_scope = made.scope(required)
    asks = made.trigger(required, in_scope)
    broken, owes = made.timing(required, in_scope, asks)
    if required.scope is Scope.BETWEEN:
        broken, owes = made.once_ended(in_scope, broken), FALSE
    waits = FALSE if required.timing is Timing.AT_LAST else owes
    monitor = Monitor(
        tuple(made.states), defined.name, tuple(made.truths), tuple(made.statements), owes, waits, made.asks
    )
    return monitor, both(defined.now, negation(broken))


@dataclass(frozen=True, slots=True)
class Rank:
    """A number that goes one way alone while a requirement waits, and ends at the end of its range.

    Attributes:
        moves: The condition that a cycle moves it that way; `turns`, that it moves it back.
    """

    moves: Expr
    turns: Expr


def bounded(stated: Property, most: int, fair: Sequence[Expr] = (), rank: Rank | None = None) -> Property:
    """Return the requirement that is broken, too, where it waits for more than so many rounds in a row, or its rank turns back meanwhile.

    A round is a cycle; or, of `fair` conditions, cycles in which each of them has held. Where a rank moves, rounds are counted anew. So if
    it waits for ever, and each of the conditions holds again and again, there are more rounds than any number: what is bounded comes. In a
    cycle that takes nothing, and leaves every state as it is, no round goes on.

    Source: Claessen and Sorensson, "A liveness checking algorithm that counts", 2012.
    """
    monitor = stated.monitor
    assert monitor is not None
    made = Past(stated.name, list(monitor.states), list(monitor.truths), list(monitor.statements))
    held = [_stored(made, "fair", condition) for condition in fair]
    seen = [made.state("seen fair", Bool(), initial=False) for _ in fair]
    over = both(*(either(now, before.was) for now, before in zip(held, seen, strict=True)))
    for now, before in zip(held, seen, strict=True):
        made.statements.append(before.set(both(monitor.waits, negation(over), either(now, before.was))))
    rounds = made.state("rounds", Int(0, most + 1), 0)
    none, stays, counts = (rounds.set(number(0)),), (rounds.set(rounds.was),), (rounds.counted(1),)
    more: Statement = If(both(over, rounds.was_from(0, most)), counts, stays)
    if rank is not None:
        moves, turns = _stored(made, "moves", rank.moves), _stored(made, "turns", rank.turns)
        waited = one_earlier(monitor.waits)
        more = If(
            both(waited, turns), (rounds.set(number(most + 1)),), (If(both(waited, moves), none, (more,)),)
        )
    made.statements.append(If(monitor.waits, (more,), none))
    watch = replace(
        monitor,
        states=tuple(made.states),
        truths=tuple(made.truths),
        statements=tuple(made.statements),
        still=(rounds.name, *(state.name for state in seen)),
    )
    enough = Apply(Op.LE, (rounds.now, number(most)), Bool())
    return replace(stated, condition=both(stated.condition, enough), monitor=watch)


def _stored(made: Past, part: str, condition: Expr) -> Expr:
    """Add the state that takes the truth of a condition; return what it is after the cycle."""
    return made.truth(part, lambda _: condition).now


# --- a monitor in the making -----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _InScope:
    """Whether the cycle is in the scope, `inside`; whether it is the first that is not, `ended`."""

    inside: Expr
    was_inside: Expr
    ended: Expr


@dataclass(slots=True)
class _Made(Past):
    """A monitor in the making, of which the states are there that the conditions need.

    Attributes:
        asks: The condition that the cycle asked for the response; of what counts, that it begins.
    """

    asks: Expr = TRUE

    def stored(self, part: str, condition: Expr) -> State:
        """Add the state that takes the truth of a condition of the requirement."""
        return self.truth(part, lambda _: condition)

    def flag(self, part: str, value: Callable[[State], Expr]) -> State:
        """Add a truth value, and its value after each cycle."""
        made = self.state(part, Bool(), initial=False)
        self.statements.append(made.set(value(made)))
        return made

    # --- scope and trigger ---

    def scope(self, required: Requirement) -> _InScope:
        """Add what tells whether a cycle is in the scope."""
        if required.scope is Scope.ALL:
            return _InScope(TRUE, self.flag("inside", lambda _: TRUE).was, FALSE)
        inside = self._scope(required)
        return _InScope(inside.now, inside.was, both(inside.was, negation(inside.now)))

    def _scope(self, required: Requirement) -> State:
        mode = self.stored("mode", required.mode).now
        scope = required.scope
        if scope in {Scope.BETWEEN, Scope.FROM}:
            end = self.stored("end", required.end).now
            return self.flag("inside", lambda inside: both(negation(end), either(mode, inside.was)))
        if scope is Scope.WHILE:
            return self.flag("inside", lambda _: mode)
        if scope in {Scope.UNLESS, Scope.ONLY_WHILE}:
            return self.flag("inside", lambda _: negation(mode))
        seen = self.flag("seen", lambda seen: either(mode, seen.was))
        if scope is Scope.BEFORE:
            return self.flag("inside", lambda _: negation(seen.now))
        if scope is Scope.ONLY_BEFORE:
            return self.flag("inside", lambda _: seen.now)
        over = self.flag("over", lambda over: either(over.was, both(seen.was, negation(mode))))
        return self.flag("inside", lambda _: over.now if scope is Scope.AFTER else negation(over.now))

    def once_ended(self, scope: _InScope, broken: Expr) -> Expr:
        """Remember that a cycle broke the requirement; return the condition that the interval ends in which one did."""
        failed = self.flag("failed", lambda failed: both(scope.inside, either(failed.was, broken)))
        return both(scope.ended, either(failed.was, broken))

    def trigger(self, required: Requirement, scope: _InScope) -> Expr:
        """Add what tells whether a cycle asks for the response; return that it does."""
        if required.trigger is Trigger.FIRST:
            return both(scope.inside, negation(scope.was_inside))
        condition = self.stored("condition", required.condition)
        asks = both(scope.inside, condition.now)
        if required.trigger is Trigger.WHENEVER:
            return asks
        return both(asks, negation(both(scope.was_inside, condition.was)))

    # --- timing ---

    def timing(self, required: Requirement, scope: _InScope, asks: Expr) -> tuple[Expr, Expr]:
        """Add what the timing remembers; return the conditions that the cycle breaks the requirement, and that it is owed."""
        timing, cycles = required.timing, required.cycles
        if timing is Timing.AT_MOST:
            return self._at_most(required, scope), FALSE
        response = self.stored("response", required.response).now
        question = self.flag("asked", lambda _: asks)
        asked = self.asks = question.now
        if required.scope.only and timing is Timing.EXACTLY_AFTER:
            return self._not_exactly_after(required, scope, asked, response)
        if timing is Timing.NEVER:
            timing, response = Timing.ALWAYS, negation(response)
        if required.scope.only:
            timing, response = _DUAL[timing], negation(response)
        stop = self.stored("stop", required.stop).now if timing in STOPPED else FALSE
        match timing:
            case Timing.AT_ONCE:
                return both(asked, negation(response)), FALSE
            case Timing.NEXT:
                return both(scope.inside, question.was, negation(response)), FALSE
            case Timing.ALWAYS | Timing.UNTIL:
                on = self.flag("on", lambda on: both(scope.inside, either(asked, on.was), negation(stop)))
                return both(on.now, negation(response)), FALSE
            case Timing.EVENTUALLY:
                return self._eventually(scope, asked, response)
            case Timing.AT_LAST:
                on = self.flag("on", lambda on: both(scope.inside, either(asked, on.was)))
                missed = self.flag("missed", lambda _: both(on.now, negation(response)))
                return both(scope.ended, missed.was), missed.now
            case Timing.WITHIN:
                return self._within(scope, asked, response, cycles), FALSE
            case Timing.FOR:
                return self._for(scope, asked, response, cycles), FALSE
            case Timing.EXACTLY_AFTER:
                return self._exactly_after(scope, asked, response, cycles), FALSE
            case _:
                return self._before(scope, asked, response, stop), FALSE

    def _eventually(self, scope: _InScope, asked: Expr, response: Expr) -> tuple[Expr, Expr]:
        owing = self.flag(
            "owing", lambda owing: both(scope.inside, either(asked, owing.was), negation(response))
        )
        return both(scope.ended, owing.was), owing.now

    def _within(self, scope: _InScope, asked: Expr, response: Expr, cycles: int) -> Expr:
        """Count the cycles for which the oldest question is open: a response answers all of them."""
        waited = self.state("waited", Int(0, cycles), 0)
        open_, waiting = both(scope.inside, negation(response)), waited.was_from(1, cycles)
        late = waited.was_from(cycles, cycles)
        begins = If(asked, (waited.set(number(1)),), (waited.set(number(0)),))
        goes_on = If(late, (waited.set(number(0)),), (waited.counted(1),))
        self.statements.append(
            If(open_, (If(waiting, (goes_on,), (begins,)),), (waited.set(number(0)),)),
        )
        return both(open_, late)

    def _for(self, scope: _InScope, asked: Expr, response: Expr, cycles: int) -> Expr:
        """Count the cycles that are left of the youngest question: it lasts longest."""
        left = self.state("left", Int(0, cycles), 0)
        lasts = both(scope.inside, left.was_from(1, cycles))
        goes_on = If(lasts, (left.counted(-1),), (left.set(number(0)),))
        self.statements.append(If(asked, (left.set(number(cycles)),), (goes_on,)))
        return both(either(asked, lasts), negation(response))

    def _exactly_after(self, scope: _InScope, asked: Expr, response: Expr, cycles: int) -> Expr:
        """Count from the oldest question. Another in its time forbids the response in the very cycle in which it is due."""
        age = self.state("age", Int(0, cycles + 1), 0)
        forbids = both(scope.inside, age.was_from(1, cycles))
        due = both(scope.inside, age.was_from(cycles + 1, cycles + 1))
        begins = If(asked, (age.set(number(1)),), (age.set(number(0)),))
        self.statements.append(If(forbids, (age.counted(1),), (begins,)))
        again = self.flag("again", lambda again: both(forbids, either(again.was, asked)))
        early = both(response, either(asked, forbids))
        return either(early, both(due, either(negation(response), again.was)))

    def _at_most(self, required: Requirement, scope: _InScope) -> Expr:
        """Count down from each of the last beginnings: none of so many is to be within the time of another."""
        response = self.stored("response", required.response)
        begins = both(scope.inside, response.now, negation(both(scope.was_inside, response.was)))
        begun = self.asks = self.flag("begun", lambda _: begins).now
        left = [
            self.state(f"left {at}", Int(0, required.cycles - 1), 0) for at in range(1, required.times + 1)
        ]
        rests = [self._counted_down(scope, state, state) for state in left]
        moves = [self._counted_down(scope, before, after) for before, after in pairwise(left)]
        first = left[0].set(number(required.cycles - 1))
        self.statements.append(If(begun, (*moves[::-1], first), tuple(rests)))
        return both(begun, left[-1].was_from(1, required.cycles))

    @staticmethod
    def _counted_down(scope: _InScope, before: State, after: State) -> Statement:
        """Return the statement that gives one state what is left of another, one cycle later."""
        lasts = both(scope.inside, before.was_from(1, MOST_CYCLES))
        return If(lasts, (after.set(before.one_more(-1)),), (after.set(number(0)),))

    def _before(self, scope: _InScope, asked: Expr, response: Expr, stop: Expr) -> Expr:
        """Remember that a question is open: the stop is not to come then, nor in the cycle of the response."""
        before = self.state("open", Bool(), initial=False)
        open_ = both(scope.inside, either(asked, before.was))
        self.statements.append(before.set(both(open_, negation(stop), negation(response))))
        return both(open_, stop)

    def _not_exactly_after(
        self, required: Requirement, scope: _InScope, asked: Expr, response: Expr
    ) -> tuple[Expr, Expr]:
        """Remember of each cycle of the time whether it asked, and no response came since: it must not come first when that is over."""
        cycles = required.cycles
        quiet = both(scope.inside, negation(response))
        if required.trigger is Trigger.FIRST:  # it asks once in an interval
            age = self.state("age", Int(0, cycles + 1), 0)
            begins = If(both(asked, quiet), (age.set(number(1)),), (age.set(number(0)),))
            self.statements.append(If(both(quiet, age.was_from(1, cycles)), (age.counted(1),), (begins,)))
            return both(scope.inside, response, age.was_from(cycles + 1, cycles + 1)), FALSE
        assert cycles <= MOST_REMEMBERED
        last = self.flag("asked 1", lambda _: both(asked, quiet))
        for at in range(2, cycles + 2):
            last = self._next(f"asked {at}", last, quiet)
        return both(scope.inside, response, last.was), FALSE

    def _next(self, part: str, before: State, quiet: Expr) -> State:
        """Add a flag that is what another one was in the cycle before, if that is still of interest."""
        return self.flag(part, lambda _: both(quiet, before.was))
