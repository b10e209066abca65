"""Nothing in a program can overflow, divide by zero, leave an array or a declared range, or write an output twice.

In: a program. Out: diagnostics with least witnesses. Each line's actions are shown right where they run: under the table's
assumptions, the proved invariants and the line's conditions; what no line calls under the declared ranges alone.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, WitnessColumn
from rcsc.model import (
    Action,
    Bool,
    Call,
    Expr,
    Kind,
    Procedure,
    Program,
    Table,
    Variable,
    VariableName,
    spell,
)
from rcsc.prove import smt
from rcsc.prove.encode import Frame, declared, encode, least_witness, within
from rcsc.prove.options import Options
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.prove.symbolic import Obligation, Run, ghost


def called_by_lines(program: Program) -> set[str]:
    """Procedures that some line of some table calls itself."""
    lines = [line for table in program.tables for line in (*table.lines, table.default) if line is not None]
    actions = [action.statement for line in lines for action in line.actions]
    return {str(statement.procedure) for statement in actions if isinstance(statement, Call)}


@dataclass(slots=True)
class Tally:
    """How obligations were settled, for the report and the tests."""

    by_intervals: int = 0
    by_solver: int = 0
    queries: int = 0


@dataclass(frozen=True, slots=True)
class Context:
    """Where statements run: what is known before them, and how to speak of it.

    Attributes:
        known: Terms over the frame.
        where: `in line 5 of table acquire`, for notes; "" for a procedure by itself.
        extra: Variables beside the program's leaves: parameters.
    """

    frame: Frame
    known: tuple[Term, ...]
    where: str
    table: str = ""
    extra: tuple[Variable, ...] = ()


@dataclass(slots=True)
class Obligations:
    """Proves what one program owes.

    Attributes:
        invariants: Conditions already proved to hold at every cycle.
    """

    program: Program
    options: Options
    invariants: Sequence[Expr] = ()
    tally: Tally = field(default_factory=Tally)
    found: list[Diagnostic] = field(default_factory=list)

    def prove(self, tables: Iterable[Table]) -> list[Diagnostic]:
        """What is wrong with the tables' lines, the conditions, and the procedures that run outside lines."""
        self._conditions()
        for table in tables:
            for context, actions in self._lines(table):
                self._actions(context, actions)
            self._tests(table)
        inside = self._closure(called_by_lines(self.program))
        levels = self.program.levels
        outside = {name for level in levels for name in (*level.preprocess, *level.postprocess)}
        for procedure in self.program.procedures:
            if procedure.name not in inside or procedure.name in outside:
                self._alone(procedure)
        return list(dict.fromkeys(self.found))

    def _closure(self, called: set[str]) -> set[str]:
        """Procedures that run in some line: shown right there."""
        from rcsc.resolve.leaves import everything

        by_name = {procedure.name: procedure for procedure in self.program.procedures}
        waiting, seen = list(called), set(called)
        while waiting:
            for statement in everything(by_name[waiting.pop()].body):  # type: ignore[index]
                if isinstance(statement, Call) and statement.procedure not in seen:
                    seen.add(statement.procedure)
                    waiting.append(statement.procedure)
        return seen

    # --- contexts ---

    def _start(self) -> tuple[Frame, tuple[Term, ...]]:
        frame, domain = declared(self.program.variables)
        return frame, (*domain, *(encode(invariant, frame) for invariant in self.invariants))

    def _lines(self, table: Table) -> Iterator[tuple[Context, tuple[Action, ...]]]:
        """Each line that does anything, and DEFAULT."""
        frame, known = self._start()
        assumed = [a.condition for a in self.program.assumptions if a.name in table.assumptions]
        known = (*known, *(encode(condition, frame) for condition in assumed))
        tests: dict[int, Term] = {}

        def matches(at: int) -> Term:
            terms = []
            for test in table.lines[at].tests:
                if test is not None:
                    if id(test) not in tests:
                        tests[id(test)] = encode(test.condition, frame)
                    terms.append(tests[id(test)])
            return smt.all_of(terms)

        for at, line in enumerate(table.lines):
            if line.actions:
                where = f"in line `{line.name}` of table `{table.name}`"
                yield Context(frame, (*known, matches(at)), where, table.name), line.actions
        if table.default is not None and table.default.actions:
            none = smt.negation(smt.any_of([matches(at) for at in range(len(table.lines))]))
            where = f"in line `{table.default.name}` of table `{table.name}`"
            yield Context(frame, (*known, none), where, table.name), table.default.actions

    # --- what is owed ---

    def _actions(self, context: Context, actions: tuple[Action, ...]) -> None:
        run = Run(self.program)
        frame = context.frame.copy()
        outputs = run.outputs()
        wrote: dict[str, list[tuple[int, Term, Term]]] = {}
        for number, action in enumerate(actions):
            for name in outputs:
                frame.leaves[ghost(name)] = smt.truth(False)
            run.execute((action.statement,), frame, ())
            for name in self._written(action, outputs):
                wrote.setdefault(name, []).append((number, frame.leaves[ghost(name)], frame.leaves[name]))
        run.obligations.extend(self._two_writers(wrote, actions))
        self._settle(context, run)

    def _written(self, action: Action, outputs: list[str]) -> list[str]:
        """Outputs that the action may write."""
        from rcsc.resolve.leaves import written_by

        if isinstance(action.statement, Call):
            procedure = next(p for p in self.program.procedures if p.name == action.statement.procedure)
            names: Sequence[str] = procedure.writes
        else:
            names = written_by(action.statement)
        return [name for name in outputs if name in names]

    def _two_writers(
        self, wrote: dict[str, list[tuple[int, Term, Term]]], actions: tuple[Action, ...]
    ) -> Iterator[Obligation]:
        kinds = {variable.name: variable.type for variable in self.program.variables}
        for name, times in wrote.items():
            for (one, did, value), (two, did_too, other) in zip(times, times[1:], strict=False):
                differ = smt.negation(smt.equal(value, other, kinds[VariableName(name)]))
                message = f"`{actions[one].text}` and `{actions[two].text}` may write different values to `{name}`"
                span = actions[two].statement.span
                yield Obligation(Code.TWO_WRITERS, message, span, smt.all_of([did, did_too, differ]))

    def _tests(self, table: Table) -> None:
        """Every condition of the table is evaluated in every cycle, whatever the others say."""
        relational = {id(t): (t, line.cell_span(at)) for line in table.lines for at, t in enumerate(line.tests) if t is not None}
        frame, known = self._start()
        assumed = [a.condition for a in self.program.assumptions if a.name in table.assumptions]
        known = (*known, *(encode(condition, frame) for condition in assumed))
        for test, span in relational.values():
            run = Run(self.program)
            run.owe(test.condition, frame, ())
            run.obligations = [replace(one, span=span) for one in run.obligations]
            self._settle(Context(frame, known, f"in table `{table.name}`", table.name), run)

    def _conditions(self) -> None:
        """Assumptions, invariants and `deferred until`."""
        frame, known = self._start()
        conditions = [a.condition for a in self.program.assumptions]
        conditions += [i.condition for i in self.program.invariants]
        conditions += [v.deferred_until for v in self.program.variables if v.deferred_until is not None]
        for condition in conditions:
            run = Run(self.program)
            run.owe(condition, frame, ())
            self._settle(Context(frame, known, ""), run)
        for level in self.program.levels:
            from rcsc.model import TableByCommand

            if isinstance(level.tables, TableByCommand):
                run = Run(self.program)
                run.owe(level.tables.selector, frame, ())
                self._settle(Context(frame, known, ""), run)

    def _alone(self, procedure: Procedure) -> None:
        """A procedure that no line calls, for all values of its parameters."""
        frame, known = self._start()
        run = Run(self.program)
        extra = tuple(
            Variable(VariableName(p.name), Kind.INPUT, p.type, False) for p in procedure.params
        )
        for variable in extra:
            frame.local[variable.name] = smt.variable(variable.name + "!", variable.type)
        ranges = [within(frame.local[v.name], v.type) for v in extra if not isinstance(v.type, Bool)]
        context = Context(Frame({**frame.leaves, **frame.local}), (*known, *ranges), "", "", extra)
        run.execute(procedure.body, frame, ())
        self._settle(context, run)

    # --- settling ---

    def _settle(self, context: Context, run: Run) -> None:
        """Asks whether anything owed can go wrong; one query where nothing can."""
        self.tally.by_intervals += run.discharged
        if not run.obligations:
            return
        self.tally.by_solver += len(run.obligations)
        solver = Solver(self.options.timeout_ms, self.options.memory_mb)
        solver.add(*context.known)
        wrong = [one.wrong for one in run.obligations]
        if len(wrong) > 1 and solver.check(smt.any_of(wrong)) is Answer.UNSATISFIABLE:
            self.tally.queries += solver.queries
            return
        for obligation in run.obligations:
            answer = solver.check(obligation.wrong)
            if answer is Answer.SATISFIABLE:
                self._report(solver, context, obligation)
            elif answer is Answer.UNKNOWN:
                message = f"could not be decided: {obligation.message}"
                self.found.append(Diagnostic(Code.UNDECIDED, message, Label(obligation.span), help=_PATIENCE))
        self.tally.queries += solver.queries

    def _report(self, solver: Solver, context: Context, obligation: Obligation) -> None:
        if any(d.code is obligation.code and d.primary.span == obligation.span for d in self.found):
            return
        solver.push()
        solver.add(obligation.wrong)
        variables = [*self._of_interest(obligation), *context.extra]
        witness = least_witness(solver, variables, context.frame)
        solver.pop()
        columns: tuple[WitnessColumn, ...] = ()
        if witness is not None:
            names = [v.name for v in variables]
            kinds = {v.name: v.type for v in variables}
            columns = (WitnessColumn(context.table, tuple(names), tuple(spell(kinds[n], witness[n]) for n in names)),)
        notes = (context.where,) if context.where else ()
        self.found.append(
            Diagnostic(
                obligation.code, obligation.message, Label(obligation.span), notes=notes, help=_HELP.get(obligation.code, ()),
                witnesses=columns,
            )  # fmt: skip
        )

    def _of_interest(self, obligation: Obligation) -> list[Variable]:
        """Leaves that the obligation speaks of."""
        names = smt.constants(obligation.wrong)
        return [variable for variable in self.program.variables if variable.name in names]


_PATIENCE = ("give each query more time with `--timeout`, or narrow the declared ranges",)
_HELP: dict[Code, tuple[str, ...]] = {
    Code.OVERFLOW: ("narrow the declared ranges, or guard the operation with `if`",),
    Code.DIVISION_BY_ZERO: ("guard the division with `if`, or exclude zero from the divisor's range",),
    Code.INDEX: ("guard the access with `if`, or narrow the index's range",),
    Code.ASSIGNED_RANGE: ("guard the assignment with `if`, use `min` or `max`, or widen the variable's range",),
    Code.USE_BEFORE_ASSIGNMENT: ("give the local a first value where it is declared",),
    Code.TWO_WRITERS: ("let one action of the line write the output",),
}

