"""The state of a level in the words of its table.

In: a signature and values. Out: names and texts; beside the leaves a level has `table`, `line`, `fault` and
`assumptions_failed`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from rcsc.run.adopt import Begun
from rcsc.run.signature import FAULTS, LevelSign, Signature, Value, Values

TRACED = ("table", "line", "fault", "fault_at", "assumptions_failed")
"""What a cycle leaves beside the leaves; a leaf of the same name hides it."""


def traced(sign: Signature, level: LevelSign, values: Values) -> dict[str, str]:
    """Return the trace in words, by name."""
    texts = (
        sign.table_of(level, values), sign.line_of(level, values), sign.fault_word(values),
        sign.fault_at(values), " ".join(sign.failures(values)),
    )  # fmt: skip
    return dict(zip(TRACED, texts, strict=True))


def words(sign: Signature, level: LevelSign, values: Values) -> dict[str, str]:
    """Return trace and leaves in words, by name."""
    shown = {leaf.name: leaf.shown(value) for leaf, value in zip(sign.leaves, values, strict=False)}
    return traced(sign, level, values) | shown


def fault_in_words(sign: Signature, level: LevelSign, values: Values) -> str:
    """`table acquire: no line matches`, `table acquire: input refused, `status_in``; empty where the cycle ended well."""
    if not sign.fault(values):
        return ""
    leaf = sign.fault_at(values)
    return f"table {sign.table_of(level, values)}: {sign.fault_word(values)}" + (
        f", `{leaf}`" if leaf else ""
    )


def witness_in_words(sign: Signature, level: LevelSign, values: Values) -> str:
    """`it saw `new` = true`: what the table saw whose fault ended the cycle; empty where it ended otherwise."""
    saw = sign.witness(sign.table_of(level, values), values)
    return f"it saw {saw}" if saw else ""


def begun_in_words(begun: Begun) -> str:
    """Name the state from which a level went on that was restarted, or set by hand."""
    return _BEGUN[begun]


_BEGUN = {
    Begun.CHECKPOINT: "from the state that its last cycle left",
    Begun.ANEW: "anew, its command failed and its orders at rest",
    Begun.HAND: "from what was set by hand",
}


def plain(value: Value) -> Value | str:
    """A number that JSON and CSV can hold."""
    return repr(value) if isinstance(value, float) and not math.isfinite(value) else value


@dataclass(frozen=True, slots=True)
class LogColumn:
    """One thing that is read off a level's values.

    Attributes:
        members: What it may be, in order; empty for numbers, bools and free text.
        c_type: Of a leaf; empty for text.
        at: The leaf's place among those of its level; -1 for what is none.
    """

    name: str
    members: tuple[str, ...]
    c_type: str
    unit: str
    read: Callable[[Values], Value | str]
    at: int = -1


def columns(sign: Signature, level: LevelSign) -> tuple[LogColumn, ...]:
    """Every column of a level: what the cycle did, then the leaves in declared order."""
    leaves = tuple(_leaf(sign, at) for at in range(len(sign.leaves)))
    taken = {leaf.name for leaf in sign.leaves}
    return (*(column for column in _trace(sign, level) if column.name not in taken), *leaves)


def _leaf(sign: Signature, at: int) -> LogColumn:
    leaf = sign.leaves[at]
    if leaf.members:
        return LogColumn(leaf.name, leaf.members, "", leaf.unit, lambda values: leaf.shown(values[at]), at)
    return LogColumn(leaf.name, (), leaf.c_type, leaf.unit, lambda values: values[at], at)


def _trace(sign: Signature, level: LevelSign) -> tuple[LogColumn, ...]:
    tables = level.every_table
    lines = tuple(dict.fromkeys(line for table in tables for line in sign.tables.get(table, ())))
    return (
        LogColumn("table", tables, "", "", lambda values: sign.table_of(level, values)),
        LogColumn("line", ("", *lines), "", "", lambda values: sign.line_of(level, values)),
        LogColumn("fault", FAULTS, "", "", sign.fault_word),
        LogColumn("fault_at", (), "", "", sign.fault_at),
        LogColumn("assumptions_failed", (), "", "", lambda values: " ".join(sign.failures(values))),
    )
