"""Pictures: what is near hides what is far, the stick figure stands where PRIMITIVE says, the report needs nothing else."""

import random
import re
from collections.abc import Iterator
from dataclasses import replace
from math import hypot, inf, nan, radians
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcsc.run.plant.models.solid import OVERVIEW, View, solid
from rcsc.views.pages.report import CellPicture, Figure, Matched, Placement, ReportRow, Story, page, report
from rcsc_cell.cell.arm import LIMITS_DEG, plate, skeleton
from rcsc_cell.database.pose import nine
from rcsc_cell.pictures.room import FRONT, HIGH_MM, LOW_MM, SCALE, SIDE, TOP, Outline
from rcsc_cell.pictures.room import View as FlatView
from rcsc_cell.pictures.stick import Scene, pads, stick
from tests.support.browser import Browser

ABOVE = View((0.35, -0.001, 2.9), (0.35, 0.0, 0.3))
SVG = "{http://www.w3.org/2000/svg}"
Array = np.ndarray[Any, Any]
Polygon = tuple[Array, Array]

# --- the solid picture ---


def cell(bodies: str) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def polygons(svg: str) -> list[Polygon]:
    """Corners and colours, the nearest last."""
    found = []
    for element in ET.fromstring(svg).iter(f"{SVG}polygon"):  # noqa: S314  # our own text
        if element.get("class") != "floor":
            points = np.array(
                [[float(x) for x in point.split(",")] for point in element.attrib["points"].split()]
            )
            fill = element.attrib["fill"]
            found.append((points, np.array([int(fill[at : at + 2], 16) for at in (1, 3, 5)], float)))
    return found


def inside(corners: Array, x: float, y: float) -> bool:
    points = corners.tolist()
    before = points[-1]
    turns = set()
    for here in points:
        turns.add((here[0] - before[0]) * (y - before[1]) >= (here[1] - before[1]) * (x - before[0]))
        if len(turns) > 1:
            return False
        before = here
    return True


def painted(found: list[Polygon], x: float, y: float) -> Array | None:
    """The hue at a pixel."""
    for corners, colour in reversed(found):
        if inside(corners, x, y):
            return np.asarray(colour / colour.max())
    return None


def hit(model: Any, data: Any, view: View, x: float, y: float) -> int:
    """What a ray through a pixel meets, asked of MuJoCo; -1 for nothing."""
    eye, look = np.array(view.eye_m), np.array(view.look_m)
    forward = (look - eye) / np.linalg.norm(look - eye)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    scale = view.height_px / 2 / np.tan(np.radians(view.field_deg) / 2)
    across, up = (x - view.width_px / 2) / scale, (view.height_px / 2 - y) / scale
    ray = forward + across * right + up * np.cross(right, forward)
    geom = np.array([-1], dtype=np.int32)
    groups = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
    mujoco.mj_ray(model, data, eye, ray / np.linalg.norm(ray), groups, 1, -1, geom)
    return int(geom[0])


def compared(model: Any, data: Any, view: View, pixels: int, seed: int) -> tuple[int, int]:
    """How many pixels agree with MuJoCo's rays, of those that are not at an edge."""
    found, pick = polygons(solid(model, data, view)), random.Random(seed)  # noqa: S311  # the same every time
    agree = tried = 0
    for _ in range(pixels):
        x, y = pick.uniform(20, view.width_px - 20), pick.uniform(20, view.height_px - 20)
        around = {hit(model, data, view, x + dx, y + dy) for dx in (-4, 0, 4) for dy in (-4, 0, 4)}
        if len(around) > 1:
            continue
        geom, hue = around.pop(), painted(found, x, y)
        tried += 1
        if geom < 0 or hue is None:
            agree += geom < 0 and hue is None
        else:
            wanted = model.geom_rgba[geom][:3]
            agree += bool(np.abs(hue - wanted / wanted.max()).max() < 0.06)
    return agree, tried


def scattered(seed: int) -> str:
    """Solids of all kinds that do not touch, on a table that is far larger than they are; each of its own hue."""
    pick = random.Random(seed)  # noqa: S311  # the same every time
    said: list[str] = []
    spots: list[list[float]] = []
    said.append('<geom type="box" pos="0.4 0 0.3" size=".5 .7 .02" rgba="1 .8 .6 1"/>')
    while len(spots) < 14:
        at = [pick.uniform(0.0, 0.8), pick.uniform(-0.6, 0.6), pick.choice((0.4, 0.4, 0.6, 0.8))]
        if all(sum((a - b) ** 2 for a, b in zip(at, other, strict=True)) > 0.16**2 for other in spots):
            spots.append(at)
            kind = pick.choice(("box", "cylinder", "capsule", "sphere"))
            size = " ".join(f"{pick.uniform(0.03, 0.046):.3f}" for _ in range(3))
            turned = " ".join(f"{pick.uniform(-180, 180):.1f}" for _ in range(3))
            hue = f"{len(spots) % 3 / 2} {len(spots) // 3 % 3 / 2} {0.2 + 0.8 * (len(spots) // 9)} 1"
            place = " ".join(f"{value:.3f}" for value in at)
            said.append(f'<geom type="{kind}" pos="{place}" size="{size}" euler="{turned}" rgba="{hue}"/>')
    return "".join(said)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_near_hides_what_is_far(seed: int) -> None:
    model, data = cell(scattered(seed))
    for view in (OVERVIEW, ABOVE, View((1.9, 0.3, 0.36), (0.3, 0.0, 0.4))):
        agree, tried = compared(model, data, view, 120, seed)
        assert tried > 40
        assert agree == tried


