"""The reference meaning of the language; the prover and both executors are held against it.

In: a model and a snapshot. Out: values, matching lines, and the outcome of a step or a cycle. Short
enough to believe: it follows the manual's "What a cycle does" word for word and optimises nothing.
"""

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import partial
from typing import Any, TypeAlias, assert_never

from rcsc.base.diagnostics.coded import USERS_FAILURES, raised
from rcsc.lang.model import (
    Action,
    Admit,
    Among,
    Apply,
    Assign,
    Call,
    Case,
    Expr,
    For,
    If,
    Kind,
    Level,
    LineName,
    Literal,
    Local,
    OneTable,
    Procedure,
    Program,
    Read,
    ReadLocal,
    Real,
    Scalar,
    Select,
    Single,
    Snapshot,
    Statement,
    Table,
    TableChoice,
    Test,
    ToElement,
    ToLeaf,
    ToLocal,
    Value,
    Variable,
    key_bounds,
    pending,
)
from rcsc.lang.operator_table import UNDECIDED, Op, is_logic, single


class Fault(IntEnum):
    """The reason why a cycle ended early; the executors return the same numbers."""

    OK = 0
    ADMIT = 1
    NO_LINE = 2
    SEVERAL_LINES = 3
    EXTERN = 4
    ASSUMPTION = 5
    STATE = 6  # of the executors that are compiled to check their state in every cycle
    ARITHMETIC = 7  # of the executors in C alone: this machine, or its compiler, computes reals otherwise


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a step or cycle.

    Attributes:
        snapshot: The complete state afterwards.
        line: The matched line; None where there was none.
        line_index: Its position; DEFAULT is after the last; -1 where there was none.
        fault: OK, or why it ended early.
        failed_assumptions: Assumptions that the executors check and that did not hold.
        fault_at: The leaf that was refused, the first assumption that ended the cycle, or the table before the last without its line.
    """

    snapshot: dict[str, Value]
    line: LineName | None
    line_index: int
    fault: Fault
    failed_assumptions: tuple[str, ...] = ()
    fault_at: str = ""


class ExternError(Exception):
    """An extern procedure gave a value outside its declared range, for the leaf named."""


class ExternFailedError(Exception):
    """The user's function of an extern procedure raised, asked to end the process, or cannot be imported; says what was raised."""


UNDEFINED = (ArithmeticError, IndexError, ValueError)
"""Errors of undefined operations: a divisor of zero, an index outside its array, a real without a whole number."""

Answers: TypeAlias = Callable[[Procedure, list[Value]], tuple[Value, ...]]
"""Stand-in for extern procedures: takes one with its reads and arguments, returns its writes in order."""
_ANSWERS: ContextVar[Answers | None] = ContextVar("answers", default=None)


# --- expressions ---------------------------------------------------------------------


def operated(op: Op, kind: Scalar, *operands: Value) -> Value:
    """Return the value of an operator that looks at all its operands; the first is of type `kind`.

    Raises:
        ArithmeticError, ValueError: It has none: a divisor that is zero, or a real without a whole number.
    """
    reals = isinstance(kind, Real)
    result: Value = op.meaning(*map(float, operands)) if reals else op.meaning(*operands)
    return single(result) if isinstance(kind, Single) and isinstance(result, float) else result


def evaluate(expr: Expr, snapshot: Snapshot, local: Mapping[str, Value] | None = None) -> Value:
    """Return the value of `expr`; undefined operations (proved absent) raise."""
    match expr:
        case Literal(value=value):
            return value
        case Read(name=name):
            return snapshot[name]
        case ReadLocal(name=name):
            return (local or {})[name]
        case Select(leaves=leaves, index=index):
            return snapshot[leaves[_index(index, len(leaves), snapshot, local)]]
        case Among(subject=subject, values=values):
            return evaluate(subject, snapshot, local) in values
        case Apply(op=op, args=args):
            return _applied(op, args, snapshot, local)


def _index(expr: Expr, length: int, snapshot: Snapshot, local: Mapping[str, Value] | None) -> int:
    at = int(evaluate(expr, snapshot, local))
    if not 0 <= at < length:
        raise IndexError(at)
    return at


