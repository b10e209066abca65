"""What `rcsc prove` does: proves the levels of a system together, and says what it found."""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.jsonform import diagnostic_to_json
from rcsc.base.diagnostics.render import full, paint, plain
from rcsc.base.diagnostics.source import Sources
from rcsc.base.host.cache import Cache
from rcsc.base.host.children import scratch
from rcsc.base.host.files import write_atomically
from rcsc.compose.contract.beginning import BadStartError, Starts, starts
from rcsc.compose.contract.claims import CONTRACT, Key
from rcsc.compose.contract.obligations import Sort, obligations
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.contract.variants import VARIANTS
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, exercising, explain, file_name
from rcsc.compose.counterexample.frozen import case_breaks, frozen, read_case
from rcsc.compose.counterexample.trace import usual_length
from rcsc.compose.coverage.covered import Coverage
from rcsc.compose.coverage.kept import made
from rcsc.compose.exact.circuit import circuit
from rcsc.compose.exact.export import aiger, btor2
from rcsc.compose.invariant.cubes import as_condition, shown
from rcsc.compose.invariant.search import Effort
from rcsc.compose.proof.eventually import waiting
from rcsc.compose.proof.level import LevelProof, certificate
from rcsc.compose.proof.notices import notices
from rcsc.compose.proof.standing import keep_refuted
from rcsc.compose.proof.system import (
    SystemProof,
    lines_in,
    prove_transition_systems,
    read_systems,
)
from rcsc.compose.together.left_open import whole_proof
from rcsc.compose.together.repeated import Answers, answers
from rcsc.driver.outline import keep_lines, outline
from rcsc.driver.requirements import Read
from rcsc.driver.unchanged import digest_at
from rcsc.front.commands.shared.options import cores
from rcsc.front.commands.shared.proved import (
    as_json,
    assumptions,
    claim,
    confirmed,
    in_context,
    left_out,
    named,
    not_looked_at,
    pauses,
    reaction,
    standing,
    summary,
    trusted,
    trusting,
)
from rcsc.front.commands.shared.show import Color, Progress, UnwritableError, say, wants_color
from rcsc.front.commands.shared.stopped import say_error
from rcsc.front.commands.shared.took import Answering, Clock
from rcsc.front.commands.systems import across
from rcsc.front.commands.systems.covering import coverage_as_json, lines_of
from rcsc.front.commands.systems.explained import explanation_as_json, say_exercise, say_explanation
from rcsc.lang.model import Kind, Property
from rcsc.lang.over_time.past import TRUE as ALWAYS
from rcsc.proof.solvers.options import Limits
from rcsc.run.description import Description, description

if TYPE_CHECKING:
    from rcsc.views.pages.requirement_page import RequirementStory

ACROSS = "requirements across levels"
"""What the files of these are kept under, among those of the levels' programs, none of which has a blank in its name."""
_WORTH_PROCESSES = 40
"""Lines of the levels' tables from which several processes are quicker than one: each takes a second to begin."""


@dataclass(frozen=True, slots=True)
class Asked:
    """The options of `rcsc prove`, by their names there.

    Attributes:
        variants: Rules that are off.
    """

    only: tuple[str, ...]
    required: tuple[str, ...]
    steps: int
    jobs: int | None
    cycles: int | None
    further: int
    begins: tuple[str, ...]
    logs: Path | None
    freeze: Path | None
    variants: tuple[str, ...]
    certificate: Path | None
    confirms: bool
    progress: bool
    strict: bool
    invariants: bool
    as_json: bool
    coverage: bool = False


