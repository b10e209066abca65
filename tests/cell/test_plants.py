"""The arm, its controller, and the two plants: that they are what they say, and say the same."""

import hashlib
import json
import math
import random
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import mujoco
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.base.diagnostics.coded import Refused
from rcsc.desk.shell.opening import Opening, opened
from rcsc.run.faults import switch
from rcsc.run.signature import Values
from rcsc_cell.cell.arm import LIMITS, _arms, _wrist, margins_deg, plate, skeleton, solve
from rcsc_cell.cell.faults import Faults
from rcsc_cell.cell.mujoco_model import mjcf
from rcsc_cell.cell.physical import Physical
from rcsc_cell.cell.plant import FLOOD, LINE, NO_PICTURE, PICTURE_TICKS, Grip, Plant
from rcsc_cell.cell.reach import home, unreachable
from rcsc_cell.cell.ready import Backend, lying, plant
from rcsc_cell.cell.robot import FOLLOW, HOLD, JUMP_RAD, LAG_RAD, Robot
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import build
from rcsc_cell.database.pose import Pose, Rotation, about_y, about_z, nine, pose_of, product
from rcsc_cell.episodes.witness import timed
from rcsc_cell.vision.flood import Features
from rcsc_cell.workstation.orders import DONE, EXECUTING, FAILED
from tests.support.cells import REPO, SYSTEM, database, prepare

joint = st.tuples(
    *(st.one_of(st.sampled_from([low, high, 0.0]), st.floats(low, high)) for low, high in LIMITS)
)
angle = st.one_of(st.sampled_from([-180.0, -90.0, 0.0, 45.0, 90.0, 180.0]), st.floats(-180.0, 180.0))


@pytest.fixture(scope="module")
def held() -> Database:
    return database()


def near(a: Pose, b: Pose, tolerance: float = 1e-6) -> bool:
    flat = [(x, y) for one, two in zip(a.turn, b.turn, strict=True) for x, y in zip(one, two, strict=True)]
    return all(abs(x - y) <= tolerance for x, y in [*flat, *zip(a.at_mm, b.at_mm, strict=True)])


# --- poses and the arm ---


@given(angle, angle, angle, st.tuples(*[st.floats(-2000, 2000)] * 3))
def test_nine_numbers_say_a_pose(a: float, b: float, c: float, at: tuple[float, float, float]) -> None:
    pose = Pose(product(about_z(a), product(about_y(b), about_z(c))), at)
    read = pose_of(nine(pose))
    assert read is not None
    assert near(read, pose)
    assert near(pose @ pose.inverse(), Pose(about_z(0.0), (0.0, 0.0, 0.0)))
    assert math.dist(pose.inside(pose.point((1.0, 2.0, 3.0))), (1.0, 2.0, 3.0)) < 1e-6


@pytest.mark.parametrize(
    "numbers",
    [(0.0,) * 9, (1, 2, 3, 1, 2, 3, 101, 2, 3), (0, 0, 0, 0, 0, 100, 0, 0, -50)],
    ids=["nothing", "no tool axis", "on one line"],
)
def test_three_points_that_are_no_plate(numbers: tuple[float, ...]) -> None:
    assert pose_of(numbers) is None


@given(joint)
def test_every_solution_brings_the_plate_there(joints: tuple[float, ...]) -> None:
    wanted = plate(joints)
    for solution in (joints for arm in _arms(wanted) for joints in _wrist(wanted.turn, *arm)):
        assert near(plate(solution), wanted, 1e-5)
    found = solve(wanted, joints)
    if found is not None:  # within a hair of a limit the way that is nearest may lie beyond it
        assert all(low <= value <= high for value, (low, high) in zip(found, LIMITS, strict=True))
    inner = all(low + 1e-6 < value < high - 1e-6 for value, (low, high) in zip(joints, LIMITS, strict=True))
    if (
        inner
        and abs(math.sin(joints[4])) > 1e-6
        and math.hypot(*wanted.point((0.0, 0.0, -56.25))[:2]) > 151.0
    ):
        assert found is not None
        assert max(abs(a - b) for a, b in zip(found, joints, strict=True)) < 1e-4


def test_what_is_too_far_has_no_solution() -> None:
    assert _arms(Pose(about_z(0.0), (2000.0, 0.0, 700.0))) == []
    assert _arms(Pose(about_z(0.0), (0.0, 0.0, 700.0))) == []


