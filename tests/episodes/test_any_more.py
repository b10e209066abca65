"""Episodes of systems of other kinds: feeds, extern procedures, no protocol, a model, and the paper's cell by its declarations alone."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.front.commands import run as rcsc
from rcsc.run.episodes.episode import Episode, FieldValue, OrderSpec, Reading, Switch
from rcsc.run.episodes.loop import run
from rcsc.run.episodes.properties import numbered
from rcsc.run.episodes.sampling import draw, fault_names
from rcsc.run.episodes.stand import stand
from rcsc.run.orders.roles import field_of
from tests.support.programs.texts import edit_file

LAMP = """
input number : int 0 .. 9
input limit : int 0 .. 50
input light : int 0 .. 100
output on : bool
output asked : int 0 .. 9
procedure ask { asked := number }
property dark_is_lit : light < limit implies on
assume slow monitored : light <= 90
table shine assuming slow {
  | line | light - limit || procedures | on    |
  |------|---------------||------------|-------|
  | dark | < 0           || ask        | true  |
  | day  | >= 0          || ask        | false |
}
level lamp {
  period 40 [ms]
  table shine
}
"""
ROOM = """
class Room:
    number: int = 0
    light: int = 0
    lamp: bool = False

    def limit_of(self, number: int) -> tuple[int]:
        return (number * 5,)

    def step(self, seconds: float) -> None:
        self.number = (self.number + 1) % 10
        self.light = min(100, self.light + 5) if self.lamp else max(0, self.light - 1)
"""
SYSTEM = """
name = "room"
generated = "generated"
tick_ms = 40

[[level]]
name = "lamp"
feed = [{ into = "limit", query = "limit_of", keys = ["number"] }]

[buffers]
"room.number" = "lamp.number"
"room.light" = "lamp.light"
"lamp.on" = "room.lamp"

[plant]
python = "room.py"
"""
QUICK = ["test", "--examples", "30", "--mutants", "0", "--no-cortex"]


@pytest.fixture
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A lamp without a protocol, which asks its plant how dark it may be."""
    for name, text in {"rcsc.toml": "", "lamp.rcs": LAMP, "room.py": ROOM, "system.toml": SYSTEM}.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def compiled(folder: Path) -> Path:
    assert rcsc(["compile", "-q", str(folder), "--out", str(folder / "generated")]) == 0
    return folder / "system.toml"


class TestALevelWithoutAProtocol:
    def test_is_run_for_a_while_and_keeps_its_property(self, room: Path) -> None:
        path = compiled(room)
        for seed in range(12):
            episode = draw(seed, path)
            outcome = run(episode, path)
            assert not outcome.findings
            assert outcome.ticks >= episode.ticks >= 50
            assert run(replace(episode, executor="python"), path) == replace(outcome)

    def test_refuses_no_key_of_a_feed(self, room: Path) -> None:
        fields = {field.name: bool(field.refused) for field in stand(compiled(room)).fields}
        assert fields == {"room.number": False, "room.light": True}

    def test_an_assumption_that_a_reading_breaks_is_excused_and_one_that_the_plant_breaks_is_not(
        self, room: Path
    ) -> None:
        path = compiled(room)
        forged = Episode(ticks=20, readings=(Reading("room.light", 91, 5, 6),))
        outcome = run(forged, path)
        assert not outcome.findings
        assert [(one.property, one.tick, one.because) for one in outcome.excused] == [
            ("lamp: assumption slow", 6, "`room.light` is 91")
        ]
        edit_file(room / "room.py", ("self.light + 5", "self.light + 95"))
        [finding] = run(Episode(ticks=20), path).findings
        assert finding.property == "lamp: assumption slow"
        assert finding.message == "level `lamp`, table `shine`, line `day`: `light` = 95"


