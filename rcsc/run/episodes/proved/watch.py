"""Watches what was proved of a system in every cycle of an episode.

In: claims, and the stand that they are about. Out: a `Property`: each claim that a cycle breaks, unless the episode broke something
before that the claim takes for granted. A claim that breaks here is a mistake of rcsc's, whatever the tables say.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rcsc.run.episodes.cycle import Broken, Cycle
from rcsc.run.episodes.proved.checks import CannotWatch, Check, check_of
from rcsc.run.episodes.proved.claims import Claim, Claims, ProvedLevel, Unwatched
from rcsc.run.episodes.proved.cycles import Now, Reader
from rcsc.run.episodes.proved.endings import Endings
from rcsc.run.episodes.proved.trusts import Trusts, known
from rcsc.run.episodes.stand import Stand
from rcsc.run.levels import RunningLevel

if TYPE_CHECKING:
    from rcsc.run.signature import Values

PROVED = "proved"
"""The word in the name of what breaks."""


class ProvedHolds:
    """What was proved holds.

    Attributes:
        watched: The claims that are looked at; `unwatched`, those that cannot be, each with why.
    """

    def __init__(self, claims: Claims, stand: Stand) -> None:
        """Find how each claim is looked at."""
        self._readers = {level.name: _reader(level, stand) for level in claims.levels}
        self._trusts = Trusts(claims, stand, self._readers)
        self.watched: list[Claim] = []
        self.unwatched: list[Unwatched] = []
        self._checks: dict[str, list[tuple[Claim, Check]]] = {}
        self._endings: dict[str, Endings] = {}
        for level in claims.levels:
            self._take(level)
        self._before: dict[str, Values] = {}
        self._stood: dict[str, Values] = {}
        self._anew: set[str] = set(self._readers)
        self._restarted: set[str] = set()

    def _take(self, level: ProvedLevel) -> None:
        reader, ending = self._readers[level.name], dict[str, Claim]()
        checks = self._checks.setdefault(level.name, [])
        for claim in level.claims:
            strange = next((trust.words for trust in claim.trusts if not known(trust)), "")
            try:
                if strange:
                    raise CannotWatch(f"it trusts that {strange}")  # noqa: TRY301  # one place tells all
                if claim.kind == "ENDS":
                    ending[claim.table] = claim
                else:
                    checks.append((claim, check_of(claim, reader, level)))
                self.watched.append(claim)
            except CannotWatch as why:
                self.unwatched.append((claim, str(why)))
        if ending:
            self._endings[level.name] = Endings(level, reader, ending)

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the claims that this cycle breaks."""
        for name in cycle.restarted & self._readers.keys():
            self._before[name] = self._stood[name] = cycle.before[name]
            self._anew.add(name)
            self._restarted.add(name)
        ran = [(level.name, self._now(cycle, level)) for level in cycle.ran if level.name in self._readers]
        for name, now in ran:
            self._trusts.watch(name, now)
        for name, now in ran:
            for claim, wrong in self._wrong(name, now):
                if not any(trust in self._trusts.broken for trust in claim.trusts):
                    yield Broken(f"{name}: {PROVED}: {claim.words}", wrong, name, proved=True)

    def untrusted(self, level: str) -> Iterator[str]:
        """Yield what was broken so far of what claims about a level take for granted."""
        claims = [claim for claim, _ in self._checks.get(level, ())]
        for trusted in dict.fromkeys(trust for claim in claims for trust in claim.trusts):
            if trusted in self._trusts.broken:
                yield f"{trusted.words} ({self._trusts.broken[trusted]})"

    def _now(self, cycle: Cycle, level: RunningLevel) -> Now:
        name, values = level.name, level.values
        before = self._before.get(name) or cycle.before[name]
        stood = self._stood.setdefault(name, before)
        anew = name in self._anew, name in self._restarted
        now = Now(level, before, stood, values, level.fault, *anew, level.lines)
        self._before[name] = values
        if now.took:
            self._stood[name] = values
            self._anew.discard(name)
            self._restarted.discard(name)
        return now

    def _wrong(self, name: str, now: Now) -> Iterator[tuple[Claim, str]]:
        for claim, check in self._checks[name]:
            if wrong := check(now):
                yield claim, wrong
        if name in self._endings:
            found = self._endings[name].broken(now)
            if found is not None:
                yield found


def _reader(level: ProvedLevel, stand: Stand) -> Reader:
    program = stand.programs[level.name]
    return Reader(
        program, next(one for one in program.levels if one.name == level.name), stand.signs[level.name]
    )