def _applied(op: Op, args: tuple[Expr, ...], snapshot: Snapshot, local: Mapping[str, Value] | None) -> Value:
    first = evaluate(args[0], snapshot, local)
    if is_logic(op):  # the right operand is looked at only where the left one does not decide
        decided = bool(first) not in UNDECIDED[op]
        return bool(op.meaning(bool(first), not decided and bool(evaluate(args[1], snapshot, local))))
    return operated(op, args[0].type, first, *(evaluate(arg, snapshot, local) for arg in args[1:]))


def fold(expr: Expr, values: Mapping[str, Value] | None = None) -> Value | None:
    """Return the interpreter's value, reading leaves from `values`; None where something is missing or undefined."""
    try:
        return evaluate(expr, values or {})
    except (LookupError, ArithmeticError, ValueError):
        return None


def holds(condition: Expr | Test, snapshot: Snapshot) -> bool:
    """Return whether a condition is true of `snapshot`."""
    return bool(evaluate(condition.condition if isinstance(condition, Test) else condition, snapshot))


def matching_lines(table: Table, snapshot: Snapshot) -> list[LineName]:
    """Return the names of the lines that match, in order, without DEFAULT."""
    return [
        line.name for line in table.lines if all(test is None or holds(test, snapshot) for test in line.tests)
    ]


# --- statements ----------------------------------------------------------------------


def execute(
    program: Program, body: Iterable[Statement], snapshot: dict[str, Value], local: dict[str, Value]
) -> None:
    """Run statements; change `snapshot` and `local` in place."""
    for statement in body:
        match statement:
            case Assign(place=place, value=value):
                _assign(place, _stored(evaluate(value, snapshot, local)), snapshot, local)
            case Local(name=name, value=value):
                local.pop(name, None)
                if value is not None:
                    local[name] = _stored(evaluate(value, snapshot, local))
            case If(condition=condition, then=then, orelse=orelse):
                execute(program, then if evaluate(condition, snapshot, local) else orelse, snapshot, local)
            case Case(subject=subject, arms=arms, orelse=orelse):
                given = evaluate(subject, snapshot, local)
                chosen = next((arm.body for arm in arms if given in arm.values), orelse)
                execute(program, chosen, snapshot, local)
            case For(name=name, low=low, high=high, body=inner):
                for count in range(low, high + 1):
                    local[name] = count
                    execute(program, inner, snapshot, local)
            case Call(procedure=name, args=args):
                call(program, name, [_stored(evaluate(arg, snapshot, local)) for arg in args], snapshot)
            case _:
                assert_never(statement)


def _stored(value: Value) -> Value:
    """Return a value as it is kept: 0.0 for -0.0."""
    return value + 0.0 if isinstance(value, float) else value


def _assign(
    place: ToLeaf | ToElement | ToLocal, value: Value, snapshot: dict[str, Value], local: dict[str, Value]
) -> None:
    match place:
        case ToLeaf(name=name):
            snapshot[name] = value
        case ToLocal(name=name):
            local[name] = value
        case ToElement(leaves=leaves, index=index):
            snapshot[leaves[_index(index, len(leaves), snapshot, local)]] = value
        case _:
            assert_never(place)


def call(program: Program, name: str, args: list[Value], snapshot: dict[str, Value]) -> None:
    """Run one procedure; change `snapshot` in place."""
    procedure = next(procedure for procedure in program.procedures if procedure.name == name)
    if procedure.extern is not None:
        _call_extern(program, procedure, args, snapshot)
        return
    local = {param.name: arg for param, arg in zip(procedure.params, args, strict=True)}
    execute(program, procedure.body, snapshot, local)


def _call_extern(
    program: Program, procedure: Procedure, args: list[Value], snapshot: dict[str, Value]
) -> None:
    """Call the user's function with reads and arguments; it returns the writes in order, one bare or in a tuple.

    Where nothing is written its result is ignored; else a wrong number of values is refused.
    """
    given = (_ANSWERS.get() or _of_user)(procedure, [*(snapshot[name] for name in procedure.reads), *args])
    if procedure.writes and len(given) != len(procedure.writes):
        raise ExternError(procedure.writes[0])
    for name, value in zip(procedure.writes, given, strict=bool(procedure.writes)):
        admitted = _admitted(program.variable(name), value)
        if admitted is None:
            raise ExternError(name)
        snapshot[name] = admitted


