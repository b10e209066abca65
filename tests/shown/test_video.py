"""A film of a run: as many pictures as it lasts, each of its moment, in every form; what cannot be filmed is told before anything moves."""

import importlib
from itertools import pairwise
from pathlib import Path

import pytest

from rcsc.front.commands import run
from rcsc.run.plant.models import camera
from tests.support.films import blue, pictures


def films(dock: Path, *options: str) -> int:
    return run(["run", str(dock), "--no-compile", "-q", "--log", str(dock / "run.mcap"), *options])


@pytest.mark.needs("egl")
@pytest.mark.parametrize("form", ["mp4", "gif", "webp"])
def test_a_film_shows_the_run_at_its_speed(dock: Path, form: str) -> None:
    film = dock / f"run.{form}"
    assert (
        films(dock, "--cycles", "60", "--video", str(film), "--video-speed", "4") == 1
    )  # the script does not end
    shown = pictures(film)
    assert len(shown) == 15  # 60 ticks of 40 ms are 2.4 s, four times as fast 0.6 s of 25 pictures each
    assert {picture.shape for picture in shown} == {(500, 800, 3)}
    places = [blue(picture) for picture in shown]
    assert abs(places[-1][0] - places[0][0]) > 60, "the robot drives to its charger"
    steps = [abs(after[0] - before[0]) for before, after in pairwise(places)]
    assert max(steps) < 40, "and does not jump"


@pytest.mark.needs("egl")
def test_the_same_run_gives_the_same_pictures_and_a_view_others(dock: Path) -> None:
    made = []
    for name, view in (("one", "corner"), ("two", "corner"), ("three", "above")):
        film = dock / f"{name}.webp"
        films(dock, "--cycles", "10", "--video", str(film), "--video-view", view)
        made.append(film.read_bytes())
    assert made[0] == made[1] != made[2]


@pytest.mark.needs("egl")
def test_every_named_view_shows_the_robot(dock: Path) -> None:
    for view in camera.VIEWS:
        film = dock / f"{view}.webp"
        films(dock, "--cycles", "2", "--video", str(film), "--video-view", view)
        across, down = blue(pictures(film)[0])
        assert 0 < across < 800, view
        assert 0 < down < 470, view


def test_what_cannot_be_filmed_is_told_before_anything_moves(
    dock: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert films(dock, "--video", str(dock / "run.avi")) == 2
    assert ".mp4, .gif, .webp" in capsys.readouterr().err
    assert films(dock, "--processes", "--video", str(dock / "run.gif")) == 2
    assert "leave --processes out" in capsys.readouterr().err
    base = dock / "base.py"
    base.write_text(base.read_text(encoding="utf-8").replace("def space(", "def spaced("), encoding="utf-8")
    assert films(dock, "--video", str(dock / "run.gif")) == 1
    assert "RCS708" in capsys.readouterr().err
    assert not (dock / "run.mcap").exists()


def test_a_machine_that_draws_nothing_says_what_to_install(
    dock: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(importlib, "import_module", lambda _: object())
    assert films(dock, "--cycles", "2", "--video", str(dock / "run.gif")) == 1
    assert "libegl1" in capsys.readouterr().err
    assert not (dock / "run.gif").exists()
