"""Expressions: names found, sub-expressions typed, paths followed to their leaves."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import reduce
from typing import TypeAlias

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.source import Span
from rcsc.lang.expressions import words
from rcsc.lang.expressions.literals import as_single, integer, real
from rcsc.lang.expressions.operators import (
    Typed,
    alike,
    applied,
    common_unit,
    compared,
    converted,
    counted,
    kind_word,
    one_kind,
    scaled,
)
from rcsc.lang.expressions.previous import AT_ONCE, OF_TWO_CYCLES, before, cycles_of, lasting
from rcsc.lang.expressions.scope import Body, Constant, Scope
from rcsc.lang.interpret import fold
from rcsc.lang.model import (
    Among,
    Apply,
    Array,
    Bool,
    Enum,
    Expr,
    Int,
    Literal,
    Read,
    ReadLocal,
    Real,
    Record,
    Scalar,
    Select,
    Type,
    Value,
    VariableName,
    key_bounds,
    value_of_key,
)
from rcsc.lang.operator_table import (
    BITWISE,
    EXTREMES,
    SCALING,
    WHOLE,
    Op,
    Operator,
    is_arithmetic,
    is_comparison,
    is_conversion,
    is_logic,
)
from rcsc.lang.restart import COMMAND
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.spell import spell_expr

DEEPEST = 200


def typed(scope: Scope, body: Body, written: tree.Expr, want: Scalar | None = None) -> Typed | None:
    """Return the typed expression; None after an error, which has then been reported."""
    if scope.depth == DEEPEST:
        scope.report(Code.TOO_DEEP, f"expressions nest more than {DEEPEST} deep", written.span)
        return None
    scope.depth += 1
    try:
        return as_single(scope, want, _typed(scope, body, written, want), written)
    finally:
        scope.depth -= 1


def _typed(scope: Scope, body: Body, written: tree.Expr, want: Scalar | None) -> Typed | None:
    match written:
        case tree.BoolLiteral() | tree.IntLiteral() | tree.RealLiteral() | tree.Mask():
            return _literal(scope, written)
        case tree.Reference(name, span):
            return _reference(scope, body, name, span, want)
        case tree.FieldOf() | tree.IndexOf():
            return _path(scope, body, written)
        case tree.BitsOf():
            return _bits_of(scope, body, written)
        case tree.Unary():
            return _unary(scope, body, written)
        case tree.Was() | tree.Event() | tree.Lasts() | tree.Once() | tree.Since():
            return _of_cycles(scope, body, written, want)
        case tree.Binary():
            return _binary(scope, body, written)
        case tree.InSet():
            return _in_set(scope, body, written)
        case tree.InRange():
            return _in_range(scope, body, written)
        case tree.Apply():
            return _function(scope, body, written)
        case tree.Order(command):
            scope.report(
                Code.KIND, f"`{command.text}(...)` is an order, not a value", written.span, ORDER_STANDS
            )
            return None


def _of_cycles(
    scope: Scope,
    body: Body,
    written: tree.Was | tree.Event | tree.Lasts | tree.Once | tree.Since,
    want: Scalar | None,
) -> Typed | None:
    match written:
        case tree.Once(operand, span):
            return _since(scope, body, "once", (operand,), span)
        case tree.Since(left, right, span):
            return _since(scope, body, "since", (left, right), span)
        case tree.Was(operand, span):
            return _was(scope, body, operand, span, want)
        case tree.Event():
            return _event(scope, body, written)
        case tree.Lasts(condition, time, span):
            with _nested(scope, AT_ONCE):
                holding = boolean(scope, body, condition)
            text = spell_expr(condition)
            return None if holding is None else for_a_time(scope, body, holding, text, time, span)


def _literal(
    scope: Scope, written: tree.BoolLiteral | tree.IntLiteral | tree.RealLiteral | tree.Mask
) -> Typed | None:
    match written:
        case tree.BoolLiteral(value, span):
            return Typed(Literal(value, Bool(), span))
        case tree.IntLiteral():
            return integer(scope, written)
        case tree.RealLiteral():
            return real(scope, written)
        case tree.Mask(span=span):
            scope.report(Code.KIND, "a mask is no value", span, "write `WORD = 0bx0`, or a cell under a word")
            return None


ORDER_STANDS = "an order stands in a column headed by the subordinate, or after `SUBORDINATE := `"


def boolean(scope: Scope, body: Body, written: tree.Expr) -> Expr | None:
    """Resolve a condition."""
    condition = typed(scope, body, written, Bool())
    if condition is None:
        return None
    if not isinstance(condition.expr.type, Bool):
        scope.report(
            Code.KIND, f"a condition is a bool, this is {kind_word(condition.expr.type)}", written.span
        )
        return None
    return condition.expr


def _reference(scope: Scope, body: Body, name: tree.Name, span: Span, want: Scalar | None) -> Typed | None:
    local = body.visible.get(name.text)
    if local is not None:
        return Typed(ReadLocal(local.name, local.type, span))
    if isinstance(want, Enum) and name.text in want.members:
        if _is_also(scope, name.text, want):
            message = f"`{name.text}` may mean the variable or `{want.name}.{name.text}`"
            helps = f"write `{want.name}.{name.text}`, or rename the variable"
            scope.report(Code.UNKNOWN_NAME, message, name.span, helps)
            return None
        return Typed(Literal(want.members.index(name.text), want, span))
    if name.text in scope.declared:
        return _path(scope, body, tree.Reference(name, span))
    if name.text in scope.set_names:
        scope.report(Code.KIND, f"`{name.text}` is a set, not a value", name.span, f"write `in {name.text}`")
        return None
    if not scope.demand("value", name):
        return None
    if name.text in scope.constants:
        constant = scope.constants[name.text]
        return Typed(Literal(constant.literal.value, constant.literal.type, span), constant.bare)
    enums = scope.members.get(name.text, [])
    if len(enums) == 1:
        return Typed(Literal(enums[0].members.index(name.text), enums[0], span))
    if enums:
        names = ", ".join(f"`{enum.name}.{name.text}`" for enum in enums)
        scope.report(
            Code.UNKNOWN_NAME,
            f"`{name.text}` may mean {names}",
            name.span,
            "write which enumeration is meant",
        )
        return None
    if name.text in scope.variables:
        scope.report(Code.NOT_CONSTANT, f"this must be a constant, `{name.text}` is a variable", name.span)
        return None
    if f"value {name.text}" in scope.places:
        return None  # what is wrong with it has been reported where it is declared
    known = [*body.visible, *scope.declared, *scope.constants, *scope.members]
    scope.unknown("variable, constant or member", name, known)
    return None


def _is_also(scope: Scope, name: str, want: Enum) -> bool:
    """Return whether a variable or constant of that name has the wanted type, too."""
    declared, constant = scope.declared.get(name), scope.constants.get(name)
    kind = declared.type if declared else constant.literal.type if constant else None
    return kind == want


@dataclass(frozen=True, slots=True)
class Path:
    """The place to which a path leads: one leaf or record, or by a computed index one of several.

    Attributes:
        names: Path names; one, or one an element of the array that `index` selects from.
        type: The type there.
        index: The computed index.
    """

    names: tuple[str, ...]
    type: Type
    index: Expr | None = None


def path_of(scope: Scope, body: Body, written: tree.Expr) -> Path | None:
    """Return the place to which a variable path leads; None after an error."""
    match written:
        case tree.Reference(name):
            declared = scope.declared.get(name.text)
            if declared is None:
                scope.unknown("variable", name, list(scope.declared))
                return None
            return Path((declared.name,), declared.type)
        case tree.FieldOf(base, name):
            return _field(scope, path_of(scope, body, base), name)
        case tree.IndexOf(base, index):
            return _element(scope, body, path_of(scope, body, base), index)
        case _:
            scope.report(Code.KIND, "this is not a variable", written.span)
            return None


def _field(scope: Scope, base: Path | None, name: tree.Name) -> Path | None:
    if base is None:
        return None
    if not isinstance(base.type, Record):
        hidden = scope.types.get(base.names[0])
        own = [_hides(hidden, name)] if isinstance(hidden, Enum) else []
        scope.report(Code.KIND, f"`{base.names[0]}` has no fields", name.span, *own)
        return None
    for part in base.type.fields:
        if part.name == name.text:
            return Path(tuple(f"{prefix}.{name.text}" for prefix in base.names), part.type, base.index)
    told, _ = scope.orders.get(base.names[0], ("", ""))
    if any(leaf == f"{told}.{name.text}" or leaf.startswith(f"{told}.{name.text}.") for leaf in scope.leaves):
        helps = (
            f"it is of the order: `{base.names[0]} := COMMAND({name.text} := VALUE)`, or `{told}.{name.text}`"
        )
        scope.report(Code.UNKNOWN_NAME, f"`{base.names[0]}` has no field `{name.text}`", name.span, helps)
        return None
    if told and name.text == "late":
        helps = (
            f"`commands {base.names[0]} : LINK within 25 cycles` makes it: what is not echoed in time is late"
        )
        scope.report(Code.UNKNOWN_NAME, f"`{base.names[0]}` has no field `late`", name.span, helps)
        return None
    scope.unknown("field", name, [part.name for part in base.type.fields])
    return None


def _hides(enum: Enum, member: tree.Name) -> str:
    """Return a help text: the variable hides the enumeration of its name, and how to name a member all the same."""
    said = f"write `{member.text}` alone, or " if member.text in enum.members else ""
    return f"the variable `{enum.name}` hides the type of that name: {said}call the variable otherwise"


def _element(scope: Scope, body: Body, base: Path | None, written: tree.Expr) -> Path | None:
    index = typed(scope, body, written)
    if base is None or index is None:
        return None
    if not isinstance(base.type, Array) or not isinstance(index.expr.type, Int):
        what = (
            "an index is a whole number"
            if isinstance(base.type, Array)
            else f"`{base.names[0]}` is not an array"
        )
        scope.report(Code.KIND, what, written.span)
        return None
    at, length = fold(index.expr), base.type.length
    if at is not None:
        if not 0 <= at < length:
            scope.report(
                Code.OUT_OF_RANGE_CONSTANT, f"the index {at} is not in 0 .. {length - 1}", written.span
            )
            return None
        return Path(tuple(f"{name}[{at}]" for name in base.names), base.type.element, base.index)
    if base.index is not None:
        scope.report(Code.KIND, "a path has at most one computed index", written.span)
        return None
    return Path(scope.names(base.names[0], length), base.type.element, index.expr)


def _path(scope: Scope, body: Body, written: tree.Expr) -> Typed | None:
    if isinstance(written, tree.FieldOf) and isinstance(written.base, tree.Reference):
        owner = scope.types.get(written.base.name.text)
        if isinstance(owner, Enum) and written.base.name.text not in scope.declared:
            return _member(scope, owner, written)
    path: Path | None
    if isinstance(written, tree.IndexOf):
        if _is_value(scope, body, written.base):
            return _bit(scope, body, typed(scope, body, written.base), written)
        base = path_of(scope, body, written.base)
        if base is not None and isinstance(base.type, Int):
            return _bit(scope, body, _read(base, written.base.span), written)
        path = _element(scope, body, base, written.index)
    else:
        path = path_of(scope, body, written)
    if path is None:
        return None
    if not isinstance(path.type, Bool | Enum | Int | Real):
        own = [part.name for part in path.type.fields] if isinstance(path.type, Record) else []
        helps = [f"write `{path.names[0]}.{COMMAND}`"] if COMMAND in own else []
        scope.report(Code.KIND, f"`{path.names[0]}` is a whole record or array", written.span, *helps)
        return None
    return _read(path, written.span)


def _read(path: Path, span: Span) -> Typed:
    assert isinstance(path.type, Bool | Enum | Int | Real)
    leaves = tuple(VariableName(name) for name in path.names)
    if path.index is None:
        return Typed(Read(leaves[0], path.type, span))
    return Typed(Select(leaves, path.index, path.type, span))


def _is_value(scope: Scope, body: Body, written: tree.Expr) -> bool:
    """Return whether it is a value with bits, and no path: a local, a constant, or a computed value."""
    if not isinstance(written, tree.Reference):
        return not isinstance(written, tree.FieldOf | tree.IndexOf)
    name = written.name.text
    return name in body.visible or (name not in scope.declared and name in scope.constants)


def _bits_of(scope: Scope, body: Body, written: tree.BitsOf) -> Typed | None:
    word = typed(scope, body, written.base)
    ends = _place(scope, body, written.high), _place(scope, body, written.low)
    return None if word is None else words.field(scope, word, ends, written.span)


def _bit(scope: Scope, body: Body, word: Typed | None, written: tree.IndexOf) -> Typed | None:
    """Resolve `word[3]`, the condition that the bit is set."""
    place = _place(scope, body, written.index)
    return None if word is None else words.bit(scope, word, place, written.span)


def _place(scope: Scope, body: Body, written: tree.Expr) -> int | None:
    """Return the number of a bit; None (reported) where it is not constant."""
    place = typed(scope, body, written)
    number = None if place is None else fold(place.expr)
    if place is not None and (number is None or not isinstance(place.expr.type, Int)):
        scope.report(Code.NOT_CONSTANT, "the number of a bit is a constant", written.span)
        return None
    return None if number is None else int(number)


def _member(scope: Scope, owner: Enum, written: tree.FieldOf) -> Typed | None:
    if written.name.text not in owner.members:
        scope.unknown(f"member of `{owner.name}`", written.name, list(owner.members))
        return None
    return Typed(Literal(owner.members.index(written.name.text), owner, written.span))


def _unary(scope: Scope, body: Body, written: tree.Unary) -> Typed | None:
    if written.op == "not":
        inner = boolean(scope, body, written.operand)
        return None if inner is None else Typed(Apply(Op.NOT, (inner,), Bool(), written.span))
    operand = typed(scope, body, written.operand)
    if operand is None or not _number(scope, operand, written.operand):
        return None
    return applied(scope, Op.NEG, (operand,), operand.unit(), written.span)


def _was(scope: Scope, body: Body, written: tree.Expr, span: Span, want: Scalar | None) -> Typed | None:
    """Resolve `was e`: `e` of the values after the cycle before."""
    if scope.no_before:
        scope.report(Code.NO_CYCLE_BEFORE, scope.no_before, span)
        return None
    with _nested(scope, "`was` goes back one cycle, not two"):
        operand = typed(scope, body, written, want)
    past = None if operand is None else before(scope, operand.expr, span)
    return None if operand is None or past is None else Typed(past, operand.bare)


def _since(scope: Scope, body: Body, word: str, operands: tuple[tree.Expr, ...], span: Span) -> Typed | None:
    """Resolve `once a`, or `a since b`, which a requirement over time remembers."""
    if scope.past is None or scope.no_before:
        message = (
            scope.no_before.replace("`was`", f"`{word}`")
            or f"`{word}` stands in requirements and assumptions over time"
        )
        scope.report(Code.NO_CYCLE_BEFORE, message, span)
        return None
    conditions = [boolean(scope, body, operand) for operand in operands]
    match [condition for condition in conditions if condition is not None]:
        case [condition] if len(operands) == 1:
            return Typed(scope.past.once(condition))
        case [kept, begun]:
            return Typed(scope.past.since(kept, begun))
        case _:
            return None


def _nested(scope: Scope, why: str) -> AbstractContextManager[None]:
    """Refuse `was`, inside, for the reason given; not in a requirement over time, which remembers all that it needs."""
    return nullcontext() if scope.past is not None else without_before(scope, why)


def for_a_time(
    scope: Scope, body: Body, condition: Expr, text: str, written: tree.Time, span: Span
) -> Typed | None:
    """Resolve `c for 2 [s]`: c holds, and has held for that time or longer."""
    if scope.no_before:
        scope.report(Code.NO_CYCLE_BEFORE, scope.no_before.replace("`was`", "`for`"), span)
        return None
    with without_before(scope, "a time is a constant"):
        time = typed(scope, body, written.value)
    value = None if time is None else fold(time.expr)
    if time is None:
        return None
    if value is None:
        scope.report(Code.NOT_CONSTANT, "a time is a constant", written.value.span)
        return None
    cycles = cycles_of(scope, written, value, time.unit())
    held = None if cycles is None else lasting(scope, condition, text, cycles, span)
    return None if held is None else Typed(held)


_EVENTS = {
    "@T": "`@T(c)`: the condition c comes to hold",
    "@F": "`@F(c)`: the condition c ceases to hold",
    "@C": "`@C(x)`: the value x changes",
}


def _event(scope: Scope, body: Body, written: tree.Event) -> Typed | None:
    def now() -> Typed | None:
        changes = written.word.text == "@C"
        return typed(scope, body, written.operand) if changes else _held(scope, body, written.operand)

    return happening(scope, body, written, now)


def happening(
    scope: Scope, body: Body, written: tree.Event | tree.Happens, operand: Callable[[], Typed | None]
) -> Typed | None:
    """Resolve `@T(c) when d`: `not was c and c and was d`; `operand` resolves c.

    Source: Heitmeyer, Jeffords and Labaw, "Automated consistency checking of requirements specifications", ACM TOSEM 5(3), 1996: of
    the old state c does not hold and d does, of the new one c holds. `@F(c)` is `@T(not c)`, and `@C(x)` that x differs.
    """
    word, span = written.word.text, written.span
    if word not in _EVENTS:
        near = _EVENTS.get(word.upper())
        helps = f"write {near}" if near else "; ".join(_EVENTS.values())
        scope.report(Code.UNKNOWN_NAME, f"no event is called `{word}`", written.word.span, helps)
        return None
    if scope.no_before:
        message = scope.no_before.replace("`was`", "an event")
        scope.report(Code.NO_CYCLE_BEFORE, message, span)
        return None
    with _nested(scope, OF_TWO_CYCLES):
        now = operand()
        guard = None if written.guard is None else boolean(scope, body, written.guard)
    past = None if now is None else before(scope, now.expr, span)
    if now is None or past is None:
        return None
    happens = (
        compared(scope, Op.NE, (now, Typed(past, now.bare)), span)
        if word == "@C"
        else Typed(_changes(past, now.expr, to=word == "@T", span=span))
    )
    if written.guard is None or happens is None:
        return happens
    then = None if guard is None else before(scope, guard, written.guard.span)
    return None if then is None else Typed(Apply(Op.AND, (happens.expr, then), Bool(), span))


def _held(scope: Scope, body: Body, written: tree.Expr) -> Typed | None:
    condition = boolean(scope, body, written)
    return None if condition is None else Typed(condition)


def _changes(past: Expr, now: Expr, *, to: bool, span: Span) -> Expr:
    """Return the condition that `now` begins to hold, or ceases to."""
    not_, and_ = (Apply(Op.NOT, (past if to else now,), Bool(), span), now if to else past)
    pair = (not_, and_) if to else (and_, not_)
    return Apply(Op.AND, pair, Bool(), span)


@contextmanager
def without_before(scope: Scope, why: str) -> Iterator[None]:
    """Refuse `was`, inside, for the reason given; an empty one allows it."""
    outer, scope.no_before = scope.no_before, why
    yield
    scope.no_before = outer


def _number(scope: Scope, operand: Typed, written: tree.Expr) -> bool:
    if isinstance(operand.expr.type, Int | Real):
        return True
    scope.report(Code.KIND, f"arithmetic takes numbers, this is {kind_word(operand.expr.type)}", written.span)
    return False


def _pair(scope: Scope, body: Body, left: tree.Expr, right: tree.Expr) -> tuple[Typed, Typed] | None:
    """Type both sides; a bare enum member takes the enumeration of the other side."""
    if _may_be_member(scope, body, left):
        second = typed(scope, body, right)
        first = typed(scope, body, left, second.expr.type if second else None)
    else:
        first = typed(scope, body, left)
        second = typed(scope, body, right, first.expr.type if first else None)
        first = as_single(scope, second.expr.type if second else None, first, left)
    return None if first is None or second is None else (first, second)


def _may_be_member(scope: Scope, body: Body, written: tree.Expr) -> bool:
    if not isinstance(written, tree.Reference):
        return False
    name = written.name.text
    return name in scope.members and name not in body.visible and name not in scope.declared


def _binary(scope: Scope, body: Body, written: tree.Binary) -> Typed | None:
    if isinstance(written.right, tree.Mask) and written.op in ("=", "/="):
        subject = typed(scope, body, written.left)
        return None if subject is None else masked(scope, subject, written.op, written.right)
    if written.op in BITWISE:
        operands = typed(scope, body, written.left), typed(scope, body, written.right)
        return words.bitwise(scope, written.op, operands, written.span)
    op: Operator = Op(written.op)
    if is_logic(op):
        first, second = boolean(scope, body, written.left), boolean(scope, body, written.right)
        return (
            None
            if first is None or second is None
            else Typed(Apply(op, (first, second), Bool(), written.span))
        )
    pair = _pair(scope, body, written.left, written.right)
    if pair is None:
        return None
    if is_comparison(op):
        return compared(scope, op, pair, written.span)
    left, right = pair
    if not (_number(scope, left, written.left) and _number(scope, right, written.right)):
        return None
    if op in WHOLE and isinstance(left.expr.type, Real):
        scope.report(Code.KIND, f"`{op.value}` takes whole numbers", written.span)
        return None
    assert is_arithmetic(op)  # the grammar has no other operator of two operands
    if op in SCALING:
        return scaled(scope, op, left, right, written.span)
    return alike(scope, op, (left, right), written.span)


def _in_set(scope: Scope, body: Body, written: tree.InSet) -> Typed | None:
    subject = typed(scope, body, written.subject)
    condition = None if subject is None else among(scope, body, subject, written.members, written.span)
    return other_than(condition) if condition is not None and written.negated else condition


def masked(scope: Scope, subject: Typed, op: str, mask: tree.Mask) -> Typed | None:
    """Type `word = 0bx0xx`, or the same with `/=`."""
    condition = words.matches(scope, subject, mask.text.replace("_", ""), mask.span)
    return condition if op == "=" or condition is None else other_than(condition)


def other_than(condition: Typed) -> Typed:
    """Return the negated condition, as `not in` needs it."""
    return Typed(Apply(Op.NOT, (condition.expr,), Bool(), condition.expr.span))


@dataclass(frozen=True, slots=True)
class _Range:
    """A range among the members of a set."""

    low: Typed
    high: Typed
    span: Span


_Part: TypeAlias = Typed | _Range | tree.Mask


def among(
    scope: Scope, body: Body, subject: Typed, members: tuple[tree.Member, ...], span: Span
) -> Typed | None:
    """Type `subject in {members}`; members are constants, ranges and named sets."""
    parts = _parts(scope, body, members, subject.expr.type)
    return None if parts is None else _one_of(scope, subject, parts, span)


def _one_of(scope: Scope, subject: Typed, parts: list[_Part], span: Span) -> Typed | None:
    """Return the condition that the subject is one of these values, in one of these ranges, or fits one of these masks."""
    values: list[Value] = []
    ranges: list[Expr] = []
    for part in parts:
        if isinstance(part, Typed):
            value = _value(scope, subject, part)
            if value is None:
                return None
            values.append(value)
            continue
        inside = (
            masked(scope, subject, "=", part)
            if isinstance(part, tree.Mask)
            else within(scope, subject, part.low, part.high, part.span)
        )
        if inside is None:
            return None
        ranges.append(inside.expr)
    among_values = Among(subject.expr, tuple(sorted(set(values))), Bool(), span)
    conditions = [among_values, *ranges] if values else ranges
    return Typed(reduce(lambda left, right: Apply(Op.OR, (left, right), Bool(), span), conditions))


def _value(scope: Scope, subject: Typed, element: Typed) -> Value | None:
    """Return the value of a member that may be one of the subject's; None after an error."""
    span, value = element.expr.span, fold(element.expr)
    if value is None:
        scope.report(Code.NOT_CONSTANT, "the members of a set are constants", span)
        return None
    if not one_kind(scope, subject, element, span) or common_unit(scope, (subject, element), span) is None:
        return None
    return value


