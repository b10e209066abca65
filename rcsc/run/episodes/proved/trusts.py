"""Whether an episode has broken something that a claim takes for granted.

In: what claims trust, and each cycle. Out: what was broken so far, and from then on claims nothing. What is taken for granted of the
time that a command takes (that somebody answers, that values stand still) is looked at where the command is (`endings`).
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING

from rcsc.lang.interpret import UNDEFINED, admit, holds
from rcsc.run.episodes.proved.checks import Check, contract
from rcsc.run.episodes.proved.claims import Claims, ProvedLevel, Trusted
from rcsc.run.episodes.proved.cycles import Now, Reader
from rcsc.run.episodes.stand import Stand

if TYPE_CHECKING:
    from rcsc.run.signature import Values

MEANWHILE = frozenset({"ANSWERS", "RESTS", "STILL", "EXTERNS_FINITE", "NOT_FOR_EVER", "STATES"})
"""Kinds that no cycle alone can break."""


class Trusts:
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
            for name, check in _checks(trusted, levels, readers, stand):
                self._of[name].append((trusted, check))

    def watch(self, name: str, now: Now) -> None:
        """A level has done a cycle."""
        for trusted, check in self._of[name]:
            if trusted not in self.broken and (wrong := check(now)):
                self.broken[trusted] = f"level `{name}`: {wrong}"


def known(trusted: Trusted) -> bool:
    """Whether an episode can tell where it is broken."""
    return trusted.kind in _MAKERS or trusted.kind in MEANWHILE or trusted.kind == "PROTOCOL"


def _checks(
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
