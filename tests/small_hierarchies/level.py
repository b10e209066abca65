"""A level that runs on the reference interpreter, and remembers what it read.

In: a program, its level, its links. Out: a `Role`, which runs one cycle from any state (`run`), and what is to be known of its leaves.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count, groupby, product

from rcsc.compose.contract.environment import Below, Links
from rcsc.compose.contract.obligations import Sort
from rcsc.lang.interpret import (
    ExternError,
    Fault,
    answering,
    call,
    cycle,
    evaluate,
    execute,
    holds,
    initial,
    matching_lines,
    settle,
)
from rcsc.lang.leaves import read_by
from rcsc.lang.model import (
    BEFORE,
    Kind,
    Level,
    OneTable,
    Procedure,
    Program,
    Real,
    Standing,
    Table,
    Value,
    key_bounds,
    pending,
    value_of_key,
)
from rcsc.run.signature import Signature
from tests.small_hierarchies.compiled import Compiled, compiled

State = tuple[Value, ...]
Result = tuple[str, tuple[Value, ...]]
"""An extern procedure, and what one call of it gave."""
_Begins = Callable[[dict[str, Value], set[str], "Script"], None]
Key = tuple[Sort, str, str]
"""An obligation: its sort, its table, its name."""
FLAG = "new_command"
EARLY = frozenset({Fault.EXTERN, Fault.ASSUMPTION})
"""Faults after which the next cycle runs."""
UNDEFINED = Fault.STATE
"""Here: an operation of the cycle is not defined, or a value left its range, so that nobody can say what it does."""

FEW = 64
"""One compiled cycle of so many is run once more by the interpreter's parts."""


class Reading(dict[str, Value]):
    """A state that remembers what is read of it."""

    __slots__ = ("read",)

    def __init__(self, state: Mapping[str, Value]) -> None:
        super().__init__(state)
        self.read: set[str] = set()

    def __getitem__(self, name: str) -> Value:
        self.read.add(name)
        return super().__getitem__(name)


@dataclass(frozen=True, slots=True)
class Ran:
    """One cycle as it ran.

    Attributes:
        table: That ran, or would have; `line`, blank where none did.
        middle: What the table saw, or would have; `after`, what the cycle left.
        outlasts: Whether the flag of a new command, up in this cycle, would be up in the next on the same inputs; true where nobody asks.
        given: What each call of an extern procedure gave.
    """

    table: str
    line: str
    fault: Fault
    failed: frozenset[str]
    middle: dict[str, Value]
    after: dict[str, Value]
    outlasts: bool = True
    given: tuple[Result, ...] = ()


@dataclass
class Script:
    """What extern procedures give: of each call one of the results that there are, by its number; the first behind the last number.

    Attributes:
        taken: The numbers that were taken; `many`, how many results there were to choose from.
    """

    role: "Role"
    numbers: tuple[int, ...] = ()
    taken: list[int] = field(default_factory=list)
    many: list[int] = field(default_factory=list)
    given: list[Result] = field(default_factory=list)

    def __call__(self, procedure: Procedure, _args: list[Value]) -> tuple[Value, ...]:
        every = self.role.results[str(procedure.name)]
        at = len(self.taken)
        self.taken.append(self.numbers[at] if at < len(self.numbers) else 0)
        self.many.append(len(every))
        self.given.append((str(procedure.name), every[self.taken[at]]))
        return every[self.taken[at]]

    def others(self) -> Iterator[tuple[int, ...]]:
        """The numbers with which the calls that were answered with the first result are answered otherwise."""
        for at in range(len(self.numbers), len(self.taken)):
            for number in range(1, self.many[at]):
                yield (*self.taken[:at], number)


def results(program: Program, procedure: Procedure) -> Iterator[tuple[Value, ...]]:
    """All that a call may give: every value in range, and each place refused once for all that stands before it."""
    kinds = [program.variable(name).type for name in procedure.writes]
    ends = [key_bounds(kind) for kind in kinds]
    every = [
        [value_of_key(kind, key) for key in range(low, high + 1)]
        for kind, (low, high) in zip(kinds, ends, strict=True)
    ]
    yield from product(*every)
    for at, (_, high) in enumerate(ends):
        rest = tuple(one[0] for one in every[at + 1 :])
        yield from ((*before, high + 1, *rest) for before in product(*every[:at]))


@dataclass
class Again:
    """What extern procedures gave in a cycle that ran; each has its own in order, and the least value behind the last."""

    program: Program
    given: list[Result]

    def __call__(self, procedure: Procedure, _args: list[Value]) -> tuple[Value, ...]:
        for at, (name, values) in enumerate(self.given):
            if name == procedure.name:
                del self.given[at]
                return values
        return next(results(self.program, procedure))


