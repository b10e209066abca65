"""FLOOD-FLASH and LINE-FLASH on pictures of boxes: against what is true, against the paper's accuracy, and in bad company."""

import ast
import inspect
from dataclasses import replace
from math import degrees, pi, radians
from types import ModuleType

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from rcsc_cell.vision import blobs as blobs_module
from rcsc_cell.vision import flood as flood_module
from rcsc_cell.vision import formulas as model_module
from rcsc_cell.vision import line as line_module
from rcsc_cell.vision import optics as optics_module
from rcsc_cell.vision.blobs import blobs, half_turn, label
from rcsc_cell.vision.camera import Camera
from rcsc_cell.vision.flood import Features, FoundPart, find
from rcsc_cell.vision.formulas import Top, perceive, perceive_surface
from rcsc_cell.vision.line import LEAN, Surface, measure
from rcsc_cell.vision.optics import STANDARD, Floats, FloodImage, LineImage
from tests.support import scenes
from tests.support.scenes import (
    BBOX,
    HOUS,
    SIZES,
    TBOX,
    THIN,
    Scene,
    Size,
    anywhere,
    between,
    expected_mm,
    features,
    mjcf,
)

EXACT = replace(STANDARD, noise=0.0, peak_px=0.0, step_px=1e-3, aim_rad=0.0)
UP = (0.0, 0.0, 1.0)


def look(scene: Scene, size: Size, seed: int = 1) -> FoundPart | None:
    image = scene.camera.flood(scene.data, np.random.default_rng(seed))
    return find(image, features(size), expected_mm(size), scene.optics)


def touch(scene: Scene, size: Size, seed: int = 1) -> Surface | None:
    image = scene.camera.lines(scene.data, np.random.default_rng(seed))
    return measure(image, expected_mm(size), scene.optics)


# --- FLOOD-FLASH ---


@pytest.mark.parametrize("size", SIZES, ids=scenes.NAMES)
def test_flood_is_good_enough_to_grasp(size: Size) -> None:
    errors = scenes.flood(size, 40)
    assert errors.failures == 0
    assert np.mean(errors.place_mm) < 0.3
    assert scenes.worst(errors.place_mm) < 0.8
    assert scenes.worst(errors.roll_deg) < 2.0
    assert scenes.worst(errors.range_percent) < 1.5


@pytest.mark.parametrize(
    ("x_mm", "y_mm", "yaw", "roll"),
    [(0, 40, 0, pi / 2), (30, 0, pi / 2, 0), (-20, -50, pi / 4, -pi / 4), (50, 50, -pi / 3, pi / 6)],
)
def test_axes_of_the_picture(x_mm: float, y_mm: float, yaw: float, roll: float) -> None:
    """The camera looks down with its right along the world's -y and its up along x: seen so, a yaw is counted from up."""
    scene = Scene(TBOX, optics=EXACT)
    scene.put(0, x_mm, y_mm, yaw)
    found = look(scene, TBOX)
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((-y_mm, x_mm), abs=0.4)
    assert degrees(between(found.roll_rad, roll)) == pytest.approx(0.0, abs=0.7)
    assert -pi / 2 < found.roll_rad <= pi / 2


def test_features_may_come_in_either_order() -> None:
    scene = Scene(TBOX)
    scene.put(0, 10, 20, 0.4)
    image = scene.camera.flood(scene.data, np.random.default_rng(1))
    found = find(image, Features(60, 80), 460)
    assert found is not None
    assert found == find(image, Features(80, 60), 460)


def test_of_equal_parts_the_nearest_to_the_middle() -> None:
    scene = Scene(TBOX, TBOX, TBOX)
    for number, (x, y) in enumerate([(90, 90), (-20, 25), (-100, 60)]):
        scene.put(number, x, y, 0.3 * number)
    found = look(scene, TBOX)
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((-25, -20), abs=1.0)


def test_equal_tops_at_two_heights_are_alike() -> None:
    """The nearer is taken though the other's size fits better: that is LINE-FLASH's to find out."""
    scene = Scene(TBOX, BBOX)
    scene.put(0, 90, 0, 0.2)
    scene.put(1, -20, 10, 0.2)
    found = look(scene, TBOX)
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((-10, -20), abs=1.5)


def test_a_part_that_matches_better_wins_though_it_is_farther() -> None:
    scene = Scene(HOUS, TBOX, THIN)
    for number, (x, y) in enumerate([(0, 0), (80, 80), (-95, 10)]):
        scene.put(number, x, y, 0.5)
    for number, size in enumerate(scene.sizes):
        found = look(scene, size)
        assert found is not None
        middle_mm = scene.truth(number).middle_mm
        assert (found.x_mm, found.y_mm) == pytest.approx((middle_mm[0], middle_mm[1]), abs=1.0)


