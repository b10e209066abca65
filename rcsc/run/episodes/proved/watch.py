"""Watches what was proved of a system in every cycle of an episode.

In: claims, and the stand that they are about. Out: a `Property`: each claim that a cycle breaks, unless the episode broke something
before that the claim takes for granted: from then on that claims nothing. A claim that breaks here is a mistake of rcsc's, whatever the
tables say. What is taken for granted of the time that a command takes (that somebody answers, that values stand still) is looked at where
the command is.

A command that was proved to end goes on for ever if all is as it was before some earlier cycle of it, but for the numbers of orders and
their echoes; if it was unanswered in between; if each subordinate was given another order in between, or had answered throughout; and if
what was taken to stand still did: then the same may happen again and again (`rcsc.compose.counterexample.lasso`, on values). No bound is
guessed: such a round is a run without an end.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from rcsc.lang.interpret import UNDEFINED, Fault, admit, holds
from rcsc.lang.interpret import cycle as one_cycle
from rcsc.lang.model import Property, Value
from rcsc.lang.over_time import Watch
from rcsc.lang.restart import ECHO, ECHOED, NUMBER, NUMBERS, STATUS
from rcsc.run.episodes.cycle import Broken, Cycle
from rcsc.run.episodes.proved.checks import CannotWatch, Check, check_of, contract
from rcsc.run.episodes.proved.claims import (
    ASSUMED,
    RESTARTS,
    AcrossClaim,
    Claim,
    Claims,
    ProvedLevel,
    Trusted,
    Unwatched,
    WatchedNeighbour,
)
from rcsc.run.episodes.proved.cycles import Now, Reader
from rcsc.run.episodes.stand import Stand
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Leaf, Values

PROVED = "proved"
"""The word in the name of what breaks."""


class ProvedHolds:
    """What was proved holds.

    Attributes:
        watched: The claims that are looked at; `unwatched`, those that cannot be, each with why.
        together: The claims across levels that are looked at, by name.
    """

    def __init__(self, claims: Claims, stand: Stand) -> None:
        """Find how each claim is looked at."""
        self._readers = {level.name: _reader(level, stand) for level in claims.levels}
        self._trusts = _Trusts(claims, stand, self._readers)
        self.watched: list[Claim] = []
        self.unwatched: list[Unwatched] = []
        self._checks: dict[str, list[tuple[Claim, Check]]] = {}
        self._endings: dict[str, _Endings] = {}
        self.together = {claim.name: claim for claim in claims.across if all(map(_known, claim.trusts))}
        for level in claims.levels:
            self._take(level)
        self._before: dict[str, Values] = {}
        self._stood: dict[str, Values] = {}
        self._anew: set[str] = set(self._readers)
        self._restarted: set[str] = set()
        self._begins: set[str] = set(self._readers)

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
            self._endings[level.name] = _Endings(level, reader, ending)

    def watch(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield the claims that this cycle breaks."""
        for name in cycle.restarted & self._readers.keys():
            self._before[name] = self._stood[name] = cycle.before[name]
            self._anew.add(name)
            self._restarted.add(name)
            self._begins.add(name)
        ran = [(level.name, self._now(cycle, level)) for level in cycle.ran if level.name in self._readers]
        for name, now in ran:
            self._trusts.watch(name, now)
        self._trusts.together(cycle)
        for name, now in ran:
            for claim, wrong in self._wrong(name, now):
                if not any(trust in self._trusts.broken for trust in claim.trusts):
                    yield Broken(f"{name}: {PROVED}: {claim.words}", wrong, name, proved=True)
        yield from self._across(cycle)

    def _across(self, cycle: Cycle) -> Iterator[Broken]:
        """Yield what is broken of what was proved across levels."""
        for stated, shown in cycle.broken:
            claim = self.together.get(stated.name)
            if claim is None or (claim.scheduled and cycle.unscheduled):
                continue
            if not any(trust in self._trusts.broken for trust in claim.trusts):
                name = f"{PROVED}: {stated.word} `{claim.name}` across levels"
                yield Broken(name, f"`{stated.text}` is broken: {shown}", proved=True, across=True)

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
        anew = name in self._anew, name in self._restarted, name in self._begins
        now = Now(level, before, stood, values, level.fault, *anew, level.lines)
        self._before[name] = values
        self._begins.discard(name)
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
SCHEDULES = frozenset({"SCHEDULED", "LATE"})
"""Kinds that a buffer between levels breaks which does not come as scheduled."""


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
        stated: tuple[Claim | AcrossClaim, ...] = (*claims.every, *claims.across)
        every = dict.fromkeys(trust for claim in stated for trust in claim.trusts)
        self._whole = tuple(trust for trust in every if trust.kind in {*SCHEDULES, RESTARTS, ASSUMED})
        for trusted in every:
            for name, check in _looked_at(trusted, levels, readers, stand):
                self._of[name].append((trusted, check))

    def watch(self, name: str, now: Now) -> None:
        """A level has done a cycle."""
        for trusted, check in self._of[name]:
            if trusted not in self.broken and (wrong := check(now)):
                self.broken[trusted] = f"level `{name}`: {wrong}"

    def together(self, cycle: Cycle) -> None:
        """All levels have done a cycle: what is trusted of all of them, and across them."""
        assumed = {stated.name for stated, _ in cycle.broken if stated.assumed}
        for trusted in self._whole:
            begins = trusted.kind == RESTARTS and cycle.restarted
            late = trusted.kind in SCHEDULES and cycle.unscheduled
            if begins or late or (trusted.kind == ASSUMED and trusted.name in assumed):
                self.broken.setdefault(trusted, f"cycle {cycle.tick}")


