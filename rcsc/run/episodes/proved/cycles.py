"""A cycle of a level as claims see it: its values before and after, what it took, which lines ran, and what its tables saw.

In: a running level after a cycle, with what it had before. Out: `Now`. What stands between two steps of a cycle is computed by the
reference interpreter, on demand; not for a program with extern procedures, whose results nobody kept.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

from rcsc.lang.interpret import UNDEFINED, call, holds, settle
from rcsc.lang.model import BEFORE, Expr, Kind, Level, Program, Table, Value
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import FAULTS, Signature, Values

REFUSED = FAULTS.index("input refused")
EXTERN = FAULTS.index("extern refused")
FLAG = "new_command"


@dataclass(slots=True)
class Now:
    """A cycle of a level.

    Attributes:
        before: All leaves as the last cycle left them, or as the level began.
        stood: The same of the last cycle that took its inputs.
        values: All leaves now, inputs as they were taken.
        anew: Whether it is the first cycle, or the first after a restart, that takes its inputs; `restarted`, the latter.
        begins: Whether it is the first cycle, or the first after a restart, whatever it takes.
        lines: Table and line of each that ran.
        seen: All leaves as the first table saw them, once that was computed (`Reader.prepared`).
    """

    level: RunningLevel
    before: Values
    stood: Values
    values: Values
    fault: int
    anew: bool
    restarted: bool
    begins: bool
    lines: tuple[tuple[str, str], ...]
    seen: dict[str, Value] | None = field(default=None)

    @property
    def took(self) -> bool:
        """Whether it took its inputs."""
        return self.fault != REFUSED


@dataclass(frozen=True)
class Reader:
    """A level's leaves by their names, and its program.

    Attributes:
        asks: Whether it has extern procedures.
    """

    program: Program
    level: Level
    sign: Signature

    @cached_property
    def asks(self) -> bool:
        """Whether it has extern procedures."""
        return any(procedure.extern is not None for procedure in self.program.procedures)

    @cached_property
    def inputs(self) -> tuple[int, ...]:
        """Places of its inputs."""
        return tuple(self.sign.index[str(v.name)] for v in self.program.variables if v.kind is Kind.INPUT)

    def at(self, leaf: str) -> int:
        """Return the place of a leaf."""
        return self.sign.index[leaf]

    def record(self, name: str) -> range:
        """Return the places of a record's leaves."""
        return self.sign.record(name)

    def shown(self, leaf: str, values: Values) -> str:
        """Return a leaf with its value, in words."""
        at = self.at(leaf)
        return f"`{leaf}` = {self.sign.leaves[at].shown(values[at])}"

    def table(self, name: str) -> Table:
        """Return a table of the program."""
        return next(table for table in self.program.tables if table.name == name)

    def snapshot(self, values: Values) -> dict[str, Value]:
        """Return all leaves by their names."""
        return {name: values[at] for name, at in self.sign.index.items()}

    def true(self, condition: Expr, now: Values, before: Values) -> bool:
        """Whether a condition is defined and true of a cycle and the one before it."""
        try:
            return holds(condition, _Both(self.sign, now, before))
        except UNDEFINED:
            return False

    def prepared(self, now: Now) -> dict[str, Value]:
        """Return all leaves as the first table of the cycle saw them."""
        if now.seen is None:
            seen = self.snapshot(now.stood)
            names = [self.sign.leaves[at].name for at in self.inputs]
            seen.update((name, now.values[self.at(name)]) for name in names)
            now.seen = self.begun(seen)
        return now.seen

    def begun(self, seen: dict[str, Value]) -> dict[str, Value]:
        """Return the same leaves after deferred values were taken and the preprocess ran."""
        settle(self.program, seen)
        for name in self.level.preprocess:
            call(self.program, name, [], seen)
        return seen


class _Both(dict[str, Value]):
    """Leaves by name, of a cycle and the one before it; looked up as they are read."""

    def __init__(self, sign: Signature, now: Values, before: Values) -> None:
        super().__init__()
        self._index, self._now, self._before = sign.index, now, before

    def __missing__(self, name: str) -> Value:
        if name.startswith(BEFORE):
            return self._before[self._index[name.removeprefix(BEFORE)]]
        return self._now[self._index[name]]


def told(reader: Reader, names: Iterator[str], now: Values, before: Values) -> str:
    """Return leaves with their values, in words."""
    words = (
        f"was {reader.shown(name.removeprefix(BEFORE), before)}"
        if name.startswith(BEFORE)
        else reader.shown(name, now)
        for name in names
    )
    return ", ".join(dict.fromkeys(words))
