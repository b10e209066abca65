"""Which line of a table can match in the cycle after which.

In: a table of a program. Out: pairs of lines, each answered by Z3 under the table's assumptions and the program's
invariants; a question without an answer raises `UndecidedError`.

The whole cycle is followed: the first line's actions, postprocess, any new inputs, deferred values, preprocess. At first
nothing is under way: deferred values are the present ones (see `steps`). Arithmetic on doubles is taken to give any value
within its bounds: there it may say "can" too often, never too seldom. Of the levels around nothing is known.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count

from rcsc.lang.meaning import relying
from rcsc.lang.model import (
    Call,
    Int,
    Kind,
    Level,
    OneTable,
    ProcedureName,
    Program,
    Real,
    Single,
    Table,
    TableByCommand,
    Value,
    pending,
)
from rcsc.lang.operator_table import CALCULATIONS
from rcsc.proof.relation.effect import words_of
from rcsc.proof.relation.questions import needed, possible, stated
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Term, UndecidedError
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.encode import within
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class Follow:
    """A line that can match in the cycle after another.

    Attributes:
        line: Position of the first; DEFAULT is after the last.
        then: Position of the second.
        needed: Columns of the second whose tests the first and the others do not imply.
    """

    line: int
    then: int
    needed: tuple[int, ...]


def following(program: Program, table: Table, options: Options) -> list[Follow]:
    """Return every pair of lines of which the second can match in the cycle after the first.

    Raises:
        UndecidedError: Z3 gave no answer, or a cycle is too long to follow.
    """
    whole = relying(program)
    own = whole.table(table.name)
    try:
        return list(_Cycles(whole, own, _level_of(whole, own), options).pairs())
    except (TooLongError, RecursionError) as error:
        raise UndecidedError from error
    except smt.troubles() as error:
        raise UndecidedError from error


def _level_of(program: Program, table: Table) -> tuple[Level, Value | None] | None:
    """Return the level that runs the table, and the value of its selector; None where none does."""
    for level in program.levels:
        for choice in level.choices:
            if isinstance(choice, OneTable):
                if choice.table == table.name:
                    return level, None
                continue
            for value, name in choice.tables:
                if name == table.name:
                    return level, value
    return None


def loosened(nodes: Sequence[Node], numbers: Iterator[int]) -> Iterator[Term]:
    """Makes every result of arithmetic on doubles any value within its bounds, and yields the bounds.

    Args:
        nodes: None of which is a term yet.
        numbers: Others for each result: two results are not the same.
    """
    for node in values.parts_first(*nodes):
        if node.op in CALCULATIONS and any(isinstance(part.kind, Real) for part in (node, *node.args)):
            if node.term is None:
                node.term = smt.variable(f"double!{next(numbers)}", node.kind)
            if node.ordered:
                ends = (
                    Int(int(node.low), int(node.high))
                    if isinstance(node.kind, Int)
                    else (Single if isinstance(node.kind, Single) else Real)(node.low, node.high)
                )
                yield within(node.term, ends)


class _Cycles:
    """Two cycles of the level one after the other, from any state."""

    def __init__(
        self, program: Program, table: Table, level: tuple[Level, Value | None] | None, options: Options
    ) -> None:
        self.program, self.table, self.level = program, table, level
        self.words = words_of(program.kinds, program)
        self.start = {name: self._variable(name, name) for name in self.words}
        self.options = options
        self.loose = count(1)

    def pairs(self) -> Iterator[Follow]:
        """Yield every pair that is possible."""
        first = Run.of(self.program, self.start)
        self._before_table(first, 1)
        for variable in self.program.variables:
            if variable.deferred_until is not None:
                first.state.leaves[pending(variable.name)] = first.leaf(variable.name)
        facts = self._facts(first)
        lines = self._lines(self._tests(first))
        for at, line in enumerate(self.table.every_line):
            run = Run.of(self.program, self.start)
            run.state = first.state.copy()
            run.execute(action.statement for action in line.actions)
            self._others(run, after=True)
            self._procedures(run, () if self.level is None else self.level[0].postprocess)
            self._before_table(run, 2)
            known = [*facts, lines[at], *self._facts(run)]
            tests = self._tests(run)
            nexts = self._lines(tests)
            bounds = list(loosened(known + nexts, self.loose))  # before there are terms
            solver = stated(known, self.options, nexts)
            solver.add(*bounds)
            for to, node in enumerate(nexts):
                if possible(solver, node):
                    can_be = partial(possible, solver)
                    yield Follow(at, to, needed(tests[to], can_be) if to < len(tests) else ())

    def _variable(self, name: str, new: str) -> Node:
        """Return any value of a leaf, under a new name; of a word that is looked at by bits alone, its bits."""
        node = values.variable(new, self.program.kinds[name])
        if name in self.words:
            node.term = smt.word(new, self.words[name])
        return node

    def _before_table(self, run: Run, number: int) -> None:
        """Give the inputs any values, take the deferred values that are due, and run the preprocess."""
        for variable in self.program.variables:
            if variable.kind is Kind.INPUT:
                run.state.leaves[variable.name] = self._variable(variable.name, f"{variable.name}'{number}")
        run.settle(self.program)
        self._procedures(run, () if self.level is None else self.level[0].preprocess)
        self._others(run, after=False)

    def _others(self, run: Run, *, after: bool) -> None:
        """Run the cycle's tables before this one, or after it."""
        choices = () if self.level is None else self.level[0].choices
        own = next((at for at, choice in enumerate(choices) if self.table.name in choice.names), 0)
        tables = {str(table.name): table for table in self.program.tables}
        for choice in choices[own + 1 :] if after else choices[:own]:
            run.run_choice(choice, tables)

    def _procedures(self, run: Run, names: Sequence[str]) -> None:
        run.execute(Call(ProcedureName(name)) for name in names)

    def _facts(self, run: Run) -> list[Node]:
        """Return what is known before the match."""
        facts = [run.evaluate(assumption.condition) for assumption in self.program.assumed(self.table)]
        own = (
            [choice for choice in self.level[0].choices if self.table.name in choice.names]
            if self.level
            else []
        )
        if self.level is not None and self.level[1] is not None and isinstance(own[0], TableByCommand):
            selector = own[0].selector
            facts.append(values.equal(run.evaluate(selector), values.constant(selector.type, self.level[1])))
        return facts

    def _tests(self, run: Run) -> list[Mapping[int, Node]]:
        """Return the tests of each line, by column, as they are then; one that several lines state is evaluated once."""
        known = {id(test): run.evaluate(test.condition) for test in self.table.distinct_tests}
        return [
            {at: known[id(test)] for at, test in enumerate(line.tests) if test is not None}
            for line in self.table.lines
        ]

    def _lines(self, tests: Sequence[Mapping[int, Node]]) -> list[Node]:
        """State for each line that it matches then; DEFAULT comes last."""
        lines = [values.all_of(each.values()) for each in tests]
        none = values.negation(values.any_of(lines))
        return [*lines, none] if self.table.default is not None else lines
