"""Overlaps that come of the same cells are told once in a text; the JSON form has each, and whether its two lines do the same."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from rcsc.base.diagnostics.render import full, plain
from rcsc.base.diagnostics.source import Source
from rcsc.front.commands import run
from tests.support.programs.stages import reported

SCHEMA = Path(__file__).parents[2] / "rcsc" / "base" / "diagnostics" / "schema" / "report.schema.json"
STATES = """
enum state { a, b, c, d }
input now : state
input stop : bool
input done : bool
output to : int 0 .. 9
table t {
  | line    | now    | stop | done  || to |
  | a_ends  | a      |      | true  || 1  |
  | stopped | /= d   | true |       || 0  |
  | b_ends  | b      |      | true  || 2  |
  | c_ends  | c      |      | true  || 0  |
  | b_again | b      |      | true  || 4  |
  | rest    | DEFAULT |     |       || 5  |
}"""


def test_what_comes_of_the_same_cells_to_the_same_end_is_one_group() -> None:
    found = [finding for finding in reported(STATES) if finding.code.value == "RCS402"]
    told = [finding for finding in found if not finding.told_with]
    assert (len(found), len(told)) == (5, 3)
    assert [
        finding.message.split("` and `")[0] + " " + finding.message.split("`")[3] for finding in told
    ] == [
        "lines `a_ends stopped",
        "lines `stopped c_ends",  # both do the same: a group of its own
        "lines `b_ends b_again",  # parted by no column
    ]
    assert told[0].notes[1] == (
        "2 more pairs overlap where done = true, stop = true: `stopped` with `b_ends`, `b_again`; --json lists each"
    )
    assert "or keep both, and say that they do the same: `c_ends same stopped`" in told[1].help
    assert told[2].notes[-1].startswith("the helps of these")


def test_a_text_shows_a_group_once_and_json_has_each(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "t.rcs"
    path.write_text(STATES, encoding="utf-8")
    assert run(["check", str(path)]) == 1
    text = capfd.readouterr().out
    assert text.count("error[RCS402]") == 3
    assert "5 errors" in text
    assert run(["check", "--format", "line", str(path)]) == 1
    assert capfd.readouterr().out.count("error[RCS402]") == 5
    assert run(["check", "--json", str(path)]) == 1
    listed = json.loads(capfd.readouterr().out)["diagnostics"]
    assert [each["effects"]["same"] for each in listed if each["code"] == "RCS402"].count(True) == 1


def test_pairs_past_the_twentieth_say_in_json_whether_they_do_the_same(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    rows = "\n".join(f"| l{number} | < {number + 1} || {number % 2} |" for number in range(8))
    path = tmp_path / "t.rcs"
    path.write_text(
        f"input n : int 0 .. 9\noutput x : int 0 .. 1\ntable t {{\n| line | n || x |\n{rows}\n}}",
        encoding="utf-8",
    )
    assert run(["check", "--json", str(path)]) == 1
    report = json.loads(capfd.readouterr().out)
    Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8"))).validate(report)
    [rest] = [each for each in report["diagnostics"] if "more pairs" in each["message"]]
    assert len(rest["witnesses"]) == 8
    for witness in rest["witnesses"]:
        first, second = (int(line["name"][1:]) for line in witness["lines"])
        assert witness["effects"]["same"] is ((first - second) % 2 == 0)


def test_an_excerpt_of_a_wide_row_shows_the_name_and_the_cell_that_matters() -> None:
    blank = " " * 120
    text = f"""
