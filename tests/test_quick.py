"""The quick set: tests of every room, and a choice that keeps to its bounds."""

from pathlib import Path

from tests.quick import MOST_OF_A_ROOM_S, MOST_S, choose, chosen, measured, quick

HERE = Path(__file__).parent
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
    assert took_s["a/test_b.py::test_1"] == 3.0
    assert "a/test_c.py::TestD::test_2" in took_s
    assert choose(took_s) == ["a/test_b.py", "e/test_f.py::test_3"]
