"""Interpreter = Python = C, over drawn inputs and sequences of cycles; each difference is found once planted."""

import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from rcsc.base.host.tools import Absent, BuildFailed, c_compiler
from rcsc.code.emit.generated import write
from rcsc.code.testing.agree import (
    AgreementCount,
    Disagreement,
    Executors,
    run_init,
    run_sanitized,
    search_lines,
    search_sessions,
)
from rcsc.code.testing.esbmc import EsbmcAnswer, prove_function
from rcsc.code.testing.executors.externs import python_stand_ins, with_c_stand_ins
from rcsc.code.testing.executors.native import Native, build
from rcsc.code.testing.executors.python import python_executor
from rcsc.code.testing.executors.sessions import Seen, same_value
from rcsc.code.testing.executors.symbols import symbols_of
from rcsc.code.testing.executors.targets import is_matcher, targets
from rcsc.code.testing.suite import SuiteOptions, run_suite
from rcsc.lang.interpret import Fault, admit, call, initial, run_table, settle, unfit
from rcsc.lang.model import Admit, Kind, Program, Real, Snapshot, Value, Variable, key_bounds
from rcsc.run.executors import CExecutor, PythonExecutor
from rcsc.run.executors import build as build_executors
from rcsc.run.signature import signature
from tests.support.programs.examples import (
    EXTERN,
    FAULTED,
    LASTING,
    LOOKING_BACK,
    RELATED,
    RICH,
    SHIPPED,
    STOPS,
    WIDE,
)
from tests.support.programs.stages import emitted, program_of, proved_of, shipped, verdict_of

pytestmark = pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")

QUICK = SuiteOptions(examples=30, esbmc_s=0.0, cortex=False, mutants=0)
Change = Callable[[str], str]
Everything = tuple[list[Disagreement], AgreementCount, Absent | BuildFailed | Disagreement | None]
"""What was found, what was compared, what the sanitizers say."""


def unchanged(text: str) -> str:
    return text


@contextmanager
def executors_of(
    program: Program, c: Change = unchanged, python: Change = unchanged, checked: bool = False
) -> Iterator[Executors]:
    """Every executor of the program, with planted changes of the emitted texts."""
    change = {".c": c, ".py": python}
    files = {path: change.get(Path(path).suffix, unchanged)(text) for path, text in emitted(program).items()}
    symbols = symbols_of(program, files)
    with python_stand_ins(program) as stand_ins:
        files = with_c_stand_ins(program, stand_ins.program, symbols, files)
        native = build(stand_ins.program, symbols, files, checked=checked)
        assert isinstance(native, Native), native
        with native:
            python_side = python_executor(program, symbols, files, stand_ins)
            yield Executors(stand_ins.program, native, python_side, tuple(targets(program, symbols)))


def found_of(
    executors: Executors, compared: AgreementCount, examples: int, kind: str = ""
) -> Iterator[Disagreement]:
    """What the executors' functions (of one kind, or all) do otherwise on drawn inputs."""
    for target in executors.targets:
        if kind not in ("", target.kind):
            continue
        if target.kind == "init":
            one = run_init(executors, target)
        elif is_matcher(target):
            one = search_lines(executors, target, compared, examples)
        else:
            one = search_sessions(executors, target, compared, examples)
        yield from (one,) if one else ()


def disagreements(program: Program, c: Change = unchanged, examples: int = 60) -> Everything:
    """All that is found, and what the sanitizers say."""
    compared = AgreementCount()
    with executors_of(program, c, checked=True) as executors:
        found = list(found_of(executors, compared, examples))
        return found, compared, run_sanitized(executors, compared)


def first(
    text: str, kind: str = "step", c: Change = unchanged, python: Change = unchanged
) -> Disagreement | None:
    """What is found first in the functions of a kind."""
    with executors_of(program_of(text), c, python) as executors:
        return next(found_of(executors, AgreementCount(), 300, kind), None)


