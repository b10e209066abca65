"""Watches what was proved of a system in every cycle of an episode.

In: claims, and the stand that they are about. Out: a `Property`: each claim that a cycle breaks, unless the episode broke something
before that the claim takes for granted: from then on that claims nothing. A claim that breaks here is a mistake of rcsc's, whatever the
tables say. What is taken for granted of the time that a command takes (that somebody answers, that values stand still) is looked at where
the command is (`endings`).
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from rcsc.lang.interpret import UNDEFINED, admit, holds
from rcsc.run.episodes.cycle import Broken, Cycle
from rcsc.run.episodes.proved.checks import CannotWatch, Check, check_of, contract
from rcsc.run.episodes.proved.claims import Claim, Claims, ProvedLevel, Trusted, Unwatched
from rcsc.run.episodes.proved.cycles import Now, Reader
from rcsc.run.episodes.proved.endings import Endings
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
        self._trusts = _Trusts(claims, stand, self._readers)
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
            strange = next((trust.words for trust in claim.trusts if not _known(trust)), "")
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


# --- what is taken for granted ---

MEANWHILE = frozenset({"ANSWERS", "RESTS", "STILL", "EXTERNS_FINITE", "NOT_FOR_EVER", "STATES"})
"""Kinds that no cycle alone can break."""


class _Trusts:
    """What claims take for granted.

    Attributes:
        broken: What an episode has broken, each with the level and what it was.
    """

    def __init__(self, claims: Claims, stand: Stand, readers: Mapping[str, Reader]) -> None:
        """Find how each is looked at."""
        self.broken: dict[Trusted, str] = {}
        self._of: dict[str, list[tuple[Trusted, Check]]] = {name: [] for name in readers}
        levels = {level.name: level for level in claims.levels}
        for trusted in dict.fromkeys(trust for claim in claims.every for trust in claim.trusts):
            for name, check in _looked_at(trusted, levels, readers, stand):
                self._of[name].append((trusted, check))

    def watch(self, name: str, now: Now) -> None:
        """A level has done a cycle."""
        for trusted, check in self._of[name]:
            if trusted not in self.broken and (wrong := check(now)):
                self.broken[trusted] = f"level `{name}`: {wrong}"


def _known(trusted: Trusted) -> bool:
    """Whether an episode can tell where it is broken."""
    return trusted.kind in _MAKERS or trusted.kind in MEANWHILE or trusted.kind == "PROTOCOL"


def _looked_at(
    trusted: Trusted, levels: Mapping[str, ProvedLevel], readers: Mapping[str, Reader], stand: Stand
) -> list[tuple[str, Check]]:
    if trusted.kind == "PROTOCOL":
        return [
            (name, contract(record, readers[name], level))
            for name, level in levels.items()
            for record in _records(level, trusted.level)
        ]
    maker = _MAKERS.get(trusted.kind)
    if maker is None or trusted.level not in readers:
        return []
    return [(trusted.level, maker(trusted, readers[trusted.level], stand))]


def _records(level: ProvedLevel, outside: str) -> list[str]:
    above = [level.above.order] if level.above is not None and level.above.name == outside else []
    return [*above, *(below.report for below in level.below if below.name == outside)]


def _refused(_: Trusted, reader: Reader, __: Stand) -> Check:
    """No cycle is refused; none would be that took what stands where the level begins anew."""

    def check(now: Now) -> str:
        if not now.took:
            return now.level.fault_text
        stood = admit(reader.program, reader.snapshot(now.before)) if now.restarted else {}
        return f"`{stood}` stood outside its range" if isinstance(stood, str) else ""

    return check


def _clamped(_: Trusted, reader: Reader, __: Stand) -> Check:
    """Inputs stand in their ranges where the level begins anew."""

    def check(now: Now) -> str:
        stood = reader.snapshot(now.before) if now.restarted else {}
        moved = admit(reader.program, stood) if stood else stood
        return "an input stood outside its range" if moved != stood else ""

    return check


def _declared(trusted: Trusted, reader: Reader, _: Stand) -> Check:
    """A fact that a table declares: as the first table of the cycle saw it, where that can be computed."""
    condition = next(fact.condition for fact in reader.program.assumptions if fact.name == trusted.name)
    tables = {str(table.name) for table in reader.program.tables if trusted.name in table.assumptions}

    def check(now: Now) -> str:
        if not now.took or not tables & {table for table, _ in now.lines}:
            return ""
        with suppress(*UNDEFINED):
            seen = reader.snapshot(now.values) if reader.asks else reader.prepared(now)
            if holds(condition, seen):
                return ""
        return f"`{trusted.name}` does not hold"

    return check


def _same_answer(trusted: Trusted, reader: Reader, stand: Stand) -> Check:
    """The same keys have the same answer as when they were last asked."""
    spec = next(spec for spec in stand.system.levels if spec.name == trusted.level)
    feed = next(feed for feed in spec.feeds if feed.into == trusted.name)
    keys, into = [reader.at(key) for key in feed.keys], reader.record(feed.into)
    asked: dict[Values, Values] = {}

    def check(now: Now) -> str:
        question = tuple(now.values[at] for at in keys)
        answer = now.values[into.start : into.stop]
        same = not now.took or asked.setdefault(question, answer) == answer
        return "" if same else f"`{trusted.name}` has another answer"

    return check


_MAKERS: Mapping[str, Callable[[Trusted, Reader, Stand], Check]] = {
    "DECLARED": _declared,
    "REFUSED": _refused,
    "CLAMPED": _clamped,
    "DATABASE": _same_answer,
}
