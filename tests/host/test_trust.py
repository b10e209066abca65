"""Whether the code of a folder may run: agreed to once, for the folder that was agreed to and no other."""

import json
import os
import shutil
from pathlib import Path

import pytest

from rcsc.base.host.trust import Agreement


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state" / "rcsc" / "trusted"


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    folder = tmp_path / "robot"
    (folder / "below").mkdir(parents=True)
    return folder


def test_it_is_agreed_to_once_and_of_one_folder(state: Path, robot: Path, tmp_path: Path) -> None:
    assert not Agreement(robot).given
    Agreement(robot).give()
    (tmp_path / "link").symlink_to(robot)
    shutil.copytree(robot, tmp_path / "copy")
    for folder in (robot, tmp_path / "link", robot / "below" / ".."):
        assert Agreement(folder).given
    for other in (robot / "below", tmp_path, tmp_path / "copy", tmp_path / "none"):
        assert not Agreement(other).given
    [kept] = state.iterdir()
    assert [path.stat().st_mode & 0o777 for path in (kept, state)] == [0o600, 0o700]


@pytest.mark.usefixtures("state")
def test_a_folder_in_the_place_of_another_is_another(robot: Path, tmp_path: Path) -> None:
    Agreement(robot).give()
    robot.rename(tmp_path / "before")
    robot.mkdir()
    assert not Agreement(robot).given
    shutil.rmtree(robot)
    robot.symlink_to(tmp_path / "before")
    assert not Agreement(robot).given


@pytest.mark.usefixtures("state")
def test_what_was_opened_is_what_is_agreed_to(robot: Path, tmp_path: Path) -> None:
    asked = Agreement(robot)
    robot.rename(tmp_path / "before")
    robot.mkdir()
    asked.give()
    assert not Agreement(robot).given


def test_what_is_kept_is_believed_whole_or_not_at_all(state: Path, robot: Path) -> None:
    Agreement(robot).give()
    [kept] = state.iterdir()
    before = json.loads(kept.read_bytes())
    for said in (b"", b"[]", b"{}", b"\xff", *(json.dumps(before | {key: -1}).encode() for key in before)):
        kept.write_bytes(said)
        assert not Agreement(robot).given
    kept.unlink()
    os.mkfifo(kept)
    assert not Agreement(robot).given


def test_where_nothing_can_be_kept_it_holds_for_the_session(state: Path, robot: Path) -> None:
    state.parent.parent.mkdir()
    state.parent.write_bytes(b"")
    asked = Agreement(robot)
    asked.give()
    assert asked.given
    assert not Agreement(robot).given