def test_no_part_matches() -> None:
    assert look(Scene(TBOX), TBOX) is None  # the part is below the floor
    scene = Scene(HOUS)
    scene.put(0, 0, 0)
    assert look(scene, TBOX) is None
    assert look(scene, THIN) is None


def test_parts_that_touch_are_not_taken_for_one() -> None:
    scene = Scene(TBOX, TBOX)
    scene.put(0, 0, -30)
    scene.put(1, 0, 30)
    assert look(scene, TBOX) is None


def test_a_part_cut_by_the_border_does_not_count() -> None:
    scene = Scene(TBOX, TBOX)
    scene.put(0, 170, 0)  # the picture ends 190 mm above its middle; half a part is more than that allows
    assert look(scene, TBOX) is None
    scene.put(1, -60, 120)
    found = look(scene, TBOX)
    assert found is not None
    assert found.x_mm == pytest.approx(-120, abs=1.0)


def test_what_stands_in_the_way_hides_the_part() -> None:
    hand, lid = (f'<geom type="box" group="{n}" size="0.1 0.1 0.01" pos="0 0 0.3"/>' for n in (3, 0))
    for more, seen in ((hand, True), (lid, False)):
        scene = Scene(TBOX, more=more)
        scene.put(0, 0, 0)
        surface = touch(scene, TBOX)
        assert (look(scene, TBOX) is not None) == seen
        assert (surface is not None) == seen


def test_light_that_the_camera_does_not_see_says_nothing() -> None:
    """A thing close under the camera, which the projector's light passes by."""
    scene = Scene(TBOX, more='<geom type="box" size="0.03 0.3 0.005" pos="0 0 0.4"/>')
    scene.put(0, 0, 0)
    assert touch(scene, TBOX) is None


# --- LINE-FLASH ---


@pytest.mark.parametrize("size", SIZES, ids=scenes.NAMES)
def test_line_lands_on_the_papers_accuracy(size: Size) -> None:
    """Section 5.2: 0.2 % of the range; 2 % of a right angle, 1.8 degrees. Neither worse nor much better."""
    errors = scenes.line(size, 200)
    assert errors.failures == 0
    assert 0.15 < scenes.rms(errors.range_percent) < 0.23
    assert 1.2 < scenes.rms(errors.normal_deg) < 2.7
    assert scenes.worst(errors.normal_deg) < 9.0


@given(
    st.sampled_from(SIZES[:3]),
    st.floats(-pi / 2, pi / 2),
    st.floats(-radians(12), radians(12)),
    st.floats(-1, 1),
)
def test_without_noise_line_is_exact(size: Size, yaw: float, tilt: float, off_mm: float) -> None:
    scene = Scene(size, optics=replace(EXACT, peak_px=0.01))
    scene.put(0, off_mm, -off_mm, yaw, tilt)
    surface, true = touch(scene, size), scene.truth(0)
    assert surface is not None
    assert surface.range_mm == pytest.approx(true.range_mm, abs=0.15)
    x, y, z = true.normal.tolist()
    assert degrees(surface.angle_rad((x, y, z))) < 0.6
    assert np.linalg.norm(surface.normal) == pytest.approx(1.0)


def test_equal_tops_are_told_apart_by_line_alone() -> None:
    """Section 5.2, bench tolerances: FLOOD takes either for the other, LINE never."""
    for lying, expected in ((TBOX, BBOX), (BBOX, TBOX)):
        assert scenes.accepted(lying, expected, 15) == (15, 0)
        assert scenes.accepted(lying, lying, 15) == (15, 15)


def test_a_neighbour_of_another_height_does_not_count() -> None:
    scene = Scene(TBOX, BBOX, BBOX, optics=replace(STANDARD, aim_rad=0.0))
    scene.put(0, 0, 0, pi / 2)
    for number, y in ((1, 72), (2, -72)):
        scene.put(number, 0, y, pi / 2)  # camera x is along y: 40 mm of top, then at once one 10 mm lower
    for seed in range(10):
        surface = touch(scene, TBOX, seed)
        assert surface is not None
        assert surface.range_mm == pytest.approx(460, abs=1.5)
        assert degrees(surface.angle_rad()) < 5.0


