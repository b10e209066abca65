"""Runs LALR tables: text to parse tree, or None where the text is wrong.

In: the tables of a grammar, which Lark made and a file keeps: Lark takes longer to make them than a small file takes to be proved.
Out: nodes with positions. The trees are Lark's: rules whose names begin with `_` are part of their parent, `?` rules of one child are
that child, and a node's span includes the parentheses around its parts, not those around itself. What a text should have been only
Lark says.
"""

import json
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

END = "$END"


class ParseLeaf(str):
    """A terminal: its text, its name and where it stands."""

    __slots__ = ("end_pos", "start_pos", "type")
    type: str
    start_pos: int
    end_pos: int


@dataclass(slots=True)
class ParseNode:
    """A rule's name, what it matched (nodes and leaves), and where; both positions are -1 where it matched nothing."""

    data: str
    children: list[Any]
    start_pos: int
    end_pos: int


class _Reduction(NamedTuple):
    """A rule as its reduction needs it.

    Attributes:
        size: The number of symbols that it takes from the stack.
        origin: The symbol that it makes.
        name: The name of its nodes; empty where the children go to the parent.
        picked: Which of the symbols become children, and whether their own children do; None for all as they are.
        alone: Whether a single child stands for the node.
        handed: Whether it always hands on what it takes.
    """

    size: int
    origin: str
    name: str
    picked: tuple[tuple[int, bool], ...] | None
    alone: bool
    handed: bool


class _Terminal(NamedTuple):
    """The definition of a word: a pattern, or a text that stands for itself."""

    name: str
    regexp: str
    text: str
    priority: int


class Grammar(NamedTuple):
    """The tables of one grammar, as plain values.

    Attributes:
        of: The SHA-256 of the grammar's text.
        starts: The state that each start rule begins in.
        ends: The state that it ends in.
        terminals: In the order in which they are tried.
        skipped: The pattern of what stands between words.
        rules: The reductions.
        states: For each state what each symbol leads to: a state, or -1 - the position of a rule.
    """

    of: str
    starts: Mapping[str, int]
    ends: Mapping[str, int]
    terminals: Sequence[_Terminal]
    skipped: str
    rules: Sequence[_Reduction]
    states: Sequence[Mapping[str, int]]

    def to_json(self) -> str:
        """Return the tables as JSON with a line for each state, so that diffs show grammar changes; symbols by their positions."""
        symbols = sorted({symbol for state in self.states for symbol in state})
        at = {symbol: place for place, symbol in enumerate(symbols)}
        states = [[n for symbol, to in state.items() for n in (at[symbol], to)] for state in self.states]
        parts: dict[str, Sequence[object]] = {
            "terminals": self.terminals,
            "rules": self.rules,
            "states": states,
        }
        whole = {
            "of": self.of,
            "starts": self.starts,
            "ends": self.ends,
            "skipped": self.skipped,
            "symbols": symbols,
        }
        lines = [f"{_dense(name)}: {_dense(value)}" for name, value in whole.items()]
        lines += [
            f"{_dense(name)}: [" + ",".join(f"\n{_dense(row)}" for row in part) + "\n]"
            for name, part in parts.items()
        ]
        return "{\n" + ",\n".join(lines) + "\n}\n"


def _dense(value: object) -> str:
    return json.dumps(value, separators=(",", ":"))


def grammar_of_json(text: str) -> Grammar:
    """Read the tables that `Grammar.to_json` wrote."""
    read = json.loads(text)
    symbols = read["symbols"]
    return Grammar(
        read["of"],
        read["starts"],
        read["ends"],
        [_Terminal(*terminal) for terminal in read["terminals"]],
        read["skipped"],
        [_Reduction(*rule) for rule in read["rules"]],
        [{symbols[at]: to for at, to in zip(row[::2], row[1::2], strict=True)} for row in read["states"]],
    )


def grammar_of_lark(parser: Any, of: str) -> Grammar:
    """Return the tables that Lark made; states are numbered in the order of their first visit from the start rules, alike in every run.

    Args:
        parser: A `lark.Lark` for LALR.
        of: The SHA-256 of the grammar's text.
    """
    table = parser.parser.parser.parser.parse_table
    ignored = (t.pattern.to_regexp() for t in parser.terminals if t.name in parser.ignore_tokens)
    terminals = [
        _Terminal(
            t.name, t.pattern.to_regexp(), t.pattern.value if t.pattern.type == "str" else "", t.priority
        )
        for t in sorted(parser.terminals, key=_rank)
    ]
    numbers = {state: number for number, state in enumerate(_met(table))}
    rules: dict[_Reduction, int] = {}
    states = [
        {
            symbol: numbers[arg]
            if isinstance(arg, int)
            else -1 - rules.setdefault(_reduction(arg), len(rules))
            for symbol, (_, arg) in sorted(table.states[state].items())
        }
        for state in numbers
    ]
    starts, ends = (
        {start: numbers[state] for start, state in sorted(which.items())}
        for which in (table.start_states, table.end_states)
    )
    return Grammar(of, starts, ends, terminals, f"(?:{'|'.join(sorted(ignored))})*+", list(rules), states)


def _met(table: Any) -> Iterator[int]:
    """Yield each state once, in the order of its first visit from the start rules."""
    waiting = [state for _, state in sorted(table.start_states.items())]
    met = set(waiting)
    for state in waiting:
        yield state
        for _, (_, arg) in sorted(table.states[state].items()):
            if isinstance(arg, int) and arg not in met:
                met.add(arg)
                waiting.append(arg)


@dataclass(frozen=True, slots=True)
class _Words:
    """The terminals that some state takes: how to match one, and the names of words that look like another terminal."""

    match: Callable[[str, int], re.Match[str] | None]
    special: Mapping[str, Mapping[str, str]]