@pytest.fixture(scope="module")
def rich() -> Everything:
    return disagreements(program_of(RICH), examples=150)


@pytest.fixture(scope="module")
def extern() -> Everything:
    return disagreements(program_of(EXTERN))


@pytest.mark.parametrize("name", ["rich", "extern"])
def test_all_executors_agree(name: str, request: pytest.FixtureRequest) -> None:
    found, compared, sanitized = request.getfixturevalue(name)
    program = program_of({"rich": RICH, "extern": EXTERN}[name])
    assert found == []
    assert sanitized is None
    assert compared.cycles > 200
    for table in program.tables:
        names = {str(line.name) for line in table.lines}
        assert set(compared.lines[table.name]) >= names, "not every line was taken"


def test_all_executors_look_back_alike() -> None:
    found, compared, sanitized = disagreements(program_of(LOOKING_BACK))
    assert (found, sanitized) == ([], None)
    assert set(compared.lines["t"]) >= {"rise", "fall", "stay", "on_", "off"}
    assert min(compared.faults[fault] for fault in (Fault.OK, Fault.ADMIT, Fault.NO_LINE)) > 10


def test_all_executors_count_alike_how_long_conditions_hold() -> None:
    found, compared, sanitized = disagreements(program_of(LASTING))
    assert (found, sanitized) == ([], None)
    assert set(compared.lines["watch"]) >= {"long", "some", "short", "off"}


@pytest.mark.parametrize("text", [RELATED, WIDE])
def test_executors_agree_where_the_c_says_what_was_proved(text: str) -> None:
    """What keeps a number where a proof has it changes none: on lines that the prover's own inputs take, too."""
    found, compared, sanitized = disagreements(proved_of(text))
    assert found == []
    assert sanitized is None
    assert compared.lines["t"]["1"] > 3


def test_faults_of_every_kind_are_met(rich: Everything, extern: Everything) -> None:
    assert rich[1].faults[1] > 10
    assert extern[1].faults[4] > 10


def broken(compared: AgreementCount) -> int:
    """How many cycles had an assumption that is checked and failed."""
    return sum(bool(seen.failed) for *_, expected in compared.kept for seen in expected)


def test_all_executors_stop_where_safety_rests_on_an_assumption_that_fails() -> None:
    program = proved_of(STOPS)
    assert [table.stops for table in program.tables] == [("place", "some"), ("some", "low")]
    found, compared, sanitized = disagreements(program)
    assert (found, sanitized) == ([], None)
    told = broken(compared) - compared.faults[Fault.ASSUMPTION]
    assert min(told, compared.faults[Fault.ASSUMPTION], compared.faults[Fault.OK]) > 10
    assert compared.faults.keys() == {Fault.OK, Fault.ADMIT, Fault.ASSUMPTION}


def test_what_a_cycle_that_ends_in_a_fault_leaves() -> None:
    """The manual's "What a fault leaves", of every executor: they leave the same."""
    program = verdict_of(FAULTED).program
    compared = AgreementCount()
    with executors_of(program) as executors:
        assert list(found_of(executors, compared, 120)) == []
        kinds = {executors.number(target): target.kind for target in executors.targets}
    met: Counter[tuple[str, int]] = Counter()
    for number, _, session, seen in compared.kept:
        state = session.start
        for readings, after in zip(session.readings, seen, strict=True):
            left_as_stated(program, kinds[number] == "cycle", {**state, **readings}, after)
            met[kinds[number], after.fault] += 1
            state = after.snapshot
    assert all(met[kind, fault] > 3 for kind in ("step", "cycle") for fault in Fault if fault <= 5), met


SAFE = {"hold": True, "pull": 0.5, "pace": 1, "wide": 2**64 - 1}


