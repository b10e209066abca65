"""Campaigns of a system that rcsc knows nothing of but its files: the docking robot, with plants that break, die, hang and raise."""

import json
import time
from dataclasses import replace
from pathlib import Path

import pytest

from rcsc.front import commands
from rcsc.run.campaign.choose import ANY
from rcsc.run.campaign.counterexamples import BadEpisode, again, saved_episode
from rcsc.run.campaign.rig import EpisodeKind, Rig, digest
from rcsc.run.campaign.shrink import shrink
from rcsc.run.campaign.work import NotDrawn, _OutOfTime, play, within
from rcsc.run.campaign.worker_pool import processes
from rcsc.run.episodes.episode import Episode, FieldValue, OrderSpec, Switch
from rcsc.run.plant.bind import BadPlant

HALL = '''
    def stays_in_the_hall(self) -> Property:
        """There is a wall at half a metre."""
        return self.travelled < 0.5
'''
WILD = """
import os
import signal
import time
from rcsc.run.plant import Fault


class Base:
    speed: int = 0
    travelled: float = 0.0
    lateral: float = 0.0
    bumper: bool = False
    beacon: bool = True
    contact: bool = False
    dies: Fault = False
    hangs: Fault = False
    is_stuck: Fault = False
    fails: Fault = False

    def step(self, seconds: float) -> None:
        if self.dies:
            os._exit(7)
        while self.hangs:
            time.sleep(0.01)
        if self.is_stuck:
            import ctypes

            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
            ctypes.PyDLL(None).sleep(3600)  # with the interpreter's lock: nothing in the process can end it
        if self.fails:
            raise ArithmeticError("no such place")
"""


def rcsc(*args: object) -> int:
    return commands.run([str(arg) for arg in args])


