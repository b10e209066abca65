"""Why each line of a table matched in a cycle, or did not: the first of its cells that failed, and the values it read.

In: a program, a level, and the values with which a cycle began, its inputs taken. Out: for every line what failed. The cycle is played
again by the reference interpreter, up to the table that is asked for, so that a cell is judged on the values that the table saw.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.codes import Code
from rcsc.lang.interpret import (
    UNDEFINED,
    ExternError,
    Fault,
    admit,
    answering,
    call,
    chosen_table,
    failed_assumptions,
    holds,
    run_stage,
    settle,
)
from rcsc.lang.leaves import conjuncts, read_by
from rcsc.lang.model import Expr, Line, Procedure, Program, Table, Test, Value, spell

Snapshot = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Judged:
    """A line, judged on the values of a cycle.

    Attributes:
        matches: Whether every cell of it holds.
        column: The place of the first cell that does not, from 0; -1 where all do.
        heading: Of that cell's column.
        cell: The cell, in the table's words.
        values: The variables that it reads, as they were: (name, value).
        failing: How many of its cells do not hold.
    """

    line: str
    matches: bool
    column: int = -1
    heading: str = ""
    cell: str = ""
    values: tuple[tuple[str, str], ...] = ()
    failing: int = 0


@dataclass(frozen=True, slots=True)
class TableJudged:
    """A table, judged in a cycle.

    Attributes:
        failed: Assumptions of it that did not hold.
        default: The line that runs where none matches; empty for none.
    """

    table: str
    lines: tuple[Judged, ...]
    failed: tuple[str, ...]
    default: str


def why(program: Program, level: str, began: Snapshot) -> tuple[TableJudged, ...]:
    """Return every table that the cycle tried, in order, with each of its lines.

    Args:
        program: The level's.
        level: Its name.
        began: All leaves: states and outputs as the cycle before left them, inputs as this one took them.

    Raises:
        Refused: The cycle ended before a table was tried, or cannot be played again.
    """
    own = next(one for one in program.levels if one.name == level)
    now = admit(program, began)
    if isinstance(now, str):
        raise Refused(Code.STUDIO, f"no table was tried: input `{now}` was refused")
    judged = []
    try:
        with answering(_not_again):
            settle(program, now)
            for name in own.preprocess:
                call(program, name, [], now)
            for choice in own.choices:
                table = chosen_table(program, choice, now)
                judged.append(_table(program, table, now))
                if choice is not own.choices[-1] and run_stage(program, table, now) is not Fault.OK:
                    break
    except (*UNDEFINED, ExternError, KeyError) as error:
        raise Refused(Code.STUDIO, f"the cycle cannot be played again: {error}") from error
    return tuple(judged)


def _table(program: Program, table: Table, now: Snapshot) -> TableJudged:
    lines = tuple(_line(program, table, line, now) for line in table.lines)
    default = "" if table.default is None else str(table.default.name)
    return TableJudged(table.name, lines, failed_assumptions(program, table, now), default)


def _line(program: Program, table: Table, line: Line, now: Snapshot) -> Judged:
    failing = [
        (at, test)
        for at, test in enumerate(line.tests)
        if test is not None and not _part_holds(test.condition, now)
    ]
    if not failing:
        return Judged(str(line.name), matches=True)
    at, test = failing[0]
    column = table.columns[at]
    heading = column.heading if column.written else "above"
    return Judged(str(line.name), False, at, heading, test.text, _read(program, test, now), len(failing))


def _read(program: Program, test: Test, now: Snapshot) -> tuple[tuple[str, str], ...]:
    """Return the variables of the first part of a cell that does not hold."""
    false = next((part for part in conjuncts(test.condition) if not _part_holds(part, now)), test.condition)
    names = dict.fromkeys(read_by(false))
    return tuple((str(name), spell(program.variable(name).type, now[name])) for name in names)


def _part_holds(part: Expr, now: Snapshot) -> bool:
    try:
        return holds(part, now)
    except UNDEFINED:
        return False


def _not_again(procedure: Procedure, _: list[Value]) -> tuple[Value, ...]:
    """Refuse the call: an extern procedure is a user's own program, and is not run again to look at a cycle."""
    raise ExternError(f"`{procedure.name}` is an extern procedure, and is not called again")
