"""Mutants: slips of the hand in a table are noticed by the prover, or mean the same, or are another table."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.driver.trials import proofs
from rcsc.interpret import matching_lines
from rcsc.model import Program, Table, key_bounds, value_of_key
from rcsc.project import load
from rcsc.prove.options import Options
from rcsc.resolve import resolve
from rcsc.testing.mutants import Caught, Opinion, difference, judge_table, narrower, table_mutants, wider
from rcsc.testing.search import Missing, search_in

BOXES = proofs(Options(solver="boxes"))


def shipped(path: str, repo: Path) -> Program:
    loaded = load([str(repo / path)])
    program = resolve(loaded.roots[0], loaded)
    assert isinstance(program, Program), program
    return program


@pytest.mark.parametrize("path", ["tables/task/acquire.rcs", "tables/examples/approach.rcs"])
def test_no_table_mutant_survives(path: str, repo: Path) -> None:
    program = shipped(path, repo)
    assert BOXES.prover is not None
    for table in program.tables:
        judged = judge_table(search_in(program, BOXES.solver), table, BOXES.prover)
        counts = Counter(one.caught for one in judged)
        assert counts[Caught.SURVIVED] == 0, [one for one in judged if one.caught is Caught.SURVIVED]
        assert counts[Caught.PROVER] > len(judged) // 2
        assert {one.change for one in judged} == {"drop", "widen", "narrow", "duplicate", "swap"}


def test_a_prover_that_notices_nothing_lets_mutants_live(repo: Path) -> None:
    program = shipped("tables/task/acquire.rcs", repo)
    table = program.tables[0]
    judged = judge_table(search_in(program), table, lambda _program, _table: Opinion(accepted=True))
    doubled = [one for one in judged if one.change == "duplicate"]
    assert not any(one.caught is Caught.PROVER for one in judged)
    assert doubled  # without the prover they are told apart by a snapshot
    assert all(one.caught is Caught.EXECUTORS for one in doubled)


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


def differs_anywhere(program: Program, one: Table, other: Table) -> bool:
    """By trying each leaf at each of its keys, from the initial state."""
    start = {str(v.name): v.initial for v in program.variables}
    for variable in (v for v in program.variables if v.name in one.variables):
        low, high = key_bounds(variable.type)
        for key in range(low, high + 1):
            snapshot = {**start, str(variable.name): value_of_key(variable.type, key)}
            if matching_lines(one, snapshot) != matching_lines(other, snapshot):
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
    kind = shipped("tables/examples/approach.rcs", repo).variable("tolerance_mm").type
    assert set(wider(((3, 5), (7, 7)), kind)) == {((2, 5), (7, 7)), ((3, 7),), ((3, 5), (7, 8))}
    assert set(narrower(((3, 5), (7, 7)))) == {((4, 5), (7, 7)), ((3, 4), (7, 7)), ((3, 5),)}
    assert list(narrower(((7, 7),))) == []
    assert list(wider((key_bounds(kind),), kind)) == []
