"""Show a recorded run tick by tick, as its levels saw it: the order each took, its report, its orders, the reports it saw.

In: a log. Out: `LoggedTick`s, in the words of the tables. Orders and reports are told by their fields (Haynes et al.
1984, section 9): an order has `inc_command` and `input_command`, a report `inc_command_echo`, `ref_command_echo` and
`status_report`. A level sees a report before it orders, so a report is compared with the order that stood before the cycle.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from rcsc.lang.model import pending
from rcsc.lang.restart import COMMAND, ECHO, ECHOED, NUMBER, STATUS
from rcsc.run.description import Wire
from rcsc.run.log.finding import LoggedCycle
from rcsc.run.log.read import Log, LoggedLevel
from rcsc.run.signature import Leaf, Signature, Values

MOST_KNOWN = 64
"""Programs of which is kept where their records lie."""


@dataclass(frozen=True, slots=True)
class TickValue:
    """A value by its name, and whether this cycle changed it."""

    name: str
    value: str
    changed: bool


@dataclass(frozen=True, slots=True)
class Order:
    """An order as it stands after the cycle.

    Attributes:
        buffer: The level's own name of it.
        other: Who is at the buffer's other end; empty where the log does not say.
        number: Its number; None for what is not numbered.
        new: Whether the number is not what it was.
        altered: Whether the command is not what it was, though the number is.
        fields: Its other fields that changed or are not initial.
    """

    buffer: str
    other: str
    number: int | None
    command: str
    new: bool
    altered: bool
    fields: tuple[TickValue, ...]


@dataclass(frozen=True, slots=True)
class Reported:
    """A report, and the order that it is set against.

    Attributes:
        echoed: The command that it is about.
        of_number: The number of the order; None where there is none to be set against.
        of_command: Its command.
    """

    buffer: str
    other: str
    echo: int | None
    echoed: str
    status: str
    of_number: int | None
    of_command: str
    fields: tuple[TickValue, ...]

    @property
    def matches(self) -> bool:
        """Whether the number echoed is that of the order."""
        return self.echo == self.of_number

    @property
    def same_command(self) -> bool:
        """Whether it is about the command of the order."""
        return self.echoed == self.of_command


@dataclass(frozen=True, slots=True)
class ShownState:
    """A state variable, or an output that nobody answers.

    Attributes:
        deferred: Whether its next value waits for an echo.
        pending: Its deferred next value where that is another; empty otherwise.
    """

    name: str
    before: str
    now: str
    deferred: bool = False
    pending: str = ""


@dataclass(frozen=True, slots=True)
class LevelTick:
    """A level in a tick.

    Attributes:
        ran: Whether it had a cycle; if not, everything else is empty.
        lines: What matched: one where all is well.
        before: Table and line of each that ran before that table in the cycle.
        fault: What ended the cycle early; empty for nothing.
        wrong: What went wrong in it, in words.
        above: The order taken, and the report given upward, where there are such.
        below: The reports seen, each beside the order that was given to the same.
        inputs: Other inputs that changed.
        states: Those that are deferred, and whatever else changed.
    """

    level: str
    ran: bool
    table: str = ""
    lines: tuple[str, ...] = ()
    fault: str = ""
    wrong: str = ""
    above: tuple[tuple[Order | None, Reported | None], ...] = ()
    below: tuple[tuple[Reported | None, Order | None], ...] = ()
    inputs: tuple[TickValue, ...] = ()
    states: tuple[ShownState, ...] = ()
    before: tuple[tuple[str, str], ...] = ()

    @property
    def matched(self) -> str:
        """Say which lines matched."""
        if len(self.lines) > 1:
            return f"lines {', '.join(self.lines[:-1])} and {self.lines[-1]} match"
        return f"line {self.lines[0]}" if self.lines else self.fault or "no line"


@dataclass(frozen=True, slots=True)
class LoggedTick:
    """A tick: every level of the log, from the top down."""

    tick: int
    boxes: tuple[LevelTick, ...]


def frames(log: Log) -> Iterator[LoggedTick]:
    """Every tick of a log."""
    wires = other_ends(log.system().wires)
    for tick in log.ticks:
        yield tick_of(log, tick, wires)


def tick_of(log: Log, tick: int, wires: Mapping[str, str]) -> LoggedTick:
    """Return one tick of a log.

    Args:
        log: Of any run.
        tick: Any; in one that the log does not have no level had a cycle.
        wires: The `other_ends` of its system.
    """
    return LoggedTick(tick, tuple(level_tick(log, level, tick, wires) for level in log.levels))


def other_ends(wires: Iterable[Wire]) -> dict[str, str]:
    """Return who is at the other end of each variable, `level.variable`; of several readers the first: orders and reports have one."""
    others: dict[str, str] = {}
    for wire in wires:
        others[wire.target] = wire.source.partition(".")[0]
        others.setdefault(wire.source, wire.target.partition(".")[0])
    return others


def level_tick(log: Log, level: LoggedLevel, tick: int, wires: Mapping[str, str]) -> LevelTick:
    """Return one level in a tick; arguments as those of `tick_of`."""
    at = level.track.place(tick)
    if at < 1 or level.track.ticks[at] != tick:
        return LevelTick(level.name, ran=False)
    restart = level.restarted(at)
    before = level.track.layout.unpack(level.track.packed[at - 1]) if restart is None else restart.values
    after = level.track.layout.unpack(level.track.packed[at])
    told = log.finding.cycles.get((tick, level.name)) if log.finding is not None else None
    return _Cycle(level, before, after, wires).box(told)


@dataclass(frozen=True, slots=True)
class _Cycle:
    """One cycle of a level: every leaf before and after it."""

    logged: LoggedLevel
    before: Values
    after: Values
    wires: Mapping[str, str]

    def box(self, told: LoggedCycle | None) -> LevelTick:
        """Return what it shows."""
        sign, level = self.logged.sign, self.logged.level
        fault, leaf = sign.fault_word(self.after), sign.fault_at(self.after)
        line, failed = sign.line_of(level, self.after), " ".join(sign.failures(self.after))
        lines = told.matched if told is not None and told.matched else (line,) if line else ()
        above, below = self._exchanges()
        return LevelTick(
            level.name,
            ran=True,
            table=sign.table_of(level, self.after),
            lines=lines,
            fault="" if fault == "none" else fault + (f": {leaf}" if leaf else ""),
            wrong=told.wrong if told is not None else f"assumptions fail: {failed}" if failed else "",
            above=above,
            below=below,
            inputs=tuple(
                value for record in self._aside() for value in self._fields(record, only_changed=True)
            ),
            states=tuple(self._states()),
            before=sign.lines_before(level, self.after),
        )

    # --- orders and reports ---

    def _exchanges(
        self,
    ) -> tuple[
        tuple[tuple[Order | None, Reported | None], ...], tuple[tuple[Reported | None, Order | None], ...]
    ]:
        """With whoever orders this level, and with those that it orders."""
        sides: dict[tuple[str, bool], tuple[str, str]] = {}
        for record, kind in self._records().items():
            order, report = self._has(record, COMMAND), self._has(record, STATUS)
            if order != report and kind != "state":
                key = self._other(record) or record, order is (kind == "input")
                held = sides.get(key, ("", ""))
                sides[key] = (record, held[1]) if order else (held[0], record)
        above, below = [], []
        for (_, upward), (order_of, report_of) in sides.items():
            given = self._order(order_of) if order_of else None
            if upward:
                above.append((given, self._reported(report_of, order_of, self.after) if report_of else None))
            else:
                below.append((self._reported(report_of, order_of, self.before) if report_of else None, given))
        return tuple(above), tuple(below)

    def _order(self, record: str) -> Order:
        number = f"{record}.{NUMBER}"
        command, before = (self._word(values, f"{record}.{COMMAND}") for values in (self.after, self.before))
        numbered = number in self.logged.sign.index
        new = numbered and self._value(self.after, number) != self._value(self.before, number)
        return Order(
            record,
            self._other(record),
            int(self._value(self.after, number)) if numbered else None,
            command,
            new,
            numbered and not new and command != before,
            self._fields(record, but=(NUMBER, COMMAND)),
        )

    def _reported(self, record: str, order: str, stood: Values) -> Reported:
        """A report, against the order as it stood then."""
        echo, number = f"{record}.{ECHO}", f"{order}.{NUMBER}"
        echoed, known = f"{record}.{ECHOED}", self.logged.sign.index
        return Reported(
            record,
            self._other(record),
            int(self._value(self.after, echo)) if echo in known else None,
            self._word(self.after, echoed) if echoed in known else "",
            self._word(self.after, f"{record}.{STATUS}"),
            int(self._value(stood, number)) if order and number in known else None,
            self._word(stood, f"{order}.{COMMAND}") if order else "",
            self._fields(record, but=(ECHO, ECHOED, STATUS)),
        )

    # --- everything else ---

    def _aside(self) -> Iterator[str]:
        """Inputs that are neither orders nor reports."""
        for record, kind in self._records().items():
            if kind == "input" and not self._is_exchanged(record):
                yield record

    def _states(self) -> Iterator[ShownState]:
        """Yield every deferred state; then other states that changed, and outputs that nobody answers."""
        index, leaves = self.logged.sign.index, self.logged.sign.leaves
        deferred = [leaf.name for leaf in leaves if pending(leaf.name) in index]
        nexts = {str(pending(name)) for name in deferred}
        for name in deferred:
            now, then = self._word(self.after, name), self._word(self.after, pending(name))
            yield ShownState(name, self._word(self.before, name), now, True, then if then != now else "")
        kept = (leaf for stage in self.logged.level.stages for leaf in stage.kept.values())
        shown = {*deferred, *nexts, *kept}
        for leaf in leaves:
            aside = leaf.kind == "state" or (leaf.kind == "output" and not self._is_exchanged(leaf.name))
            if aside and leaf.name not in shown and self._changed(leaf):
                yield ShownState(
                    leaf.name, self._word(self.before, leaf.name), self._word(self.after, leaf.name)
                )

    def _fields(
        self, record: str, but: tuple[str, ...] = (), *, only_changed: bool = False
    ) -> tuple[TickValue, ...]:
        """Return the leaves of a record that changed or are not initial; an array in it as one."""
        aside = {f"{record}.{name}" for name in but}
        arrays: dict[str, list[Leaf]] = {}
        for at in _places(self.logged.sign, record):
            leaf = self.logged.sign.leaves[at]
            if leaf.name not in aside:
                arrays.setdefault(leaf.name.partition("[")[0], []).append(leaf)
        fields = []
        for name, leaves in arrays.items():
            changed = any(map(self._changed, leaves))
            at_first = all(self._value(self.after, leaf.name) == leaf.initial for leaf in leaves)
            if changed or not (only_changed or at_first):
                words = [self._word(self.after, leaf.name) for leaf in leaves]
                shown = words[0] if "[" not in leaves[0].name else f"({', '.join(words)})"
                fields.append(
                    TickValue(name if only_changed else name.removeprefix(f"{record}."), shown, changed)
                )
        return tuple(fields)

    def _records(self) -> dict[str, str]:
        """Variables, records and arrays whole, with their kinds, in declared order."""
        return {leaf.name.partition(".")[0].partition("[")[0]: leaf.kind for leaf in self.logged.sign.leaves}

    def _is_exchanged(self, name: str) -> bool:
        """Whether it is an order or a report, or a leaf of one."""
        record = name.partition(".")[0]
        return self._has(record, COMMAND) or self._has(record, STATUS)

    def _has(self, record: str, field: str) -> bool:
        return f"{record}.{field}" in self.logged.sign.index

    def _other(self, record: str) -> str:
        return self.wires.get(f"{self.logged.name}.{record}", "")

    def _changed(self, leaf: Leaf) -> bool:
        return self._value(self.before, leaf.name) != self._value(self.after, leaf.name)

    def _value(self, values: Values, name: str) -> bool | int | float:
        return values[self.logged.sign.index[name]]

    def _word(self, values: Values, name: str) -> str:
        return self.logged.sign.leaves[self.logged.sign.index[name]].shown(self._value(values, name))


_KNOWN: dict[int, tuple[Signature, dict[str, range]]] = {}
"""By signature, which is kept so that its number stays its own, where the leaves of its records lie."""


def _places(sign: Signature, record: str) -> range:
    """Where the leaves of a record lie; asked again for every tick that is drawn."""
    if id(sign) not in _KNOWN and len(_KNOWN) >= MOST_KNOWN:
        _KNOWN.clear()
    known = _KNOWN.setdefault(id(sign), (sign, {}))[1]
    if record not in known:
        known[record] = sign.record(record)
    return known[record]
