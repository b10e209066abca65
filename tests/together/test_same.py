"""`same`: two lines that may match together do the same there, which is proved; every other overlap is found as ever."""

import json
import re
from pathlib import Path

import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.base.diagnostics.diagnostic import Diagnostic, Severity
from rcsc.front.commands import run
from rcsc.lang.interpret import Fault, initial, run_table
from rcsc.lang.model import Program
from rcsc.proof.certify import certify
from rcsc.proof.procedures import meetings
from rcsc.proof.procedures.meetings import Met
from rcsc.proof.solvers.options import Options
from rcsc.proof.solvers.smt import Answer
from rcsc.proof.table import program as proving
from rcsc.proof.table.program import prove_program
from tests.support.programs.stages import program_of, reported, verdict_of
from tests.support.programs.texts import edited

INJECTION = """
enum mode { too_low, normal, high }
input water : int 0 .. 2000
input mode_in : mode
input reset : bool
input block : bool
state overridden : bool
state cleared : int 0 .. 9
procedure clear {
  overridden := false
  cleared := min(cleared + 1, 9)
}
table override_rules {
  | line         | mode_in           | water  | reset | block || procedures                                        |
  | r_2          | normal            | >= 900 |       |       || clear                                             |
  | r_4          | high              | < 900  |       |       || clear                                             |
  | r_5 same r_2 | in {too_low, normal} |     | true  |       || overridden := false; cleared := min(1 + cleared, 9) |
  | r_6          | too_low           |        | false | true  || overridden := true                                |
  | stays        | DEFAULT           |        |       |       ||                                                   |
}
"""
OTHER = (
    "overridden := false; cleared := min(1 + cleared, 9)",
    "overridden := false; cleared := min(2 + cleared, 9)",
)


def errors(text: str) -> list[Diagnostic]:
    return [finding for finding in reported(text, Options()) if finding.severity is Severity.ERROR]


def test_what_does_the_same_is_proved_and_the_first_runs() -> None:
    assert errors(INJECTION) == []
    program = program_of(INJECTION)
    [table] = program.tables
    start = initial(program) | {"water": 1000, "mode_in": 1, "reset": True, "overridden": True}
    outcome = run_table(program, table, start)
    assert (outcome.fault, outcome.line) == (Fault.OK, "r_2")
    assert run_table(program, table, start | {"water": 0}).line == "r_5"
    [overlap] = errors(edited(INJECTION, ("r_5 same r_2", "r_5         ")))
    assert overlap.code.value == "RCS402"


def test_what_does_not_is_told_with_the_least_input_and_both_results() -> None:
    [error] = errors(edited(INJECTION, OTHER))
    assert (
        error.message == "lines `r_2` and `r_5` of table `override_rules` are said to do the same, and do not"
    )
    [shown] = error.witnesses
    assert dict(zip(shown.variables, shown.values, strict=True)) == {
        "water": "900", "mode_in": "normal", "reset": "true", "cleared": "0",
    }  # fmt: skip
    assert [line.cells for line in shown.lines] == [
        (">= 900", "normal", "", ""),
        ("", "in {too_low, normal}", "true", ""),
    ]
    assert error.notes == ("`cleared` is then 1 by `r_2`, 2 by `r_5`", "they differ in: cleared")
    assert error.effects is not None
    assert error.effects.differ_in == ("cleared",)
    span = error.primary.span
    assert edited(INJECTION, OTHER)[span.start : span.end] == "r_2"


def test_what_is_different_where_both_never_match_does_not_matter() -> None:
    apart = edited(
        INJECTION,
        ("min(1 + cleared, 9) |", "min(cleared + (if_low + 1), 9) |"),
        ("state cleared", "input if_low : int 0 .. 9\nstate cleared"),
    )
    assert [error.code.value for error in errors(apart)] == ["RCS422"]
    elsewhere = edited(apart, ("(if_low + 1)", "(1 + max(0, 900 - water) / 900)"))
    assert errors(elsewhere) == []


def test_all_of_a_class_are_compared_and_no_other_overlap_is_let_through() -> None:
    three = """
input a : int 0 .. 9
output x : int 0 .. 9
table t {
  | line         | a    || x |
  | six same two | 2, 6 || 6 |
  | one          | < 6  || 1 |
  | two same one | > 3  || 1 |
}"""
    found = errors(three)
    assert [(error.code.value, error.message) for error in found] == [
        ("RCS422", "lines `six` and `two` of table `t` are said to do the same, and do not"),
        ("RCS422", "lines `six` and `one` of table `t` are said to do the same, and do not"),
    ]
    left = edited(three, ("six same two", "six         "), ("2, 6 || 6", "6 || 1"))
    assert [(error.code.value, error.message) for error in errors(left)] == [
        ("RCS402", "lines `six` and `two` of table `t` both match some input"),
    ]
    assert errors(edited(three, ("2, 6 || 6", "2, 6 || 1"))) == []
    gap = edited(three, ("2, 6 || 6", "2, 5 || 1"), ("> 3 ", "> 6 "))
    assert [error.code.value for error in errors(gap)] == ["RCS401"]


