"""The vectors as one C file that plays them: on a host, or on the target, with nothing but the emitted C.

In: a program, its symbols, vectors. Out: the text of a C file. States are kept as changes of the initial state, so
that hundreds of vectors take some kilobytes; nothing is allocated. Extern procedures answer as their vector says: the
file defines them.
"""

from collections.abc import Iterable, Iterator, Sequence

from rcsc.code.testing.coverage.case import MODES, NONE, Case, Entry, checked, entries, function_of, ran
from rcsc.code.testing.coverage.choose import Kept
from rcsc.code.testing.executors.externs import externs, given_kinds, stand_in_head
from rcsc.code.testing.executors.native import to_word
from rcsc.code.testing.executors.reference_file import monitored
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.interpret import Fault, initial
from rcsc.lang.model import Procedure, Program, Real, Scalar, Snapshot, TableName, Value

WORD_BITS, EVERY_BIT = 64, 0xFFFF_FFFF_FFFF_FFFF

HEAD = """/* The test vectors of {program}, made by rcsc: {count} of them.
   On a host:      cc -I . vectors.c {source} -o vectors && ./vectors
   On a target:    compile with -DVECTORS_NO_MAIN, and call vectors_play() for each number below vectors_count().
   A vector is a state with its inputs, a function that is called on it, and what it must give: the result, the trace
   and every leaf afterwards. Vectors do not depend on each other, nor on what `init` makes: what a function does not
   write is what stands in `initial`, and where it must write first there is rubbish. */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "{header}"

#define LEAVES {leaves}u

typedef struct {{ /* a leaf by its position, or LEAVES for the digest, and its value: of a real the bits of a double */
    uint16_t leaf;
    uint64_t word;
}} change_t;

typedef struct {{
    uint16_t function;
    uint16_t sets; /* changes of the initial state, from `first` on */
    uint16_t changed; /* changes of the state by the function, after those */
    uint16_t answers; /* words that the extern functions are given and give, call by call, after those */
    uint16_t mode; /* how the machine rounds: 0 as it should, else a way of `rounding` */
    uint32_t first;
    int32_t result;
    int32_t line;
    int32_t fault_at;
    uint64_t failed[{words}];
}} vector_t;

uint32_t vectors_count(void);
int32_t vectors_play(uint32_t number);
"""

TAKEN = """static uint64_t taken(void)
{
    uint64_t word = 0u;
    called = called && (answer < last);
    if (answer < last) {
        word = answer->word;
        answer++;
    }
    return word;
}
"""
"""The next word of what extern functions are given and give."""

PLAY = """
/* Lets the machine round to nearest (0), upward, downward, toward zero, or subnormals to zero; false where it cannot be told to. */
static bool rounding(uint16_t mode)
{{
#if defined(__SSE2_MATH__)
    static const uint32_t modes[5] = {{0x1f80u, 0x5f80u, 0x3f80u, 0x7f80u, 0x9fc0u}};
    __builtin_ia32_ldmxcsr(modes[mode]);
    return true;
#elif defined(__aarch64__)
    static const uint64_t modes[5] = {{0u, 0x400000u, 0x800000u, 0xc00000u, 0x1000000u}};
    __asm__ volatile("msr fpcr, %0" : : "r"(modes[mode]));
    return true;
#else
    return mode == 0u;
#endif
}}

/* Plays one vector: 0 where all is as it must be; -1 where this machine cannot be made to round as the vector wants, so that it was
   not played; 1 a wrong result, 2 a wrong trace, else 3 and the position of a wrong leaf. */
int32_t vectors_play(uint32_t number)
{{
    static {struct} s, right;
    const vector_t *const v = &vectors[number];
    const change_t *change = &changes[v->first];
    uint16_t at;
    int32_t result;
    memset(&right, 0xa5, sizeof right);
    for (at = 0u; at < LEAVES; at++) {{
        put(&right, at, initial[at]);
    }}
    put(&right, LEAVES, {digest}u);
    for (at = 0u; at < v->sets; at++) {{
        put(&right, change[at].leaf, change[at].word);
    }}
    memcpy(&s, &right, sizeof s);
    if (v->function == 0u) {{
        memset(&s, 0xa5, sizeof s); /* for `init` */
    }}
    change = &change[v->sets];
    for (at = 0u; at < v->changed; at++) {{
        put(&right, change[at].leaf, change[at].word);
    }}
    answer = &change[v->changed];
    last = &answer[v->answers];
    called = true;
    if (!rounding(v->mode)) {{
        return -1;
    }}
    result = call(&s, v->function);
    (void)rounding(0u);
    if (result != v->result) {{
        return 1;
    }}
    if (!called || (answer != last) || (traced(v->function) && !{trace})) {{
        return 2;
    }}
    for (at = 0u; at < LEAVES; at++) {{
        if (get(&s, at) != get(&right, at)) {{
            return 3 + (int32_t)at;
        }}
    }}
    return (s.digest == right.digest) ? 0 : 3 + (int32_t)LEAVES;
}}

uint32_t vectors_count(void)
{{
    return (uint32_t)(sizeof vectors / sizeof vectors[0]);
}}

#ifndef VECTORS_NO_MAIN
#include <stdio.h>

int main(void)
{{
    uint32_t number, wrong = 0u, not_played = 0u;
    for (number = 0u; number < vectors_count(); number++) {{
        const int32_t result = vectors_play(number);
        if (result < 0) {{
            not_played++;
        }} else if (result != 0) {{
            wrong++;
            (void)printf("vector %lu: wrong %s %ld\\n", (unsigned long)number + 1u,
                (result == 1) ? "result" : (result == 2) ? "trace" : "leaf", (long)result - 3);
        }} else {{
            /* as it must be */
        }}
    }}
    (void)printf("%lu vectors, %lu wrong", (unsigned long)(vectors_count() - not_played), (unsigned long)wrong);
    if (not_played != 0u) {{
        (void)printf(", %lu not played: this machine does not round as they ask", (unsigned long)not_played);
    }}
    (void)printf("\\n");
    return (wrong == 0u) ? 0 : 1;
}}
#endif
"""


