"""Vectors notice slips in procedures: drawn ones of other operators than they were made for, and those that were once missed."""

from dataclasses import replace
from functools import cache

import pytest

from rcsc.base.host.tools import Absent, c_compiler
from rcsc.code.emit import emitted
from rcsc.code.testing.coverage.document import VectorSet, vectors_document
from rcsc.code.testing.coverage.matters import matters_of
from rcsc.code.testing.coverage.vector_set import further_figures, vector_set
from rcsc.driver.compile import planned
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from tests.slips.__main__ import judged_slips
from tests.slips.drawn import slips_of, source_of
from tests.slips.played import mutant, with_slips
from tests.support.programs.stages import BOXES, program_of

HAND = """
enum finger { resting, moving, failed }
enum order { hold, close }
record reading {
  opening_mm : real 0.0 .. 200.0
  force_n : real 0.0 .. 1000.0
}
input hand : reading clamp
input wanted : order
input other : order
input opening_mm : real 0.0 .. 200.0
input force_n : real 0.0 .. 1000.0
input slow : bool
state finger_now : finger
state at_opening : bool
state forced : bool
state waited : int 0 .. 20
output drive : bool safe false
output shown_mm : real 0.0 .. 200.0

procedure measure {
  at_opening := abs(hand.opening_mm - opening_mm) <= 0.5
  forced := hand.force_n >= 0.95 * force_n
  shown_mm := hand.opening_mm
}
procedure wait {
  if waited < 20 and not slow { waited := waited + 1 }
}
procedure become(value : finger) { finger_now := value }

table t {
  | line | wanted  | at_opening | forced || procedures             | drive |
  | 1    | = hold  |            |        || become(resting)        | false |
  | 2    | = close | true       |        || become(resting)        | false |
  | 3    | = close | false      | true   || become(failed)         | false |
  | 4    | = close | false      | false  || wait; become(moving)   | true  |
}
level l {
  period 10 [ms]
  preprocess measure
  table t
}
"""
"""A tolerance, a factor, clamps, a counter with an end, and variables of one type that could be taken for each other."""


@cache
def made() -> tuple[VectorSet, dict[str, str]]:
    proved = prove_program(program_of(HAND, "probe.rcs"), BOXES).proved
    assert proved is not None
    plan = planned(proved)
    files = emitted(plan)
    return vector_set(plan, files, Options(), None, lambda _: None, 40), files


@pytest.fixture(autouse=True)
def _compiler() -> None:
    if isinstance(c_compiler(), Absent):
        pytest.skip("no C compiler")


def test_drawn_slips_are_noticed() -> None:
    document, files = made()
    judged = judged_slips(document, files, most=2, seed=5, esbmc_s=0.0, only=400, tries=2_000)
    assert len(judged) >= 400
    left = [(each.slip.function, each.slip.operator, each.slip.new, each.fate) for each in judged]
    left = [each for each in left if each[3] not in ("noticed", "equivalent")]
    assert len(left) <= len(judged) // 100, left


def test_without_what_notices_slips_they_are_missed() -> None:
    """The vectors that cover the C and notice nothing else miss what those above find."""
    document, files = made()
    bare = [k for k in document.kept if not any(hit[0] == "matters" for hit in k.hits)]
    assert len(bare) < len(document.kept)
    few = replace(document, kept=tuple(bare))
    judged = judged_slips(few, files, most=2, seed=5, esbmc_s=0.0, only=400, tries=2_000)
    assert sum(each.fate == "missed" for each in judged) > 4


def test_every_slip_is_a_change_of_one_place_and_all_are_one_file() -> None:
    document, files = made()
    source = source_of(document.program, document.symbols, files, 2)
    slips = list(slips_of(source, 1))
    assert {
        "assignment lost", "call lost", "a real", "a whole number", "another variable", "another member", "condition negated",
        "an operand lost", "another comparison", "a bound replaced", "an entry of a mask", "order", "else lost", "operands swapped",
    } <= {slip.operator for slip in slips}  # fmt: skip
    for slip in slips[::50]:
        assert mutant(source.text, slip) != source.text
    whole = with_slips(source.text, slips)
    assert all(f"rcsc_slip == {at}" in whole for at in range(1, len(slips) + 1))


def test_what_is_not_noticed_is_listed_and_counted() -> None:
    document, _ = made()
    listed = vectors_document(document)["unnoticed"]
    assert isinstance(listed, list)
    assert len(listed) == len(document.unnoticed)
    kinds, slips = further_figures(document)
    assert "run a whole cycle" in kinds
    assert f"of {document.ways} slips" in slips
    assert document.ways == matters_of(document.program).ways > 80


def test_both_sides_of_a_tolerance_are_next_to_each_other() -> None:
    """A tolerance of 0.5 is met at 0.5 and left at the next double; the factor likewise at the greatest force."""
    document, _ = made()
    before = [kept.case.before for kept in document.kept if kept.case.entry.kind == "cycle"]
    apart = sorted(abs(float(s["hand.opening_mm"]) - float(s["opening_mm"])) for s in before)
    near = [value for value in apart if abs(value - 0.5) < 1e-9]
    assert min(near) <= 0.5 < max(near)
    forces = [
        float(s["hand.force_n"]) - 0.95 * float(s["force_n"]) for s in before if float(s["force_n"]) > 500
    ]
    near = [value for value in forces if abs(value) < 1e-9]
    assert min(near) < 0 <= max(near)
