"""Vise and machine of the plant: when an order is done, when it has failed, what moves meanwhile; and that all can be put back."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from math import nan
from typing import Literal

import pytest

from rcsc.base.host.files.plain import plain, read
from rcsc.run.signature import Values
from rcsc_cell.cell.fixture import (
    IN_MM,
    MOST_TICKS,
    OPERATION_TICKS,
    OUT_MM,
    START_TICKS,
    MachineController,
    ViseController,
)
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.plant import WEAK_MM, Plant
from rcsc_cell.cell.ready import Lying, plant
from rcsc_cell.workstation.orders import (
    DONE,
    EXECUTING,
    FAILED,
    MACHINE_ORDER,
    MACHINE_REPORT,
    VISE_ORDER,
    VISE_REPORT,
    ajar,
)
from tests.support.cells import database

CLOSE: Values = (1, False, False)
OPEN: Values = (2, True, True)


DATABASE = database()
STOP_MM = 0.0
"""Where a part stops a jaw, and the left one's own stop."""


def vise(part: bool) -> Plant:
    """A plant whose vise has a box top between its jaws, or nothing; nobody gives the robot an order."""
    frame = DATABASE.stations["fixture"].frame
    top = Body(DATABASE.sizes[1], frame.point((0.0, 0.0, 40.0)), frame.turn)
    return plant(DATABASE, "kinematic", [Lying(1, top)] if part else [])


@dataclass
class Bench:
    """A plant and what stands in its order buffers."""

    plant: Plant = field(default_factory=lambda: vise(part=False))
    buffers: dict[str, Values] = field(default_factory=dict)
    tick: int = 0

    def step(self) -> Values:
        """One tick; what the vise reports."""
        self.buffers |= self.plant.step(self.tick, self.buffers.get)
        self.tick += 1
        return self.buffers[VISE_REPORT]

    def until_over(self, order: Values, most: int = 2 * MOST_TICKS) -> tuple[int, Values]:
        """Gives the order and waits for the end: cycles, and the last report."""
        self.buffers[VISE_ORDER] = order
        for ticks in range(1, most):
            report = self.step()
            assert report[0] == order[0]
            if report[1] != EXECUTING:
                return ticks, report
        raise AssertionError(f"{order} did not end")


# --- vise ---


@pytest.mark.parametrize(("part", "stands_mm"), [(True, STOP_MM), (False, IN_MM)])
def test_the_vise_closes_on_a_part_or_on_its_stop_and_opens_again(part: bool, stands_mm: float) -> None:
    bench = Bench(vise(part))
    ticks, report = bench.until_over(CLOSE)
    assert report == (1, DONE, stands_mm, STOP_MM)
    assert ticks > 5, "it was done before the jaws could be there"
    assert bench.until_over(OPEN)[1] == (2, DONE, OUT_MM, OUT_MM)


def test_each_jaw_has_its_own_order() -> None:
    bench = Bench()
    assert bench.until_over((1, True, False))[1] == (1, DONE, OUT_MM, STOP_MM)
    assert bench.until_over((2, False, True))[1][2:] == pytest.approx((IN_MM, OUT_MM), abs=1.0)


@pytest.mark.parametrize("opened", [True, False])
def test_what_is_so_already_is_answered_again_under_its_number_which_wraps(opened: bool) -> None:
    bench = Bench()
    for number in (65534, 65535, 0, 1):
        _, report = bench.until_over((number, opened, opened))
        assert report[:2] == (number, DONE)


def test_the_first_order_is_taken_whatever_its_number() -> None:
    assert Bench().until_over((0, False, False))[1] == (0, DONE, IN_MM, STOP_MM)
    assert MachineController().step((0, 1), 0.0, 0.0) == (0, EXECUTING)


def test_before_an_order_the_jaws_do_not_move() -> None:
    vise = ViseController()
    for measured in (7.0, 7.01, 6.9):
        assert vise.step(None, measured, -2.0) == (7.0, -2.0, (0, DONE, measured, -2.0))