def test_line_says_what_is_there_though_it_is_not_expected() -> None:
    scene = Scene(TBOX)
    table = touch(scene, TBOX)
    assert table is not None
    assert table.range_mm == pytest.approx(500, abs=3.0)
    assert table.points > 40
    assert 0.5 < table.spread_mm < 4.0
    image = scene.camera.lines(scene.data, np.random.default_rng(1))
    assert measure(image, 400) is None


def test_the_projectors_seat_moves_the_range_and_not_the_normal() -> None:
    scene = Scene(TBOX, optics=replace(EXACT, peak_px=0.01, aim_rad=0.00085))
    scene.put(0, 0, 0)
    seen = [touch(scene, TBOX, seed) for seed in range(40)]
    ranges = [surface.range_mm for surface in seen if surface is not None]
    assert len(ranges) == 40
    assert 0.5 < np.std(ranges) < 1.1
    assert max(abs(span - 460) for span in ranges) < 1.6
    assert max(degrees(surface.angle_rad()) for surface in seen if surface is not None) < 0.6


# --- the sensor ---


def test_one_seed_one_picture_and_as_much_noise_whatever_is_seen() -> None:
    full, empty = Scene(TBOX), Scene(TBOX)
    full.put(0, 5, 5, 0.2)
    made, after = [], []
    for scene in (full, full, empty):
        rng = np.random.default_rng(7)
        flood, lines = scene.camera.flood(scene.data, rng), scene.camera.lines(scene.data, rng)
        made.append([one.tobytes() for one in (flood.intensity, *lines.peaks_px)])
        after.append(int(rng.integers(1 << 60)))
    assert made[0] == made[1]
    assert not set(made[0]) & set(made[2])
    assert after[0] == after[2]


def test_noise_is_what_the_optics_say() -> None:
    scene = Scene(TBOX)
    clean = Camera(scene.model, EXACT).flood(scene.data, np.random.default_rng(1)).intensity
    noise = scene.camera.flood(scene.data, np.random.default_rng(1)).intensity - clean
    assert noise.shape == (120, 160)
    assert np.std(noise) == pytest.approx(STANDARD.noise, rel=0.05)


def test_a_top_is_bright_and_sides_and_table_are_dark() -> None:
    scene = Scene(TBOX, optics=EXACT)
    scene.put(0, 0, 0, pi / 2)
    image = scene.camera.flood(scene.data, np.random.default_rng(1))
    even = flood_module.reflectance(image, 460, EXACT)
    top = even[54:66, 74:86]
    assert top == pytest.approx(np.full(top.shape, EXACT.metal), rel=1e-6)
    assert even[60, 120] < EXACT.furniture


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (mjcf((TBOX,), fovy_deg=50), "sees 50.0 degrees"),
        (mjcf((TBOX,), baseline_mm=149), "`projector` is at"),
        (mjcf((TBOX,)).replace('name="wrist"', 'name="waist"'), "lacks a camera"),
        (mjcf((TBOX,)).replace('name="projector"', 'name="lamp"'), "lacks a camera"),
    ],
)
def test_a_model_that_is_not_as_calibrated_is_refused(text: str, message: str) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    with pytest.raises(ValueError, match=message):
        Camera(model)


# --- image processing, without MuJoCo ---

KNOWS = {"blobs", "flood", "line", "optics"}
MODULES = (blobs_module, flood_module, line_module, optics_module, model_module)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_image_processing_cannot_know_the_world(module: ModuleType) -> None:
    names = set()
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    allowed = {"collections.abc", "dataclasses", "math", "numpy", "numpy.typing"}
    assert names - allowed <= {f"rcsc_cell.vision.{name}" for name in KNOWS}


def test_what_image_processing_is_given() -> None:
    given_to = {
        function: [parameter.annotation for parameter in inspect.signature(function).parameters.values()]
        for function in (find, measure)
    }
    optics = optics_module.Optics
    assert given_to == {find: [FloodImage, Features, float, optics], measure: [LineImage, float, optics]}
    assert list(FloodImage.__dataclass_fields__) == ["intensity"]
    assert list(LineImage.__dataclass_fields__) == ["peaks_px"]


def filled(mask: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> list[set[tuple[int, int]]]:
    """Components the slow way, in the order of their first pixels."""
    left = {(int(r), int(c)) for r, c in zip(*np.nonzero(mask), strict=True)}
    found = []
    while left:
        todo, one = [min(left)], set()
        while todo:
            r, c = todo.pop()
            if (r, c) in left:
                left.remove((r, c))
                one.add((r, c))
                todo += [(r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)]
        found.append(one)
    return found


@given(arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=9)))
def test_components(mask: np.ndarray[tuple[int, int], np.dtype[np.bool_]]) -> None:
    labels, count = label(mask)
    wanted = filled(mask)
    assert count == len(wanted)
    for number, pixels in enumerate(wanted, start=1):
        assert {(int(r), int(c)) for r, c in zip(*np.nonzero(labels == number), strict=True)} == pixels


