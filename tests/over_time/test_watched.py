"""Requirements are watched in runs by the monitor that is proved: in a log, in a run in processes, in a campaign."""

import re
from pathlib import Path

import pytest

from rcsc.front.commands import run as rcsc
from rcsc.lang.model import Program
from rcsc.run.description import description
from rcsc.run.log.read import read
from rcsc.run.log.required import broken_in, program_of, requirements

DOOR = """\
input asked : bool
output given : bool
state waited : int 0 .. 3
requirement in_time monitored : when asked, within 1 cycles, given
requirement some_time : when asked, within 3 cycles, given or not asked
requirement rare : at least 30 [ms] apart, given
table t {
  | line | asked | waited || given | waited     |
  |------|-------|--------||-------|------------|
  | wait | true  | < 2    || false | waited + 1 |
  | give | true  | >= 2   || true  | 0          |
  | idle | false |        || false | 0          |
}
level l { period 10 [ms] table t }
"""
SYSTEM = """\
name = "door"
tick_ms = 10
generated = "generated"
[[level]]
name = "l"
program = "door"
[buffers]
"world.asked" = "l.asked"
"l.given" = "world.given"
[plant]
python = "plant.py"
"""
PLANT = """\
class World:
    asked: bool = False
    given: bool = False
    tick: int = 0

    def step(self, seconds: float) -> None:
        self.tick += 1
        self.asked = 5 <= self.tick < 9
"""


@pytest.fixture
def system(tmp_path: Path) -> Path:
    for name, text in (("door.rcs", DOOR), ("system.toml", SYSTEM), ("plant.py", PLANT)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def said(capsys: pytest.CaptureFixture[str]) -> str:
    out, err = capsys.readouterr()
    return out + err


def test_a_run_says_which_cycle_breaks_a_requirement_and_replay_finds_it(
    system: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The order is taken in cycle 6, and is to be answered in cycle 7; only what is `monitored` is said by itself."""
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python"]) == 1
    text = said(capsys)
    assert re.findall(r"cycle (\d+): requirement `(\w+)`", text) == [("7", "in_time")]
    assert "it says: when asked, within 1 cycles, given" in text
    log = str(system / ".rcsc-cache" / "door.mcap")
    replay = ["replay", log, "--system", str(system), "--executor", "python", "--find"]
    assert rcsc([*replay, "not l.in_time"]) == 0
    assert said(capsys).startswith("cycle 7,")
    assert rcsc([*replay, "not l.some_time or not l.rare"]) == 1
    assert "holds in no cycle" in said(capsys)
    assert rcsc([*replay, "not l.in_time and l.given"]) == 1


def test_a_run_that_keeps_what_is_watched_is_no_finding(
    system: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = DOOR.replace("within 1 cycles, given", "within 2 cycles, given")
    (system / "door.rcs").write_text(kept, encoding="utf-8")
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python"]) == 0
    text = said(capsys)
    assert "watched: 1 requirement, none broken" in text
    assert "requirement `" not in text
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python", "--quiet"]) == 0
    assert "requirement" not in said(capsys)


def test_processes_watch_the_same(system: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--cycles", "20", "--executor", "python", "--processes", "--in-step", "--rate", "20"]
    assert rcsc(["run", str(system), *options]) == 1
    assert re.findall(r"cycle (\d+): requirement `(\w+)`", said(capsys)) == [("7", "in_time")]


def campaign(system: Path, episodes: int) -> list[str]:
    drawn = ["--episodes", str(episodes), "--seed", "1", "--executor", "python", "--workers", "1"]
    return ["campaign", str(system), *drawn]


def test_a_campaign_watches_every_requirement_and_names_the_cycle(
    system: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = campaign(system, episodes=4)
    assert rcsc([*command, "--save", str(tmp_path / "found")]) == 1
    text = said(capsys)
    assert "`l: in_time` does not hold: `when asked, within 1 cycles, given` is broken in line `wait`" in text
    assert "l: some_time" not in text


ASSUMED = DOOR.replace(
    "requirement in_time monitored",
    "assume brief assumed monitored : whenever asked, at once not was asked\nrequirement in_time monitored",
)


def test_a_run_tells_a_plant_that_breaks_what_is_assumed(
    system: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plant asks from cycle 6 on: no level is at fault."""
    (system / "door.rcs").write_text(ASSUMED, encoding="utf-8")
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python"]) == 1
    text = said(capsys)
    assert "level `l`, cycle 7: by what comes from outside, assumption `brief` is broken" in text
    assert "what is proved trusting it says nothing of this cycle, nor of any later one" in text
    log = str(system / ".rcsc-cache" / "door.mcap")
    assert (
        rcsc(["replay", log, "--system", str(system), "--executor", "python", "--find", "not l.brief"]) == 0
    )
    assert said(capsys).startswith("cycle 7,")
    unwatched = ASSUMED.replace("assumed monitored", "assumed")
    (system / "door.rcs").write_text(unwatched, encoding="utf-8")
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python"]) == 1
    assert "assumption `" not in said(capsys)


BRIEF = ASSUMED.replace("when asked, within 1 cycles, given", "never waited > 1")
"""What is required follows from what is assumed."""


def test_in_a_campaign_what_a_level_does_after_the_plant_broke_an_assumption_is_no_fault_of_it(
    system: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (system / "door.rcs").write_text(BRIEF, encoding="utf-8")
    command = campaign(system, episodes=4)
    assert rcsc([*command, "--save", str(tmp_path / "found")]) == 1
    text = said(capsys)
    assert (
        "`l: assumption brief` does not hold: what comes from outside does not keep `whenever asked, at once not was asked`"
        in text
    )
    assert "l: in_time` does not hold" not in text


def test_where_no_plant_is_given_an_episode_that_breaks_an_assumption_is_excused(
    system: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (system / "door.rcs").write_text(BRIEF, encoding="utf-8")
    path = system / "system.toml"
    path.write_text(path.read_text(encoding="utf-8").partition("[plant]")[0], encoding="utf-8")
    command = campaign(system, episodes=30)
    status = rcsc([*command, "--save", str(tmp_path / "found")])
    text = said(capsys)
    assert (status, "does not hold:" in text) == (0, False), text
    free = BRIEF.replace(BRIEF.splitlines()[3], "")
    (system / "door.rcs").write_text(free, encoding="utf-8")
    assert "assume" not in free
    assert rcsc([*command, "--save", str(tmp_path / "found")]) == 1
    assert "`l: in_time` does not hold" in said(capsys)


def test_what_a_log_lacks_is_not_looked_at_and_programs_are_read_from_their_source(
    system: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert rcsc(["run", str(system), "--cycles", "20", "--executor", "python", "-q"]) == 1
    said(capsys)
    log = read(system / ".rcsc-cache" / "door.mcap")
    path = system / "system.toml"
    described = description(path)
    assert isinstance(program_of(path, described, described.levels[0]), Program)
    every = requirements(path, description(path), monitored=False)
    assert [one.name for one in every["l"]] == ["in_time", "some_time", "rare"]
    assert [(one.name, one.tick) for one in broken_in(log, every)] == [("in_time", 7)]
    newer = DOOR.replace(
        "requirement rare", "state more : bool\nrequirement more_ : always more\nrequirement rare"
    )
    (system / "door.rcs").write_text(newer, encoding="utf-8")
    assert [
        (one.name, one.tick) for one in broken_in(log, requirements(path, description(path), monitored=False))
    ] == [("in_time", 7)]
