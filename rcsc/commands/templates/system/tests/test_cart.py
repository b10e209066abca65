"""What the cart must do: `python -m pytest` in the project's folder."""

from pathlib import Path
from typing import Any

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


def test_the_day_s_orders_are_done() -> None:
    assert rcsc.run(HERE / "system.toml").done


def test_a_delivery_goes_out_and_comes_back() -> None:
    robot = rcsc.load_system(HERE / "system.toml")
    places = []
    robot.system.watch.append(lambda *_: places.append(int(robot.value("axis.position_mm"))))
    robot.order("deliver", far_mm=700)
    assert answer(robot)["status_report"] == "done"
    assert abs(max(places) - 700) <= 20
    assert places[-1] <= 20


def test_a_cart_that_is_stuck_is_reported() -> None:
    robot = rcsc.load_system(HERE / "system.toml")
    robot.order("deliver", far_mm=700)
    robot.step(20)
    robot.plant.stuck = True
    report = answer(robot)
    assert (report["status_report"], report["why"]) == ("failed", "too_late")
    robot.order("rest")
    assert answer(robot)["status_report"] == "done"
