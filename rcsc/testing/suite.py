"""The whole suite on one screen: what `rcsc test` runs on a program and what was generated from it.

In: a program, its generated files, the prover and its solver as functions. Out: figures and diagnostics. What
could not be checked is said in the figures; a missing tool is never a pass.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from random import Random

from rcsc.diagnostics.codes import Code
from rcsc.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.model import Line, Program, Table
from rcsc.source import Span
from rcsc.testing.agree import (
    Compared,
    Disagreement,
    Executors,
    keeps_invariants,
    run_lines,
    run_sanitized,
    run_session,
    within,
)
from rcsc.testing.cortex import run_cortex
from rcsc.testing.esbmc import EsbmcVerdict, Said, prove_function
from rcsc.testing.figures import ProgramFigures, SuiteResult, TableFigures, tally
from rcsc.testing.matcher import check_matcher
from rcsc.testing.mutants import Caught, Prover, judge_table
from rcsc.testing.native import Native, build
from rcsc.testing.python_executor import python_executor
from rcsc.testing.reference_file import all_lines, inputs
from rcsc.testing.search import Solver, search_in
from rcsc.testing.sessions import Session, described
from rcsc.testing.symbols import Symbols, symbols_of
from rcsc.testing.targets import Target, targets
from rcsc.testing.tools import Absent, BuildFailed
from rcsc.testing.vectors import Vectors, vectors_of

LARGE = 128  # lines; of a larger table so many, by seed, are given vectors in an ordinary run
MOST_ESBMC_LINES = 64


@dataclass(frozen=True, slots=True)
class SuiteOptions:
    """How much is tried.

    Attributes:
        examples: Inputs for each matcher, and sequences for each step and cycle.
        cycles: Longest sequence.
        esbmc_s: Time limit of ESBMC for one function, in seconds; 0 leaves it out.
        cortex: Whether the emulated target is asked.
        mutants: How many mutants of each table and of its code are tried; None for all, 0 for none.
        seed: Of every sample.
        progress: Told what is being done.
    """

    examples: int = 200
    cycles: int = 8
    esbmc_s: float = 60.0
    cortex: bool = True
    mutants: int | None = 24
    seed: int = 1984
    progress: Callable[[str], None] = field(default=lambda _: None)


@dataclass(frozen=True, slots=True)
class Proofs:
    """The prover, as far as the suite needs it; the suite imports no solver."""

    prover: Prover | None = None
    solver: Solver | None = None


def _place(program: Program, table: Table | None = None) -> Label:
    return Label(Span(program.file, 0, 0) if table is None else table.span)


def _disagreement(program: Program, found: Disagreement, table: Table | None) -> Diagnostic:
    message = (
        f"the {found.executor} executor's `{found.function}` differs from the tables in cycle {found.cycle}"
    )
    notes = (*found.words, *described(program, found.session))
    return Diagnostic(Code.EXECUTORS_DISAGREE, message, _place(program, table), notes=notes)


def _samples(table: Table, options: SuiteOptions) -> list[Line] | None:
    """The lines that vectors are made for: None for all of them."""
    if len(table.lines) <= LARGE:
        return None
    return Random(options.seed).sample(list(table.lines), LARGE)  # noqa: S311  # a repeatable sample


@dataclass(slots=True)
class Suite:
    """One run over one program."""

    program: Program
    symbols: Symbols
    files: Mapping[str, str]
    options: SuiteOptions
    proofs: Proofs
    executors: Executors
    compared: Compared = field(default_factory=Compared)
    found: list[Diagnostic] = field(default_factory=list)

    def table(self, target: Target) -> Table | None:
        """The table of a matcher or step."""
        return None if target.kind == "cycle" else self.program.tables[target.number]

    def note(self, disagreement: Disagreement | None, target: Target) -> None:
        """Keeps a disagreement as a diagnostic."""
        if disagreement is not None:
            self.found.append(_disagreement(self.program, disagreement, self.table(target)))

    def agreement(self, vectors: Mapping[str, Vectors]) -> None:
        """Vectors, drawn snapshots and drawn sessions in every executor."""
        from rcsc.testing.hunt import hunt_lines, hunt_sessions

        for target in self.executors.targets:
            self.options.progress(f"running {target.function}")
            table = self.table(target)
            snapshots = [] if table is None else [v.snapshot for v in vectors[table.name].vectors]
            if target.kind == "line":
                found = run_lines(self.executors, target, snapshots, self.compared)
                found = found or hunt_lines(self.executors, target, self.compared, self.options.examples)
            else:
                found = next(filter(None, (self.one_step(target, s) for s in snapshots)), None)
                examples, cycles = self.options.examples, self.options.cycles
                found = found or hunt_sessions(self.executors, target, self.compared, examples, cycles)
            self.note(found, target)

    def one_step(self, target: Target, snapshot: Mapping[str, bool | int | float]) -> Disagreement | None:
        """One step from a vector."""
        readings = {str(v.name): snapshot[v.name] for v in inputs(self.program)}
        session = within(self.executors, target, Session(snapshot, (readings,)))
        if not session.readings or not keeps_invariants(self.program, session):
            return None
        return run_session(self.executors, target, session, self.compared)

    def sanitized(self) -> str:
        """The sessions under the sanitizers."""
        made = run_sanitized(self.executors, self.compared)
        if isinstance(made, Absent):
            return f"not run: {made.reason}"
        if isinstance(made, BuildFailed):
            message = f"the C executor of `{self.program.name}` stopped under the sanitizers"
            notes = tuple(made.text.splitlines())
            self.found.append(Diagnostic(Code.EXECUTORS_DISAGREE, message, _place(self.program), notes=notes))
            return "stopped"
        if made is not None:
            self.found.append(_disagreement(self.program, made, None))
            return "differs"
        return f"the same {len(self.compared.kept)} sequences, no finding of AddressSanitizer or UBSan"

    def reached(self, table: Table, vectors: Vectors) -> int:
        """Reports lines that no step took."""
        taken = self.compared.lines.get(table.name, {})
        spans = {str(line.name): line.span for line in table.lines}
        named = [name for name, _ in all_lines(table)]
        reasons = {u.line: u.reason for u in vectors.unshown if not u.condition}
        looked_at = {v.line for v in vectors.vectors} | set(reasons)
        for name in named:
            dead = name in reasons and reasons[name] != "not found"
            if taken.get(name, 0) or dead or name not in looked_at:
                continue
            label = Label(spans.get(name, table.default.span if table.default else table.span))
            message = f"no step of the tests took line `{name}` of table `{table.name}`"
            self.found.append(Diagnostic(Code.LINE_NOT_REACHED, message, label))
        return sum(1 for name in named if taken.get(name, 0))

    def matcher(self, table: Table) -> int:
        """The complete per-variable check of the emitted masks."""
        checked = check_matcher(self.program, self.symbols, self.files, table)
        if isinstance(checked, int):
            return checked
        message = f"the C matcher of table `{table.name}` is not the table"
        self.found.append(
            Diagnostic(Code.MATCHER_DIFFERS, message, _place(self.program, table), notes=checked)
        )
        return 0

    def esbmc(self) -> Iterator[EsbmcVerdict]:
        """ESBMC on every function of a table that is not too large for it."""
        for target in self.executors.targets if self.options.esbmc_s else ():
            self.options.progress(f"proving {target.function} with ESBMC")
            table = self.table(target)
            if (
                max((len(t.lines) for t in ([table] if table else self.program.tables)), default=0)
                > MOST_ESBMC_LINES
            ):
                reason = "complete per-variable check used"
                yield EsbmcVerdict(target.function, Said.TOO_LARGE, 0, 0.0, reason)
                continue
            verdict = prove_function(self.program, self.symbols, self.files, target, self.options.esbmc_s)
            if verdict.said in (Said.REFUTED, Said.FAILED):
                message = f"ESBMC does not prove the C function `{target.function}` equal to the table"
                notes = (f"{verdict.said}: {verdict.detail}",)
                self.found.append(
                    Diagnostic(Code.MATCHER_DIFFERS, message, _place(self.program, table), notes=notes)
                )
            yield verdict

    def figures(self, number: int, table: Table, vectors: Vectors) -> TableFigures:
        """What is checked table by table."""
        from rcsc.testing.code_mutants import judge_code

        self.options.progress(f"testing table {table.name}")
        impossible = sum(1 for u in vectors.unshown if u.condition and u.reason != "not found")
        cortex = (
            run_cortex(self.program, self.symbols, self.files, number) if self.options.cortex else "not asked"
        )
        if isinstance(cortex, BuildFailed) or (not isinstance(cortex, str | Absent) and cortex.differ):
            message = f"the C executor of table `{table.name}` differs from it on the emulated Cortex-M3"
            notes = (
                tuple(cortex.text.splitlines())
                if isinstance(cortex, BuildFailed)
                else (f"{cortex.differ} differ",)
            )
            self.found.append(
                Diagnostic(Code.MATCHER_DIFFERS, message, _place(self.program, table), notes=notes)
            )
        said = (
            cortex.reason
            if isinstance(cortex, Absent)
            else "failed"
            if isinstance(cortex, BuildFailed)
            else cortex
        )
        mutants: dict[str, int] = {}
        code: dict[str, int] = {}
        if self.options.mutants != 0:
            code = judge_code(self.executors, self.files, number, self.options.mutants, self.options.seed)
            if self.proofs.prover is not None:
                search = search_in(self.program, self.proofs.solver)
                judged = judge_table(
                    search, table, self.proofs.prover, self.options.mutants, self.options.seed
                )
                mutants = tally([one.caught.value for one in judged])
        self.survivors(table, mutants, code)
        cells, reached = self.matcher(table), self.reached(table, vectors)
        return TableFigures(
            table.name, len(all_lines(table)), reached, vectors.conditions, vectors.shown, impossible, cells,
            mutants, code, said,
        )  # fmt: skip

    def survivors(self, table: Table, *counts: Mapping[str, int]) -> None:
        """A mutant that nobody notices is a hole in the tests."""
        alive = sum(count.get(Caught.SURVIVED.value, 0) for count in counts)
        if alive:
            message = f"{alive} mutants of table `{table.name}` are noticed by nobody"
            self.found.append(Diagnostic(Code.MATCHER_DIFFERS, message, _place(self.program, table)))

    def run(self) -> ProgramFigures:
        """Everything, in order."""
        search = search_in(self.program, self.proofs.solver)
        vectors = {t.name: vectors_of(search, t, _samples(t, self.options)) for t in self.program.tables}
        self.agreement(vectors)
        sanitized = self.sanitized()
        tables = tuple(self.figures(at, t, vectors[t.name]) for at, t in enumerate(self.program.tables))
        compared = self.compared
        return ProgramFigures(
            self.program.name, tables, compared.sessions, compared.cycles, compared.matches,
            dict(compared.faults), sanitized, tuple(self.esbmc()),
        )  # fmt: skip


def run_suite(
    program: Program,
    files: Mapping[str, str],
    options: SuiteOptions | None = None,
    proofs: Proofs | None = None,
) -> SuiteResult:
    """Tests one program's generated code.

    Args:
        program: A proved program.
        files: Its generated files, text by path; C, Python and the symbol file.
        options: How much is tried.
        proofs: The prover and its solver; without them table mutants are left out, and conditions over
            several variables may stay without a vector.
    """
    symbols = symbols_of(program, files)
    native = build(program, symbols, files)
    if isinstance(native, Absent):
        return SuiteResult((), (Diagnostic(Code.NO_C_COMPILER, native.reason, _place(program)),))
    if isinstance(native, BuildFailed):
        message = f"the C generated from `{program.name}` does not compile"
        found = Diagnostic(
            Code.EXECUTORS_DISAGREE, message, _place(program), notes=tuple(native.text.splitlines())
        )
        return SuiteResult((), (found,))
    with native:
        return _run(program, files, options or SuiteOptions(), proofs or Proofs(), native)


def _run(
    program: Program, files: Mapping[str, str], options: SuiteOptions, proofs: Proofs, native: Native
) -> SuiteResult:
    python = python_executor(program, native.symbols, files)
    executors = Executors(program, native, python, tuple(targets(program, native.symbols)))
    suite = Suite(program, native.symbols, files, options, proofs, executors)
    figures = suite.run()
    return SuiteResult((figures,), tuple(sorted(suite.found, key=sort_key)))
