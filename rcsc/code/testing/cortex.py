"""The emitted C on an emulated Cortex-M3: every input of a table, line and step, against the reference.

In: a program, its symbols, its emitted C. Out: how many inputs were run and how many
differed. The image is the emitted C and the reference C; `boards` builds and runs it.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import prod

from rcsc.base.host.children import scratch
from rcsc.base.host.tools import Absent, BuildFailed
from rcsc.code.testing.boards import BOARDS, HARNESS, run_image
from rcsc.code.testing.executors.edges import leaf_edges
from rcsc.code.testing.executors.externs import SCRIPTS, externs
from rcsc.code.testing.executors.reference import constant
from rcsc.code.testing.executors.reference_file import reference_c
from rcsc.code.testing.executors.symbols import Symbols
from rcsc.lang.model import Program, Real, Table, Variable, key_bounds, value_of_key

MOST_INPUTS = 1 << 20
BOARD = next(board for board in BOARDS if board.name == "Cortex-M3")
COUNTS = {
    "inputs": " inputs, ",
    "lines": " lines differ, ",
    "steps": " steps, ",
    "differ": " steps differ\\n",
}
RESULT = re.compile(r"(\d+) inputs, (\d+) lines differ, (\d+) steps, (\d+) steps differ")


@dataclass(frozen=True, slots=True)
class CortexRun:
    """The emulated target's answer about a table.

    Attributes:
        inputs: Combinations of the test variables that were matched.
        complete: Whether they are all the combinations there are.
        steps: Whole steps compared, state included.
        differ: How many of either differed from the reference; must be 0.
    """

    table: str
    inputs: int
    complete: bool
    steps: int
    differ: int


def choices(
    program: Program, table: Table, most: int = MOST_INPUTS
) -> tuple[list[tuple[Variable, list[int]]], bool]:
    """The keys to run for each test variable, and whether that is every input of the table."""
    edges = leaf_edges(program)
    used = [program.variable(name) for name in table.variables]
    full = {v.name: key_bounds(v.type) for v in used}
    complete = prod(high - low + 1 for low, high in full.values()) <= most
    every = {
        name: list(range(low, high + 1)) if complete else list(edges[name])
        for name, (low, high) in full.items()
    }
    while prod(len(keys) for keys in every.values()) > most:
        widest = max(every, key=lambda name: len(every[name]))
        every[widest] = every[widest][::2]
    return [(variable, every[variable.name]) for variable in used], complete


def loops(
    program: Program, symbols: Symbols, table: Table, most: int
) -> tuple[list[str], list[str], list[str]]:
    """Return C of loops over inputs of a table: their beginnings, assignments to members of a state, and their ends."""
    begun, given = list[str](), list[str]()
    used, _ = choices(program, table, most)
    for at, (variable, keys) in enumerate(used):
        values = ", ".join(constant_in_c(variable, key) for key in keys)
        begun.append(f"static const {symbols.c_type(variable.name)} v{at}[] = {{{values}}};")
        begun.append(f"for (unsigned i{at} = 0; i{at} < {len(keys)}u; i{at}++) {{")
        given.append(f"{symbols.path(variable.name)} = v{at}[i{at}];")
    return begun, given, ["}"] * len(used)


def leaf_values(program: Program, symbols: Symbols) -> Iterator[str]:
    """C of `scatter(s)`, which sets every leaf to one of its edges, by the simple generator `any(n)`."""
    edges = leaf_edges(program)
    yield "static uint32_t seed = 1u; static uint32_t any(uint32_t n) {"
    yield "seed = seed * 1664525u + 1013904223u; return (seed >> 8) % n; }"
    yield f"static void scatter({symbols.struct} *s) {{"
    for variable in program.variables:
        values = ", ".join(constant_in_c(variable, key) for key in edges[variable.name])
        c_type = symbols.c_type(variable.name)
        yield f"{{ static const {c_type} v[] = {{{values}}}; s->{symbols.path(variable.name)} ="
        yield "v[any(sizeof v / sizeof v[0])]; }"
    yield "}"


def constant_in_c(variable: Variable, key: int) -> str:
    """The value of a key, as C spells it."""
    text = constant(variable.type, value_of_key(variable.type, key))
    return text.replace("ref_wide", "uint64_t") if not isinstance(variable.type, Real) else text


def _same(program: Program, symbols: Symbols) -> Iterator[str]:
    yield f"static int same(const {symbols.struct} *a, const {symbols.struct} *b) {{ return 1"
    for variable in program.variables:
        place = symbols.path(variable.name)
        if isinstance(variable.type, Real):
            yield f"&& memcmp(&a->{place}, &b->{place}, sizeof a->{place}) == 0"
        else:
            yield f"&& a->{place} == b->{place}"
    yield "; }"


def image_c(program: Program, symbols: Symbols, number: int, most: int) -> str:
    """The C text that runs one table on the target."""
    table, struct = program.tables[number], symbols.struct
    begun, given, ended = loops(program, symbols, table, most)
    parts = [HARNESS, f'#include "{symbols.header}"', reference_c(program, symbols)]
    parts += ["extern uint32_t rcsc_script;", *leaf_values(program, symbols), *_same(program, symbols)]
    parts += [f"int main(void) {{ static {struct} a, b; {symbols.init}(&a);"]
    parts += ["uint32_t inputs = 0, lines = 0, steps = 0, differ = 0;", *begun]
    parts.append("scatter(&a);" + (f" rcsc_script = any({SCRIPTS}u);" if externs(program) else ""))
    parts += [f"a.{each}" for each in given]
    parts.append(
        f"inputs++; if (ref_t{number}_safe(&a) && {symbols.lines[table.name]}(&a) != ref_t{number}_line(&a)) {{ lines++; }}"
    )
    parts.append(f"b = a; if (ref_invariants(&b)) {{ const ref_trace_t r = ref_t{number}_step(&b);")
    parts.append(f"steps++; const int32_t fault = {symbols.steps[table.name]}(&a);")
    parts.append("if (fault != r.fault || !same(&a, &b)) { differ++; } }")
    parts += ended
    for count, words in COUNTS.items():
        parts.append(f'say_number({count}); say("{words}");')
    parts.append("return 0; }")
    return "\n".join(parts) + "\n"


def run_cortex(
    program: Program, symbols: Symbols, files: Mapping[str, str], number: int, most: int = MOST_INPUTS
) -> CortexRun | Absent | BuildFailed:
    """Builds and runs one table's image.

    Args:
        program: The program.
        symbols: Names in its emitted C.
        files: The emitted files, text by path.
        number: Position of the table in the program.
        most: How many of its inputs are run at most; edges where they are not all.
    """
    if absent := BOARD.absent():
        return Absent(f"not installed: {absent}")
    if any(symbols.c_type(variable.name) == "uint64_t" for variable in program.variables):
        return Absent("the reference needs more than the 64 bits with a sign that there are on the target")
    table = program.tables[number]
    with scratch("cortex") as place:
        said = run_image(BOARD, place, files, image_c(program, symbols, number, most))
    if isinstance(said, BuildFailed):
        return said
    match = RESULT.search(said)
    if match is None:
        return BuildFailed(f"the target gave no result: {said.strip()[:400]}")
    inputs, lines, steps, differ = (int(number) for number in match.groups())
    return CortexRun(table.name, inputs, choices(program, table, most)[1], steps, lines + differ)
