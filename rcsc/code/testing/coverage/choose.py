"""The cases that are kept: each hits something that none before it does, and none can be spared.

In: cases. Out: vectors, with what each must give and which lines it takes, and the sessions that were drawn on the way.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias, cast

from rcsc.code.emit.plan import Plan
from rcsc.code.testing.coverage.candidates import (
    Session,
    always,
    drawn,
    of_masks,
    of_tables,
    of_truths,
    refusals,
)
from rcsc.code.testing.coverage.case import Case, Entry, Expected, expected, ran, runs
from rcsc.code.testing.coverage.goals import Hit, Reached
from rcsc.code.testing.coverage.marks import marked
from rcsc.code.testing.coverage.matters import TRIES, Matters, matters_of
from rcsc.code.testing.executors.reference_file import all_lines
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.inputs.snapshot import InputSearch
from rcsc.code.testing.inputs.vectors import Vectors
from rcsc.lang.interpret import Fault
from rcsc.lang.model import Action, Apply, Bool, Default, Line, Literal, Local, Program, Table
from rcsc.lang.operator_table import Operator

LEAVE_AFTER = 60
"""Sessions of one function in which nothing new is hit, after which no more are drawn."""
MORE_TRIES = 40
"""Kept cases in which another thing at a place is tried, before cases beside them are."""
MOST_CYCLES = 8
"""Of a drawn session."""
TakenLine: TypeAlias = tuple[str, str]
"""A table and the name of one of its lines."""


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """A vector.

    Attributes:
        hits: Everything that it hits.
    """

    case: Case
    expected: Expected
    hits: frozenset[Hit]


@dataclass(slots=True)
class Choice:
    """Collects vectors of one program.

    Attributes:
        sessions: Drawn sessions, in full.
    """

    program: Program
    reached: Reached
    matters: Matters
    kept: list[Kept] = field(default_factory=list)
    sessions: list[Session] = field(default_factory=list)

    def offer(self, case: Case, right: Expected | None = None, tries: int = TRIES) -> bool:
        """Keep a case if it hits something new; of what it may notice (`matters`) what was tried less often is tried."""
        right = right or expected(self.program, case)
        if right is None:
            return False
        hits = self.reached.of(case, right) | self.matters.of(case, right, tries)
        if hits <= self.reached.hits:
            return False
        self.reached.keep(hits)
        self.matters.keep(hits)
        self.kept.append(Kept(case, right, frozenset(hits)))
        return True

    def draw(self, entry: Entry, examples: int, most: int) -> None:
        """Draw sessions of a function, and keep what is new in them."""
        idle = 0
        for session in drawn(self.program, entry, examples, most):
            pairs = zip(session.cases, session.expected, strict=True)
            new = [self.offer(case, right) for case, right in pairs]
            self.sessions.append(session)
            idle = 0 if any(new) else idle + 1
            if idle > LEAVE_AFTER:
                return

    def look_again(self) -> None:
        """Try what is open in the cases that were kept, more often than as they came."""
        for at, kept in enumerate(self.kept):
            if noticed := self.matters.of(kept.case, kept.expected, TRIES + MORE_TRIES):
                self.matters.keep(noticed)
                self.kept[at] = replace(kept, hits=kept.hits | noticed)

    def spare(self) -> None:
        """Drop every vector whose hits the others have; the last first, which were the hardest to come by and hit most."""
        counts: dict[Hit, int] = {}
        for kept in self.kept:
            for hit in kept.hits:
                counts[hit] = counts.get(hit, 0) + 1
        left = []
        for kept in self.kept:
            if all(counts[hit] > 1 for hit in kept.hits):
                for hit in kept.hits:
                    counts[hit] -= 1
            else:
                left.append(kept)
        self.kept = left


def chosen(
    search: InputSearch,
    plan: Plan,
    symbols: Symbols,
    tables: Sequence[Vectors],
    sessions: int,
    progress: Callable[[str], None],
    *,
    reals: bool = False,
) -> Choice:
    """Vectors of a program, as far as no solver is needed for its procedures.

    Args:
        search: Over a proved program; with a solver where relations between leaves are to be met.
        plan: Of its C.
        symbols: Of its C.
        tables: MC/DC vectors of each table.
        sessions: How many are drawn of each step and cycle, at most.
        progress: Told what is being done.
        reals: Whether the C looks how the machine computes reals.
    """
    program = search.program
    choice = Choice(program, Reached(program, plan, marked(program)), matters_of(program))
    cycles, steps = ([entry for entry in runs(program) if entry.kind == kind] for kind in ("cycle", "step"))
    for entry in cycles:  # first of all, so that what shows in a whole cycle is shown there
        progress(f"drawing sessions of {entry.kind} {entry.name}")
        choice.draw(entry, sessions, MOST_CYCLES)
    for case in (
        *always(program, symbols, reals=reals),
        *of_tables(search, plan, tables),
        *of_truths(search, plan),
    ):
        choice.offer(case)
    for case, bits in of_masks(plan, tables):
        if not choice.reached.hits.issuperset(bits):
            choice.offer(case)
    for entry in steps:
        progress(f"drawing sessions of {entry.kind} {entry.name}")
        choice.draw(entry, sessions, MOST_CYCLES)
    for kept in [kept for kept in choice.kept if kept.case.answers]:
        for case in refusals(program, symbols, kept.case):
            choice.offer(case)
    return choice


# --- lines that vectors take ---


@dataclass(frozen=True, slots=True, eq=False)
class _Ran:
    """A mark at the head of a line; an operator of one truth."""

    line: TakenLine
    seen: list[TakenLine]

    def meaning(self, truth: bool) -> bool:
        """Note that the line runs."""
        self.seen.append(self.line)
        return truth


def taken(program: Program, kept: Sequence[Kept]) -> Iterator[tuple[TakenLine, ...]]:
    """Give the lines that each vector takes: the one that matches, or all that run.

    The trace of a cycle tells the line of its last table alone, so that a cycle is played again with a mark at the head of each line.
    """
    seen: list[TakenLine] = []
    noting = _noting(program, seen)
    for each in kept:
        case, right = each.case, each.expected
        match case.entry.kind:
            case "line" | "lines" if right.result >= 0:
                yield ((case.entry.name, all_lines(program.table(case.entry.name))[right.result][0]),)
            case "step" | "cycle" if not case.mode and right.result != Fault.STATE:
                seen.clear()
                ran(noting, case)
                yield tuple(seen)
            case _:
                yield ()


def _noting(program: Program, seen: list[TakenLine]) -> Program:
    """Return the program with a statement at the head of each line that changes nothing and notes the line."""

    def actions(table: Table, line: Line | Default) -> tuple[Action, ...]:
        note = cast(Operator, _Ran((str(table.name), str(line.name)), seen))
        return Action("", "", Local("", Bool(), Apply(note, (Literal(True, Bool()),), Bool()))), *line.actions

    def noted(table: Table) -> Table:
        lines = tuple(replace(line, actions=actions(table, line)) for line in table.lines)
        default = table.default and replace(table.default, actions=actions(table, table.default))
        return replace(table, lines=lines, default=default)

    return replace(program, tables=tuple(map(noted, program.tables)))
