"""Sensors and actuators of a model, each bound to a field of a buffer: names, elements, units and ranges checked before anything moves.

In: a model, a description and signatures. Out: `SensorBinding` and `ActuatorBinding` in the order of the buffers' leaves, or all
that does not fit, each at its line of the description.

Source, of the units of sensors and actuators by their types: MuJoCo documentation, XML reference, `sensor` and `actuator`. The model
itself has none: SI, as its author is taken to mean it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mujoco

from rcsc.base.host.described import Document, KeyPath, nearest
from rcsc.run.plant import fields
from rcsc.run.plant.bind import Buffer
from rcsc.run.plant.units import Factor, factor
from rcsc.run.plant.values import FlagLink, MemberLink, NumberLink
from rcsc.run.signature import Leaf, Value

ONE = Factor(Fraction(1))
BY_HAND = 'write the plant in Python: `[plant] python = "plant.py"`'


@dataclass(frozen=True, slots=True)
class SensorBinding:
    """The source of a leaf from outside.

    Attributes:
        end: The field.
        at: Where the reading stands in `sensordata`; -1 for `value`, which stands still.
        link: To the leaf; None for a bool that is true beyond a threshold.
        over: A bool is true above it; `under` below it.
        values: The reading that stands for each member of an enumeration; the nearest is taken.
    """

    end: str
    at: int
    link: NumberLink | None = None
    over: float | None = None
    under: float | None = None
    value: Value = 0
    values: tuple[float, ...] = ()

    def read(self, readings: Sequence[float]) -> Value:
        """Return the leaf's value.

        Raises:
            BadValue: The leaf cannot hold it.
        """
        if self.at < 0:
            return self.value
        reading = float(readings[self.at])
        if self.values:
            return min(range(len(self.values)), key=lambda member: abs(self.values[member] - reading))
        if self.link is None:
            return reading > self.over if self.over is not None else reading < (self.under or 0.0)
        [value] = self.link.given(reading)
        return value


@dataclass(frozen=True, slots=True)
class ActuatorBinding:
    """The actuator that a leaf of a level drives.

    Attributes:
        at: Of the control.
        place: Of the leaf in its buffer.
        link: From the leaf; None where `values` has a control for each of its members, or for false and true.
    """

    at: int
    place: int
    link: NumberLink | None = None
    values: tuple[float, ...] = ()

    def control(self, value: Value) -> float:
        """Return the control for a value."""
        return self.values[int(value)] if self.link is None else float(self.link.taken(iter((value,))))


@dataclass(frozen=True, slots=True)
class FaultBinding:
    """The effect of a fault while it is on: a control stands still, or a field from outside does.

    Attributes:
        name: Of the fault.
        at: Of the control; -1 where it is a field.
        control: What the control then is.
        field: The end of the field; empty where it is a control.
        value: What the field then holds.
    """

    name: str
    at: int = -1
    control: float = 0.0
    field: str = ""
    value: Value = 0


@dataclass(slots=True)
class Binder:
    """Binds fields to a model, and notes what does not fit.

    Attributes:
        path: Of the plant in the description.
    """

    page: Document
    path: KeyPath
    model: Any

    def sensors(self, buffer: Buffer, entries: Mapping[str, Mapping[str, Any]]) -> list[SensorBinding]:
        """Return the bindings of the leaves of a buffer from outside, those that fit."""
        bound = []
        for end, leaf in ends(buffer):
            where = (*self.path, "sensors", end)
            if end not in entries:
                self.page.wrong(
                    buffer.path,
                    f"no sensor fills `{end}`, which `{buffer.variable}` takes",
                    f'write `"{end}" = {{ sensor = "..." }}`, or `{{ value = ... }}` where it stands still',
                )
                continue
            binding = self._sensor(end, leaf, entries[end], where)
            if binding is not None:
                bound.append(binding)
        return bound

    def actuators(self, buffer: Buffer, entries: Mapping[str, Mapping[str, Any]]) -> list[ActuatorBinding]:
        """Return the bindings of the leaves of a level's buffer, those that drive something and fit."""
        bound = []
        for place, (end, leaf) in enumerate(ends(buffer)):
            where = (*self.path, "actuators", end)
            if end not in entries:
                self.page.wrong(
                    buffer.path,
                    f"no actuator takes `{end}`, which `{buffer.variable}` gives",
                    f'write `"{end}" = {{ actuator = "..." }}`, or `{{ ignore = true }}`',
                )
                continue
            if entries[end].get("ignore"):
                continue
            binding = self._actuator(place, leaf, entries[end], where)
            if binding is not None:
                bound.append(binding)
        return bound

    def faults(
        self, entries: Mapping[str, Mapping[str, Any]], filled: Mapping[str, Leaf]
    ) -> list[FaultBinding]:
        """Return the bindings of the faults, those that fit.

        Args:
            entries: By name.
            filled: The fields from outside, by their ends.
        """
        bindings = (
            self._fault(name, entry, filled, (*self.path, "faults", name)) for name, entry in entries.items()
        )
        return [binding for binding in bindings if binding is not None]

    def _fault(
        self, name: str, entry: Mapping[str, Any], filled: Mapping[str, Leaf], where: KeyPath
    ) -> FaultBinding | None:
        if entry.keys() == {"actuator", "control"}:
            at = self._named(mujoco.mjtObj.mjOBJ_ACTUATOR, "actuator", entry["actuator"], where)
            return None if at is None else FaultBinding(name, at, float(entry["control"]))
        if entry.keys() != {"field", "value"}:
            self.page.wrong(where, f"fault `{name}` needs `actuator` and `control`, or `field` and `value`")
            return None
        end = str(entry["field"])
        if end not in filled:
            self.page.wrong(
                (*where, "field"), f"`{end}` is no field that the model fills", *nearest(end, list(filled))
            )
            return None
        still = self._still(end, filled[end], entry["value"], where)
        return None if still is None else FaultBinding(name, field=end, value=still.value)

    # --- sensors ---

    def _sensor(self, end: str, leaf: Leaf, entry: Mapping[str, Any], where: KeyPath) -> SensorBinding | None:
        if ("sensor" in entry) == ("value" in entry):
            self.page.wrong(where, f"`{end}` needs either `sensor` or `value`")
            return None
        if "value" in entry:
            return self._still(end, leaf, entry["value"], where)
        sensor = self._named(mujoco.mjtObj.mjOBJ_SENSOR, "sensor", entry["sensor"], where)
        if sensor is None:
            return None
        size, element = int(self.model.sensor_dim[sensor]), int(entry.get("element", 0))
        if element >= size or ("element" not in entry and size > 1):
            self.page.wrong(
                where, f"sensor `{entry['sensor']}` has {size} numbers", "`element = 0` takes the first"
            )
            return None
        at = int(self.model.sensor_adr[sensor]) + element
        if leaf.c_type == "bool":
            return self._threshold(end, at, entry, where)
        if leaf.members:
            if "values" not in entry:
                self.page.wrong(
                    where,
                    f"a sensor gives numbers, and `{leaf.name}` is one of {', '.join(leaf.members)}",
                    f"`values = {{ {leaf.members[0]} = 0.0, ... }}` says which reading is which",
                    BY_HAND,
                )
                return None
            values = self._values(leaf.members, entry, where)
            return None if values is None else SensorBinding(end, at, values=values)
        by = self._factor(leaf, entry, sensed_in(self.model, sensor), "sensor", where)
        return None if by is None else SensorBinding(end, at, NumberLink(leaf, False, by))

    def _still(self, end: str, leaf: Leaf, value: object, where: KeyPath) -> SensorBinding | None:
        """Bind a field that holds one value."""
        link = (
            FlagLink()
            if leaf.c_type == "bool"
            else MemberLink(leaf, fields.Members(None))
            if leaf.members
            else NumberLink(leaf, False, ONE)
        )
        try:
            [held] = link.given(value)
        except ValueError as error:
            self.page.wrong(where, f"`value` {error.args[-1]}")
            return None
        return SensorBinding(end, -1, value=held)

    def _threshold(self, end: str, at: int, entry: Mapping[str, Any], where: KeyPath) -> SensorBinding | None:
        if ("over" in entry) == ("under" in entry):
            self.page.wrong(
                where,
                f"`{end}` is true or false, and a sensor gives a number",
                "`over = 0.5` makes it true above 0.5, `under = 0.5` below",
            )
            return None
        return SensorBinding(end, at, None, entry.get("over"), entry.get("under"))

    # --- actuators ---

    def _actuator(
        self, place: int, leaf: Leaf, entry: Mapping[str, Any], where: KeyPath
    ) -> ActuatorBinding | None:
        if "actuator" not in entry:
            self.page.wrong(where, f"`{where[-1]}` needs an `actuator`, or `ignore = true`")
            return None
        actuator = self._named(mujoco.mjtObj.mjOBJ_ACTUATOR, "actuator", entry["actuator"], where)
        if actuator is None:
            return None
        words = leaf.members or (("false", "true") if leaf.c_type == "bool" else ())
        if words:
            values = self._values(words, entry, where)
            binding = None if values is None else ActuatorBinding(actuator, place, None, values)
        else:
            by = self._factor(leaf, entry, driven_in(self.model, actuator), "actuator", where)
            binding = None if by is None else ActuatorBinding(actuator, place, NumberLink(leaf, False, by))
        if binding is not None:
            self._check_control(binding, leaf, entry, where)
        return binding

    def _values(
        self, words: Sequence[str], entry: Mapping[str, Any], where: KeyPath
    ) -> tuple[float, ...] | None:
        """Return the control, or the reading, of each member."""
        values = entry.get("values", {})
        for word in values:
            if word not in words:
                self.page.wrong(
                    (*where, "values", word),
                    f"`{word}` is no value of the variable",
                    *nearest(word, list(words)),
                )
        missing = [word for word in words if word not in values]
        if missing:
            self.page.wrong(
                where,
                f"`values` lacks {', '.join(f'`{word}`' for word in missing)}",
                f"write `values = {{ {missing[0]} = 0.0, ... }}`",
            )
        return None if missing else tuple(float(values[word]) for word in words)

    def _check_control(
        self, binding: ActuatorBinding, leaf: Leaf, entry: Mapping[str, Any], where: KeyPath
    ) -> None:
        """Note controls beyond the range of the model, which would cut them without a word."""
        if not self.model.actuator_ctrllimited[binding.at]:
            return
        edges = binding.values or tuple(binding.control(edge) for edge in (leaf.low or 0, leaf.high or 0))
        low, high = (float(bound) for bound in self.model.actuator_ctrlrange[binding.at])
        if min(edges) < low - 1e-9 or max(edges) > high + 1e-9:
            as_it_is = leaf.unit and not {"unit", "scale", "values"} & entry.keys()
            drives = (
                f"`{leaf.name}` drives actuator `{entry['actuator']}` from {min(edges):g} to {max(edges):g}"
            )
            self.page.wrong(
                where,
                f"{drives}, which takes {low:g} to {high:g}",
                *([f'say what the control is in, if not `{leaf.unit}`: `unit = "..."`'] if as_it_is else []),
                "widen the model's `ctrlrange`, or narrow the variable's range",
            )

    # --- both ---

    def _named(self, kind: Any, what: str, name: object, where: KeyPath) -> int | None:
        """Return the place of a thing in the model."""
        at = int(mujoco.mj_name2id(self.model, kind, str(name)))
        if at >= 0:
            return at
        count = self.model.nsensor if what == "sensor" else self.model.nu
        names = [mujoco.mj_id2name(self.model, kind, place) or "" for place in range(count)]
        known = [name for name in names if name]
        self.page.wrong(
            (*where, what),
            f"the model has no {what} `{name}`",
            *(nearest(str(name), known) or ((f"it has {', '.join(known)}",) if known else ())),
        )
        return None

    def _factor(
        self, leaf: Leaf, entry: Mapping[str, Any], natural: str | None, what: str, where: KeyPath
    ) -> Factor | None:
        """Return the factor from the model's unit to the variable's; None where they do not fit."""
        unit = entry.get("unit")
        try:
            if unit is not None and natural is not None and factor(unit, natural) is None:
                self.page.wrong((*where, "unit"), f"the {what} is in `{natural}`, and never in `{unit}`")
                return None
            if "scale" in entry:
                return self._scaled(leaf, entry, where)
            ours = unit or natural or leaf.unit
            if unit is None and not leaf.unit and ours:
                self.page.wrong(
                    where,
                    f"the {what} is in `{ours}`, and `{leaf.name}` has no unit",
                    f"`scale = 1000.0` says how many of the variable's one `{ours}` is"
                    if what == "sensor"
                    else f"`scale = 0.001` says how many `{ours}` one of the variable's is",
                )
                return None
            by = factor(ours, leaf.unit)
        except ValueError as error:
            self.page.wrong((*where, "unit"), str(error))
            return None
        if by is None:
            variable = f"is in `{leaf.unit}`" if leaf.unit else "has no unit"
            self.page.wrong(
                where, f"the {what} is in `{ours}`, and `{leaf.name}` {variable}: one is not the other"
            )
        return by

    def _scaled(self, leaf: Leaf, entry: Mapping[str, Any], where: KeyPath) -> Factor | None:
        """Return a written factor: only for a variable without a unit, for any other has one of its own."""
        if leaf.unit:
            self.page.wrong(
                (*where, "scale"),
                f"`{leaf.name}` is in `{leaf.unit}`, from which the factor follows",
                "write `unit` instead of `scale`",
            )
            return None
        scale = Fraction(str(entry["scale"]))
        if scale == 0:
            self.page.wrong((*where, "scale"), "a scale of 0 says nothing")
            return None
        return Factor(scale) if where[-2] == "sensors" else Factor(1 / scale)


