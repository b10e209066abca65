"""The checker believes no certificate of a table that is wrong, and no damaged one; it shares no code with the prover."""

import ast
import copy
import json
import random
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from itertools import product
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.host.files.read import Malformed, json_of
from rcsc.lang.interpret import call, evaluate, holds, initial, matching_lines
from rcsc.lang.meaning import digest
from rcsc.lang.model import AssumptionName, Program, Read, Table, Value, key_bounds, key_of, value_of_key
from rcsc.lang.resolve import compile_text
from rcsc.proof.certify import CaseAnswer, certify, check_certificate
from rcsc.proof.certify.execution import Run, Start
from rcsc.proof.certify.known import KnownSpans
from rcsc.proof.certify.settle import script, values_in
from rcsc.proof.certify.table import TableChecker
from rcsc.proof.certify.values import Term, Terms, parts_first
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smtlib import cvc5_says
from rcsc.proof.table.program import prove_program
from tests.bench.made import families
from tests.certificates import Attack, signed, wrong_with
from tests.support.programs.examples import EXTERN, RICH
from tests.support.programs.stages import program_of, shipped
from tests.support.programs.texts import edited


def by_cvc5(question: str) -> CaseAnswer:
    return {"unsat": CaseAnswer.NONE, "sat": CaseAnswer.SOME}.get(cvc5_says(question), CaseAnswer.UNKNOWN)


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
EQUAL = """
input x : int -5 .. 5
input y : int -5 .. 5
table t {
  | line | when                ||
  | 1    | (x < 3) = (y < x)   ||
  | 2    | (x < 3) /= (y < x)  ||
}
"""
SUMS = """
input x : int -5 .. 5
input y : int -5 .. 5
table t {
  | line | when                       ||
  | 1    | x + y + 3 in {1, 4}         ||
  | 2    | -x /= y + 2 and x + y /= 1  ||
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
    (SUMS, "{1, 4}", "{1, 5}"),
    (EQUAL, "(x < 3) /= (y < x)", "y >= x"),
    (EQUAL, "(x < 3) /= (y < x)", "x >= 3"),
]


def certificate_of(program: Program) -> dict[str, Any]:
    """What the prover says of a table in order, as it is kept in a file."""
    verdict = prove_program(program, Options())
    assert verdict.proved is not None, verdict
    made: dict[str, Any] = json.loads(json.dumps(verdict.certificate))
    return made


@pytest.mark.parametrize("text", [BOXES, RELATED, EQUAL, SUMS], ids=["boxes", "related", "equal", "sums"])
def test_a_certificate_holds_and_says_what_it_rests_on(text: str) -> None:
    program = program_of(text)
    found = certify(program, certificate_of(program))
    assert found.whole
    assert "table `t`: exactly one line matches" in found.checked
    assert found.rests_on == (("assumption `near` (monitored)",) if text is RELATED else ())


@pytest.mark.parametrize(("lines", "variables"), [(64, 7), (256, 20)])
def test_families_are_certified(lines: int, variables: int) -> None:
    for text in (families.box(lines, variables, 1), families.linear(lines // 4, 4, 1)):
        program = program_of(text)
        assert check_certificate(program, certificate_of(program)) == ()


@pytest.mark.parametrize("path", ["tables/task/acquire.rcs", "tables/examples/approach.rcs"])
def test_shipped_tables_are_certified(path: str, repo: Path) -> None:
    program = shipped(path, repo)
    certificate = certificate_of(program)
    alone, asked = certify(program, certificate), certify(program, certificate, by_cvc5)
    assert alone.problems == ()
    assert asked.whole
    assert set(asked.checked) == {*alone.checked, *(claim.name for claim in alone.unchecked)}


def test_a_certificate_of_another_table_is_refused() -> None:
    certificate = certificate_of(program_of(BOXES))
    changed = program_of(edited(BOXES, ("| < 3 ", "| < 4 "), ("| >= 3 ", "| >= 4 ")))
    assert check_certificate(changed, certificate) == ("it is of another program",)
    assert check_certificate(changed, signed(changed, certificate)) == ()  # the same tree shows that one too


@pytest.mark.parametrize(("text", "old", "new"), WRONG)
def test_no_forged_certificate_shows_a_wrong_table(text: str, old: str, new: str) -> None:
    assert text.count(old) == 1
    wrong = program_of(edited(text, (old, new)))
    [problem] = check_certificate(wrong, signed(wrong, certificate_of(program_of(text))))
    assert problem.startswith("table `t`: ")


PROGRAMS = {
    text: [program_of(edited(text, (old, new))) for base, old, new in WRONG if base is text]
    for text in (BOXES, RELATED)
}


def test_a_certificate_is_made_only_where_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """It digests the whole program, which takes as long as the proof of a large table."""

    def unasked(*_: object) -> dict[str, object]:
        raise LookupError

    monkeypatch.setattr("rcsc.proof.table.program.program_certificate", unasked)
    verdict = prove_program(program_of(BOXES), Options())
    assert verdict.proved is not None
    with pytest.raises(LookupError):
        verdict.certificate  # noqa: B018 - it is made there


@pytest.mark.parametrize("damage", [[], None, {"format": "rcsc-certificate"}, {"format": "x", "version": 1}])
def test_what_is_no_certificate_is_refused(damage: Any) -> None:
    [problem] = check_certificate(program_of(BOXES), damage)
    assert problem.startswith(("malformed certificate", "not a certificate"))


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
    trees = [
        ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted((repo / "rcsc/proof/certify").glob("*.py"))
    ]
    froms = {node.module for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    ours = {
        name
        for name in froms
        if name and name.startswith("rcsc") and not name.startswith("rcsc.proof.certify")
    }
    assert ours == {
        "rcsc.lang.meaning", "rcsc.lang.model", "rcsc.lang.leaves", "rcsc.lang.operator_table", "rcsc.lang.restart",
        "rcsc.base.diagnostics.source",
    }  # fmt: skip
    nodes = [node for tree in trees for node in ast.walk(tree)]
    names = {
        alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == "rcsc.lang.operator_table"
        for alias in node.names
    }
    assert names <= {
        "Comparison",
        "Logic",
        "Op",
        "Strict",
        "is_comparison",
        "is_logic",
    }  # which there are, not what they mean
    assert not [node for node in nodes if isinstance(node, ast.Attribute) and node.attr == "meaning"]


def test_a_gap_and_an_overlap_have_no_certificate() -> None:
    for program in (*PROGRAMS[BOXES], *PROGRAMS[RELATED]):
        assert prove_program(program, Options()).proved is None
    assert isinstance(compile_text(BOXES), Program)


# --- what a program owes besides its tables ----------------------------------------------

OWING = """
enum word { red, green, blue }
input take : bool
input a : int -9 .. 9
input b : int 1 .. 9 clamp
input x : real -1.0 .. 1.0
state left : int 0 .. 9 = 4
state taken : int 0 .. 9 = 0
state now : int 0 .. 3 deferred until take
state k : array[4] of int 0 .. 3
output o : int -9 .. 9
output seen : word
invariant nothing_lost : left + taken = 4
invariant early : now <= 3
assume small proved : taken <= 4
assume near monitored : a <= 8
extern procedure ask reads a writes o python "m:f" c "m_f"
procedure move_one { left := left - 1; taken := taken + 1 }
procedure count(by : int 0 .. 3) { local n : int 0 .. 9 := by; for i in 0 .. 2 { n := n + i }; o := n }
procedure share { o := a / b }
procedure later { next now := 2 }
procedure pick { if a in 0 .. 3 { k[a] := 3 } else { k[0] := 0 } }
procedure round { if x > 0.0 { o := int(x * 9.0) } else { o := 0 } }
procedure alone { case seen { red { seen := green } green, blue { seen := red } } }
table t assuming near {
  | line  | take  | left | taken  | a - 9 || procedures     | seen |
  | one   | true  | > 0  |        | < 0   || move_one; pick |      |
  | none  | true  | = 0  |        | < 0   || count(3)       | red  |
  | idle  | false |      | 0 .. 4 | < 0   || share; later   | blue |
}
table u {
  | line  | take   || procedures |
  | yes   | true   || round      |
  | no    | false  || ask        |
}
level top {
  period 10 [ms]
  preprocess pick
  table by take { false : t  true : u }
  postprocess ask
}
"""
EDITS = [  # what is edited, and what then does not hold
    ("taken := taken + 1 }", "taken := taken }", "invariant `nothing_lost` is kept"),
    ("left := left - 1;", "left := left - 2;", "invariant `nothing_lost` is kept"),
    ("= 4\nstate taken", "= 5\nstate taken", "at first: invariant `nothing_lost` holds"),
    ("| one   | true  | > 0  |", "| one   | true  |      |", "`left` stays in 0 .. 9"),
    ("assume small proved : taken <= 4", "assume small proved : taken <= 3", "follows from ranges and invariants"),
    ("assume near monitored", "assume near proved", "follows from ranges and invariants"),
    ("input b : int 1 .. 9", "input b : int 0 .. 9", "the divisor is not zero"),
    ("o := a / b", "o := a * b", "`o` stays in -9 .. 9"),
    ("next now := 2", "next now := taken", "`now.next` stays in 0 .. 3"),
    ("early : now <= 3", "early : now <= 2", "taking deferred values: invariant `early` is kept"),
    ("if a in 0 .. 3 {", "if a in 0 .. 4 {", "the index lies in 0 .. 3"),
    ("k[a] := 3", "k[a] := a + 1", "stays in 0 .. 3"),
    ("int(x * 9.0)", "int(x * 11.0)", "`o` stays in -9 .. 9"),
    ("local n : int 0 .. 9 := by;", "local n : int 0 .. 9; if a > 0 { n := by };", "`n` is assigned before it is read"),
    ("|| count(3) ", "|| count(taken) ", "`by` stays in 0 .. 3"),
    ("for i in 0 .. 2", "for i in 0 .. 4", "`n` stays in 0 .. 9"),
    ("extern procedure ask reads a writes o", "extern procedure ask reads a writes left, o", "where `ask` fails"),
    ("extern procedure ask reads a writes o", "extern procedure ask reads a writes taken", "`nothing_lost` is kept"),
    ("move_one; pick |      |", "move_one; alone; alone | blue |", "two actions write one value to `seen`"),
    ("share; later ", "share; later; next now := 3 ", "two actions write one value to `now.next`"),
    ("move_one; pick |", "move_one; pick; k[1] := 2 |", "two actions write one value to `k[1]`"),
    ("a - 9 ||", "a / now ||", "the divisor is not zero"),
    ("deferred until take", "deferred until take and a / now > 0", "`deferred until` of `now`: the divisor is not zero"),
    ("  postprocess ask", "  postprocess move_one", "`postprocess` of level `top`: `left` stays in 0 .. 9"),
    ("  preprocess pick", "  preprocess move_one", "`preprocess` of level `top`: `left` stays in 0 .. 9"),
    ("assume near monitored : a <= 8", "assume near monitored : a / now <= 8", "the divisor is not zero"),
]  # fmt: skip


@pytest.fixture(scope="module")
def owing() -> tuple[Program, dict[str, Any]]:
    """A program that owes something of every sort, and its certificate."""
    program = program_of(OWING)
    return program, certificate_of(program)


def test_everything_that_a_program_owes_is_checked_without_a_solver(
    owing: tuple[Program, dict[str, Any]],
) -> None:
    found = certify(*owing)
    assert found.whole, found
    assert found.rests_on == ("assumption `near` (monitored)",)


@pytest.mark.parametrize(("old", "new", "problem"), EDITS)
def test_an_edited_program_is_refused_whatever_the_signature(
    owing: tuple[Program, dict[str, Any]], old: str, new: str, problem: str
) -> None:
    other = program_of(edited(OWING, (old, new)))
    assert certify(other, owing[1]).problems == ("it is of another program",)
    assert any(problem in one for one in certify(other, signed(other, owing[1])).problems)


ONE_WRITER = edited(RICH, ("|| measure; turn      | 9     |", "|| measure; turn      |       |"))


@pytest.mark.parametrize("text", [ONE_WRITER, EXTERN], ids=["rich", "extern"])
def test_doubles_wide_words_records_and_externs_are_certified(text: str) -> None:
    program = program_of(text)
    found = certify(program, certificate_of(program))
    assert found.whole, found


def test_nothing_is_certified_by_a_certificate_that_says_nothing(
    owing: tuple[Program, dict[str, Any]],
) -> None:
    program, certificate = owing
    for tables in (
        [],
        certificate["tables"][:1],
        certificate["tables"] * 2,
        [{"table": "t"}, {"table": "u"}],
    ):
        assert certify(program, signed(program, {**certificate, "tables": tables})).problems
    for entry in certificate["tables"]:
        for key in entry:
            rest = [
                {k: v for k, v in one.items() if one is not entry or k != key}
                for one in certificate["tables"]
            ]
            assert certify(program, signed(program, {**certificate, "tables": rest})).problems, key


def test_what_is_not_checked_is_named_and_no_part_of_what_is() -> None:
    text = (
        "input n : int 0 .. 1000000\ninput m : int 0 .. 1000000\nstate s : int 0 .. 1000000\n"
        "procedure p { if m <= n { s := n - m } }\n"
        "table t {\n| line | n ||\n| one | < 4 ||\n| two | >= 4 ||\n}\n"
    )
    program = program_of(text)
    certificate = certificate_of(program)
    [left] = certify(program, certificate).unchecked
    assert left.name == "procedure `p`: `s` stays in 0 .. 1000000"
    assert cvc5_says(left.question) == "unsat"
    assert not {left.name} & set(certify(program, certificate).checked)
    assert certify(program, certificate, by_cvc5).whole
    assert certify(program, certificate, lambda _: CaseAnswer.UNKNOWN).unchecked == (left,)
    assert certify(program, certificate, lambda _: CaseAnswer.SOME).problems


def test_what_rests_on_an_obligation_that_is_not_checked_is_not_checked() -> None:
    text = (
        "input n : int 0 .. 1000000\ninput m : int 0 .. 1000000\nstate s : int 0 .. 1000000\n"
        "state u : int 1 .. 1000001\nprocedure p { if m <= n { s := n - m; u := s + 1 } }\n"
        "table t {\n| line | n ||\n| one | < 4 ||\n| two | >= 4 ||\n}\n"
    )
    program = program_of(text)
    certificate = certificate_of(program)
    left = {claim.name for claim in certify(program, certificate).unchecked}
    assert left == {
        "procedure `p`: `s` stays in 0 .. 1000000",
        "procedure `p`: an operand stays in its 64 bits",
        "procedure `p`: the result of `+` stays in its 64 bits",
        "procedure `p`: `u` stays in 1 .. 1000001",
    }
    assert certify(program, certificate, by_cvc5).whole


def test_the_digest_is_of_every_field_that_equality_looks_at(owing: tuple[Program, dict[str, Any]]) -> None:
    program, seen = owing[0], set[tuple[str, str]]()

    def changed(value: Any) -> list[Any]:
        """The value with one field changed, for every field that it or a part has and none of its kind had before."""
        if isinstance(value, tuple):
            return [
                (*value[:at], other, *value[at + 1 :])
                for at, one in enumerate(value)
                for other in changed(one)
            ]
        if not is_dataclass(value) or isinstance(value, type):
            return []
        found = []
        for field in fields(value):
            part = getattr(value, field.name) if field.compare else None
            found += [replace(value, **{field.name: other}) for other in changed(part)]
            if field.compare and (type(value).__name__, field.name) not in seen:
                seen.add((type(value).__name__, field.name))
                found.append(replace(value, **{field.name: ("another",)}))
        return found

    others = changed(program)
    assert len(others) > 80
    assert len({digest(program), *map(digest, others)}) == len(others) + 1
    assert digest(replace(program, file="elsewhere.rcs")) == digest(program)


@pytest.mark.parametrize("seed", range(2))
def test_attacks_on_random_programs_fail(seed: int) -> None:
    attack = Attack(random.Random(seed))  # noqa: S311 - the same attacks in every run
    attack.run(5)
    assert attack.failures == []
    assert attack.counts["true"] == 5


FALSE = [  # small programs, each wrong in one way, and how the judge of the attacks calls that
    ("procedure p { s := s + 1 }", "p", "a range"),
    ("procedure p { s := abs(2 / a) }", "p", "a division"),
    ("procedure p { s := k[a] }", "p", "an index"),
    ("procedure p { local n : int 0 .. 2; if a > 0 { n := 1 }; s := n }", "p", "a local"),
    ("procedure p { o := b } procedure q { o := not b }", "p; q", "two writers of o"),
    ("invariant low : s <= 1\nprocedure p { s := 2 }", "p", "an invariant"),
    ("invariant low : s <= 1\nextern procedure p reads a writes s python 'm:f' c 'f'", "p", "an invariant"),
    ("invariant low : s >= 1", "", "an invariant at first"),
    ("assume low proved : s <= 1", "", "low does not follow"),
    ("assume low assumed : a < 0 and a > 0", "", "assumptions contradict"),
    ("procedure p { if a * 6148914691236517205 > 0 { s := 0 } }", "p", "64 bits"),
]


@pytest.mark.parametrize(("declared", "called", "why"), FALSE)
@pytest.mark.parametrize("wrong", [True, False])
def test_the_judge_of_the_attacks_tells_true_from_false(
    declared: str, called: str, why: str, wrong: bool
) -> None:
    head = "input b : bool\ninput a : int -1 .. 2\nstate s : int 0 .. 2\nstate k : array[2] of int 0 .. 1\noutput o : bool\n"
    using = " assuming low" if "assume low" in declared else ""
    body = f"{declared if wrong else ''}\n".replace("'", '"')
    cells = f"| one | true || {called if wrong else ''} |\n| two | false || |\n"
    program = program_of(
        f"{head}{body}table t{using if wrong else ''} {{\n| line | b || procedures |\n{cells}}}\n"
    )
    assert wrong_with(program) == (why if wrong else "")
    if wrong:
        entry = {
            "table": "t",
            "assumptions": [],
            "columns": [],
            "forms": [],
            "tree": [["b", 2, None]],
        }
        made = {
            "format": "rcsc-certificate",
            "version": 3,
            "program": "case",
            "tables": [{**entry, "stops": []}],
        }
        assert not certify(program, signed(program, made)).whole


def test_the_judge_of_the_attacks_counts_lines() -> None:
    text = "input a : int 0 .. 3\ntable t {{\n| line | a ||\n| one | < 2 ||\n| two | {} ||\n}}\n"
    said = {cell: wrong_with(program_of(text.format(cell))) for cell in (">= 2", "> 2", ">= 1")}
    assert said == {">= 2": "", "> 2": "0 lines of t", ">= 1": "2 lines of t"}


# --- the checker's arithmetic --------------------------------------------------------------

WIDE = (
    "input c : int -9223372036854775808 .. 9223372036854775807\ninput u : int 0 .. 18446744073709551615\n"
    "input a : int -7 .. 9\ninput x : real -1.5 .. 2.5\ninput y : real 0.0 .. 1e300\ninput z : real -1e-310 .. 3.0\n"
)
NUMBERS = [
    "a + c", "a - c", "a * c", "c * c", "-c", "abs(c)", "c / a", "a / c", "c mod a", "a mod c", "min(a, c)",
    "max(c, a)", "u - 1", "u / 3", "u mod 7", "int(x)", "int(y)", "int(x * 1e30)", "min(a, 3) * abs(a - 4)",
    "int(real(c))", "int(z / x)",
]  # fmt: skip
DOUBLES = [
    "x + y", "x - y", "y * y", "x * z", "x / z", "z / x", "y / y", "-x", "abs(z)", "min(x, y)", "max(x, z)",
    "min(x / z, y)", "max(y, x / z)", "min(y * y - y * y, x)", "max(x, y * y - y * y)", "real(c)", "real(u)",
    "real(a) / 3.0", "x * 0.1 + z",
]  # fmt: skip


def points(program: Program) -> list[dict[str, Any]]:
    """Ends, zeros and some values between, in many combinations."""
    drawn = random.Random(7)  # noqa: S311 - the same points in every run
    found = []
    for _ in range(60):
        point: dict[str, Any] = {}
        for leaf in program.variables:
            low, high = leaf.type.low, leaf.type.high  # type: ignore[union-attr]  # numbers only
            near = [0, 1, -1, 2, 0.5, 1e-310, -1e-310, 1e200, 3, 2**53 + 1, 2**63, drawn.uniform(-2, 3)]
            some = [
                low,
                high,
                *(kind(each) for each in near for kind in [type(low)] if low <= kind(each) <= high),
            ]
            point[leaf.name] = drawn.choice(some)
        found.append(point)
    return found


def expression(program: Program) -> Any:
    """What the program's procedure assigns."""
    [statement] = program.procedures[0].body
    return statement.value  # type: ignore[union-attr]  # an assignment


