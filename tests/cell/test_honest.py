"""What would be cheating in the physical cell, looked for in the model, in the code and in runs.

`rcsc_cell.cell.physical` lists it.
"""

import ast
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

from rcsc.run.plant.models.space import ModelSpace
from rcsc_cell.cell.mujoco_model import mjcf
from rcsc_cell.cell.physical import Physical
from rcsc_cell.cell.plant import Grip, Plant
from rcsc_cell.cell.reach import home
from rcsc_cell.cell.ready import Backend, lying, plant
from rcsc_cell.database.ask import Database
from rcsc_cell.vision.flood import Features
from tests.support.cells import SYSTEM, database, prepare

CELL = Path(__file__).parents[2] / "sim" / "rcsc_cell"
FIRST_ROW = "command,part,source,dest,end_at\nMOVE,BOXT (2),BUFFER,FIX-MAC1,\n"


@pytest.fixture(scope="module")
def held() -> Database:
    return database()


@pytest.fixture(scope="module")
def model(held: Database) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(mjcf(held, [part.body for part in lying(held)]))


# --- the model ---


def test_nothing_is_welded_and_nothing_sticks(model: mujoco.MjModel) -> None:
    joined = [(int(kind), model.equality(at).name) for at, kind in enumerate(model.eq_type)]
    assert [kind for kind, _ in joined] == [
        int(mujoco.mjtEq.mjEQ_JOINT)
    ]  # the rack between the fingers, and no more
    fingers = {model.joint(f"finger_{side}").id for side in ("left", "right")}
    assert {int(model.eq_obj1id[0]), int(model.eq_obj2id[0])} == fingers
    assert not any(model.body_mocapid >= 0)
    assert not any(
        int(kind) == int(mujoco.mjtTrn.mjTRN_BODY) for kind in model.actuator_trntype
    )  # adhesion acts on a body


def test_parts_are_free_and_heavy(model: mujoco.MjModel, held: Database) -> None:
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.81]
    assert model.opt.disableflags == 0
    for at, part in enumerate(lying(held)):
        body = model.body(f"part{at}")
        assert model.joint(f"part{at}").type[0] == int(mujoco.mjtJoint.mjJNT_FREE)
        assert model.body_gravcomp[body.id] == 0.0
        assert model.dof_damping[model.joint(f"part{at}").dofadr[0]] == 0.0
        volume = np.prod(np.array(part.body.size_mm) / 1000)
        assert body.mass[0] == pytest.approx(volume * 2700.0)


def test_drives_move_joints_of_the_arm_the_hand_and_the_vise_only(model: mujoco.MjModel) -> None:
    moved = set()
    for at, kind in enumerate(model.actuator_trntype):
        number = int(model.actuator_trnid[at][0])
        if int(kind) == int(mujoco.mjtTrn.mjTRN_TENDON):
            moved.add(model.tendon(number).name)
        else:
            moved.add(model.joint(number).name)
    assert moved == {*(f"j{at}" for at in range(1, 7)), "opening", "jaw_left", "jaw_right"}


# --- what is written ---