def test_a_small_thing_on_a_large_one_and_beneath_it() -> None:
    """By the distances of their middles the table would hide the cube on its far corner, and the leg would hide the table."""
    bodies = (
        '<geom type="box" pos="0 0 .5" size="1 1 .02" rgba="1 0 0 1"/>'
        '<geom type="box" pos="-.7 .7 .5595" size=".04 .04 .04" rgba="0 1 0 1"/>'  # sunk in by half a millimetre
        '<geom type="box" pos=".8 -.8 .24" size=".05 .05 .24" rgba="0 0 1 1"/>'
    )
    model, data = cell(bodies)
    view = View((2.4, -2.4, 1.6), (0.0, 0.0, 0.4))
    found = polygons(solid(model, data, view))
    cube = [corners.mean(axis=0) for corners, colour in found if colour[1] > 0]
    assert len(cube) == 3
    for x, y in cube:
        assert painted(found, x, y) == pytest.approx([0, 1, 0])
    agree, tried = compared(model, data, view, 400, 0)
    assert agree == tried > 200


def test_solids_that_reach_into_each_other_are_nearly_right() -> None:
    """An arm's looks do; which face is in front is then not one answer for the whole face."""
    bodies = (
        '<geom type="cylinder" fromto="0 0 0 0 0 .6" size=".09" rgba="1 .1 .1 1"/>'
        '<geom type="box" pos=".2 0 .6" size=".34 .07 .05" rgba=".1 1 .1 1"/>'
        '<geom type="cylinder" fromto=".5 -.1 .6 .5 .1 .6" size=".08" rgba=".1 .1 1 1"/>'
    )
    model, data = cell(bodies)
    agree, tried = compared(model, data, View((-0.6, 0.9, 1.2), (0.25, 0.0, 0.5)), 1500, 1)
    assert tried > 1000
    assert agree / tried > 0.99


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder"])
def test_what_is_round_is_as_large_as_it_is(kind: str) -> None:
    model, data = cell(f'<geom type="{kind}" pos=".35 0 .3" size=".2 .1"/>')
    found = polygons(solid(model, data, ABOVE))
    corners = np.vstack([points for points, _ in found])
    height = {"sphere": 0.3, "capsule": 0.4, "cylinder": 0.4}[kind]  # where it is widest, seen from above
    scale = ABOVE.height_px / 2 / np.tan(np.radians(ABOVE.field_deg) / 2) / (ABOVE.eye_m[2] - height)
    assert np.ptp(corners, axis=0) / scale == pytest.approx(0.4, rel=0.03)


def test_only_the_groups_that_are_seen_are_drawn() -> None:
    box = '<geom type="box" size=".1 .1 .1" group="{}"/>'
    shown = [len(polygons(solid(*cell(box.format(group))))) for group in range(6)]
    assert shown == [3, 3, 3, 0, 0, 0]


def test_the_picture_is_the_same_again() -> None:
    model, data = cell('<geom type="sphere" size=".1"/>')
    assert solid(model, data) == solid(model, data)


@pytest.mark.parametrize("height", [-0.4, 0.01, 0.2, 3.0])
def test_a_floor_that_the_eye_stands_on_is_drawn_before_it_only(height: float) -> None:
    model, data = cell('<geom type="plane" size="0 0 .1"/><geom type="box" pos="-1.3 0 .1" size=".1 .1 .1"/>')
    view = View((-1.0, 0.0, height), (0.5, 0.0, 0.1))  # the box is behind the eye, half the floor, too
    svg = solid(model, data, view)
    assert not polygons(svg)
    assert "nan" not in svg
    assert "inf" not in svg
    numbers = [abs(float(number)) for number in re.findall(r"-?\d+\.\d(?=[ ,LM\"])", svg)]
    assert max(numbers) < 1e5


def test_nothing_to_draw() -> None:
    assert ET.fromstring(solid(*cell(""))).tag == f"{SVG}svg"  # noqa: S314  # our own text


# --- the stick figure ---

