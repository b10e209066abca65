"""Invariants hold at first and at every point where a cycle can end; assumptions can hold, and are shown if claimed."""

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.proof.certify import certify
from rcsc.proof.procedures.invariants import assumptions_satisfiable, at_first
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.table.program import prove_program
from tests.support.programs.stages import BOXES, errors, program_of, verdict_of
from tests.support.programs.texts import edited

COUNTER = """
input up : bool
input a : int 0 .. 9
state n : int 0 .. 9 = 1
state m : int 0 .. 9 = 2
output go : bool
invariant order : n < m
procedure step { if n < 7 { n := n + 1 m := n + 1 } }
table t {
  | line | up    || procedures | go   |
  | one  | true  || step       | true |
  | two  | false ||            |      |
}
"""


def test_an_invariant_is_kept_by_every_line() -> None:
    assert errors(verdict_of(COUNTER).findings) == []


BEGUN_ANEW = """\
input heard : bool
state place : int 0 .. 100 restart 50
state counts : array[8] of int 0 .. 9
output silent : int 0 .. 9
invariant inside : place < 8
table t {
  | line | heard || procedures          | silent        |
  | yes  | true  || counts[place] := 3  | 0             |
  | no   | false ||                     | counts[place] |
}
level m { period 1 [s] table t }
"""


def test_an_invariant_holds_after_a_restart_too() -> None:
    """A level may begin anew at any moment: an operation that rests on the invariant would be undefined."""
    [found] = verdict_of(BEGUN_ANEW).findings
    assert (found.code.value, found.notes) == ("RCS416", ("after a restart place = 50",))
    assert "after a restart" in found.message
    assert found.help == ("give a variable another value for `restart`, or weaken the invariant",)
    assert [BEGUN_ANEW[label.span.start : label.span.end] for label in found.related] == ["place"]
    for kept in ("restart 7", "restart 0", ""):
        assert errors(verdict_of(edited(BEGUN_ANEW, ("restart 50", kept))).findings) == []


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("= 2", "= 1", "RCS416"),
        ("m := n + 1", "m := n", "RCS417"),
        ("m := n + 1 }", "} m := 3", "RCS417"),
        ("n < 7", "n < 7 and m > 3 or up", "RCS413"),
    ],
)
def test_a_mutant_is_caught(old: str, new: str, code: str) -> None:
    assert code in errors(verdict_of(edited(COUNTER, (old, new))).findings)


def test_the_state_before_the_line_is_the_witness() -> None:
    [found] = verdict_of(edited(COUNTER, ("} }", "} m := max(m - 1, 1) }"), ("n < 7", "n < 0"))).findings
    assert found.code.value == "RCS417"
    values = dict(zip(found.witnesses[0].variables, found.witnesses[0].values, strict=True))
    assert values == {"up": "true", "n": "1", "m": "2"}
    assert "line `one` of table `t`" in found.message


def test_an_assumption_that_the_initial_values_break_is_told_at_its_place() -> None:
    program = program_of(RELYING + "assume far monitored : n > 3\n")
    [found] = [finding for finding in at_first(program) if finding.code is Code.ASSUMPTION_INITIAL]
    assert found.primary.span == program.assumptions[-1].span


def test_a_default_line_owes_the_invariant_too() -> None:
    text = edited(COUNTER, ("| two  | false ||            |      |", "| two | DEFAULT || n := 5 | |"))
    assert errors(verdict_of(text).findings) == ["RCS417"]


def test_procedures_of_levels_keep_invariants_as_a_whole() -> None:
    level = (
        "procedure first { n := 5 } procedure second { m := 6 } level l { preprocess first, second table t }"
    )
    assert errors(verdict_of(COUNTER + level).findings) == []
    assert errors(verdict_of(COUNTER + edited(level, ("first, second", "first"))).findings) == ["RCS417"]
    behind = edited(level, ("preprocess first, second table t", "table t postprocess first, second"))
    assert errors(verdict_of(COUNTER + behind).findings) == []
    assert errors(verdict_of(COUNTER + edited(behind, ("m := 6", "m := 5"))).findings) == ["RCS417"]


def test_deferred_values_keep_invariants() -> None:
    text = """
input ack : bool
state x : int 0 .. 9 deferred until ack
output go : bool
invariant small : x < 5
procedure p { next x := 3 }
table t {
  | line | ack || procedures |
  | yes  | true  || p |
  | no   | false ||   |
}
"""
    assert errors(verdict_of(text).findings) == ["RCS417"]
    more = edited(text, ("invariant", "invariant soon : x.next < 5 invariant")) if ".next" in text else text
    assert more.count("invariant") == 1
    assert errors(verdict_of(edited(text, ("until ack", "until false"))).findings) == []


