"""Whether two lines of one table do the same, wherever both match.

In: a table and two of its lines. Out: `Effects`: that they do, or what they leave different for some such input. Both do the
same where their actions come to their end alike, call the same extern procedures in the same states with the same values, and
leave every variable the same: text plays no part. Z3 is asked under what the table may rely on, and of each variable by itself;
what folds, or differs for an input that is tried, is not asked. Of two lines that are said to do the same, `disagreement` tells an
input for which they do not, and `meeting` one for which it is said.

It costs some inputs that are tried, and a question a variable that none of them shows to be left different.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from rcsc.base.diagnostics.diagnostic import Effects
from rcsc.lang.leaves import read_by
from rcsc.lang.model import Expr, Line, Program, Table, Value
from rcsc.proof.relation.effect import Meaning, Shared, differences, value_after
from rcsc.proof.relation.questions import stated
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.symbolic import trial, values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.remembered import answered
from rcsc.proof.symbolic.values import Node


@dataclass(frozen=True, slots=True)
class Disagreement:
    """An input for which two lines do not do the same.

    Attributes:
        witness: The least one: values of what the lines look at, in declared order.
        results: What they leave different there: a variable, and its value after each line.
    """

    witness: Mapping[str, Value]
    results: tuple[tuple[str, Value, Value], ...]


def alike(
    program: Program,
    table: Table,
    pair: tuple[int, int],
    options: Options,
    where: Expr | None = None,
    near: Mapping[str, Value] | None = None,
) -> Effects:
    """Compare two lines, by position, for every input that both match, or in `where`: there is one.

    The table's assumptions hold there, and invariants where they are among these (`meaning.relying`).

    Args:
        program: Of the table.
        table: The table.
        pair: The two lines, by position.
        options: What a question may cost.
        where: Where they are compared.
        near: Such an input, where one is known: it is tried first.
    """
    first, second = (table.lines[at] for at in pair)
    if _spelled(first) == _spelled(second):
        return Effects(same=True)
    if smt.gives_up("whether two lines do the same"):
        return Effects(same=None)
    try:
        return _Comparison(program, table, (first, second), where).effects(options, near or {})
    except (TooLongError, RecursionError):
        return Effects(same=None)
    except smt.troubles():
        return Effects(same=None)


def meeting(program: Program, table: Table, where: Expr, options: Options) -> Mapping[str, Value] | Answer:
    """Find some input in `where` that the table's assumptions admit: what is looked at; else that there is none, or `UNKNOWN`."""
    if _over("whether two lines meet"):
        return Answer.UNKNOWN
    there = [where, *_relied(program, table)]
    seen = trial.aimed(there, program.variables)
    if seen is not None:
        read = {str(name) for each in there for name in read_by(each)}
        return {name: value for name, value in seen.items() if name in read}
    try:
        nodes = list(map(Run.of(program, Shared(program.kinds, program).start).evaluate, there))
        return answered(("meeting",), nodes, lambda: _point(nodes, options))
    except smt.troubles():
        return Answer.UNKNOWN


def disagreement(
    program: Program,
    table: Table,
    pair: tuple[int, int],
    options: Options,
    where: Expr,
    near: Mapping[str, Value],
) -> Disagreement | None:
    """Find an input in `where` for which two lines, by position, do not do the same; None where none is found.

    It is the least that a few steps show; values of `near` are tried first.
    """
    lines = table.lines[pair[0]], table.lines[pair[1]]
    if _over("for which input two lines do not do the same"):
        return None
    try:
        return _Comparison(program, table, lines, where).disagreement(options, near)
    except smt.troubles():
        return None


def _over(what: str) -> bool:
    """Return whether nothing more is asked: then nothing is put into Z3's words, either, which takes longer than to ask."""
    if smt.spent():
        smt.leave_open(what)
        return True
    return smt.gives_up(what)


def _relied(program: Program, table: Table) -> list[Expr]:
    """Return the condition that the table may rely on."""
    return [assumption.condition for assumption in program.assumed(table)]


def _spelled(line: Line) -> list[object]:
    """Return the line's statements, which are all that it does."""
    return [action.statement for action in line.actions]


class _Comparison:
    """Two lines of a table, and where they are compared.

    Attributes:
        changes: What they can leave different, by name, and where.
    """

    def __init__(self, program: Program, table: Table, lines: tuple[Line, Line], where: Expr | None) -> None:
        self.program, self.shared = program, Shared(program.kinds)
        meaning = Meaning(program, self.shared)
        self.first, self.second = (
            meaning.effect(action.statement for action in line.actions) for line in lines
        )
        self.changes = [
            (name, change)
            for name, change in differences(self.first, self.second, program.kinds, self.shared)
            if change is not values.FALSE
        ]
        tests = [condition for line in lines for condition in line.conditions]
        self._there = [*(tests if where is None else [where]), *_relied(program, table)]

    @cached_property
    def here(self) -> list[Node]:
        """What holds where they are compared."""
        return list(map(Run.of(self.program, self.shared.start).evaluate, self._there))

    def effects(self, options: Options, near: Mapping[str, Value]) -> Effects:
        """Say what can be left different, each name for itself."""
        open_ = [
            change for change in dict.fromkeys(each for _, each in self.changes) if change is not values.TRUE
        ]
        seen = {values.TRUE, *(trial.met(self.here, open_, near) if open_ else ())}
        answers = {
            name: Answer.SATISFIABLE if change in seen else _possible([*self.here, change], options)
            for name, change in self.changes
        }
        differ = tuple(name for name, answer in answers.items() if answer is Answer.SATISFIABLE)
        unknown = Answer.UNKNOWN in answers.values()
        return Effects(False if differ else None if unknown else True, differ)

    def disagreement(self, options: Options, near: Mapping[str, Value]) -> Disagreement | None:
        """Find an input for which something is left different, the least that a few steps show, and what."""
        wanted = values.any_of(change for _, change in self.changes)
        nodes = [*self.here, wanted]
        free = values.variables(nodes)
        kinds = self.program.kinds
        shown = [free[name] for name in kinds if name in free]
        solver = stated(nodes, options)
        known = trial.met(self.here, [wanted], near).get(wanted)
        witness = values.least(solver, shown, smt.Budget(WRONG_STEPS), known)
        if witness is None or solver.check() is not Answer.SATISFIABLE:
            return None
        results = []
        for name, change in self.changes:
            if name in kinds and solver.check(values.term_of(change)) is Answer.SATISFIABLE:
                kind = kinds[name]
                after = (value_after(effect, name, self.shared) for effect in (self.first, self.second))
                one, other = (solver.value(values.term_of(node), kind) for node in after)
                results.append((name, one, other))
        return Disagreement(witness, tuple(results))


def _possible(nodes: list[Node], options: Options) -> Answer:
    if _over("whether anything is so"):
        return Answer.UNKNOWN
    return answered(("possible",), nodes, lambda: stated(nodes, options).check())


def _point(nodes: list[Node], options: Options) -> Mapping[str, Value] | Answer:
    """Return values for which all nodes hold; else Z3's answer."""
    solver = stated(nodes, options)
    answer = solver.check()
    if answer is not Answer.SATISFIABLE:
        return answer
    return values.model(solver, values.variables(nodes).values())