def test_one_that_lies_wholly_within_an_earlier_one_never_runs() -> None:
    [dead] = errors("""
input a : int 0 .. 9
output x : int 0 .. 9
table t {
  | line         | a    || x |
  | one          | < 7  || 1 |
  | six same one | 2, 6 || 1 |
  | two          | > 6  || 1 |
}""")
    assert dead.code.value == "RCS403"
    assert dead.notes == ("wherever its cells hold one of these matches, which go before it: `one`",)


def test_what_stands_above_one_of_them_runs_and_is_no_matter_for_the_other() -> None:
    text = """
input a : bool
input b : bool
input stop : bool
output x : int 0 .. 9
table t {
  | line             | a    | b    | stop  || x               |
  | one              | true |      |       || 1               |
  | two same one     |      | true |       || 1 + int(stop)   |
  | stops above one  |      |      | true  || 0               |
  | none             | false| false| false || 2               |
}"""
    [overlap] = errors(
        text
    )  # where `stop` holds `one` does not come through, so that only `two` meets `stops`
    assert overlap.message == "lines `two` and `stops` of table `t` both match some input"
    assert errors(edited(text, ("stops above one ", "stops above one, two "))) == []


def test_a_pair_that_needs_an_assumption_rests_on_it() -> None:
    text = """
input a : int 0 .. 9
input calm : bool
output x : int 0 .. 9
assume is_calm assumed : calm
table t assuming is_calm {
  | line         | a   || x                |
  | low          | < 6 || 1                |
  | high same low| > 3 || 2 - int(calm)    |
}"""
    verdict = verdict_of(text)
    assert verdict.proved is not None
    assert [str(name) for name, _ in verdict.tables[0].backing.assumptions] == ["is_calm"]
    assert [error.code.value for error in errors(edited(text, ("t assuming is_calm", "t")))] == ["RCS422"]
    plain = verdict_of(edited(text, ("2 - int(calm) ", "1")))
    assert plain.tables[0].backing.assumptions == ()
    outcome = certify(program_of(text), dict(verdict.certificate or {}))
    assert outcome.whole, outcome
    assert "assumption `is_calm` (assumed)" in outcome.rests_on


def test_lines_with_the_same_actions_do_the_same_whatever_these_are() -> None:
    text = """
input a : int 0 .. 9
output x : int 0 .. 9
extern procedure outside reads a writes x python "my.own:outside" c "outside"
table t {
  | line          | a   || procedures |
  | low           | < 6 || outside    |
  | high same low | > 3 || outside    |
}"""
    found = certify(program_of(text), dict(verdict_of(text).certificate or {}))
    assert found.whole
    assert "lines `low` and `high` of table `t` do the same: their actions are the same" in found.checked


def test_an_invariant_may_be_needed_and_what_is_undecided_fails() -> None:
    text = """
input a : int 0 .. 9
state n : int 0 .. 9 = 4
invariant few : n < 5
table t {
  | line         | a   || n          |
  | low          | < 6 || n          |
  | high same low| > 3 || n mod 5    |
}"""
    assert errors(text) == []
    assert [str(name) for name, _ in verdict_of(text).tables[0].backing.assumptions] == ["few"]
    assert [error.code.value for error in errors(edited(text, ("invariant few : n < 5\n", "")))] == ["RCS422"]
    hard = edited(text, ("n mod 5", "(n * a * a + n) / (a * a + 1) mod 5"))
    undecided = prove_program(program_of(hard), Options(steps=1)).findings
    assert {finding.code.value for finding in undecided} >= {"RCS409"}


@pytest.mark.parametrize(("word", "said"), [("same", "are said to do the same"), ("above", "are ordered")])
def test_lines_that_never_meet_are_told(word: str, said: str) -> None:
    text = f"""
input a : int 0 .. 9
input b : int 0 .. 9
output x : bool
assume ordered assumed : a <= b
table t assuming ordered {{
  | line          | a   | when    || x |
  | one           | < 5 |         || true |
  | two {word} one| > 5 |         || true |
  | odd           | 5   | b >= 5  || true |
  | six {word} odd|     | b < a   || true |
}}"""
    warnings = [found for found in reported(text, Options()) if found.code.value == "RCS423"]
    pairs = [("one", "two"), ("odd", "six")] if word == "same" else [("two", "one"), ("six", "odd")]
    assert [found.message for found in warnings] == [
        f"lines `{first}` and `{second}` of table `t` {said}, and never match together"
        for first, second in pairs
    ]
    assert all(found.severity is Severity.WARNING for found in warnings)


