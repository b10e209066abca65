"""A level that runs on the reference interpreter, and remembers what it read.

In: a program, its level, its links. Out: a `Role`, which runs one cycle from any state (`run`), and what is to be known of its leaves.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from rcsc.compose.contract import Below, Links
from rcsc.compose.goals import Sort
from rcsc.interpret import Fault, call, cycle, evaluate, execute, holds, initial, matching_lines, settle
from rcsc.model import Kind, Level, OneTable, Program, Table, Value, key_bounds, pending, value_of_key

State = tuple[Value, ...]
Key = tuple[Sort, str, str]
"""A goal: its sort, its table, its name."""
FLAG = "new_command"


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
        middle: What the table saw; `after`, what the cycle left.
        outlasts: Whether the flag of a new command, up in this cycle, would be up in the next on the same inputs; true where nobody asks.
    """

    table: str
    line: str
    fault: Fault
    failed: frozenset[str]
    middle: dict[str, Value]
    after: dict[str, Value]
    outlasts: bool = True


@dataclass(frozen=True)
class Role:
    """A level and its environment.

    Attributes:
        odd: Whether its program computes with an echo, or skips numbers.
    """

    program: Program
    level: Level
    links: Links
    odd: bool = False

    @cached_property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf, in declared order."""
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
    def remembered(self) -> frozenset[str]:
        """Inputs whose last values the contract, or a goal, speaks of."""
        found = {f"{below.report}.inc_command_echo" for below in self.links.below}
        if (above := self.links.above) is not None:
            found |= {f"{above.order}.inc_command", *above.numbered}
        return frozenset(found)

    @cached_property
    def watched(self) -> frozenset[str]:
        """Inputs that a goal reads in the cycle in which they come, or that are remembered."""
        above = self.links.above
        return self.remembered | ({f"{above.order}.input_command"} if above is not None else set())

    @cached_property
    def tables(self) -> dict[str, Table]:
        """Tables by name."""
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

    def run(self, now: Reading) -> Ran:
        """One cycle, by the interpreter's own parts and in its order; `cycle` confirms it (`confirmed`)."""
        program = self.program
        settle(program, now)
        for name in self.level.preprocess:
            call(program, name, [], now)
        middle = dict(now)
        table = self._chosen(now)
        failed = frozenset(
            str(one.name)
            for one in program.assumptions
            if one.name in table.assumptions and not holds(one.condition, now)
        )
        matching = matching_lines(table, now)
        if len(matching) > 1 or (not matching and table.default is None):
            fault = Fault.SEVERAL_LINES if matching else Fault.NO_LINE
            return Ran(str(table.name), "", fault, failed, middle, dict(now))
        line = next(
            (one for one in table.lines if matching and one.name == matching[0]),
            table.default or table.lines[0],
        )
        execute(program, [action.statement for action in line.actions], now, {})
        for name in self.level.postprocess:
            call(program, name, [], now)
        after = dict(now)
        blind = bool(middle.get(FLAG)) and str(line.name) in self.blind[str(table.name)]
        outlasts = not blind or self._stands(now)
        return Ran(str(table.name), str(line.name), Fault.OK, failed, middle, after, outlasts)

    def _stands(self, now: Reading) -> bool:
        """Whether the flag is up before the table of the next cycle, on the same inputs."""
        settle(self.program, now)
        for name in self.level.preprocess:
            call(self.program, name, [], now)
        return bool(now[FLAG])

    def _chosen(self, now: Reading) -> Table:
        if isinstance(self.level.tables, OneTable):
            return self.tables[str(self.level.tables.table)]
        return self.tables[str(dict(self.level.tables.tables)[evaluate(self.level.tables.selector, now)])]

    def confirmed(self, taken: Mapping[str, Value], ran: Ran) -> None:
        """That a cycle of the interpreter does the same.

        Raises:
            AssertionError: It does not.
        """
        outcome = cycle(self.program, self.level, taken)
        assert (outcome.fault, outcome.snapshot) == (ran.fault, ran.after)
        assert str(outcome.line or "") == ran.line
        assert set(outcome.failed_assumptions) == ran.failed


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