def equals(terms: Terms, term: Term, value: Value) -> Term:
    """The condition that the term has this value."""
    return terms.make("=", term, terms.constant(term.sort, value))


@pytest.mark.parametrize("text", [*NUMBERS, *DOUBLES])
def test_values_spans_and_questions_are_the_interpreters(text: str) -> None:
    kind = "int -9223372036854775808 .. 9223372036854775807" if text in NUMBERS else "real -1e308 .. 1e308"
    program = program_of(f"{WIDE}state s : {kind}\nprocedure p {{ s := {text} }}\n")
    start = Start(program)
    run = Run(start, "p")
    term = run.evaluate(expression(program))
    owed = start.terms.every(start.terms.follows(debt.path, debt.good) for debt in run.owed)
    span = KnownSpans((), ()).span(term)
    asked = 0
    for point in points(program):
        cases = {
            start.leaves[n]: np.array([v], dtype=object if type(v) is int else float)
            for n, v in point.items()
        }
        if not values_in(owed, cases, 1)[0]:
            continue
        expected, found = evaluate(expression(program), point), values_in(term, cases, 1)[0]
        if isinstance(expected, float) and isnan(expected):
            assert isnan(found), point
            assert span is None, point
            continue
        assert found == expected, point
        assert span is None or span[0] <= expected <= span[1], point
        if asked < 3:
            asked += 1
            fixed = [equals(start.terms, leaf, point[leaf.name]) for leaf in cases]
            other = start.terms.negation(equals(start.terms, term, expected))
            assert cvc5_says(script([*fixed, other])) == "unsat", point
    assert asked == 3 or text in {"c * c", "a * c"}