def _parts(scope: Scope, body: Body, members: tuple[tree.Member, ...], want: Scalar) -> list[_Part] | None:
    """Return the members, with those of a named set, in declared order, in its place; None after an error."""
    every: list[_Part] = []
    met: set[object] = set()  # a set that names sets has each member once: they would multiply
    for member in members:
        name = _set_name(scope, body, member)
        if name is not None:
            its = named_set(scope, name)
            if its is None:
                return None
            every += [part for part in its if _key(part) not in met]
            met |= set(map(_key, its))
            continue
        assert not isinstance(member, tree.NamedSet)
        part = _part(scope, body, member, want)
        if part is None:
            return None
        every.append(part)
    return every


def _key(part: _Part) -> object:
    """Return what tells a member of a named set from another."""
    if isinstance(part, _Range):
        return _key(part.low), _key(part.high)
    if isinstance(part, tree.Mask):
        return part.text
    return part.expr.value if isinstance(part.expr, Literal) else part


def _part(scope: Scope, body: Body, member: tree.Expr | tree.Range, want: Scalar) -> _Part | None:
    if isinstance(member, tree.Mask):
        return member
    if not isinstance(member, tree.Range):
        return typed(scope, body, member, want)
    ends = typed(scope, body, member.low, want), typed(scope, body, member.high, want)
    return None if ends[0] is None or ends[1] is None else _Range(ends[0], ends[1], member.span)