@pytest.mark.parametrize(("word", "said"), [("same", "are said to do the same"), ("above", "are ordered")])
def test_lines_that_meet_only_where_an_assumption_fails_are_told_as_such(word: str, said: str) -> None:
    """To leave the word out would leave two lines there, and none that goes first."""
    text = f"""
input x : int 0 .. 9
output o : bool
assume small monitored : x <= 8
table t assuming small {{
  | line         | x || o    |
  | e {word} b   | 9 || true |
  | b            |   || true |
}}"""
    [found] = [found for found in reported(text, Options()) if found.code.value == "RCS423"]
    assert (
        found.message
        == f"lines `e` and `b` of table `t` {said}, and match together only where an assumption fails"
    )
    assert (found.help, found.notes) == ((), ("under `small`",))


WORDS = """
state a : int 0 .. 4294967295
output o : int 0 .. 9
table t {
  | line       | a[3..0]   | a                                    || o |
  | n1         | in {0, 8} | 0bx1xx1xxx10x0x1xxxxxxxxx1011xx01x    || 1 |
  | n2 same n1 |           |                                      || 2 |
}"""


def test_bits_tell_lines_apart_that_are_said_to_do_the_same() -> None:
    assert [each.code for each in reported(WORDS, Options()) if "`n1` and `n2`" in each.message] == [
        Code.NEVER_MEET
    ]


@pytest.mark.parametrize("bare", [False, True])
def test_of_lines_that_may_never_meet_nothing_is_said_to_differ(
    bare: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What each line leaves is another thing whatever the input; whether there is one at which both match was left open."""
    monkeypatch.setattr(meetings, "meeting", lambda *_: Answer.UNKNOWN)
    program = program_of(WORDS)
    [found] = meetings.met(program, program.tables[0], Options(bare=bare)).findings
    assert (found.code, found.message) == (
        Code.UNDECIDED,
        "whether lines `n1` and `n2` of table `t` do the same could not be decided",
    )


def test_the_checker_settles_it_itself_and_refuses_what_is_not_so(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = verdict_of(INJECTION)
    outcome = certify(program_of(INJECTION), dict(verdict.certificate or {}))
    assert outcome.whole, outcome
    assert (
        "lines `r_2` and `r_5` of table `override_rules` do the same: `cleared` is the same"
        in outcome.checked
    )
    monkeypatch.setattr(proving, "met", lambda *_: Met(()))
    wrong = edited(INJECTION, OTHER)
    forged = verdict_of(wrong).certificate
    assert forged is not None
    problems = certify(program_of(wrong), dict(forged)).problems
    assert len(problems) == 1
    assert "do the same: `cleared` is the same: does not hold where" in problems[0]


def test_the_checker_names_what_it_does_not_follow() -> None:
    text = """
input a : int 0 .. 9
output x : int 0 .. 9
extern procedure outside reads a writes x python "my.own:outside" c "outside"
procedure around { outside }
table t {
  | line          | a   || procedures |
  | low           | < 6 || outside    |
  | high same low | > 3 || around     |
}"""
    verdict = verdict_of(text)
    assert verdict.proved is not None, verdict.findings
    [left] = certify(program_of(text), dict(verdict.certificate or {})).unchecked
    assert left.name == "lines `low` and `high` of table `t` do the same: they call extern procedures"


def test_both_executors_the_graph_and_json_have_it(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "injection.rcs"
    path.write_text(INJECTION, encoding="utf-8")
    assert run(["test", "--examples", "20", "--mutants", "0", "--no-cortex", str(path)]) == 0
    assert "interpreter = Python = C" in capfd.readouterr().out
    assert run(["graph", str(path), "--state", "overridden", "--form", "scxml"]) == 0
    assert "the table read back from the graph does the same: proved" in capfd.readouterr().err
    assert run(["compile", str(path), "--out", str(tmp_path / "out")]) == 0
    code = (tmp_path / "out" / "c" / "injection.c").read_text()
    assert re.search(r"injection\.rcs line r_5: [^*]*the same as: r_2", code)
    capfd.readouterr()
    path.write_text(edited(INJECTION, OTHER), encoding="utf-8")
    assert run(["check", "--json", str(path)]) == 1
    [error] = [
        each for each in json.loads(capfd.readouterr().out)["diagnostics"] if each["severity"] == "error"
    ]
    assert error["effects"] == {"same": False, "differ_in": ["cleared"]}


def test_it_is_shown_and_laid_out() -> None:
    [note] = [found for found in reported(INJECTION) if found.code.value == "RCS424"]
    assert note.notes == ("the same as `r_2`, only where not (mode_in = normal and water >= 900): `r_5`",)
    assert isinstance(program_of(INJECTION), Program)
