"""The whole system without physics: MAKE BOXT, PAUSE and new commands at every cycle, faults, and what is reported of them."""

import shutil
from itertools import pairwise
from pathlib import Path

import pytest

from rcsc.run.levels import RunningLevel
from rcsc.run.signature import Value
from rcsc.run.system import System
from rcsc_cell.cell.mujoco_model import Body
from rcsc_cell.cell.plant import Plant
from rcsc_cell.cell.ready import Lying, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.database.pose import about_z
from rcsc_cell.episodes.witness import placements
from tests.support.cells import (
    COMMAND_ENDS,
    PAUSE_ENDS,
    SCRIPT,
    SYSTEM,
    Cell,
    ScriptDraft,
    prepare,
    through_script,
)


def world(database: Database) -> tuple[Plant]:
    return (plant(database, "kinematic"),)


def test_make_boxt_runs_to_the_end_and_both_executors_do_the_same() -> None:
    traces = []
    for kind in ("c", "python"):
        run = prepare(SYSTEM, "make_boxt", "c" if kind == "c" else "python", world)
        trace: list[object] = []

        def watch(_: System, due: tuple[RunningLevel, ...], trace: list[object] = trace) -> None:
            trace.append([level.values for level in due])

        run.system.watch.append(watch)
        results = list(run.steps())
        assert [result.state for result in results] == ["done"] * 27
        traces.append(trace)
        made = run.system.outside[1]
        assert isinstance(made, Plant)
        [placed] = placements(run.station.results, run.database, made)
        assert placed.place == "STATION(3)"
        assert placed.error_mm < 1.0
        assert made.mechanism.parts()[0].axis(2)[2] < -0.99  # turned over
        assert made.mechanism.touching() == frozenset()
        assert run.system.level("task").value("tbuffer_boxt") == 9
    assert traces[0] == traces[1]


def test_the_script_as_printed_is_refused_before_the_loose_part_is_machined() -> None:
    run = prepare(SYSTEM, "make_boxt_printed", "c", world)
    *before, last = run.steps()
    assert {result.state for result in before} == {"done"}
    assert (last.row.number, last.state, last.reason) == (22, "refused", "the vise is open: its right jaw")


@pytest.fixture(scope="module")
def probe() -> Cell:
    """A second cell, put where another one is."""
    return Cell()


def test_pause_at_every_cycle_of_every_command(probe: Cell) -> None:
    """Section 4.6: a done comes back up, and nothing moves from then on."""
    main = Cell()
    for _ in through_script(main):
        probe.take_over(main)
        probe.tell("pause")
        assert probe.until_over(PAUSE_ENDS) == "done", main.system.tick
        where = probe.world.plate
        probe.system.step()
        probe.system.step()
        assert probe.world.plate == where
        assert probe.failed == []
    assert main.failed == []
    assert main.system.tick > 700


def test_a_new_command_at_every_cycle_of_every_command(probe: Cell) -> None:
    """The command that comes is the one that is answered, and it ends."""
    main = Cell()
    for _ in through_script(main):
        if main.system.tick % 3:
            continue
        probe.take_over(main)
        if (
            probe.do("move", dest="WS-SAFE") == "failed"
        ):  # PICKUP was under way: the part that was counted on is not there
            assert (probe.reason(), probe.world.mechanism.touching()) == ("nothing_gripped", frozenset())
            probe.do("move", dest="WS-SAFE")
        assert probe.answer == "done", (main.system.tick, probe.reason())
        assert probe.failed == []
        route = probe.database.route(probe.database.locations["WS-SAFE"], 0)
        assert probe.world.plate == pytest.approx(probe.database.point(int(route[3]))[1:10])


def test_every_command_is_answered_by_its_own_number_across_the_wrap() -> None:
    cell = Cell()
    cell.number = 65_534
    for dest in ("WS-SAFE", "FIX-SAFE", "BUFFER-SAFE", "WS-SAFE"):
        assert cell.do("move", dest=dest) == "done"
    assert cell.number == 2
    levels = cell.system.levels
    level = levels[1]
    values = list(level.values)
    values[level.sign.index["to_primitive.inc_command"]] = 65_535
    assert cell.failed == []