def proved(path: Path, asked: Asked, cache: Cache | None, key: tuple[str, ...]) -> int:
    """Prove the levels of a system, print the findings, and return the exit status.

    Under the key is kept what is to be printed where nothing has changed, if all is proved.
    """
    stood = digest_at(str(path))
    systems, loaded = read_systems(path)
    as_read = systems
    sources = {file: source for files in loaded.values() for file, source in files.sources.items()}
    names = _known(asked.only, systems) or tuple(systems)
    programs = {spec.name: spec.program for spec in description(path).levels}
    length = usual_length(systems.values()) if asked.cycles is None else asked.cycles
    settings = TraceSettings(
        description(path),
        length,
        altered=bool(asked.variants),
        log=asked.logs,
        further=asked.further,
        starts=_starts(systems, asked.begins),
    )
    for name in asked.variants:
        systems = {level: ts.of(VARIANTS[name](ts.program)) for level, ts in systems.items()}
    across.check_names(asked.required, systems, settings.system)
    effort = Effort(limits=Limits.of(asked.steps))
    clock = Clock(cache, path)
    with _LevelProgress(names, clock, wanted=asked.progress) as done:
        large = sum(lines_in(systems[name]) for name in names) >= _WORTH_PROCESSES
        jobs = asked.jobs or (cores() if large else 1)
        if asked.only or asked.variants:
            alone = proof = prove_transition_systems(systems, effort, jobs, names, done, cache)
        else:
            whole = whole_proof(systems, settings.system, effort, jobs, done, cache)
            systems, alone, proof = whole.systems, whole.alone, whole.proof
    if asked.certificate is not None:
        _write(asked.certificate, systems, alone)
    begun = time.perf_counter()
    given = None if asked.only or asked.variants else _across(systems, proof, settings, cache, asked, clock)
    proof = replace(proof, seconds=proof.seconds + time.perf_counter() - begun)
    if given is not None:
        sources |= given.loaded.sources
        loaded = {**loaded, ACROSS: given.loaded}
    if not asked.as_json:
        _say(_lines(path, systems, proof, asked, sources, _More(given=given)))
    coverages = {
        level.level: made(cache, systems[level.level], level, loaded[programs[level.level]])
        for level in proof.levels
        if asked.coverage
    }
    if coverages and not asked.only:
        coverages = across.covered(systems, proof, settings, given, coverages)
    if not asked.as_json:
        _say(line for each in coverages.values() for line in lines_of(each, sources))
        across.say_runs(systems, given)
    explanations = _explanations(path, systems, proof, asked, settings)
    _keep_refuted(None if asked.begins else cache, as_read, explanations)
    if asked.as_json:
        found = [explanation_as_json(systems, explanation, settings) for explanation in explanations]
        _say(_lines(path, systems, proof, asked, sources, _More(found, coverages, given)))
    for agreement in (each for each in proof.agreements if not each.holds):
        say_error(Code.NOT_AGREED, f"level `{agreement.level}` assumes that {agreement.assumed}")
    refused = _refused(systems, alone, quiet=asked.as_json) if asked.confirms else []
    if refused or any(explanation.bug for explanation in explanations) or across.beside(given):
        return 3
    short = not proof.proved or (asked.strict and not proof.whole)
    status = max(int(short), summary(proof, across.counts(systems, proof, given)).status(strict=asked.strict))
    quiet = not explanations and not asked.coverage and (given is None or not given.told)
    if cache is not None and not status and quiet:
        keep_lines(
            cache,
            path,
            key,
            tuple(_lines(path, systems, _recalled(proof), asked, sources, _More(given=given))),
            stood,
            loaded,
        )
    return status


def _across(
    systems: Mapping[str, TransitionSystem],
    proof: SystemProof,
    settings: TraceSettings,
    cache: Cache | None,
    asked: Asked,
    clock: Clock,
) -> Answers | None:
    """Answer the requirements across levels; none where the system states none."""
    try:
        with Answering(clock, wanted=asked.progress) as told:
            return answers(systems, proof, settings, cache, asked.required, told)
    except OSError as error:
        place = str(error.filename or asked.logs)
        raise UnwritableError(place, error.strerror or "no reason given") from error


def shown_by_runs(path: Path, names: tuple[str, ...], length: int | None) -> int:
    """Print for each requirement over time, `NAME` or `LEVEL.NAME`, a run that asks for its response; 1 where none was found of one."""
    systems = read_systems(path)[0]
    usual = usual_length(systems.values()) if length is None else length
    settings = TraceSettings(description(path), usual)
    status = 0
    for name in names:
        level, _, plain = name.rpartition(".")
        places = [
            (ts, stated)
            for owner, ts in systems.items()
            for stated in ts.program.properties
            if stated.monitor is not None and stated.name == plain and level in {"", owner}
        ]
        if not places and (found := across.shows(systems, settings, name)) is not None:
            status = status if found else 1
        elif not places:
            raise click.UsageError(f"no level has a requirement over time `{name}`")
        for ts, stated in places:
            finding = exercising(ts, stated, settings)
            if finding is None:
                click.echo(
                    f"requirement `{stated.name}` of level `{ts.level.name}`: no run was found that asks for its response"
                )
                status = 1
            else:
                say_exercise(systems, finding, f"`{stated.name}` of level `{finding.level}`")
    return status


