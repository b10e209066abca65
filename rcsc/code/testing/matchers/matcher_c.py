"""The C self-test of a matcher: the emitted tables, index expressions and tail, compiled verbatim.

In: the parts of a matcher. Out: a C text that includes the emitted C itself and gives its parts to a caller.
"""

from collections.abc import Iterator

from rcsc.code.testing.executors.edges import relational_tests
from rcsc.code.testing.executors.reference_file import reference_c
from rcsc.code.testing.executors.shim import WORDS, set_leaves_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.matchers.matcher_text import Component, Lookup, MatcherText
from rcsc.lang.model import Program, Real, Table

MOST_PAIRED = 2048  # lines; of a larger table each line is paired with so many neighbours in steps

TAIL_TEST = """
static int32_t tail_of(uint64_t *m, uint32_t a, uint32_t b) {{
  for (uint32_t w = 0; w < {words}u; w++) {{ m[w] = 0; }}
  if (a < {lines}u) {{ m[a / 64u] |= UINT64_C(1) << (a % 64u); }}
  if (b < {lines}u) {{ m[b / 64u] |= UINT64_C(1) << (b % 64u); }}
  return rcsc_tail(m);
}}
uint64_t rcsc_tail_test(uint64_t *wrong) {{
  static uint64_t m[{words}]; uint64_t tried = 1; *wrong = 0;
  if (tail_of(m, {lines}u, {lines}u) != {none}) {{ (*wrong)++; }}
  for (uint32_t a = 0; a < {lines}u; a++) {{
    if (tail_of(m, a, a) != (int32_t)a) {{ (*wrong)++; }}
    tried++;
    for (uint32_t b = a + 1u; b < {lines}u; b += {step}u) {{
      if (tail_of(m, a, b) != -2) {{ (*wrong)++; }}
      tried++;
    }}
  }}
  return tried;
}}
"""


def _masks(number: int, lookup: Lookup) -> Iterator[str]:
    entry = f"t.t{number}[i]" if lookup.words == 1 else f"t.t{number}[i][w]"
    yield f"void rcsc_masks_{number}(uint64_t *out) {{ {lookup.declaration}"
    yield f"for (uint32_t i = 0; i < {lookup.entries}u; i++) for (uint32_t w = 0; w < {lookup.words}u; w++)"
    yield f"out[i * {lookup.words}u + w] = (uint64_t){entry}; }}"


def walk_c(program: Program, symbols: Symbols, name: str, part: Component) -> Iterator[str]:
    """The class of a leaf for each of many values, others initial."""
    leaf = next(v for v in program.variables if symbols.path(v.name) == part.path)
    value = "of_word(in[i])" if isinstance(leaf.type, Real) else "in[i]"
    yield f"void {name}(int64_t n, const int64_t *in, uint32_t *out) {{"
    yield f"{symbols.struct} t; {symbols.init}(&t); {symbols.struct} *s = &t;"
    yield f"for (int64_t i = 0; i < n; i++) {{ s->{part.path} = ({symbols.c_type(leaf.name)}){value};"
    yield f"out[i] = (uint32_t)({part.text}); }} }}"


def rows_c(program: Program, symbols: Symbols, name: str, expression: str, before: str = "") -> Iterator[str]:
    """The value of an expression, after some statements, for each of many complete states."""
    yield f"void {name}(int64_t n, const int64_t *in, uint32_t *out) {{"
    yield f"{symbols.struct} t; {symbols.init}(&t); {symbols.struct} *s = &t;"
    yield f"for (int64_t i = 0; i < n; i++) {{ set_leaves(s, &in[i * {len(program.variables)}], 1); {before}"
    yield f"out[i] = (uint32_t)({expression}); }} }}"


def _tail(symbols: Symbols, parts: MatcherText, words: int) -> Iterator[str]:
    """What follows the look-ups, given a mask instead of them."""
    yield f"static int32_t rcsc_tail(const uint64_t *given) {{ const {symbols.struct} *s = 0; (void)s;"
    if words == 1 and not any(lookup.words > 1 for lookup in parts.lookups):
        yield f"const uint{parts.word_bits}_t m = (uint{parts.word_bits}_t)given[0];"
    else:
        yield f"static uint64_t full[{words}]; for (uint32_t i = 0; i < {words}u; i++)"
        yield "{ full[i] = ~UINT64_C(0); }"
        for number, _ in enumerate(parts.lookups):
            yield f"const uint64_t * const r{number} = {'given' if number == 0 else 'full'};"
    yield parts.tail
    yield "}"


def self_test_c(program: Program, symbols: Symbols, table: Table, parts: MatcherText) -> str:
    """The whole self-test."""
    lines = len(table.lines)
    words = max(1, (lines + 63) // 64)
    number_of = program.tables.index(table)
    text = [f'#include "{symbols.source}"', "#include <string.h>", reference_c(program, symbols), WORDS]
    text += list(set_leaves_c(program, symbols))
    for number, lookup in enumerate(parts.lookups):
        text += _masks(number, lookup)
        text += rows_c(program, symbols, f"rcsc_index_{number}", lookup.index)
        for at, part in enumerate(lookup.components):
            name = f"rcsc_class_{number}_{at}"
            text += (
                walk_c(program, symbols, name, part)
                if part.path
                else rows_c(program, symbols, name, part.text)
            )
    for at, _ in enumerate(relational_tests(table)):
        text += rows_c(program, symbols, f"rcsc_test_{at}", f"ref_t{number_of}_test{at}(s)")
    text += _tail(symbols, parts, words)
    shape = {"words": words, "lines": lines, "none": -1 if table.default is None else lines}
    text.append(TAIL_TEST.format(**shape, step=1 if lines <= MOST_PAIRED else lines // 61))
    return "\n".join(text) + "\n"
