"""Mutants of tables and of the C, each noticed or shown equal; what nobody can decide is a figure and no failure."""

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from rcsc.code.testing import suite
from rcsc.code.testing.code_mutants import Judge, Noticed, code_mutants, variants
from rcsc.code.testing.esbmc import EsbmcAnswer, EsbmcVerdict
from rcsc.code.testing.executors.symbols import symbols_of, text_of
from rcsc.code.testing.figures import SuiteResult
from rcsc.code.testing.inputs.snapshot import Missing, search_in
from rcsc.code.testing.inputs.vectors import vectors_of
from rcsc.code.testing.matcher import Checked, MatcherCheck
from rcsc.code.testing.mutants import Caught, Opinion, difference, judge_table, narrower, table_mutants, wider
from rcsc.code.testing.suite import SuiteOptions, run_suite
from rcsc.driver.trials import proofs
from rcsc.front.commands import run
from rcsc.lang.interpret import matching_lines
from rcsc.lang.model import Program, Snapshot, Table, key_bounds, value_of_key
from rcsc.proof.solvers.options import Options
from tests.support.programs.stages import emitted, program_of, shipped

BOXES = proofs(Options(solver="boxes"))
APPROACH = "tables/examples/approach.rcs"
SAMPLE = 100
"""Of the mutants of a shipped table; `rcsc test --mutants -1` judges them all."""


@pytest.mark.parametrize("path", ["tables/task/acquire.rcs", APPROACH])
def test_no_table_mutant_survives(path: str, repo: Path) -> None:
    program = shipped(path, repo)
    assert BOXES.prover is not None
    for table in program.tables:
        judged = judge_table(search_in(program, BOXES.solver), table, BOXES.prover, SAMPLE)
        counts = Counter(mutant.caught for mutant in judged)
        assert counts[Caught.SURVIVED] == 0, [mutant for mutant in judged if mutant.caught is Caught.SURVIVED]
        assert counts[Caught.PROVER] > len(judged) // 2
        assert {mutant.change for mutant in judged} == {"drop", "widen", "narrow", "duplicate", "swap"}


def test_a_prover_that_notices_nothing_lets_mutants_live(repo: Path) -> None:
    program = shipped("tables/task/acquire.rcs", repo)
    table = program.tables[0]
    judged = judge_table(search_in(program), table, lambda _program, _table: Opinion(accepted=True))
    doubled = [mutant for mutant in judged if mutant.change == "duplicate"]
    assert not any(mutant.caught is Caught.PROVER for mutant in judged)
    assert doubled  # without the prover they are told apart by a snapshot
    assert all(mutant.caught is Caught.EXECUTORS for mutant in doubled)


def test_a_difference_is_one_and_no_difference_is_none(repo: Path) -> None:
    program = shipped("tables/examples/acquire_published.rcs", repo)
    table = program.tables[0]
    search = search_in(program)
    for mutant in list(table_mutants(program, table))[::7]:
        found = difference(search, table, mutant)
        assert found is not Missing.UNKNOWN
        if isinstance(found, Missing):
            assert not differs_anywhere(program, table, mutant.table)
        else:
            assert matching_lines(table, found) != matching_lines(mutant.table, found)


def differs_anywhere(program: Program, table: Table, other: Table) -> bool:
    """By trying each leaf at each of its keys, from the initial state."""
    start = {str(v.name): v.initial for v in program.variables}
    for variable in (v for v in program.variables if v.name in table.variables):
        low, high = key_bounds(variable.type)
        for key in range(low, high + 1):
            snapshot = {**start, str(variable.name): value_of_key(variable.type, key)}
            if matching_lines(table, snapshot) != matching_lines(other, snapshot):
                return True
    return False


def test_a_dead_line_may_be_dropped(repo: Path) -> None:
    program = shipped("tables/task/acquire.rcs", repo)
    table = program.tables[0]
    first = table.lines[0]
    never = replace(first, tests=tuple(None if t is None else replace(t, box=()) for t in first.tests))
    with_dead = replace(table, lines=(never, *table.lines[1:]))
    mutant = next(m for m in table_mutants(program, with_dead) if m.change == "drop")
    assert difference(search_in(program), with_dead, mutant) is Missing.NONE


