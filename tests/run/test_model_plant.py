"""A MuJoCo model as a plant: the docking robot docks by contact, and whatever does not fit is told at its line before anything moves."""

import copy
from pathlib import Path

import mujoco
import pytest

from rcsc import load_system
from rcsc.front.commands import run
from rcsc.run.description import BadDescription, description
from rcsc.run.plant.bind import BadPlant, BoundPlant, Buffer, PlantFailed, plant_page
from rcsc.run.plant.load import load
from rcsc.run.plant.models.bindings import Binder, driven_in
from rcsc.run.plant.models.model_plant import BoundModel
from rcsc.run.plant.space import space_of
from rcsc.run.plant.staged import Staged
from rcsc.run.signature import Leaf, Values
from rcsc.run.system import signatures
from tests.support.films import film_of
from tests.support.programs.texts import edited

SPEED = '"base.speed" = { actuator = "wheels", scale = 0.001 }'
WAY = '"base.travelled" = { sensor = "odometer", unit = "m" }'
ASIDE = '"base.lateral" = { sensor = "beacon", element = 1 }'
PIN = '"base.contact" = { sensor = "pin", over = 0.001 }'
STILL = '"base.bumper" = { value = false }'


def stage(folder: Path) -> Staged:
    """What stands outside the docking robot."""
    system = description(folder / "system.toml")
    return load(system, signatures(system), "mujoco")


def model_of(folder: Path) -> BoundModel:
    """The model of a docking robot's folder."""
    [model] = stage(folder).outside
    assert isinstance(model, BoundModel)
    return model


def changed(folder: Path, name: str, *edits: tuple[str, str]) -> None:
    """Edits a file of the docking robot."""
    text = (folder / name).read_text(encoding="utf-8")
    (folder / name).write_text(edited(text, *edits), encoding="utf-8")


def ordered(speed: int) -> dict[str, Values]:
    """The buffers while the drive gives a speed, in mm/s."""
    return {"drive.speed_mm_s": (speed,)}


