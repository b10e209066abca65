"""Requirements in the studio: listed as they stand, opened as runs, and marked on the time line where a run breaks them."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run as rcsc
from tests.across.test_across import _written
from tests.across.test_watched import _WISHES, _with_plant
from tests.studio.driven import seated
from tests.studio.served import Page, page, serving

_HELD = "requirement held monitored : always not (left.runs and boss.wish = nobody)\n"
_BOTH = 'requirement never_both req "SR-1" : always not (left.runs and right.runs)\n'
_CALM = "assume calm assumed : never panel.wish = r\n"


@pytest.fixture
def two(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("RCSC_CACHE_DIR", raising=False)
    path = _with_plant(_written(tmp_path, _BOTH + _HELD + _CALM), *_WISHES)
    assert rcsc(["compile", str(path)]) == 0
    return path


def _talk(path: Path, work: Callable[[Page], Awaitable[None]]) -> None:
    async def inside() -> None:
        async with page(server) as one:
            await one.heard("run.state", open=True)
            await work(one)

    with serving(Opening(path)) as server:
        asyncio.run(inside())


def test_every_requirement_is_listed_as_it_stands_and_a_refuted_one_opens_its_run(two: Path) -> None:
    async def work(one: Page) -> None:
        before = {each["name"]: each for each in await one.ask("required.list")}
        assert {name: each["state"] for name, each in before.items()} == {
            "calm": "assumed",
            "never_both": "unknown",
            "held": "unknown",
        }
        assert (await one.ask("build.prove"))["status"] == 1
        after = {each["name"]: each for each in await one.ask("required.list")}
        both, held = after["never_both"], after["held"]
        assert (both["state"], both["timing"], both["req"], both["log"]) == (
            "proved",
            "scheduled",
            ["SR-1"],
            "",
        )
        assert both["trusts"] == ["assumption `calm` across levels"]
        assert (held["state"], held["place"], held["level"]) == ("refuted", "all.rcs:2", "")
        assert held["log"] == ".rcsc-cache/found/held.mcap"
        await one.ask("log.open", name=held["log"])
        shown = await one.heard("time.state", source="log")
        assert shown["finding"]["text"] == "requirement `held`"

    _talk(two, work)


def test_the_time_line_marks_the_tick_of_a_live_run_that_breaks_one_and_finds_it(two: Path) -> None:
    async def work(one: Page) -> None:
        await one.ask("run.type", line="step 8")
        marks = (await one.ask("time.tracks", since=-1, era=-1))["marks"]
        told = [(mark["tick"], mark["text"]) for mark in marks if mark["kind"] == "finding"]
        assert told == [(5, "requirement `held` is broken: `left.runs` = true, `boss.wish` = nobody")]
        assert await one.ask("time.find", text="not held", tick=0, back=False) == {"tick": 5}
        assert await one.ask("time.find", text="not calm", tick=0, back=False) == {"tick": 7}
        await one.ask("run.type", line="undo")

    _talk(two, work)


@pytest.mark.thorough
@pytest.mark.needs("chromium")
def test_a_user_sees_how_requirements_stand_and_looks_at_the_run_of_one(two: Path) -> None:
    rcsc(["prove", str(two), "--log", str(two.parent / ".rcsc-cache" / "found")])
    with seated(Opening(two)) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("q")
        seat.until("tr[data-name=never_both]", "proved as scheduled, of boss, left, right")
        seat.until("tr[data-name=held]", "refuted")
        seat.click(seat.button("Show its run", "tr[data-name=held]"))
        seat.until("#said", "is shown to everybody")
