"""What a program means: typed, flattened, with every name found.

In: nothing. Out: the frozen values that `resolve` makes and every later stage reads.
Records and arrays are flattened: each scalar leaf is a `Variable` of its own, named by its
path (`emove_status.echo`, `counts[2]`), in declared order. Values of a leaf at run time
are Python `bool` (bool), `int` (int, and enum members by their index) and `float` (real, and single).

A *key* is a leaf's value as an integer in an order-preserving numbering (`key_of`): bool 0/1, enum
index, the integer itself, for a double its rank among doubles (`real_key`), for a single its rank among singles. Over
keys every leaf is a bounded integer, so that conditions on one leaf are sets of intervals.
"""

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NewType, TypeAlias

from rcsc.base.diagnostics.source import Span
from rcsc.lang.operator_table import COMPARISONS as COMPARISONS  # noqa: PLC0414 - part of the model
from rcsc.lang.operator_table import Op as Op  # noqa: PLC0414 - as above
from rcsc.lang.operator_table import Operator, single, spell_single
from rcsc.lang.project import Instance
from rcsc.lang.restart import SEEN, Adopted, Part, by_names

VariableName = NewType("VariableName", str)
ProcedureName = NewType("ProcedureName", str)
TableName = NewType("TableName", str)
LineName = NewType("LineName", str)
AssumptionName = NewType("AssumptionName", str)

Value: TypeAlias = bool | int | float
Snapshot: TypeAlias = Mapping[str, Value]
"""The frozen inputs and state of one cycle: a value for every leaf."""

Unit: TypeAlias = tuple[tuple[str, int], ...]
"""Base unit symbols with their powers, sorted, none zero; () is a bare number."""

I64_MIN, I64_MAX, U64_MAX = -(2**63), 2**63 - 1, 2**64 - 1

NOWHERE = Span("", 0, 0)


def at() -> Span:
    """Return a field for the place where something was written, which is no part of its meaning."""
    return field(default=NOWHERE, compare=False, repr=False)


# --- types ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Bool:
    """False before true."""


@dataclass(frozen=True, slots=True)
class Enum:
    """A declared enumeration; values are indices into `members`, in declared order; `file` declares it."""

    name: str
    members: tuple[str, ...]
    file: str = field(default="", compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Int:
    """An integer in `low .. high`, both included; bounds within 64 bits, signed or not.

    As the type of an expression the bounds are what interval arithmetic gives, and they
    may exceed 64 bits: then it is a proof obligation that the value does not.
    """

    low: int
    high: int
    unit: Unit = ()


@dataclass(frozen=True, slots=True)
class Real:
    """An IEEE binary64 in `low .. high`, both finite and included; -0.0 is 0.0."""

    low: float
    high: float
    unit: Unit = ()


@dataclass(frozen=True, slots=True)
class Single(Real):
    """An IEEE binary32 in `low .. high`, both finite and included; -0.0 is 0.0. Whatever asks for a `Real` takes it, too."""


Scalar: TypeAlias = Bool | Enum | Int | Real


@dataclass(frozen=True, slots=True)
class Array:
    """`length` elements of one type."""

    length: int
    element: "Type"


@dataclass(frozen=True, slots=True)
class RecordField:
    """A named part of a record.

    Attributes:
        initial: The value that it, or each element of it, starts with where that is written.
        safe: The value that it shows in an output after a fault, where that is written.
    """

    name: str
    type: "Type"
    doc: str = ""
    initial: Value | None = field(default=None, compare=False)
    safe: Value | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Record:
    """Named parts in order; `file` declares it."""

    name: str
    fields: tuple[RecordField, ...]
    file: str = field(default="", compare=False, repr=False)


Type: TypeAlias = Scalar | Array | Record


def real_key(value: float) -> int:
    """Return the rank of a finite double: monotone, consecutive doubles differ by one, 0.0 is 0."""
    bits: int = struct.unpack("<q", struct.pack("<d", value))[0]
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF)


def real_of_key(key: int) -> float:
    """Return the double of rank `key`; the inverse of `real_key` (with 0.0 for -0.0)."""
    magnitude: float = struct.unpack("<d", struct.pack("<q", abs(key)))[0]
    return magnitude if key >= 0 else -magnitude


