"""Nothing can overflow, divide by zero, leave an array or a declared range, or be written twice by one line.

In: a program. Out: diagnostics with least witnesses, and the assumptions that stop a cycle. Each line's actions are
shown right where they run: under the invariants and the line's conditions; procedures of levels under the
invariants; what nothing calls under the declared ranges alone. Conditions are shown to be defined for every
input: the executors can evaluate each (an assumption too) whatever the others say. Every run also owes
the invariants.

An assumption may fail at run time. So a table's conditions and lines are first shown without assumptions. What is left is
shown under the fewest of them, which are the table's *stopping* assumptions: the executors end the cycle where one of them
fails, before anything is matched. All else that a cycle owes then rests on ranges, guards and invariants alone. Invariants
count as safety: one that a failed assumption breaks would take the ground from under the next cycle.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions.intervals import may_be_undefined
from rcsc.lang.interpret import fold
from rcsc.lang.leaves import called_by, closure, read_by
from rcsc.lang.model import (
    NOWHERE,
    Action,
    Assign,
    Assumption,
    AssumptionName,
    Call,
    Default,
    Expr,
    Invariant,
    Line,
    Literal,
    Procedure,
    Program,
    Scalar,
    Standing,
    Statement,
    Table,
    ToLeaf,
    pending,
)
from rcsc.proof.procedures.discharge import MOST_WITNESSES, Asker, Cause, Failure, Tally, diagnostic, fewest
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Budget
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.evaluation import Evaluation, Obligation, State, TooLongError
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.values import FALSE, TRUE, Node


def called_by_lines(program: Program) -> set[str]:
    """Procedures that some line of some table calls itself."""
    lines = [line for table in program.tables for line in table.every_line]
    return set(called_by(action.statement for line in lines for action in line.actions))


def defined_alone(program: Program, table: Table) -> bool:
    """Return whether the declared ranges alone show every condition of the table to be defined, without a solver."""
    run = Run.of(program, {})
    for test in table.distinct_tests:
        if may_be_undefined(test.condition):
            run.evaluate(test.condition)
    return not run.obligations


Known: TypeAlias = Callable[[], list[Node]]
"""Premises under which obligations are put to the solver."""


@dataclass(frozen=True, slots=True)
class _Owing:
    """A condition or a line of a table.

    Attributes:
        run: Runs it under some assumptions; returns its obligations and the facts known there.
        stating: For a condition, the lines that state it, and in which column; the table is then not decided without it.
    """

    run: Callable[[list[Node]], tuple[Run, Known]]
    where: str
    span: Span
    stating: tuple[tuple[Line, int], ...] = ()


@dataclass(slots=True)
class Obligations:
    """Proves the obligations of one program.

    Attributes:
        tally: How it was settled.
        undefined: Tables with a condition, or an assumption, that is not defined for every input.
        unsafe: Tables with a line or a condition that has an obligation not shown.
        stops: By table, the assumptions on which the safety of its conditions and lines rests.
    """

    program: Program
    options: Options
    tally: Tally = field(default_factory=Tally)
    undefined: set[str] = field(default_factory=set)
    unsafe: set[str] = field(default_factory=set)
    stops: dict[str, tuple[AssumptionName, ...]] = field(default_factory=dict)
    _causes: dict[tuple[Code, Span, str], Cause] = field(default_factory=dict)
    _start: dict[str, Node] = field(default_factory=dict)
    # whether a procedure owes nothing; one that is not looked at may owe
    _clean: dict[str, bool] = field(default_factory=dict)
    _too_long: list[Diagnostic] = field(default_factory=list)
    _asker: Asker = field(init=False)
    _procedures: dict[str, Procedure] = field(init=False)
    _kinds: dict[str, Scalar] = field(init=False)
    _kept: list[tuple[Invariant, set[str]]] = field(init=False)

    def __post_init__(self) -> None:
        leaves = self.program.variables
        self._asker = Asker(self.options, {v.name: at for at, v in enumerate(leaves)}, self.tally)
        self._procedures = {procedure.name: procedure for procedure in self.program.procedures}
        self._kinds = {v.name: v.type for v in leaves}
        self._kept = [(invariant, set(read_by(invariant.condition))) for invariant in self.program.invariants]

    def prove(self, tables: Iterable[Table]) -> list[Diagnostic]:
        """Prove and report the obligations of conditions, deferred values, procedures, levels, and lines of `tables`."""
        with self._budget():
            self._conditions()
            self._deferred()
            self._safe_values()
        self._levels()
        self._uncalled()
        for table in tables:
            with self._budget():
                self._table(table)
        return [*self._too_long, *(diagnostic(*key, cause) for key, cause in self._causes.items())]

    def stopping(self, tables: Iterable[Table]) -> dict[str, tuple[AssumptionName, ...]]:
        """Return the stopping assumptions of the tables; report nothing."""
        for table in tables:
            with self._budget():
                self._table(table)
        return self.stops

    def _budget(self) -> AbstractContextManager[Budget]:
        """Return a budget for all questions about a table, a list of procedures, or the conditions outside tables."""
        return smt.together(self.options.together)

    # --- what is known ---

    def _run(self) -> Run:
        return Run(self._procedures, self._kinds, self._start)

    def _known(self, conditions: Iterable[Expr]) -> list[Node]:
        """Evaluate the conditions before a run; their own obligations are discharged elsewhere."""
        run = self._run()
        return [run.evaluate(condition) for condition in conditions]

    def _invariants(self) -> list[Node]:
        return self._known(invariant.condition for invariant in self.program.invariants)

    # --- conditions ---

    def _conditions(self) -> None:
        """Discharge assumptions, invariants, `deferred until` and selectors."""
        deferred = [v.deferred_until for v in self.program.variables if v.deferred_until is not None]
        selectors = [selector for level in self.program.levels for selector in level.selectors]
        for invariant in self.program.invariants:
            self._defined(invariant.condition, [])
        for condition in (*deferred, *selectors):
            self._defined(condition, self._invariants())
        for assumption in self.program.assumptions:
            if not self._defined(assumption.condition, self._invariants()):
                users = (table.name for table in self.program.tables if assumption.name in table.assumptions)
                self.undefined.update(users)
            if assumption.standing is Standing.PROVED:
                self._follows(assumption.name, assumption.condition, assumption.span)

    def _defined(self, condition: Expr, base: list[Node]) -> bool:
        """Prove that evaluating the condition cannot go wrong; return whether that is shown."""
        return self._settle(self._evaluated(condition, base), lambda: base, "", "")

    def _evaluated(self, condition: Expr, base: list[Node], cell: Span = NOWHERE) -> Run:
        run = self._run()
        run.cell = cell
        for node in base:
            run.assume(node)
        run.evaluate(condition)
        return run

    def _follows(self, name: str, condition: Expr, span: Span) -> None:
        """Prove that an assumption declared `proved` follows from the ranges and the invariants."""
        run = self._run()
        [good] = self._known([condition])
        message = f"assumption `{name}` does not follow from the declared ranges and the invariants"
        run.owe(Code.ASSUMPTION_NOT_PROVED, message, span, good)
        self._settle(run, self._invariants, "", "")

    def _tests(self, table: Table) -> Iterator[_Owing]:
        """Run every condition of the table, which is evaluated in every cycle, whatever the others give."""
        owing = {id(test): test for test in table.distinct_tests if may_be_undefined(test.condition)}
        stating: dict[int, list[tuple[Line, int]]] = {}
        for line in table.lines if owing else ():
            for at, test in enumerate(line.tests):
                if id(test) in owing:
                    stating.setdefault(id(test), []).append((line, at))
        where = f"in a condition of table `{table.name}`"
        for key, places in stating.items():
            line, at = places[0]
            span = line.cell_span(at)
            yield _Owing(partial(self._test, owing[key].condition, span), where, span, tuple(places))

    def _test(self, condition: Expr, span: Span, assumed: list[Node]) -> tuple[Run, Known]:
        base = [*assumed, *self._invariants()]
        return self._evaluated(condition, base, span), lambda: base

    # --- tables ---

    def _table(self, table: Table) -> None:
        """Discharge a table's conditions and lines; find the stopping assumptions."""
        assumptions = self.program.assumed(table)
        needing = []
        for owing in (*self._tests(table), *self._lines(table)):
            try:
                run, known = owing.run([])
                if assumptions and not self._asker.all_hold(run.obligations, known):
                    needing.append(owing)
                    run, known = owing.run(self._known(assumption.condition for assumption in assumptions))
                if not self._settle(run, known, owing.where, table.name, owing.stating):
                    self.unsafe.add(table.name)
                    self.undefined.update([table.name] if owing.stating else [])
            except (TooLongError, RecursionError):
                self.unsafe.add(table.name)
                self._give_up(owing.where, owing.span)
        if needing:
            chosen = fewest(assumptions, partial(self._suffice, needing))
            self.stops[table.name] = tuple(assumption.name for assumption in chosen)

    def _suffice(self, needing: Iterable[_Owing], chosen: Sequence[Assumption]) -> bool:
        """Return whether these assumptions show everything that all of them together show."""
        for owing in needing:
            run, known = owing.run(self._known(assumption.condition for assumption in chosen))
            left = [
                obligation
                for obligation in run.obligations
                if (obligation.code, obligation.span, obligation.message) not in self._causes
            ]
            if not self._asker.all_hold(left, known):
                return False
        return True

    # --- runs outside lines ---

    def _deferred(self) -> None:
        """Discharge the taking of deferred values: all whose condition holds are taken at once."""
        deferred = [v for v in self.program.variables if v.deferred_until is not None]
        if not deferred or not self._kept:
            return
        run = self._run()
        ready = self._known(v.deferred_until for v in deferred if v.deferred_until is not None)
        later = [run.leaf(pending(v.name)) for v in deferred]
        for variable, when, value in zip(deferred, ready, later, strict=True):
            run.write(variable.name, value, when)
        self._keep(run, "taking the deferred values", deferred[0].span)
        self._settle(run, self._invariants, "", "")

    def _safe_values(self) -> None:
        """Discharge the showing of safe values after a fault: invariants held where the cycle ended, and must go on to hold."""
        shown = [v for v in self.program.variables if v.safe is not None]
        if not shown or not self._kept:
            return
        run = self._run()
        for variable in shown:
            assert variable.safe is not None
            run.write(variable.name, values.constant(variable.type, variable.safe), TRUE)
        self._keep(run, "showing the safe values after a fault", shown[0].span)
        self._settle(run, self._invariants, "", "")

    def _levels(self) -> None:
        """Discharge the procedures that a level runs before its table and after it, each list in one run."""
        for level in self.program.levels:
            for words, names in (("preprocess", level.preprocess), ("postprocess", level.postprocess)):
                calls = [Call(self._procedures[name].name) for name in names]
                where = f"in `{words}` of level `{level.name}`"
                with self._budget():
                    self._sequence(calls, where, level.span)

    def _sequence(self, calls: Sequence[Call], where: str, span: Span) -> None:
        base = self._invariants()
        run = self._running(base, f"what runs {where}", span)
        try:
            run.execute(calls)
        except (TooLongError, RecursionError):
            self._give_up(where, span)
            return
        self._keep(run, f"what runs {where}", span)
        self._settle(run, lambda: base, where, "")

    def _running(self, base: Iterable[Node], who: str, span: Span) -> Run:
        run = self._run()
        for node in base:
            run.assume(node)
        if self._kept:
            run.stops = lambda at, extern: self._keep(at, f"{who}, where `{extern}` fails,", span)
        return run

    def _uncalled(self) -> None:
        """Discharge the procedures that no line and no level runs, for all values of their parameters."""
        levels = self.program.levels
        outside = {str(name) for level in levels for name in (*level.preprocess, *level.postprocess)}
        inside = closure(called_by_lines(self.program) | outside, self._procedures)
        for procedure in self.program.procedures:
            run = self._alone(procedure)
            self._clean[procedure.name] = run is not None and not run.obligations
            if procedure.name not in inside:
                if run is None:
                    self._give_up(f"in procedure `{procedure.name}`", procedure.span)
                else:
                    with self._budget():
                        self._settle(run, list, "", "")

    def _alone(self, procedure: Procedure) -> Run | None:
        """Run the procedure for all values of its parameters; None where it runs too long to follow."""
        run = self._run()
        try:
            run.call(
                procedure,
                [(param.span, values.variable(param.name, param.type)) for param in procedure.params],
            )
        except (TooLongError, RecursionError):
            return None
        return run

    # --- lines ---

    def _plain(self, actions: tuple[Action, ...]) -> bool:
        """Return whether the line's actions are seen, without a run, to owe nothing."""
        written: set[str] = set()
        for action in actions:
            names = self._plainly_written(action.statement)
            if names is None or names & written:
                return False
            written |= names
        return not any(written & reads for _, reads in self._kept)

    def _plainly_written(self, statement: Statement) -> set[str] | None:
        """Return the variables that the statement writes; None where it may owe something."""
        match statement:
            case Assign(place=ToLeaf(name=name, type=kind), value=Literal(value=value)):
                low, high = values.bounds(kind)
                return {name} if low <= value <= high else None
            case Call(procedure=name, args=args) if self._clean.get(name):
                procedure = self._procedures[name]
                for param, arg in zip(procedure.params, args, strict=True):
                    low, high = values.bounds(param.type)
                    if not isinstance(arg, Literal) or not low <= arg.value <= high:
                        return None
                return set(map(str, procedure.writes))
            case _:
                return None

    def _lines(self, table: Table) -> Iterator[_Owing]:
        for line in table.every_line:
            if not self._plain(line.actions):
                where = f"in line `{line.name}` of table `{table.name}`"
                yield _Owing(partial(self._line, table, line), where, _name_of(line))

    def _line(self, table: Table, line: Line | Default, assumed: list[Node]) -> tuple[Run, Known]:
        base = [*assumed, *self._invariants()]
        if isinstance(line, Line):
            base += self._known(line.conditions)
        name = _name_of(line)
        run = self._running(base, f"line `{line.name}` of table `{table.name}`", name)
        self._actions(run, line.actions)
        self._keep(run, f"line `{line.name}` of table `{table.name}`", name)
        return run, lambda: [*base, self._none(table)] if isinstance(line, Default) else base

    def _none(self, table: Table) -> Node:
        """Return the condition that no line matches."""
        return values.all_of(
            values.negation(values.all_of(self._known(line.conditions))) for line in table.lines
        )

    def _actions(self, run: Run, actions: tuple[Action, ...]) -> None:
        """Run the actions left to right; a variable written by two of them must get one value."""
        written: dict[str, tuple[Node, str]] = {}
        for action in actions:
            before = run.state
            run.state = State(dict(before.leaves))
            run.cell = action.statement.span
            run.execute((action.statement,))
            for name, now in run.state.wrote.items():
                if name in written:
                    self._one_writer(
                        run, name, values.both(written[name][0], now), before, (written[name][1], action)
                    )
                written[name] = (
                    values.either(written[name][0] if name in written else FALSE, now),
                    action.text,
                )

    def _one_writer(self, run: Run, name: str, twice: Node, before: State, who: tuple[str, Action]) -> None:
        same = values.equal(before.leaves[name], run.state.leaves[name])
        message = f"`{who[0]}` and `{who[1].text}` can write different values to `{name}`"
        run.owe(Code.TWO_WRITERS, message, who[1].statement.span, values.follows(twice, same))

    # --- settling ---

    def _keep(self, run: Evaluation, who: str, span: Span) -> None:
        """Owe every invariant that the run may have touched."""
        for invariant, reads in self._kept:
            if not reads.isdisjoint(run.state.leaves):
                after = self._run()
                after.state = State(run.state.leaves)
                good = after.evaluate(invariant.condition)
                run.owe(Code.INVARIANT_BROKEN, f"{who} can break invariant `{invariant.name}`", span, good)

    def _settle(
        self,
        run: Run,
        base: Callable[[], list[Node]],
        where: str,
        table: str,
        stating: Sequence[tuple[Line, int]] = (),
    ) -> bool:
        """Ask about the obligations that bounds did not settle; return whether all are shown."""
        self.tally.by_intervals += run.settled
        failures = self._asker.unshown(run.obligations, base, self._shown)
        for failure in failures:
            owed = failure.obligation
            cause = self._causes.setdefault((owed.code, owed.span, owed.message), Cause())
            cause.failures.append(failure)
            cause.where.append((where, table))
            if len(stating) > 1 and cause.there is None:
                cause.there = _told_at(owed.span, failure, stating)
        return not failures

    def _shown(self, owed: Obligation) -> bool:
        """Return whether to look for a witness: its cause has too few."""
        cause = self._causes.get((owed.code, owed.span, owed.message))
        return cause is None or len(cause.failures) < MOST_WITNESSES

    def _give_up(self, where: str, span: Span) -> None:
        message = f"what runs {where} has more steps than can be followed"
        self._too_long.append(
            Diagnostic(Code.UNDECIDED, message, Label(span), help=("make its loops shorter",))
        )


def _told_at(span: Span, failure: Failure, stating: Sequence[tuple[Line, int]]) -> Span:
    """Return the span of a shared condition in the first line that states it and that the witness does not keep from matching."""
    witness = {str(variable.name): value for variable, value in failure.witness}

    def can_match(line: Line, column: int) -> bool:
        others = (test for at, test in enumerate(line.tests) if test is not None and at != column)
        return all(fold(test.condition, witness) is not False for test in others)

    first, line = stating[0], next((each for each in stating if can_match(*each)), stating[0])
    cell, there = (each.cell_span(column) for each, column in (first, line))
    if not (span.file == cell.file and cell.start <= span.start <= span.end <= cell.end):
        return span  # of the heading
    if cell.end - cell.start != there.end - there.start:
        return there  # written in other words
    return Span(span.file, there.start + span.start - cell.start, there.start + span.end - cell.start)


def _name_of(line: Line | Default) -> Span:
    return line.cell_span(-1) if isinstance(line, Line) else line.span
