"""Expressions, types and conditions as text, with no more parentheses than are needed."""

import re
from collections.abc import Collection, Iterable, Iterator
from typing import assert_never

from rcsc.lang.operator_table import (
    BITWISE,
    CONJUNCTION,
    EXCLUSION,
    IMPLICATION,
    NEGATION,
    POSTFIX,
    RELATION,
    SIGN,
    SUM,
    Op,
)
from rcsc.lang.syntax import tree
from rcsc.lang.syntax.rows import ACTION_WORDS


def spell_names(names: Iterable[tree.Name]) -> str:
    """Return names of requirements, each in quotes."""
    return ", ".join(f'"{name.text}"' for name in names)


def spell_req(declaration: tree.Required) -> str:
    """Return the requirements of a declaration, with a blank before them; "" for none."""
    return f" req {spell_names(declaration.requirements)}" if declaration.requirements else ""


_AFTER_A_SCOPE = frozenset(
    "when whenever at on off only next always never eventually within for exactly until before".split()
)
"""Words that would make a scope of `before c,`; a response that begins with a variable called so stands in parentheses."""


_AFTER_ONCE = frozenset("and or xor implies in mod when for since then until upon".split())
"""Words after which a name `once` looks back at nothing (`ONCE` of the grammar)."""
_BEFORE_BRACKETS = frozenset(
    "while unless before after between from only when whenever next always never eventually within for exactly until".split()
)
"""Words that begin a requirement over time before brackets (`_OVER_TIME` of the grammar)."""
_WORD = re.compile(r"\w*", re.ASCII)


def spell_claimed(condition: tree.Expr) -> str:
    """Return what is assumed of a cycle; in parentheses where it would be read as an assumption over time."""
    text = spell_expr(condition)
    word, brackets, _ = text.partition("(")
    return f"({text})" if brackets and word in _BEFORE_BRACKETS else text


def spell_required(one: tree.RequirementDecl) -> str:
    """Return what a requirement says: scope, trigger, timing and response."""
    response = spell_expr(one.response)
    if (
        one.timing in {"before", "only after"}
        and response.partition(" ")[0].partition(".")[0] in _AFTER_A_SCOPE
    ):
        response = f"({response})"
    return "".join((*_in_scope(one), *_asks(one), *_takes(one), response))


def _in_scope(one: tree.RequirementDecl) -> Iterator[str]:
    if one.mode is not None and one.end is not None:
        word, least = ("and", NEGATION) if one.scope == "between" else ("until", 0)
        yield f"{one.scope} {spell_expr(one.mode, least)} {word} {spell_expr(one.end, least)}, "
    elif one.mode is not None:
        yield f"{one.scope} {spell_expr(one.mode)}, "


def _asks(one: tree.RequirementDecl) -> Iterator[str]:
    if one.condition is not None:
        yield f"{one.trigger} {spell_expr(one.condition)}, "


def _takes(one: tree.RequirementDecl) -> Iterator[str]:
    time = "" if one.time is None else _time(one.time)
    match one.timing:
        case "at most":
            assert one.times is not None
            yield f"at most {spell_expr(one.times, SUM)} times in {time}, "
        case "at least":
            yield f"at least {time} apart, "
        case "on" | "off":
            yield f"{one.timing} for at least {time}, "
        case _:
            yield f"{one.timing} {time}{', ' if time else ''}"
    if one.stop is not None:
        yield f"{spell_expr(one.stop)}, "


def spell_expr(expr: tree.Expr, least: int = 0) -> str:
    """Return the expression, in parentheses where it binds looser than `least`."""
    text, strength = _expr(expr)
    return f"({text})" if strength < least else text


def _expr(expr: tree.Expr) -> tuple[str, int]:
    """Return the text, and how tightly it binds."""
    match expr:
        case tree.BoolLiteral() | tree.IntLiteral() | tree.RealLiteral() | tree.Mask():
            return _literal(expr), POSTFIX
        case tree.Reference() | tree.FieldOf() | tree.IndexOf() | tree.BitsOf():
            return _place(expr), POSTFIX
        case tree.Unary("not", operand):
            return f"not {spell_expr(operand, NEGATION + isinstance(operand, tree.Lasts))}", NEGATION
        case tree.Once(operand):
            return f"once {_remembered(operand)}", NEGATION
        case tree.Since(left, right):
            return f"{spell_expr(left, NEGATION)} since {spell_expr(right, NEGATION)}", CONJUNCTION
        case tree.Unary(_, operand):
            return f"-{spell_expr(operand, SIGN)}", SIGN
        case tree.Was() | tree.Event():
            return _of_two_cycles(expr)
        case tree.Binary(op, left, right):
            return _binary(op, left, right)
        case tree.Lasts(condition, time):
            return f"{spell_expr(condition, RELATION)} {_for(time)}", NEGATION
        case tree.InSet(subject, members):
            return f"{spell_expr(subject, SUM)} {_in(expr)} {spell_set(members)}", RELATION
        case tree.InRange(subject, low, high):
            ends = spell_member(tree.Range(low, high))
            return f"{spell_expr(subject, SUM)} {_in(expr)} {ends}", RELATION
        case tree.Apply() | tree.Order():
            return _with_arguments(expr), POSTFIX
        case _:
            assert_never(expr)


