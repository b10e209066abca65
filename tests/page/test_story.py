"""A first-time user in a real browser: from a table that is wrong to a run that is done, by mouse and by keyboard alone."""

import asyncio
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from rcsc.front.commands import run as rcsc
from rcsc.front.commands.shared.cells import Drawn
from tests.studio.driven import HIGH, WIDE, Seat, dock, seated
from tests.studio.served import page, serving

pytestmark = pytest.mark.needs("chromium")
OVERLAP = ("< 2500 || tick             | 400 ", "       || tick             | 400 ")
"""A line whose cell is emptied matches where another does."""
OFFERED = (
    "[...document.querySelector('.table-choice')?.options ?? []].some(({ text }) => text.startsWith('goto '))"
)
"""The table is among those that one can choose."""
GRAPHS = "document.querySelectorAll('.graph canvas').length > 2"
NOW = "Number(document.querySelector('#time [role=slider]').getAttribute('aria-valuenow'))"
"""The tick that the time line shows."""


def by_mouse(seat: Seat) -> None:
    """To the table that is wrong, its repair taken, the file written, and the system run to the end."""
    seat.click(seat.button("Tables"))
    seat.wait(OFFERED)
    seat.choose(".table-choice", "goto ")
    _told_at_the_cell(seat)
    seat.click(seat.button("Run the table at it"))
    seat.until(".witness-run", "2 of 7 lines match: a STATE-TABLE error, and no line runs")
    seat.click("tr.finding button.repair")
    _mended(seat)
    seat.click(seat.button("Save"))
    seat.until("#said", "is written")
    seat.click(seat.button("Levels"))
    seat.click(seat.button("Prove, compile and open again"))
    seat.until("#state", "paused at cycle 0")
    seat.click(seat.button("Run", ".bar"))
    seat.until(".ended", "the script is at its end")


def by_keys(seat: Seat) -> None:
    """The same without a mouse: what is used is reached by a key, or by going on to it."""
    seat.press("2")
    seat.wait(OFFERED)  # a letter chooses among what is there
    seat.go_to("Table", kind="SELECT")
    seat.press("g")
    _told_at_the_cell(seat)
    seat.go_to("Run the table at it")
    seat.press("enter")
    seat.until(".witness-run li", "line late matches, and would set: ")
    seat.go_to("write <= 2499")
    seat.press("enter")
    _mended(seat)
    seat.press("ctrl+s")
    seat.until("#said", "is written")
    seat.press("escape", "1")
    seat.go_to("Prove, compile and open again")
    seat.press("enter")
    seat.until("#state", "paused at cycle 0")
    seat.press("escape", "space")
    seat.until(".ended", "the script is at its end")


def _told_at_the_cell(seat: Seat) -> None:
    """The overlap stands in words below its line, with the input that shows it."""
    seat.until("tr.finding.error .told", "Wrong: lines go and late of table goto both match some input")
    assert "waited = 2500" in seat.reads("tr.finding.error .witness-more")
    assert seat.reads("tr.finding.error .region-words").startswith("Region: ")
    assert seat.reads(".standing").startswith("✗ failed")
    assert seat.value(
        "[...document.querySelectorAll('tr.wrong-line')].map(({ dataset }) => dataset.name)"
    ) == ["go", "late"]


def _mended(seat: Seat) -> None:
    """Nothing is marked any more, and the table is proved."""
    seat.wait("!document.querySelector('tr.finding.error, .wrong-line, .wrong-cell')")
    seat.until(".standing", "✓ proved")


@pytest.mark.parametrize("hands", [by_mouse, by_keys])
def test_a_wrong_table_is_mended_written_run_and_looked_back_at(
    hands: Callable[[Seat], None], tmp_path: Path
) -> None:
    system = dock(tmp_path / "dock", OVERLAP)
    drive = system.parent / "drive.rcs"
    with seated(Opening(system, script="dock.csv")) as seat:
        seat.until(".view-run .finding", "RCS402")
        hands(seat)
        assert "<= 2499" in drive.read_text(encoding="utf-8")
        assert rcsc(["fmt", "--check", str(drive)]) == 0
        seat.wait(f"{NOW} > 100")  # the end is told before the time line draws it
        last = int(seat.settled(NOW))
        _looked_back(seat, last)


def _looked_back(seat: Seat, last: int) -> None:
    """Any tick is shown as it was: stopped at first, started where its stage begins to be `moving`."""
    shown = "document.querySelector('[aria-label=\"Level drive\"]').innerText"
    seat.press("l", "home", "right")
    seat.wait(f"{NOW} === 1 && {shown}.includes('table stop')")
    seat.press("escape", "f")
    seat.write("drive.stage = moving")
    seat.press("enter", "escape")
    seat.wait(f"{NOW} > 1 && {shown}.includes('table goto, line start')")
    assert seat.tick() < last
    seat.press("e")
    seat.wait(f"{NOW} === {last} && !{shown}.includes('line start')")


