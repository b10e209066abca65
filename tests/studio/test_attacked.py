"""What a page, or somebody beside it, may try with open files: nothing hangs, grows, leaves the project, or is said of an older text."""

import asyncio
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rcsc.base.diagnostics.coded import Refused
from rcsc.base.diagnostics.source import Source
from rcsc.base.host.files.read import Malformed
from rcsc.base.host.trust import Agreement
from rcsc.desk.studio.hub import MOST_OPEN, MOST_UNREAD, Client, Hub
from rcsc.desk.studio.tables import desk
from rcsc.desk.studio.tables.document import MOST_BYTES, MOST_KEPT, Document
from rcsc.lang.project import listed
from rcsc.lang.written.changes import formatted
from tests.studio.driven import dock
from tests.studio.served import page_at
from tests.studio.tabled import Bench, rows

WORDS = "enum mode { off, on, stuck }\n"
TABLE = """use words

input now : mode
output out : int 0 .. 3
table t {
  | line | now    || out |
  |------|--------||-----|
  | a    | off    || 1   |
  | b    | /= off || 2   |
}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "words.rcs").write_text(WORDS)
    (tmp_path / "t.rcs").write_text(TABLE)
    return tmp_path


@pytest.fixture
def bench(folder: Path) -> Bench:
    return Bench(folder / "system.toml")


def state(doc: Any) -> str:
    return str(doc["tables"][0]["standing"]["state"])


def edit(text: str, line: int = 0, start: int = 0, end: int = 0) -> dict[str, Any]:
    return {
        "edits": [
            {"start_line": line, "start_column": start, "end_line": line, "end_column": end, "text": text}
        ]
    }


# --- nothing is said of an older text --------------------------------------------------------


@pytest.mark.parametrize("text", ["of", "off }", "off, on, stuck } ?? {", "", "aus, off"])
def test_users_of_a_file_that_changes_are_stale_at_once_and_looked_at_again(text: str, bench: Bench) -> None:
    """Whether the used file still parses or not; and proved again when it is as it was."""
    assert state(bench.open("t.rcs")) == "proved"
    bench.open("words.rcs")
    version = bench.doc("words.rcs")["version"]
    bench.ask("tables.edit", file="words.rcs", version=version, **edit(text, 0, 12, 15))
    shown = bench.told["tables.file/t.rcs"]
    assert (state(shown), shown["known"]) == ("stale", False)
    now = bench.doc("t.rcs")
    assert now["known"]
    assert (state(now) == "proved") == (text == "aus, off")
    bench.now("tables.undo", "words.rcs")
    assert not bench.told["tables.file/t.rcs"]["known"]
    assert state(bench.doc("t.rcs")) == "proved"


@pytest.mark.parametrize("text", ["enum mode { of, on, stuck }\n", "enum {\n", None])
def test_a_used_file_that_others_change_on_disk_is_seen_when_its_user_is_asked_for(
    text: str | None, folder: Path, bench: Bench
) -> None:
    doc = bench.open("t.rcs")
    assert state(doc) == "proved"
    words = folder / "words.rcs"
    words.unlink() if text is None else words.write_text(text)
    with pytest.raises(Refused, match="the text has errors"):
        bench.ask("proof.filter", file="t.rcs", version=doc["version"], table="t", condition="now = on")
    words.write_text(WORDS)
    assert state(bench.open("t.rcs")) == "proved"
    words.unlink() if text is None else words.write_text(text)
    assert state(bench.open("t.rcs")) != "proved"


def test_a_check_that_outlives_a_text_it_used_is_not_shown_as_known(bench: Bench) -> None:
    """The used file changes while its user is looked at."""
    bench.open("words.rcs")
    bench.ask("tables.open", file="t.rcs")
    check = bench.desk.workspace.check

    def slow(*given: Any) -> Any:
        bench.desk.workspace.check = check  # type: ignore[method-assign]  # once
        answer = check(*given)
        bench.ask("tables.edit", file="words.rcs", version=1, **edit("of", 0, 12, 15))
        return answer

    bench.desk.workspace.check = slow  # type: ignore[method-assign,assignment]  # a text that changes then
    bench.desk._look_at("t.rcs")
    assert not bench.told["tables.file/t.rcs"]["known"]
    assert state(bench.doc("t.rcs")) != "proved"


def test_what_is_no_file_holds_nobody_up(folder: Path, bench: Bench) -> None:
    os.mkfifo(folder / "f.rcs")
    (folder / "g.rcs").symlink_to("g.rcs")
    (folder / "h.rcs").mkdir()
    (folder / "i.rcs").symlink_to("/dev/zero")
    assert "t.rcs" in str(bench.ask("tables.list"))


@pytest.mark.parametrize("where", ["check", "reading"])
def test_a_bug_in_the_way_of_a_text_is_told_and_the_next_text_is_looked_at(
    where: str, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Instead of that it is being proved, for ever; files that use it are looked at, too."""
    assert state(bench.open("t.rcs")) == "proved"
    bench.open("words.rcs")
    does = getattr(bench.desk.workspace, where)

    def fails(file: str, *more: Any) -> Any:
        if "bug" in bench.desk.opened("words.rcs").text and file.endswith("words.rcs"):
            raise RecursionError
        return does(file, *more)

    monkeypatch.setattr(type(bench.desk.workspace), where, lambda _, *given: fails(*given))
    shown = bench.change("tables.edit", "words.rcs", **edit("# a bug, and a table\ntable w {\n}\n"))
    assert shown["known"]
    assert [each["code"] for each in shown["findings"]] == ["RCS902"]
    assert state(shown) == "undecided"
    assert bench.told["tables.file/t.rcs"]["known"]
    bench.now("tables.undo", "words.rcs")
    assert not bench.doc("words.rcs")["findings"]
    assert state(bench.doc("t.rcs")) == "proved"


