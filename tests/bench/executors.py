"""What a match costs: instructions of the C matcher by callgrind, nanoseconds of the Python one: `python -m tests.bench.executors`.

Tables of `families.box` by size, and ACQUIRE. Beside them, in C: a scan of all lines that counts how many match. The counts hold for
the compiler and flags at hand; the fuller the inputs' variety the fairer, so inputs are drawn over the whole space.
"""

import random
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from rcsc.emit import emit_c, emit_python
from rcsc.emit.ctext import CText
from rcsc.emit.names import names_of
from rcsc.lower import lower
from rcsc.model import Program, ProvedProgram, Value, key_bounds, seal_of_proof, value_of_key
from rcsc.project import load
from rcsc.prove.options import Options
from rcsc.prove.program import prove_program
from rcsc.resolve import compile_text, resolve
from tests.bench import families

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
        tests = " && ".join(text.expr(test.condition) for test in line.tests if test is not None) or "true"
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
        "    " + " ".join(f"s[{at}].{names.paths[leaf]} = {int(value)};" for leaf, value in sample.items())
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


def python_ns(files: dict[str, str], program: Program, samples: list[dict[str, Value]]) -> float:
    """Nanoseconds of one match in Python, the best of five rounds."""
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
    best = float("inf")
    for _ in range(5):
        begun = time.perf_counter_ns()
        for _ in range(20):
            for state in states:
                match(state)  # type: ignore[operator]  # a function
        best = min(best, (time.perf_counter_ns() - begun) / (20 * len(states)))
    return best


def measured(label: str, program: Program) -> str:
    """One row."""
    if label == "ACQUIRE":
        verdict = prove_program(program, Options())
        assert verdict.proved is not None
        plan = lower(verdict.proved)
    else:
        plan = lower(
            ProvedProgram(program, (), seal_of_proof())
        )  # right by construction; `proofs` proves them
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
    return f"{label:12}{ours:10.1f}{scan:12.1f}{python_ns(files, program, samples):12.0f}{size / 1024:10.0f}"


def main() -> None:
    """Prints the table."""
    print(
        f"{'table':12}{'masks':>10}{'scan':>12}{'Python ns':>12}{'C KiB':>10}   instructions a match, -O2, by callgrind"
    )
    for label, program in programs():
        print(measured(label, program), flush=True)


if __name__ == "__main__":
    main()