def _known(trusted: Trusted) -> bool:
    """Whether an episode can tell where it is broken."""
    return (
        trusted.kind in _MAKERS
        or trusted.kind in MEANWHILE
        or trusted.kind in {"PROTOCOL", RESTARTS, ASSUMED, *SCHEDULES}
    )


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
    """A fact that a table declares: as the first table of the cycle saw it, where that can be computed; or one over time."""
    for stated in reader.program.environment:
        if stated.name == trusted.name:
            return _over_time(stated, reader)
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


def _over_time(stated: Property, reader: Reader) -> Check:
    """What is assumed over time of what comes from outside: each cycle is one of the run, a refused one, too."""
    watch = Watch(stated)

    def check(now: Now) -> str:
        if now.begins:
            watch.begin()
        kept = watch.keeps(reader.snapshot(now.before), reader.snapshot(now.values))
        return "" if kept else f"`{stated.name}` does not hold"

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


# --- commands that end ---

MOST_CYCLES = 400
"""Of one command that are remembered."""
MOST_ROUNDS = 4
"""Earlier cycles from which a round may come that are looked at, the latest first."""
_SPEAKS = (NUMBER, ECHO, ECHOED, STATUS)


@dataclass(frozen=True, slots=True)
class _Step:
    """A cycle of one command.

    Attributes:
        before: What the level had before it, numbers of orders and echoes left out.
        waits: Whether the command is unanswered after it; `due`, by subordinate whether its last order is unanswered in it.
        sent: The numbers of orders before it; `echoed`, whether each was echoed.
        held: By record what it took in what is said to stand still.
    """

    before: Values
    waits: bool
    due: tuple[bool, ...]
    sent: tuple[Value, ...]
    echoed: tuple[bool, ...]
    held: dict[str, Values]
    taken: Values


