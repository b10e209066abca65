"""What a program owes besides its tables' exactly-one: derived from the program, never from a certificate.

In: a program, and for each table the assumptions whose failure stops the cycle. Out: runs with what they owe, and under
which hypotheses. A cycle admits inputs, takes deferred values, runs preprocess, stops where a stopping assumption fails, matches, runs a
line's actions and then postprocess; it may also end wherever an extern procedure's result is refused. Owed is:

- every invariant is defined for all values, holds at first, and is kept by each step of a cycle, also where it ends early, and where
  outputs then show their safe values;
- initial and safe values lie in their ranges;
- assumptions, selectors and the conditions of deferred values are defined wherever the invariants hold; a table's conditions
  wherever its stopping assumptions hold, too;
- an assumption that is declared `proved` follows from ranges and invariants;
- nothing overflows, leaves a range or an array, divides by zero or reads what is not assigned: in each line (with its conditions), in
  what levels run before and after their tables, and in procedures that nothing calls (for all parameters);
- no two actions of a line write different values to one variable;
- two lines that are said to do the same leave every variable the same, wherever both come through.

The steps are those of `rcsc/lang/interpret.py`; the argument is induction over them.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from rcsc.base.diagnostics.source import Span as Written
from rcsc.lang.leaves import everything, read_by
from rcsc.lang.model import (
    Action,
    Assumption,
    Call,
    Default,
    Expr,
    Kind,
    Level,
    Line,
    Meeting,
    Procedure,
    Program,
    Standing,
    Statement,
    Table,
    Value,
    Variable,
    pending,
)
from rcsc.lang.restart import Fixed
from rcsc.proof.certify.execution import Owed, Run, Start, TooLongError
from rcsc.proof.certify.values import Term, ends_of, sort_of


@dataclass(frozen=True, slots=True)
class Debt:
    """One run, with its obligations wherever the hypotheses hold.

    Attributes:
        too_long: The name of a run that could not be followed to its end; then nothing of it is checked.
        why: The reason.
    """

    hypotheses: tuple[Term, ...]
    owed: tuple[Owed, ...]
    too_long: str = ""
    written: Written | None = None
    why: str = "what it owes has too many steps to be followed"


class _Running(Run):
    """A run in which a cycle can end early; the invariants are owed there, too."""

    invariants: Collection[tuple[str, Expr, frozenset[str]]] = ()

    def stops(self, procedure: Procedure) -> None:
        self.keeps(self.invariants, f" where `{procedure.name}` fails")


class Debts:
    """Derives the obligations of one program."""

    def __init__(self, program: Program, start: Start) -> None:
        self.program, self.start, self.terms = program, start, start.terms
        self.invariants = [
            (str(invariant.name), invariant.condition, frozenset(map(str, read_by(invariant.condition))))
            for invariant in self.program.invariants
        ]
        self.holding = tuple(start.condition(condition) for _, condition, _ in self.invariants)

    def all(self) -> Iterator[Debt]:
        """Yield every debt."""
        yield self._first()
        if self.program.levels:
            yield self._begun_anew()
        yield from self._conditions()
        yield self._deferred()
        yield self._safe_values()
        for level in self.program.levels:
            yield self._calls(level, "preprocess", level.preprocess)
            yield self._calls(level, "postprocess", level.postprocess)
        yield from self._uncalled()
        for table in self.program.tables:
            yield from self._table(table)

    def stopping(self, table: Table) -> tuple[Term, ...]:
        """Return the conditions that hold when the table is matched: invariants and the stopping assumptions."""
        known = (
            assumption.condition for assumption in self.program.assumptions if assumption.name in table.stops
        )
        return (*self.holding, *map(self.start.condition, known))

    # --- conditions ---

    def _first(self) -> Debt:
        run = Run(self.start, "at first")
        for variable in self.program.variables:
            self._set(run, variable, variable.initial)
        for name, condition, reads in self.invariants:
            inputs = [
                variable.name
                for variable in self.program.variables
                if variable.kind is Kind.INPUT and variable.name in reads
            ]
            good_ = self.terms.false if inputs else Run.evaluate(_at(run), condition)
            run.owe(f"invariant `{name}` holds", good_)
        return Debt((), tuple(run.owed))

    def _begun_anew(self) -> Debt:
        """Owe the invariants after a restart, of constant values alone; values adopted from a buffer are owed of the levels together."""
        adopted = self.program.adopted
        fixed = {leaf: what.value for leaf, what in adopted.items() if isinstance(what, Fixed)}
        run = Run(self.start, "after a restart")
        for variable in self.program.variables:
            self._set(run, variable, fixed.get(str(variable.name), variable.initial))
        for name, condition, reads in self.invariants:
            if reads.isdisjoint(adopted.keys() - fixed.keys()):
                run.owe(f"invariant `{name}` holds", Run.evaluate(_at(run), condition))
        return Debt((), tuple(run.owed))

    def _defined(self, condition: Expr, what: str, known: Sequence[Term], cell: Written) -> Debt:
        run = Run(self.start, what, cell)
        run.evaluate(condition)
        return Debt(tuple(known), tuple(run.owed))

    def _conditions(self) -> Iterator[Debt]:
        for invariant in self.program.invariants:
            yield self._defined(invariant.condition, f"invariant `{invariant.name}`", (), invariant.span)
        for leaf in self.program.variables:
            if leaf.deferred_until is not None:
                yield self._defined(
                    leaf.deferred_until, f"`deferred until` of `{leaf.name}`", self.holding, leaf.span
                )
        for level in self.program.levels:
            for selector in level.selectors:
                where = f"`table by` of level `{level.name}`"
                yield self._defined(selector, where, self.holding, level.span)
        for assumption in self.program.assumptions:
            yield self._assumption(assumption)

    def _assumption(self, assumption: Assumption) -> Debt:
        run = Run(self.start, f"assumption `{assumption.name}`", assumption.span)
        good = run.evaluate(assumption.condition)
        if assumption.standing is Standing.PROVED:
            run.owe("follows from ranges and invariants", good)
        return Debt(self.holding, tuple(run.owed))

    # --- what runs outside lines ---

    def _deferred(self) -> Debt:
        """Run the taking of deferred values: all whose condition holds are taken at once."""
        deferred = [variable for variable in self.program.variables if variable.deferred_until is not None]
        run = Run(self.start, "taking deferred values")
        taken = [
            (
                variable.name,
                self.start.leaves[pending(variable.name)],
                self.start.condition(variable.deferred_until),
            )
            for variable in deferred
            if variable.deferred_until is not None
        ]
        for name, value, when in taken:
            run.write(name, value, when)
        run.keeps(self.invariants)
        return Debt(self.holding, tuple(run.owed))

    def _safe_values(self) -> Debt:
        """Run the showing of safe values after a fault; where the cycle ended, the invariants held."""
        run = Run(self.start, "showing safe values after a fault")
        for variable in self.program.variables:
            if variable.safe is not None:
                self._set(run, variable, variable.safe)
        run.keeps(self.invariants)
        return Debt(self.holding, tuple(run.owed))

    def _set(self, run: Run, variable: Variable, declared: Value) -> None:
        """Give a leaf a value that its declaration names; owe that its type has it."""
        value = run.state.leaves[variable.name] = self.terms.constant(sort_of(variable.type), declared)
        low, high = ends_of(variable.type)
        if not (low <= value.low and value.high <= high):
            run.owe(f"`{variable.name}` lies in its range", self.terms.false, variable.span)

    def _running(self, where: str, cell: Written) -> _Running:
        run = _Running(self.start, where, cell)
        run.invariants = self.invariants
        return run

    def _calls(self, level: Level, words: str, names: Iterable[str]) -> Debt:
        run = self._running(f"`{words}` of level `{level.name}`", level.span)
        try:
            for name in names:
                run.call(self.start.procedures[name], [])
        except (TooLongError, RecursionError):
            return Debt((), (), run.where, level.span)
        run.keeps(self.invariants)
        return Debt(self.holding, tuple(run.owed))

    def _uncalled(self) -> Iterator[Debt]:
        """Yield the debts of procedures that no line and no level runs, for all values of their parameters."""
        reached = {
            str(name) for level in self.program.levels for name in (*level.preprocess, *level.postprocess)
        }
        reached |= {
            str(call.procedure)
            for call in _calls_of(action for line in self._lines() for action in line.actions)
        }
        waiting = list(reached)
        while waiting:
            inner = everything(self.start.procedures[waiting.pop()].body)
            new = {str(statement.procedure) for statement in inner if isinstance(statement, Call)} - reached
            reached |= new
            waiting += new
        for procedure in self.program.procedures:
            if procedure.name not in reached:
                yield self._alone(procedure)

    def _lines(self) -> Iterator[Line | Default]:
        for table in self.program.tables:
            yield from table.lines
            if table.default is not None:
                yield table.default

    def _alone(self, procedure: Procedure) -> Debt:
        run = Run(self.start, f"procedure `{procedure.name}`", procedure.span)
        try:
            given = [(run.any_value(param.name, param.type), param.span) for param in procedure.params]
            run.call(procedure, given)
        except (TooLongError, RecursionError):
            return Debt((), (), run.where, procedure.span)
        return Debt((), tuple(run.owed))

    # --- tables ---

    def _table(self, table: Table) -> Iterator[Debt]:
        stopping = self.stopping(table)
        seen: set[int] = set()
        for line in table.lines:
            for at, test in enumerate(line.tests):
                if test is not None and id(test) not in seen:
                    seen.add(id(test))
                    yield self._defined(
                        test.condition, f"a condition of table `{table.name}`", stopping, line.cell_span(at)
                    )
        for line in (*table.lines, *((table.default,) if table.default is not None else ())):
            yield self._line(table, line, stopping)
        for meeting in table.meetings:
            if meeting.same:
                yield self._same(table, meeting)

    def _same(self, table: Table, meeting: Meeting) -> Debt:
        """Run both lines from one state; owe that each variable that one of them writes is the same after both."""
        lines = {line.name: line for line in table.lines}
        pair = lines[meeting.first], lines[meeting.second]
        where = f"lines `{meeting.first}` and `{meeting.second}` of table `{table.name}` do the same"
        bodies = [[action.statement for action in line.actions] for line in pair]
        if bodies[0] == bodies[1]:
            run = Run(self.start, where, meeting.span)
            run.owe("their actions are the same", self.terms.true)
            return Debt((), tuple(run.owed))
        if any(self._calls_extern(body) for body in bodies):
            return Debt((), (), where, meeting.span, "they call extern procedures")
        first, second = Run(self.start, where), Run(self.start, where, meeting.span)
        try:
            for run, body in zip((first, second), bodies, strict=True):
                run.execute(body)
        except (TooLongError, RecursionError):
            return Debt((), (), where, meeting.span)
        debts = tuple(self._alike(run, other) for run, other in ((first, second), (second, first)))
        end = Run(self.start, where, meeting.span)
        for debt in debts:
            end.owe("one comes to its end where the other does", debt)
        for name in sorted({*first.state.leaves, *second.state.leaves}):
            after = (run.state.leaves.get(name, self.start.leaves[name]) for run in (first, second))
            end.owe(f"`{name}` is the same", self.terms.make("=", *after))
        return Debt((*self._assumed(table), self.start.condition(meeting.where)), tuple(end.owed))

    def _alike(self, run: Run, other: Run) -> Term:
        """Return the term that a run meets its obligations wherever the other one does."""
        paid = [self.terms.follows(owed.path, owed.good) for owed in run.owed]
        given = [self.terms.follows(owed.path, owed.good) for owed in other.owed]
        return self.terms.follows(self.terms.every(given), self.terms.every(paid))

    def _calls_extern(self, body: Iterable[Statement]) -> bool:
        """Return whether statements call an extern procedure, directly or not."""
        called = [statement for statement in everything(tuple(body)) if isinstance(statement, Call)]
        procedures = [self.start.procedures[str(call.procedure)] for call in called]
        return any(each.extern is not None or self._calls_extern(each.body) for each in procedures)

    def _assumed(self, table: Table) -> tuple[Term, ...]:
        """Return the conditions that a table relies on: invariants and its assumptions."""
        known = (each.condition for each in self.program.assumptions if each.name in table.assumptions)
        return (*self.holding, *map(self.start.condition, known))

    def _line(self, table: Table, line: Line | Default, stopping: tuple[Term, ...]) -> Debt:
        where = f"line `{line.name}` of table `{table.name}`"
        run = self._running(where, line.span)
        try:
            self._actions(run, line.actions)
        except (TooLongError, RecursionError):
            return Debt((), (), where, line.span)
        run.cell = line.span
        run.keeps(self.invariants)
        if not run.owed:
            return Debt((), ())
        if isinstance(line, Line):
            return Debt((*stopping, *self._tests(line)), tuple(run.owed))
        others = (self.terms.every(self._tests(other)) for other in table.lines)
        return Debt((*stopping, *map(self.terms.negation, others)), tuple(run.owed))

    def _tests(self, line: Line) -> list[Term]:
        """Return the conditions of the line as terms."""
        return [self.start.condition(test.condition) for test in line.tests if test is not None]

    def _actions(self, run: _Running, actions: Iterable[Action]) -> None:
        """Run the actions left to right; owe that two of them write one value to a variable."""
        wrote: dict[str, Term] = {}
        for action in actions:
            before, run.state.wrote = dict(run.state.leaves), {}
            run.state.local, run.state.assigned = {}, {}
            run.cell = action.statement.span
            run.execute((action.statement,))
            for name, now in run.state.wrote.items():
                if name in wrote:
                    twice = self.terms.every((wrote[name], now))
                    same = self.terms.make("=", before[name], run.state.leaves[name])
                    run.owe(f"two actions write one value to `{name}`", self.terms.follows(twice, same))
                wrote[name] = self.terms.some((wrote.get(name, self.terms.false), now))


def _at(run: Run) -> Run:
    """Return a run in the same state, with no obligations of its own."""
    other = Run(run.start, "")
    other.state = run.state
    return other


def _calls_of(actions: Iterable[Action]) -> Iterator[Call]:
    for action in actions:
        if isinstance(action.statement, Call):
            yield action.statement
