"""Programs with singles: proved in binary32, the same in all executors, and C with no operation on doubles."""

import math
import subprocess
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.host.tools import c_compiler
from rcsc.code.emit.generated import write
from rcsc.code.testing.suite import SuiteOptions, run_suite
from rcsc.lang.interpret import Fault, initial, run_table, unfit
from rcsc.lang.operator_table import single
from rcsc.proof.certify import certify
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.run.executors import CExecutor, PythonExecutor
from rcsc.run.executors import build as build_executors
from rcsc.run.signature import signature
from tests.support.programs.stages import codes, emitted, program_of, refused, verdict_of
from tests.support.programs.texts import edited

pytestmark = pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")

RICH = """
input x : single -3.0e38 .. 3.0e38 clamp
input y : single -1.0e-40 .. 0.1
input r : real -1.0e300 .. 1.0e300
input n : int -9223372036854775808 .. 9223372036854775807
input i : int 0 .. 7
state z : single -3.4e38 .. 3.4e38 = 0.1 deferred until y > 0.05
state many : array[8] of single 0.0 .. 1.0e10
output w : single 0.0 .. 1.0 safe 0.5
output k : int -9223372036854775808 .. 9223372036854775807
const turn = 6.283185307179586
invariant low : z <= 3.4e38
set near : single -1.0 .. 1.0 = {0.1, 0.25 .. 0.5}
procedure scaled(by : single 0.0 .. 1.0) {
  local half : single 0.0 .. 1.0 := by / 2.0
  w := min(abs(y / 0.3) * half, 1.0)
  many[i] := max(min(single(n), 1.0e10), 0.0)
}
table t {
  | line | x * 2.0 > y | y           | single(r) < x || procedures                             |
  |------|-------------|-------------|---------------||----------------------------------------|
  | a    | true        | in near     | true          || next z := min(max(x * y, -1.0), 1.0)   |
  | b    | true        | not in near | true          || scaled(0.7)                            |
  | c    | true        |             | false         || k := int(min(max(x, -9.0e18), 9.0e18)) |
  | d    | false       |             |               || next z := min(-y * turn, 3.0)          |
}
"""
ONLY_SINGLES = edited(RICH, ("input r : real -1.0e300 .. 1.0e300\n", ""), ("single(r) < x", "0.5 < x"))
WARNINGS = "-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Werror"


def test_all_executors_agree_in_singles() -> None:
    program = program_of(RICH)
    options = SuiteOptions(examples=60, esbmc_s=0.0, cortex=False, mutants=0)
    assert run_suite(program, emitted(program), options).diagnostics == ()


def test_a_certificate_of_singles_is_whole() -> None:
    program = program_of(RICH)
    certificate = prove_program(program, Options()).certificate
    assert certificate is not None
    found = certify(program, certificate)
    assert found.problems == ()
    assert "table `t`: exactly one line matches" in found.checked


@pytest.mark.parametrize(("text", "doubles"), [(RICH, True), (ONLY_SINGLES, False)], ids=["both", "singles"])
def test_c_promotes_nothing_to_double(text: str, doubles: bool, tmp_path: Path) -> None:
    write(emitted(program_of(text)), str(tmp_path))
    [source] = (tmp_path / "c").glob("*.c")
    command = [
        str(c_compiler()), "-std=c99", *WARNINGS.split(), "-c", str(source), "-o", str(tmp_path / "out.o"),
    ]  # fmt: skip
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    assert ("double" in source.read_text()) == doubles


NARROW = """
input x : single 0.5 .. 1.0 = 0.5
output o : bool
table t {
  | line | when          || o     |
  | more | x + TINY > x  || true  |
  | same | x + TINY <= x || false |
}
"""


@pytest.mark.parametrize(
    ("tiny", "word", "dead"),
    [("2e-8", "single", ["more"]), ("4e-8", "single", []), ("2e-8", "real", ["same"])],
)
def test_what_is_proved_is_proved_in_binary32(tiny: str, word: str, dead: list[str]) -> None:
    """What is below half of a single's last digit, from 0.5 to 1 that is 2^-25, is lost; of a double it is not.

    Z3 takes 0.4 to 2 million steps and more of a double, as the process has named its terms; one such question gets a tenth of them.
    """
    program = program_of(edited(NARROW.replace("TINY", tiny), ("single", word)))
    found = prove_program(program, Options(steps=400_000_000)).findings
    assert {finding.code for finding in found} <= {Code.DEAD_LINE}
    assert [name for name in ("more", "same") for finding in found if f"`{name}`" in finding.message] == dead


COUNTED = "state c : single 0.0 .. HIGH\ntable t {\n| line | c || c |\n| a | >= 0.0 || c + 1.0 |\n}\n"


@pytest.mark.parametrize(
    ("word", "high", "proved"),
    [("single", "16777216.0", True), ("single", "16777214.0", False), ("real", "16777216.0", False)],
)
def test_a_sum_that_is_lost_stands_still(word: str, high: str, proved: bool) -> None:
    """A single is 2^24 after one more is added to it."""
    assert (verdict_of(edited(COUNTED, ("single", word), ("HIGH", high))).proved is not None) == proved


READING = """
input x : single 0.0 .. 0.1
state y : single 0.0 .. 0.1
table t {
  | line | x      || y |
  | a    | >= 0.0 || x |
}
level l {
  period 10 [ms]
  table t
}
"""
BOUND = single(0.1)
"""The end of the range, which is greater than 0.1."""


