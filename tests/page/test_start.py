"""The start page, of a real `rcsc studio` in a browser: my tables, a new project, what is found in published tables."""

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.front.commands import run as rcsc
from tests.studio.driven import Seat
from tests.studio.served import Refused, page_at

pytestmark = pytest.mark.needs("chromium")
COMMAND = (sys.executable, "-c", "from rcsc.front.commands import main; main()", "studio")
BUTTON = "[...document.querySelectorAll({})].find((one) => one.innerText.includes({}))"
READY = "document.documentElement?.dataset.ready === 'yes'"


@contextlib.contextmanager
def studio(folder: Path, *arguments: str) -> Iterator[tuple[Seat, str]]:
    """A studio that was started in a folder, a browser at its address, and what the studio says as it ends."""
    environment = os.environ | {"XDG_STATE_HOME": str(folder / ".state")}
    with subprocess.Popen(
        [*COMMAND, *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    ) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        assert first.startswith("the studio is at http://"), first
        try:
            with Seat(1280, 800) as seat:
                seat.enter(first.split()[-1])
                yield seat, first.split()[-1]
                assert not seat.said
        finally:
            process.send_signal(signal.SIGINT)
            rest = process.stdout.read()
        assert process.wait() == 0, rest
        assert rest.endswith("the studio is closed\n"), rest


def press(seat: Seat, where: str, text: str) -> None:
    found = BUTTON.format(json.dumps(where), json.dumps(text))
    seat.wait(found)
    seat.value(f"{found}.click()")


def arrived(seat: Seat) -> None:
    """Another thing is open: the studio itself is there, and not the start page."""
    seat.wait(f"location.pathname.endsWith('/') && {READY}")


def started(seat: Seat, address: str) -> None:
    seat.press("h")
    seat.wait(f"location.pathname.endsWith('start.html') && {READY}")
    assert seat.value("document.getElementById('back').getAttribute('href')") == "./"
    assert seat.value("location.href").startswith(address)


def test_where_nothing_is_a_project_is_made_and_opened_and_is_there_afterwards(tmp_path: Path) -> None:
    with studio(tmp_path) as (seat, address):
        assert seat.value("location.href") == f"{address}start.html"
        seat.until("#tables", "None here yet")
        assert seat.value("document.getElementById('back').hidden")
        seat.value("document.querySelector('[name=folder]').value = 'door'")
        press(seat, "#make button", "Make and open it")
        arrived(seat)
        seat.until(".standing", "proved")
        assert rcsc(["check", str(tmp_path / "door")]) == 0
        started(seat, address)
        seat.until("#tables", "door")
        seat.value("document.querySelector('[name=folder]').value = 'door'")
        press(seat, "#make button", "Make and open it")
        seat.until("#said", "the folder is not empty")
        press(seat, "#back", "Back to")
        arrived(seat)


def test_a_published_finding_is_shown_by_its_run_of_a_copy(tmp_path: Path) -> None:
    """One press opens and proves it, one shows the run; nothing is left of it, here or among what was opened."""
    with studio(tmp_path) as (seat, address):
        press(seat, "#gallery button", "Prove and run published")
        arrived(seat)
        seat.until("#verdict", "3 requirements refuted")
        seat.value("document.querySelector('#verdict summary').click()")
        press(seat, "#verdict li button", "Show its run")
        seat.until(".card", "property `stands_when_ready` is broken")
        started(seat, address)
        seat.until("#tables", "None here yet")
        press(seat, "#gallery button", "As published: status_published")
        arrived(seat)
        seat.until(".standing", "refuted")
        seat.until(".standing", "no line of table")
    assert not [*tmp_path.iterdir()]


def test_what_is_here_is_found_and_what_cannot_be_opened_says_why(tmp_path: Path) -> None:
    assert rcsc(["new", str(tmp_path / "carts" / "left"), "--template", "system"]) == 0
    assert rcsc(["new", str(tmp_path / "hand")]) == 0
    (tmp_path / "none").mkdir()
    with studio(tmp_path) as (seat, address):
        rows = "[...document.querySelectorAll('#tables li')].map((one) => [...one.children].map(({ innerText }) => innerText))"
        assert seat.value(rows) == [["hand", "2 files"], ["carts/left/system.toml", "system"]], (
            "the nearest first"
        )
        for path, why in (
            ("nowhere", "there is no system"),
            ("none", "has no system.toml"),
            ("hand/rcsc.toml", "rcsc.toml"),
        ):
            seat.value(f"document.querySelector('[name=path]').value = {path!r}")
            press(seat, "#open button", "Open")
            seat.until("#said.wrong", why)
        press(seat, "#tables button", "carts/left/system.toml")
        arrived(seat)
        seat.until("body", "agree")  # the code of a folder that was only found runs when somebody agreed
        assert not (tmp_path / "carts" / "left" / "generated").exists()
        started(seat, address)
        seat.until("#tables", "Opened before")


def test_every_page_goes_with_what_is_opened(tmp_path: Path) -> None:
    """Two pages of one studio: what is opened in one is in the other."""
    for name in ("first", "second"):
        assert rcsc(["new", str(tmp_path / name)]) == 0
    with studio(tmp_path, "first") as (seat, address), Seat(1280, 800) as other:
        other.enter(address)
        other.until("#title", "first")
        started(seat, address)
        press(seat, "#tables button", "second")
        arrived(seat)
        other.until("#title", "second")
        assert not other.said


def test_what_a_browser_keeps_of_a_project_it_finds_again(tmp_path: Path) -> None:
    """By its port, which stays; a second studio of the project takes another."""
    assert rcsc(["new", str(tmp_path / "door")]) == 0
    with studio(tmp_path, "door") as (_, address):
        port = address.split("/")[2]
        with studio(tmp_path, "door") as (_, second):
            assert second.split("/")[2] != port
    with studio(tmp_path, "door") as (_, again):
        assert again.split("/")[2] == port
        assert again != address, "the token is new"


def test_a_page_makes_and_opens_nothing_but_what_is_listed_or_new(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "note").touch()
    asked = (
        ("start.make", {"folder": "\0", "template": "level"}, "does not print"),
        ("start.make", {"folder": "mine", "template": "level"}, "not empty"),
        ("start.make", {"folder": "new", "template": "../level"}, "none of level"),
        ("start.look", {"entry": "..", "file": "system.toml"}, "none of cia402"),
        ("start.look", {"entry": "tcas", "file": "../../system.toml"}, "none of published.rcs"),
    )

    async def refused(address: str) -> None:
        async with page_at(address) as one:
            for kind, body, why in asked:
                with pytest.raises(Refused, match=why):
                    await one.ask(kind, **body)

    with studio(tmp_path) as (_, address):
        asyncio.run(refused(address))
    assert {one.name for one in tmp_path.iterdir() if not one.name.startswith(".")} == {"mine"}