def test_the_robot_docks_by_contact(dock: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (dock / "in.csv").write_text("command\ndock\nstop\n", encoding="utf-8")
    asked = ["run", str(dock), "--plant", "mujoco", "--script", "in", "--no-compile"]
    logs = []
    for kind in ("c", "python"):
        log = dock / f"{kind}.mcap"
        assert run([*asked, "--executor", kind, "--log", str(log), "--report", str(dock / "dock.html")]) == 0
        logs.append(log.read_bytes())
    assert logs[0] == logs[1]
    assert [line.split()[1:3] for line in capsys.readouterr().out.splitlines()[:2]] == [
        ["dock", "done"],
        ["stop", "done"],
    ]
    assert run(["replay", str(dock / "c.mcap"), "--system", str(dock)]) == 0
    page = (dock / "dock.html").read_text(encoding="utf-8")
    assert page.count("<figure") >= 1
    film = film_of(page)
    assert "drive.travelled_mm" in film["shown"]
    assert film["variables"]["drive"]["travelled_mm"]["unit"] == "mm"


TOUCHES_M, HELD_M = 0.635, 0.655
"""Where the base touches the pin, and where the guides hold it, in both plants."""


@pytest.mark.parametrize("plant", [None, "mujoco"])
def test_the_robot_charges_by_contact_and_backs_out_of_it(dock: Path, plant: str | None) -> None:
    """By what is outside, not by what is reported: where base and pin are after every tick. It docks twice."""
    robot = load_system(dock / "system.toml", plant=plant, executor="python")
    ways: list[float] = []
    pins: list[float] = []
    speeds: list[int] = []

    def look(*_: object) -> None:
        space = space_of(robot.system.outside)
        assert space is not None
        at = dict(zip(space.bodies, space.poses()[::7], strict=True))
        ways.append(at["base"])
        pins.append(at["pin"] - (TOUCHES_M + 0.11))
        speeds.append(int(robot.value("drive.speed_mm_s")))

    robot.system.watch.append(look)
    for _ in range(2):
        for command, charges in (("dock", True), ("undock", False)):
            robot.order(command)
            begun = len(ways)
            robot.step(120)
            report = robot.report()
            assert report is not None
            assert (report["ref_command_echo"], report["status_report"]) == (command, "done")
            assert robot.value("supervisor.contact") is charges
            assert (ways[-1] > TOUCHES_M) is charges
            assert (pins[-1] > 0.001) is charges, "the pin springs back"
            if not charges:
                assert 0.05 < ways[-1] <= 0.1
                assert max(speeds[begun + 1 :]) <= 0
    assert max(ways) < HELD_M + 0.001, "nothing rolls through the charger"


def test_the_python_base_touches_only_where_it_is_in_the_middle_and_presses(dock: Path) -> None:
    """Wherever it is put."""
    base = load_system(dock / "system.toml", executor="python").plant
    seen = set()
    for way in range(0, 700, 5):
        for aside in range(-200, 201, 4):
            base.travelled, base.lateral = way / 1000, aside / 1000
            base.step(0.04)
            middle, presses = abs(base.lateral) < 0.006, base.travelled > TOUCHES_M + 0.001
            assert base.travelled <= HELD_M
            assert base.contact is (middle and presses)
            seen.add((middle, presses))
    assert len(seen) == 4, "a case is not looked at"


def test_controls_and_readings_are_converted(dock: Path) -> None:
    model = model_of(dock)
    assert model.steps == 20
    nobody: dict[str, Values] = {}
    first = model.step(0, nobody.get)
    assert first == {
        "base.travelled": (0,), "base.lateral": (120,), "base.bumper": (False,), "base.beacon": (True,), "base.contact": (False,),
    }  # fmt: skip
    for tick in range(25):
        given = model.step(tick, ordered(400).get)
    assert model.data.ctrl[0] == 0.4
    [travelled] = given["base.travelled"]
    assert travelled == round(1000 * float(model.data.qpos[0]))
    assert 350 < travelled < 400


def test_what_moves_can_be_taken_back(dock: Path) -> None:
    """As the shell's `undo` does."""
    model = model_of(dock)
    model.step(0, ordered(400).get)
    before = copy.deepcopy(model)
    after = [model.step(tick, ordered(800).get) for tick in range(5)]
    assert before.model is model.model
    assert [before.step(tick, ordered(800).get) for tick in range(5)] == after


def test_the_model_can_be_looked_at(dock: Path) -> None:
    staged = stage(dock)
    assert staged.pictures["solid"]().startswith("<svg")


MISFITS = {
    "no sensor": (PIN, "", "no sensor fills `base.contact`, which `supervisor.contact` takes", 'write `"base.contact" = {'),
    "no actuator": (SPEED, "", "no actuator takes `base.speed`, which `drive.speed_mm_s` gives", "`{ ignore = true }`"),
    "sensor's name": (WAY, WAY.replace("odometer", "odometre"), "the model has no sensor `odometre`", "did you mean `odometer`?"),
    "actuator's name": (SPEED, SPEED.replace("wheels", "legs"), "the model has no actuator `legs`", "it has wheels"),
    "unit": (WAY, WAY.replace('"m"', '"rad"'), "the sensor is in `m`, and never in `rad`", ""),
    "garbled unit": (WAY, WAY.replace('"m"', '"m per s"'), "`m per s` is no unit", ""),
    "no unit": (SPEED, SPEED.replace(", scale = 0.001", ""), "the actuator is in `m/s`, and `speed_mm_s` has no unit", "`scale = 0.001`"),
    "scale of a unit": (WAY, WAY.replace('unit = "m"', "scale = 2.0"), "`travelled_mm` is in `mm`, from which the factor follows", ""),
    "no scale": (SPEED, SPEED.replace("0.001", "0"), "a scale of 0 says nothing", ""),
    "control": (SPEED, SPEED.replace("0.001", "0.01"), "from -2 to 8, which takes -0.2 to 0.8", "`ctrlrange`"),
    "element": (ASIDE, ASIDE.replace(", element = 1", ""), "sensor `beacon` has 3 numbers", "`element = 0` takes the first"),
    "no element": (ASIDE, ASIDE.replace("1", "3"), "sensor `beacon` has 3 numbers", ""),
    "threshold": (PIN, PIN.replace(", over = 0.001", ""), "`base.contact` is true or false", "`over = 0.5`"),
    "two thresholds": (PIN, PIN.replace("over", "under = 1, over"), "`base.contact` is true or false", ""),
    "both": (STILL, STILL.replace("value", 'sensor = "pin", value'), "needs either `sensor` or `value`", ""),
    "neither": (STILL, STILL.replace("value = false", "over = 1"), "needs either `sensor` or `value`", ""),
    "value": (STILL, STILL.replace("false", "3"), "`value` is `3`, which is no bool", ""),
    "fault": ('{ actuator = "wheels", control = 0.0 }', '{ actuator = "wheels" }', "fault `wheels_stuck` needs", ""),
    "fault's actuator": ('{ actuator = "wheels", c', '{ actuator = "legs", c', "the model has no actuator `legs`", ""),
    "fault's field": ('field = "base.contact"', 'field = "base.contct"', "`base.contct` is no field", "did you mean `base.contact`?"),
    "fault's value": ('"base.contact", value = false', '"base.contact", value = 2', "`value` is `2`, which is no bool", ""),
    "keyframe": ('keyframe = "beside"', 'keyframe = "besides"', "the model has no keyframe `besides`", ""),
    "model": ('"robot.xml"', '"robot.xlm"', "the model `robot.xlm` cannot be read: there is no such file", ""),
    "tick": ("tick_ms = 40", "tick_ms = 5", "a tick of 5 ms is 2.5 of the model's steps of 2 ms", "timestep"),
}  # fmt: skip


@pytest.mark.parametrize("what", list(MISFITS))
def test_what_does_not_fit_is_told_at_its_line(what: str, dock: Path) -> None:
    before, after, message, help_ = MISFITS[what]
    changed(dock, "system.toml", (before, after))
    with pytest.raises(BadPlant) as caught:
        stage(dock)
    [diagnostic] = caught.value.diagnostics
    assert message in diagnostic.message
    assert any(help_ in said for said in diagnostic.help) or not help_
    source = caught.value.sources[diagnostic.primary.span.file]
    line = source.line(source.position(diagnostic.primary.span.start).line)
    place = {
        "keyframe": "keyframe",
        "model": "model",
        "tick": "model",
        "no sensor": "base.contact",
        "no actuator": "drive.speed",
        "fault": "wheels_stuck",
        "fault's actuator": "wheels_stuck",
        "fault's field": "pin_dead",
        "fault's value": "pin_dead",
    }
    assert place.get(what, before.split("=")[0].strip().strip('"')) in line


def test_a_model_that_mujoco_refuses_is_told(dock: Path) -> None:
    changed(dock, "robot.xml", ("<worldbody>", "<worldbod>"))
    with pytest.raises(BadPlant, match=r"the model `robot\.xml` cannot be read: XML"):
        stage(dock)


def test_what_a_joint_gives_hangs_on_whether_it_turns(dock: Path) -> None:
    slides, turns = ('type="slide" axis="1 0 0"', 'type="hinge" axis="0 0 1"')
    changed(dock, "robot.xml", (f'name="way" {slides}', f'name="way" {turns}'))
    changed(dock, "system.toml", (WAY, WAY.replace(', unit = "m"', "")))
    with pytest.raises(
        BadPlant, match="the sensor is in `rad`, and `travelled_mm` is in `mm`: one is not the other"
    ):
        stage(dock)


def leaf(c_type: str, members: tuple[str, ...] = ()) -> Leaf:
    """An output called `lamp`."""
    return Leaf("lamp", "output", "lamp", "lamp", c_type, members, None, None, "", 0, "")


@pytest.mark.parametrize(("c_type", "members"), [("bool", ()), ("uint8_t", ("dark", "lit"))])
def test_a_word_drives_by_its_own_control(c_type: str, members: tuple[str, ...], dock: Path) -> None:
    words = members or ("false", "true")
    model = model_of(dock).model
    buffer = Buffer(
        "a.lamp", "base.lamp", ("base", "lamp"), (leaf(c_type, members),), "a.lamp", gives=False, path=()
    )
    page = plant_page(description(dock / "system.toml"))
    binder = Binder(page, ("plant", "mujoco"), model)
    said = {"actuator": "wheels", "values": {words[0]: 0.0, words[1]: 0.5}}
    [binding] = binder.actuators(buffer, {"base.lamp": said})
    assert [binding.control(value) for value in (0, 1)] == [0.0, 0.5]
    assert binder.actuators(buffer, {"base.lamp": {"ignore": True}}) == []
    assert page.faults == []
    wrong = (
        ({words[0]: 0.0}, f"`values` lacks `{words[1]}`"),
        ({words[0]: 0.0, words[1]: 0.5, "dim": 1.0}, "`dim` is no value"),
    )
    for values, message in wrong:
        binder.actuators(buffer, {"base.lamp": {"actuator": "wheels", "values": values}})
        assert message in page.faults.pop().message
    binder.sensors(buffer, {"base.lamp": {"sensor": "pin", **({} if members else {"under": 0.5})}})
    assert bool(page.faults) == bool(members)


def test_a_reading_means_the_nearest_of_the_members(dock: Path) -> None:
    model = model_of(dock).model
    lit = leaf("uint8_t", ("dark", "dim", "lit"))
    buffer = Buffer("a.lamp", "base.lamp", ("base", "lamp"), (lit,), "a.lamp", gives=True, path=())
    page = plant_page(description(dock / "system.toml"))
    binder = Binder(page, ("plant", "mujoco"), model)
    [binding] = binder.sensors(
        buffer, {"base.lamp": {"sensor": "pin", "values": {"dark": 0, "lit": 2, "dim": 1}}}
    )
    edges = {-5.0: 0, 0.4: 0, 0.6: 1, 1.4: 1, 1.6: 2, 9.0: 2}
    assert {reading: binding.read([reading] * 9) for reading in edges} == edges
    binder.sensors(buffer, {"base.lamp": {"sensor": "pin", "values": {"dark": 0, "dim": 1}}})
    assert page.faults.pop().message == "`values` lacks `lit`"


def test_a_servo_at_a_tendon_is_in_metres() -> None:
    model = mujoco.MjModel.from_xml_string("""<mujoco><worldbody><body><joint name="j" type="slide"/><geom size="0.1"/></body>
      </worldbody><tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
      <actuator><position tendon="t"/><velocity tendon="t"/><motor tendon="t"/></actuator></mujoco>""")
    assert [driven_in(model, at) for at in range(3)] == ["m", "m/s", None]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (
            '"base.speed" = { motor = "wheels" }',
            "`plant.mujoco.actuators.base.speed.motor` means nothing here",
        ),
        ('"base.sped" = { actuator = "wheels" }', "`base.sped` is no end of a buffer that goes outside"),
        ('"base.speed" = { actuator = 3 }', "must be a text in quotes"),
    ],
)
def test_the_keys_of_a_model_are_checked(entry: str, message: str, dock: Path) -> None:
    changed(dock, "system.toml", (SPEED, entry))
    with pytest.raises(BadDescription) as caught:
        description(dock / "system.toml")
    assert message in str(caught.value)