@pytest.mark.parametrize("kind", ["c", "python"])
def test_a_reading_is_rounded_before_its_range_is_looked_at(kind: str, tmp_path: Path) -> None:
    program = program_of(READING)
    write(emitted(program), str(tmp_path))
    [symbols] = (tmp_path / "c").glob("*.json")
    sign = signature(symbols)
    [level] = sign.levels
    executor = (
        CExecutor(build_executors(tmp_path, [sign]), sign, level)
        if kind == "c"
        else PythonExecutor(tmp_path, sign, level)
    )
    for value in (0.1, BOUND, math.nextafter(BOUND, 1.0), 0.0, -1e-50, BOUND + 1e-8, -1e-45, math.nan):
        executor.put(0, (value,))
        meant = run_table(program, program.tables[0], {**initial(program), "x": value})
        fault = executor.cycle()
        assert fault == meant.fault == (0 if 0.0 <= single(value) <= BOUND else Fault.ADMIT), value
        shown = meant.snapshot["x"], meant.snapshot["y"]
        assert fault or executor.values()[:2] == shown == (single(value) + 0.0,) * 2


def module_of(text: str) -> dict[str, Any]:
    """The names of the Python module that is made of a text."""
    names: dict[str, Any] = {}
    [module] = [made for path, made in emitted(program_of(text)).items() if path.endswith(".py")]
    exec(compile(module, "emitted", "exec"), names)  # noqa: S102 - our own text
    return names


def test_a_state_from_outside_has_to_be_a_single() -> None:
    names, program = module_of(READING), program_of(READING)
    state = names["State"]()
    for value, right in ((0.1, False), (BOUND, True), (0.0, True), (math.nan, False)):
        state.y = value
        assert (names["check"](state) == -1) == right
        assert (unfit(program, {"x": 0.0, "y": value}) == "") == right


CONVERTED = """
input n : int -9223372036854775808 .. 9223372036854775807
state z : single -1.0e19 .. 1.0e19
table t {
  | line | n    || z         |
  | a    | >= 0 || single(n) |
  | b    | < 0  || single(n) |
}
"""


def test_a_whole_number_that_no_double_holds_is_rounded_once(tmp_path: Path) -> None:
    """Ties of singles, and what decides them up to 63 bits away; C converts in one step, Python in two."""
    names = module_of(CONVERTED)
    random = Random(3)  # noqa: S311 - repeatable on purpose
    edges = [(2**24 + 1 << shift) + by for shift, by in product(range(39), (-1, 0, 1))]
    numbers = [
        sign * one for one in (*edges, *(random.getrandbits(63) for _ in range(60))) for sign in (1, -1)
    ]
    source = tmp_path / "round.c"
    rows = ", ".join(f"INT64_C({number})" for number in numbers)
    source.write_text(
        "#include <stdint.h>\n#include <stdio.h>\nint main(void) {\n"
        f"static const int64_t n[] = {{ {rows} }};\n"
        'for (unsigned i = 0; i < sizeof n / sizeof n[0]; i++) { printf("%a\\n", (double)(float)n[i]); }\n}\n'
    )
    subprocess.run([str(c_compiler()), "-O0", source, "-o", tmp_path / "round"], check=True)
    in_c = subprocess.run([tmp_path / "round"], capture_output=True, text=True, check=True).stdout.split()
    for number, text in zip(numbers, in_c, strict=True):
        state = names["State"]()
        state.n = number
        assert names["t_step"](state) == 0
        assert state.z == single(number) == float.fromhex(text), number


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("z := r", Code.KIND, "`z` is single, this is `r`, which is real"),
        ("z := n", Code.KIND, "`z` is single, this is `n`, which is int"),
        (
            "z := x + r",
            Code.KIND,
            "the left side is `x`, which is single; the right side is `r`, which is real",
        ),
        ("z := real(x)", Code.KIND, "`z` is single, this is an expression, which is real"),
        ("z := single(x)", Code.KIND, "`single` converts a whole number or a real number"),
        ("q := real(r)", Code.KIND, "`real` converts a whole number or a single"),
        ("z := 2.5", Code.OUT_OF_RANGE_CONSTANT, "2.5 is not in 0.0 .. 2.0"),
        ("z := x + 1e39", Code.NOT_FINITE, "`1e+39` is larger than every single"),
        ("z := single(1e39)", Code.NOT_FINITE, "this constant is larger than every single"),
        ("z := min(x, 0.1) z := max(0.100000001, x)", Code.SAME_DOUBLE, "but the same single, 0.1"),
        ("z := x * 0.1 q := r * 0.100000001", None, ""),
        ("z := x * 0.1 q := real(max(-0.1 + x, 0.0))", None, ""),
    ],
)
def test_what_is_said_of_singles(line: str, code: Code | None, words: str) -> None:
    text = f"""
input x : single 0.0 .. 1.0
input r : real 0.0 .. 1.0
input n : int 0 .. 1
state z : single 0.0 .. 2.0
state q : real 0.0 .. 2.0
procedure p {{ {line} }}
"""
    if code is None:
        program_of(text)
        return
    found = refused(text)
    assert codes(found) == [code.value]
    assert words in found[0].message


def test_single_is_a_name_where_no_range_and_no_parenthesis_follows() -> None:
    program = program_of(
        "enum width { single, double }\nrecord r { single : single 0.0 .. 1.0  other : bool }\ninput a : r\n"
        "state size : width\ntable t {\n| line | size || size |\n| a | single || double |\n| b | double || single |\n}\n"
    )
    assert [str(variable.name) for variable in program.variables] == ["a.single", "a.other", "size"]
