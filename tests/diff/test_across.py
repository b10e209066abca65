"""What changed in requirements across levels: told with the files of a project, with a system, and by themselves."""

from pathlib import Path

import pytest

from rcsc.front.commands import run
from tests.across.test_across import _written

SOON = "requirement soon : when boss.wish = l and not right.runs, within 2 cycles, left.runs\n"


def compared(capsys: pytest.CaptureFixture[str], *paths: Path) -> tuple[int, str]:
    capsys.readouterr()
    status = run(["diff", *map(str, paths)])
    told = capsys.readouterr()
    return status, told.out + told.err


@pytest.mark.parametrize("given", [".", "system.toml", "all.rcs"])
def test_a_changed_requirement_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], given: str
) -> None:
    sides = []
    for name, text in (("a", SOON), ("b", SOON.replace("within 2 cycles", "within 3 cycles"))):
        (tmp_path / name).mkdir()
        sides.append(_written(tmp_path / name, text).parent / given)
    status, told = compared(capsys, *sides)
    assert status == 1
    assert "requirement `soon`" in told
    assert "1 other part changed" in told
    (sides[1] if given == "." else sides[1].parent).joinpath("all.rcs").write_text(f"# As before.\n{SOON}")
    assert compared(capsys, *sides)[0] == 0


def test_a_variable_of_a_level_is_told_of_the_level_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sides = []
    for name in "ab":
        (tmp_path / name).mkdir()
        sides.append(_written(tmp_path / name, SOON).parent)
    boss = sides[1] / "boss.rcs"
    boss.write_text(f"state more : bool\n{boss.read_text()}")
    status, told = compared(capsys, *sides)
    assert (status, told.count("`more`"), "boss.more" in told) == (1, 1, False)


def test_errors_of_a_level_are_told_at_their_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    sides = [_written(tmp_path / name, SOON).parent for name in "ab"]
    left = sides[1] / "left.rcs"
    left.write_text(left.read_text().replace("input go : bool", "input go : boll"))
    status, told = compared(capsys, *sides)
    assert status == 2
    assert "RCS203" in told or "boll" in told
    status, told = compared(capsys, *(side / "all.rcs" for side in sides))
    assert status == 2
    assert "not in order" in told