def paged(path: Path, name: str, page: Path, length: int | None, cache: Cache | None) -> int:
    """Write a page about the requirement or property `NAME`, or `LEVEL.NAME`; return 1 where it is not proved."""
    from rcsc.driver.requirements import read
    from rcsc.run.log.read import read as read_log  # of an extra
    from rcsc.views.pages.requirement_page import write_requirement

    its = read(path, cache)
    whole = whole_proof(read_systems(path)[0], its.described, cache=cache)
    its = replace(its, systems=whole.systems)
    usual = usual_length(whole.systems.values()) if length is None else length
    try:
        with scratch("page") as folder:
            settings = TraceSettings(its.described, usual, log=folder)
            story, log = _story(its, whole.proof, name, settings, cache)
            write_requirement(page, story, None if log is None else read_log(log))
    except OSError as error:
        raise UnwritableError(str(page), error.strerror or "no reason given") from error
    click.echo(f"{story.word} `{story.name}` {story.whose}: {story.verdict}")
    click.echo(f"page: {page}")
    return 0 if story.state == "proved" else 1


def _story(
    its: Read, whole: SystemProof, name: str, settings: TraceSettings, cache: Cache | None
) -> "tuple[RequirementStory, Path | None]":
    """Return what is known of a requirement, and the log of a run of it.

    Raises:
        click.UsageError: Nothing is called so, or several are.
    """
    across_ = [] if its.across is None else [one for one in its.across[0].properties if one.name == name]
    level, _, plain = name.rpartition(".")
    own = [
        (owner, stated)
        for owner, ts in its.systems.items()
        for stated in ts.program.properties
        if stated.name == plain and level in {"", owner} and not stated.standard
    ]
    if not across_ and not own:
        raise click.UsageError(f"no level, and nothing across levels, has a requirement `{name}`")
    if len(across_) + len(own) > 1:
        owners = [*("across levels" for _ in across_), *(f"`{owner}.{plain}`" for owner, _ in own)]
        raise click.UsageError(f"several are called `{name}`: {', '.join(owners)}")
    if across_:
        return across.story(its, whole, across_[0], settings, cache)
    return _story_of_level(its, whole, *own[0], settings)


def _story_of_level(
    its: Read, whole: SystemProof, level: str, stated: Property, settings: TraceSettings
) -> "tuple[RequirementStory, Path | None]":
    from rcsc.views.trace.story import level_story

    key = (stated.word, "", stated.name)
    accepted = whole.of(level, key).accepted
    broken = None if accepted else _explained(its, whole, level, key, settings)
    story = level_story(its, whole, level, stated, refuted=broken is not None and broken.finding is not None)
    if not accepted:
        log = None if broken is None else broken.log
        return (
            (story, log)
            if log is not None
            else (replace(story, without="No run was found that breaks it."), None)
        )
    always = stated.monitor is None or stated.monitor.asks == ALWAYS
    finding = None if always else exercising(its.systems[level], stated, settings)
    return across.with_exercise(story, stated, finding, its.systems, settings)


def _explained(
    its: Read, whole: SystemProof, level: str, key: Key, settings: TraceSettings
) -> Explanation | None:
    """Return the explanation of one claim of a level that is not proved."""
    alone = replace(whole, levels=tuple(proof for proof in whole.levels if proof.level == level))
    every = explain(its.systems, alone, settings)
    return next((one for one in every if one.obligation.key == key), None)


def exported(path: Path, only: tuple[str, ...], form: str, folder: Path) -> int:
    """Write each level, whose inputs may be refused, with its obligations for another model checker; return the exit status."""
    systems = read_systems(path)[0]
    for name in _known(only, systems) or systems:
        ts = systems[name].refusing()
        step = ts.cycle(ts.havoc())
        gates = circuit(ts, tuple(ts.firsts().values()), step, obligations(ts, step))
        file = folder / f"{name}.{'aig' if form == 'aiger' else form}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            write_atomically(file, aiger(gates) if form == "aiger" else btor2(gates))
        except OSError as error:
            raise UnwritableError(str(folder), error.strerror or "no reason given") from error
        left_open = f"; left open: {', '.join(gates.opened)}" if gates.opened else ""
        click.echo(f"{file}: {len(gates.wanted)} obligations, {len(gates.latches)} bits of state{left_open}")
        for requirement in waiting(ts):
            click.echo(
                f"{file}: of `{requirement}` only what a cycle breaks; not that it never waits for ever"
            )
    return 0


