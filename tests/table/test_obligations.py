"""What procedures, lines and conditions owe: each kind found at its line, and nothing found where all is well."""

import operator
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
import z3
from hypothesis import given, settings
from hypothesis import strategies as st

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic
from rcsc.base.diagnostics.source import Source, Span
from rcsc.front.commands import run
from rcsc.lang.expressions.intervals import may_be_undefined
from rcsc.lang.model import NOWHERE, Apply, Int, OneTable, Op, Real, Scalar, Single
from rcsc.lang.operator_table import Arithmetic
from rcsc.proof.procedures import discharge
from rcsc.proof.procedures.discharge import Asker, Discharge
from rcsc.proof.procedures.obligations import Obligations
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import TOGETHER, Limits, Options
from rcsc.proof.solvers.smt import Answer, Solver, Term
from rcsc.proof.symbolic import values
from rcsc.proof.symbolic.encode import declared, encode, least_where, within
from rcsc.proof.symbolic.evaluation import Obligation
from rcsc.proof.symbolic.execution import Run
from rcsc.proof.symbolic.remembered import Answers, remembering
from rcsc.proof.symbolic.values import Node
from rcsc.proof.table.program import prove_program
from tests.support.programs.stages import BOXES, codes, drawn_program, program_of, verdict_of
from tests.support.programs.texts import edited
from tests.support.strategies import INTS, REALS, Names, integers_over, reals_over

VARIABLES = """
enum colour { red, green, blue }
input a : int 0 .. 9
input b : int -5 .. 5
input big : int 0 .. 9223372036854775807
input wide : int 0 .. 18446744073709551615
input low : int -9223372036854775808 .. 9223372036854775807
input yes : bool
input c : colour
input x : real 0.0 .. 500.0
input y : real -1.0 .. 1.0
state n : int 0 .. 9
state m : int -100 .. 100
state s : int -9223372036854775808 .. 9223372036854775807
state u : int 0 .. 18446744073709551615
state r : real 0.0 .. 500.0
state xs : array[4] of int 0 .. 9
output out : int 0 .. 9
"""


def body(statements: str, options: Options = BOXES) -> tuple[Diagnostic, ...]:
    """Findings on a procedure of its own, over `VARIABLES`."""
    return verdict_of(f"{VARIABLES}procedure p {{\n{statements}\n}}\n", options).findings


RIGHT = [
    "n := a",
    "n := min(a + 1, 9)",
    "if a < 9 { n := a + 1 }",
    "if a = 0 { n := 0 } else { n := 9 / a }",
    "if not (a = 0) { n := 9 / a }",
    "if b /= 0 and 100 / b > 3 { n := 1 }",
    "if b = 0 or 100 / b > 3 { n := 1 }",
    "if b /= 0 implies 100 / b > 3 { n := 1 }",
    "if b /= 0 { m := 100 / b }",
    "m := -7 / 2 * 2 + -7 mod 2",
    "if a < 4 { xs[a] := 1 }",
    "if a < 4 { n := xs[a] }",
    "if a in {1, 2} { xs[a] := a }",
    "for i in 0 .. 3 { xs[i] := i }",
    "local k : int 0 .. 9 if yes { k := 1 } else { k := 2 } n := k",
    "local k : int 0 .. 9 case c { red { k := 1 } green, blue { k := 2 } } n := k",
    "local k : int 0 .. 9 if yes { k := 1 } if yes { n := k }",
    "case c { red { n := 1 } blue { n := 2 } }",
    "for i in 0 .. 3 { local k : int 0 .. 9 := i n := k }",
    "u := wide / 3",
    "if wide < 100 { u := wide * 2 }",
    "s := low / 2",
    "if low > -9223372036854775808 { s := -low }",
    "r := 0.75 * r + 0.25 * x",
    "if x > 0.0 { r := min(1.0 / (x + 1.0), 500.0) }",
    "if y > 0.5 { r := 1.0 / y }",
    "n := int(x) mod 10",
    "r := real(a)",
    "n := a n := n",
    "m := a - 100",
    "if a >= 5 { n := a - 5 } else { n := 5 - a }",
    "n := 0 for i in 1 .. 20 { n := min(n + i, 9) }",
    "if a * a < 50 { n := a + 2 }",
]


@pytest.mark.parametrize("statements", RIGHT)
def test_nothing_is_owed_where_all_is_well(statements: str) -> None:
    assert codes(body(statements)) == []


