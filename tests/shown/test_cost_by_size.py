"""The drawing of costs: whatever was measured, it has all of it, and is legible on light and on dark pages."""

import re
from xml.etree import ElementTree as ET

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from tests.bench.drawn import GRID, INK, LOOKS, STYLES, Panel, Series, drawn

SVG = "{http://www.w3.org/2000/svg}"
PAGES = {"light": "#ffffff", "dark": "#0d1117"}

costs = st.lists(
    st.tuples(st.sampled_from([16, 64, 256, 1024]), st.floats(1e-6, 1e6)), unique_by=lambda point: point[0]
)
series = st.builds(Series, st.sampled_from(sorted(LOOKS)), costs.map(sorted).map(tuple))
panels = st.builds(
    Panel,
    st.text("abc <&>", min_size=1).map(lambda text: f"t{text.strip()}t"),
    st.just("ns"),
    st.lists(series, min_size=1, unique_by=lambda each: each.label).map(tuple),
)


@settings(max_examples=6, phases=[Phase.generate])  # matplotlib takes a second for each
@given(st.lists(panels, min_size=1, max_size=4))
def test_a_drawing_has_all_that_was_measured_in_colours_of_the_page(drawings: list[Panel]) -> None:
    svg = drawn(drawings, "one run")
    root = ET.fromstring(svg)  # noqa: S314 - drawn here
    said = [" ".join("".join(text.itertext()).split()) for text in root.iter(f"{SVG}text")]
    labels = [each.label for panel in drawings for each in panel.series if each.points]
    assert sorted(text for text in said if text in LOOKS) == sorted(labels)
    assert {" ".join(panel.title.split()) for panel in drawings} | {"one run"} <= set(said)
    asked = set(re.findall(r"var\(--(\w+)\)", svg))
    for declared in re.findall(r"svg \{([^}]*)\}", svg):
        assert asked <= set(re.findall(r"--(\w+):", declared))
    assert not re.search(r"#0000[0-9a-f]{2}\b", svg)
    inked = {each for group in root.iter() if "var(--ink)" in group.get("style", "") for each in group.iter()}
    assert set(root.iter(f"{SVG}text")) <= inked


@pytest.mark.parametrize("page", PAGES)
def test_each_colour_stands_out_from_the_page(page: str) -> None:
    for colour, name, *looks in STYLES:
        least = {INK: 7.0, GRID: 1.2}.get(colour, 4.5)
        assert contrast(looks[list(PAGES).index(page)], PAGES[page]) >= least, name


def contrast(one: str, two: str) -> float:
    """The contrast ratio of WCAG 2.1, from 1 to 21."""
    dark, light = sorted(map(luminance, (one, two)))
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: str) -> float:
    """The relative luminance of `#rrggbb`, from 0 to 1."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
