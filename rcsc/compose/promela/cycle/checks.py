"""What is checked of a cycle: the obligations of `compose.contract.obligations`, said once more, of what the cycle does, not of nodes.

In: a level, flat, and its environment. Out: flat statements, which stand before the cycle, between its parts, and at its end. What the
program itself states is said by `stated`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.compose.contract.environment import COMMAND, ECHO, ECHOED, NUMBER, leaves_under
from rcsc.compose.contract.obligations import FLAG, Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.promela.cycle.again import again
from rcsc.compose.promela.cycle.aims import Aim, Aims
from rcsc.compose.promela.cycle.environment import Environment, successor
from rcsc.compose.promela.cycle.statements import (
    BOOL,
    NO,
    Block,
    Flat,
    Flattener,
    Fork,
    Put,
    both,
    either,
    negation,
    read,
    same,
)
from rcsc.lang.model import Among, Expr, Int, Literal, OneTable, Read, Table, pending

SMALL = Int(0, 255)


@dataclass(slots=True)
class Checks:
    """The checks of one level.

    Attributes:
        system: Every level's transition system.
    """

    flat: Flattener
    ts: TransitionSystem
    around: Environment
    system: Mapping[str, TransitionSystem]
    aims: Aims
    _passed_over: list[tuple[str, Read]] = field(default_factory=list)

    def obligation(self, sort: Sort, holds: Expr, table: str = "", name: str = "") -> Flat:
        """One check."""
        return self.aims.check(Aim(self.flat.level, sort.value, table, name), holds)

    def remembered(self) -> Iterable[Flat]:
        """The orders and the flag before the cycle."""
        leaves = [
            leaf for below in self.ts.links.below for leaf in leaves_under(self.ts.program, below.order)
        ]
        if self._has(FLAG):
            leaves.append(FLAG)
        for leaf in leaves:
            yield Put(str(self.flat.old(leaf).name), self.flat.leaf(leaf))
        if self._flagged():
            for table in self.ts.program.tables:
                if overlooking(table):
                    yield Put(str(self._overlooked(str(table.name)).name), NO)

    def seen(self) -> Iterable[Flat]:
        """Deferred states as the table sees them."""
        for variable in self.ts.program.variables:
            if variable.deferred_until is not None:
                seen = self.flat.new(f"{variable.name} at the table", variable.type)
                yield Put(str(seen.name), self.flat.leaf(variable.name))

    def chosen(self, table: Table, line: Read, many: Read) -> Iterable[Flat]:
        """Whether the one line that is to run looks past a new command."""
        lines = overlooking(table)
        if lines and self._flagged():
            note = self._overlooked(str(table.name))
            self._passed_over.append((str(table.name), note))
            alone = same(many, Literal(1, SMALL))
            yield Put(str(note.name), both(self.flat.leaf(FLAG), alone, Among(line, lines)))

    def afterwards(self, look: Block) -> Iterable[Flat]:
        """What is said of a whole cycle; `look` is what the level does before its table."""
        yield from self._echoes()
        for below in self.ts.links.below:
            yield from self._orders(below.order, below.report, below.name)
        if self._flagged():
            rises = both(self.flat.leaf(FLAG), negation(self.flat.old(FLAG)))
            yield self.obligation(Sort.ONCE, negation(both(self.same_number(), rises)), "", FLAG)
        yield from self._answered(look)
        for variable in self.ts.program.variables:
            if variable.deferred_until is not None:
                now = self.flat.leaf(variable.name)
                seen = self.flat.new(f"{variable.name} at the table", variable.type)
                kept = either(same(now, seen), same(now, self.flat.leaf(pending(variable.name))))
                yield self.obligation(Sort.DEFERRED, kept, "", str(variable.name))

    def same_number(self) -> Expr:
        """No new order of the superior's was taken."""
        above = self.ts.links.above
        assert above is not None
        return same(self.flat.leaf(f"{above.order}.{NUMBER}"), self.around.last_number(above))

    def _answered(self, look: Block) -> Iterable[Flat]:
        """A flag that was passed over is still up when the level looks at the same once more, so that some line may answer it yet."""
        if not self._passed_over:
            return
        once_more, copies = again(self.flat, look)
        flag = self.flat.name(FLAG)
        up = read(copies.get(flag, flag), BOOL)
        for table, overlooked in self._passed_over:
            yield Fork(((overlooked, (*once_more, self.obligation(Sort.ANSWERED, up, table, FLAG))),))

    def _echoes(self) -> Iterable[Flat]:
        if (above := self.ts.links.above) is None:
            return
        number = same(self.flat.leaf(f"{above.report}.{ECHO}"), self.flat.leaf(f"{above.order}.{NUMBER}"))
        command = same(self.flat.leaf(f"{above.report}.{ECHOED}"), self.flat.leaf(f"{above.order}.{COMMAND}"))
        yield self.obligation(Sort.ECHOES, both(number, command), "", above.report)

    def _orders(self, order: str, report: str, below: str) -> Iterable[Flat]:
        number, old = self.flat.leaf(f"{order}.{NUMBER}"), self.flat.old(f"{order}.{NUMBER}")
        stands = same(number, old)
        for leaf in self._relied_on(order, below):
            kept = same(self.flat.leaf(leaf), self.flat.old(leaf))
            yield self.obligation(Sort.NUMBERED, either(negation(stands), kept), "", leaf)
        yield self.obligation(Sort.NEXT_NUMBER, either(stands, same(number, successor(old))), "", order)
        if self.ts.links.above is not None:
            command = f"{order}.{COMMAND}"
            kept = same(self.flat.leaf(command), self.flat.old(command))
            waiting = both(self.same_number(), negation(same(self.flat.leaf(f"{report}.{ECHO}"), old)))
            yield self.obligation(Sort.WAITS, either(negation(waiting), kept), "", order)
            yield from self._paused(order)

    def _paused(self, order: str) -> Iterable[Flat]:
        """PAUSE, or what it is called, is the first command of each level that has a table for each."""
        above = self.ts.links.above
        assert above is not None
        if not isinstance(self.ts.level.tables, OneTable):
            taken, passed = (self.flat.leaf(f"{one}.{COMMAND}") for one in (above.order, order))
            is_new = negation(self.same_number())
            told = both(is_new, same(taken, Literal(0, taken.type)))
            kept = either(negation(told), same(passed, Literal(0, passed.type)))
            yield self.obligation(Sort.PAUSES, kept, "", order)

    def _relied_on(self, order: str, below: str) -> Iterable[str]:
        """The fields that the subordinate assumes to stand still under a number; the command always."""
        lower = self.system[below].links.above if below in self.system else None
        if lower is None:
            return (f"{order}.{COMMAND}",)
        return tuple(order + leaf.removeprefix(lower.order) for leaf in lower.numbered)

    def _overlooked(self, table: str) -> Read:
        return self.flat.new(f"{table} passes over", BOOL)

    def _flagged(self) -> bool:
        return self.ts.links.above is not None and self._has(FLAG)

    def _has(self, leaf: str) -> bool:
        return self.flat.name(leaf) in self.flat.kinds


def overlooking(table: Table) -> tuple[int, ...]:
    """The numbers, from 1, of the lines without a cell on the flag; none where no line has one."""
    at = [place for place, column in enumerate(table.columns) if column.variable == FLAG]
    lines = tuple(
        number for number, line in enumerate(table.lines, 1) if all(line.tests[one] is None for one in at)
    )
    return lines if len(lines) < len(table.lines) else ()