def _of_user(procedure: Procedure, args: list[Value]) -> tuple[Value, ...]:
    assert procedure.extern is not None
    module, _, function = procedure.extern.python.partition(":")
    try:
        results = getattr(importlib.import_module(module), function)(*args)
    except USERS_FAILURES as error:
        raise ExternFailedError(raised(error)) from error
    if not procedure.writes:
        return ()
    return results if isinstance(results, tuple) else (results,)


@contextmanager
def answering(answers: Answers) -> Iterator[None]:
    """Replace every call of an extern procedure, inside, by the results of `answers`, in range or not."""
    before = _ANSWERS.set(answers)
    try:
        yield
    finally:
        _ANSWERS.reset(before)


# --- cycles --------------------------------------------------------------------------


def initial(program: Program) -> dict[str, Value]:
    """Return the value of every leaf before the first cycle."""
    return {variable.name: variable.initial for variable in program.variables}


def _admitted(variable: Variable, value: Value) -> Value | None:
    """Return the value that tables may see; None where it is refused."""
    given = _exactly(float if isinstance(variable.type, Real) else int, value)
    if given is None:
        return None
    value = given
    if isinstance(variable.type, Real):
        low, high = variable.type.low, variable.type.high
        value = (single(value) if isinstance(variable.type, Single) else value) + 0.0
    else:
        low, high = key_bounds(variable.type)
    if low <= value <= high:
        return value
    if variable.admit is Admit.CLAMP:
        return low if value < low else high
    return None


def _exactly(kind: type[int | float], value: Any) -> Value | None:
    """Convert an outside value exactly; None for a NaN, a fraction among integers, and what is no number."""
    if kind is int and isinstance(value, int):
        return value
    try:
        exact = kind(value)
        return exact if exact == value else None
    except (TypeError, ValueError, OverflowError):
        return None


def admit(program: Program, snapshot: Snapshot) -> dict[str, Value] | str:
    """Return the snapshot with every input admitted, or the first leaf that is refused."""
    admitted = dict(snapshot)
    for variable in program.variables:
        if variable.kind is Kind.INPUT:
            value = _admitted(variable, snapshot[variable.name])
            if value is None:
                return variable.name
            admitted[variable.name] = value
    return admitted


def unfit(program: Program, snapshot: Snapshot) -> str:
    """Return the first state or output whose value is not of its type, else the first invariant that does not hold, else "".

    Inputs are left out: every cycle admits them.
    """
    for variable in program.variables:
        value, kind = snapshot[variable.name], variable.type
        low, high = (kind.low, kind.high) if isinstance(kind, Real) else key_bounds(kind)
        of_kind = isinstance(value, int | float if isinstance(kind, Real) else int)
        of_kind = of_kind and (not isinstance(kind, Single) or single(value) == value)
        if variable.kind is not Kind.INPUT and not (of_kind and low <= value <= high):
            return variable.name
    broken = (
        invariant.name for invariant in program.invariants if not evaluate(invariant.condition, snapshot)
    )
    return next(broken, "")


def settle(program: Program, snapshot: dict[str, Value]) -> None:
    """Give every deferred variable whose condition holds its next value, all at once; mark all tables as not yet run."""
    ready = [
        v.name
        for v in program.variables
        if v.deferred_until is not None and holds(v.deferred_until, snapshot)
    ]
    for name in ready:
        snapshot[name] = snapshot[pending(name)]
    snapshot.update(dict.fromkeys(program.line_leaves.values(), 0))


Chosen: TypeAlias = Callable[[Snapshot], Table]
"""Which table runs, by the values at its place in the cycle."""


def run_table(program: Program, table: Table, snapshot: Snapshot) -> Outcome:
    """Run one step of a table outside any level."""
    return _shown(program, _cycle(program, (lambda _: table,), (), (), snapshot))


def cycle(program: Program, level: Level, snapshot: Snapshot) -> Outcome:
    """Run one cycle of a level."""
    chosen = tuple(partial(chosen_table, program, choice) for choice in level.choices)
    return _shown(program, _cycle(program, chosen, level.preprocess, level.postprocess, snapshot))


