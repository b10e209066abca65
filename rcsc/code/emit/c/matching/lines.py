"""The function that finds the line of a table: masks, the classes that choose among them, the bit that is left."""

from collections.abc import Iterator

from rcsc.code.emit.c.cprogram import NONE, ONE, CProgram, counted_loop, discarded, touches_state
from rcsc.code.emit.c.matching.classes import index_of
from rcsc.code.emit.c.matching.masks import mask_tables, meaning, width, word_code
from rcsc.code.emit.code_tree import (
    Cast,
    Choice,
    Code,
    Constant,
    Element,
    Function,
    Infix,
    Invoke,
    Leave,
    Let,
    Line,
    Name,
    Prefix,
    Round,
    Set,
    Stmt,
    infix,
    times,
)
from rcsc.code.emit.plan import WORD, Matcher, PlanTable
from rcsc.code.emit.translate import STATE

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
