"""What a match costs: instructions of the C matcher by callgrind: `python -m tests.bench.executors`.

Tables of `families.box` by size, and ACQUIRE. Beside them a scan of all lines that counts how many match. The counts hold
for the compiler and flags at hand; the fuller the inputs' variety the fairer, so inputs are drawn over the whole space.
"""

import random
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from rcsc.code.emit import emitted
from rcsc.code.emit.c.ctext import CText
from rcsc.code.emit.code_tree import IN_C
from rcsc.code.emit.identifiers import names_of
from rcsc.code.emit.lower import lower
from rcsc.lang.model import Program, ProvedProgram, Value, key_bounds, seal_of_proof, value_of_key
from rcsc.lang.project import load
from rcsc.lang.resolve import compile_text, resolve
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests.bench.made import families

INPUTS = 512
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


@dataclass(frozen=True, slots=True)
class Measured:
    """A row.

    Attributes:
        ours: Instructions of a match in C; `scan` of a scan of all lines.
        size: Bytes of the object file.
    """

    label: str
    ours: float
    scan: float
    size: int

    def __str__(self) -> str:
        return f"{self.label:12}{self.ours:10.1f}{self.scan:12.1f}{self.size / 1024:10.0f}"


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
    if label == "ACQUIRE":
        verdict = prove_program(program, Options())
        assert verdict.proved is not None
        plan = lower(verdict.proved)
    else:
        plan = lower(ProvedProgram(program, seal_of_proof()))  # right by construction; `proofs` proves them
    with tempfile.TemporaryDirectory() as scratch:
        return Measured(label, *c_counts(Path(scratch), program, emitted(plan, ("c",))))


def main() -> None:
    print(f"{'table':12}{'masks':>10}{'scan':>12}{'C KiB':>10}   instructions a match, -O2, by callgrind")
    for label, program in programs():
        print(measured(label, program), flush=True)


if __name__ == "__main__":
    main()
