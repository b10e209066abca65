"""How well the vision system sees, against what is true: `python -m tests.bench.vision`.

Each part lies at a hundred random places within 60 mm of the camera's axis, at any turn, for FLOOD-FLASH; for LINE-FLASH within
1 mm, at any turn, every other one leaning by up to 5 degrees. The last table says how often a part on the table is accepted
where another is expected: FLOOD finds the top, and LINE's range is within 2 mm and its normal within 6 degrees of the vertical.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import degrees, hypot, radians
from typing import ParamSpec, TypeVar

import numpy as np

from rcsc_cell.vision.flood import FoundPart, find
from rcsc_cell.vision.line import Surface, measure
from tests.support.scenes import SIZES, Scene, Size, anywhere, between, expected_mm, features

POSES = 100
FLOOD_REACH_MM, LINE_REACH_MM = 60.0, 1.0
LEAN_DEG = 5.0
TOLERANCE_MM, FLAT_DEG = 2.0, 6.0
NAMES = tuple("x".join(f"{side:.0f}" for side in size) for size in SIZES)

P = ParamSpec("P")
T = TypeVar("T")


@dataclass
class Errors:
    """Of each picture in which the part was found; and what they cost."""

    failures: int = 0
    place_mm: list[float] = field(default_factory=list)
    roll_deg: list[float] = field(default_factory=list)
    range_mm: list[float] = field(default_factory=list)
    range_percent: list[float] = field(default_factory=list)
    normal_deg: list[float] = field(default_factory=list)
    picture_ms: list[float] = field(default_factory=list)
    process_ms: list[float] = field(default_factory=list)


def timed(into: list[float], work: Callable[P, T], *args: P.args, **named: P.kwargs) -> T:
    start = time.perf_counter()
    made = work(*args, **named)
    into.append((time.perf_counter() - start) * 1e3)
    return made


def flood(size: Size, poses: int = POSES, seed: int = 1) -> Errors:
    scene, rng, errors = Scene(size), np.random.default_rng(seed), Errors()
    for _ in range(poses):
        scene.put(0, *anywhere(rng, FLOOD_REACH_MM))
        image = timed(errors.picture_ms, scene.camera.flood, scene.data, rng)
        found = timed(errors.process_ms, find, image, features(size), expected_mm(size), scene.optics)
        if found is None:
            errors.failures += 1
        else:
            note_found(errors, scene, found)
    return errors


def note_found(errors: Errors, scene: Scene, found: FoundPart) -> None:
    true = scene.truth(0)
    errors.place_mm.append(hypot(found.x_mm - true.middle_mm[0], found.y_mm - true.middle_mm[1]))
    errors.roll_deg.append(degrees(between(found.roll_rad, true.roll_rad)))
    errors.range_mm.append(found.range_mm - true.range_mm)
    errors.range_percent.append(100 * (found.range_mm / true.range_mm - 1))


def line(size: Size, poses: int = POSES, seed: int = 2, lean_deg: float = LEAN_DEG) -> Errors:
    scene, rng, errors = Scene(size), np.random.default_rng(seed), Errors()
    for number in range(poses):
        tilt = radians(rng.uniform(-lean_deg, lean_deg)) * (number % 2)
        scene.put(0, *anywhere(rng, LINE_REACH_MM), tilt, lift_mm=5.0 * (number % 2))
        image = timed(errors.picture_ms, scene.camera.lines, scene.data, rng)
        surface = timed(errors.process_ms, measure, image, expected_mm(size), scene.optics)
        if surface is None:
            errors.failures += 1
        else:
            note_surface(errors, scene, surface)
    return errors


def note_surface(errors: Errors, scene: Scene, surface: Surface) -> None:
    true = scene.truth(0)
    x, y, z = true.normal.tolist()
    errors.range_mm.append(surface.range_mm - true.range_mm)
    errors.range_percent.append(100 * (surface.range_mm / true.range_mm - 1))
    errors.normal_deg.append(degrees(surface.angle_rad((x, y, z))))


def accepted(lying: Size, expected: Size, poses: int = POSES, seed: int = 3) -> tuple[int, int]:
    """How often FLOOD finds it, and how often LINE then accepts it."""
    scene, rng = Scene(lying), np.random.default_rng(seed)
    found = right = 0
    for _ in range(poses):
        scene.put(0, *anywhere(rng, FLOOD_REACH_MM))
        if find(scene.camera.flood(scene.data, rng), features(expected), expected_mm(expected)) is None:
            continue
        found += 1
        scene.put(0, *anywhere(rng, LINE_REACH_MM))
        surface = measure(scene.camera.lines(scene.data, rng), expected_mm(expected))
        right += (
            surface is not None
            and abs(surface.range_mm - expected_mm(expected)) <= TOLERANCE_MM
            and surface.angle_rad() <= radians(FLAT_DEG)
        )
    return found, right


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def worst(values: list[float]) -> float:
    return float(np.max(np.abs(values)))


def main() -> None:
    poses = int(sys.argv[1]) if len(sys.argv) > 1 else POSES
    print(f"{'FLOOD-FLASH':12} {'place mm':>13} {'roll deg':>13} {'range %':>13} {'fails':>6} {'ms':>13}")
    print(
        f"{'':12} {'mean':>6} {'max':>6} {'rms':>6} {'max':>6} {'rms':>6} {'max':>6} {'':6} {'pict.':>6} {'find':>6}"
    )
    for name, size in zip(NAMES, SIZES, strict=True):
        e = flood(size, poses)
        print(
            f"{name:12} {np.mean(e.place_mm):6.2f} {worst(e.place_mm):6.2f} {rms(e.roll_deg):6.2f} {worst(e.roll_deg):6.2f}"
            f" {rms(e.range_percent):6.3f} {worst(e.range_percent):6.3f} {e.failures:6d}"
            f" {np.median(e.picture_ms):6.2f} {np.median(e.process_ms):6.2f}"
        )
    print()
    print(f"{'LINE-FLASH':12} {'range mm':>13} {'range %':>13} {'normal deg':>20} {'fails':>6} {'ms':>13}")
    print(
        f"{'':12} {'rms':>6} {'max':>6} {'rms':>6} {'max':>6} {'mean':>6} {'rms':>6} {'max':>6} {'':6} {'pict.':>6} {'meas.':>6}"
    )
    for name, size in zip(NAMES, SIZES, strict=True):
        e = line(size, poses)
        print(
            f"{name:12} {rms(e.range_mm):6.2f} {worst(e.range_mm):6.2f} {rms(e.range_percent):6.3f} {worst(e.range_percent):6.3f}"
            f" {np.mean(e.normal_deg):6.2f} {rms(e.normal_deg):6.2f} {worst(e.normal_deg):6.2f} {e.failures:6d}"
            f" {np.median(e.picture_ms):6.2f} {np.median(e.process_ms):6.2f}"
        )
    print()
    print("found by FLOOD / accepted by LINE, of", poses)
    print(f"{'lying, expected':16}", *(f"{name:>12}" for name in NAMES))
    for name, lying in zip(NAMES, SIZES, strict=True):
        cells = [accepted(lying, expected, poses) for expected in SIZES]
        print(f"{name:16}", *(f"{f'{found} / {right}':>12}" for found, right in cells))


if __name__ == "__main__":
    main()