def test_boxes_grow_and_shrink_by_one_key(repo: Path) -> None:
    kind = shipped(APPROACH, repo).variable("tolerance_mm").type
    assert set(wider(((3, 5), (7, 7)), kind)) == {((2, 5), (7, 7)), ((3, 7),), ((3, 5), (7, 8))}
    assert set(narrower(((3, 5), (7, 7)))) == {((4, 5), (7, 7)), ((3, 4), (7, 7)), ((3, 5),)}
    assert list(narrower(((7, 7),))) == []
    assert list(wider((key_bounds(kind),), kind)) == []


# --- mutants of the C ----------------------------------------------------------------------

CLASSED = """
enum mode { idle, up, down }
input now : mode
input offset : int -40 .. 40 clamp
input go : bool
state ticks : int 0 .. 300
output motor : int 0 .. 9
procedure tick { ticks := min(ticks + 1, 300) }
procedure again { ticks := 0 }
table t {
  | line | now  | go    | ticks     | offset   | when             || procedures | motor |
  | a    | idle | false |           |          |                  ||            | 0     |
  | b    | idle | true  | < 20      |          |                  || tick       | 1     |
  | c    | idle | true  | 20 .. 250 |          |                  || tick       | 2     |
  | d    | idle | true  | > 250     |          |                  || again      | 3     |
  | e    | up   |       |           |          | abs(offset) > 5  || tick       | 4     |
  | f    | up   |       | < 200     |          | abs(offset) <= 5 ||            | 5     |
  | g    | up   |       | >= 200    |          | abs(offset) <= 5 || again      | 6     |
  | h    | down |       |           | -40 .. 0 |                  || tick       | 7     |
  | i    | down |       |           | > 0      |                  ||            | 8     |
}
"""
"""A supervisor of the ordinary kind: a counter that is compared in many lines gets a table of 301 classes."""


ENDS_OF_64_BITS = (2**64, 2**63 + 150, 2**63, 2**63 - 7, -(2**63) + 300, 2**32 + 3)
"""Past the last values of inputs: unsigned, over the middle, signed, and low."""


@pytest.mark.parametrize("width", [1, 7, 300])
def test_a_matcher_is_checked_at_the_ends_of_64_bits(width: int) -> None:
    def table(number: int, end: int) -> str:
        odd = ", ".join(f"{n}" for n in range(end - width, end, 2))
        return f"""
input x{number} : int {end - width} .. {end - 1}
table t{number} {{
  | line | x{number} ||
  | odd  | in {{{odd}}} ||
  | even | DEFAULT ||
}}
"""

    program = program_of("".join(map(table, range(len(ENDS_OF_64_BITS)), ENDS_OF_64_BITS)))
    files = emitted(program)
    source = next(text for name, text in files.items() if name.endswith(".c"))
    assert ("classes[" in source) == (width == 300)
    for one in program.tables:
        checked = check_of(program, files, one).of(files)
        assert isinstance(checked, Checked), one.name
        assert not checked.unmatched


@pytest.fixture(scope="module")
def classed() -> tuple[Program, dict[str, str]]:
    program = program_of(CLASSED)
    return program, emitted(program)


def known_of(program: Program, table: Table) -> list[Snapshot]:
    """Inputs that match the lines of a table."""
    return [vector.snapshot for vector in vectors_of(search_in(program, BOXES.solver), table).vectors]


def check_of(program: Program, files: dict[str, str], table: Table) -> MatcherCheck:
    return MatcherCheck(program, symbols_of(program, files), table, known_of(program, table))


def judge_of(program: Program, files: dict[str, str]) -> Judge:
    known = {str(one.name): known_of(program, one) for one in program.tables}
    return Judge(program, symbols_of(program, files), files, Path(), "", b"", 0.0, known)


