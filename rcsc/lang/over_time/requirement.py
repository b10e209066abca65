"""What is said of time: scope, trigger, timing and response, as values.

In: nothing. Out: the frozen `Requirement` that `resolve` makes of a declaration.
"""

from dataclasses import dataclass
from enum import StrEnum

from rcsc.lang.model import Expr
from rcsc.lang.over_time.past import TRUE


class Scope(StrEnum):
    """The intervals of a run in which a requirement is judged, for a mode; the value is its word.

    `WHILE`: each row of cycles in which the mode holds; `UNLESS`: each in which it does not. `BEFORE`: up to the first cycle of the mode,
    which is not in it, or all cycles where the mode never comes. `AFTER`: from the cycle after the first row in which the mode holds. Of an
    `ONLY` scope, the cycles that are not in the scope; in these the timing is not to be fulfilled. `FROM`: each row of cycles that begins
    where the mode holds and ends before the next cycle in which the end does; `BETWEEN`: of these, those that do end.

    Source of the last two: Dwyer, Avrunin and Corbett, *Patterns in property specifications for finite-state verification*, 1999.
    """

    ALL = ""
    WHILE = "while"
    UNLESS = "unless"
    BEFORE = "before"
    AFTER = "after"
    ONLY_WHILE = "only while"
    ONLY_BEFORE = "only before"
    ONLY_AFTER = "only after"
    BETWEEN = "between"
    FROM = "from"

    @property
    def only(self) -> bool:
        """Whether the timing is not to be fulfilled outside."""
        return self.value.startswith("only")


ENDLESS = frozenset({Scope.ALL, Scope.AFTER, Scope.ONLY_BEFORE})
"""Scopes of which an interval ends with the run alone."""


class Trigger(StrEnum):
    """The cycles of an interval that ask for the response; the value is its word.

    `FIRST`: its first one. `WHEN`: each in which the condition holds and did not in the cycle before, or that is the first of the
    interval. `WHENEVER`: each in which it holds.
    """

    FIRST = ""
    WHEN = "when"
    WHENEVER = "whenever"


class Timing(StrEnum):
    """When the response has to hold, counted from the cycle that asks; the value is its word. An interval's end cuts it off."""

    AT_ONCE = "at once"
    NEXT = "next"
    ALWAYS = "always"
    NEVER = "never"
    EVENTUALLY = "eventually"
    AT_LAST = "at last"
    WITHIN = "within"
    FOR = "for"
    EXACTLY_AFTER = "exactly after"
    UNTIL = "until"
    BEFORE = "before"
    AT_MOST = "at most"
    """Of each row of so many cycles, at most some in which the response begins to hold; no cycle asks for it."""


STOPPED = frozenset({Timing.UNTIL, Timing.BEFORE})
"""Timings that have a condition which ends them."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement over time.

    Attributes:
        response: What has to hold, and `timing`, when.
        condition: Of the trigger; any for `FIRST`.
        mode: Of the scope; any for `ALL`. `end`: of a scope that has one, the condition that ends it.
        cycles: The time of the timing, in cycles from the one that asks; 0 where it has none.
        times: Of `AT_MOST`, how often.
        stop: The condition that ends the timing; any where it has none.
    """

    timing: Timing
    response: Expr
    trigger: Trigger = Trigger.FIRST
    condition: Expr = TRUE
    scope: Scope = Scope.ALL
    mode: Expr = TRUE
    cycles: int = 0
    times: int = 0
    stop: Expr = TRUE
    end: Expr = TRUE