WRONG = [
    ("n := a + 1", "RCS413"),
    ("m := 100 / b", "RCS411"),
    ("m := 100 mod b", "RCS411"),
    ("m := 100 / int(yes)", "RCS411"),
    ("if b /= 0 or 100 / b > 3 { n := 1 }", "RCS411"),
    ("if b = 0 implies 100 / b > 3 { n := 1 }", "RCS411"),
    ("if 100 / b > 3 and b /= 0 { n := 1 }", "RCS411"),
    ("if x / y > 1.0 { n := 1 }", "RCS411"),
    ("xs[a] := 1", "RCS412"),
    ("n := xs[a]", "RCS412"),
    ("if a <= 4 { xs[a] := 1 }", "RCS412"),
    ("for i in 1 .. 3 { xs[i] := 1 } xs[0] := 0 if a < 4 { n := 9 / xs[a] }", "RCS411"),
    ("local k : int 0 .. 9 if yes { k := 1 } n := k", "RCS414"),
    ("local k : int 0 .. 9 case c { red { k := 1 } green { k := 2 } } n := k", "RCS414"),
    ("for i in 0 .. 1 { local k : int 0 .. 9 if i = 1 { n := k } k := 1 }", "RCS414"),
    ("s := big * 3 / 3", "RCS410"),
    ("s := big + big - big", "RCS410"),
    ("s := -low", "RCS410"),
    ("s := abs(low)", "RCS410"),
    ("s := big / b", "RCS411"),
    ("if b < 0 { s := low / b }", "RCS410"),
    ("if b < 0 { s := low mod b }", "RCS410"),
    ("s := wide - 1", "RCS410"),
    ("u := wide + 1", "RCS410"),
    ("r := 2.0 * x", "RCS413"),
    ("if y > 0.0 { r := 1.0 / y }", "RCS413"),
    ("if y > 0.0 { n := min(max(int(1.0 / y), 0), 9) }", "RCS410"),
    ("n := 5 - a", "RCS413"),
    ("q(a + 1)", "RCS413"),
    ("for i in 0 .. 3 { n := n + 3 }", "RCS413"),
    ("if a * a < 65 { n := a + 2 }", "RCS413"),
    ("local k : int 0 .. 9 := a + 1", "RCS413"),
    ("local k : int 0 .. 9 if yes { k := 0 } else { k := a + 1 }", "RCS413"),
    ("local k : real 0.0 .. 9.0 k := x", "RCS413"),
    ("xs[0] := a + 1", "RCS413"),
    ("xs[a mod 4] := a + 1", "RCS413"),
]


@pytest.mark.parametrize(("statements", "code"), WRONG)
def test_each_fault_is_found_at_its_place(statements: str, code: str) -> None:
    text = f"{VARIABLES}procedure p {{\n{statements}\n}}\nprocedure q(k : int 0 .. 9) {{ n := k }}\n"
    found = verdict_of(text).findings
    assert set(codes(found)) == {code}
    line = text.splitlines().index(statements) + 1
    assert {Source("case.rcs", text).position(finding.primary.span.start).line for finding in found} == {line}
    assert all(finding.witnesses for finding in found if finding.code is not Code.USE_BEFORE_ASSIGNMENT)


@pytest.mark.parametrize(("orelse", "found"), [("k := 2", []), ("m := 2", ["k"])])
def test_a_local_has_a_value_where_each_branch_gives_it_one(orelse: str, found: list[str]) -> None:
    statements = f"local k : int 0 .. 9 if yes {{ k := 1 }} else {{ {orelse} }} n := k"
    told = body(statements)
    assert [one.code for one in told] == [Code.USE_BEFORE_ASSIGNMENT] * len(found)
    text = f"{VARIABLES}procedure p {{\n{statements}\n}}\n"
    spans = [one.primary.span for one in told]
    assert [text[span.start : span.end] for span in spans] == found


def test_an_index_that_lies_outside_whatever_the_input_is_told() -> None:
    assert codes(body("xs[a + 4] := 1")) == ["RCS412"]


def test_the_witness_is_the_least_in_declared_order() -> None:
    [found] = body("if a > 2 and c /= red { m := 30 / (a - 5) }")
    [column] = found.witnesses
    assert dict(zip(column.variables, column.values, strict=True)) == {"a": "5", "c": "green"}


def test_the_least_witness_of_a_double_is_the_first_that_fails() -> None:
    [found] = body("r := x + 0.5")
    [column] = found.witnesses
    assert column.variables == ("x",)
    assert float(column.values[0]) + 0.5 > 500.0
    assert float(column.values[0]) == 499.50000000000006


def test_what_fails_once_is_not_reported_again_further_on() -> None:
    assert codes(body("m := 100 / b m := 100 / b + 0 n := a + 1 m := n")) == ["RCS411", "RCS413"]


# --- lines -------------------------------------------------------------------------------

GROW = "procedure grow { n := n + 1 }"
TABLE = """
procedure set_out(k : int 0 .. 9) {{ out := k }}
table t {{
  | line | n    | a    || procedures | out |
  | low  | < 9  |      || {low}      |     |
  | high | >= 9 |      || {high}     | {out} |
}}
"""


def table(low: str = "", high: str = "", out: str = "") -> tuple[Diagnostic, ...]:
    grow = GROW if "grow" in low + high else ""
    return verdict_of(VARIABLES + grow + TABLE.format(low=low, high=high, out=out)).findings


def test_a_line_runs_under_its_conditions() -> None:
    assert codes(table(low="grow")) == []
    [found] = table(low="grow", high="grow")
    assert found.code is Code.ASSIGNED_RANGE
    assert found.notes == ("in line `high` of table `t`",)
    assert dict(zip(found.witnesses[0].variables, found.witnesses[0].values, strict=True)) == {"n": "9"}


def test_the_state_carries_over_from_action_to_action() -> None:
    [found, twice] = table(low="grow; grow")
    assert twice.code is Code.TWO_WRITERS
    assert dict(zip(found.witnesses[0].variables, found.witnesses[0].values, strict=True)) == {"n": "8"}
    assert codes(table(high="n := 0; grow; grow")) == ["RCS415"]


def test_a_default_line_runs_where_no_line_matches() -> None:
    text = (
        VARIABLES
        + """
table t {
  | line | n       || procedures      | out |
  | some | 0 .. 5  ||                 | 1   |
  | rest | DEFAULT || n := n - 6      | 2   |
}
"""
    )
    assert "RCS413" not in codes(verdict_of(text).findings)
    assert "RCS413" in codes(verdict_of(edited(text, ("n - 6", "n - 7"))).findings)


