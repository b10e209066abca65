"""A control level that runs: its executor, the buffers it takes and gives, and what the database fills.

In: a description, signatures, executors, a database. Out: `RunningLevel`, which takes, runs and gives on command.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.base.diagnostics.coded import USERS_FAILURES, CodedError, raised
from rcsc.base.diagnostics.codes import Code
from rcsc.run.buffers import Buffers
from rcsc.run.description import BadDescription, Description, Feed, LevelSpec
from rcsc.run.executors import Executor
from rcsc.run.signature import LevelSign, Signature, Value, Values

Query = Callable[..., Values]


@dataclass(frozen=True, slots=True)
class Take:
    """A buffer, and the place where its values go."""

    buffer: str
    first: int
    count: int
    form: str


@dataclass(frozen=True, slots=True)
class Give:
    """A buffer, and the leaves that it carries."""

    buffer: str
    first: int
    end: int


@dataclass(frozen=True, slots=True)
class Fill:
    """A query to the database, the place of its answer, and the leaves that are its keys."""

    query: Query
    first: int
    keys: tuple[int, ...]
    form: str


def misfit(form: str, values: Values) -> str:
    """Return the reason why values do not fit leaves of a form; empty where they do. The values may be anything."""
    try:
        struct.pack(form, *values)
    except (struct.error, OverflowError, TypeError, ValueError) as error:
        return str(error)
    return ""


class StateTableError(CodedError):
    """A level met a fault that the proofs exclude, or was refused an input or a state; says which, where and when."""

    code = Code.STATE_TABLE_ERROR


class BadState(StateTableError):  # noqa: N818  # what was refused, not an error of ours
    """A state from outside lies outside what the executors are proved for; says which level and what."""


def put_checked(name: str, sign: Signature, executor: Executor, values: Values) -> None:
    """Give an executor a state from outside, checked before any cycle sees it.

    Raises:
        BadState: Something lies outside its range, or an invariant does not hold; the executor has the state that it had.
    """
    count = len(sign.leaves)
    kept = executor.values()[:count]
    try:
        struct.pack(sign.form(range(count)), *values[:count])
        executor.put(0, values[:count])
        at = executor.check()
        wrong = "" if at < 0 else sign.unfit(at, values)
    except struct.error as error:
        wrong = str(error)
    if wrong:
        executor.put(0, kept)
        raise BadState(f"level `{name}` cannot go on from this state: {wrong}")


def cycled(name: str, executor: Executor) -> int:
    """Run one cycle of a level's executor, whoever asks; return the fault, 0 for none.

    Raises:
        StateTableError: An extern procedure, which is the user's code, raised, or asked to end the process.
    """
    try:
        return executor.cycle()
    except USERS_FAILURES as error:
        raise StateTableError(f"level `{name}`: an extern procedure failed: {raised(error)}") from error


@dataclass(slots=True)
class RunningLevel:
    """One level with its state.

    Attributes:
        values: All leaves and the trace, as the last cycle left them, with inputs taken since.
        initial: The same before the first cycle.
    """

    name: str
    sign: Signature
    level: LevelSign
    executor: Executor
    takes: tuple[Take, ...]
    gives: tuple[Give, ...]
    fills: tuple[Fill, ...]
    values: Values = ()
    initial: Values = field(init=False)
    _taken: dict[str, Values] = field(default_factory=dict)
    _asked: dict[int, list[Value]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Read the initial state."""
        self.values = self.initial = self.executor.values()

    def take(self, buffers: Buffers) -> None:
        """Copy the latest value of every input buffer, then let the database fill the leaves that depend on them.

        Raises:
            StateTableError: What somebody outside published, or the database answered, are no values of these leaves.
        """
        now: list[Value] | None = None
        for take in self.takes:
            latest = buffers.latest(take.buffer)
            if latest is not None and latest is not self._taken.get(take.buffer):
                self._taken[take.buffer] = latest
                self._put(f"buffer `{take.buffer}`", take.form, take.first, latest)
                now = list(self.values) if now is None else now
                now[take.first : take.first + take.count] = latest
        seen: Sequence[Value] = self.values if now is None else now
        for fill in self.fills:
            keys = [seen[at] for at in fill.keys]
            if self._asked.get(fill.first) != keys:
                self._asked[fill.first] = keys
                self._put("the answer of the database", fill.form, fill.first, fill.query(*keys))

    def _put(self, what: str, form: str, first: int, values: Values) -> None:
        if wrong := misfit(form, values):
            raise StateTableError(f"level `{self.name}` cannot take {what}: {wrong}")
        self.executor.put(first, values)

    def run(self) -> int:
        """Run one cycle; return the fault, 0 for none.

        Raises:
            StateTableError: An extern procedure failed.
        """
        fault = cycled(self.name, self.executor)
        self.values = self.executor.values()
        return fault

    def give(self, buffers: Buffers) -> None:
        """Publish every output buffer."""
        for give in self.gives:
            buffers.publish(give.buffer, self.values[give.first : give.end])

    def restore(self, values: Values) -> None:
        """Continue from a state that `values` held, as if nothing had happened since.

        Raises:
            BadState: The state is none that a cycle may begin with; the level has kept its own.
        """
        put_checked(self.name, self.sign, self.executor, values)
        self._restored()

    def put_back(self, values: Values) -> None:
        """Continue from a state that this level had, or that was checked already."""
        self.executor.put(0, values[: len(self.sign.leaves)])
        self._restored()

    def _restored(self) -> None:
        self.values = self.executor.values()
        self._taken.clear()
        self._asked.clear()

    def value(self, name: str) -> Value:
        """Return a leaf of the last cycle.

        Raises:
            KeyError: There is no leaf of that name.
        """
        return self.values[self.sign.index[name]]

    def shown(self, name: str) -> str:
        """Return a leaf of the last cycle, in the table's words."""
        return self.sign.leaves[self.sign.index[name]].shown(self.value(name))

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Table and line of all that the last cycle ran, in order; if it was ended, the table tried last is there without a line."""
        return self.sign.lines_of(self.level, self.values)

    @property
    def ran(self) -> str:
        """The lines of the last cycle in words: `table `a`, line `x`; table `b`, line `y``."""
        return "; ".join(f"table `{table}`, line `{line}`" for table, line in self.lines)

    @property
    def table(self) -> str:
        """The table that the last cycle ran; of several the last, or the one that ended the cycle."""
        return self.sign.table_of(self.level, self.values)

    @property
    def fault_text(self) -> str:
        """The fault of the last cycle in words, with the inputs of its table where they are known."""
        return self.sign.fault_seen(self.level, self.values)

    @property
    def line(self) -> str:
        """The line that the last cycle ran; empty for none."""
        return self.sign.line_of(self.level, self.values)

    @property
    def fault(self) -> int:
        """The fault of the last cycle; 0 for none."""
        return self.sign.fault(self.values)


def running_level(
    spec: LevelSpec,
    system: Description,
    sign: Signature,
    executor: Executor,
    queries: Mapping[str, Query],
) -> RunningLevel:
    """Wire a level as the description says.

    Raises:
        BadDescription: A buffer or a feed names what the program does not have, or what does not fit.
    """
    level = sign.level_of(spec.name)
    takes: list[tuple[str, int, int]] = []
    gives: list[tuple[str, int, int]] = []
    for wire in system.wires:
        for end, records in ((wire.target, takes), (wire.source, gives)):
            owner, _, variable = end.partition(".")
            if owner == spec.name:
                run = _positions(sign, variable, end)
                records.append((wire.source, run.start, len(run)))
    return RunningLevel(
        spec.name,
        sign,
        level,
        executor,
        tuple(Take(*take, sign.form(range(take[1], take[1] + take[2]))) for take in takes),
        tuple(Give(name, first, first + count) for name, first, count in dict.fromkeys(gives)),
        tuple(_fill(spec, sign, feed, queries) for feed in spec.feeds),
    )


def _positions(sign: Signature, variable: str, where: str) -> range:
    try:
        return sign.record(variable)
    except KeyError as error:
        raise BadDescription(f"program `{sign.program}` has no variable `{variable}` ({where})") from error


def _fill(spec: LevelSpec, sign: Signature, feed: Feed, queries: Mapping[str, Query]) -> Fill:
    where = f"level `{spec.name}`, feed into `{feed.into}`"
    if feed.query not in queries:
        raise BadDescription(f"{where}: the database answers no question `{feed.query}`")
    run = _positions(sign, feed.into, where)
    keys = tuple(_positions(sign, key, where).start for key in feed.keys)
    query = queries[feed.query]
    answer: object = query(*(0 for _ in keys))
    if not isinstance(answer, tuple | list) or len(answer) != len(run):
        given = (
            f"{len(answer)} values" if isinstance(answer, tuple | list) else f"a `{type(answer).__name__}`"
        )
        raise BadDescription(f"{where}: {given} for {len(run)} leaves")
    return Fill(query, run.start, keys, sign.form(run))