def test_whether_a_double_has_a_whole_number_in_64_bits_is_asked_of_doubles() -> None:
    text = "input x : real -1e30 .. 1e30\nstate s : int -9 .. 9\nprocedure p { s := int(x) }\n"
    program = program_of(text)
    start = Start(program)
    run = Run(start, "p")
    run.evaluate(expression(program))
    [owed] = run.owed
    for x, said in ((-(2.0**63), "unsat"), (-(2.0**64), "sat")):
        here = equals(start.terms, start.leaves["x"], x)
        assert cvc5_says(script([here, start.terms.negation(owed.good)])) == said


TOLD = [
    "a < 3", "not (a < 3)", "c > a", "not (c <= a and a > 2)", "a in {1, 4} or a = 2", "not (a in {-7, 9})", "a = c",
    "a /= -7", "c >= a and a >= 5", "x < y", "not (x < y)", "not (y * y - y * y < 1.0)",
    "y * y - y * y < 1.0 or a > 3", "not (y * y - y * y >= 0.0)", "x / z > 1.0", "x = z",
    "not (x <= 0.0) and x < 1.0", "a > 3 implies c = 7", "(a < 0) = (x < 0.0)", "min(a, c) > 2",
    "max(x, y * y - y * y) < 2.0", "a > 5 or a < 3",
]  # fmt: skip


