"""Who obeys the orders of levels where no plant is given: each order is echoed after a while, and ends after another.

In: a stand and a seed. Out: parts that stand outside, one for each buffer of numbered orders that a level gives to nobody that is there.
They keep to the protocol, and to nothing else: delays, how an order ends and what is said beside it are drawn.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from random import Random

from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, STATUS
from rcsc.run.episodes.operator import between
from rcsc.run.episodes.stand import Stand
from rcsc.run.orders.numbered import Latest
from rcsc.run.orders.roles import DONE, FAILED, field_of
from rcsc.run.signature import Leaf, Value, Values

DELAYS = (0, 0, 1, 2, 8)
"""Ticks until an order is echoed, and from then until it ends."""
FAILS = 0.25
"""How often an order fails, but that to rest."""


@dataclass(slots=True)
class Subordinate:
    """One who obeys.

    Attributes:
        order, report: The buffers.
        given: The fields of an order, by name their places; `said` those of a report.
        leaves: Of a report, each with the values at which something may turn.
        done, failed: The statuses that end an order, `goes_on` one that does not.
    """

    order: str
    report: str
    given: Mapping[str, int]
    said: Mapping[str, int]
    leaves: tuple[tuple[Leaf, tuple[Value, ...]], ...]
    done: Value
    failed: Value
    goes_on: Value
    random: Random
    _taken: Value | None = None
    _waits: Values = ()
    _due: int = -1
    _ends: int = -1
    _now: tuple[Value, ...] = ()

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick: what it reports; nothing before its first order."""
        order = latest(self.order)
        if order is not None and order[self.given[NUMBER]] != self._taken:
            self._taken, self._waits = order[self.given[NUMBER]], order
            self._due = tick + self.random.choice(DELAYS)
        if self._waits and tick >= self._due:
            self._now = self._reported(self._waits)
            self._waits, self._ends = (), tick + self.random.choice(DELAYS)
        if self._now and tick == self._ends:
            rests = self._now[self.said[ECHOED]] == 0
            fails = not rests and self.random.random() < FAILS
            self._now = self._with(self._now, {STATUS: self.failed if fails else self.done})
        return {self.report: self._now} if self._now else {}

    def _reported(self, order: Values) -> tuple[Value, ...]:
        """Return the report on an order that is under way; what the protocol does not fill may be anything."""
        drawn = tuple(between(self.random, leaf, edges) for leaf, edges in self.leaves)
        protocol = {
            ECHO: order[self.given[NUMBER]],
            ECHOED: order[self.given[COMMAND]],
            STATUS: self.goes_on,
        }
        return self._with(drawn, protocol)

    def _with(self, report: Values, fields: Mapping[str, Value]) -> tuple[Value, ...]:
        by_place = {self.said[name]: value for name, value in fields.items()}
        return tuple(by_place.get(place, value) for place, value in enumerate(report))


def subordinates(its: Stand, seed: int) -> Iterator[Subordinate]:
    """Yield everybody outside to whom a level gives numbered orders, and who reports on them."""
    for down in its.system.wires:
        level, _, record = down.source.partition(".")
        party = down.target.partition(".")[0]
        if level not in its.signs or party in its.signs:
            continue
        for back in its.system.wires:
            owner, _, taken = back.target.partition(".")
            if owner != level or back.source.partition(".")[0] != party:
                continue
            given, leaves = its.signs[level].leaves_of(record), its.signs[level].leaves_of(taken)
            places, said = _places(given), _places(leaves)
            if {NUMBER, COMMAND} <= places.keys() and {ECHO, ECHOED, STATUS} <= said.keys():
                done, failed, goes_on = _statuses(its, level, record, leaves[said[STATUS]])
                edges = its.edges[level]
                yield Subordinate(
                    down.source, back.source, places, said, tuple((leaf, edges[leaf.name]) for leaf in leaves),
                    done, failed, goes_on, Random(f"{seed} {down.source}"),  # noqa: S311  # repeatable on purpose
                )  # fmt: skip


def _places(leaves: Sequence[Leaf]) -> dict[str, int]:
    return {field_of(leaf): place for place, leaf in enumerate(leaves)}


def _statuses(its: Stand, level: str, record: str, status: Leaf) -> tuple[Value, Value, Value]:
    """Return the statuses that mean done, failed and under way; where there is none for one of them, that for the one before."""
    roles = its.programs[level].roles
    role = next((one for one in (() if roles is None else roles.subordinates) if one.order == record), None)
    words = (DONE, FAILED) if role is None else (role.done, role.failed)
    done = status.members.index(words[0]) if words[0] in status.members else 0
    failed = status.members.index(words[1]) if words[1] in status.members else done
    goes_on = next((at for at in range(len(status.members)) if at not in {done, failed}), done)
    return done, failed, goes_on
