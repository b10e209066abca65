"""The cell as MuJoCo has it: arm, hand, stations, fixtures and parts, made of the database; no number of the data stands here again.

In: a database, parts, and what a fault changes. Out: MJCF. Its lengths are metres, the database's millimetres. Names: body and
geom `part0`, `part1`, ...; sites `plate` and `pads`; camera `wrist`, site `projector`; joints `j1` to `j6`, `finger_left`,
`finger_right`, `jaw_left`, `jaw_right`. Groups: 0 furniture, 1 parts, 2 arm and hand as they look, 3 as they collide.

Sources. Masses, inertias, gear ratios and motor inertias of the arm: Corke and Armstrong-Helouvry 1994. The third link's published
inertia breaks the triangle inequality and is rounded to one that does not; the first link's mass is not in the literature. The hand,
all looks and the joints' damping are ours. Gravity compensation of the arm stands for the robot's own feed-forward; parts have none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import starmap
from math import cos, radians, sin, sqrt

from rcsc_cell.cell.arm import ELBOW_MM, FLANGE_MM, FOREARM_MM, LIMITS_DEG, OFFSET_MM, SHOULDER_MM, UPPER_MM
from rcsc_cell.database.ask import Database, Station
from rcsc_cell.database.pose import Pose, Rotation, Vector

M = 0.001
"""Metres in a millimetre."""
DENSITY_KG_M3 = 2700.0
"""Aluminium."""
BASELINE_MM = 150.0
"""From the camera to the light projector on the hand's other side."""
FOVY_DEG = 45.0
STEP_S = 0.002
"""One step of physics. 2 ms is measured to be enough; at 8 ms the vise no longer takes a part."""
PAD_FRICTION = 0.9
"""Of the fingers' pads, whatever they touch."""
OPEN_MM = 130.0
"""The hand's widest opening."""
GAIN_N_M = 20_000.0
"""Of the hand's motor: a newton for every 0.05 mm that the fingers are held back."""
GAINS = (9000, 12000, 5000, 900, 800, 700)
TORQUES_NM = (97.6, 186.4, 89.4, 24.2, 20.1, 21.3)
ARMATURES = (0.784, 2.325, 0.577, 0.1908, 0.1707, 0.1941)
"""Motor inertia times the square of the gear ratio, kg m^2."""
DAMPING = (3.0, 5.0, 2.0, 0.4, 0.4, 0.2)


@dataclass(frozen=True, slots=True)
class Body:
    """A part, as physics needs it.

    Attributes:
        size_mm: Length, width, height; the fingers take it across the width.
        at_mm: Its middle.
        turn: Its axes.
        friction: Against everything but the pads, which have their own.
    """

    size_mm: Vector
    at_mm: Vector
    turn: Rotation
    density_kg_m3: float = DENSITY_KG_M3
    friction: float = 0.4

    def lowest_mm(self, pose: Pose) -> float:
        """Return the height of its lowest point at a pose."""
        return pose.at_mm[2] - sum(abs(pose.axis(at)[2]) * self.size_mm[at] / 2 for at in range(3))


def mjcf(database: Database, parts: Sequence[Body], step_s: float = STEP_S) -> str:
    """Write the cell's model.

    Args:
        database: Stations, fixtures, the hand's measures.
        parts: What lies about.
        step_s: One step of physics.
    """
    stations = "\n".join(map(_station, database.stations.values()))
    lying = "\n".join(starmap(_part, enumerate(parts)))
    return f"""<mujoco model="cell">
{_head(step_s)}
<worldbody>
<light pos="0.2 -0.2 2.6" dir="0 0 -1" diffuse=".6 .6 .6"/>
<light pos="1.6 1.2 2.4" dir="-1 -.8 -1.6" diffuse=".45 .45 .45"/>
<geom name="floor" type="plane" size="2 2 .1" contype="1" conaffinity="2" material="floor"/>
{_arm(database)}
{stations}
{lying}
</worldbody>
{_drives(database)}
</mujoco>"""


