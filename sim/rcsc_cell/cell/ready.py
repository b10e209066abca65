"""A plant ready for its first cycle, made of the database."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rcsc_cell.cell.kinematic import Kinematic
from rcsc_cell.cell.mujoco_model import STEP_S, Body
from rcsc_cell.cell.plant import Mechanism, Plant
from rcsc_cell.cell.reach import home
from rcsc_cell.cell.robot import Robot
from rcsc_cell.database.ask import Database
from rcsc_cell.database.build import BadData
from rcsc_cell.database.pose import about_z

Backend = Literal["mujoco", "kinematic"]


@dataclass(frozen=True, slots=True)
class Lying:
    """A part at its first place: its object and its body."""

    object: int
    body: Body


def lying(database: Database) -> tuple[Lying, ...]:
    """Return the parts of the database at their places."""
    return tuple(
        Lying(part.object, Body(size, (part.x_mm, part.y_mm, part.z_mm + size[2] / 2), about_z(part.yaw_deg)))
        for part in database.parts
        for size in [database.sizes[part.object]]
    )


def plant(
    database: Database,
    backend: Backend = "mujoco",
    parts: Sequence[Lying] | None = None,
    seed: int = 0,
    step_s: float = STEP_S,
) -> Plant:
    """Make a plant whose robot is at home.

    Args:
        database: The cell.
        backend: Physics, or kinematics alone.
        parts: What lies about; the database's parts by default.
        seed: Of the sensor's noise.
        step_s: One step of physics.

    Raises:
        BadData: The robot cannot be at its home.
    """
    start = home(database)
    if start is None:
        raise BadData(("the robot cannot be at its home",))
    here = lying(database) if parts is None else tuple(parts)
    bodies = [part.body for part in here]
    mechanism: Mechanism
    if backend == "mujoco":
        from rcsc_cell.cell.physical import Physical  # MuJoCo is loaded only where it is asked for

        mechanism = Physical(database, bodies, start, seed, step_s)
    else:
        mechanism = Kinematic(database, bodies, start, seed)
    return Plant(database, mechanism, Robot(start), tuple(part.object for part in here))
