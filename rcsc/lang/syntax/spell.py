"""Expressions, types and conditions as text, with no more parentheses than are needed."""

from typing import assert_never

from rcsc.lang.syntax import tree

_BINARY = {"implies": 1, "or": 2, "and": 3, "+": 6, "-": 6, "*": 7, "/": 7, "mod": 7}
_RELATION, _NOT, _MINUS, _POSTFIX = 5, 4, 8, 9


def spell_expr(expr: tree.Expr, least: int = 0) -> str:
    """The expression, in parentheses where it binds looser than `least`."""
    text, strength = _expr(expr)
    return f"({text})" if strength < least else text


def _expr(expr: tree.Expr) -> tuple[str, int]:
    """The text, and how tightly it binds."""
    match expr:
        case tree.BoolLiteral(value):
            return ("true" if value else "false"), _POSTFIX
        case tree.IntLiteral(text, unit) | tree.RealLiteral(text, unit):
            return text + (f" {spell_unit(unit)}" if unit else ""), _POSTFIX
        case tree.Reference(name):
            return name.text, _POSTFIX
        case tree.FieldOf(base, name):
            return f"{spell_expr(base, _POSTFIX)}.{name.text}", _POSTFIX
        case tree.IndexOf(base, index):
            return f"{spell_expr(base, _POSTFIX)}[{spell_expr(index)}]", _POSTFIX
        case tree.Unary("not", operand):
            return f"not {spell_expr(operand, _NOT)}", _NOT
        case tree.Unary(_, operand):
            return f"-{spell_expr(operand, _MINUS)}", _MINUS
        case tree.Was(operand):
            return f"was {spell_expr(operand, _POSTFIX)}", _MINUS
        case tree.Binary(op, left, right):
            return _binary(op, left, right)
        case tree.InSet(subject, members):
            return f"{spell_expr(subject, 6)} in {_set(members)}", _RELATION
        case tree.InRange(subject, low, high):
            return f"{spell_expr(subject, 6)} in {spell_expr(low, 6)} .. {spell_expr(high, 6)}", _RELATION
        case tree.Apply(function, args):
            return f"{function.text}({', '.join(spell_expr(arg) for arg in args)})", _POSTFIX
        case _:
            assert_never(expr)


def _binary(op: str, left: tree.Expr, right: tree.Expr) -> tuple[str, int]:
    strength = _BINARY.get(op, _RELATION)
    if op == "implies":
        ends = spell_expr(left, 2), spell_expr(right, 1)
    elif strength == _RELATION:
        ends = spell_expr(left, 6), spell_expr(right, 6)
    else:
        ends = spell_expr(left, strength), spell_expr(right, strength + 1)
    return f"{ends[0]} {op} {ends[1]}", strength


def _set(members: tuple[tree.Expr, ...]) -> str:
    return "{" + ", ".join(spell_expr(member) for member in members) + "}"


def spell_unit(unit: tree.Unit) -> str:
    """`[mm/s]`."""
    above = [_factor(f, 1) for f in unit.factors if f.power > 0]
    below = [_factor(f, -1) for f in unit.factors if f.power <= 0]
    return "[" + "/".join(["*".join(above) or "1", *below]) + "]"


def _factor(factor: tree.UnitFactor, sign: int) -> str:
    power = sign * factor.power
    return factor.name.text if power == 1 else f"{factor.name.text}^{power}"


def spell_type(kind: tree.TypeExpr) -> str:
    """A type."""
    match kind:
        case tree.BoolType():
            return "bool"
        case tree.NamedType(name):
            return name.text
        case tree.IntType(low, high, unit) | tree.RealType(low, high, unit):
            word = "int" if isinstance(kind, tree.IntType) else "real"
            unit_text = f" {spell_unit(unit)}" if unit else ""
            return f"{word} {spell_expr(low, 6)} .. {spell_expr(high, 6)}{unit_text}"
        case tree.ArrayType(length, element):
            return f"array[{spell_expr(length)}] of {spell_type(element)}"
        case _:
            assert_never(kind)


def spell_condition(condition: tree.Condition, whole: bool) -> str:
    """A condition cell; under `when` (`whole`) just the expression."""
    match condition:
        case tree.Comparison(op, value):
            if whole:
                return spell_expr(value) if _plain(value) else f"({spell_expr(value)})"
            return spell_expr(value, 6) if op == "=" and _plain(value) else f"{op} {spell_expr(value, 6)}"
        case tree.OneOf(members):
            return f"in {_set(members)}"
        case tree.Between(low, high):
            return f"{spell_expr(low, 6)} .. {spell_expr(high, 6)}"
        case _:
            assert_never(condition)


def _plain(value: tree.Expr) -> bool:
    """Whether `value` alone cannot be taken for DEFAULT."""
    return not (isinstance(value, tree.Reference) and value.name.text == "DEFAULT")