@dataclass(slots=True)
class _Endings:
    """The commands of one level that were proved to end.

    Attributes:
        claims: By table.
    """

    level: ProvedLevel
    reader: Reader
    claims: dict[str, Claim]
    _steps: list[_Step] = field(default_factory=list)
    _places: dict[Values, list[int]] = field(default_factory=dict)
    _table: str = ""
    _kept: tuple[int, ...] = field(init=False)
    _records: dict[str, tuple[int, ...]] = field(init=False)

    def __post_init__(self) -> None:
        """Find the places of what comes round, and of what stands still."""
        moving = {leaf for below in self.level.below for leaf in (below.number, below.echo)}
        leaves = self.reader.sign.leaves
        self._kept = tuple(at for at, leaf in enumerate(leaves) if leaf.name not in moving)
        still = {record for claim in self.claims.values() for record in claim.about}
        own = still - set(self.level.filled)  # what a level writes is nobody's to hold still
        own |= {record for claim in self.claims.values() for record in claim.stands}
        self._records = {
            record: tuple(at for at in self.reader.record(record) if not _speaks(leaves[at]))
            for record in own
        }

    def broken(self, now: Now) -> tuple[Claim, str] | None:
        """Return the claim that a round of the level breaks, which ends with this cycle, and the round in words."""
        above = self.level.above
        assert above is not None
        table, number = now.lines[-1][0] if now.lines else "", self.reader.at(above.number)
        goes_on = now.fault == 0 and table == self._table and now.stood[number] == now.values[number]
        if now.anew or not goes_on or len(self._steps) >= MOST_CYCLES:
            self._forget()
        self._table = table if now.fault == 0 and table in self.claims else ""
        if not self._table or now.anew or now.stood[number] != now.values[number]:
            return None
        step = self._step(above, now)
        self._places.setdefault(step.before, []).append(len(self._steps))
        self._steps.append(step)
        claim = self.claims[table]
        first = next(self._rounds(claim, now), None)
        if first is None:
            return None
        cycles = len(self._steps) - first
        self._forget()
        again = "the cycle before" if cycles == 1 else f"{cycles} cycles before"
        return claim, f"line `{now.level.line}`: all is as {again}, and the command is not answered"

    def _forget(self) -> None:
        self._steps.clear()
        self._places.clear()

    def _step(self, above: WatchedNeighbour, now: Now) -> _Step:
        at, below = self.reader.at, self.level.below
        waits = not _ended(self.reader, above, now.values, now.values)
        return _Step(
            self._round(now.before),
            waits,
            tuple(not self._answered(one, now) for one in below),
            tuple(now.before[at(one.number)] for one in below),
            tuple(now.before[at(one.echo)] == now.before[at(one.number)] for one in below),
            {
                record: tuple(now.values[place] for place in places)
                for record, places in self._records.items()
            },
            tuple(now.values[place] for place in self.reader.inputs),
        )

    def _round(self, values: Values) -> Values:
        return tuple(values[at] for at in self._kept)

    def _answered(self, below: WatchedNeighbour, now: Now) -> bool:
        at = self.reader.at
        echoed = now.values[at(below.echo)] == now.before[at(below.number)]
        if echoed and _ended(self.reader, below, now.before, now.values):
            return True
        rests = now.before[at(below.command)] == 0
        return below.in_time and bool(below.late) and bool(now.values[at(below.late)]) and not rests

    def _rounds(self, claim: Claim, now: Now) -> Iterator[int]:
        """Yield the first cycles of rounds that end with this one, the shortest round first."""
        after, at = self._round(now.values), self.reader.at
        sent = [now.values[at(below.number)] for below in self.level.below]
        echoed = tuple(
            now.values[at(below.echo)] == now.values[at(below.number)] for below in self.level.below
        )
        held = [record for record in (*claim.about, *claim.stands) if record in self._records]
        for first in reversed(self._places.get(after, [])[-MOST_ROUNDS:]):
            steps, begun = self._steps[first:], self._steps[first]
            if any(len({step.held[record] for step in steps}) > 1 for record in held):
                continue
            late = [any(step.due[place] for step in steps) for place in range(len(sent))]
            fair = all(
                not is_late or was != is_ for is_late, was, is_ in zip(late, begun.sent, sent, strict=True)
            )
            waits = any(step.waits for step in steps)
            if waits and fair and begun.echoed == echoed and self._again(first, now):
                yield first

    def _again(self, first: int, now: Now) -> bool:
        """Whether the interpreter goes through the same round once more, with echoes as much later as the orders."""
        if self.reader.asks:
            return True
        state, names = self.reader.snapshot(now.values), self.reader.sign.leaves
        later = {
            self.reader.at(below.echo): int(now.values[self.reader.at(below.number)]) - int(sent)
            for below, sent in zip(self.level.below, self._steps[first].sent, strict=True)
        }
        for step in self._steps[first:]:
            if tuple(state[names[at].name] for at in self._kept) != step.before:
                return False
            for at, value in zip(self.reader.inputs, step.taken, strict=True):
                moved = (int(value) + later[at]) % NUMBERS if at in later else value
                state[names[at].name] = moved
            try:
                outcome = one_cycle(self.reader.program, self.reader.level, state)
            except UNDEFINED:
                return False
            if outcome.fault is not Fault.OK:
                return False
            state = outcome.snapshot
        return tuple(state[names[at].name] for at in self._kept) == self._steps[first].before


def _ended(reader: Reader, end: WatchedNeighbour, ordered: Values, reported: Values) -> bool:
    """Whether a report ends its order: *done* or *failed*; the first command *done* alone."""
    leaf = reader.sign.leaves[reader.at(end.status)]
    status = leaf.shown(reported[reader.at(end.status)])
    return status == end.done or (status == end.failed and ordered[reader.at(end.command)] != 0)


def _speaks(leaf: Leaf) -> bool:
    return leaf.name.rpartition(".")[2] in _SPEAKS