def single_key(value: float) -> int:
    """Return the rank of a finite single among singles, as `real_key` does for doubles.

    Raises:
        ValueError: The value is no single.
    """
    word = struct.pack("<f", value)
    if struct.unpack("<f", word)[0] != value:
        raise ValueError(value)
    bits: int = struct.unpack("<i", word)[0]
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF)


def single_of_key(key: int) -> float:
    """Return the single of rank `key`; the inverse of `single_key` (with 0.0 for -0.0). Past the greatest: infinity, then NaNs."""
    magnitude: float = struct.unpack("<f", struct.pack("<i", abs(key)))[0]
    return magnitude if key >= 0 else -magnitude


def next_value(kind: Scalar, value: int | float, by: int) -> int | float:
    """Return the value after (`by` 1) or before (-1) this number of the kind; after an infinity, itself."""
    if not isinstance(kind, Real):
        return value + by
    if not isinstance(kind, Single):
        return math.nextafter(value, math.inf * by)
    return value if value == math.inf * by else single_of_key(single_key(value) + by)


def key_of(kind: Scalar, value: Value) -> int:
    """Return the key of `value`, a value of type `kind`."""
    if isinstance(kind, Single):
        return single_key(float(value))
    return real_key(float(value)) if isinstance(kind, Real) else int(value)


def value_of_key(kind: Scalar, key: int) -> Value:
    """Return the value of type `kind` with this key."""
    if isinstance(kind, Bool):
        return bool(key)
    if isinstance(kind, Single):
        return single_of_key(key)
    return real_of_key(key) if isinstance(kind, Real) else key


def key_bounds(kind: Scalar) -> tuple[int, int]:
    """Return the least and the greatest key of the type."""
    match kind:
        case Bool():
            return 0, 1
        case Enum(members=members):
            return 0, len(members) - 1
        case Int(low, high):
            return low, high
        case Real(low, high):
            return key_of(kind, low), key_of(kind, high)


def spell(kind: Scalar, value: Value) -> str:
    """Return `value` as tables write it: `true`, a member's name, a number."""
    match kind:
        case Bool():
            return "true" if value else "false"
        case Enum(members=members):
            return members[int(value)]
        case Int():
            return str(int(value))
        case Single():
            return spell_single(float(value))
        case Real():
            return repr(float(value))


def unspelled(kind: Scalar, text: str) -> Value:
    """Return the value that `spell` gives as this text.

    Raises:
        ValueError: It gives this text for none.
    """
    match kind:
        case Bool():
            return ("false", "true").index(text) == 1
        case Enum(members=members):
            return members.index(text)
        case Int():
            return int(text)
        case Single():
            return single(float(text))
        case Real():
            return float(text)


def unit_text(unit: Unit) -> str:
    """Return a unit without its brackets, as a declaration writes it; "" for no unit.

    >>> unit_text((("mm", 1), ("s", -2))), unit_text((("s", -1),))
    ('mm/s^2', '1/s')
    """
    above = [_power(name, power) for name, power in unit if power > 0]
    below = [_power(name, -power) for name, power in unit if power < 0]
    return "/".join(["*".join(above) or "1", *below]) if unit else ""


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"


def value_of_text(kind: Scalar, text: str) -> Value | None:
    """Return the value that this text spells; None where the type has no such value."""
    try:
        value = unspelled(kind, text)
        low, high = key_bounds(kind)
        return value if low <= key_of(kind, value) <= high else None
    except (ValueError, OverflowError):
        return None


def start(kind: Scalar) -> Value:
    """Return the value a variable starts with where none is written: the one nearest to 0; the first member; false."""
    match kind:
        case Int(low, high) | Real(low, high):
            zero = 0.0 if isinstance(kind, Real) else 0
            return min(max(zero, low), high)
        case _:
            return value_of_key(kind, key_bounds(kind)[0])


# --- variables -----------------------------------------------------------------------


class Kind(StrEnum):
    """The writer of a variable: the world, or the level's own procedures."""

    INPUT = "input"
    STATE = "state"
    OUTPUT = "output"


class Admit(StrEnum):
    """The treatment of a reading outside its declared range; a NaN is always rejected."""

    REJECT = "reject"
    CLAMP = "clamp"


