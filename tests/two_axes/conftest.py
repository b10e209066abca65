"""The system of two axes, to be changed."""

import shutil
from pathlib import Path

import pytest

from rcsc.driver.compile import compile_system

AXES = Path(__file__).parents[1] / "data" / "two_axes"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the system, compiled once for all tests of a file."""
    folder = tmp_path_factory.mktemp("made") / "axes"
    shutil.copytree(AXES, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    assert not compile_system(folder / "system.toml").report.failed
    return folder


@pytest.fixture
def compiled(made: Path, tmp_path: Path) -> Path:
    """The description of the compiled system."""
    shutil.copytree(made, tmp_path / "axes")
    return tmp_path / "axes" / "system.toml"


@pytest.fixture
def axes(tmp_path: Path) -> Path:
    """The description of two axes."""
    shutil.copytree(AXES, tmp_path / "axes", ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    return tmp_path / "axes" / "system.toml"
