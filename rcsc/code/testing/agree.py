"""Interpreter, Python executor and C executor on the same inputs: line, fault, failed assumptions, state.

In: a program, its executors, sessions, or how many to draw. Out: the first disagreement of a session, and what was compared;
of drawn sessions, which are the same each time, the simplest disagreement. The complete state is compared after every cycle, and
each executor carries its own from cycle to cycle. Cycles in which assumptions fail are like others: no executor does anything
undefined in them.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from random import Random

from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.testing.executors.edges import may_be_matched
from rcsc.code.testing.executors.externs import begin
from rcsc.code.testing.executors.native import Native, NativeRun
from rcsc.code.testing.executors.python import PythonUnderTest
from rcsc.code.testing.executors.reference_file import all_lines, fault_named, monitored
from rcsc.code.testing.executors.sessions import Seen, Stimuli, differences
from rcsc.code.testing.executors.targets import ComparedFunction
from rcsc.code.testing.inputs import sampling
from rcsc.lang.interpret import Fault, Outcome, cycle, holds, initial, matching_lines, run_table
from rcsc.lang.model import LineName, Program, Snapshot, Table

NONE, SEVERAL = -1, -2
TOGETHER = 8
"""Snapshots that go through a matcher at once, of those drawn."""
WHOLE = 1
"""Mode in which each row sets every leaf; see `shim`."""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """An executor that does not do what the interpreter does.

    Attributes:
        executor: `Python` or `C`, or `C with sanitizers`.
        function: Name of the emitted function.
        cycle: Number of the cycle in the session, from 1.
    """

    executor: str
    function: str
    cycle: int
    session: Stimuli
    words: tuple[str, ...]


@dataclass(slots=True)
class AgreementCount:
    """What was compared so far.

    Attributes:
        lines: By table, how often each line was taken by a step or cycle that all executors agreed on.
        kept: Sessions that ran, with function and mode, for the sanitized program.
        matched: Snapshots that the matchers were given.
    """

    sessions: int = 0
    cycles: int = 0
    matches: int = 0
    faults: Counter[int] = field(default_factory=Counter)
    lines: dict[str, Counter[str]] = field(default_factory=dict)
    kept: list[tuple[int, int, Stimuli, list[Seen]]] = field(default_factory=list)
    matched: list[tuple[int, list[Snapshot]]] = field(default_factory=list)

    @property
    def replays(self) -> list[tuple[int, int, list[Snapshot]]]:
        """All of it again, for `code_mutants`: function, mode (see `shim`), rows."""
        matched = ((which, WHOLE, snapshots) for which, snapshots in self.matched)
        return [*self.sessions_again(), *matched]

    def sessions_again(self) -> list[tuple[int, int, list[Snapshot]]]:
        """The sessions alone."""
        return [(which, mode, rows_of(session)) for which, mode, session, _ in self.kept]


@dataclass(frozen=True, slots=True)
class Executors:
    """The executors of one program."""

    program: Program
    native: Native
    python: PythonUnderTest
    targets: tuple[ComparedFunction, ...]

    def number(self, target: ComparedFunction) -> int:
        """Number of the target's function in the shim; the reference's is one more."""
        return 2 * self.targets.index(target)


def interpreter(program: Program, target: ComparedFunction) -> Callable[[Snapshot], Outcome]:
    """The interpreter's meaning of a step or a cycle."""
    if target.kind == "step":
        table = program.tables[target.number]
        return lambda snapshot: run_table(program, table, snapshot)
    level = program.levels[target.number]
    return lambda snapshot: cycle(program, level, snapshot)


def seen_by_interpreter(outcome: Outcome) -> Seen:
    """An outcome in the common words."""
    took = outcome.fault in (Fault.OK, Fault.EXTERN) and outcome.line is not None
    line = outcome.line_index if took else NONE
    at = str(outcome.fault_at)
    failed = tuple(str(name) for name in outcome.failed_assumptions)
    return Seen(int(outcome.fault), at, line, failed, outcome.snapshot)


