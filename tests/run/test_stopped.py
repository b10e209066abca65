"""A script that stops is gone on with by another process, with any plant: all stands as it stood, or it is said why not."""

import enum
import hashlib
import json
import random
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest

from rcsc.base.diagnostics.codes import Code
from rcsc.front.commands import run
from rcsc.run.description import description
from rcsc.run.levels import StateTableError
from rcsc.run.orders.operator import ScriptedRun
from rcsc.run.orders.stopped import NotKept, NotResumed, StoppedRuns, stopped_path
from rcsc.run.plant.held import held_of, put_back
from rcsc.run.plant.staging import StageOrder, staged, standing
from rcsc.run.system import assemble, signatures

SCRIPT = "command,base.beacon,within\nstop,,\ndock,,20\ndock,,\nstop,,\n"
QUICK = ["--no-compile", "--executor", "python", "--script", "mine"]


@pytest.fixture
def here(dock: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The docking robot with a script whose second row fails, seen from beside it."""
    (dock / "mine.csv").write_text(SCRIPT, encoding="utf-8")
    monkeypatch.chdir(dock.parent)
    return dock


def begun(folder: Path, plant: str) -> tuple[ScriptedRun, StoppedRuns]:
    """A run that has not begun, and what keeps it."""
    system = description(folder / "system.toml")
    signs = signatures(system)
    stage = staged(StageOrder(str(folder / "system.toml"), plant, "mine"), system, signs)
    assert stage.resume is not None
    running = assemble(system, "python", stage.queries, standing(stage, system, signs))
    return ScriptedRun(running, stage.operator), stage.resume


def seen(run: ScriptedRun) -> list[object]:
    """All that levels and buffers hold."""
    system = run.system
    levels = [repr(level.values[: len(level.sign.leaves)]) for level in system.levels]
    return [*levels, *(system.buffers.latest(wire.source) for wire in system.description.wires)]


@pytest.mark.parametrize("plant", ["", "mujoco"])
def test_a_run_that_is_gone_on_with_does_what_the_stopped_one_would(plant: str, here: Path) -> None:
    stopped, keeps = begun(here, plant)
    assert [result.state for result in stopped.steps()] == ["done", "failed"]
    keeps.keep(stopped, "mine")
    other, goes_on = begun(here, plant)
    goes_on.go_on(other)
    assert (other.system.tick, seen(other)) == (stopped.system.tick, seen(stopped))
    for going in (stopped, other):
        assert going.operator is not None
        going.operator.restore({"at": 2})  # type: ignore[attr-defined]  # the row counts as done by hand
    ends = []
    for _ in range(200):
        stopped.system.step()
        other.system.step()
        assert seen(other) == seen(stopped), stopped.system.tick
        assert other.operator is not None
        ends = [result.state for result in other.operator.results]
    assert ends[:1] == ["done"]


@pytest.mark.parametrize("plant", [[], ["--plant", "mujoco"]], ids=["python", "model"])
def test_the_command_goes_on_and_another_row_may_be_named(
    plant: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = []
    for more, status in ([], 1), (["--resume"], 1), (["--resume", "--from-row", "3"], 0), (["--resume"], 1):
        assert run(["run", "dock", *QUICK, *plant, *more]) == status
        shown = capsys.readouterr()
        rows.append(re.findall(r"^ +(\d+)  \w+ .* (done|failed) ", shown.out, re.MULTILINE))
        if "within" in shown.err or "did not end in 20" in shown.err:
            assert "then: rcsc run dock --script mine" in shown.err
            assert shown.err.rstrip().endswith("--resume")
    assert rows == [[("1", "done"), ("2", "failed")], [("2", "failed")], [("3", "done"), ("4", "done")], []]
    assert "there is nothing to resume" in shown.err
    assert here.is_dir()


def _other_script(folder: Path) -> None:
    (folder / "mine.csv").write_text(SCRIPT.replace("dock,,20", "dock,,30"), encoding="utf-8")


def _other_tables(folder: Path) -> None:
    with (folder / "generated/python/drive.py").open("a", encoding="utf-8") as file:
        file.write("# another line\n")


def _damaged(folder: Path) -> None:
    path = stopped_path(description(folder / "system.toml"))
    said = json.loads(path.read_text(encoding="utf-8"))
    said["stopped"]["operator"]["at"] = 3
    path.write_text(json.dumps(said), encoding="utf-8")


def _cut_short(folder: Path) -> None:
    path = stopped_path(description(folder / "system.toml"))
    path.write_bytes(path.read_bytes()[:-40])


def _other_plant(folder: Path) -> None:
    base = (folder / "base.py").read_text(encoding="utf-8")
    (folder / "base.py").write_text(
        base.replace("    bumper: bool", "    battery: float = 1.0\n    bumper: bool").replace(
            "        if not self", "        self.battery -= 0.001\n        if not self", 1
        ),
        encoding="utf-8",
    )


@pytest.mark.parametrize(
    ("change", "code", "message"),
    [
        (_other_script, Code.NOT_RESUMED, "it has changed since"),
        (_other_tables, Code.BAD_SYSTEM, "the tables have changed"),
        (_damaged, Code.NOT_RESUMED, "is damaged"),
        (_cut_short, Code.NOT_RESUMED, "is damaged"),
    ],
)
def test_what_is_not_gone_on_with_is_said_with_its_code_and_nothing_moves(
    change: Callable[[Path], None], code: Code, message: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stopped, keeps = begun(here, "")
    list(stopped.steps())
    keeps.keep(stopped, "mine")
    change(here)
    assert run(["run", "dock", *QUICK, "--resume"]) == 1
    shown = capsys.readouterr()
    assert f"error[{code.value}]: " in shown.err
    assert message in shown.err
    assert shown.out == ""


def test_a_plant_that_was_mended_meanwhile_goes_on_where_its_state_still_fits(here: Path) -> None:
    stopped, keeps = begun(here, "")
    list(stopped.steps())
    keeps.keep(stopped, "mine")
    _other_plant(here)
    other, goes_on = begun(here, "")
    goes_on.go_on(other)  # what is new in the class stands as at first
    assert other.system.tick == stopped.system.tick


def test_a_plant_that_holds_what_no_file_does_says_so(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = (here / "base.py").read_text(encoding="utf-8")
    base = "import random\n" + base.replace(
        "    def step",
        "    def __init__(self) -> None:\n        self.noise = random.Random(1)\n\n    def step",
        1,
    )
    (here / "base.py").write_text(base, encoding="utf-8")
    assert run(["run", "dock", *QUICK]) == 1
    error = capsys.readouterr().err
    assert "`Base.noise` is of type `Random`" in error
    assert "`state(self)` and `restore(self, state)`" in error
    assert "rcsc run dock --script mine --executor python --from-row 2" in error
    itself = (
        "    def state(self):\n        return {'at': self.travelled}\n\n"
        "    def restore(self, state):\n        self.travelled = float(state['at'])\n\n    def step"
    )
    (here / "base.py").write_text(base.replace("    def step", itself, 1), encoding="utf-8")
    assert run(["run", "dock", *QUICK]) == 1
    assert capsys.readouterr().err.rstrip().endswith("--resume")
    assert run(["run", "dock", *QUICK, "--resume", "--from-row", "3"]) == 0


# --- what a plant holds ---


class Colour(enum.Enum):
    RED = 1
    BLUE = 2


class Pair(NamedTuple):
    x: float
    y: float


@dataclass(slots=True)
class Wheel:
    turns: float = 0.0
    hot: bool = False


@dataclass
class Everything:
    """All that a plant may hold."""

    number: int = 0
    way: float = 0.0
    word: str = "a"
    colour: Colour = Colour.RED
    pair: Pair = field(default_factory=lambda: Pair(0.0, 0.0))
    wheels: list[Wheel] = field(default_factory=lambda: [Wheel(), Wheel()])
    track: tuple[float, ...] = ()
    counts: dict[str, int] = field(default_factory=dict)
    last: float | None = None
    broken: bool = False


def drawn(rnd: Random) -> Everything:
    """A plant that has been moving."""
    edges = [0.0, -0.0, 1e-300, 1e300, 0.1, -7.5]
    return Everything(
        number=rnd.choice([0, -1, 2**63]),
        way=rnd.choice(edges),
        word=rnd.choice(["", "ä", "\n"]),
        colour=rnd.choice(list(Colour)),
        pair=Pair(rnd.choice(edges), rnd.choice(edges)),
        wheels=[Wheel(rnd.choice(edges), rnd.random() < 0.5) for _ in range(2)],
        track=tuple(rnd.choice(edges) for _ in range(rnd.randrange(4))),
        counts={word: rnd.randrange(9) for word in "abc"[: rnd.randrange(4)]},
        last=rnd.choice([None, *edges]),
        broken=True,
    )


def test_what_a_plant_holds_is_put_back_exactly_but_for_its_faults() -> None:
    rnd = Random(3)  # noqa: S311  # drawn by seed
    for _ in range(50):
        plant, other = drawn(rnd), Everything()
        put_back(other, json.loads(json.dumps(held_of(plant, {"broken"}))), {"broken"})
        assert repr(other) == repr(plant).replace("broken=True", "broken=False")
        assert type(other.pair) is Pair


@pytest.mark.parametrize(
    "value",
    [
        float("nan"),
        float("inf"),
        {1: 2},
        {1},
        b"x",
        lambda: 0,
        random.SystemRandom(),
        np.zeros(2),
    ],
)
def test_what_json_does_not_hold_is_not_kept(value: Any) -> None:
    plant = Everything()
    plant.last = value
    with pytest.raises(NotKept, match=r"Everything\.last"):
        held_of(plant)


ODD = [None, True, 3, -1, 2**200, 0.5, float("nan"), "", "x", [], {}, [1], {"a": 1}]


def _odd(said: Any, rnd: Random) -> None:
    """Puts something odd somewhere, beside something, or nowhere in its place."""
    key: Any = rnd.choice(["tick", "operator", "levels", "buffers", "outside", "outside"])
    holder, place = said, said[key]
    while isinstance(place, dict | list) and place and rnd.random() < 0.9:
        holder, key = place, rnd.choice(list(place) if isinstance(place, dict) else range(len(place)))
        place = place[key]
    how = rnd.random()
    if how < 0.1:
        del holder[key]
    elif how < 0.2 and isinstance(holder, list):
        holder.append(rnd.choice(ODD))
    else:
        holder[key] = rnd.choice(ODD)


@pytest.mark.parametrize("plant", ["", "mujoco"])
def test_a_stopped_run_that_was_changed_anywhere_is_taken_or_refused(plant: str, here: Path) -> None:
    stopped, keeps = begun(here, plant)
    list(stopped.steps())
    path = keeps.keep(stopped, "mine")
    assert path == stopped_path(stopped.system.description)
    good = path.read_bytes()
    rnd, refused = Random(len(plant)), 0  # noqa: S311  # drawn by seed
    other, goes_on = begun(here, plant)
    for _ in range(60):
        said = json.loads(good)["stopped"]
        _odd(said, rnd)
        digest = hashlib.sha256(json.dumps(said, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
        path.write_text(json.dumps({"digest": digest, "stopped": said}), encoding="utf-8")
        try:
            goes_on.go_on(other)
            other.system.step()
        except (NotResumed, StateTableError):
            refused += 1
    assert refused > 20
