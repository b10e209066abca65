"""Which line leads from which state to which.

In: a table, and the variable that holds its state. Out: steps, each answered by Z3 under the table's
assumptions and the program's invariants; a question without an answer raises `UnansweredError`: nothing is drawn from it.

A step is one match: the state before it, and the state that the line's actions lead to. If the state is
deferred, its pending value counts; before the match that is taken to be the present one: nothing is under way. Under the
protocol a line that gives an order matches again until its echo, and a line that says nothing of the state stays.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from rcsc.lang.meaning import relying
from rcsc.lang.model import Action, Expr, Program, Table, Value, Variable, key_bounds, pending, value_of_key
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node

MOST_STATES = 64
"""Values of a state variable up to which a graph of them is drawn."""


class UnansweredError(Exception):
    """Z3 gave no answer within its limits, or a run is too long to follow."""


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


@dataclass(slots=True)
class Steps:
    """One table's steps.

    Attributes:
        state: The variable whose values are the states; an enumeration, a boolean or a few integers.
    """

    program: Program
    table: Table
    state: Variable
    options: Options
    _start: dict[str, Node] = field(default_factory=dict)
    _solver: Solver = field(init=False)
    _lines: list[Node] = field(init=False)
    _asserted: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.program = relying(self.program)
        self.table = next(table for table in self.program.tables if table.name == self.table.name)
        self._solver = Solver(self.options.limits)
        before = values.variable(self.state.name, self.state.type)
        self._start[self.state.name] = before
        if self.state.deferred_until is not None:
            self._start[pending(self.state.name)] = before
        run = self._run()
        self._know([run.evaluate(assumption) for assumption in assumed(self.program, self.table)])
        lines = [
            values.all_of(run.evaluate(t.condition) for t in line.tests if t) for line in self.table.lines
        ]
        none = values.negation(values.any_of(lines))
        self._lines = [*lines, none] if self.table.default is not None else lines

    def states(self) -> list[Value]:
        """The values that the state variable can have under the assumptions, in order."""
        return [value for value in self._values() if self._possible(self._is(self._before(), value))]

    def steps(self, states: Sequence[Value]) -> list[Step]:
        """Every step from these states; by line, then in the states' order."""
        steps: list[Step] = []
        for at, actions in enumerate(self._actions()):
            after = self._after(actions)
            self._declare([self._lines[at], *(node for pair in after for node in pair)])
            self._solver.push()  # a line is stated once, for all states
            self._solver.add(values.term_of(self._lines[at]))
            for source in states:
                here = self._is(self._before(), source)
                if self._possible(here):
                    targets = [value for value in self._values() if self._leads(here, source, value, after)]
                    steps += [Step(at, source, target, len(targets) > 1) for target in targets]
            self._solver.pop()
        return steps

    def _leads(self, here: Node, source: Value, target: Value, after: Sequence[tuple[Node, Node]]) -> bool:
        """Whether the line that is stated can lead from a state to another; where it leaves the state as it is nothing is asked."""
        return any(
            source == target
            if when is values.TRUE and node is self._before()
            else self._possible(here, when, self._is(node, target))
            for when, node in after
        )

    def sets(self, action: Action) -> Value | None:
        """The state that the action alone, whatever the input, leads to; None where it does anything else too."""
        run = self._followed([action])
        written = {name for name, when in run.state.wrote.items() if when is not values.FALSE}
        if written != {self._next()} or run.state.wrote[self._next()] is not values.TRUE:
            return None
        after = run.leaf(self._next())
        return value_of_key(self.state.type, int(after.low)) if after.known else None

    def writes(self, action: Action) -> bool:
        """Whether the action can write the state."""
        return not {self._next(), self.state.name}.isdisjoint(self._followed([action]).state.wrote)

    def needed(self, line: int, source: Value | None) -> tuple[int, ...]:
        """Columns of a line whose tests the state and the others do not imply; in every state where it is None."""
        run = self._run()
        tests = {
            at: run.evaluate(test.condition)
            for at, test in enumerate(self.table.lines[line].tests)
            if test is not None
        }
        here = [] if source is None else [self._is(self._before(), source)]
        for at in list(tests):
            others = [node for column, node in tests.items() if column != at]
            if not self._possible(*here, *others, values.negation(tests[at])):
                del tests[at]
        return tuple(tests)

    # --- parts ---

    def _run(self) -> Run:
        kinds = {str(v.name): v.type for v in self.program.variables}
        return Run({str(p.name): p for p in self.program.procedures}, kinds, self._start)

    def _next(self) -> str:
        return pending(self.state.name) if self.state.deferred_until is not None else self.state.name

    def _before(self) -> Node:
        return self._start[self.state.name]

    def _values(self) -> Iterator[Value]:
        low, high = key_bounds(self.state.type)
        return (value_of_key(self.state.type, key) for key in range(low, high + 1))

    def _is(self, node: Node, value: Value) -> Node:
        return values.equal(node, values.constant(self.state.type, value))

    def _actions(self) -> list[tuple[Action, ...]]:
        default = [] if self.table.default is None else [self.table.default.actions]
        return [*(line.actions for line in self.table.lines), *default]

    def _followed(self, actions: Sequence[Action]) -> Run:
        run = self._run()
        _execute(run, actions)
        return run

    def _after(self, actions: Sequence[Action]) -> list[tuple[Node, Node]]:
        """Return the states that the actions lead to, each with its condition: the pending one, and one written directly."""
        run = self._followed(actions)
        successors = [(values.TRUE, run.leaf(self._next()))]
        if self.state.name != self._next() and self.state.name in run.state.wrote:
            successors.append((run.state.wrote[self.state.name], run.leaf(self.state.name)))
        return successors

    def _know(self, nodes: Sequence[Node]) -> None:
        self._declare(nodes)
        self._solver.add(*map(values.term_of, nodes))

    def _declare(self, nodes: Sequence[Node]) -> None:
        """Asserts the ranges of variables not met before."""
        new = [node for name, node in values.variables(nodes).items() if name not in self._asserted]
        self._asserted.update(node.name for node in new)
        self._solver.add(*values.domain(new))

    def _possible(self, *nodes: Node) -> bool:
        if any(node is values.FALSE for node in nodes):
            return False
        self._declare(nodes)
        return answered(self._solver, *map(values.term_of, nodes))


def assumed(program: Program, table: Table) -> list[Expr]:
    """The conditions that the table may rely on."""
    return [
        assumption.condition for assumption in program.assumptions if assumption.name in table.assumptions
    ]


def answered(solver: Solver, *terms: Term) -> bool:
    """Whether the terms can hold; UnansweredError where the solver cannot say."""
    solver.push()
    try:
        solver.add(*terms)
        answer = solver.check()
    finally:
        solver.pop()
    if answer is Answer.UNKNOWN:
        raise UnansweredError
    return answer is Answer.SATISFIABLE


def _execute(run: Run, actions: Sequence[Action]) -> None:
    try:
        run.execute(action.statement for action in actions)
    except (TooLongError, RecursionError) as error:
        raise UnansweredError from error