def ends(buffer: Buffer) -> list[tuple[str, Leaf]]:
    """Return each leaf with its far end."""
    variable = buffer.variable.partition(".")[2]
    return [(f"{buffer.end}{leaf.name.removeprefix(variable)}", leaf) for leaf in buffer.leaves]


# --- what a model measures in ---

SENSED = {
    "mjSENS_TOUCH": "N",
    "mjSENS_ACCELEROMETER": "m/s^2",
    "mjSENS_VELOCIMETER": "m/s",
    "mjSENS_GYRO": "rad/s",
    "mjSENS_FORCE": "N",
    "mjSENS_TORQUE": "N*m",
    "mjSENS_RANGEFINDER": "m",
    "mjSENS_TENDONPOS": "m",
    "mjSENS_TENDONVEL": "m/s",
    "mjSENS_BALLANGVEL": "rad/s",
    "mjSENS_FRAMEPOS": "m",
    "mjSENS_FRAMELINVEL": "m/s",
    "mjSENS_FRAMEANGVEL": "rad/s",
    "mjSENS_FRAMELINACC": "m/s^2",
    "mjSENS_FRAMEANGACC": "rad/s^2",
    "mjSENS_SUBTREECOM": "m",
    "mjSENS_SUBTREELINVEL": "m/s",
    "mjSENS_GEOMDIST": "m",
    "mjSENS_CLOCK": "s",
}
"""Of sensors whose unit does not hang on what they are attached to."""
OF_JOINT = {
    "mjSENS_JOINTPOS": ("m", "rad"),
    "mjSENS_JOINTVEL": ("m/s", "rad/s"),
    "mjSENS_JOINTLIMITPOS": ("m", "rad"),
    "mjSENS_JOINTLIMITVEL": ("m/s", "rad/s"),
    "mjSENS_JOINTACTFRC": ("N", "N*m"),
}
"""Of sensors at a joint: one that slides, one that turns."""


def sensed_in(model: Any, sensor: int) -> str | None:
    """Return the unit of a sensor; None where its type has none."""
    kind = mujoco.mjtSensor(int(model.sensor_type[sensor])).name
    if kind in OF_JOINT:
        return OF_JOINT[kind][_turns(model, int(model.sensor_objid[sensor]))]
    return SENSED.get(kind)


def driven_in(model: Any, actuator: int) -> str | None:
    """Return the unit of the control of a position or velocity servo at a joint or a tendon; None for any other actuator."""
    attached = int(model.actuator_trntype[actuator])
    if attached not in {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_TENDON)}:
        return None
    at_joint = attached == int(mujoco.mjtTrn.mjTRN_JOINT)
    turns = at_joint and _turns(model, int(model.actuator_trnid[actuator][0]))
    constant, position, velocity = (float(value) for value in model.actuator_biasprm[actuator][:3])
    affine = int(model.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    if not affine or constant:
        return None
    if position:
        return "rad" if turns else "m"
    return ("rad/s" if turns else "m/s") if velocity else None


def _turns(model: Any, joint: int) -> bool:
    return int(model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_SLIDE)
