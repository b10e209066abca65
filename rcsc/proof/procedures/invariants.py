"""Invariants and assumptions as a whole: true at first and after a restart, and satisfiable together; properties are proved elsewhere.

In: a program. Out: diagnostics. That every run keeps each invariant is shown with the run (`obligations`).
"""

from collections.abc import Iterator, Mapping

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.lang.expressions.folding import fold
from rcsc.lang.interpret import initial
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    Assumption,
    Invariant,
    Kind,
    Program,
    Property,
    Snapshot,
    Table,
    Value,
    key_bounds,
    spell,
    value_of_key,
)
from rcsc.lang.restart import Fixed
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer


def at_first(program: Program) -> Iterator[Diagnostic]:
    """Yield a finding for each invariant, or assumption about states and outputs alone, that the initial values break."""
    start = initial(program)
    for invariant in program.invariants:
        if fold(invariant.condition, start) is False:
            message = f"the initial values do not satisfy invariant `{invariant.name}`"
            yield Diagnostic(Code.INVARIANT_INITIAL, message, Label(invariant.span))
        elif program.levels and fold(invariant.condition, begun_anew := _begun_anew(program)) is False:
            yield _broken_by_a_restart(program, invariant, begun_anew)
    inputs = {variable.name for variable in program.variables if variable.kind is Kind.INPUT}
    for assumption in program.assumptions:
        if inputs.isdisjoint(read_by(assumption.condition)) and fold(assumption.condition, start) is False:
            message = f"assumption `{assumption.name}` does not hold of the initial values"
            helps = ("give a variable another initial value, or weaken the assumption",)
            label = Label(assumption.span)
            yield Diagnostic(Code.ASSUMPTION_INITIAL, message, label, help=helps, severity=Severity.WARNING)


def _begun_anew(program: Program) -> dict[str, Value]:
    """Return the values after a restart that are constants; those adopted from a buffer are left out."""
    start: dict[str, Value] = dict(initial(program))
    for leaf, adopted in program.adopted.items():
        if isinstance(adopted, Fixed):
            start[leaf] = adopted.value
        else:
            start.pop(leaf, None)
    return start


def _broken_by_a_restart(
    program: Program, invariant: Invariant, begun_anew: Mapping[str, Value]
) -> Diagnostic:
    reads = frozenset(read_by(invariant.condition))
    read = [variable for variable in program.variables if variable.name in reads]
    values = ", ".join(f"{v.name} = {spell(v.type, begun_anew[v.name])}" for v in read)
    return Diagnostic(
        Code.INVARIANT_INITIAL,
        f"the values after a restart do not satisfy invariant `{invariant.name}`",
        Label(invariant.span),
        tuple(
            Label(v.span, "begins anew otherwise than at first") for v in read if v.name in program.adopted
        ),
        notes=(f"after a restart {values}",),
        help=("give a variable another value for `restart`, or weaken the invariant",),
    )


def properties_elsewhere(program: Program) -> Iterator[Diagnostic]:
    """Yield a note for each file that declares properties: a program alone proves none.

    Those that come with the protocol are left out: nobody wrote them, and every check would repeat it. A property that is not kept is
    reported with its level once that was looked at (`driver.together`).
    """
    files: dict[str, list[Property]] = {}
    for claim in (each for each in program.properties if not each.standard):
        files.setdefault(claim.span.file, []).append(claim)
    for declared in files.values():
        names = ", ".join(f"`{claim.name}`" for claim in declared)
        what, is_ = ("property", "is") if len(declared) == 1 else ("properties", "are")
        message = f"{what} {names} {is_} not proved here"
        helps = ("`rcsc prove` proves what a level does in its environment, cycle after cycle",)
        label = Label(declared[0].span)
        yield Diagnostic(Code.PROPERTY_ELSEWHERE, message, label, help=helps, severity=Severity.NOTE)


def assumptions_satisfiable(program: Program, table: Table, options: Options) -> Snapshot | Answer:
    """Return values that satisfy all assumptions of the table and all invariants, or Z3's answer where it finds none.

    A few inputs are tried before Z3 is asked.
    """
    conditions = [assumption.condition for assumption in assumed_of(program, table)]
    for trial in _trials(program):
        if all(fold(condition, trial) for condition in conditions):
            return trial
    from rcsc.proof.solvers.smt import Solver
    from rcsc.proof.symbolic.encode import declared, encode

    frame, domain = declared(program.variables)
    solver = Solver(options.limits)
    solver.add(*domain, *(encode(condition, frame) for condition in conditions))
    answer = solver.check()
    if answer is not Answer.SATISFIABLE:
        return answer
    return {
        variable.name: solver.value(frame.leaves[variable.name], variable.type)
        for variable in program.variables
    }


def assumed_of(program: Program, table: Table) -> tuple[Assumption | Invariant, ...]:
    """Return the assumptions of the table and every invariant of the program."""
    named = (assumption for assumption in program.assumptions if assumption.name in table.assumptions)
    return (*named, *program.invariants)


def _trials(program: Program) -> Iterator[dict[str, Value]]:
    """Yield a few inputs that are quickly tried: the initial values, and both ends of every range."""
    yield initial(program)
    for end in (0, 1):
        yield {
            variable.name: value_of_key(variable.type, key_bounds(variable.type)[end])
            for variable in program.variables
        }
