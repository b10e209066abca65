"""What shows a cycle of several tables tells each in the table's words: log, replay, shell, the API, graph, diff, tests and vectors."""

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

import rcsc
from rcsc.base.host.tools import c_compiler
from rcsc.front.commands import run
from tests.stages.test_cycle import CHOICE, REACTOR
from tests.support.programs.systems import solo_system
from tests.support.programs.texts import edited

pytestmark = pytest.mark.skipif(not isinstance(c_compiler(), str), reason="no C compiler")
Say = Callable[[str], tuple[int, str]]


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Say:
    """Runs a command of `rcsc` beside a system of the reactor alone: its status, and what it prints with blanks as one."""
    solo_system(tmp_path, edited(REACTOR, ("level reactor", "level solo")))
    monkeypatch.chdir(tmp_path)

    def said(command: str) -> tuple[int, str]:
        capfd.readouterr()
        status = run(shlex.split(command)[1:])
        return status, " ".join("\n".join(capfd.readouterr()).split())

    return said


def test_a_log_counts_the_lines_of_each_table_and_replays(say: Say) -> None:
    assert say("rcsc run --cycles 4 --log run.mcap system.toml")[0] == 0
    assert say("rcsc log --csv run.csv run.mcap")[0] == 0
    told = say("rcsc log run.mcap")[1]
    assert "table press: 1 of 5 lines ran ran stays: 4" in told
    assert "table override: 1 of 4 lines ran ran stays: 4" in told
    assert "table inject: 1 of 3 lines ran ran on: 4" in told
    assert say("rcsc replay run.mcap")[1].startswith("4 ticks replayed: nothing differs")
    heading = Path("run.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert {"solo.line", "solo.line_of_press", "solo.line_of_override"} <= set(heading)


def test_another_order_of_the_clauses_replays_alike(say: Say) -> None:
    say("rcsc run --cycles 4 --log run.mcap system.toml")
    text = Path("solo.rcs").read_text(encoding="utf-8")
    Path("solo.rcs").write_text(
        edited(text, ("  table inject\n  table press\n", "  table press\n  table inject\n")), encoding="utf-8"
    )
    assert say("rcsc compile solo.rcs --out g")[0] == 0
    assert say("rcsc replay run.mcap --generated g")[1].startswith("4 ticks replayed: nothing differs")


def test_the_shell_tells_and_stops_at_each_table(
    say: Say, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "lines").write_text(
        "water = 20\nstep 1\nbreak press.under\nstep 1\nwater = 0\nrun 5\nlines\nSTATE-TABLE\nexpect line_of_press = down\n",
        encoding="utf-8",
    )
    with (tmp_path / "lines").open(encoding="utf-8") as typed:
        monkeypatch.setattr("sys.stdin", typed)
        assert say("rcsc compile system.toml")[0] == 0
        status, told = say("rcsc shell system.toml")
    assert status == 0, told
    assert "cycle 1: solo.press.up solo.override.stays solo.inject.off" in told
    assert "cycle 2: solo.press.top solo.override.clear solo.inject.off" in told
    assert "cycle 3: breakpoint 1, line solo.press.under" in told
    assert "table `press`, line down: too_low; table `override`, line" in told


def test_the_api_tells_the_line_of_each_table(say: Say, tmp_path: Path) -> None:
    assert say("rcsc compile system.toml")[0] == 0
    system = rcsc.load_system(tmp_path / "system.toml")
    system.step()
    assert system.lines == {"solo": "press.stays override.stays inject.on"}
    assert system.value("solo.line_of_press") == "stays"


def test_a_table_without_its_line_is_named_where_a_run_ends(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text = edited(
        CHOICE, ("level l", "level solo"), ("input hand : int 0 .. 9", "input hand : int 0 .. 9 = 7")
    )
    text = re.sub(r"extern procedure.*\n", "procedure measured { speed := 5 }\n", text)
    system = solo_system(tmp_path, text)
    status = run(["run", "--cycles", "3", str(system)])
    told = " ".join("\n".join(capfd.readouterr()).split())
    assert status == 1, told
    assert "table `by_hand`" in told
    assert "no line matches" in told


def test_a_graph_of_lines_follows_the_tables_before_it(say: Say) -> None:
    """The override is cleared as the pressure comes to be high: out of normal, to which it comes from too low in a cycle before."""
    status, told = say("rcsc graph solo.rcs:override --lines --form mermaid")
    assert status == 0
    assert "stays --> clear : [@T(pressure = high) = true]" in told
    assert told.count("--> clear") == 1
    assert told.count("by never after clear") == 2


def test_a_difference_is_of_tables_and_their_order_and_not_of_what_lines_are_kept_in(say: Say) -> None:
    text = Path("solo.rcs").read_text(encoding="utf-8")
    Path("old.rcs").write_text(text, encoding="utf-8")
    Path("new.rcs").write_text(
        edited(
            text,
            (
                "  | under | high     | < 10   || normal   |\n",
                "  | under | high | < 5 || normal |\n  | more | high | 5 .. 9 || normal |\n",
            ),
        ),
        encoding="utf-8",
    )
    status, told = say("rcsc diff old.rcs new.rcs")
    assert status == 0
    assert "line `under` -> line `more`: the same effect" in told
    assert "line_of" not in told
    without = edited(text, ("  table press\n", ""))
    Path("new.rcs").write_text(without, encoding="utf-8")
    told = say("rcsc diff old.rcs new.rcs")[1]
    assert "tables that run before it: `press`, `override`, now `override`" in told
    assert "line_of" not in told


def test_mutants_of_every_table_are_killed_and_each_has_its_vectors(say: Say) -> None:
    status, told = say("rcsc test --examples 20 --mutants 12 --no-cortex --vectors v.json solo.rcs")
    assert status == 0, told
    found = dict(
        re.findall(
            r"table (\w+): \d+ of \d+ lines reached.*?mutants of the table: 12: (.*?)(?= table| \Z|$)", told
        )
    )
    assert found.keys() == {"press", "override", "inject"}
    assert not any("survived" in words or "nobody" in words for words in found.values())
    vectors = json.loads(Path("v.json").read_text(encoding="utf-8"))
    assert {table["table"]: bool(table["vectors"]) for table in vectors["tables"]} == dict.fromkeys(
        found, True
    )


def test_the_c_of_the_whole_system_runs_the_tables_as_the_python_system_does(say: Say) -> None:
    status, told = say("rcsc test --examples 20 --mutants 0 --no-cortex system.toml")
    assert status == 0, told
    assert "interpreter = Python = C" in told


def test_a_certificate_is_of_the_tables_in_their_cycle(say: Say) -> None:
    status, told = say("rcsc certify --certify solo.rcs")
    assert status == 0, told
    assert "certified: checked all" in told
    status, told = say("rcsc prove --certify system.toml")
    assert status == 0, told
    assert "cvc5 says the same" in told
