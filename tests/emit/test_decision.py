"""How executors find the line: cuts, ifs and masks say of every input which lines match, of tables that are wrong, too."""

from collections import Counter
from collections.abc import Iterator
from random import Random

import pytest

from rcsc.emit.decision import Cut, decision, depth, ends
from rcsc.emit.lower import lower
from rcsc.emit.plan import Probe
from rcsc.host.tools import c_compiler
from rcsc.lang.interpret import matching_lines
from rcsc.lang.model import Program, ProvedProgram, Snapshot, key_bounds, seal_of_proof, value_of_key
from rcsc.testing.agree import NONE, SEVERAL, AgreementCount, line_number, run_lines
from tests.bench.families import Fault, box, linear
from tests.emit.test_agreement import executors_of
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
    [(9, 4, "ok", 0), (40, 6, "gap", 9), (70, 9, "overlap", 30), (150, 9, "ok", 0), (150, 12, "gap", 60)],
)
def test_every_executor_tells_none_one_and_several(
    lines: int, variables: int, fault: Fault, widened: int
) -> None:
    answers = compared(program_of(box(lines, variables, lines + 1, fault, widened)), 1500)
    assert len(answers) > min(lines, 60) * 3 // 4
    assert (answers[SEVERAL] > 0) == (widened > 0)
    assert answers[NONE] > 0 or fault != "gap"


@pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
@pytest.mark.parametrize("text", [FALLING, linear(12, 3, 5)])
def test_conditions_over_several_variables_are_asked_for_too(text: str) -> None:
    answers = compared(program_of(text), 1500)
    assert len(answers) >= 5
    assert (answers[SEVERAL] > 0) == (text == FALLING)


def probes_of(text: str) -> tuple[list[Probe], int]:
    program = program_of(text)
    [table] = lower(ProvedProgram(program, seal_of_proof())).tables
    return [probe for group in table.matcher.groups for probe in group], (1 << table.matcher.lines) - 1


@pytest.mark.parametrize(("lines", "variables"), [(16, 7), (64, 7), (256, 20)])
def test_what_was_made_by_cuts_is_parted_by_as_few(lines: int, variables: int) -> None:
    probes, everyone = probes_of(box(lines, variables, lines + variables))
    found = decision(probes, everyone, 4 * lines)
    assert found is not None
    assert len(list(ends(found))) <= lines * 5 // 4
    assert depth(found) <= lines.bit_length() + 2


def test_an_end_that_is_exact_is_so_for_all_its_classes() -> None:
    """By brute force over masks of which nothing is known; where few are enough, an end may keep what is told apart."""
    random, kinds = Random(5), Counter[bool]()  # noqa: S311  # repeatable
    [probe, *_], _ = probes_of(FALLING)
    for round_ in range(300):
        sizes = [random.randint(1, 4) for _ in range(3)]
        probes = [Probe(probe.index, tuple(random.getrandbits(5) for _ in range(size))) for size in sizes]
        found = decision(probes, 31, 1000, few=round_ % 3)
        assert found is not None
        for a in range(sizes[0]):
            for b in range(sizes[1]):
                for c in range(sizes[2]):
                    place = (a, b, c)
                    at = found
                    while isinstance(at, Cut):
                        at = at.above if place[at.probe] >= at.first else at.below
                    left = probes[0].masks[a] & probes[1].masks[b] & probes[2].masks[c]
                    assert left == at.lines if at.exact else left & ~at.lines == 0
                    kinds[at.exact] += 1
    assert min(kinds[True], kinds[False]) > 100


def test_a_table_that_no_few_cuts_part_is_decided_by_masks() -> None:
    """Each line states a leaf of its own: ifs would be as many as combinations of all."""
    names = [f"x{at}" for at in range(8)]
    rows = [
        f"| l{at} | " + " | ".join("true" if at == by else "" for by in range(8)) + " ||" for at in range(8)
    ]
    inputs = "".join(f"input {name} : bool\n" for name in names)
    text = f"{inputs}table t {{\n| line | {' | '.join(names)} ||\n" + "\n".join(rows) + "\n}\n"
    program = program_of(text)
    [module] = [code for name, code in emitted(program).items() if name.endswith(".py")]
    assert "_T_" in module
    assert len(module.splitlines()) < 500
    answers = compared(program, 4000)
    assert answers[SEVERAL] > 0 < answers[NONE]
    assert len(answers) > 5
