"""What a match costs: instructions of the C matcher by callgrind, nanoseconds of the Python one: `python -m tests.bench.executors`.

Tables of `families.box` by size, and ACQUIRE.
Beside them, in C: a scan of all lines that counts how many match; in Python: nested ifs that check nothing. The counts hold
for the compiler and flags at hand; the fuller the inputs' variety the fairer, so inputs are drawn over the whole space.
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

from rcsc.emit import emit_c, emit_python
from rcsc.emit.c.ctext import CText
from rcsc.emit.code_tree import IN_C
from rcsc.emit.identifiers import names_of
from rcsc.emit.lower import lower
from rcsc.lang.model import Box, Program, ProvedProgram, Value, key_bounds, seal_of_proof, value_of_key
from rcsc.lang.project import load
from rcsc.lang.resolve import compile_text, resolve
from rcsc.solvers.options import Options
from rcsc.table.program import prove_program
from tests.bench import families

INPUTS = 512
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


def inputs(program: Program, rng: random.Random) -> list[dict[str, Value]]:
    """Inputs drawn over the whole space."""
    return [
        {v.name: value_of_key(v.type, rng.randint(*key_bounds(v.type))) for v in program.variables}
        for _ in range(INPUTS)
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
    """Calls both on every input and compares them."""
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
        f"        bad += {function}(&s[i]) != scan(&s[i]);\n    return bad != 0;\n}}\n"
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


def batch_ns(folder: Path, program: Program, name: str, samples: list[dict[str, Value]]) -> float:
    """Nanoseconds a row of the batch entry, over a million rows."""
    names = names_of(program)
    sets = "\n".join(
        "    "
        + " ".join(f"s[{at}].{''.join(names.paths[leaf])} = {int(value)};" for leaf, value in sample.items())
        for at, sample in enumerate(samples)
    )
    table = names.tables[program.tables[0].name]
    (folder / "batch.c").write_text(
        f'#include "{name}.h"\n#include <stdio.h>\n#include <stdlib.h>\n#include <time.h>\n#define N 1000000u\n'
        f"static {name}_t s[{len(samples)}];\nstatic int32_t out[N];\n"
        f"int main(void)\n{{\n    {name}_t *in = malloc(sizeof(*in) * N);\n    double best = 1e9;\n{sets}\n"
        f"    if (!in) return 1;\n    for (uint32_t i = 0; i < N; i++) in[i] = s[(i * 2654435761u) % {len(samples)}u];\n"
        f"    for (int r = 0; r < 7; r++) {{\n        struct timespec a, b; clock_gettime(CLOCK_MONOTONIC, &a);\n"
        f"        {name}_{table}_lines(in, out, N); clock_gettime(CLOCK_MONOTONIC, &b);\n"
        f"        double t = (b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec); if (t < best) best = t;\n    }}\n"
        f'    printf("%f", best / N); free(in); return out[7] < -2;\n}}\n'
    )
    compiler = shutil.which("cc") or "cc"
    subprocess.run(
        [compiler, "-std=gnu11", "-O2", "-o", "batch", "batch.c", f"{name}.c"], cwd=folder, check=True
    )
    return float(subprocess.run([str(folder / "batch")], check=True, capture_output=True, text=True).stdout)


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
        batch_ns: Of a row of the batch entry.
        python_ns: Of a match in Python; `nested_ns` of nested ifs, None where they are too many.
        size: Bytes of the object file.
    """

    label: str
    ours: float
    scan: float
    batch_ns: float
    python_ns: float
    nested_ns: float | None
    size: int

    def __str__(self) -> str:
        beside = f"{self.nested_ns:12.0f}" if self.nested_ns else f"{'-':>12}"
        c = f"{self.label:12}{self.ours:10.1f}{self.scan:12.1f}{self.batch_ns:10.1f}"
        return f"{c}{self.python_ns:12.0f}{beside}{self.size / 1024:10.0f}"


def measured(label: str, program: Program) -> Measured:
    """Measure one table."""
    if label == "ACQUIRE":
        verdict = prove_program(program, Options())
        assert verdict.proved is not None
        plan = lower(verdict.proved)
    else:
        plan = lower(ProvedProgram(program, seal_of_proof()))  # right by construction; `proofs` proves them
    files = {**emit_c(plan), **emit_python(plan)}
    samples = inputs(program, random.Random(7))
    names = names_of(program)
    function = f"{names.program}_{names.tables[program.tables[0].name]}_line"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, text in files.items():
            (folder / Path(name).name).write_text(text)
        (folder / "scan.c").write_text(f'#include "{names.program}.h"\n' + scan_c(program, names.program))
        (folder / "driver.c").write_text(driver_c(program, names.program, function, samples))
        sources = [f"{names.program}.c", "driver.c"]
        compiler = shutil.which("cc") or "cc"
        subprocess.run([compiler, "-std=c99", "-O2", "-c", *sources], cwd=folder, check=True)
        subprocess.run([compiler, "-std=c99", "-O1", "-c", "scan.c"], cwd=folder, check=True)
        subprocess.run(
            [compiler, "-o", "run", f"{names.program}.o", "driver.o", "scan.o"], cwd=folder, check=True
        )
        size = (folder / f"{names.program}.o").stat().st_size
        ours, scan = instructions(folder, function), instructions(folder, "scan")
        batch = batch_ns(folder, program, names.program, samples)
    python, nested = python_ns(files, program, samples)
    return Measured(label, ours, scan, batch, python, nested, size)


def main() -> None:
    """Prints the table."""
    print(
        f"{'table':12}{'masks':>10}{'scan':>12}{'batch ns':>10}{'Python ns':>12}{'nested ifs':>12}{'C KiB':>10}"
        "   masks, scan: instructions a match, -O2, by callgrind"
    )
    for label, program in programs():
        print(measured(label, program), flush=True)


if __name__ == "__main__":
    main()