@pytest.fixture
def hall(dock: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a dock whose plant has a property that docking breaks; commands run beside it."""
    base = dock / "base.py"
    text = base.read_text(encoding="utf-8").replace("import Fault, Range", "import Fault, Property, Range")
    base.write_text(text + HALL, encoding="utf-8")
    monkeypatch.chdir(dock.parent)
    return dock


def test_a_campaign_finds_shrinks_saves_and_shows_again_what_a_plant_says_must_not_be(
    hall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    played = ("campaign", "dock", "--no-compile", "--workers", 1, "--episodes", 8, "--json", "s.json")
    assert rcsc(*played) == 1
    said = capsys.readouterr()
    assert "8 episodes, " in said.out
    place, *others = sorted(Path("campaign").iterdir(), key=lambda at: f" {at}/log.mcap" not in said.err)
    assert sorted(path.name for path in place.iterdir()) == [
        "episode.json", "finding.json", "log.mcap", "script.csv",
    ]  # fmt: skip
    assert others
    assert {(at / "episode.json").read_bytes() for at in (place, *others)} == {
        (place / "episode.json").read_bytes()
    }
    seen = f"rcsc campaign dock --again {place}"
    *_, replays, plays = said.err.splitlines()[: -len(others)]
    assert (replays, plays) == (f"  = help: rcsc replay --system dock {place}/log.mcap", f"  = help: {seen}")
    assert set(said.err.splitlines()[-len(others) :]) == {
        f"episode {other.name.split('-')[1]} comes to the same: {seen}" for other in others
    }
    facts = json.loads((place / "finding.json").read_text())
    assert facts["property"] == "plant: stays_in_the_hall"
    assert "base.travelled = 0.512" in facts["said"]
    [happens] = facts["happens"]
    assert happens.startswith("`supervisor` is ordered `dock`")
    assert f"\n  = note: {happens}\n" in said.err
    assert saved_episode(place, Rig(ANY, hall / "system.toml")) == Episode(
        orders=(OrderSpec("supervisor", "dock"),)
    )
    shown = (
        f"error[RCS743]: {place}, cycle {facts['tick']}: `{facts['property']}` does not hold: {facts['said']}"
    )
    assert rcsc("campaign", "dock", "--no-compile", "--again", place) == 1
    assert shown in capsys.readouterr().err
    assert rcsc("replay", "--system", "dock", place / "log.mcap") == 0
    assert "nothing differs" in capsys.readouterr().out
    assert rcsc("run", "dock", "--no-compile", "--quiet", "--script", place / "script.csv") == 0
    assert rcsc(*played) == 1
    said = capsys.readouterr()
    assert "; 0 played now in " in said.out
    notes = said.err.splitlines()  # of each command that was told to compile nothing
    assert all(line.startswith("note: the executors in ") for line in notes)
    assert f"saved before: {place}: {seen}\n" in said.out
    summed = json.loads(Path("s.json").read_text())
    assert (summed["played_now"], summed["episodes"]) == (0, 8)
    assert len(others) < summed["episodes_with_findings"] < 8
    assert {line["level"] for line in summed["lines"]} == {"supervisor", "drive"}


def test_a_plant_that_dies_hangs_or_raises_is_a_finding_and_not_the_end(dock: Path, tmp_path: Path) -> None:
    (dock / "wild.py").write_text(WILD, encoding="utf-8")
    plant = str(dock / "wild.py")
    rig = Rig(ANY, dock / "system.toml", plant)
    told = {}
    with processes(1) as pool:
        for fault, limit_s in (("fails", 120.0), ("dies", 120.0), ("hangs", 1.0), ("is_stuck", 1.0)):
            episode = Episode(
                plant=plant,
                orders=(OrderSpec("supervisor", "dock"),),
                switches=(Switch(fault, 60, 90),),
            )
            (tmp_path / "episode.json").write_text(episode.to_json(), encoding="utf-8")
            [finding] = again(tmp_path, replace(rig, limit_s=limit_s), pool=pool).findings
            told[fault] = (finding.property, finding.tick, finding.message)
    lost = "the process that ran it died, at most a second after cycle 50"
    assert told.pop("dies") == ("the process survives", 50, lost)
    for fault, latest in (
        ("hangs", 61),
        ("is_stuck", 50),
    ):  # the last cycle of the log; how far it came, the clock says
        name, tick, message = told.pop(fault)
        assert (name, message) == ("the run ends in time", "no end within 1 s")
        assert tick <= latest
    [(name, tick, message)] = told.values()
    assert name == "the plant raises nothing"
    assert tick in {60, 61}
    assert "ArithmeticError: no such place" in message


def test_a_campaign_ends_where_the_plant_is_not_in_order(
    dock: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """That is no episode's doing: it is told once, with its place, and no journal holds a thousand findings."""
    monkeypatch.chdir(dock)
    (dock / "base.py").write_text("class Base:\n    pass\n", encoding="utf-8")
    assert rcsc("campaign", "--no-compile", "--workers", 1, "--episodes", 2) == 1
    assert "error[RCS729]: `base.py` has no class with `step(self, seconds)`" in capsys.readouterr().err
    rig = Rig(ANY, dock / "system.toml", limit_s=3.0)
    with pytest.raises(BadPlant):
        play(rig, digest(rig), 0, [0])
    (dock / "base.py").write_text(WILD + "\n    def __init__(self) -> None:\n        time.sleep(900)\n")
    with pytest.raises(NotDrawn, match=r"no episode could be drawn within 3 s"):
        play(rig, digest(rig), 0, [0])


def test_the_digest_covers_tables_scripts_and_the_files_of_the_plant_that_is_meant(dock: Path) -> None:
    system = dock / "system.toml"

    def taken(plant: str = "", script: str = "") -> str:
        digest.cache_clear()
        return digest(Rig(ANY, system, plant, script=script))

    def changed(name: str, plant: str = "", script: str = "") -> bool:
        before, path = taken(plant, script), dock / name
        path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
        return taken(plant, script) != before

    (dock / "wheels.py").write_text("", encoding="utf-8")  # which the plant may import
    (dock / "pin.stl").write_text("", encoding="utf-8")  # of which the model may be made
    for name in ("system.toml", "words.rcs", "drive.rcs", "dock.csv", "base.py", "wheels.py"):
        assert changed(name), name
    assert changed("generated/c/drive.c")
    assert not any(changed(name) for name in ("in.csv", "robot.xml", "pin.stl"))
    assert changed("robot.xml", "mujoco")
    assert changed("pin.stl", "mujoco")
    assert not changed("base.py", "mujoco")
    assert changed("in.csv", script="in")
    assert taken("mujoco") != taken()


def test_an_episode_of_another_system_is_refused(dock: Path, tmp_path: Path) -> None:
    rig = Rig(ANY, dock / "system.toml")
    for text, why in (
        ('{"restarts": [{"tick": 3, "level": "task"}]}', "no level `task`"),
        ('{"switches": [{"fault": "slips", "first_tick": 1, "last_tick": 2}]}', "no fault `slips`"),
        ('{"plant": "evil.py"}', "the description has no plant `evil.py`; `--plant` names one"),
        ('{"backend": "kinematic"}', "an episode has no `backend`"),
        ("{", ""),
    ):
        (tmp_path / "episode.json").write_text(text, encoding="utf-8")
        with pytest.raises(BadEpisode, match=f"episode.json: .*{why}"):
            saved_episode(tmp_path, rig)


def test_an_episode_imports_no_file_that_it_names(dock: Path, tmp_path: Path) -> None:
    """It may come from anybody; what is imported, the user names."""
    evil, mine = str(tmp_path / "evil.py"), str(tmp_path / "mine.py")
    Path(evil).write_text("raise SystemExit\n", encoding="utf-8")
    Path(mine).write_text((dock / "base.py").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "episode.json").write_text(Episode(plant=evil).to_json(), encoding="utf-8")
    for plant in ("", "mujoco"):
        with pytest.raises(BadEpisode, match=r"has no plant .*; `--plant` names one"):
            saved_episode(tmp_path, Rig(ANY, dock / "system.toml", plant))
    assert saved_episode(tmp_path, Rig(ANY, dock / "system.toml", mine)).plant == mine


KIND = """
import dataclasses
from rcsc.run.campaign.choose import ANY

NONE = 3


def calm(random, rig):
    return dataclasses.replace(ANY.draw(random, rig), switches=(), harms=(), readings=())


CALM = dataclasses.replace(ANY, draw=calm, takes_script=False)
"""


def test_a_plant_may_name_a_kind_of_episodes_of_its_own(
    dock: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As that of the paper's cell does."""
    (dock / "calm_episodes.py").write_text(KIND, encoding="utf-8")
    monkeypatch.syspath_prepend(str(dock))
    monkeypatch.chdir(dock)
    system = dock / "system.toml"
    text = system.read_text(encoding="utf-8")

    def names(kind: str) -> int:
        system.write_text(text.replace('python = "base.py"', f'python = "base.py"\ncampaign = "{kind}"'))
        return rcsc("campaign", "--no-compile", "--workers", 1, "--episodes", 1, "--script", "in")

    assert names("calm_episodes:CALM") == 2
    assert "take none" in capsys.readouterr().err
    for kind, why in (
        ("calm_episodes:NONE", "`calm_episodes:NONE` is no `rcsc.run.campaign.rig.EpisodeKind`"),
        ("calm_episodes:CLAM", "`calm_episodes:CLAM` cannot be imported"),
        ("no_episodes:CALM", "`no_episodes:CALM` cannot be imported"),
    ):
        assert names(kind) == 1
        said = capsys.readouterr().err
        assert why in said
        assert "campaign = " in said  # the line that names it
    assert isinstance(ANY, EpisodeKind)


def test_what_is_within_an_order_shrinks_too() -> None:
    """Fields of an order go one by one, and their numbers come to nought by halves."""
    fields = (FieldValue("target_mm", 900), FieldValue("way", "left"), FieldValue("speed", 40))
    orders = (OrderSpec("drive", "goto", fields, wait=30), OrderSpec("drive", "stop"))

    def fails(episode: Episode) -> bool:
        held = [field for order in episode.orders for field in order.fields]
        return any(field.name == "target_mm" and int(field.value) > 100 for field in held)

    [order] = shrink(Episode(orders=orders), fails).orders
    [field] = order.fields
    assert (order.command, order.wait, field.name) == ("goto", 0, "target_mm")
    assert 100 < int(field.value) <= 225


def test_the_end_of_the_limit_comes_again_for_who_swallowed_it() -> None:
    """As a finalizer does, in which the alarm may ring."""
    swallowed: list[BaseException] = []

    def sleep_on() -> None:
        try:
            time.sleep(900)
        except _OutOfTime as rung:
            swallowed.append(rung)
        time.sleep(900)

    with pytest.raises(_OutOfTime), within(0.05):
        sleep_on()
    assert len(swallowed) == 1
