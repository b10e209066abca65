"""What `rcsc prove` says of requirements across levels: first of all, for they are what the levels are for."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.cache import Cache
from rcsc.code.testing.figures import counted
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.explain import Explanation, TraceSettings
from rcsc.compose.counterexample.finding import Finding, rows
from rcsc.compose.coverage.covered import Coverage
from rcsc.compose.proof.system import SystemProof
from rcsc.compose.together.kept import answered
from rcsc.compose.together.needed import core_across
from rcsc.compose.together.product import read_by_all
from rcsc.compose.together.proof import Across, Question
from rcsc.compose.together.repeated import Answers, again, finding_of, repeated
from rcsc.compose.together.said import said, state
from rcsc.compose.together.words import stated_across
from rcsc.driver.requirements import Read
from rcsc.front.commands.shared.proved import named
from rcsc.front.commands.shared.stopped import attach, say_error
from rcsc.front.commands.systems.explained import say_exercise, say_run
from rcsc.lang.model import Property
from rcsc.lang.over_time.past import TRUE
from rcsc.run.description import Description

if TYPE_CHECKING:
    from rcsc.views.pages.requirement_page import RequirementStory

_WHY = "a requirement, or an invariant of a level, that says why it holds may show it"
_ALONE = "it speaks of `{0}` alone: stated in the tables of `{0}`, it is proved or refuted of that level, where more is tried"
_NOT_REPEATED = "A run was found, and is of no executors: `rcsc prove` prints it."
_FREER = "let the assumptions restrict less: whatever the levels do must leave values that keep them"


def standing(systems: Mapping[str, TransitionSystem], whole: SystemProof, found: Across) -> str:
    """Return the verdict in words, with the timing, the levels, what it rests on and what it trusts."""
    return said(found, found.closed(systems, whole.closed), whole.closed)


def lines_of(systems: Mapping[str, TransitionSystem], whole: SystemProof, given: Answers) -> Iterator[str]:
    """Yield a line for each requirement."""
    yield click.style(f"requirements across levels, {Path(given.program.file).name}", bold=True)
    for found, _ in given.every:
        yield f"  {found.stated.name:24} {standing(systems, whole, found)}"


def counts(
    systems: Mapping[str, TransitionSystem], whole: SystemProof, given: Answers | None
) -> tuple[int, int, tuple[str, ...]]:
    """Count the requirements, those that are not proved, and of the others kind by kind what is not shown."""
    every = [] if given is None else [found for found, _ in given.every]
    proved = [found for found in every if found.proved]
    lacks = {
        "proved of kinder surroundings only": sum(found.kinder for found in proved),
        "resting on unproved claims": sum(
            bool(found.closed(systems, whole.closed).lacks) for found in proved
        ),
        "that never asks": sum(found.vacuous for found in proved),
    }
    told = (f"{counted(many, 'requirement')} across levels {what}" for what, many in lacks.items() if many)
    return len(every), len(every) - len(proved), tuple(told)


def check_names(names: Collection[str], systems: Mapping[str, TransitionSystem], system: Description) -> None:
    """Raise `click.UsageError` where the system states no requirement across levels of one of these names."""
    if not names:
        return
    stated = stated_across(system, {level: ts.program for level, ts in systems.items()})
    known = [] if stated is None else [one.name for one in stated[0].properties]
    for name in names:
        if name not in known:
            there = f"there are {', '.join(known)}" if known else "the system states none"
            raise click.UsageError(f"there is no requirement across levels `{name}`; {there}")


def say_runs(systems: Mapping[str, TransitionSystem], given: Answers | None) -> None:
    """Print the run of each requirement that some run breaks, also where it is proved of kinder surroundings."""
    for found, explanation in given.every if given is not None else ():
        if found.vacuous:
            say_error(
                Code.VACUOUS,
                f"requirement `{found.stated.name}` across levels is vacuous: nothing ever asks",
                "warning",
            )
        if explanation is None:
            if not found.proved:
                say_error(Code.NOT_COMPOSED, f"requirement `{found.stated.name}` across levels: not proved")
                attach("note", f"it says: {found.stated.text}")
                attach("note", f"no run of {counted(found.looked, 'tick')} breaks it; a longer one may")
                attach("help", _FREER if found.stuck else _WHY)
                if (level := _alone(systems, found.stated)) and not found.stuck:
                    attach("help", _ALONE.format(level))
            continue
        if found.proved:
            say_error(
                Code.NOT_COMPOSED,
                f"requirement `{found.stated.name}` across levels is proved of kinder surroundings only: this run breaks it",
                "warning",
            )
        else:
            say_error(Code.NOT_COMPOSED, f"requirement `{found.stated.name}` across levels: refuted")
        attach("note", f"it says: {found.stated.text}")
        for line in _befalls(found):
            attach("note", line)
        say_run(systems, explanation)


def _alone(systems: Mapping[str, TransitionSystem], stated: Property) -> str:
    """Return the level that a requirement reads, where it reads no other and nothing of what stands outside; else nothing."""
    parties = {name.partition(".")[0] for name in read_by_all(stated)}
    return next(iter(parties)) if len(parties) == 1 and parties <= systems.keys() else ""


def _befalls(found: Across) -> Iterator[str]:
    """Yield a note for each tick of a run in which levels begin anew, or see buffers late."""
    late = dict(enumerate(found.run_late, 1))
    for tick, ran in enumerate(found.run, 1):
        anew = [f"`{name}` begins anew" for name, step in ran.items() if step.anew]
        ends = [f"`{end}` is seen {counted(ticks, 'tick')} late" for end, ticks in late.get(tick, {}).items()]
        if anew or ends:
            yield f"tick {tick}: {', '.join((*anew, *ends))}"


def shows(systems: Mapping[str, TransitionSystem], settings: TraceSettings, name: str) -> bool | None:
    """Print a run that asks for the response of a requirement across levels; False where none was found, None where there is none."""
    stated = stated_across(settings.system, {level: ts.program for level, ts in systems.items()})
    program = None if stated is None else stated[0]
    wanted = [
        one
        for one in ([] if program is None else program.properties)
        if one.name == name and one.monitor is not None
    ]
    if program is None or not wanted:
        return None
    asking = Question(systems, settings.system, program, wanted[0]).asks()
    if not asking.run:
        click.echo(f"requirement `{name}` across levels: no run was found that asks for its response")
        return False
    say_exercise(systems, finding_of(asking), f"`{name}` across levels")
    return True


def covered(
    systems: Mapping[str, TransitionSystem],
    whole: SystemProof,
    settings: TraceSettings,
    given: Answers | None,
    coverages: Mapping[str, Coverage],
) -> dict[str, Coverage]:
    """Return the coverage of levels with what requirements across levels need of each."""
    cores = []
    proofs = {proof.level: proof for proof in whole.levels}
    for found, _ in () if given is None else given.every:
        assert given is not None
        cores.append(
            core_across(Question(systems, settings.system, given.program, found.stated, proofs), found)
        )
    return {
        level: replace(one, across=tuple((core.name, core.of(level)) for core in cores))
        for level, one in coverages.items()
    }


def story(
    its: Read, whole: SystemProof, stated: Property, settings: TraceSettings, cache: Cache | None
) -> "tuple[RequirementStory, Path | None]":
    """Return all that is known of a requirement across levels, and the log of a run that breaks it, or that asks for its response."""
    from rcsc.views.trace.story import across_story  # few make a page

    assert its.across is not None
    proofs = {proof.level: proof for proof in whole.levels}
    question = Question(its.systems, its.described, its.across[0], stated, proofs)
    found = answered(question, cache)
    told = across_story(its, whole, found)
    if not found.proved:
        if not found.run:
            return replace(told, without="No run was found that breaks it; a longer one may."), None
        explanation = repeated(found, its.systems, settings)
        return (told, explanation.log) if explanation.log else (replace(told, without=_NOT_REPEATED), None)
    always = stated.monitor is None or stated.monitor.asks == TRUE
    asking = None if always or found.vacuous else question.asks()
    finding = finding_of(asking) if asking is not None and asking.run else None
    return with_exercise(told, stated, finding, its.systems, settings)


def with_exercise(
    told: "RequirementStory",
    stated: Property,
    finding: Finding | None,
    systems: Mapping[str, TransitionSystem],
    settings: TraceSettings,
) -> "tuple[RequirementStory, Path | None]":
    """Return what is told of a proved requirement, with the log of a run that asks for its response; with why not, where there is none."""
    if stated.monitor is None or stated.monitor.asks == TRUE:
        return replace(told, without="It is about every cycle: any run is one of it."), None
    if finding is None:
        return replace(told, without="No run was found that asks for its response."), None
    log = again(finding, stated.name, systems, settings).log
    return (replace(told, asks=True), log) if log else (replace(told, without=_NOT_REPEATED), None)


def as_json(
    systems: Mapping[str, TransitionSystem], whole: SystemProof, given: Answers | None
) -> list[dict[str, Any]]:
    """Return each requirement with its verdict, what it rests on and trusts, and its run."""
    return [] if given is None else [_one(systems, whole, *each) for each in given.every]


def _one(
    systems: Mapping[str, TransitionSystem],
    whole: SystemProof,
    found: Across,
    explanation: Explanation | None,
) -> dict[str, Any]:
    closed = found.closed(systems, whole.closed)
    finding = None if explanation is None else explanation.finding
    return {
        "name": found.stated.name,
        "says": found.stated.text,
        "requirements": list(found.stated.requirements),
        "verdict": state(found, closed),
        "timing": found.timing.value,
        "levels": list(found.levels),
        "rests_on": [named(whole, "", [need]) for need in closed.lacks],
        "trusts": list(closed.trusts),
        "vacuous": found.vacuous,
        "looked": found.looked,
        "late_ticks": found.late,
        "lap": found.lasso,
        "seen_late": [dict(late) for late in found.run_late],
        "time_line": [] if finding is None else [asdict(row) for row in rows(systems, finding)],
        "beside": [] if explanation is None else list(explanation.beside),
        "log": "" if explanation is None or explanation.log is None else str(explanation.log),
    }


def beside(given: Answers | None) -> Sequence[str]:
    """Return where executors differ from the interpreter: a fault of rcsc's own."""
    return (
        [] if given is None else [line for _, each in given.every if each is not None for line in each.beside]
    )
