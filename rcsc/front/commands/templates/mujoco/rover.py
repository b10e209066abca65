"""The plant: the rover of `rover.xml` in MuJoCo. What it knows it reads from sensors; what it does it does by the torque of its wheels.

Attributes are the ends of `[buffers]` that begin with `rover`.
"""

from pathlib import Path
from typing import Annotated, Any

import mujoco

from rcsc.run.plant import Fault, Range
from rcsc.run.plant.models.space import ModelSpace

MODEL = Path(__file__).with_name("rover.xml")
FAR_M = 2.0


class Rover:
    """A rover that rolls towards its charger, presses its plate and rolls away."""

    speed: Annotated[int, Range(-200, 200)] = 0
    range: Annotated[float, Range(0, FAR_M, "m")] = FAR_M
    contact: Annotated[float, Range(0, 100)] = 0.0
    motors_dead: Fault = False

    def __init__(self) -> None:
        """Lays everything at rest on the floor."""
        self.model: Any = mujoco.MjModel.from_xml_path(str(MODEL))
        self.data: Any = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self._sense()

    def step(self, seconds: float) -> None:
        """One tick: the wheels are driven as ordered, physics runs, sensors are read."""
        self.data.ctrl[:] = 0.0 if self.motors_dead else self.speed / 1000
        mujoco.mj_step(self.model, self.data, nstep=round(seconds / self.model.opt.timestep))
        self._sense()

    def _sense(self) -> None:
        seen = float(self.data.sensor("range").data[0])
        self.range = FAR_M if seen < 0 else min(seen, FAR_M)  # -1: nothing is in sight
        self.contact = float(self.data.sensor("touch").data[0])

    def space(self) -> ModelSpace:
        """How it looks, for the studio's view in space."""
        return ModelSpace(self.model, self.data)

    def __deepcopy__(self, memo: dict[int, Any]) -> "Rover":
        """Another rover in the same state: for the shell's undo. The model does not change."""
        other = Rover()
        other.__dict__.update(
            {name: value for name, value in self.__dict__.items() if name not in {"model", "data"}}
        )
        mujoco.mj_copyData(other.data, self.model, self.data)
        return other
