"""The quick and the thorough set: tests that are there, of every room in the ordinary run, and choices that keep to their bounds."""

from pathlib import Path

import pytest

from tests.sets import (
    KEPT,
    MOST_OF_A_FILE_S,
    MOST_OF_A_ROOM_S,
    MOST_S,
    THOROUGH,
    by_function,
    choose,
    choose_thorough,
    chosen,
    measured,
    quick,
    whole,
)

HERE = Path(__file__).parents[1]
ROOMS = {path.parent.name for path in HERE.glob("*/test_*.py")}


def test_every_room_has_quick_tests_that_are_there() -> None:
    assert {name.split("/")[0] for name in chosen()} >= ROOMS - {"findings"}
    for name in chosen():
        file, _, function = name.partition("::")
        assert function.split("::")[-1] in (HERE / file).read_text(encoding="utf-8")


def test_a_test_is_quick_by_its_file_or_by_its_name() -> None:
    names = ("a/test_b.py", "c/test_d.py::test_e")
    assert quick("a/test_b.py::test_x", names)
    assert quick("c/test_d.py::test_e", names)
    assert not quick("c/test_d.py::test_f", names)


def test_the_least_costly_are_chosen_within_the_bounds(tmp_path: Path) -> None:
    cases = [
        ("a.test_b", "test_1", 1.0),
        ("a.test_b", "test_1[x]", 2.0),
        ("a.test_c.TestD", "test_2", MOST_S),
    ]
    cases += [("e.test_f", "test_3", MOST_OF_A_ROOM_S / 2), ("e.test_f", "test_4", MOST_S)]
    junit = tmp_path / "junit.xml"
    rows = "".join(
        f'<testcase classname="tests.{where}" name="{name}" time="{s}"/>' for where, name, s in cases
    )
    junit.write_text(f"<testsuites><testsuite>{rows}</testsuite></testsuites>", encoding="utf-8")
    took_s = measured(junit)
    assert took_s["a/test_b.py::test_1[x]"] == 2.0
    assert "a/test_c.py::TestD::test_2" in took_s
    assert choose(by_function(took_s)) == ["a/test_b.py", "e/test_f.py::test_3"]


def test_of_each_file_what_costs_most_is_thorough() -> None:
    took_s = {f"a/test_b.py::test_1[{case}]": MOST_OF_A_FILE_S / 4 for case in "uvwxyz"}
    took_s |= {"a/test_c.py::test_2": MOST_OF_A_FILE_S * 2, "a/test_c.py::test_3": MOST_OF_A_FILE_S}
    took_s |= dict.fromkeys(KEPT, MOST_OF_A_FILE_S * 3)
    assert choose_thorough(took_s) == [
        "a/test_b.py::test_1[y]",
        "a/test_b.py::test_1[z]",
        "a/test_c.py::test_2",
    ]


def test_what_is_thorough_is_there_and_is_left_out_only_where_nothing_is_asked_for(
    pytestconfig: pytest.Config, request: pytest.FixtureRequest
) -> None:
    for name in chosen(THOROUGH) | KEPT:
        file, _, function = name.partition("[")[0].partition("::")
        assert f"def {function.rpartition('::')[2]}(" in (HERE / file).read_text(encoding="utf-8"), name
    assert not chosen(THOROUGH) & KEPT
    found = {item.nodeid.removeprefix("tests/") for item in request.session.items}
    assert not whole(pytestconfig) or not found & chosen(THOROUGH)
