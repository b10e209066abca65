"""Repairs in the text: whether what is said of one is proved once it stands there, and the level that the text then means.

In: a level, a table that a run breaks, changes of it. Out: an `After` of each. The change is written into the text of the table, and that
is parsed, resolved and proved anew, with the whole program: a cell of a line that stands above another changes what that one matches, too,
and a condition may bring a counter with it. What is proved of the table as it was resolved is proved of nothing that anybody can write.

Trusted: nothing but the pipeline itself. Where the text on disk does not mean the table that ran, because it was saved since, or the
table is a variant under another rule, nobody can tell.

Cost: a proof of one table a change, at most `MOST_TRIED` of one table, and of all tables together so many steps as `MOST_STEPS`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Change, ChangeKind, Proposal
from rcsc.base.diagnostics.source import Source
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.lang.interpret import UNDEFINED, matching_lines
from rcsc.lang.model import AssumptionName, Program, Snapshot, Table
from rcsc.lang.project import Loaded, again
from rcsc.lang.resolve import resolve
from rcsc.lang.written.changes import spliced
from rcsc.lang.written.tables import table_of
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import WRONG_STEPS, Options
from rcsc.proof.table.mending import STEPS_OF_A_CELL, Outcome, Silent, Wrong, key, of_text, serious, written
from rcsc.proof.table.program import ProgramVerdict, prove_program
from rcsc.proof.table.regions.atoms import Every, Universe, assumptions_of, lines_of
from rcsc.proof.table.regions.least import find, negated, whole
from rcsc.proof.table.regions.region import NoWitness
from rcsc.proof.table.repair import NewLine, PartingCell, changes_of

MOST_STEPS = 20 * WRONG_STEPS
"""Steps of Z3 for all changes of all tables that runs break, together."""
MOST_TRIED = 100
"""Changes of one table that are tried."""


@dataclass(frozen=True, slots=True)
class After:
    """The result of a change in the text.

    Attributes:
        outcome: Whether the claim about the change is proved of the text.
        ts: The level with the text's table, for runs; None where there is none with the same leaves.
        pairs: Lines that overlap then, by names.
    """

    outcome: Outcome
    ts: TransitionSystem | None = None
    pairs: tuple[tuple[str, str], ...] = ()

    def told(self, pieces: Sequence[str]) -> str:
        """Return the sentence with "proved" or "not proved" between its pieces."""
        return ("proved" if self.outcome is Outcome.HOLDS else "not proved").join(pieces)


@dataclass(slots=True)
class Texts:
    """The texts of the tables that runs break, each read once."""

    budget: smt.Budget = field(default_factory=lambda: smt.Budget(MOST_STEPS, of_all=True))
    known: dict[tuple[str, str], "Text"] = field(default_factory=dict)

    def of(self, ts: TransitionSystem, name: str) -> "Text":
        """Return the text of a table of a level."""
        place = str(ts.level.name), name
        kept = self.known.get(place)
        if kept is None or kept.ts is not ts:
            kept = self.known[place] = Text(ts, ts.table(name), self.budget)
        return kept


@dataclass(slots=True)
class Text:
    """The text of one table.

    Attributes:
        loaded: All files of its program; None where they do not state this table.
        before: The errors of the table as it is, and `told`, those of the program; None where that was not decided.
        tried: How many changes were tried.
    """

    ts: TransitionSystem
    table: Table
    budget: smt.Budget
    loaded: Loaded | None = field(init=False)
    before: Wrong | None = field(init=False, default=None)
    told: set[tuple[str, str]] = field(init=False, default_factory=set)
    tried: int = 0

    def __post_init__(self) -> None:
        """Read the files, and prove the table as it is."""
        self.loaded = again(self.ts.program.file, self.ts.program.instance)
        program = resolve(self.loaded.roots[0], self.loaded) if self.loaded.roots else None
        if not isinstance(program, Program) or not self._says(program):
            self.loaded = None
        elif (verdict := self._verdict(program)) is not None:
            self.before = Wrong.of(verdict.tables[0])
            self.told = {key(each) for each in serious(verdict.findings)}

    def _says(self, program: Program) -> bool:
        """Return whether a program has this very table, and variables of the same types."""
        tables = [table for table in program.tables if table.name == self.table.name]
        return tables == [replace(self.table, stops=())] and program.kinds == self.ts.program.kinds

    # --- changes ---

    def parted(self, cell: PartingCell) -> After:
        """Write a cell that parts two lines. Proved means: they never both match, the other runs, and nothing new is wrong.

        If all that the line loses is the other's, no further input falls to DEFAULT, or to no line.
        """
        made = self._made((cell.change(self.table),))
        if not isinstance(made, _Made):
            return After(made)
        name, other = (self.table.lines[at].name for at in (cell.line, cell.other))
        if made.wrong.pairs - made.before.pairs or frozenset((name, other)) in made.wrong.pairs:
            return made.after(Outcome.FAILS)
        counted = not made.wrong.gap or None not in (made.wrong.left, made.before.left)
        if cell.falls or made.wrong.within(made.before):
            own = _tests(self.table)
            same = list(made.tests) == list(own) and made.tests[other] == own[other]
            return made.after(Outcome.HOLDS if same and (cell.falls or counted) else Outcome.OPEN)
        return made.after(Outcome.FAILS)

    def together(self, cells: Sequence[PartingCell]) -> After | None:
        """Write several cells. Proved means: no two lines both match. None where no text can state them."""
        changes = changes_of(self.ts.program, self.table, cells)
        if not changes:
            return None
        made = self._made(changes)
        if not isinstance(made, _Made):
            return After(made)
        return made.after(Outcome.FAILS if made.wrong.pairs else Outcome.HOLDS)

    def joined(self, row: NewLine, seen: Snapshot) -> After:
        """Write a line for a gap's input. Proved means: it alone matches that input, overlaps no other line, and closes what it claims."""
        made = self._made((Change(ChangeKind.LINE, texts=row.cells),))
        if not isinstance(made, _Made):
            return After(made)
        own = _tests(self.table)
        new = [name for name in made.tests if name not in own]
        others = {name: tests for name, tests in made.tests.items() if name not in new}
        try:
            matches = matching_lines(made.table, seen)
        except (KeyError, *UNDEFINED):
            return made.after(Outcome.OPEN)
        overlaps = any(name in pair for name in new for pair in made.wrong.pairs)
        closes = not (row.closes and made.wrong.gap)
        right = len(new) == 1 and matches == new and not overlaps and closes and others == own
        return made.after(Outcome.HOLDS if right else Outcome.FAILS)

    def under(self, condition: str) -> Outcome:
        """Make the table assume a condition in its text. Proved means: exactly one line matches under it, and under no weaker one."""
        source = None if self.loaded is None else self.loaded.sources.get(self.table.span.file)
        text = None if source is None else assuming(source.text, str(self.table.name), condition)
        if self.loaded is None or source is None or text is None:
            return Outcome.OPEN
        program = of_text(self.loaded.roots[0], self.loaded, Source(source.name, text))
        tables = [] if program is None else [each for each in program.tables if each.name == self.table.name]
        if program is None or len(tables) != 1:
            return Outcome.FAILS
        table = replace(tables[0], assumptions=(AssumptionName(_NEW),))
        verdict = self._proved(_free(program, table))
        wrong = None if verdict is None else Wrong.of(verdict.tables[0])
        if wrong is None or not wrong.whole:
            return Outcome.OPEN
        holds = not wrong.pairs and not wrong.gap and _no_weaker(program, table)
        return Outcome.HOLDS if holds else Outcome.FAILS

    def _made(self, changes: tuple[Change, ...]) -> "_Made | Outcome":
        """Write changes and prove the table again; return an outcome where that stays open, or is worse than before."""
        self.tried += 1
        if self.loaded is None or self.before is None or self.tried > MOST_TRIED:
            return Outcome.OPEN
        proposal = Proposal("", str(self.table.name), "", changes)
        program = written(self.loaded.roots[0], self.loaded, self.table.span.file, proposal)
        if program is None or not any(table.name == self.table.name for table in program.tables):
            return Outcome.FAILS
        verdict = self._verdict(program)
        if verdict is None:
            return Outcome.OPEN
        wrong = Wrong.of(verdict.tables[0])
        more = {key(each) for each in serious(verdict.findings)} - self.told
        if not (self.before.whole and wrong.whole) or any(Code.UNDECIDED in each for each in more):
            return Outcome.OPEN
        if more or wrong.dead - self.before.dead:
            return Outcome.FAILS
        return _Made(self._level(verdict), verdict.tables[0].table, self.before, wrong)

    def _verdict(self, program: Program) -> ProgramVerdict | None:
        """Prove the table's program; the table itself is judged without assumptions, as runs need not keep to them.

        None where the budget ends first.
        """
        full = self._proved(program)
        table = program.table(self.table.name)
        free = _free(program, replace(table, assumptions=()))
        if full is None or free == program:
            return full
        alone = self._proved(free)
        return None if alone is None else replace(full, tables=alone.tables)

    def _proved(self, program: Program) -> ProgramVerdict | None:
        cells = len(self.table.lines) * (len(self.table.columns) + 1)
        with smt.within(self.budget):
            if smt.charge(STEPS_OF_A_CELL * cells):
                return None
            try:
                return prove_program(program, _QUICK, only=[self.table.name], known=Silent())
            except smt.troubles():
                return None

    def _level(self, verdict: ProgramVerdict) -> TransitionSystem | None:
        """Return the level with the program that was proved; None if that has other leaves."""
        if verdict.program.kinds != self.ts.program.kinds:
            return None
        stops = {table.name: table.stops for table in self.ts.program.tables}
        tables = (
            table if table.name == self.table.name else replace(table, stops=stops.get(table.name, ()))
            for table in verdict.program.tables
        )
        return self.ts.of(replace(verdict.program, tables=tuple(tables)))


