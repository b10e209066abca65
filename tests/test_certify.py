"""The checker believes no certificate of a table that is wrong, and no damaged one; it shares no code with the prover."""

import ast
import copy
import json
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.certify import certify, check_certificate
from rcsc.interpret import matching_lines
from rcsc.meaning import digest
from rcsc.model import Program, Table
from rcsc.prove.options import Options
from rcsc.prove.program import prove_program
from rcsc.resolve import compile_text
from tests.bench import families
from tests.emitted import program_of, shipped

BOXES = """
input a : bool
input b : int 0 .. 9
input c : int 0 .. 9
table t {
  | line | a     | b      | c    ||
  | 1    | true  | 0 .. 4 |      ||
  | 2    | true  | > 4    | < 3  ||
  | 3    | true  | > 4    | >= 3 ||
  | 4    | false |        | < 7  ||
  | 5    | false |        | >= 7 ||
}
"""
RELATED = """
input x : int -20 .. 20
input y : int -20 .. 20
input far : bool
assume near monitored : x - y <= 10
table t assuming near {
  | line | far   | when                   ||
  | 1    | true  | x + y > 3              ||
  | 2    | true  | x + y <= 3 and x < y   ||
  | 3    | true  | 2*x + 2*y < 8 and x >= y ||
  | 4    | false | x - y <= 5             ||
  | 5    | false | x - y > 5 and x <= y + 10 ||
}
"""
WRONG = [  # a change of a cell, and whether the table then has a gap or an overlap
    (BOXES, "| 0 .. 4 |", "| 0 .. 3 |"),
    (BOXES, "| 0 .. 4 |", "| 0 .. 5 |"),
    (BOXES, "| < 3  |", "| < 2  |"),
    (BOXES, "| < 3  |", "| <= 3 |"),
    (BOXES, "| 5    | false |        | >= 7 ||\n", "| 5    | true |        | >= 7 ||\n"),
    (BOXES, "| >= 7 |", "| > 7 |"),
    (RELATED, "x + y > 3  ", "x + y > 4  "),
    (RELATED, "x + y > 3  ", "x + y >= 3  "),
    (RELATED, "and x < y ", "and x <= y"),
    (RELATED, "x - y > 5", "x - y > 6"),
    (RELATED, "x <= y + 10", "x <= y + 9"),
    (RELATED, "x - y <= 10", "x - y <= 11"),
    (RELATED, "x - y <= 5 ", "x - y <= 6 "),
]


def certificate_of(program: Program) -> dict[str, Any]:
    """What the prover says of a table in order, as it is kept in a file."""
    verdict = prove_program(program, Options())
    assert verdict.proved is not None, verdict
    made: dict[str, Any] = json.loads(json.dumps(verdict.certificate))
    return made


def forged(certificate: dict[str, Any], program: Program) -> dict[str, Any]:
    """The certificate with what binds it to its table replaced."""
    made = copy.deepcopy(certificate)
    for entry, table in zip(made["tables"], program.tables, strict=True):
        entry["meaning"] = digest(program, table)
    return made


@pytest.mark.parametrize("text", [BOXES, RELATED], ids=["boxes", "related"])
def test_a_certificate_holds_and_says_what_it_rests_on(text: str) -> None:
    program = program_of(text)
    found = certify(program, certificate_of(program))
    assert found.problems == ()
    assert found.rests_on == (("assumption `near` (monitored)",) if text is RELATED else ())


