"""What a run of the suite counted, and its text.

In: counts. Out: frozen figures, and their text; what was not tested is always noted.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.code.testing.cortex import CortexRun
from rcsc.code.testing.esbmc import EsbmcAnswer, EsbmcVerdict


@dataclass(frozen=True, slots=True)
class TableFigures:
    """One table.

    Attributes:
        lines: How many lines it has, DEFAULT counted.
        reached: How many of them a step took.
        conditions: Conditions of its lines (of those looked at, in a large table).
        shown: Conditions shown to decide their line on their own.
        impossible: Conditions for which that is shown impossible within ranges and assumptions.
        cells: Cells of the matcher compared with the table; 0 where it was not done.
        unmatched: Lines that no input was found for: their classes of values were not tried.
        mutants: Mutants of the table by who caught them.
        cortex: The emulated target's answer, or why it was not asked.
    """

    table: str
    lines: int
    reached: int
    conditions: int = 0
    shown: int = 0
    impossible: int = 0
    cells: int = 0
    unmatched: tuple[str, ...] = ()
    mutants: Mapping[str, int] = field(default_factory=dict, hash=False)
    cortex: CortexRun | str = ""


@dataclass(frozen=True, slots=True)
class ProgramFigures:
    """One program.

    Attributes:
        sessions: Sequences of cycles run in interpreter, Python and C.
        cycles: Cycles in them; the complete state was compared after each.
        matches: Snapshots on which the matchers were compared.
        faults: Cycles by fault code.
        sanitized: How the sessions went under the sanitizers, in words.
        esbmc: A verdict a function.
        code_mutants: Mutants of the emitted C, of its masks and of the rest, by who noticed them.
    """

    program: str
    tables: tuple[TableFigures, ...]
    sessions: int
    cycles: int
    matches: int
    faults: Mapping[int, int] = field(default_factory=dict, hash=False)
    sanitized: str = ""
    esbmc: tuple[EsbmcVerdict, ...] = ()
    code_mutants: Mapping[str, Mapping[str, int]] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """The result of `rcsc test`."""

    programs: tuple[ProgramFigures, ...]
    diagnostics: tuple[Diagnostic, ...]

    @property
    def failed(self) -> bool:
        """Whether there is an error."""
        return any(diagnostic.severity is Severity.ERROR for diagnostic in self.diagnostics)

    def text(self) -> str:
        """The figures for people, program by program."""
        return "\n".join(line for program in self.programs for line in _program_text(program))


def counted(number: int, noun: str) -> str:
    """`1 line`, `2 lines`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _program_text(program: ProgramFigures) -> Iterator[str]:
    yield f"{program.program}:"
    faults = sum(count for fault, count in program.faults.items() if fault != 0)
    yield (
        f"  interpreter = Python = C: {counted(program.matches, 'match').replace('matchs', 'matches')}, "
        f"{counted(program.sessions, 'sequence')} of {counted(program.cycles, 'cycle')}, "
        f"{faults} with a fault"
    )
    yield f"  sanitizers: {program.sanitized}"
    for verdict in program.esbmc:
        shown = f", {verdict.properties} properties" if verdict.answer is EsbmcAnswer.PROVED else ""
        detail = f": {verdict.detail}" if verdict.detail else ""
        yield f"  ESBMC {verdict.function}: {verdict.answer}{shown} ({verdict.seconds:.1f} s){detail}"
    for table in program.tables:
        yield from _table_text(table)
    for name, mutants in program.code_mutants.items():
        yield f"  {_mutants_text(name, mutants)}"


def _table_text(table: TableFigures) -> Iterator[str]:
    yield f"  table {table.table}: {table.reached} of {counted(table.lines, 'line')} reached"
    open_ = table.conditions - table.shown - table.impossible
    yield (
        f"    MC/DC: {table.shown} of {counted(table.conditions, 'condition')} shown, "
        f"{table.impossible} impossible, {open_} not found"
    )
    if table.cells:
        how = f"no input found for {', '.join(table.unmatched)}" if table.unmatched else "complete"
        yield f"    matcher = table: {counted(table.cells, 'cell')} compared, {how}"
    if isinstance(table.cortex, CortexRun):
        run = table.cortex
        whole = "all " if run.complete else ""
        yield f"    Cortex-M3: {whole}{run.inputs} inputs and {run.steps} steps, {run.differ} differ"
    elif table.cortex:
        yield f"    Cortex-M3: {table.cortex}"
    if table.mutants:
        yield f"    {_mutants_text('mutants of the table', table.mutants)}"


def _mutants_text(name: str, mutants: Mapping[str, int]) -> str:
    parts = ", ".join(f"{count} {caught}" for caught, count in sorted(mutants.items()))
    return f"{name}: {sum(mutants.values())}: {parts}"


def tally(caught: list[str]) -> dict[str, int]:
    """Counts by name, sorted."""
    return dict(sorted(Counter(caught).items()))