def _head(step_s: float) -> str:
    # The pads' time constant is two steps, the least that MuJoCo takes: friction creeps less the stiffer a contact is, and a part
    # in the hand must not wander while the arm sweeps round. Their priority makes their friction the one that counts.
    return f"""<compiler angle="degree" autolimits="true"/>
<option timestep="{step_s}" integrator="implicitfast" cone="elliptic" impratio="10" jacobian="dense"/>
<size memory="4M"/>
<visual><map znear="0.02" zfar="20"/></visual>
<asset>
<material name="arm" rgba="0.93 0.93 0.90 1"/><material name="dark" rgba="0.25 0.26 0.3 1"/>
<material name="table" rgba="0.45 0.36 0.28 1"/><material name="steel" rgba="0.55 0.58 0.62 1"/>
<material name="pad" rgba="0.1 0.1 0.1 1"/><material name="part" rgba="0.8 0.82 0.85 1"/>
<material name="floor" rgba="0.78 0.80 0.82 1"/>
</asset>
<default>
<geom solref="0.005 1" solimp="0.95 0.99 0.001"/>
<default class="look"><geom contype="0" conaffinity="0" group="2" mass="0"/></default>
<default class="shape"><geom contype="8" conaffinity="3" group="3" mass="0" rgba="1 0 0 .2"/></default>
<default class="fixed"><geom contype="1" conaffinity="0" friction="0.5 0.003 0.0001" condim="4" material="steel"/></default>
<default class="hand"><geom contype="4" conaffinity="3" condim="3" group="2" material="dark"/></default>
<default class="pad"><geom contype="4" conaffinity="3" condim="6" priority="1" group="2" material="pad"
 friction="{PAD_FRICTION} 0.01 0.0005" solref="{2 * step_s} 1" solimp="0.95 0.99 0.0005"/></default>
<default class="part"><geom contype="2" conaffinity="3" condim="4" group="1" material="part"/></default>
</default>"""


# --- arm and hand ---


def _joint(number: int) -> str:
    low, high = LIMITS_DEG[number]
    return (
        f'<joint name="j{number + 1}" axis="0 0 1" range="{low} {high}" armature="{ARMATURES[number]}" '
        f'damping="{DAMPING[number]}"/>'
    )


def _arm(database: Database) -> str:
    upper, offset, forearm = UPPER_MM * M, OFFSET_MM * M, FOREARM_MM * M
    back, ahead = 'quat="0.70710678 -0.70710678 0 0"', 'quat="0.70710678 0.70710678 0 0"'
    return f"""<geom class="look" type="cylinder" fromto="0 0 0 0 0 0.03" size="0.16" material="dark"/>
<geom class="look" type="cylinder" fromto="0 0 0.03 0 0 0.50" size="0.088" material="arm"/>
<geom class="shape" name="arm0" type="cylinder" fromto="0 0 0 0 0 0.50" size="0.09"/>
<body name="link1" pos="0 0 {SHOULDER_MM * M}" gravcomp="1">
<inertial pos="0 0 0" mass="8" diaginertia="0.35 0.35 0.35"/>{_joint(0)}
<geom class="look" type="cylinder" fromto="0 0 -0.17 0 0 0.09" size="0.093" material="arm"/>
<geom class="look" type="cylinder" fromto="0 0.10 0 0 -0.14 0" size="0.085" material="arm"/>
<body name="link2" {ahead} gravcomp="1">
<inertial pos="0.068 0.006 0.2275" mass="17.4" diaginertia="0.13 0.524 0.539"/>{_joint(1)}
<geom class="look" type="box" pos="0.14 0 0.19" size="0.34 0.075 0.045" material="arm"/>
<geom class="look" type="cylinder" fromto="0 0 0.13 0 0 0.25" size="0.095" material="arm"/>
<geom class="look" type="cylinder" fromto="{upper} 0 0.11 {upper} 0 0.24" size="0.07" material="arm"/>
<geom class="shape" name="arm2" type="capsule" fromto="0 0 0.19 {upper} 0 0.19" size="0.07"/>
<body name="link3" pos="{upper} 0 0" gravcomp="1">
<inertial pos="0 0.070 0.16415" mass="4.8" {back} diaginertia="0.070 0.082 0.0125"/>{_joint(2)}
<geom class="look" type="cylinder" fromto="0 0 0.05 0 0 0.15" size="0.062" material="arm"/>
<geom class="look" type="box" pos="0.0203 0.14 0.12" size="0.045 0.19 0.05" material="arm"/>
<geom class="shape" name="arm3" type="capsule" fromto="0.0203 -0.02 0.13 0.0203 0.33 0.14" size="0.05"/>
<body name="link4" pos="{ELBOW_MM * M} 0 {offset}" {back} gravcomp="1">
<inertial pos="0 0 0.4508" mass="0.82" diaginertia="1.8e-3 1.8e-3 1.3e-3"/>{_joint(3)}
<geom class="look" type="cylinder" fromto="0 0 0.30 0 0 0.40" size="0.042" material="arm"/>
<body name="link5" pos="0 0 {forearm}" {ahead} gravcomp="1">
<inertial pos="0 0 0" mass="0.34" diaginertia="0.3e-3 0.3e-3 0.4e-3"/>{_joint(4)}
<geom class="look" type="cylinder" fromto="0 0 -0.045 0 0 0.045" size="0.04" material="arm"/>
<body name="link6" {back} gravcomp="1">
<inertial pos="0 0 0.032" mass="0.09" diaginertia="0.15e-3 0.15e-3 0.04e-3"/>{_joint(5)}
<geom class="look" type="cylinder" fromto="0 0 0.03 0 0 {FLANGE_MM * M}" size="0.032" material="dark"/>
<site name="plate" pos="0 0 {FLANGE_MM * M}" size="0.006"/>
{_hand(database)}
</body></body></body></body></body></body>"""


