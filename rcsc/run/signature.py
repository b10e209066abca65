"""What a generated program looks like from outside: its leaves, tables and levels, from the symbol file beside it.

In: `generated/c/NAME.json`. Out: a `Signature`. The canonical bytes of a state are its leaves in declared order and
then the trace, little-endian, without padding: the same for every executor and machine.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import TypeAlias

from rcsc.base.host.files.names import BadName, identifier, inside, shown
from rcsc.base.host.files.read import MIB, CheckedFields, Malformed, json_of, text
from rcsc.lang.operator_table import part_way, single, spell_single
from rcsc.lang.restart import Adopted, After, Fixed, Part, SameAs, Stands, by_names
from rcsc.run.description import BadDescription

Value: TypeAlias = bool | int | float
Values: TypeAlias = tuple[Value, ...]

FORMATS = {
    "bool": "?", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i",
    "uint64_t": "Q", "int64_t": "q", "double": "d", "float": "f",
}  # fmt: skip
REALS = ("double", "float")
"""C types of numbers with a fraction."""
TRACE = ("line", "fault", "fault_at")
"""What a cycle leaves beside the leaves; the words of failed assumptions come after it."""
FAILED = ("assumptions_failed",)
"""The words of failed assumptions, 64 in each, where the symbol file names no others."""
FEW_MONITORED = 32
"""Assumptions up to which C keeps those that failed in a word of 32 bits."""
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
_UNMATCHED = frozenset(map(FAULTS.index, ("no line matches", "several lines match")))
_ENDED_BY_A_TABLE = _UNMATCHED | {STOPPED}
_NOT_BEGUN = frozenset(map(FAULTS.index, ("input refused", "state refused")))
"""Faults after which every leaf is as the cycle before left it."""


MOST_SYMBOL_BYTES, MOST_LEAVES, MOST_LEVELS, LONGEST_PERIOD_MS = 64 * MIB, 1_000_000, 100_000, 2**31 - 1
MOST_MEMBERS = {"uint8_t": 2**8, "uint16_t": 2**16}
"""Most members of an enumeration, by the C type of its values."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """One scalar of a program's state.

    Attributes:
        kind: `input`, `state` or `output`.
        place: Its name in the C struct; `attribute` is its name in Python.
        members: Of an enumeration; empty for numbers and bools.
        clamp: Whether an input outside its range is moved to its edge; else it is refused.
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
    clamp: bool = False

    @property
    def part(self) -> Part:
        """The leaf as `rcsc.lang.restart` sees it: its name may tell how it starts anew."""
        whole = (
            None
            if self.members or self.c_type in {"bool", *REALS}
            else (int(self.low or 0), int(self.high or 0))
        )
        return Part(self.kind == "output", self.members, whole)

    def shown(self, value: Value) -> str:
        """Return the value in the table's words."""
        if self.members:
            return self.members[int(value)] if 0 <= value < len(self.members) else f"{int(value)}?"
        if self.c_type == "float":
            return spell_single(float(value))
        return ("false", "true")[bool(value)] if self.c_type == "bool" else repr(value)

    def held(self, value: float) -> float:
        """Return a real number as the variable's C type holds it: a single is rounded."""
        return single(value) if self.c_type == "float" else value

    def anywhere(self, random: Random, low: float, high: float) -> Value:
        """Return a number between two, both of which it can be; it is no truth value."""
        if self.c_type in REALS:
            return self.held(part_way(low, high, random.random()))
        return random.randint(int(low), int(high))

    def read(self, text: str) -> Value:
        """Read the value of a text.

        Raises:
            ValueError: The text is no value of this leaf.
        """
        if self.members:
            return self.members.index(text)
        if self.c_type == "bool":
            return ("false", "true").index(text) == 1
        value: Value = self.held(float(text)) if self.c_type in REALS else int(text)
        if self.low is not None and self.high is not None and not self.low <= value <= self.high:
            raise ValueError(f"{text} lies outside {self.low} .. {self.high}")
        return value


