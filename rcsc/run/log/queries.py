"""Conditions on levels, as people type them: `task.cur_state = state_3 and not primitive.travelled_mm > 40`.

In: a text, and the levels of a running system or of a log. Out: a predicate over their values. The language is comparison, also in
chains, `and`, `or`, `not`, parentheses, columns, numbers and members, bare or quoted, whatever their case; `=` and `/=` are read as in
tables, `==` and `!=` too. Nothing is ever handed to Python to evaluate.
"""

import difflib
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from rcsc.run.log.states import LogColumn, columns
from rcsc.run.signature import Value, Values

if TYPE_CHECKING:
    from rcsc.run.levels import RunningLevel
    from rcsc.run.log.read import LoggedLevel

NAME = r"[A-Za-z_][\w-]*(?:\[\d+\])*(?:\.[\w-]+(?:\[\d+\])*)*"
"""A name, its parts joined by points; hyphens as FORTH has them."""
MOST_NESTED = 50
Moment: TypeAlias = Mapping[str, Values]
"""The values of each level at a tick."""
Predicate: TypeAlias = Callable[[Moment], bool]
Column: TypeAlias = tuple[str, LogColumn]
"""A level's name, and what is read off it."""

_TOKEN = re.compile(
    rf"\s*(?:(?P<number>-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.]))|(?P<text>\"[^\"]*\"|'[^']*')|(?P<name>{NAME})"
    r"|(?P<mark>==|!=|/=|<=|>=|[=<>()]))"
)
_COMPARE: Mapping[str, Callable[[Value | str, Value | str], bool]] = {
    "==": operator.eq, "=": operator.eq, "!=": operator.ne, "/=": operator.ne,
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
_EQUALITY = {"==", "=", "!=", "/="}
_BOOLS = {"true": True, "false": False, "True": True, "False": False}


class BadCondition(Exception):  # noqa: N818  # what happened, not an error of ours
    """A text is no condition: says why, and what helps.

    Attributes:
        value: Whether it is a value that its variable never has.
    """

    def __init__(self, why: str, *helps: str, value: bool = False) -> None:
        super().__init__(why)
        self.helps, self.value = helps, value


class _Unread(BadCondition):
    """Why the text is none; the text itself is to be named."""


@dataclass(frozen=True, slots=True)
class _Operand:
    """One side of a comparison.

    Attributes:
        kind: `number`, `bool`, `member` (of an enumeration, or a text), or `word`, which the other side must know.
        members: Which a member may be; empty where any text may stand.
    """

    text: str
    kind: str
    term: Callable[[Moment], Value | str]
    members: tuple[str, ...] = ()


def named_columns(levels: "Iterable[RunningLevel | LoggedLevel]") -> dict[str, Column]:
    """Every column of the levels by `level.name`, with its level."""
    return {
        f"{level.name}.{column.name}": (level.name, column)
        for level in levels
        for column in columns(level.sign, level.level)
    }


def nearest(name: str, known: Mapping[str, Column]) -> str:
    """`there is no ...`, with the names that are like it."""
    near = difflib.get_close_matches(name, known, 3)
    return f"there is no `{name}` in this log" + (f"; near it: {', '.join(near)}" if near else "")


def normal(name: str) -> str:
    """The spelling by which names are compared: `CMD=>FAILURE` is `cmd_failure`."""
    return name.casefold().replace("=>", "_").replace("-", "_")


def known_name(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is meant: the exact one, or else the first equal but for case and hyphens."""
    every = list(known)
    return name if name in every else next((word for word in every if normal(word) == normal(name)), None)


def predicate(
    text: str, levels: "Iterable[RunningLevel | LoggedLevel]", more: Mapping[str, Column] | None = None
) -> Predicate:
    """Return what the text asks of levels that it names; `more` are columns beside theirs.

    Raises:
        BadCondition: It is no condition, or names what they do not have.
    """
    known = {**(more or {}), **named_columns(levels)}

    def unknown(name: str) -> BadCondition:
        return BadCondition(
            nearest(name, known) if "." in name else f"`{name}` is no leaf: write `level.leaf`"
        )

    return condition(text, lambda name: known.get(known_name(name, known) or ""), unknown)


def condition(
    text: str, column: Callable[[str], Column | None], unknown: Callable[[str], Exception]
) -> Predicate:
    """Return what the text asks.

    Args:
        text: As it was typed.
        column: What a name means; None where it means no column.
        unknown: What to raise where a name is no column.

    Raises:
        BadCondition: It is no condition.
        Exception: As `unknown` has it.
    """
    try:
        return _Reading(_tokens(text), column, unknown).whole()
    except _Unread as bad:
        raise BadCondition(f"`{text.strip()[:200]}` is no condition: {bad}", *bad.helps) from bad


def _tokens(text: str) -> list[str]:
    tokens, at = [], 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise _Unread(
                f"it cannot be read from `{text[at:].strip()[:200]}` on",
                "write such as `task.cur_state = state_3 and not task.new_command`",
            )
        tokens.append(match[0].strip())
        at = match.end()
    return tokens


@dataclass(slots=True)
class _Reading:
    """Recursive descent; one method a rule, loosest first."""

    tokens: list[str]
    column: Callable[[str], Column | None]
    unknown: Callable[[str], Exception]

    def whole(self) -> Predicate:
        """Read all of it."""
        holds = self.either(0)
        if self.tokens:
            raise _Unread(f"`{self.tokens[0]}` is not expected")
        return holds

    def took(self, word: str) -> bool:
        """Take the next token if it is that word."""
        if self.tokens and self.tokens[0].casefold() == word:
            self.tokens.pop(0)
            return True
        return False

    def either(self, depth: int) -> Predicate:
        """Read `a or b`."""
        parts = [self.both(depth)]
        while self.took("or"):
            parts.append(self.both(depth))
        return parts[0] if len(parts) == 1 else lambda now: any(part(now) for part in parts)

    def both(self, depth: int) -> Predicate:
        """Read `a and b`."""
        parts = [self.negation(depth)]
        while self.took("and"):
            parts.append(self.negation(depth))
        return parts[0] if len(parts) == 1 else lambda now: all(part(now) for part in parts)

    def negation(self, depth: int) -> Predicate:
        """Read `not a`, `(a)`."""
        if depth > MOST_NESTED:
            raise _Unread("it is nested too deep")
        if self.took("not"):
            inner = self.negation(depth + 1)
            return lambda now: not inner(now)
        if self.took("("):
            whole = self.either(depth + 1)
            if not self.took(")"):
                raise _Unread("`)` is missing")
            return whole
        return self.comparison()

    def comparison(self) -> Predicate:
        """Read `a < b`, `a < b < c`, or a bool alone."""
        left = self.operand()
        parts: list[Predicate] = []
        while self.tokens and self.tokens[0] in _COMPARE:
            mark, right = self.tokens.pop(0), self.operand()
            parts.append(self.compared(left, mark, right))
            left = right
        if parts:
            return parts[0] if len(parts) == 1 else lambda now: all(part(now) for part in parts)
        if left.kind == "word":
            raise self.unknown(left.text)
        if left.kind != "bool":
            raise _Unread(f"`{left.text}` is neither true nor false")
        return lambda now: bool(left.term(now))

    def operand(self) -> _Operand:
        """Read a leaf, a number, a bool or a member."""
        if not self.tokens or self.tokens[0] in {*_COMPARE, "(", ")"}:
            raise _Unread("a value is missing")
        token = self.tokens.pop(0)
        if token[0].isdigit() or token[0] in "-.":
            number = float(token) if re.search(r"[.eE]", token) else int(token)
            return _Operand(token, "number", lambda _: number)
        if token in _BOOLS:
            truth = _BOOLS[token]
            return _Operand(token, "bool", lambda _: truth)
        known = None if token[0] in "\"'" else self.column(token)
        if known is None:
            return _Operand(token.strip("\"'"), "word", lambda _: token)
        level, column = known
        kind = "bool" if column.c_type == "bool" else "number" if column.c_type else "member"
        return _Operand(token, kind, lambda now: column.read(now[level]), column.members)

    def compared(self, left: _Operand, mark: str, right: _Operand) -> Predicate:
        """Compare two operands that can be compared."""
        left, right = self._meant(left, right), self._meant(right, left)
        unlike = left.members and right.members and left.members != right.members
        if left.kind != right.kind or unlike:
            raise _Unread(f"`{left.text}` and `{right.text}` cannot be compared")
        if left.kind != "number" and mark not in _EQUALITY:
            raise _Unread(f"`{left.text}` and `{right.text}` have no order")
        compare = _COMPARE[mark]
        return lambda now: compare(left.term(now), right.term(now))

    def _meant(self, operand: _Operand, other: _Operand) -> _Operand:
        """Read a bare word, or a line's number, as the member of the other side that it names."""
        word = operand.text
        # a requirement across levels may be called like a member
        bare = operand.kind == "bool" and "." not in word and word not in _BOOLS
        if other.kind == "member" and (bare or operand.kind in {"word", "number"}):
            member = known_name(word, other.members) if other.members else word
            if member is None:
                of = ", ".join(filter(None, other.members))
                raise BadCondition(f"`{other.text}` is never `{word}`", f"it is one of {of}", value=True)
            return _Operand(word, "member", lambda _: member, other.members)
        if operand.kind == "word":
            raise self.unknown(operand.text)
        return operand
