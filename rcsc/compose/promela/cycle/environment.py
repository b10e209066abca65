"""What stands around a level in a model: by the contract what is not in it, and what is, as it is.

In: a level's links, and the other levels of the model. Out: flat statements. A neighbour that is not in the model keeps to the contract
(`compose.__doc__`) and does nothing else: between two cycles it may have written any number of times, of which the level sees the last.
A neighbour that is in it is read whole; there the contract is not assumed but checked.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.compose.contract.environment import (
    COMMAND,
    ECHO,
    ECHOED,
    NUMBER,
    STATUS,
    Above,
    Asked,
    Below,
    leaves_under,
)
from rcsc.compose.contract.transition import NUMBERS, TransitionSystem
from rcsc.compose.promela.cycle.aims import CONTRACT_ABOVE, CONTRACT_BELOW, Aim, Aims
from rcsc.compose.promela.cycle.statements import (
    BOOL,
    YES,
    Flat,
    Flattener,
    Forget,
    Fork,
    Put,
    both,
    either,
    negation,
    read,
    same,
)
from rcsc.lang.model import Apply, Expr, Int, Kind, Literal, Op, Read

STALE = "stale"
"""All numbers have gone round while one of them was still on its way: what freshness excludes ends the run."""


@dataclass(slots=True)
class Environment:
    """The environment of one level.

    Attributes:
        inside: The levels of the model, by name.
        full: Names that are given any value of their type; grows.
        numbers: Names of numbers that orders count up or are counted by; grows.
    """

    flat: Flattener
    ts: TransitionSystem
    inside: Mapping[str, TransitionSystem]
    aims: Aims
    full: set[str] = field(default_factory=set)
    numbers: list[str] = field(default_factory=list)

    def taken(self) -> Iterable[Flat]:
        """Buffers of levels in the model, each read whole."""
        links = self.ts.links
        if (above := links.above) is not None and above.name in self.inside:
            upper = next(one for one in self.inside[above.name].links.below if one.name == self.ts.level.name)
            yield from self._copied(above.order, f"{above.name}:{upper.order}")
        for below in links.below:
            if below.name in self.inside:
                lower = self.inside[below.name].links.above
                assert lower is not None
                yield from self._copied(below.report, f"{below.name}:{lower.report}")

    def begin(self) -> Iterable[Flat]:
        """What the others say in this cycle."""
        links = self.ts.links
        yield self._forget(links.free)
        if (above := links.above) is not None:
            self.numbers.append(self.flat.name(f"{above.order}.{NUMBER}"))
            yield from self._order_seen(above) if above.name in self.inside else self._ordered(above)
        for below in links.below:
            self.numbers.append(self.flat.name(f"{below.order}.{NUMBER}"))
            yield from self._report_seen(below) if below.name in self.inside else self._reported(below)
        for asked in links.asked:
            yield from self._answered(asked)

    def end(self) -> Iterable[Flat]:
        """What is remembered of this cycle, and whether the numbers have gone round."""
        for below in self.ts.links.below:
            if below.name not in self.inside:
                continue
            sent, echo = self._sent(below), self._echo(below)
            yield Put(str(self._had_echoed(below).name), same(echo, sent))
            yield Fork(((same(echo, successor(sent)), (Put(STALE, YES),)),))

    def anew(self) -> Iterable[Flat]:
        """Before a restart: every buffer may hold anything, and nothing was asked."""
        inputs = tuple(str(v.name) for v in self.ts.program.variables if v.kind is Kind.INPUT)
        echoes = {f"{below.report}.{ECHO}" for below in self.ts.links.below}
        number = "" if self.ts.links.above is None else f"{self.ts.links.above.order}.{NUMBER}"
        yield self._forget(tuple(leaf for leaf in inputs if leaf not in echoes and leaf != number))

    # --- outside the model ---

    def _forget(self, leaves: Iterable[str]) -> Forget:
        names = tuple(map(self.flat.name, leaves))
        self.flat.lazy.update(names)
        return Forget(names)

    def _ordered(self, above: Above) -> Iterable[Flat]:
        """Another order, or the same once more; what is not numbered may be anything in every cycle."""
        number = self.flat.leaf(f"{above.order}.{NUMBER}")
        another = self.flat.new("another order", BOOL, lazy=True)
        numbered = self._forget(above.numbered)
        order = leaves_under(self.ts.program, above.order)
        self.full.add(self.flat.name(f"{above.order}.{COMMAND}"))
        yield Put(str(self.last_number(above).name), number)
        yield Fork(((another, (Put(str(number.name), successor(number)), numbered)),))
        yield self._forget(
            leaf for leaf in order if leaf not in above.numbered and leaf != f"{above.order}.{NUMBER}"
        )

    def _reported(self, below: Below) -> Iterable[Flat]:
        """The echo of the last order, once there for good; else of the one before, about which anything may be said."""
        sent, echo = self._sent(below), self._echo(below)
        late = self.flat.new(f"{below.name} is late", BOOL, lazy=True)
        echoed = f"{below.report}.{ECHOED}"
        self.full |= {self.flat.name(echoed), self.flat.name(f"{below.report}.{STATUS}")}
        yield self._forget(
            leaf for leaf in leaves_under(self.ts.program, below.report) if leaf != f"{below.report}.{ECHO}"
        )
        answered = (
            Put(str(echo.name), sent),
            Put(self.flat.name(echoed), self.flat.leaf(f"{below.order}.{COMMAND}")),
        )
        older = (Put(str(echo.name), predecessor(sent)),)
        yield Fork(((either(same(echo, sent), negation(late)), answered),), older)

    def _answered(self, asked: Asked) -> Iterable[Flat]:
        """The same question has the same answer."""
        before = self.flat.new(f"asked {asked.into}", BOOL)
        again: Expr = before
        remember = [Put(str(before.name), YES)]
        for key in asked.keys:
            now = self.flat.leaf(key)
            old = self.flat.new(f"asked {asked.into} {key}", now.type)
            again = both(again, same(old, now))
            remember.append(Put(str(old.name), now))
        yield Fork(((again, ()),), (self._forget(asked.leaves),))
        yield from remember

    # --- in the model ---

    def _copied(self, record: str, source: str) -> Iterable[Flat]:
        for leaf in leaves_under(self.ts.program, record):
            yield Put(
                self.flat.name(leaf), read(f"{source}{leaf.removeprefix(record)}", self.flat.leaf(leaf).type)
            )

    def _order_seen(self, above: Above) -> Iterable[Flat]:
        number = self.flat.leaf(f"{above.order}.{NUMBER}")
        last = self.last_number(above)
        taken = self.flat.new("number taken", number.type)
        kept: Expr = YES
        remember = [Put(str(taken.name), number)]
        for leaf in above.numbered:
            now = self.flat.leaf(leaf)
            old = self.flat.new(f"{leaf} taken", now.type, self.flat.starts[self.flat.name(leaf)])
            kept = both(kept, same(now, old))
            remember.append(Put(str(old.name), now))
        yield Put(str(last.name), taken)
        aim = Aim(self.flat.level, CONTRACT_ABOVE, "", above.order)
        yield self.aims.check(aim, either(negation(same(number, last)), kept))
        yield from remember

    def _report_seen(self, below: Below) -> Iterable[Flat]:
        sent, echo = self._sent(below), self._echo(below)
        about = same(self.flat.leaf(f"{below.report}.{ECHOED}"), self.flat.leaf(f"{below.order}.{COMMAND}"))
        now = same(echo, sent)
        kept = both(
            either(negation(now), about),
            either(negation(self._had_echoed(below)), now),
            negation(same(echo, successor(sent))),
        )
        yield self.aims.check(Aim(self.flat.level, CONTRACT_BELOW, "", below.report), kept)

    # --- names ---

    def last_number(self, above: Above) -> Read:
        """The number of the order in the cycle before."""
        kind = self.flat.leaf(f"{above.order}.{NUMBER}").type
        return self.flat.new("number before", kind)

    def _sent(self, below: Below) -> Read:
        return self.flat.leaf(f"{below.order}.{NUMBER}")

    def _echo(self, below: Below) -> Read:
        return self.flat.leaf(f"{below.report}.{ECHO}")

    def _had_echoed(self, below: Below) -> Read:
        return self.flat.new(f"{below.name} had echoed", BOOL, 1)


def successor(number: Read) -> Expr:
    """The number after this one."""
    return _round(number, 1)


def predecessor(number: Read) -> Expr:
    """The number before this one."""
    return _round(number, NUMBERS - 1)


def _round(number: Read, step: int) -> Expr:
    wide = Int(0, 2 * NUMBERS)
    added = Apply(Op.ADD, (number, Literal(step, wide)), wide)
    return Apply(Op.MOD, (added, Literal(NUMBERS, wide)), number.type)