def _set_name(scope: Scope, body: Body, member: tree.Member) -> tree.Name | None:
    """Return the name of the set that a member is; None for a value or a range."""
    match member:
        case tree.NamedSet(name):
            return name
        case tree.Reference(name) if name.text in scope.set_names and name.text not in body.visible:
            return name
    return None


def named_set(scope: Scope, name: tree.Name) -> list[_Part] | None:
    """Return the members of a declared set, with the span of its name here; None after an error."""
    if name.text not in scope.set_names:
        scope.unknown("set", name, sorted(scope.set_names))
        return None
    if not scope.demand("value", name) or name.text not in scope.sets:
        return None

    def here(one: Constant) -> Typed:
        return Typed(replace(one.literal, span=name.span), one.bare)

    return [
        replace(member, span=name.span)
        if isinstance(member, tree.Mask)
        else here(member)
        if isinstance(member, Constant)
        else _Range(here(member[0]), here(member[1]), name.span)
        for member in scope.sets[name.text]
    ]


def members_of(
    scope: Scope, written: tree.SetDecl, kind: Scalar
) -> list[tree.Mask | Typed | tuple[Typed, Typed]] | None:
    """Return the members of a declared set, typed as values of its type; None after an error."""
    parts = _parts(scope, Body(), written.members, kind)
    any_value = Typed(Literal(value_of_key(kind, key_bounds(kind)[0]), kind, written.name.span))
    if parts is None or _one_of(scope, any_value, parts, written.name.span) is None:
        return None
    return [(part.low, part.high) if isinstance(part, _Range) else part for part in parts]


