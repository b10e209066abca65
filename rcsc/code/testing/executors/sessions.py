"""What is run and what is seen: sessions of cycles, and each cycle in words common to all executors.

In: outcomes of the interpreter, of the Python executor and of the C executor. Out: `Seen` values that can be
compared, and the difference of two in words.
"""

from dataclasses import dataclass, field
from math import copysign, isnan

from rcsc.lang.model import Program, Snapshot, Value, spell

MOST_DIFFERENCES = 6


@dataclass(frozen=True, slots=True)
class Stimuli:
    """A start and what the world says in each cycle after it.

    Attributes:
        start: A value for every leaf.
        readings: For each cycle the value of every input leaf.
    """

    start: Snapshot = field(hash=False)
    readings: tuple[Snapshot, ...] = field(hash=False)


@dataclass(frozen=True, slots=True)
class Seen:
    """What one cycle left behind.

    Attributes:
        fault: Fault code; 0 where there was none.
        fault_at: The leaf that was refused; empty where none was.
        line: Index of the line taken; -1 where none was.
        failed: Names of the monitored assumptions that failed, in order.
    """

    fault: int
    fault_at: str
    line: int
    failed: tuple[str, ...]
    snapshot: Snapshot = field(hash=False)


def same_value(value: Value, other: Value) -> bool:
    """Whether two values of one leaf are the same: the same number with the same sign; any NaN is the same as any NaN."""
    if isinstance(value, float) or isinstance(other, float):
        a, b = float(value), float(other)
        return (isnan(a) and isnan(b)) or (a == b and copysign(1.0, a) == copysign(1.0, b))
    return int(value) == int(other)


def differences(program: Program, expected: Seen, seen: Seen) -> tuple[str, ...]:
    """What differs, in words; empty where nothing does."""
    notes: list[str] = []
    for what in ("fault", "fault_at", "line", "failed"):
        right, other = getattr(expected, what), getattr(seen, what)
        if right != other:
            notes.append(f"{what.replace('_', ' ')} {other!r} where {right!r} is right")
    for variable in program.variables:
        right_value, other_value = expected.snapshot[variable.name], seen.snapshot[variable.name]
        if not same_value(right_value, other_value):
            words = (spelled(program, variable.name, value) for value in (other_value, right_value))
            notes.append("`{}` = {} where {} is right".format(variable.name, *words))
    return tuple(notes[:MOST_DIFFERENCES])


def spelled(program: Program, name: str, value: Value) -> str:
    """A value in the table's words, also where it lies outside its type."""
    kind = program.variable(name).type
    try:
        return spell(kind, value)
    except (IndexError, ValueError, OverflowError):
        return repr(value)


def described(program: Program, session: Stimuli) -> tuple[str, ...]:
    """The session in words: what differs from the initial values, then the readings that change."""
    initial = {str(v.name): v.initial for v in program.variables}
    lines = ["start: " + _changes(program, initial, session.start)]
    before: dict[str, Value] = dict(session.start)
    for number, readings in enumerate(session.readings, 1):
        lines.append(f"cycle {number}: " + _changes(program, before, readings))
        before |= readings
    return tuple(lines)


def _changes(program: Program, before: Snapshot, after: Snapshot) -> str:
    names = [str(v.name) for v in program.variables if v.name in after]
    changed = [name for name in names if not same_value(before[name], after[name])]
    return ", ".join(f"{name} = {spelled(program, name, after[name])}" for name in changed) or "no change"