@pytest.mark.parametrize(
    ("high", "out", "wrong"),
    [
        ("set_out(1)", "1", False),
        ("set_out(1)", "2", True),
        ("set_out(a)", "a", False),
        ("set_out(a)", "a + 0", False),
        ("set_out(a)", "9 - a", True),
        ("set_out(a); set_out(3)", "", True),
        ("n := a; set_out(n)", "a", False),
        ("set_out(n); n := 0; set_out(n)", "", True),
    ],
)
def test_two_actions_of_a_line_give_an_output_one_value(high: str, out: str, wrong: bool) -> None:
    assert codes(table(high=high, out=out)) == (["RCS415"] if wrong else [])


EACH = " or ".join(f"xs[{at}] * b <= 3 and a = {at}" for at in range(4))


@pytest.mark.parametrize(
    ("second", "wrong"), [(EACH, []), (edited(EACH, ("a = 2", "a > 2")), ["RCS401", "RCS402"])]
)
def test_the_solver_reads_an_array_at_a_changing_place(second: str, wrong: list[str]) -> None:
    program = (
        "input a : int 0 .. 3\ninput b : int -5 .. 5\nstate xs : array[4] of int 0 .. 9\n"
        f"table t {{\n| line | when ||\n| one | xs[a] * b > 3 ||\n| two | {second} ||\n}}\n"
    )
    assert codes(verdict_of(program, Options()).findings) == wrong


STATES = """
record pair { a : int 0 .. 9  b : int 0 .. 9 }
input i : int 0 .. 2
input one : bool
input two : bool
state n : int 0 .. 9
state p : pair
state xs : array[3] of int 0 .. 9
state x : int 0 .. 9 deferred until true
procedure set_n(v : int 0 .. 9) { n := v }
procedure deep(v : int 0 .. 9) { set_n(v) }
procedure if_one { if one { n := 1 } }
procedure if_two { if two { n := 2 } }
procedure later(v : int 0 .. 9) { next x := v }
procedure some(v : int 0 .. 9) { xs[i] := v }
"""


@pytest.mark.parametrize(
    ("actions", "wrong"),
    [
        ("if_one; if_two", "n"),
        ("n := 1; n := 2", "n"),
        ("n := 1; deep(2)", "n"),
        ("deep(i); set_n(i)", ""),
        ("n := i; deep(i + 1)", "n"),
        ("xs[0] := 1; xs[i] := 2", "xs[0]"),
        ("some(1); xs[2] := 3", "xs[2]"),
        ("xs[0] := 1; xs[1] := 2", ""),
        ("p.a := 1; p.a := i", "p.a"),
        ("p.a := 1; p.b := 2", ""),
        ("next x := 1; later(2)", "x.next"),
        ("next x := i; later(i)", ""),
        ("x := 1; next x := 2", ""),
    ],
)
def test_two_actions_of_a_line_give_a_state_one_value(actions: str, wrong: str) -> None:
    text = f"{STATES}table t {{\n| line | when || procedures |\n| all | true || {actions} |\n}}\n"
    found = [each for each in verdict_of(text).findings if each.code is Code.TWO_WRITERS]
    assert [each.message.rpartition(" ")[2] for each in found] == ([f"`{wrong}`"] if wrong else [])


def test_actions_that_never_write_together_are_no_two_writers() -> None:
    text = (
        VARIABLES
        + """
procedure one { if yes { out := 1 } }
procedure two { if not yes { out := 2 } }
table t {
  | line | a    || procedures |
  | all  | >= 0 || one; two   |
}
"""
    )
    assert codes(verdict_of(text).findings) == []
    assert codes(verdict_of(edited(text, ("not yes", "n = 0"))).findings) == ["RCS415"]


def test_assumptions_are_used_and_must_be_defined_themselves() -> None:
    text = (
        VARIABLES
        + """
assume small : a < 4
table t assuming small {
  | line | a    || xs[a] |
  | all  | >= 0 || 1     |
}
"""
    )
    assert codes(verdict_of(text).findings) == []
    assert codes(verdict_of(edited(text, ("assuming small ", ""))).findings) == ["RCS412"]
    [found] = verdict_of(edited(text, ("a < 4", "9 / a > 2"))).findings
    assert found.code is Code.DIVISION_BY_ZERO
    assert [(witness.table, witness.variables, witness.values) for witness in found.witnesses] == [
        ("", ("a",), ("0",))
    ]


@pytest.mark.parametrize(
    ("condition", "looked_at"),
    [
        ("a /= 0 and 9 / a > 2", False),
        ("a = 0 or 9 / a > 2", False),
        ("a /= 0 implies 9 / a > 2", False),
        ("a /= 0 xor 9 / a > 2", True),
    ],
)
def test_which_operators_look_at_both_sides(condition: str, looked_at: bool) -> None:
    text = f"""{VARIABLES}procedure p {{ if {condition} {{ out := 1 }} }}
table t {{
  | line | a    || procedures |
  | all  | >= 0 || p          |
}}
"""
    assert codes(verdict_of(text).findings) == ([Code.DIVISION_BY_ZERO.value] if looked_at else [])


def test_every_condition_is_defined_whatever_the_others_say() -> None:
    text = (
        VARIABLES
        + """
table t {
  | line | b    | 100 / b || out |
  | pos  | > 0  | > 20    || 1   |
  | rest | DEFAULT |      || 2   |
}
"""
    )
    found = verdict_of(text)
    assert codes(found.findings) == ["RCS411"]
    assert [verdict.undecided for verdict in found.tables] == [True]
    guarded = edited(text, ("| 100 / b |", "| when |"), ("> 20   ", "b > 0 and 100 / b > 20"))
    assert "RCS411" not in codes(verdict_of(guarded).findings)