@dataclass(frozen=True, slots=True)
class Variable:
    """A scalar leaf.

    Attributes:
        name: Its path. The pending value of a deferred variable `x` is a state leaf of its
            own, named `x.next`, directly after `x`.
        initial: Its value before the first cycle (inputs too): what is written, else the safe value, else `start`.
        deferred_until: For a deferred variable: at the start of a cycle, when this holds of
            the snapshot, `x` takes the value of `x.next`. `next x := e` writes `x.next`.
        safe: The value that an output shows after a cycle that ended in a fault; None where it stays as it is.
        previous_of: Of a hidden state, the leaf whose value after the cycle before it holds.
        line_of: Of a hidden state, the table whose line of this cycle it holds: 0 for none, else one more than the line's position.
        counts: Of a hidden state that counts cycles, the condition that has held for so many.
        restart: Value after a restart; None: the initial value, or what `Program.restart` says.
        given: Whether its initial value is written, or its safe one is it; else it starts with what `start` says, which nobody meant.
    """

    name: VariableName
    kind: Kind
    type: Scalar
    initial: Value
    admit: Admit = Admit.REJECT
    deferred_until: "Expr | None" = None
    doc: str = ""
    span: Span = at()
    safe: Value | None = None
    restart: Value | None = None
    previous_of: VariableName | None = field(default=None, compare=False)
    line_of: TableName | None = field(default=None, compare=False)
    counts: "Expr | None" = field(default=None, compare=False, repr=False)
    given: bool = field(default=True, compare=False, repr=False)

    @property
    def part(self) -> Part:
        """The variable's type as `rcsc.lang.restart` needs it, to tell what the name adopts when the program starts anew."""
        members = self.type.members if isinstance(self.type, Enum) else ()
        whole = (self.type.low, self.type.high) if isinstance(self.type, Int) else None
        return Part(self.kind is Kind.OUTPUT, members, whole)


def pending(name: str) -> VariableName:
    """Return the name of the leaf that holds the deferred next value of `name`."""
    return VariableName(f"{name}.next")


BEFORE = "was "
"""Prefix, in a property, of a leaf's name that means its value after the cycle before."""


def earlier(name: str) -> VariableName:
    """Return the name that means, in a property, the value of a leaf after the cycle before."""
    return VariableName(f"{BEFORE}{name}")


@dataclass(frozen=True, slots=True)
class Declared:
    """A variable as declared, before flattening; `leaves` are its `Variable` names."""

    name: str
    kind: Kind
    type: Type
    leaves: tuple[VariableName, ...]
    doc: str = ""
    span: Span = at()


# --- expressions ---------------------------------------------------------------------
# Every expression has a `type`; for Int and Real its bounds enclose every value it can
# take over the declared ranges (interval arithmetic). Arithmetic is exact on integers
# (`/` truncates toward zero, `mod` has the sign of the dividend, as in C) and IEEE
# binary64, round to nearest even, on reals; IEEE binary32 on singles. No implicit conversion
# between the three.


@dataclass(frozen=True, slots=True)
class Literal:
    """A constant (enum members by index)."""

    value: Value
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Read:
    """The value of a leaf variable."""

    name: VariableName
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class ReadLocal:
    """The value of a parameter, local or loop variable of the procedure."""

    name: str
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Select:
    """`leaves[index]`: an array element by a computed index; that it is in 0 .. len-1 is proved."""

    leaves: tuple[VariableName, ...]
    index: "Expr"
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator and its operands (one or two).

    `and`, `or` and `implies` look at the right operand only where the left one does not
    decide, also for proof obligations: `n /= 0 and x / n > 2` is safe.
    """

    op: Operator
    args: "tuple[Expr, ...]"
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Among:
    """`subject in {a, b}`; members are constants. Type Bool."""

    subject: "Expr"
    values: tuple[Value, ...]
    type: Scalar = Bool()
    span: Span = at()


Expr: TypeAlias = Literal | Read | ReadLocal | Select | Apply | Among


# --- statements and procedures -------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ToLeaf:
    """Assigns a leaf (for `next x := e`, the pending leaf)."""

    name: VariableName
    type: Scalar


@dataclass(frozen=True, slots=True)
class ToElement:
    """Assigns `leaves[index]`."""

    leaves: tuple[VariableName, ...]
    index: Expr
    type: Scalar


@dataclass(frozen=True, slots=True)
class ToLocal:
    """Assigns a local."""

    name: str
    type: Scalar


Place: TypeAlias = ToLeaf | ToElement | ToLocal


@dataclass(frozen=True, slots=True)
class Assign:
    """`place := value`; the value is proved to lie in the place's declared range."""

    place: Place
    value: Expr
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Local:
    """Declares a local; without a value it must be assigned before use (proved)."""

    name: str  # unique within its procedure
    type: Scalar
    value: Expr | None
    span: Span = at()


