"""What a match costs: instructions of the C matcher by callgrind, nanoseconds of C and Python: `python -m tests.bench.executors`.

Tables of `families.box` by size, and ACQUIRE.
Beside them, in C: a scan of all lines that counts how many match; in Python: nested ifs that check nothing. The counts hold
for the compiler and flags at hand; the fuller the inputs' variety the fairer, so inputs are drawn over the whole space.
Nanoseconds in C are of a call through a pointer, whose own are told beside it: *random*, one input after another; *steady*, as
in a control loop, where 95 of 100 repeat the one before.
"""

import random
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rcsc.code.emit import emitted
from rcsc.code.emit.c.ctext import CText
from rcsc.code.emit.code_tree import IN_C
from rcsc.code.emit.identifiers import names_of
from rcsc.code.emit.lower import lower
from rcsc.lang.model import Box, Program, ProvedProgram, Value, key_bounds, seal_of_proof, value_of_key
from rcsc.lang.project import load
from rcsc.lang.resolve import compile_text, resolve
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests.bench.made import families

INPUTS = 512
DRAWN = 8192
MOST_NESTED = 256
Lines = list[tuple[int, dict[str, Box]]]
SIZES = ((64, 7), (256, 20), (1024, 20))
REPO = Path(__file__).parents[2]


def programs() -> list[tuple[str, Program]]:
    """ACQUIRE and the generated tables."""
    loaded = load([str(REPO / "tables/task/acquire.rcs")])
    acquire = resolve(loaded.roots[0], loaded)
    assert isinstance(acquire, Program)
    made = [("ACQUIRE", acquire)]
    for lines, variables in SIZES:
        program = compile_text(families.box(lines, variables, lines + variables), "bench.rcs")
        assert isinstance(program, Program)
        made.append((f"{lines} x {variables}", program))
    return made


def inputs(program: Program, rng: random.Random, count: int = INPUTS) -> list[dict[str, Value]]:
    """Inputs drawn over the whole space."""
    return [
        {v.name: value_of_key(v.type, rng.randint(*key_bounds(v.type))) for v in program.variables}
        for _ in range(count)
    ]


def scan_c(program: Program, name: str) -> str:
    """The paper's way: every line's conditions, counted."""
    text = CText(names_of(program))
    rows = []
    for at, line in enumerate(program.tables[0].lines):
        tests = (
            " && ".join(
                f"({IN_C.code(text.expr(test.condition))})" for test in line.tests if test is not None
            )
            or "true"
        )
        rows.append(f"    if ({tests}) {{ line = {at}; found++; }}")
    none = len(program.tables[0].lines) if program.tables[0].default else -1
    tail = f"    return found == 1 ? line : found == 0 ? {none} : -2;"
    return (
        f"int32_t scan(const {name}_t *s)\n{{\n    int32_t line = -1, found = 0;\n"
        + "\n".join(rows)
        + f"\n{tail}\n}}\n"
    )


def driver_c(program: Program, name: str, function: str, samples: list[dict[str, Value]]) -> str:
    """Calls both on every input and compares them; a scan that gives -3 was not asked for."""
    names = names_of(program)
    sets = "\n".join(
        "    "
        + " ".join(f"s[{at}].{''.join(names.paths[leaf])} = {int(value)};" for leaf, value in sample.items())
        for at, sample in enumerate(samples)
    )
    return (
        f'#include "{name}.h"\n#include <stdio.h>\nint32_t scan(const {name}_t *s);\nstatic {name}_t s[{len(samples)}];\n'
        f"static void fill(void)\n{{\n{sets}\n}}\n"
        f"int main(void)\n{{\n    int bad = 0;\n    fill();\n    for (int i = 0; i < {len(samples)}; i++)\n"
        f"    {{\n        const int32_t right = scan(&s[i]);\n        const int32_t line = {function}(&s[i]);\n"
        f"        bad += right != -3 && right != line;\n    }}\n    return bad != 0;\n}}\n"
    )


def instructions(folder: Path, function: str) -> float:
    """Instructions of one call, by callgrind, the call's own included."""
    out = folder / "callgrind"
    valgrind = shutil.which("valgrind")
    assert valgrind is not None, "valgrind is needed"
    command = [
        valgrind,
        "--tool=callgrind",
        f"--callgrind-out-file={out}",
        f"--toggle-collect={function}",
        str(folder / "run"),
    ]
    subprocess.run(command, check=True, capture_output=True)
    total = re.search(r"^(?:summary|totals): (\d+)", out.read_text(), re.MULTILINE)
    assert total is not None
    return int(total[1]) / INPUTS


