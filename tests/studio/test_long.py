"""A long run is read in pieces: pages hear how far it is, others are answered meanwhile, and what is shown is what the log has."""

import asyncio
import csv
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.desk.studio import plots
from rcsc.desk.studio.runs.shown import MOST_RECORDS
from rcsc.front.commands import run as rcsc
from rcsc.run.log.export import csv_text
from rcsc.run.log.read import Log, read
from tests.studio.driven import dock
from tests.studio.served import Page, page, serving, until

CYCLES = 3 * plots.A_PIECE


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The robot that docks, and the log of a run of it that goes on long after its script."""
    folder = tmp_path_factory.mktemp("long")
    system, log = dock(folder / "dock"), folder / "long.mcap"
    text = system.read_text(encoding="utf-8").replace('script = "dock.csv"\n', "")
    system.write_text(text, encoding="utf-8")
    assert rcsc(["run", str(system), "--cycles", str(CYCLES), "--log", str(log)]) == 0
    return system, log


def looked_at(long: tuple[Path, Path], work: Callable[[Page, Log], Awaitable[None]]) -> None:
    """A page that looks at the log."""

    async def inside() -> None:
        async with page(server) as one:
            await one.heard("time.state", source="log")
            await work(one, read(long[1]))

    with serving(Opening(long[0]), logs=long[1:]) as server:
        asyncio.run(inside())


def test_the_time_line_is_told_in_pieces_and_nothing_is_left_out(long: tuple[Path, Path]) -> None:
    async def work(one: Page, log: Log) -> None:
        told: dict[str, list[list[Any]]] = {level.name: [] for level in log.levels}
        since = era = -1
        pieces = 0
        while since < log.last:
            answer = await one.ask("time.tracks", era=era, since=since)
            assert answer["from"] == since
            assert 0 < answer["to"] - since <= MOST_RECORDS // len(log.levels) + 1
            for level, changes in answer["levels"].items():
                told[level] += changes
            since, era, pieces = answer["to"], answer["era"], pieces + 1
        assert pieces > 1
        for level in log.levels:
            wanted, last = [[0, "", "", ""]], ["", "", ""]
            for tick, values in list(level.track)[1:]:
                now = [level.sign.table_of(level.level, values), level.sign.line_of(level.level, values), ""]
                if now != last:
                    wanted.append([tick, *now])
                    last = now
            assert told[level.name] == wanted

    looked_at(long, work)


def test_others_are_answered_while_curves_are_read_and_a_curve_can_be_given_up(
    long: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plots, "A_PIECE", 20)

    async def work(one: Page, _: Log) -> None:
        asked = await one.send("plot.curves", names=["drive.travelled_mm", "drive.waited"])
        given_up = await one.send("plot.curves", names=["drive.lateral_mm"])
        await one.socket.send_json({"id": given_up, "cancel": True})
        quick = await one.ask("time.moment", tick=5)
        assert quick["tick"] == 5
        assert not one._answers[asked].done()
        assert len((await one.answer(asked))["curves"]) == 2
        assert await one.answer(given_up) == {"id": given_up, "cancelled": True}
        assert one.progress[0]["of"] == CYCLES

    looked_at(long, work)


def test_curves_are_what_the_log_has_with_a_gap_where_nobody_has_set_a_number(
    long: tuple[Path, Path],
) -> None:
    names = ["drive.travelled_mm", "drive.lateral_mm", "drive.speed_mm_s", "drive.target_mm"]

    async def work(one: Page, log: Log) -> None:
        rows = list(csv.DictReader(csv_text(log).splitlines()))
        known = [name for name in names if name in rows[0]]
        assert len(known) >= 3
        gaps = 0
        for curve in (await one.ask("plot.curves", names=known))["curves"]:
            changes, at = curve["changes"], 0
            for row in rows:
                while at + 1 < len(changes) and changes[at + 1][0] <= int(row["tick"]):
                    at += 1
                value = row[curve["name"]]
                assert changes[at][1] == (float(value) if value else None), (curve["name"], row["tick"])
                gaps += not value
            assert changes[0] == [0, None], "before the first cycle nobody has set what the plant fills"
        assert gaps

    looked_at(long, work)


def test_a_plant_that_does_not_come_back_is_told_of_by_its_cycle(long: tuple[Path, Path]) -> None:
    """Every page hears of it, also one that comes meanwhile, and hears when it is over."""
    base, stuck = long[0].parent / "base.py", long[0].parent / "stuck"
    text = base.read_text(encoding="utf-8")
    first = "    def step(self, seconds: float) -> None:\n"
    assert text.count(first) == 1
    waits = f"        while __import__('pathlib').Path({str(stuck)!r}).exists():\n            pass\n"
    base.write_text(text.replace(first, first + waits), encoding="utf-8")

    async def inside() -> None:
        async with page(server) as one:
            await one.heard("run.state", open=True)
            await one.ask("run.type", line="step 3")
            stuck.touch()
            asked = await one.send("run.type", line="step 2")
            async with page(server) as other:
                for each in (one, other):
                    await until(lambda each=each: "run.held" in each.events)  # type: ignore[misc]
                    assert each.events["run.held"]["text"].startswith(
                        "cycle 4 does not come to its end, for "
                    )
                    assert "Ctrl-C" in each.events["run.held"]["help"]
                stuck.unlink()
                await one.answer(asked)
                for each in (one, other):
                    await each.heard("run.held", text="", help="")

    with serving(Opening(long[0])) as server:
        asyncio.run(inside())


def test_a_log_of_another_system_is_said_to_be_one(long: tuple[Path, Path], tmp_path: Path) -> None:
    other = dock(tmp_path / "other")
    text = other.read_text(encoding="utf-8")
    other.write_text(text.replace('name = "dock"', 'name = "another"'), encoding="utf-8")

    async def told(system: Path) -> str:
        with serving(Opening(system), logs=long[1:]) as server:
            async with page(server) as one:
                said: str = (await one.heard("time.state", source="log"))["other"]
                return said

    assert asyncio.run(told(other)) == "dock"
    assert asyncio.run(told(long[0])) == ""
