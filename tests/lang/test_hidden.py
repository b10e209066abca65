"""States that the compiler adds, in two versions of a program: the same where they are fed with the same, whatever they are called."""

from functools import cache
from itertools import product

import pytest

from rcsc.lang.hidden import fed_with, matched
from rcsc.lang.model import Program
from rcsc.proof.relation.same import Same, compare
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.program import prove_program
from rcsc.views.diff.compare import compare as versions
from tests.support.programs.stages import BOXES, program_of

TEXT = """\
enum mode { off, on }
record report { b : bool }
input a : report
input a_b : bool
input x : int 0 .. 9
state m : mode
state s : bool
FIRST
table t {
  | line | when       || s     |
  | yes  | CONDITION  || true  |
  | no   | not (CONDITION) || false |
}
level l { period 100 [ms] table t }
"""
ASKED = (
    "was a.b",
    "was a_b",
    "was a_b and was a.b",
    "a.b for 200 [ms]",
    "a.b = true for 200 [ms]",
    "a.b for 300 [ms]",
    "(a.b or a_b) for 200 [ms]",
    "x > 3 for 200 [ms]",
    "x >= 4 for 200 [ms]",
    "x > 3",
    "@T(a.b)",
    "not was a.b and a.b",
    "(m = on and a.b) for 200 [ms] or was a_b",
)
SAME = {("a.b for 200 [ms]", "a.b = true for 200 [ms]"), ("@T(a.b)", "not was a.b and a.b")}


@cache
def version(condition: str, before: str = "") -> Program:
    first = f"assume before monitored : {before} or true" if before else ""
    return program_of(TEXT.replace("CONDITION", condition).replace("FIRST", first))


@pytest.mark.parametrize("one", ASKED)
def test_tables_that_look_back_at_something_else_are_not_the_same(one: str) -> None:
    """`x > 3` for a time and `x >= 4` for it are, too; as their counters are fed with other words, nobody says so."""
    for other in ASKED[ASKED.index(one) :]:
        first, second = version(one), version(other, before="was a_b and (a_b or a.b) for 200 [ms]")
        told = compare((first, first.tables[0]), (second, second.tables[0]), Options())
        alike = one == other or (one, other) in SAME or (other, one) in SAME
        assert isinstance(told, Same) is alike, (one, other)
        parts = versions("t", version(one), second, Options()).parts
        assert any(part.changed for part in parts if part.what == "table") is not alike, (one, other)


def test_an_order_of_asking_changes_nothing() -> None:
    for one, other in product(("was a.b and was a_b", "a_b for 1 [s] and a.b for 1 [s]"), repeat=2):
        turned = " and ".join(reversed(other.split(" and ")))
        assert versions("t", version(one), version(turned), Options()).changed is (one != other)


def test_members_count_by_their_names() -> None:
    """An enumeration is numbered otherwise, and the condition that has to hold says the same."""
    before = version("m = on for 200 [ms]")
    after = program_of(
        TEXT.replace("off, on", "on, off").replace("CONDITION", "m = on for 200 [ms]").replace("FIRST", "")
    )
    whole = versions("t", before, after, Options())
    assert not any(part.changed for part in whole.parts if part.what == "table")


def test_a_name_that_a_user_gave_is_never_taken() -> None:
    asked = "was a.b and a.b for 200 [ms]"
    texts = [
        TEXT.replace("CONDITION", asked).replace("FIRST", first)
        for first in ("", "state was_a_b : bool\nstate held_a_b : bool\nstate was_a_b_2 : bool")
    ]
    one, other = matched(program_of(texts[0]), program_of(texts[1]))
    names = [{fed_with(v): str(v.name) for v in each.variables if fed_with(v)} for each in (one, other)]
    assert names[0] == names[1]
    assert len(names[0]) == 2
    for program in (one, other):
        assert len({v.name for v in program.variables}) == len(program.variables)
        assert prove_program(program, BOXES).proved is not None, "it is a program still"
    assert isinstance(compare((one, one.tables[0]), (other, other.tables[0]), Options()), Same)
