"""Runs a finding again on the generated executors, and logs it so that it can be stepped.

In: transition systems, a system's description, and a run as the interpreter did it. Out: executors of the levels in it, a log that
`rcsc replay` steps, and a check that the Python and the C executors leave in every cycle what the interpreter left.

If a program is not proved, or is a variant under another rule than the language's (`variants`), its executors are made by force:
by the same emitters, with every file marked (`host.files.write.UNPROVED`), so that no cell runs it (`run.executors`).
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rcsc.code.emit import emitted
from rcsc.code.emit.c.ctext import c_type, wide_type
from rcsc.code.emit.lower import lower, lower_by_force
from rcsc.code.testing.executors.sessions import same_value
from rcsc.compose.contract.environment import leaves_under
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.cycle_run import CycleRun
from rcsc.compose.counterexample.finding import Finding, rows
from rcsc.lang.interpret import Fault
from rcsc.lang.leaves import root_of
from rcsc.lang.model import Kind as VariableKind
from rcsc.lang.model import Program, spell
from rcsc.lang.project import project_root
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.run import answers
from rcsc.run.adopt import Begun, Restarted
from rcsc.run.buffers import CommonMemory
from rcsc.run.description import Description, LevelSpec, Wire
from rcsc.run.levels import RunningLevel, running_level
from rcsc.run.log.finding import LoggedCycle, LoggedFinding
from rcsc.run.system import Kind, System, executors, signatures

KINDS: tuple[Kind, ...] = ("python", "c")


class ExecutorsDifferError(Exception):
    """An executor differs from the interpreter: a bug in rcsc.

    Attributes:
        beside: Where the two differ, and the values that each left, a line each.
    """

    def __init__(self, beside: tuple[str, ...]) -> None:
        super().__init__(beside[0])
        self.beside = beside


# --- executors -----------------------------------------------------------------------------


def make(programs: Iterable[Program], folder: Path, *, altered: bool) -> tuple[str, ...]:
    """Write the executors of these programs; return the names of those made by force.

    Args:
        programs: The programs.
        folder: Where to write: `python/` and `c/` below it.
        altered: Whether the programs differ from their tables, so that all are made by force.

    Raises:
        OSError: The folder cannot be written.
    """
    forced = []
    for program in map(told_what_externs_give, programs):
        root = project_root(program.file)
        proved = None if altered else prove_program(program, Options()).proved
        plan = lower_by_force(program, root) if proved is None else lower(proved, root)
        if proved is None:
            forced.append(program.name)
        for name, text in emitted(plan).items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            code = text + "".join(_stand_ins(program)) if path.suffix == ".c" else text
            path.write_bytes(code.encode())
    return tuple(forced)


def told_what_externs_give(program: Program) -> Program:
    """Replace the program's extern procedures by stand-ins of `run.answers`: no finding calls the user's functions."""
    return replace(
        program,
        procedures=tuple(
            procedure
            if procedure.extern is None
            else replace(
                procedure,
                extern=replace(procedure.extern, python=f"{answers.MODULE}:{answers.OF}{procedure.name}"),
            )
            for procedure in program.procedures
        ),
    )


def _stand_ins(program: Program) -> Iterator[str]:
    """Write the stand-ins in C, after the program's own text."""
    externs = [procedure for procedure in program.procedures if procedure.extern is not None]
    if externs:
        yield answers.HEAD
    kinds = {str(v.name): c_type(v.type) for v in program.variables}
    for extern in externs:
        assert extern.extern is not None
        given = [kinds[name] for name in extern.reads] + [wide_type(each.type) for each in extern.params]
        yield answers.stand_in(
            extern.extern.c,
            [(kind, f"a{at}") for at, kind in enumerate(given)],
            [(kinds[name], f"r{at}") for at, name in enumerate(extern.writes)],
        )


def only_in_python(finding: Finding, systems: Mapping[str, TransitionSystem]) -> bool:
    """Return whether an extern procedure gives a result that no C function can: a refused value within C's own type."""
    for steps in finding.ticks:
        for name, step in steps.items():
            program = systems[name].program
            for procedure, given in step.answers:
                writes = next(
                    declared.writes for declared in program.procedures if declared.name == procedure
                )
                kinds = [c_type(program.variable(leaf).type) for leaf in writes]
                if not all(map(answers.fits, kinds, given)):
                    return True
    return False


# --- the run, again ------------------------------------------------------------------------


def record(
    finding: Finding,
    systems: Mapping[str, TransitionSystem],
    system: Description,
    path: Path | None,
    *,
    altered: bool = False,
) -> None:
    """Run a finding on the executors in `system.generated`, both kinds, and write the run as a log.

    Args:
        finding: The run.
        systems: The levels in it.
        system: Their system.
        path: Where the log goes; None for no log.
        altered: Whether the programs differ from their tables; the log says so.

    Raises:
        ExecutorsDifferError: They do something else than the interpreter did.
        NotBuilt: The C could not be built.
        OSError: The log cannot be written.
    """
    programs = {name: systems[name].program for name in finding.levels}
    alone = part_of(system, programs)
    for kind in () if only_in_python(finding, systems) else KINDS[1:]:
        deque(_cycles(finding, systems, _begun(finding, alone, kind), kind), maxlen=0)
    running = _begun(finding, alone, KINDS[0])
    cycles = _cycles(finding, systems, running, KINDS[0])
    if path is None:
        deque(cycles, maxlen=0)
        return
    from rcsc.run.log.recorder import Recorder

    with Recorder(running, path, _logged(finding, systems, altered)) as recorder:
        for ran in cycles:
            recorder(running, ran)