def _known(only: tuple[str, ...], systems: Mapping[str, TransitionSystem]) -> tuple[str, ...]:
    unknown = [name for name in only if name not in systems]
    if unknown:
        raise click.UsageError(f"there is no level `{unknown[0]}`; there are {', '.join(systems)}")
    return only


def _say(lines: Iterable[str]) -> None:
    for line in lines:
        say(line)


def _recalled(proof: SystemProof) -> SystemProof:
    """Return the proof as one that was wholly recalled."""
    return replace(proof, levels=tuple(replace(level, cached=True) for level in proof.levels), seconds=0.0)


@dataclass(frozen=True, slots=True)
class _More:
    """What is told beside the levels' claims: runs and coverage as JSON, the answers to requirements across levels."""

    findings: Sequence[dict[str, Any]] = ()
    coverages: Mapping[str, Coverage] = field(default_factory=dict)
    given: Answers | None = None


def _lines(
    path: Path,
    systems: dict[str, TransitionSystem],
    proof: SystemProof,
    asked: Asked,
    sources: Sources,
    more: _More,
) -> Iterator[str]:
    """Yield the lines to print of a proof; findings and coverage are part of it as JSON, and else printed by themselves."""
    if asked.as_json:
        yield json.dumps(_as_json(proof, systems, sources, more), indent=2)
        return
    if more.given is not None:
        yield from across.lines_of(systems, proof, more.given)
    yield summary(proof, across.counts(systems, proof, more.given)).line(strict=asked.strict)
    for level_proof in proof.levels:
        yield from _of_level(systems[level_proof.level], proof, level_proof)
    if asked.invariants:
        yield from _invariants(systems, proof)
    yield from _agreements(proof)
    yield from _whole(systems, proof)
    yield from _unconnected(systems, description(path))
    for notice in notices(systems, proof):
        rows = full(notice, sources)
        yield (paint(rows) if wants_color(Color.AUTO, None) else plain(rows)).rstrip("\n")


class _LevelProgress:
    """Name each level on standard error as it is done, and on a terminal those that are still to come."""

    def __init__(self, names: Sequence[str], clock: Clock, *, wanted: bool) -> None:
        self._left, self._clock = list(names), clock
        self._line = Progress()
        self._wanted = wanted or self._line.shown

    def __enter__(self) -> Callable[[LevelProof], None]:
        self._doing()
        return self._done

    def __exit__(self, *_: object) -> None:
        self._line("")
        self._clock.keep()

    def _doing(self) -> None:
        left = ", ".join(self._clock.said(name) for name in self._left)
        self._line(f"proving {left}" if left else "")

    def _done(self, proof: LevelProof) -> None:
        self._line("")
        count = f"{len(proof.verdicts) - len(proof.open)} of {len(proof.verdicts)} found proved"
        if self._wanted:
            click.echo(f"level {proof.level}: {count}, {proof.seconds:.1f} s", err=True)
        if not proof.cached:
            self._clock.took(proof.level, proof.seconds)
        self._left.remove(proof.level)
        self._doing()


def _refused(systems: dict[str, TransitionSystem], proof: SystemProof, *, quiet: bool) -> list[str]:
    """List the questions that cvc5 does not answer as Z3 did, and print how many there were."""
    refused = []
    for level in proof.levels:
        answers = confirmed(systems[level.level], level)
        wrong = [name for name, same in answers.items() if not same]
        refused += wrong
        good = len(answers) - len(wrong)
        click.echo(
            f"level {level.level}: cvc5 says the same of {good} of {len(answers)} questions", err=quiet
        )
        for name in wrong:
            say_error(Code.SOLVERS_DISAGREE, f"level `{level.level}`: cvc5 does not confirm `{name}`")
    return refused