def _hand(database: Database) -> str:
    tool, (camera_x, camera_y, camera_z) = (
        database.hand.tool_mm * M,
        (length * M for length in database.hand.camera_mm),
    )
    root = 0.07
    fingers = "".join(_finger(side, sign, tool - root, database.hand.pad_mm * M) for side, sign in FINGERS)
    return f"""<body name="hand" pos="0 0 {FLANGE_MM * M}" gravcomp="1">
<geom name="palm" class="hand" type="box" pos="0 0 0.035" size="0.035 0.075 0.035" mass="1.0"/>
<site name="pads" pos="0 0 {tool}" size="0.004" rgba="1 0 0 1"/>
<camera name="wrist" pos="{camera_x} {camera_y} {camera_z}" xyaxes="0 1 0 1 0 0" fovy="{FOVY_DEG}"/>
<site name="projector" pos="{camera_x + BASELINE_MM * M} {camera_y} {camera_z}" size="0.004"/>
<geom class="look" type="box" pos="{camera_x + 0.02} 0 0.03" size="0.018 0.02 0.02" material="dark"/>
{fingers}</body>"""


FINGERS = (("left", 1), ("right", -1))


def _finger(side: str, sign: int, pad_m: float, half_m: float) -> str:
    return f"""<body name="finger_{side}" pos="0 0 0.07" gravcomp="1">
<joint name="finger_{side}" type="slide" axis="0 {sign} 0" range="0 {OPEN_MM / 2 * M}" armature="0.5" damping="10"
 solreflimit="0.004 1" solimplimit="0.99 0.999 0.0005"/>
<geom name="finger_{side}" class="hand" type="box" pos="0 {sign * 0.017} 0.045" size="0.011 0.008 0.048" mass="0.12"/>
<geom name="pad_{side}" class="pad" type="box" pos="0 {sign * 0.005} {pad_m}" size="0.012 0.005 {half_m}" mass="0.02"/>
</body>
"""


# --- stations and fixtures ---


def _turned(yaw_deg: float) -> str:
    half = radians(yaw_deg) / 2
    return f'quat="{cos(half):.9f} 0 0 {sin(half):.9f}"'


def _metres(at_mm: Vector) -> str:
    return " ".join(f"{value * M:.6f}" for value in at_mm)


def _station(station: Station) -> str:
    x, y, z = station.frame.at_mm
    half = (z / 2 - 20.0) * M
    length, width = (size / 2 * M for size in station.size_mm)
    vise = _vise(station.vise) + _machine() if station.vise else ""
    vblock = _vblock(station.vblock) if station.vblock else ""
    return f"""<geom class="look" group="0" type="box" pos="{_metres((x, y, z / 2 - 20.0))}" size="0.06 0.06 {half:.6f}"
 {_turned(station.yaw_deg)} material="dark"/>
<body name="{station.name}" pos="{_metres((x, y, z))}" {_turned(station.yaw_deg)}>
<geom name="{station.name}" class="fixed" type="box" pos="0 0 -0.02" size="{length} {width} 0.02" material="table"/>
{vise}{vblock}</body>"""