class Tables:
    """The tables of one grammar, ready to run."""

    def __init__(self, grammar: Grammar) -> None:
        self._starts, self._ends = grammar.starts, grammar.ends
        self._states: list[dict[str, int | _Reduction]] = [
            {symbol: to if to >= 0 else grammar.rules[-1 - to] for symbol, to in state.items()}
            for state in grammar.states
        ]
        self._terminals = grammar.terminals
        self._words: dict[frozenset[str], _Words] = {}
        self._words_of: dict[int, _Words] = {}
        self._skipped = grammar.skipped
        self._skip = re.compile(self._skipped).match

    def parse(self, text: str, start: str) -> ParseNode | None:
        """Return the tree of a text by a start rule; None where it has none."""
        states, last, position = self._states, self._ends[start], 0
        stack, values, begins, ends = [self._starts[start]], list[Any](), list[int](), list[int]()
        while True:
            words = self._words_of.get(stack[-1]) or self._words_at(stack[-1])
            match = words.match(text, position)
            if match is not None:
                kind = match.lastgroup or ""
                begin, position = match.span(kind)
                leaf = ParseLeaf(text[begin:position])
                if kind in words.special:
                    kind = words.special[kind].get(leaf, kind)
            elif self._skip(text, position).end() == len(text):  # type: ignore[union-attr]  # it matches always
                kind = END
            else:
                return None
            action = states[stack[-1]].get(kind)
            while isinstance(action, _Reduction):
                if action.handed:
                    stack.pop()
                else:
                    _reduce(action, stack, values, begins, ends)
                stack.append(states[stack[-1]][action.origin])  # type: ignore[arg-type]  # a state: what follows a symbol
                if kind == END and stack[-1] == last:
                    return values[-1]  # type: ignore[no-any-return]
                action = states[stack[-1]].get(kind)
            if action is None:
                return None
            leaf.type, leaf.start_pos, leaf.end_pos = kind, begin, position
            stack.append(action)
            values.append(leaf)
            begins.append(begin)
            ends.append(position)

    def _words_at(self, state: int) -> _Words:
        """Return the words that may stand next in a state; states that take the same terminals share them."""
        taken = frozenset(self._states[state])
        if taken not in self._words:
            self._words[taken] = _words(
                self._skipped, [terminal for terminal in self._terminals if terminal.name in taken]
            )
        return self._words_of.setdefault(state, self._words[taken])


def _rank(terminal: Any) -> tuple[int, int, int, str]:
    """Return the sort key of Lark's order of terminals: the first that matches is taken."""
    pattern = terminal.pattern
    return -terminal.priority, -pattern.max_width, -len(pattern.value), terminal.name


def _words(skipped: str, terminals: Sequence[_Terminal]) -> _Words:
    """Build one pattern from the skipped text and these terminals; words that also match a pattern of their priority are told by text."""
    special: dict[str, dict[str, str]] = {}
    for wide in (terminal for terminal in terminals if not terminal.text):
        whole = re.compile(wide.regexp).fullmatch
        words = (terminal for terminal in terminals if terminal.text and terminal.priority == wide.priority)
        names = {word.text: word.name for word in words if whole(word.text)}
        if names:
            special[wide.name] = names
    inside = {name for names in special.values() for name in names.values()}
    parts = (
        f"(?P<{terminal.name}>{terminal.regexp})" for terminal in terminals if terminal.name not in inside
    )
    return _Words(re.compile(f"{skipped}(?:{'|'.join(parts) or '(?!)'})").match, special)


def _reduction(rule: Any) -> _Reduction:
    kept: Collection[tuple[int, bool]] = tuple(
        (at, not symbol.is_term and symbol.name.startswith("_"))
        for at, symbol in enumerate(rule.expansion)
        if not (symbol.is_term and symbol.filter_out)
    )
    size, name = len(rule.expansion), str(rule.alias or rule.origin.name)
    whole = len(kept) == size and not any(inner for _, inner in kept)
    alone = rule.options.expand1 and not rule.alias
    return _Reduction(
        size,
        rule.origin.name,
        "" if name.startswith("_") else name,
        None if whole else tuple(kept),
        alone,
        alone and whole and size == 1,
    )


def _reduce(
    rule: _Reduction, stack: list[int], values: list[Any], begins: list[int], ends: list[int]
) -> None:
    """Pop a rule's symbols from the stacks and push their node or parts; the caller pushes the state."""
    if not rule.size:
        values.append([] if not rule.name else ParseNode(rule.name, [], -1, -1))
        begins.append(-1)
        ends.append(-1)
        return
    size = rule.size
    parts = values[-size:]
    begin = begins[-size] if begins[-size] >= 0 else next((at for at in begins[-size:] if at >= 0), -1)
    end = ends[-1] if ends[-1] >= 0 else next((at for at in ends[: -size - 1 : -1] if at >= 0), -1)
    del stack[-size:], values[-size:], begins[-size:], ends[-size:]
    if rule.picked is not None:
        parts = _picked(rule.picked, parts)
    values.append(
        parts[0]
        if rule.alone and len(parts) == 1
        else ParseNode(rule.name, parts, begin, end)
        if rule.name
        else parts
    )
    begins.append(begin)
    ends.append(end)


def _picked(picked: Sequence[tuple[int, bool]], parts: Sequence[Any]) -> list[Any]:
    children: list[Any] = []
    for at, inner in picked:
        if not inner:
            children.append(parts[at])
        elif children:
            children += parts[at]
        else:
            children = parts[at]  # a list that grows at its end is not copied each time
    return children