FAULTS = {
    "no source, and the robot is nowhere": ("acquire", {"obj": "tbox", "grasp": 2}, "cmd none"),
    "no destination": ("move", {}, "cmd none"),
    "nothing to release": ("release", {}, "cmd none"),
    "nothing to clear": ("clear", {"dest": "STATION"}, "cmd none"),
    "nothing to transfer": ("transfer", {"dest": "V-BLK1"}, "cmd none"),
    "no such place": ("move", {"dest": 200}, "cmd none"),
    "no such sector": ("move", {"dest": "STATION", "sector": 50}, "move no_place"),
    "not on the buffer": ("acquire", {"obj": "hous", "grasp": 2, "source": "BUFFER"}, "loc no_match"),
    "thicker than expected": ("acquire", {"obj": "bbox", "grasp": 2, "source": "BUFFER"}, "loc wrong_range"),
    "no such grasp": ("acquire", {"obj": "tbox", "grasp": 9, "source": "FIX-MAC5"}, "move grip"),
    "nothing there": ("acquire", {"obj": "tbox", "grasp": 2, "source": "FIX-MAC5"}, "pic nothing_gripped"),
}
"""Commands with TASK's word for what fails, and E-MOVE's."""


@pytest.mark.parametrize("name", list(FAULTS))
def test_what_cannot_be_done_is_reported_with_its_reason(name: str) -> None:
    command, said, reason = FAULTS[name]
    cell = Cell()
    assert cell.do(command, **said) == "failed"  # type: ignore[arg-type]  # of the table above
    assert f"{cell.reason()} {cell.cause()}" == reason
    assert cell.do("move", dest="WS-SAFE") == "done"
    assert (cell.reason(), cell.cause()) == ("none", "none")
    assert cell.failed == []


def test_a_command_that_is_refused_has_no_cause_left_of_the_one_before() -> None:
    cell = Cell()
    assert cell.do("acquire", obj="hous", grasp=2, source="BUFFER") == "failed"
    assert cell.cause() == "no_match"
    assert cell.do("release") == "failed"
    assert (cell.reason(), cell.cause()) == ("cmd", "none")


def test_without_a_source_the_part_is_taken_where_the_robot_is() -> None:
    """Section 3.1: at a place that is known, and at the buffer by vision, where it is counted."""
    cell = Cell()
    assert cell.do("move", dest="BUFFER") == "done"
    assert cell.do("acquire", obj="tbox", grasp=2) == "done"
    assert cell.system.level("task").value("tbuffer_boxt") == 9
    assert cell.do("acquire", obj="tbox", grasp=2) == "failed"
    assert (cell.reason(), cell.cause()) == ("cmd", "none")  # it holds one already
    assert cell.do("transfer", dest="STATION", sector=2, end_at="WS-SAFE") == "done"
    assert cell.do("acquire", obj="tbox", grasp=2) == "failed"
    assert (cell.reason(), cell.cause()) == ("pic", "nothing_gripped")  # in the air
    assert cell.do("move", dest="STATION", sector=2) == "done"
    assert cell.do("acquire", obj="tbox", grasp=2) == "done"
    assert cell.system.level("task").value("current_sector") == 2
    assert [at for at, part in enumerate(cell.world.objects) if part == 1] == [0]
    assert cell.world.mechanism.touching() >= {("pad_left", "part0"), ("pad_right", "part0")}
    assert cell.failed == []


def test_without_a_source_a_robot_on_its_way_takes_nothing() -> None:
    cell = Cell()
    assert cell.do("move", dest="FIX-SAFE") == "done"
    cell.tell("move", dest="WS-SAFE")
    assert cell.until_over(10) == ""
    assert cell.do("acquire", obj="tbox", grasp=2) == "failed"
    assert cell.reason() == "cmd"
    assert cell.do("move", dest="WS-SAFE") == "done"


def test_a_robot_that_left_a_part_and_was_paused_is_nowhere() -> None:
    """RELEASE leaves the place for the safe one: what comes then does not begin at the place."""
    cell = Cell()
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
    assert cell.do("move", dest="STATION", sector=1) == "done"
    cell.tell("release")
    task = cell.system.level("task")
    while task.shown("cur_state") != "state_8":
        cell.system.step()
    assert cell.do("pause") == "done"
    assert task.value("current_loc") == 0
    assert cell.do("acquire", obj="tbox", grasp=2) == "failed"
    assert cell.reason() == "cmd"
    assert cell.do("acquire", obj="tbox", grasp=2, source="STATION", sector=1) == "done"
    assert cell.do("release") == "done"
    assert task.value("current_loc") == cell.database.locations["WS-SAFE"]
    assert cell.failed == []


