"""Verdicts on requirements across levels that an earlier run found.

The key is all that a verdict depends on: the requirement, what is assumed beside it, every level that writes to those it names, directly or
not, and how they are connected; and rcsc itself (`base.host.cache`). A run that breaks the requirement is kept, too: the executors repeat
it as they repeat a new one.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcsc.base.host.cache import Cache
from rcsc.compose.counterexample.cycle_run import CycleRun
from rcsc.compose.proof.candidates import content
from rcsc.compose.together.product import Surroundings, Timing
from rcsc.compose.together.proof import Across, Question
from rcsc.proof.solvers import smt

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rcsc.compose.contract.transition import TransitionSystem


@dataclass(frozen=True, slots=True)
class _Kept:
    """A verdict as it is kept."""

    proved: bool
    timing: str
    levels: tuple[str, ...]
    by: str
    around: Surroundings
    vacuous: bool
    assumed: tuple[str, ...]
    stuck: bool
    looked: int
    run: tuple[dict[str, CycleRun], ...]
    broken_in: Surroundings | None
    run_late: tuple[dict[str, int], ...]
    lasso: int
    fair: tuple[str, ...]


def answered(question: Question, cache: Cache | None) -> Across:
    """Return the answer to a question: an earlier one, if nothing has changed, and it was not open: of levels more may be proved since."""
    kept = None if cache is None else recalled(question, cache)
    if kept is not None and (kept.proved or kept.run):
        return kept
    cut_before = smt.cut_short()
    found = question.answer()
    if cache is not None and smt.cut_short() == cut_before:  # else another machine might find something else
        cache.store(_to_keep(found), "across", _key(question))
    return found


def recalled(question: Question, cache: Cache) -> Across | None:
    """Return the answer that was kept; None where nobody asked."""
    kept = cache.load(_Kept, "across", _key(question))
    if kept is None:
        return None
    return Across(
        question.stated,
        kept.proved,
        Timing(kept.timing),
        kept.levels,
        kept.by,
        kept.around,
        question.system.late_ticks,
        run=kept.run,
        broken_in=kept.broken_in,
        run_late=kept.run_late,
        looked=kept.looked,
        vacuous=kept.vacuous,
        assumed=kept.assumed,
        lasso=kept.lasso,
        fair=kept.fair,
        stuck=kept.stuck,
    )


def _to_keep(found: Across) -> _Kept:
    return _Kept(
        found.proved,
        found.timing.value,
        found.levels,
        found.by,
        found.around,
        found.vacuous,
        found.assumed,
        found.stuck,
        found.looked,
        tuple(map(dict, found.run)),
        found.broken_in,
        tuple(map(dict, found.run_late)),
        found.lasso,
        found.fair,
    )


def _key(question: Question) -> str:
    levels: Mapping[str, TransitionSystem] = {name: question.systems[name] for name in question.every}
    wires = tuple(
        (wire.source, wire.target)
        for wire in question.system.wires
        if {wire.source.partition(".")[0], wire.target.partition(".")[0]} & levels.keys()
    )
    told = (
        tuple((name, content(ts)) for name, ts in levels.items()),
        wires,
        question.system.tick_ms,
        question.system.late_ticks,
        replace(question.stated, doc=""),
        question.program.environment,
    )
    return hashlib.sha256(repr(told).encode()).hexdigest()