OUTSIDE = {
    "invariant": "invariant claim : {}\n",
    "assumption": "assume claim assumed : {}\n",
    "deferred value": "state later : int 0 .. 3 deferred until {}\n",
}


@pytest.mark.parametrize("place", OUTSIDE)
@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("9 / q > 2", "RCS411"),
        ("xs[q - 1] < 2", "RCS412"),
        ("s + q < 9", "RCS410"),
        ("q = 0 or 9 / q > 2", ""),
    ],
)
def test_a_condition_outside_tables_is_defined_under_the_invariants_and_an_invariant_by_itself(
    place: str, condition: str, code: str
) -> None:
    text = f"{VARIABLES}state q : int 0 .. 4 = 1\n{OUTSIDE[place].format(condition)}"
    wrong = [code] if code else []
    assert codes(verdict_of(text).findings) == wrong
    assert codes(verdict_of(text + "invariant above : q > 0 and s <= 0\n").findings) == (
        wrong if place == "invariant" else []
    )


def test_extern_results_are_any_values_in_range() -> None:
    text = (
        VARIABLES
        + """
extern procedure look reads a writes n python "m:f" c "f"
procedure p { look if n < 9 { n := n + 1 } }
"""
    )
    assert codes(verdict_of(text).findings) == []
    [found] = verdict_of(edited(text, ("if n < 9 ", "if a = 2 "))).findings
    assert dict(zip(found.witnesses[0].variables, found.witnesses[0].values, strict=True))["a"] == "2"


# --- what may go wrong with the prover ----------------------------------------------------


def test_unknown_is_never_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    import z3

    monkeypatch.setattr(z3.Solver, "check", lambda *_: z3.unknown)
    found = verdict_of(f"{VARIABLES}procedure p {{ if b /= 0 {{ m := 100 / b }} }}")
    assert found.proved is None
    assert codes(found.findings) == ["RCS409"]


@pytest.mark.parametrize("error", ["z3", "memory"])
def test_a_solver_that_breaks_proves_nothing(monkeypatch: pytest.MonkeyPatch, error: str) -> None:
    import z3

    def broken(*_: object) -> None:
        raise z3.Z3Exception(b"out of memory") if error == "z3" else MemoryError

    for where, name in ((z3.Solver, "check"), (z3, "Z3_solver_assert")):
        with monkeypatch.context() as patch:
            patch.setattr(where, name, broken)
            found = verdict_of(f"{VARIABLES}procedure p {{ if b /= 0 {{ m := 100 / b }} }}")
        assert found.proved is None
        assert codes(found.findings) == ["RCS409"]


def test_a_time_out_is_reported_and_ends_the_asking() -> None:
    hard = "if s * s * s + low * low = 3 * low * s and s > 1000 { m := a * a + b }"
    found = body(hard, Options(solver="boxes", steps=1))
    assert found
    assert set(codes(found)) <= {"RCS409", "RCS410", "RCS413"}


def test_what_bounds_settle_costs_no_query(monkeypatch: pytest.MonkeyPatch) -> None:
    def asked(*_: object) -> Answer:
        raise AssertionError

    monkeypatch.setattr(Solver, "check", asked)
    verdict = verdict_of(
        f"{VARIABLES}procedure p {{ if a < 9 {{ n := a + 1 }} m := 3 * a if a in {{1, 2}} {{ xs[a] := 1 }} }}"
    )
    assert verdict.proved is not None
    assert verdict.tally.queries == 0
    assert verdict.tally.by_intervals >= 4


def test_one_query_shows_all_that_a_line_owes() -> None:
    verdict = verdict_of(
        f"{VARIABLES}procedure p {{ if b /= 0 {{ m := 100 / b  m := 50 / b  m := 20 mod b }} }}"
    )
    assert verdict.proved is not None
    assert (verdict.tally.by_solver, verdict.tally.queries) == (3, 1)


LONG = "procedure p { for i in 0 .. 99 { n := 0 } }\n"
LINE = "table t {\n| line | a || procedures |\n| all | >= 0 || p |\n}\n"
LEVEL = (
    edited(LINE, ("p |", "|")).replace("{", "{{").replace("}", "}}")
    + "level l {{ period 40 [ms] {} table t {} }}\n"
)


@pytest.mark.parametrize(
    ("text", "place", "what"),
    [
        (LONG, "p {", "in procedure `p`"),
        (LONG + LINE, "all", "in line `all` of table `t`"),
        (LONG + LEVEL.format("preprocess p", ""), "l {", "in `preprocess` of level `l`"),
        (LONG + LEVEL.format("", "postprocess p"), "l {", "in `postprocess` of level `l`"),
    ],
)
def test_runs_that_are_too_long_to_follow_are_undecided(
    monkeypatch: pytest.MonkeyPatch, text: str, place: str, what: str
) -> None:
    monkeypatch.setattr("rcsc.proof.symbolic.evaluation.MOST_STEPS", 50)
    found = verdict_of(VARIABLES + text)
    assert found.proved is None
    [finding] = found.findings
    assert finding.code is Code.UNDECIDED
    assert what in finding.message
    assert (VARIABLES + text)[finding.primary.span.start :].startswith(place)


def test_long_loops_are_followed() -> None:
    text = "state k : int 0 .. 4096 procedure p { k := 0 for i in 1 .. 4096 { k := k + 1 } k := k - 4096 }"
    assert verdict_of(text).proved is not None
    assert codes(verdict_of(edited(text, ("- 4096 }", "- 4095 k := k - 2 }"))).findings) == ["RCS413"]