def _literal(expr: tree.BoolLiteral | tree.IntLiteral | tree.RealLiteral | tree.Mask) -> str:
    match expr:
        case tree.BoolLiteral(value):
            return "true" if value else "false"
        case tree.IntLiteral(text, unit) | tree.RealLiteral(text, unit):
            return text + (f" {spell_unit(unit)}" if unit else "")
        case tree.Mask(text):
            return f"0b{text}"


def _place(expr: tree.Reference | tree.FieldOf | tree.IndexOf | tree.BitsOf) -> str:
    match expr:
        case tree.Reference(name):
            return name.text
        case tree.FieldOf(base, name):
            return f"{spell_expr(base, POSTFIX)}.{name.text}"
        case tree.IndexOf(base, index):
            return f"{spell_expr(base, POSTFIX)}[{spell_expr(index)}]"
        case tree.BitsOf(base, high, low):
            return f"{spell_expr(base, POSTFIX)}[{spell_expr(high, SUM)}..{spell_expr(low, SUM)}]"


def _of_two_cycles(expr: tree.Was | tree.Event) -> tuple[str, int]:
    if isinstance(expr, tree.Was):
        return f"was {spell_expr(expr.operand, POSTFIX)}", SIGN
    happens = f"{expr.word.text}({spell_expr(expr.operand)})"
    if expr.guard is None:
        return happens, POSTFIX
    return f"{happens} when {spell_expr(expr.guard, CONJUNCTION)}", EXCLUSION


def _with_arguments(expr: tree.Apply | tree.Order) -> str:
    if isinstance(expr, tree.Apply):
        return f"{expr.function.text}({', '.join(spell_expr(arg) for arg in expr.args)})"
    parts = [f"{part.name.text} := {spell_expr(part.value)}" for part in expr.fields]
    return f"{expr.command.text}({', '.join([*parts, *(['again'] if expr.again else [])])})"


def _binary(op: str, left: tree.Expr, right: tree.Expr) -> tuple[str, int]:
    """Spell a binary operator: relations do not chain, `implies` groups to the right, the others to the left."""
    strength = BITWISE.get(op) or Op(op).strength
    first = spell_expr(left, strength + (strength in (IMPLICATION, RELATION) or _mixed(op, left)))
    return f"{first} {op} {spell_expr(right, strength + (strength != IMPLICATION))}", strength


def _mixed(op: str, left: tree.Expr) -> bool:
    """Return whether arithmetic meets bits, or two different operators on bits meet: other languages bind them otherwise."""
    return isinstance(left, tree.Binary) and left.op != op and not BITWISE.keys().isdisjoint((op, left.op))


def spell_set(members: tuple[tree.Member, ...]) -> str:
    """Return the members of a set in braces, or its name alone."""
    match members:
        case [tree.NamedSet(name)]:
            return name.text
    return "{" + ", ".join(spell_member(member) for member in members) + "}"


def spell_member(member: tree.Member) -> str:
    """Return a value, a range or the name of a set as text."""
    match member:
        case tree.Range(low, high):
            return f"{spell_expr(low, SUM)} .. {spell_expr(high, SUM)}"
        case tree.NamedSet(name):
            return name.text
    return spell_expr(member)


def _remembered(operand: tree.Expr) -> str:
    """Return what `once` looks for; in parentheses where it begins with a variable that is called as a word that may follow one."""
    text = spell_expr(operand, NEGATION + isinstance(operand, tree.Lasts))
    return f"({text})" if _WORD.match(text)[0] in _AFTER_ONCE else text  # type: ignore[index]  # it matches nothing, too


def _for(time: tree.Time) -> str:
    """Return for how long; in parentheses where a sign would begin it."""
    value = spell_expr(time.value, SUM)
    return f"for {f'({value})' if value.startswith('-') else value}{' cycles' * time.cycles}"


def _time(time: tree.Time) -> str:
    return spell_expr(time.value, SUM) + " cycles" * time.cycles


def _in(written: tree.InSet | tree.InRange | tree.OneOf) -> str:
    return "not in" if written.negated else "in"


def spell_unit(unit: tree.Unit) -> str:
    """Return a unit in its brackets, as `[mm/s]`."""
    above = [_factor(f, 1) for f in unit.factors if f.power > 0]
    below = [_factor(f, -1) for f in unit.factors if f.power <= 0]
    return "[" + "/".join(["*".join(above) or "1", *below]) + "]"


def _factor(factor: tree.UnitFactor, sign: int) -> str:
    power = sign * factor.power
    return factor.name.text if power == 1 else f"{factor.name.text}^{power}"


def spell_field(part: tree.FieldDecl) -> str:
    """Return a field of a record or a link: its name, its type, its initial and its safe value."""
    begins = "" if part.initial is None else f" = {spell_expr(part.initial)}"
    safe = "" if part.safe is None else f" safe {spell_expr(part.safe)}"
    return f"{part.name.text} : {spell_type(part.type)}{begins}{safe}"


