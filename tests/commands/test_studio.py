"""`rcsc studio` as a user starts it: one address, a page behind it, and an end at Ctrl-C."""

import asyncio
import contextlib
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest

from rcsc.base.host.trust import Agreement
from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.build import NO_SYSTEM
from rcsc.desk.studio.server import Server
from rcsc.front.commands import run
from rcsc.front.commands.shared.systems import tables_meant
from tests.studio.served import Page, Refused, page, page_at, serving, until

DOCK = Path(__file__).parents[1] / "data" / "dock"
COMMAND = (sys.executable, "-c", "from rcsc.front.commands import main; main()", "studio", "--trust")


NO_REQUESTS = (
    *(
        b"\x16\x03\x01\x02\x00",
        b"GET\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost : x\r\n\r\n",
    ),
    *(b"GET /" + b"a" * 20_000, b"GET / HTTP/1.1\r\nX: " + b"a" * 20_000 + b"\r\n\r\n", b"\0" * 100),
    b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\nContent-Length: 3\r\n\r\nzz",
)
"""Anybody on this machine may send such, as often as he likes: it is not printed where the studio runs."""


def test_the_token_is_in_no_command_line(tmp_path: Path) -> None:
    shutil.copytree(DOCK, tmp_path / "dock", ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    opener, seen = tmp_path / "xdg-open", tmp_path / "seen"
    opener.write_text(f'#!/bin/sh\nprintf %s "$*" > {seen}.part && mv {seen}.part {seen}\n', encoding="utf-8")
    opener.chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    with subprocess.Popen(
        [*COMMAND, str(tmp_path / "dock"), "--open"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=environment,
    ) as studio:
        assert studio.stdout is not None
        address = studio.stdout.readline().split()[-1]
        token = address.split("/")[3]
        while not seen.exists():
            time.sleep(0.05)
        path = Path(seen.read_text(encoding="utf-8").removeprefix("file://"))
        assert token not in str(path)
        assert f'content="0; url={address}"' in path.read_text(encoding="utf-8")
        assert [one.stat().st_mode & 0o777 for one in (path, path.parent)] == [0o600, 0o700]
        studio.send_signal(signal.SIGINT)
        studio.wait(60)
        assert not path.parent.exists()


def planted(folder: Path) -> Path:
    """The docking robot with code of somebody's that leaves a mark; the mark."""
    shutil.copytree(DOCK, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    mark = folder.parent / "ran"
    base = folder / "base.py"
    base.write_text(
        f"import pathlib; pathlib.Path({str(mark)!r}).touch()\n{base.read_text(encoding='utf-8')}",
        encoding="utf-8",
    )
    (folder / "sitecustomize.py").write_text(base.read_text(encoding="utf-8"), encoding="utf-8")
    return mark


@pytest.mark.usefixtures("kept_proofs")
def test_commands_about_tables_import_nothing_of_their_folder(tmp_path: Path) -> None:
    """In a process of its own, begun in the folder; an extern procedure names a module there, too."""
    mark = planted(tmp_path / "dock")
    with (tmp_path / "dock" / "drive.rcs").open("a", encoding="utf-8") as table:
        table.write(
            '\nextern procedure look writes look_seen python "base:look" c "look"\nstate look_seen : bool\n'
        )
    commands = ("check .", "fmt --check .", "prove .", "compile -q .")
    asked = f"from rcsc.front.commands import run; print(*(run(one.split()) for one in {commands}), sep=',')"
    said = subprocess.run(
        [sys.executable, "-c", asked], cwd=tmp_path / "dock", capture_output=True, text=True, check=True
    )
    assert {*said.stdout.splitlines()[-1].split(",")} <= {"0", "1"}, said.stderr
    assert not mark.exists()


def test_opening_a_folder_runs_none_of_its_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before somebody agreed, whatever a page asks; tables, proofs and graphs are there. Once a folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    folder = tmp_path / "dock"
    mark = planted(folder)
    opening = Opening(folder / "system.toml", ordered=True)
    body = {
        "file": "drive.rcs", "table": "dock", "line": "step 3", "name": "dock", "text": "drive", "part": "s", "version": 1, "tick": 1,
        "level": "drive", "variable": "drive.fault", "rate": None, "to": 1,
    }  # fmt: skip

    async def asked(server: Server) -> None:
        async with page(server) as one:
            state = await one.heard("build.state", asks=str(folder))
            assert not state["doing"]
            await one.heard("run.state", open=False)
            assert "drive.rcs" in str(await one.ask("tables.list"))
            await one.ask("tables.open", file="drive.rcs")
            await one.heard("tables.file/drive.rcs", known=True)
            for kind in sorted(set(server.hub._handlers) - {"build.trust"}):
                with contextlib.suppress(Refused):
                    await one.ask(kind, **body)
            with pytest.raises(Refused, match="nobody agreed"):
                await one.ask("build.open")
            assert not mark.exists()
            assert not (folder / "generated").exists()
            await one.ask("build.trust")
            await one.heard("run.state", open=True)
            assert mark.exists()

    async def opened(server: Server) -> None:
        async with page(server) as one:
            await one.heard("run.state", open=True)

    for does in (asked, opened):
        agreement = Agreement(folder)
        assert agreement.given == (does is opened)
        with serving(opening, agreement=agreement) as server:
            asyncio.run(does(server))


def test_it_says_one_address_and_ends_at_an_interrupt(tmp_path: Path) -> None:
    shutil.copytree(DOCK, tmp_path / "dock", ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    with subprocess.Popen(
        [*COMMAND, str(tmp_path / "dock")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    ) as studio:
        assert studio.stdout is not None
        said = studio.stdout.readline()
        found = re.fullmatch(r"the studio is at (http://127\.0\.0\.1:\d+/)([\w-]{32}/)\n", said)
        assert found, said
        with urlopen(found[1] + found[2], timeout=60) as answer:  # noqa: S310  # the address was matched
            assert b"rcsc studio" in answer.read()
        with pytest.raises(HTTPError, match="403"):
            urlopen(found[1], timeout=60)  # noqa: S310
        for no_request in NO_REQUESTS:
            with socket.create_connection(("127.0.0.1", int(found[1].split(":")[2][:-1])), timeout=60) as one:
                one.sendall(no_request)
                assert one.recv(65_536).split()[1] == b"400"
        studio.send_signal(signal.SIGINT)  # while the tables are being compiled
        rest, errors = studio.communicate(timeout=120)
    assert (studio.returncode, rest, errors) == (0, "the studio is closed\n", "")


@pytest.mark.parametrize(("options", "ordered"), [((), ["dock", "stop", "undock"]), (("--by-hand",), None)])
def test_the_script_that_the_system_names_orders_it_as_in_a_run(
    options: tuple[str, ...], ordered: list[str] | None, tmp_path: Path
) -> None:
    shutil.copytree(DOCK, tmp_path / "dock", ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))

    async def rows(address: str) -> list[str] | None:
        async with page_at(address) as one:
            assert (await one.heard("run.state", open=True))["title"] == "dock"
            await one.ask("run.type", line="step 80")
            said = one.events.get("run.rows")
            return said and [row["text"] for row in said["rows"]]

    with subprocess.Popen(
        [*COMMAND, str(tmp_path / "dock"), *options], stdout=subprocess.PIPE, text=True, cwd=tmp_path
    ) as studio:
        try:
            assert studio.stdout is not None
            assert asyncio.run(rows(studio.stdout.readline().split()[-1])) == ordered
        finally:
            studio.send_signal(signal.SIGINT)


def test_what_is_not_in_order_is_not_served(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert (
        run(["studio", "--by-hand"]) != 0
    )  # it speaks of a system; without that the start page would be served
    assert "no system.toml" in capfd.readouterr().err
    assert run(["studio", "nothing"]) == 2
    (tmp_path / "system.toml").write_text("name = 3\n")
    assert run(["studio"]) == 1
    assert "the studio is at" not in capfd.readouterr().out
    assert run(["studio", str(DOCK), "--script", "in", "--by-hand"]) == 2


# --- tables that belong to no system ---

LONE = "input a : bool\ntable t {\n  | line | a ||\n  |------|---||\n  | x    |   ||\n}\n"


def test_tables_that_belong_to_no_system_are_meant_by_their_file_or_their_folder(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("lone", "empty", "dock"):
        (tmp_path / folder).mkdir()
    Path("lone/t.rcs").write_text(LONE)
    shutil.copytree(DOCK, "dock", ignore=shutil.ignore_patterns("generated"), dirs_exist_ok=True)
    Path("dock/beside.rcs").write_text(LONE)
    nowhere, system = Path("lone/system.toml"), Path("dock/system.toml")
    assert tables_meant("lone") == tables_meant("lone/t.rcs") == nowhere
    assert tables_meant("dock/drive.rcs") == tables_meant("dock/words.rcs") == system.resolve()
    assert tables_meant("dock/beside.rcs") == system
    assert [tables_meant(each) for each in ("dock", "empty", "t.rcs", "make_boxt", None)] == [None] * 5
    assert tables_meant(".") == tables_meant(None, (Path("run.mcap"),)) == Path("system.toml")
    for command in ("studio", "run"):
        assert run([command, "empty"]) == 2
    monkeypatch.chdir("lone")
    assert tables_meant(None) == Path("system.toml")
    monkeypatch.chdir("../dock")
    (tmp_path / "dock" / "empty").mkdir()
    capfd.readouterr()
    assert run(["studio", "empty"]) == run(["run", "empty"]) == 2
    assert capfd.readouterr().err.count("the folder `empty` has no system.toml") == 2


def test_tables_that_belong_to_no_system_are_proved_and_run_once_there_is_one(tmp_path: Path) -> None:
    folder = tmp_path / "a robot, \N{GREEK SMALL LETTER ALPHA}"
    shutil.copytree(DOCK, folder, ignore=shutil.ignore_patterns("generated", ".rcsc-cache"))
    system = folder / "system.toml"
    text = system.read_text(encoding="utf-8")
    system.unlink()

    async def work(one: Page) -> None:
        state = await one.heard("run.state", open=False, why=NO_SYSTEM)
        assert NO_SYSTEM in state["text"]
        listed = await one.ask("tables.list")
        assert [(each["file"], each["first"]) for each in listed] == [
            ("drive.rcs", True), ("supervisor.rcs", False),
        ]  # fmt: skip
        await one.ask("tables.open", file="drive.rcs")
        await until(lambda: one.events.get("tables.file/drive.rcs", {}).get("known"))
        for kind in ("build.open", "build.prove", "run.go"):
            with pytest.raises(Refused, match="belong to no system"):
                await one.ask(kind)
        system.write_text(text, encoding="utf-8")
        assert (await one.ask("build.open"))["ok"]
        await one.heard("run.state", open=True)

    async def inside() -> None:
        async with page(server) as one:
            await work(one)

    with serving(Opening(system), first=folder / "drive.rcs") as server:
        asyncio.run(inside())
