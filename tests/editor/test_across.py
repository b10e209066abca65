"""Requirements across levels as they are typed: findings, what a name is, what could be written, and renaming through the levels."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rcsc.desk.editor.workspace import Workspace
from rcsc.front.commands import run
from rcsc.lang.project import load
from rcsc.lang.resolve import resolve
from tests.editor.client import PATIENCE_S, WHOLE, Client, RefusedError, applied

FILE = "requirements.rcs"


@pytest.fixture
def cart(tmp_path: Path) -> Path:
    """A system as `rcsc new` writes it: a supervisor over an axis, with three requirements across levels."""
    folder = tmp_path / "cart"
    assert run(["new", str(folder), "--template", "system"]) == 0
    return folder


@pytest.fixture
def client(cart: Path) -> Iterator[Client]:
    one = Client(cart, WHOLE)
    yield one
    one.stop()


def place(text: str, words: str, word: str) -> tuple[int, int]:
    """Where a word ends in the first line that has these words."""
    line = next(at for at, each in enumerate(text.splitlines()) if words in each)
    row = text.splitlines()[line]
    return line, row.index(word, row.index(words)) + len(word)


def shown(folder: Path, text: str, workspace: Workspace | None = None) -> list[tuple[str, str]]:
    workspace = workspace or Workspace()
    workspace.open(str(folder / FILE), text)
    return [(each.code, each.message) for each in workspace.check(str(folder / FILE)).findings]


def test_findings_are_those_of_a_check_with_the_levels_as_they_are_typed(cart: Path) -> None:
    text, workspace = (cart / FILE).read_text(), Workspace()
    assert shown(cart, text, workspace) == []
    [(code, message)] = shown(cart, text.replace("axis.speed_mm_s = 0", "axis.speed = 0", 1), workspace)
    assert (code, "speed" in message) == ("RCS201", True)
    assert shown(cart, text, workspace) == []
    axis = (cart / "axis.rcs").read_text()
    workspace.open(str(cart / "axis.rcs"), axis.replace("speed_mm_s", "velocity_mm_s"))
    assert {code for code, _ in shown(cart, text, workspace)} == {"RCS201"}
    workspace.open(str(cart / "axis.rcs"), axis.replace("output speed_mm_s : int", "output speed_mm_s : imt"))
    assert {code for code, _ in shown(cart, text, workspace)} == {"RCS201"}, "the level as it last was"
    workspace.open(str(cart / "axis.rcs"), axis)
    assert shown(cart, text, workspace) == []


def test_of_a_system_that_was_never_in_order_nothing_is_told(cart: Path) -> None:
    """It is told of the level."""
    axis = cart / "axis.rcs"
    axis.write_text(axis.read_text().replace("output speed_mm_s : int", "output speed_mm_s : imt"))
    assert shown(cart, (cart / FILE).read_text()) == []


def test_a_half_written_requirement_takes_no_other_with_it(cart: Path) -> None:
    text = (cart / FILE).read_text() + "requirement more : always axis.\n"
    assert {code for code, _ in shown(cart, text)} == {"RCS101"}
    workspace = Workspace()
    shown(cart, text, workspace)
    program = workspace.reading(str(cart / FILE)).nearest
    assert program is not None
    assert [each.name for each in program.properties] == ["pause_stands", "done_stands", "order_first"]


def hovered(client: Client, text: str, words: str, word: str) -> str:
    answer = client.ask("textDocument/hover", client.at(FILE, *place(text, words, word)))
    return "" if answer is None else str(answer["contents"]["value"])


def test_a_name_is_that_of_its_level(client: Client, cart: Path) -> None:
    text = (cart / FILE).read_text() + "property there : cart.position >= 0 [mm]\n"
    client.open(FILE, text)
    client.findings(FILE)
    assert "output speed_mm_s : int -300 .. 300 [mm/s] safe 0" in hovered(
        client, text, "pause_stands", "speed_mm"
    )
    assert "written by table `move`" in hovered(client, text, "pause_stands", "speed_mm")
    assert "level `axis` of the system" in hovered(client, text, "next axis", "axis")
    assert "of `cart`, outside the levels" in hovered(client, text, "there", "position")
    for word, file in (
        ("speed_mm", "axis.rcs"),
        ("supervisor", "supervisor.rcs"),
        ("to_axis", "supervisor.rcs"),
        ("pause", "words.rcs"),
    ):
        at = place(text, "whenever", word)
        [found] = client.ask("textDocument/definition", client.at(FILE, *at))
        assert found["uri"].endswith(f"/{file}"), word


@pytest.mark.parametrize(
    ("typed", "offered", "not_offered"),
    [
        ("requirement more : always axis.", {"speed_mm_s", "position_mm", "now"}, {"axis", "to_axis"}),
        ("requirement more : always supervisor.axis.", {"status", "why", "resting"}, {"speed_mm_s"}),
        ("requirement more : always ", {"axis", "supervisor", "cart"}, {"speed_mm_s"}),
        ("requirement more : always axis.now = ", {"still", "stuck"}, {"speed_mm_s"}),
    ],
)  # fmt: skip
def test_completion_knows_the_levels(
    client: Client, cart: Path, typed: str, offered: set[str], not_offered: set[str]
) -> None:
    text = (cart / FILE).read_text()
    client.open(FILE, text)
    client.findings(FILE)
    client.change(FILE, f"{text}{typed}\n")
    at = client.at(FILE, len(text.splitlines()), len(typed))
    labels = {each["label"] for each in client.ask("textDocument/completion", at)["items"]}
    assert offered <= labels
    assert not labels & not_offered


def _renamed(client: Client, file: str, at: tuple[int, int], new: str) -> set[str]:
    """Rename, write what comes of it, and return the files that changed."""
    edit: dict[str, Any] = client.ask("textDocument/rename", {**client.at(file, *at), "newName": new})
    for uri, edits in edit["changes"].items():
        path = Path(uri.removeprefix("file://"))
        path.write_text(applied(path.read_text(), edits))
    return {uri.rpartition("/")[2] for uri in edit["changes"]}


def test_renaming_goes_from_a_level_to_the_requirements_and_back(client: Client, cart: Path) -> None:
    axis = (cart / "axis.rcs").read_text()
    client.open("axis.rcs", axis)
    at = place(axis, "state now", "now")
    assert _renamed(client, "axis.rcs", at, "where") == {"axis.rcs"}, "nothing across levels speaks of it"
    client.change("axis.rcs", (cart / "axis.rcs").read_text())
    at = place((cart / "axis.rcs").read_text(), "output speed_mm_s", "speed_mm_s")
    # Where `system.toml` has the name, it is for who renames to change that: the client is told.
    assert _renamed(client, "axis.rcs", at, "fast") == {"axis.rcs", FILE}
    assert "axis.fast = 0" in (cart / FILE).read_text()
    told = client.heard("window/showMessage")
    assert "system.toml" in told["message"]
    client.change("axis.rcs", (cart / "axis.rcs").read_text())
    text = (cart / FILE).read_text()
    client.open(FILE, text)
    assert _renamed(client, FILE, place(text, "pause_stands", "fast"), "speed_mm_s") == {
        "axis.rcs",
        FILE,
    }
    client.change("axis.rcs", (cart / "axis.rcs").read_text())
    client.change(FILE, (cart / FILE).read_text())
    words = (cart / "words.rcs").read_text()
    client.open("words.rcs", words)
    client.open("supervisor.rcs", (cart / "supervisor.rcs").read_text())
    found = _renamed(client, "words.rcs", place(words, "pause", "pause"), "halt")
    assert {"words.rcs", "supervisor.rcs", FILE} <= found
    assert run(["check", str(cart)]) == 0
    for root in ("axis.rcs", "supervisor.rcs"):
        loaded = load([str(cart / root)])
        assert not isinstance(resolve(str(cart / root), loaded), tuple)


def test_a_level_is_not_renamed_by_a_requirement(client: Client, cart: Path) -> None:
    text = (cart / FILE).read_text()
    client.open(FILE, text)
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s and client.findings(FILE):
        time.sleep(0.05)
    with pytest.raises(RefusedError, match="the system's description"):
        client.ask("textDocument/prepareRename", client.at(FILE, *place(text, "next axis", "axis")))
