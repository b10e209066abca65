"""The whole suite on one screen: what `rcsc test` runs on a program and what was generated from it.

In: a program, its generated files, the prover and its solver as functions. Out: figures and diagnostics. What
could not be checked is noted in the figures; a missing tool is never a pass.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label, sort_key
from rcsc.base.diagnostics.source import Span
from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.testing.agree import (
    AgreementCount,
    Disagreement,
    Executors,
    keeps_invariants,
    run_init,
    run_lines,
    run_sanitized,
    run_session,
    search_lines,
    search_sessions,
)
from rcsc.code.testing.code_mutants import Noticed, judge_code, portable_agrees
from rcsc.code.testing.cortex import MOST_INPUTS, CortexRun, run_cortex
from rcsc.code.testing.esbmc import EsbmcAnswer, EsbmcVerdict, prove_function, too_large
from rcsc.code.testing.executors.externs import PythonStandIns, python_stand_ins, with_c_stand_ins
from rcsc.code.testing.executors.native import Native, build
from rcsc.code.testing.executors.python import python_executor
from rcsc.code.testing.executors.reference_file import all_lines, inputs
from rcsc.code.testing.executors.sessions import Stimuli, described
from rcsc.code.testing.executors.symbols import Symbols, symbols_of
from rcsc.code.testing.executors.targets import ComparedFunction, is_matcher, targets
from rcsc.code.testing.figures import ProgramFigures, SuiteResult, TableFigures, counted, tally
from rcsc.code.testing.inputs.snapshot import Solver, search_in
from rcsc.code.testing.inputs.vectors import Vectors, vectors_of
from rcsc.code.testing.matcher import Checked, MatcherCheck
from rcsc.code.testing.mutants import Caught, Prover, judge_table
from rcsc.lang.model import Line, Program, Snapshot, Table

QUICK_CORTEX = 1 << 14  # inputs of a table that the emulated target is given in an ordinary run
LARGE = 128  # lines; of a larger table so many, by seed, are given vectors in an ordinary run
MOST_SHOWN = 5


@dataclass(frozen=True, slots=True)
class SuiteOptions:
    """How much is tried.

    Attributes:
        examples: Inputs for each matcher, and sequences for each step and cycle.
        cycles: Longest sequence.
        deep: Whether mutants of the C are made too, and the target is asked about as many inputs as it can.
        esbmc_s: Time limit of ESBMC for one function, in seconds; 0 leaves it out.
        cortex: Whether the emulated target is asked.
        mutants: How many mutants of each table (and of the C, where `deep`) are tried; None for all, 0 for none.
        seed: Seed of every sample.
        progress: Told what is being done.
    """

    examples: int = 200
    cycles: int = 8
    deep: bool = False
    esbmc_s: float = 0.0
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


def _disagreement(program: Program, disagreement: Disagreement, table: Table | None) -> Diagnostic:
    message = f"the {disagreement.executor} executor's `{disagreement.function}` differs from the tables in cycle {disagreement.cycle}"
    notes = (*disagreement.words, *described(program, disagreement.session))
    return Diagnostic(Code.EXECUTORS_DISAGREE, message, _place(program, table), notes=notes)


def _failed(program: Program, message: str, build: BuildFailed) -> Diagnostic:
    notes = tuple(build.text.splitlines())
    return Diagnostic(Code.EXECUTORS_DISAGREE, message, _place(program), notes=notes)


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
    compared: AgreementCount = field(default_factory=AgreementCount)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    known: dict[str, list[Snapshot]] = field(default_factory=dict)
    """By table, inputs that match its lines."""

    def table(self, target: ComparedFunction) -> Table | None:
        """The table of a matcher or step."""
        return None if target.kind in ("cycle", "init") else self.program.tables[target.number]

    def agreement(self) -> None:
        """Vectors, drawn snapshots and drawn sessions in every executor."""
        for target in self.executors.targets:
            self.options.progress(f"running {target.function}")
            table = self.table(target)
            snapshots = [] if table is None else self.known[table.name]
            if target.kind == "init":
                disagreement = run_init(self.executors, target)
            elif is_matcher(target):
                disagreement = self.lines(target, snapshots)
            else:
                disagreement = self.steps(target, snapshots)
            if disagreement is not None:
                self.diagnostics.append(_disagreement(self.program, disagreement, table))

    def lines(self, target: ComparedFunction, snapshots: Sequence[Snapshot]) -> Disagreement | None:
        """A matcher on the vectors and on drawn snapshots."""
        disagreement = run_lines(self.executors, target, snapshots, self.compared)
        return disagreement or search_lines(self.executors, target, self.compared, self.options.examples)

    def steps(self, target: ComparedFunction, snapshots: Sequence[Snapshot]) -> Disagreement | None:
        """A step from the vectors, a step or cycle in drawn sessions."""
        disagreement = next(filter(None, (self.one_step(target, snapshot) for snapshot in snapshots)), None)
        options = self.options
        return disagreement or search_sessions(
            self.executors, target, self.compared, options.examples, options.cycles
        )

    def one_step(self, target: ComparedFunction, snapshot: Snapshot) -> Disagreement | None:
        """One step from a vector."""
        readings = {str(v.name): snapshot[v.name] for v in inputs(self.program)}
        if not keeps_invariants(self.program, snapshot):
            return None
        return run_session(self.executors, target, Stimuli(snapshot, (readings,)), self.compared)

    def sanitized(self) -> str:
        """The sessions under the sanitizers."""
        result = run_sanitized(self.executors, self.compared)
        if isinstance(result, Absent):
            return f"not run: {result.reason}"
        if isinstance(result, BuildFailed):
            message = f"the C executor of `{self.program.name}` stopped under the sanitizers"
            self.diagnostics.append(_failed(self.program, message, result))
            return "stopped"
        if result is not None:
            self.diagnostics.append(_disagreement(self.program, result, None))
            return "differs"
        return f"the same {len(self.compared.kept)} sequences, no finding of AddressSanitizer or UBSan"

    def reached(self, table: Table, vectors: Vectors) -> int:
        """Report lines that no step took though an input takes them; return how many were taken."""
        taken: Mapping[str, int] = self.compared.lines.get(table.name, {})
        spans = {str(line.name): line.span for line in table.lines}
        looked_at = {v.line for v in vectors.vectors if v.purpose == "reach" and v.expected == v.line}
        named = [name for name, _ in all_lines(table)]
        differ = any(found.code is Code.EXECUTORS_DISAGREE for found in self.diagnostics)
        for name in named if not differ else ():  # where executors differ, they are not followed further
            if name in looked_at and not taken.get(name, 0):
                label = Label(spans.get(name, table.default.span if table.default else table.span))
                message = f"no step of the tests took line `{name}` of table `{table.name}`"
                self.diagnostics.append(Diagnostic(Code.LINE_NOT_REACHED, message, label))
        return sum(1 for name in named if taken.get(name, 0))

    def differs(self, message: str, table: Table | None, notes: Sequence[str]) -> None:
        """Report that the C differs from the table."""
        place = _place(self.program, table)
        self.diagnostics.append(Diagnostic(Code.MATCHER_DIFFERS, message, place, notes=tuple(notes)))

    def matcher(self, table: Table) -> Checked | None:
        """Compare the masks of the C with the table, and the lines that the C finds."""
        self.options.progress(f"comparing the masks of table {table.name}")
        checked = MatcherCheck(self.program, self.symbols, table, self.known[table.name]).of(self.files)
        if isinstance(checked, tuple):
            self.differs(f"the C matcher of table `{table.name}` is not the table", table, checked)
            return None
        return None if isinstance(checked, Absent) else checked

    def esbmc(self) -> Iterator[EsbmcVerdict]:
        """ESBMC on every function of a table that is not too large for it."""
        for target in self.executors.targets if self.options.esbmc_s else ():
            self.options.progress(f"proving {target.function} with ESBMC")
            if too_large(self.program, target):
                reason = "complete per-variable check used"
                yield EsbmcVerdict(target.function, EsbmcAnswer.TOO_LARGE, 0, 0.0, reason)
                continue
            verdict = prove_function(self.program, self.symbols, self.files, target, self.options.esbmc_s)
            if verdict.answer is EsbmcAnswer.REFUTED:
                message = f"ESBMC refutes that the C function `{target.function}` equals the tables"
                self.differs(message, self.table(target), (verdict.detail,))
            yield verdict

    def cortex(self, number: int, table: Table) -> CortexRun | str:
        """What the emulated target says, or why it was not asked."""
        if not self.options.cortex:
            return "not asked"
        most = MOST_INPUTS if self.options.deep else QUICK_CORTEX
        self.options.progress(f"running table {table.name} on the emulated Cortex-M3")
        ran = run_cortex(self.program, self.symbols, self.files, number, most)
        if isinstance(ran, Absent):
            return ran.reason
        if isinstance(ran, BuildFailed) or ran.differ:
            notes = ran.text.splitlines() if isinstance(ran, BuildFailed) else [f"{ran.differ} differ"]
            message = f"the C executor of table `{table.name}` differs from it on the emulated Cortex-M3"
            self.differs(message, table, notes)
        return "failed" if isinstance(ran, BuildFailed) else ran

    def mutants(self, table: Table) -> dict[str, int]:
        """Mutants of a table, by who caught them."""
        if self.options.mutants == 0 or self.proofs.prover is None:
            return {}
        self.options.progress(f"mutating table {table.name}")
        search = search_in(self.program, self.proofs.solver)
        judged = judge_table(search, table, self.proofs.prover, self.options.mutants, self.options.seed)
        alive = [mutant for mutant in judged if mutant.caught is Caught.SURVIVED]
        if alive:
            message = (
                f"{counted(len(alive), 'mutant')} of table `{table.name}` told apart by the search alone"
            )
            self.differs(
                message, table, [f"{mutant.change}: {mutant.where}" for mutant in alive[:MOST_SHOWN]]
            )
        return tally([mutant.caught.value for mutant in judged])

    def code_mutants(self) -> Iterator[tuple[str, dict[str, int]]]:
        """Mutants of the emitted C, by who noticed them: of the masks, and of the rest."""
        if self.options.mutants == 0 or not self.options.deep:
            return
        self.options.progress(f"mutating the C of {self.program.name}")
        native, replays = self.executors.native, self.compared.replays
        if not portable_agrees(native, self.files, replays):
            message = f"the C of `{self.program.name}` does something else without compiler built-ins"
            self.differs(message, None, ())
        options = self.options
        judged = judge_code(
            native, self.files, replays, self.known, options.mutants, options.esbmc_s, options.progress
        )
        missed = [mutant for mutant, noticed in judged if noticed is Noticed.MISSED]
        if missed:
            message = f"the check of the masks of `{self.program.name}` calls equal what the tests tell apart"
            self.differs(message, None, [mutant.where for mutant in missed[:MOST_SHOWN]])
        for name, masks in (("mutants of the masks", True), ("mutants of the C", False)):
            noticed_by = [noticed.value for mutant, noticed in judged if (mutant.change == "mask") is masks]
            if noticed_by:
                yield name, tally(noticed_by)

    def figures(self, number: int, table: Table, vectors: Vectors) -> TableFigures:
        """What is checked table by table."""
        checked = self.matcher(table)
        return TableFigures(
            table.name,
            len(all_lines(table)),
            self.reached(table, vectors),
            vectors.conditions,
            vectors.shown,
            sum(1 for u in vectors.unshown if u.condition and u.reason != "not found"),
            checked.cells if checked else 0,
            checked.unmatched if checked else (),
            self.mutants(table),
            self.cortex(number, table),
        )

    def run(self) -> ProgramFigures:
        """Everything, in order."""
        search = search_in(self.program, self.proofs.solver)
        tables = self.program.tables
        vectors = {str(t.name): vectors_of(search, t, _samples(t, self.options)) for t in tables}
        self.known = {name: [v.snapshot for v in some.vectors] for name, some in vectors.items()}
        self.agreement()
        return ProgramFigures(
            self.program.name,
            tuple(self.figures(at, table, vectors[table.name]) for at, table in enumerate(tables)),
            self.compared.sessions,
            self.compared.cycles,
            self.compared.matches,
            dict(self.compared.faults),
            self.sanitized(),
            tuple(self.esbmc()),
            dict(self.code_mutants()),
        )


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
    with python_stand_ins(program) as stand_ins:
        symbols = symbols_of(program, files)
        tested = with_c_stand_ins(program, stand_ins.program, symbols, files)
        native = build(stand_ins.program, symbols, tested)
        if isinstance(native, Native):
            with native:
                return _run(stand_ins, tested, options or SuiteOptions(), proofs or Proofs(), native)
    if isinstance(native, Absent):
        return SuiteResult((), (Diagnostic(Code.NO_C_COMPILER, native.reason, _place(program)),))
    message = f"the C generated from `{program.name}` does not compile"
    return SuiteResult((), (_failed(program, message, native),))


def _run(
    stand_ins: PythonStandIns, files: Mapping[str, str], options: SuiteOptions, proofs: Proofs, native: Native
) -> SuiteResult:
    program = stand_ins.program
    python = python_executor(program, native.symbols, files, stand_ins)
    executors = Executors(program, native, python, tuple(targets(program, native.symbols)))
    suite = Suite(program, native.symbols, files, options, proofs, executors)
    figures = suite.run()
    return SuiteResult((figures,), tuple(sorted(suite.diagnostics, key=sort_key)))