def spell_type(kind: tree.TypeExpr) -> str:
    """Return a type as text."""
    match kind:
        case tree.BoolType():
            return "bool"
        case tree.NamedType(name):
            return name.text
        case (
            tree.IntType(low, high, unit) | tree.RealType(low, high, unit) | tree.SingleType(low, high, unit)
        ):
            word = {tree.IntType: "int", tree.RealType: "real", tree.SingleType: "single"}[type(kind)]
            unit_text = f" {spell_unit(unit)}" if unit else ""
            return f"{word} {spell_expr(low, SUM)} .. {spell_expr(high, SUM)}{unit_text}"
        case tree.ArrayType(length, element):
            return f"array[{spell_expr(length)}] of {spell_type(element)}"
        case _:
            assert_never(kind)


def spell_condition(condition: tree.Condition, whole: bool) -> str:
    """Return a condition cell as text; under `when` (`whole`) just the expression."""
    match condition:
        case tree.Comparison(op, value):
            if whole:
                return f"({spell_expr(value)})" if _is_default(value) else spell_expr(value)
            if op == "=" and _in_groups(value):
                return _listed(value)
            return spell_expr(value, SUM) if op == "=" and _plain(value) else f"{op} {spell_expr(value, SUM)}"
        case tree.Lasting(inner, time):
            return f"{spell_condition(inner, whole)} {_for(time)}"
        case tree.Happens(word, operand, guard):
            of = "" if operand is None else f"({spell_condition(operand, False)})"
            when = "" if guard is None else f" when {spell_expr(guard, CONJUNCTION)}"
            return f"{'not ' if condition.negated else ''}{word.text}{of}{when}"
        case tree.OneOf(members, negated=False) if len(members) > 1 and any(map(_in_groups, members)):
            return ", ".join(map(_listed, members))
        case tree.OneOf(members):
            return f"{_in(condition)} {spell_set(members)}"
        case tree.Between(low, high):
            return f"{'not in ' if condition.negated else ''}{spell_member(tree.Range(low, high))}"
        case _:
            assert_never(condition)


def _in_groups(member: tree.Member) -> bool:
    """Return whether it is a mask that a cell may have without `0b`; a mask of digits alone would be a number with it."""
    return isinstance(member, tree.Mask) and "_" in member.text


def _listed(member: tree.Member) -> str:
    if isinstance(member, tree.Mask) and _in_groups(member):
        return member.text.replace("_", " ")
    return spell_member(member)


def _plain(value: tree.Expr) -> bool:
    """Return whether `value` alone cannot be taken for DEFAULT, nor for a condition that has held for a time, or an event."""
    denied = value.operand if isinstance(value, tree.Unary) and value.op == "not" else value
    return not (isinstance(value, tree.Lasts) or isinstance(denied, tree.Event) or _is_default(value))


def _is_default(value: tree.Expr) -> bool:
    return isinstance(value, tree.Reference) and value.name.text == "DEFAULT"


def spell_statement(statement: tree.Assign | tree.Call) -> str:
    """Return an assignment or a call as text."""
    if isinstance(statement, tree.Assign):
        return f"{'next ' if statement.deferred else ''}{spell_expr(statement.place)} := {spell_expr(statement.value)}"
    return statement.name.text + (
        f"({', '.join(spell_expr(arg) for arg in statement.args)})" if statement.args else ""
    )


def spell_action(cell: tuple[tree.Statement, ...] | tree.Comparison) -> str:
    """Return an action cell as text: a value, or calls and assignments."""
    if isinstance(cell, tree.Comparison):
        return spell_expr(cell.value)
    return "; ".join(
        spell_statement(statement) for statement in cell if isinstance(statement, tree.Assign | tree.Call)
    )


def spell_heading(heading: tree.Heading, words: Collection[str]) -> str:
    """Return a heading; a variable called like one of the words stands in parentheses."""
    if heading.subject is None:
        return heading.word
    text = spell_expr(heading.subject)
    return f"({text})" if text in words else text


def spell_turned(turned: tree.Turned) -> str:
    """Return what a turned table says after its name, with a blank before it."""
    words = (("by", turned.by, {"when"}), ("giving", turned.giving, ACTION_WORDS))
    return "".join(
        f" {word} {spell_heading(heading, own)}" for word, heading, own in words if heading is not None
    )


def spell_across(across: tree.Across, turned: tree.Turned) -> str:
    """Return the heading of a column of a turned table."""
    if turned.by is None:
        said = spell_action(across.said) if isinstance(across.said, tuple | tree.Comparison) else ""
        said = said or "-"
    else:
        whole = across.whole or turned.by.subject is None
        said = "" if isinstance(across.said, tuple) else spell_condition(across.said, whole)
        if (
            said.startswith("when ") and turned.by.subject is not None and not across.whole
        ):  # a variable's name
            said = f"{'in' if isinstance(across.said, tree.Between) else '='} {said}"
    said = f"when {said}" if across.whole else said
    if not across.given:
        return said
    stub = tree.marked(across.name, across.above, across.same)
    return stub if stub != across.name and said == across.name else f"{stub} : {said}"
