"""What is proved of every level, as conditions on one cycle from any reachable state.

In: a stepper and a cycle from anywhere. Out: `Goal`s, each of which is to hold in every cycle. They are of two kinds:
what is claimed of the level itself, and what it guarantees its neighbours, which is what they assume of it
(`compose.__doc__`).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from rcsc.compose.contract import COMMAND, ECHO, ECHOED, NUMBER, Below, leaves_under
from rcsc.compose.transition import Cycle, Stepper, successor
from rcsc.model import pending
from rcsc.prove import values
from rcsc.prove.values import Node

FLAG = "new_command"
"""True until the level's own answer to a new command is echoed (sections 8.3 and 9)."""


class Sort(StrEnum):
    """What a goal is about; the value is how it is shown."""

    ASSUMPTION = "assumption"
    SOME_LINE = "some line matches"
    ONE_LINE = "no two lines match"
    NO_DEFAULT = "DEFAULT is not reached"
    ECHOES = "the report echoes the command that it answers"
    NUMBERED = "the order changes only with its number"
    NEXT_NUMBER = "numbers are used one after the other"
    WAITS = "no other command replaces an order before its echo, but for a new command"
    ONCE = "a command number is taken up once"
    DEFERRED = "no state is written directly while another is pending"


@dataclass(frozen=True, slots=True)
class Goal:
    """One condition.

    Attributes:
        table: Whose it is; empty where it is the level's.
        name: Of the assumption, the buffer, or the leaf.
        holds: The condition.
    """

    sort: Sort
    table: str
    name: str
    holds: Node

    @property
    def shown(self) -> str:
        """In one line, without the table."""
        if self.sort is Sort.ASSUMPTION:
            return f"assumption `{self.name}`"
        return f"{self.sort.value}: `{self.name}`" if self.name else self.sort.value


def goals(stepper: Stepper, cycle: Cycle) -> tuple[Goal, ...]:
    """All goals of a level, its tables' first."""
    return (*_tables(cycle), *_upward(stepper, cycle), *_downward(stepper, cycle), *_own(stepper, cycle))


def _tables(cycle: Cycle) -> Iterator[Goal]:
    for at in cycle.tables:
        name = str(at.table.name)
        for assumption, condition in at.assumptions.items():
            yield Goal(Sort.ASSUMPTION, name, assumption, values.follows(at.chosen, condition))
        some = values.follows(at.chosen, values.negation(at.none))
        if at.table.default is None:
            yield Goal(Sort.SOME_LINE, name, "", some)
        elif at.table.default.unreachable:
            yield Goal(Sort.NO_DEFAULT, name, "", some)
        yield Goal(Sort.ONE_LINE, name, "", values.follows(at.chosen, values.negation(at.several())))


def _upward(stepper: Stepper, cycle: Cycle) -> Iterator[Goal]:
    """What the superior assumes of this level."""
    if (above := stepper.links.above) is None:
        return
    number = values.equal(cycle.after[f"{above.report}.{ECHO}"], cycle.taken[f"{above.order}.{NUMBER}"])
    command = values.equal(cycle.after[f"{above.report}.{ECHOED}"], cycle.taken[f"{above.order}.{COMMAND}"])
    yield Goal(Sort.ECHOES, "", above.report, values.both(number, command))


def _downward(stepper: Stepper, cycle: Cycle) -> Iterator[Goal]:
    """What the subordinates assume of this level, and that it waits for them."""
    for below in stepper.links.below:
        number = f"{below.order}.{NUMBER}"
        before, after = cycle.before[number], cycle.after[number]
        same = values.equal(before, after)
        for leaf in leaves_under(stepper.program, below.order):
            if leaf != number:
                kept = values.equal(cycle.before[leaf], cycle.after[leaf])
                yield Goal(Sort.NUMBERED, "", leaf, values.follows(same, kept))
        yield Goal(
            Sort.NEXT_NUMBER, "", below.order, values.either(same, values.equal(after, successor(before)))
        )
        if stepper.links.above is not None:
            command = f"{below.order}.{COMMAND}"
            kept = values.equal(cycle.before[command], cycle.after[command])
            yield Goal(Sort.WAITS, "", below.order, values.follows(_waiting(stepper, cycle, below), kept))


def _waiting(stepper: Stepper, cycle: Cycle, below: Below) -> Node:
    """The command is the last one, and the order is not echoed."""
    above = stepper.links.above
    assert above is not None
    number = f"{above.order}.{NUMBER}"
    sent = cycle.before[f"{below.order}.{NUMBER}"]
    echo = f"{below.report}.{ECHO}"
    return values.all_of(
        (
            values.equal(cycle.before[number], cycle.taken[number]),
            values.negation(values.equal(cycle.taken[echo], sent)),
        )
    )


def _own(stepper: Stepper, cycle: Cycle) -> Iterator[Goal]:
    above = stepper.links.above
    if above is not None and FLAG in cycle.before:
        same = values.equal(cycle.before[f"{above.order}.{NUMBER}"], cycle.taken[f"{above.order}.{NUMBER}"])
        rises = values.both(cycle.after[FLAG], values.negation(cycle.before[FLAG]))
        yield Goal(Sort.ONCE, "", FLAG, values.follows(same, values.negation(rises)))
    for variable in stepper.program.variables:
        if variable.deferred_until is not None:
            untouched = values.equal(cycle.after[variable.name], cycle.middle[variable.name])
            agreed = values.equal(cycle.after[variable.name], cycle.after[pending(variable.name)])
            yield Goal(Sort.DEFERRED, "", str(variable.name), values.either(untouched, agreed))