def left_as_stated(program: Program, level: bool, before: Snapshot, after: Seen) -> None:
    """What holds after a cycle of `FAULTED`."""
    shown = {} if after.fault == Fault.OK else SAFE
    left = {name: value for name, value in after.snapshot.items() if name not in shown}
    assert {name: after.snapshot[name] for name in shown} == shown
    assert unfit(program, after.snapshot) == ""
    if after.fault == Fault.ADMIT:  # nothing has changed
        same = {name: before[name] for name in left}
        assert (after.fault_at, after.line) == ("a", -1) or after.fault_at in ("b", "x")
    else:
        came = admit(program, before)
        assert isinstance(came, dict)
        settle(program, came)
        if level:
            call(program, "first", [], came)
        same = {name: came[name] for name in left}
    if after.fault == Fault.EXTERN:  # what ran before is kept, what comes after has not run
        same |= {f"seen[{before['a']}]": 9, "phase.next": before["a"], "given": after.snapshot["given"]}
        assert after.line in (0, 1)
        assert after.fault_at in ("given", "pull")
    elif after.fault == Fault.OK:
        return
    else:
        assert after.line == -1
    if after.fault == Fault.ASSUMPTION:
        assert (after.fault_at, after.failed) == ("place", ("place",))
    assert all(same_value(left[name], same[name]) for name in left), (after, same)


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
    assert broken(compared) > 2


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
    "admission of an integer": ("< (-INT64_C(3000000000))", "< (-INT64_C(3000000009))", "step"),
    "clamp": ("s->width = 100u;", "s->width = 99u;", "step"),
    "array element": ("s->kept[s->at] = 0u;", "s->kept[0] = 0u;", "step"),
    "deferral": ("s->phase = s->phase_next;", ";", "step"),
    "monitor": ("((uint32_t)1u << ", "((uint32_t)2u << ", "step"),
    "initial value": ("    s->count = 0u;\n", "    s->count = 1u;\n", "init"),
    "division": ("/ INT64_C(7)", "/ INT64_C(70000)", "cycle"),
}


@pytest.mark.parametrize("fault", list(C_FAULTS))
def test_a_fault_in_the_c_is_found(fault: str) -> None:
    old, new, kind = C_FAULTS[fault]
    found = first(RICH, kind, c=swap(old, new))
    assert found is not None
    assert found.executor == "C"
    if fault == "clamp":  # what is found is small
        assert found.function.endswith("work_step")
        assert found.cycle == len(found.session.readings) == 1
        assert "`width` = 99 where 100 is right" in found.words


PYTHON_FAULTS = {
    "clamp": ("= 100\n", "= 99\n"),
    "deferral": ("s.phase = s.phase_next", "pass"),
    "arithmetic": ("* 0.5", "* 0.25"),
}


@pytest.mark.parametrize("fault", list(PYTHON_FAULTS))
def test_a_fault_in_the_python_is_found(fault: str) -> None:
    found = first(RICH, python=swap(*PYTHON_FAULTS[fault]))
    assert found is not None
    assert found.executor == "Python"


def test_the_sign_of_zero_is_compared() -> None:
    found = first(RICH, c=swap(" + 0.0;", ";"))
    assert found is not None
    assert any("smooth" in word or "force" in word for word in found.words)


def test_undefined_behaviour_is_found_though_the_result_is_right() -> None:
    planted = swap(
        "    s->fault = CASE__FAULT_NONE;\n",
        "    s->fault = CASE__FAULT_NONE;\n    { volatile int n = 2147483647; n = n + 1; }\n",
    )
    compared = AgreementCount()
    with executors_of(program_of(RICH), planted, checked=True) as executors:
        assert list(found_of(executors, compared, 10, "step")) == []
        sanitized = run_sanitized(executors, compared)
    assert isinstance(sanitized, BuildFailed)
    assert "signed integer overflow" in sanitized.text