def c_range(c_type: str) -> tuple[int, int]:
    """Return the least and the greatest value of a C type of whole numbers, or of truth."""
    if c_type == "bool":
        return 0, 1
    code = FORMATS[c_type]
    bits = 8 * struct.calcsize(f"<{code}")
    return (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if code.islower() else (0, 2**bits - 1)


def number_word(leaf: Leaf) -> str:
    """Return the language's word for the type of a number."""
    return {"double": "real", "float": "single"}.get(leaf.c_type, "int")


@dataclass(frozen=True, slots=True)
class StageSign:
    """The tables that run before the last one of a cycle: one table, or one by a leaf.

    Attributes:
        kept: By table the leaf that holds its line: 0 for none, else one more than its position.
    """

    table: str
    by: str
    tables: Mapping[int, str]
    kept: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class LevelSign:
    """A level: which functions run it, which table, and what runs before that in a cycle."""

    name: str
    cycle: str
    period_ms: int
    table: str
    by: str
    tables: Mapping[int, str]
    stages: tuple[StageSign, ...] = ()

    @property
    def every_table(self) -> tuple[str, ...]:
        """Every table that it may run, in the order of a cycle."""
        before = (name for stage in self.stages for name in stage.kept)
        return (*before, *((self.table,) if self.table else dict.fromkeys(self.tables.values())))


@dataclass(frozen=True, slots=True)
class Unset:
    """Numbers whose initial value nobody wrote, and what may set them; an input's buffer does that, or the database.

    Attributes:
        tables: By table the lines that may write them.
        levels: Those that may write them in each of their cycles, whichever line runs.
    """

    leaves: tuple[str, ...]
    tables: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    levels: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Serves:
    """The superior that a program's level serves, as it declares it.

    Attributes:
        order: The record of orders, and `report` that of reports.
        rest: The command that rests.
        done, failed: The statuses that answer a command.
    """

    order: str
    report: str
    rest: str
    done: str
    failed: str


@dataclass(frozen=True, slots=True)
class Signature:
    """A program as seen from outside.

    Attributes:
        monitored: Assumptions that the executors check.
        stops: By table, those that end the cycle where they fail.
        unset: What has no value when a run begins, though it has that of its type; empty where a symbol file does not say.
        sees: By table the leaves that decide which line matches; empty likewise.
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
    invariants: tuple[str, ...] = ()
    restart: Mapping[int, Adopted] = field(default_factory=dict)
    serves: Serves | None = None
    unset: tuple[Unset, ...] = ()
    sees: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def check(self) -> str:
        """The C function that checks a state."""
        return f"{self.program}_check"

    @property
    def trace(self) -> tuple[str, ...]:
        """The members of the trace, in order."""
        return (*TRACE, *self.failed)

    @property
    def trace_format_in_c(self) -> str:
        """The format of the trace's members for `struct`, in C, where few assumptions take a smaller word than in a log."""
        return "i" * len(TRACE) + ("I" if len(self.monitored) <= FEW_MONITORED else "Q") * len(self.failed)

    def failures(self, values: Values) -> tuple[str, ...]:
        """Return the monitored assumptions that failed in the cycle that left these values."""
        words = [int(word) for word in values[len(self.leaves) + len(TRACE) :]]
        return tuple(name for at, name in enumerate(self.monitored) if words[at // 64] >> at % 64 & 1)

    @property
    def packed(self) -> struct.Struct:
        """Leaves and trace as canonical bytes."""
        leaves = "".join(FORMATS[leaf.c_type] for leaf in self.leaves)
        return struct.Struct("<" + leaves + "i" * len(TRACE) + "Q" * len(self.failed))

    def form(self, run: range) -> str:
        """Return the format in which `struct.pack` refuses values of other types; a bool is packed as a number."""
        types = (FORMATS[self.leaves[at].c_type] for at in run)
        return "<" + "".join("B" if code == "?" else code for code in types)

    def variables(self, kind: str) -> tuple[str, ...]:
        """Return the declared variables of a kind, `input` or `output`, in order."""
        names = (re.split(r"[.\[]", leaf.name, maxsplit=1)[0] for leaf in self.leaves if leaf.kind == kind)
        return tuple(dict.fromkeys(names))

    def record(self, name: str) -> range:
        """Return the positions of a variable's leaves, which are next to each other; the pending value of a variable is not part of it.

        Raises:
            KeyError: There is no such variable.
        """
        if name in self.index:
            return range(self.index[name], self.index[name] + 1)
        places = [
            at
            for at, leaf in enumerate(self.leaves)
            if leaf.name == name or leaf.name.startswith((f"{name}.", f"{name}["))
        ]
        if not places:
            raise KeyError(name)
        return range(places[0], places[-1] + 1)

    def leaves_of(self, name: str) -> tuple[Leaf, ...]:
        """Return a variable's leaves; raises KeyError where there is none of that name."""
        run = self.record(name)
        return self.leaves[run.start : run.stop]

    def level_of(self, name: str) -> LevelSign:
        """The level of that name.

        Raises:
            BadDescription: The program has none.
        """
        for level in self.levels:
            if level.name == name:
                return level
        raise BadDescription(f"program `{self.program}` has no level `{name}`")

    def table_of(self, level: LevelSign, values: Values) -> str:
        """Return the table that the level ran in the cycle that left these values; of several the last, or the one that ended the cycle."""
        if level.stages and self.fault(values) in _ENDED_BY_A_TABLE:
            names = (self._chosen(stage, values) for stage in level.stages)
            ended = (
                name
                for stage, name in zip(level.stages, names, strict=True)
                if not self._kept(stage, name, values)
            )
            if (name := next(ended, None)) is not None:
                return name
        return self._chosen(level, values)

    def line_of(self, level: LevelSign, values: Values) -> str:
        """The line that the cycle ran; empty for none."""
        lines = self.tables.get(self.table_of(level, values), ())
        at = int(values[len(self.leaves)])
        return lines[at] if 0 <= at < len(lines) else ""

    def lines_before(self, level: LevelSign, values: Values) -> tuple[tuple[str, str], ...]:
        """Return table and line of each that ran before that one in the cycle, in order."""
        if not self.begun(values):
            return ()
        ran = (
            (name := self._chosen(stage, values), self._kept(stage, name, values)) for stage in level.stages
        )
        return tuple(
            (name, self.tables[name][at - 1]) for name, at in ran if 0 < at <= len(self.tables.get(name, ()))
        )

    def lines_of(self, level: LevelSign, values: Values) -> tuple[tuple[str, str], ...]:
        """Return table and line of all that the cycle ran, in order; where it was ended, the table tried last has no line."""
        last = self.table_of(level, values), self.line_of(level, values)
        return (*self.lines_before(level, values), last)

    def begun(self, values: Values) -> bool:
        """Tell whether the cycle that left these values ran: it did not where an input or the state was refused."""
        return self.fault(values) not in _NOT_BEGUN

    def _chosen(self, choice: LevelSign | StageSign, values: Values) -> str:
        return choice.table or choice.tables.get(int(values[self.index[choice.by]]), "?")

    def _kept(self, stage: StageSign, table: str, values: Values) -> int:
        return int(values[self.index[stage.kept[table]]]) if table in stage.kept else 0

    def fault(self, values: Values) -> int:
        """Return the fault of the cycle that left these values; 0 for none."""
        return int(values[len(self.leaves) + 1])

    def fault_word(self, values: Values) -> str:
        """Return the fault of the cycle that left these values in a word; `none` for none."""
        fault = self.fault(values)
        return FAULTS[fault] if 0 <= fault < len(FAULTS) else f"{fault}?"

    def fault_at(self, values: Values) -> str:
        """Return the subject of a cycle's fault: the refused leaf, or the assumption; empty for none."""
        fault, at = (int(values[len(self.leaves) + place]) for place in (1, 2))
        if fault == STOPPED:
            return self.monitored[at] if 0 <= at < len(self.monitored) else f"{at}?"
        if fault in _UNMATCHED:
            return ""  # of several tables `table_of` says which
        if at >= len(self.leaves):
            return self._invariant(at)
        return self.leaves[at].name if 0 <= at < len(self.leaves) else ""

    def fault_text(self, values: Values) -> str:
        """Return a fault in words: `input refused: `width` = 9`, `assumption failed: `calm``, `no line matches`."""
        fault, at = (int(values[len(self.leaves) + place]) for place in (1, 2))
        word, about = self.fault_word(values), self.fault_at(values)
        if not about:
            return word
        if fault == STOPPED:
            return f"{word}: `{about}`"
        return f"{word}: {self.unfit(at, values)}"

    def witness(self, table: str, values: Values) -> str:
        """Return the inputs of a table that ended the cycle by a fault: `width` = 9, `new` = true; empty for other faults."""
        if self.fault(values) not in _ENDED_BY_A_TABLE:
            return ""
        seen = ((name, self.index[name]) for name in self.sees.get(table, ()) if name in self.index)
        return ", ".join(f"`{name}` = {self.leaves[at].shown(values[at])}" for name, at in seen)

    def fault_seen(self, level: LevelSign, values: Values) -> str:
        """Return a fault in words, with the inputs of its table where they are known."""
        saw = self.witness(self.table_of(level, values), values)
        return self.fault_text(values) + (f"; it saw {saw}" if saw else "")

    def _invariant(self, at: int) -> str:
        at -= len(self.leaves)
        return self.invariants[at] if at < len(self.invariants) else f"{at}?"

    def unfit(self, at: int, values: Values) -> str:
        """Return the error that `check` found in a state, in words: `width` = 300, or the invariant that does not hold."""
        if at == len(self.leaves) + len(self.invariants):
            return "it is of other tables"
        if at >= len(self.leaves):
            return f"invariant `{self._invariant(at)}` does not hold"
        return f"`{self.leaves[at].name}` = {self.leaves[at].shown(values[at])}"


def generated_files(generated: Path, program: str) -> tuple[Path, ...]:
    """Return the generated files of a program: symbol file, C, header, Python; all in the generated folder.

    The symbol file bears the program's name; the others one that no library keeps, as the symbol file says.

    Raises:
        BadDescription: The name is none of a program, or a link leads out of the folder.
    """
    try:
        symbols = inside(generated, "c", f"{identifier(program, 'program')}.json")
        try:
            word = _signature(text(symbols, MOST_SYMBOL_BYTES)).program
        except (OSError, ValueError):
            word = program
        return symbols, *sources_of(generated, word)
    except BadName as error:
        raise BadDescription(str(error)) from error


def sources_of(generated: Path, word: str) -> tuple[Path, Path, Path]:
    """Return the C, the header and the Python that bear a program's word, in the generated folder.

    Raises:
        BadName: The word is no name, or a link leads out of the folder.
    """
    name = identifier(word, "program")
    source, header = (inside(generated, "c", f"{name}{ending}") for ending in (".c", ".h"))
    return source, header, inside(generated, "python", f"{name}.py")


def signature(path: Path) -> Signature:
    """Read a symbol file.

    Raises:
        OSError: It cannot be read.
        ValueError: It is no symbol file.
    """
    try:
        return _signature(text(path, MOST_SYMBOL_BYTES))
    except Malformed as error:
        raise ValueError(f"{path} is no symbol file of rcsc's: {error}") from error


@lru_cache(maxsize=16)  # to assemble a system reads each symbol file several times
def _signature(symbols: str) -> Signature:
    return signature_of(CheckedFields(json_of(symbols)))


def signature_of(symbols: CheckedFields) -> Signature:
    """Read the signature in a symbol file, or in a log's copy of one.

    The functions it names are the program's own: their names begin with its name.

    Raises:
        Malformed: A name in it is none, a value does not fit its type, or something is missing.
    """
    program = symbols.name("program")
    leaves = tuple(map(_leaf, symbols.each("leaves", MOST_LEAVES)))
    index = {leaf.name: at for at, leaf in enumerate(leaves)}
    if len(index) < len(leaves):
        raise Malformed("two leaves have one name")
    tables, stops, sees = _tables(symbols)
    levels = tuple(_level(level, program, index) for level in symbols.each("levels", MOST_LEVELS))
    if len(tables) == 0 and levels:
        raise Malformed("it has levels and no table")
    monitored, failed = symbols.names("monitored"), symbols.names("failed", FAILED)
    if len(monitored) > 64 * len(failed):
        raise Malformed(f"{len(failed)} words for {len(monitored)} assumptions")
    return Signature(
        program,
        _own(symbols.name("struct" if "struct" in symbols.value else "struct_name"), f"{program}_t", ""),
        _own(symbols.name("init"), f"{program}_init", ""),
        leaves,
        tables,
        levels,
        monitored,
        index,
        failed,
        stops,
        symbols.names("invariants", ()),
        {index[name]: adopted for name, adopted in _restart(symbols, leaves).items()},
        _serves(symbols, leaves),
        _unset(symbols, index),
        sees,
    )


def _unset(symbols: CheckedFields, index: Mapping[str, int]) -> tuple[Unset, ...]:
    """Return the numbers that nobody has set at first; entries for a missing leaf are left out."""
    if "unset" not in symbols.value:
        return ()
    return tuple(_unset_together(entry, index) for entry in symbols.each("unset", len(index)))


def _unset_together(entry: CheckedFields, index: Mapping[str, int]) -> Unset:
    leaves = tuple(name for name in entry.members("leaves") if name in index)
    tables = entry.table("tables") if "tables" in entry.value else CheckedFields({})
    lines = {identifier(name, "table"): tables.lines(name) for name in tables.value}
    return Unset(leaves, lines, entry.names("levels", ()))


def _serves(symbols: CheckedFields, leaves: tuple[Leaf, ...]) -> Serves | None:
    """Read the superior that the level serves: in a symbol file among its roles, in a log by itself; None where none is declared.

    Raises:
        Malformed: The level has no such records, or no such members.
    """
    roles = symbols.table("roles") if "roles" in symbols.value else symbols
    if "serves" not in roles.value:
        return None
    role = roles.table("serves")
    serves = Serves(*(role.name(key) for key in ("order", "report", "rest", "done", "failed")))
    inside = tuple(f"{record}." for record in (serves.order, serves.report))
    members = {member for leaf in leaves if leaf.name.startswith(inside) for member in leaf.members}
    missing = [word for word in (serves.rest, serves.done, serves.failed) if word not in members]
    if missing:
        raise Malformed(f"{role.where}: no order or report has a member {shown(missing[0])}")
    return serves


def _restart(symbols: CheckedFields, leaves: tuple[Leaf, ...]) -> dict[str, Adopted]:
    """Read the value that each leaf adopts, for leaves that do not start with their initial values.

    Raises:
        Malformed: A leaf does not exist, or does not fit the value that it adopts.
    """
    parts = {leaf.name: leaf.part for leaf in leaves}
    if "restart" not in symbols.value:
        return by_names(parts)
    by_name = {leaf.name: leaf for leaf in leaves}
    adopted: dict[str, Adopted] = {}
    for entry in symbols.each("restart", len(leaves)):
        name = entry.member("leaf")
        if name not in by_name:
            raise Malformed(f"{entry.where}: there is no leaf {shown(name)}")
        adopted[name] = _adopted(entry, by_name[name], by_name)
    return adopted


def restart_written(sign: Signature) -> list[dict[str, object]] | None:
    """Return the adopted values as a symbol file has them; None where they follow from the names of the leaves."""
    adopted = {sign.leaves[at].name: adopts for at, adopts in sign.restart.items()}
    if adopted == by_names({leaf.name: leaf.part for leaf in sign.leaves}):
        return None
    return [{"leaf": leaf, **_entry(adopts)} for leaf, adopts in adopted.items()]


def _entry(adopts: Adopted) -> dict[str, object]:
    match adopts:
        case Fixed(value):
            return {"value": value}
        case SameAs(other):
            return {"same_as": other}
        case After(other):
            return {"after": other}
        case Stands():
            return {"stands": True}


def _adopted(entry: CheckedFields, leaf: Leaf, leaves: Mapping[str, Leaf]) -> Adopted:
    """Read the value that one leaf adopts.

    Raises:
        Malformed: The value is none of the leaf, or the other leaf does not exist or has another type.
    """
    for word, form in (("same_as", SameAs), ("after", After)):
        if word in entry.value:
            other = leaves.get(entry.member(word))
            if (
                other is None
                or (other.c_type, other.members) != (leaf.c_type, leaf.members)
                or leaf.part.whole is None
            ):
                raise Malformed(f"{entry.where}: {shown(leaf.name)} cannot adopt that")
            return form(other.name)
    if "stands" in entry.value:
        if not entry.flag("stands") or leaf.kind != "output":
            raise Malformed(f"{entry.where}: {shown(leaf.name)} stands in no buffer of its own")
        return Stands()
    value = entry.number("value")
    if (
        value is None
        or not _fits(leaf.c_type, value)
        or (leaf.members and not 0 <= value < len(leaf.members))
    ):
        raise Malformed(f"{entry.where}.value is no `{leaf.c_type}` of it")
    return Fixed(value)


def _own(name: str, begins: str, rest: str) -> str:
    """Return a name in C if it is the program's own; refuse one that a library may have."""
    if not (name.startswith(begins) if rest else name == begins):
        raise Malformed(f"{shown(name)} is not `{begins}{rest}`")
    return name


def _leaf(entry: CheckedFields) -> Leaf:
    members, c_type, initial = (
        entry.names("members", ()),
        entry.one_of("c_type", tuple(FORMATS)),
        entry.number("initial"),
    )
    if not _fits(c_type, initial) or (members and not 0 <= (initial or 0) < len(members)):
        raise Malformed(f"{entry.where}.initial is no `{c_type}` of it")
    if len(members) > MOST_MEMBERS.get(c_type, 0):
        raise Malformed(f"{entry.where} has {len(members)} members, more than a `{c_type}` can tell apart")
    assert initial is not None
    return Leaf(
        entry.member("name"),
        entry.one_of("kind", ("input", "state", "output")),
        entry.member("path" if "path" in entry.value else "place"),
        entry.name("attribute"),
        c_type,
        members,
        entry.number("low", None),
        entry.number("high", None),
        entry.text("unit", ""),
        initial,
        entry.text("doc"),
        entry.flag("clamp"),
    )


def _fits(c_type: str, value: object) -> bool:
    """Tell whether a value is of the type, not an equal one of another type."""
    if type(value) is not {"bool": bool, "double": float, "float": float}.get(c_type, int):
        return False
    try:
        held = struct.unpack(f"<{FORMATS[c_type]}", struct.pack(f"<{FORMATS[c_type]}", value))[0]
    except (struct.error, OverflowError):
        return False
    return bool(held == value)


_ByTable: TypeAlias = dict[str, tuple[str, ...]]


def _tables(symbols: CheckedFields) -> tuple[_ByTable, _ByTable, _ByTable]:
    """Return the lines of each table, what stops it, and what it sees; a symbol file lists tables, a log keeps mappings."""
    if isinstance(symbols.value.get("tables"), dict):
        lines, stops, sees = (
            symbols.table(key) if key in symbols.value else CheckedFields({})
            for key in ("tables", "stops", "sees")
        )
        return (
            {identifier(name, "table"): lines.lines(name) for name in lines.value},
            {identifier(name, "table"): stops.names(name) for name in stops.value},
            {identifier(name, "table"): sees.members(name) for name in sees.value},
        )
    several = tuple(symbols.each("tables", MOST_LEVELS))
    return (
        {table.name("name"): table.lines("lines") for table in several},
        {table.name("name"): table.names("stops") for table in several if "stops" in table.value},
        {table.name("name"): table.members("sees") for table in several if "sees" in table.value},
    )


def _level(entry: CheckedFields, program: str, index: Mapping[str, int]) -> LevelSign:
    table, by, tables = _choice(entry, index)
    return LevelSign(
        entry.name("name"),
        _own(entry.name("cycle"), f"{program}_", "..."),
        entry.whole("period_ms", 1, LONGEST_PERIOD_MS),
        table,
        by,
        tables,
        tuple(_stage(stage, index) for stage in entry.each("stages", MOST_LEVELS))
        if "stages" in entry.value
        else (),
    )


def _stage(entry: CheckedFields, index: Mapping[str, int]) -> StageSign:
    named = entry.table("kept")
    kept = {identifier(name, "table"): named.member(name) for name in named.value}
    strange = [leaf for leaf in kept.values() if leaf not in index]
    if strange:
        raise Malformed(f"{entry.where}.kept: {shown(strange[0])} is no leaf")
    return StageSign(*_choice(entry, index), kept)


def _choice(entry: CheckedFields, index: Mapping[str, int]) -> tuple[str, str, dict[int, str]]:
    """Return the table that runs, or the leaf that chooses one, and each table by its value."""
    by, tables = entry.text("by", ""), {}
    if "tables" in entry.value:
        named = entry.table("tables")
        tables = {_key(value): named.name(value) for value in named.value}
    if (by or tables) and by not in index:
        raise Malformed(f"{entry.where}.by: {shown(by)} is no leaf")
    table = entry.name("table", "") if entry.value.get("table") else ""
    if not table and not by:
        raise Malformed(f"{entry.where} has no table")
    return table, by, tables


def _key(text: str) -> int:
    if re.fullmatch(r"-?[0-9]{1,19}", text) is None:
        raise Malformed(f"{shown(text)} is no value of a command")
    return int(text)