@pytest.mark.parametrize(
    ("fault", "right_mm", "left_mm"), [("vise_stuck", OUT_MM, OUT_MM), ("vise_weak", WEAK_MM, STOP_MM)]
)
def test_jaws_that_do_not_close_are_reported_and_stay_where_they_are(
    fault: str, right_mm: float, left_mm: float
) -> None:
    bench = Bench(vise(part=True))
    setattr(bench.plant.faults, fault, True)
    ticks, report = bench.until_over(CLOSE)
    assert report == (1, FAILED, right_mm, left_mm)
    assert START_TICKS < ticks < MOST_TICKS
    assert ajar(report, right_open=False, left_open=False) == (
        f"the right jaw did not close: it stands at {right_mm:.1f} mm"
    )
    setattr(bench.plant.faults, fault, False)
    assert [bench.step() for _ in range(20)] == [report] * 20, "it started by itself"
    assert bench.until_over((2, False, False))[1][:2] == (2, DONE)


def test_a_jaw_that_grows_weak_is_not_pushed_out() -> None:
    bench = Bench(vise(part=True))
    bench.until_over(CLOSE)
    bench.plant.faults.vise_weak = True
    assert bench.until_over((2, False, False))[1] == (2, DONE, STOP_MM, STOP_MM)
    assert bench.until_over((3, True, True))[1][:2] == (3, DONE), "it opens"


def test_a_mute_vise_works_and_says_nothing() -> None:
    bench = Bench(vise(part=True))
    bench.plant.faults.vise_mute = True
    bench.buffers |= {VISE_ORDER: CLOSE, MACHINE_ORDER: (1, 0)}
    for _ in range(MOST_TICKS):
        assert not {VISE_REPORT, MACHINE_REPORT} & bench.plant.step(0, bench.buffers.get).keys()
    bench.plant.faults.vise_mute = False
    assert bench.step() == (1, DONE, STOP_MM, STOP_MM)


def test_a_stuck_jaw_does_not_make_the_other_let_go() -> None:
    vise = ViseController()
    for _ in range(MOST_TICKS):
        right, left, report = vise.step(CLOSE, 12.0, 0.0)
    assert report[1] == FAILED
    assert (right, left) == (12.0, IN_MM)
    assert "right jaw did not close" in ajar(report, right_open=False, left_open=False)


@pytest.mark.parametrize(
    "measured", [lambda tick: 2.0 * (tick % 2), lambda _: nan], ids=["shakes", "nothing"]
)
def test_a_jaw_that_never_rests_fails_after_two_seconds(measured: Callable[[int], float]) -> None:
    vise = ViseController()
    said = [vise.step(CLOSE, measured(tick), 0.0) for tick in range(MOST_TICKS + 1)]
    assert [report[1] for _, _, report in said] == [EXECUTING] * MOST_TICKS + [FAILED]
    assert all(abs(right) <= OUT_MM for right, _, _ in said), "a jaw was sent nowhere"


def test_a_closing_jaw_is_not_done_while_it_moves() -> None:
    bench = Bench()
    bench.buffers[VISE_ORDER] = CLOSE
    reports = [bench.step() for _ in range(25)]
    for before, after in pairwise(reports):
        assert not (after[1] == DONE and after[2] != before[2])
    assert reports[-1][1] == DONE


def test_a_new_order_replaces_one_under_way() -> None:
    bench = Bench()
    bench.buffers[VISE_ORDER] = CLOSE
    for _ in range(5):
        bench.step()
    assert bench.until_over(OPEN)[1] == pytest.approx((2, DONE, OUT_MM, OUT_MM), abs=1.0)


@pytest.mark.parametrize(
    ("at_mm", "opened", "said"),
    [
        (19.0, True, "the right jaw did not open"),
        (19.1, True, ""),
        (3.0, False, "did not close"),
        (2.9, False, ""),
    ],
)
def test_where_open_begins_and_closed_ends(at_mm: float, opened: bool, said: str) -> None:
    words = ajar((1, FAILED, at_mm, at_mm), right_open=opened, left_open=opened)
    assert said in words
    assert bool(said) == bool(words)


# --- machine ---


