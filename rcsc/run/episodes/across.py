"""What is stated across levels, in episodes: requirements that the levels keep together, and what is assumed of what stands outside.

In: what a cycle breaks of it (`run.log.across`), and claims. Out: `Broken`s.

A requirement is of the system as it is scheduled: where a buffer between levels was late, or lost or repeated a value, only what is proved
under any timing is asked for. Restarts and refused inputs are part of both timings. After an assumption is broken nothing is asked for.
"""

from collections.abc import Iterator

from rcsc.lang.model import Property
from rcsc.run.episodes.cycle import Broken, Cycle
from rcsc.run.episodes.proved.claims import AcrossClaim, Claims
from rcsc.run.episodes.stand import Stand
from rcsc.run.log.across import places_of

ACROSS = "across levels"
"""What stands before the name of what is broken, as the name of a level does."""


class AcrossHolds:
    """What is stated across levels holds, and what stands outside keeps what is assumed."""

    def __init__(self, stand: Stand, claims: Claims) -> None:
        self._stand, self._claims = stand, {claim.name: claim for claim in claims.across}
        self._broken = ""

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield what this cycle breaks, assumptions first."""
        for stated, shown in cycle.broken:
            yield (
                self._assumed(stated, shown, cycle)
                if stated.assumed
                else self._required(stated, shown, cycle)
            )

    def _assumed(self, stated: Property, shown: str, cycle: Cycle) -> Broken:
        self._broken = (
            self._broken or f"assumption `{stated.name}` across levels was broken in cycle {cycle.tick}"
        )
        text = f"what stands outside does not keep `{stated.text}`: {shown}"
        places = places_of(stated, self._stand.system, self._stand.signs)
        taken = tuple(
            f"{level}.{self._stand.signs[level].leaves[at].name}"
            for place in places.values()
            if place.buffer
            for level, at in place.levels
        )
        return Broken(f"{ACROSS}: assumption {stated.name}", text, leaves=taken, outside=True, across=True)

    def _required(self, stated: Property, shown: str, cycle: Cycle) -> Broken:
        text = f"`{stated.text}` is broken: {shown}"
        claim = self._claims.get(stated.name)
        because = self._broken or _unscheduled(claim, cycle)
        if claim is not None and not because:
            text += "".join(f"; it is proved trusting that {trust.words}" for trust in claim.trusts[:1])
        return Broken(f"{ACROSS}: {stated.name}", text, across=True, because=because)


def _unscheduled(claim: AcrossClaim | None, cycle: Cycle) -> str:
    """Return the fault by which the cycle is none of the system as it is scheduled; empty where that explains nothing."""
    if not cycle.unscheduled or (claim is not None and not claim.scheduled):
        return ""
    known = f"it is proved {claim.words} only" if claim is not None else "it is not proved under any timing"
    return f"{cycle.unscheduled}, and {known}"
