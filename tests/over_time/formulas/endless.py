"""Future-time metric temporal logic on endless traces that come round; shares nothing with rcsc.

In: formulas as text, in FRET's notation: `! & | ->`, `X` (in the next cycle), `F` (in some cycle from here on), `G` (in each), `U` (until),
`V` (release), with `[<=n]`, `[<n]`, `[=n]` or `[a,b]` after `F` and `G`; and `LAST`, which no cycle of an endless trace is. Out: whether
they hold of a trace in its first cycle.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

Truths: TypeAlias = list[bool]
Trace: TypeAlias = Mapping[str, Sequence[bool]]
Formula: TypeAlias = Callable[[Trace, int], Truths]
"""From the truths of the names in each cycle, and the cycle, from 0, that comes after the last one."""
_TOKEN = re.compile(r"\s*(->|[!&|()]|\[[^\]]*\]|\w+)")
_BINARY = (("->",), ("|",), ("&",), ("U", "V"))


def parsed(text: str, n: int = 0) -> Formula:
    """Return the formula that a text says, for this value of `n`."""
    tokens = _TOKEN.findall(text)[::-1]
    formula = _level(tokens, 0, n)
    assert not tokens, text
    return formula


def _level(tokens: list[str], strength: int, n: int) -> Formula:
    if strength == len(_BINARY):
        return _unary(tokens, n)
    left = _level(tokens, strength + 1, n)
    while tokens and tokens[-1] in _BINARY[strength]:
        word = tokens.pop()
        right = _level(tokens, strength + 1, n)
        left = _joined(word, left, right)
    return left


def _unary(tokens: list[str], n: int) -> Formula:
    word = tokens.pop()
    if word == "(":
        inside = _level(tokens, 0, n)
        assert tokens.pop() == ")"
        return inside
    if word == "!":
        return _not(_unary(tokens, n))
    if word in {"X", "F", "G"}:
        low, high = (1, 1) if word == "X" else _limits(tokens, n)
        return _future(_unary(tokens, n), low, high, every=word == "G")
    if word in {"TRUE", "FALSE", "LAST"}:
        return lambda trace, _: [word == "TRUE"] * _length(trace)
    return lambda trace, _: list(trace[word])


def _limits(tokens: list[str], n: int) -> tuple[int, int | None]:
    """Read the limits of a distance; 0 and none where there are none."""
    if not tokens or not tokens[-1].startswith("["):
        return 0, None
    text = tokens.pop()[1:-1].replace("n", str(n))
    digits = re.sub(r"^(<=|<|=)", "", text)
    ends = [sum(map(int, part.split("+"))) for part in digits.split(",")]
    if text.startswith("<"):
        return 0, ends[0] - (not text.startswith("<="))
    return ends[0], ends[-1]


def _length(trace: Trace) -> int:
    return len(next(iter(trace.values())))


def _not(inside: Formula) -> Formula:
    return lambda trace, back: [not truth for truth in inside(trace, back)]


def _future(inside: Formula, low: int, high: int | None, *, every: bool) -> Formula:
    def truth(trace: Trace, back: int) -> Truths:
        truths, length = inside(trace, back), _length(trace)
        last = low + length if high is None else high  # all cycles that ever come
        judge = all if every else any
        return [
            judge(truths[_ahead(at, ahead, back, length)] for ahead in range(low, last + 1))
            for at in range(length)
        ]

    return truth


def _ahead(at: int, ahead: int, back: int, length: int) -> int:
    at += ahead
    return at if at < length else back + (at - back) % (length - back)


def _joined(word: str, left: Formula, right: Formula) -> Formula:
    def truth(trace: Trace, back: int) -> Truths:
        a, b = left(trace, back), right(trace, back)
        if word == "->":
            return [not x or y for x, y in zip(a, b, strict=True)]
        if word == "|":
            return [x or y for x, y in zip(a, b, strict=True)]
        if word == "&":
            return [x and y for x, y in zip(a, b, strict=True)]
        if word == "V":
            return [not truth for truth in _until([not x for x in a], [not y for y in b], back)]
        return _until(a, b, back)

    return truth


def _until(a: Truths, b: Truths, back: int) -> Truths:
    """Return where the first holds until the second does, which comes: in each cycle from the last, twice for what comes round."""
    length, now = len(a), False
    truths = [False] * length
    for _ in range(2):
        now = truths[back]
        for at in reversed(range(length)):
            truths[at] = now = b[at] or (a[at] and now)
    return truths
