"""The C that finds the line of a table: classes of values, masks of lines, the bit that is left.

A table of masks has a word for each class of a leaf, or for each combination of classes of several leaves: a bit for each
line that the class does not exclude. The words that the inputs choose are joined by AND; the one bit left is the line. Up to 64
lines one word holds all of them; more take as many words as they need, one after another.

Neither takes anything from a proof: that two lines match, or none, is seen in the words themselves, in every cycle.
"""

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, product
from math import prod
from operator import itemgetter
from typing import assert_never

from rcsc.code.emit.c.cprogram import AT, NONE, ONE, CProgram, counted_loop, discarded, touches_state
from rcsc.code.emit.c.ctext import c_type, word_type
from rcsc.code.emit.code_tree import (
    IN_C,
    Body,
    Cast,
    Choice,
    Code,
    Constant,
    Element,
    Frame,
    Function,
    Infix,
    Invoke,
    Items,
    Leave,
    Let,
    Line,
    MemberPath,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    times,
)
from rcsc.code.emit.identifiers import comment
from rcsc.code.emit.plan import (
    WORD,
    Coded,
    Cuts,
    Direct,
    Group,
    Index,
    Matcher,
    Plan,
    PlanTable,
    Truth,
    joined,
)
from rcsc.code.emit.translate import STATE
from rcsc.lang import model
from rcsc.lang.model import I64_MIN, Bool, key_bounds, spell, value_of_key

MOST_TOLD = 32
"""Masks in a table up to which each stands in a line of its own, with its class."""
OPENS, ENDS = "RCSC_CONST_SECTION static const struct {", "\n    };"
"""The first line of a table's object of masks, and the end of its last one: no other object is a struct."""
SEVERAL = Constant(-2)
NOTHING = Constant(0, "uint64_t")
FOUND, M = Name("line"), Name("m")


def match_function(c: CProgram, table: PlanTable) -> Function:
    """Return the function that finds the line of a table."""
    name = c.names.tables[table.table.name]
    doc = f"Finds the line of table {table.table.name}: its position; -1 none, -2 several."
    body = tuple(_match(c, table, name))
    unread = () if touches_state(body) else (discarded(STATE),)
    return Function(
        doc,
        f"int32_t {c.p}_match_{name}(const {c.p}_t *s)",
        (*unread, *body),
        inline=True,
        origin=table.origin,
    )


def line_functions(c: CProgram, table: PlanTable) -> Iterator[Function]:
    """Yield the function that tells the line of a table for one state, and the one for many."""
    name = c.names.tables[table.table.name]
    doc = f"The line of table {table.table.name} that matches admitted inputs{table.where}: its position; -1 none, -2 several."
    found = Leave(Invoke(f"{c.p}_match_{name}", (STATE,)))
    yield Function(doc, f"int32_t {c.p}_{name}_line(const {c.p}_t *s)", (found,), origin=table.origin)
    i, n = Name("i"), Name("n")
    line = Invoke(f"{c.p}_{name}_line", (Prefix("&", Element(Name("in"), i)),))
    each = counted_loop(i, n, Set(Element(Name("out"), i), line), bound="n times")
    head = f"void {c.p}_{name}_lines(const {c.p}_t *in, int32_t *out, uint32_t n)"
    doc = f"The same for n inputs at once, table {table.table.name}."
    yield Function(doc, head, (Let("uint32_t", "i"), each), origin=table.origin)


def _match(c: CProgram, table: PlanTable, name: str) -> Iterator[Stmt]:
    matcher = table.matcher
    if matcher.groups:
        yield Line(f"/* {meaning(table)} */")
        yield from mask_tables(table)
    indices = [index_of(c, group, f"{name}_{at}") for at, group in enumerate(matcher.groups)]
    masks = [Element(Name(f"t.t{at}"), index) for at, index in enumerate(indices)]
    yield from (_one_word if matcher.words <= 1 else _many_words)(c, matcher, masks)