HOME = tuple(radians(angle) for angle in (35.0, 59.0, -185.0, 0.0, -54.0, 15.0))


def lines(svg: str, kind: str) -> list[list[tuple[float, float]]]:
    """The points of each line of a kind, picture by picture: top, perspective, front, side."""
    found = [element for element in ET.fromstring(svg).iter() if element.get("class") == kind]  # noqa: S314  # our own text
    return [
        [(float(x), float(y)) for x, y in (point.split(",") for point in element.attrib["points"].split())]
        for element in found
    ]


joints = st.tuples(*(st.floats(radians(low), radians(high)) for low, high in LIMITS_DEG))


@given(joints)
def test_the_figure_is_where_primitive_says(angles: tuple[float, ...]) -> None:
    svg = stick(nine(plate(angles)), 80.0, angles)
    arm, triangle = lines(svg, "arm"), lines(svg, "plate")
    for at, view in ((0, TOP), (2, FRONT), (3, SIDE)):
        assert arm[at] == [pytest.approx(view.flat(point), abs=0.06) for point in skeleton(angles)]
        assert triangle[at][0] == pytest.approx(arm[at][-1], abs=0.11)  # the arm ends at the plate


@given(st.tuples(*(st.floats(low, high) for low, high in zip(LOW_MM, HIGH_MM, strict=True))))
def test_the_three_projections_agree(point: tuple[float, float, float]) -> None:
    x, y, z = point
    assert TOP.flat(point)[0] == pytest.approx(FRONT.flat(point)[0])  # one above the other
    assert FRONT.flat(point)[1] == pytest.approx(SIDE.flat(point)[1])  # one beside the other
    more = (x + 100.0, y, z)  # farther from the base: down in the top view, and to the left from the side
    assert TOP.flat(more)[1] - TOP.flat(point)[1] == pytest.approx(20.0)
    assert SIDE.flat(more)[0] - SIDE.flat(point)[0] == pytest.approx(-20.0)
    assert FRONT.flat(more) == pytest.approx(FRONT.flat(point))
    for view in (TOP, FRONT, SIDE):
        left, top = view.left_px, view.top_px
        across, down = view.flat(point)
        assert -1e-6 <= across - left <= view.size_px[0] + 1e-6
        assert -1e-6 <= down - top <= view.size_px[1] + 1e-6


@pytest.mark.parametrize("opening", [0.0, 40.0, 130.0])
def test_the_fingers_open(opening: float) -> None:
    svg = stick(nine(plate(HOME)), opening, HOME)
    left, right = lines(svg, "finger")[
        :2
    ]  # from above, where their distance is not foreshortened: the tool points down
    (ax, ay), (bx, by) = left[-1], right[-1]
    assert hypot(ax - bx, ay - by) == pytest.approx(opening * 0.2, abs=0.2)


def test_what_the_arm_cannot_reach_is_said() -> None:
    far = tuple(value + 3000.0 * (at % 3 == 0) for at, value in enumerate(nine(plate(HOME))))
    svg = stick(far, 80.0, None)
    assert not lines(svg, "arm")
    assert len(lines(svg, "plate")) == 4
    assert "the arm cannot be there" in svg


@pytest.mark.parametrize("numbers", [(0.0,) * 9, (1.0, 2.0, 3.0) * 3, (nan,) * 9, (*range(8), inf)])
def test_nine_numbers_that_are_no_pose(numbers: tuple[float, ...]) -> None:
    svg = stick(numbers, 80.0, None)
    assert not lines(svg, "plate")
    assert "the nine numbers are no pose" in svg
    assert "nan" not in svg


def test_stations_and_the_trail_are_drawn_and_names_are_text() -> None:
    corners = ((400.0, 300.0, 350.0), (600.0, 300.0, 350.0), (600.0, 500.0, 350.0), (400.0, 500.0, 350.0))
    trail = tuple(pads(plate((angle / 10, *HOME[1:]))) for angle in range(5))
    svg = stick(nine(plate(HOME)), 80.0, HOME, Scene((Outline("<a&b>", corners),), trail))
    assert lines(svg, "station")[0] == [pytest.approx(TOP.flat(corner), abs=0.06) for corner in corners]
    assert lines(svg, "trail")[0] == [pytest.approx(TOP.flat(point), abs=0.06) for point in trail]
    assert "<a&b>" in [element.text for element in ET.fromstring(svg).iter(f"{SVG}text")]  # noqa: S314  # our own text


