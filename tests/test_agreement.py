"""Interpreter = Python = C, over drawn inputs and sequences of cycles; each difference is found once planted."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.emit.write import write
from rcsc.model import Program
from rcsc.system.executors import CExecutor, PythonExecutor
from rcsc.system.executors import build as build_executors
from rcsc.system.signature import signature
from rcsc.testing.agree import (
    Compared,
    Disagreement,
    Executors,
    run_init,
    run_sanitized,
)
from rcsc.testing.externs import c_stand_ins, python_stand_ins
from rcsc.testing.hunt import hunt_lines, hunt_sessions
from rcsc.testing.native import build
from rcsc.testing.python_executor import python_executor
from rcsc.testing.symbols import symbols_of
from rcsc.testing.targets import is_matcher, targets
from rcsc.testing.tools import BuildFailed, c_compiler
from tests.emitted import EXTERN, RICH, SHIPPED, emitted, program_of, shipped

pytestmark = pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")

Change = Callable[[str], str]


def unchanged(text: str) -> str:
    return text


def disagreements(
    program: Program, c: Change = unchanged, python: Change = unchanged, examples: int = 60
) -> tuple[list[Disagreement], Compared, BuildFailed | Disagreement | None]:
    """What every executor function does on drawn inputs, with planted changes of the emitted texts."""
    change = {".c": c, ".py": python}
    files = {path: change.get(Path(path).suffix, unchanged)(text) for path, text in emitted(program).items()}
    symbols = symbols_of(program, files)
    stand_ins = c_stand_ins(program, symbols)
    native = build(program, symbols, {**files, "stand_ins.c": stand_ins} if stand_ins else files)
    assert not isinstance(native, BuildFailed), native.text
    assert not hasattr(native, "reason")
    compared, found = Compared(), []
    with native, python_stand_ins(program):
        executors = Executors(
            program, native, python_executor(program, symbols, files), tuple(targets(program, symbols))
        )
        for target in executors.targets:
            if target.kind == "init":
                one = run_init(executors, target)
            elif is_matcher(target):
                one = hunt_lines(executors, target, compared, examples)
            else:
                one = hunt_sessions(executors, target, compared, examples)
            found += [one] if one else []
        sanitized = run_sanitized(executors, compared)
        assert not hasattr(sanitized, "reason")
    return found, compared, sanitized


@pytest.mark.parametrize("text", [RICH, EXTERN], ids=["rich", "extern"])
def test_all_executors_agree(text: str) -> None:
    program = program_of(text)
    found, compared, sanitized = disagreements(program)
    assert found == []
    assert sanitized is None
    assert compared.cycles > 200
    for table in program.tables:
        names = {str(line.name) for line in table.lines}
        assert set(compared.lines[table.name]) >= names, "not every line was taken"


def test_faults_of_every_kind_are_met() -> None:
    assert disagreements(program_of(RICH))[1].faults[1] > 10
    assert disagreements(program_of(EXTERN))[1].faults[4] > 10


def test_cycles_in_which_an_assumption_fails_are_met() -> None:
    assert disagreements(program_of(RICH), examples=150)[1].broken > 2


@pytest.mark.parametrize("path", SHIPPED)
def test_shipped_executors_agree(path: str, repo: Path) -> None:
    found, _, sanitized = disagreements(shipped(path, repo))
    assert (found, sanitized) == ([], None)


I8, I64, U64 = 2**7, 2**63 - 1, 2**64 - 1
LOOPS = [(I64 - 1, I64), (I64, I64), (U64 - 2, U64), (U64, U64), (-I64 - 1, -I64 + 1), (-I64 - 1, -I64 - 1),
         (I64 - 1, I64 + 2), (I64 + 1, I64 + 1), (-3, -1), (-2, 2), (5, 5), (5, 4), (U64, U64 - 1), (I8 - 2, I8),
         (2**31 - 2, 2**31), (2**32 - 2, 2**32)]  # fmt: skip
LOOPED = """
input go : bool
input stop : int 0 .. 3
output rounds : int 0 .. 99
output low : int -9223372036854775808 .. 9223372036854775807
output high : int 0 .. 18446744073709551615
extern procedure ask reads stop writes low python "answers:ask" c "ask"
{loops}
table t {{ # each line runs all of them, so that their counts add up
  | line | go    || procedures |
  | a    | true  || rounds := 0; {calls} |
  | b    | false || {calls} |
}}
"""


def looped() -> str:
    """A procedure for each of `LOOPS`: plain, around another loop, around a call that may fail; each keeps its counter."""
    made = []
    for at, (low, high) in enumerate(LOOPS):
        kept = "high" if low >= 0 else "low"
        body = f"{kept} := i rounds := (rounds + 1) mod 100"
        made += [
            f"procedure p{at} {{ for i in {low} .. {high} {{ {body} }} for i in {low} .. {high} {{ }} }}",
            f"procedure q{at} {{ for j in {low} .. {high} {{ for i in {low} .. {high} {{ {body} }} }} }}",
            f"procedure r{at} {{ for i in {low} .. {high} {{ {body} ask }} }}",
        ]
    calls = "; ".join(f"{kind}{at}" for at in range(len(LOOPS)) for kind in "pqr")
    return LOOPED.format(loops="\n".join(made), calls=calls)


def test_a_loop_runs_to_the_last_value_of_its_type() -> None:
    found, compared, sanitized = disagreements(program_of(looped()), examples=20)
    assert (found, sanitized) == ([], None)
    assert compared.cycles > 20


MANY = 70
"""More monitored assumptions than one word of the trace holds."""
MONITORED = (
    "input x : int 0 .. 9\n"
    + "".join(f"assume a{at} monitored : x /= {at % 9}\n" for at in range(MANY))
    + f"table t assuming {', '.join(f'a{at}' for at in reversed(range(MANY)))} {{\n| line | x ||\n| l | ||\n}}\n"
    + "level l { period 10 [ms] table t }\n"
)


def test_every_monitored_assumption_has_a_bit_of_its_own() -> None:
    found, compared, sanitized = disagreements(program_of(MONITORED), examples=15)
    assert (found, sanitized) == ([], None)
    assert compared.broken > 2


@pytest.mark.parametrize("kind", ["c", "python"])
def test_a_cell_names_each_failed_assumption(kind: str, tmp_path: Path) -> None:
    write(emitted(program_of(MONITORED)), str(tmp_path))
    [symbols] = (tmp_path / "c").glob("*.json")
    sign = signature(symbols)
    [level] = sign.levels
    made = (
        CExecutor(build_executors(tmp_path, [sign]), sign, level)
        if kind == "c"
        else PythonExecutor(tmp_path, sign, level)
    )
    for x in range(10):
        made.put(0, (x,))
        assert made.cycle() == 0
        values = made.values()
        assert sign.failures(values) == tuple(f"a{at}" for at in range(MANY) if at % 9 == x)
        assert sign.packed.unpack(sign.packed.pack(*values)) == values


def swap(old: str, new: str) -> Change:
    """A change that must change something."""

    def changed(text: str) -> str:
        assert old in text, old
        return text.replace(old, new)

    return changed


C_FAULTS = {
    "admission of an integer": ("< (-INT64_C(3000000000))", "< (-INT64_C(3000000009))"),
    "clamp": ("s->width = (uint8_t)INT64_C(100);", "s->width = (uint8_t)INT64_C(99);"),
    "array element": (
        "s->kept[(int64_t)s->at] = (uint16_t)INT64_C(0);",
        "s->kept[0] = (uint16_t)INT64_C(0);",
    ),
    "deferral": ("s->phase = s->phase_next;", ";"),
    "monitor": ("(UINT64_C(1) << 0u)", "(UINT64_C(1) << 1u)"),
    "initial value": ("    s->count = (uint8_t)INT64_C(0);\n", "    s->count = (uint8_t)INT64_C(1);\n"),
    "division": ("/ INT64_C(7)", "/ INT64_C(70000)"),
}


@pytest.mark.parametrize("fault", list(C_FAULTS))
def test_a_fault_in_the_c_is_found(fault: str) -> None:
    found, _, _ = disagreements(program_of(RICH), c=swap(*C_FAULTS[fault]), examples=300)
    assert {one.executor for one in found} == {"C"}


PYTHON_FAULTS = {
    "clamp": ("= 100\n", "= 99\n"),
    "deferral": ("s.phase = s.phase_next", "pass"),
    "arithmetic": ("* 0.5", "* 0.25"),
}


@pytest.mark.parametrize("fault", list(PYTHON_FAULTS))
def test_a_fault_in_the_python_is_found(fault: str) -> None:
    found, _, _ = disagreements(program_of(RICH), python=swap(*PYTHON_FAULTS[fault]), examples=150)
    assert {one.executor for one in found} == {"Python"}


def test_what_is_found_is_small() -> None:
    found, _, _ = disagreements(program_of(RICH), c=swap(*C_FAULTS["clamp"]), examples=150)
    step = next(one for one in found if one.function.endswith("work_step"))
    assert step.cycle == len(step.session.readings) == 1
    assert "`width` = 99 where 100 is right" in step.words


def test_the_sign_of_zero_is_compared() -> None:
    found, _, _ = disagreements(program_of(RICH), c=swap(" + 0.0;", ";"), examples=300)
    assert any("smooth" in word or "force" in word for one in found for word in one.words)


def test_undefined_behaviour_is_found_though_the_result_is_right() -> None:
    planted = swap(
        "    s->fault = 0;\n", "    s->fault = 0;\n    { volatile int n = 2147483647; n = n + 1; }\n"
    )
    found, _, sanitized = disagreements(program_of(RICH), c=planted)
    assert found == []
    assert isinstance(sanitized, BuildFailed)
    assert "signed integer overflow" in sanitized.text


def test_an_extern_result_outside_its_range_is_refused_by_all() -> None:
    found, compared, _ = disagreements(program_of(EXTERN), examples=120)
    assert found == []
    broken = swap("parts_height(", "(void)s; parts_height(")
    assert disagreements(program_of(EXTERN), c=broken)[0] == []
    unchecked = swap("s->fault = 4;", "s->fault = 0;")
    assert {one.executor for one in disagreements(program_of(EXTERN), c=unchecked)[0]} == {"C"}
    assert compared.faults[0] > 0