@pytest.mark.parametrize(("path", "count", "number"), [("", 3000, 24), (APPROACH, 80, 12)])
def test_the_check_of_the_matcher_notices_every_bit_of_a_mask_and_every_class(
    path: str, count: int, number: int, classed: tuple[Program, dict[str, str]], repo: Path
) -> None:
    """Also the bits for truths of conditions that no input has together: most of APPROACH."""
    program = shipped(path, repo) if path else classed[0]
    files, [table] = emitted(program), program.tables
    source = text_of(symbols_of(program, files).source, files)
    assert ("classes[301]" in source) == (not path)
    every = [
        each
        for each in code_mutants(source, len(table.lines))
        if each.change == "mask" and "_bit64" not in each.function
    ]
    assert len(every) >= count
    judge = judge_of(program, files)
    judged = Counter(judge.by_check(each) for each in Random(3).sample(every, number))  # noqa: S311  # repeatable
    assert judged == {Noticed.MATCHER: number}


def test_a_wrong_mask_is_told_by_its_conditions(repo: Path) -> None:
    program = shipped(APPROACH, repo)
    files, [table] = emitted(program), program.tables
    check = check_of(program, files, table)
    assert check.of(files) == Checked(80, ())
    changed = {
        path: text.replace("0x0eu, /* false, true, true, true", "0x0fu, /*") for path, text in files.items()
    }
    conditions = "force_n > limit_n, force_n <= limit_n, distance_mm - tolerance_mm <= 0, distance_mm - tolerance_mm > 0"
    told = f"for {conditions}: false, true, true, true the C has the mask 0xf, the table 0xe"
    assert check.of(changed) == (told,)


PLANTED = (
    ("] & ", "] | "),
    (" & (m - ", " & (m + "),
    ("const uint32_t m = ", "const uint32_t m = ~"),
    ("s->offset + 40", "s->offset + 39"),
    ("s->go ? 1u : 0u", "s->go ? 0u : 1u"),
    ("s->ticks) * 2u", "s->ticks) * 1u"),
    ("return line;", "return line + 1;"),
    ("return line;", "return (s->ticks == 250u) ? 0 : line;"),
    ("return line;", "return (s->offset == 0) ? -1 : line;"),
)


@pytest.mark.parametrize(("old", "new"), PLANTED)
def test_a_fault_in_the_c_that_finds_the_line_is_told_with_an_input(
    old: str, new: str, classed: tuple[Program, dict[str, str]]
) -> None:
    program, files = classed
    [path] = [name for name in files if name.endswith(".c")]
    begin = files[path].index("_match_t(const ")
    assert old in files[path][begin:]
    changed = files | {path: files[path][:begin] + files[path][begin:].replace(old, new, 1)}
    told = check_of(program, files, program.tables[0]).of(changed)
    assert isinstance(told, tuple)
    assert told[0].startswith(("at now = ", "the C stops "))


def deep(program: Program, files: dict[str, str], mutants: int = 4) -> SuiteResult:
    options = SuiteOptions(examples=20, deep=True, esbmc_s=0.0, cortex=False, mutants=mutants)
    return run_suite(program, files, options)


