"""How executors find the line: cuts, ifs and masks say of every input which lines match, of tables that are wrong, too."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from rcsc.base.host.tools import Absent, c_compiler
from rcsc.code.emit import decision as decisions
from rcsc.code.emit.decision import Cut, decision, depth, ends
from rcsc.code.emit.lower import lower
from rcsc.code.testing.agree import NONE, SEVERAL, AgreementCount, line_number, run_lines
from rcsc.code.testing.matcher import Checked
from rcsc.lang.interpret import matching_lines
from rcsc.lang.model import Program, ProvedProgram, Snapshot, key_bounds, seal_of_proof, value_of_key
from tests.bench.executors import c_counts
from tests.bench.made.families import Fault, box, linear
from tests.emit.test_agreement import executors_of
from tests.emit.test_mutants import check_of
from tests.support.programs.stages import emitted, program_of

FALLING = """
input a : real -1.0 .. 9.0
input b : real -1.0 .. 9.0
input kind : int 0 .. 99
table t {
  | line | kind                      | a         | when  ||
  | odd  | in {1, 3, 5, 7, 90 .. 99} | < 2.5     |       ||
  | near | not in {1, 3, 5}          | 0.0 .. 3.5 | a < b ||
  | far  |                           | >= 3.0    | a > b ||
  | rest | DEFAULT                   |           |       ||
}
"""
"""Lines that overlap and leave gaps, over reals, sets and a condition of two variables."""


def samples(program: Program, count: int) -> Iterator[Snapshot]:
    """Inputs over the whole space, and as many inside lines, at the ends of what they state and beside."""
    random, [table] = Random(31), program.tables  # noqa: S311  # repeatable
    for number in range(count):
        keys = {str(v.name): random.randint(*key_bounds(v.type)) for v in program.variables}
        for test in random.choice(table.lines).tests if number % 2 else ():
            if test is not None and test.box is not None:
                low, high = key_bounds(program.variable(test.variables[0]).type)
                end = random.choice(random.choice(test.box)) + random.choice((0, 0, 0, 0, 0, -1, 1))
                keys[str(test.variables[0])] = min(high, max(low, end))
        yield {str(v.name): value_of_key(v.type, keys[v.name]) for v in program.variables}


def compared(program: Program, count: int) -> Counter[int]:
    """How often each answer is right; every executor gives it."""
    given = list(samples(program, count))
    with executors_of(program) as executors:
        for target in executors.targets:
            if target.kind == "line":
                assert run_lines(executors, target, given, AgreementCount()) is None
    [table] = program.tables
    return Counter(line_number(table, matching_lines(table, one)) for one in given)


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize(
    ("lines", "variables", "fault", "widened"),
    [(9, 4, "ok", 0), (40, 6, "gap", 9), (70, 9, "overlap", 30), (150, 12, "gap", 60)],
)
def test_every_executor_tells_none_one_and_several(
    lines: int, variables: int, fault: Fault, widened: int
) -> None:
    answers = compared(program_of(box(lines, variables, lines + 1, fault, widened)), 900)
    assert len(answers) > min(lines, 60) * 3 // 4
    assert (answers[SEVERAL] > 0) == (widened > 0)
    assert answers[NONE] > 0 or fault != "gap"


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize("text", [FALLING, linear(12, 3, 5)])
def test_conditions_over_several_variables_are_asked_for_too(text: str) -> None:
    answers = compared(program_of(text), 1500)
    assert len(answers) >= 5
    assert (answers[SEVERAL] > 0) == (text == FALLING)


def masks_of(text: str) -> tuple[list[tuple[int, ...]], int]:
    program = program_of(text)
    [table] = lower(ProvedProgram(program, seal_of_proof())).tables
    return [probe.masks for group in table.matcher.groups for probe in group], (1 << table.matcher.lines) - 1


@pytest.mark.parametrize(("lines", "variables"), [(16, 7), (64, 7), (256, 20)])
def test_what_was_made_by_cuts_is_parted_by_as_few(lines: int, variables: int) -> None:
    probes, everyone = masks_of(box(lines, variables, lines + variables))
    found = decision(probes, everyone, 4 * lines)
    assert found is not None
    assert len(list(ends(found))) <= lines * 5 // 4
    assert depth(found) <= lines.bit_length() + 2


def test_an_end_keeps_what_matches_for_all_its_classes() -> None:
    """By brute force over masks of which nothing is known."""
    random = Random(5)  # noqa: S311  # repeatable
    for _ in range(300):
        sizes = [random.randint(1, 4) for _ in range(3)]
        probes = [[random.getrandbits(5) for _ in range(size)] for size in sizes]
        found = decision(probes, 31, 1000)
        assert found is not None
        for a in range(sizes[0]):
            for b in range(sizes[1]):
                for c in range(sizes[2]):
                    place = (a, b, c)
                    at = found
                    while isinstance(at, Cut):
                        at = at.above if place[at.probe] >= at.first else at.below
                    left = probes[0][a] & probes[1][b] & probes[2][c]
                    assert left == at.lines


def ladder(lines: int, *, apart: bool) -> str:
    """A leaf a line: each states its own, and, where they are apart, that none of those before it holds."""
    names = [f"x{at}" for at in range(lines)]
    rows = [
        f"| l{at} | "
        + " | ".join("true" if at == by else "false" if apart and by < at else "" for by in range(lines))
        + " ||"
        for at in range(lines)
    ]
    inputs = "".join(f"input {name} : bool\n" for name in names)
    return f"{inputs}table t {{\n| line | {' | '.join(names)} ||\n" + "\n".join(rows) + "\n}\n"


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize(("lines", "count"), [(8, 4000), (70, 400)])
def test_a_table_that_no_few_cuts_part_is_decided_by_masks(lines: int, count: int) -> None:
    """Ifs would be as many as combinations of all leaves."""
    program = program_of(ladder(lines, apart=False))
    files = emitted(program)
    [module] = [code for name, code in files.items() if name.endswith(".py")]
    assert "_T_" in module
    checked = check(program, files)
    assert isinstance(checked, Checked)
    assert not checked.unmatched
    answers = compared(program, count)
    assert answers[SEVERAL] > 0
    assert lines > 8 or answers[NONE] > 0 < answers[5]


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize(
    ("lines", "ifs"), [(decisions.DEEPEST, True), (decisions.DEEPEST + 1, False), (90, False)]
)
def test_ifs_stand_inside_each_other_as_deep_as_python_takes(lines: int, ifs: bool) -> None:
    program = program_of(ladder(lines, apart=True))
    [module] = [code for name, code in emitted(program).items() if name.endswith(".py")]
    assert ("_T_0" not in module) == ifs
    assert len(compared(program, 300)) > 5


def test_a_long_ladder_is_given_up_early() -> None:
    count = 3000
    masks = [(~(1 << at) & (1 << count) - 1, (2 << at) - 1) for at in range(count)]
    assert decision(masks, (1 << count) - 1, 10 * count) is None


def check(program: Program, files: dict[str, str]) -> Checked | tuple[str, ...]:
    checked = check_of(program, files, program.tables[0]).of(files)
    assert not isinstance(checked, Absent)
    return checked


def mixed(blocks: int) -> str:
    """Three lines a block: over a wide range, a real, a condition of two variables; DEFAULT for what is past them."""
    rows = [
        f"| {name}{at} | {1000 * at} .. {1000 * at + 999} | {real} | {when} ||"
        for at in range(blocks)
        for name, real, when in (
            ("low", "< 0.5", ""),
            ("less", ">= 0.5", "a < b"),
            ("more", ">= 0.5", "a >= b"),
        )
    ]
    return "\n".join(
        [
            "input x : int -7 .. 2000000\ninput r : real 0.0 .. 1.0\ninput a : int 0 .. 9\ninput b : int 0 .. 9\ntable t {",
            "| line | x | r | when ||",
            *rows,
            "| rest | DEFAULT | | ||",
            "}\n",
        ]
    )


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
def test_many_lines_are_found_by_wide_numbers_and_reals_and_fall_to_default() -> None:
    program = program_of(mixed(40))
    checked = check(program, emitted(program))
    assert isinstance(checked, Checked)
    assert not checked.unmatched
    answers = compared(program, 1500)
    assert answers[120] > 100
    assert len(answers) > 80


def test_a_line_that_matches_nowhere_is_not_waited_for() -> None:
    """No such table is proved; what executors find out of one while they run is still right."""
    text = "input a : int 0 .. 3\ntable t {\n| line | a | when ||\n| one | 1 | a in {0, 3} ||\n| two | 2 | a = 2 ||\nREST}"
    for rest in ("", "| rest | DEFAULT | ||\n"):
        program = program_of(text.replace("REST", rest))
        assert set(compared(program, 40)) == {1, 2 if rest else NONE}
    assert compared(program_of(text.replace("| two | 2 | a = 2 ||\nREST", "")), 40) == Counter({NONE: 40})


@pytest.mark.needs("valgrind")
@pytest.mark.parametrize(
    ("lines", "variables", "most"), [(64, 7, 36), (256, 20, 161), (1024, 20, 323)], ids=str
)
def test_a_match_takes_few_instructions(lines: int, variables: int, most: int, tmp_path: Path) -> None:
    """Of this compiler, a fifth above what was measured."""
    program = program_of(box(lines, variables, lines + variables), "bench.rcs")
    ours, _, _ = c_counts(tmp_path, program, emitted(program), beside=False)
    assert 20 < ours <= most