def test_vision_looks_past_a_hand_that_is_opened_fully() -> None:
    """Section 4.1: before the first picture as wide as it goes, and after the second one as the part wants it."""
    cell = Cell()
    assert cell.do("move", dest="BUFFER-VUPOS") == "done"
    cell.tell("acquire", obj="tbox", grasp=2, source="BUFFER")
    gripper, vision, openings = cell.system.level("gripper"), cell.system.level("vision"), []
    for _ in range(COMMAND_ENDS):
        number = vision.value("to_camera.number")
        cell.system.step()
        if vision.value("to_camera.number") != number:
            openings.append(gripper.value("hand.opening_mm"))
        if cell.answer == "done":
            break
    assert openings == pytest.approx([130.0, 130.0], abs=0.6)
    assert gripper.value("hand.opening_mm") == pytest.approx(60.0, abs=1.0)


def test_a_second_command_while_a_part_is_held_is_refused() -> None:
    cell = Cell()
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "done"
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "failed"
    assert cell.reason() == "cmd"
    assert cell.system.level("task").value("tbuffer_boxt") == 9


def test_a_part_of_the_wrong_size_is_an_unknown_object() -> None:
    fixture = Cell().database.stations["fixture"].frame
    house = Body((70.0, 50.0, 50.0), fixture.point((0.0, 0.0, 45.0)), about_z(20.0))
    cell = Cell(parts=[Lying(4, house)])  # a house where a box top should be
    assert cell.do("acquire", obj="tbox", grasp=2, source="FIX-MAC5") == "failed"
    assert cell.reason() == "pic"
    assert cell.system.level("task").shown("obj_now_in_gripper") == "unknown_object"


def test_an_empty_buffer_fails_and_stays_failed() -> None:
    """Fig. 9: the published procedure's failure is overwritten by the pending state."""
    cell = Cell()
    task = cell.system.level("task")
    task.executor.put(task.sign.index["tbuffer_boxt"], (0,))
    task.values = task.executor.values()
    assert cell.do("acquire", obj="tbox", grasp=2, source="BUFFER") == "failed"
    assert cell.reason() == "buf"
    for _ in range(20):
        cell.system.step()
        assert cell.answer == "failed"
    assert cell.system.level("emove").shown("task.input_command") == "pause"
    assert task.value("tbuffer_boxt") == 0


@pytest.mark.parametrize(
    ("fault", "command", "said", "reason"),
    [
        ("robot_stuck", "move", {"dest": "FIX-SAFE"}, ("move", "robot")),
        ("hand_stuck", "acquire", {"obj": "tbox", "grasp": 2, "source": "FIX-MAC5"}, ("move", "grip")),
        ("blind", "acquire", {"obj": "tbox", "grasp": 2, "source": "BUFFER"}, ("loc", "no_match")),
        ("dark", "acquire", {"obj": "tbox", "grasp": 2, "source": "BUFFER"}, ("loc", "no_picture")),
        ("tilted", "acquire", {"obj": "tbox", "grasp": 2, "source": "BUFFER"}, ("loc", "wrong_surface")),
    ],
)
def test_a_fault_below_is_reported_upward(
    fault: str, command: str, said: dict[str, str], reason: tuple[str, str]
) -> None:
    cell = Cell()
    setattr(cell.world.faults, fault, True)
    assert cell.do(command, **said) == "failed"
    assert (cell.reason(), cell.cause()) == reason
    setattr(cell.world.faults, fault, False)
    assert cell.do("move", dest="WS-SAFE") == "done"
    assert cell.failed == []


DATA = (SYSTEM.parent / "cell.toml").read_text(encoding="utf-8")