def drawn(u: float, v: float, length: float, width: float, angle: float) -> Floats:
    """A rectangle of brightness 1 on 0.2, each pixel the mean of 64 points."""
    fine = (np.arange(60 * 8) + 0.5) / 8
    right, up = fine[None, :] - u, v - fine[:, None]
    along = np.abs(right * np.cos(angle) + up * np.sin(angle)) <= length / 2
    across = np.abs(up * np.cos(angle) - right * np.sin(angle)) <= width / 2
    picture: Floats = 0.2 + 0.8 * (along & across).reshape(60, 8, 60, 8).mean(axis=(1, 3))
    return picture


@given(st.floats(26, 34), st.floats(26, 34), st.floats(20, 32), st.floats(10, 17), st.floats(-pi / 2, pi / 2))
def test_moments_of_a_drawn_rectangle(u: float, v: float, length: float, width: float, angle: float) -> None:
    (blob,) = blobs(drawn(u, v, length, width, angle), 0.6)
    assert (blob.column_px, blob.row_px) == pytest.approx((u, v), abs=0.1)
    assert blob.area_px == pytest.approx(length * width, rel=0.03)
    assert (blob.length_px, blob.width_px) == pytest.approx((length, width), abs=0.2)
    assert degrees(between(blob.angle_rad, angle)) == pytest.approx(0.0, abs=1.0)


@pytest.mark.parametrize("angle", [0.0, pi / 2])
def test_sides_are_right_on_average_wherever_the_edges_fall(angle: float) -> None:
    places = [30 + at / 8 for at in range(8)]
    seen = [blob for u in places for v in places for blob in blobs(drawn(u, v, 12, 8, angle), 0.6)]
    assert len(seen) == 64
    assert np.mean([one.length_px for one in seen]) == pytest.approx(12, abs=0.04)
    assert np.mean([one.width_px for one in seen]) == pytest.approx(8, abs=0.04)


@pytest.mark.parametrize("to", [(11.2, 30), (48.8, 30), (30, 11.2), (30, 48.8)])
def test_a_patch_that_touches_the_border_is_left_out(to: tuple[float, float]) -> None:
    assert blobs(drawn(*to, 20, 20, 0.0), 0.6) != []
    u, v = (30 + (at - 30) * 1.06 for at in to)
    assert blobs(drawn(u, v, 20, 20, 0.0), 0.6) == []


@given(st.floats(-50, 50))
def test_half_turn(angle: float) -> None:
    turned = half_turn(angle)
    assert -pi / 2 < turned <= pi / 2
    assert np.sin(turned - angle) == pytest.approx(0.0, abs=1e-9)


@given(
    st.lists(st.tuples(st.floats(-60, 60), st.floats(440, 520)), min_size=1, max_size=12), st.floats(0.5, 5)
)
def test_squares_of_each_piece(points: list[tuple[float, float]], spread_mm: float) -> None:
    """Against least squares, with the usual lean as one row more."""
    x, z = np.array(points).T
    squares = line_module._squares(x, z, spread_mm)
    for first in range(len(x)):
        for after in range(first + 1, len(x) + 1):
            run = slice(first, after)
            columns = np.stack([np.ones(after - first), x[run] - x[run].mean()], axis=1)
            rows = np.concatenate([columns, [[0.0, spread_mm / LEAN]]])
            values = np.append(z[run], 0.0)
            left = values - rows @ np.linalg.lstsq(rows, values, rcond=None)[0]
            assert squares[first, after] == pytest.approx(left @ left, rel=1e-6, abs=1e-5)


def test_what_cannot_be_is_refused() -> None:
    image = FloodImage(np.zeros((120, 160)))
    nothing = LineImage((np.zeros((0, 2)), np.zeros((0, 2))))
    assert find(image, Features(80, 60), 460) is None
    assert measure(nothing, 460) is None
    for wanted, range_mm in ((Features(80, 60), 0.0), (Features(0, 60), 460.0)):
        with pytest.raises(ValueError, match="nothing looks like"):
            find(image, wanted, range_mm)
    with pytest.raises(ValueError, match="nothing is at"):
        measure(nothing, -1.0)


# --- the formulas ---