@dataclass(frozen=True, slots=True)
class If:
    """Two-way choice."""

    condition: Expr
    then: "tuple[Statement, ...]"
    orelse: "tuple[Statement, ...]"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Arm:
    """The values (constants) of one arm of a case and what it runs."""

    values: tuple[Value, ...]
    body: "tuple[Statement, ...]"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Case:
    """The arm whose values contain the subject; values are disjoint; else `orelse`."""

    subject: Expr
    arms: tuple[Arm, ...]
    orelse: "tuple[Statement, ...]"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class For:
    """Runs the body with `name` = low, low+1 .. high; not at all when high < low."""

    name: str  # unique within its procedure
    low: int
    high: int
    body: "tuple[Statement, ...]"
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Call:
    """Runs a procedure; arguments by value, each proved to lie in its parameter's range."""

    procedure: ProcedureName
    args: tuple[Expr, ...] = ()
    span: Span = at()


Statement: TypeAlias = Assign | Local | If | Case | For | Call


@dataclass(frozen=True, slots=True)
class Parameter:
    """A by-value parameter."""

    name: str
    type: Scalar
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Extern:
    """An implementation of the user's: called with the values of `reads`, gives `writes`.

    Both executors admit what comes back: a value outside its declared range is a fault.
    """

    python: str  # "package.module:function"
    c: str  # C function name


@dataclass(frozen=True, slots=True)
class Procedure:
    """A functionally bounded module: named inputs, a process, outputs.

    Attributes:
        reads: Leaves it may read, calls included; sorted.
        writes: Leaves it may write, calls included; sorted.
        extern: Set for an extern procedure, whose body is empty.
    """

    name: ProcedureName
    params: tuple[Parameter, ...]
    body: tuple[Statement, ...]
    reads: tuple[VariableName, ...]
    writes: tuple[VariableName, ...]
    extern: Extern | None = None
    doc: str = ""
    span: Span = at()
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)


# --- assumptions, invariants, properties ---------------------------------------------


class Standing(StrEnum):
    """The standing of an assumption: how it is known."""

    ASSUMED = "assumed"
    MONITORED = "monitored"  # checked by the executors each cycle
    WATCHED = "assumed monitored"  # both: taken for granted by proofs, and checked each cycle
    PROVED = "proved"  # from declared ranges and invariants; what the levels together show is not declared

    @property
    def checked(self) -> bool:
        """True where the executors check the assumption in each cycle, even if no safety rests on it."""
        return self in {Standing.MONITORED, Standing.WATCHED}

    @property
    def believed(self) -> bool:
        """True where the proof of the levels together takes the assumption for granted, as far as it speaks of inputs."""
        return self in {Standing.ASSUMED, Standing.WATCHED}


@dataclass(frozen=True, slots=True)
class Assumption:
    """A named condition on inputs and state that tables may rely on."""

    name: AssumptionName
    standing: Standing
    condition: Expr
    doc: str = ""
    span: Span = at()
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Invariant:
    """A condition on state and outputs: true at first, kept by every cycle (proved).

    Once proved, every table of the program may rely on it.
    """

    name: str
    condition: Expr
    doc: str = ""
    span: Span = at()
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Property:
    """A condition that holds after every cycle of a level, in its environment; proved of the levels together (`compose`).

    Nothing is emitted for it, and no table relies on it.

    Attributes:
        condition: About a cycle: leaves as it leaves them, inputs as it took them; and, under the names that `earlier`
            gives, leaves as the cycle before left them (before the first: as the level begins).
        text: As it was written, after the colon.
        standard: Whether it comes with the protocol, and nobody wrote it.
        monitor: Of a requirement or an assumption over time, the states that its condition reads.
        monitored: Whether every run watches it.
        assumed: Whether it is an assumption over time (`Program.environment`): of what comes from outside, and trusted.
    """

    name: str
    condition: Expr
    text: str
    doc: str = ""
    span: Span = at()
    standard: bool = field(default=False, compare=False)
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)
    monitor: "Monitor | None" = None
    monitored: bool = field(default=False, repr=False)
    assumed: bool = False

    @property
    def word(self) -> str:
        """What its declaration calls it."""
        if self.assumed:
            return "assumption"
        return "property" if self.monitor is None else "requirement"

    @property
    def about(self) -> tuple[Expr, ...]:
        """Its conditions on the level's leaves: those of a monitor read its states, too (`leaves.spoken_of`)."""
        return (self.condition,) if self.monitor is None else tuple(truth for _, truth in self.monitor.truths)


