"""What the studio hands on: files that show what was, need nothing else, and run nothing that comes to stand in them."""

import asyncio
import base64
import re
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio.server import Server
from rcsc.desk.studio.share.document import of_film, player
from rcsc.front.commands import run as rcsc
from rcsc.views.pages.frame import hashed
from tests.studio.driven import HIGH, WIDE, Seat, dock
from tests.studio.served import Page, Refused, page, serving
from tests.support.films import blue, film_of, pictures, standing, values_at

OVERLAP = ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
HOSTILE = "</script><script>document.title = 'run'</script><img src=x onerror=\"document.title = 'run'\">"

Values = dict[tuple[int, str], dict[str, str]]
"""By tick and level, by name."""


def asked(system: Path, work: Callable[[Page], Any], script: str = "") -> Any:
    """What a page finds out of a studio."""
    with serving(Opening(system, script=script)) as server:
        return asyncio.run(_with(server, work))


async def _with(server: Server, work: Callable[[Page], Any]) -> Any:
    async with page(server) as one:
        return await work(one)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Values]:
    """A moment of a run that was shared, and every level's values by tick as the studio says them."""
    system = dock(tmp_path_factory.mktemp("share") / "dock")
    assert rcsc(["compile", str(system)]) == 0

    async def work(one: Page) -> tuple[str, Values]:
        await one.heard("run.state", open=True)
        await one.ask("run.type", line="run 60")
        await one.ask("run.type", line="drive.bumper = true")
        await one.ask("run.type", line="step 2")
        file = await one.ask("share.moment", tick=40, around=20)
        values = {
            (tick, level): {
                each["name"]: each["text"] for each in await one.ask("time.values", level=level, tick=tick)
            }
            for tick in range(20, 61)
            for level in ("supervisor", "drive")
        }
        for wrong in (
            {"tick": 40, "around": 10**6},
            {"tick": 999, "around": 1},
            {"tick": 40},
            {"tick": -1, "around": 1},
        ):
            with pytest.raises(Refused):
                await one.ask("share.moment", **wrong)
        assert file["name"] == "dock_tick_40.html"
        return file["text"], values

    found: tuple[str, Values] = asked(system, work, script="dock.csv")
    return found


def test_a_file_holds_every_value_of_every_tick_around_the_moment(ran: tuple[str, Values]) -> None:
    text, values = ran
    film = film_of(text)
    assert (film["at"], film["first"], film["last"]) == (40, 20, 60)
    for (tick, level), known in values.items():
        assert values_at(film, level, tick) == known
    for changes in (one["changes"] for level in film["variables"].values() for one in level.values()):
        assert all(before[1] != after[1] for before, after in pairwise(changes))  # changes alone
    assert len(values) == 82


@pytest.mark.needs("egl")
@pytest.mark.parametrize("form", ["mp4", "webp"])
def test_the_run_so_far_is_filmed(form: str, tmp_path: Path) -> None:
    """Without what was undone, and with the lines at which the levels stood."""
    system = dock(tmp_path / "dock")
    assert rcsc(["compile", str(system)]) == 0
    asked_for = {"form": form, "speed": 4, "view": "corner"}

    async def work(one: Page) -> tuple[Any, Any]:
        await one.heard("run.state", open=True)
        await one.ask("run.type", line="run 70")
        await one.ask("run.type", line="undo 10")
        for wrong in ({"form": "avi"}, {"speed": 0}, {"speed": 101}, {"view": "below"}):
            with pytest.raises(Refused):
                await one.ask("filmed.run", **asked_for | wrong)
        one.progress.clear()
        return await one.ask("filmed.run", **asked_for), list(one.progress)

    answer, told = asked(system, work, script="dock.csv")
    assert answer["name"] == f"dock.{form}"
    film = tmp_path / answer["name"]
    film.write_bytes(base64.b64decode(answer["base64"]))
    shown = pictures(film)
    assert len(shown) == 16  # 61 ticks of 40 ms are 2.44 s, four times as fast 0.61 s of 25 pictures each
    assert told[-1] | {"done": 0} == {"text": "pictures", "done": 0, "of": 16}
    places = [blue(picture)[0] for picture in shown]
    assert max(places) - min(places) > 60, "the robot drives to its charger"
    assert (shown[0][-20:] != shown[-1][-20:]).any(), "time and lines stand below"


def test_what_cannot_be_filmed_is_refused_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = dock(tmp_path / "dock")
    assert rcsc(["compile", str(system)]) == 0
    asked_for = {"form": "mp4", "speed": 1, "view": "corner"}

    async def work(one: Page) -> None:
        await one.heard("run.state", open=True)
        monkeypatch.setitem(sys.modules, "rcsc.views.pages.video", None)
        with pytest.raises(Refused, match="is not installed") as missing:
            await one.ask("filmed.run", **asked_for)
        assert missing.value.helps == ["pip install 'rcsc[video]'"]
        monkeypatch.undo()
        monkeypatch.setattr("importlib.import_module", lambda _: object())
        with pytest.raises(Refused, match="install libegl1") as undrawn:
            await one.ask("filmed.run", **asked_for)
        assert undrawn.value.code == "RCS708"
        monkeypatch.undo()

    asked(system, work)

    async def alone(one: Page) -> None:
        await one.heard("run.state", open=True)
        with pytest.raises(Refused, match="a method `space`"):
            await one.ask("filmed.run", **asked_for)

    with serving(Opening(system, alone=True)) as server:
        asyncio.run(_with(server, alone))


