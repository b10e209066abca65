"""`rcsc names`: every variable once, with those who write and read it, and its buffers; all forms say the same."""

import csv
import io
import json
import re
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from rcsc.desk.editor.names.about import _writers
from rcsc.front.commands import run
from rcsc.lang.interpret import cycle, initial
from rcsc.lang.leaves import Uses
from rcsc.run.description import description
from tests.support.programs.stages import program_of

TABLES = Path(__file__).parents[2] / "tables"
DOOR = """\
enum way { shut, open }
record seen {
  ## Between the leaves.
  width_mm : real 0.0 .. 90.0 [mm]
  door : way
}
## What the sensors see.
input now : seen
input told : bool
state at : way = open restart shut
state turn : int 0 .. 3 deferred until now.door = open
output press : bool safe false
output left : array[2] of int 0 .. 9
assume seen_right monitored req "R-1" : now.width_mm <= 80.0 or not told
invariant steady req "R-2" : press or at in {shut, open}
property still req "R-3" : told implies turn /= 2
procedure hold req "R-4" { left[turn mod 2] := 1 + turn mod 2  next turn := 1 }
table press_once req "R-5" {
  | line | now.width_mm | told  || procedures | at   | press | req   |
  | go   | > 10.0       | true  || hold       | shut | true  | "R-6" |
  | stop | <= 10.0      |       ||            | open | false | |
  | else | DEFAULT      |       ||            |      | false | |
}
level door {
  period 40 [ms]
  table press_once
}
"""


def listed(*arguments: str, capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    assert run(["names", "--form", "json", *arguments]) == 0
    found: list[dict[str, Any]] = json.loads(capsys.readouterr().out)["variables"]
    return found


SAID = """\
level door: 9 variables
  now.width_mm   input real 0.0 .. 90.0 mm, at first 0.0
      Between the leaves.
      read by table press_once: go, stop; assumption seen_right
      for R-6; R-5; R-1
  now.door   input way of shut, open, at first shut
      What the sensors see.
      read by deferral turn
  told   input bool, at first false
      read by table press_once: go; assumption seen_right; property still
      for R-6; R-1; R-3
  at   state way of shut, open, at first open, after a restart shut
      written by table press_once: go, stop
      read by invariant steady
      for R-6; R-5; R-2
  turn   state int 0 .. 3, at first 0
      written by deferral turn
      read by procedure hold; property still
      for R-4; R-3
  turn.next   state int 0 .. 3, at first 0
      written by procedure hold
      read by deferral turn
      for R-4
  press   output bool, at first false
      written by table press_once: go, stop, else
      read by invariant steady
      for R-6; R-5; R-2
  left[0]   output int 0 .. 9, at first 0
      written by procedure hold
      for R-4
  left[1]   output int 0 .. 9, at first 0
      written by procedure hold
      for R-4
"""


@pytest.fixture
def door(tmp_path: Path) -> Path:
    file = tmp_path / "door.rcs"
    file.write_text(DOOR, encoding="utf-8")
    return file


def test_each_variable_is_said_with_all_that_is_known_of_it(
    door: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["names", str(door)]) == 0
    assert capsys.readouterr().out == SAID


def test_every_variable_of_the_shipped_levels_is_there_once_and_its_buffers_are_those_of_the_system(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = listed(str(TABLES), capsys=capsys)
    system = description(TABLES / "system.toml")
    assert list(dict.fromkeys(one["level"] for one in found)) == [level.name for level in system.levels]
    names = [f"{one['level']}.{one['name']}" for one in found]
    assert len(set(names)) == len(names) > 300
    ends = {(source, one["level"]) for one in found for source in one["comes_from"]}
    ends |= {(target, one["level"]) for one in found for target in one["goes_to"]}
    for wire in system.wires:
        levels = {level.name for level in system.levels}
        for own, other in ((wire.target, wire.source), (wire.source, wire.target)):
            if own.partition(".")[0] in levels:
                assert (other, own.partition(".")[0]) in ends, wire
    fed = {f"database {feed.query}" for level in system.levels for feed in level.feeds}
    assert fed == {end for end, _ in ends if end.startswith("database ")}


def test_what_changes_in_a_cycle_has_a_writer_and_each_writer_once_changes_it() -> None:
    program = program_of(DOOR)
    uses, values = Uses(program), dict(initial(program))
    changed = set[str]()
    for width, told, shut in product((0.0, 50.0, 90.0, 5.0), (True, False), (True, False)):
        seen = {"now.width_mm": width, "told": told, "now.door": int(not shut)}
        after = cycle(program, program.levels[0], values | seen).snapshot
        changed |= {name for name, value in after.items() if value != values[name]} - seen.keys()
        values = dict(after)
    assert changed <= {str(name) for name in uses.written}
    assert changed == {"at", "turn", "turn.next", "press", "left[0]", "left[1]"}


def test_all_forms_say_the_same(door: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = listed(str(door), capsys=capsys)
    for form in ("csv", "html", "json", "txt"):
        assert run(["names", str(door), "-o", str(tmp_path / f"names.{form}")]) == 0
    rows = list(csv.DictReader(io.StringIO((tmp_path / "names.csv").read_text(encoding="utf-8"))))
    assert [row["name"] for row in rows] == [one["name"] for one in found]
    assert [row["read by"] for row in rows] == ["; ".join(one["read_by"]) for one in found]
    assert [row["place"] for row in rows] == [one["place"] for one in found]
    assert rows[0]["place"] == f"{door}:8"
    page = (tmp_path / "names.html").read_text(encoding="utf-8")
    assert re.findall(r"<td><code[^>]*>(.*?)</code>", page) == [one["name"] for one in found]
    assert "<script" not in page
    assert (tmp_path / "names.txt").read_text(encoding="utf-8") == SAID
    assert json.loads((tmp_path / "names.json").read_text(encoding="utf-8"))["variables"] == found


def test_a_word_chooses_and_tables_that_are_not_in_order_are_told(
    door: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert [one["name"] for one in listed("--find", "LEAVES", str(door), capsys=capsys)] == ["now.width_mm"]
    assert [one["name"] for one in listed("--find", "open", str(door), capsys=capsys)] == ["now.door", "at"]
    assert run(["names", "--find", "nobody", str(door)]) == 2
    door.write_text(DOOR.replace("| told  ||", "| tolld ||"), encoding="utf-8")
    assert run(["names", str(door)]) == 1
    told = capsys.readouterr()
    assert "RCS201" in told.out + told.err


def test_the_hover_says_the_same_writers() -> None:
    program = program_of(DOOR)
    said = {leaf: list(_writers(program, {leaf})) for leaf in ("at", "turn", "left[0]")}
    assert said == {
        "at": ["table `press_once` in `go`, `stop`"],
        "turn": ["deferral `turn`"],
        "left[0]": ["`hold`"],
    }
