"""Whether two tables over the same declarations do the same, whatever the input.

In: two programs that differ in one table. Out: `Same`, `Differs` with the least input, or `NotDecided`. Both do the same where both have
an undefined condition, match no line or match several, or where each matches one line and the actions of these end alike, call the same
extern procedures in the same states with the same values, and leave every variable the same. Z3 is asked about pairs of lines,
under the assumptions of the first table and the program's invariants; lines are compared by what they do, not by name, and what they
look back at by what feeds it (`rcsc.lang.hidden`): of a state that the compiler adds to one of the programs alone nothing is known.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from rcsc.lang.hidden import hidden, matched
from rcsc.lang.meaning import relying
from rcsc.lang.model import Action, Program, Table, Value, Variable, VariableName
from rcsc.proof.relation.effect import Effect, Meaning, Shared, differences
from rcsc.proof.relation.questions import stated
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import TooLongError
from rcsc.proof.symbolic.values import TRUE, Node

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
class Outcome:
    """What can become of an input.

    Attributes:
        name: Of the line; of a fault what it is.
        when: At which inputs.
        holds: Where the line matches, without what makes it the only one.
        actions: None for a fault.
    """

    name: str
    when: Node
    holds: Node = TRUE
    actions: tuple[Action, ...] | None = None


def outcomes(
    meaning: Meaning, table: Table, joined: Callable[[Sequence[Node]], Node] = values.all_of
) -> Iterator[Outcome]:
    """Yield all outcomes of a table: for each input exactly one comes about.

    Args:
        meaning: Of the table's program.
        table: The table.
        joined: How conditions are conjoined: what lines say stands first, then what makes one of them the only one.
    """
    lines = meaning.lines(table)
    undefined, many = values.any_of(meaning.bad), values.several(lines)
    fine, default = values.negation(undefined), table.default
    for line, holds in zip(table.lines, lines, strict=True):
        alone = joined((holds, values.negation(many), fine))
        yield Outcome(line.name, alone, joined((holds,)), line.actions)
    nothing = joined((values.negation(values.any_of(lines)), fine))
    if default is None:
        yield Outcome(NO_LINE, nothing)
    else:
        yield Outcome(default.name, nothing, TRUE, default.actions)
    yield Outcome(SEVERAL_LINES, joined((many, fine)))
    yield Outcome(UNDEFINED, joined((undefined,)))


def compare(first: tuple[Program, Table], second: tuple[Program, Table], options: Options) -> Comparison:
    """Return whether the tables do the same for every input that the first one's assumptions admit."""
    try:
        return _Question(first, second, options).answer()
    except (TooLongError, RecursionError):
        return NotDecided("", "")
    except smt.troubles():
        return NotDecided("", "")


class _Question:
    def __init__(self, first: tuple[Program, Table], second: tuple[Program, Table], options: Options) -> None:
        self.options = options
        other, one = matched(second[0], first[0])
        program = relying(one)
        self.variables = program.variables
        self.shared = Shared({**other.kinds, **program.kinds}, other, program)
        own = hidden(one) ^ hidden(other)
        self.compared = [name for name in self.shared.kinds if name not in own]
        self.effects: dict[Outcome, Effect] = {}
        self.outcomes = self._outcomes(one, first[1])
        self.others = self._outcomes(other, second[1])
        self.known = Meaning(program, self.shared).assumed(program.table(first[1].name))
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

    def _outcomes(self, program: Program, table: Table) -> list[Outcome]:
        meaning = Meaning(program, self.shared)
        found = list(outcomes(meaning, program.table(table.name)))
        for outcome in found:
            if outcome.actions is not None:
                self.effects[outcome] = meaning.effect(action.statement for action in outcome.actions)
        return found

    def _changes(self, first: Outcome, second: Outcome) -> list[tuple[str, Node]]:
        """Return the differences afterwards, and where they are; nothing where one of the two runs is a fault."""
        if first.actions is None or second.actions is None:
            return []
        return list(differences(self.effects[first], self.effects[second], self.compared, self.shared))

    def _check(self, wrong: Node) -> tuple[Answer, Solver | None]:
        """Ask whether `wrong` is possible; return the answer and its solver."""
        if wrong is values.FALSE:
            return Answer.UNSATISFIABLE, None
        self.questions += 1
        solver = stated([*self.known, wrong], self.options)
        return solver.check(), solver

    def _asked(self, first: Outcome, second: Outcome) -> Comparison | None:
        """Compare two outcomes; None where they never meet, or agree where they do."""
        changes = self._changes(first, second)
        if first.actions is None or second.actions is None:
            unlike = values.truth(first.name != second.name)
        else:
            unlike = values.any_of(node for _, node in changes)
        wrong = values.all_of((first.when, second.when, unlike))
        answer, solver = self._check(wrong)
        if solver is None or answer is Answer.UNSATISFIABLE:
            return None
        variables = values.variables([*self.known, wrong])
        order = {v.name: at for at, v in enumerate(self.variables)}
        names = sorted(variables, key=lambda name: (order.get(VariableName(name), len(order)), name))
        looked_at = [variables[name] for name in names]
        least = None if answer is Answer.UNKNOWN else values.least(solver, looked_at)
        if least is None:
            return NotDecided(first.name, second.name)
        changed = tuple(
            name for name, node in changes if solver.check(values.term_of(node)) is Answer.SATISFIABLE
        )
        witness = tuple((values.shown(node), least[node.name]) for node in looked_at)
        return Differs(witness, first.name, second.name, changed)
