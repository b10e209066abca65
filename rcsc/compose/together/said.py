"""A verdict on a requirement across levels in words, the same wherever it is told.

In: an answer, and what it rests on. Out: text.
"""

from collections.abc import Collection

from rcsc.base.diagnostics import report
from rcsc.code.testing.figures import counted
from rcsc.compose.contract.claims import Closed, Need, declared, spelled
from rcsc.compose.together.product import Timing
from rcsc.compose.together.proof import NEVER_LATE, NO_RESTART, Across


def said(found: Across, closed: Closed, claims: Collection[Need]) -> str:
    """Return the verdict in words, with the timing, the levels, what it rests on and what it trusts.

    Args:
        found: The answer.
        closed: The same with all that it rests on.
        claims: Those of the levels that are known.
    """
    levels = ", ".join(f"`{name}`" for name in found.levels)
    if not found.proved:
        if found.refuted and found.lasso:
            return f"refuted, as scheduled, by a run of {levels} on which it waits for ever"
        if found.refuted:
            how = "with late buffers" if any(found.run_late) else "as scheduled"
            return f"refuted in tick {len(found.run)}, {how}, by a run of {levels}"
        if found.stuck:
            return "open: what is assumed across levels was not shown to be kept for ever"
        return f"open: no run of {counted(found.looked, 'tick')} of {levels} breaks it"
    where = f"{timing_of(found)}, of {levels}{f', {found.by}' if found.by else ''}"
    if closed.lacks:
        lacking = report.named([spelled(need, "", claims) for need in closed.lacks])
        return f"rests on {lacking}; given that, proved {where}"
    return f"{'vacuous, ' if found.vacuous else ''}proved {where}{report.trusting(trusts_of(found, closed))}"


def timing_of(found: Across) -> str:
    """Return under which timing something is proved, in words."""
    match found.timing:
        case Timing.ANY:
            return "under any timing"
        case Timing.LATE:
            return f"with buffers at most {counted(found.late, 'tick')} late"
        case Timing.SCHEDULED:
            return "as scheduled"


def trusts_of(found: Across, closed: Closed) -> list[str]:
    """Return what a verdict trusts that people have to know: assumptions, refusals, restarts, buffers in time, what is to come."""
    own = {NO_RESTART, NEVER_LATE, *found.fair}
    return [*declared(closed.trusts), *(trust for trust in closed.trusts if trust in own)]


def state(found: Across, closed: Closed) -> str:
    """Return the verdict in one word."""
    if found.proved:
        return "proved" if closed.proved else "conditional"
    return "refuted" if found.refuted else "open"
