"""`rcsc log --report` of an ordinary run: its orders, against the script that gave them, values with gaps, lines, the cell."""

import re
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.log.export import coverage
from rcsc.run.log.read import read
from rcsc.run.log.recorder import Recorder
from rcsc.run.orders.operator import RowResult, ScriptedRun, ScriptRow
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.system import assemble, signatures
from rcsc.views.pages.log_page import MOST_PICTURES, story_of
from rcsc.views.pages.report import Story, page
from tests.run.test_log import record
from tests.support.cells import SYSTEM
from tests.support.films import film_of, unset_in


def recorded(folder: Path, text: str, log: Path, most: int = 2000) -> list[RowResult[ScriptRow]]:
    """What became of each row of a script that the docking robot ran by, recorded."""
    (folder / "mine.csv").write_text(text, encoding="utf-8")
    system = description(folder / "system.toml")
    signs = signatures(system)
    stage = staged(StageOrder(str(folder / "system.toml"), script="mine"), system, signs)
    running = ScriptedRun(
        assemble(system, "python", stage.queries, standing(stage, system, signs)), stage.operator
    )
    with Recorder(running.system, log) as recorder:
        running.system.watch.append(recorder)
        return list(running.steps(most))


def shown(log: Path) -> tuple[Story, str]:
    story = story_of(read(log))
    return story, page(story)


SCRIPTS = {
    "all done": ("command\ndock\nundock\nstop\n", 2000),
    "failed as expected": ("command,base.beacon,expect\ndock,false,failed\ndock,,\n", 2000),
    "stopped, then told to rest": ("command,within\nundock,\ndock,3\n", 2000),
    "changed": ("command,cycles\ndock,5\nundock,\n", 2000),
    "cut short": ("command\ndock\n", 20),
    "nothing ordered": ("command,cycles\n,5\n", 2000),
}


@pytest.mark.parametrize("name", list(SCRIPTS))
def test_the_orders_are_those_of_the_script(name: str, dock: Path, tmp_path: Path) -> None:
    text, most = SCRIPTS[name]
    log = tmp_path / "run.mcap"
    ends = recorded(dock, text, log, most)
    story, said = shown(log)
    commands = [line.split(",")[0] for line in text.splitlines()[1:]]
    wanted = [command for command in commands if command]
    rested = [row.text.partition(": ")[2].partition(":")[0] for row in story.rows]
    assert rested[: len(wanted)] == wanted
    assert len(rested) - len(wanted) == (name.startswith("stopped"))
    states = [row.state for row in story.rows]
    if name == "all done":
        assert states == ["done"] * 3
        assert [row.cycles - end.ticks for row, end in zip(story.rows, ends, strict=True)] == [-2] * 3, (
            "it takes and is seen"
        )
        assert "every order done" in said
        assert f"3 orders, {story.ticks} cycles" in said
    if name == "failed as expected":
        assert states == ["failed", "done"]
        assert "reason = no_beacon" in story.rows[0].reason
        assert "1 failed, 1 done" in said
    if name == "changed":
        assert states == ["changed", "done"]
        assert story.rows[0].cycles == 5
    if name == "cut short":
        assert states == ["under way"]
    if name == "nothing ordered":
        assert "<h2>Orders</h2>" not in said
    assert sum(line.count for line in story.matched) == sum(
        sum(table.lines.values()) for table in coverage(read(log))
    )
    assert said == shown(log)[1], "the same page for the same log"


@pytest.fixture(scope="module")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    record(path, "python", 400)
    return path


def test_the_cell_is_drawn_from_time_to_time_and_what_it_rests_on_is_said(
    shipped: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run.html"
    assert run(["log", str(shipped), "--report", str(out), "--system", str(SYSTEM)]) == 0
    assert "no cell" not in capsys.readouterr().out
    said = out.read_text(encoding="utf-8")
    assert 3 <= said.count("<figure") <= MOST_PICTURES + 1
    assert "The log holds what levels said, not where things are" in said
    film = film_of(said)
    assert "primitive.travelled_mm" in film["shown"], "a display of the description"
    assert len(film["pictures"]) == said.count("data-tick-of=") >= 3
    assert "default-src 'none'; script-src 'sha256-" in said.replace("&#39;", "'")
    outside = re.sub(r"<script>.*</script>", "", said, flags=re.DOTALL)
    assert "://" not in outside.replace("http://www.w3.org/2000/svg", "")


def test_without_the_system_buffers_from_outside_are_drawn_and_why_is_said(
    shipped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["log", str(shipped), "--report", "run.html"]) == 0
    assert "no cell is drawn" in capsys.readouterr().out
    said = Path("run.html").read_text(encoding="utf-8")
    assert "No cell is drawn: " in said
    film = film_of(said)
    assert film["pictures"] == []
    assert any("from_robot.plate" in name or "workstation" in name for name in film["shown"])
    assert any(unset_in(film, name, 1) for name in film["shown"])


def test_a_log_that_was_cut_off_is_drawn_as_far_as_it_goes_and_says_so(shipped: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(shipped.read_bytes()[: shipped.stat().st_size // 3])
    story, said = shown(cut)
    assert 0 < story.ticks < 400
    assert story.recorded == read(cut).checked.text
    assert story.recorded in said
    assert "sealed" not in said


def test_a_log_without_a_cycle_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "none.mcap", "python", 0)
    assert run(["log", str(tmp_path / "none.mcap"), "--report", str(tmp_path / "page.html")]) == 1
    assert "error[RCS706]" in capsys.readouterr().out
    assert not (tmp_path / "page.html").exists()
