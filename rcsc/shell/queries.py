"""Questions to the running system: `task.cur_state = state_3 and primitive.travelled_mm > 40`.

In: a text, and the levels as they are. Out: a `StateQuery` that can be asked after every cycle. The language is comparison, `and`,
`or`, `not`, parentheses, leaves, numbers and members; `=` and `/=` are read as in tables, `==` and `!=` too. Nothing is
ever handed to Python to evaluate.
"""

import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from rcsc.diagnostics.codes import Code
from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Value
from rcsc.shell.reload.refusal import Refused
from rcsc.shell.typed_names import NAME, by_name, known_name, one_leaf, shown, split

Running = Mapping[str, RunningLevel]
Holds = Callable[[Running], bool]
Term = Callable[[Running], Value | str]

_TOKEN = re.compile(
    rf"\s*(?:(?P<number>-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.]))|(?P<name>{NAME})|(?P<mark>==|!=|/=|<=|>=|[=<>()]))"
)
_COMPARE: Mapping[str, Callable[[Value | str, Value | str], bool]] = {
    "==": operator.eq, "=": operator.eq, "!=": operator.ne, "/=": operator.ne,
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
_EQUALITY = {"==", "=", "!=", "/="}
_BOOLS = {"true": True, "false": False}
MOST_NESTED = 50


@dataclass(frozen=True, slots=True)
class StateQuery:
    """A condition on the levels.

    Attributes:
        leaves: What it reads: a level's name and a position each.
        chosen: The level of names that are written without one.
    """

    text: str
    chosen: str
    holds: Holds
    leaves: tuple[tuple[str, int], ...]

    def now(self, running: Running) -> str:
        """Return what it reads, as it is now."""
        return ", ".join(shown(running[level], at) for level, at in dict.fromkeys(self.leaves))


@dataclass(frozen=True, slots=True)
class _Operand:
    """One side of a comparison.

    Attributes:
        kind: `number`, `bool`, `member` (of an enumeration), or `word`, which the other side must know.
    """

    text: str
    kind: str
    term: Term
    members: tuple[str, ...] = ()


def question(text: str, levels: Sequence[RunningLevel], chosen: RunningLevel) -> StateQuery:
    """What the text asks.

    Raises:
        Refused: It is no question, or names what is not there.
    """
    reading = _Reading(text, levels, chosen, _tokens(text))
    holds = reading.either(0)
    if reading.tokens:
        raise reading.bad(f"`{reading.tokens[0]}` is not expected")
    return StateQuery(text.strip(), chosen.name, holds, tuple(reading.leaves))


def _tokens(text: str) -> list[str]:
    tokens, at = [], 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise Refused(
                Code.SHELL_COMMAND,
                f"`{text}` cannot be read from `{text[at:].strip()}` on",
                "write such as `task.cur_state = state_3 and not task.new_command`",
            )
        tokens.append(match[0].strip())
        at = match.end()
    return tokens


@dataclass(slots=True)
class _Reading:
    """Recursive descent; one method a rule, loosest first."""

    text: str
    levels: Sequence[RunningLevel]
    chosen: RunningLevel
    tokens: list[str]
    leaves: list[tuple[str, int]] = field(default_factory=list)

    def bad(self, why: str) -> Refused:
        """The refusal of the whole."""
        return Refused(Code.SHELL_COMMAND, f"`{self.text.strip()}` is no condition: {why}")

    def took(self, word: str) -> bool:
        """Takes the next token if it is that word."""
        if self.tokens and self.tokens[0].casefold() == word:
            self.tokens.pop(0)
            return True
        return False

    def either(self, depth: int) -> Holds:
        """`a or b`."""
        parts = [self.both(depth)]
        while self.took("or"):
            parts.append(self.both(depth))
        return parts[0] if len(parts) == 1 else lambda now: any(part(now) for part in parts)

    def both(self, depth: int) -> Holds:
        """`a and b`."""
        parts = [self.negation(depth)]
        while self.took("and"):
            parts.append(self.negation(depth))
        return parts[0] if len(parts) == 1 else lambda now: all(part(now) for part in parts)

    def negation(self, depth: int) -> Holds:
        """`not a`, `(a)`."""
        if depth > MOST_NESTED:
            raise self.bad("it is nested too deep")
        if self.took("not"):
            inner = self.negation(depth + 1)
            return lambda now: not inner(now)
        if self.took("("):
            whole = self.either(depth + 1)
            if not self.took(")"):
                raise self.bad("`)` is missing")
            return whole
        return self.comparison()

    def comparison(self) -> Holds:
        """`a < b`, or a bool alone."""
        left = self.operand()
        if self.tokens and self.tokens[0] in _COMPARE:
            mark = self.tokens.pop(0)
            return self.compared(left, mark, self.operand())
        if left.kind != "bool":
            raise (
                self._lost(left)
                if left.kind == "word"
                else self.bad(f"`{left.text}` is neither true nor false")
            )
        return lambda now: bool(left.term(now))

    def operand(self) -> _Operand:
        """A leaf, a number, a bool or a member."""
        if not self.tokens or self.tokens[0] in {*_COMPARE, "(", ")"}:
            raise self.bad("a value is missing")
        token = self.tokens.pop(0)
        if token[0].isdigit() or token[0] in "-.":
            number = float(token) if re.search(r"[.eE]", token) else int(token)
            return _Operand(token, "number", lambda _: number)
        if token in _BOOLS:
            truth = _BOOLS[token]
            return _Operand(token, "bool", lambda _: truth)
        try:
            level, at = one_leaf(token, self.levels, self.chosen)
        except Refused:
            return self._word(token)
        return self._leaf(token, level, at)

    def _leaf(self, token: str, level: RunningLevel, at: int) -> _Operand:
        name, leaf = level.name, level.sign.leaves[at]
        self.leaves.append((name, at))
        if leaf.members:
            return _Operand(token, "member", lambda now: leaf.shown(now[name].values[at]), leaf.members)
        kind = "bool" if leaf.c_type == "bool" else "number"
        return _Operand(token, kind, lambda now: now[name].values[at])

    def _word(self, token: str) -> _Operand:
        """Read what is no leaf: the table or line that a level runs, or a member that the other side knows."""
        level, rest = split(token, self.levels, self.chosen)
        name = level.name
        if rest == "table":
            return _Operand(token, "member", lambda now: now[name].table, tuple(level.sign.tables))
        if rest == "line":
            lines = dict.fromkeys(line for table in level.sign.tables.values() for line in table)
            return _Operand(token, "member", lambda now: now[name].line, tuple(lines))
        return _Operand(token, "word", lambda _: token)

    def _lost(self, operand: _Operand) -> Refused:
        """Refuse an unknown word, as an unknown variable is refused."""
        try:
            one_leaf(operand.text, self.levels, self.chosen)
        except Refused as error:
            return error
        return self.bad(f"`{operand.text}` is no variable")

    def compared(self, left: _Operand, mark: str, right: _Operand) -> Holds:
        """The comparison of two operands that can be compared."""
        left, right = self._meant(left, right), self._meant(right, left)
        if left.kind != right.kind or left.members != right.members:
            raise self.bad(f"`{left.text}` and `{right.text}` cannot be compared")
        if left.kind != "number" and mark not in _EQUALITY:
            raise self.bad(f"`{left.text}` and `{right.text}` have no order")
        compare = _COMPARE[mark]
        return lambda now: compare(left.term(now), right.term(now))

    def _meant(self, operand: _Operand, other: _Operand) -> _Operand:
        """Read a bare word, or a line's number, as the member of the other side that it names."""
        if other.kind == "member" and operand.kind in {"word", "number"}:
            member = known_name(operand.text, other.members)
            if member is None:
                raise Refused(
                    Code.SHELL_VALUE,
                    f"`{other.text}` is never `{operand.text}`",
                    f"it is one of {', '.join(other.members)}",
                )
            return _Operand(operand.text, "member", lambda _: member, other.members)
        if operand.kind == "word":
            raise self._lost(operand)
        return operand


def asked(query: StateQuery, levels: Sequence[RunningLevel]) -> bool:
    """Whether it holds now."""
    return query.holds(by_name(levels))
