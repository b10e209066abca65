"""Past-time metric temporal logic on finite traces, for many traces at once; shares nothing with rcsc.

In: formulas as text, in FRET's notation: `! & | <-> xor ->`, `Y` (in the cycle before, false in the first), `Z` (the same, true in the
first), `O` (once), `H` (always so far), `S` (since), with `[<=n]`, `[<n]`, `[=n]` or `[a,b]` after them, and `FTP`, true in the first
cycle.
Out: their truth in each cycle. A truth is an int whose bit k belongs to trace k.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

Truths: TypeAlias = list[int]
Formula: TypeAlias = Callable[[Mapping[str, Sequence[int]], int], Truths]
"""From the truths of the names in each cycle, and the bits of all traces."""
_TOKEN = re.compile(r"\s*(<->|->|[!&|()]|\[[^\]]*\]|\w+)")
_BINARY = (("->",), ("<->", "xor"), ("|",), ("&",), ("S",))


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
        low, high = _limits(tokens, n)
        right = _level(tokens, strength + (strength > 0), n)
        left = _since(left, right, low, high) if word == "S" else _joined(word, left, right)
    return left


def _unary(tokens: list[str], n: int) -> Formula:
    word = tokens.pop()
    if word == "(":
        inside = _level(tokens, 0, n)
        assert tokens.pop() == ")"
        return inside
    if word == "!":
        inside = _unary(tokens, n)
        return lambda trace, full: [full & ~truth for truth in inside(trace, full)]
    if word in {"Y", "Z", "O", "H"}:
        low, high = _limits(tokens, n)
        return _past(word, _unary(tokens, n), low, high)
    constants = {"TRUE": True, "FALSE": False}
    if word in constants:
        return lambda trace, full: [full * constants[word]] * len(next(iter(trace.values())))
    if word == "FTP":
        return lambda trace, full: [full * (at == 0) for at in range(len(next(iter(trace.values()))))]
    return lambda trace, _: list(trace[word])


def _limits(tokens: list[str], n: int) -> tuple[int, int | None]:
    """Read the limits of a distance; 0 and none where there are none."""
    if not tokens or not tokens[-1].startswith("["):
        return 0, None
    text = re.sub(r"[\s()]", "", tokens.pop()[1:-1]).replace("n", str(n))
    high = sum(map(int, re.sub(r"^(<=|<|=)", "", text).split(",")[-1].split("+")))
    if text.startswith("<="):
        return 0, high
    if text.startswith("<"):
        return 0, high - 1
    if text.startswith("="):
        return high, high
    return sum(map(int, text.split(",")[0].split("+"))), high


def _joined(word: str, left: Formula, right: Formula) -> Formula:
    def truth(trace: Mapping[str, Sequence[int]], full: int) -> Truths:
        both = zip(left(trace, full), right(trace, full), strict=True)
        if word in {"<->", "xor"}:
            return [full * (word == "<->") ^ a ^ b for a, b in both]
        if word == "->":
            return [(full & ~a) | b for a, b in both]
        return [a & b for a, b in both] if word == "&" else [a | b for a, b in both]

    return truth


def _past(word: str, inside: Formula, low: int, high: int | None) -> Formula:
    def truth(trace: Mapping[str, Sequence[int]], full: int) -> Truths:
        held = inside(trace, full)
        if word in {"Y", "Z"}:
            return [full * (word == "Z"), *held[:-1]]
        result = []
        for at in range(len(held)):
            cycles = held[max(0, at - (at if high is None else high)) : max(0, at - low + 1)]
            some, every = 0, full
            for cycle in cycles:
                some, every = some | cycle, every & cycle
            result.append(some if word == "O" else every)
        return result

    return truth


def _since(left: Formula, right: Formula, low: int, high: int | None) -> Formula:
    def truth(trace: Mapping[str, Sequence[int]], full: int) -> Truths:
        kept, begun = left(trace, full), right(trace, full)
        result = []
        for at in range(len(kept)):
            found, unbroken = 0, full
            for distance in range(min(at, at if high is None else high) + 1):
                if distance >= low:
                    found |= unbroken & begun[at - distance]
                unbroken &= kept[at - distance]
            result.append(found)
        return result

    return truth
