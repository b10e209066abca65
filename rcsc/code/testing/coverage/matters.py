"""What else could stand at each place of the procedures, and the cases in which that shows.

In: a program and cases. Out: for each place and each other thing that could stand there whether a case notices it: what the function
gives, or leaves behind, is then another. A place is a value (a constant, a variable that is read, a comparison, a condition, an
operand) or a statement. So a case is kept for each constant on each side of it, for each variable beside all that could be taken for
it, and for each definition that something later uses; what a condition decides is not enough, it must be seen outside.

What stands elsewhere in the C has goals of its own (`goals`): masks, ranges of inputs and states, what `init` and `check` do.

Source: strong mutation adequacy (DeMillo, Lipton, Sayward, "Hints on test data selection", 1978; Howden, "Weak mutation testing and
completeness of test sets", 1982, for what must be met first); boundary values (ISO/IEC/IEEE 29119-4:2021, 5.2.3); all-uses of data
flow (the same, 5.3.7).
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeAlias, cast

from rcsc.code.testing.agree import line_number
from rcsc.code.testing.coverage.case import Case, Entry, Expected, checked, entries, ran
from rcsc.code.testing.coverage.goals import Hit
from rcsc.code.testing.coverage.marks import Marker, Place, any_of, equals_of
from rcsc.code.testing.inputs.condition_text import words
from rcsc.lang.expressions.words import mask_of
from rcsc.lang.interpret import UNDEFINED, matching_lines
from rcsc.lang.leaves import everything, expressions, may_write, read_by
from rcsc.lang.model import (
    Among,
    Apply,
    Bool,
    Call,
    Enum,
    Expr,
    If,
    Int,
    Literal,
    Local,
    Op,
    Procedure,
    Program,
    Read,
    Real,
    Scalar,
    Select,
    Single,
    Snapshot,
    Statement,
    Value,
    spell,
)
from rcsc.lang.operator_table import COMPARISONS, EXTREMES, Operator, is_comparison, is_logic

TRIES = 6
"""Cases in which another thing at a place is tried, as they come; what is open then is looked for (`nearby`)."""
MOST_BASES = 8
"""Cases that are remembered of each place."""
FINE = 2.0**-30
"""The part of itself by which a real constant is changed, beside the least step that there is."""

Way: TypeAlias = Callable[..., Value]
Told: TypeAlias = tuple[object, ...] | None


@dataclass(slots=True)
class Switch:
    """Which place is otherwise, and in which way: of a marked program that runs; none as a rule.

    Attributes:
        met: The places that were met, each with the value that it had last.
    """

    place: int = -1
    way: int = 0
    met: dict[int, Value] = field(default_factory=dict)


@dataclass(eq=False, frozen=True, slots=True)
class Otherwise:
    """A mark in place of an operator: gives what stands there, or what could."""

    switch: Switch
    number: int
    plain: Way
    ways: Sequence[Way]

    def meaning(self, *operands: Value) -> Value:
        """Note that it was met, and give its value."""
        switch = self.switch
        value = self.ways[switch.way](*operands) if switch.place == self.number else self.plain(*operands)
        switch.met[self.number] = value
        return value


@dataclass(frozen=True, slots=True)
class Spot:
    """A place, and what could stand there.

    Attributes:
        where: Its function.
        text: What stands there, in words.
        ways: What could, in words.
        near: Leaves whose values decide whether that shows.
        real: Whether it compares reals.
    """

    where: Place
    text: str
    ways: tuple[str, ...]
    near: tuple[str, ...]
    real: bool = False


@dataclass(frozen=True, slots=True)
class Unnoticed:
    """Something that could stand at a place, and that no vector notices."""

    where: Place
    what: str
    instead: str


@dataclass(slots=True)
class _Spots(Marker):
    """Puts a mark at every place of a program."""

    switch: Switch = field(default_factory=Switch)
    spots: list[Spot] = field(default_factory=list)
    near: tuple[str, ...] = ()
    leaves: dict[str, Scalar] = field(default_factory=dict)
    procedures: dict[str, Procedure] = field(default_factory=dict)

    def mark(self, text: str, plain: Way, ways: Sequence[tuple[str, Way]], *, real: bool = False) -> Operator:
        """A mark at a new place."""
        named = tuple(word for word, _ in ways)
        self.spots.append(Spot(self.place, text, named, self.near, real))
        made = Otherwise(self.switch, len(self.spots) - 1, plain, [way for _, way in ways])
        return cast(Operator, made)

    # --- statements ---

    def statement(self, statement: Statement) -> Statement:
        """A statement with its marks, which may be left out."""
        inside = list(everything((statement,)))
        read = [str(name) for each in inside for expr in expressions(each) for name in read_by(expr)]
        called = [
            str(name)
            for each in inside
            if isinstance(each, Call)
            for name in self.procedures[each.procedure].reads
        ]
        wrote = sorted(map(str, may_write((statement,), self.procedures)))
        outer, self.near = self.near, tuple(dict.fromkeys((*read, *called, *wrote)))
        marked = Marker.statement(self, statement)
        if not isinstance(statement, Local):
            mark = self.mark(type(statement).__name__.lower(), _same, [("left out", _no)])
            marked = If(Apply(mark, (Literal(value=True, type=Bool()),), Bool()), (marked,), ())
        self.near = outer
        return marked

    # --- expressions ---

    def expr(self, expr: Expr, *, chooses: bool = False) -> Expr:
        """An expression with a mark at each of its places."""
        outer = self.near
        self.near = tuple(dict.fromkeys((*outer, *map(str, read_by(expr)))))
        made = self.condition_of(expr) if chooses else self.value(expr)
        self.near = outer
        return made

    def condition_of(self, expr: Expr) -> Expr:
        """A truth that something is chosen by."""
        if isinstance(expr, Literal):
            return expr
        ways = [("negated", _not), ("true", _yes), ("false", _no)]
        return Apply(self.mark(words(expr), _same, ways), (self.value(expr),), Bool())

    def value(self, expr: Expr) -> Expr:
        """A part of an expression."""
        match expr:
            case Read(name=name, type=kind):
                return self.read(expr, str(name), kind)
            case Literal(value=value, type=kind):
                ways = [(spell(kind, other), partial(_given, other)) for other in _near(kind, value)]
                return Apply(self.mark(words(expr), _same, ways), (expr,), kind) if ways else expr
            case Among():  # as the comparisons that it is in C
                equals = equals_of(expr)
                return expr if equals == [expr] else self.value(any_of(equals))
            case Apply(args=args, type=kind) if mask_of(expr) is None:
                return self.applied(expr, args, kind)
            case Select(index=index):
                return replace(expr, index=self.value(index))
        return expr

    def read(self, expr: Read, name: str, kind: Scalar) -> Expr:
        """A variable that is read, beside all of its kind."""
        others = [other for other, its in self.leaves.items() if other != name and _alike(its, kind)]
        if not others:
            return expr
        ways = [(other, partial(_given, at)) for at, other in enumerate(others, 1)]
        count = Int(0, len(others))
        index = Apply(self.mark(name, _same, ways), (Literal(0, count),), count)
        return Select((expr.name, *others), index, kind)  # type: ignore[arg-type]  # names of leaves

    def applied(self, expr: Apply, args: tuple[Expr, ...], kind: Scalar) -> Expr:
        """An operator, with others in its place."""
        op = expr.op
        if is_logic(op):
            return replace(expr, args=tuple(map(self.condition_of, args)))
        inner = tuple(map(self.value, args))
        if is_comparison(op):
            alike = _same_at_an_end(op, args)
            ways = [(o.value, o.meaning) for o in sorted(COMPARISONS) if o is not op and o is not alike]
            real = isinstance(args[0].type, Real)
            return replace(expr, op=self.mark(words(expr), op.meaning, ways, real=real), args=inner)
        made = replace(expr, args=inner)
        if op in EXTREMES or op in (Op.ADD, Op.SUB, Op.MUL):
            first: list[tuple[str, Way]] = [("the first operand", _first), ("the second operand", _second)]
            first += [
                (other.value, other.meaning)
                for other in (Op.ADD, Op.SUB)
                if op in (Op.ADD, Op.SUB) and other is not op
            ]
            return Apply(self.mark(words(expr), op.meaning, first), inner, kind)
        if op in (Op.NOT, Op.NEG, Op.ABS):
            return Apply(self.mark(words(expr), op.meaning, [("its operand", _same)]), inner, kind)
        return made


def _same_at_an_end(op: Operator, args: tuple[Expr, ...]) -> Op | None:
    """The comparison that is the same, where one is with an end of what a variable can be."""
    match args:
        case (
            Read(type=Int(low=low, high=high)) | Select(type=Int(low=low, high=high)),
            Literal(value=value),
        ):
            at_low = {Op.EQ: Op.LE, Op.LE: Op.EQ, Op.NE: Op.GT, Op.GT: Op.NE}
            at_high = {Op.EQ: Op.GE, Op.GE: Op.EQ, Op.NE: Op.LT, Op.LT: Op.NE}
            ends = at_low if value == low else at_high if value == high else {}
            return ends.get(op)
    return None


def _same(value: Value) -> Value:
    return value


def _first(value: Value, _: Value) -> Value:
    return value


def _second(_: Value, value: Value) -> Value:
    return value


def _not(value: Value) -> Value:
    return not value


def _yes(_: Value) -> Value:
    return True


def _no(_: Value) -> Value:
    return False


def _given(value: Value, *_: Value) -> Value:
    return value


def _alike(one: Scalar, other: Scalar) -> bool:
    """Whether a variable may be taken for one of the other type."""
    if isinstance(one, Enum) or isinstance(other, Enum):
        return isinstance(one, Enum) and isinstance(other, Enum) and one.name == other.name
    return type(one) is type(other)


def _near(kind: Scalar, value: Value) -> Iterator[Value]:
    """Constants that could stand for this one: the next ones; of an enumeration its other members."""
    match kind:
        case Bool():
            yield not value
        case Enum(members=members):
            yield from (at for at in range(len(members)) if at != value)
        case Single():
            yield from (value * (1 - 2.0**-20), value * (1 + 2.0**-20)) if value else (2.0**-20, -(2.0**-20))
        case Real():
            yield from (math.nextafter(value, -math.inf), math.nextafter(value, math.inf))
            yield from (value * (1 - FINE), value * (1 + FINE)) if value else (FINE, -FINE)
        case Int():
            yield from (int(value) - 1, int(value) + 1)


@dataclass(slots=True)
class Matters:
    """What is noticed of one program, by the cases that were offered.

    Attributes:
        marked: The program with a mark at each place.
        open: By place, the ways that no case notices yet, each with how often it was tried.
        entries: The functions that have places.
        bases: By place, cases that meet it.
    """

    program: Program
    marked: Program
    switch: Switch
    spots: tuple[Spot, ...]
    open: dict[int, dict[int, int]]
    entries: frozenset[Entry]
    bases: dict[int, list[Case]] = field(default_factory=dict)

    @property
    def ways(self) -> int:
        """How many ways there are, at all places."""
        return sum(len(spot.ways) for spot in self.spots)

    def left(self) -> Iterator[Unnoticed]:
        """Yield what no case notices."""
        for number, ways in self.open.items():
            spot = self.spots[number]
            yield from (Unnoticed(spot.where, spot.text, spot.ways[way]) for way in ways)

    def of(self, case: Case, right: Expected, tries: int = TRIES) -> set[Hit]:
        """What a case notices that none before it did; of what was tried less often than this."""
        if case.mode or case.foreign or case.entry not in self.entries:
            return set()
        met = self.met(case)
        hits: set[Hit] = set()
        for number in met:
            bases = self.bases.setdefault(number, [])
            if len(bases) < MOST_BASES:
                bases.append(case)
            for way, tried in self.open.get(number, {}).items():
                if tried < tries:
                    self.open[number][way] = tried + 1
                    if self.notices(case, right, number, way):
                        hits.add(("matters", number, way))
        return hits

    def keep(self, hits: Iterable[Hit]) -> None:
        """Count what a case notices."""
        for hit in hits:
            match hit:
                case ("matters", int(number), int(way)):
                    self.open[number].pop(way, None)

    def met(self, case: Case) -> dict[int, Value]:
        """The places that a case meets, each with its last value."""
        self.switch.met = {}
        self.switch.place = -1
        told(self.marked, case)
        met, self.switch.met = self.switch.met, {}
        return met

    def notices(self, case: Case, right: Expected, number: int, way: int) -> bool:
        """Whether a case tells what stands at a place from what could."""
        self.switch.place, self.switch.way = number, way
        try:
            got = told(self.marked, case)
        except (*UNDEFINED, LookupError):  # of a local, too, that was not given a value
            return False
        finally:
            self.switch.place = -1
        return got is not None and got != shown(case, right)


def told(program: Program, case: Case) -> Told:
    """What a program gives, so that it can be compared; None where it is undefined."""
    match case.entry.kind:
        case "check":
            return (checked(program, case, defensive=False),)
        case "line":
            table = program.table(case.entry.name)
            return (line_number(table, matching_lines(table, case.before)),)
    right = ran(program, case)
    return None if right is None else shown(case, right)


def shown(case: Case, right: Expected) -> tuple[object, ...]:
    """What is to be seen of a result."""
    if case.entry.kind in ("check", "line"):
        return (right.result,)
    after: Snapshot = right.after or {}
    return right.result, right.fault_at, right.line, right.failed, tuple(after.items())


def matters_of(program: Program) -> Matters:
    """Mark every place of a program."""
    procedures = {str(procedure.name): procedure for procedure in program.procedures}
    marker = _Spots(leaves=dict(program.kinds), procedures=procedures)
    marked = marker.program(program).program
    open_ = {number: dict.fromkeys(range(len(spot.ways)), 0) for number, spot in enumerate(marker.spots)}
    tests = {spot.where.name for spot in marker.spots if spot.where.kind == "test"}
    has = (
        e
        for e in entries(program)
        if e.kind in ("check", "step", "cycle") or (e.kind == "line" and e.name in tests)
    )
    return Matters(program, marked, marker.switch, tuple(marker.spots), open_, frozenset(has))