EXTERN = """
input up : bool
state n : int 0 .. 9 = 1
state m : int 0 .. 9 = 2
output go : int 0 .. 9
invariant order : n < m
extern procedure look reads up writes go python "m:f" c "f"
procedure step {{ {before} look {after} }}
table t {{
  | line | up || procedures |
  | all  | in {{true, false}} || step |
}}
"""


def test_a_cycle_that_a_refused_extern_result_ends_leaves_the_invariant_true() -> None:
    assert errors(verdict_of(EXTERN.format(before="", after="n := 5 m := 6")).findings) == []
    assert errors(verdict_of(EXTERN.format(before="n := 5", after="m := 6")).findings) == ["RCS417"]
    assert errors(verdict_of(EXTERN.format(before="m := 6 n := 5", after="")).findings) == []


RELYING = """
input a : int 0 .. 9
state n : int 0 .. 9 = 1
output go : bool
invariant small : n < 5
table t {
  | line | n      | a      || go    |
  | one  | 0 .. 2 |        || true  |
  | two  | 3 .. 4 | <= n + 9 || false |
}
"""


def test_tables_rely_on_invariants_and_so_does_the_checker() -> None:
    program = program_of(RELYING)
    verdict = prove_program(program, BOXES)
    assert errors(verdict.findings) == []
    assert verdict.certificate is not None
    assert certify(program, verdict.certificate).problems == ()
    assert errors(verdict_of(edited(RELYING, ("invariant small : n < 5", ""))).findings) == ["RCS401"]
    assert errors(verdict_of(edited(RELYING, ("n < 5", "n < 6"))).findings) == ["RCS401"]


ASSUMING = """
input a : int 0 .. 9
input x : real 0.0 .. 1.0
output go : bool
assume one {standing} : {one}
assume two : {two}
table t assuming one, two {{
  | line | a    || go    |
  | low  | < 5  || true  |
  | high | >= 5 || false |
}}
"""


@pytest.mark.parametrize(
    ("one", "two", "contradictory"),
    [
        ("a < 3", "a > 6", True),
        ("a < 8", "a > 1", False),
        ("a + a = 7", "a >= 0", True),
        ("x > 0.25", "x < 0.2500000000000001", False),
        ("x > 0.25", "x < 0.25", True),
    ],
)
def test_contradictory_assumptions_are_found_where_boxes_decide(
    one: str, two: str, contradictory: bool
) -> None:
    text = ASSUMING.format(standing="", one=one, two=two)
    assert errors(verdict_of(text).findings) == (["RCS405"] if contradictory else [])
    program = program_of(text)
    answer = assumptions_satisfiable(program, program.tables[0], BOXES)
    assert (answer is Answer.UNSATISFIABLE) == contradictory


@pytest.mark.parametrize(("bound", "wrong"), [("s <= 2", ["RCS405"]), ("s <= 3", [])])
def test_an_assumption_that_contradicts_an_invariant_is_found_where_the_table_reads_neither(
    bound: str, wrong: list[str]
) -> None:
    text = (
        "input go : bool\ninput a : int 3 .. 9\nstate s : int 0 .. 9\n"
        f"invariant low : {bound}\nassume near : a <= s\n"
        "table t assuming near {\n| line | go ||\n| yes | true ||\n| no | false ||\n}\n"
    )
    assert errors(verdict_of(text).findings) == wrong


@pytest.mark.parametrize(("one", "wrong"), [("a < 10", []), ("a < 9", ["RCS406"]), ("a * a <= 81", [])])
def test_an_assumption_that_claims_to_be_proved_is(one: str, wrong: list[str]) -> None:
    found = verdict_of(ASSUMING.format(standing="proved", one=one, two="a >= 0")).findings
    assert errors(found) == wrong
    assert all(
        dict(zip(at.variables, at.values, strict=True)) == {"a": "9"}
        for each in found
        for at in each.witnesses
    )
    assert all((each.notes, at.table) == ((), "") for each in found for at in each.witnesses)


def test_a_monitor_is_defined_for_every_input() -> None:
    monitored = ASSUMING.format(standing="monitored", one="a = 0 or 9 / a > 0", two="a >= 0")
    assert errors(verdict_of(monitored).findings) == []
    assert errors(verdict_of(edited(monitored, ("a = 0 or ", ""))).findings) == ["RCS411"]


def test_an_unknown_answer_leaves_assumptions_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    import z3

    monkeypatch.setattr(z3.Solver, "check", lambda *_: z3.unknown)
    verdict = verdict_of(ASSUMING.format(standing="", one="a < 3 and a > 1", two="a >= 0"))
    assert verdict.proved is None
    assert errors(verdict.findings) == ["RCS409"]