def test_only_the_tables_asked_for_are_proved() -> None:
    text = VARIABLES + GROW + TABLE.format(low="", high="grow", out="")
    verdict = prove_program(program_of(text), BOXES, only=())
    assert (verdict.tables, verdict.proved) == ((), None)
    assert codes(verdict.findings) == []


def test_processes_give_the_same_verdicts() -> None:
    text = VARIABLES + "".join(
        f"table t{at} {{\n  | line | a || out |\n  | l | < {at} || 1 |\n  | h | >= 3 || 2 |\n}}\n"
        for at in (2, 3, 4)
    )
    one = verdict_of(text)
    two = verdict_of(text, replace(BOXES, jobs=2))
    assert one.findings == two.findings
    assert [v.findings for v in one.tables] == [v.findings for v in two.tables]
    assert codes(one.findings) == ["RCS401", "RCS402"]


def test_what_the_processor_time_ended_is_undecided() -> None:
    solver = Solver(Limits(steps=2**31, cpu_s=0.3))
    kind = Int(2, 10**12)
    x, y, z = (smt.variable(name, kind) for name in "xyz")

    def cubed(term: Term) -> Term:
        return smt.integer_operation("*", term, smt.integer_operation("*", term, term))

    solver.add(*(within(one, kind) for one in (x, y, z)))
    solver.add(smt.equal(smt.integer_operation("+", cubed(x), cubed(y)), cubed(z), kind))  # nobody finds one
    before = smt.cut_short()
    assert solver.check() is Answer.UNKNOWN
    assert smt.cut_short() == before + 1
    assert Solver().check() is Answer.SATISFIABLE  # the next question begins anew


def test_a_table_of_which_a_question_was_cut_short_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = iter(range(100))
    monkeypatch.setattr(smt, "cut_short", lambda: next(ended))
    verdict = verdict_of("input a : bool\ntable t {\n| line | a ||\n| x | true ||\n| y | false ||\n}\n")
    assert verdict.proved is None
    assert codes(verdict.findings) == ["RCS409"]


# --- all questions together -------------------------------------------------------------------------


PAIR = "input x : int 0 .. 10\ninput y : int 0 .. 10\nstate m : int 0 .. 10\n"
LESS = "procedure p {\n  if x <= y { m := y - x }\n}\n"
ODD = "100 / (2 * x - 2 * y + 1) > 3"
OWED = {  # each owes what bounds alone do not settle
    "a procedure": LESS,
    "a line": f"{LESS}table t {{\n| line | when || procedures |\n| a | true || p |\n}}\n",
    "a cell": f"table t {{\n| line | when ||\n| a | {ODD} ||\n| b | not ({ODD}) ||\n}}\n",
    "an assumption": f"assume odd monitored : {ODD}\ntable t assuming odd {{\n| line | x ||\n| a | < 5 ||\n| b | >= 5 ||\n}}\n",
    "a preprocess": "module q reads x, y writes m {\n  if x <= y { m := y - x }\n}\n"
    "table t {\n| line | x ||\n| a | < 5 ||\n| b | >= 5 ||\n}\nlevel l {\n  period 40 [ms]\n  preprocess q\n  table t\n}\n",
    "a table": "table t {\n| line | when ||\n| a | x * y > 0 and x * m > 0 ||\n| b | (x = 0 or y = 0) and x * m > 0 ||\n"
    "| c | x = 0 or m = 0 ||\n}\n",
}


