"""One test vector of the whole C: a state with its inputs, the function that is called, and what it must give.

In: a program and what is put in. Out: what the interpreter says of it. A vector needs nothing but itself: its state is
complete, so that vectors can be played in any order, on a host or on the target.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.code.emit.code_tree import type_bounds
from rcsc.code.testing.agree import line_number, seen_by_interpreter
from rcsc.code.testing.executors.edges import may_be_matched
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.interpret import (
    UNDEFINED,
    Answers,
    Fault,
    Outcome,
    answering,
    cycle,
    holds,
    initial,
    matching_lines,
    run_table,
)
from rcsc.lang.model import (
    Bool,
    Int,
    Kind,
    Program,
    Real,
    Scalar,
    Snapshot,
    Value,
    Variable,
    key_bounds,
    key_of,
    next_value,
)

NONE = -1
MODES = ("upward", "downward", "toward zero", "subnormals to zero")
"""Ways of rounding that are not the language's: a step finds out, and refuses to compute."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A function of the C.

    Attributes:
        kind: `init`, `check`, `line`, `lines`, `step` or `cycle`.
        name: Of its table or level; empty for `init` and `check`.
    """

    kind: str
    name: str = ""


@dataclass(frozen=True, slots=True)
class Answer:
    """What an extern procedure gives when it is called: a value for each leaf that it writes, in range or not."""

    procedure: str
    values: tuple[Value, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """What is put in.

    Attributes:
        before: A value for every leaf; of an input any that its C type holds, and for `check` of any leaf.
        answers: Of the extern procedures, in the order of their calls.
        origin: How it was come by, in words.
        foreign: Whether the state has the digest of other tables.
        mode: How the machine rounds, one of `MODES`; empty for as it should.
        shows: Positions of the MC/DC vectors of its table that it is, from 1.
    """

    entry: Entry
    before: Snapshot
    answers: tuple[Answer, ...] = ()
    origin: str = ""
    foreign: bool = False
    mode: str = ""
    shows: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What must come out.

    Attributes:
        result: What the function gives: a position of a line, a fault, or what `check` says.
        fault_at: The leaf that was refused, the assumption, the table before the last without its line, or what of the state was
            refused; else empty.
        line: Position of the line that ran; -1 for none.
        failed: Assumptions that were told, by name.
        after: Every leaf afterwards; None where the function changes nothing.
    """

    result: int
    fault_at: str = ""
    line: int = NONE
    failed: tuple[str, ...] = ()
    after: Snapshot | None = None


def entries(program: Program) -> tuple[Entry, ...]:
    """Every function of the C, in the order of its header."""
    tables = [str(table.name) for table in program.tables]
    kinds = [Entry(kind, name) for kind in ("line", "lines", "step") for name in tables]
    return (Entry("init"), Entry("check"), *kinds, *(Entry("cycle", level.name) for level in program.levels))


def runs(program: Program) -> list[Entry]:
    """Return the functions that run a cycle: steps of tables, and cycles of levels."""
    return [entry for entry in entries(program) if entry.kind in ("step", "cycle")]


def function_of(symbols: Symbols, entry: Entry) -> str:
    """Return the name of an entry's function in the C."""
    match entry.kind:
        case "init":
            return symbols.init
        case "check":
            return symbols.check
        case "cycle":
            return symbols.cycles[entry.name]
    functions: Mapping[str, Mapping[str, str]] = {
        "line": symbols.lines,
        "lines": symbols.batches,
        "step": symbols.steps,
    }
    return functions[entry.kind][entry.name]


