"""A table top with boxes on it under a wrist plate with a camera: all that tests of the vision system need of a cell.

The table's top is at height 0, the camera half a metre above it. What is true is read off the state, in camera axes.
"""

from dataclasses import dataclass, field
from math import cos, degrees, hypot, pi, radians, sin

import mujoco
import numpy as np

from rcsc_cell.vision.blobs import half_turn
from rcsc_cell.vision.camera import Camera
from rcsc_cell.vision.flood import Features, FoundPart, find
from rcsc_cell.vision.line import Surface, measure
from rcsc_cell.vision.optics import STANDARD, Floats, Optics

ABOVE_MM = 500.0
Size = tuple[float, float, float]
TBOX: Size = (80.0, 60.0, 40.0)
BBOX: Size = (80.0, 60.0, 30.0)
HOUS: Size = (70.0, 50.0, 50.0)
THIN: Size = (60.0, 40.0, 12.0)
SIZES = (TBOX, BBOX, HOUS, THIN)


def features(size: Size) -> Features:
    return Features(size[0], size[1])


def expected_mm(size: Size) -> float:
    """The range of the part's top when it lies on the table."""
    return ABOVE_MM - size[2]


def mjcf(
    sizes: tuple[Size, ...], *, fovy_deg: float = 45.0, baseline_mm: float = 150.0, more: str = ""
) -> str:
    parts = "".join(
        f'<body name="part{n}" mocap="true" pos="0 {n} -2">'
        f'<geom type="box" group="1" size="{x / 2000} {y / 2000} {z / 2000}"/></body>'
        for n, (x, y, z) in enumerate(sizes)
    )
    return f"""<mujoco><worldbody>
    <geom type="plane" size="3 3 .1" pos="0 0 -0.35"/>
    <geom type="box" size="0.15 0.16 0.02" pos="0 0 -0.02"/>
    {parts}{more}
    <body name="plate" mocap="true" pos="0.075 0 {ABOVE_MM / 1000 + 0.05}" quat="0 1 0 0">
      <geom type="box" group="2" size="0.2 0.2 0.01" pos="0 0 0.1"/>
      <camera name="wrist" pos="-0.075 0 0.05" xyaxes="0 1 0 1 0 0" fovy="{fovy_deg}"/>
      <site name="projector" pos="{-0.075 + baseline_mm / 1000} 0 0.05"/>
    </body></worldbody></mujoco>"""


@dataclass(frozen=True)
class Truth:
    """A part's top as it is, in camera axes: middle, roll of its long side, range along the axis, unit normal."""

    middle_mm: Floats
    roll_rad: float
    range_mm: float
    normal: Floats


class Scene:
    """Boxes that can be put down, and the camera."""

    def __init__(self, *sizes: Size, optics: Optics = STANDARD, more: str = "") -> None:
        self.sizes, self.optics = sizes, optics
        self.model = mujoco.MjModel.from_xml_string(mjcf(sizes, more=more))
        self.data = mujoco.MjData(self.model)
        self.camera = Camera(self.model, optics)
        mujoco.mj_forward(self.model, self.data)

    def put(
        self, number: int, x_mm: float, y_mm: float, yaw: float = 0.0, tilt: float = 0.0, lift_mm: float = 0.0
    ) -> None:
        """A part on the table, turned about the vertical, then leaning about its own length, its middle lifted."""
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, f"part{number}")
        at = self.model.body_mocapid[body]
        self.data.mocap_pos[at] = np.array([x_mm, y_mm, self.sizes[number][2] / 2 + lift_mm]) / 1000
        self.data.mocap_quat[at] = [
            cos(yaw / 2) * cos(tilt / 2),
            cos(yaw / 2) * sin(tilt / 2),
            sin(yaw / 2) * sin(tilt / 2),
            sin(yaw / 2) * cos(tilt / 2),
        ]
        mujoco.mj_forward(self.model, self.data)

    def truth(self, number: int) -> Truth:
        data = self.data
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, f"part{number}")
        eye = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_CAMERA, "wrist")
        turn = data.cam_xmat[eye].reshape(3, 3).T @ data.xmat[body].reshape(3, 3)
        size = self.sizes[number]
        top = data.xpos[body] + data.xmat[body].reshape(3, 3)[:, 2] * size[2] / 2000
        middle_mm = data.cam_xmat[eye].reshape(3, 3).T @ (top - data.cam_xpos[eye]) * 1000
        long = turn[:, 0] if size[0] >= size[1] else turn[:, 1]
        roll = half_turn(float(np.arctan2(long[1], long[0])))
        normal = turn[:, 2]
        return Truth(middle_mm, roll, float(-(middle_mm @ normal) / normal[2]), normal)


