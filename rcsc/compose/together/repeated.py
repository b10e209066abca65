"""A run that breaks a requirement across levels, repeated on the Python and the C executors, and kept as a log.

In: an answer with a run. Out: an `Explanation` as of a level's claim, so that all that shows and keeps runs serves this one, too.
"""

from collections.abc import Mapping
from dataclasses import replace

from rcsc.base.host.children import scratch
from rcsc.compose.contract.obligations import Obligation, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.explain import Explanation, TraceSettings, runs_on_executors
from rcsc.compose.counterexample.finding import Finding
from rcsc.compose.counterexample.rerun import ExecutorsDifferError, make, only_in_python, record
from rcsc.compose.together.proof import Across
from rcsc.proof.symbolic.values import TRUE


def finding_of(found: Across) -> Finding:
    """Return the run of an answer as a finding of the last level that ran in it."""
    obligation = Obligation(Sort.REQUIREMENT, "", found.stated.name, TRUE)
    ran = [name for tick in found.run for name in tick]
    return Finding(ran[-1], obligation, found.run)


def repeated(found: Across, systems: Mapping[str, TransitionSystem], settings: TraceSettings) -> Explanation:
    """Repeat the run of an answer on executors of its levels; keep it where `settings` says so.

    Raises:
        OSError: It cannot be kept there.
    """
    finding = finding_of(found)
    explanation = Explanation(finding.level, finding.obligation, finding)
    if not runs_on_executors(systems, finding):
        return explanation
    with scratch("across") as temporary:
        folder = temporary if settings.log is None else settings.log
        system = replace(settings.system, generated=folder / "generated")
        make((systems[name].program for name in finding.levels), system.generated, altered=settings.altered)
        log = None if settings.log is None else folder / f"{found.stated.name}.mcap"
        try:
            record(finding, systems, system, log, altered=settings.altered)
        except ExecutorsDifferError as error:
            return replace(explanation, beside=error.beside)
    return replace(explanation, log=log, in_c=not only_in_python(finding, systems))