def _lowest(c: CProgram, bits: int, mask: Code) -> Code:
    return Invoke(f"{c.p}_bit{bits}", (mask,), helper=f"bit{bits}")


def _one_word(c: CProgram, matcher: Matcher, masks: list[Element]) -> Iterator[Stmt]:
    bits = max(width(matcher.lines), 32)
    word, none = f"uint{bits}_t", infix("==", M, word_code(0, bits))
    every = Round(Name(f"{2**matcher.lines - 1:#x}{'ULL' if bits == 64 else 'u'}"))
    yield Let(f"const {word}", "m", Infix("&", tuple(Cast(word, mask) for mask in masks)) if masks else every)
    several = infix("!=", infix("&", M, infix("-", M, word_code(1, bits))), word_code(0, bits))
    yield Let("const bool", "several", several)
    if not masks:
        yield discarded(STATE)
    first = _lowest(c, bits, M)
    if matcher.lines < bits:
        first = _lowest(c, bits, infix("|", M, word_code(1 << matcher.lines, bits)))
    else:
        first = Choice(none, Constant(matcher.lines), first)
    yield Let("int32_t", "line", first)
    if not matcher.default:
        yield Set(FOUND, Choice(none, Round(NONE), FOUND))
    yield Set(FOUND, Choice(Name("several"), Round(SEVERAL), FOUND))
    yield Leave(FOUND)


def _many_words(c: CProgram, matcher: Matcher, masks: list[Element]) -> Iterator[Stmt]:
    rows = [Name(f"r{at}") for at, _ in enumerate(masks)]
    for row, mask in zip(rows, masks, strict=True):
        yield Let("const uint64_t * const", row.text, mask)
    zero, several, seen, some, w = Constant(0, "uint32_t"), *map(Name, ("several", "seen", "some", "w"))
    yield from (Let("uint64_t", "several", zero), Let("uint64_t", "seen", zero))
    yield from (Let("int32_t", "line", Constant(0)), Let("int32_t", "none"), Let("uint32_t", "w"))
    nonzero = infix("!=", M, zero)
    at = infix("+", infix("*", Cast("int32_t", w), Constant(WORD)), _lowest(c, WORD, M))
    body = (
        Let("const uint64_t", "m", Infix("&", tuple(Element(row, w) for row in rows))),
        Let("const uint64_t", "some", Choice(nonzero, ONE, NOTHING)),
        Set(several, infix("|", several, infix("&", M, infix("-", M, ONE)), infix("&", some, seen))),
        Set(seen, infix("|", seen, some)),
        Set(FOUND, Choice(nonzero, at, FOUND)),
    )
    yield counted_loop(w, Constant(matcher.words, "uint32_t"), *body, bound=times(matcher.words))
    yield Set(Name("none"), Constant(matcher.lines) if matcher.default else Round(NONE))
    yield Set(FOUND, Choice(infix("==", seen, zero), Name("none"), FOUND))
    yield Set(FOUND, Choice(infix("!=", several, zero), Round(SEVERAL), FOUND))
    yield Leave(FOUND)


# --- the place in a table -------------------------------------------------------------------


def index_of(c: CProgram, group: Group, name: str) -> Code:
    """Return the joint index of the classes, in mixed radix, the last one fastest."""
    index: Code | None = None
    for number, probe in enumerate(group):
        leaf_class = _class(c, probe.index, f"{name}_{number}")
        moved = index and infix("*", index, Constant(probe.index.count, "uint32_t"))
        index = infix("+", moved, leaf_class) if moved else leaf_class
    assert index is not None
    return index