@pytest.mark.parametrize("place", OWED)
def test_no_question_is_asked_past_what_all_of_them_may_cost(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = PAIR + OWED[place]
    assert verdict_of(text).proved is not None
    monkeypatch.setattr("rcsc.proof.solvers.options.TOGETHER", 0)
    found = verdict_of(text)
    assert found.proved is None
    assert set(codes(found.findings)) == {"RCS409"}


def test_questions_that_are_decided_one_by_one_may_be_too_many_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    options = Options(solver="boxes", steps=20_000)
    text = PAIR + OWED["a table"]
    assert verdict_of(text, options).proved is not None
    spent: list[int] = []
    monkeypatch.setattr("rcsc.proof.solvers.options.TOGETHER", 1)
    for steps in (20_000, 400):
        found = [verdict_of(text, replace(options, steps=steps)) for _ in range(2)]
        assert found[0].findings == found[1].findings
        spent.append(len(found[0].findings))
    assert spent == [0, 1]
    assert "together" in found[0].findings[0].message


def test_a_budget_is_for_all_solvers_inside_it_and_for_nothing_after_it() -> None:
    kind = Int(2, 10**6)
    x, y = (smt.variable(name, kind) for name in "xy")

    def asked() -> Answer:
        solver = Solver(Limits(steps=1_000_000))
        solver.add(within(x, kind), within(y, kind))
        solver.add(smt.equal(smt.integer_operation("*", x, y), smt.literal(kind, 899), kind))
        return solver.check()

    with smt.together(10**9) as budget:
        assert asked() is Answer.SATISFIABLE
    few = 5 * (10**9 - budget.left)
    for inner in (10**9, few):
        with smt.together(few), smt.together(inner):
            answers = [asked() for _ in range(40)]
        many = answers.count(Answer.SATISFIABLE)
        assert 0 < many < 40
        assert answers == [Answer.SATISFIABLE] * many + [Answer.UNKNOWN] * (40 - many)
    assert asked() is Answer.SATISFIABLE


def test_the_manual_and_the_help_say_what_all_questions_together_get(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = f"{TOGETHER} times"
    assert run(["check", "--help"]) == 0
    assert said in " ".join(capsys.readouterr().out.split())
    manual = Path(__file__).parents[2] / "grammar" / "manual.md"
    assert f"{said} the steps of one" in manual.read_text(encoding="utf-8")


VAST = """input a : int 0 .. 9_000_000_000
input b : int -9_223_372_036_854_775_808 .. 9_223_372_036_854_775_807
input x : real -1e30 .. 1e30
input xs : array[4] of int 0 .. 9
output o : int 0 .. 9
"""
GUARDS = ["a < 4", "a >= 4", "a > 3_100_000_000", "b > 0", "b < 0", "b = 0", "x < 1.0", "x >= 1.0"]
MAY_BE_UNDEFINED = [
    "a * a > 5", "a * 2_100_000_000 > 5", "b + 1 > 2", "-b /= 2", "abs(b) > 2", "b - a < 3", "10 / b > 1", "a mod b = 1",
    "int(x) > 3", "xs[a] = 1", "a in 0 .. b + 7", "(o = 1 or b * 2 > 3)",
]  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.sampled_from(GUARDS), min_size=2, max_size=3, unique=True),
    st.lists(st.sampled_from(MAY_BE_UNDEFINED), min_size=1, max_size=2, unique=True),
)
def test_what_may_be_undefined_is_told_in_the_line_where_it_can_be(
    guards: list[str], parts: list[str]
) -> None:
    """As it is of a procedure that asks the same; lines share conditions."""
    cells = [f"{guard} and {part}" for part in parts for guard in guards]
    procedures = [f"procedure p{at} {{ if {cell} {{ }} }}" for at, cell in enumerate(cells)]
    rows = [f"| {at} | {cell} || 1 |" for at, cell in enumerate(cells)]
    head = f"{VAST}table t {{\n| line | when || o |\n|--|--||--|"

    def told(*text: str) -> set[tuple[Code, str, str]]:
        program = drawn_program("\n".join(text), "RCS314")  # no value satisfies a cell
        found = Obligations(program, BOXES).prove(program.tables)
        return {(finding.code, *place("\n".join(text), finding.primary.span)) for finding in found}

    def place(text: str, span: Span) -> tuple[str, str]:
        [number] = re.findall(r"[0-9]", text[text.rindex("\n", 0, span.start) :])[:1]
        return number, text[span.start : span.end]

    assert told(head, *rows, "| else | DEFAULT || 0 |", "}") == told(VAST, *procedures)


def test_a_condition_of_two_lines_is_told_in_the_one_that_its_witness_lets_match() -> None:
    """At the part that is wrong."""
    text = """enum mode { small, large }
input m : mode
input a : int 0 .. 9_000_000_000
assume fits assumed : m = small implies a < 10
table t assuming fits {
| line  | m     | when ||
|-------|-------|------||
| small | small | a < 7 or a * a > 5 ||
| large | large | a < 7 or a * a > 5 ||
}
"""
    program = program_of(text)
    [found] = Obligations(program, BOXES).prove(program.tables)
    span = found.primary.span
    assert text[span.start : span.end] == "a * a"
    assert text[: span.start].rpartition("\n")[2] == "| large | large | a < 7 or "


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.sampled_from(["small", "large", "off"]), min_size=1, max_size=2, unique=True),
    st.permutations(["small", "large", "off"]),
    st.lists(st.sampled_from(["a * a > 5", "a * a > 7"]), min_size=3, max_size=3),
)
def test_a_condition_of_several_lines_is_told_in_one_that_its_witness_lets_match(
    safe: list[str], modes: list[str], cells: list[str]
) -> None:
    text = f"""enum mode {{ small, large, off }}
input m : mode
input a : int 0 .. 9_000_000_000
assume fits assumed : m in {{ {", ".join(safe)} }} implies a < 10
table t assuming fits {{
| line | m | when ||
|------|---|------||
"""
    text += (
        "".join(f"| {mode} | {mode} | {cell} ||\n" for mode, cell in zip(modes, cells, strict=True)) + "}\n"
    )
    program = program_of(text)
    found = Obligations(program, BOXES).prove(program.tables)
    assert found
    for finding in found:
        span = finding.primary.span
        row = text[text.rindex("\n", 0, span.start) + 1 : text.index("\n", span.end)]
        _, told, _, condition, *_ = (cell.strip() for cell in row.split("|"))
        [witness] = finding.witnesses
        runs = dict(zip(witness.variables, witness.values, strict=True))["m"]
        assert told == runs or cells[modes.index(runs)] != condition
        assert text[span.start : span.end] == "a * a"


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(
        *(
            st.tuples(st.just(names), of(names), of(names))
            for names, of in ((INTS, integers_over), (REALS, reals_over))
        )
    )
)
def test_what_types_show_to_be_defined_owes_nothing(drawn: tuple[Names, str, str]) -> None:
    names, left, right = drawn
    program = drawn_program(f"{names.declared}assume e : {left} < {right}")
    condition = program.assumptions[0].condition
    run = Run({}, {v.name: v.type for v in program.variables}, {})
    run.evaluate(condition)
    assert may_be_undefined(condition) or not run.obligations


# --- what is asked ------------------------------------------------------------------------

WORD = Int(0, 99)


@pytest.mark.parametrize(
    ("made", "meant"), [(smt.equal, operator.eq), (smt.at_most, operator.le), (smt.below, operator.lt)]
)
def test_bits_are_compared_with_any_whole_number(
    made: Callable[[Term, Term, Scalar], Term], meant: Callable[[int, int], bool]
) -> None:
    """Also with one that has more bits than they have."""
    bits = smt.word("w", 3)
    for value, constant in product(range(8), (-1, 0, 5, 7, 8, 11, 15, 16)):
        other = smt.literal(WORD, constant)
        here = [(bits, smt.literal(WORD, value))]
        assert str(smt.at_point(made(bits, other, WORD), here)) == str(meant(value, constant))
        assert str(smt.at_point(made(other, bits, WORD), here)) == str(meant(constant, value))