@pytest.mark.parametrize(("lines", "variables"), [(64, 7), (256, 20)])
def test_families_are_certified(lines: int, variables: int) -> None:
    for text in (families.box(lines, variables, 1), families.linear(lines // 4, 4, 1)):
        program = program_of(text)
        assert check_certificate(program, certificate_of(program)) == ()


@pytest.mark.parametrize("path", ["tables/task/acquire.rcs", "tables/examples/approach.rcs"])
def test_shipped_tables_are_certified(path: str, repo: Path) -> None:
    program = shipped(path, repo)
    assert check_certificate(program, certificate_of(program)) == ()


def test_a_certificate_of_another_table_is_refused() -> None:
    certificate = certificate_of(program_of(BOXES))
    changed = program_of(BOXES.replace("| < 3 ", "| < 4 ").replace("| >= 3 ", "| >= 4 "))
    assert "of another table" in check_certificate(changed, certificate)[0]
    assert check_certificate(changed, forged(certificate, changed)) == ()  # the same tree shows that one too


@pytest.mark.parametrize(("text", "old", "new"), WRONG)
def test_no_forged_certificate_shows_a_wrong_table(text: str, old: str, new: str) -> None:
    assert text.count(old) == 1
    wrong = program_of(text.replace(old, new))
    [problem] = check_certificate(wrong, forged(certificate_of(program_of(text)), wrong))
    assert problem.startswith("table `t`: ")


def numbers(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The place of every value inside lists and dictionaries."""
    inside = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    found = [place for key, value in inside for place in numbers(value, (*path, key))]
    return found or [path]


def put(node: Any, path: tuple[Any, ...], value: Any) -> None:
    """Replaces one value."""
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value


ODD: list[Any] = [0, 1, -1, 2, 10**30, None, True, "l", "b", "e", "z", [], [0], {}, 0.5]
CERTIFIED = {text: certificate_of(program_of(text)) for text in (BOXES, RELATED)}
PROGRAMS = {
    text: [program_of(text.replace(old, new)) for base, old, new in WRONG if base is text]
    for text in CERTIFIED
}


@given(text=st.sampled_from([BOXES, RELATED]), data=st.data())
def test_no_damaged_certificate_shows_a_wrong_table(text: str, data: st.DataObject) -> None:
    program = data.draw(st.sampled_from(PROGRAMS[text]))
    made = forged(CERTIFIED[text], program)
    for _ in range(data.draw(st.integers(1, 3))):
        entry = made["tables"][0]
        place = data.draw(st.sampled_from(numbers(entry)))
        if place and place[0] != "meaning":
            put(entry, place, data.draw(st.sampled_from(ODD)))
    assert check_certificate(program, made)


@given(st.randoms(use_true_random=False))
def test_whatever_tree_is_made_up_no_wrong_table_passes(rng: random.Random) -> None:
    program = rng.choice(PROGRAMS[RELATED])
    made = forged(CERTIFIED[RELATED], program)
    entry = made["tables"][0]

    def tree(depth: int) -> list[Any]:
        if depth and rng.random() < 0.7:
            return [
                ["s", rng.randrange(len(entry["forms"])), rng.randint(-12, 12)],
                *tree(depth - 1),
                *tree(depth - 1),
            ]
        multipliers = [[rng.randrange(len(entry["forms"])), rng.choice([-1, 1])] for _ in range(2)]
        return [rng.choice([["l", rng.randrange(-1, 5)], ["a", 0], ["e", multipliers], ["b", None, None]])]

    entry["tree"] = tree(4)
    assert check_certificate(program, made)


@pytest.mark.parametrize("damage", [[], None, {"format": "rcsc-certificate"}, {"format": "x", "version": 1}])
def test_what_is_no_certificate_is_refused(damage: Any) -> None:
    assert check_certificate(program_of(BOXES), damage)[0].startswith("malformed certificate")


def test_the_wrong_tables_of_these_tests_are_wrong() -> None:
    for programs in PROGRAMS.values():
        for program in programs:
            table: Table = program.tables[0]
            counts = {
                len(matching_lines(table, snapshot))
                for snapshot in every_input(program)
            }  # fmt: skip
            assert counts - {1}


def every_input(program: Program) -> list[dict[str, Any]]:
    """All inputs that the assumptions admit."""
    from itertools import product

    from rcsc.interpret import evaluate
    from rcsc.model import key_bounds, value_of_key

    keys = [range(key_bounds(v.type)[0], key_bounds(v.type)[1] + 1) for v in program.variables]
    found = []
    for at in product(*keys):
        snapshot = {
            str(v.name): value_of_key(v.type, key) for v, key in zip(program.variables, at, strict=True)
        }
        if all(evaluate(a.condition, snapshot) for a in program.assumptions):
            found.append(snapshot)
    return found


def test_the_checker_imports_nothing_of_the_prover(repo: Path) -> None:
    tree = ast.parse((repo / "rcsc/certify.py").read_text(encoding="utf-8"))
    names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert names == {"collections.abc", "dataclasses", "math", "typing", "rcsc.meaning", "rcsc.model"}


def test_a_gap_and_an_overlap_have_no_certificate() -> None:
    for program in (*PROGRAMS[BOXES], *PROGRAMS[RELATED]):
        assert prove_program(program, Options()).proved is None
    assert isinstance(compile_text(BOXES), Program)
