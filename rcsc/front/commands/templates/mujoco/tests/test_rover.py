"""What the rover must do: `python -m pytest` in the project's folder."""

from pathlib import Path
from typing import Any

import mujoco

import rcsc

HERE = Path(__file__).parents[1]


def answer(robot: rcsc.LoadedSystem, most: int = 1000) -> dict[str, Any]:
    """Runs until the order is answered; the last report."""
    for _ in range(most):
        robot.step()
        report = robot.report()
        if report is not None and report["status_report"] != "executing":
            return report
    raise AssertionError(f"no answer in {most} ticks")


def test_everything_is_proved() -> None:
    assert not rcsc.check(HERE).failed
    assert rcsc.prove(HERE / "system.toml").whole


def test_the_day_s_orders_are_done_by_either_plant() -> None:
    for plant in (None, "mujoco"):
        assert rcsc.run(HERE / "system.toml", plant=plant).done


def test_the_model_moves_by_contact_alone() -> None:
    """Nothing is welded, sticks or is put somewhere: one motor turns two wheels, and the charger's plate is on a spring."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "rover.xml"))
    assert (model.neq, model.nmocap) == (0, 0)
    assert [int(kind) for kind in model.actuator_trntype] == [int(mujoco.mjtTrn.mjTRN_TENDON)]
    assert {model.joint(int(at)).name for at in model.wrap_objid} == {"left", "right"}
    assert not model.body_gravcomp.any()


def test_it_docks_and_leaves_again() -> None:
    robot = rcsc.load_system(HERE / "system.toml", executor="python")
    plate = robot.plant.data.joint("plate")
    robot.order("dock")
    assert answer(robot)["status_report"] == "done"
    robot.step(100)
    assert robot.plant.contact >= 3, "it stays where it is"
    assert plate.qpos[0] > 0.005, "the plate is pushed back"
    robot.order("undock")
    assert answer(robot)["status_report"] == "done"
    assert robot.plant.range > 0.55
    assert robot.plant.contact == 0
    assert abs(plate.qpos[0]) < 0.001, "its spring has pushed it out again"


def test_dead_motors_are_reported() -> None:
    robot = rcsc.load_system(HERE / "system.toml", executor="python")
    robot.plant.motors_dead = True
    robot.order("dock")
    report = answer(robot)
    assert (report["status_report"], report["why"]) == ("failed", "not_reached")