def test_an_extern_result_outside_its_range_is_refused_by_all(extern: Everything) -> None:
    assert extern[0] == []
    assert extern[1].faults[0] > 0
    unchecked = first(EXTERN, c=swap("s->fault = CASE__FAULT_EXTERN;", "s->fault = CASE__FAULT_NONE;"))
    assert unchecked is not None
    assert unchecked.executor == "C"


FROM_OUTSIDE = """
enum light { red, green, blue }
input digit : int 0 .. 9
input pulled : int 0 .. 9 clamp
input wide : int -9223372036854775808 .. 9223372036854775807
input high : int 0 .. 18446744073709551615 clamp
input lamp : light
input seen : bool
input x : real -2.0 .. 1e17
input y : real -2.0 .. 2.0 clamp
state digit_kept : int 0 .. 9
state wide_kept : int -9223372036854775808 .. 9223372036854775807
state lamp_kept : light
state seen_kept : bool
state x_kept : real -2.0 .. 1e17
extern procedure ask writes digit_kept, wide_kept, lamp_kept, seen_kept, x_kept python "outside_of_it:ask" c "ask"
table t {
  | line | when || procedures |
  | a    | true || ask        |
}
"""
VALUES_FROM_OUTSIDE: tuple[Any, ...] = (
    *(0, 1, 3, -1, 2**53 + 1, 2**63, 2**64 - 1, 2**64, 10**400, True, False, 0.0, -0.0, 2.0, 2.5, 0.5, 1e-9, 1e16, 1e300),
    *(math.nan, math.inf, -math.inf, Fraction(1, 3), Fraction(1, 2), Fraction(4), Decimal("0.1"), Decimal(3), Decimal("NaN")),
    *(np.uint8(200), np.int64(3), np.float32(0.1), np.float32(2.5), np.float64(1.5), np.float64("nan"), np.bool_(True)),
    *("3", "", None, b"3", 3j, (), [3], object),
)  # fmt: skip


def meant_by(variable: Variable, given: Any) -> Value | None:
    """The value of the variable's type that was given; None where it has to be refused."""
    plain: Any = given.item() if isinstance(given, np.generic) else given
    kind = variable.type
    low, high = (kind.low, kind.high) if isinstance(kind, Real) else key_bounds(kind)
    exact: Any
    if isinstance(plain, float) and math.isinf(plain) and isinstance(kind, Real):
        exact = plain
    elif isinstance(plain, int | float | Fraction | Decimal) and plain - plain == 0:  # type: ignore[operator]  # one at a time
        exact = Fraction(plain)
        if not isinstance(kind, Real) and exact.denominator != 1:
            return None
        if isinstance(kind, Real) and (abs(exact) > 10**308 or Fraction(float(exact)) != exact):
            return None
    else:
        return None
    if not low <= exact <= high:
        return None if variable.admit is Admit.REJECT else low if exact < low else high
    return float(exact) if isinstance(kind, Real) else int(exact)


