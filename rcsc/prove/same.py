"""Whether two tables over the same declarations do the same, whatever the input.

In: two programs that differ in one table. Out: `Same`, `Differs` with the least input, or `NotDecided`. The same line's worth: no
line, several lines, or one line after whose actions every variable has the same value. Asked of Z3 pair of lines by pair
of lines, under the assumptions of the first table and the program's invariants; lines are compared by what they do, not by name.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.meaning import relying
from rcsc.model import Action, Kind, Program, Scalar, Table, Value, Variable, VariableName, value_of_key
from rcsc.prove import smt, values
from rcsc.prove.effect import Shared
from rcsc.prove.encode import Frame, least_witness
from rcsc.prove.evaluation import State, TooLongError
from rcsc.prove.options import Options
from rcsc.prove.smt import Answer, Solver
from rcsc.prove.steps import assumed
from rcsc.prove.symbolic import Run
from rcsc.prove.values import Node

NO_LINE, SEVERAL_LINES = "no line", "several lines"


@dataclass(frozen=True, slots=True)
class Same:
    """Proved: no admitted input tells the two tables apart.

    Attributes:
        questions: How many were put to Z3; the others were settled by looking.
    """

    questions: int


@dataclass(frozen=True, slots=True)
class Differs:
    """An input for which they do not do the same.

    Attributes:
        witness: By variable, in declared order.
        first: What the first table does: a line's name, `no line` or `several lines`.
        second: What the second does.
        changed: Variables that have different values afterwards; empty where the lines differ in kind.
    """

    witness: tuple[tuple[Variable, Value], ...]
    first: str
    second: str
    changed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NotDecided:
    """Z3 gave no answer to one of the questions."""

    first: str
    second: str


Comparison: TypeAlias = Same | Differs | NotDecided


@dataclass(frozen=True, slots=True, eq=False)
class _Outcome:
    """What one table does for some inputs: the condition, and the leaves written; None where nothing runs."""

    name: str
    when: Node
    leaves: dict[str, Node] | None


def compare(first: tuple[Program, Table], second: tuple[Program, Table], options: Options) -> Comparison:
    """Whether the tables do the same for every input that the first one's assumptions admit."""
    try:
        return _Question(first, second, options).answer()
    except (TooLongError, RecursionError):
        return NotDecided("", "")
    except smt.troubles():
        return NotDecided("", "")


class _Question:
    def __init__(self, first: tuple[Program, Table], second: tuple[Program, Table], options: Options) -> None:
        self.options = options
        self.shared = Shared()
        self.start = self.shared.start
        program = relying(first[0])
        self.variables = program.variables
        self.kinds = {str(v.name): v.type for v in program.variables}
        self.one, self.two = list(self._outcomes(*first)), list(self._outcomes(*second))
        table = next(one for one in program.tables if one.name == first[1].name)
        run = Run({}, self.kinds, self.start)
        self.known = [run.evaluate(condition) for condition in assumed(program, table)]
        self.questions = 0

    def answer(self) -> Comparison:
        """Each outcome of the first table against those of the second that it can meet, its namesake first."""
        for one in self.one:
            left = one.when  # what of it no outcome of the second table has met yet
            for two in sorted(self.two, key=lambda two: two.name != one.name):
                found = self._asked(one, two)
                if found is not None:
                    return found
                left = values.both(left, values.negation(two.when))
                if self._check(left)[0] is Answer.UNSATISFIABLE:
                    break
        return Same(self.questions)

    def _outcomes(self, program: Program, table: Table) -> Iterator[_Outcome]:
        """What the table can come to; the conditions exclude each other and leave nothing out."""
        run = Run({}, self.kinds, self.start)
        lines = [values.all_of(run.evaluate(t.condition) for t in line.tests if t) for line in table.lines]
        none = values.negation(values.any_of(lines))
        before, twice = values.FALSE, values.FALSE
        for when in lines:
            twice = values.either(twice, values.both(before, when))
            before = values.either(before, when)
        for line, when in zip(table.lines, lines, strict=True):
            alone = values.both(when, values.negation(twice))
            yield _Outcome(line.name, alone, self._done(program, line.actions))
        if table.default is None:
            yield _Outcome(NO_LINE, none, None)
        else:
            yield _Outcome(table.default.name, none, self._done(program, table.default.actions))
        yield _Outcome(SEVERAL_LINES, twice, None)

    def _done(self, program: Program, actions: tuple[Action, ...]) -> dict[str, Node]:
        run = Run({str(p.name): p for p in program.procedures}, self.kinds, self.start)
        for action in actions:
            run.state = State(dict(run.state.leaves))
            run.execute((action.statement,))
        return dict(run.state.leaves)

    def _unlike(self, one: _Outcome, two: _Outcome) -> Node:
        if one.leaves is None or two.leaves is None:
            return values.truth(one.name != two.name)
        return values.any_of(node for _, node in self._changes(one.leaves, two.leaves))

    def _changes(self, one: dict[str, Node], two: dict[str, Node]) -> Iterator[tuple[str, Node]]:
        run = Run({}, self.kinds, self.start)
        for name in {**one, **two}:
            a = one[name] if name in one else run.leaf(name)
            b = two[name] if name in two else run.leaf(name)
            same = self.shared.equal(a, b)
            if same is not values.TRUE:
                yield name, values.negation(same)

    def _check(self, wrong: Node) -> tuple[Answer, Solver | None, dict[str, Node]]:
        """Whether it can be, the solver that says so, and the variables that it is about."""
        if wrong is values.FALSE:
            return Answer.UNSATISFIABLE, None, {}
        self.questions += 1
        found = values.variables([*self.known, wrong])
        solver = Solver(self.options.limits)
        solver.add(*values.domain(found.values()), *map(values.term_of, [*self.known, wrong]))
        return solver.check(), solver, found

    def _asked(self, one: _Outcome, two: _Outcome) -> Comparison | None:
        """None where the two outcomes cannot meet, or are the same where they do."""
        answer, solver, found = self._check(values.all_of((one.when, two.when, self._unlike(one, two))))
        if solver is None or answer is Answer.UNSATISFIABLE:
            return None
        if answer is Answer.UNKNOWN:
            return NotDecided(one.name, two.name)
        return self._witness(solver, found, one, two)

    def _witness(self, solver: Solver, found: dict[str, Node], one: _Outcome, two: _Outcome) -> Comparison:
        order = {v.name: at for at, v in enumerate(self.variables)}
        names = sorted(found, key=lambda name: (order.get(VariableName(name), len(order)), name))
        shown = [_shown(name, found[name].kind) for name in names]
        frame = Frame({name: values.term_of(node) for name, node in found.items()})
        least = least_witness(solver, shown, frame)
        if least is None:
            return NotDecided(one.name, two.name)
        changed: tuple[str, ...] = ()
        if one.leaves is not None and two.leaves is not None:
            changed = tuple(
                name
                for name, node in self._changes(one.leaves, two.leaves)
                if solver.check(values.term_of(node)) is Answer.SATISFIABLE
            )
        return Differs(tuple((v, least[v.name]) for v in shown), one.name, two.name, changed)


def _shown(name: str, kind: Scalar) -> Variable:
    return Variable(VariableName(name), Kind.STATE, kind, value_of_key(kind, 0))
