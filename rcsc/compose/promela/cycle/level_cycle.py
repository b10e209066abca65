"""What one level does in a cycle, and what is checked of it there, as flat statements.

In: a level (`transition.TransitionSystem`: program, level, links) and the levels of the same model. Out: a `Machine`. A `Draft` is the
same without what the program itself states, which depends on what the drafts of all levels say together (`stated`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rcsc.compose.contract.environment import COMMAND, NUMBER, STATUS
from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import SEEN, TransitionSystem
from rcsc.compose.promela.cycle.aims import Aims
from rcsc.compose.promela.cycle.checks import SMALL, Checks
from rcsc.compose.promela.cycle.environment import Environment, successor
from rcsc.compose.promela.cycle.flows import Group
from rcsc.compose.promela.cycle.stated import LeftOut, Stating, computed
from rcsc.compose.promela.cycle.statements import (
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
from rcsc.lang.model import Action, Apply, Enum, Expr, Kind, Line, Literal, OneTable, Op, Read, Table, pending
from rcsc.run.adopt import ECHOES, FAILED, ORDER


@dataclass(frozen=True, slots=True)
class Draft:
    """A level without what its program states: what it reads of levels in the model, the cycle but for its end, and its restart."""

    take: Block
    cycle: Block
    restart: Block


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
        left_out: What its program states and the instance cannot speak of.
    """

    level: str
    flat: Flattener
    ts: TransitionSystem
    take: Block
    cycle: Block
    restart: Block
    full: frozenset[str]
    numbers: tuple[str, ...]
    ended: Expr
    left_out: tuple[LeftOut, ...]

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
        system: Every level's transition system.
        inside: Those of the levels in the model.
    """

    ts: TransitionSystem
    system: Mapping[str, TransitionSystem]
    inside: Mapping[str, TransitionSystem]
    aims: Aims
    flat: Flattener = field(init=False)
    around: Environment = field(init=False)
    checks: Checks = field(init=False)

    def __post_init__(self) -> None:
        self.flat = Flattener(self.ts.level.name, self.ts.program)
        self.around = Environment(self.flat, self.ts, self.inside, self.aims)
        self.checks = Checks(self.flat, self.ts, self.around, self.system, self.aims)

    def draft(self) -> Draft:
        """The level without what its program states."""
        self.flat.new("table", SMALL)
        self.flat.new("line", SMALL)
        self.flat.new("many", SMALL)
        nowhere = tuple(Put(self.flat.name(one), Literal(0, SMALL)) for one in ("table", "line"))
        begun = (*nowhere, *self.checks.remembered(), *self.around.begin())
        look = (*self._settle(), *self._modules(self.ts.level.preprocess))
        cycle = (
            *begun, *look, *self.checks.seen(), *self._tables(), *self._modules(self.ts.level.postprocess),
            *self.checks.afterwards(look), *self.around.end(),
        )  # fmt: skip
        restart = () if len(self.inside) > 1 else (*self.around.anew(), *self._anew())
        return Draft(tuple(self.around.taken()), cycle, restart)

    def machine(self, draft: Draft, groups: Mapping[str, Group], numbers: frozenset[str]) -> Machine:
        """The level, ready to be written.

        Args:
            draft: Its own.
            groups: Of the drafts of all levels of the model.
            numbers: Command numbers of all of them.
        """
        known = computed(self.flat, draft.cycle)
        stated = Stating(self.flat, self.aims, groups, numbers, known).stated()
        own = {self.flat.name(v.name) for v in self.ts.program.variables}
        cycle = (
            *stated.before, *draft.cycle, *stated.behind,
            Tell(self.flat.name("table"), self.flat.name("line")), Forget(tuple(sorted(self.flat.lazy - own))),
        )  # fmt: skip
        take = (*stated.earlier, *draft.take) if draft.take else ()
        return Machine(
            self.ts.level.name, self.flat, self.ts, take,
            cycle if take else (*stated.earlier, *cycle), draft.restart,
            frozenset(self.around.full), tuple(self.around.numbers), self._ended(), stated.left_out,
        )  # fmt: skip

    # --- the cycle, in the order of `interpret.cycle` ---

    def _settle(self) -> Iterable[Flat]:
        """All at once: every condition is looked at before any value is taken."""
        settled: list[Flat] = []
        for variable in self.ts.program.variables:
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
        tables = {one.name: (at, one) for at, one in enumerate(self.ts.program.tables)}
        if isinstance(self.ts.level.tables, OneTable):
            yield from self._table(*tables[self.ts.level.tables.table])
            return
        before, selector = self.flat.condition(self.ts.level.tables.selector, "selector")
        yield from before
        yield Fork(
            tuple(
                (same(selector, Literal(value, selector.type)), tuple(self._table(*tables[name])))
                for value, name in self.ts.level.tables.tables
            )
        )

    def _table(self, at: int, table: Table) -> Iterable[Flat]:
        """Assumptions, exactly one line, and what it runs."""
        line, many = read(self.flat.name("line"), SMALL), read(self.flat.name("many"), SMALL)
        yield Put(self.flat.name("table"), Literal(at, SMALL))
        for assumption in self.ts.program.assumptions:
            if assumption.name in table.assumptions:
                before, holds = self.flat.condition(assumption.condition, "table")
                yield from before
                yield self.checks.obligation(Sort.ASSUMPTION, holds, str(table.name), str(assumption.name))
        safe = []
        for assumption in self.ts.program.assumptions:
            if assumption.name in table.stops:
                before, holds = self.flat.condition(assumption.condition, "table")
                yield from before
                safe.append(holds)
        matched = tuple(self._matched(table, line, many))
        if safe:  # else the cycle ends here
            yield Fork(((both(*safe), matched),))
        else:
            yield from matched

    def _matched(self, table: Table, line: Read, many: Read) -> Iterable[Flat]:
        """The one line that matches, and what it runs."""
        conditions = []
        for one in table.lines:
            before, when = self._line(one)
            yield from before
            conditions.append(when)
        yield Match(tuple(conditions), str(line.name), str(many.name))
        if table.default is None or table.default.unreachable:
            sort = Sort.SOME_LINE if table.default is None else Sort.NO_DEFAULT
            yield self.checks.obligation(sort, Apply(Op.GE, (many, Literal(1, SMALL)), BOOL), str(table.name))
        yield self.checks.obligation(
            Sort.ONE_LINE, Apply(Op.LE, (many, Literal(1, SMALL)), BOOL), str(table.name)
        )
        yield from self.checks.chosen(table, line, many)
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

    # --- beginnings and ends ---

    def _anew(self) -> Iterable[Flat]:
        """What `run.adopt` starts a level with that has lost its state."""
        for leaf, member in FAILED.items():
            kind = self.flat.kinds.get(self.flat.name(leaf))
            if isinstance(kind, Enum) and member in kind.members:
                yield Put(self.flat.name(leaf), Literal(kind.members.index(member), kind))
        above = self.ts.links.above
        if above is not None and self._has(SEEN):
            yield Put(self.flat.name(SEEN), self.flat.leaf(f"{above.order}.{NUMBER}"))
        for variable in self.ts.program.variables:
            record, _, part = variable.name.partition(".")
            if variable.kind is not Kind.OUTPUT or not record.startswith(ORDER):
                continue
            echo = f"{record.removeprefix(ORDER)}.{ECHOES.get(part, '')}"
            if part == COMMAND:
                yield Put(self.flat.name(variable.name), Literal(0, variable.type))
            elif self._has(echo):
                yield Put(self.flat.name(variable.name), successor(self.flat.leaf(echo)))

    def _ended(self) -> Expr:
        above = self.ts.links.above
        if above is None or self.ts.links.below or not self._has(f"{above.report}.{STATUS}"):
            return NO
        status = self.flat.leaf(f"{above.report}.{STATUS}")
        assert isinstance(status.type, Enum)
        done = Apply(Op.NE, (status, Literal(status.type.members.index("executing"), status.type)), BOOL)
        return either(negation(self.checks.same_number()), done)

    def _has(self, leaf: str) -> bool:
        return self.flat.name(leaf) in self.flat.kinds
