"""The C of a system does what the Python system does: every leaf of every level, every buffer, in every tick."""

from pathlib import Path

from rcsc.run.description import description
from rcsc.run.system import signatures
from tests.link.played import CSystem, by_python, drawing, first_difference, script
from tests.support.cells import SYSTEM, database


def test_the_docking_robot(dock: Path, tmp_path: Path) -> None:
    system = description(dock / "system.toml")
    signs = signatures(system)
    built = CSystem(system, signs, tmp_path)
    ticks = script(system, signs, drawing(1), 600)
    expected, made = by_python(system, ticks), built.play(ticks)
    assert not isinstance(made, str), made
    assert first_difference(expected, made) == ""
    assert {faulty for faulty, *_ in expected} == {
        "",
        "supervisor",
    }  # the drive's readings are clamped


def test_the_shipped_system(tmp_path: Path) -> None:
    system, data = description(SYSTEM), database()
    signs = signatures(system)
    built = CSystem(system, signs, tmp_path, data.queries)
    ticks = script(system, signs, drawing(2), 150)
    expected, made = by_python(system, ticks, data.queries), built.play(ticks)
    assert not isinstance(made, str), made
    assert first_difference(expected, made) == ""
