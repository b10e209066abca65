"""Which line leads from which state to which.

In: a table, and the variable that holds its state. Out: steps, each answered by Z3 under the table's
assumptions and the program's invariants; a question without an answer raises `UndecidedError`: nothing is drawn from it.

A step is one match: the state before it, and the state that the line's actions lead to. If the state is
deferred, its pending value counts; before the match that is taken to be the present one: nothing is under way. Under the
protocol a line that gives an order matches again until its echo, and a line that says nothing of the state stays.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from rcsc.lang.meaning import relying
from rcsc.lang.model import (
    Action,
    Bool,
    Enum,
    Int,
    Program,
    Scalar,
    Table,
    Value,
    Variable,
    key_bounds,
    pending,
    value_of_key,
)
from rcsc.proof.relation.effect import Effect, Meaning, Shared, value_after
from rcsc.proof.relation.questions import Independent, needed, pair_is
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import UndecidedError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.values import Node

MOST_STATES = 64
"""Values of a state variable up to which a graph of them is drawn."""


def is_few(kind: Scalar) -> bool:
    """Return whether a variable of the type can hold a state: an enumeration, a boolean or a few integers."""
    low, high = key_bounds(kind)
    return isinstance(kind, Enum | Bool | Int) and high - low < MOST_STATES


@dataclass(frozen=True, slots=True)
class Step:
    """A line that can match in a state, and the state that it leads to.

    Attributes:
        line: Its position; DEFAULT is after the last.
        source: The state before, as a value of the variable.
        target: The state that the actions lead to.
        decided: Whether what the procedures compute decides it: the same line can lead elsewhere from there.
    """

    line: int
    source: Value
    target: Value
    decided: bool = False


class Steps:
    """One table's steps.

    Attributes:
        state: The variable whose values are the states; an enumeration, a boolean or a few integers.
    """

    def __init__(self, program: Program, table: Table, state: Variable, options: Options) -> None:
        program = relying(program)
        self.table, self.state = program.table(table.name), state
        self._next = str(state.name if state.deferred_until is None else pending(state.name))
        self._shared = Shared(program.kinds, program)
        self._before = self._shared.start[self._next] = self._shared.start[str(state.name)]
        self._meaning = Meaning(program, self._shared)
        self._asked = Independent(self._meaning.assumed(self.table), options)
        self._lines = self._meaning.every_line(self.table)

    def states(self) -> list[Value]:
        """Return the values that the state variable can have under the assumptions, in order."""
        return [value for value in self._values() if self._possible(self._is(value))]

    def steps(self, states: Sequence[Value]) -> list[Step]:
        """Return every step from these states; by line, then in the states' order."""
        steps: list[Step] = []
        for at, line in enumerate(self.table.every_line):
            pairs = self._pairs(self._lines[at], line.actions)
            for source in states:
                targets = [value for value in self._values() if (source, value) in pairs]
                steps += [Step(at, source, target, len(targets) > 1) for target in targets]
        return steps

    def _pairs(self, line: Node, actions: Sequence[Action]) -> set[tuple[Value, Value]]:
        """Return every state before with one to which the actions lead: the pending one, and one written directly."""
        effect = self._effect(actions)
        after = [(values.TRUE, value_after(effect, self._next, self._shared))]
        if self.state.name != self._next and self.state.name in effect.wrote:
            after.append((effect.wrote[self.state.name], effect.leaves[self.state.name]))
        pairs = set[tuple[Value, Value]]()
        for when, node in after:
            pairs.update(self._asked.pairs((line, when), self._before, node))
        return pairs

    def sets(self, action: Action) -> Value | None:
        """Return the state that the action alone, whatever the input, leads to; None where it does anything else too."""
        effect = self._effect([action])
        written = {name for name, when in effect.wrote.items() if not when.known or when.low}
        if written != {self._next} or not effect.wrote[self._next].known:
            return None
        after = effect.leaves[self._next]
        return value_of_key(self.state.type, int(after.low)) if after.known else None

    def writes(self, action: Action) -> bool:
        """Return whether the action can write the state."""
        return not {self._next, self.state.name}.isdisjoint(self._effect([action]).wrote)

    def needed(self, line: int, source: Value | None) -> tuple[int, ...]:
        """Columns of a line whose tests the state and the others do not imply; in every state where it is None."""
        tests = enumerate(self.table.lines[line].tests)
        stated = {at: self._meaning.condition(test.condition) for at, test in tests if test is not None}
        here = [] if source is None else [self._is(source)]
        return needed(stated, partial(self._possible, *here))

    # --- parts ---

    def _values(self) -> Iterator[Value]:
        low, high = key_bounds(self.state.type)
        return (value_of_key(self.state.type, key) for key in range(low, high + 1))

    def _is(self, value: Value) -> Node:
        return pair_is([self._before], [value])

    def _effect(self, actions: Sequence[Action]) -> Effect:
        try:
            return self._meaning.effect(action.statement for action in actions)
        except (TooLongError, RecursionError) as error:
            raise UndecidedError from error

    def _possible(self, *nodes: Node) -> bool:
        return self._asked.possible(*map(self._shared.canonical, nodes))
