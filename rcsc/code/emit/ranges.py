"""What ranges alone show of an expression: where a proof knows more, the C has to say so.

In: expressions, and the statements and conditions around them. Out: bounds as an analyser has them that keeps a range
for each variable and no relation between two, and that knows nothing of the line that a procedure runs for.

>>> from rcsc.lang.model import Apply, Bool, Int, Literal, Op, Read, VariableName
>>> n = Read(VariableName("n"), Int(0, 99))
>>> less = Apply(Op.SUB, (n, Literal(1, Int(1, 1))), Int(-1, 98))
>>> Ranges().of(less), Ranges().where(Apply(Op.GT, (n, Literal(0, Int(0, 0))), Bool())).of(less)
((-1, 98), (0, 98))

What is learned inside a procedure must be no more than an analyser learns: too little costs a call that changes nothing.
What lines state (`at_procedures`) an analyser does not see: the C keeps an operand there where nothing else shows that an
operation can be done.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from rcsc.lang.expressions import intervals
from rcsc.lang.leaves import everything, written_by
from rcsc.lang.model import (
    Apply,
    Assign,
    Call,
    Default,
    Expr,
    Int,
    Line,
    Literal,
    Local,
    Op,
    Program,
    Read,
    ReadLocal,
    Real,
    Statement,
    Table,
    ToLeaf,
    ToLocal,
)
from rcsc.lang.operator_table import MIRRORED, OPPOSITE, Comparison, is_arithmetic, is_comparison

Ends: TypeAlias = tuple[int | float, int | float]
"""The least and the greatest value, both included."""

_LOCAL = "local "
"""What keys of locals begin with: no leaf has a blank in its name."""


@dataclass(frozen=True, slots=True)
class Ranges:
    """The ranges of numbers at one place of the C.

    Attributes:
        known: Ends by variable, where they are not those that it is declared with.
    """

    known: Mapping[str, Ends] = field(default_factory=dict)

    def of(self, expr: Expr) -> Ends:
        """Return the bounds of a number."""
        kind = expr.type
        assert isinstance(kind, Int | Real)
        match expr:
            case Literal(value=value):
                return value, value
            case Apply(op=op, args=args) if is_arithmetic(op):
                given = tuple(self._kind(arg) for arg in args)
                found = intervals.apply(op, given, kind.unit)
                assert isinstance(found, Int | Real)
                return _met((kind.low, kind.high), (found.low, found.high))
            case _:
                return self.known.get(_key(expr), (kind.low, kind.high))

    def _kind(self, expr: Expr) -> Int | Real:
        kind, (low, high) = expr.type, self.of(expr)
        if isinstance(kind, Int):
            return replace(kind, low=int(low), high=int(high))
        assert isinstance(kind, Real)
        return replace(kind, low=low, high=high)

    def where(self, condition: Expr, *, holds: bool = True) -> "Ranges":
        """Return the ranges where a condition holds, or where it does not."""
        match condition:
            case Apply(op=Op.NOT, args=(inner,)):
                return self.where(inner, holds=not holds)
            case Apply(op=Op.AND | Op.OR as op, args=(first, second)) if holds is (op is Op.AND):
                return self.where(first, holds=holds).where(second, holds=holds)
            case Apply(op=Op.IMPLIES, args=(first, second)) if not holds:
                return self.where(first).where(second, holds=False)
            case Apply(op=op, args=(first, second)) if is_comparison(op) and isinstance(
                first.type, Int | Real
            ):
                told = op if holds else OPPOSITE[op]
                ends = self.of(first)
                return self.compared(first, told, self.of(second)).compared(second, MIRRORED[told], ends)
            case _:
                return self

    def compared(self, expr: Expr, op: Comparison, other: Ends) -> "Ranges":
        """Return the ranges where a number stands in this relation to some value between the ends."""
        key, own = _key(expr), self.of(expr)
        return Ranges({**self.known, key: _met(own, _compared(op, own, other, expr))}) if key else self

    def after(self, statement: Statement) -> "Ranges":
        """Return the ranges after a statement; an assigned value stays within the declared range of its place."""
        left = self.without((statement,))
        match statement:
            case Assign(place=ToLeaf(name=name, type=kind), value=value):
                key = str(name)
            case Assign(place=ToLocal(name=name, type=kind), value=value):
                key = _LOCAL + name
            case Local(name=name, type=kind, value=value) if value is not None:
                key = _LOCAL + name
            case _:
                return left
        if not isinstance(kind, Int | Real):
            return left
        return Ranges({**left.known, key: _met((kind.low, kind.high), self.of(value))})

    def without(self, body: Iterable[Statement]) -> "Ranges":
        """Return the ranges of variables that no statement of a body writes; a call may write any leaf."""
        inside = [*everything(body)]
        written = {str(name) for statement in inside for name in written_by(statement)}
        written |= {_LOCAL + name for statement in inside for name in _locals(statement)}
        if any(isinstance(statement, Call) for statement in inside):
            written |= {key for key in self.known if not key.startswith(_LOCAL)}
        return self.forgetting(written)

    def forgetting(self, names: Collection[str]) -> "Ranges":
        """Return the ranges of all other variables."""
        return Ranges({key: ends for key, ends in self.known.items() if key not in names})

    def joined(self, other: "Ranges") -> "Ranges":
        """Return the ranges where two ways meet."""
        both = self.known.keys() & other.known.keys()
        hulls = {key: (self.known[key], other.known[key]) for key in sorted(both)}
        return Ranges({key: (min(a, c), max(b, d)) for key, ((a, b), (c, d)) in hulls.items()})

    def met(self, other: "Ranges") -> "Ranges":
        """Return the ranges where both hold."""
        both = {key: _met(ends, other.known.get(key, ends)) for key, ends in self.known.items()}
        return Ranges({**other.known, **both})


def at_line(table: Table, line: Line | Default, program: Program) -> Ranges:
    """Return the ranges that a line states, before its actions."""
    ranges = Ranges()
    for test in line.tests if isinstance(line, Line) else ():
        ranges = ranges.where(test.condition) if test is not None else ranges
    leaf = program.line_leaves.get(table.name)
    return ranges.forgetting({str(leaf)})


def at_procedures(program: Program) -> Mapping[str, Ranges]:
    """Return, by procedure, the ranges that every line calling it states of leaves not written by earlier actions."""
    writes = {procedure.name: set(map(str, procedure.writes)) for procedure in program.procedures}
    found: dict[str, Ranges] = {}

    def called(name: str, ranges: Ranges) -> None:
        found[name] = found[name].joined(ranges) if name in found else ranges

    for table in program.tables:
        for line in table.every_line:
            ranges = at_line(table, line, program)
            for action in line.actions:
                if isinstance(action.statement, Call):
                    name = action.statement.procedure
                    called(name, ranges)
                    ranges = ranges.forgetting(writes[name])
                else:
                    ranges = ranges.without((action.statement,))
    inside = [statement for procedure in program.procedures for statement in everything(procedure.body)]
    others = [str(statement.procedure) for statement in inside if isinstance(statement, Call)]
    others += [name for level in program.levels for name in (*level.preprocess, *level.postprocess)]
    for other in others:
        called(other, Ranges())
    return found


def _key(expr: Expr) -> str:
    """Return the key of a variable; "" for any other expression."""
    match expr:
        case Read(name=name):
            return name
        case ReadLocal(name=name):
            return _LOCAL + name
        case _:
            return ""


def _locals(statement: Statement) -> Iterator[str]:
    """Yield the locals that a statement itself writes."""
    match statement:
        case Local(name=name) | Assign(place=ToLocal(name=name)):
            yield name


def _met(one: Ends, other: Ends) -> Ends:
    """Return the intersection; the first where it is empty, as such code is never reached."""
    low, high = max(one[0], other[0]), min(one[1], other[1])
    return (low, high) if low <= high else one


def _compared(op: Comparison, ends: Ends, other: Ends, expr: Expr) -> Ends:
    """Return the ends of a number that stands in this relation to some value between other ends.

    A real is not brought below the next one: that is more than every analyser does.
    """
    (low, high), (least, most), step = ends, other, int(isinstance(expr.type, Int))
    match op:
        case Op.EQ:
            return other
        case Op.NE:
            alone = step if least == most else 0
            return low + alone * (low == least), high - alone * (high == most)
        case Op.LT:
            return low, most - step
        case Op.LE:
            return low, most
        case Op.GT:
            return least + step, high
        case Op.GE:
            return least, high