def expected(program: Program, case: Case, *, defensive: bool = False) -> Expected | None:
    """What the language says; None where it says nothing: the state may not be gone on from, or a table not be matched.

    Args:
        program: The program.
        case: What is put in.
        defensive: Whether the C trusts no state, and refuses such a one.
    """
    match case.entry.kind:
        case "init":
            return Expected(0, after=initial(program))
        case "check":
            return Expected(checked(program, case, defensive=defensive))
        case "line" | "lines":
            table = program.table(case.entry.name)
            if not may_be_matched(program, table, case.before):
                return None
            return Expected(line_number(table, matching_lines(table, case.before)))
    refused = checked(program, case, defensive=defensive)
    if refused != NONE:
        safe = shown_safe(program, case.before)
        names = [*(v.name for v in program.variables), *(i.name for i in program.invariants), ""]
        return Expected(Fault.STATE, str(names[refused]), after=safe) if defensive else None
    if case.mode:
        return Expected(Fault.ARITHMETIC, after=shown_safe(program, case.before))
    return ran(program, case)


def checked(program: Program, case: Case, *, defensive: bool) -> int:
    """What `check` says: `NONE`, the position of what it refuses, or one past the last for a state of other tables."""
    foreign = len(program.variables) + len(program.invariants)
    return foreign if case.foreign else refused_at(program, case.before, defensive=defensive)


def shown_safe(program: Program, state: Snapshot) -> Snapshot:
    """The state, its outputs as they are after a fault."""
    return {**state, **{str(v.name): v.safe for v in program.variables if v.safe is not None}}


def ran(program: Program, case: Case, answers: Answers | None = None) -> Expected | None:
    """What a step or a cycle does, in the program or in a marked one; None where it is undefined.

    Args:
        program: The program.
        case: What is put in.
        answers: What answers extern procedures; the case's own answers if None.
    """
    given = iter([answer.values for answer in case.answers])
    try:
        with answering(answers or (lambda _procedure, _args: next(given))):
            if case.entry.kind == "step":
                return _told(run_table(program, program.table(case.entry.name), case.before))
            level = next(level for level in program.levels if level.name == case.entry.name)
            return _told(cycle(program, level, case.before))
    except (*UNDEFINED, StopIteration):
        return None


def _told(outcome: Outcome) -> Expected:
    seen = seen_by_interpreter(outcome)
    return Expected(seen.fault, seen.fault_at, seen.line, seen.failed, seen.snapshot)


def refused_at(program: Program, state: Snapshot, *, defensive: bool = False) -> int:
    """The first variable outside its range, or, counted after the variables, the first invariant that fails; else `NONE`."""
    for at, variable in enumerate(program.variables):
        admitted = defensive and variable.kind is Kind.INPUT  # a truth, too: it is a byte there
        if not admitted and unfit(variable, state[variable.name]):
            return at
    for at, invariant in enumerate(program.invariants, len(program.variables)):
        if not holds(invariant.condition, state):
            return at
    return NONE


def unfit(variable: Variable, value: Value) -> bool:
    """Whether `check` refuses the value: of an input it looks at how a truth is stored, and admission at the rest."""
    if isinstance(variable.type, Bool):
        return int(value) not in (0, 1)
    if variable.kind is Kind.INPUT:
        return False
    if isinstance(variable.type, Real) and not math.isfinite(value):
        return True
    low, high = key_bounds(variable.type)
    return not low <= key_of(variable.type, value) <= high


def ends_of(kind: Scalar) -> tuple[Value, Value]:
    """The least and the greatest value of a kind."""
    return (kind.low, kind.high) if isinstance(kind, Real) else key_bounds(kind)


def outside_of(variable: Variable, c_type: str) -> Mapping[str, Value]:
    """Values outside the range that the C type holds, by the end that they are beyond, or `nan`."""
    kind = variable.type
    if isinstance(kind, Bool):
        return {"above": 2}
    if isinstance(kind, Real):
        return {
            "below": next_value(kind, kind.low, -1),
            "above": next_value(kind, kind.high, 1),
            "nan": math.nan,
        }
    low, high = (kind.low, kind.high) if isinstance(kind, Int) else key_bounds(kind)
    least, most = type_bounds(c_type)
    beyond = {"below": low - 1, "above": high + 1}
    return {end: value for end, value in beyond.items() if least <= value <= most}