def top_of(scene: Scene) -> Top:
    true, (length_mm, width_mm, _) = scene.truth(0), scene.sizes[0]
    x, y, z = true.normal.tolist()
    middle = true.middle_mm.tolist()
    return Top(middle[0], middle[1], -middle[2], length_mm, width_mm, true.roll_rad, (x, y, z))


@pytest.mark.parametrize("size", SIZES, ids=scenes.NAMES)
def test_formulas_make_the_errors_that_pictures_make(size: Size) -> None:
    scene, rng = Scene(size), np.random.default_rng(11)
    formula, picture = scenes.Errors(), scenes.flood(size, 100)
    for _ in range(400):
        scene.put(0, *anywhere(rng, scenes.FLOOD_REACH_MM))
        found = perceive([top_of(scene)], features(size), expected_mm(size), rng)
        formula.found(scene, found)
    assert formula.failures == 0
    # A thin part shows less of its sides than the formulas, which do not know how thick it is, take for granted.
    assert scenes.rms(formula.place_mm) == pytest.approx(scenes.rms(picture.place_mm), rel=0.6)
    assert scenes.rms(formula.roll_deg) == pytest.approx(scenes.rms(picture.roll_deg), rel=0.5)
    assert np.mean(formula.range_percent) == pytest.approx(np.mean(picture.range_percent), abs=0.12)
    formula, picture = scenes.Errors(), scenes.line(size, 200, lean_deg=0.0)
    for _ in range(400):
        scene.put(0, *anywhere(rng, scenes.LINE_REACH_MM))
        surface = perceive_surface(top_of(scene), rng)
        formula.touched(scene, surface)
    assert formula.failures == 0
    assert scenes.rms(formula.range_mm) == pytest.approx(scenes.rms(picture.range_mm), rel=0.15)
    assert scenes.rms(formula.normal_deg) == pytest.approx(scenes.rms(picture.normal_deg), rel=0.2)


def test_formulas_grow_with_the_noise_as_pictures_do() -> None:
    scene, rng = Scene(TBOX, optics=replace(STANDARD, noise=0.08)), np.random.default_rng(12)
    formula, picture = scenes.Errors(), scenes.Errors()
    for _ in range(120):
        scene.put(0, *anywhere(rng, scenes.FLOOD_REACH_MM))
        image = scene.camera.flood(scene.data, rng)
        for errors, found in (
            (picture, find(image, features(TBOX), expected_mm(TBOX))),
            (formula, perceive([top_of(scene)], features(TBOX), expected_mm(TBOX), rng, scene.optics)),
        ):
            errors.found(scene, found)
    assert formula.failures == picture.failures == 0
    assert scenes.rms(picture.roll_deg) > 0.6
    assert scenes.rms(formula.roll_deg) == pytest.approx(scenes.rms(picture.roll_deg), rel=0.3)
    assert scenes.rms(formula.place_mm) == pytest.approx(scenes.rms(picture.place_mm), rel=0.3)


def test_formulas_follow_a_leaning_top() -> None:
    quiet = replace(EXACT, peak_px=0.001)
    scene = Scene(TBOX, optics=quiet)
    scene.put(0, 3, -2, 0.7, radians(12))
    made, seen = perceive_surface(top_of(scene), np.random.default_rng(1), quiet), touch(scene, TBOX)
    assert made is not None
    assert seen is not None
    assert made.range_mm == pytest.approx(seen.range_mm, abs=0.1)
    assert made.normal == pytest.approx(seen.normal, abs=0.005)
    assert abs(made.points - seen.points) <= 4


def test_formulas_choose_as_pictures_do() -> None:
    rng = np.random.default_rng(3)
    here, there = Top(0, 30, 460, 60, 80, 0.3), Top(80, 0, 460, 80, 60, 0.3)
    other, cut = Top(0, 0, 450, 70, 50, 0), Top(0, 180, 460, 80, 60, 0)
    found = perceive([other, there, here, cut], features(TBOX), 460, rng)
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((0, 30), abs=1)
    assert degrees(between(found.roll_rad, 0.3 + pi / 2)) == pytest.approx(0, abs=2)
    assert perceive([other, cut], features(TBOX), 460, rng) is None
    assert perceive([], features(TBOX), 460, rng) is None


def test_formulas_see_no_top_where_no_light_falls() -> None:
    rng = np.random.default_rng(3)
    assert perceive_surface(Top(0, 30, 460, 80, 20, 0.0), rng) is None
    assert perceive_surface(Top(0, 0, 460, 80, 60, 0.0, (1.0, 0.0, 0.0)), rng) is None
    assert perceive_surface(Top(0, 0, 460, 80, 60, 0.0, UP), rng) is not None