def chosen_table(program: Program, choice: TableChoice, now: Snapshot) -> Table:
    """Return the table that runs on these values."""
    name = (
        choice.table if isinstance(choice, OneTable) else dict(choice.tables)[evaluate(choice.selector, now)]
    )
    return program.table(name)


def run_stage(program: Program, table: Table, now: dict[str, Value]) -> Fault:
    """Run a table that others follow, at its place in a cycle; return OK, or the fault that ends the cycle there.

    Raises:
        ExternError: As `execute`.
    """
    done = _run(program, table, now, _Matched(), last=False)
    if done.fault is Fault.OK:
        execute(program, [action.statement for action in done.actions], now, {})
    return done.fault


def _shown(program: Program, outcome: Outcome) -> Outcome:
    """Return the outcome of a cycle; after a fault, outputs with a safe value show that."""
    if outcome.fault is Fault.OK:
        return outcome
    shown = {str(v.name): v.safe for v in program.variables if v.safe is not None}
    return replace(outcome, snapshot={**outcome.snapshot, **shown})


def _cycle(
    program: Program,
    choices: tuple[Chosen, ...],
    preprocess: tuple[str, ...],
    postprocess: tuple[str, ...],
    snapshot: Snapshot,
) -> Outcome:
    now = admit(program, snapshot)
    if isinstance(now, str):
        return Outcome(dict(snapshot), None, -1, Fault.ADMIT, (), now)
    settle(program, now)
    done = _Matched()
    try:
        for name in preprocess:
            call(program, name, [], now)
        for chosen in choices:
            done = _run(program, chosen(now), now, done, last=chosen is choices[-1])
            if done.fault is not Fault.OK:
                return Outcome(now, None, -1, done.fault, done.failed, done.fault_at)
            execute(program, [action.statement for action in done.actions], now, {})
        for name in postprocess:
            call(program, name, [], now)
    except ExternError as error:
        return Outcome(now, done.line, done.index, Fault.EXTERN, done.failed, str(error))
    return Outcome(now, done.line, done.index, Fault.OK, done.failed)


@dataclass(frozen=True, slots=True)
class _Matched:
    """The progress of a cycle through its tables: the fields of `Outcome`, and the line's actions; `line` is of the last table only."""

    line: LineName | None = None
    index: int = -1
    actions: tuple[Action, ...] = ()
    failed: tuple[str, ...] = ()
    fault: Fault = Fault.OK
    fault_at: str = ""


def _run(program: Program, table: Table, now: dict[str, Value], before: _Matched, *, last: bool) -> _Matched:
    """Match one table on the values at its place; store the matched line in the state kept for it, where other tables follow."""
    failed = failed_assumptions(program, table, now)
    stopped = next((name for name in failed if name in table.stops), None)
    every = tuple(
        assumption.name for assumption in program.assumptions if assumption.name in {*before.failed, *failed}
    )
    if stopped is not None:
        return _Matched(failed=every, fault=Fault.ASSUMPTION, fault_at=stopped)
    matched = _match(table, now)
    if isinstance(matched, Fault):
        return _Matched(failed=every, fault=matched, fault_at="" if last else table.name)
    line, index, actions = matched
    kept = program.line_leaves.get(table.name)
    if kept is not None:
        now[kept] = index + 1
    return _Matched(line if last else None, index if last else -1, actions, every)


def failed_assumptions(program: Program, table: Table, now: Snapshot) -> tuple[str, ...]:
    """Return those of the table's assumptions that are checked (monitored, or able to stop the cycle) and do not hold."""
    return tuple(
        assumption.name
        for assumption in program.assumed(table)
        if (assumption.standing.checked or assumption.name in table.stops)
        and not holds(assumption.condition, now)
    )


def _match(table: Table, now: Snapshot) -> tuple[LineName, int, tuple[Action, ...]] | Fault:
    matching = matching_lines(table, now)
    if len(matching) > 1:
        return Fault.SEVERAL_LINES
    if matching:
        index = next(at for at, line in enumerate(table.lines) if line.name == matching[0])
        return matching[0], index, table.lines[index].actions
    if table.default is None:
        return Fault.NO_LINE
    return table.default.name, len(table.lines), table.default.actions
