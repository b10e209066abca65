"""Helps of `rcsc prove` in the text: what is called proved is proved of what somebody would write, and of nothing else."""

from pathlib import Path

import pytest

from rcsc.compose.contract.obligations import Sort
from rcsc.compose.contract.transition import TransitionSystem
from rcsc.compose.counterexample.applied import Texts
from rcsc.compose.counterexample.finding import Finding, of_trace
from rcsc.compose.counterexample.repair import helps, repairs
from rcsc.compose.counterexample.trace import Trace, TraceSearch, traces
from rcsc.compose.proof.system import transition_systems
from rcsc.front.commands import run
from rcsc.proof.solvers import smt
from rcsc.proof.table.mending import Outcome
from tests.applied import campaign
from tests.support.programs.systems import solo_system
from tests.support.programs.texts import edit_file
from tests.support.proved import obligation_of

HEAD = "input a : int 0 .. 3\noutput o : int 0 .. 9\n"
LEVEL = "level solo { period 40 [ms] table t }\n"
ABOVE = f"""{HEAD}table t {{
  | line | a || o |
  |------|---||---|
  | p above q | <= 2 || 1 |
  | q | >= 2 || 2 |
  | r | = 2 || 3 |
}}
{LEVEL}"""
"""Less of p is more of q, which then meets r; less of r leaves it nothing."""

PLAIN = ABOVE.replace(">= 2", ">= 3")
"""No line has what p loses but r."""


def finding(ts: TransitionSystem, sort: Sort, name: str = "") -> Finding:
    obligation = obligation_of(ts, sort, "t", name)
    [trace] = traces(ts, [obligation], TraceSearch(most=4, legal=True)).values()
    assert isinstance(trace, Trace)
    return of_trace(ts, obligation, trace)


def level(folder: Path, text: str) -> TransitionSystem:
    return transition_systems(solo_system(folder, text))["solo"]


def test_a_cell_that_meets_another_line_once_written_is_not_offered(tmp_path: Path) -> None:
    """Of the table as resolved, `<= 1` in p parts it from r; as written, q has 2, too."""
    ts = level(tmp_path, ABOVE)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    assert repairs(ts, [found], [], 4).helps == (helps(ts, found),)
    assert helps(ts, found) == ("lines `p` and `r` both match while a = 2",)


def test_a_cell_that_is_proved_is_proved_of_its_text(tmp_path: Path) -> None:
    """Without q what p loses is r's alone; and so says `rcsc check` of the text with the cell."""
    ts = level(tmp_path, PLAIN)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    said = "in line `p` write `<= 1` under `a`: proved to part the two lines; line `r` then runs where both match (o 3, not 1)"
    assert helps(ts, found) == (said,)
    assert repairs(ts, [found], [], 4).helps == ((f"{said}; no run of 4 cycles shows that it breaks more",),)
    edit_file(tmp_path / "solo.rcs", ("| p above q | <= 2 |", "| p above q | <= 1 |"))
    assert run(["check", str(tmp_path / "solo.rcs")]) == 0


def test_what_was_saved_since_is_not_proved(tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN)
    found = finding(ts, Sort.ONE_LINE, "p and r")
    edit_file(tmp_path / "solo.rcs", ("| q | >= 3 ||", "| q | >= 2 ||"))
    (help_,) = helps(ts, found)
    assert ": not proved to part the two lines; " in help_
    [(tried,)] = repairs(ts, [found], [], 4).helps
    assert tried == help_, "and no run of a text that is not known is told of"


def test_a_cell_past_the_budget_is_not_proved(tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN)
    (help_,) = helps(ts, finding(ts, Sort.ONE_LINE, "p and r"), Texts(smt.Budget(100, of_all=True)))
    assert ": not proved to part the two lines; " in help_


@pytest.mark.parametrize("saved", [False, True])
def test_a_line_is_proved_of_the_text_that_has_it(saved: bool, tmp_path: Path) -> None:
    ts = level(tmp_path, PLAIN.replace("<= 2", "< 1"))
    found = finding(ts, Sort.SOME_LINE)
    if saved:
        edit_file(tmp_path / "solo.rcs", ("| q | >= 3 ||", "| q | >= 2 ||"))
    *_, row = helps(ts, found)
    standing = "not proved" if saved else "proved"
    assert row == f"a line `| new | 1 || ... |` closes the gap and overlaps no other: {standing}"


WEAKEST = """state n : int 0 .. 3
{stated}
table t assuming few {{
  | line | n    || n     |
  |------|------||-------|
  | up   | <= 1 || n + 1 |
  | top  | 2    || 3     |
}}
level solo {{ period 40 [ms] table t }}
"""


@pytest.mark.parametrize("saved", [False, True])
def test_the_weakest_condition_is_proved_of_the_text_that_assumes_it(saved: bool, tmp_path: Path) -> None:
    ts = level(tmp_path, WEAKEST.format(stated="assume few monitored : n <= 2"))
    obligation = obligation_of(ts, Sort.ASSUMPTION, "t", "few")
    [trace] = traces(ts, [obligation], TraceSearch(most=4, legal=True)).values()
    assert isinstance(trace, Trace)
    if saved:
        edit_file(tmp_path / "solo.rcs", ("| <= 1 |", "| <= 2 |"))
    *_, said = helps(ts, of_trace(ts, obligation, trace))
    standing = "not proved" if saved else "proved"
    assert said == f"exactly one line matches under no more than this: not (n = 3): {standing}"


@pytest.mark.parametrize(
    ("condition", "outcome"),
    [
        ("n /= 3", Outcome.HOLDS),
        ("n <= 1", Outcome.FAILS),  # and n = 2
        ("n < 9", Outcome.FAILS),  # and not n = 3
        ("m <= 2", Outcome.FAILS),
    ],
)
def test_a_condition_that_is_not_the_weakest_is_not_proved(
    condition: str, outcome: Outcome, tmp_path: Path
) -> None:
    ts = level(tmp_path, WEAKEST.format(stated="assume few monitored : n <= 2"))
    assert Texts().of(ts, "t").under(condition) is outcome


def test_a_cell_of_a_used_file_is_written_there(tmp_path: Path) -> None:
    """The level stands in one file, and its table in another that it uses."""
    (tmp_path / "part.rcs").write_text(PLAIN.replace(LEVEL, ""), encoding="utf-8")
    ts = level(tmp_path, f"use part\n{LEVEL}")
    (help_,) = helps(ts, finding(ts, Sort.ONE_LINE, "p and r"))
    assert help_.startswith("in line `p` write `<= 1` under `a`: proved to part")


def test_what_is_proved_of_drawn_tables_holds_of_their_texts() -> None:
    came, _ = campaign(9, "short")
    assert came[Outcome.HOLDS] >= 9
