"""What pages see beside the tables: the cell in space and as a drawing, and curves of variables, at any tick."""

import asyncio
from array import array
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.desk.shell.opening import Opening, opened
from rcsc.desk.studio.runs import history
from rcsc.desk.studio.scene import Poses
from rcsc.front.commands import run as rcsc
from rcsc.front.commands.shared.cells import Drawn
from rcsc.run.description import description
from rcsc.run.log.export import valued
from rcsc.run.log.queries import named_columns
from rcsc.run.log.read import read
from rcsc.run.plant.space import FIXED, space_of
from rcsc_cell.cell.arm import skeleton
from rcsc_cell.cell.kinematic import Kinematic
from rcsc_cell.cell.ready import plant
from tests.studio.driven import dock
from tests.studio.served import Page, Refused, page, serving
from tests.support.cells import database

REPO = Path(__file__).parents[2]
DATABASE = database()
SHIPPED = REPO / "tables" / "system.toml"


@pytest.fixture(scope="module")
def rover(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model for MuJoCo that `rcsc new` makes, compiled."""
    folder = tmp_path_factory.mktemp("seen") / "rover"
    assert rcsc(["new", str(folder), "--template", "mujoco"]) == 0
    assert rcsc(["compile", str(folder)]) == 0
    return folder / "system.toml"


def talk(opening: Opening, work: Callable[[Page], Awaitable[None]], **given: Any) -> None:
    """Have a page talk with a studio whose system is open."""

    async def inside() -> None:
        async with page(server) as one:
            await one.heard("run.state", open=True)
            await work(one)

    with serving(opening, **given) as server:
        asyncio.run(inside())


# --- in space ---


def test_poses_of_a_model_are_those_that_it_had_whatever_is_undone(rover: Path) -> None:
    session = opened(Opening(rover)).session
    had = []
    for _ in range(12):
        space = space_of(session.system.outside)
        assert space is not None
        had.append(array("f", space.poses()).tolist())
        session.cycle()
    assert had[0] != had[-1], "nothing moves: the test shows nothing"

    async def work(one: Page) -> None:
        await one.ask("run.type", line="step 8")
        before = [(await one.ask("cell.poses", tick=tick))["poses"] for tick in range(9)]
        await one.ask("run.type", line="undo 5")
        await one.ask("run.type", line="step 8")
        for tick in range(12):
            poses = (await one.ask("cell.poses", tick=tick))["poses"]
            assert poses == pytest.approx(had[tick], abs=1e-5)
            assert tick > 8 or poses == before[tick]
        traced = (await one.ask("cell.trace", tick=11, body=0))["points"]
        assert traced[0] == pytest.approx(had[11][:3], abs=1e-5)
        assert traced[-1] == pytest.approx(had[0][:3], abs=1e-5)

    talk(Opening(rover), work)


def test_a_model_shows_every_shape_that_is_drawn(rover: Path) -> None:
    async def work(one: Page) -> None:
        answer = await one.ask("cell.space")
        assert answer["bodies"]
        assert all(FIXED <= shape["body"] < len(answer["bodies"]) for shape in answer["shapes"])
        assert {shape["body"] for shape in answer["shapes"]} >= {FIXED, 0}, "the room and what moves in it"

    talk(Opening(rover), work)


@pytest.mark.parametrize("made", ["dock", "template"])
def test_a_plant_in_python_is_seen_where_it_says_that_it_is(made: str, tmp_path: Path) -> None:
    """Of the docking robot and of what `rcsc new --template system` makes."""
    if made == "dock":
        system, order, where = dock(tmp_path / "dock"), "order supervisor dock", "drive.travelled_mm"
    else:
        system, order, where = (
            tmp_path / "cart/system.toml",
            "order supervisor deliver far_mm=700",
            "axis.position_mm",
        )
        assert rcsc(["new", str(system.parent), "--template", "system"]) == 0
        assert rcsc(["compile", "-q", str(system.parent)]) == 0

    async def work(one: Page) -> None:
        assert one.events["cell.state"]["space"] is True
        answer = await one.ask("cell.space")
        assert {shape["body"] for shape in answer["shapes"]} == {FIXED, *range(len(answer["bodies"]))}
        await one.ask("run.type", line="step 2")  # the beacon is seen
        await one.ask("run.type", line=order)
        await one.ask("run.type", line="step 38")
        before, after = [(await one.ask("cell.poses", tick=tick))["poses"] for tick in (0, 40)]
        assert len(before) == len(after) == 7 * len(answer["bodies"])
        curve = (await every_curve(one))[where]
        assert before[0] == 0.0
        assert after[0] > 0.2
        assert 1000 * after[0] == pytest.approx(curve[-1][1], abs=20), "the level reads it a tick later"

    talk(Opening(system), work)


def test_nothing_is_shown_in_space_where_a_plant_has_none() -> None:
    async def work(one: Page) -> None:
        assert one.events["cell.state"]["space"] is False
        with pytest.raises(Refused, match="a method `space`"):
            await one.ask("cell.space")

    talk(Opening(SHIPPED, alone=True), work)


def test_kinematics_look_as_physics_do_at_first() -> None:
    physical, kinematic = (plant(DATABASE, backend).space() for backend in ("mujoco", "kinematic"))
    assert physical.bodies == kinematic.bodies
    assert physical.shapes == kinematic.shapes
    assert kinematic.poses() == pytest.approx(physical.poses(), abs=1e-5)


JOINT = st.floats(-2.5, 2.5, width=32)


@given(
    st.tuples(*[JOINT] * 6),
    st.floats(0.0, 95.0, width=32),
    st.tuples(*[st.floats(-300.0, 300.0, width=32)] * 3),
)
def test_kinematics_are_shown_where_they_say_that_everything_is(
    joints: tuple[float, ...], opening_mm: float, at_mm: tuple[float, float, float]
) -> None:
    mechanism = _mechanism()
    space = mechanism.space()
    mechanism._joints, mechanism._opening_mm = joints, opening_mm  # no order brings it to every such place
    mechanism._poses[0] = type(mechanism.parts()[0])(mechanism.parts()[0].turn, at_mm)  # likewise
    poses = dict(zip(space.bodies, np.array(space.poses()).reshape(-1, 7), strict=True))
    arm_mm = np.array(skeleton(joints))
    assert np.linalg.norm(1000 * poses["link6"][:3] - arm_mm, axis=1).min() < 0.5, (
        "the wrist is no joint of the skeleton"
    )
    apart_mm = 1000 * np.linalg.norm(poses["finger_left"][:3] - poses["finger_right"][:3])
    _, zero = _opened(mechanism, 0.0)
    assert apart_mm - zero == pytest.approx(opening_mm, abs=0.01)
    assert 1000 * poses["part0"][:3] == pytest.approx(at_mm, abs=1e-3)


_MECHANISMS: list[Kinematic] = []


def _mechanism() -> Kinematic:
    """One for all examples: to make its model takes most of the time."""
    if not _MECHANISMS:
        made = plant(DATABASE, "kinematic").mechanism
        assert isinstance(made, Kinematic)
        _MECHANISMS.append(made)
    return _MECHANISMS[0]


def _opened(mechanism: Kinematic, opening_mm: float) -> tuple[Kinematic, float]:
    mechanism._opening_mm = opening_mm  # as above
    space = mechanism.space()
    poses = dict(zip(space.bodies, np.array(space.poses()).reshape(-1, 7), strict=True))
    return mechanism, 1000 * float(np.linalg.norm(poses["finger_left"][:3] - poses["finger_right"][:3]))


@given(
    st.lists(st.tuples(st.integers(0, 30), st.sampled_from([b"a", b"b", b"c"])), max_size=40),
    st.integers(0, 31),
)
def test_kept_poses_are_the_latest_of_what_was_not_taken_back(
    kept: list[tuple[int, bytes]], tick: int
) -> None:
    poses, known = Poses(array("q"), []), dict[int, bytes]()
    for at, held in kept:
        poses.keep(at, held)
        known = {other: seen for other, seen in known.items() if other < at} | {at: held}
    before = [at for at in known if at <= tick]
    assert poses.at(tick) == (known[max(before)] if before else None)
    assert len(poses.ticks) <= max(1, len(known))


# --- drawn ---


def test_a_tick_is_drawn_of_a_run_and_of_its_log(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    assert rcsc(
        [
            "run",
            str(SHIPPED),
            "--script",
            "make_boxt",
            "--plant",
            "kinematic",
            "--cycles",
            "40",
            "--log",
            str(log),
        ]
    ) in {0, 1}
    drawn: dict[str, Any] = {}

    async def live(one: Page) -> None:
        await one.ask("run.type", line="step 30")
        drawn["live"] = await one.ask("cell.drawing", tick=25)
        drawn["flat"] = await one.ask("cell.drawing", tick=25, projected=True)

    async def logged(one: Page) -> None:
        await one.heard("time.state", source="log")
        drawn["log"] = await one.ask("cell.drawing", tick=25)
        with pytest.raises(Refused, match="a log holds no poses"):
            await one.ask("cell.poses", tick=25)

    opening = Opening(SHIPPED, plant="kinematic", script="make_boxt")
    talk(opening, live, drawer=Drawn(SHIPPED))
    talk(opening, logged, drawer=Drawn(SHIPPED), logs=(log,))
    assert drawn["live"]["svg"] == drawn["log"]["svg"]
    assert drawn["flat"]["svg"].count('class="arm"') == 4 * drawn["live"]["svg"].count('class="arm"')


# --- curves ---


def test_curves_are_the_values_of_every_tick_with_gaps_where_nobody_set_one(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    assert rcsc(
        [
            "run",
            str(SHIPPED),
            "--script",
            "make_boxt",
            "--plant",
            "kinematic",
            "--cycles",
            "60",
            "--log",
            str(path),
        ]
    ) in {0, 1}
    log = read(path)
    known = {name: of for name, of in named_columns(log.levels).items() if of[1].at >= 0}
    rows = {tick: dict(zip(known, values, strict=True)) for tick, values in valued(log, known)}
    gaps = 0

    async def work(one: Page) -> None:
        nonlocal gaps
        await one.heard("time.state", source="log")
        told = await one.ask("plot.names")
        names = [entry["name"] for entry in told["names"]]
        assert set(names) == set(known)
        assert (
            told["displays"]
            == {name: list(graphs) for name, graphs in description(SHIPPED).displays.items()}
            != {}
        )
        for first in range(0, len(names), 16):
            answer = await one.ask("plot.curves", names=names[first : first + 16])
            for curve in answer["curves"]:
                held = dict(curve["changes"])
                now = held.get(log.first)
                for tick, row in rows.items():
                    now = held.get(tick, now)
                    wanted = row[curve["name"]]
                    if isinstance(wanted, str) and curve["members"]:
                        wanted = curve["members"].index(wanted)
                    gaps += wanted is None
                    assert now == wanted, (curve["name"], tick)

    talk(Opening(SHIPPED, plant="kinematic", script="make_boxt"), work, logs=(path,))
    assert gaps > 0, "nothing was unset: the test shows nothing"


async def every_curve(one: Page) -> dict[str, list[Any]]:
    names = [entry["name"] for entry in (await one.ask("plot.names"))["names"]]
    parts = [names[first : first + 16] for first in range(0, len(names), 16)]
    answers = [await one.ask("plot.curves", names=part) for part in parts]
    return {curve["name"]: curve["changes"] for answer in answers for curve in answer["curves"]}


@pytest.mark.parametrize(
    "typed", [("step 50",), ("step 30", "undo 25", "step 45"), ("step 50", "undo 50", "step 50")]
)
def test_a_live_run_has_the_gaps_of_its_log(typed: Sequence[str], tmp_path: Path) -> None:
    """What stands outside may publish just what a number begins with: it is set then."""
    system, path = dock(tmp_path / "dock"), tmp_path / "run.mcap"
    assert rcsc(["run", str(system), "--cycles", "50", "--log", str(path), "--quiet"]) in {0, 1}
    curves: dict[str, dict[str, list[Any]]] = {}

    async def live(one: Page) -> None:
        for line in typed:
            await one.ask("run.type", line=line)
        curves["live"] = await every_curve(one)

    async def logged(one: Page) -> None:
        await one.heard("time.state", source="log")
        curves["log"] = await every_curve(one)

    opening = Opening(system, script="dock")
    talk(opening, live)
    talk(opening, logged, logs=(path,))
    assert curves["live"] == curves["log"]
    assert curves["live"]["drive.travelled_mm"][:3] == [[0, None], [2, 0], [5, 16]]


def test_what_nobody_set_is_a_gap_whatever_is_done_to_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With other tables, after undo, and once the beginning of the run is let go."""
    monkeypatch.setattr(history, "MOST_TICKS", 40)
    system = dock(
        tmp_path / "dock",
        ("state waited", "state never : int -7 .. 7\nstate waited"),
        ("status_report := failed", "status_report := failed\n  never := -7"),
    )
    drive = system.parent / "drive.rcs"

    async def work(one: Page) -> None:
        await one.ask("run.type", line="step 5")
        drive.write_text(drive.read_text().replace("state never", "state other : int -7 .. 7\nstate never"))
        for line in ("reload drive anyway", "step 5", "undo 3", "step 60"):
            await one.ask("run.type", line=line)
            [curve] = (await one.ask("plot.curves", names=["drive.never"]))["curves"]
            assert {value for _, value in curve["changes"]} == {None}, line
        assert (await one.heard("run.state", tick=67))["first"] > 0

    talk(Opening(system, alone=True), work)


def test_a_curve_that_is_none_is_refused_by_its_name(rover: Path) -> None:
    async def work(one: Page) -> None:
        with pytest.raises(Refused, match=r"no variable `nobody\.knows`"):
            await one.ask("plot.curves", names=["nobody.knows"])
        with pytest.raises(Refused, match="more than 16"):
            await one.ask("plot.curves", names=["a.b"] * 17)

    talk(Opening(rover), work)