def with_data(data: str, folder: Path, *rows: str) -> ScriptDraft:
    """A script in a cell of other data, by the executors that are there."""
    assert data != DATA
    system = SYSTEM.read_text(encoding="utf-8").replace('"../generated"', '"generated"')
    shutil.copytree(SYSTEM.parents[1] / "generated", folder / "generated")
    (folder / "cell.toml").write_text(data, encoding="utf-8")
    (folder / "system.toml").write_text(system, encoding="utf-8")
    script = folder / "go.csv"
    script.write_text("\n".join(("command,part,source,dest,end_at", *rows)), encoding="utf-8")
    return prepare(folder / "system.toml", str(script), "c", world)


def test_a_station_moves_in_the_data_and_nothing_is_compiled_again(tmp_path: Path) -> None:
    moved = DATA.replace("at = { x = 560.0, y = 0.0, z = 560.0", "at = { x = 530.0, y = 40.0, z = 550.0")
    run = with_data(moved, tmp_path, "MOVE,,,WS-SAFE,")
    assert [result.state for result in run.steps()] == ["done"]
    made = run.system.outside[1]
    assert isinstance(made, Plant)
    assert made.plate[:3] == pytest.approx((530.0, 40.0, 715.0))


@pytest.mark.parametrize(("leans", "reason"), [(False, "loc: wrong_surface"), (True, "")])
def test_vision_is_told_the_surface_normal_to_expect(leans: bool, reason: str, tmp_path: Path) -> None:
    """Section 5.2: LINE-FLASH fails where the measured orientation is not the expected one."""
    data = DATA.replace(
        "[object.tbox]\n", "[object.tbox]\nnormal = [0.342, 0.0, 0.9397]\n", 1
    )  # 20 degrees to the right
    run = with_data(data, tmp_path, "ACQUIRE,BOXT (2),BUFFER,,")
    [_, made] = run.system.outside
    assert isinstance(made, Plant)
    made.faults.tilted = leans
    [result] = run.steps()
    assert result.reason == reason


def test_the_way_to_a_place_depends_on_where_the_robot_comes_from(tmp_path: Path) -> None:
    path = (
        '[[path]]\nfrom = "FIX-SAFE"\nto = "WS-SAFE"\ndeparture = [150.0]\napproach = [[-80.0, 0.0, 0.0]]\n'
    )
    rows = ("MOVE,,,FIX-SAFE,", "MOVE,,,WS-SAFE,", "MOVE,,,V-BLK2,", "MOVE,,,WS-SAFE,")
    run = with_data(DATA + path, tmp_path, *rows)
    emove, orders = run.system.level("emove"), [list[tuple[str, Value]]() for _ in rows]

    def watch(*_: object) -> None:
        order = emove.shown("to_primitive.input_command"), emove.value("to_primitive.pose_ptr")
        seen = orders[min(run.station.at, len(rows) - 1)]
        if order[0] != "pause" and order not in seen:
            seen.append(order)

    run.system.watch.append(watch)
    assert [result.state for result in run.steps()] == ["done"] * 4
    commands = [[command for command, _ in seen] for seen in orders]
    assert commands == [["goto"], ["gothru", "gothru", "goto"], ["goto"], ["goto"]]
    assert run.database.point(int(orders[1][1][1]))[1] == pytest.approx(480.0)


@pytest.mark.parametrize("decel_mm_s2", [300.0, 2400.0])
def test_the_robot_brakes_as_its_data_says(decel_mm_s2: float, tmp_path: Path) -> None:
    """Section 4.3: maximum speed, acceleration and deceleration of each point."""
    braked = DATA.replace("decel_mm_s2 = 1200.0", f"decel_mm_s2 = {decel_mm_s2}")
    run = with_data(braked, tmp_path, "MOVE,,,WS-SAFE,", "MOVE,,,FIX-SAFE,")
    primitive, speeds = run.system.level("primitive"), [0.0]

    def watch(*_: object) -> None:
        speeds.append(float(primitive.value("speed_mm_s")))

    run.system.watch.append(watch)
    assert [result.state for result in run.steps()] == ["done"] * 2
    changes = [after - before for before, after in pairwise(speeds) if after > 20.0]
    assert max(changes) == pytest.approx(1200.0 * 0.04)
    assert min(changes) == pytest.approx(-decel_mm_s2 * 0.04)


def test_the_script_of_these_tests_has_every_command() -> None:
    assert {command for command, _ in SCRIPT} == {"acquire", "move", "release", "transfer", "clear", "pause"}