@pytest.mark.parametrize("condition", TOLD)
def test_what_a_condition_tells_of_spans_is_so_wherever_it_holds(condition: str) -> None:
    program = program_of(f"{WIDE}assume here assumed : {condition}\n")
    start = Start(program)
    known = [start.condition(program.assumptions[0].condition)]
    spans, everything = KnownSpans(known, ()), parts_first(*known)
    assert not spans.impossible
    holding = 0
    for point in points(program):
        cases = {
            start.leaves[n]: np.array([v], dtype=object if type(v) is int else float)
            for n, v in point.items()
        }
        if values_in(known[0], cases, 1)[0]:
            holding += 1
            for term in everything:
                value, span = values_in(term, cases, 1)[0], spans.span(term)
                assert span is None or span[0] <= value <= span[1], (term, value, span)
    assert holding


# --- assumptions that stop a cycle --------------------------------------------------------

STOPPED = """
input a : int 0 .. 9
input b : int 0 .. 9
state s : int 0 .. 9
assume nonzero monitored : b /= 0
assume low monitored : a <= 8
assume elsewhere monitored : a >= 0
procedure p { s := a / b }
table t assuming low, nonzero {
  | line | a    || procedures |
  | one  | < 4  || p          |
  | two  | >= 4 ||            |
}
"""


