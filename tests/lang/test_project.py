"""Which files belong together, and what cannot be read: each told once a place, never a hang or a crash."""

import os
from pathlib import Path

import pytest

from rcsc.lang.model import Program
from rcsc.lang.project import MOST_BYTES, is_published, listed, load, project_root
from rcsc.lang.resolve import resolve


def write(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        path = folder / (name.replace("__", "/") + ".rcs")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def codes(*paths: str, stdin: str | bytes | None = None) -> list[tuple[str, str]]:
    return [
        (finding.primary.span.file, finding.code.value) for finding in load(paths, stdin=stdin).diagnostics
    ]


# --- uses ---


def test_a_used_file_is_looked_for_beside_the_file_then_at_the_root(tmp_path: Path) -> None:
    write(tmp_path, types="type n = bool", sub__a="use types\nuse near", sub__near="")
    (tmp_path / "rcsc.toml").write_text("")
    loaded = load(["sub/a.rcs"])
    assert loaded.diagnostics == ()
    assert loaded.uses["sub/a.rcs"] == ("types.rcs", "sub/near.rcs")


def test_a_lone_file_has_its_own_folder_for_root(tmp_path: Path) -> None:
    write(tmp_path, types="", sub__a="use types")
    assert codes("sub/a.rcs") == [("sub/a.rcs", "RCS205")]
    (finding,) = load(["sub/a.rcs"]).diagnostics
    assert finding.help == ("looked for `sub/types.rcs`",)


def test_both_places_that_were_tried_are_named(tmp_path: Path) -> None:
    write(tmp_path, sub__a="use types")
    (tmp_path / "rcsc.toml").write_text("")
    (finding,) = load(["sub/a.rcs"]).diagnostics
    assert finding.help == ("looked for `sub/types.rcs` and `types.rcs`",)
    assert (finding.primary.span.start, finding.primary.span.end) == (0, 9)


def test_a_circle_of_files_is_told_with_its_path_where_it_closes(tmp_path: Path) -> None:
    write(tmp_path, a="use b", b="use c", c="use b")
    (finding,) = load(["a.rcs"]).diagnostics
    assert (finding.code.value, finding.primary.span.file) == ("RCS204", "c.rcs")
    assert "b.rcs -> c.rcs -> b.rcs" in finding.message


def test_a_file_that_uses_itself(tmp_path: Path) -> None:
    write(tmp_path, a="use a")
    assert codes("a.rcs") == [("a.rcs", "RCS204")]


def test_a_file_reached_twice_is_read_once_and_is_no_circle(tmp_path: Path) -> None:
    write(tmp_path, a="use b\nuse c", b="use d", c="use d", d="type n = bool")
    loaded = load(["a.rcs"])
    assert loaded.diagnostics == ()
    assert isinstance(resolve("a.rcs", loaded), Program)


def test_a_long_chain_of_files(tmp_path: Path) -> None:
    write(tmp_path, **{f"f{n}": f"use f{n + 1}" for n in range(1500)}, f1500="type n = bool")
    loaded = load(["f0.rcs"])
    assert loaded.diagnostics == ()
    assert len(loaded.files) == 1501
    assert isinstance(resolve("f0.rcs", loaded), Program)


def test_a_link_to_a_file_is_that_file(tmp_path: Path) -> None:
    write(tmp_path, a="use one\nuse two", one="type n = bool")
    (tmp_path / "two.rcs").symlink_to("one.rcs")
    loaded = load(["a.rcs"])
    assert loaded.uses["a.rcs"] == ("one.rcs", "one.rcs")
    assert isinstance(resolve("a.rcs", loaded), Program)


def test_an_error_in_a_used_file_is_an_error_of_every_user(tmp_path: Path) -> None:
    write(tmp_path, a="use bad", b="use bad", bad="type =", good="type n = bool")
    loaded = load(["."])
    assert [finding.primary.span.file for finding in loaded.diagnostics] == ["bad.rcs"]
    assert not isinstance(resolve("a.rcs", loaded), Program)
    assert not isinstance(resolve("b.rcs", loaded), Program)
    assert isinstance(resolve("good.rcs", loaded), Program)


def test_names_are_told_as_reached_from_the_paths_given(tmp_path: Path) -> None:
    write(tmp_path, sub__a="use b", sub__b="")
    assert set(load(["sub/a.rcs"]).files) == {"sub/a.rcs", "sub/b.rcs"}
    assert set(load([str(tmp_path / "sub")]).files) == {f"{tmp_path}/sub/a.rcs", f"{tmp_path}/sub/b.rcs"}
    assert load(["sub", "./sub/a.rcs", str(tmp_path / "sub")]).given == ("sub/a.rcs", "sub/b.rcs")


def test_of_a_folder_the_files_that_others_use_are_parts(tmp_path: Path) -> None:
    write(tmp_path, sub__a="use b", sub__b="use c", sub__c="", sub__d="")
    assert load(["sub"]).roots == ("sub/a.rcs", "sub/d.rcs")
    assert load(["sub", "sub/c.rcs"]).roots == ("sub/a.rcs", "sub/c.rcs", "sub/d.rcs")
    write(tmp_path, sub__a="use b", sub__b="use a")
    assert load(["sub"]).roots == ("sub/c.rcs", "sub/d.rcs")
    (tmp_path / "sub/c.rcs").unlink()
    (tmp_path / "sub/d.rcs").unlink()
    assert load(["sub"]).roots == ("sub/a.rcs", "sub/b.rcs")


# --- what cannot be read ---


def test_a_file_that_is_not_there() -> None:
    assert codes("no.rcs") == [("no.rcs", "RCS107")]
    assert codes("") == [("", "RCS107")]


NOBODY = 65534


def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    write(tmp_path, a="")
    (tmp_path / "a.rcs").chmod(0)
    user = os.geteuid()
    if user == 0:  # who may read everything
        os.seteuid(NOBODY)
    try:
        assert codes("a.rcs") == [("a.rcs", "RCS107")]
    finally:
        if user == 0:
            os.seteuid(user)


def test_every_user_of_an_unreadable_file_is_told(tmp_path: Path) -> None:
    write(tmp_path, a="use dir", b="use dir")
    (tmp_path / "dir.rcs").mkdir()
    loaded = load(["a.rcs", "b.rcs"])
    assert [(d.primary.span.file, d.code.value) for d in loaded.diagnostics] == [
        ("a.rcs", "RCS107"),
        ("b.rcs", "RCS107"),
    ]
    assert all(not isinstance(resolve(root, loaded), Program) for root in loaded.roots)


@pytest.mark.timeout(20)
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    write(tmp_path, a="use b")
    os.mkfifo(tmp_path / "b.rcs")
    assert codes("a.rcs", "b.rcs") == [("a.rcs", "RCS107"), ("b.rcs", "RCS107")]
    assert codes("/dev/zero") == [("/dev/zero", "RCS107")]


def test_a_link_to_itself(tmp_path: Path) -> None:
    (tmp_path / "a.rcs").symlink_to("a.rcs")
    assert codes("a.rcs") == [("a.rcs", "RCS107")]
    assert codes(".") == [("a.rcs", "RCS107")]


def test_links_between_folders_are_followed_once(tmp_path: Path) -> None:
    write(tmp_path, sub__a="")
    (tmp_path / "sub" / "up").symlink_to(tmp_path)
    assert load(["."]).roots == ("sub/a.rcs",)


def test_bytes_that_are_not_utf8(tmp_path: Path) -> None:
    (tmp_path / "a.rcs").write_bytes(b"type n\xff = bool")
    (finding,) = load(["a.rcs"]).diagnostics
    assert (finding.code.value, finding.message) == ("RCS105", "`a.rcs` is not UTF-8 at byte 6")
    assert codes("-", stdin=b"\xfe") == [("-", "RCS105")]


def test_a_byte_order_mark_and_crlf_are_tolerated(tmp_path: Path) -> None:
    (tmp_path / "a.rcs").write_bytes(
        b"\xef\xbb\xbfinput a : bool\r\ntable t {\r\n| line | a ||\r\n| x | true ||\r\n}\r\n"
    )
    loaded = load(["a.rcs"])
    assert loaded.diagnostics == ()
    assert isinstance(resolve("a.rcs", loaded), Program)


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "a.rcs").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    assert codes("a.rcs") == [("a.rcs", "RCS104")]
    assert codes("-", stdin=b" " * (MOST_BYTES + 1)) == [("-", "RCS104")]


