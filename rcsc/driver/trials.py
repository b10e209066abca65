"""`rcsc test`: the suite of tests over every proved program, and vectors for users.

In: proved programs and their generated files. Out: what the suite found, and its figures as text.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Label
from rcsc.base.diagnostics.source import Span
from rcsc.base.host import children
from rcsc.base.host.cache import open_cache
from rcsc.base.host.files import write_atomically
from rcsc.code.emit import TARGETS, emitted
from rcsc.code.emit.generated import write
from rcsc.code.testing.apart import Ended, apart
from rcsc.code.testing.coverage.document import VectorSet
from rcsc.code.testing.coverage.vector_set import figure, vector_set, write_vectors
from rcsc.code.testing.inputs.snapshot import Missing
from rcsc.code.testing.mutants import Opinion
from rcsc.code.testing.suite import Proofs, SuiteOptions, run_suite
from rcsc.driver.compile import (
    CodeFound,
    Generated,
    code_of,
    files_of,
    files_of_system,
    generated_of,
    planned,
    systems_in,
    with_programs,
)
from rcsc.driver.pipeline import proved
from rcsc.driver.settings import CodeWanted, Conclusion, Settings, TestEffort
from rcsc.driver.watched import claims_of
from rcsc.lang.model import Expr, Program, ProvedProgram, Snapshot, Table
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer, Solver
from rcsc.proof.symbolic.encode import declared, encode
from rcsc.proof.table.certificate import must_cover
from rcsc.proof.table.decide import prove_table
from rcsc.proof.table.verdict import Gap
from rcsc.run.campaign.choose import kind_of, plant_name, plant_of
from rcsc.run.campaign.counterexamples import folder_word
from rcsc.run.campaign.rig import E, Rig
from rcsc.run.campaign.search import Searched, search, smallest
from rcsc.run.declared_plant import PlantSpec
from rcsc.run.description import BadDescription, description
from rcsc.run.episodes.proved.claims import NOTHING, Claims
from rcsc.run.executors import NotBuilt
from rcsc.run.link import Linked, drawing, run_beside, script

MOST_TICKS_EACH = 5
"""Ticks of a whole system for each example of a table."""
EXAMPLES_EACH = 10
"""Examples of a table for each episode of a whole system."""
SAVED = Path("campaign")
"""Where an episode goes that breaks a property."""


def test(settings: Settings, effort: TestEffort, code: CodeWanted) -> Conclusion:
    """Prove every table, then test its executors against its meaning, the C of systems beside Python, and write vectors if asked.

    Raises:
        BadDescription: A system is not in order, or does not fit its programs.
    """
    systems = tuple(systems_in(settings.paths))
    project = proved(with_programs(settings, systems))
    report = project.report()
    if report.failed:
        return Conclusion(report, "nothing was tested: not everything is proved")
    diagnostics: list[Diagnostic] = []
    figures = []
    alone = effort.plant is not None
    for root, program in () if alone else project.executable:
        found = code_of(root, partial(files_of, program, TARGETS), code, systems)
        given = (program.program, found.files, settings.options, effort)
        wrong, text = _tried(f"program `{program.program.name}`", found, _try_out, given, settings)
        diagnostics += wrong
        figures += [text, f"  tested: {found.words}"]
    for path in systems:
        found = code_of(str(path), partial(files_of_system, path, project, TARGETS), code, (path,))
        generated = replace(generated_of(project, (path,), TARGETS, found.defensive), files=dict(found.files))
        claims = NOTHING
        if alone:
            plant_of(description(path), effort.plant)  # refused before anything is proved
            claims = claims_of(path, open_cache(path.parent) if settings.use_cache else None)
        again = "" if not found.stale else " --no-compile" if code.folder is None else None
        for trial, more in ((_beside, ()), (_in_plant, (claims, again)))[alone:]:
            settings.progress(f"running {path}")
            wrong, text = _tried(f"system `{path}`", found, trial, (path, generated, effort, *more), settings)
            diagnostics += wrong
            figures += [text] if text not in figures else []
        figures.append(f"  tested: {found.words}")
    if effort.vectors is not None or effort.sessions is not None:
        sets = [whole_vectors(program, settings) for _, program in project.executable]
        diagnostics += write_vectors(sets, effort.vectors, effort.sessions)
        figures += map(figure, sets)
    settings.progress("")
    return Conclusion(project.report(tuple(diagnostics)), "\n".join(figures))


Told = tuple[tuple[Diagnostic, ...], str]
"""What a trial found, and a text of what was tried."""


def _tried(
    name: str, found: CodeFound, trial: Callable[..., Told], given: tuple[object, ...], settings: Settings
) -> Told:
    """Run a trial of some code; of code that is not what the tables give, in a process of its own, which it may end."""
    if found.lacking:
        return found.stale, f"{name}: not tested: {', '.join(found.lacking)} cannot be read"
    if not found.stale:
        return trial(*given, settings.progress)
    tried = apart(trial, *given, progress=settings.progress)
    if not isinstance(tried, Ended):
        return (*found.stale, *tried[0]), tried[1]
    message = f"the executors of {name} in `{found.folder}` do not run as the tables say: {tried.why}"
    place = Label(found.stale[0].primary.span)
    return (
        *found.stale,
        Diagnostic(Code.EXECUTORS_DISAGREE, message, place),
    ), f"{name}: not tested to the end"


def _beside(path: Path, generated: Generated, effort: TestEffort, progress: Callable[[str], None]) -> Told:
    """Run the C of a system beside the Python system; return the first difference, and a line on what was run."""
    if generated.clashes:
        return tuple(generated.clashes), ""
    whole = generated.systems[path]
    if reason := _alone(whole):
        return (), f"system {whole.word}: not run as a whole: {reason}"
    progress(f"running {whole.word} in C and in Python")
    with children.scratch("systems") as folder:
        write(generated.files, str(folder))
        described = replace(description(path), generated=folder)
        signs = {level.name: level.program.sign for level in whole.levels}
        ticks = script(described, signs, drawing(1), MOST_TICKS_EACH * effort.examples, wild=0.1)
        try:
            ran = run_beside(whole, described, ticks)
        except NotBuilt as error:
            return (Diagnostic(Code.NO_C_COMPILER, str(error), Label(Span(str(path), 0, 0))),), ""
    figure = (
        f"system {whole.word}: C and Python the same in {ran.ticks} ticks: {ran.restarts} restarts, {ran.refused} of them refused, "
        f"{ran.faults} ticks with a fault"
    )
    if not ran.difference:
        return (), figure
    message = f"the C of system `{whole.word}` and the Python system differ: {ran.difference}"
    return (Diagnostic(Code.EXECUTORS_DISAGREE, message, Label(Span(str(path), 0, 0))),), ""


def _in_plant(  # as many as there are facts
    path: Path,
    generated: Generated,
    effort: TestEffort,
    claims: Claims,
    again: str | None,
    progress: Callable[[str], None],
) -> Told:
    """Run drawn episodes of a system in its plant; return the first that breaks a property, shrunk and saved, and a line on all runs.

    Args:
        path: Of its description.
        generated: The code that is tested.
        effort: How many episodes, and in which plant.
        claims: What was proved, to be watched.
        again: The option with which `rcsc campaign` runs that code; None where it cannot.
        progress: Told what is being done.
    """
    if generated.clashes:
        return (), ""
    whole = generated.systems[path]
    extern = any(p.extern for program in whole.programs for p in program.plan.program.procedures)
    examples = max(1, effort.examples // EXAMPLES_EACH) if effort.plant is None else effort.examples
    with children.scratch("episodes") as folder:
        write(generated.files, str(folder))
        try:
            described = description(path)
            spec = plant_of(described, effort.plant)
            rig = Rig(
                kind_of(described, spec), path.resolve(), plant_name(spec), "python" if extern else "both",
                claims=claims, generated=folder,
            )  # fmt: skip
            searched = search(rig, examples, lambda at: progress(f"running {whole.word}: episode {at}"))
        except ModuleNotFoundError as error:
            extra = "hypothesis" if error.name == "hypothesis" else "cell"
            return (
                (),
                f"system {whole.word}: no episodes: `{error.name}` is not installed: pip install 'rcsc[{extra}]'",
            )
        except BadDescription as error:  # nobody answers a feed
            return (), f"system {whole.word}: no episodes: {error}"
        except NotBuilt as error:
            return (Diagnostic(Code.NO_C_COMPILER, str(error), Label(Span(str(path), 0, 0))),), ""
        figure = _figure(whole.word, rig, searched, spec)
        if searched.falsified is None:
            return (), figure
        plant = f" --plant {rig.plant}" if rig.plant else ""
        command = "" if again is None else f"rcsc campaign {path}{plant}{again} --again"
        return (_falsified(path, rig, searched, command, progress),), figure


def _figure(word: str, rig: Rig[Any], searched: Searched[Any], spec: PlantSpec | None) -> str:
    """Describe a system's episodes: how many ran, and what was left out."""
    ran = sum(bool(line) for _, _, line in searched.lines)  # a cycle that an input ended ran none
    its = rig.stand()
    lines = sum(
        len(its.signs[level.name].tables[table])
        for level in its.system.levels
        for table in its.signs[level.name].tables
    )
    where = "without a plant" if spec is None else f"in plant `{spec.name or spec.python}`"
    python = "in Python alone: extern procedures have no C here"
    same = python if rig.executor == "python" else "C and Python the same"
    if searched.falsified is not None:
        same = f"`{searched.falsified[1].property}` is broken in the last"
    excused = f", {searched.excused} with what a stale or forged value explains" if searched.excused else ""
    claims = sum(len(level.claims) for level in rig.claims.levels)
    proved = f", {claims} proved claims watched" if claims else ""
    return (
        f"system {word}: {searched.episodes} episodes {where}, {searched.cycles} cycles, {ran} of {lines} lines, "
        f"{same}{excused}{proved}"
    )