def test_an_operation_takes_its_time_and_needs_the_vise() -> None:
    machine = MachineController()
    assert [machine.step((1, 1), 0.0, 0.0)[1] for _ in range(OPERATION_TICKS)] == [
        EXECUTING
    ] * OPERATION_TICKS
    assert machine.step((1, 1), 0.0, 0.0) == (1, DONE)
    assert machine.step((1, 1), 20.0, 0.0) == (1, DONE), "it was over"
    assert machine.step((2, 2), 20.0, 0.0) == (2, FAILED)
    assert machine.step((2, 2), 0.0, 0.0) == (2, FAILED), "it went on by itself"
    assert machine.step((3, 0), 20.0, 20.0) == (3, DONE)


@pytest.mark.parametrize("jaws", [(3.0, 0.0), (0.0, 3.0), (nan, 0.0)])
def test_an_operation_fails_when_the_vise_opens_meanwhile(jaws: tuple[float, float]) -> None:
    machine = MachineController()
    for _ in range(OPERATION_TICKS - 1):
        assert machine.step((9, 1), 0.0, 0.0) == (9, EXECUTING)
    assert machine.step((9, 1), *jaws) == (9, FAILED)


# --- put back ---


def test_a_plant_put_back_at_any_tick_goes_on_as_it_would_have() -> None:
    bench = Bench(vise(part=True))
    bench.buffers |= {VISE_ORDER: CLOSE, MACHINE_ORDER: (0, 0)}
    kept, trace = [], []
    for tick in range(100):
        if tick == 30:
            bench.buffers[MACHINE_ORDER] = (1, 1)
        if tick == 60:
            bench.buffers[VISE_ORDER] = OPEN
        kept.append((json.dumps(bench.plant.state()), dict(bench.buffers)))
        bench.step()
        trace.append((bench.buffers[VISE_REPORT], bench.buffers[MACHINE_REPORT]))
    assert {machine[1] for _, machine in trace} == {DONE, EXECUTING, FAILED}
    other = Bench(vise(part=True))
    for tick, (text, buffers) in enumerate(kept):
        other.buffers, other.tick = buffers, tick
        other.plant.restore(json.loads(text))
        other.step()
        assert (other.buffers[VISE_REPORT], other.buffers[MACHINE_REPORT]) == trace[tick], tick


def test_a_fault_is_no_state_and_stays_until_it_is_mended() -> None:
    held = vise(part=True)
    held.faults.vise_stuck = True
    assert "vise_stuck" not in json.dumps(held.state())
    held.restore(json.loads(json.dumps(vise(part=True).state())))
    assert held.faults.vise_stuck


@dataclass
class Inner:
    name: str
    at: tuple[float, float]
    order: tuple[bool | int | float, ...] = ()


@dataclass
class Outer:
    inner: Inner
    many: list[Inner] = field(default_factory=list)
    by_name: dict[str, Inner] = field(default_factory=dict)
    last: float | None = None


def test_plain_values_say_what_they_were() -> None:
    inner = Inner("a", (0.1, -0.0), (True, 1, 1.0, 0))
    outer = Outer(inner, [inner, Inner("b", (1e-300, 3.0))], {"x": inner}, None)
    other = read(Outer, json.loads(json.dumps(plain(outer))))
    assert repr(other) == repr(outer)  # 1, 1.0 and True are equal and not the same


@pytest.mark.parametrize(
    ("kind", "said"),
    [(int, 1.0), (int, True), (float, "1"), (tuple[int, int], [1]), (list[int], {"a": 1}), (Inner, {"name": "a"}), (int | None, "x"),
     (float, 1e300), (int, 2**200), (Literal["a", 1], True)],
)  # fmt: skip
def test_what_was_no_such_value_is_refused(kind: object, said: object) -> None:
    with pytest.raises(ValueError, match=r"is no|values for|not the values|none of|too large"):
        read(kind, said)


def test_what_could_not_be_read_again_is_not_kept() -> None:
    for value in ({1, 2}, {1: 2}, object()):
        with pytest.raises(TypeError):
            plain(value)


def test_the_state_of_something_else_is_refused() -> None:
    with pytest.raises(ValueError, match="not the values of a ViseController"):
        read(ViseController, plain(MachineController()))
    with pytest.raises(ValueError, match="not the state of a plant"):
        vise(part=True).restore(plain(MachineController()))
