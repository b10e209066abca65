"""Tables of masks, as a reviewer reads them: each with the values that it is for and the lines that it leaves."""

import textwrap
from collections.abc import Iterator, Sequence
from itertools import groupby, product
from math import prod
from operator import itemgetter
from typing import assert_never

from rcsc.code.emit.c.matching.classes import wrapped
from rcsc.code.emit.code_tree import (
    IN_C,
    Frame,
    Items,
    Line,
    Name,
    Stmt,
)
from rcsc.code.emit.identifiers import comment
from rcsc.code.emit.plan import WORD, Coded, Cuts, Direct, Group, Index, Plan, PlanTable, Truth, joined
from rcsc.lang.model import spell, value_of_key

MOST_TOLD = 32
"""Masks in a table up to which each stands in a line of its own, with its class."""
OPENS, ENDS = "RCSC_CONST_SECTION static const struct {", "\n    };"
"""The first line of a table's object of masks, and the end of its last one: no other object is a struct."""


def meaning(table: PlanTable) -> str:
    """Explain the bits of a mask, with the line of each where its name does not tell."""
    lines = table.lines[: table.matcher.lines]
    numbered = all(line.name == str(at) for at, line in enumerate(lines))
    bits = "bit k" if numbered else f"from the lowest bit, lines {', '.join(line.name for line in lines)}"
    what = "is set where line k does not exclude" if numbered else "each set where its line does not exclude"
    return comment(f"Masks of {table.source}: {bits}{' ' if numbered else '; '}{what} that class.")


def mask_tables(table: PlanTable) -> Iterator[Stmt]:
    """Yield all tables of masks as one object: one address to load."""
    matcher = table.matcher
    lines = [line.name for line in table.lines[: matcher.lines]]
    bits = width(matcher.lines) if matcher.words <= 1 else WORD
    words = "" if matcher.words <= 1 else f"[{matcher.words}]"
    masks = [joined(group) for group in matcher.groups]
    members = (Line(f"uint{bits}_t t{at}[{len(entries)}]{words};") for at, entries in enumerate(masks))
    yield Frame((OPENS,), tuple(members))
    rows = (
        Frame(
            (f"{{ /* {comment(f'{table.source}: {leaves_of(group)}')} */",),
            tuple(_rows(group, entries, lines, (matcher.words, bits))),
            "},",
        )
        for group, entries in zip(matcher.groups, masks, strict=True)
    )
    yield Frame(("} t = {",), tuple(rows), "};")


def mask_probe(plan: Plan, table: PlanTable, source: str) -> str:
    """Return C for tests alone: `probe_masks(out)` copies each word of a table's masks out of an emitted file.

    The object of masks is taken as it stands in the file, so that a wrong word of it is seen. Words follow each other as the
    groups of the matcher do, in each group by class in mixed radix, in each mask from the lowest.

    Args:
        plan: The plan that the file was made of.
        table: One of its tables.
        source: The emitted C file.
    """
    groups = table.matcher.groups
    with_masks = [one.table.name for one in plan.tables if one.matcher.groups]
    objects = [part.partition(ENDS)[0] for part in source.split(OPENS)[1:]]
    body = [f"{OPENS}{objects[with_masks.index(table.table.name)]}{ENDS}"] if groups else []
    words = table.matcher.words
    place = "[n]" if words <= 1 else f"[n / {words}u][n % {words}u]"
    for at, group in enumerate(groups):
        count = prod(probe.index.count for probe in group) * words
        body.append(f"for (uint32_t n = 0; n < {count}u; n++) {{ *out = t.t{at}{place}; out++; }}")
    return "\n".join(["static void probe_masks(uint64_t *out)", "{", *body, "(void)out;", "}"])


def leaves_of(group: Group) -> str:
    """Name the leaves and conditions whose classes make a group."""
    return ", ".join(
        probe.index.text if isinstance(probe.index, Truth) else probe.index.leaf for probe in group
    )


def _rows(
    group: Group, entries: tuple[int, ...], lines: Sequence[str], size: tuple[int, int]
) -> Iterator[Line]:
    """Yield masks, or the words of each, from the lowest: each in a line with its class and its lines, or each run of equal ones."""
    (words, bits), classes = size, classes_of(group)
    runs = [[at for at, _ in run] for _, run in groupby(enumerate(entries), key=itemgetter(1))]
    if len(entries) <= MOST_TOLD:
        runs = [[at] for at, _ in enumerate(entries)]
    elif words > 1:
        yield from (Line(f"{mask_code(mask, words, bits)},") for mask in entries)
        return
    elif len(runs) > MOST_TOLD:
        yield from wrapped([word_code(mask, bits, bits // 4) for mask in entries], 84)
        return
    for run in runs:
        of = " .. ".join(dict.fromkeys((classes[run[0]], classes[run[-1]])))
        told = f"/* {comment(f'{of}: {_left(entries[run[0]], lines)}')} */"
        code = [mask_code(entries[at], words, bits) for at in run]
        comma = "," if words > 1 or run[-1] + 1 < len(entries) else ""
        if len(run) == 1:
            yield Line(f"{code[0]}{comma} {told}")
        else:
            yield from (Line(told), *(Line(row) for row in textwrap.wrap(f"{', '.join(code)}{comma}", 86)))


def mask_code(mask: int, words: int, bits: int) -> str:
    """Spell a mask, or the words of one, from the lowest."""
    digits = bits // 4
    parts = Items(tuple(word_code(mask >> (WORD * w) & (2**WORD - 1), WORD, digits) for w in range(words)))
    return IN_C.code(parts if words > 1 else word_code(mask, bits, digits))


def _left(mask: int, lines: Sequence[str]) -> str:
    """Name the lines that a mask leaves; four or more in a row by the first and the last."""
    left = [at for at in range(len(lines)) if mask >> at & 1]
    if not left or len(left) == len(lines):
        return "every line" if left else "no line"
    runs = [[at for _, at in run] for _, run in groupby(enumerate(left), key=lambda pair: pair[1] - pair[0])]
    told = [
        piece
        for run in runs
        for piece in ([f"{lines[run[0]]} to {lines[run[-1]]}"] if len(run) > 3 else [lines[at] for at in run])
    ]
    return f"line{'s' if len(left) > 1 else ''} {', '.join(told)}"


def classes_of(group: Group) -> list[str]:
    """Describe each combination of classes, the last leaf's fastest."""
    return [", ".join(words) for words in product(*(_class_words(probe.index) for probe in group))]


def _class_words(index: Index) -> list[str]:
    """Describe the values of each class."""
    match index:
        case Truth():
            return ["false", "true"]
        case Direct(type=kind, low=low, count=count):
            return [spell(kind, value_of_key(kind, key)) for key in range(low, low + count)]
        case Cuts(type=kind, cuts=cuts):
            spelled = [spell(kind, cut) for cut in cuts]
            return [f"below {spelled[0]}", *(f"{cut} and above" for cut in spelled)] if cuts else ["any"]
        case Coded(low=low, classes=classes):
            starts = [low + classes.index(number) for number in range(index.count)]
            return [f"{spell(index.type, start)} and above" for start in starts]
        case _:
            assert_never(index)


def word_code(value: int, bits: int, digits: int = 1) -> Name:
    """Spell a mask as a constant of 32 bits or 64, with at least `digits` digits."""
    return Name(f"0x{value:0{digits}x}{'ULL' if bits == 64 else 'u'}")


def width(lines: int) -> int:
    """Return the bits of the narrowest type with one for each line."""
    return next(bits for bits in (8, 16, 32, 64) if lines <= bits)