# --- folders and project files ---


def test_a_folder_is_read_in_order_without_hidden_folders(tmp_path: Path) -> None:
    write(tmp_path, b="", a="", sub__c="", _hidden__d="")
    (tmp_path / "_hidden").rename(tmp_path / ".hidden")
    assert listed(["."]) == ("a.rcs", "b.rcs", "sub/c.rcs")


def test_a_folder_without_tables(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    write(tmp_path, a="")
    assert codes("a.rcs", "empty") == [("empty", "RCS111")]


def test_excluded_files_are_left_out_from_the_root_down(tmp_path: Path) -> None:
    write(tmp_path, a="", old__b="", sub__old__c="", sub__d="")
    (tmp_path / "rcsc.toml").write_text('name = "x"\nexclude = ["old/*", "sub/old/*"]')
    assert listed(["."]) == ("a.rcs", "sub/d.rcs")
    assert listed(["sub"]) == ("sub/d.rcs",)
    assert listed(["old/b.rcs"]) == ("old/b.rcs",)  # named by the user
    assert codes("old") == [("old", "RCS111")]


@pytest.mark.parametrize(
    ("text", "start"),
    [
        ("exclude = 3", 0),
        ("exclude = [3]", 0),
        ("name = 3", 0),
        ("nam = 'x'", 0),
        ('name = "x"\nexclude = [', 22),
        ('name = "x"\nexclude = oops', 21),
        ("a = " + "[" * 5000, 0),
    ],
)
def test_a_project_file_that_is_not_right(tmp_path: Path, text: str, start: int) -> None:
    write(tmp_path, sub__a="use b", sub__b="")
    (tmp_path / "rcsc.toml").write_text(text)
    for path in ("sub/a.rcs", "sub", "."):
        (finding,) = load([path]).diagnostics
        assert finding.code.value == "RCS110"
        assert finding.primary.span.file.endswith("rcsc.toml")
        assert text.startswith("a") or finding.primary.span.start == start


@pytest.mark.parametrize(
    ("said", "help_"),
    [
        ("name = robot", 'a text stands in quotes: `name = "robot"`'),
        ("name = my robot # of mine", 'a text stands in quotes: `name = "my robot"`'),
        ("exclude = [old/b.rcs]", 'a text stands in quotes: `exclude = ["old/b.rcs"`'),
        ("starts_at_zero = True", "write `starts_at_zero = true`"),
        ("exclud = []", "did you mean `exclude`?"),
        ("published = 3", "the settings are `name`, `exclude`, `published`, `prefix` and `starts_at_zero`"),
    ],
)
def test_a_project_file_that_is_nearly_right_is_told_what_to_write(
    tmp_path: Path, said: str, help_: str
) -> None:
    write(tmp_path, a="")
    (tmp_path / "rcsc.toml").write_text(said)
    (finding,) = load(["."]).diagnostics
    assert (finding.code.value, finding.help[0]) == ("RCS110", help_)


def test_a_use_that_names_no_file_is_told_what_is_near(tmp_path: Path) -> None:
    write(
        tmp_path,
        a="use vocabluary",
        vocabulary="",
        sub__a="use sub/wrods\nuse wrods",
        sub__words="",
        other__b="use nothing",
    )
    (tmp_path / "rcsc.toml").write_text("")
    found = load(["."]).diagnostics
    assert [finding.help[0] for finding in found] == [
        "did you mean `vocabulary`?",
        "looked for `other/nothing.rcs` and `nothing.rcs`",
        "did you mean `sub/words`?",
        "did you mean `words`?",
    ]


def test_published_files_are_those_that_the_project_says(tmp_path: Path) -> None:
    write(tmp_path, a="", old__published="", sub__old__c="")
    (tmp_path / "rcsc.toml").write_text('published = ["*published.rcs", "sub/*"]')
    assert [is_published(each) for each in ("a.rcs", "old/published.rcs", "sub/old/c.rcs")] == [
        False,
        True,
        True,
    ]
    assert not codes(".")
    (tmp_path / "rcsc.toml").write_text("published = 3")
    assert not is_published("old/published.rcs")


def test_the_root_is_the_nearest_folder_with_a_project_file(tmp_path: Path) -> None:
    write(tmp_path, sub__deep__a="")
    assert project_root("sub/deep/a.rcs") == "sub/deep"
    (tmp_path / "rcsc.toml").write_text("")
    assert project_root("sub/deep/a.rcs") == "."
    (tmp_path / "sub" / "rcsc.toml").write_text("")
    assert project_root("sub/deep/a.rcs") == "sub"
    assert project_root(str(tmp_path / "sub/deep/a.rcs")) == f"{tmp_path}/sub"


def test_the_root_of_a_linked_folder_is_where_the_folder_is(tmp_path: Path) -> None:
    write(tmp_path, one__sub__a="use t", one__t="type n = bool")
    (tmp_path / "one" / "rcsc.toml").write_text("")
    (tmp_path / "two").mkdir()
    (tmp_path / "two" / "link").symlink_to("../one/sub")
    assert load(["two/link/a.rcs"]).diagnostics == ()


def test_stdin_is_a_file_of_the_working_folder(tmp_path: Path) -> None:
    write(tmp_path, types="type n = bool")
    loaded = load(["-"], stdin="use types\nstate s : n")
    assert loaded.roots == ("-",)
    assert isinstance(resolve("-", loaded), Program)
    assert codes("-", stdin="use nothing") == [("-", "RCS205")]