def _class(c: CProgram, index: Index, name: str) -> Code:
    match index:
        case Direct(leaf=leaf, type=Bool()):
            return bit_of(c.text.place(leaf))
        case Direct(leaf=leaf, low=0):
            return c.text.place(leaf)
        case Direct(leaf=leaf, type=kind, low=low):
            return _above(c, kind, c.text.place(leaf), low)
        case Truth(condition=condition):
            return bit_of(c.text.expr(condition))
        case Coded(leaf=leaf, type=kind, low=low):
            above = _above(c, kind, c.text.place(leaf), low)
            return _classify(c, name, "The class of the value.", above, "uint32_t", _codes(index))
        case Cuts(leaf=leaf, type=kind, cuts=cuts):
            held, place = c_type(kind), c.text.place(leaf)
            if not cuts:
                return Constant(0, "uint32_t")
            if len(cuts) <= 6:
                tests = (bit_of(infix(">=", place, c.text.constant(kind, cut))) for cut in cuts)
                return Infix("+", tuple(tests))
            return _classify(
                c, name, "How many cuts are at most the value.", place, held, tuple(_search(index, held))
            )
        case _:
            assert_never(index)


def _above(c: CProgram, kind: model.Scalar, place: MemberPath, low: int) -> Code:
    """Return code for the distance of a value from the least that has a class."""
    if low == 0:
        return place
    word, sign = word_type(*key_bounds(kind)), "+" if I64_MIN < low < 0 else "-"
    by = Constant(
        abs(low) if low > I64_MIN else low, word
    )  # the opposite of the least has no type with a sign
    return c.text.converted(Round(infix(sign, Cast(word, place), by)), word, "uint32_t")


def _classify(c: CProgram, name: str, doc: str, value: Code, kind: str, body: Body) -> Code:
    """Make a function that finds the class of a value; return its call."""
    function = c.names.c.fresh(f"{c.p}_class_{name}")
    c.classifiers.append(Function(doc, f"uint32_t {function}({kind} value)", body))
    return Invoke(function, (value.inner if isinstance(value, Round) else value,))


def _codes(index: Coded) -> Body:
    """Return code that looks up the class of `value`."""
    head = f"RCSC_CONST_SECTION static const uint{8 if index.count <= 256 else 16}_t classes[{len(index.classes)}] = {{"
    rows = tuple(wrapped(Constant(number, "uint32_t") for number in index.classes))
    return Frame((head,), rows, "};"), Leave(Element(Name("classes"), Name("value")))


def _search(index: Cuts, wide: str) -> Iterator[Stmt]:
    """Yield code that counts the cuts that are at most `value`; its number of steps depends on nothing."""
    count, cuts = Constant(len(index.cuts), "uint32_t"), Name("cuts")
    rows = tuple(wrapped(Constant(cut, wide) for cut in index.cuts))
    yield Frame((f"RCSC_CONST_SECTION static const {wide} cuts[{len(index.cuts)}] = {{",), rows, "};")
    yield Let("uint32_t", "at", Constant(0, "uint32_t"))
    step = 1 << len(index.cuts).bit_length() - 1
    while step:
        ahead, last = (infix("+", AT, Constant(by, "uint32_t")) for by in (step, step - 1))
        reached = infix(">=", Name("value"), Element(cuts, infix("%", last, count)))
        fits = infix("<=", ahead, count)  # of the first step that is always so
        taken = reached if 2 * step > len(index.cuts) else infix("&&", fits, reached)
        yield Set(AT, infix("+", AT, Choice(taken, Constant(step, "uint32_t"), Constant(0, "uint32_t"))))
        step >>= 1
    yield Leave(AT)


def bit_of(condition: Code) -> Code:
    """Return code that is 1 where the condition holds, else 0."""
    return Choice(condition, Constant(1, "uint32_t"), Constant(0, "uint32_t"))


def wrapped(values: Iterable[Code], width: int = 88) -> Iterator[Line]:
    """Yield values of an initialiser, as many in a line as fit."""
    text = ""
    for word in map(IN_C.code, values):
        if text and len(text) + len(word) > width:
            yield Line(text.rstrip())
            text = ""
        text += f"{word}, "
    yield Line(text.removesuffix(", "))


# --- tables of masks ------------------------------------------------------------------------


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
