"""Curves and player in a real browser: what was recorded is played, all curves and the time line show the same ticks."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rcsc.desk.shell.opening import Opening
from tests.studio.driven import Seat, dock, seated

pytestmark = pytest.mark.needs("chromium")
TRIGGER = 'input[aria-label^="A condition: the curves"]'
SHOWN = "[...document.querySelectorAll('.graph')].map(({ dataset }) => dataset.shown)"
NOW = "document.querySelector('#time [role=slider]').getAttribute('aria-valuenow')"
"""The tick that everybody looks at."""


@pytest.fixture
def seat(tmp_path: Path) -> Iterator[Seat]:
    """The docking robot after its script, with the curves that it shows by itself."""
    with seated(Opening(dock(tmp_path / "dock"), script="dock.csv")) as one:
        one.until("#state", "paused at cycle 0")
        one.press("space")
        one.until(".ended", "the script is at its end")
        one.press("5")
        one.wait("document.querySelector('.view-plots, .graphs')?.checkVisibility()")
        one.wait(f"{SHOWN}.length > 2 && {SHOWN}.slice(0, 3).every(Boolean)")
        yield one


def shown(seat: Seat) -> list[tuple[int, int]]:
    """The ticks that each graph over time shows."""
    return [(int(one.split()[0]), int(one.split()[1])) for one in seat.settled(SHOWN) if one]


def test_what_was_recorded_is_played_stopped_and_played_again_and_again(seat: Seat) -> None:
    last = seat.tick()
    seat.press("l", "home", "escape", "k")
    seat.wait(f"Number({NOW}) > 5")
    seat.press("k")
    assert 5 < int(seat.settled(NOW)) < last
    seat.click('#time input[type="checkbox"]')
    seat.choose("#time .bar select[aria-label^='How fast it plays']", "20")
    seat.press("escape", "k")
    before = "(window.seen ??= []).push(Number(NOW))".replace("NOW", NOW)
    seat.wait(
        f"({before}, window.seen.some((tick, at) => at && tick < window.seen[at - 1]))"
    )  # it began again
    seat.press("]")  # who looks elsewhere is not led on
    seat.settled(NOW)
    seat.wait("document.querySelector('#time [aria-pressed]').getAttribute('aria-pressed') === 'false'")


def test_it_is_not_played_while_it_runs(seat: Seat) -> None:
    seat.press("c")
    seat.write("run 5000")
    seat.press("enter", "escape")
    seat.until("#state", "runs at cycle")
    assert seat.value(f"{seat.button('Play')}.disabled")
    seat.press("k", "space")
    seat.until("#state", "paused at cycle")
    assert not seat.value(f"{seat.button('Play')}.disabled")


def test_time_line_and_all_curves_show_the_same_ticks(seat: Seat) -> None:
    whole = shown(seat)
    assert len(set(whole)) == 1
    seat.press("l", "home", "escape", "+", "+")
    seat.wait(f"{SHOWN}[0] !== '{whole[0][0]} {whole[0][1]}'")
    near = shown(seat)
    assert len(set(near)) == 1
    assert near[0][1] - near[0][0] < (whole[0][1] - whole[0][0]) / 2
    left, top, width, height = seat.value(
        "(({ left, top, width, height }) => [left, top, width, height])"
        "(document.querySelector('.graph .u-over').getBoundingClientRect())"
    )
    seat.mouse("mouseMoved", left + width * 0.25, top + height / 2, 0)
    seat.mouse("mousePressed", left + width * 0.25, top + height / 2)
    seat.mouse("mouseMoved", left + width * 0.5, top + height / 2)
    seat.mouse("mouseMoved", left + width * 0.75, top + height / 2)
    seat.mouse("mouseReleased", left + width * 0.75, top + height / 2)
    seat.wait(f"{SHOWN}[0] !== '{near[0][0]} {near[0][1]}'")
    dragged = shown(seat)
    assert len(set(dragged)) == 1
    assert near[0][0] < dragged[0][0] < dragged[0][1] < near[0][1]
    seat.press("0")
    seat.wait(f"{SHOWN}[0] === '{whole[0][0]} {whole[0][1]}'")
    assert len(set(shown(seat))) == 1


def test_the_pointer_reads_all_curves_at_its_tick(seat: Seat) -> None:
    left, top, width, height = seat.value(
        "(({ left, top, width, height }) => [left, top, width, height])"
        "(document.querySelector('.graph .u-over').getBoundingClientRect())"
    )
    seat.mouse("mouseMoved", left + width * 0.1, top + height / 2, 0)
    seat.wait(
        "[...document.querySelectorAll('.graph .legend')].some((one) => one.innerText.includes('at tick '))"
    )
    assert "drive.travelled_mm = 0 mm" not in seat.reads(".graphs")
    seat.mouse("mouseMoved", 5, 5, 0)
    seat.wait(
        "![...document.querySelectorAll('.graph .legend')].some((one) => one.innerText.includes('at tick '))"
    )


def test_a_derivative_is_drawn_in_its_unit_and_a_variable_is_dropped_in(seat: Seat) -> None:
    graphs = seat.value("document.querySelectorAll('.graph').length")
    seat.click('button[aria-label="Add how fast drive.travelled_mm changes"]')
    seat.until(".legend", "d(drive.travelled_mm) = ")
    seat.press("l", "home", "pageup", "escape")  # on its way back
    seat.until(".legend", " mm/s")
    seat.value(
        "(() => { const moved = new DataTransfer(); moved.setData('text/plain', 'drive.lateral_mm');"
        "const drop = new DragEvent('drop', { bubbles: true, cancelable: true, dataTransfer: moved });"
        "document.querySelector('.graph').dispatchEvent(drop); })()"
    )
    seat.until(".graph .legend", "drive.lateral_mm = ")
    assert seat.value("document.querySelectorAll('.graph').length") == graphs
    seat.press("1")
    seat.press("v")
    seat.wait("document.querySelector('table.values td[draggable=true]')?.checkVisibility()")


def test_a_trigger_shows_its_tick_with_some_time_before_it(seat: Seat) -> None:
    seat.press("l", "home", "escape", "+", "+")
    seat.click(TRIGGER)
    seat.write("drive.speed_mm_s < 0")
    seat.press("enter", "escape")
    seat.wait(f"Number({NOW}) > 50")
    tick = int(seat.settled(NOW))
    first, last = shown(seat)[0]
    assert first < tick < last
    assert tick - first < last - tick, "more time after it than before"
    assert "drive.speed_mm_s = -" in seat.reads(".graphs")


def test_a_trigger_that_has_not_come_runs_until_it_does(seat: Seat) -> None:
    last = seat.tick()
    seat.click(TRIGGER)
    seat.write("supervisor.now = nowhere")
    seat.press("enter")
    seat.until("#said", "nowhere")  # no such word: told, and nothing runs
    assert int(seat.settled(NOW)) == last