def between(one: float, other: float) -> float:
    """The angle from one line to another, in (-pi/2, pi/2]."""
    return half_turn(one - other)


def anywhere(rng: np.random.Generator, reach_mm: float) -> tuple[float, float, float]:
    x, y = rng.uniform(-reach_mm, reach_mm, 2)
    return float(x), float(y), float(rng.uniform(-pi / 2, pi / 2))


# --- what is seen, against what is true ---

FLOOD_REACH_MM, LINE_REACH_MM = 60.0, 1.0
LEAN_DEG = 5.0
TOLERANCE_MM, FLAT_DEG = 2.0, 6.0
NAMES = tuple("x".join(f"{side:.0f}" for side in size) for size in SIZES)


@dataclass
class Errors:
    """Of each picture in which the part was found."""

    failures: int = 0
    place_mm: list[float] = field(default_factory=list)
    roll_deg: list[float] = field(default_factory=list)
    range_mm: list[float] = field(default_factory=list)
    range_percent: list[float] = field(default_factory=list)
    normal_deg: list[float] = field(default_factory=list)

    def found(self, scene: Scene, part: FoundPart | None) -> None:
        if part is None:
            self.failures += 1
            return
        true = scene.truth(0)
        self.place_mm.append(hypot(part.x_mm - true.middle_mm[0], part.y_mm - true.middle_mm[1]))
        self.roll_deg.append(degrees(between(part.roll_rad, true.roll_rad)))
        self._range(part.range_mm, true)

    def touched(self, scene: Scene, surface: Surface | None) -> None:
        if surface is None:
            self.failures += 1
            return
        true = scene.truth(0)
        x, y, z = true.normal.tolist()
        self._range(surface.range_mm, true)
        self.normal_deg.append(degrees(surface.angle_rad((x, y, z))))

    def _range(self, range_mm: float, true: Truth) -> None:
        self.range_mm.append(range_mm - true.range_mm)
        self.range_percent.append(100 * (range_mm / true.range_mm - 1))


def flood(size: Size, poses: int) -> Errors:
    """Errors of FLOOD-FLASH at random places, at any turn."""
    scene, rng, errors = Scene(size), np.random.default_rng(1), Errors()
    for _ in range(poses):
        scene.put(0, *anywhere(rng, FLOOD_REACH_MM))
        image = scene.camera.flood(scene.data, rng)
        errors.found(scene, find(image, features(size), expected_mm(size), scene.optics))
    return errors


def line(size: Size, poses: int, lean_deg: float = LEAN_DEG) -> Errors:
    """Errors of LINE-FLASH near the camera's axis, at any turn, every other part leaning."""
    scene, rng, errors = Scene(size), np.random.default_rng(2), Errors()
    for number in range(poses):
        tilt = radians(rng.uniform(-lean_deg, lean_deg)) * (number % 2)
        scene.put(0, *anywhere(rng, LINE_REACH_MM), tilt, lift_mm=5.0 * (number % 2))
        errors.touched(scene, measure(scene.camera.lines(scene.data, rng), expected_mm(size), scene.optics))
    return errors


def accepted(lying: Size, expected: Size, poses: int) -> tuple[int, int]:
    """How often FLOOD finds one part where another is expected, and how often LINE then accepts it."""
    scene, rng = Scene(lying), np.random.default_rng(3)
    found = right = 0
    for _ in range(poses):
        scene.put(0, *anywhere(rng, FLOOD_REACH_MM))
        if find(scene.camera.flood(scene.data, rng), features(expected), expected_mm(expected)) is None:
            continue
        found += 1
        scene.put(0, *anywhere(rng, LINE_REACH_MM))
        surface = measure(scene.camera.lines(scene.data, rng), expected_mm(expected))
        near = surface is not None and abs(surface.range_mm - expected_mm(expected)) <= TOLERANCE_MM
        right += near and surface is not None and surface.angle_rad() <= radians(FLAT_DEG)
    return found, right


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def worst(values: list[float]) -> float:
    return float(np.max(np.abs(values)))