input a : bool
input b : int 0 .. 9
output x : int 0 .. 9
table t {{
  | line | a    {blank} | b    {blank} || x |
  | one  | true {blank} | <= 4 {blank} || 1 |
  | two  | true {blank} | >= 4 {blank} || 2 |
  | six  | false{blank} |      {blank} || 3 |
}}"""
    [overlap] = [finding for finding in reported(text) if finding.code.value == "RCS402"]
    source = Source(overlap.primary.span.file, text)
    shown = plain(full(overlap, {source.name: source})).splitlines()
    rows = [row for row in shown if row.startswith(("7 |", "8 |"))]
    assert [any(word in row for row in rows) for word in ("one", "two", ">= 4")] == [True] * 3
    assert max(map(len, rows)) <= 110
    marks = [shown[shown.index(row) + 1] for row in rows]
    assert [mark.split()[1] for mark in marks] == ["---", "^^^", "----"]
    for row, mark, word in zip(rows, marks, ("one", "two", ">= 4"), strict=True):
        assert mark.index("^" if "^" in mark else "-") == row.index(word)
    narrow = plain(full(overlap, {source.name: source}, 400))
    assert narrow.count("8 |") == 1  # one excerpt where all fits


def test_a_heading_that_is_a_sum_gets_helps_that_mend_the_table() -> None:
    text = """
input a : int 0 .. 20
input b : int 0 .. 20
output x : int 0 .. 9
table t {
  | line | 3 + b - a || x |
  | one  | < 3       || 1 |
  | two  | 3 .. 6    || 2 |
  | six  | 5 .. 11   || 6 |
  | ten  | > 12      || 6 |
}"""
    gap, overlap = sorted((finding for finding in reported(text)), key=lambda finding: finding.code.value)
    assert gap.help == ("a line `| new | 12 || ... |` closes the gap and overlaps no other: proved",)
    assert overlap.help[0].startswith(
        "in line `six` write `7 .. 11` under `3 + b - a`: proved to part the two lines"
    )
    mended = text.replace("5 .. 11 ", "7 .. 11 ").replace("| ten  |", "| new | 12 || 0 |\n  | ten  |")
    assert reported(mended) == ()


def test_a_cell_beside_conditions_across_variables_is_narrowed_only_where_nothing_falls() -> None:
    text = """
enum mode { off, slow, fast }
input wanted : mode
input a : int 0 .. 20
input b : int 0 .. 20
output x : int 0 .. 9
table t {
  | line | wanted      | when  || x |
  | off  | off         |       || 1 |
  | any  | off, slow   | a < b || 2 |
  | rest | slow        | a >= b|| 3 |
  | fast | fast        |       || 4 |
}"""
    [overlap] = [finding for finding in reported(text) if finding.code.value == "RCS402"]
    assert overlap.help[0].startswith(
        "in line `any` write `slow` under `wanted`: proved to part the two lines"
    )
    assert reported(text.replace("| off, slow   |", "| slow        |")) == ()


def test_a_witness_is_one_that_the_declared_facts_allow_where_there_is_one() -> None:
    text = """
input gear : int 0 .. 5
input fast : bool
output x : int 0 .. 9
assume steps assumed : abs(gear - was gear) <= 1 and was gear >= 3
assume fast_above assumed : fast implies gear > 4
table t {
  | line | gear       | fast  || x |
  | low  | in {1, 2}  |       || 1 |
  | mid  | 0 .. 3     | false || 2 |
  | top  | >= 3       | false || 3 |
}"""
    found = {
        finding.message.split("`")[1]: finding for finding in reported(text) if finding.code.value == "RCS402"
    }
    assert {name: finding.witnesses[0].values for name, finding in found.items()} == {
        "low": ("2", "false"),  # 1 is no gear that follows
        "mid": ("3", "false"),
    }
    [gap] = [finding for finding in reported(text) if finding.code.value == "RCS401"]
    assert gap.witnesses[0].values == ("5", "true")
    free = text.replace("was gear >= 3", "was gear >= 0").replace(
        "fast implies gear > 4", "fast implies gear > 9 - 4"
    )
    assert {each.witnesses[0].values[0] for each in reported(free) if each.code.value == "RCS402"} == {
        "1",
        "3",
    }
    [none] = [finding for finding in reported(free) if finding.code.value == "RCS401"]
    assert none.witnesses[0].values == ("0", "true")  # no fact allows any: the least