def _vise(fixture: Mapping[str, object]) -> str:
    """Write a bed, and two jaws that close along x on it; a jaw at zero touches a part of the width that it is made for.

    The left jaw rests on its stop at zero: what is clamped against it lies where it should. The right one goes on until it meets
    something.
    """
    length, width, height = (float(size) / 2 * M for size in fixture["bed_mm"])  # type: ignore[attr-defined]
    half = float(fixture["between_mm"]) / 2 * M  # type: ignore[arg-type]
    beyond = float(fixture["beyond_mm"]) * M  # type: ignore[arg-type]
    bed = f'<geom name="vise_bed" class="fixed" type="box" pos="0 0 {height}" size="{length} {width} {height}"/>\n'
    jaws = [
        f"""<body name="jaw_{side}" pos="{sign * half} 0 {2 * height + 0.004}" gravcomp="1">
<joint name="jaw_{side}" type="slide" axis="{sign} 0 0" range="{low} 0.030" solreflimit="0.004 1" armature="5" damping="200"/>
<geom name="jaw_{side}" class="fixed" type="box" pos="{sign * 0.010} 0 0" size="0.010 0.045 0.016" mass="1"
 friction="0.3 0.003 0.0001"/></body>
"""
        for side, sign, low in (("left", -1, 0.0), ("right", 1, -beyond))
    ]
    return bed + "".join(jaws)


def _machine() -> str:
    """Write the machine behind the vise; it touches nothing."""
    return """<geom name="machine" class="look" group="0" type="box" pos="0.36 0 0.10" size="0.10 0.16 0.45" material="steel"/>
<geom class="look" group="0" type="box" pos="0.24 0 0.37" size="0.06 0.05 0.09" material="dark"/>
"""


def _vblock(fixture: Mapping[str, object]) -> str:
    """Write two walls at 45 degrees along x, smooth, so that a part put between them slides home."""
    down, along, bottom, thick = (
        float(fixture["wall_mm"]) * M,  # type: ignore[arg-type]
        float(fixture["width_mm"]) / 2 * M,  # type: ignore[arg-type]
        float(fixture["bottom_mm"]) * M,  # type: ignore[arg-type]
        0.008,
    )
    slope = sqrt(0.5)
    return "".join(
        f'<geom name="wall_{side}" class="fixed" type="box" size="{along} {down / 2} {thick}" euler="{45 * sign} 0 0" '
        f'pos="0 {sign * (down / 2 + thick) * slope:.6f} {bottom + (down / 2 - thick) * slope:.6f}" '
        'friction="0.15 0.003 0.0001"/>\n'
        for side, sign in (("left", -1), ("right", 1))
    )


def _part(number: int, body: Body) -> str:
    x, y = ([row[axis] for row in body.turn] for axis in (0, 1))
    length, width, height = (size / 2 * M for size in body.size_mm)
    axes = " ".join(f"{value:.9f}" for value in (*x, *y))
    return f"""<body name="part{number}" pos="{_metres(body.at_mm)}" xyaxes="{axes}"><freejoint name="part{number}"/>
<geom name="part{number}" class="part" type="box" size="{length} {width} {height}" density="{body.density_kg_m3}"
 friction="{body.friction} 0.003 0.0001"/></body>"""


# --- drives and sensors ---


def _drives(database: Database) -> str:
    vise = next((station.vise for station in database.stations.values() if station.vise), None)
    joints = "\n".join(
        f'<pid name="j{at + 1}" joint="j{at + 1}" kp="{GAINS[at]}" dampratio="1" input="pos vel" '
        f'forcerange="{-TORQUES_NM[at]} {TORQUES_NM[at]}"/>'
        for at in range(6)
    )
    jaws = sensors = ""
    if vise is not None:
        sensors = '<jointpos name="jaw_left" joint="jaw_left"/><jointpos name="jaw_right" joint="jaw_right"/>'
        jaws = "\n".join(
            f'<position name="jaw_{side}" joint="jaw_{side}" kp="{gain}" kv="4000" forcerange="{-force} {force}"/>'
            for side, gain, force in (("left", 100_000, vise["left_n"]), ("right", 60_000, vise["right_n"]))
        )
    return f"""<contact><exclude body1="finger_left" body2="finger_right"/></contact>
<tendon><fixed name="opening"><joint joint="finger_left" coef="1"/><joint joint="finger_right" coef="1"/></fixed></tendon>
<equality><joint joint1="finger_left" joint2="finger_right" polycoef="0 1 0 0 0" solref="0.004 1" solimp="0.99 0.999 0.0005"/></equality>
<actuator>
{joints}
<position name="hand" tendon="opening" kp="{GAIN_N_M}" kv="600" forcerange="-600 600"/>
{jaws}
</actuator>
<sensor>
<contact name="pad_left" geom1="pad_left" data="found force" reduce="netforce"/>
<contact name="pad_right" geom1="pad_right" data="found force" reduce="netforce"/>
<actuatorfrc name="hand" actuator="hand"/>
{sensors}
</sensor>"""