def _of_level(ts: TransitionSystem, whole: SystemProof, proof: LevelProof) -> Iterator[str]:
    """Yield the lines of one level: its assumptions first, then its other obligations, each with the unproved claims it rests on."""
    declared = {str(assumption.name): assumption.standing.value for assumption in ts.program.assumptions}
    how = {key: f", {by}" for key, by in proof.by if whole.of(proof.level, key).proved}
    found_before = ", by an earlier run" if proof.cached else ""
    yield click.style(f"level {proof.level}", bold=True) + f"  {proof.seconds:.1f} s{found_before}"
    for sort in Sort:
        obligations = [obligation for obligation, _ in proof.verdicts if obligation.sort is sort]
        if sort is Sort.ASSUMPTION:
            for obligation in obligations:
                verdict = standing(whole, proof.level, obligation.key)
                proved = whole.of(proof.level, obligation.key).proved
                as_declared = "" if proved else f"{declared[obligation.name]}: "
                together = " of the levels together" if verdict in {"not proved", "undecided"} else ""
                yield f"  {obligation.table:28} {obligation.name:24} {as_declared}{verdict}{together}"
        elif sort in {Sort.INVARIANT, Sort.PROPERTY, Sort.REQUIREMENT, Sort.KEPT}:
            for obligation in obligations:
                yield (
                    f"  {sort.value:28} {obligation.name:24} {standing(whole, proof.level, obligation.key)}"
                    f"{how.get(obligation.key, '')}"
                )
        elif obligations:
            good = [obligation for obligation in obligations if whole.of(proof.level, obligation.key).proved]
            trusts = trusting(whole, proof.level, [obligation.key for obligation in good])
            yield f"  {sort.value}: {len(good)} of {len(obligations)} proved{trusts}"
            for obligation in obligations:
                if obligation not in good:
                    yield (
                        f"    {obligation.table or obligation.name or 'within a cycle'}: {standing(whole, proof.level, obligation.key)}"
                    )
    for line in not_looked_at(proof):
        yield f"  {line}"
    many = len(proof.clauses)
    yield (
        f"  invariant: {many} clauses over {len(proof.predicates)} features; {proof.walked} states walked, {proof.learnt} learnt"
    )
    for line in in_context(ts, whole, proof):
        yield f"  {line}"


def _invariants(systems: Mapping[str, TransitionSystem], proof: SystemProof) -> Iterator[str]:
    for level in proof.levels:
        yield f"invariant of level {level.level}: never"
        for clause in level.clauses:
            yield f"  {shown(level.predicates, clause)}"
        program = systems[level.level].program
        hidden = {v.name for v in program.variables if v.previous_of is not None or v.counts is not None}
        own = {
            str(leaf)
            for declared in program.declared
            if declared.kind is not Kind.INPUT
            for leaf in declared.leaves
            if leaf not in hidden
        }
        if condition := as_condition(level.predicates, level.clauses, own):
            yield "the part about its own values, as a declaration; `rcsc check` says whether it stands without its environment:"
            yield f"  invariant of_{level.level} : {condition}"


def _whole(systems: dict[str, TransitionSystem], proof: SystemProof) -> Iterator[str]:
    yield from (
        *reaction(systems, proof),
        *pauses(systems),
        assumptions(proof),
        *trusted(proof),
        *left_out(proof),
    )
    yield f"{proof.seconds:.1f} s in all"


def _unconnected(systems: Mapping[str, TransitionSystem], system: Description) -> Iterator[str]:
    """Yield the inputs that nothing fills, and the outputs that nothing takes: perhaps a buffer was forgotten."""
    named = {
        kind: [
            f"{name}.{declared.name}"
            for name, ts in systems.items()
            for declared in ts.program.declared
            if declared.kind is kind
        ]
        for kind in (Kind.INPUT, Kind.OUTPUT)
    }
    if missing := system.unfilled(named[Kind.INPUT]):
        yield f"no buffer fills {', '.join(f'`{name}`' for name in missing)}: proved for any value"
    if idle := system.untaken(named[Kind.OUTPUT]):
        yield f"no buffer takes {', '.join(f'`{name}`' for name in idle)}"


def _agreements(proof: SystemProof) -> Iterator[str]:
    if proof.agreements:
        yield "between the levels"
    for agreement in proof.agreements:
        lacks = named(
            proof, agreement.level, proof.of(agreement.level, (CONTRACT, "", agreement.record)).lacks
        )
        standing = "kept by: " if agreement.outside else "NOT " if not agreement.holds else ""
        standing += f"only if {lacks}: " if agreement.holds and lacks else ""
        yield f"  {agreement.level} assumes that {agreement.assumed}"
        yield f"    {standing}{agreement.reason}"


def _starts(systems: dict[str, TransitionSystem], begins: Sequence[str]) -> Starts:
    """Read the initial values that runs are searched from."""
    try:
        return starts(systems, ", ".join(begins))
    except BadStartError as error:
        raise click.UsageError("; ".join((f"--where: {error}", *error.helps))) from error