@dataclass(frozen=True, slots=True)
class _Made:
    """The result of a change: the level, the table, and the errors before and after."""

    ts: TransitionSystem | None
    table: Table
    before: Wrong
    wrong: Wrong

    @property
    def tests(self) -> Mapping[str, object]:
        """The conditions of each line, by its name, in order."""
        return _tests(self.table)

    def after(self, outcome: Outcome) -> After:
        """Return the result with this outcome."""
        order = list(self.tests)
        pairs = sorted(tuple(sorted(pair, key=order.index)) for pair in self.wrong.pairs)
        return After(outcome, self.ts, tuple((first, second) for first, second in pairs))


_QUICK = Options(brief=True, bare=True, jobs=1)


def _tests(table: Table) -> Mapping[str, object]:
    """Return each line's conditions by its name; empty cells are left out, as `above` adds and takes such columns."""
    return {str(line.name): line.conditions for line in table.lines}


def _free(program: Program, table: Table) -> Program:
    """Return a program with this table that has no invariants to rest on."""
    tables = (table if each.name == table.name else each for each in program.tables)
    return replace(program, invariants=(), tables=tuple(tables))


# --- a condition that is assumed ---------------------------------------------------------------

_NEW = "assumed_for_one_line"
"""What the condition is called in the text that is tried."""
_ASSUMING = re.compile(r"\s+assuming\s+")


def assuming(text: str, name: str, condition: str) -> str | None:
    """Return a text in which a table assumes a condition, too; None where the table is not found, or the name is taken."""
    table = table_of(text, name)
    if table is None or _NEW in text:
        return None
    past = table.headed
    more = _ASSUMING.match(text, past)
    listed = (past, past, f" assuming {_NEW}") if more is None else (more.end(), more.end(), f"{_NEW}, ")
    stated = (table.start, table.start, f"assume {_NEW} monitored : {condition}\n")
    return spliced(text, [stated, listed])


def _no_weaker(program: Program, table: Table) -> bool:
    """Return whether the table's assumptions allow every input that exactly one line matches."""
    universe = Universe()
    lines = lines_of(universe, table)
    assumed = Every(tuple(map(whole, assumptions_of(universe, program, table))))
    alone = (
        [whole(line), *(negated(universe, whole(other)) for other in lines if other is not line)]
        for line in lines
    )
    return all(find(universe, [*one, negated(universe, assumed)]) is NoWitness.NONE for one in alone)