def test_a_model_that_flies_apart_ends_the_run(dock: Path) -> None:
    changed(dock, "robot.xml", ('mass="3"', 'mass="0.001"'), ('kv="60"', 'kv="-1e9"'))
    model = model_of(dock)

    def fifty() -> None:
        for tick in range(50):
            model.step(tick, ordered(800).get)

    with pytest.raises(PlantFailed, match="the model became unstable in cycle"):
        fifty()


def test_faults_are_switched_and_what_stood_comes_back(dock: Path) -> None:
    [model] = stage(dock).outside
    assert isinstance(model, BoundModel)
    assert model.faults == ("wheels_stuck", "pin_dead")
    for tick in range(10):
        model.step(tick, ordered(400).get)
    model.switch("wheels_stuck", on=True)
    copied = copy.deepcopy(model)
    for tick in range(10):
        model.step(tick, ordered(400).get)
    stuck = float(model.data.qpos[0])
    model.switch("wheels_stuck", on=False)
    for tick in range(10):
        model.step(tick, ordered(400).get)
    assert float(model.data.qpos[0]) > stuck + 0.1
    assert copied.on == {"wheels_stuck"}
    for dead in (True, False):
        model.data.qpos[2] = 0.02
        model.switch("pin_dead", on=dead)
        assert model.step(0, ordered(0).get)["base.contact"] == (not dead,)


def test_a_plant_in_python_is_switched_likewise(dock: Path) -> None:
    system = description(dock / "system.toml")
    [plant] = load(system, signatures(system)).outside
    assert isinstance(plant, BoundPlant)
    plant.switch("wheel_slips", on=True)
    assert plant.faults == ("wheel_slips",)
    assert plant.plant.wheel_slips is True