def _explanations(
    path: Path,
    systems: dict[str, TransitionSystem],
    proof: SystemProof,
    asked: Asked,
    settings: TraceSettings,
) -> list[Explanation]:
    """Explain each unproved claim, with its shortest trace where there is one."""
    explanations = []
    try:
        for explanation in explain(systems, proof, settings):
            explanations.append(explanation)
            if asked.freeze is not None and explanation.finding is not None and not explanation.beside:
                asked.freeze.mkdir(parents=True, exist_ok=True)
                case = asked.freeze / f"{settings.system.name}_{file_name(explanation.finding)}.json"
                text = frozen(explanation.finding, systems, path, case, asked.variants)
                write_atomically(case, text.encode())
            if not asked.as_json:
                say_explanation(systems, explanation, settings)
    except OSError as error:
        place = str(error.filename or asked.logs)
        raise UnwritableError(place, error.strerror or "no reason given") from error
    return explanations


def _keep_refuted(
    cache: Cache | None, systems: Mapping[str, TransitionSystem], explanations: Sequence[Explanation]
) -> None:
    """Keep which claims were refuted: what the studio and `rcsc trace` say of them afterwards."""
    needs = frozenset((each.level, each.obligation.key) for each in explanations if each.refutes)
    if cache is not None and needs:
        keep_refuted(cache, outline(systems), needs)


def run_cases(cases: tuple[Path, ...]) -> int:
    """Run frozen cases; return the exit status."""
    wrong = 0
    for path in cases:
        case = read_case(path)
        breaks = case_breaks(case)
        outcome = f"level `{case.level}`: {case.obligation.shown}: {'broken' if breaks else 'kept'}"
        if breaks is case.expects_broken:
            click.echo(f"{path}: {outcome}")
        else:
            wrong += 1
            say_error(Code.FOUND_AGAIN, f"{path}: {outcome}")
    return 1 if wrong else 0


def _write(folder: Path, systems: dict[str, TransitionSystem], proof: SystemProof) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for level in proof.levels:
            for name, text in certificate(systems[level.level], level).items():
                write_atomically(folder / f"{level.level} {name}.smt2".replace(" ", "_"), text.encode())
    except OSError as error:
        raise UnwritableError(str(folder), error.strerror or "no reason given") from error


def _how(level: LevelProof, key: Key) -> dict[str, str]:
    """Return how a claim was proved, where an exact engine did."""
    return {"by": dict(level.by)[key]} if key in dict(level.by) else {}


def _coverage(coverage: Coverage | None, sources: Sources) -> dict[str, Any]:
    """Return what the requirements of a level speak of, where that was asked for."""
    return {} if coverage is None else {"coverage": coverage_as_json(coverage, sources)}


def _as_json(
    proof: SystemProof,
    systems: dict[str, TransitionSystem],
    sources: Sources,
    more: "_More",
) -> dict[str, Any]:
    counts = across.counts(systems, proof, more.given)
    _, open_, lacks = counts
    stated = {} if more.given is None else {"requirements": across.as_json(systems, proof, more.given)}
    return {
        "proved": proof.proved and not open_,
        "whole": proof.whole and not open_ and not lacks,
        "counts": asdict(summary(proof, counts)),
        "findings": list(more.findings),
        "notices": [diagnostic_to_json(notice, sources) for notice in notices(systems, proof)],
        "levels": [
            {
                "level": level.level,
                "goals": [
                    {
                        "what": obligation.sort.value,
                        "table": obligation.table,
                        "name": obligation.name,
                        **claim(proof, level.level, obligation.key),
                        **_how(level, obligation.key),
                    }
                    for obligation, _ in level.verdicts
                ],
                "not_looked_at": [
                    {"what": each.sort.value, "table": each.table, "missing": each.missing}
                    for each in level.unstated
                ],
                "clauses": len(level.clauses),
                **as_json(proof, level),
                **_coverage(more.coverages.get(level.level), sources),
            }
            for level in proof.levels
        ],
        "agreements": [
            {
                "level": agreement.level,
                "assumed": agreement.assumed,
                "reason": agreement.reason,
                "holds": agreement.holds,
                "outside": agreement.outside,
            }
            for agreement in proof.agreements
        ],
        **stated,
    }