def nested_ifs(program: Program) -> str:
    """A Python function that decides by nested ifs and checks nothing: the least that Python can do.

    The cut that leaves fewest lines on both sides together goes first.
    """
    names = names_of(program)
    lines = [
        (at, {str(t.variables[0]): t.box for t in line.tests if t is not None and t.box is not None})
        for at, line in enumerate(program.tables[0].lines)
    ]
    none = len(lines) if program.tables[0].default else -1
    said: list[str] = ["def nested(s):"]

    def side(alive: Lines, name: str, low: int, high: int) -> Lines:
        return [
            (at, boxes)
            for at, boxes in alive
            if name not in boxes or any(a <= high and b >= low for a, b in boxes[name])
        ]

    def grow(alive: Lines, bounds: dict[str, tuple[int, int]], pad: str) -> None:
        open_ = {
            (name, edge)
            for _, boxes in alive
            for name, box in boxes.items()
            for low, high in box
            for edge in (low, high + 1)
            if bounds[name][0] < edge <= bounds[name][1]
        }
        if not open_:
            said.append(f"{pad}return {alive[0][0] if alive else none}")
            return

        def parts(cut: tuple[str, int]) -> tuple[Lines, Lines]:
            name, edge = cut
            low, high = bounds[name]
            return side(alive, name, low, edge - 1), side(alive, name, edge, high)

        def cost(cut: tuple[str, int]) -> tuple[int, int]:
            below, above = parts(cut)
            return len(below) + len(above), abs(len(below) - len(above))

        name, edge = best = min(sorted(open_), key=cost)
        below, above = parts(best)
        said.append(f"{pad}if s.{names.attributes[name]} < {edge}:")
        grow(below, {**bounds, name: (bounds[name][0], edge - 1)}, pad + " ")
        said.append(f"{pad}else:")
        grow(above, {**bounds, name: (edge, bounds[name][1])}, pad + " ")

    grow(lines, {str(v.name): key_bounds(v.type) for v in program.variables}, " ")
    return "\n".join(said)


TIMED = """#include "{name}.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#define N 16384u
#define DRAWN {drawn}u
static const int32_t values[DRAWN][{leaves}] = {{ {values} }};
static {name}_t s[DRAWN], in[N];
static int32_t out[N];
static int32_t empty(const {name}_t *at) {{ (void)at; return 0; }}
static int32_t (*volatile match)(const {name}_t *at);
static double elapsed(struct timespec a) {{
    struct timespec b; clock_gettime(CLOCK_MONOTONIC, &b);
    return ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / N;
}}
static double calls(void) {{
    int32_t (*one)(const {name}_t *at) = match; double best = 1e9;
    for (int r = 0; r < 40; r++) {{
        struct timespec a; clock_gettime(CLOCK_MONOTONIC, &a);
        for (uint32_t i = 0; i < N; i++) out[i] = one(&in[i]);
        double t = elapsed(a); if (t < best) best = t;
    }}
    return best;
}}
int main(void) {{
    double batch = 1e9; uint32_t now = 0;
    for (uint32_t i = 0; i < DRAWN; i++) {{ const int32_t *v = values[i]; {sets} }}
    for (uint32_t i = 0; i < N; i++) in[i] = s[rand() % DRAWN];
    for (int r = 0; r < 40; r++) {{
        struct timespec a; clock_gettime(CLOCK_MONOTONIC, &a);
        {function}s(in, out, N);
        double t = elapsed(a); if (t < batch) batch = t;
    }}
    match = empty; double alone = calls();
    match = {function}; double any = calls();
    for (uint32_t i = 0; i < N; i++) {{ if (rand() % 100 >= 95) now = rand() % DRAWN; in[i] = s[now]; }}
    printf("%f %f %f %f", batch, any, calls(), alone);
    return out[7] < -2;
}}
"""


@dataclass(frozen=True, slots=True)
class Timed:
    """Nanoseconds in C.

    Attributes:
        batch: Of a row of the batch entry.
        random: Of a call, one input after another.
        steady: Of a call, where most inputs repeat the one before.
        empty: Of a call that does nothing.
    """

    batch: float
    random: float
    steady: float
    empty: float


def c_ns(folder: Path, program: Program, name: str) -> Timed:
    """Nanoseconds of the emitted C, the least of some rounds."""
    names = names_of(program)
    function = f"{name}_{names.tables[program.tables[0].name]}_line"
    samples = inputs(program, random.Random(11), DRAWN)
    leaves = [str(v.name) for v in program.variables]
    rows = ("{" + ",".join(str(int(sample[leaf])) for leaf in leaves) + "}" for sample in samples)
    sets = " ".join(f"s[i].{''.join(names.paths[leaf])} = v[{at}];" for at, leaf in enumerate(leaves))
    text = TIMED.format(
        name=name, function=function, drawn=DRAWN, leaves=len(leaves), values=", ".join(rows), sets=sets
    )
    (folder / "timed.c").write_text(text)
    compiler = shutil.which("cc") or "cc"
    flags = ("-std=gnu11", "-O2", "-w")
    subprocess.run([compiler, *flags, "-o", "timed", "timed.c", f"{name}.c"], cwd=folder, check=True)
    told = subprocess.run([str(folder / "timed")], check=True, capture_output=True, text=True).stdout
    return Timed(*map(float, told.split()))


