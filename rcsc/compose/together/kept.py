"""Verdicts on requirements across levels that an earlier run found.

The key is all that a verdict depends on: the requirement, what is assumed beside it, every level that writes to those it names, directly or
not, and how they are connected; and rcsc itself (`base.host.cache`). What is not proved is not kept: a run is looked for again.
"""

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rcsc.base.host.cache import Cache
from rcsc.compose.proof.candidates import content
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import Across, Question, Surroundings
from rcsc.proof.solvers import smt

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rcsc.compose.contract.transition import TransitionSystem


@dataclass(frozen=True, slots=True)
class _Kept:
    """A proof as it is kept."""

    timing: str
    levels: tuple[str, ...]
    by: str
    refuses: bool
    restarts: bool
    vacuous: bool
    assumed: tuple[str, ...]


def answered(question: Question, cache: Cache | None) -> Across:
    """Return the answer to a question: an earlier one, if nothing has changed and it was a proof."""
    key = _key(question)
    kept = None if cache is None else cache.load(_Kept, "across", key)
    if kept is not None:
        around = Surroundings(kept.refuses, kept.restarts)
        return Across(
            question.stated,
            True,
            Timing(kept.timing),
            kept.levels,
            kept.by,
            around,
            vacuous=kept.vacuous,
            late=question.system.late_ticks,
            assumed=kept.assumed,
        )
    cut_before = smt.cut_short()
    found = question.answer()
    if (
        cache is not None and found.proved and smt.cut_short() == cut_before
    ):  # else another machine might find something else
        around = found.around
        cache.store(
            _Kept(
                found.timing.value,
                found.levels,
                found.by,
                around.refuses,
                around.restarts,
                found.vacuous,
                found.assumed,
            ),
            "across",
            key,
        )
    return found


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
