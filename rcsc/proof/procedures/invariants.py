"""Invariants and assumptions as a whole: true at first and after a restart, and satisfiable together; properties are proved elsewhere.

In: a program. Out: diagnostics. That every run keeps each invariant is shown with the run (`obligations`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations, product

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, Severity
from rcsc.lang.interpret import fold, initial
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    Assumption,
    AssumptionName,
    Invariant,
    Kind,
    Level,
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
from rcsc.proof.solvers import smt
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


_MANY = {"property": "properties", "requirement": "requirements"}


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
        [*words] = dict.fromkeys(
            claim.word if len(declared) == 1 else _MANY[claim.word] for claim in declared
        )
        what, is_ = " and ".join(words), "is" if len(declared) == 1 else "are"
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
    """Return the assumptions of the table, and every invariant of the program."""
    return (*program.assumed(table), *program.invariants)


def _trials(program: Program) -> Iterator[dict[str, Value]]:
    """Yield a few inputs that are quickly tried: the initial values, and both ends of every range."""
    yield initial(program)
    for end in (0, 1):
        yield {
            variable.name: value_of_key(variable.type, key_bounds(variable.type)[end])
            for variable in program.variables
        }


# --- tables that run in one cycle ---


def assumed_together(program: Program, options: Options) -> Iterator[Diagnostic]:
    """Yield an error for each two tables of one level that assume of the inputs what cannot hold together.

    Each is proved under its own assumptions, and in every cycle one of them fails. What a stage before writes may differ from table to
    table, and is left out; so are tables of which a level runs one or the other, by its command.
    """
    inputs = {variable.name for variable in program.variables if variable.kind is Kind.INPUT}
    plain = {each.name for each in program.assumptions if inputs.issuperset(read_by(each.condition))}
    tables = {table.name: table for table in program.tables}
    with smt.together(options.few.steps):
        for level in program.levels:
            for one, other in combinations(level.choices, 2):
                for first, second in product(one.names, other.names):
                    if first != second:
                        yield from _of_two(program, level, tables[first], tables[second], plain, options)


def _of_two(
    program: Program, level: Level, first: Table, second: Table, plain: set[AssumptionName], options: Options
) -> Iterator[Diagnostic]:
    """Yield an error where what both assume of the inputs is impossible, and what each assumes is not."""
    names = [[name for name in table.assumptions if name in plain] for table in (first, second)]
    if not all(names) or not _impossible(program, first, [*names[0], *names[1]], options):
        return
    if any(_impossible(program, first, each, options) for each in names):
        return  # which is told of the table itself
    spans = {each.name: each.span for each in program.assumptions}
    yield Diagnostic(
        Code.CONTRADICTORY_ASSUMPTIONS,
        f"tables `{first.name}` and `{second.name}` of level `{level.name}` run in one cycle, and assume what cannot hold together",
        Label(second.span),
        related=tuple(Label(spans[name], "assumed") for name in dict.fromkeys((*names[0], *names[1]))),
    )


def _impossible(program: Program, table: Table, names: list[AssumptionName], options: Options) -> bool:
    """Return whether no values satisfy these assumptions and the invariants."""
    asked = replace(table, assumptions=tuple(dict.fromkeys(names)))
    try:
        return assumptions_satisfiable(program, asked, options) is Answer.UNSATISFIABLE
    except smt.troubles():
        return False
