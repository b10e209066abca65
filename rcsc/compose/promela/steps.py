"""What one level does in a cycle, and what is checked of it there, as flat statements.

In: a level (`transition.Stepper`: program, level, links) and the levels of the same model. Out: a `Machine`. The goals are those of
`compose.goals`, said once more: of what the cycle does, not of nodes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.compose.contract import COMMAND, ECHO, ECHOED, NUMBER, STATUS, leaves_under
from rcsc.compose.goals import FLAG, Sort
from rcsc.compose.promela.aims import INVARIANT, Aim, Aims
from rcsc.compose.promela.environment import Environment, successor
from rcsc.compose.promela.flat import (
    BOOL,
    NO,
    Block,
    Flat,
    Flattener,
    Forget,
    Fork,
    Match,
    Put,
    Tell,
    both,
    either,
    negation,
    read,
    same,
)
from rcsc.compose.transition import SEEN, Stepper
from rcsc.model import Action, Apply, Enum, Expr, Int, Kind, Line, Literal, OneTable, Op, Table, pending
from rcsc.system.adopt import ECHOES, FAILED, ORDER

SMALL = Int(0, 255)


@dataclass(frozen=True, slots=True)
class Machine:
    """A level as it is modelled.

    Attributes:
        take: What it reads of levels in the model.
        cycle: The contract's part, then the cycle.
        restart: What makes it begin anew before its first cycle; empty where it may not.
        full: Names that are given any value of their type.
        numbers: Command numbers.
        ended: The superior's command is not under way; for progress.
    """

    level: str
    flat: Flattener
    stepper: Stepper
    take: Block
    cycle: Block
    restart: Block
    full: frozenset[str]
    numbers: tuple[str, ...]
    ended: Expr

    @property
    def table(self) -> str:
        """Where the number of the table that ran stands."""
        return self.flat.name("table")

    @property
    def line(self) -> str:
        """Where the number of the line that ran stands, from 1; 0 is DEFAULT or none."""
        return self.flat.name("line")


@dataclass(slots=True)
class Maker:
    """Makes one `Machine`.

    Attributes:
        system: Every level's stepper.
        inside: Those of the levels in the model.
    """

    stepper: Stepper
    system: Mapping[str, Stepper]
    inside: Mapping[str, Stepper]
    aims: Aims
    flat: Flattener = field(init=False)
    around: Environment = field(init=False)

    def __post_init__(self) -> None:
        self.flat = Flattener(self.stepper.level.name, self.stepper.program)
        self.around = Environment(self.flat, self.stepper, self.inside, self.aims)

    def machine(self) -> Machine:
        """The level, ready to be written."""
        self.flat.new("table", SMALL)
        self.flat.new("line", SMALL)
        self.flat.new("many", SMALL)
        nowhere = tuple(Put(self.flat.name(one), Literal(0, SMALL)) for one in ("table", "line"))
        cycle: Block = (
            *nowhere, *self._remembered(), *self.around.begin(), *self._settle(),
            *self._modules(self.stepper.level.preprocess), *self._seen(), *self._tables(),
            *self._modules(self.stepper.level.postprocess), *self._afterwards(), *self.around.end(),
            Tell(self.flat.name("table"), self.flat.name("line")),
        )  # fmt: skip
        cycle += (
            Forget(
                tuple(
                    sorted(self.flat.lazy - {self.flat.name(v.name) for v in self.stepper.program.variables})
                )
            ),
        )
        restart = () if len(self.inside) > 1 else (*self.around.anew(), *self._anew())
        return Machine(
            self.stepper.level.name, self.flat, self.stepper, tuple(self.around.taken()), cycle, restart,
            frozenset(self.around.full), tuple(self.around.numbers), self._ended(),
        )  # fmt: skip

    # --- the cycle, in the order of `interpret.cycle` ---

    def _settle(self) -> Iterable[Flat]:
        """All at once: every condition is looked at before any value is taken."""
        settled: list[Flat] = []
        for variable in self.stepper.program.variables:
            if variable.deferred_until is not None:
                ready = self.flat.new(f"{variable.name} is ready", BOOL)
                before, when = self.flat.condition(variable.deferred_until, "deferral")
                yield from before
                yield Put(str(ready.name), when)
                later = self.flat.leaf(pending(variable.name))
                settled.append(Fork(((ready, (Put(self.flat.name(variable.name), later),)),)))
        yield from settled

    def _modules(self, names: Iterable[str]) -> Iterable[Flat]:
        for name in names:
            yield from self.flat.run(name)

    def _tables(self) -> Iterable[Flat]:
        tables = {one.name: (at, one) for at, one in enumerate(self.stepper.program.tables)}
        if isinstance(self.stepper.level.tables, OneTable):
            yield from self._table(*tables[self.stepper.level.tables.table])
            return
        before, selector = self.flat.condition(self.stepper.level.tables.selector, "selector")
        yield from before
        yield Fork(
            tuple(
                (same(selector, Literal(value, selector.type)), tuple(self._table(*tables[name])))
                for value, name in self.stepper.level.tables.tables
            )
        )

    def _table(self, at: int, table: Table) -> Iterable[Flat]:
        """Assumptions, exactly one line, and what it runs."""
        line, many = read(self.flat.name("line"), SMALL), read(self.flat.name("many"), SMALL)
        yield Put(self.flat.name("table"), Literal(at, SMALL))
        for assumption in self.stepper.program.assumptions:
            if assumption.name in table.assumptions:
                before, holds = self.flat.condition(assumption.condition, "table")
                yield from before
                yield self._goal(Sort.ASSUMPTION, holds, str(table.name), str(assumption.name))
        conditions = []
        for one in table.lines:
            before, when = self._line(one)
            yield from before
            conditions.append(when)
        yield Match(tuple(conditions), str(line.name), str(many.name))
        if table.default is None or table.default.unreachable:
            sort = Sort.SOME_LINE if table.default is None else Sort.NO_DEFAULT
            yield self._goal(sort, Apply(Op.GE, (many, Literal(1, SMALL)), BOOL), str(table.name))
        yield self._goal(Sort.ONE_LINE, Apply(Op.LE, (many, Literal(1, SMALL)), BOOL), str(table.name))
        yield Fork(
            tuple(
                (same(line, Literal(number, SMALL)), self._actions(one.actions))
                for number, one in enumerate(table.lines, 1)
            ),
            () if table.default is None else self._actions(table.default.actions),
        )

    def _line(self, line: Line) -> tuple[Block, Expr]:
        before: list[Flat] = []
        terms: list[Expr] = []
        for test in line.tests:
            if test is not None:
                first, when = self.flat.condition(test.condition, "table")
                before += first
                terms.append(when)
        return tuple(before), both(*terms)

    def _actions(self, actions: Iterable[Action]) -> Block:
        return tuple(one for action in actions for one in self.flat.action(action.statement))

    # --- goals ---

    def _goal(self, sort: Sort, holds: Expr, table: str = "", name: str = "") -> Flat:
        return self.aims.check(Aim(self.flat.level, sort.value, table, name), holds)

    def _remembered(self) -> Iterable[Flat]:
        """The orders and the flag before the cycle."""
        leaves = [
            leaf
            for below in self.stepper.links.below
            for leaf in leaves_under(self.stepper.program, below.order)
        ]
        if self._has(FLAG):
            leaves.append(FLAG)
        for leaf in leaves:
            yield Put(str(self.flat.old(leaf).name), self.flat.leaf(leaf))

    def _seen(self) -> Iterable[Flat]:
        """Deferred states as the table sees them."""
        for variable in self.stepper.program.variables:
            if variable.deferred_until is not None:
                seen = self.flat.new(f"{variable.name} at the table", variable.type)
                yield Put(str(seen.name), self.flat.leaf(variable.name))

    def _afterwards(self) -> Iterable[Flat]:
        """What `compose.goals` says of a whole cycle."""
        yield from self._echoes()
        for below in self.stepper.links.below:
            yield from self._orders(below.order, below.report, below.name)
        above = self.stepper.links.above
        if above is not None and self._has(FLAG):
            rises = both(self.flat.leaf(FLAG), negation(self.flat.old(FLAG)))
            yield self._goal(Sort.ONCE, negation(both(self._same_number(), rises)), "", FLAG)
        for variable in self.stepper.program.variables:
            if variable.deferred_until is not None:
                now = self.flat.leaf(variable.name)
                seen = self.flat.new(f"{variable.name} at the table", variable.type)
                kept = either(same(now, seen), same(now, self.flat.leaf(pending(variable.name))))
                yield self._goal(Sort.DEFERRED, kept, "", str(variable.name))
        for one in self.stepper.program.invariants:
            before, holds = self.flat.condition(one.condition, "invariant")
            yield from before
            yield self.aims.check(Aim(self.flat.level, INVARIANT, "", one.name), holds)

    def _echoes(self) -> Iterable[Flat]:
        if (above := self.stepper.links.above) is None:
            return
        number = same(self.flat.leaf(f"{above.report}.{ECHO}"), self.flat.leaf(f"{above.order}.{NUMBER}"))
        command = same(self.flat.leaf(f"{above.report}.{ECHOED}"), self.flat.leaf(f"{above.order}.{COMMAND}"))
        yield self._goal(Sort.ECHOES, both(number, command), "", above.report)

    def _orders(self, order: str, report: str, below: str) -> Iterable[Flat]:
        number, old = self.flat.leaf(f"{order}.{NUMBER}"), self.flat.old(f"{order}.{NUMBER}")
        stands = same(number, old)
        for leaf in self._relied_on(order, below):
            kept = same(self.flat.leaf(leaf), self.flat.old(leaf))
            yield self._goal(Sort.NUMBERED, either(negation(stands), kept), "", leaf)
        yield self._goal(Sort.NEXT_NUMBER, either(stands, same(number, successor(old))), "", order)
        if self.stepper.links.above is not None:
            command = f"{order}.{COMMAND}"
            kept = same(self.flat.leaf(command), self.flat.old(command))
            waiting = both(self._same_number(), negation(same(self.flat.leaf(f"{report}.{ECHO}"), old)))
            yield self._goal(Sort.WAITS, either(negation(waiting), kept), "", order)

    def _relied_on(self, order: str, below: str) -> Iterable[str]:
        """The fields that the subordinate assumes to stand still under a number; the command always."""
        lower = self.system[below].links.above if below in self.system else None
        if lower is None:
            return (f"{order}.{COMMAND}",)
        return tuple(order + leaf.removeprefix(lower.order) for leaf in lower.numbered)

    def _same_number(self) -> Expr:
        above = self.stepper.links.above
        assert above is not None
        return same(self.flat.leaf(f"{above.order}.{NUMBER}"), self.around.last_number(above))

    def _has(self, leaf: str) -> bool:
        return self.flat.name(leaf) in self.flat.kinds

    # --- beginnings and ends ---

    def _anew(self) -> Iterable[Flat]:
        """What `system.adopt` starts a level with that has lost its state."""
        for leaf, member in FAILED.items():
            kind = self.flat.kinds.get(self.flat.name(leaf))
            if isinstance(kind, Enum) and member in kind.members:
                yield Put(self.flat.name(leaf), Literal(kind.members.index(member), kind))
        above = self.stepper.links.above
        if above is not None and self._has(SEEN):
            yield Put(self.flat.name(SEEN), self.flat.leaf(f"{above.order}.{NUMBER}"))
        for variable in self.stepper.program.variables:
            record, _, part = variable.name.partition(".")
            if variable.kind is not Kind.OUTPUT or not record.startswith(ORDER):
                continue
            echo = f"{record.removeprefix(ORDER)}.{ECHOES.get(part, '')}"
            if part == COMMAND:
                yield Put(self.flat.name(variable.name), Literal(0, variable.type))
            elif self._has(echo):
                yield Put(self.flat.name(variable.name), successor(self.flat.leaf(echo)))

    def _ended(self) -> Expr:
        above = self.stepper.links.above
        if above is None or self.stepper.links.below or not self._has(f"{above.report}.{STATUS}"):
            return NO
        status = self.flat.leaf(f"{above.report}.{STATUS}")
        assert isinstance(status.type, Enum)
        done = Apply(Op.NE, (status, Literal(status.type.members.index("executing"), status.type)), BOOL)
        return either(negation(self._same_number()), done)
