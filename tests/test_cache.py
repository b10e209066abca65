"""The cache: what was stored comes back; what is in doubt does not; a failure to keep is no failure."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc import cache as cache_module
from rcsc.cache import Cache, digest_of_tool, open_cache
from rcsc.files import write_atomically


@pytest.fixture
def kept(tmp_path: Path) -> Cache:
    cache = Cache(tmp_path / "cache", b"secret" * 6, "tool")
    cache.store({"verdict": "proved"}, "table", "one")
    return cache


def entry(cache: Cache) -> Path:
    [path] = cache.folder.glob("??/*.json")
    return path


def test_what_was_stored_comes_back_and_nothing_else(kept: Cache) -> None:
    assert kept.load("table", "one") == {"verdict": "proved"}
    assert kept.load("table", "two") is None
    assert kept.load("tableone") is None


DAMAGE: list[Callable[[bytes], bytes]] = [
    lambda raw: raw.replace(b"proved", b"proven"),
    lambda raw: raw[:-1],
    lambda _raw: b"",
    lambda raw: raw + b" ",
    lambda raw: raw.partition(b"\n")[2],
    lambda raw: b"\xff" * len(raw),
    lambda raw: raw.swapcase(),
]


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_entry_is_not_believed(kept: Cache, damage: Callable[[bytes], bytes]) -> None:
    path = entry(kept)
    path.write_bytes(damage(path.read_bytes()))
    assert kept.load("table", "one") is None


def test_a_foreign_entry_is_not_believed(kept: Cache, tmp_path: Path) -> None:
    other = Cache(tmp_path / "other", b"another" * 5, kept.tool)
    other.store({"verdict": "proved", "by": "somebody"}, "table", "one")
    entry(kept).write_bytes(entry(other).read_bytes())
    assert kept.load("table", "one") is None


def test_an_entry_moved_to_another_key_is_not_believed(kept: Cache) -> None:
    before = entry(kept)
    kept.store({"verdict": "refuted"}, "table", "two")
    [after] = [path for path in kept.folder.glob("??/*.json") if path != before]
    after.write_bytes(before.read_bytes())
    assert kept.load("table", "two") is None


def test_another_state_of_rcsc_has_entries_of_its_own(kept: Cache) -> None:
    assert Cache(kept.folder, kept.secret, "newer tool").load("table", "one") is None


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cache = Cache(tmp_path / "file" / "cache", b"secret", "tool")
    cache.store({"a": 1}, "key")
    assert cache.load("key") is None


def test_the_secret_is_the_users_own_and_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RCSC_CACHE_KEY", raising=False)
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first, second = open_cache(tmp_path), open_cache(tmp_path)
    assert first is not None
    assert first == second
    assert (tmp_path / "rcsc" / "secret").stat().st_mode & 0o777 == 0o600
    (tmp_path / "rcsc" / "secret").write_bytes(b"short")
    assert open_cache(tmp_path) is None
    monkeypatch.setenv("RCSC_CACHE_KEY", "shared by machines")
    third = open_cache(tmp_path)
    assert third is not None
    assert third.secret != first.secret


def test_the_tools_digest_changes_with_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "rcsc"
    package.mkdir()
    (package / "cache.py").write_text("old")
    monkeypatch.setattr(cache_module, "__file__", str(package / "cache.py"))
    before = digest_of_tool()
    assert digest_of_tool() == before
    (package / "prove.py").write_text("new")
    assert digest_of_tool() != before


def test_the_older_half_goes_when_there_are_too_many(kept: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_module, "MOST_ENTRIES", 4)
    os.utime(entry(kept), (1, 1))
    for number in range(4):
        kept.store({"n": number}, str(number))
    assert len(list(kept.folder.glob("??/*.json"))) == 3
    assert kept.load("table", "one") is None
    assert kept.load("3") == {"n": 3}


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file"
    path.write_text("before")
    path.chmod(0o640)
    write_atomically(path, b"after")
    assert path.read_text() == "after"
    assert path.stat().st_mode & 0o777 == 0o640

    def full_disk(self: Path, target: Path) -> Path:
        raise OSError(28, f"No space left on device: {self} {target}")

    monkeypatch.setattr(Path, "replace", full_disk)
    with pytest.raises(OSError, match="No space"):
        write_atomically(path, b"half")
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def test_a_symbolic_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("before")
    (tmp_path / "link").symlink_to("real")
    write_atomically(tmp_path / "link", b"after")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "after"
