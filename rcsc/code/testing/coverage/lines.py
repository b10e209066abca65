"""Which lines of which tables a vector takes: the one that it matches, or all that run.

In: a program and its vectors. Out: lines by table and name. The trace of a cycle tells the line of its last table alone, so that a
cycle is played again with a mark at the head of each line.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias, cast

from rcsc.code.testing.coverage.case import Case, ran, table_of
from rcsc.code.testing.coverage.choose import Kept
from rcsc.code.testing.executors.reference_file import all_lines
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Action, Apply, Bool, Default, Line, Literal, Local, Program, Table
from rcsc.lang.operator_table import Operator

TakenLine: TypeAlias = tuple[str, str]
"""A table and the name of one of its lines."""


@dataclass(frozen=True, slots=True, eq=False)
class _Ran:
    """A mark at the head of a line; an operator of one truth."""

    line: TakenLine
    seen: list[TakenLine]

    def meaning(self, truth: bool) -> bool:
        """Note that the line runs."""
        self.seen.append(self.line)
        return truth


@dataclass(slots=True)
class _Noting:
    """A program whose lines tell that they run."""

    seen: list[TakenLine] = field(default_factory=list)

    def program(self, program: Program) -> Program:
        """The same program with a mark at the head of each line."""
        return replace(program, tables=tuple(map(self.table, program.tables)))

    def table(self, table: Table) -> Table:
        """A table with its marks."""
        lines = tuple(replace(line, actions=(self.mark(table, line), *line.actions)) for line in table.lines)
        default = table.default
        if default is not None:
            default = replace(default, actions=(self.mark(table, default), *default.actions))
        return replace(table, lines=lines, default=default)

    def mark(self, table: Table, line: Line | Default) -> Action:
        """A statement that changes nothing and notes the line."""
        note = cast(Operator, _Ran((str(table.name), str(line.name)), self.seen))
        return Action("", "", Local("", Bool(), Apply(note, (Literal(True, Bool()),), Bool())))

    def lines(self, program: Program, case: Case) -> tuple[TakenLine, ...]:
        """The lines that run, in order."""
        self.seen.clear()
        ran(program, case)
        return tuple(self.seen)


def taken(program: Program, kept: Sequence[Kept]) -> Iterator[tuple[TakenLine, ...]]:
    """Give the lines that each vector takes."""
    noting = _Noting()
    noted = noting.program(program)
    for each in kept:
        case, right = each.case, each.expected
        match case.entry.kind:
            case "line" | "lines" if right.result >= 0:
                yield ((case.entry.name, all_lines(table_of(program, case.entry))[right.result][0]),)
            case "step" | "cycle" if not case.mode and right.result != Fault.STATE:
                yield noting.lines(noted, case)
            case _:
                yield ()
