"""The plant of a model: controls from the levels' buffers, steps of MuJoCo, readings to the levels' buffers.

In: a plant of a description that names a model. Out: a `BoundModel`, which stands outside the levels.
"""

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from rcsc.base.host.described import Document
from rcsc.base.host.files.plain import finite
from rcsc.run.plant.bind import BadPlant, PlantFailed, buffers_of, parties_of, plant_page
from rcsc.run.plant.models.bindings import ActuatorBinding, Binder, FaultBinding, SensorBinding, ends
from rcsc.run.plant.models.solid import View, solid
from rcsc.run.plant.models.space import ModelSpace
from rcsc.run.plant.staged import Setup, Staged
from rcsc.run.plant.values import BadValue
from rcsc.run.signature import Leaf, Value, Values

KEPT = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""What of a model's state its next step is made of, and nothing that it only computes."""
UNSTABLE = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


@dataclass(slots=True)
class BoundModel:
    """A simulated model: `rcsc.run.system.Outside`.

    Attributes:
        model: An `MjModel`; `data` its `MjData`.
        steps: Of the model, in a tick.
        takes: Buffers of the levels, and what they drive; `gives` those that sensors fill.
        wrong: What goes wrong while a fault is on, by the fault; `on` the faults that are.
    """

    model: Any
    data: Any
    steps: int
    takes: tuple[tuple[str, tuple[ActuatorBinding, ...]], ...]
    gives: tuple[tuple[str, tuple[SensorBinding, ...]], ...]
    wrong: Mapping[str, FaultBinding] = field(default_factory=dict)
    on: frozenset[str] = frozenset()

    @property
    def faults(self) -> tuple[str, ...]:
        """The names of the faults that the description declares."""
        return tuple(self.wrong)

    def switch(self, fault: str, *, on: bool) -> None:
        """Switch a fault on or off."""
        self.on = self.on | {fault} if on else self.on - {fault}

    def __deepcopy__(self, memo: dict[int, Any]) -> "BoundModel":
        """Copy the data alone: the model and its bindings never change."""
        return BoundModel(
            self.model, copy.copy(self.data), self.steps, self.takes, self.gives, self.wrong, self.on
        )

    def step(self, tick: int, latest: Callable[[str], Values | None]) -> Mapping[str, Values]:
        """Run one tick.

        Raises:
            PlantFailed: The model became unstable, or a reading cannot be held.
        """
        for name, actuators in self.takes:
            values = latest(name)
            for actuator in actuators if values is not None else ():
                assert values is not None
                self.data.ctrl[actuator.at] = actuator.control(values[actuator.place])
        wrong = [self.wrong[name] for name in sorted(self.on)]
        for fault in wrong:
            if fault.at >= 0:
                self.data.ctrl[fault.at] = fault.control
        mujoco.mj_step(self.model, self.data, nstep=self.steps)
        mujoco.mj_forward(self.model, self.data)  # readings are of the end of the last step
        if any(self.data.warning[int(kind)].number for kind in UNSTABLE):
            raise PlantFailed(f"the model became unstable in cycle {tick + 1}: a shorter `timestep` may help")
        still = {fault.field: fault.value for fault in wrong}
        return {
            name: tuple(self._read(tick, sensor, still) for sensor in sensors) for name, sensors in self.gives
        }

    def space(self) -> ModelSpace:
        """Return the scene of the model."""
        return ModelSpace(self.model, self.data)

    def state(self) -> dict[str, Any]:
        """Return the state for the model's next step, in plain values, without the faults that are on."""
        held = np.zeros(mujoco.mj_stateSize(self.model, KEPT))
        mujoco.mj_getState(self.model, self.data, held, KEPT)
        return {"state": held.tolist()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Put back a state.

        Raises:
            ValueError: The state is none of this model.
        """
        held = state.get("state")
        size = mujoco.mj_stateSize(self.model, KEPT)
        numbers = isinstance(held, list) and all(type(value) in (int, float) for value in held)
        if len(state) != 1 or not numbers or len(held or ()) != size or not finite(held):
            raise ValueError(f"the model's state has {size} numbers")
        mujoco.mj_setState(self.model, self.data, np.array(held, dtype=np.float64), KEPT)
        mujoco.mj_forward(self.model, self.data)

    def _read(self, tick: int, sensor: SensorBinding, still: Mapping[str, Value]) -> Value:
        if sensor.end in still:
            return still[sensor.end]
        try:
            return sensor.read(self.data.sensordata)
        except BadValue as error:
            raise PlantFailed(f"the plant's `{sensor.end}` {error.args[-1]}, in cycle {tick + 1}") from error


def staged(setup: Setup) -> Staged:
    """Stage the model as the plant.

    Raises:
        BadPlant: The model cannot be read, or does not fit; all that does not is told.
    """
    if setup.answers_only:
        return Staged()
    mujoco.set_mju_user_warning(_quiet)  # else it writes a file into the folder one stands in
    page = plant_page(setup.system)
    model = _model(page, setup)
    data = mujoco.MjData(model)
    _begin(page, setup, model, data)
    steps = _steps(page, setup, model)
    binder = Binder(page, setup.spec.path, model)
    takes, gives = [], []
    filled: dict[str, Leaf] = {}
    for buffer in buffers_of(setup.system, setup.signs, parties_of(setup.system, setup.signs, setup.spec)):
        if buffer.gives:
            filled |= dict(ends(buffer))
            gives.append((buffer.name, tuple(binder.sensors(buffer, setup.spec.sensors))))
        else:
            takes.append((buffer.name, tuple(binder.actuators(buffer, setup.spec.actuators))))
    wrong = {fault.name: fault for fault in binder.faults(setup.spec.faults, filled)}
    if page.faults:
        raise page.bad(BadPlant)
    mujoco.mj_forward(model, data)
    plant = BoundModel(model, data, steps, tuple(takes), tuple(gives), wrong)
    return Staged((plant,), pictures={"solid": lambda: solid(model, plant.data, _view(model))})


def _quiet(_warning: str) -> None:
    """Drop a warning: its cause is seen in the data after each step."""


def _model(page: Document, setup: Setup) -> Any:
    """Load the model. Raises BadPlant: it cannot be read."""
    path = setup.spec.model or Path()
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        why = "there is no such file" if not path.is_file() else str(error).splitlines()[0]
        page.wrong((*setup.spec.path, "model"), f"the model `{path.name}` cannot be read: {why}")
        raise page.bad(BadPlant) from error


def _begin(page: Document, setup: Setup, model: Any, data: Any) -> None:
    """Put the model where it starts."""
    name = setup.spec.keyframe
    if not name:
        return
    key = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, name))
    if key < 0:
        page.wrong((*setup.spec.path, "keyframe"), f"the model has no keyframe `{name}`")
        return
    mujoco.mj_resetDataKeyframe(model, data, key)


def _steps(page: Document, setup: Setup, model: Any) -> int:
    """Steps of the model in a tick, a whole number."""
    step_s = Fraction(str(float(model.opt.timestep)))
    steps = Fraction(setup.system.tick_ms, 1000) / step_s
    if steps.denominator != 1 or steps < 1:
        page.wrong(
            (*setup.spec.path, "model"),
            f"a tick of {setup.system.tick_ms} ms is {float(steps):g} of the model's steps of {float(step_s) * 1000:g} ms: no whole number",
            f'write `<option timestep="{setup.system.tick_ms / 20_000:g}"/>` in the model',
        )
        return 1
    return int(steps)


def _view(model: Any) -> View:
    """Return a view of the whole model."""
    x, y, z = (float(value) for value in model.stat.center)
    far = 1.6 * max(float(model.stat.extent), 0.2)
    return View((x + 0.6 * far, y - far, z + 0.7 * far), (x, y, z), field_deg=44.0)
