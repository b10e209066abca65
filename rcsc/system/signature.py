"""What a generated program looks like from outside: its leaves, tables and levels, from the symbol file beside it.

In: `generated/c/NAME.json`. Out: a `Signature`. The canonical bytes of a state are its leaves in declared order and
then the trace, little-endian, without padding: the same for every executor and machine.
"""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

Value: TypeAlias = bool | int | float
Values: TypeAlias = tuple[Value, ...]

FORMATS = {
    "bool": "?", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i",
    "uint64_t": "Q", "int64_t": "q", "double": "d",
}  # fmt: skip
TRACE = ("line", "fault", "fault_at")
"""What a cycle leaves beside the leaves; the words of failed assumptions come after it."""
FAILED = ("assumptions_failed",)
"""The words of failed assumptions, 64 in each, where the symbol file names no others."""
FAULTS = (
    "none",
    "input refused",
    "no line matches",
    "several lines match",
    "extern refused",
    "assumption failed",
    "state refused",
    "reals computed otherwise here",
)
STOPPED = FAULTS.index("assumption failed")


@dataclass(frozen=True, slots=True)
class Leaf:
    """One scalar of a program's state.

    Attributes:
        kind: `input`, `state` or `output`.
        place: How the C struct calls it; `attribute` is its name in Python.
        members: Of an enumeration; empty for numbers and bools.
    """

    name: str
    kind: str
    place: str
    attribute: str
    c_type: str
    members: tuple[str, ...]
    low: float | None
    high: float | None
    unit: str
    initial: Value
    doc: str

    def shown(self, value: Value) -> str:
        """The value in the table's words."""
        if self.members:
            return self.members[int(value)] if 0 <= value < len(self.members) else f"{int(value)}?"
        return ("false", "true")[bool(value)] if self.c_type == "bool" else repr(value)

    def read(self, text: str) -> Value:
        """The value that a text means.

        Raises:
            ValueError: It is none of this leaf's.
        """
        if self.members:
            return self.members.index(text)
        if self.c_type == "bool":
            return ("false", "true").index(text) == 1
        value: Value = float(text) if self.c_type == "double" else int(text)
        if self.low is not None and self.high is not None and not self.low <= value <= self.high:
            raise ValueError(f"{text} lies outside {self.low} .. {self.high}")
        return value


@dataclass(frozen=True, slots=True)
class LevelSign:
    """A level: which functions run it, and which table."""

    name: str
    cycle: str
    period_ms: int
    table: str
    by: str
    tables: Mapping[int, str]


@dataclass(frozen=True, slots=True)
class Signature:
    """A program from outside.

    Attributes:
        monitored: Assumptions that the executors check.
        stops: By table, those that end the cycle where they fail.
    """

    program: str
    struct_name: str
    init: str
    leaves: tuple[Leaf, ...]
    tables: Mapping[str, tuple[str, ...]]
    levels: tuple[LevelSign, ...]
    monitored: tuple[str, ...]
    index: Mapping[str, int] = field(default_factory=dict)
    failed: tuple[str, ...] = FAILED
    stops: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def trace(self) -> tuple[str, ...]:
        """The members of the trace, in order."""
        return (*TRACE, *self.failed)

    @property
    def trace_format(self) -> str:
        """The trace's members as `struct` calls them."""
        return "i" * len(TRACE) + "Q" * len(self.failed)

    def failures(self, values: Values) -> tuple[str, ...]:
        """The monitored assumptions that failed in the cycle that left these values."""
        words = [int(word) for word in values[len(self.leaves) + len(TRACE) :]]
        return tuple(name for at, name in enumerate(self.monitored) if words[at // 64] >> at % 64 & 1)

    @property
    def packed(self) -> struct.Struct:
        """Leaves and trace as canonical bytes."""
        return struct.Struct("<" + "".join(FORMATS[leaf.c_type] for leaf in self.leaves) + self.trace_format)

    def record(self, name: str) -> range:
        """Positions of the leaves of a variable: a record's or array's are next to each other.

        Raises:
            KeyError: There is no such variable.
        """
        found = [
            at
            for at, leaf in enumerate(self.leaves)
            if leaf.name == name or leaf.name.startswith((f"{name}.", f"{name}["))
        ]
        if not found:
            raise KeyError(name)
        return range(found[0], found[-1] + 1)

    def table_of(self, level: LevelSign, values: Values) -> str:
        """The table that the level ran in the cycle that left these values."""
        return level.table or level.tables.get(int(values[self.index[level.by]]), "?")

    def fault_at(self, values: Values) -> str:
        """What the fault of a cycle is about: the leaf that was refused, or the assumption; empty for nothing."""
        fault, at = (int(values[len(self.leaves) + place]) for place in (1, 2))
        if fault == STOPPED:
            return self.monitored[at] if 0 <= at < len(self.monitored) else f"{at}?"
        return self.leaves[at].name if 0 <= at < len(self.leaves) else ""

    def fault_said(self, values: Values) -> str:
        """A fault in words: `input refused: `width` = 9`, `assumption failed: `calm``, `no line matches`."""
        fault, at = (int(values[len(self.leaves) + place]) for place in (1, 2))
        word = FAULTS[fault] if 0 <= fault < len(FAULTS) else f"{fault}?"
        about = self.fault_at(values)
        if not about:
            return word
        shown = "" if fault == STOPPED else f" = {self.leaves[at].shown(values[at])}"
        return f"{word}: `{about}`{shown}"


def generated_files(generated: Path, program: str) -> tuple[Path, ...]:
    """What was generated of a program: symbol file, C, header, Python.

    The symbol file bears the program's name; the others one that no library keeps, as the symbol file says.
    """
    symbols = generated / "c" / f"{program}.json"
    try:
        said = json.loads(symbols.read_text(encoding="utf-8"))["program"]
    except (OSError, ValueError, KeyError, TypeError):
        said = program
    word = said if isinstance(said, str) and said.isidentifier() else program
    return symbols, *(generated / f"{place}{word}{end}" for place, end in _SUFFIXES)


_SUFFIXES = (("c/", ".c"), ("c/", ".h"), ("python/", ".py"))


def signature(path: Path) -> Signature:
    """Reads a symbol file.

    Raises:
        OSError: It cannot be read.
        ValueError: It is no symbol file.
    """
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
        leaves = tuple(
            Leaf(
                one["name"],
                one["kind"],
                one["path"],
                one["attribute"],
                one["c_type"],
                tuple(one.get("members", ())),
                one.get("low"),
                one.get("high"),
                one.get("unit", ""),
                one["initial"],
                one["doc"],
            )
            for one in said["leaves"]
        )
        levels = tuple(
            LevelSign(
                one["name"],
                one["cycle"],
                one["period_ms"],
                one.get("table", ""),
                one.get("by", ""),
                {int(value): table for value, table in one.get("tables", {}).items()},
            )
            for one in said["levels"]
        )
        tables = {one["name"]: tuple(one["lines"]) for one in said["tables"]}
        return Signature(
            said["program"],
            said["struct"],
            said["init"],
            leaves,
            tables,
            levels,
            tuple(said["monitored"]),
            {leaf.name: at for at, leaf in enumerate(leaves)},
            tuple(said.get("failed", FAILED)),
            {one["name"]: tuple(one["stops"]) for one in said["tables"] if "stops" in one},
        )
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} is no symbol file of rcsc's: {error}") from error