WATCHED = "watched "
"""Prefix of the states of monitors, which the level does not have; no leaf's name has a space."""


@dataclass(frozen=True, slots=True)
class Hidden:
    """A state of a monitor: its name, type, and value before the first cycle and after a restart."""

    name: VariableName
    type: Scalar
    initial: Value


@dataclass(frozen=True, slots=True)
class Monitor:
    """What is watched of a requirement over time, a cycle at a time (`rcsc.lang.over_time`).

    After each cycle every truth is stored in its state, in order, then the statements run. They read the monitor's states as the cycle
    finds them under the names that `earlier` gives. The requirement's `condition` is then true, unless the cycle breaks it.

    Attributes:
        states: All of its states.
        defined: The state that says whether all truths of the cycle are defined; one that is not is stored as false.
        truths: Conditions on the level's leaves, as in a property; each with the state that takes its truth.
        owes: The condition that what was asked for so far is still to come: it is then broken if no other cycle follows.
        waits: The same, of what need come in no cycle at all: it is broken where it is so in every cycle from some cycle on.
        asks: The condition that the cycle asked for the response; of what counts, that it begins.
        still: States that stand still while it waits, in a cycle that takes nothing.
    """

    states: tuple[Hidden, ...]
    defined: VariableName
    truths: tuple[tuple[VariableName, Expr], ...]
    statements: tuple[Statement, ...]
    owes: Expr
    waits: Expr
    asks: Expr
    still: tuple[VariableName, ...] = ()


# --- tables --------------------------------------------------------------------------

Box: TypeAlias = tuple[tuple[int, int], ...]
"""Sorted, disjoint, non-adjacent, inclusive intervals of keys; () is nothing."""


@dataclass(frozen=True, slots=True)
class Test:
    """One distinct condition of a column; shared (same object) by all lines that state it.

    Attributes:
        text: The cell in the table's words, normalised.
        condition: The meaning, a boolean expression.
        variables: Leaves that it reads, in declared order.
        box: Where `condition` depends on exactly one leaf (`variables[0]`), compared with
            constants: the keys for which it holds, within the declared range. Else None.
    """

    text: str
    condition: Expr
    variables: tuple[VariableName, ...]
    box: Box | None
    __test__ = False  # not a pytest class


@dataclass(frozen=True, slots=True)
class Column:
    """A condition column; `variable` is its leaf where the heading is just a leaf.

    One that is not `written` holds what `above` adds to the conditions of lines.
    """

    heading: str
    subject: Expr | None  # None for `when`
    variable: VariableName | None
    span: Span = at()
    written: bool = True


