"""Mutants of tables: what a slip of the hand would make of them, and who notices.

In: a program, a table of it and the prover (a function passed in). Out: for each mutant how it was caught.
A mutant is caught by the prover (a finding that the table did not have, or another region left to
DEFAULT), or it is another table of which exactly one line matches too: then either it is shown to mean the
same for every input, or a snapshot tells the executors of the table and the mutant apart.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import combinations
from random import Random

from rcsc.code.testing.inputs.snapshot import InputSearch, Missing, Wanted
from rcsc.code.testing.inputs.vectors import given_in
from rcsc.lang.interpret import matching_lines
from rcsc.lang.interval_sets import joined
from rcsc.lang.model import (
    Apply,
    Bool,
    Box,
    Expr,
    Line,
    LineName,
    Literal,
    Op,
    Program,
    Read,
    Scalar,
    Snapshot,
    Table,
    Test,
    key_bounds,
    spell,
    value_of_key,
)


class Caught(StrEnum):
    """Who noticed a mutant."""

    PROVER = "the prover"
    DEFAULT = "the prover (what falls to DEFAULT)"
    EXECUTORS = "the executors"  # another correct table; they take another line on a snapshot
    EQUIVALENT = "equivalent"
    UNDECIDED = "undecided"  # neither shown to mean the same, nor a snapshot found
    SURVIVED = "survived"  # the search calls them different where the interpreter does not


@dataclass(frozen=True, slots=True)
class TableMutant:
    """A table with one change.

    Attributes:
        change: `drop`, `widen`, `narrow`, `duplicate` or `swap`.
        where: The line and column in words.
        lines: Names of the lines whose conditions differ.
    """

    change: str
    where: str
    table: Table
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class JudgedMutant:
    """What became of one mutant."""

    change: str
    where: str
    caught: Caught


@dataclass(frozen=True, slots=True)
class Opinion:
    """What the prover says of a table.

    Attributes:
        accepted: Exactly one line, no error.
        default: What falls to DEFAULT, as the prover counts it; anything comparable.
    """

    accepted: bool
    default: str = ""


Prover = Callable[[Program, Table], Opinion]


def test_of_box(like: Test, kind: Scalar, box: Box) -> Test:
    """The condition that the leaf of `like` lies in `box`."""
    leaf = Read(like.variables[0], kind)

    def bound(op: Op, key: int) -> Expr:
        return Apply(op, (leaf, Literal(value_of_key(kind, key), kind)), Bool())

    condition: Expr = Literal(False, Bool())
    words: list[str] = []
    for low, high in box:
        inside = Apply(Op.AND, (bound(Op.GE, low), bound(Op.LE, high)), Bool())
        if isinstance(kind, Bool):
            inside = Apply(Op.EQ, (leaf, Literal(bool(low), kind)), Bool()) if low == high else inside
        condition = Apply(Op.OR, (condition, inside), Bool())
        words.append(f"{spell(kind, value_of_key(kind, low))} .. {spell(kind, value_of_key(kind, high))}")
    return Test(", ".join(words), condition, like.variables, box)


def wider(box: Box, kind: Scalar) -> Iterator[Box]:
    """The box with one key more, at each end of each interval."""
    low, high = key_bounds(kind)
    for at, (start, end) in enumerate(box):
        rest = [*box[:at], *box[at + 1 :]]
        if start > low:
            yield joined([*rest, (start - 1, end)])
        if end < high:
            yield joined([*rest, (start, end + 1)])


def narrower(box: Box) -> Iterator[Box]:
    """The box with one key less, at each end of each interval; never the empty one."""
    for at, (start, end) in enumerate(box):
        rest = [*box[:at], *box[at + 1 :]]
        if start < end:
            yield joined([*rest, (start + 1, end)])
            yield joined([*rest, (start, end - 1)])
        elif rest:
            yield joined(rest)


def with_cell(table: Table, row: int, column: int, test: Test | None) -> Table:
    """The table with one cell changed."""
    line = table.lines[row]
    tests = (*line.tests[:column], test, *line.tests[column + 1 :])
    return replace(table, lines=(*table.lines[:row], replace(line, tests=tests), *table.lines[row + 1 :]))


LOOSER = {Op.LT: Op.LE, Op.GT: Op.GE, Op.EQ: Op.LE}
TIGHTER = {Op.LE: Op.LT, Op.GE: Op.GT, Op.NE: Op.LT}


def with_operator(test: Test, change: dict[Op, Op]) -> Test | None:
    """The test with its comparison loosened or tightened; None if it has none at its top."""
    condition = test.condition
    if test.box is not None or not isinstance(condition, Apply) or condition.op not in change:
        return None
    return replace(test, text=f"{test.text} changed", condition=replace(condition, op=change[condition.op]))


def _cell_mutants(program: Program, table: Table, row: int, column: int) -> Iterator[TableMutant]:
    line, test = table.lines[row], table.lines[row].tests[column]
    where = f"line {line.name}, column {table.columns[column].heading}"

    def mutant(change: str, cell: Test | None) -> TableMutant:
        return TableMutant(change, where, with_cell(table, row, column, cell), (str(line.name),))

    if test is None:
        others = [other.tests[column] for other in table.lines if other.tests[column] is not None]
        if others:
            yield mutant("narrow", others[row % len(others)])
        return
    yield mutant("widen", None)
    if test.box is not None:
        kind = program.variable(test.variables[0]).type
        yield from (mutant("widen", test_of_box(test, kind, box)) for box in wider(test.box, kind))
        yield from (mutant("narrow", test_of_box(test, kind, box)) for box in narrower(test.box))
    for change, operators in (("widen", LOOSER), ("narrow", TIGHTER)):
        changed = with_operator(test, operators)
        if changed is not None:
            yield mutant(change, changed)


def table_mutants(program: Program, table: Table) -> Iterator[TableMutant]:
    """Every mutant: each line dropped and doubled, each cell widened and narrowed, each two swapped."""
    for row, line in enumerate(table.lines):
        rest = (*table.lines[:row], *table.lines[row + 1 :])
        yield TableMutant("drop", f"line {line.name}", replace(table, lines=rest), (str(line.name),))
        copy: Line = replace(line, name=LineName(f"{line.name}_again"))
        twice = (*table.lines[: row + 1], copy, *table.lines[row + 1 :])
        names = (str(line.name), str(copy.name))
        yield TableMutant("duplicate", f"line {line.name}", replace(table, lines=twice), names)
        for column in range(len(table.columns)):
            yield from _cell_mutants(program, table, row, column)
    for first, second in combinations(range(len(table.lines)), 2):
        yield from _swaps(table, first, second)


def _swaps(table: Table, first: int, second: int) -> Iterator[TableMutant]:
    upper, lower = table.lines[first], table.lines[second]
    for column, (a, b) in enumerate(zip(upper.tests, lower.tests, strict=True)):
        if a != b:
            swapped = with_cell(with_cell(table, first, column, b), second, column, a)
            where = f"lines {upper.name} and {lower.name}, column {table.columns[column].heading}"
            yield TableMutant("swap", where, swapped, (str(upper.name), str(lower.name)))


def _holds(line: Line) -> list[Wanted]:
    return [(test, True) for test in line.tests if test is not None]


def difference(search: InputSearch, table: Table, mutant: TableMutant) -> Snapshot | Missing:
    """A snapshot that a changed line matches in one of the two tables only; NONE if there is none."""
    given = list(given_in(search.program, table))
    answer = Missing.NONE
    old, new = ({str(line.name): line for line in each.lines} for each in (table, mutant.table))
    for name in mutant.lines:
        for here, there in ((old, new), (new, old)):
            snapshot = _only(search, given, here.get(name), there.get(name))
            if not isinstance(snapshot, Missing):
                return snapshot
            answer = Missing.UNKNOWN if snapshot is Missing.UNKNOWN else answer
    return answer


def _only(
    search: InputSearch, given: list[Wanted], here: Line | None, there: Line | None
) -> Snapshot | Missing:
    """A snapshot that matches `here` and not `there`."""
    if here is None:
        return Missing.NONE
    wanted = [*given, *_holds(here)]
    if there is None:
        return search.find(wanted)
    answer = Missing.NONE
    for test, _ in _holds(there):
        snapshot = search.find([*wanted, (test, False)])
        if not isinstance(snapshot, Missing):
            return snapshot
        answer = Missing.UNKNOWN if snapshot is Missing.UNKNOWN else answer
    return answer


def judge(
    search: InputSearch, table: Table, mutant: TableMutant, before: Opinion, prover: Prover
) -> JudgedMutant:
    """What becomes of one mutant.

    Args:
        search: A search over the program.
        table: The table as it is.
        mutant: The changed table.
        before: What the prover says of the table as it is.
        prover: The prover.
    """
    program = search.program
    tables = tuple(mutant.table if t.name == table.name else t for t in program.tables)
    after = prover(replace(program, tables=tables), mutant.table)
    if not after.accepted:
        return JudgedMutant(mutant.change, mutant.where, Caught.PROVER)
    if after.default != before.default:
        return JudgedMutant(mutant.change, mutant.where, Caught.DEFAULT)
    snapshot = difference(search, table, mutant)
    if snapshot is Missing.NONE:
        return JudgedMutant(mutant.change, mutant.where, Caught.EQUIVALENT)
    if isinstance(snapshot, Missing):
        return JudgedMutant(mutant.change, mutant.where, Caught.UNDECIDED)
    parted = matching_lines(table, snapshot) != matching_lines(mutant.table, snapshot)
    return JudgedMutant(mutant.change, mutant.where, Caught.EXECUTORS if parted else Caught.SURVIVED)


def judge_table(
    search: InputSearch, table: Table, prover: Prover, sample: int | None = None, seed: int = 1984
) -> tuple[JudgedMutant, ...]:
    """Judges the table's mutants: all of them, or a sample by seed.

    Args:
        search: A search over the program.
        table: A table that the prover accepts.
        prover: The prover.
        sample: How many mutants at most; None for all.
        seed: Seed of the sample.
    """
    mutants = list(table_mutants(search.program, table))
    if sample is not None and len(mutants) > sample:
        mutants = Random(seed).sample(mutants, sample)  # noqa: S311  # a repeatable sample
    before = prover(search.program, table)
    return tuple(judge(search, table, mutant, before, prover) for mutant in mutants)