@pytest.mark.parametrize("given", VALUES_FROM_OUTSIDE, ids=repr)
def test_what_comes_from_outside_is_a_value_of_its_type_or_refused(
    given: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = program_of(FROM_OUTSIDE)
    user: Any = ModuleType("outside_of_it")
    monkeypatch.setitem(sys.modules, "outside_of_it", user)
    files, module = emitted(program), ModuleType("outside_made")
    exec(files[next(name for name in files if name.endswith(".py"))], module.__dict__)  # noqa: S102 - its own
    written = program.procedures[0].writes
    for at, variable in enumerate(program.variables):
        name, state = str(variable.name), module.__dict__["State"]()
        start: dict[str, Any] = initial(program)
        answers = tuple(given if one == name else start[one] for one in written)
        user.ask = lambda answers=answers: answers
        if variable.kind is Kind.INPUT:
            start[name] = given
            setattr(state, name, given)
        right = run_table(program, program.tables[0], start)
        fault = module.__dict__["t_step"](state)
        value, refused = meant_by(variable, given), Fault.ADMIT if name not in written else Fault.EXTERN
        expected: Any = value if value is not None else start[name]
        for found, of in ((right.snapshot[name], "interpreter"), (getattr(state, name), "Python")):
            assert found is expected or (found == expected and type(found) in (int, bool, float)), (name, of)
            if value is not None:
                assert isinstance(found, float if isinstance(variable.type, Real) else int), (name, of)
        assert right.fault == fault == (refused if value is None else Fault.OK), name
        if value is None:
            assert (right.fault_at, state.fault_at) == (name, at)


SINGLE = """
input part : int 0 .. 3
state height_mm : real 0.0 .. 100.0
output o : bool
extern procedure look_up reads part writes height_mm python "{python}" c "{c}"
table t {{
  | line | part   || procedures | o     |
  | a    | 0 .. 1 || look_up    | true  |
  | b    | 2 .. 3 || look_up    | false |
}}
level l {{ period 40
  table t }}
"""
USERS = (("os:_exit", "exit"), ("math:floor", "memcpy"), ("a.b:c", "abort"))


@pytest.mark.parametrize(("python", "c"), USERS)
def test_nothing_of_the_users_is_called(python: str, c: str) -> None:
    """Names of libraries, too, are only names: what they stand for would end this process, or is not there."""
    import os

    kept = os._exit
    result = run_suite(program := program_of(SINGLE.format(python=python, c=c)), emitted(program), QUICK)
    assert result.diagnostics == ()
    assert result.programs[0].faults[4] > 0
    assert result.programs[0].tables[0].cells > 0
    assert os._exit is kept


CALLS = """
input part : int 0 .. 3
state n : int 0 .. 3
extern procedure pong(k : int 0 .. 31) reads part, n writes n python "a.b:other" c "other"
procedure twice {{ pong(2); for i in 0 .. {last} {{ pong(i) }} }}
table t {{
  | line | part   || procedures |
  | a    | 0 .. 1 || twice      |
  | b    | 2 .. 3 || pong(1)    |
}}
"""


@pytest.mark.parametrize(
    ("last", "old", "new", "said"),
    [
        (2, "", "", EsbmcAnswer.PROVED),
        (2, "do_pong(s, 2u)", "do_pong(s, 3u)", EsbmcAnswer.REFUTED),  # other arguments
        (2, "case__do_pong(s, 2u);", ";", EsbmcAnswer.REFUTED),  # a call less
        (
            2,
            "s->fault = CASE__FAULT_EXTERN;",
            "s->fault = CASE__FAULT_NONE;",
            EsbmcAnswer.REFUTED,
        ),  # what is refused is taken
        (16, "", "", EsbmcAnswer.TOO_LARGE),  # more calls than are recorded: not known, and said so
    ],
)
def test_esbmc_knows_nothing_of_what_an_extern_gives(
    last: int, old: str, new: str, said: EsbmcAnswer
) -> None:
    program = program_of(CALLS.format(last=last))
    files = emitted(program)
    symbols = symbols_of(program, files)
    files = {path: swap(old, new)(text) if path.endswith(".c") else text for path, text in files.items()}
    step = next(target for target in targets(program, symbols) if target.kind == "step")
    assert prove_function(program, symbols, files, step, 30.0).answer is said


QUOTIENT = """
input a : int -9 .. 9
input b : int -9 .. 9
state c : int 0 .. 9 = 1
assume some monitored : b /= 0
output o : bool
invariant counted : c > 0
table t assuming some {
  | line | a / b || o     |
  | lo   | <= 2  || true  |
  | hi   | > 2   || false |
}
table u {
  | line | a / c || o     |
  | lo   | <= 2  || true  |
  | hi   | > 2   || false |
}
"""


def test_conditions_are_tested_only_where_they_are_defined() -> None:
    program = proved_of(QUOTIENT)
    made = run_suite(program, emitted(program), QUICK)
    assert made.diagnostics == ()