def _in_range(scope: Scope, body: Body, written: tree.InRange) -> Typed | None:
    subject = typed(scope, body, written.subject)
    if subject is None:
        return None
    condition = between(scope, body, subject, written.low, written.high, written.span)
    return other_than(condition) if condition is not None and written.negated else condition


def between(
    scope: Scope, body: Body, subject: Typed, low: tree.Expr, high: tree.Expr, span: Span
) -> Typed | None:
    """Type `low <= subject and subject <= high`."""
    least = typed(scope, body, low, subject.expr.type)
    most = typed(scope, body, high, subject.expr.type)
    return None if least is None or most is None else within(scope, subject, least, most, span)


def within(scope: Scope, subject: Typed, least: Typed, most: Typed, span: Span) -> Typed | None:
    """Return the condition that the subject lies between these two; None (reported) for an empty range."""
    ends = fold(least.expr), fold(most.expr)
    if ends[0] is not None and ends[1] is not None and ends[0] > ends[1]:
        scope.report(
            Code.EMPTY_RANGE,
            f"the range {ends[0]} .. {ends[1]} is empty",
            span,
            "write the smaller bound first",
        )
        return None
    above, below = (
        compared(scope, Op.GE, (subject, least), span),
        compared(scope, Op.LE, (subject, most), span),
    )
    if above is None or below is None:
        return None
    return Typed(Apply(Op.AND, (above.expr, below.expr), Bool(), span))