def test_a_run_is_its_controls_and_nothing_else(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The controls of every step, given to a cell that nobody else touches, move every part to the same bit."""
    controls: list[np.ndarray] = []
    step = mujoco.mj_step

    def watched(model: mujoco.MjModel, data: mujoco.MjData) -> None:
        controls.append(data.ctrl.copy())
        step(model, data)

    monkeypatch.setattr(mujoco, "mj_step", watched)
    (tmp_path / "move.csv").write_text(FIRST_ROW, encoding="utf-8")
    made: list[Plant] = []

    def outside(held: Database) -> list[Plant]:
        made.append(plant(held))
        return made

    run = prepare(SYSTEM, str(tmp_path / "move.csv"), "c", outside)
    results = list(run.steps())
    assert [result.state for result in results] == ["done"]
    real = made[0].mechanism
    assert isinstance(real, Physical)
    start = home(run.database)
    assert start is not None
    again = Physical(run.database, real.bodies, start)
    moved = 0.0
    for at, ctrl in enumerate(controls, 1):
        again.data.ctrl[:] = ctrl
        step(again.model, again.data)
        if at % 20 == 0:
            mujoco.mj_forward(again.model, again.data)
    assert again.data.qpos.tolist() == real.data.qpos.tolist()
    moved = float(np.linalg.norm(np.array(real.parts()[0].at_mm) - np.array(real.bodies[0].at_mm)))
    assert moved > 300.0


def test_nothing_writes_where_a_part_is_after_the_first_cycle() -> None:
    """Positions, speeds and outside forces are written where a cell begins and where a stopped one is put back; nowhere else.

    A cell without physics is shown by a model that nothing steps: there its own places are put.
    """
    physics, shown = ("physical.py", {"__init__", "restore"}), ("space.py", {"_put"})
    found = set()
    for path in CELL.rglob("*.py"):
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                for name in _written(function):
                    found.add((path.name, function.name, name))
    assert {(file, name) for file, _, name in found} == {(file, "qpos") for file, _ in (physics, shown)}
    for file, allowed in (physics, shown):
        assert {function for where, function, _ in found if where == file} <= allowed


def test_to_look_at_a_cell_changes_nothing_in_it() -> None:
    backends: tuple[Backend, ...] = ("mujoco", "kinematic")
    for backend in backends:
        cell = plant(database(), backend)
        space = cell.space()
        assert isinstance(space, ModelSpace) is (backend == "mujoco"), (
            "the model that is put is never that of physics"
        )
        before = cell.state()
        assert space.shapes
        assert len(space.poses()) == 7 * len(space.bodies)
        assert cell.state() == before


def _written(function: ast.FunctionDef) -> set[str]:
    state = {*"qpos qvel qacc xfrc_applied qfrc_applied mocap_pos mocap_quat xpos eq_active".split()}
    targets = [
        target
        for node in ast.walk(function)
        if isinstance(node, (ast.Assign, ast.AugAssign))
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
    ]
    return {
        node.attr
        for target in targets
        for node in ast.walk(target)
        if isinstance(node, ast.Attribute) and node.attr in state
    }


# --- what is read ---


@pytest.mark.parametrize("file", ["plant.py", "robot.py", "fixture.py", "reach.py", "arm.py"])
def test_controllers_never_ask_where_a_part_is(file: str) -> None:
    names = {
        node.attr
        for node in ast.walk(ast.parse((CELL / "cell" / file).read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute)
    }
    assert not names & {"parts", "touching", "bodies", "data", "model"}


def test_the_image_processing_knows_no_physics() -> None:
    for file in ("blobs.py", "flood.py", "line.py", "optics.py"):
        tree = ast.parse((CELL / "vision" / file).read_text(encoding="utf-8"))
        imported = {
            name.name if isinstance(node, ast.Import) else node.module or ""
            for node in ast.walk(tree)
            if isinstance(node, (ast.Import, ast.ImportFrom))
            for name in node.names
        }
        assert not any(
            name.startswith(
                ("mujoco", "rcsc_cell.cell.physical", "rcsc_cell.cell.plant", "rcsc_cell.cell.mujoco_model")
            )
            for name in imported
        ), (file, imported)


def test_what_the_camera_cannot_see_is_not_found(held: Database) -> None:
    """A part that throws back no light is not there for vision, though its pose is what it was."""
    made = _above_the_buffer(held)
    wanted = held.objects["tbox"]
    length_mm, width_mm, _ = held.sizes[wanted]
    look = partial(made.flood, Features(length_mm, width_mm), float(held.part(wanted)[1]))
    seen = look()
    assert seen is not None
    for at in range(len(made.bodies)):
        made.model.geom_group[made.model.geom(f"part{at}").id] = 3
    assert look() is None


def test_a_run_needs_no_true_pose(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def refuse(self: Physical) -> None:  # noqa: ARG001  # what a method has
        raise AssertionError("somebody asked where the parts are")

    monkeypatch.setattr(Physical, "parts", refuse)
    monkeypatch.setattr(Physical, "touching", refuse)
    (tmp_path / "move.csv").write_text(FIRST_ROW, encoding="utf-8")
    run = prepare(SYSTEM, str(tmp_path / "move.csv"), "c", lambda held: [plant(held)])
    assert [step.state for step in run.steps()] == ["done"]


def _above_the_buffer(held: Database) -> Physical:
    from rcsc_cell.cell.arm import solve
    from rcsc_cell.database.pose import pose_of

    start = home(held)
    assert start is not None
    look = held.place(held.locations["BUFFER"])[3]
    first = int(held.route(int(look), 0)[3])
    pose = pose_of([float(value) for value in held.point(first)[1:10]])
    assert pose is not None
    joints = solve(pose, (1.4, *start[1:]))
    assert joints is not None
    made = Physical(held, [part.body for part in lying(held)], joints)
    made.advance(joints, Grip(False, 0.0, 0.0, 0.0), (20.0, 20.0))
    return made