def test_the_model_is_the_arm(held: Database) -> None:
    """MuJoCo's arm and the closed form have the plate, and the stick figure's wrist, in the same place."""
    model = mujoco.MjModel.from_xml_string(mjcf(held, []))
    data = mujoco.MjData(model)
    draw = random.Random(1)  # noqa: S311  # by seed
    for _ in range(50):
        joints = [draw.uniform(*limit) for limit in LIMITS]
        data.qpos[:6] = joints
        mujoco.mj_kinematics(model, data)
        pose = plate(joints)
        assert (1000 * data.site("plate").xpos).tolist() == pytest.approx(pose.at_mm, abs=1e-6)
        assert data.site("plate").xmat.tolist() == pytest.approx(
            [x for row in pose.turn for x in row], abs=1e-6
        )
        assert (1000 * data.body("link6").xpos).tolist() == pytest.approx(skeleton(joints)[4], abs=1e-6)
    assert [model.joint(f"j{at}").range.tolist() for at in range(1, 7)] == [list(one) for one in LIMITS]


def test_margins_are_to_the_nearer_limit() -> None:
    joints = [math.radians(value) for value in (-150.0, 220.0, 0.0, 0.0, 99.0, 266.0)]
    assert margins_deg(joints) == pytest.approx((10.0, 5.0, 45.0, 110.0, 1.0, 0.0), abs=1e-9)


# --- the controller ---


@pytest.fixture
def robot(held: Database) -> Robot:
    start = home(held)
    assert start is not None
    return Robot(start)