def test_safety_is_checked_under_the_assumptions_that_stop_and_no_others() -> None:
    program = program_of(STOPPED)
    certificate = certificate_of(program)
    [entry] = certificate["tables"]
    assert entry["stops"] == ["nonzero"]
    found = certify(program, certificate)
    assert found.whole
    assert found.rests_on == ("table `t`: a cycle in which `nonzero` fails is stopped",)

    def with_stops(*names: str) -> dict[str, Any]:
        return signed(program, {**certificate, "tables": [{**entry, "stops": list(names)}]})

    for names in (tuple[str, ...](), ("low",)):
        [problem] = certify(program, with_stops(*names)).problems
        assert problem.startswith("line `one` of table `t`: the divisor is not zero: does not hold where")
    for other_names in (("elsewhere",), ("low", "nonzero"), ("nonzero", "nonzero"), ("unknown",)):
        [problem] = certify(program, with_stops(*other_names)).problems
        assert problem.startswith("table `t` cannot stop at")
    assert certify(program, with_stops("nonzero", "low")).whole  # as executors that stop at both would be
    executors = {"t": (AssumptionName("nonzero"),)}
    assert certify(program, certificate, stops=executors).whole
    for other in (with_stops("nonzero", "low"), with_stops()):
        assert "stops elsewhere" in certify(program, other, stops=executors).problems[0]


@pytest.mark.parametrize("cut", [0.5, 4.5, -30, 41, True, None, "4"])
def test_a_split_is_of_whole_numbers_inside_its_region(cut: Any) -> None:
    program = program_of(
        "input a : int 0 .. 9\ntable t {\n| line | a ||\n| one | < 5 ||\n| two | > 5 ||\n}\n"
    )
    entry = {"table": "t", "assumptions": [], "stops": [], "columns": ["a"], "forms": [[[0, 1]]]}
    made = {"format": "rcsc-certificate", "version": 3, "program": "case"}
    tree = [["s", 0, cut], ["l", 0], ["l", 1]]
    assert certify(program, signed(program, {**made, "tables": [{**entry, "tree": tree}]})).problems
    good = program_of("input a : int 0 .. 9\ntable t {\n| line | a ||\n| one | < 5 ||\n| two | >= 5 ||\n}\n")
    tree = [["s", 0, 4], ["l", 0], ["l", 1]]
    assert certify(good, signed(good, {**made, "tables": [{**entry, "tree": tree}]})).whole


def test_a_region_with_one_point_is_not_empty() -> None:
    head = "input x : int -5 .. 5\ninput y : int -5 .. 5\ntable t {\n| line | when ||\n| two | x - y < 0 ||\n"
    entry: dict[str, Any] = {"table": "t", "assumptions": [], "stops": [], "columns": ["x", "y"]}
    entry["forms"] = [[[0, 1], [1, -1]], [[0, 1]], [[1, 1]]]
    made = {"format": "rcsc-certificate", "version": 3, "program": "case"}
    empty = ["e", [[0, -1], [1, 1], [2, -1]]]  # x - y >= 0, x <= 0 and y >= 0 leave the point 0, 0
    for condition, last, right in (
        ("x - y >= 0", ["l", 1], True),
        ("x - y >= 0 and not (x = 0 and y = 0)", empty, False),
        ("x - y >= 0 and not (x = 0 and y = 0)", ["e", [[0, 0.5]]], False),
        ("x - y >= 0 and not (x = 0 and y = 0)", ["e", [[-1, 1]]], False),
    ):
        program = program_of(f"{head}| one | {condition} ||\n}}\n")
        tree = [["s", 0, -1], ["l", 0], ["s", 1, 0], ["s", 2, -1], ["l", 1], last, ["l", 1]]
        found = certify(program, signed(program, {**made, "tables": [{**entry, "tree": tree}]}))
        assert found.whole is right, found
        assert right or "['e'" in found.problems[0] or "malformed tree" in found.problems[0]


@pytest.mark.parametrize(("more", "right"), [("", True), (" and (y > 0 or x < -2)", False)])
def test_only_boxes_are_counted(more: str, right: bool) -> None:
    program = program_of(
        "input x : int -5 .. 5\ninput y : int -5 .. 5\n"
        f"table t {{\n| line | when ||\n| one | x >= 0 ||\n| two | x < 0{more} ||\n}}\n"
    )
    entry = {
        "table": "t",
        "assumptions": [],
        "stops": [],
        "columns": [],
        "forms": [],
        "tree": [["b", 11, None]],
    }
    made = {"format": "rcsc-certificate", "version": 3, "program": "case", "tables": [entry]}
    assert certify(program, signed(program, made)).whole is right


def test_a_condition_of_one_leaf_that_is_undefined_for_some_value_is_certified() -> None:
    program = program_of(
        "input a : int 0 .. 9\nassume some monitored : a /= 0\n"
        "table t assuming some {\n| line | 6 / a ||\n| one | < 2 ||\n| two | >= 2 ||\n}\n"
    )
    certificate = certificate_of(program)
    assert certificate["tables"][0]["columns"] != ["a"]
    assert certify(program, certificate).whole


def _condition(rng: random.Random, depth: int) -> str:
    """Draw a condition in which parts come again, as themselves and as their opposites."""
    if depth == 0:
        return rng.choice(("q", "p", "n > 1", "n = 2", "n < m"))
    first, second = _condition(rng, depth - 1), _condition(rng, depth - 1)
    shape = rng.choice(
        ("(not ({0})) and ({0}) or {1}", "({0}) and ({1})", "({0}) or ({1})", "({0}) xor ({1})")
    )
    return shape.format(first, second)


@pytest.mark.parametrize("default", ["| no | false ||", "| no | DEFAULT ||"])
def test_what_is_proved_of_any_condition_is_certified(default: str) -> None:
    rng = random.Random(7)  # noqa: S311  # no secret
    for _ in range(60):
        heading = _condition(rng, rng.randint(1, 3))
        text = (
            "input q : bool\ninput p : bool\ninput n : int 0 .. 3\ninput m : int 0 .. 3\n"
            f"table t {{\n| line | {heading} ||\n| yes | true ||\n{default}\n}}\n"
        )
        program = compile_text(text)
        if not isinstance(program, Program):
            continue  # no value satisfies a cell
        certificate = prove_program(program, Options()).certificate
        assert certificate is None or not certify(program, certificate).problems, text