@pytest.mark.parametrize("divisor", [1, 2, 3, 4, 8, 16])
def test_bits_are_divided_by_any_whole_number(divisor: int) -> None:
    bits, by = smt.word("w", 3), smt.literal(WORD, divisor)
    for value in range(8):
        here = [(bits, smt.literal(WORD, value))]
        for op, meant in (("/", value // divisor), ("mod", value % divisor)):
            same = smt.equal(smt.integer_operation(op, bits, by), smt.literal(WORD, meant), WORD)
            assert str(smt.at_point(same, here)) == "True"


@pytest.mark.parametrize("op", [Op.DIV, Op.MOD, Op.MUL])
def test_bits_are_taken_of_what_is_never_negative_and_divided_by_a_power_of_two(op: Arithmetic) -> None:
    kind = Int(-1, 9)
    whole, either = values.variable("w", Int(0, 9)), values.variable("v", kind)
    power, others = values.constant(kind, 8), [values.constant(kind, by) for by in (-1, 0, 3)]
    taken = [
        values.takes_bits(Node(op, (value, divisor), kind, -1, 9))
        for value, divisor in (
            (whole, power),
            (either, power),
            *((whole, by) for by in (*others, either, whole)),
        )
    ]
    assert taken == [op is not Op.MUL, *[False] * 6]
    among = values.variable("p", Int(4, 8))
    assert not values.takes_bits(Node(op, (whole, among), kind, 0, 9))


def test_constants_that_stand_for_terms_are_told_apart_and_counted() -> None:
    solver, kind = Solver(counted_alone=True), Int(0, 9)
    x = smt.variable("x", kind)
    double, more = (solver.named(smt.integer_operation(op, x, smt.literal(kind, 2))) for op in ("*", "+"))
    switch = solver.switch(smt.below(smt.literal(kind, 4), x, kind))
    solver.add(smt.equal(x, smt.literal(kind, 4), kind))
    assert solver.check() is Answer.SATISFIABLE
    assert (solver.value(double, kind), solver.value(more, kind)) == (8, 6)
    assert solver.check(switch) is Answer.UNSATISFIABLE
    assert solver.names == 3


@pytest.mark.parametrize("kind", [Real(-1.0, 1.0), Single(-1.0, 1.0)])
def test_doubles_and_singles_are_compared_with_constants_of_their_own(kind: Real) -> None:
    x = smt.variable("x", kind)
    for value in (-0.5, 0.0, 0.5):
        half = smt.at_most(smt.literal(kind, 0.5), x, kind)
        assert str(smt.at_point(half, [(x, smt.literal(kind, value))])) == str(value >= 0.5)


def test_all_that_is_asserted_is_stated_again_after_a_question_is_broken_off() -> None:
    kind = Int(0, 99)
    x = smt.variable("x", kind)

    def is_(value: int) -> Term:
        return smt.equal(x, smt.literal(kind, value), kind)

    def below(value: int) -> Term:
        return smt.below(x, smt.literal(kind, value), kind)

    solver = Solver(remembers=True)
    solver.add(smt.negation(below(3)))
    solver.add(below(50))
    solver.push()
    solver.add(below(40))
    solver.add(smt.negation(is_(7)))
    for broken in (False, True):
        answers = []
        for value in (2, 3, 7, 45, 60):
            solver._broken = broken
            answers.append(solver.check(is_(value)) is Answer.SATISFIABLE)
        assert answers == [False, True, False, False, False]
    solver.pop()
    again = z3.Solver()
    again.from_string(solver.refutations())
    assert again.check() == z3.unsat


@pytest.mark.parametrize("wanted", [True, False])
def test_only_a_witness_that_is_wanted_is_looked_for(wanted: bool) -> None:
    a = values.variable("a", Int(0, 9))
    owed = Obligation(Code.INDEX, "", NOWHERE, values.TRUE, values.inside(a, 0, 4))
    asker = Asker(Options(), {"a": 0})
    [failure] = asker.unshown([owed], list, lambda _: wanted)
    assert failure.outcome is Discharge.FAILS
    assert [value for _, value in failure.witness] == [5] * wanted
    assert (asker.tally.queries > 2) is wanted
    with smt.until(lambda: True):
        [given_up] = asker.unshown([owed], list, lambda _: wanted)
    assert (given_up.outcome, given_up.witness) == (Discharge.OPEN, ())


@pytest.mark.parametrize("most", [0, 1, 3, 9])
def test_each_obligation_that_is_not_shown_is_told_once_however_many_are_given_up(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some that fail, and many of which the solver says nothing."""
    a = values.variable("a", Int(0, 9))
    fails, unknown = values.inside(a, 0, 4), values.inside(a, 0, 7)
    goods = [fails, *[unknown] * 4, values.inside(a, 0, 3), unknown, unknown]
    asked = discharge._Question._ask
    monkeypatch.setattr(discharge, "MOST_UNKNOWN", most)
    monkeypatch.setattr(
        discharge._Question,
        "_ask",
        lambda question, bad: Answer.UNKNOWN if "7" in str(bad) else asked(question, bad),
    )
    owed = [Obligation(Code.INDEX, str(at), NOWHERE, values.TRUE, good) for at, good in enumerate(goods)]
    told = Asker(Options(), {"a": 0}).unshown(owed, list, lambda _: False)
    assert sorted(failure.obligation.message for failure in told) == [str(at) for at in range(len(goods))]


@pytest.mark.parametrize("kind", [Int(0, 10), Real(0.0, 10.0)])
@pytest.mark.parametrize("most", [4, 6])
def test_one_question_shows_that_all_holds_of_whole_numbers_and_of_doubles(kind: Scalar, most: int) -> None:
    x = values.variable("x", kind)
    owed = Obligation(Code.ASSIGNED_RANGE, "", NOWHERE, values.TRUE, values.inside(x, 0, 5))
    asker = Asker(Options(), {"x": 0})
    assert asker.all_hold([owed], lambda: [values.inside(x, 0, most)]) is (most == 4)


def test_answers_are_remembered_each_to_its_own_question() -> None:
    a = values.variable("a", Int(0, 9))
    owed = Obligation(Code.INDEX, "", NOWHERE, values.TRUE, values.inside(a, 0, 4))
    asker = Asker(Options(), {"a": 0})
    with remembering(Answers()):
        for _ in range(2):
            shown, plain = (
                asker.unshown([owed], list, lambda _: True),
                asker.unshown([owed], list, lambda _: False),
            )
            assert [[value for _, value in one.witness] for one in (*shown, *plain)] == [[5], []]
            assert asker.all_hold([owed], list) is False


def test_the_least_input_at_which_conditions_hold_is_found() -> None:
    program = program_of(
        "input x : int 0 .. 9\ninput y : int 0 .. 9\ninput w : int 0 .. 255\ntable t {\n| line | when ||\n"
        "| one | x + y = 11 and w = 0bx1xxxx1x ||\n| d | DEFAULT ||\n}\n"
    )
    conditions = [test.condition for test in program.tables[0].lines[0].stated]
    found = least_where(conditions, program.variables, program.variables, Options())
    assert found == {"x": 2, "y": 9, "w": 0b01000010}


def test_a_calculation_of_doubles_that_has_a_name_is_known_by_it_and_others_are_not() -> None:
    program = program_of(
        "input r : real -1.0 .. 1.0\ninput s : real -1.0 .. 1.0\ntable t {\n| line | when ||\n"
        "| one | r * s < 0.5 ||\n| two | (r * s) + r < 0.5 ||\n| d | DEFAULT ||\n}\n"
    )
    one, two = (line.stated[0].condition for line in program.tables[0].lines)
    frame, _ = declared(program.variables)
    assert isinstance(one, Apply)
    frame.named[one.args[0]] = smt.variable("known", Real(-1.0, 1.0))
    assert str(encode(one, frame)) == "known < 1*(2**-1)"
    assert str(encode(two, frame)) == "known + r < 1*(2**-1)"


def test_a_table_runs_its_default_where_no_line_matches() -> None:
    program = program_of(
        "input a : int 0 .. 9\nstate n : int 0 .. 9\ntable t {\n| line | a || n |\n| one | < 3 || 1 |\n"
        "| two | > 7 || 2 |\n| d | DEFAULT || 3 |\n}\n"
    )
    [table] = program.tables
    running = Run.of(program, {})
    running.run_choice(OneTable(table.name), {str(table.name): table})
    after, kind = values.term_of(running.state.leaves["n"]), program.kinds["n"]
    for a, n in ((0, 1), (3, 3), (7, 3), (8, 2)):
        here = [(smt.variable("a", kind), smt.literal(kind, a))]
        assert str(smt.at_point(smt.equal(after, smt.literal(kind, n), kind), here)) == "True"


def test_what_a_cycle_leaves_is_of_its_type() -> None:
    """Also the numbers of the lines that ran, which begin at none."""
    program = program_of(
        "input a : bool\nstate n : int 0 .. 9 deferred until a\n"
        "table t {\n| line | a || n |\n| one | true || 1 |\n| two | false || 2 |\n}\n"
        "table u {\n| line | n ||\n| one | <= 9 ||\n}\nlevel l {\n  table t\n  table u\n}\n"
    )
    settled = Run.of(program, {})
    settled.settle(program)
    assert program.line_leaves
    assert settled.state.leaves.keys() == {"n", *program.line_leaves.values()}
    assert {name: node.kind for name, node in settled.state.leaves.items()} == {
        name: program.kinds[name] for name in settled.state.leaves
    }


def test_parameters_of_a_procedure_that_nobody_calls_are_apart() -> None:
    apart = "state n : int 0 .. 9\nprocedure p(k : int 0 .. 3, j : int 0 .. 3) { n := k - j }\n"
    [found] = verdict_of(apart).findings
    [shown] = found.witnesses
    assert (found.code, shown.variables, shown.values) == (Code.ASSIGNED_RANGE, ("j", "k"), ("1", "0"))


def test_what_goes_wrong_in_several_lines_is_one_cause_with_three_witnesses() -> None:
    rows = "".join(f"| l{at} | {at} || wrong |\n" for at in range(5))
    program = program_of(
        f"input a : int 0 .. 4\ninput b : int 0 .. 9\nstate n : int 0 .. 8\nprocedure wrong {{ n := b }}\n"
        f"table t {{\n| line | a || procedures |\n{rows}}}\n"
    )
    owed = Obligations(program, Options())
    [found] = owed.prove(program.tables)
    assert found.notes == tuple(f"in line `l{at}` of table `t`" for at in range(3))
    [cause] = owed._causes.values()
    assert [bool(failure.witness) for failure in cause.failures] == [True, True, True, False, False]
