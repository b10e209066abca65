"""MC/DC vectors: each pair shows that its condition decides its line; what has no vector says why."""

from pathlib import Path

import pytest

from rcsc.code.testing.inputs.snapshot import Missing, box_of, search_in
from rcsc.code.testing.inputs.vectors import Vectors, atoms, vectors_of
from rcsc.lang.interpret import holds, matching_lines
from rcsc.lang.interval_sets import complement, meet
from rcsc.lang.model import Program, key_bounds
from tests.support.programs.stages import program_of, shipped
from tests.support.programs.texts import edited

COUPLED = """
enum mode { idle, run, stop }
input go : bool
input mode_in : mode
input width : int 0 .. 100
input limit : int 0 .. 60
output done : bool

table t {
  | line | mode_in | width | when                              || done  |
  | 1    | = idle  | > 10  |                                   || true  |
  | 2    | = idle  | <= 10 |                                   || false |
  | 3    | /= idle |       | width < limit and (go or limit = 7) || true  |
  | 4    | DEFAULT |       |                                   || false |
}
"""


def check_pairs(program: Program, found: Vectors) -> None:
    """Every vector is right by the interpreter, and every pair changes its own condition and the line."""
    table = next(t for t in program.tables if t.name == found.table)
    lines = {str(line.name): line for line in table.lines}
    for vector in found.vectors:
        names = matching_lines(table, vector.snapshot)
        default = [table.default.name] if table.default else []
        assert [vector.expected] == (names or default)
        if vector.purpose == "reach":
            assert vector.expected == vector.line
    pairs = [v for v in found.vectors if v.purpose != "reach"]
    assert len(pairs) == 2 * found.shown
    for on, off in zip(pairs[::2], pairs[1::2], strict=True):
        assert {on.purpose, off.purpose} == {"true", "false"}
        assert on.expected == on.line == off.line != off.expected
        stated = [test for test in lines[on.line].tests if test is not None]
        parts = [atom for test in stated for atom in atoms(test)]
        changed = [a for a in parts if holds(a, on.snapshot) is not holds(a, off.snapshot)]
        assert changed


def test_every_condition_of_a_coupled_table_is_shown() -> None:
    program = program_of(COUPLED)
    found = vectors_of(search_in(program), program.tables[0])
    assert (found.conditions, found.shown, found.unshown) == (8, 8, ())
    check_pairs(program, found)
    texts = {v.condition for v in found.vectors if v.line == "3"}
    assert {"width < limit", "go", "limit = 7"} <= texts


def test_unique_cause_pairs_change_one_condition_only() -> None:
    program = program_of(COUPLED)
    found = vectors_of(search_in(program), program.tables[0])
    tests = [t for t in program.tables[0].lines[2].tests if t is not None]
    parts = [atom for test in tests for atom in atoms(test)]
    on, off = (v.snapshot for v in found.vectors if v.line == "3" and v.condition == "go")
    assert sum(holds(a, on) is not holds(a, off) for a in parts) == 1


@pytest.mark.parametrize("path", ["tables/task/acquire.rcs", "tables/examples/approach.rcs"])
def test_shipped_tables(path: str, repo: Path) -> None:
    program = shipped(path, repo)
    for table in program.tables:
        found = vectors_of(search_in(program), table)
        check_pairs(program, found)
        assert {v.line for v in found.vectors if v.purpose == "reach"} >= {str(x.name) for x in table.lines}


def test_acquire_has_a_pair_for_every_condition_that_the_protocol_leaves_open(repo: Path) -> None:
    program = shipped("tables/task/acquire.rcs", repo)
    found = vectors_of(search_in(program), program.tables[0])
    assert found.conditions > 60
    assert found.shown > 40
    closed = [vector for vector in found.unshown if vector.line != str(program.tables[0].default and "16")]
    assert {vector.reason for vector in closed} == {"assumptions"}
    assert found.shown + len(closed) == found.conditions


def test_what_the_ranges_exclude_is_said() -> None:
    program = program_of(edited(COUPLED, ("<= 10", "<= 100")))
    found = vectors_of(search_in(program), program.tables[0])
    unshown = [(u.line, u.condition, u.reason) for u in found.unshown if u.condition]
    assert unshown == [("2", "<= 100", "ranges")]


def test_what_an_assumption_excludes_is_said() -> None:
    assumption = "assume slow monitored : mode_in = idle implies width > 10\n\ntable t assuming slow {"
    program = program_of(edited(COUPLED, ("table t {", assumption)))
    found = vectors_of(search_in(program), program.tables[0])
    reasons = {(u.line, u.condition): u.reason for u in found.unshown}
    assert reasons[("1", "> 10")] == "assumptions"


def test_a_solver_is_asked_where_nothing_is_found() -> None:
    text = edited(COUPLED, ("width < limit and (go or limit = 7)", "width * limit = 5963"))
    program = program_of(text)
    assert [u.reason for u in vectors_of(search_in(program), program.tables[0]).unshown if u.line == "3"]
    asked: list[str] = []

    def solver(of: Program, expr: object) -> dict[str, bool | int | float] | Missing:
        asked.append(str(expr))
        answer = {str(v.name): v.initial for v in of.variables} | {"width": 89, "limit": 67, "mode_in": 1}
        return answer if holds(expr, answer) else Missing.NONE  # type: ignore[arg-type]

    wide = program_of(edited(text, ("0 .. 60", "0 .. 67")))
    found = vectors_of(search_in(wide, solver), wide.tables[0])
    assert asked
    assert "3" in {v.line for v in found.vectors}


def test_a_vector_names_the_column_of_its_condition() -> None:
    program = program_of(COUPLED)
    table = program.tables[0]
    found = vectors_of(search_in(program), table)
    lines = {str(line.name): line for line in table.lines}
    for vector in found.vectors:
        if vector.purpose == "reach":
            assert vector.column == ""
            continue
        at = [column.heading for column in table.columns].index(vector.column)
        test = lines[vector.line].tests[at]
        assert test is not None
        assert vector.condition == test.text or vector.column == "when"
    assert {vector.column for vector in found.vectors} == {"", "mode_in", "width", "when"}


def test_boxes_of_plain_comparisons_are_those_of_the_resolver() -> None:
    program = program_of(COUPLED)
    for line in program.tables[0].lines:
        for test in line.tests:
            if test is not None and test.box is not None:
                assert box_of(test.condition) == (test.variables[0], test.box)
                kind = program.variable(test.variables[0]).type
                assert meet(test.box, complement(test.box, *key_bounds(kind))) == ()