def _falsified(
    path: Path, rig: Rig[E], searched: Searched[E], command: str, progress: Callable[[str], None]
) -> Diagnostic:
    """Shrink the episode that was found, save it, and report the property that it breaks."""
    assert searched.falsified is not None
    least, shown = smallest(
        rig, *searched.falsified, lambda at: progress(f"making the episode smaller: try {at}")
    )
    folder = SAVED / f"test-{folder_word(shown.property)}"
    help_ = (
        f"`{command} {folder}` runs it again"
        if command
        else f"it is kept in `{folder}`; this command finds it again"
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(folder / "episode.json", least.to_json().encode())
        write_atomically(folder / "script.csv", least.script().encode())
    except OSError as error:
        help_ = f"`{folder}` cannot be written: {error.strerror}"
    name = rig.stand().system.name
    message = (
        f"in an episode of `{name}`, cycle {shown.tick}: `{shown.property}` does not hold: {shown.message}"
    )
    return Diagnostic(
        Code.PROPERTY_BROKEN, message, Label(Span(str(path), 0, 0)), notes=rig.kind.told(least), help=(help_,)
    )


def _alone(system: Linked) -> str:
    """Return why a system cannot run without the user's own parts; "" where it can."""
    if any(level.questions for level in system.levels):
        return "its levels ask a database"
    if any(procedure.extern for program in system.programs for procedure in program.plan.program.procedures):
        return "its levels call extern procedures"
    return ""


def _try_out(
    program: Program,
    files: Mapping[str, str],
    options: Options,
    effort: TestEffort,
    progress: Callable[[str], None],
) -> Told:
    """Run the suite on one program; return its findings and its counts."""
    asked = SuiteOptions(
        effort.examples,
        effort.cycles,
        effort.deep,
        effort.esbmc_s,
        effort.cortex,
        None if effort.mutants < 0 else effort.mutants,
        progress=progress,
    )
    result = run_suite(program, files, asked, proofs(options))
    return result.diagnostics, result.text()


def whole_vectors(program: ProvedProgram, settings: Settings) -> VectorSet:
    """Make vectors of the whole C of a program."""
    plan, options = planned(program), settings.options
    return vector_set(plan, emitted(plan), options, proofs(options).solver, settings.progress)


def proofs(options: Options) -> Proofs:
    """Return the prover and its solver, as far as the suite needs them."""

    def prover(program: Program, table: Table) -> Opinion:
        verdict = prove_table(program, table, replace(options, brief=True))
        falls = [finding for finding in verdict.findings if isinstance(finding, Gap)]
        accepted = len(falls) == len(verdict.findings) and (not falls or not must_cover(table))
        return Opinion(accepted, repr([(gap.count, gap.witnesses) for gap in falls]))

    def solver(program: Program, condition: Expr) -> Snapshot | Missing:
        frame, ranges = declared(program.variables)
        asked = Solver(options.limits)
        asked.add(*ranges, encode(condition, frame))
        answer = asked.check()
        if answer is Answer.SATISFIABLE:
            return {v.name: asked.value(frame.leaves[v.name], v.type) for v in program.variables}
        return Missing.NONE if answer is Answer.UNSATISFIABLE else Missing.UNKNOWN

    return Proofs(prover, solver)
