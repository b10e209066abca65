"""Invariants: true at first, and kept by everything that a cycle runs; assumptions that claim to be proved.

In: a program. Out: diagnostics, and the conditions that may be relied on.
"""

from collections.abc import Callable, Iterator

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, Severity, WitnessColumn
from rcsc.interpret import holds, initial
from rcsc.model import Expr, Invariant, Kind, Procedure, Program, Snapshot, Standing, pending, spell
from rcsc.prove import smt
from rcsc.prove.encode import Frame, declared, encode, least_witness
from rcsc.prove.options import Options
from rcsc.prove.smt import Answer, Solver, Term
from rcsc.prove.symbolic import Run

Step = Callable[[Run, Frame], None]


def prove_invariants(program: Program, options: Options) -> list[Diagnostic]:
    """What breaks an invariant; all of them hold together when there is nothing."""
    found: list[Diagnostic] = []
    start = initial(program)
    for invariant in program.invariants:
        if not _holds_at_first(invariant.condition, start):
            message = f"the initial values do not satisfy invariant `{invariant.name}`"
            found.append(Diagnostic(Code.INVARIANT_INITIAL, message, Label(invariant.span)))
    if not found and program.invariants:
        for where, known, step in _steps(program):
            found.extend(_kept(program, options, where, known, step))
    return found


def _steps(program: Program) -> Iterator[tuple[str, Callable[[Frame], list[Term]], Step]]:
    """Everything that changes state, with what is known before it."""
    nothing: Callable[[Frame], list[Term]] = lambda frame: []  # noqa: E731 - a name for its type
    if any(v.deferred_until is not None for v in program.variables):
        yield "the deferred next values", nothing, lambda run, frame: _settle(program, frame)
    by_name: dict[str, Procedure] = {p.name: p for p in program.procedures}
    for level in program.levels:
        for name in dict.fromkeys((*level.preprocess, *level.postprocess)):
            yield f"`{name}`", nothing, lambda run, frame, name=name: run.call(by_name[name], (), frame, ())  # type: ignore[misc]  # bound early
    for table in program.tables:
        assumed = [a.condition for a in program.assumptions if a.name in table.assumptions]
        lines = [[t.condition for t in line.tests if t is not None] for line in table.lines]

        def matched(frame: Frame, at: int, assumed: list[object] = list(assumed), lines: list[list[object]] = list(lines)) -> list[Term]:  # noqa: B006 - bound early
            terms = [encode(c, frame) for c in assumed]  # type: ignore[arg-type]  # expressions
            each = [smt.all_of([encode(c, frame) for c in line]) for line in lines]  # type: ignore[arg-type]  # expressions
            return [*terms, each[at] if at < len(each) else smt.negation(smt.any_of(each))]

        everything = [(line.name, line.actions) for line in table.lines]
        if table.default is not None:
            everything.append((table.default.name, table.default.actions))
        for at, (name, actions) in enumerate(everything):
            if actions:
                body = [action.statement for action in actions]
                yield (
                    f"line `{name}` of table `{table.name}`",
                    lambda frame, at=at, matched=matched: matched(frame, at),  # type: ignore[misc]  # bound early
                    lambda run, frame, body=body: run.execute(body, frame, ()),  # type: ignore[misc]  # bound early
                )


def _settle(program: Program, frame: Frame) -> None:
    deferred = [v for v in program.variables if v.deferred_until is not None]
    ready = {v.name: encode(v.deferred_until, frame) for v in deferred if v.deferred_until is not None}
    for variable in deferred:
        now, later = frame.leaves[variable.name], frame.leaves[pending(variable.name)]
        frame.leaves[variable.name] = smt.choice(ready[variable.name], later, now)


def _kept(
    program: Program, options: Options, where: str, known: Callable[[Frame], list[Term]], step: Step
) -> Iterator[Diagnostic]:
    frame, domain = declared(program.variables)
    solver = Solver(options.timeout_ms, options.memory_mb)
    solver.add(*domain, *(encode(i.condition, frame) for i in program.invariants), *known(frame))
    after = frame.copy()
    step(Run(program), after)
    for invariant in program.invariants:
        broken = smt.negation(encode(invariant.condition, after))
        answer = solver.check(broken)
        if answer is Answer.UNSATISFIABLE:
            continue
        message = f"{where} may break invariant `{invariant.name}`"
        if answer is Answer.UNKNOWN:
            message = f"whether {where} keeps invariant `{invariant.name}` could not be decided"
            yield Diagnostic(Code.UNDECIDED, message, Label(invariant.span))
            continue
        yield _broken(program, solver, frame, invariant, broken, message)


def _broken(
    program: Program, solver: Solver, frame: Frame, invariant: Invariant, broken: Term, message: str
) -> Diagnostic:
    names = smt.constants(broken) | smt.constants(encode(invariant.condition, frame))
    variables = [v for v in program.variables if v.name in names]
    solver.push()
    solver.add(broken)
    witness = least_witness(solver, variables, frame)
    solver.pop()
    columns: tuple[WitnessColumn, ...] = ()
    if witness is not None:
        values = tuple(spell(v.type, witness[v.name]) for v in variables)
        columns = (WitnessColumn("", tuple(v.name for v in variables), values),)
    return Diagnostic(Code.INVARIANT_BROKEN, message, Label(invariant.span), witnesses=columns)


def prove_assumptions(program: Program, options: Options) -> list[Diagnostic]:
    """Assumptions declared `proved` that do not follow from declared ranges and invariants."""
    found = []
    for assumption in program.assumptions:
        if assumption.standing is not Standing.PROVED:
            continue
        frame, domain = declared(program.variables)
        solver = Solver(options.timeout_ms, options.memory_mb)
        solver.add(*domain, *(encode(i.condition, frame) for i in program.invariants))
        if solver.check(smt.negation(encode(assumption.condition, frame))) is not Answer.UNSATISFIABLE:
            message = f"assumption `{assumption.name}` does not follow from declared ranges and invariants"
            helps = ("declare it `assumed` or `monitored`",)
            found.append(Diagnostic(Code.ASSUMPTION_NOT_PROVED, message, Label(assumption.span), help=helps))
    return found


def assumptions_at_first(program: Program) -> list[Diagnostic]:
    """Warnings: assumptions about states and outputs alone that the initial values already break."""
    from rcsc.resolve.leaves import read_by

    inputs = {variable.name for variable in program.variables if variable.kind is Kind.INPUT}
    start = initial(program)
    found = []
    for assumption in program.assumptions:
        if inputs & set(read_by(assumption.condition)) or _holds_at_first(assumption.condition, start):
            continue
        message = f"assumption `{assumption.name}` does not hold of the initial values"
        helps = ("give a variable another initial value, or weaken the assumption",)
        found.append(
            Diagnostic(
                Code.ASSUMPTION_INITIAL, message, Label(assumption.span), help=helps, severity=Severity.WARNING
            )
        )
    return found


def _holds_at_first(condition: Expr, start: Snapshot) -> bool:
    try:
        return holds(condition, start)
    except (ArithmeticError, IndexError):
        return False