def _logged(finding: Finding, systems: Mapping[str, TransitionSystem], altered: bool) -> LoggedFinding:
    """Return the entries of the log about the finding, besides the states."""
    cycles = {
        (row.tick, row.level): LoggedCycle(
            finding.ticks[row.tick - 1][row.level].matched,
            row.wrong,
            finding.ticks[row.tick - 1][row.level].answers,
        )
        for row in rows(systems, finding)
    }
    return LoggedFinding(
        finding.level,
        finding.obligation.table,
        finding.obligation.shown,
        finding.broken_at,
        finding.restarted,
        finding.legal,
        altered,
        cycles,
    )


def part_of(system: Description, programs: Mapping[str, Program]) -> Description:
    """Restrict the description to these levels: each of their inputs comes through a buffer.

    Inputs that the database fills come from `database`, unknown ones from `environment`.
    """
    wires = [wire for wire in system.wires if _owner(wire.target) in programs]
    wires += [wire for wire in system.wires if _owner(wire.source) in programs and wire not in wires]
    levels = tuple(LevelSpec(spec.name, spec.program, ()) for spec in system.levels if spec.name in programs)
    for spec in system.levels:
        if spec.name in programs:
            fed = {feed.into for feed in spec.feeds}
            wired = {wire.target for wire in wires}
            for record in _inputs(programs[spec.name]):
                target = f"{spec.name}.{record}"
                if target not in wired:
                    wires.append(Wire(f"{'database' if record in fed else 'environment'}.{target}", target))
    return replace(system, levels=levels, wires=tuple(wires), displays={})


def _owner(end: str) -> str:
    return end.partition(".")[0]


def _inputs(program: Program) -> tuple[str, ...]:
    """List the input variables, records and arrays whole, in declared order."""
    names = (str(v.name) for v in program.variables if v.kind is VariableKind.INPUT)
    return tuple(dict.fromkeys(map(root_of, names)))


def _begun(finding: Finding, system: Description, kind: Kind) -> System:
    """Set up the levels where the run begins; `assemble` would refuse executors made by force."""
    signs = signatures(system)
    by_level = executors(system, signs, kind)
    levels = tuple(
        running_level(spec, system, signs[spec.name], by_level[spec.name], {}) for spec in system.levels
    )
    for level in levels:
        start = finding.start(level.name)
        level.put_back(
            (*(start[leaf.name] for leaf in level.sign.leaves), *level.values[len(level.sign.leaves) :])
        )
    return System(system, levels, (), CommonMemory())


def _cycles(
    finding: Finding, systems: Mapping[str, TransitionSystem], running: System, kind: Kind
) -> Iterator[tuple[RunningLevel, ...]]:
    """Run tick by tick; yield the levels that ran in each.

    Raises:
        ExecutorsDifferError: A level leaves something else than the interpreter left.
    """
    for tick, steps in enumerate(finding.ticks, 1):
        ran = tuple(level for level in running.levels if level.name in steps)
        running.restarts.clear()
        for level in ran:
            if steps[level.name].anew and tick > 1:
                _begin_anew(running, level, steps[level.name])
            _take(running, level, systems[level.name], steps[level.name])
            answers.told(level.executor, steps[level.name].answers)
            level.run()
            beside = tuple(_beside(level, steps[level.name], systems[level.name], kind, tick))
            if beside:
                raise ExecutorsDifferError(beside)
        running.tick = tick
        yield ran


def _begin_anew(running: System, level: RunningLevel, step: CycleRun) -> None:
    """Put a level into the state in which it begins anew within a run, before it takes anything."""
    count = len(level.sign.leaves)
    stands = tuple(step.before[leaf.name] for leaf in level.sign.leaves)
    level.put_back((*stands, *level.values[count:]))
    running.restarts.append(Restarted(level.name, Begun.ANEW, stands))


def _take(running: System, level: RunningLevel, ts: TransitionSystem, step: CycleRun) -> None:
    """Publish and take the environment's values of this cycle."""
    for wire in running.description.wires:
        owner, _, variable = wire.target.partition(".")
        if owner == level.name:
            leaves = leaves_under(ts.program, variable)
            running.buffers.publish(wire.source, tuple(step.taken[leaf] for leaf in leaves))
    level.take(running.buffers)


def _beside(
    level: RunningLevel, step: CycleRun, ts: TransitionSystem, kind: Kind, tick: int
) -> Iterator[str]:
    """Describe where the executor left other values than the interpreter."""
    who = "Python" if kind == "python" else "C"
    there = f"tick {tick}, level `{level.name}`"
    count = len(level.sign.leaves)
    for leaf, value in zip(level.sign.leaves, level.values[:count], strict=True):
        if not same_value(step.after[leaf.name], value):
            then = spell(ts.kinds[leaf.name], step.after[leaf.name])
            yield f"{there}: `{leaf.name}` = {then} by the interpreter, {leaf.shown(value)} by the {who} executor"
    expected = _spelled(step.line, step.fault, [name for name in level.sign.monitored if name in step.failed])
    did = _spelled(level.line, Fault(level.fault), level.sign.failures(level.values))
    if expected != did:
        yield f"{there}: {expected} by the interpreter, {did} by the {who} executor"


def _spelled(line: str, fault: Fault, failed: Sequence[str]) -> str:
    return f"line `{line}`, fault {fault.name.lower()}, failed: {' '.join(failed) or 'none'}"