@dataclass(frozen=True)
class Role:
    """A level and its environment.

    Attributes:
        odd: Whether its program computes with an echo, or skips numbers.
        relied: The declared assumptions that a proof relies on; None: all that may speak of what a cycle takes.
    """

    program: Program
    level: Level
    links: Links
    odd: bool = False
    relied: frozenset[str] | None = None
    signature: Signature | None = field(default=None, compare=False, repr=False)

    @cached_property
    def leaves(self) -> tuple[str, ...]:
        return tuple(str(v.name) for v in self.program.variables)

    @cached_property
    def start(self) -> dict[str, Value]:
        """The values before the first cycle."""
        return {str(name): value for name, value in initial(self.program).items()}

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """The leaves that the environment gives."""
        return tuple(str(v.name) for v in self.program.variables if v.kind is Kind.INPUT)

    @cached_property
    def taken(self) -> tuple[tuple[str, ...], ...]:
        """The inputs, record by record."""
        return tuple(tuple(leaves) for _, leaves in groupby(self.inputs, lambda leaf: leaf.partition(".")[0]))

    @cached_property
    def remembered(self) -> frozenset[str]:
        """Inputs whose last values the contract, or an obligation, speaks of."""
        found = {f"{below.report}.inc_command_echo" for below in self.links.below}
        if (above := self.links.above) is not None:
            found |= {f"{above.order}.inc_command", f"{above.order}.input_command", *above.numbered}
        found |= {name.removeprefix(BEFORE) for name in self._stated if name.startswith(BEFORE)}
        return frozenset(found & set(self.inputs))

    @cached_property
    def _stated(self) -> frozenset[str]:
        """What the program's properties read."""
        return frozenset(
            str(name) for stated in self.program.properties for name in read_by(stated.condition)
        )

    @cached_property
    def watched(self) -> frozenset[str]:
        """Inputs that an obligation reads in the cycle in which they come, or that are remembered."""
        above = self.links.above
        own = {f"{above.order}.input_command"} if above is not None else set()
        return self.remembered | own | (self._stated & set(self.inputs))

    @cached_property
    def trusted(self) -> frozenset[str]:
        """Assumptions that the tables are declared to rely on, of what a cycle takes: what it reads before the table runs.

        A leaf that the preprocess writes may have nothing to do with what is taken (`new_command := not new_command`): a proof may
        rely on fewer, and has then to prove the others.
        """
        early = {str(v.name) for v in self.program.variables if v.deferred_until is not None} | set(
            self.inputs
        )
        for procedure in self.program.procedures:
            if procedure.name in self.level.preprocess:
                early |= set(map(str, procedure.writes))
        may = frozenset(
            str(assumption.name)
            for assumption in self.program.assumptions
            if assumption.standing is Standing.ASSUMED
            and early & set(map(str, read_by(assumption.condition)))
        )
        return may if self.relied is None else may & self.relied

    @cached_property
    def asks(self) -> bool:
        """Whether it has extern procedures."""
        return any(procedure.extern is not None for procedure in self.program.procedures)

    @cached_property
    def tables(self) -> dict[str, Table]:
        return {str(table.name): table for table in self.program.tables}

    @cached_property
    def blind(self) -> dict[str, frozenset[str]]:
        """Of each table the lines that do not look for a new command, where others do."""
        return {name: overlooking(table) for name, table in self.tables.items()}

    @cached_property
    def numbered(self) -> tuple[tuple[Below, str, tuple[str, ...]], ...]:
        """Each subordinate, the number of its order, and the other fields."""
        return tuple(
            (below, f"{below.order}.inc_command", tuple(fields(self, below))) for below in self.links.below
        )

    @cached_property
    def report(self) -> tuple[str, ...]:
        above = self.links.above
        return (
            ()
            if above is None
            else tuple(leaf for leaf in self.leaves if leaf.startswith(f"{above.report}."))
        )

    @cached_property
    def forgotten(self) -> dict[str, Value]:
        """Inputs that nobody remembers, with the values before the first cycle."""
        return {leaf: self.start[leaf] for leaf in self.inputs if leaf not in self.remembered}

    @cached_property
    def deferred(self) -> tuple[tuple[str, str], ...]:
        """States that wait, and where their next values stand."""
        return tuple(
            (str(v.name), str(pending(v.name)))
            for v in self.program.variables
            if v.deferred_until is not None
        )

    @cached_property
    def domains(self) -> dict[str, tuple[Value, ...]]:
        """Every value of every input of few."""
        return {
            leaf: self.domain(leaf)
            for leaf in self.inputs
            if self.program.variable(leaf).type != number_type(self)
        }

    def domain(self, leaf: str) -> tuple[Value, ...]:
        """Every value of a leaf that is no number."""
        kind = self.program.variable(leaf).type
        low, high = key_bounds(kind)
        return tuple(value_of_key(kind, key) for key in range(low, high + 1))

    @cached_property
    def results(self) -> dict[str, list[tuple[Value, ...]]]:
        """All that a call of each extern procedure may give."""
        every = [procedure for procedure in self.program.procedures if procedure.extern is not None]
        return {str(one.name): list(results(self.program, one)) for one in every}

    @cached_property
    def compiled(self) -> Compiled:
        owes, given = self.links.owes, self.links.given
        between = *(fact.condition for fact in owes), *(fact.condition for fact in given)
        return compiled(self.program, self.level, between)

    def ways(self, state: Mapping[str, Value], read: set[str]) -> Iterator[Ran]:
        """One cycle from a state, with its inputs, for each way in which extern procedures may answer; takes what all of them read."""
        waiting: list[tuple[int, ...]] = [()]
        while waiting:
            script = Script(self, waiting.pop())
            ran = self.quick(dict(state), script, read)
            if next(self._runs) % FEW == 0:
                self.same(state, ran, read)
            yield ran
            waiting += script.others()

    def quick(self, now: dict[str, Value], script: Script, read: set[str]) -> Ran:
        """One cycle, compiled; takes the inputs that it reads."""
        try:
            table, line, fault, failed, middle, cut = self.compiled.run(now, read, script)
            if fault is not Fault.OK:
                now |= self._safe
            new = middle.get(FLAG)
            missed = new and (table in self._looking if cut else line in self.blind[table])
            outlasts = not missed or self._stands(now, read, self.compiled.settle)
        except (ArithmeticError, IndexError, ValueError):
            return Ran("", "", UNDEFINED, frozenset(), {}, {}, given=tuple(script.given))
        fault = fault if self.compiled.in_range(now) else UNDEFINED
        return Ran(table, line, fault, failed, middle, now, outlasts, tuple(script.given))

    def same(self, taken: Mapping[str, Value], ran: Ran, read: set[str]) -> None:
        """That the interpreter's parts do the same, and read nothing else.

        Raises:
            AssertionError: They do not, or do.
        """
        now = Reading(taken)
        assert replace(self.run(now, Again(self.program, list(ran.given))), given=ran.given) == ran
        assert now.read & set(self.inputs) <= read

    @cached_property
    def _runs(self) -> Iterator[int]:
        return count()

    @cached_property
    def _safe(self) -> dict[str, Value]:
        return {str(v.name): v.safe for v in self.program.variables if v.safe is not None}

    @cached_property
    def _looking(self) -> frozenset[str]:
        return frozenset(name for name, table in self.tables.items() if looks(table))

    def run(self, now: Reading, answers: Script | Again | None = None) -> Ran:
        """One cycle, by the interpreter's own parts and in its order; `cycle` confirms it (`confirmed`)."""
        with answering(answers or Script(self)):
            try:
                ran = self._ran(now)
            except (ArithmeticError, IndexError, ValueError):
                return Ran("", "", UNDEFINED, frozenset(), {}, {})
        in_range = all(low <= ran.after[name] <= high for name, low, high in self._ranges)
        return ran if in_range else replace(ran, fault=UNDEFINED)

    @cached_property
    def _ranges(self) -> list[tuple[str, Value, Value]]:
        found: list[tuple[str, Value, Value]] = []
        for v in self.program.variables:
            low, high = (v.type.low, v.type.high) if isinstance(v.type, Real) else key_bounds(v.type)
            found.append((str(v.name), low, high))
        return found

    def _ran(self, now: Reading) -> Ran:
        program = self.program
        settle(program, now)
        try:
            for name in self.level.preprocess:
                call(program, name, [], now)
        except ExternError:
            return self._early(now, self._chosen(now), "", Fault.EXTERN, frozenset(), dict(now))
        middle, table = dict(now), self._chosen(now)
        failed = frozenset(
            str(assumption.name)
            for assumption in program.assumptions
            if assumption.name in table.assumptions and not holds(assumption.condition, now)
        )
        if failed & set(table.stops):
            return self._early(now, table, "", Fault.ASSUMPTION, failed, middle)
        matching = matching_lines(table, now)
        if len(matching) > 1 or (not matching and table.default is None):
            fault = Fault.SEVERAL_LINES if matching else Fault.NO_LINE
            return Ran(str(table.name), "", fault, failed, middle, self._shown(now))
        line = next(
            (row for row in table.lines if matching and row.name == matching[0]),
            table.default or table.lines[0],
        )
        try:
            execute(program, [action.statement for action in line.actions], now, {})
        except ExternError:
            return self._early(now, table, str(line.name), Fault.EXTERN, failed, middle)
        fault = Fault.OK
        try:
            for name in self.level.postprocess:
                call(program, name, [], now)
        except ExternError:
            fault = Fault.EXTERN
        after = self._shown(now) if fault is Fault.EXTERN else dict(now)
        blind = bool(middle.get(FLAG)) and str(line.name) in self.blind[str(table.name)]
        outlasts = not blind or self._stands(after, now.read, self._begins)
        return Ran(str(table.name), str(line.name), fault, failed, middle, after, outlasts)

    def _early(
        self,
        now: Reading,
        table: Table,
        line: str,
        fault: Fault,
        failed: frozenset[str],
        middle: dict[str, Value],
    ) -> Ran:
        """A cycle that ends before its line is done: nobody answers a new command in it."""
        after = self._shown(now)
        missed = bool(middle.get(FLAG)) and looks(table)
        return Ran(
            str(table.name),
            line,
            fault,
            failed,
            middle,
            after,
            not missed or self._stands(after, now.read, self._begins),
        )

    def _shown(self, now: Mapping[str, Value]) -> dict[str, Value]:
        """The state behind a fault: outputs that have a safe value show it."""
        return {**now, **self._safe}

    def _stands(self, after: Mapping[str, Value], read: set[str], begins: "_Begins") -> bool:
        """Whether the flag is up before the table of the next cycle, on the same inputs, whatever extern procedures give."""
        waiting: list[tuple[int, ...]] = [()]
        while waiting:
            script, now = Script(self, waiting.pop()), dict(after)
            with suppress(ExternError):
                begins(now, read, script)
            if not now[FLAG]:
                return False
            waiting += script.others()
        return True

    def _begins(self, now: dict[str, Value], read: set[str], script: Script) -> None:
        """Deferred states and preprocess, by the interpreter's parts."""
        seen = Reading(now)
        try:
            with answering(script):
                settle(self.program, seen)
                for name in self.level.preprocess:
                    call(self.program, name, [], seen)
        finally:
            now |= seen
            read |= seen.read

    def _chosen(self, now: Reading) -> Table:
        if isinstance(self.level.tables, OneTable):
            return self.tables[str(self.level.tables.table)]
        return self.tables[str(dict(self.level.tables.tables)[evaluate(self.level.tables.selector, now)])]

    def confirmed(self, taken: Mapping[str, Value], ran: Ran) -> None:
        """That a cycle of the interpreter does the same.

        Raises:
            AssertionError: It does not.
        """
        with answering(Again(self.program, list(ran.given))):
            outcome = cycle(self.program, self.level, taken)
        assert (outcome.fault, outcome.snapshot) == (ran.fault, ran.after)
        assert str(outcome.line or "") == ran.line
        stops = self.tables[ran.table].stops
        checked = {
            str(assumption.name)
            for assumption in self.program.assumptions
            if assumption.standing is Standing.MONITORED or assumption.name in stops
        }
        assert set(outcome.failed_assumptions) == ran.failed & checked


def looks(table: Table) -> bool:
    """Whether some line looks for a new command."""
    places = [at for at, column in enumerate(table.columns) if column.variable == FLAG]
    return any(line.tests[at] is not None for at in places for line in table.lines)


def overlooking(table: Table) -> frozenset[str]:
    """The lines that have no cell on the flag of a new command, where others have one; DEFAULT has none."""
    places = [at for at, column in enumerate(table.columns) if column.variable == FLAG]
    blind = [str(line.name) for line in table.lines if all(line.tests[at] is None for at in places)]
    if len(blind) == len(table.lines):
        return frozenset()
    default = table.default
    return frozenset([*blind, *([] if default is None or default.unreachable else [str(default.name)])])


def fields(role: Role, below: Below) -> Iterator[str]:
    for leaf in role.leaves:
        if leaf.startswith(f"{below.order}.") and leaf != f"{below.order}.inc_command":
            yield leaf


def number_type(role: Role) -> object:
    return role.program.variable("inc_command_seen").type