@dataclass(frozen=True, slots=True)
class Action:
    """One action of a line: a call or an assignment, and the heading it stands under; `column` counts these from 0."""

    heading: str
    text: str
    statement: Statement
    column: int = field(default=0, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Line:
    """A row: matches when all its tests hold (None, a blank cell, always holds).

    Attributes:
        tests: One a condition column.
        bounds: Start and end offsets of each cell, flattened; see `cell_span`.
        below: The lines that run instead where both match: they stand `above`. Its tests say so.
        same: Those earlier ones that do the same where both match, and run then. Its tests say so, too.
        requirements: Names of those that it answers; here and elsewhere they mean nothing to a proof.
    """

    name: LineName
    tests: tuple[Test | None, ...]
    actions: tuple[Action, ...]
    span: Span = at()
    bounds: Sequence[int] = field(default=(), compare=False, repr=False)
    below: tuple[LineName, ...] = field(default=(), compare=False)
    same: tuple[LineName, ...] = field(default=(), compare=False)
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @property
    def stated(self) -> tuple["Test", ...]:
        """Its tests, without blank cells."""
        return tuple(test for test in self.tests if test is not None)

    @property
    def conditions(self) -> tuple[Expr, ...]:
        """The conditions of its tests: it matches when all hold."""
        return tuple(test.condition for test in self.stated)

    def cell_span(self, column: int) -> Span:
        """Return the span of the condition cell in `column` (the span of the whole line if unknown)."""
        at_ = 2 * (column + 1)
        if at_ + 1 >= len(self.bounds):
            return self.span
        return Span(self.span.file, self.bounds[at_], self.bounds[at_ + 1])


@dataclass(frozen=True, slots=True)
class Default:
    """The DEFAULT line: runs where no other line matches."""

    name: LineName
    actions: tuple[Action, ...]
    unreachable: bool
    span: Span = at()
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Meeting:
    """A declaration about two lines that match together: `first above second`, or both do the `same`.

    Attributes:
        where: Where both match as they are written, and, of two that do the same, no line above one of them does.
        same: Whether they are said to do the same there, which is proved; the first of the table runs.
    """

    first: LineName
    second: LineName
    where: Expr
    same: bool
    span: Span = at()


@dataclass(frozen=True, slots=True)
class Printed:
    """How a table is printed that is printed the other way round: rows and columns as they stand, and where each line is a cell.

    Attributes:
        giving: The heading of the results.
        by: What the columns are by; "" where they are results, so that each cell is a condition.
        named: Whether the rows have names, which stand in a first column `line`.
        conditions: The number of columns before `||`, without the names.
        rows: The name of each row, without DEFAULT.
        columns: The name of each column after `||`; `headings`, all that its heading says; `said`, that without a name and marks.
        places: Row and column of each line, by position.
        unsaid: The same of each of the table's `unsaid`; a column of -1 is the whole row.
    """

    giving: str
    by: str
    named: bool
    conditions: int
    rows: tuple[str, ...]
    columns: tuple[str, ...]
    headings: tuple[str, ...]
    said: tuple[str, ...]
    places: tuple[tuple[int, int], ...]
    unsaid: tuple[tuple[int, int], ...]

    def written(self, column: int, *, condition: bool = False) -> int:
        """Return the position of a column after `||`, or of a condition, as changes of the text count them."""
        return column - (not self.named) + (0 if condition else self.conditions)

    def alone(self, column: int) -> bool:
        """Return whether the heading of a column after `||` is a condition by itself, after `when`."""
        return self.said[column].startswith("when ")


@dataclass(frozen=True, slots=True)
class Table:
    """The lines that a level tries for one command: exactly one must match in every cycle.

    Attributes:
        variables: Test variables: every leaf some test reads, in declared order.
        assumptions: Names of those that the table's proof may use.
        stops: Those of them on which the safety of the table's conditions and lines rests, in declared order; `prove` sets it.
            Where one fails the cycle ends before the table is matched; the others only tell.
        meetings: Declarations about pairs of its lines, by name.
        turned: How it is printed where it is the other way round, so that a row has several lines, a column one condition or result.
        unsaid: Of such a table, as lines that do nothing, its empty cells, or rows: where a line that is missing would stand.
    """

    name: TableName
    columns: tuple[Column, ...]
    lines: tuple[Line, ...]
    default: Default | None
    variables: tuple[VariableName, ...]
    assumptions: tuple[AssumptionName, ...]
    doc: str = ""
    span: Span = at()  # the name in `table NAME`
    file: str = field(default="", compare=False)
    stops: tuple[AssumptionName, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    requirements: tuple[str, ...] = field(default=(), compare=False, repr=False)
    turned: Printed | None = field(default=None, compare=False, repr=False)
    unsaid: tuple[Line, ...] = field(default=(), compare=False, repr=False)

    @property
    def every_line(self) -> tuple[Line | Default, ...]:
        """The lines, then DEFAULT where the table has one."""
        return self.lines if self.default is None else (*self.lines, self.default)

    @property
    def distinct_tests(self) -> tuple[Test, ...]:
        """Each test of the lines once, in order of the first line that has it."""
        every = (test for line in self.lines for test in line.stated)
        return tuple({id(test): test for test in every}.values())

    def added(self, line: Line) -> str:
        """Return the conditions that `above` and `same` add to a line, as text; "" where they add none."""
        tests = zip(line.tests, self.columns, strict=True)
        return " and ".join(test.text for test, column in tests if test is not None and not column.written)


# --- owners, levels, programs --------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Owner:
    """An executing owner: procedures and owners, run in the order listed."""

    name: str
    members: tuple[str, ...]
    doc: str = ""
    span: Span = at()


@dataclass(frozen=True, slots=True)
class OneTable:
    """A level that always runs one table."""

    table: TableName

    @property
    def names(self) -> tuple[TableName, ...]:
        """The name of its table."""
        return (self.table,)


@dataclass(frozen=True, slots=True)
class TableByCommand:
    """A level with one table a command; every value of the selector has a table."""

    selector: Expr
    tables: tuple[tuple[Value, TableName], ...]

    @property
    def names(self) -> tuple[TableName, ...]:
        """The names of its tables, each once, in order of commands."""
        return tuple(dict.fromkeys(name for _, name in self.tables))


TableChoice: TypeAlias = OneTable | TableByCommand


@dataclass(frozen=True, slots=True)
class Level:
    """One control level: every cycle deferred values, preprocess, stages, table, postprocess.

    Attributes:
        tables: The choice of tables that runs last, or the only one.
        stages: The choices that run before it, in the order of what they read and write: each on the values that those before it leave.
    """

    name: str
    period_ms: int
    preprocess: tuple[str, ...]  # procedures and owners, flattened to procedure names
    tables: TableChoice
    postprocess: tuple[str, ...]
    doc: str = ""
    span: Span = at()
    stages: tuple[TableChoice, ...] = ()

    @property
    def choices(self) -> tuple[TableChoice, ...]:
        """The choices of tables in the order in which they run."""
        return (*self.stages, self.tables)

    @property
    def selectors(self) -> tuple[Expr, ...]:
        """The expressions by which tables are chosen, in order."""
        return tuple(choice.selector for choice in self.choices if isinstance(choice, TableByCommand))

    @property
    def table_names(self) -> tuple[TableName, ...]:
        """The names of all tables that it may run."""
        return tuple(name for choice in self.choices for name in choice.names)

    @property
    def staged(self) -> tuple[TableName, ...]:
        """The names of all tables that it may run before the last."""
        return tuple(name for stage in self.stages for name in stage.names)


@dataclass(frozen=True, slots=True)
class LinkPart:
    """One part of a link: its subject (`what`), its content (`says`) in words that do not depend on names of types, and its place."""

    what: str
    says: str
    span: Span


@dataclass(frozen=True, slots=True)
class Link:
    """The messages between a superior and a subordinate, as one of them declares them; both must declare the same parts."""

    name: str
    span: Span
    parts: tuple[LinkPart, ...]


@dataclass(frozen=True, slots=True)
class Role:
    """A neighbour, as a program declares it: one that it serves, or one that it commands.

    Attributes:
        order: The record that carries orders, and `report` the one that carries reports.
        numbered: Leaves of the order that change only with its number.
        rest: The command that rests.
        done, failed: The statuses that answer a command.
        reason: The leaf that says why a command failed; None where there is none.
        late: Says that a subordinate has not echoed, or not answered, in time; None where it is waited for without end.
        answers_in_time: Whether an order is late that is not answered in time, too.
        link: The link to it, as it is declared.
    """

    peer: str
    order: str
    report: str
    numbered: tuple[VariableName, ...]
    rest: str
    done: str
    failed: str
    reason: VariableName | None = None
    late: VariableName | None = None
    answers_in_time: bool = False
    link: Link | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Roles:
    """The neighbours that the level of a program serves and commands.

    Attributes:
        superior: None where it takes no orders.
    """

    superior: Role | None
    subordinates: tuple[Role, ...]

    @property
    def clocks(self) -> frozenset[str]:
        """The leaves in which the protocol counts the cycles of an order: no line has an effect on them."""
        return frozenset(f"{role.peer}_waited" for role in self.subordinates if role.late is not None)

    def makes(self, leaf: str) -> bool:
        """Return whether the protocol makes the leaf: a buffer, or state about orders and reports."""
        peers = [role.peer for role in (self.superior, *self.subordinates) if role is not None]
        records = {f"{word}{peer}" for peer in peers for word in ("", "to_", "from_", "last_")}
        own = {
            "new_command",
            "answered",
            "settling",
            SEEN,
            "echoed",
            *(f"{peer}_{word}" for peer in peers for word in ("waited", "again")),
        }
        return leaf in own or leaf.partition(".")[0] in records


@dataclass(frozen=True, slots=True)
class Program:
    """One root file and all that it uses: what is checked and compiled together.

    Attributes:
        name: The root file's stem, or the instance's name: names the generated files.
        file: The root file.
        enums: In order of declaration, used files first (likewise all below).
        variables: Every leaf.
        tables: Tables of the root file and of the files it uses.
        own_tables: Names of the tables that the root file itself declares.
        roles: None where the protocol is written by hand, or there is none.
        restart: What leaves adopt when the level starts anew (`rcsc.lang.restart`); None where nothing declares it, and names decide.
        environment: What is assumed over time of what comes from outside: trusted, and claimed by nobody.
        instance: What it is an instance of, as it was asked for; None where it is the file's own program.
    """

    name: str
    file: str = field(compare=False)
    enums: tuple[Enum, ...]
    records: tuple[Record, ...]
    declared: tuple[Declared, ...]
    variables: tuple[Variable, ...]
    procedures: tuple[Procedure, ...]
    assumptions: tuple[Assumption, ...]
    invariants: tuple[Invariant, ...]
    tables: tuple[Table, ...]
    own_tables: tuple[TableName, ...]
    owners: tuple[Owner, ...]
    levels: tuple[Level, ...]
    properties: tuple[Property, ...] = ()
    roles: Roles | None = None
    restart: tuple[tuple[VariableName, Adopted], ...] | None = None
    environment: tuple[Property, ...] = ()
    instance: Instance | None = field(default=None, compare=False, repr=False)

    @property
    def root(self) -> str:
        """What the program is called where programs are told apart by their root files."""
        return self.file if self.instance is None else self.instance.root

    @property
    def stated(self) -> tuple[Property, ...]:
        """What is assumed over time, and what is claimed."""
        return (*self.environment, *self.properties)

    @property
    def over_time(self) -> tuple[Property, ...]:
        """What has a monitor: assumptions over time, then requirements."""
        return tuple(stated for stated in self.stated if stated.monitor is not None)

    @property
    def types(self) -> "tuple[Enum | Record, ...]":
        """All declared types."""
        return (*self.enums, *self.records)

    @property
    def adopted(self) -> dict[str, Adopted]:
        """The new value of each leaf that does not return to its initial value when the level starts anew."""
        if self.restart is None:
            return by_names({str(variable.name): variable.part for variable in self.variables})
        return {str(leaf): adopted for leaf, adopted in self.restart}

    @property
    def line_leaves(self) -> dict[TableName, VariableName]:
        """The hidden state that holds the line, for each table that runs before another."""
        return {
            variable.line_of: variable.name for variable in self.variables if variable.line_of is not None
        }

    @property
    def kinds(self) -> dict[str, Scalar]:
        """The type of each leaf, by name."""
        return {str(variable.name): variable.type for variable in self.variables}

    def table(self, name: str) -> Table:
        """Return the table called `name`; StopIteration if there is none."""
        return next(table for table in self.tables if table.name == name)

    def assumed(self, table: Table) -> tuple[Assumption, ...]:
        """Return the assumptions that the table's proof may use, in declared order."""
        return tuple(assumption for assumption in self.assumptions if assumption.name in table.assumptions)

    def variable(self, name: str) -> Variable:
        """Return the leaf called `name`; raise KeyError if there is none."""
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise KeyError(name)


# --- verdicts ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Backing:
    """The grounds of a verdict, shown in the report.

    Attributes:
        method: `boxes` (masks and counting), `tree` (region tree), `tree+z3` (Z3 answered for some of its regions), `z3` (Z3 alone)
            or `none`.
        confirmed_by_z3: Whether Z3 was asked the same as a whole, and agreed.
        assumptions: Each assumption used, with its standing.
    """

    method: str
    confirmed_by_z3: bool
    assumptions: tuple[tuple[AssumptionName, Standing], ...] = ()


_PROOF_SEAL = object()


@dataclass(frozen=True, slots=True)
class ProvedProgram:
    """A program all of whose tables and procedures were proved; only `prove` makes one.

    `lower` accepts nothing else.
    """

    program: Program
    seal: object = field(repr=False, compare=False, default=None)

    def __post_init__(self) -> None:
        if self.seal is not _PROOF_SEAL:
            raise TypeError("a ProvedProgram is constructed only by rcsc.proof.table")


def seal_of_proof() -> object:
    """Seal a proof; for `rcsc.proof.table` alone, and tests of later stages."""
    return _PROOF_SEAL