def word_of(kind: Scalar, value: Value) -> int:
    """Return a value as 64 bits: a real as a double, a whole number in two's complement."""
    return to_word(kind, value) & EVERY_BIT


def vectors_c(program: Program, symbols: Symbols, kept: Sequence[Kept]) -> str:
    """The file.

    Args:
        program: The program.
        symbols: Of its emitted C.
        kept: Its vectors, in order.
    """
    rows, changes = _data(program, kept)
    failed = symbols.failed
    own = (f"(s.{path} == v->failed[{at}])" for at, path in enumerate(failed))
    trace = "((s.fault == v->result) && (s.line == v->line) && (s.fault_at == v->fault_at)"
    shape = {
        "program": program.name,
        "count": len(kept),
        "header": symbols.header,
        "source": symbols.source,
        "leaves": len(program.variables),
        "words": len(failed),
        "struct": symbols.struct,
        "digest": symbols.digest,
        "trace": " && ".join([trace, *own]) + ")",
    }
    parts = [HEAD.format(**shape), *_access(program, symbols), *_calls(program, symbols)]
    start = initial(program)
    words = (word_of(v.type, start[v.name]) for v in program.variables)
    parts += [
        "static const uint64_t initial[LEAVES] = {",
        *(f"    {_hex(word)}," for word in words),
        "};",
        "",
    ]
    parts += ["static const change_t changes[] = {", *(f"    {change}," for change in changes), "};", ""]
    parts += ["static const vector_t vectors[] = {", *rows, "};", PLAY.format(**shape)]
    return "\n".join(parts)


def _access(program: Program, symbols: Symbols) -> Iterator[str]:
    """Functions that set and get a leaf by its position."""
    yield f"static void put({symbols.struct} *s, uint16_t leaf, uint64_t word)"
    yield "{\n    const uint8_t byte = (uint8_t)word;\n    double real;\n    memcpy(&real, &word, sizeof real);"
    yield "    (void)byte;\n    (void)real;\n    switch (leaf) {"
    for at, variable in enumerate(program.variables):
        place, held = f"s->{symbols.path(variable.name)}", symbols.c_type(variable.name)
        given = "real" if isinstance(variable.type, Real) else "word"
        stored = f"memcpy(&{place}, &byte, 1u);" if held == "bool" else f"{place} = ({held}){given};"
        yield f"    case {at}: {stored} break;"
    yield "    default: s->digest = (uint32_t)word; break;\n    }\n}\n"
    yield f"static uint64_t get(const {symbols.struct} *s, uint16_t leaf)"
    yield "{\n    uint64_t word = 0u;\n    double real;\n    uint8_t byte = 0u;\n    (void)real;\n    (void)byte;\n    switch (leaf) {"
    for at, variable in enumerate(program.variables):
        place, held = f"s->{symbols.path(variable.name)}", symbols.c_type(variable.name)
        if isinstance(variable.type, Real):
            taken = f"real = (double){place}; memcpy(&word, &real, sizeof word);"
        elif held == "bool":
            taken = f"memcpy(&byte, &{place}, 1u); word = byte;"
        else:
            taken = f"word = (uint64_t){place};"
        yield f"    case {at}: {taken} break;"
    yield "    default: break;\n    }\n    return word;\n}\n"


def _calls(program: Program, symbols: Symbols) -> Iterator[str]:
    """The stand-ins of extern procedures, and the functions by number."""
    yield "static const change_t *answer, *last;"
    yield "static bool called; /* whether extern functions were given what they must be, as often as they must be */\n"
    if externs(program):
        yield TAKEN
    declared: dict[str, Procedure] = {}
    for procedure in externs(program):
        declared.setdefault(procedure.extern.c if procedure.extern else "", procedure)
    for procedure in declared.values():
        yield from _stand_in(program, symbols, procedure)
    yield f"static int32_t call({symbols.struct} *s, uint16_t function)"
    yield "{\n    int32_t result = 0;\n    switch (function) {"
    for at, entry in enumerate(entries(program)):
        yield f"    case {at}: {_call(symbols, entry)} break;"
    yield "    default: break;\n    }\n    return result;\n}\n"
    numbers = [at for at, entry in enumerate(entries(program)) if entry.kind in ("step", "cycle")]
    low = min(numbers, default=len(entries(program)))
    yield f"static bool traced(uint16_t function)\n{{\n    return (function == 0u) || (function >= {low}u);\n}}\n"