def test_a_version_never_stands_for_two_texts(
    folder: Path, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file is let go for others, changed by somebody, and opened again: what a page has seen is another text."""
    monkeypatch.setattr(desk, "MOST_OPEN", 1)
    before = bench.open("t.rcs")
    bench.open("words.rcs")
    (folder / "t.rcs").write_text(TABLE.replace("/= off", "on    "))
    with pytest.raises(Refused, match="meanwhile"):
        bench.ask("tables.line", file="t.rcs", version=before["version"], table="t", at=0)
    after = bench.open("t.rcs")
    assert after["version"] > before["version"]
    assert state(after) == "refuted"


@pytest.mark.parametrize("kind", ["undo", "redo", "take", "edit", "cells", "line", "delete", "column"])
def test_nobody_changes_a_text_that_he_has_not_seen(kind: str, folder: Path, bench: Bench) -> None:
    """Another page was quicker: what it did stays, and what could be done again still can."""
    seen = bench.open("t.rcs")["version"]
    bench.change("tables.edit", "t.rcs", **edit("# mine\n"))
    if kind == "redo":
        bench.change("tables.undo", "t.rcs")
    now = bench.doc("t.rcs")
    (folder / "t.rcs").write_text("# others\n")
    bodies: dict[str, Any] = {
        "edit": edit("# his\n"),
        "cells": {"line": 0, "column": 0, "rows": rows(["on"])},
        "line": {"at": 0},
        "delete": {"lines": [{"line": 0}]},
        "column": {"at": 0, "heading": "now", "action": False},
    }
    asked = {"file": "t.rcs", "table": "t", **bodies.get(kind, {})}
    with pytest.raises(Refused, match="meanwhile"):
        bench.ask(f"tables.{kind}", version=seen, **asked)
    assert bench.doc("t.rcs") == now
    bench.ask(f"tables.{kind}", version=now["version"], **asked)
    assert bench.doc("t.rcs")["text"] != now["text"]


def test_counts_are_told_to_the_last_one_and_shares_as_everywhere(folder: Path) -> None:
    """A number of JavaScript tells no two apart beyond 2^53; and what is less than all is never 100 %."""
    many, most = 2**31, 2**31 - 1
    (folder / "t.rcs").write_text(
        f"input x : int 0 .. {most}\ninput y : int 0 .. {most}\noutput out : int 0 .. 3\ntable t {{\n"
        "  | line | x    | y    || out |\n  |------|------|------||-----|\n"
        f"  | a    | >= 1 | >= 1 || 1   |\n}}\n"
    )
    doc = Bench(folder / "system.toml").open("t.rcs")
    [line] = doc["tables"][0]["rows"]
    assert line["share"] == {"text": "> 99.9 %", "of": f"{most**2:,} of {many**2:,} inputs"}
    [finding] = [each for each in doc["findings"] if each["code"] == "RCS401"]
    assert [each["inputs"] for each in finding["witnesses"]] == [f"{many:,} inputs", f"{most:,} inputs"]


def test_a_graph_follows_the_files_that_its_table_uses(tmp_path: Path) -> None:
    (tmp_path / "rcsc.toml").touch()
    words = "enum mode { idle, busy, done }\n"
    (tmp_path / "words.rcs").write_text(words)
    (tmp_path / "t.rcs").write_text(
        "use words\n\nstate cur : mode = idle\ntable t {\n  | line | cur || procedures |\n  |---|---||---|\n"
        "  | a | idle || cur := busy |\n  | b | /= idle || cur := idle |\n}\n"
    )
    bench = Bench(tmp_path / "system.toml")
    doc = bench.open("t.rcs")
    asked = {"file": "t.rcs", "version": doc["version"], "table": "t"}
    assert "done" in bench.ask("graph.show", **asked)["states"]
    bench.open("words.rcs")
    bench.change("tables.edit", "words.rcs", **edit("over", 0, 24, 28))
    bench.look()
    assert "over" in bench.ask("graph.show", **asked)["states"]


def test_what_another_editor_writes_is_seen_once_it_is_at_rest(folder: Path, bench: Bench) -> None:
    """In an open file, and in one that it uses; a text that is changed here stays."""
    bench.open("t.rcs")
    written = folder / "t.rcs"

    def seen() -> str:
        bench.desk.look_at_disk()
        return str(bench.doc("t.rcs")["text"])

    assert seen() == seen() == TABLE
    written.write_text("")  # an editor empties the file, and writes it then
    assert seen() == TABLE
    written.write_text(TABLE.replace("/= off", "on    "))
    assert seen() == TABLE
    assert "/= off" not in seen()
    assert state(bench.doc("t.rcs")) == "refuted"
    bench.change("tables.undo", "t.rcs")
    (folder / "words.rcs").write_text(WORDS.replace("off", "oft"))
    seen()
    seen()
    assert {each["code"] for each in bench.doc("t.rcs")["findings"]} == {"RCS201"}
    assert bench.doc("t.rcs")["dirty"]
    written.write_text("# others\n")
    assert seen() == seen() == TABLE
    written.unlink()
    assert seen() == seen() == TABLE


# --- nothing hangs, nor grows without bound --------------------------------------------------


@pytest.mark.parametrize(("line", "many"), [(999_999, 1), (3, 1), (0, 5_000), (1_000_000, 1)])
def test_a_paste_far_below_a_table_is_refused(line: int, many: int, bench: Bench) -> None:
    doc = bench.open("t.rcs")
    with pytest.raises(Refused, match="has 2 lines"):
        bench.change("tables.cells", "t.rcs", table="t", line=line, column=0, rows=rows(*[["on"]] * many))
    assert bench.doc("t.rcs")["text"] == doc["text"]


def test_what_can_be_undone_is_bounded_by_what_it_holds(folder: Path) -> None:
    found = Document.opened(os.path.realpath(folder / "t.rcs"))
    for at in range(40):
        found.replace(f"# {at}" + "xy"[at % 2] * (MOST_BYTES - 10), "paste")
    held = sum(len(each.old) + len(each.new) for each in found._done)
    assert MOST_KEPT // 2 < held <= MOST_KEPT
    last = found.text
    found.undo()
    found.redo()
    assert found.text == last


def test_a_page_that_asks_on_and_takes_no_answer_is_given_up() -> None:
    hub, client = Hub(lambda work: work()), Client(lambda: None)
    hub.enter(client)
    for number in range(1, MOST_UNREAD + 1):
        hub.ask(client, {"id": number, "kind": "nobody.answers"})
    assert client.waiting == MOST_UNREAD > MOST_OPEN
    with pytest.raises(Malformed):
        hub.ask(client, {"id": MOST_UNREAD + 1, "kind": "nobody.answers"})


# --- nothing leaves the project, nothing is lost ---------------------------------------------


@pytest.mark.parametrize("name", ["./t.rcs", "a/../t.rcs", "t.rcs/", "//t.rcs", "t\0.rcs", "again.rcs"])
def test_a_file_has_one_name(name: str, folder: Path, bench: Bench) -> None:
    """Under a second one it would have a second text."""
    (folder / "a").mkdir()
    (folder / "again.rcs").symlink_to("t.rcs")
    with pytest.raises(Refused, match="no file"):
        bench.ask("tables.open", file=name)


@pytest.mark.parametrize("how", ["file", "folder"])
def test_a_file_that_becomes_a_link_is_neither_read_nor_written(
    how: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    (tmp_path / "rcsc.toml").touch()
    (tmp_path / "in").mkdir()
    inside = tmp_path / "in" / "words.rcs"
    inside.write_text(WORDS)
    outside = tmp_path_factory.mktemp("outside") / "words.rcs"
    outside.write_text(WORDS)  # the very same, so that the disk looks as it was
    bench = Bench(tmp_path / "system.toml")
    bench.open("in/words.rcs")
    doc = bench.change("tables.edit", "in/words.rcs", **edit("# mine\n"))
    if how == "file":
        inside.unlink()
        inside.symlink_to(outside)
    else:
        shutil.rmtree(inside.parent)
        inside.parent.symlink_to(outside.parent)
    for kind, more in (("save", {}), ("save", {"over": True}), ("take", {})):
        with pytest.raises(Refused, match="link"):
            bench.now(f"tables.{kind}", "in/words.rcs", **more)
    assert outside.read_text() == WORDS
    assert bench.doc("in/words.rcs")["text"] == doc["text"]


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "more", ["\ud800", "# \udfff\n", "é" * (MOST_BYTES // 2), "# \n" * (MOST_BYTES // 3)]
)
def test_a_text_that_no_file_could_hold_is_never_taken(
    more: str, end: str, folder: Path, bench: Bench
) -> None:
    """Else it could not be saved, or not be opened again."""
    (folder / "t.rcs").write_text(TABLE, newline=end)
    doc = bench.open("t.rcs")
    with pytest.raises(Refused):
        bench.change("tables.edit", "t.rcs", **edit(more))
    assert bench.doc("t.rcs")["text"] == doc["text"]
    assert formatted(Source("", doc["text"]), "\n")
    bench.ask("tables.save", file="t.rcs")


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_what_nobody_saved_is_kept_when_the_studio_ends(how: str, tmp_path: Path) -> None:
    """And it says where; the project itself stays as it was saved."""
    system = dock(tmp_path / "dock")
    before = (system.parent / "drive.rcs").read_bytes()
    order = [
        sys.executable,
        "-c",
        "import rcsc.front.commands; rcsc.front.commands.main()",
        "studio",
        str(system),
        "--alone",
        "--trust",
    ]
    with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as studio:
        assert studio.stdout
        address = studio.stdout.readline().split()[-1]
        asyncio.run(_typed(address, "# mine, \N{GREEK SMALL LETTER ALPHA}\n"))
        studio.send_signal(getattr(signal, how))
        said = studio.stdout.read()
    assert studio.returncode == 0
    assert said.startswith("the studio is closed\n")
    [where] = [
        line.partition("its text is kept in ")[2]
        for line in said.splitlines()
        if "drive.rcs was not saved" in line
    ]
    assert Path(where).read_bytes() == "# mine, \N{GREEK SMALL LETTER ALPHA}\n".encode() + before
    assert (system.parent / "drive.rcs").read_bytes() == before
    assert where not in listed([str(system.parent)])


def test_a_run_that_is_watched_runs_in_the_studio_until_it_is_ended(tmp_path: Path) -> None:
    """Who says what runs has agreed to it: the page is not asked, and nothing is kept of that."""
    system = dock(tmp_path / "dock")
    order = [
        sys.executable,
        "-c",
        "import rcsc.front.commands; rcsc.front.commands.main()",
        "run",
        str(system),
        "--live",
        "-q",
    ]
    order += ["--executor", "python", "--rate", "20"]

    async def watched(address: str) -> None:
        async with page_at(address) as one:
            rows = await one.heard("run.rows", over=True)
            state = await one.heard("run.state", going=False, open=True, rate=20)
            assert state["ended"].endswith("the script is at its end")
            assert {row["state"] for row in rows["rows"]} == {"done"}

    with subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        assert run.stdout
        told = run.stdout.readline()
        assert told.startswith("the studio is at ")
        asyncio.run(watched(told.split()[-1]))
        run.send_signal(signal.SIGINT)
        said = run.stdout.read()
    assert (run.returncode, said) == (0, "the studio is closed\n")
    assert not Agreement(system.parent).given


async def _typed(address: str, text: str) -> None:
    async with page_at(address) as one:
        await one.ask("tables.open", file="drive.rcs")
        shown = await one.heard("tables.file/drive.rcs")
        await one.ask("tables.edit", file="drive.rcs", version=shown["version"], **edit(text))


def test_texts_that_are_kept_take_nobodys_place(
    folder: Path, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two files of one name in two folders, one that cannot be kept, and one that has nothing to be kept."""
    (folder / "b").mkdir()
    (folder / "b" / "words.rcs").write_text(WORDS, newline="\r\n")
    for name in ("t.rcs", "words.rcs", "b/words.rcs"):
        bench.open(name)
    for name in ("words.rcs", "b/words.rcs"):
        bench.change("tables.edit", name, **edit(f"# {name}\n"))
    said = bench.desk.keep_unsaved()
    kept = {each.partition(" ")[0]: Path(each.rpartition(" kept in ")[2]) for each in said}
    assert {name: path.read_bytes().decode() for name, path in kept.items()} == {
        "words.rcs": f"# words.rcs\n{WORDS}",
        "b/words.rcs": f"# b/words.rcs\n{WORDS}".replace("\n", "\r\n"),
    }
    monkeypatch.setattr(desk, "FOLDER", "t.rcs")  # a file where the folder would be
    assert [each.partition(":")[0] for each in bench.desk.keep_unsaved()] == [
        f"{name} was not saved, and could not be kept" for name in ("words.rcs", "b/words.rcs")
    ]
    assert (folder / "t.rcs").read_text() == TABLE
