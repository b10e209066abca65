"""The requirements across the levels of a system, answered; a run that breaks one is repeated on the executors, and kept as a log.

In: a system with the proofs of its levels. Out: `Answers`. A run is an `Explanation`, as of a level's claim, so that all that shows and
keeps runs serves this one, too.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

from rcsc.base.host.cache import Cache
from rcsc.base.host.children import scratch
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, runs_on_executors
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.rerun import ExecutorsDifferError, make, only_in_python, record
from rcsc.compose.proof.system import SystemProof
from rcsc.compose.together.kept import answered
from rcsc.compose.together.proof import Across, questions
from rcsc.compose.together.words import stated_across
from rcsc.lang.model import Program
from rcsc.lang.project import Loaded
from rcsc.proof.symbolic.values import TRUE


def finding_of(found: Across) -> Finding:
    """Return the run of an answer as a finding of the last level that ran in it; of a loop, in each of its ticks."""
    obligation = Obligation(Sort.REQUIREMENT, "", found.stated.name, TRUE)
    ran = [name for tick in found.run[::-1] for name in [*tick][::-1]]
    loop = found.run[found.lasso - 1 :] if found.lasso else ()
    tells = next((name for name in ran if all(name in tick for tick in loop)), ran[0])
    return Finding(tells, obligation, found.run, lasso=found.lasso)


def repeated(found: Across, systems: Mapping[str, TransitionSystem], settings: TraceSettings) -> Explanation:
    """Repeat the run of an answer on executors of its levels; keep it where `settings` says so.

    Raises:
        OSError: It cannot be kept there.
    """
    return again(finding_of(found), found.stated.name, systems, settings)


def again(
    finding: Finding, name: str, systems: Mapping[str, TransitionSystem], settings: TraceSettings
) -> Explanation:
    """Repeat a run on executors of its levels; keep it as a log of this name where `settings` says so.

    Raises:
        OSError: It cannot be kept there.
    """
    explanation = Explanation(finding.level, finding.obligation, finding)
    if not runs_on_executors(systems, finding):
        return explanation
    with scratch("across") as temporary:
        folder = temporary if settings.log is None else settings.log
        system = replace(settings.system, generated=folder / "generated")
        make((systems[level].program for level in finding.levels), system.generated, altered=settings.altered)
        log = None if settings.log is None else folder / f"{name}.mcap"
        try:
            record(finding, systems, system, log, altered=settings.altered)
        except ExecutorsDifferError as error:
            return replace(explanation, beside=error.beside)
    return replace(explanation, log=log, in_c=not only_in_python(finding, systems))


@dataclass(frozen=True, slots=True)
class Answers:
    """The answers to all requirements across the levels of a system.

    Attributes:
        program: The file that states them, resolved.
        loaded: The file, and all that it uses.
        every: The answers, each with its run as the executors repeated it, where there is one.
    """

    program: Program
    loaded: Loaded
    every: tuple[tuple[Across, Explanation | None], ...]

    @property
    def told(self) -> bool:
        """Whether something is told of one besides its line."""
        return any(explanation is not None or found.vacuous for found, explanation in self.every)


def answers(
    systems: Mapping[str, TransitionSystem],
    whole: SystemProof,
    settings: TraceSettings,
    cache: Cache | None,
    only: Collection[str] = (),
    told: Callable[[str, int, int], None] = lambda *_: None,
) -> Answers | None:
    """Answer the requirements across levels, or only those of these names; None where the system states none.

    Before each, `told` is given its name, its number and how many there are.

    Raises:
        NoProgramError: Their file is not in order.
        OSError: A run cannot be kept where it should be.
    """
    stated = stated_across(settings.system, {name: ts.program for name, ts in systems.items()})
    if stated is None:
        return None
    program, loaded = stated
    if only:
        program = replace(program, properties=tuple(one for one in program.properties if one.name in only))
    every = []
    for number, question in enumerate(questions(systems, settings.system, program, whole), 1):
        told(question.stated.name, number, len(program.properties))
        found = answered(question, cache)
        every.append((found, repeated(found, systems, settings) if found.run else None))
    return Answers(program, loaded, tuple(every))