def test_a_procedure_that_only_a_procedure_calls_owes_nothing_by_itself() -> None:
    program = program_of(
        "input a : int 0 .. 9\nstate s : int 0 .. 9\nprocedure more(k : int 0 .. 9) { s := k + 4 }\n"
        "procedure p { more(5) }\n"
        "table t {\n| line | a || procedures |\n| one | < 4 || p |\n| two | >= 4 || |\n}\n"
    )
    assert certify(program, certificate_of(program)).whole


def test_a_condition_of_one_leaf_that_is_defined_is_tried_at_every_value() -> None:
    program = program_of(
        "input a : int -9 .. 5\ntable t {\n| line | a * a ||\n| one | < 30 ||\n| two | >= 30 ||\n}\n"
    )
    certificate = certificate_of(program)
    assert certificate["tables"][0]["columns"] == ["a"]
    assert certify(program, certificate).whole


def test_assumptions_are_shown_to_hold_together_at_values_of_the_types() -> None:
    program = program_of(STOPPED)
    certificate = certificate_of(program)
    [entry] = certificate["tables"]
    assert certify(
        program, signed(program, {**certificate, "tables": [{**entry, "witness": {"a": 8, "b": 1}}]})
    ).whole
    wrong: list[Any] = [
        {"a": 9, "b": 1}, {"a": 8, "b": 0}, {}, {"b": 10}, {"b": -1}, {"b": True}, {"b": 1.5}, {"b": "1"},
        None, [1],
    ]  # fmt: skip
    for witness in wrong:
        made = signed(program, {**certificate, "tables": [{**entry, "witness": witness}]})
        assert certify(program, made).problems, witness


@pytest.mark.parametrize(
    ("safe", "right"), [("", True), ("safe 1", True), ("safe 9", True), ("safe 0", False)]
)
def test_invariants_hold_where_outputs_show_their_safe_values(safe: str, right: bool) -> None:
    def with_safe(said: str) -> Program:
        return program_of(
            f"input a : int 0 .. 9\noutput o : int 0 .. 9 = 1 {said}\ninvariant lit : o >= 1\nprocedure p {{ o := 2 }}\n"
            "table t {\n| line | a || procedures |\n| one | < 4 || p |\n| two | >= 4 || |\n}\n"
        )

    program = with_safe(safe)
    assert bool(wrong_with(program)) is not right
    found = certify(program, signed(program, certificate_of(with_safe(""))))
    assert found.whole is right
    assert right or "showing safe values after a fault: invariant `lit`" in found.problems[0]


def test_an_expression_that_is_gone_lends_its_meaning_to_no_other() -> None:
    program = program_of(RELATED)
    start = Start(program)
    for variable in (*program.variables, *program.variables) * 20:
        assert start.condition(Read(variable.name, variable.type)) is start.leaves[variable.name]


def test_obligations_of_one_name_are_each_asked() -> None:
    program = program_of(
        "input n : int 0 .. 1000000\ninput m : int 0 .. 1000000\nstate s : int 0 .. 1000000\n"
        "procedure p { if m <= n { s := n - m }\n if n <= m { s := m - n } }\n"
        "table t {\n| line | n ||\n| one | < 4 ||\n| two | >= 4 ||\n}\n"
    )
    certificate = certificate_of(program)
    asked: list[str] = []

    def ask(question: str) -> CaseAnswer:
        asked.append(question)
        return CaseAnswer.UNKNOWN

    left = certify(program, certificate, ask).unchecked
    assert len(left) == 2
    assert {claim.question for claim in left} == set(asked)
    assert len({claim.name for claim in left}) == 2


def with_steps(count: int, step: str) -> Program:
    """A program whose procedure takes the same step so many times."""
    return program_of(
        f"input a : int 0 .. 9\nstate s : int 0 .. 999\nprocedure p {{ {' '.join([step] * count)} }}\n"
        "table t {\n| line | a || procedures |\n| one | < 4 || p |\n| two | >= 4 || |\n}\n"
    )


def test_a_long_run_is_followed_in_one_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[Term] = []
    found = KnownSpans._span_of

    def counted(known: KnownSpans, term: Term) -> Any:
        looked.append(term)
        return found(known, term)

    monkeypatch.setattr(KnownSpans, "_span_of", counted)
    counts = []
    for count in (50, 100):
        program = with_steps(count, "s := s / 2 + a")
        certificate = certificate_of(program)
        looked.clear()
        assert certify(program, certificate).whole
        counts.append(len(looked))
    assert counts[1] < 2.5 * counts[0]


def test_work_has_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    program = with_steps(30, "if s > a { s := s / 2 + a }")
    certificate = certificate_of(program)
    assert certify(program, certificate).whole
    monkeypatch.setattr("rcsc.proof.certify.MOST_WORK", 2_000)
    cut = certify(program, certificate)
    assert cut.problems == ()
    assert cut.unchecked
    assert not {claim.name for claim in cut.unchecked} & set(cut.checked)
    assert cut == certify(program, certificate)


STATE = """
enum colour {{ red, green, blue }}
state i : int -1 .. 3
state j : int 0 .. 3
state c : colour
state b : bool
state n : int 0 .. 3
state k : array[3] of int 0 .. 3
procedure put(m : int 0 .. 2) {{ k[m] := 3 - m n := m }}
procedure p {{ {body} }}
"""
BODIES = [
    "n := k[i]", "n := k[1]", "k[i] := j", "k[2] := j", "k[i] := k[j]", "k[k[i]] := 3", "for q in 0 .. 2 { k[q] := k[i] + q }",
    "for q in 0 .. 1 { k[q] := k[q + 1] } n := k[2]", "case i { 0 { n := 1 } 1, 2 { n := 2 } } k[n] := 0",
    "case c { red { n := i } green { k[j] := 1 } blue { b := true } }", "if b { n := i } if not b { k[i] := 1 } else { k[0] := n }",
    "local m : int 0 .. 2 := j k[m] := 1 n := k[2]", "local m : int 0 .. 3 if b { m := 1 } k[0] := m", "put(j)", "put(1) k[j] := n",
    "put(i + 1) if k[1] = 2 { n := 3 }", "n := 3 - i", "n := j / i", "n := 7 mod k[j]", "b := j > 1 and 6 / j > i or k[0] = i c := green",
    "b := b implies i in {0, 2} n := min(j, 2) k[0] := max(i, 0)", "n := abs(i) + -i",
    "local m : int -3 .. 3 := -i n := m", "b := k[j] = 0 and b", "for q in 0 .. 2 { if k[q] < j { k[q] := q n := q } }",
    "if i > 0 { if b { n := 1 } else { n := i - 1 } } else { n := 2 }", "for q in 0 .. 3 { if q < i { n := k[q] } }",
    "n := i", "local m : int 0 .. 3 := j case m { 0 { n := 1 } 1, 2 { n := 2 } 3 { k[m - 1] := 0 } }", "for q in 2 .. 3 { n := q }",
]  # fmt: skip