def _function(scope: Scope, body: Body, written: tree.Apply) -> Typed | None:
    if written.function.text == "count":
        return _count(scope, body, written)
    op: Operator = Op(written.function.text)
    want = 2 if op in EXTREMES else 1
    if len(written.args) != want:
        scope.report(
            Code.WRONG_ARGUMENTS, f"`{op.value}` takes {want} argument{'s' * (want - 1)}", written.span
        )
        return None
    if len(written.args) == 2:
        operands: tuple[Typed, ...] | None = _pair(scope, body, *written.args)
    else:
        operand = typed(scope, body, written.args[0])
        operands = None if operand is None else (operand,)
    if operands is None:
        return None
    if op is Op.TO_INT and isinstance(operands[0].expr.type, Bool):
        return counted(operands[0].expr, written.span)
    if not all(_number(scope, o, w) for o, w in zip(operands, written.args, strict=True)):
        return None
    if is_conversion(op):
        return converted(scope, op, operands[0], written.span)
    assert is_arithmetic(op)  # the grammar has no other function
    return alike(scope, op, operands, written.span)


def _count(scope: Scope, body: Body, written: tree.Apply) -> Typed | None:
    """Resolve `count(a, b, ...)`, the number of these conditions that hold, to `int(a) + int(b) + ...`."""
    conditions = [boolean(scope, body, arg) for arg in written.args]
    numbers = [counted(condition, written.span) for condition in conditions if condition is not None]
    if len(numbers) < len(written.args):
        return None
    total = numbers[0]
    for number in numbers[1:]:
        larger = applied(scope, Op.ADD, (total, number), (), written.span)
        assert larger is not None  # so few fit in 64 bits
        total = larger
    return total
