"""What the sensors and actuators of a MuJoCo model are measured in, by their types: SI, as the model's author is taken to mean it.

Source: MuJoCo documentation, XML reference, `sensor` and `actuator`; the model itself has no units.
"""

from typing import Any

import mujoco

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