@pytest.mark.parametrize("body", BODIES)
def test_a_run_leaves_what_the_interpreter_does_wherever_it_owes_nothing(body: str) -> None:
    program = program_of(STATE.format(body=body))
    start = Start(program)
    run = Run(start, "p")
    run.call(start.procedures["p"], ())
    owed = start.terms.every(start.terms.follows(debt.path, debt.good) for debt in run.owed)
    types = {str(v.name): v.type for v in program.variables}
    drawn = random.Random(body)  # noqa: S311 - the same states in every run
    every = list(product(*(range(key_bounds(kind)[0], key_bounds(kind)[1] + 1) for kind in types.values())))
    before = [
        {name: value_of_key(kind, key) for (name, kind), key in zip(types.items(), keys, strict=True)}
        for keys in drawn.sample(every, 300)
    ]
    cases = {start.leaves[name]: np.array([one[name] for one in before]) for name in types}
    names = [*run.state.leaves]
    kept, *after = (
        np.broadcast_to(values_in(term, cases, len(before)), len(before))
        for term in (owed, *(run.state.leaves[name] for name in names))
    )
    assert kept.any()
    for number, state in enumerate(before):
        now = dict(state)
        try:
            call(program, "p", [], now)
        except (ArithmeticError, IndexError, KeyError):
            assert not kept[number], state
            continue
        if kept[number]:
            assert now == state | {name: found[number] for name, found in zip(names, after, strict=True)}
        if "put" not in body and "local" not in body:  # what is out of its range stays there
            assert all(0 <= value <= 3 for name, value in now.items() if name[0] in "nk") == kept[number], (
                state
            )


# --- what a leaf of a tree leaves to be settled ---------------------------------------------

MIXED = """
enum colour {{ red, green, blue }}
input c : colour
input p : bool
input r : real 0.0 .. 1.0
input s : real 0.0 .. 1.0
input x : int -1 .. 2
input y : int 0 .. 2
{assumption}
table t {{
  | line | when ||
  | one | {0} ||
  | two | {1} ||
  | three | {2} ||
{default}}}
"""
SOME_CONDITIONS = (
    "x * y > 1", "x * x = y", "(x + y) mod 2 = 0", "r < s", "r + s >= 0.75", "r = s and p",
    "c = colour.green", "not p", "x < y or p", "x <= 0",
)  # fmt: skip
SOME_VALUES: dict[str, tuple[Value, ...]] = {
    "c": (0, 1, 2), "p": (False, True), "r": (0.0, 0.5, 1.0), "s": (0.0, 0.5, 0.75), "x": (-1, 0, 1, 2), "y": (0, 1, 2),
}  # fmt: skip
SOME_FORMS = [
    {"c": 1}, {"p": 1}, {"r": 1}, {"s": -1}, {"x": 1}, {"y": -1}, {"r": 1, "s": -1}, {"r": -1, "s": 1}, {"r": 1, "s": 1}, {"x": 1, "y": -2},
    {"x": -3, "y": 1}, {"p": 2, "x": 1}, {"c": 1, "y": 1},
]  # fmt: skip


POINTS = [dict(zip(SOME_VALUES, values, strict=True)) for values in product(*SOME_VALUES.values())]


def cuts(form: dict[str, int], at: list[int]) -> list[int]:
    """Where the form may be split, whose values at the points are given; zero and one below for a difference of reals."""
    between_reals = form in ({"r": 1, "s": -1}, {"r": -1, "s": 1})
    return [*sorted(set(at))[:-1], *([-1, 0] if between_reals else [])]


def split(start: Start, form: dict[str, int], cut: int) -> TableChecker:
    """Check the certificate of the program's table that splits at one form, and leaves both sides to be asked."""
    names = list(form)
    entry = {
        "assumptions": [str(assumption.name) for assumption in start.program.assumptions],
        "columns": names,
        "forms": [[[number, form[name]] for number, name in enumerate(names)]],
        "tree": [["s", 0, cut], ["z"], ["z"]],
    }
    checker = TableChecker(start, start.program.tables[0], entry)
    checker.check()
    return checker


@given(
    st.lists(st.sampled_from(SOME_CONDITIONS), min_size=3, max_size=3),
    st.sampled_from(["", "| d | DEFAULT ||\n", "| d | DEFAULT unreachable ||\n"]),
    st.sampled_from(["", "x <= y", "p or r > s"]),
    st.sampled_from(SOME_FORMS),
    st.data(),
)
def test_each_region_that_is_left_is_asked_of_all_its_inputs(
    lines: list[str], default: str, assumed: str, form: dict[str, int], data: st.DataObject
) -> None:
    """Both questions of a split, at every input: the hypotheses hold in the region, and what is owed wherever one line matches."""
    claim = f"assume it assumed : {assumed}" if assumed else ""
    text = MIXED.format(*lines, assumption=claim, default=default)
    program = program_of(edited(text, ("table t", "table t assuming it")) if assumed else text)
    start, table = Start(program), program.tables[0]
    kinds = {name: program.variable(name).type for name in form}
    at = [sum(k * key_of(kinds[name], point[name]) for name, k in form.items()) for point in POINTS]
    cut = data.draw(st.sampled_from(cuts(form, at)))
    checker = split(start, form, cut)
    cases = {start.leaves[name]: np.array([point[name] for point in POINTS]) for name in SOME_VALUES}
    for debt, side in zip(checker.questions, (True, False), strict=True):
        [owed] = debt.owed
        known, good = (
            np.broadcast_to(values_in(term, cases, len(POINTS)), len(POINTS))
            for term in (start.terms.every(debt.hypotheses), owed.good)
        )
        for number, point in enumerate(POINTS):
            matching = len(matching_lines(table, point))
            if (at[number] <= cut) == side and all(holds(a.condition, point) for a in program.assumptions):
                assert known[number], point
                assert good[number] == (matching == 1 or (matching == 0 and not checker.cover)), point
            elif "r" not in form or len(form) == 1:
                assert not known[number], point  # what is left is no more than the region


