"""Whether two tables over the same declarations do the same, whatever the input.

In: two programs that differ in one table. Out: `Same`, `Differs` with the least input, or `NotDecided`. Both do the same where both have
an undefined condition, match no line or match several, or where each matches one line and the actions of these end alike, call the same
extern procedures in the same states with the same values, and leave every variable the same. Z3 is asked about pairs of lines,
under the assumptions of the first table and the program's invariants; lines are compared by what they do, not by name, and what they
look back at by what feeds it (`rcsc.lang.hidden`): of a state that the compiler adds to one of the programs alone nothing is known.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.lang.hidden import hidden, matched
from rcsc.lang.meaning import relying
from rcsc.lang.model import Action, Kind, Program, Scalar, Table, Value, Variable, VariableName, value_of_key
from rcsc.proof.relation.steps import assumed
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.effect import Effect, Meaning, Shared, differences, several
from rcsc.proof.symbolic.encode import Frame, least_witness
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import Node

NO_LINE, SEVERAL_LINES, UNDEFINED = "no line", "several lines", "an undefined condition"


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
        first: What the first table does: a line's name, `no line`, `several lines` or `an undefined condition`.
        second: What the second does.
        changed: What differs afterwards: variables by name, `RUN` and `CALLS`; empty where the lines differ in kind.
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
    """What one table does for some inputs: the condition, and what its actions do; None where nothing runs."""

    name: str
    when: Node
    effect: Effect | None


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
        other, one = matched(second[0], first[0])
        program = relying(one)
        self.variables = program.variables
        self.kinds = {str(v.name): v.type for v in (*other.variables, *program.variables)}
        own = hidden(one) ^ hidden(other)
        self.compared = [name for name in self.kinds if name not in own]
        for name, kind in self.kinds.items():
            self.start[name] = self.shared.canonical(values.variable(name, kind))
        self.outcomes = list(self._outcomes(one, _named(one, first[1])))
        self.others = list(self._outcomes(other, _named(other, second[1])))
        table = _named(program, first[1])
        run = Run({}, self.kinds, self.start)
        self.known = [run.evaluate(condition) for condition in assumed(program, table)]
        self.questions = 0

    def answer(self) -> Comparison:
        """Compare each outcome of the first table with those of the second that it can meet, namesake first."""
        for outcome in self.outcomes:
            left = outcome.when  # what of it no outcome of the second table has met yet
            for other in sorted(self.others, key=lambda other: other.name != outcome.name):
                comparison = self._asked(outcome, other)
                if comparison is not None:
                    return comparison
                left = values.both(left, values.negation(other.when))
                if self._check(left)[0] is Answer.UNSATISFIABLE:
                    break
        return Same(self.questions)

    def _outcomes(self, program: Program, table: Table) -> Iterator[_Outcome]:
        """Yield the table's outcomes; their conditions are disjoint and cover every input."""
        meaning = Meaning(program, self.kinds, self.shared)
        lines = meaning.lines(table)
        undefined, twice = values.any_of(meaning.bad), several(lines)
        defined, none = values.negation(undefined), values.negation(values.any_of(lines))
        for line, when in zip(table.lines, lines, strict=True):
            alone = values.all_of((when, values.negation(twice), defined))
            yield _Outcome(line.name, alone, _done(meaning, line.actions))
        none = values.both(none, defined)
        if table.default is None:
            yield _Outcome(NO_LINE, none, None)
        else:
            yield _Outcome(table.default.name, none, _done(meaning, table.default.actions))
        yield _Outcome(SEVERAL_LINES, values.both(twice, defined), None)
        yield _Outcome(UNDEFINED, undefined, None)

    def _unlike(self, first: _Outcome, second: _Outcome) -> Node:
        if first.effect is None or second.effect is None:
            return values.truth(first.name != second.name)
        return values.any_of(node for _, node in self._changes(first.effect, second.effect))

    def _changes(self, first: Effect, second: Effect) -> Iterator[tuple[str, Node]]:
        """Yield what can differ afterwards, and where it does."""
        return differences(first, second, self.compared, self.shared)

    def _check(self, wrong: Node) -> tuple[Answer, Solver | None, dict[str, Node]]:
        """Ask whether `wrong` is possible; return the answer, its solver and variables."""
        if wrong is values.FALSE:
            return Answer.UNSATISFIABLE, None, {}
        self.questions += 1
        variables = values.variables([*self.known, wrong])
        solver = Solver(self.options.limits)
        solver.add(*values.domain(variables.values()), *map(values.term_of, [*self.known, wrong]))
        return solver.check(), solver, variables

    def _asked(self, first: _Outcome, second: _Outcome) -> Comparison | None:
        """Compare two outcomes; None where they never meet, or agree where they do."""
        answer, solver, variables = self._check(
            values.all_of((first.when, second.when, self._unlike(first, second)))
        )
        if solver is None or answer is Answer.UNSATISFIABLE:
            return None
        if answer is Answer.UNKNOWN:
            return NotDecided(first.name, second.name)
        return self._witness(solver, variables, first, second)

    def _witness(
        self, solver: Solver, variables: dict[str, Node], first: _Outcome, second: _Outcome
    ) -> Comparison:
        order = {v.name: at for at, v in enumerate(self.variables)}
        names = sorted(variables, key=lambda name: (order.get(VariableName(name), len(order)), name))
        shown = [_shown(name, variables[name].kind) for name in names]
        frame = Frame({name: values.term_of(node) for name, node in variables.items()})
        least = least_witness(solver, shown, frame)
        if least is None:
            return NotDecided(first.name, second.name)
        changed: tuple[str, ...] = ()
        if first.effect is not None and second.effect is not None:
            changed = tuple(
                name
                for name, node in self._changes(first.effect, second.effect)
                if solver.check(values.term_of(node)) is Answer.SATISFIABLE
            )
        return Differs(tuple((v, least[v.name]) for v in shown), first.name, second.name, changed)


def _named(program: Program, table: Table) -> Table:
    return next(candidate for candidate in program.tables if candidate.name == table.name)


def _done(meaning: Meaning, actions: tuple[Action, ...]) -> Effect:
    return meaning.effect(action.statement for action in actions)


def _shown(name: str, kind: Scalar) -> Variable:
    return Variable(VariableName(name), Kind.STATE, kind, value_of_key(kind, 0))
