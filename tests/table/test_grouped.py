"""Overlaps that come of the same cells are told once in a text; the JSON form has each, and whether its two lines do the same."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from rcsc.commands import run
from tests.support.programs.stages import reported

SCHEMA = Path(__file__).parents[2] / "rcsc" / "diagnostics" / "schema" / "report.schema.json"
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
