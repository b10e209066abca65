"""Interpreter = Python = C, over drawn inputs and sequences of cycles; each difference is found once planted."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.model import Program
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