# --- nothing in a certificate is passed over -------------------------------------------------


def changes(node: Any) -> Iterator[tuple[str, Any]]:
    """Every way to say one thing otherwise, or more; how, and the whole as it is then."""
    others: list[tuple[str, Any]] = [("odd", "x"), ("odd", None), ("odd", []), ("odd", {})]
    if type(node) is int:
        others += [("type", float(node)), *([("type", bool(node))] if node in {0, 1} else [])]
    yield from ((how, other) for how, other in others if other != node or type(other) is not type(node))
    if isinstance(node, dict):
        yield "more", node | {"more": 1}
        yield from (("less", {key: value for key, value in node.items() if key != name}) for name in node)
    if isinstance(node, list):
        yield "more", [*node, 0]
        yield "more", [*node, *node[-1:]] if node else ["x"]
    parts = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for at, part in parts:
        for how, other in changes(part):
            made = copy.copy(node)
            made[at] = other
            yield how, made


WITNESSED = """
input a : int 0 .. 9
input b : int 0 .. 9
state s : int 0 .. 9
invariant low : s <= 8
assume apart monitored : a < b
table t assuming apart {
| line | a - b || s |
| one  | < -3  ||   |
| two  | >= -3 ||   |
| more | > 0   || 2 |
}
"""


@pytest.mark.parametrize(
    "text", [BOXES, RELATED, WITNESSED, STOPPED], ids=["boxes", "related", "witnessed", "stopped"]
)
def test_whatever_is_said_otherwise_or_besides_is_refused(text: str) -> None:
    """Also where the values are equal for Python; but for another proof of the same, each part of which is checked."""
    program = program_of(text)
    certificate = certificate_of(program)
    assert certify(program, certificate).whole
    accepted = [
        (how, made) for how, made in changes(certificate) if made != certificate or how == "type"
        if not certify(program, made).problems
    ]  # fmt: skip
    assert accepted == []


def near(node: Any, words: Sequence[str], at: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Every way to say one thing a little otherwise, as another certificate might; where, and the whole as it is then."""
    match node:
        case bool():
            yield at, not node
        case int():
            yield from ((at, node + by) for by in (-1, 1))
        case str():
            yield from ((at, word) for word in words if word != node)
        case list():
            yield from ((at, node[:k] + node[k + 1 :]) for k in range(len(node)))
            pairs = (k for k in range(len(node) - 1) if node[k] != node[k + 1])
            yield from ((at, [*node[:k], node[k + 1], node[k], *node[k + 2 :]]) for k in pairs)
    parts = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, part in parts:
        for where, other in near(part, words, (*at, key)):
            made = copy.copy(node)
            made[key] = other
            yield where, made


def texts_of(node: Any) -> Iterator[str]:
    if isinstance(node, dict | list):
        for part in node.values() if isinstance(node, dict) else node:
            yield from texts_of(part)
    elif isinstance(node, str):
        yield node


def is_right(program: Program, where: tuple[Any, ...], entry: Any) -> bool:
    """Whether what stands there now is another right proof, as the interpreter sees it: at every input, or at those that are named."""
    [table] = program.tables
    conditions = {str(one.name): one.condition for one in program.assumptions}
    assumed = [conditions[name] for name in entry["assumptions"]]
    first = initial(program)
    if where[2] == "witness":
        owed = [
            *(conditions[name] for name in table.assumptions),
            *(one.condition for one in program.invariants),
        ]
        return all(holds(condition, first | entry["witness"]) for condition in owed)
    if where[2] != "tree":
        return False
    for values in product(*(range(lo, hi + 1) for lo, hi in (key_bounds(v.type) for v in program.variables))):
        now = first | dict(zip((v.name for v in program.variables), values, strict=True))
        kind, of, *_ = _reached(entry, now)
        lines = [
            all(test is None or holds(test.condition, now) for test in line.tests) for line in table.lines
        ]
        if not (not holds(assumed[of], now) if kind == "a" else lines[of] and sum(lines) == 1):
            return False
    return True


def _reached(entry: Any, now: Any) -> Any:
    """The end of the tree to which an input comes: at a split, low ones go to the first part."""
    at, tree = 0, entry["tree"]
    while tree[at][0] == "s":
        _, form, most = tree[at]
        at += 1
        if sum(int(now[entry["columns"][column]]) * by for column, by in entry["forms"][form]) > most:
            open_ = 1  # passes over the first part
            while open_:
                open_ += 1 if tree[at][0] == "s" else -1
                at += 1
    return tree[at]


@pytest.mark.parametrize(
    ("text", "rights"),
    [(BOXES, 0), (RELATED, 4), (WITNESSED, 3), (STOPPED, 2)],
    ids=["boxes", "related", "witnessed", "stopped"],
)
def test_whatever_is_said_a_little_otherwise_is_refused_or_right(text: str, rights: int) -> None:
    """A number by one, another word of the certificate's, two parts in the other order, a part less: each that is accepted is judged."""
    program = program_of(text)
    certificate = certificate_of(program)
    made = list(near(certificate, sorted(set(texts_of(certificate)))))
    accepted = [(where, other) for where, other in made if not certify(program, other).problems]
    assert [where for where, other in accepted if not is_right(program, where, other["tables"][0])] == []
    assert len(accepted) == rights


@pytest.mark.parametrize("of", ["form", "column", "assumption", "program", "witness", "twice"])
def test_what_a_proof_does_not_use_is_in_no_certificate(of: str, tmp_path: Path) -> None:
    program = program_of(RELATED)
    made = copy.deepcopy(certificate_of(program))
    [entry] = made["tables"]
    if of == "form":
        entry["forms"].append([[0, 1], [len(entry["columns"]) - 1, 7]])
    elif of == "column":
        entry["columns"].append("far")
    elif of == "assumption":
        entry["assumptions"].append(entry["assumptions"][0])
    elif of == "program":
        made["program"] = "another"
    elif of == "witness":
        entry["witness"]["far"] = True
    else:
        text = json.dumps(made)
        (tmp_path / "c.json").write_text(
            text[:-1] + f', "meaning": {json.dumps(made["meaning"])}}}', encoding="utf-8"
        )
        with pytest.raises(Malformed, match="two values for `meaning`"):
            json_of((tmp_path / "c.json").read_bytes())
        return
    assert certify(program, made).problems
