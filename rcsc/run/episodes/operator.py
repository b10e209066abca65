"""Who gives the orders of an episode: to each level its own, one after the other, at, after or before the end of the one before.

In: orders. Out: what stands in the order buffers, and how each order ended.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from random import Random

from rcsc.lang.restart import COMMAND
from rcsc.run.episodes.episode import OrderSpec, Setting
from rcsc.run.episodes.outcome import RowEnd
from rcsc.run.orders.numbered import Latest, Orders
from rcsc.run.orders.operator import answer_reason, line_to
from rcsc.run.orders.roles import DONE, FAILED, Served
from rcsc.run.signature import REALS, Leaf, Value, Values

NO_NUMBER = "nan"
"""How an episode has a reading that is no number: JSON has none."""
CHANGED, WAITING = "changed", "waiting"


def value_of(leaf: Leaf, setting: Setting) -> Value:
    """Return the value of a leaf that a word or a number means; a number may lie outside its range, or be no member's.

    Raises:
        ValueError: It is none of the leaf's type.
    """
    if leaf.members and type(setting) is not int:
        if setting not in leaf.members:
            raise ValueError(f"`{setting}` is no value of `{leaf.name}`")
        return leaf.members.index(str(setting))
    if leaf.c_type in REALS and setting == NO_NUMBER:
        return math.nan
    if leaf.c_type in REALS and type(setting) in (int, float):
        return leaf.held(float(setting))
    if type(setting) is (bool if leaf.c_type == "bool" else int):
        return setting
    raise ValueError(f"`{setting}` is no value of `{leaf.name}`")


def setting_of(leaf: Leaf, value: Value) -> Setting:
    """Return the word or number that means a value."""
    return leaf.members[int(value)] if leaf.members and 0 <= value < len(leaf.members) else value


def between(random: Random, leaf: Leaf, edges: Sequence[Value]) -> Value:
    """Return a value of a leaf: mostly an edge, else anywhere in its range."""
    low, high = leaf.low, leaf.high
    if leaf.members or leaf.c_type == "bool" or low is None or high is None or random.random() < 0.6:
        return random.choice(edges)
    return leaf.anywhere(random, low, high)


def order_of(served: Served, spec: OrderSpec) -> tuple[Value, ...]:
    """Return the fields of an order but its number.

    Raises:
        ValueError: The order has no such field, or a value is none of the field's.
    """
    given = {one.name: one.value for one in spec.fields}
    if stray := sorted(set(given) - (served.fields.keys() - {COMMAND})):
        raise ValueError(f"an order to `{served.level}` has no field `{stray[0]}`")
    settings = {COMMAND: spec.command, **given}
    return served.order_with(
        {name: value_of(leaf, settings[name]) for name, leaf in served.fields.items() if name in settings}
    )


@dataclass(frozen=True, slots=True)
class Given:
    """An order that was given.

    Attributes:
        number: Of the order in the episode, from 1.
        tick: In which it was given.
        rests: Whether it is the command that rests.
    """

    number: int
    spec: OrderSpec
    tick: int
    rests: bool

    @property
    def text(self) -> str:
        """As it is shown."""
        fields = (f"{part.name}={part.value}" for part in self.spec.fields)
        return " ".join((self.spec.command, *fields))


@dataclass(slots=True)
class OrderLine:
    """The orders to one level.

    Attributes:
        given: The order that stands; None before the first.
        ended: In which tick it was seen to end; None while it is under way.
    """

    served: Served
    specs: Sequence[tuple[int, OrderSpec]]
    line: Orders
    given: Given | None = None
    ended: int | None = None
    at: int = 0

    @property
    def over(self) -> bool:
        """Whether the last order has ended."""
        return self.at >= len(self.specs) and (self.given is None or self.ended is not None)

    def step(self, tick: int, latest: Latest) -> Iterator[RowEnd]:
        """One tick: what became of the order that stands, and the next where it is due."""
        self.line.catch_up(latest)
        if self.given is not None and self.ended is None:
            state, reason = self._answer(latest)
            if state:
                self.ended = tick
                yield self.end(state, reason, tick)
        if self.at < len(self.specs) and self._due(tick, self.specs[self.at][1]):
            if self.given is not None and self.ended is None:
                yield self.end(CHANGED, "", tick)
            number, spec = self.specs[self.at]
            values = order_of(self.served, spec)
            self.line.send(values)
            self.at, self.ended = self.at + 1, None
            leaf = self.served.order_leaves[self.served.command]
            self.given = Given(number, spec, tick, leaf.members.index(spec.command) == self.served.rest)

    def end(self, state: str, reason: str, tick: int) -> RowEnd:
        """Return how the order that stands ended."""
        assert self.given is not None
        return RowEnd(self.given.number, self.given.text, state, reason, tick - self.given.tick)

    def _due(self, tick: int, spec: OrderSpec) -> bool:
        if self.given is None:
            return tick >= spec.wait
        since = self.given.tick if spec.interrupts else self.ended
        return since is not None and tick - since >= spec.wait

    def _answer(self, latest: Latest) -> tuple[str, str]:
        """`done` or `failed`, and what the report says beside it; empty while the order is under way."""
        report, served = self.line.answer(latest), self.served
        status = "" if report is None else served.report_leaves[served.status].shown(report[served.status])
        if report is None or status not in (served.done, served.failed):
            return "", ""
        return (DONE, "") if status == served.done else (FAILED, answer_reason(served, report))


@dataclass(slots=True)
class EpisodeOperator:
    """Gives the orders of an episode: `rcsc.run.system.Outside`.

    Attributes:
        ends: Orders that have ended, or that another one changed.
    """

    lines: tuple[OrderLine, ...]
    ends: list[RowEnd] = field(default_factory=list)

    @property
    def over(self) -> bool:
        """Whether every order was given, and has ended."""
        return all(line.over for line in self.lines)

    @property
    def faults(self) -> frozenset[str]:
        """The plant's faults that are on because of orders under way."""
        under_way = (line.given for line in self.lines if line.given is not None and line.ended is None)
        return frozenset(fault for given in under_way for fault in given.spec.faults)

    def step(self, tick: int, latest: Latest) -> Mapping[str, Values]:
        """One tick: what stands in the order buffers."""
        for line in self.lines:
            self.ends += line.step(tick, latest)
        return {line.line.order: line.line.sent for line in self.lines if line.line.sent}


def operator(served: Sequence[Served], orders: Sequence[OrderSpec]) -> EpisodeOperator:
    """Return an operator that gives these orders.

    Raises:
        ValueError: An order is to a level that nobody outside orders, or has what the level's orders have not.
    """
    by_level = {level.level: level for level in served}
    for spec in orders:
        if spec.level not in by_level:
            raise ValueError(f"no level `{spec.level}` is ordered from outside")
        order_of(by_level[spec.level], spec)
    numbered = list(enumerate(orders, 1))
    return EpisodeOperator(
        tuple(
            OrderLine(level, [(at, spec) for at, spec in numbered if spec.level == name], line_to(level))
            for name, level in by_level.items()
        )
    )
