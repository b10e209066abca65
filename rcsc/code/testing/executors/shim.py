"""C that lets a test drive the emitted executor without knowing how its struct is laid out.

In: a program and its symbols. Out: the text of a C file that includes the emitted header and the reference
C, and moves every leaf in and out as one 64-bit word in declared order (a double by its bits).

One call runs a session: a start state, then rows of words; in each row only the inputs are set (or, where
`mode` is odd, every leaf), the function runs, and trace and leaves are copied out. Half of `mode` is the script of
the stand-ins, where there are any (see `externs`).
"""

from collections.abc import Iterator

from rcsc.code.testing.executors.externs import externs
from rcsc.code.testing.executors.reference_file import monitored, reference_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.code.testing.executors.targets import ComparedFunction, call_of, reference_of, targets
from rcsc.lang.model import Kind, Program, Real

TRACE_WORDS = 4
"""Result, fault, fault_at, line; then one word an assumption that is checked, then the leaves."""

WORDS = """
static int64_t word_of(double x) { int64_t w; memcpy(&w, &x, sizeof w); return w; }
static double of_word(int64_t w) { double x; memcpy(&x, &w, sizeof x); return x; }
"""

SESSION = """
void rcsc_session(int32_t which, int32_t mode, int64_t rows, const int64_t *in, int64_t *out) {{
  {struct} s; {init}(&s); {script}
  for (int64_t row = 0; row < rows; row++) {{
    set_leaves(&s, &in[row * {leaves}], (mode & 1) || row == 0);
    run(which, &s, &out[row * {words}]);
  }}
}}
"""

MAIN = """
int main(int argc, char **argv) {{
  int64_t head[3]; FILE *in = fopen(argv[1], "rb"); FILE *to = fopen(argv[2], "wb");
  if (argc != 3 || !in || !to) {{ return 2; }}
  while (fread(head, sizeof head[0], 3, in) == 3) {{
    size_t given = (size_t)head[2] * {leaves}, made = (size_t)head[2] * {words};
    int64_t *a = malloc(given * sizeof *a + 1), *b = malloc(made * sizeof *b + 1);
    if (!a || !b || fread(a, sizeof *a, given, in) != given) {{ return 3; }}
    rcsc_session((int32_t)head[0], (int32_t)head[1], head[2], a, b);
    if (fwrite(b, sizeof *b, made, to) != made) {{ return 4; }}
    free(a); free(b);
  }}
  return (fclose(in) | fclose(to)) ? 5 : 0;
}}
"""


def words(program: Program) -> int:
    """Return the number of words that one row gives back."""
    return TRACE_WORDS + len(monitored(program)) + len(program.variables)


def set_leaves_c(program: Program, symbols: Symbols) -> Iterator[str]:
    """Yield a C function that sets the inputs of a struct, or every leaf, from words."""
    yield f"static void set_leaves({symbols.struct} *s, const int64_t *in, int whole) {{"
    for at, variable in enumerate(program.variables):
        value = f"of_word(in[{at}])" if isinstance(variable.type, Real) else f"in[{at}]"
        guard = "" if variable.kind is Kind.INPUT else "if (whole) "
        yield f"{guard}s->{symbols.path(variable.name)} = ({symbols.c_type(variable.name)}){value};"
    yield "}"


def _copy(program: Program, symbols: Symbols) -> Iterator[str]:
    yield f"static void copy_leaves(const {symbols.struct} *s, int64_t *out) {{"
    for at, variable in enumerate(program.variables):
        place = f"s->{symbols.path(variable.name)}"
        value = f"word_of({place})" if isinstance(variable.type, Real) else f"(int64_t){place}"
        yield f"out[{TRACE_WORDS + len(monitored(program)) + at}] = {value};"
    yield "}"


def _executor(program: Program, symbols: Symbols, target: ComparedFunction) -> Iterator[str]:
    yield from call_of(symbols, target, "s")
    yield "out[0] = result; out[1] = result;"
    if target.kind in ("step", "cycle"):
        yield "out[2] = (out[1] != 0) ? (int64_t)s->fault_at : -1;"
        yield "out[3] = s->line;"
        for at, _ in enumerate(monitored(program)):
            yield f"out[{TRACE_WORDS + at}] = {symbols.failed_bit('(*s)', at)} ? 1 : 0;"


def _reference(program: Program, target: ComparedFunction) -> Iterator[str]:
    name = reference_of(target)
    if target.kind not in ("step", "cycle"):
        yield f"out[0] = {name}(s); out[1] = out[0];"
        return
    yield f"const ref_trace_t r = {name}(s); out[0] = r.fault; out[1] = r.fault; out[2] = r.fault_at;"
    yield "out[3] = r.line;"
    for at, _ in enumerate(monitored(program)):
        yield f"out[{TRACE_WORDS + at}] = r.failed[{at}];"


def _run(program: Program, symbols: Symbols) -> Iterator[str]:
    yield f"static void run(int32_t which, {symbols.struct} *s, int64_t *out) {{"
    yield f"memset(out, 0, {TRACE_WORDS + len(monitored(program))} * sizeof *out); switch (which) {{"
    for at, target in enumerate(targets(program, symbols)):
        yield f"case {2 * at}: {{"
        yield from _executor(program, symbols, target)
        yield f"break; }} case {2 * at + 1}: {{"
        yield from _reference(program, target)
        yield "break; }"
    yield "default: break; } copy_leaves(s, out); }"


def shim_c(program: Program, symbols: Symbols) -> str:
    """Return the whole shim; a function's number is twice its target's position, the reference's one more."""
    scripted = bool(externs(program))
    shape = {
        "script": "rcsc_script = (uint32_t)mode >> 1;" if scripted else "",
        "struct": symbols.struct,
        "init": symbols.init,
        "leaves": len(program.variables),
        "words": words(program),
    }
    head = [
        "#include <stdio.h>",
        "#include <stdlib.h>",
        "#include <string.h>",
        f'#include "{symbols.header}"',
    ]
    head += ["extern uint32_t rcsc_script;"] if scripted else []
    parts = [*head, reference_c(program, symbols), WORDS]
    parts += [*set_leaves_c(program, symbols), *_copy(program, symbols), *_run(program, symbols)]
    return "\n".join([*parts, SESSION.format(**shape), MAIN.format(**shape)]) + "\n"