def moved(robot: Robot, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Values:
    pose = plate(robot.joints)
    return (1, FOLLOW, *nine(replace(pose, at_mm=(pose.at_mm[0] + x, pose.at_mm[1] + y, pose.at_mm[2] + z))))


def test_it_follows_a_pose_and_says_when_it_is_there(robot: Robot) -> None:
    before = robot.joints
    robot.order(moved(robot, x=10.0), before)
    assert robot.joints != before
    assert robot.report(before)[:4] == (1, FOLLOW, EXECUTING, 0)
    assert robot.report(robot.joints)[:4] == (1, FOLLOW, DONE, 0)
    assert robot.report(robot.joints)[4] == pytest.approx(plate(before).at_mm[0] + 10.0)


@pytest.mark.parametrize("far", [{"x": 600.0}, {"z": 2000.0}], ids=["a jump", "out of reach"])
def test_it_refuses_what_it_cannot_do_and_stays(robot: Robot, far: dict[str, float]) -> None:
    before = robot.joints
    robot.order(moved(robot, **far), before)
    assert robot.joints == before
    assert robot.report(before)[:4] == (1, FOLLOW, FAILED, 9)
    robot.order(moved(robot, x=1.0), before)  # the same number: still refused
    assert robot.joints == before
    robot.order((2, HOLD, *(0.0,) * 9), before)
    robot.report(before)
    assert robot.report(before)[:4] == (2, HOLD, DONE, 0)


def test_it_refuses_three_points_that_are_no_plate(robot: Robot) -> None:
    robot.order((1, FOLLOW, *(0.0,) * 9), robot.joints)
    assert robot.report(robot.joints)[2] == FAILED


def test_a_joint_that_does_not_follow_is_a_failure_and_is_not_pulled(robot: Robot) -> None:
    stuck = (robot.joints[0] - LAG_RAD - 0.01, *robot.joints[1:])
    robot.order(moved(robot, x=1.0), stuck)
    assert robot.report(stuck)[2] == FAILED
    assert robot.joints == stuck


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_is_a_failure_within_the_declared_ranges(
    robot: Robot, value: float
) -> None:
    robot.order(moved(robot, x=1.0), robot.joints)
    said = robot.report((value, *robot.joints[1:]))
    assert said[2:4] == (FAILED, 9)
    assert all(math.isfinite(float(one)) and abs(float(one)) <= 4000.0 for one in said[4:])
    robot.order(moved(robot, x=1.0), (value, *robot.joints[1:]))
    assert all(map(math.isfinite, robot.joints))
    robot.order((2, HOLD, *(0.0,) * 9), robot.joints)
    assert robot.report((value, *robot.joints[1:]))[2] == DONE  # brakes need no reading


def test_no_joint_jumps(robot: Robot) -> None:
    draw = random.Random(2)  # noqa: S311  # by seed
    for number in range(300):
        before = robot.joints
        x, y, z = (draw.uniform(-60.0, 60.0) for _ in range(3))
        robot.order((number, *moved(robot, x, y, z)[1:]), before)
        assert max(abs(a - b) for a, b in zip(before, robot.joints, strict=True)) <= JUMP_RAD


# --- the data ---


def test_the_arm_reaches_every_point_of_the_data(held: Database) -> None:
    assert unreachable(held) == ()


def test_a_station_out_of_reach_is_named(tmp_path: Path) -> None:
    from rcsc.run.description import description
    from rcsc.run.system import signatures
    from rcsc_cell.database.ask import open_database
    from rcsc_cell.workstation.prepared import parts_of

    text = (SYSTEM.parent / "cell.toml").read_text(encoding="utf-8")
    moved_station = text.replace("x = 198.4, y = -545.0", "x = 291.0, y = -799.0")
    assert moved_station != text
    wide = moved_station.replace("[200.0, 900.0]", "[200.0, 1400.0]")  # so that the joints are asked
    (tmp_path / "cell.toml").write_text(wide, encoding="utf-8")
    build(tmp_path / "cell.toml", tmp_path / "cell.sqlite", parts_of(signatures(description(SYSTEM))))
    problems = unreachable(open_database(tmp_path / "cell.sqlite"))
    assert problems
    assert all("STATION" in problem for problem in problems)


# --- the plants ---


def script(tmp_path: Path, *rows: str) -> str:
    path = tmp_path / "script.csv"
    path.write_text("\n".join(("command,part,source,dest,end_at", *rows)) + "\n", encoding="utf-8")
    return str(path)


def digests(made: Plant) -> Iterator[str]:
    """A digest of all that was published, cycle by cycle, while the arm swings and the fingers close."""
    start = made.robot.joints
    length_mm, width_mm, _ = made.database.sizes[1]
    top = Features(length_mm, width_mm)
    hashed = hashlib.sha256()
    for tick in range(40):
        to = tuple(value + 0.004 * tick for value in start)
        made.mechanism.advance(to, Grip(True, 0.0, 100.0, 80.0), (-6.0, -6.0))
        made.mechanism.flood(top, float(made.database.part(1)[1]))
        state = json.dumps(
            [
                made.mechanism.joints(),
                made.mechanism.hand(),
                made.mechanism.jaws(),
                repr(made.mechanism.parts()),
            ]
        )
        hashed.update(state.encode())
        yield hashed.hexdigest()


@pytest.mark.parametrize("backend", ["mujoco", "kinematic"])
def test_what_nobody_can_look_for_makes_no_picture(
    backend: Backend, held: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No object, one that is not in the database, and fingers without a part: the image processing is not even asked."""
    made = plant(held, backend)
    monkeypatch.setattr(made.mechanism, "flood", refuse)
    monkeypatch.setattr(made.mechanism, "lines", refuse)
    asked = [(FLOOD, 0), (LINE, 0), (FLOOD, 99), (LINE, 99), (FLOOD, held.objects["close_grip"])]
    for number, (fire, wanted) in enumerate(asked, 1):
        for tick in range(PICTURE_TICKS + 1):
            order = {"vision.to_camera": (number, fire, wanted)}
            said = made.step(10 * number + tick, order.get)
        assert said["camera.picture"] == (number, *NO_PICTURE)


def refuse(*_: object) -> None:
    raise AssertionError("it was asked")


REPEAT = """
from tests.cell.test_plants import digests
from tests.support.cells import database
from rcsc_cell.cell.ready import plant
print(list(digests(plant(database(), "mujoco", seed=3)))[-1])
"""


def test_the_same_seed_gives_the_same_bits_in_another_process(held: Database) -> None:
    """By physics; a whole episode without it: `tests.episodes.test_loop`."""
    here = list(digests(plant(held, "mujoco", seed=3)))[-1]
    there = subprocess.run(
        [sys.executable, "-c", REPEAT], cwd=REPO, capture_output=True, text=True, check=True
    )
    assert there.stdout.strip() == here


@pytest.mark.parametrize("backend", ["mujoco", "kinematic"])
def test_a_plant_that_is_put_back_goes_on_the_same(held: Database, backend: Backend) -> None:
    first, second = plant(held, backend), plant(held, backend)
    list(digests(first))
    second.restore(json.loads(json.dumps(first.state())))
    assert list(digests(first)) == list(digests(second))
    other = plant(held, backend, parts=[])
    with pytest.raises(ValueError, match="other parts"):
        other.restore(first.state())


def test_fingers_push_as_hard_as_they_are_told(held: Database) -> None:
    """Section 7.2: at rest on each other, and as little while they close."""
    for force in (50.0, 445.0):
        made = plant(held)
        most = 0.0
        for _ in range(80):
            made.mechanism.advance(made.robot.joints, Grip(True, 0.0, force, 80.0), (20.0, 20.0))
            most = max(most, made.mechanism.hand()[1])
        opening, felt = made.mechanism.hand()
        assert opening < 1.0
        assert felt == pytest.approx(force, rel=0.03)
        assert most <= force * 1.1


def test_the_vise_centres_a_part_on_its_datum(held: Database) -> None:
    vise = held.stations["fixture"]
    part = lying(held)[0]
    turn: Rotation = vise.frame.turn
    at = vise.frame.point((1.5, 0.5, 20.0 + part.body.size_mm[2] / 2))
    made = Physical(held, [replace(part.body, at_mm=at, turn=turn)], home(held) or ())
    for _ in range(40):
        made.advance(home(held) or (), Grip(False, 0.0, 0.0, 0.0), (-6.0, -6.0))
    x, _, _ = vise.frame.inside(made.parts()[0].at_mm)
    assert abs(x) < 0.3
    right, left = made.jaws()
    assert abs(left) < 0.3
    assert abs(right) < 0.5


SCRIPTS = {
    "from the buffer to the pallet": ("TRANSFER,BOXT (2),BUFFER,STATION(2),WS-SAFE",),
    "the wrong thickness": ("ACQUIRE,HOUS (2),BUFFER,,", "MOVE,,,WS-SAFE,"),
    "nothing there": ("ACQUIRE,BOXT (2),STATION(1),,",),
    "nothing in the hand": ("RELEASE,,,,FIX-MAC2",),
    "a part into the vise, and out again": (
        '"VISE-OPEN RIGHT, CLOSE LEFT",,,,',
        "MOVE,BOXT (2),BUFFER,FIX-MAC1,",
        "VISE-CLOSE RIGHT,,,,",
        "RELEASE,,,,FIX-MAC2",
        "MACHINE DOVETAIL,,,,",
        "ACQUIRE,BOXT (2),FIX-MAC5,,",
        '"VISE-OPEN RIGHT, OPEN LEFT",,,,',
        "CLEAR,,,STATION(1),WS-SAFE",
    ),
}
FAULTY = {
    "robot_stuck": True,
    "joint_stuck": 3,
    "robot_refuses": True,
    "unreadable": True,
    "hand_stuck": True,
    "jammed": True,
    "slips": True,
    "blind": True,
    "dark": True,
    "tilted": True,
    "vise_stuck": True,
}


def became(backend: Backend, path: str, fault: str = "", value: object = True) -> list[tuple[int, str, str]]:
    """What became of each row, and why; a fault is there from the first cycle."""
    made: list[Plant] = []

    def outside(held: Database) -> list[Plant]:
        made.append(plant(held, backend))
        if fault:
            setattr(made[0].faults, fault, value)
        return made

    run = prepare(SYSTEM, path, "c", outside)
    return [(step.row.number, step.state, step.reason) for step in run.steps(4000)]


@pytest.mark.parametrize("name", list(SCRIPTS))
def test_both_plants_have_the_same_become_of_every_row(name: str, tmp_path: Path) -> None:
    path = script(tmp_path, *SCRIPTS[name])
    assert became("kinematic", path) == became("mujoco", path)


@pytest.mark.parametrize("fault", list(FAULTY))
def test_both_plants_have_a_fault_reported_alike(fault: str, tmp_path: Path) -> None:
    path = script(
        tmp_path, '"VISE-CLOSE RIGHT, CLOSE LEFT",,,,', "TRANSFER,BOXT (2),BUFFER,STATION(2),WS-SAFE"
    )
    physical = became("mujoco", path, fault, FAULTY[fault])
    assert became("kinematic", path, fault, FAULTY[fault]) == physical
    assert physical[-1][1] == "failed"


def test_every_switch_is_one_by_name_for_the_shell_for_run_and_for_the_studio() -> None:
    """The names of `--fault`, of the shell's `fault` and of the studio's list are those of the switches."""
    begun = opened(Opening(SYSTEM, plant="kinematic", faults=("joint_stuck=3", "dark")))
    assert [line for line in begun.do("faults") if line.endswith(" is on")] == [
        "joint_stuck is on",
        "dark is on",
    ]
    commands = opened(Opening(SYSTEM, plant="kinematic"))
    outside = commands.session.system.outside
    (cell,) = (part for part in outside if isinstance(part, Plant))
    names = [field.name for field in fields(Faults)]
    assert len(names) == 18
    assert commands.do("faults") == names
    for name in names:
        commands.do(f"fault {name}")
        assert cell.faults != Faults(), name
        commands.do(f"fault {name} off")
        assert cell.faults == Faults(), name
    assert commands.do("fault late_ticks=7") == ["late_ticks=7 is on"]
    assert (cell.faults.late_ticks, type(cell.faults.late_ticks)) == (7, int)
    assert "late_ticks is on" in commands.do("faults")
    for wrong in ("joint_stuck=7", "late_ticks=much", "shifted_mm=nan", "blind=2"):
        with pytest.raises(Refused, match="strength"):
            commands.do(f"fault {wrong}")
    with pytest.raises(Refused, match="no plant has a fault"):
        commands.do("fault blint")
    switch((timed(cell),), "vise_stuck", on=True)
    assert cell.faults.vise_stuck