def python_ns(
    files: dict[str, str], program: Program, samples: list[dict[str, Value]]
) -> tuple[float, float | None]:
    """Nanoseconds of one match in Python, ours and by nested ifs."""
    names = names_of(program)
    module: dict[str, object] = {"__name__": "bench"}
    [text] = [text for name, text in files.items() if name.endswith(".py")]
    exec(compile(text, "bench", "exec"), module)  # noqa: S102 - generated here
    match = module[f"{names.tables[program.tables[0].name]}_line"]
    states = []
    for sample in samples:
        state = module["State"]()  # type: ignore[operator]  # a class
        for leaf, value in sample.items():
            setattr(state, names.attributes[leaf], value)
        states.append(state)
    nested: Callable[[object], int] | None = None
    if len(program.tables[0].lines) <= MOST_NESTED:
        exec(compile(nested_ifs(program), "nested", "exec"), module)  # noqa: S102 - generated here
        nested = module["nested"]  # type: ignore[assignment]  # a function
        assert nested is not None
        assert all(nested(state) == match(state) for state in states)  # type: ignore[operator]  # a function
    return quickest(match, states), quickest(nested, states) if nested else None  # type: ignore[arg-type]  # a function


def quickest(function: Callable[[object], int], states: list[object]) -> float:
    """Nanoseconds a call, the best of five rounds."""
    best = float("inf")
    for _ in range(5):
        begun = time.perf_counter_ns()
        for _ in range(20):
            for state in states:
                function(state)
        best = min(best, (time.perf_counter_ns() - begun) / (20 * len(states)))
    return best


@dataclass(frozen=True, slots=True)
class Measured:
    """A row.

    Attributes:
        ours: Instructions of a match in C; `scan` of a scan of all lines.
        timed: Nanoseconds in C.
        python_ns: Of a match in Python; `nested_ns` of nested ifs, None where they are too many.
        size: Bytes of the object file.
    """

    label: str
    ours: float
    scan: float
    timed: Timed
    python_ns: float
    nested_ns: float | None
    size: int

    def __str__(self) -> str:
        beside = f"{self.nested_ns:12.0f}" if self.nested_ns else f"{'-':>12}"
        timed = (self.timed.batch, self.timed.random, self.timed.steady, self.timed.empty)
        c = f"{self.label:12}{self.ours:10.1f}{self.scan:12.1f}{''.join(f'{ns:8.1f}' for ns in timed)}"
        return f"{c}{self.python_ns:12.0f}{beside}{self.size / 1024:10.0f}"


def c_counts(
    folder: Path, program: Program, files: dict[str, str], *, beside: bool = True
) -> tuple[float, float, int]:
    """Instructions of a match and of a scan of all lines, and bytes of the object file.

    Args:
        folder: Where they are compiled.
        program: Of one table.
        files: What is emitted of it.
        beside: Whether there is a scan, which the compiler is slow at; if not, its count is 0.
    """
    names, samples = names_of(program), inputs(program, random.Random(7))
    function = f"{names.program}_{names.tables[program.tables[0].name]}_line"
    for name, text in files.items():
        (folder / Path(name).name).write_text(text)
    none = f"int32_t scan(const {names.program}_t *s) {{ (void)s; return -3; }}\n"
    scan = scan_c(program, names.program) if beside else none
    (folder / "scan.c").write_text(f'#include "{names.program}.h"\n{scan}')
    (folder / "driver.c").write_text(driver_c(program, names.program, function, samples))
    compiler = shutil.which("cc") or "cc"
    sources = {f"{names.program}.c": "-O2", "scan.c": "-O1", "driver.c": "-O0"}  # the driver is not counted
    for source, flag in sources.items():
        subprocess.run([compiler, "-std=c99", flag, "-c", source], cwd=folder, check=True)
    objects = [f"{names.program}.o", "driver.o", "scan.o"]
    subprocess.run([compiler, "-o", "run", *objects], cwd=folder, check=True)
    size = (folder / f"{names.program}.o").stat().st_size
    return instructions(folder, function), instructions(folder, "scan") if beside else 0.0, size


def measured(label: str, program: Program) -> Measured:
    """Measure one table."""
    if label == "ACQUIRE":
        verdict = prove_program(program, Options())
        assert verdict.proved is not None
        plan = lower(verdict.proved)
    else:
        plan = lower(ProvedProgram(program, seal_of_proof()))  # right by construction; `proofs` proves them
    files = emitted(plan)
    with tempfile.TemporaryDirectory() as scratch:
        ours, scan, size = c_counts(Path(scratch), program, files)
        timed = c_ns(Path(scratch), program, names_of(program).program)
    python, nested = python_ns(files, program, inputs(program, random.Random(7)))
    return Measured(label, ours, scan, timed, python, nested, size)


def main() -> None:
    """Prints the table."""
    heads = [
        ("table", -12),
        ("masks", 10),
        ("scan", 12),
        ("batch", 8),
        ("random", 8),
        ("steady", 8),
        ("empty", 8),
    ]
    heads += [("Python ns", 12), ("nested ifs", 12), ("C KiB", 10)]
    row = "".join(word.ljust(-width) if width < 0 else word.rjust(width) for word, width in heads)
    print(f"{row}   masks, scan: instructions a match, -O2, by callgrind; else nanoseconds")
    for label, program in programs():
        print(measured(label, program), flush=True)


if __name__ == "__main__":
    main()