def test_what_nobody_can_decide_is_a_figure_and_no_failure(
    classed: tuple[Program, dict[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    program, files = classed
    result = deep(program, files)
    assert result.diagnostics == ()
    assert "mutants of the masks: " in result.text()
    assert set(result.programs[0].code_mutants["mutants of the masks"]) <= {"the matcher check", "equivalent"}
    for said, failed in ((EsbmcAnswer.FAILED, False), (EsbmcAnswer.REFUTED, True)):
        monkeypatch.setattr(suite, "prove_function", lambda *_, said=said: EsbmcVerdict("f", said, 0, 0.0))
        asked = SuiteOptions(examples=1, esbmc_s=1.0, cortex=False, mutants=0)
        assert run_suite(program, files, asked).failed is failed


def test_a_check_of_the_masks_that_calls_all_equal_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = "| line | part || on |\n| a | < 2 || true |\n| b | >= 2 || false |"
    program = program_of(f"input part : int 0 .. 3\noutput on : bool\ntable t {{\n{lines}\n}}\n")
    monkeypatch.setattr(MatcherCheck, "of", lambda *_: Checked(0, ()))
    found = deep(program, emitted(program)).diagnostics
    assert ["calls equal what the tests tell apart" in finding.message for finding in found] == [True]


@pytest.mark.parametrize("path", [APPROACH, "tables/vision/vision.rcs"])
def test_each_part_of_the_c_is_seen_by_some_compilers_and_what_they_do_not_see_is_no_mutant(
    path: str, repo: Path
) -> None:
    """Wherever GNU C and others differ: a mutant of what is not compiled nobody could notice."""
    program = shipped(path, repo)
    files = emitted(program)
    source = text_of(symbols_of(program, files).source, files)
    assert source.count("#if defined(__GNUC__)\n") > 1
    seen = variants(source)
    for text, ours, theirs in (
        (seen[0], ("__builtin_ctz", "always_inline"), ("at[64]",)),
        (seen[1], ("at[64]",), ("__builtin_ctz", "always_inline")),
    ):
        assert all(word in text for word in ours)
        assert not any(word in text for word in theirs)
        assert text.count("\n") == source.count("\n")
    lines = max(len(table.lines) for table in program.tables)
    scans = [
        each
        for each in code_mutants(source, lines)
        if each.function.endswith("_bit64") and "at[64]" in each.base
    ]
    assert len([each for each in scans if each.change == "mask"]) == lines
    assert {each.base for each in scans} == {seen[1]}
    told = source.splitlines()
    for each in scans:
        line = int(each.where.split()[1].rstrip(":"))
        assert each.old in told[line - 1]


def test_a_bit_scan_of_other_compilers_that_is_wrong_is_found(repo: Path) -> None:
    program = shipped(APPROACH, repo)
    files = emitted(program)
    wrong = {name: text.replace(" 0u, 1u, 48u,", " 1u, 1u, 48u,") for name, text in files.items()}
    assert wrong != files
    found = deep(program, wrong, 1).diagnostics
    assert ["without compiler built-ins" in finding.message for finding in found] == [True]
    assert deep(program, files, 1).diagnostics == ()


def test_a_mutant_of_what_nothing_proved_calls_is_not_called_equivalent(repo: Path) -> None:
    """`check` of a state is run by its caller alone."""
    program = shipped(APPROACH, repo)
    files = emitted(program)
    symbols = symbols_of(program, files)
    judge = judge_of(program, files)
    mutants = [
        each for each in code_mutants(text_of(symbols.source, files), 4) if each.function == "approach_check"
    ]
    assert len(mutants) > 5
    assert {judge.by_proof(each) for each in mutants} == {Noticed.UNDECIDED}


def test_without_being_asked_no_model_checker_runs_and_no_c_is_mutated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(suite, "prove_function", never)
    monkeypatch.setattr(suite, "judge_code", never)
    (tmp_path / "lift.rcs").write_text(CLASSED, encoding="utf-8")
    for more in ((), ("--esbmc", "0")):
        asked = ["test", "--no-cache", "--no-cortex", "--examples", "10", "--mutants", "2", *more]
        assert run([*asked, str(tmp_path / "lift.rcs")]) == 0
        said = capsys.readouterr().out
        assert "matcher = table: " in said
        assert "9 of 9 lines reached" in said
        assert "ESBMC" not in said


def test_a_condition_is_not_asked_where_what_stops_the_cycle_fails(tmp_path: Path) -> None:
    """The matcher then divides by zero, and is not called: nor may the check of the masks call it."""
    text = """
input a : int 0 .. 9
input b : int 0 .. 9
output o : bool
assume some monitored : b /= 0
table t assuming some {
  | line | a / b || o     |
  | 1    | > 3   || true  |
  | 2    | <= 3  || false |
}
"""
    (tmp_path / "quotient.rcs").write_text(text, encoding="utf-8")
    asked = [
        "--no-cache",
        "--no-cortex",
        "--examples",
        "20",
        "--mutants",
        "2",
        str(tmp_path / "quotient.rcs"),
    ]
    start = "import sys; from rcsc.front.commands import run; sys.exit(run(sys.argv[1:]))"
    ran = subprocess.run([sys.executable, "-c", start, "test", *asked], capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr
