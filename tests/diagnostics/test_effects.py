"""An overlap says whether its two lines do the same: held against the interpreter for every input that both match."""

import functools
import itertools
import json
import random
from pathlib import Path

import pytest

from rcsc.base.diagnostics.diagnostic import Effects
from rcsc.front.commands import run
from rcsc.lang.interpret import execute, matching_lines
from rcsc.lang.meaning import relying
from rcsc.lang.model import Backing, Program, Value
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from rcsc.proof.relation.alike import alike
from rcsc.proof.relation.effect import CALLS, RUN
from rcsc.proof.solvers import smt
from rcsc.proof.solvers.options import Options
from rcsc.proof.table.diagnose import diagnostics
from rcsc.proof.table.program import prove_program
from rcsc.proof.table.verdict import Overlap, TableVerdict
from tests.bench.editor import keys
from tests.support.programs.stages import program_of

HEAD = """
input a : int 0 .. 3
input b : bool
input x : real -1.0 .. 1.0
state n : int 0 .. 9
state m : int 0 .. 9
state held : int 0 .. 9 deferred until b
output go : bool
procedure put(k : int 0 .. 9) { n := k }
procedure both { n := a; m := a }
procedure swap { local k : int 0 .. 9 := n n := m m := k }
extern procedure seen(k : int 0 .. 3) writes m python "m:seen" c "seen"
extern procedure other(k : int 0 .. 3) writes m python "m:other" c "other"
"""


def effects(first: str, second: str, assume: str = "", where: str = "", more: str = "") -> Effects:
    """Of two lines with these actions, which both match where `where` holds."""
    claim = f"assume it assumed : {assume}\n" if assume else ""
    program = relying(
        program_of(
            f"{HEAD}{more}{claim}table t {'assuming it ' if assume else ''}{{\n| line | when || procedures |\n"
            f"| p | {where} || {first} |\n| q | n = n || {second} |\n}}\n"
        )
    )
    return alike(program, program.tables[0], (0, 1), Options())


@pytest.mark.parametrize(
    ("first", "second", "differ"),
    [
        ("", "", ""),
        ("both", "m := a; n := a", ""),
        ("n := 2", "put(1 + 1)", ""),
        ("n := n", "", ""),  # that something is written plays no part, only what it leaves
        ("swap; swap", "", ""),
        ("n := a", "n := min(a, 3)", ""),
        ("go := b", "go := b = true", ""),
        ("swap", "both", "n m"),
        ("n := a", "n := a + 1", "n"),
        ("n := a; go := true", "go := not b", "n go"),
        ("held := 3", "held := a", "held"),
        ("seen(a)", "seen(a)", ""),
        ("seen(a)", "seen(a + 0)", ""),
    ],
)
def test_lines_are_compared_by_what_they_leave(first: str, second: str, differ: str) -> None:
    assert effects(first, second) == Effects(not differ, tuple(differ.split()))


def test_extern_procedures_are_compared_by_what_they_are_called_with() -> None:
    assert CALLS in effects("seen(a)", "seen(0)").differ_in
    assert CALLS in effects("seen(a)", "other(a)").differ_in
    assert CALLS in effects("n := 1; seen(a)", "seen(a); n := 1").differ_in


def test_an_end_that_only_one_line_comes_to_is_a_difference() -> None:
    assert effects("n := 9 / a", "n := 9 / a").same
    assert RUN in effects("n := 9 / a", "n := 9 / max(a, 1)").differ_in


def test_only_inputs_that_both_match_count_under_what_the_table_may_rely_on() -> None:
    assert effects("n := a", "n := 2", where="a = 2").same
    assert effects("n := a", "n := 2", where="a >= 2").differ_in == ("n",)
    assert effects("n := a", "n := 2", where="a >= 2", assume="a < 3").same
    assert effects("n := m", "n := 3", where="m >= 3").differ_in == ("n",)
    assert effects("n := m", "n := 3", where="m >= 3", more="invariant low : m <= 3\n").same


def test_what_nobody_can_tell_is_not_called_the_same() -> None:
    program = program_of(
        "input a : int 0 .. 1000000\ninput b : int 0 .. 1000000\nstate n : int 0 .. 1000000\n"
        "table t {\n| line | a || n |\n| p | > 1 || (a * b * a * 7 + b * b * a) mod 999983 |\n"
        "| q | > 0 || (b * a * a * 7 + b * a * b) mod 999983 |\n}\n"
    )
    few = Options(steps=10)
    told = alike(program, program.tables[0], (0, 1), few)
    assert told == Effects(None)
    assert str(told) == "whether both do the same where both match could not be decided"


SHIPPED = Path(__file__).parents[2] / "tables"


@pytest.mark.parametrize("name", ["gothru", "goto"])
def test_what_two_lines_of_a_robot_do_is_told_soon(name: str) -> None:
    """What follows a line in space is made of products of doubles, which took Z3 minutes: lines that differ are seen to."""
    path = SHIPPED / "primitive" / f"{name}.rcs"
    for text in keys(path.read_text()):
        program = resolve(str(path), load([str(path)], overlay={str(path): text}))
        assert isinstance(program, Program)
        with smt.together(2**40) as asked:
            found = prove_program(program, Options(), only=[program.tables[0].name]).findings
        assert all(each.effects != Effects(None) for each in found)
        assert 2**40 - asked.left < 2_000_000


def test_elements_of_an_array_are_told_together() -> None:
    more = "state at : array[4] of int 0 .. 9\nstate of : array[2] of array[2] of int 0 .. 9\n"
    all_four = "at[0] := a; at[1] := a; at[2] := a; at[3] := a"
    told = effects(all_four, "n := a; at[3] := 4; of[1][0] := 1; of[1][1] := 2", more=more)
    assert str(told) == "they differ in: n, at[0 .. 3], of[1][0 .. 1]"
    assert (
        str(effects("at[0] := 3; at[2] := 3; at[3] := 3", "", more=more))
        == "they differ in: at[0], at[2 .. 3]"
    )


def test_what_is_said_is_what_running_each_line_alone_shows() -> None:
    draw = random.Random(13)  # noqa: S311 - the same lines in every run
    seen = set()
    for _ in range(25):
        first, second, where = (draw.choice(texts) for texts in (ACTIONS, ACTIONS, WHERES))
        differ: set[str] = set()
        for a, b, n, m in itertools.product(range(4), (False, True), range(4), range(4)):
            here: dict[str, Value] = {"a": a, "b": b, "n": n, "m": m}
            ends = after(first, second, where, here)
            differ |= {name for name in here if ends and ends[0][name] != ends[1][name]}
        seen.add(bool(differ))
        told = effects(first, second, where=where, assume="n <= 3 and m <= 3")
        assert set(told.differ_in) == differ, (first, second, where)
    assert seen == {True, False}


ACTIONS = ("n := a", "n := 2", "put(min(a, 2))", "m := n", "n := m; m := 1", "swap", "both", "")
WHERES = ("a = 2", "a <= 1", "b", "n = m", "a = 2 and b", "n = a")


@functools.cache
def written(text: str, where: str) -> Program:
    return program_of(
        f"{HEAD}table t {{\n| line | when || procedures |\n| p | {where} || {text} |\n| d | DEFAULT || |\n}}\n"
    )


def after(first: str, second: str, where: str, here: dict[str, Value]) -> list[dict[str, Value]]:
    """What each of the two leaves; nothing where they do not match."""
    ends = []
    for text in (first, second):
        program = written(text, where)
        if not matching_lines(program.tables[0], here):
            return []
        now = dict(here)
        execute(program, [action.statement for action in program.tables[0].lines[0].actions], now, {})
        ends.append(now)
    return ends


def test_the_report_says_it_in_text_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "t.rcs").write_text(
        "input x : int 0 .. 9\noutput y : int 0 .. 20\noutput z : bool\ntable t {\n| line | x || y | z |\n"
        "| low | <= 4 || x + x | true |\n| mid | 4 .. 6 || 2 * x | x > 2 |\n| top | >= 6 || 12 | false |\n}\n"
    )
    assert run(["check", "--no-cache", str(tmp_path / "t.rcs")]) == 1
    text = capsys.readouterr().out
    assert text.count("note: both do the same where both match\n") == 1
    assert text.count("note: they differ in: z\n") == 1
    assert run(["check", "--json", str(tmp_path / "t.rcs")]) == 1
    told = json.loads(capsys.readouterr().out)["diagnostics"]
    assert [one["effects"] for one in told] == [
        {"same": True, "differ_in": []},
        {"same": False, "differ_in": ["z"]},
    ]


def test_all_overlaps_of_a_table_share_one_budget() -> None:
    """However many pairs there are, what they ask together costs no more than the questions about one table."""
    columns = range(30)
    rows = "".join(
        f"| l{at} | >= {at} || {' | '.join(f'(a * b + {at + k} - {at}) * (b * a + {at + 7} - {at}) mod 999983' for k in columns)} |\n"
        for at in range(6)
    )
    states = "".join(f"state n{k} : int -1000000 .. 1000000\n" for k in columns)
    program = program_of(
        f"input a : int 0 .. 1000000\ninput b : int 0 .. 1000\n{states}"
        f"table t {{\n| line | a || {' | '.join(f'n{k}' for k in columns)} |\n{rows}}}\n"
    )
    pairs = [(first, second) for first in range(6) for second in range(first)]
    overlaps = tuple(Overlap(first, second, {"a": 9}) for first, second in pairs)
    verdict = TableVerdict(program.tables[0], overlaps, Backing("none", confirmed_by_z3=False), None, 0.0)
    few = Options(steps=20)
    with smt.together(2**40) as asked:
        told = diagnostics(program, verdict, few)
    assert told[-1].effects == Effects(None)
    assert 2**40 - asked.left <= few.together + few.steps
