"""The line of one table of many: first the window of lines that may match, by what parts it from the others, then masks of one word.

Every question is answered, and none is jumped over: it costs the same whatever the input. A window has every line that
may match where its questions lead, so that two of them are seen in one word, as they are where all lines stand in words.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count
from typing import assert_never

from rcsc.code.emit.c.cprogram import NONE, ONE, CProgram
from rcsc.code.emit.c.matching.classes import index_of
from rcsc.code.emit.c.matching.masks import leaves_of, mask_code
from rcsc.code.emit.code_tree import (
    Cast,
    Choice,
    Code,
    Constant,
    Element,
    Frame,
    Invoke,
    Leave,
    Let,
    Line,
    Name,
    Round,
    Set,
    Stmt,
    infix,
)
from rcsc.code.emit.decision import Decision, End
from rcsc.code.emit.identifiers import comment
from rcsc.code.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Index,
    Matcher,
    PlanTable,
    Truth,
    Windows,
    first_value,
    joined,
)
from rcsc.lang.model import Bool

WIDE = 84
PAGE = 16
"""Windows that share a table of which classes their lines tell apart."""
FOUND, M, W = Name("line"), Name("m"), Name("w")
ZERO, SEVERAL = Constant(0, "uint32_t"), Constant(-2)


def in_windows(c: CProgram, table: PlanTable, windows: Windows, name: str) -> Iterator[Stmt]:
    """Return the body of the function that finds the line."""
    matcher = table.matcher
    said = "`order` says which line a bit stands for; a mask has the bits of those that its class does not exclude."
    yield Line(f"/* {comment(f'Masks of {table.source}, window by window: {said}')} */")
    yield from (_apart if windows.apart else _tables)(table, windows)
    _, (*asked, last) = _asked(c, windows, windows.decided, count(), count())
    yield from (*asked, replace(last, name=W.text))
    indices = [index_of(c, group, f"{name}_{at}") for at, group in enumerate(matcher.groups)]
    yield Let(
        "const uint64_t",
        M.text,
        infix("&", *(_found(windows, at, index) for at, index in enumerate(indices))),
    )
    yield from _tail(c, matcher)


def _asked(
    c: CProgram, windows: Windows, decided: Decision, ends: Iterator[int], names: Iterator[int]
) -> tuple[Code, list[Let]]:
    """Return code for the window that a decision leads to, and the statements that the code reads."""
    if isinstance(decided, End):
        return Constant(next(ends), "uint32_t"), []
    below, first = _asked(c, windows, decided.below, ends, names)
    above, then = _asked(c, windows, decided.above, ends, names)
    name = Name(f"w{next(names)}")
    code = Choice(_reaches(c, windows.probes[decided.probe].index, decided.first), above, below)
    return name, [*first, *then, Let("const uint32_t", name.text, code)]


def _reaches(c: CProgram, index: Index, number: int) -> Code:
    """Return the condition that the class is at least `number`."""
    match index:
        case Direct(leaf=leaf, type=Bool()):
            return c.text.place(leaf)
        case Direct(leaf=leaf, type=kind) | Coded(leaf=leaf, type=kind) | Cuts(leaf=leaf, type=kind):
            return infix(">=", c.text.place(leaf), c.text.constant(kind, first_value(index, number)))
        case Truth():
            raise TypeError("no question is asked of a condition over several variables")
        case _:
            assert_never(index)


def _found(windows: Windows, at: int, index: Code) -> Code:
    """Return the word of masks of one group in the window."""
    if not windows.apart:
        return Element(Element(Name(f"t.t{at}"), index), W)
    page = Element(Name(f"t.k{at}"), infix("/", W, Constant(PAGE, "uint32_t")))
    first = Element(Element(Name("t.first"), W), Constant(at, "uint32_t"))
    place = Element(Element(Name(f"t.c{at}"), W), Element(page, index))
    return Element(Name("t.words"), infix("+", Cast("uint32_t", first), Cast("uint32_t", place)))


def _tail(c: CProgram, matcher: Matcher) -> Iterator[Stmt]:
    """Yield code that returns the line of the one bit left."""
    yield Let("const bool", "several", infix("!=", infix("&", M, infix("-", M, ONE)), ZERO))
    lowest = Invoke(f"{c.p}_bit{WORD}", (M,), helper=f"bit{WORD}")
    none = Constant(matcher.lines) if matcher.default else Round(NONE)
    line = Cast("int32_t", Element(Element(Name("t.order"), W), lowest))
    yield Let("int32_t", "line", Choice(infix("==", M, ZERO), none, line))
    yield Set(FOUND, Choice(Name("several"), Round(SEVERAL), FOUND))
    yield Leave(FOUND)


# --- tables ---


def _words(matcher: Matcher, windows: Windows) -> list[list[tuple[int, ...]]]:
    """Return the word of every window, for each group and each combination of its classes."""
    lines = windows.lines
    own = [sum(1 << line for line in window) for window in lines]
    known: list[dict[int, int]] = [{} for _ in lines]

    def word(mask: int, at: int) -> int:
        left = mask & own[at]
        if left not in known[at]:
            known[at][left] = sum((left >> line & 1) << bit for bit, line in enumerate(lines[at]))
        return known[at][left]

    places = range(len(lines))
    return [[tuple(word(mask, at) for at in places) for mask in joined(group)] for group in matcher.groups]


def _tables(table: PlanTable, windows: Windows) -> Iterator[Stmt]:
    """Yield tables of masks, with a word for every window."""
    words = _words(table.matcher, windows)
    members = [f"uint64_t t{at}[{len(rows)}][{len(windows.lines)}];" for at, rows in enumerate(words)]
    bodies = [[mask_code(_side_by_side(row), len(row), WORD) + "," for row in rows] for rows in words]
    told = [f" /* {comment(f'{table.source}: {leaves_of(group)}')} */" for group in table.matcher.groups]
    yield from _object(table.matcher, windows, members, list(zip(told, bodies, strict=True)))


def _side_by_side(words: Sequence[int]) -> int:
    return sum(word << WORD * at for at, word in enumerate(words))


def _apart(table: PlanTable, windows: Windows) -> Iterator[Stmt]:
    """Yield the words of masks, each group's in a window one after another, and tables of their places.

    A table `k` maps classes to a column, once for the windows of a page; a table `c` has the word's place in that column, for each window.
    """
    words: dict[tuple[int, ...], int] = {}
    pool: list[int] = []
    first: list[list[int]] = [[] for _ in windows.lines]
    members, bodies = [], []
    for at, (group, rows) in enumerate(
        zip(table.matcher.groups, _words(table.matcher, windows), strict=True)
    ):
        merged, places = [], []
        for start in range(0, len(windows.lines), PAGE):
            parts = [row[start : start + PAGE] for row in rows]
            kinds = {part: number for number, part in enumerate(dict.fromkeys(parts))}
            merged.append([kinds[part] for part in parts])
            for window, column in enumerate(zip(*kinds, strict=True), start):
                different = {word: number for number, word in enumerate(dict.fromkeys(column))}
                if (key := tuple(different)) not in words:
                    words[key] = len(pool)
                    pool += key
                first[window].append(words[key])
                places.append([different[word] for word in column])
        members += [_member("k", at, merged), _member("c", at, places)]
        told = f" /* {comment(f'{table.source}: {leaves_of(group)}')} */"
        bodies += [(told, _rows(merged)), ("", _rows(places))]
    members = [f"uint64_t words[{len(pool)}];", _member("first", None, first), *members]
    bodies = [("", list(_dense([f"0x{word:x}ULL" for word in pool]))), ("", _rows(first)), *bodies]
    yield from _object(table.matcher, windows, members, bodies)


def _member(name: str, at: int | None, rows: Sequence[Sequence[int]]) -> str:
    """Spell the declaration of rows of numbers, as long as the longest."""
    kind = _least(max(map(max, rows)))
    return f"{kind} {name}{'' if at is None else at}[{len(rows)}][{max(map(len, rows))}];"


def _object(
    matcher: Matcher, windows: Windows, members: list[str], bodies: list[tuple[str, list[str]]]
) -> Iterator[Stmt]:
    """Yield all tables as one object, with the lines of every window."""
    lines = [[*window, *[matcher.lines] * (WORD - len(window))] for window in windows.lines]
    members = [f"{_least(matcher.lines)} order[{len(lines)}][{WORD}];", *members]
    yield Frame(("RCSC_CONST_SECTION static const struct {",), tuple(map(Line, members)))
    rows = [("", _rows(lines)), *bodies]
    yield Frame(
        ("} t = {",),
        tuple(Frame((f"{{{words}",), tuple(map(Line, body)), "},") for words, body in rows),
        "};",
    )


def _rows(rows: Sequence[Sequence[int]]) -> list[str]:
    """Spell rows of numbers, each in braces."""
    return [text for row in rows for text in ("{", *_dense(list(map(str, row))), "},")]


def _dense(values: Sequence[str]) -> Iterator[str]:
    """Yield values of an initialiser without blanks, as many in a line as fit."""
    taken: list[str] = []
    size = 0
    for value in values:
        if size + len(value) >= WIDE:
            yield ",".join(taken) + ","
            taken, size = [], 0
        taken.append(value)
        size += len(value) + 1
    yield ",".join(taken)


def _least(most: int) -> str:
    """Return the narrowest type that holds numbers up to this one."""
    return f"uint{next(bits for bits in (8, 16, 32) if most < 1 << bits)}_t"