@pytest.mark.parametrize(("view", "across", "upward"), [(TOP, 1, 0), (FRONT, 1, 2), (SIDE, 0, 2)])
def test_projections_have_a_scale(view: FlatView, across: int, upward: int) -> None:
    """Marks stand where the base's coordinates are that their numbers say, and a bar is as long as it says."""
    [drawn] = [
        one
        for one in ET.fromstring(stick(nine(plate(HOME)), 80.0, HOME)).iter(f"{SVG}g")  # noqa: S314  # our own text
        if (one.findtext(f"{SVG}title") or "") == view.name
    ]
    numbers = {
        (float(one.get("x", "")), float(one.get("y", ""))): int(one.text.replace("\N{MINUS SIGN}", "-"))
        for one in drawn.iter(f"{SVG}text")
        if one.text and re.fullmatch(r"\N{MINUS SIGN}?\d+", one.text)
    }
    assert len(numbers) >= 5
    marks = [one.get("d", "") for one in drawn.iter(f"{SVG}path") if one.get("class") == "scale"]
    for (x, y), mm in numbers.items():
        lies_below = x != min(at for at, _ in numbers)
        point = [0.0, 0.0, 0.0]
        point[across if lies_below else upward] = float(mm)
        at = view.flat((point[0], point[1], point[2]))
        assert (x if lies_below else y - 3) == pytest.approx(at[0] if lies_below else at[1], abs=0.06)
        assert any(f"{at[0]:.1f} " in mark if lies_below else f" {at[1]:.1f}h" in mark for mark in marks)
    [bar] = [one.get("d", "") for one in drawn.iter(f"{SVG}path") if one.get("class") == "bar"]
    assert float(bar.split("h")[1].split("m")[0]) == pytest.approx(500 * SCALE)
    assert "500 mm" in [one.text for one in drawn.iter(f"{SVG}text")]


# --- the report ---


def story() -> Story:
    model, data = cell('<geom type="box" size=".1 .1 .1"/>')
    return Story(
        "MAKE <BOXT>",
        (ReportRow(1, "MOVE A & B", "done", 15), ReportRow(2, "PAUSE", "failed", 7, "the part <slipped>")),
        (
            CellPicture(0, "as it <began>", solid(model, data)),
            CellPicture(22, "the end", stick(nine(plate(HOME)), 80.0, HOME)),
        ),
        (
            Matched("task", "acquire", "begin", 12),
            Matched("task", "acquire", "lost", 0),
            Matched("gripper", "gripper", "hold", 90),
        ),
        (Figure("wall clock", 1.25, "s"),),
        (Placement("BOXT", "(1, 2, 3)", "(1, 2, 3.4)", 0.4),),
        (75.0, 83.0, 31.0, 68.0, 9.0, 132.0),
    )


def test_the_report_says_everything_and_is_escaped() -> None:
    text = page(story())
    assert "stopped in row 2: failed: the part &lt;slipped&gt;" in text
    for said in (
        "MAKE &lt;BOXT&gt;",
        "MOVE A &amp; B",
        "as it &lt;began&gt;",
        "1.25 s",
        "0.40",
        "9.0°",
        "0.9 s",
    ):
        assert said in text
    assert "<b>task · acquire</b>: 1 of 2 lines ran" in text
    assert "<b>gripper</b>: 1 of 1 lines ran" in text
    assert re.search(r'class="never"><td>lost</td><td class="n">never', text)
    assert page(story()) == text
    done = page(replace(story(), rows=(ReportRow(1, "MOVE", "done", 15),)))
    assert "every row done" in done
    assert "stopped" not in done


def test_the_report_of_nothing() -> None:
    text = page(Story("nothing"))
    assert "0 cycles" in text
    assert " rows" not in text.partition("<body>")[2]
    assert "<h2>" not in text


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as running:
        yield running


@pytest.mark.needs("chromium")
def test_the_report_needs_nothing_else(browser: Browser, tmp_path: Path) -> None:
    report(tmp_path / "report.html", story())
    browser.open((tmp_path / "report.html").as_uri())
    asked = browser.value("performance.getEntriesByType('resource').map(one => one.name)")
    assert [name for name in asked if not name.startswith("data:")] == []
    assert browser.said == []
    assert browser.value("document.scripts.length") == 0
    assert browser.value("document.querySelectorAll('figure > a > svg').length") == 2
    inside_page = "document.documentElement.scrollWidth <= document.documentElement.clientWidth"
    assert browser.value(inside_page)


@pytest.mark.needs("chromium")
def test_the_report_is_read_by_night(browser: Browser, tmp_path: Path) -> None:
    report(tmp_path / "report.html", story())

    def light(of: str, what: str) -> float:
        colour = browser.value(f"getComputedStyle(document.querySelector('{of}')).{what}")
        return sum(int(number) for number in re.findall(r"\d+", colour)[:3]) / 765

    for dark in (False, True):
        browser.open((tmp_path / "report.html").as_uri(), dark=dark)
        assert (light("body", "backgroundColor") < 0.3) is dark
        assert abs(light("td", "color") - light("body", "backgroundColor")) > 0.5
        assert abs(light("svg .sky", "fill") - light("body", "color")) > 0.4