@pytest.mark.needs("chromium")
def test_a_shared_moment_is_scrubbed_in_the_file_and_fetches_nothing(
    ran: tuple[str, Values], tmp_path: Path
) -> None:
    file = tmp_path / "moment.html"
    file.write_text(ran[0], encoding="utf-8")
    with Seat(WIDE, HIGH) as seat:
        seat.open(file.as_uri())
        seat.wait("document.querySelector('#moment').dataset.tick === '40'")
        seat.click("#moment article:nth-child(2) summary")  # stays open from tick to tick
        seat.wait("document.querySelector('#moment article:nth-child(2) tbody')")
        for tick, keys in ((20, ("l", "home")), (60, ("end",)), (41, ("home", *["]"] * 21))):
            seat.press(*keys)
            seat.wait(f"document.querySelector('#moment').dataset.tick === '{tick}'")
            seat.until("#time output", f"tick {tick} of 60,")
            level = standing(film_of(ran[0])["boxes"]["drive"], tick)
            assert f"table {level['table']}, line {level['lines'][0]}" in seat.reads(
                "#moment article:nth-child(2)"
            )
            shown = seat.reads("#moment article:nth-child(2) tbody")
            for name, value in ran[1][tick, "drive"].items():
                assert f"{name}\t{value}" in shown
        assert seat.value("performance.getEntriesByType('resource').length") == 0
        assert not seat.said


@pytest.mark.needs("chromium")
@pytest.mark.parametrize("place", ["title", "caption", "svg", "beside"])
def test_nothing_that_stands_in_a_file_is_run(place: str, tmp_path: Path) -> None:
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" onload="document.title = \'run\'">{HOSTILE if place == "svg" else ""}</svg>'
    film = {"at": 1, "first": 1, "last": 1, "tick_ms": 40, "why": "", "levels": [], "tracks": {}, "boxes": {}, "variables": {}, "shown": [],
            "pictures": [{"tick": 1, "svg": svg, "caption": [HOSTILE] if place == "caption" else []}]}  # fmt: skip
    text = of_film(HOSTILE if place == "title" else "a run", film)
    if place == "beside":  # somebody wrote it into the file
        text = text.replace("</body>", f"{HOSTILE}</body>")
    file = tmp_path / "moment.html"
    file.write_text(text, encoding="utf-8")
    with Seat(WIDE, HIGH) as seat:
        seat.open(file.as_uri())
        seat.wait("document.querySelector('#moment').dataset.tick === '1'")  # its own script did
        assert seat.value("document.title") != "run"


def test_the_one_script_is_named_by_its_hash(ran: tuple[str, Values]) -> None:
    scripts = re.findall(r"<script(?: [^>]*)?>", ran[0])
    assert scripts == ['<script type="application/gzip" id="film">', "<script>"]
    assert f"script-src '{hashed(player())}'" in ran[0].replace("&#39;", "'")
    assert f"<script>{player()}</script>" in ran[0]
    assert not re.search(
        r"^(?:import|export) ", re.sub(r"/\*.*?\*/", "", player(), flags=re.DOTALL), re.MULTILINE
    )


def test_a_shared_finding_has_its_witness_its_region_and_its_repair(tmp_path: Path) -> None:
    system = dock(tmp_path / "dock", OVERLAP)

    async def work(one: Page) -> tuple[Any, str]:
        await one.ask("tables.open", file="drive.rcs")
        doc = await one.heard("tables.file/drive.rcs", known=True)
        found = next(each for each in doc["findings"] if each["code"] == "RCS402")
        about = {"file": "drive.rcs", "version": doc["version"]}
        for wrong in (
            {**about, "finding": 999},
            {**about, "version": 99, "finding": 0},
            {"file": "../etc.rcs", "version": 1, "finding": 0},
        ):
            with pytest.raises(Refused):
                await one.ask("handed.finding", **wrong)
        return found, (await one.ask("handed.finding", **about, finding=found["id"]))["text"]

    found, text = asked(system, work)
    read = re.sub(r"<[^>]+>", "", text).replace("&lt;", "<").replace("&gt;", ">")
    [witness] = found["witnesses"]
    for name, value in witness["values"]:
        assert f"{name} = {value}" in read
    assert f"Region: {', '.join(witness['region'])}" in read
    assert "write <= 2499 under waited Proved: " in read
    assert text.count('class="matches"') == 2
    assert "<script" not in text
    assert "default-src 'none'; style-src" in text