def _call(symbols: Symbols, entry: Entry) -> str:
    function = function_of(symbols, entry)
    if entry.kind == "lines":
        same = f"const {symbols.struct} same[3] = {{*s, *s, *s}}; int32_t got[3] = {{-9, -8, -7}};"
        told = "result = ((got[0] == got[1]) && (got[2] == -7)) ? got[0] : -9;"
        return f"{{ {same} {function}(same, got, 2u); {told} }}"
    return f"{function}(s);" if entry.kind == "init" else f"result = {function}(s);"


def _stand_in(program: Program, symbols: Symbols, procedure: Procedure) -> Iterator[str]:
    head, types = stand_in_head(symbols, procedure)
    yield f"{head}\n{{"
    for at, held in enumerate(types):
        if held in ("double", "float"):
            yield f"    {{ const double real = (double)a{at}; uint64_t word; memcpy(&word, &real, sizeof word);"
            yield "      called = (taken() == word) && called; }"
        else:
            yield f"    called = (taken() == (uint64_t)a{at}) && called;"
    for at, name in enumerate(procedure.writes):
        held = symbols.c_type(name)
        if isinstance(program.variable(name).type, Real):
            yield f"    {{ const uint64_t word = taken(); double real; memcpy(&real, &word, sizeof real); *r{at} = ({held})real; }}"
        else:
            yield f"    *r{at} = ({held})taken();"
    yield "}\n"


def _fault_at(program: Program, each: Kept) -> int:
    """Return the number that the trace tells as `fault_at`."""
    right = each.expected
    if each.case.entry.kind in ("step", "cycle") and right.result == Fault.STATE:
        return checked(program, each.case, defensive=True)
    if not right.fault_at:
        return NONE
    match right.result:
        case Fault.ASSUMPTION:
            return monitored(program).index(right.fault_at)
        case Fault.NO_LINE | Fault.SEVERAL_LINES:
            return [table.name for table in program.tables].index(TableName(right.fault_at))
    return list(program.kinds).index(right.fault_at)


def _data(program: Program, kept: Sequence[Kept]) -> tuple[list[str], list[str]]:
    """Rows of vectors, and of changes."""
    every, assumptions, start = entries(program), monitored(program), initial(program)
    rows, changes = list[str](), list[str]()
    for each in kept:
        first, right = len(changes), each.expected
        sets = [*_changed(program, start, each.case.before)]
        sets += [f"{{{len(program.variables)}u, 0u}}"] if each.case.foreign else []
        after = list(_changed(program, each.case.before, right.after or each.case.before))
        answers = [f"{{0u, {_hex(word)}}}" for word in _called(program, each.case)]
        changes += [*sets, *after, *answers]
        mode = ("", *MODES).index(each.case.mode)
        words = max(1, -(-len(assumptions) // WORD_BITS))
        bits = sum(1 << assumptions.index(name) for name in right.failed)
        failed = ", ".join(_hex(bits >> WORD_BITS * at & EVERY_BIT) for at in range(words))
        counts = f"{every.index(each.case.entry)}u, {len(sets)}u, {len(after)}u, {len(answers)}u, {mode}u, {first}u"
        rows.append(
            f"    {{{counts}, {right.result}, {right.line}, {_fault_at(program, each)}, {{{failed}}}}}, "
            f"/* {each.case.entry.kind} {each.case.entry.name}: {_plain(each.case.origin)} */"
        )
    return rows, changes or ["{0u, 0u}"]


def _called(program: Program, case: Case) -> list[int]:
    """The words that extern procedures are given and give, in the order of their calls."""
    answers, words = iter(case.answers), list[int]()

    def answered(procedure: Procedure, args: list[Value]) -> tuple[Value, ...]:
        kinds = [
            *given_kinds(program, procedure),
            *(program.variable(name).type for name in procedure.writes),
        ]
        given = next(answers).values
        words.extend(map(word_of, kinds, (*args, *given)))
        return given

    if case.answers:
        ran(program, case, answered)
    return words


def _plain(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def _hex(word: int) -> str:
    return f"UINT64_C({word:#x})" if word > 0xFFFF else f"{word}u"


def _changed(program: Program, before: Snapshot, after: Snapshot) -> Iterable[str]:
    for at, variable in enumerate(program.variables):
        old, new = (word_of(variable.type, values[variable.name]) for values in (before, after))
        if old != new:
            yield f"{{{at}u, {_hex(new)}}}"