class TestRcscTest:
    def test_runs_a_system_with_a_feed_in_its_plant(
        self, room: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert rcsc([*QUICK, str(room)]) == 0
        said = capsys.readouterr().out
        assert "system room: not run as a whole: its levels ask a database" in said
        assert "system room: 3 episodes in plant `room.py`, " in said
        assert "2 of 2 lines, C and Python the same" in said

    def test_runs_a_plant_alone_with_what_was_proved(
        self, room: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert rcsc(["test", "--plant", "room.py", "--examples", "2", str(room)]) == 0
        said = capsys.readouterr().out
        assert "system room: 2 episodes in plant `room.py`, " in said
        assert re.search(r"C and Python the same, \d+ proved claims watched", said)
        assert "matches" not in said
        assert rcsc(["test", "--plant", "cellar", str(room)]) == 1
        assert "the description has no plant `cellar`" in capsys.readouterr().err
        assert rcsc(["test", "--plant", "room.py", str(room / "lamp.rcs")]) == 2

    def test_shows_where_c_that_was_edited_differs_and_how_to_run_that_again(
        self, room: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert rcsc(["compile", "-q", str(room)]) == 0
        edit_file(room / "generated/c/lamp.c", ("s->on = true;", "s->on = false;"))
        capsys.readouterr()
        assert rcsc(["test", "--plant", "room.py", "--examples", "2", str(room)]) == 1
        said = "".join(capsys.readouterr())
        assert "`C and Python do the same` does not hold: level `lamp`, table `" in said
        assert "`on` is false in C and true in Python" in said
        folder = "campaign/test-c-and-python-do-the-same"
        assert f"--plant room.py --no-compile --again {folder}` runs it again" in said.replace(f"{room}/", "")
        assert rcsc(["campaign", str(room), "--no-compile", "--again", folder]) == 1

    def test_says_what_it_leaves_out(
        self, room: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        text = 'extern procedure ask reads number writes asked python "mine:asked_of" c "asked_of"'
        edit_file(room / "lamp.rcs", ("procedure ask { asked := number }", text))
        (room / "mine.py").write_text("def asked_of(number: int) -> int:\n    return number\n")
        monkeypatch.syspath_prepend(str(room))
        assert rcsc([*QUICK, str(room)]) == 0
        assert "in Python alone: extern procedures have no C here" in capsys.readouterr().out
        assert rcsc(["run", "--cycles", "3", str(room)]) == 1  # which has no such function either
        assert "the C executors call `asked_of`" in capsys.readouterr().err
        with monkeypatch.context() as without:
            without.setitem(sys.modules, "hypothesis", None)
            assert rcsc([*QUICK, str(room)]) == 0
        assert "`hypothesis` is not installed: pip install 'rcsc[hypothesis]'" in capsys.readouterr().out
        edit_file(room / "system.toml", ('[plant]\npython = "room.py"\n', ""))
        assert rcsc([*QUICK, str(room)]) == 0
        assert "no episodes: " in capsys.readouterr().out

    def test_shows_what_a_property_was_false_on(self, room: Path, capsys: pytest.CaptureFixture[str]) -> None:
        edit_file(room / "lamp.rcs", ("implies on\n", "implies on and light > 2\n"))
        assert rcsc([*QUICK, str(room)]) == 1
        said = "".join(capsys.readouterr())
        assert "cycle 2: `lamp: dark_is_lit` does not hold: " in said
        assert "is false in line `dark`: `light` = 0, `limit` = 5, `on` = true" in said
        assert rcsc(["campaign", str(room), "--again", "campaign/test-lamp-dark-is-lit"]) == 1


class TestAModel:
    def test_misbehaves_as_it_is_declared(self, dock: Path) -> None:
        path = dock / "system.toml"
        assert fault_names(path, "mujoco")[-2:] == ("wheels_stuck", "pin_dead")
        orders = (OrderSpec("supervisor", "dock"),)
        assert run(Episode("mujoco", orders=orders), path).rows[0].state == "done"
        dead = Episode("mujoco", orders=orders, switches=(Switch("pin_dead", 0, 4000),))
        outcome = run(dead, path)
        assert (outcome.rows[0].state, outcome.rows[0].reason) == ("failed", "reason no_beacon")
        assert not outcome.findings


def move(location: int, wait: int = 0, *, interrupts: bool = False) -> OrderSpec:
    return OrderSpec("task", "move", (FieldValue("dest_locpt", location),), wait, interrupts)


class TestThePapersCell:
    """Its plant is a function, it asks a database, and it has five levels; nothing here knows that."""

    def test_keeps_the_general_properties_with_its_kinematic_plant(self, repo: Path) -> None:
        path = repo / "tables" / "system.toml"
        pause = OrderSpec("task", "pause", (), 15, interrupts=True)
        orders = (move(1), move(10, 25, interrupts=True), pause, move(4), move(7))
        outcome = run(Episode("kinematic", orders=orders), path)
        assert [row.state for row in outcome.rows] == ["changed", "changed", "done", "done", "done"]
        assert len(outcome.lines) >= 20
        for seed in range(4):
            assert not run(replace(draw(seed, path, "kinematic"), orders=orders), path).findings
        in_python = run(Episode("kinematic", "python", orders=orders), path)
        assert in_python == outcome

    def test_has_streams_that_change_without_a_number(self, repo: Path) -> None:
        its = stand(repo / "tables" / "system.toml")
        link = next(link for link in its.links if link.level == "emove")
        fixed = {field_of(link.order_leaves[at]) for at in numbered(its, link)}
        every = {field_of(leaf) for leaf in link.order_leaves}
        assert every - fixed == {"inc_command", "apoint_pos_flag", "gripped_obj_ptr"}