def seen_in_c(program: Program, native: Native, result: NativeRun) -> Seen:
    """A row of the C executor in the common words."""
    names = monitored(program)
    at = fault_named(program, native.symbols, result.fault, result.fault_at)
    line = result.line if result.fault in (Fault.OK, Fault.EXTERN) else NONE
    failed = tuple(names[number] for number in result.failed)
    return Seen(result.fault, at, line, failed, result.snapshot)


def rows_of(session: Stimuli) -> list[Snapshot]:
    """One row a cycle for the shim: the start with that cycle's readings."""
    return [{**session.start, **readings} for readings in session.readings]


def keeps_invariants(program: Program, start: Snapshot) -> bool:
    """Return whether it can be a state of the program as far as its invariants say."""
    return all(holds(invariant.condition, start) for invariant in program.invariants)


def run_session(
    executors: Executors, target: ComparedFunction, session: Stimuli, compared: AgreementCount
) -> Disagreement | None:
    """Runs one session in all executors.

    Args:
        executors: The program's executors.
        target: A step or a cycle.
        session: Start and readings; see `keeps_invariants`.
        compared: Counts what was compared.
    """
    program = executors.program
    meaning, state = interpreter(program, target), session.start
    mode = 2 * begin(program, session.start)
    in_c = executors.native.run(executors.number(target), mode, rows_of(session))
    in_python = executors.python.run(target, session)
    expected: list[Seen] = []
    for number, readings in enumerate(session.readings):
        right = seen_by_interpreter(meaning({**state, **readings}))
        expected.append(right)
        others = {"C": seen_in_c(program, executors.native, in_c[number]), "Python": in_python[number]}
        for name, seen in others.items():
            words = differences(program, right, seen)
            if words:
                return Disagreement(name, target.function, number + 1, session, words)
        state = right.snapshot
        _count(program, target, compared, right)
    compared.sessions += 1
    compared.kept.append((executors.number(target), mode, session, expected))
    return None


def run_init(executors: Executors, target: ComparedFunction) -> Disagreement | None:
    """Compares the initial states."""
    start = initial(executors.program)
    [row] = executors.native.run(executors.number(target), WHOLE, [start])
    for name, snapshot in (("C", row.snapshot), ("Python", executors.python.initial())):
        right, seen = (Seen(0, "", NONE, (), values) for values in (start, snapshot))
        words = differences(executors.program, right, seen)
        if words:
            return Disagreement(name, target.function, 1, Stimuli(start, ()), words)
    return None


def _count(program: Program, target: ComparedFunction, compared: AgreementCount, seen: Seen) -> None:
    compared.cycles += 1
    compared.faults[seen.fault] += 1
    if target.kind == "step" and seen.line >= 0:
        table = program.tables[target.number]
        name = all_lines(table)[seen.line][0]
        compared.lines.setdefault(table.name, Counter())[name] += 1


def line_number(table: Table, names: Sequence[LineName]) -> int:
    """What the emitted `line` function gives where these lines match."""
    if not names:
        return NONE if table.default is None else len(table.lines)
    if len(names) > 1:
        return SEVERAL
    return next(at for at, line in enumerate(table.lines) if line.name == names[0])


def run_lines(
    executors: Executors, target: ComparedFunction, snapshots: Sequence[Snapshot], compared: AgreementCount
) -> Disagreement | None:
    """Compares the matchers on snapshots in which the table may be matched; assumptions that only tell may fail."""
    table = executors.program.tables[target.number]
    snapshots = [snapshot for snapshot in snapshots if may_be_matched(executors.program, table, snapshot)]
    number = executors.number(target)
    in_c = executors.native.run(number, WHOLE, snapshots)
    reference = executors.native.run(number + 1, WHOLE, snapshots)
    for snapshot, row, plain in zip(snapshots, in_c, reference, strict=True):
        right = line_number(table, matching_lines(table, snapshot))
        others = {
            "C": row.result,
            "C reference": plain.result,
            "Python": executors.python.line(target, snapshot),
        }
        for name, seen in others.items():
            if seen != right:
                words = (f"line {seen} where {right} is right",)
                return Disagreement(name, target.function, 1, Stimuli(snapshot, ()), words)
        compared.matches += 1
    compared.matched.append((number, list(snapshots)))
    return None


