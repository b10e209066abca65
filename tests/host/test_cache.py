"""The cache: what was stored comes back; what is in doubt does not; a failure to keep is no failure."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from rcsc.base.host import cache as cache_module
from rcsc.base.host.cache import Cache, digest_of_tool, open_cache
from rcsc.base.host.files import write_atomically
from rcsc.front import commands


@dataclass(frozen=True)
class Table:
    verdict: str = ""
    lines: tuple[int, ...] = ()


@dataclass(frozen=True)
class Level:
    verdict: str = ""


PROVED = Table("proved", (1, 2))


@pytest.fixture
def kept(tmp_path: Path) -> Cache:
    cache = Cache(tmp_path / "cache", b"secret" * 6, "tool")
    cache.store(PROVED, "one")
    return cache


def entry(cache: Cache) -> Path:
    [path] = cache.folder.glob("??/*.json")
    return path


def test_what_was_stored_comes_back_and_nothing_else(kept: Cache) -> None:
    assert kept.load(Table, "one") == PROVED
    assert kept.load(Table, "two") is None
    assert kept.load(Level, "one") is None
    assert kept.load(Table) is None


def test_what_is_made_is_kept_and_made_once(kept: Cache) -> None:
    made = iter([None, Table("proved")])
    assert kept.memo(Table, ["two"], lambda: next(made)) is None
    for _ in range(2):
        assert kept.memo(Table, ["two"], lambda: next(made)) == Table("proved")
    assert kept.memo(Table, ["one"], lambda: pytest.fail("it is kept")) == PROVED


def test_an_entry_that_is_none_of_its_kind_is_not_believed(
    kept: Cache, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache_module, "plain", lambda _: {"verdict": "proved", "lines": "12"})
    kept.store(PROVED, "two")
    assert kept.load(Table, "two") is None


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
    assert kept.load(Table, "one") is None


def test_a_foreign_entry_is_not_believed(kept: Cache, tmp_path: Path) -> None:
    other = Cache(tmp_path / "other", b"another" * 5, kept.tool)
    other.store(Table("proved by somebody"), "one")
    entry(kept).write_bytes(entry(other).read_bytes())
    assert kept.load(Table, "one") is None


def test_an_entry_moved_to_another_key_is_not_believed(kept: Cache) -> None:
    before = entry(kept)
    kept.store(Table("refuted"), "two")
    [after] = [path for path in kept.folder.glob("??/*.json") if path != before]
    after.write_bytes(before.read_bytes())
    assert kept.load(Table, "two") is None


def test_another_state_of_rcsc_has_entries_of_its_own(kept: Cache) -> None:
    assert Cache(kept.folder, kept.secret, "newer tool").load(Table, "one") is None


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    cache = Cache(tmp_path / "file" / "cache", b"secret", "tool")
    cache.store(PROVED, "key")
    assert cache.load(Table, "key") is None


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
    (package / "base" / "host").mkdir(parents=True)
    (package / "base" / "host" / "cache.py").write_text("old")
    monkeypatch.setattr(cache_module, "__file__", str(package / "base" / "host" / "cache.py"))
    before = digest_of_tool()
    assert digest_of_tool() == before
    (package / "prove.py").write_text("new")
    assert digest_of_tool() != before


def test_the_older_half_goes_when_there_are_too_many(kept: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_module, "MOST_ENTRIES", 4)
    os.utime(entry(kept), (1, 1))
    for number in range(4):
        kept.store(Table(lines=(number,)), str(number))
    assert len(list(kept.folder.glob("??/*.json"))) == 3
    assert kept.load(Table, "one") is None
    assert kept.load(Table, "3") == Table(lines=(3,))


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


def test_the_tools_digest_is_of_contents_not_of_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "rcsc" / "base" / "host"
    package.mkdir(parents=True)
    part = package / "cache.py"
    part.write_text("old")
    monkeypatch.setattr(cache_module, "__file__", str(part))
    before, status = digest_of_tool(), part.stat()
    part.write_text("new")
    os.utime(part, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert digest_of_tool() != before
    part.write_text("old")
    os.utime(part, (1, 1))
    assert digest_of_tool() == before


SHADOWS: dict[str, Callable[[Path, Path], object]] = {
    "a file": lambda place, other: place.write_bytes(other.read_bytes()),
    "a file that says something else": lambda place, _: place.write_text("enum mode { a }\n"),
    "an empty file": lambda place, _: place.touch(),
    "a folder": lambda place, _: place.mkdir(),
    "a link to the file": lambda place, other: place.symlink_to(other),
    "a link to nowhere": lambda place, _: place.symlink_to("nowhere"),
    "a link to a folder": lambda place, _: place.symlink_to(place.parent),
    "a link to itself": lambda place, _: place.symlink_to(place.name),
    "a pipe": lambda place, _: os.mkfifo(place),
}


@pytest.mark.parametrize("shadow", SHADOWS)
def test_whatever_newly_stands_where_a_use_looks_first_is_noticed(
    shadow: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "words.rcs").write_text("enum mode { a, b }\n")
    (tmp_path / "in").mkdir()
    table = "use words\ninput m : mode\noutput o : bool\ntable t {\n| line | m || o |\n| 1 | a || true |\n| 2 | b || false |\n}\n"
    (tmp_path / "in" / "t.rcs").write_text(table)
    assert commands.run(["check", "in/t.rcs"]) == 0
    assert commands.run(["check", "in/t.rcs"]) == 0
    assert "(earlier run)" in capsys.readouterr().out
    SHADOWS[shadow](tmp_path / "in" / "words.rcs", tmp_path / "words.rcs")
    status = commands.run(["check", "in/t.rcs"])
    said = re.sub(r"[0-9.]+ ms( \(earlier run\))?", "", capsys.readouterr().out)
    assert commands.run(["check", "in/t.rcs", "--no-cache"]) == status
    assert re.sub(r"[0-9.]+ ms", "", capsys.readouterr().out) == said


def test_a_link_by_which_a_use_is_found_is_looked_at_though_its_file_is_known_by_another_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    (tmp_path / "in").mkdir()
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "two.rcs").write_text("enum mode { a, b }\n")
    (tmp_path / "three.rcs").write_text("enum mode { a, b, c }\n")
    (tmp_path / "words.rcs").symlink_to("two.rcs")
    table = "use words\ninput m : mode\noutput o : bool\ntable t {\n| line | m || o |\n| 1 | a || true |\n| 2 | b || false |\n}\n"
    (tmp_path / "in" / "t.rcs").write_text(table)
    command = ["check", "two.rcs", "in/t.rcs"]
    assert [commands.run(command), commands.run(command)] == [0, 0]
    (tmp_path / "words.rcs").unlink()
    (tmp_path / "words.rcs").symlink_to("three.rcs")
    capsys.readouterr()
    assert commands.run(command) == 1
    assert "RCS401" in capsys.readouterr().out
