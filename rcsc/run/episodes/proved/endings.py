"""Commands that were proved to end, and a level that comes round to where it was while nothing new happens.

In: a level's claims that its commands end. Out: a check of its cycles. A command that was proved to end goes on for ever if all is as it
was before some earlier cycle of it, but for the numbers of orders and their echoes; if it was unanswered in between; if each subordinate
was given another order in between, or had answered throughout; and if what was taken to stand still did: then the same may
happen again and again (`rcsc.compose.counterexample.lasso`, on values). No bound is guessed: such a round is a run without an end.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from rcsc.lang.interpret import UNDEFINED, Fault, cycle
from rcsc.lang.model import Value
from rcsc.lang.restart import ECHO, ECHOED, NUMBER, NUMBERS, STATUS
from rcsc.run.episodes.proved.claims import Claim, ProvedLevel, WatchedNeighbour
from rcsc.run.episodes.proved.cycles import Now, Reader
from rcsc.run.signature import Leaf, Values

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
class Endings:
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
                outcome = cycle(self.reader.program, self.reader.level, state)
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