def run_sanitized(
    executors: Executors, compared: AgreementCount
) -> Disagreement | BuildFailed | Absent | None:
    """All sessions again in the program with sanitizers, which stop it at the first finding."""
    results = executors.native.run_checked(compared.sessions_again())
    if not isinstance(results, list):
        return results
    for (which, _, session, expected), rows in zip(compared.kept, results, strict=True):
        for at, (right, row) in enumerate(zip(expected, rows, strict=True)):
            seen = seen_in_c(executors.program, executors.native, row)
            words = differences(executors.program, right, seen)
            if words:
                function = executors.targets[which // 2].function
                return Disagreement("C with sanitizers", function, at + 1, session, words)
    return None


# --- drawn inputs ---


def search_sessions(
    executors: Executors,
    target: ComparedFunction,
    compared: AgreementCount,
    examples: int,
    most_cycles: int = 8,
) -> Disagreement | None:
    """Run drawn sessions of a step or a cycle until the executors disagree.

    Args:
        executors: The program's executors.
        target: The step or cycle.
        compared: Counts what was compared.
        examples: How many sessions.
        most_cycles: Longest session.
    """
    program = executors.program
    known, table = sampling.declarations(program), _aimed_at(program, target)

    def begins(start: Snapshot) -> bool:
        return keeps_invariants(program, start)

    def differs(stimuli: Stimuli) -> Disagreement | None:
        return run_session(executors, target, stimuli, compared) if begins(stimuli.start) else None

    random = Random(target.function)  # noqa: S311  # repeatable on purpose
    drawn = sampling.sessions(known, lambda: table, most_cycles, random, examples, begins)
    ran = (run_session(executors, target, stimuli, compared) for stimuli in drawn)
    found = next(filter(None, ran), None)
    return found and _simplest(program, found, differs)


def search_lines(
    executors: Executors, target: ComparedFunction, compared: AgreementCount, examples: int
) -> Disagreement | None:
    """Run drawn snapshots through a matcher, some at a time, until the executors disagree."""
    program = executors.program
    known, table = sampling.declarations(program), _aimed_at(program, target)
    random = Random(target.function)  # noqa: S311  # repeatable on purpose
    for _ in range(max(1, examples // TOGETHER)):
        drawn = [sampling.snapshot(known, table, random) for _ in range(TOGETHER)]
        if found := run_lines(executors, target, drawn, compared):
            return _simplest(program, found, lambda one: run_lines(executors, target, [one.start], compared))
    return None


def _aimed_at(program: Program, target: ComparedFunction) -> Table:
    """Return the table whose lines the inputs should aim at."""
    if target.kind != "cycle":
        return program.tables[target.number]
    return program.table(program.levels[target.number].tables.names[0])


def _simplest(
    program: Program, disagreement: Disagreement, differs: Callable[[Stimuli], Disagreement | None]
) -> Disagreement:
    """Return the disagreement shrunk step by step to few cycles and few values that are not initial."""
    for stimuli in _shorter(disagreement):
        disagreement = differs(stimuli) or disagreement
    for name, value in initial(program).items():
        session = disagreement.session
        readings = tuple({**r, name: value} if name in r else r for r in session.readings)
        disagreement = differs(Stimuli({**session.start, name: value}, readings)) or disagreement
    return disagreement


def _shorter(disagreement: Disagreement) -> Iterator[Stimuli]:
    """Yield the session cut after the cycle that differs, then its last cycles alone."""
    start, kept = disagreement.session.start, disagreement.session.readings[: disagreement.cycle]
    yield Stimuli(start, kept)
    for count in (4, 2, 1):
        if count < len(kept):
            yield Stimuli(start, kept[-count:])
