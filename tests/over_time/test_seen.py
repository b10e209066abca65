"""Requirements over time, and the names that they carry, as the other commands and editors show them."""

from pathlib import Path

import pytest

from rcsc.desk.editor.names.about import about
from rcsc.desk.editor.names.find import Names
from rcsc.desk.editor.names.index import Space, occurrences
from rcsc.front.commands import run as rcsc
from rcsc.lang.leaves import Uses, spoken_of
from rcsc.lang.project import load
from tests.support.programs.stages import program_of

DOOR = """\
input asked : bool
input far_mm : int 0 .. 9 [mm]
output given : bool
requirement in_time req "SR-7" : while far_mm < 5 [mm], when asked since once given, within 3 cycles, given
table t {
  | line | asked || given |
  |------|-------||-------|
  | yes  | true  || true  |
  | no   | false || false |
}
level l { period 10 [ms] table t }
"""


def test_it_speaks_of_what_its_conditions_read() -> None:
    program = program_of(DOOR)
    [stated] = program.properties
    assert set(spoken_of(stated)) == {"far_mm", "asked", "given"}
    uses = Uses(program)
    assert all("requirement in_time" in uses.read[name] for name in spoken_of(stated))
    assert list(uses.requirements[spoken_of(stated)[0]]) == ["SR-7"]


@pytest.fixture
def door(tmp_path: Path) -> Path:
    path = tmp_path / "door.rcs"
    path.write_text(DOOR, encoding="utf-8")
    return path


def test_trace_and_check_name_it(door: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rcsc(["trace", str(door), "--find", "SR-7"]) == 0
    text = capsys.readouterr().out
    assert (
        "door.rcs:4: requirement in_time: while far_mm < 5 [mm], when asked since once given, within 3 cycles, given"
        in text
    )
    assert rcsc(["check", str(door)]) == 0
    assert "requirement `in_time` is not proved here" in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (
            ("within 3 cycles", "within 4 cycles"),
            "within 3 cycles, given -> while far_mm < 5 [mm], when asked since once given, within 4",
        ),
        (("once given", "given"), "once given, within 3 cycles, given -> "),
        (("in_time req", "in_time monitored req"), "requirement `in_time`  now monitored"),
        (("requirement in_time", "requirement other"), "requirement `other`  new: while"),
    ],
)
def test_diff_tells_what_changed(
    door: Path, edit: tuple[str, str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = door.with_name("other.rcs")
    other.write_text(DOOR.replace(*edit), encoding="utf-8")
    rcsc(["diff", str(door), str(other)])
    text = " ".join(capsys.readouterr().out.split())
    assert " ".join(said.split()) in text
    other.write_text(DOOR.replace("## ", ""), encoding="utf-8")
    assert rcsc(["diff", str(door), str(other)]) == 0
    assert "requirement" not in capsys.readouterr().out


SLOW = 'assume slow assumed req "SR-8" : at least 3 cycles apart, asked\n'


def test_an_assumption_is_shown_where_requirements_are(
    door: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    door.write_text(DOOR.replace("requirement", f"{SLOW}requirement"), encoding="utf-8")
    assert rcsc(["trace", str(door), "--find", "SR-8"]) == 0
    text = capsys.readouterr().out
    assert "door.rcs:4: assumption slow: at least 3 cycles apart, asked" in text
    program = program_of(door.read_text(encoding="utf-8"))
    assert "assumption slow" in Uses(program).read[spoken_of(program.environment[0])[0]]
    other = door.with_name("other.rcs")
    for edit, said in (
        (
            ("at least 3", "at least 4"),
            "assumption `slow` at least 3 cycles apart, asked -> at least 4 cycles apart, asked",
        ),
        (("slow assumed", "slow assumed monitored"), "assumption `slow` now monitored"),
        (('assume slow assumed req "SR-8"', "requirement slow"), "assumption, now requirement"),
        ((SLOW, ""), "assumption `slow` gone: at least 3 cycles apart, asked"),
    ):
        other.write_text(door.read_text(encoding="utf-8").replace(*edit), encoding="utf-8")
        rcsc(["diff", str(door), str(other)])
        assert said in " ".join(capsys.readouterr().out.split())


def test_editors_tell_what_an_assumption_is() -> None:
    text = DOOR.replace("requirement", f"{SLOW}requirement")
    loaded = load(["-"], stdin=text, stdin_name="door.rcs")
    names = Names(loaded.files, loaded.sources, program_of(text))
    every = list(occurrences(loaded.files["door.rcs"]))
    said = {one.text: about(names, one, {}) for one in every}
    assert "assumption over time, of what comes from outside: trusted by `rcsc prove`" in said["slow"]
    assert "`slow` (assumed over time)" in said["asked"]


def test_editors_know_its_names() -> None:
    loaded = load(["-"], stdin=DOOR, stdin_name="door.rcs")
    names = Names(loaded.files, loaded.sources, program_of(DOOR))
    every = list(occurrences(loaded.files["door.rcs"]))
    for word, many in (("far_mm", 2), ("asked", 3), ("given", 4)):
        assert sum(one.text == word for one in every) == many, word
    [own] = [one for one in every if one.text == "in_time"]
    assert own.space is Space.CLAIM
    assert "requirement: proved of the levels together" in about(names, own, {})