def shown_by_mouse(seat: Seat) -> None:
    """From the card that says what it is to a file that is handed on: run, looked at, played, proved together, shared."""
    seat.click(seat.button("Run the demo"))
    seat.until(".ended", "the script is at its end")
    seat.click(seat.button("Levels"))
    seat.click_time(0.3)
    seat.wait(f"{NOW} > 10 && {NOW} < 100")
    seat.click(seat.button("Curves"))
    seat.wait(GRAPHS)
    seat.click(seat.button("Play"))
    seat.wait(f"{NOW} > 110")
    seat.click(seat.button("Stop"))
    seat.click(seat.button("System"))
    seat.wait("document.querySelector('.view-system svg')?.checkVisibility()")
    seat.click("#verdict summary")
    seat.click(seat.button("Prove the levels together", "#verdict"))
    seat.until("#verdict summary", "requirements proved")
    seat.click("#verdict summary")
    seat.click(seat.button("Share"))
    seat.click(seat.button("Tick"))


def shown_by_keys(seat: Seat) -> None:
    """The same without a mouse."""
    seat.go_to("Run the demo")
    seat.press("enter")
    seat.until(".ended", "the script is at its end")
    seat.press("escape", "1", "l", "home", "pageup", "escape")
    seat.wait(f"{NOW} > 10 && {NOW} < 110")
    seat.press("5")
    seat.wait(GRAPHS)
    seat.press("k")
    seat.wait(f"{NOW} > 120")
    seat.press("k", "6")
    seat.wait("document.querySelector('.view-system svg')?.checkVisibility()")
    seat.value("document.querySelector('#verdict summary').focus()")
    seat.press("enter")
    seat.go_to("Prove the levels together")
    seat.press("enter")
    seat.until("#verdict summary", "requirements proved")
    seat.press("escape", "x")
    seat.go_to("Tick")
    seat.press("enter")


@pytest.mark.parametrize("hands", [shown_by_mouse, shown_by_keys])
def test_a_robot_is_run_looked_back_at_played_proved_together_and_handed_on(
    hands: Callable[[Seat], None], tmp_path: Path
) -> None:
    """With the tests below and above, the first ten minutes as the guide of the studio tells them."""
    system = dock(tmp_path / "dock")
    assert rcsc(["compile", "-q", str(system)]) == 0
    with seated(Opening(system, script="dock.csv"), first_time=True, in_space=True) as seat:
        seat.until("#about", "exactly one line of its state table matches")
        hands(seat)
        seat.until("#said", "is shared as ")


def never(_: Path) -> None:
    """A proof that does not end."""
    time.sleep(3600)


def test_what_takes_long_says_so_and_is_cancelled_by_a_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rcsc.desk.studio.build.proved_together", never)
    with seated(Opening(dock(tmp_path / "dock"))) as seat:
        seat.until("#state", "paused at cycle 0")
        seat.press("c")
        seat.write("reload drive proved")
        seat.press("enter")
        seat.until("#said", "reload drive proved: proving the levels together, 1 s")
        seat.press("escape", "s")
        seat.until("#state", "paused at cycle 1")  # the levels do not wait for it
        seat.press(".")
        seat.until(".transcript .wrong", "cancelled")
        seat.wait("document.querySelector('#said').innerText === ''")


def test_the_paper_s_part_reaches_the_pallet_and_is_looked_at_in_a_file(tmp_path: Path) -> None:
    system = Path(__file__).parents[2] / "tables" / "system.toml"

    async def inside() -> tuple[list[str], str]:
        async with page(server) as one:
            await one.heard("run.state", open=True)
            await one.ask("run.go")
            await one.heard("run.state", ended="cycle 2073: the script is at its end")
            rows = [row["state"] for row in (await one.heard("run.rows", over=True))["rows"]]
            last = (await one.heard("run.state", going=False))["tick"]
            return rows, (await one.ask("share.moment", tick=last, around=3))["text"]

    opening = Opening(system, plant="kinematic", script="make_boxt")
    with serving(opening, drawer=Drawn(system)) as server:
        rows, text = asyncio.run(inside())
    assert len(rows) == 27
    assert set(rows) == {"done"}
    file = tmp_path / "pallet.html"
    file.write_text(text, encoding="utf-8")
    with Seat(WIDE, HIGH) as seat:
        seat.open(file.as_uri())
        seat.wait("document.querySelector('#cell svg')?.getBoundingClientRect().height > 100")
        seat.until("#cell figcaption", "drawn of tick ")
        assert not seat.said
